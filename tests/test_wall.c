// walls in two and three dimensions: distances and signs, surfaces from files, sliding, creases, corners, motion
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <unistd.h>

#include "wall.h"

// ---------------------------------------------------------------- scenes by hand

enum { MOST_WALLS = 4, MOST_NODES = 1000 };

typedef struct bench {
    silt_scene scene;
    silt_wall wall[MOST_WALLS];
    silt_walls walls;
    silt_nodes nodes;
    double old[3 * MOST_NODES];
    uint8_t interior[MOST_NODES];
} bench;

static bench *bench_new(int dim) {
    bench *b = silt_alloc(1, sizeof *b);
    b->scene.dimension = dim;
    b->scene.wall = b->wall;
    b->nodes.dim = dim;
    return b;
}

static silt_wall *bench_chain(bench *b, int n, const double *xy, bool closed, silt_condition condition) {
    silt_wall *w = &b->wall[b->scene.n_wall++];
    w->n_point = n;
    w->point = silt_alloc((size_t)n, 3 * sizeof *w->point);
    for (int k = 0; k < n; k++)
        for (int d = 0; d < 2; d++)
            w->point[3 * k + d] = xy[2 * k + d];
    w->closed = closed;
    w->condition = condition;
    return w;
}

static silt_wall *bench_box(bench *b, double x, double y, double z, silt_condition condition) {
    silt_wall *w = &b->wall[b->scene.n_wall++];
    w->hi[0] = x;
    w->hi[1] = y;
    w->hi[2] = z;
    w->condition = condition;
    return w;
}

static silt_wall *bench_file(bench *b, const char *path, silt_condition condition) {
    silt_wall *w = &b->wall[b->scene.n_wall++];
    w->surface = silt_text("%s", path);
    w->condition = condition;
    return w;
}

static void bench_make(bench *b) {
    silt_error err = {0};
    if (silt_walls_create(&b->walls, &b->scene, &err) != SILT_OK)
        fail_msg("%s", err.text);
}

static void bench_free(bench *b) {
    for (int w = 0; w < b->scene.n_wall; w++) {
        free(b->wall[w].point);
        free(b->wall[w].surface);
        silt_series_clear(&b->wall[w].motion);
    }
    silt_walls_clear(&b->walls);
    silt_nodes_clear(&b->nodes);
    free(b);
}

// columns of names and rows of numbers as a series
static void motion_of(silt_wall *wall, int n_column, const char *const *name, int n_row, const double *value) {
    silt_series *s = &wall->motion;
    *s = (silt_series){.n_row = n_row, .n_column = n_column};
    s->name = silt_alloc((size_t)n_column, sizeof *s->name);
    s->value = silt_alloc((size_t)(n_row * n_column), sizeof *s->value);
    for (int k = 0; k < n_column; k++)
        s->name[k] = silt_text("%s", name[k]);
    memcpy(s->value, value, (size_t)(n_row * n_column) * sizeof *value);
}

static int node_at(bench *b, const double *x, const double *v, int e0, int e1) {
    silt_nodes *n = &b->nodes;
    if (!n->x) {
        n->x = silt_alloc(MOST_NODES, 3 * sizeof *n->x);
        n->v = silt_alloc(MOST_NODES, 3 * sizeof *n->v);
        n->kind = silt_alloc(MOST_NODES, 1);
        n->owner = silt_alloc(MOST_NODES, sizeof *n->owner);
        n->wall = silt_alloc(MOST_NODES, sizeof *n->wall);
    }
    const int i = n->count++;
    memcpy(n->x + n->dim * i, x, (size_t)n->dim * sizeof *x);
    memcpy(n->v + n->dim * i, v, (size_t)n->dim * sizeof *v);
    n->owner[i] = n->wall[i][2] = -1;
    n->wall[i][0] = e0;
    n->wall[i][1] = e1;
    return i;
}

// all nodes go their way with the velocities they have, then meet the walls
static void step(bench *b, double dt, double h) {
    const int dim = b->nodes.dim;
    memcpy(b->old, b->nodes.x, (size_t)(dim * b->nodes.count) * sizeof(double));
    for (int k = 0; k < dim * b->nodes.count; k++)
        b->nodes.x[k] += dt * b->nodes.v[k];
    silt_walls_contact(&b->walls, &b->nodes, b->old, b->interior, NULL, h);
}

static void assert_near(double a, double b, double tolerance) {
    if (!(fabs(a - b) <= tolerance))
        fail_msg("%.17g is not %.17g within %g", a, b, tolerance);
}

static void assert_point(const double *a, double x, double y, double z, int dim, double tolerance) {
    const double b[3] = {x, y, z};
    for (int d = 0; d < dim; d++)
        assert_near(a[d], b[d], tolerance);
}

static double speed_of(const bench *b, int i) {
    double sum = 0;
    for (int d = 0; d < b->nodes.dim; d++)
        sum += silt_square(b->nodes.v[b->nodes.dim * i + d]);
    return sqrt(sum);
}

static double distance_at(const bench *b, double x, double y, double z, int *element) {
    int unused;
    return silt_walls_distance(&b->walls, (const double[3]){x, y, z}, element ? element : &unused);
}

// ---------------------------------------------------------------- surfaces by hand

typedef struct shape {
    int n_point, n_triangle;
    double point[3 * 60000];
    int triangle[3 * 100000];
} shape;

static int shape_point(shape *s, double x, double y, double z) {
    s->point[3 * s->n_point] = x;
    s->point[3 * s->n_point + 1] = y;
    s->point[3 * s->n_point + 2] = z;
    return s->n_point++;
}

