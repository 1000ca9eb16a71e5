// the erosion laws against published and exact values: thresholds, slopes, rates, and what a flat bed loses in the long run

#include "bed_bench.h"
#include "viscosity.h"

// quartz in water: s = 2.65, nu = 1e-6 m2/s
static void bench_sand(bench *b, silt_bed_law law, double diameter) {
    b->scene.fluid.viscosity = 1e-3;
    b->scene.fluid.density = 1000;
    b->scene.bed.density = 2650;
    b->scene.bed.law = law;
    b->scene.bed.shear = SHEAR_LOG_LAW;
    b->scene.bed.slope = true;
    b->scene.grains.diameter = diameter;
    b->scene.gravity[1] = -9.81;
}

// ---------------------------------------------------------------- thresholds

static void test_shields(void **state) {
    (void)state;
    // Soulsby, Dynamics of Marine Sands (1997), equation 77 with s = 2.65, nu = 1e-6: d (m), theta_cr, tau_cr (Pa)
    static const double table[7][3] = {{0.0001, 0.0770533, 0.124722}, {0.0002, 0.0477195, 0.154482}, {0.0005, 0.0308367, 0.249569},
                                       {0.001, 0.0314055, 0.508345},  {0.002, 0.0398662, 1.29059},   {0.005, 0.0525806, 4.25548},
                                       {0.01, 0.0556358, 9.00548}};
    for (int k = 0; k < 7; k++) {
        bench b;
        bench_open(&b, 0.05);
        bench_sand(&b, BED_SHIELDS, table[k][0]);
        NEAR(silt_shields_critical(silt_bed_dstar(&b.scene)), table[k][1], 2e-6 * table[k][1]);
        NEAR(silt_bed_threshold(&b.scene), table[k][2], 2e-5 * table[k][2]);
        NEAR(silt_bed_motion(&b.scene), silt_bed_threshold(&b.scene), 0);
        // a number of the scene's own
        b.scene.bed.critical = 0.06;
        NEAR(silt_bed_threshold(&b.scene), 0.06 * 1650 * 9.81 * table[k][0], 1e-12);
        // other laws have the scene's stress, and grains that come to rest the law of their size where it has none
        b.scene.bed.law = BED_EXCESS_SHEAR;
        b.scene.bed.critical = 0;
        NEAR(silt_bed_threshold(&b.scene), 0, 0);
        NEAR(silt_bed_motion(&b.scene), table[k][2], 2e-5 * table[k][2]);
        b.scene.bed.threshold = 3;
        NEAR(silt_bed_threshold(&b.scene), 3, 0);
        NEAR(silt_bed_motion(&b.scene), 3, 0);
    }
}

static void test_slope(void **state) {
    (void)state;
    const double phi = 32 * M_PI / 180;
    for (int degrees = 0; degrees <= 30; degrees += 5) {
        const double beta = degrees * M_PI / 180;
        // downhill sin(phi - beta)/sin(phi) = cos beta (1 - tan beta/tan phi), uphill the other sign, and across
        NEAR(silt_bed_slope(cos(beta), -sin(beta), 32), sin(phi - beta) / sin(phi), 1e-14);
        NEAR(silt_bed_slope(cos(beta), -sin(beta), 32), cos(beta) * (1 - tan(beta) / tan(phi)), 1e-14);
        NEAR(silt_bed_slope(cos(beta), sin(beta), 32), cos(beta) * (1 + tan(beta) / tan(phi)), 1e-14);
        NEAR(silt_bed_slope(cos(beta), 0, 32), cos(beta) * sqrt(1 - silt_square(tan(beta) / tan(phi))), 1e-14);
        // between them a grain slides when flow, slope and friction balance: |f t + sin(beta) s| = tan(phi) cos(beta), f from 0 up
        for (int turn = 0; turn <= 180; turn += 30) {
            const double psi = turn * M_PI / 180, f = tan(phi) * silt_bed_slope(cos(beta), cos(psi) * sin(beta), 32);
            NEAR(hypot(f - sin(beta) * cos(psi), sin(beta) * sin(psi)), tan(phi) * cos(beta), 1e-14);
        }
    }
    assert_true(silt_bed_slope(cos(0.6), -sin(0.6), 32) == 0); // steeper than 32 degrees
    assert_true(silt_bed_slope(-0.5, 0, 32) == 0);             // a roof
    assert_true(silt_bed_slope(cos(0.6), -sin(0.6), 0) == 1);  // no angle given
}

