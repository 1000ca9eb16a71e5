// the bed in space: exact volumes, areas and masses; a mesh that is sound after every release and deposit, until nothing is left

#include "bed_bench.h"

// ---------------------------------------------------------------- scenes by hand

typedef struct bench3 {
    silt_scene scene;
    silt_region region[4];
    double point[3 * 8];
    silt_wall box;
    silt_walls walls;
    silt_bed bed;
} bench3;

static void open3(bench3 *b, double size) {
    memset(b, 0, sizeof *b);
    b->scene.path = (char *)"bench";
    b->scene.dimension = 3;
    b->scene.gravity[2] = -9.81;
    b->scene.fluid = (silt_fluid_def){.on = true, .density = 1000, .viscosity = 1e-3, .size = size};
    b->scene.bed = (silt_bed_def){
        .on = true, .density = 2650, .porosity = 0.4, .work = 100, .size = size, .distance = size, .saturation = 0.8, .region = b->region};
    b->scene.wall = &b->box;
}

static void close3(bench3 *b) {
    silt_bed_clear(&b->bed);
    silt_walls_clear(&b->walls);
}

static void tank3(bench3 *b, double x, double y, double z) {
    b->box = (silt_wall){.form = WALL_BOX, .hi = {x, y, z}, .condition = WALL_SLIP};
    b->scene.n_wall = 1;
}

static void box3(bench3 *b, double x0, double y0, double z0, double x1, double y1, double z1) {
    b->region[b->scene.bed.n_region++] = (silt_region){.kind = REGION_BOX, .lo = {x0, y0, z0}, .hi = {x1, y1, z1}};
}

// an upright prism from y0 to y1
static void prism3(bench3 *b, int n, const double *xz, double y0, double y1) {
    for (int k = 0; k < n; k++)
        for (int d = 0; d < 2; d++)
            b->point[3 * k + d] = xz[2 * k + d];
    b->region[b->scene.bed.n_region++] = (silt_region){.kind = REGION_POLYGON, .n_point = n, .point = b->point, .lo = {0, y0}, .hi = {0, y1}};
}

static void create3(bench3 *b) {
    silt_error err = {0};
    if (silt_walls_create(&b->walls, &b->scene, &err) != SILT_OK || silt_bed_create(&b->bed, &b->scene, &b->walls, &err) != SILT_OK)
        fail_msg("%s", err.text);
}

// ---------------------------------------------------------------- what always holds, written a second time

static double volume6(const double *a, const double *b, const double *c, const double *d) {
    double u[3], v[3], w[3];
    for (int k = 0; k < 3; k++) {
        u[k] = b[k] - a[k];
        v[k] = c[k] - a[k];
        w[k] = d[k] - a[k];
    }
    return u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
}

static double triangle_area(const silt_bed *bed, const int *face) {
    const double *p = bed->x[face[0]], *q = bed->x[face[1]], *r = bed->x[face[2]];
    double n[3];
    for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3, f = (d + 2) % 3;
        n[d] = (q[e] - p[e]) * (r[f] - p[f]) - (q[f] - p[f]) * (r[e] - p[e]);
    }
    return 0.5 * sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
}

// faces lie on a plane of the tank together
static bool on_tank(const bench3 *b, const int *face, int n) {
    for (int plane = 0; plane < 6 && b->scene.n_wall; plane++) {
        const int d = plane / 2;
        bool all = true;
        for (int k = 0; k < n; k++)
            all &= fabs(b->bed.x[face[k]][d] - (plane % 2 ? b->box.hi[d] : b->box.lo[d])) < 1e-9;
        if (all)
            return true;
    }
    return false;
}

// a face by its nodes, rising, with the node of its cell opposite
typedef struct side3 {
    int node[3], opposite;
} side3;

static int side_order(const void *p, const void *q) {
    const int *a = ((const side3 *)p)->node, *b = ((const side3 *)q)->node;
    for (int k = 0; k < 3; k++)
        if (a[k] != b[k])
            return a[k] < b[k] ? -1 : 1;
    return 0;
}

