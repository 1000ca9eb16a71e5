// the scene: right ones, wrong ones, broken ones; the resolved text; series, regions, formulas; the shop floor of
// base.h
#include "output.h"
#include "scene_keys.h"

#include <dirent.h>
#include <errno.h>
#include <setjmp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "scene_folder.h"

#define HEAD  "silt: 1\ntime: {end: 1, output: 0.1}\ngravity: [0, -9.81]\n"
#define WATER "fluid: {density: 1000, viscosity: 0.001, size: 0.1, regions: [{box: [[0, 0], [1, 1]]}]}\n"
#define RIGHT SILT_SOURCE "/tests/right/"
#define WRONG SILT_SOURCE "/tests/wrong/"

// wrong scenes -----------------------------------------------------------------------------------------
// the first line says which errors, all of them: "# expect: 4:12 fluid.density, 5:1 syntax"
static void test_wrong(void **state) {
    (void)state;
    DIR *dir = opendir(WRONG);
    assert_non_null(dir);
    int n_file = 0;
    for (struct dirent *entry; (entry = readdir(dir));) {
        size_t length = strlen(entry->d_name), size;
        if (length < 5 || strcmp(entry->d_name + length - 5, ".yaml") != 0)
            continue;
        char path[4200], line[1024] = "";
        snprintf(path, sizeof path, WRONG "%s", entry->d_name);
        char *text = slurp(path, &size);
        sscanf(text, "# expect: %1023[^\n]", line);
        free(text);
        int count = 0;
        bool other = false; // no word about what is allowed
        for (char *rest = line, *part; (part = strtok_r(rest, ",", &rest));) {
            char position[64], key[128], wanted[4600];
            assert_int_equal(sscanf(part, " %63s %127s", position, key), 2);
            bool bare = strcmp(key, "syntax") == 0;
            snprintf(wanted, sizeof wanted, bare ? "%s:%s: %s" : "%s:%s: key '%s': found ", path, position, key);
            wrong(path, 0, NULL, 0, wanted);
            other |= bare || strstr(entry->d_name, "unknown") || strcmp(entry->d_name, "several.yaml") == 0;
            count++;
        }
        if (count == 0)
            fail_msg("%s: says not what it expects", path);
        // that many and no more; each shows its line with a caret
        wrong(path, 0, NULL, count, "\n    ");
        if (!other)
            wrong(path, 0, NULL, count, "allowed");
        n_file++;
    }
    closedir(dir);
    assert_true(n_file >= 200);
    // the hint is of the kind that was asked for
    wrong(WRONG "check_gauge_column.yaml", 0, NULL, 1, "found 'max_speed', which is a column of history.csv and no gauge, allowed column: max_speed");
    static const char *const near_column[] = {"checks.0.gauge=max_sped"}, *const near_gauge[] = {"checks.0.gauge=h"};
    wrong(WRONG "check_gauge_column.yaml", 1, near_column, 1, "found 'max_sped', allowed a gauge of this scene\n");
    wrong(WRONG "check_gauge_column.yaml", 1, near_gauge, 1, "allowed a gauge of this scene; did you mean 'g'?");
}

static void test_broken_files(void **state) {
    (void)state;
    const char *path = make_text("empty.yaml", "");
    wrong(path, 0, NULL, 1, "empty.yaml:1:1: key 'silt': found an empty file, allowed");
    wrong(place("nowhere.yaml"), 0, NULL, 1, "nowhere.yaml:1:1: cannot be opened: No such file");
    wrong(folder, 0, NULL, 1, ":1:1: found a folder, allowed a YAML file");
    path = make("binary.yaml", "silt: 1\nti\0tle: x\n", 18);
    wrong(path, 0, NULL, 1, "binary.yaml:2:3: found a zero byte (a binary file?), allowed YAML text");
    path = make_text("latin.yaml", "silt: 1\ntitle: \xe4\n");
    wrong(path, 0, NULL, 1, "latin.yaml:2:8: found a byte that is not UTF-8");

    // too large
    size_t size = (8 << 20) + 1;
    char *text = silt_alloc(size, 1);
    memset(text, '#', size);
    wrong(make("huge.yaml", text, size), 0, NULL, 1, "huge.yaml:1:1: found more than 8 MB, allowed at most that");

    // too deep, in three ways
    memset(text, '[', 65);
    memset(text + 65, ']', 65);
    wrong(make("deep.yaml", text, 130), 0, NULL, 1, "deep.yaml:1:65: syntax: found more than 64 levels");
    memset(text, '[', 1 << 20);
    wrong(make("deeper.yaml", text, 1 << 20), 0, NULL, 1, "deeper.yaml:1:");
    size_t at = 0;
    for (int i = 0; i < 200; i++)
        at += (size_t)snprintf(text + at, size - at, "%*sa:\n", i, "");
    wrong(make("stairs.yaml", text, at), 0, NULL, 1, "levels, allowed at most that");

    // aliases of aliases: a billion values from a kilobyte
    at = (size_t)snprintf(text, size, "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n");
    for (int i = 1; i < 10; i++) {
        at += (size_t)snprintf(text + at, size - at, "a%d: &a%d [", i, i);
        for (int k = 0; k < 10; k++)
            at += (size_t)snprintf(text + at, size - at, "%s*a%d", k ? ", " : "", i - 1);
        at += (size_t)snprintf(text + at, size - at, "]\n");
    }
    wrong(make("bomb.yaml", text, at), 0, NULL, 1, "syntax: found more than 1000000 values, allowed at most that");
    // many values in the plain
    text[0] = '[';
    for (at = 1; at < 4000000; at += 2)
        memcpy(text + at, "1,", 2);
    wrong(make("flood.yaml", text, at), 0, NULL, 1, "syntax: found more than 1000000 values, allowed at most that");
    free(text);
}

