// what a run leaves behind in three dimensions and across a periodic border; forces on walls; profiles

#include "draw.h"
#include "output_folder.h"

// ---------------------------------------------------------------- a small world of tetrahedra

// a unit cube with a roof that rises by a fifth to x = 1, in six cells; a drop of one cell; a flying node
enum { CUBE_NODES = 13, CUBE_CELLS = 7, CUBE_FACETS = 16 };
static double cube_x[3 * CUBE_NODES], cube_v[3 * CUBE_NODES], cube_p[CUBE_NODES], cube_debt[CUBE_NODES];
static int64_t cube_id[CUBE_NODES];
static uint8_t cube_kind[CUBE_NODES], cube_wet[CUBE_NODES], cube_facet_kind[CUBE_FACETS];
static int cube_wall[CUBE_NODES][3];
static int cube_cell[CUBE_CELLS][4], cube_facet[CUBE_FACETS][3];

typedef struct world {
    silt_scene scene;
    silt_nodes nodes;
    silt_mesh mesh;
    silt_locator locator;
    silt_ledger ledger;
    silt_view view;
} world;

static double cube_volume(const int *cell) {
    const double *a = cube_x + 3 * cell[0], *b = cube_x + 3 * cell[1], *c = cube_x + 3 * cell[2],
                 *d = cube_x + 3 * cell[3];
    double u[3], v[3], w[3];
    for (int k = 0; k < 3; k++) {
        u[k] = b[k] - a[k];
        v[k] = c[k] - a[k];
        w[k] = d[k] - a[k];
    }
    return (u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
            u[2] * (v[0] * w[1] - v[1] * w[0])) /
           6;
}

