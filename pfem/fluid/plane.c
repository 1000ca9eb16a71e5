// the pressure system in two dimensions: rows of G and couplings of L, summed and factored front by front
#include "plane.h"
#include "front.h"

struct silt_plane {
    silt_front *front;    // owned
    int64_t revision;     // of the mesh that its order belongs to
    double *star;         // owned, 3 per entry of the mesh's neighbour lists: G, free part; L
    double *weight;       // owned, per node, 1/inertia
    double *own, *whole;  // owned, per node, diagonal of L and of the sum
    int *place;           // owned, per node
    int star_capacity, weight_capacity, own_capacity, whole_capacity, place_capacity;
};

// what silt_front needs: rows of G with the couplings of L; the diagonal of L and that of the whole sum
static void rows_assemble(silt_plane *p, const silt_fluid *f, const silt_mesh *mesh) {
    enum { D = 2, M = 3 };
    SILT_RESERVE(p->star, p->star_capacity, 3 * mesh->neighbour_start[mesh->n_node] + 1);
    SILT_RESERVE(p->place, p->place_capacity, mesh->n_node + 1);
    SILT_RESERVE(p->weight, p->weight_capacity, mesh->n_node + 1);
    SILT_RESERVE(p->own, p->own_capacity, mesh->n_node + 1);
    SILT_RESERVE(p->whole, p->whole_capacity, mesh->n_node + 1);
    memset(p->whole, 0, (size_t)mesh->n_node * sizeof *p->whole);
    int *place = p->place; // of a neighbour in the present node's list
    for (int i = 0; i < mesh->n_node; i++) {
        const int start = mesh->neighbour_start[i], size = mesh->neighbour_start[i + 1] - start;
        double *row = p->star + 3 * start;
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
        p->own[i] = row[3 * place[i] + 2];
        p->whole[i] += p->own[i];
        for (int k = 0; k <= place[i]; k++) // the others are their neighbours'
            row[3 * k + 2] = 0;
        p->weight[i] = !mesh->wet[i] || f->hold[i] == HOLD_ALL ? 0 : 1 / f->inertia[i];
        for (int k = 0; k < size; k++) {
            double *g = row + 3 * k;
            if (f->hold[i] != HOLD_FREE)
                silt_hold_project(f, i, g);
            p->whole[mesh->neighbour[start + k]] += p->weight[i] * silt_dot(D, g, g);
        }
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
    for (int j = 0; j < mesh->n_node; j++)
        p->own[j] += silt_pressure_pin(mesh, pinned, j, p->whole[j]);
    const silt_front_matrix matrix = {.n = mesh->n_node, .neighbour_start = mesh->neighbour_start, .neighbour = mesh->neighbour,
                                      .row = p->star, .weight = p->weight, .diagonal = p->own};
    if (!p->front || p->revision != mesh->revision)
        SILT_CLOCKED(analyse, silt_front_order(&p->front, &matrix, s->nodes->x));
    p->revision = mesh->revision;
    int bad;
    SILT_CLOCKED(factor, bad = silt_front_factor(p->front, &matrix));
    if (bad < 0)
        return SILT_OK;
    p->revision = -1;
    return silt_pressure_indefinite(s, bad, err);
}

void silt_plane_solve(silt_plane *p, const double *right, double *out) { silt_front_solve(p->front, right, out); }

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
    free(p);
    *plane = NULL;
}