static side3 side_of(const int *node, int opposite) {
    side3 s = {{node[0], node[1], node[2]}, opposite};
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < 2; k++)
            if (s.node[k] > s.node[k + 1]) {
                const int t = s.node[k];
                s.node[k] = s.node[k + 1];
                s.node[k + 1] = t;
            }
    return s;
}

static void check3(const bench3 *b) {
    const silt_bed *bed = &b->bed;
    side3 *side = silt_alloc(4 * (size_t)bed->n_cell + 1, sizeof *side), *open = silt_alloc((size_t)bed->n_edge + 1, sizeof *open);
    uint8_t *alive = silt_alloc((size_t)bed->n_node + 1, 1), *exposed = silt_alloc((size_t)bed->n_node + 1, 1);
    double sum = 0;
    for (int c = 0; c < bed->n_cell; c++) {
        const int *p = bed->cell[c];
        const double volume = volume6(bed->x[p[0]], bed->x[p[1]], bed->x[p[2]], bed->x[p[3]]) / 6;
        assert_true(volume > 0);
        NEAR(bed->area[c], volume, 1e-14 * volume + 1e-18);
        sum += bed->mass[c];
        for (int k = 0; k < 4; k++) {
            const int other[3] = {p[(k + 1) % 4], p[(k + 2) % 4], p[(k + 3) % 4]};
            side[4 * c + k] = side_of(other, p[k]);
            alive[p[k]] = 1;
        }
    }
    NEAR(sum, bed->solid_mass, 1e-12 * b->bed.initial_mass);
    for (int e = 0; e < bed->n_edge; e++) {
        open[e] = side_of(bed->edge[e], e);
        for (int k = 0; k < 3; k++)
            exposed[bed->edge[e][k]] = 1;
    }
    qsort(side, 4 * (size_t)bed->n_cell, sizeof *side, side_order);
    qsort(open, (size_t)bed->n_edge, sizeof *open, side_order);
    int at = 0;
    for (int k = 0; k < 4 * bed->n_cell; k++) {
        int same = 1;
        while (k + same < 4 * bed->n_cell && side_order(&side[k], &side[k + same]) == 0)
            same++;
        assert_in_range(same, 1, 2);
        if (same == 2) {
            // cells on both sides
            const double *p = bed->x[side[k].node[0]], *q = bed->x[side[k].node[1]], *r = bed->x[side[k].node[2]];
            assert_true(volume6(p, q, r, bed->x[side[k].opposite]) * volume6(p, q, r, bed->x[side[k + 1].opposite]) < 0);
        } else if (!on_tank(b, side[k].node, 3)) {
            // on the surface, and listed so that its normal leaves the bed
            assert_true(at < bed->n_edge && side_order(&open[at], &side[k]) == 0);
            const int *face = bed->edge[open[at].opposite];
            assert_true(volume6(bed->x[face[0]], bed->x[face[1]], bed->x[face[2]], bed->x[side[k].opposite]) < 0);
            at++;
        }
        k += same - 1;
    }
    assert_int_equal(at, bed->n_edge);
    // the surface is closed, or ends on the tank: an edge is there as often one way as the other
    int(*way)[3] = silt_alloc(3 * (size_t)bed->n_edge + 1, sizeof *way);
    for (int e = 0; e < bed->n_edge; e++)
        for (int k = 0; k < 3; k++) {
            const int p = bed->edge[e][k], q = bed->edge[e][(k + 1) % 3];
            memcpy(way[3 * e + k], (int[3]){p < q ? p : q, p < q ? q : p, p < q ? 1 : -1}, sizeof *way);
        }
    qsort(way, 3 * (size_t)bed->n_edge, sizeof *way, side_order);
    for (int k = 0; k < 3 * bed->n_edge;) {
        int balance = 0, m = k;
        for (; m < 3 * bed->n_edge && way[m][0] == way[k][0] && way[m][1] == way[k][1]; m++)
            balance += way[m][2];
        assert_true(balance == 0 || on_tank(b, way[k], 2));
        k = m;
    }
    for (int i = 0; i < bed->n_node; i++) {
        assert_int_equal(alive[i], bed->alive[i]);
        assert_int_equal(exposed[i], bed->exposed[i]);
    }
    free(side);
    free(open);
    free(alive);
    free(exposed);
    free(way);
}

