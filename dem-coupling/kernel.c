// kernel.c: the porosity kernel: its numbers, and what it does to fields
#include "kernel.h"

enum { SMOOTH_FIELDS = 4 }; // that go through a solve at least

// the nodes of the kernel, and the cells that touch one
static void kernel_choose(silt_kernel *kernel, const silt_mesh *mesh, const uint8_t *chosen) {
    SILT_RESERVE(kernel->place, kernel->node_capacity[0], mesh->n_node);
    SILT_RESERVE(kernel->node, kernel->node_capacity[1], mesh->n_node);
    SILT_RESERVE(kernel->near, kernel->cell_capacity[0], mesh->n_cell);
    kernel->n_node = kernel->n_near = 0;
    for (int i = 0; i < mesh->n_node; i++)
        if (chosen[i])
            kernel->node[kernel->n_node++] = i;
    for (int e = 0; e < mesh->n_cell; e++) {
        const int *node = mesh->cell[e];
        if (chosen[node[0]] || chosen[node[1]] || chosen[node[2]])
            kernel->near[kernel->n_near++] = e;
    }
}

// lumped volumes, and b^2/4 K cell by cell
static silt_status kernel_measure(silt_kernel *kernel, const silt_mesh *mesh, const double *x, double width, silt_error *err) {
    SILT_RESERVE(kernel->volume, kernel->node_capacity[2], mesh->n_node);
    SILT_RESERVE(kernel->area, kernel->cell_capacity[1], mesh->n_cell);
    SILT_RESERVE(kernel->edge, kernel->cell_capacity[2], mesh->n_cell);
    memset(kernel->volume, 0, (size_t)mesh->n_node * sizeof *kernel->volume);
    for (int k = 0; k < kernel->n_near; k++) {
        const int e = kernel->near[k], *node = mesh->cell[e];
        const double *a = x + 2 * node[0], *b = x + 2 * node[1], *c = x + 2 * node[2];
        double twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if (!(twice > 0.0))
            return silt_fail(
                err, SILT_FAILED,
                "porosity kernel: water cell %d (nodes %d %d %d) near (%g, %g) has the area %g m2, must be above 0", e,
                node[0], node[1], node[2], a[0], a[1], twice / 2.0);
        kernel->area[e] = twice / 2.0;
        // gradients are the sides across, turned and over `twice`
        const double side[3][2] = {{c[0] - b[0], c[1] - b[1]}, {a[0] - c[0], a[1] - c[1]}, {b[0] - a[0], b[1] - a[1]}};
        const double weight = width * width / 4.0 / (2.0 * twice);
        for (int d = 0; d < 3; d++) {
            const double *p = side[(d + 1) % 3], *q = side[(d + 2) % 3];
            kernel->edge[e][d] = weight * (p[0] * q[0] + p[1] * q[1]);
            kernel->volume[node[d]] += twice / 6.0;
        }
    }
    return SILT_OK;
}

silt_status silt_kernel_build(silt_kernel *kernel, const silt_mesh *mesh, const double *x, const uint8_t *chosen,
                              double width, silt_error *err) {
    kernel_choose(kernel, mesh, chosen);
    SILT_TRY(kernel_measure(kernel, mesh, x, width, err));
    // a node without a cell keeps what is asked of it
    SILT_RESERVE(kernel->diagonal, kernel->node_capacity[3], mesh->n_node);
    for (int k = 0; k < kernel->n_node; k++) {
        const int i = kernel->node[k];
        kernel->diagonal[i] = kernel->volume[i] > 0.0 ? kernel->volume[i] : 1.0;
    }
    silt_nested_order(&kernel->nested, mesh, x, kernel->n_node, kernel->node, kernel->place);
    const int bad = silt_nested_factor(kernel->nested, mesh, kernel->diagonal, (const double(*)[3])kernel->edge);
    if (bad >= 0)
        return silt_fail(err, SILT_FAILED,
                         "porosity kernel: the matrix of %d nodes is not positive definite at node %d near (%g, %g)",
                         kernel->n_node, bad, x[2 * bad], x[2 * bad + 1]);
    return SILT_OK;
}

void silt_kernel_solve(const silt_kernel *kernel, int n_field, double *field) {
    silt_nested_solve(kernel->nested, n_field, field);
}

void silt_kernel_smooth(silt_kernel *kernel, double *field) {
    const int n = kernel->n_node;
    SILT_RESERVE(kernel->work, kernel->work_capacity, SMOOTH_FIELDS * (n + 1));
    memset(kernel->work, 0, SMOOTH_FIELDS * ((size_t)n + 1) * sizeof *field);
    for (int k = 0; k < n; k++)
        kernel->work[SMOOTH_FIELDS * k] = field[kernel->node[k]];
    silt_kernel_solve(kernel, SMOOTH_FIELDS, kernel->work);
    for (int k = 0; k < n; k++)
        field[kernel->node[k]] = kernel->work[SMOOTH_FIELDS * k];
}

void silt_kernel_clear(silt_kernel *kernel) {
    silt_nested_free(&kernel->nested);
    void *owned[] = {kernel->volume, kernel->area,  kernel->edge, kernel->diagonal,
                     kernel->node,   kernel->place, kernel->near, kernel->work};
    for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
        free(owned[k]);
    *kernel = (silt_kernel){0};
}