// faces of one cell only, counter-clockwise from outside
static void cube_boundary(world *w) {
    static const int face[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    for (int i = 0; i < CUBE_CELLS; i++)
        for (int k = 0; k < 4; k++) {
            bool twice = false;
            for (int j = 0; j < CUBE_CELLS && !twice; j++) {
                int shared = 0;
                for (int a = 0; a < 4; a++)
                    for (int b = 0; b < 3; b++)
                        shared += cube_cell[j][a] == cube_cell[i][face[k][b]];
                twice = j != i && shared == 3;
            }
            if (twice)
                continue;
            assert_true(w->mesh.n_facet < CUBE_FACETS);
            bool roof = true;
            for (int b = 0; b < 3; b++) {
                cube_facet[w->mesh.n_facet][b] = cube_cell[i][face[k][b]];
                roof &= cube_x[3 * cube_cell[i][face[k][b]] + 2] >= 1 || i == 6;
            }
            cube_facet_kind[w->mesh.n_facet++] = roof ? FACET_FREE : FACET_WALL;
        }
    assert_int_equal(w->mesh.n_facet, CUBE_FACETS);
}

// velocity (1 + 2z, 3x, y), pressure 10 - 4z + x
static void world_make(world *w) {
    // corners of the cube by the bits of their number; the paths from 0 to 7 make the cells
    static const int path[6][2] = {{1, 3}, {1, 5}, {2, 3}, {2, 6}, {4, 5}, {4, 6}};
    static const double apart[5][3] = {{2, 0, 0}, {2.3, 0, 0}, {2, 0.3, 0}, {2, 0, 0.3}, {3, 0.5, 2}};
    memset(w, 0, sizeof *w);
    for (int i = 0; i < CUBE_NODES; i++) {
        double *x = cube_x + 3 * i;
        for (int d = 0; d < 3; d++)
            x[d] = i < 8 ? i >> d & 1 : apart[i - 8][d];
        if (i < 8 && x[2] == 1)
            x[2] += 0.2 * x[0];
        cube_v[3 * i] = 1 + 2 * x[2];
        cube_v[3 * i + 1] = 3 * x[0];
        cube_v[3 * i + 2] = x[1];
        cube_p[i] = 10 - 4 * x[2] + x[0];
        cube_id[i] = 20 + i;
        cube_wet[i] = i < CUBE_NODES - 1;
        cube_debt[i] = 0;
        cube_wall[i][0] = cube_wall[i][1] = cube_wall[i][2] = -1;
    }
    cube_debt[CUBE_NODES - 1] = 0.01;
    for (int i = 0; i < CUBE_CELLS; i++) {
        const int cell[4] = {i < 6 ? 0 : 8, i < 6 ? path[i][0] : 9, i < 6 ? path[i][1] : 10, i < 6 ? 7 : 11};
        memcpy(cube_cell[i], cell, sizeof cell);
        if (cube_volume(cell) < 0) {
            cube_cell[i][1] = cell[2];
            cube_cell[i][2] = cell[1];
        }
    }
    w->nodes = (silt_nodes){.dim = 3,
                            .count = CUBE_NODES,
                            .x = cube_x,
                            .v = cube_v,
                            .p = cube_p,
                            .debt = cube_debt,
                            .id = cube_id,
                            .kind = cube_kind,
                            .wall = cube_wall};
    w->mesh = (silt_mesh){.revision = 1,
                          .dim = 3,
                          .n_node = CUBE_NODES,
                          .n_cell = CUBE_CELLS,
                          .cell = cube_cell,
                          .facet = cube_facet,
                          .facet_kind = cube_facet_kind,
                          .wet = cube_wet};
    cube_boundary(w);
    w->scene.dimension = 3;
    w->scene.fluid.on = true;
    w->scene.fluid.size = 1;
    w->scene.fluid.density = 1000;
    w->view = (silt_view){
        .scene = &w->scene, .nodes = &w->nodes, .mesh = &w->mesh, .locator = &w->locator, .ledger = &w->ledger};
}

static void test_gauges(void **state) {
    (void)state;
    silt_gauge_def def[] = {
        {.name = "front", .kind = GAUGE_FRONT, .from = {1}},
        {.name = "back", .kind = GAUGE_FRONT, .from = {-1}},
        {.name = "wide", .kind = GAUGE_EXTENT, .from = {0}},
        {.name = "high", .kind = GAUGE_EXTENT, .from = {2}},
        {.name = "level", .kind = GAUGE_HEIGHT, .from = {0.3, 0.4}},
        {.name = "edge", .kind = GAUGE_HEIGHT, .from = {1, 1}},
        {.name = "spray", .kind = GAUGE_HEIGHT, .from = {2.1, 0.1}},
        {.name = "in", .kind = GAUGE_WETTED, .from = {-0.04, 0.5, 0.5}},
        {.name = "out", .kind = GAUGE_WETTED, .from = {-0.06, 0.5, 0.5}},
        {.name = "p", .kind = GAUGE_PRESSURE, .from = {0.3, -0.02, 0.4}},
        {.name = "p_corner", .kind = GAUGE_PRESSURE, .from = {1.02, 1.02, 1.21}},
        {.name = "v", .kind = GAUGE_VELOCITY, .from = {0.7, 0.2, 0}},
        {.name = "turn", .kind = GAUGE_ANGULAR, .from = {0.1, 0.2, 0.3}},
        {.name = "middle", .kind = GAUGE_CENTROID, .from = {1}},
        {.name = "push", .kind = GAUGE_FORCE, .index = 1},
        {.name = "p_in", .kind = GAUGE_PRESSURE, .from = {0.3, 0.6, 0.4}},
        {.name = "v_in", .kind = GAUGE_VELOCITY, .from = {0.3, 0.6, 0.4}},
        {.name = "no_flow", .kind = GAUGE_DISCHARGE, .from = {0.5, 0}, .to = {0.5, 1}},
        {.name = "wire", .kind = GAUGE_DEPTH, .from = {0.3, 0.4}},
        {.name = "wire_drop", .kind = GAUGE_DEPTH, .from = {2.1, 0.1}},
        {.name = "wire_dry", .kind = GAUGE_DEPTH, .from = {1.5, 0.1}},
    };
    world w;
    silt_error err = {0};
    silt_gauges *gauges = NULL;
    double value[31], force[2][3] = {{1, 2, 3}, {4, 5, 6}};
    char name[64];
    world_make(&w);
    w.scene.gauge = def;
    w.scene.n_gauge = sizeof def / sizeof def[0];
    w.view.wall_force = (const double(*)[3])force;
    assert_int_equal(silt_gauges_count(&w.scene), 31);
    silt_locator_build(&w.locator, &w.mesh, cube_x, 0.5);
    silt_gauges_name(&w.scene, 14, name);
    assert_string_equal(name, "turn_x");
    assert_int_equal(silt_gauges_create(&gauges, &w.view, &err), SILT_OK);
    silt_gauges_read(gauges, &w.view, value);
    const double want[14] = {1, 0, 1, 1.2, 1.06, 1.2, NAN, 1, 0, 8.7, 10 - 4.8 + 1, 1, 2.1, 0.2};
    for (int i = 0; i < 14; i++) {
        if (isnan(want[i]))
            assert_true(isnan(value[i]));
        else
            near(value[i], want[i], 1e-13);
    }

    // water: the cube under its roof, the drop, what flies
    const double volume[3] = {1.1, 0.0045, 0.01};
    const double centre[3][3] = {
        {(0.5 + 0.2 / 3) / 1.1, 0.55 / 1.1, 0.5 * (1 + 0.2 + 0.04 / 3) / 1.1}, {2.075, 0.075, 0.075}, {3, 0.5, 2}};
    double sum[3] = {0}, total = 0;
    for (int k = 0; k < 3; k++) {
        total += volume[k];
        for (int d = 0; d < 3; d++)
            sum[d] += volume[k] * centre[k][d];
    }
    for (int d = 0; d < 3; d++)
        near(value[17 + d], sum[d] / total, 1e-14);
    for (int d = 0; d < 3; d++)
        assert_true(value[20 + d] == 4 + d);
    near(value[23], 10 - 1.6 + 0.3, 1e-13);
    near(value[24], 1.8, 1e-13);
    near(value[25], 0.9, 1e-13);
    near(value[26], 0.6, 1e-13);
    assert_true(isnan(value[27]));
    near(value[28], 1.06, 1e-6);
    near(value[29], 0.1, 1e-6);
    assert_true(value[30] == 0);

    // all with one velocity: arm of the centre of mass times momentum
    for (int i = 0; i < 3 * CUBE_NODES; i++)
        cube_v[i] = 1 + i % 3;
    silt_gauges_read(gauges, &w.view, value);
    const double arm[3] = {sum[0] - 0.1 * total, sum[1] - 0.2 * total, sum[2] - 0.3 * total};
    near(value[14], 1000 * (arm[1] * 3 - arm[2] * 2), 1e-10);
    near(value[15], 1000 * (arm[2] * 1 - arm[0] * 3), 1e-10);
    near(value[16], 1000 * (arm[0] * 2 - arm[1] * 1), 1e-10);
    silt_gauges_free(&gauges);
    silt_locator_clear(&w.locator);
}

// ---------------------------------------------------------------- forces on walls

static void test_wall_forces(void **state) {
    (void)state;
    // in 2-D: a floor (wall 0), a side (wall 1), a floor of another wall (2) in one line with the first
    double normal[6][3] = {{0, 1, 0}, {1, 0, 0}, {0, 1, 0}, {0.8, 0, 0.6}, {0, 1, 0}, {0, 0, 1}};
    int owner[6] = {0, 1, 2, 0, 1, 2}, next[6] = {2, 0, -1, -1, -1, -1};
    silt_walls walls = {.dim = 2, .count = 6, .n_wall = 3, .normal = normal, .wall = owner, .next = next};
    int at[6][3] = {{0, -1, -1}, {0, 1, -1}, {0, 2, -1}, {-1, -1, -1}, {-1, -1, -1}, {2, -1, -1}};
    uint8_t kind[6] = {0, 0, 0, NODE_CORNER, 0, 0}, wet[6] = {1, 1, 1, 1, 1, 0};
    int node_owner[6] = {-1, -1, -1, 1, -1, -1};
    silt_nodes nodes = {.count = 6, .wall = at, .kind = kind, .owner = node_owner};
    silt_mesh mesh = {.n_node = 6, .wet = wet};
    // on the floor; in the corner; between both floors; at an outer corner of the side; nowhere; dry
    const double reaction[12] = {1, 4, 2, 7, 0.5, 10, 3, 5, 100, 100, 100, 100};
    double force[3][3];
    silt_wall_forces(&walls, &nodes, &mesh, reaction, force);
    const double want[3][3] = {{-1 - 0.25, -4 - 7 - 5 - 5, 0}, {-2 - 3, 0, 0}, {-0.25, -5, 0}};
    for (int k = 0; k < 3; k++)
        for (int d = 0; d < 3; d++)
            near(force[k][d], want[k][d], 1e-7);

    // in 3-D: a corner of three walls, one of them oblique, and an edge of two with friction along it
    int corner[2][3] = {{3, 4, 5}, {4, 5, -1}};
    walls.dim = 3;
    nodes = (silt_nodes){.dim = 3, .count = 2, .wall = corner, .kind = kind, .owner = node_owner};
    mesh = (silt_mesh){.dim = 3, .n_node = 2, .wet = wet};
    const double push[6] = {5 * 0.8, 2, 5 * 0.6 + 3, 6, 8, 9};
    silt_wall_forces(&walls, &nodes, &mesh, push, force);
    const double share[3][3] = {{-4, 0, -3}, {-3, -2 - 8, 0}, {-3, 0, -3 - 9}};
    for (int k = 0; k < 3; k++)
        for (int d = 0; d < 3; d++)
            near(force[k][d], share[k][d], 1e-7);
}

// ---------------------------------------------------------------- frames

static void test_frames(void **state) {
    (void)state;
    world w;
    silt_error err = {0};
    int64_t link[4 * CUBE_CELLS + 1], offset[CUBE_CELLS + 2], count;
    uint8_t type[CUBE_CELLS + 1], kind[CUBE_FACETS];
    double x[3 * CUBE_NODES];
    world_make(&w);
    assert_int_equal(silt_frame_write(folder, 0, &w.view, &err), SILT_OK);
    values("fluid_000000.hdf", "VTKHDF/Types", STORE_BYTE, CUBE_CELLS + 1, type);
    assert_memory_equal(type, ((uint8_t[]){10, 10, 10, 10, 10, 10, 10, 1}), sizeof type);
    values("fluid_000000.hdf", "VTKHDF/Connectivity", STORE_LONG, 4 * CUBE_CELLS + 1, link);
    values("fluid_000000.hdf", "VTKHDF/Offsets", STORE_LONG, CUBE_CELLS + 2, offset);
    for (int i = 0; i < CUBE_CELLS; i++) {
        assert_int_equal(offset[i + 1], 4 * (i + 1));
        for (int k = 0; k < 4; k++)
            assert_int_equal(link[4 * i + k], cube_cell[i][k]);
    }
    assert_true(link[4 * CUBE_CELLS] == 12 && offset[CUBE_CELLS + 1] == 4 * CUBE_CELLS + 1);
    values("fluid_000000.hdf", "VTKHDF/Points", STORE_DOUBLE, 3 * CUBE_NODES, x);
    assert_memory_equal(x, cube_x, sizeof x);
    values("fluid_000000.hdf", "VTKHDF/PointData/velocity", STORE_DOUBLE, 3 * CUBE_NODES, x);
    assert_memory_equal(x, cube_v, sizeof x);

    // the boundary: every node but the flying one; its closed faces hold the volume
    values("surface_000000.hdf", "VTKHDF/NumberOfPoints", STORE_LONG, 1, &count);
    assert_int_equal(count, CUBE_NODES - 1);
    values("surface_000000.hdf", "VTKHDF/CellData/kind", STORE_BYTE, CUBE_FACETS, kind);
    assert_memory_equal(kind, cube_facet_kind, sizeof kind);
    silt_grid grid;
    double volume = 0;
    assert_true(silt_grid_read(&grid, folder, "surface", 0, "PointData/pressure"));
    assert_true(grid.width == 1 && grid.n_cell == CUBE_FACETS && silt_grid_corners(&grid, 3) == 3);
    for (int i = 0; i < grid.n_cell; i++) {
        const double *a = grid.x + 3 * grid.link[3 * i], *b = grid.x + 3 * grid.link[3 * i + 1],
                     *c = grid.x + 3 * grid.link[3 * i + 2];
        volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                   a[2] * (b[0] * c[1] - b[1] * c[0])) /
                  6;
    }
    near(volume, 1.1045, 1e-14);
    for (int i = 0; i < grid.n_point; i++)
        near(grid.value[i], 10 - 4 * grid.x[3 * i + 2] + grid.x[3 * i], 1e-14);
    silt_grid_clear(&grid);
    assert_true(exists("surface.hdf.series"));
    assert_int_equal(silt_frame_cut(folder, -1, &err), SILT_OK);
    assert_false(exists("surface_000000.hdf"));
}

