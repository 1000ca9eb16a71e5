/** @file state.h
 * What the coupling keeps between steps, for coupling.c and checkpoint.c.
 */
#ifndef SILT_STATE_H
#define SILT_STATE_H

#include "coupling.h"

#include "crowd.h"
#include "dem.h"
#include "exchange.h"
#include "frozen.h"
#include "form.h"

/** a discrete element as the coupling knows it; masses and forces per metre of width */
typedef struct coupling_grain {
    int64_t id;
    double x[3], v[3], omega[3];
    double radius, mass, solid; // m, kg/m, m3/m
    double diameter, number;    // for drag: m, grains per metre of width
    double force[3];            // N/m, the water's
    double torque[3];           // N m/m, the water's, where it is asked for
    double contact[3], net;     // N/m, of the last step
    double old_x[3], old_v[3];  // before the substeps
    double gust[3];             // m/s, what eddies add to the water's velocity at it in the next step
    int contacts;
    int near; // a node of the water next to it when it was last located, -1: none
    uint8_t on_bed;
    bool sent, gone; // LIGGGHTS has it; it was deposited or left
    bool fixed;      // held where it is: frozen for LIGGGHTS
} coupling_grain;

/** what a run of substeps changes, as it was before: the water may refuse what came of it */
typedef struct coupling_old {
    bool kept;
    int n_grain, grain_capacity;
    coupling_grain *grain;     // owned
    struct silt_body *body;    // owned
    bool *freed;
    double (*wall)[4], (*triangle)[10], (*centre)[4], (*pivot)[3]; // owned
    double left[3];
    int64_t left_count;
} coupling_old;

/** what grains() shows: borrowed by the caller, remade when it is stale */
typedef struct coupling_view {
    silt_grain_state state;
    bool fresh; // shows the grains as they are
    int capacity[10], map_capacity;
    int64_t *id;
    double *x, *v, *omega, *radius, *mass, *net, *contact;
    int *contacts, *map; // map: index into the grains
    uint8_t *on_bed;
} coupling_view;

/** grains and frozen spheres by place, remade when they are asked for and stale */
typedef struct coupling_crowds {
    bool fresh[2];
    silt_crowd moving, frozen;
} coupling_crowds;

typedef struct coupling_body {
    silt_outline shape;  // in the plane
    silt_solid form;     // in space: as fine as the shape asks for
    silt_solid skin;     // with triangles of the water's size
    silt_clump clump;
    bool fixed;
    bool freed; // its release has come
    double first[4]; // orientation at the start
    double old_v[3];
} coupling_body;

struct silt_coupling {
    const silt_scene *scene; // borrowed
    const silt_walls *walls; // borrowed
    silt_dem *dem;           // owned
    silt_dem_def dem_def;    // what it was opened with; its strings are borrowed
    int dim;                 // of the scene
    double box_margin;       // m, of the box around what the scene spans
    double (*wall)[4];       // owned, plane: where LIGGGHTS has them
    double (*triangle)[10];  // owned, space: the same, see dem.h
    int *wall_motion;        // owned, per wall: which of the motions it follows, -1: none
    int n_motion;
    int *moving;             // owned, per motion: the scene's wall
    double (*centre)[4];     // owned, per motion: where LIGGGHTS has it, m and rad
    double (*towards)[4];    // owned, where it has it after the substeps
    double (*pivot)[3];      // owned, centre without the angle
    double (*rate)[4];       // owned, m/s and rad/s
    bool accelerates;        // one of them does so within a step: its rate is told substep by substep
    unsigned char *guide;    // owned, what the worker is told besides forces (guide.h)
    int guide_capacity;
    FILE *trace;             // owned, NULL: none is asked for
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
    coupling_crowds *crowds; // owned
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
    int force_capacity, torque_capacity, add_capacity;
    double *force;        // owned, 3 per grain, N
    bool walks;           // shift holds steps of the random walk for the next substeps
    int eddy_capacity, shift_capacity, walk_capacity;
    double *eddy;         // owned, 2 per node, eddy diffusivity times size and size; so are the others NULL without random walk
    double *shift, *walk; // owned, m, 3 per grain; the same in LIGGGHTS' order
    double *torque;       // owned, 3 per grain, N m; NULL where the water exerts none
    silt_dem_sphere *add; // owned
    coupling_old old;
    bool responds;        // the running substeps answer contacts of bodies
    double *response;     // owned, how
    int response_capacity;
    double elapsed;       // s, of the running substeps
    double contact[3];    // N/m, of contacts on all grains, of the last substeps
    double left_mass, left_rest; // and what rounding left out of it (silt_sum)
    double left_solid;           // m3/m, water that the grains that crossed an outlet displaced there
    int64_t left_count;
    silt_error refused; // why a release cannot be; returned by the next start
};

/** the scene holds the grain with this id where it is: one of those of the start, whose ids come first */
static inline bool coupling_fixes(const silt_coupling *c, int64_t id) {
    return id <= silt_scene_grains(c->scene) && silt_scene_grain(c->scene, (int)id - 1)->fixed;
}

/** mass of the sphere over the mass that it stands for in the slab: 1, more for a crumb; forces on it are scaled alike, so that it
 * moves as the crumb would */
double silt_coupling_burden(const silt_coupling *coupling, const coupling_grain *grain);

// walk.c
/** What holds a fixed grain against water and weight counts as contact. */
void silt_coupling_hold(silt_coupling *coupling, coupling_grain *grain);
// suspend.c
/** A step of the random walk of the grains that are suspended in water, after load and before start. viscosity: per cell, Pa s, of
 * the water with its eddies. The random numbers hang on fluid.seed, the step and the grain's id. */