static void shape_triangle(shape *s, int a, int b, int c) {
    s->triangle[3 * s->n_triangle] = a;
    s->triangle[3 * s->n_triangle + 1] = b;
    s->triangle[3 * s->n_triangle++ + 2] = c;
}

// a ball of radius 1 from rings of points; normals outwards
static shape *ball(int rings) {
    shape *s = silt_alloc(1, sizeof *s);
    const int across = 2 * rings;
    const int south = shape_point(s, 0, 0, -1);
    for (int i = 1; i < rings; i++)
        for (int j = 0; j < across; j++) {
            const double t = M_PI * i / rings, p = 2 * M_PI * j / across;
            shape_point(s, sin(t) * cos(p), sin(t) * sin(p), -cos(t));
        }
    const int north = shape_point(s, 0, 0, 1);
#define RING(i, j) (1 + ((i)-1) * across + (j) % across)
    for (int j = 0; j < across; j++) {
        shape_triangle(s, south, RING(1, j + 1), RING(1, j));
        for (int i = 1; i + 1 < rings; i++) {
            shape_triangle(s, RING(i, j), RING(i, j + 1), RING(i + 1, j + 1));
            shape_triangle(s, RING(i, j), RING(i + 1, j + 1), RING(i + 1, j));
        }
        shape_triangle(s, RING(rings - 1, j), RING(rings - 1, j + 1), north);
    }
#undef RING
    return s;
}

// the prism over a polygon in x-z (counter-clockwise with x to the right, z up), y from 0 to 1; normals outwards; fans from corner 0
static shape *prism(int n, const double *xz) {
    shape *s = silt_alloc(1, sizeof *s);
    for (int side = 0; side < 2; side++)
        for (int k = 0; k < n; k++)
            shape_point(s, xz[2 * k], side, xz[2 * k + 1]);
    for (int k = 0; k < n; k++) {
        const int m = (k + 1) % n;
        shape_triangle(s, k, m, n + m);
        shape_triangle(s, k, n + m, n + k);
    }
    for (int k = 1; k + 1 < n; k++) {
        shape_triangle(s, 0, k + 1, k);
        shape_triangle(s, n, n + k, n + k + 1);
    }
    // the sides above point inwards with y into the page: turn them
    for (int t = 0; t < 2 * n; t++) {
        const int swap = s->triangle[3 * t + 1];
        s->triangle[3 * t + 1] = s->triangle[3 * t + 2];
        s->triangle[3 * t + 2] = swap;
    }
    for (int t = 2 * n; t < s->n_triangle; t++) {
        const int swap = s->triangle[3 * t + 1];
        s->triangle[3 * t + 1] = s->triangle[3 * t + 2];
        s->triangle[3 * t + 2] = swap;
    }
    return s;
}

static char *path_of(const char *ending) { return silt_text("/tmp/silt-wall-%d%s", (int)getpid(), ending); }

static void write_bytes(const char *path, const void *data, size_t size) {
    FILE *to = fopen(path, "wb");
    assert_non_null(to);
    assert_int_equal(fwrite(data, 1, size, to), size);
    fclose(to);
}

static void write_stl(const char *path, const shape *s, bool binary) {
    FILE *to = fopen(path, "wb");
    assert_non_null(to);
    if (binary) {
        const char head[80] = "solid in name only";
        const uint32_t n = (uint32_t)s->n_triangle;
        fwrite(head, 1, sizeof head, to);
        fwrite(&n, 4, 1, to);
    } else
        fprintf(to, "solid shape with a name\n");
    for (int t = 0; t < s->n_triangle; t++) {
        if (!binary)
            fprintf(to, " facet normal 0 0 0\n  outer loop\n");
        const float normal[3] = {0, 0, 0};
        const uint16_t colour = 0;
        if (binary)
            fwrite(normal, 4, 3, to);
        for (int k = 0; k < 3; k++) {
            const double *x = s->point + 3 * s->triangle[3 * t + k];
            const float f[3] = {(float)x[0], (float)x[1], (float)x[2]};
            if (binary)
                fwrite(f, 4, 3, to);
            else
                fprintf(to, "   vertex %.17g %.17g %.17g\n", x[0], x[1], x[2]);
        }
        if (binary)
            fwrite(&colour, 2, 1, to);
        else
            fprintf(to, "  endloop\n endfacet\n");
    }
    if (!binary)
        fprintf(to, "endsolid\n");
    fclose(to);
}

static void write_msh(const char *path, const shape *s, bool blocks) {
    FILE *to = fopen(path, "wb");
    assert_non_null(to);
    fprintf(to, "$MeshFormat\n%s 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 1 \"wall\"\n$EndPhysicalNames\n", blocks ? "4.1" : "2.2");
    if (blocks) {
        fprintf(to, "$Entities\n0 0 1 0\n1 0 0 0 1 1 1 0 0\n$EndEntities\n$Nodes\n1 %d 1 %d\n2 1 0 %d\n", s->n_point, s->n_point, s->n_point);
        for (int k = 0; k < s->n_point; k++)
            fprintf(to, "%d\n", k + 1);
        for (int k = 0; k < s->n_point; k++)
            fprintf(to, "%.17g %.17g %.17g\n", s->point[3 * k], s->point[3 * k + 1], s->point[3 * k + 2]);
        fprintf(to, "$EndNodes\n$Elements\n2 %d 1 %d\n0 1 15 1\n1 1\n2 1 2 %d\n", s->n_triangle + 1, s->n_triangle + 1, s->n_triangle);
    } else {
        fprintf(to, "$Nodes\n%d\n", s->n_point);
        for (int k = 0; k < s->n_point; k++)
            fprintf(to, "%d %.17g %.17g %.17g\n", k + 1, s->point[3 * k], s->point[3 * k + 1], s->point[3 * k + 2]);
        fprintf(to, "$EndNodes\n$Elements\n%d\n1 15 2 0 1 1\n", s->n_triangle + 1);
    }
    for (int t = 0; t < s->n_triangle; t++) {
        fprintf(to, blocks ? "%d" : "%d 2 2 1 1", t + 2);
        for (int k = 0; k < 3; k++)
            fprintf(to, " %d", s->triangle[3 * t + k] + 1);
        fprintf(to, "\n");
    }
    fprintf(to, "$EndElements\n");
    fclose(to);
}

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

