/* motion/curve/times.h - what every kind of curve counts with. */
#ifndef MOTION_CURVE_TIMES_H
#define MOTION_CURVE_TIMES_H

#include <stdint.h>

#include "motion/number/real.h"

/* a * n, rounded as motion_real_mul. */
static inline struct motion_real curve_times(struct motion_real a, int64_t n)
{
    return motion_real_mul(a, motion_real_int(n));
}

#endif
