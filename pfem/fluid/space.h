/** @file space.h
 * The pressure system in 3-D: S + L row by row, solved by conjugate gradients with multigrid on a compact Laplacian that resembles it.
 */
#ifndef SILT_SPACE_H
#define SILT_SPACE_H

#include "fluid.h"

typedef struct silt_space silt_space;

/** Rows of S + L and the preconditioner for the fluid's present geometry; made at first (*space NULL).
 * @param pinned  1: a node whose pressure is tied to its level. Errors: SILT_FAILED when a matrix is not positive definite. */
silt_status silt_space_build(silt_space **space, const silt_fluid *fluid, const silt_step *step, const uint8_t *pinned,
                             silt_error *err);
/** x = (S + L)^-1 right, to `tolerance` of the first residual in the preconditioner's norm */
silt_status silt_space_solve(silt_space *space, silt_fluid *fluid, const silt_mesh *mesh, const double *right, double tolerance,
                             double *x, silt_error *err);
void silt_space_free(silt_space **space);

#endif
