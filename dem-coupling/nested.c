// nested dissection and fronts of a sum over triangles
#include "nested.h"

#include "vector.h"

#define LEAF 12  // parts of so few nodes are eliminated at one go
#define LANES 8  // numbers in a vector of rows, and that may be read past the end of a panel
#define COLUMNS 4 // that are worked on together
#define STRIP 4   // rows that a solve takes together

/** a node on its way through the dissection */
typedef struct nested_item {
    double x[2];
    double reach; // farthest neighbour, along an axis
    int node;
} nested_item;

/** columns that are eliminated together, with the rows below them */
typedef struct nested_block {
    int begin, end; // places in the order
    int n_child;    // that many blocks' updates lie on top of the other stack
    int side;       // stack that its update waits on: parents and children take turns, so that none has to move
    int row_begin, row_end;
    size_t value; // of the panel: the triangle's columns, then what is below by strips of four rows, column by column
} nested_block;

struct silt_nested {
    int n, n_block, part, block_capacity;
    nested_block *block; // owned, children before their parents
    const int *node;     // borrowed from order on
    const int *place;
    nested_item *item;   // owned
    int *row;            // owned, places, rising in a block, filled up to strips with the place behind the last
    int *local;          // owned, per place: row in the front
    int *waiting;        // owned, blocks on the stack
    int *at;             // owned, rows of the front that an update goes to
    double *value;       // owned, panels, 1/diagonal in the diagonal's place
    double *panel;       // owned, the present front's, columns one after the other
    double *stack[2];    // owned, updates that wait for their parent
    double **column;     // owned, of the present front
    int item_capacity, row_capacity, local_capacity, waiting_capacity, at_capacity, column_capacity, stack_capacity[2],
        value_capacity, panel_capacity;
};

// ---------------------------------------------------------------- order

static int nested_add(silt_nested *f, int begin, int end, int n_child, int depth) {
    SILT_RESERVE(f->block, f->block_capacity, f->n_block + 1);
    f->block[f->n_block++] = (nested_block){.begin = begin, .end = end, .n_child = n_child, .side = depth % 2};
    return 1;
}

static void nested_swap(nested_item *a, nested_item *b) {
    const nested_item t = *a;
    *a = *b;
    *b = t;
}

// orders the items from begin to end; part: label per node of the mesh. @return how many blocks wait for a parent
static int nested_dissect(silt_nested *f, const silt_mesh *mesh, int *part, int begin, int end, int depth) {
    const int n = end - begin;
    if (n <= LEAF)
        return n ? nested_add(f, begin, end, 0, depth) : 0;
    double lo[2] = {HUGE_VAL, HUGE_VAL}, hi[2] = {-HUGE_VAL, -HUGE_VAL}, sum[2] = {0.0, 0.0};
    for (int k = begin; k < end; k++)
        for (int d = 0; d < 2; d++) {
            const double x = f->item[k].x[d];
            lo[d] = silt_min(lo[d], x);
            hi[d] = silt_max(hi[d], x);
            sum[d] += x;
        }
    const int axis = hi[1] - lo[1] > hi[0] - lo[0], low = f->part++;
    const double cut = sum[axis] / n;

    // low side first
    int middle = begin;
    for (int k = begin; k < end; k++)
        if (f->item[k].x[axis] < cut) {
            part[f->item[k].node] = low;
            nested_swap(&f->item[middle++], &f->item[k]);
        }
    if (middle == begin || middle == end)
        return nested_add(f, begin, end, 0, depth);
    // the separator, last: what joins the low side from above
    int last = end;
    for (int k = middle; k < last;) {
        const nested_item *t = &f->item[k];
        bool joined = false;
        for (int m = mesh->neighbour_start[t->node]; t->x[axis] - cut <= t->reach && m < mesh->neighbour_start[t->node + 1]; m++)
            joined |= part[mesh->neighbour[m]] == low;
        if (joined)
            nested_swap(&f->item[k], &f->item[--last]);
        else
            k++;
    }
    const int below = depth + (last < end); // without a separator the parts go to this one's parent
    const int waiting = nested_dissect(f, mesh, part, begin, middle, below) + nested_dissect(f, mesh, part, middle, last, below);
    return last < end ? nested_add(f, last, end, waiting, depth) : waiting;
}

