/** @file fluid.h
 * One step of the water: momentum, pressure, correction on the midpoint mesh (docs/method.md, "Fluid"), in 2-D and 3-D.
 * Rooms: fluid.c the step, start.c the velocity it starts from, converge.c how far it is, impedance.c what it answers to rigid bodies, hold.c what surroundings hold, geometry.c shapes of the cells, assemble.c integrals over them,
 * tension.c the surface's pull, momentum.c the viscous system, pressure.c the pressure system, space.c and coarse.c that of 3-D,
 * stiff.c both at once where viscosity is stiff, debt.c volume that is owed and water that cannot keep its volume.
 */
#ifndef SILT_FLUID_H
#define SILT_FLUID_H

#include "film.h"
#include "parts.h"
#include "pocket.h"
#include "seep.h"
#include "viscosity.h"

typedef struct silt_pressure silt_pressure; // the pressure matrix and its factor, pressure.c
typedef struct silt_stiff silt_stiff;       // factors of momentum and continuity where viscosity is stiff, stiff.c
typedef struct silt_mix silt_mix;           // the last iterates of a step, accelerate.c

#define MOBILE_SPRAY 3 // silt_fluid.mobile: spray, at no pressure and without a say in its volume

/** what a step sees */
typedef struct silt_step {
    const silt_scene *scene;
    const silt_walls *walls;
    const silt_mesh *mesh;
    const silt_drag *drag;       // NULL without grains in the water
    silt_pockets *pockets;       // NULL where air has no pressure
    silt_seep *seep;             // prepared for this step; NULL where the bed lets no water through
    silt_nodes *nodes;
    double time, dt;             // s, start and length
    // dim per node, m/s, of nodes on bodies and of slaves of films: velocity of the momentum, and what carries their places beside it; NULL: the nodes' own, none
    const double *body_velocity, *body_shift;
    const double *body_start; // dim per node, m/s, of nodes on bodies where water slips: the body's velocity as the step begins; NULL: none
    silt_film *film;         // found for this step; NULL: no body is so near to anything
} silt_step;