// ---------------------------------------------------------------- a periodic channel

// from x = 10 to 11, four columns of nodes, one of them on the border; velocity (y, 0)
enum { RING = 4 };
static double ring_x[4 * RING], ring_v[4 * RING], ring_p[2 * RING];
static int64_t ring_id[2 * RING];
static uint8_t ring_kind[2 * RING], ring_wet[2 * RING], ring_facet_kind[2 * RING];
static int ring_cell[2 * RING][4], ring_facet[2 * RING][3];

static void ring_make(world *w) {
    memset(w, 0, sizeof *w);
    for (int i = 0; i < RING; i++)
        for (int k = 0; k < 2; k++) {
            const int n = 2 * i + k, next = 2 * ((i + 1) % RING);
            ring_x[2 * n] = 10 + 0.25 * i;
            ring_x[2 * n + 1] = k * (1 + 0.1 * i);
            ring_v[2 * n] = ring_x[2 * n + 1];
            ring_p[n] = n;
            ring_id[n] = n;
            ring_wet[n] = 1;
            const int cell[4] = {2 * i, next, k ? next + 1 : 2 * i + 1, -1};
            memcpy(ring_cell[n], cell, sizeof cell);
            if (!k)
                ring_cell[n][0] = next, ring_cell[n][1] = next + 1;
            ring_facet[n][0] = k ? next + 1 : 2 * i;
            ring_facet[n][1] = k ? 2 * i + 1 : next;
            ring_facet[n][2] = -1;
            if (!k) {
                ring_cell[n][0] = 2 * i;
                ring_cell[n][1] = next + 1;
                ring_cell[n][2] = 2 * i + 1;
            }
        }
    w->nodes = (silt_nodes){.count = 2 * RING, .x = ring_x, .v = ring_v, .p = ring_p, .id = ring_id, .kind = ring_kind};
    w->mesh = (silt_mesh){.revision = 1,
                          .period = {1},
                          .n_node = 2 * RING,
                          .n_cell = 2 * RING,
                          .cell = ring_cell,
                          .n_facet = 2 * RING,
                          .facet = ring_facet,
                          .facet_kind = ring_facet_kind,
                          .wet = ring_wet};
    w->scene.dimension = 2;
    w->scene.period[0] = 10;
    w->scene.period[1] = 11;
    w->scene.fluid = (silt_fluid_def){.on = true, .size = 0.25, .density = 1000};
    w->view = (silt_view){
        .scene = &w->scene, .nodes = &w->nodes, .mesh = &w->mesh, .locator = &w->locator, .ledger = &w->ledger};
}

