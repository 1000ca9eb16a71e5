// kernel.c: the porosity kernel: assembly, sparse factor, solve
#include "kernel.h"

#include <cholmod.h>

struct silt_kernel_factor {
    cholmod_common common;
    cholmod_sparse *matrix; // upper triangle, one column per node, rows rising, the diagonal last
    cholmod_factor *factor;
    cholmod_dense *solution, *work_y, *work_e; // kept between solves
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
    f->common.final_ll = 0;
    f->common.print = 0;
    f->common.error_handler = NULL;
    return f;
}

// cell geometry and lumped volumes
static silt_status kernel_measure(silt_kernel *kernel, const silt_mesh *mesh, const double *x, silt_error *err) {
    SILT_RESERVE(kernel->volume, kernel->volume_capacity, mesh->n_node);
    SILT_RESERVE(kernel->area, kernel->area_capacity, mesh->n_cell);
    SILT_RESERVE(kernel->gradient, kernel->cell_capacity, mesh->n_cell);
    memset(kernel->volume, 0, (size_t)mesh->n_node * sizeof *kernel->volume);
    for (int e = 0; e < mesh->n_cell; e++) {
        const int *node = mesh->cell[e];
        const double *a = x + 2 * node[0], *b = x + 2 * node[1], *c = x + 2 * node[2];
        double twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if (!(twice > 0.0))
            return silt_fail(
                err, SILT_FAILED,
                "porosity kernel: water cell %d (nodes %d %d %d) near (%g, %g) has the area %g m2, must be above 0", e,
                node[0], node[1], node[2], a[0], a[1], twice / 2.0);
        kernel->area[e] = twice / 2.0;
        for (int k = 0; k < 3; k++) {
            const double *p = x + 2 * node[(k + 1) % 3], *q = x + 2 * node[(k + 2) % 3];
            kernel->gradient[e][k][0] = (p[1] - q[1]) / twice;
            kernel->gradient[e][k][1] = (q[0] - p[0]) / twice;
            kernel->volume[node[k]] += twice / 6.0;
        }
    }
    return SILT_OK;
}

// the pattern of H: neighbours with a smaller index, then the diagonal
static void kernel_pattern(struct silt_kernel_factor *f, const silt_mesh *mesh) {
    int n = mesh->n_node;
    size_t most = (size_t)n + (size_t)mesh->neighbour_start[n];
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
    for (int i = 0; i < n; i++) {
        start[i] = filled;
        for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1] && mesh->neighbour[k] < i; k++)
            row[filled++] = mesh->neighbour[k];
        row[filled++] = i;
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

silt_status silt_kernel_build(silt_kernel *kernel, const silt_mesh *mesh, const double *x, double width,
                              silt_error *err) {
    // asked again for the same place, say for another time step: nothing to do
    size_t n_x = 2 * (size_t)mesh->n_node;
    if (kernel->ready && kernel->revision == mesh->revision && kernel->n_node == mesh->n_node &&
        kernel->n_cell == mesh->n_cell && kernel->width == width && memcmp(kernel->x, x, n_x * sizeof *x) == 0)
        return SILT_OK;
    kernel->ready = false;
    SILT_RESERVE(kernel->x, kernel->x_capacity, 2 * mesh->n_node);
    memcpy(kernel->x, x, n_x * sizeof *x);
    kernel->width = width;
    SILT_TRY(kernel_measure(kernel, mesh, x, err));
    if (kernel->factor == NULL)
        kernel->factor = kernel_open();
    struct silt_kernel_factor *f = kernel->factor;
    bool fresh = f->factor == NULL || kernel->revision != mesh->revision || kernel->n_node != mesh->n_node ||
                 kernel->n_cell != mesh->n_cell;
    kernel->n_node = mesh->n_node;
    kernel->n_cell = mesh->n_cell;
    kernel->revision = mesh->revision;
    if (fresh)
        kernel_pattern(f, mesh);
    if (f->matrix == NULL)
        return silt_fail(err, SILT_FAILED, "porosity kernel: no memory for a matrix of %d nodes", mesh->n_node);

    // H = M + b^2/4 K; a node without a cell keeps what is asked of it
    double *value = f->matrix->x;
    const int *start = f->matrix->p;
    memset(value, 0, (size_t)start[mesh->n_node] * sizeof *value);
    for (int i = 0; i < mesh->n_node; i++)
        value[start[i + 1] - 1] = kernel->volume[i] > 0.0 ? kernel->volume[i] : 1.0;
    for (int e = 0; e < mesh->n_cell; e++)
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++) {
                int i = mesh->cell[e][a], j = mesh->cell[e][b];
                if (i > j)
                    continue;
                int entry = kernel_entry(f, i, j);
                if (entry < 0)
                    return silt_fail(err, SILT_FAILED,
                                     "porosity kernel: nodes %d and %d share a cell but are no neighbours", i, j);
                const double *p = kernel->gradient[e][a], *q = kernel->gradient[e][b];
                value[entry] += width * width / 4.0 * kernel->area[e] * (p[0] * q[0] + p[1] * q[1]);
            }
    if (fresh)
        f->factor = cholmod_analyze(f->matrix, &f->common);
    if (f->factor == NULL || !cholmod_factorize(f->matrix, f->factor, &f->common) || f->common.status != CHOLMOD_OK) {
        kernel->revision = -1;
        return silt_fail(err, SILT_FAILED,
                         "porosity kernel: the matrix of %d nodes cannot be factored (CHOLMOD status %d)", mesh->n_node,
                         f->common.status);
    }
    kernel->ready = true;
    return SILT_OK;
}

void silt_kernel_solve(silt_kernel *kernel, int n_field, double *field) {
    struct silt_kernel_factor *f = kernel->factor;
    size_t n = (size_t)kernel->n_node;
    cholmod_dense right = {.nrow = n,
                           .ncol = (size_t)n_field,
                           .nzmax = n * (size_t)n_field,
                           .d = n,
                           .x = field,
                           .xtype = CHOLMOD_REAL,
                           .dtype = CHOLMOD_DOUBLE};
    // fails only without memory; what then comes out is no number, and the finite checks downstream say so
    if (cholmod_solve2(CHOLMOD_A, f->factor, &right, NULL, &f->solution, NULL, &f->work_y, &f->work_e, &f->common))
        memcpy(field, f->solution->x, n * (size_t)n_field * sizeof *field);
    else
        for (size_t i = 0; i < n * (size_t)n_field; i++)
            field[i] = NAN;
}

void silt_kernel_clear(silt_kernel *kernel) {
    struct silt_kernel_factor *f = kernel->factor;
    if (f != NULL) {
        cholmod_free_sparse(&f->matrix, &f->common);
        cholmod_free_factor(&f->factor, &f->common);
        cholmod_free_dense(&f->solution, &f->common);
        cholmod_free_dense(&f->work_y, &f->common);
        cholmod_free_dense(&f->work_e, &f->common);
        cholmod_finish(&f->common);
        free(f);
    }
    free(kernel->volume);
    free(kernel->area);
    free(kernel->gradient);
    free(kernel->x);
    *kernel = (silt_kernel){0};
}
