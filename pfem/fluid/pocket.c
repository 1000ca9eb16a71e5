// closed pockets of air: which parts of the air are shut in, what they hold from step to step, what they press with
#include "pocket.h"

#define POCKET_LEAST 1.5 // times h^dim: smaller holes are no pockets (three triangles)
#define POCKET_SHARE 0.1 // least share of a pocket's nodes that hands its air on
#define POCKET_HALF 0.5  // a piece with this share of its own nodes from a pocket belongs to it
#define POCKET_OPENED 0.25 // share of a pocket's nodes in the open that lets air out when it falls apart

static double cell_measure(int dim, const double *x, const int *cell) {
    double e[3][3] = {{0}};
    for (int a = 0; a < dim; a++)
        for (int d = 0; d < dim; d++)
            e[a][d] = x[dim * cell[a + 1] + d] - x[dim * cell[0] + d];
    if (dim == 2)
        return fabs(0.5 * (e[0][0] * e[1][1] - e[0][1] * e[1][0]));
    return fabs(e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) - e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
                e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0])) / 6;
}

// area vector of a facet, out of the water, from its corners
static void facet_vector(int dim, const double *const corner[3], double vector[3]) {
    const double *p = corner[0], *q = corner[1];
    if (dim == 2) {
        vector[0] = q[1] - p[1];
        vector[1] = p[0] - q[0];
        vector[2] = 0;
        return;
    }
    const double *r = corner[2];
    for (int d = 0; d < 3; d++) {
        const int d1 = (d + 1) % 3, d2 = (d + 2) % 3;
        vector[d] = 0.5 * ((q[d1] - p[d1]) * (r[d2] - p[d2]) - (q[d2] - p[d2]) * (r[d1] - p[d1]));
    }
}

static int compare_int(const void *a, const void *b) {
    return (*(const int *)a > *(const int *)b) - (*(const int *)a < *(const int *)b);
}

static int compare_member(const void *a, const void *b) {
    const int64_t *p = a, *q = b;
    return p[0] != q[0] ? (p[0] > q[0]) - (p[0] < q[0]) : (p[1] > q[1]) - (p[1] < q[1]);
}

static void pocket_press(silt_pocket_state *pocket, const silt_fluid_def *fluid) {
    const double known = silt_max(pocket->volume - pocket->jump, 1e-3 * pocket->amount);
    const double whole = fluid->air_pressure * pow(pocket->amount / known, fluid->air_exponent);
    pocket->pressure = whole - fluid->air_pressure;
    pocket->stiffness = fluid->air_exponent * whole / known;
}

// ---- what a rebuild makes of the pockets

// nodes of every pocket, rising
static void pockets_nodes(silt_pockets *pockets, const silt_mesh *mesh) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    int n = 0;
    for (int q = 0; q < pockets->count; q++) {
        silt_pocket_state *p = &pockets->pocket[q];
        p->first_node = n;
        SILT_RESERVE(pockets->node, pockets->node_capacity, n + dim * p->n_facet + 1);
        for (int k = p->first; k < p->first + p->n_facet; k++)
            for (int a = 0; a < dim; a++)
                pockets->node[n++] = mesh->facet[pockets->facet[k]][a];
        qsort(pockets->node + p->first_node, (size_t)(n - p->first_node), sizeof *pockets->node, compare_int);
        int end = p->first_node;
        for (int k = p->first_node; k < n; k++)
            if (k == p->first_node || pockets->node[k] != pockets->node[k - 1])
                pockets->node[end++] = pockets->node[k];
        n = end;
        p->n_node = n - p->first_node;
    }
    SILT_RESERVE(pockets->vector, pockets->vector_capacity, 3 * n + 1);
}

