// water too thin for cells, between bodies and what they are near to
#include "fluid.h"

#define FILM_DROP 1e-13 // of the residual of a pressure
#define FILM_PASSES 4   // times as many directions as nodes, at most

void silt_film_clear(silt_film *m) {
    free(m->mouth);
    free(m->slave);
    free(m->slave_body);
    free(m->way);
    free(m->node);
    free(m->rim);
    free(m->element);
    free(m->mouth_normal);
    free(m->normal);
    free(m->stiffness);
    free(m->work);
    free(m->place);
    free(m->squeezed);
    *m = (silt_film){0};
}

// ---- the extension of the rim's pressure

// cotangents of the corners, half of each: weights of the edges opposite them
static void face_stiffness(const silt_mesh *mesh, const double *x, const int *corner, double out[3]) {
    double side[3][3], twice[3]; // side k is opposite corner k
    for (int k = 0; k < 3; k++)
        for (int d = 0; d < 3; d++)
            side[k][d] = silt_shortest(mesh, d, x[3 * corner[(k + 2) % 3] + d] - x[3 * corner[(k + 1) % 3] + d]);
    for (int d = 0; d < 3; d++) {
        const int p = (d + 1) % 3, q = (d + 2) % 3;
        twice[d] = side[0][p] * side[1][q] - side[0][q] * side[1][p];
    }
    const double area = silt_length(3, twice);
    for (int k = 0; k < 3; k++)
        out[k] = area > 0 ? -0.5 * silt_dot(3, side[(k + 1) % 3], side[(k + 2) % 3]) / area : 0;
}

void silt_film_ready(silt_film *m, const silt_mesh *mesh, const double *x) {
    const int D = mesh->dim;
    SILT_RESERVE(m->mouth_normal, m->mouth_room, m->n_mouth + 1);
    SILT_RESERVE(m->way, m->way_room, m->n_slave + 1);
    SILT_RESERVE(m->normal, m->normal_room, m->n_element + 1);
    SILT_RESERVE(m->stiffness, m->stiffness_room, m->n_element + 1);
    SILT_RESERVE(m->work, m->work_room, 7 * m->n_node + 1);
    SILT_RESERVE(m->squeezed, m->squeezed_room, m->n_node + 1);
    SILT_RESERVE(m->place, m->place_room, 2 * D * m->n_node + 1);
    for (int e = 0; e < m->n_element; e++) {
        int corner[3];
        for (int a = 0; a < D; a++)
            corner[a] = m->node[m->element[e][a]];
        memset(m->stiffness[e], 0, sizeof m->stiffness[e]);
        if (D == 3)
            face_stiffness(mesh, x, corner, m->stiffness[e]);
        else
            m->stiffness[e][2] = 1 / hypot(x[2 * corner[1]] - x[2 * corner[0]], x[2 * corner[1] + 1] - x[2 * corner[0] + 1]);
    }
}

// out = K p
static void film_apply(const silt_film *m, const double *p, double *out) {
    memset(out, 0, (size_t)m->n_node * sizeof *out);
    for (int e = 0; e < m->n_element; e++) {
        const int *own = m->element[e];
        for (int k = own[2] < 0 ? 2 : 0; k < 3; k++) {
            const int a = own[(k + 1) % 3], b = own[(k + 2) % 3];
            const double flow = m->stiffness[e][k] * (p[a] - p[b]);
            out[a] += flow;
            out[b] -= flow;
        }
    }
}

