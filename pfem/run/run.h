/** @file run.h
 * The mutable run: all that happens, in the order of the flow. Only the files of this room see it whole.
 */
#ifndef SILT_RUN_H
#define SILT_RUN_H

#include "coupling.h"
#include "fluid.h"
#include "output.h"

/** a parcel that has left the bed, or comes in, but has no room yet to stand in */
typedef struct silt_waiting {
    double x[3], normal[3], reach; // patch centre, out of the bed, how far out to look
    double v[3];                   // m/s, that it begins with
    double mass;                   // kg per m
} silt_waiting;

/** how long a grain has been at rest */
typedef struct silt_rest {
    int64_t id;
    double time; // s
} silt_rest;

typedef struct silt_uplift silt_uplift; // uplift.c

/** what is kept of the water at a body; all but the film in space with more bodies than one */
typedef struct silt_body_water {
    double known;       // 0: to be found, 1: kept, 2: found in this step
    double wet;         // nodes on the body when it was found
    double under;       // nodes under films then
    double film;        // m3, water in films at the body: what it was when the step began, less what went to the mesh
    double film_known;  // 1: it was found
} silt_body_water;

struct silt_run {
    const silt_scene *scene;
    silt_scene *scene_own; // owned, the same where a run was taken up again, else NULL
    silt_run_def def;
    char *out;        // owned
    char *worker;     // owned
    char *trace;      // owned
    char *log;        // owned

    silt_walls walls;
    silt_nodes nodes;
    silt_mesh mesh;
    silt_memory memory;
    silt_locator locator;
    silt_fluid fluid;
    silt_size *size;         // owned, NULL: fluid.size everywhere
    silt_air air;            // empty where air has no pressure, as are the pockets
    silt_pockets pockets;
    double (*wall_force)[3]; // owned, one per wall of the scene, N, of the water in the last step
    silt_bed bed;
    silt_seep seep;          // empty where the bed lets no water through
    silt_coupling *coupling; // owned, NULL without grains and bodies
    const silt_drag *drag;   // borrowed from the coupling, NULL: no grain in the water
    silt_barrier barrier;

    // sediment between bed and grains
    int n_waiting, waiting_capacity;
    silt_waiting *waiting; // owned
    int n_rest, rest_capacity;
    silt_rest *rest;       // owned, rising id
    int n_owed, owed_capacity;
    double *owed;          // owned, kg, one per inlet: what has come due and is less than a parcel; none where nothing is fed
    int pick_capacity;
    int *pick;             // owned, bed nodes that leave together
    int n_freed, freed_capacity;
    int (*freed)[4];       // owned, bed nodes of cells released in this step
    int freed_area_capacity;
    double *freed_area;    // owned
    int n_grown, grown_capacity;
    int (*grown)[4];       // owned, bed nodes of cells deposited in this step
    int grown_area_capacity;
    double *grown_area;    // owned
    int64_t bed_revision;  // that nodes and coupling know
    bool bed_told;         // that the shear on the bed is not resolved
    bool volume_told;      // that much of the water's volume is off
    double wear_ahead;     // s, that the bed was worn for and the water has still to go: of steps cut after that

    // clocks: time = frame * output + offset, with offset = tick * step of the coupling when there is one
    int64_t step, frame, tick;
    double offset, time, dt;
    int checkpoint_slot;
    int64_t saved_step; // of the newest checkpoint, -1: none yet
    double saved_time;
    bool whole;         // the state is that of the end of a step, nothing of the next one has been done to it
    int64_t back, back_set_up; // step whose end a run that fails goes back to, -1: none is worth it; the last one with set_up_due
    bool again;         // goes over steps that are in the folder already: writes neither rows nor frames, warns of nothing
    int lock;           // descriptor that keeps other runs out of the folder, -1: none

    silt_ledger ledger;
    silt_gauges *gauges;
    double *gauge; // owned
    silt_history *history;
    silt_summary summary;
    double phase[PHASE_COUNT]; // s, of the step
    double started;            // wall clock
    double output_seconds;     // that the last row and frame took

