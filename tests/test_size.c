// the size field, and the cloud that follows it: nodes added and removed, what that does to momentum, the shuffle
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <unistd.h>

#include "pfem.h"
#include "scene_text.h"

#define HEAD2 "silt: 1\ndimension: 2\ntime: {end: 1, output: 1}\ngravity: [0, -9.81]\n"
#define HEAD3 "silt: 1\ndimension: 3\ntime: {end: 1, output: 1}\ngravity: [0, 0, -9.81]\n"
#define WATER "fluid:\n  density: 1000\n  viscosity: 1.0e-3\n  size: 0.05\n"
#define TANK2 "walls: [{polyline: [[0, 1], [0, 0], [1, 0], [1, 1]], condition: slip}]\n"
#define TANK3 "walls: [{box: [[0, 0, 0], [1, 1, 2]], condition: slip}]\n"

typedef struct bench {
    silt_scene *scene;
    silt_walls walls;
    silt_nodes nodes;
    silt_mesh mesh;
    silt_memory memory;
    silt_barrier barrier;
    silt_size *size;
    int *map;
    int dim, map_capacity;
    int added, removed;
} bench;

static void bench_mesh(bench *b) {
    silt_error err = {0};
    b->barrier.walls = &b->walls;
    b->mesh.dim = b->dim;
    assert_int_equal(silt_mesh_first(&b->mesh, &b->nodes, b->scene, &b->barrier, &err), SILT_OK);
    b->mesh.walls = &b->walls;
    silt_size_create(&b->size, b->scene, &b->walls);
    silt_size_update(b->size, &b->nodes, &b->mesh);
}

static void bench_open(bench *b, const char *text) {
    *b = (bench){.scene = scene_of(text)};
    silt_error err = {0};
    b->dim = b->scene->dimension;
    assert_int_equal(silt_walls_create(&b->walls, b->scene, &err), SILT_OK);
    silt_nodes_seed(&b->nodes, b->scene, &b->walls, NULL, NULL);
    bench_mesh(b);
}

static void bench_close(bench *b) {
    silt_walls_clear(&b->walls);
    silt_nodes_clear(&b->nodes);
    silt_mesh_clear(&b->mesh);
    silt_memory_clear(&b->memory);
    silt_size_free(&b->size);
    silt_size_free(&b->size); // twice is once
    silt_scene_free(&b->scene);
    free(b->map);
}

// takes the mesh down, refines, rebuilds; counts what came and went
static void remesh(bench *b) {
    silt_error err = {0};
    silt_memory_take(&b->memory, &b->mesh, &b->nodes);
    const int before = b->nodes.count;
    silt_mesh_refine(&b->mesh, &b->nodes, &b->memory, b->scene->fluid.size);
    b->added += b->nodes.count - before;
    for (int i = 0; i < b->nodes.count; i++)
        b->removed += b->memory.dead[i] != 0;
    SILT_RESERVE(b->map, b->map_capacity, b->nodes.count + 1);
    assert_int_equal(silt_mesh_rebuild(&b->mesh, &b->nodes, b->scene, &b->barrier, &b->memory, b->map, &err), SILT_OK);
}

static int rising(const void *a, const void *b) {
    return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

// edges over the local size: 0, 1, 50, 99, 100 per cent
static void edges(const bench *b, double q[5]) {
    const silt_mesh *mesh = &b->mesh;
    double *ratio = silt_alloc((size_t)mesh->neighbour_start[mesh->n_node] + 1, sizeof *ratio);
    int n = 0;
    for (int i = 0; i < mesh->n_node; i++)
        for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1]; k++) {
            const int j = mesh->neighbour[k];
            double d[3] = {0};
            for (int c = 0; c < b->dim && j > i; c++)
                d[c] = b->nodes.x[b->dim * j + c] - b->nodes.x[b->dim * i + c];
            if (j > i)
                ratio[n++] = 2 * silt_length(3, d) / (silt_node_h(&b->nodes, i, b->scene->fluid.size) +
                                                      silt_node_h(&b->nodes, j, b->scene->fluid.size));
        }
    qsort(ratio, (size_t)n, sizeof *ratio, rising);
    for (int k = 0; k < 5; k++)
        q[k] = ratio[(int)((n - 1) * (double[]){0, 0.01, 0.5, 0.99, 1}[k])];
    free(ratio);
}

