// what a run leaves behind: checkpoints, gauges, history, frames, pictures

#include "output_folder.h"

// ---------------------------------------------------------------- a small world

// unit square of two cells, a drop of one cell, a flying node; velocity (1 + 2y, 3x), pressure 10 - 4y + x
static double square_x[] = {0, 0, 1, 0, 1, 1, 0, 1, 2, 0, 2.2, 0, 2, 0.2, 3, 0.5};
enum { SQUARE_NODES = 8 };
static int square_cell[][4] = {{0, 1, 2, -1}, {0, 2, 3, -1}, {4, 5, 6, -1}};
static int square_facet[][3] = {{0, 1, -1}, {1, 2, -1}, {2, 3, -1}, {3, 0, -1}, {4, 5, -1}, {5, 6, -1}, {6, 4, -1}};
static double square_v[2 * SQUARE_NODES], square_p[SQUARE_NODES], square_solid[SQUARE_NODES];
static int64_t square_id[SQUARE_NODES] = {10, 11, 12, 13, 14, 15, 16, 17};
static uint8_t square_kind[SQUARE_NODES] = {NODE_CORNER, NODE_CORNER}, square_wet[] = {1, 1, 1, 1, 1, 1, 1, 0};

static double bed_x[][3] = {{0, -1, 0}, {1, -0.5, 0}, {2, -1, 0}, {9, 9, 0}};
static uint8_t bed_alive[] = {1, 1, 1, 0};
static double bed_work[] = {1, 2, 3, 4}, bed_shear[] = {5, 6, 7, 8};
static int bed_cell[][4] = {{0, 2, 1, -1}}, bed_edge[][3] = {{0, 1, -1}, {1, 2, -1}};
static double bed_mass[] = {795}, bed_area[] = {0.5};

static int64_t grain_id[] = {3, 7};
static double grain_x[] = {0.5, 1.5, 0, 0.7, 1.5, 0}, grain_v[] = {1, 2, 0, 3, 4, 0},
              grain_omega[] = {0, 0, 5, 0, 0, 6};
static double grain_radius[] = {0.1, 0.05};

static double outline[] = {-0.2, -0.1, 0.2, -0.1, 0.2, 0.1, -0.2, 0.1};
// turned by a right angle
static struct silt_body block = {.x = {1.5, 0.5, 0}, .v = {1, 0, 0}, .w = {0, 0, 2}, .n_point = 4, .point = outline};

typedef struct world {
    silt_scene scene;
    silt_nodes nodes;
    silt_mesh mesh;
    silt_locator locator;
    silt_bed bed;
    silt_grain_state grains;
    silt_body_state bodies;
    silt_ledger ledger;
    silt_view view;
} world;

static silt_body_def block_def = {.name = "block"};

static void world_make(world *w) {
    memset(w, 0, sizeof *w);
    for (int i = 0; i < SQUARE_NODES; i++) {
        square_v[2 * i] = 1 + 2 * square_x[2 * i + 1];
        square_v[2 * i + 1] = 3 * square_x[2 * i];
        square_p[i] = 10 - 4 * square_x[2 * i + 1] + square_x[2 * i];
        square_solid[i] = 0.2;
    }
    block.q[0] = block.q[3] = sqrt(0.5);
    w->nodes = (silt_nodes){
        .count = SQUARE_NODES, .x = square_x, .v = square_v, .p = square_p, .id = square_id, .kind = square_kind};
    w->mesh = (silt_mesh){.revision = 1,
                          .n_node = SQUARE_NODES,
                          .n_cell = 3,
                          .cell = square_cell,
                          .n_facet = 7,
                          .facet = square_facet,
                          .wet = square_wet};
    w->bed = (silt_bed){.n_node = 4,
                        .x = bed_x,
                        .alive = bed_alive,
                        .work = bed_work,
                        .shear = bed_shear,
                        .n_cell = 1,
                        .cell = bed_cell,
                        .mass = bed_mass,
                        .area = bed_area,
                        .n_edge = 2,
                        .edge = bed_edge};
    w->grains = (silt_grain_state){
        .count = 2, .id = grain_id, .x = grain_x, .v = grain_v, .omega = grain_omega, .radius = grain_radius};
    w->bodies = (silt_body_state){.count = 1, .body = &block};
    w->scene.fluid.on = true;
    w->scene.fluid.size = 1;
    silt_locator_build(&w->locator, &w->mesh, square_x, 1);
    w->view = (silt_view){
        .scene = &w->scene, .nodes = &w->nodes, .mesh = &w->mesh, .locator = &w->locator, .ledger = &w->ledger};
}