// all errors at once, counted, as many shown as there is room for
static void test_many_errors(void **state) {
    (void)state;
    char text[16384] = HEAD WATER "gauges:\n";
    for (int i = 0; i < 70; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text), "  - {name: g%d, hight_at: 1}\n", i);
    silt_error err = {0};
    silt_scene *scene = NULL;
    const char *path = make_text("many.yaml", text);
    assert_int_equal(silt_scene_read(path, 0, NULL, &scene, &err), SILT_INPUT);
    assert_int_equal(err.count, 70);
    assert_non_null(strstr(err.text,
                           "many.yaml:6:16: key 'gauges.0.hight_at': found no such key, did you mean 'height_at'?\n"
                           "      - {name: g0, hight_at: 1}\n"
                           "                   ^\n"));
    int shown = 0, left = 0;
    for (const char *c = err.text; (c = strstr(c, "did you mean")); c++)
        shown++;
    assert_int_equal(sscanf(strstr(err.text, "\n... and "), "\n... and %d more errors", &left), 1);
    assert_int_equal(shown + left, 70);
    assert_true(shown >= 10 && strlen(err.text) < sizeof err.text);
    // without a place for the message, and freeing nothing
    assert_int_equal(silt_scene_read(path, 0, NULL, &scene, NULL), SILT_INPUT);
    silt_scene_free(&scene);
    silt_scene_free(NULL);
}

// right scenes -----------------------------------------------------------------------------------------
static void test_whole(void **state) {
    (void)state;
    silt_scene *s = right(RIGHT "whole.yaml", 0, NULL);
    assert_string_equal(s->title, "Everything: \"all\" at once, \303\251 and \t too");
    assert_int_equal(s->version, 1);
    assert_int_equal(s->dimension, 2);
    assert_true(s->time.end == 4 && s->time.output == 0.02 && s->time.step == 0.01 && s->time.cfl == 0.5);
    assert_true(s->time.checkpoint == 0 && s->time.steps == 1000000 && s->time.retries == 8);
    assert_true(s->gravity[0] == 0 && s->gravity[1] == -9.81 && s->gravity[2] == 0);
    const silt_fluid_def *f = &s->fluid;
    assert_true(f->on && f->density == 1000 && f->viscosity == 0.001 && f->size == 0.02);
    assert_true(f->scheme == SCHEME_FRACTIONAL && f->pressure == PRESSURE_CONSISTENT && f->theta == 0.5);
    assert_true(f->flow == FLOW_TURBULENT && f->turbulence == TURBULENCE_MIXING_LENGTH && f->wall_height == 2);
    assert_true(f->rheology == RHEOLOGY_NEWTONIAN && f->yield_stress == 0 && f->flow_index == 1 && f->order == 2);
    assert_true(f->plastic_rate == 1e-3 && f->shuffle == 0 && f->n_size == 0 && f->size_growth == 0.3 && !f->cloud);
    assert_true(f->air_pressure == 0 && f->air_exponent == 1.4 && f->surface_tension == 0 && f->force.kind == FORMULA_NONE);
    assert_true(s->period[0] == 0 && s->period[1] == 0 && f->outlet[0].level.n_row == 0 && f->inlet[0].head.n_row == 0);
    assert_true(f->alpha == 1.3 && f->merge == 0.3 && f->tolerance == 1e-6 && f->iterations == 12);
    assert_true(f->volume_control && f->volume_steps == 15 && f->volume_time == 0 && f->jitter == 0 && f->seed == 1);
    assert_int_equal(f->n_region, 3);
    assert_int_equal(f->region[0].kind, REGION_BOX);
    assert_true(f->region[0].hi[0] == 1 && f->region[0].hi[1] == 1);
    // given clockwise: turned over, the first corner stays
    assert_int_equal(f->region[1].kind, REGION_POLYGON);
    const double turned[12] = {2, 0, 0, 3, 0, 0, 3, 0.5, 0, 2, 0.5, 0};
    assert_memory_equal(f->region[1].point, turned, sizeof turned);
    assert_true(f->region[2].kind == REGION_CIRCLE && f->region[2].centre[0] == 4 && f->region[2].radius == 0.2);
    assert_true(f->n_inlet == 1 && f->n_outlet == 1 && f->inlet[0].velocity[0] == 1 && f->inlet[0].from[1] == 1);
    assert_true(f->inlet[0].series.n_row == 3 && silt_series_at(&f->inlet[0].series, 1, 2) == 0.75);
    assert_string_equal(f->outlet[0].name, "out");
    assert_true(f->velocity.kind == FORMULA_STANDING_WAVE && f->velocity.depth == 0.5 && f->velocity.centre[0] == 0);
    assert_int_equal(s->n_wall, 3);
    assert_true(!s->wall[0].closed && s->wall[0].condition == WALL_SLIP && s->wall[0].n_point == 3);
    const double outline[12] = {-1, -1, 0, 7, -1, 0, 7, 3, 0, -1, 3, 0};
    assert_true(s->wall[1].closed && s->wall[1].n_point == 4 && s->wall[1].condition == WALL_LAW);
    assert_true(s->wall[1].form == WALL_POLYLINE && s->wall[1].hi[0] < s->wall[1].lo[0] && !s->wall[1].motion.n_row);
    assert_memory_equal(s->wall[1].point, outline, sizeof outline);
    assert_true(s->wall[2].closed && s->wall[2].n_point == 3);
    const silt_bed_def *b = &s->bed;
    assert_true(b->on && b->density == 2650 && b->porosity == 0.4 && isinf(b->work) && b->law == BED_FRICTIONAL_WORK);
    assert_true(b->distance == 0.02 && b->size == 0.02 && b->layer == 0.02 && b->threshold == 0 && b->saturation == 1);
    assert_true(b->deposition && b->condition == WALL_NO_SLIP && b->n_region == 1);
    assert_true(silt_region_area(&b->region[0]) == 0.5);
    const silt_grains_def *g = &s->grains;
    assert_true(g->on && g->drag == DRAG_DI_FELICE && g->parcel == 0.03 && g->diameter == 0.03 && g->width == 0);
    assert_true(g->n_grain == 1 && g->grain[0].at[0] == 5 && g->grain[0].density == 2000);
    assert_true(s->contact.on && s->contact.body_friction == 0.45 && s->contact.step == 0.15);
    assert_int_equal(s->n_body, 4);
    assert_true(s->body[0].shape == SHAPE_TEMPLE && s->body[0].scale == 0.4 && s->body[0].motion == MOTION_FREE);
    assert_true(s->body[1].shape == SHAPE_BOX && s->body[1].height == 0.2 && s->body[1].angle == 30);
    assert_true(s->body[1].motion == MOTION_FIXED && s->body[3].shape == SHAPE_DISC);
    assert_true(s->body[2].n_point == 3 && silt_polygon_area(3, s->body[2].point) == 0.5);
    static const silt_gauge_kind kind[9] = {GAUGE_HEIGHT,   GAUGE_WETTED,    GAUGE_PRESSURE,
                                            GAUGE_VELOCITY, GAUGE_DISCHARGE, GAUGE_BED_LEVEL,
                                            GAUGE_SCOUR,    GAUGE_FRONT,     GAUGE_FRONT};
    assert_int_equal(s->n_gauge, 9);
    for (int i = 0; i < 9; i++)
        assert_int_equal(s->gauge[i].kind, kind[i]);
    assert_true(s->gauge[0].from[0] == 2 && s->gauge[4].to[1] == 2 && s->gauge[7].from[0] == 1 &&
                s->gauge[8].from[0] == -1);
    assert_int_equal(s->n_check, 3);
    const silt_check_def *c = s->check;
    assert_string_equal(c[0].column, "front");
    assert_string_equal(c[0].x, "t");
    assert_string_equal(c[0].y, "x");
    assert_string_equal(c[0].where_column, "run");
    assert_true(c[0].where_value == 2 && c[0].norm == NORM_MAX && c[0].tolerance == 0.05 && isnan(c[0].align));
    assert_true(c[0].time_scale == 1 && c[0].scale == 1 && isinf(c[0].window[0]) && isinf(c[0].window_value[1]));
    assert_true(c[0].reference[0] == '/' && isnan(c[0].low) && isnan(c[0].value) && c[0].scalar == SCALAR_NONE);
    assert_true(c[1].scalar == SCALAR_MAX && c[1].low == 0 && isinf(c[1].high) && c[1].window[1] == 2 &&
                !c[1].reference);
    assert_true(c[2].value == 0 && c[2].tolerance == 0.001 && isnan(c[2].low));
    assert_true(silt_scene_has_dem(s));
    silt_scene_free(&s);
    assert_null(s);

    s = right(RIGHT "dry.yaml", 0, NULL);
    assert_true(!s->fluid.on && !s->bed.on && !s->grains.on && s->contact.on && s->n_wall == 0 &&
                silt_scene_has_dem(s));
    silt_scene_free(&s);
}

