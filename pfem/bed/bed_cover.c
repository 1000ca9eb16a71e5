// what resting and rolling parcels cover of the bed: there their stress is not the bed's
#include "bed_law.h"
#include "bed_mesh.h"

#define COVER_REACH 2.0 // bed.size: exposed nodes so near to a parcel's foot share what it covers; on an even surface their shares add up alike

// exposed nodes in a grid of bins as wide as the reach
typedef struct cover_grid {
    int dim, n[3];
    double lo[3], bin, reach;
    int *first, *next; // owned, one per bin and one per node
} cover_grid;

static int grid_at(const cover_grid *grid, int d, double x) {
    return (int)silt_clamp(floor((x - grid->lo[d]) / grid->bin), -2, grid->n[d] + 1);
}

static void grid_make(cover_grid *grid, const silt_bed *bed, int dim, double reach) {
    double hi[3] = {0};
    bool any = false;
    *grid = (cover_grid){.dim = dim, .n = {1, 1, 1}};
    for (int k = 0; k < bed->n_node; k++) {
        for (int d = 0; d < dim && bed->exposed[k]; d++) {
            grid->lo[d] = any ? silt_min(grid->lo[d], bed->x[k][d]) : bed->x[k][d];
            hi[d] = any ? silt_max(hi[d], bed->x[k][d]) : bed->x[k][d];
        }
        any |= bed->exposed[k] != 0;
    }
    grid->bin = grid->reach = reach;
    for (int d = 0; d < dim; d++)
        grid->bin = silt_max(grid->bin, (hi[d] - grid->lo[d]) / 512);
    for (int d = 0; d < dim; d++)
        grid->n[d] = (int)((hi[d] - grid->lo[d]) / grid->bin) + 1;
    const int n_bin = grid->n[0] * grid->n[1] * grid->n[2];
    grid->first = silt_alloc((size_t)n_bin, sizeof *grid->first);
    grid->next = silt_alloc((size_t)bed->n_node + 1, sizeof *grid->next);
    for (int b = 0; b < n_bin; b++)
        grid->first[b] = -1;
    for (int k = bed->n_node - 1; k >= 0; k--) {
        if (!bed->exposed[k])
            continue;
        int at = 0;
        for (int d = dim - 1; d >= 0; d--)
            at = at * grid->n[d] + (int)silt_min(grid_at(grid, d, bed->x[k][d]), grid->n[d] - 1);
        grid->next[k] = grid->first[at];
        grid->first[at] = k;
    }
}

// Adds `amount` times the weight over `whole` of each node near a parcel of radius r to sum (NULL: nothing). @return the weights' sum
static double grid_share(const cover_grid *grid, const silt_bed *bed, const double *x, double r, double amount, double whole, double *sum) {
    const double reach = grid->reach, far = sqrt(reach * reach + r * r); // along the bed, from the centre
    int low[3] = {0}, high[3] = {0};
    double weights = 0;
    for (int d = 0; d < grid->dim; d++) {
        low[d] = (int)silt_max(grid_at(grid, d, x[d] - far), 0);
        high[d] = (int)silt_min(grid_at(grid, d, x[d] + far), grid->n[d] - 1);
    }
    for (int w = low[2]; w <= high[2]; w++)
        for (int v = low[1]; v <= high[1]; v++)
            for (int u = low[0]; u <= high[0]; u++)
                for (int k = grid->first[(w * grid->n[1] + v) * grid->n[0] + u]; k >= 0; k = grid->next[k]) {
                    double way = 0;
                    for (int d = 0; d < grid->dim; d++)
                        way += silt_square(x[d] - bed->x[k][d]);
                    const double weight = silt_max(1 - sqrt(silt_max(way - r * r, 0)) / reach, 0) * bed->index->length[k];
                    weights += weight;
                    if (sum)
                        sum[k] += amount * weight / whole;
                }
    return weights;
}

void silt_bed_cover(const silt_bed *bed, const silt_scene *scene, const silt_grain_state *grains, double *cover) {
    const int dim = scene->dimension == 3 ? 3 : 2;
    memset(cover, 0, (size_t)bed->n_node * sizeof *cover);
    if (bed->n_edge == 0)
        return;
    cover_grid grid;
    grid_make(&grid, bed, dim, COVER_REACH * bed_size(scene));
    for (int k = 0; k < grains->count; k++) {
        if (!grains->on_bed[k])
            continue;
        const double r = grains->radius[k];
        const double whole = grid_share(&grid, bed, grains->x + 3 * k, r, 0, 1, NULL);
        if (whole > 0)
            grid_share(&grid, bed, grains->x + 3 * k, r, dim == 3 ? M_PI * r * r : 2 * r, whole, cover);
    }
    for (int k = 0; k < bed->n_node; k++)
        cover[k] = bed->exposed[k] ? silt_min(cover[k] / bed->index->length[k], 1) : 0;
    free(grid.first);
    free(grid.next);
}
