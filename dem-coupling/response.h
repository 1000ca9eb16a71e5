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
/** A spring pulls at a free body, force and torque: it counts as a contact. Between the contacts of a substep and the next. */
void response_tie(int slot, const double pull[6]);
/** the answer to all of these on a body, once a substep */
void response_ties(int slot, double answer[6]);
/** Its means into the bodies: contact, answer. */
void response_end(void);

#endif
