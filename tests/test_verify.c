// checks held against hand-made histories, and what verify, summary and info make of them

#include "output_folder.h"

// ---------------------------------------------------------------- checks

// a history of 2001 steps over 10 s
static void checks_history(void) {
    FILE *to = fopen(place("history.csv"), "w");
    fputs("step,time,wave,external_work,front,gap,wall_output\n", to);
    for (int i = 0; i <= 2000; i++) {
        double t = 0.005 * i;
        fprintf(to, "%d,%.17g,%.17g,%.17g,%.17g,%.17g,0\n", i, t, 3 + 0.5 * sin(2 * M_PI * t / 1.7 + 0.4), 4 - 2.5 * t,
                t * t, t < 5 ? NAN : t);
    }
    fputs("2001,10.0", to);
    fclose(to);
}

static silt_check_def check_of(const char *name, const char *column) {
    return (silt_check_def){.name = (char *)(uintptr_t)name,
                            .column = (char *)(uintptr_t)column,
                            .time_scale = 1,
                            .scale = 1,
                            .align = NAN,
                            .kind = CHECK_COLUMN,
                            .place_scale = 1,
                            .at = NAN,
                            .level = NAN,
                            .window = {-HUGE_VAL, HUGE_VAL},
                            .window_value = {-HUGE_VAL, HUGE_VAL},
                            .norm = NORM_L2,
                            .low = NAN,
                            .high = NAN,
                            .tolerance = 1e-3};
}

static silt_check_result measure(silt_check_def *def) {
    silt_scene scene = {.n_check = 1, .check = def, .folder = folder};
    silt_check_result result = {0};
    silt_error err = {0};
    assert_int_equal(silt_check_measure(&scene, folder, &result, &err), SILT_OK);
    return result;
}

static silt_check_result scalar(const char *column, silt_scalar kind, double low, double high, double value) {
    silt_check_def def = check_of("scalar", column);
    def.scalar = kind;
    def.window[0] = low;
    def.window[1] = high;
    def.value = value;
    return measure(&def);
}