// which component of the air every free facet of the mesh borders, -1: open or none
static int *facet_components(const silt_mesh *mesh, const silt_air *air, int *parent, int *n_piece, double **volume) {
    const int dim = air->dim;
    silt_facet_map faces = {0};
    silt_facet_map_create(&faces, air->n_cell * (dim + 1));
    for (int e = 0; e < air->n_cell; e++)
        parent[e] = e;
    // joined over shared facets; the lowest cell stands for all
    for (int e = 0; e < air->n_cell; e++)
        for (int a = 0; a <= dim; a++) {
            int facet[3], n = 0;
            for (int b = 0; b <= dim; b++)
                if (b != a)
                    facet[n++] = air->cell[e][b];
            const int other = silt_facet_map_put(&faces, dim, facet, e);
            if (other >= 0) {
                const int p = silt_group_find(parent, e), q = silt_group_find(parent, other);
                parent[p > q ? p : q] = p > q ? q : p;
            }
        }
    uint8_t *open = silt_alloc((size_t)air->n_cell + 1, 1);
    int *piece = silt_alloc((size_t)air->n_cell + 1, sizeof *piece);
    double *sum = silt_alloc((size_t)air->n_cell + 1, sizeof *sum);
    for (int e = 0; e < air->n_cell; e++) {
        open[silt_group_find(parent, e)] |= air->open[e];
        sum[silt_group_find(parent, e)] += cell_measure(dim, air->x, air->cell[e]);
    }
    *n_piece = 0;
    *volume = sum; // of the pieces, packed to the front: a root is never before its piece's number
    for (int e = 0; e < air->n_cell; e++) {
        piece[e] = -1;
        if (parent[e] == e && !open[e]) {
            piece[e] = *n_piece;
            sum[(*n_piece)++] = sum[e];
        }
    }
    int *of = silt_alloc((size_t)mesh->n_facet + 1, sizeof *of);
    for (int k = 0; k < mesh->n_facet; k++) {
        const int e = mesh->facet_kind[k] == FACET_FREE ? silt_facet_map_put(&faces, dim, mesh->facet[k], -1) : -1;
        of[k] = e < 0 ? -1 : piece[silt_group_find(parent, e)];
    }
    silt_facet_map_clear(&faces);
    free(open);
    free(piece);
    return of;
}