static void test_periodic(void **state) {
    (void)state;
    world w;
    silt_error err = {0};
    silt_gauges *gauges = NULL;
    silt_gauge_def def[] = {
        {.name = "level", .kind = GAUGE_HEIGHT, .from = {10.95}},
        {.name = "inside", .kind = GAUGE_HEIGHT, .from = {10.3}},
        {.name = "q", .kind = GAUGE_DISCHARGE, .from = {10.75, 0}, .to = {10.75, 2}},
        {.name = "q_border", .kind = GAUGE_DISCHARGE, .from = {10.875, 0}, .to = {10.875, 2}},
        {.name = "p", .kind = GAUGE_PRESSURE, .from = {10.9, -0.01}},
        {.name = "middle", .kind = GAUGE_CENTROID},
    };
    double value[8];
    ring_make(&w);
    for (int i = 0; i < 2 * RING; i++)
        assert_true(silt_cell_volume(&w.mesh, ring_x, i) > 0);
    w.scene.gauge = def;
    w.scene.n_gauge = 6;
    assert_int_equal(silt_gauges_create(&gauges, &w.view, &err), SILT_OK);
    silt_gauges_read(gauges, &w.view, value);
    near(value[0], 1.3 - 0.3 * 0.8, 1e-14);
    near(value[1], 1.12, 1e-14);
    near(value[2], 0.5 * 1.3 * 1.3, 1e-13);
    // on the diagonal of the border's cells: y there 1/2, top 1.15; u is y on the roof, and linear below in each cell
    near(value[3], 0.5 * 0.5 * 0.5 + 0.5 * (0.5 + 1.15) * 0.65, 1e-13);
    near(value[4], 6 * 0.4 + 0 * 0.6, 1e-13);
    silt_gauges_free(&gauges);

    // no cell of the frame is wider than a column; the copies stand one period on
    silt_grid grid;
    assert_int_equal(silt_frame_write(folder, 0, &w.view, &err), SILT_OK);
    assert_true(silt_grid_read(&grid, folder, "fluid", 0, "PointData/pressure"));
    assert_int_equal(grid.n_point, 2 * RING + 2);
    assert_int_equal(grid.n_cell, 2 * RING);
    double area = 0;
    for (int i = 0; i < grid.n_cell; i++) {
        const double *a = grid.x + 3 * grid.link[3 * i], *b = grid.x + 3 * grid.link[3 * i + 1],
                     *c = grid.x + 3 * grid.link[3 * i + 2];
        assert_true(fabs(a[0] - b[0]) < 0.26 && fabs(a[0] - c[0]) < 0.26);
        area += 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
    }
    near(area, 0.25 * (1.05 + 1.15 + 1.25 + 1.15), 1e-13);
    for (int i = 2 * RING; i < grid.n_point; i++)
        assert_true(grid.x[3 * i] == 11 && grid.value[i] == grid.x[3 * i + 1]);
    silt_grid_clear(&grid);
    assert_int_equal(silt_frame_cut(folder, -1, &err), SILT_OK);
}

