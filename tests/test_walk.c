// the random walk of suspended grains, through the worker: variance 2 K t, well mixed stays well mixed in a parabolic diffusivity,
// the same numbers for the same seed, step and grain; grains that touch stay; gusts as large, joined and long as told
#include "coupling.h"
#include "run.h"

#include "../dem-coupling/state.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

#include "check.h"

static const silt_coupling_type *const dem = &silt_coupling_dem;

// a closed tank of 0.1 m full of water, grains in `box` of it, without weight
typedef struct basin {
    silt_scene *scene;
    silt_walls walls;
    silt_nodes nodes;
    silt_mesh mesh;
    silt_coupling *coupling;
    double *viscosity; // per cell
} basin;

static void basin_open_as(basin *b, const char *box, int count, int seed, double diameter, bool periodic) {
    FILE *to = fopen(SILT_BINARY "/test_walk.yaml", "w");
    assert_non_null(to);
    fprintf(to, "silt: 1\ntitle: walk\ndimension: 2\n%stime: {end: 1, output: 1}\ngravity: [0, 0]\nfluid:\n  density: 1000\n  viscosity: 1.0e-3\n"
                "  size: 0.005\n  seed: %d\n  regions: [{box: [[0, 0], [0.1, 0.1]]}]\n"
                "walls: [%s]\n"
                "grains:\n  drag: none\n  random_walk: true\n  schmidt: 0.5\n"
                "  regions: [{box: %s, diameter: %g, density: 2650, count: %d, arrangement: random}]\n"
                "contact: {youngs_modulus: 5.0e6, poissons_ratio: 0.3, restitution: 0.5, friction: 0.4, rolling_friction: 0}\n",
            periodic ? "periodic: [0, 0.1]\n" : "", seed,
            periodic ? "{polyline: [[0, 0], [0.1, 0]], condition: slip}, {polyline: [[0.1, 0.1], [0, 0.1]], condition: slip}"
                     : "{polyline: [[0, 0], [0.1, 0], [0.1, 0.1], [0, 0.1], [0, 0]], condition: slip}",
            box, diameter, count);
    fclose(to);
    memset(b, 0, sizeof *b);
    OK(silt_scene_read(SILT_BINARY "/test_walk.yaml", 0, NULL, &b->scene, &error));
    OK(silt_walls_create(&b->walls, b->scene, &error));
    silt_nodes_seed(&b->nodes, b->scene, &b->walls, NULL, NULL);
    const silt_barrier barrier = {.walls = &b->walls};
    OK(silt_mesh_first(&b->mesh, &b->nodes, b->scene, &barrier, &error));
    const silt_coupling_def def = {.scene = b->scene, .walls = &b->walls, .worker = SILT_BINARY "/silt-dem", .log = "test_walk.log",
                                   .lo = {-0.01, -0.01}, .hi = {0.11, 0.11}};
    OK(dem->open(&b->coupling, &def, &error));
    b->viscosity = silt_alloc((size_t)b->mesh.n_cell, sizeof *b->viscosity);
}

static void basin_open(basin *b, const char *box, int count, int seed) { basin_open_as(b, box, count, seed, 2e-5, false); }

static void basin_close(basin *b) {
    dem->close(&b->coupling);
    silt_walls_clear(&b->walls);
    silt_nodes_clear(&b->nodes);
    silt_mesh_clear(&b->mesh);
    silt_scene_free(&b->scene);
    free(b->viscosity);
}

// one step of the walk of length dt; the discrete elements' own step is as short as can be
static const silt_grain_state *basin_walk(basin *b, double dt, int64_t step) {
    const silt_drag *drag;
    OK(dem->prepare(b->coupling, &b->nodes, &b->mesh, 1e-9, &drag, &error));
    assert_non_null(drag);
    dem->load(b->coupling, &b->nodes, &b->mesh, 1e-9);
    dem->walk(b->coupling, &b->nodes, &b->mesh, b->viscosity, dt, step);
    dem->keep(b->coupling);
    OK(dem->start(b->coupling, 1, &error));
    OK(dem->finish(b->coupling, &error));
    return dem->grains(b->coupling);
}

