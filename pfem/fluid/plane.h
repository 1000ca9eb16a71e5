/** @file plane.h
 * The pressure system in two dimensions, factored. The order of elimination hangs on places alone, those of the moment when the
 * mesh changed: nothing is kept over a checkpoint.
 */
#ifndef SILT_PLANE_H
#define SILT_PLANE_H

#include "fluid.h"

typedef struct silt_plane silt_plane;

/** sum_i G_i^T P_i G_i / inertia_i + L; pinned: nodes that hold the pressure's level. Makes *plane at first. */
silt_status silt_plane_factor(silt_plane **plane, const silt_fluid *fluid, const silt_step *step, const uint8_t *pinned, silt_error *err);
/** to `tolerance` relative to the right side; the fluid lends working space and counts the iterations beyond one solve with the factor */
silt_status silt_plane_solve(silt_plane *plane, silt_fluid *fluid, const double *right, double tolerance, double *out, silt_error *err);
/** silt_front_rest */
void *silt_plane_rest(silt_plane *plane, size_t *bytes);
/** the next factor has an order of its own */
void silt_plane_forget(silt_plane *plane);
void silt_plane_free(silt_plane **plane);

/** what is added to the diagonal at node j; a crumb between held nodes knows its pressure up to a constant too */
static inline double silt_pressure_pin(const silt_mesh *mesh, const uint8_t *pinned, int j, double diagonal) {
    return !mesh->wet[j] ? 1 : pinned[j] ? diagonal : 1e-9 * diagonal;
}
/** the error that a matrix is not positive definite at a node */
silt_status silt_pressure_indefinite(const silt_step *step, int node, silt_error *err);

#endif
