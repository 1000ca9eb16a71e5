// drag laws: each against its formula as printed, at rest, dilute, packed, monotone in the speed; terminal velocities, the onset of
// fluidisation and hindered settling against published numbers and each law's own root
#include "../dem-coupling/drag.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

static void near(double value, double expected, double tolerance, const char *what) {
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%s: %.17g, expected %.17g within %g", what, value, expected, tolerance);
}

static const struct {
    silt_drag_law law;
    const char *name;
} every[] = {{DRAG_STOKES, "stokes"},       {DRAG_SCHILLER_NAUMANN, "schiller-naumann"}, {DRAG_ABRAHAM, "abraham"},
             {DRAG_DI_FELICE, "di-felice"}, {DRAG_ERGUN, "ergun"},                       {DRAG_WEN_YU, "wen-yu"},
             {DRAG_GIDASPOW, "gidaspow"},   {DRAG_KOCH_HILL, "koch-hill"},               {DRAG_BEETSTRA, "beetstra"}};
enum { N_LAW = sizeof every / sizeof *every };

// ---------------------------------------------------------------- the laws as printed, force of one grain over its relative velocity

static double cd_schiller(double re) {
    return re < 1000 ? 24 / re * (1 + 0.15 * pow(re, 0.687)) : 0.44;
}

static double plain_schiller(double rho, double mu, double d, double e, double w) {
    (void)e;
    return cd_schiller(rho * w * d / mu) * M_PI / 8 * d * d * rho * w;
}

static double plain_stokes(double rho, double mu, double d, double e, double w) {
    (void)rho, (void)e, (void)w;
    return 3 * M_PI * mu * d;
}

static double plain_abraham(double rho, double mu, double d, double e, double w) {
    (void)e;
    const double re = rho * w * d / mu;
    return 24 / pow(9.06, 2) * pow(9.06 / sqrt(re) + 1, 2) * M_PI / 8 * d * d * rho * w;
}

static double plain_di_felice(double rho, double mu, double d, double e, double w) {
    const double re = e * rho * w * d / mu, chi = 3.7 - 0.65 * exp(-pow(1.5 - log10(re), 2) / 2);
    return pow(0.63 + 4.8 / sqrt(re), 2) * M_PI / 8 * d * d * rho * w * pow(e, 2 - chi);
}

// of a coefficient per volume of the mixture, beta (kg/m3 s): beta V/(1 - e)
static double of_volume(double beta, double d, double e) {
    return beta * M_PI / 6 * d * d * d / (1 - e);
}

static double plain_ergun(double rho, double mu, double d, double e, double w) {
    return of_volume(150 * (1 - e) * (1 - e) * mu / (e * d * d) + 1.75 * (1 - e) * rho * w / d, d, e);
}

static double plain_wen_yu(double rho, double mu, double d, double e, double w) {
    return of_volume(0.75 * cd_schiller(e * rho * w * d / mu) * e * (1 - e) * rho * w / d * pow(e, -2.65), d, e);
}

static double plain_gidaspow(double rho, double mu, double d, double e, double w) {
    return e < 0.8 ? plain_ergun(rho, mu, d, e, w) : plain_wen_yu(rho, mu, d, e, w);
}

// F is the whole force over 3 pi mu d U, U the flow per area; drag is what is left without the pressure gradient: e of it
static double plain_koch_hill(double rho, double mu, double d, double e, double w) {
    const double p = 1 - e, u = e * w, re = rho * u * (d / 2) / mu;
    const double f0 = p < 0.4 ? (1 + 3 * sqrt(p / 2) + 135.0 / 64 * p * log(p) + 16.14 * p) /
                                    (1 + 0.681 * p - 8.48 * pow(p, 2) + 8.16 * pow(p, 3))
                              : 10 * p / pow(e, 3);
    const double f3 = 0.0673 + 0.212 * p + 0.0232 / pow(e, 5);
    return e * (3 * M_PI * mu * d * u) * (f0 + f3 * re) / w;
}

static double plain_beetstra(double rho, double mu, double d, double e, double w) {
    const double p = 1 - e, u = e * w, re = rho * u * d / mu;
    const double f = 10 * p / (e * e) + e * e * (1 + 1.5 * sqrt(p)) +
                     0.413 * re / (24 * e * e) * (1 / e + 3 * e * p + 8.4 * pow(re, -0.343)) /
                         (1 + pow(10, 3 * p) * pow(re, -(1 + 4 * p) / 2));
    return 3 * M_PI * mu * d * u * f / w;
}

static double (*const plain[N_LAW])(double, double, double, double, double) = {
    plain_stokes, plain_schiller, plain_abraham,   plain_di_felice, plain_ergun,
    plain_wen_yu, plain_gidaspow, plain_koch_hill, plain_beetstra};

