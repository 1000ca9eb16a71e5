// walls in two and three dimensions: distances and signs, surfaces from files, shares, none at all
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <unistd.h>

#include "wall_bench.h"

// ---------------------------------------------------------------- distances

static const double tank[8] = {0, 1, 0, 0, 2, 0, 2, 1};

static void test_distance_plane(void **state) {
    (void)state;
    bench *b = bench_new(2);
    // an L: a step of the floor at x = 1
    bench_chain(b, 6, (const double[]){0, 1, 0, 0, 1, 0, 1, 0.5, 2, 0.5, 2, 1}, true, WALL_SLIP);
    bench_make(b);
    int e;
    assert_near(distance_at(b, 0.5, 0.25, 0, &e), 0.25, 1e-15);
    assert_int_equal(e, 1);
    assert_near(distance_at(b, 0.9, 0.6, 0, &e), hypot(0.1, 0.1), 1e-15); // the corner that points into the water
    assert_near(distance_at(b, 1.1, 0.4, 0, &e), -0.1, 1e-15);
    assert_near(distance_at(b, -0.3, -0.4, 0, &e), -0.5, 1e-15); // beyond an inner corner
    assert_near(distance_at(b, 1, 0.5, 0, &e), 0, 0);
    assert_int_equal(b->walls.patch[0] == b->walls.patch[1], 0);
    bench_free(b);
}

// a plate that stands on the floor, or is sunk into it: inside is inside
static void test_distance_plate(void **state) {
    (void)state;
    for (int sunk = 0; sunk < 2; sunk++) {
        bench *b = bench_new(2);
        const double foot = sunk ? -0.05 : 0;
        bench_chain(b, 4, tank, false, WALL_SLIP);
        bench_chain(b, 4, (const double[]){1, foot, 1, 0.8, 1.02, 0.8, 1.02, foot}, true, WALL_SLIP);
        bench_make(b);
        for (int k = 1; k < 200; k++) {
            assert_true(distance_at(b, 1.01, 0.8 * k / 200, 0, NULL) < 0);
            assert_true(distance_at(b, 1 + 0.02 * k / 200, 1e-4, 0, NULL) < 0);
            assert_true(distance_at(b, 1 + 0.02 * k / 200, -1e-4, 0, NULL) < 0);
            assert_true(distance_at(b, 0.9999 - 0.01 * k, 1e-4, 0, NULL) > 0 || 0.9999 - 0.01 * k < 0);
            assert_true(distance_at(b, 1.0201, 0.85 * k / 200, 0, NULL) > 0);
        }
        assert_near(distance_at(b, 0.97, 0.84, 0, NULL), hypot(0.03, 0.04), 1e-15);
        assert_near(distance_at(b, 1.01, 0.81, 0, NULL), 0.01, 1e-15);
        bench_free(b);
    }
}

// points by the hundred against the nearest of all elements, one by one
static void check_brute(const bench *b, int n, double size, uint64_t seed) {
    for (int k = 0; k < n; k++) {
        double x[3], on[3], least = HUGE_VAL;
        int feature, e;
        for (int d = 0; d < 3; d++)
            x[d] = size * (2 * silt_uniform(&seed) - 1);
        for (int f = 0; f < b->walls.count; f++)
            least = silt_min(least, wall_nearest(&b->walls, f, x, on, &feature));
        assert_near(fabs(silt_walls_distance(&b->walls, x, &e)), sqrt(least), 1e-14);
        assert_near(wall_nearest(&b->walls, e, x, on, &feature), least, 1e-12);
    }
}

static void test_distance_box(void **state) {
    (void)state;
    bench *b = bench_new(3);
    bench_box(b, 2, 1, 1, WALL_SLIP);
    bench_make(b);
    assert_int_equal(b->walls.count, 12);
    int e;
    assert_near(distance_at(b, 1, 0.5, 0.2, &e), 0.2, 1e-15);
    assert_point(b->walls.normal[e], 0, 0, 1, 3, 0);
    assert_near(distance_at(b, 1.9, 0.5, 0.5, &e), 0.1, 1e-15);
    assert_point(b->walls.normal[e], -1, 0, 0, 3, 0);
    assert_near(distance_at(b, -0.3, -0.4, 0.5, NULL), -0.5, 1e-15);
    assert_near(distance_at(b, 2.1, 1.2, 1.2, NULL), -0.3, 1e-15);
    for (int f = 0; f < 12; f++)
        for (int k = 0; k < 3; k++)
            assert_true(b->walls.joined[f][k] >= 0);
    // six patches, every joint of two of them holds water
    int patches = 0;
    for (int f = 0; f < 12; f++)
        patches += b->walls.patch[f] == f;
    assert_int_equal(patches, 6);
    bench_free(b);
}