// ---------------------------------------------------------------- rates

static void test_rate(void **state) {
    (void)state;
    bench b;
    bench_open(&b, 0.05);
    bench_sand(&b, BED_EXCESS_SHEAR, 2e-4);
    // Hanson and Simon (2001), k_d = 0.2 cm3/(N s) tau_c^-0.5: tau_c = 5 Pa has 0.0894427 cm3/(N s); under 10 Pa 4.472e-7 m/s
    b.scene.bed.erodibility = 0.2e-6 / sqrt(5);
    NEAR(b.scene.bed.erodibility, 8.94427e-8, 1e-13);
    NEAR(silt_bed_rate(&b.scene, 10, 5, 5), 4.472136e-7, 1e-13);
    assert_true(silt_bed_rate(&b.scene, 5, 5, 5) == 0 && silt_bed_rate(&b.scene, 4, 5, 5) == 0);
    // (tau - tau_c) u*/W_c: 10 Pa is u* = 0.1 m/s in water
    b.scene.bed.law = BED_POWER;
    b.scene.bed.work = 1e6;
    NEAR(silt_bed_rate(&b.scene, 10, 2, 2), 8e-7, 1e-19);
    // van Rijn (1984) by hand for 0.2 mm quartz under 0.6 Pa: D* = 5.0592, theta_c = 0.0477195, tau_c = 0.154482 Pa, T = 2.88394,
    // 0.00033 D*^0.3 T^1.5 = 2.62856e-3 of sqrt(1.65 g d) = 0.0568973 m/s: 0.396329 kg/m2/s of quartz, 2.49263e-4 m/s of a bed with n = 0.4
    b.scene.bed.law = BED_SHIELDS;
    const double critical = silt_bed_threshold(&b.scene), rate = silt_bed_rate(&b.scene, 0.6, critical, critical);
    NEAR(rate, 2.49263e-4, 1e-9);
    NEAR(rate * 2650 * 0.6, 0.396329, 1e-6);
    // downhill the threshold is lower, what is relative to level ground stays finite
    NEAR(silt_bed_rate(&b.scene, 0.6, 0, critical), rate * pow(0.6 / (0.6 - critical), 1.5), 1e-15);
}

// ---------------------------------------------------------------- stress on the bed's nodes

// a flat bed of 0.5 m under water on a lattice of 1 cm
static void bench_stream(bench *b, double speed, double slope) {
    bench_box(b, 0, 0, 0.5, 0.1);
    bench_wall(b, 4, (double[]){0, 1, 0, 0, 0.5, 0, 0.5, 1});
    bench_create(b);
    b->scene.fluid.size = 0.01;
    bench_water(b, 0, 0.1, 0.5, 0.2, 0.01, speed, 0);
    for (int k = 0; k < b->nodes.count; k++)
        b->nodes.v[2 * k] += slope * (b->nodes.x[2 * k + 1] - 0.1);
    for (int i = 0; i < b->bed.n_node; i++)
        for (int k = 0; b->bed.exposed[i] && k < b->nodes.count; k++)
            if (hypot(b->nodes.x[2 * k] - b->bed.x[i][0], b->nodes.x[2 * k + 1] - b->bed.x[i][1]) < 1e-9)
                b->bed.fluid_node[i] = k;
}

