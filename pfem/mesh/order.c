// where cells stand in memory: near in space is near in the arrays, so that gathers and scatters hit the cache
#include "remesh.h"

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
