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
/** What the patch's node has beyond what its release takes, at most a layer: J/m3 of work and kg/m2 worn off; 0 when it is not exposed. */
void silt_bed_excess(const silt_bed *bed, const silt_scene *scene, const silt_patch *patch, double *work, double *eroded);

#endif
