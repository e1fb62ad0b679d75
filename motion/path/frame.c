/* motion/path/frame.c - see frame.h. */
#include "motion/path/frame.h"

#include <stdbool.h>
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/number/trig.h"

#define FRAME_FLAT_BITS (-40)

/* a is below 2^bits b */
static bool frame_is_below(struct motion_real a, struct motion_real b,
                           int32_t bits)
{
    return motion_real_cmp(a, motion_real_scale(b, bits)) < 0;
}

/* --- Frenet -------------------------------------------------------------- */

/* k = |P' x P''| / |P'|^3,  t = (P' x P'') . P''' / |P' x P''|^2 */
int motion_frame_frenet(const struct motion_curve_point *point,
                        struct motion_frenet *frenet)
{
    const struct motion_vec cross = motion_vec_cross(point->d1, point->d2);
    const struct motion_real speed = motion_vec_length(point->d1);
    const struct motion_real bend = motion_vec_length(cross);
    const struct motion_real both =
        motion_real_mul(speed, motion_vec_length(point->d2));
    struct motion_frenet f = { .curvature = motion_real_zero() };

    if (motion_vec_unit(point->d1, &f.t) < 0)
        return MOTION_E_RANGE;
    const struct motion_real curvature = motion_real_div(
        bend, motion_real_mul(speed, motion_real_mul(speed, speed)));
    if (frame_is_below(curvature, motion_real_int(1), FRAME_FLAT_BITS) ||
        frame_is_below(bend, both, FRAME_FLAT_BITS)) {
        *frenet = f;
        return MOTION_FRENET_FLAT;
    }
    f.curvature = curvature;
    f.torsion = motion_real_div(motion_vec_dot(cross, point->d3),
                                motion_real_mul(bend, bend));
    (void)motion_vec_unit(cross, &f.b); /* not zero: not flat */
    f.n = motion_dir_cross(f.b, f.t);
    *frenet = f;
    return MOTION_FRENET_OK;
}

/* --- rotation-minimising ------------------------------------------------- */

int motion_frame_start(struct motion_dir t, struct motion_dir hint,
                       struct motion_frame *frame)
{
    struct motion_dir r;

    if (motion_dir_perpendicular(hint, t, &r) < 0)
        return MOTION_E_ARG;
    *frame = (struct motion_frame){ t, r, motion_dir_cross(t, r) };
    return MOTION_OK;
}

/* a - 2 (m . a) / (m . m) m */
static struct motion_vec frame_reflect(struct motion_vec a, struct motion_vec m,
                                       struct motion_real square)
{
    const struct motion_real k =
        motion_real_scale(motion_real_div(motion_vec_dot(m, a), square), 1);

    return motion_vec_sub(a, motion_vec_scale(m, k));
}

/* Without a chord the mirror between t and -t does: the shortest rotation. */
int motion_frame_step(const struct motion_frame *from, struct motion_vec chord,
                      struct motion_dir t, struct motion_frame *to)
{
    const struct motion_vec t0 = motion_vec_from_dir(from->t);
    const struct motion_vec t1 = motion_vec_from_dir(t);
    const struct motion_vec r0 = motion_vec_from_dir(from->r);
    const struct motion_real one = motion_real_int(1);
    struct motion_real square = motion_vec_dot(chord, chord);
    struct motion_vec mirror;
    struct motion_dir r;

    if (motion_real_is_zero(square)) {
        chord = motion_vec_add(t0, t1);
        square = motion_vec_dot(chord, chord);
        if (frame_is_below(square, one, FRAME_FLAT_BITS))
            return MOTION_E_RANGE;
    }
    mirror = motion_vec_sub(t1, frame_reflect(t0, chord, square));
    const struct motion_real square2 = motion_vec_dot(mirror, mirror);
    if (frame_is_below(square2, one, FRAME_FLAT_BITS))
        return MOTION_E_RANGE;
    const struct motion_vec carried =
        frame_reflect(frame_reflect(r0, chord, square), mirror, square2);
    if (motion_vec_unit(carried, &r) < 0)
        return MOTION_E_RANGE;
    return motion_frame_start(t, r, to);
}

int64_t motion_frame_twist(const struct motion_frame *a,
                           const struct motion_frame *b)
{
    return motion_trig_atan2(motion_dir_dot_q62(b->r, a->s),
                             motion_dir_dot_q62(b->r, a->r));
}

void motion_frame_turn(struct motion_frame *frame, int64_t angle_turn)
{
    int64_t s, c;

    motion_trig_sincos(angle_turn, &s, &c);
    frame->r = motion_dir_turn(frame->r, frame->t, s, c);
    frame->s = motion_dir_cross(frame->t, frame->r);
}
