/* motion/plan/plan_roll.h - pre-roll and post-roll: a move that begins or ends in
 * motion is brought up to speed before its start and to rest after its end.
 *
 * In T seconds the velocity follows the cubic from rest to (v, a), or back, which
 * has no step of acceleration at either end; the position is where that comes
 * from, or goes to:
 *
 *     run-up   p - T v / 2 + T^2 a / 12      run-out   p + T v / 2 + T^2 a / 12
 *
 * An axis at rest there stands.  With a = 0 the acceleration is at most 1.5 v / T
 * and the jerk 6 v / T^2. */
#ifndef MOTION_PLAN_PLAN_ROLL_H
#define MOTION_PLAN_PLAN_ROLL_H

#include "motion/core/track.h"

/* `before_ns_q12` in front of the track, in its place, which begins so much later,
 * and `after_ns_q12` behind it; 0: nothing there.  An empty track is left alone.
 * MOTION_E_FULL without memory, MOTION_E_RANGE beyond the formats; the track is
 * unchanged then. */
int plan_roll_track(struct motion_track *track, int64_t before_ns_q12,
                    int64_t after_ns_q12);

#endif
