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

// sorts an order of the nodes by their place along an axis, in pieces of h; equal ones stay as they are
static void sort_along(const silt_nodes *nodes, int axis, double low, double h, int pieces, int *order, int *spare) {
    const int dim = silt_nodes_dim(nodes), n = nodes->count;
    int *start = silt_alloc((size_t)pieces + 1, sizeof *start);
    for (int i = 0; i < n; i++)
        start[(int)silt_clamp((nodes->x[dim * i + axis] - low) / h, 0, pieces - 1) + 1]++;
    for (int k = 0; k < pieces; k++)
        start[k + 1] += start[k];
    for (int k = 0; k < n; k++)
        spare[start[(int)silt_clamp((nodes->x[dim * order[k] + axis] - low) / h, 0, pieces - 1)]++] = order[k];
    memcpy(order, spare, (size_t)n * sizeof *order);
    free(start);
}

bool silt_nodes_order(const silt_mesh *mesh, const int *map, const silt_nodes *nodes, double h, int *order) {
    const int dim = silt_nodes_dim(nodes), n = nodes->count;
    if (n < PARALLEL_LEAST || !nodes_mixed(mesh, map, n))
        return false;
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    int axis[3] = {0, 1, 2}, *spare = silt_alloc((size_t)n + 1, sizeof *spare);
    for (int i = 0; i < n; i++) {
        order[i] = i;
        for (int d = 0; d < dim; d++) {
            low[d] = silt_min(low[d], nodes->x[dim * i + d]);
            high[d] = silt_max(high[d], nodes->x[dim * i + d]);
        }
    }
    // slabs across the longest way, in them rows, and in those nodes along the shortest: sorted by the last first
    for (int a = 1; a < dim; a++)
        for (int b = a; b > 0 && high[axis[b]] - low[axis[b]] < high[axis[b - 1]] - low[axis[b - 1]]; b--) {
            const int t = axis[b];
            axis[b] = axis[b - 1];
            axis[b - 1] = t;
        }
    for (int a = 0; a < dim; a++) {
        const double extent = high[axis[a]] - low[axis[a]];
        sort_along(nodes, axis[a], low[axis[a]], h, (int)silt_clamp(extent / h + 1, 1, n), order, spare);
    }
    free(spare);
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
