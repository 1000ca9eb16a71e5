// what the scene rests on: base.h, CSV tables, regions, initial velocities
#include "scene.h"

#include <setjmp.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[4096]; // temporary

static void near(double a, double b, double tolerance) {
    if (!(fabs(a - b) <= tolerance))
        fail_msg("%.17g is not %.17g, off by %.3g, allowed %.3g", a, b, a - b, tolerance);
}

static const char *place(const char *name) {
    static char path[8][4200];
    static int i;
    i = (i + 1) % 8;
    snprintf(path[i], sizeof path[i], "%s/%s", folder, name);
    return path[i];
}

static const char *make(const char *name, const void *text, size_t size) {
    const char *path = place(name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, size, file), size);
    fclose(file);
    return path;
}

static const char *make_text(const char *name, const char *text) {
    return make(name, text, strlen(text));
}

// memory that is lent: what is borrowed lies in it as far as it goes, is nought, does not overlap, and is found free again
static void test_lent(void **state) {
    (void)state;
    static char room[4096];
    memset(room, 7, sizeof room);
    int *before = silt_borrow(10, sizeof *before); // nothing is lent: the heap's
    assert_false(silt_borrowed(before));
    silt_return(before);
    silt_lend(room + 5, sizeof room - 5);
    char *block[3];
    const size_t size[3] = {100, 1000, 300};
    for (int k = 0; k < 3; k++) {
        block[k] = silt_borrow(size[k], 1);
        assert_true(silt_borrowed(block[k]) && block[k] > room && block[k] + size[k] <= room + sizeof room);
        for (size_t c = 0; c < size[k]; c++)
            assert_int_equal(block[k][c], 0);
        memset(block[k], k + 1, size[k]);
    }
    for (int k = 0; k < 3; k++)
        for (size_t c = 0; c < size[k]; c++)
            assert_int_equal(block[k][c], k + 1);
    char *large = silt_borrow(3000, 1); // more than is left
    assert_false(silt_borrowed(large));
    silt_return(large);
    silt_return(block[1]); // between the others: the next that fits goes there
    char *again = silt_borrow(900, 1);
    assert_true(again == block[1] && again[0] == 0 && again[899] == 0 && block[0][99] == 1 && block[2][0] == 3);
    // what grows leaves
    int capacity = 100;
    block[0] = silt_grow(block[0], &capacity, 101, 1);
    assert_true(!silt_borrowed(block[0]) && capacity > 100 && block[0][99] == 1 && block[0][100] == 0);
    free(block[0]);
    silt_return(block[2]);
    silt_return(again);
    large = silt_borrow(3900, 1); // all is free again
    assert_true(silt_borrowed(large));
    silt_lend(NULL, 0);
    assert_false(silt_borrowed(large));
}

// the shop floor -----------------------------------------------------------------------------------------
static void test_base(void **state) {
    (void)state;
    // published values of FNV-1a and splitmix64
    assert_true(silt_hash(0, "", 0) == 0xcbf29ce484222325u);
    assert_true(silt_hash(0, "a", 1) == 0xaf63dc4c8601ec8cu);
    assert_true(silt_hash(0, "foobar", 6) == 0x85944171f73967e8u);
    assert_true(silt_hash(silt_hash(0, "foo", 3), "bar", 3) == 0x85944171f73967e8u);
    uint64_t seed = 1234567;
    static const uint64_t expected[] = {6457827717110365317u, 3203168211198807973u, 9817491932198370423u};
    for (int i = 0; i < 3; i++)
        assert_true(silt_random(&seed) == expected[i]);
    double mean = 0;
    for (int i = 0; i < 100000; i++) {
        double x = silt_uniform(&seed);
        assert_true(x >= 0 && x < 1);
        mean += x / 100000;
    }
    near(mean, 0.5, 0.005);
    int capacity = 0, *data = NULL;
    for (int i = 0; i < 1000; i++) {
        SILT_RESERVE(data, capacity, i + 1);
        assert_int_equal(data[i], 0);
        data[i] = i;
    }
    assert_true(data[999] == 999 && capacity >= 1000);
    free(data);
    silt_error err = {0};
    assert_int_equal(silt_fail(&err, SILT_FAILED, "one %d", 1), SILT_FAILED);
    assert_int_equal(silt_fail(&err, SILT_INPUT, "%s, two", err.text), SILT_INPUT);
    assert_string_equal(err.text, "one 1, two");
    assert_true(err.count == 1 && err.status == SILT_INPUT);
    assert_int_equal(silt_fail(NULL, SILT_STOPPED, "x"), SILT_STOPPED);
    char *text = silt_text("%s %d", "a", 5);
    assert_string_equal(text, "a 5");
    free(text);
    double then = silt_seconds();
    assert_true(silt_seconds() >= then);
}

