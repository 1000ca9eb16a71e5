// the bed: exact areas and masses, onset of erosion (2006 paper), rate, release to the last cell

#include "bed_bench.h"

#include "crowd.h"

// ---------------------------------------------------------------- creation

static void check_created(bench *b, double area) {
    bench_create(b);
    NEAR(bed_area(&b->bed), area, 1e-12 * area);
    NEAR(b->bed.solid_mass, 2650 * 0.6 * area, 1e-12 * 2650 * 0.6 * area);
    NEAR(b->bed.initial_mass, b->bed.solid_mass, 0);
    check_bed(b);
    // the surface is as long as what the tank does not hold, and cells are as wide as asked for
    double longest = 0, least = HUGE_VAL;
    for (int c = 0; c < b->bed.n_cell; c++)
        for (int a = 0; a < 3; a++) {
            const double *p = b->bed.x[b->bed.cell[c][a]], *q = b->bed.x[b->bed.cell[c][(a + 1) % 3]];
            longest = silt_max(longest, hypot(q[0] - p[0], q[1] - p[1]));
            least = silt_min(least, hypot(q[0] - p[0], q[1] - p[1]));
        }
    assert_true(longest < 2 * b->scene.bed.size);
    assert_true(least > 1e-3 * b->scene.bed.size);
}

static double surface_length(const silt_bed *bed) {
    double length = 0;
    for (int e = 0; e < bed->n_edge; e++)
        length += hypot(bed->x[bed->edge[e][1]][0] - bed->x[bed->edge[e][0]][0],
                        bed->x[bed->edge[e][1]][1] - bed->x[bed->edge[e][0]][1]);
    return length;
}

static void test_create_box(void **state) {
    (void)state;
    bench b;
    bench_open(&b, 0.05);
    bench_box(&b, 0, 0, 1, 0.3);
    // the tank's floor has a corner under the bed where the bed has none
    bench_wall(&b, 5, (double[]){0, 1, 0, 0, 0.333, 0, 1, 0, 1, 1});
    check_created(&b, 0.3);
    NEAR(surface_length(&b.bed), 1, 1e-12);
    // bed on the right: the surface runs from left to right, its normal upwards
    for (int e = 0; e < b.bed.n_edge; e++)
        assert_true(b.bed.x[b.bed.edge[e][1]][0] > b.bed.x[b.bed.edge[e][0]][0]);
    for (int i = 0; i < b.bed.n_node; i++)
        if (b.bed.exposed[i]) {
            double n[2];
            silt_bed_normal(&b.bed, i, n);
            NEAR(n[0], 0, 1e-12);
            NEAR(n[1], 1, 1e-12);
        }
    NEAR(silt_bed_level(&b.bed, (double[]){0.4321}), 0.3, 1e-15);
    NEAR(silt_bed_level(&b.bed, (double[]){0}), 0.3, 1e-15);
    assert_true(silt_bed_level(&b.bed, (double[]){1.01}) == -HUGE_VAL);
    bench_close(&b);
}

static void test_create_polygon(void **state) {
    (void)state;
    // a hill with a thin toe (4 degrees) and a notch
    bench b;
    bench_open(&b, 0.03);
    bench_polygon(&b, 7, (double[]){0, 0, 2, 0, 1.1, 0.4, 0.9, 0.38, 0.8, 0.1, 0.7, 0.35, 0.6, 0.042});
    check_created(&b, 0.5 * fabs(0 + (1.1 * 0 - 2 * 0.4) + (0.9 * 0.4 - 1.1 * 0.38) + (0.8 * 0.38 - 0.9 * 0.1) +
                                 (0.7 * 0.1 - 0.8 * 0.35) + (0.6 * 0.35 - 0.7 * 0.042)));
    bench_close(&b);
}