// rows below every block: those that its children hand on, and the neighbours of its nodes
static void nested_rows(silt_nested *f, const silt_mesh *mesh) {
    const int n = f->n;
    int n_waiting = 0, filled = 0, widest = 0;
    size_t value = 0, panel = 0, stacked[2] = {0, 0}, peak[2] = {0, 0};
    for (int k = 0; k < n; k++)
        f->local[k] = -1;
    SILT_RESERVE(f->waiting, f->waiting_capacity, f->n_block + 1);
    for (int e = 0; e < f->n_block; e++) {
        nested_block *b = &f->block[e];
        SILT_RESERVE(f->row, f->row_capacity, filled + (n - b->end) + STRIP);
        int *row = f->row + filled, count = 0;
        b->row_begin = filled;
        for (int c = n_waiting - b->n_child; c < n_waiting; c++) {
            const nested_block *child = &f->block[f->waiting[c]];
            const size_t size = (size_t)(child->row_end - child->row_begin);
            for (int k = child->row_begin; k < child->row_end; k++) {
                const int place = f->row[k];
                if (place >= b->end && f->local[place] != e) {
                    f->local[place] = e;
                    row[count++] = place;
                }
            }
            stacked[!b->side] -= size * size;
        }
        for (int p = b->begin; p < b->end; p++)
            for (int k = mesh->neighbour_start[f->node[p]]; k < mesh->neighbour_start[f->node[p] + 1]; k++) {
                const int place = f->place[mesh->neighbour[k]];
                if (place >= b->end && place < n && f->local[place] != e) {
                    f->local[place] = e;
                    row[count++] = place;
                }
            }
        silt_sort_few(count, row);
        b->row_end = filled + count;
        while (count % STRIP)
            row[count++] = n;
        filled += count;
        count = b->row_end - b->row_begin;
        b->value = value;
        const size_t own = (size_t)(b->end - b->begin);
        value += own * (own + 1) / 2 + own * (size_t)(filled - b->row_begin);
        panel = own * (own + (size_t)count) > panel ? own * (own + (size_t)count) : panel;
        n_waiting -= b->n_child;
        f->waiting[n_waiting++] = e;
        stacked[b->side] += (size_t)count * (size_t)count;
        peak[b->side] = stacked[b->side] > peak[b->side] ? stacked[b->side] : peak[b->side];
        widest = (int)own + count > widest ? (int)own + count : widest;
    }
    SILT_RESERVE(f->value, f->value_capacity, (int)value + 1);
    SILT_RESERVE(f->panel, f->panel_capacity, (int)panel + LANES);
    for (int k = 0; k < 2; k++)
        SILT_RESERVE(f->stack[k], f->stack_capacity[k], (int)peak[k] + LANES);
    SILT_RESERVE(f->column, f->column_capacity, widest + 1);
    SILT_RESERVE(f->at, f->at_capacity, widest + 1);
}

