#include "touch.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

// squared distance of p from wall w, taken as a line when it is a plane
static double touch_wall_distance(const double w[4], bool line, const double *p) {
    double d[2] = {w[2] - w[0], w[3] - w[1]}, r[2] = {p[0] - w[0], p[1] - w[1]};
    double length = d[0] * d[0] + d[1] * d[1];
    double t = length > 0 ? (r[0] * d[0] + r[1] * d[1]) / length : 0;
    if (!line)
        t = fmin(fmax(t, 0), 1);
    double e[2] = {r[0] - t * d[0], r[1] - t * d[1]};
    return e[0] * e[0] + e[1] * e[1];
}

// squared distance of p from a triangle, taken as its plane when it is one (Ericson, Real-Time Collision Detection, 5.1.5)
static double touch_triangle_distance(const double t[9], bool plane, const double *p) {
    double u[3], v[3], n[3], r[3], length = 0, height = 0;
    for (int d = 0; d < 3; d++) {
        u[d] = t[3 + d] - t[d];
        v[d] = t[6 + d] - t[d];
        r[d] = p[d] - t[d];
    }
    for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3, f = (d + 2) % 3;
        n[d] = u[e] * v[f] - u[f] * v[e];
        length += n[d] * n[d];
        height += n[d] * r[d];
    }
    if (!(length > 0))
        return INFINITY;
    bool inside = true;
    double best = INFINITY;
    for (int c = 0; c < 3 && !plane; c++) {
        const double *a = t + 3 * c, *b = t + 3 * ((c + 1) % 3);
        double side = 0, along = 0, square = 0, distance = 0;
        for (int d = 0; d < 3; d++) {
            const int e = (d + 1) % 3, f = (d + 2) % 3;
            side += n[d] * ((b[e] - a[e]) * (p[f] - a[f]) - (b[f] - a[f]) * (p[e] - a[e]));
            along += (b[d] - a[d]) * (p[d] - a[d]);
            square += (b[d] - a[d]) * (b[d] - a[d]);
        }
        const double share = fmin(fmax(along / square, 0), 1);
        for (int d = 0; d < 3; d++)
            distance += (p[d] - a[d] - share * (b[d] - a[d])) * (p[d] - a[d] - share * (b[d] - a[d]));
        inside &= side >= 0;
        best = fmin(best, distance);
    }
    return inside ? height * height / length : best;
}

// walls that touch a grain; what lies in one plane counts once
static int touch_walls(const dem_shared *shared, const int *plane, const double *x, double radius) {
    const double(*wall)[4] = (const double(*)[4])DEM_SECTION(shared, const double, wall);
    const double(*triangle)[10] = (const double(*)[10])DEM_SECTION(shared, const double, triangle);
    int count = 0, known = 0;
    for (int w = 0; w < shared->n_wall; w++)
        if (plane[w] >= 0 && touch_wall_distance(wall[w], plane[w] == 1, x) < radius * radius)
            count++;
    plane += shared->n_wall;
    for (int k = 0; k < shared->n_triangle; k++) {
        const double *t = triangle[k];
        if (plane[k] < 0 || touch_triangle_distance(t, plane[k] == 1, x) >= radius * radius)
            continue;
        // a face's axis and side of the grain
        const int axis = t[0] == t[3] && t[0] == t[6] ? 0 : t[1] == t[4] && t[1] == t[7] ? 1 : 2;
        const int face = 1 << (2 * axis + (t[axis] > x[axis]));
        if (plane[k] == 1 && known & face)
            continue;
        known |= plane[k] == 1 ? face : 0;
        count++;
    }
    return count;
}

/** a grid of cells as wide as the largest sphere, at most a few cells per sphere; periodic in x */
typedef struct touch_grid {
    double lo[3], width[3], period;
    int n[3];
} touch_grid;

