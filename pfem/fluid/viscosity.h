/** @file viscosity.h
 * How water and mud resist being sheared: depth and distance to walls, eddy viscosity (turbulence.c), eddies that go with the water
 * (eddy.c), apparent viscosity of yield-stress fluids (rheology.c), traction of walls whose boundary layer is thinner than a cell (wall_law.c); and the pull of
 * the free surface (tension.c).
 * Everything works in two and three dimensions: positions and velocities have `dim` numbers a node, velocity gradients
 * dim * dim numbers, row d holding dv_d/dx_k.
 *
 * In a step of the water:
 *   once    silt_depth_update, silt_wall_law_place
 *   in iterations, with the present iterate w: the first two for water (later ones only unsettle the pressure), every one where
 *   viscosity is stiff or changes much in a step
 *           silt_viscosity_update (blend 1 in the first, 0.5 after), silt_wall_law_traction
 *           momentum gets  - friction_i w_i + force_i  at wall nodes, friction_i joins the node's inertia
 *   once    silt_eddy_advance, when the step is done
 */
#ifndef SILT_VISCOSITY_H
#define SILT_VISCOSITY_H

#include "pfem.h"

#define SILT_KAPPA 0.41 // von Karman's constant

/** a step along axis d by the shortest way, across a periodic border too */
static inline double silt_shortest(const silt_mesh *mesh, int d, double step) {
    return mesh->period[d] > 0 ? step - mesh->period[d] * floor(step / mesh->period[d] + 0.5) : step;
}

// ---------------------------------------------------------------- turbulence.c

/** distances of the water's nodes, found along the mesh; arrays grow only, valid when zeroed */
typedef struct silt_depth {
    int n_node, n_facet, node_capacity, facet_capacity, start_capacity, item_capacity;
    double *wall;         // owned, one per node, m, to the nearest facet that brakes the water; HUGE_VAL: none, or dry
    double *surface;      // owned, one per node, m, to the nearest free facet; HUGE_VAL: none, or dry
    double *room;         // owned, one per node, m, what of the way to the wall eddies have: wall, or less between grains
    int *wall_facet;      // owned, one per node, that facet of the mesh, -1
    int *surface_facet;   // owned, one per node
    uint8_t *brakes;      // owned, one per facet: 0 slip, free or inlet; 1 water sticks to it; 2 law of the wall
    double enclosed;      // m, largest distance to walls where no free surface is: what stands for the depth there
    int *queue;           // owned, working space
    uint8_t *queued;      // owned, working space
    struct depth_rank *rank; // owned, working space of silt_depth_crowd
    int rank_capacity;
    int *start, *item;    // owned, facets of a node
} silt_depth;

/** Distances to walls (WALL, BED and BODY facets without slip) and to the free surface at positions x, across periodic borders
 * too; exact for the facet found. Costs a sweep over the nodes; call once a step.
 * @param x  dim per node, m */
void silt_depth_update(silt_depth *depth, const silt_scene *scene, const silt_walls *walls, const silt_nodes *nodes,
                       const silt_mesh *mesh, const double *x);
/** Grains leave eddies less room: room = int max(0, 1 - solid/limit) ds along the way from the wall (Li and Sawamoto, J. Hydrosci.
 * Hydraul. Eng. 13, 1995; Revil-Baudard and Chauchat, J. Fluid Mech. 730, 2013, with the limit 0.6). After silt_depth_update. From node to
 * node in the order of their distance: exact where distance and share hang on one coordinate and the share is linear between nodes.
 * @param solid  per node, share of grains */
void silt_depth_crowd(silt_depth *depth, const silt_mesh *mesh, const double *x, const double *solid, double limit);
void silt_depth_clear(silt_depth *depth);

/** m, distance of a point to a facet of `dim` corners (segment, triangle), dim numbers each */
double silt_facet_distance(int dim, const double *point, const double *corner);
/** Mixing length kappa d sqrt(1 - d/D), D = d + s, m: gives the logarithmic profile in a uniform open channel (Nezu & Rodi 1986).
 * @param d  m, distance to the wall; @param s  m, distance to the surface; infinite d: 0 (a jet knows no wall) */
double silt_mixing_length(double d, double s);