    int n_body_before, body_before_capacity;
    struct silt_body *body_before; // owned, poses at the start of the step
    int body_after_capacity, body_velocity_capacity, body_shift_capacity, body_carry_capacity;
    struct silt_body *body_after;  // owned, poses at its end, as far as they are known
    double *body_velocity, *body_shift, *body_start; // owned, dim per node, see silt_step
    int body_start_capacity;
    silt_film *film;               // borrowed from uplift, NULL: there is none
    silt_body_water *body_water;   // owned
    int body_water_capacity, body_inertia_capacity;
    double *body_inertia;          // owned, (6 n_body_before)^2, kg, kg m, kg m2: its inertia as it is kept in the bodies' frames; NULL: it is not
    double (*body_carry)[6];       // owned, N s and N m s per m: what the water gave bodies and they have not received yet
    silt_uplift *uplift;           // owned
    double body_error;             // what weight, contacts and water leave open of bodies' momentum, relative to them
    double *x_old;   // owned, 2 per node, positions at the start of the step
    double *v_old, *debt_old; // owned, 2 and 1 per node, velocities and debts at the start of the step
    int *map;        // owned, renumbering of the last rebuild
    double *p_old;   // owned, 1 per node, pressures at the start of the step: of the middle of the step before
    int n_old, n_shown; // nodes at the start of the step; nodes that p_shown is of, -1: of none
    double dt_old;   // s, length of the step before; 0: none
    silt_nodes shown; // what output sees: the nodes with the pressure p_shown, the rest borrowed from nodes
    double *p_shown; // owned, 1 per node
    int x_old_capacity, v_old_capacity, debt_old_capacity, map_capacity, p_old_capacity, p_shown_capacity;
    double box_lo[3], box_hi[3]; // what lies outside has left
    double box_margin;           // m, of that box around what the scene spans
    double way_lo[3], way_hi[3]; // what walls with a motion span from the start to the end
};

// life.c ----------------------------------------------------------------------------------------------
/** From nothing to the state at t = 0 with its row and frame in the folder `out`, which is there. To be freed also when it failed.
 * @param lock  see above */
silt_status silt_run_open(silt_run *run, const silt_scene *scene, const silt_run_def *def, const char *out, int lock, silt_error *err);

// run.c, besides silt_run_advance: clocks are there to be read until its next call --------------------
/** the step as the water sees it */
silt_step silt_run_see(silt_run *run);
/** what output sees of the run */
void silt_run_view(silt_run *run, silt_view *view);
/** porosity, ledger and pressure of a state, for row and frame */
silt_status silt_run_measure(silt_run *run, silt_error *err);
/** the state's row, and its frame if it is due */
silt_status silt_run_output(silt_run *run, silt_error *err);
void silt_run_free(silt_run *run);

// grains.c --------------------------------------------------------------------------------------------
/** true where the discrete elements are set up anew: checkpoints are taken at such places only */
bool silt_run_set_up_due(const silt_run *run, double last);
/** Grains and bodies over n of their steps, under the water's forces. again: the step was cut. */
silt_status silt_run_grains(silt_run *run, int n, bool again, silt_error *err);
/** what the discrete elements say of their failure, with the step and the bodies. @return status */
silt_status silt_run_grains_failed(const silt_run *run, silt_status status, silt_error *err);

// bodies.c --------------------------------------------------------------------------------------------
/** how many of the bodies can move */
int silt_run_bodies_free(const silt_run *run);
/** Where x goes that is fixed in a body (dim numbers; a third one 0) */
void silt_run_body_turn(const struct silt_body *before, const struct silt_body *now, const double *x, int dim, double out[3]);
/** velocity of what is fixed in a body at x, dim numbers */
void silt_run_body_velocity(const struct silt_body *body, const double *x, int dim, double *v);
/** Before the water's step: bodies go on as they do; sets the motion of their nodes. */
void silt_run_bodies_coast(silt_run *run);
/** After it, before the discrete elements move: the water's force on bodies and its inertia around them, for the substeps to come.
 * SILT_FAILED: the force cannot be. */
silt_status silt_run_bodies_load(silt_run *run, const silt_step *step, silt_error *err);
/** The water's inertia at the free bodies after its step, as the solves give it: kg, kg m, kg m2, size by size, six rows a body. *inertia is
 * owned by the caller, also of an error. */
silt_status silt_run_bodies_inertia(silt_run *run, const silt_step *step, int *size, double **inertia, silt_error *err);
/** After the discrete elements have moved: the water's step again, with that motion of the bodies; what its force on them differs
 * from what they received is carried to the next step. */
silt_status silt_run_bodies_answer(silt_run *run, const silt_step *step, silt_error *err);

// matrix.c --------------------------------------------------------------------------------------------
/** Cholesky's factor of a symmetric matrix in its lower triangle; @return false: it is not positive definite */
bool silt_cholesky(int n, double *a);
void silt_cholesky_solve(int n, const double *factor, double *x);
/** The symmetric part of a matrix without what of it is less than nought. @return how many of its values were */
int silt_matrix_clip(int n, double *a);

