/* motion/plan/plan_warp.h - a move played through a warped time, f(w(t)), so
 * that limits are checked on what is played (motion/curve/time_warp.h).
 *
 * After its end a move stands still, and so it does where w is there. */
#ifndef MOTION_PLAN_PLAN_WARP_H
#define MOTION_PLAN_PLAN_WARP_H

#include "motion/number/real.h"
#include "motion/plan/move.h"

/* w as a track: milliseconds of the move over time.  Positions of the keys of
 * `axis` are times in 2^-12 ns, velocities s/s.  MOTION_E_ORDER when it goes
 * back, or what plan_axis_track returns; *error then, and an empty track. */
int plan_warp_track(const struct plan_axis *axis, struct motion_track *warp,
                    struct plan_error *error);

/* Put f(w(t)) in the track's place.  A warp that changes nothing, w(t) = t to
 * the end of the track or longer, leaves it as it is, to the bit.  *bound rises
 * to how far at most the position is from f(w(t)).  On an error *error and the
 * track as it was, or longer. */
int plan_warp_apply(const struct motion_track *warp,
                    const struct plan_axis *axis, struct motion_track *track,
                    struct motion_real *bound, struct plan_error *error);

/* The time of the move, 2^-12 ns, at a time as played. */
int64_t plan_warp_time(const struct motion_track *warp, int64_t t_ns_q12);

#endif