// index of the first membership of a node
static int member_find(const silt_pockets *pockets, int64_t id) {
    int low = 0, high = pockets->n_member;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (pockets->member[middle][0] < id)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

// air of the old pockets, handed on by the nodes that they share with the new ones
static void hand_on(silt_pockets *pockets, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                    const silt_pocket_state *old, int n_old) {
    const int n_new = pockets->count;
    int *shared = silt_alloc((size_t)n_old * (size_t)n_new + 1, sizeof *shared);
    int *n_known = silt_alloc((size_t)n_old + 1, sizeof *n_known), *n_open = silt_alloc((size_t)n_old + 1, sizeof *n_open);
    uint8_t *seen = silt_alloc((size_t)nodes->count + 1, 1);

    // what became of every old pocket's nodes: in which new ones they are, or on the open surface
    for (int q = 0; q <= n_new; q++) {
        const int from = q < n_new ? pockets->pocket[q].first_node : 0;
        const int end = q < n_new ? from + pockets->pocket[q].n_node : nodes->count;
        for (int k = from; k < end; k++) {
            const int i = q < n_new ? pockets->node[k] : k;
            if (q == n_new && (seen[i] || !mesh->surface[i]))
                continue;
            for (int m = member_find(pockets, nodes->id[i]); m < pockets->n_member && pockets->member[m][0] == nodes->id[i]; m++)
                for (int o = 0; o < n_old; o++)
                    if (old[o].id == pockets->member[m][1]) {
                        n_known[o] += !seen[i];
                        if (q < n_new)
                            shared[o * n_new + q]++;
                        else
                            n_open[o]++;
                    }
            seen[i] = 1;
        }
    }

    double *amount = silt_alloc((size_t)n_new + 1, sizeof *amount), *known = silt_alloc((size_t)n_new + 1, sizeof *known);
    double *jump = silt_alloc((size_t)n_new + 1, sizeof *jump), *most = silt_alloc((size_t)n_new + 1, sizeof *most);
    for (int q = 0; q < n_new; q++)
        pockets->pocket[q].id = 0;
    for (int o = 0; o < n_old; o++) {
        double whole = 0;
        for (int q = 0; q < n_new; q++) {
            const int both = shared[o * n_new + q];
            if (both < POCKET_SHARE * n_known[o] && both < POCKET_HALF * pockets->pocket[q].n_node)
                shared[o * n_new + q] = 0;
            whole += shared[o * n_new + q] > 0 ? pockets->pocket[q].volume : 0;
        }
        if (!(whole > 0)) {
            pockets->opened += old[o].amount;
            continue;
        }
        // pieces keep the pressure; what opened takes its part away
        double part = 1;
        if (n_open[o] > POCKET_OPENED * n_known[o]) {
            part = silt_min(whole / old[o].volume, 1);
            pockets->opened += (1 - part) * old[o].amount;
        }
        for (int q = 0; q < n_new; q++) {
            if (!shared[o * n_new + q])
                continue;
            const double share = part * pockets->pocket[q].volume / whole;
            amount[q] += share * old[o].amount;
            known[q] += share * old[o].volume;
            jump[q] += share * old[o].jump;
            // the name goes to where most of the air goes, and is used once
            bool used = false;
            for (int r = 0; r < n_new; r++)
                used |= r != q && pockets->pocket[r].id == old[o].id && most[r] >= share * old[o].amount;
            if (share * old[o].amount > most[q] && !used) {
                for (int r = 0; r < n_new; r++)
                    if (r != q && pockets->pocket[r].id == old[o].id)
                        pockets->pocket[r].id = 0;
                most[q] = share * old[o].amount;
                pockets->pocket[q].id = old[o].id;
            }
        }
    }
    const double keep = 1 - 1 / silt_max(scene->fluid.volume_steps, 1);
    for (int q = 0; q < n_new; q++) {
        silt_pocket_state *p = &pockets->pocket[q];
        if (p->id == 0)
            p->id = ++pockets->next_id;
        p->amount = amount[q];
        if (!(amount[q] > 0)) {
            p->amount = p->volume;
            pockets->enclosed += p->amount;
        } else // never more than half of what is there
            p->jump = silt_clamp(keep * (jump[q] + p->volume - known[q]), -0.5 * p->volume, 0.5 * p->volume);
        pocket_press(p, &scene->fluid);
    }
    free(shared);
    free(n_known);
    free(n_open);
    free(seen);
    free(amount);
    free(known);
    free(jump);
    free(most);
}

void silt_pockets_update(silt_pockets *pockets, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                         const silt_air *air) {
    const int dim = air->dim, n_old = pockets->count;
    silt_pocket_state *old = silt_alloc((size_t)n_old + 1, sizeof *old);
    if (n_old)
        memcpy(old, pockets->pocket, (size_t)n_old * sizeof *old);
    int *parent = silt_alloc((size_t)air->n_cell + 1, sizeof *parent), n_piece = 0;
    double *volume = NULL;
    int *of = facet_components(mesh, air, parent, &n_piece, &volume);

    // pieces of air that are large enough, with the facets that they touch
    const double least = POCKET_LEAST * pow(scene->fluid.size, dim);
    int *number = silt_alloc((size_t)n_piece + 1, sizeof *number), *n_facet = silt_alloc((size_t)n_piece + 1, sizeof *n_facet);
    for (int k = 0; k < mesh->n_facet; k++)
        if (of[k] >= 0)
            n_facet[of[k]]++;
    pockets->count = 0;
    int first = 0;
    for (int g = 0; g < n_piece; g++) {
        number[g] = -1;
        if (volume[g] < least || n_facet[g] == 0)
            continue;
        SILT_RESERVE(pockets->pocket, pockets->capacity, pockets->count + 1);
        number[g] = pockets->count;
        pockets->pocket[pockets->count++] = (silt_pocket_state){.volume = volume[g], .first = first};
        first += n_facet[g];
    }
    SILT_RESERVE(pockets->facet, pockets->facet_capacity, first + 1);
    for (int k = 0; k < mesh->n_facet; k++)
        if (of[k] >= 0 && number[of[k]] >= 0) {
            silt_pocket_state *p = &pockets->pocket[number[of[k]]];
            pockets->facet[p->first + p->n_facet++] = k;
        }
    pockets_nodes(pockets, mesh);
    hand_on(pockets, scene, nodes, mesh, old, n_old);

    // what they are known by next time
    pockets->n_member = 0;
    for (int q = 0; q < pockets->count; q++) {
        const silt_pocket_state *p = &pockets->pocket[q];
        SILT_RESERVE(pockets->member, pockets->member_capacity, pockets->n_member + p->n_node + 1);
        for (int k = p->first_node; k < p->first_node + p->n_node; k++) {
            pockets->member[pockets->n_member][0] = nodes->id[pockets->node[k]];
            pockets->member[pockets->n_member++][1] = p->id;
        }
    }
    if (pockets->n_member)
        qsort(pockets->member, (size_t)pockets->n_member, sizeof *pockets->member, compare_member);
    free(old);
    free(parent);
    free(volume);
    free(of);
    free(number);
    free(n_facet);
}

// ---- in a step

void silt_pockets_advance(silt_pockets *pockets, const silt_scene *scene, const silt_mesh *mesh, const double *x_old,
                          const double *x) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    for (int q = 0; q < pockets->count; q++) {
        silt_pocket_state *p = &pockets->pocket[q];
        double swept = 0;
        for (int k = p->first; k < p->first + p->n_facet; k++) {
            // Simpson's rule is exact: the area vector is quadratic in time
            const int *facet = mesh->facet[pockets->facet[k]];
            double middle[3][3], way[3] = {0}, vector[3][3];
            const double *corner[3][3] = {{NULL}};
            for (int a = 0; a < dim; a++) {
                corner[0][a] = x_old + dim * facet[a];
                corner[1][a] = middle[a];
                corner[2][a] = x + dim * facet[a];
                for (int d = 0; d < dim; d++) {
                    middle[a][d] = 0.5 * (corner[0][a][d] + corner[2][a][d]);
                    way[d] += (corner[2][a][d] - corner[0][a][d]) / dim;
                }
            }
            for (int s = 0; s < 3; s++)
                facet_vector(dim, corner[s], vector[s]);
            for (int d = 0; d < dim; d++)
                swept += (vector[0][d] + 4 * vector[1][d] + vector[2][d]) / 6 * way[d];
        }
        p->volume -= swept;
        pocket_press(p, &scene->fluid);
    }
}

