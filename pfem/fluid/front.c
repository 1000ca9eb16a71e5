// fronts: factor and solve
#include <omp.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

#include "front_inside.h"

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

// pairs whose first unknown the block eliminates
static void assemble_pairs(const silt_front *f, struct worker *w, const silt_front_matrix *q, const struct block *b) {
    const int m = f->unknowns;
    for (int p = b->begin; p < b->end; p++) {
        const int i = f->order[p] / m, c = f->order[p] % m;
        float *column = w->column[p - b->begin];
        for (int k = q->neighbour_start[i]; k < q->neighbour_start[i + 1]; k++) {
            const float *entry = q->pair + (size_t)(m * m) * (size_t)k + m * c;
            const int *place = f->place + m * q->neighbour[k];
            for (int r = 0; r < m; r++)
                if (place[r] >= p)
                    column[w->local[place[r]]] += entry[r];
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
        w->column[c] = panel + silt_dense_column(wide, b->negative, c);
        w->local[b->begin + c] = c;
        memset(w->column[c] + c, 0, (size_t)(wide - c) * sizeof *panel);
    }
    for (int c = 0; c < rest; c++) {
        w->column[own + c] = update + silt_dense_column(rest, 0, c) - own;
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

// Room for a moment, lent where one thread alone works: another one would not know that it is.
static float *moment_take(const silt_front *f, size_t n) {
    return f->n_worker == 1 ? silt_borrow(n + DENSE_PAD, sizeof(float)) : silt_alloc(n + DENSE_PAD, sizeof(float));
}

static void moment_give(const silt_front *f, float **data) {
    if (f->n_worker == 1)
        silt_return(*data);
    else
        free(*data);
    *data = NULL;
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
        moment_give(f, &other->update);
        child = f->block[child].first - 1;
    }
    return bad;
}

// the blocks of a branch, once all below are done
static void branch_factor(silt_front *f, struct worker *w, const silt_front_matrix *q, struct branch *t) {
    int n_waiting = 0;
    float *top[2] = {w->stack[0], w->stack[1]};
    const struct block *last = &f->block[t->end - 1];
    t->bad = -1;
    t->update = moment_take(f, silt_front_update(last));
    for (int e = t->begin; e < t->end && t->bad < 0; e++) {
        const struct block *b = &f->block[e];
        const int own = b->end - b->begin, wide = own + b->row_end - b->row_begin;
        float *panel = f->value + b->value, *update = b == last ? t->update : top[b->side];
        columns_clear(f, w, b, panel, update);
        if (q->pair)
            assemble_pairs(f, w, q, b);
        else
            assemble(f, w, q, b);
        if (t->top)
            t->bad = children_add(f, w, t);
        for (int c = 0; c < b->n_child && !t->top; c++) {
            const struct block *child = &f->block[w->waiting[--n_waiting]];
            top[!b->side] -= silt_front_update(child);
            extend_add(f, w, child, top[!b->side]);
        }
        const int bad = t->bad < 0 ? silt_dense_factor(own, b->negative, wide, f->whole + b->begin, panel) : -1;
        if (bad >= 0)
            t->bad = f->order[b->begin + bad] / f->unknowns;
        if (t->bad >= 0)
            return;
        silt_dense_update(own, b->negative, wide, panel, update);
        top[b->side] += silt_front_update(b);
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

// What lies far apart couples by numbers that single precision holds as denormal, and a processor works at these many times as long: they
// are taken for nought (five factors of momenta and saddle points at N = 0.4, 40k nodes: 59 -> 15 us a node).
static void branch_work(const pass *p, void (*work)(const struct pass *, struct worker *, struct branch *), struct branch *t) {
#ifdef __SSE__
    const unsigned mode = _mm_getcsr();
    _mm_setcsr(mode | _MM_FLUSH_ZERO_ON | 0x40); // 0x40: also where they come in
#endif
    work(p, &p->f->worker[omp_get_thread_num()], t);
#ifdef __SSE__
    _mm_setcsr(mode);
#endif
}

static void branch_pass(const pass *p, struct branch *t) {
    if (p->before)
        branch_work(p, p->before, t);
    int child = t->end - 2;
    for (int c = 0; t->top && c < p->f->block[t->begin].n_child; c++) {
        struct branch *other = branch_of(p->f, child);
#pragma omp task firstprivate(p, other)
        branch_pass(p, other);
        child = p->f->block[child].first - 1;
    }
#pragma omp taskwait
    if (p->after)
        branch_work(p, p->after, t);
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
            w->stack[side] = moment_take(f, f->stacked[side]);
    }
}

int silt_front_factor(silt_front *f, const silt_front_matrix *q) {
    for (int k = 0; k < f->n; k++)
        f->whole[k] = q->whole[f->order[k]];
    workers_make(f, q->threads);
    pass_run(&(pass){.f = f, .q = q, .after = factor_after});
    for (int k = 0; k < f->n_worker; k++)
        for (int side = 0; side < 2; side++)
            moment_give(f, &f->worker[k].stack[side]);
    int bad = -1;
    for (int k = f->n_branch - 1; k >= 0; k--) {
        bad = f->branch[k].bad >= 0 ? f->branch[k].bad : bad;
        moment_give(f, &f->branch[k].update);
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
        silt_dense_forward(own, b->negative, own + rest, f->value + b->value, part);
        memcpy(y + b->begin, part, (size_t)own * sizeof *part);
        for (int r = b->end - b->negative; r < b->end; r++)
            y[r] = -y[r]; // between L and L^T stand the signs of the pivots
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
        silt_dense_backward(own, b->negative, own + rest, f->value + b->value, w->part_right);
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

void *silt_front_rest(silt_front *f, size_t *bytes) {
    *bytes = f ? f->n_value * sizeof *f->value : 0;
    return f ? f->value : NULL;
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
