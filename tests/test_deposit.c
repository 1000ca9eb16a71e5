// the bed: deposition and erosion of what was deposited, save and load to the last bit

#include "bed_bench.h"

#include <unistd.h>

// ---------------------------------------------------------------- deposition

// parcels drop along x = constant until they touch the surface; what is refused is put aside
static void drop_parcels(bench *b, int n, double lo, double hi, double r, double mass, int count[3]) {
    uint64_t seed = 11;
    const double initial = b->bed.solid_mass, water = pore_water(b) + b->bed.pore_water;
    double taken = 0;
    for (int k = 0; k < n; k++) {
        const double x = lo + (hi - lo) * silt_uniform(&seed);
        const double at[2] = {x, silt_bed_level(&b->bed, (double[]){x}) + r + 0.3 * b->scene.bed.size * silt_uniform(&seed)};
        const double solid = b->bed.solid_mass, pores = b->bed.pore_water, pores_rest = b->bed.pore_rest, area = bed_area(&b->bed);
        const int64_t revision = b->bed.revision;
        silt_deposit deposit = {0};
        count[silt_bed_deposit(&b->bed, &b->scene, at, r, mass, NULL, &deposit)]++;
        if (deposit.kind != DEPOSIT_REFUSED)
            taken += mass;
        NEAR(b->bed.solid_mass - solid, deposit.kind == DEPOSIT_REFUSED ? 0 : mass, 1e-13 * initial);
        NEAR(b->bed.solid_mass, initial + taken, 1e-13 * initial);
        double sum = pores, rest = pores_rest;
        silt_sum(&sum, &rest, -deposit.pore_water);
        NEAR(b->bed.pore_water, sum, 0);
        NEAR(pore_water(b) + b->bed.pore_water, water, 1e-12 * water);
        NEAR(bed_area(&b->bed) - area, deposit.area, 1e-12);
        assert_true((b->bed.revision > revision) == (deposit.kind != DEPOSIT_REFUSED));
        assert_true((deposit.kind == DEPOSIT_CELL) == (deposit.node >= 0));
        for (int c = 0; c < b->bed.n_cell; c++)
            assert_in_range(1000 * (1 - b->bed.mass[c] / 2650 / b->bed.area[c]), 199, 801);
        if (deposit.kind == DEPOSIT_CELL) {
            assert_true(deposit.n_cell >= 1 && b->bed.alive[deposit.node] && b->bed.work[deposit.node] == 0);
            NEAR(hypot(b->bed.x[deposit.node][0] - at[0], b->bed.x[deposit.node][1] - at[1]), 0,
                 0.5 * b->scene.bed.size + r);
            for (int c = 0; c < deposit.n_cell; c++)
                assert_true(b->bed.cell[deposit.cell[c]][2] == deposit.node);
        }
        if (k % 20 == 0)
            check_bed(b);
    }
    check_bed(b);
}

