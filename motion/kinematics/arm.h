/* motion/kinematics/arm.h - a serial arm by its Denavit-Hartenberg table.
 *
 * Standard (distal) parameters, base to flange: each joint is
 *
 *     A = Rz(theta) Tz(d) Tx(a) Rx(alpha)
 *
 * to whose theta a revolute joint adds its angle in degrees, to whose d a
 * prismatic one its travel in the unit of length, both Q32.32.  A pose is the
 * origin of the flange and the rotation of its own frame in the base's.
 *
 * The inverse is numeric (damped least squares), so any table will do; it works
 * for a limited number of steps and refuses rather than to go on.
 * Sources: J. Denavit, R. S. Hartenberg, J. Applied Mechanics 22 (1955);
 * P. Corke, Robotics, Vision and Control (2011), 7 and 8.1 (Jacobian); C. W.
 * Wampler, IEEE Trans. SMC 16 (1986) (damped least squares).  Plan-time. */
#ifndef MOTION_KINEMATICS_ARM_H
#define MOTION_KINEMATICS_ARM_H

#include "motion/kinematics/pan_tilt.h"

#define MOTION_ARM_JOINTS_MAX 8

struct motion_arm_joint {
    int64_t a_q32, d_q32;
    int64_t alpha_deg_q32, theta_deg_q32;
    bool is_prismatic;
    bool is_fixed;   /* the inverse leaves it where it starts */
    bool is_limited; /* low <= position <= high */
    int64_t low_q32, high_q32;
};

struct motion_arm {
    uint32_t count; /* 1 .. MOTION_ARM_JOINTS_MAX */
    struct motion_arm_joint joint[MOTION_ARM_JOINTS_MAX];
};

/* Rotation and place of one frame in another. */
struct motion_pose {
    struct motion_vec origin;
    struct motion_quat q;
};

/* A camera on the flange, in the flange's frame: its entrance pupil and its
 * rotation (motion_mount_level of view and up). */
struct motion_arm_tool {
    struct motion_vec pupil;
    struct motion_quat q;
};

/* Rows vx, vy, vz (unit / rad or 1), wx, wy, wz (1 or 0) of the flange's origin
 * in the frame of the base, a column per joint, per radian or per unit. */
struct motion_arm_jacobian {
    struct motion_real column[MOTION_ARM_JOINTS_MAX][6];
};

/* MOTION_E_ARG for a number of joints out of range. */
int motion_arm_flange(const struct motion_arm *arm, const int64_t *joint_q32,
                      struct motion_pose *flange);
int motion_arm_jacobian(const struct motion_arm *arm, const int64_t *joint_q32,
                        struct motion_pose *flange,
                        struct motion_arm_jacobian *jacobian);
int motion_arm_camera(const struct motion_arm *arm,
                      const struct motion_arm_tool *tool,
                      const int64_t *joint_q32, struct motion_camera *camera);

/* The joints for a pose, from `start`: the answer that a descent from there
 * leads to, which is the one of start's branch when start is the row before of a
 * motion, each joint within half a turn of its start if its limits allow.
 * Where that descent ends nowhere, or outside the limits, the nearest answer of
 * motion_arm_answers.  The pose is met within 2^-20 of the unit and 2^-29 rad.
 * Joints that are fixed stay, so that an arm with more than six, on a rail say,
 * has as many answers as one with six.
 * MOTION_E_UNREACHABLE when no answer is found; MOTION_E_SINGULAR when joints
 * are not determined there (the Jacobian has lost a rank); MOTION_E_ARG. */
int motion_arm_inverse(const struct motion_arm *arm,
                       const struct motion_pose *flange,
                       const int64_t *start_q32, int64_t *joint_q32);

/* Different answers, the nearest to `start` first (sum of squares, degrees and
 * units), found by descents from `start` and from MOTION_ARM_STARTS places
 * spread over the joints.  Returns how many, at most `capacity`, which is enough
 * for each there is when it is 16; errors as above. */
#define MOTION_ARM_STARTS 96
struct motion_arm_answer {
    int64_t joint_q32[MOTION_ARM_JOINTS_MAX];
};
int motion_arm_answers(const struct motion_arm *arm,
                       const struct motion_pose *flange,
                       const int64_t *start_q32, uint32_t capacity,
                       struct motion_arm_answer *answer);

#endif
