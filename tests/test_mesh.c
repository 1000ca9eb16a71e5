// the water's mesh: what is water, and that no volume is made or lost unbooked
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <unistd.h>

#include "delaunay.h"
#include "remesh.h"
#include "scene_text.h"

#define HEAD "silt: 1\ndimension: 2\ntime: {end: 1, output: 1}\ngravity: [0, -9.81]\n"
#define WATER "fluid:\n  flow: laminar\n  theta: 0.55\n  density: 1000\n  viscosity: 0\n  size: 0.05\n  jitter: 0.2\n"

typedef struct bench {
    silt_scene *scene;
    silt_walls walls;
    silt_nodes nodes;
    silt_mesh mesh;
    silt_memory memory;
    silt_barrier barrier;
    int *map;
    double *old;
} bench;

static void bench_open(bench *b, const char *text) {
    *b = (bench){.scene = scene_of(text)};
    silt_walls_create(&b->walls, b->scene, NULL);
    b->barrier.walls = &b->walls;
    silt_nodes_seed(&b->nodes, b->scene, &b->walls, NULL, NULL);
    silt_error err = {0};
    assert_int_equal(silt_mesh_first(&b->mesh, &b->nodes, b->scene, &b->barrier, &err), SILT_OK);
    b->map = silt_alloc(100000, sizeof *b->map);
    b->old = silt_alloc(100000, sizeof *b->old);
}

static void bench_close(bench *b) {
    silt_walls_clear(&b->walls);
    silt_nodes_clear(&b->nodes);
    silt_mesh_clear(&b->mesh);
    silt_memory_clear(&b->memory);
    silt_scene_free(&b->scene);
    free(b->map);
    free(b->old);
}

static double debts(const bench *b) {
    double sum = 0;
    for (int i = 0; i < b->nodes.count; i++)
        sum += b->nodes.debt[i];
    return sum;
}

static void rebuild(bench *b, bool refine) {
    silt_error err = {0};
    if (refine)
        silt_mesh_refine(&b->mesh, &b->nodes, &b->memory, b->scene->fluid.size);
    assert_int_equal(silt_mesh_rebuild(&b->mesh, &b->nodes, b->scene, &b->barrier, &b->memory, b->map, &err), SILT_OK);
}

static void test_delaunay(void **state) {
    (void)state;
    // unit square and its middle: four triangles, all counter-clockwise
    const double x[10] = {0, 0, 1, 0, 1, 1, 0, 1, 0.5, 0.5};
    int *triangle, n;
    assert_int_equal(silt_delaunay_2d(5, x, &triangle, &n), 0);
    assert_int_equal(n, 4);
    double area = 0;
    for (int e = 0; e < n; e++) {
        const double a = silt_cell_area(x, triangle + 3 * e);
        assert_true(a > 0);
        area += a;
    }
    assert_true(fabs(area - 1) < 1e-15);
    free(triangle);
    // two points, and all on a line: no triangle, no crash
    assert_int_equal(silt_delaunay_2d(2, x, &triangle, &n), 0);
    assert_int_equal(n, 0);
    free(triangle);
    const double line[6] = {0, 0, 1, 0, 2, 0};
    assert_int_equal(silt_delaunay_2d(3, line, &triangle, &n), 0);
    assert_int_equal(n, 0);
    free(triangle);
}

