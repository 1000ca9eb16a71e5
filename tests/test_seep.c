// seepage through the bed, without the water's own equations: flows that are known exactly

#include "bed_bench.h"
#include "seep.h"

#define GRAVITY 9.81
#define DENSITY 1000.0

typedef struct flow {
    bench b;
    silt_seep seep;
    double *taken;
} flow;

static void flow_open(flow *f, double size, double permeability) {
    *f = (flow){0};
    bench_open(&f->b, size);
    f->b.scene.gravity[1] = -GRAVITY;
    f->b.scene.bed.seepage = SEEPAGE_DARCY;
    f->b.scene.bed.permeability = permeability;
}

// water on the surface where `level` of the place is above it, at rest
static void flow_fill(flow *f, double (*level)(const double *x)) {
    bench *b = &f->b;
    bench_create(b);
    for (int k = 0; k < b->bed.n_node; k++)
        if (b->bed.exposed[k])
            b->bed.fluid_node[k] = silt_nodes_add(&b->nodes, NODE_BED, k, b->bed.x[k]);
    b->mesh.n_node = b->nodes.count;
    b->mesh.wet = silt_alloc((size_t)b->nodes.count + 1, sizeof *b->mesh.wet);
    f->taken = silt_alloc((size_t)b->nodes.count + 1, sizeof *f->taken);
    // every node has one of the water's inside beside it, the last
    const int n = b->nodes.count, inner = silt_nodes_add(&b->nodes, NODE_FLUID, -1, (double[2]){0, 0});
    b->mesh.neighbour_start = silt_alloc((size_t)n + 2, sizeof(int));
    b->mesh.neighbour = silt_alloc((size_t)n + 1, sizeof(int));
    b->mesh.surface = silt_alloc((size_t)n + 1, 1);
    for (int i = 0; i < n; i++) {
        b->mesh.neighbour[i] = inner;
        b->mesh.neighbour_start[i + 1] = i + 1;
    }
    b->nodes.count = n;
    for (int i = 0; i < b->nodes.count; i++) {
        const double deep = level(b->nodes.x + 2 * i) - b->nodes.x[2 * i + 1];
        b->mesh.wet[i] = deep > -1e-9;
        b->nodes.p[i] = b->mesh.wet[i] ? DENSITY * GRAVITY * deep : 0;
    }
}

static void flow_solve(flow *f) {
    silt_error err = {0};
    if (silt_seep_prepare(&f->seep, &f->b.bed, &f->b.scene, &f->b.nodes, &f->b.mesh, &err) != SILT_OK)
        fail_msg("%s", err.text);
    memset(f->taken, 0, (size_t)f->b.nodes.count * sizeof(double));
    silt_seep_take(&f->seep, f->b.nodes.p, f->taken);
    silt_seep_accept(&f->seep, &f->b.bed, &f->b.scene, f->b.nodes.p);
}

static void flow_close(flow *f) {
    silt_seep_clear(&f->seep);
    free(f->taken);
    bench_close(&f->b);
}

// m/s, hydraulic conductivity
static double conductivity(const flow *f) { return f->b.scene.bed.permeability * DENSITY * GRAVITY / f->b.scene.fluid.viscosity; }

static double taken_sum(const flow *f, double *size) {
    double sum = 0;
    *size = 0;
    for (int i = 0; i < f->b.nodes.count; i++) {
        sum += f->taken[i];
        *size = silt_max(*size, fabs(f->taken[i]));
    }
    return sum;
}

// ---------------------------------------------------------------- a flow without bounds

// head falls by 0.3 to the right and by 0.2 upwards: P1 holds it exactly
static double level_even(const double *x) { return 5 - 0.3 * x[0] - 0.2 * x[1]; }

static void test_even_flow(void **state) {
    (void)state;
    flow f;
    flow_open(&f, 0.06, 1e-9);
    bench_polygon(&f.b, 5, (double[]){0, 0, 1, 0.1, 1.1, 0.6, 0.5, 0.8, -0.1, 0.5});
    flow_fill(&f, level_even);
    flow_solve(&f);
    const double q[2] = {0.3 * conductivity(&f), 0.2 * conductivity(&f)};
    const silt_bed *bed = &f.b.bed;
    for (int k = 0; k < bed->n_node; k++)
        NEAR(bed->pressure[k], DENSITY * GRAVITY * (level_even(bed->x[k]) - bed->x[k][1]), 1e-8);
    for (int c = 0; c < bed->n_cell; c++)
        for (int d = 0; d < 2; d++)
            NEAR(bed->darcy[2 * c + d], q[d], 1e-10 * q[0]);
    // a node on the surface takes half of what goes through its two edges
    double in = 0;
    for (int k = 0; k < bed->n_node; k++) {
        if (!bed->exposed[k])
            continue;
        double through = 0;
        for (int e = 0; e < bed->n_edge; e++)
            if (bed->edge[e][0] == k || bed->edge[e][1] == k) {
                const double *from = bed->x[bed->edge[e][0]], *to = bed->x[bed->edge[e][1]];
                through += 0.5 * (q[0] * (to[1] - from[1]) - q[1] * (to[0] - from[0])); // the bed is on the right
            }
        NEAR(f.taken[bed->fluid_node[k]], through, 1e-10 * q[0]);
        in += silt_max(through, 0);
    }
    NEAR(f.seep.entered, in, 1e-10 * q[0]);
    double size, p;
    NEAR(taken_sum(&f, &size), 0, 1e-12 * q[0]);
    assert_true(silt_seep_pressure_at(bed, (double[]){0.4, 0.41}, &p));
    NEAR(p, DENSITY * GRAVITY * (level_even((double[]){0.4, 0.41}) - 0.41), 1e-8);
    assert_false(silt_seep_pressure_at(bed, (double[]){0.4, 0.9}, &p));
    flow_close(&f);
}

