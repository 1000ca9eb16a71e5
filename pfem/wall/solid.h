/** @file solid.h
 * Rigid objects in space as geometry: a closed triangulated surface with its integrals and a search tree, what can be wrong with one,
 * and the same surface with triangles of another size.
 */
#ifndef SILT_SOLID_H
#define SILT_SOLID_H

#include "base.h"

/** a box of the tree: a leaf with `count` faces, or the parent of the boxes `first` and first + 1 (count 0) */
typedef struct silt_solid_box {
    double lo[3], hi[3];
    int first, count;
} silt_solid_box;

typedef struct silt_solid {
    int n_point, n_face;
    double (*point)[3];   // owned, m
    int (*face)[3];       // owned, points, counter-clockwise from outside
    // made by silt_solid_close
    double volume;        // m3
    double centroid[3];   // m
    double inertia[6];    // m5, of density 1 about the centroid: xx, yy, zz, xy, xz, yz (the products with a minus, as in the tensor)
    double radius;        // m, of the sphere about the centroid that holds it
    int (*beside)[3];     // owned, face across the edge that starts at each corner
    double (*normal)[3];  // owned, per face, unit, outwards
    double (*corner)[3];  // owned, per point, normals summed by angle (Baerentzen and Aanaes 2005)
    int n_box;
    silt_solid_box *box;  // owned
    int *item;            // owned, faces in the order of the leaves
} silt_solid;

void silt_solid_clear(silt_solid *solid);
/** Makes what hangs on points and faces, which the caller has filled in. Errors (SILT_INPUT), each with a place: no faces, an edge
 * without a second face (open), two faces turned against each other, all faces turned inwards, no volume, faces that cross.
 * @param what  begins the message */
silt_status silt_solid_close(silt_solid *solid, const char *what, silt_error *err);
/** after points have moved as one stiff piece, or by little; no checks */
void silt_solid_refit(silt_solid *solid);
/** Distance to the surface, m, negative inside. @param on, face  out: the nearest point and its face; may be NULL */
double silt_solid_distance(const silt_solid *solid, const double x[3], double on[3], int *face);
/** The same without a sign, over faces that `wanted` holds only (NULL: all). Beyond `far` HUGE_VAL may come. */
double silt_solid_nearest(const silt_solid *solid, const double x[3], double far, const uint8_t *wanted, double on[3], int *face);
bool silt_solid_contains(const silt_solid *solid, const double x[3]);
/** First face that a ray from x (not on the surface, or leaving it) meets beyond `least`. @return the way, HUGE_VAL: none */
double silt_solid_ray(const silt_solid *solid, const double x[3], const double direction[3], double least, int *face);
/** Faces whose boxes meet the box; appended to *list */
void silt_solid_query(const silt_solid *solid, const double lo[3], const double hi[3], int **list, int *n, int *capacity);
/** a face of `other` that crosses the surface, -1: none; both in the same frame */
int silt_solid_crossing(const silt_solid *solid, const silt_solid *other);

/** The surface with edges of about h, few longer: bends above 20 degrees and what ends there are kept, what is smooth in between stays
 * so, and round parts stand a little outside of the given triangles, so that the volume is the same.
 * Errors (SILT_INPUT): it crosses itself at this size.
 * @param fine  closed  @param mesh  out, closed */
silt_status silt_solid_mesh(const silt_solid *fine, double h, const char *what, silt_solid *mesh, silt_error *err);

#endif