static void test_create_touching(void **state) {
    (void)state;
    // three regions, one of them standing on parts of two others: no surface between them
    bench b;
    bench_open(&b, 0.04);
    bench_box(&b, 0, 0, 0.53, 0.2);
    bench_box(&b, 0.53, 0, 1, 0.2);
    bench_polygon(&b, 3, (double[]){0.31, 0.2, 0.77, 0.2, 0.5, 0.41});
    check_created(&b, 0.2 + 0.5 * 0.46 * 0.21);
    NEAR(surface_length(&b.bed), 1 + 0.4 + 0.54 + hypot(0.19, 0.21) + hypot(0.27, 0.21), 1e-12);
    NEAR(silt_bed_level(&b.bed, (double[]){0.5}), 0.41, 1e-15);
    bench_close(&b);

    // two that overlap are one: area of the union
    bench_open(&b, 0.04);
    bench_box(&b, 0, 0, 0.6, 0.2);
    bench_box(&b, 0.4, 0.1, 1, 0.3);
    check_created(&b, 0.12 + 0.12 - 0.02);
    bench_close(&b);

    // a disc is the polygon of its nodes
    bench_open(&b, 0.04);
    b.region[b.scene.bed.n_region++] = (silt_region){.kind = REGION_CIRCLE, .centre = {0.5, 0.5}, .radius = 0.3};
    const int n = (int)lround(2 * M_PI * 0.3 / 0.04);
    check_created(&b, 0.5 * n * 0.09 * sin(2 * M_PI / n));
    bench_close(&b);

    // nothing there: refused with the scene's name and the key
    bench_open(&b, 0.04);
    silt_error err = {0};
    assert_int_equal(silt_bed_create(&b.bed, &b.scene, NULL, &err), SILT_INPUT);
    assert_non_null(strstr(err.text, "bench"));
    assert_non_null(strstr(err.text, "bed.regions"));
    bench_close(&b);
}

static void test_contains(void **state) {
    (void)state;
    bench b;
    bench_open(&b, 0.05);
    bench_polygon(&b, 4, (double[]){0, 0, 1, 0, 0.7, 0.3, 0.2, 0.3});
    bench_create(&b);
    uint64_t seed = 3;
    for (int round = 0; round < 10; round++) {
        for (int k = 0; k < 2000; k++) {
            const double x[2] = {1.4 * silt_uniform(&seed) - 0.2, 0.8 * silt_uniform(&seed) - 0.2};
            bool inside = false;
            for (int c = 0; c < b.bed.n_cell && !inside; c++) {
                const int *p = b.bed.cell[c];
                inside = cross(b.bed.x[p[0]], b.bed.x[p[1]], x) >= 0 && cross(b.bed.x[p[1]], b.bed.x[p[2]], x) >= 0 &&
                         cross(b.bed.x[p[2]], b.bed.x[p[0]], x) >= 0;
            }
            assert_int_equal(inside, silt_bed_contains(&b.bed, x));
        }
        // and again with a hole in it
        silt_patch patch = {0};
        for (int i = (int)(silt_random(&seed) % (uint64_t)b.bed.n_node); patch.n_cell == 0; i = (i + 1) % b.bed.n_node)
            silt_bed_patch(&b.bed, i, &patch);
        silt_bed_release(&b.bed, &b.scene, &patch);
    }
    bench_close(&b);
}

// ---------------------------------------------------------------- onset

// steps until the first node is due; the bed must have no node due before
static int onset(bench *b, double dt, int most) {
    int due[8];
    for (int k = 1; k <= most; k++) {
        bench_wear(b, dt);
        if (silt_bed_due(&b->bed, &b->scene, 8, due) > 0)
            return k;
    }
    return -1;
}

static void bench_flat(bench *b, double size, double h, double speed) {
    bench_open(b, size);
    bench_box(b, 0, 0, 0.5, 0.1);
    bench_wall(b, 4, (double[]){0, 1, 0, 0, 0.5, 0, 0.5, 1});
    b->scene.bed.distance = h;
    bench_create(b);
    bench_water(b, 0, 0.1, 0.5, 0.2, 0.01, speed, 0);
    // the bed's surface nodes are nodes of the water
    for (int i = 0; i < b->bed.n_node; i++)
        for (int k = 0; b->bed.exposed[i] && k < b->nodes.count; k++)
            if (hypot(b->nodes.x[2 * k] - b->bed.x[i][0], b->nodes.x[2 * k + 1] - b->bed.x[i][1]) < 1e-9)
                b->bed.fluid_node[i] = k;
}

