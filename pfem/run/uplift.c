// Uplift: where a body stands so close on a wall, the bed or another body that no cell of the water is between them, water is there all the
// same. Its pressure is that of the rim, linear along the outline from one end to the other; nought at an end that lies in air.
#include "run.h"

#define UPLIFT_SHUT 0.02 // of fluid.size: a gap whose mouth is narrower lets nothing through
#define UPLIFT_GAP 0.5 // of fluid.size: what is nearer to something solid has no air between

/** a stretch of the outline without cells: nodes in order, the first and the last of them are its rim */
typedef struct silt_gap {
    int first, count;  // in silt_uplift.node
    bool wet[2];       // whether the ends have pressure
} silt_gap;

struct silt_uplift {
    int n_rim, rim_capacity;
    int (*rim)[3];   // owned, facets of the water at the rims that are none of the body: the body's node, the facet, 1: it is shut
    int n_node, n_gap, node_capacity, gap_capacity, ring_capacity, place_capacity, shut_capacity;
    int *node;       // owned
    silt_gap *gap;   // owned
    int *ring;       // owned, nodes of a body in order
    int *place;      // owned, per node: in the ring
    uint8_t *shut;   // owned, per segment of the ring: 1: water behind it, 2: no water but something solid near, 0: air
};

void silt_uplift_free(silt_uplift **uplift) {
    if (!*uplift)
        return;
    free((*uplift)->node);
    free((*uplift)->gap);
    free((*uplift)->rim);
    free((*uplift)->ring);
    free((*uplift)->place);
    free((*uplift)->shut);
    free(*uplift);
    *uplift = NULL;
}

static double segment_distance(const double *a, const double *b, const double *x) {
    const double e[2] = {b[0] - a[0], b[1] - a[1]}, d[2] = {x[0] - a[0], x[1] - a[1]};
    const double t = silt_clamp((e[0] * d[0] + e[1] * d[1]) / (e[0] * e[0] + e[1] * e[1]), 0, 1);
    return hypot(d[0] - t * e[0], d[1] - t * e[1]);
}

// something solid besides body b within reach of x
static bool near_solid(const silt_run *run, int b, const double *x, double reach) {
    int element;
    if (run->walls.count && fabs(silt_walls_distance(&run->walls, x, &element)) < reach)
        return true;
    for (int k = 0; k < run->bed.n_edge; k++)
        if (segment_distance(run->bed.x[run->bed.edge[k][0]], run->bed.x[run->bed.edge[k][1]], x) < reach)
            return true;
    for (int o = 0; o < run->n_body_before; o++) {
        const struct silt_body *body = &run->body_before[o];
        const double c = 1 - 2 * silt_square(body->q[3]), s = 2 * body->q[0] * body->q[3];
        const double d[2] = {x[0] - body->x[0], x[1] - body->x[1]}, local[2] = {c * d[0] + s * d[1], c * d[1] - s * d[0]};
        for (int k = 0; o != b && k < body->n_point; k++)
            if (segment_distance(body->point + 2 * k, body->point + 2 * ((k + 1) % body->n_point), local) < reach)
                return true;
    }
    return false;
}

// nodes of the body in order: they were made so. @return how many
static int ring_make(silt_uplift *u, const silt_run *run, int b) {
    const silt_nodes *nodes = &run->nodes;
    int n = 0;
    for (int i = 0; i < nodes->count; i++)
        n += nodes->kind[i] == NODE_BODY && nodes->owner[i] == b;
    SILT_RESERVE(u->ring, u->ring_capacity, n + 1);
    SILT_RESERVE(u->shut, u->shut_capacity, n + 1);
    SILT_RESERVE(u->place, u->place_capacity, nodes->count + 1);
    n = 0;
    for (int i = 0; i < nodes->count; i++) {
        if (nodes->kind[i] != NODE_BODY || nodes->owner[i] != b)
            continue;
        int k = n++;
        for (; k > 0 && nodes->id[u->ring[k - 1]] > nodes->id[i]; k--)
            u->ring[k] = u->ring[k - 1];
        u->ring[k] = i;
    }
    for (int k = 0; k < n; k++)
        u->place[u->ring[k]] = k;
    return n;
}

