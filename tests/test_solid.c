// forms of bodies in space: volume, centroid and inertia against formulas, what is refused, the surface at the water's size, clumps
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
// clang-format off
#include <cmocka.h>
// clang-format on
#include "check.h"
#include "../dem-coupling/form.h"
#include "coupling.h"

typedef struct moments {
    double volume, xx, yy, zz;
} moments;

static moments box(double a, double b, double c) {
    const double v = a * b * c;
    return (moments){v, v * (b * b + c * c) / 12, v * (a * a + c * c) / 12, v * (a * a + b * b) / 12};
}

// inertia of density 1 about the centroid, the products zero
static void holds(const silt_solid *s, moments m, double tolerance, const char *what) {
    near(s->volume, m.volume, tolerance * m.volume, what);
    near(s->inertia[0], m.xx, tolerance * m.xx, what);
    near(s->inertia[1], m.yy, tolerance * m.yy, what);
    near(s->inertia[2], m.zz, tolerance * m.zz, what);
    for (int k = 3; k < 6; k++)
        near(s->inertia[k], 0, 1e-9 * m.xx, what);
    for (int d = 0; d < 3; d++)
        near(s->centroid[d], 0, 1e-9 * s->radius, what);
}

static void expect(silt_body_def def, moments m, double tolerance, const char *what) {
    silt_solid s;
    def.name = (char *)(uintptr_t)what;
    OK(silt_form_create(&s, &def, &error));
    holds(&s, m, tolerance, what);
    silt_solid_clear(&s);
}

static void test_formulas(void **state) {
    (void)state;
    expect((silt_body_def){.shape = SHAPE_BOX, .scale = 0.4, .height = 0.3, .depth = 0.7}, box(0.4, 0.7, 0.3), 1e-12, "box");
    expect((silt_body_def){.shape = SHAPE_BOX, .scale = 2}, box(2, 2, 2), 1e-12, "cube");
    const double r = 0.15, v = 4 * M_PI / 3 * r * r * r;
    expect((silt_body_def){.shape = SHAPE_SPHERE, .scale = 2 * r}, (moments){v, 0.4 * v * r * r, 0.4 * v * r * r, 0.4 * v * r * r}, 1e-5, "sphere");
    const double l = 0.5, c = M_PI * r * r * l;
    expect((silt_body_def){.shape = SHAPE_CYLINDER, .scale = 2 * r, .height = l},
           (moments){c, c * (3 * r * r + l * l) / 12, c * (3 * r * r + l * l) / 12, c * r * r / 2}, 1e-5, "cylinder");
    // cylinder of length l with half a sphere at each end
    const double across = c * (l * l / 12 + r * r / 4) + v * (0.4 * r * r + l * l / 4 + 3 * l * r / 8);
    expect((silt_body_def){.shape = SHAPE_CAPSULE, .scale = l + 2 * r, .height = 2 * r}, (moments){c + v, c * r * r / 2 + 0.4 * v * r * r, across, across}, 2e-4, "capsule");
    const double w = 0.4, h = 0.3, d = 0.7, wedge = w * h * d / 2;
    expect((silt_body_def){.shape = SHAPE_WEDGE, .scale = w, .height = h, .depth = d},
           (moments){wedge, wedge * (h * h / 18 + d * d / 12), wedge * (w * w / 24 + h * h / 18), wedge * (w * w / 24 + d * d / 12)}, 1e-12, "wedge");
}

