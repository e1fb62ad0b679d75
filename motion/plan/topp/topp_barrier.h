/* motion/plan/topp/topp_barrier.h - the least time over a stretch of a path with
 * limits of velocity, acceleration and jerk, by an interior point method.
 *
 * With z = w'^2 over the parameter w of topp_chain.h the time is the integral of
 * z^(-1/2) and the limits of an axis r(w) are
 *
 *     r'^2 z <= v^2        a_min <= r' z' / 2 + r'' z <= a_max
 *     |r' z'' / 2 + 3/2 r'' z' + r''' z| <= j z^(-1/2)
 *
 * All but the last are convex.  z is a quadratic B-spline on a grid, so that
 * z'' is constant in each interval; the limits are held at both ends and in the
 * middle of each.  The logarithmic barrier of all limits is added to the time
 * with a weight that falls, and Newton's method follows its minimum; the
 * matrix has five diagonals.  As j z^(-1/2) is above its tangents, leaving out
 * its curvature where the matrix would not be positive keeps every step inside
 * the limits, as in the convex-concave procedure.
 *
 * The minimum is a local one.  Work is bounded: so many steps for each weight.
 *
 * Source: Verscheure et al. (see topp.h), for z; Debrouwere et al., Time-optimal
 * path following for robots with convex-concave constraints using sequential
 * convex programming, IEEE T-RO 29 (2013), for the jerk; Boyd & Vandenberghe,
 * Convex Optimization (2004), 11.3, for the barrier.
 *
 * Off-line: double and heap. */
#ifndef MOTION_PLAN_TOPP_TOPP_BARRIER_H
#define MOTION_PLAN_TOPP_TOPP_BARRIER_H

#include "motion/plan/topp/topp_chain.h"

/* In a unit of time that makes z = 1 possible everywhere. */
struct topp_barrier_limit {
    double vel_min, vel_max, acc_min, acc_max, jerk;
};

struct topp_barrier {
    const struct topp_chain *chain;
    const struct topp_barrier_limit *limit; /* of each axis */
    struct plan_pool *pool; /* of all arrays; there before topp_barrier_init */
    unsigned axes;
    uint32_t intervals;
    double *w;         /* grid: intervals + 1 */
    double (*r)[3];    /* of each point and axis: r', r'', r''' */
    double *bound;     /* of z at each point */
    double *z;         /* coefficients: intervals + 2 */
    double start, end; /* what z is to be there, with z' = 0; 0: free */
    double *gradient, *step, *trial, (*matrix)[3]; /* of Newton */
};

/* A grid of intervals that each lie in one piece; w is copied, piece says of
 * which each is; cap bounds s' in each interval, most z.  MOTION_E_FULL without memory. */
int topp_barrier_init(struct topp_barrier *self, const struct topp_chain *chain,
                      const struct topp_barrier_limit limit[],
                      uint32_t intervals, const double w[],
                      const uint32_t piece[], const double cap[], double most);

/* Hold z at the start and the end, where it does not change: what z is there
 * stays as it is, and is to become this (topp_barrier_lead); 0 where it is free.  False
 * when it is above a limit of velocity. */
bool topp_barrier_hold(struct topp_barrier *self, double start, double end);

/* Leave `share` of the limits on interval i. */
void topp_barrier_tighten(struct topp_barrier *self, uint32_t i, double share);

/* Whether z is inside all limits at all points. */
bool topp_barrier_is_inside(const struct topp_barrier *self);

/* From z inside the limits to near the minimum of the time plus `weight` times
 * the barrier. */
void topp_barrier_center(struct topp_barrier *self, double weight);

/* From z inside the limits to what is held at the ends, by Newton's method from
 * one z inside to the next, each near the minimum for its ends; false when that
 * leads out of the limits. */
bool topp_barrier_lead(struct topp_barrier *self, double weight);

/* Bernstein coefficients of z on interval i. */
void topp_barrier_z(const struct topp_barrier *self, uint32_t i, double z[3]);

#endif