// series, regions, formulas ------------------------------------------------------------------------------
static void test_series(void **state) {
    (void)state;
    silt_error err = {0};
    silt_series s = {0};
    make_text("a.csv",
              "\xef\xbb\xbf# comment\r\n\r\n t , \"q, m3/s\" ,word\r\n0,1,left\n  # more\n2 , 5 ,right\n4,,x\n");
    assert_int_equal(silt_series_read(folder, "a.csv", &s, &err), SILT_OK);
    assert_true(s.n_row == 3 && s.n_column == 3);
    assert_string_equal(s.name[0], "t");
    assert_string_equal(s.name[1], "q, m3/s");
    assert_int_equal(silt_series_column(&s, "word"), 2);
    assert_int_equal(silt_series_column(&s, "none"), -1);
    assert_true(s.value[3] == 2 && s.value[4] == 5 && isnan(s.value[5]) && isnan(s.value[7]));
    assert_true(s.line[0] == 4 && s.line[1] == 6 && s.line[2] == 7);
    assert_int_equal(silt_series_rising(&s, &err), SILT_INPUT);
    silt_series_clear(&s);
    silt_series_clear(&s);

    make_text("b.csv", "t,a,b\n0,1,10\n1,3,10\n3,-1,20");
    assert_int_equal(silt_series_read(folder, "b.csv", &s, &err), SILT_OK);
    assert_int_equal(silt_series_rising(&s, &err), SILT_OK);
    // linear between rows, constant outside
    static const double expected[][3] = {{-1, 1, 10}, {0, 1, 10},     {0.25, 1.5, 10}, {1, 3, 10},
                                         {2, 1, 15},  {2.5, 0, 17.5}, {3, -1, 20},     {9, -1, 20}};
    for (int i = 0; i < 8; i++)
        for (int k = 1; k < 3; k++)
            assert_true(silt_series_at(&s, k, expected[i][0]) == expected[i][k]);
    assert_true(isnan(silt_series_at(&s, 3, 1)));
    silt_series_clear(&s);

    static const char *const bad[][2] = {{"", "c.csv:1: found no row of numbers"},
                                         {"t,x\n", "c.csv:1: found no row of numbers"},
                                         {"1,2\n3,4\n", "c.csv:1: column 1: found '1', allowed a column name"},
                                         {"t,t\n", "c.csv:1: column 2: found the name 't' again"},
                                         {"t,x\n0,1,2\n", "c.csv:2: found 3 cells, allowed 2"},
                                         {"#\nt,x\n0,1\n\n1,y\n", "c.csv:5: column 'x': found 'y', allowed a number"}};
    for (int i = 0; i < 6; i++) {
        make_text("c.csv", bad[i][0]);
        assert_int_equal(silt_series_read(folder, "c.csv", &s, &err), SILT_INPUT);
        if (!strstr(err.text, bad[i][1]))
            fail_msg("not in the message: %s\n%s", bad[i][1], err.text);
        assert_true(s.n_row == 0 && s.value == NULL);
    }
    make("c.csv", "t,x\n0,\0\n", 8);
    assert_int_equal(silt_series_read(folder, "c.csv", &s, &err), SILT_INPUT);
    assert_int_equal(silt_series_read(folder, "nowhere.csv", &s, &err), SILT_INPUT);
    assert_non_null(strstr(err.text, "nowhere.csv: cannot be opened"));
}

