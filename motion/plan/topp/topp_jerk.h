/* motion/plan/topp/topp_jerk.h - a path as fast as limits of velocity, acceleration
 * and jerk of every axis allow.
 *
 * As plan_topp_solve, and |jerk| of each axis is limited, so that no
 * acceleration steps.  The path is divided where it must stop: at a corner,
 * where q'' steps and at caps of speed 0.  There velocity and acceleration of
 * all axes are 0, as at a start or an end with speed 0.  A stretch that is a
 * straight line in space and has no cap is run in its least time (topp_line.h),
 * with no acceleration at its ends; any other with what topp_curve.h finds, a
 * local minimum on a fine grid, with constant s' at an end at a speed.  Sections
 * in which all axes stand take no time.
 *
 * Source: Bobrow, Dubowsky & Gibson, Time-optimal control of robotic
 * manipulators along specified paths, IJRR 4 (1985); see topp_barrier.h and
 * topp_line.h.  Off-line: double and heap. */
#ifndef MOTION_PLAN_TOPP_TOPP_JERK_H
#define MOTION_PLAN_TOPP_TOPP_JERK_H

#include "motion/plan/topp/topp.h"

/* One stretch between two stops. */
struct plan_topp_run;

struct plan_topp_law {
    struct plan_topp_path path; /* with borders at caps */
    uint32_t runs;
    struct plan_topp_run *run;
    double duration; /* s */
};

/* Of an axis, in its unit and s. */
struct plan_topp_axis_state {
    double pos, vel, acc, jerk;
};

/* The law, in the pool.  The request as in topp.h; jerk in unit/s3 of each axis, above 0.
 * MOTION_E_ARG for what is out of range, MOTION_E_FULL without memory,
 * MOTION_E_WORK for more pieces times axes than can be worked on,
 * MOTION_E_LIMIT when no law is inside the limits from the speed at the start or
 * to that at the end; *failed is then where the stretch begins, NaN otherwise.  On
 * an error `law` is empty. */
int plan_topp_jerk_solve(const struct plan_topp_request *request,
                         const double jerk[], struct plan_pool *pool,
                         struct plan_topp_law *law, double *failed);

/* Times at which jerk may step on one run, in order, its start and its end among
 * them; `knot` may be NULL.  Returns how many. */
uint32_t plan_topp_law_knots(const struct plan_topp_law *law, uint32_t run,
                             double knot[]);

/* Of each axis; before 0 as at 0, after the end as at the end.  Where jerk
 * steps, that of what begins. */
void plan_topp_law_at(const struct plan_topp_law *law, double t_s,
                      struct plan_topp_axis_state axis[]);

#endif
