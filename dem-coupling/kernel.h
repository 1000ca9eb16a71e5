/** @file kernel.h
 * The kernel that spreads grains over the water and samples the water at grains: one step of implicit diffusion,
 * H = M + (b^2/4) K, with the lumped P1 mass M and the stiffness K of the water's triangles, natural boundary.
 * H is symmetric and H 1 = M 1: what is spread is conserved, and sampling is the transpose of spreading.
 */
#ifndef SILT_KERNEL_H
#define SILT_KERNEL_H

#include "nested.h"

typedef struct silt_kernel {
    int n_node, *node;        // owned, the mesh's nodes that the kernel holds, in its own order
    int *place;               // owned, per node of the mesh: place in node, n_node: it is none of them
    int n_near, *near;        // owned, the mesh's cells that touch one of them, rising
    double *volume;           // owned, m2 per node of the mesh, a third of the cells around it; 0 without a cell
    double *area;             // owned, m2 per cell of the mesh, of those in near; so is edge
    double (*edge)[3];        // owned, m2, b^2/4 K between the corners across from each
    double *diagonal;         // owned, m2, of M per node of the mesh
    double *work;             // owned, of a solve
    int work_capacity, node_capacity[4], cell_capacity[3];
    silt_nested *nested; // owned
} silt_kernel;

/** Factors H of the chosen nodes (1 in `chosen`, one per node of the mesh) for the mesh at positions x (2 per node) and
 * the kernel width in m. M is that of all cells around a node, K that of the cells whose nodes are all chosen: nothing
 * passes from the others, and H 1 = M 1 all the same. Errors (SILT_FAILED): a cell without area, naming it. */
silt_status silt_kernel_build(silt_kernel *kernel, const silt_mesh *mesh, const double *x, const uint8_t *chosen,
                              double width, silt_error *err);
/** H^-1 applied in place to n_field fields, 4 or NESTED_FIELDS, stored node by node in the kernel's order, with a row of finite
 * numbers behind the last */
void silt_kernel_solve(const silt_kernel *kernel, int n_field, double *field);
/** the same for one field, stored by the nodes of the mesh; the values at nodes that were not chosen stay */
void silt_kernel_smooth(silt_kernel *kernel, double *field);
void silt_kernel_clear(silt_kernel *kernel);

#endif