// ---------------------------------------------------------------- sliding in the plane

static void regular(int n, double radius, double *xy) {
    for (int k = 0; k < n; k++) {
        xy[2 * k] = radius * cos(2 * M_PI * k / n);
        xy[2 * k + 1] = radius * sin(2 * M_PI * k / n);
    }
}

// a round tank of many segments is one patch, and a node goes round and round at its speed
static void test_round_tank(void **state) {
    (void)state;
    enum { N = 40 };
    double xy[2 * N];
    regular(N, 1, xy);
    bench *b = bench_new(2);
    bench_chain(b, N, xy, true, WALL_SLIP);
    bench_make(b);
    for (int s = 0; s < N; s++)
        assert_int_equal(b->walls.patch[s], 0);
    const double side = 2 * sin(M_PI / N);
    double x[2], v[2];
    for (int d = 0; d < 2; d++) {
        x[d] = 0.5 * (xy[d] + xy[2 + d]);
        v[d] = (xy[2 + d] - xy[d]) / side;
    }
    const int i = node_at(b, x, v, 0, -1);
    // three rounds and a half segment, in steps that do not fit the segments
    const double dt = 0.0317;
    const int steps = (int)(3 * N * side / dt);
    for (int k = 0; k < steps; k++) {
        step(b, dt, 0.05);
        assert_true(b->nodes.wall[i][0] >= 0 && b->nodes.wall[i][1] < 0);
        assert_near(speed_of(b, i), 1, 1e-12);
        assert_near(distance_at(b, b->nodes.x[0], b->nodes.x[1], 0, NULL), 0, 1e-12);
    }
    // where it is along the outline
    const int s = b->nodes.wall[i][0];
    const double along = s * side + hypot(b->nodes.x[0] - xy[2 * s], b->nodes.x[1] - xy[2 * s + 1]);
    assert_near(along, fmod(0.5 * side + steps * dt, N * side), 1e-9);
    bench_free(b);
}

// the same outside of a round obstacle: gentle bends that point into the water lead on too, a box lets go
static void test_round_obstacle(void **state) {
    (void)state;
    enum { N = 40 };
    double xy[2 * N], back[2 * N];
    regular(N, 1, xy);
    for (int k = 0; k < N; k++)
        memcpy(back + 2 * k, xy + 2 * (N - 1 - k), 2 * sizeof *xy);
    bench *b = bench_new(2);
    bench_chain(b, N, back, true, WALL_SLIP);
    bench_make(b);
    assert_near(distance_at(b, 0.5, 0, 0, NULL), -cos(M_PI / N) + 0.5, 0.01);
    const double side = 2 * sin(M_PI / N), dt = 0.0317;
    const double v[2] = {(back[2] - back[0]) / side, (back[3] - back[1]) / side};
    const int i = node_at(b, back, v, 0, -1);
    for (int k = 0; k < (int)(N * side / dt); k++) {
        step(b, dt, 0.05);
        assert_true(b->nodes.wall[i][0] >= 0);
        assert_near(speed_of(b, i), 1, 1e-12);
    }
    double *point;
    int(*element)[3];
    assert_int_equal(silt_walls_ridges(&b->walls, 0.05, &point, &element), 0);
    free(point);
    free(element);
    bench_free(b);
}

static void test_corners(void **state) {
    (void)state;
    bench *b = bench_new(2);
    bench_chain(b, 4, tank, false, WALL_SLIP);
    // a box that stands on the floor, a chain of its own
    bench_chain(b, 4, (const double[]){1, 0, 1, 0.4, 1.2, 0.4, 1.2, 0}, true, WALL_SLIP);
    bench_make(b);
    const double h = 0.1;
    // into the inner corner of the tank, into the one at the box's foot, over the box's edge, up against the box
    const int left = node_at(b, (double[]){0.05, 0}, (double[]){-1, 0}, 1, -1);
    const int foot = node_at(b, (double[]){0.95, 0}, (double[]){1, 0}, 1, -1);
    const int over = node_at(b, (double[]){1.15, 0.4}, (double[]){1, 0}, 4, -1);
    const int into = node_at(b, (double[]){0.95, 0.2}, (double[]){1, 0.1}, -1, -1);
    step(b, 0.1, h);
    double vector[3];
    assert_point(b->nodes.x + 2 * left, 0, 0, 0, 2, 1e-12);
    assert_int_equal(silt_walls_hold(&b->walls, b->nodes.wall[left], vector), HOLD_ALL);
    assert_point(b->nodes.x + 2 * foot, 1, 0, 0, 2, 1e-12);
    assert_int_equal(silt_walls_hold(&b->walls, b->nodes.wall[foot], vector), HOLD_ALL);
    assert_point(b->nodes.x + 2 * over, 1.25, 0.4, 0, 2, 1e-12);
    assert_int_equal(b->nodes.wall[over][0], -1);
    assert_near(b->nodes.v[2 * over], 1, 1e-12);
    assert_point(b->nodes.x + 2 * into, 1, 0.21, 0, 2, 1e-12);
    assert_point(b->nodes.v + 2 * into, 0, 0.1, 0, 2, 1e-12);
    assert_int_equal(silt_walls_hold(&b->walls, b->nodes.wall[into], vector), HOLD_NORMAL);
    assert_point(vector, -1, 0, 0, 2, 1e-15);
    bench_free(b);
}

