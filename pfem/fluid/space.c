// The pressure system in 3-D. (S + L) x = N^T N x + L x + extra x with N_ij = P_i G_ij / sqrt(inertia_i), held along the
// mesh's neighbour lists in single precision. Both parts act on differences x_j - x_i, so that a constant passes exactly, and N
// besides on x_i by its row sum, which is nought but on the boundary: whatever is rounded, the operator stays symmetric and
// positive semi-definite. Single precision bounds the accuracy of the increment, not that of the step's iteration.
#include "space.h"
#include "coarse.h"

#define CG_LIMIT 400

/** of a node and its neighbour: N_ij, L_ij; of a node and itself: the row's sum of N, 0 */
typedef struct space_entry {
    float n[3], l;
} space_entry;

struct silt_space {
    int n;
    space_entry *entry;         // owned, along the mesh's neighbour lists
    double *compact;            // owned, the same way, the preconditioner's matrix
    double *extra;              // owned, per node: what pins closed water, on the diagonal
    double *weight;             // owned, per cell: of L, and of L and S's Laplacian
    int *place;                 // owned, per node: where it stands among the neighbours of the node at hand
    double *cg[4];              // owned, per node
    silt_coarse *coarse;        // owned
    int entry_capacity, compact_capacity, extra_capacity, weight_capacity, place_capacity, cg_capacity[4];
};

void silt_space_free(silt_space **space) {
    if (!*space)
        return;
    silt_space *q = *space;
    free(q->entry);
    free(q->compact);
    free(q->extra);
    free(q->weight);
    free(q->place);
    for (int k = 0; k < 4; k++)
        free(q->cg[k]);
    silt_coarse_free(&q->coarse);
    free(q);
    *space = NULL;
}

static void weigh_cells(silt_space *q, const silt_fluid *f, const silt_mesh *mesh) {
    for (int e = 0; e < mesh->n_cell; e++) {
        double inertia = 0, volume = 0;
        for (int c = 0; c < 4; c++) {
            inertia += f->inertia[mesh->cell[e][c]];
            volume += f->volume[mesh->cell[e][c]];
        }
        q->weight[2 * e] = f->tau[e] * f->inverse[e];
        q->weight[2 * e + 1] = q->weight[2 * e] + f->inverse[e] * volume / inertia;
    }
}

// one row of G, L and the compact Laplacian, from the cells of the node
static void row_gather(const silt_space *q, const silt_fluid *f, const silt_mesh *mesh, int i, double (*row)[4], double *compact) {
    for (int k = mesh->node_cell_start[i]; k < mesh->node_cell_start[i + 1]; k++) {
        const int e = mesh->node_cell[k], *cell = mesh->cell[e];
        const double *flux = f->flux + 12 * e;
        int a = 0;
        while (cell[a] != i)
            a++;
        const double *own = flux + 3 * a, share = f->share ? f->share[4 * e + a] : 0;
        for (int c = 0; c < 4; c++) {
            const int at = q->place[cell[c]];
            const double *other = flux + 3 * c, along = own[0] * other[0] + own[1] * other[1] + own[2] * other[2];
            for (int d = 0; d < 3; d++)
                row[at][d] += 0.25 * own[d] + share * other[d];
            row[at][3] += q->weight[2 * e] * along;
            compact[at] += q->weight[2 * e + 1] * along;
        }
    }
}

// Openings with a level give their pressure as the surface does: G carries a constant pressure to nodes on the boundary only, which
// is how the compact matrix knows of the free surface
static void mark_given(const silt_mesh *mesh, uint8_t *given) {
    memcpy(given, mesh->surface, (size_t)mesh->n_node);
    for (int k = 0; k < mesh->n_facet; k++)
        for (int a = 0; a < 3 && mesh->facet_kind[k] == FACET_OPEN; a++)
            given[mesh->facet[k][a]] = 1;
}

static void rows_build(silt_space *q, const silt_fluid *f, const silt_mesh *mesh, const uint8_t *pinned) {
    uint8_t *given = silt_alloc((size_t)q->n + 1, 1);
    double(*row)[4] = NULL;
    int row_capacity = 0;
    mark_given(mesh, given);
    weigh_cells(q, f, mesh);
    for (int i = 0; i < q->n; i++) {
        const int first = mesh->neighbour_start[i], count = mesh->neighbour_start[i + 1] - first;
        double *compact = q->compact + first, sum[3] = {0};
        int self = 0;
        SILT_RESERVE(row, row_capacity, count);
        memset(row, 0, (size_t)count * sizeof *row);
        memset(compact, 0, (size_t)count * sizeof *compact);
        for (int k = 0; k < count; k++) {
            q->place[mesh->neighbour[first + k]] = k;
            self = mesh->neighbour[first + k] == i ? k : self;
        }
        row_gather(q, f, mesh, i, row, compact);
        const double scale = f->hold[i] == HOLD_ALL || !mesh->wet[i] ? 0 : 1 / sqrt(f->inertia[i]);
        for (int k = 0; k < count; k++) {
            silt_hold_project(f, i, row[k]);
            for (int d = 0; d < 3; d++)
                sum[d] += row[k][d] *= scale;
            q->entry[first + k] = (space_entry){{(float)row[k][0], (float)row[k][1], (float)row[k][2]}, (float)row[k][3]};
        }
        q->entry[first + self] = (space_entry){{(float)sum[0], (float)sum[1], (float)sum[2]}, 0};
        if (given[i])
            compact[self] += silt_dot(3, sum, sum);
        // a crumb between held nodes knows its pressure up to a constant too
        q->extra[i] = mesh->wet[i] ? (pinned[i] ? 1 : 1e-9) * compact[self] : 1;
        compact[self] += q->extra[i];
    }
    free(row);
    free(given);
}