static void test_onset_frictional_work(void **state) {
    (void)state;
    // t_e = 4 W_c h^2 / (mu v^2) = 40 s, shear mu v / (2 h) = 0.05 Pa
    bench b;
    bench_flat(&b, 0.05, 0.01, 1);
    assert_int_equal(onset(&b, 0.5, 100), 80);
    for (int i = 0; i < b.bed.n_node; i++)
        if (b.bed.exposed[i]) {
            NEAR(b.bed.work[i], 100, 1e-9);
            NEAR(b.bed.shear[i], 0.05, 1e-12);
        }
    bench_close(&b);

    // half the distance at the same speed: a quarter of the time
    bench_flat(&b, 0.05, 0.005, 1);
    assert_int_equal(onset(&b, 0.5, 100), 20);
    bench_close(&b);

    // half the distance at the same shear rate v/h = 100 /s: the same time
    for (int half = 0; half < 2; half++) {
        bench_flat(&b, 0.05, half ? 0.005 : 0.01, 0);
        for (int k = 0; k < b.nodes.count; k++)
            b.nodes.v[2 * k] = 100 * (b.nodes.x[2 * k + 1] - 0.1);
        assert_int_equal(onset(&b, 0.5, 100), 80);
        bench_close(&b);
    }
}

static void test_onset_dissipation(void **state) {
    (void)state;
    // t_e = W_c h^2 / (mu v^2) = 10 s with the true shear mu v/h = 0.1 Pa of the first row of cells
    bench b;
    bench_flat(&b, 0.05, 0.01, 1);
    b.scene.bed.law = BED_DISSIPATION;
    b.scene.bed.shear = SHEAR_GRADIENT;
    for (int k = 0; k < b.nodes.count; k++)
        if (b.nodes.x[2 * k + 1] < 0.1 + 1e-9)
            b.nodes.v[2 * k] = 0;
    assert_int_equal(onset(&b, 0.125, 100), 80);
    for (int i = 0; i < b.bed.n_node; i++)
        if (b.bed.exposed[i])
            NEAR(b.bed.shear[i], 0.1, 1e-10);
    bench_close(&b);

    // water that turns like a solid does no work
    bench_flat(&b, 0.05, 0.01, 0);
    b.scene.bed.law = BED_DISSIPATION;
    b.scene.bed.shear = SHEAR_GRADIENT;
    for (int k = 0; k < b.nodes.count; k++) {
        b.nodes.v[2 * k] = -3 * (b.nodes.x[2 * k + 1] - 0.1);
        b.nodes.v[2 * k + 1] = 3 * b.nodes.x[2 * k];
    }
    bench_wear(&b, 1);
    for (int i = 0; i < b.bed.n_node; i++)
        NEAR(b.bed.shear[i], 0, 1e-14);
    bench_close(&b);
}

static void test_onset_ramp(void **state) {
    (void)state;
    // v = s t taken at midpoints: W = mu s^2/(4 h^2) (t^3/3 - t dt^2/12), the integral with the midpoint rule's exact
    // error
    bench b;
    bench_flat(&b, 0.05, 0.01, 0);
    const double s = 0.1, dt = 0.25;
    for (int step = 0; step < 40; step++) {
        for (int k = 0; k < b.nodes.count; k++)
            b.nodes.v[2 * k] = s * (step + 0.5) * dt;
        bench_wear(&b, dt);
    }
    const double t = 40 * dt, exact = 1e-3 * s * s * t * t * t / (12 * 0.01 * 0.01);
    for (int i = 0; i < b.bed.n_node; i++)
        if (b.bed.exposed[i])
            NEAR(b.bed.work[i], exact * (1 - dt * dt / (4 * t * t)), 1e-12 * exact);
    bench_close(&b);
}

static void test_threshold(void **state) {
    (void)state;
    for (int k = 0; k < 4; k++) {
        // shear is 0.05 Pa; no water at the sampled place; a bed that never erodes
        bench b;
        bench_flat(&b, 0.05, k == 2 ? 0.15 : 0.01, 1);
        b.scene.bed.threshold = k == 0 ? 0.051 : 0.049;
        if (k == 3)
            b.scene.bed.work = INFINITY;
        assert_int_equal(onset(&b, 0.5, 85), k == 1 ? 80 : -1);
        for (int i = 0; i < b.bed.n_node; i++)
            if (b.bed.exposed[i])
                NEAR(b.bed.shear[i], k == 2 ? 0 : 0.05, 1e-12);
        bench_close(&b);
    }
}

