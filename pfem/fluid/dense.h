/** @file dense.h
 * Small dense triangles, columns one after the other: what fronts are factored and solved with. Made for tens to hundreds of rows,
 * where a library spends more on being called than on the work; compiled for several processors, the best is taken at the start.
 * Single precision: what is rounded is mended from outside (front_solve.c).
 */
#ifndef SILT_DENSE_H
#define SILT_DENSE_H

#include "base.h"

// numbers past the end of a panel, an update or a right side that may be read and are written as they were. Whatever they are changes
// nothing, but where they are denormal, as whole numbers taken for floats are, a product takes five times as long.
#define DENSE_PAD 16
#define DENSE_LEAST 3e-6f // share of the matrix's diagonal below which a pivot is rounding: several hundred sums of 6e-8

#define DENSE_WRONG 1e-3f // share below which a negative one is none: the worst that a thousand roundings one way come to is 6e-5

#define DENSE_CHUNK 8 // columns that stand together

/** How panels and updates lie in memory: columns from `at` to `at` + DENSE_CHUNK, each from row `at` on, then those of the next chunk. With
 * negative pivots, whose columns are not worked on by chunks, all columns have all rows. @return where column c would have its row 0 */
static inline ptrdiff_t silt_dense_column(int wide, int negative, int c) {
    const ptrdiff_t at = c / DENSE_CHUNK * DENSE_CHUNK, rows = wide - at;
    return negative ? (ptrdiff_t)c * wide : at * wide - at * (at - DENSE_CHUNK) / 2 + (c - at) * rows - at;
}
/** numbers of the first `columns` */
static inline size_t silt_dense_size(int wide, int negative, int columns) {
    return columns ? (size_t)(silt_dense_column(wide, negative, columns - 1) + wide) : 0;
}

/** A panel of `wide` rows and `own` columns, lower triangle first: L of its top, L21 of the rest, 1/diagonal in the diagonal's place.
 * @param whole  the matrix's diagonal, of each column; it takes the place of a pivot that is rounding: what is known up to a constant
 * gets it fixed there
 * @param negative  that many columns, the last, have negative pivots: panel = L S L^T, S ones and, for these, minus ones
 * @return -1, or a column whose pivot has the wrong sign, and not by rounding */
int silt_dense_factor(int own, int negative, int wide, const float *whole, float *panel);
/** update (wide - own rows and columns, lower triangle; above it anything; as if without negative pivots) -= L21 S L21^T */
void silt_dense_update(int own, int negative, int wide, const float *panel, float *update);
/** t (wide, what is past it is lost) = [L 0; L21 1]^-1 t */
void silt_dense_forward(int own, int negative, int wide, const float *panel, float *t);
/** t (the first own) = L^-T (t - L21^T rest of t) */
void silt_dense_backward(int own, int negative, int wide, const float *panel, float *t);
/** Adds an update of n rows and columns, lower triangle, to the columns of a front, which start at row 0: row r goes to at[r]. at rises,
 * by one up to the row before end[r]. */
void silt_dense_scatter(int n, const int *at, const int *end, const float *update, float **column);

#endif
