/** @file bed_law.h
 * Erosion laws: what the water's shear wears off the bed's surface, node by node, until a patch is due.
 */
#ifndef SILT_BED_LAW_H
#define SILT_BED_LAW_H

#include "bed.h"

/** Adds a step's frictional work at the exposed nodes (law, threshold and distance of the scene), and refreshes bed->shear. */
void silt_bed_wear(silt_bed *bed, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                   const silt_locator *locator, double dt);
/** Exposed nodes whose accumulator is full, fullest first: work >= W_c, with a layer eroded >= mass per exposed length of the
 * patch. Ask once a step: what that step's releases expose comes in the next. @return how many (at most capacity) */
int silt_bed_due(const silt_bed *bed, const silt_scene *scene, int capacity, int *due);
/** The nodes around a patch that is about to leave, and what its node has worn off beyond it */
typedef struct silt_bed_heirs {
    int count, node_capacity, length_capacity;
    int *node;      // owned, all nodes of the patch
    double *length; // owned, m, of surface before the release, 0: buried
    double work, work_length; // J/m3 times m of surface
    double eroded;            // kg/m
} silt_bed_heirs;
void silt_bed_heirs_take(silt_bed_heirs *heirs, const silt_bed *bed, const silt_scene *scene, const silt_patch *patch);
/** After the patch has left: newly exposed nodes start with the excess, shared over their surface; where there are none those around
 * take it. Nodes whose surface changed keep the mass that was worn off them, not the mass per area: over many releases the mass that
 * leaves is the mass that was worn off. Empties heirs. */
void silt_bed_heirs_give(silt_bed_heirs *heirs, silt_bed *bed);

#endif
