// the discrete elements through a real worker: exact motion, impulses, contact, bodies

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#define LOG "test_dem.log"
#include "dem_bench.h"

static void test_open_close(void **unused) {
    (void)unused;
    silt_dem_def def = plain();
    silt_dem *dem = NULL;
    double start = silt_seconds();
    OK(silt_dem_open(&dem, &def, &error));
    print_message("open %.0f ms", 1e3 * (silt_seconds() - start));
    assert_true(silt_dem_process(dem) > 0);
    // nothing in it is fine
    assert_int_equal(advance(dem, 10, NULL, NULL, NULL)->n_grain, 0);
    int pid = silt_dem_process(dem);
    start = silt_seconds();
    silt_dem_close(&dem);
    print_message(", close %.0f ms\n", 1e3 * (silt_seconds() - start));
    assert_null(dem);
    silt_dem_close(&dem);
    assert_int_not_equal(kill(pid, 0), 0);
}

// velocity Verlet under constant gravity is exact
static void test_free_fall(void **unused) {
    (void)unused;
    silt_dem_def def = plain();
    silt_dem *dem = NULL;
    def.gravity[0] = 1;
    def.gravity[1] = -9.81;
    OK(silt_dem_open(&dem, &def, &error));
    silt_dem_sphere g = grain(7, 0.1, 0.5);
    g.v[0] = 0.3;
    silt_dem_add(dem, 1, &g);
    const silt_dem_state *s = NULL;
    for (int k = 0; k < 10; k++)
        s = advance(dem, 1000, NULL, NULL, NULL);
    double t = 0.1;
    assert_int_equal(s->n_grain, 1);
    assert_int_equal(s->id[0], 7);
    near(s->mass[0], mass, 1e-15, "mass");
    near(s->v[0], 0.3 + t, 1e-12, "vx");
    near(s->v[1], -9.81 * t, 1e-12, "vy");
    near(s->x[0], 0.1 + 0.3 * t + 0.5 * t * t, 1e-12, "x");
    near(s->x[1], 0.5 - 0.5 * 9.81 * t * t, 1e-12, "y");
    assert_true(s->x[2] == 0 && s->v[2] == 0);
    assert_int_equal(s->contacts[0], 0);
    assert_int_equal(s->on_bed[0], 0);
    silt_dem_close(&dem);
}

// the momentum that a grain gets is force times time, whatever the force was before
static void test_impulse(void **unused) {
    (void)unused;
    silt_dem_def def = plain();
    silt_dem *dem = NULL;
    OK(silt_dem_open(&dem, &def, &error));
    silt_dem_sphere g[2] = {grain(1, 0, 0), grain(2, 0.3, 0.1)};
    silt_dem_add(dem, 2, g);
    const silt_dem_state *s = advance(dem, 0, NULL, NULL, NULL);
    double v[4] = {0}, worst = 0;
    for (int k = 0; k < 20; k++) {
        double force[6] = {1e-3 * (k + 1), -2e-3, 0, 5e-4 * (k % 3), 1e-3, 0};
        int n = 1 + 7 * k;
        double before[4] = {s->v[0], s->v[1], s->v[3], s->v[4]};
        s = advance(dem, n, force, NULL, NULL);
        double after[4] = {s->v[0], s->v[1], s->v[3], s->v[4]};
        for (int c = 0; c < 4; c++) {
            double f = force[c + c / 2], dv = f * n * def.step / mass;
            v[c] += dv;
            worst = fmax(worst, fabs(after[c] - before[c] - dv) / (fabs(dv) + fabs(v[c])));
        }
    }
    print_message("impulse, relative error %.1e\n", worst);
    assert_true(worst < 1e-12);
    silt_dem_close(&dem);
}

