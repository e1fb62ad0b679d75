/* tests/otg_oracle.h - a second opinion on plans; shares no code with them.
 *
 * Evaluates a plan by its definition (motion/otg.h) in 113-bit floating point:
 * 128-bit integers of the plan fit exactly into sums that round at 2^-113 of
 * the move, far below the 2^-80 at which anything is compared. */
#ifndef TESTS_OTG_ORACLE_H
#define TESTS_OTG_ORACLE_H

#include "motion/otg.h"

/* NULL, or what is wrong with the plan: ends, limits, continuity. */
const char *otg_oracle_judge(const struct motion_otg_move *move,
                             const struct motion_otg_plan *plan);

/* The same of a track made from it: ends at the goal to the bit, position
 * continuous, velocity and acceleration within what their formats resolve,
 * inside the limits. */
const char *otg_oracle_judge_track(const struct motion_otg_move *move,
                                   const struct motion_otg_plan *plan);

#endif