silt_status silt_space_build(silt_space **space, const silt_fluid *f, const silt_step *s, const uint8_t *pinned, silt_error *err) {
    if (!*space)
        *space = silt_alloc(1, sizeof **space);
    silt_space *q = *space;
    const silt_mesh *mesh = s->mesh;
    q->n = mesh->n_node;
    const int filled = mesh->neighbour_start[q->n];
    SILT_RESERVE(q->entry, q->entry_capacity, filled + 1);
    SILT_RESERVE(q->compact, q->compact_capacity, filled + 1);
    SILT_RESERVE(q->extra, q->extra_capacity, q->n + 1);
    SILT_RESERVE(q->weight, q->weight_capacity, 2 * mesh->n_cell + 1);
    SILT_RESERVE(q->place, q->place_capacity, q->n + 1);
    for (int k = 0; k < 4; k++)
        SILT_RESERVE(q->cg[k], q->cg_capacity[k], q->n + 1);
    rows_build(q, f, mesh, pinned);
    bool done;
    SILT_CLOCKED(factor, done = silt_coarse_build(&q->coarse, q->n, mesh->neighbour_start, mesh->neighbour, q->compact));
    return done ? SILT_OK : silt_fail(err, SILT_FAILED, "the pressure matrix is not positive definite (%d nodes)", q->n);
}

// out = (S + L) x, a row's entries from memory once
static void operator_apply(const silt_space *q, const silt_mesh *mesh, const double *x, double *out) {
    for (int i = 0; i < q->n; i++)
        out[i] = q->extra[i] * x[i];
    for (int i = 0; i < q->n; i++) {
        const int first = mesh->neighbour_start[i], last = mesh->neighbour_start[i + 1];
        const double own = x[i];
        float u[3] = {0}, l = 0;
        for (int k = first; k < last; k++) {
            const int j = mesh->neighbour[k];
            const float change = (float)(j == i ? own : x[j] - own);
            for (int d = 0; d < 3; d++)
                u[d] += q->entry[k].n[d] * change;
            l += q->entry[k].l * change;
        }
        double mine = l;
        for (int k = first; k < last; k++) {
            const int j = mesh->neighbour[k];
            const double t = q->entry[k].n[0] * u[0] + q->entry[k].n[1] * u[1] + q->entry[k].n[2] * u[2];
            out[j] += t;
            mine -= j == i ? 0 : t;
        }
        out[i] += mine;
    }
}

static double dot(int n, const double *a, const double *b) {
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

static silt_status precondition(silt_space *q, const double *r, double *z, silt_error *err) {
    if (!silt_coarse_apply(q->coarse, r, z))
        return silt_fail(err, SILT_FAILED, "the pressure system could not be solved (%d nodes)", q->n);
    return SILT_OK;
}

silt_status silt_space_solve(silt_space *q, silt_fluid *f, const silt_mesh *mesh, const double *right, double tolerance, double *x,
                             silt_error *err) {
    const int n = q->n;
    double *r = q->cg[0], *z = q->cg[1], *d = q->cg[2], *ad = q->cg[3];
    memcpy(r, right, (size_t)n * sizeof *r);
    memset(x, 0, (size_t)n * sizeof *x);
    SILT_TRY(precondition(q, r, z, err));
    memcpy(d, z, (size_t)n * sizeof *d);
    double rz = dot(n, r, z);
    const double target = silt_square(tolerance) * rz;
    for (int k = 0; rz > target && rz > 0; k++) {
        if (k == CG_LIMIT)
            return silt_fail(err, SILT_FAILED, "the pressure system did not converge in %d iterations (%d nodes)", CG_LIMIT, n);
        SILT_CLOCKED(apply, operator_apply(q, mesh, d, ad));
        const double curvature = dot(n, d, ad);
        if (!(curvature > 0))
            return silt_fail(err, SILT_FAILED, "the pressure operator is not positive definite (%d nodes)", n);
        const double alpha = rz / curvature;
        for (int i = 0; i < n; i++) {
            x[i] += alpha * d[i];
            r[i] -= alpha * ad[i];
        }
        SILT_TRY(precondition(q, r, z, err));
        const double fresh = dot(n, r, z), beta = fresh / rz;
        for (int i = 0; i < n; i++)
            d[i] = z[i] + beta * d[i];
        rz = fresh;
        f->pressure_iterations++;
    }
    return SILT_OK;
}
