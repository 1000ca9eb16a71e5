// rigid bodies in space in the discrete elements: free rotation against Euler's equations, loads, rest in a turned pose
#include "../dem-coupling/dem.h"
#include "../dem-coupling/form.h"
#include "../dem-coupling/pose.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <unistd.h>
// clang-format off
#include <cmocka.h>
// clang-format on
#include "check.h"

static silt_dem_def base(void) {
    return (silt_dem_def){.worker = SILT_BINARY "/silt-dem",
                          .log = "/dev/null",
                          .dim = 3,
                          .lo = {-1, -1, -1},
                          .hi = {1, 1, 1},
                          .youngs_modulus = 1e7,
                          .poissons_ratio = 0.3,
                          .restitution = 0.5,
                          .friction = 0.4,
                          .rolling_friction = 0,
                          .body_friction = 0.4,
                          .step = 1e-5,
                          .max_radius = 0.02,
                          .min_radius = 0.005,
                          .no_contacts = true};
}

static const silt_dem_state *advance(silt_dem *dem, int n, const double *force, const double *torque) {
    OK(silt_dem_start(dem, n, NULL, force, torque, &error));
    OK(silt_dem_wait(dem, &error));
    return silt_dem_state_now(dem);
}

// q of a turn about an axis
static void turn(const double axis[3], double angle, double q[4]) {
    q[0] = cos(angle / 2);
    for (int d = 0; d < 3; d++)
        q[1 + d] = sin(angle / 2) * axis[d] / silt_length(3, axis);
}

static void product(const double p[4], const double q[4], double out[4]) {
    const double w = p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3];
    double v[3];
    for (int k = 0; k < 3; k++) {
        const int i = 1 + (k + 1) % 3, j = 1 + (k + 2) % 3;
        v[k] = p[0] * q[1 + k] + q[0] * p[1 + k] + p[i] * q[j] - p[j] * q[i];
    }
    out[0] = w;
    memcpy(out + 1, v, sizeof v);
}

// the tensor in a frame turned by r against that of the principal moments
static void turned_tensor(const double moment[3], const double r[4], double tensor[6]) {
    double m[3][3] = {{0}};
    for (int c = 0; c < 3; c++) {
        const double unit[3] = {c == 0, c == 1, c == 2};
        double axis[3];
        silt_turn(r, false, unit, axis);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                m[i][j] += moment[c] * axis[i] * axis[j];
    }
    memcpy(tensor, (double[6]){m[0][0], m[1][1], m[2][2], m[0][1], m[0][2], m[1][2]}, 6 * sizeof *tensor);
}

// Euler's equations in the principal frame and the quaternion's, by Runge and Kutta in n steps
typedef struct rotor {
    double w[3], q[4];
} rotor;

static rotor rate(const double moment[3], const rotor *r) {
    rotor out;
    double half[4];
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        out.w[k] = (moment[i] - moment[j]) * r->w[i] * r->w[j] / moment[k];
        half[1 + k] = r->w[k] / 2;
    }
    half[0] = 0;
    product(r->q, half, out.q);
    return out;
}

static rotor along(const rotor *r, const rotor *d, double t) {
    rotor out;
    for (int k = 0; k < 4; k++) {
        out.q[k] = r->q[k] + t * d->q[k];
        if (k < 3)
            out.w[k] = r->w[k] + t * d->w[k];
    }
    return out;
}

static void euler(const double moment[3], rotor *r, double t, int n) {
    const double dt = t / n;
    for (int s = 0; s < n; s++) {
        const rotor a = rate(moment, r), at_b = along(r, &a, dt / 2), b = rate(moment, &at_b), at_c = along(r, &b, dt / 2),
                    c = rate(moment, &at_c), at_d = along(r, &c, dt), d = rate(moment, &at_d);
        rotor sum = a;
        for (int k = 0; k < 4; k++) {
            sum.q[k] = (a.q[k] + 2 * b.q[k] + 2 * c.q[k] + d.q[k]) / 6;
            if (k < 3)
                sum.w[k] = (a.w[k] + 2 * b.w[k] + 2 * c.w[k] + d.w[k]) / 6;
        }
        *r = along(r, &sum, dt);
    }
}

