// silt study from inside: its keys, right and wrong; points of ranges; what a run left and how it is judged; lines
// through results

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include "check.h"
#include "run.h"
#include "study.h"

#define WRONG SILT_SOURCE "/tests/wrong/study/"
#define SCENE SILT_SOURCE "/tests/study/drop.yaml"

static char folder[512];

static void make(const char *name, const char *text) {
    char *path = silt_text("%s/%s", folder, name);
    FILE *to = fopen(path, "w");
    assert_non_null(to);
    fputs(text, to);
    fclose(to);
    free(path);
}

static char *content(const char *path) {
    char *text = NULL;
    size_t size = 0;
    FILE *from = fopen(path, "r");
    if (!from)
        fail_msg("%s is not there", path);
    if (getdelim(&text, &size, 0, from) < 0)
        fail_msg("%s is empty", path);
    fclose(from);
    return text;
}

static study read_text(const char *text) {
    study s;
    make("study.yaml", text);
    char *path = silt_text("%s/study.yaml", folder);
    const silt_study_def def = {.path = path};
    OK(study_read(&s, &def, &error));
    study_points(&s);
    free(path);
    return s;
}

// keys ------------------------------------------------------------------------------------------------
// the first line says which errors, all of them, as in tests/wrong
static void test_wrong(void **state) {
    (void)state;
    DIR *dir = opendir(WRONG);
    assert_non_null(dir);
    int n_file = 0;
    for (struct dirent *entry; (entry = readdir(dir));) {
        if (!strstr(entry->d_name, ".yaml"))
            continue;
        char *path = silt_text(WRONG "%s", entry->d_name), *text = content(path), position[64], key[128], wanted[512];
        study s;
        const silt_study_def def = {.path = path};
        assert_int_equal(sscanf(text, "# expect: %63s %127s", position, key), 2);
        snprintf(wanted, sizeof wanted, "%s:%s: key '%s': found ", entry->d_name, position, key);
        error = (silt_error){0};
        assert_int_equal(study_read(&s, &def, &error), SILT_INPUT);
        if (error.count != 1 || !strstr(error.text, wanted) || !strstr(error.text, "allowed"))
            fail_msg("%s: %d errors, expected %s\n%s", path, error.count, wanted, error.text);
        study_clear(&s);
        free(text);
        free(path);
        n_file++;
    }
    closedir(dir);
    assert_true(n_file >= 18);
}

// `test_study document` prints what stands below its headline in docs/study.md
static void test_document(void **state) {
    (void)state;
    char *text = NULL, *page = content(SILT_SOURCE "/docs/study.md");
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    silt_study_document(to);
    fclose(to);
    const char *keys = strstr(page, "| key | type |");
    assert_non_null(keys);
    assert_string_equal(keys, text);
    free(text);
    free(page);
}

static void test_help(void **state) {
    (void)state;
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    OK(silt_study_help("seek.check", to, &error));
    fclose(to);
    assert_non_null(strstr(text, "name of a check of the scene"));
    free(text);
    assert_int_equal(silt_study_help("seek.chek", stdout, &error), SILT_INPUT);
    assert_non_null(strstr(error.text, "did you mean 'check'?"));
}

// points ----------------------------------------------------------------------------------------------
static void test_grid(void **state) {
    (void)state;
    study s = read_text("study: 1\nscene: " SCENE "\nvary:\n"
                        "  - {key: a.b, values: [x, [1, 2.5], {k: 'y z'}]}\n"
                        "  - {key: c, log: [1.0e-6, 1.0e+6], count: 5}\n"
                        "  - {key: d, linear: [0, 1], count: 3, form: '[0, -%]', with: [{key: e, factor: 2}, {key: "
                        "f.0.g, form: '<%>'}]}\n");
    assert_int_equal(study_count(&s), 45);
    // the last range runs fastest
    assert_string_equal(study_value(&s, 0, 0), "x");
    assert_string_equal(study_value(&s, 44, 0), "{k: 'y z'}");
    assert_string_equal(study_value(&s, 15, 0), "[1, 2.5]");
    const char *const decade[] = {"1e-06", "0.001", "1", "1000", "1e+06"};
    for (int k = 0; k < 45; k++)
        assert_string_equal(study_value(&s, k, 1), decade[k / 3 % 5]);
    assert_string_equal(study_value(&s, 4, 2), "0.5");
    char **set = NULL;
    int n = 0, capacity = 0;
    study_assign(&set, &n, &capacity, s.range[2].key, s.range[2].form, s.range[2].n_with, s.range[2].with, "0.5");
    assert_int_equal(n, 3);
    assert_string_equal(set[0], "d=[0, -0.5]");
    assert_string_equal(set[1], "e=1");
    assert_string_equal(set[2], "f.0.g=<0.5>");
    for (int i = 0; i < n; i++)
        free(set[i]);
    free(set);
    study_clear(&s);
}

