// the pressure system. 2-D: assembled row by row from the node's gradients, factored by CHOLMOD. 3-D: space.c
#include "factor.h"
#include "space.h"

/** a symmetric matrix and its factor */
typedef struct silt_system {
    silt_factor factor;     // owned
    int64_t revision;       // of the mesh that the pattern belongs to
    bool compact;           // neighbours only, not nodes at distance two
} silt_system;

struct silt_pressure {
    silt_system main, stiff;   // S + L or its Laplacian counterpart; L and the mass matrix over the viscosity
    silt_space *space;         // owned, S + L in 3-D
    bool rows;                 // it is that
    int64_t pinned_revision;   // of the mesh that `pinned` belongs to
    int n;
    double *gradient;       // owned, dim per entry, G_ij along the mesh's neighbour lists
    int *mirror;            // owned, index of (j, i) for the entry (i, j)
    int *place;             // owned, (dim + 1)^2 per cell: where (i, j) stands in the neighbour lists
    uint8_t *pinned;        // owned, one per node: the pressure level of a closed piece of water
    double *row;            // owned
    int *mark, *list;       // owned
    int gradient_capacity, mirror_capacity, place_capacity, pinned_capacity, row_capacity, mark_capacity, list_capacity;
};

silt_pressure *silt_pressure_create(void) { return silt_alloc(1, sizeof(silt_pressure)); }

void silt_pressure_forget(silt_pressure *pressure) {
    if (!pressure)
        return;
    silt_factor_clear(&pressure->main.factor);
    silt_factor_clear(&pressure->stiff.factor);
    pressure->main.revision = pressure->stiff.revision = pressure->pinned_revision = -1;
}

void silt_pressure_free(silt_pressure **pressure) {
    if (!*pressure)
        return;
    silt_pressure *p = *pressure;
    silt_pressure_forget(p);
    free(p->gradient);
    free(p->mirror);
    free(p->place);
    free(p->pinned);
    free(p->row);
    silt_space_free(&p->space);
    free(p->mark);
    free(p->list);
    free(p);
    *pressure = NULL;
}

// pieces of water without a free surface, or an opening with a level, know their pressure up to a constant: one node each is pinned
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
    for (int k = 0; k < mesh->n_facet; k++)
        if (mesh->facet_kind[k] == FACET_OPEN)
            p->pinned[silt_group_find(parent, mesh->facet[k][0])] = 0;
    free(parent);
    p->pinned_revision = mesh->revision;
}

// lower triangle of the matrix, by columns: nodes at distance two, or neighbours only
static void pattern_build(silt_pressure *p, silt_system *system, const silt_mesh *mesh, int D, bool compact) {
    const int n = mesh->n_node, n_entry = mesh->neighbour_start[n], m = D + 1;
    SILT_RESERVE(p->row, p->row_capacity, n + 1);
    SILT_RESERVE(p->mark, p->mark_capacity, n + 1);
    SILT_RESERVE(p->list, p->list_capacity, n + 1);
    if (!compact) {
        SILT_RESERVE(p->gradient, p->gradient_capacity, D * n_entry + 1);
        SILT_RESERVE(p->mirror, p->mirror_capacity, n_entry + 1);
        SILT_RESERVE(p->place, p->place_capacity, m * m * mesh->n_cell + 1);
        for (int i = 0; i < n; i++)
            for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1]; k++)
                p->mirror[k] = silt_neighbour_index(mesh, mesh->neighbour[k], i);
        for (int e = 0; e < mesh->n_cell; e++)
            for (int a = 0; a < m; a++)
                for (int b = 0; b < m; b++)
                    p->place[m * m * e + m * a + b] = silt_neighbour_index(mesh, mesh->cell[e][a], mesh->cell[e][b]);
    }

    // count, then fill
    int *start = silt_alloc((size_t)n + 1, sizeof *start);
    for (int pass = 0; pass < 2; pass++) {
        for (int j = 0; j < n; j++)
            p->mark[j] = -1;
        int filled = 0;
        for (int j = 0; j < n; j++) {
            int count = 0;
            for (int k = mesh->neighbour_start[j]; k < mesh->neighbour_start[j + 1]; k++) {
                const int i = mesh->neighbour[k];
                if (compact) {
                    if (i >= j)
                        p->list[count++] = i;
                    continue;
                }
                for (int q = mesh->neighbour_start[i]; q < mesh->neighbour_start[i + 1]; q++) {
                    const int c = mesh->neighbour[q];
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
                memcpy(system->factor.index + filled, p->list, (size_t)count * sizeof(int));
            }
            start[j] = filled;
            filled += count;
        }
        start[n] = filled;
        if (pass == 0)
            memcpy(silt_factor_pattern(&system->factor, n, filled), start, ((size_t)n + 1) * sizeof *start);
    }
    free(start);
    system->compact = compact;
    system->revision = mesh->revision;
}

