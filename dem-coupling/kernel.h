/** @file kernel.h
 * The kernel that spreads grains over the water and samples the water at grains: diffusion over the time b^2/4 with the lumped P1
 * mass M and the stiffness K of the water's cells, natural boundary. In the plane one implicit step, H = M + (b^2/4) K; in
 * space, where a factor of that is dear, H^-1 is a polynomial of M^-1 K times M^-1 with the same width (sweep.h).
 * In layers, for water that is the same along x (space: and y) in the mean, rows are not nodes but hats of the height with the width b between
 * their tops, and a grain's are the two around its centre. P are the shares of a sphere that the hats around hold, m the water under
 * them, N = P m: what grains give is spread by F P N^-1, F the hats at the nodes, and they read N^-1 P F^T M u. So each grain has
 * the water's mean over its own height, and gives back there, however thin the hats are. (Hats alone, b = d/8, make layers of what
 * should be even: the water then feels a roughness of 13 d in place of 3 d.)
 * H is symmetric and H 1 = M 1: what is spread is conserved, and sampling is the transpose of spreading, in layers too.
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
    double *hat;         // owned, m2 or m3 per hat, N
    double *sum;         // owned, of a solve
    double *slice;       // owned, reach + 1, P by the distance of hats
    int reach;
    double first, width; // the lowest hat's top over the width; m
    int layer_capacity[5];
    silt_sweep sweep;    // space
} silt_kernel;

/** Factors H of the chosen nodes (1 in `chosen`, one per node of the mesh) for the mesh at positions x (dim per node) and
 * the kernel width in m. M is that of all cells around a node, K that of the cells whose nodes are all chosen: nothing
 * passes from the others, and H 1 = M 1 all the same. layer_grain: in layers, the grains' diameter, m; else 0. Errors (SILT_FAILED): a cell without area or volume, naming it. */
silt_status silt_kernel_build(silt_kernel *kernel, const silt_mesh *mesh, const double *x, const uint8_t *chosen,
                              double width, double layer_grain, silt_error *err);
/** H^-1 applied in place to n_field fields, 4 or NESTED_FIELDS (= SWEEP_FIELDS), stored node by node in the kernel's order, with a row of finite
 * numbers behind the last */
void silt_kernel_solve(const silt_kernel *kernel, int n_field, double *field);
/** What grains read, and what they spread: without layers both are the solve, from nodes to nodes. With layers the former goes from the nodes'
 * rows to the hats', the latter from the hats' to the nodes'; room for silt_kernel_rows and one more. */
void silt_kernel_sample(const silt_kernel *kernel, int n_field, double *field);
void silt_kernel_spread(const silt_kernel *kernel, int n_field, double *field);
int silt_kernel_rows(const silt_kernel *kernel);
/** the hat below a height, and the share of the one above it */
int silt_kernel_layer(const silt_kernel *kernel, double height, double *above);
/** the solve for one field, stored by the nodes of the mesh; the values at nodes that were not chosen stay */
void silt_kernel_smooth(silt_kernel *kernel, double *field);
void silt_kernel_clear(silt_kernel *kernel);

#endif
