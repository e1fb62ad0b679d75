/* motion/plan/topp/topp.h - time-optimal path parameterisation: a path as fast as
 * velocity and acceleration limits of every axis allow.
 *
 * The path q(s) is given; what is looked for is s(t).  With x = s'^2 and
 * u = s'' = (dx/ds) / 2 the limits are linear in u and x at every s:
 *
 *     q'^2 x <= v^2        a_min <= q' u + q'' x <= a_max
 *
 * On each interval of a grid that holds all borders of the path's pieces, x is
 * a parabola in s, so that u is linear there.  Both sides of every limit are
 * then polynomials of s, and they hold everywhere on the interval, not only at
 * its ends, because their Bernstein coefficients do: linear inequalities in the
 * three Bernstein coefficients of x.  A sweep from the end finds the largest x
 * at every grid point from which the end can be reached, a sweep from the
 * start the largest x below that.  Each step is a linear program in three and
 * two variables.  The duration is above the optimum by a share that falls
 * with the square of the interval.
 *
 * Source: Verscheure et al., Time-optimal path tracking for robots: a convex
 * optimization approach, IEEE TAC 54 (2009), for x and u; Pham & Pham, A new
 * approach to time-optimal path parameterization based on reachability
 * analysis, IEEE T-RO 34 (2018), for the two sweeps; Farouki, The Bernstein
 * polynomial basis, CAGD 29 (2012), for the products and the bound.
 *
 * Off-line: double and heap. */
#ifndef MOTION_PLAN_TOPP_TOPP_H
#define MOTION_PLAN_TOPP_TOPP_H

#include <stdint.h>

#include "motion/core/track.h"
#include "motion/plan/plan_pool.h"

MOTION_C_BEGIN

#define PLAN_TOPP_AXES_MAX      32
#define PLAN_TOPP_DEGREE_MAX    5
#define PLAN_TOPP_INTERVALS_MAX 10000000

/* Piece i runs over s = border[i] .. border[i + 1]; axis k is there
 *     sum coef[(i * axes + k) * (degree + 1) + n] (s - border[i])^n
 * in units of the axis.  q is continuous; where q' steps, which is a corner, the
 * path is run to a stop; q'' may step.  Where q' is zero, at a cusp or at ends
 * at rest in s, all axes stand whatever s' is. */
struct plan_topp_path {
    unsigned axes;   /* 1 .. PLAN_TOPP_AXES_MAX */
    unsigned degree; /* 1 .. PLAN_TOPP_DEGREE_MAX */
    uint32_t pieces; /* at least 1 */
    double *border;  /* pieces + 1, increasing */
    double *coef;
};

/* The path that tracks, one per axis, run along: any curve of motion/, with its
 * time in s as s; an axis whose track has ended stands.  It is in the pool.
 * MOTION_E_ARG for the count of axes, MOTION_E_EMPTY when all tracks are empty,
 * MOTION_E_FULL without memory. */
int plan_topp_path_of(const struct motion_track *const track[], unsigned axes,
                      struct plan_pool *pool, struct plan_topp_path *path);

/* Of an axis, unit/s and unit/s2: min < 0 < max. */
struct plan_topp_limit {
    double vel_min, vel_max, acc_min, acc_max;
};

/* s' is at most `speed` from `from` to `to`; 0 with from = to is a stop. */
struct plan_topp_cap {
    double from, to, speed;
};

struct plan_topp_request {
    struct plan_topp_path path;
    const struct plan_topp_limit *limit; /* of each axis */
    const struct plan_topp_cap *cap;
    uint32_t cap_count;
    double start_speed, end_speed; /* s' >= 0 at both ends, unless q' is 0 */
    uint32_t intervals;            /* at least; 0: enough for 1e-4 as a rule */
};

/* x over interval i, between s[i] and s[i + 1], is the parabola with the
 * Bernstein coefficients x[i]; t[i] is when s[i] is reached, in s.  Where all
 * axes stand, x may step and a piece may take no time. */
struct plan_topp {
    uint32_t intervals;
    double *s, *t; /* intervals + 1 */
    double (*x)[3];
};

/* s and its derivatives by t at one time; jerk is that inside an interval, as
 * acc may step from one to the next. */
struct plan_topp_state {
    double s, vel, acc, jerk;
};

/* The law, in the pool.  MOTION_E_ARG for a count, a border, a limit or a speed out of range,
 * MOTION_E_FULL without memory, MOTION_E_LIMIT when the speed at the start
 * or the end is more than the path allows; *failed is then the s where no speed
 * is left, NaN otherwise.  On an error `topp` is empty. */
int plan_topp_solve(const struct plan_topp_request *request,
                    struct plan_pool *pool, struct plan_topp *topp,
                    double *failed);

/* In s, from start to end. */
double plan_topp_duration(const struct plan_topp *topp);
/* Before 0 as at 0, after the end as at the end. */
void plan_topp_at(const struct plan_topp *topp, double t_s,
                  struct plan_topp_state *state);

MOTION_C_END

#endif