static void test_variance(void **unused) {
    (void)unused;
    basin b;
    basin_open(&b, "[[0.045, 0.045], [0.055, 0.055]]", 2000, 3);
    const double diffusivity = 1e-5, dt = 0.01;
    // the eddy viscosity is diffusivity times schmidt
    for (int e = 0; e < b.mesh.n_cell; e++)
        b.viscosity[e] = 1e-3 + 1000 * 0.5 * diffusivity;
    const silt_grain_state *grains = dem->grains(b.coupling);
    const int n = grains->count;
    double *start = silt_alloc(3 * (size_t)n, sizeof *start);
    memcpy(start, grains->x, 3 * (size_t)n * sizeof *start);
    for (int step = 0; step < 40; step++) {
        grains = basin_walk(&b, dt, step);
        double mean[2] = {0}, square = 0;
        for (int i = 0; i < n; i++)
            for (int d = 0; d < 2; d++) {
                const double way = grains->x[3 * i + d] - start[3 * i + d];
                mean[d] += way / n;
                square += way * way / (2 * n);
            }
        const double expected = 2 * diffusivity * (step + 1) * dt;
        if (step % 13 == 0) {
            print_message("step %2d: variance %.4f of 2 K t\n", step, square / expected);
            // of 4000 squares of normal numbers: 3 sigma are 6.7 %
            near(square / expected, 1, 0.067, "variance");
            for (int d = 0; d < 2; d++)
                near(mean[d] / sqrt(expected / n), 0, 3, "mean over its own deviation");
        }
    }
    for (int i = 0; i < 3 * n; i++)
        assert_true(fabs(grains->v[i]) < 1e-12); // the walk is no velocity
    free(start);
    basin_close(&b);
}

// diffusivity y (H - y): without the drift grains would gather at the walls
static void test_well_mixed(void **unused) {
    (void)unused;
    basin b;
    basin_open(&b, "[[0.001, 0.001], [0.099, 0.099]]", 2000, 5);
    const double most = 1e-3, dt = 0.005; // 0.03 H a step; H^2/K 10 s
    for (int e = 0; e < b.mesh.n_cell; e++) {
        double y = 0;
        for (int a = 0; a < 3; a++)
            y += b.nodes.x[2 * b.mesh.cell[e][a] + 1] / 3;
        b.viscosity[e] = 1e-3 + 1000 * 0.5 * most * 4 * y * (0.1 - y) / 0.01;
    }
    enum { BINS = 10, STEPS = 1000 };
    double share[BINS] = {0};
    for (int step = 0; step < STEPS; step++) {
        const silt_grain_state *grains = basin_walk(&b, dt, step);
        assert_int_equal(grains->count, 2000);
        for (int i = 0; i < grains->count && step >= 200; i++)
            share[(int)silt_clamp(grains->x[3 * i + 1] * BINS / 0.1, 0, BINS - 1)] += (double)BINS / grains->count / (STEPS - 200);
    }
    for (int k = 0; k < BINS; k++) {
        print_message("%.3f%s", share[k], k + 1 < BINS ? " " : " of the mean from floor to lid\n");
        near(share[k], 1, 0.05, "share of the grains in a tenth of the depth");
    }
    basin_close(&b);
}

// where the scene repeats, grains keep off each other across its ends, and walls throw them back there too
static void test_around(void **unused) {
    (void)unused;
    basin b;
    const double diameter = 0.004;
    basin_open_as(&b, "[[0, 0], [0.1, 0.1]]", 200, 3, diameter, true);
    for (int e = 0; e < b.mesh.n_cell; e++)
        b.viscosity[e] = 1e-3 + 1000 * 0.5 * 1e-3;
    int crossed = 0;
    double before[200];
    for (int step = 0; step < 40; step++) {
        const silt_grain_state *grains = dem->grains(b.coupling);
        for (int i = 0; i < 200; i++)
            before[i] = grains->x[3 * i];
        grains = basin_walk(&b, 0.01, step); // 4.5 mm a step
        assert_int_equal(grains->count, 200);
        double least = HUGE_VAL;
        for (int i = 0; i < 200; i++) {
            crossed += fabs(grains->x[3 * i] - before[i]) > 0.05;
            assert_true(grains->x[3 * i + 1] > 0.499 * diameter && grains->x[3 * i + 1] < 0.1 - 0.499 * diameter);
            for (int k = 0; k < i; k++) {
                double dx = grains->x[3 * i] - grains->x[3 * k], dy = grains->x[3 * i + 1] - grains->x[3 * k + 1];
                dx -= 0.1 * round(dx / 0.1);
                least = silt_min(least, hypot(dx, dy));
            }
        }
        near(silt_max(diameter - least, 0), 0, 1e-6 * diameter, "overlap");
    }
    print_message("%d crossings\n", crossed);
    assert_true(crossed > 50);
    basin_close(&b);
}