// a prism over an L, with edges and vertices where the nearest triangle alone would give the wrong side
static void test_distance_step(void **state) {
    (void)state;
    const double l[12] = {0, 0, 2, 0, 2, 0.5, 1, 0.5, 1, 1, 0, 1};
    char *path = path_of(".stl");
    for (int inside_out = 0; inside_out < 2; inside_out++) {
        shape *s = prism(6, l);
        write_stl(path, s, false);
        bench *b = bench_new(3);
        bench_file(b, path, WALL_SLIP)->inside_out = inside_out;
        bench_make(b);
        uint64_t seed = 3;
        for (int k = 0; k < 5000; k++) {
            const double x = -0.5 + 3 * silt_uniform(&seed), y = -0.5 + 2 * silt_uniform(&seed), z = -0.5 + 2 * silt_uniform(&seed);
            const bool in = y > 0 && y < 1 && z > 0 && x > 0 && ((x < 2 && z < 0.5) || (x < 1 && z < 1));
            assert_true((distance_at(b, x, y, z, NULL) > 0) == (in == inside_out));
        }
        check_brute(b, 200, 2, 5);
        bench_free(b);
        free(s);
    }
    unlink(path);
    free(path);
}

static void test_distance_ball(void **state) {
    (void)state;
    char *path = path_of(".stl");
    shape *s = ball(20);
    write_stl(path, s, true);
    bench *b = bench_new(3);
    bench_file(b, path, WALL_SLIP)->scale = 2;
    bench_make(b);
    assert_int_equal(b->walls.count, s->n_triangle);
    // one patch, and all corners shared
    for (int e = 0; e < b->walls.count; e++) {
        assert_int_equal(b->walls.patch[e], 0);
        assert_true(b->walls.joined[e][0] >= 0 && b->walls.joined[e][1] >= 0 && b->walls.joined[e][2] >= 0);
    }
    assert_int_equal(b->walls.index->n_vertex, s->n_point);
    check_brute(b, 200, 3, 7);
    uint64_t seed = 11;
    for (int k = 0; k < 2000; k++) {
        const double x = 6 * silt_uniform(&seed) - 3, y = 6 * silt_uniform(&seed) - 3, z = 6 * silt_uniform(&seed) - 3;
        // the facets lie up to 2 (1 - cos^2(pi / 40)) inside of the sphere
        const double d = distance_at(b, x, y, z, NULL), r = sqrt(x * x + y * y + z * z) - 2;
        assert_true(d > r - 1e-6 && d < r + 0.026);
    }
    bench_free(b);
    free(s);
    unlink(path);
    free(path);
}

// a hundred thousand triangles: the cost of a question does not grow with them
static void test_distance_many(void **state) {
    (void)state;
    double seconds[2];
    char *path = path_of(".stl");
    for (int turn = 0; turn < 2; turn++) {
        shape *s = ball(turn ? 158 : 16);
        write_stl(path, s, true);
        bench *b = bench_new(3);
        bench_file(b, path, WALL_SLIP);
        bench_make(b);
        uint64_t seed = 5;
        double sum = 0;
        const double since = silt_seconds();
        for (int k = 0; k < 20000; k++) {
            const double t = M_PI * silt_uniform(&seed), p = 7 * silt_uniform(&seed), r = 0.97 + 0.06 * silt_uniform(&seed);
            sum += distance_at(b, r * sin(t) * cos(p), r * sin(t) * sin(p), r * cos(t), NULL);
        }
        seconds[turn] = silt_seconds() - since;
        assert_true(isfinite(sum));
        print_message("%d triangles: %.2f us a distance\n", b->walls.count, 50 * seconds[turn]);
        bench_free(b);
        free(s);
    }
    assert_true(seconds[1] < 20 * seconds[0]);
    unlink(path);
    free(path);
}

// ---------------------------------------------------------------- files

