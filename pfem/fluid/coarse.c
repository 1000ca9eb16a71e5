// smoothed aggregation multigrid
#include "coarse.h"
#include "factor.h"
#include "parallel.h"

#define COARSE_LEVELS 12
#define COARSE_DIRECT 400  // rows that a factor takes
#define COARSE_STRONG 0.25 // of the largest entry beside the diagonal: neighbours that are aggregated with each other
#define COARSE_OMEGA  (4.0 / 3)
#define COARSE_BLOCKS 4    // that a level is swept in at the same time, at most
#define COARSE_BLOCK  6000 // rows in each, at least

/** a matrix, and how it follows from the next coarser one */
typedef struct silt_level {
    int n, n_coarse;
    const int *start, *index;   // rows; borrowed on the finest level
    int *own_start, *own_index; // owned
    int *diagonal;              // owned, where it stands in the row
    double *exact;              // owned, entries of a coarser level while the hierarchy is made
    float *value, *inverse;     // owned, entries; 1/diagonal, with what is added to it for the other blocks, which stands negative on it
    int *to_start, *to;         // owned, rows of the prolongation
    float *weight;              // owned
    int *from_start, *from;     // owned, its columns: rows that each aggregate has a share in, rising
    float *share;               // owned, these shares
    float *x, *right;           // owned
    float *kept;                // owned, what a sweep leaves on its way down; x before the one on its way up
    int n_block;                // blocks of rows that are swept as if the others stood still
    int start_capacity, index_capacity, diagonal_capacity, exact_capacity, value_capacity, inverse_capacity,
        to_start_capacity, to_capacity, weight_capacity, from_start_capacity, from_capacity, share_capacity, x_capacity, right_capacity,
        kept_capacity;
} silt_level;

/** rows of a sparse matrix while they are made, some of them by each thread */
typedef struct silt_piece {
    int *index;    // owned
    double *value; // owned
    int filled;
    int *mark;     // owned, per column: where it stands in the row at hand, or less than that row's first
    double *row;   // owned, per column
    int index_capacity, value_capacity, mark_capacity, row_capacity;
    char apart[128]; // from the next one, which another thread counts in
} silt_piece;

struct silt_coarse {
    int n_level;
    silt_level level[COARSE_LEVELS];
    silt_factor factor; // owned, of the coarsest level
    double *work;       // owned, for its solution
    int *group, *mark;  // owned, aggregates of the level at hand
    double *strongest;
    silt_piece piece[PARALLEL_MOST];
    int *product_start, *product_index; // owned, rows of matrix times prolongation
    double *product;                    // owned
    int work_capacity, group_capacity, mark_capacity, strongest_capacity, product_start_capacity, product_index_capacity, product_capacity;
};

// what only the making of the levels needs: 7 % of all memory in space
static void rows_forget(silt_coarse *c) {
    free(c->product_start);
    free(c->product_index);
    free(c->product);
    c->product_start = c->product_index = NULL;
    c->product = NULL;
    c->product_start_capacity = c->product_index_capacity = c->product_capacity = 0;
    for (int part = 0; part < PARALLEL_MOST; part++) {
        free(c->piece[part].index);
        free(c->piece[part].value);
        free(c->piece[part].mark);
        free(c->piece[part].row);
        c->piece[part] = (silt_piece){0};
    }
}

void silt_coarse_free(silt_coarse **coarse) {
    if (!*coarse)
        return;
    silt_coarse *c = *coarse;
    for (int l = 0; l < COARSE_LEVELS; l++) {
        silt_level *a = &c->level[l];
        free(a->own_start);
        free(a->own_index);
        free(a->diagonal);
        free(a->exact);
        free(a->value);
        free(a->inverse);
        free(a->to_start);
        free(a->to);
        free(a->weight);
        free(a->from_start);
        free(a->from);
        free(a->share);
        free(a->kept);
        free(a->x);
        free(a->right);
    }
    silt_factor_clear(&c->factor);
    free(c->work);
    free(c->group);
    free(c->mark);
    free(c->strongest);
    rows_forget(c);
    free(c);
    *coarse = NULL;
}