// what is behind the segments of the ring; @return whether any of them is shut
static bool ring_look(silt_uplift *u, const silt_run *run, int b, int n) {
    const silt_nodes *nodes = &run->nodes;
    const silt_mesh *mesh = &run->mesh;
    bool water = false, shut = false;
    memset(u->shut, 0, (size_t)n + 1);
    for (int f = 0; f < mesh->n_facet; f++) {
        const int i = mesh->facet[f][0], j = mesh->facet[f][1];
        if (mesh->facet_kind[f] != FACET_BODY || nodes->owner[i] != b)
            continue;
        const int p = u->place[i], q = u->place[j];
        if ((p + 1) % n == q)
            u->shut[p] = 1;
        else if ((q + 1) % n == p)
            u->shut[q] = 1;
        water = true;
    }
    for (int k = 0; k < n && water; k++) {
        const double *x = nodes->x + 2 * u->ring[k], *y = nodes->x + 2 * u->ring[(k + 1) % n];
        const double middle[2] = {0.5 * (x[0] + y[0]), 0.5 * (x[1] + y[1])};
        if (!u->shut[k] && near_solid(run, b, middle, UPLIFT_GAP * run->scene->fluid.size)) {
            u->shut[k] = 2;
            shut = true;
        }
    }
    return shut;
}

// facets between a gap's rim and what the body stands on: what presses on them is not the body's, though its node there holds it
static void rims_find(silt_uplift *u, const silt_run *run) {
    const silt_nodes *nodes = &run->nodes;
    const silt_mesh *mesh = &run->mesh;
    SILT_RESERVE(u->place, u->place_capacity, nodes->count + 1);
    memset(u->place, 0, (size_t)nodes->count * sizeof *u->place);
    for (int g = 0; g < u->n_gap; g++)
        for (int end = 0; end < 2; end++)
            if (u->gap[g].wet[end])
                u->place[u->node[u->gap[g].first + (end ? u->gap[g].count - 1 : 0)]] = 1;
    u->n_rim = 0;
    for (int f = 0; f < mesh->n_facet && u->n_gap; f++)
        for (int c = 0; c < 2; c++) {
            const int i = mesh->facet[f][c];
            if (!u->place[i] || mesh->facet_kind[f] == FACET_BODY)
                continue;
            SILT_RESERVE(u->rim, u->rim_capacity, u->n_rim + 1);
            u->rim[u->n_rim][0] = i;
            u->rim[u->n_rim][1] = f;
            u->rim[u->n_rim++][2] = near_solid(run, nodes->owner[i], nodes->x + 2 * i, UPLIFT_SHUT * run->scene->fluid.size);
        }
}

// Water that nothing but such gaps opens is closed: its nodes there are no free surface
static void rims_close(const silt_uplift *u, silt_run *run) {
    silt_mesh *mesh = &run->mesh;
    for (int k = 0; k < u->n_rim; k++)
        for (int c = 0; c < 2 && u->rim[k][2]; c++)
            mesh->surface[mesh->facet[u->rim[k][1]][c]] = 0;
    for (int f = 0, k = 0; f < mesh->n_facet && u->n_rim; f++) {
        for (k = 0; k < u->n_rim && (u->rim[k][1] != f || !u->rim[k][2]);)
            k++;
        for (int c = 0; c < 2 && mesh->facet_kind[f] == FACET_FREE && k == u->n_rim; c++)
            mesh->surface[mesh->facet[f][c]] = 1;
    }
}

void silt_uplift_open(const silt_uplift *u, silt_run *run) {
    silt_mesh *mesh = &run->mesh;
    for (int k = 0; u && k < u->n_rim; k++)
        for (int c = 0; c < 2 && mesh->facet_kind[u->rim[k][1]] == FACET_FREE; c++)
            mesh->surface[mesh->facet[u->rim[k][1]][c]] = 1;
}

void silt_uplift_find(silt_uplift **uplift, silt_run *run) {
    if (!*uplift)
        *uplift = silt_alloc(1, sizeof **uplift);
    silt_uplift *u = *uplift;
    u->n_node = u->n_gap = 0;
    for (int b = 0; b < run->n_body_before && silt_nodes_dim(&run->nodes) == 2; b++) {
        const int n = ring_make(u, run, b);
        if (n < 3 || !ring_look(u, run, b, n))
            continue;
        for (int k = 0; k < n; k++) {
            if (u->shut[k] != 2 || u->shut[(k + n - 1) % n] == 2)
                continue;
            SILT_RESERVE(u->gap, u->gap_capacity, u->n_gap + 1);
            silt_gap *gap = &u->gap[u->n_gap];
            *gap = (silt_gap){.first = u->n_node, .wet = {u->shut[(k + n - 1) % n] == 1}};
            int end = k;
            for (; u->shut[end % n] == 2; end++) {
                SILT_RESERVE(u->node, u->node_capacity, u->n_node + 2);
                u->node[u->n_node++] = u->ring[end % n];
            }
            u->node[u->n_node++] = u->ring[end % n];
            gap->count = u->n_node - gap->first;
            gap->wet[1] = u->shut[end % n] == 1;
            if (gap->wet[0] || gap->wet[1])
                u->n_gap++;
            else
                u->n_node = gap->first;
        }
    }
    rims_find(u, run);
    rims_close(u, run);
}

