// the discrete elements through a real worker: exact motion, impulses, contact, bodies, edits, checkpoints, and how it
// fails
#include "../dem-coupling/dem.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "check.h"

#define LOG "test_dem.log"

#define FAILS(call, part)                                                                                              \
    do {                                                                                                               \
        error = (silt_error){0};                                                                                       \
        assert_int_equal((call), SILT_FAILED);                                                                         \
        if (!strstr(error.text, (part)))                                                                               \
            fail_msg("\"%s\" is not in \"%s\"", (part), error.text);                                                   \
    } while (0)

// glass-like grains of 1 cm in a box of 2 m
static silt_dem_def plain(void) {
    return (silt_dem_def){.worker = SILT_BINARY "/silt-dem",
                          .log = LOG,
                          .lo = {-1, -1},
                          .hi = {1, 1},
                          .period = 0.06,
                          .youngs_modulus = 1e7,
                          .poissons_ratio = 0.3,
                          .restitution = 0.9,
                          .friction = 0.4,
                          .body_friction = 0.4,
                          .step = 1e-5,
                          .max_radius = 0.01,
                          .min_radius = 0.01};
}

static silt_dem_sphere grain(int64_t id, double x, double y) {
    return (silt_dem_sphere){.id = id, .x = {x, y, 0}, .radius = 0.01, .density = 2500};
}

static const silt_dem_state *advance(silt_dem *dem, int n, const double *force, const double *body_force,
                                     const double *body_torque) {
    OK(silt_dem_start(dem, n, force, body_force, body_torque, &error));
    OK(silt_dem_wait(dem, &error));
    return silt_dem_state_now(dem);
}

static const double mass = 2500 * 4.0 / 3.0 * M_PI * 1e-6;

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

// a plus of five spheres; mass and inertia are given, not those of the spheres
static const double plus[15] = {0, 0, 0.01, 0.012, 0, 0.008, -0.012, 0, 0.008, 0, 0.012, 0.008, 0, -0.012, 0.008};

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