// The sweeps of Gauss-Seidel go through blocks of rows at the same time, each with the others' old values. The blocks hang on the number
// of rows alone. With the nodes in slabs (mesh/order.c) four take as many iterations as one: 40 at 46k nodes.
static int blocks(int n) {
    int count = 1;
    while (2 * count <= COARSE_BLOCKS && 2 * count * COARSE_BLOCK <= n)
        count *= 2;
    return count;
}
static int block_first(const silt_level *a, int block) { return (int)((int64_t)a->n * block / a->n_block); }
static int block_of(const silt_level *a, int i) {
    int block = (int)((int64_t)i * a->n_block / a->n);
    while (i >= block_first(a, block + 1))
        block++;
    return block;
}

// What is added to a row's diagonal, half of what it has in other blocks: the sweeps stay positive definite whatever that is (M + M^T - A
// is; Baker, Falgout, Kolev and Yang, SIAM J. Sci. Comput. 33, 2011). Slivers across blocks made conjugate gradients fail without.
static double across_blocks(const silt_level *a, const double *value, int i) {
    const int block = block_of(a, i), first = block_first(a, block), last = block_first(a, block + 1);
    double sum = 0;
    for (int k = a->start[i]; k < a->start[i + 1]; k++)
        if (a->index[k] < first || a->index[k] >= last)
            sum += 0.5 * fabs(value[k]);
    return sum;
}

// single precision copies for the cycle. @return false where the diagonal is not positive
static bool level_copy(silt_level *a, const double *value) {
    const int filled = a->start[a->n];
    SILT_RESERVE(a->value, a->value_capacity, filled + 1);
    SILT_RESERVE(a->inverse, a->inverse_capacity, a->n + 1);
    SILT_RESERVE(a->diagonal, a->diagonal_capacity, a->n + 1);
    SILT_RESERVE(a->x, a->x_capacity, a->n + 1);
    SILT_RESERVE(a->right, a->right_capacity, a->n + 1);
    SILT_RESERVE(a->kept, a->kept_capacity, a->n + 1);
    a->n_block = blocks(a->n);
    bool bad = false;
    SILT_PRAGMA(omp parallel for schedule(static) num_threads(silt_threads(a->n)) reduction(|:bad))
    for (int i = 0; i < a->n; i++) {
        int own = a->start[i];
        for (int k = a->start[i]; k < a->start[i + 1]; k++) {
            a->value[k] = (float)value[k];
            own = a->index[k] == i ? k : own;
        }
        a->diagonal[i] = own;
        bad |= !(value[own] > 0) || !isfinite(value[own]);
        const double across = across_blocks(a, value, i);
        a->inverse[i] = (float)(1 / (value[own] + across));
        a->value[own] = (float)-across;
    }
    return !bad;
}

static bool strong(const silt_coarse *c, const double *value, int i, int j, int k) {
    return i != j && -value[k] > 0 && -value[k] >= COARSE_STRONG * silt_min(c->strongest[i], c->strongest[j]);
}

