// multigrid as a preconditioner: symmetric, positive definite, exact where it is a factor, as good on a fine lattice as
// on a coarse one
#include "coarse.h"

#include <setjmp.h>

#include <cmocka.h>

/** seven points on a lattice of m^3 nodes in a cube, nought on its top, no flow through the other sides */
typedef struct lattice {
    int n, *start, *index;
    double *value;
} lattice;

static lattice lattice_make(int m, double apart) {
    const int n = m * m * m, step[3] = {1, m, m * m};
    lattice a = {n, silt_alloc((size_t)n + 1, sizeof(int)), silt_alloc((size_t)n * 7, sizeof(int)),
                 silt_alloc((size_t)n * 7, sizeof(double))};
    int filled = 0;
    for (int i = 0; i < n; i++) {
        const int at[3] = {i % m, i / m % m, i / (m * m)};
        double sum = at[2] == m - 1 ? 1 : 0;
        a.start[i] = filled;
        for (int side = 0; side < 7; side++) { // columns rise: back along z, y, x, the node, on along x, y, z
            const int d = side < 3 ? 2 - side : side - 4, way = side < 3 ? -1 : 1;
            if (side == 3) {
                a.index[filled++] = i;
                continue;
            }
            if (at[d] + way < 0 || at[d] + way >= m)
                continue;
            a.index[filled] = i + way * step[d];
            a.value[filled++] = d == 0 ? -apart : -1;
            sum += d == 0 ? apart : 1;
        }
        for (int k = a.start[i]; k < filled; k++)
            if (a.index[k] == i)
                a.value[k] = sum;
    }
    a.start[n] = filled;
    return a;
}

static void lattice_free(lattice *a) {
    free(a->start);
    free(a->index);
    free(a->value);
}