static void test_random(void **state) {
    (void)state;
#define DRAWN(seed, more)                                                                                              \
    "study: 1\nscene: " SCENE "\nseed: " seed "\ncombine: together\nvary:\n  - {key: a, random: [2, 3], count: 400}\n" \
    "  - {key: b, log_random: [1.0e-3, 1.0e+3], count: 400}\n" more
    study s = read_text(DRAWN("5", "")), again = read_text(DRAWN("5", "")), other = read_text(DRAWN("6", ""));
    assert_int_equal(study_count(&s), 400);
    double mean = 0, decades = 0;
    int same = 0;
    for (int k = 0; k < 400; k++) {
        const double a = atof(study_value(&s, k, 0)), b = atof(study_value(&s, k, 1));
        assert_true(a >= 2 && a <= 3 && b >= 1e-3 && b <= 1e3);
        mean += a / 400;
        decades += log10(b) / 400;
        assert_string_equal(study_value(&s, k, 0), study_value(&again, k, 0));
        same += strcmp(study_value(&s, k, 0), study_value(&other, k, 0)) == 0;
    }
    // four standard deviations of the mean
    near(mean, 2.5, 4 * sqrt(1 / 12.0 / 400), "mean");
    near(decades, 0, 4 * 6 * sqrt(1 / 12.0 / 400), "mean of the logarithm");
    assert_true(same < 4);
    study_clear(&s);
    study_clear(&again);
    study_clear(&other);
}

// what a run left -------------------------------------------------------------------------------------
#define SUMMARY(retries)                                                                                               \
    "{\"status\": \"done\", \"steps\": 2, \"steps_here\": 2, \"time\": 0.5, \"nodes\": 10, \"node_steps\": 24, "       \
    "\"retries\": " retries ", \"worst_sediment_error\": 0,\n"                                                           \
    "\"checks\": [{\"name\": \"way\", \"value\": 0.11, \"error\": 0.1, \"pass\": false}, {\"name\": \"b\", "           \
    "\"value\": null, \"error\": null, \"pass\": false}]}"
#define HEADER "step,time,dt,kinetic_energy,potential_energy,external_work,centre_x\n"
#define OWED_HEADER                                                                                                    \
    "step,time,dt,fluid_volume,volume_error,volume_owed,kinetic_energy,potential_energy,owed_energy,external_work\n"

static const char *scene_more = ""; // of the scene that was run

static study_row judged(study *s, const char *summary, const char *history, const char *said, study_end end) {
    make("run.log", *said == '!' ? said + 1 : "");
    static const char gauge[] =
        "silt: 1\ntime: {end: 1, output: 1}\ngravity: [0, -10]\n"
        "fluid: {density: 1000, viscosity: 0, flow: laminar, size: 0.1, regions: [{box: [[0, 0], [1, 2]]}]}\n"
        "gauges: [{name: centre, centroid_of: water}]\n";
    char *path = silt_text("%s/summary.json", folder), *log = silt_text("%s/log", folder);
    unlink(path);
    char *text = silt_text("%s%s", gauge, scene_more);
    make("scene.yaml", text);
    free(text);
    if (summary)
        make("summary.json", summary);
    make("history.csv", history);
    make("log", said);
    study_row row = {0};
    study_result(s, folder, log, &end, &row);
    free(path);
    free(log);
    return row;
}

