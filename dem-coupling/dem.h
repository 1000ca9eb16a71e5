/** @file dem.h
 * The discrete elements: a worker process (silt-dem) that links LIGGGHTS, driven through shared memory, one instruction
 * a coupling step. This side never loads LIGGGHTS, MPI or VTK. Everything is three-dimensional inside (in 2-D a slab, periodic
 * in z, all z = 0): masses and forces in this header are of the real spheres (kg, N), not per metre of width.
 */
#ifndef SILT_DEM_H
#define SILT_DEM_H

#include "pfem.h"

typedef struct silt_dem silt_dem; // opaque, owns the worker and the shared memory

/** everything fixed at the start; copied whole */
typedef struct silt_dem_def {
    const char *worker;  // path of silt-dem
    const char *log;     // file that LIGGGHTS writes to (its screen), e.g. OUT/dem.log
    bool append;         // to what stands in it
    int dim;             // 3: space; 2 or 0: the slab
    double lo[3], hi[3]; // the box (slab: in x and y); a sphere that leaves it is gone
    double way_lo[3], way_hi[3]; // m, what walls that move span in all their motion
    bool periodic;       // in x: what leaves the box there comes in at the other end
    bool across;         // space: in y too
    double period;       // m, slab: periodic length in z (at least 3 times the largest sphere's diameter)
    double gravity[3];
    double wall_modulus; // Pa, of the walls; 0: youngs_modulus
    double youngs_modulus, poissons_ratio, restitution, friction, rolling_friction, body_friction;
    double step; // s, DEM time step, fixed for the run
    int n_wall;
    const double (
        *wall)[4];     // from_x, from_y, to_x, to_y: straight walls, infinitely deep in z, contact from both sides
    int n_triangle;
    const double (*triangle)[10]; // space: corners, then bits of the edges (1: from the first corner) that no other triangle joins
    const int *wall_motion; // per wall and triangle: which of the motions it follows, -1: stands still; NULL: all do
    int n_motion;
    const double (*motion)[3]; // m, what each motion turns about, at its present place
    double max_radius; // m, largest sphere that will ever come (neighbour cut-off)
    double min_radius;
    bool no_contacts; // contacts and on_bed of the state are not asked for (ten thousand grains: 0.4 ms a run)
} silt_dem_def;

typedef enum {
    DEM_GRAIN = 0, // moves
    DEM_FROZEN,    // stays where it is: bed surface, deposited grain
} silt_dem_kind;

typedef struct silt_dem_sphere {
    int64_t id; // given by the caller, rising, never used twice
    silt_dem_kind kind;
    double x[3], v[3], omega[3];
    double radius, density;
} silt_dem_sphere;

/** a rigid object as a clump of spheres */
typedef struct silt_dem_body {
    int n_sphere;
    const double *sphere; // 3 per sphere: x, y relative to the centroid in the body's frame, radius (z = 0); space: 4, x, y, z, radius
    double mass,
        inertia; // kg, kg m2 about z, of the real object in the slab (Ixx, Iyy are made huge: it stays in its plane)
    double tensor[6]; // space: kg m2, xx, yy, zz, xy, xz, yz in the body's frame
    double q[4];      // space: orientation at the start (w, x, y, z)
    double x[3], v[3], omega[3]; // centroid, velocity, angular velocity at the start
    double angle;                // slab: radians about z at the start
    bool fixed;                  // never moves (its spheres are frozen)
} silt_dem_body;

/** what comes back for every sphere that moves, in rising id */
typedef struct silt_dem_state {
    int n_grain;
    const int64_t *id;
    const double *x, *v, *omega; // 3 per grain
    const double *radius, *mass; // m, kg of the sphere
    const int *contacts;         // contacts of the last substep, all partners
    const uint8_t *on_bed;       // 1: one of them is a frozen sphere or a wall
    int n_body;
    const double *body_x, *body_v, *body_omega, *body_q; // 3, 3, 3, 4 (w, x, y, z) per body, order of adding
    const double *body_contact, *body_answer; // 6 per body, N and N m, means of the last run, see silt_dem_respond
} silt_dem_state;

