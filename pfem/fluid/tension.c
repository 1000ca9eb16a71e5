// tension of the free surface
#include "viscosity.h"

// The force on a node is minus the gradient of the surface's energy: tension times length, in 3-D times area. Walls are neutral,
// they cost as much wet as dry: at rest the surface meets them at a right angle.
void silt_tension_force(const silt_mesh *mesh, const double *x, double tension, double *out) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    for (int k = 0; k < mesh->n_facet; k++) {
        if (mesh->facet_kind[k] != FACET_FREE)
            continue;
        const int *facet = mesh->facet[k];
        double edge[2][3] = {{0}};
        for (int a = 1; a < dim; a++)
            for (int d = 0; d < dim; d++)
                edge[a - 1][d] = silt_shortest(mesh, d, x[dim * facet[a] + d] - x[dim * facet[0] + d]);
        if (dim == 2) {
            const double length = silt_length(2, edge[0]);
            for (int d = 0; d < 2 && length > 0; d++) {
                out[2 * facet[0] + d] += tension * edge[0][d] / length;
                out[2 * facet[1] + d] -= tension * edge[0][d] / length;
            }
            continue;
        }
        double normal[3];
        for (int d = 0; d < 3; d++)
            normal[d] = edge[0][(d + 1) % 3] * edge[1][(d + 2) % 3] - edge[0][(d + 2) % 3] * edge[1][(d + 1) % 3];
        const double twice = silt_length(3, normal);
        for (int d = 0; d < 3 && twice > 0; d++) {
            const int u = (d + 1) % 3, v = (d + 2) % 3;
            // the area grows with node 1 by half of the unit normal across the edge from 2 to 0, with node 2 by that from 0 to 1
            const double one = 0.5 * tension * (normal[v] * edge[1][u] - normal[u] * edge[1][v]) / twice;
            const double two = 0.5 * tension * (normal[u] * edge[0][v] - normal[v] * edge[0][u]) / twice;
            out[3 * facet[1] + d] -= one;
            out[3 * facet[2] + d] -= two;
            out[3 * facet[0] + d] += one + two;
        }
    }
}
