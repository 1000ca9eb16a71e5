// bodies on something solid: the water's inertia there is symmetric and positive, and it is what the step answers; films give the rim's
// pressure and take what is squeezed

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "run_folder.h"
#include "scene_text.h"

#include <fcntl.h>

#define PLANE                                                                                                          \
    "silt: 1\ndimension: 2\ntime: {end: 1, output: 1, step: 1.0e-3}\ngravity: [0, -9.81]\n"                          \
    "fluid: {density: 1000, viscosity: 1.0e-3, flow: laminar, size: 0.05, regions: [{box: [[0, 0], [1, 0.6]]}]}\n"     \
    "contact: {youngs_modulus: 5.0e+6, poissons_ratio: 0.3, restitution: 0.5, friction: 0.5, rolling_friction: 0}\n"
#define OPEN "walls: [{polyline: [[0, 0.9], [0, 0], [1, 0], [1, 0.9]], condition: slip}]\n"
#define SHUT "walls: [{polyline: [[0, 0.6], [0, 0], [1, 0], [1, 0.6], [0, 0.6]], condition: slip}]\n"
#define BLOCK(place) "bodies: [{name: block, shape: box, scale: 0.2, density: 2650, " place "}]\n"

static void begin(silt_run *run, silt_scene **scene, const char *text) {
    *scene = scene_of(text);
    folder_begin(run, *scene);
}

// the water's step of a run that has just begun, before anything moves
static silt_step water(silt_run *run) {
    run->dt = run->scene->time.step;
    silt_walls_move(&run->walls, run->scene, run->dt, run->dt);
    silt_run_prescribe(run);
    silt_run_bodies_coast(run);
    const silt_step step = silt_run_see(run);
    OK(silt_fluid_step(&run->fluid, &step, &error));
    OK(silt_run_bodies_load(run, &step, &error));
    return step;
}

// force and torque on body 0 when the step is solved again with it moving by `change` more at its end
static void answer(silt_run *run, const silt_step *step, const double change[6], double force[6]) {
    struct silt_body *body = silt_coupling_dem.bodies(run->coupling)->body, before = *body;
    for (int d = 0; d < 3; d++) {
        body->v[d] += change[d];
        body->w[d] += change[3 + d];
        body->x[d] += run->dt * (before.v[d] + run->fluid.theta * change[d]);
        body->q[d + 1] += 0.5 * run->dt * run->fluid.theta * change[3 + d]; // of a body that stands straight
    }
    OK(silt_run_bodies_answer(run, step, &error));
    memcpy(force, body->force, 3 * sizeof *force);
    memcpy(force + 3, body->torque, 3 * sizeof *force);
    *body = before;
}

// share of the entries' scale by which the matrix is not symmetric, over the rows that are there
static double lopsided(int n, const double *a) {
    double worst = 0;
    for (int r = 0; r < n; r++)
        for (int c = 0; c < r; c++)
            if (a[r * n + r] > 0 && a[c * n + c] > 0)
                worst = silt_max(worst, fabs(a[r * n + c] - a[c * n + r]) / sqrt(a[r * n + r] * a[c * n + c]));
    return worst;
}

// least pivot of Cholesky's factor over the diagonal's entry, of the rows that are there
static double least_pivot(int n, const double *matrix) {
    double a[36], least = 1;
    memcpy(a, matrix, (size_t)(n * n) * sizeof *a);
    for (int j = 0; j < n; j++) {
        if (matrix[j * n + j] == 0)
            continue;
        least = silt_min(least, a[j * n + j] / matrix[j * n + j]);
        for (int r = j + 1; r < n; r++)
            for (int c = j + 1; c <= r; c++)
                a[r * n + c] -= a[r * n + j] * a[c * n + j] / a[j * n + j];
    }
    return least;
}

// The inertia at the block: symmetric, positive, and what the water answers to each mode within `share`: a step looks
// eight times at what it takes from the pressure's gradient, which is most of the difference
static void inertia_holds(const char *text, int n_row, double share) {
    silt_run run;
    silt_scene *scene;
    begin(&run, &scene, text);
    const silt_step step = water(&run);
    int size;
    double *inertia;
    OK(silt_run_bodies_inertia(&run, &step, &size, &inertia, &error));
    assert_int_equal(size, 6);
    int rows = 0;
    for (int r = 0; r < size; r++)
        rows += inertia[r * size + r] > 0;
    assert_int_equal(rows, n_row);
    assert_non_null(run.film);
    near(lopsided(size, inertia), 0, 1e-8, "symmetric");
    assert_true(least_pivot(size, inertia) > 1e-6);

    double rest[6], moved[6], change[6] = {0};
    answer(&run, &step, change, rest);
    for (int mode = 0; mode < 6; mode++) {
        if (!(inertia[mode * size + mode] > 0))
            continue;
        memset(change, 0, sizeof change);
        change[mode] = 1e-3;
        answer(&run, &step, change, moved);
        const double expected = -inertia[mode * size + mode] * change[mode] / run.dt;
        near((moved[mode] - rest[mode]) / expected, 1, share, "answer over inertia");
    }
    free(inertia);
    end(&run, &scene);
}

static void test_flat(void **state) {
    (void)state;
    inertia_holds(PLANE OPEN BLOCK("at: [0.5, 0.1]"), 3, 0.02);
}

