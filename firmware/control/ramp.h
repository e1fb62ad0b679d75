/* firmware/control/ramp.h - what the files of the search for a change of rate share:
 * ramp_step.c (the search), ramp_span.c and ramp_limit.c (does a piece of it keep the
 * limits?), ramp_bound.c (how steep may it be?) and ramp_rest.c (by when is it at
 * rest?). */
#ifndef FIRMWARE_CONTROL_RAMP_H
#define FIRMWARE_CONTROL_RAMP_H

#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define RAMP_SECOND_NS INT64_C(1000000000)
#define RAMP_ONE_Q56   ((int64_t)1 << 56)
#define RAMP_Q30_Q56   ((int64_t)1 << 26)
/* Ticks of a piece: in more the rate would leave its range, or hardly change. */
#define RAMP_TICKS_MAX (1 << 20)
/* Ticks from when a candidate is made to its begin, at the most. */
#define RAMP_LEAD_MAX 8
#define RAMP_MAX_NS   INT64_C(3600000000000) /* of a change of rate */
/* A stop uses so many times the limits at the most: what spans hold. */
#define RAMP_STOP_TIMES 8

static inline int64_t ramp_size(int64_t value)
{
    const uint64_t size = motion_fixed_abs(value);
    return size > INT64_MAX ? INT64_MAX : (int64_t)size;
}

/* Bits of a value >= 0 above so many. */
static inline int ramp_above(int64_t value, int bits)
{
    const int size = 64 - (int)motion_fixed_clz_u64((uint64_t)value);
    return size > bits ? size - bits : 0;
}

/* The next whole number above a / b, a >= 0 and b > 0; RAMP_TICKS_MAX at most. */
static inline int32_t ramp_ratio(int64_t a, int64_t b)
{
    const int shift = ramp_above(a > b ? a : b, 31);
    const uint32_t ratio =
        (uint32_t)(a >> shift) /
            (((uint32_t)(b >> shift) + (shift > 0)) | (b == 0)) +
        1;
    return ratio < RAMP_TICKS_MAX ? (int32_t)ratio : RAMP_TICKS_MAX;
}

static inline uint32_t ramp_root(uint32_t square)
{
    uint32_t root = 1u << (16 - motion_fixed_clz_u64(square | 1) / 2 + 16);
    for (int i = 0; i < 20; i++) {
        const uint32_t next = (root + square / root) / 2;
        if (next >= root)
            break;
        root = next;
    }
    return root;
}

/* Of the clock, which in reverse reads the path backwards. */
static inline int64_t ramp_rate_q30(const struct controller *controller)
{
    const int64_t rate_q30 = controller->rate.rate_q30;
    return rate_q30 < 0 ? -rate_q30 : rate_q30;
}

/* When what is in force has come to its rate. */
static inline int64_t ramp_end_ns(const struct controller *controller)
{
    return controller->warp.t0_ns + controller->warp.dur_ns;
}

/* What a ramp may do beside a track at its peak: |r'| <= A, |r''| <= J. */
struct ramp_bound {
    int64_t accel_q30; /* A, 1/s */
    int64_t jerk_q30;  /* J, 1/s2 */
};

/* ramp_bound.c: the limits of an axis that a ramp uses. */
struct motion_clock_limit
controller_ramp_limit(const struct controller *controller, unsigned axis,
                      bool stop);

/* ramp_bound.c: the A and J that alone would use the whole of the limits at the peaks
 * of the tracks, up to rate_q30. */
struct ramp_bound controller_ramp_bound(const struct controller *controller,
                                        int64_t rate_q30, bool stop);

#endif
