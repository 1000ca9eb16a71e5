// velocities and accelerations by name: solitary wave, fields between points, body forces, three dimensions
#include "delaunay.h"
#include "scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static void near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%.17g is not %.17g +- %g", value, expected, tolerance);
}

/** how well a velocity field belongs to a wave of speed c that keeps its form */
typedef struct wave_errors {
    double source, spin;     // largest div and rot, times d/c
    double through;          // largest flow through the surface of the moving wave, relative to c H/d
    double head, head_first; // spread of Bernoulli's head along it, relative to H; with u = eta sqrt(g/d), v to match
    double flux;             // largest of int u dy - c eta, relative to c H
} wave_errors;

static wave_errors wave_measure(silt_wave_profile profile, double height, double direction) {
    const double d = 0.8, g = 9.81, H = height * d,
                 c = sqrt(g * (profile ? d + H - H * H / d / 20 - 3 * H * H * H / d / d / 70 : d + H));
    const silt_formula f = {.kind = FORMULA_SOLITARY_WAVE,
                            .amplitude = H,
                            .depth = d,
                            .centre = {2, -0.3},
                            .rate = direction,
                            .profile = profile};
    wave_errors e = {0};
    double head[2] = {HUGE_VAL, -HUGE_VAL}, first[2] = {HUGE_VAL, -HUGE_VAL}, v[3], q[4][3];
    for (int i = -120; i <= 120; i++) {
        const double x = 2 + 0.05 * i, s = 1e-5;
        const double eta = silt_formula_surface(&f, &x), top = -0.3 + d + eta;
        const double left = x - s, right = x + s;
        const double slope = (silt_formula_surface(&f, &right) - silt_formula_surface(&f, &left)) / (2 * s);
        // nothing through the bed
        silt_formula_velocity(&f, g, (double[]){x, -0.3}, v);
        assert_true(v[1] == 0 && v[2] == 0);
        for (int k = 0; k <= 10; k++) {
            const double y = -0.3 + (d + eta) * k / 10;
            silt_formula_velocity(&f, g, (double[]){x + s, y}, q[0]);
            silt_formula_velocity(&f, g, (double[]){x - s, y}, q[1]);
            silt_formula_velocity(&f, g, (double[]){x, y + s}, q[2]);
            silt_formula_velocity(&f, g, (double[]){x, y - s}, q[3]);
            e.source = silt_max(e.source, fabs(q[0][0] - q[1][0] + q[2][1] - q[3][1]) / (2 * s) * d / c);
            e.spin = silt_max(e.spin, fabs(q[0][1] - q[1][1] - q[2][0] + q[3][0]) / (2 * s) * d / c);
        }
        // Gauss-Legendre over the depth
        static const double at[3] = {-0.774596669241483377, 0, 0.774596669241483377},
                            share[3] = {5.0 / 9, 8.0 / 9, 5.0 / 9};
        double flux = 0;
        for (int k = 0; k < 3; k++) {
            silt_formula_velocity(&f, g, (double[]){x, -0.3 + (d + eta) * (1 + at[k]) / 2}, v);
            flux += share[k] * v[0] * (d + eta) / 2;
        }
        const double to = direction < 0 ? -c : c;
        e.flux = silt_max(e.flux, fabs(flux - to * eta) / (c * H));
        silt_formula_velocity(&f, g, (double[]){x, top}, v);
        e.through = silt_max(e.through, fabs(v[1] - (v[0] - to) * slope) / (c * H / d));
        const double h = ((v[0] - to) * (v[0] - to) + v[1] * v[1]) / (2 * g) + eta;
        const double u1 = eta * sqrt(g / d), v1 = -sqrt(g / d) * slope * (d + eta);
        const double h1 = ((u1 - c) * (u1 - c) + v1 * v1) / (2 * g) + eta;
        head[0] = silt_min(head[0], h);
        head[1] = silt_max(head[1], h);
        first[0] = silt_min(first[0], h1);
        first[1] = silt_max(first[1], h1);
    }
    e.head = (head[1] - head[0]) / H;
    e.head_first = (first[1] - first[0]) / H;
    return e;
}

