/** @file check.h
 * What tests of whole parts ask all the time; after cmocka.h. A failure is told with what was called, or both numbers. With SILT_TELL
 * in the environment every comparison is told, as docs/results.sh reads them: "told", value, expected, tolerance, what.
 */
#ifndef SILT_CHECK_H
#define SILT_CHECK_H

#include "base.h"

#include <stdio.h>
#include <stdlib.h>

static silt_error error;

#define OK(call)                                                                                                       \
    do {                                                                                                               \
        error = (silt_error){0};                                                                                       \
        if ((call) != SILT_OK)                                                                                         \
            fail_msg("%s: %s", #call, error.text);                                                                     \
    } while (0)

static inline void near(double value, double expected, double tolerance, const char *what) {
    if (getenv("SILT_TELL"))
        printf("told\t%.9g\t%.9g\t%g\t%s\n", value, expected, tolerance, what);
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%s: %.17g, expected %.17g within %g", what, value, expected, tolerance);
}

/** nothing was put there */
static inline bool zero(const void *data, size_t size) {
    for (size_t k = 0; k < size; k++)
        if (((const char *)data)[k])
            return false;
    return true;
}

#endif