// ---------------------------------------------------------------- profiles

static silt_check_result profile(world *w, silt_check_def *def) {
    silt_check_result result = {0};
    silt_error err = {0};
    w->scene.n_check = 1;
    w->scene.check = def;
    w->scene.folder = folder;
    if (silt_check_measure(&w->scene, folder, &result, &err))
        fail_msg("%s", err.text);
    return result;
}

static silt_check_def profile_of(silt_profile kind, double at, const char *reference) {
    return (silt_check_def){.name = (char *)(uintptr_t) "profile",
                            .kind = CHECK_PROFILE,
                            .profile = kind,
                            .at = at,
                            .reference = (char *)(uintptr_t)reference,
                            .x = (char *)(uintptr_t) "s",
                            .y = (char *)(uintptr_t) "y",
                            .place_scale = 1,
                            .scale = 1,
                            .align = NAN,
                            .low = NAN,
                            .high = NAN,
                            .window = {-HUGE_VAL, HUGE_VAL},
                            .window_value = {-HUGE_VAL, HUGE_VAL},
                            .norm = NORM_MAX,
                            .relative_to = 1,
                            .tolerance = 1e-12};
}

static void test_profiles(void **state) {
    (void)state;
    world w;
    silt_error err = {0};
    // two frames of the ring's wall-bounded twin: without the period its last columns are apart
    ring_make(&w);
    w.mesh.period[0] = 0;
    w.mesh.n_cell = 2 * RING - 2;
    for (int i = 0; i < 2; i++) {
        w.view.time = 2 * i;
        for (int k = 0; k < 2 * RING && i; k++) {
            ring_x[2 * k + 1] *= 2;
            ring_v[2 * k] *= 4;
        }
        assert_int_equal(silt_frame_write(folder, i, &w.view, &err), SILT_OK);
    }
    make("history.csv", "step,time\n");
    // surface: 1 + 0.4 (x - 10), twice that at 2 s; a beach beyond 10.75 that rises by a half
    double beach[] = {9, -1, 0, 10.75, 0.4, 0, 12, 1.025, 0}, lid[] = {12, 5, 0, 9, 5, 0};
    silt_wall wall[] = {{.n_point = 3, .point = beach}, {.n_point = 2, .point = lid}};
    w.scene.wall = wall;
    w.scene.n_wall = 2;
    make("surface.csv", "s,y,z\n10,1,1.5\n10.1,1.04,1.56\n10.75,1.3,1.95\n11.25,0.65,0.65\n13,7,7\n");
    silt_check_def def = profile_of(PROFILE_SURFACE, 0, "surface.csv");
    silt_check_result r = profile(&w, &def);
    near(r.error, 0, 1e-13);
    assert_true(r.pass);
    contains(r.note, "4 of 5 rows");
    def.at = 1;
    def.y = (char *)(uintptr_t) "z";
    near(profile(&w, &def).error, 0, 1e-13);

    // scaled: abscissa 2 (x - 10), ordinate 10 (y - 1)
    make("scaled.csv", "s,y\n0,0\n0.2,0.4\n1.5,3\n");
    def = profile_of(PROFILE_SURFACE, 0, "scaled.csv");
    def.place_scale = 2;
    def.place_shift = -10;
    def.scale = 10;
    def.shift = -1;
    near(profile(&w, &def).error, 0, 1e-12);

    // a field on an upright line at 10.25: v = 4 (y / 2), at 1 s the mean of two; outside of the line nothing
    make("line.csv", "s,y\n-0.1,5\n0,0\n0.5,0.75\n1.1,1.65\n1.15,9\n");
    def = profile_of(PROFILE_VELOCITY_X, 1, "line.csv");
    memcpy(def.line, (double[]){10.25, 0, 0, 10.25, 1.1, 0}, sizeof def.line);
    r = profile(&w, &def);
    near(r.error, 0, 1e-12);
    contains(r.note, "3 of 5 rows");
    def.profile = PROFILE_VELOCITY_Y;
    near(profile(&w, &def).error, 1.65, 1e-12);
    def.profile = PROFILE_SPEED;
    near(profile(&w, &def).error, 0, 1e-12);

    // no frame there, no reference
    def.at = 2.5;
    r = profile(&w, &def);
    assert_false(r.pass);
    contains(r.note, "the frames are from 0 to 2 s, the profile is wanted at 2.5");
    def.reference = (char *)(uintptr_t) "nowhere.csv";
    contains(profile(&w, &def).note, "nowhere.csv");
    assert_int_equal(silt_frame_cut(folder, -1, &err), SILT_OK);

    // in space: the roof on a slanting line, and a field along it
    world_make(&w);
    w.scene.n_wall = 0;
    assert_int_equal(silt_frame_write(folder, 0, &w.view, &err), SILT_OK);
    make("roof.csv", "s,y\n0,1\n0.5,1.06\n1,1.12\n");
    def = profile_of(PROFILE_SURFACE, 0, "roof.csv");
    memcpy(def.line, (double[]){0, 0.1, 0, 0.6, 0.9, 0}, sizeof def.line);
    near(profile(&w, &def).error, 0, 1e-13);
    make("field.csv", "s,y\n0,10\n0.5,10.3\n1,10.6\n");
    def.profile = PROFILE_PRESSURE;
    def.reference = (char *)(uintptr_t) "field.csv";
    near(profile(&w, &def).error, 0, 1e-13);
    assert_int_equal(silt_frame_cut(folder, -1, &err), SILT_OK);
}