// water, bed, grains and a body
static void world_full(world *w) {
    world_make(w);
    w->scene.bed.on = w->scene.grains.on = true;
    w->scene.n_body = 1;
    w->scene.body = &block_def;
    w->view.bed = &w->bed;
    w->view.grains = &w->grains;
    w->view.bodies = &w->bodies;
}

// ---------------------------------------------------------------- store

static void test_store_round_trip(void **state) {
    (void)state;
    silt_error err = {0};
    silt_store *store = NULL;
    const uint8_t byte[] = {0, 255};
    const int whole[] = {-1, 2147483647};
    const int64_t wide[] = {INT64_MIN, INT64_MAX, 0};
    const double real[] = {0.1, -HUGE_VAL, 5e-324, NAN};
    assert_int_equal(silt_store_create(&store, place("a.h5"), &err), SILT_OK);
    assert_int_equal(silt_store_put(store, "kind", STORE_BYTE, 2, byte, &err), SILT_OK);
    assert_int_equal(silt_store_put(store, "nodes/owner", STORE_INT, 2, whole, &err), SILT_OK);
    assert_int_equal(silt_store_put(store, "nodes/deep/id", STORE_LONG, 3, wide, &err), SILT_OK);
    assert_int_equal(silt_store_put(store, "nodes/x", STORE_DOUBLE, 4, real, &err), SILT_OK);
    assert_int_equal(silt_store_put(store, "nodes/none", STORE_DOUBLE, 0, NULL, &err), SILT_OK);
    assert_false(exists("a.h5"));
    assert_int_equal(silt_store_commit(&store, &err), SILT_OK);
    assert_null(store);
    assert_true(exists("a.h5"));
    assert_false(exists("a.h5.part"));

    uint8_t byte_back[2];
    int whole_back[2];
    int64_t wide_back[3];
    double real_back[4];
    size_t n;
    assert_int_equal(silt_store_open(&store, place("a.h5"), &err), SILT_OK);
    assert_int_equal(silt_store_take(store, "kind", STORE_BYTE, 2, byte_back, &err), SILT_OK);
    assert_int_equal(silt_store_take(store, "nodes/owner", STORE_INT, 2, whole_back, &err), SILT_OK);
    assert_int_equal(silt_store_take(store, "nodes/deep/id", STORE_LONG, 3, wide_back, &err), SILT_OK);
    assert_int_equal(silt_store_take(store, "nodes/x", STORE_DOUBLE, 4, real_back, &err), SILT_OK);
    assert_int_equal(silt_store_take(store, "nodes/none", STORE_DOUBLE, 0, NULL, &err), SILT_OK);
    assert_memory_equal(byte, byte_back, sizeof byte);
    assert_memory_equal(whole, whole_back, sizeof whole);
    assert_memory_equal(wide, wide_back, sizeof wide);
    assert_memory_equal(real, real_back, sizeof real);
    assert_int_equal(silt_store_count(store, "nodes/x", &n, &err), SILT_OK);
    assert_int_equal(n, 4);

    // what is not as expected: the message names file and array
    assert_int_equal(silt_store_take(store, "nodes/y", STORE_DOUBLE, 4, real_back, &err), SILT_FAILED);
    contains(err.text, "a.h5: array nodes/y is absent");
    assert_int_equal(silt_store_count(store, "bed/x", &n, &err), SILT_FAILED);
    contains(err.text, "bed/x is absent");
    assert_int_equal(silt_store_take(store, "nodes/x", STORE_DOUBLE, 3, real_back, &err), SILT_FAILED);
    contains(err.text, "nodes/x has 4 values, 3 are needed");
    assert_int_equal(silt_store_take(store, "nodes/x", STORE_LONG, 4, real_back, &err), SILT_FAILED);
    contains(err.text, "nodes/x does not hold 64-bit integers");
    silt_store_close(&store);
    silt_store_close(&store);
}

