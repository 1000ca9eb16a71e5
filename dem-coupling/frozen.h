/** @file frozen.h
 * Spheres that never move: the crust along the exposed edges of the bed, in space under its faces, and grains that were deposited. Here they are
 * kept as a list; which of them the discrete elements have been told of stands in `sent`.
 */
#ifndef SILT_FROZEN_H
#define SILT_FROZEN_H

#include "bed.h"

typedef struct silt_frozen_sphere {
    int64_t id;
    double x[3], radius;
    int node[3];      // bed nodes of the edge (the third is -1) or face that it lies along, -1: a deposited grain
    double end[3][3]; // where these nodes were: an edge that is the same keeps its spheres
    bool sent;
} silt_frozen_sphere;

typedef struct silt_frozen {
    int count, capacity;
    silt_frozen_sphere *sphere; // owned, rising id
    int n_edge, edge_capacity;
    struct silt_frozen_edge *edge; // owned, scratch of an update
} silt_frozen;

/** free distance in m from x to whatever moves, `far` where it is more: a new frozen sphere is made smaller rather than pushed into it */
typedef double (*silt_frozen_gap)(const void *context, const double *x, double far);
/** told of a sphere that goes and that the discrete elements know */
typedef void (*silt_frozen_drop)(void *context, int64_t id);

/** Brings the spheres along the bed's exposed edges up to date, and drops deposited grains that the bed no longer
 * carries. Only edges that changed are touched. New spheres have `radius` at most, take ids from *next_id and are not
 * sent. */
void silt_frozen_update(silt_frozen *frozen, const silt_bed *bed, double radius, int64_t *next_id, silt_frozen_gap gap,
                        silt_frozen_drop drop, void *context);
/** a deposited grain */
void silt_frozen_add(silt_frozen *frozen, const double x[3], double radius, int64_t *next_id);
void silt_frozen_clear(silt_frozen *frozen);

#endif
