/* motion/kinematics/arm.c - see arm.h: forward, and the Jacobian. */
#include "motion/kinematics/arm.h"

#include "motion/core/err.h"
#include "motion/number/trig.h"

#define ARM_ONE_Q62 ((int64_t)1 << 62)

static const struct motion_dir arm_x = { { ARM_ONE_Q62, 0, 0 } },
                               arm_z = { { 0, 0, ARM_ONE_Q62 } };

/* From the frame of one joint to that of the next. */
static void arm_link(const struct motion_arm_joint *joint, int64_t at_q32,
                     struct motion_pose *pose)
{
    int64_t theta_turn = motion_trig_from_deg_q32(joint->theta_deg_q32);
    struct motion_real d = motion_real_from_q(joint->d_q32, 32);
    struct motion_vec out = motion_vec_zero(), up = motion_vec_zero();

    if (joint->is_prismatic)
        d = motion_real_add(d, motion_real_from_q(at_q32, 32));
    else
        theta_turn =
            motion_trig_sum(theta_turn, motion_trig_from_deg_q32(at_q32));
    up.x[2] = d;
    out.x[0] = motion_real_from_q(joint->a_q32, 32);
    pose->origin = motion_vec_add(pose->origin, motion_mount_turn(pose->q, up));
    pose->q = motion_quat_mul(pose->q, motion_quat_about(arm_z, theta_turn));
    pose->origin =
        motion_vec_add(pose->origin, motion_mount_turn(pose->q, out));
    pose->q = motion_quat_mul(
        pose->q, motion_quat_about(
                     arm_x, motion_trig_from_deg_q32(joint->alpha_deg_q32)));
}

static bool arm_is_whole(const struct motion_arm *arm)
{
    return arm->count >= 1 && arm->count <= MOTION_ARM_JOINTS_MAX;
}

int motion_arm_flange(const struct motion_arm *arm, const int64_t *joint_q32,
                      struct motion_pose *flange)
{
    if (!arm_is_whole(arm))
        return MOTION_E_ARG;
    *flange = (struct motion_pose){ motion_vec_zero(), MOTION_QUAT_ONE };
    for (uint32_t i = 0; i < arm->count; i++)
        arm_link(&arm->joint[i], joint_q32[i], flange);
    return MOTION_OK;
}

/* A joint turns about, or slides along, the z axis before it. */
int motion_arm_jacobian(const struct motion_arm *arm, const int64_t *joint_q32,
                        struct motion_pose *flange,
                        struct motion_arm_jacobian *jacobian)
{
    struct motion_vec axis[MOTION_ARM_JOINTS_MAX],
        origin[MOTION_ARM_JOINTS_MAX];

    if (!arm_is_whole(arm))
        return MOTION_E_ARG;
    *flange = (struct motion_pose){ motion_vec_zero(), MOTION_QUAT_ONE };
    for (uint32_t i = 0; i < arm->count; i++) {
        axis[i] = motion_vec_from_dir(motion_quat_turn(flange->q, arm_z));
        origin[i] = flange->origin;
        arm_link(&arm->joint[i], joint_q32[i], flange);
    }
    for (uint32_t i = 0; i < arm->count; i++) {
        const bool slides = arm->joint[i].is_prismatic;
        const struct motion_vec v =
            slides ? axis[i]
                   : motion_vec_cross(
                         axis[i], motion_vec_sub(flange->origin, origin[i]));
        for (int k = 0; k < 3; k++) {
            jacobian->column[i][k] = v.x[k];
            jacobian->column[i][3 + k] =
                slides ? motion_real_zero() : axis[i].x[k];
        }
    }
    return MOTION_OK;
}

int motion_arm_camera(const struct motion_arm *arm,
                      const struct motion_arm_tool *tool,
                      const int64_t *joint_q32, struct motion_camera *camera)
{
    struct motion_pose flange;
    int err = motion_arm_flange(arm, joint_q32, &flange);

    if (err < 0)
        return err;
    camera->pupil =
        motion_vec_add(flange.origin, motion_mount_turn(flange.q, tool->pupil));
    camera->q = motion_quat_mul(flange.q, tool->q);
    return MOTION_OK;
}
