// the direct solver of the pressure in two dimensions: against the sum that it is told to solve
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "dense.h"
#include "front.h"

#define MOST_BESIDE 128

/** a graph of nodes with places and the numbers of a matrix */
typedef struct graph {
    int n, *start, *list;
    double *x, *row, *weight, *diagonal;
    silt_front_matrix matrix;
    uint64_t state;
} graph;

static void graph_open(graph *g, int n) {
    *g = (graph){.n = n, .state = 7};
    g->start = silt_alloc((size_t)n + 1, sizeof *g->start);
    g->list = silt_alloc((size_t)n * MOST_BESIDE, sizeof *g->list);
    g->x = silt_alloc(2 * (size_t)n, sizeof *g->x);
    g->row = silt_alloc(3 * (size_t)n * MOST_BESIDE, sizeof *g->row);
    g->weight = silt_alloc((size_t)n, sizeof *g->weight);
    g->diagonal = silt_alloc((size_t)n, sizeof *g->diagonal);
}

// neighbours by a rule, rows at random; couplings are small beside the diagonal
static void graph_join(graph *g, bool (*joined)(const graph *, int, int)) {
    int filled = 0;
    for (int i = 0; i < g->n; i++) {
        g->start[i] = filled;
        for (int j = 0; j < g->n; j++)
            if (i == j || joined(g, i, j)) {
                double *entry = g->row + 3 * filled;
                entry[0] = silt_uniform(&g->state) - 0.5;
                entry[1] = silt_uniform(&g->state) - 0.5;
                entry[2] = j > i ? 0.1 * silt_uniform(&g->state) : 0;
                g->list[filled++] = j;
            }
        g->weight[i] = i % 50 ? 0.5 + silt_uniform(&g->state) : -0.01; // a weight may be negative where the others make up for it
        g->diagonal[i] = 1 + 0.1 * (filled - g->start[i]);
    }
    g->start[g->n] = filled;
    g->matrix = (silt_front_matrix){.n = g->n, .neighbour_start = g->start, .neighbour = g->list, .row = g->row, .weight = g->weight, .diagonal = g->diagonal};
}

static void graph_close(graph *g) {
    free(g->start);
    free(g->list);
    free(g->x);
    free(g->row);
    free(g->weight);
    free(g->diagonal);
}

static void apply(const graph *g, const double *x, double *out) {
    for (int i = 0; i < g->n; i++)
        out[i] = g->diagonal[i] * x[i];
    for (int i = 0; i < g->n; i++) {
        double sum[2] = {0, 0};
        for (int k = g->start[i]; k < g->start[i + 1]; k++) {
            const double *entry = g->row + 3 * k;
            for (int d = 0; d < 2; d++)
                sum[d] += entry[d] * x[g->list[k]];
            out[i] += entry[2] * x[g->list[k]];
            out[g->list[k]] += entry[2] * x[i];
        }
        for (int k = g->start[i]; k < g->start[i + 1]; k++)
            out[g->list[k]] += g->weight[i] * (g->row[3 * k] * sum[0] + g->row[3 * k + 1] * sum[1]);
    }
}

// solves for a known answer, twice with the same front
static void graph_check(graph *g) {
    const size_t n = (size_t)g->n;
    double *right = silt_alloc(n, sizeof *right), *answer = silt_alloc(n, sizeof *answer), *got = silt_alloc(n, sizeof *got),
           *again = silt_alloc(n, sizeof *again);
    silt_front *front = NULL;
    for (size_t i = 0; i < n; i++)
        answer[i] = silt_uniform(&g->state) - 0.5;
    apply(g, answer, right);
    silt_front_order(&front, &g->matrix, g->x);
    assert_int_equal(silt_front_factor(front, &g->matrix), -1);
    silt_front_solve(front, right, got);
    for (size_t i = 0; i < n; i++)
        assert_true(fabs(got[i] - answer[i]) < 1e-11);
    memcpy(again, right, n * sizeof *right);
    silt_front_order(&front, &g->matrix, g->x);
    assert_int_equal(silt_front_factor(front, &g->matrix), -1);
    silt_front_solve(front, again, again);
    assert_memory_equal(again, got, n * sizeof *got);
    // a matrix that is not definite is told by the node
    g->diagonal[g->n / 2] = -100.0 * g->n;
    assert_in_range(silt_front_factor(front, &g->matrix), 0, g->n - 1);
    silt_front_free(&front);
    assert_null(front);
    free(right);
    free(answer);
    free(got);
    free(again);
    graph_close(g);
}

static bool near(const graph *g, int i, int j) {
    return silt_square(g->x[2 * i] - g->x[2 * j]) + silt_square(g->x[2 * i + 1] - g->x[2 * j + 1]) < silt_square(0.06);
}

