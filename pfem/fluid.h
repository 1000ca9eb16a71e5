/** @file fluid.h
 * One step of the water: momentum, pressure, correction on the midpoint mesh (docs/method.md, "Fluid").
 */
#ifndef SILT_FLUID_H
#define SILT_FLUID_H

#include "pfem.h"

typedef struct silt_pressure silt_pressure; // the pressure matrix and its factor, pressure.c

/** working space and results of a step; arrays grow only */
typedef struct silt_fluid {
    int n_node, n_cell, node_capacity, cell_capacity;
    double *x_mid;        // owned, 2 per node, positions of the midpoint mesh
    double *area;         // owned, per cell, at the midpoint
    double (*grad)[3][2]; // owned, per cell, gradients of the shape functions
    double (*share)[3];   // owned, per cell, int of solid share times N_i over the area
    double *mass;         // owned, per node, lumped mass of water, kg
    double *volume;       // owned, per node, lumped volume of the cells
    double *friction;     // owned, per node, kg/s, wall law: traction over speed, times the wall's length
    double *inertia;      // owned, per node, mass / (theta dt) + drag coefficient + friction
    double *w;            // owned, 2 per node, the step's velocity: positions move with it
    double *star, *force, *reaction, *scratch; // owned, 2 per node; reaction: force of walls, bed, bodies on the water, N
    double *projection, *projection_weight;    // owned, pressure gradient projection (2 per node) and its weight
    double *residual, *rate, *increment;       // owned, 1 per node
    uint8_t *hold;        // owned, 0 free, 1 normal velocity held, 2 both held
    uint8_t *mobile;      // owned, 1: some neighbour or the node itself can move; 2: but not so that its volume is kept
    double *withheld;     // owned, per node, m3/s: gain that continuity does not see where mobile is not 1
    double *normal;       // owned, 2 per node, where hold is 1
    const silt_walls *walls; // borrowed for a step
    silt_wall_normals wall_normals; // owned
    double *given;        // owned, 2 per node, what walls that move make of the held part of the velocity
    double *cg[3];        // owned, 2 per node, momentum solver
    double (*tau);        // owned, per cell, stabilisation
    bool last_try;        // set by the caller: no smaller step will follow, what can be booked as debt shall not fail the step
    silt_pressure *pressure; // owned

    // of the last step
    int iterations, momentum_iterations;
    double worst;             // largest |residual| dt / volume
    double from_grains[2];    // N, force of the grains on the water
    double dissipated;        // J, viscous
    double worked;            // J, of bodies, inlets and grains on the water
    double solved_volume;     // m3, sum of residual times dt
    double given_back;        // m3, volume that the debts asked for
    double momentum_residual; // N, unbalanced force on free nodes
    double momentum_scale;    // N, what it is relative to
    double seconds_assemble, seconds_solve;
} silt_fluid;

void silt_fluid_clear(silt_fluid *fluid);
/** Solves a step of dt from the nodes' x, v, p. On success nodes->v and nodes->p are new, fluid->w holds the velocity that
 * positions move with, debts are paid by what was asked; positions are untouched. On failure the nodes are as before.
 * @param drag  NULL without grains in the water
 * Errors: SILT_FAILED with what did not converge and where. */
silt_status silt_fluid_step(silt_fluid *fluid, const silt_scene *scene, const silt_walls *walls, silt_nodes *nodes,
                            const silt_mesh *mesh, const silt_drag *drag, double dt, silt_error *err);

// pressure.c ------------------------------------------------------------------------------------------
silt_pressure *silt_pressure_create(void);
void silt_pressure_free(silt_pressure **pressure);
/** Assembles and factors  sum_i G_i^T P_i G_i / inertia_i + L  (consistent) or its Laplacian counterpart.
 * Errors: SILT_FAILED when the matrix is not positive definite. */
silt_status silt_pressure_factor(silt_pressure *pressure, const silt_scene *scene, const silt_fluid *fluid,
                                 const silt_nodes *nodes, const silt_mesh *mesh, silt_error *err);
/** increment = matrix^-1 right */
silt_status silt_pressure_solve(silt_pressure *pressure, const double *right, double *increment, silt_error *err);
/** forgets factors, so that a resumed run and one that went on hold the same */
void silt_pressure_forget(silt_pressure *pressure);

#endif