// x = K^-1 right on the inner nodes, nought on the others: conjugate gradients behind the diagonal
static void film_solve(const silt_film *m, const double *right, double *x) {
    const int n = m->n_node;
    double *r = m->work + n, *d = m->work + 2 * n, *ad = m->work + 3 * n, *diagonal = m->work + 4 * n;
    memset(diagonal, 0, (size_t)n * sizeof *diagonal);
    for (int e = 0; e < m->n_element; e++)
        for (int k = m->element[e][2] < 0 ? 2 : 0; k < 3; k++) {
            diagonal[m->element[e][(k + 1) % 3]] += m->stiffness[e][k];
            diagonal[m->element[e][(k + 2) % 3]] += m->stiffness[e][k];
        }
    double rz = 0, least = 0;
    int n_inner = 0;
    for (int a = 0; a < n; a++) {
        const bool inner = m->rim[a] == FILM_INNER && diagonal[a] > 0;
        n_inner += inner;
        diagonal[a] = inner ? 1 / diagonal[a] : 0;
        x[a] = 0;
        r[a] = inner ? right[a] : 0;
        d[a] = diagonal[a] * r[a];
        rz += d[a] * r[a];
    }
    least = silt_square(FILM_DROP) * rz;
    for (int pass = 0; pass < FILM_PASSES * n_inner && rz > least; pass++) {
        double dad = 0, next = 0;
        film_apply(m, d, ad);
        for (int a = 0; a < n; a++)
            dad += d[a] * ad[a];
        if (!(dad > 0))
            break;
        for (int a = 0; a < n; a++) {
            x[a] += rz / dad * d[a];
            r[a] -= diagonal[a] > 0 ? rz / dad * ad[a] : 0;
            next += diagonal[a] * r[a] * r[a];
        }
        for (int a = 0; a < n; a++)
            d[a] = diagonal[a] * r[a] + next / rz * d[a];
        rz = next;
    }
}

// pressure of every node of the film from the water's p
static void film_pressure(const silt_film *m, const double *p, double *out) {
    double *load = m->work + 5 * m->n_node, *inner = m->work + 6 * m->n_node;
    for (int a = 0; a < m->n_node; a++)
        out[a] = m->rim[a] == FILM_WET ? p[m->node[a]] : 0;
    film_apply(m, out, load);
    for (int a = 0; a < m->n_node; a++)
        load[a] = -load[a];
    film_solve(m, load, inner);
    for (int a = 0; a < m->n_node; a++)
        out[a] += inner[a];
}

// the adjoint: what the nodes of the film have goes to its rim
static void film_gather(const silt_film *m, double *q) {
    double *back = m->work + 5 * m->n_node, *inner = m->work + 6 * m->n_node;
    film_solve(m, q, inner);
    film_apply(m, inner, back);
    for (int a = 0; a < m->n_node; a++)
        q[a] = m->rim[a] == FILM_WET ? q[a] - back[a] : 0;
}

// ---- in the step

// normal out of a facet's other side, as large as the facet
static void normal_out(const silt_mesh *mesh, const double *x, const double *x_mid, const int *facet, double n[3]) {
    silt_facet_mean_normal(mesh, x, x_mid, facet, n);
    for (int d = 0; d < mesh->dim; d++)
        n[d] = -n[d];
}

void silt_film_place(silt_film *m, const silt_step *s, const double *x_mid, double dt) {
    const int D = s->mesh->dim;
    const double *x = s->nodes->x, *v = s->body_velocity;
    double *from = m->place, *half = m->place + D * m->n_node;
    for (int a = 0; a < m->n_node; a++)
        for (int d = 0; d < D; d++) {
            const int k = D * m->node[a] + d;
            from[D * a + d] = x[k];
            half[D * a + d] = x[k] + (v ? 0.5 * dt * (v[k] + s->body_shift[k]) : 0);
        }
    for (int k = 0; k < m->n_mouth; k++)
        normal_out(s->mesh, x, dt > 0 ? x_mid : x, s->mesh->facet[m->mouth[k]], m->mouth_normal[k]);
    for (int e = 0; e < m->n_element; e++) // as of a facet of water inside of the body
        normal_out(s->mesh, from, dt > 0 ? half : from, m->element[e], m->normal[e]);
    silt_film_squeeze(m, D, v, dt > 0 ? s->body_shift : NULL);
}

