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
char *silt_text(const char *format, ...) __attribute__((format(printf, 1, 2))); /**< owned by the caller */

/** SILT_RESERVE(p, cap, need): p grows to hold need items */
#define SILT_RESERVE(p, capacity, need) ((p) = silt_grow((p), &(capacity), (need), sizeof *(p)))

double silt_seconds(void);                                       /**< monotonic wall clock, s */
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
static inline double silt_length(int dim, const double *a) { return sqrt(silt_dot(dim, a, a)); }

#endif
