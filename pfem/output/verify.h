/** @file verify.h
 * The inside of the checks, shared by verify*.c only: curves, and profiles read from frames.
 */
#ifndef SILT_VERIFY_H
#define SILT_VERIFY_H

#include "output.h"

/** ordinates over rising abscissas; a NaN ordinate is a gap */
typedef struct silt_curve {
    int n, capacity_x, capacity_y;
    double *x, *y; // owned
} silt_curve;
void silt_curve_add(silt_curve *curve, double x, double y);
void silt_curve_clear(silt_curve *curve);
/** ordinate at x, NaN outside and beside gaps */
double silt_curve_at(const silt_curve *curve, double x);
/** the scalar of a curve that is not empty, NaN when the curve does not have it */
double silt_curve_scalar(const silt_curve *curve, const silt_check_def *def);
/** The first abscissa where the ordinate passes `level`, upwards or downwards, or comes out of a gap above it; NaN:
 * never. */
double silt_curve_reaches(const silt_curve *curve, double level);

/** The profile of a check at the abscissas of a reference, from OUT's frames: linear in time between two frames. Where
 * no water is, the surface is that of the floor: the highest wall below in 2-D; else there is a gap.
 * @return false with a note (256 characters): no frames around the time, or none with the field */
bool silt_profile_sample(const silt_scene *scene, const char *out, const silt_check_def *def,
                         const silt_curve *reference, silt_curve *profile, char *note);
/** The same for PROFILE_GRAINS: grains in layers across the line, mean over the frames from `since` to `at`.
 * @return false with a note: the frames do not reach so far, or no grain is where the profile is to be 1 */
bool silt_profile_grains(const silt_scene *scene, const char *out, const silt_check_def *def, const silt_curve *reference,
                         silt_curve *profile, char *note);

/** What a check compared, told while it is measured: the result over its scaled abscissa, and the rows that it is held against. */
typedef struct silt_check_watch {
    void (*see)(void *self, int check, const silt_curve *result, const silt_curve *reference); // reference NULL: a scalar
    void *self;
} silt_check_watch;
/** silt_check_measure, with somebody who looks on (NULL: nobody) */
silt_status silt_check_measure_seen(const silt_scene *scene, const char *out, silt_check_result *result,
                                    const silt_check_watch *watch, silt_error *err);

#endif
