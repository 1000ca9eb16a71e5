/** @file region.c
 * Closed parts of the plane or of space, and the polygon arithmetic that the scene's checks need.
 */
#include "scene.h"

// twice the signed area of the triangle a b c: positive when c lies left of a -> b
static double region_turn(const double *a, const double *b, const double *c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

double silt_polygon_area(int n, const double *point) {
    // about the first point: no loss of digits far from the origin
    double sum = 0;
    for (int i = 1; i + 1 < n; i++)
        sum += region_turn(point, point + 3 * i, point + 3 * (i + 1));
    return 0.5 * sum;
}

void silt_polygon_centroid(int n, const double *point, double centre[3]) {
    double area = 0, x = 0, y = 0;
    for (int i = 1; i + 1 < n; i++) {
        const double *b = point + 3 * i, *c = point + 3 * (i + 1);
        double part = region_turn(point, b, c);
        area += part;
        x += part * ((b[0] - point[0]) + (c[0] - point[0])) / 3;
        y += part * ((b[1] - point[1]) + (c[1] - point[1])) / 3;
    }
    centre[0] = point[0] + (area != 0 ? x / area : 0);
    centre[1] = point[1] + (area != 0 ? y / area : 0);
    centre[2] = 0;
}

bool silt_polygon_contains(int n, const double *point, const double *x) {
    // edges that cross the ray to +x; the half-open rule in y counts a corner once
    bool inside = false;
    for (int i = 0, k = n - 1; i < n; k = i++) {
        const double *a = point + 3 * k, *b = point + 3 * i;
        if ((a[1] > x[1]) == (b[1] > x[1]))
            continue;
        double turn = region_turn(a, b, x);
        if (b[1] > a[1] ? turn > 0 : turn < 0)
            inside = !inside;
    }
    return inside;
}

static bool region_between(double a, double b, double x) {
    return silt_min(a, b) <= x && x <= silt_max(a, b);
}

bool silt_segments_meet(const double *a, const double *b, const double *c, const double *d) {
    if (silt_max(a[0], b[0]) < silt_min(c[0], d[0]) || silt_max(c[0], d[0]) < silt_min(a[0], b[0]) ||
        silt_max(a[1], b[1]) < silt_min(c[1], d[1]) || silt_max(c[1], d[1]) < silt_min(a[1], b[1]))
        return false;
    double c_side = region_turn(a, b, c), d_side = region_turn(a, b, d);
    double a_side = region_turn(c, d, a), b_side = region_turn(c, d, b);
    if (((c_side > 0 && d_side < 0) || (c_side < 0 && d_side > 0)) &&
        ((a_side > 0 && b_side < 0) || (a_side < 0 && b_side > 0)))
        return true;
    // an end on the other segment
    return (c_side == 0 && region_between(a[0], b[0], c[0]) && region_between(a[1], b[1], c[1])) ||
           (d_side == 0 && region_between(a[0], b[0], d[0]) && region_between(a[1], b[1], d[1])) ||
           (a_side == 0 && region_between(c[0], d[0], a[0]) && region_between(c[1], d[1], a[1])) ||
           (b_side == 0 && region_between(c[0], d[0], b[0]) && region_between(c[1], d[1], b[1]));
}

typedef struct region_edge {
    double left; // smallest x
    int index;
} region_edge;

static int region_edge_order(const void *a, const void *b) {
    const region_edge *p = a, *q = b;
    if (p->left != q->left)
        return p->left < q->left ? -1 : 1;
    return p->index - q->index;
}

// two neighbouring edges may share their corner only: they must not fold back
static bool region_folds(const double *a, const double *corner, const double *b) {
    return region_turn(a, corner, b) == 0 &&
           (a[0] - corner[0]) * (b[0] - corner[0]) + (a[1] - corner[1]) * (b[1] - corner[1]) > 0;
}

bool silt_chain_straight(int n, const double *point) {
    for (int i = 1; i + 1 < n; i++)
        if (region_turn(point, point + 3 * i, point + 3 * (i + 1)) != 0)
            return false;
    return true;
}

bool silt_chain_crosses(int n, const double *point, bool closed, int crossing[2]) {
    int n_edge = closed ? n : n - 1;
    if (n_edge < 2)
        return false;
    region_edge *edge = silt_alloc((size_t)n_edge, sizeof *edge);
    for (int i = 0; i < n_edge; i++)
        edge[i] = (region_edge){silt_min(point[3 * i], point[3 * ((i + 1) % n)]), i};
    qsort(edge, (size_t)n_edge, sizeof *edge, region_edge_order);
    // only edges that overlap in x are compared
    bool found = false;
    for (int p = 0; p < n_edge && !found; p++) {
        int i = edge[p].index;
        const double *a = point + 3 * i, *b = point + 3 * ((i + 1) % n);
        double right = silt_max(a[0], b[0]);
        for (int q = p + 1; q < n_edge && edge[q].left <= right && !found; q++) {
            int k = edge[q].index;
            const double *c = point + 3 * k, *d = point + 3 * ((k + 1) % n);
            bool next = (i + 1) % n == k && (closed || i + 1 == k), before = (k + 1) % n == i && (closed || k + 1 == i);
            if (next && before)
                found = true; // two edges there and back
            else if (next)
                found = region_folds(a, b, d);
            else if (before)
                found = region_folds(c, a, b);
            else
                found = silt_segments_meet(a, b, c, d);
            if (found) {
                crossing[0] = i < k ? i : k;
                crossing[1] = i < k ? k : i;
            }
        }
    }
    free(edge);
    return found;
}

bool silt_region_space(const silt_region *region) {
    switch (region->kind) {
    case REGION_BOX:
        return region->hi[2] > region->lo[2];
    case REGION_POLYGON:
        return region->hi[1] > region->lo[1];
    case REGION_SPHERE:
        return true;
    case REGION_CIRCLE:
        break;
    }
    return false;
}

bool silt_region_contains(const silt_region *region, const double *x) {
    const bool space = silt_region_space(region);
    switch (region->kind) {
    case REGION_BOX:
        return region->lo[0] <= x[0] && x[0] <= region->hi[0] && region->lo[1] <= x[1] && x[1] <= region->hi[1] &&
               (!space || (region->lo[2] <= x[2] && x[2] <= region->hi[2]));
    case REGION_POLYGON:
        if (space)
            return region->lo[1] <= x[1] && x[1] <= region->hi[1] &&
                   silt_polygon_contains(region->n_point, region->point, (const double[2]){x[0], x[2]});
        return silt_polygon_contains(region->n_point, region->point, x);
    case REGION_CIRCLE:
    case REGION_SPHERE:
        return silt_square(x[0] - region->centre[0]) + silt_square(x[1] - region->centre[1]) +
                   (space ? silt_square(x[2] - region->centre[2]) : 0) <=
               silt_square(region->radius);
    }
    return false;
}

double silt_segment_distance(const double *a, const double *b, const double *x) {
    const double u[2] = {b[0] - a[0], b[1] - a[1]}, w[2] = {x[0] - a[0], x[1] - a[1]};
    const double length = silt_dot(2, u, u), share = length > 0 ? silt_clamp(silt_dot(2, u, w) / length, 0, 1) : 0;
    return hypot(w[0] - share * u[0], w[1] - share * u[1]);
}

double silt_region_depth(const silt_region *region, const double *x) {
    const bool space = silt_region_space(region);
    const int dim = space ? 3 : 2;
    double depth = HUGE_VAL;
    switch (region->kind) {
    case REGION_BOX:
        for (int k = 0; k < dim; k++)
            depth = silt_min(depth, silt_min(x[k] - region->lo[k], region->hi[k] - x[k]));
        return depth;
    case REGION_POLYGON: {
        const double flat[2] = {x[0], space ? x[2] : x[1]};
        for (int i = 0, k = region->n_point - 1; i < region->n_point; k = i++)
            depth = silt_min(depth, silt_segment_distance(region->point + 3 * k, region->point + 3 * i, flat));
        if (!silt_polygon_contains(region->n_point, region->point, flat))
            depth = -depth;
        return space ? silt_min(depth, silt_min(x[1] - region->lo[1], region->hi[1] - x[1])) : depth;
    }
    case REGION_CIRCLE:
    case REGION_SPHERE:
        for (int k = 0; k < dim; k++)
            depth = k ? hypot(depth, x[k] - region->centre[k]) : fabs(x[k] - region->centre[k]);
        return region->radius - depth;
    }
    return -HUGE_VAL;
}

double silt_region_area(const silt_region *region) {
    const bool space = silt_region_space(region);
    switch (region->kind) {
    case REGION_BOX:
        return (region->hi[0] - region->lo[0]) * (region->hi[1] - region->lo[1]) *
               (space ? region->hi[2] - region->lo[2] : 1);
    case REGION_POLYGON:
        return silt_polygon_area(region->n_point, region->point) * (space ? region->hi[1] - region->lo[1] : 1);
    case REGION_CIRCLE:
        return M_PI * silt_square(region->radius);
    case REGION_SPHERE:
        return 4 * M_PI / 3 * silt_square(region->radius) * region->radius;
    }
    return 0;
}

void silt_region_bounds(const silt_region *region, double *lo, double *hi) {
    const bool space = silt_region_space(region), ball = region->kind == REGION_CIRCLE || region->kind == REGION_SPHERE;
    for (int k = 0; k < (space ? 3 : 2); k++) {
        lo[k] = ball ? region->centre[k] - region->radius : region->lo[k];
        hi[k] = ball ? region->centre[k] + region->radius : region->hi[k];
    }
    if (region->kind != REGION_POLYGON)
        return;
    // the prism's corners are x and z
    for (int c = 0; c < 2; c++) {
        const int k = space && c == 1 ? 2 : c;
        lo[k] = HUGE_VAL;
        hi[k] = -HUGE_VAL;
        for (int i = 0; i < region->n_point; i++) {
            lo[k] = silt_min(lo[k], region->point[3 * i + c]);
            hi[k] = silt_max(hi[k], region->point[3 * i + c]);
        }
    }
}