static void test_deposit(void **state) {
    (void)state;
    for (int k = 0; k < 4; k++) {
        // flat or sloping, parcels of 0.3 or 0.6 of the spacing
        const bool slope = k & 1;
        bench b;
        bench_open(&b, 0.05);
        if (slope)
            bench_polygon(&b, 4, (double[]){0, 0, 1, 0, 1, 0.15, 0, 0.55});
        else
            bench_box(&b, 0, 0, 1, 0.15);
        bench_wall(&b, 4, (double[]){0, 1, 0, 0, 1, 0, 1, 1});
        bench_create(&b);
        const double initial = b.bed.solid_mass, area = bed_area(&b.bed);
        int count[3] = {0};
        // solid 0.575 d^2 per metre of width
        const double d = (k < 2 ? 0.3 : 0.6) * 0.05, mass = 2650 * 0.575 * d * d;
        drop_parcels(&b, k < 2 ? 600 : 200, 0.01, 0.99, 0.5 * d, mass, count);
        print_message("%s: %d parcels became cells, %d went into pores, %d were refused\n", slope ? "slope" : "flat",
                      count[DEPOSIT_CELL], count[DEPOSIT_DENSER], count[DEPOSIT_REFUSED]);
        assert_true(count[DEPOSIT_CELL] > 30);
        assert_true(bed_area(&b.bed) > area);

        // far away, or inside: refused
        silt_deposit deposit = {0};
        assert_int_equal(silt_bed_deposit(&b.bed, &b.scene, (double[2]){0.5, 0.95}, 0.01, mass, NULL, &deposit),
                         DEPOSIT_REFUSED);
        assert_int_equal(silt_bed_deposit(&b.bed, &b.scene, (double[2]){0.5, 0.05}, 0.01, mass, NULL, &deposit),
                         DEPOSIT_REFUSED);

        // what was deposited erodes again, to the last cell
        bench_water(&b, 0, 0, 1, 1, 0.05, 0.9, 0.4);
        double released = 0;
        const double total = b.bed.solid_mass, water = pore_water(&b) + b.bed.pore_water;
        for (int step = 0; b.bed.n_cell > 0 && step < 4000; step++) {
            bench_wear(&b, 50);
            int node[64];
            const int n = silt_bed_due(&b.bed, &b.scene, 64, node);
            for (int q = 0; q < n; q++) {
                silt_patch patch;
                silt_bed_patch(&b.bed, node[q], &patch);
                silt_bed_release(&b.bed, &b.scene, &patch);
                released += patch.mass;
                NEAR(b.bed.solid_mass + released, total, 1e-13 * total);
            }
        }
        assert_int_equal(b.bed.n_cell, 0);
        NEAR(b.bed.pore_water, water, 1e-12 * water);
        NEAR(b.bed.initial_mass, initial, 0);
        bench_close(&b);
    }
}

// a parcel beside another one that its cell would hold: with it when that is at rest and there is room for both, else not as a cell
static void test_neighbour(void **state) {
    (void)state;
    enum { FAR, MOVES, RESTS, HEAVY };
    for (int kind = FAR; kind <= HEAVY; kind++) {
        bench b;
        bench_open(&b, 0.1);
        bench_box(&b, 0, 0, 1, 0.2);
        bench_wall(&b, 4, (double[]){0, 1, 0, 0, 1, 0, 1, 1});
        bench_create(&b);
        heap h = {0};
        const double r = 0.03, mass = 2650 * 0.0012, at[3] = {0.55, 0.25, 0}, beside[3] = {kind == FAR ? 0.75 : 0.58, 0.21, 0};
        heap_add(&h, at, r, mass, true);
        heap_add(&h, beside, 0.01, kind == HEAVY ? 3 * mass : 0.1 * mass, kind != MOVES);
        silt_bed_others others = {0};
        silt_bed_others_take(&others, &h.state, h.at_rest);
        silt_bed_others_mark(&others, at, true);
        silt_deposit deposit;
        const double before = b.bed.solid_mass;
        const silt_deposit_kind got = silt_bed_deposit(&b.bed, &b.scene, at, r, mass, &others, &deposit);
        assert_int_equal(got == DEPOSIT_CELL, kind == FAR || kind == RESTS);
        assert_int_equal(silt_bed_contains(&b.bed, beside), kind == RESTS);
        assert_int_equal(deposit.n_other, kind == RESTS);
        if (kind == RESTS)
            assert_int_equal(deposit.other[0], 1);
        NEAR(b.bed.solid_mass - before, got == DEPOSIT_REFUSED ? 0 : kind == RESTS ? 1.1 * mass : mass, 1e-13 * before);
        silt_bed_others_clear(&others);
        bench_close(&b);
    }
}