// thousands come and go; ids, positions and forces stay with their grains
static void test_edits(void **unused) {
    (void)unused;
    enum { ROUNDS = 12, LAYER = 500, MOST_GONE = 300 };
    static double at[2 * ROUNDS * LAYER][2], speed[2 * ROUNDS * LAYER];
    silt_dem_def def = plain();
    silt_dem *dem = NULL;
    def.hi[1] = 2;
    OK(silt_dem_open(&dem, &def, &error));
    const int64_t first = 1000000000000;
    int64_t next = first, gone[MOST_GONE + 1];
    double start = silt_seconds();
    const silt_dem_state *s = silt_dem_state_now(dem);
    uint64_t seed = 5;
    memset(speed, 0, sizeof speed);
    for (int round = 0; round < ROUNDS; round++) {
        int n_gone = 0, before = s->n_grain;
        for (int i = 0; i < before - 1 && n_gone < MOST_GONE; i++)
            if (silt_uniform(&seed) < 0.3)
                gone[n_gone++] = s->id[i];
        // the highest one too: its number must not come back
        if (before)
            gone[n_gone++] = s->id[before - 1];
        silt_dem_remove(dem, n_gone, gone);
        for (int i = 0; i < LAYER; i++) {
            silt_dem_sphere g = grain(next, -0.95 + 0.038 * (i % 50), -0.95 + 0.24 * round + 0.024 * (i / 50));
            memcpy(at[next - first], g.x, sizeof *at);
            g.radius = 0.004 + 0.006 * silt_uniform(&seed);
            next += 1 + (i % 3 == 0);
            silt_dem_add(dem, 1, &g);
        }
        s = advance(dem, round % 2, NULL, NULL, NULL);
        assert_int_equal(s->n_grain, before - n_gone + LAYER);
        // every grain is pushed by its id
        double *force = calloc(3 * (size_t)s->n_grain, sizeof *force);
        for (int i = 0; i < s->n_grain; i++) {
            force[3 * i] = s->mass[i] * (double)(s->id[i] % 7);
            speed[s->id[i] - first] += (double)(s->id[i] % 7) * 10 * def.step;
        }
        s = advance(dem, 10, force, NULL, NULL);
        free(force);
        for (int i = 0; i < s->n_grain; i++) {
            int64_t k = s->id[i] - first;
            assert_true(i == 0 || s->id[i] > s->id[i - 1]);
            assert_true(fabs(s->v[3 * i] - speed[k]) < 1e-15 && s->v[3 * i + 1] == 0);
            assert_true(fabs(s->x[3 * i] - at[k][0]) < 1e-5 && s->x[3 * i + 1] == at[k][1]);
        }
        for (int k = 0, i = 0; k < n_gone; k++) {
            while (i < s->n_grain && s->id[i] < gone[k])
                i++;
            assert_true(i == s->n_grain || s->id[i] != gone[k]);
        }
    }
    print_message("%d grains after %d rounds of edits, %.2f s\n", s->n_grain, ROUNDS, silt_seconds() - start);
    // one that leaves the box is absent; removing it afterwards is no error
    silt_dem_sphere g = grain(next++, 0.98, -0.9);
    g.v[0] = 10;
    silt_dem_add(dem, 1, &g);
    int n = advance(dem, 0, NULL, NULL, NULL)->n_grain;
    s = advance(dem, 1000, NULL, NULL, NULL);
    assert_int_equal(s->n_grain, n - 1);
    assert_true(s->id[n - 2] != g.id);
    silt_dem_remove(dem, 1, &g.id);
    n = s->n_grain;
    assert_int_equal(advance(dem, 0, NULL, NULL, NULL)->n_grain, n);
    // wrong ones
    silt_dem_add(dem, 1, &g);
    FAILS(silt_dem_start(dem, 1, NULL, NULL, NULL, &error), "ids must rise");
    silt_dem_close(&dem);
}

// a heap on a frozen bed between two walls; on_bed and contacts by brute force; a grain at rest that becomes a frozen
// sphere in its place does not stir the others
static void test_deposit(void **unused) {
    (void)unused;
    const double walls[2][4] = {{-0.09, 0.5, -0.09, -0.05}, {0.09, -0.05, 0.09, 0.5}};
    silt_dem_def def = plain();
    silt_dem *dem = NULL;
    def.gravity[1] = -9.81;
    def.restitution = 0.2;
    def.rolling_friction = 0.3;
    def.n_wall = 2;
    def.wall = walls;
    OK(silt_dem_open(&dem, &def, &error));
    int64_t id = 0;
    for (int i = 0; i < 12; i++) {
        silt_dem_sphere g = grain(id++, -0.09 + 0.0165 * i, 0);
        g.kind = DEM_FROZEN;
        silt_dem_add(dem, 1, &g);
    }
    for (int i = 0; i < 40; i++) {
        silt_dem_sphere g = grain(id++, -0.075 + 0.0206 * (i % 8) + 0.001 * (i / 8), 0.03 + 0.022 * (i / 8));
        g.radius = 0.009 + 0.00002 * i;
        silt_dem_add(dem, 1, &g);
    }
    const silt_dem_state *s = NULL;
    for (int i = 0; i < 40; i++)
        s = advance(dem, 2500, NULL, NULL, NULL);
    double quiet = 0, after = 0;
    int touching = 0, n_bed = 0;
    assert_int_equal(s->n_grain, 40);
    for (int i = 0; i < s->n_grain; i++) {
        quiet = fmax(quiet, hypot(s->v[3 * i], s->v[3 * i + 1]));
        int count = 0, bed = fabs(fabs(s->x[3 * i]) - 0.09) < s->radius[i];
        count += bed;
        for (int k = 0; k < 12; k++)
            if (hypot(s->x[3 * i] - (-0.09 + 0.0165 * k), s->x[3 * i + 1]) < s->radius[i] + 0.01)
                count++, bed = 1;
        for (int k = 0; k < s->n_grain; k++)
            count += k != i &&
                     hypot(s->x[3 * i] - s->x[3 * k], s->x[3 * i + 1] - s->x[3 * k + 1]) < s->radius[i] + s->radius[k];
        assert_int_equal(s->contacts[i], count);
        assert_int_equal(s->on_bed[i], bed);
        touching += count;
        n_bed += bed;
    }
    // a third of those on the bed stay where they are for good
    for (int i = 0; i < s->n_grain; i++)
        if (s->on_bed[i] && i % 3 == 0) {
            silt_dem_sphere g = grain(id++, s->x[3 * i], s->x[3 * i + 1]);
            g.kind = DEM_FROZEN;
            g.radius = s->radius[i];
            silt_dem_add(dem, 1, &g);
            silt_dem_remove(dem, 1, &s->id[i]);
        }
    int before = s->n_grain;
    for (int k = 0; k < 20; k++) {
        s = advance(dem, 100, NULL, NULL, NULL);
        for (int i = 0; i < s->n_grain; i++)
            after = fmax(after, hypot(s->v[3 * i], s->v[3 * i + 1]));
    }
    print_message("heap: %d contacts, %d on the bed, speed %.1e; %d frozen, then at most %.1e\n", touching, n_bed,
                  quiet, before - s->n_grain, after);
    assert_true(before - s->n_grain > 2 && touching > 60);
    assert_true(quiet < 1e-3);
    assert_true(after < 1e-2);
    silt_dem_close(&dem);
}