/** working space and results of a step; arrays grow only */
typedef struct silt_fluid {
    int dim, n_node, n_cell, node_capacity, cell_capacity, share_capacity, belt_capacity, wall_capacity, shift_capacity,
        potential_capacity, stand_capacity, v_first_capacity, debt_first_capacity, bed_force_capacity, still_capacity, ride_capacity, blow_capacity, level_capacity, level_brake_capacity;
    double *x_mid;        // owned, dim per node, positions of the midpoint mesh
    double *flux;         // owned, (dim + 1) dim per cell: V grad N_a, in 3-D its mean over the step (exact change of volume)
    double *cell_volume;  // owned, per cell, at the midpoint
    double *start;        // owned, per cell, volume where the nodes are
    double *inverse;      // owned, per cell, 1/volume, bounded in slivers: gradients are flux times this
    double *mu;           // owned, per cell, Pa s, effective viscosity
    double *tau;          // owned, per cell, stabilisation
    double *share;        // owned, dim + 1 per cell, int of solid share times N_i over the volume; NULL without grains
    double *wall_force;   // owned, dim per node, N, explicit part of the law of the wall's traction; NULL without such walls
    double *shift;        // owned, dim per node, m/s: carries positions, not momentum, to where debts are paid; NULL without volume control
    double *level_force;  // owned, dim per node, N, of the water behind openings with a level; NULL without such openings
    double *level_brake;  // owned, per node, kg/s, part of friction: pressure that water loses as it comes in, over its speed
    uint8_t *still;       // owned, per node, 1: slips on bed or body, whose place it keeps whatever its velocity; NULL without slip on them
    double *ride;         // owned, dim per node, m/s, of these places; NULL without slip on bodies
    double *bed_force;    // owned, dim per node, N: what a bent bed or body would push water at rest along with, taken back; NULL without
                          // slip on them
    double *blow;         // owned, dim per node, N s, of bodies on the water while its first velocity is made free of divergence; NULL without bodies
    double *stand;        // owned, per node, kg/s, added to both sides where explicit viscosity would not be stable; NULL without
    double *potential;    // owned, per node, Pa, density times the potential of a central body force at x_mid; NULL without one
    double *belt;         // owned, dim per node, velocity of a wall's surface along itself; NULL without such walls
    double *mass;         // owned, per node, lumped mass of water, kg
    double *volume;       // owned, per node, lumped volume of the cells
    double *friction;     // owned, per node, kg/s, wall law: traction over speed, times the wall's measure
    double *inertia;      // owned, per node, mass / (theta dt) + drag coefficient + friction
    double *w;            // owned, dim per node, the step's velocity: positions move with it
    double *work;         // owned, what star, force, excess, projection and two of cg lie in: while the pressure is factored it is free
    double *star, *force; // dim per node
    double *reaction, *scratch; // owned, dim per node; reaction: force of walls, bed, bodies on the water, N
    double *excess;       // dim per node, N, force that turns the lumped mass towards the consistent one
    double *projection, *projection_weight;    // pressure gradient projection (dim per node) and its weight, owned
    double *residual, *rate, *increment;       // owned, 1 per node
    uint8_t *hold;        // owned, silt_hold
    uint8_t *mobile;      // owned, 1: some neighbour or the node itself can move; 2: but not so that its volume is kept; MOBILE_SPRAY
    double *withheld;     // owned, per node, m3/s: gain that continuity does not see where mobile is not 1
    double *normal;       // owned, dim per node: silt_walls_hold's vector
    double *given;        // owned, dim per node, velocity of what is held
    silt_wall_normals wall_normals; // owned, of nodes on bent walls
    double *cg[3];        // dim per node, working space of the momentum solver and others; the third lies in reaction
    double *pressure_new, *v_start; // owned, 1 and dim per node: kept apart until the step is accepted
    double *v_first, *debt_first; // owned, dim and 1 per node: what the step began with once debts had spread and v was free of divergence; NULL without bodies
    double given_first;   // m3
    int *piece, *walk;    // owned, per node: lowest node of its piece of water; working space
    uint8_t *closed;      // owned, see silt_closed_pieces
    int64_t piece_revision; // of the mesh that these pieces belong to
    int piece_capacity, walk_capacity, closed_capacity;
    double mu_max;        // Pa s, largest of mu
    silt_parts parts;     // owned, the cells, one part a thread
    bool shaped;          // shapes and x_mid are of this step
    bool last_try;        // set by the caller: no smaller step will follow, what can be booked as debt shall not fail the step
    silt_pressure *pressure; // owned
    silt_stiff *stiff;    // owned
    silt_seep *seep;      // the step's
    silt_film *film;      // the step's
    silt_mix *mix;        // owned
    double theta;         // implicitness of the step: fluid.theta, more where viscosity is stiff
    silt_depth depth;     // owned, distances to walls and surface; empty where viscosity is the same everywhere
    silt_wall_law law;    // owned
    silt_eddy eddy;       // owned, of spalart-allmaras
    silt_viscosity_report viscosity; // of the last step

    // of the last step
    int iterations, momentum_iterations, pressure_iterations;
    double worst;             // largest |residual| dt / volume
    double lacking;           // sum of |residual| dt over that of the volumes
    double from_grains[3];    // N, force of the grains on the water
    double dissipated;        // J, viscous
    double worked;            // J, of bodies, inlets, walls and grains on the water
    double projected;         // J, kinetic energy that making the first velocity free of divergence took
    double impulse[3];        // N s, what that gave to the water (of walls, bed, bodies)
    double solved_volume;     // m3, sum of residual times dt
    double given_back;        // m3, volume that the debts asked for, or that is booked as one
    double momentum_residual; // N, unbalanced force on free nodes
    double momentum_scale;    // N, what it is relative to
} silt_fluid;