static void test_log_law(void **state) {
    (void)state;
    // 1 m/s at 2 h = 0.02 m over grains of 1 mm; then over k_s = 15 mm, whose law begins at 2 k_s; then a film of h
    for (int k = 0; k < 3; k++) {
        bench b;
        bench_open(&b, 0.05);
        bench_sand(&b, BED_EXCESS_SHEAR, 1e-3);
        b.scene.bed.roughness = k == 1 ? 0.015 : 0;
        b.scene.bed.erodibility = 1e-7;
        if (k == 2) {
            // the film ends 0.01 m over the bed: its half height is looked at
            bench_box(&b, 0, 0, 0.5, 0.1);
            bench_wall(&b, 4, (double[]){0, 1, 0, 0, 0.5, 0, 0.5, 1});
            bench_create(&b);
            b.scene.fluid.size = 0.008;
            bench_water(&b, 0, 0.1, 0.5, 0.11, 0.01, 1, 0);
        } else
            bench_stream(&b, 1, 0);
        const double y = k == 1 ? 0.03 : k == 2 ? 0.008 : 0.02, ks = k == 1 ? 0.015 : 0.0025;
        const double tau = 1000 * silt_square(SILT_KAPPA / log(30 * y / ks));
        bench_wear(&b, 2);
        for (int i = 0; i < b.bed.n_node; i++)
            if (b.bed.exposed[i]) {
                NEAR(b.bed.shear[i], tau, 1e-12 * tau);
                NEAR(b.bed.eroded[i], 2650 * 0.6 * 1e-7 * tau * 2, 1e-12);
                NEAR(b.bed.work[i], 0, 0);
            }
        assert_true(b.bed.y_plus == 0);
        bench_close(&b);
    }
}

static void test_gradient(void **state) {
    (void)state;
    // the true shear 100 /s of water, whatever uniform stream is added; y+ = 0.01 m sqrt(0.1 Pa/rho)/nu = 100
    for (int k = 0; k < 3; k++) {
        bench b;
        bench_open(&b, 0.05);
        bench_sand(&b, k == 2 ? BED_FRICTIONAL_WORK : BED_DISSIPATION, 1e-3);
        b.scene.bed.shear = SHEAR_GRADIENT;
        bench_stream(&b, k, 100);
        bench_wear(&b, 2);
        for (int i = 0; i < b.bed.n_node; i++)
            if (b.bed.exposed[i]) {
                NEAR(b.bed.shear[i], 0.1, 1e-12);
                NEAR(b.bed.work[i], 0.1 * 100 * 2, 1e-10);
            }
        NEAR(b.bed.y_plus, 100 * 0.5 * sqrt(4), 1e-9);
        bench_close(&b);
    }
}

static void test_cover(void **state) {
    (void)state;
    // half of a node's surface under parcels: half of the wear; all of it: none
    bench b;
    bench_open(&b, 0.05);
    bench_sand(&b, BED_EXCESS_SHEAR, 1e-3);
    b.scene.bed.erodibility = 1e-7;
    bench_stream(&b, 1, 0);
    double cover[512] = {0};
    for (int i = 0; i < b.bed.n_node; i++)
        cover[i] = 0.5 * (i % 3);
    silt_bed_wear(&b.bed, &b.scene, &b.nodes, &b.mesh, &b.locator, cover, 1);
    for (int i = 0; i < b.bed.n_node; i++)
        if (b.bed.exposed[i])
            NEAR(b.bed.eroded[i], 2650 * 0.6 * 1e-7 * b.bed.shear[i] * (1 - 0.5 * (i % 3)), 1e-14);
    bench_close(&b);
}

