/* motion/kinematics/rig.c - see rig.h. */
#include "motion/kinematics/rig.h"

uint32_t motion_rig_axes(const struct motion_rig *rig)
{
    return rig->carrier.kind->axes(&rig->carrier) + MOTION_HEAD_AXES;
}

int motion_rig_camera(const struct motion_rig *rig, const int64_t *axis_q32,
                      struct motion_camera *camera)
{
    struct motion_mount mount;
    int err = rig->carrier.kind->place(&rig->carrier, axis_q32, &mount);

    if (err < 0)
        return err;
    return motion_pan_tilt_camera(
        &rig->head, &mount, axis_q32 + motion_rig_axes(rig) - MOTION_HEAD_AXES,
        camera);
}
