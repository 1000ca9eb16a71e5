/** @file state.h
 * What the coupling keeps between steps, for coupling.c and checkpoint.c.
 */
#ifndef SILT_STATE_H
#define SILT_STATE_H

#include "coupling.h"

#include "dem.h"
#include "exchange.h"
#include "frozen.h"
#include "shape.h"

/** a discrete element as the coupling knows it; masses and forces per metre of width */
typedef struct coupling_grain {
    int64_t id;
    double x[3], v[3], omega[3];
    double radius, mass, solid; // m, kg/m, m3/m
    double diameter, number;    // for drag: m, grains per metre of width
    double force[3];            // N/m, the water's
    double contact[3], net;     // N/m, of the last step
    double old_x[3], old_v[3];  // before the substeps
    int contacts;
    int near; // a node of the water next to it when it was last located, -1: none
    uint8_t on_bed;
    bool sent, gone; // LIGGGHTS has it; it was deposited or left
} coupling_grain;

/** what grains() shows: borrowed by the caller, remade when it is stale */
typedef struct coupling_view {
    silt_grain_state state;
    bool fresh; // shows the grains as they are
    int capacity[9], map_capacity;
    int64_t *id;
    double *x, *v, *omega, *radius, *mass, *net;
    int *contacts, *map; // map: index into the grains
    uint8_t *on_bed;
} coupling_view;

typedef struct coupling_body {
    silt_outline shape;
    silt_clump clump;
    bool fixed;
    double old_v[3];
} coupling_body;

struct silt_coupling {
    const silt_scene *scene; // borrowed
    const silt_walls *walls; // borrowed
    silt_dem *dem;           // owned
    silt_dem_def dem_def;    // what it was opened with; its strings are borrowed
    int dim;                 // of the scene
    double (*wall)[4];       // owned, plane
    double (*triangle)[10];  // owned, space
    double width;            // m, accounting width: spheres stand for what is in this width of the slab; 1 in space
    double step;             // s, of the discrete elements
    double parcel;           // m, usual radius of a parcel, 0 without bed
    double crust;            // m, radius of the frozen spheres along the bed
    int64_t next_id;
    int64_t sent_id; // LIGGGHTS was told of all that came before it
    int n_grain, grain_capacity, n_gone; // gone ones are still in the list
    coupling_grain *grain;               // owned, rising id
    bool found;                          // the exchange has these grains where they are
    coupling_view *view;   // owned
    silt_frozen frozen;
    int n_drop, drop_capacity;
    int64_t *drop; // owned, ids that LIGGGHTS is to forget
    int n_last, last_capacity;
    int64_t *last; // owned, grains in LIGGGHTS' last state
    int n_loaded;  // grains that the exchange was prepared for
    bool wet;      // one of them is in the water
    silt_exchange exchange;
    silt_locator locator;
    coupling_body *body;              // owned, as many as in the scene
    silt_body_state *bodies;          // owned
    double *body_force, *body_torque; // owned, 3 per body, N and N m of the slab
    int force_capacity, add_capacity;
    double *force;        // owned, 3 per grain, N
    silt_dem_sphere *add; // owned
    double elapsed;       // s, of the running substeps
    double contact[3];    // N/m, of contacts on all grains, of the last substeps
    double left_mass;
    int64_t left_count;
    silt_error refused; // why a release cannot be; returned by the next start
};

/** Grains, frozen spheres, bodies and counters to and from the store, under "coupling/"; all that is saved was sent.
 * Errors (SILT_FAILED): an array that is absent or has another length, naming it. */
silt_status silt_checkpoint_save(silt_coupling *coupling, silt_store *store, silt_error *err);
silt_status silt_checkpoint_load(silt_coupling *coupling, silt_store *store, silt_error *err);

#endif