static double volume_of(const silt_bed *bed) {
    double volume = 0;
    for (int c = 0; c < bed->n_cell; c++)
        volume += bed->area[c];
    return volume;
}

static double pores3(const bench3 *b) {
    return b->scene.bed.saturation * 1000 * (volume_of(&b->bed) - b->bed.solid_mass / 2650);
}

static double surface_area(const silt_bed *bed) {
    double area = 0;
    for (int e = 0; e < bed->n_edge; e++)
        area += triangle_area(bed, bed->edge[e]);
    return area;
}

// a place strictly inside of a cell
static bool deep_in(const silt_bed *bed, int c, const double *x, double slack) {
    for (int k = 0; k < 4; k++) {
        const double *p[4];
        for (int a = 0; a < 4; a++)
            p[a] = a == k ? x : bed->x[bed->cell[c][a]];
        if (volume6(p[0], p[1], p[2], p[3]) <= slack)
            return false;
    }
    return true;
}

// no other cell has places of these
static void check_apart(const bench3 *b, int n, const int *cell) {
    const silt_bed *bed = &b->bed;
    for (int m = 0; m < n; m++)
        for (int k = 0; k < 9; k++) {
            // the middle, and towards corners and faces
            double x[3] = {0};
            for (int a = 0; a < 4; a++)
                for (int d = 0; d < 3; d++)
                    x[d] += (k == 8 ? 0.25 : k < 4 ? (a == k ? 0.91 : 0.03) : (a == k - 4 ? 0.04 : 0.32)) * bed->x[bed->cell[cell[m]][a]][d];
            for (int c = 0; c < bed->n_cell; c++)
                if (c != cell[m] && deep_in(bed, c, x, 1e-9 * pow(b->scene.bed.size, 3)))
                    fail_msg("cell %d lies in cell %d", cell[m], c);
        }
}

// ---------------------------------------------------------------- creation

static void check_created3(bench3 *b, double volume, double surface) {
    create3(b);
    NEAR(volume_of(&b->bed), volume, 1e-10 * volume);
    NEAR(b->bed.solid_mass, 2650 * 0.6 * volume, 1e-10 * 2650 * 0.6 * volume);
    NEAR(b->bed.initial_mass, b->bed.solid_mass, 0);
    if (surface > 0)
        NEAR(surface_area(&b->bed), surface, 1e-10 * surface);
    check3(b);
    double longest = 0, thinnest = HUGE_VAL;
    for (int c = 0; c < b->bed.n_cell; c++) {
        const int *p = b->bed.cell[c];
        double largest = 0;
        for (int k = 0; k < 4; k++) {
            const int face[3] = {p[(k + 1) % 4], p[(k + 2) % 4], p[(k + 3) % 4]};
            largest = silt_max(largest, triangle_area(&b->bed, face));
            for (int a = 0; a < k; a++) {
                const double *x = b->bed.x[p[a]], *y = b->bed.x[p[k]];
                longest = silt_max(longest, hypot(hypot(x[0] - y[0], x[1] - y[1]), x[2] - y[2]));
            }
        }
        thinnest = silt_min(thinnest, 3 * b->bed.area[c] / largest);
    }
    print_message("%d cells, longest edge %.2f, smallest height %.3f of the spacing\n", b->bed.n_cell, longest / b->scene.bed.size,
                  thinnest / b->scene.bed.size);
    assert_true(longest < 2.2 * b->scene.bed.size);
    assert_true(thinnest > 0.02 * b->scene.bed.size);
}

