/** @file seed.h
 * What the two files that make the first cloud share: nodes in bins, and where the water's outline is.
 */
#ifndef SILT_SEED_H
#define SILT_SEED_H

#include "pfem.h"

typedef struct seed {
    silt_nodes *nodes;
    const silt_scene *scene;
    const silt_walls *walls;
    silt_solid_test solid; // may be NULL
    const void *context;
    silt_size *size; // owned, NULL: fluid.size everywhere
    int dim;
    double h;        // m, fluid.size
    double period;   // m, 0: none
    bool on_bed;     // nodes of a bed stand already: the water's grow from them
    // bins of nodes, each with the last node put there
    double lo[3], hi[3], width;
    int bin[3];
    int *grid, *link; // owned, last node of a bin, next node of the same bin
    int link_capacity;
    uint64_t random;
} seed;

/** a part of the outline or the inside that is filled as one: nodes move within it */
typedef struct seed_part {
    int region;
    enum { PART_INSIDE, PART_FACE, PART_SPHERE } kind;
    double origin[3], u[3], v[3], normal[3]; // PART_FACE: its plane, u, v and normal of length 1
    silt_region flat;                        // PART_FACE: the polygon in u, v; points owned
} seed_part;

// seed.c
double seed_h(const seed *s, const double *x);                           // m, wanted distance at a place
double seed_apart(const seed *s, const double *a, const double *b);      // m, across a periodic border too
bool seed_crowded(const seed *s, const double *x, double gap);           // a node lies closer than gap
int seed_near(const seed *s, const double *x, double reach, int room, int *list); // nodes within reach, at most `room`
int seed_add(seed *s, silt_node_kind kind, int owner, const double *x);
void seed_enter(seed *s, int k);
void seed_sort(seed *s);                                                 // all nodes into their bins anew
bool seed_open(const seed *s, int region, const double *x);              // on the water's outline, not within it
void seed_water(seed *s, const double *x, double gap, double margin);    // a node of the outline, on walls where it touches

// seed_fill.c
/** A region where the plain lattice of the plane does not do: in space, or with a size field. */
void seed_fill_region(seed *s, int region);
void seed_fill_outline(seed *s, int region);
/** points on the outline about `spacing` apart, dim numbers each; *x malloc'ed. @return how many */
int seed_outline_samples(const seed *s, int region, double spacing, double **x);

#endif