// what parcels of diameter d at distance `apart` cover of a flat bed of 2 m, at x = 0.5 to 1.5 m, where they lie without end
static void check_cover(double d, double apart, double share) {
    bench b;
    bench_open(&b, 0.05);
    bench_box(&b, 0, 0, 2, 0.1);
    bench_wall(&b, 4, (double[]){0, 1, 0, 0, 2, 0, 2, 1});
    bench_create(&b);
    enum { MOST = 200 };
    double x[3 * MOST] = {0}, radius[MOST], cover[512];
    uint8_t on_bed[MOST];
    int n = 0;
    for (double at = 0.2; at < 1.8; at += apart, n += 2)
        for (int high = 0; high < 2; high++) {
            // a second row that does not touch the bed covers nothing
            x[3 * (n + high)] = at;
            x[3 * (n + high) + 1] = 0.1 + (0.5 + high) * d;
            radius[n + high] = 0.5 * d;
            on_bed[n + high] = !high;
        }
    assert_in_range(n, 2, MOST);
    const silt_grain_state grains = {.count = n, .x = x, .radius = radius, .on_bed = on_bed};
    silt_bed_cover(&b.bed, &b.scene, &grains, cover);
    double sum = 0;
    for (int i = 0; i < b.bed.n_node; i++) {
        assert_true(cover[i] >= 0 && cover[i] <= 1);
        if (b.bed.exposed[i] && b.bed.x[i][0] > 0.5 && b.bed.x[i][0] < 1.5)
            NEAR(cover[i], share, share < 1 ? 0.05 : 0.02);
        if (b.bed.exposed[i] && (b.bed.x[i][0] < 0.09 || b.bed.x[i][0] > 1.91))
            NEAR(cover[i], 0, 0);
        sum += b.bed.exposed[i] ? cover[i] * (b.bed.x[i][0] > 0 && b.bed.x[i][0] < 2 ? 0.05 : 0.025) : 0;
    }
    // what they cover in all: as many diameters, but where they are dense
    if (share < 0.9)
        NEAR(sum, n / 2 * d, 1e-12);
    bench_close(&b);
}

static void test_cover_parcels(void **state) {
    (void)state;
    check_cover(0.03, 0.06, 0.5);
    check_cover(0.03, 0.03, 1);
    check_cover(0.03, 0.04, 0.75);
}

// ---------------------------------------------------------------- in the long run

// m/s by which a flat bed sinks in a uniform stream: the slope of its mass over time between a tenth and seven tenths gone. ragged:
// nodes begin with different wear, so that single patches leave and the surface is in steps
static double sinking(silt_bed_law law, double size, bool ragged, double *formula, int *releases) {
    bench b;
    bench_open(&b, size);
    bench_sand(&b, law, 1e-3);
    b.scene.bed.erodibility = 1e-5;
    b.scene.bed.work = 1e4;
    b.scene.bed.threshold = law == BED_SHIELDS ? 0 : 2;
    bench_box(&b, 0, 0, 0.6, 1.5);
    bench_wall(&b, 4, (double[]){0, 2, 0, 0, 0.6, 0, 0.6, 2});
    bench_create(&b);
    b.scene.fluid.size = 0.01;
    // the stream is there wherever the bed has gone
    bench_water(&b, 0, 0, 0.6, 1.6, 0.1, 1, 0);
    uint64_t seed = 7;
    for (int i = 0; i < b.bed.n_node && ragged; i++)
        if (b.bed.exposed[i]) {
            silt_patch patch;
            silt_bed_patch(&b.bed, i, &patch);
            b.bed.eroded[i] = silt_uniform(&seed) * patch.mass / (patch.area / patch.height);
        }
    const double tau = 1000 * silt_square(SILT_KAPPA / log(30 * 0.02 / 0.0025)), level = silt_bed_threshold(&b.scene);
    *formula = silt_bed_rate(&b.scene, tau, level, level);
    const double initial = b.bed.solid_mass, dt = 0.05 * size / *formula;
    double n = 0, t = 0, m = 0, tt = 0, tm = 0;
    *releases = 0;
    for (int step = 1; b.bed.solid_mass > 0.3 * initial; step++) {
        assert_true(step < 20000);
        bench_wear(&b, dt);
        int due[512];
        const int n_due = silt_bed_due(&b.bed, &b.scene, 512, due);
        for (int k = 0; k < n_due; k++) {
            silt_patch patch;
            silt_bed_patch(&b.bed, due[k], &patch);
            *releases += patch.n_cell > 0;
            silt_bed_release(&b.bed, &b.scene, &patch);
        }
        const double gone = initial - b.bed.solid_mass;
        if (gone > 0.1 * initial) {
            n++;
            t += step * dt;
            m += gone;
            tt += silt_square(step * dt);
            tm += step * dt * gone;
        }
    }
    bench_close(&b);
    return (n * tm - t * m) / (n * tt - t * t) / (2650 * 0.6 * 0.6);
}

