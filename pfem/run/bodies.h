/** @file bodies.h
 * Rigid bodies in the water of a step: what run/bodies.c and run/inertia.c share.
 */
#ifndef SILT_BODIES_H
#define SILT_BODIES_H

#include "run.h"

#define ROW 6 // numbers of a body: force and torque, or velocity and angular velocity

/** what the bodies of a step are for the discrete elements: n free ones, ROW rows each */
typedef struct silt_impedance {
    int n, size, n_live;
    int *body;       // owned, the free ones, in order
    double *water;   // owned, size * size, kg: the water's force per acceleration, turned round
    double *mass;    // owned, the same, of the bodies
    double *answer;  // owned, the same: R of dem-coupling/response.h
    int *live;       // owned, rows of motion that is free
} silt_impedance;

// inertia.c
/** rows, the bodies' mass, the free motions; the water's inertia is nought */
silt_impedance silt_impedance_begin(const silt_run *run);
/** The water's inertia at the bodies of the step that was just solved. */
silt_status silt_impedance_solve(silt_run *run, const silt_step *step, silt_impedance *z, silt_error *err);
void silt_impedance_clear(silt_impedance *z);
/** the tensor of inertia of a body in space's axes, kg m2 */
void silt_body_tensor(const struct silt_body *body, double tensor[3][3]);
/** from a body's centre to the farthest of its surface, m */
double silt_body_reach(const struct silt_body *body, int dim);

// bodies.c
/** from body b's place half way through the step to a node's then, m; nodes under films are none of the water's mesh */
void silt_body_arm(const silt_run *run, int b, int i, double arm[3]);
/** whether forces move a body in this mode */
bool silt_body_moves(const silt_body_def *def, int mode);
/** It has left for good, or waits for its release, which hangs on the force that acts on it as it stands; in the rest of the step in which that
 * comes it moves with its own mass. */
bool silt_body_waits(const silt_run *run, int b);

#endif