void silt_nested_order(silt_nested **nested, const silt_mesh *mesh, const double *x, int n, int *node, int *place) {
    if (*nested == NULL)
        *nested = silt_alloc(1, sizeof **nested);
    silt_nested *f = *nested;
    f->n = n;
    f->node = node;
    f->place = place;
    SILT_RESERVE(f->item, f->item_capacity, n + 1);
    SILT_RESERVE(f->local, f->local_capacity, n + 1);
    for (int i = 0; i < mesh->n_node; i++)
        place[i] = -1;
    for (int k = 0; k < n; k++) {
        const int i = node[k];
        nested_item *t = &f->item[k];
        *t = (nested_item){.x = {x[2 * i], x[2 * i + 1]}, .node = i};
        for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++)
            for (int d = 0; d < 2; d++)
                t->reach = silt_max(t->reach, fabs(x[2 * mesh->neighbour[m] + d] - t->x[d]));
        t->reach *= 1 + 1e-9;
    }
    f->n_block = f->part = 0;
    nested_dissect(f, mesh, place, 0, n, 0);
    for (int i = 0; i < mesh->n_node; i++)
        place[i] = n;
    for (int k = 0; k < n; k++) {
        node[k] = f->item[k].node;
        place[node[k]] = k;
    }
    nested_rows(f, mesh);
}

// ---------------------------------------------------------------- dense parts

// out (rows x columns, columns `apart` apart) -= a b^T over k columns of a and b, `ld` apart
VECTOR_INLINE void nested_product(int k, size_t ld, const double *a, const double *b, double *out, size_t apart, int rows,
                                  int columns) {
    for (int r = 0; r < rows; r += LANES) {
        eight sum[COLUMNS] = {{0}};
        const double *p = a + r, *q = b;
        for (int c = 0; c < k; c++, p += ld, q += ld) {
            const eight v = *(const eight *)p;
#pragma GCC unroll 4
            for (int j = 0; j < COLUMNS; j++)
                sum[j] += v * q[j];
        }
        for (int j = 0; j < columns; j++) {
            double *to = out + r + (size_t)j * apart;
            if (r + LANES <= rows)
                *(eight *)to -= sum[j];
            else
                for (int i = 0; r + i < rows; i++)
                    to[i] -= sum[j][i];
        }
    }
}

// L of the panel's top and of the rows below. @return -1, or the column with a pivot that is not positive
VECTOR_CLONES static int nested_panel(int own, int wide, double *panel) {
    const size_t ld = (size_t)wide;
    for (int at = 0; at < own; at += COLUMNS) {
        const int columns = own - at < COLUMNS ? own - at : COLUMNS;
        double *t = panel + at + ld * (size_t)at;
        nested_product(at, ld, panel + at, panel + at, t, ld, wide - at, columns);
        for (int j = 0; j < columns; j++) {
            double *column = t + ld * (size_t)j;
            if (!(column[j] > 0))
                return at + j;
            const double scale = 1 / sqrt(column[j]);
            for (int r = j + 1; r < wide - at; r++)
                column[r] *= scale;
            column[j] = scale;
            for (int m = j + 1; m < columns; m++) {
                double *next = t + ld * (size_t)m;
                const double factor = column[m];
                for (int r = m; r < wide - at; r++)
                    next[r] -= factor * column[r];
            }
        }
    }
    return -1;
}

// update -= L21 L21^T, lower triangle
VECTOR_CLONES static void nested_update(int own, int wide, const double *panel, double *update) {
    const int rest = wide - own;
    const double *below = panel + own;
    for (int at = 0; at < rest; at += COLUMNS)
        nested_product(own, (size_t)wide, below + at, below + at, update + at + (size_t)at * (size_t)rest, (size_t)rest, rest - at,
                       rest - at < COLUMNS ? rest - at : COLUMNS);
}

// The panel in the order in which solves read it: from one end to the other, and back. (By columns a solve of 5k nodes that finds
// the cache cold takes half as long again.)
VECTOR_CLONES static void nested_store(int own, int wide, const double *panel, double *out) {
    for (int c = 0; c < own; c++)
        for (int r = c; r < own; r++)
            *out++ = panel[r + (size_t)wide * (size_t)c];
    for (int r = own; r < wide; r += STRIP)
        for (int c = 0; c < own; c++, out += STRIP)
            for (int k = 0; k < STRIP; k++)
                out[k] = r + k < wide ? panel[r + k + (size_t)wide * (size_t)c] : 0;
}

