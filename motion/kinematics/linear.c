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

/* --- a slide at a distance ------------------------------------------------ */

/* |w + s u| = radius:  s = (-w.u +- sqrt(u^2 radius^2 - |w x u|^2)) / u^2. */
static int linear_slides(const struct motion_linear *linear,
                         const struct motion_slide_demand *demand,
                         int64_t slide_q32[2])
{
    struct motion_vec u = motion_vec_from_dir(linear->direction[0]);
    struct motion_vec w = motion_vec_sub(
        motion_vec_add(linear->origin, demand->beside), demand->point);
    int err = MOTION_OK;

    if (demand->is_vertical)
        w.x[2] = u.x[2] = motion_real_zero();
    const struct motion_real length = motion_vec_length(u);
    if (motion_real_lt(length, motion_real_make(1, -LINEAR_PLANE_BITS)))
        return motion_mount_is_near(
                   motion_real_sub(motion_vec_length(w), demand->radius))
                   ? MOTION_E_SINGULAR
                   : MOTION_E_UNREACHABLE;
    const struct motion_real nearest =
        motion_real_div(motion_vec_length(motion_vec_cross(w, u)), length);
    const struct motion_real over = motion_real_sub(demand->radius, nearest);
    if (motion_real_sign(demand->radius) < 0 ||
        (motion_real_sign(over) < 0 && !motion_mount_is_near(over)))
        return MOTION_E_UNREACHABLE;
    /* r^2 - n^2 as (r - n)(r + n); sqrt is zero below zero */
    const struct motion_real half = motion_real_sqrt(
        motion_real_mul(over, motion_real_add(demand->radius, nearest)));
    const struct motion_real middle =
        motion_real_div(motion_real_neg(motion_vec_dot(w, u)), length);
    for (int i = 0; i < 2 && err == MOTION_OK; i++)
        err = motion_axis_position_real(
            &linear->axis[0],
            motion_real_div(i == 0 ? motion_real_sub(middle, half)
                                   : motion_real_add(middle, half),
                            length),
            &slide_q32[i]);
    return err;
}

int motion_carrier_slide(const struct motion_carrier *carrier,
                         const struct motion_slide_demand *demand,
                         const int64_t *near_q32, int64_t *slide_q32)
{
    const struct motion_linear *const linear = &carrier->as.linear;
    int64_t place_q32[2] = { 0 }, off_q32[2] = { 0 };
    int err;

    if (carrier->kind != &motion_carrier_linear || linear->count != 1)
        return MOTION_E_ARG;
    err = linear_slides(linear, demand, place_q32);
    for (int i = 0; i < 2 && err == MOTION_OK && near_q32 != NULL; i++)
        err = motion_fixed_sub(place_q32[i], *near_q32, &off_q32[i]);
    if (err < 0)
        return err;
    if (near_q32 == NULL)
        *slide_q32 = place_q32[place_q32[1] < place_q32[0]];
    else
        *slide_q32 = place_q32[motion_fixed_abs(off_q32[1]) <
                               motion_fixed_abs(off_q32[0])];
    return MOTION_OK;
}