// ---- the field

static void test_none(void **state) {
    (void)state;
    bench b;
    bench_open(&b, HEAD2 WATER "  regions: [{box: [[0, 0], [1, 0.5]]}]\n" TANK2);
    assert_true(b.size == NULL && b.nodes.h == NULL);
    assert_true(silt_size_at(NULL, b.scene, b.nodes.x) == 0.05 && silt_node_h(&b.nodes, 3, 0.05) == 0.05);
    bench_close(&b);
}

static void test_distance_of_regions(void **state) {
    (void)state;
    double prism[12] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    const silt_region box = {.kind = REGION_BOX, .lo = {0, 0, 0}, .hi = {1, 2, 3}};
    const silt_region ball = {.kind = REGION_SPHERE, .centre = {1, 1, 1}, .radius = 0.5};
    const silt_region upright = {.kind = REGION_POLYGON, .n_point = 4, .point = prism, .lo = {0, 2, 0}, .hi = {0, 3, 0}};
#define AT(...) ((const double[3]){__VA_ARGS__})
    assert_true(silt_region_distance(&box, 2, AT(0.5, 1.8)) == 1.8 - 2);
    assert_true(silt_region_distance(&box, 2, AT(4, 6)) == 5);
    assert_true(fabs(silt_region_distance(&box, 3, AT(3, 4, 4)) - 3) < 1e-15);
    assert_true(silt_region_distance(&box, 3, AT(0.5, 1, 0.2)) == -0.2);
    assert_true(fabs(silt_region_distance(&ball, 3, AT(1, 1, 3)) - 1.5) < 1e-15);
    assert_true(silt_region_distance(&upright, 3, AT(0.5, 2.5, 0.25)) == -0.25);
    assert_true(silt_region_distance(&upright, 3, AT(0.5, 2.9, 0.5)) == 2.9 - 3);
    assert_true(fabs(silt_region_distance(&upright, 3, AT(4, 7, 0.5)) - 5) < 1e-15);
    assert_true(silt_region_distance(&upright, 2, AT(0.5, 3)) == 2); // the polygon as it stands in the plane
}

static void test_rules(void **state) {
    (void)state;
    // fine, finer, and coarse; growth 0.3
    bench b;
    bench_open(&b, HEAD2 WATER "  regions: [{box: [[0, 0], [1, 0.5]]}]\n  sizes:\n"
                               "    - {box: [[0, 0], [0.2, 0.5]], size: 0.03, distance: 0.05}\n"
                               "    - {circle: [0, 0], radius: 0.1, size: 0.02}\n"
                               "    - {box: [[0.7, 0], [1, 0.5]], size: 0.1}\n" TANK2);
    const struct {
        double x[2], h;
    } at[] = {{{0.15, 0.4}, 0.03}, {{0.249, 0.2}, 0.03}, {{0.27, 0.2}, 0.03 + 0.3 * 0.02}, {{0.05, 0.05}, 0.02},
              {{0.1, 0.08}, 0.02 + 0.3 * (hypot(0.1, 0.08) - 0.1)}, {{0.5, 0.1}, 0.05}, {{0.8, 0.3}, 0.1}, {{0.6, 0.3}, 0.1 - 0.3 * 0.1}};
    for (size_t k = 0; k < sizeof at / sizeof *at; k++)
        assert_true(fabs(silt_size_at(b.size, b.scene, at[k].x) - at[k].h) < 1e-14);
    // nowhere steeper than the growth; the nodes have what the places have
    uint64_t random = 5;
    for (int k = 0; k < 5000; k++) {
        const double p[2] = {1.4 * silt_uniform(&random) - 0.2, silt_uniform(&random) - 0.2};
        const double q[2] = {p[0] + 0.1 * silt_uniform(&random), p[1] - 0.1 * silt_uniform(&random)};
        const double change = silt_size_at(b.size, b.scene, p) - silt_size_at(b.size, b.scene, q);
        assert_true(fabs(change) <= 0.3 * hypot(q[0] - p[0], q[1] - p[1]) + 1e-15);
    }
    for (int i = 0; i < b.nodes.count; i++)
        assert_true(b.nodes.h[i] == silt_size_at(b.size, b.scene, b.nodes.x + 2 * i));
    bench_close(&b);
}

