// finds the cell of the water's mesh that holds a point: a uniform grid over the cells' boxes
#include "pfem.h"

static int bin_index(const silt_locator *locator, int d, double x) {
    const double f = floor((x - locator->lo[d]) / locator->size[d]);
    return f < 0 ? 0 : f >= locator->n[d] ? locator->n[d] - 1 : (int)f;
}

// bins that a cell's box touches along an axis; on a periodic one they may run past the end
static void cell_bins(const silt_locator *locator, const silt_mesh *mesh, const double *x, int e, int first[3],
                      int last[3]) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    double corner[12];
    silt_cell_corners(mesh, x, mesh->cell[e], corner);
    first[2] = last[2] = 0;
    for (int d = 0; d < dim; d++) {
        double lo = corner[d], hi = corner[d];
        for (int a = 1; a <= dim; a++) {
            lo = silt_min(lo, corner[dim * a + d]);
            hi = silt_max(hi, corner[dim * a + d]);
        }
        if (mesh->period[d] > 0) {
            first[d] = (int)floor((lo - locator->lo[d]) / locator->size[d]);
            last[d] = (int)floor((hi - locator->lo[d]) / locator->size[d]);
            last[d] = last[d] - first[d] < locator->n[d] ? last[d] : first[d] + locator->n[d] - 1;
        } else {
            first[d] = bin_index(locator, d, lo);
            last[d] = bin_index(locator, d, hi);
        }
    }
}

static int wrap(int i, int n) {
    const int r = i % n;
    return r < 0 ? r + n : r;
}

void silt_locator_build(silt_locator *locator, const silt_mesh *mesh, const double *x, double h) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (int e = 0; e < mesh->n_cell; e++)
        for (int a = 0; a <= dim; a++)
            for (int d = 0; d < dim; d++) {
                lo[d] = silt_min(lo[d], x[dim * mesh->cell[e][a] + d]);
                hi[d] = silt_max(hi[d], x[dim * mesh->cell[e][a] + d]);
            }
    for (int d = 0; d < 3; d++) {
        if (mesh->n_cell == 0 || d >= dim)
            lo[d] = hi[d] = 0;
        else if (mesh->period[d] > 0)
            hi[d] = lo[d] + mesh->period[d];
    }

    // bins of about one cell; coarser when the water is spread over a large empty box
    double size = 1.5 * h;
    while ((hi[0] - lo[0]) / size * ((hi[1] - lo[1]) / size) * (dim == 3 ? (hi[2] - lo[2]) / size : 1) >
           4.0 * mesh->n_cell + 64)
        size *= 1.5;
    for (int d = 0; d < 3; d++) {
        const bool periodic = mesh->period[d] > 0 && hi[d] > lo[d];
        const double bins = floor((hi[d] - lo[d]) / size);
        locator->lo[d] = lo[d];
        locator->n[d] = periodic ? (int)silt_max(1, bins) : (int)bins + 1;
        locator->size[d] = periodic ? mesh->period[d] / locator->n[d] : size;
    }
    const int *n = locator->n, count = n[0] * n[1] * n[2];
    SILT_RESERVE(locator->start, locator->start_capacity, count + 1);
    memset(locator->start, 0, (size_t)(count + 1) * sizeof *locator->start);

    // count, sum, fill
    for (int pass = 0; pass < 2; pass++) {
        for (int e = 0; e < mesh->n_cell; e++) {
            int first[3], last[3];
            cell_bins(locator, mesh, x, e, first, last);
            for (int k = first[2]; k <= last[2]; k++)
                for (int j = first[1]; j <= last[1]; j++)
                    for (int i = first[0]; i <= last[0]; i++) {
                        const int bin = (wrap(k, n[2]) * n[1] + wrap(j, n[1])) * n[0] + wrap(i, n[0]);
                        if (pass == 0)
                            locator->start[bin]++;
                        else
                            locator->item[--locator->start[bin]] = e;
                    }
        }
        if (pass == 0) {
            int sum = 0;
            for (int k = 0; k < count; k++)
                sum = locator->start[k] += sum;
            locator->start[count] = sum;
            SILT_RESERVE(locator->item, locator->item_capacity, sum + 1);
        }
    }
}