static void test_laws(void **unused) {
    (void)unused;
    // water and a gas, three Reynolds numbers d w rho/mu (slow, between, beyond 1000 whatever eps is), four porosities: both sides of
    // Gidaspow's 0.8 and of Koch and Hill's 0.6
    const double fluid[2][3] = {{1000, 1e-3, 1e-3}, {1.2, 1.8e-5, 5e-4}}, re[3] = {0.1, 50, 4000}, porosity[4] = {0.95, 0.82, 0.7, 0.4};
    for (int k = 0; k < N_LAW; k++)
        for (int f = 0; f < 2; f++)
            for (int r = 0; r < 3; r++)
                for (int i = 0; i < 4; i++) {
                    const double rho = fluid[f][0], mu = fluid[f][1], d = fluid[f][2], w = re[r] * mu / (rho * d);
                    near(silt_drag_factor(every[k].law, rho, mu, d, 1 - porosity[i], w) / plain[k](rho, mu, d, porosity[i], w), 1,
                         1e-12, every[k].name);
                }
    near(silt_drag_factor(DRAG_NONE, 1000, 1e-3, 1e-3, 0.4, 1), 0, 0, "no drag");
}

// eight different grains at a time are what they are one by one; each stands for as many as it says
static void test_groups(void **unused) {
    (void)unused;
    double d[DRAG_GROUP], number[DRAG_GROUP], solid[DRAG_GROUP], square[DRAG_GROUP], factor[DRAG_GROUP];
    double numbers[DRAG_NUMBERS][DRAG_GROUP];
    for (int i = 0; i < DRAG_GROUP; i++) {
        d[i] = 1e-4 * (1 + i * i);
        number[i] = 1 + 100.0 * i;
        solid[i] = 0.1 * i - 0.05; // one below nought, Gidaspow's and Koch and Hill's both sides
        square[i] = silt_square(1e-3 * pow(4, i));
    }
    for (int k = 0; k < N_LAW; k++) {
        silt_drag_numbers(every[k].law, 1000, 1e-3, d, number, solid, numbers);
        silt_drag_group(every[k].law, (const double(*)[DRAG_GROUP])numbers, square, factor);
        for (int i = 0; i < DRAG_GROUP; i++)
            near(factor[i] / (number[i] * silt_drag_factor(every[k].law, 1000, 1e-3, d[i], solid[i], sqrt(square[i]))), 1, 1e-14,
                 every[k].name);
    }
}

static double rest(silt_drag_law law, double solid) {
    return silt_drag_factor(law, 1000, 1e-3, 1e-3, solid, 0) / (3 * M_PI * 1e-3 * 1e-3);
}

static void test_limits(void **unused) {
    (void)unused;
    // alone and at rest: Stokes; Di Felice has 4.8^2/24 of it, Ergun no such limit
    near(rest(DRAG_STOKES, 0), 1, 1e-14, "Stokes");
    near(rest(DRAG_SCHILLER_NAUMANN, 0), 1, 1e-14, "Schiller-Naumann alone");
    near(rest(DRAG_ABRAHAM, 0), 1, 1e-14, "Abraham alone");
    near(rest(DRAG_DI_FELICE, 0), 0.96, 1e-14, "Di Felice alone");
    near(rest(DRAG_WEN_YU, 0), 1, 1e-14, "Wen-Yu alone");
    near(rest(DRAG_GIDASPOW, 0), 1, 1e-14, "Gidaspow alone");
    near(rest(DRAG_KOCH_HILL, 0), 1, 1e-14, "Koch-Hill alone");
    near(rest(DRAG_BEETSTRA, 0), 1, 1e-14, "Beetstra alone");
    near(rest(DRAG_ERGUN, 0), 0, 1e-14, "Ergun alone");
    // packed and at rest: Kozeny and Carman, 2 k p/(e 36) of Stokes with k = 180 for theory, 150 for Ergun
    const double p = 0.6, e = 0.4, carman = 10 * p / e;
    near(rest(DRAG_KOCH_HILL, p) / carman, 1, 1e-14, "Koch-Hill packed");
    near(rest(DRAG_BEETSTRA, p) / carman, 1 + pow(e, 4) * (1 + 1.5 * sqrt(p)) / (10 * p), 1e-13, "Beetstra packed");
    near(rest(DRAG_ERGUN, p) / carman, 150.0 / 180, 1e-14, "Ergun packed");
    near(rest(DRAG_GIDASPOW, p) / carman, 150.0 / 180, 1e-14, "Gidaspow packed");
    near(rest(DRAG_WEN_YU, p), pow(e, -2.65), 1e-12, "Wen-Yu packed");
    near(rest(DRAG_DI_FELICE, p), 0.96 * pow(e, 1 - 3.7), 1e-11, "Di Felice packed");
    // both come from the same kind of simulations of spheres between: Beetstra et al. are 3 to 12 % above
    for (int k = 1; k <= 5; k++)
        assert_true(fabs(rest(DRAG_BEETSTRA, 0.1 * k) / rest(DRAG_KOCH_HILL, 0.1 * k) - 1) < 0.13);
    // Gidaspow's law jumps where it says so, and nowhere else
    assert_true(fabs(rest(DRAG_GIDASPOW, 0.2 + 1e-9) / rest(DRAG_GIDASPOW, 0.2 - 1e-9) - 1) > 0.05);
    for (int k = 0; k < N_LAW; k++) {
        // denser than any packing counts as 0.75, less than nothing as nothing
        near(silt_drag_factor(every[k].law, 1000, 1e-3, 1e-3, 1.3, 1), silt_drag_factor(every[k].law, 1000, 1e-3, 1e-3, 0.75, 1), 0,
             every[k].name);
        near(silt_drag_factor(every[k].law, 1000, 1e-3, 1e-3, -0.2, 1), silt_drag_factor(every[k].law, 1000, 1e-3, 1e-3, 0, 1), 0,
             every[k].name);
        // rest is where slowness leads to
        for (double solid = 0; solid < 0.8; solid += 0.19)
            for (double w = 1e-160; w < 1e-14; w *= 1e6) {
                const double slow = silt_drag_factor(every[k].law, 1000, 1e-3, 1e-3, solid, w);
                assert_true(isfinite(slow));
                near(slow / (3 * M_PI * 1e-6), rest(every[k].law, solid), 1e-5 * rest(every[k].law, solid) + 1e-13, every[k].name);
            }
    }
}

