/** @file bed_grow.h
 * Deposition in space from inside, for bed_deposit.c.
 */
#ifndef SILT_BED_GROW_H
#define SILT_BED_GROW_H

#include "bed_mesh.h"

enum { GROW_FACES = DEPOSIT_CELLS - 1 };

/** a new node and the faces of the surface that it would cover */
typedef struct bed_growth3 {
    double x[3];
    int wall[3]; // elements of the walls that it lies on, -1
    int n, face[GROW_FACES]; // indices in bed->edge
    double volume; // m3, of the new cells
    bed_taking taking;
} bed_growth3;

/** The exposed face nearest to x of those that see it from the water's side, within reach; -1: none */
int silt_bed_face_below(const silt_bed *bed, const double *x, double reach, double *distance);
/** Would the bed grow soundly by cells between the surface around a face and a node that stands `lift` over x, with a porosity between
 * 0.2 and 0.8? Notches narrower than `notch` (radians) beside the new cells are filled. */
bool silt_bed_grow_try(const silt_bed *bed, const silt_scene *scene, int face, const double *x, double lift, double notch, double mass,
                       const silt_bed_others *others, bed_growth3 *growth);
/** Makes the cells: node, cells and their number in the deposit. */
void silt_bed_grow(silt_bed *bed, const silt_scene *scene, const bed_growth3 *growth, double mass, silt_deposit *deposit);

#endif
