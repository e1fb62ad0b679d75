/* motion/plan/keys/bezier.c - keys with handles, on their way to a track.  See
 * move_internal.h.
 *
 * All keys of the axis are one curve of motion/curve/fcurve.h, whatever the
 * curves of its spans, so that an automatic handle sees its neighbours; of that
 * curve the bezier spans are appended. */
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/keys/move_internal.h"

/* Positions are baked to 2^-34 of the range, rounded down to three bits so that
 * the spans of keys that stay are planned as before when one moves; or 2^-28
 * unit where that is more: 0.06 nm, 16 times what the track rounds. */
#define BEZIER_WITHIN_OF_RANGE -34
#define BEZIER_WITHIN_LEAST    -28

/* ELASTIC misses its far key by 2^-10 of the swing, which is spread over the
 * span. */
#define BEZIER_ELASTIC -9

/* A cycle of a microsecond, repeated for days, would fill any memory. */
#define BEZIER_SPAN         64 /* segments, as a rule */
#define BEZIER_SEGMENTS_MAX (1u << 23)

static const struct plan_bezier_key bezier_default = {
    .left.kind = MOTION_FCURVE_CLAMPED,
    .right.kind = MOTION_FCURVE_CLAMPED,
    .interpolation = MOTION_FCURVE_BEZIER,
};

bool move_is_bezier(const struct plan_axis *axis)
{
    const uint32_t spans = axis->key_count > 1 ? axis->key_count - 1 : 1;

    for (uint32_t i = 0; i < spans && axis->key_count > 0; i++)
        if (move_curve_at(axis, i) != PLAN_CURVE_BEZIER)
            return false;
    return axis->key_count > 0;
}

/* --- another scale -------------------------------------------------------- */

static int bezier_scale(int64_t *value_q32, struct motion_real by)
{
    return motion_real_round(
        motion_real_mul(motion_real_from_q(*value_q32, 32), by), 32, value_q32);
}

int plan_bezier_copy(struct plan_bezier *bezier, uint32_t count,
                     struct motion_real by)
{
    const struct plan_bezier_key *from = bezier->key;
    int rc = bezier_scale(&bezier->value_q32, by);

    bezier->key = NULL;
    if (from == NULL || rc != MOTION_OK)
        return rc;
    bezier->key = malloc(count * sizeof *from);
    if (bezier->key == NULL)
        return MOTION_E_FULL;
    for (uint32_t i = 0; i < count && rc == MOTION_OK; i++) {
        struct plan_bezier_key *key = &bezier->key[i];

        *key = from[i];
        rc = bezier_scale(&key->left.dp_q32, by);
        if (rc == MOTION_OK)
            rc = bezier_scale(&key->right.dp_q32, by);
        if (rc == MOTION_OK)
            rc = bezier_scale(&key->amplitude_q32, by);
    }
    if (rc == MOTION_OK)
        return rc;
    free(bezier->key);
    bezier->key = NULL;
    return rc;
}

/* --- judging -------------------------------------------------------------- */

int move_bezier_check(const struct move *move)
{
    const struct plan_bezier *bezier = &move->axis->bezier;

    if (bezier->smoothing > MOTION_FCURVE_SMOOTH_ACCELERATION ||
        bezier->extrapolation > MOTION_FCURVE_LINE ||
        bezier->before.mode > MOTION_FCURVE_MIRROR ||
        bezier->after.mode > MOTION_FCURVE_MIRROR)
        return move_fail_axis(move, MOTION_E_ARG,
                              "there is no such smoothing, extrapolation or "
                              "cycle");
    if (!move->is_bezier && bezier->extrapolation != MOTION_FCURVE_HOLD)
        return move_fail_axis(move, MOTION_E_ARG,
                              "extrapolation needs curve bezier on all spans");
    return move_has_cycles(move->axis) ? move_cycles_check(move) : MOTION_OK;
}

/* --- handles -------------------------------------------------------------- */

static int bezier_point(const struct motion_key *key,
                        const struct plan_handle *handle,
                        struct motion_fcurve_point *point)
{
    int rc =
        motion_fixed_add(key->t_ns_q12, handle->dt_ns_q12, &point->t_ns_q12);

    if (rc != MOTION_OK)
        return rc;
    return motion_fixed_add(key->pos_q32, handle->dp_q32, &point->pos_q32);
}

static int bezier_key(const struct motion_key *key,
                      const struct plan_bezier_key *from,
                      struct motion_fcurve_key *to)
{
    int rc;