// greedy: a node whose strong neighbours are all free takes them, then the rest joins its strongest neighbour that was
// taken. Nodes without strong neighbours have no aggregate: the sweeps solve them. @return how many
static int aggregate(silt_coarse *c, const silt_level *a, const double *value) {
    int count = 0;
    SILT_PARALLEL(a->n)
    for (int i = 0; i < a->n; i++) {
        c->strongest[i] = 0;
        c->group[i] = -1;
        for (int k = a->start[i]; k < a->start[i + 1]; k++)
            if (a->index[k] != i)
                c->strongest[i] = silt_max(c->strongest[i], -value[k]);
    }
    for (int i = 0; i < a->n; i++) {
        bool free_ = c->group[i] < 0, any = false;
        for (int k = a->start[i]; k < a->start[i + 1] && free_; k++)
            if (strong(c, value, i, a->index[k], k)) {
                any = true;
                free_ = c->group[a->index[k]] < 0;
            }
        if (!free_ || !any)
            continue;
        for (int k = a->start[i]; k < a->start[i + 1]; k++)
            if (strong(c, value, i, a->index[k], k))
                c->group[a->index[k]] = count;
        c->group[i] = count++;
    }
    memcpy(c->mark, c->group, (size_t)a->n * sizeof *c->mark);
    SILT_PARALLEL(a->n)
    for (int i = 0; i < a->n; i++) {
        double most = 0;
        for (int k = a->start[i]; k < a->start[i + 1] && c->mark[i] < 0; k++)
            if (c->mark[a->index[k]] >= 0 && strong(c, value, i, a->index[k], k) && -value[k] > most) {
                most = -value[k];
                c->group[i] = c->mark[a->index[k]];
            }
    }
    return count;
}

// ---- sparse matrices row by row, some rows by each thread: the pieces are joined in their order

static void piece_begin(silt_piece *p, int n_column) {
    SILT_RESERVE(p->mark, p->mark_capacity, n_column + 1);
    for (int g = 0; g < n_column; g++)
        p->mark[g] = -1;
    p->filled = 0;
}

static void piece_room(silt_piece *p, int more) {
    SILT_RESERVE(p->index, p->index_capacity, p->filled + more);
    SILT_RESERVE(p->value, p->value_capacity, p->filled + more);
}

// adds to a column of the row that begins at `row`
static inline void piece_add(silt_piece *p, int row, int column, double value) {
    if (p->mark[column] < row) {
        p->mark[column] = p->filled;
        p->index[p->filled] = column;
        p->value[p->filled++] = 0;
    }
    p->value[p->mark[column]] += value;
}

static int part_first(int n, int part) { return (int)((int64_t)n * part / silt_threads(n)); }

// where rows begin, counted from the first of all; they were counted from the first of their piece. @return how many entries
static int pieces_count(const silt_piece *piece, int n, int *start) {
    int filled = 0;
    for (int part = 0; part < silt_threads(n); part++) {
        for (int i = part_first(n, part), end = part_first(n, part + 1); i < end; i++)
            start[i] += filled;
        filled += piece[part].filled;
    }
    start[n] = filled;
    return filled;
}

// Rows of the prolongation: the aggregates' indicator, smoothed by a step of Jacobi on the matrix whose weak entries
// are lumped onto the diagonal
static void prolongation_rows(silt_coarse *c, silt_level *a, const double *value, int part) {
    silt_piece *p = &c->piece[part];
    piece_begin(p, a->n_coarse);
    for (int i = part_first(a->n, part), end = part_first(a->n, part + 1); i < end; i++) {
        const int first = a->start[i], last = a->start[i + 1], row = p->filled;
        piece_room(p, last - first + 1);
        a->to_start[i] = row;
        double own = 0, others = 0;
        for (int k = first; k < last; k++)
            *(strong(c, value, i, a->index[k], k) ? &others : &own) += value[k];
        const double step = own > 0 ? COARSE_OMEGA / (1 - others / own) : 0;
        for (int k = first; k < last && c->group[i] >= 0; k++) {
            const int j = a->index[k], g = c->group[j];
            const double w = j == i ? 1 - step : step > 0 && strong(c, value, i, j, k) ? -step * value[k] / own : 0;
            if (g >= 0 && w != 0)
                piece_add(p, row, g, w);
        }
    }
}