static void test_keyed(void **unused) {
    (void)unused;
    double first[3][2];
    const int seed[3] = {3, 3, 4};
    for (int k = 0; k < 3; k++) {
        basin b;
        basin_open(&b, "[[0.02, 0.02], [0.08, 0.08]]", 10, seed[k]);
        for (int e = 0; e < b.mesh.n_cell; e++)
            b.viscosity[e] = 1e-3 + 5e-3;
        if (k == 1) // others steps before make no difference to the step's own numbers
            assert_non_null(basin_walk(&b, 0, 7));
        double x[2];
        memcpy(x, dem->grains(b.coupling)->x + 12, sizeof x);
        const silt_grain_state *grains = basin_walk(&b, 0.01, 11);
        for (int d = 0; d < 2; d++)
            first[k][d] = grains->x[12 + d] - x[d];
        memcpy(x, grains->x + 12, sizeof x);
        grains = basin_walk(&b, 0.01, 12);
        assert_true(grains->x[12] - x[0] != first[k][0]);
        basin_close(&b);
    }
    assert_true(first[0][0] != 0);
    near(first[0][0], first[1][0], 1e-15, "the same seed");
    near(first[0][1], first[1][1], 1e-15, "the same seed");
    assert_true(first[0][0] != first[2][0]);
}

// gusts in a shear S with the eddy viscosity K: u*^2 = K S, deviations and correlation as published, each lasts its time
static void test_gusts(void **unused) {
    (void)unused;
    basin b;
    basin_open(&b, "[[0.01, 0.01], [0.09, 0.09]]", 2000, 4);
    b.scene->grains.gusts = 0.1;
    b.scene->gravity[1] = -9.81;
    const double rate = 3, eddy = 2e-5, friction = sqrt(eddy * rate);
    for (int e = 0; e < b.mesh.n_cell; e++)
        b.viscosity[e] = 1e-3 + 1000 * eddy;
    for (int i = 0; i < b.nodes.count; i++)
        b.nodes.v[2 * i] = 1 + rate * b.nodes.x[2 * i + 1];
    const silt_drag *drag;
    OK(dem->prepare(b.coupling, &b.nodes, &b.mesh, 1e-9, &drag, &error));
    dem->load(b.coupling, &b.nodes, &b.mesh, 1e-9);
    enum { TURNS = 20 };
    const int n = b.coupling->n_grain;
    double along = 0, up = 0, stress = 0, before = 0;
    int changed = 0;
    for (int k = 0; k < TURNS; k++) {
        dem->gusts(b.coupling, &b.nodes, &b.mesh, b.viscosity, 0.1 * k);
        for (int i = 0; i < n; i++) {
            const double *c = b.coupling->grain[i].gust;
            along += c[0] * c[0] / (n * TURNS * friction * friction);
            up += c[1] * c[1] / (n * TURNS * friction * friction);
            stress += c[0] * c[1] / (n * TURNS * friction * friction);
        }
        // a fifth of the time later a fifth of them are others
        double *old = silt_alloc((size_t)n, sizeof *old);
        for (int i = 0; i < n; i++)
            old[i] = b.coupling->grain[i].gust[0];
        dem->gusts(b.coupling, &b.nodes, &b.mesh, b.viscosity, 0.1 * k + 0.02);
        for (int i = 0; i < n; i++)
            changed += b.coupling->grain[i].gust[0] != old[i];
        before = old[0];
        free(old);
    }
    print_message("along %.3f, up %.3f, stress %.3f, new %.3f\n", sqrt(along), sqrt(up), stress, (double)changed / (n * TURNS));
    // of 40000: three standard errors
    near(along / (2.30 * 2.30), 1, 0.022, "square along the stream");
    near(up / (1.27 * 1.27), 1, 0.022, "square upwards");
    near(stress, -1, 3 * sqrt(2.30 * 2.30 * 1.27 * 1.27 + 1) / 200, "stress");
    near((double)changed / (n * TURNS), 0.2, 0.006, "new gusts");
    assert_true(before != 0);
    // across the stream, in space
    double across = 0;
    for (uint64_t k = 0; k < 40000; k++) {
        double share[3];
        silt_gust_numbers(silt_hash(1, &k, sizeof k), share);
        across += share[1] * share[1] / 40000;
    }
    near(across / (1.63 * 1.63), 1, 0.022, "square across");
    // no stress, no gusts
    for (int e = 0; e < b.mesh.n_cell; e++)
        b.viscosity[e] = 1e-3;
    dem->gusts(b.coupling, &b.nodes, &b.mesh, b.viscosity, 5);
    for (int i = 0; i < n; i++)
        near(silt_length(3, b.coupling->grain[i].gust), 0, 0, "gust without eddies");
    basin_close(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_variance),
        cmocka_unit_test(test_well_mixed),
        cmocka_unit_test(test_around),
        cmocka_unit_test(test_keyed),
        cmocka_unit_test(test_gusts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