static void scatter(graph *g) {
    for (int k = 0; k < 2 * g->n; k++)
        g->x[k] = silt_uniform(&g->state);
}

static void cloud(void **state) {
    (void)state;
    for (int n = 1; n < 1300; n += n < 80 ? 13 : 400) {
        graph g;
        graph_open(&g, n);
        scatter(&g);
        graph_join(&g, near);
        graph_check(&g);
    }
}

// joined across the border, so that nothing is near in place
static bool around(const graph *g, int i, int j) {
    const double dx = fabs(g->x[2 * i] - g->x[2 * j]), dy = g->x[2 * i + 1] - g->x[2 * j + 1];
    return silt_square(silt_min(dx, 1 - dx)) + silt_square(dy) < silt_square(0.06);
}

static void periodic(void **state) {
    (void)state;
    graph g;
    graph_open(&g, 900);
    scatter(&g);
    graph_join(&g, around);
    graph_check(&g);
}

// one node beside more than a leaf holds
static bool hub(const graph *g, int i, int j) {
    return near(g, i, j) || (i % 400 == 7 && j % 7 == 0 && j < 400) || (j % 400 == 7 && i % 7 == 0 && i < 400);
}

static void hubs(void **state) {
    (void)state;
    graph g;
    graph_open(&g, 800);
    scatter(&g);
    graph_join(&g, hub);
    graph_check(&g);
}

static bool never(const graph *g, int i, int j) {
    (void)g;
    (void)i;
    (void)j;
    return false;
}

static bool beside(const graph *g, int i, int j) {
    (void)g;
    return abs(i - j) < 3;
}

// nodes without neighbours; on a line; all in one place
static void odd(void **state) {
    (void)state;
    graph g;
    graph_open(&g, 500);
    scatter(&g);
    graph_join(&g, never);
    graph_check(&g);
    graph_open(&g, 500);
    for (int i = 0; i < g.n; i++)
        g.x[2 * i] = i;
    graph_join(&g, beside);
    graph_check(&g);
    graph_open(&g, 100);
    graph_join(&g, beside);
    graph_check(&g);
}

// every size of panel around the width that vectors have: L L^T is what came in
static void dense(void **state) {
    (void)state;
    uint64_t seed = 3;
    for (int own = 1; own < 27; own++)
        for (int wide = own; wide < own + 40; wide += 3) {
            const int rest = wide - own;
            double full[70][70], l[70][70] = {{0}}, panel[70 * 70 + DENSE_PAD] = {0}, update[70 * 70] = {0};
            for (int i = 0; i < wide; i++)
                for (int j = 0; j <= i; j++)
                    full[i][j] = full[j][i] = i == j ? wide : silt_uniform(&seed) - 0.5;
            for (int j = 0; j < own; j++)
                for (int i = j; i < wide; i++)
                    panel[i + j * wide] = full[i][j];
            for (int j = 0; j < rest; j++)
                for (int i = j; i < rest; i++)
                    update[i + j * rest] = full[own + i][own + j];
            assert_int_equal(silt_dense_factor(own, wide, panel), -1);
            silt_dense_update(own, wide, panel, update);
            for (int j = 0; j < own; j++)
                for (int i = j; i < wide; i++)
                    l[i][j] = i == j ? 1 / panel[i + j * wide] : panel[i + j * wide];
            for (int i = 0; i < wide; i++)
                for (int j = 0; j <= i; j++) {
                    double sum = i >= own && j >= own ? update[(i - own) + (j - own) * rest] : 0;
                    for (int c = 0; c < own; c++)
                        sum += l[i][c] * l[j][c];
                    assert_true(fabs(sum - full[i][j]) < 1e-12 * wide);
                }
            // forward and backward with the update left out: the rest of t is what it was less L21 y
            double t[70], y[70];
            for (int i = 0; i < wide; i++)
                t[i] = y[i] = silt_uniform(&seed);
            silt_dense_forward(own, wide, panel, t);
            for (int i = 0; i < wide; i++) {
                double sum = i < own ? 0 : t[i];
                for (int c = 0; c < own && c <= i; c++)
                    sum += l[i][c] * t[c];
                assert_true(fabs(sum - y[i]) < 1e-12);
            }
            memcpy(y, t, sizeof y);
            silt_dense_backward(own, wide, panel, t);
            for (int j = 0; j < own; j++) {
                double sum = 0;
                for (int i = j; i < wide; i++)
                    sum += l[i][j] * t[i];
                assert_true(fabs(sum - y[j]) < 1e-12);
            }
            panel[0] = -1;
            assert_int_equal(silt_dense_factor(own, wide, panel), 0);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(cloud), cmocka_unit_test(periodic), cmocka_unit_test(hubs),
                                       cmocka_unit_test(odd), cmocka_unit_test(dense)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
