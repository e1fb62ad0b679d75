/* motion/plan/plan_bound.h - where the extremes of a track are not.
 *
 * Extremes take roots of every derivative (motion/core/track.h).  Most segments
 * cannot be where a track is worst, which their control polygons tell. */
#ifndef MOTION_PLAN_PLAN_BOUND_H
#define MOTION_PLAN_PLAN_BOUND_H

#include "motion/core/track.h"

/* A range that holds motion_segment_extreme's, in the format of the quantity,
 * saturated; and the quantity at both ends, which motion_segment_state's is off
 * by at most `margin`. */
struct plan_bound {
    int64_t low, high;
    double start, end, margin;
};
struct plan_bound plan_segment_bound(const struct motion_segment *segment,
                                     enum motion_quantity quantity);
/* All of them, by motion_quantity. */
void plan_segment_bounds(const struct motion_segment *segment,
                         struct plan_bound bound[MOTION_JERK + 1]);

/* As motion_track_extreme. */
void plan_track_extreme(const struct motion_track *track,
                        enum motion_quantity quantity,
                        struct motion_extreme *extreme);

#endif