// share of int N_a N_b of a facet of D corners
static inline double mass_share(int D, bool same) { return (same ? 2.0 : 1.0) / (D * (D + 1)); }

void silt_film_squeeze(silt_film *m, int D, const double *v, const double *more) {
    double *q = m->squeezed;
    memset(q, 0, (size_t)m->n_node * sizeof *q);
    for (int e = 0; e < m->n_element; e++)
        for (int a = 0; a < D; a++) {
            double rate = 0;
            for (int d = 0; d < D; d++) {
                const int k = D * m->node[m->element[e][a]] + d;
                rate += m->normal[e][d] * ((v ? v[k] : 0) + (more ? more[k] : 0));
            }
            for (int b = 0; b < D; b++)
                q[m->element[e][b]] += mass_share(D, a == b) * rate;
        }
    film_gather(m, q);
}

void silt_film_source(const silt_film *m, double *out) {
    for (int a = 0; a < m->n_node; a++)
        out[m->node[a]] -= m->squeezed[a];
}

void silt_film_mouths(const silt_film *m, const silt_mesh *mesh, const uint8_t *mobile, const double *v, double *out, double *withheld) {
    const int D = mesh->dim;
    for (int k = 0; k < m->n_mouth; k++) {
        const int *facet = mesh->facet[m->mouth[k]];
        for (int a = 0; a < D; a++) {
            const double rate = silt_dot(D, v + D * facet[a], m->mouth_normal[k]);
            for (int b = 0; b < D; b++) {
                double *to = !mobile || mobile[facet[b]] == 1 ? out : withheld;
                to[facet[b]] -= mass_share(D, a == b) * rate;
            }
        }
    }
}

// whether the smoothing takes what comes in at a node on to one that keeps its volume
static bool passes_on(const silt_mesh *mesh, const uint8_t *mobile, int i) {
    bool any = mobile[i] == 1;
    for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1] && mobile[i] == 0 && !any; k++)
        any = mobile[mesh->neighbour[k]] == 1;
    return any;
}

void silt_film_continuity(const silt_film *m, const silt_mesh *mesh, const uint8_t *mobile, const double *v, double *residual,
                          double *withheld) {
    silt_film_mouths(m, mesh, mobile, v, residual, withheld);
    for (int a = 0; a < m->n_node; a++)
        if (m->rim[a] == FILM_WET)
            *(passes_on(mesh, mobile, m->node[a]) ? residual + m->node[a] : withheld + m->node[a]) -= m->squeezed[a];
}

void silt_film_free_part(const silt_film *m, int k, int D, double *v) {
    const struct silt_film_way *way = &m->way[k];
    const double along = silt_dot(D, v, way->vector);
    for (int d = 0; d < D; d++)
        v[d] = way->hold == HOLD_NORMAL ? v[d] - along * way->vector[d] : way->hold == HOLD_LINE ? along * way->vector[d] : 0;
}

void silt_film_push(const silt_film *m, const silt_mesh *mesh, const double *p, double *out) {
    const int D = mesh->dim;
    for (int k = 0; k < m->n_mouth; k++) {
        const int *facet = mesh->facet[m->mouth[k]];
        for (int a = 0; a < D; a++) {
            double sum = 0;
            for (int b = 0; b < D; b++)
                sum += mass_share(D, a == b) * p[facet[b]];
            for (int d = 0; d < D; d++)
                out[D * facet[a] + d] -= sum * m->mouth_normal[k][d];
        }
    }
}

void silt_film_press(silt_film *m, int D, const double *p, double *out) {
    double *pressure = m->work;
    film_pressure(m, p, pressure);
    for (int e = 0; e < m->n_element; e++)
        for (int a = 0; a < D; a++) {
            double sum = 0;
            for (int b = 0; b < D; b++)
                sum += mass_share(D, a == b) * pressure[m->element[e][b]];
            for (int d = 0; d < D; d++)
                out[D * m->node[m->element[e][a]] + d] += sum * m->normal[e][d];
        }
}