static void test_store_failures(void **state) {
    (void)state;
    silt_error err = {0};
    silt_store *store = NULL;
    double real[1000] = {1};
    assert_int_equal(silt_store_open(&store, place("absent.h5"), &err), SILT_FAILED);
    contains(err.text, "absent.h5: cannot be read (No such file");
    make("text.h5", "no hdf5");
    assert_int_equal(silt_store_open(&store, place("text.h5"), &err), SILT_FAILED);
    contains(err.text, "text.h5: not an HDF5 file");
    assert_int_equal(silt_store_create(&store, place("nowhere/b.h5"), &err), SILT_FAILED);
    contains(err.text, "nowhere/b.h5.part: cannot be written (No such file");
    assert_null(store);

    // not committed: no file, and the one that was there stays
    assert_int_equal(silt_store_create(&store, place("b.h5"), &err), SILT_OK);
    assert_int_equal(silt_store_put(store, "x", STORE_DOUBLE, 1000, real, &err), SILT_OK);
    silt_store_close(&store);
    assert_false(exists("b.h5"));
    assert_false(exists("b.h5.part"));

    // a put that failed spoils the file
    assert_int_equal(silt_store_create(&store, place("b.h5"), &err), SILT_OK);
    assert_int_equal(silt_store_put(store, "x", STORE_DOUBLE, 1000, real, &err), SILT_OK);
    assert_int_equal(silt_store_put(store, "x", STORE_DOUBLE, 1000, real, &err), SILT_FAILED);
    contains(err.text, "array x");
    contains(err.text, "it is there already");
    assert_int_equal(silt_store_commit(&store, &err), SILT_FAILED);
    assert_false(exists("b.h5"));

    // any other byte is found out, also where HDF5 would read another number
    assert_int_equal(silt_store_create(&store, place("c.h5"), &err), SILT_OK);
    assert_int_equal(silt_store_put(store, "x", STORE_DOUBLE, 1000, real, &err), SILT_OK);
    assert_int_equal(silt_store_commit(&store, &err), SILT_OK);
    struct stat whole;
    assert_int_equal(stat(place("c.h5"), &whole), 0);
    for (int part = 0; part <= 64; part++) {
        FILE *damaged = fopen(place("c.h5"), "r+b");
        assert_non_null(damaged);
        const long at = (long)(whole.st_size - 1) * part / 64;
        for (int turn = 0; turn < 2; turn++) {
            assert_int_equal(fseek(damaged, at, SEEK_SET), 0);
            const int byte = fgetc(damaged);
            assert_int_equal(fseek(damaged, at, SEEK_SET), 0);
            assert_int_equal(fputc(byte ^ 1, damaged), byte ^ 1);
            assert_int_equal(fflush(damaged), 0);
            // damaged in the first turn, mended in the second
            assert_int_equal(silt_store_open(&store, place("c.h5"), &err), turn ? SILT_OK : SILT_FAILED);
            if (turn)
                silt_store_close(&store);
            else
                contains(err.text, "damaged");
        }
        fclose(damaged);
    }

    // cut short
    assert_int_equal(silt_store_create(&store, place("b.h5"), &err), SILT_OK);
    assert_int_equal(silt_store_put(store, "x", STORE_DOUBLE, 1000, real, &err), SILT_OK);
    assert_int_equal(silt_store_commit(&store, &err), SILT_OK);
    struct stat file;
    assert_int_equal(stat(place("b.h5"), &file), 0);
    assert_int_equal(truncate(place("b.h5"), file.st_size / 2), 0);
    assert_int_equal(silt_store_open(&store, place("b.h5"), &err), SILT_FAILED);
    contains(err.text, "b.h5: damaged or cut short");
}