static void test_files_agree(void **state) {
    (void)state;
    shape *s = ball(8);
    const char *const ending[4] = {"-text.stl", "-binary.stl", "-22.msh", "-41.msh"};
    silt_surface first = {0};
    for (int k = 0; k < 4; k++) {
        char *path = path_of(ending[k]);
        if (k < 2)
            write_stl(path, s, k);
        else
            write_msh(path, s, k == 3);
        silt_surface surface;
        silt_error err = {0};
        if (silt_surface_read(path, 1, false, &surface, &err) != SILT_OK)
            fail_msg("%s", err.text);
        assert_int_equal(surface.n_triangle, s->n_triangle);
        assert_int_equal(surface.n_point, s->n_point);
        assert_int_equal(surface.n_degenerate, 0);
        for (int t = 0; k && t < surface.n_triangle; t++)
            for (int c = 0; c < 3; c++)
                for (int d = 0; d < 3; d++)
                    assert_near(surface.point[surface.triangle[t][c]][d], first.point[first.triangle[t][c]][d], 1e-7);
        if (k)
            silt_surface_clear(&surface);
        else
            first = surface;
        unlink(path);
        free(path);
    }
    silt_surface_clear(&first);
    free(s);
}

static void refused(const char *ending, const char *text, size_t size, const char *why) {
    char *path = path_of(ending);
    write_bytes(path, text, size);
    silt_surface surface;
    silt_error err = {0};
    assert_int_equal(silt_surface_read(path, 1, false, &surface, &err), SILT_INPUT);
    assert_non_null(strstr(err.text, path));
    if (!strstr(err.text, why))
        fail_msg("'%s' does not say '%s'", err.text, why);
    assert_null(surface.point);
    unlink(path);
    free(path);
}

#define FACET(x) "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex " x " 1 0\nendloop\nendfacet\n"

static void test_files_wrong(void **state) {
    (void)state;
    silt_surface surface;
    silt_error err = {0};
    assert_int_equal(silt_surface_read("/nowhere/a.stl", 1, false, &surface, &err), SILT_INPUT);
    assert_non_null(strstr(err.text, "/nowhere/a.stl"));
    const struct {
        const char *ending, *text, *why;
    } wrong[] = {
        {".stl", "", "neither"},
        {".stl", "hello\n", "neither"},
        {".stl", "solid a\nendsolid a\n", "no triangles"},
        {".stl", "solid a\n" FACET("0"), ":9: found the end"},
        {".stl", "solid a\n" FACET("nan") "endsolid\n", ":6: found 'nan'"},
        {".stl", "solid a\n" FACET("x") "endsolid\n", ":6: found 'x'"},
        {".stl", "solid a\n" FACET("0 0 0 0 vertex 2") "endsolid\n", ":6: found '0'"},
        {".stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n", ":6: found 'endloop'"},
        {".stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid\n", "no triangles"},
        {".stl", "solid a\n" FACET("0") FACET("1") "endsolid\n", "triangle 2: found it turned against its neighbour 1"},
        {".msh", "", "$MeshFormat"},
        {".msh", "$MeshFormat\n4.1 1 8\n", "binary"},
        {".msh", "$MeshFormat\n3.0 0 8\n", "version 3"},
        {".msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n", ":8: found the end"},
        {".msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n1 2 2 0 1 1 2 3\n", "found node 2"},
        {".msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Elements\n1\n1 99 2 0 1 1 2 3\n", "type 99"},
        {".msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n-4\n", "whole number"},
        {".msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n99999999999999999999\n", "whole number"},
        {".msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 3 1 3\n2 1 0 3\n1\n2\n", "found the end"},
    };
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++)
        refused(wrong[k].ending, wrong[k].text, strlen(wrong[k].text), wrong[k].why);
    // binary: cut off, and a corner that is no number
    char data[184] = "binary";
    data[80] = 2;
    refused(".stl", data, 183, "84 + 50 bytes");
    memset(data + 84 + 12, 0xff, 4);
    refused(".stl", data, 184, "triangle 1");
    // degenerate ones are counted
    char *path = path_of(".stl");
    const char *good = "solid a\n" FACET("0")
        "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 2 0 0\nendloop\nendfacet\nendsolid\n";
    write_bytes(path, good, strlen(good));
    assert_int_equal(silt_surface_read(path, 1, false, &surface, &err), SILT_OK);
    assert_int_equal(surface.n_triangle, 1);
    assert_int_equal(surface.n_degenerate, 1);
    silt_surface_clear(&surface);
    unlink(path);
    free(path);
}

