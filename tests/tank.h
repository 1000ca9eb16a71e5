/** @file tank.h
 * A tank of water with jittered cells and grains in it, for tests of what they exchange; after cmocka.h.
 */
#ifndef SILT_TANK_H
#define SILT_TANK_H

#include "../dem-coupling/exchange.h"

#include "check.h"

// ---------------------------------------------------------------- a tank of water, jittered

typedef struct tank {
    silt_nodes nodes;
    silt_mesh mesh;
    silt_locator locator;
    silt_exchange exchange;
    uint64_t random;
} tank;

// nx x ny cells of size h, cut in triangles; one more node outside the mesh, as a drop in flight
static inline void tank_open(tank *t, int nx, int ny, double h) {
    memset(t, 0, sizeof *t);
    t->random = 7;
    for (int j = 0; j <= ny; j++)
        for (int i = 0; i <= nx; i++) {
            bool inside = i > 0 && j > 0 && i < nx && j < ny;
            double x[2] = {i * h, j * h};
            for (int k = 0; k < 2 && inside; k++)
                x[k] += 0.5 * h * (silt_uniform(&t->random) - 0.5);
            silt_nodes_add(&t->nodes, NODE_FLUID, -1, x);
        }
    silt_nodes_add(&t->nodes, NODE_FLUID, -1, (double[2]){-5 * h, -5 * h});
    SILT_RESERVE(t->mesh.cell, t->mesh.cell_capacity, 2 * nx * ny);
    for (int j = 0; j < ny; j++)
        for (int i = 0; i < nx; i++) {
            int a = j * (nx + 1) + i, b = a + 1, c = a + nx + 1, d = c + 1;
            int two[2][4] = {{a, b, d, -1}, {a, d, c, -1}};
            memcpy(t->mesh.cell[t->mesh.n_cell], two, sizeof two);
            t->mesh.n_cell += 2;
        }
    silt_mesh_connect(&t->mesh, &t->nodes);
    silt_locator_build(&t->locator, &t->mesh, t->nodes.x, h);
    t->exchange.density = 1000;
    t->exchange.viscosity = 1e-3;
    t->exchange.gravity[1] = -9.81;
    t->exchange.width = 2.5 * h;
    t->exchange.law = DRAG_DI_FELICE;
}

static inline void tank_close(tank *t) {
    silt_nodes_clear(&t->nodes);
    silt_mesh_clear(&t->mesh);
    silt_locator_clear(&t->locator);
    silt_exchange_clear(&t->exchange);
}

static inline silt_exchange_grain *tank_grain(tank *t, double x, double y, double d) {
    silt_exchange *e = &t->exchange;
    SILT_RESERVE(e->grain, e->grain_capacity, e->n_grain + 1);
    silt_exchange_grain *g = &e->grain[e->n_grain++];
    *g = (silt_exchange_grain){.x = {x, y}, .diameter = d, .number = 1 / (5 * d)};
    g->solid = M_PI / 6 * d * d * d * g->number;
    g->mass = 2650 * g->solid;
    g->cell = silt_locate(&t->locator, &t->mesh, t->nodes.x, g->x, g->weight);
    return g;
}

// n grains of different size anywhere in the tank, moving, one of them in the air
static inline void tank_fill(tank *t, int n, double lx, double ly) {
    for (int k = 0; k < n; k++) {
        silt_exchange_grain *g = tank_grain(t, lx * silt_uniform(&t->random), ly * silt_uniform(&t->random),
                                            1e-3 * (1 + silt_uniform(&t->random)));
        for (int d = 0; d < 2; d++) {
            g->v[d] = silt_uniform(&t->random) - 0.5;
            g->contact[d] = g->mass * 20 * (silt_uniform(&t->random) - 0.5);
        }
    }
    silt_exchange_grain *dry = tank_grain(t, lx / 2, 2 * ly, 1e-3);
    assert_int_equal(dry->cell, -1);
}

// any velocity and pressure
static inline void tank_stir(tank *t, double *velocity, double *pressure) {
    for (int i = 0; i < t->nodes.count; i++) {
        for (int d = 0; d < 2; d++)
            velocity[2 * i + d] = silt_uniform(&t->random) - 0.5;
        pressure[i] = 5e3 * silt_uniform(&t->random);
    }
}

// quartz (2650) in water: d in m, terminal velocity by Schiller-Naumann and by Di Felice in m/s
static const double terminal[][3] = {{5e-05, 0.00217696, 0.00215245}, {0.0001, 0.00796964, 0.00754775},
                                     {0.0002, 0.0247958, 0.0228487},  {0.0005, 0.0784474, 0.072894},
                                     {0.001, 0.155101, 0.1423},       {0.002, 0.283475, 0.245384},
                                     {0.005, 0.495227, 0.449206}};

#endif
