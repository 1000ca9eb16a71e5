/** @file crowd.h
 * Spheres by place, in bins that grow with their number: how far a point is from the nearest of them.
 */
#ifndef SILT_CROWD_H
#define SILT_CROWD_H

#include "base.h"

typedef struct silt_crowd {
    int count, capacity;
    struct silt_crowd_sphere {
        double x[3], radius;
        int next; // of the same bin, -1
    } *sphere; // owned
    int n_head, head_capacity;
    int *head;      // owned, bins by a hash of their place: the last sphere there, -1
    double bin;     // m
    double largest; // m, radius
    int64_t lo[3], hi[3]; // bins that have been filled
} silt_crowd;

/** Empties it. @param bin  m, width of a bin: the usual sphere's diameter; in the plane all z are 0 */
void silt_crowd_start(silt_crowd *crowd, double bin);
void silt_crowd_add(silt_crowd *crowd, const double x[3], double radius);
/** free distance in m from x to the nearest sphere's surface, negative inside of it; `far` where that is less */
double silt_crowd_gap(const silt_crowd *crowd, const double x[3], double far);
void silt_crowd_clear(silt_crowd *crowd);

#endif