static void ends(const char *summary, const char *history, const char *said, study_end end, study_status status,
                 const char *reason) {
    study s = {.bounds = {.volume = 0.01, .mass = 0.012, .sediment = 1e-9, .energy = 0.01}};
    study_row row = judged(&s, summary, history, said, end);
    if (study_row_status(&row) != status || !strstr(study_row_text(&row, "reason"), reason))
        fail_msg("%s: %s; expected %s: %s", study_row_text(&row, "status"), study_row_text(&row, "reason"),
                 study_status_word[status], reason);
    study_row_clear(&row);
}

static void test_statuses(void **state) {
    (void)state;
    static const char sound[] = HEADER "0,0,0,5,7,0,1\n1,0.2,0.2,4,7,0,nan\n2,0.5,0.3,3,7,0,1\n";
    const study_end good = {.cpu = 1};
    ends(SUMMARY("0"), sound, "", good, RUN_OK, "");
    ends(SUMMARY("3"), sound, "", good, RUN_CUT, "3 steps cut");
    // beyond what the study allows: wrong, but where the run says it itself
    static const char off[] = OWED_HEADER "0,0,0,2,0,0,0,500,0,0\n1,0.2,0.2,1.9,-0.011,0.022,0,200,300,0\n";
#define BEYOND(kind) "!warning: t = 0 s: the shear\nwarning: t = 1 s: beyond its bounds: of " kind ", bounds." kind " allows 1 %\n"
    ends(SUMMARY("0"), off, "", good, RUN_WRONG, "volume_error 0.011, allowed 0.01");
    ends(SUMMARY("2"), off, "!warning: t = 1 s: the shear", good, RUN_WRONG, "volume_error 0.011");
    ends(SUMMARY("2"), off, BEYOND("energy"), good, RUN_WRONG, "volume_error 0.011");
    ends(SUMMARY("2"), off, BEYOND("volume"), good, RUN_BEYOND, "beyond its bounds: of volume");
    // within what the study allows, but not within its own
    ends(SUMMARY("0"), sound, BEYOND("mass"), good, RUN_BEYOND, "beyond its bounds: of mass");
    ends(SUMMARY("0"), sound, "!frame 1\nwarning: t = 0 s: the shear\n", good, RUN_WARNED, "warning: t = 0 s: the shear");
    ends(SUMMARY("0"), HEADER, "", good, RUN_WRONG, "history.csv has no rows");
    ends(NULL, sound, "warning: a\nscene.yaml:1:2: key 'a': found", (study_end){.code = SILT_INPUT}, RUN_REFUSED,
         "scene.yaml:1:2: key 'a'");
    ends(SUMMARY("0"), sound, "step 3 gave up\nthe last checkpoint", (study_end){.code = SILT_FAILED},
         RUN_FAILED, "step 3 gave up");
    ends(NULL, sound, "", (study_end){.code = SILT_FAILED}, RUN_CRASHED, "exit code 1 without a word");
    ends(SUMMARY("0"), sound, "stopped by time.wall", (study_end){.code = SILT_STOPPED}, RUN_UNFINISHED,
         "stopped by time.wall");
    ends(NULL, sound, "", (study_end){.code = 77}, RUN_CRASHED, "exit code 77");
    ends(NULL, sound, "", good, RUN_CRASHED, "no summary.json");
    ends(NULL, sound, "malloc: corrupted", (study_end){.code = -1, .signal = 11}, RUN_CRASHED,
         "signal 11: malloc: corrupted");
    ends(NULL, sound, "", (study_end){.code = -1, .signal = 9, .late = true, .stalled = true, .cpu = 2}, RUN_HUNG,
         "stopped after 2 s");
    ends(NULL, sound, "", (study_end){.code = -1, .signal = 9, .late = true}, RUN_UNFINISHED, "stopped after");
    // a column that is none, in a run that ended well or not; gauges may have gaps
    static const char broken[] = HEADER "0,0,0,5,7,0,1\n1,0.2,0.2,4,nan,0,1\n";
    ends(SUMMARY("0"), broken, "", good, RUN_WRONG, "no number in column potential_energy at t = 0.2 s");
    ends(SUMMARY("0"), broken, "gave up", (study_end){.code = SILT_FAILED}, RUN_WRONG,
         "no number in column potential_energy");
}

