// grains and bodies through the worker: a grain in dry space and in water, release, deposit, checkpoint, a body on the bed
#include "coupling.h"

#include <setjmp.h>
#include <stdarg.h>
#include <unistd.h>

#include <cmocka.h>

#include "tank.h"

// ---------------------------------------------------------------- through the worker

static const silt_coupling_type *dem = &silt_coupling_dem;

/** a scene by hand: a bed 1 m long with its surface at y = 0, or none */
typedef struct bench {
    silt_scene scene;
    silt_walls walls;
    silt_bed bed;
    double x[11][3];
    int edge[10][3];
    silt_coupling_def def;
    silt_coupling *coupling;
} bench;

static void bench_init(bench *b, bool bed) {
    memset(b, 0, sizeof *b);
    b->scene.gravity[1] = -9.81;
    b->scene.dimension = 2;
    b->scene.grains.on = true;
    b->scene.contact = (silt_contact_def){.on = true,
                                          .youngs_modulus = 1e7,
                                          .poissons_ratio = 0.3,
                                          .restitution = 0.3,
                                          .friction = 0.5,
                                          .rolling_friction = 0.3,
                                          .body_friction = 0.5,
                                          .step = 0.15};
    b->def = (silt_coupling_def){.scene = &b->scene,
                                 .walls = &b->walls,
                                 .worker = SILT_BINARY "/silt-dem",
                                 .log = "test_coupling.log",
                                 .lo = {-0.5, -0.5},
                                 .hi = {1.5, 1.5}};
    if (!bed)
        return;
    b->scene.bed = (silt_bed_def){.on = true, .deposition = true, .density = 2650, .porosity = 0.4, .size = 0.1};
    b->scene.grains.parcel = 0.08;
    b->bed.x = b->x;
    b->bed.n_node = 11;
    b->bed.n_edge = 10;
    b->bed.edge = b->edge;
    for (int i = 0; i < 11; i++)
        b->x[i][0] = 0.1 * i;
    for (int i = 0; i < 10; i++) {
        b->edge[i][0] = i;
        b->edge[i][1] = i + 1;
        b->edge[i][2] = -1;
    }
    b->def.bed = &b->bed;
}

static void bench_run(bench *b, double seconds) {
    int n = (int)lround(seconds / dem->step(b->coupling));
    const silt_drag *drag;
    OK(dem->prepare(b->coupling, NULL, NULL, seconds, &drag, &error));
    assert_null(drag);
    dem->load(b->coupling, NULL, NULL, seconds);
    OK(dem->start(b->coupling, n, &error));
    OK(dem->finish(b->coupling, &error));
}

static void test_grain_falls_and_leaves(void **unused) {
    (void)unused;
    bench b;
    bench_init(&b, false);
    silt_grain_def grain = {.at = {0.2, 1}, .velocity = {0.5, 0}, .diameter = 0.02, .density = 7800};
    silt_outlet outlet = {
        .name = (char *)"below", .from = {1, 0}, .to = {0, 0}}; // what comes from above comes from the left
    b.scene.grains.n_grain = 1;
    b.scene.grains.grain = &grain;
    for (int out = 1; out >= 0; out--) {
        outlet.from[0] = out ? 0 : 1;
        outlet.to[0] = out ? 1 : 0;
        b.scene.fluid.outlet = &outlet;
        b.scene.fluid.n_outlet = 1;
        OK(dem->open(&b.coupling, &b.def, &error));
        const silt_grain_state *grains = dem->grains(b.coupling);
        assert_int_equal(grains->count, 1);
        // 5 d wide: 7800 pi/6 d^3 / (5 d)
        near(grains->mass[0], 7800 * M_PI / 6 * 4e-4 / 5, 1e-12, "mass per metre");
        double step = dem->step(b.coupling), t = 0;
        for (int k = 0; k < 20; k++) {
            int n = (int)lround(0.01 / step);
            OK(dem->start(b.coupling, n, &error));
            OK(dem->finish(b.coupling, &error));
            t += n * step;
        }
        grains = dem->grains(b.coupling);
        near(grains->x[0], 0.2 + 0.5 * t, 1e-9, "x of a falling grain");
        near(grains->x[1], 1 - 9.81 * t * t / 2, 1e-9, "y of a falling grain");
        near(grains->net_force[0] / (grains->mass[0] * 9.81), 1, 1e-9, "net force over weight");

        // over the outlet it leaves and is counted; the other way round it goes on and vanishes below the box: an error
        silt_status status = SILT_OK;
        double mass = 0, solid = 0;
        int64_t count = 0;
        error = (silt_error){0};
        for (int k = 0; k < 60 && status == SILT_OK; k++) {
            status = dem->start(b.coupling, (int)lround(0.01 / step), &error);
            if (status == SILT_OK)
                status = dem->finish(b.coupling, &error);
        }
        dem->left(b.coupling, &mass, &solid, &count);
        if (out) {
            assert_int_equal(status, SILT_OK);
            assert_int_equal(count, 1);
            near(mass, 7800 * M_PI / 6 * 4e-4 / 5, 1e-12, "mass that left");
            near(solid, 0, 0, "water that a dry grain displaced");
            assert_int_equal(dem->grains(b.coupling)->count, 0);
        } else {
            assert_int_equal(status, SILT_FAILED);
            assert_non_null(strstr(error.text, "grain 1 vanished"));
            assert_int_equal(count, 0);
        }
        dem->close(&b.coupling);
        assert_null(b.coupling);
    }
}