void silt_fluid_clear(silt_fluid *fluid);
/** Solves a step from the nodes' x, v, p. On success nodes->v and nodes->p are new, fluid->w holds the velocity that
 * positions move with, debts are paid by what was asked; positions are untouched. On failure the nodes are as before.
 * Errors: SILT_FAILED with what did not converge and where. */
silt_status silt_fluid_step(silt_fluid *fluid, const silt_step *step, silt_error *err);
/** The step that was just solved once more, for other motions of bodies than those that it was solved with (step->body_velocity,
 * step->body_shift): from where it ended, with its factor, theta and debts. To be used only after silt_fluid_step with
 * body_velocity. On failure the nodes are as before the step. */
silt_status silt_fluid_again(silt_fluid *fluid, const silt_step *step, silt_error *err);
/** component k of the velocity that the mesh moves with: w, the debts' shift, less a belt's own motion; where water slips on bed
 * and bodies that of their surface */
static inline double silt_mesh_velocity(const silt_fluid *f, int k) {
    if (f->still && f->still[k / f->dim])
        return f->ride ? f->ride[k] : 0;
    return f->w[k] + (f->shift ? f->shift[k] : 0) - (f->belt ? f->belt[k] : 0);
}

/** memory that is of no use until the next step, NULL: none (silt_lend) */
void *silt_fluid_rest(silt_fluid *fluid, size_t *bytes);

// hold.c -------------------------------------------------------------------------------------------------
/** which velocity components the surroundings hold, and at what velocity */
void silt_hold_nodes(silt_fluid *fluid, const silt_step *step);
/** Renews what holds nodes on bent walls, and on bodies where water slips, from the facets of the present midpoint mesh: with any
 * other normals a full tank cannot keep its volume. */
void silt_hold_bent(silt_fluid *fluid, const silt_step *step);
/** nodes that slide along something and whose cells have next to no volume (silt_fluid.volume) do not */
void silt_hold_light(silt_fluid *fluid, const silt_step *step);
/** whether water slips at a node of a body */
bool silt_hold_slips(const silt_step *step, int i);
/** Takes the bodies' motion anew: at the velocity that they are held at, where water slips its normal part. */
void silt_hold_bodies_again(silt_fluid *fluid, const silt_step *step);
/** Normal of a facet that moves evenly from x over x_mid, into the water, as large as the facet, mean over the step: the continuity of a cell
 * in space asks for that one, in the plane it is that of the middle. x_mid = x: where it is */
void silt_facet_mean_normal(const silt_mesh *mesh, const double *x, const double *x_mid, const int *facet, double n[3]);
/** v with its held components those of `own` */
void silt_hold_replace(const silt_fluid *fluid, int i, const double *own, double *v);
/** silt_hold_impose; on bent walls the velocity keeps its size: turning does no work */
void silt_hold_turn(const silt_fluid *fluid, int i, double *v);
/** takes the held components out of a vector of dim numbers */
void silt_hold_project_held(const silt_fluid *fluid, int i, double *v);
static inline void silt_hold_project(const silt_fluid *f, int i, double *v) { // most are free: no call for them
    if (f->hold[i] != HOLD_FREE)
        silt_hold_project_held(f, i, v);
}
/** v with its held components replaced by the given ones */
void silt_hold_impose(const silt_fluid *fluid, int i, double *v);

// converge.c ---------------------------------------------------------------------------------------------
/** what continuity lacks with fluid->star: residual, worst, lacking. @return the node that lacks most */
int silt_star_continuity(silt_fluid *fluid, const silt_step *step, const double *p);
silt_status silt_astray_node(const silt_fluid *fluid, const silt_step *step, silt_error *err);
silt_status silt_explicit_limit(silt_fluid *fluid, const silt_step *step, silt_error *err);
double silt_swirl(const silt_fluid *fluid, const silt_step *step);
double silt_strictness(const silt_fluid *fluid, const silt_step *step);
bool silt_spray_lags(const silt_fluid *fluid, double tolerance);

