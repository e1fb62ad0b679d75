/* motion/kinematics/dolly_zoom.c - see dolly_zoom.h. */
#include "motion/kinematics/dolly_zoom.h"

#include "motion/core/err.h"

enum { SLIDE, ROLL = 3 };

/* The distance of a subject that is tracked, which pan and tilt do not
 * change. */
static int dolly_zoom_distance(const struct motion_dolly_zoom *zoom,
                               int64_t slide_q32, struct motion_vec subject,
                               struct motion_real *distance)
{
    const struct motion_carrier *const carrier = &zoom->camera->carrier;
    struct motion_mount mount;
    int err;

    if (carrier->kind != &motion_carrier_linear ||
        carrier->as.linear.count != 1 || zoom->focal_at_q32 <= 0)
        return MOTION_E_ARG;
    err = carrier->kind->place(carrier, &slide_q32, &mount);
    if (err < 0)
        return err;
    return motion_pan_tilt_distance(
        &zoom->camera->head,
        motion_vec_length(motion_vec_sub(subject, mount.pivot)), distance);
}

int motion_dolly_zoom_focal(const struct motion_dolly_zoom *zoom,
                            struct motion_vec subject,
                            const int64_t *before_q32,
                            int64_t axis_q32[MOTION_DOLLY_ZOOM_AXES],
                            int64_t *focal_q32, struct motion_real *distance)
{
    struct motion_real at;
    int err =
        dolly_zoom_distance(zoom, zoom->slide_at_q32, zoom->subject_at, &at);

    axis_q32[ROLL] = 0;
    if (err == MOTION_OK)
        err = motion_rig_track(zoom->camera, subject, before_q32, axis_q32,
                               distance);
    if (err < 0)
        return err;
    return motion_real_round(
        motion_real_div(
            motion_real_mul(motion_real_from_q(zoom->focal_at_q32, 32),
                            *distance),
            at),
        32, focal_q32);
}

int motion_dolly_zoom_check(const struct motion_dolly_zoom *zoom,
                            int64_t focal_q32)
{
    return focal_q32 < zoom->focal_min_q32 || focal_q32 > zoom->focal_max_q32
               ? MOTION_E_UNREACHABLE
               : MOTION_OK;
}

int motion_dolly_zoom_slide(const struct motion_dolly_zoom *zoom,
                            int64_t focal_q32, struct motion_vec subject,
                            const int64_t *before_q32,
                            int64_t axis_q32[MOTION_DOLLY_ZOOM_AXES],
                            struct motion_real *distance)
{
    struct motion_slide_demand slide = { .point = subject,
                                         .beside = motion_vec_zero() };
    struct motion_real at, wanted;
    int err =
        dolly_zoom_distance(zoom, zoom->slide_at_q32, zoom->subject_at, &at);

    if (err < 0)
        return err;
    if (focal_q32 <= 0)
        return MOTION_E_UNREACHABLE;
    wanted =
        motion_real_div(motion_real_mul(motion_real_from_q(focal_q32, 32), at),
                        motion_real_from_q(zoom->focal_at_q32, 32));
    slide.radius = motion_pan_tilt_reach(&zoom->camera->head, wanted);
    err = motion_carrier_slide(&zoom->camera->carrier, &slide, before_q32,
                               &axis_q32[SLIDE]);
    axis_q32[ROLL] = 0;
    return err < 0 ? err
                   : motion_rig_track(zoom->camera, subject, before_q32,
                                      axis_q32, distance);
}
