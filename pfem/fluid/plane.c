// the pressure system in two dimensions: rows of G and couplings of L, summed and factored front by front
#include "front.h"
#include "parallel.h"
#include "plane.h"

struct silt_plane {
    silt_front *front;    // owned
    double share;         // of a right side that a solve with the factor leaves; 0: not known yet
    silt_front_matrix matrix; // of the mesh that the factor belongs to
    int64_t revision;     // of the mesh that its order belongs to
    float *star;          // owned, 3 per entry of the mesh's neighbour lists: G, free part; L
    float *weight;        // owned, per node, 1/inertia
    double *own;          // owned, per node, diagonal of L
    float *whole;         // owned, per node, diagonal of the sum
    double *row;          // owned, of the present node
    int *place;           // owned, per node
    int star_capacity, weight_capacity, own_capacity, whole_capacity, place_capacity, row_capacity;
};

// One row of G and couplings of L with neighbours of higher number, rounded so that both still let a constant pass: what is lacking
// goes to the node's own entry, which is nought but on the boundary and so is rounded a million times finer.
static inline void row_round(int size, int self, const double *row, float *out) {
    double lost[2] = {0, 0};
    for (int k = 0; k < size; k++) {
        for (int d = 0; d < 2; d++) {
            out[3 * k + d] = (float)row[3 * k + d];
            lost[d] += row[3 * k + d] - out[3 * k + d];
        }
        out[3 * k + 2] = k > self ? (float)row[3 * k + 2] : 0;
    }
    for (int d = 0; d < 2; d++)
        out[3 * self + d] = (float)(out[3 * self + d] + lost[d]);
}

// what silt_front needs: rows of G with the couplings of L; the diagonal of L and that of the whole sum
static void rows_assemble(silt_plane *p, const silt_fluid *f, const silt_mesh *mesh) {
    enum { D = 2, M = 3 };
    const int n = mesh->n_node;
    SILT_RESERVE(p->star, p->star_capacity, 3 * mesh->neighbour_start[n] + 1);
    SILT_RESERVE(p->place, p->place_capacity, n + 1);
    SILT_RESERVE(p->weight, p->weight_capacity, n + 1);
    SILT_RESERVE(p->own, p->own_capacity, n + 1);
    SILT_RESERVE(p->whole, p->whole_capacity, n + 1);
    double *own = p->own;
    float *whole = p->whole;
    int *place = p->place; // of a neighbour in the present node's list
    memset(whole, 0, (size_t)n * sizeof *whole);
    memset(own, 0, (size_t)n * sizeof *own);
    for (int i = 0; i < n; i++) {
        const int start = mesh->neighbour_start[i], size = mesh->neighbour_start[i + 1] - start;
        SILT_RESERVE(p->row, p->row_capacity, 3 * size);
        double *row = p->row;
        memset(row, 0, (size_t)(3 * size) * sizeof *row);
        for (int k = 0; k < size; k++)
            place[mesh->neighbour[start + k]] = k;
        for (int k = mesh->node_cell_start[i]; k < mesh->node_cell_start[i + 1]; k++) {
            const int e = mesh->node_cell[k], *cell = mesh->cell[e], a = cell[0] == i ? 0 : cell[1] == i ? 1 : 2;
            const double *flux = f->flux + M * D * e, *mine = flux + D * a;
            const double share = f->share ? f->share[M * e + a] : 0, weight = f->tau[e] * f->inverse[e];
            for (int b = 0; b < M; b++) {
                double *entry = row + 3 * place[cell[b]];
                entry[0] += mine[0] / M + share * flux[D * b];
                entry[1] += mine[1] / M + share * flux[D * b + 1];
                entry[2] += weight * (mine[0] * flux[D * b] + mine[1] * flux[D * b + 1]);
            }
        }
        for (int k = 0; k < size && f->hold[i] != HOLD_FREE; k++)
            silt_hold_project(f, i, row + 3 * k);
        float *star = p->star + 3 * start;
        row_round(size, place[i], row, star);
        const float weigh = p->weight[i] = !mesh->wet[i] || f->hold[i] == HOLD_ALL ? 0 : (float)(1 / f->inertia[i]);
        for (int k = 0; k < size; k++)
            whole[mesh->neighbour[start + k]] += weigh * (star[3 * k] * star[3 * k] + star[3 * k + 1] * star[3 * k + 1]);
        double sum = own[i];
        for (int k = place[i] + 1; k < size; k++) {
            own[mesh->neighbour[start + k]] -= star[3 * k + 2];
            sum -= star[3 * k + 2];
        }
        own[i] = sum;
    }
}

silt_status silt_pressure_indefinite(const silt_step *s, int node, silt_error *err) {
    const double *x = s->nodes->x + silt_nodes_dim(s->nodes) * node;
    return silt_fail(err, SILT_FAILED, "the pressure matrix is not positive definite near (%g, %g)", x[0], x[1]);
}

silt_status silt_plane_factor(silt_plane **plane, const silt_fluid *f, const silt_step *s, const uint8_t *pinned, silt_error *err) {
    if (!*plane)
        *plane = silt_alloc(1, sizeof **plane);
    silt_plane *p = *plane;
    const silt_mesh *mesh = s->mesh;
    rows_assemble(p, f, mesh);
    for (int j = 0; j < mesh->n_node; j++) {
        const double sum = p->whole[j] + p->own[j], pin = silt_pressure_pin(mesh, pinned, j, sum);
        p->own[j] += pin;
        p->whole[j] = (float)(sum + pin);
    }
    p->matrix = (silt_front_matrix){.n = mesh->n_node, .neighbour_start = mesh->neighbour_start, .neighbour = mesh->neighbour,
                                      .row = p->star, .weight = p->weight, .diagonal = p->own, .whole = p->whole,
                                    .threads = silt_threads(mesh->n_node)};
    if (!p->front || p->revision != mesh->revision)
        SILT_CLOCKED(analyse, silt_front_order(&p->front, &p->matrix, s->nodes->x));
    p->revision = mesh->revision;
    p->share = 0;
    int bad;
    SILT_CLOCKED(factor, bad = silt_front_factor(p->front, &p->matrix));
    if (bad < 0)
        return SILT_OK;
    p->revision = -1;
    return silt_pressure_indefinite(s, bad, err);
}

silt_status silt_plane_solve(silt_plane *p, silt_fluid *f, const double *right, double tolerance, double *out, silt_error *err) {
    double *const work[3] = {f->cg[0], f->cg[0] + p->matrix.n, f->cg[1]};
    if (silt_front_mend(p->front, &p->matrix, right, tolerance, out, work, &p->share, &f->pressure_iterations))
        return SILT_OK;
    return silt_fail(err, SILT_FAILED, "the pressure system could not be solved (%d nodes)", p->matrix.n);
}

void *silt_plane_rest(silt_plane *p, size_t *bytes) { return p ? silt_front_rest(p->front, bytes) : NULL; }

void silt_plane_forget(silt_plane *p) {
    if (p)
        p->revision = -1;
}

void silt_plane_free(silt_plane **plane) {
    silt_plane *p = *plane;
    if (!p)
        return;
    silt_front_free(&p->front);
    free(p->star);
    free(p->weight);
    free(p->own);
    free(p->whole);
    free(p->place);
    free(p->row);
    free(p);
    *plane = NULL;
}