static void test_create(void **state) {
    (void)state;
    bench3 b;
    // a box alone, all of its surface exposed; and in the corner of a tank
    open3(&b, 0.1);
    box3(&b, 0, 0, 0, 0.6, 0.5, 0.3);
    check_created3(&b, 0.09, 2 * (0.3 + 0.18 + 0.15));
    close3(&b);
    open3(&b, 0.1);
    tank3(&b, 1, 0.5, 1);
    box3(&b, 0, 0, 0, 0.6, 0.5, 0.3);
    check_created3(&b, 0.09, 0.3 + 0.15);
    for (int i = 0; i < b.bed.n_node; i++)
        if (b.bed.exposed[i] && b.bed.x[i][0] < 0.59) {
            double n[3];
            silt_bed_normal(&b.bed, i, n);
            NEAR(n[0], 0, 1e-12);
            NEAR(n[1], 0, 1e-12);
            NEAR(n[2], 1, 1e-12);
        }
    NEAR(silt_bed_level(&b.bed, (double[]){0.31, 0.22}), 0.3, 1e-12);
    assert_true(silt_bed_level(&b.bed, (double[]){0.71, 0.22}) == -HUGE_VAL);
    close3(&b);
    // a dam on a floor of bed: the crest is sharp, no surface between the two
    open3(&b, 0.1);
    tank3(&b, 2, 0.4, 1);
    box3(&b, 0, 0, 0, 2, 0.4, 0.2);
    prism3(&b, 4, (double[]){0.53, 0.2, 1.49, 0.2, 1.13, 0.53, 0.97, 0.53}, 0, 0.4);
    check_created3(&b, 0.16 + 0.4 * 0.5 * (0.96 + 0.16) * 0.33,
                   0.4 * (2 - 0.96 + 0.16 + hypot(0.44, 0.33) + hypot(0.36, 0.33)));
    NEAR(silt_bed_level(&b.bed, (double[]){1.05, 0.2}), 0.53, 1e-12);
    close3(&b);
    // a pit among four boxes whose lattices meet, and a ball
    open3(&b, 0.1 / 1.08);
    tank3(&b, 1, 1, 1);
    box3(&b, 0, 0, 0, 0.4, 1, 0.3);
    box3(&b, 0.6, 0, 0, 1, 1, 0.3);
    box3(&b, 0.4, 0, 0, 0.6, 0.4, 0.3);
    box3(&b, 0.4, 0.6, 0, 0.6, 1, 0.3);
    check_created3(&b, 0.3 * 0.96, 0.96 + 4 * 0.2 * 0.3);
    close3(&b);
    open3(&b, 0.1);
    b.region[b.scene.bed.n_region++] = (silt_region){.kind = REGION_SPHERE, .centre = {0.5, 0.5, 0.5}, .radius = 0.4};
    create3(&b);
    check3(&b);
    const double ball = 4 * M_PI / 3 * 0.064;
    assert_true(volume_of(&b.bed) < ball && volume_of(&b.bed) > 0.93 * ball);
    close3(&b);
    // nothing there
    open3(&b, 0.1);
    silt_error err = {0};
    assert_int_equal(silt_walls_create(&b.walls, &b.scene, &err), SILT_OK);
    assert_int_equal(silt_bed_create(&b.bed, &b.scene, &b.walls, &err), SILT_INPUT);
    assert_non_null(strstr(err.text, "bed.regions"));
    close3(&b);
}

static void dam3(bench3 *b, double size) {
    open3(b, size);
    tank3(b, 1, 0.4, 1);
    box3(b, 0, 0, 0, 1, 0.4, 0.2);
    prism3(b, 4, (double[]){0.3, 0.2, 0.7, 0.2, 0.55, 0.4, 0.45, 0.4}, 0, 0.4);
    create3(b);
}

static void test_inside(void **state) {
    (void)state;
    bench3 b;
    dam3(&b, 0.1);
    uint64_t seed = 5;
    for (int round = 0; round < 6; round++) {
        for (int k = 0; k < 1000; k++) {
            const double x[3] = {1.2 * silt_uniform(&seed) - 0.1, 0.5 * silt_uniform(&seed) - 0.05, 0.6 * silt_uniform(&seed) - 0.1};
            bool inside = false;
            int n = 0;
            double near = HUGE_VAL;
            for (int c = 0; c < b.bed.n_cell; c++)
                n += deep_in(&b.bed, c, x, 0);
            inside = n > 0;
            assert_true(n <= 1);
            assert_int_equal(inside, silt_bed_contains(&b.bed, x));
            for (int i = 0; i < b.bed.n_node; i++)
                if (b.bed.exposed[i])
                    near = silt_min(near, hypot(hypot(b.bed.x[i][0] - x[0], b.bed.x[i][1] - x[1]), b.bed.x[i][2] - x[2]));
            assert_int_equal(near < 0.07, silt_bed_near(&b.bed, x, 0.07));
        }
        silt_patch patch = {0};
        for (int i = (int)(silt_random(&seed) % (uint64_t)b.bed.n_node); patch.n_cell == 0; i = (i + 1) % b.bed.n_node)
            silt_bed_patch(&b.bed, i, &patch);
        silt_bed_release(&b.bed, &b.scene, &patch);
    }
    close3(&b);
}

