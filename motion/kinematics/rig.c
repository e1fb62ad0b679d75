/* motion/kinematics/rig.c - see rig.h. */
#include "motion/kinematics/rig.h"

#include "motion/core/err.h"

#define RIG_ONE_Q62 ((int64_t)1 << 62)

uint32_t motion_rig_axes(const struct motion_rig *rig)
{
    return rig->carrier.kind->axes(&rig->carrier) + MOTION_HEAD_AXES;
}

/* The first axis of the head. */
static uint32_t rig_head(const struct motion_rig *rig)
{
    return rig->carrier.kind->axes(&rig->carrier);
}

int motion_rig_camera(const struct motion_rig *rig, const int64_t *axis_q32,
                      struct motion_camera *camera)
{
    struct motion_mount mount;
    int err = rig->carrier.kind->place(&rig->carrier, axis_q32, &mount);

    if (err < 0)
        return err;
    return motion_pan_tilt_camera(&rig->head, &mount, axis_q32 + rig_head(rig),
                                  camera);
}

int motion_rig_pose(const struct motion_rig *rig,
                    const struct motion_camera *camera,
                    const int64_t *before_q32, int64_t *axis_q32)
{
    const struct motion_vec pivot = motion_vec_sub(
        camera->pupil, motion_pan_tilt_nodal(&rig->head, camera->q));
    int64_t found_q32[MOTION_RIG_AXES_MAX];
    struct motion_mount mount;
    int err =
        rig->carrier.kind->find(&rig->carrier, pivot, before_q32, found_q32);

    if (err == MOTION_OK)
        err = rig->carrier.kind->place(&rig->carrier, found_q32, &mount);
    if (err == MOTION_OK)
        err = motion_pan_tilt_rotation(
            &rig->head, mount.level, camera->q,
            before_q32 != NULL ? before_q32 + rig_head(rig) : NULL,
            found_q32 + rig_head(rig));
    for (uint32_t i = 0; i < motion_rig_axes(rig) && err == MOTION_OK; i++)
        axis_q32[i] = found_q32[i];
    return err;
}

int motion_rig_level_view(struct motion_vec pupil, struct motion_vec subject,
                          struct motion_camera *camera)
{
    const struct motion_vec up =
        motion_vec_from_dir((struct motion_dir){ { 0, 0, RIG_ONE_Q62 } });
    const struct motion_vec view = motion_vec_sub(subject, pupil);
    int err;

    if (motion_mount_is_near(motion_vec_length(view)))
        return MOTION_E_SINGULAR;
    err = motion_mount_level(view, up, &camera->q);
    camera->pupil = pupil;
    return err == MOTION_E_RANGE ? MOTION_E_SINGULAR : err;
}

int motion_rig_track(const struct motion_rig *rig, struct motion_vec subject,
                     const int64_t *before_q32, int64_t *axis_q32,
                     struct motion_real *distance)
{
    const uint32_t head = rig_head(rig);
    struct motion_mount mount;
    int err = rig->carrier.kind->place(&rig->carrier, axis_q32, &mount);

    if (err < 0)
        return err;
    return motion_pan_tilt_track(&rig->head, &mount, subject,
                                 before_q32 != NULL ? before_q32 + head : NULL,
                                 axis_q32 + head, distance);
}

void motion_camera_distance(const struct motion_camera *camera,
                            struct motion_vec subject,
                            struct motion_real *distance,
                            struct motion_real *depth)
{
    const struct motion_vec to = motion_vec_sub(subject, camera->pupil);
    const struct motion_dir view = motion_quat_turn(
        camera->q, (struct motion_dir){ { 0, 0, -RIG_ONE_Q62 } });

    *distance = motion_vec_length(to);
    *depth = motion_vec_dot(to, motion_vec_from_dir(view));
}
