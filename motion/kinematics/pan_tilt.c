/* motion/kinematics/pan_tilt.c - see pan_tilt.h. */
#include "motion/kinematics/pan_tilt.h"

#include "motion/core/err.h"
#include "motion/number/trig.h"

static int pan_tilt_turns(const struct motion_pan_tilt *head,
                          const int64_t axis_q32[MOTION_HEAD_AXES],
                          int64_t turn[MOTION_HEAD_AXES])
{
    for (int i = 0; i < MOTION_HEAD_AXES; i++) {
        int64_t deg_q32;
        int err = motion_axis_coordinate(&head->axis[i], axis_q32[i], &deg_q32);
        if (err < 0)
            return err;
        turn[i] = motion_trig_from_deg_q32(deg_q32);
    }
    return MOTION_OK;
}

struct motion_vec motion_pan_tilt_nodal(const struct motion_pan_tilt *head,
                                        struct motion_quat q)
{
    const struct motion_vec nodal = { {
        motion_real_from_q(head->nodal.right_q32, 32),
        motion_real_from_q(head->nodal.up_q32, 32),
        motion_real_neg(motion_real_from_q(head->nodal.forward_q32, 32)),
    } };

    return motion_mount_turn(q, nodal);
}

int motion_pan_tilt_camera(const struct motion_pan_tilt *head,
                           const struct motion_mount *mount,
                           const int64_t axis_q32[MOTION_HEAD_AXES],
                           struct motion_camera *camera)
{
    int64_t turn[MOTION_HEAD_AXES];
    int err = pan_tilt_turns(head, axis_q32, turn);

    if (err < 0)
        return err;
    camera->q = motion_quat_mul(mount->level, motion_head_quat(turn));
    camera->pupil =
        motion_vec_add(mount->pivot, motion_pan_tilt_nodal(head, camera->q));
    return MOTION_OK;
}
