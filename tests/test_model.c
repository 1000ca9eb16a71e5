// what silt info says about the model that a scene uses, what it warns about, which files it takes along
#include "output.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <unistd.h>

#include <cmocka.h>

#define RIGHT SILT_SOURCE "/tests/right/"

// what silt info prints holds all of these
static void info_says(const char *path, int n, const char *const *part) {
    char *text = NULL;
    size_t size = 0;
    silt_error err = {0};
    FILE *to = open_memstream(&text, &size);
    assert_int_equal(silt_info(path, to, &err), SILT_OK);
    fclose(to);
    for (int i = 0; i < n; i++)
        if (!strstr(text, part[i]))
            fail_msg("not said: %s\n%s", part[i], text);
    free(text);
}

static void test_info(void **state) {
    (void)state;
    static const char *const plane[] = {
        "two dimensions, y up",
        "laminar, no turbulence model, Herschel-Bulkley with 30 Pa and index 0.5, smoothed below 0.01 1/s",
        "implicit, theta 1\n",
        "2 walls no-slip, 0 slip, 1 wall law (1 rough; sampled 1.5 h off), 1 of them moving",
        "0.1 m near the surface; least 0.02 m, growing by 0.2 per distance",
        "velocity: field",
        "body force: series",
        "closed pockets, 101325 Pa when they close, exponent 1",
        "in x from 0 to 6 m"};
    static const char *const space[] = {"three dimensions, z up", "m3: about", "turbulent, WALE, Newtonian",
                                        "body force: central"};
    static const char *const whole[] = {"turbulent, mixing length, Newtonian",
                                        "fractional step, theta 0.5 (second order)"};
    info_says(RIGHT "water.yaml", 9, plane);
    info_says(RIGHT "space.yaml", 4, space);
    info_says(RIGHT "whole.yaml", 2, whole);
}

// how many warnings a scene of water in a box gives, and what is in them
static void warns(int n_set, const char *const *set, int count, const char *part) {
    char path[] = SILT_BINARY "/test_model_XXXXXX";
    const int file = mkstemp(path);
    static const char scene_text[] =
        "silt: 1\ntime: {end: 1, output: 0.1}\ngravity: [0, -9.81]\n"
        "fluid: {density: 1000, viscosity: 0.001, size: 0.1, regions: [{box: [[0, 0], [1, 1]]}]}\n"
        "walls: [{box: [[0, 0], [2, 2]]}]\n";
    assert_true(write(file, scene_text, sizeof scene_text - 1) == sizeof scene_text - 1);
    close(file);
    silt_error err = {0};
    silt_scene *scene = NULL;
    if (silt_scene_read(path, n_set, set, &scene, &err))
        fail_msg("%s", err.text);
    unlink(path);
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    const int n = silt_scene_warn(scene, to);
    fclose(to);
    if (n != count || !strstr(text, part))
        fail_msg("%d warnings, not %d, or not among them: %s\n%s", n, count, part, text);
    free(text);
    silt_scene_free(&scene);
}

static void test_warn(void **state) {
    (void)state;
    warns(0, NULL, 0, "");
    warns(1, (const char *[]){"fluid.viscosity=0"}, 1, "1 smooth walls have the wall law");
    warns(2, (const char *[]){"fluid.rheology=bingham", "fluid.yield_stress=5"}, 1, "flow: laminar");
    warns(3, (const char *[]){"fluid.rheology=bingham", "fluid.yield_stress=5", "fluid.flow=laminar"}, 0, "");
    warns(1, (const char *[]){"fluid.turbulence=spalart-allmaras"}, 0, "");
    warns(2, (const char *[]){"fluid.turbulence=spalart-allmaras", "fluid.viscosity=0"}, 2, "makes eddies of eddies");
    warns(1, (const char *[]){"fluid.turbulence=wale"}, 1, "three-dimensional eddies");
    warns(2, (const char *[]){"walls.0.velocity=[1, 0]", "walls.0.condition=slip"}, 1,
          "which does not reach the water");
    warns(1, (const char *[]){"fluid.shuffle=0.1"}, 1, "a test");
    warns(1, (const char *[]){"periodic=[0, 2]"}, 0, "");
    warns(2, (const char *[]){"periodic=[0, 2]", "fluid.outlets=[{name: o, from: [2, 0], to: [2, 1]}]"}, 1,
          "periodic for water and grains alone");
}

// an output folder holds all that its scene reads, each file once
static void test_copies(void **state) {
    (void)state;
    static const char *const name[] = {"water.yaml", "space.yaml", "whole.yaml"};
    static const int files[] = {7, 5, 3}, copies[] = {6, 5, 3};
    for (int i = 0; i < 3; i++) {
        char path[4096], out[] = SILT_BINARY "/test_model_XXXXXX", command[4096];
        silt_error err = {0};
        silt_scene *scene = NULL, *again = NULL;
        const char **file = NULL;
        assert_non_null(mkdtemp(out));
        snprintf(path, sizeof path, RIGHT "%s", name[i]);
        assert_int_equal(silt_scene_read(path, 0, NULL, &scene, &err), SILT_OK);
        assert_int_equal(silt_verify_copy(scene, out, &err), SILT_OK);
        snprintf(path, sizeof path, "%s/scene.yaml", out);
        if (silt_scene_read(path, 0, NULL, &again, &err))
            fail_msg("%s", err.text);
        assert_true(again->hash == scene->hash);
        const int n = silt_scene_files(again, &file);
        assert_int_equal(n, files[i]);
        int different = 0;
        for (int k = 0; k < n; k++) {
            bool known = false;
            for (int m = 0; m < k; m++)
                known |= strcmp(file[m], file[k]) == 0;
            different += !known;
            assert_true(strncmp(file[k], out, strlen(out)) == 0);
        }
        assert_int_equal(different, copies[i]);
        free(file);
        silt_scene_free(&scene);
        silt_scene_free(&again);
        snprintf(command, sizeof command, "rm -rf '%s'", out);
        assert_int_equal(system(command), 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_info), cmocka_unit_test(test_warn),
                                       cmocka_unit_test(test_copies)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