static void test_follows_the_surface(void **state) {
    (void)state;
    static const char *const text[2] = {
        HEAD2 WATER "  jitter: 0.2\n  regions: [{box: [[0, 0], [1, 0.5]]}]\n  sizes: [{near: surface, size: 0.025, distance: 0.06}, {near: walls, size: 0.03}]\n" TANK2,
        HEAD3 WATER "  regions: [{box: [[0, 0, 0], [1, 1, 0.5]]}]\n  sizes: [{near: surface, size: 0.03, distance: 0.06}]\n" TANK3};
    for (int k = 0; k < 2; k++) {
        bench b;
        bench_open(&b, text[k]);
        // the water sinks by a third: what is near the surface is another place
        double worst = 0;
        for (int i = 0; i < b.nodes.count; i++)
            b.nodes.x[b.dim * i + b.dim - 1] *= 0.66;
        silt_size_update(b.size, &b.nodes, &b.mesh);
        for (int i = 0; i < b.nodes.count; i++) {
            const double *x = b.nodes.x + b.dim * i, depth = 0.33 - x[b.dim - 1];
            double h = silt_min(0.05, (k ? 0.03 : 0.025) + 0.3 * silt_max(0, depth - 0.06));
            if (k == 0)
                h = silt_min(h, 0.03 + 0.3 * silt_min(x[1], silt_min(x[0], 1 - x[0])));
            worst = silt_max(worst, fabs(b.nodes.h[i] / h - 1));
        }
        // by the nearest node instead of the nearest place of the surface
        print_message("%d-D: size near surface and walls off by at most %.1f %%\n", b.dim, 100 * worst);
        assert_true(worst < 0.08);
        const double start = silt_seconds();
        for (int trial = 0; trial < 20; trial++)
            silt_size_update(b.size, &b.nodes, &b.mesh);
        print_message("%.2f us per node and update\n", 1e6 * (silt_seconds() - start) / 20 / b.nodes.count);
        bench_close(&b);
    }
}

// ---- the cloud that follows

// sizes by hand: fine around a spot
static void spot(bench *b, double at) {
    if (!b->nodes.h)
        b->nodes.h = silt_alloc((size_t)b->nodes.capacity, sizeof *b->nodes.h);
    for (int i = 0; i < b->nodes.count; i++) {
        double d[3] = {0};
        for (int c = 0; c < b->dim; c++)
            d[c] = b->nodes.x[b->dim * i + c] - (c ? 0.25 : at);
        b->nodes.h[i] = silt_clamp(0.02 + 0.3 * (silt_length(3, d) - 0.06), 0.02, 0.05);
    }
}