// discs in layers of 0.1 m at two times: their area over the thickness, its mean, and over what is at a place
static void test_grain_profile(void **state) {
    (void)state;
    world w;
    silt_error err = {0};
    const int64_t id[] = {1, 2, 3, 4};
    double x[12] = {5, 0.2, 0, 6, 0.22, 0, 7, 0.5, 0, 8, 0.56, 0}, rest[12] = {0};
    const double radius[] = {0.01, 0.02, 0.03, 0.04};
    const silt_grain_state grains = {.count = 4, .id = id, .x = x, .v = rest, .omega = rest, .radius = radius};
    ring_make(&w);
    w.scene.grains.on = true;
    w.view.grains = &grains;
    for (int i = 0; i < 3; i++) {
        w.view.time = i;
        x[10] = i == 2 ? 0.54 : 0.56; // at 2 s the fourth is in the layer around 0.5
        assert_int_equal(silt_frame_write(folder, i, &w.view, &err), SILT_OK);
    }
    make("history.csv", "step,time\n");
    // pi 0.0005/0.1, 0, pi 0.0009/0.1 and at 2 s pi 0.0025/0.1
    make("grains.csv", "s,early,late,mean,unit\n0.2,0.005,0.005,0.005,1\n0.35,0,0,0,0\n0.5,0.009,0.025,0.017,3.4\n");
    silt_check_def def = profile_of(PROFILE_GRAINS, 1, "grains.csv");
    memcpy(def.line, (double[]){3, 0, 0, 3, 1, 0}, sizeof def.line);
    def.layer = 0.1;
    def.since = def.unit_at = NAN;
    def.scale = 1 / M_PI;
    def.y = (char *)(uintptr_t) "early";
    near(profile(&w, &def).error, 0, 1e-14);
    def.at = 2;
    def.y = (char *)(uintptr_t) "late";
    near(profile(&w, &def).error, 0, 1e-14);
    def.since = 1;
    def.y = (char *)(uintptr_t) "mean";
    near(profile(&w, &def).error, 0, 1e-14);
    def.scale = 1;
    def.unit_at = 0.2;
    def.y = (char *)(uintptr_t) "unit";
    near(profile(&w, &def).error, 0, 1e-13);
    // nothing where it is to be 1, and a mean that the frames do not reach
    def.unit_at = 0.35;
    silt_check_result r = profile(&w, &def);
    assert_false(r.pass);
    contains(r.note, "there are no grains at 0.35");
    def.at = 3;
    contains(profile(&w, &def).note, "the frames are from 0 to 2 s, the profile is wanted from 1 to 3");
    assert_int_equal(silt_frame_cut(folder, -1, &err), SILT_OK);
}