// A box of 0.4 by 0.3 by 0.2 spun about its middle axis turns over and back. It comes in its principal frame, and with its corners given
// in a frame that is turned, where the tensor has products: the same motion.
static void test_tumble(void **state) {
    (void)state;
    const double mass = 2, size[3] = {0.4, 0.3, 0.2}, w0[3] = {2, 20, 1};
    double moment[3];
    for (int k = 0; k < 3; k++)
        moment[k] = mass * (silt_square(size[(k + 1) % 3]) + silt_square(size[(k + 2) % 3])) / 12;
    for (int form = 0; form < 2; form++) {
        silt_dem_def def = base();
        silt_dem *dem = NULL;
        OK(silt_dem_open(&dem, &def, &error));
        double frame[4] = {1, 0, 0, 0}, first[4], sphere[32];
        if (form)
            turn((double[3]){1, 2, -1}, 0.9, frame);
        turn((double[3]){0, 1, 1}, 0.6, first); // of the principal frame in space
        for (int i = 0; i < 8; i++) {
            const double corner[3] = {0.1 * (i & 1 ? 1 : -1), 0.08 * (i & 2 ? 1 : -1), 0.05 * (i & 4 ? 1 : -1)};
            silt_turn(frame, false, corner, sphere + 4 * i);
            sphere[4 * i + 3] = 0.01;
        }
        silt_dem_body body = {.n_sphere = 8, .sphere = sphere, .mass = mass, .x = {0.1, -0.2, 0.3}, .v = {0.1, 0, 0}};
        turned_tensor(moment, frame, body.tensor);
        // a point of the principal frame is frame x in the body's, and first x in space
        const double back[4] = {frame[0], -frame[1], -frame[2], -frame[3]};
        product(first, back, body.q);
        silt_turn(first, false, w0, body.omega);
        OK(silt_dem_add_body(dem, &body, &error));
        rotor r = {.w = {w0[0], w0[1], w0[2]}, .q = {first[0], first[1], first[2], first[3]}};
        double momentum[3], worst = 0, off = 0, lost = 0, least = HUGE_VAL;
        for (int k = 0; k < 3; k++)
            momentum[k] = moment[k] * w0[k];
        silt_turn(first, false, momentum, momentum);
        for (int k = 0; k < 24; k++) {
            const silt_dem_state *s = advance(dem, 5000, NULL, NULL);
            euler(moment, &r, 0.05, 1000);
            double expected[3], own[3], q[4], now[3];
            silt_turn(r.q, false, r.w, expected);
            product(s->body_q, frame, q); // of the principal frame
            double same = 0, length = silt_length(4, r.q);
            for (int d = 0; d < 4; d++)
                same += q[d] * r.q[d] / length;
            off = silt_max(off, 2 * acos(silt_min(fabs(same), 1)));
            silt_turn(q, true, s->body_omega, own);
            least = silt_min(least, own[1]);
            for (int d = 0; d < 3; d++) {
                worst = silt_max(worst, fabs(s->body_omega[d] - expected[d]) / w0[1]);
                now[d] = moment[d] * own[d];
            }
            silt_turn(q, false, now, now);
            for (int d = 0; d < 3; d++)
                lost = silt_max(lost, fabs(now[d] - momentum[d]) / silt_length(3, momentum));
        }
        print_message("tumbling, %s: omega off by %.1e, pose by %.1e rad, momentum by %.1e; slowest about the middle axis %.2f\n",
                      form ? "turned frame" : "principal frame", worst, off, lost, least);
        assert_true(least < -5); // it turned over
        assert_true(worst < 1e-6 && off < 1e-5 && lost < 1e-12);
        near(silt_dem_state_now(dem)->body_x[0], 0.1 + 0.1 * 1.2, 1e-9, "x");
        silt_dem_close(&dem);
    }
}

// a sphere keeps its angular momentum
static void test_sphere(void **state) {
    (void)state;
    silt_dem_def def = base();
    silt_dem *dem = NULL;
    OK(silt_dem_open(&dem, &def, &error));
    const silt_body_def shape = {.name = "ball", .shape = SHAPE_SPHERE, .scale = 0.04};
    silt_solid solid;
    silt_clump clump = {0};
    OK(silt_form_create(&solid, &shape, &error));
    silt_form_clump(&clump, &solid, 0);
    silt_dem_body body = {.n_sphere = clump.n_sphere, .sphere = clump.sphere, .mass = 1000 * solid.volume, .omega = {3, -2, 5}, .q = {1, 0, 0, 0}};
    for (int k = 0; k < 6; k++)
        body.tensor[k] = 1000 * solid.inertia[k];
    def.max_radius = 0.021;
    OK(silt_dem_add_body(dem, &body, &error));
    const silt_dem_state *s = advance(dem, 20000, NULL, NULL);
    for (int d = 0; d < 3; d++)
        near(s->body_omega[d], body.omega[d], 1e-9, "omega");
    // 0.2 s about one axis
    double q[4], same = 0;
    turn(body.omega, 0.2 * silt_length(3, body.omega), q);
    for (int k = 0; k < 4; k++)
        same += q[k] * s->body_q[k];
    near(fabs(same), 1, 1e-9, "pose");
    silt_clump_clear(&clump);
    silt_solid_clear(&solid);
    silt_dem_close(&dem);
}