// ---------------------------------------------------------------- release

// a node of the surface, or one within where there is no surface
static int any_node(const silt_bed *bed, uint64_t *seed) {
    const int first = (int)(silt_random(seed) % (uint64_t)bed->n_node);
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < bed->n_node; k++) {
            const int i = (first + k) % bed->n_node;
            if (bed->alive[i] && (pass || bed->exposed[i]))
                return i;
        }
    return -1;
}

static void test_release(void **state) {
    (void)state;
    for (uint64_t seed = 1; seed <= 3; seed++) {
        bench3 b;
        uint64_t random = seed;
        dam3(&b, 0.1);
        const double initial = b.bed.solid_mass, water = pores3(&b), whole = volume_of(&b.bed);
        double released = 0, volume = 0;
        int events = 0;
        while (b.bed.n_cell > 0) {
            silt_patch patch;
            int node[64];
            const int loose = silt_bed_loose(&b.bed, &b.scene, 64, node);
            silt_bed_patch(&b.bed, loose ? node[0] : any_node(&b.bed, &random), &patch);
            assert_true(patch.n_cell > 0);
            const int64_t revision = b.bed.revision;
            const double before = b.bed.solid_mass;
            silt_bed_release(&b.bed, &b.scene, &patch);
            assert_int_equal(b.bed.revision, revision + 1);
            assert_false(b.bed.alive[patch.node]);
            NEAR(before - b.bed.solid_mass, patch.mass, 1e-13 * initial);
            released += patch.mass;
            volume += patch.area;
            NEAR(b.bed.solid_mass + released, initial, 1e-12 * initial);
            NEAR(volume_of(&b.bed) + volume, whole, 1e-12 * whole);
            NEAR(b.bed.pore_water + pores3(&b), water, 1e-12 * water);
            check3(&b);
            events++;
        }
        print_message("bed gone after %d patches\n", events);
        assert_int_equal(b.bed.n_edge, 0);
        NEAR(b.bed.solid_mass, 0, 0);
        NEAR(b.bed.pore_water, water, 1e-12 * water);
        close3(&b);
    }
}

// a patch on a flat surface: height times the node's share of the surface is its volume, the normal stands on it
static void test_patch(void **state) {
    (void)state;
    bench3 b;
    open3(&b, 0.1);
    tank3(&b, 1, 1, 1);
    box3(&b, 0, 0, 0, 1, 1, 0.4);
    create3(&b);
    double share = 0;
    for (int i = 0; i < b.bed.n_node; i++)
        if (b.bed.exposed[i]) {
            silt_patch patch;
            double volume = 0, centre[3] = {0};
            silt_bed_patch(&b.bed, i, &patch);
            for (int c = 0; c < b.bed.n_cell; c++) {
                const int *p = b.bed.cell[c];
                if (p[0] != i && p[1] != i && p[2] != i && p[3] != i)
                    continue;
                volume += b.bed.area[c];
                for (int a = 0; a < 4; a++)
                    for (int d = 0; d < 3; d++)
                        centre[d] += 0.25 * b.bed.area[c] * b.bed.x[p[a]][d];
            }
            NEAR(patch.area, volume, 1e-15);
            NEAR(patch.mass, 1590 * volume, 1e-10);
            for (int d = 0; d < 3; d++) {
                NEAR(patch.centre[d], centre[d] / volume, 1e-12);
                NEAR(patch.normal[d], d == 2, 1e-12);
            }
            share += patch.area / patch.height;
        }
    NEAR(share, 1, 1e-12);
    close3(&b);
}

