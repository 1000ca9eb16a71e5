// silt bench in small: the JSON is whole, shares sum to 1, what is counted is positive; no time is held against a clock

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <libfyaml.h>
#include <unistd.h>

#include "bench.h"

static const char *const phase_name[CLOCK_COUNT] = {
#define X(name) #name,
    SILT_CLOCKS(X)
#undef X
};

static double number(struct fy_document *doc, int row, const char *key) {
    char *path = silt_text("/rows/%d/%s", row, key);
    struct fy_node *node = fy_node_by_path(fy_document_root(doc), path, FY_NT, FYNWF_DONT_FOLLOW);
    const char *text = node && fy_node_is_scalar(node) ? fy_node_get_scalar0(node) : NULL;
    if (!text)
        fail_msg("%s is not in the file", path);
    free(path);
    return strcmp(text, "null") == 0 ? NAN : atof(text);
}

// measures and reads the JSON again. @return rows
static int measure(silt_bench_def def, struct fy_document **doc, char **table) {
    char json[] = "/tmp/silt-bench-XXXXXX";
    size_t length = 0;
    silt_error err = {0};
    const int fd = mkstemp(json);
    assert_true(fd >= 0);
    close(fd);
    def.json = json;
    def.worker = SILT_BINARY "/silt-dem";
    def.quiet = true;
    FILE *to = open_memstream(table, &length);
    if (silt_bench(&def, to, &err) != SILT_OK)
        fail_msg("%s", err.text);
    fclose(to);
    // strict JSON: no comments, no bare words
    *doc = fy_document_build_from_file(&(struct fy_parse_cfg){.flags = FYPCF_QUIET | FYPCF_JSON_FORCE}, json);
    unlink(json);
    assert_non_null(*doc);
    struct fy_node *rows = fy_node_by_path(fy_document_root(*doc), "/rows", FY_NT, FYNWF_DONT_FOLLOW);
    assert_non_null(rows);
    return fy_node_sequence_item_count(rows);
}

static void hold_row(struct fy_document *doc, int row) {
    static const char *const positive[] = {"nodes", "cells", "steps", "threads", "ns_per_node_step", "mean_ns_per_node_step",
                                           "u1_ns_per_point", "step_in_u1", "dt", "start_seconds", "peak_bytes_per_node"};
    static const char *const counted[] = {"iterations", "momentum_iterations", "pressure_iterations", "retries", "courant", "grains"};
    static const int always[] = {CLOCK_triangulate, CLOCK_decide, CLOCK_index, CLOCK_assemble, CLOCK_matrix,
                                 CLOCK_factor,      CLOCK_solve,  CLOCK_move,  CLOCK_output,   CLOCK_rest};
    double shares = 0, sum = 0;
    for (size_t k = 0; k < sizeof positive / sizeof *positive; k++)
        assert_true(number(doc, row, positive[k]) > 0);
    for (size_t k = 0; k < sizeof counted / sizeof *counted; k++)
        assert_true(number(doc, row, counted[k]) >= 0);
    for (int c = 0; c < CLOCK_COUNT; c++) {
        char key[80];
        snprintf(key, sizeof key, "phases/%s/share", phase_name[c]);
        assert_true(number(doc, row, key) >= 0);
        shares += number(doc, row, key);
        snprintf(key, sizeof key, "phases/%s/ns_per_node_step", phase_name[c]);
        sum += number(doc, row, key);
    }
    assert_float_equal(shares, 1, 1e-7);
    assert_float_equal(sum / number(doc, row, "ns_per_node_step"), 1, 1e-7);
    for (size_t k = 0; k < sizeof always / sizeof *always; k++) {
        char key[80];
        snprintf(key, sizeof key, "phases/%s/share", phase_name[always[k]]);
        assert_true(number(doc, row, key) > 0);
    }
    // the solver in space iterates, that of the plane is direct
    assert_true((number(doc, row, "pressure_iterations") > 0) == (number(doc, row, "dimension") == 3));
}

static void test_steps(void **state) {
    (void)state;
    struct fy_document *doc;
    char *table;
    const int rows = measure((silt_bench_def){.scenes = "dam-2d,dam-3d,grains-1k,bed-2d", .sizes = "400,800", .steps = 2, .warm_up = 2}, &doc, &table);
    assert_int_equal(rows, 8);
    for (int k = 0; k < rows; k++)
        hold_row(doc, k);
    for (int k = 0; k < rows; k += 2) {
        assert_true(number(doc, k + 1, "nodes") > 1.3 * number(doc, k, "nodes"));
        assert_true(isnan(number(doc, k, "growth")) && isfinite(number(doc, k + 1, "growth")));
    }
    assert_true(number(doc, 4, "grains") == 1000 && number(doc, 4, "substeps") >= 1);
    assert_true(number(doc, 4, "phases/grains/share") > 0 && number(doc, 4, "phases/coupling/share") > 0);
    assert_true(number(doc, 6, "phases/bed/share") > 0);
    // a phase that nothing ran in is in the file, and not in the table
    assert_true(number(doc, 0, "phases/bed/share") == 0 && number(doc, 0, "phases/heal/share") == 0);
    assert_true(number(doc, 2, "phases/heal/share") > 0);
    assert_non_null(strstr(table, "dam-2d"));
    assert_non_null(strstr(table, "triangulate"));
    free(table);
    fy_document_destroy(doc);
}

// a run to its end, with the unit that other codes were measured in
static void test_whole(void **state) {
    (void)state;
    struct fy_document *doc;
    char *table;
    const char *const set[] = {"time.end=0.05"};
    assert_int_equal(measure((silt_bench_def){.scenes = "collapse-2d", .sizes = "5", .set = set, .n_set = 1}, &doc, &table), 1);
    hold_row(doc, 0);
    assert_float_equal(number(doc, 0, "model_seconds"), 0.05, 1e-9);
    assert_true(number(doc, 0, "u2_seconds") > 0);
    assert_float_equal(number(doc, 0, "seconds") / 0.05 / number(doc, 0, "u2_seconds") / number(doc, 0, "run_per_model_in_u2"), 1, 1e-6);
    assert_true(number(doc, 0, "volume_error_early") <= number(doc, 0, "volume_error"));
    assert_non_null(strstr(table, "U2"));
    free(table);
    fy_document_destroy(doc);
}

static void test_refused(void **state) {
    (void)state;
    silt_error err = {0};
    assert_int_equal(silt_bench(&(silt_bench_def){.scenes = "dam-2d,nothing", .quiet = true}, stdout, &err), SILT_INPUT);
    assert_non_null(strstr(err.text, "found no scene 'nothing', allowed: dam-2d"));
    err = (silt_error){0};
    assert_int_equal(silt_bench(&(silt_bench_def){.scenes = "dam-2d", .sizes = "1k,many", .quiet = true}, stdout, &err), SILT_INPUT);
    assert_non_null(strstr(err.text, "found the size 'many'"));
    // what goes wrong in the measured process comes back whole
    err = (silt_error){0};
    const char *const set[] = {"fluid.density=-1"};
    assert_int_equal(silt_bench(&(silt_bench_def){.scenes = "dam-2d", .sizes = "400", .set = set, .n_set = 1, .quiet = true}, stdout, &err),
                     SILT_INPUT);
    assert_non_null(strstr(err.text, "fluid.density"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_steps),
        cmocka_unit_test(test_whole),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