static void test_follows_a_spot(void **state) {
    (void)state;
    static const char *const text[2] = {HEAD2 WATER "  regions: [{box: [[0, 0], [1, 0.5]]}]\n" TANK2,
                                        HEAD3 WATER "  regions: [{box: [[0, 0, 0], [0.7, 0.5, 0.4]]}]\n"};
    for (int k = 0; k < 2; k++) {
        bench b;
        bench_open(&b, text[k]);
        const double volume = silt_mesh_volume(&b.mesh, b.nodes.x);
        double q[5];
        // appears all at once, then wanders by a third of its distance between nodes in a step
        int settled = -1;
        for (int step = 0; step < 15; step++) {
            const int edits = b.added + b.removed;
            spot(&b, 0.3);
            remesh(&b);
            settled = b.added + b.removed == edits ? (settled < 0 ? step : settled) : -1;
        }
        spot(&b, 0.3);
        edges(&b, q);
        print_message("%d-D spot: %d added, %d removed, nothing more after %d steps; edges %.2f, %.2f, %.2f, %.2f, %.2f h\n", b.dim,
                      b.added, b.removed, settled, q[0], q[1], q[2], q[3], q[4]);
        assert_true(b.added > (k ? 150 : 30) && b.removed < 0.1 * b.added);
        assert_true(settled >= 0 && settled <= 10); // and no to and fro
        assert_true(q[0] > 0.45 && q[3] < 1.6);
        for (int step = 0; step < 40; step++) {
            spot(&b, 0.3 + 0.007 * step);
            remesh(&b);
        }
        edges(&b, q);
        print_message("    wanders by 14 of its sizes: %d added, %d removed; edges %.2f, %.2f, %.2f, %.2f, %.2f h\n", b.added,
                      b.removed, q[0], q[1], q[2], q[3], q[4]);
        assert_true(q[1] > 0.5 && q[3] < 1.75 && b.removed > 0);
        assert_true(fabs(silt_mesh_volume(&b.mesh, b.nodes.x) - volume) < 1e-9);
        bench_close(&b);
    }
}

static void test_strain(void **state) {
    (void)state;
    // a block in pure strain until three times as long, then sheared, without walls
    static const char *const text[2] = {HEAD2 WATER "  jitter: 0.2\n  regions: [{box: [[-0.5, -0.5], [0.5, 0.5]]}]\n",
                                        HEAD3 WATER "  jitter: 0.1\n  regions: [{box: [[-0.25, -0.25, -0.25], [0.25, 0.25, 0.25]]}]\n"};
    for (int k = 0; k < 2; k++) {
        bench b;
        bench_open(&b, text[k]);
        const int start = b.nodes.count, steps = k ? 50 : 100;
        const double rate = log(3) / steps, volume = silt_mesh_volume(&b.mesh, b.nodes.x);
        long node_steps = 0;
        double q[5];
        for (int part = 0; part < 2; part++) {
            b.added = b.removed = 0;
            node_steps = 0;
            for (int step = 0; step < steps; step++) {
                for (int i = 0; i < b.nodes.count; i++) {
                    double *x = b.nodes.x + b.dim * i;
                    if (part == 0) {
                        x[0] *= exp(rate);
                        for (int d = 1; d < b.dim; d++)
                            x[d] *= exp(-rate / (b.dim - 1));
                    } else
                        x[0] += 3.0 / steps * x[1];
                }
                remesh(&b);
                node_steps += b.nodes.count;
            }
            edges(&b, q);
            const double now = silt_mesh_volume(&b.mesh, b.nodes.x);
            print_message("%d-D, %s: %d nodes (%d at the start), %.4f edits per node and step, volume %+.2g %%, edges %.2f, %.2f, "
                          "%.2f, %.2f, %.2f h\n", b.dim, part ? "shear by 3" : "strain by 3", b.nodes.count, start,
                          (double)(b.added + b.removed) / node_steps, 100 * (now / volume - 1), q[0], q[1], q[2], q[3], q[4]);
            assert_true(fabs(now / volume - 1) < (k ? 0.02 : 0.01)); // the surface's own nodes; booked as debt
            assert_true(q[1] > 0.45 && q[3] < 1.9);
            // in space half of the nodes are surface, which is drawn out one way and pressed the other
            assert_true(abs(b.nodes.count - start) < (k ? 0.6 : 0.25) * start);
        }
        bench_close(&b);
    }
}

