// the particles: arrays of nodes that grow and shrink
#include "pfem.h"

void silt_nodes_clear(silt_nodes *nodes) {
    free(nodes->x);
    free(nodes->v);
    free(nodes->p);
    free(nodes->h);
    free(nodes->eddy);
    free(nodes->debt);
    free(nodes->id);
    free(nodes->kind);
    free(nodes->owner);
    free(nodes->wall);
    *nodes = (silt_nodes){0};
}

static void nodes_reserve(silt_nodes *nodes, int need) {
    const int dim = silt_nodes_dim(nodes);
    if (need <= nodes->capacity)
        return;
    // of many a quarter more: room is memory
    int capacity = nodes->capacity > 256 ? nodes->capacity : 256;
    while (capacity < need)
        capacity += capacity < 16384 ? capacity : capacity / 4;
#define GROW(field, per)                                                                                               \
    do {                                                                                                               \
        int have = nodes->capacity * (per);                                                                            \
        nodes->field = silt_grow(nodes->field, &have, capacity * (per), sizeof *nodes->field);                         \
    } while (0)
    GROW(x, dim);
    GROW(v, dim);
    GROW(p, 1);
    if (nodes->h)
        GROW(h, 1);
    if (nodes->eddy)
        GROW(eddy, 1);
    GROW(debt, 1);
    GROW(id, 1);
    GROW(kind, 1);
    GROW(owner, 1);
    GROW(wall, 1);
#undef GROW
    nodes->capacity = capacity;
}

void silt_nodes_eddies(silt_nodes *nodes) {
    if (!nodes->eddy)
        nodes->eddy = silt_alloc((size_t)nodes->capacity + 1, sizeof *nodes->eddy);
}

int silt_nodes_add(silt_nodes *nodes, silt_node_kind kind, int owner, const double *x) {
    const int i = nodes->count, dim = silt_nodes_dim(nodes);
    nodes_reserve(nodes, i + 1);
    nodes->count++;
    for (int d = 0; d < dim; d++) {
        nodes->x[dim * i + d] = x[d];
        nodes->v[dim * i + d] = 0;
    }
    nodes->p[i] = 0;
    if (nodes->h)
        nodes->h[i] = 0;
    if (nodes->eddy)
        nodes->eddy[i] = 0;
    nodes->debt[i] = 0;
    nodes->id[i] = nodes->next_id++;
    nodes->kind[i] = (uint8_t)kind;
    nodes->owner[i] = owner;
    nodes->wall[i][0] = nodes->wall[i][1] = nodes->wall[i][2] = -1;
    return i;
}

void silt_nodes_compact(silt_nodes *nodes, const uint8_t *dead, int *map) {
    const int dim = silt_nodes_dim(nodes);
    int k = 0;
    for (int i = 0; i < nodes->count; i++) {
        if (dead[i]) {
            map[i] = -1;
            continue;
        }
        map[i] = k;
        if (k != i) {
            for (int d = 0; d < dim; d++) {
                nodes->x[dim * k + d] = nodes->x[dim * i + d];
                nodes->v[dim * k + d] = nodes->v[dim * i + d];
            }
            memcpy(nodes->wall[k], nodes->wall[i], sizeof nodes->wall[k]);
            nodes->p[k] = nodes->p[i];
            if (nodes->h)
                nodes->h[k] = nodes->h[i];
            if (nodes->eddy)
                nodes->eddy[k] = nodes->eddy[i];
            nodes->debt[k] = nodes->debt[i];
            nodes->id[k] = nodes->id[i];
            nodes->kind[k] = nodes->kind[i];
            nodes->owner[k] = nodes->owner[i];
        }
        k++;
    }
    nodes->count = k;
}

static void arrange(void *data, size_t size, int n, const int *order, char *spare) {
    for (int k = 0; k < n; k++)
        memcpy(spare + size * (size_t)k, (const char *)data + size * (size_t)order[k], size);
    memcpy(data, spare, size * (size_t)n);
}

void silt_nodes_arrange(silt_nodes *nodes, const int *order) {
    const int n = nodes->count;
    const size_t dim = (size_t)silt_nodes_dim(nodes);
    char *spare = silt_borrow((size_t)n + 1, dim * sizeof(double));
    arrange(nodes->x, dim * sizeof *nodes->x, n, order, spare);
    arrange(nodes->v, dim * sizeof *nodes->v, n, order, spare);
    arrange(nodes->p, sizeof *nodes->p, n, order, spare);
    if (nodes->h)
        arrange(nodes->h, sizeof *nodes->h, n, order, spare);
    if (nodes->eddy)
        arrange(nodes->eddy, sizeof *nodes->eddy, n, order, spare);
    arrange(nodes->debt, sizeof *nodes->debt, n, order, spare);
    arrange(nodes->id, sizeof *nodes->id, n, order, spare);
    arrange(nodes->kind, sizeof *nodes->kind, n, order, spare);
    arrange(nodes->owner, sizeof *nodes->owner, n, order, spare);
    arrange(nodes->wall, sizeof *nodes->wall, n, order, spare);
    silt_return(spare);
}

int silt_outline_points(int n, const double *outline, double h, double **xy) {
    int count = 0, capacity = 0;
    double *out = NULL;
    for (int k = 0; k < n; k++) {
        const double *a = outline + 2 * k, *b = outline + 2 * ((k + 1) % n);
        const int pieces = (int)silt_max(1, floor(hypot(b[0] - a[0], b[1] - a[1]) / h + 0.5));
        SILT_RESERVE(out, capacity, 2 * (count + pieces));
        for (int m = 0; m < pieces; m++, count++)
            for (int d = 0; d < 2; d++)
                out[2 * count + d] = a[d] + (b[d] - a[d]) * m / pieces;
    }
    *xy = out;
    return count;
}