static void test_grain_sinks_through_the_worker(void **unused) {
    (void)unused;
    // 5 mm of quartz in still water, steps of dt/tau = 0.2, forces held constant over the substeps
    bench b;
    bench_init(&b, false);
    silt_grain_def grain = {.at = {0.5, 0.9}, .diameter = 0.005, .density = 2650};
    b.scene.grains.n_grain = 1;
    b.scene.grains.grain = &grain;
    b.scene.fluid = (silt_fluid_def){.on = true, .density = 1000, .viscosity = 1e-3, .size = 0.1};
    for (int k = 0; k < 2; k++) {
        b.def.lo[k] = 0;
        b.def.hi[k] = 1;
    }
    for (int law = DRAG_SCHILLER_NAUMANN; law <= DRAG_DI_FELICE; law++) {
        b.scene.grains.drag = law;
        b.scene.grains.width = 1; // so wide that the grain does not see itself in the porosity
        OK(dem->open(&b.coupling, &b.def, &error));
        tank t;
        tank_open(&t, 10, 10, 0.1);
        for (int i = 0; i < t.mesh.n_node; i++)
            t.nodes.p[i] = 9810 * (1 - t.nodes.x[2 * i + 1]);
        double dt = 0.01;
        int n = (int)lround(dt / dem->step(b.coupling));
        dt = n * dem->step(b.coupling);
        double speed = 0;
        for (int k = 0; k < 80; k++) {
            const silt_drag *drag;
            OK(dem->prepare(b.coupling, &t.nodes, &t.mesh, dt, &drag, &error));
            dem->load(b.coupling, &t.nodes, &t.mesh, dt);
            OK(dem->start(b.coupling, n, &error));
            OK(dem->finish(b.coupling, &error));
            speed = -dem->grains(b.coupling)->v[1];
        }
        near(speed / terminal[6][law], 1, 1e-5, "terminal velocity through the worker");
        near(dem->grains(b.coupling)->net_force[0] / (dem->grains(b.coupling)->mass[0] * 9.81), 0, 1e-5, "net force");
        tank_close(&t);
        dem->close(&b.coupling);
    }
}

