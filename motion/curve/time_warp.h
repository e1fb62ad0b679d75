/* motion/curve/time_warp.h - a move played through a warped time, p = f(w(t)).
 *
 * w is a track like any other; its position is time of f in milliseconds
 * (Q32.32: 2^-32 ms are 0.23 ps, and 24 days).  It may stand still and go
 * backwards.  Not to be mixed up with motion/core/clock_warp.h, which bends
 * time while the tick runs; this one is planned.
 *
 *     v = f' w'      a = f'' w'^2 + f' w''      j = f''' w'^3 + 3 f'' w' w'' +
 *                                                   f' w'''
 *
 * with primes of w in seconds per second.  p is a polynomial of degree up to 25
 * between the borders of w and the times where w passes a border of f, and is
 * baked (bake.h), so that limits are checked on the result as on any track. */
#ifndef MOTION_CURVE_TIME_WARP_H
#define MOTION_CURVE_TIME_WARP_H

#include <stdint.h>

#include "motion/core/track.h"
#include "motion/number/real.h"

/* Milliseconds, Q32.32, of a time in 2^-12 ns; to nearest.  |t| < 2^62. */
int64_t motion_time_warp_ms(int64_t t_ns_q12);

/* Append f(w(t)) to `out`, which must end where it starts, to 2^-32.  Baked
 * until it misses position, velocity and acceleration by at most 1e-10, 1e-8
 * and 1e-7 of their largest values; *bound, when not NULL, is how far at most
 * the position misses, in units.
 * MOTION_E_EMPTY when one of them is empty, MOTION_E_RANGE when w leaves f or
 * the result leaves the formats (a velocity too high), MOTION_E_FULL when `out`
 * is; out is unchanged then.  Plan-time. */
int motion_time_warp_append(struct motion_track *out,
                            const struct motion_track *f,
                            const struct motion_track *w,
                            struct motion_real *bound);

/* f(w(t)) and its derivatives by the chain rule: what the result must be.
 * Where w is outside f: at rest there.  Saturates. */
void motion_time_warp_state(const struct motion_track *f,
                            const struct motion_track *w, int64_t t_ns_q12,
                            struct motion_state *state);

#endif
