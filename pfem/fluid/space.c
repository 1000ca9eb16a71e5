// The pressure system in 3-D. (S + L) x = N^T N x + L x + extra x with N_ij = P_i G_ij / sqrt(inertia_i), held along
// the mesh's neighbour lists in single precision. Both parts act on differences x_j - x_i, so that a constant passes
// exactly, and N besides on x_i by its row sum, which is nought but on the boundary: whatever is rounded, the operator
// stays symmetric and positive semi-definite. Single precision bounds the accuracy of the increment, not that of the
// step's iteration.
#include "space.h"
#include "coarse.h"
#include "parallel.h"

#define CG_LIMIT    400
#define SPACE_STIFF 1e-3 // of the viscous part of an increment, which others mend
#define SPACE_GIVEN 1e8  // times the diagonal: a pressure that is given gets no increment
#define SPACE_LIGHT 1e-6 // of a usual diagonal: a row of less has nothing but cells of rounding

typedef float four __attribute__((vector_size(16))); // N_ij and L_ij of a node and its neighbour

struct silt_space {
    int n;
    const silt_mesh *mesh; // borrowed, whose neighbour lists these are
    four *entry;           // owned, along the mesh's neighbour lists, 0 for the node itself
    four *sum;             // owned, per node: of N along its row
    double *compact;       // owned, the same way, the preconditioner's matrix
    double *stiff;         // owned, the same way, L and what stands for viscosity; only where that is stiff
    double *extra;         // owned, per node: what pins closed water, on the diagonal
    double size;           // m, of the scene's cells
    double *weight;        // owned, per cell: of L, and of L and S's Laplacian
    int *place;            // owned, per part and node: where it stands among the neighbours of the node at hand
    double *r, *ad;        // owned, per node, of conjugate gradients
    float *d;              // owned, the same: whatever is rounded in a direction, x and r go along the same one
    silt_coarse *coarse, *coarse_stiff; // owned
    int n_part, row[PARALLEL_MOST + 1]; // parts of the rows, one a thread, and where they begin
    uint8_t *border;       // owned, per row: it gives to a node of an earlier part (that of the first row that gives to it)
    double *aside;         // owned, along the neighbour lists and after each a place more: what is given to such
    int stiff_capacity, entry_capacity, sum_capacity, compact_capacity, extra_capacity, weight_capacity, place_capacity,
        r_capacity, ad_capacity, d_capacity, border_capacity, aside_capacity;
};

void silt_space_free(silt_space **space) {
    if (!*space)
        return;
    silt_space *q = *space;
    free(q->entry);
    free(q->compact);
    free(q->stiff);
    free(q->extra);
    free(q->weight);
    free(q->place);
    free(q->sum);
    free(q->r);
    free(q->ad);
    free(q->d);
    free(q->border);
    free(q->aside);
    silt_coarse_free(&q->coarse);
    silt_coarse_free(&q->coarse_stiff);
    free(q);
    *space = NULL;
}

