/** @file vector.h
 * Eight numbers at a time: types, and the functions that the compiler does not make vectors of. Compiled for several processors,
 * the best is taken at the start; for use within one file only.
 */
#ifndef SILT_VECTOR_H
#define SILT_VECTOR_H

#include <stdint.h>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && !defined(__AVX__)
#define VECTOR_CLONES __attribute__((target_clones("avx512f", "arch=haswell", "default")))
#else
#define VECTOR_CLONES
#endif
#define VECTOR_INLINE static inline __attribute__((always_inline, unused))
#pragma GCC diagnostic ignored "-Wpsabi" // vectors are passed within a file only

typedef double eight __attribute__((vector_size(8 * sizeof(double)), aligned(sizeof(double)), may_alias));
typedef double four __attribute__((vector_size(4 * sizeof(double)), aligned(sizeof(double)), may_alias));
typedef int64_t eight_bits __attribute__((vector_size(8 * sizeof(double)), aligned(sizeof(double)), may_alias));

VECTOR_INLINE eight eight_choose(eight_bits which, eight yes, eight no) {
    return (eight)(((eight_bits)yes & which) | ((eight_bits)no & ~which));
}

VECTOR_INLINE eight eight_most(eight x, double least) { return eight_choose(x > least, x, least + 0.0 * x); }

VECTOR_INLINE eight eight_root(eight x) {
    eight root;
    for (int k = 0; k < 8; k++)
        root[k] = __builtin_sqrt(x[k]);
    return root;
}

/** e^x for -700 < x < 700, beyond it that of the bounds; relative error 3e-16 */
VECTOR_INLINE eight eight_exp(eight x) {
    const double shift = 0x1.8p52; // brings the nearest integer into the lowest bits
    x = eight_choose(x > -700.0, x, 0.0 * x - 700.0);
    x = eight_choose(x < 700.0, x, 0.0 * x + 700.0);
    const eight moved = x * 0x1.71547652b82fep+0 + shift, n = moved - shift;
    const eight r = (x - n * 0x1.62e42fefa38p-1) - n * 0x1.ef35793c7673p-45; // ln 2 in two parts
    eight sum = 0.0 * r + 1.0 / 6227020800.0;
    static const double per[12] = {1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0, 1.0 / 362880.0, 1.0 / 40320.0, 1.0 / 5040.0,
                                   1.0 / 720.0,       1.0 / 120.0,      1.0 / 24.0,      1.0 / 6.0,      0.5,           1.0};
    for (int k = 0; k < 12; k++)
        sum = sum * r + per[k];
    sum = sum * r + 1.0;
    return (eight)((eight_bits)sum + ((eight_bits)moved << 52));
}

/** natural logarithm of normal numbers above 0; error 3e-16 of 1 or of the value */
VECTOR_INLINE eight eight_log(eight x) {
    // x = 2^n m, m from sqrt(1/2) to sqrt 2; ln m = 2 artanh((m - 1)/(m + 1))
    const eight_bits raw = (eight_bits)x - 0x3fe6a09e667f3bcd;
    const eight_bits above = (raw >> 52) + 0x4338000000000000; // the integer as the lowest bits of 1.5 2^52
    const eight n = (eight)above - 0x1.8p52;
    const eight m = (eight)((raw & 0x000fffffffffffff) + 0x3fe6a09e667f3bcd);
    const eight s = (m - 1.0) / (m + 1.0), q = s * s;
    eight sum = 0.0 * q + 1.0 / 21.0;
    for (int k = 19; k >= 3; k -= 2)
        sum = sum * q + 1.0 / k;
    return n * 0x1.62e42fefa38p-1 + (n * 0x1.ef35793c7673p-45 + (2.0 * s + 2.0 * s * q * sum));
}

#endif
