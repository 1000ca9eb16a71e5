/** @file space.h
 * The pressure system in 3-D: S + L row by row, solved by conjugate gradients with multigrid on a compact Laplacian
 * that resembles it.
 */
#ifndef SILT_SPACE_H
#define SILT_SPACE_H

#include "fluid.h"

typedef struct silt_space silt_space;

/** Rows of S + L and the preconditioner for the fluid's present geometry; made at first (*space NULL). The mesh is
 * borrowed until the next build.
 * @param pinned  1: a node whose pressure is tied to its level. @param stiff  rows of 3/(4 mu) M + L too.
 * Errors: SILT_FAILED when a matrix is not positive definite. */
silt_status silt_space_build(silt_space **space, const silt_fluid *fluid, const silt_step *step, const uint8_t *pinned,
                             bool stiff, silt_error *err);
/** x = (S + L)^-1 right, to `tolerance` of the first residual in the preconditioner's norm; *iterations counts on */
silt_status silt_space_solve(silt_space *space, const double *right, double tolerance, double *x, int *iterations,
                             silt_error *err);
/** x = (3/(4 mu) M + L)^-1 right, to 1e-3 */
silt_status silt_space_solve_stiff(silt_space *space, const double *right, double *x, silt_error *err);
void silt_space_free(silt_space **space);

#endif
