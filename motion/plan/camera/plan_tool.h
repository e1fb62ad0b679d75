/* motion/plan/camera/plan_tool.h - the tool of a serial arm along a path through
 * space, and the joints that take it there.
 *
 * The tool's point (of a camera its entrance pupil) is on the path; it is turned as
 * a camera looks (plan_tool_look.h), or keeps its directions.  The first joints
 * are those of motion/kinematics/arm.h nearest to where the path says, which
 * chooses the branch, and from there they go on without a jump (plan_arm.h).
 *
 * Joints that are fixed have keys of their own, and the others make up for what
 * they do: of an arm with more than six joints, or on a rail, all but six. */
#ifndef MOTION_PLAN_CAMERA_PLAN_TOOL_H
#define MOTION_PLAN_CAMERA_PLAN_TOOL_H

#include "motion/plan/path/plan_path.h"
#include "motion/plan/rig/plan_rig.h"

/* Plan the path and the arm, path->carrier, whose axes are those of the move: the
 * tracks of fixed joints are there, all others are empty.  As plan_carry_tracks (plan_carry.h) otherwise;
 * *bound_q32 is of the joints' axes. */
int plan_tool_tracks(const struct plan_path *path, struct plan_drive *drive,
                     struct motion_track track[], int64_t *bound_q32,
                     struct plan_error *error);

#endif
