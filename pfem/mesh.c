// the water's triangles: adjacency, boundary and measures; what is water is decided in remesh.c
#include "pfem.h"

double silt_cell_area(const double *x, const int *cell) {
    const double *a = x + 2 * cell[0], *b = x + 2 * cell[1], *c = x + 2 * cell[2];
    return 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
}

int silt_group_find(int *parent, int i) {
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

void silt_group_join(int *parent, const int *cell) {
    for (int a = 1; a < 4 && cell[a] >= 0; a++) {
        const int p = silt_group_find(parent, cell[0]), q = silt_group_find(parent, cell[a]);
        parent[p > q ? p : q] = p > q ? q : p;
    }
}

double silt_mesh_volume(const silt_mesh *mesh, const double *x) {
    double sum = 0;
    for (int e = 0; e < mesh->n_cell; e++)
        sum += silt_cell_area(x, mesh->cell[e]);
    return sum;
}

static silt_facet_kind facet_kind(const silt_nodes *nodes, int a, int b) {
    const silt_node_kind ka = nodes->kind[a], kb = nodes->kind[b];
    if (ka == NODE_INLET && kb == NODE_INLET)
        return FACET_INLET;
    if (ka == NODE_BED && kb == NODE_BED)
        return FACET_BED;
    if (ka == NODE_BODY && kb == NODE_BODY && nodes->owner[a] == nodes->owner[b])
        return FACET_BODY;
    // on one wall segment, tank corners count for both of theirs; inlets and the bed end on walls
    for (int s = 0; s < 2; s++)
        for (int t = 0; t < 2; t++)
            if (nodes->wall[a][s] >= 0 && nodes->wall[a][s] == nodes->wall[b][t])
                return FACET_WALL;
    const bool fixed_a = ka == NODE_CORNER || ka == NODE_BED || ka == NODE_INLET;
    const bool fixed_b = kb == NODE_CORNER || kb == NODE_BED || kb == NODE_INLET;
    if (fixed_a && fixed_b)
        return FACET_WALL;
    if ((fixed_a && nodes->wall[b][0] >= 0) || (fixed_b && nodes->wall[a][0] >= 0))
        return FACET_WALL;
    return FACET_FREE;
}

static int compare_int(const void *a, const void *b) {
    return (*(const int *)a > *(const int *)b) - (*(const int *)a < *(const int *)b);
}

void silt_mesh_connect(silt_mesh *mesh, const silt_nodes *nodes) {
    const int n = nodes->count;
    mesh->revision++;
    mesh->n_node = n;
    SILT_RESERVE(mesh->wet, mesh->wet_capacity, n + 1);
    SILT_RESERVE(mesh->surface, mesh->surface_capacity, n + 1);
    SILT_RESERVE(mesh->node_cell_start, mesh->start_capacity, n + 1);
    SILT_RESERVE(mesh->neighbour_start, mesh->neighbour_start_capacity, n + 1);
    SILT_RESERVE(mesh->node_cell, mesh->node_cell_capacity, 3 * mesh->n_cell + 1);
    SILT_RESERVE(mesh->neighbour, mesh->neighbour_capacity, 7 * mesh->n_cell + n + 1);
    memset(mesh->wet, 0, (size_t)n);
    memset(mesh->surface, 0, (size_t)n);

    // cells of every node, rising
    int *start = mesh->node_cell_start;
    memset(start, 0, (size_t)(n + 1) * sizeof *start);
    for (int e = 0; e < mesh->n_cell; e++)
        for (int a = 0; a < 3; a++)
            start[mesh->cell[e][a]]++;
    int sum = 0;
    for (int i = 0; i <= n; i++) {
        const int count = i < n ? start[i] : 0;
        sum += count;
        start[i] = sum;
    }
    for (int e = mesh->n_cell - 1; e >= 0; e--)
        for (int a = 0; a < 3; a++)
            mesh->node_cell[--start[mesh->cell[e][a]]] = e;

    // neighbours, the node itself included, rising; an edge that only one cell has is boundary
    mesh->n_facet = 0;
    int filled = 0;
    for (int i = 0; i < n; i++) {
        int *list = mesh->neighbour + filled, count = 0;
        mesh->neighbour_start[i] = filled;
        list[count++] = i;
        for (int k = start[i]; k < start[i + 1]; k++)
            for (int a = 0; a < 3; a++) {
                const int j = mesh->cell[mesh->node_cell[k]][a];
                int known = 0;
                while (known < count && list[known] != j)
                    known++;
                if (known == count)
                    list[count++] = j;
            }
        qsort(list, (size_t)count, sizeof *list, compare_int);
        filled += count;
        mesh->wet[i] = start[i + 1] > start[i];

        // edges that leave i counter-clockwise in one cell and come back in none
        for (int k = start[i]; k < start[i + 1]; k++) {
            const int *cell = mesh->cell[mesh->node_cell[k]];
            const int a = cell[0] == i ? 0 : cell[1] == i ? 1 : 2, j = cell[(a + 1) % 3];
            bool twice = false;
            for (int m = start[i]; m < start[i + 1] && !twice; m++) {
                const int *other = mesh->cell[mesh->node_cell[m]];
                const int b = other[0] == i ? 0 : other[1] == i ? 1 : 2;
                twice = other[(b + 2) % 3] == j;
            }
            if (twice)
                continue;
            SILT_RESERVE(mesh->facet, mesh->facet_capacity, mesh->n_facet + 1);
            SILT_RESERVE(mesh->facet_kind, mesh->facet_kind_capacity, mesh->n_facet + 1);
            mesh->facet[mesh->n_facet][0] = i;
            mesh->facet[mesh->n_facet][1] = j;
            mesh->facet[mesh->n_facet][2] = -1;
            mesh->facet_kind[mesh->n_facet++] = (uint8_t)facet_kind(nodes, i, j);
        }
    }
    mesh->neighbour_start[n] = filled;
    for (int k = 0; k < mesh->n_facet; k++)
        if (mesh->facet_kind[k] == FACET_FREE)
            mesh->surface[mesh->facet[k][0]] = mesh->surface[mesh->facet[k][1]] = 1;
}

void silt_mesh_clear(silt_mesh *mesh) {
    free(mesh->cell);
    free(mesh->facet);
    free(mesh->facet_kind);
    free(mesh->wet);
    free(mesh->surface);
    free(mesh->node_cell_start);
    free(mesh->node_cell);
    free(mesh->neighbour_start);
    free(mesh->neighbour);
    *mesh = (silt_mesh){0};
}

void silt_cell_corners(const silt_mesh *mesh, const double *x, const int *cell, double *corner) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    for (int a = 0; a <= dim; a++)
        for (int d = 0; d < dim; d++) {
            double step = x[dim * cell[a] + d] - x[dim * cell[0] + d];
            if (mesh->period[d] > 0)
                step -= mesh->period[d] * floor(step / mesh->period[d] + 0.5);
            corner[dim * a + d] = x[dim * cell[0] + d] + step;
        }
}

double silt_simplex_volume(int dim, const double *c) {
    if (dim == 2)
        return 0.5 * ((c[2] - c[0]) * (c[5] - c[1]) - (c[3] - c[1]) * (c[4] - c[0]));
    double u[3], v[3], w[3];
    for (int d = 0; d < 3; d++) {
        u[d] = c[3 + d] - c[d];
        v[d] = c[6 + d] - c[d];
        w[d] = c[9 + d] - c[d];
    }
    return (u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) + u[2] * (v[0] * w[1] - v[1] * w[0])) / 6;
}

double silt_cell_volume(const silt_mesh *mesh, const double *x, int e) {
    double corner[12];
    silt_cell_corners(mesh, x, mesh->cell[e], corner);
    return silt_simplex_volume(mesh->dim == 3 ? 3 : 2, corner);
}