// an empty corner takes the nearest node, once; also at the foot of a box that is not joined to the floor
static void test_fill(void **state) {
    (void)state;
    bench *b = bench_new(2);
    bench_chain(b, 4, tank, false, WALL_SLIP);
    bench_chain(b, 4, (const double[]){1, 0, 1, 0.4, 1.2, 0.4, 1.2, 0}, true, WALL_SLIP);
    bench_make(b);
    const double still[2] = {0, 0};
    const int a = node_at(b, (double[]){0.02, 0}, still, 1, -1), c = node_at(b, (double[]){0, 0.025}, still, 0, -1);
    const int f = node_at(b, (double[]){0.98, 0}, still, 1, -1), g = node_at(b, (double[]){0.94, 0}, still, 1, -1);
    step(b, 0.1, 0.1);
    assert_point(b->nodes.x + 2 * a, 0, 0, 0, 2, 0);
    assert_true(b->nodes.wall[a][1] >= 0);
    assert_point(b->nodes.x + 2 * c, 0, 0.025, 0, 2, 0);
    assert_point(b->nodes.x + 2 * f, 1, 0, 0, 2, 1e-15);
    assert_true(b->nodes.wall[f][1] >= 0);
    assert_point(b->nodes.x + 2 * g, 0.94, 0, 0, 2, 0);
    bench_free(b);
}

// ---------------------------------------------------------------- sliding in space

static void test_box_creases(void **state) {
    (void)state;
    bench *b = bench_new(3);
    bench_box(b, 1, 1, 1, WALL_SLIP);
    bench_make(b);
    const double h = 0.1;
    // falls on the floor, slides to the side, along the crease into the corner
    const int i = node_at(b, (double[]){0.5, 0.9, 0.05}, (double[]){0.3, 0.5, -1}, -1, -1);
    double vector[3];
    step(b, 0.1, h);
    assert_point(b->nodes.x, 0.53, 0.95, 0, 3, 1e-12);
    assert_point(b->nodes.v, 0.3, 0.5, 0, 3, 1e-12);
    assert_int_equal(silt_walls_hold(&b->walls, b->nodes.wall[i], vector), HOLD_NORMAL);
    assert_point(vector, 0, 0, 1, 3, 1e-15);
    step(b, 0.2, h);
    assert_point(b->nodes.x, 0.59, 1, 0, 3, 1e-12);
    assert_point(b->nodes.v, 0.3, 0, 0, 3, 1e-12);
    assert_int_equal(silt_walls_hold(&b->walls, b->nodes.wall[i], vector), HOLD_LINE);
    assert_near(fabs(vector[0]), 1, 1e-15);
    for (int k = 0; k < 6; k++)
        step(b, 0.2, h);
    assert_point(b->nodes.x, 0.95, 1, 0, 3, 1e-12);
    assert_point(b->nodes.v, 0.3, 0, 0, 3, 1e-12);
    step(b, 0.2, h);
    assert_point(b->nodes.x, 1, 1, 0, 3, 1e-12);
    assert_point(b->nodes.v, 0, 0, 0, 3, 1e-12);
    assert_int_equal(silt_walls_hold(&b->walls, b->nodes.wall[i], vector), HOLD_ALL);
    bench_free(b);
}

// a node that leaves a crease or a corner askew into the walls stays in; one that was lost behind a closed wall comes back
static void test_leak(void **state) {
    (void)state;
    bench *b = bench_new(3);
    bench_box(b, 1, 1, 1, WALL_SLIP);
    bench_make(b);
    const double x[4][3] = {{1, 0, 0.5}, {1, 1, 0}, {0.5, 1.02, -0.03}, {1.01, 1.02, -0.03}};
    const double v[4][3] = {{0.1, -0.03, 1}, {0.2, 0.1, -0.05}, {0, 0, 0}, {0.1, 0, 0}};
    for (int i = 0; i < 4; i++)
        node_at(b, x[i], v[i], -1, -1);
    for (int k = 0; k < 3; k++) {
        step(b, 0.01, 0.1);
        for (int i = 0; i < 4; i++)
            assert_true(distance_at(b, b->nodes.x[3 * i], b->nodes.x[3 * i + 1], b->nodes.x[3 * i + 2], NULL) >= -1e-10);
    }
    assert_point(b->nodes.x, 1, 0, 0.53, 3, 1e-12);
    bench_free(b);
}

