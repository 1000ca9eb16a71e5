// the pressure system: assembled row by row from the node's gradients, factored by CHOLMOD
#include <cholmod.h>
#include <dlfcn.h>

#include "fluid.h"

struct silt_pressure {
    cholmod_common common;
    cholmod_factor *factor; // owned
    cholmod_sparse *matrix; // owned, lower triangle by columns
    cholmod_dense *solution, *work_y, *work_e; // owned
    int64_t revision;       // of the mesh that pattern and factor belong to
    int n;
    double (*gradient)[2];  // owned, G_ij along the mesh's neighbour lists
    int *mirror;            // owned, index of (j, i) for the entry (i, j)
    int *place;             // owned, 9 per cell: where (i, j) stands in the neighbour lists
    uint8_t *pinned;        // owned, one per node: the pressure level of a closed piece of water
    double *row;            // owned
    int *mark, *list;       // owned
    int gradient_capacity, mirror_capacity, place_capacity, pinned_capacity, row_capacity, mark_capacity, list_capacity;
};

silt_pressure *silt_pressure_create(void) {
    silt_pressure *pressure = silt_alloc(1, sizeof *pressure);
    cholmod_start(&pressure->common);
    pressure->common.print = 0;
    pressure->common.nmethods = 1;
    pressure->common.method[0].ordering = CHOLMOD_AMD;
    pressure->common.postorder = 1;
    pressure->common.quick_return_if_not_posdef = 1;
    // one BLAS thread: its results depend on the number of threads
    void (*threads)(int);
    *(void **)&threads = dlsym(RTLD_DEFAULT, "openblas_set_num_threads");
    if (threads)
        threads(1);
    return pressure;
}

void silt_pressure_forget(silt_pressure *pressure) {
    if (!pressure)
        return;
    cholmod_free_factor(&pressure->factor, &pressure->common);
    cholmod_free_sparse(&pressure->matrix, &pressure->common);
    pressure->revision = -1;
}

void silt_pressure_free(silt_pressure **pressure) {
    if (!*pressure)
        return;
    silt_pressure *p = *pressure;
    silt_pressure_forget(p);
    cholmod_free_dense(&p->solution, &p->common);
    cholmod_free_dense(&p->work_y, &p->common);
    cholmod_free_dense(&p->work_e, &p->common);
    cholmod_finish(&p->common);
    free(p->gradient);
    free(p->mirror);
    free(p->place);
    free(p->pinned);
    free(p->row);
    free(p->mark);
    free(p->list);
    free(p);
    *pressure = NULL;
}