// what the fluid and its walls can be besides, in the plane
static void test_water(void **state) {
    (void)state;
    silt_scene *s = right(RIGHT "water.yaml", 0, NULL);
    const silt_fluid_def *f = &s->fluid;
    assert_true(s->period[0] == 0 && s->period[1] == 6);
    assert_true(f->flow == FLOW_LAMINAR && f->turbulence == TURBULENCE_NONE && f->wall_height == 1.5);
    assert_true(f->rheology == RHEOLOGY_HERSCHEL_BULKLEY && f->yield_stress == 30 && f->flow_index == 0.5);
    assert_true(f->plastic_rate == 0.01 && f->order == 1 && f->theta == 1 && f->shuffle == 0.1);
    assert_true(f->size_growth == 0.2 && f->air_pressure == 101325 && f->air_exponent == 1 && f->cloud[0] == '/');
    assert_true(f->volume_time == 0.25);
    // the outline is given clockwise
    const double turned[12] = {2, 0, 0, 3, 0, 0, 3, 0.5, 0, 2, 0.5, 0};
    assert_true(f->region[1].kind == REGION_POLYGON && f->region[1].n_point == 4 && f->region[1].outline[0] == '/');
    assert_memory_equal(f->region[1].point, turned, sizeof turned);
    assert_true(f->n_size == 5 && f->size_at[0].near == NEAR_REGION && f->size_at[0].region.kind == REGION_BOX);
    assert_true(f->size_at[0].size == 0.02 && f->size_at[0].distance == 0 && f->size_at[1].distance == 0.1);
    assert_true(f->size_at[1].region.kind == REGION_CIRCLE && f->size_at[1].region.radius == 0.2);
    assert_true(f->size_at[2].region.n_point == 4 && f->size_at[3].near == NEAR_WALLS);
    assert_true(f->size_at[4].near == NEAR_SURFACE && f->size_at[4].region.kind == 0);
    assert_true(f->inlet[0].drive == INLET_HEAD && silt_series_at(&f->inlet[0].head, 1, 5) == 1.25);
    assert_true(silt_series_at(&f->outlet[0].level, 1, 3) == 0.4);
    double v[3];
    silt_formula_acceleration(&f->force, 0.25, (double[]){7, 8}, v);
    assert_true(v[0] == 0.5 && v[1] == 0.5 && v[2] == 0);
    // columns of the field stand in another order in the file
    silt_formula_velocity(&f->velocity, 9.81, (double[]){0.5, 0.25}, v);
    assert_true(fabs(v[0] - 0.5) < 1e-14 && fabs(v[1] - 3.5) < 1e-14 && v[2] == 0);
    assert_true(s->wall[0].condition == WALL_LAW && s->wall[1].condition == WALL_NO_SLIP &&
                s->wall[2].velocity[0] == 1);
    assert_true(s->wall[1].motion.n_row == 2 && silt_series_column(&s->wall[1].motion, "angle") == 1);
    assert_true(s->wall[1].pivot[1] == 2 && s->wall[1].form == WALL_POLYLINE);
    silt_scene_free(&s);

    // defaults that hang on other keys, and what they become in words
    static const struct {
        const char *set;
        silt_turbulence turbulence;
        double theta;
        silt_condition condition;
    } expected[] = {{"fluid.order=2", TURBULENCE_MIXING_LENGTH, 0.5, WALL_LAW},
                    {"fluid.order=1", TURBULENCE_MIXING_LENGTH, 1, WALL_LAW},
                    {"fluid.theta=0.7", TURBULENCE_MIXING_LENGTH, 0.7, WALL_LAW},
                    {"fluid.flow=laminar", TURBULENCE_NONE, 0.5, WALL_NO_SLIP},
                    {"fluid.turbulence=none", TURBULENCE_NONE, 0.5, WALL_LAW},
                    {"fluid.turbulence=smagorinsky", TURBULENCE_SMAGORINSKY, 0.5, WALL_LAW},
                    {"walls.0.condition=slip", TURBULENCE_MIXING_LENGTH, 0.5, WALL_SLIP}};
    const char *path = make_text("tank.yaml", HEAD WATER "walls: [{box: [[0, 0], [2, 2]]}]\n");
    for (int i = 0; i < (int)(sizeof expected / sizeof *expected); i++) {
        s = right(path, 1, &expected[i].set);
        assert_true(s->fluid.turbulence == expected[i].turbulence && s->fluid.theta == expected[i].theta);
        assert_int_equal(s->wall[0].condition, expected[i].condition);
        assert_null(strstr(s->resolved, "default"));
        assert_null(strstr(s->resolved, "auto"));
        silt_scene_free(&s);
    }
}

