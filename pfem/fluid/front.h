/** @file front.h
 * Direct solution of a symmetric system whose matrix is a sum over the nodes' stars (a node and its neighbours), positive definite, or
 * couples pairs of neighbours with two or three unknowns each, quasi-definite; 2-D: nested dissection by place, then fronts (Duff and
 * Reid, ACM Trans. Math. Softw. 9, 1983). The matrix is never put together: a star or pair goes straight into the front that eliminates
 * the first of its nodes. Single precision: half the memory and twice the numbers at a time of double (factor and solves of S + L at
 * 160k nodes 3600 -> 1960 ns a node and step); front_mend.c makes up for it.
 */
#ifndef SILT_FRONT_H
#define SILT_FRONT_H

#include "base.h"

typedef struct silt_front silt_front;

/** What is summed, over nodes i with neighbour lists as the mesh has them: weight g g^T twice, and what couples i with its neighbours
 * of higher number (row: three numbers per entry of i's list, the two of g and the coupling); a diagonal */
typedef struct silt_front_matrix {
    int n;
    const int *neighbour_start, *neighbour;
    const float *row;       // 3 per neighbour
    const float *weight;    // n
    const double *diagonal; // n
    const float *whole;     // the diagonal of the sum, one per unknown
    // In place of all these: what couples every node with its neighbours, unknowns^2 numbers for each (row by row, those of the node
    // itself included). Two unknowns, velocities; or three, the last a pressure, whose pivots are negative: the matrix is quasi-definite,
    // so that every order has a factor L D L^T (Vanderbei, SIAM J. Optim. 5, 1995), here L S L^T with signs S.
    const float *pair;
    int unknowns;
    int threads;            // that may work at it, 0 counts as one; the bits do not hang on it
} silt_front_matrix;

/** The order of elimination and room for the factor. x: places, 2 per node; only the order hangs on them. Makes *front at first. */
void silt_front_order(silt_front **front, const silt_front_matrix *matrix, const double *x);
/** @return -1, or a node where the matrix is not positive definite, by more than rounding */
int silt_front_factor(silt_front *front, const silt_front_matrix *matrix);
/** out = matrix^-1 right, which may be the same array, as far as single precision goes */
void silt_front_solve(silt_front *front, const double *right, double *out);
/** the factor's own memory, for other use until silt_front_factor; NULL: none */
void *silt_front_rest(silt_front *front, size_t *bytes);
void silt_front_free(silt_front **front);

// front_mend.c: how good that is, and better ---------------------------------------------------------------
/** x = matrix^-1 right, so that of the right side no more than the share `tolerance` is left (root of the sum of squares in units of
 * the diagonal). The first solve with a factor measures what it leaves: where that is well below the tolerance the next ones do
 * without.
 * @param work   n numbers each
 * @param share  in and out, of a right side that a solve with this factor leaves; 0 where that is not known yet
 * @param iterations  counts those that the factor alone would not have needed. @return false: not definite, or no end */
bool silt_front_mend(silt_front *front, const silt_front_matrix *matrix, const double *right, double tolerance, double *x,
                     double *const work[3], double *share, int *iterations);
/** out = matrix x */
void silt_front_apply(const silt_front_matrix *matrix, const double *x, double *out);

#endif
