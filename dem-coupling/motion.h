/** @file motion.h
 * In the worker: bodies that are held, moved by a path, tied to springs or set free, substep by substep.
 */
#ifndef SILT_MOTION_H
#define SILT_MOTION_H

#include "guide.h"
#include "protocol.h"

/** What guides the run that comes, NULL: nothing. Called when all bodies are where the last answer said. */
void motion_begin(dem_guide *guide, const dem_shared *shared);
/** Its set-up is over: now every look at the bodies' forces is one at the end of a substep. */
void motion_run(void);
void motion_end(void);
/** N, of contacts on a free body, as of the last look: all forces but weight, load and springs */
void motion_contact(int slot, double force[3]);

#endif
