// exact answers by whole runs, coarse enough for every day: still and thrown water, drops, spinning water, standing waves,
// vortices; fields are held against their formulas where the checks of a scene cannot
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "check.h"
#include "run.h"

#include <unistd.h>

#include <dirent.h>
#include <sys/stat.h>

// ---------------------------------------------------------------- runs

/** a scene on its way, in a folder of its own */
typedef struct bench {
    silt_run run;
    silt_scene *scene;
    char folder[512];
    double fastest; // m/s, of any node at the end of any step
} bench;

static void bench_start(bench *b, const char *path, int n_set, const char *const *set) {
    *b = (bench){0};
    silt_run_def def = {.quiet = true};
    char *full = silt_text("%s/%s", SILT_SOURCE, path);
    OK(silt_scene_read(full, n_set, set, &b->scene, &error));
    free(full);
    snprintf(b->folder, sizeof b->folder, "%s/tests/exact-XXXXXX", SILT_BINARY);
    assert_non_null(mkdtemp(b->folder));
    OK(silt_run_open(&b->run, b->scene, &def, b->folder, -1, &error));
}

static void bench_step(bench *b) {
    OK(silt_run_advance(&b->run, &error));
    b->fastest = silt_max(b->fastest, b->run.ledger.max_speed);
}

static void bench_until(bench *b, double time) {
    while (b->run.time < time * (1 - 1e-9))
        bench_step(b);
}

static void bench_end(bench *b) {
    silt_run_free(&b->run);
    silt_scene_free(&b->scene);
    DIR *list = opendir(b->folder);
    for (struct dirent *entry; list && (entry = readdir(list));)
        if (entry->d_name[0] != '.')
            unlinkat(dirfd(list), entry->d_name, 0);
    closedir(list);
    rmdir(b->folder);
}

// ---------------------------------------------------------------- integrals over the water

/** a quantity at a point: place, velocity, pressure there, and whatever it needs to know */
typedef double field(const double x[2], const double v[2], double p, const void *context);

// sum over the cells by the rule of the three midpoints of the edges, exact for squares of P1 fields
static double integral(const bench *b, field *of, const void *context) {
    const silt_nodes *nodes = &b->run.nodes;
    double sum = 0;
    for (int e = 0; e < b->run.mesh.n_cell; e++) {
        const int *cell = b->run.mesh.cell[e];
        const double area = silt_cell_area(nodes->x, cell);
        for (int a = 0; a < 3; a++) {
            const int i = cell[a], j = cell[(a + 1) % 3];
            double x[2], v[2];
            for (int d = 0; d < 2; d++) {
                x[d] = 0.5 * (nodes->x[2 * i + d] + nodes->x[2 * j + d]);
                v[d] = 0.5 * (nodes->v[2 * i + d] + nodes->v[2 * j + d]);
            }
            sum += area / 3 * of(x, v, 0.5 * (nodes->p[i] + nodes->p[j]), context);
        }
    }
    return sum;
}

static double one(const double x[2], const double v[2], double p, const void *context) {
    (void)x, (void)v, (void)p, (void)context;
    return 1;
}

static double square_of(const double x[2], const double v[2], double p, const void *context) {
    (void)v, (void)p;
    return silt_square(x[*(const int *)context]);
}

static double pressure_of(const double x[2], const double v[2], double p, const void *context) {
    (void)x, (void)v, (void)context;
    return p;
}

static double spin_of(const double x[2], const double v[2], double p, const void *context) {
    (void)p, (void)context;
    return x[0] * v[1] - x[1] * v[0];
}

// semi-axis of an ellipse of the same second moment
static double axis(const bench *b, int d) { return 2 * sqrt(integral(b, square_of, &d) / integral(b, one, NULL)); }

// pressure at a point of the water
static double pressure_at(const bench *b, const double point[2]) {
    double weight[4] = {0}, p = 0;
    const int e = silt_locate(&b->run.locator, &b->run.mesh, b->run.nodes.x, point, weight);
    assert_true(e >= 0);
    for (int a = 0; a < 3; a++)
        p += weight[a] * b->run.nodes.p[b->run.mesh.cell[e][a]];
    return p;
}