static void test_numbers_and_sides_do_not_matter(void **state) {
    (void)state;
    // the same cloud three times: as it is, with other numbers, mirrored; strained, so that nodes come and go
    static const char *const text[2] = {HEAD2 WATER "  jitter: 0.25\n  regions: [{box: [[0.1, 0], [0.9, 0.5]]}]\n",
                                        HEAD3 WATER "  jitter: 0.2\n  regions: [{sphere: [0.3, 0.3, 0.3], radius: 0.25}]\n"};
    for (int k = 0; k < 2; k++) {
        bench b[3];
        bench_open(&b[0], text[k]);
        const int n = b[0].nodes.count, dim = b[0].dim;
        // strained and a little noisy: nothing ties
        uint64_t random = 9;
        for (int i = 0; i < n; i++)
            for (int d = 0; d < dim; d++)
                b[0].nodes.x[dim * i + d] = (b[0].nodes.x[dim * i + d] + 1e-4 * silt_uniform(&random)) * (d == 0 ? 1.9 : d == 1 ? 0.5 : 1);
        for (int c = 1; c < 3; c++) {
            b[c] = (bench){.scene = scene_of(text[k]), .dim = dim};
            b[c].nodes.dim = dim;
            for (int m = 0; m < n; m++) {
                const int i = c == 1 ? (int)((long)m * 7919 % n) : m;
                double x[3] = {0};
                for (int d = 0; d < dim; d++)
                    x[d] = b[0].nodes.x[dim * i + d] * (c == 2 && d == 0 ? -1 : 1);
                silt_nodes_add(&b[c].nodes, NODE_FLUID, -1, x);
            }
            // the mesh in the same way
            SILT_RESERVE(b[c].mesh.cell, b[c].mesh.cell_capacity, b[0].mesh.n_cell);
            b[c].mesh.dim = dim;
            b[c].mesh.n_cell = b[0].mesh.n_cell;
            int *number = silt_alloc((size_t)n, sizeof *number);
            for (int m = 0; m < n; m++)
                number[c == 1 ? (int)((long)m * 7919 % n) : m] = m;
            for (int e = 0; e < b[0].mesh.n_cell; e++) {
                const int from = c == 1 ? b[0].mesh.n_cell - 1 - e : e;
                for (int a = 0; a < 4; a++)
                    b[c].mesh.cell[e][a] = a <= dim ? number[b[0].mesh.cell[from][a]] : -1;
                if (c == 2) {
                    const int swap = b[c].mesh.cell[e][0];
                    b[c].mesh.cell[e][0] = b[c].mesh.cell[e][1];
                    b[c].mesh.cell[e][1] = swap;
                }
            }
            free(number);
            silt_mesh_connect(&b[c].mesh, &b[c].nodes);
        }
        for (int c = 0; c < 3; c++) {
            silt_memory_take(&b[c].memory, &b[c].mesh, &b[c].nodes);
            silt_mesh_refine(&b[c].mesh, &b[c].nodes, &b[c].memory, 0.05);
        }
        int gone = 0, came = b[0].nodes.count - n;
        for (int i = 0; i < n; i++)
            gone += b[0].memory.dead[i] != 0;
        for (int c = 1; c < 3; c++) {
            assert_int_equal(b[c].nodes.count, b[0].nodes.count);
            for (int m = 0; m < b[c].nodes.count; m++) { // every node of the one is in the other, with the same fate
                int twin = -1;
                for (int i = 0; i < b[0].nodes.count && twin < 0; i++) {
                    double off = 0;
                    for (int d = 0; d < dim; d++)
                        off += fabs(b[0].nodes.x[dim * i + d] * (c == 2 && d == 0 ? -1 : 1) - b[c].nodes.x[dim * m + d]);
                    twin = off < 1e-12 ? i : -1;
                }
                assert_true(twin >= 0 && (b[0].memory.dead[twin] != 0) == (b[c].memory.dead[m] != 0));
            }
        }
        print_message("%d-D: %d nodes came, %d left, the same with other numbers and mirrored\n", dim, came, gone);
        assert_true(came > 5 && gone > 5);
        for (int c = 0; c < 3; c++)
            bench_close(&b[c]);
    }
}