// an L of 1 by 1 less a square of 0.6, 0.5 deep: two boxes, which the parallel axes put together; turned, products are not zero
static void test_prism(void **state) {
    (void)state;
    double corner[] = {0, 0, 0, 1, 0, 0, 1, 0.4, 0, 0.4, 0.4, 0, 0.4, 1, 0, 0, 1, 0};
    const silt_body_def def = {.name = "angle", .shape = SHAPE_POLYGON, .depth = 0.5, .n_point = 6, .point = corner};
    silt_solid s;
    OK(silt_form_create(&s, &def, &error));
    const double size[2][2] = {{1, 0.4}, {0.4, 0.6}}, at[2][2] = {{0.5, 0.2}, {0.2, 0.7}};
    double volume = 0, middle[2] = {0}, tensor[4] = {0};
    for (int k = 0; k < 2; k++) {
        const double v = 0.5 * size[k][0] * size[k][1];
        volume += v;
        middle[0] += v * at[k][0];
        middle[1] += v * at[k][1];
    }
    for (int k = 0; k < 2; k++) {
        const double v = 0.5 * size[k][0] * size[k][1], x = at[k][0] - middle[0] / volume, z = at[k][1] - middle[1] / volume;
        const moments own = box(size[k][0], 0.5, size[k][1]);
        tensor[0] += own.xx + v * z * z;
        tensor[1] += own.yy + v * (x * x + z * z);
        tensor[2] += own.zz + v * x * x;
        tensor[3] -= v * x * z;
    }
    near(s.volume, volume, 1e-12, "volume");
    near(s.inertia[0], tensor[0], 1e-12, "xx");
    near(s.inertia[1], tensor[1], 1e-12, "yy");
    near(s.inertia[2], tensor[2], 1e-12, "zz");
    near(s.inertia[3], 0, 1e-12, "xy");
    near(s.inertia[4], tensor[3], 1e-12, "xz");
    near(s.inertia[5], 0, 1e-12, "yz");
    // the notch is outside
    assert_false(silt_solid_contains(&s, (double[3]){0.7 - middle[0] / volume, 0, 0.7 - middle[1] / volume}));
    assert_true(silt_solid_contains(&s, (double[3]){0.2 - middle[0] / volume, 0.2, 0.9 - middle[1] / volume}));
    near(silt_solid_distance(&s, (double[3]){0.7 - middle[0] / volume, 0, 0.7 - middle[1] / volume}, NULL, NULL), 0.3, 1e-12, "distance");
    near(silt_form_thickness(&s), 0.4, 1e-12, "thickness");
    silt_solid_clear(&s);
}

static void span(const silt_solid *s, int axis, double *lo, double *hi) {
    *lo = HUGE_VAL;
    *hi = -HUGE_VAL;
    for (int i = 0; i < s->n_point; i++) {
        *lo = silt_min(*lo, s->point[i][axis]);
        *hi = silt_max(*hi, s->point[i][axis]);
    }
}

// volume 0.280 h3; four legs alike: the same inertia about every axis; a cone's point on the surface, and one behind it
static void test_tetrapod(void **state) {
    (void)state;
    const silt_body_def def = {.name = "tetrapod", .shape = SHAPE_TETRAPOD, .scale = 2};
    silt_solid s;
    double lo, hi;
    OK(silt_form_create(&s, &def, &error));
    near(s.volume, 0.280 * 8, 0.001 * 0.280 * 8, "volume");
    near(s.inertia[1], s.inertia[0], 2e-4 * s.inertia[0], "yy");
    near(s.inertia[2], s.inertia[0], 2e-4 * s.inertia[0], "zz");
    for (int k = 3; k < 6; k++)
        near(s.inertia[k], 0, 2e-4 * s.inertia[0], "product");
    span(&s, 2, &lo, &hi);
    near(hi - lo, 2, 1e-3, "height");
    near(hi, 2 * 0.6432, 1e-3, "leg");
    // between two legs
    assert_false(silt_solid_contains(&s, (double[3]){0.5, 0, 0.5}));
    assert_true(silt_solid_contains(&s, (double[3]){0, 0, 1.2}));
    silt_solid_clear(&s);
}

// slab, eight columns, entablature and roof
static void test_temple(void **state) {
    (void)state;
    const silt_body_def def = {.name = "temple", .shape = SHAPE_TEMPLE, .scale = 2, .depth = 3};
    silt_solid s;
    double lo, hi;
    OK(silt_form_create(&s, &def, &error));
    near(s.volume, 8 * (1.5 * 0.06 + 8 * 0.12 * 0.12 * 0.4 + 1.5 * 0.1 + 1.5 * 0.5 * 0.19), 1e-9, "volume");
    for (int k = 3; k < 6; k++)
        near(s.inertia[k], 0, 1e-9, "product");
    span(&s, 1, &lo, &hi);
    near(hi - lo, 3, 1e-12, "depth");
    span(&s, 2, &lo, &hi);
    near(hi - lo, 1.5, 1e-12, "height");
    near(silt_form_thickness(&s), 0.12, 1e-9, "slab");
    silt_solid_clear(&s);
}

// ---------------------------------------------------------------- files

static const int cube_face[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};

