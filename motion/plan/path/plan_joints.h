/* motion/plan/path/plan_joints.h - keyed axes whose keys give positions only: all pass
 * their first keys together, their second, and so on, at the times that are
 * found.
 *
 * The curve of each axis goes over a parameter that grows from key to key with
 * the square root of the distance, each axis in shares of its velocity limit
 * (centripetal, Lee, Choosing nodes in parametric curve interpolation, CAD 21
 * (1989)); plan_timing.h then finds the time. */
#ifndef MOTION_PLAN_PATH_PLAN_JOINTS_H
#define MOTION_PLAN_PATH_PLAN_JOINTS_H

#include "motion/plan/move.h"

#define PLAN_JOINTS_MAX 32

/* Axes of the move whose driver is PLAN_BY_TIMING; key times do not count. */
struct plan_joints {
    uint32_t axis[PLAN_JOINTS_MAX];
    struct plan_limit limit[PLAN_JOINTS_MAX];
    uint32_t axes;
    int64_t tolerance_q32; /* of position, in the unit of any axis; > 0 */
    struct plan_place place;
};

/* Plan them into track[joints->axis[..]], which must be empty: from rest to rest
 * inside all limits.  MOTION_E_ARG unless all have as many keys, two at least;
 * MOTION_E_ORDER when a key repeats the one before it in all axes; errors of
 * plan_axis_track and plan_timing_solve.  *error says it. */
int plan_joints_tracks(const struct plan_move *move,
                       struct motion_track track[], struct plan_error *error);

#endif
