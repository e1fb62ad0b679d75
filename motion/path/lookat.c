/* motion/path/lookat.c - see lookat.h. */
#include "motion/path/lookat.h"

#include <stddef.h>

#include "motion/core/err.h"
#include "motion/curve/interval.h"
#include "motion/number/trig.h"

#define LOOKAT_ONE_Q62  ((int64_t)1 << 62)
#define LOOKAT_POLE_Q62 ((int64_t)1 << 42) /* 2^-20 */

/* --- what is looked at --------------------------------------------------- */

static int lookat_beyond(const struct motion_lookat_path *path,
                         int64_t beyond_q32, struct motion_vec *coi)
{
    struct motion_dir tangent;
    int err = path->at(path->context, path->length_q32, coi, &tangent);

    if (err == MOTION_OK)
        *coi = motion_vec_add(
            *coi, motion_vec_scale(motion_vec_from_dir(tangent),
                                   motion_real_from_q(beyond_q32, 32)));
    return err;
}

static int lookat_ahead(const struct motion_target *target,
                        const struct motion_lookat_path *path,
                        int64_t distance_q32, struct motion_vec *coi)
{
    const int64_t left_q32 = path->length_q32 - distance_q32;
    int64_t at_q32 = path->length_q32;

    if (target->ahead_q32 <= 0)
        return MOTION_E_ARG;
    if (target->ahead_q32 <= left_q32)
        at_q32 = distance_q32 + target->ahead_q32;
    else if (target->end == MOTION_AHEAD_STRAIGHT)
        return lookat_beyond(path, target->ahead_q32 - left_q32, coi);
    else if (target->end == MOTION_AHEAD_CLOSED)
        at_q32 = (target->ahead_q32 - left_q32) % path->length_q32;
    else if (target->end != MOTION_AHEAD_HOLD)
        return MOTION_E_ARG;
    return path->at(path->context, at_q32, coi, NULL);
}

static int lookat_other_path(const struct motion_lookat_path *other,
                             const struct motion_lookat_path *path,
                             int64_t distance_q32, struct motion_vec *coi)
{
    int64_t at_q32;

    if (other == NULL || other->length_q32 <= 0)
        return MOTION_E_ARG;
    if (motion_fixed_muldiv(distance_q32, other->length_q32, path->length_q32,
                            &at_q32) < 0)
        return MOTION_E_RANGE;
    return other->at(other->context, at_q32, coi, NULL);
}

static int64_t lookat_mul(int64_t a_q62, int64_t b_q62, unsigned bits)
{
    int64_t product = 0;

    (void)motion_fixed_mulshift(a_q62, b_q62, bits, &product);
    return product;
}

/* x^2 (3 - 2x), and x^3 (10 - 15x + 6x^2); what is in brackets is below 2^4 */
static int64_t lookat_ease(enum motion_dwell_ease ease, int64_t x_q62)
{
    const int64_t x2 = lookat_mul(x_q62, x_q62, 62);
    const int64_t x_q58 = x_q62 >> 4, one_q58 = LOOKAT_ONE_Q62 >> 4;

    if (ease == MOTION_DWELL_CUBIC)
        return lookat_mul(x2, 3 * one_q58 - 2 * x_q58, 58);
    return lookat_mul(lookat_mul(x2, x_q62, 62),
                      10 * one_q58 - 15 * x_q58 + 6 * (x2 >> 4), 58);
}

/* The last rest that has begun; before all of them the first.  Each look is at
 * a few of them: there may be thousands of looks. */
static const struct motion_dwell *
lookat_find_dwell(const struct motion_target *target, int64_t at_q32)
{
    return &target->dwell[motion_interval_find(&target->dwell->from_q32,
                                               sizeof *target->dwell,
                                               target->dwells, at_q32)];
}

/* It, and where needed the vector to the next. */
static int lookat_dwell(const struct motion_target *target, int64_t at_q32,
                        struct motion_vec *coi)
{
    int64_t x_q62 = 0;
    int err;

    if (target->dwells == 0)
        return MOTION_E_EMPTY;
    if (target->ease > MOTION_DWELL_QUINTIC)
        return MOTION_E_ARG;
    const struct motion_dwell *const d = lookat_find_dwell(target, at_q32);
    const bool is_last = d + 1 == target->dwell + target->dwells;
    if (d->to_q32 < d->from_q32 || (!is_last && d[1].from_q32 <= d->to_q32))
        return MOTION_E_ORDER;
    *coi = motion_vec_from_q32(d->point_q32);
    if (at_q32 <= d->to_q32 || is_last)
        return MOTION_OK;
    err = motion_fixed_muldiv(at_q32 - d->to_q32, LOOKAT_ONE_Q62,
                              d[1].from_q32 - d->to_q32, &x_q62);
    *coi = motion_vec_add(
        *coi, motion_vec_scale(
                  motion_vec_sub(motion_vec_from_q32(d[1].point_q32), *coi),
                  motion_real_from_q(lookat_ease(target->ease, x_q62), 62)));
    return err;
}

int motion_target_at(const struct motion_target *target,
                     const struct motion_lookat_path *path,
                     int64_t distance_q32, struct motion_vec *coi)
{
    if (path->length_q32 <= 0 || distance_q32 < 0 ||
        distance_q32 > path->length_q32)
        return MOTION_E_ARG;
    switch (target->kind) {
    case MOTION_TARGET_FIXED:
        *coi = motion_vec_from_q32(target->point_q32);
        return MOTION_OK;
    case MOTION_TARGET_AHEAD:
        return lookat_ahead(target, path, distance_q32, coi);
    case MOTION_TARGET_PATH:
        return lookat_other_path(target->path, path, distance_q32, coi);
    case MOTION_TARGET_DWELL:
        return lookat_dwell(target, distance_q32, coi);
    }
    return MOTION_E_ARG;
}

