// motion.c: what moves bodies besides forces. LIGGGHTS asks for the forces on its bodies at the end of every substep; this stands in the
// way: adds springs, takes out what is held, and sets velocities so that a path is met.
#define _GNU_SOURCE
#include "motion.h"
#include "base.h"
#include "response.h"

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/** a body's numbers in LIGGGHTS, which may be written */
typedef struct motion_body {
    double *x, *v, *force, *torque, *momentum, *inertia;
    const double *axis[3];
} motion_body;

/** at the start of a run */
typedef struct motion_pose {
    double axis[3][3];
} motion_pose;

static struct {
    dem_guide *guide;
    int dim, substep, running; // ends of substeps that have come
    double step;
    void *bodies;        // LIGGGHTS' store of them
    motion_pose *pose;   // owned, one per guided body
    double (*arm)[3];    // owned, one per tie: in the axes of its body
    int n_pose, n_arm, n_contact;
    double (*contact)[3]; // owned, one per free body where forces are traced
    const dem_shared *shared;
} motion;

#define MOTION_EXPORT __attribute__((visibility("default")))
#define MOTION_EXTRACT "_ZN9LAMMPS_NS11Multisphere7extractEPKcRiS3_"
#define MOTION_FORCE "_ZN9LAMMPS_NS14FixMultisphere10calc_forceEb"
typedef void *motion_extract(void *self, const char *name, int *length, int *width);
typedef void motion_force(void *self, int set_up);

// the function that LIGGGHTS has under this name
static void *motion_original(const char *name) {
    void *found = dlsym(RTLD_NEXT, name);
    if (!found) {
        fprintf(stderr, "this LIGGGHTS has no %s\n", name);
        exit(70);
    }
    return found;
}

// whoever asks for a body's numbers tells where they are kept
MOTION_EXPORT void *motion_bodies(void *self, const char *name, int *length, int *width) __asm__(MOTION_EXTRACT);
void *motion_bodies(void *self, const char *name, int *length, int *width) {
    static motion_extract *original;
    if (!original)
        original = (motion_extract *)(uintptr_t)motion_original(MOTION_EXTRACT);
    motion.bodies = self;
    return original(self, name, length, width);
}

static double **motion_rows(const char *name) {
    int length, width;
    double **row = motion_bodies(motion.bodies, name, &length, &width);
    if (!row) {
        fprintf(stderr, "this LIGGGHTS keeps no %s of bodies\n", name);
        exit(70);
    }
    return row;
}

// where LIGGGHTS keeps the body with this number, -1: it is gone
static int motion_row(int slot) {
    int length, width;
    const int *id = motion_bodies(motion.bodies, "id_multisphere", &length, &width);
    for (int i = 0; id && i < length; i++)
        if (id[i] == slot + 1)
            return i;
    return -1;
}

static int motion_look(int slot, motion_body *b) {
    const int i = motion_row(slot);
    if (i < 0)
        return 0;
    *b = (motion_body){motion_rows("xcm")[i], motion_rows("vcm")[i], motion_rows("fcm")[i], motion_rows("torque")[i],
                       motion_rows("angmom")[i], motion_rows("inertia")[i],
                       {motion_rows("ex_space")[i], motion_rows("ey_space")[i], motion_rows("ez_space")[i]}};
    return 1;
}

void motion_begin(dem_guide *guide, const dem_shared *shared) {
    motion.guide = guide;
    motion.step = shared->step;
    motion.shared = shared;
    motion.dim = shared->dim;
    motion.substep = motion.running = 0;
    if (!guide || !motion.bodies)
        return;
    if (guide->n_body > motion.n_pose)
        motion.pose = realloc(motion.pose, (size_t)(motion.n_pose = guide->n_body) * sizeof *motion.pose);
    if (guide->n_tie > motion.n_arm)
        motion.arm = realloc(motion.arm, (size_t)(motion.n_arm = guide->n_tie) * sizeof *motion.arm);
    if (guide->n_trace && shared->n_body > motion.n_contact)
        motion.contact = realloc(motion.contact, (size_t)(motion.n_contact = shared->n_body) * sizeof *motion.contact);
    if ((guide->n_body && !motion.pose) || (guide->n_tie && !motion.arm) || (motion.n_contact && !motion.contact))
        abort();
    for (int k = 0; k < guide->n_body; k++) {
        motion_body b;
        for (int c = 0; c < 3 && motion_look(dem_guide_body(guide)[k].slot, &b); c++)
            memcpy(motion.pose[k].axis[c], b.axis[c], sizeof motion.pose[k].axis[c]);
    }
    for (int k = 0; k < guide->n_tie; k++) {
        motion_body b;
        const dem_tie *tie = &dem_guide_tie(guide)[k];
        for (int c = 0; c < 3 && motion_look(tie->slot, &b); c++)
            motion.arm[k][c] = silt_dot(3, tie->arm, b.axis[c]);
    }
}

void motion_run(void) {
    motion.substep = 0;
    motion.running = 1;
}

void motion_end(void) { motion.guide = NULL; }

// angular velocity of a body; in the plane its other moments of inertia are made up
static void motion_spin(const motion_body *b, double *omega) {
    double turn[3];
    for (int c = 0; c < 3; c++)
        turn[c] = silt_dot(3, b->momentum, b->axis[c]) / b->inertia[c];
    for (int d = 0; d < 3; d++)
        omega[d] = turn[0] * b->axis[0][d] + turn[1] * b->axis[1][d] + turn[2] * b->axis[2][d];
}

static void motion_set_spin(const motion_body *b, const double *omega) {
    memset(b->momentum, 0, 3 * sizeof(double));
    for (int c = 0; c < 3; c++)
        for (int d = 0; d < 3; d++)
            b->momentum[d] += b->inertia[c] * silt_dot(3, omega, b->axis[c]) * b->axis[c][d];
}