// 2 m3 of water that stands 2 m high in g = 10 m/s2 can give up 20 kJ/m; 5 J of motion, 100 J of work
static void test_energy(void **state) {
    (void)state;
    study s = {.bounds = {.volume = 0.06, .mass = 1e-3, .sediment = 1e-9, .energy = 0.01}};
    const study_end good = {.cpu = 1};
    study_row row = judged(&s, SUMMARY("0"),
                           HEADER "0,0,0,0,0,0,1\n1,0.2,0.2,400,-90,100,1\n2,0.5,0.3,0,-90,100,1\n", "", good);
    near(study_row_number(&row, "energy_excess"), 210 / (20000.0 + 400 + 90 + 100), 1e-5, "excess");
    assert_int_equal(study_row_status(&row), RUN_WRONG);
    assert_non_null(strstr(study_row_text(&row, "reason"), "energy_excess 0.0102, allowed 0.01"));
    study_row_clear(&row);
    // what comes from outside is no excess
    row = judged(&s, SUMMARY("0"), HEADER "0,0,0,0,0,0,1\n1,0.2,0.2,400,-90,310,1\n", "", good);
    near(study_row_number(&row, "energy_excess"), 0, 0, "excess");
    assert_int_equal(study_row_status(&row), RUN_OK);
    study_row_clear(&row);
    // 0.1 m3 of 2 are owed with 300 J of 500: neither is lost
    row = judged(&s, SUMMARY("0"), OWED_HEADER "0,0,0,2,0,0,0,500,0,0\n1,0.2,0.2,1.9,-0.05,0.1,0,200,300,0\n",
                 "", good);
    near(study_row_number(&row, "energy_excess"), 0, 0, "excess");
    near(study_row_number(&row, "mass_error"), 0, 1e-15, "mass");
    assert_int_equal(study_row_status(&row), RUN_OK);
    study_row_clear(&row);
    // 0.0025 of it is
    row = judged(&s, SUMMARY("0"), OWED_HEADER "0,0,0,2,0,0,0,500,0,0\n1,0.2,0.2,1.9,-0.05,0.095,0,200,300,0\n",
                 "", good);
    near(study_row_number(&row, "mass_error"), 0.0025, 1e-12, "mass");
    assert_int_equal(study_row_status(&row), RUN_WRONG);
    study_row_clear(&row);
    row = judged(&s, SUMMARY("0"), HEADER "0,0,0,0,0,0,1\n1,0.2,0.2,400,-90,310,1\n", "", good);
    // cells of the row
    near(study_row_number(&row, "nodes"), 12, 0, "nodes");
    near(study_row_number(&row, "mean_dt"), 0.25, 0, "mean dt");
    near(study_row_number(&row, "way_error"), 0.1, 0, "error of a check");
    assert_true(isnan(study_row_number(&row, "b_error")));
    study_row_clear(&row);
}

// what a body that moves gains the water may lose, and no more; of one that is sprung nothing is known
static void test_energy_bodies(void **state) {
    (void)state;
#define BODY(more)                                                                                                     \
    "walls: [{box: [[0, 0], [3, 3]]}]\ncontact: {youngs_modulus: 1.0e7, poissons_ratio: 0.3, restitution: 0.5, friction: 0.2, rolling_friction: 0}\n" \
    "bodies: [{name: box, shape: box, at: [2, 1], scale: 0.2, density: 500" more "}]\n"
#define BODY_HEADER "step,time,dt,kinetic_energy,potential_energy,external_work,body_kinetic_energy,body_potential_energy\n"
    study s = {.bounds = {.volume = 0.01, .mass = 1e-3, .sediment = 1e-9, .energy = 0.01}};
    const study_end good = {.cpu = 1};
    scene_more = BODY("");
    // 700 J of the water's 20 kJ became 300 J of motion and 400 J of height: the work on the water says nothing
    study_row row = judged(&s, SUMMARY("0"), BODY_HEADER "0,0,0,0,900,0,0,50\n1,0.2,0.2,0,200,-700,300,450\n", "", good);
    near(study_row_number(&row, "energy_excess"), 0, 0, "excess");
    assert_int_equal(study_row_status(&row), RUN_OK);
    study_row_clear(&row);
    // and 220 J more: above 1 % of 20 kJ + 700 + 300 + 620
    row = judged(&s, SUMMARY("0"), BODY_HEADER "0,0,0,0,900,0,0,50\n1,0.2,0.2,0,200,-700,300,670\n", "", good);
    near(study_row_number(&row, "energy_excess"), 220 / (20000.0 + 700 + 300 + 620), 5e-5, "excess");
    assert_int_equal(study_row_status(&row), RUN_WRONG);
    study_row_clear(&row);
    scene_more = BODY(", springs: [{at: [2, 1], to: [2, 2], stiffness: 100}]");
    row = judged(&s, SUMMARY("0"), BODY_HEADER "0,0,0,0,900,0,0,50\n1,0.2,0.2,0,200,-700,300,670\n", "", good);
    assert_true(isnan(study_row_number(&row, "energy_excess")));
    assert_int_equal(study_row_status(&row), RUN_OK);
    study_row_clear(&row);
    scene_more = "";
}

