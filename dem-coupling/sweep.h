/** @file sweep.h
 * Diffusion in space by sweeps over the mesh: H^-1 = P(t M^-1 K) M^-1 with the Chebyshev polynomial P of few sweeps that has
 * P(0) = 1, P'(0) = -1 and is smallest above: what is constant stays, its width is that of (M + t K)^-1 and of exp(-t M^-1 K) M^-1,
 * what varies from node to node goes. A fixed polynomial is symmetric to rounding whatever the number of sweeps.
 */
#ifndef SILT_SWEEP_H
#define SILT_SWEEP_H

#include "pfem.h"

enum { SWEEP_FIELDS = 8, SWEEP_MOST = 64 };

typedef struct silt_sweep {
    int n, degree;
    int *start, *index; // owned, n + 1, and places that a node is joined to
    double *weight;     // owned, -t K of them over the node's M
    double *diagonal;   // owned, the sum of the weights
    double *inverse;    // owned, 1/m3, 1/M
    double shift, pace, fade[SWEEP_MOST + 1]; // w0, w1 of T(w0 - w1 z), and T_{k-1}(w0)/T_k(w0)
    double *row;        // owned, scratch
    double *work[2];    // owned, fields
    int node_capacity[4], weight_capacity[2], work_capacity[2];
} silt_sweep;

/** volume of a tetrahedron (three numbers a corner), and t K between its corners 0-1, 0-2, 0-3, 1-2, 1-3, 2-3 */
double silt_sweep_cell(const double corner[12], double t, double edge[6]);
/** The polynomial of n nodes: place per node of the mesh (n: none of them), volume (m3) too, near: cells around, edge (with t, m2):
 * 6 per cell, of slivers less afterwards */
void silt_sweep_build(silt_sweep *sweep, const silt_mesh *mesh, int n, const int *node, const int *place, int n_near, const int *near,
                      const double *volume, double t, double *edge);
/** H^-1 applied in place to n_field fields, 4 or SWEEP_FIELDS, stored node by node */
void silt_sweep_solve(const silt_sweep *sweep, int n_field, double *field);
void silt_sweep_clear(silt_sweep *sweep);

#endif
