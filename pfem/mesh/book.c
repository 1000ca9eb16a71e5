// books what a rebuild did to the volume, where it did it: mesh and debts together hold what they held
#include "remesh.h"

// Cells that are gone and cells that came are joined into groups across facets: a group fills one hollow of the mesh
// that stayed, so that exchanges of cells within the water lose nothing. Cells around a node that left, came back or
// was moved (put on a wall, a body) are one group with the change that the moved node made to cells that stayed.
typedef struct change {
    int cell, generation; // 0: a cell of the memory that is gone, 1: a new cell, 2: bed that took its place, 3: a cell
                          // that stayed
    int node;             // 3: the node that was moved
    double volume;        // m3, 0 to 2: of the cell; 3: what the move of the node made of it
} change;

typedef struct book {
    const silt_draft *draft;
    silt_nodes *nodes;
    silt_memory *memory;
    const uint8_t *was_wet;
    uint8_t *wet;
    int dim;
    double size; // m
    change *item;
    int n_item, item_capacity, n_changed; // the first n_changed are of generation 0 to 2
    int *parent;                          // one per changed cell, then one per node
    uint8_t *star;                        // one per node: its changed cells are one group
    double made;
} book;

static const int *change_nodes(const book *b, const change *c) {
    return c->generation == 0   ? b->memory->cell[c->cell]
           : c->generation == 2 ? b->memory->taken[c->cell]
                                : b->draft->mesh->cell[c->cell];
}

static void book_item(book *b, int cell, int generation, int node, double volume) {
    SILT_RESERVE(b->item, b->item_capacity, b->n_item + 1);
    b->item[b->n_item++] = (change){cell, generation, node, volume};
}

static void book_join(book *b, int i, int k) {
    const int p = silt_group_find(b->parent, i), q = silt_group_find(b->parent, k);
    b->parent[p > q ? p : q] = p > q ? q : p;
}

// ---- changed cells that share a facet

// a facet of a changed cell, kept with the others that have the same lowest node
typedef struct facet_item {
    int other[2]; // its other nodes, rising
    int cell;     // index of the changed cell
    int side;     // 0 or 1: on which side of the facet the cell lies; 2 more when the cell is new
} facet_item;

// the changed cells of one facet: c[0] gone on its one side, c[1] on the other, c[2] come on the one, c[3] on the
// other; -1
static void facet_join(book *b, const int c[4]) {
    // the same side of a facet before and after
    for (int side = 0; side < 2; side++)
        if (c[side] >= 0 && c[2 + side] >= 0)
            book_join(b, c[side], c[2 + side]);
    // a facet inside the hollow, which is there only before or only after
    for (int generation = 0; generation < 4; generation += 2)
        if (c[generation] >= 0 && c[generation + 1] >= 0 && c[2 - generation] < 0 && c[3 - generation] < 0)
            book_join(b, c[generation], c[generation + 1]);
    // water on the one side before, on the other after
    for (int side = 0; side < 2; side++)
        if (c[side] >= 0 && c[3 - side] >= 0 && c[1 - side] < 0 && c[2 + side] < 0)
            book_join(b, c[side], c[3 - side]);
}

static void book_facets(book *b) {
    const int n_node = b->nodes->count;
    int *start = silt_borrow((size_t)n_node + 1, sizeof *start);
    facet_item *item = silt_borrow((size_t)b->n_changed * (size_t)(b->dim + 1) + 1, sizeof *item);
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < b->n_changed; k++) {
            // without its first node the cell's rising nodes are a facet on one side, without its second on the other,
            // ...
            uint32_t node[4];
            const int turned = silt_cell_sort(change_nodes(b, &b->item[k]), node), lowest = (int)(node[0] >> 2);
            if (pass == 0) {
                start[lowest] += b->dim;
                start[node[1] >> 2]++;
                continue;
            }
            const int new = b->item[k].generation ? 2 : 0;
            for (int a = 0; a <= b->dim; a++) {
                const int second = (int)(node[a < 2 ? 2 : 1] >> 2),
                          third = b->dim == 2 ? -1 : (int)(node[a < 3 ? 3 : 2] >> 2);
                item[--start[a ? lowest : (int)(node[1] >> 2)]] =
                    (facet_item){{second, third}, k, new + (turned ^ (a & 1))};
            }
        }
        int sum = 0;
        for (int i = 0; pass == 0 && i <= n_node; i++) {
            sum += i < n_node ? start[i] : 0;
            start[i] = sum;
        }
    }
    for (int i = 0; i < n_node; i++)
        for (int end = start[i + 1], k = start[i]; k < end; k++) {
            // takes all of this facet out of the bucket
            int c[4] = {-1, -1, -1, -1}, n = 0;
            const facet_item first = item[k];
            for (int m = k; m < end;) {
                if (item[m].other[0] != first.other[0] || item[m].other[1] != first.other[1]) {
                    m++;
                    continue;
                }
                c[item[m].side] = item[m].cell;
                n++;
                if (m == k)
                    m++;
                else
                    item[m] = item[--end];
            }
            if (n > 1)
                facet_join(b, c);
        }
    silt_return(start);
    silt_return(item);
}

