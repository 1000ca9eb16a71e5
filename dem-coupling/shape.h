/** @file shape.h
 * Rigid objects as geometry: the outline that the water sees, its exact area and inertia, and the clump of spheres
 * inside it that makes its contacts. Everything in the body's frame: origin at the centroid, angle 0, metres.
 */
#ifndef SILT_SHAPE_H
#define SILT_SHAPE_H

#include "scene.h"

typedef struct silt_outline {
    int n_point;
    double *point;  // owned, 2 per point, counter-clockwise simple polygon about its centroid
    double area;    // m2, of the polygon
    double inertia; // m4, integral of x^2 + y^2 over the polygon; times the density: kg m2 per m of width
    double radius;  // m, of the circle about the centroid that holds the outline
} silt_outline;

/** spheres along the inside of the outline or surface, tangent to it */
typedef struct silt_clump {
    int n_sphere, capacity;
    double *sphere;           // owned, 3 per sphere: x, y, radius; of a surface (form.h) 4: x, y, z, radius
    double largest, smallest; // m, radii
    double error;             // m, see silt_clump_error
} silt_clump;

/** Makes the outline of a body of the scene: box, disc (a polygon of 128 points), capsule, wedge, polygon
 * or temple, `scale` wide.
 * Errors (SILT_INPUT): a polygon with fewer than 3 points, without area, or that crosses itself. */
silt_status silt_outline_create(silt_outline *shape, const silt_body_def *body, silt_error *err);
void silt_outline_clear(silt_outline *shape);

/** Points on the outline at spacing h or a little less, counter-clockwise, corners kept; for the water's mesh.
 * @param point     2 per point, may be NULL to count only
 * @param capacity  points that `point` holds
 * @return how many points there are (more than capacity: none beyond it are written) */
int silt_outline_nodes(const silt_outline *shape, double h, double *point, int capacity);

/** Fills the inside of the outline with spheres that touch it; smaller ones, down to a quarter, go into the corners.
 * @param radius   m, of the spheres where they fit; 0: a quarter of the thinnest part, at most 0.06 of the width
 * @param spacing  between centres along the outline as a share of the local radius, 0.2 to 0.4 */
void silt_clump_create(silt_clump *clump, const silt_outline *shape, double radius, double spacing);
void silt_clump_clear(silt_clump *clump);
/** the largest distance in m from a point of the outline to the nearest sphere's surface; no sphere stands out by
 * more than 0.002 of its radius */
double silt_clump_error(const silt_clump *clump, const silt_outline *shape);

/** distance in m from a point in the body's frame to the body: 0 inside */
double silt_outline_distance(const silt_outline *shape, const double point[2]);

#endif