/* --- the frame ----------------------------------------------------------- */

/* The direction from a to b went over the vertical: see lookat.h. */
static bool lookat_is_over_pole(struct motion_dir a, struct motion_dir b,
                                struct motion_dir up)
{
    const int64_t high_a = motion_dir_dot_q62(a, up);
    const int64_t high_b = motion_dir_dot_q62(b, up);
    const int64_t both = motion_dir_dot_q62(a, b);
    const struct motion_dir plane = motion_dir_cross(a, b);
    const struct motion_real off =
        motion_real_from_q(motion_dir_dot_q62(plane, up), 62);
    const struct motion_real size =
        motion_vec_length(motion_vec_from_dir(plane));

    /* level parts oppose where a.b < (a.up)(b.up); and both are on the same
     * side, since a.b > 0 */
    return both > 0 && both < lookat_mul(high_a, high_b, 62) &&
           motion_real_cmp(motion_real_abs(off), motion_real_scale(size, -20)) <
               0;
}

/* At the pole: the last right vector, made perpendicular; or the one of a
 * camera that came there from `ahead` (right = ahead x up whichever pole it
 * is). */
static int lookat_at_pole(const struct motion_lookat *lookat,
                          const struct motion_lookat_state *state,
                          struct motion_dir view, struct motion_dir *right)
{
    const struct motion_dir from =
        state->valid ? state->last.right
                     : motion_dir_cross(lookat->ahead, lookat->up);

    if (motion_dir_perpendicular(from, view, right) < 0)
        return MOTION_E_ARG;
    return MOTION_OK;
}

/* Leaving the pole, the sign nearer to the right vector there; else it changes
 * when the view has gone over. */
static bool lookat_is_inverted(const struct motion_lookat *lookat,
                               const struct motion_lookat_state *state,
                               struct motion_dir level, struct motion_dir view)
{
    struct motion_dir was;
    const struct motion_vec last_level = motion_vec_cross(
        motion_vec_from_dir(state->last.view), motion_vec_from_dir(lookat->up));

    if (!state->valid || lookat->pole == MOTION_POLE_UPRIGHT)
        return false;
    if (motion_real_cmp(motion_vec_length(last_level),
                        motion_real_from_q(LOOKAT_POLE_Q62, 62)) < 0 ||
        motion_vec_unit(last_level, &was) < 0)
        return motion_dir_dot_q62(level, state->last.right) < 0;
    return state->inverted !=
           lookat_is_over_pole(state->last.view, view, lookat->up);
}

/* The right vector is taken from the vector itself, which is not yet rounded to a
 * direction: near the vertical that would cost it bits. */
static int lookat_level(const struct motion_lookat *lookat,
                        const struct motion_lookat_state *state,
                        struct motion_vec forward,
                        struct motion_lookat_state *next)
{
    const struct motion_vec level =
        motion_vec_cross(forward, motion_vec_from_dir(lookat->up));
    const struct motion_real pole = motion_real_mul(
        motion_vec_length(forward), motion_real_from_q(LOOKAT_POLE_Q62, 62));
    struct motion_dir right;

    if (motion_real_cmp(motion_vec_length(level), pole) < 0) {
        next->inverted = state->inverted;
        return lookat_at_pole(lookat, state, next->last.view,
                              &next->last.right);
    }
    (void)motion_vec_unit(level, &right); /* not zero: above */
    next->inverted = lookat_is_inverted(lookat, state, right, next->last.view);
    next->last.right = next->inverted ? motion_dir_neg(right) : right;
    return MOTION_OK;
}

static int lookat_frame(const struct motion_lookat *lookat,
                        struct motion_lookat_state *state,
                        struct motion_vec forward, int64_t tilt_turn,
                        struct motion_view *view)
{
    struct motion_lookat_state next = { .valid = true };
    int64_t s, c;
    int err;

    if (motion_vec_unit(forward, &next.last.view) < 0)
        return MOTION_E_RANGE;
    err = lookat_level(lookat, state, forward, &next);
    if (err < 0)
        return err;
    next.last.up = motion_dir_cross(next.last.right, next.last.view);
    *state = next;
    *view = next.last;
    motion_trig_sincos(tilt_turn, &s, &c);
    view->right = motion_dir_turn(next.last.right, next.last.view, s, c);
    view->up = motion_dir_cross(view->right, view->view);
    return MOTION_OK;
}

int motion_lookat_at(const struct motion_lookat *lookat,
                     struct motion_lookat_state *state,
                     const struct motion_target *target,
                     const struct motion_lookat_path *path,
                     int64_t distance_q32, int64_t tilt_turn,
                     struct motion_view *view)
{
    struct motion_vec pos, coi, forward;
    struct motion_dir tangent;
    int err = motion_target_at(target, path, distance_q32, &coi);

    if (err < 0)
        return err;
    err = path->at(path->context, distance_q32, &pos, &tangent);
    if (err < 0)
        return err;
    forward = motion_vec_sub(coi, pos);
    if (target->kind == MOTION_TARGET_AHEAD &&
        motion_real_is_zero(motion_vec_length(forward)))
        forward = motion_vec_from_dir(tangent);
    return lookat_frame(lookat, state, forward, tilt_turn, view);
}

struct motion_quat motion_view_quat(const struct motion_view *view)
{
    const struct motion_dir axis[3] = { view->right, view->up,
                                        motion_dir_neg(view->view) };
    struct motion_quat q = MOTION_QUAT_ONE;

    (void)motion_quat_from_axes(axis, &q); /* a view is right-handed */
    return q;
}
