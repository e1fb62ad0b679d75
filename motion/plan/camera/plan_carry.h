/* motion/plan/camera/plan_carry.h - a head that goes along a path through space: the
 * axes of what carries it, by inverse kinematics.
 *
 * Positions are those of motion/kinematics (carrier.h), continued from the row
 * before; derivatives follow from the forward kinematics p = P(q), with the
 * Jacobian J:
 *
 *     J q' = p'      J q'' = p'' - (d/dt J) q'
 *
 * both by least squares, as a slider has fewer axes than space. */
#ifndef MOTION_PLAN_CAMERA_PLAN_CARRY_H
#define MOTION_PLAN_CAMERA_PLAN_CARRY_H

#include "motion/plan/path/plan_path.h"
#include "motion/plan/rig/plan_rig.h"

/* Plan the path and what carries the head, path->carrier, whose axes are those
 * of the move: their tracks must be empty.  As plan_path_tracks otherwise;
 * drive->bound is that of the place in space, *bound_q32 how far at most an axis
 * is from where that place requires it. */
int plan_carry_tracks(const struct plan_path *path, struct plan_drive *drive,
                      struct motion_track track[], int64_t *bound_q32,
                      struct plan_error *error);

#endif
