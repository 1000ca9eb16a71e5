// one step of the water against exact answers, and what a step must keep
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <unistd.h>

#include "fluid.h"

typedef struct bench {
    silt_scene *scene;
    silt_walls walls;
    silt_nodes nodes;
    silt_mesh mesh;
    silt_fluid fluid;
} bench;

static void bench_open(bench *b, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void bench_open(bench *b, const char *format, ...) {
    char text[4096], path[] = "/tmp/silt-fluid-XXXXXX";
    va_list list;
    va_start(list, format);
    const int n = vsnprintf(text, sizeof text, format, list);
    va_end(list);
    const int fd = mkstemp(path);
    assert_true(fd >= 0 && write(fd, text, (size_t)n) == n);
    close(fd);
    *b = (bench){0};
    silt_error err = {0};
    if (silt_scene_read(path, 0, NULL, &b->scene, &err) != SILT_OK)
        fail_msg("%s", err.text);
    unlink(path);
    silt_walls_create(&b->walls, b->scene, NULL);
    silt_nodes_seed(&b->nodes, b->scene, &b->walls, NULL, NULL);
    const silt_barrier barrier = {.walls = &b->walls};
    assert_int_equal(silt_mesh_first(&b->mesh, &b->nodes, b->scene, &barrier, &err), SILT_OK);
}

static void bench_close(bench *b) {
    silt_walls_clear(&b->walls);
    silt_nodes_clear(&b->nodes);
    silt_mesh_clear(&b->mesh);
    silt_fluid_clear(&b->fluid);
    silt_scene_free(&b->scene);
}

static void step(bench *b, double dt) {
    silt_error err = {0};
    const silt_step step = {.scene = b->scene, .walls = &b->walls, .mesh = &b->mesh, .nodes = &b->nodes, .dt = dt};
    if (silt_fluid_step(&b->fluid, &step, &err) != SILT_OK)
        fail_msg("%s", err.text);
}

static double pressure_at(const bench *b, double x, double y) {
    silt_locator locator = {0};
    silt_locator_build(&locator, &b->mesh, b->nodes.x, b->scene->fluid.size);
    double w[3], p = 0;
    const int e = silt_locate(&locator, &b->mesh, b->nodes.x, (double[2]){x, y}, w);
    assert_true(e >= 0);
    for (int a = 0; a < 3; a++)
        p += w[a] * b->nodes.p[b->mesh.cell[e][a]];
    silt_locator_clear(&locator);
    return p;
}

static double fastest(const bench *b) {
    double v = 0;
    for (int i = 0; i < b->nodes.count; i++)
        v = silt_max(v, hypot(b->nodes.v[2 * i], b->nodes.v[2 * i + 1]));
    return v;
}

static void near(double found, double exact, double tolerance, const char *what) {
    if (!(fabs(found - exact) <= tolerance * fabs(exact)))
        fail_msg("%s: %.9g, exact %.9g, off by %.3g (allowed %.3g)", what, found, exact, fabs(found / exact - 1), tolerance);
}

#define START "silt: 1\ndimension: 2\ntime: {end: 1, output: 1}\n"

// rest is in the spaces of velocity and pressure: what is left is the solver's tolerance
static void test_rest(void **state) {
    (void)state;
    for (int operator_kind = 0; operator_kind < 2; operator_kind++) {
        bench b;
        bench_open(&b, START "gravity: [0, -9.81]\nfluid:\n  flow: laminar\n  theta: 0.55\n  density: 1000\n  viscosity: 1.0e-3\n  size: 0.05\n  jitter: 0.2\n"
                             "  tolerance: 1.0e-13\n  iterations: 60\n  pressure: %s\n"
                             "  regions: [{polygon: [[0, 0.2], [1, 0], [1.5, 0.5], [0, 0.5]]}]\n"
                             "walls: [{polyline: [[0, 0.8], [0, 0.2], [1, 0], [1.8, 0.8]], condition: slip}]\n",
                   operator_kind ? "laplacian" : "consistent");
        step(&b, 0.01);
        step(&b, 0.01);
        assert_true(fastest(&b) < 1e-10);
        near(pressure_at(&b, 0.5, 0.15), 1000 * 9.81 * 0.35, 1e-9, "pressure at depth 0.35 m");
        // the walls carry the weight of the water
        double push[2] = {0, 0};
        for (int k = 0; k < 2 * b.nodes.count; k++)
            push[k % 2] += b.fluid.reaction[k];
        near(push[1], 1000 * 9.81 * 0.525, 1e-9, "reaction of the walls");
        assert_true(fabs(push[0]) < 1e-6);
        bench_close(&b);
    }
}

// mu dt/(rho h^2) = 4000, the Laplacian, whose surface comes to rest within steps: few passes, which is the stiff factor's doing
static void test_stiff_rest(void **state) {
    (void)state;
    bench b;
    bench_open(&b, START "gravity: [0, -9.81]\nfluid:\n  flow: laminar\n  density: 1000\n  viscosity: 1.0e6\n  size: 0.05\n  jitter: 0.2\n"
                         "  tolerance: 1.0e-10\n  iterations: 60\n  pressure: laplacian\n"
                         "  regions: [{box: [[0, 0], [1, 0.5]]}]\n"
                         "walls: [{polyline: [[0, 0.8], [0, 0], [1, 0], [1, 0.8]], condition: slip}]\n");
    int passes = 0;
    for (int k = 0; k < 4; k++) {
        step(&b, 0.01);
        passes += b.fluid.iterations;
    }
    near(pressure_at(&b, 0.5, 0.15), 1000 * 9.81 * 0.35, 1e-4, "pressure at depth 0.35 m");
    near(pressure_at(&b, 1e-9, 1e-9), 1000 * 9.81 * 0.5, 1e-4, "pressure at depth 0.5 m");
    assert_true(fastest(&b) < 1e-8); // g dt: 0.1 m/s
    if (passes > 100)
        fail_msg("%d passes in four steps, 75 are enough", passes);
    bench_close(&b);
}

static void test_free_fall(void **state) {
    (void)state;
    bench b;
    bench_open(&b, START "gravity: [0, -9.81]\nfluid:\n  flow: laminar\n  theta: 0.55\n  density: 1000\n  viscosity: 1.0\n  size: 0.05\n  tolerance: 1.0e-13\n"
                         "  regions: [{circle: [0, 0], radius: 0.3}]\n  velocity: {formula: uniform, vector: [0.7, 0.2]}\n");
    step(&b, 0.01);
    for (int i = 0; i < b.nodes.count; i++) {
        assert_true(fabs(b.nodes.p[i]) < 1e-6);
        assert_true(fabs(b.nodes.v[2 * i] - 0.7) < 1e-10 && fabs(b.nodes.v[2 * i + 1] - (0.2 - 0.0981)) < 1e-10);
    }
    bench_close(&b);
}

// pressure right after the gate of a column is gone: sum of a series, catalogue of reference values A2
static void test_dam_break_start(void **state) {
    (void)state;
    const double ratio[3] = {0.5, 1, 2}, corner[3] = {0.36971, 0.67530, 0.93005}, middle[3] = {0.08006, 0.27274, 0.45057};
    for (int k = 0; k < 3; k++) {
        bench b;
        bench_open(&b, START "gravity: [0, -10]\nfluid:\n  flow: laminar\n  theta: 0.55\n  density: 1000\n  viscosity: 0\n  size: 0.05\n  tolerance: 1.0e-10\n  iterations: 40\n"
                             "  regions: [{box: [[0, 0], [%g, 1]]}]\n"
                             "walls: [{polyline: [[0, 2], [0, 0], [4, 0]], condition: slip}]\n",
                   ratio[k]);
        step(&b, 1e-4);
        near(pressure_at(&b, 1e-9, 1e-9) / 1e4, corner[k], 0.01, "p(0, 0)");
        near(pressure_at(&b, 1e-9, 0.5) / 1e4, middle[k], 0.015, "p(0, H/2)");
        bench_close(&b);
    }
}

// A4: circle under strain, p_c = rho A^2 R^2/2; A6: rotating square, p_c = -0.147343 rho w^2 L^2
static void test_patches(void **state) {
    (void)state;
    bench b;
    bench_open(&b, START "gravity: [0, 0]\nfluid:\n  flow: laminar\n  density: 1000\n  viscosity: 0\n  size: 0.04\n  tolerance: 1.0e-10\n  iterations: 40\n  theta: 0.5\n"
                         "  regions: [{circle: [0, 0], radius: 1}]\n  velocity: {formula: strain, rate: 2}\n");
    step(&b, 1e-5);
    near(pressure_at(&b, 0, 0), 0.5 * 1000 * 4, 0.01, "elliptic drop, first pressure");
    bench_close(&b);
    bench_open(&b, START "gravity: [0, 0]\nfluid:\n  flow: laminar\n  density: 1000\n  viscosity: 0\n  size: 0.025\n  tolerance: 1.0e-10\n  iterations: 40\n  theta: 0.5\n"
                         "  regions: [{box: [[0, 0], [1, 1]]}]\n  velocity: {formula: solid-rotation, rate: 3, centre: [0.5, 0.5]}\n");
    step(&b, 1e-5);
    near(pressure_at(&b, 0.5, 0.5), -0.147343 * 1000 * 9, 0.01, "rotating square, first pressure");
    bench_close(&b);
}

// rigid motion feels no viscosity, however stiff: a spinning drop keeps its spin; the implicit scheme takes any step
static void test_rigid_motion_without_viscous_loss(void **state) {
    (void)state;
    bench b;
    bench_open(&b, START "gravity: [0, 0]\nfluid:\n  flow: laminar\n  theta: 0.55\n  density: 1000\n  viscosity: 1.0e4\n  size: 0.05\n  tolerance: 1.0e-9\n  iterations: 60\n"
                         "  regions: [{circle: [0, 0], radius: 0.5}]\n  velocity: {formula: solid-rotation, rate: 1}\n");
    double spin[2] = {0, 0};
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < b.nodes.count; i++)
            spin[k] += b.nodes.x[2 * i] * b.nodes.v[2 * i + 1] - b.nodes.x[2 * i + 1] * b.nodes.v[2 * i];
        if (k == 0)
            step(&b, 1e-3);
    }
    near(spin[1], spin[0], 1e-3, "spin after a step");
    assert_true(b.fluid.dissipated < 1e-3 * 0.5 * 1000 * M_PI * 0.0625 / 2);
    bench_close(&b);
}