// ---- nodes that were moved since the memory was taken

static void move_of(const book *b, int i, double step[3]) {
    step[0] = step[1] = step[2] = 0;
    if (i >= b->memory->n_place)
        return;
    for (int d = 0; d < b->dim; d++) {
        const double period = b->memory->period[d];
        step[d] = b->nodes->x[b->dim * i + d] - b->memory->x[b->dim * i + d];
        if (period > 0 && step[d] != 0)
            step[d] -= period * floor(step[d] / period + 0.5);
    }
}

// derivative of a cell's volume with the place of its node a, at corners c
static void volume_slope(int dim, const double *c, int a, double slope[3]) {
    static const int local[4] = {0, 1, 2, 3};
    int side[3];
    silt_cell_facet(dim, local, a, side);
    const double *p = c + dim * side[0], *q = c + dim * side[1];
    slope[2] = 0;
    if (dim == 2) {
        slope[0] = 0.5 * (p[1] - q[1]);
        slope[1] = 0.5 * (q[0] - p[0]);
        return;
    }
    const double *r = c + 3 * side[2];
    for (int d = 0; d < 3; d++) {
        const int m = (d + 1) % 3, n = (d + 2) % 3;
        slope[d] = -((q[m] - p[m]) * (r[n] - p[n]) - (q[n] - p[n]) * (r[m] - p[m])) / 6;
    }
}

// A cell that stayed changed by `all`: what the move of each of its nodes made. Along the straight way from the old
// corners to the new ones the volume is a polynomial of third degree, its slope one of second: Simpson's rule is exact.
// What no move explains (rounding, bed that became water) stays with the cell.
static void book_stretched(book *b, int e, double all) {
    const silt_mesh *mesh = b->draft->mesh;
    const int *cell = mesh->cell[e], dim = b->dim;
    double now[12], then[12], middle[12], step[4][3], part[4] = {0}, sum = 0;
    silt_cell_corners(mesh, b->nodes->x, cell, now);
    double longest = 0;
    for (int a = 0; a <= dim; a++) {
        move_of(b, cell[a], step[a]);
        longest = silt_max(longest, silt_square(step[a][0]) + silt_square(step[a][1]) + silt_square(step[a][2]));
        for (int d = 0; d < dim; d++) {
            then[dim * a + d] = now[dim * a + d] - step[a][d];
            middle[dim * a + d] = now[dim * a + d] - 0.5 * step[a][d];
        }
    }
    for (int a = 0; a <= dim && longest > silt_square(1e-6 * b->size); a++) {
        double s[3][3];
        volume_slope(dim, then, a, s[0]);
        volume_slope(dim, middle, a, s[1]);
        volume_slope(dim, now, a, s[2]);
        for (int d = 0; d < dim; d++)
            part[a] += step[a][d] * (s[0][d] + 4 * s[1][d] + s[2][d]) / 6;
        if (part[a] == 0)
            continue;
        book_item(b, e, 3, cell[a], part[a]);
        b->star[cell[a]] = 1;
        sum += part[a];
    }
    for (int a = 0; a <= dim; a++)
        b->nodes->debt[cell[a]] -= (all - sum) / (dim + 1);
}

// ---- groups

typedef struct entry {
    int node;
    double before, change; // m3, nodal shares of the group's cells; change with debts
} entry;

static int heir_of(const book *b, const double *x) {
    int heir = -1;
    double nearest = HUGE_VAL;
    for (int k = 0; k < b->nodes->count; k++) {
        if (b->memory->dead[k] || !b->wet[k])
            continue;
        double square = 0;
        for (int d = 0; d < b->dim; d++) {
            double step = b->nodes->x[b->dim * k + d] - x[d];
            if (b->memory->period[d] > 0)
                step -= b->memory->period[d] * floor(step / b->memory->period[d] + 0.5);
            square += step * step;
        }
        if (square < nearest) {
            nearest = square;
            heir = k;
        }
    }
    return heir;
}

