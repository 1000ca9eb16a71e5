/** @file dem_check.h
 * What a definition of discrete elements must be; part of dem.c.
 */
#ifndef SILT_DEM_CHECK_H
#define SILT_DEM_CHECK_H

#include "dem.h"

bool silt_dem_finite(int n, const double *value);
/** SILT_FAILED: which number is none that LIGGGHTS can use */
silt_status silt_dem_check(const silt_dem_def *def, silt_error *err);

/** SILT_FAILED: what is wrong with a rigid body; index: as messages call it */
silt_status silt_dem_check_body(const silt_dem_def *def, int index, const silt_dem_body *body, silt_error *err);
/** where sphere i of a body is at its start; @return its radius */
double silt_dem_sphere_at(const silt_dem_def *def, const silt_dem_body *body, int i, double x[3]);

/** SILT_FAILED: a force of a run that is not finite */
silt_status silt_dem_check_load(const silt_dem_def *def, const silt_dem_state *state, const double *force, const double *body_force,
                                const double *body_torque, silt_error *err);

/** a place as it stands in messages: two numbers in the slab, three in space */
typedef struct silt_dem_text {
    char text[96];
} silt_dem_text;
silt_dem_text silt_dem_place(const silt_dem_def *def, const double *x);

#endif