// largest area that free edges go round from inside: a hole in the water. Where two loops touch in a node either may go on.
static double largest_hole(const bench *b) {
    const silt_mesh *mesh = &b->run.mesh;
    const double *x = b->run.nodes.x;
    uint8_t *done = silt_alloc((size_t)mesh->n_facet + 1, 1);
    double largest = 0;
    for (int first = 0; first < mesh->n_facet; first++) {
        double area = 0;
        for (int k = first; k >= 0 && !done[k];) {
            const int from = mesh->facet[k][0], to = mesh->facet[k][1];
            area += 0.5 * (x[2 * from] * x[2 * to + 1] - x[2 * to] * x[2 * from + 1]);
            done[k] = 1;
            int next = -1;
            for (int m = 0; m < mesh->n_facet && to != mesh->facet[first][0] && next < 0; m++)
                if (!done[m] && mesh->facet[m][0] == to)
                    next = m;
            k = next;
        }
        largest = silt_max(largest, -area);
    }
    free(done);
    return largest;
}

// ---------------------------------------------------------------- water at rest, water in flight

static void test_rest(void **state) {
    (void)state;
    // no pressure to start from: the first step finds it
    const char *const tight[] = {"fluid.tolerance=1e-12"};
    bench b;
    bench_start(&b, "tests/exact/tilted.yaml", 1, tight);
    bench_until(&b, 2);
    near(b.fastest / sqrt(9.81 * 0.5), 0, 1e-8, "speed in the tilted tank at tolerance 1e-12");
    near(b.run.ledger.volume_error, 0, 1e-10, "its volume");
    for (int i = 0; i < b.run.nodes.count; i++)
        if (b.run.mesh.wet[i])
            near(b.run.nodes.p[i], 9810 * (0.5 - b.run.nodes.x[2 * i + 1]), 1e-6, "its pressure");
    bench_end(&b);

    // a tank that is accelerated by g/4, in its own frame: the surface leans by as much
    const char *const leaning[] = {"fluid.tolerance=1e-12", "gravity=[-2.4525, -9.81]", "walls.0.polyline=[[0, 1], [0, 0], [1, 0], [1, 1]]",
                                   "fluid.regions.0.polygon=[[0, 0], [1, 0], [1, 0.375], [0, 0.625]]"};
    bench_start(&b, "tests/exact/tilted.yaml", 4, leaning);
    bench_until(&b, 2);
    near(b.fastest / sqrt(9.81 * 0.5), 0, 1e-8, "speed in the accelerated tank");
    for (int i = 0; i < b.run.nodes.count; i++)
        if (b.run.mesh.wet[i])
            near(b.run.nodes.p[i], 9810 * (0.625 - 0.25 * b.run.nodes.x[2 * i] - b.run.nodes.x[2 * i + 1]), 1e-6, "its pressure");
    bench_end(&b);
}

// height of the surface of water that turns with its tank at 2 rad/s
static double parabola(const double *x) { return 0.44 + 2 / 9.81 * (silt_square(x[0]) + silt_square(x[1])); }

