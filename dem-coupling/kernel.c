// kernel.c: the porosity kernel: its numbers, and what it does to fields
#include "kernel.h"

enum { SMOOTH_FIELDS = 4, LAYER_FIELDS = NESTED_FIELDS }; // that go through a solve at least; at most

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
        if (chosen[node[0]] || chosen[node[1]] || chosen[node[2]] || (kernel->dim == 3 && chosen[node[3]]))
            kernel->near[kernel->n_near++] = e;
    }
}

// area of a triangle and b^2/4 K between its corners
static double kernel_triangle(const double c[12], double scale, double edge[3]) {
    const double *a = c, *b = c + 2, *d = c + 4;
    const double twice = (b[0] - a[0]) * (d[1] - a[1]) - (b[1] - a[1]) * (d[0] - a[0]);
    // gradients are the sides across, turned and over `twice`
    const double side[3][2] = {{d[0] - b[0], d[1] - b[1]}, {a[0] - d[0], a[1] - d[1]}, {b[0] - a[0], b[1] - a[1]}};
    const double weight = scale / (2.0 * twice);
    for (int k = 0; k < 3; k++) {
        const double *p = side[(k + 1) % 3], *q = side[(k + 2) % 3];
        edge[k] = weight * (p[0] * q[0] + p[1] * q[1]);
    }
    return twice / 2.0;
}

// Lumped volumes, and b^2/4 K cell by cell. Means over layers take no K: a flat cell at the surface that turned over between two meshings
// is as good to them as any.
static silt_status kernel_measure(silt_kernel *kernel, const silt_mesh *mesh, const double *x, double width, bool layers, silt_error *err) {
    const int D = kernel->dim, n_edge = D == 3 ? 6 : 3;
    SILT_RESERVE(kernel->volume, kernel->node_capacity[2], mesh->n_node);
    SILT_RESERVE(kernel->area, kernel->cell_capacity[1], mesh->n_cell);
    SILT_RESERVE(kernel->edge, kernel->cell_capacity[2], n_edge * mesh->n_cell);
    memset(kernel->volume, 0, (size_t)mesh->n_node * sizeof *kernel->volume);
    for (int k = 0; k < kernel->n_near; k++) {
        const int e = kernel->near[k], *node = mesh->cell[e];
        double c[12], *edge = kernel->edge + n_edge * e;
        silt_cell_corners(mesh, x, node, c);
        const double volume = D == 3 ? silt_sweep_cell(c, width * width / 4.0, edge) : kernel_triangle(c, width * width / 4.0, edge);
        if (!(volume > 0.0) && !layers)
            return silt_fail(err, SILT_FAILED, "porosity kernel: water cell %d (nodes %d %d %d%s) near (%g, %g, %g) has the %s %g m%d, must be above 0",
                             e, node[0], node[1], node[2], D == 3 ? ", ..." : "", c[0], c[1], D == 3 ? c[2] : 0.0, D == 3 ? "volume" : "area",
                             volume, D);
        kernel->area[e] = volume;
        for (int a = 0; a <= D; a++)
            kernel->volume[node[a]] += volume / (D + 1);
    }
    return SILT_OK;
}

// ---------------------------------------------------------------- layers

// Share of a sphere of this diameter that a hat holds whose top is k widths off its centre, by slices; all of them make 1
static void kernel_slices(silt_kernel *kernel, double width, double diameter) {
    enum { PARTS = 32 };
    const double radius = 0.5 * diameter / width; // in widths
    kernel->reach = (int)ceil(radius);
    SILT_RESERVE(kernel->slice, kernel->layer_capacity[4], kernel->reach + 1);
    memset(kernel->slice, 0, (size_t)(kernel->reach + 1) * sizeof *kernel->slice);
    double sum = 0.0;
    for (int i = 0; i < PARTS * kernel->reach; i++) {
        const double z = (i + 0.5) / PARTS, area = silt_max(radius * radius - z * z, 0.0);
        const int k = (int)z;
        // those above the centre, and as many below
        kernel->slice[k] += (k == 0 ? 2.0 : 1.0) * area * (k + 1 - z);
        kernel->slice[k + 1] += area * (z - k);
        sum += 2.0 * area;
    }
    for (int k = 0; k <= kernel->reach && sum > 0.0; k++)
        kernel->slice[k] /= sum;
    if (!(sum > 0.0))
        kernel->slice[0] = 1.0;
}

// what the hats around hold, by their share of a sphere at each: n_field numbers each
static void kernel_smear(const silt_kernel *kernel, int n_field, const double *from, double *to) {
    for (int j = 0; j < kernel->n_layer; j++)
        for (int f = 0; f < n_field; f++) {
            double sum = 0.0;
            for (int k = j > kernel->reach ? j - kernel->reach : 0; k <= j + kernel->reach && k < kernel->n_layer; k++)
                sum += kernel->slice[abs(k - j)] * from[n_field * k + f];
            to[n_field * j + f] = sum;
        }
}

