// parts of the cells, one a thread
#include "parts.h"

void silt_parts_clear(silt_parts *p) {
    free(p->cell);
    free(p->late);
    free(p->spill);
    *p = (silt_parts){0};
}

static int part_of(const silt_parts *p, int e) {
    int part = 0;
    while (e >= p->first[part + 1])
        part++;
    return part;
}

void silt_parts_make(silt_parts *p, const silt_mesh *mesh) {
    const int n_cell = mesh->n_cell, dim = mesh->dim == 3 ? 3 : 2;
    p->n = silt_threads(n_cell / 4);
    p->border[0] = p->border[1] = p->first[0] = 0;
    p->first[1] = n_cell;
    if (p->n == 1)
        return;
    // whole pairs: shapes are reckoned two at a time
    for (int k = 0; k <= p->n; k++)
        p->first[k] = k < p->n ? (int)((int64_t)n_cell * k / p->n) / 2 * 2 : n_cell;
    SILT_RESERVE(p->late, p->late_capacity, n_cell + 1);
    memset(p->late, 0, (size_t)n_cell);
    for (int i = 0; i < mesh->n_node; i++) {
        const int first = mesh->node_cell_start[i], last = mesh->node_cell_start[i + 1] - 1;
        if (last < first)
            continue;
        const int end = p->first[part_of(p, mesh->node_cell[first]) + 1];
        for (int k = last; k > first && mesh->node_cell[k] >= end; k--) {
            const int e = mesh->node_cell[k];
            for (int a = 0; a <= dim; a++)
                p->late[e] |= (uint8_t)((mesh->cell[e][a] == i) << a);
        }
    }
    int count = 0;
    for (int part = 0; part < p->n; part++) {
        p->border[part] = count;
        for (int e = p->first[part]; e < p->first[part + 1]; e++)
            if (p->late[e]) {
                SILT_RESERVE(p->cell, p->cell_capacity, count + 1);
                p->cell[count++] = e;
            }
    }
    p->border[p->n] = count;
    SILT_RESERVE(p->spill, p->spill_capacity, SPILL * count + 1);
}

// adds what a border cell put aside: for nodes of earlier parts (late), or for the others
static void unload(silt_sums sums, int dim, const int *cell, unsigned late, const double *spill) {
    for (int a = 0; a <= dim; a++) {
        if (!(late >> a & 1))
            continue;
        for (int d = 0; d < sums.width && sums.wide; d++)
            sums.wide[sums.width * cell[a] + d] += spill[sums.width * a + d];
        if (sums.one)
            sums.one[cell[a]] += spill[SPILL_SCALAR + a];
    }
}

void silt_parts_settle(const silt_parts *p, const silt_mesh *mesh, silt_sums sums, int b) {
    const int e = p->cell[b];
    unload(sums, mesh->dim == 3 ? 3 : 2, mesh->cell[e], ~(unsigned)p->late[e], p->spill + SPILL * b);
}

void silt_parts_finish(const silt_parts *p, const silt_mesh *mesh, silt_sums sums) {
    for (int b = 0; b < p->border[p->n]; b++)
        unload(sums, mesh->dim == 3 ? 3 : 2, mesh->cell[p->cell[b]], p->late[p->cell[b]], p->spill + SPILL * b);
}