// so is the spin that it gets of a torque, in runs that go on from the last one too; without one it keeps what it has
static void test_twist(void **unused) {
    (void)unused;
    silt_dem_def def = plain();
    silt_dem *dem = NULL;
    OK(silt_dem_open(&dem, &def, &error));
    silt_dem_sphere g[2] = {grain(1, 0, 0), grain(2, 0.3, 0.1)};
    g[1].omega[2] = 5;
    silt_dem_add(dem, 2, g);
    const silt_dem_state *s = advance(dem, 0, NULL, NULL, NULL);
    double spin[2] = {0, 5};
    const double inertia = 0.4 * mass * 1e-4, force[6] = {0};
    for (int k = 0; k < 20; k++) {
        const double torque[6] = {0, 0, 1e-6 * (k + 1), 0, 0, -2e-6 * (k % 3)};
        const int n = 1 + 7 * k;
        if (k % 4 != 3)
            silt_dem_twist(dem, torque);
        if (k % 2)
            silt_dem_keep(dem);
        s = advance(dem, n, force, NULL, NULL);
        for (int c = 0; c < 2; c++) {
            spin[c] += k % 4 != 3 ? torque[3 * c + 2] * n * def.step / inertia : 0;
            near(s->omega[3 * c + 2], spin[c], 1e-10, "spin");
        }
    }
    assert_true(spin[0] > 0.1 && spin[1] < 4.99);
    silt_dem_close(&dem);
}

static void bounce(silt_dem_def *def, bool frozen, const double v[2], const char *what) {
    silt_dem *dem = NULL;
    OK(silt_dem_open(&dem, def, &error));
    silt_dem_sphere g[2] = {grain(1, 0, 0.0205), grain(2, 0, 0)};
    if (!frozen)
        g[0].x[1] = 0.0105;
    g[1].kind = DEM_FROZEN;
    memcpy(g[0].v, v, 2 * sizeof *v);
    silt_dem_add(dem, frozen ? 2 : 1, g);
    const silt_dem_state *s = NULL;
    bool touched = false;
    for (int k = 0; k < 50; k++) {
        s = advance(dem, 100, NULL, NULL, NULL);
        touched |= s->contacts[0] == 1 && s->on_bed[0] == 1;
    }
    print_message("%s: restitution %.5f\n", what, -s->v[1] / v[1]);
    assert_int_equal(s->n_grain, 1);
    near(-s->v[1] / v[1], 0.9, 1e-3, what);
    assert_true(touched);
    silt_dem_close(&dem);
}

static void test_bounce(void **unused) {
    (void)unused;
    const double down[2] = {0, -0.5};
    silt_dem_def def = plain();
    def.step = 2e-6;
    bounce(&def, true, down, "frozen sphere");
    const double floor[1][4] = {{-1, 0, 1, 0}}, part[1][4] = {{-0.3, 0, 0.3, 0}};
    def.n_wall = 1;
    def.wall = floor;
    bounce(&def, false, down, "plane");
    def.wall = part;
    bounce(&def, false, down, "mesh");
}

// a sphere that slides first: v0^2/(2 mu g) if it may not roll; it starts rolling at 5/7 v0 after 12/49 v0^2/(mu g)
static void test_sliding(void **unused) {
    (void)unused;
    const double walls[2][1][4] = {{{-1, 0, 1, 0}}, {{-0.55, 0, 0.55, 0}}};
    for (int k = 0; k < 2; k++) {
        silt_dem_def def = plain();
        silt_dem *dem = NULL;
        def.gravity[1] = -9.81;
        def.n_wall = 1;
        def.wall = walls[k];
        OK(silt_dem_open(&dem, &def, &error));
        silt_dem_sphere g = grain(1, -0.5, 0.01 - 1e-6);
        g.v[0] = 1;
        silt_dem_add(dem, 1, &g);
        // slides for 2/7 v0/(mu g) = 0.0728 s
        double t = 2.0 / 7 / (0.4 * 9.81), slid = 12.0 / 49 / (0.4 * 9.81);
        const silt_dem_state *s = NULL;
        for (int i = 0; i < 500; i++)
            s = advance(dem, 20, NULL, NULL, NULL);
        double rolled = 0.1 - t;
        print_message("%s: speed %.5f (5/7 = 0.71429), way %.5f (%.5f)\n", k ? "mesh" : "plane", s->v[0], s->x[0] + 0.5,
                      slid + rolled * 5 / 7);
        near(s->v[0], 5.0 / 7, 0.01 * 5 / 7, "rolling speed");
        near(s->x[0] + 0.5, slid + rolled * 5 / 7, 0.01 * slid, "way");
        near(s->omega[2], -s->v[0] / 0.01, 0.01 * 71, "rolls");
        near(s->x[1], 0.01 - 2.7e-5, 1e-5, "Hertz overlap under its weight");
        silt_dem_close(&dem);
    }
}