// hats over the heights of the kernel's nodes, at multiples of their width: the same ones whatever nodes there are
static void kernel_layers(silt_kernel *kernel, const double *x, double width, double diameter) {
    const int n = kernel->n_node, D = kernel->dim, up = D - 1;
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int k = 0; k < n; k++) {
        low = silt_min(low, x[D * kernel->node[k] + up]);
        high = silt_max(high, x[D * kernel->node[k] + up]);
    }
    const double first = n > 0 ? floor(low / width) : 0.0;
    kernel->first = first;
    kernel->width = width;
    kernel->n_layer = n > 0 ? (int)(floor(high / width) - first) + 2 : 1;
    kernel_slices(kernel, width, diameter);
    SILT_RESERVE(kernel->layer, kernel->layer_capacity[0], n + 1);
    SILT_RESERVE(kernel->above, kernel->layer_capacity[1], n + 1);
    SILT_RESERVE(kernel->hat, kernel->layer_capacity[2], kernel->n_layer);
    SILT_RESERVE(kernel->sum, kernel->layer_capacity[3], 2 * LAYER_FIELDS * kernel->n_layer);
    memset(kernel->sum, 0, (size_t)kernel->n_layer * sizeof *kernel->sum);
    for (int k = 0; k < n; k++) {
        const double volume = kernel->volume[kernel->node[k]];
        kernel->layer[k] = silt_kernel_layer(kernel, x[D * kernel->node[k] + up], &kernel->above[k]);
        kernel->sum[kernel->layer[k]] += (1.0 - kernel->above[k]) * volume;
        kernel->sum[kernel->layer[k] + 1] += kernel->above[k] * volume;
    }
    kernel_smear(kernel, 1, kernel->sum, kernel->hat);
}

int silt_kernel_layer(const silt_kernel *kernel, double height, double *above) {
    const double y = silt_clamp(height / kernel->width - kernel->first, 0.0, kernel->n_layer - 1.0);
    const int layer = (int)y < kernel->n_layer - 2 ? (int)y : kernel->n_layer - 2;
    *above = y - layer;
    return layer;
}

static void kernel_divide(const silt_kernel *kernel, int n_field, double *field) {
    for (int j = 0; j < kernel->n_layer; j++)
        for (int f = 0; f < n_field; f++)
            field[n_field * j + f] = kernel->hat[j] > 0.0 ? field[n_field * j + f] / kernel->hat[j] : 0.0;
}

// from the nodes to the hats: means of the water that a sphere there fills
static void kernel_layers_sample(const silt_kernel *kernel, int n_field, double *field) {
    double *sum = kernel->sum;
    memset(sum, 0, (size_t)(n_field * kernel->n_layer) * sizeof *sum);
    for (int k = 0; k < kernel->n_node; k++)
        for (int f = 0; f < n_field; f++) {
            const double value = field[n_field * k + f], up = kernel->above[k];
            sum[n_field * kernel->layer[k] + f] += (1.0 - up) * value;
            sum[n_field * (kernel->layer[k] + 1) + f] += up * value;
        }
    kernel_smear(kernel, n_field, sum, field);
    kernel_divide(kernel, n_field, field);
}

// the transpose: from the hats to the nodes
static void kernel_layers_spread(const silt_kernel *kernel, int n_field, double *field) {
    double *sum = kernel->sum;
    kernel_divide(kernel, n_field, field);
    kernel_smear(kernel, n_field, field, sum);
    for (int k = 0; k < kernel->n_node; k++)
        for (int f = 0; f < n_field; f++) {
            const double *at = sum + n_field * kernel->layer[k] + f;
            field[n_field * k + f] = at[0] + kernel->above[k] * (at[n_field] - at[0]);
        }
}

// ---------------------------------------------------------------- all kinds

static void kernel_places(silt_kernel *kernel, int n_node) {
    for (int i = 0; i < n_node; i++)
        kernel->place[i] = kernel->n_node;
    for (int k = 0; k < kernel->n_node; k++)
        kernel->place[kernel->node[k]] = k;
}

silt_status silt_kernel_build(silt_kernel *kernel, const silt_mesh *mesh, const double *x, const uint8_t *chosen,
                              double width, double layer_grain, silt_error *err) {
    const bool layers = layer_grain > 0.0;
    kernel->dim = mesh->dim == 3 ? 3 : 2;
    kernel->n_layer = 0;
    kernel_choose(kernel, mesh, chosen);
    SILT_TRY(kernel_measure(kernel, mesh, x, width, layers, err));
    if (layers) {
        kernel_places(kernel, mesh->n_node);
        kernel_layers(kernel, x, width, layer_grain);
        return SILT_OK;
    }
    if (kernel->dim == 3) {
        kernel_places(kernel, mesh->n_node);
        silt_sweep_build(&kernel->sweep, mesh, kernel->n_node, kernel->node, kernel->place, kernel->n_near, kernel->near, kernel->volume,
                         width * width / 4.0, kernel->edge);
        return SILT_OK;
    }
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
    if (kernel->dim == 3)
        silt_sweep_solve(&kernel->sweep, n_field, field);
    else
        silt_nested_solve(kernel->nested, n_field, field);
}

void silt_kernel_sample(const silt_kernel *kernel, int n_field, double *field) {
    if (kernel->n_layer > 0)
        kernel_layers_sample(kernel, n_field, field);
    else
        silt_kernel_solve(kernel, n_field, field);
}

void silt_kernel_spread(const silt_kernel *kernel, int n_field, double *field) {
    if (kernel->n_layer > 0)
        kernel_layers_spread(kernel, n_field, field);
    else
        silt_kernel_solve(kernel, n_field, field);
}

int silt_kernel_rows(const silt_kernel *kernel) { return kernel->n_node > kernel->n_layer ? kernel->n_node : kernel->n_layer; }

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
    silt_sweep_clear(&kernel->sweep);
    void *owned[] = {kernel->volume, kernel->area,  kernel->edge, kernel->diagonal,
                     kernel->node,   kernel->place, kernel->near, kernel->work,
                     kernel->layer, kernel->above, kernel->hat,  kernel->sum, kernel->slice};
    for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
        free(owned[k]);
    *kernel = (silt_kernel){0};
}