static void gradient_assemble(silt_pressure *p, const silt_fluid *f, const silt_mesh *mesh) {
    const int D = f->dim, m = D + 1;
    memset(p->gradient, 0, (size_t)(D * mesh->neighbour_start[mesh->n_node]) * sizeof *p->gradient);
    for (int e = 0; e < mesh->n_cell; e++) {
        const double *flux = f->flux + m * D * e;
        for (int a = 0; a < m; a++)
            for (int b = 0; b < m; b++)
                for (int d = 0; d < D; d++)
                    p->gradient[D * p->place[m * m * e + m * a + b] + d] +=
                        flux[D * a + d] / m + (f->share ? f->share[m * e + a] * flux[D * b + d] : 0);
    }
}

// one column of sum_i G_i^T P_i G_i / inertia_i
static void column_consistent(silt_pressure *p, const silt_fluid *f, const silt_mesh *mesh, int j) {
    const int D = f->dim;
    for (int k = mesh->neighbour_start[j]; k < mesh->neighbour_start[j + 1]; k++) {
        const int i = mesh->neighbour[k];
        if (f->hold[i] == HOLD_ALL)
            continue;
        double g[3];
        memcpy(g, p->gradient + D * p->mirror[k], (size_t)D * sizeof(double));
        silt_hold_project(f, i, g);
        for (int d = 0; d < D; d++)
            g[d] /= f->inertia[i];
        for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++)
            for (int d = 0; d < D; d++)
                p->row[mesh->neighbour[m]] += g[d] * p->gradient[D * m + d];
    }
}

// stabilisation, and with `inertial` the Laplacian in place of the consistent operator
static void column_laplacian(silt_pressure *p, const silt_fluid *f, const silt_mesh *mesh, int j, bool inertial) {
    const int D = f->dim;
    for (int k = mesh->node_cell_start[j]; k < mesh->node_cell_start[j + 1]; k++) {
        const int e = mesh->node_cell[k], *cell = mesh->cell[e];
        const double *flux = f->flux + (D + 1) * D * e;
        int a = 0;
        while (cell[a] != j)
            a++;
        double weight = f->tau[e] * f->inverse[e];
        if (inertial) {
            double inertia = 0, volume = 0;
            for (int c = 0; c <= D; c++) {
                inertia += f->inertia[cell[c]];
                volume += f->volume[cell[c]];
            }
            weight += f->inverse[e] * volume / inertia;
        }
        for (int c = 0; c <= D; c++)
            for (int d = 0; d < D; d++)
                p->row[cell[c]] += weight * flux[D * a + d] * flux[D * c + d];
    }
}

static silt_status system_factor(silt_system *system, const silt_fluid *f, const silt_step *s, bool fresh, silt_error *err) {
    bool done;
    if (fresh)
        SILT_CLOCKED(analyse, silt_factor_analyse(&system->factor, FACTOR_DEFINITE, NULL));
    SILT_CLOCKED(factor, done = silt_factor_compute(&system->factor));
    if (done)
        return SILT_OK;
    const double *x = s->nodes->x + f->dim * system->factor.bad;
    system->revision = -1;
    return silt_fail(err, SILT_FAILED, "the pressure matrix is not positive definite near (%g, %g)", x[0], x[1]);
}