static void prolongation(silt_coarse *c, silt_level *a, const double *value) {
    SILT_RESERVE(a->to_start, a->to_start_capacity, a->n + 1);
    SILT_PARALLEL(a->n)
    for (int part = 0; part < silt_threads(a->n); part++)
        prolongation_rows(c, a, value, part);
    const int filled = pieces_count(c->piece, a->n, a->to_start);
    SILT_RESERVE(a->to, a->to_capacity, filled + 1);
    SILT_RESERVE(a->weight, a->weight_capacity, filled + 1);
    SILT_PARALLEL(a->n)
    for (int part = 0; part < silt_threads(a->n); part++) {
        const int first = a->to_start[part_first(a->n, part)];
        for (int m = 0; m < c->piece[part].filled; m++) {
            a->to[first + m] = c->piece[part].index[m];
            a->weight[first + m] = (float)c->piece[part].value[m];
        }
    }
}

// rows of matrix times prolongation
static void multiply_rows(silt_coarse *c, const silt_level *a, const double *value, int part) {
    silt_piece *p = &c->piece[part];
    piece_begin(p, a->n_coarse);
    for (int i = part_first(a->n, part), end = part_first(a->n, part + 1); i < end; i++) {
        const int row = p->filled;
        c->product_start[i] = row;
        for (int k = a->start[i]; k < a->start[i + 1]; k++) {
            const int j = a->index[k];
            piece_room(p, a->to_start[j + 1] - a->to_start[j]);
            for (int m = a->to_start[j]; m < a->to_start[j + 1]; m++)
                piece_add(p, row, a->to[m], value[k] * a->weight[m]);
        }
    }
}

static void multiply(silt_coarse *c, const silt_level *a, const double *value) {
    SILT_RESERVE(c->product_start, c->product_start_capacity, a->n + 1);
    SILT_PARALLEL(a->n)
    for (int part = 0; part < silt_threads(a->n); part++)
        multiply_rows(c, a, value, part);
    const int filled = pieces_count(c->piece, a->n, c->product_start);
    SILT_RESERVE(c->product_index, c->product_index_capacity, filled + 1);
    SILT_RESERVE(c->product, c->product_capacity, filled + 1);
    SILT_PARALLEL(a->n)
    for (int part = 0; part < silt_threads(a->n); part++) {
        const silt_piece *p = &c->piece[part];
        const int first = c->product_start[part_first(a->n, part)];
        memcpy(c->product_index + first, p->index, (size_t)p->filled * sizeof *p->index);
        memcpy(c->product + first, p->value, (size_t)p->filled * sizeof *p->value);
    }
}

// the prolongation by columns
static void transpose(silt_level *a) {
    const int filled = a->to_start[a->n];
    SILT_RESERVE(a->from_start, a->from_start_capacity, a->n_coarse + 2);
    SILT_RESERVE(a->from, a->from_capacity, filled + 1);
    SILT_RESERVE(a->share, a->share_capacity, filled + 1);
    int *start = a->from_start;
    memset(start, 0, ((size_t)a->n_coarse + 2) * sizeof *start);
    for (int m = 0; m < filled; m++)
        start[a->to[m] + 2]++;
    for (int g = 0; g < a->n_coarse; g++)
        start[g + 2] += start[g + 1];
    for (int i = 0; i < a->n; i++)
        for (int m = a->to_start[i]; m < a->to_start[i + 1]; m++) {
            const int at = start[a->to[m] + 1]++;
            a->from[at] = i;
            a->share[at] = a->weight[m];
        }
}