static void test_checks_scalar(void **state) {
    (void)state;
    checks_history();
    silt_check_result r = scalar("wave", SCALAR_PERIOD, 0, 10, 1.7);
    assert_true(r.pass);
    near(r.value, 1.7, 1e-3 * 1.7);
    near(scalar("wave", SCALAR_PERIOD, 2, 8, 1.7).value, 1.7, 1e-3 * 1.7);
    near(scalar("external_work", SCALAR_SLOPE, 1, 9, -2.5).value, -2.5, 1e-12);
    near(scalar("wave", SCALAR_MAX, 0, 10, 3.5).value, 3.5, 1e-4);
    near(scalar("wave", SCALAR_MIN, 0, 10, 2.5).value, 2.5, 1e-4);
    near(scalar("external_work", SCALAR_LAST, -HUGE_VAL, HUGE_VAL, -21).value, -21, 1e-12);
    near(scalar("external_work", SCALAR_LAST, 0, 2, -1).value, -1, 1e-12);
    near(scalar("front", SCALAR_MEAN, 0, 3, 3).value, 3, 1e-4);
    near(scalar("gap", SCALAR_MIN, -HUGE_VAL, HUGE_VAL, 5).value, 5, 1e-12);

    // relative to the value, absolute when that is 0
    r = scalar("external_work", SCALAR_LAST, 0, 2, -1.25);
    near(r.error, 0.2, 1e-12);
    assert_false(r.pass);
    near(scalar("external_work", SCALAR_LAST, 0, 2, 0).error, 1, 1e-12);

    // the value at an abscissa, between two rows; half of the swing
    silt_check_def def = check_of("at", "front");
    def.scalar = SCALAR_AT;
    def.at = 2.0025;
    def.value = 0.5 * (silt_square(2) + silt_square(2.005));
    near(measure(&def).error, 0, 1e-12);
    def.at = 11;
    r = measure(&def);
    assert_false(r.pass);
    contains(r.note, "no value at 11");
    near(scalar("wave", SCALAR_AMPLITUDE, 0, 10, 0.5).value, 0.5, 1e-4);

    // when it is reached: upwards, downwards, out of a gap, never
    def = check_of("reaches", "front");
    def.scalar = SCALAR_REACHES;
    def.level = 6.25;
    near(measure(&def).value, 2.5, 1e-6);
    def.column = (char *)(uintptr_t) "external_work";
    def.level = -1.006;
    near(measure(&def).value, 2.0024, 1e-12);
    def.column = (char *)(uintptr_t) "gap";
    def.level = 1;
    near(measure(&def).value, 5, 1e-12);
    def.level = 5.5025;
    near(measure(&def).value, 5.5025, 1e-12);
    def.level = 77;
    r = measure(&def);
    assert_false(r.pass);
    contains(r.note, "77 is never reached");

    // crossings of a level instead of the mean
    def = check_of("period", "wave");
    def.scalar = SCALAR_PERIOD;
    def.level = 3;
    near(measure(&def).value, 1.7, 1e-5);

    // a range
    def = check_of("range", "external_work");
    def.scalar = SCALAR_LAST;
    def.low = -22;
    def.high = -20;
    r = measure(&def);
    assert_true(r.pass);
    def.low = -20;
    def.high = NAN;
    r = measure(&def);
    near(r.error, 1, 1e-12);
    assert_false(r.pass);

    // scaled abscissa and ordinate: 2 (t + 1) and -3 (y + 5); only ordinates below 0
    def = check_of("scaled", "external_work");
    def.scalar = SCALAR_MAX;
    def.time_scale = 2;
    def.time_shift = 1;
    def.scale = -3;
    def.shift = 5;
    def.window[0] = 4;
    def.window[1] = 12;
    def.window_value[1] = 0;
    def.value = 0;
    r = measure(&def);
    near(r.value, -3 * (4 - 2.5 * 3.6 + 5), 1e-12);

    // nothing in the window, too short a run, no such column
    r = scalar("wave", SCALAR_MEAN, 11, 12, 3);
    assert_false(r.pass);
    contains(r.note, "no data in the window");
    r = scalar("gap", SCALAR_MAX, 0, 4, 0);
    assert_false(r.pass);
    contains(r.note, "no data in the window");
    r = scalar("wave", SCALAR_MAX, 0, 20, 3.5);
    assert_false(r.pass);
    contains(r.note, "the result ends at 10, before the window's end 20");
    r = scalar("wave", SCALAR_PERIOD, 0, 1, 1.7);
    assert_false(r.pass);
    contains(r.note, "fewer than two upward crossings");
    r = scalar("absent", SCALAR_MAX, 0, 1, 1);
    assert_false(r.pass);
    contains(r.note, "no column absent");
}

// an oscillation that falls as exp(-0.3 t) about 2
static void test_checks_decay(void **state) {
    (void)state;
    FILE *to = fopen(place("history.csv"), "w");
    fputs("step,time,fall,still\n", to);
    for (int i = 0; i <= 4000; i++) {
        double t = 0.0025 * i;
        fprintf(to, "%d,%.17g,%.17g,2\n", i, t, 2 + 0.1 * exp(-0.3 * t) * cos(2 * M_PI * t / 1.1));
    }
    fclose(to);
    near(scalar("fall", SCALAR_DECAY, 0, 10, 0.3).value, 0.3, 1e-4);
    near(scalar("fall", SCALAR_DECAY, 1.3, 7.7, 0.3).value, 0.3, 1e-4);
    silt_check_def def = check_of("scaled", "fall");
    def.scalar = SCALAR_DECAY;
    def.time_scale = 2;
    def.scale = -7;
    near(measure(&def).value, 0.15, 1e-4);
    silt_check_result r = scalar("still", SCALAR_DECAY, 0, 10, 0);
    assert_false(r.pass);
    contains(r.note, "fewer than three half waves");
    r = scalar("fall", SCALAR_DECAY, 0, 1, 0.3);
    assert_false(r.pass);
}