static void test_due_order(void **state) {
    (void)state;
    bench b;
    bench_flat(&b, 0.05, 0.01, 1);
    int due[4];
    for (int i = 0; i < b.bed.n_node; i++)
        if (b.bed.exposed[i])
            b.bed.work[i] = 100 + 10 * sin(20 * b.bed.x[i][0]);
    const int n = silt_bed_due(&b.bed, &b.scene, 4, due);
    assert_int_equal(n, 4);
    int fuller = 0;
    for (int k = 1; k < n; k++)
        assert_true(b.bed.work[due[k]] <= b.bed.work[due[k - 1]]);
    for (int i = 0; i < b.bed.n_node; i++)
        fuller += b.bed.work[i] > b.bed.work[due[3]];
    assert_int_equal(fuller, 3);
    bench_close(&b);
}

// ---------------------------------------------------------------- rate

// mass worn off in a given time under uniform water, with a layer of the scene's
static double eroded_mass(double size, double layer, double time, double *first) {
    bench b;
    bench_open(&b, size);
    bench_box(&b, 0, 0, 1, 0.6);
    bench_wall(&b, 4, (double[]){0, 1, 0, 0, 1, 0, 1, 1});
    b.scene.bed.layer = layer;
    b.scene.bed.work = 1;
    b.scene.bed.distance = 0.01;
    bench_create(&b);
    const double initial = b.bed.solid_mass, dt = 0.05;
    *first = 0;
    for (int step = 0; step * dt < time - 1e-9; step++) {
        // uniform work: every exposed node wears alike, whichever way it looks
        for (int i = 0; i < b.bed.n_node; i++)
            if (b.bed.exposed[i]) {
                silt_patch patch;
                silt_bed_patch(&b.bed, i, &patch);
                b.bed.work[i] += dt;
                b.bed.eroded[i] += patch.mass / patch.area * layer * dt / b.scene.bed.work;
            }
        int due[512];
        const int n = silt_bed_due(&b.bed, &b.scene, 512, due);
        if (n > 0 && *first == 0)
            *first = (step + 1) * dt;
        for (int k = 0; k < n; k++) {
            silt_patch patch;
            silt_bed_patch(&b.bed, due[k], &patch);
            silt_bed_release(&b.bed, &b.scene, &patch);
        }
    }
    const double mass = initial - b.bed.solid_mass;
    bench_close(&b);
    return mass;
}

static void test_rate(void **state) {
    (void)state;
    // before the first release e = rho_s (1 - n) h_0 W/W_c, whatever the cells' size
    for (int k = 0; k < 2; k++) {
        bench b;
        bench_flat(&b, k ? 0.025 : 0.05, 0.01, 1);
        b.scene.bed.layer = 0.004;
        for (int step = 0; step < 60; step++)
            bench_wear(&b, 0.5);
        for (int i = 0; i < b.bed.n_node; i++)
            if (b.bed.exposed[i])
                NEAR(b.bed.eroded[i], 2650 * 0.6 * 0.004 * b.bed.work[i] / 100, 1e-12);
        bench_close(&b);
    }
    // in the long run the mass follows the layer, not the cells: 1 m of surface sinks by 0.02 m/s for 16 s
    double first[3], rate[3];
    const double size[3] = {0.04, 0.02, 0.02}, layer[3] = {0.02, 0.02, 0.01};
    for (int k = 0; k < 3; k++) {
        const double early = eroded_mass(size[k], layer[k], 0.16 / layer[k], &first[k]);
        const double late = eroded_mass(size[k], layer[k], 0.48 / layer[k], &first[k]);
        rate[k] = (late - early) / (2650 * 0.6 * 0.32);
    }
    print_message("rate over that of a plane: %.3f coarse, %.3f fine, %.3f half the layer\n", rate[0], rate[1],
                  rate[2]);
    for (int k = 0; k < 3; k++)
        assert_true(fabs(rate[k] - rate[1]) < 0.1 * rate[1]);
    // finer patches hold less and leave the sooner
    assert_true(first[1] < 0.7 * first[0]);
}

// ---------------------------------------------------------------- release