bool silt_uplift_mouths(const silt_uplift *u, const silt_run *run, double *out) {
    const double *x = run->nodes.x, *p = run->nodes.p;
    memset(out, 0, (size_t)(2 * run->nodes.count) * sizeof *out);
    for (int k = 0; k < u->n_rim; k++) {
        const int i = u->rim[k][0], *facet = run->mesh.facet[u->rim[k][1]], j = facet[facet[0] == i];
        if (run->nodes.kind[j] == NODE_BODY || !u->rim[k][2])
            continue;
        const double share = (p[i] + 2 * p[j]) / 6;
        out[2 * j] -= share * (x[2 * facet[1] + 1] - x[2 * facet[0] + 1]);
        out[2 * j + 1] += share * (x[2 * facet[1]] - x[2 * facet[0]]);
    }
    return u->n_rim > 0;
}

static void rims_force(const silt_uplift *u, const silt_run *run, const double *p, double factor, double *out) {
    const double *x = run->fluid.x_mid;
    for (int k = 0; k < u->n_rim; k++) {
        const int i = u->rim[k][0], f = u->rim[k][1], b = run->nodes.owner[i];
        const int *facet = run->mesh.facet[f], j = facet[facet[0] == i];
        const double dx = x[2 * facet[1]] - x[2 * facet[0]], dy = x[2 * facet[1] + 1] - x[2 * facet[0] + 1];
        const double share = -factor * (2 * p[i] + p[j]) / 6, force[2] = {share * dy, -share * dx};
        double arm[2];
        for (int d = 0; d < 2; d++)
            arm[d] = x[2 * i + d] - 0.5 * (run->body_before[b].x[d] + run->body_after[b].x[d]);
        out[6 * b] += force[0];
        out[6 * b + 1] += force[1];
        out[6 * b + 5] += arm[0] * force[1] - arm[1] * force[0];
    }
}

void silt_uplift_force(const silt_uplift *u, const silt_run *run, const double *p, double factor, double *out) {
    if (u)
        rims_force(u, run, p, factor, out);
    for (int g = 0; u && g < u->n_gap; g++) {
        const silt_gap *gap = &u->gap[g];
        const int *node = u->node + gap->first, b = run->nodes.owner[node[0]];
        const double ends[2] = {gap->wet[0] ? p[node[0]] : 0, gap->wet[1] ? p[node[gap->count - 1]] : 0};
        double length = 0, way = 0, before[2] = {0}, total = 0;
        for (int pass = 0; pass < 2; pass++)
            for (int k = 0; k < gap->count; k++) {
                double arm[2];
                for (int d = 0; d < 2; d++)
                    arm[d] = run->nodes.x[2 * node[k] + d] + 0.5 * run->dt * (run->body_velocity[2 * node[k] + d] + run->body_shift[2 * node[k] + d]) -
                             0.5 * (run->body_before[b].x[d] + run->body_after[b].x[d]);
                const double dx = arm[0] - before[0], dy = arm[1] - before[1], step = k ? hypot(dx, dy) : 0;
                if (pass == 0)
                    length += step;
                else if (k) {
                    // the outline runs counter-clockwise: outwards is (dy, -dx)
                    const double a = ends[0] + (ends[1] - ends[0]) * way / total, c = ends[0] + (ends[1] - ends[0]) * (way + step) / total;
                    const double force[2] = {-0.5 * (a + c) * dy, 0.5 * (a + c) * dx};
                    out[6 * b] += factor * force[0];
                    out[6 * b + 1] += factor * force[1];
                    for (int d = 0; d < 2; d++) { // of a pressure linear along the segment
                        const double lever = (a * (2 * before[d] + arm[d]) + c * (before[d] + 2 * arm[d])) / 6;
                        out[6 * b + 5] += factor * lever * (d ? dy : dx);
                    }
                    way += step;
                }
                memcpy(before, arm, sizeof before);
                if (pass == 0 && k == gap->count - 1)
                    total = length;
            }
    }
}