static void test_regions(void **state) {
    (void)state;
    double ell[18] = {0, 0, 0, 2, 0, 0, 2, 1, 0, 1, 1, 0, 1, 3, 0, 0, 3, 0}, centre[3], lo[2], hi[2];
    silt_region box = {.kind = REGION_BOX, .lo = {-1, 2}, .hi = {3, 2.5}};
    silt_region circle = {.kind = REGION_CIRCLE, .centre = {1, 1}, .radius = 2};
    silt_region polygon = {.kind = REGION_POLYGON, .n_point = 6, .point = ell};
    assert_true(silt_region_area(&box) == 2 && silt_region_area(&polygon) == 4);
    near(silt_region_area(&circle), 4 * M_PI, 1e-14);
    assert_true(silt_region_contains(&box, (double[]){3, 2.5, 0}) &&
                !silt_region_contains(&box, (double[]){0, 1.9, 0}));
    assert_true(silt_region_contains(&circle, (double[]){2.4, 2.4, 0}) &&
                !silt_region_contains(&circle, (double[]){2.5, 2.5, 0}));
    assert_true(silt_region_contains(&polygon, (double[]){1.5, 0.5, 0}) &&
                silt_region_contains(&polygon, (double[]){0.5, 2.9, 0}) &&
                !silt_region_contains(&polygon, (double[]){1.5, 1.5, 0}) &&
                !silt_region_contains(&polygon, (double[]){-0.5, 1, 0}));
    // a ray through corners
    assert_true(silt_region_contains(&polygon, (double[]){0.5, 1, 0}) &&
                !silt_region_contains(&polygon, (double[]){3, 1, 0}));
    // parts: 2 x 1 at (1, 0.5) and 1 x 2 at (0.5, 2)
    silt_polygon_centroid(6, ell, centre);
    near(centre[0], 0.75, 1e-15);
    near(centre[1], 1.25, 1e-15);
    silt_region_bounds(&polygon, lo, hi);
    assert_true(lo[0] == 0 && lo[1] == 0 && hi[0] == 2 && hi[1] == 3);
    silt_region_bounds(&circle, lo, hi);
    assert_true(lo[0] == -1 && hi[1] == 3);
    // far from the origin no digit of the area is lost that the points still have
    for (int i = 0; i < 6; i++)
        ell[3 * i] += 1e9;
    assert_true(silt_polygon_area(6, ell) == 4);
    int edges[2];
    assert_false(silt_chain_crosses(6, ell, true, edges));
    const double bow[12] = {0, 0, 0, 1, 1, 0, 1, 0, 0, 0, 1, 0};
    assert_true(silt_chain_crosses(4, bow, true, edges) && edges[0] == 0 && edges[1] == 2);
    assert_false(silt_chain_straight(4, bow));
    // there and back on one line
    const double back[9] = {0, 0, 0, 2, 0, 0, 1, 0, 0};
    assert_true(silt_chain_crosses(3, back, false, edges) && silt_chain_straight(3, back));
}

static double divergence(const silt_formula *f, double x, double y, double *curl) {
    const double h = 1e-5;
    double east[3], west[3], north[3], south[3];
    silt_formula_velocity(f, 9.81, (double[]){x + h, y, 0}, east);
    silt_formula_velocity(f, 9.81, (double[]){x - h, y, 0}, west);
    silt_formula_velocity(f, 9.81, (double[]){x, y + h, 0}, north);
    silt_formula_velocity(f, 9.81, (double[]){x, y - h, 0}, south);
    *curl = (east[1] - west[1] - north[0] + south[0]) / (2 * h);
    return (east[0] - west[0] + north[1] - south[1]) / (2 * h);
}

