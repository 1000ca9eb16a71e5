/** @file bed_law.h
 * Erosion laws: what the water's shear wears off the bed's surface, node by node, until a patch is due. The laws see a node as a
 * normal, a stress and a mass per area, so that they are the same in the plane and in space. docs/bed.md holds them all.
 */
#ifndef SILT_BED_LAW_H
#define SILT_BED_LAW_H

#include "bed.h"

// ---------------------------------------------------------------- the laws

/** grain size without dimension, d ((s - 1) g/nu^2)^(1/3), of the scene's grains.diameter */
double silt_bed_dstar(const silt_scene *scene);
/** critical Shields number on level ground: 0.30/(1 + 1.2 D*) + 0.055 (1 - exp(-0.020 D*)), Soulsby and Whitehouse (1997) */
double silt_shields_critical(double dstar);
/** Pa, tau_c on level ground: the scene's threshold, or for the law shields its Shields number times (rho_s - rho) g d */
double silt_bed_threshold(const silt_scene *scene);
/** Pa, stress at which grains of the bed's diameter begin to move on level ground, whatever the law: what deposition asks for */
double silt_bed_motion(const silt_scene *scene);
/** What a slope leaves of the threshold (Soulsby 1997): (cos psi sin beta + sqrt(cos2 beta tan2 phi - sin2 psi sin2 beta))/tan phi,
 * which is cos beta (1 - tan beta/tan phi) straight downhill and cos beta sqrt(1 - tan2 beta/tan2 phi) across; 0 beyond repose.
 * @param upright  cos beta, upward part of the unit normal; @param uphill  cos psi sin beta, upward part of the flow's direction
 * @param repose   phi, degrees; 0: no effect */
double silt_bed_slope(double upright, double uphill, double repose);
/** m/s, E of the laws power, excess-shear and shields: how fast level ground sinks under the stress tau.
 * @param threshold  tau_c where the node is; @param level  tau_c on level ground */
double silt_bed_rate(const silt_scene *scene, double tau, double threshold, double level);

// ---------------------------------------------------------------- on the bed

/** J/m3: a bed without any W_c needs next to none, so that shares of it are numbers */
static inline double silt_bed_least_work(double work) { return silt_max(work, 1e-100); }
/** J/m3, W_c of a node: that of the bed, or of what was deposited */
static inline double silt_bed_work(const silt_bed *bed, const silt_scene *scene, int node) {
    return silt_bed_least_work(node >= bed->n_first && scene->bed.deposit_work > 0 ? scene->bed.deposit_work : scene->bed.work);
}
/** Adds a step's frictional work and the mass per area worn off at the exposed nodes (law, shear and threshold of the scene), and
 * refreshes bed->shear and bed->y_plus.
 * @param cover  one per node, share of its surface that parcels lie on, which does not wear; NULL: none */
void silt_bed_wear(silt_bed *bed, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                   const silt_locator *locator, const double *cover, double dt);
/** Share of every node's surface that parcels lie on or roll over (bed_cover.c): a parcel that touches the bed covers its own width
 * (in space: its section), shared among the exposed nodes around it. @param cover  out, n_node numbers, 0 to 1 */
void silt_bed_cover(const silt_bed *bed, const silt_scene *scene, const silt_grain_state *grains, double *cover);
/** Exposed nodes whose accumulator is full, fullest first: work >= W_c, or mass per area worn off >= mass per exposed area of the
 * patch. Ask once a step: what that step's releases expose comes in the next. @return how many (at most capacity) */
int silt_bed_due(const silt_bed *bed, const silt_scene *scene, int capacity, int *due);

/** Exposed nodes that fall (bed_slope.c): they stand higher than the angle of repose allows over a node within eight along the surface,
 * by more than the step that a single release cuts; of neighbours the highest over what is allowed, so that slopes give way from the
 * top, a row in a step. @return how many */
int silt_bed_steep(const silt_bed *bed, const silt_scene *scene, int capacity, int *node);
/** Pa, shear stress of the last step on the exposed node nearest to x (dim numbers); 0 without any */
double silt_bed_shear_at(const silt_bed *bed, const double *x);
/** Puts a parcel's solid mass into the pores of cells whose centres are within reach of x, the nearest first, down to a porosity: all of
 * it or nothing. @return in deposit->kind: DEPOSIT_DENSER or DEPOSIT_REFUSED */
silt_deposit_kind silt_bed_densify(silt_bed *bed, const silt_scene *scene, const double *x, double reach, double porosity, double mass,
                                   silt_deposit *deposit);
/** The nodes around a patch that is about to leave, and what its node has worn off beyond it */
typedef struct silt_bed_heirs {
    int count, node_capacity, length_capacity;
    int *node;      // owned, all nodes of the patch
    double *length; // owned, m, of surface before the release, 0: buried
    double work, work_length; // J/m3 times m of surface
    double eroded;            // kg/m
} silt_bed_heirs;
void silt_bed_heirs_take(silt_bed_heirs *heirs, const silt_bed *bed, const silt_scene *scene, const silt_patch *patch);
/** After the patch has left: newly exposed nodes start with the excess, shared over their surface; where there are none those around
 * take it. Nodes whose surface changed keep the mass that was worn off them, not the mass per area: over many releases the mass that
 * leaves is the mass that was worn off. Empties heirs. */
void silt_bed_heirs_give(silt_bed_heirs *heirs, silt_bed *bed);

#endif
