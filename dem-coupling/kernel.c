// kernel.c: the porosity kernel: assembly, sparse factor, solve
#include "kernel.h"

#include <cholmod.h>

#define KERNEL_INLINE __attribute__((always_inline)) static inline
enum { PANEL_MOST = 4 };

struct silt_kernel_factor {
    cholmod_common common;
    cholmod_sparse *matrix; // upper triangle, one column per node, rows rising, the diagonal last
    cholmod_factor *factor;
    size_t nonzero_capacity, column_capacity;
};

static struct silt_kernel_factor *kernel_open(void) {
    struct silt_kernel_factor *f = silt_alloc(1, sizeof *f);
    cholmod_start(&f->common);
    // simplicial: the same bits whatever BLAS and however many threads; quiet
    f->common.supernodal = CHOLMOD_SIMPLICIAL;
    f->common.nmethods = 1;
    f->common.method[0].ordering = CHOLMOD_AMD;
    f->common.postorder = 1;
    f->common.final_ll = 1;
    f->common.print = 0;
    f->common.error_handler = NULL;
    return f;
}

// the nodes of the kernel, and the cells that touch one
static void kernel_choose(silt_kernel *kernel, const silt_mesh *mesh, const uint8_t *chosen) {
    SILT_RESERVE(kernel->local, kernel->node_capacity[0], mesh->n_node);
    SILT_RESERVE(kernel->node, kernel->node_capacity[1], mesh->n_node);
    SILT_RESERVE(kernel->near, kernel->cell_capacity[0], mesh->n_cell);
    kernel->n_node = kernel->n_near = 0;
    for (int i = 0; i < mesh->n_node; i++) {
        kernel->local[i] = chosen[i] ? kernel->n_node : -1;
        if (chosen[i])
            kernel->node[kernel->n_node++] = i;
    }
    for (int e = 0; e < mesh->n_cell; e++) {
        const int *node = mesh->cell[e];
        if (chosen[node[0]] || chosen[node[1]] || chosen[node[2]])
            kernel->near[kernel->n_near++] = e;
    }
}

// cell geometry and lumped volumes
static silt_status kernel_measure(silt_kernel *kernel, const silt_mesh *mesh, const double *x, silt_error *err) {
    SILT_RESERVE(kernel->volume, kernel->node_capacity[2], mesh->n_node);
    SILT_RESERVE(kernel->area, kernel->cell_capacity[1], mesh->n_cell);
    SILT_RESERVE(kernel->gradient, kernel->cell_capacity[2], mesh->n_cell);
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
        for (int d = 0; d < 3; d++) {
            const double *p = x + 2 * node[(d + 1) % 3], *q = x + 2 * node[(d + 2) % 3];
            kernel->gradient[e][d][0] = (p[1] - q[1]) / twice;
            kernel->gradient[e][d][1] = (q[0] - p[0]) / twice;
            kernel->volume[node[d]] += twice / 6.0;
        }
    }
    return SILT_OK;
}

// the pattern of H: neighbours with a smaller index, then the diagonal
static void kernel_pattern(const silt_kernel *kernel, struct silt_kernel_factor *f, const silt_mesh *mesh) {
    int n = kernel->n_node;
    size_t most = (size_t)n + (size_t)mesh->neighbour_start[mesh->n_node];
    cholmod_common *common = &f->common;
    cholmod_free_factor(&f->factor, common);
    if (f->matrix == NULL || f->column_capacity < (size_t)n || f->nonzero_capacity < most) {
        cholmod_free_sparse(&f->matrix, common);
        f->column_capacity = (size_t)n + (size_t)n / 4;
        f->nonzero_capacity = most + most / 4;
        f->matrix = cholmod_allocate_sparse(f->column_capacity, f->column_capacity, f->nonzero_capacity, 1, 1, 1,
                                            CHOLMOD_REAL, common);
        if (f->matrix == NULL)
            return;
    }
    f->matrix->nrow = f->matrix->ncol = (size_t)n;
    int *start = f->matrix->p, *row = f->matrix->i, filled = 0;
    for (int k = 0; k < n; k++) {
        const int i = kernel->node[k];
        start[k] = filled;
        for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1] && mesh->neighbour[m] < i; m++)
            if (kernel->local[mesh->neighbour[m]] >= 0)
                row[filled++] = kernel->local[mesh->neighbour[m]];
        row[filled++] = k;
    }
    start[n] = filled;
}

