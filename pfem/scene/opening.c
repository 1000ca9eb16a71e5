/** @file opening.c
 * Where inlets and outlets are: a segment of a line, in space a flat convex polygon.
 */
#include "scene.h"

silt_opening silt_opening_of(const silt_scene *scene, int k) {
    const silt_fluid_def *fluid = &scene->fluid;
    silt_opening o = {.dim = scene->dimension == 3 ? 3 : 2, .inlet = k < fluid->n_inlet};
    if (o.inlet) {
        const silt_inlet *inlet = &fluid->inlet[k];
        o.n_corner = inlet->n_corner;
        o.corner = inlet->corner;
        o.from = inlet->from;
        o.to = inlet->to;
        o.level = inlet->drive == INLET_HEAD ? &inlet->head : NULL;
    } else {
        const silt_outlet *outlet = &fluid->outlet[k - fluid->n_inlet];
        o.n_corner = outlet->n_corner;
        o.corner = outlet->corner;
        o.from = outlet->from;
        o.to = outlet->to;
        o.level = outlet->level.n_row ? &outlet->level : NULL;
    }
    if (o.dim == 2) {
        const double dx = o.to[0] - o.from[0], dy = o.to[1] - o.from[1];
        o.size = hypot(dx, dy);
        o.normal[0] = -dy / o.size;
        o.normal[1] = dx / o.size;
        return o;
    }
    // twice the polygon's area as a vector
    for (int c = 0; c < o.n_corner; c++) {
        const double *a = o.corner, *p = a + 3 * c, *q = a + 3 * ((c + 1) % o.n_corner);
        double square = 0;
        for (int d = 0; d < 3; d++) {
            const int e = (d + 1) % 3, f = (d + 2) % 3;
            o.normal[d] += (p[e] - a[e]) * (q[f] - a[f]) - (p[f] - a[f]) * (q[e] - a[e]);
            square += silt_square(p[d] - a[d]);
        }
        o.size = silt_max(o.size, sqrt(square));
    }
    const double area = silt_length(3, o.normal);
    for (int d = 0; d < 3 && area > 0; d++)
        o.normal[d] /= area;
    return o;
}

double silt_opening_height(const silt_opening *o, const double *x) {
    const double *at = o->dim == 3 ? o->corner : o->from;
    double height = 0;
    for (int d = 0; d < o->dim; d++)
        height += (x[d] - at[d]) * o->normal[d];
    return height;
}

double silt_opening_depth(const silt_opening *o, const double *x) {
    if (o->dim == 2) {
        double along = 0;
        for (int d = 0; d < 2; d++)
            along += (x[d] - o->from[d]) * (o->to[d] - o->from[d]) / o->size;
        return silt_min(along, o->size - along);
    }
    double depth = HUGE_VAL;
    for (int c = 0; c < o->n_corner; c++) {
        const double *p = o->corner + 3 * c, *q = o->corner + 3 * ((c + 1) % o->n_corner);
        const double edge[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
        double in = 0;
        for (int d = 0; d < 3; d++) {
            const int e = (d + 1) % 3, f = (d + 2) % 3;
            in += (o->normal[e] * edge[f] - o->normal[f] * edge[e]) * (x[d] - p[d]);
        }
        depth = silt_min(depth, in / silt_length(3, edge));
    }
    return depth;
}

int silt_opening_on(const silt_scene *scene, const double *x, double gap, bool velocity) {
    for (int k = 0; k < silt_opening_count(scene); k++) {
        const silt_opening o = silt_opening_of(scene, k);
        if ((o.level || (velocity && o.inlet)) && fabs(silt_opening_height(&o, x)) <= gap && silt_opening_depth(&o, x) >= -gap)
            return k;
    }
    return -1;
}
