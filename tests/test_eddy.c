// the model of Spalart and Allmaras: each term alone against its exact solution, the log layer that solves the whole, uniform channels
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "water_column.h"

// column with eddies; far: no wall is near
static void open_column(column *c, int dim, int n_row, double height, bool far) {
    column_open(c, dim, n_row, height);
    c->nodes.eddy = silt_alloc((size_t)c->nodes.count, sizeof(double));
    c->mesh.wet = silt_alloc((size_t)c->nodes.count, 1);
    memset(c->mesh.wet, 1, (size_t)c->nodes.count);
    c->scene.fluid.turbulence = TURBULENCE_SPALART_ALLMARAS;
    if (far)
        c->walls.roughness[0] = -1;
    column_place(c);
}

static void advance(column *c, double dt) {
    silt_eddy_advance(&c->eddy, &c->scene, &c->nodes, &c->mesh, &c->depth, &c->law, c->flux, c->inverse, c->volume, c->v, dt);
}

static double height_of(const column *c, int i) { return c->nodes.x[c->dim * i + c->dim - 1]; }

// x += slope y: cells get angles above 90 degrees
static void lean(column *c, double slope) {
    const int dim = c->dim;
    for (int i = 0; i < c->nodes.count; i++)
        c->nodes.x[dim * i] += slope * height_of(c, i);
    for (int k = 0; k < c->mesh.n_cell * (dim + 1); k++)
        c->flux[dim * k + dim - 1] -= slope * c->flux[dim * k];
}

// ---- sources: alike everywhere, so that nothing spreads

// d nu~/dt = - c nu~^2, c = c_w1 f_w(10)/d^2: nu~ = nu~_0/(1 + c nu~_0 t), in any number of steps
static void test_destruction_alone(void **state) {
    (void)state;
    const double cw1 = 0.1355 / (0.41 * 0.41) + 1.622 * 1.5, g = 10 + 0.3 * (1e6 - 10), fw = g * pow(65 / (pow(g, 6) + 64), 1.0 / 6);
    for (int dim = 2; dim <= 3; dim++) {
        column c;
        open_column(&c, dim, 5, 0.4, true);
        c.scene.fluid.viscosity = 0;
        const double d = 0.05, start = 2e-3, rate = cw1 * fw / (d * d);
        for (int i = 0; i < c.nodes.count; i++) {
            c.nodes.eddy[i] = start;
            c.eddy.reach[i] = d;
        }
        double t = 0;
        for (double dt = 1e-3; t < 10; dt *= 2) {
            advance(&c, dt);
            t += dt;
            for (int i = 0; i < c.nodes.count; i++)
                NEAR(c.nodes.eddy[i] * (1 / start + rate * t), 1, 1e-8);
        }
        column_close(&c);
    }
}

// far from walls in shear d nu~/dt = c_b1 S nu~: nu~_0 exp(c_b1 S t), first order in dt
static void test_production_alone(void **state) {
    (void)state;
    for (int dim = 2; dim <= 3; dim++) {
        double error[2];
        for (int fine = 0; fine < 2; fine++) {
            column c;
            open_column(&c, dim, 5, 0.4, true);
            const double shear = 3, t = 2;
            for (int i = 0; i < c.nodes.count; i++) {
                c.nodes.eddy[i] = 1e-4;
                c.v[dim * i] = shear * height_of(&c, i);
            }
            const int steps = fine ? 80 : 40;
            for (int k = 0; k < steps; k++)
                advance(&c, t / steps);
            error[fine] = c.nodes.eddy[7] / (1e-4 * exp(0.1355 * shear * t)) - 1;
            for (int i = 0; i < c.nodes.count; i++)
                NEAR(c.nodes.eddy[i], c.nodes.eddy[7], 1e-12);
            column_close(&c);
        }
        print_message("production %d-D: %.2e, %.2e\n", dim, error[0], error[1]);
        NEAR(error[1], 0, 0.01);
        NEAR(error[1] / error[0], 0.5, 0.02);
    }
}

// ---- spreading

// small beside the water's own viscosity: a cosine between two ends without flux decays with nu k^2/sigma, second order in h
static void test_diffusion_alone(void **state) {
    (void)state;
    for (int dim = 2; dim <= 3; dim++) {
        double error[2];
        for (int fine = 0; fine < 2; fine++) {
            column c;
            const int n_row = fine ? 17 : 9, steps = fine ? 400 : 100;
            open_column(&c, dim, n_row, 0.4, true);
            c.scene.fluid.viscosity = 10; // 0.01 m2/s
            const double k = acos(-1) / 0.4, decay = 0.01 * k * k * 1.5, t = 1 / decay;
            for (int i = 0; i < c.nodes.count; i++)
                c.nodes.eddy[i] = 1e-9 * (1 + 0.5 * cos(k * height_of(&c, i)));
            for (int q = 0; q < steps; q++)
                advance(&c, t / steps);
            error[fine] = 0;
            for (int i = 0; i < c.nodes.count; i++)
                error[fine] = silt_max(error[fine], fabs(c.nodes.eddy[i] / 1e-9 - 1 - 0.5 * exp(-1) * cos(k * height_of(&c, i))));
            column_close(&c);
        }
        print_message("diffusion %d-D: %.2e, %.2e\n", dim, error[0], error[1]);
        NEAR(error[1], 0, 2e-3);
        NEAR(error[1] / error[0], 0.25, 0.02);
    }
}

