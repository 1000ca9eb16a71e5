/** @file kernel.h
 * Integrals over cells are written once and compiled for two and for three dimensions.
 */
#ifndef SILT_KERNEL_H
#define SILT_KERNEL_H

#define KERNEL static inline __attribute__((always_inline)) void
#define BY_DIM(kernel, ...)                                                                                            \
    do {                                                                                                               \
        if (f->dim == 3) {                                                                                             \
            kernel(3, ##__VA_ARGS__);                                                                                  \
        } else {                                                                                                       \
            kernel(2, ##__VA_ARGS__);                                                                                  \
        }                                                                                                              \
    } while (0)

/** kernel(D, f, mesh, e, to, ...) for every cell e, part by part (parts.h). @param target  silt_sums that it adds to */
#define BY_CELL(target, kernel, ...)                                                                                   \
    do {                                                                                                               \
        const silt_sums sums_ = target;                                                                                \
        SILT_PRAGMA(omp parallel num_threads(f->parts.n))                                                              \
        {                                                                                                              \
            SILT_PRAGMA(omp for schedule(static))                                                                      \
            for (int part_ = 0; part_ < f->parts.n; part_++)                                                           \
                BY_DIM(CELLS_OF_PART, &f->parts, part_, sums_, kernel, ##__VA_ARGS__);                                 \
            SILT_PRAGMA(omp for schedule(static))                                                                      \
            for (int part_ = 0; part_ < f->parts.n; part_++)                                                           \
                silt_parts_finish(&f->parts, sums_, part_);                                                            \
        }                                                                                                              \
    } while (0)
// the cells between those of the border in a loop of their own, as fast as without parts
#define CELLS_OF_PART(D, parts, part, sums, kernel, ...)                                                               \
    for (int e_ = (parts)->first[part], b_ = (parts)->border[part], end_ = (parts)->first[(part) + 1];; e_++, b_++) {  \
        const int stop_ = b_ < (parts)->border[(part) + 1] ? (parts)->cell[b_] : end_;                                 \
        for (; e_ < stop_; e_++)                                                                                       \
            kernel(D, f, mesh, e_, ((silt_to){(sums).wide, (sums).one, mesh->cell[e_]}), ##__VA_ARGS__);               \
        if (e_ >= end_)                                                                                                \
            break;                                                                                                     \
        kernel(D, f, mesh, e_, silt_parts_aside(parts, b_), ##__VA_ARGS__);                                            \
        silt_parts_settle(parts, mesh, sums, b_);                                                                      \
    }
/** kernel(D, f, first, last, c, ...) for the nodes of every chunk c (parallel.h) */
#define BY_CHUNK(kernel, ...)                                                                                          \
    do {                                                                                                               \
        const int n_ = f->n_node;                                                                                      \
        SILT_PARALLEL(n_)                                                                                              \
        for (int c_ = 0; c_ < silt_chunks(n_); c_++)                                                                   \
            BY_DIM(kernel, f, silt_chunk_first(n_, c_), silt_chunk_first(n_, c_ + 1), c_, ##__VA_ARGS__);              \
    } while (0)
#define SUMS(width, wide, one) ((silt_sums){width, wide, one})

#endif