static double body_angle(const double *q) {
    return 2 * atan2(q[3], q[0]);
}

// pose as given, force and torque arrive exactly
static void test_body_impulse(void **unused) {
    (void)unused;
    silt_dem_def def = plain();
    silt_dem *dem = NULL;
    OK(silt_dem_open(&dem, &def, &error));
    silt_dem_body body[3] = {
        {.n_sphere = 5,
         .sphere = plus,
         .mass = 0.05,
         .inertia = 4e-6,
         .x = {0.1, 0.2},
         .v = {0.3, -0.1},
         .omega = {0, 0, 2},
         .angle = 0.7},
        {.n_sphere = 5, .sphere = plus, .mass = 1, .inertia = 1, .x = {0.5, 0.5}, .angle = -0.2, .fixed = true},
        // the centroid is not that of the spheres
        {.n_sphere = 2, .sphere = plus, .mass = 20, .inertia = 3e-9, .x = {-0.4, -0.3}, .angle = 3.0}};
    for (int k = 0; k < 3; k++)
        OK(silt_dem_add_body(dem, &body[k], &error));
    const silt_dem_state *s = advance(dem, 0, NULL, NULL, NULL);
    assert_int_equal(s->n_body, 3);
    for (int k = 0; k < 3; k++) {
        near(s->body_x[3 * k], body[k].x[0], 2e-15, "x");
        near(s->body_x[3 * k + 1], body[k].x[1], 2e-15, "y");
        near(s->body_x[3 * k + 2], 0, 1e-15, "z");
        near(s->body_v[3 * k], body[k].v[0], 1e-16, "vx");
        near(s->body_v[3 * k + 1], body[k].v[1], 1e-16, "vy");
        near(s->body_omega[3 * k + 2], body[k].omega[2], 1e-14, "omega");
        near(body_angle(&s->body_q[4 * k]), body[k].angle, 1e-14, "angle");
    }
    double force[9] = {0.02, -0.01, 0, 1, 1, 0, 3, -4, 0}, torque[9] = {0, 0, 2e-6, 0, 0, 1, 0, 0, 1e-8};
    double worst = 0, turn = 0, v[2], w[2] = {0, 2};
    double angle = s->body_q[0];
    for (int i = 0; i < 10; i++) {
        int n = 100;
        double t = n * def.step;
        angle = body_angle(&s->body_q[0]);
        memcpy(v, s->body_v, sizeof v);
        w[0] = s->body_omega[8];
        w[1] = s->body_omega[2];
        double other[2] = {s->body_v[6], s->body_v[7]};
        s = advance(dem, n, NULL, force, torque);
        worst = fmax(worst, fabs((s->body_v[0] - v[0]) / (force[0] * t / 0.05) - 1));
        worst = fmax(worst, fabs((s->body_v[1] - v[1]) / (force[1] * t / 0.05) - 1));
        turn = fmax(turn, fabs((s->body_omega[2] - w[1]) / (torque[2] * t / 4e-6) - 1));
        worst = fmax(worst, fabs((s->body_v[6] - other[0]) / (force[6] * t / 20) - 1));
        turn = fmax(turn, fabs((s->body_omega[8] - w[0]) / (torque[8] * t / 3e-9) - 1));
        // the angle follows the mean rotation
        near(body_angle(&s->body_q[0]) - angle, 0.5 * t * (w[1] + s->body_omega[2]), 1e-9, "angle");
    }
    print_message("body impulse, relative error %.1e, angular %.1e\n", worst, turn);
    assert_true(worst < 1e-11);
    assert_true(turn < 1e-9);
    assert_true(s->body_v[3] == 0 && s->body_omega[5] == 0 && s->body_x[3] == 0.5);
    assert_true(fabs(s->body_x[2]) < 1e-15 && s->body_v[2] == 0 && s->body_omega[0] == 0 && s->body_omega[1] == 0);
    silt_dem_close(&dem);
}

