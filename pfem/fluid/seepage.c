// the bed's seepage in the water's pressure system
#include "fluid.h"

#define SEEPAGE_MOST 60  // directions
#define SEEPAGE_EDGE 0.5 // of a node's bed facets that must face one way: else it is an edge

/** working space, arrays of the water's nodes */
typedef struct room {
    double *way;  // dim per node: what makes the velocity through the bed of what the node's share of the bed takes, 1/m2 (1/m)
    double *v, *whole; // dim per node
    double *lump, *taken, *nought, *one, *right, *made; // 1 per node
} room;

static room room_of(silt_fluid *f) {
    const int n = f->n_node;
    double *at = SILT_RESERVE(f->seep->work, f->seep->work_capacity, (3 * f->dim + 6) * n + 1);
    room r = {.way = at, .v = at + f->dim * n, .whole = at + 2 * f->dim * n};
    double **scalar[] = {&r.lump, &r.taken, &r.nought, &r.one, &r.right, &r.made};
    for (int k = 0; k < 6; k++)
        *scalar[k] = r.whole + (f->dim + k) * n;
    return r;
}

void silt_seepage_begin(silt_fluid *f, const silt_step *s) {
    const silt_mesh *mesh = s->mesh;
    const int D = f->dim;
    const room r = room_of(f);
    memset(r.way, 0, (size_t)(D * f->n_node) * sizeof(double));
    memset(r.lump, 0, (size_t)f->n_node * sizeof(double));
    for (int k = 0; k < mesh->n_facet; k++) {
        double vector[3];
        if (mesh->facet_kind[k] != FACET_BED)
            continue;
        silt_facet_vector(mesh, D, s->nodes->x, mesh->facet[k], vector);
        for (int a = 0; a < D; a++) {
            const int i = mesh->facet[k][a];
            r.lump[i] += silt_length(D, vector) / D;
            for (int d = 0; d < D; d++)
                r.way[D * i + d] += vector[d] / D;
        }
    }
    for (int i = 0; i < f->n_node; i++) {
        const double size = silt_length(D, r.way + D * i);
        const bool smooth = size > SEEPAGE_EDGE * r.lump[i];
        for (int d = 0; d < D; d++)
            r.way[D * i + d] = smooth ? r.way[D * i + d] / silt_square(size) : 0;
    }
}

// What the nodes on the bed lose goes through the bed with a velocity, and continuity is that of the water's velocity and of it. Taken
// from the nodes' own equations alone the water would come to them at twice that speed and leave the next row at rest: u_1 - u_0 = 2 q.
// out += G^T v, and what edges of the bed take beside that from their nodes; the sum is that of `lump`, to rounding.
static void pass(silt_fluid *f, const silt_mesh *mesh, const room *r, const double *lump, double *out) {
    const int D = f->dim;
    memset(r->nought, 0, (size_t)f->n_node * sizeof(double));
    for (int i = 0; i < f->n_node; i++) {
        r->one[i] = 1;
        for (int d = 0; d < D; d++)
            r->v[D * i + d] = lump[i] * r->way[D * i + d];
    }
    silt_assemble_divergence(f, mesh, r->v, r->nought, r->made);
    for (int i = 0; i < f->n_node; i++)
        out[i] += lump[i] + r->made[i];
    memset(r->whole, 0, (size_t)(D * f->n_node) * sizeof(double));
    silt_assemble_pressure(f, mesh, r->one, r->whole);
    for (int i = 0; i < f->n_node; i++)
        out[i] -= silt_dot(D, r->whole + D * i, r->v + D * i);
}

const double *silt_seepage_taken(silt_fluid *f, const silt_mesh *mesh, const double *p) {
    const room r = room_of(f);
    memset(r.lump, 0, (size_t)f->n_node * sizeof(double));
    memset(r.taken, 0, (size_t)f->n_node * sizeof(double));
    silt_seep_take(f->seep, p, r.lump);
    pass(f, mesh, &r, r.lump, r.taken);
    return r.taken;
}

