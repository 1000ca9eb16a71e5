/** @file bed.h
 * The bed: its own mesh of bed material; frictional work at its surface; release and deposition. Knows nothing of discrete elements.
 */
#ifndef SILT_BED_H
#define SILT_BED_H

#include "pfem.h"

enum { PATCH_CELLS = 128 };

/** what a bed node takes along when it is released: all bed cells around it */
typedef struct silt_patch {
    int node;
    double centre[3]; // centroid of the patch, m
    double normal[3]; // unit, out of the bed at the node
    double mass;      // kg/m, in space kg, solid
    double area;      // m2, in space m3
    double height;    // m, area over exposed length at the node (half of its exposed edges'); 0 while not exposed
    int n_cell;
    int cell[PATCH_CELLS]; // bed cells
} silt_patch;

enum { DEPOSIT_CELLS = 32, DEPOSIT_OTHERS = 32 };

typedef enum {
    DEPOSIT_REFUSED = 0, // too far from the bed, or no sound place
    DEPOSIT_CELL,        // the bed grew by cells with a new node
    DEPOSIT_DENSER,      // the mass went into the pores of a cell that was there
} silt_deposit_kind;
typedef struct silt_deposit {
    silt_deposit_kind kind;
    int node;          // the new bed node, or -1
    int n_cell;
    int cell[DEPOSIT_CELLS]; // the new cells
    int n_other;
    int other[DEPOSIT_OTHERS]; // grains that became bed with the parcel
    double mass;       // kg/m, theirs and the parcel's
    double area;       // m2, in space m3, of the new cells
    double pore_water; // kg/m, water taken out of the flow by the new pores (negative: displaced out of pores)
} silt_deposit;

/** Fills the bed's regions with nodes at spacing bed.size and cells between them.
 * @param walls  borrowed while the bed lives; may be NULL in the plane */
silt_status silt_bed_create(silt_bed *bed, const silt_scene *scene, const silt_walls *walls, silt_error *err);
void silt_bed_clear(silt_bed *bed);
/** unit normal out of the bed at an exposed node, from its exposed edges: as many numbers as dimensions */
void silt_bed_normal(const silt_bed *bed, int node, double *normal);
/** normal of an exposed edge or face out of the bed, as long as the edge, in space the face's area */
void silt_bed_facet_normal(const silt_bed *bed, const int facet[3], double *normal);
/** distance of x from an edge or a face */
double silt_bed_facet_distance(const silt_bed *bed, const int facet[3], const double *x);
void silt_bed_patch(const silt_bed *bed, int node, silt_patch *patch);
/** Takes the patch out of the bed: its cells vanish, nodes without cells die (their fluid_node stays for the caller to read),
 * newly exposed ones start with the excess over W_c, shared over their lengths of surface, at most one layer. The pore water
 * of the patch is added to bed->pore_water. The patch must be that of the bed as it is: any change renumbers cells. */
void silt_bed_release(silt_bed *bed, const silt_scene *scene, const silt_patch *patch);
/** The same where many leave: the list of edges, bed->solid_mass and the revision are right again after silt_bed_refresh, one for all. */
void silt_bed_take_out(silt_bed *bed, const silt_scene *scene, const silt_patch *patch);
/** After cells or edges changed: the list of edges, exposed, solid_mass; raises the revision. */
void silt_bed_refresh(silt_bed *bed);
/** Nodes whose patches hold small pieces that hang in the water: under ten patches, no edge on a wall, joined to the rest of
 * the bed by nodes at most. Releasing them all (each patch asked for anew) may need another call when the piece has cells
 * inside. @return how many (at most capacity) */
int silt_bed_loose(const silt_bed *bed, const silt_scene *scene, int capacity, int *node);
/** a grain beside the parcel that becomes bed */
typedef struct silt_bed_other {
    double x[3], radius, mass; // kg/m
    int grain;    // index in the state
    bool at_rest; // it may become bed with the parcel
    bool bed;     // it has become bed, or is the parcel itself
} silt_bed_other;
typedef struct silt_bed_others {
    int count;
    silt_bed_other *grain; // owned, by rising x[0]
    double largest;        // m, radius
} silt_bed_others;
/** @param at_rest  one per grain */
void silt_bed_others_take(silt_bed_others *others, const silt_grain_state *grains, const uint8_t *at_rest);
/** whether the grain at x counts as bed from here on */
void silt_bed_others_mark(silt_bed_others *others, const double *x, bool bed);
void silt_bed_others_clear(silt_bed_others *others);
/** Puts a parcel's solid mass (kg/m) at x (radius r) back on the bed. The new node is at x; up to r higher where that would
 * leave the mass too little room; on a wall that is nearer than half a spacing and where the surface ends. Grains that new
 * cells hold, or come nearer to than half their radius, become bed with it if they are at rest and the cells have room for their mass;
 * if not there is no such cell. deposit->cell holds until the next change.
 * @param others  NULL: none
 * @return also in deposit->kind */
silt_deposit_kind silt_bed_deposit(silt_bed *bed, const silt_scene *scene, const double *x, double r, double mass,
                                   const silt_bed_others *others, silt_deposit *deposit);
bool silt_bed_contains(const silt_bed *bed, const double *x);
/** true when an exposed node lies nearer than reach */
bool silt_bed_near(const silt_bed *bed, const double *x, double reach);
/** height of the bed's surface at x, in space at (x, y), or -HUGE_VAL where there is none */
double silt_bed_level(const silt_bed *bed, const double *at);
/** in the plane: the lowest height of the bed's surface from x = from to to, HUGE_VAL where there is none */
double silt_bed_lowest(const silt_bed *bed, double from, double to);
silt_status silt_bed_save(const silt_bed *bed, silt_store *store, silt_error *err);
/** @param walls  as for silt_bed_create */
silt_status silt_bed_load(silt_bed *bed, const silt_walls *walls, silt_store *store, silt_error *err);

#endif
