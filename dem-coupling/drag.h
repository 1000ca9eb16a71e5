/** @file drag.h
 * Drag laws of grains in water, for many grains at a time: what does not change within a step is worked out once.
 */
#ifndef SILT_DRAG_H
#define SILT_DRAG_H

#include "pfem.h"

enum { DRAG_NUMBERS = 4, DRAG_GROUP = 8 }; // the law's numbers of a grain; grains that are worked on together

/** F/(u - v) in kg/s of one grain of diameter d in water of solid fraction `solid`, at the relative speed w. Above a
 * solid fraction of 0.75 the formulas see 0.75. */
double silt_drag_factor(silt_drag_law law, double density, double viscosity, double d, double solid, double w);

/** The law's numbers of a group, each of which stands for `number` grains of diameter d */
void silt_drag_numbers(silt_drag_law law, double density, double viscosity, const double d[DRAG_GROUP],
                       const double number[DRAG_GROUP], const double solid[DRAG_GROUP], double out[DRAG_NUMBERS][DRAG_GROUP]);
/** F/(u - v) of a group of grains. @param numbers  one row of DRAG_GROUP each @param square  of the relative speed */
void silt_drag_group(silt_drag_law law, const double numbers[DRAG_NUMBERS][DRAG_GROUP], const double square[DRAG_GROUP],
                     double factor[DRAG_GROUP]);

#endif