// Cells with obtuse angles: what there is changes by c_b2/sigma int |grad nu~|^2 alone, whatever spreads; and no value falls below nought
// in steps of any length.
static void test_books_and_sign(void **state) {
    (void)state;
    for (int dim = 2; dim <= 3; dim++)
        for (int run = 0; run < 4; run++) {
            column c;
            open_column(&c, dim, 9, 0.4, run < 2);
            lean(&c, 1.3);
            uint64_t random = 3;
            double before = 0, after = 0, more = 0;
            for (int i = 0; i < c.nodes.count; i++) {
                // smooth, so that nothing is limited; then spikes beside nothing
                c.nodes.eddy[i] = run == 0 ? 1e-3 * (1 + 0.3 * cos(9 * height_of(&c, i))) : silt_uniform(&random) < 0.2 ? 1e-2 : 0;
                for (int d = 0; d < dim && run > 1; d++)
                    c.v[dim * i + d] = silt_uniform(&random) - 0.5;
            }
            const double dt = run == 0 ? 1e-7 : run == 1 ? 1e3 : run == 2 ? 1e-2 : 10;
            for (int e = 0; e < c.mesh.n_cell; e++) {
                double slope[3] = {0};
                for (int a = 0; a <= dim; a++) {
                    const int i = c.mesh.cell[e][a];
                    before += c.volume[e] / (dim + 1) * c.nodes.eddy[i];
                    for (int d = 0; d < dim; d++)
                        slope[d] += c.flux[((dim + 1) * e + a) * dim + d] * c.inverse[e] * c.nodes.eddy[i];
                }
                more += 0.622 * 1.5 * c.volume[e] * silt_dot(dim, slope, slope) * dt;
            }
            for (int q = 0; q < 3; q++) {
                advance(&c, dt);
                after = 0;
                for (int e = 0; e < c.mesh.n_cell; e++)
                    for (int a = 0; a <= dim; a++)
                        after += c.volume[e] / (dim + 1) * c.nodes.eddy[c.mesh.cell[e][a]];
                for (int i = 0; i < c.nodes.count; i++)
                    assert_true(c.nodes.eddy[i] >= 0 && c.nodes.eddy[i] < 1e6);
                if (run == 0 && q == 0)
                    NEAR((after - before) / more, 1, 1e-3);
            }
            column_close(&c);
        }
}

// ---- the log layer

// du/dy = u*^2/(nu + nu_t) with nu~ = kappa u* d solves the equation, from the viscous layer to the log layer, on smooth walls and rough
// ones: what is left over c_w1 (kappa u*)^2 goes to nought with h^2
static double residual(int dim, int n_row, double nu, double rough) {
    column c;
    open_column(&c, dim, n_row, 0.1, true);
    const double star = 0.05, shift = 0.03 * rough, dt = 1e-9;
    c.scene.fluid.viscosity = 1000 * nu;
    double *u = silt_alloc((size_t)n_row, sizeof *u), worst = 0;
    for (int r = 1; r < n_row; r++) {
        u[r] = u[r - 1];
        for (int k = 0; k < 200; k++) {
            const double d = (r - 1 + (k + 0.5) / 200) * c.h + shift;
            u[r] += c.h / 200 * star * star / (nu + silt_eddy_viscosity(nu, SILT_KAPPA * star * d, d, rough));
        }
    }
    for (int i = 0; i < c.nodes.count; i++) {
        c.eddy.reach[i] = height_of(&c, i) + shift;
        c.eddy.rough[i] = rough;
        c.nodes.eddy[i] = SILT_KAPPA * star * c.eddy.reach[i];
        c.v[dim * i] = u[i / c.plane];
    }
    advance(&c, dt);
    const double scale = (0.1355 / (0.41 * 0.41) + 1.622 * 1.5) * silt_square(SILT_KAPPA * star);
    for (int i = 0; i < c.nodes.count; i++)
        if (height_of(&c, i) > 0.0249 && height_of(&c, i) < 0.0751)
            worst = silt_max(worst, fabs(c.nodes.eddy[i] - SILT_KAPPA * star * c.eddy.reach[i]) / dt / scale);
    free(u);
    column_close(&c);
    return worst;
}

