/* motion/curve/fcurve_handles.c - handles from their kinds.  See fcurve.h.
 *
 * Each key looks at its two neighbours; the first and the last, at the mirror
 * image of the one they have, or, in a cycle that never ends, at the key across
 * the seam.  In this order: AUTO and CLAMPED; VECTOR; ALIGNED; ends flat. */
#include "motion/curve/fcurve_internal.h"

#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* AUTO handles reach 1/2.5614 of the span: with equal spans and a circle drawn
 * as four keys this is the circle, which is where the number comes from. */
#define FCURVE_REACH    25614
#define FCURVE_REACH_OF 10000

struct fcurve_neighbours {
    struct fcurve_offset before, after; /* from the one before; to the next */
    bool both;                          /* neither is a mirror image */
};

struct motion_real fcurve_difference(int64_t to, int64_t from, int bits)
{
    int64_t whole;

    if (motion_fixed_sub(to, from, &whole) == MOTION_OK)
        return motion_real_from_q(whole, bits);
    return motion_real_sub(motion_real_from_q(to, bits),
                           motion_real_from_q(from, bits));
}

struct fcurve_offset fcurve_get(const struct motion_fcurve_point *handle,
                                const struct motion_fcurve_point *key)
{
    return (struct fcurve_offset){
        fcurve_difference(handle->t_ns_q12, key->t_ns_q12, 0),
        fcurve_difference(handle->pos_q32, key->pos_q32, 32)
    };
}

static int fcurve_shift(int64_t from, struct motion_real by, int bits,
                        int64_t *to)
{
    int64_t whole;
    int rc = motion_real_round(by, bits, &whole);

    return rc == MOTION_OK ? motion_fixed_add(from, whole, to) : rc;
}

int fcurve_put(struct motion_fcurve_point *handle,
               const struct motion_fcurve_point *key,
               struct fcurve_offset offset)
{
    int rc = fcurve_shift(key->t_ns_q12, offset.t, 0, &handle->t_ns_q12);

    if (rc != MOTION_OK)
        return rc;
    return fcurve_shift(key->pos_q32, offset.pos, 32, &handle->pos_q32);
}

static struct fcurve_offset fcurve_stretch(struct fcurve_offset a,
                                           struct motion_real by)
{
    return (struct fcurve_offset){ motion_real_mul(a.t, by),
                                   motion_real_mul(a.pos, by) };
}

/* In the editor's own units: frames and values. */
static struct motion_real fcurve_length(const struct motion_fcurve *curve,
                                        struct fcurve_offset a)
{
    const int64_t frame =
        curve->frame_ns_q12 > 0 ? curve->frame_ns_q12 : MOTION_FIXED_S_Q12 / 24;
    const int64_t value =
        curve->value_q32 > 0 ? curve->value_q32 : MOTION_FIXED_ONE_Q32;
    const struct motion_real x = fcurve_over(a.t, frame);
    const struct motion_real y =
        motion_real_div(a.pos, motion_real_from_q(value, 32));

    return motion_real_sqrt(
        motion_real_add(motion_real_sqr(x), motion_real_sqr(y)));
}

/* A handle of no length counts as one unit long; one shorter than 1e-5 units
 * has no direction to follow. */
struct fcurve_offset fcurve_align(const struct motion_fcurve *curve,
                                  struct fcurve_offset along,
                                  struct fcurve_offset old)
{
    const struct motion_real shortest = fcurve_over(fcurve_whole(1), 100000);
    struct motion_real length = fcurve_length(curve, along);
    struct motion_real keep = fcurve_length(curve, old);

    if (motion_real_is_zero(length))
        length = fcurve_whole(1);
    if (motion_real_is_zero(keep))
        keep = fcurve_whole(1);
    if (motion_real_cmp(length, shortest) <= 0)
        return old;
    return fcurve_stretch(along,
                          motion_real_neg(motion_real_div(keep, length)));
}

static bool fcurve_is_auto(uint8_t kind)
{
    return kind == MOTION_FCURVE_AUTO || kind == MOTION_FCURVE_CLAMPED;
}

static bool fcurve_both_auto(const struct motion_fcurve_key *key)
{
    return fcurve_is_auto(key->left_kind) && fcurve_is_auto(key->right_kind);
}

/* Repeats for ever on both sides, with or without offset: handles see through
 * the seam. */
static bool fcurve_is_cyclic(const struct motion_fcurve *curve)
{
    const struct motion_fcurve_cycles side[2] = { curve->before, curve->after };

    for (int i = 0; i < 2; i++) {
        if (side[i].count != 0)
            return false;
        if (side[i].mode != MOTION_FCURVE_REPEAT &&
            side[i].mode != MOTION_FCURVE_REPEAT_OFFSET)
            return false;
    }
    return fcurve_both_auto(&curve->key[0]) &&
           fcurve_both_auto(&curve->key[curve->count - 1]);
}