void silt_pockets_load(silt_pockets *pockets, const silt_mesh *mesh, const double *x) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    for (int q = 0; q < pockets->count; q++) {
        const silt_pocket_state *p = &pockets->pocket[q];
        int *node = pockets->node + p->first_node;
        memset(pockets->vector + dim * p->first_node, 0, (size_t)(dim * p->n_node) * sizeof(double));
        for (int k = p->first; k < p->first + p->n_facet; k++) {
            const int *facet = mesh->facet[pockets->facet[k]];
            const double *corner[3] = {NULL};
            double vector[3];
            for (int a = 0; a < dim; a++)
                corner[a] = x + dim * facet[a];
            facet_vector(dim, corner, vector);
            for (int a = 0; a < dim; a++) {
                const int *at = bsearch(&facet[a], node, (size_t)p->n_node, sizeof *node, compare_int);
                for (int d = 0; d < dim; d++)
                    pockets->vector[dim * (at - pockets->node) + d] += vector[d] / dim;
            }
        }
    }
}

void silt_pockets_force(const silt_pockets *pockets, int dim, double dt, const double *w, double *out) {
    for (int q = 0; q < pockets->count; q++) {
        const silt_pocket_state *p = &pockets->pocket[q];
        double flux = 0;
        for (int k = p->first_node; dt > 0 && k < p->first_node + p->n_node; k++)
            for (int d = 0; d < dim; d++)
                flux += pockets->vector[dim * k + d] * w[dim * pockets->node[k] + d];
        const double press = p->pressure + p->stiffness * dt * flux;
        for (int k = p->first_node; k < p->first_node + p->n_node; k++)
            for (int d = 0; d < dim; d++)
                out[dim * pockets->node[k] + d] -= press * pockets->vector[dim * k + d];
    }
}