// A cloud with flat sides, hollows and ties without number that moves, loses nodes and gains some: what follows it is at every
// step the triangulation that a new one is, ties included.
static void test_delaunay_follows(void **state) {
    (void)state;
    enum { SIDE = 20, ROOM = 2 * SIDE * SIDE, STEPS = 300 };
    static double x[2 * ROOM];
    static uint8_t dead[ROOM];
    static int map[ROOM], fresh[6 * ROOM][4], followed[6 * ROOM][4];
    uint64_t random = 5;
    silt_delaunay *kept = NULL;
    int n = 0, n_same = 0;
    for (int j = 0; j < SIDE; j++)
        for (int i = 0; i < SIDE; i++)
            if (i < 8 || j < 6 || i > 14) {
                x[2 * n] = i;
                x[2 * n++ + 1] = j;
            }
    for (int step = 0; step < STEPS; step++) {
        memset(dead, 0, sizeof dead);
        // at rest; all along on the lattice; on their way; far
        const double reach = step < 3 ? 0 : step % 50 == 49 ? 3 : 0.004 * (step % 20);
        for (int i = 0; i < n; i++) {
            dead[i] = step > 1 && silt_uniform(&random) < 0.01;
            for (int d = 0; d < 2; d++) {
                const double at = x[2 * i + d];
                if (at > 0 && at < SIDE - 1) // sides stay straight
                    x[2 * i + d] = silt_clamp(at + reach * (silt_uniform(&random) - 0.5), 0, SIDE - 1);
                if (step % 25 == 24)
                    x[2 * i + d] = round(8 * x[2 * i + d]) / 8; // ties again
            }
        }
        for (int k = 0; step > 0 && k < 4 && n < ROOM; k++, n++)
            for (int d = 0; d < 2; d++)
                x[2 * n + d] = round(16 * (SIDE - 1) * silt_uniform(&random)) / 16;
        for (int i = 0; i < n; i++) // no two at one place
            for (int k = 0; k < i; k++)
                if (!dead[i] && !dead[k] && x[2 * i] == x[2 * k] && x[2 * i + 1] == x[2 * k + 1])
                    dead[i] = 1;
        int *found, n_found, *again, n_again, m = 0;
        assert_int_equal(silt_delaunay_follow(&kept, n, x, dead, &found, &n_found), 0);
        for (int i = 0; i < n; i++)
            map[i] = dead[i] ? -1 : m++;
        for (int k = 0; k < 3 * n_found; k++)
            found[k] = map[found[k]];
        for (int i = 0; i < n; i++)
            if (!dead[i])
                memmove(x + 2 * map[i], x + 2 * i, 2 * sizeof *x);
        silt_delaunay_renumber(kept, map, m);
        n = m;
        assert_int_equal(silt_delaunay_2d(n, x, &again, &n_again), 0);
        assert_int_equal(n_found, n_again);
        silt_cells_sort(n, 3, n_found, found, followed);
        silt_cells_sort(n, 3, n_again, again, fresh);
        assert_memory_equal(followed, fresh, (size_t)n_found * sizeof *fresh);
        n_same += silt_delaunay_followed(kept);
        free(found);
        free(again);
    }
    assert_in_range(n_same, STEPS / 2, STEPS - 2); // and now and then it is one
    silt_delaunay_free(&kept);
}

static void test_first_mesh_fills_the_region(void **state) {
    (void)state;
    bench b;
    // sloped floor and a 45 degree wall: area 0.525 by the shoelace formula
    bench_open(&b, HEAD WATER "  regions: [{polygon: [[0, 0.2], [1, 0], [1.5, 0.5], [0, 0.5]]}]\n"
                       "walls: [{polyline: [[0, 0.8], [0, 0.2], [1, 0], [1.8, 0.8]], condition: slip}]\n");
    assert_true(fabs(silt_mesh_volume(&b.mesh, b.nodes.x) - 0.525) < 1e-12);
    // boundary: free on top, wall elsewhere; Euler: cells = 2 nodes - boundary edges - 2
    double top = 0;
    for (int k = 0; k < b.mesh.n_facet; k++) {
        const double *p = b.nodes.x + 2 * b.mesh.facet[k][0], *q = b.nodes.x + 2 * b.mesh.facet[k][1];
        const bool on_top = p[1] > 0.5 - 1e-9 && q[1] > 0.5 - 1e-9;
        assert_int_equal(b.mesh.facet_kind[k], on_top ? FACET_FREE : FACET_WALL);
        top += on_top ? hypot(q[0] - p[0], q[1] - p[1]) : 0;
    }
    assert_true(fabs(top - 1.5) < 1e-12);
    assert_int_equal(b.mesh.n_cell, 2 * b.nodes.count - b.mesh.n_facet - 2);
    bench_close(&b);
}

