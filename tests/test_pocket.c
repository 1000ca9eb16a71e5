// closed pockets of air: found, compressed by a known amount, merged, split, opened
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <unistd.h>

#include "delaunay.h"
#include "pocket.h"
#include "scene_text.h"

#define NEAR(value, expected, tolerance)                                                                                 \
    do {                                                                                                                 \
        const double v_ = (value), e_ = (expected);                                                                      \
        if (!(fabs(v_ - e_) <= (tolerance)))                                                                             \
            fail_msg("%s:%d: %s is %.12g, not %.12g within %g", __FILE__, __LINE__, #value, v_, e_, (double)(tolerance)); \
    } while (0)

#define AIR 1e5

static const silt_scene plain = {.dimension = 2,
                                 .fluid = {.density = 1000, .size = 0.05, .alpha = 1.3, .air_pressure = AIR, .air_exponent = 1.4, .volume_steps = 10}};

typedef struct bench {
    silt_scene scene;
    silt_nodes nodes;
    silt_mesh mesh;
    silt_barrier barrier;
    silt_air air;
    silt_pockets pockets;
} bench;

static void bench_close(bench *b) {
    silt_nodes_clear(&b->nodes);
    silt_mesh_clear(&b->mesh);
    silt_air_clear(&b->air);
    silt_pockets_clear(&b->pockets);
}

static void update(bench *b) {
    silt_error err = {0};
    assert_int_equal(silt_air_find(&b->air, &b->scene, &b->nodes, &b->mesh, &b->barrier, &err), SILT_OK);
    silt_pockets_update(&b->pockets, &b->scene, &b->nodes, &b->mesh, &b->air);
}

static void push(silt_mesh *mesh, int i, int j, int k) {
    SILT_RESERVE(mesh->cell, mesh->cell_capacity, mesh->n_cell + 1);
    int *cell = mesh->cell[mesh->n_cell++];
    cell[0] = i;
    cell[1] = j;
    cell[2] = k;
    cell[3] = -1;
}

static int64_t node_add(silt_nodes *nodes, int64_t id, double x, double y) {
    const double at[2] = {x, y};
    const int i = silt_nodes_add(nodes, NODE_FLUID, -1, at);
    nodes->id[i] = id;
    return i;
}

// ---- a ring of water around air

#define ROUND 48

static void ring_open(bench *b) {
    *b = (bench){.scene = plain};
    for (int r = 0; r < 3; r++)
        for (int k = 0; k < ROUND; k++) {
            const double radius = 0.3 + 0.05 * r, angle = 2 * 3.14159265358979 * (k + 0.5 * r) / ROUND;
            node_add(&b->nodes, 1 + r * ROUND + k, radius * cos(angle), radius * sin(angle));
        }
    for (int r = 0; r < 2; r++)
        for (int k = 0; k < ROUND; k++) {
            const int a = r * ROUND + k, c = r * ROUND + (k + 1) % ROUND;
            push(&b->mesh, a, a + ROUND, c);
            push(&b->mesh, c, a + ROUND, c + ROUND);
        }
    silt_mesh_connect(&b->mesh, &b->nodes);
}

static void test_ring_is_compressed(void **state) {
    (void)state;
    bench b;
    ring_open(&b);
    update(&b);
    const double volume = 0.5 * ROUND * 0.09 * sin(2 * 3.14159265358979 / ROUND);
    assert_int_equal(b.pockets.count, 1);
    silt_pocket_state *p = b.pockets.pocket;
    NEAR(p->volume, volume, 1e-14);
    NEAR(p->amount, volume, 1e-14);
    NEAR(p->pressure, 0, 1e-6);
    assert_int_equal(p->n_facet, ROUND);
    assert_int_equal(p->n_node, ROUND);
    for (int k = 0; k < p->n_node; k++)
        assert_int_equal(b.pockets.node[p->first_node + k], k);
    assert_int_equal(b.air.n_missing, 0);

    // everything drawn together by a tenth: area times 0.81
    double x_old[2 * 3 * ROUND];
    memcpy(x_old, b.nodes.x, sizeof x_old);
    for (int k = 0; k < 2 * b.nodes.count; k++)
        b.nodes.x[k] *= 0.9;
    const double stiffness = p->stiffness;
    silt_pockets_advance(&b.pockets, &b.scene, &b.mesh, x_old, b.nodes.x);
    NEAR(p->volume, 0.81 * volume, 1e-14);
    NEAR(p->pressure, AIR * (pow(1 / 0.81, 1.4) - 1), 1e-6);
    NEAR(stiffness, 1.4 * AIR / volume, 1e-3);
    // the rebuild finds the same air again
    const int64_t id = p->id;
    const double pressure = p->pressure;
    update(&b);
    p = b.pockets.pocket;
    assert_int_equal(b.pockets.count, 1);
    assert_true(p->id == id);
    NEAR(p->pressure, pressure, 1e-6);
    NEAR(p->jump, 0, 1e-15);
    NEAR(p->amount, volume, 1e-14);

    // the load: closed surface; out of the water is inwards here; by Gauss sum B.x = -2 V
    silt_pockets_load(&b.pockets, &b.mesh, b.nodes.x);
    double sum[2] = {0}, work = 0, force[2 * 3 * ROUND] = {0}, w[2 * 3 * ROUND];
    for (int k = 0; k < p->n_node; k++)
        for (int d = 0; d < 2; d++) {
            sum[d] += b.pockets.vector[2 * k + d];
            work += b.pockets.vector[2 * k + d] * b.nodes.x[2 * b.pockets.node[k] + d];
        }
    NEAR(sum[0], 0, 1e-15);
    NEAR(sum[1], 0, 1e-15);
    NEAR(work, -2 * p->volume, 1e-14);
    silt_pockets_force(&b.pockets, 2, 0, NULL, force);
    for (int k = 0; k < ROUND; k++) // outwards, on the inner nodes alone
        assert_true(force[2 * k] * b.nodes.x[2 * k] + force[2 * k + 1] * b.nodes.x[2 * k + 1] > 0);
    for (int k = 2 * ROUND; k < 6 * ROUND; k++)
        NEAR(force[k], 0, 0);

    // the part with w foretells the pressure of a small step, to second order
    for (int half = 0; half < 2; half++) {
        bench c;
        ring_open(&c);
        update(&c);
        silt_pockets_load(&c.pockets, &c.mesh, c.nodes.x);
        const double dt = half ? 5e-4 : 1e-3;
        double at[2] = {0};
        for (int k = 0; k < 2 * c.nodes.count; k++)
            w[k] = -c.nodes.x[k];
        memcpy(x_old, c.nodes.x, sizeof x_old);
        memset(force, 0, sizeof force);
        silt_pockets_force(&c.pockets, 2, dt, w, force);
        for (int k = 0; k < 2 * c.nodes.count; k++)
            c.nodes.x[k] += dt * w[k];
        at[0] = force[0] / -c.pockets.vector[0];
        silt_pockets_advance(&c.pockets, &c.scene, &c.mesh, x_old, c.nodes.x);
        at[1] = c.pockets.pocket[0].pressure;
        NEAR(at[0] / at[1], 1, 3 * dt);
        bench_close(&c);
    }
    bench_close(&b);
}

// ---- a jittered block of water, 24 x 12, with holes

#define NX 24
#define NY 12

typedef bool (*hole_test)(double x, double y);

static bool two_holes(double x, double y) { return y > 4.5 && y < 7.5 && ((x > 4.5 && x < 8.5) || (x > 14.5 && x < 18.5)); }
static bool one_long_hole(double x, double y) { return y > 4.5 && y < 7.5 && x > 4.5 && x < 18.5; }
static bool right_one_open(double x, double y) { return two_holes(x, y) || (x > 14.5 && x < 18.5 && y > 6); }
static bool no_hole(double x, double y) {
    (void)x;
    (void)y;
    return false;
}

// the same nodes keep their ids and places whatever the holes are
static void block_make(bench *b, hole_test hole) {
    const double h = b->scene.fluid.size;
    silt_nodes_clear(&b->nodes);
    b->mesh.n_cell = 0;
    uint64_t random = 3;
    for (int j = 0; j <= NY; j++)
        for (int i = 0; i <= NX; i++) {
            const double dx = 0.3 * (silt_uniform(&random) - 0.5), dy = 0.3 * (silt_uniform(&random) - 0.5);
            const bool rim = i == 0 || j == 0 || i == NX || j == NY;
            if (!hole(i, j))
                node_add(&b->nodes, 1 + j * (NX + 1) + i, h * (i + (rim ? 0 : dx)), h * (j + (rim ? 0 : dy)));
        }
    int *triangle, n;
    assert_int_equal(silt_delaunay_2d(b->nodes.count, b->nodes.x, &triangle, &n), 0);
    for (int e = 0; e < n; e++) {
        const int *t = triangle + 3 * e;
        double x = 0, y = 0;
        for (int a = 0; a < 3; a++) {
            const int64_t id = b->nodes.id[t[a]] - 1;
            x += id % (NX + 1) / 3.0;
            y += id / (NX + 1) / 3.0;
        }
        const double *p = b->nodes.x + 2 * t[0], *q = b->nodes.x + 2 * t[1], *r = b->nodes.x + 2 * t[2];
        const double longest = silt_max(hypot(q[0] - p[0], q[1] - p[1]), silt_max(hypot(r[0] - q[0], r[1] - q[1]), hypot(p[0] - r[0], p[1] - r[1])));
        if (!hole(x, y) && longest < 2.5 * h)
            push(&b->mesh, t[0], t[1], t[2]);
    }
    free(triangle);
    silt_mesh_connect(&b->mesh, &b->nodes);
}

static double inside_area(const bench *b) {
    double area = NX * NY * silt_square(b->scene.fluid.size);
    for (int e = 0; e < b->mesh.n_cell; e++)
        area -= silt_cell_area(b->nodes.x, b->mesh.cell[e]);
    return area;
}

static void test_pockets_merge_split_open(void **state) {
    (void)state;
    bench b = {.scene = plain};
    block_make(&b, no_hole);
    update(&b);
    assert_int_equal(b.pockets.count, 0);
    block_make(&b, two_holes);
    update(&b);
    assert_int_equal(b.pockets.count, 2);
    assert_int_equal(b.air.n_missing, 0);
    silt_pocket_state first[2] = {b.pockets.pocket[0], b.pockets.pocket[1]};
    NEAR(first[0].volume + first[1].volume, inside_area(&b), 1e-13);
    NEAR(b.pockets.enclosed, inside_area(&b), 1e-13);
    assert_true(first[0].id != first[1].id);

    // one is pressed to twice the air's pressure
    b.pockets.pocket[0].amount *= pow(2, 1 / 1.4);
    block_make(&b, two_holes);
    update(&b);
    NEAR(b.pockets.pocket[0].pressure, AIR, 1e-6 * AIR);
    NEAR(b.pockets.pocket[1].pressure, 0, 1e-6 * AIR);
    assert_true(b.pockets.pocket[0].id == first[0].id && b.pockets.pocket[1].id == first[1].id);
    const double amount = b.pockets.pocket[0].amount + b.pockets.pocket[1].amount;

    // they merge: what they hold adds up, and the volume between them reaches the pressure little by little
    block_make(&b, one_long_hole);
    update(&b);
    assert_int_equal(b.pockets.count, 1);
    silt_pocket_state *p = b.pockets.pocket;
    NEAR(p->amount, amount, 1e-13);
    NEAR(p->volume, inside_area(&b), 1e-13);
    NEAR(p->jump, 0.9 * (p->volume - first[0].volume - first[1].volume), 1e-13);
    assert_true(p->id == first[0].id); // where most of the air was
    for (int k = 0; k < 400; k++)
        update(&b);
    NEAR(b.pockets.pocket[0].pressure, AIR * (pow(amount / p->volume, 1.4) - 1), 1e-6 * AIR);

    // split again: the same pressure in both, nothing lost
    const double pressure = b.pockets.pocket[0].pressure;
    block_make(&b, two_holes);
    update(&b);
    assert_int_equal(b.pockets.count, 2);
    NEAR(b.pockets.pocket[0].amount + b.pockets.pocket[1].amount, amount, 1e-13);
    NEAR(b.pockets.pocket[0].amount / b.pockets.pocket[0].volume, b.pockets.pocket[1].amount / b.pockets.pocket[1].volume, 1e-12);
    assert_true(b.pockets.pocket[0].id != b.pockets.pocket[1].id);
    NEAR(b.pockets.pocket[0].pressure, b.pockets.pocket[1].pressure, 1e-6 * AIR);
    assert_true(b.pockets.pocket[0].pressure > pressure);

    // the right one opens: its air is gone, the other stays
    double side[2] = {0};
    for (int q = 0; q < 2; q++)
        side[b.nodes.x[2 * b.pockets.node[b.pockets.pocket[q].first_node]] > 11 * b.scene.fluid.size] = b.pockets.pocket[q].amount;
    const double left = side[0], right = side[1];
    assert_true(left > 0 && right > 0);
    block_make(&b, right_one_open);
    update(&b);
    assert_int_equal(b.pockets.count, 1);
    NEAR(b.pockets.pocket[0].amount, left, 1e-13);
    NEAR(b.pockets.opened, right, 1e-13);
    // and shut again it starts anew
    block_make(&b, two_holes);
    update(&b);
    assert_int_equal(b.pockets.count, 2);
    for (int q = 0; q < 2; q++)
        if (b.nodes.x[2 * b.pockets.node[b.pockets.pocket[q].first_node]] > 11 * b.scene.fluid.size)
            NEAR(b.pockets.pocket[q].pressure, 0, 1e-6);
    bench_close(&b);
}

static void test_checkpoint(void **state) {
    (void)state;
    bench b = {.scene = plain};
    block_make(&b, two_holes);
    update(&b);
    b.pockets.pocket[1].amount *= 1.1;
    block_make(&b, one_long_hole);
    update(&b);
    char path[] = "/tmp/silt-pocket-XXXXXX";
    const int fd = mkstemp(path);
    assert_true(fd >= 0);
    close(fd);
    silt_store *store = NULL;
    silt_error err = {0};
    silt_pockets again = {0};
    assert_int_equal(silt_store_create(&store, path, &err), SILT_OK);
    assert_int_equal(silt_pockets_save(&b.pockets, store, &err), SILT_OK);
    assert_int_equal(silt_store_commit(&store, &err), SILT_OK);
    assert_int_equal(silt_store_open(&store, path, &err), SILT_OK);
    if (silt_pockets_restore(&again, &b.mesh, store, &err) != SILT_OK)
        fail_msg("%s", err.text);
    silt_store_close(&store);
    unlink(path);
    // both go on alike
    const silt_pockets first = b.pockets;
    b.pockets = (silt_pockets){0};
    b.pockets = again;
    again = first;
    for (int k = 0; k < 2; k++) {
        block_make(&b, two_holes);
        update(&b);
        const silt_pockets t = b.pockets;
        b.pockets = again;
        again = t;
    }
    assert_int_equal(b.pockets.count, 2);
    assert_memory_equal(b.pockets.pocket, again.pocket, 2 * sizeof *again.pocket);
    assert_memory_equal(b.pockets.facet, again.facet, (size_t)(again.pocket[1].first + again.pocket[1].n_facet) * sizeof(int));
    silt_pockets_clear(&again);
    bench_close(&b);
}

// ---- air that walls shut in

static silt_scene *scene_with_air(const char *text) {
    silt_scene *scene = scene_of(text);
    scene->fluid.air_pressure = AIR;
    scene->fluid.air_exponent = 1.4;
    return scene;
}

#define HEAD "silt: 1\ndimension: 2\ntime: {end: 1, output: 1}\ngravity: [0, -9.81]\n"
#define WATER "fluid:\n  density: 1000\n  viscosity: 0\n  size: 0.05\n  jitter: 0.2\n"
#define FINE "fluid:\n  density: 1000\n  viscosity: 0\n  size: 0.025\n  jitter: 0.2\n"

static void tank(const char *text, int expected, double volume) {
    silt_scene *scene = scene_with_air(text);
    bench b = {.scene = *scene};
    silt_walls walls = {0};
    silt_walls_create(&walls, scene, NULL);
    b.barrier.walls = &walls;
    silt_nodes_seed(&b.nodes, scene, &walls, NULL, NULL);
    silt_error err = {0};
    assert_int_equal(silt_mesh_first(&b.mesh, &b.nodes, scene, &b.barrier, &err), SILT_OK);
    update(&b);
    if (b.pockets.count != expected)
        fail_msg("%d pockets, not %d, with %s", b.pockets.count, expected, strstr(text, "walls"));
    if (expected)
        NEAR(b.pockets.pocket[0].volume, volume, 1e-12);
    silt_walls_clear(&walls);
    bench_close(&b);
    silt_scene_free(&scene);
}

static void test_tanks(void **state) {
    (void)state;
    // open above; with a lid; a wedge of water whose air reaches into two dry corners
    tank(HEAD WATER "  regions: [{box: [[0, 0], [1, 0.5]]}]\nwalls: [{polyline: [[0, 1], [0, 0], [1, 0], [1, 1]]}]\n", 0, 0);
    tank(HEAD WATER "  regions: [{box: [[0, 0], [1, 0.5]]}]\nwalls: [{box: [[0, 0], [1, 1]]}]\n", 1, 0.5);
    tank(HEAD WATER "  regions: [{polygon: [[0, 0], [1, 0], [0, 1]]}]\nwalls: [{box: [[0, 0], [1, 1]]}]\n", 1, 0.5);
    // a roof with a hole in it
    tank(HEAD WATER "  regions: [{box: [[0, 0], [1, 0.5]]}]\n"
                    "walls: [{polyline: [[0.3, 1], [0, 1], [0, 0], [1, 0], [1, 1], [0.6, 1]]}]\n", 0, 0);
    // a diving bell in an open tank
    tank(HEAD FINE "  regions: [{box: [[0, 0], [1.2, 0.2]]}, {box: [[0, 0.2], [0.3, 0.95]]}, {box: [[0.4, 0.2], [0.8, 0.4]]},\n"
                    "    {box: [[0.9, 0.2], [1.2, 0.95]]}, {box: [[0.3, 0.8], [0.9, 0.95]]}]\n"
                    "walls: [{polyline: [[0, 1.2], [0, 0], [1.2, 0], [1.2, 1.2]]},\n"
                    "  {closed: true, polyline: [[0.3, 0.2], [0.3, 0.8], [0.9, 0.8], [0.9, 0.2], [0.8, 0.2], [0.8, 0.7], [0.4, 0.7],\n"
                    "    [0.4, 0.2]]}]\n", 1, 0.12);
}


// ---- the same in space

typedef double point[3];

// a rectangle of two triangles, counter-clockwise as the water sees it
static void quad(FILE *to, const point a, const point b, const point c, const point d) {
    const double *corner[2][3] = {{a, b, c}, {a, c, d}};
    for (int t = 0; t < 2; t++) {
        fprintf(to, "facet normal 0 0 0\nouter loop\n");
        for (int k = 0; k < 3; k++)
            fprintf(to, "vertex %.9g %.9g %.9g\n", corner[t][k][0], corner[t][k][1], corner[t][k][2]);
        fprintf(to, "endloop\nendfacet\n");
    }
}

// sides and floor (or roof) of a box, from inside or outside
static void tub(FILE *to, const point lo, const point hi, bool inside, bool floor) {
    point c[8];
    for (int k = 0; k < 8; k++)
        for (int d = 0; d < 3; d++)
            c[k][d] = k >> d & 1 ? hi[d] : lo[d];
    static const int side[5][4] = {{0, 4, 5, 1}, {1, 5, 7, 3}, {3, 7, 6, 2}, {2, 6, 4, 0}, {0, 1, 3, 2}};
    for (int k = 0; k < 5; k++) {
        int n[4];
        for (int a = 0; a < 4; a++)
            n[a] = side[k][k < 4 && !inside ? 3 - a : a];
        if (k == 4) // the roof seen from outside, the floor from inside, are both seen from above
            for (int a = 0; a < 4; a++)
                n[a] += floor ? 0 : 4;
        if (k == 4 && !floor && inside)
            quad(to, c[n[3]], c[n[2]], c[n[1]], c[n[0]]);
        else
            quad(to, c[n[0]], c[n[1]], c[n[2]], c[n[3]]);
    }
}

#define SPACE "silt: 1\ndimension: 3\ntime: {end: 1, output: 1}\ngravity: [0, 0, -9.81]\n"
#define COARSE "fluid:\n  density: 1000\n  viscosity: 0\n  size: 0.1\n  jitter: 0.2\n"

static void space_tank(FILE *surface, const char *path, const char *fluid, int expected, double volume) {
    fprintf(surface, "endsolid\n");
    fclose(surface);
    char text[1000];
    snprintf(text, sizeof text, SPACE "%swalls: [{surface: %s}]\n", fluid, path);
    tank(text, expected, volume);
    unlink(path);
}

static FILE *surface_open(char path[]) {
    const int fd = mkstemps(path, 4);
    assert_true(fd >= 0);
    FILE *to = fdopen(fd, "w");
    fprintf(to, "solid\n");
    return to;
}

static void test_tanks_in_space(void **state) {
    (void)state;
    const point lo = {0, 0, 0}, hi = {1, 0.5, 1};
    const char *half = COARSE "  regions: [{box: [[0, 0, 0], [1, 0.5, 0.5]]}]\n";
    // with a lid; a wedge of water whose air reaches into dry edges
    char text[1000];
    snprintf(text, sizeof text, SPACE "%swalls: [{box: [[0, 0, 0], [1, 0.5, 1]]}]\n", half);
    tank(text, 1, 0.25);
    tank(SPACE COARSE "  regions: [{polygon: [[0, 0], [1, 0], [0, 1]], across: [0, 0.5]}]\nwalls: [{box: [[0, 0, 0], [1, 0.5, 1]]}]\n", 1, 0.25);
    // open above
    char path[] = "/tmp/silt-pocket-XXXXXX.stl";
    FILE *to = surface_open(path);
    tub(to, lo, hi, true, true);
    space_tank(to, path, half, 0, 0);
    // a roof with a hole in it
    strcpy(path, "/tmp/silt-pocket-XXXXXX.stl");
    to = surface_open(path);
    tub(to, lo, hi, true, true);
    quad(to, (point){0, 0, 1}, (point){0, 0.5, 1}, (point){0.3, 0.5, 1}, (point){0.3, 0, 1});
    quad(to, (point){0.6, 0, 1}, (point){0.6, 0.5, 1}, (point){1, 0.5, 1}, (point){1, 0, 1});
    space_tank(to, path, half, 0, 0);
    // a diving bell in an open tank
    strcpy(path, "/tmp/silt-pocket-XXXXXX.stl");
    to = surface_open(path);
    tub(to, (point){0, 0, 0}, (point){1.2, 1.2, 1.2}, true, true);
    const point o[2] = {{0.2, 0.2, 0.2}, {1, 1, 0.9}}, i[2] = {{0.4, 0.4, 0.2}, {0.8, 0.8, 0.7}};
    tub(to, o[0], o[1], false, false);
    tub(to, i[0], i[1], true, false);
    const point rim[2][4] = {{{0.2, 0.2, 0.2}, {1, 0.2, 0.2}, {1, 1, 0.2}, {0.2, 1, 0.2}},
                             {{0.4, 0.4, 0.2}, {0.8, 0.4, 0.2}, {0.8, 0.8, 0.2}, {0.4, 0.8, 0.2}}};
    for (int k = 0; k < 4; k++)
        quad(to, rim[0][(k + 1) % 4], rim[0][k], rim[1][k], rim[1][(k + 1) % 4]);
    space_tank(to, path, "fluid:\n  density: 1000\n  viscosity: 0\n  size: 0.05\n  jitter: 0.2\n"
               "  regions: [{box: [[0, 0, 0], [1.2, 1.2, 0.2]]}, {box: [[0, 0, 0.2], [0.2, 1.2, 1]]},\n"
               "    {box: [[1, 0, 0.2], [1.2, 1.2, 1]]}, {box: [[0.2, 0, 0.2], [1, 0.2, 1]]},\n"
               "    {box: [[0.2, 1, 0.2], [1, 1.2, 1]]}, {box: [[0.2, 0.2, 0.9], [1, 1, 1]]},\n"
               "    {box: [[0.4, 0.4, 0.2], [0.8, 0.8, 0.4]]}]\n", 1, 0.4 * 0.4 * 0.3);
}

// ---- three dimensions: a cube of water with a cube of air in it, scaled

static int compare_face(const void *a, const void *b) {
    const int *p = a, *q = b;
    for (int k = 0; k < 3; k++)
        if (p[k] != q[k])
            return (p[k] > q[k]) - (p[k] < q[k]);
    return 0;
}

static void test_three_dimensions(void **state) {
    (void)state;
    enum { N = 6, ALL = (N + 1) * (N + 1) * (N + 1) };
    static const int order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}};
    const double h = 0.05;
    bench b = {.scene = plain};
    b.scene.dimension = 3;
    b.nodes = (silt_nodes){.dim = 3, .count = ALL};
    b.nodes.x = silt_alloc(3 * ALL, sizeof(double));
    b.nodes.id = silt_alloc(ALL, sizeof(int64_t));
    b.nodes.kind = silt_alloc(ALL, 1);
    b.nodes.wall = silt_alloc(ALL, sizeof *b.nodes.wall);
    silt_mesh *m = &b.mesh;
    m->dim = 3;
    m->n_node = ALL;
    m->wet = silt_alloc(ALL, 1);
    m->surface = silt_alloc(ALL, 1);
    for (int i = 0; i < ALL; i++) {
        b.nodes.id[i] = i + 1;
        b.nodes.x[3 * i] = h * (i % (N + 1));
        b.nodes.x[3 * i + 1] = h * (i / (N + 1) % (N + 1));
        b.nodes.x[3 * i + 2] = h * (i / ((N + 1) * (N + 1)));
        for (int s = 0; s < 3; s++)
            b.nodes.wall[i][s] = -1;
    }
    static int all[6 * N * N * N][4];
    int n = 0;
    m->cell = silt_alloc(6 * N * N * N, sizeof *m->cell);
    for (int c = 0; c < N * N * N; c++)
        for (int q = 0; q < 6; q++) {
            int at[3] = {c % N, c / N % N, c / (N * N)}, cell[4];
            const bool hole = at[0] >= 2 && at[0] < 4 && at[1] >= 2 && at[1] < 4 && at[2] >= 2 && at[2] < 4;
            for (int a = 0; a < 4; a++) {
                if (a > 0)
                    at[order[q][a - 1]]++;
                cell[a] = at[0] + (N + 1) * (at[1] + (N + 1) * at[2]);
            }
            if (q >= 3) {
                const int t = cell[0];
                cell[0] = cell[1];
                cell[1] = t;
            }
            memcpy(all[n++], cell, sizeof cell);
            if (hole)
                continue;
            memcpy(m->cell[m->n_cell++], cell, sizeof cell);
            for (int a = 0; a < 4; a++)
                m->wet[cell[a]] = 1;
        }
    // faces that one cell has: sorted nodes, cell, corner opposite
    int(*face)[5] = silt_alloc((size_t)(4 * m->n_cell), sizeof *face);
    for (int e = 0; e < m->n_cell; e++) {
        assert_true(silt_cell_volume(m, b.nodes.x, e) > 0);
        for (int a = 0; a < 4; a++) {
            int *f = face[4 * e + a], k = 0;
            for (int c = 0; c < 4; c++)
                if (c != a)
                    f[k++] = m->cell[e][c];
            for (int s = 0; s < 3; s++)
                for (int t = s + 1; t < 3; t++)
                    if (f[t] < f[s]) {
                        const int u = f[s];
                        f[s] = f[t];
                        f[t] = u;
                    }
            f[3] = e;
            f[4] = a;
        }
    }
    qsort(face, (size_t)(4 * m->n_cell), sizeof *face, compare_face);
    for (int k = 0; k < 4 * m->n_cell; k++) {
        if ((k > 0 && !compare_face(face[k], face[k - 1])) || (k + 1 < 4 * m->n_cell && !compare_face(face[k], face[k + 1])))
            continue;
        // counter-clockwise from outside
        static const int out[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
        SILT_RESERVE(m->facet, m->facet_capacity, m->n_facet + 1);
        SILT_RESERVE(m->facet_kind, m->facet_kind_capacity, m->n_facet + 1);
        for (int a = 0; a < 3; a++) {
            m->facet[m->n_facet][a] = m->cell[face[k][3]][out[face[k][4]][a]];
            m->surface[m->facet[m->n_facet][a]] = 1;
        }
        m->facet_kind[m->n_facet++] = FACET_FREE;
    }
    free(face);

    silt_air_points(&b.air, &b.scene, &b.nodes, m, NULL);
    silt_air_cells(&b.air, &b.scene, m, &b.barrier, n, all[0]);
    silt_pockets_update(&b.pockets, &b.scene, &b.nodes, m, &b.air);
    const double volume = 8 * h * h * h;
    assert_int_equal(b.pockets.count, 1);
    silt_pocket_state *p = b.pockets.pocket;
    NEAR(p->volume, volume, 1e-15);
    assert_int_equal(p->n_facet, 6 * 4 * 2);
    assert_int_equal(p->n_node, 26);

    // stretched and turned by large amounts in one step: the swept volume is exact
    double *x = silt_alloc(3 * ALL, sizeof *x);
    for (int i = 0; i < ALL; i++) {
        const double *o = b.nodes.x + 3 * i;
        x[3 * i] = 0.9 * o[0] + 0.2 * o[1];
        x[3 * i + 1] = 0.7 * o[1] - 0.1 * o[2] + 0.3;
        x[3 * i + 2] = 1.1 * o[2] + 0.3 * o[0];
    }
    const double det = 0.9 * (0.7 * 1.1) - 0.2 * (0.1 * 0.3);
    silt_pockets_advance(&b.pockets, &b.scene, m, b.nodes.x, x);
    NEAR(p->volume, det * volume, 1e-15);
    NEAR(p->pressure, AIR * (pow(1 / det, 1.4) - 1), 1e-6 * AIR);
    silt_pockets_load(&b.pockets, m, x);
    double work = 0;
    for (int k = 0; k < p->n_node; k++)
        for (int d = 0; d < 3; d++)
            work += b.pockets.vector[3 * k + d] * x[3 * b.pockets.node[k] + d];
    NEAR(work, -3 * det * volume, 1e-14);
    free(x);
    bench_close(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ring_is_compressed), cmocka_unit_test(test_pockets_merge_split_open),
        cmocka_unit_test(test_checkpoint),         cmocka_unit_test(test_tanks),
        cmocka_unit_test(test_tanks_in_space),    cmocka_unit_test(test_three_dimensions),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