// a box that stands on the floor of another: its edges let go, its foot is a crease with the floor's triangles
static void test_box_on_floor(void **state) {
    (void)state;
    bench *b = bench_new(3);
    bench_box(b, 2, 1, 1, WALL_SLIP);
    silt_wall *box = bench_box(b, 1.2, 0.7, 0.3, WALL_SLIP);
    box->lo[0] = 0.8;
    box->lo[1] = 0.3;
    box->inside_out = true;
    bench_make(b);
    assert_true(distance_at(b, 1, 0.5, 0.01, NULL) < 0);
    assert_near(distance_at(b, 0.7, 0.5, 0.15, NULL), 0.1, 1e-15);
    assert_near(distance_at(b, 1, 0.5, 0.4, NULL), 0.1, 1e-15);
    const double h = 0.1;
    double vector[3];
    const int over = node_at(b, (double[]){1.15, 0.5, 0.3}, (double[]){1, 0, 0}, -1, -1);
    const int foot = node_at(b, (double[]){0.75, 0.35, 0}, (double[]){1, 1, 0}, -1, -1);
    int element[3];
    double on[3];
    assert_int_equal(silt_walls_touching(&b->walls, b->nodes.x + 3 * over, 1e-4, element, on), 1);
    b->nodes.wall[over][0] = element[0];
    assert_int_equal(silt_walls_touching(&b->walls, b->nodes.x + 3 * foot, 1e-4, element, on), 1);
    b->nodes.wall[foot][0] = element[0];
    step(b, 0.1, h);
    assert_point(b->nodes.x + 3 * over, 1.25, 0.5, 0.3, 3, 1e-12);
    assert_int_equal(b->nodes.wall[over][0], -1);
    assert_point(b->nodes.x + 3 * foot, 0.8, 0.45, 0, 3, 1e-12);
    assert_point(b->nodes.v + 3 * foot, 0, 1, 0, 3, 1e-12);
    assert_int_equal(silt_walls_hold(&b->walls, b->nodes.wall[foot], vector), HOLD_LINE);
    assert_near(fabs(vector[1]), 1, 1e-15);
    // past the box's edge it is on the floor alone
    for (int k = 0; k < 3; k++)
        step(b, 0.1, h);
    assert_point(b->nodes.x + 3 * foot, 0.8, 0.75, 0, 3, 1e-12);
    assert_true(b->nodes.wall[foot][0] >= 0 && b->nodes.wall[foot][1] < 0);
    assert_int_equal(silt_walls_hold(&b->walls, b->nodes.wall[foot], vector), HOLD_NORMAL);
    assert_point(vector, 0, 0, 1, 3, 1e-15);

    // what touches where, exactly
    assert_int_equal(silt_walls_touching(&b->walls, (double[]){0.80001, 0.4, 0.00001}, 1e-4, element, on), 2);
    assert_point(on, 0.8, 0.4, 0, 3, 1e-15);
    assert_int_equal(silt_walls_touching(&b->walls, (double[]){0.00001, 0.00001, 0.00001}, 1e-4, element, on), 3);
    assert_point(on, 0, 0, 0, 3, 1e-15);
    assert_int_equal(silt_walls_touching(&b->walls, (double[]){0.5, 0.5, 0.00001}, 1e-4, element, on), 1);
    assert_point(on, 0.5, 0.5, 0, 3, 1e-15);
    assert_int_equal(silt_walls_touching(&b->walls, (double[]){0.5, 0.5, 0.5}, 1e-4, element, on), 0);

    // fixed points on its edges but for the foot: 4 corners above, 3 or 4 steps of h along each of 4 edges, 2 up each of 4
    double *point;
    int(*ridge)[3];
    const int n = silt_walls_ridges(&b->walls, h, &point, &ridge);
    assert_int_equal(n, 4 + 4 * 3 + 4 * 2);
    for (int k = 0; k < n; k++) {
        assert_true(point[3 * k + 2] > 0.05);
        assert_int_equal(b->walls.wall[ridge[k][0]], 1);
        assert_near(distance_at(b, point[3 * k], point[3 * k + 1], point[3 * k + 2], NULL), 0, 1e-15);
    }
    free(point);
    free(ridge);
    bench_free(b);
}

// inside of a ball a node runs round a great circle at its speed, from facet to facet
static void test_ball_slide(void **state) {
    (void)state;
    char *path = path_of(".stl");
    shape *s = ball(24);
    write_stl(path, s, false);
    for (int outside = 0; outside < 2; outside++) {
        bench *b = bench_new(3);
        bench_file(b, path, WALL_SLIP)->inside_out = !outside;
        bench_make(b);
        int e;
        const double from[3] = {0.31, 0.94, 0.1};
        distance_at(b, from[0], from[1], from[2], &e);
        double on[3], v[3], n[3];
        int feature;
        wall_nearest(&b->walls, e, from, on, &feature);
        memcpy(n, b->walls.normal[e], sizeof n);
        silt_cross(n, (const double[]){0.2, 0.3, 1}, v);
        const double length = sqrt(wall_dot(v, v));
        for (int d = 0; d < 3; d++)
            v[d] /= length;
        const int i = node_at(b, on, v, e, -1);
        double gone = 0;
        for (int k = 0; k < 400; k++) {
            const double before[3] = {b->nodes.x[0], b->nodes.x[1], b->nodes.x[2]};
            step(b, 0.0211, 0.05);
            assert_true(b->nodes.wall[i][0] >= 0 && b->nodes.wall[i][1] < 0);
            assert_near(speed_of(b, i), 1, 1e-10);
            assert_near(distance_at(b, b->nodes.x[0], b->nodes.x[1], b->nodes.x[2], NULL), 0, 1e-9);
            double way = 0;
            for (int d = 0; d < 3; d++)
                way += silt_square(b->nodes.x[d] - before[d]);
            gone += sqrt(way);
        }
        // the polygon that it walks is a little shorter than its way
        assert_near(gone, 400 * 0.0211, 0.01 * gone);
        bench_free(b);
    }
    free(s);
    unlink(path);
    free(path);
}