/** Starts the worker. Errors: worker not found, LIGGGHTS refused (with its last log line). */
silt_status silt_dem_open(silt_dem **dem, const silt_dem_def *def, silt_error *err);
/** Queues edits; they are done, in order remove, add, before the next run. An id that has left by itself may be
 * removed; one that is still queued is dropped. What is wrong with an added sphere (id not rising, outside the box,
 * larger than max_radius, not finite) is the error of the next start. */
void silt_dem_remove(silt_dem *dem, int n, const int64_t *id);
void silt_dem_add(silt_dem *dem, int n, const silt_dem_sphere *sphere);
/** Only before the first start. The outline's spheres are copied. A free body that leaves the box ends the run with an
 * error. */
silt_status silt_dem_add_body(silt_dem *dem, const silt_dem_body *body, silt_error *err);
/** Does the edits, then n_step substeps with constant forces. Returns at once; silt_dem_wait collects.
 * @param force   3 per grain in the order of the last state (grains added since: 0), N
 * @param body_force, body_torque  3 per body, N, N m (about the centroid)
 * With n_step = 0 the edits are done and the state is read back. Momentum: exactly force n_step step, whatever went
 * before. A run sets LIGGGHTS up anew, which costs about ten substeps of grains that seldom touch and leaves the dashpots (not the
 * springs) of the contacts out of its first half substep; see silt_dem_keep. */
silt_status silt_dem_start(silt_dem *dem, int n_step, const double *force, const double *body_force,
                           const double *body_torque, silt_error *err);
/** Torques on the grains in the next run, 3 per grain in the order of the last state, N m; borrowed until then */
void silt_dem_twist(silt_dem *dem, const double *torque);
/** Contacts' answer in the next run: the force and torque R C is added to contact forces and torques C on the free bodies in every
 * substep. matrix: 6 rows a free body, in order of adding, each of as many numbers; borrowed until then; NULL: none, and nothing is
 * measured of contacts. */
void silt_dem_respond(silt_dem *dem, const double *matrix);
/** How the walls that move do so in the next runs, as stiff pieces: 4 numbers per motion, velocity in m/s and spin in rad/s, in the
 * plane from x to y, in space from x to z; and where they stand at the end of the next run, the numbers of the definition's walls or
 * triangles. */
void silt_dem_move_walls(silt_dem *dem, const double (*rate)[4], const double *wall);
/** What guides bodies and walls in the next run, as guide.h has it; borrowed until then */
void silt_dem_guide(silt_dem *dem, const void *guide, size_t size);
/** the same after the run, with the worker's answers; NULL: there was none */
const struct dem_guide *silt_dem_guided(const silt_dem *dem);
/** Steps aside before the next run, 3 per grain in the order of the last state, m; borrowed until then */
void silt_dem_shift(silt_dem *dem, const double *shift);
/** The next run may go on from where the last one ended, with its neighbour lists and without a set-up. A run is set up all the
 * same when there are edits or free bodies, and after a save or load. How the lists came about decides the order of sums: the
 * same bits come again only when set-ups come at the same steps again. */
void silt_dem_keep(silt_dem *dem);
/** Waits for the worker. Errors: the worker died (signal or exit, its last log line), a sphere or body is no longer
 * finite. */
silt_status silt_dem_wait(silt_dem *dem, silt_error *err);
/** The state after the last wait; arrays are borrowed until the next wait. Grains that left the box are simply absent:
 * the caller compares. */
const silt_dem_state *silt_dem_state_now(const silt_dem *dem);
/** Queued edits are saved as such, nothing is run. LIGGGHTS' own restart goes into the store as bytes under "dem/..."
 * together with the id maps; load makes a fresh worker from it. After save the running worker must give the same bits
 * as a loaded one. */
silt_status silt_dem_save(silt_dem *dem, silt_store *store, silt_error *err);
silt_status silt_dem_load(silt_dem **dem, const silt_dem_def *def, silt_store *store, silt_error *err);
/** true when the worker runs, or failed at what it was told to do; false when it was ended from outside */
bool silt_dem_own_fault(const silt_dem *dem);
int silt_dem_process(const silt_dem *dem); // the worker's pid
void silt_dem_close(silt_dem **dem);       // takes NULL, ends the worker, sets NULL
/** 0.15 say of the Rayleigh time pi r sqrt(rho/G)/(0.1631 nu + 0.8766), s */
double silt_dem_rayleigh(double radius, double density, double youngs_modulus, double poissons_ratio);

#endif
