// where cells stand in memory: near in space is near in the arrays, so that gathers and scatters hit the cache
#include "remesh.h"

// a cell's lowest node first; a triangle only, turned round
static void cell_turn(int cell[4]) {
    while (cell[3] < 0 && (cell[1] < cell[0] || cell[2] < cell[0])) {
        const int first = cell[0];
        cell[0] = cell[1];
        cell[1] = cell[2];
        cell[2] = first;
    }
}

static int cell_lowest(const int cell[4]) {
    int lowest = cell[0];
    for (int a = 1; a < 4; a++)
        lowest = cell[a] >= 0 && cell[a] < lowest ? cell[a] : lowest;
    return lowest;
}

void silt_cells_sort(int n_node, int n, int (*cell)[4], int (*sorted)[4]) {
    int *start = silt_alloc((size_t)n_node + 1, sizeof *start);
    for (int e = 0; e < n; e++) {
        cell_turn(cell[e]);
        start[cell_lowest(cell[e])]++;
    }
    int sum = 0;
    for (int i = 0; i <= n_node; i++) {
        const int count = i < n_node ? start[i] : 0;
        start[i] = sum;
        sum += count;
    }
    for (int e = 0; e < n; e++)
        memcpy(sorted[start[cell_lowest(cell[e])]++], cell[e], sizeof *cell);
    free(start);
    // triangles of one lowest node by their second: no two have the same
    for (int e = 1; e < n; e++) {
        int moved[4], k = e;
        memcpy(moved, sorted[e], sizeof moved);
        for (; moved[3] < 0 && k > 0 && sorted[k - 1][0] == moved[0] && sorted[k - 1][1] > moved[1]; k--)
            memcpy(sorted[k], sorted[k - 1], sizeof moved);
        memcpy(sorted[k], moved, sizeof moved);
    }
}
