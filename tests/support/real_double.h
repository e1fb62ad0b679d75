/* tests/support/real_double.h - motion_real and Q62 to and from long double,
 * for oracles. */
#ifndef TESTS_SUPPORT_REAL_DOUBLE_H
#define TESTS_SUPPORT_REAL_DOUBLE_H

#include <math.h>

#include "motion/number/real.h"

static inline struct motion_real real_of(long double a)
{
    int e;
    const long double m = frexpl(a, &e);
    return motion_real_make((int64_t)ldexpl(m, 62), e - 62);
}

static inline long double real_value(struct motion_real a)
{
    return ldexpl((long double)a.m, a.e);
}

static inline long double q62(int64_t a)
{
    return ldexpl((long double)a, -62);
}

#endif