// the parabola of a turning tank, in its own frame: the box that the scene fills is bent to it, whatever cells that makes
static void test_turning(void **state) {
    (void)state;
    bench b;
    bench_start(&b, "tests/exact/turning.yaml", 0, NULL);
    silt_nodes *nodes = &b.run.nodes;
    for (int i = 0; i < nodes->count; i++)
        nodes->x[3 * i + 2] *= parabola(nodes->x + 3 * i) / 0.5;
    bench_until(&b, 1);
    near(b.fastest / sqrt(9.81 * 0.5), 0, 1e-8, "speed in the turning tank at tolerance 1e-12");
    int on_surface = 0;
    for (int i = 0; i < nodes->count; i++)
        if (b.run.mesh.wet[i]) {
            near(nodes->p[i], 9810 * (parabola(nodes->x + 3 * i) - nodes->x[3 * i + 2]), 1e-5, "its pressure");
            on_surface += b.run.mesh.surface[i];
        }
    assert_int_equal(on_surface, 64);
    bench_end(&b);

    // a drop that turns at half the speed of the central field that holds it: a steady circle, p = rho (1 - 1/4) (1 - r^2)/2
    const char *const drop[] = {"fluid.velocity={formula: solid-rotation, rate: 0.5}", "fluid.size=0.08"};
    bench_start(&b, "cases/oscillating-drop/scene.yaml", 2, drop);
    const double centre[2] = {0, 0}, spin = integral(&b, spin_of, NULL), area = integral(&b, one, NULL);
    bench_until(&b, 12.57);
    print_message("turning drop after a turn: axes %+.3f, %+.3f %%, area %+.3f %%, spin %+.3f %%, pressure %+.2f %%\n", 100 * (axis(&b, 0) - 1),
                  100 * (axis(&b, 1) - 1), 100 * (integral(&b, one, NULL) / area - 1), 100 * (integral(&b, spin_of, NULL) / spin - 1),
                  100 * (pressure_at(&b, centre) / 375 - 1));
    near(axis(&b, 0), 1, 0.005, "width of a turning drop");
    near(axis(&b, 1), 1, 0.005, "its height");
    near(integral(&b, one, NULL), area, 0.001 * area, "area of a turning drop");
    near(integral(&b, spin_of, NULL), spin, 0.005 * spin, "its spin");
    near(pressure_at(&b, centre), 375, 4, "its pressure");
    bench_end(&b);
}

static void test_thrown(void **state) {
    (void)state;
    bench b;
    bench_start(&b, "tests/exact/thrown.yaml", 0, NULL);
    const silt_nodes *nodes = &b.run.nodes;
    const int n = nodes->count;
    const int64_t last = nodes->next_id;
    double *x = silt_alloc(2 * (size_t)last, sizeof *x), *v = silt_alloc(2 * (size_t)last, sizeof *v);
    for (int i = 0; i < n; i++)
        for (int d = 0; d < 2; d++) {
            x[2 * nodes->id[i] + d] = nodes->x[2 * i + d];
            v[2 * nodes->id[i] + d] = nodes->v[2 * i + d];
        }
    bench_until(&b, 1);
    int met = 0;
    for (int i = 0; i < nodes->count; i++) {
        if (nodes->id[i] >= last)
            continue;
        met++;
        for (int d = 0; d < 2; d++) {
            const double g = d ? -9.81 : 0, x0 = x[2 * nodes->id[i] + d], v0 = v[2 * nodes->id[i] + d];
            near(nodes->x[2 * i + d], x0 + v0 + 0.5 * g, 1e-8, "place of a thrown node after a second");
            near(nodes->v[2 * i + d], v0 + g, 1e-8, "its velocity");
        }
        near(nodes->p[i], 0, 1e-5, "its pressure");
    }
    assert_true(met > 0.9 * n);
    near(b.run.ledger.volume_error, 0, 1e-9, "volume of the block");
    free(x);
    free(v);
    bench_end(&b);
}

// ---------------------------------------------------------------- drops

// semi-axes and rate of the elliptic drop by the classical method of Runge and Kutta, `field` the central force's Omega; it
// starts as a circle of radius 1 with u = -rate x, v = rate y
static void ellipse(double rate, double omega, double time, double out[3]) {
    double y[3] = {1, 1, rate};
    const int n = 2000;
    for (int k = 0; k < n; k++) {
        double slope[4][3], at[3];
        for (int stage = 0; stage < 4; stage++) {
            const double step = (stage == 0 ? 0 : stage == 3 ? 1 : 0.5) * time / n;
            for (int c = 0; c < 3; c++)
                at[c] = y[c] + (stage ? step * slope[stage - 1][c] : 0);
            slope[stage][0] = -at[0] * at[2];
            slope[stage][1] = at[1] * at[2];
            slope[stage][2] = (at[2] * at[2] + omega * omega) * (at[0] * at[0] - at[1] * at[1]) / (at[0] * at[0] + at[1] * at[1]);
        }
        for (int c = 0; c < 3; c++)
            y[c] += time / n / 6 * (slope[0][c] + 2 * slope[1][c] + 2 * slope[2][c] + slope[3][c]);
    }
    memcpy(out, y, sizeof y);
}