// Coarse matrix = prolongation^T matrix prolongation, columns rising. Few rows, each from many of the finer level, so that the
// finer level tells how many threads they are worth.
static void galerkin_rows(silt_coarse *c, const silt_level *a, silt_level *b, int part, int n_part) {
    silt_piece *p = &c->piece[part];
    piece_begin(p, b->n);
    SILT_RESERVE(p->row, p->row_capacity, b->n + 1);
    for (int g = (int)((int64_t)b->n * part / n_part), end = (int)((int64_t)b->n * (part + 1) / n_part); g < end; g++) {
        const int first = p->filled;
        b->own_start[g] = first;
        for (int t = a->from_start[g]; t < a->from_start[g + 1]; t++) {
            const int i = a->from[t];
            piece_room(p, c->product_start[i + 1] - c->product_start[i]);
            for (int k = c->product_start[i]; k < c->product_start[i + 1]; k++) {
                const int h = c->product_index[k];
                if (p->mark[h] != g) {
                    p->mark[h] = g;
                    p->row[h] = 0;
                    int at = p->filled++; // insertion: rows are short
                    for (; at > first && p->index[at - 1] > h; at--)
                        p->index[at] = p->index[at - 1];
                    p->index[at] = h;
                }
                p->row[h] += a->share[t] * c->product[k];
            }
        }
        for (int k = first; k < p->filled; k++)
            p->value[k] = p->row[p->index[k]];
    }
}

static void galerkin(silt_coarse *c, silt_level *a, const double *value, silt_level *b) {
    multiply(c, a, value);
    transpose(a);
    b->n = a->n_coarse;
    SILT_RESERVE(b->own_start, b->start_capacity, b->n + 1);
    const int n_part = silt_threads(a->n);
    SILT_PARALLEL(a->n)
    for (int part = 0; part < n_part; part++)
        galerkin_rows(c, a, b, part, n_part);
    int filled = 0;
    for (int part = 0; part < n_part; part++) {
        const silt_piece *p = &c->piece[part];
        SILT_RESERVE(b->own_index, b->index_capacity, filled + p->filled + 1);
        SILT_RESERVE(b->exact, b->exact_capacity, filled + p->filled + 1);
        memcpy(b->own_index + filled, p->index, (size_t)p->filled * sizeof *p->index);
        memcpy(b->exact + filled, p->value, (size_t)p->filled * sizeof *p->value);
        for (int g = (int)((int64_t)b->n * part / n_part); g < (int)((int64_t)b->n * (part + 1) / n_part); g++)
            b->own_start[g] += filled;
        filled += p->filled;
    }
    b->own_start[b->n] = filled;
    b->start = b->own_start;
    b->index = b->own_index;
}

static bool factor_coarsest(silt_coarse *c, const silt_level *a, const double *value) {
    int filled = 0, at = 0;
    for (int i = 0; i < a->n; i++)
        filled += a->start[i + 1] - a->diagonal[i];
    int *start = silt_factor_pattern(&c->factor, a->n, filled);
    for (int i = 0; i < a->n; i++) {
        start[i] = at;
        for (int k = a->diagonal[i]; k < a->start[i + 1]; k++) {
            c->factor.index[at] = a->index[k];
            c->factor.value[at++] = value[k];
        }
    }
    start[a->n] = at;
    silt_factor_analyse(&c->factor);
    SILT_RESERVE(c->work, c->work_capacity, a->n + 1);
    return silt_factor_compute(&c->factor);
}

static bool levels_build(silt_coarse *c, int n, const int *start, const int *index, const double *value) {
    SILT_RESERVE(c->group, c->group_capacity, n + 1);
    SILT_RESERVE(c->mark, c->mark_capacity, n + 1);
    SILT_RESERVE(c->strongest, c->strongest_capacity, n + 1);
    c->level[0].n = n;
    c->level[0].start = start;
    c->level[0].index = index;
    for (int l = 0;; l++) {
        silt_level *a = &c->level[l];
        const double *entry = l ? a->exact : value;
        c->n_level = l + 1;
        if (!level_copy(a, entry))
            return false;
        a->n_coarse = a->n > COARSE_DIRECT && c->n_level < COARSE_LEVELS ? aggregate(c, a, entry) : 0;
        if (a->n_coarse == 0 || a->n_coarse > 0.7 * a->n)
            return factor_coarsest(c, a, entry);
        prolongation(c, a, entry);
        galerkin(c, a, entry, a + 1);
    }
}

