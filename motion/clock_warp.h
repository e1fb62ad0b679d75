/* motion/clock_warp.h - the clock that reads a move: override, hold, resume.
 *
 * Path time s runs at rate r = ds/dt.  Changing the speed changes r, never the
 * path: the positions visited are track(s), to the bit.  A change of rate is a
 * ramp, the cubic r(t) that goes from the present (r, r') to (r1, 0) in a
 * given duration, so s(t) is a quartic: r and r' are continuous and r'' is
 * bounded.
 *
 *   p'   = f' r
 *   p''  = f'' r^2 + f' r'
 *   p''' = f''' r^3 + 3 f'' r r' + f' r''            (chain rule)
 *
 * Whether a ramp keeps every axis inside its limits depends on the tracks it
 * runs over: motion_clock_warp_fits looks ahead along the ramp and says so, and
 * the caller takes the shortest ramp that fits. */
#ifndef MOTION_CLOCK_WARP_H
#define MOTION_CLOCK_WARP_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/track.h"

#define MOTION_CLOCK_WARP_ONE_Q30 ((int64_t)1 << 30) /* 100 % */
#define MOTION_CLOCK_WARP_MAX_Q30 ((int64_t)2 << 30) /* 200 % */

/* Rate and its derivatives at one time. */
struct motion_clock_rate {
    int64_t s_ns_q12;  /* path time */
    int64_t rate_q30;  /* 1 */
    int64_t accel_q30; /* 1/s */
    int64_t jerk_q30;  /* 1/s2 */
};

/* Ramp from t0 over `dur` (0: none), then constant. */
struct motion_clock_warp {
    int64_t t0_ns;     /* clock time where the ramp starts */
    int64_t dur_ns;    /* ramp duration */
    int64_t s0_ns_q12; /* path time there */
    int64_t rate0_q30, accel0_q30;
    int64_t rate1_q30; /* rate after the ramp */
    /* derived when the ramp is set */
    int64_t s1_ns_q12;      /* path time at the end of the ramp */
    int64_t c2_q30, c3_q30; /* r = rate0 + c1 x + c2 x^2 + c3 x^3, x in 0..1 */
    int64_t c1_q30;
    uint64_t inverse_q64; /* 2^64 / dur, rounded down */
};

/* Start at path time s0 with a constant rate. */
void motion_clock_warp_init(struct motion_clock_warp *warp, int64_t t_ns,
                            int64_t s0_ns_q12, int64_t rate_q30);

/* A ramp from the state at `t_ns` to `rate_q30` in `dur_ns` (1 ns .. 1 h;
 * 0 when the rate does not change).  MOTION_E_ARG outside, or for a rate
 * outside 0 .. 200 %.  Plan-time (divides). */
int motion_clock_warp_ramp(const struct motion_clock_warp *from, int64_t t_ns,
                           int64_t rate_q30, int64_t dur_ns,
                           struct motion_clock_warp *to);

/* Path time and rate at clock time t >= t0, absolute, on the tick. */
void motion_clock_warp_at(const struct motion_clock_warp *warp, int64_t t_ns,
                          struct motion_clock_rate *now);

/* Limits that a warped axis must keep. */
struct motion_clock_limit {
    int64_t vel_q32;
    int64_t acc_q16;
    int64_t jerk_q16; /* 0: not limited */
};

/* p', p'', p''' of one axis under the warp: the chain rule above; saturates.
 * `track_state` at now->s. */
void motion_clock_warp_chain(const struct motion_clock_rate *now,
                             const struct motion_state *track_state,
                             struct motion_state *axis);

/* First clock time in [t0, t0 + dur] at which the warp takes `track` out of its
 * limits, looked at every `step_ns` and on both sides of every segment border;
 * INT64_MAX when it fits.  Plan-time; dur / step evaluations. */
int64_t motion_clock_warp_fits(const struct motion_clock_warp *warp,
                               const struct motion_track *track,
                               const struct motion_clock_limit *limit,
                               int64_t step_ns);

#endif
