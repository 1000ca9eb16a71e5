// small dense triangles
#include "dense.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define DENSE_CLONES __attribute__((target_clones("avx512f", "arch=haswell", "default")))
#else
#define DENSE_CLONES
#endif
#define DENSE_INLINE static inline __attribute__((always_inline))
#define W 8 // columns that are worked on together, and numbers in a vector

typedef double vector __attribute__((vector_size(W * sizeof(double)), aligned(sizeof(double))));

// out (rows x columns, apart `apart`) -= a b^T over k columns of a and b, `ld` apart; two vectors of rows
DENSE_INLINE void product_two(int k, size_t ld, const double *a, const double *b, double *out, size_t apart) {
    vector sum[W][2] = {{{0}}};
    for (int c = 0; c < k; c++, a += ld, b += ld) {
        const vector a0 = *(const vector *)a, a1 = *(const vector *)(a + W);
#pragma GCC unroll 8
        for (int j = 0; j < W; j++) {
            sum[j][0] += a0 * b[j];
            sum[j][1] += a1 * b[j];
        }
    }
#pragma GCC unroll 8
    for (int j = 0; j < W; j++) {
        *(vector *)(out + (size_t)j * apart) -= sum[j][0];
        *(vector *)(out + (size_t)j * apart + W) -= sum[j][1];
    }
}

// the same for one vector of rows, of which the first `rows` count, and `columns` columns
DENSE_INLINE void product_one(int k, size_t ld, const double *a, const double *b, double *out, size_t apart, int rows, int columns) {
    vector sum[W] = {{0}};
    for (int c = 0; c < k; c++, a += ld, b += ld) {
        const vector a0 = *(const vector *)a;
#pragma GCC unroll 8
        for (int j = 0; j < W; j++)
            sum[j] += a0 * b[j];
    }
    if (rows >= W && columns >= W) {
#pragma GCC unroll 8
        for (int j = 0; j < W; j++)
            *(vector *)(out + (size_t)j * apart) -= sum[j];
        return;
    }
    double part[W][W];
    memcpy(part, sum, sizeof part);
    for (int j = 0; j < columns; j++)
        for (int r = 0; r < rows; r++)
            out[r + (size_t)j * apart] -= part[j][r];
}

DENSE_INLINE void product(int k, size_t ld, const double *a, const double *b, double *out, size_t apart, int rows, int columns) {
    int r = 0;
    for (; r + 2 * W <= rows && columns >= W; r += 2 * W)
        product_two(k, ld, a + r, b, out + r, apart);
    for (; r < rows; r += W)
        product_one(k, ld, a + r, b, out + r, apart, rows - r < W ? rows - r : W, columns < W ? columns : W);
}

// rows times the inverse of a finished triangle of `columns` columns
DENSE_INLINE void triangle_rows(int columns, size_t ld, const double *triangle, double *x, int rows) {
    int r = 0;
    for (; r + W <= rows && columns == W; r += W) {
        vector v[W];
#pragma GCC unroll 8
        for (int j = 0; j < W; j++) {
            v[j] = *(vector *)(x + r + (size_t)j * ld);
#pragma GCC unroll 8
            for (int c = 0; c < j; c++)
                v[j] -= v[c] * triangle[j + (size_t)c * ld];
            v[j] *= triangle[j + (size_t)j * ld];
            *(vector *)(x + r + (size_t)j * ld) = v[j];
        }
    }
    for (; r < rows; r++)
        for (int j = 0; j < columns; j++) {
            double value = x[r + (size_t)j * ld];
            for (int c = 0; c < j; c++)
                value -= x[r + (size_t)c * ld] * triangle[j + (size_t)c * ld];
            x[r + (size_t)j * ld] = value * triangle[j + (size_t)j * ld];
        }
}

DENSE_CLONES int silt_dense_factor(int own, int wide, double *panel) {
    const size_t ld = (size_t)wide;
    for (int at = 0; at < own; at += W) {
        const int columns = own - at < W ? own - at : W;
        double *t = panel + at + ld * (size_t)at;
        product(at, ld, panel + at, panel + at, t, ld, wide - at, columns);
        for (int j = 0; j < columns; j++)
            for (int r = j; r < columns; r++) {
                double value = t[r + ld * (size_t)j];
                for (int c = 0; c < j; c++)
                    value -= t[r + ld * (size_t)c] * t[j + ld * (size_t)c];
                if (r == j) {
                    if (!(value > 0))
                        return at + j;
                    t[r + ld * (size_t)j] = 1 / sqrt(value);
                } else
                    t[r + ld * (size_t)j] = value * t[j + ld * (size_t)j];
            }
        triangle_rows(columns, ld, t, t + columns, wide - at - columns);
    }
    return -1;
}

DENSE_CLONES void silt_dense_update(int own, int wide, const double *panel, double *update) {
    const int rest = wide - own;
    const double *below = panel + own;
    for (int at = 0; at < rest; at += W)
        product(own, (size_t)wide, below + at, below + at, update + at + (size_t)at * (size_t)rest, (size_t)rest, rest - at, rest - at);
}

DENSE_CLONES void silt_dense_forward(int own, int wide, const double *panel, double *t) {
    const size_t ld = (size_t)wide;
    for (int at = 0; at < own; at += W) {
        const int columns = own - at < W ? own - at : W;
        const double *l = panel + at + ld * (size_t)at;
        double *x = t + at, v[W] = {0};
        for (int j = 0; j < columns; j++) {
            double value = x[j];
            for (int c = 0; c < j; c++)
                value -= l[j + ld * (size_t)c] * v[c];
            x[j] = v[j] = value * l[j + ld * (size_t)j];
        }
        int r = columns;
        for (; r + W <= wide - at && columns == W; r += W) {
            vector sum = *(vector *)(x + r);
#pragma GCC unroll 8
            for (int c = 0; c < W; c++) {
                __builtin_prefetch(l + r + ld * (size_t)(c + W)); // the columns that come next: a tenth of a solve
                sum -= v[c] * *(const vector *)(l + r + ld * (size_t)c);
            }
            *(vector *)(x + r) = sum;
        }
        for (; r < wide - at; r++)
            for (int c = 0; c < columns; c++)
                x[r] -= v[c] * l[r + ld * (size_t)c];
    }
}

DENSE_CLONES void silt_dense_backward(int own, int wide, const double *panel, double *t) {
    const size_t ld = (size_t)wide;
    for (int at = (own - 1) / W * W; at >= 0; at -= W) {
        const int columns = own - at < W ? own - at : W;
        const double *l = panel + at + ld * (size_t)at;
        double *x = t + at, sum[W] = {0};
        vector many[W] = {{0}};
        int r = columns;
        for (; r + W <= wide - at && columns == W; r += W) {
            const vector y = *(const vector *)(x + r);
#pragma GCC unroll 8
            for (int c = 0; c < W; c++) {
                __builtin_prefetch(l + r - ld * (size_t)(W - c));
                many[c] += y * *(const vector *)(l + r + ld * (size_t)c);
            }
        }
        for (int c = 0; c < columns; c++) {
            for (int k = 0; k < W; k++)
                sum[c] += many[c][k];
            for (int k = r; k < wide - at; k++)
                sum[c] += x[k] * l[k + ld * (size_t)c];
        }
        for (int j = columns - 1; j >= 0; j--) {
            double value = x[j] - sum[j];
            for (int c = j + 1; c < columns; c++)
                value -= l[c + ld * (size_t)j] * x[c];
            x[j] = value * l[j + ld * (size_t)j];
        }
    }
}