static void test_nodes_on_walls(void **state) {
    (void)state;
    // a tank that is stretched: what comes on a wall is on it and knows it, in a crease both
    bench b;
    bench_open(&b, HEAD3 WATER "  regions: [{box: [[0, 0, 0], [0.3, 1, 0.3]]}]\n" TANK3);
    const int start = b.nodes.count;
    for (int step = 0; step < 30; step++) {
        for (int i = 0; i < b.nodes.count; i++) {
            b.nodes.x[3 * i] *= 1.03;
            b.nodes.x[3 * i + 2] /= 1.03;
        }
        remesh(&b);
    }
    int count[4] = {0}, fresh[4] = {0};
    for (int i = 0; i < b.nodes.count; i++) {
        const double *x = b.nodes.x + 3 * i;
        const int on = (x[0] == 0) + (x[1] == 0 || x[1] == 1) + (x[2] == 0);
        int n = 0;
        for (int s = 0; s < 3; s++)
            n += b.nodes.wall[i][s] >= 0;
        assert_int_equal(n, on);
        count[n]++;
        fresh[n] += b.nodes.id[i] >= start;
    }
    print_message("stretched tank: %d nodes on faces (%d new), %d in creases (%d new)\n", count[1], fresh[1], count[2], fresh[2]);
    assert_true(fresh[1] > 20 && fresh[2] > 5 && count[3] == 2);
    assert_true(fabs(silt_mesh_volume(&b.mesh, b.nodes.x) / 0.09 - 1) < 0.01);
    bench_close(&b);
}

static void test_momentum(void **state) {
    (void)state;
    // nodes come and go inside: with the rebuild's hand-over nothing is lost
    for (int dim = 2; dim <= 3; dim++) {
        bench b;
        bench_open(&b, dim == 2 ? HEAD2 WATER "  jitter: 0.2\n  regions: [{box: [[0, 0], [1, 0.5]]}]\n"
                                : HEAD3 WATER "  regions: [{box: [[0, 0, 0], [0.6, 0.5, 0.4]]}]\n");
        uint64_t random = 3;
        double worst = 0, plain = 0;
        for (int step = 0; step < 12; step++) {
            for (int i = 0; i < b.nodes.count; i++)
                for (int d = 0; d < dim; d++)
                    b.nodes.v[dim * i + d] = sin(9 * b.nodes.x[dim * i]) + silt_uniform(&random);
            spot(&b, 0.2 + 0.03 * step);
            silt_error err = {0};
            double before[3] = {0}, between[3] = {0}, after[3] = {0}, lost[3];
            b.memory.record = true;
            silt_memory_take(&b.memory, &b.mesh, &b.nodes);
            for (int e = 0; e < b.mesh.n_cell; e++)
                for (int a = 0; a <= dim; a++)
                    for (int d = 0; d < dim; d++)
                        before[d] += silt_cell_volume(&b.mesh, b.nodes.x, e) / (dim + 1) * b.nodes.v[dim * b.mesh.cell[e][a] + d];
            silt_mesh_refine(&b.mesh, &b.nodes, &b.memory, 0.05);
            const int n = b.nodes.count;
            double *v = silt_alloc((size_t)(dim * n), sizeof *v), *debt = silt_alloc((size_t)n, sizeof *debt);
            memcpy(v, b.nodes.v, (size_t)(dim * n) * sizeof *v);
            memcpy(debt, b.nodes.debt, (size_t)n * sizeof *debt);
            SILT_RESERVE(b.map, b.map_capacity, n + 1);
            assert_int_equal(silt_mesh_rebuild(&b.mesh, &b.nodes, b.scene, &b.barrier, &b.memory, b.map, &err), SILT_OK);
            for (int pass = 0; pass < 2; pass++) {
                double *sum = pass ? after : between;
                if (pass)
                    silt_momentum_hand_on(&b.memory, &b.mesh, &b.nodes, 1, NULL, debt, v, b.map, lost);
                for (int e = 0; e < b.mesh.n_cell; e++)
                    for (int a = 0; a <= dim; a++)
                        for (int d = 0; d < dim; d++)
                            sum[d] += silt_cell_volume(&b.mesh, b.nodes.x, e) / (dim + 1) * b.nodes.v[dim * b.mesh.cell[e][a] + d];
            }
            double debts = 0;
            for (int i = 0; i < b.nodes.count; i++)
                debts += fabs(b.nodes.debt[i]);
            if (debts > 1e-12)
                break; // the surface's shape changed: its water is owed and carries momentum of its own
            for (int d = 0; d < dim; d++) {
                worst = silt_max(worst, fabs(after[d] - before[d]));
                plain = silt_max(plain, fabs(between[d] - before[d]));
            }
            free(v);
            free(debt);
        }
        print_message("%d-D: momentum off by %.2g, without the hand-over by %.2g\n", dim, worst, plain);
        assert_true(worst < 1e-14 && plain > 1e-6);
        bench_close(&b);
    }
}