static void test_checks_curve(void **state) {
    (void)state;
    checks_history();
    // rows of two runs and a column of words; run 1 is 4 - 2.5 t with errors 0.1, 0.1 and 0.2
    make("line.csv", "# a comment\nwho,run,t,y\nme,1,0.1025,3.84375\nme,1,1,1.6\nme,1,2,-1.2\nme,2,1,99\n");
    silt_check_def def = check_of("line", "external_work");
    def.reference = (char *)(uintptr_t) "line.csv";
    def.x = (char *)(uintptr_t) "t";
    def.y = (char *)(uintptr_t) "y";
    def.where_column = (char *)(uintptr_t) "run";
    def.where_value = 1;
    def.norm = NORM_MAX;
    def.relative_to = 4;
    silt_check_result r = measure(&def);
    near(r.error, 0.05, 1e-12);
    near(r.value, -1, 1e-12);
    near(r.reference, -1.2, 0);
    contains(r.note, "3 rows of the reference");
    def.norm = NORM_L2;
    near(measure(&def).error, sqrt((0.01 + 0.01 + 0.04) / 3) / 4, 1e-12);
    // pointwise relative, in windows of the abscissa and of the ordinate
    def.relative_to = 0;
    def.norm = NORM_MAX;
    def.window[1] = 1.5;
    near(measure(&def).error, 0.1 / 1.6, 1e-12);
    def.window_value[0] = 2;
    near(measure(&def).error, 0.1 / 3.84375, 1e-12);
    def.tolerance = 0.03;
    assert_true(measure(&def).pass);
    def.window[0] = 1.2;
    r = measure(&def);
    assert_false(r.pass);
    contains(r.note, "no data: 0 rows of the reference are in the window");

    // t^2 against the same curve 0.75 s later: aligned where both are 4
    make("front.csv", "t,x\n1.75,1\n2.75,4\n3.75,9\n5.75,25\n12,126.5625\n");
    def = check_of("front", "front");
    def.reference = (char *)(uintptr_t) "front.csv";
    def.x = (char *)(uintptr_t) "t";
    def.y = (char *)(uintptr_t) "x";
    assert_false(measure(&def).pass);
    def.align = 4;
    r = measure(&def);
    near(r.error, 0, 1e-5);
    assert_true(r.pass);
    contains(r.note, "4 of 5 rows of the reference");
    // a window that the run does not reach
    def.window[1] = 13;
    r = measure(&def);
    assert_false(r.pass);
    contains(r.note, "1 rows of the reference in the window come later");
    def.align = 1000;
    r = measure(&def);
    assert_false(r.pass);
    contains(r.note, "the result never reaches 1000");

    // gaps of the gauge are no data
    make("gap.csv", "t,y\n1,1\n2,2\n6,6\n");
    def = check_of("gap", "gap");
    def.reference = (char *)(uintptr_t) "gap.csv";
    def.x = (char *)(uintptr_t) "t";
    def.y = (char *)(uintptr_t) "y";
    r = measure(&def);
    near(r.error, 0, 1e-12);
    contains(r.note, "1 of 3 rows");
    def.y = (char *)(uintptr_t) "z";
    r = measure(&def);
    assert_false(r.pass);
    contains(r.note, "has no column z");
    def.reference = (char *)(uintptr_t) "nowhere.csv";
    r = measure(&def);
    assert_false(r.pass);
    contains(r.note, "nowhere.csv");
}

// ---------------------------------------------------------------- keys