void silt_coupling_walk(silt_coupling *coupling, const silt_nodes *nodes, const silt_mesh *mesh, const double *viscosity, double dt,
                        int64_t step);
// gust.c
/** Gusts at the grains for the step that begins at `time`, after load: 0 where the water has no eddies. Their numbers hang on
 * fluid.seed, the grain's id and how many gusts it has had. */
void silt_coupling_gusts(silt_coupling *coupling, const silt_nodes *nodes, const silt_mesh *mesh, const double *viscosity, double time);
/** Velocities along the stream, across it and up over the local friction velocity. */
void silt_gust_numbers(uint64_t random, double out[3]);
/** Tells LIGGGHTS of it. */
void silt_coupling_shift(silt_coupling *coupling);

/** The water's torques on grains for the next substeps; nothing where grains.rotational_drag is off. */
void silt_coupling_twist(silt_coupling *coupling);
/** true when the way from a to b leads over an outlet out of the water, or a is within `near` of one */
bool silt_coupling_leaves(const silt_coupling *coupling, const double *a, const double *b, double near);
/** a grain that LIGGGHTS no longer has: true when it went over an outlet; it is lost otherwise */
bool silt_coupling_left_domain(const silt_coupling *coupling, const coupling_grain *grain);
// answer.c
/** see silt_coupling_type */
void silt_coupling_respond(silt_coupling *coupling, int size, const double *matrix);
/** The bodies' state after a run, and the forces of water and contacts on them in it. */
void silt_coupling_bodies_receive(silt_coupling *coupling, const silt_dem_state *state);
void silt_coupling_keep_old(silt_coupling *coupling);   /**< before a run that may be taken back */
void silt_coupling_take_old(silt_coupling *coupling);   /**< takes it back, if it was kept, but for LIGGGHTS */
void silt_coupling_forget_old(silt_coupling *coupling);
// bodies.c
/** Surfaces, clumps, masses and places of the scene's bodies. Errors (SILT_INPUT): a shape that cannot be, that is too thin for the
 * water's mesh, that lies behind a wall or in another body. */
silt_status silt_coupling_bodies(silt_coupling *coupling, silt_error *err);
/** in space: how a body is turned by an angle, radians, about its axis */
void silt_coupling_orientation(const silt_body_def *def, double angle, double q[4]);
silt_status silt_coupling_describe(const silt_scene *scene, FILE *to, silt_error *err);
void silt_coupling_bodies_clear(silt_coupling *coupling);
/** m, wanted distance between the water's nodes on a body, fluid.size or what fluid.sizes say there; radius: of the body */
double silt_coupling_body_size(const silt_scene *scene, const silt_body_def *def, double radius);
/** tells the discrete elements of them */
silt_status silt_coupling_send_bodies(silt_coupling *coupling, silt_error *err);
/** distance from a point to body i; beyond `far` only a lower bound of it */
double silt_coupling_body_distance(const silt_coupling *coupling, int i, const double *x, double far);
// walls.c
void silt_coupling_walls(silt_coupling *coupling);       /**< which of them move, and where all are */
void silt_coupling_walls_stand(silt_coupling *coupling); /**< where the walls are now is where LIGGGHTS has them */
/** grains.across: LIGGGHTS' box ends where the walls end in y; and where there a grain is that has gone over an end of it */
void silt_coupling_sides(silt_coupling *coupling);
double silt_coupling_across(const silt_coupling *coupling, double y);
/** from where LIGGGHTS has the walls that move to where they are at the end of the step, in n substeps */
void silt_coupling_walls_go(silt_coupling *coupling, int n);

/** the rates of motion m in each of n substeps, which end where it stands at the end of the step: m/s and rad/s */
void silt_coupling_wall_rates(silt_coupling *coupling, int m, int n, double (*rate)[4]);
// guide.c
/** Tells the worker what guides bodies and walls in the next n substeps; nothing where nothing does. After silt_coupling_walls_go. */
void silt_coupling_guide(silt_coupling *coupling, int n);
/** marks free bodies that have left what the scene spans, by their place alone */
void silt_coupling_bodies_gone(const silt_coupling *coupling);
/** after the run: who was set free, what was traced */
silt_status silt_coupling_guided(silt_coupling *coupling, silt_error *err);
/** to and from a checkpoint: who was */
silt_status silt_coupling_freed(silt_coupling *coupling, bool out, silt_store *store, silt_error *err);
// trace.c
struct dem_guide;
/** Opens the file that contact.trace asks for; resumed: what it holds after `time` is cut. */
silt_status silt_trace_open(silt_coupling *coupling, const char *path, bool resumed, double time, silt_error *err);
int silt_trace_count(const silt_coupling *coupling); /**< forces in a row */
void silt_trace_ask(const silt_coupling *coupling, struct dem_guide *guide);
silt_status silt_trace_write(silt_coupling *coupling, const struct dem_guide *told, silt_error *err);
/** where the path of a prescribed body has it at a time: x, y, z in m, angle in radians */
void silt_coupling_place(const silt_coupling *coupling, int body, double time, double place[4]);

/** Grains, frozen spheres, bodies and counters to and from the store, under "coupling/"; all that is saved was sent.
 * Errors (SILT_FAILED): an array that is absent or has another length, naming it. */
silt_status silt_checkpoint_save(silt_coupling *coupling, silt_store *store, silt_error *err);
silt_status silt_checkpoint_load(silt_coupling *coupling, silt_store *store, silt_error *err);

#endif
