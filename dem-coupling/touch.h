/** @file touch.h
 * Which spheres touch: counted from positions alone, so that a restarted worker counts the same.
 */
#ifndef SILT_TOUCH_H
#define SILT_TOUCH_H

#include "protocol.h"

/** Counts the partners of every grain (type DEM_TYPE_GRAIN): grains, frozen spheres, bodies' spheres, walls.
 * @param x, radius, type  of n spheres; in the slab all have z = 0
 * @param plane  per wall, then per triangle: 1 taken as an infinite line or plane, 0 as it is, -1 not there
 * @param contacts, on_bed  out, n each; on_bed: a frozen sphere (fixed bodies too) or a wall is among them
 * @return 0, or -1 without memory */
int touch_count(int n, double *const *x, const double *radius, const int *type, const dem_shared *shared,
                const int *plane, int *contacts, int *on_bed);

#endif