// level.c -------------------------------------------------------------------------------------------------
bool silt_levels_any(const silt_scene *scene);
/** normals of the walls beside an opening among a node's walls. @return how many */
int silt_level_sides(const silt_walls *walls, const silt_opening *opening, const int wall[3], const double *side[3]);
/** unit direction in which a node on an opening crosses it, to the front, along the walls beside it */
void silt_level_way(const silt_opening *opening, int n, const double *const side[3], double way[3]);
/** how a node on an opening with a level is held: silt_walls_hold */
silt_hold silt_level_hold(const silt_step *step, int i, double vector[3]);
/** area vector of a facet with the nodes at x, out of the water */
void silt_facet_vector(const silt_mesh *mesh, int dim, const double *x, const int *facet, double vector[3]);
/** Pressure of the water behind openings, p = rho g (level - height), less rho u^2/2 where it comes in: level_force and
 * level_brake, the latter added to friction. */
void silt_levels_load(silt_fluid *fluid, const silt_step *step);

// geometry.c ---------------------------------------------------------------------------------------------
/** Geometry, masses and stabilisation on the mesh half way along dt w; dt = 0: where the nodes are. Shapes are made anew only when
 * a node's midpoint is another one, or not `shaped`. */
void silt_assemble_geometry(silt_fluid *fluid, const silt_step *step, double dt);

// assemble.c ---------------------------------------------------------------------------------------------
/** out += G p */
void silt_assemble_pressure(const silt_fluid *fluid, const silt_mesh *mesh, const double *p, double *out);
/** lost += what of G p acts on the grains */
void silt_assemble_pressure_lost(const silt_fluid *fluid, const silt_mesh *mesh, const double *p, double lost[3]);
/** out -= int N_i grad potential: at rest the pressure answers it to rounding, on any mesh */
void silt_assemble_potential(const silt_fluid *fluid, const silt_mesh *mesh, double *out);
/** out += factor K v: viscous force, deviatoric */
void silt_assemble_viscous(const silt_fluid *fluid, const silt_mesh *mesh, const double *v, double factor, double *out);
/** the same with factor 1, and diagonal += diagonal of K in one sweep */
void silt_assemble_viscous_both(const silt_fluid *fluid, const silt_mesh *mesh, const double *v, double *out, double *diagonal);
/** diagonal += diagonal of K, its mean over the components */
void silt_assemble_viscous_diagonal(const silt_fluid *fluid, const silt_mesh *mesh, double *diagonal);
/** out += (lumped - consistent mass) a */
void silt_assemble_mass_excess(const silt_fluid *fluid, const silt_mesh *mesh, double density, const double *a, double *out);
/** residual of continuity, p with the potential of a central force: G^T v + L p + Q pi - source - rate (NULL: 0), and what the bed takes; where no velocity can mend it, of its smoothing alone */
void silt_assemble_continuity(silt_fluid *fluid, const silt_mesh *mesh, const silt_drag *drag, const double *rate, const double *v,
                              const double *p);
/** pi = -M^-1 Q^T p: the recovered gradient, lumped, of the pressure with the potential of a central force */
void silt_assemble_projection(silt_fluid *fluid, const silt_mesh *mesh, const double *p);
/** out = G^T v + L p, without sources and projection (the pressure system applied) */
void silt_assemble_divergence(const silt_fluid *fluid, const silt_mesh *mesh, const double *v, const double *p, double *out);

// momentum.c ---------------------------------------------------------------------------------------------
/** What a solve starts from, for the present geometry, viscosity and first guess: scratch = K v, increment = diagonal of inertia + K.
 * Neither may be touched until then. */
void silt_momentum_look(silt_fluid *fluid, const silt_mesh *mesh, const double *v);
/** (inertia + K) v = right on the free components, after silt_momentum_look; v holds the first guess with held components in place.
 * To six digits more than fluid.tolerance, or to `drop` times the residual of the first guess where that is more.
 * @param solved  out, whether it got to the six digits */
