/* motion/plan/rig/plan_arm.h - a serial arm with a camera, or another tool, on its
 * flange: forward kinematics in jets, and the joints for a pose in double.
 *
 * What the arm is made of is motion/kinematics/arm.h, whose geometry this is.
 * Joints here are in radian, those that slide in the unit of length. */
#ifndef MOTION_PLAN_RIG_PLAN_ARM_H
#define MOTION_PLAN_RIG_PLAN_ARM_H

#include "motion/plan/rig/plan_rig.h"

/* Where the tool is. */
void plan_arm_camera(const struct plan_arm *arm, const struct plan_jet joint[],
                     struct plan_rig_camera *camera);

/* Joint i from the position of its axis, and back. */
struct plan_jet plan_arm_joint(const struct plan_arm *arm, uint32_t i,
                               struct plan_jet axis);
struct plan_jet plan_arm_axis(const struct plan_arm *arm, uint32_t i,
                              struct plan_jet joint);

/* Joint i as motion/kinematics has it, in degrees or in the unit of length. */
int64_t plan_arm_joint_q32(const struct plan_arm *arm, uint32_t i,
                           double joint);
double plan_arm_joint_of_q32(const struct plan_arm *arm, uint32_t i,
                             int64_t joint_q32);

/* Joints from which the tool is at `camera` with the derivatives that it has
 * there, near joint[].p, by Newton's method; with the Jacobian J
 *
 *     J q' = (v, w)      J q'' = (a, w') - (d/dt J) q'
 *
 * v of the pupil, w the angular velocity; both by least squares, as an arm may
 * have fewer than six joints.  Joints that are fixed (arm.h) move as joint[] says
 * and the others make up for it; these are six at most.  MOTION_E_UNREACHABLE, MOTION_E_SINGULAR where the
 * joints are not determined; joint[] is then of no use. */
int plan_arm_follow(const struct plan_arm *arm,
                    const struct plan_rig_camera *camera,
                    struct plan_jet joint[]);

#endif
