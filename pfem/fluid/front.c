// nested dissection and fronts
#include "front.h"
#include "dense.h"

// parts of so few nodes are eliminated at one go
#define FRONT_LEAF 32

/** a node on its way through the dissection */
struct item {
    double x[2];
    double reach; // farthest neighbour, along an axis
    int node;
};

/** columns that are eliminated together, with the rows below them */
struct block {
    int begin, end;  // places in the order
    int n_child;     // that many blocks' updates lie on top of the other stack
    int side;        // stack that its update waits on: parents and children take turns, so that none has to move
    int row_begin, row_end;
    size_t value;    // of the panel (end - begin columns of own and row_end - row_begin entries)
};

struct silt_front {
    int n;
    int n_block, block_capacity;
    struct block *block;    // owned, children before their parents
    int *order, *place;     // owned, node at a place, place of a node
    int *row;               // owned, places, rising in a block
    int *first;             // owned, of each star, the lowest place
    int *local;             // owned, per place: row in the front; in the dissection: part
    struct item *item;      // in a stack's memory, while nothing waits there
    float *value;           // owned, panels, columns one after the other, 1/diagonal in the diagonal's place
    float *stack[2];        // owned, updates that wait for their parent
    float *whole;           // owned, in the order of elimination: the matrix's diagonal
    float *right;           // owned, in the order of elimination
    float **column;         // owned, of the present front
    int *waiting;           // owned, blocks on the stack
    int *at;                // owned, rows of the front that a star or an update goes to
    int *run;               // owned, ends of runs among these
    float *part_right;      // owned, the right side's numbers in a front
    int order_capacity, place_capacity, row_capacity, first_capacity, local_capacity, right_capacity, column_capacity,
        whole_capacity, waiting_capacity, at_capacity, run_capacity, part_capacity;
    size_t value_capacity, stack_capacity[2];
    int widest; // front
    int part;
};

static float *room(float *old, size_t *capacity, size_t need) {
    if (need <= *capacity)
        return old;
    free(old);
    *capacity = need + need / 8;
    return silt_alloc(*capacity, sizeof(float));
}

// ---------------------------------------------------------------- order

static int block_add(silt_front *f, int begin, int end, int n_child, int depth) {
    SILT_RESERVE(f->block, f->block_capacity, f->n_block + 1);
    f->block[f->n_block++] = (struct block){.begin = begin, .end = end, .n_child = n_child, .side = depth % 2};
    return 1;
}

static void swap_items(struct item *a, struct item *b) {
    const struct item t = *a;
    *a = *b;
    *b = t;
}

#define SEPARATED (-1)

// nodes of a star that lie on both sides of a cut, while its node is none of them: the fewer go to the separator
static void clear_star(silt_front *f, const silt_front_matrix *q, int w, int low) {
    int count[2] = {0, 0};
    for (int k = q->neighbour_start[w]; k < q->neighbour_start[w + 1]; k++) {
        const int side = f->local[q->neighbour[k]] - low;
        if (side == 0 || side == 1)
            count[side]++;
    }
    if (!count[0] || !count[1])
        return;
    const int fewer = low + (count[1] < count[0]);
    for (int k = q->neighbour_start[w]; k < q->neighbour_start[w + 1]; k++)
        if (f->local[q->neighbour[k]] == fewer)
            f->local[q->neighbour[k]] = SEPARATED;
}

// what joins the two sides of a cut at `cut`: nodes with a neighbour beyond it, and what a separated node of before joins.
// Only nodes whose reach crosses the cut are looked at.
static void separate(silt_front *f, const silt_front_matrix *q, int begin, int end, int axis, double cut, int low) {
    int n_touch = 0, *touch = f->first; // separated nodes near the cut, and those of this cut
    for (int k = begin; k < end; k++) {
        const struct item *t = &f->item[k];
        if (fabs(t->x[axis] - cut) > t->reach)
            continue;
        const int other = 2 * low + 1 - f->local[t->node];
        bool joined = false, outer = false;
        for (int m = q->neighbour_start[t->node]; m < q->neighbour_start[t->node + 1]; m++) {
            const int part = f->local[q->neighbour[m]];
            joined |= part == other;
            outer |= part == SEPARATED;
        }
        if (joined || outer)
            touch[n_touch++] = joined ? t->node : ~t->node;
    }
    for (int k = 0; k < n_touch; k++)
        if (touch[k] >= 0)
            f->local[touch[k]] = SEPARATED;
    for (int k = 0; k < n_touch; k++) {
        const int i = touch[k] < 0 ? ~touch[k] : touch[k];
        for (int m = q->neighbour_start[i]; m < q->neighbour_start[i + 1]; m++)
            if (f->local[q->neighbour[m]] == SEPARATED)
                clear_star(f, q, q->neighbour[m], low);
    }
}