static uint64_t fingerprint(const silt_dem_state *s) {
    uint64_t h = silt_hash(0, s->id, (size_t)s->n_grain * sizeof *s->id);
    h = silt_hash(h, s->x, 3 * (size_t)s->n_grain * sizeof(double));
    h = silt_hash(h, s->v, 3 * (size_t)s->n_grain * sizeof(double));
    h = silt_hash(h, s->omega, 3 * (size_t)s->n_grain * sizeof(double));
    h = silt_hash(h, s->radius, (size_t)s->n_grain * sizeof(double));
    h = silt_hash(h, s->mass, (size_t)s->n_grain * sizeof(double));
    h = silt_hash(h, s->contacts, (size_t)s->n_grain * sizeof(int));
    h = silt_hash(h, s->on_bed, (size_t)s->n_grain);
    h = silt_hash(h, s->body_x, 3 * (size_t)s->n_body * sizeof(double));
    h = silt_hash(h, s->body_v, 3 * (size_t)s->n_body * sizeof(double));
    h = silt_hash(h, s->body_omega, 3 * (size_t)s->n_body * sizeof(double));
    return silt_hash(h, s->body_q, 4 * (size_t)s->n_body * sizeof(double));
}

// grains, frozen spheres, a fixed and a free body, a plane and a mesh, all in contact
static void crowd(silt_dem *dem, int64_t *id) {
    silt_dem_body body[2] = {
        {.n_sphere = 5,
         .sphere = plus,
         .mass = 0.05,
         .inertia = 4e-6,
         .x = {0.01, 0.12},
         .omega = {0, 0, 1},
         .angle = 0.3},
        {.n_sphere = 5, .sphere = plus, .mass = 1, .inertia = 1, .x = {-0.06, 0.03}, .angle = 0.2, .fixed = true}};
    for (int k = 0; k < 2; k++)
        OK(silt_dem_add_body(dem, &body[k], &error));
    for (int i = 0; i < 10; i++) {
        silt_dem_sphere g = grain((*id)++, -0.09 + 0.0195 * i, 0);
        g.kind = DEM_FROZEN;
        silt_dem_add(dem, 1, &g);
    }
    for (int i = 0; i < 24; i++) {
        silt_dem_sphere g = grain((*id)++, -0.07 + 0.0195 * (i % 8), 0.06 + 0.021 * (i / 8) + (i % 8 > 3) * 0.1);
        g.radius = 0.0095;
        silt_dem_add(dem, 1, &g);
    }
}