// gauges and checks of every kind are read, written back and read to the same
static void test_keys(void **state) {
    (void)state;
    silt_error err = {0};
    silt_scene *scene = NULL, *again = NULL;
    make("curve.csv", "t,x\n1,1\n2,4\n");
    make("keys.yaml",
         "silt: 1\n"
         "time: {end: 10, output: 0.25}\n"
         "gravity: [0, -9.81]\n"
         "fluid: {density: 1000, viscosity: 0.001, size: 0.1, regions: [{box: [[0, 0], [1, 1]]}]}\n"
         "walls: [{polyline: [[0, 2], [0, 0], [4, 0], [4, 2]]}]\n"
         "gauges:\n"
         "  - {name: wide, extent: x}\n"
         "  - {name: push, force_on: 0}\n"
         "  - {name: turn, angular_momentum_about: [0.5, 0.25]}\n"
         "  - {name: middle, centroid_of: water}\n"
         "checks:\n"
         "  - {name: at, column: wide, scalar: at, at: 2, value: 1, tolerance: 0.1}\n"
         "  - {name: arrives, column: push_x, scalar: reaches, level: 5, range: [0, 1]}\n"
         "  - {name: period, gauge: turn, scalar: period, level: 0.5, range: [0, 1]}\n"
         "  - {name: decay, column: middle_y, scalar: decay, value: 1, tolerance: 0.1}\n"
         "  - {name: line, profile: velocity_x, at: 3, line: [[1, 0], [1, 2]], place_scale: 2, place_shift: -1,\n"
         "     scale: 4, shift: 1, reference: curve.csv, tolerance: 0.1}\n"
         "  - {name: surface, profile: surface, at: 0, reference: curve.csv, tolerance: 0.1}\n");
    if (silt_scene_read(place("keys.yaml"), 0, NULL, &scene, &err))
        fail_msg("%s", err.text);
    const silt_gauge_def *g = scene->gauge;
    const silt_check_def *c = scene->check;
    assert_true(g[0].kind == GAUGE_EXTENT && g[0].from[0] == 0 && g[1].kind == GAUGE_FORCE && g[1].index == 0);
    assert_true(g[2].kind == GAUGE_ANGULAR && g[2].from[1] == 0.25 && g[3].kind == GAUGE_CENTROID);
    assert_int_equal(silt_gauges_count(scene), 1 + 3 + 1 + 3);
    assert_true(c[0].kind == CHECK_COLUMN && c[0].scalar == SCALAR_AT && c[0].at == 2 && isnan(c[0].level));
    assert_true(c[1].level == 5 && isnan(c[1].at) && c[2].level == 0.5);
    assert_true(c[4].kind == CHECK_PROFILE && c[4].profile == PROFILE_VELOCITY_X && c[4].at == 3 && !c[4].column);
    assert_true(c[4].line[0] == 1 && c[4].line[4] == 2 && c[4].place_scale == 2 && c[4].place_shift == -1);
    assert_true(c[4].scale == 4 && c[4].shift == 1 && c[5].profile == PROFILE_SURFACE && c[5].place_scale == 1);
    assert_string_equal(c[4].y, "x");
    make("again.yaml", scene->resolved);
    if (silt_scene_read(place("again.yaml"), 0, NULL, &again, &err))
        fail_msg("%s", err.text);
    assert_string_equal(again->resolved, scene->resolved);
    assert_memory_equal(again->check[4].line, c[4].line, sizeof c[4].line);
    assert_true(again->check[5].kind == CHECK_PROFILE && again->check[5].at == 0);
    silt_scene_free(&scene);
    silt_scene_free(&again);
}

// every file that a scene reads goes with it; files of one name, and names that a run needs, get a number
static void test_copies(void **state) {
    (void)state;
    silt_error err = {0};
    silt_scene *scene = NULL, *again = NULL;
    mkdir(place("far"), 0777);
    mkdir(place("far/below"), 0777);
    mkdir(place("far.out"), 0777);
    make("far/gate.csv", "time,y\n0,0\n1,2\n");
    make("far/below/gate.csv", "x,y\n0,0\n1,0\n1,1\n0,1\n");
    make("far/history.csv", "t,x\n1,1\n2,4\n");
    make("far/scene.yaml",
         "silt: 1\n"
         "time: {end: 10, output: 0.25}\n"
         "gravity: [0, -9.81]\n"
         "fluid: {density: 1000, viscosity: 0.001, size: 0.1, regions: [{outline: below/gate.csv}]}\n"
         "walls: [{polyline: [[0, 2], [0, 0], [4, 0], [4, 2]]}, {polyline: [[1, 0], [1, 2]], motion: gate.csv}]\n"
         "checks:\n"
         "  - {name: a, column: time, reference: history.csv, tolerance: 0.1}\n"
         "  - {name: b, profile: surface, at: 1, reference: history.csv, tolerance: 0.1}\n");
    if (silt_scene_read(place("far/scene.yaml"), 0, NULL, &scene, &err))
        fail_msg("%s", err.text);
    if (silt_verify_copy(scene, place("far.out"), &err))
        fail_msg("%s", err.text);
    char command[1400];
    snprintf(command, sizeof command, "rm -r '%s'", place("far"));
    assert_int_equal(system(command), 0);
    if (silt_scene_read(place("far.out/scene.yaml"), 0, NULL, &again, &err))
        fail_msg("%s", err.text);
    assert_true(again->wall[1].motion.n_row == 2 && again->fluid.region[0].n_point == 4);
    assert_string_equal(content("far.out/2_history.csv"), "t,x\n1,1\n2,4\n");
    assert_true(exists("far.out/gate.csv") && exists("far.out/1_gate.csv") && !exists("far.out/history.csv"));
    assert_string_equal(again->check[0].reference, again->check[1].reference);
    // and again from there, onto themselves
    assert_int_equal(silt_verify_copy(again, place("far.out"), &err), SILT_OK);
    assert_string_equal(content("far.out/2_history.csv"), "t,x\n1,1\n2,4\n");
    silt_scene_free(&scene);
    silt_scene_free(&again);
}