silt_status silt_momentum_solve(silt_fluid *fluid, const silt_step *step, const double *right, double drop, double *v, bool *solved,
                                silt_error *err);

// debt.c -------------------------------------------------------------------------------------------------
/** Pieces of water without a free surface, or an opening with a level, know their pressure up to a constant: 1 at one node of each,
 * where it is pinned. n_node numbers, of the fluid; found once for a mesh. */
const uint8_t *silt_closed_pieces(silt_fluid *fluid, const silt_mesh *mesh);
/** debts spread a little among neighbours, then ask for their volume back: fluid->rate */
void silt_debts_ask(silt_fluid *fluid, const silt_step *step);
/** where water is hemmed in, a debt cannot be paid: it waits. @return whether any was let off */
bool silt_debts_relent(silt_fluid *fluid);
/** a node whose whole surroundings are held has no say in its volume, nor have films and crumbs with a free node or two */
void silt_mobile_find(silt_fluid *fluid, const silt_mesh *mesh, double *p);
/** spray on the free surface, whose pressure is nought: mobile becomes MOBILE_SPRAY; after silt_mobile_find */
void silt_spray_find(silt_fluid *fluid, const silt_step *step, double *p);
/** which nodes may be let off: between held ones; also where little is missing; all */
typedef enum { POCKET_HELD = 0, POCKET_LITTLE, POCKET_ANY } silt_pocket;
/** nodes that no velocity keeps at their volume take the pressure around them. @return whether there was any */
bool silt_pockets_relent(silt_fluid *fluid, const silt_mesh *mesh, silt_pocket which, double limit, double dt, double *p);

// accelerate.c -------------------------------------------------------------------------------------------
void silt_mix_restart(silt_mix **mix); // makes it at first
void silt_mix_free(silt_mix **mix);
/** Mixes the corrected pressure and velocity (n and dim n numbers) with those of earlier iterates of the step.
 * @param change    n pressure corrections of this iterate, @param residual  n, what asked for them, change . residual > 0 */
void silt_mix_next(silt_mix *mix, int dim, int n, const double *change, const double *residual, double *pressure, double *velocity);

// pressure.c ------------------------------------------------------------------------------------------
silt_pressure *silt_pressure_create(void);
void silt_pressure_free(silt_pressure **pressure);
/** Assembles  sum_i G_i^T P_i G_i / inertia_i + L  (consistent) or its Laplacian counterpart, and factors it; in 3-D the first is
 * left to conjugate gradients (space.c). Errors: SILT_FAILED when the matrix is not positive definite. */
silt_status silt_pressure_factor(silt_pressure *pressure, silt_fluid *fluid, const silt_step *step, silt_error *err);
/** the viscous counterpart, for silt_pressure_solve_stiff; the same errors */
silt_status silt_pressure_factor_stiff(silt_pressure *pressure, silt_fluid *fluid, const silt_step *step, silt_error *err);
/** increment = matrix^-1 right; conjugate gradients stop at `tolerance` relative to the right side. The mesh is that of the factor. */
silt_status silt_pressure_solve(silt_pressure *pressure, silt_fluid *fluid, const double *right, double tolerance,
                                double *increment, silt_error *err);
/** increment = (3/(4 mu) M + L)^-1 right: the pressure's operator where viscosity outweighs inertia */
silt_status silt_pressure_solve_stiff(silt_pressure *pressure, const double *right, double *increment, silt_error *err);
void *silt_pressure_rest(silt_pressure *pressure, size_t *bytes); // silt_fluid_rest
/** forgets factors, so that a resumed run and one that went on hold the same */
void silt_pressure_forget(silt_pressure *pressure);


