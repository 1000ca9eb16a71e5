// many grains in water, by whole runs of scenes written here: a lattice of grains across a narrow tank, so that all is one-dimensional
// and exact: hindered settling, a fixed bed, a fluidised one, the pressure that a suspension carries
#include "run.h"

#include <setjmp.h>
#include <stdarg.h>
#include <unistd.h>

#include <cmocka.h>

#include "check.h"

// ---------------------------------------------------------------- scenes and what they leave

typedef struct suspension {
    const char *law;
    double d, density, viscosity, porosity; // water of 1000 kg/m3
    double inflow;    // m/s, from below; the grains stand
    double end, step; // s
    int rows;
    double spacing;   // d
    int across;       // grains
} suspension;

static const double mesh_size = 2; // d

// grains on squares of side a, half of that from walls and floor; the accounting width makes the porosity: pi/6 d^3/(width a^2)
static void suspension_write(const suspension *s, const char *path) {
    const double a = s->spacing * s->d, h = mesh_size * s->d, across = s->across, width = M_PI / 6 * s->d * s->d * s->d / ((1 - s->porosity) * a * a);
    const bool stands = s->inflow > 0;
    const double floor = stands ? 3 * h : 0, roof = floor + s->rows * a, top = roof + (stands ? 3 * h : 0);
    FILE *to = fopen(path, "w");
    assert_non_null(to);
    fprintf(to, "silt: 1\ntitle: suspension\ndimension: 2\ntime: {end: %.17g, output: %.17g, step: %.17g}\ngravity: [0, -9.81]\n", s->end,
            s->end, s->step);
    fprintf(to, "fluid:\n  density: 1000\n  viscosity: %.17g\n  flow: laminar\n  theta: %g\n  size: %.17g\n  regions:\n", s->viscosity,
            stands ? 1 : 0.55, h); // what starts with a jerk rings on at 0.55
    fprintf(to, "    - box: [[0, 0], [%.17g, %.17g]]\n", across * a, top);
    if (stands)
        fprintf(to, "  inlets:\n    - {name: below, from: [0, 0], to: [%.17g, 0], velocity: [0, %.17g]}\n", across * a, s->inflow);
    const double rim = stands ? top + 9 * h : top;
    fprintf(to, "walls:\n  - polyline: [[0, %.17g], [0, 0], [%.17g, 0], [%.17g, %.17g]", rim, across * a, across * a, rim);
    if (!stands) // closed
        fprintf(to, ", [0, %.17g]", rim);
    fprintf(to, "]\n    condition: slip\n");
    fprintf(to, "grains:\n  drag: %s\n  width: %.17g\n  kernel: %.17g\n  list:\n", s->law, width, (stands ? 3 : 2) * h);
    for (int j = 0; j < s->rows; j++)
        for (int i = 0; i < across; i++)
            fprintf(to, "    - {at: [%.17g, %.17g], diameter: %.17g, density: %.17g%s}\n", (i + 0.5) * a, floor + (j + 0.5) * a, s->d,
                    s->density, stands ? ", fixed: true" : "");
    fprintf(to, "contact: {youngs_modulus: 5.0e6, poissons_ratio: 0.3, restitution: 0.5, friction: 0.4, rolling_friction: 0}\n");
    fprintf(to, "gauges:\n  - {name: middle, grains_in: [[0, %.17g], [%.17g, %.17g]]}\n", floor + (s->rows / 3) * a, across * a,
            floor + (2 * s->rows / 3) * a);
    fprintf(to, "  - {name: low, pressure_at: [%.17g, %.17g]}\n  - {name: high, pressure_at: [%.17g, %.17g]}\n", 0.47 * across * a,
            floor + (s->rows / 3) * a, 0.47 * across * a, floor + (2 * s->rows / 3) * a);
    fclose(to);
}

// a column's last value in OUT/history.csv
static double last(const char *out, const char *name) {
    char *path = silt_text("%s/history.csv", out), *line = NULL;
    size_t size = 0;
    double value = NAN;
    int place = -1, row = 0;
    FILE *from = fopen(path, "r");
    assert_non_null(from);
    for (; getline(&line, &size, from) > 0; row++) {
        int i = 0;
        for (const char *at = line; at; at = strchr(at, ','), at = at ? at + 1 : NULL, i++) {
            if (row == 0 && strncmp(at, name, strlen(name)) == 0 && strchr(",\n", at[strlen(name)]))
                place = i;
            if (row > 0 && i == place)
                value = strtod(at, NULL);
        }
    }
    fclose(from);
    free(line);
    free(path);
    assert_true(place >= 0);
    return value;
}