// 3/(4 mu) of the lumped mass and the stabilisation: what is left of the pressure's operator when viscosity outweighs inertia
// (3/4: a gradient field meets 4/3 mu of the deviatoric stress)
static silt_status factor_stiff(silt_pressure *p, silt_fluid *f, const silt_step *s, silt_error *err) {
    const silt_mesh *mesh = s->mesh;
    silt_system *system = &p->stiff;
    const bool fresh = system->revision != mesh->revision || !system->factor.inside;
    if (fresh)
        pattern_build(p, system, mesh, f->dim, true);
    double *fluidity = f->scratch;
    memset(fluidity, 0, (size_t)p->n * sizeof(double));
    for (int e = 0; e < mesh->n_cell; e++)
        for (int a = 0; a <= f->dim; a++)
            fluidity[mesh->cell[e][a]] += 0.75 * f->cell_volume[e] / ((f->dim + 1) * f->mu[e]);
    const int *start = system->factor.start, *index = system->factor.index;
    double *value = system->factor.value;
    memset(p->row, 0, (size_t)p->n * sizeof *p->row);
    for (int j = 0; j < p->n; j++) {
        column_laplacian(p, f, mesh, j, false);
        p->row[j] += mesh->wet[j] ? fluidity[j] : 1;
        for (int k = start[j]; k < start[j + 1]; k++)
            value[k] = p->row[index[k]];
        for (int k = mesh->neighbour_start[j]; k < mesh->neighbour_start[j + 1]; k++)
            p->row[mesh->neighbour[k]] = 0;
        p->row[j] = 0;
    }
    return system_factor(system, f, s, fresh, err);
}

// 2-D, and the Laplacian in 3-D
static silt_status factor_main(silt_pressure *p, silt_fluid *f, const silt_step *s, silt_error *err) {
    const silt_mesh *mesh = s->mesh;
    const bool consistent = s->scene->fluid.pressure == PRESSURE_CONSISTENT, compact = !consistent;
    silt_system *system = &p->main;
    const bool fresh = system->revision != mesh->revision || !system->factor.inside || system->compact != compact;
    if (fresh)
        pattern_build(p, system, mesh, f->dim, compact);
    if (!compact)
        gradient_assemble(p, f, mesh);

    const int *start = system->factor.start, *index = system->factor.index;
    double *value = system->factor.value;
    memset(p->row, 0, (size_t)p->n * sizeof *p->row);
    for (int j = 0; j < p->n; j++) {
        if (mesh->wet[j]) {
            if (!compact)
                column_consistent(p, f, mesh, j);
            column_laplacian(p, f, mesh, j, compact);
        }
        double *diagonal = &value[start[j]];
        for (int k = start[j]; k < start[j + 1]; k++)
            value[k] = p->row[index[k]];
        if (!mesh->wet[j])
            *diagonal = 1;
        else
            *diagonal += (p->pinned[j] ? 1 : 1e-9) * *diagonal; // a crumb between held nodes knows its pressure up to a constant too
        if (!consistent && mesh->surface[j]) // pressure increment prescribed on the free surface
            *diagonal += 1e12 * fabs(*diagonal);
        // clear what this column touched
        for (int k = mesh->neighbour_start[j]; k < mesh->neighbour_start[j + 1]; k++) {
            const int i = mesh->neighbour[k];
            p->row[i] = 0;
            for (int m = mesh->neighbour_start[i]; !compact && m < mesh->neighbour_start[i + 1]; m++)
                p->row[mesh->neighbour[m]] = 0;
        }
        p->row[j] = 0;
    }
    return system_factor(system, f, s, fresh, err);
}

silt_status silt_pressure_factor(silt_pressure *p, silt_fluid *f, const silt_step *s, bool stiff, silt_error *err) {
    p->n = s->mesh->n_node;
    if (p->pinned_revision != s->mesh->revision || !p->pinned)
        pin_closed(p, s->mesh);
    p->rows = f->dim == 3 && s->scene->fluid.pressure == PRESSURE_CONSISTENT;
    if (p->rows)
        return silt_space_build(&p->space, f, s, p->pinned, stiff, err);
    SILT_TRY(factor_main(p, f, s, err));
    return stiff ? factor_stiff(p, f, s, err) : SILT_OK;
}

static silt_status factor_solve(silt_system *system, const double *right, double *out, silt_error *err) {
    if (!silt_factor_solve(&system->factor, right, out))
        return silt_fail(err, SILT_FAILED, "the pressure system could not be solved (%d nodes)", system->factor.n);
    return SILT_OK;
}

silt_status silt_pressure_solve(silt_pressure *p, silt_fluid *f, const double *right, double tolerance, double *x, silt_error *err) {
    if (p->rows)
        return silt_space_solve(p->space, right, tolerance, x, &f->pressure_iterations, err);
    return factor_solve(&p->main, right, x, err);
}

silt_status silt_pressure_solve_stiff(silt_pressure *p, const double *right, double *increment, silt_error *err) {
    return p->rows ? silt_space_solve_stiff(p->space, right, increment, err) : factor_solve(&p->stiff, right, increment, err);
}