// ---------------------------------------------------------------- gauges

static void test_gauges(void **state) {
    (void)state;
    silt_gauge_def def[] = {
        {.name = "front", .kind = GAUGE_FRONT, .from = {1}},
        {.name = "back", .kind = GAUGE_FRONT, .from = {-1}},
        {.name = "level", .kind = GAUGE_HEIGHT, .from = {0.25}},
        {.name = "spray", .kind = GAUGE_HEIGHT, .from = {2.1}},
        {.name = "in", .kind = GAUGE_WETTED, .from = {0.5, 0.5}},
        {.name = "out", .kind = GAUGE_WETTED, .from = {1.5, 0.5}},
        {.name = "p", .kind = GAUGE_PRESSURE, .from = {0.25, 0.75}},
        {.name = "p_wall", .kind = GAUGE_PRESSURE, .from = {-0.01, 0.5}},
        {.name = "p_dry", .kind = GAUGE_PRESSURE, .from = {-0.1, 0.5}},
        {.name = "v", .kind = GAUGE_VELOCITY, .from = {0.75, 0.25}},
        {.name = "q", .kind = GAUGE_DISCHARGE, .from = {0.5, 0}, .to = {0.5, 1}},
        {.name = "q_back", .kind = GAUGE_DISCHARGE, .from = {0.5, 2}, .to = {0.5, -1}},
        {.name = "q_edge", .kind = GAUGE_DISCHARGE, .from = {0, 0}, .to = {1, 1}},
        {.name = "bed", .kind = GAUGE_BED_LEVEL, .from = {0.5}},
        {.name = "no_bed", .kind = GAUGE_BED_LEVEL, .from = {5}},
        {.name = "scour", .kind = GAUGE_SCOUR, .from = {0.5}},
        {.name = "lowest", .kind = GAUGE_BED_LOWEST, .from = {0.2, 0.6}},
        {.name = "no_lowest", .kind = GAUGE_BED_LOWEST, .from = {5, 6}},
    };
    world w;
    silt_error err = {0};
    silt_gauges *gauges = NULL;
    double value[20];
    char name[64];
    world_make(&w);
    w.view.bed = &w.bed;
    w.scene.gauge = def;
    w.scene.n_gauge = sizeof def / sizeof def[0];
    assert_int_equal(silt_gauges_count(&w.scene), 20);
    silt_gauges_name(&w.scene, 8, name);
    assert_string_equal(name, "p_dry");
    silt_gauges_name(&w.scene, 10, name);
    assert_string_equal(name, "v_y");
    silt_gauges_name(&w.scene, 17, name);
    assert_string_equal(name, "scour");

    assert_int_equal(silt_gauges_create(&gauges, &w.view, &err), SILT_OK);
    bed_x[1][1] = -0.7; // the bed's crest sinks
    silt_gauges_read(gauges, &w.view, value);
    const double want[] = {1, 0, 1, NAN, 1, 0, 7.25, 8, NAN, 1.5, 2.25, 0, 2, -2, 0.5, -0.85, NAN, 0.1, -0.94, NAN};
    for (int i = 0; i < 20; i++) {
        if (isnan(want[i]))
            assert_true(isnan(value[i]));
        else
            near(value[i], want[i], 1e-14);
    }
    // grains take a fifth of the room
    w.view.solid = square_solid;
    silt_gauges_read(gauges, &w.view, value);
    near(value[12], 1.6, 1e-14);

    // the bed's start goes through a checkpoint
    silt_store *store = NULL;
    assert_int_equal(silt_store_create(&store, place("gauges.h5"), &err), SILT_OK);
    assert_int_equal(silt_gauges_save(gauges, store, &err), SILT_OK);
    assert_int_equal(silt_store_commit(&store, &err), SILT_OK);
    silt_gauges_free(&gauges);
    assert_int_equal(silt_gauges_create(&gauges, &w.view, &err), SILT_OK);
    assert_int_equal(silt_store_open(&store, place("gauges.h5"), &err), SILT_OK);
    assert_int_equal(silt_gauges_load(gauges, store, &err), SILT_OK);
    silt_store_close(&store);
    silt_gauges_read(gauges, &w.view, value);
    near(value[17], 0.1, 1e-14);
    bed_x[1][1] = -0.5;

    // without water there is nothing to measure
    w.view.nodes = NULL;
    silt_gauges_read(gauges, &w.view, value);
    assert_true(isnan(value[0]) && isnan(value[4]) && isnan(value[10]) && !isnan(value[15]));
    silt_gauges_free(&gauges);
    silt_gauges_free(&gauges);
    silt_locator_clear(&w.locator);
}

