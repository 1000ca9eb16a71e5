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

int touch_count(int n, double *const *x, const double *radius, const int *type, const dem_shared *shared,
                const int *plane, int *contacts, int *on_bed) {
    const double(*wall)[4] = (const double(*)[4])DEM_SECTION(shared, const double, wall);
    int *cell = NULL, *start = NULL, *order = NULL, status = -1;

    memset(contacts, 0, (size_t)n * sizeof *contacts);
    memset(on_bed, 0, (size_t)n * sizeof *on_bed);
    if (n == 0)
        return 0;
    // a grid of cells as wide as the largest sphere, at most a few cells per sphere
    double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY}, largest = 0;
    for (int i = 0; i < n; i++) {
        largest = fmax(largest, radius[i]);
        for (int k = 0; k < 2; k++) {
            lo[k] = fmin(lo[k], x[i][k]);
            hi[k] = fmax(hi[k], x[i][k]);
        }
    }
    double width = fmax(2 * largest, 1e-300), most = 4.0 * n + 64;
    while ((floor((hi[0] - lo[0]) / width) + 1) * (floor((hi[1] - lo[1]) / width) + 1) > most)
        width *= 1.5;
    int nx = (int)((hi[0] - lo[0]) / width) + 1, ny = (int)((hi[1] - lo[1]) / width) + 1;

    // sort the spheres by cell
    cell = malloc((size_t)n * sizeof *cell);
    order = malloc((size_t)n * sizeof *order);
    start = calloc((size_t)nx * ny + 1, sizeof *start);
    if (!cell || !order || !start)
        goto done;
    for (int i = 0; i < n; i++) {
        cell[i] = (int)((x[i][1] - lo[1]) / width) * nx + (int)((x[i][0] - lo[0]) / width);
        start[cell[i] + 1]++;
    }
    for (int c = 0; c < nx * ny; c++)
        start[c + 1] += start[c];
    for (int i = n - 1; i >= 0; i--)
        order[--start[cell[i] + 1]] = i;
    // filling backwards moved every start one cell up: start[c + 1] is now where cell c begins

    for (int i = 0; i < n; i++) {
        if (type[i] != DEM_TYPE_GRAIN)
            continue;
        int cx = cell[i] % nx, cy = cell[i] / nx;
        for (int by = cy > 0 ? cy - 1 : 0; by <= cy + 1 && by < ny; by++)
            for (int bx = cx > 0 ? cx - 1 : 0; bx <= cx + 1 && bx < nx; bx++) {
                int c = by * nx + bx, end = c + 1 < nx * ny ? start[c + 2] : n;
                for (int k = start[c + 1]; k < end; k++) {
                    int j = order[k];
                    double dx = x[j][0] - x[i][0], dy = x[j][1] - x[i][1], reach = radius[i] + radius[j];
                    if (j == i || dx * dx + dy * dy >= reach * reach)
                        continue;
                    contacts[i]++;
                    on_bed[i] |= type[j] == DEM_TYPE_FROZEN || type[j] == DEM_TYPE_FIXED_BODY;
                }
            }
        for (int w = 0; w < shared->n_wall; w++)
            if (plane[w] >= 0 && touch_wall_distance(wall[w], plane[w] == 1, x[i]) < radius[i] * radius[i]) {
                contacts[i]++;
                on_bed[i] = 1;
            }
    }
    status = 0;
done:
    free(cell);
    free(order);
    free(start);
    return status;
}
