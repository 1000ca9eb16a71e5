// a grain settles in still water, by whole runs of cases/settling-grain: terminal velocity at d/h = 0.1, 0.5 and 2, what
// the grain gains and loses step by step, rest on the floor, stiff drag; and with the loop's parts: momentum of the water
#include "run.h"

#include <setjmp.h>
#include <stdarg.h>
#include <sys/stat.h>

#include <cmocka.h>

#include "check.h"

// ---------------------------------------------------------------- runs and what they leave

/** columns of history.csv that are asked for here */
enum { TIME, STEP, MASS, VELOCITY, WATER, CONTACT, MOMENTUM, N_COLUMN };
static const char *const column_name[N_COLUMN] = {
    "time", "dt", "grain_mass", "grain_velocity_y", "grain_water_y", "grain_contact_y", "momentum_error"};

typedef struct history {
    int n, capacity;
    double (*row)[N_COLUMN]; // owned
} history;

static void history_take(history *h, const char *out) {
    char *path = silt_text("%s/history.csv", out), *line = NULL;
    size_t size = 0;
    int place[N_COLUMN];
    FILE *from = fopen(path, "r");
    assert_non_null(from);
    assert_true(getline(&line, &size, from) > 0);
    for (int k = 0; k < N_COLUMN; k++) {
        place[k] = -1;
        int i = 0;
        for (const char *at = line; at; at = strchr(at, ','), at = at ? at + 1 : NULL, i++)
            if (strncmp(at, column_name[k], strlen(column_name[k])) == 0 && at[strlen(column_name[k])] == ',')
                place[k] = i;
        assert_true(place[k] >= 0);
    }
    while (getline(&line, &size, from) > 0) {
        SILT_RESERVE(h->row, h->capacity, h->n + 1);
        int i = 0;
        for (const char *at = line; at; at = strchr(at, ','), at = at ? at + 1 : NULL, i++)
            for (int k = 0; k < N_COLUMN; k++)
                if (place[k] == i)
                    h->row[h->n][k] = strtod(at, NULL);
        h->n++;
    }
    fclose(from);
    free(line);
    free(path);
}

// the case with other keys
static history settle(const char *name, int n_set, const char *const *set) {
    history h = {0};
    silt_scene *scene = NULL;
    char *out = silt_text("test_settling_%s.out", name);
    OK(silt_scene_read(SILT_SOURCE "/cases/settling-grain/scene.yaml", n_set, set, &scene, &error));
    const silt_run_def def = {.out = out, .worker = SILT_BINARY "/silt-dem", .quiet = true, .force = true};
    OK(silt_scene_run(scene, &def, &error));
    history_take(&h, out);
    silt_scene_free(&scene);
    free(out);
    return h;
}

// the velocity at which drag by Schiller and Naumann carries the submerged weight
static double schiller_naumann(double d, double density, double water, double viscosity, double g) {
    double low = 0, high = 10;
    for (int k = 0; k < 200; k++) {
        const double v = 0.5 * (low + high), re = water * v * d / viscosity;
        const double cd = re < 1000 ? 24 / re * (1 + 0.15 * pow(re, 0.687)) : 0.44;
        *(cd * M_PI / 8 * water * d * d * v * v < M_PI / 6 * d * d * d * (density - water) * g ? &low : &high) = v;
    }
    return 0.5 * (low + high);
}

// m dv = dt (water + contact + m g) in every step and over all of them, the water's share opposite to the grain's; while
// nothing touches the grain, contacts, which are what the discrete elements did beyond what they were told, do nothing
static void momentum_closes(const history *h, bool touched) {
    const double weight = 9.81 * h->row[0][MASS];
    double sum = 0, worst = 0;
    for (int k = 1; k < h->n; k++) {
        const double *row = h->row[k];
        const double gain = row[MASS] * (row[VELOCITY] - h->row[k - 1][VELOCITY]);
        const double impulse = row[STEP] * (row[WATER] + row[CONTACT] - weight);
        near((gain - impulse) / (weight * row[STEP]), 0, 1e-10, "impulse on the grain in a step");
        near(row[MOMENTUM], 0, 1e-10, "momentum_error");
        if (!touched)
            near(row[CONTACT] / weight, 0, 1e-10, "contact of a grain that touches nothing");
        sum += impulse;
        worst = silt_max(worst, silt_max(fabs(gain - impulse) / (weight * row[STEP]), row[MOMENTUM]));
    }
    const double *last = h->row[h->n - 1];
    near((last[MASS] * last[VELOCITY] - sum) / (weight * last[TIME]), 0, 1e-10, "impulse on the grain since the start");
    print_message("%d steps, worst open momentum %.1e\n", h->n - 1, worst);
}

// mean of a column from a time on
static double late(const history *h, int column, double from) {
    double sum = 0, time = 0;
    for (int k = 1; k < h->n; k++)
        if (h->row[k][TIME] > from) {
            sum += h->row[k][STEP] * h->row[k][column];
            time += h->row[k][STEP];
        }
    return sum / time;
}

