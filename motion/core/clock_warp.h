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
 * A change of rate is a ramp of at most two pieces of whole ticks, in each of which
 * r'' is constant: r' goes to a peak and from there to 0.  Every piece is evaluated
 * absolutely: nothing adds up from tick to tick.
 *
 * Whether a ramp keeps every axis inside its limits depends on the tracks that it
 * runs over: track_enclose.h says where their derivatives are. */
#ifndef MOTION_CORE_CLOCK_WARP_H
#define MOTION_CORE_CLOCK_WARP_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/track.h"

MOTION_C_BEGIN

#define MOTION_CLOCK_WARP_ONE_Q30 ((int64_t)1 << 30) /* 100 % */
#define MOTION_CLOCK_WARP_MAX_Q30 ((int64_t)2 << 30) /* 200 % */

#define MOTION_CLOCK_WARP_PIECES 2

/* Limits that a warped axis must keep; jerk 0: not limited. */
struct motion_clock_limit {
    int64_t vel_q32;
    int64_t acc_q32;
    int64_t jerk_q32;
};

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
    struct motion_clock_piece piece[MOTION_CLOCK_WARP_PIECES];
};

/* Start at clock time t_ns and path time s0 with a constant rate. */
void motion_clock_warp_init(struct motion_clock_warp *warp, int64_t t_ns,
                            int64_t s0_ns_q12, int64_t rate_q30);

/* Of a tick of 1 us to 1 s, so that laying out a ramp on the tick divides no long
 * numbers. */
struct motion_clock_unit {
    int64_t tick_ns;
    uint64_t inverse; /* 2^126 / (tick << normalise), rounded down */
    int64_t per_s_q30;
    uint8_t normalise;
};
void motion_clock_unit_init(struct motion_clock_unit *unit, int64_t tick_ns);

/* Where a ramp begins; rate and r' per tick, Q56. */
struct motion_clock_begin {
    int64_t t_ns, s_ns_q12, rate_q56, accel_q56;
};

/* The ramp that takes r' to a peak (per tick, Q56) in `wait` ticks (0: it is
 * there) and to 0 in `ticks`, both below 2^20.  MOTION_E_RANGE where the rate would
 * leave 0 .. 200 %; *to then stays.  On the tick. */
int motion_clock_warp_by(const struct motion_clock_begin *begin,
                         const struct motion_clock_unit *unit, int32_t wait,
                         int64_t peak_q56, int32_t ticks,
                         struct motion_clock_warp *to);

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

MOTION_C_END

#endif