// x (own rows, then those named) forward through a panel, m times four fields a row
VECTOR_INLINE void nested_forward(const int m, int own, int rest, const double *panel, const int *row, four *x, four *all) {
    for (int c = 0; c < own; c++) {
        four now[2];
        for (int k = 0; k < m; k++)
            x[m * c + k] = now[k] = x[m * c + k] * *panel;
        panel++;
        for (int r = c + 1; r < own; r++, panel++)
            for (int k = 0; k < m; k++)
                x[m * r + k] -= now[k] * *panel;
    }
    for (int r = 0; r < rest; r += STRIP) {
        four sum[STRIP][2];
        for (int i = 0; i < STRIP; i++)
            for (int k = 0; k < m; k++)
                sum[i][k] = all[m * row[r + i] + k];
        for (int c = 0; c < own; c++, panel += STRIP)
#pragma GCC unroll 4
            for (int i = 0; i < STRIP; i++)
                for (int k = 0; k < m; k++)
                    sum[i][k] -= x[m * c + k] * panel[i];
        for (int i = 0; i < STRIP; i++)
            for (int k = 0; k < m; k++)
                all[m * row[r + i] + k] = sum[i][k];
    }
}

VECTOR_INLINE void nested_backward(const int m, int own, int rest, const double *panel, const int *row, four *x, const four *all) {
    const double *l = panel += own * (own + 1) / 2;
    for (int r = 0; r < rest; r += STRIP) {
        four below[STRIP][2];
        for (int i = 0; i < STRIP; i++)
            for (int k = 0; k < m; k++)
                below[i][k] = all[m * row[r + i] + k];
        for (int c = 0; c < own; c++, l += STRIP)
            for (int k = 0; k < m; k++) {
                four sum = x[m * c + k];
#pragma GCC unroll 4
                for (int i = 0; i < STRIP; i++)
                    sum -= below[i][k] * l[i];
                x[m * c + k] = sum;
            }
    }
    for (int c = own - 1; c >= 0; c--) {
        panel -= own - c;
        four sum[2];
        for (int k = 0; k < m; k++)
            sum[k] = x[m * c + k];
        for (int r = c + 1; r < own; r++)
            for (int k = 0; k < m; k++)
                sum[k] -= x[m * r + k] * panel[r - c];
        for (int k = 0; k < m; k++)
            x[m * c + k] = sum[k] * *panel;
    }
}

// ---------------------------------------------------------------- factor

// columns of the front: the block's own in the factor, the others in its update; 0 in the lower triangle
static void nested_clear_columns(const silt_nested *f, const nested_block *b, double *panel, double *update) {
    const int own = b->end - b->begin, rest = b->row_end - b->row_begin, wide = own + rest;
    for (int c = 0; c < own; c++) {
        f->column[c] = panel + (size_t)c * (size_t)wide;
        f->local[b->begin + c] = c;
        memset(f->column[c] + c, 0, (size_t)(wide - c) * sizeof *panel);
    }
    for (int c = 0; c < rest; c++) {
        f->column[own + c] = update + (size_t)c * (size_t)rest - own;
        f->local[f->row[b->row_begin + c]] = own + c;
        memset(f->column[own + c] + own + c, 0, (size_t)(rest - c) * sizeof *update);
    }
}

// the lower triangle only
static inline void nested_entry(double **column, int a, int b, double value) {
    const int row = a > b ? a : b;
    column[a + b - row][row] += value;
}

