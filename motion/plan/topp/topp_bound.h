/* motion/plan/topp/topp_bound.h - the most that a law takes of its limits anywhere
 * on an interval, not only at points of it.
 *
 * On an interval an axis is a polynomial q(s(w)) and z is one, see
 * topp_barrier.h; so are its velocity and its jerk squared and its acceleration,
 * and topp_poly.h bounds them.
 *
 * Off-line: double. */
#ifndef MOTION_PLAN_TOPP_TOPP_BOUND_H
#define MOTION_PLAN_TOPP_TOPP_BOUND_H

#include "motion/plan/topp/topp_barrier.h"

/* Largest shares of the limits of velocity, acceleration and jerk. */
struct topp_shares {
    double vel, acc, jerk;
};

/* Interval i of the barrier's z, on this piece, s' at most `cap`, which may be infinite:
 * raises `shares` to bounds of what it takes. */
void topp_bound(const struct topp_barrier *barrier, uint32_t i, uint32_t piece,
                double cap, struct topp_shares *shares);

/* Stretching time by this brings all shares to 1. */
double topp_bound_stretch(const struct topp_shares *shares);

#endif