static void motion_pull(const dem_tie *tie, const double *local, const motion_body *b) {
    double arm[3] = {0, 0, 0}, way[3], omega[3], speed[3], force[3], torque[3];
    for (int c = 0; c < 3; c++)
        for (int d = 0; d < motion.dim; d++)
            arm[d] += local[c] * b->axis[c][d];
    motion_spin(b, omega);
    silt_cross(omega, arm, speed);
    for (int d = 0; d < 3; d++) {
        way[d] = d < motion.dim ? b->x[d] + arm[d] - tie->to[d] : 0;
        speed[d] += b->v[d];
    }
    const double length = sqrt(silt_dot(3, way, way));
    if (tie->line && length <= tie->length)
        return;
    if (!(length > 0))
        return; // no direction
    double pull = tie->stiffness * (length - tie->length) + tie->damping * silt_dot(3, speed, way) / length;
    if (tie->line && pull < 0)
        return;
    for (int d = 0; d < 3; d++)
        force[d] = -pull * way[d] / length;
    silt_cross(arm, force, torque);
    for (int d = 0; d < 3; d++) {
        b->force[d] += force[d];
        b->torque[d] += torque[d];
    }
}

// the component of a held angle: in the plane about z, in space all
static void motion_hold(int held, const motion_body *b) {
    for (int d = 0; d < 3; d++) {
        if (held >> d & 1)
            b->force[d] = b->v[d] = 0;
        if (held >> 3 & 1)
            b->torque[d] = b->momentum[d] = 0;
    }
}

// Without forces it goes straight on: with this velocity and spin it is at the row after the substep. What rounding leaves is made
// good by the next.
static void motion_follow(const double row[4], const motion_pose *from, const motion_body *b) {
    const int up = motion.dim == 3 ? 2 : 1;
    const double c = cos(row[3]), s = sin(row[3]);
    double turn[3] = {0, 0, 0};
    for (int a = 0; a < 3; a++) {
        double to[3], part[3];
        memcpy(to, from->axis[a], sizeof to);
        to[0] = c * from->axis[a][0] - s * from->axis[a][up];
        to[up] = s * from->axis[a][0] + c * from->axis[a][up];
        silt_cross(b->axis[a], to, part);
        for (int d = 0; d < 3; d++)
            turn[d] += part[d] / 2;
    }
    // the sine of the angle that is left
    const double sine = sqrt(silt_dot(3, turn, turn)), share = sine > 1e-8 ? asin(fmin(sine, 1)) / sine : 1;
    for (int d = 0; d < 3; d++) {
        b->force[d] = b->torque[d] = 0;
        b->v[d] = d < motion.dim ? (row[d] - b->x[d]) / motion.step : 0;
        turn[d] *= share / motion.step;
    }
    motion_set_spin(b, turn);
}

static void motion_guide(dem_guided *to, const motion_pose *from, const motion_body *b) {
    if (to->path >= 0) {
        motion_follow(dem_guide_path(motion.guide, to->path)[motion.substep], from, b);
        return;
    }
    const double force = sqrt(silt_dot(3, b->force, b->force));
    to->freed |= force > to->force;
    if (to->freed || motion.substep >= to->release)
        return;
    motion_hold(to->held, b);
}

// springs and lines, and what the water answers to them
static void motion_ties(dem_guide *guide) {
    motion_body b;
    int last = -1;
    for (int k = 0; k < guide->n_tie; k++) {
        const dem_tie *tie = &dem_guide_tie(guide)[k];
        double pull[6];
        if (!motion_look(tie->slot, &b))
            continue;
        for (int d = 0; d < 3; d++) {
            pull[d] = -b.force[d];
            pull[3 + d] = -b.torque[d];
        }
        motion_pull(tie, motion.arm[k], &b);
        for (int d = 0; d < 3; d++) {
            pull[d] += b.force[d];
            pull[3 + d] += b.torque[d];
        }
        response_tie(tie->slot, pull);
        last = tie->slot > last ? tie->slot : last;
    }
    for (int slot = 0; last >= 0 && motion_look(slot, &b); slot++) {
        double answer[6];
        response_ties(slot, answer);
        for (int d = 0; d < 3; d++) {
            b.force[d] += answer[d];
            b.torque[d] += answer[3 + d];
        }
    }
}

void motion_contact(int slot, double force[3]) { memcpy(force, motion.contact[slot], sizeof motion.contact[slot]); }

static void motion_note(void) {
    const dem_body *body = DEM_SECTION(motion.shared, const dem_body, body);
    motion_body b;
    for (int k = 0; k < motion.shared->n_body; k++)
        for (int d = 0; d < 3; d++)
            motion.contact[k][d] =
                motion_look(k, &b) ? b.force[d] - body[k].force[d] - body[k].mass * motion.shared->gravity[d] : NAN;
}

MOTION_EXPORT void motion_forces(void *self, int set_up) __asm__(MOTION_FORCE);
void motion_forces(void *self, int set_up) {
    static motion_force *original;
    if (!original)
        original = (motion_force *)(uintptr_t)motion_original(MOTION_FORCE);
    original(self, set_up);
    dem_guide *guide = motion.guide;
    motion_body b;
    motion.substep += motion.running;
    if (!guide || !motion.bodies || motion.substep > guide->n_step)
        return;
    if (guide->n_trace)
        motion_note();
    motion_ties(guide);
    for (int k = 0; k < guide->n_body; k++)
        if (motion_look(dem_guide_body(guide)[k].slot, &b))
            motion_guide(&dem_guide_body(guide)[k], &motion.pose[k], &b);
}