// what the pressure system sees: symmetric, nothing for a pressure that is the same all over, more taken where it is higher
static void test_operator(void **state) {
    (void)state;
    flow f;
    flow_open(&f, 0.08, 1e-9);
    bench_polygon(&f.b, 5, (double[]){0, 0, 1, 0.1, 1.1, 0.6, 0.5, 0.8, -0.1, 0.5});
    flow_fill(&f, level_even);
    flow_solve(&f);
    const int n = f.b.nodes.count;
    uint64_t seed = 5;
    double *x = silt_alloc((size_t)n, sizeof *x), *y = silt_alloc((size_t)n, sizeof *y), *bx = silt_alloc((size_t)n, sizeof *bx),
           *by = silt_alloc((size_t)n, sizeof *by), *later = silt_alloc((size_t)n, sizeof *later);
    for (int i = 0; i < n; i++)
        x[i] = 1;
    silt_seep_apply(&f.seep, x, bx);
    for (int i = 0; i < n; i++)
        NEAR(bx[i], 0, 1e-12 * f.b.scene.bed.permeability / f.b.scene.fluid.viscosity);
    double xy = 0, yx = 0, xx = 0, yy = 0;
    memset(bx, 0, (size_t)n * sizeof *bx);
    for (int i = 0; i < n; i++) {
        x[i] = silt_uniform(&seed) - 0.5;
        y[i] = silt_uniform(&seed) - 0.5;
    }
    silt_seep_apply(&f.seep, x, bx);
    silt_seep_apply(&f.seep, y, by);
    for (int i = 0; i < n; i++) {
        xy += x[i] * by[i];
        yx += y[i] * bx[i];
        xx += x[i] * bx[i];
        yy += y[i] * by[i];
    }
    assert_true(xx > 0 && yy > 0);
    NEAR(xy, yx, 1e-12 * sqrt(xx * yy));
    // it is the slope of what is taken
    for (int i = 0; i < n; i++)
        f.b.nodes.p[i] += x[i];
    silt_seep_take(&f.seep, f.b.nodes.p, later);
    for (int i = 0; i < n; i++)
        NEAR(later[i] - f.taken[i], bx[i], 1e-9 * sqrt(xx));
    free(x);
    free(y);
    free(bx);
    free(by);
    free(later);
    flow_close(&f);
}

// ---------------------------------------------------------------- a dam with a free surface inside

static double upstream, downstream;
static double level_dam(const double *x) { return x[0] < 0.5 ? upstream : downstream; }

// a dam 0.6 m long on an impervious floor; Charny: the discharge is K (H1^2 - H2^2)/(2 L) whatever the surface inside is
static double dam_discharge(double size, double h1, double h2, double *exit_height, double *lost) {
    flow f;
    flow_open(&f, size, 1e-9);
    upstream = h1;
    downstream = h2;
    bench_box(&f.b, 0, 0, 0.6, 0.5);
    bench_wall(&f.b, 4, (double[]){-0.5, 1, -0.5, 0, 1.1, 0, 1.1, 1});
    flow_fill(&f, level_dam);
    for (int step = 0; step < 5; step++)
        flow_solve(&f);
    double size_of, sum = taken_sum(&f, &size_of);
    NEAR(sum, f.seep.lost, 1e-10 * size_of); // what goes in comes out
    *exit_height = 0;
    for (int k = 0; k < f.b.bed.n_node; k++)
        if (f.seep.kind[k] == SEEP_FACE && f.b.bed.x[k][0] > 0.599)
            *exit_height = silt_max(*exit_height, f.b.bed.x[k][1]);
    *lost = f.seep.lost;
    const double entered = f.seep.entered / conductivity(&f);
    flow_close(&f);
    return entered;
}

static void test_dam(void **state) {
    (void)state;
    double exit_height, lost;
    const double wet = dam_discharge(0.025, 0.4, 0.1, &exit_height, &lost);
    NEAR(wet, (0.16 - 0.01) / 1.2, 0.002 * 0.125);
    assert_true(exit_height > 0.1 && exit_height < 0.3); // a seepage face above the lower water
    NEAR(lost, 0, 1e-15);                                // which takes what comes out of it
    const double dry = dam_discharge(0.025, 0.4, -0.1, &exit_height, &lost); // no water on that side
    NEAR(dry, 0.16 / 1.2, 0.002 * 0.1333);
    assert_true(exit_height > 0.05 && exit_height < 0.3);
    assert_true(lost > 0);
}

