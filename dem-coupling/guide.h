/** @file guide.h
 * What guides bodies and walls within a run: components that are held, paths, springs, releases. One block of the shared memory,
 * written by the coupling (guide.c), followed substep by substep in the worker (motion.c).
 */
#ifndef SILT_GUIDE_H
#define SILT_GUIDE_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/** a body that is not left to its forces alone */
typedef struct dem_guided {
    int slot;     // among the free bodies
    int held;     // bits: x, y, z, angle
    int path;     // row of the paths, -1: none
    int release;  // substep of the run at whose end it comes free, INT32_MAX: not in this run
    double force; // N, that sets it free; infinite: none does
    int freed, pad; // answer: it was set free by a force
} dem_guided;

/** a spring, or a line that only pulls */
typedef struct dem_tie {
    int slot, line;
    double arm[3];  // m, from the centroid to where it is tied, at the start of the run
    double to[3];   // m
    double stiffness, damping, length;
} dem_tie;

/** a body or grain whose contact force is written down */
typedef struct dem_traced {
    int slot, order; // among the free bodies, or among the grains of the last answer; the other is -1
} dem_traced;

/** The block: this head, n_body guided bodies, n_tie ties, n_path paths of n_step + 1 rows (x, y, z, turn in radians since the start of
 * the run) at the end of every substep and of the one after the run, n_wall walls of n_step rows (velocity, spin), n_trace that are
 * traced, and the answer: n_step rows of n_trace forces in N. */
typedef struct dem_guide {
    int n_body, n_tie, n_path, n_wall, n_trace, n_step;
} dem_guide;

static inline size_t dem_guide_size(const dem_guide *g) {
    return sizeof *g + (size_t)g->n_body * sizeof(dem_guided) + (size_t)g->n_tie * sizeof(dem_tie) +
           ((size_t)g->n_path * (size_t)(g->n_step + 1) + (size_t)g->n_wall * (size_t)g->n_step) * 4 * sizeof(double) +
           (size_t)g->n_trace * (sizeof(dem_traced) + 3 * (size_t)g->n_step * sizeof(double));
}
static inline dem_guided *dem_guide_body(dem_guide *g) { return (dem_guided *)(void *)(g + 1); }
static inline dem_tie *dem_guide_tie(dem_guide *g) { return (dem_tie *)(void *)(dem_guide_body(g) + g->n_body); }
static inline double (*dem_guide_path(dem_guide *g, int path))[4] {
    return (double(*)[4])(void *)(dem_guide_tie(g) + g->n_tie) + (size_t)path * (size_t)(g->n_step + 1);
}
static inline double (*dem_guide_wall(dem_guide *g, int wall))[4] {
    return dem_guide_path(g, g->n_path) + (size_t)wall * (size_t)g->n_step;
}
static inline dem_traced *dem_guide_traced(dem_guide *g) { return (dem_traced *)(void *)dem_guide_wall(g, g->n_wall); }
static inline double *dem_guide_trace(dem_guide *g) { return (double *)(void *)(dem_guide_traced(g) + g->n_trace); }

#endif
