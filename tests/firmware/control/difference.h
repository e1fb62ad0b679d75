/* tests/firmware/control/difference.h - what drives were told, by differences.
 *
 * With p0, p1, p2, p3 set points of ticks that follow each other, newest first, and
 * T the period
 *
 *     |p0 - p1| <= v T     |p0 - 2 p1 + p2| <= a T^2
 *     |p0 - 3 p1 + 3 p2 - p3| <= j T^3
 *
 * for every motion inside the limits, as a difference is a mean of the derivative.
 * Rounding adds, with weights of 2, 4 and 8, what it moves a set point by: 3 units of
 * 2^-32 of a track, of one that travels far 5 of its steps q; at a rate that is not 1
 * half of 2^-12 ns at the speed; of a follower also what it moves its master by, times
 * the slope.  To the second and third comes a step of the rate by 2^-30 and to these and
 * the limits themselves 2^-28, which a plan may be over. */
#ifndef TESTS_FIRMWARE_CONTROL_DIFFERENCE_H
#define TESTS_FIRMWARE_CONTROL_DIFFERENCE_H

#include <math.h>
#include <string.h>

#include "firmware/control/controller.h"
#include "tests/support/check.h"

struct difference {
    int64_t pos_q32[4]; /* newest first */
    unsigned count;
    long double error;   /* of a set point, unit */
    long double most[3]; /* shares of the limits, the largest there were */
};

static inline long double difference_units(int64_t q32)
{
    return (long double)q32 * 0x1p-32L;
}

/* What rounding moves a set point of these tracks by. */
static inline long double difference_error(const struct motion_track *track,
                                           long double vel)
{
    int frac = 1;
    for (uint32_t i = 0; track != NULL && i < track->count; i++)
        frac = track->segment[i].frac < frac ? track->segment[i].frac : frac;
    return (frac > 0 ? 3 : 5 * ldexpl(1, -frac)) * 0x1p-32L +
           vel * 0x1p-13L * 1e-9L;
}

static inline void difference_push(struct difference *past, int64_t pos_q32)
{
    memmove(past->pos_q32 + 1, past->pos_q32, 3 * sizeof pos_q32);
    past->pos_q32[0] = pos_q32;
    past->count += past->count < 4;
}

/* The k-th, 1 .. 3, over T^k; exact. */
static inline long double difference_of(const struct difference *past, int k,
                                        long double period_s)
{
    const int64_t *p = past->pos_q32;
    const int64_t d[3] = { p[0] - p[1], p[1] - p[2], p[2] - p[3] };
    const int64_t of[] = { d[0], d[0] - d[1], d[0] - 2 * d[1] + d[2] };
    return difference_units(of[k - 1]) / powl(period_s, k);
}

/* NULL, or which limit the last set point is over; shares are kept.  `slack`: of the
 * limits of acceleration and jerk, besides 2^-28. */
static inline const char *
difference_judge(struct difference *past,
                 const struct motion_clock_limit *limit, int64_t period_ns)
{
    static const char *const name[] = { "speed", "acceleration", "jerk" };
    const long double period_s = (long double)period_ns * 1e-9L;
    const long double most[3] = { difference_units(limit->vel_q32),
                                  difference_units(limit->acc_q32),
                                  difference_units(limit->jerk_q32) };
    const char *over = NULL;
    for (unsigned k = 1; k <= 3; k++) {
        if (past->count <= k || most[k - 1] <= 0)
            continue;
        long double error = (long double)(1 << k) * past->error;
        if (k > 1)
            error += most[0] * period_s * 0x1p-30L;
        const long double value = fabsl(difference_of(past, (int)k, period_s));
        const long double over_by =
            value - error / powl(period_s, k) - most[k - 1] * 0x1p-28L;
        past->most[k - 1] = fmaxl(past->most[k - 1], over_by / most[k - 1]);
        if (over_by > most[k - 1])
            over = name[k - 1];
    }
    return over;
}

#endif