// ---------------------------------------------------------------- history

#define WALLS "wall_mesh,wall_assemble,wall_solve,wall_bed,wall_dem,wall_move,wall_output\n"
#define WATER                                                                                                          \
    "step,time,dt,n_node,n_cell,fluid_volume,flying_volume,mesh_volume,fluid_mass,volume_error,kinetic_energy,"        \
    "potential_energy,momentum_x,momentum_y,momentum_z,momentum_error,external_work,dissipation,max_speed,volume_solved,"        \
    "volume_moved,volume_reconnected,volume_refined,volume_given,volume_owed,owed_energy,angular_momentum_x,"                      \
    "angular_momentum_y,angular_momentum_z,"
#define GRAIN_FORCES                                                                                                   \
    "grain_velocity_x,grain_velocity_y,grain_velocity_z,grain_kinetic_energy,grain_potential_energy,grain_water_x,grain_water_y,grain_water_z,grain_contact_x,"    \
    "grain_contact_y,grain_contact_z,"

static void test_history_columns(void **state) {
    (void)state;
    world w;
    silt_error err = {0};
    silt_history *history = NULL;
    silt_gauge_def gauge[] = {{.name = "v", .kind = GAUGE_VELOCITY, .from = {0}}, {.name = "q", .kind = GAUGE_DISCHARGE, .from = {0}}};
    world_make(&w);
    assert_int_equal(silt_history_create(&history, folder, &w.scene, &err), SILT_OK);
    assert_int_equal(silt_history_close(&history, &err), SILT_OK);
    assert_string_equal(content("history.csv"), WATER WALLS);

    silt_locator_clear(&w.locator);
    world_full(&w);
    w.scene.gauge = gauge;
    w.scene.n_gauge = 2;
    w.scene.fluid.n_outlet = 1;
    assert_int_equal(silt_history_create(&history, folder, &w.scene, &err), SILT_OK);
    assert_int_equal(silt_history_close(&history, &err), SILT_OK);
    assert_string_equal(content("history.csv"),
                        WATER "bed_mass,released_mass,deposited_mass,pore_water_mass,bed_shear,bed_work,bed_y_plus,grain_count,grain_mass," GRAIN_FORCES
                              "sediment_error,left_mass,body_kinetic_energy,body_potential_energy,inflow_mass,outflow_mass,block_x,block_y,block_z,block_vx,"
                              "block_vy,block_vz,block_qw,block_qx,block_qy,block_qz,block_wx,block_wy,block_wz,"
                              "block_fx,block_fy,block_fz,block_tx,block_ty,block_tz,block_cx,block_cy,block_cz,"
                              "v_x,v_y,v_z,q," WALLS);
    // grains and bodies alone
    w.scene.fluid = (silt_fluid_def){0};
    w.scene.bed.on = false;
    w.scene.n_body = w.scene.n_gauge = 0;
    assert_int_equal(silt_history_create(&history, folder, &w.scene, &err), SILT_OK);
    assert_int_equal(silt_history_close(&history, &err), SILT_OK);
    assert_string_equal(content("history.csv"), "step,time,dt,grain_count,grain_mass," GRAIN_FORCES "sediment_error,left_mass," WALLS);
    silt_locator_clear(&w.locator);
}

static void history_rows(silt_history *history, world *w, int first, int last) {
    silt_error err = {0};
    for (int i = first; i <= last; i++) {
        w->view.step = i;
        w->view.time = i / 3.0;
        w->ledger.fluid_volume = 0.1 * i;
        w->ledger.grain_count = 2 * i;
        assert_int_equal(silt_history_row(history, &w->view, (double[]){i % 2 ? NAN : i / 7.0}, &err), SILT_OK);
    }
}