/** |S| = sqrt(2 S:S), 1/s, of the symmetric part of a velocity gradient */
double silt_shear_rate(int dim, const double *gradient);
/** Smagorinsky's model, m2/s: (min(0.17 delta, kappa d))^2 |S|. @param delta  m, size of the cell, V^(1/dim) */
double silt_eddy_smagorinsky(double delta, double d, double rate);
/** WALE of Nicoud & Ducros (1999), eq. 13, m2/s, C_w = 0.5: nought in pure shear and pure strain of a plane flow, 0.904 (C_w delta)^2
 * times the rate in solid rotation (where it does no work) */
double silt_eddy_wale(int dim, double delta, const double *gradient);

/** the model that a scene means: never TURBULENCE_AUTO */
silt_turbulence silt_turbulence_model(const silt_scene *scene);

typedef struct silt_eddy silt_eddy; // see eddy.c below

/** what the viscosities of a step look like, for the report */
typedef struct silt_viscosity_report {
    double eddy_mean, eddy_max; // Pa s, over cells (mean by volume)
    double rate_max;            // 1/s
} silt_viscosity_report;

/** True when a scene's viscosity is not the same everywhere: otherwise the arrays below are not needed. */
bool silt_viscosity_varies(const silt_scene *scene);
/** Viscosity of every cell: molecular or apparent (rheology) plus eddy viscosity.
 * Where the model is Smagorinsky or WALE, cells below the height at which the law of the wall looks at the water get at least
 * the mixing length's viscosity: nothing else there could carry the wall's traction into the water.
 * @param eddy    placed; of spalart-allmaras, else not looked at
 * @param flux    (dim + 1) * dim per cell, node by node: its volume times the gradients of the shape functions
 * @param inverse one per cell, 1/volume
 * @param v       dim per node, m/s
 * @param blend   share of the new value, the rest is what mu holds: 1 at first, 0.5 in iterations (Newton's square root: a stress
 *                quadratic in the rate, taken with the old rate times the new, would jump to and fro for ever)
 * @param mu      out, one per cell, Pa s
 * @param report  out, may be NULL */
void silt_viscosity_update(const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh, const silt_depth *depth,
                           const silt_eddy *eddy, const double *flux, const double *inverse, const double *v, double blend, double *mu,
                           silt_viscosity_report *report);

// ---------------------------------------------------------------- rheology.c

/** Apparent viscosity, Pa s, of Newtonian, Bingham and Herschel-Bulkley fluids at a shear rate (sqrt(2 S:S), 1/s):
 * (yield_stress + viscosity r^n)/r with r = rate/(1 - exp(-rate/plastic_rate)), which is Papanastasiou's (1987) for Bingham.
 * Above some plastic_rates it is the law itself; at rest a viscosity of (yield_stress + viscosity plastic_rate^n)/plastic_rate.
 * plastic_rate must be positive for fluids that are not Newtonian. */
double silt_apparent_viscosity(const silt_fluid_def *fluid, double rate);

// ---------------------------------------------------------------- wall_law.c

/** How a facet meets the water. @param roughness  out, m, k_s of the law of the wall, else 0.
 * @return the condition; -1: no wall (free surface, inlet) */
int silt_facet_condition(const silt_scene *scene, const silt_walls *walls, const silt_nodes *nodes, const silt_mesh *mesh,
                         int facet, double *roughness);

/** times h: the height above walls at which their law looks at the water */
double silt_wall_height(const silt_fluid_def *fluid);
/** Stress of a wall, Pa, from the speed along it at a height: u/u* = y+ on a smooth wall, ln(9.8 y+)/kappa in its log layer,
 * ln(30 y/k_s)/kappa on a rough one; whichever resists more. Rises with speed, without jumps.
 * @param roughness  m, k_s, 0 smooth; @param slope  out, Pa s/m, derivative by the speed, positive; may be NULL */
double silt_wall_stress(double rho, double nu, double speed, double height, double roughness, double *slope);

/** a node on a wall with the law of the wall, and the place in the water that its traction is taken from */
typedef struct silt_wall_point {
    int node;
    int element;         // of the walls, -1: bed or body
    int sample[4];       // nodes that hold the velocity there, -1
    double weight[4];    // their shares
    double normal[3];    // unit, into the water
    double area;         // m or m2 of wall that the node stands for; 0: no water to sample
    double height;       // m, of the sample above the wall: less than asked where the water is thinner
    double roughness;    // m, k_s
    double toe;          // m, way along the wall to the water's edge that runs over dry wall, 0: none near
    double velocity[3];  // m/s, of the wall
    double shear[3];     // Pa, of the last traction: stress of the water on the wall
} silt_wall_point;

