// Clocks count whole frames: a run that begins after a year, 3.15e7 s, goes on for 1e4 steps with the bits of one that
// begins at 0, and its time is off by no step's rounding.

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "check.h"
#include "run.h"
#include "scene_text.h"

#define OUTPUT 100.0
#define YEAR   315000 // frames of OUTPUT
#define STEPS  10000

// into a place where it stays: a run has pointers to itself
static void began(silt_run *run, const silt_scene *scene, const char *folder, int64_t frame) {
    static const silt_run_def def = {.quiet = true, .threads = 1, .worker = SILT_BINARY "/silt-dem"};
    OK(silt_run_open(run, scene, &def, folder, -1, &error));
    run->frame = frame;
    run->time = (double)frame * scene->time.output;
}

static void closed(silt_run *run, char *folder) {
    silt_run_free(run);
    silt_folder_remove(folder);
}

// the same bits after a year
static void same_after_a_year(const char *text, int steps, double least) {
    char here[] = "/tmp/silt-clock-XXXXXX", there[] = "/tmp/silt-clock-XXXXXX";
    silt_scene *scene = scene_of(text);
    assert_true(mkdtemp(here) && mkdtemp(there));
    silt_run a, b;
    began(&a, scene, here, 0);
    began(&b, scene, there, YEAR);
    for (int k = 0; k < steps; k++) {
        OK(silt_run_advance(&a, &error));
        OK(silt_run_advance(&b, &error));
        if (a.dt != b.dt || a.offset != b.offset || b.frame != a.frame + YEAR)
            fail_msg("step %d: dt %.17g and %.17g, %.17g and %.17g into frames %lld and %lld", k + 1, a.dt, b.dt,
                     a.offset, b.offset, (long long)a.frame, (long long)b.frame);
    }
    const size_t n = (size_t)silt_nodes_dim(&a.nodes) * (size_t)a.nodes.count * sizeof(double);
    assert_int_equal(a.nodes.count, b.nodes.count);
    assert_memory_equal(a.nodes.x, b.nodes.x, n);
    assert_memory_equal(a.nodes.v, b.nodes.v, n);
    // a unit of the last place at 3.15e7
    near(b.time - YEAR * OUTPUT, a.time, 3.8e-9, "time after a year");
    assert_true(a.time > least);
    closed(&a, here);
    closed(&b, there);
    silt_scene_free(&scene);
}

static void test_water(void **state) {
    (void)state;
    same_after_a_year(
        "silt: 1\ntime: {end: 9.0e+7, output: 100, step: 0.0005, checkpoint: 1.0e+7}\ngravity: [0.5, -9.81]\n"
        "fluid: {density: 1000, viscosity: 0.01, flow: laminar, size: 0.1, regions: [{box: [[0, 0], [0.2, 0.2]]}]}\n"
        "walls: [{polyline: [[0, 1], [0, 0], [0.2, 0], [0.2, 1]], condition: slip}]\n",
        STEPS, 4.9);
}

static void test_grains(void **state) {
    (void)state;
    same_after_a_year(
        "silt: 1\ntime: {end: 9.0e+7, output: 100, step: 0.005, checkpoint: 1.0e+7}\ngravity: [0, -9.81]\n"
        "fluid: {density: 1000, viscosity: 0.01, flow: laminar, size: 0.1, regions: [{box: [[0, 0], [0.3, 0.3]]}]}\n"
        "walls: [{polyline: [[0, 1], [0, 0], [0.3, 0], [0.3, 1]], condition: slip}]\n"
        "grains: {list: [{at: [0.1, 0.2], diameter: 0.05, density: 2650}, {at: [0.2, 0.2], diameter: 0.05, density: "
        "2650}]}\n"
        "contact: {youngs_modulus: 5.0e6, poissons_ratio: 0.3, restitution: 0.3, friction: 0.6, rolling_friction: "
        "0.2}\n",
        200, 0.9);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_water), cmocka_unit_test(test_grains)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
