// the first cloud: lattices that fit, clouds that follow a size field, nodes on walls, periodic ends, clouds from a file
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <unistd.h>

#include "pfem.h"
#include "scene_text.h"

#define HEAD2 "silt: 1\ndimension: 2\ntime: {end: 1, output: 1}\ngravity: [0, -9.81]\n"
#define HEAD3 "silt: 1\ndimension: 3\ntime: {end: 1, output: 1}\ngravity: [0, 0, -9.81]\n"
#define WATER "fluid:\n  density: 1000\n  viscosity: 1.0e-3\n  size: 0.05\n"

typedef struct bench {
    silt_scene *scene;
    silt_walls walls;
    silt_nodes nodes;
    silt_mesh mesh;
    int dim;
} bench;

static void bench_open(bench *b, const char *text) {
    *b = (bench){.scene = scene_of(text)};
    silt_error err = {0};
    b->dim = b->scene->dimension;
    assert_int_equal(silt_walls_create(&b->walls, b->scene, &err), SILT_OK);
    silt_nodes_seed(&b->nodes, b->scene, &b->walls, NULL, NULL);
    const silt_barrier barrier = {.walls = &b->walls};
    b->mesh.dim = b->dim;
    b->mesh.period[0] = b->scene->period[1] - b->scene->period[0];
    assert_int_equal(silt_mesh_first(&b->mesh, &b->nodes, b->scene, &barrier, &err), SILT_OK);
}

static void bench_close(bench *b) {
    silt_walls_clear(&b->walls);
    silt_nodes_clear(&b->nodes);
    silt_mesh_clear(&b->mesh);
    silt_scene_free(&b->scene);
}