static void test_flips_book_nothing(void **state) {
    (void)state;
    bench b;
    bench_open(&b, HEAD WATER "  regions: [{box: [[0, 0], [1, 0.5]]}]\nwalls: [{polyline: [[0, 1], [0, 0], [1, 0], [1, 1]], condition: slip}]\n");
    uint64_t random = 7;
    int changed = 0;
    for (int step = 0; step < 50; step++) {
        // inner nodes wander; the areas that count are those after the wandering
        for (int i = 0; i < b.nodes.count; i++)
            for (int d = 0; d < 2; d++)
                if (b.mesh.wet[i] && !b.mesh.surface[i] && b.nodes.wall[i][0] < 0)
                    b.nodes.x[2 * i + d] += 0.08 * 0.05 * (2 * silt_uniform(&random) - 1);
        silt_memory_take(&b.memory, &b.mesh, &b.nodes);
        const int before = b.mesh.n_cell;
        rebuild(&b, step % 2);
        changed += b.mesh.n_cell != before;
        assert_true(fabs(silt_mesh_volume(&b.mesh, b.nodes.x) - 0.5) < 1e-12);
        for (int i = 0; i < b.nodes.count; i++)
            assert_true(fabs(b.nodes.debt[i]) < 1e-15);
    }
    assert_true(changed > 0); // nodes came and went, so the test is not empty
    bench_close(&b);
}

static void test_volume_and_debt_close(void **state) {
    (void)state;
    bench b;
    bench_open(&b, HEAD WATER "  regions: [{box: [[0, 0], [0.5, 0.5]]}, {circle: [0.9, 0.6], radius: 0.15}]\n"
                       "walls: [{polyline: [[0, 2], [0, 0], [2, 0], [2, 2]], condition: slip}]\n");
    uint64_t random = 3;
    const double start = silt_mesh_volume(&b.mesh, b.nodes.x);
    double moved = 0;
    int flew = 0, joined = 0;
    for (int step = 0; step < 200; step++) {
        // a torn, sheared, colliding motion; what it does to areas is the motion's business, the rest must be booked
        const double before = silt_mesh_volume(&b.mesh, b.nodes.x);
        memcpy(b.old, b.nodes.x, 2 * (size_t)b.nodes.count * sizeof(double));
        for (int i = 0; i < b.nodes.count; i++) {
            double *x = b.nodes.x + 2 * i, *v = b.nodes.v + 2 * i;
            if (b.nodes.wall[i][0] >= 0)
                continue;
            v[0] = 0.5 * (0.7 - x[0]) + 0.6 * sin(7 * x[1] + step) + 0.4 * (2 * silt_uniform(&random) - 1);
            v[1] = -0.6 * x[1] + 0.5 * cos(9 * x[0] - step) + 0.4 * (2 * silt_uniform(&random) - 1);
            x[0] += 0.02 * v[0];
            x[1] += 0.02 * v[1];
        }
        moved += silt_mesh_volume(&b.mesh, b.nodes.x) - before;
        silt_memory_take(&b.memory, &b.mesh, &b.nodes);
        uint8_t wet[20000];
        memcpy(wet, b.mesh.wet, (size_t)b.nodes.count);
        const int n = b.nodes.count;
        silt_walls_contact(&b.walls, &b.nodes, b.old, b.memory.interior, NULL, 0.05);
        rebuild(&b, true);
        for (int i = 0; i < n; i++)
            if (b.map[i] >= 0) {
                flew += wet[i] && !b.mesh.wet[b.map[i]];
                joined += !wet[i] && b.mesh.wet[b.map[i]];
            }
        const double all = silt_mesh_volume(&b.mesh, b.nodes.x) + debts(&b);
        if (fabs(all - start - moved) > 1e-11)
            fail_msg("step %d: %.3g m3 of volume unbooked", step, all - start - moved);
    }
    assert_true(flew > 5 && joined > 5);
    bench_close(&b);
}