// water that stands on both sides at one level stands in the dam too, and no drop moves
static void test_rest(void **state) {
    (void)state;
    flow f;
    flow_open(&f, 0.03, 1e-9);
    upstream = downstream = 0.3;
    bench_box(&f.b, 0, 0, 0.6, 0.5);
    bench_wall(&f.b, 4, (double[]){-0.5, 1, -0.5, 0, 1.1, 0, 1.1, 1});
    flow_fill(&f, level_dam);
    for (int step = 0; step < 5; step++)
        flow_solve(&f);
    NEAR(f.seep.entered, 0, 1e-9 * conductivity(&f));
    for (int k = 0; k < f.b.bed.n_node; k++)
        NEAR(f.b.bed.pressure[k], DENSITY * GRAVITY * (0.3 - f.b.bed.x[k][1]), 1e-6);
    flow_close(&f);
}

// ---------------------------------------------------------------- under a sheet pile

// right half of a layer 1 m deep with a sheet pile in its middle that ends 0.5 m above the floor: below it the head is the mean of both
static double level_pile(const double *x) { return x[0] < 1e-9 && x[1] < 0.5 + 1e-9 ? 2 : 1.5; }

static double pile_discharge(double size) {
    flow f;
    flow_open(&f, size, 1e-10);
    bench_box(&f.b, 0, 0, 3, 1);
    bench_wall(&f.b, 3, (double[]){0, 0, 3, 0, 3, 2});
    bench_wall(&f.b, 2, (double[]){0, 2, 0, 0.5});
    flow_fill(&f, level_pile);
    flow_solve(&f);
    const double entered = f.seep.entered / conductivity(&f);
    flow_close(&f);
    return entered;
}

static void test_sheet_pile(void **state) {
    (void)state;
    // q = k H K'/(2 K) of the modulus sin(pi s/(2 T)), where s = T/2 makes K' = K (M. E. Harr, Groundwater and Seepage, 1962, ch. 5)
    const double coarse = pile_discharge(0.05), fine = pile_discharge(0.025);
    NEAR(coarse, 0.5, 0.03 * 0.5);
    NEAR(fine, 0.5, 0.015 * 0.5);
    assert_true(fabs(fine - 0.5) < 0.7 * fabs(coarse - 0.5)); // h at the tip, where the speed is infinite
}

// ---------------------------------------------------------------- what it does to the grains

static double head_below;
static double level_column(const double *x) { return x[1] < 0.25 ? head_below : 0.6; }

static void test_gradient(void **state) {
    (void)state;
    // a column 0.2 m high, the head under it raised by the critical gradient (s - 1)(1 - n) = 0.99
    flow f;
    flow_open(&f, 0.02, 1e-10);
    bench_box(&f.b, 0, 0.2, 0.1, 0.4);
    bench_wall(&f.b, 2, (double[]){0, 1, 0, 0});
    bench_wall(&f.b, 2, (double[]){0.1, 0, 0.1, 1});
    head_below = 0.6 + 0.99 * 0.2;
    flow_fill(&f, level_column);
    flow_solve(&f);
    for (int k = 0; k < f.b.bed.n_node; k++)
        if (f.b.bed.alive[k])
            NEAR(f.b.bed.seepage[k], 1, 1e-9);
    NEAR(f.seep.entered, 0.1 * 0.99 * conductivity(&f), 1e-10 * conductivity(&f));
    flow_close(&f);
}

static void test_kozeny_carman(void **state) {
    (void)state;
    // d^2 n^3/(180 (1 - n)^2) with d = 1 mm, n = 0.4: 9.8765e-10 m2
    flow f;
    flow_open(&f, 0.02, 0);
    f.b.scene.bed.seepage = SEEPAGE_KOZENY_CARMAN;
    f.b.scene.grains.diameter = 1e-3;
    bench_box(&f.b, 0, 0.2, 0.1, 0.4);
    bench_wall(&f.b, 2, (double[]){0, 1, 0, 0});
    bench_wall(&f.b, 2, (double[]){0.1, 0, 0.1, 1});
    head_below = 0.7;
    flow_fill(&f, level_column);
    flow_solve(&f);
    const double k = 1e-6 * 0.064 / (180 * 0.36);
    NEAR(f.seep.entered, 0.1 * 0.5 * k * DENSITY * GRAVITY / 1e-3, 1e-10 * k * DENSITY * GRAVITY / 1e-3);
    flow_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_even_flow), cmocka_unit_test(test_operator), cmocka_unit_test(test_dam), cmocka_unit_test(test_sheet_pile),
        cmocka_unit_test(test_rest),      cmocka_unit_test(test_gradient), cmocka_unit_test(test_kozeny_carman),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