static void test_loose(void **state) {
    (void)state;
    // a block that hangs over the floor is loose when it is small, and not when it is large or on a wall
    for (int k = 0; k < 3; k++) {
        bench3 b;
        open3(&b, 0.1);
        tank3(&b, 1, 0.6, 1);
        box3(&b, 0, 0, 0, 1, 0.6, 0.2);
        if (k == 0)
            box3(&b, 0.4, 0.2, 0.5, 0.6, 0.4, 0.7);
        else if (k == 1)
            box3(&b, 0.1, 0.1, 0.5, 0.9, 0.5, 0.8);
        else
            box3(&b, 0.4, 0.4, 0.5, 0.6, 0.6, 0.7);
        create3(&b);
        int node[64], rounds = 0;
        for (int n; (n = silt_bed_loose(&b.bed, &b.scene, 64, node)) > 0; rounds++)
            for (int q = 0; q < n; q++) {
                silt_patch patch;
                silt_bed_patch(&b.bed, node[q], &patch);
                assert_true(b.bed.x[node[q]][2] > 0.49);
                silt_bed_release(&b.bed, &b.scene, &patch);
                check3(&b);
            }
        NEAR(volume_of(&b.bed), 0.12 + (k == 0 ? 0 : k == 1 ? 0.8 * 0.4 * 0.3 : 0.008), 1e-12);
        assert_true(k ? rounds == 0 : rounds > 0);
        close3(&b);
    }
}

// ---------------------------------------------------------------- deposition

// rains parcels on the bed; everything sound after each. @return mass taken up
static double rain(bench3 *b, uint64_t *seed, int n, double r, int count[3]) {
    const double mass = 2650 * 4 * M_PI / 3 * r * r * r, water = pores3(b) + b->bed.pore_water, initial = b->bed.solid_mass;
    double taken = 0;
    for (int k = 0; k < n; k++) {
        double x[3] = {silt_uniform(seed), 0.4 * silt_uniform(seed), 0};
        const double level = silt_bed_level(&b->bed, x), before = volume_of(&b->bed), pores = b->bed.pore_water, pores_rest = b->bed.pore_rest;
        if (!(level > 0))
            continue;
        x[2] = level + r;
        for (int d = 0; d < 2; d++)
            x[d] = silt_clamp(x[d], r, (d ? 0.4 : 1) - r);
        silt_deposit deposit;
        count[silt_bed_deposit(&b->bed, &b->scene, x, r, mass, NULL, &deposit)]++;
        taken += deposit.kind == DEPOSIT_REFUSED ? 0 : mass;
        NEAR(b->bed.solid_mass, initial + taken, 1e-12 * initial);
        NEAR(pores3(b) + b->bed.pore_water, water, 1e-12 * water);
        double sum = pores, rest = pores_rest;
        silt_sum(&sum, &rest, -deposit.pore_water);
        NEAR(b->bed.pore_water, sum, 0);
        NEAR(volume_of(&b->bed) - before, deposit.area, 1e-12);
        for (int c = 0; c < b->bed.n_cell; c++)
            assert_in_range(1000 * (1 - b->bed.mass[c] / 2650 / b->bed.area[c]), 199, 801);
        if (deposit.kind == DEPOSIT_CELL) {
            assert_true(b->bed.alive[deposit.node]);
            for (int d = 0; d < 3; d++)
                assert_true(b->bed.x[deposit.node][d] > (d == 2 ? 0 : -1e-12) && b->bed.x[deposit.node][d] < (d == 0 ? 1 : d == 1 ? 0.4 : 1) + 1e-12);
            check_apart(b, deposit.n_cell, deposit.cell);
        }
        check3(b);
    }
    return taken;
}