static void test_contact_with_walls(void **state) {
    (void)state;
    bench b;
    bench_open(&b, HEAD WATER "  regions: [{box: [[0, 0], [0.5, 0.5]]}]\n"
                       "walls: [{polyline: [[0, 2], [0, 0], [2, 0], [2, 2]], condition: slip}]\n");
    // a drop that falls through the floor within a step is put on it, keeps its speed along it, loses the one into it
    const double x[2] = {1, 0.02}, old[2] = {1, 0.02};
    const int i = silt_nodes_add(&b.nodes, NODE_FLUID, -1, x);
    b.nodes.x[2 * i + 1] = -0.03;
    b.nodes.v[2 * i] = 0.3;
    b.nodes.v[2 * i + 1] = -1;
    memcpy(b.old, b.nodes.x, 2 * (size_t)b.nodes.count * sizeof(double));
    memcpy(b.old + 2 * i, old, sizeof old);
    silt_memory_take(&b.memory, &b.mesh, &b.nodes);
    silt_walls_contact(&b.walls, &b.nodes, b.old, b.memory.interior, NULL, 0.05);
    assert_int_equal(b.nodes.wall[i][0], 1);
    assert_true(b.nodes.x[2 * i + 1] == 0 && b.nodes.v[2 * i + 1] == 0 && b.nodes.v[2 * i] == 0.3);
    // sliding into the corner, it stays there
    b.nodes.x[2 * i] = 2.01;
    memcpy(b.old, b.nodes.x, 2 * (size_t)b.nodes.count * sizeof(double));
    silt_walls_contact(&b.walls, &b.nodes, b.old, b.memory.interior, NULL, 0.05);
    assert_true(b.nodes.x[2 * i] == 2 && b.nodes.x[2 * i + 1] == 0 && b.nodes.wall[i][1] >= 0);
    // distances: inside positive, behind negative, at a corner by the nearest wall
    int segment;
    assert_true(fabs(silt_walls_distance(&b.walls, (double[2]){0.3, 0.1}, &segment) - 0.1) < 1e-15 && segment == 1);
    assert_true(silt_walls_distance(&b.walls, (double[2]){-0.3, -0.1}, &segment) < 0);
    assert_true(silt_walls_distance(&b.walls, (double[2]){2.1, 1}, &segment) < 0);
    bench_close(&b);
}

static void test_locate(void **state) {
    (void)state;
    bench b;
    bench_open(&b, HEAD WATER "  regions: [{box: [[0, 0], [1, 0.5]]}]\nwalls: [{polyline: [[0, 1], [0, 0], [1, 0], [1, 1]], condition: slip}]\n");
    silt_locator locator = {0};
    silt_locator_build(&locator, &b.mesh, b.nodes.x, 0.05);
    uint64_t random = 11;
    for (int k = 0; k < 2000; k++) {
        const double p[2] = {1.2 * silt_uniform(&random) - 0.1, 0.7 * silt_uniform(&random) - 0.1};
        double w[3];
        const int e = silt_locate(&locator, &b.mesh, b.nodes.x, p, w);
        const bool inside = p[0] >= 0 && p[0] <= 1 && p[1] >= 0 && p[1] <= 0.5;
        assert_int_equal(e >= 0, inside);
        if (e < 0)
            continue;
        // a walk from near by ends in the same cell with the same weights, one from afar may give up
        double found[3] = {0};
        const int start = b.mesh.node_cell[b.mesh.node_cell_start[b.mesh.cell[e][k % 3]]];
        assert_int_equal(silt_locate_from(&b.mesh, b.nodes.x, p, start, found), e);
        assert_memory_equal(found, w, sizeof w);
        const int far = silt_locate_from(&b.mesh, b.nodes.x, p, 0, found);
        assert_true(far == e || far == -1);
        for (int d = 0; d < 2; d++) {
            double x = 0;
            for (int a = 0; a < 3; a++)
                x += w[a] * b.nodes.x[2 * b.mesh.cell[e][a] + d];
            assert_true(fabs(x - p[d]) < 1e-12);
        }
    }
    silt_locator_clear(&locator);
    bench_close(&b);
}

