/** @file force.h
 * Forces of the water on grains besides drag and pressure gradient: added mass, lift, viscous force, torque on the spin; in the
 * plane and in space. Part of the exchange (exchange.h), which calls these with groups of eight grains. What is not asked for has
 * no arrays and takes no time. All of it acts on the water the other way round.
 *
 * Added mass: m_a (Du/Dt - dv/dt), m_a = C rho V, Du/Dt = (u - u_0)/(theta dt) of the water that passes, implicit on both sides: the
 * grain moves with m + m_a, and the water's nodes carry their share in the drag's coefficient and push.
 * The others are worked out in each update from the water's last iterate and the grain's velocity at the end of the step, as far as
 * that iterate tells it; they are handed to both sides as they are.
 */
#ifndef SILT_FORCE_H
#define SILT_FORCE_H

#include "drag.h"

typedef struct silt_force_def {
    double added_mass; // coefficient C; 0: none
    double theta;      // implicitness of the water's step
    bool viscous;      // V div tau, of fluid.viscosity
    bool lift;         // Saffman 1965
    bool spin;         // torque -pi mu d^3 (omega - curl u/2)
} silt_force_def;

/** eight grains, beside exchange_group */
typedef struct force_group {
    double added[DRAG_GROUP];                     // kg/m, m_a
    double share[DRAG_GROUP], own[DRAG_GROUP];    // m_a/(m + m_a) and m/(m + m_a); 0 and 1 of grains that are held
    double before[3][DRAG_GROUP];                 // m/s, the water's velocity at the grain at the start of the step
    double lift[DRAG_GROUP];                      // 1.615 d^2 sqrt(rho mu) of all grains that it stands for
    double twist[DRAG_GROUP], yield[DRAG_GROUP];  // pi mu d^3 of them; that after what the spin gives way in the step
    double spin[3][DRAG_GROUP];                   // 1/s, in the plane the first only; so is torque
    double torque[3][DRAG_GROUP];                 // N m/m, of the last update
    double coefficient[DRAG_GROUP], push[3][DRAG_GROUP]; // force = coefficient u - push, of the last update, pressure not counted
} force_group;

typedef struct silt_forces {
    silt_force_def def; // given once
    // inside
    bool starting; // the water is as at the start of the step
    double dt;
    struct force_group *group; // owned
    double *field;             // owned, smoothed: curl u, div tau per volume, in rows of 4 (space: 8) in the kernel's order
    double *stress;            // owned, per node that is looked at: gradient of u, then tau, and what it is the mean over
    int group_capacity, field_capacity, stress_capacity;
} silt_forces;

struct silt_exchange;

/** any of them */
static inline bool silt_forces_on(const silt_forces *f) {
    return f->def.added_mass > 0.0 || f->def.viscous || f->def.lift || f->def.spin;
}
/** any that looks at the water's shear */
static inline bool silt_forces_sheared(const silt_forces *f) { return f->def.viscous || f->def.lift || f->def.spin; }

/** What does not change within a step, of group m: pace and start of the exchange's group become those with the added mass. */
void silt_force_pack(struct silt_exchange *exchange, int m, double dt);
/** Curl and viscous force of the water that was seen last, smoothed. */
void silt_force_fields(struct silt_exchange *exchange);
/** Forces of group m in an update. felt: of velocity and pressure gradient, eight each; out: what the grains give, anew */
void silt_force_give(struct silt_exchange *exchange, int m, const double *felt, double *out);
/** The torques on the grains, turned round, as forces on the nodes, into push: f_i = -1/2 int c x grad N_i with c their spread
 * density has the sum 0 and the moment -int c. */
void silt_force_couple(struct silt_exchange *exchange);
void silt_forces_clear(silt_forces *forces);

#endif