static void test_sinking(void **state) {
    (void)state;
    static const silt_bed_law law[3] = {BED_POWER, BED_EXCESS_SHEAR, BED_SHIELDS};
    static const char *const name[3] = {"power", "excess-shear", "shields"};
    for (int l = 0; l < 3; l++)
        for (int fine = 0; fine < 2; fine++)
            for (int ragged = 0; ragged < 2; ragged++) {
                double formula;
                int releases;
                const double rate = sinking(law[l], fine ? 0.02 : 0.04, ragged, &formula, &releases);
                print_message("%s, patches of %g m%s: %.4f of the formula's %.3g m/s over %d releases\n", name[l], fine ? 0.02 : 0.04,
                              ragged ? ", ragged" : "", rate / formula, formula, releases);
                assert_true(fabs(rate - formula) < 0.01 * formula && releases > 300);
            }
}

// ---------------------------------------------------------------- slopes that fall

// steepest ground that is left of a bed whose angle of repose is 32 degrees, degrees; *fell: share of its mass that fell
static double fallen(int n, const double *outline, double *fell, int *rounds) {
    bench b;
    bench_open(&b, 0.02);
    bench_sand(&b, BED_EXCESS_SHEAR, 1e-3);
    b.scene.bed.repose = 32;
    bench_polygon(&b, n, outline);
    bench_wall(&b, 4, (double[]){-1, 1, -1, 0, 2, 0, 2, 1});
    bench_create(&b);
    const double initial = b.bed.solid_mass;
    double left = 0;
    int node[64];
    *rounds = 0;
    for (int k; (k = silt_bed_steep(&b.bed, &b.scene, 64, node)) > 0 && *rounds < 500; ++*rounds)
        for (int q = 0; q < k; q++) {
            silt_patch patch;
            silt_bed_patch(&b.bed, node[q], &patch);
            if (patch.n_cell && b.bed.exposed[node[q]]) {
                left += patch.mass;
                silt_bed_release(&b.bed, &b.scene, &patch);
            }
        }
    check_bed(&b);
    NEAR(b.bed.solid_mass + left, initial, 1e-12 * initial);
    // the steepest straight line between points of the surface five cells apart
    double steepest = 0;
    for (double x = -0.9; x < 1.8; x += 0.01) {
        const double low = silt_bed_level(&b.bed, (double[2]){x, 0}), high = silt_bed_level(&b.bed, (double[2]){x + 0.1, 0});
        if (isfinite(low) && isfinite(high))
            steepest = silt_max(steepest, fabs(high - low) / 0.1);
    }
    *fell = left / initial;
    bench_close(&b);
    return atan(steepest) * 180 / M_PI;
}

static void test_repose(void **state) {
    (void)state;
    double fell;
    int rounds;
    // 28 degrees stand, 60 fall to about 32
    NEAR(fallen(4, (double[]){0, 0, 0.3, 0.1595, 0.7, 0.1595, 1, 0}, &fell, &rounds), 28, 0.5);
    assert_true(fell == 0 && rounds == 0);
    const double steepest = fallen(4, (double[]){0, 0, 0.1155, 0.2, 0.8845, 0.2, 1, 0}, &fell, &rounds);
    print_message("60 degrees fell to %.1f in %d rounds, %.1f %% of the mass\n", steepest, rounds, 100 * fell);
    // the slope under 32 degrees from the toes takes 23 % away
    assert_true(steepest < 36 && fabs(fell - 0.23) < 0.03);
}

// ---------------------------------------------------------------- grains of a patch