// place of row i in column j >= i
static int kernel_entry(const struct silt_kernel_factor *f, int i, int j) {
    const int *start = f->matrix->p, *row = f->matrix->i;
    int lo = start[j], hi = start[j + 1] - 1;
    while (lo < hi) {
        int middle = (lo + hi) / 2;
        if (row[middle] < i)
            lo = middle + 1;
        else
            hi = middle;
    }
    return row[lo] == i ? lo : -1;
}

// Columns of L that follow each other with the same rows below them are taken up to four at a time: a panel. What lies below
// it then is read once for four columns (10k nodes, four sides: see silt_kernel_solve).
static void kernel_panels(silt_kernel *kernel) {
    const cholmod_factor *factor = kernel->factor->factor;
    const int n = kernel->n_node, *start = factor->p, *row = factor->i, *count = factor->nz;
    SILT_RESERVE(kernel->panel, kernel->panel_capacity, n + 1);
    kernel->n_panel = 0;
    for (int j = 0; j < n;) {
        int wide = 1;
        while (wide < PANEL_MOST && j + wide < n && count[j + wide] == count[j] - wide &&
               row[start[j + wide - 1] + 1] == j + wide)
            wide++;
        wide = wide == 3 ? 2 : wide;
        kernel->panel[kernel->n_panel++] = j;
        j += wide;
    }
    kernel->panel[kernel->n_panel] = n;
}

silt_status silt_kernel_build(silt_kernel *kernel, const silt_mesh *mesh, const double *x, const uint8_t *chosen,
                              double width, silt_error *err) {
    kernel_choose(kernel, mesh, chosen);
    SILT_TRY(kernel_measure(kernel, mesh, x, err));
    if (kernel->factor == NULL)
        kernel->factor = kernel_open();
    struct silt_kernel_factor *f = kernel->factor;
    kernel_pattern(kernel, f, mesh);
    if (f->matrix == NULL)
        return silt_fail(err, SILT_FAILED, "porosity kernel: no memory for a matrix of %d nodes", kernel->n_node);

    // H = M + b^2/4 K; a node without a cell keeps what is asked of it
    double *value = f->matrix->x;
    const int *start = f->matrix->p;
    memset(value, 0, (size_t)start[kernel->n_node] * sizeof *value);
    for (int k = 0; k < kernel->n_node; k++) {
        const double volume = kernel->volume[kernel->node[k]];
        value[start[k + 1] - 1] = volume > 0.0 ? volume : 1.0;
    }
    for (int m = 0; m < kernel->n_near; m++) {
        const int e = kernel->near[m], *node = mesh->cell[e];
        const int local[3] = {kernel->local[node[0]], kernel->local[node[1]], kernel->local[node[2]]};
        if (local[0] < 0 || local[1] < 0 || local[2] < 0)
            continue;
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++) {
                if (local[a] > local[b])
                    continue;
                int entry = kernel_entry(f, local[a], local[b]);
                if (entry < 0)
                    return silt_fail(err, SILT_FAILED,
                                     "porosity kernel: nodes %d and %d share a cell but are no neighbours", node[a],
                                     node[b]);
                const double *p = kernel->gradient[e][a], *q = kernel->gradient[e][b];
                value[entry] += width * width / 4.0 * kernel->area[e] * (p[0] * q[0] + p[1] * q[1]);
            }
    }
    f->factor = cholmod_analyze(f->matrix, &f->common);
    if (f->factor == NULL || !cholmod_factorize(f->matrix, f->factor, &f->common) || f->common.status != CHOLMOD_OK)
        return silt_fail(err, SILT_FAILED,
                         "porosity kernel: the matrix of %d nodes cannot be factored (CHOLMOD status %d)",
                         kernel->n_node, f->common.status);
    kernel_panels(kernel);
    return SILT_OK;
}

