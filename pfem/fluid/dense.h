/** @file dense.h
 * Small dense triangles, columns one after the other: what fronts are factored and solved with. Made for tens to hundreds of rows,
 * where a library spends more on being called than on the work; compiled for several processors, the best is taken at the start.
 */
#ifndef SILT_DENSE_H
#define SILT_DENSE_H

#include "base.h"

#define DENSE_PAD 16 // numbers that may be read (not used) past the end of a panel

/** A panel of `wide` rows and `own` columns, lower triangle first: L of its top, L21 of the rest, 1/diagonal in the diagonal's place.
 * @return -1, or the column with a pivot that is not positive */
int silt_dense_factor(int own, int wide, double *panel);
/** update (wide - own rows and columns, lower triangle; above it anything) -= L21 L21^T */
void silt_dense_update(int own, int wide, const double *panel, double *update);
/** t (wide) = [L 0; L21 1]^-1 t */
void silt_dense_forward(int own, int wide, const double *panel, double *t);
/** t (the first own) = L^-T (t - L21^T rest of t) */
void silt_dense_backward(int own, int wide, const double *panel, double *t);

#endif
