// stiff viscosity in two dimensions: momentum and continuity are factored as one system, and the momentum alone for
// its own solver. [A -G; -G^T -L] is symmetric and quasi-definite: every order of elimination has an LDL^T factor
// (Vanderbei, SIAM J. Optim. 5, 1995).
// Node by node, the velocities first, with the order of the nodes that suits their graph.
#include "factor.h"
#include "fluid.h"

/** a symmetric matrix with m unknowns a node and its factor */
typedef struct silt_blocks {
    int m;
    bool ready;               // the factor is that of the present step
    silt_factor factor;       // owned
} silt_blocks;

struct silt_stiff {
    silt_blocks velocity, saddle; // A; with the pressure
    int64_t revision;             // of the mesh that patterns and factors belong to
    int n;
    double *entry;                // owned, (dim + 1)^2 per neighbour
    double *right;                // owned, dim + 1 per node
    int entry_capacity, right_capacity;
};

void silt_stiff_end(silt_stiff *stiff) {
    if (stiff)
        stiff->velocity.ready = stiff->saddle.ready = false;
}

void silt_stiff_forget(silt_stiff *stiff) {
    if (!stiff)
        return;
    silt_factor_clear(&stiff->velocity.factor);
    silt_factor_clear(&stiff->saddle.factor);
    stiff->revision = -1;
    silt_stiff_end(stiff);
}

void silt_stiff_free(silt_stiff **stiff) {
    if (!*stiff)
        return;
    silt_stiff *q = *stiff;
    silt_stiff_forget(q);
    free(q->entry);
    free(q->right);
    free(q);
    *stiff = NULL;
}

bool silt_stiff_ready(const silt_stiff *stiff, bool pressure) {
    return stiff && (pressure ? stiff->saddle.ready : stiff->velocity.ready);
}

// pattern of m unknowns a node, and the order of elimination from that of the nodes
static void pattern(silt_blocks *b, const silt_mesh *mesh, int m, const int *order) {
    const int n = mesh->n_node;
    b->m = m;
    int filled = 0;
    for (int j = 0; j < n; j++)
        for (int k = mesh->neighbour_start[j]; k < mesh->neighbour_start[j + 1]; k++)
            filled += mesh->neighbour[k] > j ? m * m : mesh->neighbour[k] == j ? m * (m + 1) / 2 : 0;
    int *start = silt_factor_pattern(&b->factor, m * n, filled), *index = b->factor.index, at = 0;
    for (int j = 0; j < n; j++)
        for (int c = 0; c < m; c++) {
            start[m * j + c] = at;
            for (int k = mesh->neighbour_start[j]; k < mesh->neighbour_start[j + 1]; k++) {
                const int i = mesh->neighbour[k];
                for (int r = i == j ? c : 0; r < m && i >= j; r++)
                    index[at++] = m * i + r;
            }
        }
    start[m * n] = at;
    int *perm = silt_alloc((size_t)(m * n) + 1, sizeof *perm);
    for (int k = 0; k < n; k++)
        for (int c = 0; c < m; c++)
            perm[m * k + c] = m * order[k] + c;
    SILT_CLOCKED(analyse, silt_factor_analyse(&b->factor, m == 2 ? FACTOR_DEFINITE : FACTOR_QUASI_DEFINITE, perm));
    free(perm);
}

// order of the nodes by minimum degree
static int *node_order(const silt_mesh *mesh) {
    const int n = mesh->n_node;
    int *start = silt_alloc((size_t)n + 1, sizeof *start), *index = silt_alloc((size_t)mesh->neighbour_start[n] + 1, sizeof *index);
    silt_mesh_lower(mesh, start, index);
    int *order;
    SILT_CLOCKED(analyse, order = silt_factor_order(n, start, index));
    free(start);
    free(index);
    return order;
}

// [K -G; -G^T -L] of every pair of neighbours, without inertia and without regard to what is held
static void assemble(silt_stiff *q, const silt_fluid *f, const silt_mesh *mesh) {
    enum { D = 2, M = 3 };
    memset(q->entry, 0, (size_t)(M * M * mesh->neighbour_start[mesh->n_node]) * sizeof *q->entry);
    for (int e = 0; e < mesh->n_cell; e++) {
        const int *cell = mesh->cell[e];
        const double *flux = f->flux + M * D * e;
        const double viscous = f->mu[e] * f->inverse[e], smooth = f->tau[e] * f->inverse[e];
        for (int a = 0; a < M; a++)
            for (int b = 0; b < M; b++) {
                double *out = q->entry + M * M * silt_neighbour_index(mesh, cell[a], cell[b]);
                const double *fa = flux + D * a, *fb = flux + D * b, along = fa[0] * fb[0] + fa[1] * fb[1];
                for (int d = 0; d < D; d++) {
                    for (int k = 0; k < D; k++)
                        out[M * d + k] += viscous * ((d == k ? along : 0) + fb[d] * fa[k] - 2.0 / 3 * fa[d] * fb[k]);
                    out[M * d + D] -= fa[d] / M + (f->share ? f->share[M * e + a] * fb[d] : 0);
                    out[M * D + d] -= fb[d] / M + (f->share ? f->share[M * e + b] * fa[d] : 0);
                }
                out[M * D + D] -= smooth * along;
            }
    }
}

