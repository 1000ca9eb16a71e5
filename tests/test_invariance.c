// the same water thrown, turned and mirrored must do the same: no absolute velocity, no axis, no node number has a say

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "run.h"

#include <unistd.h>

#include <dirent.h>
#include <sys/stat.h>

#define DROP_H 0.1
#define TURN (37 * M_PI / 180)

typedef struct cloud {
    int n, capacity, v_capacity;
    double *x, *v; // 2 per node
} cloud;

static void put(cloud *c, double x, double y, double vx, double vy) {
    SILT_RESERVE(c->x, c->capacity, 2 * c->n + 2);
    SILT_RESERVE(c->v, c->v_capacity, 2 * c->n + 2);
    c->x[2 * c->n] = x;
    c->x[2 * c->n + 1] = y;
    c->v[2 * c->n] = vx;
    c->v[2 * c->n++ + 1] = vy;
}

static char folder[512];

// runs a scene around the cloud; `text` lacks the cloud's key only
static void begin(silt_run *run, silt_scene **scene, const cloud *c, const char *text) {
    silt_error err = {0};
    silt_run_def def = {.quiet = true};
    snprintf(folder, sizeof folder, "%s/tests/invariance-XXXXXX", SILT_BINARY);
    assert_non_null(mkdtemp(folder));
    char *yaml = silt_text("%s/asked.yaml", folder), *csv = silt_text("%s/cloud.csv", folder), *out = silt_text("%s/out", folder);
    FILE *to = fopen(csv, "w");
    fprintf(to, "x,y,vx,vy\n");
    for (int i = 0; i < c->n; i++)
        fprintf(to, "%.17g,%.17g,%.17g,%.17g\n", c->x[2 * i], c->x[2 * i + 1], c->v[2 * i], c->v[2 * i + 1]);
    fclose(to);
    to = fopen(yaml, "w");
    fputs(text, to);
    fclose(to);
    mkdir(out, 0700);
    if (silt_scene_read(yaml, 0, NULL, scene, &err) != SILT_OK)
        fail_msg("%s", err.text);
    if (silt_run_open(run, *scene, &def, out, -1, &err) != SILT_OK)
        fail_msg("%s", err.text);
    free(yaml);
    free(csv);
    free(out);
}

static void sweep(const char *path) {
    DIR *list = opendir(path);
    for (struct dirent *entry; list && (entry = readdir(list));)
        if (entry->d_name[0] != '.')
            unlinkat(dirfd(list), entry->d_name, 0);
    closedir(list);
    rmdir(path);
}

static void end(silt_run *run, silt_scene **scene) {
    silt_run_free(run);
    silt_scene_free(scene);
    char *out = silt_text("%s/out", folder);
    sweep(out);
    sweep(folder);
    free(out);
}

static void go(silt_run *run, double until) {
    silt_error err = {0};
    while (run->time < until - 1e-9)
        if (silt_run_advance(run, &err) != SILT_OK)
            fail_msg("t = %g: %s", run->time, err.text);
}

// ---------------------------------------------------------------- thrown and turned

typedef struct drop {
    double time;       // s, when the nodes were taken
    int n;
    double *x, *v, *p; // 2, 2, 1 per node, in the order of the nodes
    double early_energy, late_energy, late_volume, late_axis[2]; // without the throw's share
} drop;