/** exact drop at a time: semi-axes and pressure in the centre */
typedef struct drop_exact {
    double a, b, p;
} drop_exact;

static double drop_pressure(const drop_exact *drop, const double x[2]) {
    return drop->p * (1 - silt_square(x[0] / drop->a) - silt_square(x[1] / drop->b));
}

static double drop_pressure_error(const double x[2], const double v[2], double p, const void *context) {
    (void)v;
    return silt_square(p - drop_pressure(context, x));
}

static double drop_pressure_square(const double x[2], const double v[2], double p, const void *context) {
    (void)v, (void)p;
    return silt_square(drop_pressure(context, x));
}

static void test_elliptic_drop(void **state) {
    (void)state;
    bench b;
    double y[3];
    bench_start(&b, "cases/elliptic-drop/scene.yaml", 0, NULL);
    bench_step(&b);
    near(pressure_at(&b, (double[2]){0, 0}) / 1000, 0.5, 0.005, "first pressure in the elliptic drop");
    bench_until(&b, 0.8);
    ellipse(1, 0, 0.8, y);
    near(y[0], 0.500175, 1e-6, "the table's semi-axis");
    near(axis(&b, 0) / y[0], 1, 0.005, "semi-axis a of the drop");
    near(axis(&b, 1) / y[1], 1, 0.005, "semi-axis b of the drop");
    near(integral(&b, one, NULL) / M_PI, 1, 0.001, "area of the drop");
    near(b.run.ledger.kinetic_energy / 785.398, 1, 0.003, "energy of the drop");
    // clean pressures, not only in the centre
    const drop_exact drop = {y[0], y[1], 1000 * silt_square(y[2] * y[0] * y[1]) / (y[0] * y[0] + y[1] * y[1])};
    const double wrong = sqrt(integral(&b, drop_pressure_error, &drop) / integral(&b, drop_pressure_square, &drop));
    print_message("elliptic drop: a %+.3f %%, b %+.3f %%, area %+.3f %%, pressure %.2f %%\n", 100 * (axis(&b, 0) / y[0] - 1),
                  100 * (axis(&b, 1) / y[1] - 1), 100 * (integral(&b, one, NULL) / M_PI - 1), 100 * wrong);
    near(wrong, 0, 0.04, "pressure of the drop, L2");
    bench_end(&b);

    // with no correction of the volume: what remeshing does
    bench_start(&b, "cases/elliptic-drop/scene.yaml", 1, (const char *const[]){"fluid.volume_control=false"});
    bench_until(&b, 0.8);
    near(b.run.ledger.volume_error, 0, 0.002, "area of the drop that remeshing changed");
    bench_end(&b);
}

static void test_oscillating_drop(void **state) {
    (void)state;
    // a period and a half at half the case's fineness, by the second moments
    bench b;
    double y[3];
    bench_start(&b, "cases/oscillating-drop/scene.yaml", 2, (const char *const[]){"fluid.size=0.08", "time.output=1"});
    for (double t = 1; t < 7.5; t++) {
        bench_until(&b, t);
        ellipse(-1, 1, t, y);
        near(axis(&b, 0), y[0], 0.02, "semi-axis of the oscillating drop");
        near(axis(&b, 1), y[1], 0.02, "its other semi-axis");
    }
    near(integral(&b, one, NULL) / M_PI, 1, 0.002, "its area");
    bench_end(&b);
}

