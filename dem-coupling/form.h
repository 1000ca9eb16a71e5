/** @file form.h
 * Rigid objects in space: the surface of every shape that a scene can name, and the clump of spheres inside one that makes its
 * contacts. In the body's frame: origin at the centroid, not turned, metres.
 */
#ifndef SILT_FORM_H
#define SILT_FORM_H

#include "shape.h"
#include "solid.h"

/** Makes the surface of a body of the scene about its centroid, so fine that its volume is that of the shape.
 * Errors (SILT_INPUT): a shape that is of the plane only, a file that cannot serve, see silt_solid_close. */
silt_status silt_form_create(silt_solid *solid, const silt_body_def *body, silt_error *err);
/** m, how thick the thinnest part is: the least way through the body between faces that look away from each other */
double silt_form_thickness(const silt_solid *solid);
/** Fills the inside with spheres that touch the surface; large ones on faces, small ones along edges.
 * @param error  m, how far a point of the surface may be from the nearest sphere; 0: a fifteenth of the thickness
 * The clump has four numbers per sphere: x, y, z, radius; what was reached stands in clump->error. */
void silt_form_clump(silt_clump *clump, const silt_solid *solid, double error);
/** the largest distance from a point of the surface to the nearest sphere, m */
double silt_form_clump_error(const silt_clump *clump, const silt_solid *solid);

#endif
