/** @file exchange.h
 * Grains in water, both ways: solid fraction, drag, pressure-gradient force and the grains' share of continuity. One
 * kernel spreads and samples, so that what the grains gain the water loses. In the plane and in space; in the plane everything
 * is per metre of width and the third component of what has three is not looked at.
 *
 * Model A: F = -V grad p + beta (u - v), with u and grad p sampled through the kernel. The drag is implicit on both
 * sides: beta_eff = beta / (1 + dt beta/m),  v_free = v + dt (g + (F_pressure + F_contact)/m), F_drag = beta_eff (u -
 * v_free) = beta (u - v_end),  v_end = v_free + dt/m F_drag with F_contact what contacts did to the grain in the last
 * step.
 */
#ifndef SILT_EXCHANGE_H
#define SILT_EXCHANGE_H

#include "drag.h"
#include "force.h"
#include "kernel.h"

typedef struct silt_exchange_grain {
    // given before prepare
    double x[3], v[3];
    double solid;      // m3/m, solid volume
    double mass;       // kg/m
    double diameter;   // m, of the grains that the drag law sees
    double number;     // 1/m, how many of these the parcel is, per metre of width
    double contact[3]; // N/m, of contacts in the last step
    double spin[3];    // 1/s; looked at where there is a torque on it
    double gyration;   // m, radius of gyration of the sphere that spins, sqrt(0.4) times its radius
    double gust[3];    // m/s, added to the water's velocity in the drag
    bool held;         // stays as fast as it is, whatever acts on it
    int cell;          // of the water's mesh, -1: not in the water
    double weight[4];  // barycentric, in that cell
    double immersed;   // m3, result of place: what of its solid displaces water; less in a drop that is smaller than the grain
    // results of load
    double water[3];    // m/s, the water's velocity at the grain
    double effective;   // kg/(s m), beta_eff
    double free[3];     // m/s, v_free of the last update
    double pressure[3]; // N/m, force of the pressure gradient
    double force[3];    // N/m, all of the water's force; out of the water as it was before
    double torque[3];   // N m/m, the water's, where it is asked for
} silt_exchange_grain;

/** what passed between grains and water in a step, N per m of width */
typedef struct silt_exchange_totals {
    double pressure[3]; // of the pressure gradient on grains
    double drag[3];     // of drag on grains, and of all other forces but the pressure gradient's
    double water[3];    // of these on the water: sum over nodes of push - coefficient u; minus drag to rounding
    double size;        // sum over grains of the magnitudes of both parts
} silt_exchange_totals;

/** a cell of the water near to grains */
typedef struct exchange_cell {
    int at[4];    // corners, among the nodes that are looked at
    double least; // m2, plane: twice the area below which the cell counts as at the start of the step
} exchange_cell;

/** eight grains in the water: what a step's updates read and write of them */
typedef struct exchange_group {
    int place[DRAG_GROUP][4];      // rows of the kernel: the corners of the grain's cell, or the hats around it
    double weight[DRAG_GROUP][4];
    double number[DRAG_NUMBERS][DRAG_GROUP]; // of the drag law
    double pace[DRAG_GROUP];                 // s m/kg, dt/m
    double solid[DRAG_GROUP], v[3][DRAG_GROUP];
    double start[3][DRAG_GROUP];             // m/s, v_free but for the pressure
    double factor[DRAG_GROUP], effective[DRAG_GROUP], free[3][DRAG_GROUP];
    double gust[3][DRAG_GROUP];              // m/s, with gusts
} exchange_group;

typedef struct silt_exchange {
    // given once
    silt_drag_law law;
    double density, viscosity; // of the water
    double gravity[3];
    double width; // m, of the kernel
    double layer_grain; // m, their diameter where the kernel takes means along x (space: and y), in layers, else 0
    bool gusts;   // grains have some
    silt_forces force; // its def; forces besides drag and pressure gradient
    bool refresh; // update also renews the coefficients; the fluid must then read them anew
    // given before prepare
    int n_grain, grain_capacity;
    silt_exchange_grain *grain; // owned
    // results
    silt_drag drag;              // its arrays are owned by this struct
    silt_exchange_totals totals; // of the last load
    // inside
    silt_kernel kernel;
    const silt_mesh *mesh; // borrowed from prepare to load, so are the positions at the start of the step
    const double *x;
    double dt;
    int dim;    // of the mesh
    int n_node;
    double *solid, *coefficient, *push, *source; // owned, per node
    double *read, *give;                         // owned, fields through the kernel, in its order
    struct exchange_cell *cell;                          // owned, cells near to a node that the kernel holds
    int n_wet, *wet;                                     // owned, grains in the water
    int n_row; // of what the grains read and give
    int n_group;
    struct exchange_group *group; // owned, of those
    uint8_t *chosen;                             // owned, per node: the kernel holds it
    double *placed_x;                            // owned, dim per node, positions at the last place
    bool placed;
    int64_t revision; // of the mesh then
    int n_placed_cell, *bin; // owned, grid around the grains
    int *index;              // owned, per node of the mesh: among those that are looked at
    int n_look, *look;       // owned, nodes that an update looks at: the kernel's in its order, then others of their cells
    double *rest;            // owned, m, dim per node of those, positions at the start of the step
    double *middle;          // owned, m, at its middle
    double *seen;            // owned, of those, velocity and pressure (dim + 1 numbers) of the last iterate
    double *spare;           // owned, room for another
    double *volume, *flow;   // owned, of those, m2 and m2/s (m3, m3/s)
    int node_capacity[9], look_capacity[7], cell_capacity, bin_capacity, wet_capacity, group_capacity;
} silt_exchange;

/** Spreads the grains over the water around them, their place in the mesh (cell, weight) given: the solid fraction. */
silt_status silt_exchange_place(silt_exchange *exchange, const silt_nodes *nodes, const silt_mesh *mesh, silt_error *err);
/** true when mesh and positions are those of the last place: only grains that moved make another one necessary */
bool silt_exchange_stands(const silt_exchange *exchange, const silt_nodes *nodes, const silt_mesh *mesh);
/** The drag of a step dt, after place: the second half of prepare. */
void silt_exchange_begin(silt_exchange *exchange, const silt_nodes *nodes, double dt);
/** place and begin. Spreads the grains and makes the drag of a step dt from the nodes' velocity and pressure at its start, the grains'
 * place in the mesh (cell, weight) given. Solid fraction and kernel stay as they are here until the next prepare;
 * nodes' positions must not change before load. The drag's update takes the velocity that the mesh moves with: pressure
 * gradient and source are those of the cells at x + dt/2 velocity, so that the force on the grains is, to rounding,
 * what the water's pressure term  sum over cells of area grad p (mean of solid)  loses there.
 * Errors (SILT_FAILED): the kernel cannot be built. */
silt_status silt_exchange_prepare(silt_exchange *exchange, const silt_nodes *nodes, const silt_mesh *mesh, double dt,
                                  silt_error *err);
/** Final forces on the grains and the totals, from the accepted velocity (that the mesh moves with, as in update) and
 * pressure. Coefficients, free velocities and cells are those of the last update: what the water felt.
 * @param middle  the water's midpoint mesh, dim numbers per node, on which its pressure acted; NULL: that of the last update */
void silt_exchange_load(silt_exchange *exchange, const double *velocity, const double *pressure, double dt, const double *middle);
/** A third (space: a quarter) of a near cell's measure times the gradients of its shape functions, at the middle of the step */
void silt_exchange_slope(const silt_exchange *exchange, int near, double slope[4][3]);
void silt_exchange_clear(silt_exchange *exchange);

#endif