static void test_sieve(void **state) {
    (void)state;
    // half of the mass between 1 and 2 mm, half between 2 and 4 mm; patches as heavy as a grain of 9 mm
    double row[6] = {0.001, 0, 0.002, 0.5, 0.004, 1}, share[256], finer[4] = {0}, whole = 0;
    const silt_series sieve = {.n_row = 3, .n_column = 2, .value = row};
    int most = 0;
    for (int patch = 0; patch < 1000; patch++) {
        const uint64_t seed = silt_hash(0, &patch, sizeof patch);
        const int n = silt_sieve_draw(&sieve, seed, 0.009, 3, 256, share);
        most = n > most ? n : most;
        double sum = 0, again[256];
        assert_int_equal(silt_sieve_draw(&sieve, seed, 0.009, 3, 256, again), n);
        assert_memory_equal(again, share, (size_t)n * sizeof *share);
        for (int k = 0; k < n; k++) {
            const double d = 0.009 * cbrt(share[k]);
            sum += share[k];
            for (int q = 0; q < 4; q++)
                finer[q] += d < (q + 1) * 0.001 * (q == 3 ? 0.999 : 1) || q == 3 ? share[k] : 0;
        }
        NEAR(sum, 1, 1e-14);
        whole += sum;
    }
    // scaling to the exact mass shifts the sizes a little
    NEAR(finer[0] / whole, 0, 0.02);
    NEAR(finer[1] / whole, 0.5, 0.02);
    NEAR(finer[2] / whole, 0.75, 0.02);
    print_message("passing 2 and 3 mm: %.3f and %.3f of the mass, at most %d grains\n", finer[1] / whole, finer[2] / whole, most);
    assert_in_range(most, 100, 255);
}

// ---------------------------------------------------------------- what was deposited

static void test_deposited(void **state) {
    (void)state;
    bench b;
    bench_open(&b, 0.05);
    bench_sand(&b, BED_FRICTIONAL_WORK, 1e-3);
    b.scene.bed.shear = SHEAR_GRADIENT;
    b.scene.bed.work = 100;
    b.scene.bed.deposit_work = 10;
    bench_stream(&b, 0, 100);
    assert_int_equal(b.bed.n_first, b.bed.n_node);
    // a parcel that leaves a cell looser than the bed: its new node has the deposit's work
    silt_deposit deposit;
    const double mass = 0.4 * 2650 * 0.05 * 0.03 / 2, whole = b.bed.solid_mass;
    assert_int_equal(silt_bed_deposit(&b.bed, &b.scene, (double[]){0.275, 0.13, 0}, 0.02, mass, NULL, &deposit), DEPOSIT_CELL);
    assert_true(deposit.node >= b.bed.n_first);
    for (int i = 0; i < b.bed.n_node; i++)
        NEAR(silt_bed_work(&b.bed, &b.scene, i), i == deposit.node ? 10 : 100, 0);
    int due[8];
    b.bed.work[deposit.node] = 10;
    assert_int_equal(silt_bed_due(&b.bed, &b.scene, 8, due), 1);
    assert_int_equal(due[0], deposit.node);
    // the paper's rule: another one goes into that cell's pores as long as it is looser than the bed, then no more
    const double loose = 2650 * 0.6 * b.bed.area[deposit.cell[0]] - b.bed.mass[deposit.cell[0]];
    assert_true(loose > 0);
    silt_deposit more;
    assert_int_equal(silt_bed_densify(&b.bed, &b.scene, (double[]){0.275, 0.15, 0}, 0.04, 0.4, 1.01 * loose, &more), DEPOSIT_REFUSED);
    assert_int_equal(silt_bed_densify(&b.bed, &b.scene, (double[]){0.275, 0.15, 0}, 0.04, 0.4, loose, &more), DEPOSIT_DENSER);
    NEAR(more.pore_water, -loose / 2650 * 1000, 1e-12);
    assert_int_equal(silt_bed_densify(&b.bed, &b.scene, (double[]){0.275, 0.15, 0}, 0.04, 0.4, 0.01 * loose, &more), DEPOSIT_REFUSED);
    NEAR(b.bed.solid_mass, whole + mass + loose, 1e-12 * whole);
    // the stress that keeps it from being bed is that of the nearest node
    b.bed.shear[deposit.node] = 0.7;
    NEAR(silt_bed_shear_at(&b.bed, (double[]){0.275, 0.16, 0}), 0.7, 0);
    bench_close(&b);
}