static void test_heap(void **state) {
    (void)state;
    int count[4] = {0};
    for (int k = 0; k < 2; k++) {
        // flat or sloping, grains of half the spacing or a fifth of it, four in five at rest
        bench b;
        bench_open(&b, 0.1);
        if (k)
            bench_polygon(&b, 4, (double[]){0, 0, 2, 0, 2, 0.2, 0, 0.8});
        else
            bench_box(&b, 0, 0, 2, 0.3);
        bench_wall(&b, 4, (double[]){0, 2, 0, 0, 2, 0, 2, 2});
        bench_create(&b);
        heap h = {0};
        uint64_t seed = 21;
        for (int m = 0; m < 200; m++) {
            const double r = m % 2 ? 0.025 : 0.01, x = 0.02 + 1.96 * silt_uniform(&seed);
            const double at[3] = {x, silt_bed_level(&b.bed, (double[]){x}) + r * (1.1 + 3 * silt_uniform(&seed)), 0};
            heap_add(&h, at, r, 2650 * 0.575 * 4 * r * r, silt_uniform(&seed) < 0.8);
        }
        heap_deposit(&b.bed, &b.scene, &h, count);
        check_bed(&b);
        bench_close(&b);
    }
    print_message("of the heap %d became cells, %d of them with others, %d went into pores, %d wait\n", count[0], count[1], count[2], count[3]);
    assert_true(count[0] >= 20 && count[1] >= 10 && count[3] > 20);
}

static void test_deposit_erode_mixed(void **state) {
    (void)state;
    // both at once for a long time: bed and what is outside stay together constant
    bench b;
    bench_open(&b, 0.05);
    bench_polygon(&b, 5, (double[]){0, 0, 1, 0, 1, 0.1, 0.5, 0.35, 0, 0.15});
    bench_wall(&b, 4, (double[]){0, 1, 0, 0, 1, 0, 1, 1});
    bench_create(&b);
    bench_water(&b, 0, 0, 1, 1, 0.05, 0.9, 0.4);
    const double initial = b.bed.solid_mass, water = pore_water(&b), d = 0.3 * 0.05, parcel = 2650 * 0.575 * d * d;
    double outside = 0;
    uint64_t seed = 5;
    int count[3] = {0};
    for (int step = 0; step < 300; step++) {
        bench_wear(&b, 20);
        int node[64];
        for (int kind = 0; kind < 2; kind++) {
            const int n = kind ? silt_bed_loose(&b.bed, &b.scene, 64, node) : silt_bed_due(&b.bed, &b.scene, 64, node);
            for (int k = 0; k < n; k++) {
                silt_patch patch;
                silt_bed_patch(&b.bed, node[k], &patch);
                silt_bed_release(&b.bed, &b.scene, &patch);
                outside += patch.mass;
            }
        }
        for (int k = 0; k < 12 && outside >= parcel; k++) {
            const double x = silt_uniform(&seed), up = 0.5 * d + 0.3 * 0.05 * silt_uniform(&seed);
            silt_deposit deposit = {0};
            const double level = silt_bed_level(&b.bed, (double[]){x});
            if (level > 0 && silt_bed_deposit(&b.bed, &b.scene, (double[2]){x, level + up}, 0.5 * d, parcel, NULL, &deposit))
                outside -= parcel;
            count[deposit.kind]++;
        }
        NEAR(b.bed.solid_mass + outside, initial, 1e-13 * initial);
        NEAR(b.bed.pore_water + pore_water(&b), water, 1e-12 * water);
        if (step % 20 == 0)
            check_bed(&b);
    }
    print_message("mixed: %d cells, %d into pores, %d refused; %.3f of the bed left\n", count[DEPOSIT_CELL],
                  count[DEPOSIT_DENSER], count[DEPOSIT_REFUSED], b.bed.solid_mass / initial);
    assert_true(count[DEPOSIT_CELL] > 50);
    bench_close(&b);
}

// ---------------------------------------------------------------- save and load