static const char out[] = "test_suspension.out";

static void suspension_run(const suspension *s) {
    const char *const path = SILT_BINARY "/test_suspension.yaml";
    silt_scene *scene = NULL;
    suspension_write(s, path);
    OK(silt_scene_read(path, 0, NULL, &scene, &error));
    const silt_run_def def = {.out = out, .worker = SILT_BINARY "/silt-dem", .quiet = true, .force = true};
    OK(silt_scene_run(scene, &def, &error));
    silt_scene_free(&scene);
    near(last(out, "momentum_error"), 0, 1e-9, "momentum_error");
}

// ---------------------------------------------------------------- the laws as printed: force of one grain over its relative velocity

static double cd(double re) {
    return re < 1000 ? 24 / re * (1 + 0.15 * pow(re, 0.687)) : 0.44;
}

// d, viscosity and porosity of the suspension; water of 1000 kg/m3
static double law(const suspension *s, double w) {
    const double rho = 1000, mu = s->viscosity, d = s->d, e = s->porosity, p = 1 - e, re = rho * w * d / mu, stokes = 3 * M_PI * mu * d;
    const double area = M_PI / 8 * d * d * rho * w, volume = M_PI / 6 * d * d * d;
    const double ergun = volume * (150 * p * mu / (e * d * d) + 1.75 * rho * w / d);
    const double wen_yu = volume * 0.75 * cd(e * re) * e * rho * w / d * pow(e, -2.65);
    if (strcmp(s->law, "stokes") == 0)
        return stokes;
    if (strcmp(s->law, "schiller-naumann") == 0)
        return cd(re) * area;
    if (strcmp(s->law, "abraham") == 0)
        return 24 / pow(9.06, 2) * pow(9.06 / sqrt(re) + 1, 2) * area;
    if (strcmp(s->law, "di-felice") == 0)
        return pow(0.63 + 4.8 / sqrt(e * re), 2) * area * pow(e, 2 - 3.7 + 0.65 * exp(-pow(1.5 - log10(e * re), 2) / 2));
    if (strcmp(s->law, "ergun") == 0)
        return ergun;
    if (strcmp(s->law, "wen-yu") == 0)
        return wen_yu;
    if (strcmp(s->law, "gidaspow") == 0)
        return e < 0.8 ? ergun : wen_yu;
    if (strcmp(s->law, "koch-hill") == 0) {
        const double loose = (1 + 3 * sqrt(p / 2) + 135.0 / 64 * p * log(p) + 16.14 * p) / (1 + 0.681 * p - 8.48 * p * p + 8.16 * p * p * p);
        return stokes * e * e * ((p < 0.4 ? loose : 10 * p / pow(e, 3)) + (0.0673 + 0.212 * p + 0.0232 / pow(e, 5)) * e * re / 2);
    }
    assert_string_equal(s->law, "beetstra");
    return stokes * e *
           (10 * p / (e * e) + e * e * (1 + 1.5 * sqrt(p)) +
            0.413 * e * re / (24 * e * e) * (1 / e + 3 * e * p + 8.4 * pow(e * re, -0.343)) /
                (1 + pow(10, 3 * p) * pow(e * re, -(1 + 4 * p) / 2)));
}

// relative velocity at which drag carries `weight`
static double balance(const suspension *s, double weight) {
    double low = 0, high = 10;
    for (int k = 0; k < 100; k++) {
        const double w = 0.5 * (low + high);
        *(w * law(s, w) < weight ? &low : &high) = w;
    }
    return 0.5 * (low + high);
}

static double submerged(const suspension *s) {
    return M_PI / 6 * s->d * s->d * s->d * (s->density - 1000) * 9.81;
}

// ---------------------------------------------------------------- hindered settling

static const char *const laws[] = {"stokes",    "schiller-naumann", "abraham",  "di-felice", "ergun",
                                   "wen-yu", "gidaspow",         "koch-hill", "beetstra"};

