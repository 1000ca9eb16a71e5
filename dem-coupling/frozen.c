// frozen.c: the crust of frozen spheres along the bed's surface
#include "frozen.h"

static const double frozen_overlap = 0.01; // of the radius: how far a new sphere may reach into what moves
static const double frozen_least = 0.25;   // of the radius: smaller ones are left out
static const double frozen_reach = 1.1;    // of the radius: how far from the bed a deposited grain still rests on it

struct silt_frozen_edge {
    int node[2];
    double end[2][2];
    bool seen;
};

static int frozen_compare(const void *a, const void *b) {
    const struct silt_frozen_edge *p = a, *q = b;
    if (p->node[0] != q->node[0])
        return p->node[0] < q->node[0] ? -1 : 1;
    return (p->node[1] > q->node[1]) - (p->node[1] < q->node[1]);
}

// the bed's exposed edges, sorted by their nodes
static void frozen_edges(silt_frozen *f, const silt_bed *bed) {
    SILT_RESERVE(f->edge, f->edge_capacity, bed->n_edge);
    f->n_edge = bed->n_edge;
    for (int i = 0; i < bed->n_edge; i++) {
        struct silt_frozen_edge *edge = &f->edge[i];
        *edge = (struct silt_frozen_edge){.node = {bed->edge[i][0], bed->edge[i][1]}};
        for (int k = 0; k < 2; k++)
            memcpy(edge->end[k], bed->x[edge->node[k]], sizeof edge->end[k]);
    }
    if (f->n_edge > 1)
        qsort(f->edge, (size_t)f->n_edge, sizeof *f->edge, frozen_compare);
}

static double frozen_segment_distance(const double a[2], const double b[2], const double x[2]) {
    double e[2] = {b[0] - a[0], b[1] - a[1]}, square = e[0] * e[0] + e[1] * e[1];
    double t = square > 0.0 ? silt_clamp((e[0] * (x[0] - a[0]) + e[1] * (x[1] - a[1])) / square, 0.0, 1.0) : 0.0;
    return hypot(x[0] - a[0] - t * e[0], x[1] - a[1] - t * e[1]);
}

// true while the bed holds or carries a deposited grain
static bool frozen_carried(const silt_frozen *f, const silt_bed *bed, const silt_frozen_sphere *s) {
    for (int i = 0; i < f->n_edge; i++)
        if (frozen_segment_distance(f->edge[i].end[0], f->edge[i].end[1], s->x) <= frozen_reach * s->radius)
            return true;
    for (int i = 0; i < bed->n_cell; i++) {
        const double *a = bed->x[bed->cell[i][0]], *b = bed->x[bed->cell[i][1]], *c = bed->x[bed->cell[i][2]];
        if ((b[0] - a[0]) * (s->x[1] - a[1]) >= (b[1] - a[1]) * (s->x[0] - a[0]) &&
            (c[0] - b[0]) * (s->x[1] - b[1]) >= (c[1] - b[1]) * (s->x[0] - b[0]) &&
            (a[0] - c[0]) * (s->x[1] - c[1]) >= (a[1] - c[1]) * (s->x[0] - c[0]))
            return true;
    }
    return false;
}

// the sphere's edge is there as it was
static bool frozen_edge_stands(silt_frozen *f, const silt_frozen_sphere *s) {
    struct silt_frozen_edge key = {.node = {s->node[0], s->node[1]}};
    struct silt_frozen_edge *edge =
        f->n_edge > 0 ? bsearch(&key, f->edge, (size_t)f->n_edge, sizeof *f->edge, frozen_compare) : NULL;
    if (edge == NULL || memcmp(edge->end, s->end, sizeof s->end) != 0)
        return false;
    edge->seen = true;
    return true;
}

static silt_frozen_sphere *frozen_append(silt_frozen *f, const double x[2], double radius, int64_t *next_id) {
    SILT_RESERVE(f->sphere, f->capacity, f->count + 1);
    silt_frozen_sphere *s = &f->sphere[f->count++];
    *s = (silt_frozen_sphere){.id = (*next_id)++, .x = {x[0], x[1]}, .radius = radius, .node = {-1, -1}};
    return s;
}

void silt_frozen_add(silt_frozen *f, const double x[2], double radius, int64_t *next_id) {
    frozen_append(f, x, radius, next_id);
}

void silt_frozen_update(silt_frozen *f, const silt_bed *bed, double radius, int64_t *next_id, silt_frozen_gap gap,
                        silt_frozen_drop drop, void *context) {
    frozen_edges(f, bed);

    // what lost its edge or its support goes
    int kept = 0;
    for (int i = 0; i < f->count; i++) {
        silt_frozen_sphere *s = &f->sphere[i];
        if (s->node[0] >= 0 ? frozen_edge_stands(f, s) : frozen_carried(f, bed, s))
            f->sphere[kept++] = *s;
        else if (s->sent)
            drop(context, s->id);
    }
    f->count = kept;

    // new edges: centres below the surface, the bed lies on the right
    for (int i = 0; i < f->n_edge; i++) {
        const struct silt_frozen_edge *edge = &f->edge[i];
        double d[2] = {edge->end[1][0] - edge->end[0][0], edge->end[1][1] - edge->end[0][1]},
               length = hypot(d[0], d[1]);
        int n = (int)ceil(length / radius - 1e-9);
        for (int k = 0; k < n && !edge->seen; k++) {
            double t = (k + 0.5) / n;
            double x[2] = {edge->end[0][0] + t * d[0] + radius * d[1] / length,
                           edge->end[0][1] + t * d[1] - radius * d[0] / length};
            double r = silt_min(radius, gap(context, x) + frozen_overlap * radius);
            if (r < frozen_least * radius)
                continue;
            silt_frozen_sphere *s = frozen_append(f, x, r, next_id);
            memcpy(s->node, edge->node, sizeof s->node);
            memcpy(s->end, edge->end, sizeof s->end);
        }
    }
}

void silt_frozen_clear(silt_frozen *f) {
    free(f->sphere);
    free(f->edge);
    *f = (silt_frozen){0};
}
