/** @file factor.h
 * A sparse symmetric positive definite matrix, its order of elimination and its factor (CHOLMOD, one thread). The matrix is made in
 * two goes: its pattern when the mesh changes, its values as often as wanted.
 */
#ifndef SILT_FACTOR_H
#define SILT_FACTOR_H

#include "base.h"

typedef struct silt_factor {
    int n;
    const int *start;  // n + 1, lower triangle by columns
    int *index;        // rows of a column rise
    double *value;
    int bad;           // row where the last factor broke down
    struct silt_factor_inside *inside; // owned
} silt_factor;

/** room for a new pattern of n rows and `filled` entries. @return start, to be filled in with index; value is 0 */
int *silt_factor_pattern(silt_factor *factor, int n, int filled);
/** chooses the order of elimination, by minimum degree */
void silt_factor_analyse(silt_factor *factor);
/** L L^T, supernodal where that pays. @return false when the matrix is not positive definite: see `bad` */
bool silt_factor_compute(silt_factor *factor);
/** out = matrix^-1 right, which may be the same array */
bool silt_factor_solve(silt_factor *factor, const double *right, double *out);
void silt_factor_clear(silt_factor *factor);

#endif
