/** @file script.h
 * Every string that is sent to LIGGGHTS. A call that LIGGGHTS refuses does not return (see worker.c).
 */
#ifndef SILT_SCRIPT_H
#define SILT_SCRIPT_H

#include "protocol.h"

#include <stdbool.h>

/** Box, materials, contact law, gravity, walls, fluid forces; from the restart file when shared->resume. plane[i] is
 * set to 1 when wall i became an infinite plane, 0 when it is a mesh, -1 when it lies outside the box; triangles count on after
 * the walls. */
void script_open(void *lmp, const dem_shared *shared, const char *restart, int *plane);
/** Templates of the free bodies and the integrator of spheres and bodies. @param file path of a scratch file, fd its
 * descriptor */
void script_integrate(void *lmp, const dem_shared *shared, const char *file, int fd);
/** Inserts free body k at its place; time stands still. */
void script_insert(void *lmp, const dem_shared *shared, int k);
/** Deletes the atoms of the dead type: once between two runs. */
void script_delete(void *lmp);
/** Adds shared's spheres through the scratch file. */
void script_add(void *lmp, const dem_shared *shared, const char *file, int fd);
/** neighbours, contact forces and applied forces anew; nothing moves, nothing is added to the contacts' history */
void script_set_up(void *lmp, const dem_shared *shared);
/** velocity and spin of every motion of the walls, for the substeps to come */
void script_motion(void *lmp, const dem_shared *shared, const double (*rate)[4]);
/** n_step substeps, the first with the forces of the last set-up; every run has its own set-up before: impulses are
 * exact, and a restarted worker gives the same bits */
void script_run(void *lmp, int n_step);
void script_save(void *lmp, const char *restart);

#endif