// schemes and operators agree on the first pressure of a collapsing column away from the surface
static void test_schemes_agree(void **state) {
    (void)state;
    double p[3];
    const char *const scheme[3] = {"implicit", "fractional", "implicit"}, *const kind[3] = {"consistent", "consistent", "laplacian"};
    for (int k = 0; k < 3; k++) {
        bench b;
        bench_open(&b, START "gravity: [0, -10]\nfluid:\n  flow: laminar\n  theta: 0.55\n  density: 1000\n  viscosity: 1.0e-3\n  size: 0.05\n  tolerance: 1.0e-9\n"
                             "  iterations: 60\n  scheme: %s\n  pressure: %s\n  regions: [{box: [[0, 0], [1, 1]]}]\n"
                             "walls: [{polyline: [[0, 2], [0, 0], [4, 0]], condition: slip}]\n",
                   scheme[k], kind[k]);
        step(&b, 1e-3);
        p[k] = pressure_at(&b, 1e-9, 1e-9);
        bench_close(&b);
    }
    near(p[1], p[0], 1e-6, "fractional against implicit");
    near(p[2], p[0], 0.01, "laplacian against consistent");
}

// a failed step leaves the nodes as they were
static void test_failure_keeps_the_state(void **state) {
    (void)state;
    bench b;
    bench_open(&b, START "gravity: [0, -10]\nfluid:\n  flow: laminar\n  theta: 0.55\n  density: 1000\n  viscosity: 1.0e-3\n  size: 0.1\n  tolerance: 1.0e-9\n"
                         "  regions: [{box: [[0, 0], [1, 1]]}]\nwalls: [{polyline: [[0, 2], [0, 0], [4, 0]], condition: slip}]\n");
    step(&b, 1e-3);
    const size_t bytes = 2 * (size_t)b.nodes.count * sizeof(double);
    double *v = silt_alloc(1, bytes), *p = silt_alloc(1, bytes);
    memcpy(v, b.nodes.v, bytes);
    memcpy(p, b.nodes.p, bytes / 2);
    silt_error err = {0};
    const silt_step never = {.scene = b.scene, .walls = &b.walls, .mesh = &b.mesh, .nodes = &b.nodes, .dt = NAN};
    assert_int_equal(silt_fluid_step(&b.fluid, &never, &err), SILT_FAILED);
    assert_true(strlen(err.text) > 20);
    assert_memory_equal(v, b.nodes.v, bytes);
    assert_memory_equal(p, b.nodes.p, bytes / 2);
    free(v);
    free(p);
    bench_close(&b);
}

