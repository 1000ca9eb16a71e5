/** @file nested.h
 * Direct solution of a system whose matrix is a diagonal and a sum over the mesh's triangles, of some of its nodes and in two
 * dimensions: nested dissection by place with separators one node wide, then fronts; double precision, several right sides in one
 * pass. (The water's own fronts, pfem/fluid/front.h, sum stars, whose separators are twice as wide.)
 */
#ifndef SILT_NESTED_H
#define SILT_NESTED_H

#include "pfem.h"

enum { NESTED_FIELDS = 8 };

typedef struct silt_nested silt_nested;

/** The order of elimination of n nodes at x (2 per node), room for the factor. Makes *nested at first.
 * @param node   the nodes; put into the order of elimination
 * @param place  out, per node of the mesh: where it stands in that order, n when it is none of them */
void silt_nested_order(silt_nested **nested, const silt_mesh *mesh, const double *x, int n, int *node, int *place);
/** The factor of  diagonal + sum over triangles of n nodes each, that couple the corners c+1 and c+2 of cell e by edge[e][c] and
 * have rows of sum nought. diagonal: per node of the mesh. @return -1, or a node where that is not positive definite */
int silt_nested_factor(silt_nested *nested, const silt_mesh *mesh, const double *diagonal, const double (*edge)[3]);
/** matrix^-1 applied in place to n_field fields (4 or NESTED_FIELDS) stored node by node in the order of elimination, with a row of
 * finite numbers behind the last */
void silt_nested_solve(const silt_nested *nested, int n_field, double *field);
void silt_nested_free(silt_nested **nested);

#endif