// impedance.c ---------------------------------------------------------------------------------------------
/** one mode of motion of what holds the water */
typedef struct silt_mode {
    double *motion, *force; // owned, dim per node: the motion, and what of inertia and viscosity holds it
    double *load, *p, *left; // owned, per node: what continuity lacks without a pressure; the pressure; what it lacks with it
    int directions;         // that p took
} silt_mode;
/** What the step that was just solved answers to a change of the velocity of bodies' nodes: motion, dim per node, also of those under
 * films, nought where nothing changes. Linear: the matrix of the step's end. Takes fluid->reaction as working space, and the film has no squeeze
 * then.  @param enough  of the residual at the start, at which the pressure is enough; 0: the usual; less: no
 * pressure is found, and the work of another mode's forces on this one's motion is right to first order of what that one leaves */
silt_status silt_fluid_mode(silt_fluid *fluid, const silt_step *step, const double *motion, double enough, silt_mode *mode, silt_error *err);
/** Work of the forces of mode b on the motion of mode a, N m/s per (m/s)^2: with A the operator of the velocity and K that of the pressure,
 * a A b + (K p_a).p_b and what is left of both, an error of second order. Symmetric but for rounding. */
double silt_mode_work(const silt_fluid *fluid, const silt_mode *a, const silt_mode *b);
void silt_mode_clear(silt_mode *mode);

// fluid.c
/** increment = -matrix^-1 residual, in 3-D to `tolerance`, or to what is worth having where the step is solved far; seeps: it is a
 * pressure, which the bed answers, not an impulse or the way that debts are paid */
silt_status silt_fluid_increment(silt_fluid *fluid, const silt_step *step, bool seeps, double tolerance, silt_error *err);

/** whether the node starts with its body's velocity, and not with that of the step */
static inline bool silt_fluid_own_start(const silt_step *step, int i) { return step->body_velocity && step->nodes->kind[i] == NODE_BODY; }

/** start.c: makes the velocity at the start free of divergence, into nodes->v and fluid->w; where a body has just met the water the step
 * becomes backward Euler's from the start as it is. p: Pa, per node, at the start */
silt_status silt_fluid_start(silt_fluid *fluid, const silt_step *step, const double *p, silt_error *err);

/** v += P G q/inertia */
void silt_fluid_correct(silt_fluid *fluid, const silt_step *step, const double *q, double *v);

// seepage.c -----------------------------------------------------------------------------------------------
/** once a step */
void silt_seepage_begin(silt_fluid *fluid, const silt_step *step);
/** what the bed takes from each node at the pressure p, m3/s */
const double *silt_seepage_taken(silt_fluid *fluid, const silt_mesh *mesh, const double *p);
/** increment = (S + L + B)^-1 right, B what the bed takes of the water for its pressure: flexible GMRES with silt_pressure_solve
 * before it, to `tolerance` relative to the right side. */
silt_status silt_seepage_solve(silt_fluid *fluid, const silt_step *step, const double *right, double tolerance, double *increment,
                               silt_error *err);

// stiff.c -------------------------------------------------------------------------------------------------
/** Assembles and factors the momentum, or momentum and continuity, of the present geometry and viscosity, 2-D. Makes *stiff at first. */
silt_status silt_stiff_factor(silt_stiff **stiff, silt_fluid *fluid, const silt_step *step, bool pressure, silt_error *err);
/** whether there is such a factor of the present step */
bool silt_stiff_ready(const silt_stiff *stiff, bool pressure);
/** the step is over, or factors are of no more use in it */
void silt_stiff_end(silt_stiff *stiff);
/** out = (inertia + K)^-1 right on the free components */
void silt_stiff_momentum(silt_stiff *stiff, const silt_fluid *fluid, const double *right, double *out);
/** velocity and pressure that together mend continuity: v += dv, (inertia + K) dv = G increment, G^T dv + L increment = right */
void silt_stiff_correct(silt_stiff *stiff, const silt_fluid *fluid, const double *right, double *increment, double *v);
void silt_stiff_forget(silt_stiff *stiff);
void silt_stiff_free(silt_stiff **stiff);

#endif