// a drop that strains, seen from a frame that moves with -throw and is turned by -angle
static void drop_run(drop *d, double angle, const double flight[2]) {
    cloud c = {0};
    uint64_t random = 7;
    const double co = cos(angle), si = sin(angle);
    for (int j = -12; j <= 12; j++)
        for (int i = -12; i <= 12; i++) {
            double x = (i + (j & 1 ? 0.5 : 0)) * DROP_H, y = j * DROP_H * sqrt(0.75);
            const double rim = hypot(x, y), shift = rim < 0.86 ? 0.2 * DROP_H : 0;
            x += shift * (2 * silt_uniform(&random) - 1);
            y += shift * (2 * silt_uniform(&random) - 1);
            if (rim < 0.92)
                put(&c, x, y, 0, 0);
        }
    for (int k = 0; k < 62; k++)
        put(&c, cos(2 * M_PI * (k + 0.13) / 62), sin(2 * M_PI * (k + 0.13) / 62), 0, 0);
    for (int i = 0; i < c.n; i++) {
        const double x = c.x[2 * i], y = c.x[2 * i + 1], vx = -x - 0.3 * y, vy = y + 0.3 * x;
        c.x[2 * i] = co * x - si * y;
        c.x[2 * i + 1] = si * x + co * y;
        c.v[2 * i] = co * vx - si * vy + flight[0];
        c.v[2 * i + 1] = si * vx + co * vy + flight[1];
    }
    const char *text = "silt: 1\ndimension: 2\ntime: {end: 2, output: 0.1, step: 0.01, cfl: 1}\ngravity: [0, 0]\n"
                       "fluid: {density: 1000, viscosity: 1, size: 0.1, flow: laminar, tolerance: 1.0e-11, iterations: 30,\n"
                       "  cloud: cloud.csv, regions: [{circle: [0, 0], radius: 1.001}]}\n";
    silt_run run;
    silt_scene *scene = NULL;
    begin(&run, &scene, &c, text);
    go(&run, 0.2);
    const int n = run.nodes.count;
    *d = (drop){.time = run.time, .n = n};
    d->x = silt_alloc(2 * (size_t)n + 1, sizeof(double));
    d->v = silt_alloc(2 * (size_t)n + 1, sizeof(double));
    d->p = silt_alloc((size_t)n + 1, sizeof(double));
    for (int i = 0; i < n; i++) { // back into the frame of the drop
        const double x = run.nodes.x[2 * i] - flight[0] * run.time, y = run.nodes.x[2 * i + 1] - flight[1] * run.time;
        const double vx = run.nodes.v[2 * i] - flight[0], vy = run.nodes.v[2 * i + 1] - flight[1];
        d->x[2 * i] = co * x + si * y;
        d->x[2 * i + 1] = -si * x + co * y;
        d->v[2 * i] = co * vx + si * vy;
        d->v[2 * i + 1] = -si * vx + co * vy;
        d->p[i] = run.nodes.p[i];
    }
    go(&run, 1.5);
    double mass = 0, at[2] = {0}, second[3] = {0};
    for (int e = 0; e < run.mesh.n_cell; e++) {
        const int *cell = run.mesh.cell[e];
        const double part = silt_cell_volume(&run.mesh, run.nodes.x, e) / 3;
        mass += 3 * part;
        for (int a = 0; a < 3; a++) {
            const double x = run.nodes.x[2 * cell[a]] - flight[0] * run.time, y = run.nodes.x[2 * cell[a] + 1] - flight[1] * run.time;
            const double vx = run.nodes.v[2 * cell[a]] - flight[0], vy = run.nodes.v[2 * cell[a] + 1] - flight[1];
            const double along = co * x + si * y, across = -si * x + co * y;
            at[0] += part * along;
            at[1] += part * across;
            second[0] += part * along * along;
            second[1] += part * across * across;
            d->late_energy += 500 * part * (vx * vx + vy * vy);
        }
    }
    d->late_volume = mass;
    for (int k = 0; k < 2; k++)
        d->late_axis[k] = 2 * sqrt(second[k] / mass - silt_square(at[k] / mass));
    end(&run, &scene);
    free(c.x);
    free(c.v);
}

static void drop_free(drop *d) {
    free(d->x);
    free(d->v);
    free(d->p);
}

// largest difference of two arrays over the largest number
static double apart(int n, const double *a, const double *b) {
    double most = 0, size = 0;
    for (int i = 0; i < n; i++) {
        most = silt_max(most, fabs(a[i] - b[i]));
        size = silt_max(size, fabs(a[i]));
    }
    return most / size;
}

