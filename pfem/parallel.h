/** @file parallel.h
 * Loops on several threads whose results have the same bits for any number of them. There are three kinds:
 * - each item writes its own place: SILT_PARALLEL(n) before the loop;
 * - sums over all items: by chunks whose limits depend on the number of items only, added up in their order: silt_products, or a
 *   loop of one's own over silt_chunks(n);
 * - cells that add to their nodes: parts of the cells, fluid/parts.h.
 * Loops over few items run on one thread: to wake others takes as long as some thousand items.
 */
#ifndef SILT_PARALLEL_H
#define SILT_PARALLEL_H

#include <omp.h>

#define PARALLEL_LEAST 4096 // items (nodes, cells) that a thread is worth waking for
#define PARALLEL_MOST 16    // threads that are ever used
#define CHUNK_LENGTH 1024   // items in a chunk of a sum, at least
#define CHUNK_MOST 256

/** From now on loops may take n threads; 0: as many as OMP_NUM_THREADS or the machine says. OpenMP's own number stays at one: that is
 * BLAS', whose results hang on it. */
void silt_threads_ask(int n);
int silt_threads_asked(void);
/** threads for a loop over n items: as many as were asked for and are worth it */
static inline int silt_threads(int n) {
    const int asked = n < PARALLEL_LEAST ? 1 : silt_threads_asked(), worth = n / (PARALLEL_LEAST / 2);
    return asked < worth || worth < 1 ? asked : worth;
}

#define SILT_PRAGMA(text) _Pragma(#text)
/** before a loop over n items that each write their own place, or over chunks or parts of them */
#define SILT_PARALLEL(n) SILT_PRAGMA(omp parallel for schedule(static) num_threads(silt_threads(n)))

/** chunks that n items are summed in, 1 to CHUNK_MOST */
static inline int silt_chunks(int n) {
    const int count = n / CHUNK_LENGTH;
    return count < 1 ? 1 : count < CHUNK_MOST ? count : CHUNK_MOST;
}
/** first item of chunk c */
static inline int silt_chunk_first(int n, int c) { return (int)((long long)n * c / silt_chunks(n)); }
static inline double silt_total(int n_chunk, const double *part) {
    double sum = 0;
    for (int c = 0; c < n_chunk; c++)
        sum += part[c];
    return sum;
}
/** the sum of a[i] b[i] */
static inline double silt_products(int n, const double *a, const double *b) {
    double part[CHUNK_MOST];
    SILT_PARALLEL(n)
    for (int c = 0; c < silt_chunks(n); c++) {
        part[c] = 0;
        for (int i = silt_chunk_first(n, c); i < silt_chunk_first(n, c + 1); i++)
            part[c] += a[i] * b[i];
    }
    return silt_total(silt_chunks(n), part);
}

#endif