static void test_formulas(void **state) {
    (void)state;
    double v[3], curl;
    silt_formula f = {
        .kind = FORMULA_STANDING_WAVE, .amplitude = 0.02, .length = 2, .depth = 0.6, .centre = {0.3, -0.1}};
    double k = M_PI, omega = sqrt(9.81 * k * tanh(k * 0.6));
    for (int i = 0; i < 200; i++) {
        double x = -1 + 0.017 * i, y = -0.1 + 0.6 * (i % 11) / 10.0;
        // no source, no rotation
        near(divergence(&f, x, y, &curl), 0, 1e-8);
        near(curl, 0, 1e-8);
        // nothing through the bed; the surface rises as d(a cos(k (x - xc)) sin(omega t))/dt at t = 0
        silt_formula_velocity(&f, 9.81, (double[]){x, -0.1, 0}, v);
        assert_true(v[1] == 0 && v[2] == 0);
        silt_formula_velocity(&f, 9.81, (double[]){x, 0.5, 0}, v);
        near(v[1], 0.02 * omega * cos(k * (x - 0.3)), 1e-15);
        // under the crest no flow along, left of it towards it
        silt_formula_velocity(&f, 9.81, (double[]){0.3, y, 0}, v);
        assert_true(v[0] == 0);
        silt_formula_velocity(&f, 9.81, (double[]){0.2, y, 0}, v);
        assert_true(v[0] > 0);
    }
    // deep water: no overflow
    f.depth = 1e4;
    silt_formula_velocity(&f, 9.81, (double[]){0.3, 1e4 - 0.1, 0}, v);
    near(v[1], 0.02 * sqrt(9.81 * k), 1e-12);

    f = (silt_formula){.kind = FORMULA_TAYLOR_GREEN, .amplitude = 2, .length = 0.5, .centre = {1, 1}};
    for (int i = 0; i < 50; i++)
        near(divergence(&f, 1 + 0.01 * i, 1.2, &curl), 0, 1e-8);
    silt_formula_velocity(&f, 0, (double[]){1.25, 1, 0}, v);
    near(v[0], 2, 1e-15);
    near(v[1], 0, 1e-15);
    silt_formula_velocity(&f, 0, (double[]){1, 1.25, 0}, v);
    near(v[0], 0, 1e-15);
    near(v[1], -2, 1e-15);

    f = (silt_formula){.kind = FORMULA_SOLID_ROTATION, .rate = 3, .centre = {1, 2}};
    silt_formula_velocity(&f, 0, (double[]){2, 4, 0}, v);
    assert_true(v[0] == -6 && v[1] == 3);
    near(divergence(&f, 2, 4, &curl), 0, 1e-9);
    near(curl, 6, 1e-9);
    f.kind = FORMULA_SHEAR;
    silt_formula_velocity(&f, 0, (double[]){2, 4, 0}, v);
    assert_true(v[0] == 6 && v[1] == 0);
    f.kind = FORMULA_STRAIN;
    silt_formula_velocity(&f, 0, (double[]){2, 4, 0}, v);
    assert_true(v[0] == -3 && v[1] == 6);
    f = (silt_formula){.kind = FORMULA_UNIFORM, .vector = {1, 2, 0}};
    silt_formula_velocity(&f, 0, (double[]){2, 4, 0}, v);
    assert_true(v[0] == 1 && v[1] == 2);
    f.kind = FORMULA_NONE;
    silt_formula_velocity(&f, 0, (double[]){2, 4, 0}, v);
    assert_true(v[0] == 0 && v[1] == 0 && v[2] == 0);
}

int main(void) {
    snprintf(folder, sizeof folder, "%s/test_base_XXXXXX", SILT_BINARY);
    if (!mkdtemp(folder))
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_base),
        cmocka_unit_test(test_lent),
        cmocka_unit_test(test_series),
        cmocka_unit_test(test_regions),
        cmocka_unit_test(test_formulas),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[4300];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command) != 0 || failed ? 1 : 0;
}
