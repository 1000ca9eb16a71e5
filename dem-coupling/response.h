/** @file response.h
 * In every substep of the worker: what contacts exert on the free bodies, and what the water answers to that. LIGGGHTS moves a body
 * with its own mass M; with the force R C added to contact forces C it moves as one that the water's inertia Z makes heavier:
 * R = M (M + Z)^-1 - 1 (docs/method.md). Six numbers a body: force, and torque about the centroid, of the slab.
 */
#ifndef SILT_RESPONSE_H
#define SILT_RESPONSE_H

#include "protocol.h"

/** Once LIGGGHTS has its fix `imp`, which stands after all contacts, before the water's forces and the bodies' sums.
 * @return 0: it has none */
int response_open(void *lmp);
/** A run of shared->n_step substeps is about to be set up: what the sections `body` and `response` say holds for it.
 * @return 0: out of memory */
int response_begin(void *lmp, dem_shared *shared);
/** Adds the water's answer to other forces on the bodies in the present substep, ROW = 6 numbers a body; after the contacts were seen. */
void response_add(double *force);
/** Its means into the bodies: contact, answer. */
void response_end(void);

#endif