static struct fcurve_neighbours
fcurve_neighbours(const struct motion_fcurve *curve, uint32_t i, bool cyclic)
{
    const struct motion_fcurve_key *key = curve->key;
    const uint32_t last = curve->count - 1;
    const bool before = i > 0 || cyclic, after = i < last || cyclic;
    const uint32_t a = i > 0 ? i : last, b = i < last ? i : 0;
    struct fcurve_neighbours near = { .both = before && after };

    if (before)
        near.before = fcurve_get(&key[a].at, &key[a - 1].at);
    if (after)
        near.after = fcurve_get(&key[b + 1].at, &key[b].at);
    if (!before)
        near.before = near.after;
    if (!after)
        near.after = near.before;
    return near;
}

/* How far AUTO handles reach in time.  Without smoothing neither span counts
 * for more than five times the other; with it, a third of the span makes x(u)
 * linear and the span a cubic of time. */
static void fcurve_reach(const struct motion_fcurve *curve,
                         const struct fcurve_neighbours *near,
                         struct motion_real *left, struct motion_real *right)
{
    *left = near->before.t;
    *right = near->after.t;
    if (curve->smoothing != MOTION_FCURVE_SMOOTH_NONE) {
        *left = fcurve_over(*left, 3);
        *right = fcurve_over(*right, 3);
        return;
    }
    *left = motion_real_min(*left, curve_times(*right, 5));
    *right = motion_real_min(*right, curve_times(*left, 5));
    *left = fcurve_over(curve_times(*left, FCURVE_REACH_OF), FCURVE_REACH);
    *right = fcurve_over(curve_times(*right, FCURVE_REACH_OF), FCURVE_REACH);
}

/* A key that is not between its neighbours' values, or level with one. */
static bool fcurve_is_extreme(const struct fcurve_neighbours *near)
{
    return motion_real_sign(near->before.pos) *
               motion_real_sign(near->after.pos) <=
           0;
}

/* Keep a rise towards a neighbour within the neighbour's own; whether it had
 * to be. */
static bool fcurve_clamp(struct motion_real *rise, struct motion_real chord)
{
    if (motion_real_cmp(motion_real_abs(*rise), motion_real_abs(chord)) <= 0)
        return false;
    *rise = chord;
    return true;
}

/* AUTO and CLAMPED handles of one key; the left rises towards the key.  A
 * handle that was clamped turns the other one in line with it, whatever kind
 * that is. */
static void fcurve_auto(const struct motion_fcurve *curve,
                        struct motion_fcurve_key *key,
                        const struct fcurve_neighbours *near,
                        struct fcurve_offset *left, struct fcurve_offset *right)
{
    struct motion_real reach_left, reach_right, slope;
    bool turn_right = false, turn_left = false;
    const bool flat = near->both && fcurve_is_extreme(near);

    fcurve_reach(curve, near, &reach_left, &reach_right);
    slope = motion_real_half(
        motion_real_add(motion_real_div(near->before.pos, near->before.t),
                        motion_real_div(near->after.pos, near->after.t)));
    if (fcurve_is_auto(key->left_kind)) {
        struct motion_real rise = motion_real_mul(slope, reach_left);

        if (near->both && key->left_kind == MOTION_FCURVE_CLAMPED) {
            if (flat)
                rise = motion_real_zero();
            else
                turn_right = fcurve_clamp(&rise, near->before.pos);
            key->settled = key->settled || flat;
        }
        *left = (struct fcurve_offset){ motion_real_neg(reach_left),
                                        motion_real_neg(rise) };
    }
    if (fcurve_is_auto(key->right_kind)) {
        struct motion_real rise = motion_real_mul(slope, reach_right);

        if (near->both && key->right_kind == MOTION_FCURVE_CLAMPED) {
            if (flat)
                rise = motion_real_zero();
            else
                turn_left = fcurve_clamp(&rise, near->after.pos);
            key->settled = key->settled || flat;
        }
        *right = (struct fcurve_offset){ reach_right, rise };
    }
    if (turn_right)
        right->pos =
            motion_real_mul(motion_real_div(left->pos, left->t), right->t);
    else if (turn_left)
        left->pos =
            motion_real_mul(motion_real_div(right->pos, right->t), left->t);
}

/* Both ALIGNED: the left one follows the right one.  Beside a FREE one there is
 * nothing to be in line with. */