// falls, rests on two of its spheres: Hertz overlap of half the weight each, reaction = weight, in its plane
// With an added mass and inertia as its answer to contacts a body bounces, slips and spins as one that is heavier by so much, and what is
// measured of contacts and of the answer is what it got.
static void test_body_response(void **unused) {
    (void)unused;
    const double walls[1][4] = {{-0.55, 0, 0.55, 0}};
    const double m = 0.05, added = 0.2, inertia = 4e-6, turned = 9e-6;
    double end[2][6], worst = 0, touched = 0;
    for (int heavy = 0; heavy < 2; heavy++) {
        silt_dem_def def = plain();
        silt_dem *dem = NULL;
        def.gravity[1] = -9.81;
        def.restitution = 1;
        def.n_wall = 1;
        def.wall = walls;
        OK(silt_dem_open(&dem, &def, &error));
        silt_dem_body body = {.n_sphere = 5, .sphere = plus, .mass = m + heavy * added, .inertia = inertia + heavy * turned,
                              .x = {0.1, 0.06}, .v = {0.5, -0.2}, .omega = {0, 0, 3}, .angle = 0.3};
        OK(silt_dem_add_body(dem, &body, &error));
        // both fall as the light one does with the water's inertia
        double response[36] = {0}, force[3] = {0};
        response[0] = response[7] = m / (m + added) - 1;
        response[35] = inertia / (inertia + turned) - 1;
        force[1] = heavy ? 9.81 * added : 9.81 * m * added / (m + added);
        const silt_dem_state *s = advance(dem, 0, NULL, NULL, NULL);
        for (int i = 0; i < 150; i++) {
            const double before[3] = {s->body_v[0], s->body_v[1], s->body_omega[2]};
            if (!heavy)
                silt_dem_respond(dem, response);
            s = advance(dem, 100, NULL, force, NULL);
            const double *c = s->body_contact, *a = s->body_answer, t = 100 * def.step;
            if (heavy)
                continue;
            touched = fmax(touched, c[1]);
            worst = fmax(worst, fabs(m * (s->body_v[0] - before[0]) - t * (c[0] + a[0])));
            worst = fmax(worst, fabs(m * (s->body_v[1] - before[1]) - t * (c[1] + a[1] + force[1] - 9.81 * m)));
            worst = fmax(worst, fabs(inertia * (s->body_omega[2] - before[2]) - t * (c[5] + a[5])) / 0.01);
        }
        const double now[6] = {s->body_x[0], s->body_x[1], s->body_v[0], s->body_v[1], s->body_omega[2], body_angle(s->body_q)};
        memcpy(end[heavy], now, sizeof now);
        silt_dem_close(&dem);
    }
    print_message("answered: x (%.6f, %.6f), heavier: (%.6f, %.6f); momentum off by %.1e kg m/s, contact up to %.3g N\n", end[0][0], end[0][1],
                  end[1][0], end[1][1], worst, touched);
    assert_true(touched > 1);
    for (int k = 0; k < 6; k++)
        near(end[0][k], end[1][k], 1e-8, "answered against heavier");
    near(worst, 0, 1e-15, "momentum");
}

