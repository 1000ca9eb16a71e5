// finds the cell of the water's mesh that holds a point: a uniform grid over the cells' boxes
#include "pfem.h"

static int grid_index(double x, double lo, double size, int n) {
    const double f = floor((x - lo) / size);
    return f < 0 ? 0 : f >= n ? n - 1 : (int)f;
}

static void cell_box(const silt_mesh *mesh, const double *x, int e, double lo[2], double hi[2]) {
    for (int d = 0; d < 2; d++) {
        lo[d] = hi[d] = x[2 * mesh->cell[e][0] + d];
        for (int a = 1; a < 3; a++) {
            lo[d] = silt_min(lo[d], x[2 * mesh->cell[e][a] + d]);
            hi[d] = silt_max(hi[d], x[2 * mesh->cell[e][a] + d]);
        }
    }
}

void silt_locator_build(silt_locator *locator, const silt_mesh *mesh, const double *x, double h) {
    double lo[2] = {HUGE_VAL, HUGE_VAL}, hi[2] = {-HUGE_VAL, -HUGE_VAL};
    for (int e = 0; e < mesh->n_cell; e++)
        for (int a = 0; a < 3; a++)
            for (int d = 0; d < 2; d++) {
                lo[d] = silt_min(lo[d], x[2 * mesh->cell[e][a] + d]);
                hi[d] = silt_max(hi[d], x[2 * mesh->cell[e][a] + d]);
            }
    if (mesh->n_cell == 0)
        lo[0] = lo[1] = hi[0] = hi[1] = 0;

    // bins of about one cell; coarser when the water is spread over a large empty box
    double size = 1.5 * h;
    while ((hi[0] - lo[0]) / size * ((hi[1] - lo[1]) / size) > 4.0 * mesh->n_cell + 64)
        size *= 1.5;
    locator->lo[0] = lo[0];
    locator->lo[1] = lo[1];
    locator->cell_size = size;
    locator->nx = (int)((hi[0] - lo[0]) / size) + 1;
    locator->ny = (int)((hi[1] - lo[1]) / size) + 1;
    const int n = locator->nx * locator->ny;
    SILT_RESERVE(locator->start, locator->start_capacity, n + 1);
    memset(locator->start, 0, (size_t)(n + 1) * sizeof *locator->start);

    // count, sum, fill
    for (int pass = 0; pass < 2; pass++) {
        for (int e = 0; e < mesh->n_cell; e++) {
            double a[2], b[2];
            cell_box(mesh, x, e, a, b);
            const int i0 = grid_index(a[0], lo[0], size, locator->nx), i1 = grid_index(b[0], lo[0], size, locator->nx);
            const int j0 = grid_index(a[1], lo[1], size, locator->ny), j1 = grid_index(b[1], lo[1], size, locator->ny);
            for (int j = j0; j <= j1; j++)
                for (int i = i0; i <= i1; i++) {
                    const int bin = j * locator->nx + i;
                    if (pass == 0)
                        locator->start[bin]++;
                    else
                        locator->item[--locator->start[bin]] = e;
                }
        }
        if (pass == 0) {
            int sum = 0;
            for (int k = 0; k < n; k++)
                sum = locator->start[k] += sum;
            locator->start[n] = sum;
            SILT_RESERVE(locator->item, locator->item_capacity, sum + 1);
        }
    }
}

int silt_locate(const silt_locator *locator, const silt_mesh *mesh, const double *x, const double *point, double weight[3]) {
    const double fx = (point[0] - locator->lo[0]) / locator->cell_size, fy = (point[1] - locator->lo[1]) / locator->cell_size;
    if (!locator->start || !(fx > -1e-6 && fy > -1e-6 && fx < locator->nx + 1e-6 && fy < locator->ny + 1e-6))
        return -1;
    const int i = grid_index(point[0], locator->lo[0], locator->cell_size, locator->nx);
    const int j = grid_index(point[1], locator->lo[1], locator->cell_size, locator->ny);
    const int bin = j * locator->nx + i;
    int best = -1;
    double best_least = -1e-9;
    for (int k = locator->start[bin]; k < locator->start[bin + 1]; k++) {
        const int e = locator->item[k];
        const double *a = x + 2 * mesh->cell[e][0], *b = x + 2 * mesh->cell[e][1], *c = x + 2 * mesh->cell[e][2];
        const double twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if (!(twice > 0))
            continue;
        const double w1 = ((point[0] - a[0]) * (c[1] - a[1]) - (point[1] - a[1]) * (c[0] - a[0])) / twice;
        const double w2 = ((b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0])) / twice;
        const double w0 = 1 - w1 - w2, least = silt_min(w0, silt_min(w1, w2));
        // on a shared edge the lower cell number wins, whatever the order in the bin
        if (least > best_least || (best >= 0 && least == best_least && e < best)) {
            best = e;
            best_least = least;
            weight[0] = w0;
            weight[1] = w1;
            weight[2] = w2;
            if (least > 1e-12)
                break;
        }
    }
    return best;
}

void silt_locator_clear(silt_locator *locator) {
    free(locator->start);
    free(locator->item);
    *locator = (silt_locator){0};
}
