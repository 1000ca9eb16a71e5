// grains in water in space: the kernel against its polynomial by roots, what is spread is conserved, still water lifts, what grains
// gain the water loses in a step of its own, a crowd leaves the water its mass
#include "../dem-coupling/exchange.h"
#include "fluid.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

#include "check.h"

// ---------------------------------------------------------------- a tank of water, jittered

typedef struct tank {
    silt_nodes nodes;
    silt_mesh mesh;
    silt_locator locator;
    silt_exchange exchange;
    uint64_t random;
} tank;

// n[0] x n[1] x n[2] cubes of size h, six tetrahedra each; periodic in x with as many nodes as cubes there; one more node outside
static void tank_open(tank *t, const int n[3], double h, bool periodic) {
    memset(t, 0, sizeof *t);
    t->random = 11;
    t->nodes.dim = t->mesh.dim = 3;
    const int wide = periodic ? n[0] : n[0] + 1;
    for (int k = 0; k <= n[2]; k++)
        for (int j = 0; j <= n[1]; j++)
            for (int i = 0; i < wide; i++) {
                const bool inside = (periodic || (i > 0 && i < n[0])) && j > 0 && k > 0 && j < n[1] && k < n[2];
                double x[3] = {i * h, j * h, k * h};
                for (int d = 0; d < 3 && inside; d++)
                    x[d] += 0.25 * h * (silt_uniform(&t->random) - 0.5);
                silt_nodes_add(&t->nodes, NODE_FLUID, -1, x);
            }
    silt_nodes_add(&t->nodes, NODE_FLUID, -1, (double[3]){-5 * h, -5 * h, 0});
    t->mesh.period[0] = periodic ? n[0] * h : 0;
    SILT_RESERVE(t->mesh.cell, t->mesh.cell_capacity, 6 * n[0] * n[1] * n[2]);
    static const int way[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    for (int k = 0; k < n[2]; k++)
        for (int j = 0; j < n[1]; j++)
            for (int i = 0; i < n[0]; i++)
                for (int w = 0; w < 6; w++) {
                    // from corner to corner along the axes in this order; odd orders are turned round
                    int at[3] = {i, j, k}, *cell = t->mesh.cell[t->mesh.n_cell++];
                    for (int c = 0; c < 4; c++) {
                        cell[c] = (at[2] * (n[1] + 1) + at[1]) * wide + at[0] % wide;
                        if (c < 3)
                            at[way[w][c]]++;
                    }
                    if (w >= 3) {
                        const int last = cell[3];
                        cell[3] = cell[2];
                        cell[2] = last;
                    }
                }
    silt_mesh_connect(&t->mesh, &t->nodes);
    for (int e = 0; e < t->mesh.n_cell; e++)
        assert_true(silt_cell_volume(&t->mesh, t->nodes.x, e) > 0);
    silt_locator_build(&t->locator, &t->mesh, t->nodes.x, h);
    t->exchange.density = 1000;
    t->exchange.viscosity = 1e-3;
    t->exchange.gravity[2] = -9.81;
    t->exchange.width = 2.5 * h;
    t->exchange.law = DRAG_DI_FELICE;
    t->exchange.refresh = true;
}

static void tank_close(tank *t) {
    silt_nodes_clear(&t->nodes);
    silt_mesh_clear(&t->mesh);
    silt_locator_clear(&t->locator);
    silt_exchange_clear(&t->exchange);
}

static silt_exchange_grain *tank_grain(tank *t, const double x[3], double d) {
    silt_exchange *e = &t->exchange;
    SILT_RESERVE(e->grain, e->grain_capacity, e->n_grain + 1);
    silt_exchange_grain *g = &e->grain[e->n_grain++];
    *g = (silt_exchange_grain){.x = {x[0], x[1], x[2]}, .diameter = d, .number = 1, .solid = M_PI / 6 * d * d * d};
    g->mass = 2650 * g->solid;
    g->cell = silt_locate(&t->locator, &t->mesh, t->nodes.x, g->x, g->weight);
    return g;
}

// n grains of different size anywhere in the tank, moving, one of them in the air
static void tank_fill(tank *t, int n, double lx, double ly, double lz) {
    for (int k = 0; k < n; k++) {
        const double x[3] = {lx * silt_uniform(&t->random), ly * silt_uniform(&t->random), lz * silt_uniform(&t->random)};
        silt_exchange_grain *g = tank_grain(t, x, 2e-3 * (1 + silt_uniform(&t->random)));
        assert_true(g->cell >= 0);
        for (int d = 0; d < 3; d++) {
            g->v[d] = silt_uniform(&t->random) - 0.5;
            g->contact[d] = g->mass * 20 * (silt_uniform(&t->random) - 0.5);
        }
    }
    assert_int_equal(tank_grain(t, (double[3]){lx / 2, ly / 2, 2 * lz}, 1e-3)->cell, -1);
}

// solid in the water over that of the grains in it
static double tank_held(const tank *t) {
    const silt_exchange *e = &t->exchange;
    double spread = 0, held = 0;
    for (int p = 0; p < e->n_grain; p++)
        spread += e->grain[p].cell >= 0 ? e->grain[p].solid : 0;
    for (int i = 0; i < t->mesh.n_node; i++)
        held += e->kernel.volume[i] * e->solid[i];
    return held / spread;
}

// ---------------------------------------------------------------- kernel

// M^-1 t K of wet nodes from its definition, row-major n x n; gradients by Cramer's rule
static double *tank_diffusion(const tank *t) {
    const int n = t->mesh.n_node;
    double *a = silt_alloc((size_t)n * (size_t)n, sizeof *a);
    for (int e = 0; e < t->mesh.n_cell; e++) {
        const int *cell = t->mesh.cell[e];
        double c[12], g[4][3] = {{0}};
        silt_cell_corners(&t->mesh, t->nodes.x, cell, c);
        const double volume = silt_simplex_volume(3, c);
        for (int b = 0; b < 4; b++)
            for (int d = 0; d < 3; d++) {
                // how the volume changes with corner b is its gradient times the volume
                double moved[12];
                memcpy(moved, c, sizeof moved);
                moved[3 * b + d] += 0.01;
                g[b][d] = (silt_simplex_volume(3, moved) - volume) / 0.01 / volume;
            }
        for (int b = 0; b < 4; b++)
            for (int k = 0; k < 4; k++)
                a[cell[b] * n + cell[k]] += silt_square(t->exchange.width) / 4 * volume * silt_dot(3, g[b], g[k]) / t->exchange.kernel.volume[cell[b]];
    }
    return a;
}

static void test_kernel_is_its_polynomial(void **unused) {
    (void)unused;
    tank t;
    tank_open(&t, (const int[3]){6, 5, 6}, 0.01, false);
    tank_fill(&t, 9, 0.06, 0.05, 0.06);
    OK(silt_exchange_place(&t.exchange, &t.nodes, &t.mesh, &error));
    const silt_kernel *kernel = &t.exchange.kernel;
    const silt_sweep *w = &kernel->sweep;
    const int n = t.mesh.n_node;
    assert_int_equal(kernel->n_node, n - 1); // all that is wet
    // P(z) = prod (1 - z/z_k) with the roots z_k of T_s(w0 - w1 z); P'(0) = -1 is the width
    double width = 0, root[SWEEP_MOST];
    for (int k = 0; k < w->degree; k++) {
        root[k] = (w->shift - cos((2 * k + 1) * M_PI / (2 * w->degree))) / w->pace;
        width += 1 / root[k];
    }
    print_message("%d sweeps\n", w->degree);
    assert_in_range(w->degree, 5, 12);
    near(width, 1, 1e-12, "-P'(0)");
    double *a = tank_diffusion(&t), *field = silt_alloc(4 * (size_t)n + 4, sizeof *field), *x = silt_alloc((size_t)n, sizeof *x), *y = silt_alloc((size_t)n, sizeof *y);
    for (int k = 0; k < kernel->n_node; k++)
        field[4 * k] = 1e-6 * (silt_uniform(&t.random) - 0.5);
    for (int k = 0; k < kernel->n_node; k++)
        x[kernel->node[k]] = field[4 * k] / kernel->volume[kernel->node[k]];
    for (int r = 0; r < w->degree; r++) {
        for (int i = 0; i < n; i++) {
            y[i] = x[i];
            for (int j = 0; j < n; j++)
                y[i] -= a[i * n + j] * x[j] / root[r];
        }
        memcpy(x, y, (size_t)n * sizeof *x);
    }
    silt_kernel_solve(kernel, 4, field);
    for (int k = 0; k < kernel->n_node; k++)
        near(field[4 * k], x[kernel->node[k]], 1e-11, "a field through the kernel");
    free(a);
    free(field);
    free(x);
    free(y);
    tank_close(&t);
}

// where one grain goes: all of it, about its place, as wide as b^2/2 along each axis, nowhere below nought by more than a hair
static void test_kernel_width(void **unused) {
    (void)unused;
    for (int periodic = 0; periodic < 2; periodic++) {
        tank t;
        const double h = 0.01, middle[3] = {periodic ? 0.001 : 0.0804, 0.0783, 0.0818};
        tank_open(&t, (const int[3]){16, 16, 16}, h, periodic);
        silt_exchange_grain *g = tank_grain(&t, middle, 2e-3);
        assert_true(g->cell >= 0);
        silt_exchange *e = &t.exchange;
        OK(silt_exchange_place(e, &t.nodes, &t.mesh, &error));
        near(tank_held(&t), 1, 1e-12, "solid volume");
        double centre[3] = {0}, square[3] = {0}, least = 0, most = 0;
        for (int i = 0; i < t.mesh.n_node; i++)
            for (int d = 0; d < 3; d++) {
                double way = t.nodes.x[3 * i + d] - middle[d];
                if (d == 0 && periodic)
                    way -= 16 * h * floor(way / (16 * h) + 0.5);
                const double share = e->kernel.volume[i] * e->solid[i] / g->solid;
                centre[d] += share * way;
                square[d] += share * way * way;
                least = silt_min(least, e->solid[i]);
                most = silt_max(most, e->solid[i]);
            }
        for (int d = 0; d < 3; d++) {
            near(centre[d] / e->width, 0, 0.01, "centre of what one grain spreads");
            // and what it is when it is spread over its cell
            near(square[d] / (e->width * e->width / 2), 1, 0.06, "width of what one grain spreads");
        }
        print_message("%d sweeps, %d nodes, widths %.4f %.4f %.4f of b^2/2, from %.1e to 1\n", e->kernel.sweep.degree, e->kernel.n_node,
                      square[0] / (e->width * e->width / 2), square[1] / (e->width * e->width / 2),
                      square[2] / (e->width * e->width / 2), least / most);
        assert_true(least > -0.01 * most);
        tank_close(&t);
    }
}

// sampling is the transpose of spreading, and a constant stays
static void test_kernel_is_symmetric(void **unused) {
    (void)unused;
    tank t;
    tank_open(&t, (const int[3]){8, 8, 8}, 0.01, true);
    tank_fill(&t, 60, 0.08, 0.08, 0.08);
    OK(silt_exchange_place(&t.exchange, &t.nodes, &t.mesh, &error));
    near(tank_held(&t), 1, 1e-12, "solid volume");
    const silt_kernel *kernel = &t.exchange.kernel;
    const int n = kernel->n_node;
    double *field = silt_alloc(8 * (size_t)n + 8, sizeof *field), *keep = silt_alloc(8 * (size_t)n + 8, sizeof *keep);
    double forth = 0, back = 0, size = 0;
    for (int k = 0; k < n; k++) {
        field[8 * k] = silt_uniform(&t.random) - 0.5;
        field[8 * k + 1] = silt_uniform(&t.random) - 0.5;
        field[8 * k + 2] = kernel->volume[kernel->node[k]];
    }
    memcpy(keep, field, 8 * (size_t)n * sizeof *field);
    silt_kernel_solve(kernel, 8, field);
    for (int k = 0; k < n; k++) {
        forth += field[8 * k] * keep[8 * k + 1];
        back += keep[8 * k] * field[8 * k + 1];
        size += fabs(keep[8 * k] * field[8 * k + 1]);
        near(field[8 * k + 2], 1, 1e-12, "sum of a grain's weights");
    }
    near((forth - back) / size, 0, 1e-13, "spreading against sampling");
    free(field);
    free(keep);
    tank_close(&t);
}

// Slivers, and a kernel that holds a part of the mesh: M^-1 K has no negative eigenvalues, on which the polynomial grows without bound:
// no field gets larger, solid is never far below nought
static void test_kernel_with_slivers(void **unused) {
    (void)unused;
    tank t;
    const int n[3] = {12, 12, 12};
    tank_open(&t, n, 0.01, false);
    for (int i = 0; i < t.mesh.n_node - 1; i++) {
        // every fifth inner node nearly onto the plane of three others
        const int at[3] = {i % 13, i / 13 % 13, i / 169};
        if (i % 5 == 0 && at[0] > 0 && at[1] > 0 && at[2] > 0 && at[0] < 12 && at[1] < 12 && at[2] < 12)
            for (int share = 0; share < 60; share++) {
                t.nodes.x[3 * i] += 0.0002;
                for (int k = t.mesh.node_cell_start[i]; k < t.mesh.node_cell_start[i + 1]; k++)
                    if (silt_cell_volume(&t.mesh, t.nodes.x, t.mesh.node_cell[k]) < 2e-10) {
                        t.nodes.x[3 * i] -= 0.0002;
                        break;
                    }
            }
    }
    t.exchange.width = 0.015;
    silt_exchange_grain *g = tank_grain(&t, (double[3]){0.0601, 0.0613, 0.0592}, 3e-3);
    silt_locator_build(&t.locator, &t.mesh, t.nodes.x, 0.01);
    g->cell = silt_locate(&t.locator, &t.mesh, t.nodes.x, g->x, g->weight);
    OK(silt_exchange_place(&t.exchange, &t.nodes, &t.mesh, &error));
    near(tank_held(&t), 1, 1e-12, "solid volume");
    const silt_kernel *kernel = &t.exchange.kernel;
    const int count = kernel->n_node;
    assert_in_range(count, 100, t.mesh.n_node - 500); // a part of it
    double *field = silt_alloc(4 * (size_t)count + 4, sizeof *field), most = 0, least = 0, grown = 0;
    for (int round = 0; round < 20; round++) {
        double before = 0, after = 0;
        for (int k = 0; k < count; k++) {
            const double volume = kernel->volume[kernel->node[k]], x = silt_uniform(&t.random) - 0.5;
            field[4 * k] = volume * x;
            before += volume * x * x;
        }
        for (int pass = 0; pass < 6; pass++) {
            silt_kernel_solve(kernel, 4, field);
            after = 0;
            for (int k = 0; k < count; k++) {
                const double volume = kernel->volume[kernel->node[k]];
                after += volume * silt_square(field[4 * k]);
                field[4 * k] *= volume;
            }
        }
        grown = silt_max(grown, after / before);
    }
    for (int i = 0; i < t.mesh.n_node; i++) {
        most = silt_max(most, t.exchange.solid[i]);
        least = silt_min(least, t.exchange.solid[i]);
    }
    print_message("%d of %d nodes, %d sweeps, a field shrinks to %.2f, solid from %.1e to 1\n", count, t.mesh.n_node, kernel->sweep.degree, sqrt(grown), least / most);
    assert_true(grown <= 1);
    assert_true(least > -0.04 * most); // a fifth of all nodes lies in slivers here
    free(field);
    tank_close(&t);
}

// share of a sphere of radius r at height z that a hat holds with its top at t and the width b: area of the slices, by many of them
static double sphere_in_hat(double r, double z, double t, double b) {
    enum { PARTS = 20000 };
    double sum = 0;
    for (int i = 0; i < PARTS; i++) {
        const double off = r * ((i + 0.5) * 2 / PARTS - 1);
        sum += silt_max(0, 1 - fabs(z + off - t) / b) * 0.75 * (1 - silt_square(off / r)) * 2 / PARTS;
    }
    return sum;
}

// Layers: a grain's solid lies at the heights where its sphere is, over the water there, and it reads the water's mean over these. The sphere's
// centre counts to the hats around it; here it stands on the top of one.
static void test_kernel_in_layers(void **unused) {
    (void)unused;
    enum { HATS = 40 };
    const double b = 1.3e-3, d = 6e-3; // neither a multiple of the cells nor of each other
    tank t;
    tank_open(&t, (const int[3]){6, 5, 4}, 0.01, true);
    silt_exchange *e = &t.exchange;
    e->layer_grain = d;
    e->width = b;
    silt_exchange_grain *g = tank_grain(&t, (double[3]){0.031, 0.024, 15 * b}, d);
    double room[HATS] = {0}, share[HATS], below = 0, speed = 0;
    for (int i = 0; i < t.mesh.n_node; i++) {
        const double z = t.nodes.x[3 * i + 2];
        t.nodes.v[3 * i] = z + 100 * z * z;
    }
    OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, 1e-3, &error));
    near(tank_held(&t), 1, 1e-12, "solid volume");
    for (int k = 0; k < HATS; k++) {
        share[k] = sphere_in_hat(d / 2, 15 * b, k * b, b);
        double run = 0;
        for (int i = 0; i < t.mesh.n_node; i++) {
            const double weight = e->kernel.volume[i] * silt_max(0, 1 - fabs(t.nodes.x[3 * i + 2] / b - k));
            room[k] += weight;
            run += weight * t.nodes.v[3 * i];
        }
        below += share[k] * room[k];
        speed += share[k] * run;
    }
    for (int i = 0; i < t.mesh.n_node; i++) {
        double expected = 0;
        for (int k = 0; k < HATS && t.mesh.wet[i]; k++)
            expected += silt_max(0, 1 - fabs(t.nodes.x[3 * i + 2] / b - k)) * share[k] * g->solid / below;
        near(e->solid[i] / (g->solid / below), expected / (g->solid / below), 2e-4, "solid fraction"); // slices: 64 a hat
    }
    silt_exchange_load(e, t.nodes.v, t.nodes.p, 1e-3, NULL);
    near(e->grain[0].water[0] / (speed / below), 1, 2e-4, "the water's velocity at the grain");
    // grains anywhere: conserved, even along x and y, as much lost as gained
    tank_fill(&t, 30, 0.06, 0.05, 0.04);
    OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, 1e-3, &error));
    near(tank_held(&t), 1, 1e-12, "solid volume");
    for (int i = 0; i < 6 * 6; i++)
        near(e->solid[i], e->solid[0], 1e-15, "solid along the floor");
    assert_true(e->solid[0] > 0);
    silt_exchange_load(e, t.nodes.v, t.nodes.p, 1e-3, NULL);
    for (int k = 0; k < 3; k++)
        near((e->totals.water[k] + e->totals.drag[k]) / e->totals.size, 0, 1e-13, "drag on water and grains");
    // a flat cell that turned over is as good as any: nothing is looked at but heights and volumes
    t.nodes.x[3 * (t.mesh.n_node - 2) + 2] -= 0.02;
    OK(silt_exchange_place(e, &t.nodes, &t.mesh, &error));
    near(tank_held(&t), 1, 1e-12, "solid volume with a cell turned over");
    tank_close(&t);
}

