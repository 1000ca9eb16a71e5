// how walls and bodies are moved by tables: accelerations that are integrated exactly, baselines
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "scene.h"

static void near(double value, double expected, double tolerance, const char *what) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%s: %.17g, expected %.17g within %g", what, value, expected, tolerance);
}

// a table of these columns
static silt_series table(int n_column, const char *const *name, int n_row, const double *value) {
    silt_series s = {.n_row = n_row, .n_column = n_column};
    s.name = silt_alloc((size_t)n_column, sizeof *s.name);
    s.value = silt_alloc((size_t)(n_row * n_column), sizeof *s.value);
    s.line = silt_alloc((size_t)n_row, sizeof *s.line);
    for (int k = 0; k < n_column; k++)
        s.name[k] = silt_text("%s", name[k]);
    memcpy(s.value, value, (size_t)(n_row * n_column) * sizeof *value);
    return s;
}

static double place(const silt_series *path, double time, int k) {
    double at[4];
    silt_path_at(path, time, at);
    return at[k];
}

// a = 2 t for three seconds, then none: t^2 and t^3/3, then on with 9 m/s; an angle of half that in degrees
static void test_cubic(void **state) {
    (void)state;
    silt_series s = table(3, (const char *const[]){"time", "ax", "aangle"}, 2, (const double[]){0, 0, 0, 3, 6, 3});
    assert_true(silt_path_accelerates(&s) && silt_path_doubled(&s) < 0);
    silt_path_settle(&s, 1, BASELINE_NONE);
    for (double t = 0; t <= 3; t += 0.3) {
        near(place(&s, t, 0), t * t * t / 3, 1e-14, "place");
        near(place(&s, t, 3), t * t * t / 6 * M_PI / 180, 1e-15, "angle");
        near(place(&s, t, 1), 0, 0, "y");
    }
    near(place(&s, 5, 0), 9 + 9 * 2, 1e-13, "after the end");
    near(place(&s, -1, 0), 0, 0, "before the begin");
    silt_series_clear(&s);
}

// a row in between says nothing new; the factor goes through
static void test_rows(void **state) {
    (void)state;
    const char *const name[] = {"time", "ay"};
    silt_series a = table(2, name, 3, (const double[]){0.5, 1, 1.5, -3, 4, 2});
    silt_series b = table(2, name, 5, (const double[]){0.5, 1, 0.75, 0, 1.5, -3, 2, -2, 4, 2});
    silt_path_settle(&a, 2, BASELINE_NONE);
    silt_path_settle(&b, 1, BASELINE_NONE);
    for (double t = 0; t < 6; t += 0.1)
        near(place(&a, t, 1), 2 * place(&b, t, 1), 1e-14, "place");
    silt_series_clear(&a);
    silt_series_clear(&b);
}

// speed at a time from the places around it: exact for a parabola, which holds near the end of a correction
static double speed(const silt_series *path, double time) {
    const double d = 1e-4;
    return (place(path, time + d, 0) - place(path, time - d, 0)) / (2 * d);
}

static void test_baselines(void **state) {
    (void)state;
    const char *const name[] = {"time", "ax"};
    const double value[] = {0, 0, 0.4, 2, 1, -1, 1.1, 3, 2, 0.5, 3, 1};
    silt_series free_one = table(2, name, 6, value), rest = table(2, name, 6, value), back = table(2, name, 6, value);
    silt_path_settle(&free_one, 1, BASELINE_NONE);
    silt_path_settle(&rest, 1, BASELINE_VELOCITY);
    silt_path_settle(&back, 1, BASELINE_PLACE);
    // the areas under the record: trapezoids
    const double V = 0.4 + 0.3 + 0.1 + 0.9 * 1.75 + 0.75;
    near(speed(&free_one, 4), V, 1e-10, "speed without correction");
    near(speed(&rest, 3.1), 0, 1e-12, "speed at rest");
    near(speed(&back, 3.1), 0, 1e-12, "speed at rest where it began");
    near(place(&back, 3, 0), 0, 1e-14, "place where it began");
    near(place(&back, 100, 0), 0, 1e-14, "and there it stays");
    // a constant off the acceleration is a parabola off the place, a straight line a cubic: third and fourth differences
    for (double t = 0; t < 2.5; t += 0.5) {
        const double d = 0.1;
        double r[5], b[5];
        for (int k = 0; k < 5; k++) {
            r[k] = place(&free_one, t + k * d, 0) - place(&rest, t + k * d, 0);
            b[k] = place(&free_one, t + k * d, 0) - place(&back, t + k * d, 0);
        }
        near(r[3] - 3 * r[2] + 3 * r[1] - r[0], 0, 1e-13, "parabola");
        near(b[4] - 4 * b[3] + 6 * b[2] - 4 * b[1] + b[0], 0, 1e-13, "cubic");
    }
    silt_series_clear(&free_one);
    silt_series_clear(&rest);
    silt_series_clear(&back);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cubic),
        cmocka_unit_test(test_rows),
        cmocka_unit_test(test_baselines),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
