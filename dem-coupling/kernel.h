/** @file kernel.h
 * The kernel that spreads grains over the water and samples the water at grains: one step of implicit diffusion,
 * H = M + (b^2/4) K, with the lumped P1 mass M and the stiffness K of the water's triangles, natural boundary.
 * H is symmetric and H 1 = M 1: what is spread is conserved, and sampling is the transpose of spreading.
 */
#ifndef SILT_KERNEL_H
#define SILT_KERNEL_H

#include "pfem.h"

typedef struct silt_kernel {
    int n_node, n_cell;
    double *volume;           // owned, m2 per node, a third of the cells around it; 0 for a node without a cell
    double *area;             // owned, m2 per cell
    double (*gradient)[3][2]; // owned, 1/m, per cell, of its three shape functions
    int x_capacity, volume_capacity, cell_capacity, area_capacity;
    int64_t revision; // of the mesh that the analysis belongs to
    double width, *x; // what H was made for; x owned, 2 per node
    bool ready;
    struct silt_kernel_factor *factor; // owned
} silt_kernel;

/** Factors H for the mesh at positions x (2 per node) and the kernel width in m. The symbolic part is redone only when
 * mesh->revision changed. Errors (SILT_FAILED): a cell without area, naming it. */
silt_status silt_kernel_build(silt_kernel *kernel, const silt_mesh *mesh, const double *x, double width,
                              silt_error *err);
/** H^-1 applied in place to n_field (1 or 2) fields, stored one after the other with n_node values each */
void silt_kernel_solve(silt_kernel *kernel, int n_field, double *field);
void silt_kernel_clear(silt_kernel *kernel);

#endif
