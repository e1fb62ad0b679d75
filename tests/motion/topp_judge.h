/* tests/motion/topp_judge.h - a timed path against its limits. */
#ifndef TESTS_MOTION_TOPP_JUDGE_H
#define TESTS_MOTION_TOPP_JUDGE_H

#include "motion/plan/topp.h"

/* By how much of itself a limit of any axis is exceeded at most at so many even
 * times; 0 where none is.  By the chain rule on the path's own powers. */
double topp_judge_excess(const struct plan_topp_request *request,
                         const struct plan_topp *topp, unsigned points);

#endif
