// nested dissection by place, and the rows of the fronts
#include "front_inside.h"

// parts of so few nodes are eliminated at one go: stars, and pairs with two or three unknowns a node
#define FRONT_LEAF 32
#define FRONT_LEAF_PAIRS 12
// The work (multiplications) below which a subtree is not divided. What does not hang on the number of threads are the bits: every
// front sums the same in the same order, whoever does it.
#define BRANCH_WORK 4e6

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

// the same for pairs: the nodes above the cut that have a neighbour below it
static void separate_pairs(silt_front *f, const silt_front_matrix *q, int begin, int end, int axis, double cut, int low) {
    for (int k = begin; k < end; k++) {
        const struct item *t = &f->item[k];
        if (t->x[axis] - cut > t->reach || f->local[t->node] == low)
            continue;
        for (int m = q->neighbour_start[t->node]; m < q->neighbour_start[t->node + 1]; m++)
            if (f->local[q->neighbour[m]] == low)
                f->local[t->node] = SEPARATED;
    }
}

// orders the items from begin to end. @return how many blocks wait for a parent
static int dissect(silt_front *f, const silt_front_matrix *q, int begin, int end, int depth) {
    const int n = end - begin;
    if (n <= (q->pair ? FRONT_LEAF_PAIRS : FRONT_LEAF))
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
    if (q->pair)
        separate_pairs(f, q, begin, end, axis, cut, low);
    else
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

// the rest of the stars that begin with node u, at place p
static int rows_of_stars(silt_front *f, const silt_front_matrix *q, const struct block *b, int count, int e, int p) {
    const int u = f->order[p];
    for (int k = q->neighbour_start[u]; k < q->neighbour_start[u + 1]; k++) {
        const int i = q->neighbour[k];
        if (f->first[i] != p)
            continue;
        for (int m = q->neighbour_start[i]; m < q->neighbour_start[i + 1]; m++)
            count = rows_add(f, count, b->row_begin, e, b->end, &f->place[q->neighbour[m]], 1);
    }
    return count;
}

// rows below every block: those that its children hand on, and the stars that begin in it or the neighbours of its nodes
static void rows_find(silt_front *f, const silt_front_matrix *q) {
    const int n = q->n;
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
    for (int e = 0; e < f->n_block; e++) {
        struct block *b = &f->block[e];
        SILT_RESERVE(f->row, f->row_capacity, filled + (n - b->end) + 1);
        int count = 0;
        b->row_begin = filled;
        b->first = e;
        for (int c = 0; c < b->n_child; c++) {
            const struct block *child = &f->block[b->first - 1];
            count = rows_add(f, count, filled, e, b->end, f->row + child->row_begin, child->row_end - child->row_begin);
            b->first = child->first;
        }
        for (int p = b->begin; p < b->end; p++) {
            const int u = f->order[p];
            for (int k = q->neighbour_start[u]; k < q->neighbour_start[u + 1] && q->pair; k++)
                count = rows_add(f, count, filled, e, b->end, &f->place[q->neighbour[k]], 1);
            if (!q->pair)
                count = rows_of_stars(f, q, b, count, e, p);
        }
        silt_sort_few(count, f->row + filled);
        filled += count;
        b->row_end = filled;
    }
}

// From nodes to unknowns: of every block the velocities of its nodes, one node after the other, then the pressures, if there are any.
static void unknowns_expand(silt_front *f, int n_node, int m) {
    const int n_row = f->n_block ? f->block[f->n_block - 1].row_end : 0;
    int *node = silt_alloc((size_t)n_node + 1, sizeof *node), *owner = silt_alloc((size_t)n_node + 1, sizeof *owner);
    int *row = silt_alloc((size_t)n_row + 1, sizeof *row);
    memcpy(node, f->order, (size_t)n_node * sizeof *node);
    memcpy(row, f->row, (size_t)n_row * sizeof *row);
    SILT_RESERVE(f->row, f->row_capacity, m * n_row + 1);
    for (int e = 0; e < f->n_block; e++) {
        struct block *b = &f->block[e];
        const int count = b->end - b->begin;
        for (int k = 0; k < count; k++) {
            int *place = f->place + m * node[b->begin + k];
            owner[b->begin + k] = e;
            place[0] = m * b->begin + 2 * k;
            place[1] = place[0] + 1;
            if (m == 3)
                place[2] = m * b->begin + 2 * count + k;
        }
        b->negative = m == 3 ? count : 0;
        b->begin *= m;
        b->end *= m;
    }
    for (int u = 0; u < m * n_node; u++)
        f->order[f->place[u]] = u;
    int filled = 0;
    for (int e = 0; e < f->n_block; e++) {
        struct block *b = &f->block[e];
        const int begin = filled;
        for (int k = b->row_begin, last; k < b->row_end; k = last) {
            for (last = k; last < b->row_end && owner[row[last]] == owner[row[k]]; last++)
                for (int c = 0; c < 2; c++)
                    f->row[filled++] = f->place[m * node[row[last]] + c];
            for (int r = k; r < last && m == 3; r++)
                f->row[filled++] = f->place[m * node[row[r]] + 2];
        }
        b->row_begin = begin;
        b->row_end = filled;
    }
    free(node);
    free(owner);
    free(row);
}

// the work of subtrees, the widest front
static void work_count(silt_front *f) {
    f->widest = 0;
    for (int e = 0; e < f->n_block; e++) {
        struct block *b = &f->block[e];
        const int own = b->end - b->begin, count = b->row_end - b->row_begin;
        f->widest = own + count > f->widest ? own + count : f->widest;
        b->work = (double)own * ((double)own * ((double)own / 3 + count) + (double)count * count);
        for (int c = 0, child = e - 1; c < b->n_child; c++, child = f->block[child].first - 1)
            b->work += f->block[child].work;
    }
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
            stacked[!b->side] -= silt_front_update(&f->block[waiting[--n_waiting]]);
        }
        waiting[n_waiting++] = e;
        stacked[b->side] += silt_front_update(b);
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

// Where panels stand. Whole vectors are written back over a panel's end, what does not count as it was: behind a branch there is
// room for that, or it would undo what another thread does to the panel that comes next. @return numbers in all panels
static size_t panels_place(silt_front *f) {
    size_t value = 0;
    for (int k = 0; k < f->n_branch; k++) {
        for (int e = f->branch[k].begin; e < f->branch[k].end; e++) {
            struct block *b = &f->block[e];
            b->value = value;
            value += silt_dense_size(b->end - b->begin + b->row_end - b->row_begin, b->negative, b->end - b->begin);
        }
        value += DENSE_PAD;
    }
    return value;
}

void silt_front_order(silt_front **front, const silt_front_matrix *q, const double *x) {
    if (!*front)
        *front = silt_alloc(1, sizeof **front);
    silt_front *f = *front;
    const int n = q->n, unknowns = q->pair ? q->unknowns : 1;
    f->unknowns = unknowns;
    f->n = unknowns * n;
    SILT_RESERVE(f->order, f->order_capacity, f->n + 1);
    SILT_RESERVE(f->place, f->place_capacity, f->n + 1);
    SILT_RESERVE(f->first, f->first_capacity, n + 1);
    SILT_RESERVE(f->worker, f->worker_capacity, 1);
    SILT_RESERVE(f->worker->local, f->worker->local_capacity, f->n + 1);
    f->local = f->worker->local;
    f->item = silt_alloc((size_t)n + 1, sizeof *f->item);
    SILT_RESERVE(f->right, f->right_capacity, f->n + 1);
    SILT_RESERVE(f->whole, f->whole_capacity, f->n + DENSE_PAD);
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
    rows_find(f, q);
    if (unknowns > 1)
        unknowns_expand(f, n, unknowns);
    work_count(f);
    branches_find(f);
    f->n_value = panels_place(f) + DENSE_PAD;
    f->value = silt_room(f->value, &f->value_capacity, f->n_value, sizeof(float));
}