// Closed tank: what sinks pushes water up, v = eps w; the drag of model A carries eps of the submerged weight, the pressure the rest:
// that of the water alone and (1 - eps)(rho_s - rho) g for every metre
static double settle(suspension *s) {
    const double v = s->porosity * balance(s, s->porosity * submerged(s)), g = 9.81 * (1 - 1000 / s->density);
    s->end = silt_max(8 * v / g, 0.05 * s->spacing * s->d / v); // a pressure is known to rounding over the step
    // so high that the middle hears of neither end
    s->rows = 30 + 3 * (int)ceil(s->end * v / (s->spacing * s->d));
    const double height = s->rows / 3 * s->spacing * s->d;
    s->step = s->end / 50;
    suspension_run(s);
    const double found = -last(out, "middle_y"), drop = last(out, "low") - last(out, "high");
    const double excess = (drop - 9810 * height) / ((1 - s->porosity) * (s->density - 1000) * 9.81 * height);
    print_message("%-16s eps %.2f Re %8.3g: %.5g m/s, %+.2f %% of the root, pressure excess %+.2f %%\n", s->law, s->porosity,
                  1000 * v / s->porosity * s->d / s->viscosity, found, 100 * (found / v - 1), 100 * (excess - 1));
    near(found / v, 1, 0.01, "hindered settling over the law's own root");
    near(excess, 1, 0.02, "pressure excess");
    return found;
}

static void test_hindered_settling(void **unused) {
    (void)unused;
    for (size_t k = 0; k < sizeof laws / sizeof *laws; k++) {
        suspension s = {.law = laws[k], .d = 2e-4, .density = 2650, .viscosity = 1e-3, .porosity = 0.7, .spacing = 2, .across = 4};
        settle(&s);
    }
    // Di Felice against Richardson and Zaki, v_t eps^n with v_t of the same law
    const double size[3] = {5e-5, 1e-3, 5e-3}, porosity[3] = {0.6, 0.8, 0.95};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            suspension s = {.law = "di-felice", .d = size[i], .density = 2650, .viscosity = 1e-3, .porosity = 1, .spacing = 2, .across = 4};
            const double terminal = balance(&s, submerged(&s)), re = 1000 * terminal * s.d / 1e-3;
            const double n = re < 0.2 ? 4.65 : re < 1 ? 4.35 * pow(re, -0.03) : re < 500 ? 4.45 * pow(re, -0.1) : 2.39;
            s.porosity = porosity[k];
            const double ratio = settle(&s) / (terminal * pow(porosity[k], n));
            print_message("  %+.1f %% of Richardson and Zaki\n", 100 * (ratio - 1));
            near(ratio, 1, 0.07, "Richardson and Zaki");
        }
}

// ---------------------------------------------------------------- a fixed bed

// U through grains that are held: dp/L = beta w/eps, Ergun: 150 mu (1 - eps)^2 U/(eps^3 d^2) + 1.75 rho (1 - eps) U^2/(eps^3 d)
static void test_fixed_bed(void **unused) {
    (void)unused;
    const double flow[3] = {1e-3, 1e-2, 0.1};
    for (size_t k = 0; k < sizeof laws / sizeof *laws; k++)
        for (int i = 0; i < 3; i++) {
            suspension s = {.law = laws[k], .d = 1e-3, .density = 2650, .viscosity = 1e-3, .porosity = 0.4, .rows = 90, .spacing = 1,
                            .across = 8, .inflow = flow[i]};
            if (strcmp(laws[k], "ergun") != 0 && i != 1)
                continue;
            const double e = s.porosity, p = 1 - e, u = flow[i], d = s.d;
            double expected = p / (M_PI / 6 * d * d * d) * law(&s, u / e) * u / e / e;
            if (strcmp(laws[k], "ergun") == 0) {
                const double printed = 150 * 1e-3 * p * p * u / (e * e * e * d * d) + 1.75 * 1000 * p * u * u / (e * e * e * d);
                near(expected / printed, 1, 1e-12, "Ergun's equation as printed");
                expected = printed;
            }
            // until the jerk of the start is forgotten
            s.step = 0.05 * 2e-3 * e / u;
            s.end = 14 * s.step;
            suspension_run(&s);
            const double height = 30 * s.spacing * d, drop = (last(out, "low") - last(out, "high")) / height - 9810;
            print_message("%-16s U %.0e m/s: %.5g Pa/m, %+.2f %%\n", s.law, u, drop, 100 * (drop / expected - 1));
            near(drop / expected, 1, 0.02, "pressure drop of a fixed bed");
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_hindered_settling),
        cmocka_unit_test(test_fixed_bed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
