// frozen.c: the crust of frozen spheres along the bed's surface
#include "frozen.h"

static const double frozen_overlap = 0.01; // of the radius: how far a new sphere may reach into what moves
static const double frozen_spacing = 1.5; // of the radius, in space: grains as large sink in by a tenth of theirs
static const double frozen_least = 0.25;   // of the radius: smaller ones are left out
static const double frozen_reach = 1.1;    // of the radius: how far from the bed a deposited grain still rests on it

struct silt_frozen_edge {
    int node[3];
    double end[3][3];
    bool seen;
};

static int frozen_compare(const void *a, const void *b) {
    const struct silt_frozen_edge *p = a, *q = b;
    for (int k = 0; k < 3; k++)
        if (p->node[k] != q->node[k])
            return p->node[k] < q->node[k] ? -1 : 1;
    return 0;
}

// the bed's exposed edges, sorted by their nodes
static void frozen_edges(silt_frozen *f, const silt_bed *bed) {
    SILT_RESERVE(f->edge, f->edge_capacity, bed->n_edge);
    f->n_edge = bed->n_edge;
    for (int i = 0; i < bed->n_edge; i++) {
        struct silt_frozen_edge *edge = &f->edge[i];
        *edge = (struct silt_frozen_edge){.node = {bed->edge[i][0], bed->edge[i][1], bed->dim == 3 ? bed->edge[i][2] : -1}};
        for (int k = 0; k < 3; k++)
            if (edge->node[k] >= 0)
                memcpy(edge->end[k], bed->x[edge->node[k]], sizeof edge->end[k]);
    }
    if (f->n_edge > 1)
        qsort(f->edge, (size_t)f->n_edge, sizeof *f->edge, frozen_compare);
}

// true while the bed holds or carries a deposited grain
static bool frozen_carried(const silt_bed *bed, const silt_frozen_sphere *s) {
    for (int i = 0; i < bed->n_edge; i++)
        if (silt_bed_facet_distance(bed, bed->edge[i], s->x) <= frozen_reach * s->radius)
            return true;
    return silt_bed_contains(bed, s->x);
}

// the sphere's edge is there as it was
static bool frozen_edge_stands(silt_frozen *f, const silt_frozen_sphere *s) {
    struct silt_frozen_edge key = {.node = {s->node[0], s->node[1], s->node[2]}};
    struct silt_frozen_edge *edge =
        f->n_edge > 0 ? bsearch(&key, f->edge, (size_t)f->n_edge, sizeof *f->edge, frozen_compare) : NULL;
    if (edge == NULL || memcmp(edge->end, s->end, sizeof s->end) != 0)
        return false;
    edge->seen = true;
    return true;
}

static silt_frozen_sphere *frozen_append(silt_frozen *f, const double x[3], double radius, int64_t *next_id) {
    SILT_RESERVE(f->sphere, f->capacity, f->count + 1);
    silt_frozen_sphere *s = &f->sphere[f->count++];
    *s = (silt_frozen_sphere){.id = (*next_id)++, .x = {x[0], x[1], x[2]}, .radius = radius, .node = {-1, -1, -1}};
    return s;
}

void silt_frozen_add(silt_frozen *f, const double x[3], double radius, int64_t *next_id) {
    frozen_append(f, x, radius, next_id);
}

// centres of spheres that touch an edge from below, the bed lies on its right; x: malloc'ed. @return how many
static int frozen_along(const struct silt_frozen_edge *edge, double radius, double **x) {
    double d[2] = {edge->end[1][0] - edge->end[0][0], edge->end[1][1] - edge->end[0][1]}, length = hypot(d[0], d[1]);
    int n = (int)ceil(length / radius - 1e-9);
    *x = silt_alloc(3 * (size_t)n + 1, sizeof **x);
    for (int k = 0; k < n; k++) {
        double t = (k + 0.5) / n;
        (*x)[3 * k] = edge->end[0][0] + t * d[0] + radius * d[1] / length;
        (*x)[3 * k + 1] = edge->end[0][1] + t * d[1] - radius * d[0] / length;
    }
    return n;
}

// the same under a face, at the middles of the triangles that it divides into: the outermost reach over its edges
static int frozen_under(const struct silt_frozen_edge *face, double radius, double **x) {
    double normal[3], size = 0, longest = 0;
    for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3, g = (d + 2) % 3;
        const double *p = face->end[0], *q = face->end[1], *r = face->end[2];
        normal[d] = (q[e] - p[e]) * (r[g] - p[g]) - (q[g] - p[g]) * (r[e] - p[e]);
        size += normal[d] * normal[d];
    }
    for (int k = 0; k < 3; k++) {
        double square = 0;
        for (int d = 0; d < 3; d++)
            square += silt_square(face->end[(k + 1) % 3][d] - face->end[k][d]);
        longest = silt_max(longest, sqrt(square));
    }
    const int n = (int)silt_max(1, ceil(longest / (frozen_spacing * radius) - 1e-9));
    int count = 0;
    *x = silt_alloc(3 * (size_t)(n * n) + 1, sizeof **x);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n - i; j++)
            for (int down = 0; down <= (j < n - i - 1); down++, count++) {
                const double a = (i + (down ? 2 : 1) / 3.0) / n, b = (j + (down ? 2 : 1) / 3.0) / n;
                for (int d = 0; d < 3; d++)
                    (*x)[3 * count + d] = face->end[0][d] + a * (face->end[1][d] - face->end[0][d]) +
                                          b * (face->end[2][d] - face->end[0][d]) - radius * normal[d] / sqrt(size);
            }
    return count;
}

void silt_frozen_update(silt_frozen *f, const silt_bed *bed, double radius, int64_t *next_id, silt_frozen_gap gap,
                        silt_frozen_drop drop, void *context) {
    frozen_edges(f, bed);

    // what lost its edge or its support goes
    int kept = 0;
    for (int i = 0; i < f->count; i++) {
        silt_frozen_sphere *s = &f->sphere[i];
        if (s->node[0] >= 0 ? frozen_edge_stands(f, s) : frozen_carried(bed, s))
            f->sphere[kept++] = *s;
        else if (s->sent)
            drop(context, s->id);
    }
    f->count = kept;

    for (int i = 0; i < f->n_edge; i++) {
        const struct silt_frozen_edge *edge = &f->edge[i];
        if (edge->seen)
            continue;
        double *at = NULL;
        const int n = edge->node[2] < 0 ? frozen_along(edge, radius, &at) : frozen_under(edge, radius, &at);
        for (int k = 0; k < n; k++) {
            double r = silt_min(radius, gap(context, at + 3 * k, radius) + frozen_overlap * radius);
            if (r < frozen_least * radius)
                continue;
            silt_frozen_sphere *s = frozen_append(f, at + 3 * k, r, next_id);
            memcpy(s->node, edge->node, sizeof s->node);
            memcpy(s->end, edge->end, sizeof s->end);
        }
        free(at);
    }
}

void silt_frozen_clear(silt_frozen *f) {
    free(f->sphere);
    free(f->edge);
    *f = (silt_frozen){0};
}