    *to = (struct motion_fcurve_key){
        .at = { key->t_ns_q12, key->pos_q32 },
        .left_kind = from->left.kind,
        .right_kind = from->right.kind,
        .interpolation = from->interpolation,
        .easing = from->easing,
        .back_q32 = from->back_q32,
        .amplitude_q32 = from->amplitude_q32,
        .period_ns_q12 = from->period_ns_q12,
    };
    rc = bezier_point(key, &from->left, &to->left);
    return rc == MOTION_OK ? bezier_point(key, &from->right, &to->right) : rc;
}

static bool bezier_key_exists(const struct plan_bezier_key *key)
{
    return key->interpolation <= MOTION_FCURVE_ELASTIC &&
           key->easing <= MOTION_FCURVE_IN_OUT &&
           key->left.kind <= MOTION_FCURVE_CLAMPED &&
           key->right.kind <= MOTION_FCURVE_CLAMPED;
}

static int bezier_fill(struct move *move)
{
    const struct plan_bezier *bezier = &move->axis->bezier;

    for (uint32_t i = 0; i < move->handles.count; i++) {
        const struct plan_bezier_key *from =
            bezier->key ? &bezier->key[i] : &bezier_default;

        if (!bezier_key_exists(from))
            return move_fail_key(move, MOTION_E_ARG, i,
                                 "there is no such handle, interpolation or "
                                 "easing");
        if (bezier_key(&move->key[i], from, &move->handles.key[i]) != MOTION_OK)
            return move_fail_key(move, MOTION_E_RANGE, i,
                                 "a handle is beyond the range of positions "
                                 "or times");
    }
    return MOTION_OK;
}

int move_bezier_handles(struct move *move)
{
    const struct plan_bezier *bezier = &move->axis->bezier;
    const uint32_t count = move->axis->key_count;
    struct motion_fcurve_work *work = NULL;
    uint32_t failed = 0;
    int rc;

    move->handles = (struct motion_fcurve){
        .key = calloc(count, sizeof *move->handles.key),
        .count = count,
        .smoothing = bezier->smoothing,
        .extrapolation = bezier->extrapolation,
        .before = bezier->before,
        .after = bezier->after,
        .frame_ns_q12 = bezier->frame_ns_q12,
        .value_q32 = bezier->value_q32,
    };
    if (bezier->smoothing != MOTION_FCURVE_SMOOTH_NONE)
        work = calloc(count, sizeof *work);
    if (move->handles.key == NULL ||
        (work == NULL && bezier->smoothing != MOTION_FCURVE_SMOOTH_NONE)) {
        free(work);
        return move_fail_axis(move, MOTION_E_FULL, "no memory for %u keys",
                              (unsigned)count);
    }
    rc = bezier_fill(move);
    if (rc == MOTION_OK) {
        rc = motion_fcurve_handles(&move->handles, work, &failed);
        if (rc != MOTION_OK)
            rc = move_fail_key(move, rc, failed,
                               "a handle is beyond the range of positions or "
                               "times");
    }
    free(work);
    return rc;
}

int plan_bezier_curve(const struct plan_axis *axis, struct motion_fcurve *curve)
{
    struct plan_error error;
    struct move move = { .axis = axis, .is_bezier = true, .error = &error };
    int rc = MOTION_E_FULL;

    move.key = calloc(axis->key_count, sizeof *move.key);
    if (move.key != NULL) {
        for (uint32_t i = 0; i < axis->key_count; i++)
            move.key[i] = axis->key[i].key;
        rc = move_bezier_handles(&move);
    }
    free(move.key);
    if (rc != MOTION_OK) {
        free(move.handles.key);
        move.handles.key = NULL;
    }
    *curve = move.handles;
    return rc;
}

/* --- where another curve begins or ends ----------------------------------- */

/* The handle on the bezier's side of key i. */
static struct motion_fcurve_point *bezier_handle(struct move *move, uint32_t i,
                                                 bool left)
{
    struct motion_fcurve_key *key = &move->handles.key[i];

    return left ? &key->left : &key->right;
}

static bool bezier_is_automatic(const struct move *move, uint32_t i, bool left)
{
    const struct motion_fcurve_key *key = &move->handles.key[i];
    const uint8_t kind = left ? key->left_kind : key->right_kind;
    const uint8_t span = move->handles.key[left ? i - 1 : i].interpolation;

    return span == MOTION_FCURVE_BEZIER &&
           (kind == MOTION_FCURVE_AUTO || kind == MOTION_FCURVE_CLAMPED);
}