static void test_space(void **state) {
    (void)state;
    silt_scene *s = right(RIGHT "space.yaml", 0, NULL);
    const silt_fluid_def *f = &s->fluid;
    assert_true(s->dimension == 3 && s->gravity[2] == -9.81 && silt_scene_up(s) == 2 && s->period[1] == 3);
    assert_true(f->flow == FLOW_TURBULENT && f->turbulence == TURBULENCE_WALE && f->theta == 0.6);
    const silt_region *r = f->region;
    double lo[3], hi[3];
    for (int i = 0; i < 4; i++)
        assert_true(silt_region_space(&r[i]));
    assert_true(r[0].hi[2] == 0.55 && fabs(silt_region_area(&r[0]) - 0.55) < 1e-15);
    assert_true(silt_region_contains(&r[0], (double[]){0.5, 0.5, 0.5}) &&
                !silt_region_contains(&r[0], (double[]){0.5, 0.5, 0.6}));
    // a wedge
    assert_true(r[1].lo[1] == 0 && r[1].hi[1] == 1 && silt_region_area(&r[1]) == 0.25);
    assert_true(silt_region_contains(&r[1], (double[]){1.1, 0.9, 0.1}) &&
                !silt_region_contains(&r[1], (double[]){1.9, 0.9, 0.1}) &&
                !silt_region_contains(&r[1], (double[]){1.1, 1.1, 0.1}));
    silt_region_bounds(&r[1], lo, hi);
    assert_true(lo[0] == 1 && lo[1] == 0 && lo[2] == 0 && hi[0] == 2 && hi[1] == 1 && hi[2] == 0.5);
    assert_true(r[2].kind == REGION_SPHERE && fabs(silt_region_area(&r[2]) - 4e-3 * M_PI / 3) < 1e-15);
    assert_true(silt_region_contains(&r[2], (double[]){2, 0.5, 0.89}) &&
                !silt_region_contains(&r[2], (double[]){2.08, 0.5, 0.88}));
    assert_true(r[3].n_point == 4 && r[3].lo[1] == 0.2 && r[3].hi[1] == 0.4);
    assert_true(silt_region_contains(&r[3], (double[]){0.9, 0.3, 0.2}) &&
                !silt_region_contains(&r[3], (double[]){0.9, 0.3, 0.9}));
    assert_true(f->size_at[0].region.kind == REGION_SPHERE && f->size_at[1].region.hi[1] == 1);
    double v[3];
    silt_formula_velocity(&f->velocity, 9.81, (double[]){2, 2, 5}, v);
    assert_true(v[0] == 6 && v[1] == 0 && v[2] == -2);
    silt_formula_acceleration(&f->force, 0, (double[]){2, 3, 5}, v);
    assert_true(v[0] == 4 && v[1] == 8 && v[2] == 0);
    const silt_wall *w = s->wall;
    assert_true(w[0].form == WALL_BOX && w[0].n_point == 0 && w[0].hi[2] == 2 && w[0].condition == WALL_SLIP);
    assert_true(w[0].velocity[1] == 1 && !w[0].surface);
    assert_true(w[1].form == WALL_SURFACE && w[1].surface[0] == '/' && w[1].scale == 0.001 && w[1].inside_out);
    assert_true(w[1].hi[0] < w[1].lo[0] && w[1].condition == WALL_LAW && w[1].motion.n_row == 2 && w[1].pivot[2] == 2);
    const silt_gauge_def *g = s->gauge;
    assert_true(g[0].kind == GAUGE_HEIGHT && g[0].from[0] == 0.5 && g[0].from[1] == 0.5 && g[0].from[2] == 0);
    assert_true(g[1].from[2] == 0.25 && g[2].from[2] == 0 && g[4].from[0] == 1);
    silt_scene_free(&s);
    // a field in space
    s = right(RIGHT "space.yaml", 0, NULL);
    // openings: outlets count on after the inlets, normals into the water
    assert_true(silt_opening_count(s) == 4 && s->fluid.inlet[0].n_corner == 3 && s->fluid.outlet[1].corner[11] == 1);
    const silt_opening pipe = silt_opening_of(s, 0), sea = silt_opening_of(s, 3);
    assert_true(pipe.inlet && !pipe.level && pipe.normal[0] == 1 && !sea.inlet && sea.normal[0] == -1 && sea.n_corner == 4);
    assert_true(silt_series_at(silt_opening_of(s, 1).level, 1, 5) == 1.25 && silt_series_at(sea.level, 1, 7) == 1.5);
    assert_true(fabs(silt_opening_height(&sea, (double[]){2.9, 0.5, 1.5}) - 0.1) < 1e-15);
    assert_true(fabs(silt_opening_depth(&sea, (double[]){2.9, 0.2, 1.5}) - 0.2) < 1e-15);
    assert_true(silt_opening_depth(&pipe, (double[]){0, 0.1, 0.2}) < 0 && silt_opening_depth(&pipe, (double[]){0, 0.5, 0.2}) > 0);
    assert_true(silt_opening_on(s, (double[]){3, 0.5, 1.5}, 1e-9, false) == 3 && silt_opening_on(s, (double[]){0, 0.5, 0.1}, 1e-9, true) == 0);
    assert_true(silt_opening_on(s, (double[]){0, 0.5, 0.1}, 1e-9, false) == -1);
    silt_scene_free(&s);
    s = right(RIGHT "space.yaml", 1, (const char *[]){"fluid.velocity={formula: field, file: points3.csv}"});
    silt_formula_velocity(&s->fluid.velocity, 9.81, (double[]){0.1, 0.2, 0.3}, v);
    assert_true(fabs(v[0] - 0.1) + fabs(v[1] - 0.2) + fabs(v[2] - 0.3) < 1e-14);
    silt_scene_free(&s);
}