static void weigh_cells(silt_space *q, const silt_fluid *f, const silt_mesh *mesh) {
    SILT_PARALLEL(mesh->n_cell)
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

// What cell e's corners can do for a pressure gradient `own` in it: walls take their share. Without that the compact matrix
// of thin cells on walls is far stiffer than S, and conjugate gradients crawl
static void mobility(const silt_fluid *f, const silt_mesh *mesh, int e, const double *own, double out[3]) {
    out[0] = out[1] = out[2] = 0;
    for (int c = 0; c < 4; c++) {
        const int i = mesh->cell[e][c];
        double free[3] = {own[0], own[1], own[2]};
        silt_hold_project(f, i, free);
        for (int d = 0; d < 3; d++)
            out[d] += 0.25 * f->inverse[e] * f->volume[i] / f->inertia[i] * free[d];
    }
}

// one row of G, L and the compact Laplacian, from the cells of the node
static void row_gather(const silt_space *q, const silt_fluid *f, const silt_mesh *mesh, int i, const int *place, double (*row)[4],
                       double *compact) {
    for (int k = mesh->node_cell_start[i]; k < mesh->node_cell_start[i + 1]; k++) {
        const int e = mesh->node_cell[k], *cell = mesh->cell[e];
        const double *flux = f->flux + 12 * e;
        int a = 0;
        while (cell[a] != i)
            a++;
        const double *own = flux + 3 * a, share = f->share ? f->share[4 * e + a] : 0;
        double moved[3];
        const bool held = f->hold[cell[0]] || f->hold[cell[1]] || f->hold[cell[2]] || f->hold[cell[3]];
        if (held)
            mobility(f, mesh, e, own, moved);
        for (int c = 0; c < 4; c++) {
            const int at = place[cell[c]];
            const double *other = flux + 3 * c, along = own[0] * other[0] + own[1] * other[1] + own[2] * other[2];
            for (int d = 0; d < 3; d++)
                row[at][d] += 0.25 * own[d] + share * other[d];
            row[at][3] += q->weight[2 * e] * along;
            compact[at] += held ? q->weight[2 * e] * along + silt_dot(3, moved, other) : q->weight[2 * e + 1] * along;
        }
    }
}

// Openings with a level give their pressure as the surface does: G carries a constant pressure to nodes on the boundary
// only, which is how the compact matrix knows of the free surface
static void mark_given(const silt_mesh *mesh, uint8_t *given) {
    memcpy(given, mesh->surface, (size_t)mesh->n_node);
    for (int k = 0; k < mesh->n_facet; k++)
        for (int a = 0; a < 3 && mesh->facet_kind[k] == FACET_OPEN; a++)
            given[mesh->facet[k][a]] = 1;
}

// 3/(4 mu) of the lumped mass: what is left of S when viscosity outweighs inertia (a gradient field meets 4/3 mu of the
// deviatoric stress)
static double fluidity(const silt_fluid *f, const silt_mesh *mesh, int i) {
    double sum = 0;
    for (int k = mesh->node_cell_start[i]; k < mesh->node_cell_start[i + 1]; k++)
        sum += 0.75 * f->cell_volume[mesh->node_cell[k]] / (4 * f->mu[mesh->node_cell[k]]);
    return mesh->wet[i] ? sum : 1;
}

// where rows of a part give to nodes of earlier ones
static inline bool given_late(const silt_mesh *mesh, int first, int node) { return mesh->neighbour[mesh->neighbour_start[node]] < first; }

static void rows_of_part(silt_space *q, const silt_fluid *f, const silt_mesh *mesh, const uint8_t *pinned, const uint8_t *given, bool stiff,
                         int part) {
    double(*row)[4] = NULL;
    int row_capacity = 0, *place = q->place + (size_t)part * (size_t)q->n;
    for (int i = q->row[part]; i < q->row[part + 1]; i++) {
        const int first = mesh->neighbour_start[i], count = mesh->neighbour_start[i + 1] - first;
        double *compact = q->compact + first, sum[3] = {0};
        int self = 0;
        bool late = false;
        SILT_RESERVE(row, row_capacity, count);
        memset(row, 0, (size_t)count * sizeof *row);
        memset(compact, 0, (size_t)count * sizeof *compact);
        for (int k = 0; k < count; k++) {
            const int j = mesh->neighbour[first + k];
            place[j] = k;
            self = j == i ? k : self;
            late |= part && given_late(mesh, q->row[part], j);
        }
        q->border[i] = late;
        row_gather(q, f, mesh, i, place, row, compact);
        const double scale = f->hold[i] == HOLD_ALL || !mesh->wet[i] ? 0 : 1 / sqrt(f->inertia[i]);
        for (int k = 0; k < count; k++) {
            silt_hold_project(f, i, row[k]);
            for (int d = 0; d < 3; d++)
                sum[d] += row[k][d] *= scale;
            q->entry[first + k] = (four){(float)row[k][0], (float)row[k][1], (float)row[k][2], (float)row[k][3]};
        }
        for (int k = 0; k < count && stiff; k++)
            q->stiff[first + k] = row[k][3] + (k == self ? fluidity(f, mesh, i) : 0);
        q->entry[first + self] = (four){0};
        q->sum[i] = (four){(float)sum[0], (float)sum[1], (float)sum[2], 0};
        if (given[i])
            compact[self] += silt_dot(3, sum, sum);
        // a crumb between held nodes knows its pressure up to a constant too
        q->extra[i] = mesh->wet[i] ? (pinned[i] ? 1 : 1e-9) * compact[self] : 1;
        if (f->mobile[i] == MOBILE_SPRAY)
            q->extra[i] = SPACE_GIVEN * compact[self];
        // beside a node that has slid into another one: its pressure would be rounding over rounding
        const double usual = mesh->wet[i] ? f->tau[mesh->node_cell[mesh->node_cell_start[i]]] * q->size : 0;
        if (mesh->wet[i] && !(compact[self] > SPACE_LIGHT * usual))
            q->extra[i] = usual;
        compact[self] += q->extra[i];
        if (stiff && f->mobile[i] == MOBILE_SPRAY)
            q->stiff[first + self] *= SPACE_GIVEN;
        // the preconditioner knows nothing of pressures that are given, or aggregates with one of them would stand still
        for (int k = 0; k < count; k++)
            if (k != self && (f->mobile[i] == MOBILE_SPRAY || f->mobile[mesh->neighbour[first + k]] == MOBILE_SPRAY))
                compact[k] = 0;
    }
    free(row);
}

static void rows_build(silt_space *q, const silt_fluid *f, const silt_mesh *mesh, const uint8_t *pinned, bool stiff) {
    uint8_t *given = silt_alloc((size_t)q->n + 1, 1);
    mark_given(mesh, given);
    weigh_cells(q, f, mesh);
    SILT_PARALLEL(q->n)
    for (int part = 0; part < q->n_part; part++)
        rows_of_part(q, f, mesh, pinned, given, stiff, part);
    free(given);
}

silt_status silt_space_build(silt_space **space, const silt_fluid *f, const silt_step *s, const uint8_t *pinned,
                             bool stiff, silt_error *err) {
    if (!*space)
        *space = silt_alloc(1, sizeof **space);
    silt_space *q = *space;
    const silt_mesh *mesh = s->mesh;
    q->n = mesh->n_node;
    q->mesh = mesh;
    const int filled = mesh->neighbour_start[q->n];
    SILT_RESERVE(q->entry, q->entry_capacity, filled + 1);
    SILT_RESERVE(q->compact, q->compact_capacity, filled + 1);
    if (stiff)
        SILT_RESERVE(q->stiff, q->stiff_capacity, filled + 1);
    SILT_RESERVE(q->extra, q->extra_capacity, q->n + 1);
    SILT_RESERVE(q->weight, q->weight_capacity, 2 * mesh->n_cell + 1);
    q->n_part = silt_threads(q->n);
    for (int part = 0; part <= q->n_part; part++) // chunks, which the curvature is summed by, are not cut
        q->row[part] = silt_chunk_first(q->n, silt_chunks(q->n) * part / q->n_part);
    SILT_RESERVE(q->border, q->border_capacity, q->n + 1);
    if (q->n_part > 1)
        SILT_RESERVE(q->aside, q->aside_capacity, filled + q->n + 1);
    SILT_RESERVE(q->place, q->place_capacity, q->n_part * q->n + 1);
    SILT_RESERVE(q->sum, q->sum_capacity, q->n + 1);
    SILT_RESERVE(q->r, q->r_capacity, q->n + 1);
    SILT_RESERVE(q->ad, q->ad_capacity, q->n + 1);
    SILT_RESERVE(q->d, q->d_capacity, q->n + 1);
    q->size = s->scene->fluid.size;
    rows_build(q, f, mesh, pinned, stiff);
    const int *start = mesh->neighbour_start, *index = mesh->neighbour;
    bool done;
    SILT_CLOCKED(factor, done = silt_coarse_build(&q->coarse, q->n, start, index, q->compact) &&
                                (!stiff || silt_coarse_build(&q->coarse_stiff, q->n, start, index, q->stiff)));
    return done ? SILT_OK
                : silt_fail(err, SILT_FAILED, "the pressure matrix is not positive definite (%d nodes)", q->n);
}

// what row i of the operator gives: to its neighbours as it goes, the border's aside. @return x_i times the row's share
static inline __attribute__((always_inline)) double row_apply(const silt_space *q, const float *x, double *out, int i, int late_before) {
    const silt_mesh *mesh = q->mesh;
    const int first = mesh->neighbour_start[i], last = mesh->neighbour_start[i + 1];
    double *aside = q->aside + first + i;
    const float own = x[i];
    four u = q->sum[i] * own;
    for (int k = first; k < last; k++)
        u += q->entry[k] * (x[mesh->neighbour[k]] - own);
    const float l = u[3];
    u[3] = 0;
    double mine = l;
    for (int k = first; k < last; k++) {
        const four t = q->entry[k] * u;
        const double give = t[0] + t[1] + t[2];
        const int j = mesh->neighbour[k];
        if (late_before && given_late(mesh, late_before, j))
            aside[k - first] = give;
        else
            out[j] += give;
        mine -= give;
    }
    const four t = q->sum[i] * u, square = u * u;
    mine += t[0] + t[1] + t[2];
    if (late_before && given_late(mesh, late_before, i))
        aside[last - first] = mine;
    else
        out[i] += mine;
    return (double)(square[0] + square[1] + square[2]) + (double)own * (l + q->extra[i] * own);
}

// adds what a border row has put aside, in the order in which it was given
static void row_finish(const silt_space *q, double *out, int i, int late_before) {
    const silt_mesh *mesh = q->mesh;
    const int first = mesh->neighbour_start[i], last = mesh->neighbour_start[i + 1];
    const double *aside = q->aside + first + i;
    for (int k = first; k < last; k++)
        if (given_late(mesh, late_before, mesh->neighbour[k]))
            out[mesh->neighbour[k]] += aside[k - first];
    if (given_late(mesh, late_before, i))
        out[i] += aside[last - first];
}

// out = (S + L) x, a row's entries from memory once. @return x . out
static double operator_apply(const silt_space *q, const float *x, double *out) {
    const int n = q->n, n_chunk = silt_chunks(n);
    double curvature[CHUNK_MOST];
    SILT_PARALLEL(n)
    for (int i = 0; i < n; i++)
        out[i] = q->extra[i] * x[i];
    SILT_PRAGMA(omp parallel for schedule(static) num_threads(q->n_part))
    for (int part = 0; part < q->n_part; part++)
        for (int c = n_chunk * part / q->n_part; c < n_chunk * (part + 1) / q->n_part; c++) {
            double sum = 0;
            for (int i = silt_chunk_first(n, c); i < silt_chunk_first(n, c + 1); i++)
                sum += part && q->border[i] ? row_apply(q, x, out, i, q->row[part]) : row_apply(q, x, out, i, 0);
            curvature[c] = sum;
        }
    for (int part = 1; part < q->n_part; part++)
        for (int i = q->row[part]; i < q->row[part + 1]; i++)
            if (q->border[i])
                row_finish(q, out, i, q->row[part]);
    return silt_total(n_chunk, curvature);
}

static double stiff_apply(const silt_space *q, const float *x, double *out) {
    double curvature[CHUNK_MOST];
    const int n = q->n;
    SILT_PARALLEL(n)
    for (int c = 0; c < silt_chunks(n); c++) {
        curvature[c] = 0;
        for (int i = silt_chunk_first(n, c); i < silt_chunk_first(n, c + 1); i++) {
            double sum = 0;
            for (int k = q->mesh->neighbour_start[i]; k < q->mesh->neighbour_start[i + 1]; k++)
                sum += q->stiff[k] * x[q->mesh->neighbour[k]];
            out[i] = sum;
            curvature[c] += x[i] * sum;
        }
    }
    return silt_total(silt_chunks(n), curvature);
}

static double dot(int n, const double *a, const float *b) {
    double part[CHUNK_MOST];
    SILT_PARALLEL(n)
    for (int c = 0; c < silt_chunks(n); c++) {
        double sum = 0;
        for (int i = silt_chunk_first(n, c); i < silt_chunk_first(n, c + 1); i++)
            sum += a[i] * b[i];
        part[c] = sum;
    }
    return silt_total(silt_chunks(n), part);
}

// scale to be taken out of a right side so that single precision can hold what follows
static double largest(int n, const double *a) {
    double most = 0;
    for (int i = 0; i < n; i++)
        most = silt_max(most, fabs(a[i]));
    return most > 0 ? most : 1;
}

/** out = matrix x. @return x . out */
typedef double (*matrix)(const silt_space *q, const float *x, double *out);

static silt_status iterate(silt_space *q, matrix apply, silt_coarse *coarse, const double *right, double tolerance,
                           double *x, int *iterations, silt_error *err) {
    const int n = q->n;
    const double scale = largest(n, right);
    double *r = q->r, *ad = q->ad, before = 0, target = 0;
    float *d = q->d, *copy = silt_coarse_right(coarse);
    for (int i = 0; i < n; i++) {
        r[i] = right[i] / scale;
        copy[i] = (float)r[i];
        x[i] = d[i] = 0;
    }
    for (int k = 0;; k++) {
        const float *z = silt_coarse_cycle(coarse);
        if (!z)
            return silt_fail(err, SILT_FAILED, "the pressure system could not be solved (%d nodes)", n);
        const double rz = dot(n, r, z);
        if (rz < 0)
            return silt_fail(err, SILT_FAILED, "the pressure matrix is not positive definite (%d nodes)", n);
        if (k == 0)
            target = silt_square(tolerance) * rz;
        if (!(rz > target))
            return SILT_OK;
        if (k == CG_LIMIT)
            return silt_fail(err, SILT_FAILED, "the pressure system did not converge in %d iterations (%d nodes)",
                             CG_LIMIT, n);
        const float beta = k ? (float)(rz / before) : 0;
        SILT_PARALLEL(n)
        for (int i = 0; i < n; i++)
            d[i] = z[i] + beta * d[i];
        double curvature;
        SILT_CLOCKED(apply, curvature = apply(q, d, ad));
        if (!(curvature > 0))
            return silt_fail(err, SILT_FAILED, "the pressure operator is not positive definite (%d nodes)", n);
        const double alpha = rz / curvature;
        SILT_PARALLEL(n)
        for (int i = 0; i < n; i++) {
            x[i] += scale * alpha * d[i];
            r[i] -= alpha * ad[i];
            copy[i] = (float)r[i];
        }
        before = rz;
        ++*iterations;
    }
}

silt_status silt_space_solve(silt_space *q, const double *right, double tolerance, double *x, int *iterations,
                             silt_error *err) {
    return iterate(q, operator_apply, q->coarse, right, tolerance, x, iterations, err);
}

silt_status silt_space_solve_stiff(silt_space *q, const double *right, double *x, silt_error *err) {
    int iterations = 0;
    return iterate(q, stiff_apply, q->coarse_stiff, right, SPACE_STIFF, x, &iterations, err);
}
