/** @file protocol.h
 * What the client (dem.c) and the worker (silt-dem) share: the layout of the shared memory and the instructions. Both
 * map the same memory file; a byte over a socket pair hands it to and fro, so only one side touches it at a time, and
 * each side sees at once when the other has ended. The client lays out the sections anew for every instruction.
 */
#ifndef SILT_PROTOCOL_H
#define SILT_PROTOCOL_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

// file descriptors that the worker inherits
enum { DEM_FD_SOCKET = 3, DEM_FD_MEMORY, DEM_FD_RESTART, DEM_FD_FREE };

// atom types: the wall's material first, the dead ones (about to be deleted) last
enum { DEM_TYPE_WALL = 1, DEM_TYPE_GRAIN, DEM_TYPE_FROZEN, DEM_TYPE_BODY, DEM_TYPE_FIXED_BODY, DEM_TYPE_DEAD };

// instructions
enum {
    DEM_OPEN = 'o',   // starts LIGGGHTS from the numbers below; with resume from the restart file
    DEM_BODIES = 'b', // inserts the free bodies; before any sphere is there
    DEM_RUN = 'r',    // remove, add, load, n_step substeps
    DEM_SAVE = 's',   // LIGGGHTS' restart into the restart file
    DEM_CLOSE = 'c',
    DEM_DONE = 'd', // the worker's answer
};

/** a sphere to add */
typedef struct dem_add {
    int tag, type;
    double x[3], v[3], omega[3], radius, density;
} dem_add;

/** a grain after a run */
typedef struct dem_grain {
    int tag, contacts, on_bed, pad;
    double x[3], v[3], omega[3], radius, mass;
} dem_grain;

/** a free body: what it is (open, bodies), its load (run), its state (answer) */
typedef struct dem_body {
    int n_sphere, first; // its spheres in the sphere section, rows first .. first + n_sphere - 1; tag of row k is k + 1
    double mass, inertia, angle;
    double tensor[6], q[4];    // space: xx, yy, zz, xy, xz, yz of the inertia in its frame; how it is turned at the start
    double x[3], v[3], omega[3]; // omega of an answer in space: angular momentum
    double axis[3][3]; // directions of lines fixed in the body, in the plane the first
    double force[3], torque[3];
    double contact[6], answer[6]; // mean force and torque of contacts, and what the water answered (response.h); with n_response only
    int present, pad; // 0: it left the box
} dem_body;

/** how a wall moves during a run: the surfaces that carry its number, as one stiff piece */
typedef struct dem_motion {
    double centre[3]; // m, what it turns about, where it is when LIGGGHTS starts
    double velocity[3], spin; // m/s, rad/s, of the run; in the plane from x to y, in space from x to z
} dem_motion;

typedef struct dem_shared {
    uint64_t size; // bytes of the memory file; the worker maps again when it grew
    // the numbers of silt_dem_def
    int dim, periodic, across, spare;
    double lo[3], hi[3], way_lo[3], way_hi[3], period, gravity[3];
    double youngs_modulus, wall_modulus, poissons_ratio, restitution, friction, rolling_friction, body_friction;
    double step, max_radius, min_radius;
    int resume, no_contacts;
    // lengths of the sections
    int n_wall, n_triangle, n_motion, n_body, n_body_sphere, n_remove, n_add, n_force, n_torque, n_shift, n_guide, n_response, max_grain;
    int n_step;
    int keep; // 1: this run may go on from the last one's end
    // answer
    int n_grain;
    double seconds, cpu; // that the substeps took, on the wall and in CPU time, without what stands before and after them
    double cpu_all;      // CPU time since the last answer
    char text[1024]; // why the worker gave up, or empty
    // sections, bytes from the start
    uint64_t wall;        // plane: 4 double per wall, where it is when LIGGGHTS starts, or when the run ends
    uint64_t triangle;    // space: 10 double per triangle of a wall
    uint64_t wall_motion; // int per wall and triangle: which motion it has, -1: none
    uint64_t motion;      // dem_motion
    uint64_t body;        // dem_body
    uint64_t body_sphere; // 3 double: x, y from the centroid, radius; in space 4: x, y, z, radius
    uint64_t remove;      // int: tags
    uint64_t add;         // dem_add
    uint64_t force;       // 3 double per grain of the last answer, in its order
    uint64_t torque;      // 3 double per grain, alike
    uint64_t shift;       // 3 double per grain, alike
    uint64_t response;    // 6 n_body rows of as many double, see response.h
    uint64_t guide;       // n_guide bytes, see guide.h
    uint64_t grain;       // dem_grain, rising tags (answer)
} dem_shared;

/** section of the shared memory as a pointer */
#define DEM_SECTION(shared, type, name) ((type *)(void *)((char *)(shared) + (shared)->name))

/** Lays the sections out one behind the other for the lengths above. @return bytes needed */
static inline uint64_t dem_shared_layout(dem_shared *s) {
    uint64_t end = (sizeof *s + 63) & ~(uint64_t)63;
#define DEM_PLACE(name, count, type) (s->name = end, end += ((uint64_t)(count) * sizeof(type) + 63) & ~(uint64_t)63)
    DEM_PLACE(wall, 4 * s->n_wall, double);
    DEM_PLACE(triangle, 10 * s->n_triangle, double);
    DEM_PLACE(wall_motion, s->n_wall + s->n_triangle, int);
    DEM_PLACE(motion, s->n_motion, dem_motion);
    DEM_PLACE(body, s->n_body, dem_body);
    DEM_PLACE(body_sphere, (s->dim == 3 ? 4 : 3) * s->n_body_sphere, double);
    DEM_PLACE(remove, s->n_remove, int);
    DEM_PLACE(add, s->n_add, dem_add);
    DEM_PLACE(force, 3 * s->n_force, double);
    DEM_PLACE(torque, 3 * s->n_torque, double);
    DEM_PLACE(shift, 3 * s->n_shift, double);
    DEM_PLACE(response, s->n_response, double);
    DEM_PLACE(guide, s->n_guide, char);
    DEM_PLACE(grain, s->max_grain, dem_grain);
#undef DEM_PLACE
    return end;
}

/** What silt starts its worker with: a worker of another version, whose memory is laid out differently, does not serve. */
static inline void dem_serve_word(char word[48]) {
    snprintf(word, 48, "serve-1-%zu-%zu-%zu-%zu", sizeof(dem_shared), sizeof(dem_body), sizeof(dem_add), sizeof(dem_grain));
}

#endif