// ---------------------------------------------------------------- the ledger

// 10000 releases and deposits: the mass of bed, grains and what left, and the water of pores and flow, close to the last bits
static void test_ledger(void **state) {
    (void)state;
    bench b;
    bench_open(&b, 0.05);
    bench_sand(&b, BED_EXCESS_SHEAR, 1e-3);
    bench_box(&b, 0, 0, 1, 0.3);
    bench_wall(&b, 4, (double[]){0, 2, 0, 0, 1, 0, 1, 2});
    b.scene.bed.saturation = 0.7;
    bench_create(&b);
    enum { GRAINS = 4000 };
    double *grain = silt_alloc(GRAINS, sizeof *grain), left = 0, left_rest = 0;
    double released = 0, released_rest = 0, deposited = 0, deposited_rest = 0;
    const double initial = b.bed.solid_mass, pores = pore_water(&b);
    uint64_t random = 11;
    int n = 0, n_release = 0, n_deposit = 0, n_left = 0;
    for (int event = 0; n_release < 5000 || n_deposit < 5000; event++) {
        assert_true(event < 100000);
        if (b.bed.solid_mass > 0.5 * initial && n + 3 < GRAINS) {
            // any node of the surface, in three parcels
            int node = (int)(silt_random(&random) % (uint64_t)b.bed.n_node);
            while (!b.bed.exposed[node])
                node = (node + 1) % b.bed.n_node;
            silt_patch patch;
            silt_bed_patch(&b.bed, node, &patch);
            silt_bed_release(&b.bed, &b.scene, &patch);
            silt_sum(&released, &released_rest, patch.mass);
            grain[n] = grain[n + 1] = patch.mass / 3;
            grain[n + 2] = patch.mass - grain[n] - grain[n + 1];
            n += 3;
            n_release++;
        }
        // grains somewhere on the surface; few leave for ever
        for (int k = 0; k < 4 && n > 0 && b.bed.n_edge > 0; k++) {
            const int *edge = b.bed.edge[silt_random(&random) % (uint64_t)b.bed.n_edge];
            double x[3] = {0}, out[3] = {0};
            silt_bed_facet_normal(&b.bed, edge, out);
            for (int d = 0; d < 2; d++)
                x[d] = 0.5 * (b.bed.x[edge[0]][d] + b.bed.x[edge[1]][d]) + 0.03 * out[d] / hypot(out[0], out[1]);
            silt_deposit deposit;
            if (silt_bed_deposit(&b.bed, &b.scene, x, 0.03, grain[n - 1], NULL, &deposit) != DEPOSIT_REFUSED) {
                silt_sum(&deposited, &deposited_rest, grain[--n]);
                n_deposit++;
            } else if (silt_random(&random) % 200 == 0) {
                silt_sum(&left, &left_rest, grain[--n]);
                n_left++;
            }
        }
        double sum = b.bed.solid_mass, rest = 0;
        for (int k = 0; k < n; k++)
            silt_sum(&sum, &rest, grain[k]);
        silt_sum(&sum, &rest, left);
        NEAR(sum, initial, 1e-13 * initial);
        NEAR(b.bed.solid_mass, initial - released + deposited, 1e-13 * initial);
        NEAR(b.bed.pore_water + pore_water(&b), pores, 1e-12 * pores);
    }
    print_message("%d releases, %d deposits, %d left\n", n_release, n_deposit, n_left);
    assert_true(n_left > 10);
    free(grain);
    bench_close(&b);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_shields), cmocka_unit_test(test_slope),    cmocka_unit_test(test_rate),    cmocka_unit_test(test_log_law),
        cmocka_unit_test(test_gradient), cmocka_unit_test(test_cover), cmocka_unit_test(test_cover_parcels), cmocka_unit_test(test_sinking),
        cmocka_unit_test(test_repose),   cmocka_unit_test(test_sieve),   cmocka_unit_test(test_deposited), cmocka_unit_test(test_ledger),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