// forward through a panel of w columns from column j on, m right sides
KERNEL_INLINE void kernel_forward(const cholmod_factor *factor, int j, double *restrict x, const int w, const int m) {
    const int *restrict start = factor->p, *restrict row = (const int *)factor->i + start[j];
    const int count = ((const int *)factor->nz)[j];
    const double *restrict column[PANEL_MOST];
    double y[PANEL_MOST][KERNEL_FIELDS];
    for (int t = 0; t < w; t++) {
        column[t] = (const double *)factor->x + start[j + t] - t;
        const double scale = 1.0 / column[t][t];
        for (int k = 0; k < m; k++) {
            double sum = x[m * (j + t) + k];
            for (int s = 0; s < t; s++)
                sum -= column[s][t] * y[s][k];
            x[m * (j + t) + k] = y[t][k] = sum * scale;
        }
    }
    for (int p = w; p < count; p++)
        for (int k = 0; k < m; k++) {
            double sum = x[m * row[p] + k];
            for (int t = 0; t < w; t++)
                sum -= column[t][p] * y[t][k];
            x[m * row[p] + k] = sum;
        }
}

KERNEL_INLINE void kernel_backward(const cholmod_factor *factor, int j, double *restrict x, const int w, const int m) {
    const int *restrict start = factor->p, *restrict row = (const int *)factor->i + start[j];
    const int count = ((const int *)factor->nz)[j];
    const double *restrict column[PANEL_MOST];
    double y[PANEL_MOST][KERNEL_FIELDS];
    for (int t = 0; t < w; t++) {
        column[t] = (const double *)factor->x + start[j + t] - t;
        for (int k = 0; k < m; k++)
            y[t][k] = x[m * (j + t) + k];
    }
    for (int p = w; p < count; p++)
        for (int t = 0; t < w; t++)
            for (int k = 0; k < m; k++)
                y[t][k] -= column[t][p] * x[m * row[p] + k];
    for (int t = w - 1; t >= 0; t--) {
        const double scale = 1.0 / column[t][t];
        for (int k = 0; k < m; k++) {
            for (int s = t + 1; s < w; s++)
                y[t][k] -= column[t][s] * y[s][k];
            x[m * (j + t) + k] = y[t][k] *= scale;
        }
    }
}

// L L^T x = b for m right sides at a time, in the order of elimination
KERNEL_INLINE void kernel_sweep(const silt_kernel *kernel, double *restrict x, const int m) {
    const cholmod_factor *factor = kernel->factor->factor;
    const int *panel = kernel->panel;
    for (int b = 0; b < kernel->n_panel; b++) {
        const int wide = panel[b + 1] - panel[b];
        if (wide == 4)
            kernel_forward(factor, panel[b], x, 4, m);
        else if (wide == 2)
            kernel_forward(factor, panel[b], x, 2, m);
        else
            kernel_forward(factor, panel[b], x, 1, m);
    }
    for (int b = kernel->n_panel - 1; b >= 0; b--) {
        const int wide = panel[b + 1] - panel[b];
        if (wide == 4)
            kernel_backward(factor, panel[b], x, 4, m);
        else if (wide == 2)
            kernel_backward(factor, panel[b], x, 2, m);
        else
            kernel_backward(factor, panel[b], x, 1, m);
    }
}

void silt_kernel_solve(silt_kernel *kernel, int n_field, double *field) {
    const int n = kernel->n_node, *order = kernel->factor->factor->Perm;
    const size_t row = (size_t)n_field;
    SILT_RESERVE(kernel->work, kernel->work_capacity, KERNEL_FIELDS * n);
    for (int i = 0; i < n; i++)
        memcpy(kernel->work + row * (size_t)i, field + row * (size_t)kernel->node[order[i]], row * sizeof *field);
    // the widths that are asked for, each with its loops unrolled
    if (n_field == 4)
        kernel_sweep(kernel, kernel->work, 4);
    else if (n_field == 6)
        kernel_sweep(kernel, kernel->work, 6);
    else
        kernel_sweep(kernel, kernel->work, n_field);
    for (int i = 0; i < n; i++)
        memcpy(field + row * (size_t)kernel->node[order[i]], kernel->work + row * (size_t)i, row * sizeof *field);
}

void silt_kernel_clear(silt_kernel *kernel) {
    struct silt_kernel_factor *f = kernel->factor;
    if (f != NULL) {
        cholmod_free_sparse(&f->matrix, &f->common);
        cholmod_free_factor(&f->factor, &f->common);
        cholmod_finish(&f->common);
        free(f);
    }
    free(kernel->volume);
    free(kernel->area);
    free(kernel->gradient);
    free(kernel->node);
    free(kernel->local);
    free(kernel->near);
    free(kernel->panel);
    free(kernel->work);
    *kernel = (silt_kernel){0};
}
