/** @file kernel.h
 * The kernel that spreads grains over the water and samples the water at grains: diffusion over the time b^2/4 with the lumped P1
 * mass M and the stiffness K of the water's cells, natural boundary. In the plane one implicit step, H = M + (b^2/4) K; in
 * space, where a factor of that is dear, H^-1 is a polynomial of M^-1 K times M^-1 with the same width (sweep.h).
 * With `layers`, for water that is the same along x (space: and y) in the mean, H^-1 = F (F^T M F)^-1 F^T, F the hat functions of the height with the
 * width b between their tops and (F^T M F) lumped: means along the whole of x (and y), fine across. A kernel of grains' size around each grain would
 * see it in its own shade.
 * H is symmetric and H 1 = M 1: what is spread is conserved, and sampling is the transpose of spreading.
 */
#ifndef SILT_KERNEL_H
#define SILT_KERNEL_H

#include "nested.h"
#include "sweep.h"

typedef struct silt_kernel {
    int dim;                  // of the mesh
    int n_node, *node;        // owned, the mesh's nodes that the kernel holds, in its own order
    int *place;               // owned, per node of the mesh: place in node, n_node: it is none of them
    int n_near, *near;        // owned, the mesh's cells that touch one of them, rising
    double *volume;           // owned, m2 or m3 per node of the mesh, its share of the cells around it; 0 without a cell
    double *area;             // owned, m2 or m3 per cell of the mesh, of those in near; so is edge
    double *edge;             // owned, m2 or m3, b^2/4 K between corners: plane 3 per cell, across from each; space 6 (sweep.h)
    double *diagonal;         // owned, m2, of M per node of the mesh, plane
    double *work;             // owned, of a solve
    int work_capacity, node_capacity[4], cell_capacity[3];
    silt_nested *nested; // owned, plane
    int n_layer;         // of the hats of `layers`, else 0
    int *layer;          // owned, per node of the kernel: the hat below it
    double *above;       // owned, per node of the kernel: its share of the next hat
    double *hat;         // owned, m2 per hat, of M
    double *sum;         // owned, of a solve
    int layer_capacity[4];
    silt_sweep sweep;    // space
} silt_kernel;

/** Factors H of the chosen nodes (1 in `chosen`, one per node of the mesh) for the mesh at positions x (dim per node) and
 * the kernel width in m. M is that of all cells around a node, K that of the cells whose nodes are all chosen: nothing
 * passes from the others, and H 1 = M 1 all the same. Errors (SILT_FAILED): a cell without area or volume, naming it. */
silt_status silt_kernel_build(silt_kernel *kernel, const silt_mesh *mesh, const double *x, const uint8_t *chosen,
                              double width, bool layers, silt_error *err);
/** H^-1 applied in place to n_field fields, 4 or NESTED_FIELDS (= SWEEP_FIELDS), stored node by node in the kernel's order, with a row of finite
 * numbers behind the last */
void silt_kernel_solve(const silt_kernel *kernel, int n_field, double *field);
/** the same for one field, stored by the nodes of the mesh; the values at nodes that were not chosen stay */
void silt_kernel_smooth(silt_kernel *kernel, double *field);
void silt_kernel_clear(silt_kernel *kernel);

#endif
