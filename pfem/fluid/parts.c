// parts of the cells, one a thread
#include "parts.h"

void silt_parts_clear(silt_parts *p) {
    free(p->cell);
    free(p->late);
    free(p->spill);
    free(p->node);
    free(p->place);
    *p = (silt_parts){0};
}

static int part_of(const silt_parts *p, int e) {
    int part = 0;
    while (e >= p->first[part + 1])
        part++;
    return part;
}

// which border cell e is
static int border_number(const silt_parts *p, int e) {
    int lo = 0, hi = p->border[p->n] - 1;
    while (lo < hi) {
        const int mid = (lo + hi) / 2;
        if (p->cell[mid] < e)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

void silt_parts_make(silt_parts *p, const silt_mesh *mesh) {
    const int n_cell = mesh->n_cell;
    int n_late = 0;
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
        int k = last + 1;
        while (mesh->node_cell[k - 1] >= end)
            k--;
        SILT_RESERVE(p->node, p->node_capacity, n_late + last - k + 2);
        SILT_RESERVE(p->place, p->place_capacity, n_late + last - k + 2);
        for (; k <= last; k++) {
            const int e = mesh->node_cell[k];
            int a = 0;
            while (mesh->cell[e][a] != i)
                a++;
            p->late[e] |= (uint8_t)(1 << a);
            p->node[n_late] = i;
            p->place[n_late++] = 4 * e + a;
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
    p->n_late = n_late;
    for (int part = 0; part <= p->n; part++) { // no node is cut
        int k = (int)((int64_t)n_late * part / p->n);
        while (k > 0 && k < n_late && p->node[k] == p->node[k - 1])
            k++;
        p->split[part] = k;
    }
    for (int k = 0; k < n_late; k++)
        p->place[k] = 4 * border_number(p, p->place[k] / 4) + p->place[k] % 4;
}

void silt_parts_settle(const silt_parts *p, const silt_mesh *mesh, silt_sums sums, int b) {
    const int *cell = mesh->cell[p->cell[b]], late = p->late[p->cell[b]], dim = mesh->dim == 3 ? 3 : 2;
    const double *spill = p->spill + SPILL * b;
    for (int a = 0; a <= dim; a++) {
        if (late >> a & 1)
            continue;
        for (int d = 0; d < sums.width && sums.wide; d++)
            sums.wide[sums.width * cell[a] + d] += spill[sums.width * a + d];
        if (sums.one)
            sums.one[cell[a]] += spill[SPILL_SCALAR + a];
    }
}

void silt_parts_finish(const silt_parts *p, silt_sums sums, int part) {
    const int first = p->n > 1 ? p->split[part] : 0, n = p->n > 1 ? p->split[part + 1] : 0;
    if (sums.wide && sums.width == 3)
        for (int k = first; k < n; k++) {
            double *to = sums.wide + 3 * p->node[k];
            const double *from = p->spill + SPILL * (p->place[k] / 4) + 3 * (p->place[k] % 4);
            to[0] += from[0];
            to[1] += from[1];
            to[2] += from[2];
        }
    else if (sums.wide)
        for (int k = first; k < n; k++)
            for (int d = 0; d < sums.width; d++)
                sums.wide[sums.width * p->node[k] + d] += p->spill[SPILL * (p->place[k] / 4) + sums.width * (p->place[k] % 4) + d];
    for (int k = first; k < n && sums.one; k++)
        sums.one[p->node[k]] += p->spill[SPILL * (p->place[k] / 4) + SPILL_SCALAR + p->place[k] % 4];
}
