/* tests/motion/plan/topp/topp_judge.h - a timed path against its limits. */
#ifndef TESTS_MOTION_PLAN_TOPP_TOPP_JUDGE_H
#define TESTS_MOTION_PLAN_TOPP_TOPP_JUDGE_H

#include "motion/plan/topp/topp.h"
#include "motion/plan/topp/topp_jerk.h"

/* By how much of itself a limit of any axis is exceeded at most at so many even
 * times; 0 where none is.  By the chain rule on the path's own powers. */
double topp_judge_excess(const struct plan_topp_request *request,
                         const struct plan_topp *topp, unsigned points);

/* The worst excess of velocity, acceleration or jerk over a limit at so many
 * even times, 0 if none.  Infinite when the law does not begin and end where
 * the path does and as fast as the request says, or when its values do not
 * change from one time to the next as their derivatives say. */
double topp_judge_law(const struct plan_topp_request *request,
                      const double jerk[], const struct plan_topp_law *law,
                      unsigned points);

#endif