// a free potential flow at any height, the surface moves on unchanged as far as the series reaches, and its pressure is
// even: better than what u = eta sqrt(g/d) gives
static void test_solitary(void **state) {
    (void)state;
    static const double height[] = {0.0185, 0.05, 0.1, 0.2, 0.3};
    // through the surface, head
    static const double most[2][5][2] = {{{1e-9, 1.2e-4}, {1e-8, 1e-3}, {1e-6, 4e-3}, {5e-4, 0.014}, {0.01, 0.03}},
                                         {{1e-9, 1e-7}, {1e-7, 5e-6}, {1e-5, 6e-5}, {5e-4, 1e-3}, {5e-3, 8e-3}}};
    for (int p = 0; p < 2; p++)
        for (int i = 0; i < 5; i++) {
            const wave_errors e = wave_measure(p, height[i], i % 2 ? -1 : 1);
            if (!(e.source < 1e-9 && e.spin < 1e-9 && e.through < most[p][i][0] && e.flux < most[p][i][0] &&
                  e.head < most[p][i][1] && e.head < e.head_first))
                fail_msg(
                    "H/d %.4f: div %.1e, rot %.1e, through the surface %.1e, flux %.1e, head %.2e (first order %.2e)",
                    height[i], e.source, e.spin, e.through, e.flux, e.head, e.head_first);
        }
    // prepared or not; crest; the other way round; in space
    silt_formula f = {.kind = FORMULA_SOLITARY_WAVE, .amplitude = 0.2, .depth = 1, .profile = WAVE_GRIMSHAW}, g = f;
    double v[3], w[3];
    assert_true(silt_formula_prepare(&g) == -1 && g.wave[0] != 0);
    silt_formula_velocity(&f, 9.81, (double[]){1, 0.5}, v);
    silt_formula_velocity(&g, 9.81, (double[]){1, 0.5}, w);
    assert_memory_equal(v, w, sizeof v);
    assert_true(v[0] > 0 && v[1] > 0); // it is about to rise here
    near(silt_formula_surface(&g, (double[]){0}), 0.2, 1e-15);
    g.rate = -1;
    g.dimension = 3;
    g.vector[1] = 4;
    silt_formula_velocity(&g, 9.81, (double[]){1, 7, 0.5}, w);
    assert_true(w[0] == -v[0] && w[1] == 4 && w[2] == -v[1]);
    // far from the crest nothing overflows
    silt_formula_velocity(&f, 9.81, (double[]){1e4, 0.5}, v);
    assert_true(v[0] == 0 && v[1] == 0);
}

// a table of n random points with the values of a function, columns x, y[, z], vx, vy[, vz]
static silt_formula cloud(int dim, int n, uint64_t seed, void (*function)(int dim, const double *x, double *v)) {
    silt_formula f = {.kind = FORMULA_FIELD, .dimension = dim, .series = {.n_row = n, .n_column = 2 * dim}};
    f.series.value = silt_alloc((size_t)(2 * dim * n), sizeof(double));
    f.series.name = silt_alloc((size_t)(2 * dim), sizeof(char *));
    for (int i = 0; i < n; i++) {
        double *row = f.series.value + 2 * dim * i;
        for (int k = 0; k < dim; k++)
            row[k] = silt_uniform(&seed);
        function(dim, row, row + dim);
    }
    return f;
}

static void plane(int dim, const double *x, double *v) {
    for (int k = 0; k < dim; k++)
        v[k] = k + 2 * x[0] - 3 * x[1] + (dim == 3 ? (k + 1) * x[2] : 0);
}

static void bowl(int dim, const double *x, double *v) {
    for (int k = 0; k < dim; k++)
        v[k] = (k + 1) * x[0] * x[0] + x[1] * x[1];
}