/* Turn an automatic handle; it keeps its length in time. */
static int bezier_turn(struct move *move, uint32_t i, bool left)
{
    const struct motion_fcurve_key *key = &move->handles.key[i];
    struct motion_fcurve_point *handle = bezier_handle(move, i, left);
    const int64_t dt = handle->t_ns_q12 - key->at.t_ns_q12;
    const struct motion_real rise =
        motion_real_div(motion_real_mul(move->key[i].vel, motion_real_int(dt)),
                        motion_real_int(MOTION_FIXED_S_Q12));
    int64_t dp;

    if (motion_real_round(rise, 32, &dp) == MOTION_OK &&
        motion_fixed_add(key->at.pos_q32, dp, &handle->pos_q32) == MOTION_OK)
        return MOTION_OK;
    return move_fail_key(move, MOTION_E_RANGE, i,
                         "its handle is beyond the range of positions");
}

int move_bezier_pin(struct move *move, uint32_t i, bool fifth)
{
    const bool left = move_curve_at(move->axis, i - 1) == PLAN_CURVE_BEZIER;
    const enum motion_fcurve_side side =
        left ? MOTION_FCURVE_LEFT : MOTION_FCURVE_RIGHT;
    const bool automatic = bezier_is_automatic(move, i, left);
    struct motion_fcurve_value value;
    int rc = automatic ? bezier_turn(move, i, left) : MOTION_OK;

    if (rc != MOTION_OK)
        return rc;
    if (move->axis->key[i].key.has_acc)
        return move_fail_key(move, MOTION_E_ARG, i,
                             "acceleration is given, but bezier cannot keep "
                             "it");
    rc = motion_fcurve_at(&move->handles, move->key[i].t_ns_q12, side, &value);
    if (rc != MOTION_OK || value.steep)
        return move_fail_key(move, rc ? rc : MOTION_E_SINGULAR, i,
                             "the velocity of bezier is infinite there, which "
                             "no machine can follow");
    if (!automatic)
        rc = move_tell(move, i, left, value.vel);
    if (fifth) {
        move->key[i].has_acc = true;
        move->key[i].acc = value.acc;
    }
    return rc;
}

/* --- appending ------------------------------------------------------------ */

static int64_t bezier_end(const struct move *move)
{
    const struct plan_bezier *bezier = &move->axis->bezier;
    const struct motion_fcurve *curve = &move->handles;
    const int64_t first = curve->key[0].at.t_ns_q12;
    const int64_t last = curve->key[curve->count - 1].at.t_ns_q12;
    int64_t laps;

    if (bezier->has_end)
        return bezier->end_ns_q12;
    if (bezier->after.mode == MOTION_FCURVE_ONCE)
        return last;
    if (motion_fixed_muldiv(last - first, bezier->after.count, 1, &laps) < 0 ||
        motion_fixed_add(last, laps, &laps) < 0)
        return INT64_MAX;
    return laps;
}

#define BEZIER_SIZE_UNIT ((int64_t)1 << 59) /* of 2^61 .. 2^62 */

static struct motion_real bezier_size(const struct motion_fcurve *curve)
{
    int64_t low = INT64_MAX, high = INT64_MIN;

    for (uint32_t i = 0; i < curve->count; i++) {
        const int64_t pos = curve->key[i].at.pos_q32;
        low = pos < low ? pos : low;
        high = pos > high ? pos : high;
    }
    struct motion_real size = motion_real_sub(motion_real_from_q(high, 32),
                                              motion_real_from_q(low, 32));
    size.m -= size.m % BEZIER_SIZE_UNIT;
    return size;
}

/* The most that an elastic span swings: its change, or its amplitude. */
static struct motion_real bezier_swing(const struct motion_fcurve *curve,
                                       struct motion_real size)
{
    for (uint32_t i = 0; i < curve->count; i++)
        if (curve->key[i].interpolation == MOTION_FCURVE_ELASTIC)
            size = motion_real_max(
                size, motion_real_from_q(curve->key[i].amplitude_q32, 32));
    return size;
}

static struct motion_fcurve_range bezier_range(const struct move *move,
                                               int64_t from, int64_t to)
{
    const struct motion_real size = bezier_size(&move->handles);

    return (struct motion_fcurve_range){
        .from_ns_q12 = from,
        .to_ns_q12 = to,
        .within.pos =
            motion_real_max(motion_real_scale(size, BEZIER_WITHIN_OF_RANGE),
                            motion_real_make(1, BEZIER_WITHIN_LEAST)),
        .within.vel = motion_real_zero(),
        .within.acc = motion_real_zero(),
        .step = motion_real_scale(bezier_swing(&move->handles, size),
                                  BEZIER_ELASTIC),
    };
}