// force t / mass, torque t = change of angular momentum
static void test_load(void **state) {
    (void)state;
    silt_dem_def def = base();
    silt_dem *dem = NULL;
    OK(silt_dem_open(&dem, &def, &error));
    const double moment[3] = {2e-4, 3e-4, 4e-4}, mass = 0.3, force[3] = {0.1, -0.2, 0.3}, torque[3] = {1e-4, 2e-4, -3e-4};
    double frame[4], sphere[20] = {0, 0, 0, 0.01, 0.03, 0, 0, 0.01, 0, 0.04, 0, 0.01, 0, 0, 0.05, 0.01, -0.02, -0.01, 0, 0.01};
    silt_dem_body body = {.n_sphere = 5, .sphere = sphere, .mass = mass, .x = {0, 0.1, 0}};
    turn((double[3]){3, -1, 1}, 1.1, frame);
    turned_tensor(moment, frame, body.tensor);
    turn((double[3]){0, 1, 0}, 0.4, body.q);
    OK(silt_dem_add_body(dem, &body, &error));
    const silt_dem_state *s = advance(dem, 100, force, torque);
    const double t = 1e-3;
    double own[3], l[3];
    const double *in = body.tensor;
    silt_turn(s->body_q, true, s->body_omega, own);
    const double momentum[3] = {in[0] * own[0] + in[3] * own[1] + in[4] * own[2], in[3] * own[0] + in[1] * own[1] + in[5] * own[2],
                                in[4] * own[0] + in[5] * own[1] + in[2] * own[2]};
    silt_turn(s->body_q, false, momentum, l);
    for (int d = 0; d < 3; d++) {
        near(s->body_v[d], force[d] * t / mass, 1e-9 * fabs(force[d]) * t / mass, "v");
        near(l[d], torque[d] * t, 1e-6 * fabs(torque[d]) * t, "angular momentum");
    }
    silt_dem_close(&dem);
}

// a rod along its own z, turned to lie on the floor, rests there at its radius; not turned it stands
static void test_rest(void **state) {
    (void)state;
    static const double floor[2][10] = {{-0.5, -0.5, 0, 0.5, -0.5, 0, 0.5, 0.5, 0, 3}, {-0.5, -0.5, 0, 0.5, 0.5, 0, -0.5, 0.5, 0, 6}};
    const double sphere[12] = {0, 0, -0.02, 0.01, 0, 0, 0.02, 0.01, 0, 0, 0, 0.01};
    for (int lies = 0; lies < 2; lies++) {
        silt_dem_def def = base();
        silt_dem *dem = NULL;
        def.n_triangle = 2;
        def.triangle = floor;
        def.gravity[2] = -9.81;
        OK(silt_dem_open(&dem, &def, &error));
        silt_dem_body body = {.n_sphere = 3, .sphere = sphere, .mass = 0.02, .tensor = {4e-6, 4e-6, 1e-6}, .x = {0.01, 0.02, lies ? 0.0101 : 0.0301}};
        turn((double[3]){0, 1, 0}, lies ? M_PI / 2 : 0, body.q);
        OK(silt_dem_add_body(dem, &body, &error));
        const silt_dem_state *s = advance(dem, 30000, NULL, NULL);
        const double v = s->body_v[2];
        s = advance(dem, 1000, NULL, NULL);
        print_message("rod %s at %.5f, speed %.1e\n", lies ? "lies" : "stands", s->body_x[2], silt_length(3, s->body_v));
        near(s->body_x[2], lies ? 0.01 : 0.03, 1e-4, "height");
        near(0.02 * ((s->body_v[2] - v) / 0.01 + 9.81) / (0.02 * 9.81), 1, 1e-3, "reaction");
        silt_dem_close(&dem);
    }
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_tumble),
        cmocka_unit_test(test_sphere),
        cmocka_unit_test(test_load),
        cmocka_unit_test(test_rest),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
