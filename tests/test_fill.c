// regions full of grains: how many, how large, where; nothing overlaps; the same bits for the same seed
#include "output.h"
#include "scene_keys.h"

#include <setjmp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[4096]; // temporary

static const char *make(const char *name, const char *text) {
    static char path[4][4400];
    static int i;
    i = (i + 1) % 4;
    snprintf(path[i], sizeof path[i], "%s/%s", folder, name);
    FILE *file = fopen(path[i], "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
    return path[i];
}

#define HEAD                                                                                                                   \
    "silt: 1\ntime: {end: 1, output: 0.1}\ngravity: [0, -9.81]\n"                                                             \
    "contact: {youngs_modulus: 1e7, poissons_ratio: 0.3, restitution: 0.5, friction: 0.5, rolling_friction: 0.1}\n"
#define TANK "walls: [{polyline: [[0, 2], [0, 0], [2, 0], [2, 2]]}]\n"

static silt_scene *read_text(const char *text, int n_set, const char *const *set) {
    silt_error err = {0};
    silt_scene *scene = NULL;
    if (silt_scene_read(make("scene.yaml", text), n_set, set, &scene, &err) != SILT_OK)
        fail_msg("%s", err.text);
    return scene;
}

// largest overlap of two grains over the radius of the smaller, by comparing all with all
static double overlap(const silt_scene *scene) {
    double most = 0;
    const int n = silt_scene_grains(scene);
    for (int i = 0; i < n; i++)
        for (int k = 0; k < i; k++) {
            const silt_grain_def *a = silt_scene_grain(scene, i), *b = silt_scene_grain(scene, k);
            const double d[3] = {a->at[0] - b->at[0], a->at[1] - b->at[1], a->at[2] - b->at[2]};
            most = silt_max(most, (0.5 * (a->diameter + b->diameter) - silt_length(3, d)) / (0.5 * silt_min(a->diameter, b->diameter)));
        }
    return most;
}

// share of the region's area or volume that is grains
static double share(const silt_scene *scene, int region) {
    const int dim = scene->dimension == 3 ? 3 : 2;
    double sum = 0;
    for (int i = 0; i < scene->grains.n_filled; i++)
        sum += dim == 3 ? M_PI / 6 * pow(scene->grains.filled[i].diameter, 3) : M_PI / 4 * silt_square(scene->grains.filled[i].diameter);
    return sum / silt_region_area(&scene->grains.fill[region].region);
}

static void inside(const silt_scene *scene, int region) {
    for (int i = 0; i < scene->grains.n_filled; i++) {
        const silt_grain_def *g = &scene->grains.filled[i];
        assert_true(silt_region_depth(&scene->grains.fill[region].region, g->at) >= 0.5 * g->diameter * (1 - 1e-6));
    }
}

// as asked, in each form of region and arrangement
static void test_forms(void **state) {
    (void)state;
    static const struct {
        const char *form, *ask;
        double area, porosity;
        int count; // 0: by the porosity
    } expected[] = {
        {"box: [[0.1, 0.1], [1.1, 0.6]]", "porosity: 0.6", 0.5, 0.6, 0},
        {"box: [[0.1, 0.1], [1.1, 0.6]]", "porosity: 0.3", 0.5, 0.3, 0},
        {"box: [[0.1, 0.1], [1.1, 0.6]]", "porosity: 0.3, arrangement: lattice", 0.5, 0.3, 0},
        {"polygon: [[0.1, 0.1], [1.5, 0.1], [0.1, 1.1]]", "porosity: 0.58", 0.7, 0.58, 0},
        {"polygon: [[0.1, 0.1], [1.5, 0.1], [0.1, 1.1]]", "porosity: 0.4", 0.7, 0.4, 0},
        {"circle: [1, 1], radius: 0.4", "count: 300", M_PI * 0.16, 0, 300},
        {"circle: [1, 1], radius: 0.4", "count: 300, arrangement: lattice", M_PI * 0.16, 0, 300},
        {"outline: square.csv", "count: 100", 0.25, 0, 100},
    };
    make("square.csv", "x,y\n0.5,0.5\n1,0.5\n1,1\n0.5,1\n");
    for (int i = 0; i < (int)(sizeof expected / sizeof *expected); i++) {
        char text[2048];
        snprintf(text, sizeof text, HEAD TANK "grains: {regions: [{%s, diameter: 0.025, density: 2650, velocity: [1, -2], %s}]}\n",
                 expected[i].form, expected[i].ask);
        silt_scene *scene = read_text(text, 0, NULL);
        const double grain = M_PI / 4 * 0.025 * 0.025;
        const int count = expected[i].count ? expected[i].count : (int)floor((1 - expected[i].porosity) * expected[i].area / grain + 0.5);
        assert_int_equal(scene->grains.n_filled, count);
        assert_true(fabs(share(scene, 0) - count * grain / expected[i].area) < 1e-12);
        assert_true(overlap(scene) < 1e-6);
        inside(scene, 0);
        for (int k = 0; k < count; k++) {
            const silt_grain_def *g = &scene->grains.filled[k];
            assert_true(g->diameter == 0.025 && g->density == 2650 && g->velocity[0] == 1 && g->velocity[1] == -2 && g->at[2] == 0);
        }
        silt_scene_free(&scene);
    }
}

// Rows of triangles by hand: a box ten grains wide has rows of 10 and 9, (1 - 0.1)/(0.1 sqrt(3)/2) + 1 = 11 of them. Without a
// number the random arrangement fills 0.45 of the area.
static void test_most(void **state) {
    (void)state;
    silt_scene *scene = read_text(HEAD TANK "grains: {regions: [{box: [[0, 0], [1, 1]], diameter: 0.1, density: 2650, arrangement: lattice}]}\n", 0, NULL);
    assert_int_equal(scene->grains.n_filled, 6 * 10 + 5 * 9);
    assert_true(overlap(scene) < 1e-6);
    silt_scene_free(&scene);
    scene = read_text(HEAD TANK "grains: {regions: [{box: [[0, 0], [1, 1]], diameter: 0.02, density: 2650}]}\n", 0, NULL);
    assert_int_equal(scene->grains.n_filled, (int)(0.45 / (M_PI / 4 * 0.0004) + 0.5));
    assert_true(overlap(scene) < 1e-6);
    silt_scene_free(&scene);
}

// walls, bodies, the bed, single grains and other regions' grains stand in the way
static void test_clear(void **state) {
    (void)state;
    silt_scene *scene = read_text(
        HEAD "walls:\n  - {polyline: [[0, 2], [0, 0], [2, 0], [2, 2]]}\n"
             "  - {polyline: [[0, 1], [0.6, 0.3], [2, 0.25]]}\n"
             "  - {polyline: [[1.2, 1.2], [1.2, 1.5], [1.5, 1.5], [1.5, 1.2]], closed: true}\n"
             "fluid: {density: 1000, viscosity: 0.001, size: 0.1, regions: [{box: [[0, 0], [1, 1]]}]}\n"
             "bed: {density: 2650, porosity: 0.4, work: 1, regions: [{box: [[1.6, 0.6], [1.9, 0.8]]}]}\n"
             "bodies: [{name: cube, shape: box, at: [0.8, 0.8], scale: 0.3, density: 700, angle: 30},\n"
             "  {name: disc, shape: disc, at: [0.3, 1.5], scale: 0.4, density: 700}]\n"
             "grains: {parcel: 0.04, list: [{at: [1.4, 0.9], diameter: 0.2, density: 2650}], regions: [\n"
             "  {box: [[0, 0], [2, 2]], diameter: 0.02, density: 2650, count: 2500},\n"
             "  {box: [[0, 0], [2, 2]], diameter: 0.04, density: 1000, count: 200, seed: 3}]}\n",
        0, NULL);
    assert_int_equal(scene->grains.n_filled, 2700);
    assert_true(overlap(scene) < 1e-6);
    const double turn = M_PI / 6;
    for (int i = 0; i < scene->grains.n_filled; i++) {
        const silt_grain_def *g = &scene->grains.filled[i];
        const double *x = g->at, r = 0.5 * g->diameter * (1 - 1e-6);
        for (int w = 0; w < scene->n_wall; w++)
            for (int k = 0; k + 1 < scene->wall[w].n_point; k++)
                assert_true(silt_segment_distance(scene->wall[w].point + 3 * k, scene->wall[w].point + 3 * k + 3, x) > r);
        // not in the closed wall, which has its water outside
        assert_false(x[0] > 1.2 && x[0] < 1.5 && x[1] > 1.2 && x[1] < 1.5);
        // nor in the bed, the disc, the turned box, each widened by the radius
        assert_true(hypot(silt_max(fabs(x[0] - 1.75) - 0.15, 0), silt_max(fabs(x[1] - 0.7) - 0.1, 0)) > r);
        assert_true(hypot(x[0] - 0.3, x[1] - 1.5) > 0.2 * (1 - 2e-6) + r);
        const double u = cos(turn) * (x[0] - 0.8) + sin(turn) * (x[1] - 0.8), v = cos(turn) * (x[1] - 0.8) - sin(turn) * (x[0] - 0.8);
        assert_true(hypot(silt_max(fabs(u) - 0.15, 0), silt_max(fabs(v) - 0.15, 0)) > r - 1e-6);
    }
    silt_scene_free(&scene);
}

// mass by the sieve: between two rows to a grain or two of that size, whatever arrangement
static void test_sieve(void **state) {
    (void)state;
    make("sieve.csv", "passing,diameter\n0,0.01\n0.3,0.015\n0.3,0.018\n0.8,0.03\n1,0.04\n");
    static const double row[5][2] = {{0.01, 0}, {0.015, 0.3}, {0.018, 0.3}, {0.03, 0.8}, {0.04, 1}};
    for (int lattice = 0; lattice < 2; lattice++) {
        silt_scene *scene = read_text(HEAD TANK "grains: {regions: [{box: [[0, 0], [2, 2]], sieve: sieve.csv, density: 2650, porosity: 0.7}]}\n", 2 * lattice,
                                      (const char *[]){"grains.regions.0.arrangement=lattice", "grains.regions.0.porosity=0.9"});
        const silt_grains_def *grains = &scene->grains;
        assert_true(grains->n_filled > 1000 && fabs(share(scene, 0) - (lattice ? 0.1 : 0.3)) < 2e-3);
        assert_true(overlap(scene) < 1e-6);
        inside(scene, 0);
        double mass = 0, finer[5] = {0};
        for (int i = 0; i < grains->n_filled; i++) {
            const double m = pow(grains->filled[i].diameter, 3);
            mass += m;
            for (int k = 0; k < 5; k++)
                finer[k] += grains->filled[i].diameter <= row[k][0] ? m : 0;
        }
        for (int k = 0; k < 5; k++)
            assert_true(fabs(finer[k] / mass - row[k][1]) < 2 * pow(row[k][0], 3) / mass);
        silt_scene_free(&scene);
    }
}

// the same seed the same bits, another one other places; read back from the resolved text too
static void test_seed(void **state) {
    (void)state;
    const char *text = HEAD TANK "grains: {regions: [{box: [[0, 0], [2, 1]], diameter: 0.02, density: 2650, porosity: 0.57}]}\n";
    silt_scene *a = read_text(text, 0, NULL), *b = read_text(text, 0, NULL), *c = read_text(a->resolved, 0, NULL);
    silt_scene *d = read_text(text, 1, (const char *[]){"grains.regions.0.seed=2"});
    assert_true(a->grains.n_filled > 2000 && a->grains.n_filled == d->grains.n_filled && a->grains.n_filled == c->grains.n_filled);
    const size_t size = (size_t)a->grains.n_filled * sizeof *a->grains.filled;
    assert_memory_equal(a->grains.filled, b->grains.filled, size);
    assert_memory_equal(a->grains.filled, c->grains.filled, size);
    assert_memory_not_equal(a->grains.filled, d->grains.filled, size);
    assert_true(a->hash == b->hash && a->hash == c->hash && a->hash != d->hash);
    silt_scene_free(&a);
    silt_scene_free(&b);
    silt_scene_free(&c);
    silt_scene_free(&d);
}

// a hundred thousand, in a second (0.2 s)
static void test_many(void **state) {
    (void)state;
    const double start = silt_seconds();
    silt_scene *scene = read_text(HEAD TANK "grains: {regions: [{box: [[0, 0], [2, 1]], diameter: 0.003, density: 2650, count: 100000}]}\n", 0, NULL);
    assert_int_equal(scene->grains.n_filled, 100000);
    print_message("100000 grains: %.2f s\n", silt_seconds() - start);
    silt_scene_free(&scene);
}

static bool nothing_there(const void *context, const double *x, double radius) {
    (void)context;
    (void)x;
    (void)radius;
    return true;
}

// in space: a box, a sphere, a prism; rows upon rows by hand
static void test_space(void **state) {
    (void)state;
    double corner[9] = {0, 0, 0, 2, 0, 0, 0, 2, 0};
    const silt_region region[] = {{.kind = REGION_BOX, .lo = {0, 0, 0}, .hi = {1, 1, 1}},
                                  {.kind = REGION_SPHERE, .centre = {1, 1, 1}, .radius = 0.5},
                                  {.kind = REGION_POLYGON, .n_point = 3, .point = corner, .lo = {0, 0.5, 0}, .hi = {0, 1, 0}}};
    const double volume[] = {1, M_PI / 6, 1}, porosity[] = {0.75, 0.5};
    for (int i = 0; i < 3; i++)
        for (int lattice = 0; lattice < 2; lattice++)
            for (int k = 0; k < 2; k++) {
                silt_fill_def fill = {.region = region[i], .diameter = 0.08, .density = 2650, .porosity = porosity[k],
                                      .arrangement = lattice ? ARRANGE_LATTICE : ARRANGE_RANDOM, .seed = 1};
                silt_scene scene = {.dimension = 3, .grains = {.on = true, .n_fill = 1, .fill = &fill}};
                silt_reader reader = {0};
                silt_scene_fill(&reader, &scene, nothing_there, NULL);
                assert_int_equal(reader.n_complaint, 0);
                assert_int_equal(scene.grains.n_filled, (int)floor((1 - porosity[k]) * volume[i] / (M_PI / 6 * 0.08 * 0.08 * 0.08) + 0.5));
                assert_true(overlap(&scene) < 1e-6);
                inside(&scene, 0);
                free(scene.grains.filled);
            }
    // five wide: rows of 5 and 4, by turns from 5 in the first layer and from 4 in the next, which stands d/(2 sqrt 3) farther in
    silt_fill_def fill = {.region = region[0], .diameter = 0.2, .density = 2650, .arrangement = ARRANGE_LATTICE};
    silt_scene scene = {.dimension = 3, .grains = {.on = true, .n_fill = 1, .fill = &fill}};
    silt_reader reader = {0};
    silt_scene_fill(&reader, &scene, nothing_there, NULL);
    // in y 0.8/0.1732 + 1 = 5 rows, in the next (0.8 - 0.0577)/0.1732 + 1 = 5; in z 0.8/0.1633 + 1 = 5 layers
    const int first = 5 + 4 + 5 + 4 + 5, next = 4 + 5 + 4 + 5 + 4;
    assert_int_equal(scene.grains.n_filled, 3 * first + 2 * next);
    assert_true(overlap(&scene) < 1e-6);
    free(scene.grains.filled);
}

// The heap by hand: eight grains on a line that falls by 1 in 2 and hang together, a heavier one and two light ones apart from them.
static void test_heap(void **state) {
    (void)state;
    enum { N = 11 };
    double x[3 * N] = {0}, v[3 * N] = {0}, radius[N], mass[N], spin[3 * N] = {0}, force[3 * N] = {0};
    int64_t id[N];
    for (int i = 0; i < N; i++) {
        x[3 * i] = 0.15 + 0.3 * i;
        x[3 * i + 1] = 2 - 0.15 * i;
        radius[i] = 0.3354102 / 2;
        mass[i] = 1;
        id[i] = 2 * i + 1;
        force[3 * i] = i;
    }
    x[24] = 5, x[27] = 6, x[30] = 6.3;
    x[25] = x[28] = x[31] = 1;
    mass[8] = 5;
    const silt_grain_state grains = {.count = N, .id = id, .x = x, .v = v, .omega = spin, .radius = radius, .mass = mass, .contact = force};
    silt_scene scene = {.dimension = 2};
    const silt_view view = {.scene = &scene, .grains = &grains};
    silt_heap heap = {0};
    silt_heap_find(&heap, &view);
    for (int i = 0; i < N; i++)
        assert_int_equal(heap.in[i], i < 8);
    const silt_gauge_def right = {.kind = GAUGE_GRAIN_FRONT, .from = {1}}, left = {.kind = GAUGE_GRAIN_FRONT, .from = {-1}};
    const silt_gauge_def height = {.kind = GAUGE_GRAIN_HEIGHT, .from = {0.75}}, none = {.kind = GAUGE_GRAIN_HEIGHT, .from = {5}};
    const silt_gauge_def slope = {.kind = GAUGE_GRAIN_SLOPE, .from = {0, 2.4}};
    assert_true(fabs(silt_heap_gauge(&heap, &view, &right) - 2.25 - radius[0]) < 1e-12);
    assert_true(fabs(silt_heap_gauge(&heap, &view, &left) - 0.15 + radius[0]) < 1e-12);
    assert_true(fabs(silt_heap_gauge(&heap, &view, &height) - 1.7 - radius[0]) < 1e-12);
    assert_true(isnan(silt_heap_gauge(&heap, &view, &none)));
    // four columns of two grains, whose upper ones stand 0.6 apart and fall by 0.3
    assert_true(fabs(silt_heap_gauge(&heap, &view, &slope) - 180 / M_PI * atan(0.5)) < 1e-9);
    silt_heap_clear(&heap);

    // the same heap upright in space, two rows of it that touch: the one behind lies lower by 0.1 and does not count in the slope
    scene.dimension = 3;
    double deep[6 * N];
    for (int i = 0; i < 2 * N; i++) {
        const double *of = x + 3 * (i % N);
        deep[3 * i] = of[0], deep[3 * i + 1] = i < N ? 0.4 : 0.7, deep[3 * i + 2] = of[1] - (i < N ? 0 : 0.1);
    }
    double twice_radius[2 * N], twice_mass[2 * N];
    for (int i = 0; i < 2 * N; i++) {
        twice_radius[i] = radius[i % N];
        twice_mass[i] = mass[i % N];
    }
    const silt_grain_state space = {.count = 2 * N, .x = deep, .radius = twice_radius, .mass = twice_mass};
    const silt_view upright = {.scene = &scene, .grains = &space};
    silt_heap_find(&heap, &upright);
    for (int i = 0; i < 2 * N; i++)
        assert_int_equal(heap.in[i], i % N < 8);
    const silt_gauge_def front_row = {.kind = GAUGE_GRAIN_HEIGHT, .from = {0.75, 0.4}}, back_row = {.kind = GAUGE_GRAIN_HEIGHT, .from = {0.75, 0.7}};
    const silt_gauge_def beside = {.kind = GAUGE_GRAIN_HEIGHT, .from = {0.75, 1}};
    assert_true(fabs(silt_heap_gauge(&heap, &upright, &right) - 2.25 - radius[0]) < 1e-12);
    assert_true(fabs(silt_heap_gauge(&heap, &upright, &left) - 0.15 + radius[0]) < 1e-12);
    assert_true(fabs(silt_heap_gauge(&heap, &upright, &front_row) - 1.7 - radius[0]) < 1e-12);
    assert_true(fabs(silt_heap_gauge(&heap, &upright, &back_row) - 1.6 - radius[0]) < 1e-12);
    assert_true(isnan(silt_heap_gauge(&heap, &upright, &beside)));
    assert_true(fabs(silt_heap_gauge(&heap, &upright, &slope) - 180 / M_PI * atan(0.5)) < 1e-9);
    silt_heap_clear(&heap);

    // one grain by its number; of one that is gone nothing
    double value[3] = {NAN, NAN, NAN};
    silt_grain_gauge(&view, &(silt_gauge_def){.kind = GAUGE_GRAIN_FORCE, .index = 4}, value);
    assert_true(isnan(value[0]));
    silt_grain_gauge(&view, &(silt_gauge_def){.kind = GAUGE_GRAIN_FORCE, .index = 7}, value);
    assert_true(value[0] == 3);
    silt_grain_gauge(&view, &(silt_gauge_def){.kind = GAUGE_GRAIN_PLACE, .index = 7}, value);
    assert_true(value[0] == x[9] && value[1] == x[10]);
}

int main(void) {
    const struct CMUnitTest test[] = {cmocka_unit_test(test_forms), cmocka_unit_test(test_most), cmocka_unit_test(test_clear),
                                      cmocka_unit_test(test_sieve), cmocka_unit_test(test_seed), cmocka_unit_test(test_many),
                                      cmocka_unit_test(test_space), cmocka_unit_test(test_heap)};
    snprintf(folder, sizeof folder, "/tmp/silt-fill-XXXXXX");
    if (!mkdtemp(folder))
        return 1;
    const int failed = cmocka_run_group_tests(test, NULL, NULL);
    char command[4200];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command) != 0 || failed;
}