// the force grows with the speed, whatever the porosity
static void test_monotone(void **unused) {
    (void)unused;
    for (int k = 0; k < N_LAW; k++)
        for (double solid = 0.01; solid < 0.7; solid += 0.05) {
            double before = 0;
            for (double w = 1e-7; w < 30; w *= 1.01) {
                const double force = w * silt_drag_factor(every[k].law, 1000, 1e-3, 1e-3, solid, w);
                if (!(force > before))
                    fail_msg("%s at a solid fraction of %g: force %g at %g m/s, %g before", every[k].name, solid, force, w, before);
                before = force;
            }
        }
}

// ---------------------------------------------------------------- balance with weight

// relative velocity w at which a law carries `weight` per grain
static double balance(silt_drag_law law, double rho, double mu, double d, double solid, double weight) {
    double low = 0, high = 100;
    for (int k = 0; k < 200; k++) {
        const double w = 0.5 * (low + high);
        *(w * silt_drag_factor(law, rho, mu, d, solid, w) < weight ? &low : &high) = w;
    }
    return 0.5 * (low + high);
}

static double submerged(double d, double rho_s, double rho) {
    return M_PI / 6 * d * d * d * (rho_s - rho) * 9.81;
}

static void test_published_velocities(void **unused) {
    (void)unused;
    // ten Cate, Nieuwstad, Derksen, Van den Akker, Phys. Fluids 14 (2002), 4012: u_inf of a nylon sphere of 15 mm, 1120 kg/m3
    const double cate[4][3] = {{970, 0.373, 0.038}, {965, 0.212, 0.060}, {962, 0.113, 0.091}, {960, 0.058, 0.128}};
    for (int k = 0; k < 4; k++) {
        const double v = balance(DRAG_ABRAHAM, cate[k][0], cate[k][1], 0.015, 0, submerged(0.015, 1120, cate[k][0]));
        print_message("ten Cate E%d: %.5f m/s, %+.2f %%\n", k + 1, v, 100 * (v / cate[k][2] - 1));
        near(v / cate[k][2], 1, 0.01, "ten Cate's u_inf");
    }
    // Mordant and Pinton, Eur. Phys. J. B 18 (2000), 343
    const double mordant[3][3] = {{1.5e-3, 2560, 0.218}, {0.8e-3, 7710, 0.316}, {0.5e-3, 2560, 0.0741}};
    for (int k = 0; k < 3; k++) {
        const double v = balance(DRAG_SCHILLER_NAUMANN, 1000, 0.9e-3, mordant[k][0], 0, submerged(mordant[k][0], mordant[k][1], 1000));
        print_message("Mordant %.1f mm: %.5f m/s, %+.2f %%\n", 1e3 * mordant[k][0], v, 100 * (v / mordant[k][2] - 1));
        near(v / mordant[k][2], 1, k < 2 ? 0.01 : 0.06, "Mordant and Pinton");
    }
    // minimum fluidisation by Ergun: the pressure's gradient in model A, beta w/eps, is the submerged weight: F = eps weight;
    // U = eps w. d, rho_s, rho, mu, eps, U; the last digit of the table counts
    const double onset[5][6] = {{.5e-3, 2500, 1000, 1e-3, .4, .00255},
                                {1e-3, 2650, 1000, 1e-3, .4, .00969},
                                {2e-3, 2650, 1000, 1e-3, .4, .02387},
                                {1e-3, 2000, 10, 1.5e-4, .4513, .12370},
                                {1e-3, 2650, 1000, 1e-3, .4, .00969}};
    for (int k = 0; k < 5; k++) {
        const double *o = onset[k], e = o[4];
        const double w = balance(k < 4 ? DRAG_ERGUN : DRAG_GIDASPOW, o[2], o[3], o[0], 1 - e, e * submerged(o[0], o[1], o[2]));
        near(e * w / o[5], 1, 0.003, "onset of fluidisation");
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_laws),     cmocka_unit_test(test_groups),
        cmocka_unit_test(test_limits),   cmocka_unit_test(test_monotone),
        cmocka_unit_test(test_published_velocities),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