// ---- the shuffle

static void test_shuffle(void **state) {
    (void)state;
    static const char *const text[2] = {
        HEAD2 WATER "  shuffle: 0.1\n  regions: [{box: [[0, 0], [1, 0.5]]}]\n" TANK2,
        HEAD3 WATER "  shuffle: 0.1\n  regions: [{box: [[0, 0, 0], [0.6, 0.5, 0.4]]}]\n" TANK3};
    for (int k = 0; k < 2; k++) {
        bench b;
        bench_open(&b, text[k]);
        const int dim = b.dim, n = b.nodes.count;
        double *old = silt_alloc((size_t)(dim * n), sizeof *old), worst = 0, largest = 0;
        memcpy(old, b.nodes.x, (size_t)(dim * n) * sizeof *old);
#define FIELD(i, f) (1 + (f) + 2 * b.nodes.x[dim * (i)] - 3 * b.nodes.x[dim * (i) + 1] + (f) * b.nodes.x[dim * (i) + dim - 1])
        for (int i = 0; i < n; i++) {
            b.nodes.p[i] = FIELD(i, 4);
            for (int d = 0; d < dim; d++)
                b.nodes.v[dim * i + d] = FIELD(i, d);
        }
        silt_nodes_shuffle(&b.nodes, &b.mesh, b.scene, 17);
        int moved = 0;
        for (int i = 0; i < n; i++) {
            double way = 0;
            for (int d = 0; d < dim; d++) {
                way = silt_max(way, fabs(b.nodes.x[dim * i + d] - old[dim * i + d]));
                worst = silt_max(worst, fabs(b.nodes.v[dim * i + d] - FIELD(i, d)));
            }
            worst = silt_max(worst, fabs(b.nodes.p[i] - FIELD(i, 4)));
            largest = silt_max(largest, way);
            moved += way > 0;
            assert_int_equal(way > 0, !b.mesh.surface[i] && b.nodes.wall[i][0] < 0);
        }
        // linear fields are carried along exactly; another step, another shift; the same step, the same
        print_message("%d-D: %d of %d nodes shifted by up to %.3f h, linear fields off by %.2g\n", dim, moved, n, largest / 0.05, worst);
        assert_true(worst < 1e-13 && largest <= 0.1 * 0.05 && largest > 0.099 * 0.05);
        double *first = silt_alloc((size_t)(dim * n), sizeof *first);
        memcpy(first, b.nodes.x, (size_t)(dim * n) * sizeof *first);
        for (int64_t step = 17; step < 19; step++) {
            memcpy(b.nodes.x, old, (size_t)(dim * n) * sizeof *old);
            silt_nodes_shuffle(&b.nodes, &b.mesh, b.scene, step);
            int same = 0;
            for (int i = 0; i < n; i++)
                same += b.nodes.x[dim * i] == first[dim * i];
            assert_int_equal(same, step == 17 ? n : n - moved);
        }
        free(old);
        free(first);
        bench_close(&b);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_none),
        cmocka_unit_test(test_distance_of_regions),
        cmocka_unit_test(test_rules),
        cmocka_unit_test(test_follows_the_surface),
        cmocka_unit_test(test_follows_a_spot),
        cmocka_unit_test(test_strain),
        cmocka_unit_test(test_numbers_and_sides_do_not_matter),
        cmocka_unit_test(test_nodes_on_walls),
        cmocka_unit_test(test_momentum),
        cmocka_unit_test(test_shuffle),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
