// small dense triangles
#include "dense.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define DENSE_CLONES __attribute__((target_clones("avx512f", "arch=haswell", "default")))
#else
#define DENSE_CLONES
#endif
#pragma GCC diagnostic ignored "-Wpsabi" // vectors are passed within this file only
#define DENSE_INLINE static inline __attribute__((always_inline))
#define LANES DENSE_PAD // numbers in a vector
#define C DENSE_CHUNK   // columns that are worked on together
#define DEEP 64         // columns that are applied to what follows at one go: panels of large fronts leave the cache otherwise

typedef float vector __attribute__((vector_size(LANES * sizeof(float)), aligned(sizeof(float))));
typedef int bits __attribute__((vector_size(LANES * sizeof(int)), aligned(sizeof(int))));

// the first n lanes
DENSE_INLINE bits lanes_first(int n) {
    static const int ones[2 * LANES] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
    return *(const bits *)(ones + LANES - n);
}

DENSE_INLINE vector lanes_keep(vector v, bits which) { return (vector)((bits)v & which); }

// columns of a chunk are `ld` apart; those of the next one, which have `skip` rows less, ld - skip: C, or 0 where all columns have all rows
typedef struct layout {
    ptrdiff_t ld;
    int skip;
} layout;

DENSE_INLINE layout layout_of(int wide, int negative, int at) { return negative ? (layout){wide, 0} : (layout){wide - at, C}; }

// out (rows x C, columns `apart` apart) += sign a b^T, sign 1 or -1, over k columns of a and b; two vectors of rows
DENSE_INLINE void product_two(const int sign, int k, layout of, const float *a, const float *b, float *out, ptrdiff_t apart) {
    vector sum[C][2] = {{{0}}};
    for (int left = k; left > 0; left -= C, a -= of.skip, b -= of.skip, of.ld -= of.skip)
        for (int c = 0, n = left < C ? left : C; c < n; c++, a += of.ld, b += of.ld) {
            const vector a0 = *(const vector *)a, a1 = *(const vector *)(a + LANES);
#pragma GCC unroll 8
            for (int j = 0; j < C; j++) {
                sum[j][0] += a0 * b[j];
                sum[j][1] += a1 * b[j];
            }
        }
#pragma GCC unroll 8
    for (int j = 0; j < C; j++) {
        vector *to = (vector *)(out + j * apart), *next = (vector *)(out + j * apart + LANES);
        *to = sign < 0 ? *to - sum[j][0] : *to + sum[j][0];
        *next = sign < 0 ? *next - sum[j][1] : *next + sum[j][1];
    }
}

// the same for one vector of rows, of which the first `rows` count, and `columns` columns; what does not count is written as it was
DENSE_INLINE void product_one(const int sign, int k, layout of, const float *a, const float *b, float *out, ptrdiff_t apart, int rows,
                              int columns) {
    const bits which = lanes_first(rows);
    vector sum[C] = {{0}};
    for (int left = k; left > 0; left -= C, a -= of.skip, b -= of.skip, of.ld -= of.skip)
        for (int c = 0, n = left < C ? left : C; c < n; c++, a += of.ld, b += of.ld) {
            const vector a0 = *(const vector *)a;
#pragma GCC unroll 8
            for (int j = 0; j < C; j++)
                sum[j] += a0 * b[j];
        }
#pragma GCC unroll 8
    for (int j = 0; j < C; j++)
        if (j < columns)
            *(vector *)(out + j * apart) -= lanes_keep(sign < 0 ? sum[j] : -sum[j], which);
}

DENSE_INLINE void product(const int sign, int k, layout of, const float *a, const float *b, float *out, ptrdiff_t apart, int rows,
                          int columns) {
    int r = 0;
    for (; r + 2 * LANES <= rows && columns == C; r += 2 * LANES)
        product_two(sign, k, of, a + r, b, out + r, apart);
    for (; r < rows; r += LANES)
        product_one(sign, k, of, a + r, b, out + r, apart, rows - r < LANES ? rows - r : LANES, columns);
}

// rows times the inverse of a finished triangle of `columns` columns
DENSE_INLINE void triangle_rows(const int columns, ptrdiff_t ld, const float *triangle, float *x, int rows) {
    for (int r = 0; r < rows; r += LANES) {
        const bits which = lanes_first(rows - r < LANES ? rows - r : LANES);
        vector v[C];
#pragma GCC unroll 8
        for (int j = 0; j < columns; j++) {
            vector *to = (vector *)(x + r + j * ld);
            v[j] = *to;
#pragma GCC unroll 8
            for (int c = 0; c < j; c++)
                v[j] -= v[c] * triangle[j + c * ld];
            v[j] *= triangle[j + j * ld];
            *to = (vector)(((bits)v[j] & which) | ((bits)*to & ~which));
        }
    }
}