static void test_log_layer_stands(void **state) {
    (void)state;
    static const struct {
        double nu, rough;
    } layer[] = {{1e-9, 0}, {1e-6, 2.5e-3}, {1e-4, 0}, {1e-4, 0.02}}; // y+ of 3e6, rough, 12 to 37, transitional
    for (int dim = 2; dim <= 3; dim++)
        for (int k = 0; k < 4; k++) {
            const double coarse = residual(dim, 33, layer[k].nu, layer[k].rough), fine = residual(dim, 65, layer[k].nu, layer[k].rough);
            print_message("log layer %d-D, nu %g, k_s %g: %.2e, %.2e\n", dim, layer[k].nu, layer[k].rough, coarse, fine);
            NEAR(fine, 0, 0.015);
            NEAR(fine / coarse, 0.25, 0.08);
        }
}

// f_v1 and f_w at values reckoned by hand; S~ stays positive where the wall's share would turn it round
static void test_terms(void **state) {
    (void)state;
    NEAR(silt_eddy_viscosity(1e-6, 7.1e-6, 1, 0), 3.55e-6, 1e-18);        // chi = c_v1: half
    NEAR(silt_eddy_viscosity(1e-6, 6.1e-6, 0.5, 1.0), 3.05e-6, 1e-18);    // 0.5 k_s/d = 1 more
    NEAR(silt_eddy_viscosity(1e-6, 0, 1, 0), 0, 0);
    NEAR(silt_eddy_viscosity(0, 1e-3, HUGE_VAL, 0), 1e-3, 0);
    double made, eaten;
    const double d = 0.1, value = 1e-3, omega = value / silt_square(0.41 * d); // r = 1: f_w = 1
    silt_eddy_sources(0, value, d, 0, omega, &made, &eaten);
    NEAR(made, 0.1355 * omega * value, 1e-15);
    NEAR(eaten / ((0.1355 / (0.41 * 0.41) + 1.622 * 1.5) * silt_square(value / d)), 1, 1e-12);
    for (double chi = 0.01; chi < 1e4; chi *= 1.3)
        for (double turn = 1e-6; turn < 1e4; turn *= 10) {
            silt_eddy_sources(1e-6, chi * 1e-6, 1e-3, 0, turn, &made, &eaten);
            assert_true(made > 0 && eaten > 0 && isfinite(eaten));
        }
    const double turned[9] = {0, -3, 0, 3, 0, 0, 0, 0, 0}, strained[9] = {1, 2, 0, 2, -1, 0, 0, 0, 0};
    NEAR(silt_vorticity(3, turned), 6, 1e-15);
    NEAR(silt_vorticity(3, strained), 0, 1e-15);
}

// ---- uniform channels: mean velocity of the log law

static void test_rough_channel(void **state) {
    (void)state;
    static const struct {
        int dim, n_row;
        double height, ks;
    } run[] = {{2, 11, 2, 1e-3}, {2, 11, 1, 1e-3}, {2, 11, 4, 1e-3}, {2, 11, 2, 1e-2}, {2, 21, 2, 1e-3}, {2, 41, 2, 1e-2}, {3, 11, 2, 1e-3}};
    for (int k = 0; k < (int)(sizeof run / sizeof *run); k++) {
        column c;
        open_column(&c, run[k].dim, run[k].n_row, 0.1, false);
        c.walls.roughness[0] = run[k].ks;
        c.scene.fluid.wall_height = run[k].height;
        c.scene.fluid.eddy.viscosity = 1e-5;
        column_place(&c);
        silt_eddy_start(&c.scene, &c.nodes, &c.depth);
        const double g = 9.81e-3, star = sqrt(g * 0.1), law = star / SILT_KAPPA * (log(30 * 0.1 / run[k].ks) - 1 + run[k].ks / 3);
        for (int i = 0; i < c.nodes.count; i++)
            c.v[run[k].dim * i] = law;
        for (int q = 0; q < 1200; q++) {
            column_step(&c, g, 0.025 * 0.1 / star, 3);
            advance(&c, 0.025 * 0.1 / star);
        }
        print_message("channel %d-D, %2d cells, sampled at %g h, k_s %g: mean %.4f of the log law\n", run[k].dim, run[k].n_row - 1,
                      run[k].height, run[k].ks, column_mean(&c) / law);
        NEAR(column_shear(&c), 1000 * g * 0.1, 1e-2);
        NEAR(column_mean(&c) / law, 1, 0.05);
        column_close(&c);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_terms),           cmocka_unit_test(test_destruction_alone), cmocka_unit_test(test_production_alone),
        cmocka_unit_test(test_diffusion_alone), cmocka_unit_test(test_books_and_sign),    cmocka_unit_test(test_log_layer_stands),
        cmocka_unit_test(test_rough_channel),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