// ---------------------------------------------------------------- forces

// a gust c at a grain that is held in a stream u: Cd pi d^2/8 rho |u + c| (u + c), with added mass too, and the water has lost it
static void test_gust(void **unused) {
    (void)unused;
    for (int added = 0; added < 2; added++) {
        tank t;
        tank_open(&t, (const int[3]){8, 7, 6}, 0.01, false);
        silt_exchange *e = &t.exchange;
        const double dt = 1e-3, flow[3] = {0.3, -0.2, 0.1}, gust[3] = {0.25, 0.1, -0.3}, d = 3e-3;
        e->law = DRAG_SCHILLER_NAUMANN;
        e->gusts = true;
        e->force.def = (silt_force_def){.added_mass = added ? 0.5 : 0, .theta = 0.7};
        silt_exchange_grain *g = tank_grain(&t, (double[3]){0.041, 0.036, 0.033}, d);
        g->held = true;
        memset(g->v, 0, sizeof g->v);
        memcpy(g->gust, gust, sizeof gust);
        for (int i = 0; i < t.mesh.n_node; i++)
            memcpy(t.nodes.v + 3 * i, flow, sizeof flow);
        OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
        silt_exchange_load(e, t.nodes.v, t.nodes.p, dt, NULL);
        double w[3];
        for (int k = 0; k < 3; k++)
            w[k] = flow[k] + gust[k];
        const double speed = silt_length(3, w), reynolds = 1000 * speed * d / 1e-3;
        const double drag = (reynolds < 1000 ? 24 / reynolds * (1 + 0.15 * pow(reynolds, 0.687)) : 0.44) * M_PI * d * d / 8 * 1000 * speed;
        for (int k = 0; k < 3; k++) {
            near(e->grain[0].force[k] / (drag * w[k]), 1, 1e-12, "force over the law's");
            near((e->totals.water[k] + e->totals.drag[k]) / (drag * speed), 0, 1e-12, "drag on water and grain");
        }
        tank_close(&t);
    }
}