// another content of a file is another scene
static void test_contents(void **state) {
    (void)state;
    const char *path =
        make_text("wave.yaml", HEAD "fluid: {density: 1, viscosity: 1, size: 0.1, regions: [{outline: o.csv}], "
                                    "cloud: c.csv, body_force: {formula: series, file: f.csv}}\n"
                                    "walls: [{box: [[0, 0], [9, 9]], motion: m.csv}]\n");
    static const char *const file[4][3] = {{"o.csv", "x,y\n0,0\n1,0\n1,1\n", "x,y\n0,0\n1,0\n1,2\n"},
                                           {"c.csv", "x,y\n0,0\n1,0\n1,1\n", "x,y\n0,0\n1,0\n1,0.5\n"},
                                           {"f.csv", "t,x\n0,0\n", "t,x\n0,1\n"},
                                           {"m.csv", "t,x\n0,0\n", "t,x\n0,1\n"}};
    for (int i = 0; i < 4; i++)
        make_text(file[i][0], file[i][1]);
    silt_scene *s = right(path, 0, NULL);
    for (int i = 0; i < 4; i++) {
        make_text(file[i][0], file[i][2]);
        silt_scene *t = right(path, 0, NULL);
        assert_string_equal(t->resolved, s->resolved);
        assert_true(t->hash != s->hash);
        silt_scene_free(&t);
        make_text(file[i][0], file[i][1]);
    }
    silt_scene_free(&s);
}

// all numbers of two scenes are the same bits
static void same_scene(const silt_scene *a, const silt_scene *b) {
    assert_string_equal(a->resolved, b->resolved);
    assert_true(a->hash == b->hash);
    assert_memory_equal(&a->time, &b->time, sizeof a->time);
    assert_memory_equal(a->gravity, b->gravity, sizeof a->gravity);
    assert_memory_equal(&a->contact, &b->contact, sizeof a->contact);
    assert_true(a->dimension == b->dimension && memcmp(a->period, b->period, sizeof a->period) == 0);
    assert_memory_equal(&a->fluid, &b->fluid, offsetof(silt_fluid_def, n_region));
    assert_memory_equal(&a->fluid.velocity, &b->fluid.velocity, offsetof(silt_formula, series));
    assert_memory_equal(&a->fluid.force, &b->fluid.force, offsetof(silt_formula, series));
    assert_true(a->fluid.shuffle == b->fluid.shuffle && a->fluid.size_growth == b->fluid.size_growth);
    assert_true(a->fluid.air_pressure == b->fluid.air_pressure && a->fluid.air_exponent == b->fluid.air_exponent);
    assert_true(a->fluid.surface_tension == b->fluid.surface_tension);
    assert_int_equal(a->fluid.n_size, b->fluid.n_size);
    for (int i = 0; i < a->fluid.n_size; i++) {
        const silt_size_def *p = &a->fluid.size_at[i], *q = &b->fluid.size_at[i];
        assert_true(p->near == q->near && p->size == q->size && p->distance == q->distance &&
                    p->region.kind == q->region.kind && p->region.n_point == q->region.n_point);
    }
    assert_memory_equal(&a->bed, &b->bed, offsetof(silt_bed_def, n_region));
    assert_memory_equal(&a->grains, &b->grains, offsetof(silt_grains_def, n_grain));
    assert_int_equal(a->fluid.n_region, b->fluid.n_region);
    for (int i = 0; i < a->fluid.n_region; i++) {
        const silt_region *p = &a->fluid.region[i], *q = &b->fluid.region[i];
        assert_memory_equal(p->lo, q->lo, sizeof p->lo + sizeof p->hi);
        assert_true(p->kind == q->kind && p->n_point == q->n_point && p->radius == q->radius);
        if (p->n_point)
            assert_memory_equal(p->point, q->point, (size_t)p->n_point * 24);
    }
    assert_int_equal(a->n_wall, b->n_wall);
    for (int i = 0; i < a->n_wall; i++) {
        assert_true(a->wall[i].n_point == b->wall[i].n_point && a->wall[i].closed == b->wall[i].closed &&
                    a->wall[i].condition == b->wall[i].condition);
        if (a->wall[i].n_point)
            assert_memory_equal(a->wall[i].point, b->wall[i].point, (size_t)a->wall[i].n_point * 24);
        assert_true(a->wall[i].form == b->wall[i].form && a->wall[i].roughness == b->wall[i].roughness &&
                    a->wall[i].scale == b->wall[i].scale && a->wall[i].inside_out == b->wall[i].inside_out &&
                    a->wall[i].motion.n_row == b->wall[i].motion.n_row);
        assert_memory_equal(a->wall[i].lo, b->wall[i].lo, 48);
        assert_memory_equal(a->wall[i].velocity, b->wall[i].velocity, 24);
        assert_memory_equal(a->wall[i].pivot, b->wall[i].pivot, 24);
    }
    assert_int_equal(a->grains.n_grain, b->grains.n_grain);
    if (a->grains.n_grain)
        assert_memory_equal(a->grains.grain, b->grains.grain, (size_t)a->grains.n_grain * sizeof *a->grains.grain);
    assert_int_equal(a->grains.n_filled, b->grains.n_filled);
    if (a->grains.n_filled)
        assert_memory_equal(a->grains.filled, b->grains.filled, (size_t)a->grains.n_filled * sizeof *a->grains.filled);
    assert_int_equal(a->n_body, b->n_body);
    for (int i = 0; i < a->n_body; i++) {
        assert_string_equal(a->body[i].name, b->body[i].name);
        assert_memory_equal(a->body[i].at, b->body[i].at, 10 * sizeof(double));
    }
    assert_true(a->n_gauge == b->n_gauge && a->n_check == b->n_check);
    for (int i = 0; i < a->n_gauge; i++)
        assert_true(a->gauge[i].kind == b->gauge[i].kind && memcmp(a->gauge[i].from, b->gauge[i].from, 48) == 0);
    for (int i = 0; i < a->n_check; i++)
        assert_memory_equal(&a->check[i].where_value, &b->check[i].where_value,
                            offsetof(silt_check_def, relative_to) - offsetof(silt_check_def, where_value));
}

