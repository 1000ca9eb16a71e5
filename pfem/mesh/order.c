// where nodes and cells stand in memory: near in space is near in the arrays, so that gathers and scatters hit the cache, and parts of
// the cells that several threads work on have few nodes in common
#include "parallel.h"
#include "remesh.h"

#define ORDER_WIDE 4.0   // slabs of nodes, in what a cube would have, that a cell may span
#define ORDER_SHARE 0.04 // of the cells that may span more
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
    int *start = silt_alloc((size_t)count + 1, sizeof *start), *slab = silt_alloc((size_t)n + 1, sizeof *slab);
    for (int i = 0; i < n; i++) {
        slab[i] = (int)silt_clamp((nodes->x[dim * i + axis] - low[axis]) / h, 0, count - 1);
        start[slab[i] + 1]++;
    }
    for (int k = 0; k < count; k++)
        start[k + 1] += start[k];
    for (int i = 0; i < n; i++)
        order[start[slab[i]]++] = i;
    free(start);
    free(slab);
    return true;
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
    int *start = silt_alloc((size_t)n_node + 1, sizeof *start);
    for (int e = 0; e < n; e++) {
        int *cell = node + n_corner * e;
        const int lowest = cell_lowest(n_corner, cell);
        while (n_corner == 3 && cell[0] != lowest) {
            const int first = cell[0];
            cell[0] = cell[1];
            cell[1] = cell[2];
            cell[2] = first;
        }
        start[lowest]++;
    }
    int sum = 0;
    for (int i = 0; i <= n_node; i++) {
        const int count = i < n_node ? start[i] : 0;
        start[i] = sum;
        sum += count;
    }
    for (int e = 0; e < n; e++) {
        const int *cell = node + n_corner * e;
        int *to = sorted[start[cell_lowest(n_corner, cell)]++];
        to[3] = -1;
        memcpy(to, cell, (size_t)n_corner * sizeof *cell);
    }
    free(start);
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