// a debt is paid in volume: the sum of volume and debt stays
static void test_debt_is_paid(void **state) {
    (void)state;
    bench b;
    bench_open(&b, START "gravity: [0, 0]\nfluid:\n  flow: laminar\n  density: 1000\n  viscosity: 0\n  size: 0.05\n  tolerance: 1.0e-11\n  iterations: 40\n"
                         "  theta: 1\n  regions: [{circle: [0, 0], radius: 0.3}]\n");
    double start = silt_mesh_volume(&b.mesh, b.nodes.x), debt = 0;
    for (int i = 0; i < b.nodes.count; i++)
        b.nodes.debt[i] = 0.002 * start / b.nodes.count;
    for (int k = 0; k < 60; k++) {
        step(&b, 0.01);
        for (int j = 0; j < 2 * b.nodes.count; j++)
            b.nodes.x[j] += 0.01 * silt_mesh_velocity(&b.fluid, j);
    }
    for (int i = 0; i < b.nodes.count; i++)
        debt += b.nodes.debt[i];
    const double end = silt_mesh_volume(&b.mesh, b.nodes.x);
    near(end + debt, 1.002 * start, 1e-9, "volume and debt");
    assert_true(end > 1.0018 * start);
    bench_close(&b);
}

// ---------------------------------------------------------------- spray in space