static void test_thrown_and_turned(void **state) {
    (void)state;
    drop plain;
    const double rest[2] = {0, 0}, flight[2] = {0.7, -0.4};
    drop_run(&plain, 0, rest);
    for (int k = 0; k < 3; k++) {
        drop other;
        drop_run(&other, k == 0 ? 0 : TURN, k == 1 ? rest : flight);
        assert_int_equal(plain.n, other.n);
        const double dx = apart(2 * plain.n, plain.x, other.x), dv = apart(2 * plain.n, plain.v, other.v);
        const double dp = apart(plain.n, plain.p, other.p);
        print_message("%s: places %.1e, velocities %.1e, pressures %.1e; at last energy %.1e, area %.1e, axes %.1e %.1e\n",
                      k == 0 ? "thrown" : k == 1 ? "turned" : "both", dx, dv, dp, other.late_energy / plain.late_energy - 1,
                      other.late_volume / plain.late_volume - 1, other.late_axis[0] / plain.late_axis[0] - 1,
                      other.late_axis[1] / plain.late_axis[1] - 1);
        assert_true(dx < 1e-8 && dv < 1e-8 && dp < 1e-8);
        assert_true(fabs(other.late_energy / plain.late_energy - 1) < 0.005);
        assert_true(fabs(other.late_volume / plain.late_volume - 1) < 0.005);
        for (int a = 0; a < 2; a++)
            assert_true(fabs(other.late_axis[a] / plain.late_axis[a] - 1) < 0.005);
        drop_free(&other);
    }
    drop_free(&plain);
}

// ---------------------------------------------------------------- mirrored

// largest distance of a node to the nearest mirror image
static double asymmetry(const silt_nodes *nodes) {
    double worst = 0;
    for (int i = 0; i < nodes->count; i++) {
        double nearest = HUGE_VAL;
        for (int j = 0; j < nodes->count; j++)
            nearest = silt_min(nearest, hypot(nodes->x[2 * i] + nodes->x[2 * j], nodes->x[2 * i + 1] - nodes->x[2 * j + 1]));
        worst = silt_max(worst, nearest);
    }
    return worst;
}

static void test_mirrored(void **state) {
    (void)state;
    // a column on a slip floor that falls to both sides; the right half jittered, the left its image in another order
    const double h = 0.05;
    cloud right = {0}, all = {0};
    uint64_t random = 3;
    for (int j = 0; j <= 16; j++)
        for (int i = 1; i <= 8; i++) {
            double x = (i - (j & 1 ? 0.25 : 0)) * h, y = j * h;
            if (i < 8 && j > 0 && j < 16)
                y += 0.15 * h * (2 * silt_uniform(&random) - 1);
            if (i < 8)
                x += 0.15 * h * (2 * silt_uniform(&random) - 1);
            put(&right, i == 8 ? 8 * h : x, y, 0, 0);
        }
    for (int k = 0; k <= 32; k++)
        put(&all, 0, 0.5 * h * k, 0, 0);
    for (int i = 0; i < right.n; i++)
        put(&all, right.x[2 * i], right.x[2 * i + 1], 0, 0);
    for (int i = right.n; i-- > 0;)
        put(&all, -right.x[2 * i], right.x[2 * i + 1], 0, 0);
    const char *text = "silt: 1\ndimension: 2\ntime: {end: 2, output: 0.02, step: 0.005}\ngravity: [0, -9.81]\n"
                       "fluid: {density: 1000, viscosity: 0.001, size: 0.05, flow: laminar, tolerance: 1.0e-12, iterations: 30,\n"
                       "  cloud: cloud.csv, regions: [{box: [[-0.4001, 0], [0.4001, 0.8001]]}]}\n"
                       "walls: [{polyline: [[-3, 0], [3, 0]], condition: slip}]\n";
    silt_run run;
    silt_scene *scene = NULL;
    begin(&run, &scene, &all, text);
    for (double t = 0.02; t < 0.401; t += 0.02) {
        go(&run, t);
        print_message("t = %.2f: %d nodes, asymmetry %.1e h\n", run.time, run.nodes.count, asymmetry(&run.nodes) / h);
        assert_true(asymmetry(&run.nodes) < 1e-6 * h);
    }
    end(&run, &scene);
    free(right.x);
    free(right.v);
    free(all.x);
    free(all.v);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_thrown_and_turned),
        cmocka_unit_test(test_mirrored),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
