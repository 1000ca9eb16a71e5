// stiff viscosity in two dimensions: the momentum, and momentum and continuity as one system, factored front by front. [A -G; -G^T -L]
// is symmetric and quasi-definite.
#include "fluid.h"
#include "front.h"
#include "parallel.h"

/** a symmetric matrix with two or three unknowns a node and its factor */
typedef struct silt_blocks {
    bool ready;               // the factor is one of the present step
    int64_t revision;         // of the mesh that the order belongs to
    silt_front *front;        // owned
    silt_front_matrix matrix;
    float *pair, *whole;      // owned, see silt_front_matrix
    int pair_capacity, whole_capacity;
} silt_blocks;

struct silt_stiff {
    silt_blocks velocity, saddle; // A; with the pressure
    double *row;                  // owned, of the present node
    int *place;                   // owned, per node: where it is in the present node's list
    double *right;                // owned, dim + 1 per node
    int row_capacity, place_capacity, right_capacity;
};

void silt_stiff_end(silt_stiff *stiff) {
    if (stiff)
        stiff->velocity.ready = stiff->saddle.ready = false;
}

void silt_stiff_forget(silt_stiff *stiff) {
    if (!stiff)
        return;
    stiff->velocity.revision = stiff->saddle.revision = -1;
    silt_stiff_end(stiff);
}

static void blocks_free(silt_blocks *b) {
    silt_front_free(&b->front);
    free(b->pair);
    free(b->whole);
}

void silt_stiff_free(silt_stiff **stiff) {
    if (!*stiff)
        return;
    silt_stiff *q = *stiff;
    blocks_free(&q->velocity);
    blocks_free(&q->saddle);
    free(q->row);
    free(q->place);
    free(q->right);
    free(q);
    *stiff = NULL;
}

bool silt_stiff_ready(const silt_stiff *stiff, bool pressure) {
    return stiff && (pressure ? stiff->saddle.ready : stiff->velocity.ready);
}

#define INLINE static inline __attribute__((always_inline))

// rows of node i in [K -G; -G^T -L], M unknowns a node, without inertia and without regard to what is held
INLINE void row_sum(const int M, const silt_fluid *f, const silt_mesh *mesh, int i, const int *place, double *row) {
    enum { D = 2, N = 3 };
    for (int k = mesh->node_cell_start[i]; k < mesh->node_cell_start[i + 1]; k++) {
        const int e = mesh->node_cell[k], *cell = mesh->cell[e], a = cell[0] == i ? 0 : cell[1] == i ? 1 : 2;
        const double *flux = f->flux + N * D * e, *fa = flux + D * a, *share = f->share ? f->share + N * e : NULL;
        const double viscous = f->mu[e] * f->inverse[e], smooth = f->tau[e] * f->inverse[e];
        for (int b = 0; b < N; b++) {
            double *out = row + M * M * place[cell[b]];
            const double *fb = flux + D * b, along = fa[0] * fb[0] + fa[1] * fb[1];
            for (int d = 0; d < D; d++)
                for (int c = 0; c < D; c++)
                    out[M * d + c] += viscous * ((d == c ? along : 0) + fb[d] * fa[c] - 2.0 / 3 * fa[d] * fb[c]);
            for (int d = 0; d < D && M > D; d++) {
                out[M * d + D] -= fa[d] / N + (share ? share[a] * fb[d] : 0);
                out[M * D + d] -= fb[d] / N + (share ? share[b] * fa[d] : 0);
            }
            if (M > D)
                out[M * D + D] -= smooth * along;
        }
    }
}

// inertia on the diagonal; held components taken out
INLINE void row_hold(const int M, const silt_fluid *f, const silt_mesh *mesh, int i, const uint8_t *closed, int self, double *row) {
    enum { D = 2 };
    const int start = mesh->neighbour_start[i], size = mesh->neighbour_start[i + 1] - start;
    double *own = row + M * M * self;
    const double held = f->inertia[i] + 0.5 * (own[0] + own[M + 1]);
    for (int d = 0; d < D; d++)
        own[M * d + d] += f->inertia[i];
    if (M > D) {
        // a crumb between held nodes knows its pressure up to a constant too
        own[M * D + D] *= closed[i] ? 2 : 1 + 1e-9;
        if (!mesh->wet[i] || !(own[M * D + D] < 0))
            own[M * D + D] = -1;
    }
    for (int k = 0; k < size; k++) {
        const int j = mesh->neighbour[start + k];
        double *out = row + M * M * k;
        for (int c = 0; c < M && f->hold[i] != HOLD_FREE; c++) { // columns: velocity of row i
            double column[3] = {out[c], out[M + c], 0};
            silt_hold_project(f, i, column);
            out[c] = column[0];
            out[M + c] = column[1];
        }
        for (int r = 0; r < M && f->hold[j] != HOLD_FREE; r++)
            silt_hold_project(f, j, out + M * r);
    }
    for (int d = 0; d < D && f->hold[i] != HOLD_FREE; d++) {
        double unit[3] = {d == 0, d == 1, 0}, loose[3] = {unit[0], unit[1], 0};
        silt_hold_project(f, i, loose);
        for (int k = 0; k < D; k++)
            own[M * k + d] += held * (unit[k] - loose[k]);
    }
}