// a parcel of 80 mm that stands for grains of 1 mm: it sinks as they do, and the force on it is theirs all together
static void test_parcel_sinks_like_its_grains(void **unused) {
    (void)unused;
    bench b;
    bench_init(&b, true);
    b.def.bed = NULL;
    b.scene.fluid = (silt_fluid_def){.on = true, .density = 1000, .viscosity = 1e-3, .size = 0.1};
    b.scene.grains.drag = DRAG_SCHILLER_NAUMANN;
    b.scene.grains.diameter = 1e-3;
    OK(dem->open(&b.coupling, &b.def, &error));
    tank t;
    tank_open(&t, 10, 10, 0.1);
    for (int i = 0; i < t.mesh.n_node; i++)
        t.nodes.p[i] = 9810 * (1 - t.nodes.x[2 * i + 1]);
    const double usual = 2650 * M_PI / 6 * silt_square(0.08) * 0.08 / (2.0 / 3 * 0.82 * 0.08 / 0.6);
    const silt_release release = {.x = {0.5, 0.7}, .mass = usual};
    dem->release(b.coupling, 1, &release);
    OK(dem->start(b.coupling, 0, &error));
    OK(dem->finish(b.coupling, &error));
    const int n = (int)lround(0.01 / dem->step(b.coupling));
    const double dt = n * dem->step(b.coupling), number = usual / 2650 / (M_PI / 6 * 1e-9);
    for (int k = 0; k < 60; k++) {
        const silt_drag *drag;
        const double before = dem->grains(b.coupling)->v[1];
        OK(dem->prepare(b.coupling, &t.nodes, &t.mesh, dt, &drag, &error));
        dem->load(b.coupling, &t.nodes, &t.mesh, dt);
        OK(dem->start(b.coupling, n, &error));
        OK(dem->finish(b.coupling, &error));
        // n_g F(d50), with the coefficient of the speed at the start and implicit in that at the end
        const double v = dem->grains(b.coupling)->v[1], m = M_PI / 6 * 1e-9 * 2650;
        const double beta = silt_drag_factor(DRAG_SCHILLER_NAUMANN, 1000, 1e-3, 1e-3, 0, before);
        const double expected = (before - dt * 9.81 * (1 - 1000.0 / 2650)) / (1 + dt * beta / m);
        near(v / expected, 1, 1e-3, "velocity of a parcel after a step");
        silt_exchanged exchanged;
        dem->exchanged(b.coupling, &exchanged);
        near(exchanged.grains[1] / (number * (M_PI / 6 * 1e-9 * 9810 - beta * expected)), 1, 1e-3, "force on a parcel");
    }
    near(-dem->grains(b.coupling)->v[1] / 0.155101, 1, 1e-3, "terminal velocity of a parcel");
    tank_close(&t);
    dem->close(&b.coupling);
}