static int rising(const void *a, const void *b) {
    return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

/** what a cloud is like: edges over the local size, and the number of nodes inside against a cloud of edges of that size */
typedef struct quality {
    double least, low, middle, high, most; // 0, 1, 50, 99, 100 per cent of the edges
    double crowd; // number of cells over what the sizes ask for
    double volume;
} quality;

static quality measure(const bench *b) {
    const silt_mesh *mesh = &b->mesh;
    const double size = b->scene->fluid.size;
    double *ratio = silt_alloc((size_t)mesh->neighbour_start[mesh->n_node] + 1, sizeof *ratio), wanted = 0;
    int n = 0;
    quality q = {0};
    for (int i = 0; i < mesh->n_node; i++)
        for (int k = mesh->neighbour_start[i]; k < mesh->neighbour_start[i + 1]; k++) {
            const int j = mesh->neighbour[k];
            double d[3] = {0};
            for (int c = 0; c < b->dim && j > i; c++) {
                d[c] = b->nodes.x[b->dim * j + c] - b->nodes.x[b->dim * i + c];
                if (mesh->period[c] > 0)
                    d[c] -= mesh->period[c] * floor(d[c] / mesh->period[c] + 0.5);
            }
            if (j > i)
                ratio[n++] = 2 * silt_length(3, d) / (silt_node_h(&b->nodes, i, size) + silt_node_h(&b->nodes, j, size));
        }
    qsort(ratio, (size_t)n, sizeof *ratio, rising);
    for (int e = 0; e < mesh->n_cell; e++) {
        double h = 0;
        for (int a = 0; a <= b->dim; a++)
            h += silt_node_h(&b->nodes, mesh->cell[e][a], size) / (b->dim + 1);
        const double volume = silt_cell_volume(mesh, b->nodes.x, e);
        q.volume += volume;
        // equilateral triangles; in space tetrahedra of the body-centred lattice with edges of h in the mean
        wanted += volume / (b->dim == 2 ? sqrt(3) / 4 * h * h : 1.0 / 12 * pow(1.083 * h, 3));
    }
    q.crowd = mesh->n_cell / wanted;
    q.least = ratio[0];
    q.low = ratio[n / 100];
    q.middle = ratio[n / 2];
    q.high = ratio[n * 99 / 100];
    q.most = ratio[n - 1];
    free(ratio);
    return q;
}

static void tell(const char *what, const bench *b, const quality *q) {
    print_message("%s: %d nodes, %d cells (%.2f of what the size asks for), edges %.2f, 1%% under %.2f, half under %.2f, "
                  "99%% under %.2f, %.2f h\n", what, b->nodes.count, b->mesh.n_cell, q->crowd, q->least, q->low, q->middle,
                  q->high, q->most);
}

static void test_box_of_the_plane(void **state) {
    (void)state;
    bench b;
    bench_open(&b, HEAD2 WATER "  regions: [{box: [[0, 0], [1.03, 0.48]]}]\n");
    const quality q = measure(&b);
    tell("box of the plane", &b, &q);
    assert_true(fabs(q.volume - 1.03 * 0.48) < 1e-14);
    assert_true(q.least > 0.59 && q.most < 1.6);
    // rows are symmetric about the middle
    for (int i = 0; i < b.nodes.count; i++) {
        bool found = false;
        for (int j = 0; j < b.nodes.count && !found; j++)
            found = fabs(b.nodes.x[2 * i] + b.nodes.x[2 * j] - 1.03) < 1e-12 && fabs(b.nodes.x[2 * i + 1] - b.nodes.x[2 * j + 1]) < 1e-12;
        assert_true(found);
    }
    assert_null(b.nodes.h);
    bench_close(&b);
}

static void test_box_of_space(void **state) {
    (void)state;
    bench b;
    bench_open(&b, HEAD3 WATER "  regions: [{box: [[0.1, 0, -0.2], [1.13, 0.48, 0.2]]}]\n"
                               "walls: [{box: [[0.1, 0, -0.2], [2, 0.48, 1]], condition: slip}]\n");
    const quality q = measure(&b);
    tell("box of space", &b, &q);
    assert_true(fabs(q.volume - 1.03 * 0.48 * 0.4) < 1e-13);
    assert_true(q.least > 0.8 && q.most < 1.65 && fabs(q.crowd - 1) < 0.1);
    // a body-centred lattice: 19 x 9 x 7 cubes, corners and middles
    assert_int_equal(b.nodes.count, 20 * 10 * 8 + 19 * 9 * 7);
    // nodes on one, two, three walls: faces, creases, corners; the free surface is at the top and at x = 1.13
    int count[4] = {0};
    for (int i = 0; i < b.nodes.count; i++) {
        const double *x = b.nodes.x + 3 * i;
        const int expected = (x[0] == 0.1) + (x[1] == 0 || x[1] == 0.48) + (x[2] == -0.2);
        int n = 0;
        for (int s = 0; s < 3; s++)
            n += b.nodes.wall[i][s] >= 0;
        assert_int_equal(n, expected);
        count[n]++;
    }
    assert_int_equal(count[3], 2);
    assert_int_equal(count[2], 19 + 19 + 7 + 7 + 8);
    bench_close(&b);
}

static void test_round_and_slanted(void **state) {
    (void)state;
    bench b;
    bench_open(&b, HEAD3 WATER "  regions: [{sphere: [0, 0, 0], radius: 0.4}]\n");
    quality q = measure(&b);
    tell("ball", &b, &q);
    // what the facets cut off: about 0.6 (h/R)^2
    assert_true(fabs(q.volume / (4 * M_PI / 3 * 0.064) - 1) < 0.6 * silt_square(0.05 / 0.4));
    assert_true(q.least > 0.55 && q.low > 0.8 && q.high < 1.6 && q.most < 1.9 && fabs(q.crowd - 1) < 0.12);
    for (int i = 0; i < b.nodes.count; i++)
        if (b.mesh.surface[i])
            assert_true(fabs(silt_length(3, b.nodes.x + 3 * i) - 0.4) < 1e-14);
    bench_close(&b);
    bench_open(&b, HEAD3 WATER "  regions: [{polygon: [[0, 0], [1, 0], [0.6, 0.5], [0, 0.5]], across: [0, 0.4]}]\n");
    q = measure(&b);
    tell("prism", &b, &q);
    assert_true(fabs(q.volume - 0.4 * 0.4) < 1e-13);
    assert_true(q.least > 0.55 && q.low > 0.75 && q.high < 1.6 && q.most < 1.9 && fabs(q.crowd - 1) < 0.12);
    bench_close(&b);
}

static void test_graded(void **state) {
    (void)state;
    static const struct {
        const char *name, *text;
        double volume, least, most;
    } trial[] = {
        {"plane, fine box", HEAD2 WATER "  regions: [{box: [[0, 0], [1, 0.5]]}]\n"
                                        "  sizes: [{box: [[0.2, 0], [0.4, 0.1]], size: 0.0125, distance: 0.02}]\n", 0.5, 0.75, 1.8},
        {"plane, fine surface", HEAD2 WATER "  regions: [{box: [[0, 0], [1, 0.5]]}]\n"
                                            "  sizes: [{near: surface, size: 0.0125, distance: 0.03}]\n"
                                            "walls: [{polyline: [[0, 1], [0, 0], [1, 0], [1, 1]], condition: slip}]\n", 0.5, 0.75, 1.8},
        {"plane, coarse box", HEAD2 WATER "  regions: [{polygon: [[0, 0], [2, 0], [2, 1], [0, 1]]}]\n"
                                          "  sizes: [{box: [[0, 0], [1, 1]], size: 0.1}]\n", 2, 0.7, 1.8},
        {"disc, fine rim", HEAD2 WATER "  regions: [{circle: [0.5, 0.5], radius: 0.4}]\n"
                                       "  sizes: [{near: surface, size: 0.02, distance: 0.03}]\n", 0, 0.75, 1.8},
        {"space, fine floor", HEAD3 WATER "  regions: [{box: [[0, 0, 0], [0.6, 0.4, 0.4]]}]\n"
                                          "  sizes: [{box: [[0, 0, 0], [0.6, 0.4, 0.01]], size: 0.025, distance: 0.03}]\n"
                                          "walls: [{box: [[0, 0, 0], [0.6, 0.4, 1]], condition: slip}]\n", 0.096, 0.5, 2.4},
    };
    for (size_t k = 0; k < sizeof trial / sizeof *trial; k++) {
        bench b;
        bench_open(&b, trial[k].text);
        assert_non_null(b.nodes.h);
        const quality q = measure(&b);
        tell(trial[k].name, &b, &q);
        if (trial[k].volume > 0)
            assert_true(fabs(q.volume - trial[k].volume) < 1e-13);
        assert_true(q.least > trial[k].least && q.most < trial[k].most);
        assert_true(q.low > (b.dim == 2 ? 0.8 : 0.65) && q.high < (b.dim == 2 ? 1.45 : 1.65));
        assert_true(fabs(q.middle - 1) < 0.08 && fabs(q.crowd - 1) < 0.12);
        int dry = 0;
        for (int i = 0; i < b.nodes.count; i++)
            dry += !b.mesh.wet[i];
        assert_int_equal(dry, 0);
        bench_close(&b);
    }
}

static void test_two_regions(void **state) {
    (void)state;
    // a step: the shared piece of outline is inside, no doubled nodes
    bench b;
    bench_open(&b, HEAD3 WATER "  regions: [{box: [[0, 0, 0], [0.5, 0.3, 0.4]]}, {box: [[0.5, 0, 0], [1, 0.3, 0.2]]}]\n");
    const quality q = measure(&b);
    tell("step", &b, &q);
    // the lattices of both do not match: a dent along the edge where they meet
    assert_true(fabs(q.volume / 0.09 - 1) < 2e-3);
    assert_true(q.least > 0.35);
    bench_close(&b);
}

static void test_periodic(void **state) {
    (void)state;
    static const char *const text[] = {
        HEAD2 "periodic: [0, 1]\n" WATER "  regions: [{box: [[0, 0], [1, 0.2]]}]\nwalls: [{polyline: [[-1, 0], [2, 0]], condition: slip}]\n",
        HEAD3 "periodic: [0, 1]\n" WATER "  regions: [{box: [[0, 0, 0], [1, 0.3, 0.2]]}]\n",
        HEAD2 "periodic: [0, 1]\n" WATER "  regions: [{box: [[0, 0], [1, 0.2]]}]\n  sizes: [{box: [[0.8, 0], [1, 0.1]], size: 0.02}]\n",
    };
    for (int k = 0; k < 3; k++) {
        silt_scene *scene = scene_of(text[k]);
        silt_walls walls = {0};
        silt_error err = {0};
        silt_nodes nodes = {0};
        assert_int_equal(silt_walls_create(&walls, scene, &err), SILT_OK);
        silt_nodes_seed(&nodes, scene, &walls, NULL, NULL);
        const int dim = scene->dimension;
        int left = 0;
        for (int i = 0; i < nodes.count; i++) {
            const double *x = nodes.x + dim * i;
            assert_true(x[0] >= 0 && x[0] < 1 - 1e-6);
            left += x[0] == 0;
            for (int j = 0; j < i; j++) {
                double d[3] = {0};
                for (int c = 0; c < dim; c++)
                    d[c] = x[c] - nodes.x[dim * j + c];
                d[0] -= floor(d[0] + 0.5);
                assert_true(silt_length(3, d) > 0.35 * (nodes.h ? 0.02 : 0.05));
            }
        }
        // one of both ends: rows of the lattice that begin on the border
        print_message("periodic: %d nodes, %d at the border\n", nodes.count, left);
        if (k < 2) // 6 rows of 20, or 19 x 6 x 4 cubes around: one of both ends only
            assert_int_equal(nodes.count, k == 0 ? 6 * 20 : 19 * (7 * 5 + 6 * 4));
        assert_true(left >= 2);
        silt_nodes_clear(&nodes);
        silt_walls_clear(&walls);
        silt_scene_free(&scene);
    }
}

// ---- clouds from a file

static silt_status cloud(const char *csv, bench *b, silt_error *err) {
    char path[] = "/tmp/silt-cloud-XXXXXX", text[1000];
    const int fd = mkstemp(path);
    assert_true(fd >= 0 && write(fd, csv, strlen(csv)) == (ssize_t)strlen(csv));
    close(fd);
    snprintf(text, sizeof text,
             HEAD2 WATER "  regions: [{box: [[0, 0], [1, 0.5]]}]\n  cloud: %s\n"
                         "  velocity: {formula: uniform, vector: [0.5, 0]}\n"
                         "walls: [{polyline: [[0, 1], [0, 0], [1, 0], [1, 1]], condition: slip}]\n", path);
    *b = (bench){.scene = scene_of(text), .dim = 2};
    *err = (silt_error){0};
    assert_int_equal(silt_walls_create(&b->walls, b->scene, err), SILT_OK);
    const silt_status status = silt_nodes_read(&b->nodes, b->scene, &b->walls, NULL, NULL, err);
    unlink(path);
    return status;
}

static void test_cloud(void **state) {
    (void)state;
    bench b;
    silt_error err;
    // in the inside, on a wall (nearly), in a corner; velocities of the file win over the formula
    if (cloud("x,y,vx,vy\n0.5,0.25,1,2\n0.3,1e-6,3,0\n0,0,0,0\n1,0.5,0,-1\n", &b, &err) != SILT_OK)
        fail_msg("%s", err.text);
    assert_int_equal(b.nodes.count, 4);
    assert_true(b.nodes.v[0] == 1 && b.nodes.v[1] == 2 && b.nodes.v[2] == 3 && b.nodes.x[3] == 0);
    const int walls[4] = {0, 1, 2, 1};
    for (int i = 0; i < 4; i++)
        assert_int_equal((b.nodes.wall[i][0] >= 0) + (b.nodes.wall[i][1] >= 0), walls[i]);
    bench_close(&b);
    // without velocities: the formula
    assert_int_equal(cloud("# a remark\nx,y\n0.5,0.25\n0.6,0.25\n0.6,0.35\n", &b, &err), SILT_OK);
    assert_true(b.nodes.count == 3 && b.nodes.v[0] == 0.5 && b.nodes.v[1] == 0);
    bench_close(&b);
    static const struct {
        const char *csv, *word;
    } wrong[] = {
        {"x,y\n0.5,0.25\n0.5,-0.1\n0.7,0.3\n", ":3: "},
        {"x,y\n0.5,0.25\n0.6,0.25\n0.5,0.25\n", ":4: the same place as line 2"},
        {"x,y\n0.5,0.25\n7,0.25\n0.7,0.3\n", ":3: x = 7 lies outside"},
    };
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        assert_int_equal(cloud(wrong[k].csv, &b, &err), SILT_INPUT);
        if (!strstr(err.text, wrong[k].word))
            fail_msg("'%s' says nothing of '%s'", err.text, wrong[k].word);
        bench_close(&b);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_box_of_the_plane), cmocka_unit_test(test_box_of_space), cmocka_unit_test(test_round_and_slanted),
        cmocka_unit_test(test_graded),           cmocka_unit_test(test_two_regions),  cmocka_unit_test(test_periodic),
        cmocka_unit_test(test_cloud),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