static void fcurve_line_up(const struct motion_fcurve *curve,
                           const struct motion_fcurve_key *key,
                           struct fcurve_offset *left,
                           struct fcurve_offset *right)
{
    if (key->left_kind == MOTION_FCURVE_FREE ||
        key->right_kind == MOTION_FCURVE_FREE)
        return;
    if (key->left_kind == MOTION_FCURVE_ALIGNED)
        *left = fcurve_align(curve, *right, *left);
    if (key->right_kind == MOTION_FCURVE_ALIGNED)
        *right = fcurve_align(curve, *left, *right);
}

static struct fcurve_offset fcurve_third(struct fcurve_offset chord,
                                         int64_t sign)
{
    return (struct fcurve_offset){ fcurve_over(chord.t, 3 * sign),
                                   fcurve_over(chord.pos, 3 * sign) };
}

/* A handle may not stand on the wrong side of its key. */
static void fcurve_keep_side(struct fcurve_offset *left,
                             struct fcurve_offset *right)
{
    if (left->t.m > 0)
        left->t = motion_real_zero();
    if (right->t.m < 0)
        right->t = motion_real_zero();
}

static int fcurve_key_handles(struct motion_fcurve *curve, uint32_t i,
                              bool cyclic)
{
    struct motion_fcurve_key *key = &curve->key[i];
    const struct fcurve_neighbours near = fcurve_neighbours(curve, i, cyclic);
    const bool end = i == 0 || i == curve->count - 1;
    struct fcurve_offset left = fcurve_get(&key->left, &key->at);
    struct fcurve_offset right = fcurve_get(&key->right, &key->at);
    int rc;

    key->settled = false;
    fcurve_keep_side(&left, &right);
    fcurve_auto(curve, key, &near, &left, &right);
    if (key->left_kind == MOTION_FCURVE_VECTOR)
        left = fcurve_third(near.before, -1);
    if (key->right_kind == MOTION_FCURVE_VECTOR)
        right = fcurve_third(near.after, 1);
    fcurve_line_up(curve, key, &left, &right);
    if (end && !cyclic && curve->extrapolation == MOTION_FCURVE_HOLD &&
        fcurve_both_auto(key)) {
        left.pos = right.pos = motion_real_zero();
        key->settled = true;
    }
    rc = fcurve_put(&key->left, &key->at, left);
    return rc == MOTION_OK ? fcurve_put(&key->right, &key->at, right) : rc;
}

static int fcurve_check_key(const struct motion_fcurve *curve, uint32_t i)
{
    const struct motion_fcurve_key *key = &curve->key[i];

    if (key->at.t_ns_q12 < -FCURVE_KEY_MAX_NS_Q12 ||
        key->at.t_ns_q12 > FCURVE_KEY_MAX_NS_Q12)
        return MOTION_E_RANGE;
    if (i > 0 && key->at.t_ns_q12 <= key[-1].at.t_ns_q12)
        return MOTION_E_ORDER;
    return key->left_kind > MOTION_FCURVE_CLAMPED ||
                   key->right_kind > MOTION_FCURVE_CLAMPED
               ? MOTION_E_ARG
               : MOTION_OK;
}

/* Flat on one side of the seam is flat on both. */
static void fcurve_close(struct motion_fcurve *curve)
{
    struct motion_fcurve_key *end[2] = { &curve->key[0],
                                         &curve->key[curve->count - 1] };

    if (!end[0]->settled && !end[1]->settled)
        return;
    for (int i = 0; i < 2; i++) {
        end[i]->left.pos_q32 = end[i]->right.pos_q32 = end[i]->at.pos_q32;
        end[i]->settled = true;
    }
}

int motion_fcurve_handles(struct motion_fcurve *curve,
                          struct motion_fcurve_work *work, uint32_t *failed)
{
    const bool smooth = curve->smoothing != MOTION_FCURVE_SMOOTH_NONE;
    uint32_t unused;
    bool cyclic;
    int rc;

    if (!failed)
        failed = &unused;
    *failed = 0;
    if (curve->count == 0)
        return MOTION_E_EMPTY;
    if (smooth && !work)
        return MOTION_E_ARG;
    for (*failed = 0; *failed < curve->count; ++*failed)
        if ((rc = fcurve_check_key(curve, *failed)) != MOTION_OK)
            return rc;
    *failed = 0;
    if (curve->count == 1)
        return MOTION_OK;
    cyclic = fcurve_is_cyclic(curve);
    for (*failed = 0; *failed < curve->count; ++*failed)
        if ((rc = fcurve_key_handles(curve, *failed, cyclic)) != MOTION_OK)
            return rc;
    if (cyclic)
        fcurve_close(curve);
    return smooth ? fcurve_smooth(curve, cyclic, work, failed) : MOTION_OK;
}