static void test_release_all(void **state) {
    (void)state;
    bench b;
    bench_open(&b, 0.05);
    bench_polygon(&b, 4, (double[]){0, 0, 1, 0, 0.7, 0.3, 0.2, 0.3});
    bench_wall(&b, 3, (double[]){-0.5, 0, 0.37, 0, 1.5, 0});
    b.scene.bed.saturation = 0.8;
    bench_create(&b);
    bench_water(&b, -0.2, -0.2, 1.2, 0.6, 0.05, 0.9, 0.4);
    double released = 0, area = bed_area(&b.bed);
    const double initial = b.bed.solid_mass, water = pore_water(&b);
    int steps = 0, most = 0;
    for (; b.bed.n_cell > 0 && steps < 2000; steps++) {
        bench_wear(&b, 20);
        int node[64];
        for (int kind = 0; kind < 2; kind++) {
            const int n = kind ? silt_bed_loose(&b.bed, &b.scene, 64, node) : silt_bed_due(&b.bed, &b.scene, 64, node);
            most = n > most ? n : most;
            for (int k = 0; k < n; k++) {
                silt_patch patch;
                silt_bed_patch(&b.bed, node[k], &patch);
                const double before = b.bed.solid_mass;
                const int64_t revision = b.bed.revision;
                silt_bed_release(&b.bed, &b.scene, &patch);
                assert_true(patch.n_cell == 0 || b.bed.revision > revision);
                NEAR(before - b.bed.solid_mass, patch.mass, 1e-13 * initial);
                released += patch.mass;
                area -= patch.area;
                NEAR(b.bed.solid_mass + released, initial, 1e-13 * initial);
                NEAR(bed_area(&b.bed), area, 1e-13);
                NEAR(b.bed.pore_water + pore_water(&b), water, 1e-12 * water);
            }
        }
        if (steps % 5 == 0)
            check_bed(&b);
    }
    print_message("bed gone after %d steps, at most %d patches in one\n", steps, most);
    assert_int_equal(b.bed.n_cell, 0);
    assert_int_equal(b.bed.n_edge, 0);
    NEAR(b.bed.solid_mass, 0, 0);
    NEAR(released, initial, 1e-13 * initial);
    NEAR(b.bed.pore_water, water, 1e-12 * water);
    for (int i = 0; i < b.bed.n_node; i++)
        assert_false(b.bed.alive[i] || b.bed.exposed[i]);
    assert_false(silt_bed_contains(&b.bed, (double[2]){0.5, 0.1}));
    bench_close(&b);
}

static void test_release_excess(void **state) {
    (void)state;
    // work beyond W_c goes on in the nodes that the release lays bare, over their lengths of surface
    bench b;
    bench_flat(&b, 0.05, 0.01, 1);
    b.scene.bed.layer = 0.01;
    int node = -1;
    for (int i = 0; i < b.bed.n_node; i++)
        if (b.bed.exposed[i] && fabs(b.bed.x[i][0] - 0.25) < 1e-9)
            node = i;
    silt_patch patch;
    silt_bed_patch(&b.bed, node, &patch);
    NEAR(patch.height, patch.area / 0.05, 1e-15);
    NEAR(patch.normal[1], 1, 1e-12);
    NEAR(patch.mass, 2650 * 0.6 * patch.area, 1e-12);
    uint8_t *before = silt_alloc((size_t)b.bed.n_node, 1);
    memcpy(before, b.bed.exposed, (size_t)b.bed.n_node);
    const double full = patch.mass / 0.05;
    b.bed.work[node] = 130;
    b.bed.eroded[node] = 1.25 * full;
    silt_bed_release(&b.bed, &b.scene, &patch);
    assert_false(b.bed.alive[node]);
    double work = 0, eroded = 0;
    int fresh = 0;
    for (int i = 0; i < b.bed.n_node; i++) {
        double length = 0;
        for (int e = 0; e < b.bed.n_edge; e++)
            if (b.bed.edge[e][0] == i || b.bed.edge[e][1] == i)
                length += 0.5 * hypot(b.bed.x[b.bed.edge[e][1]][0] - b.bed.x[b.bed.edge[e][0]][0],
                                      b.bed.x[b.bed.edge[e][1]][1] - b.bed.x[b.bed.edge[e][0]][1]);
        if (b.bed.exposed[i] && !before[i]) {
            fresh++;
            assert_true(b.bed.work[i] > 0);
        }
        work += b.bed.work[i] * length;
        eroded += b.bed.eroded[i] * length;
    }
    assert_in_range(fresh, 1, 4);
    NEAR(work, 30 * 0.05, 1e-12);
    NEAR(eroded, 0.25 * full * 0.05, 1e-12 * full);
    free(before);
    bench_close(&b);
}