// uplift.c --------------------------------------------------------------------------------------------
/** Films of water between bodies and what they are near to, of the present mesh and places. Makes *uplift at first. Nodes at mouths that
 * are shut are no free surface any more, until silt_uplift_open. @return borrowed from it; NULL: there are none */
silt_film *silt_uplift_find(silt_uplift **uplift, silt_run *run);
/** Before a step: what films hold now and what they should is owed to the water at their rims. */
void silt_uplift_owe(silt_uplift *uplift, silt_run *run);
/** The step is over, before nodes move: what films gave to the water. @return m3, of all */
double silt_uplift_give(const silt_uplift *uplift, silt_run *run);
/** after a step, before nodes move: force[wall] += what films press on walls with, N */
void silt_uplift_walls(const silt_uplift *uplift, const silt_run *run, double (*force)[3]);
void silt_uplift_open(const silt_uplift *uplift, silt_run *run); // after that: surfaces are surfaces
void silt_uplift_free(silt_uplift **uplift);

// ledger.c --------------------------------------------------------------------------------------------
/** volume, mass, momentum, energy and sediment of the state, and their errors so far */
void silt_run_ledger(silt_run *run);
/** forces of the step that was solved: what the water's momentum leaves open, and whether what grains got the water lost */
void silt_run_balance(silt_run *run);

// start.c ---------------------------------------------------------------------------------------------
void silt_run_box(silt_run *run);
silt_status silt_run_first(silt_run *run, silt_error *err);
silt_status silt_run_pockets(silt_run *run, silt_error *err); // closed air of a fresh mesh
void silt_run_locate(silt_run *run);                          // the locator of a fresh mesh, where bed or gauges ask it
void silt_coupling_def_fill(const silt_run *run, silt_coupling_def *def);

// move.c ----------------------------------------------------------------------------------------------
/** Nodes, inlets, outlets and bodies to their new places, then the new mesh. */
silt_status silt_run_move(silt_run *run, silt_error *err);
/** gravity and body force at a place (dim numbers), m/s2 */
void silt_run_acceleration(const silt_run *run, const double *x, double a[3]);

// pace.c ----------------------------------------------------------------------------------------------
/** Longest step [s] that accuracy allows: courant number, cells that do not turn over, gravity, walls that move, growth. */
double silt_run_pace(const silt_run *run);

// level.c ---------------------------------------------------------------------------------------------
/** After the water has moved: nodes on openings with a level back onto them, those that came through with them; what passed goes
 * to the ledger, in or out. */
void silt_run_levels(silt_run *run);
/** takes out what stands too close on an opening, or dry; after the memory was taken */
void silt_run_levels_thin(silt_run *run);

/** velocity of inlets and bodies for the step that begins */
void silt_run_prescribe(silt_run *run);

// sediment.c ------------------------------------------------------------------------------------------
void silt_run_release(silt_run *run);              // after the water's step: what the bed gives
void silt_run_place(silt_run *run);                // parcels that wait find room
silt_status silt_run_deposit(silt_run *run, silt_error *err); // after the grains' step: what comes to rest
void silt_run_bed_sync(silt_run *run);             // nodes on the bed's surface follow the bed

// feed.c ----------------------------------------------------------------------------------------------
void silt_run_feed(silt_run *run, double dt); // what inlets bring in dt joins the parcels that wait for room

// folder.c --------------------------------------------------------------------------------------------
/** Makes the folder, or with force clears an existing one of what silt wrote, and locks it. *lock: descriptor, -1 where the file
 * system has no locks. Errors: it exists or is in use (SILT_INPUT), it cannot be made (SILT_FAILED). */
silt_status silt_folder_prepare(const char *out, bool force, int *lock, silt_error *err);
/** one run at a time in a folder; the lock ends with the process at the latest */
silt_status silt_folder_lock(const char *out, int *lock, silt_error *err);
/** a warning on stderr, unless the run is quiet, and in run.log, with the time */
void silt_run_warn(const silt_run *run, const char *format, ...) __attribute__((format(printf, 2, 3)));
void silt_folder_remove(const char *path); // the folder and the files in it
char *silt_folder_default(const silt_scene *scene); // the scene's folder name plus .out, in the current folder; owned by the caller
char *silt_worker_find(const char *asked);          // path of silt-dem; owned by the caller

// state.c ---------------------------------------------------------------------------------------------
silt_status silt_run_save(silt_run *run, const char *path, silt_error *err);
silt_status silt_run_load(silt_run *run, silt_store *store, silt_error *err);

#endif