static const silt_dem_state *some_steps(silt_dem *dem, int chunks) {
    const silt_dem_state *s = silt_dem_state_now(dem);
    for (int k = 0; k < chunks; k++) {
        double *force = calloc(3 * (size_t)s->n_grain + 1, sizeof *force), push[6] = {1e-3, 1e-3, 0, 0, 0, 0},
               turn[6] = {0, 0, 1e-6, 0, 0, 0};
        for (int i = 0; i < s->n_grain; i++)
            force[3 * i] = -1e-2 * s->mass[i] * s->v[3 * i];
        s = advance(dem, 20, force, push, turn);
        free(force);
    }
    return s;
}

static void test_checkpoint(void **unused) {
    (void)unused;
    const double walls[3][4] = {{-0.1, 0.3, -0.1, -0.02}, {-1, -0.02, 1, -0.02}, {0.1, -0.02, 0.12, 0.3}};
    const char *path = "test_dem_checkpoint.h5";
    silt_dem_def def = plain();
    silt_dem *dem = NULL, *twin = NULL;
    silt_store *store = NULL;
    def.gravity[1] = -9.81;
    def.rolling_friction = 0.1;
    def.body_friction = 0.2;
    def.restitution = 0.4;
    def.n_wall = 3;
    def.wall = walls;
    OK(silt_dem_open(&dem, &def, &error));
    int64_t id = 0;
    crowd(dem, &id);
    // saved before the first run, with everything still in the queue
    OK(silt_store_create(&store, path, &error));
    OK(silt_dem_save(dem, store, &error));
    OK(silt_store_commit(&store, &error));
    OK(silt_store_open(&store, path, &error));
    OK(silt_dem_load(&twin, &def, store, &error));
    silt_store_close(&store);
    const silt_dem_state *s = some_steps(dem, 10), *t = some_steps(twin, 10);
    assert_true(fingerprint(s) == fingerprint(t));
    silt_dem_close(&twin);

    for (int k = 0; k < 50; k++)
        s = advance(dem, 700, NULL, NULL, NULL);
    int touching = 0;
    for (int i = 0; i < s->n_grain; i++)
        touching += s->contacts[i];
    for (int again = 0; again < 2; again++) {
        // some edits in the history, some waiting
        silt_dem_remove(dem, 1, &s->id[3]);
        silt_dem_sphere g = grain(id++, 0.05, 0.4 + 0.05 * again);
        silt_dem_add(dem, 1, &g);
        s = some_steps(dem, 1);
        silt_dem_remove(dem, 1, &s->id[5]);
        g = grain(id++, 0.0, 0.4 + 0.05 * again);
        silt_dem_add(dem, 1, &g);
        OK(silt_store_create(&store, path, &error));
        OK(silt_dem_save(dem, store, &error));
        OK(silt_store_commit(&store, &error));
        OK(silt_store_open(&store, path, &error));
        OK(silt_dem_load(&twin, &def, store, &error));
        silt_store_close(&store);
        assert_true(fingerprint(s) == fingerprint(silt_dem_state_now(twin)));
        for (int k = 0; k < 10; k++) {
            s = some_steps(dem, 1);
            t = some_steps(twin, 1);
            if (fingerprint(s) != fingerprint(t))
                fail_msg("after %d substeps the loaded worker differs", 20 * (k + 1));
        }
        // both go on with the same edits
        for (int side = 0; side < 2; side++) {
            silt_dem *d = side ? twin : dem;
            silt_dem_remove(d, 1, &silt_dem_state_now(d)->id[1]);
            g = grain(id, -0.05, 0.4 + 0.05 * again);
            silt_dem_add(d, 1, &g);
            some_steps(d, 20);
        }
        id++;
        s = silt_dem_state_now(dem);
        assert_true(fingerprint(s) == fingerprint(silt_dem_state_now(twin)));
        silt_dem_close(&twin);
    }
    print_message("checkpoint: %d grains, %d contacts, same bits after 200 substeps and after later edits\n",
                  s->n_grain, touching);
    assert_true(touching > 20);

    // nothing left but the bodies
    silt_dem_remove(dem, s->n_grain, s->id);
    s = advance(dem, 20, NULL, NULL, NULL);
    assert_int_equal(s->n_grain, 0);
    OK(silt_store_create(&store, path, &error));
    OK(silt_dem_save(dem, store, &error));
    OK(silt_store_commit(&store, &error));
    OK(silt_store_open(&store, path, &error));
    OK(silt_dem_load(&twin, &def, store, &error));
    silt_store_close(&store);
    assert_true(fingerprint(some_steps(dem, 10)) == fingerprint(some_steps(twin, 10)));
    silt_dem_close(&twin);
    silt_dem_close(&dem);
    unlink(path);
}