// nodes near an empty crease and corner are put in, at a distance from each other
static void test_fill_space(void **state) {
    (void)state;
    bench *b = bench_new(3);
    bench_box(b, 1, 1, 1, WALL_SLIP);
    bench_make(b);
    const double still[3] = {0, 0, 0}, h = 0.1;
    int element[3], n = 0;
    double on[3];
    // a floor with nodes at 0.02 from the side, half h apart
    for (int k = 0; k < 10; k++) {
        const double x[3] = {0.3 + 0.05 * k, 0.02, 0};
        assert_int_equal(silt_walls_touching(&b->walls, x, 1e-6, element, on), 1);
        node_at(b, x, still, element[0], -1);
    }
    const double near_corner[3] = {0.975, 0.015, 0};
    silt_walls_touching(&b->walls, near_corner, 1e-6, element, on);
    node_at(b, near_corner, still, element[0], -1);
    step(b, 0.1, h);
    for (int i = 0; i < 10; i++) {
        const bool in = b->nodes.wall[i][1] >= 0;
        assert_near(b->nodes.x[3 * i + 1], in ? 0 : 0.02, 1e-15);
        n += in;
    }
    assert_int_equal(n, 5);
    // the crease first, the corner in the next step
    assert_true(b->nodes.wall[10][1] >= 0 && b->nodes.wall[10][2] < 0);
    step(b, 0.1, h);
    assert_true(b->nodes.wall[10][2] >= 0);
    assert_point(b->nodes.x + 30, 1, 0, 0, 3, 1e-15);
    bench_free(b);
}

// ---------------------------------------------------------------- motion

static const char *const columns[5] = {"time", "x", "y", "z", "angle"};

// nodes on a wall that shifts and turns land on it exactly, whatever they do along it
static void test_motion_lands(void **state) {
    (void)state;
    for (int dim = 2; dim < 4; dim++)
        for (int slip = 0; slip < 2; slip++) {
            bench *b = bench_new(dim);
            silt_wall *w;
            if (dim == 2)
                w = bench_chain(b, 4, (const double[]){0, 1, 0, 0, 2, 0, 2, 1}, true, slip ? WALL_SLIP : WALL_NO_SLIP);
            else
                w = bench_box(b, 2, 1, 1, slip ? WALL_SLIP : WALL_NO_SLIP);
            motion_of(w, 5, columns, 3, (const double[]){0, 0, 0, 0, 0, 1, 0.5, 0.2, -0.3, 40, 2, -0.5, 0.4, 0.3, -90});
            w->pivot[0] = 0.7;
            bench_make(b);
            assert_near(b->walls.motion[0].velocity[0], 0.5, 1e-6);
            assert_near(b->walls.motion[0].spin, 40 * M_PI / 180, 1e-6);
            int element[3];
            double on[3];
            const double at[3] = {0.4, dim == 2 ? 0 : 0.5, 0};
            assert_int_equal(silt_walls_touching(&b->walls, at, 1e-6, element, on), 1);
            const int i = node_at(b, at, (double[]){0, 0, 0}, element[0], -1);
            const int e = element[0];
            const double dt = 0.05;
            double gone = 0.4;
            for (int k = 1; k <= 40; k++) {
                silt_walls_move(&b->walls, &b->scene, k * dt, dt);
                double given[3], vector[3], *v = b->nodes.v + dim * i, before[3] = {0}, after[3] = {0};
                const silt_hold hold = silt_walls_hold(&b->walls, b->nodes.wall[i], vector);
                assert_int_equal(hold, slip ? HOLD_NORMAL : HOLD_ALL);
                silt_walls_given(&b->walls, &b->scene, b->nodes.wall[i], b->nodes.x, given);
                // slip: a free part along the wall, as it lies now
                const double angle = b->walls.motion[0].angle, along[3] = {cos(angle), dim == 2 ? sin(angle) : 0, dim == 3 ? sin(angle) : 0};
                const double own = slip ? 0.3 : 0;
                for (int d = 0; d < dim; d++)
                    v[d] = given[d] + own * along[d];
                memcpy(before, b->nodes.x, (size_t)dim * sizeof(double));
                for (int d = 0; d < dim; d++)
                    after[d] = before[d] + dt * v[d];
                assert_near(distance_at(b, after[0], after[1], dim == 3 ? after[2] : 0, NULL), 0, 1e-14);
                step(b, dt, 0.1);
                for (int d = 0; d < dim; d++)
                    assert_near(b->nodes.x[d], after[d], 1e-13);
                assert_int_equal(b->nodes.wall[i][0], slip ? b->nodes.wall[i][0] : e);
                if (slip)
                    continue;
                // without slip it is where the wall has carried it
                const silt_wall_motion *m = &b->walls.motion[0];
                const double rx = gone - 0.7, c = cos(m->angle), s = sin(m->angle);
                assert_near(b->nodes.x[0], m->centre[0] + c * rx, 1e-13);
                assert_near(b->nodes.x[dim - 1], m->centre[dim - 1] + s * rx, 1e-13);
            }
            bench_free(b);
        }
}