// L of a small triangle, 1/diagonal in the diagonal's place. @return -1, or the column whose pivot is no good
DENSE_INLINE int triangle_factor(int columns, ptrdiff_t ld, const float *whole, float *t) {
    for (int j = 0; j < columns; j++)
        for (int r = j; r < columns; r++) {
            float value = t[r + ld * j];
            for (int c = 0; c < j; c++)
                value -= t[r + ld * c] * t[j + ld * c];
            if (r > j) {
                t[r + ld * j] = value * t[j + ld * j];
                continue;
            }
            if (!(value > -DENSE_WRONG * whole[j]))
                return j;
            t[r + ld * j] = 1 / sqrtf(value > DENSE_LEAST * whole[j] ? value : whole[j]);
        }
    return -1;
}

// columns from `first` to `last` of a panel of `own`, what is before them done
DENSE_INLINE int columns_factor(int first, int last, int own, int negative, int wide, const float *whole, float *panel) {
    for (int begin = first; begin < last; begin += DEEP) {
        const int end = begin + DEEP < last ? begin + DEEP : last;
        const layout of = layout_of(wide, negative, begin);
        const float *done = panel + silt_dense_column(wide, negative, begin);
        for (int at = begin; at < end; at += C) {
            const int columns = end - at < C ? end - at : C;
            const ptrdiff_t ld = layout_of(wide, negative, at).ld;
            float *t = panel + at + silt_dense_column(wide, negative, at);
            product(-1, at - begin, of, done + at, done + at, t, ld, wide - at, columns);
            const int bad = triangle_factor(columns, ld, whole + at, t);
            if (bad >= 0)
                return at + bad;
            if (columns == C)
                triangle_rows(C, ld, t, t + C, wide - at - C);
            else
                triangle_rows(columns, ld, t, t + columns, wide - at - columns);
        }
        for (int at = end; at < own; at += C)
            product(-1, end - begin, of, done + at, done + at, panel + at + silt_dense_column(wide, negative, at),
                    layout_of(wide, negative, at).ld, wide - at, own - at < C ? own - at : C);
    }
    return -1;
}

DENSE_CLONES int silt_dense_factor(int own, int negative, int wide, const float *whole, float *panel) {
    const int positive = own - negative, bad = columns_factor(0, positive, own, negative, wide, whole, panel);
    if (bad >= 0 || !negative)
        return bad;
    for (int j = positive; j < own; j++)
        for (int r = j; r < wide; r++)
            panel[r + silt_dense_column(wide, negative, j)] *= -1;
    return columns_factor(positive, own, own, negative, wide, whole, panel);
}

// update += sign L21 L21^T of the columns from `first` to `last`
DENSE_INLINE void columns_update(const int sign, int first, int last, int own, int negative, int wide, const float *panel, float *update) {
    const int rest = wide - own;
    for (int begin = first; begin < last; begin += 2 * DEEP) {
        const int deep = last - begin < 2 * DEEP ? last - begin : 2 * DEEP;
        const float *below = panel + own + silt_dense_column(wide, negative, begin);
        for (int at = 0; at < rest; at += C)
            product(sign, deep, layout_of(wide, negative, begin), below + at, below + at, update + at + silt_dense_column(rest, 0, at),
                    rest - at, rest - at, rest - at < C ? rest - at : C);
    }
}

DENSE_CLONES void silt_dense_update(int own, int negative, int wide, const float *panel, float *update) {
    columns_update(-1, 0, own - negative, own, negative, wide, panel, update);
    if (negative)
        columns_update(1, own - negative, own, own, negative, wide, panel, update);
}

DENSE_CLONES void silt_dense_forward(int own, int negative, int wide, const float *panel, float *t) {
    for (int at = 0; at < own; at += C) {
        const int columns = own - at < C ? own - at : C;
        const layout of = layout_of(wide, negative, at);
        const ptrdiff_t ld = of.ld;
        const float *l = panel + at + silt_dense_column(wide, negative, at);
        float *x = t + at, v[C] = {0};
        for (int j = 0; j < columns; j++) {
            float value = x[j];
            for (int c = 0; c < j; c++)
                value -= l[j + ld * c] * v[c];
            x[j] = v[j] = value * l[j + ld * j];
        }
        for (int r = columns; r < wide - at; r += LANES) {
            vector sum = *(vector *)(x + r);
            if (columns == C) {
#pragma GCC unroll 8
                for (int c = 0; c < C; c++) {
                    __builtin_prefetch(l + r + ld * C - of.skip + (ld - of.skip) * c); // the columns that come next: a tenth of a solve
                    sum -= v[c] * *(const vector *)(l + r + ld * c);
                }
            } else
                for (int c = 0; c < columns; c++)
                    sum -= v[c] * *(const vector *)(l + r + ld * c);
            *(vector *)(x + r) = sum; // what is past the end is of no use
        }
    }
}

