/* motion/kinematics/gantry.c - two rails and a bridge; see carrier.h.
 *
 * With the rails at x1 and x2 the bridge has the slope m = (x2 - x1) / (y2 - y1)
 * and the direction b = (m, 1, 0) / sqrt(1 + m^2), so that the pivot is at
 * (x1, y1, z) + (y - y1) b and the mount is turned about z by -atan m. */
#include "motion/core/err.h"
#include "motion/kinematics/carrier.h"
#include "motion/number/trig.h"

enum { X1, X2, Y, Z };

static uint32_t gantry_axes(const struct motion_carrier *carrier)
{
    (void)carrier;
    return 4;
}

static int gantry_place(const struct motion_carrier *carrier,
                        const int64_t *axis_q32, struct motion_mount *mount)
{
    const struct motion_gantry *const gantry = &carrier->as.gantry;
    const struct motion_dir up = { { 0, 0, (int64_t)1 << 62 } };
    struct motion_real at[4], slope, cosine, along;

    if (gantry->at_y_q32[0] == gantry->at_y_q32[1])
        return MOTION_E_ARG;
    for (int i = 0; i < 4; i++) {
        int64_t at_q32;
        int err =
            motion_axis_coordinate(&gantry->axis[i], axis_q32[i], &at_q32);
        if (err < 0)
            return err;
        at[i] = motion_real_from_q(at_q32, 32);
    }
    const struct motion_real y1 = motion_real_from_q(gantry->at_y_q32[0], 32),
                             y2 = motion_real_from_q(gantry->at_y_q32[1], 32);
    slope = motion_real_div(motion_real_sub(at[X2], at[X1]),
                            motion_real_sub(y2, y1));
    cosine = motion_real_div(motion_real_int(1),
                             motion_real_sqrt(motion_real_add(
                                 motion_real_int(1), motion_real_sqr(slope))));
    along = motion_real_mul(motion_real_sub(at[Y], y1), cosine);
    mount->pivot = (struct motion_vec){ {
        motion_real_add(at[X1], motion_real_mul(along, slope)),
        motion_real_add(y1, along),
        at[Z],
    } };
    mount->level = motion_quat_mul(
        motion_quat_about(
            up, motion_trig_diff(
                    0, motion_trig_atan2_real(slope, motion_real_int(1)))),
        carrier->level);
    return MOTION_OK;
}

static int gantry_find(const struct motion_carrier *carrier,
                       struct motion_vec pivot, const int64_t *before_q32,
                       int64_t *axis_q32)
{
    const struct motion_gantry *const gantry = &carrier->as.gantry;
    int err =
        gantry->at_y_q32[0] == gantry->at_y_q32[1] ? MOTION_E_ARG : MOTION_OK;

    (void)before_q32;
    for (int i = 0; i < 4 && err == MOTION_OK; i++)
        err = motion_axis_position_real(
            &gantry->axis[i], pivot.x[i > X1 ? i - 1 : 0], &axis_q32[i]);
    return err;
}

const struct motion_carrier_kind motion_carrier_gantry = {
    .axes = gantry_axes,
    .place = gantry_place,
    .find = gantry_find,
};
