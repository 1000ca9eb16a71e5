/** @file dem_bench.h
 * The discrete elements for tests: a box, grains, runs through a real worker; after cmocka.h. LOG: the name of its log.
 */
#ifndef SILT_DEM_BENCH_H
#define SILT_DEM_BENCH_H

#include "../dem-coupling/dem.h"

#include "check.h"

#define FAILS(call, part)                                                                                              \
    do {                                                                                                               \
        error = (silt_error){0};                                                                                       \
        assert_int_equal((call), SILT_FAILED);                                                                         \
        if (!strstr(error.text, (part)))                                                                               \
            fail_msg("\"%s\" is not in \"%s\"", (part), error.text);                                                   \
    } while (0)

// glass-like grains of 1 cm in a box of 2 m
static inline silt_dem_def plain(void) {
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

static inline silt_dem_sphere grain(int64_t id, double x, double y) {
    return (silt_dem_sphere){.id = id, .x = {x, y, 0}, .radius = 0.01, .density = 2500};
}

static inline const silt_dem_state *advance(silt_dem *dem, int n, const double *force, const double *body_force,
                                     const double *body_torque) {
    OK(silt_dem_start(dem, n, force, body_force, body_torque, &error));
    OK(silt_dem_wait(dem, &error));
    return silt_dem_state_now(dem);
}

static const double mass = 2500 * 4.0 / 3.0 * M_PI * 1e-6;

// a plus of five spheres; mass and inertia are given, not those of the spheres
static const double plus[15] = {0, 0, 0.01, 0.012, 0, 0.008, -0.012, 0, 0.008, 0, 0.012, 0.008, 0, -0.012, 0.008};

#endif
