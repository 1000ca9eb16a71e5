/** @file coarse.h
 * A multigrid preconditioner for symmetric positive definite matrices that look like a Laplacian: smoothed aggregation
 * (Vanek, Mandel and Brezina, Computing 56, 1996), one V-cycle with a sweep of Gauss-Seidel forward before and backward
 * after, so that it is symmetric and positive definite. Set up in O(n); the cycle works in single precision. Large
 * levels are swept in blocks at the same time. No state: the same matrix gives the same bits, on any number of threads.
 */
#ifndef SILT_COARSE_H
#define SILT_COARSE_H

#include "base.h"

typedef struct silt_coarse silt_coarse;

/** Levels for a matrix given by whole rows, the diagonal included, columns rising; made at first (*coarse NULL).
 * @param start, index  borrowed until the next build. @return false when a diagonal is not positive or the coarsest
 * level has no factor */
bool silt_coarse_build(silt_coarse **coarse, int n, const int *start, const int *index, const double *value);
/** the right side of the next cycle, to be written: n numbers, of any size that single precision knows the squares of
 */
float *silt_coarse_right(silt_coarse *coarse);
/** one cycle. @return its result, n numbers, until the next cycle; NULL when the coarsest level could not be solved */
const float *silt_coarse_cycle(silt_coarse *coarse);
void silt_coarse_free(silt_coarse **coarse);

#endif