// orders the items from begin to end. @return how many blocks wait for a parent
static int dissect(silt_front *f, const silt_front_matrix *q, int begin, int end, int depth) {
    const int n = end - begin;
    if (n <= FRONT_LEAF)
        return n ? block_add(f, begin, end, 0, depth) : 0;
    double lo[2] = {HUGE_VAL, HUGE_VAL}, hi[2] = {-HUGE_VAL, -HUGE_VAL}, sum[2] = {0, 0};
    for (int k = begin; k < end; k++)
        for (int d = 0; d < 2; d++) {
            const double x = f->item[k].x[d];
            lo[d] = x < lo[d] ? x : lo[d];
            hi[d] = x > hi[d] ? x : hi[d];
            sum[d] += x;
        }
    const int axis = hi[1] - lo[1] > hi[0] - lo[0], low = f->part;
    const double cut = sum[axis] / n;
    f->part += 2;
    int count = 0;
    for (int k = begin; k < end; k++) {
        const int side = f->item[k].x[axis] >= cut;
        f->local[f->item[k].node] = low + side;
        count += side;
    }
    if (count == 0 || count == n)
        return block_add(f, begin, end, 0, depth);
    separate(f, q, begin, end, axis, cut, low);
    // low side, high side, separator
    int a = begin, b = end, k = begin;
    while (k < b) {
        const int part = f->local[f->item[k].node];
        if (part == low) {
            if (k != a)
                swap_items(&f->item[a], &f->item[k]);
            a++;
            k++;
        } else if (part == SEPARATED)
            swap_items(&f->item[k], &f->item[--b]);
        else
            k++;
    }
    const int below = depth + (b < end); // without a separator the parts go to this one's parent
    const int waiting = dissect(f, q, begin, a, below) + dissect(f, q, a, b, below);
    return b < end ? block_add(f, b, end, waiting, depth) : waiting;
}

static void sort_rows(int n, int *row) {
    for (int a = 1; a < n; a++) {
        const int key = row[a];
        int b = a - 1;
        for (; b >= 0 && row[b] > key; b--)
            row[b + 1] = row[b];
        row[b + 1] = key;
    }
}

// adds places above the block that the mark has not seen
static int rows_add(silt_front *f, int count, int begin, int mark, int above, const int *place, int n) {
    for (int k = 0; k < n; k++)
        if (place[k] >= above && f->local[place[k]] != mark) {
            f->local[place[k]] = mark;
            f->row[begin + count++] = place[k];
        }
    return count;
}

// rows below every block: those that its children hand on, and the stars that begin in it
static void rows_find(silt_front *f, const silt_front_matrix *q) {
    const int n = f->n;
    for (int i = 0; i < n; i++) {
        int first = n;
        for (int k = q->neighbour_start[i]; k < q->neighbour_start[i + 1]; k++) {
            const int place = f->place[q->neighbour[k]];
            first = place < first ? place : first;
        }
        f->first[i] = first;
        f->local[i] = -1;
    }
    SILT_RESERVE(f->waiting, f->waiting_capacity, f->n_block + 1);
    int n_waiting = 0, filled = 0;
    size_t value = 0, stacked[2] = {0, 0}, peak[2] = {0, 0};
    f->widest = 0;
    for (int e = 0; e < f->n_block; e++) {
        struct block *b = &f->block[e];
        SILT_RESERVE(f->row, f->row_capacity, filled + (n - b->end) + 1);
        int count = 0;
        b->row_begin = filled;
        for (int c = n_waiting - b->n_child; c < n_waiting; c++) {
            const struct block *child = &f->block[f->waiting[c]];
            const int size = child->row_end - child->row_begin;
            count = rows_add(f, count, filled, e, b->end, f->row + child->row_begin, size);
            stacked[!b->side] -= (size_t)size * (size_t)size;
        }
        for (int p = b->begin; p < b->end; p++) {
            const int u = f->order[p];
            for (int k = q->neighbour_start[u]; k < q->neighbour_start[u + 1]; k++) {
                const int i = q->neighbour[k];
                if (f->first[i] != p)
                    continue;
                for (int m = q->neighbour_start[i]; m < q->neighbour_start[i + 1]; m++)
                    count = rows_add(f, count, filled, e, b->end, &f->place[q->neighbour[m]], 1);
            }
        }
        sort_rows(count, f->row + filled);
        filled += count;
        b->row_end = filled;
        b->value = value;
        const size_t own = (size_t)(b->end - b->begin);
        value += own * (own + (size_t)count);
        n_waiting -= b->n_child;
        f->waiting[n_waiting++] = e;
        stacked[b->side] += (size_t)count * (size_t)count;
        peak[b->side] = stacked[b->side] > peak[b->side] ? stacked[b->side] : peak[b->side];
        f->widest = (int)own + count > f->widest ? (int)own + count : f->widest;
    }
    f->value = room(f->value, &f->value_capacity, value + DENSE_PAD);
    for (int k = 0; k < 2; k++)
        f->stack[k] = room(f->stack[k], &f->stack_capacity[k], peak[k] + DENSE_PAD);
    SILT_RESERVE(f->column, f->column_capacity, f->widest + 1);
    SILT_RESERVE(f->at, f->at_capacity, f->widest + 1);
    SILT_RESERVE(f->run, f->run_capacity, f->widest + 1);
    SILT_RESERVE(f->part_right, f->part_capacity, f->widest + DENSE_PAD);
}