// rows ------------------------------------------------------------------------------------------------
static void test_row(void **state) {
    (void)state;
    study_row row = {0}, back;
    study_row_add(&row, "status", "ok");
    study_row_add(&row, "reason", "two\nlines, and \"quotes\"");
    study_row_add(&row, "empty", "%s", "");
    char *path = silt_text("%s/a.row", folder);
    OK(study_row_write(&row, path, &error));
    assert_true(study_row_read(&back, path));
    assert_int_equal(back.n, 3);
    assert_string_equal(study_row_text(&back, "reason"), "two lines, and \"quotes\"");
    assert_string_equal(study_row_text(&back, "empty"), "");
    assert_null(study_row_text(&back, "absent"));
    study_row_clear(&row);
    study_row_clear(&back);
    free(path);
}

static void test_slope(void **state) {
    (void)state;
    study_table table = {0};
    for (int k = 0; k < 6; k++) {
        const double h = 0.1 * (k + 1);
        SILT_RESERVE(table.row, table.capacity, table.n + 1);
        study_row *row = &table.row[table.n++];
        *row = (study_row){0};
        // the last two do not count: a run that failed, an error of nought
        study_row_add(row, "status", "%s", k == 4 ? "failed" : "ok");
        study_row_add(row, "odd", k % 2 ? "yes" : "no");
        study_row_add(row, "h", "%.17g", h);
        study_row_add(row, "e", "%.17g", k == 4 ? 1000 : k == 5 ? 0 : 3 * h * h * sqrt(h));
    }
    double slope, at_one;
    assert_int_equal(study_slope(&table, "h", "e", NULL, NULL, &slope, &at_one), 4);
    near(slope, 2.5, 1e-12, "order");
    near(at_one, 3, 1e-12, "error at h = 1");
    assert_int_equal(study_slope(&table, "absent", "e", NULL, NULL, &slope, &at_one), 0);
    assert_true(isnan(slope));
    // of the rows of one value: e = 3 h^2.5 all the same
    assert_string_equal(study_distinct(&table, "odd", 0), "no");
    assert_string_equal(study_distinct(&table, "odd", 1), "yes");
    assert_null(study_distinct(&table, "odd", 2));
    assert_int_equal(study_slope(&table, "h", "e", "odd", "yes", &slope, &at_one), 2);
    near(slope, 2.5, 1e-12, "order of the odd rows");
    study_table_clear(&table);
}

static int make_folder(void **state) {
    (void)state;
    snprintf(folder, sizeof folder, "%s/study_XXXXXX", SILT_BINARY);
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state) {
    (void)state;
    silt_folder_remove(folder);
    return 0;
}

int main(int argc, char **argv) {
    if (argc > 1 && strcmp(argv[1], "document") == 0) {
        silt_study_document(stdout);
        return 0;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wrong),  cmocka_unit_test(test_document), cmocka_unit_test(test_help),
        cmocka_unit_test(test_grid),   cmocka_unit_test(test_random),   cmocka_unit_test(test_statuses),
        cmocka_unit_test(test_energy), cmocka_unit_test(test_energy_bodies), cmocka_unit_test(test_row),      cmocka_unit_test(test_slope),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
