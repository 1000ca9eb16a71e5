/** @file seep.h
 * Seepage: water in the pores of a rigid bed by Darcy's law, q = -(k/mu) (grad p - rho g), div q = 0, on the bed's own mesh. Where
 * the bed is under water its pressure is the water's, and what goes in is what the water's continuity loses (seepage.c in fluid/);
 * elsewhere on its surface water comes out at p = 0 or not at all; walls let nothing through.
 */
#ifndef SILT_SEEP_H
#define SILT_SEEP_H

#include "bed.h"
#include "factor.h"

typedef enum {
    SEEP_NONE = 0, // no longer bed
    SEEP_INSIDE,   // its pressure is the bed's own unknown: inside, at walls, dry surface that lets nothing out
    SEEP_WATER,    // shares the pressure of the water's node on it
    SEEP_FACE,     // dry surface where water comes out: p = 0
} silt_seep_kind;

/** zeroed: nothing known yet */
typedef struct silt_seep {
    int n_node, n_cell;  // of the bed that the arrays belong to
    bool begun;          // it was prepared before
    // the state: saved, one per node of the bed
    double *pressure;    // owned, Pa, at the end of the last step
    double *lag;         // owned, Pa: the pressure that decides which pores are full
    uint8_t *face;       // owned, 1: water comes out here when it is dry
    // results, seen through the bed
    double *gradient;    // owned, per node, see silt_bed.seepage
    double *darcy;       // owned, dim per cell, m/s, q
    double entered;      // m3/s, of the last step, from the water into the bed
    double lost;         // m3/s, came out where no water is to take it
    // the system: symmetric rows over all nodes, made anew when the bed or what is full changes
    int64_t revision;    // of the bed that start and index belong to
    int n_water;         // nodes that share the water's pressure
    int *kind;           // owned, silt_seep_kind
    int *water;          // owned, the water's node, -1
    int *foot;           // owned, of a face: the node of kind SEEP_WATER that what comes out runs down to, -1
    double *mobility;    // owned, per cell, k/mu times its share of full pores, m2/(Pa s)
    int *start, *index;  // owned, rows
    double *value, *load; // owned, A and b: what goes into the bed at node a is (A p - b)_a, m3/s
    silt_factor factor;  // owned, A for the nodes inside, 1 for the others
    double *solution, *right, *into; // owned, per node, working space
    int node_capacity, cell_capacity, face_capacity, row_capacity;
    double *work, *basis; // owned, of the water's solver (seepage.c)
    int work_capacity, basis_capacity;
} silt_seep;

static inline bool silt_seep_on(const silt_scene *scene) { return scene->bed.on && scene->fluid.on && scene->bed.seepage != SEEPAGE_NONE; }
/** After the bed changed: room for its nodes; new ones take the pressure of the water on them. The bed gets to see the results. */
void silt_seep_fit(silt_seep *seep, silt_bed *bed, const silt_nodes *nodes);
/** Once a step, before the water's: which nodes are under water, where water comes out of dry surface, which pores are full.
 * Errors: SILT_FAILED when the bed's matrix breaks down. */
silt_status silt_seep_prepare(silt_seep *seep, silt_bed *bed, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                              silt_error *err);
/** taken += what the bed takes from the water's nodes at the pressure p, m3/s; what comes out of a dry face comes to its foot */
void silt_seep_take(silt_seep *seep, const double *p, double *taken);
/** out += what it takes from them more when the pressure rises by x: symmetric and not negative where no face is */
void silt_seep_apply(silt_seep *seep, const double *x, double *out);
/** The water's step is solved: the pressure in the bed, discharge, gradients. */
void silt_seep_accept(silt_seep *seep, silt_bed *bed, const silt_scene *scene, const double *p);
/** Discharge and gradients for the bed as it is now, after silt_seep_fit */
void silt_seep_results(silt_seep *seep, const silt_bed *bed, const silt_scene *scene);
/** pressure in the bed at a place; false outside of it */
bool silt_seep_pressure_at(const silt_bed *bed, const double *x, double *pressure);
silt_status silt_seep_save(const silt_seep *seep, silt_store *store, silt_error *err);
silt_status silt_seep_load(silt_seep *seep, silt_bed *bed, const silt_nodes *nodes, silt_store *store, silt_error *err);
void silt_seep_clear(silt_seep *seep);

#endif
