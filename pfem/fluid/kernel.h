/** @file kernel.h
 * Integrals over cells are written once and compiled for two and for three dimensions.
 */
#ifndef SILT_KERNEL_H
#define SILT_KERNEL_H

#define KERNEL static inline __attribute__((always_inline)) void
#define BY_DIM(kernel, ...)                                                                                            \
    do {                                                                                                               \
        if (f->dim == 3)                                                                                               \
            kernel(3, __VA_ARGS__);                                                                                    \
        else                                                                                                           \
            kernel(2, __VA_ARGS__);                                                                                    \
    } while (0)

#endif