// a piston drives the water in front of it, and the node in the corner with the floor goes along
static void test_piston(void **state) {
    (void)state;
    bench *b = bench_new(2);
    bench_chain(b, 2, (const double[]){-1, 0, 3, 0}, false, WALL_SLIP);
    silt_wall *piston = bench_chain(b, 4, (const double[]){0, 1, 0, 0, -0.1, 0, -0.1, 1}, true, WALL_SLIP);
    motion_of(piston, 2, columns, 2, (const double[]){0, 0, 1, 0.5});
    bench_make(b);
    // on the piston, on the floor before it, in the corner, free before it
    const int on = node_at(b, (double[]){0, 0.5}, (double[]){0, 0}, 1, -1);
    const int before = node_at(b, (double[]){0.2, 0}, (double[]){0, 0}, 0, -1);
    const int corner = node_at(b, (double[]){0, 0}, (double[]){0, 0}, 1, 0);
    const int open = node_at(b, (double[]){0.1, 0.7}, (double[]){0, 0}, -1, -1);
    const int fixed = node_at(b, (double[]){0, 1}, (double[]){0, 0}, -1, -1);
    b->nodes.kind[fixed] = NODE_CORNER;
    b->nodes.owner[fixed] = 1;
    double given[3], vector[3];
    for (int k = 1; k <= 50; k++) {
        silt_walls_move(&b->walls, &b->scene, 0.02 * k, 0.02);
        for (int i = 0; i < b->nodes.count; i++)
            if (b->nodes.kind[i] == NODE_FLUID && silt_walls_hold(&b->walls, b->nodes.wall[i], vector) != HOLD_FREE) {
                silt_walls_given(&b->walls, &b->scene, b->nodes.wall[i], b->nodes.x + 2 * i, given);
                memcpy(b->nodes.v + 2 * i, given, 2 * sizeof(double));
            }
        step(b, 0.02, 0.01);
    }
    assert_point(b->nodes.x + 2 * on, 0.5, 0.5, 0, 2, 1e-13);
    assert_point(b->nodes.x + 2 * before, 0.5, 0, 0, 2, 1e-13); // swept along in the corner
    assert_true(b->nodes.wall[before][1] >= 0);
    assert_point(b->nodes.x + 2 * corner, 0.5, 0, 0, 2, 1e-13);
    assert_point(b->nodes.x + 2 * open, 0.5, 0.7, 0, 2, 1e-13);
    assert_int_equal(b->walls.wall[b->nodes.wall[open][0]], 1);
    assert_point(b->nodes.v + 2 * open, 0.5, 0, 0, 2, 1e-12);
    assert_point(b->nodes.x + 2 * fixed, 0.5, 1, 0, 2, 1e-13);
    bench_free(b);
}

// a gate goes up: nodes on its face come free at its lower end, the one at its foot stays on the floor
static void test_gate(void **state) {
    (void)state;
    bench *b = bench_new(2);
    bench_chain(b, 4, tank, false, WALL_SLIP);
    silt_wall *gate = bench_chain(b, 4, (const double[]){1, 0, 1, 0.8, 1.02, 0.8, 1.02, 0}, true, WALL_SLIP);
    motion_of(gate, 3, (const char *const[]){"time", "angle", "y"}, 2, (const double[]){0, 0, 0, 1, 0, 1});
    bench_make(b);
    double *point;
    int(*ridge)[3];
    // fixed nodes at its upper corners only
    assert_int_equal(silt_walls_ridges(&b->walls, 0.01, &point, &ridge), 2);
    assert_near(point[1], 0.8, 1e-15);
    assert_near(point[4], 0.8, 1e-15);
    free(point);
    free(ridge);
    // before its foot floor and face hold, not the foot's underside
    for (int k = 0; k < 9; k++) {
        const double x[2] = {1 + 1e-5 * (k % 3 - 1), 1e-5 * (k / 3 - 1)};
        double on[3];
        int element[3];
        assert_int_equal(silt_walls_touching(&b->walls, x, 1e-4, element, on), 2);
        assert_true(element[0] + element[1] == 4 && element[0] * element[1] == 3);
        assert_point(on, 1, 0, 0, 2, 1e-13);
    }
    const int foot = node_at(b, (double[]){1, 0}, (double[]){0, 0}, 3, 1);
    const int low = node_at(b, (double[]){1, 0.045}, (double[]){0, 0}, 3, -1);
    const int high = node_at(b, (double[]){1, 0.4}, (double[]){0, 0}, 3, -1);
    for (int k = 1; k <= 10; k++) {
        silt_walls_move(&b->walls, &b->scene, 0.01 * k, 0.01);
        double given[3];
        for (int i = 0; i < 3; i++) {
            silt_walls_given(&b->walls, &b->scene, b->nodes.wall[i], b->nodes.x + 2 * i, given);
            assert_point(given, 0, 0, 0, 2, 1e-13);
        }
        step(b, 0.01, 0.01);
        assert_int_equal(b->nodes.wall[foot][0], 1);
        assert_int_equal(b->nodes.wall[foot][1], -1);
        assert_int_equal(b->nodes.wall[low][0], k < 5 ? 3 : -1);
        assert_int_equal(b->nodes.wall[high][0], 3);
        assert_true(distance_at(b, 1.01, 0.01 * k + 1e-4, 0, NULL) < 0);
        assert_true(distance_at(b, 1.01, 0.005 * k, 0, NULL) > 0);
    }
    assert_point(b->nodes.x + 2 * foot, 1, 0, 0, 2, 1e-14);
    assert_point(b->nodes.x + 2 * low, 1, 0.045, 0, 2, 1e-14);
    bench_free(b);
}