// grains held by contact in water that moves as one, under the pressure of rest: exactly the weight of the water that they displace
static void test_still_water_lifts(void **unused) {
    (void)unused;
    tank t;
    tank_open(&t, (const int[3]){8, 7, 6}, 0.01, false);
    tank_fill(&t, 50, 0.08, 0.07, 0.06);
    silt_exchange *e = &t.exchange;
    const double dt = 1e-3, flow[3] = {0.3, -0.2, 0.1};
    for (int i = 0; i < t.mesh.n_node; i++) {
        t.nodes.p[i] = 1000 * 9.81 * (0.06 - t.nodes.x[3 * i + 2]);
        memcpy(t.nodes.v + 3 * i, flow, sizeof flow);
    }
    for (int p = 0; p < e->n_grain; p++)
        for (int d = 0; d < 3; d++) {
            e->grain[p].v[d] = flow[d];
            e->grain[p].contact[d] = d == 2 ? (e->grain[p].mass - 1000 * e->grain[p].solid) * 9.81 : 0;
        }
    OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
    silt_exchange_load(e, t.nodes.v, t.nodes.p, dt, NULL);
    for (int p = 0; p < e->n_grain; p++) {
        const silt_exchange_grain *g = &e->grain[p];
        const double weight = 1000 * 9.81 * g->solid;
        for (int d = 0; d < 3; d++)
            near(g->force[d] / weight, g->cell >= 0 && d == 2 ? 1 : 0, 1e-11, "force over the weight of the water");
    }
    // grains that move as one: source_j = sum over cells of volume grad N_j . c (mean of solid)
    double scale = 0, worst = 0, *source = silt_alloc((size_t)t.mesh.n_node, sizeof *source);
    for (int c = 0; c < t.mesh.n_cell; c++) {
        const int *cell = t.mesh.cell[c];
        double x[12], solid = 0;
        silt_cell_corners(&t.mesh, t.nodes.x, cell, x);
        for (int a = 0; a < 4; a++)
            solid += e->solid[cell[a]] / 4;
        for (int a = 0; a < 4; a++)
            for (int d = 0; d < 3; d++) {
                double moved[12];
                memcpy(moved, x, sizeof moved);
                moved[3 * a + d] += 0.01;
                source[cell[a]] += solid * flow[d] * (silt_simplex_volume(3, moved) - silt_simplex_volume(3, x)) / 0.01;
            }
    }
    for (int i = 0; i < t.mesh.n_node; i++) {
        scale = silt_max(scale, fabs(source[i]));
        worst = silt_max(worst, fabs(source[i] - e->source[i]));
    }
    near(worst / scale, 0, 1e-11, "source of grains that move as one");
    free(source);
    tank_close(&t);
}