// What the group lost goes to its wet nodes; without any to its flying ones, or to the nearest wet node of all. A node
// that lost all its cells takes its share along. @return number of entries, one more when there was an heir from
// outside
static int group_settle(book *b, entry *list, int n, double sum) {
    silt_nodes *nodes = b->nodes;
    const silt_memory *memory = b->memory;
    bool leaves = false;
    int n_wet = 0, n_flying = 0;
    for (int k = 0; k < n; k++) {
        const int i = list[k].node;
        const bool dead = memory->dead[i];
        leaves |= memory->dead[i] == NODE_LEFT;
        if (dead || (b->wet[i] && !b->was_wet[i])) {
            sum += nodes->debt[i];
            list[k].change -= nodes->debt[i];
            nodes->debt[i] = 0;
        } else if (!b->wet[i] && b->was_wet[i] && nodes->kind[i] == NODE_FLUID) {
            nodes->debt[i] += list[k].before;
            list[k].change += list[k].before;
            sum -= list[k].before;
        }
        n_wet += !dead && b->wet[i];
        n_flying += !dead && !b->wet[i] && nodes->kind[i] == NODE_FLUID;
    }
    if (leaves) { // where nodes left the domain, what is missing left with them
        b->memory->left += sum;
        return n;
    }
    if (sum == 0)
        return n;
    if (n_wet == 0 && n_flying == 0) {
        double centre[3] = {0};
        const double *first = nodes->x + b->dim * list[0].node;
        for (int k = 0; k < n; k++)
            for (int d = 0; d < b->dim; d++) {
                double step = nodes->x[b->dim * list[k].node + d] - first[d];
                if (memory->period[d] > 0)
                    step -= memory->period[d] * floor(step / memory->period[d] + 0.5);
                centre[d] += (first[d] + step) / n;
            }
        const int heir = heir_of(b, centre);
        if (heir >= 0) {
            nodes->debt[heir] += sum;
            list[n++] = (entry){heir, 0, sum};
        }
        return n;
    }
    for (int k = 0; k < n; k++) {
        const int i = list[k].node;
        if (!memory->dead[i] && (n_wet ? b->wet[i] : nodes->kind[i] == NODE_FLUID)) {
            nodes->debt[i] += sum / (n_wet ? n_wet : n_flying);
            list[k].change += sum / (n_wet ? n_wet : n_flying);
        }
    }
    return n;
}

static void book_groups(book *b) {
    const int n = b->nodes->count, n_corner = b->dim + 1, n_element = b->n_changed + n;
    silt_memory *memory = b->memory;
    // items and lone nodes by group
    int *start = silt_borrow((size_t)n_element + 2, sizeof *start),
        *order = silt_borrow((size_t)b->n_item + (size_t)n + 1, sizeof *order);
    for (int pass = 0; pass < 2; pass++) {
        for (int k = b->n_item + n - 1; k >= 0; k--) {
            // a node's debt must find its group also where it has no changed cell
            const int i = k - b->n_item;
            if (i >= 0 && !(memory->dead[i] && b->nodes->debt[i] != 0))
                continue;
            const int element = i >= 0 ? b->n_changed + i : k < b->n_changed ? k : b->n_changed + b->item[k].node;
            const int g = silt_group_find(b->parent, element);
            if (pass == 0)
                start[g]++;
            else
                order[--start[g]] = k;
        }
        int sum = 0;
        for (int g = 0; pass == 0 && g <= n_element; g++) {
            sum += g < n_element ? start[g] : 0;
            start[g] = sum;
        }
    }
    int *seen = silt_borrow((size_t)n + 1, sizeof *seen); // 1 + the node's place in the list of the present group
    entry *list = NULL;
    int list_capacity = 0;
    memory->n_group = memory->n_exchange = 0;
    for (int g = 0; g < n_element; g++) {
        if (start[g] == start[g + 1])
            continue;
        int count = 0;
        double sum = 0;
        for (int k = start[g]; k < start[g + 1]; k++) {
            const int at = order[k];
            const change *c = at < b->n_item ? &b->item[at] : NULL;
            const int lone[1] = {at - b->n_item}, *cell = c ? change_nodes(b, c) : lone;
            const double sign = c ? (c->generation == 0 ? -1 : 1) : 0;
            sum -= c ? sign * c->volume : 0;
            for (int a = 0; a < (c ? n_corner : 1); a++) {
                SILT_RESERVE(list, list_capacity, count + 2);
                if (!seen[cell[a]]) {
                    list[count] = (entry){cell[a], 0, 0};
                    seen[cell[a]] = ++count;
                }
                entry *to = &list[seen[cell[a]] - 1];
                if (c && c->generation == 0)
                    to->before += c->volume / n_corner;
                if (c && c->generation != 2) // bed that took the water's place is no share of the nodes
                    to->change += sign * c->volume / n_corner;
            }
        }
        for (int k = 0; k < count; k++)
            seen[list[k].node] = 0;
        count = group_settle(b, list, count, sum);
        if (!memory->record)
            continue;
        SILT_RESERVE(memory->group_start, memory->group_capacity, memory->n_group + 2);
        SILT_RESERVE(memory->exchange, memory->exchange_capacity, memory->n_exchange + count);
        memory->group_start[memory->n_group++] = memory->n_exchange;
        for (int k = 0; k < count; k++)
            memory->exchange[memory->n_exchange++] = (struct silt_share){list[k].node, list[k].before, list[k].change};
        memory->group_start[memory->n_group] = memory->n_exchange;
    }
    silt_return(start);
    silt_return(order);
    silt_return(seen);
    free(list);
}