// forces of the surface's tension: they balance, and their work when the drop grows is that of its surface
static void tension_balance(const bench *b, double tension) {
    const silt_mesh *mesh = &b->run.mesh;
    const int dim = b->scene->dimension;
    const double *x = b->run.nodes.x;
    double *force = silt_alloc((size_t)(dim * mesh->n_node), sizeof *force), sum[3] = {0}, work = 0, area = 0;
    silt_tension_force(mesh, x, tension, force);
    for (int i = 0; i < mesh->n_node; i++)
        for (int d = 0; d < dim; d++) {
            sum[d] += force[dim * i + d];
            work += force[dim * i + d] * x[dim * i + d];
        }
    for (int k = 0; k < mesh->n_facet; k++) {
        double u[3] = {0}, v[3] = {0}, n[3];
        for (int d = 0; d < dim; d++) {
            u[d] = x[dim * mesh->facet[k][1] + d] - x[dim * mesh->facet[k][0] + d];
            v[d] = dim == 3 ? x[3 * mesh->facet[k][2] + d] - x[3 * mesh->facet[k][0] + d] : 0;
        }
        for (int d = 0; d < 3; d++)
            n[d] = u[(d + 1) % 3] * v[(d + 2) % 3] - u[(d + 2) % 3] * v[(d + 1) % 3];
        area += dim == 3 ? silt_length(3, n) / 2 : silt_length(2, u);
    }
    // a drop twice as large has (dim - 1)-th power of two as much surface
    near(work / (-(dim - 1) * tension * area), 1, 1e-12, "work of the surface's tension");
    near(silt_length(3, sum) / (tension * area), 0, 1e-12, "sum of the surface's tension");
    free(force);
}

static void test_tension(void **state) {
    (void)state;
    // Rayleigh 1879: a flat drop swings with sqrt(6 tension/(density R^3)) = 1, pressure tension/R in the mean
    bench b;
    bench_start(&b, "cases/oscillating-drop/scene-tension.yaml", 2, (const char *const[]){"fluid.size=0.1", "time.output=0.3141593"});
    tension_balance(&b, 166.66667);
    double sum = 0, time = 0, crossing = 0, least = 2, most = 0, before = 0;
    while (b.run.time < 2.2 * M_PI) {
        bench_step(&b);
        if (b.run.time < 2 * M_PI) {
            sum += b.run.dt * pressure_at(&b, (double[2]){0, 0});
            time += b.run.dt;
        }
        // wider than high or not: turns at pi and 2 pi
        const double now = axis(&b, 0) - axis(&b, 1);
        if (before < 0 && now >= 0)
            crossing = b.run.time - b.run.dt * now / (now - before);
        before = now;
        least = silt_min(least, axis(&b, 0));
        most = silt_max(most, axis(&b, 0));
    }
    print_message("drop of tension: period %+.3f %%, swing %.4f %.4f, pressure %+.3f %%\n", 100 * (crossing / (2 * M_PI) - 1),
                  most, least, 100 * (sum / time / 166.66667 - 1));
    near(crossing / (2 * M_PI), 1, 0.01, "period of a drop under surface tension");
    near(most, 1.05, 0.002, "its widest");
    near(least, 0.95, 0.003, "its slimmest");
    near(sum / time / 166.66667, 1, 0.01, "its pressure");
    near(integral(&b, one, NULL) / M_PI, 1, 0.002, "its area");
    bench_end(&b);

    // a sphere at rest: pressure 2 tension/R
    bench_start(&b, "tests/scenes/tension-sphere.yaml", 0, NULL);
    tension_balance(&b, 100);
    bench_step(&b);
    double pressure = 0, volume = 0;
    for (int i = 0; i < b.run.mesh.n_node; i++) {
        const double part = b.run.mesh.wet[i] ? b.run.fluid.volume[i] : 0;
        pressure += part * b.run.nodes.p[i];
        volume += part;
    }
    print_message("sphere of tension: pressure %+.3f %%, speed %.2e\n", 100 * (pressure / volume / 200 - 1), b.fastest);
    near(pressure / volume / 200, 1, 0.03, "pressure in a sphere under surface tension");
    bench_end(&b);
}

// ---------------------------------------------------------------- spinning water

