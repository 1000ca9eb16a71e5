/** @file bed_bench.h
 * What the tests of the bed share: scenes made by hand, water on a lattice, and a check of all that always holds.
 */
#ifndef BED_BENCH_H
#define BED_BENCH_H

#include "bed_law.h"
#include "delaunay.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

#define NEAR(a, b, tolerance)                                                                                          \
    do {                                                                                                               \
        const double a_ = (a), b_ = (b), t_ = (tolerance);                                                             \
        if (!(fabs(a_ - b_) <= t_))                                                                                    \
            fail_msg("%s = %.17g, %s = %.17g, tolerance %g", #a, a_, #b, b_, t_);                                      \
    } while (0)

// ---------------------------------------------------------------- scenes by hand

typedef struct bench {
    silt_scene scene;
    silt_region region[4];
    double point[4][64];
    silt_wall wall[2];
    double wall_point[2][24];
    silt_bed bed;
    silt_nodes nodes;
    silt_mesh mesh;
    silt_locator locator;
} bench;

static inline void bench_open(bench *b, double size) {
    memset(b, 0, sizeof *b);
    b->scene.path = (char *)"bench";
    b->scene.dimension = 2;
    b->scene.fluid = (silt_fluid_def){.on = true, .density = 1000, .viscosity = 1e-3, .size = size};
    b->scene.bed = (silt_bed_def){.on = true,
                                  .law = BED_FRICTIONAL_WORK,
                                  .shear = SHEAR_PAPER,
                                  .density = 2650,
                                  .porosity = 0.4,
                                  .work = 100,
                                  .size = size,
                                  .distance = size,
                                  .saturation = 1,
                                  .region = b->region};
    b->scene.wall = b->wall;
}

static inline void bench_close(bench *b) {
    silt_bed_clear(&b->bed);
    silt_nodes_clear(&b->nodes);
    silt_mesh_clear(&b->mesh);
    silt_locator_clear(&b->locator);
}

static inline void bench_box(bench *b, double x0, double y0, double x1, double y1) {
    b->region[b->scene.bed.n_region++] = (silt_region){.kind = REGION_BOX, .lo = {x0, y0}, .hi = {x1, y1}};
}

static inline void bench_polygon(bench *b, int n, const double *xy) {
    const int r = b->scene.bed.n_region++;
    for (int k = 0; k < n; k++)
        for (int d = 0; d < 2; d++)
            b->point[r][3 * k + d] = xy[2 * k + d];
    b->region[r] = (silt_region){.kind = REGION_POLYGON, .n_point = n, .point = b->point[r]};
}

static inline void bench_wall(bench *b, int n, const double *xy) {
    const int w = b->scene.n_wall++;
    for (int k = 0; k < n; k++)
        for (int d = 0; d < 2; d++)
            b->wall_point[w][3 * k + d] = xy[2 * k + d];
    b->wall[w] = (silt_wall){.n_point = n, .point = b->wall_point[w]};
}

static inline void bench_create(bench *b) {
    silt_error err = {0};
    if (silt_bed_create(&b->bed, &b->scene, NULL, &err) != SILT_OK)
        fail_msg("%s", err.text);
}

// water on a staggered lattice over a box, all nodes with the same velocity; rows at y0, y0 + h, ...
static inline void bench_water(bench *b, double x0, double y0, double x1, double y1, double h, double vx, double vy) {
    const int columns = (int)lround((x1 - x0) / h), rows = (int)lround((y1 - y0) / h);
    for (int j = 0; j <= rows; j++)
        for (int i = 0; i <= columns + (j & 1); i++) {
            const double shift = j & 1 && i > 0 && i <= columns ? -0.5 : j & 1 && i > columns ? -1 : 0;
            const int k = silt_nodes_add(&b->nodes, NODE_FLUID, -1, (double[2]){x0 + (i + shift) * h, y0 + j * h});
            b->nodes.v[2 * k] = vx;
            b->nodes.v[2 * k + 1] = vy;
        }
    int *triangle = NULL, n = 0;
    assert_int_equal(silt_delaunay_2d(b->nodes.count, b->nodes.x, &triangle, &n), 0);
    for (int k = 0; k < n; k++) {
        SILT_RESERVE(b->mesh.cell, b->mesh.cell_capacity, b->mesh.n_cell + 1);
        const int cell[4] = {triangle[3 * k], triangle[3 * k + 1], triangle[3 * k + 2], -1};
        memcpy(b->mesh.cell[b->mesh.n_cell++], cell, sizeof cell);
    }
    free(triangle);
    silt_mesh_connect(&b->mesh, &b->nodes);
    silt_locator_build(&b->locator, &b->mesh, b->nodes.x, h);
}

static inline void bench_wear(bench *b, double dt) {
    silt_bed_wear(&b->bed, &b->scene, &b->nodes, &b->mesh, &b->locator, NULL, dt);
}

// ---------------------------------------------------------------- grains that lie on it

enum { HEAP = 400 };
typedef struct heap {
    silt_grain_state state;
    int64_t id[HEAP];
    double x[3 * HEAP], radius[HEAP], mass[HEAP];
    uint8_t at_rest[HEAP];
} heap;

static inline void heap_add(heap *h, const double *x, double r, double mass, bool at_rest) {
    const int k = h->state.count++;
    memcpy(h->x + 3 * k, x, 3 * sizeof *x);
    h->radius[k] = r;
    h->mass[k] = mass;
    h->at_rest[k] = at_rest;
    h->state.x = h->x;
    h->state.radius = h->radius;
    h->state.mass = h->mass;
}

// One grain after the other, all of which touch the bed or each other, becomes bed if it can: what the bed takes in it takes whole, and
// none that stays outside ever has its centre in it. count: that became cells, of them with others, that went into pores, that wait
static inline void heap_deposit(silt_bed *bed, const silt_scene *scene, heap *h, int count[4]) {
    silt_bed_others others = {0};
    bool gone[HEAP] = {0};
    silt_bed_others_take(&others, &h->state, h->at_rest);
    const double initial = bed->solid_mass;
    double taken = 0;
    for (int k = 0; k < h->state.count; k++) {
        if (gone[k] || !h->at_rest[k])
            continue;
        const double before = bed->pore_water, rest_before = bed->pore_rest;
        double sum = before, rest = rest_before;
        silt_deposit deposit;
        silt_bed_others_mark(&others, h->x + 3 * k, true);
        const silt_deposit_kind kind = silt_bed_deposit(bed, scene, h->x + 3 * k, h->radius[k], h->mass[k], &others, &deposit);
        count[kind == DEPOSIT_CELL ? 0 : kind == DEPOSIT_DENSER ? 2 : 3]++;
        count[1] += deposit.n_other > 0;
        gone[k] = kind != DEPOSIT_REFUSED;
        silt_bed_others_mark(&others, h->x + 3 * k, gone[k]);
        double whole = gone[k] ? h->mass[k] : 0;
        for (int m = 0; m < deposit.n_other; m++) {
            const int other = deposit.other[m];
            assert_true(kind == DEPOSIT_CELL && h->at_rest[other] && !gone[other]);
            whole += h->mass[other];
            gone[other] = true;
            silt_bed_others_mark(&others, h->x + 3 * other, true);
        }
        NEAR(deposit.mass, whole, 1e-14 * initial);
        taken += whole;
        NEAR(bed->solid_mass, initial + taken, 1e-12 * initial);
        const double pores = kind == DEPOSIT_CELL ? deposit.area - whole / scene->bed.density : -whole / scene->bed.density;
        silt_sum(&sum, &rest, -scene->bed.saturation * pores * scene->fluid.density);
        NEAR(bed->pore_water, sum, 1e-12 * scene->fluid.density);
        for (int m = 0; m < h->state.count; m++)
            if (!gone[m] && silt_bed_contains(bed, h->x + 3 * m))
                fail_msg("grain %d lies in the bed after that of grain %d", m, k);
    }
    silt_bed_others_clear(&others);
}

// ---------------------------------------------------------------- what always holds

static inline double cross(const double *p, const double *q, const double *r) {
    return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
}

// two triangles have no common interior when a side of one of them separates them
static inline bool cells_overlap(const silt_bed *bed, int c, int e, double slack) {
    for (int swap = 0; swap < 2; swap++) {
        const int *p = bed->cell[swap ? e : c], *q = bed->cell[swap ? c : e];
        for (int a = 0; a < 3; a++) {
            bool apart = true;
            for (int k = 0; k < 3; k++)
                apart &= cross(bed->x[p[a]], bed->x[p[(a + 1) % 3]], bed->x[q[k]]) <= slack;
            if (apart)
                return false;
        }
    }
    return true;
}

static inline bool edge_listed(const silt_bed *bed, int a, int b) {
    int n = 0;
    for (int e = 0; e < bed->n_edge; e++)
        n += bed->edge[e][0] == a && bed->edge[e][1] == b;
    assert_true(n <= 1);
    return n == 1;
}

// does a piece of wall hold both points? written a second time
static inline bool on_wall(const bench *b, const double *p, const double *q) {
    for (int w = 0; w < b->scene.n_wall; w++)
        for (int k = 0; k + 1 < b->wall[w].n_point; k++) {
            const double *s = b->wall[w].point + 3 * k, *t = s + 3;
            const double length = hypot(t[0] - s[0], t[1] - s[1]), close = 1e-6 * b->scene.bed.size;
            bool on = true;
            for (int end = 0; end < 2; end++) {
                const double *x = end ? q : p;
                const double along = ((x[0] - s[0]) * (t[0] - s[0]) + (x[1] - s[1]) * (t[1] - s[1])) / length;
                on &= fabs(cross(s, t, x)) / length <= close && along >= -close && along <= length + close;
            }
            if (on)
                return true;
        }
    return false;
}

static inline void check_bed(const bench *b) {
    const silt_bed *bed = &b->bed;
    const double slack = 1e-12 * silt_square(b->scene.bed.size);
    int surface = 0;
    for (int c = 0; c < bed->n_cell; c++) {
        const int *p = bed->cell[c];
        assert_true(cross(bed->x[p[0]], bed->x[p[1]], bed->x[p[2]]) > 0);
        NEAR(bed->area[c], 0.5 * cross(bed->x[p[0]], bed->x[p[1]], bed->x[p[2]]), 0);
        // neighbours by brute force: an edge has one cell on its other side, or lies on the surface or a wall
        for (int a = 0; a < 3; a++) {
            int across = 0;
            for (int e = 0; e < bed->n_cell; e++)
                for (int k = 0; k < 3; k++)
                    across += bed->cell[e][k] == p[(a + 1) % 3] && bed->cell[e][(k + 1) % 3] == p[a];
            assert_true(across <= 1);
            const bool open = across == 0 && !on_wall(b, bed->x[p[a]], bed->x[p[(a + 1) % 3]]);
            assert_int_equal(edge_listed(bed, p[(a + 1) % 3], p[a]), open);
            surface += open;
        }
        for (int e = 0; e < c; e++)
            if (cells_overlap(bed, c, e, slack))
                fail_msg("cells %d and %d overlap", c, e);
    }
    assert_int_equal(surface, bed->n_edge);
    for (int i = 0; i < bed->n_node; i++) {
        bool alive = false, exposed = false;
        int balance = 0;
        for (int c = 0; c < bed->n_cell; c++)
            alive |= bed->cell[c][0] == i || bed->cell[c][1] == i || bed->cell[c][2] == i;
        for (int e = 0; e < bed->n_edge; e++) {
            exposed |= bed->edge[e][0] == i || bed->edge[e][1] == i;
            balance += (bed->edge[e][0] == i) - (bed->edge[e][1] == i);
        }
        assert_int_equal(alive, bed->alive[i]);
        assert_int_equal(exposed, bed->exposed[i]);
        // chains are closed, or end at a wall
        if (balance != 0)
            assert_true(on_wall(b, bed->x[i], bed->x[i]));
    }
    // no two pieces of the surface cross
    for (int e = 0; e < bed->n_edge; e++)
        for (int f = 0; f < e; f++) {
            const double *p = bed->x[bed->edge[e][0]], *q = bed->x[bed->edge[e][1]];
            const double *r = bed->x[bed->edge[f][0]], *s = bed->x[bed->edge[f][1]];
            assert_false(cross(p, q, r) * cross(p, q, s) < -slack * slack &&
                         cross(r, s, p) * cross(r, s, q) < -slack * slack);
        }
}

static inline double pore_water(const bench *b) {
    double volume = 0;
    for (int c = 0; c < b->bed.n_cell; c++)
        volume += b->bed.area[c] - b->bed.mass[c] / b->scene.bed.density;
    return b->scene.bed.saturation * b->scene.fluid.density * volume;
}

static inline double bed_area(const silt_bed *bed) {
    double area = 0;
    for (int c = 0; c < bed->n_cell; c++)
        area += bed->area[c];
    return area;
}

#endif