double silt_pockets_stiff(const silt_pockets *pockets, int dim, double dt, const double *mass) {
    double most = 0;
    for (int q = 0; q < pockets->count; q++) {
        const silt_pocket_state *p = &pockets->pocket[q];
        double sum = 0;
        for (int k = p->first_node; k < p->first_node + p->n_node; k++)
            for (int d = 0; d < dim && mass[pockets->node[k]] > 0; d++)
                sum += silt_square(pockets->vector[dim * k + d]) / mass[pockets->node[k]];
        most = silt_max(most, dt * dt * p->stiffness * sum);
    }
    return most;
}

// ---- checkpoint

#define POCKETS_PARTS(X)                                                                                               \
    X("pockets/next_id", STORE_LONG, pockets->next_id)                                                                 \
    X("pockets/opened", STORE_DOUBLE, pockets->opened)                                                                 \
    X("pockets/enclosed", STORE_DOUBLE, pockets->enclosed)                                                             \
    X("pockets/count", STORE_INT, pockets->count)                                                                      \
    X("pockets/members", STORE_INT, pockets->n_member)

silt_status silt_pockets_save(const silt_pockets *pockets, silt_store *store, silt_error *err) {
#define PUT(name, type, value) SILT_TRY(silt_store_put(store, name, type, 1, &(value), err));
    POCKETS_PARTS(PUT)
#undef PUT
    const silt_pocket_state *last = pockets->count ? &pockets->pocket[pockets->count - 1] : NULL;
    SILT_TRY(silt_store_put(store, "pockets/pocket", STORE_BYTE, (size_t)pockets->count * sizeof *pockets->pocket, pockets->pocket, err));
    SILT_TRY(silt_store_put(store, "pockets/member", STORE_LONG, 2 * (size_t)pockets->n_member, pockets->member, err));
    return silt_store_put(store, "pockets/facet", STORE_INT, last ? (size_t)(last->first + last->n_facet) : 0, pockets->facet, err);
}

silt_status silt_pockets_restore(silt_pockets *pockets, const silt_mesh *mesh, silt_store *store, silt_error *err) {
    silt_pockets_clear(pockets);
#define TAKE(name, type, value) SILT_TRY(silt_store_take(store, name, type, 1, &(value), err));
    POCKETS_PARTS(TAKE)
#undef TAKE
    if (pockets->count < 0 || pockets->n_member < 0)
        return silt_fail(err, SILT_FAILED, "the checkpoint's air pockets are damaged: %d pockets, %d nodes", pockets->count,
                         pockets->n_member);
    const size_t count = (size_t)pockets->count;
    SILT_RESERVE(pockets->pocket, pockets->capacity, pockets->count + 1);
    SILT_RESERVE(pockets->member, pockets->member_capacity, pockets->n_member + 1);
    SILT_TRY(silt_store_take(store, "pockets/pocket", STORE_BYTE, count * sizeof *pockets->pocket, pockets->pocket, err));
    SILT_TRY(silt_store_take(store, "pockets/member", STORE_LONG, 2 * (size_t)pockets->n_member, pockets->member, err));
    const silt_pocket_state *last = count ? &pockets->pocket[count - 1] : NULL;
    const int n_facet = last ? last->first + last->n_facet : 0;
    SILT_RESERVE(pockets->facet, pockets->facet_capacity, n_facet + 1);
    SILT_TRY(silt_store_take(store, "pockets/facet", STORE_INT, (size_t)n_facet, pockets->facet, err));
    for (int k = 0; k < n_facet; k++)
        if (pockets->facet[k] < 0 || pockets->facet[k] >= mesh->n_facet)
            return silt_fail(err, SILT_FAILED, "the checkpoint's air pockets are damaged: facet %d of %d", pockets->facet[k], mesh->n_facet);
    pockets_nodes(pockets, mesh);
    return SILT_OK;
}

void silt_pockets_clear(silt_pockets *pockets) {
    free(pockets->pocket);
    free(pockets->facet);
    free(pockets->node);
    free(pockets->vector);
    free(pockets->member);
    *pockets = (silt_pockets){0};
}