// a lid moves along itself: its nodes have its speed and stay; in the corner with a wall at rest they have none
static void test_lid(void **state) {
    (void)state;
    bench *b = bench_new(2);
    bench_chain(b, 4, tank, false, WALL_NO_SLIP);
    silt_wall *lid = bench_chain(b, 2, (const double[]){2, 1, 0, 1}, false, WALL_NO_SLIP);
    lid->velocity[0] = 3;
    lid->velocity[1] = 1; // not along the lid: has no effect
    bench_make(b);
    const int i = node_at(b, (double[]){1, 1}, (double[]){3, 0}, 3, -1);
    const int corner[3] = {3, 2, -1};
    double v[3];
    silt_walls_given(&b->walls, &b->scene, b->nodes.wall[i], b->nodes.x, v);
    assert_point(v, 3, 0, 0, 2, 1e-15);
    silt_walls_given(&b->walls, &b->scene, corner, (double[]){2, 1}, v);
    assert_point(v, 0, 0, 0, 2, 1e-15);
    step(b, 0.01, 0.1);
    assert_point(b->nodes.x, 1, 1, 0, 2, 0);
    assert_point(b->nodes.v, 3, 0, 0, 2, 0);
    bench_free(b);
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

// ---------------------------------------------------------------- openings

// a hole in a side of a box: the area that is left, joined corner by corner but for the hole's rim
static void test_hole(void **state) {
    (void)state;
    double corner[12] = {2, 0.4, 0.3, 2, 0.4, 0.7, 2, 0.6, 0.7, 2, 0.6, 0.3};
    silt_outlet outlet = {.n_corner = 4, .corner = corner};
    for (int whole = 0; whole < 2; whole++) {
        bench *b = bench_new(3);
        bench_box(b, 2, 1, 1, WALL_SLIP);
        b->scene.fluid.outlet = &outlet;
        b->scene.fluid.n_outlet = 1;
        for (int c = 0; c < 4 && whole; c++) { // the whole side: nothing is left of it
            corner[3 * c + 1] = c < 2 ? 0 : 1;
            corner[3 * c + 2] = c == 1 || c == 2 ? 1 : 0;
        }
        bench_make(b);
        double area = 0, rim = 0;
        for (int e = 0; e < b->walls.count; e++) {
            const double(*c)[3] = (const double(*)[3])b->walls.corner[e];
            double u[3], v[3], n[3];
            for (int d = 0; d < 3; d++) {
                u[d] = c[1][d] - c[0][d];
                v[d] = c[2][d] - c[0][d];
            }
            silt_cross(u, v, n);
            area += 0.5 * sqrt(wall_dot(n, n));
            for (int k = 0; k < 3; k++)
                if (b->walls.joined[e][k] < 0)
                    rim += sqrt(silt_square(c[(k + 1) % 3][0] - c[k][0]) + silt_square(c[(k + 1) % 3][1] - c[k][1]) +
                                silt_square(c[(k + 1) % 3][2] - c[k][2]));
        }
        assert_near(area, whole ? 9 : 10 - 0.08, 1e-12);
        assert_near(rim, whole ? 4 : 1.2, 1e-12);
        assert_near(distance_at(b, 1.9, 0.5, 0.35, NULL), whole ? 0.35 : hypot(0.1, 0.05), 1e-12);
        if (!whole)
            assert_near(distance_at(b, 2.1, 0.5, 0.35, NULL), -hypot(0.1, 0.05), 1e-12);
        bench_free(b);
    }
    // its back to the water
    bench *turned = bench_new(3);
    bench_box(turned, 2, 1, 1, WALL_SLIP);
    double back[12];
    for (int c = 0; c < 4; c++)
        memcpy(back + 3 * c, corner + 3 * (3 - c), 3 * sizeof *back);
    outlet.corner = back;
    turned->scene.fluid.outlet = &outlet;
    turned->scene.fluid.n_outlet = 1;
    silt_error err = {0};
    assert_int_equal(silt_walls_create(&turned->walls, &turned->scene, &err), SILT_INPUT);
    assert_non_null(strstr(err.text, "key 'fluid.outlets.0.corners': found corners that turn with their back to the water"));
    assert_int_equal(turned->walls.count, 0);
    bench_free(turned);
    // in the plane: what is left on both sides
    bench *b = bench_new(2);
    bench_chain(b, 4, (const double[]){0, 0, 2, 0, 2, 1, 0, 1}, true, WALL_SLIP);
    outlet = (silt_outlet){.from = {2, 0.2}, .to = {2, 0.5}};
    b->scene.fluid.outlet = &outlet;
    b->scene.fluid.n_outlet = 1;
    bench_make(b);
    double length = 0;
    for (int e = 0; e < b->walls.count; e++)
        length += hypot(b->walls.to[e][0] - b->walls.from[e][0], b->walls.to[e][1] - b->walls.from[e][1]);
    assert_near(length, 6 - 0.3, 1e-12);
    assert_int_equal(b->walls.count, 5);
    bench_free(b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_empty),          cmocka_unit_test(test_hole),
                  cmocka_unit_test(test_distance_plane), cmocka_unit_test(test_distance_plate),
        cmocka_unit_test(test_distance_box),   cmocka_unit_test(test_distance_step),  cmocka_unit_test(test_distance_ball),
        cmocka_unit_test(test_distance_many),  cmocka_unit_test(test_files_agree),    cmocka_unit_test(test_files_wrong),
        cmocka_unit_test(test_files_fuzzed),   cmocka_unit_test(test_share),          cmocka_unit_test(test_round_tank),
        cmocka_unit_test(test_round_obstacle), cmocka_unit_test(test_corners),        cmocka_unit_test(test_fill),
        cmocka_unit_test(test_box_creases),    cmocka_unit_test(test_leak),           cmocka_unit_test(test_box_on_floor),
        cmocka_unit_test(test_ball_slide),
        cmocka_unit_test(test_fill_space),     cmocka_unit_test(test_motion_lands),   cmocka_unit_test(test_piston),
        cmocka_unit_test(test_gate),           cmocka_unit_test(test_lid),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
