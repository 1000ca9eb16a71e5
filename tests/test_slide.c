// nodes on walls in two and three dimensions: sliding, creases, corners, walls that move, holes in them
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <unistd.h>

#include "wall_bench.h"

static const double tank[8] = {0, 1, 0, 0, 2, 0, 2, 1};

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
        cmocka_unit_test(test_hole),
        cmocka_unit_test(test_round_tank),
        cmocka_unit_test(test_round_obstacle),
        cmocka_unit_test(test_corners),
        cmocka_unit_test(test_fill),
        cmocka_unit_test(test_box_creases),
        cmocka_unit_test(test_leak),
        cmocka_unit_test(test_box_on_floor),
        cmocka_unit_test(test_ball_slide),
        cmocka_unit_test(test_fill_space),
        cmocka_unit_test(test_motion_lands),
        cmocka_unit_test(test_piston),
        cmocka_unit_test(test_gate),
        cmocka_unit_test(test_lid),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
