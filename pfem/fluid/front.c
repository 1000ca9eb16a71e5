// nested dissection and fronts
#include <omp.h>

#include "dense.h"
#include "front.h"

// parts of so few nodes are eliminated at one go
#define FRONT_LEAF 32
// Subtrees that threads take one by one, and the work (multiplications) below which a subtree is not divided. What does not hang on
// the number of threads are the bits: every front sums the same in the same order, whoever does it.
#define BRANCH_MOST 16
#define BRANCH_WORK 4e6

/** a node on its way through the dissection */
struct item {
    double x[2];
    double reach; // farthest neighbour, along an axis
    int node;
};

/** columns that are eliminated together, with the rows below them */
struct block {
    int begin, end;  // places in the order
    int n_child;     // that many blocks before it in the tree
    int first;       // first block of the subtree that it is the last of
    int side;        // stack that its update waits on: parents and children take turns, so that none has to move
    int row_begin, row_end;
    double work;     // of the subtree, multiplications
    size_t value;    // of the panel (end - begin columns of own and row_end - row_begin entries)
};

/** A node of the tree's top, or a subtree that one thread does. Its last block's update waits here for its parent. */
struct branch {
    int begin, end;  // blocks; of the top: one
    int bad;         // node where the matrix is not positive definite, -1
    bool top;
    float *update;   // owned, until its parent has it
    float *give;     // owned, what the subtree adds to the right side at its last block's rows
    size_t give_capacity;
};

/** what a thread works with */
struct worker {
    float *stack[2];        // owned, updates that wait for their parent; of a factor's time only
    float **column;         // owned, of the present front
    int *waiting;           // owned, blocks on the stacks
    int *local;             // owned, per place: row in the front
    int *at;                // owned, rows of the front that a star or an update goes to
    int *run;               // owned, ends of runs among these
    float *part_right;      // owned, the right side's numbers in a front
    float *right;           // owned, per place: the right side in a subtree and above it
    int column_capacity, waiting_capacity, local_capacity, at_capacity, run_capacity, part_capacity, right_capacity;
};

struct silt_front {
    int n;
    int n_block, block_capacity;
    struct block *block;    // owned, children before their parents
    int *order, *place;     // owned, node at a place, place of a node
    int *row;               // owned, places, rising in a block
    int *first;             // owned, of each star, the lowest place
    int *local;             // the first worker's; in the dissection: part
    struct item *item;      // owned, while the order is looked for
    float *value;           // owned, panels, columns one after the other, 1/diagonal in the diagonal's place
    float *whole;           // owned, in the order of elimination: the matrix's diagonal
    float *right;           // owned, in the order of elimination
    int n_branch;
    struct branch branch[BRANCH_MOST]; // children before their parents
    int n_worker;
    struct worker *worker;  // owned
    int order_capacity, place_capacity, row_capacity, first_capacity, right_capacity, whole_capacity, worker_capacity;
    size_t value_capacity, stacked[2]; // most of any subtree
    int widest; // front
    int part;
};

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

// adds places above the block that the mark has not seen
static int rows_add(silt_front *f, int count, int begin, int mark, int above, const int *place, int n) {
    for (int k = 0; k < n; k++)
        if (place[k] >= above && f->local[place[k]] != mark) {
            f->local[place[k]] = mark;
            f->row[begin + count++] = place[k];
        }
    return count;
}