// barycentric weights of a point; false: the cell has no volume
static bool weights_2d(const double *c, const double *point, double *w) {
    const double *a = c, *b = c + 2, *d = c + 4;
    const double twice = (b[0] - a[0]) * (d[1] - a[1]) - (b[1] - a[1]) * (d[0] - a[0]);
    if (!(twice > 0))
        return false;
    w[1] = ((point[0] - a[0]) * (d[1] - a[1]) - (point[1] - a[1]) * (d[0] - a[0])) / twice;
    w[2] = ((b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0])) / twice;
    w[0] = 1 - w[1] - w[2];
    return true;
}

static bool weights_3d(const double *c, const double *point, double *w) {
    double edge[3][3], to[3];
    for (int d = 0; d < 3; d++) {
        to[d] = point[d] - c[d];
        for (int a = 0; a < 3; a++)
            edge[a][d] = c[3 * (a + 1) + d] - c[d];
    }
    const double six = silt_triple(edge[0], edge[1], edge[2]);
    if (!(six > 0))
        return false;
    w[1] = silt_triple(to, edge[1], edge[2]) / six;
    w[2] = silt_triple(edge[0], to, edge[2]) / six;
    w[3] = silt_triple(edge[0], edge[1], to) / six;
    w[0] = 1 - w[1] - w[2] - w[3];
    return true;
}

int silt_locate(const silt_locator *locator, const silt_mesh *mesh, const double *x, const double *point,
                double *weight) {
    if (!locator->start)
        return -1;
    const int dim = mesh->dim == 3 ? 3 : 2, *n = locator->n;
    int bin = 0;
    for (int d = dim - 1; d >= 0; d--) {
        double at = point[d];
        if (mesh->period[d] > 0)
            at -= mesh->period[d] * floor((at - locator->lo[d]) / mesh->period[d]);
        const double f = (at - locator->lo[d]) / locator->size[d];
        if (!(f > -1e-6 && f < n[d] + 1e-6))
            return -1;
        bin = bin * n[d] + bin_index(locator, d, at);
    }
    int best = -1;
    double best_least = -1e-9;
    for (int k = locator->start[bin]; k < locator->start[bin + 1]; k++) {
        const int e = locator->item[k];
        double corner[12], near[3], w[4];
        silt_cell_corners(mesh, x, mesh->cell[e], corner);
        for (int d = 0; d < dim; d++) {
            near[d] = point[d];
            if (mesh->period[d] > 0)
                near[d] -= mesh->period[d] * floor((near[d] - corner[d]) / mesh->period[d] + 0.5);
        }
        if (!(dim == 3 ? weights_3d(corner, near, w) : weights_2d(corner, near, w)))
            continue;
        double least = silt_min(w[0], silt_min(w[1], w[2]));
        if (dim == 3)
            least = silt_min(least, w[3]);
        // on a shared facet the lower cell number wins, whatever the order in the bin
        if (least > best_least || (best >= 0 && least == best_least && e < best)) {
            best = e;
            best_least = least;
            memcpy(weight, w, (size_t)(dim + 1) * sizeof *w);
            if (least > 1e-12)
                break;
        }
    }
    return best;
}

int silt_locate_from(const silt_mesh *mesh, const double *x, const double *point, int cell, double *weight) {
    const int most = 32;
    if (mesh->dim == 3 || mesh->period[0] > 0 || mesh->period[1] > 0)
        return -1;
    for (int n = 0; n < most && cell >= 0; n++) {
        double corner[12], w[4];
        silt_cell_corners(mesh, x, mesh->cell[cell], corner);
        if (!weights_2d(corner, point, w))
            return -1;
        const int least = w[0] < w[1] ? (w[0] < w[2] ? 0 : 2) : (w[1] < w[2] ? 1 : 2);
        if (w[least] > 1e-12) {
            memcpy(weight, w, 3 * sizeof *w);
            return cell;
        }
        cell = mesh->across[cell][least];
    }
    return -1;
}

void silt_locator_clear(silt_locator *locator) {
    free(locator->start);
    free(locator->item);
    *locator = (silt_locator){0};
}
