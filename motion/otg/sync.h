/* motion/otg/sync.h - several axes: that start and arrive together, and
 * through a list of points without stopping.
 *
 *   NONE      each axis as fast as it can
 *   TIME      all take the same time, the shortest that every axis can take:
 *             an axis may be unable to take a time although it can take a
 *             shorter one, so this can be above the slowest axis's own time
 *   PHASE     as TIME, and on a straight line from start to goal where the
 *             states lie on one (else TIME)
 *   STRAIGHT  as PHASE, or MOTION_E_LIMIT
 *
 * Method: docs/OTG.md, "Several axes". */
#ifndef MOTION_OTG_SYNC_H
#define MOTION_OTG_SYNC_H

#include <stdint.h>

#include "motion/otg/otg.h"

MOTION_C_BEGIN

#define MOTION_SYNC_AXES 16

enum motion_sync_kind {
    MOTION_SYNC_NONE,
    MOTION_SYNC_TIME,
    MOTION_SYNC_PHASE,
    MOTION_SYNC_STRAIGHT,
};

/* What stands against a plan. */
struct motion_sync_fault {
    int axis;
    enum motion_otg_field field;
};

/* Plan `count` axes (1 .. MOTION_SYNC_AXES); velocity goals only with NONE.
 * move[i].dur_ns_q12 is a shortest duration for all: the largest counts.
 * Errors as motion_otg_make, `fault` (may be NULL) says where; plans are then
 * undefined.  Every plan has passed motion_otg_check and, synchronised, all
 * have the same dur_ns_q12. */
int motion_sync_make(const struct motion_otg_move move[], int count,
                     enum motion_sync_kind kind, struct motion_otg_plan plan[],
                     struct motion_sync_fault *fault);

/* --- through points -------------------------------------------------------
 *
 * Between two points all axes take the same time.  Where a velocity is not
 * given it is chosen here: zero on an axis that turns round at the point or
 * stands on one side of it; else a share of what the axis could reach on the
 * shorter side, the share being the one of a few, the same for all axes, with
 * which the two moves at the point take least.  Each choice looks at its two
 * neighbours only, so the cost is linear in the number of points and the result
 * is good, not optimal.  Acceleration at the points is zero. */

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

MOTION_C_END

#endif