// a cube of side 1 at the origin; left_out: a face that is not written, turned: one that is the wrong way round, all: 12
static void write_cube(const char *path, int left_out, int turned) {
    FILE *to = fopen(path, "w");
    fprintf(to, "solid cube\n");
    for (int f = 0; f < 12; f++) {
        if (f == left_out)
            continue;
        fprintf(to, "facet normal 0 0 0\nouter loop\n");
        for (int k = 0; k < 3; k++) {
            const int i = cube_face[f][turned == 12 || turned == f ? 2 - k : k];
            fprintf(to, "vertex %d %d %d\n", i & 1, i >> 1 & 1, i >> 2);
        }
        fprintf(to, "endloop\nendfacet\n");
    }
    fprintf(to, "endsolid\n");
    fclose(to);
}

static void refused(silt_body_def def, const char *word) {
    silt_solid s;
    error = (silt_error){0};
    assert_int_equal(silt_form_create(&s, &def, &error), SILT_INPUT);
    if (!strstr(error.text, word) || !strstr(error.text, def.name))
        fail_msg("'%s' says nothing of '%s'", error.text, word);
}

static void test_files(void **state) {
    (void)state;
    char path[] = "test_solid_cube.stl";
    silt_body_def def = {.name = "cube", .shape = SHAPE_SURFACE, .file = path};
    write_cube(path, -1, -1);
    expect(def, box(1, 1, 1), 1e-12, "cube");
    def.scale = 0.5;
    expect(def, box(0.5, 0.5, 0.5), 1e-12, "half a cube");
    def.scale = 0;
    write_cube(path, 3, -1);
    refused(def, "open");
    write_cube(path, -1, 12);
    refused(def, "inside out");
    write_cube(path, -1, 5);
    refused(def, "turned against");
    // a square from both sides
    static const int sheet[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
    FILE *to = fopen(path, "w");
    fprintf(to, "solid sheet\n");
    for (int f = 0; f < 4; f++) {
        fprintf(to, "facet normal 0 0 0\nouter loop\n");
        for (int k = 0; k < 3; k++)
            fprintf(to, "vertex %d %d 0\n", sheet[f][k] == 1 || sheet[f][k] == 2, sheet[f][k] >= 2);
        fprintf(to, "endloop\nendfacet\n");
    }
    fprintf(to, "endsolid\n");
    fclose(to);
    refused(def, "no volume");
    // two tetrahedra of which one lies across a face of the other
    to = fopen(path, "w");
    fprintf(to, "solid two\n");
    for (int t = 0; t < 2; t++) {
        const double x[4][3] = {{t * 0.2, t * 0.2, t * 0.1}, {1 + t * 0.2, t * 0.2, t * 0.1}, {t * 0.2, 1 + t * 0.2, t * 0.1}, {t * 0.2, t * 0.2, 1 + t * 0.1}};
        static const int face[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
        for (int f = 0; f < 4; f++) {
            fprintf(to, "facet normal 0 0 0\nouter loop\n");
            for (int k = 0; k < 3; k++)
                fprintf(to, "vertex %.17g %.17g %.17g\n", x[face[f][k]][0], x[face[f][k]][1], x[face[f][k]][2]);
            fprintf(to, "endloop\nendfacet\n");
        }
    }
    fprintf(to, "endsolid\n");
    fclose(to);
    refused(def, "crossing itself");
    remove(path);
    refused((silt_body_def){.name = "coin", .shape = SHAPE_DISC, .scale = 1}, "sphere");
    refused((silt_body_def){.name = "pill", .shape = SHAPE_CAPSULE, .scale = 1, .height = 1}, "longer than thick");
}

// ---------------------------------------------------------------- the water's size, and clumps

// the same volume with edges of about h, corners kept
static void test_mesh(void **state) {
    (void)state;
    static const struct {
        silt_body_def def;
        double h;
        int corners; // of the box around it that are points
    } form[] = {
        {{.name = "cube", .shape = SHAPE_BOX, .scale = 1}, 0.13, 8},
        {{.name = "plate", .shape = SHAPE_BOX, .scale = 1, .height = 0.1, .depth = 0.4}, 0.1, 8},
        {{.name = "sphere", .shape = SHAPE_SPHERE, .scale = 1}, 0.05, 0},
        {{.name = "cylinder", .shape = SHAPE_CYLINDER, .scale = 1, .height = 0.7}, 0.08, 0},
        {{.name = "capsule", .shape = SHAPE_CAPSULE, .scale = 1}, 0.08, 0},
        {{.name = "wedge", .shape = SHAPE_WEDGE, .scale = 1, .height = 0.6}, 0.1, 4},
        {{.name = "tetrapod", .shape = SHAPE_TETRAPOD, .scale = 1}, 0.06, 0},
        {{.name = "temple", .shape = SHAPE_TEMPLE, .scale = 1}, 0.05, 4},
    };
    for (size_t k = 0; k < sizeof form / sizeof *form; k++) {
        silt_solid s, mesh;
        const double since = silt_seconds();
        OK(silt_form_create(&s, &form[k].def, &error));
        OK(silt_solid_mesh(&s, form[k].h, form[k].def.name, &mesh, &error));
        double shortest = HUGE_VAL, longest = 0, narrow = 0, off = 0;
        for (int f = 0; f < mesh.n_face; f++) {
            double length[3], most = 0, half = 0;
            for (int c = 0; c < 3; c++) {
                const double *a = mesh.point[mesh.face[f][c]], *b = mesh.point[mesh.face[f][(c + 1) % 3]];
                length[c] = silt_length(3, (double[3]){b[0] - a[0], b[1] - a[1], b[2] - a[2]});
                shortest = silt_min(shortest, length[c]);
                most = silt_max(most, length[c]);
                half += length[c] / 2;
            }
            longest = silt_max(longest, most);
            // longest edge over height: 1.15 where all are alike
            const double area = sqrt(half * (half - length[0]) * (half - length[1]) * (half - length[2]));
            narrow = silt_max(narrow, most * most / (2 * area));
        }
        for (int i = 0; i < mesh.n_point; i++)
            off = silt_max(off, fabs(silt_solid_distance(&s, mesh.point[i], NULL, NULL)));
        int corners = 0;
        double lo[3], hi[3];
        for (int d = 0; d < 3; d++)
            span(&s, d, &lo[d], &hi[d]);
        for (int i = 0; i < mesh.n_point; i++) {
            bool at = true;
            for (int d = 0; d < 3; d++)
                at &= fabs(mesh.point[i][d] - lo[d]) < 1e-12 || fabs(mesh.point[i][d] - hi[d]) < 1e-12;
            corners += at;
        }
        print_message("%s: %d points, edges %.2f to %.2f h, longest over height %.2f, off %.4f h, %.2f s\n", form[k].def.name, mesh.n_point,
                      shortest / form[k].h, longest / form[k].h, narrow, off / form[k].h, silt_seconds() - since);
        near(mesh.volume, s.volume, 1e-12 * s.volume, form[k].def.name);
        near(longest, form[k].h, 0.45 * form[k].h, form[k].def.name);
        assert_int_equal(mesh.n_point - mesh.n_face / 2, s.n_point - s.n_face / 2); // as many holes
        assert_true(shortest > 0.3 * form[k].h && narrow < 6 && off < 0.05 * form[k].h);
        assert_int_equal(corners, form[k].corners);
        silt_solid_clear(&mesh);
        silt_solid_clear(&s);
    }
}

// no sphere stands out, and the error is what was asked for
static void test_clump(void **state) {
    (void)state;
    static const struct {
        silt_body_def def;
        double error;
    } form[] = {
        {{.name = "cube", .shape = SHAPE_BOX, .scale = 1}, 0},
        {{.name = "cube", .shape = SHAPE_BOX, .scale = 1}, 0.05},
        {{.name = "sphere", .shape = SHAPE_SPHERE, .scale = 1}, 0.01},
        {{.name = "cylinder", .shape = SHAPE_CYLINDER, .scale = 1, .height = 0.7}, 0.04},
        // a face of its top once folded over, and a point of it had no inside
        {{.name = "post", .shape = SHAPE_CYLINDER, .scale = 0.16, .height = 0.8}, 0.16 / 15},
        {{.name = "tetrapod", .shape = SHAPE_TETRAPOD, .scale = 1}, 0.03},
    };
    for (size_t k = 0; k < sizeof form / sizeof *form; k++) {
        silt_solid s;
        silt_clump clump = {0};
        const double since = silt_seconds();
        OK(silt_form_create(&s, &form[k].def, &error));
        silt_form_clump(&clump, &s, form[k].error);
        print_message("%s: %d spheres of %.3f to %.3f, error %.4f (asked %.4f), %.2f s\n", form[k].def.name, clump.n_sphere, clump.smallest, clump.largest,
                      clump.error, form[k].error, silt_seconds() - since);
        for (int i = 0; i < clump.n_sphere; i++) {
            const double *ball = clump.sphere + 4 * i;
            assert_true(silt_solid_distance(&s, ball, NULL, NULL) < -ball[3] * (1 - 3e-3));
        }
        // measured at other points of the surface
        near(silt_form_clump_error(&clump, &s), clump.error, silt_max(0.3 * clump.error, 1e-3), "error");
        if (form[k].error > 0)
            assert_true(clump.error <= form[k].error);
        silt_clump_clear(&clump);
        silt_solid_clear(&s);
    }
}

// ---------------------------------------------------------------- scenes that are refused when the surfaces are made

#define SCENE                                                                                                          \
    "silt: 1\ntime: {end: 1, output: 0.1}\ndimension: 3\ngravity: [0, 0, -9.81]\n"                                     \
    "fluid: {density: 1000, viscosity: 0.001, size: 0.1, regions: [{box: [[0, 0, 0], [2, 1, 1]]}]}\n"                  \
    "walls: [{box: [[0, 0, 0], [2, 1, 1]]}]\n"                                                                         \
    "contact: {youngs_modulus: 1e7, poissons_ratio: 0.3, restitution: 0.5, friction: 0.5, rolling_friction: 0.1}\nbodies:\n"

static void scene_refused(const char *bodies, const char *name, const char *word) {
    static const char path[] = "test_solid_scene.yaml";
    FILE *to = fopen(path, "w");
    fprintf(to, "%s%s", SCENE, bodies);
    fclose(to);
    silt_scene *scene;
    OK(silt_scene_read(path, 0, NULL, &scene, &error));
    silt_walls walls = {0};
    OK(silt_walls_create(&walls, scene, &error));
    silt_coupling_def def = {.scene = scene, .walls = &walls, .worker = "none", .log = "none", .lo = {-1, -1, -1}, .hi = {3, 2, 2}};
    silt_coupling *coupling = NULL;
    error = (silt_error){0};
    const silt_status status = silt_coupling_dem.open(&coupling, &def, &error);
    if (status != SILT_INPUT)
        fail_msg("status %d for %s: %s", status, bodies, error.text);
    if (!strstr(error.text, name) || !strstr(error.text, word))
        fail_msg("'%s' says nothing of '%s' or '%s'", error.text, name, word);
    silt_walls_clear(&walls);
    silt_scene_free(&scene);
    remove(path);
}

static void test_scenes(void **state) {
    (void)state;
    scene_refused("  - {name: a, shape: box, at: [0.5, 0.5, 0.5], scale: 0.4, density: 700}\n"
                  "  - {name: b, shape: sphere, at: [0.8, 0.5, 0.5], scale: 0.3, density: 700}\n", "body b", "overlapping body 'a'");
    // one within the other
    scene_refused("  - {name: a, shape: box, at: [0.5, 0.5, 0.5], scale: 0.6, density: 700}\n"
                  "  - {name: b, shape: box, at: [0.5, 0.5, 0.5], scale: 0.3, density: 700}\n", "body b", "overlapping body 'a'");
    scene_refused("  - {name: plate, shape: box, at: [0.5, 0.5, 0.5], scale: 0.6, height: 0.05, density: 700}\n", "body plate", "0.05 m thick");
    scene_refused("  - {name: deep, shape: box, at: [0.5, 0.5, 0.1], scale: 0.4, density: 700}\n", "body deep", "behind a wall");
    write_cube("test_solid_open.stl", 7, -1);
    scene_refused("  - {name: cup, shape: surface, file: test_solid_open.stl, scale: 0.3, at: [0.5, 0.5, 0.5], density: 700}\n", "body cup", "open");
    remove("test_solid_open.stl");
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_formulas), cmocka_unit_test(test_prism), cmocka_unit_test(test_tetrapod), cmocka_unit_test(test_temple),
        cmocka_unit_test(test_files),    cmocka_unit_test(test_mesh),  cmocka_unit_test(test_clump),
        cmocka_unit_test(test_scenes),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