// Runs that go on from each other without a set-up: as one run, to the bit; loads that change arrive whole
static void test_keep(void **unused) {
    (void)unused;
    const double walls[3][4] = {{-0.1, 0.3, -0.1, -0.02}, {-1, -0.02, 1, -0.02}, {0.1, -0.02, 0.12, 0.3}};
    silt_dem_def def = plain();
    uint64_t print[2];
    int touching = 0;
    def.gravity[1] = -9.81;
    def.restitution = 0.4;
    def.rolling_friction = 0.1;
    def.n_wall = 3;
    def.wall = walls;
    for (int cut = 0; cut < 2; cut++) {
        silt_dem *dem = NULL;
        OK(silt_dem_open(&dem, &def, &error));
        for (int i = 0; i < 24; i++) {
            silt_dem_sphere g = grain(i, -0.07 + 0.0195 * (i % 8), 0.01 + 0.021 * (i / 8) + (i % 8 > 3) * 0.1);
            g.radius = 0.0095;
            silt_dem_add(dem, 1, &g);
        }
        const silt_dem_state *s = advance(dem, 30000, NULL, NULL, NULL);
        for (int k = 0; k < (cut ? 40 : 1); k++) {
            if (k > 0)
                silt_dem_keep(dem);
            s = advance(dem, cut ? 20 : 800, NULL, NULL, NULL);
        }
        print[cut] = fingerprint(s);
        for (int i = 0; i < s->n_grain; i++)
            touching += s->contacts[i];
        silt_dem_close(&dem);
    }
    print_message("runs that go on: %d contacts\n", touching / 2);
    assert_true(touching > 40);
    assert_true(print[0] == print[1]);

    // a grain of its own: momentum is the sum of force and time, the place that of a parabola a run
    def.gravity[1] = 0;
    silt_dem *dem = NULL;
    OK(silt_dem_open(&dem, &def, &error));
    silt_dem_sphere g = grain(1, 0.3, 0.5);
    silt_dem_add(dem, 1, &g);
    double x = 0.3, v = 0;
    for (int k = 0; k < 30; k++) {
        const double force[3] = {1e-2 * sin(3 * k), 0, 0}, t = 20 * def.step;
        if (k > 0)
            silt_dem_keep(dem);
        else
            advance(dem, 0, NULL, NULL, NULL);
        const silt_dem_state *s = advance(dem, 20, force, NULL, NULL);
        x += v * t + 0.5 * force[0] / mass * t * t;
        v += force[0] / mass * t;
        near(s->v[0], v, 1e-14, "velocity under a load that changes");
        near(s->x[0], x, 1e-14, "place under a load that changes");
    }
    silt_dem_close(&dem);
}