static void test_deposit(void **state) {
    (void)state;
    for (int k = 0; k < 2; k++) {
        bench3 b;
        uint64_t seed = 11;
        int count[3] = {0};
        dam3(&b, 0.1);
        const double initial = b.bed.solid_mass, water = pores3(&b), volume = volume_of(&b.bed);
        const double taken = rain(&b, &seed, 300, k ? 0.025 : 0.035, count);
        print_message("%d parcels became cells, %d went into pores, %d were refused; %.3f of the bed's mass, level %.3f to %.3f\n", count[DEPOSIT_CELL],
                      count[DEPOSIT_DENSER], count[DEPOSIT_REFUSED], taken / initial, silt_bed_level(&b.bed, (double[]){0.15, 0.2}),
                      silt_bed_level(&b.bed, (double[]){0.5, 0.2}));
        assert_true(count[DEPOSIT_CELL] > 100);
        assert_true(volume_of(&b.bed) > volume);
        // too high, and in the bed
        silt_deposit deposit;
        assert_int_equal(silt_bed_deposit(&b.bed, &b.scene, (double[]){0.5, 0.2, 0.9}, 0.02, 0.01, NULL, &deposit), DEPOSIT_REFUSED);
        assert_int_equal(silt_bed_deposit(&b.bed, &b.scene, (double[]){0.5, 0.2, 0.1}, 0.02, 0.01, NULL, &deposit), DEPOSIT_REFUSED);
        // all of it away again
        double released = 0;
        while (b.bed.n_cell > 0) {
            silt_patch patch;
            silt_bed_patch(&b.bed, any_node(&b.bed, &seed), &patch);
            silt_bed_release(&b.bed, &b.scene, &patch);
            released += patch.mass;
        }
        NEAR(released, initial + taken, 1e-12 * initial);
        NEAR(b.bed.pore_water, water, 1e-12 * water);
        close3(&b);
    }
}

// a heap of grains, four in five of them at rest
static void test_heap(void **state) {
    (void)state;
    int count[4] = {0};
    bench3 b;
    heap h = {0};
    uint64_t seed = 5;
    dam3(&b, 0.1);
    for (int k = 0; k < HEAP; k++) {
        const double r = k % 2 ? 0.04 : 0.02;
        double x[3] = {r + (1 - 2 * r) * silt_uniform(&seed), r + (0.4 - 2 * r) * silt_uniform(&seed), 0};
        x[2] = silt_bed_level(&b.bed, x) + r * (1.1 + 2 * silt_uniform(&seed));
        heap_add(&h, x, r, 2650 * 4 * M_PI / 3 * r * r * r, silt_uniform(&seed) < 0.8);
    }
    heap_deposit(&b.bed, &b.scene, &h, count);
    check3(&b);
    print_message("of the heap %d became cells, %d of them with others, %d went into pores, %d wait\n", count[0], count[1], count[2], count[3]);
    assert_true(count[0] > 20 && count[1] > 5 && count[3] > 20);
    close3(&b);
}

// patches go and parcels come, in turns
static void test_mixed(void **state) {
    (void)state;
    bench3 b;
    uint64_t seed = 3;
    int count[3] = {0};
    dam3(&b, 0.1);
    const double initial = b.bed.solid_mass, water = pores3(&b);
    double outside = 0;
    for (int round = 0; round < 60 && b.bed.n_cell > 0; round++) {
        silt_patch patch;
        silt_bed_patch(&b.bed, any_node(&b.bed, &seed), &patch);
        silt_bed_release(&b.bed, &b.scene, &patch);
        outside += patch.mass;
        check3(&b);
        outside -= rain(&b, &seed, 6, 0.025, count);
        NEAR(b.bed.solid_mass + outside, initial, 1e-12 * initial);
        NEAR(b.bed.pore_water + pores3(&b), water, 1e-12 * water);
    }
    print_message("mixed: %d became cells, %d went into pores, %d were refused\n", count[DEPOSIT_CELL], count[DEPOSIT_DENSER],
                  count[DEPOSIT_REFUSED]);
    assert_true(count[DEPOSIT_CELL] > 30);
    close3(&b);
}

// ---------------------------------------------------------------- many at once

