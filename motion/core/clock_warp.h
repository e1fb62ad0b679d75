/* motion/core/clock_warp.h - the clock that reads a move: override, hold,
 * resume.
 *
 * Path time s runs at rate r = ds/dt.  Changing the speed changes r, never the
 * path: the positions visited are track(s), to the bit.
 *
 *   p'   = f' r
 *   p''  = f'' r^2 + f' r'
 *   p''' = f''' r^3 + 3 f'' r r' + f' r''            (chain rule)
 *
 * A change of rate is a ramp from the present (r0, r0') to (r1, 0), the one
 * that takes the least time within |r'| <= A and |r''| <= J: r'' is constant in
 * each of at most three pieces, r' goes from r0' to its peak, stays there and
 * goes to 0.  With e = r0 + r0' |r0'| / 2J, the rate at which r' can be 0 at
 * the earliest, the peak has the sign d of r1 - e and, where A does not cut it,
 *
 *   peak^2 = d J (r1 - r0) + r0'^2 / 2
 *
 * (Biagiotti & Melchiorri, Trajectory Planning (2008), 3.4, one order lower.)
 * So slowing down during a ramp upwards raises the rate by r0'^2 / 2J, which is
 * what bringing r' to 0 takes, and by nothing else.
 *
 * The pieces are whole ticks: their lengths are rounded up and the peak follows
 * from them again, so that the ramp ends in (r1, 0) and the borders of the
 * pieces are ticks; where |r0'| > A the peak may come out over A, below |r0'|.
 * Every piece is evaluated absolutely: nothing adds up from tick to tick.
 *
 * Whether a ramp keeps every axis inside its limits depends on the tracks it
 * runs over: clock_walk.h looks along the ramp and says so, and the caller takes
 * the shortest ramp that fits. */
#ifndef MOTION_CORE_CLOCK_WARP_H
#define MOTION_CORE_CLOCK_WARP_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/track.h"

#define MOTION_CLOCK_WARP_ONE_Q30 ((int64_t)1 << 30) /* 100 % */
#define MOTION_CLOCK_WARP_MAX_Q30 ((int64_t)2 << 30) /* 200 % */

#define MOTION_CLOCK_WARP_TICK_MIN_NS INT64_C(1000)          /* 1 us */
#define MOTION_CLOCK_WARP_TICK_MAX_NS INT64_C(1000000000)    /* 1 s */
#define MOTION_CLOCK_WARP_RAMP_MAX_NS INT64_C(3600000000000) /* 1 h */
#define MOTION_CLOCK_WARP_PIECES      3
/* of two ramps that follow each other */
#define MOTION_CLOCK_WARP_JOINED (2 * MOTION_CLOCK_WARP_PIECES)

/* Path time, rate and its derivatives at one clock time. */
struct motion_clock_rate {
    int64_t s_ns_q12;
    int64_t rate_q30;  /* 1 */
    int64_t accel_q30; /* 1/s */
    int64_t jerk_q30;  /* 1/s2 */
};

/* One piece of a ramp: r'' is constant. */
struct motion_clock_piece {
    int64_t dur_ns;
    int64_t s0_ns_q12; /* path time where it begins */
    /* s = s0 + dur (k[0] x + k[1] x^2 + k[2] x^3), x in 0..1 */
    int64_t k_q56[3];
    /* derived, so that the tick does not divide */
    uint64_t inverse;  /* 2^126 / (dur << normalise), rounded down */
    int64_t per_s_q30; /* 1 s / dur */
    int64_t jerk_q30;
    uint8_t normalise;
};

/* A ramp from t0 over dur (0: none), then constant at rate1. */
struct motion_clock_warp {
    int64_t t0_ns, dur_ns;
    int64_t s0_ns_q12, s1_ns_q12; /* path time at both ends of the ramp */
    int64_t rate1_q30;
    unsigned count; /* of pieces; their durations add up to dur */
    struct motion_clock_piece piece[MOTION_CLOCK_WARP_JOINED];
};

/* What a ramp may do, both > 0: |r'| <= A, |r''| <= J. */
struct motion_clock_bound {
    int64_t accel_q30; /* A, 1/s */
    int64_t jerk_q30;  /* J, 1/s2 */
};

/* Start at clock time t_ns and path time s0 with a constant rate. */
void motion_clock_warp_init(struct motion_clock_warp *warp, int64_t t_ns,
                            int64_t s0_ns_q12, int64_t rate_q30);

/* Lengths, in ticks, of the three pieces of the shortest ramp from the state
 * `now` to `rate_q30` (0 .. 200 %) within `bound`; 0 where one is left out.
 * MOTION_E_ARG for a rate, a bound or a tick (1 us .. 1 s) out of range,
 * MOTION_E_RANGE where the ramp takes over an hour or r0' is over 2 per tick.
 * Plan-time: divides. */
int motion_clock_warp_ticks(const struct motion_clock_rate *now,
                            int64_t rate_q30,
                            const struct motion_clock_bound *bound,
                            int64_t tick_ns,
                            int64_t ticks[MOTION_CLOCK_WARP_PIECES]);

/* That ramp, from the state of `from` at t_ns.  Errors as above; MOTION_E_RANGE
 * also where whole ticks leave no ramp within the bounds (and 2^-10) and where
 * r0' is so steep that the rate would leave 0 .. 200 % on the way (a larger J
 * may do).  *to may be *from.  Plan-time. */
int motion_clock_warp_ramp(const struct motion_clock_warp *from, int64_t t_ns,
                           int64_t rate_q30,
                           const struct motion_clock_bound *bound,
                           int64_t tick_ns, struct motion_clock_warp *to);

/* The ramp that brings r' to 0 in so many `ticks` with one r'', wherever that
 * takes the rate; before it r'' is jerk_q30 for `wait` ticks.  MOTION_E_ARG for
 * a tick, a wait (0 ..) or a count (1 ..) out of range, MOTION_E_RANGE where the
 * rate would leave 0 .. 200 % or it takes over an hour.  *to may be *from.
 * Plan-time. */
int motion_clock_warp_level(const struct motion_clock_warp *from, int64_t t_ns,
                            int64_t wait, int64_t jerk_q30, int64_t ticks,
                            int64_t tick_ns, struct motion_clock_warp *to);

/* Append `then`, a ramp that begins where `first` ends: at most
 * MOTION_CLOCK_WARP_PIECES pieces each. */
void motion_clock_warp_join(struct motion_clock_warp *first,
                            const struct motion_clock_warp *then);

/* Path time and rate at clock time t >= t0; absolute, so nothing adds up.  At
 * the border of two pieces r'' is the later one's.  On the tick. */
void motion_clock_warp_at(const struct motion_clock_warp *warp, int64_t t_ns,
                          struct motion_clock_rate *now);

/* p', p'', p''' of one axis under the warp, by the chain rule above, from the
 * track's own state at now->s; saturates.  pos is the track's. */
void motion_clock_warp_chain(const struct motion_clock_rate *now,
                             const struct motion_state *track,
                             struct motion_state *axis);

/* p' and p'' alone, for the tick; r2: the rate's square, the same for all
 * axes. */
int64_t motion_clock_warp_square(const struct motion_clock_rate *now);
void motion_clock_warp_sample(const struct motion_clock_rate *now,
                              int64_t r2_q30, const struct motion_sample *track,
                              struct motion_sample *axis);

#endif