static void test_resolved(void **state) {
    (void)state;
    static const char *const file[] = {RIGHT "whole.yaml", RIGHT "dry.yaml",   RIGHT "plain.yaml",
                                       RIGHT "plain.json", RIGHT "water.yaml", RIGHT "space.yaml"};
    for (int i = 0; i < 6; i++) {
        const char *set[] = {"time.end=0.1", i == 5 ? "gravity=[0.1, 0, -9.80665]" : "gravity=[0.1, -9.80665]",
                             "title='a: #b'"};
        silt_scene *a = right(file[i], i % 2 ? 3 : 0, set);
        silt_scene *b = right(make_text("resolved.yaml", a->resolved), 0, NULL);
        same_scene(a, b);
        silt_scene_free(&a);
        silt_scene_free(&b);
    }
    // the same scene in other words
    silt_scene *yaml = right(RIGHT "plain.yaml", 0, NULL), *json = right(RIGHT "plain.json", 0, NULL);
    same_scene(yaml, json);
    silt_scene *other = right(RIGHT "plain.yaml", 1, (const char *[]){"fluid.seed=2"});
    assert_true(other->hash != yaml->hash);
    silt_scene_free(&yaml);
    silt_scene_free(&json);
    silt_scene_free(&other);
    // numbers come back to the bit, texts to the letter
    static const double number[] = {0.1, 1.0 / 3, 5e-324, 1.7976931348623157e308, 123456789012345678.0, 2.5e-9};
    for (int i = 0; i < 6; i++) {
        char set[64];
        snprintf(set, sizeof set, "fluid.density=%.17g", number[i]);
        silt_scene *a =
            right(RIGHT "plain.yaml", 2, (const char *[]){set, "title=\"\\u2028\\U0001f30a \\\\ \\\" \\x85 \\n\""});
        silt_scene *b = right(make_text("resolved.yaml", a->resolved), 0, NULL);
        assert_true(a->fluid.density == number[i] && b->fluid.density == number[i]);
        assert_string_equal(a->title, "\xe2\x80\xa8\xf0\x9f\x8c\x8a \\ \" \xc2\x85 \n");
        same_scene(a, b);
        silt_scene_free(&a);
        silt_scene_free(&b);
    }
}

// a resolved scene outlives its files when copies lie beside it
static void test_moved(void **state) {
    (void)state;
    assert_int_equal(mkdir(place("one"), 0777), 0);
    assert_int_equal(mkdir(place("two"), 0777), 0);
    make_text("one/a.csv", "t,x\n0,1\n");
    make_text("one/scene.yaml", HEAD WATER "checks: [{name: c, column: time, reference: a.csv, tolerance: 1}]\n");
    silt_scene *s = right(place("one/scene.yaml"), 0, NULL);
    make_text("two/scene.yaml", s->resolved);
    assert_int_equal(rename(place("one/a.csv"), place("two/a.csv")), 0);
    silt_scene *t = right(place("two/scene.yaml"), 0, NULL);
    assert_string_equal(t->check[0].reference, place("two/a.csv"));
    assert_true(s->hash == t->hash);
    silt_scene_free(&t);
    assert_int_equal(rename(place("two/a.csv"), place("two/0_a.csv")), 0);
    t = right(place("two/scene.yaml"), 0, NULL);
    assert_string_equal(t->check[0].reference, place("two/0_a.csv"));
    silt_scene_free(&t);
    silt_scene_free(&s);
}

static void test_cases(void **state) {
    (void)state;
    DIR *dir = opendir(SILT_SOURCE "/cases");
    for (struct dirent *entry; dir && (entry = readdir(dir));) {
        char path[4200];
        snprintf(path, sizeof path, SILT_SOURCE "/cases/%s/scene.yaml", entry->d_name);
        if (entry->d_name[0] == '.' || access(path, R_OK) != 0)
            continue;
        silt_scene *s = right(path, 0, NULL);
        silt_scene_free(&s);
    }
    if (dir)
        closedir(dir);
}