static void test_lifted(void **state) {
    (void)state;
    inertia_holds(PLANE OPEN BLOCK("at: [0.5, 0.105]"), 3, 0.02);
}

// 1 mm over the floor, with water from the left that three flat cells join to the film: its rim there is a node of theirs that can go nowhere. The
// film goes on past it, to the right's.
static void test_flat_rim(void **state) {
    (void)state;
    silt_run run;
    silt_scene *scene;
    begin(&run, &scene, PLANE OPEN BLOCK("at: [0.5, 0.101], velocity: [0, 0.05]"));
    silt_nodes *nodes = &run.nodes;
    int floor = 0, below[5], beside[2]; // the block's lower nodes, from left to right
    while (nodes->kind[floor] != NODE_FLUID || nodes->wall[floor][0] < 0 || nodes->x[2 * floor + 1] != 0 || nodes->x[2 * floor] < 0.1)
        floor++;
    for (int i = 0; i < nodes->count; i++)
        if (nodes->kind[i] == NODE_BODY && nodes->x[2 * i + 1] < 0.002)
            below[(int)round((nodes->x[2 * i] - 0.4) / 0.05)] = i;
    for (int k = 0; k < 2; k++) {
        beside[k] = silt_nodes_add(nodes, NODE_FLUID, -1, (double[]){0.425 + 0.1 * k, 0});
        memcpy(nodes->wall[beside[k]], nodes->wall[floor], sizeof *nodes->wall);
    }
    const int cell[4][4] = {{beside[0], below[1], below[0], -1}, {beside[0], beside[1], below[1], -1}, {beside[1], below[2], below[1], -1}, {beside[1], below[3], below[2], -1}};
    SILT_RESERVE(run.mesh.cell, run.mesh.cell_capacity, run.mesh.n_cell + 4);
    memcpy(run.mesh.cell + run.mesh.n_cell, cell, sizeof cell);
    run.mesh.n_cell += 4;
    silt_mesh_connect(&run.mesh, nodes);
    water(&run);
    // what the block draws in as it rises comes from the right alone: 0.05 m2/s over the last edge
    assert_int_equal(run.film->n_node, 2);
    silt_film_squeeze(run.film, 2, run.body_velocity, NULL);
    for (int k = 0; k < 2; k++) {
        const bool right = run.film->node[k] == below[4];
        assert_true(right || run.film->node[k] == below[3]);
        assert_int_equal(run.film->rim[k], right ? FILM_WET : FILM_INNER);
        near(run.film->squeezed[k], right ? -0.05 * 0.05 : 0, 1e-12, "drawn in");
    }
    end(&run, &scene);
}

// turned by 3 degrees on its left lower edge: 0.1 (cos 3 + sin 3)
static void test_tilted(void **state) {
    (void)state;
    inertia_holds(PLANE OPEN BLOCK("angle: 3, at: [0.5, 0.10509655]"), 3, 0.1);
}

// under the lid of a full tank, whose water can go nowhere
static void test_lid(void **state) {
    (void)state;
    inertia_holds(PLANE SHUT BLOCK("at: [0.5, 0.5]"), 3, 0.02);
}

static void test_space(void **state) {
    (void)state;
    inertia_holds("silt: 1\ndimension: 3\ntime: {end: 1, output: 1, step: 1.0e-3}\ngravity: [0, 0, -9.81]\n"
                  "fluid: {density: 1000, viscosity: 1.0e-3, flow: laminar, size: 0.08, regions: [{box: [[0, 0, 0], [0.8, 0.8, 0.4]]}]}\n"
                  "walls: [{box: [[0, 0, 0], [0.8, 0.8, 0.6]], condition: slip}]\n"
                  "contact: {youngs_modulus: 5.0e+6, poissons_ratio: 0.3, restitution: 0.5, friction: 0.5, rolling_friction: 0}\n"
                  "bodies: [{name: block, shape: box, scale: 0.2, density: 2650, at: [0.4, 0.4, 0.1]}]\n",
                  6, 0.01);
}

// 2 e e^T - f f^T + 3 g g^T with orthonormal e, f, g: without its negative part, which is known
static void test_clip(void **state) {
    (void)state;
    const double axis[3][3] = {{2.0 / 3, 2.0 / 3, 1.0 / 3}, {-2.0 / 3, 1.0 / 3, 2.0 / 3}, {1.0 / 3, -2.0 / 3, 2.0 / 3}}, value[3] = {2, -1, 3};
    double a[9] = {0}, kept[9] = {0};
    for (int k = 0; k < 9; k++)
        for (int m = 0; m < 3; m++) {
            a[k] += value[m] * axis[m][k / 3] * axis[m][k % 3];
            kept[k] += silt_max(value[m], 0) * axis[m][k / 3] * axis[m][k % 3];
        }
    assert_int_equal(silt_matrix_clip(3, a), 1);
    for (int k = 0; k < 9; k++)
        near(a[k], kept[k], 1e-13, "clipped");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_flat), cmocka_unit_test(test_lifted), cmocka_unit_test(test_tilted), cmocka_unit_test(test_flat_rim),
        cmocka_unit_test(test_lid),  cmocka_unit_test(test_space),  cmocka_unit_test(test_clip),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