// no sphere at all, but a past
static void test_empty_checkpoint(void **unused) {
    (void)unused;
    const char *path = "test_dem_empty.h5";
    silt_dem_def def = plain();
    silt_dem *dem = NULL, *twin = NULL;
    silt_store *store = NULL;
    OK(silt_dem_open(&dem, &def, &error));
    silt_dem_sphere g = grain(4, 0, 0);
    silt_dem_add(dem, 1, &g);
    advance(dem, 5, NULL, NULL, NULL);
    silt_dem_remove(dem, 1, &g.id);
    advance(dem, 5, NULL, NULL, NULL);
    OK(silt_store_create(&store, path, &error));
    OK(silt_dem_save(dem, store, &error));
    OK(silt_store_commit(&store, &error));
    OK(silt_store_open(&store, path, &error));
    OK(silt_dem_load(&twin, &def, store, &error));
    silt_store_close(&store);
    g.id = 5;
    silt_dem_add(twin, 1, &g);
    assert_int_equal(advance(twin, 5, NULL, NULL, NULL)->id[0], 5);
    silt_dem_close(&twin);
    silt_dem_close(&dem);
    unlink(path);
}

static void test_failures(void **unused) {
    (void)unused;
    silt_dem_def def = plain();
    silt_dem *dem = NULL;
    // no worker
    def.worker = "/nowhere/silt-dem";
    FAILS(silt_dem_open(&dem, &def, &error),
          "cannot start the LIGGGHTS worker \"/nowhere/silt-dem\": No such file or directory");
    assert_null(dem);
    def = plain();
    def.log = "/nowhere/dem.log";
    FAILS(silt_dem_open(&dem, &def, &error), "/nowhere/dem.log: cannot write");
    def = plain();
    def.period = 0.05;
    FAILS(silt_dem_open(&dem, &def, &error), "at least 3 diameters");
    def = plain();
    def.restitution = 0.01;
    FAILS(silt_dem_open(&dem, &def, &error), "the restitution is 0.01");
    // LIGGGHTS refuses
    def = plain();
    def.poissons_ratio = 0.7;
    OK(silt_dem_open(&dem, &def, &error));
    OK(silt_dem_start(dem, 1, NULL, NULL, NULL, &error));
    FAILS(silt_dem_wait(dem, &error), "gave up: LIGGGHTS: 0 <= poissonsRatio <= 0.5 required");
    silt_dem_close(&dem);

    // killed between two runs and in the middle of one
    def = plain();
    for (int busy = 0; busy < 2; busy++) {
        OK(silt_dem_open(&dem, &def, &error));
        silt_dem_sphere g = grain(1, 0, 0);
        silt_dem_add(dem, 1, &g);
        advance(dem, 1, NULL, NULL, NULL);
        char text[256];
        snprintf(text, sizeof text, "the LIGGGHTS worker (pid %d) was killed by signal 9; its last log line: ready",
                 silt_dem_process(dem));
        if (busy)
            OK(silt_dem_start(dem, 2000000000, NULL, NULL, NULL, &error));
        kill(silt_dem_process(dem), SIGKILL);
        if (busy) {
            FAILS(silt_dem_wait(dem, &error), text);
        } else {
            siginfo_t gone;
            assert_int_equal(waitid(P_PID, (id_t)silt_dem_process(dem), &gone, WEXITED | WNOWAIT), 0);
            FAILS(silt_dem_start(dem, 1, NULL, NULL, NULL, &error), text);
        }
        FAILS(silt_dem_start(dem, 1, NULL, NULL, NULL, &error), text);
        silt_dem_close(&dem);
    }
    // closed in the middle of a run; signals of the terminal are not for the worker
    OK(silt_dem_open(&dem, &def, &error));
    OK(silt_dem_start(dem, 2000000000, NULL, NULL, NULL, &error));
    kill(silt_dem_process(dem), SIGINT);
    kill(silt_dem_process(dem), SIGTERM);
    usleep(50000);
    assert_int_equal(kill(silt_dem_process(dem), 0), 0);
    silt_dem_close(&dem); // returns at all: that run would take years

    // what is not finite never reaches LIGGGHTS
    OK(silt_dem_open(&dem, &def, &error));
    silt_dem_sphere g = grain(42, 0.25, 0.5);
    silt_dem_add(dem, 1, &g);
    advance(dem, 0, NULL, NULL, NULL);
    const double force[3] = {0, NAN, 0};
    FAILS(silt_dem_start(dem, 1, force, NULL, NULL, &error),
          "the force on grain 42 at (0.25, 0.5) is not finite: (0, nan)");
    // and the worker is none the worse
    assert_int_equal(advance(dem, 1, NULL, NULL, NULL)->n_grain, 1);
    g = grain(43, 5, 0);
    silt_dem_add(dem, 1, &g);
    FAILS(silt_dem_start(dem, 1, NULL, NULL, NULL, &error),
          "sphere 43 at (5, 0) lies outside the box (-1, -1) to (1, 1)");
    silt_dem_remove(dem, 1, &g.id);
    // one that blows up
    const double huge[3] = {1e308, 0, 0};
    OK(silt_dem_start(dem, 100, huge, NULL, NULL, &error));
    error = (silt_error){0};
    if (silt_dem_wait(dem, &error) == SILT_OK)
        assert_int_equal(silt_dem_state_now(dem)->n_grain, 0);
    else
        print_message("%s\n", error.text);
    silt_dem_close(&dem);
}