static void test_rotating_square(void **state) {
    (void)state;
    bench b;
    bench_start(&b, "cases/rotating-square/scene.yaml", 1, (const char *const[]){"fluid.size=0.04"});
    const double spin = integral(&b, spin_of, NULL);
    bench_step(&b);
    near(pressure_at(&b, (double[2]){0, 0}) / -147.343, 1, 0.01, "first pressure in the rotating square");
    double worst = 0;
    while (b.run.time < 3 * (1 - 1e-9)) {
        bench_step(&b);
        worst = silt_max(worst, largest_hole(&b));
    }
    print_message("rotating square: angular momentum %+.3f %%, volume %+.3f %%, largest hole %.2g m2\n",
                  100 * (integral(&b, spin_of, NULL) / spin - 1), 100 * b.run.ledger.volume_error, worst);
    near(integral(&b, spin_of, NULL) / spin, 1, 0.01, "its angular momentum");
    near(b.run.ledger.kinetic_energy / 83.3333, 1, 0.02, "its energy");
    near(b.run.ledger.volume_error, 0, 0.01, "its volume");
    // lashes that its arms cast off and catch again shut in a fifth of a cell, in one step of the run
    near(worst, 0, 0.25 * silt_square(0.04), "area of a hole in it");
    for (int d = 0; d < 2; d++)
        near(b.run.ledger.momentum[d] / 1000, 0, 1e-3, "its momentum");
    bench_end(&b);
}

// ---------------------------------------------------------------- Taylor and Green's vortex

/** decay of the velocity, the mean pressure that is taken off, and the half step by which pressures are older, with their decay */
typedef struct vortex {
    double decay, mean, half, then;
} vortex;

static double vortex_error(const double x[2], const double v[2], double p, const void *context) {
    (void)p;
    const double decay = ((const vortex *)context)->decay;
    return silt_square(v[0] - decay * sin(M_PI * x[0]) * cos(M_PI * x[1])) +
           silt_square(v[1] + decay * cos(M_PI * x[0]) * sin(M_PI * x[1]));
}

static double vortex_pressure_error(const double x[2], const double v[2], double p, const void *context) {
    const vortex *of = context;
    double wave = 0;
    for (int d = 0; d < 2; d++)
        wave += cos(2 * M_PI * (x[d] - of->half * v[d]));
    return silt_square(p - of->mean - 0.25 * silt_square(of->then) * wave);
}

static void test_taylor_green(void **state) {
    (void)state;
    const char *const size[3] = {"fluid.size=0.0625", "fluid.size=0.03125", "fluid.size=0.015625"};
    double velocity[3], pressure[3], stored[3];
    for (int k = 0; k < 3; k++) {
        bench b;
        bench_start(&b, "cases/taylor-green/scene.yaml", 1, &size[k]);
        bench_until(&b, 1);
        const double area = integral(&b, one, NULL);
        const double mean = integral(&b, pressure_of, NULL) / area, rate = 2 * M_PI * M_PI * 0.01;
        // the pressure is that of the middle of the last step, when the nodes were half a step back
        const double half = 0.5 * b.run.dt;
        const vortex of = {exp(-rate), mean, half, exp(-rate * (1 - half))}, now = {exp(-rate), mean, 0, exp(-rate)};
        near(area, 1, 1e-9, "area of the box");
        // relative to what the exact fields measure
        velocity[k] = sqrt(integral(&b, vortex_error, &of)) / (of.decay * sqrt(0.5));
        pressure[k] = sqrt(integral(&b, vortex_pressure_error, &of)) / (0.25 * of.decay * of.decay);
        stored[k] = sqrt(integral(&b, vortex_pressure_error, &now)) / (0.25 * of.decay * of.decay);
        print_message("vortex, 1/h = %d: velocity %.2e, pressure %.2e, with the half step it lags %.2e\n", 16 << k, velocity[k],
                      pressure[k], stored[k]);
        bench_end(&b);
    }
    assert_true(velocity[2] < 1.5e-3);
    assert_true(log(velocity[0] / velocity[2]) / log(4) > 1.8);
    assert_true(log(pressure[0] / pressure[2]) / log(4) > 1.5);
    assert_true(log(stored[0] / stored[2]) / log(4) > 0.9);
}