// files with bytes changed, lost and doubled are read or refused, nothing else
static void test_files_fuzzed(void **state) {
    (void)state;
    shape *s = ball(3);
    const char *const ending[4] = {"-fuzz.stl", "-fuzzb.stl", "-fuzz2.msh", "-fuzz4.msh"};
    uint64_t seed = 17;
    int refusals = 0;
    for (int kind = 0; kind < 4; kind++) {
        char *path = path_of(ending[kind]);
        if (kind < 2)
            write_stl(path, s, kind);
        else
            write_msh(path, s, kind == 3);
        FILE *from = fopen(path, "rb");
        static char data[20000], other[20000];
        const size_t size = fread(data, 1, sizeof data / 2, from);
        fclose(from);
        for (int turn = 0; turn < 400; turn++) {
            memcpy(other, data, size);
            size_t length = size;
            for (int change = 1 + (int)(silt_random(&seed) % 4); change > 0; change--) {
                const size_t at = silt_random(&seed) % length;
                switch (silt_random(&seed) % 4) {
                case 0:
                    other[at] = (char)silt_random(&seed);
                    break;
                case 1:
                    other[at] = "0123456789.-e$ \n"[silt_random(&seed) % 16];
                    break;
                case 2:
                    length = at + 1;
                    break;
                default:
                    memmove(other + at, other + at / 2, length - at);
                }
            }
            write_bytes(path, other, length);
            silt_surface surface;
            silt_error err = {0};
            const silt_status status = silt_surface_read(path, 1, turn % 2, &surface, &err);
            assert_true(status == SILT_OK || (status == SILT_INPUT && err.text[0]));
            refusals += status != SILT_OK;
            if (status == SILT_OK) {
                bench *b = bench_new(3);
                bench_file(b, path, WALL_SLIP);
                bench_make(b);
                assert_true(isfinite(distance_at(b, 0.1, 0.2, 0.3, NULL)));
                bench_free(b);
            }
            silt_surface_clear(&surface);
        }
        unlink(path);
        free(path);
    }
    assert_true(refusals > 100);
    free(s);
}

// facets between nodes of one patch lie on the wall
static void test_share(void **state) {
    (void)state;
    bench *b = bench_new(3);
    bench_box(b, 1, 1, 1, WALL_SLIP);
    bench_make(b);
    int element[5][3];
    double on[3];
    const double x[5][3] = {{0.3, 0.2, 0}, {0.8, 0.9, 0}, {0.5, 0, 0}, {1, 1, 0}, {0.5, 0, 0.5}};
    for (int k = 0; k < 5; k++)
        silt_walls_touching(&b->walls, x[k], 1e-9, element[k], on);
    const int *floor_[3] = {element[0], element[1], element[2]}, *mixed[3] = {element[0], element[1], element[4]};
    const int *corner[3] = {element[0], element[3], element[2]};
    assert_true(silt_walls_share(&b->walls, 3, floor_));
    assert_true(silt_walls_share(&b->walls, 3, corner));
    assert_false(silt_walls_share(&b->walls, 3, mixed));
    bench_free(b);
}

// a scene without walls, walls cleared twice
static void test_empty(void **state) {
    (void)state;
    for (int dim = 2; dim < 4; dim++) {
        bench *b = bench_new(dim);
        bench_make(b);
        int e, element[3];
        double on[3], *point;
        int(*ridge)[3];
        assert_true(silt_walls_distance(&b->walls, (double[]){0, 0, 0}, &e) == HUGE_VAL && e == -1);
        assert_int_equal(silt_walls_touching(&b->walls, (double[]){0, 0, 0}, 1, element, on), 0);
        assert_int_equal(silt_walls_ridges(&b->walls, 0.1, &point, &ridge), 0);
        silt_walls_move(&b->walls, &b->scene, 1, 0.1);
        node_at(b, (double[]){0, 0, 0}, (double[]){1, 0, 0}, -1, -1);
        step(b, 0.1, 0.1);
        silt_walls_clear(&b->walls);
        bench_free(b);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_empty),
        cmocka_unit_test(test_distance_plane),
        cmocka_unit_test(test_distance_plate),
        cmocka_unit_test(test_distance_box),
        cmocka_unit_test(test_distance_step),
        cmocka_unit_test(test_distance_ball),
        cmocka_unit_test(test_distance_many),
        cmocka_unit_test(test_files_agree),
        cmocka_unit_test(test_files_wrong),
        cmocka_unit_test(test_files_fuzzed),
        cmocka_unit_test(test_share),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