bool silt_coarse_build(silt_coarse **coarse, int n, const int *start, const int *index, const double *value) {
    if (!*coarse)
        *coarse = silt_alloc(1, sizeof **coarse);
    const bool done = levels_build(*coarse, n, start, index, value);
    rows_forget(*coarse);
    return done;
}

// forward Gauss-Seidel from nought on the rows of a block
static void sweep_down(const silt_level *a, int block) {
    const int first = block_first(a, block), last = block_first(a, block + 1);
    for (int i = first; i < last; i++) {
        float sum = a->right[i];
        int k = a->start[i];
        while (a->index[k] < first)
            k++;
        for (; k < a->diagonal[i]; k++)
            sum -= a->value[k] * a->x[a->index[k]];
        a->x[i] = sum * a->inverse[i];
    }
}

// what it leaves, carried to the coarser level
static void go_down(const silt_level *a, float *coarse) {
    SILT_PARALLEL(a->n)
    for (int block = 0; block < a->n_block; block++)
        sweep_down(a, block);
    SILT_PARALLEL(a->n)
    for (int block = 0; block < a->n_block; block++) {
        const int first = block_first(a, block), last = block_first(a, block + 1);
        for (int i = first; i < last; i++) {
            float left = 0;
            for (int k = a->start[i]; a->index[k] < first; k++)
                left -= a->value[k] * a->x[a->index[k]];
            for (int k = a->diagonal[i]; k < a->start[i + 1]; k++)
                left -= a->value[k] * a->x[a->index[k]];
            a->kept[i] = left;
        }
    }
    SILT_PARALLEL(a->n)
    for (int g = 0; g < a->n_coarse; g++) {
        float sum = 0;
        for (int t = a->from_start[g]; t < a->from_start[g + 1]; t++)
            sum += a->share[t] * a->kept[a->from[t]];
        coarse[g] = sum;
    }
}

// backward Gauss-Seidel on the rows of a block
static void sweep_up(const silt_level *a, int block) {
    const int first = block_first(a, block), last = block_first(a, block + 1);
    for (int i = last - 1; i >= first; i--) {
        float sum = a->right[i];
        int k = a->start[i], end = a->start[i + 1];
        for (; a->index[k] < first; k++)
            sum -= a->value[k] * a->kept[a->index[k]];
        for (; a->index[end - 1] >= last; end--)
            sum -= a->value[end - 1] * a->kept[a->index[end - 1]];
        for (; k < end; k++)
            sum -= a->value[k] * a->x[a->index[k]];
        a->x[i] = sum * a->inverse[i];
    }
}

// the coarser level's correction, then the sweep
static void go_up(const silt_level *a, const float *coarse) {
    SILT_PARALLEL(a->n)
    for (int i = 0; i < a->n; i++) {
        float sum = a->x[i];
        for (int m = a->to_start[i]; m < a->to_start[i + 1]; m++)
            sum += a->weight[m] * coarse[a->to[m]];
        a->x[i] = a->kept[i] = sum;
    }
    SILT_PARALLEL(a->n)
    for (int block = 0; block < a->n_block; block++)
        sweep_up(a, block);
}

float *silt_coarse_right(silt_coarse *c) {
    return c->level[0].right;
}

const float *silt_coarse_cycle(silt_coarse *c) {
    silt_level *top = c->level, *last = &c->level[c->n_level - 1];
    for (silt_level *a = top; a < last; a++)
        go_down(a, a[1].right);
    for (int i = 0; i < last->n; i++)
        c->work[i] = last->right[i];
    if (!silt_factor_solve(&c->factor, c->work, c->work))
        return NULL;
    for (int i = 0; i < last->n; i++)
        last->x[i] = (float)c->work[i];
    for (silt_level *a = last - 1; a >= top; a--)
        go_up(a, a[1].x);
    return top->x;
}