// a block of water with grains falls and is sheared: what the water's own ledger says it got from the grains
static void test_a_step_of_the_water_closes(void **unused) {
    (void)unused;
    for (int periodic = 0; periodic < 2; periodic++) {
        tank t;
        tank_open(&t, (const int[3]){8, 7, 6}, 0.01, periodic);
        tank_fill(&t, 80, 0.08, 0.07, 0.06);
        silt_exchange *e = &t.exchange;
        silt_scene scene = {.dimension = 3, .gravity = {0, 0, -9.81}, .period = {0, periodic ? 0.08 : 0}};
        scene.fluid = (silt_fluid_def){.on = true, .density = 1000, .viscosity = 1e-3, .size = 0.01, .tolerance = 1e-9,
                                       .iterations = 40, .volume_steps = 15};
        silt_walls walls = {.dim = 3};
        silt_fluid fluid = {0};
        const double dt = 1e-3;
        for (int half = 0; half < 2; half++) {
            scene.fluid.theta = half ? 0.5 : 1;
            for (int i = 0; i < t.nodes.count; i++) {
                t.nodes.v[3 * i] = 3 * t.nodes.x[3 * i + 2];
                t.nodes.v[3 * i + 1] = -0.5 * sin(20 * t.nodes.x[3 * i + 2]);
                t.nodes.v[3 * i + 2] = 0.5 * cos(30 * t.nodes.x[3 * i + 1]);
                t.nodes.p[i] = 0;
            }
            OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
            const silt_step step = {.scene = &scene, .walls = &walls, .mesh = &t.mesh, .drag = &e->drag, .nodes = &t.nodes, .dt = dt};
            OK(silt_fluid_step(&fluid, &step, &error));
            silt_exchange_load(e, fluid.w, t.nodes.p, dt, fluid.x_mid);
            double scale = 0, gained[3] = {0};
            for (int p = 0; p < e->n_grain; p++)
                for (int d = 0; d < 3; d++) {
                    gained[d] += e->grain[p].force[d];
                    scale += fabs(e->grain[p].force[d]);
                }
            assert_true(scale > 1e-3);
            for (int d = 0; d < 3; d++) {
                near((fluid.from_grains[d] + gained[d]) / scale, 0, 1e-12, "force on water and grains");
                near((e->totals.water[d] + e->totals.drag[d]) / scale, 0, 1e-12, "drag on water and grains");
            }
        }
        silt_fluid_clear(&fluid);
        tank_close(&t);
    }
}

