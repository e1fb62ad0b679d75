/* motion/otg/through.h - through a list of points without stopping.
 *
 * Between two points all axes take the same time (sync.h).  Where a velocity
 * is not given it is chosen here: zero on an axis that turns round at the
 * point or stands on one side of it; else a share of what the axis could reach
 * on the shorter side, the share being the one of a few, the same for all
 * axes, with which the two moves at the point take least.  Each choice looks at
 * its two neighbours only, so the cost is linear in the number of points and
 * the result is good, not optimal.  Acceleration at the points is zero. */
#ifndef MOTION_OTG_THROUGH_H
#define MOTION_OTG_THROUGH_H

#include "motion/otg/sync.h"

struct motion_otg_point {
    int64_t pos_q32, vel_q32;
    bool has_vel;
};

/* `start[axis]` is where the axes are; `point[i * axes + axis]` the points in
 * order; the last without a velocity is a stop.  Fills in vel_q32 and makes
 * plan[i * axes + axis], the move that ends at point i.  Errors as
 * motion_sync_make, fault->axis within the move to point *failed (may be NULL).
 * Plan-time: about 12 moves of all axes per point. */
int motion_otg_through(const struct motion_state start[],
                       const struct motion_otg_limit limit[], int axes,
                       struct motion_otg_point point[], int points,
                       struct motion_otg_plan plan[], int *failed,
                       struct motion_sync_fault *fault);

#endif