// what leaves one by one and what leaves together, with one refresh, leaves the same bed, to the bit
static void test_together(void **state) {
    (void)state;
    bench3 one, all;
    uint64_t seed[2] = {5, 5};
    silt_patch patch;
    dam3(&one, 0.1);
    dam3(&all, 0.1);
    for (int round = 0; round < 6; round++) {
        for (int m = 0; m < 12 && one.bed.n_cell > 0; m++) {
            silt_bed_patch(&one.bed, any_node(&one.bed, &seed[0]), &patch);
            silt_bed_release(&one.bed, &one.scene, &patch);
            silt_bed_patch(&all.bed, any_node(&all.bed, &seed[1]), &patch);
            silt_bed_take_out(&all.bed, &all.scene, &patch);
        }
        silt_bed_refresh(&all.bed);
        const silt_bed *p = &one.bed, *q = &all.bed;
        assert_int_equal(p->n_cell, q->n_cell);
        assert_int_equal(p->n_edge, q->n_edge);
        assert_memory_equal(p->cell, q->cell, (size_t)p->n_cell * sizeof *p->cell);
        assert_memory_equal(p->mass, q->mass, (size_t)p->n_cell * sizeof *p->mass);
        assert_memory_equal(p->edge, q->edge, (size_t)p->n_edge * sizeof *p->edge);
        assert_memory_equal(p->exposed, q->exposed, (size_t)p->n_node * sizeof *p->exposed);
        assert_memory_equal(p->eroded, q->eroded, (size_t)p->n_node * sizeof *p->eroded);
        assert_true(p->solid_mass == q->solid_mass && p->pore_water == q->pore_water);
        check3(&all);
    }
    assert_true(one.bed.solid_mass < 0.5 * one.bed.initial_mass);
    close3(&one);
    close3(&all);
}

// ---------------------------------------------------------------- save and load

static void test_store(void **state) {
    (void)state;
    bench3 b;
    uint64_t seed[2] = {9, 9};
    int count[3] = {0};
    dam3(&b, 0.1);
    silt_patch patch;
    for (int k = 0; k < 5; k++) {
        silt_bed_patch(&b.bed, any_node(&b.bed, &seed[0]), &patch);
        silt_bed_release(&b.bed, &b.scene, &patch);
    }
    rain(&b, &seed[0], 20, 0.025, count);
    seed[1] = seed[0];
    silt_error err = {0};
    silt_store *store = NULL;
    const char *path = "test_bed3.h5";
    if (silt_store_create(&store, path, &err) || silt_bed_save(&b.bed, store, &err) || silt_store_commit(&store, &err))
        fail_msg("%s", err.text);
    bench3 other = b;
    other.bed = (silt_bed){0};
    other.scene.bed.region = other.region;
    other.scene.wall = &other.box;
    if (silt_store_open(&store, path, &err) || silt_bed_load(&other.bed, &other.walls, store, &err))
        fail_msg("%s", err.text);
    silt_store_close(&store);
    remove(path);
    // both go on alike, to the bit
    for (int round = 0; round < 2; round++) {
        const silt_bed *p = &b.bed, *q = &other.bed;
        assert_int_equal(p->n_node, q->n_node);
        assert_int_equal(p->n_cell, q->n_cell);
        assert_int_equal(p->n_edge, q->n_edge);
        assert_memory_equal(p->x, q->x, (size_t)p->n_node * sizeof *p->x);
        assert_memory_equal(p->wall, q->wall, (size_t)p->n_node * sizeof *p->wall);
        assert_memory_equal(p->corner, q->corner, (size_t)p->n_node * sizeof *p->corner);
        assert_memory_equal(p->work, q->work, (size_t)p->n_node * sizeof *p->work);
        assert_memory_equal(p->cell, q->cell, (size_t)p->n_cell * sizeof *p->cell);
        assert_memory_equal(p->mass, q->mass, (size_t)p->n_cell * sizeof *p->mass);
        assert_memory_equal(p->edge, q->edge, (size_t)p->n_edge * sizeof *p->edge);
        NEAR(p->solid_mass, q->solid_mass, 0);
        NEAR(p->pore_water, q->pore_water, 0);
        for (int k = 0; k < 2; k++) {
            bench3 *to = k ? &other : &b;
            for (int m = 0; m < 10; m++) {
                silt_bed_patch(&to->bed, any_node(&to->bed, &seed[k]), &patch);
                silt_bed_release(&to->bed, &to->scene, &patch);
            }
            rain(to, &seed[k], 10, 0.025, count);
        }
    }
    silt_bed_clear(&other.bed);
    close3(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_create),  cmocka_unit_test(test_inside),  cmocka_unit_test(test_patch), cmocka_unit_test(test_release),
        cmocka_unit_test(test_loose), cmocka_unit_test(test_deposit), cmocka_unit_test(test_heap), cmocka_unit_test(test_mixed), cmocka_unit_test(test_together),
        cmocka_unit_test(test_store),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
