/* tests/motion/otg/otg_oracle.h - a second opinion on plans; shares no code
 * with them.
 *
 * A plan is judged by its definition (motion/otg/otg.h) in whole numbers of any
 * size: nothing is rounded, nothing is sampled, nothing is "about".  In each
 * phase velocity, acceleration and jerk, the quintic included, are polynomials
 * with whole coefficients, and so are their distances from the limits; whether
 * those are negative anywhere is decided exactly (big.h).
 *
 * What start and goal themselves make unavoidable is allowed, and only there:
 *
 *   a start outside its limits   acceleration: until the braking phases end;
 *   velocity: until then, and until the acceleration is at zero
 *   a start that must touch      v0 + a0^2 / 2 jerk at or above the limit: as
 *   high as when that ramp takes a whole number of ticks, until it is there
 *   a goal that must have touched     the same backwards in time */
#ifndef TESTS_MOTION_OTG_OTG_ORACLE_H
#define TESTS_MOTION_OTG_OTG_ORACLE_H

#include "motion/otg/otg.h"

/* NULL, or what is wrong with the plan: ends to the last bit, limits. */
const char *otg_oracle_judge(const struct motion_otg_move *move,
                             const struct motion_otg_plan *plan);

/* The same of a track made from it: starts and ends as the move does to the
 * bit, no gap, every segment where the plan is, inside the limits. */
const char *otg_oracle_judge_track(const struct motion_otg_move *move,
                                   const struct motion_otg_plan *plan);

#endif
