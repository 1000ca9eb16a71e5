/** @file base.h
 * What every file of silt uses: status passing, memory, text, hashing, clocks. Shop floor, never installed.
 */
#ifndef SILT_BASE_H
#define SILT_BASE_H

#include "silt/silt.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/** returns early when a call failed; the error is already complete */
#define SILT_TRY(call)                                                                             \
    do {                                                                                           \
        silt_status status_ = (call);                                                              \
        if (status_ != SILT_OK)                                                                    \
            return status_;                                                                        \
    } while (0)

/** Fills err (which may be NULL) with a message and returns status. */
silt_status silt_fail(silt_error *err, silt_status status, const char *format, ...) __attribute__((format(printf, 3, 4)));

/** Grows an owned array so that it holds at least `need` items of `size` bytes; new bytes are zero.
 * Ends the program with a message only when memory is exhausted. Returns the (moved) array. */
void *silt_grow(void *data, int *capacity, int need, size_t size);
void *silt_alloc(size_t n, size_t size); /**< zeroed; never NULL (ends the program when memory is exhausted) */
/** few numbers, or such as nearly rise, into rising order, in place: by insertion */
void silt_sort_few(int n, int *number);
/** Room for `need` items, what was in it is lost; zeroed where it is new. For large arrays that last. */
void *silt_room(void *data, size_t *capacity, size_t need, size_t size);
/** For a program that is silt's alone: arrays that last come from the system, so that they leave no holes in the heap (a tenth of the
 * peak), and the heap keeps what it has for what is needed for a moment. */
void silt_memory_settle(void);
/** Memory that rests lends itself to what is needed for a moment, until it is lent no more (NULL, 0); what it holds is lost. One thread's. */
void silt_lend(void *data, size_t bytes);
void *silt_borrow(size_t n, size_t size); /**< as silt_alloc, of lent memory as far as that goes; silt_grow may be used on it */
void silt_return(void *data);             /**< for free(): gives back what was borrowed, frees what was not */
bool silt_borrowed(const void *data);     /**< whether it lies in memory that is lent now */
char *silt_text(const char *format, ...) __attribute__((format(printf, 1, 2))); /**< owned by the caller */

/** SILT_RESERVE(p, cap, need): p grows to hold need items */
#define SILT_RESERVE(p, capacity, need) ((p) = silt_grow((p), &(capacity), (need), sizeof *(p)))

/** A module of the program by its file name, beside it or in ../libexec/silt as the worker is (of a test: one folder up).
 * @return NULL and why; opened once more it is the same */
void *silt_module_open(const char *name, char why[512]);

double silt_seconds(void);                                       /**< monotonic wall clock, s */

/** What a step's time goes to. One clock runs at any time, so that they add up to the step; each thread has its own. */
#define SILT_CLOCKS(X)                                                                                                 \
    X(triangulate) X(decide) X(heal) X(book) X(index) X(refine) X(handover) X(assemble) X(momentum) X(matrix) \
        X(analyse) X(factor) X(apply) X(solve) X(bed) X(coupling) X(grains) X(move) X(output) X(rest)
typedef enum silt_clock {
#define X(name) CLOCK_##name,
    SILT_CLOCKS(X)
#undef X
        CLOCK_COUNT
} silt_clock;
void silt_clock_cpu(bool cpu);                /**< this thread's clocks tick on the wall, or in the process' own CPU time */
double silt_clock_now(void);                  /**< s, of that */
/** CPU time of another process that this one waited for; @return true: the clocks tick in CPU time and have taken it */
bool silt_clock_else(double seconds);
void silt_clock_reset(void);                  /**< all at 0, `rest` runs */
silt_clock silt_clock_to(silt_clock clock);   /**< from now on this one runs; @return the one that ran */
void silt_clock_book(silt_clock clock, double seconds); /**< s of the clock that runs are this one's */
void silt_clock_read(double seconds[CLOCK_COUNT]);
/** runs what follows on a clock, then goes back to the one that ran */
#define SILT_CLOCKED(name, ...)                                                                                        \
    do {                                                                                                               \
        const silt_clock clock_ = silt_clock_to(CLOCK_##name);                                                         \
        __VA_ARGS__;                                                                                                   \
        silt_clock_to(clock_);                                                                                         \
    } while (0)

uint64_t silt_hash(uint64_t seed, const void *data, size_t size); /**< FNV-1a, seed 0 starts */
uint64_t silt_random(uint64_t *state);                           /**< splitmix64 */
double silt_uniform(uint64_t *state);                            /**< in [0, 1) */

static inline double silt_min(double a, double b) { return a < b ? a : b; }
static inline double silt_max(double a, double b) { return a > b ? a : b; }
static inline double silt_clamp(double x, double lo, double hi) { return silt_min(silt_max(x, lo), hi); }
static inline double silt_square(double x) { return x * x; }
static inline double silt_dot(int dim, const double *a, const double *b) {
    double sum = 0;
    for (int d = 0; d < dim; d++)
        sum += a[d] * b[d];
    return sum;
}
/** a x b; out may be one of them */
static inline void silt_cross(const double *a, const double *b, double *out) {
    const double c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    out[0] = c[0];
    out[1] = c[1];
    out[2] = c[2];
}
/** u . (v x w): six times the volume of a tetrahedron with these edges */
static inline double silt_triple(const double *u, const double *v, const double *w) {
    return u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
}
/** Adds x to a sum that is carried on for ever; rest holds what rounding left out of it (Neumaier 1974), so that sum is right to its last bit. */
static inline void silt_sum(double *sum, double *rest, double x) {
    const double t = *sum + x;
    *rest += fabs(*sum) >= fabs(x) ? (*sum - t) + x : (x - t) + *sum;
    *sum = t + *rest;
    *rest -= *sum - t;
}
/** x turned by the quaternion q = (w, x, y, z), which may be of any length but zero; back: the other way */
static inline void silt_turn(const double q[4], bool back, const double x[3], double out[3]) {
    const double w = back ? -q[0] : q[0], square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], two = 2 / square;
    const double c[3] = {q[2] * x[2] - q[3] * x[1], q[3] * x[0] - q[1] * x[2], q[1] * x[1] - q[2] * x[0]};
    const double turned[3] = {x[0] + two * (w * c[0] + q[2] * c[2] - q[3] * c[1]), x[1] + two * (w * c[1] + q[3] * c[0] - q[1] * c[2]),
                              x[2] + two * (w * c[2] + q[1] * c[1] - q[2] * c[0])};
    out[0] = turned[0];
    out[1] = turned[1];
    out[2] = turned[2];
}
static inline double silt_length(int dim, const double *a) { return sqrt(silt_dot(dim, a, a)); }

#endif