// the diagonal of the block's nodes, and the triangles whose first node it eliminates
static void nested_assemble(const silt_nested *f, const silt_mesh *mesh, const double *diagonal, const double (*edge)[3],
                            const nested_block *b) {
    double **column = f->column;
    for (int p = b->begin; p < b->end; p++) {
        const int i = f->node[p];
        column[p - b->begin][p - b->begin] += diagonal[i];
        for (int k = mesh->node_cell_start[i]; k < mesh->node_cell_start[i + 1]; k++) {
            const int e = mesh->node_cell[k], *node = mesh->cell[e];
            const int place[3] = {f->place[node[0]], f->place[node[1]], f->place[node[2]]};
            if (place[0] < p || place[1] < p || place[2] < p || place[0] == f->n || place[1] == f->n || place[2] == f->n)
                continue;
            const int at[3] = {f->local[place[0]], f->local[place[1]], f->local[place[2]]};
            for (int c = 0; c < 3; c++) {
                const int q = at[(c + 1) % 3], r = at[(c + 2) % 3];
                nested_entry(column, q, r, edge[e][c]);
                column[q][q] -= edge[e][c];
                column[r][r] -= edge[e][c];
            }
        }
    }
}

static void nested_extend(const silt_nested *f, const nested_block *child, const double *update) {
    const int n = child->row_end - child->row_begin, *row = f->row + child->row_begin;
    int *at = f->at;
    for (int r = 0; r < n; r++)
        at[r] = f->local[row[r]];
    for (int c = 0; c < n; c++, update += n) {
        double *column = f->column[at[c]];
        for (int r = c; r < n; r++)
            column[at[r]] += update[r];
    }
}

int silt_nested_factor(silt_nested *f, const silt_mesh *mesh, const double *diagonal, const double (*edge)[3]) {
    int n_waiting = 0;
    double *top[2] = {f->stack[0], f->stack[1]};
    for (int e = 0; e < f->n_block; e++) {
        const nested_block *b = &f->block[e];
        const int own = b->end - b->begin, wide = own + b->row_end - b->row_begin;
        double *panel = f->panel, *update = top[b->side];
        nested_clear_columns(f, b, panel, update);
        nested_assemble(f, mesh, diagonal, edge, b);
        for (int c = 0; c < b->n_child; c++) {
            const nested_block *child = &f->block[f->waiting[--n_waiting]];
            const size_t size = (size_t)(child->row_end - child->row_begin);
            top[!b->side] -= size * size;
            nested_extend(f, child, top[!b->side]);
        }
        const int bad = nested_panel(own, wide, panel);
        if (bad >= 0)
            return f->node[b->begin + bad];
        nested_update(own, wide, panel, update);
        nested_store(own, wide, panel, f->value + b->value);
        top[b->side] += (size_t)(wide - own) * (size_t)(wide - own);
        f->waiting[n_waiting++] = e;
    }
    return -1;
}

// ---------------------------------------------------------------- solve

VECTOR_INLINE void nested_sweep(const silt_nested *f, const int m, double *field) {
    four *all = (four *)field;
    for (int e = 0; e < f->n_block; e++) {
        const nested_block *b = &f->block[e];
        const int own = b->end - b->begin;
        nested_forward(m, own, b->row_end - b->row_begin, f->value + b->value, f->row + b->row_begin, all + m * b->begin, all);
    }
    for (int e = f->n_block - 1; e >= 0; e--) {
        const nested_block *b = &f->block[e];
        const int own = b->end - b->begin;
        nested_backward(m, own, b->row_end - b->row_begin, f->value + b->value, f->row + b->row_begin, all + m * b->begin, all);
    }
}

VECTOR_CLONES static void nested_sweep_four(const silt_nested *f, double *field) { nested_sweep(f, 1, field); }

VECTOR_CLONES static void nested_sweep_eight(const silt_nested *f, double *field) { nested_sweep(f, 2, field); }

void silt_nested_solve(const silt_nested *f, int n_field, double *field) {
    if (n_field == 4)
        nested_sweep_four(f, field);
    else
        nested_sweep_eight(f, field);
}

void silt_nested_free(silt_nested **nested) {
    silt_nested *f = *nested;
    if (f == NULL)
        return;
    void *owned[] = {f->block, f->item, f->row, f->local, f->waiting, f->at, f->value, f->panel, f->stack[0], f->stack[1], f->column};
    for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
        free(owned[k]);
    free(f);
    *nested = NULL;
}
