/* motion/plan/topp/topp_curve.h - one stretch of a path without stops inside, with
 * limits of jerk: topp_barrier.h on finer and finer grids.
 *
 * It begins with the uniform law w' = constant, which is inside all limits when
 * it is slow enough.  Grids become finer where the time goes.  At last all
 * limits are bounded between the points where they were held (topp_bound.h), and
 * what is over is stretched away: t by e divides velocity by e, acceleration by
 * e^2, jerk by e^3.
 *
 * It begins and ends at rest, or at the chain's speeds with constant s', to which
 * the law is led (topp_barrier_lead).  As time cannot be stretched there, what is over
 * is taken from all limits. */
#ifndef MOTION_PLAN_TOPP_TOPP_CURVE_H
#define MOTION_PLAN_TOPP_TOPP_CURVE_H

#include "motion/plan/topp/topp_chain.h"

/* z = w'^2 as x of `out`, w as its s, in the pool.  MOTION_E_FULL without memory,
 * MOTION_E_LIMIT when no law from or to a speed was found, MOTION_E_WORK when the path has too many pieces. */
int topp_curve_solve(const struct topp_chain *chain,
                     const struct plan_topp_request *request,
                     const double jerk[], struct plan_pool *pool,
                     struct plan_topp *out);

#endif