void silt_front_order(silt_front **front, const silt_front_matrix *q, const double *x) {
    if (!*front)
        *front = silt_alloc(1, sizeof **front);
    silt_front *f = *front;
    const int n = f->n = q->n;
    SILT_RESERVE(f->order, f->order_capacity, n + 1);
    SILT_RESERVE(f->place, f->place_capacity, n + 1);
    SILT_RESERVE(f->first, f->first_capacity, n + 1);
    SILT_RESERVE(f->local, f->local_capacity, n + 1);
    f->stack[0] = room(f->stack[0], &f->stack_capacity[0], sizeof(struct item) / sizeof(float) * (size_t)(n + 1));
    f->item = (struct item *)(void *)f->stack[0];
    SILT_RESERVE(f->right, f->right_capacity, n + 1);
    SILT_RESERVE(f->whole, f->whole_capacity, n + DENSE_PAD);
    for (int i = 0; i < n; i++) {
        struct item *t = &f->item[i];
        *t = (struct item){.x = {x[2 * i], x[2 * i + 1]}, .node = i};
        for (int k = q->neighbour_start[i]; k < q->neighbour_start[i + 1]; k++)
            for (int d = 0; d < 2; d++) {
                const double way = fabs(x[2 * q->neighbour[k] + d] - t->x[d]);
                t->reach = way > t->reach ? way : t->reach;
            }
        t->reach *= 1 + 1e-9;
        f->local[i] = -2;
    }
    f->n_block = f->part = 0;
    dissect(f, q, 0, n, 0);
    for (int k = 0; k < n; k++) {
        f->order[k] = f->item[k].node;
        f->place[f->order[k]] = k;
    }
    rows_find(f, q);
}

// ---------------------------------------------------------------- factor

// the lower triangle only
static inline void entry_add(float **column, int a, int b, float value) {
    const int row = a > b ? a : b;
    column[a + b - row][row] += value;
}

// stars whose first node the block eliminates
static void assemble(const silt_front *f, const silt_front_matrix *q, const struct block *b) {
    float **column = f->column;
    int *at = f->at;
    for (int p = b->begin; p < b->end; p++) {
        const int u = f->order[p];
        column[p - b->begin][p - b->begin] += (float)q->diagonal[u];
        for (int k = q->neighbour_start[u]; k < q->neighbour_start[u + 1]; k++) {
            const int i = q->neighbour[k];
            if (f->first[i] != p)
                continue;
            const int start = q->neighbour_start[i], size = q->neighbour_start[i + 1] - start;
            const float *g = q->row + 3 * start;
            for (int m = 0; m < size; m++)
                at[m] = f->local[f->place[q->neighbour[start + m]]];
            const int own = f->local[f->place[i]];
            const float weight = q->weight[i];
            for (int m = 0; m < size; m++, g += 3) {
                const float *other = q->row + 3 * start, g0 = weight * g[0], g1 = weight * g[1];
                for (int r = 0; r < m; r++, other += 3)
                    entry_add(column, at[m], at[r], g0 * other[0] + g1 * other[1]);
                column[at[m]][at[m]] += g0 * g[0] + g1 * g[1];
                if (g[2] != 0)
                    entry_add(column, at[m], own, g[2]);
            }
        }
    }
}

