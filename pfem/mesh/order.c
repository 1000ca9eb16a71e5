// where nodes and cells stand in memory: near in space is near in the arrays, so that gathers and scatters hit the cache, and parts of
// the cells that several threads work on have few nodes in common
#include "parallel.h"
#include "remesh.h"

#define ORDER_WIDE 4.0   // slabs of nodes, in what a cube would have, that a cell may span
#define ORDER_SHARE 0.1  // of the cells that may span more
#define ORDER_EVERY 8    // of the cells that are looked at

// Water that mixes carries its nodes' numbers through each other.
static bool nodes_mixed(const silt_mesh *mesh, const int *map, int n) {
    const int dim = mesh->dim == 3 ? 3 : 2, most = (int)(ORDER_WIDE * pow(n, (dim - 1.0) / dim));
    int seen = 0, wide = 0;
    for (int e = 0; e < mesh->n_cell; e += ORDER_EVERY) {
        const int *cell = mesh->cell[e];
        int lowest = map[cell[0]], highest = lowest;
        for (int a = 1; a <= dim; a++) {
            lowest = map[cell[a]] < lowest ? map[cell[a]] : lowest;
            highest = map[cell[a]] > highest ? map[cell[a]] : highest;
        }
        seen++;
        wide += highest - lowest > most;
    }
    return wide > ORDER_SHARE * seen;
}

bool silt_nodes_order(const silt_mesh *mesh, const int *map, const silt_nodes *nodes, double h, int *order) {
    const int dim = silt_nodes_dim(nodes), n = nodes->count;
    if (n < PARALLEL_LEAST || !nodes_mixed(mesh, map, n))
        return false;
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < n; i++)
        for (int d = 0; d < dim; d++) {
            low[d] = silt_min(low[d], nodes->x[dim * i + d]);
            high[d] = silt_max(high[d], nodes->x[dim * i + d]);
        }
    // slabs across the longest way; in them the nodes stay in their order
    int axis = 0;
    for (int d = 1; d < dim; d++)
        axis = high[d] - low[d] > high[axis] - low[axis] ? d : axis;
    const int count = (int)silt_clamp((high[axis] - low[axis]) / h + 1, 1, n);
    int *start = silt_borrow((size_t)count + 1, sizeof *start), *slab = silt_borrow((size_t)n + 1, sizeof *slab);
    for (int i = 0; i < n; i++) {
        slab[i] = (int)silt_clamp((nodes->x[dim * i + axis] - low[axis]) / h, 0, count - 1);
        start[slab[i] + 1]++;
    }
    for (int k = 0; k < count; k++)
        start[k + 1] += start[k];
    for (int i = 0; i < n; i++)
        order[start[slab[i]]++] = i;
    silt_return(start);
    silt_return(slab);
    return true;
}

silt_bins silt_bins_create(int n_bin, int n_item) {
    silt_bins b = {.n_bin = n_bin, .n_item = n_item, .n_part = silt_threads(n_item / 4)};
    b.start = silt_borrow((size_t)n_bin + 1, sizeof *b.start);
    b.at = silt_borrow((size_t)n_bin * (size_t)b.n_part + 1, sizeof *b.at);
    return b;
}

void silt_bins_place(silt_bins *b) {
    int sum = 0;
    for (int i = 0; i < b->n_bin; i++) {
        b->start[i] = sum;
        for (int part = 0; part < b->n_part; part++) {
            int *at = b->at + (size_t)part * (size_t)b->n_bin + i;
            const int count = *at;
            *at = sum;
            sum += count;
        }
    }
    b->start[b->n_bin] = sum;
}

void silt_bins_clear(silt_bins *b) {
    silt_return(b->at);
    silt_return(b->start);
}

static int cell_lowest(int n_corner, const int *cell) {
    int lowest = cell[0];
    for (int a = 1; a < n_corner; a++)
        lowest = cell[a] < lowest ? cell[a] : lowest;
    return lowest;
}

// In CGAL's order, that of insertion, decide took 134 ns a node in place of 101, index 396 (320), the pressure's matrix 650 (500),
// and at 160k nodes assemble 2150 (1550).
void silt_cells_sort(int n_node, int n_corner, int n, int *node, int (*sorted)[4]) {
    silt_bins bins = silt_bins_create(n_node, n);
    SILT_PRAGMA(omp parallel for schedule(static) num_threads(bins.n_part))
    for (int part = 0; part < bins.n_part; part++)
        for (int e = silt_bins_first(&bins, part), last = silt_bins_first(&bins, part + 1); e < last; e++) {
            int *cell = node + n_corner * e;
            const int lowest = cell_lowest(n_corner, cell);
            while (n_corner == 3 && cell[0] != lowest) {
                const int first = cell[0];
                cell[0] = cell[1];
                cell[1] = cell[2];
                cell[2] = first;
            }
            bins.at[(size_t)part * (size_t)n_node + (size_t)lowest]++;
        }
    silt_bins_place(&bins);
    SILT_PRAGMA(omp parallel for schedule(static) num_threads(bins.n_part))
    for (int part = 0; part < bins.n_part; part++)
        for (int e = silt_bins_first(&bins, part), last = silt_bins_first(&bins, part + 1); e < last; e++) {
            const int *cell = node + n_corner * e;
            int *to = sorted[bins.at[(size_t)part * (size_t)n_node + (size_t)cell_lowest(n_corner, cell)]++];
            to[3] = -1;
            memcpy(to, cell, (size_t)n_corner * sizeof *cell);
        }
    silt_bins_clear(&bins);
    // triangles of one lowest node by their second: no two have the same
    for (int e = 1; e < n && n_corner == 3; e++) {
        int moved[4], k = e;
        memcpy(moved, sorted[e], sizeof moved);
        for (; k > 0 && sorted[k - 1][0] == moved[0] && sorted[k - 1][1] > moved[1]; k--)
            memcpy(sorted[k], sorted[k - 1], sizeof moved);
        if (k < e)
            memcpy(sorted[k], moved, sizeof moved);
    }
}