// inertia on the diagonal; held components taken out
static void hold(silt_stiff *q, const silt_fluid *f, const silt_mesh *mesh, const uint8_t *closed) {
    enum { D = 2, M = 3 };
    for (int i = 0; i < q->n; i++) {
        double own = 0;
        for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1]; k++) {
            const int j = mesh->neighbour[k];
            double *out = q->entry + M * M * k;
            if (i == j) {
                own = f->inertia[i] + 0.5 * (out[0] + out[M + 1]);
                for (int d = 0; d < D; d++)
                    out[M * d + d] += f->inertia[i];
                // a crumb between held nodes knows its pressure up to a constant too
                out[M * D + D] *= closed[i] ? 2 : 1 + 1e-9;
                if (!mesh->wet[i] || !(out[M * D + D] < 0))
                    out[M * D + D] = -1;
            }
            if (f->hold[i] != HOLD_FREE)
                for (int c = 0; c < M; c++) { // columns: velocity of row i
                    double column[3] = {out[c], out[M + c], 0};
                    silt_hold_project(f, i, column);
                    out[c] = column[0];
                    out[M + c] = column[1];
                }
            if (f->hold[j] != HOLD_FREE)
                for (int r = 0; r < M; r++)
                    silt_hold_project(f, j, out + M * r);
            if (i == j && f->hold[i] != HOLD_FREE)
                for (int d = 0; d < D; d++) {
                    double unit[3] = {d == 0, d == 1, 0}, free_part[3] = {unit[0], unit[1], 0};
                    silt_hold_project(f, i, free_part);
                    for (int k2 = 0; k2 < D; k2++)
                        out[M * k2 + d] += own * (unit[k2] - free_part[k2]);
                }
        }
    }
}

static void fill(const silt_stiff *q, silt_blocks *b, const silt_mesh *mesh) {
    const int m = b->m;
    double *value = b->factor.value;
    int at = 0;
    for (int j = 0; j < q->n; j++)
        for (int c = 0; c < m; c++)
            for (int k = mesh->neighbour_start[j]; k < mesh->neighbour_start[j + 1]; k++) {
                const int i = mesh->neighbour[k];
                for (int r = i == j ? c : 0; r < m && i >= j; r++)
                    value[at++] = q->entry[9 * k + 3 * c + r]; // block (j, i) is block (i, j) turned over
            }
}

silt_status silt_stiff_factor(silt_stiff **stiff, silt_fluid *f, const silt_step *s, bool pressure,
                              silt_error *err) {
    const silt_mesh *mesh = s->mesh;
    if (!*stiff) {
        *stiff = silt_alloc(1, sizeof **stiff);
        (*stiff)->revision = -1;
    }
    silt_stiff *q = *stiff;
    silt_blocks *b = pressure ? &q->saddle : &q->velocity;
    b->ready = false;
    q->n = mesh->n_node;
    SILT_RESERVE(q->entry, q->entry_capacity, 9 * mesh->neighbour_start[q->n] + 1);
    SILT_RESERVE(q->right, q->right_capacity, 3 * q->n + 1);
    if (q->revision != mesh->revision || !q->velocity.factor.inside) {
        int *order = node_order(mesh);
        pattern(&q->velocity, mesh, 2, order);
        pattern(&q->saddle, mesh, 3, order);
        free(order);
        q->revision = mesh->revision;
    }
    assemble(q, f, mesh);
    hold(q, f, mesh, silt_closed_pieces(f, mesh));
    fill(q, b, mesh);
    bool done;
    SILT_CLOCKED(factor, done = silt_factor_compute(&b->factor));
    if (!done) {
        q->revision = -1;
        return silt_fail(err, SILT_FAILED, "the %s matrix of the stiff water could not be factored",
                         pressure ? "saddle-point" : "momentum");
    }
    b->ready = true;
    return SILT_OK;
}

static silt_status solve(silt_blocks *b, double *right, silt_error *err) {
    if (!silt_factor_solve(&b->factor, right, right))
        return silt_fail(err, SILT_FAILED, "the stiff water's system could not be solved (%d unknowns)", b->factor.n);
    return SILT_OK;
}

silt_status silt_stiff_momentum(silt_stiff *q, const silt_fluid *f, const double *right, double *out, silt_error *err) {
    memcpy(out, right, (size_t)(2 * q->n) * sizeof *out);
    SILT_TRY(solve(&q->velocity, out, err));
    for (int i = 0; i < q->n; i++)
        silt_hold_project(f, i, out + 2 * i);
    return SILT_OK;
}

silt_status silt_stiff_correct(silt_stiff *q, const silt_fluid *f, const double *right, double *increment, double *v,
                               silt_error *err) {
    for (int i = 0; i < q->n; i++) {
        q->right[3 * i] = q->right[3 * i + 1] = 0;
        q->right[3 * i + 2] = -right[i];
    }
    SILT_TRY(solve(&q->saddle, q->right, err));
    for (int i = 0; i < q->n; i++) {
        double dv[3] = {q->right[3 * i], q->right[3 * i + 1], 0};
        silt_hold_project(f, i, dv);
        v[2 * i] += dv[0];
        v[2 * i + 1] += dv[1];
        increment[i] = q->right[3 * i + 2];
    }
    return SILT_OK;
}