static void test_history_reopen(void **state) {
    (void)state;
    world w;
    silt_error err = {0};
    silt_history *history = NULL;
    silt_gauge_def gauge[] = {{.name = "level", .kind = GAUGE_HEIGHT, .from = {0}}};
    world_full(&w);
    w.scene.gauge = gauge;
    w.scene.n_gauge = 1;
    assert_int_equal(silt_history_create(&history, folder, &w.scene, &err), SILT_OK);
    history_rows(history, &w, 0, 5);
    // rows are on their way before the file is closed: a killed run keeps them
    char *whole = strdup(content("history.csv"));
    assert_int_equal(silt_history_close(&history, &err), SILT_OK);
    assert_string_equal(content("history.csv"), whole);

    // 17 digits: the same bits
    const char *row = strchr(whole, '\n') + 1;
    row = strchr(row, '\n') + 1;
    long long step;
    double time;
    assert_int_equal(sscanf(row, "%lld,%lf", &step, &time), 2);
    assert_int_equal(step, 1);
    assert_true(time == 1 / 3.0);
    contains(row, ",nan,");

    // a killed run: half a row at the end; the checkpoint was at step 3
    FILE *to = fopen(place("history.csv"), "a");
    fputs("6,2.0,0.3", to);
    fclose(to);
    assert_int_equal(silt_history_reopen(&history, folder, &w.scene, 3, &err), SILT_OK);
    history_rows(history, &w, 4, 5);
    assert_int_equal(silt_history_close(&history, &err), SILT_OK);
    assert_string_equal(content("history.csv"), whole);
    // half a row behind the checkpoint's step
    to = fopen(place("history.csv"), "a");
    fputs("6,2.0,0.3", to);
    fclose(to);
    assert_int_equal(silt_history_reopen(&history, folder, &w.scene, 5, &err), SILT_OK);
    assert_int_equal(silt_history_close(&history, &err), SILT_OK);
    assert_string_equal(content("history.csv"), whole);

    // a history that ends before its checkpoint, or belongs to another scene
    assert_int_equal(silt_history_reopen(&history, folder, &w.scene, 6, &err), SILT_FAILED);
    contains(err.text, "history.csv: ends at step 5, before the checkpoint's step 6");
    assert_null(history);
    w.scene.bed.on = false;
    assert_int_equal(silt_history_reopen(&history, folder, &w.scene, 3, &err), SILT_FAILED);
    contains(err.text, "its header does not belong to the scene");
    assert_string_equal(content("history.csv"), whole);
    free(whole);
    silt_locator_clear(&w.locator);
}

// ---------------------------------------------------------------- frames