// how many walls a node lies on, and the axis along which it is nearest to another one of the unit box's; *at: where that wall is
static int box_walls(const bench *b, int i, int *axis, double *at) {
    const int dim = silt_nodes_dim(&b->nodes);
    int n = 0;
    double nearest = HUGE_VAL;
    for (int d = 0; d < dim; d++) {
        const double x = b->nodes.x[dim * i + d], side = x < 0.5 ? 0 : 1, off = fabs(x - side);
        n += off == 0;
        if (off > 0 && off < nearest) {
            nearest = off;
            *axis = d;
            *at = side;
        }
    }
    return n;
}

// A full box: nodes that are put on a wall or into a crease press cells flat onto it, and edges under these get nodes in the same
// step. It stays full, with walls all around.
static void test_pressed_cells_leave_no_hole(void **state) {
    (void)state;
    static const char *const text[4] = {
        [2] = HEAD WATER "  seed: %d\n  regions: [{box: [[0, 0], [1, 1]]}]\n"
                         "walls: [{polyline: [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]], condition: slip}]\n",
        [3] = "silt: 1\ndimension: 3\ntime: {end: 1, output: 1}\ngravity: [0, 0, -9.81]\nfluid:\n  flow: laminar\n  density: 1000\n"
              "  viscosity: 0\n  size: 0.2\n  jitter: 0.2\n  seed: %d\n  regions: [{box: [[0, 0, 0], [1, 1, 1]]}]\n"
              "walls: [{box: [[0, 0, 0], [1, 1, 1]], condition: slip}]\n"};
    for (int trial = 0; trial < 16; trial++) {
        const int dim = 2 + trial % 2;
        char filled[2000];
        bench b;
        snprintf(filled, sizeof filled, text[dim], trial);
        bench_open(&b, filled);
        silt_nodes *nodes = &b.nodes;
        const double h = b.scene->fluid.size;
        uint64_t random = (uint64_t)trial;
        int axis = 0, n_put = 0, n_come = 0;
        double at = 0;
        // places on walls and in creases get empty
        silt_memory_take(&b.memory, &b.mesh, nodes);
        for (int i = 0; i < nodes->count; i++)
            b.memory.dead[i] = box_walls(&b, i, &axis, &at) == dim - 1 && silt_uniform(&random) < 0.5;
        rebuild(&b, false);
        // the nodes before them come near, then onto the wall
        for (int step = 0; step < 2; step++) {
            silt_memory_take(&b.memory, &b.mesh, nodes);
            for (int i = 0; i < nodes->count; i++) {
                double *x = nodes->x + dim * i, on[3], room = HUGE_VAL;
                if (nodes->wall[i][dim - 1] >= 0 || box_walls(&b, i, &axis, &at) != dim - 2 || fabs(x[axis] - at) > 1.3 * h)
                    continue;
                for (int k = 0; k < nodes->count; k++) {
                    double square = 0;
                    for (int d = 0; d < dim && k != i; d++)
                        square += silt_square(nodes->x[dim * k + d] - (d == axis ? at : x[d]));
                    room = k == i ? room : silt_min(room, sqrt(square));
                }
                if (room < 0.6 * h)
                    continue;
                n_put += step;
                x[axis] = step ? at : at + 0.25 * (x[axis] - at);
                if (step)
                    silt_walls_touching(&b.walls, x, 1e-6 * h, nodes->wall[i], on);
            }
            if (step) {
                const int before = nodes->count;
                silt_mesh_refine(&b.mesh, nodes, &b.memory, h / 1.3);
                n_come = nodes->count - before;
            }
            rebuild(&b, false);
        }
        assert_true(n_put > 2 && n_come > 2);
        for (int k = 0; k < b.mesh.n_facet; k++)
            assert_int_equal(b.mesh.facet_kind[k], FACET_WALL);
        assert_true(fabs(silt_mesh_volume(&b.mesh, nodes->x) - 1) < 1e-12);
        bench_close(&b);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_delaunay),
        cmocka_unit_test(test_delaunay_follows),
        cmocka_unit_test(test_first_mesh_fills_the_region),
        cmocka_unit_test(test_flips_book_nothing),
        cmocka_unit_test(test_volume_and_debt_close),
        cmocka_unit_test(test_contact_with_walls),
        cmocka_unit_test(test_pressed_cells_leave_no_hole),
        cmocka_unit_test(test_locate),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