// all rows, in single precision; the diagonal, for the pressure with what velocities will add to it
INLINE void rows_assemble(const int M, silt_stiff *q, silt_blocks *b, const silt_fluid *f, const silt_mesh *mesh, const uint8_t *closed) {
    enum { D = 2 };
    const int n = mesh->n_node;
    SILT_RESERVE(b->pair, b->pair_capacity, M * M * mesh->neighbour_start[n] + 1);
    SILT_RESERVE(b->whole, b->whole_capacity, M * n + 1);
    SILT_RESERVE(q->place, q->place_capacity, n + 1);
    memset(b->whole, 0, (size_t)(M * n) * sizeof *b->whole);
    for (int i = 0; i < n; i++) {
        const int start = mesh->neighbour_start[i], size = mesh->neighbour_start[i + 1] - start;
        SILT_RESERVE(q->row, q->row_capacity, M * M * size + 1);
        double *row = q->row;
        memset(row, 0, (size_t)(M * M * size) * sizeof *row);
        for (int k = 0; k < size; k++)
            q->place[mesh->neighbour[start + k]] = k;
        const int self = q->place[i];
        row_sum(M, f, mesh, i, q->place, row);
        row_hold(M, f, mesh, i, closed, self, row);
        const double *own = row + M * M * self;
        float *pair = b->pair + (size_t)(M * M) * (size_t)start;
        for (int k = 0; k < M * M * size; k++)
            pair[k] = (float)row[k];
        for (int d = 0; d < M; d++)
            b->whole[M * i + d] += (float)fabs(own[(M + 1) * d]);
        for (int k = 0; k < size && M > D; k++)
            for (int d = 0; d < D; d++)
                b->whole[M * mesh->neighbour[start + k] + D] += (float)(silt_square(row[M * M * k + M * d + D]) / own[(M + 1) * d]);
    }
}

silt_status silt_stiff_factor(silt_stiff **stiff, silt_fluid *f, const silt_step *s, bool pressure, silt_error *err) {
    const silt_mesh *mesh = s->mesh;
    if (!*stiff) {
        *stiff = silt_alloc(1, sizeof **stiff);
        silt_stiff_forget(*stiff);
    }
    silt_stiff *q = *stiff;
    silt_blocks *b = pressure ? &q->saddle : &q->velocity;
    b->ready = false;
    SILT_RESERVE(q->right, q->right_capacity, 3 * mesh->n_node + 1);
    if (pressure)
        rows_assemble(3, q, b, f, mesh, silt_closed_pieces(f, mesh));
    else
        rows_assemble(2, q, b, f, mesh, NULL);
    b->matrix = (silt_front_matrix){.n = mesh->n_node, .neighbour_start = mesh->neighbour_start, .neighbour = mesh->neighbour,
                                    .pair = b->pair, .unknowns = pressure ? 3 : 2, .whole = b->whole,
                                    .threads = silt_threads(mesh->n_node)};
    if (b->revision != mesh->revision)
        SILT_CLOCKED(analyse, silt_front_order(&b->front, &b->matrix, s->nodes->x));
    b->revision = mesh->revision;
    int bad;
    SILT_CLOCKED(factor, bad = silt_front_factor(b->front, &b->matrix));
    b->ready = bad < 0;
    if (b->ready)
        return SILT_OK;
    b->revision = -1;
    return silt_fail(err, SILT_FAILED, "the %s matrix of the stiff water could not be factored near (%g, %g)",
                     pressure ? "saddle-point" : "momentum", s->nodes->x[2 * bad], s->nodes->x[2 * bad + 1]);
}

void silt_stiff_momentum(silt_stiff *q, const silt_fluid *f, const double *right, double *out) {
    silt_front_solve(q->velocity.front, right, out);
    for (int i = 0; i < f->n_node; i++)
        silt_hold_project(f, i, out + 2 * i);
}

void silt_stiff_correct(silt_stiff *q, const silt_fluid *f, const double *right, double *increment, double *v) {
    for (int i = 0; i < f->n_node; i++) {
        q->right[3 * i] = q->right[3 * i + 1] = 0;
        q->right[3 * i + 2] = -right[i];
    }
    silt_front_solve(q->saddle.front, q->right, q->right);
    for (int i = 0; i < f->n_node; i++) {
        double *dv = q->right + 3 * i;
        increment[i] = dv[2];
        dv[2] = 0;
        silt_hold_project(f, i, dv);
        v[2 * i] += dv[0];
        v[2 * i + 1] += dv[1];
    }
}
