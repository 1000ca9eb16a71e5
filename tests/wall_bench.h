/** @file wall_bench.h
 * Walls for tests: chains, boxes and files as scenes have them, nodes on them, surfaces by hand; after cmocka.h.
 */
#ifndef SILT_WALL_BENCH_H
#define SILT_WALL_BENCH_H

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

static inline bench *bench_new(int dim) {
    bench *b = silt_alloc(1, sizeof *b);
    b->scene.dimension = dim;
    b->scene.wall = b->wall;
    b->nodes.dim = dim;
    return b;
}

static inline silt_wall *bench_chain(bench *b, int n, const double *xy, bool closed, silt_condition condition) {
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

static inline silt_wall *bench_box(bench *b, double x, double y, double z, silt_condition condition) {
    silt_wall *w = &b->wall[b->scene.n_wall++];
    w->hi[0] = x;
    w->hi[1] = y;
    w->hi[2] = z;
    w->condition = condition;
    return w;
}

static inline silt_wall *bench_file(bench *b, const char *path, silt_condition condition) {
    silt_wall *w = &b->wall[b->scene.n_wall++];
    w->surface = silt_text("%s", path);
    w->condition = condition;
    return w;
}

static inline void bench_make(bench *b) {
    silt_error err = {0};
    if (silt_walls_create(&b->walls, &b->scene, &err) != SILT_OK)
        fail_msg("%s", err.text);
}

static inline void bench_free(bench *b) {
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
static inline void motion_of(silt_wall *wall, int n_column, const char *const *name, int n_row, const double *value) {
    silt_series *s = &wall->motion;
    *s = (silt_series){.n_row = n_row, .n_column = n_column};
    s->name = silt_alloc((size_t)n_column, sizeof *s->name);
    s->value = silt_alloc((size_t)(n_row * n_column), sizeof *s->value);
    for (int k = 0; k < n_column; k++)
        s->name[k] = silt_text("%s", name[k]);
    memcpy(s->value, value, (size_t)(n_row * n_column) * sizeof *value);
}

static inline int node_at(bench *b, const double *x, const double *v, int e0, int e1) {
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
static inline void step(bench *b, double dt, double h) {
    const int dim = b->nodes.dim;
    memcpy(b->old, b->nodes.x, (size_t)(dim * b->nodes.count) * sizeof(double));
    for (int k = 0; k < dim * b->nodes.count; k++)
        b->nodes.x[k] += dt * b->nodes.v[k];
    silt_walls_contact(&b->walls, &b->nodes, b->old, b->interior, NULL, h);
}

static inline void assert_near(double a, double b, double tolerance) {
    if (!(fabs(a - b) <= tolerance))
        fail_msg("%.17g is not %.17g within %g", a, b, tolerance);
}

static inline void assert_point(const double *a, double x, double y, double z, int dim, double tolerance) {
    const double b[3] = {x, y, z};
    for (int d = 0; d < dim; d++)
        assert_near(a[d], b[d], tolerance);
}

static inline double speed_of(const bench *b, int i) {
    double sum = 0;
    for (int d = 0; d < b->nodes.dim; d++)
        sum += silt_square(b->nodes.v[b->nodes.dim * i + d]);
    return sqrt(sum);
}

static inline double distance_at(const bench *b, double x, double y, double z, int *element) {
    int unused;
    return silt_walls_distance(&b->walls, (const double[3]){x, y, z}, element ? element : &unused);
}

// ---------------------------------------------------------------- surfaces by hand

typedef struct shape {
    int n_point, n_triangle;
    double point[3 * 60000];
    int triangle[3 * 100000];
} shape;

static inline int shape_point(shape *s, double x, double y, double z) {
    s->point[3 * s->n_point] = x;
    s->point[3 * s->n_point + 1] = y;
    s->point[3 * s->n_point + 2] = z;
    return s->n_point++;
}

static inline void shape_triangle(shape *s, int a, int b, int c) {
    s->triangle[3 * s->n_triangle] = a;
    s->triangle[3 * s->n_triangle + 1] = b;
    s->triangle[3 * s->n_triangle++ + 2] = c;
}

// a ball of radius 1 from rings of points; normals outwards
static inline shape *ball(int rings) {
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
static inline shape *prism(int n, const double *xz) {
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

static inline char *path_of(const char *ending) { return silt_text("/tmp/silt-wall-%d%s", (int)getpid(), ending); }

static inline void write_bytes(const char *path, const void *data, size_t size) {
    FILE *to = fopen(path, "wb");
    assert_non_null(to);
    assert_int_equal(fwrite(data, 1, size, to), size);
    fclose(to);
}

static inline void write_stl(const char *path, const shape *s, bool binary) {
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

static inline void write_msh(const char *path, const shape *s, bool blocks) {
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

#endif