// rows below every block: those that its children hand on, and the stars that begin in it. @return numbers in all panels
static size_t rows_find(silt_front *f, const silt_front_matrix *q) {
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
    int filled = 0;
    size_t value = 0;
    f->widest = 0;
    for (int e = 0; e < f->n_block; e++) {
        struct block *b = &f->block[e];
        SILT_RESERVE(f->row, f->row_capacity, filled + (n - b->end) + 1);
        int count = 0;
        b->row_begin = filled;
        b->first = e;
        b->work = 0;
        for (int c = 0; c < b->n_child; c++) {
            const struct block *child = &f->block[b->first - 1];
            count = rows_add(f, count, filled, e, b->end, f->row + child->row_begin, child->row_end - child->row_begin);
            b->first = child->first;
            b->work += child->work;
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
        silt_sort_few(count, f->row + filled);
        filled += count;
        b->row_end = filled;
        b->value = value;
        const size_t own = (size_t)(b->end - b->begin);
        value += own * (own + (size_t)count);
        f->widest = (int)own + count > f->widest ? (int)own + count : f->widest;
        b->work += (double)own * ((double)own * ((double)own / 3 + count) + (double)count * count);
    }
    return value;
}

// ---------------------------------------------------------------- branches

static void branch_add(silt_front *f, int last) {
    struct branch *t = &f->branch[f->n_branch++];
    t->begin = f->block[last].first;
    t->end = last + 1;
    t->top = false;
}

// the heaviest subtree becomes a node of the top, its children subtrees. @return false where that is not worth it
static bool branch_divide(silt_front *f) {
    int heaviest = -1;
    double most = BRANCH_WORK;
    for (int k = 0; k < f->n_branch; k++) {
        const struct branch *t = &f->branch[k];
        if (!t->top && t->end - t->begin > 1 && f->block[t->end - 1].work > most) {
            most = f->block[t->end - 1].work;
            heaviest = k;
        }
    }
    if (heaviest < 0 || f->n_branch + f->block[f->branch[heaviest].end - 1].n_child > BRANCH_MOST)
        return false;
    struct branch *t = &f->branch[heaviest];
    int child = t->end - 2;
    t->begin = t->end - 1;
    t->top = true;
    for (int c = 0; c < f->block[t->begin].n_child; c++) {
        branch_add(f, child);
        child = f->block[child].first - 1;
    }
    return true;
}

// what waits on the stacks at most while a subtree is done
static void branch_stacks(silt_front *f, const struct branch *t, int *waiting) {
    size_t stacked[2] = {0, 0};
    int n_waiting = 0;
    for (int e = t->begin; e < t->end - 1; e++) {
        const struct block *b = &f->block[e];
        for (int c = 0; c < b->n_child; c++) {
            const struct block *child = &f->block[waiting[--n_waiting]];
            const size_t size = (size_t)(child->row_end - child->row_begin);
            stacked[!b->side] -= size * size;
        }
        waiting[n_waiting++] = e;
        stacked[b->side] += (size_t)(b->row_end - b->row_begin) * (size_t)(b->row_end - b->row_begin);
        f->stacked[b->side] = stacked[b->side] > f->stacked[b->side] ? stacked[b->side] : f->stacked[b->side];
    }
}

static int compare_branches(const void *a, const void *b) {
    const struct branch *p = a, *q = b;
    return (p->end > q->end) - (p->end < q->end);
}

static void branches_find(silt_front *f) {
    f->n_branch = 0;
    // trees that no separator joins: the last block is the root of the last one
    for (int last = f->n_block - 1; last >= 0 && f->n_branch < BRANCH_MOST; last = f->block[last].first - 1)
        branch_add(f, last);
    while (branch_divide(f))
        ;
    qsort(f->branch, (size_t)f->n_branch, sizeof *f->branch, compare_branches);
    if (f->n_branch) // more trees than branches: the first one takes the rest
        f->branch[0].begin = 0;
    f->stacked[0] = f->stacked[1] = 0;
    SILT_RESERVE(f->worker->waiting, f->worker->waiting_capacity, f->n_block + 1);
    for (int k = 0; k < f->n_branch; k++)
        branch_stacks(f, &f->branch[k], f->worker->waiting);
}

void silt_front_order(silt_front **front, const silt_front_matrix *q, const double *x) {
    if (!*front)
        *front = silt_alloc(1, sizeof **front);
    silt_front *f = *front;
    const int n = f->n = q->n;
    SILT_RESERVE(f->order, f->order_capacity, n + 1);
    SILT_RESERVE(f->place, f->place_capacity, n + 1);
    SILT_RESERVE(f->first, f->first_capacity, n + 1);
    SILT_RESERVE(f->worker, f->worker_capacity, 1);
    SILT_RESERVE(f->worker->local, f->worker->local_capacity, n + 1);
    f->local = f->worker->local;
    f->item = silt_alloc((size_t)n + 1, sizeof *f->item);
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
    free(f->item);
    f->item = NULL;
    const size_t value = rows_find(f, q);
    f->value = silt_room(f->value, &f->value_capacity, value + DENSE_PAD, sizeof(float));
    branches_find(f);
}

// ---------------------------------------------------------------- factor

// the lower triangle only
static inline void entry_add(float **column, int a, int b, float value) {
    const int row = a > b ? a : b;
    column[a + b - row][row] += value;
}

// stars whose first node the block eliminates
static void assemble(const silt_front *f, struct worker *w, const silt_front_matrix *q, const struct block *b) {
    float **column = w->column;
    int *at = w->at;
    const int *local = w->local;
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
                at[m] = local[f->place[q->neighbour[start + m]]];
            const int own = local[f->place[i]];
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

// adds a child's update: its rows stand in the front in runs of neighbours, ten or so
static void extend_add(const silt_front *f, struct worker *w, const struct block *child, const float *update) {
    const int n = child->row_end - child->row_begin, *row = f->row + child->row_begin;
    int *at = w->at, *end = w->run; // of the run that a row is in
    for (int r = 0; r < n; r++)
        at[r] = w->local[row[r]];
    for (int r = n - 1; r >= 0; r--)
        end[r] = r + 1 < n && at[r + 1] == at[r] + 1 ? end[r + 1] : r + 1;
    silt_dense_scatter(n, at, end, update, w->column);
}

// columns of the front: the block's own in the factor, the others in its update; 0 in the lower triangle
static void columns_clear(const silt_front *f, struct worker *w, const struct block *b, float *panel, float *update) {
    const int own = b->end - b->begin, rest = b->row_end - b->row_begin, wide = own + rest;
    for (int c = 0; c < own; c++) {
        w->column[c] = panel + (size_t)c * (size_t)wide;
        w->local[b->begin + c] = c;
        memset(w->column[c] + c, 0, (size_t)(wide - c) * sizeof *panel);
    }
    for (int c = 0; c < rest; c++) {
        w->column[own + c] = update + (size_t)c * (size_t)rest - own;
        w->local[f->row[b->row_begin + c]] = own + c;
        memset(w->column[own + c] + own + c, 0, (size_t)(rest - c) * sizeof *update);
    }
}

// the branch of the top's block e that comes before block `last`, its child
static struct branch *branch_of(silt_front *f, int last) {
    int k = 0;
    while (f->branch[k].end != last + 1)
        k++;
    return &f->branch[k];
}

// what the children of a node of the top have left for it. @return -1, or a node where one of them failed
static int children_add(silt_front *f, struct worker *w, const struct branch *t) {
    int child = t->end - 2, bad = -1;
    for (int c = 0; c < f->block[t->begin].n_child; c++) {
        struct branch *other = branch_of(f, child);
        if (other->bad < 0)
            extend_add(f, w, &f->block[child], other->update);
        else
            bad = other->bad;
        free(other->update);
        other->update = NULL;
        child = f->block[child].first - 1;
    }
    return bad;
}

// the blocks of a branch, once all below are done
static void branch_factor(silt_front *f, struct worker *w, const silt_front_matrix *q, struct branch *t) {
    int n_waiting = 0;
    float *top[2] = {w->stack[0], w->stack[1]};
    const struct block *last = &f->block[t->end - 1];
    const size_t rest = (size_t)(last->row_end - last->row_begin);
    t->bad = -1;
    t->update = silt_alloc(rest * rest + DENSE_PAD, sizeof(float));
    for (int e = t->begin; e < t->end && t->bad < 0; e++) {
        const struct block *b = &f->block[e];
        const int own = b->end - b->begin, wide = own + b->row_end - b->row_begin;
        float *panel = f->value + b->value, *update = b == last ? t->update : top[b->side];
        columns_clear(f, w, b, panel, update);
        assemble(f, w, q, b);
        if (t->top)
            t->bad = children_add(f, w, t);
        for (int c = 0; c < b->n_child && !t->top; c++) {
            const struct block *child = &f->block[w->waiting[--n_waiting]];
            const size_t size = (size_t)(child->row_end - child->row_begin);
            top[!b->side] -= size * size;
            extend_add(f, w, child, top[!b->side]);
        }
        const int bad = t->bad < 0 ? silt_dense_factor(own, wide, f->whole + b->begin, panel) : -1;
        if (bad >= 0)
            t->bad = f->order[b->begin + bad];
        if (t->bad >= 0)
            return;
        silt_dense_update(own, wide, panel, update);
        top[b->side] += (size_t)(wide - own) * (size_t)(wide - own);
        w->waiting[n_waiting++] = e;
    }
}

/** what is done with every branch: children first, or last */
typedef struct pass {
    silt_front *f;
    const silt_front_matrix *q;
    const double *right;
    double *out, scale;
    void (*before)(const struct pass *pass, struct worker *w, struct branch *t); // its children; NULL: nothing
    void (*after)(const struct pass *pass, struct worker *w, struct branch *t);
} pass;

static void branch_pass(const pass *p, struct branch *t) {
    if (p->before)
        p->before(p, &p->f->worker[omp_get_thread_num()], t);
    int child = t->end - 2;
    for (int c = 0; t->top && c < p->f->block[t->begin].n_child; c++) {
        struct branch *other = branch_of(p->f, child);
#pragma omp task firstprivate(p, other)
        branch_pass(p, other);
        child = p->f->block[child].first - 1;
    }
#pragma omp taskwait
    if (p->after)
        p->after(p, &p->f->worker[omp_get_thread_num()], t);
}

static void all_pass(const pass *p) {
    silt_front *f = p->f;
    // a branch that no other one is the parent of
    for (int last = f->n_block - 1; last >= 0;) {
        struct branch *t = branch_of(f, last);
#pragma omp task firstprivate(p, t)
        branch_pass(p, t);
        last = t == f->branch ? -1 : f->block[last].first - 1;
    }
#pragma omp taskwait
}

static void pass_run(const pass *p) {
    if (p->f->n_worker == 1)
        all_pass(p);
    else {
#pragma omp parallel num_threads(p->f->n_worker)
#pragma omp single
        all_pass(p);
    }
}

static void factor_after(const pass *p, struct worker *w, struct branch *t) { branch_factor(p->f, w, p->q, t); }

// as many workers as there are threads and branches
static void workers_make(silt_front *f, int most) {
    most = most < f->n_branch ? most : f->n_branch;
    f->n_worker = most > 1 ? most : 1;
    SILT_RESERVE(f->worker, f->worker_capacity, f->n_worker);
    for (int k = 0; k < f->n_worker; k++) {
        struct worker *w = &f->worker[k];
        SILT_RESERVE(w->waiting, w->waiting_capacity, f->n_block + 1);
        SILT_RESERVE(w->local, w->local_capacity, f->n + 1);
        SILT_RESERVE(w->right, w->right_capacity, f->n + 1);
        SILT_RESERVE(w->column, w->column_capacity, f->widest + 1);
        SILT_RESERVE(w->at, w->at_capacity, f->widest + 1);
        SILT_RESERVE(w->run, w->run_capacity, f->widest + 1);
        SILT_RESERVE(w->part_right, w->part_capacity, f->widest + DENSE_PAD);
        for (int side = 0; side < 2; side++)
            w->stack[side] = silt_alloc(f->stacked[side] + DENSE_PAD, sizeof(float));
    }
}

int silt_front_factor(silt_front *f, const silt_front_matrix *q) {
    for (int k = 0; k < f->n; k++)
        f->whole[k] = q->whole[f->order[k]];
    workers_make(f, q->threads);
    pass_run(&(pass){.f = f, .q = q, .after = factor_after});
    for (int k = 0; k < f->n_worker; k++)
        for (int side = 0; side < 2; side++) {
            free(f->worker[k].stack[side]);
            f->worker[k].stack[side] = NULL;
        }
    int bad = -1;
    for (int k = f->n_branch - 1; k >= 0; k--) {
        bad = f->branch[k].bad >= 0 ? f->branch[k].bad : bad;
        free(f->branch[k].update);
        f->branch[k].update = NULL;
    }
    return bad;
}

// ---------------------------------------------------------------- solve

// numbers of a front from and to the right side
static void part_take(const silt_front *f, const struct block *b, const float *y, float *t) {
    const int own = b->end - b->begin, rest = b->row_end - b->row_begin, *row = f->row + b->row_begin;
    memcpy(t, y + b->begin, (size_t)own * sizeof *t);
    for (int r = 0; r < rest; r++)
        t[own + r] = y[row[r]];
}

// A branch works on a right side of its own: what it adds above itself waits until its parent takes it.
static void forward_after(const pass *p, struct worker *w, struct branch *t) {
    silt_front *f = p->f;
    const struct block *last = &f->block[t->end - 1];
    const int begin = f->block[t->begin].begin, end = last->end, n_row = last->row_end - last->row_begin, *row = f->row + last->row_begin;
    float *y = w->right, *part = w->part_right;
    for (int k = begin; k < end; k++)
        y[k] = (float)(p->right[f->order[k]] / p->scale);
    for (int r = 0; r < n_row; r++)
        y[row[r]] = 0;
    int child = t->end - 2;
    for (int c = 0; t->top && c < last->n_child; c++) {
        const float *give = branch_of(f, child)->give;
        const struct block *b = &f->block[child];
        for (int r = b->row_begin; r < b->row_end; r++)
            y[f->row[r]] += *give++;
        child = b->first - 1;
    }
    for (int e = t->begin; e < t->end; e++) {
        const struct block *b = &f->block[e];
        const int own = b->end - b->begin, rest = b->row_end - b->row_begin;
        part_take(f, b, y, part);
        silt_dense_forward(own, own + rest, f->value + b->value, part);
        memcpy(y + b->begin, part, (size_t)own * sizeof *part);
        for (int r = 0; r < rest; r++)
            y[f->row[b->row_begin + r]] = part[own + r];
    }
    memcpy(f->right + begin, y + begin, (size_t)(end - begin) * sizeof *y);
    t->give = silt_room(t->give, &t->give_capacity, (size_t)n_row + 1, sizeof(float));
    for (int r = 0; r < n_row; r++)
        t->give[r] = y[row[r]];
}

static void backward_before(const pass *p, struct worker *w, struct branch *t) {
    silt_front *f = p->f;
    float *y = f->right;
    for (int e = t->end - 1; e >= t->begin; e--) {
        const struct block *b = &f->block[e];
        const int own = b->end - b->begin, rest = b->row_end - b->row_begin;
        part_take(f, b, y, w->part_right);
        silt_dense_backward(own, own + rest, f->value + b->value, w->part_right);
        memcpy(y + b->begin, w->part_right, (size_t)own * sizeof *y);
    }
    for (int k = f->block[t->begin].begin; k < f->block[t->end - 1].end; k++)
        p->out[f->order[k]] = p->scale * (double)y[k];
}

void silt_front_solve(silt_front *f, const double *right, double *out) {
    double most = 0;
    for (int k = 0; k < f->n; k++)
        most = silt_max(most, fabs(right[k]));
    pass p = {.f = f, .right = right, .out = out, .scale = most > 0 ? most : 1, .after = forward_after};
    pass_run(&p);
    p.after = NULL;
    p.before = backward_before;
    pass_run(&p);
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
    free(f->value);
    free(f->right);
    free(f->whole);
    for (int k = 0; k < BRANCH_MOST; k++)
        free(f->branch[k].give);
    for (int k = 0; k < f->worker_capacity; k++) {
        struct worker *w = &f->worker[k];
        free(w->column);
        free(w->waiting);
        free(w->local);
        free(w->at);
        free(w->run);
        free(w->part_right);
        free(w->right);
    }
    free(f->worker);
    free(f);
    *front = NULL;
}