// more solid than there is room: no more than that displaces water; its masses stay above nought, the step is taken and closes
static void test_a_crowd_leaves_the_water_its_mass(void **unused) {
    (void)unused;
    tank t;
    tank_open(&t, (const int[3]){8, 8, 8}, 0.01, false);
    silt_exchange *e = &t.exchange;
    for (int k = 0; k < 40; k++) {
        silt_exchange_grain *g = tank_grain(&t, (const double[3]){0.04 + 1e-5 * k, 0.04, 0.04}, 0.02);
        g->solid *= 10;
        g->mass *= 10;
        g->number *= 10;
    }
    silt_scene scene = {.dimension = 3, .gravity = {0, 0, -9.81}};
    scene.fluid = (silt_fluid_def){.on = true, .density = 1000, .viscosity = 1e-3, .size = 0.01, .tolerance = 1e-9, .iterations = 60,
                                   .volume_steps = 15, .theta = 0.55};
    silt_walls walls = {.dim = 3};
    silt_fluid fluid = {0};
    const double dt = 1e-3;
    OK(silt_exchange_prepare(e, &t.nodes, &t.mesh, dt, &error));
    double most = 0, scale = 0, gained[3] = {0};
    for (int i = 0; i < t.mesh.n_node; i++)
        most = silt_max(most, e->solid[i]);
    // what displaces water is what is spread, and what its pressure acts on
    double immersed = 0;
    for (int p = 0; p < e->n_grain; p++)
        immersed += e->grain[p].immersed;
    near(tank_held(&t) * 40 * e->grain[0].solid / immersed, 1, 1e-12, "volume displaced");
    assert_true(immersed < 0.6 * 40 * e->grain[0].solid);
    assert_in_range(1000 * most, 800, 1000);
    const silt_step step = {.scene = &scene, .walls = &walls, .mesh = &t.mesh, .drag = &e->drag, .nodes = &t.nodes, .dt = dt};
    OK(silt_fluid_step(&fluid, &step, &error));
    silt_exchange_load(e, fluid.w, t.nodes.p, dt, fluid.x_mid);
    for (int i = 0; i < t.mesh.n_node - 1; i++) {
        assert_true(fluid.mass[i] >= 0.0499 * 1000 * fluid.volume[i]);
        assert_true(silt_length(3, t.nodes.v + 3 * i) < 0.1);
    }
    for (int p = 0; p < e->n_grain; p++)
        for (int d = 0; d < 3; d++) {
            gained[d] += e->grain[p].force[d];
            scale += fabs(e->grain[p].force[d]);
        }
    for (int d = 0; d < 3; d++)
        near((fluid.from_grains[d] + gained[d]) / scale, 0, 1e-12, "force on water and grains");
    silt_fluid_clear(&fluid);
    tank_close(&t);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kernel_is_its_polynomial),
        cmocka_unit_test(test_kernel_width),
        cmocka_unit_test(test_kernel_is_symmetric),
        cmocka_unit_test(test_kernel_with_slivers),
        cmocka_unit_test(test_kernel_in_layers),
        cmocka_unit_test(test_gust),
        cmocka_unit_test(test_still_water_lifts),
        cmocka_unit_test(test_a_step_of_the_water_closes),
        cmocka_unit_test(test_a_crowd_leaves_the_water_its_mass),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