// out = (S + L + B) x, without the pins that pieces of closed water have in their factor: here the bed may hold their level
static void apply(silt_fluid *f, const silt_step *s, const room *r, const double *x, double *out) {
    memset(r->v, 0, (size_t)(f->dim * f->n_node) * sizeof(double));
    silt_fluid_correct(f, s, x, r->v);
    silt_assemble_divergence(f, s->mesh, r->v, x, out);
    memset(r->lump, 0, (size_t)f->n_node * sizeof(double));
    silt_seep_apply(f->seep, x, r->lump);
    pass(f, s->mesh, r, r->lump, out);
    for (int i = 0; i < f->n_node; i++)
        if (!s->mesh->wet[i])
            out[i] = x[i];
}

static double dot(int n, const double *a, const double *b) {
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

// Saad, SIAM J. Sci. Comput. 14, 1993, without restarts: B is not symmetric, since what passes the bed reaches the row of nodes over it,
// and what comes before it (multigrid) is not the same every time. 1 to 4 directions up to K = 1 cm/s.
silt_status silt_seepage_solve(silt_fluid *f, const silt_step *s, const double *right, double tolerance, double *x, silt_error *err) {
    enum { MOST = SEEPAGE_MOST };
    const int n = f->n_node;
    const room r = room_of(f);
    double h[MOST + 1][MOST], cosine[MOST], sine[MOST], left[MOST + 1] = {0}, y[MOST];
    memcpy(r.right, right, (size_t)n * sizeof(double)); // which may be the residual that others work with
    memset(x, 0, (size_t)n * sizeof(double));
    const double start = sqrt(dot(n, r.right, r.right));
    if (start == 0)
        return SILT_OK;
    left[0] = start;
    int used = 0;
    for (int k = 0; k < MOST && fabs(left[k]) > tolerance * start; k++) {
        // v_0 .. v_k+1 and z_0 .. z_k by turns
        double *basis = SILT_RESERVE(f->seep->basis, f->seep->basis_capacity, (2 * k + 3) * n);
        double *v = basis + 2 * k * n, *z = v + n, *next = z + n;
        for (int i = 0; k == 0 && i < n; i++)
            v[i] = r.right[i] / start;
        SILT_TRY(silt_pressure_solve(f->pressure, f, v, tolerance, z, err));
        apply(f, s, &r, z, next);
        for (int j = 0; j <= k; j++) {
            h[j][k] = dot(n, next, basis + 2 * j * n);
            for (int i = 0; i < n; i++)
                next[i] -= h[j][k] * basis[2 * j * n + i];
        }
        h[k + 1][k] = sqrt(dot(n, next, next));
        for (int i = 0; i < n && h[k + 1][k] > 0; i++)
            next[i] /= h[k + 1][k];
        for (int j = 0; j < k; j++) {
            const double a = h[j][k], b = h[j + 1][k];
            h[j][k] = cosine[j] * a + sine[j] * b;
            h[j + 1][k] = cosine[j] * b - sine[j] * a;
        }
        const double size = hypot(h[k][k], h[k + 1][k]);
        if (!(size > 0))
            return silt_fail(err, SILT_FAILED, "the pressure system with the bed's seepage could not be solved (%d nodes)", n);
        cosine[k] = h[k][k] / size;
        sine[k] = h[k + 1][k] / size;
        h[k][k] = size;
        left[k + 1] = -sine[k] * left[k];
        left[k] *= cosine[k];
        used = k + 1;
        f->pressure_iterations += k > 0;
    }
    for (int k = used - 1; k >= 0; k--) {
        y[k] = left[k];
        for (int j = k + 1; j < used; j++)
            y[k] -= h[k][j] * y[j];
        y[k] /= h[k][k];
        for (int i = 0; i < n; i++)
            x[i] += y[k] * f->seep->basis[(2 * k + 1) * n + i];
    }
    return SILT_OK;
}