// water of given corners and cells, in a scene of size 1 without walls
static void bench_cells(bench *b, int n, const double (*x)[3], int n_cell, const int (*cell)[4]) {
    bench_open(b, "silt: 1\ndimension: 3\ntime: {end: 1, output: 1}\ngravity: [0, 0, -10]\nfluid:\n  flow: laminar\n  density: 1000\n"
                  "  viscosity: 0\n  size: 1\n  regions: [{box: [[0, 0, 0], [3, 3, 3]]}]\n");
    silt_nodes_clear(&b->nodes);
    silt_mesh_clear(&b->mesh);
    b->nodes.dim = b->mesh.dim = 3;
    for (int i = 0; i < n; i++)
        silt_nodes_add(&b->nodes, NODE_FLUID, -1, x[i]);
    SILT_RESERVE(b->mesh.cell, b->mesh.cell_capacity, n_cell);
    for (int e = 0; e < n_cell; e++) {
        memcpy(b->mesh.cell[e], cell[e], sizeof *cell);
        if (silt_cell_volume(&b->mesh, b->nodes.x, e) < 0) {
            b->mesh.cell[e][0] = cell[e][1];
            b->mesh.cell[e][1] = cell[e][0];
        }
    }
    b->mesh.n_cell = n_cell;
    silt_mesh_connect(&b->mesh, &b->nodes);
}

// mesh and debts together, after the step has moved the nodes
static double moved_volume(bench *b, double dt) {
    for (int k = 0; k < 3 * b->nodes.count; k++)
        b->nodes.x[k] += dt * silt_mesh_velocity(&b->fluid, k);
    double sum = silt_mesh_volume(&b->mesh, b->nodes.x);
    for (int i = 0; i < b->nodes.count; i++)
        sum += b->nodes.debt[i];
    return sum;
}

// A crumb of one cell whose base is pressed together: it goes on as drops do, and owes what its cell loses. Kept at its volume it
// would lose three quarters of its speed, and its tip would rise.
static void test_crumb_flies(void **state) {
    (void)state;
    static const double x[4][3] = {{0, 0, 0}, {0.8, 0, 0}, {0.4, 0.7, 0}, {0.4, 0.25, 0.9}};
    static const double v[4][3] = {{1, 0.5, 0}, {-1, 0.5, 0}, {0, -1, 0.2}, {0.1, 0, 0}};
    bench b;
    bench_cells(&b, 4, x, 1, (const int[1][4]){{0, 1, 2, 3}});
    memcpy(b.nodes.v, v, sizeof v);
    const double before = silt_mesh_volume(&b.mesh, b.nodes.x), dt = 0.05;
    step(&b, dt);
    for (int i = 0; i < 4; i++)
        for (int d = 0; d < 3; d++)
            assert_float_equal(b.nodes.v[3 * i + d], v[i][d] - (d == 2 ? 10 * dt : 0), 1e-12);
    near(moved_volume(&b, dt), before, 1e-12, "volume of the crumb");
    assert_true(silt_mesh_volume(&b.mesh, b.nodes.x) < 0.9 * before);
    for (int i = 0; i < 4; i++)
        for (int d = 0; d < 3; d++)
            assert_float_equal(b.nodes.x[3 * i + d], x[i][d] + dt * v[i][d] - (d == 2 ? 5 * dt * dt : 0), 1e-12);
    bench_close(&b);
}

