// The C interface as another program uses it: two runs in one process, stepped in turn, are the runs that they are alone.
// Linked with libsilt, sees nothing but include/silt.

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <string.h>
#include <silt/silt.h>
#include <stdlib.h>

static silt_error error;
#define OK(call)                                                                                                       \
    do {                                                                                                               \
        if ((call) != SILT_OK)                                                                                         \
            fail_msg("%s", error.text);                                                                                \
    } while (0)

static const char *const water = SILT_SOURCE "/cases/dam-break/scene.yaml";
static const char *const coarse[] = {"fluid.size=0.006", "time.steps=25"};
static const char *const hill = SILT_SOURCE "/tests/scenes/coupled-body.yaml";
static const char *const few[] = {"time.steps=15"};

static silt_run_def in(const char *out) {
    return (silt_run_def){.out = out, .worker = SILT_BINARY "/silt-dem", .threads = 1, .force = true, .quiet = true};
}

/** what is left of a run: numbers that hang on every bit of it */
typedef struct trace {
    double energy, momentum, front;
    int64_t step, n_node, n_grain, n_body; // no holes: compared byte by byte
} trace;

static trace look(silt_run *run) {
    silt_fields f;
    silt_run_fields(run, &f);
    trace t = {.energy = silt_run_value(run, "kinetic_energy"), .momentum = silt_run_value(run, "momentum_x"), .step = f.step,
               .n_node = f.n_node, .n_grain = f.n_grain, .n_body = f.n_body};
    for (int i = 0; i < f.n_node; i++)
        t.front = fmax(t.front, f.x[f.dim * i]);
    return t;
}

static void step(silt_run *run) {
    if (!silt_run_ended(run))
        OK(silt_run_advance(run, &error));
}

static trace alone(const char *path, int n_set, const char *const *set, const char *out) {
    silt_scene *scene = NULL;
    silt_run *run;
    OK(silt_scene_read(path, n_set, set, &scene, &error));
    const silt_run_def def = in(out);
    OK(silt_run_start(&run, scene, &def, &error));
    while (!silt_run_ended(run))
        step(run);
    const trace t = look(run);
    OK(silt_run_finish(&run, SILT_OK, &error));
    assert_null(run);
    silt_scene_free(&scene);
    assert_null(scene);
    return t;
}

static void two_at_once(void **state) {
    (void)state;
    const trace first = alone(water, 2, coarse, SILT_BINARY "/tests/embed-1.out"), second = alone(hill, 1, few, SILT_BINARY "/tests/embed-2.out");
    assert_true(first.n_node > 100 && first.step == 25 && first.energy > 0 && first.n_body == 0);
    assert_true(second.n_body == 1 && second.step == 15);

    silt_scene *scene[2] = {NULL};
    silt_run *run[2];
    OK(silt_scene_read(water, 2, coarse, &scene[0], &error));
    OK(silt_scene_read(hill, 1, few, &scene[1], &error));
    const silt_run_def def[2] = {in(SILT_BINARY "/tests/embed-3.out"), in(SILT_BINARY "/tests/embed-4.out")};
    for (int k = 0; k < 2; k++)
        OK(silt_run_start(&run[k], scene[k], &def[k], &error));
    while (!silt_run_ended(run[0]) || !silt_run_ended(run[1]))
        for (int k = 0; k < 2; k++)
            step(run[k]);
    const trace t[2] = {look(run[0]), look(run[1])};
    assert_memory_equal(&t[0], &first, sizeof first);
    assert_memory_equal(&t[1], &second, sizeof second);

    silt_pose pose;
    assert_true(silt_run_body(run[1], "block", &pose));
    assert_true(pose.x[0] == silt_run_value(run[1], "block_x") && pose.v[1] == silt_run_value(run[1], "block_vy"));
    assert_false(silt_run_body(run[0], "block", &pose));
    assert_true(isnan(silt_run_value(run[0], "no_such_column")));
    for (int k = 0; k < 2; k++) {
        OK(silt_run_finish(&run[k], SILT_OK, &error));
        silt_scene_free(&scene[k]);
    }
}

// ended in the middle and taken up again: the state of the run in one go
static void taken_up(void **state) {
    (void)state;
    const char *out = SILT_BINARY "/tests/embed-5.out", *set[] = {"fluid.size=0.006", "time.steps=10"};
    const trace whole = alone(water, 2, coarse, SILT_BINARY "/tests/embed-1.out");
    silt_scene *scene = NULL;
    silt_run *run;
    OK(silt_scene_read(water, 2, set, &scene, &error));
    silt_run_def def = in(out);
    OK(silt_run_start(&run, scene, &def, &error));
    while (!silt_run_ended(run))
        step(run);
    OK(silt_run_checkpoint(run, &error));
    OK(silt_run_finish(&run, SILT_OK, &error));
    silt_scene_free(&scene);
    OK(silt_run_take_up(&run, &def, &error));
    for (int k = 0; k < 15; k++)
        OK(silt_run_advance(run, &error));
    const trace t = look(run);
    assert_memory_equal(&t, &whole, sizeof t);
    OK(silt_run_finish(&run, SILT_OK, &error));
}

static void wrong(void **state) {
    (void)state;
    silt_scene *scene = NULL;
    silt_run *run;
    error = (silt_error){0};
    assert_int_equal(silt_scene_read(SILT_SOURCE "/tests/wrong/density_missing.yaml", 0, NULL, &scene, &error), SILT_INPUT);
    assert_null(scene);
    assert_true(error.count > 0 && *error.text);
    error = (silt_error){0};
    const silt_run_def def = in(SILT_BINARY "/tests/no-such.out");
    assert_int_equal(silt_run_take_up(&run, &def, &error), SILT_INPUT);
    assert_null(run);
    error = (silt_error){0};
    OK(silt_scene_read(water, 2, coarse, &scene, &error));
    const silt_run_def nowhere = in("/proc/no-such-folder/x");
    assert_int_equal(silt_run_start(&run, scene, &nowhere, &error), SILT_FAILED);
    assert_null(run);
    silt_scene_free(&scene);
    assert_string_equal(silt_version(), SILT_VERSION);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_at_once),
        cmocka_unit_test(taken_up),
        cmocka_unit_test(wrong),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