static void test_release_deposit_save_load(void **unused) {
    (void)unused;
    bench b;
    bench_init(&b, true);
    OK(dem->open(&b.coupling, &b.def, &error));
    double mass = 2650 * 0.6 * 0.008, radius = dem->parcel_radius(b.coupling, mass);
    // width (2/3) 0.82 d/(1 - n) = 0.0728889 m; d = (6 b V/pi)^(1/3)
    near(2 * radius, cbrt(6 * 2.0 / 3 * 0.82 * 0.08 / 0.6 * 0.6 * 0.008 / M_PI), 1e-15, "diameter of a parcel");

    // the bed's crust is in the way below the surface, not above it
    assert_false(dem->room(b.coupling, (double[3]){0.5, 0}, radius));
    assert_true(dem->room(b.coupling, (double[3]){0.5, 1.05 * radius}, radius));
    silt_release release[2] = {{.x = {0.5, 1.1 * radius}, .radius = radius, .mass = mass},
                               {.x = {0.5, 3.3 * radius}, .v = {0.2, 0}, .radius = radius, .mass = mass}};
    dem->release(b.coupling, 2, release);
    assert_int_equal(dem->grains(b.coupling)->count, 2);
    assert_false(dem->room(b.coupling, (double[3]){0.5, 1.5 * radius}, radius));
    for (int k = 0; k < 100; k++)
        bench_run(&b, 0.01);
    const silt_grain_state *grains = dem->grains(b.coupling);
    assert_int_equal(grains->count, 2);
    near(grains->mass[0] + grains->mass[1], 2 * mass, 1e-12, "mass of the grains");
    for (int i = 0; i < 2; i++) {
        double speed = hypot(grains->v[3 * i], grains->v[3 * i + 1]);
        print_message("parcel at (%.4f, %.4f), %.1e m/s, %d contacts, on bed %d, net force %.1e of its weight\n",
                      grains->x[3 * i], grains->x[3 * i + 1], speed, grains->contacts[i], grains->on_bed[i],
                      grains->net_force[i] / (mass * 9.81));
        assert_true(speed < 0.01);
        assert_true(grains->on_bed[i]);
        near(grains->x[3 * i + 2], 0, 0, "out of the plane");
    }

    // deposit the first: one grain fewer at once, its place is taken
    double place[2] = {grains->x[0], grains->x[1]};
    dem->deposit(b.coupling, 0);
    grains = dem->grains(b.coupling);
    assert_int_equal(grains->count, 1);
    bench_run(&b, 0.01);
    assert_int_equal(dem->grains(b.coupling)->count, 1);
    assert_false(dem->room(b.coupling, (double[3]){place[0], place[1] + 1.5 * radius}, radius));
    // the bed under it goes: so does the frozen sphere, and the crust comes lower
    for (int i = 0; i < 11; i++)
        b.x[i][1] = -0.3;
    dem->bed_changed(b.coupling, &b.bed);
    assert_true(dem->room(b.coupling, (double[3]){place[0], place[1]}, radius));
    bench_run(&b, 0.1);

    // checkpoint: both go on to the same bits
    silt_store *store = NULL;
    OK(silt_store_create(&store, "test_exchange.h5", &error));
    OK(dem->save(b.coupling, store, &error));
    OK(silt_store_commit(&store, &error));
    bench other = b;
    other.def.scene = &b.scene;
    OK(silt_store_open(&store, "test_exchange.h5", &error));
    OK(dem->load_state(&other.coupling, &b.def, store, &error));
    silt_store_close(&store);
    unlink("test_exchange.h5");
    silt_release third = {.x = {0.3, 0.5}, .radius = radius, .mass = mass / 2};
    bench *two[2] = {&b, &other};
    for (int i = 0; i < 2; i++) {
        dem->release(two[i]->coupling, 1, &third);
        for (int k = 0; k < 20; k++)
            bench_run(two[i], 0.01);
    }
    const silt_grain_state *p = dem->grains(b.coupling), *q = dem->grains(other.coupling);
    assert_int_equal(p->count, 2);
    assert_int_equal(q->count, 2);
    assert_memory_equal(p->id, q->id, 2 * sizeof *p->id);
    assert_memory_equal(p->x, q->x, 6 * sizeof *p->x);
    assert_memory_equal(p->v, q->v, 6 * sizeof *p->v);
    assert_memory_equal(p->net_force, q->net_force, 2 * sizeof *p->net_force);
    dem->close(&b.coupling);
    dem->close(&other.coupling);
}

static void test_crumbs_fall_like_parcels(void **unused) {
    (void)unused;
    // a crumb of 1/1000 of a parcel, in water at rest without drag: falls with (1 - 1000/2650) g though its sphere is
    // larger
    bench b;
    bench_init(&b, true);
    b.scene.fluid = (silt_fluid_def){.on = true, .density = 1000, .viscosity = 1e-3, .size = 0.1};
    b.scene.grains.drag = DRAG_NONE;
    OK(dem->open(&b.coupling, &b.def, &error));
    tank t;
    tank_open(&t, 10, 10, 0.1);
    for (int i = 0; i < t.mesh.n_node; i++)
        t.nodes.p[i] = 9810 * (1 - t.nodes.x[2 * i + 1]);
    double usual = 2650 * M_PI / 6 * silt_square(0.08) * 0.08 / (2.0 / 3 * 0.82 * 0.08 / 0.6);
    silt_release release[2] = {{.x = {0.3, 0.7}, .mass = usual}, {.x = {0.7, 0.7}, .mass = usual / 1000}};
    near(dem->parcel_radius(b.coupling, usual), 0.04, 1e-15, "radius of the usual parcel");
    near(dem->parcel_radius(b.coupling, usual / 1000), 0.016, 1e-15, "radius of a crumb");
    dem->release(b.coupling, 2, release);
    OK(dem->start(b.coupling, 0, &error));
    OK(dem->finish(b.coupling, &error));
    double step = dem->step(b.coupling), time = 0;
    for (int k = 0; k < 10; k++) {
        const silt_drag *drag;
        int n = (int)lround(0.01 / step);
        OK(dem->prepare(b.coupling, &t.nodes, &t.mesh, n * step, &drag, &error));
        assert_non_null(drag);
        dem->load(b.coupling, &t.nodes, &t.mesh, n * step);
        silt_exchanged exchanged;
        dem->exchanged(b.coupling, &exchanged);
        near(exchanged.grains[1], 9.81 * 1000 / 2650 * usual * 1.001, 1e-9, "force on all grains");
        near(exchanged.size, exchanged.grains[1], 1e-9, "size of the forces");
        OK(dem->start(b.coupling, n, &error));
        OK(dem->finish(b.coupling, &error));
        time += n * step;
    }
    const silt_grain_state *grains = dem->grains(b.coupling);
    for (int i = 0; i < 2; i++) // the first half substep may still have the old force
        near(grains->v[3 * i + 1] / (-9.81 * (1 - 1000.0 / 2650) * time), 1, 1e-3, "speed of fall in water");
    tank_close(&t);
    dem->close(&b.coupling);

    // too large a parcel is refused by the next start
    OK(dem->open(&b.coupling, &b.def, &error));
    silt_release boulder = {.x = {0.5, 0.5}, .mass = 30 * usual};
    dem->release(b.coupling, 1, &boulder);
    error = (silt_error){0};
    assert_int_equal(dem->start(b.coupling, 1, &error), SILT_FAILED);
    assert_non_null(strstr(error.text, "grains.parcel"));
    dem->close(&b.coupling);
}