// ---------------------------------------------------------------- verify, summary, info

static void test_verify(void **state) {
    (void)state;
    silt_error err = {0};
    silt_scene *scene = NULL;
    mkdir(place("scene"), 0777);
    mkdir(place("scene.out"), 0777);
    make("scene/scene.yaml", SCENE);
    make("scene/curve.csv", "t,x\n1,1\n2,4\n");
    if (silt_scene_read(place("scene/scene.yaml"), 0, NULL, &scene, &err))
        fail_msg("%s", err.text);
    assert_int_equal(silt_verify_copy(scene, place("scene.out"), &err), SILT_OK);
    assert_string_equal(content("scene.out/curve.csv"), "t,x\n1,1\n2,4\n");
    // OUT names the copy, which alone is enough
    contains(content("scene.out/scene.yaml"), "reference: \"curve.csv\"\n");
    assert_int_equal(unlink(place("scene/curve.csv")), 0);
    checks_history();
    assert_int_equal(rename(place("history.csv"), place("scene.out/history.csv")), 0);
    FILE *to = fopen(place("verify.txt"), "w");
    assert_int_equal(silt_verify(place("scene.out"), to, &err), SILT_OK);
    fclose(to);
    contains(content("verify.txt"),
             "line                                -21            -21           0        0.01  pass");
    contains(content("verify.txt"), "pass (2 rows of the reference)");

    // one wrong, one unmeasurable
    make("scene.out/curve.csv", "t,x\n1,1\n2,5\n");
    to = fopen(place("verify.txt"), "w");
    assert_int_equal(silt_verify(place("scene.out"), to, &err), SILT_FAILED);
    fclose(to);
    contains(content("verify.txt"), "FAIL");
    contains(err.text, "1 of 2 checks failed");

    // the summary has the same checks
    const silt_nodes nodes = {.count = 8};
    const silt_view view = {.scene = scene, .nodes = &nodes, .step = 2000, .time = 10};
    scene->title[0] = '"';
    silt_summary summary = {
        .status = "done", .seconds = 2, .node_steps = 1e5, .worst_volume_error = 1e-4, .steps = 2000};
    summary.phase[PHASE_solve] = 1;
    assert_int_equal(silt_summary_write(place("scene.out"), &view, &summary, &err), SILT_OK);
    contains(content("scene.out/summary.json"), "\"title\": \"\\\" small world\"");
    contains(content("scene.out/summary.json"), "\"microseconds_per_node_step\": 20,");
    contains(content("scene.out/summary.json"), "\"solve\": {\"seconds\": 1, \"microseconds_per_node_step\": 10}");
    contains(content("scene.out/summary.json"),
             "{\"name\": \"line\", \"value\": -21, \"reference\": -21, \"error\": 0,");
    contains(content("scene.out/summary.json"), "\"pass\": false, \"note\": \"2 rows of the reference\"}");

    to = fopen(place("info.txt"), "w");
    assert_int_equal(silt_info(place("scene.out"), to, &err), SILT_OK);
    assert_int_equal(silt_info(place("scene/scene.yaml"), to, &err), SILT_INPUT); // its reference is gone
    assert_int_equal(silt_info(place("scene.out/scene.yaml"), to, &err), SILT_OK);
    assert_int_equal(silt_info(place("scene"), to, &err), SILT_INPUT);
    fclose(to);
    contains(content("info.txt"), "\" small world\n  status     done");
    contains(content("info.txt"), "reached    10 of 10 s in 2000 steps");
    contains(content("info.txt"), "checks     1 of 2 pass");
    silt_scene_free(&scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_checks_scalar), cmocka_unit_test(test_checks_decay), cmocka_unit_test(test_checks_curve),
        cmocka_unit_test(test_keys),          cmocka_unit_test(test_copies),       cmocka_unit_test(test_verify),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
