/* motion/plan/path/plan_timing.h - the fastest that limits allow along a path, as
 * tracks.
 *
 * A path given by tracks over any parameter (their times do not count) gets its
 * least time under the limits of every axis by topp.h, or by topp_jerk.h where
 * one of them limits jerk, from rest to rest or between given speeds.  What comes out is no polynomial
 * of time, so it is baked (motion/curve/bake.h), with a border wherever
 * acceleration or jerk steps.
 *
 * The limits hold on the tracks, as check.h judges them: what the quintics are
 * over is measured on them by their own extremes, with all that rounding added, and the
 * law is baked again stretched by as much, since time stretched by e divides
 * velocity by e, acceleration by e^2, jerk by e^3.
 *
 * Positions are the path's start plus the integral of velocity (Gauss-Legendre,
 * 8 points) and not the path's polynomials, whose rounding, 1e-16 of the
 * coordinate, would be 60e-16 p / h^3 of jerk in a quintic h long.
 *
 * Off-line: double and heap. */
#ifndef MOTION_PLAN_PATH_PLAN_TIMING_H
#define MOTION_PLAN_PATH_PLAN_TIMING_H

#include "motion/number/real.h"
#include "motion/plan/move.h"
#include "motion/plan/topp/topp.h"
#include "motion/plan/topp/topp_jerk.h"

struct plan_timing {
    struct plan_pool pool; /* of all that follows */
    struct plan_topp_path path;
    bool has_jerk;
    struct plan_topp topp;    /* without limits of jerk */
    struct plan_topp_law law; /* with them */
    double least;             /* between two knots, s */
    double *knot;             /* times at which something steps, s */
    uint32_t knots;           /* at least 2 */
};

/* The path that the tracks are, one per axis and all with the same end, under
 * these limits, of which positions do not count.  `cap` bounds the parameter's
 * speed as in topp.h; ends[0] and ends[1] are that speed at the start and the
 * end, NULL: rest.  Errors of plan_topp_solve and plan_topp_jerk_solve, and
 * MOTION_E_EMPTY when nothing moves; *failed is then where on the path, or NaN,
 * and nothing is allocated. */
int plan_timing_solve(const struct motion_track *const track[], unsigned axes,
                      const struct plan_limit limit[],
                      const struct plan_topp_cap cap[], uint32_t caps,
                      const double ends[2], struct plan_timing *timing,
                      double *failed);
void plan_timing_free(struct plan_timing *timing);

/* In s, before anything is stretched. */
double plan_timing_duration(const struct plan_timing *timing);

/* Bake the axes into empty tracks, on the heap, that are inside the limits:
 * *stretch, 1 at first, is by how much time was stretched for that.  Each goes
 * from start_q32 to end_q32 and is within `bound` of the law so stretched.
 * Errors of motion_bake, and MOTION_E_LIMIT when no stretch was enough; the
 * tracks are empty then. */
int plan_timing_inside(struct plan_timing *timing, double *stretch,
                       const struct plan_limit limit[],
                       const int64_t start_q32[], const int64_t end_q32[],
                       struct motion_real tolerance,
                       struct motion_track track[], struct motion_real bound[]);

/* The distance along the path over time, all axes being coordinates of a space
 * in which it is so long, never back; it adds knots where the path is slowest.  Errors
 * of motion_bake. */
int plan_timing_distance(struct plan_timing *timing, double stretch,
                         struct motion_real length,
                         struct motion_real tolerance, struct motion_track *law,
                         struct motion_real *bound);

#endif