// ---------------------------------------------------------------- pictures

// sections of the cube and of the drop: area, values, and one outline each
static void test_slice(void **state) {
    (void)state;
    static const struct {
        int axis;
        double at, area, p[3]; // pressure is p[0] + p[1] u + p[2] v
        int outline;
    } cut[] = {{1, 0.5, 1.1, {10.5, 0, -4}, 0},
               {2, 0.5, 1.1, {10, 1, -4}, 0},
               {3, 0.25, 1 + 0.5 * 0.05 * 0.05, {9, 1, 0}, 0},
               {1, 2.1, 0.5 * 0.2 * 0.2, {12.1, 0, -4}, 3}};
    const silt_draw_field field = {"pressure", "pressure, Pa", "PointData/pressure", NULL, MADE_LENGTH, NULL, 0};
    world w;
    silt_error err = {0};
    world_make(&w);
    assert_int_equal(silt_frame_write(folder, 0, &w.view, &err), SILT_OK);
    for (int i = 0; i < 4; i++) {
        const silt_draw_canvas c = {
            .out = folder, .scene = &w.scene, .field = &field, .slice = cut[i].axis, .slice_at = cut[i].at};
        silt_grid grid;
        double area = 0;
        assert_true(silt_draw_read(&c, &grid, "fluid", 0, field.water));
        for (int k = 0; k < grid.n_cell; k++) {
            const double *a = grid.x + 3 * grid.link[3 * k], *b = grid.x + 3 * grid.link[3 * k + 1],
                         *d = grid.x + 3 * grid.link[3 * k + 2];
            area += 0.5 * fabs((b[0] - a[0]) * (d[1] - a[1]) - (b[1] - a[1]) * (d[0] - a[0]));
        }
        near(area, cut[i].area, 1e-14);
        // an edge that one triangle has is the outline: as long as the triangles share their points
        int edges = 0;
        for (int k = 0; k < 3 * grid.n_cell; k++) {
            const int a = grid.link[k], b = grid.link[k % 3 == 2 ? k - 2 : k + 1];
            int same = 0;
            for (int m = 0; m < 3 * grid.n_cell; m++) {
                const int p = grid.link[m], q = grid.link[m % 3 == 2 ? m - 2 : m + 1];
                same += (p == a && q == b) || (p == b && q == a);
            }
            assert_true(same == 1 || same == 2);
            edges += same == 1;
        }
        assert_true(edges < 3 * grid.n_cell || grid.n_cell == 1);
        if (cut[i].outline)
            assert_int_equal(edges, cut[i].outline);
        for (int k = 0; k < grid.n_point; k++)
            near(grid.value[k], cut[i].p[0] + cut[i].p[1] * grid.x[3 * k] + cut[i].p[2] * grid.x[3 * k + 1], 1e-13);
        silt_grid_clear(&grid);
    }
    assert_int_equal(silt_frame_cut(folder, -1, &err), SILT_OK);
}