// -D ---------------------------------------------------------------------------------------------------
static void test_set(void **state) {
    (void)state;
    const char *set[] = {"fluid.size=0.01",
                         "bodies.0.density=701",
                         "bodies.cube.density=702",
                         "gravity.1=-5",
                         "time.cfl=0.25",
                         "fluid.velocity={formula: uniform, vector: [1, 2]}",
                         "title=a=b",
                         "fluid.regions.0.box=[[0, 0], [0.5, 1]]",
                         "checks.volume.tolerance=2e-3",
                         "bed.size=0.005",
                         "gauges=[{name: front, front: x}, {name: v1, velocity_at: [1, 1]}]"};
    silt_scene *s = right(RIGHT "whole.yaml", 11, set);
    assert_true(s->fluid.size == 0.01 && s->bed.distance == 0.01 && s->bed.size == 0.005);
    assert_true(s->body[0].density == 701 && s->body[1].density == 702 && s->body[2].density == 700);
    assert_true(s->gravity[1] == -5 && s->time.cfl == 0.25 && s->fluid.velocity.kind == FORMULA_UNIFORM);
    assert_true(s->fluid.velocity.vector[1] == 2 && s->fluid.region[0].hi[0] == 0.5 && s->check[2].tolerance == 2e-3);
    assert_string_equal(s->title, "a=b");
    assert_int_equal(s->n_gauge, 2);
    silt_scene_free(&s);

    // blocks that are not there yet are made; the last of two counts
    const char *path = make_text("bare.yaml", HEAD "fluid:\n");
    const char *block[] = {"fluid.density=1",
                           "fluid.viscosity=0",
                           "fluid.size=1",
                           "fluid.regions=[{circle: [0, 0], radius: 1}]",
                           "fluid.velocity.formula=shear",
                           "fluid.velocity.rate=3",
                           "fluid.velocity.rate=4"};
    s = right(path, 7, block);
    assert_true(s->fluid.velocity.kind == FORMULA_SHEAR && s->fluid.velocity.rate == 4);
    silt_scene_free(&s);

    // errors name the text and the place in it
    static const char *const bad[][2] = {
        {"fluid.size=-1",
         "-D fluid.size=-1:1:12: key 'fluid.size': found '-1', allowed a number in m, > 0\n    fluid.size=-1\n"
         "               ^"},
        {"fluid.szie=1", "-D fluid.szie=1:1:7: key 'fluid.szie': found no such key, did you mean 'size'?"},
        {"gravity=[0, x]", "-D gravity=[0, x]:1:13: key 'gravity': found 'x', allowed a number in m/s2"},
        {"bodies.4.density=1",
         "-D bodies.4.density=1:1:8: key 'bodies.4': found no item '4', allowed 0 to 3, or the name"},
        {"bodies.rome.density=1", "-D bodies.rome.density=1:1:8: key 'bodies.rome': found no item 'rome'"},
        {"fluid.size.x=1", "-D fluid.size.x=1:1:12: key 'fluid.size.x': found no item 'x', allowed nothing below"},
        {"fluid.size=", "-D fluid.size=:1:12: key 'fluid.size': found no value, allowed a YAML value"},
        {"fluid.size", "-D fluid.size:1:1: found no path=value, allowed for example"},
        {"=1", "-D =1:1:1: found no path=value"},
        {"fluid..size=1", "-D fluid..size=1:1:7: key 'fluid.': found no item '', allowed a name between the dots"},
        {"gravity=[0, 1", "-D gravity=[0, 1:1:14: syntax: flow sequence without a closing bracket"},
        {"fluid.regions.1.polygon=[[0, 0], [1, 0], [2, 0]]",
         ":1:25: key 'fluid.regions.1.polygon': found a polygon without"},
        {"title=\xff", ":1:1: found no path=value"},
        {"dimension=4", "-D dimension=4:1:11: key 'dimension': found '4', allowed an integer, 2 to 3"}};
    for (int i = 0; i < (int)(sizeof bad / sizeof *bad); i++)
        wrong(RIGHT "whole.yaml", 1, bad[i], 1, bad[i][1]);
    wrong(RIGHT "whole.yaml", 2, (const char *[]){"time.end=x", "fluid.size=y"}, 2,
          "-D fluid.size=y:1:12: key 'fluid.size'");
}

// words ------------------------------------------------------------------------------------------------
static void test_words(void **state) {
    (void)state;
    assert_int_equal(silt_text_distance("density", "density", 3), 0);
    assert_int_equal(silt_text_distance("densty", "density", 3), 1);
    assert_int_equal(silt_text_distance("dnesity", "density", 3), 1);
    assert_int_equal(silt_text_distance("kitten", "sitting", 3), 3);
    assert_int_equal(silt_text_distance("kitten", "sitting", 2), 3);
    assert_int_equal(silt_text_distance("", "abc", 5), 3);
    assert_string_equal(silt_key_nearest(&silt_scene_keys, "fluids"), "fluid");
    assert_string_equal(silt_key_nearest(&silt_scene_keys, "Gravty"), "gravity");
    assert_null(silt_key_nearest(&silt_scene_keys, "colour"));
    static const char *const no[] = {"",      "-",   ".",   "e5", "1e",  "1e+",   "0x1",
                                     "1_000", "inf", "nan", "1 ", "--1", "1.2.3", "-.nan"};
    double x;
    for (int i = 0; i < (int)(sizeof no / sizeof *no); i++)
        if (silt_text_number(no[i], &x))
            fail_msg("'%s' is no number", no[i]);
    assert_true(silt_text_number("-.5e+1", &x) && x == -5);
    assert_true(silt_text_number("+3.", &x) && x == 3);
    assert_true(silt_text_number("-.inf", &x) && x == -HUGE_VAL);
    assert_true(silt_text_number(".nan", &x) && isnan(x));
}

// the table itself: no name twice, defaults that are allowed, words for all
static void table_sound(const silt_key_table *table) {
    for (const silt_key *key = table->key; key->name; key++) {
        assert_ptr_equal(silt_key_find(table, key->name), key);
        if (!*key->doc || (key->kind == KEY_BLOCK || key->kind == KEY_LIST) != (key->sub != NULL))
            fail_msg("%s is not whole", key->name);
        double x;
        if (key->kind == KEY_NUMBER && key->fallback && silt_text_number(key->fallback, &x) && !isnan(x) &&
            (key->low != 0 || key->high != 0) && (x < key->low || x > key->high))
            fail_msg("%s: its default is not allowed", key->name);
        if (key->sub)
            table_sound(key->sub);
    }
}

static void test_help(void **state) {
    (void)state;
    silt_error err = {0};
    table_sound(&silt_scene_keys);
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    assert_int_equal(silt_scene_help("fluid.size", to, &err), SILT_OK);
    fclose(to);
    assert_string_equal(text, "fluid.size\n  type     number\n  unit     m\n  default  required\n  allowed  > 0\n"
                              "  meaning  distance h between nodes\n");
    free(text);
    to = open_memstream(&text, &size);
    assert_int_equal(silt_scene_help(NULL, to, &err), SILT_OK);
    assert_int_equal(silt_scene_help("bodies.0.height", to, &err), SILT_OK);
    assert_int_equal(silt_scene_help("walls", to, &err), SILT_OK);
    fclose(to);
    assert_non_null(strstr(text, "of a box or wedge, length of a cylinder, thickness of a capsule; 0: as the scale"));
    assert_non_null(strstr(text, "the last point is joined to the first; only with polyline or box; 2-D only\n"));
    free(text);
    to = open_memstream(&text, &size);
    assert_int_equal(silt_scene_help("fluid.densty", to, &err), SILT_INPUT);
    fclose(to);
    assert_string_equal(err.text,
                        "help: found no key 'fluid.densty', did you mean 'density'?, allowed: one of the keys that "
                        "`silt help` lists");
    assert_int_equal(size, 0);
    free(text);
}