static bool bezier_repeats(const struct motion_fcurve *curve)
{
    return curve->before.mode == MOTION_FCURVE_REPEAT ||
           curve->after.mode == MOTION_FCURVE_REPEAT;
}

static bool bezier_ends(const struct motion_fcurve *curve)
{
    return (curve->before.mode != MOTION_FCURVE_ONCE && curve->before.count) ||
           (curve->after.mode != MOTION_FCURVE_ONCE && curve->after.count);
}

/* Why the curve steps at the key that motion_fcurve_append names. */
static int bezier_fail_step(const struct move *move, uint32_t key)
{
    const struct motion_fcurve *curve = &move->handles;
    const struct motion_fcurve_key *at = &curve->key[key];
    const uint32_t last = curve->count - 1;
    const bool end = key == 0 || key == last;
    const bool apart = curve->key[0].at.pos_q32 != curve->key[last].at.pos_q32;

    if (key > 0 && at[-1].interpolation == MOTION_FCURVE_CONSTANT &&
        at[-1].at.pos_q32 != at->at.pos_q32)
        return move_fail_key(
            move, MOTION_E_DISCONTINUITY, key,
            "constant keeps %.9g until here, where it would jump by %.9g, "
            "which no machine can",
            move_units(at[-1].at.pos_q32),
            move_units(at->at.pos_q32) - move_units(at[-1].at.pos_q32));
    if (end && apart && bezier_repeats(curve))
        return move_fail_key(move, MOTION_E_DISCONTINUITY, key,
                             "a cycle would jump here, as it does not end "
                             "where it starts; repeat-offset would not");
    if (end && bezier_ends(curve) &&
        (apart || curve->extrapolation == MOTION_FCURVE_LINE))
        return move_fail_key(move, MOTION_E_DISCONTINUITY, key,
                             "where its cycles end it would jump back to this "
                             "key, expected an earlier until or more cycles");
    return move_fail_key(move, MOTION_E_DISCONTINUITY, key,
                         "the curve would jump here, which no machine can");
}

static int bezier_fail_full(const struct move *move)
{
    return move_fail_axis(move, MOTION_E_FULL, "takes more than %u segments",
                          BEZIER_SEGMENTS_MAX);
}

static int bezier_fail(const struct move *move, int code, uint32_t key)
{
    if (code == MOTION_E_DISCONTINUITY)
        return bezier_fail_step(move, key);
    if (code == MOTION_E_SINGULAR || code == MOTION_E_TOLERANCE)
        return move_fail_key(move, code, key,
                             "the velocity or acceleration is infinite, or too "
                             "steep, which no machine can follow");
    if (code == MOTION_E_FULL)
        return bezier_fail_full(move);
    return move_fail_key(
        move, code, key,
        "the displacement beside it is beyond the range of position, "
        "velocity, acceleration or time");
}

/* All or nothing, so room is made and it is tried again. */
static int bezier_append_range(const struct move *move,
                               const struct motion_fcurve_range *range)
{
    struct motion_fcurve_report report;
    uint32_t capacity = BEZIER_SPAN;
    int rc;

    do {
        rc = move_grow(move, capacity);
        if (rc != MOTION_OK)
            return rc;
        rc = motion_fcurve_append(move->track, &move->handles, range, &report);
        capacity *= 2;
    } while (rc == MOTION_E_FULL && capacity < BEZIER_SEGMENTS_MAX);
    if (rc == MOTION_OK && move->track->count > BEZIER_SEGMENTS_MAX)
        return bezier_fail_full(move);
    return rc == MOTION_OK ? MOTION_OK : bezier_fail(move, rc, report.failed);
}

static void bezier_add_point(const struct move *move,
                             struct motion_fcurve_point point)
{
    move_memo_add(move, point.t_ns_q12);
    move_memo_add(move, point.pos_q32);
}

static void bezier_add_key(const struct move *move,
                           const struct motion_fcurve_key *key)
{
    bezier_add_point(move, key->at);
    bezier_add_point(move, key->left);
    bezier_add_point(move, key->right);
    move_memo_add(move, key->interpolation);
    move_memo_add(move, key->easing);
    move_memo_add(move, key->back_q32);
    move_memo_add(move, key->amplitude_q32);
    move_memo_add(move, key->period_ns_q12);
}

