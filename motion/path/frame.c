/* motion/path/frame.c - see frame.h. */
#include "motion/path/frame.h"

#include <stdbool.h>
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/number/trig.h"

#define FRAME_FLAT_BITS (-40)
#define FRAME_STEPS_MAX ((uint32_t)1 << 20)
/* Parts of a curve that are looked at whatever happens: one step and two agree
 * also where all three see the same phase of something periodic. */
#define FRAME_PARTS    256
#define FRAME_ONE_Q62  ((int64_t)1 << 62)
#define FRAME_SAME_Q62 ((int64_t)1 << 46) /* 2^-16 */
#define FRAME_AT_REST  (-48) /* P' below this part of P'' is rounding */

/* a is below 2^bits b */
static bool frame_is_below(struct motion_real a, struct motion_real b,
                           int32_t bits)
{
    return motion_real_cmp(a, motion_real_scale(b, bits)) < 0;
}

int motion_frame_tangent(const struct motion_curve_point *point,
                         enum motion_frame_side side,
                         struct motion_dir *tangent)
{
    const struct motion_real d2 = motion_vec_length(point->d2);
    int err;

    if (!frame_is_below(motion_vec_length(point->d1), d2, FRAME_AT_REST) &&
        motion_vec_unit(point->d1, tangent) == MOTION_OK)
        return MOTION_OK;
    if (motion_real_is_zero(d2))
        return motion_vec_unit(point->d3, tangent);
    err = motion_vec_unit(point->d2, tangent);
    if (side == MOTION_FRAME_BEFORE)
        *tangent = motion_dir_neg(*tangent);
    return err;
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

static int frame_point(const struct motion_curve *curve, int64_t u,
                       struct motion_vec *pos, struct motion_dir *t)
{
    struct motion_curve_point point;
    int err = curve->at(curve->context, u, 3, &point);

    if (err < 0)
        return err;
    *pos = point.pos;
    return motion_frame_tangent(
        &point, u == curve->last ? MOTION_FRAME_BEFORE : MOTION_FRAME_AFTER, t);
}

int motion_frame_table(const struct motion_curve *curve, const int64_t *u,
                       uint32_t count, struct motion_frame *frame)
{
    struct motion_vec before, pos;
    struct motion_dir t;
    int err;

    if (count == 0)
        return MOTION_E_EMPTY;
    err = frame_point(curve, u[0], &before, &t);
    for (uint32_t i = 1; i < count && err == MOTION_OK; i++) {
        err = frame_point(curve, u[i], &pos, &t);
        if (err == MOTION_OK)
            err = motion_frame_step(&frame[i - 1], motion_vec_sub(pos, before),
                                    t, &frame[i]);
        before = pos;
    }
    return err;
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

/* Where the walk is. */
struct frame_walk {
    const struct motion_curve *curve;
    struct motion_frame frame;
    struct motion_vec pos;
    int64_t u;
};

static int frame_walk_to(struct frame_walk *walk, int64_t u)
{
    struct motion_vec pos;
    struct motion_dir t;
    int err = frame_point(walk->curve, u, &pos, &t);

    if (err == MOTION_OK)
        err = motion_frame_step(&walk->frame, motion_vec_sub(pos, walk->pos), t,
                                &walk->frame);
    walk->pos = pos;
    walk->u = u;
    return err;
}

/* One step against two.  The error of one is e h^5, of two 2 e (h/2)^5: their
 * difference is 15 times what is left in the two. */
static int frame_try(struct frame_walk *walk, uint64_t step, int64_t *off)
{
    const int64_t from = walk->u, mid = (int64_t)((uint64_t)from + step / 2),
                  to = (int64_t)((uint64_t)from + step);
    struct frame_walk once = *walk;
    int err = frame_walk_to(&once, to);

    if (err == MOTION_OK)
        err = frame_walk_to(walk, mid);
    if (err == MOTION_OK)
        err = frame_walk_to(walk, to);
    if (err == MOTION_OK) {
        *off = motion_frame_twist(&once.frame, &walk->frame);
        motion_frame_turn(&walk->frame, *off / 15);
    }
    return err;
}

/* `tolerance` radian in turns: 2^-62 rad is 0.64 units. */
static uint64_t frame_tolerance(int64_t tolerance_q62)
{
    return (uint64_t)tolerance_q62 / 8 * 5 + 1;
}

int motion_frame_carry(const struct motion_curve *curve, int64_t from,
                       int64_t to, int64_t tolerance_q62,
                       struct motion_frame *frame)
{
    struct frame_walk walk = { curve, *frame, motion_vec_zero(), from };
    const uint64_t widest =
        ((uint64_t)curve->last - (uint64_t)curve->first) / FRAME_PARTS + 1;
    uint64_t step = widest;
    struct motion_dir t;
    int err;

    if (tolerance_q62 < 1 || tolerance_q62 > FRAME_ONE_Q62 || to < from ||
        from < curve->first || to > curve->last)
        return MOTION_E_ARG;
    const uint64_t tolerance = frame_tolerance(tolerance_q62);
    err = frame_point(curve, from, &walk.pos, &t);
    if (err == MOTION_OK) /* r is the caller's: make it fit */
        err = motion_frame_start(t, frame->r, &walk.frame);
    for (uint32_t i = 0; err == MOTION_OK && walk.u != to; i++) {
        const uint64_t left = (uint64_t)to - (uint64_t)walk.u;
        struct frame_walk next = walk;
        int64_t off = 0;

        if (i == FRAME_STEPS_MAX)
            return MOTION_E_WORK;
        if (step > left)
            step = left;
        err = frame_try(&next, step, &off);
        const uint64_t seen = motion_fixed_abs(off);
        /* a step too wide may meet its tangent reversed: halve that too */
        if (step > 1 && (err == MOTION_E_RANGE || seen > tolerance)) {
            step /= 2;
            err = MOTION_OK;
            continue;
        }
        walk = next;
        if (seen < tolerance / 64)
            step = step < widest / 2 ? 2 * step : widest;
    }
    if (err == MOTION_OK)
        *frame = walk.frame;
    return err;
}

/* twist * weight / whole, the sign of the twist kept */
static int64_t frame_share(int64_t twist, uint64_t weight, uint64_t whole)
{
    uint64_t share = 0;

    (void)motion_fixed_div_u128(
        motion_fixed_mul_u64(motion_fixed_abs(twist), weight), whole, &share,
        NULL);
    return (int64_t)(twist < 0 ? 0 - share : share);
}

int motion_frame_close(struct motion_frame *frame, const uint64_t *weight,
                       uint32_t count, int64_t *twist_turn)
{
    if (count < 2)
        return MOTION_E_EMPTY;

    const struct motion_frame *const last = &frame[count - 1];
    const uint64_t whole = weight != NULL ? weight[count - 1] : count - 1;
    if (whole == 0)
        return MOTION_E_ARG;
    if (!motion_dir_is_near(last->t, frame->t, FRAME_SAME_Q62))
        return MOTION_E_ARG;
    const int64_t twist = motion_frame_twist(frame, last);
    for (uint32_t i = 0; i < count; i++) {
        const uint64_t w = weight != NULL ? weight[i] : i;
        if (w > whole)
            return MOTION_E_ARG;
        motion_frame_turn(&frame[i],
                          motion_trig_diff(0, frame_share(twist, w, whole)));
    }
    if (twist_turn != NULL)
        *twist_turn = twist;
    return MOTION_OK;
}
