/* motion/curve/spline_space.c - times for points in space; see spline.h. */
#include "motion/core/err.h"
#include "motion/curve/spline_internal.h"

static struct motion_real space_step(const int64_t *const pos_q32[],
                                     uint32_t axes, uint32_t i,
                                     enum motion_spline_spacing spacing)
{
    struct motion_real sum = motion_real_zero();

    if (spacing == MOTION_SPLINE_UNIFORM)
        return motion_real_int(1);
    for (uint32_t n = 0; n < axes; n++)
        sum = motion_real_add(sum, motion_real_sqr(spline_displacement(
                                       pos_q32[n][i], pos_q32[n][i + 1])));
    sum = motion_real_sqrt(sum);
    return spacing == MOTION_SPLINE_CHORDAL ? sum : motion_real_sqrt(sum);
}

int motion_spline_space(const int64_t *const pos_q32[], uint32_t axes,
                        uint32_t count, enum motion_spline_spacing spacing,
                        int64_t dur_ns_q12, int64_t t_ns_q12[])
{
    struct motion_real total = motion_real_zero(), at = total, rate;

    if (count < 2)
        return MOTION_E_EMPTY;
    if (axes == 0 || dur_ns_q12 < 1 ||
        (unsigned)spacing > MOTION_SPLINE_CHORDAL)
        return MOTION_E_ARG;
    for (uint32_t i = 0; i + 1 < count; i++) {
        const struct motion_real step = space_step(pos_q32, axes, i, spacing);
        if (motion_real_is_zero(step))
            return MOTION_E_ORDER;
        total = motion_real_add(total, step);
    }
    rate = motion_real_div(motion_real_int(dur_ns_q12), total);
    t_ns_q12[0] = 0;
    for (uint32_t i = 1; i < count; i++) {
        at = motion_real_add(at, space_step(pos_q32, axes, i - 1, spacing));
        if (motion_real_round(motion_real_mul(at, rate), 0, &t_ns_q12[i]) ||
            t_ns_q12[i] <= t_ns_q12[i - 1])
            return MOTION_E_ARG;
    }
    t_ns_q12[count - 1] = dur_ns_q12;
    return t_ns_q12[count - 1] > t_ns_q12[count - 2] ? MOTION_OK : MOTION_E_ARG;
}
