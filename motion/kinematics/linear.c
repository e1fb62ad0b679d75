/* motion/kinematics/linear.c - one to three linear axes; see carrier.h. */
#include "motion/core/err.h"
#include "motion/kinematics/carrier.h"

#define LINEAR_PLANE_BITS 24 /* sine between an axis and those before */

static uint32_t linear_axes(const struct motion_carrier *carrier)
{
    return carrier->as.linear.count;
}

static int linear_place(const struct motion_carrier *carrier,
                        const int64_t *axis_q32, struct motion_mount *mount)
{
    const struct motion_linear *const linear = &carrier->as.linear;

    if (linear->count > MOTION_LINEAR_AXES_MAX)
        return MOTION_E_ARG;
    *mount = (struct motion_mount){ linear->origin, carrier->level };
    for (uint32_t i = 0; i < linear->count; i++) {
        int64_t at_q32;
        int err =
            motion_axis_coordinate(&linear->axis[i], axis_q32[i], &at_q32);
        if (err < 0)
            return err;
        mount->pivot = motion_vec_add(
            mount->pivot,
            motion_vec_scale(motion_vec_from_dir(linear->direction[i]),
                             motion_real_from_q(at_q32, 32)));
    }
    return MOTION_OK;
}

/* Directions made perpendicular one after the other (Gram-Schmidt):
 * direction j = sum of r[i][j] base i, i <= j. */
struct linear_base {
    struct motion_vec base[MOTION_LINEAR_AXES_MAX];
    struct motion_real r[MOTION_LINEAR_AXES_MAX][MOTION_LINEAR_AXES_MAX];
    bool is_flat; /* an axis is in the plane of those before */
};

static void linear_orthogonal(const struct motion_linear *linear,
                              struct linear_base *b)
{
    b->is_flat = false;
    for (uint32_t j = 0; j < linear->count; j++) {
        struct motion_vec rest = motion_vec_from_dir(linear->direction[j]);

        for (uint32_t i = 0; i < j; i++) {
            b->r[i][j] = motion_vec_dot(b->base[i], rest);
            rest =
                motion_vec_sub(rest, motion_vec_scale(b->base[i], b->r[i][j]));
        }
        b->r[j][j] = motion_vec_length(rest);
        b->base[j] = motion_vec_zero();
        if (motion_real_lt(b->r[j][j], motion_real_make(1, -LINEAR_PLANE_BITS)))
            b->is_flat = true;
        else
            b->base[j] = motion_vec_scale(
                rest, motion_real_div(motion_real_int(1), b->r[j][j]));
    }
}

static int linear_find(const struct motion_carrier *carrier,
                       struct motion_vec pivot, const int64_t *before_q32,
                       int64_t *axis_q32)
{
    const struct motion_linear *const linear = &carrier->as.linear;
    struct motion_vec rest = motion_vec_sub(pivot, linear->origin);
    struct motion_real along[MOTION_LINEAR_AXES_MAX];
    struct linear_base b;
    int err = MOTION_OK;

    (void)before_q32;
    if (linear->count > MOTION_LINEAR_AXES_MAX)
        return MOTION_E_ARG;
    linear_orthogonal(linear, &b);
    for (uint32_t i = 0; i < linear->count; i++) {
        along[i] = motion_vec_dot(b.base[i], rest);
        rest = motion_vec_sub(rest, motion_vec_scale(b.base[i], along[i]));
    }
    if (!motion_mount_is_near(motion_vec_length(rest)))
        return MOTION_E_UNREACHABLE;
    if (b.is_flat)
        return MOTION_E_SINGULAR;
    for (uint32_t n = linear->count; n-- > 0 && err == MOTION_OK;) {
        for (uint32_t j = n + 1; j < linear->count; j++)
            along[n] =
                motion_real_sub(along[n], motion_real_mul(b.r[n][j], along[j]));
        along[n] = motion_real_div(along[n], b.r[n][n]);
        err =
            motion_axis_position_real(&linear->axis[n], along[n], &axis_q32[n]);
    }
    return err;
}

const struct motion_carrier_kind motion_carrier_linear = {
    .axes = linear_axes,
    .place = linear_place,
    .find = linear_find,
};