static void test_frames(void **state) {
    (void)state;
    world w;
    silt_error err = {0};
    world_full(&w);
    for (int i = 0; i < 3; i++) {
        w.view.time = 0.25 * i;
        w.view.step = 10 * i;
        assert_int_equal(silt_frame_write(folder, i, &w.view, &err), SILT_OK);
    }
    assert_false(exists("fluid_000000.hdf.part"));

    // water: three triangles and the flying node as a vertex
    double v[3 * SQUARE_NODES], p[SQUARE_NODES], time;
    int64_t link[10], offset[5], id[SQUARE_NODES], count;
    uint8_t type[4], kind[SQUARE_NODES];
    values("fluid_000001.hdf", "VTKHDF/Points", STORE_DOUBLE, 3 * SQUARE_NODES, v);
    assert_true(v[15] == 2.2 && v[16] == 0 && v[17] == 0 && v[21] == 3 && v[22] == 0.5);
    values("fluid_000001.hdf", "VTKHDF/PointData/velocity", STORE_DOUBLE, 3 * SQUARE_NODES, v);
    assert_true(v[6] == 3 && v[7] == 3 && v[8] == 0);
    values("fluid_000001.hdf", "VTKHDF/PointData/pressure", STORE_DOUBLE, SQUARE_NODES, p);
    assert_memory_equal(p, square_p, sizeof p);
    values("fluid_000001.hdf", "VTKHDF/PointData/porosity", STORE_DOUBLE, SQUARE_NODES, p);
    assert_true(p[0] == 1);
    values("fluid_000001.hdf", "VTKHDF/PointData/id", STORE_LONG, SQUARE_NODES, id);
    assert_memory_equal(id, square_id, sizeof id);
    values("fluid_000001.hdf", "VTKHDF/PointData/kind", STORE_BYTE, SQUARE_NODES, kind);
    assert_memory_equal(kind, square_kind, sizeof kind);
    values("fluid_000001.hdf", "VTKHDF/NumberOfCells", STORE_LONG, 1, &count);
    assert_int_equal(count, 4);
    values("fluid_000001.hdf", "VTKHDF/NumberOfConnectivityIds", STORE_LONG, 1, &count);
    assert_int_equal(count, 10);
    values("fluid_000001.hdf", "VTKHDF/Connectivity", STORE_LONG, 10, link);
    assert_memory_equal(link, ((int64_t[]){0, 1, 2, 0, 2, 3, 4, 5, 6, 7}), sizeof link);
    values("fluid_000001.hdf", "VTKHDF/Offsets", STORE_LONG, 5, offset);
    assert_memory_equal(offset, ((int64_t[]){0, 3, 6, 9, 10}), sizeof offset);
    values("fluid_000001.hdf", "VTKHDF/Types", STORE_BYTE, 4, type);
    assert_memory_equal(type, ((uint8_t[]){5, 5, 5, 1}), sizeof type);
    values("fluid_000001.hdf", "VTKHDF/FieldData/TimeValue", STORE_DOUBLE, 1, &time);
    assert_true(time == 0.25);

    // bed: living nodes only
    values("bed_000001.hdf", "VTKHDF/PointData/work", STORE_DOUBLE, 3, v);
    assert_true(v[0] == 1 && v[2] == 3);
    values("bed_000001.hdf", "VTKHDF/PointData/shear", STORE_DOUBLE, 3, v);
    assert_true(v[1] == 6);
    values("bed_000001.hdf", "VTKHDF/CellData/density", STORE_DOUBLE, 1, v);
    assert_true(v[0] == 1590);
    values("grains_000001.hdf", "VTKHDF/PointData/radius", STORE_DOUBLE, 2, v);
    assert_true(v[0] == 0.1 && v[1] == 0.05);
    values("grains_000001.hdf", "VTKHDF/PointData/omega", STORE_DOUBLE, 6, v);
    assert_true(v[2] == 5 && v[5] == 6);
    values("grains_000001.hdf", "VTKHDF/PointData/id", STORE_LONG, 2, id);
    assert_true(id[0] == 3 && id[1] == 7);
    // the block stands upright
    values("bodies_000001.hdf", "VTKHDF/Points", STORE_DOUBLE, 12, v);
    near(v[0], 1.6, 1e-15);
    near(v[1], 0.3, 1e-15);
    values("bodies_000001.hdf", "VTKHDF/CellData/velocity", STORE_DOUBLE, 3, v);
    assert_true(v[0] == 1);

    // indices and links
    assert_string_equal(content("grains.hdf.series"), "{\n  \"file-series-version\": \"1.0\",\n  \"files\": [\n"
                                                      "    {\"name\": \"grains_000000.hdf\", \"time\": 0},\n"
                                                      "    {\"name\": \"grains_000001.hdf\", \"time\": 0.25},\n"
                                                      "    {\"name\": \"grains_000002.hdf\", \"time\": 0.5}\n  ]\n}\n");
    values("run.h5", "frames/000001/bed/CellData/density", STORE_DOUBLE, 1, v);
    assert_true(v[0] == 1590);
    contains(content("run.log"), "frame 000002  time 0.5  step 20");

    // a resume at frame 1 forgets frame 2, a frame written again stands once
    assert_int_equal(silt_frame_cut(folder, 1, &err), SILT_OK);
    assert_false(exists("fluid_000002.hdf") || exists("bodies_000002.hdf"));
    assert_int_equal(silt_frame_write(folder, 1, &w.view, &err), SILT_OK);
    silt_frame_entry *entry = NULL;
    assert_int_equal(silt_frame_index(folder, &entry), 2);
    assert_true(entry[1].number == 1 && entry[1].time == 0.5);
    free(entry);
    assert_int_equal(silt_frame_cut(folder, -1, &err), SILT_OK);
    assert_false(exists("fluid_000000.hdf") || exists("fluid.hdf.series"));
    assert_int_equal(silt_frame_index(folder, &entry), 0);
    silt_locator_clear(&w.locator);
}

