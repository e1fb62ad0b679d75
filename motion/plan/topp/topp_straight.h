/* motion/plan/topp/topp_straight.h - stretches of a path that are a straight line in
 * space, run through without turning back; how fast s goes does not matter.
 * Off-line: double. */
#ifndef MOTION_PLAN_TOPP_TOPP_STRAIGHT_H
#define MOTION_PLAN_TOPP_TOPP_STRAIGHT_H

#include <stdbool.h>

#include "motion/plan/topp/topp.h"
#include "motion/plan/topp/topp_line.h"

/* From `start`, all axes together `length` long. */
struct topp_straight {
    double start[PLAN_TOPP_AXES_MAX];
    double along[PLAN_TOPP_AXES_MAX]; /* unit vector */
    double length;
};

/* Whether pieces first .. last are one, within rounding. */
bool topp_straight_of(const struct plan_topp_path *path, uint32_t first,
                      uint32_t last, struct topp_straight *straight);

/* The limits of all axes along it. */
void topp_straight_limit(const struct topp_straight *straight, unsigned axes,
                         const struct plan_topp_limit limit[],
                         const double jerk[], struct topp_line_limit *line);

#endif