// position of node j in the neighbour list of i
static int neighbour_index(const silt_mesh *mesh, int i, int j) {
    int lo = mesh->neighbour_start[i], hi = mesh->neighbour_start[i + 1] - 1;
    while (lo < hi) {
        const int mid = (lo + hi) / 2;
        if (mesh->neighbour[mid] < j)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

// pieces of water without a free surface know their pressure up to a constant: one node each is pinned
static void pin_closed(silt_pressure *p, const silt_mesh *mesh) {
    SILT_RESERVE(p->pinned, p->pinned_capacity, mesh->n_node + 1);
    int *parent = silt_alloc((size_t)mesh->n_node + 1, sizeof *parent);
    for (int i = 0; i < mesh->n_node; i++) {
        parent[i] = i;
        p->pinned[i] = 0;
    }
    for (int e = 0; e < mesh->n_cell; e++)
        silt_group_join(parent, mesh->cell[e]);
    for (int i = 0; i < mesh->n_node; i++)
        if (mesh->wet[i])
            p->pinned[silt_group_find(parent, i)] = 1;
    for (int i = 0; i < mesh->n_node; i++)
        if (mesh->surface[i])
            p->pinned[silt_group_find(parent, i)] = 0;
    free(parent);
}

static void pattern_build(silt_pressure *p, const silt_mesh *mesh) {
    const int n = mesh->n_node, n_entry = mesh->neighbour_start[n];
    SILT_RESERVE(p->gradient, p->gradient_capacity, n_entry + 1);
    SILT_RESERVE(p->mirror, p->mirror_capacity, n_entry + 1);
    SILT_RESERVE(p->place, p->place_capacity, 9 * mesh->n_cell + 1);
    SILT_RESERVE(p->row, p->row_capacity, n + 1);
    SILT_RESERVE(p->mark, p->mark_capacity, n + 1);
    SILT_RESERVE(p->list, p->list_capacity, n + 1);
    for (int i = 0; i < n; i++)
        for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1]; k++)
            p->mirror[k] = neighbour_index(mesh, mesh->neighbour[k], i);
    for (int e = 0; e < mesh->n_cell; e++)
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                p->place[9 * e + 3 * a + b] = neighbour_index(mesh, mesh->cell[e][a], mesh->cell[e][b]);

    // lower triangle: nodes at distance two; count, then fill
    cholmod_free_sparse(&p->matrix, &p->common);
    int *start = silt_alloc((size_t)n + 1, sizeof *start);
    for (int pass = 0; pass < 2; pass++) {
        for (int j = 0; j < n; j++)
            p->mark[j] = -1;
        int filled = 0;
        for (int j = 0; j < n; j++) {
            int count = 0;
            for (int k = mesh->neighbour_start[j]; k < mesh->neighbour_start[j + 1]; k++) {
                const int i = mesh->neighbour[k];
                for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++) {
                    const int c = mesh->neighbour[m];
                    if (c >= j && p->mark[c] != j) {
                        p->mark[c] = j;
                        p->list[count++] = c;
                    }
                }
            }
            if (pass) {
                // insertion sort: rows of a column rise, lists are short
                for (int a = 1; a < count; a++) {
                    const int key = p->list[a];
                    int b = a - 1;
                    for (; b >= 0 && p->list[b] > key; b--)
                        p->list[b + 1] = p->list[b];
                    p->list[b + 1] = key;
                }
                memcpy((int *)p->matrix->i + filled, p->list, (size_t)count * sizeof(int));
            }
            start[j] = filled;
            filled += count;
        }
        start[n] = filled;
        if (pass == 0)
            p->matrix = cholmod_allocate_sparse((size_t)n, (size_t)n, (size_t)filled, 1, 1, -1, CHOLMOD_REAL, &p->common);
    }
    memcpy(p->matrix->p, start, ((size_t)n + 1) * sizeof *start);
    free(start);
    p->n = n;
    pin_closed(p, mesh);
}

static void gradient_assemble(silt_pressure *p, const silt_fluid *fluid, const silt_mesh *mesh) {
    memset(p->gradient, 0, (size_t)mesh->neighbour_start[mesh->n_node] * sizeof *p->gradient);
    for (int e = 0; e < mesh->n_cell; e++)
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                for (int d = 0; d < 2; d++)
                    p->gradient[p->place[9 * e + 3 * a + b]][d] +=
                        fluid->area[e] * (fluid->grad[e][a][d] / 3 + fluid->share[e][a] * fluid->grad[e][b][d]);
}

// one column of sum_i G_i^T P_i G_i / inertia_i
static void column_consistent(silt_pressure *p, const silt_fluid *fluid, const silt_mesh *mesh, int j) {
    for (int k = mesh->neighbour_start[j]; k < mesh->neighbour_start[j + 1]; k++) {
        const int i = mesh->neighbour[k];
        if (fluid->hold[i] == 2)
            continue;
        double g[2] = {p->gradient[p->mirror[k]][0], p->gradient[p->mirror[k]][1]};
        if (fluid->hold[i] == 1) {
            const double *n = fluid->normal + 2 * i, gn = g[0] * n[0] + g[1] * n[1];
            g[0] -= gn * n[0];
            g[1] -= gn * n[1];
        }
        g[0] /= fluid->inertia[i];
        g[1] /= fluid->inertia[i];
        for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++)
            p->row[mesh->neighbour[m]] += g[0] * p->gradient[m][0] + g[1] * p->gradient[m][1];
    }
}