// no grain yet is a frame too; what the scene has not is not written
static void test_frames_empty(void **state) {
    (void)state;
    world w;
    silt_error err = {0};
    int64_t count;
    world_make(&w);
    w.scene.grains.on = true;
    assert_int_equal(mkdir(place("empty"), 0777), 0);
    assert_int_equal(silt_frame_write(place("empty"), 0, &w.view, &err), SILT_OK);
    values("empty/grains_000000.hdf", "VTKHDF/NumberOfCells", STORE_LONG, 1, &count);
    assert_int_equal(count, 0);
    assert_false(exists("empty/bed_000000.hdf") || exists("empty/bodies_000000.hdf"));
    assert_int_equal(silt_frame_write(place("missing"), 0, &w.view, &err), SILT_FAILED);
    contains(err.text, "missing/fluid_000000.hdf.part: cannot be written (No such file");
    silt_locator_clear(&w.locator);
}

// ---------------------------------------------------------------- pictures

static void test_draw(void **state) {
    (void)state;
    static const char *const field[] = {"speed", "pressure", "porosity", "elevation", "vorticity", "mesh", "bed"};
    world w;
    silt_error err = {0};
    struct stat file;
    world_full(&w);
    mkdir(place("draw"), 0777);
    make("draw/scene.yaml", SCENE);
    make("draw/curve.csv", "t,x\n1,1\n2,4\n");
    assert_int_equal(silt_draw(place("draw"), &(silt_draw_def){0}, NULL, &err), SILT_FAILED);
    contains(err.text, "has no frames");
    for (int i = 0; i < 2; i++) {
        w.view.time = i;
        assert_int_equal(silt_frame_write(place("draw"), i, &w.view, &err), SILT_OK);
    }
    for (int i = 0; i < 7; i++) {
        unlink(place("draw/picture_000001.png"));
        if (silt_draw(place("draw"), &(silt_draw_def){.field = field[i]}, NULL, &err))
            fail_msg("%s", err.text);
        assert_false(exists("draw/picture_000000.png"));
        assert_int_equal(stat(place("draw/picture_000001.png"), &file), 0);
        assert_true(file.st_size > 4000);
    }
    assert_memory_equal(content("draw/picture_000001.png"), "\x89PNG", 4);
    assert_int_equal(silt_draw(place("draw"), &(silt_draw_def){.frames = DRAW_ALL, .field = "mesh"}, NULL, &err), SILT_OK);
    assert_true(exists("draw/picture_000000.png"));
    assert_int_equal(silt_draw(place("draw"), &(silt_draw_def){.frames = DRAW_ONE, .frame = 7}, NULL, &err), SILT_INPUT);
    contains(err.text, "has no frame 7; its frames are 0 to 1");
    assert_int_equal(silt_draw(place("draw"), &(silt_draw_def){.frames = DRAW_ONE, .field = "colour"}, NULL, &err), SILT_INPUT);
    contains(err.text, "field colour is not known: mesh, pressure, speed, elevation, vorticity, porosity, eddies or bed");
    silt_locator_clear(&w.locator);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_store_round_trip), cmocka_unit_test(test_store_failures), cmocka_unit_test(test_gauges),
        cmocka_unit_test(test_history_columns),  cmocka_unit_test(test_history_reopen), cmocka_unit_test(test_frames),
        cmocka_unit_test(test_frames_empty),     cmocka_unit_test(test_draw),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