static void same_bits(const silt_bed *a, const silt_bed *b) {
    const size_t n = (size_t)a->n_node, c = (size_t)a->n_cell, e = (size_t)a->n_edge;
    assert_int_equal(a->n_node, b->n_node);
    assert_int_equal(a->n_cell, b->n_cell);
    assert_int_equal(a->n_edge, b->n_edge);
    assert_int_equal(a->revision, b->revision);
    assert_memory_equal(a->x, b->x, n * sizeof *a->x);
    assert_memory_equal(a->alive, b->alive, n);
    assert_memory_equal(a->exposed, b->exposed, n);
    assert_memory_equal(a->work, b->work, n * sizeof *a->work);
    assert_memory_equal(a->eroded, b->eroded, n * sizeof *a->eroded);
    assert_memory_equal(a->shear, b->shear, n * sizeof *a->shear);
    assert_memory_equal(a->fluid_node, b->fluid_node, n * sizeof *a->fluid_node);
    if (c > 0) {
        assert_memory_equal(a->cell, b->cell, c * sizeof *a->cell);
        assert_memory_equal(a->mass, b->mass, c * sizeof *a->mass);
        assert_memory_equal(a->area, b->area, c * sizeof *a->area);
        assert_memory_equal(a->edge, b->edge, e * sizeof *a->edge);
    }
    assert_memory_equal(&a->solid_mass, &b->solid_mass, sizeof a->solid_mass);
    assert_memory_equal(&a->initial_mass, &b->initial_mass, sizeof a->initial_mass);
    assert_memory_equal(&a->pore_water, &b->pore_water, sizeof a->pore_water);
}

static void bench_step(bench *b, uint64_t *seed) {
    bench_wear(b, 30);
    int node[16];
    const int n = silt_bed_due(&b->bed, &b->scene, 16, node);
    for (int k = 0; k < n; k++) {
        silt_patch patch;
        silt_bed_patch(&b->bed, node[k], &patch);
        silt_bed_release(&b->bed, &b->scene, &patch);
    }
    const double x = silt_uniform(seed), level = silt_bed_level(&b->bed, (double[]){x});
    silt_deposit deposit = {0};
    if (level > 0)
        silt_bed_deposit(&b->bed, &b->scene, (double[2]){x, level + 0.02}, 0.0075, 0.3, NULL, &deposit);
}

static void test_save_load(void **state) {
    (void)state;
    bench b;
    bench_open(&b, 0.05);
    bench_polygon(&b, 5, (double[]){0, 0, 1, 0, 1, 0.1, 0.5, 0.35, 0, 0.15});
    bench_wall(&b, 4, (double[]){0, 1, 0, 0, 1, 0, 1, 1});
    b.scene.bed.layer = 0.02;
    bench_create(&b);
    bench_water(&b, 0, 0, 1, 1, 0.05, 0.9, 0.4);
    uint64_t seed = 7;
    for (int k = 0; k < 40; k++)
        bench_step(&b, &seed);

    silt_error err = {0};
    char path[64];
    snprintf(path, sizeof path, "test_bed_%d.h5", (int)getpid());
    for (int gone = 0; gone < 2; gone++) {
        silt_store *store = NULL;
        if (silt_store_create(&store, path, &err) || silt_bed_save(&b.bed, store, &err) ||
            silt_store_commit(&store, &err))
            fail_msg("%s", err.text);
        silt_store_close(&store);
        silt_bed loaded = {0};
        if (silt_store_open(&store, path, &err) || silt_bed_load(&loaded, NULL, store, &err))
            fail_msg("%s", err.text);
        silt_store_close(&store);
        same_bits(&b.bed, &loaded);

        // both go on alike, to the last bit
        bench other = b;
        other.bed = loaded;
        other.scene.bed.region = other.region;
        uint64_t again = seed;
        for (int k = 0; k < 300; k++) {
            bench_step(&b, &seed);
            bench_step(&other, &again);
        }
        same_bits(&b.bed, &other.bed);
        silt_bed_clear(&other.bed);

        // and once more with nothing left of it
        for (int i = 0; i < b.bed.n_node; i++) {
            silt_patch patch;
            silt_bed_patch(&b.bed, i, &patch);
            silt_bed_release(&b.bed, &b.scene, &patch);
        }
        assert_int_equal(b.bed.n_cell, 0);
    }
    unlink(path);
    silt_bed_clear(&b.bed);
    silt_bed_clear(&b.bed);
    bench_close(&b);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_deposit),
        cmocka_unit_test(test_neighbour),
        cmocka_unit_test(test_heap),
        cmocka_unit_test(test_deposit_erode_mixed),
        cmocka_unit_test(test_save_load),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
