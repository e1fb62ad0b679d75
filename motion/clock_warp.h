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

#define MOTION_CLOCK_WARP_RAMP_MIN_NS INT64_C(1000)          /* 1 us */
#define MOTION_CLOCK_WARP_RAMP_MAX_NS INT64_C(3600000000000) /* 1 h */

/* Path time, rate and its derivatives at one clock time. */
struct motion_clock_rate {
    int64_t s_ns_q12;
    int64_t rate_q30;  /* 1 */
    int64_t accel_q30; /* 1/s */
    int64_t jerk_q30;  /* 1/s2 */
};

/* A ramp from t0 over dur (0: none), then constant at rate1. */
struct motion_clock_warp {
    int64_t t0_ns, dur_ns;
    int64_t s0_ns_q12, s1_ns_q12; /* path time at both ends of the ramp */
    int64_t rate1_q30;
    /* s = s0 + dur (k[0] x + k[1] x^2 + k[2] x^3 + k[3] x^4), x in 0..1 */
    int64_t k_q56[4];
    /* derived, so that the tick does not divide */
    uint64_t inverse;  /* 2^126 / (dur << normalise), rounded down */
    int64_t per_s_q30; /* 1 s / dur */
    uint8_t normalise;
};

/* Start at clock time t_ns and path time s0 with a constant rate. */
void motion_clock_warp_init(struct motion_clock_warp *warp, int64_t t_ns,
                            int64_t s0_ns_q12, int64_t rate_q30);

/* A ramp from the state of `from` at t_ns to `rate_q30` (0 .. 200 %) in
 * `dur_ns` (1 us .. 1 h).  MOTION_E_ARG outside; MOTION_E_RANGE when the
 * present slope is so steep that the cubic would leave the format.  *to may be
 * *from.  Plan-time: divides. */
int motion_clock_warp_ramp(const struct motion_clock_warp *from, int64_t t_ns,
                           int64_t rate_q30, int64_t dur_ns,
                           struct motion_clock_warp *to);

/* Path time and rate at clock time t >= t0; absolute, so nothing adds up.  On
 * the tick. */
void motion_clock_warp_at(const struct motion_clock_warp *warp, int64_t t_ns,
                          struct motion_clock_rate *now);

/* Limits that a warped axis must keep; jerk 0: not limited. */
struct motion_clock_limit {
    int64_t vel_q32;
    int64_t acc_q16;
    int64_t jerk_q16;
};

/* p', p'', p''' of one axis under the warp, by the chain rule above, from the
 * track's own state at now->s; saturates.  pos is the track's. */
void motion_clock_warp_chain(const struct motion_clock_rate *now,
                             const struct motion_state *track,
                             struct motion_state *axis);

/* Does the ramp keep the axis on `track` inside `limit` and the rate inside
 * 0 .. 200 %, from from_ns to to_ns after its start, 0 <= from < to <= dur?
 * Looks at both ends, every `step_ns` between, and at both sides of every
 * segment border on the way: (to - from) / step + 2 evaluations and two per
 * border.  A ramp that leaves the window of a track does not fit.  Long ramps can so be judged a stretch at a time.  No division. */
bool motion_clock_warp_fits(const struct motion_clock_warp *warp,
                            const struct motion_track *track,
                            const struct motion_clock_limit *limit,
                            int64_t from_ns, int64_t to_ns, int64_t step_ns);

#endif