static void test_loose(void **state) {
    (void)state;
    // a small piece without a wall hangs in the water; the same piece on a floor does not, nor does a large one
    for (int k = 0; k < 3; k++) {
        bench b;
        bench_open(&b, 0.05);
        bench_box(&b, 0, 0, 1, 0.2);
        bench_box(&b, 0.4, 0.4, k == 2 ? 1.4 : 0.55, 0.55);
        bench_wall(&b, 2, (double[]){0, 0, 1, 0});
        if (k == 1)
            bench_wall(&b, 2, (double[]){0.6, 0.55, 0.3, 0.55});
        bench_create(&b);
        int node[64], rounds = 0;
        if (k > 0)
            assert_int_equal(silt_bed_loose(&b.bed, &b.scene, 64, node), 0);
        for (int n; (n = silt_bed_loose(&b.bed, &b.scene, 64, node)) > 0; rounds++)
            for (int q = 0; q < n; q++) {
                silt_patch patch;
                silt_bed_patch(&b.bed, node[q], &patch);
                assert_true(b.bed.x[node[q]][1] > 0.39);
                silt_bed_release(&b.bed, &b.scene, &patch);
            }
        NEAR(bed_area(&b.bed), k == 0 ? 0.2 : k == 1 ? 0.2225 : 0.35, 1e-12);
        assert_true(rounds < 4);
        bench_close(&b);
    }
}

// ---------------------------------------------------------------- spheres by place

// the free distance is that to the nearest of all, in the plane and in space, for crumbs among boulders too
static void test_crowd(void **state) {
    (void)state;
    enum { SPHERES = 1500 };
    static double x[SPHERES][3], radius[SPHERES];
    uint64_t seed = 4;
    int inside = 0, beyond = 0;
    for (int kind = 0; kind < 4; kind++) {
        silt_crowd crowd = {0};
        silt_crowd_start(&crowd, kind < 2 ? 0.02 : 0.5);
        for (int k = 0; k < SPHERES; k++) {
            for (int d = 0; d < 3; d++)
                x[k][d] = d == 2 && kind % 2 == 0 ? 0 : 2 * silt_uniform(&seed) - 1;
            radius[k] = k % 100 == 0 ? 0.1 : 0.002 + 0.02 * silt_uniform(&seed);
            silt_crowd_add(&crowd, x[k], radius[k]);
            const double at[3] = {3 * silt_uniform(&seed) - 1.5, 3 * silt_uniform(&seed) - 1.5, kind % 2 == 0 ? 0 : 3 * silt_uniform(&seed) - 1.5};
            const double far = k % 7 == 0 ? 10 : 0.1 * silt_uniform(&seed);
            double gap = far;
            for (int m = 0; m <= k; m++)
                gap = silt_min(gap, hypot(hypot(at[0] - x[m][0], at[1] - x[m][1]), at[2] - x[m][2]) - radius[m]);
            assert_true(silt_crowd_gap(&crowd, at, far) == gap);
            inside += gap < 0;
            beyond += gap == far;
        }
        silt_crowd_clear(&crowd);
    }
    assert_true(inside > 100 && beyond > 1000);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_create_box),
        cmocka_unit_test(test_create_polygon),
        cmocka_unit_test(test_create_touching),
        cmocka_unit_test(test_contains),
        cmocka_unit_test(test_onset_frictional_work),
        cmocka_unit_test(test_onset_dissipation),
        cmocka_unit_test(test_onset_ramp),
        cmocka_unit_test(test_threshold),
        cmocka_unit_test(test_due_order),
        cmocka_unit_test(test_rate),
        cmocka_unit_test(test_release_all),
        cmocka_unit_test(test_release_excess),
        cmocka_unit_test(test_loose),
        cmocka_unit_test(test_crowd),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