// true when the process is gone or a zombie that waits for its new parent
static bool gone_or_zombie(int pid) {
    char path[64], state = 'Z';
    snprintf(path, sizeof path, "/proc/%d/stat", pid);
    FILE *file = fopen(path, "r");
    if (!file)
        return true;
    if (fscanf(file, "%*d (%*[^)]) %c", &state) != 1)
        state = 'Z';
    fclose(file);
    return state == 'Z';
}

// silt is killed: the worker goes too, idle or not
static void test_orphan(void **unused) {
    (void)unused;
    for (int busy = 0; busy < 2; busy++) {
        int pipes[2], worker = 0;
        assert_int_equal(pipe(pipes), 0);
        pid_t parent = fork();
        if (parent == 0) {
            silt_dem_def def = plain();
            silt_dem *dem = NULL;
            if (silt_dem_open(&dem, &def, &error) == SILT_OK) {
                worker = silt_dem_process(dem);
                if (busy)
                    silt_dem_start(dem, 2000000000, NULL, NULL, NULL, &error);
            }
            usleep(20000);
            if (write(pipes[1], &worker, sizeof worker) < 0)
                _exit(1);
            raise(SIGKILL);
        }
        assert_int_equal(read(pipes[0], &worker, sizeof worker), sizeof worker);
        close(pipes[0]);
        close(pipes[1]);
        waitpid(parent, NULL, 0);
        assert_true(worker > 0);
        double start = silt_seconds();
        while (!gone_or_zombie(worker) && silt_seconds() - start < 1)
            usleep(1000);
        assert_true(gone_or_zombie(worker));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_open_close), cmocka_unit_test(test_free_fall),   cmocka_unit_test(test_impulse), cmocka_unit_test(test_twist),
        cmocka_unit_test(test_bounce),     cmocka_unit_test(test_sliding),     cmocka_unit_test(test_body_impulse),
        cmocka_unit_test(test_body_response), cmocka_unit_test(test_body_rests), cmocka_unit_test(test_body_slides), cmocka_unit_test(test_edits),
        cmocka_unit_test(test_deposit),    cmocka_unit_test(test_checkpoint),  cmocka_unit_test(test_empty_checkpoint),
        cmocka_unit_test(test_keep),
        cmocka_unit_test(test_failures),   cmocka_unit_test(test_orphan),
    };
    return cmocka_run_group_tests_name("dem", tests, NULL, NULL);
}