// ---------------------------------------------------------------- tests

static void test_terminal_velocity(void **unused) {
    (void)unused;
    // tanks of 40 to 60 d for the coarse water, 16 d wide for the fine one
    const char *const tenth[] = {"fluid.size=0.015", "time.end=0.5"};
    const char *const half[] = {"fluid.size=0.003", "time.end=0.5", "fluid.regions.0.box=[[0.03, 0.1], [0.09, 0.3]]",
                                "walls.0.polyline=[[0.03, 0.35], [0.03, 0.1], [0.09, 0.1], [0.09, 0.35]]"};
    const char *const two[] = {"fluid.size=0.00075", "time.end=0.35", "fluid.regions.0.box=[[0.048, 0.17], [0.072, 0.28]]",
                               "walls.0.polyline=[[0.048, 0.3], [0.048, 0.17], [0.072, 0.17], [0.072, 0.3]]"};
    const struct {
        const char *name;
        int n_set;
        const char *const *set;
        double from; // s
    } ratio[] = {{"tenth", 2, tenth, 0.35}, {"half", 4, half, 0.35}, {"two", 4, two, 0.25}};
    const double expected = schiller_naumann(1.5e-3, 2560, 1000, 0.9e-3, 9.81);
    near(expected, 0.2199552, 1e-7, "the root of Schiller and Naumann that stands in the scene");
    for (int r = 0; r < 3; r++) {
        history h = settle(ratio[r].name, ratio[r].n_set, ratio[r].set);
        const double speed = -late(&h, VELOCITY, ratio[r].from), force = late(&h, WATER, ratio[r].from);
        double spread = 0, time = 0;
        for (int k = 1; k < h.n; k++)
            if (h.row[k][TIME] > ratio[r].from) {
                spread += h.row[k][STEP] * silt_square(h.row[k][WATER] / force - 1);
                time += h.row[k][STEP];
            }
        print_message("d/h %s: %.5f m/s, %+.3f %% of the root, rms of the force %.1e of its mean\n", ratio[r].name, speed,
                      100 * (speed / expected - 1), sqrt(spread / time));
        near(speed / expected, 1, 0.02, "terminal velocity");
        // no spikes as the grain goes from cell to cell
        near(sqrt(spread / time), 0, 2e-3, "rms of the force");
        momentum_closes(&h, false);
        free(h.row);
    }
}

static void test_rests_on_the_floor(void **unused) {
    (void)unused;
    // lands, bounces, rests: the floor carries the submerged weight, the water its own
    const char *const set[] = {"fluid.size=0.006", "time.end=0.6", "fluid.regions.0.box=[[0.03, 0.22], [0.09, 0.28]]",
                               "walls.0.polyline=[[0.03, 0.3], [0.03, 0.22], [0.09, 0.22], [0.09, 0.3]]"};
    history h = settle("floor", 4, set);
    const double weight = 9.81 * h.row[0][MASS], lift = 1000.0 / 2560;
    momentum_closes(&h, true);
    near(late(&h, VELOCITY, 0.5), 0, 1e-6, "velocity at rest");
    near(late(&h, WATER, 0.5) / weight, lift, 1e-3, "force of the water over the weight");
    near(late(&h, CONTACT, 0.5) / weight, 1 - lift, 1e-3, "force of the floor over the weight");
    free(h.row);
}

static void test_stiff_drag(void **unused) {
    (void)unused;
    // 0.05 mm: a step of the water is ten to thirty relaxation times d^2 rho_s/(18 mu) = 0.395 ms
    const char *const set[] = {"grains.list.0.diameter=5.0e-5", "grains.width=2.5e-4", "time.end=0.1", "time.output=0.05",
                               "fluid.regions.0.box=[[0.05, 0.25], [0.07, 0.27]]",
                               "walls.0.polyline=[[0.05, 0.28], [0.05, 0.25], [0.07, 0.25], [0.07, 0.28]]"};
    const double expected = schiller_naumann(5e-5, 2560, 1000, 0.9e-3, 9.81), relaxation = 2560 * 25e-10 / 18 / 0.9e-3;
    history h = settle("stiff", 6, set);
    assert_true(h.row[1][STEP] > 10 * relaxation);
    print_message("dt/tau %.1f, %.6f m/s, %+.3f %% of the root\n", h.row[1][STEP] / relaxation, -h.row[h.n - 1][VELOCITY],
                  -100 * (h.row[h.n - 1][VELOCITY] / expected + 1));
    for (int k = 1; k < h.n; k++) {
        const double speed = -h.row[k][VELOCITY] / expected, before = -h.row[k - 1][VELOCITY] / expected;
        // it comes from below and does not swing; the jittered water's own stir of 0.3 um/s stays
        assert_true(speed > before - 1e-3 && speed < 1 + 1e-3);
        if (k > 1)
            near(speed, 1, 0.02, "velocity after two steps and more");
    }
    momentum_closes(&h, false);
    free(h.row);
}