// Adds a child's update. Its rows stand in the front in runs of neighbours, ten or so: by runs it takes half the time.
static void extend_add(const silt_front *f, const struct block *child, const float *update) {
    const int n = child->row_end - child->row_begin, *row = f->row + child->row_begin;
    int *at = f->at, *end = f->run; // of the run that a row is in
    for (int r = 0; r < n; r++)
        at[r] = f->local[row[r]];
    for (int r = n - 1; r >= 0; r--)
        end[r] = r + 1 < n && at[r + 1] == at[r] + 1 ? end[r + 1] : r + 1;
    silt_dense_scatter(n, at, end, update, f->column);
}

// columns of the front: the block's own in the factor, the others in its update; 0 in the lower triangle
static void columns_clear(const silt_front *f, const struct block *b, float *panel, float *update) {
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

int silt_front_factor(silt_front *f, const silt_front_matrix *q) {
    int n_waiting = 0;
    float *top[2] = {f->stack[0], f->stack[1]};
    for (int k = 0; k < f->n; k++)
        f->whole[k] = q->whole[f->order[k]];
    for (int e = 0; e < f->n_block; e++) {
        const struct block *b = &f->block[e];
        const int own = b->end - b->begin, wide = own + b->row_end - b->row_begin;
        float *panel = f->value + b->value, *update = top[b->side];
        columns_clear(f, b, panel, update);
        assemble(f, q, b);
        for (int c = 0; c < b->n_child; c++) {
            const struct block *child = &f->block[f->waiting[--n_waiting]];
            const size_t size = (size_t)(child->row_end - child->row_begin);
            top[!b->side] -= size * size;
            extend_add(f, child, top[!b->side]);
        }
        const int bad = silt_dense_factor(own, wide, f->whole + b->begin, panel);
        if (bad >= 0)
            return f->order[b->begin + bad];
        silt_dense_update(own, wide, panel, update);
        top[b->side] += (size_t)(wide - own) * (size_t)(wide - own);
        f->waiting[n_waiting++] = e;
    }
    return -1;
}

// ---------------------------------------------------------------- solve

void silt_front_solve(silt_front *f, const double *right, double *out) {
    float *y = f->right, *t = f->part_right;
    double most = 0;
    for (int k = 0; k < f->n; k++)
        most = silt_max(most, fabs(right[k]));
    const double scale = most > 0 ? most : 1;
    for (int k = 0; k < f->n; k++)
        y[k] = (float)(right[f->order[k]] / scale);
    for (int e = 0; e < f->n_block; e++) {
        const struct block *b = &f->block[e];
        const int own = b->end - b->begin, rest = b->row_end - b->row_begin, wide = own + rest, *row = f->row + b->row_begin;
        memcpy(t, y + b->begin, (size_t)own * sizeof *t);
        for (int r = 0; r < rest; r++)
            t[own + r] = y[row[r]];
        silt_dense_forward(own, wide, f->value + b->value, t);
        memcpy(y + b->begin, t, (size_t)own * sizeof *t);
        for (int r = 0; r < rest; r++)
            y[row[r]] = t[own + r];
    }
    for (int e = f->n_block - 1; e >= 0; e--) {
        const struct block *b = &f->block[e];
        const int own = b->end - b->begin, rest = b->row_end - b->row_begin, wide = own + rest, *row = f->row + b->row_begin;
        memcpy(t, y + b->begin, (size_t)own * sizeof *t);
        for (int r = 0; r < rest; r++)
            t[own + r] = y[row[r]];
        silt_dense_backward(own, wide, f->value + b->value, t);
        memcpy(y + b->begin, t, (size_t)own * sizeof *t);
    }
    for (int k = 0; k < f->n; k++)
        out[f->order[k]] = scale * (double)y[k];
}

void silt_front_free(silt_front **front) {
    if (!*front)
        return;
    silt_front *f = *front;
    free(f->block);
    free(f->order);
    free(f->place);
    free(f->row);
    free(f->first);
    free(f->local);
    free(f->value);
    free(f->stack[0]);
    free(f->stack[1]);
    free(f->right);
    free(f->whole);
    free(f->column);
    free(f->waiting);
    free(f->at);
    free(f->run);
    free(f->part_right);
    free(f);
    *front = NULL;
}