/* The two keys of the span and, as the pieces of an easing equation are joined
 * to what is beside them, or nothing is before or after it, the one before and
 * the one after; and how close it is baked. */
static void bezier_add(const struct move *move, uint32_t key,
                       const struct motion_fcurve_range *range)
{
    const struct motion_fcurve *curve = &move->handles;
    const bool alone = curve->key[key].interpolation == MOTION_FCURVE_BEZIER &&
                       range->from_ns_q12 >= curve->key[key].at.t_ns_q12 &&
                       key + 1 < curve->count;

    for (uint32_t i = alone ? 1 : 0; i < (alone ? 3 : 4); i++)
        if (key + i >= 1 && key + i - 1 < curve->count)
            bezier_add_key(move, &curve->key[key + i - 1]);
        else
            move_memo_add(move, i);
    move_memo_add(move, range->from_ns_q12);
    move_memo_add(move, range->to_ns_q12);
    move_memo_add_real(move, range->within.pos);
    move_memo_add_real(move, range->within.vel);
    move_memo_add_real(move, range->within.acc);
    move_memo_add_real(move, range->step);
}

/* The span from key `key`, or one that was planned before. */
static int bezier_append_span(const struct move *move, uint32_t key,
                              const struct motion_fcurve_range *range)
{
    struct plan_memo_span span;
    int rc;

    if (move->memo == NULL)
        return bezier_append_range(move, range);
    move_memo_begin(move, PLAN_CURVE_BEZIER, 1, &span);
    bezier_add(move, key, range);
    if (!move_memo_recall(move, &span)) {
        rc = bezier_append_range(move, range);
        if (rc != MOTION_OK)
            return rc;
    }
    return move_memo_keep(move, &span);
}

static bool bezier_is_once(const struct motion_fcurve *curve)
{
    return curve->before.mode == MOTION_FCURVE_ONCE &&
           curve->after.mode == MOTION_FCURVE_ONCE;
}

/* Span by span: it is cut at every key anyway.  Cycles in one piece. */
static int bezier_append(const struct move *move, int64_t from, int64_t to)
{
    const struct motion_fcurve *curve = &move->handles;
    struct motion_fcurve_range range = bezier_range(move, from, to);
    uint32_t key = 0; /* the first at or after `from`, and those after it */
    int rc = MOTION_OK;

    if (!bezier_is_once(curve))
        return bezier_append_range(move, &range);
    while (key < curve->count && curve->key[key].at.t_ns_q12 <= from)
        key++;
    for (; rc == MOTION_OK && range.from_ns_q12 < to; key++) {
        range.to_ns_q12 = key < curve->count && curve->key[key].at.t_ns_q12 < to
                              ? curve->key[key].at.t_ns_q12
                              : to;
        rc = bezier_append_span(move, key > 0 ? key - 1 : 0, &range);
        range.from_ns_q12 = range.to_ns_q12;
    }
    return rc;
}

int move_bezier_append(const struct move *move, uint32_t from, uint32_t to)
{
    return bezier_append(move, move->key[from].t_ns_q12,
                         move->key[to].t_ns_q12);
}

/* Cycles alone take more segments than there may be. */
static bool bezier_is_endless(const struct motion_fcurve *curve, int64_t end)
{
    const int64_t first = curve->key[0].at.t_ns_q12;
    const int64_t period = curve->key[curve->count - 1].at.t_ns_q12 - first;
    const int64_t from = first < 0 ? first : 0;

    if (period == 0 || bezier_is_once(curve))
        return false;
    return (end - from) / period > BEZIER_SEGMENTS_MAX / curve->count;
}

int move_bezier_append_all(const struct move *move)
{
    const int64_t end = bezier_end(move);
    struct motion_fcurve_value start;
    int64_t pos;
    int rc = motion_fcurve_at(&move->handles, 0, MOTION_FCURVE_AT, &start);

    if (rc == MOTION_OK)
        rc = motion_real_round(start.pos, 32, &pos);
    if (rc != MOTION_OK || end > MOTION_TRACK_MAX_NS_Q12)
        return move_fail_axis(move, MOTION_E_RANGE,
                              "it starts beyond the range of positions or "
                              "ends after %.9g s",
                              move_seconds(MOTION_TRACK_MAX_NS_Q12));
    if (bezier_is_endless(&move->handles, end))
        return bezier_fail_full(move);
    motion_track_init(move->track, NULL, 0, pos);
    return end > 0 ? bezier_append(move, 0, end) : MOTION_OK;
}