static void test_vortex_without_viscosity(void **state) {
    (void)state;
    bench b;
    bench_start(&b, "cases/taylor-green/scene.yaml", 1, (const char *const[]){"fluid.viscosity=0"});
    const double start = b.run.ledger.kinetic_energy;
    bench_until(&b, 1);
    print_message("vortex without viscosity: energy left %.4f\n", b.run.ledger.kinetic_energy / start);
    near(b.run.ledger.kinetic_energy / start, 1, 0.004, "energy of a vortex without viscosity");
    bench_end(&b);
}

// ---------------------------------------------------------------- waves

// frequency and decay of half the second mode of the surface: zeros and tops of what the heights show
static void wave_measure(bench *b, double time, double *omega, double *decay) {
    double *t = NULL, *y = NULL, zero[64], top[64], top_time[64];
    int n = 0, capacity = 0, y_capacity = 0, zeros = 0, tops = 0;
    while (b->run.time < time) {
        bench_step(b);
        SILT_RESERVE(t, capacity, n + 1);
        SILT_RESERVE(y, y_capacity, n + 1);
        t[n] = b->run.time;
        y[n++] = 0.25 * (b->run.gauge[0] + b->run.gauge[2] - 2 * b->run.gauge[1]);
    }
    for (int k = 1; k + 1 < n; k++) {
        if ((y[k - 1] < 0) != (y[k] < 0) && zeros < 64)
            zero[zeros++] = t[k - 1] + (t[k] - t[k - 1]) * y[k - 1] / (y[k - 1] - y[k]);
        // the top of a parabola through three points
        if (fabs(y[k]) >= fabs(y[k - 1]) && fabs(y[k]) > fabs(y[k + 1]) && tops < 64) {
            const double h = 0.5 * (t[k + 1] - t[k - 1]), slope = (y[k + 1] - y[k - 1]) / (2 * h);
            const double bend = (y[k + 1] - 2 * y[k] + y[k - 1]) / (h * h);
            top[tops] = fabs(y[k] - 0.5 * slope * slope / bend);
            top_time[tops++] = t[k] - slope / bend;
        }
    }
    assert_true(zeros > 4 && tops > 4);
    *omega = M_PI * (zeros - 1) / (zero[zeros - 1] - zero[0]);
    *decay = log(top[0] / top[tops - 1]) / (top_time[tops - 1] - top_time[0]);
    free(t);
    free(y);
}

static void test_standing_wave(void **state) {
    (void)state;
    const struct {
        const char *scene;
        double omega, decay, within;
    } wave[3] = {{"cases/standing-wave/scene-thick.yaml", 7.72899, 0.66119, 0.066},
                 {"cases/standing-wave/scene.yaml", 7.84704, 0.07499, 0.0075},
                 {"cases/standing-wave/scene-thin.yaml", 7.85087, 0.00777, 0.0077}};
    for (int k = 0; k < 3; k++) {
        bench b;
        double omega, decay;
        bench_start(&b, wave[k].scene, 0, NULL);
        wave_measure(&b, 3.2, &omega, &decay);
        print_message("standing wave: frequency %+.3f %%, decay %.5f of %.5f\n", 100 * (omega / wave[k].omega - 1), decay, wave[k].decay);
        near(omega / wave[k].omega, 1, 0.002, "frequency of a standing wave");
        near(decay, wave[k].decay, wave[k].within, "decay of a standing wave");
        bench_end(&b);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rest),
        cmocka_unit_test(test_turning),
        cmocka_unit_test(test_thrown),
        cmocka_unit_test(test_elliptic_drop),
        cmocka_unit_test(test_oscillating_drop),
        cmocka_unit_test(test_tension),
        cmocka_unit_test(test_rotating_square),
        cmocka_unit_test(test_taylor_green),
        cmocka_unit_test(test_vortex_without_viscosity),
        cmocka_unit_test(test_standing_wave),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