/** the nodes under the law of the wall; valid when zeroed */
typedef struct silt_wall_law {
    int n_point, point_capacity, entry_capacity;
    silt_wall_point *point; // owned, rising by node
    int *entry;             // owned, working space: point of a node
    double y_plus[3];       // lowest, mean (by area), highest y+ of the samples at the last traction; 0: no point
} silt_wall_law;

/** Finds the wall nodes and where to look at the water: max(wall_height h, 2 k_s) along the wall's normal (mean of its facets at
 * the node). Call after every rebuild and once a step; x: positions, dim per node. */
void silt_wall_law_place(silt_wall_law *law, const silt_scene *scene, const silt_walls *walls, const silt_nodes *nodes,
                         const silt_mesh *mesh, const double *x);
/** Traction for the iterate v: the wall's force on the water at node i is force_i - friction_i w_i with the next iterate w. It is
 * the stress of the sampled velocity, plus its slope times the change of the node's own velocity: once the iterates stand
 * still (or the flow is steady) the sampled stress alone. Only the law's nodes are written; the caller zeroes the arrays.
 * @param v         dim per node, m/s
 * @param friction  out, one per node, kg/s, positive; @param force  out, dim per node, N */
void silt_wall_law_traction(silt_wall_law *law, const silt_scene *scene, int dim, const double *v, double *friction,
                            double *force);
void silt_wall_law_clear(silt_wall_law *law);

// ---------------------------------------------------------------- eddy.c

/** working space of the model of Spalart and Allmaras, whose unknown is silt_nodes.eddy; arrays grow only, valid when zeroed, empty with any other model */
struct silt_eddy {
    int node_capacity, link_capacity;
    double *reach;  // owned, per node, m: distance to the wall that brakes and 0.03 k_s, the d of the model; HUGE_VAL: none
    double *rough;  // owned, per node, m: k_s of that wall
    double *held;   // owned, per node, m2/s: what wall or inlet prescribe; -1: free
    double *share;  // owned, per node, m3 (plane: m2): water, each a part of the cells around
    double *gain;   // owned, per node, m2/s2 times share: production and what else makes more
    double *loss;   // owned, per node, share/s: destruction and what else makes less, over the value there
    double *solve[4]; // owned, per node, working space of the solver
    double *link;   // owned, one per neighbour in the mesh's lists, share/s: diffusion
    int iterations; // of the last solve
};

/** m2/s, eddy viscosity nu_t = nu~ f_v1. @param value  nu~; @param d  m, distance with 0.03 rough, may be infinite; @param rough  k_s */
double silt_eddy_viscosity(double nu, double value, double d, double rough);
/** Production c_b1 S~ nu~ and destruction c_w1 f_w (nu~/d)^2, m2/s2. @param omega  1/s, size of the vorticity */
void silt_eddy_sources(double nu, double value, double d, double rough, double omega, double *production, double *destruction);
/** the first, of a cell's means */
double silt_eddy_of_cell(const silt_eddy *eddy, const silt_nodes *nodes, const silt_mesh *mesh, int e, double nu);
/** 1/s, size of the vorticity of a velocity gradient */
double silt_vorticity(int dim, const double *gradient);
/** Distances and roughness for the step's viscosities; after silt_depth_update, silt_depth_crowd and silt_wall_law_place. */
void silt_eddy_place(silt_eddy *eddy, const silt_nodes *nodes, const silt_mesh *mesh, const silt_depth *depth, const silt_wall_law *law);
/** What the nodes begin with: scene->fluid.eddy. After silt_depth_update. */
void silt_eddy_start(const silt_scene *scene, silt_nodes *nodes, const silt_depth *depth);
/** Production, destruction and diffusion over dt, once the step's velocity v is known; transport is the nodes' motion. Diffusion and
 * destruction implicit: whatever dt, no value falls below nought. After silt_wall_law_traction.
 * @param flux, inverse  as in silt_viscosity_update; @param volume  per cell */
void silt_eddy_advance(silt_eddy *eddy, const silt_scene *scene, silt_nodes *nodes, const silt_mesh *mesh, const silt_depth *depth,
                       const silt_wall_law *law, const double *flux, const double *inverse, const double *volume, const double *v, double dt);
void silt_eddy_clear(silt_eddy *eddy);

// ---------------------------------------------------------------- tension.c

/** out += force of the free surface's tension (N/m) on the nodes at positions x */
void silt_tension_force(const silt_mesh *mesh, const double *x, double tension, double *out);

#endif