void silt_book_volume(const silt_draft *draft, silt_nodes *nodes, silt_memory *memory, const silt_cell_set *old,
                      const uint8_t *was_wet, double size) {
    const silt_mesh *mesh = draft->mesh;
    const int n = nodes->count;
    book b = {.draft = draft, .nodes = nodes, .memory = memory, .was_wet = was_wet, .dim = mesh->dim, .size = size};
    uint8_t *kept = silt_borrow((size_t)memory->n_cell + 1, 1);
    b.wet = silt_borrow((size_t)n + 1, 1);
    b.star = silt_borrow((size_t)n + 1, 1);
    memory->left = 0;

    // what went, what came, what was stretched
    for (int e = 0; e < mesh->n_cell; e++) {
        if (draft->before[e] == -2)
            draft->before[e] = silt_cell_set_find(old, mesh->cell[e]);
        if (draft->before[e] >= 0 && !(memory->area[draft->before[e]] > 0))
            draft->before[e] = -1; // turned inside out: the old one is gone and its mirror image came
        if (draft->before[e] >= 0)
            kept[draft->before[e]] = 1;
        for (int a = 0; a <= b.dim; a++)
            b.wet[mesh->cell[e][a]] = 1;
    }
    for (int e = 0; e < memory->n_cell; e++)
        if (!kept[e]) {
            book_item(&b, e, 0, -1, memory->area[e]);
            b.made -= memory->area[e];
        }
    for (int e = 0; e < mesh->n_cell; e++)
        if (draft->before[e] < 0) {
            const double volume = silt_cell_volume(mesh, nodes->x, e);
            book_item(&b, e, 1, -1, volume);
            b.made += volume;
        }
    for (int e = 0; e < memory->n_taken; e++) {
        book_item(&b, e, 2, -1, memory->taken_area[e]);
        b.made += memory->taken_area[e];
        for (int a = 0; a <= b.dim; a++)
            b.star[memory->taken[e][a]] = 1;
    }
    b.n_changed = b.n_item;
    for (int e = 0; e < mesh->n_cell; e++)
        if (draft->before[e] >= 0) {
            const double moved = silt_cell_volume(mesh, nodes->x, e) - memory->area[draft->before[e]];
            if (moved != 0)
                book_stretched(&b, e, moved);
            b.made += moved;
        }

    b.parent = silt_borrow((size_t)b.n_changed + (size_t)n + 1, sizeof *b.parent);
    for (int k = 0; k < b.n_changed + n; k++)
        b.parent[k] = k;
    book_facets(&b);
    for (int k = 0; k < b.n_changed; k++) {
        const int *cell = change_nodes(&b, &b.item[k]);
        for (int a = 0; a <= b.dim; a++) {
            const int i = cell[a];
            if (b.star[i] || memory->dead[i] || (b.wet[i] && !was_wet[i]))
                book_join(&b, k, b.n_changed + i);
        }
    }
    book_groups(&b);
    memory->reconnected = b.made + memory->left;
    silt_return(kept);
    silt_return(b.wet);
    silt_return(b.star);
    free(b.item);
    silt_return(b.parent);
}