// bodies are drawn with the scene's own surface, where history.csv has them: a brick turned by a quarter about z
static void test_draw_form(void **state) {
    (void)state;
    silt_body_def brick = {.name = "brick", .shape = SHAPE_BOX, .scale = 4, .depth = 2, .height = 1, .axis = {0, 0, 1}, .density = 1};
    const silt_scene scene = {.dimension = 3, .n_body = 1, .body = &brick};
    const double c = sqrt(0.5);
    silt_draw_forms *forms = NULL;
    double *point = NULL, lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    FILE *to = fopen(place("history.csv"), "w");
    fprintf(to, "step,time,brick_x,brick_y,brick_z,brick_qw,brick_qx,brick_qy,brick_qz\n0,0,0,0,0,1,0,0,0\n7,0.5,10,20,30,%.17g,0,0,%.17g\n", c, c);
    fclose(to);
    silt_draw_forms_make(&forms, &scene, folder);
    const silt_solid *solid = silt_draw_form(forms, &scene, 0, 0.5, &point);
    assert_non_null(solid);
    for (int i = 0; i < solid->n_point; i++)
        for (int d = 0; d < 3; d++) {
            lo[d] = silt_min(lo[d], point[3 * i + d]);
            hi[d] = silt_max(hi[d], point[3 * i + d]);
        }
    static const double half[3] = {1, 2, 0.5};
    for (int d = 0; d < 3; d++) {
        near(lo[d], 10 * (d + 1) - half[d], 1e-12);
        near(hi[d], 10 * (d + 1) + half[d], 1e-12);
    }
    near(solid->volume, 8, 1e-12);
    free(point);
    // at a time that history.csv does not have the frame's surface is all there is
    point = NULL;
    assert_null(silt_draw_form(forms, &scene, 0, 0.4, &point));
    assert_null(point);
    silt_draw_forms_free(&forms);
    assert_null(forms);
}

// the colour of a pixel that shows a point of the world
static unsigned pixel(const silt_draw_canvas *c, int x, int y) {
    const uint8_t *row = cairo_image_surface_get_data(c->surface) + y * cairo_image_surface_get_stride(c->surface);
    return ((const uint32_t *)(const void *)row)[x] & 0xffffff;
}

static void test_draw(void **state) {
    (void)state;
    static const unsigned map[] = {0x000000, 0xffffff};
    const silt_draw_field field = {"pressure", "pressure, Pa", "PointData/pressure", NULL, MADE_LENGTH, map, 2};
    const silt_frame_entry entry = {0, 0};
    world w;
    silt_error err = {0};
    world_make(&w);
    assert_int_equal(silt_frame_write(folder, 0, &w.view, &err), SILT_OK);
    silt_draw_canvas c = {.out = folder, .scene = &w.scene, .field = &field};
    silt_draw_space_survey(&c, &entry, 1);
    // pressure from 6 to 12.3 gets round ends; the room is the boundary's box
    assert_true(c.low <= 6 && c.low >= 5 && c.high >= 12 && c.high <= 13);
    assert_true(c.lo[0] == 0 && c.hi[0] == 2.3 && c.lo[2] == 0 && c.hi[2] >= 1.2);
    const int width = MARGIN_LEFT + c.width + c.right, height = MARGIN_TOP + c.height + MARGIN_BOTTOM;
    c.surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
    c.cr = cairo_create(c.surface);
    cairo_set_source_rgb(c.cr, 1, 1, 1);
    cairo_paint(c.cr);
    silt_draw_space(&c, &entry);
    // something is there, and it is brighter where the pressure is higher: the foot of the front against its top
    int inked = 0;
    for (int y = MARGIN_TOP; y < MARGIN_TOP + c.height; y++)
        for (int x = MARGIN_LEFT; x < MARGIN_LEFT + c.width; x++)
            inked += pixel(&c, x, y) != 0xffffff;
    assert_true(inked > 0.15 * c.width * c.height && inked < 0.9 * c.width * c.height);
    cairo_destroy(c.cr);
    cairo_surface_destroy(c.surface);
    assert_int_equal(silt_frame_cut(folder, -1, &err), SILT_OK);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gauges),   cmocka_unit_test(test_wall_forces), cmocka_unit_test(test_frames),
        cmocka_unit_test(test_periodic), cmocka_unit_test(test_profiles),    cmocka_unit_test(test_slice),
        cmocka_unit_test(test_draw), cmocka_unit_test(test_draw_form),     cmocka_unit_test(test_grain_profile),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