// A tip on a body of water has no pressure; what it cannot keep it owes, and no momentum comes of it.
static void test_tip_on_water(void **state) {
    (void)state;
    static const int path[6][2] = {{1, 3}, {1, 5}, {2, 3}, {2, 6}, {4, 5}, {4, 6}};
    double x[9][3] = {[8] = {0.6, 0.9, 1.9}};
    int cell[7][4] = {[6] = {4, 6, 7, 8}};
    for (int i = 0; i < 8; i++)
        for (int d = 0; d < 3; d++)
            x[i][d] = i >> d & 1 ? 1.5 : 0;
    for (int e = 0; e < 6; e++)
        memcpy(cell[e], (const int[4]){0, path[e][0], path[e][1], 7}, sizeof cell[e]);
    bench b;
    bench_cells(&b, 9, (const double(*)[3])x, 7, (const int(*)[4])cell);
    // the water is squeezed from the sides and rises, the tip stands
    for (int i = 0; i < 8; i++) {
        b.nodes.v[3 * i] = 0.75 - x[i][0];
        b.nodes.v[3 * i + 1] = 0.75 - x[i][1];
        b.nodes.v[3 * i + 2] = 2 * x[i][2];
    }
    double momentum[2][3] = {{0}}, mass = 0, before = silt_mesh_volume(&b.mesh, b.nodes.x);
    const double dt = 0.02;
    double *v = silt_alloc(27, sizeof *v);
    memcpy(v, b.nodes.v, 27 * sizeof *v);
    step(&b, dt);
    for (int i = 0; i < 9; i++) {
        mass += b.fluid.mass[i];
        for (int d = 0; d < 3; d++) {
            momentum[0][d] += b.fluid.mass[i] * v[3 * i + d];
            momentum[1][d] += b.fluid.mass[i] * b.nodes.v[3 * i + d];
        }
    }
    for (int d = 0; d < 3; d++)
        // but for the first projection, whose masses are those of the start
        assert_float_equal(momentum[1][d] - b.fluid.impulse[d], momentum[0][d] - (d == 2 ? 10 * dt * mass : 0), 1e-9 * mass);
    double most = 0;
    for (int i = 0; i < 8; i++)
        most = silt_max(most, fabs(b.nodes.p[i]));
    assert_true(most > 1000 && fabs(b.nodes.p[8]) < 1e-6 * most); // 12.8 kPa where it keeps its volume
    assert_true(b.nodes.debt[8] != 0);
    near(moved_volume(&b, dt), before, 1e-6, "volume of the water"); // fluid.tolerance
    free(v);
    bench_close(&b);
}

// ---------------------------------------------------------------- a node without a mass

// On a floor without friction a node that has nothing but a flat cell: it stays where it is.
static void test_flat_cell(void **state) {
    (void)state;
    static const double x[5][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.5, -1e-16}};
    bench b;
    bench_open(&b, "silt: 1\ntime: {end: 1, output: 1}\ngravity: [0, -10]\nfluid:\n  flow: laminar\n  density: 1000\n  viscosity: 0\n"
                   "  size: 1\n  regions: [{box: [[0, 0], [1, 1]]}]\nwalls: [{polyline: [[-9, 0], [0.5, 0], [9, -0.1]], condition: slip}]\n");
    silt_nodes_clear(&b.nodes);
    for (int i = 0; i < 5; i++) {
        silt_nodes_add(&b.nodes, NODE_FLUID, -1, x[i]);
        b.nodes.wall[i][0] = i == 4 ? 1 : x[i][1] == 0 ? 0 : -1;
        b.nodes.wall[i][1] = b.nodes.wall[i][2] = -1;
    }
    SILT_RESERVE(b.mesh.cell, b.mesh.cell_capacity, 3);
    memcpy(b.mesh.cell, (const int[3][4]){{0, 1, 2, -1}, {0, 2, 3, -1}, {0, 4, 1, -1}}, 3 * sizeof *b.mesh.cell);
    b.mesh.n_cell = 3;
    b.mesh.walls = &b.walls;
    silt_mesh_connect(&b.mesh, &b.nodes);
    step(&b, 0.01);
    assert_true(b.fluid.volume[4] < 1e-15);
    assert_true(b.nodes.v[8] == 0 && b.nodes.v[9] == 0);
    assert_true(b.nodes.v[2] > 0.01 && b.nodes.v[3] < 1e-12); // the others slide: the block spreads
    bench_close(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rest), cmocka_unit_test(test_stiff_rest),           cmocka_unit_test(test_free_fall),
        cmocka_unit_test(test_dam_break_start), cmocka_unit_test(test_patches),
        cmocka_unit_test(test_rigid_motion_without_viscous_loss),
        cmocka_unit_test(test_schemes_agree),  cmocka_unit_test(test_failure_keeps_the_state),
        cmocka_unit_test(test_debt_is_paid),
        cmocka_unit_test(test_crumb_flies),
        cmocka_unit_test(test_tip_on_water),
        cmocka_unit_test(test_flat_cell),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