static void test_body_on_the_bed(void **unused) {
    (void)unused;
    // a box of 0.2 m comes to rest on the crust; its contact force is its weight, less what the water lifts
    bench b;
    bench_init(&b, true);
    b.scene.contact.restitution = 0.1;
    silt_body_def box = {
        .name = (char *)"box", .shape = SHAPE_BOX, .at = {0.5, 0.11, 0}, .scale = 0.2, .density = 2000};
    b.scene.n_body = 1;
    b.scene.body = &box;
    OK(dem->open(&b.coupling, &b.def, &error));
    silt_body_state *bodies = dem->bodies(b.coupling);
    assert_int_equal(bodies->count, 1);
    near(bodies->body[0].mass, 80, 1e-12, "mass per metre");
    near(bodies->body[0].inertia[2], 80 * 0.08 / 12, 1e-12, "inertia per metre");
    assert_int_equal(dem->outline(b.coupling, 0, 0.1, NULL, 0), 8);
    assert_false(dem->room(b.coupling, (double[3]){0.5, 0.22}, 0.02));
    assert_true(dem->room(b.coupling, (double[3]){0.5, 0.235}, 0.02));
    for (int lift = 0; lift < 2; lift++) {
        double mean = 0;
        for (int k = 0; k < 60; k++) {
            bodies->body[0].force[1] = lift ? 300 : 0;
            bench_run(&b, 0.01);
            mean += k >= 40 ? bodies->body[0].contact[1] / 20 : 0;
        }
        near(mean / (80 * 9.81 - (lift ? 300 : 0)), 1, 0.01, "contact force over submerged weight");
    }
    print_message("box at (%.5f, %.5f), %.1e m/s, angle %.1e\n", bodies->body[0].x[0], bodies->body[0].x[1],
                  hypot(bodies->body[0].v[0], bodies->body[0].v[1]),
                  2 * atan2(bodies->body[0].q[3], bodies->body[0].q[0]));
    near(bodies->body[0].x[1], 0.1, 0.003, "height of the box");
    near(2 * atan2(bodies->body[0].q[3], bodies->body[0].q[0]), 0, 0.02, "angle of the box");
    near(bodies->body[0].x[2], 0, 1e-4, "out of the plane");
    dem->close(&b.coupling);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_grain_falls_and_leaves),
        cmocka_unit_test(test_grain_sinks_through_the_worker),
        cmocka_unit_test(test_parcel_sinks_like_its_grains),
        cmocka_unit_test(test_release_deposit_save_load),
        cmocka_unit_test(test_crumbs_fall_like_parcels),
        cmocka_unit_test(test_body_on_the_bed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