silt_status silt_pressure_factor(silt_pressure *p, const silt_scene *scene, const silt_fluid *fluid,
                                 const silt_nodes *nodes, const silt_mesh *mesh, silt_error *err) {
    const bool fresh = p->revision != mesh->revision || !p->matrix;
    if (fresh)
        pattern_build(p, mesh);
    gradient_assemble(p, fluid, mesh);

    const bool consistent = scene->fluid.pressure == PRESSURE_CONSISTENT;
    const int *start = p->matrix->p, *index = p->matrix->i;
    double *value = p->matrix->x;
    for (int j = 0; j < p->n; j++)
        p->row[j] = 0;
    for (int j = 0; j < p->n; j++) {
        if (mesh->wet[j]) {
            if (consistent)
                column_consistent(p, fluid, mesh, j);
            // stabilisation, and the Laplacian in place of the consistent operator
            for (int k = mesh->node_cell_start[j]; k < mesh->node_cell_start[j + 1]; k++) {
                const int e = mesh->node_cell[k], *cell = mesh->cell[e];
                const int a = cell[0] == j ? 0 : cell[1] == j ? 1 : 2;
                double weight = fluid->tau[e] * fluid->area[e];
                if (!consistent) {
                    double inertia = 0, volume = 0;
                    for (int c = 0; c < 3; c++) {
                        inertia += fluid->inertia[cell[c]];
                        volume += fluid->volume[cell[c]];
                    }
                    weight += fluid->area[e] * volume / inertia;
                }
                for (int c = 0; c < 3; c++)
                    p->row[cell[c]] += weight * (fluid->grad[e][a][0] * fluid->grad[e][c][0] + fluid->grad[e][a][1] * fluid->grad[e][c][1]);
            }
        }
        double *diagonal = &value[start[j]];
        for (int k = start[j]; k < start[j + 1]; k++)
            value[k] = p->row[index[k]];
        if (!mesh->wet[j])
            *diagonal = 1;
        else
            *diagonal *= p->pinned[j] ? 2 : 1 + 1e-9; // a crumb between held nodes knows its pressure up to a constant too
        if (!consistent && mesh->surface[j]) // pressure increment prescribed on the free surface
            *diagonal += 1e12 * fabs(*diagonal);
        // clear what this column touched
        for (int k = mesh->neighbour_start[j]; k < mesh->neighbour_start[j + 1]; k++) {
            const int i = mesh->neighbour[k];
            for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++)
                p->row[mesh->neighbour[m]] = 0;
        }
    }
    if (fresh) {
        cholmod_free_factor(&p->factor, &p->common);
        p->factor = cholmod_analyze(p->matrix, &p->common);
        p->revision = mesh->revision;
    }
    if (!p->factor || !cholmod_factorize(p->matrix, p->factor, &p->common) || p->common.status == CHOLMOD_NOT_POSDEF) {
        const int bad = p->factor ? (int)p->factor->minor : 0;
        const int node = p->factor && p->factor->Perm && bad < p->n ? ((int *)p->factor->Perm)[bad] : 0;
        p->revision = -1;
        return silt_fail(err, SILT_FAILED, "the pressure matrix is not positive definite near (%g, %g)", nodes->x[2 * node],
                         nodes->x[2 * node + 1]);
    }
    return SILT_OK;
}

silt_status silt_pressure_solve(silt_pressure *p, const double *right, double *increment, silt_error *err) {
    cholmod_dense b = {.nrow = (size_t)p->n, .ncol = 1, .nzmax = (size_t)p->n, .d = (size_t)p->n, .x = (void *)(uintptr_t)right,
                       .xtype = CHOLMOD_REAL, .dtype = CHOLMOD_DOUBLE};
    if (!cholmod_solve2(CHOLMOD_A, p->factor, &b, NULL, &p->solution, NULL, &p->work_y, &p->work_e, &p->common))
        return silt_fail(err, SILT_FAILED, "the pressure system could not be solved (CHOLMOD status %d)", p->common.status);
    memcpy(increment, p->solution->x, (size_t)p->n * sizeof *increment);
    return SILT_OK;
}