static double dot(int n, const double *a, const double *b) {
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

static void apply(const lattice *a, const double *x, double *out) {
    for (int i = 0; i < a->n; i++) {
        out[i] = 0;
        for (int k = a->start[i]; k < a->start[i + 1]; k++)
            out[i] += a->value[k] * x[a->index[k]];
    }
}

static void cycle(silt_coarse *c, int n, const double *right, double *out) {
    float *to = silt_coarse_right(c);
    for (int i = 0; i < n; i++)
        to[i] = (float)right[i];
    const float *z = silt_coarse_cycle(c);
    assert_non_null(z);
    for (int i = 0; i < n; i++)
        out[i] = z[i];
}

// iterations of conjugate gradients to 1e-6 of the energy's norm, for a random right side
static int solve(silt_coarse *c, const lattice *a) {
    const int n = a->n;
    double *v[5];
    for (int k = 0; k < 5; k++)
        v[k] = silt_alloc((size_t)n, sizeof(double));
    double *x = v[0], *r = v[1], *z = v[2], *d = v[3], *ad = v[4], before = 0, first = 0;
    uint64_t state = 7;
    for (int i = 0; i < n; i++)
        r[i] = silt_uniform(&state) - 0.5;
    int k = 0;
    for (; k < 100; k++) {
        cycle(c, n, r, z);
        const double rz = dot(n, r, z);
        assert_true(rz > 0);
        first = k ? first : rz;
        if (rz < 1e-12 * first)
            break;
        for (int i = 0; i < n; i++)
            d[i] = z[i] + (k ? rz / before * d[i] : 0);
        apply(a, d, ad);
        const double alpha = rz / dot(n, d, ad);
        for (int i = 0; i < n; i++) {
            x[i] += alpha * d[i];
            r[i] -= alpha * ad[i];
        }
        before = rz;
    }
    for (int j = 0; j < 5; j++)
        free(v[j]);
    return k;
}

static void test_symmetric(void **unused) {
    (void)unused;
    lattice a = lattice_make(16, 1);
    silt_coarse *c = NULL;
    assert_true(silt_coarse_build(&c, a.n, a.start, a.index, a.value));
    double *x = silt_alloc((size_t)a.n, sizeof *x), *y = silt_alloc((size_t)a.n, sizeof *y),
           *mx = silt_alloc((size_t)a.n, sizeof *mx), *my = silt_alloc((size_t)a.n, sizeof *my);
    uint64_t state = 1;
    for (int i = 0; i < a.n; i++) {
        x[i] = silt_uniform(&state) - 0.5;
        y[i] = silt_uniform(&state) - 0.5;
    }
    cycle(c, a.n, x, mx);
    cycle(c, a.n, y, my);
    const double size = sqrt(dot(a.n, x, mx) * dot(a.n, y, my));
    assert_true(fabs(dot(a.n, x, my) - dot(a.n, y, mx)) < 1e-6 * size);
    // the same matrix again: the same bits
    assert_true(silt_coarse_build(&c, a.n, a.start, a.index, a.value));
    cycle(c, a.n, x, my);
    assert_memory_equal(mx, my, (size_t)a.n * sizeof *mx);
    free(x);
    free(y);
    free(mx);
    free(my);
    silt_coarse_free(&c);
    lattice_free(&a);
}

static void test_iterations(void **unused) {
    (void)unused;
    const int size[] = {6, 16, 48};
    for (int k = 0; k < 3; k++)
        for (int stretched = 0; stretched < 2; stretched++) {
            lattice a = lattice_make(size[k], stretched ? 100 : 1);
            silt_coarse *c = NULL;
            assert_true(silt_coarse_build(&c, a.n, a.start, a.index, a.value));
            const int iterations = solve(c, &a);
            print_message("%d nodes, links along x %d times the others: %d iterations\n", a.n, stretched ? 100 : 1,
                          iterations);
            assert_in_range(iterations, 1, k == 0 ? 2 : 20);
            silt_coarse_free(&c);
            lattice_free(&a);
        }
}

static void test_refused(void **unused) {
    (void)unused;
    lattice a = lattice_make(6, 1);
    silt_coarse *c = NULL;
    for (int k = a.start[0]; k < a.start[1]; k++)
        if (a.index[k] == 0)
            a.value[k] = -1;
    assert_false(silt_coarse_build(&c, a.n, a.start, a.index, a.value));
    silt_coarse_free(&c);
    lattice_free(&a);
}

// Rows of three blocks that are coupled with 0.6 to each other: the matrix is positive definite (1 - 0.6), what Gauss-Seidel takes of it
// when the blocks do not see each other, 1 - 1.2, is not, and r . z came out as -0.2 r . r
static void across_blocks(void **state) {
    (void)state;
    const int third = 8000, n = 4 * third;
    int *start = silt_alloc((size_t)n + 1, sizeof *start), *index = silt_alloc(5 * (size_t)n, sizeof *index), at = 0;
    double *value = silt_alloc(5 * (size_t)n, sizeof *value), *r = silt_alloc((size_t)n, sizeof *r), *z = silt_alloc((size_t)n, sizeof *z);
    for (int i = 0; i < n; i++) {
        start[i] = at;
        r[i] = i < 3 * third ? 1 - 2 * (i % third % 2) : 0; // rough: the coarser level does not see it
        for (int j = i % third; j < n; j += third) // what is below the row at hand, itself with its two neighbours, what is above
            if (j == i) {
                for (int k = i - 1; k <= i + 1; k++)
                    if (k >= 0 && k < n && k / third == i / third) {
                        index[at] = k;
                        value[at++] = k == i ? 1.02 : -0.01;
                    }
            } else if (i < 3 * third && j < 3 * third) {
                index[at] = j;
                value[at++] = 0.6;
            }
    }
    start[n] = at;
    silt_coarse *c = NULL;
    assert_true(silt_coarse_build(&c, n, start, index, value));
    cycle(c, n, r, z);
    double product = 0;
    for (int i = 0; i < n; i++)
        product += r[i] * z[i];
    assert_true(product > 0.05 * 3 * third);
    silt_coarse_free(&c);
    free(start);
    free(index);
    free(value);
    free(r);
    free(z);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(across_blocks), cmocka_unit_test(test_symmetric),
        cmocka_unit_test(test_iterations),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