static void test_body_rests(void **unused) {
    (void)unused;
    const double walls[2][1][4] = {{{-1, 0, 1, 0}}, {{-0.55, 0, 0.55, 0}}};
    const double pair[12] = {-0.01, 0, 0.01, 0.01, 0, 0.01, -0.01, 0.01, 0.01, 0.01, 0.01, 0.01};
    for (int k = 0; k < 2; k++) {
        silt_dem_def def = plain();
        silt_dem *dem = NULL;
        def.gravity[1] = -9.81;
        def.restitution = 0.3;
        def.n_wall = 1;
        def.wall = walls[k];
        OK(silt_dem_open(&dem, &def, &error));
        silt_dem_body body = {.n_sphere = 4, .sphere = pair, .mass = 0.05, .inertia = 5e-6, .x = {0.1, 0.02}};
        OK(silt_dem_add_body(dem, &body, &error));
        const silt_dem_state *s = NULL;
        for (int i = 0; i < 40; i++)
            s = advance(dem, 2500, NULL, NULL, NULL);
        double v = s->body_v[1], height = s->body_x[1];
        s = advance(dem, 2500, NULL, NULL, NULL);
        double reaction = 0.05 * ((s->body_v[1] - v) / (2500 * def.step) + 9.81);
        double stiff = 1e7 / (2 * (1 - 0.09)), overlap = pow(0.5 * 0.05 * 9.81 * 0.75 / (stiff * sqrt(0.01)), 2.0 / 3);
        print_message("body on a %s: overlap %.4e (Hertz %.4e), reaction/weight - 1 = %.1e, speed %.1e, z %.1e\n",
                      k ? "mesh" : "plane", 0.01 - height, overlap, reaction / (0.05 * 9.81) - 1,
                      hypot(s->body_v[0], s->body_v[1]), s->body_x[2]);
        near(reaction, 0.05 * 9.81, 1e-6 * 0.05 * 9.81, "reaction");
        near(0.01 - s->body_x[1], overlap, 1e-3 * overlap, "overlap");
        near(s->body_v[0], 0, 1e-7, "vx");
        near(s->body_omega[2], 0, 1e-5, "omega");
        assert_true(fabs(s->body_x[2]) < 1e-12);
        silt_dem_close(&dem);
    }
}

// slides to rest after v^2/(2 mu g), mu being the body's and not the grains' friction
static void test_body_slides(void **unused) {
    (void)unused;
    const double floor[1][4] = {{-1, 0, 1, 0}},
                 raft[12] = {-0.03, 0, 0.01, -0.01, 0, 0.01, 0.01, 0, 0.01, 0.03, 0, 0.01};
    silt_dem_def def = plain();
    silt_dem *dem = NULL;
    def.gravity[1] = -9.81;
    def.friction = 0.9;
    def.body_friction = 0.3;
    def.restitution = 0.3;
    def.n_wall = 1;
    def.wall = floor;
    OK(silt_dem_open(&dem, &def, &error));
    silt_dem_body body = {
        .n_sphere = 4, .sphere = raft, .mass = 0.05, .inertia = 5e-5, .x = {-0.5, 0.01 - 3e-5}, .v = {1, 0}};
    OK(silt_dem_add_body(dem, &body, &error));
    const silt_dem_state *s = NULL;
    // in short runs: each has a new set-up, which must not brake
    for (int i = 0; i < 2000; i++)
        s = advance(dem, 20, NULL, NULL, NULL);
    print_message("body slides %.5f, v^2/(2 mu g) = %.5f\n", s->body_x[0] + 0.5, 1 / (2 * 0.3 * 9.81));
    near(s->body_x[0] + 0.5, 1 / (2 * 0.3 * 9.81), 0.01 * 1 / (2 * 0.3 * 9.81), "way");
    near(s->body_v[0], 0, 1e-3, "stopped");
    silt_dem_close(&dem);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_open_close),
        cmocka_unit_test(test_free_fall),
        cmocka_unit_test(test_impulse),
        cmocka_unit_test(test_twist),
        cmocka_unit_test(test_bounce),
        cmocka_unit_test(test_sliding),
        cmocka_unit_test(test_body_impulse),
        cmocka_unit_test(test_body_response),
        cmocka_unit_test(test_body_rests),
        cmocka_unit_test(test_body_slides),
    };
    return cmocka_run_group_tests_name("dem", tests, NULL, NULL);
}