// a plane comes back exactly everywhere, the values of a point at the point
static void test_field(void **state) {
    (void)state;
    for (int dim = 2; dim <= 3; dim++) {
        silt_formula f = cloud(dim, 5000, 7, plane), g = f;
        assert_int_equal(silt_formula_prepare(&f), -1);
        assert_non_null(f.field);
        uint64_t seed = 3;
        for (int i = 0; i < 2000; i++) {
            // a tenth around the cloud too
            double x[3], v[3], w[3];
            for (int k = 0; k < dim; k++)
                x[k] = i % 10 ? silt_uniform(&seed) : 1.02 * silt_uniform(&seed) - 0.01;
            silt_formula_velocity(&f, 0, x, v);
            plane(dim, x, w);
            for (int k = 0; k < dim; k++)
                near(v[k], w[k], 1e-9);
            if (i < 200) {
                // searched from end to end
                silt_formula_velocity(&g, 0, x, w);
                assert_memory_equal(v, w, sizeof v);
            }
            const double *row = f.series.value + 2 * dim * i;
            silt_formula_velocity(&f, 0, row, v);
            assert_memory_equal(v, row + dim, (size_t)dim * sizeof *v);
            silt_formula_acceleration(&f, 0, row, v);
            assert_memory_equal(v, row + dim, (size_t)dim * sizeof *v);
        }
        // far away: the nearest point's values, nothing extrapolated
        double v[3], far[3] = {100, 100, 100};
        silt_formula_velocity(&f, 0, far, v);
        assert_true(fabs(v[0]) < 10);
        // a point twice
        memcpy(f.series.value + 2 * dim * 4321, f.series.value + 2 * dim * 17, (size_t)dim * sizeof *v);
        silt_series rows = f.series;
        f.series = (silt_series){0};
        silt_formula_clear(&f);
        f = (silt_formula){.kind = FORMULA_FIELD, .dimension = dim, .series = rows};
        assert_true(silt_formula_prepare(&f) == 4321 && !f.field);
        f.series.name = NULL;
        f.series.n_column = 0;
        free(rows.name);
        silt_formula_clear(&f);
    }
}

// between points it is linear on the triangles of the whole cloud's Delaunay triangulation
static void test_field_delaunay(void **state) {
    (void)state;
    const int n = 3000;
    silt_formula f = cloud(2, n, 11, bowl);
    assert_int_equal(silt_formula_prepare(&f), -1);
    double *x = silt_alloc((size_t)(2 * n), sizeof *x);
    for (int i = 0; i < n; i++)
        memcpy(x + 2 * i, f.series.value + 4 * i, 2 * sizeof *x);
    int *triangle, n_triangle, different = 0, inside = 0;
    assert_int_equal(silt_delaunay_2d(n, x, &triangle, &n_triangle), 0);
    for (int e = 0; e < n_triangle; e++) {
        const int *t = triangle + 3 * e;
        double centre[2], v[3], mean = 0;
        for (int k = 0; k < 2; k++)
            centre[k] = (x[2 * t[0] + k] + x[2 * t[1] + k] + x[2 * t[2] + k]) / 3;
        for (int k = 0; k < 3; k++)
            mean += f.series.value[4 * t[k] + 2] / 3;
        // long triangles on the hull reach beyond the nearest points
        if (fabs(centre[0] - 0.5) > 0.45 || fabs(centre[1] - 0.5) > 0.45)
            continue;
        silt_formula_velocity(&f, 0, centre, v);
        inside++;
        different += fabs(v[0] - mean) > 1e-12;
    }
    print_message("%d of %d triangles differ\n", different, inside);
    assert_true(inside > 4000 && different == 0);
    free(triangle);
    free(x);
    free(f.series.name);
    f.series.name = NULL;
    f.series.n_column = 0;
    silt_formula_clear(&f);
}

// many look-ups in a hundred thousand points
static void test_field_time(void **state) {
    (void)state;
    for (int dim = 2; dim <= 3; dim++) {
        silt_formula f = cloud(dim, 100000, 5, bowl);
        const double start = silt_seconds();
        assert_int_equal(silt_formula_prepare(&f), -1);
        const double ready = silt_seconds();
        uint64_t seed = 9;
        double worst = 0;
        for (int i = 0; i < 20000; i++) {
            double x[3], v[3], w[3];
            for (int k = 0; k < dim; k++)
                x[k] = 0.05 + 0.9 * silt_uniform(&seed);
            silt_formula_velocity(&f, 0, x, v);
            bowl(dim, x, w);
            worst = silt_max(worst, fabs(v[0] - w[0]));
        }
        print_message("%d-D: prepared in %.2f s, 2e4 look-ups in %.2f s, largest error %.1e\n", dim, ready - start,
                      silt_seconds() - ready, worst);
        assert_true(worst < (dim == 2 ? 1e-3 : 0.02));
        free(f.series.name);
        f.series.name = NULL;
        f.series.n_column = 0;
        silt_formula_clear(&f);
    }
}