// lane j of the sum: all lanes of v[j]. One after the other they took a third of a solve at 10k nodes.
typedef float half __attribute__((vector_size(C * sizeof(float)), aligned(sizeof(float))));
DENSE_INLINE void lanes_sum(vector v[C], float out[C]) {
    const bits even = {0, 16, 2, 18, 4, 20, 6, 22, 8, 24, 10, 26, 12, 28, 14, 30}, odd = {1, 17, 3, 19, 5, 21, 7, 23, 9, 25, 11, 27, 13, 29, 15, 31};
    const bits two = {0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29}, next = {2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31};
    const bits low = {0, 1, 2, 3, 16, 17, 18, 19, 8, 9, 10, 11, 24, 25, 26, 27}, high = {4, 5, 6, 7, 20, 21, 22, 23, 12, 13, 14, 15, 28, 29, 30, 31};
    vector pair[4], four[2];
#pragma GCC unroll 4
    for (int j = 0; j < 4; j++)
        pair[j] = __builtin_shuffle(v[2 * j], v[2 * j + 1], even) + __builtin_shuffle(v[2 * j], v[2 * j + 1], odd);
#pragma GCC unroll 2
    for (int j = 0; j < 2; j++)
        four[j] = __builtin_shuffle(pair[2 * j], pair[2 * j + 1], two) + __builtin_shuffle(pair[2 * j], pair[2 * j + 1], next);
    const vector all = __builtin_shuffle(four[0], four[1], low) + __builtin_shuffle(four[0], four[1], high);
    half part[2];
    memcpy(part, &all, sizeof all);
    part[0] += part[1];
    memcpy(out, part, sizeof *part);
}

DENSE_CLONES void silt_dense_backward(int own, int negative, int wide, const float *panel, float *t) {
    for (int at = (own - 1) / C * C; at >= 0; at -= C) {
        const int columns = own - at < C ? own - at : C;
        const layout of = layout_of(wide, negative, at);
        const ptrdiff_t ld = of.ld;
        const float *l = panel + at + silt_dense_column(wide, negative, at);
        float *x = t + at, sum[C];
        vector many[C] = {{0}};
        for (int r = columns; r < wide - at; r += LANES) {
            const int rows = wide - at - r < LANES ? wide - at - r : LANES;
            const bits which = lanes_first(rows);
            const vector y = lanes_keep(*(const vector *)(x + r), which);
            if (columns == C && rows == LANES) {
#pragma GCC unroll 8
                for (int c = 0; c < C; c++) {
                    __builtin_prefetch(l + r + of.skip - (ld + of.skip) * (C - c));
                    many[c] += y * *(const vector *)(l + r + ld * c);
                }
            } else
                for (int c = 0; c < columns; c++)
                    many[c] += y * lanes_keep(*(const vector *)(l + r + ld * c), which);
        }
        lanes_sum(many, sum);
        for (int j = columns - 1; j >= 0; j--) {
            float value = x[j] - sum[j];
            for (int c = j + 1; c < columns; c++)
                value -= l[c + ld * j] * x[c];
            x[j] = value * l[j + ld * j];
        }
    }
}

// run by run over all columns: a column's next run, loaded while what went over the end of this one is not yet stored, waits
DENSE_CLONES void silt_dense_scatter(int n, const int *at, const int *end, const float *update, float **column) {
    for (int first = 0, last; first < n; first = last) {
        last = end[first] - first < 4 * LANES ? end[first] : first + 4 * LANES;
        const float *from = update;
        ptrdiff_t ld = n;
        for (int c = 0; c < last; c++) {
            float *to = column[at[c]] + at[first] - first;
            for (int r = c > first ? c : first; r < last; r += LANES)
                *(vector *)(to + r) += lanes_keep(*(const vector *)(from + r), lanes_first(last - r < LANES ? last - r : LANES));
            from += ld;
            if (c % C == C - 1) { // silt_dense_column
                from -= C;
                ld -= C;
            }
        }
    }
}