static touch_grid touch_grid_make(int n, double *const *x, const double *radius, const dem_shared *shared) {
    touch_grid g = {.period = shared->periodic ? shared->hi[0] - shared->lo[0] : 0};
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY}, largest = 0;
    for (int i = 0; i < n; i++) {
        largest = fmax(largest, radius[i]);
        for (int k = 0; k < 3; k++) {
            lo[k] = fmin(lo[k], x[i][k]);
            hi[k] = fmax(hi[k], x[i][k]);
        }
    }
    if (g.period > 0) {
        lo[0] = shared->lo[0];
        hi[0] = shared->hi[0];
    }
    double width = fmax(2 * largest, 1e-300), most = 4.0 * n + 64;
    while ((floor((hi[0] - lo[0]) / width) + 1) * (floor((hi[1] - lo[1]) / width) + 1) * (floor((hi[2] - lo[2]) / width) + 1) > most)
        width *= 1.5;
    for (int k = 0; k < 3; k++) {
        g.lo[k] = lo[k];
        g.n[k] = (int)((hi[k] - lo[k]) / width) + 1;
        g.width[k] = width;
    }
    // whole cells in a period
    if (g.period > 0) {
        g.n[0] = (int)fmax(1, floor(g.period / width));
        g.width[0] = g.period / g.n[0];
    }
    return g;
}

static void touch_at(const touch_grid *g, const double *x, int at[3]) {
    for (int k = 0; k < 3; k++) {
        at[k] = (int)floor((x[k] - g->lo[k]) / g->width[k]);
        at[k] = at[k] < 0 ? 0 : at[k] >= g->n[k] ? g->n[k] - 1 : at[k];
    }
}

int touch_count(int n, double *const *x, const double *radius, const int *type, const dem_shared *shared,
                const int *plane, int *contacts, int *on_bed) {
    int *cell = NULL, *start = NULL, *order = NULL, status = -1;

    memset(contacts, 0, (size_t)n * sizeof *contacts);
    memset(on_bed, 0, (size_t)n * sizeof *on_bed);
    if (n == 0)
        return 0;
    const touch_grid g = touch_grid_make(n, x, radius, shared);
    const int n_cell = g.n[0] * g.n[1] * g.n[2];

    // sort the spheres by cell
    cell = malloc((size_t)n * sizeof *cell);
    order = malloc((size_t)n * sizeof *order);
    start = calloc((size_t)n_cell + 1, sizeof *start);
    if (!cell || !order || !start)
        goto done;
    for (int i = 0; i < n; i++) {
        int at[3];
        touch_at(&g, x[i], at);
        cell[i] = (at[2] * g.n[1] + at[1]) * g.n[0] + at[0];
        start[cell[i] + 1]++;
    }
    for (int c = 0; c < n_cell; c++)
        start[c + 1] += start[c];
    for (int i = n - 1; i >= 0; i--)
        order[--start[cell[i] + 1]] = i;
    // filling backwards moved every start one cell up: start[c + 1] is now where cell c begins

    for (int i = 0; i < n; i++) {
        if (type[i] != DEM_TYPE_GRAIN)
            continue;
        int at[3], first[3], last[3];
        touch_at(&g, x[i], at);
        for (int k = 0; k < 3; k++) {
            const bool around = k == 0 && g.period > 0;
            // in a short period no cell comes twice
            first[k] = around ? at[k] - (g.n[k] > 2) : at[k] > 0 ? at[k] - 1 : 0;
            last[k] = around ? at[k] + (g.n[k] > 1) : at[k] + 1 < g.n[k] ? at[k] + 1 : at[k];
        }
        for (int bz = first[2]; bz <= last[2]; bz++)
            for (int by = first[1]; by <= last[1]; by++)
                for (int bx = first[0]; bx <= last[0]; bx++) {
                    int c = (bz * g.n[1] + by) * g.n[0] + (bx + g.n[0]) % g.n[0], end = c + 1 < n_cell ? start[c + 2] : n;
                    for (int k = start[c + 1]; k < end; k++) {
                        int j = order[k];
                        double dx = x[j][0] - x[i][0], dy = x[j][1] - x[i][1], dz = x[j][2] - x[i][2], reach = radius[i] + radius[j];
                        if (g.period > 0)
                            dx -= g.period * floor(dx / g.period + 0.5);
                        if (j == i || dx * dx + dy * dy + dz * dz >= reach * reach)
                            continue;
                        contacts[i]++;
                        on_bed[i] |= type[j] == DEM_TYPE_FROZEN || type[j] == DEM_TYPE_FIXED_BODY;
                    }
                }
        const int walls = touch_walls(shared, plane, x[i], radius[i]);
        contacts[i] += walls;
        on_bed[i] |= walls > 0;
    }
    status = 0;
done:
    free(cell);
    free(order);
    free(start);
    return status;
}