static void test_force(void **state) {
    (void)state;
    double a[3];
    silt_formula f = {.kind = FORMULA_UNIFORM, .vector = {1, 2}};
    silt_formula_acceleration(&f, 3, (double[]){4, 5}, a);
    assert_true(a[0] == 1 && a[1] == 2 && a[2] == 0);
    f = (silt_formula){.kind = FORMULA_CENTRAL, .rate = 2, .centre = {1, 1}, .vector = {0, -1}};
    silt_formula_acceleration(&f, 0, (double[]){2, 3}, a);
    assert_true(a[0] == -4 && a[1] == -9 && a[2] == 0);
    f.rate = -2;
    silt_formula_acceleration(&f, 0, (double[]){2, 3}, a);
    assert_true(a[0] == 4 && a[1] == 7);
    f = (silt_formula){.kind = FORMULA_CENTRAL, .dimension = 3, .rate = 1, .centre = {0, 0, 1}};
    silt_formula_acceleration(&f, 0, (double[]){2, 3, 4}, a);
    assert_true(a[0] == -2 && a[1] == -3 && a[2] == -3);
    f.axis = 1;
    silt_formula_acceleration(&f, 0, (double[]){2, 3, 4}, a);
    assert_true(a[0] == 0 && a[1] == -3 && a[2] == -3);
    f = (silt_formula){.kind = FORMULA_SOLID_ROTATION, .rate = 2};
    silt_formula_acceleration(&f, 0, (double[]){2, 3}, a);
    assert_true(a[0] == -6 && a[1] == 4);
    double rows[] = {0, 0, 0, 1, 2, 4};
    f = (silt_formula){.kind = FORMULA_SERIES, .vector = {1}, .series = {.n_row = 2, .n_column = 3, .value = rows}};
    silt_formula_acceleration(&f, 0.5, (double[]){2, 3}, a);
    assert_true(a[0] == 2 && a[1] == 2 && a[2] == 0);
    f.kind = FORMULA_NONE;
    silt_formula_acceleration(&f, 0.5, (double[]){2, 3}, a);
    assert_true(a[0] == 0 && a[1] == 0 && a[2] == 0);
}

// the plane of the 2-D formulas is x-z; a rotation is right-handed about its axis
static void test_space(void **state) {
    (void)state;
    static const silt_formula_kind kind[] = {FORMULA_UNIFORM, FORMULA_SHEAR, FORMULA_STRAIN, FORMULA_TAYLOR_GREEN,
                                             FORMULA_STANDING_WAVE};
    double v[3], w[3];
    for (int i = 0; i < 5; i++) {
        silt_formula f = {.kind = kind[i], .rate = 2, .amplitude = 0.1, .length = 3, .depth = 1, .centre = {0.2, 0.3}},
                     g = f;
        g.dimension = 3;
        g.centre[1] = 55;
        g.centre[2] = 0.3;
        f.vector[0] = g.vector[0] = 7;
        silt_formula_velocity(&f, 9.81, (double[]){0.6, 0.7}, v);
        silt_formula_velocity(&g, 9.81, (double[]){0.6, -5, 0.7}, w);
        assert_true(v[0] == w[0] && w[1] == 0 && v[1] == w[2]);
    }
    silt_formula f = {.kind = FORMULA_SOLID_ROTATION, .dimension = 3, .rate = 2};
    static const double expected[4][3] = {{-4, 2, 0}, {0, -6, 4}, {6, 0, -2}, {-4, 2, 0}};
    for (f.axis = 0; f.axis < 4; f.axis++) {
        silt_formula_velocity(&f, 0, (double[]){1, 2, 3}, v);
        assert_memory_equal(v, expected[f.axis], sizeof v);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_solitary),       cmocka_unit_test(test_field),
                                       cmocka_unit_test(test_field_delaunay), cmocka_unit_test(test_field_time),
                                       cmocka_unit_test(test_force),          cmocka_unit_test(test_space)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