// the loop's parts without its ledger: everything that the water and the grain gain comes from gravity and walls
static void test_water_and_grain_together(void **unused) {
    (void)unused;
    const char *const set[] = {"fluid.regions.0.box=[[0.04, 0.22], [0.08, 0.28]]",
                               "walls.0.polyline=[[0.04, 0.3], [0.04, 0.22], [0.08, 0.22], [0.08, 0.3]]"};
    silt_scene *scene = NULL;
    OK(silt_scene_read(SILT_SOURCE "/cases/settling-grain/scene.yaml", 2, set, &scene, &error));
    silt_run run = {.scene = scene, .worker = (char *)SILT_BINARY "/silt-dem", .log = (char *)"test_settling.log"};
    for (int d = 0; d < 2; d++) {
        run.box_lo[d] = scene->fluid.region[0].lo[d] - 0.03;
        run.box_hi[d] = scene->fluid.region[0].hi[d] + 0.03;
    }
    silt_walls_create(&run.walls, scene, NULL);
    run.barrier.walls = &run.walls;
    silt_coupling_def def;
    silt_coupling_def_fill(&run, &def);
    OK(silt_coupling_dem.open(&run.coupling, &def, &error));
    silt_nodes_seed(&run.nodes, scene, &run.walls, NULL, NULL);
    OK(silt_mesh_first(&run.mesh, &run.nodes, scene, &run.barrier, &error));
    silt_locator_build(&run.locator, &run.mesh, run.nodes.x, scene->fluid.size);

    const int n_sub = (int)(5e-3 / silt_coupling_dem.step(run.coupling));
    run.dt = n_sub * silt_coupling_dem.step(run.coupling);
    double open[2] = {0, 0}, worst = 0, weight = 0, given = 0;
    for (int step = 0; step < 40; step++) {
        const silt_grain_state *grains = silt_coupling_dem.grains(run.coupling);
        const double mass = grains->mass[0], before[2] = {grains->v[0], grains->v[1]};
        const int n = run.nodes.count;
        double *old = silt_alloc(2 * (size_t)n, sizeof *old);
        weight = mass * 9.81;
        memcpy(old, run.nodes.v, 2 * (size_t)n * sizeof *old);
        SILT_RESERVE(run.x_old, run.x_old_capacity, 2 * n);
        memcpy(run.x_old, run.nodes.x, 2 * (size_t)n * sizeof *run.x_old);
        OK(silt_coupling_dem.prepare(run.coupling, &run.nodes, &run.mesh, run.dt, &run.drag, &error));
        assert_non_null(run.drag);
        const silt_step now = {.scene = scene, .walls = &run.walls, .mesh = &run.mesh, .drag = run.drag, .nodes = &run.nodes, .dt = run.dt};
        OK(silt_fluid_step(&run.fluid, &now, &error));
        silt_nodes moving = run.nodes;
        moving.v = run.fluid.w;
        moving.x = run.fluid.x_mid;
        silt_coupling_dem.load(run.coupling, &moving, &run.mesh, run.dt);
        OK(silt_coupling_dem.start(run.coupling, n_sub, &error));
        OK(silt_coupling_dem.finish(run.coupling, &error));
        grains = silt_coupling_dem.grains(run.coupling);
        assert_int_equal(grains->contacts[0], 0);

        // force that nobody has given
        double force[2] = {mass * (grains->v[0] - before[0]) / run.dt, mass * (grains->v[1] - before[1]) / run.dt + weight};
        given += fabs(force[1]);
        for (int i = 0; i < n; i++)
            for (int d = 0; d < 2; d++)
                force[d] += run.fluid.mass[i] * ((run.nodes.v[2 * i + d] - old[2 * i + d]) / run.dt - scene->gravity[d]) -
                            run.fluid.reaction[2 * i + d];
        for (int d = 0; d < 2; d++) {
            force[d] -= run.fluid.impulse[d] / run.dt;
            open[d] += force[d];
        }
        worst = silt_max(worst, hypot(force[0], force[1]) / weight);
        OK(silt_run_move(&run, &error));
        free(old);
    }
    print_message("force open: worst step %.1e, in all %.1e of the grain's weight\n", worst, hypot(open[0], open[1]) / given);
    near(worst, 0, 1e-10, "momentum of grain and water in a step");
    near(hypot(open[0], open[1]) / given, 0, 1e-10, "momentum of grain and water since the start");

    silt_coupling_dem.close(&run.coupling);
    silt_fluid_clear(&run.fluid);
    silt_mesh_clear(&run.mesh);
    silt_memory_clear(&run.memory);
    silt_locator_clear(&run.locator);
    silt_nodes_clear(&run.nodes);
    silt_walls_clear(&run.walls);
    free(run.x_old);
    free(run.map);
    silt_scene_free(&scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_water_and_grain_together),
        cmocka_unit_test(test_terminal_velocity),
        cmocka_unit_test(test_rests_on_the_floor),
        cmocka_unit_test(test_stiff_drag),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