// `test_scene document > docs/scene.md` makes it anew
static void test_document(void **state) {
    (void)state;
    char *text = NULL;
    size_t size = 0, old_size;
    FILE *to = open_memstream(&text, &size);
    silt_scene_document(to);
    fclose(to);
    char *old = slurp(SILT_SOURCE "/docs/scene.md", &old_size);
    assert_string_equal(old, text);
    free(old);
    free(text);
}

// the checks' columns are those of history.csv
static void test_columns(void **state) {
    (void)state;
    silt_scene *s = right(RIGHT "whole.yaml", 0, NULL);
    silt_error err = {0};
    silt_history *history = NULL;
    assert_int_equal(silt_history_create(&history, folder, s, &err), SILT_OK);
    assert_int_equal(silt_history_close(&history, &err), SILT_OK);
    size_t size;
    char *text = slurp(place("history.csv"), &size), *rest = text;
    text[strcspn(text, "\n")] = 0;
    int n = 0;
    for (char *name; (name = strsep(&rest, ",")); n++) {
        char set[200];
        snprintf(set, sizeof set, "checks=[{name: c, column: %s, scalar: last, value: 1, tolerance: 1}]", name);
        silt_scene *t = right(RIGHT "whole.yaml", 1, (const char *[]){set});
        silt_scene_free(&t);
    }
    assert_true(n > 100);
    free(text);
    silt_scene_free(&s);
}

// random damage: read or refused, and what is read must survive its own resolved text
static void damage(const char *name, int rounds, uint64_t seed) {
    size_t size;
    char path[4200];
    snprintf(path, sizeof path, RIGHT "%s", name);
    char *good = slurp(path, &size), *text = silt_alloc(2 * size, 1);
    static const char token[] = "{}[],:&*!|>'\"%@`#-? \n\t\\.0123456789einfanx~<=\x80\xff\xc3\xa9";
    int n_right = 0, n_wrong = 0;
    for (int round = 0; round < rounds; round++) {
        size_t n = size;
        memcpy(text, good, size);
        int edits = 1 + (int)(silt_random(&seed) % 3);
        for (int i = 0; i < edits; i++) {
            size_t at = silt_random(&seed) % n, length = silt_random(&seed) % 12;
            switch (silt_random(&seed) % 4) {
            case 0: // another letter
                text[at] = token[silt_random(&seed) % (sizeof token - 1)];
                break;
            case 1: // a letter more
                memmove(text + at + 1, text + at, n - at);
                text[at] = token[silt_random(&seed) % (sizeof token - 1)];
                n++;
                break;
            case 2: // letters less
                length = length < n - at ? length : n - at;
                memmove(text + at, text + at + length, n - at - length);
                n -= length;
                break;
            default: { // letters from elsewhere
                size_t from = silt_random(&seed) % n, most = n - (at > from ? at : from);
                memmove(text + at, text + from, length < most ? length : most);
            }
            }
        }
        silt_error err = {0};
        silt_scene *scene = NULL, *again = NULL;
        // -D gets its share of the damage
        char set[32] = {0};
        memcpy(set, text + silt_random(&seed) % (n - 31), 31);
        const char *damaged = make("damage.yaml", text, n), *one = set;
        silt_status status = silt_scene_read(damaged, round % 8 == 0, &one, &scene, &err);
        if (status == SILT_OK) {
            n_right++;
            again = right(make_text("again.yaml", scene->resolved), 0, NULL);
            assert_string_equal(scene->resolved, again->resolved);
            assert_true(scene->hash == again->hash);
        } else {
            n_wrong++;
            assert_int_equal(status, SILT_INPUT);
            assert_true(err.count > 0 && err.text[0]);
        }
        silt_scene_free(&scene);
        silt_scene_free(&again);
    }
    // both happen often
    if (n_right < rounds / 50 || n_wrong < rounds / 2)
        fail_msg("%d right and %d wrong of %d", n_right, n_wrong, rounds);
    free(good);
    free(text);
}

static void test_damage(void **state) {
    (void)state;
    // the files that the scenes name
    DIR *dir = opendir(RIGHT);
    assert_non_null(dir);
    for (struct dirent *entry; (entry = readdir(dir));)
        if (strstr(entry->d_name, ".csv") || strstr(entry->d_name, ".stl")) {
            char path[4200];
            size_t size;
            snprintf(path, sizeof path, RIGHT "%s", entry->d_name);
            char *text = slurp(path, &size);
            make(entry->d_name, text, size);
            free(text);
        }
    closedir(dir);
    damage("whole.yaml", 4000, 2024);
    damage("water.yaml", 3000, 2025);
    damage("space.yaml", 3000, 2026);
}

int main(int argc, char **argv) {
    if (argc > 1 && strcmp(argv[1], "document") == 0) {
        silt_scene_document(stdout);
        return 0;
    }
    snprintf(folder, sizeof folder, "%s/test_scene_XXXXXX", SILT_BINARY);
    if (!mkdtemp(folder))
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_words),       cmocka_unit_test(test_help),     cmocka_unit_test(test_document),
        cmocka_unit_test(test_whole),       cmocka_unit_test(test_resolved), cmocka_unit_test(test_moved),
        cmocka_unit_test(test_set),         cmocka_unit_test(test_wrong),    cmocka_unit_test(test_broken_files),
        cmocka_unit_test(test_many_errors), cmocka_unit_test(test_columns),  cmocka_unit_test(test_cases),
        cmocka_unit_test(test_damage),      cmocka_unit_test(test_water),    cmocka_unit_test(test_space),
        cmocka_unit_test(test_contents),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[4300];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command) != 0 || failed ? 1 : 0;
}
