/* motion/plan/move.c - see move.h.
 *
 * An axis goes through three steps: its keys are judged one by one (so that an
 * error names the first key that is wrong), copied with missing velocities and
 * accelerations filled in, and appended to a track that grows as needed and is
 * cut to size at the end. */
#include "motion/plan/move.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/bake_poly.h"
#include "motion/plan/keys/move_internal.h"

#define MOVE_END(rule) (1u << MOTION_SPLINE_##rule)
#define MOVE_SIMPLE    (MOVE_END(REST) | MOVE_END(ONE_SIDED))
#define MOVE_TANGENT   (MOVE_SIMPLE | MOVE_END(NATURAL))

/* In the order of PLAN_CURVE_LIST. */
static const struct plan_curve_rules move_rules[] = {
    { "linear", PLAN_NO, PLAN_NO, .ends = 0, .own = true },
    { "rounded", PLAN_NO, PLAN_NO, MOVE_SIMPLE, .blend = true, .own = true },
    { "smoothed", PLAN_NO, PLAN_NO, MOVE_SIMPLE, .blend = true, .own = true },
    { "parabolic", PLAN_ZERO, PLAN_NO, .ease = true, .own = true },
    { "sine", PLAN_ZERO, PLAN_NO, .ease = true, .own = true },
    { "s-curve", PLAN_ZERO, PLAN_ZERO, .ease = true, .own = true },
    { "hermite", PLAN_MUST, PLAN_NO, .ends = 0 },
    { "catmull-rom", PLAN_MAY, PLAN_NO, MOVE_TANGENT, .mu = false },
    { "cardinal", PLAN_MAY, PLAN_NO, MOVE_TANGENT, .mu = true },
    { "kochanek-bartels", PLAN_MAY, PLAN_NO, MOVE_TANGENT, .shape = true },
    { "monotone", PLAN_MAY, PLAN_NO, MOVE_SIMPLE, .mu = false },
    { "akima", PLAN_MAY, PLAN_NO, MOVE_SIMPLE, .mu = false },
    { "akima-monotone", PLAN_MAY, PLAN_NO, MOVE_SIMPLE, .mu = false },
    { "c2", PLAN_MAY, PLAN_MAY,
      MOVE_END(REST) | MOVE_END(NATURAL) | MOVE_END(NOT_A_KNOT) |
          MOVE_END(PERIODIC),
      .mu = false },
    { "quintic", PLAN_MAY, PLAN_MAY, MOVE_TANGENT, .mu = false },
    { "c4", PLAN_MAY, PLAN_MAY, MOVE_END(REST) | MOVE_END(NOT_A_KNOT),
      .mu = false },
    { "constraints", PLAN_MAY, PLAN_MAY, .ends = 0 },
    { "b-spline", PLAN_NO, PLAN_NO, MOVE_END(REST) | MOVE_END(NATURAL),
      .mu = false },
    { "lagrange", PLAN_NO, PLAN_NO, .ends = 0, .own = true },
    { "bezier", PLAN_NO, PLAN_NO, .handles = true, .own = true },
};

#define MOVE_CURVES (sizeof move_rules / sizeof move_rules[0])

const struct plan_curve_rules *plan_curve_rules(enum plan_curve curve)
{
    return (size_t)curve < MOVE_CURVES ? &move_rules[curve] : NULL;
}

double move_seconds(int64_t t_ns_q12)
{
    return (double)t_ns_q12 / (double)MOTION_FIXED_S_Q12;
}

double move_units(int64_t a_q32)
{
    return (double)a_q32 / (double)MOTION_FIXED_ONE_Q32;
}

/* As the user counts, from 0. */
static uint32_t move_number(const struct move *move, uint32_t key)
{
    return move->number != NULL ? move->number[key] : key;
}

int move_fail_key(const struct move *move, int code, uint32_t key,
                  const char *format, ...)
{
    struct plan_error *error = move->error;
    const struct plan_axis *axis = move->axis;
    const uint32_t number = move_number(move, key);
    va_list args;
    int used;

    *error = (struct plan_error){ .code = code,
                                  .key = number,
                                  .place = axis->key[key].place };
    used = snprintf(error->text, sizeof error->text,
                    "key %u of axis %.*s: ", (unsigned)number + 1,
                    PLAN_NAME_MAX, axis->name);
    va_start(args, format);
    vsnprintf(error->text + used, sizeof error->text - (size_t)used, format,
              args);
    va_end(args);
    return code;
}

int move_fail_axis(const struct move *move, int code, const char *format, ...)
{
    struct plan_error *error = move->error;
    va_list args;
    int used;

    *error = (struct plan_error){ .code = code, .place = move->axis->place };
    used = snprintf(error->text, sizeof error->text,
                    "axis %.*s: ", PLAN_NAME_MAX, move->axis->name);
    va_start(args, format);
    vsnprintf(error->text + used, sizeof error->text - (size_t)used, format,
              args);
    va_end(args);
    return code;
}

bool move_is_rest(enum plan_curve curve)
{
    return curve == PLAN_CURVE_PARABOLIC || curve == PLAN_CURVE_SINE ||
           curve == PLAN_CURVE_SCURVE;
}
int move_grow(const struct move *move, uint32_t more)
{
    struct motion_track *track = move->track;
    struct motion_segment *segment;
    const size_t need = (size_t)track->count + more;
    size_t capacity = track->capacity;

    if (need <= capacity)
        return MOTION_OK;
    capacity = capacity * 2 > need ? capacity * 2 : need;
    segment = realloc(track->segment, capacity * sizeof *segment);
    if (segment == NULL)
        return move_fail_axis(move, MOTION_E_FULL, "no memory for %zu segments",
                              capacity);
    track->segment = segment;
    track->capacity = (uint32_t)capacity;
    return MOTION_OK;
}

static void move_trim(struct motion_track *track)
{
    const size_t size = track->count * sizeof *track->segment;
    struct motion_segment *segment = realloc(track->segment, size ? size : 1);

    if (segment != NULL) {
        track->segment = segment;
        track->capacity = track->count;
    }
}

static int move_fail_span(const struct move *move, int code, uint32_t span)
{
    return move_fail_key(
        move, code, span + 1,
        "the displacement from key %u at %.9g s is beyond the range of "
        "position, velocity or acceleration",
        (unsigned)move_number(move, span) + 1,
        move_seconds(move->key[span].t_ns_q12));
}

static int move_append_ease(const struct move *move, enum plan_curve curve,
                            uint32_t i)
{
    const enum motion_ease_law law = curve == PLAN_CURVE_SINE ? MOTION_EASE_SINE
                                     : curve == PLAN_CURVE_SCURVE
                                         ? MOTION_EASE_SCURVE
                                         : MOTION_EASE_PARABOLIC;
    const union plan_shape shape = move_shape_at(move->axis, i);
    const struct motion_key *key = &move->key[i];
    int rc = move_grow(move, MOTION_EASE_SEGMENTS);

    if (rc != MOTION_OK)
        return rc;
    rc = motion_ease_append(move->track, law, key[1].pos_q32,
                            key[1].t_ns_q12 - key[0].t_ns_q12,
                            shape.ease.k1_q32, shape.ease.k2_q32);
    return rc == MOTION_OK ? MOTION_OK : move_fail_span(move, rc, i);
}

static int move_append_rest(const struct move *move, const struct move_run *run)
{
    int rc = MOTION_OK;

    for (uint32_t i = run->from;
         rc == MOTION_OK && i + 1 < run->from + run->count; i++)
        rc = move_append_ease(move, run->curve, i);
    return rc;
}

/* The most segments that a run takes. */
static uint32_t move_capacity(const struct move_run *run)
{
    if (run->curve == PLAN_CURVE_LAGRANGE && run->count > 6)
        return run->count * MOTION_BAKE_POLY_PIECES;
    return move_is_straight(run->curve) ? 2 * run->count : run->count - 1;
}

static int move_append_spline(const struct move *move,
                              const struct move_run *run, uint32_t *span)
{
    const struct motion_key *key = &move->key[run->from];
    struct motion_track *track = move->track;

    switch (run->curve) {
    case PLAN_CURVE_LINEAR:
        return motion_spline_append_linear(track, key, run->count, span);
    case PLAN_CURVE_ROUNDED:
    case PLAN_CURVE_SMOOTHED:
        return motion_spline_append_blended(
            track, key, run->count, run->shape.blend_ns_q12,
            run->curve == PLAN_CURVE_SMOOTHED, run->first, run->last, span);
    case PLAN_CURVE_KOCHANEK:
        return motion_spline_append_kochanek(track, key, run->count,
                                             &run->shape.tcb, run->first,
                                             run->last, span);
    case PLAN_CURVE_QUINTIC:
    case PLAN_CURVE_C4:
        return motion_spline_append_quintic(track, key, run->count, span);
    case PLAN_CURVE_CONSTRAINTS:
        return motion_spline_append_constraints(track, key, run->count, span);
    case PLAN_CURVE_BSPLINE:
        return motion_spline_append_bspline(track, key, run->count, run->first,
                                            run->last, span);
    case PLAN_CURVE_LAGRANGE:
        return motion_spline_append_lagrange(track, key, run->count, NULL,
                                             span);
    default:
        return motion_spline_append_cubic(track, key, run->count, span);
    }
}

static int move_append_plain(const struct move *move,
                             const struct move_run *run)
{
    uint32_t span = 0;
    int rc;

    if (move_is_rest(run->curve))
        return move_append_rest(move, run);
    rc = move_grow(move, move_capacity(run));
    if (rc != MOTION_OK)
        return rc;
    rc = move_append_spline(move, run, &span);
    return rc == MOTION_OK ? MOTION_OK
                           : move_fail_span(move, rc, run->from + span);
}

/* Everything that move_append_plain looks at. */
static void move_add(const struct move *move, const struct move_run *run)
{
    const union plan_shape shape = move_shape_at(move->axis, run->from);

    if (move_is_rest(run->curve)) {
        move_memo_add(move, shape.ease.k1_q32);
        move_memo_add(move, shape.ease.k2_q32);
    } else if (run->curve == PLAN_CURVE_KOCHANEK) {
        move_memo_add(move, run->shape.tcb.tension_q32);
        move_memo_add(move, run->shape.tcb.continuity_q32);
        move_memo_add(move, run->shape.tcb.bias_q32);
    } else if (move_is_straight(run->curve)) {
        move_memo_add(move, run->shape.blend_ns_q12);
    }
    move_memo_add(move, run->first);
    move_memo_add(move, run->last);
    for (uint32_t i = run->from; i < run->from + run->count; i++) {
        const struct motion_key *key = &move->key[i];
        move_memo_add(move, key->t_ns_q12);
        move_memo_add(move, key->pos_q32);
        move_memo_add(move, key->has_vel);
        move_memo_add_real(move, key->vel);
        move_memo_add(move, key->has_acc);
        move_memo_add_real(move, key->acc);
    }
}

/* A run, or one that was planned before. */
static int move_append_kept(const struct move *move, const struct move_run *run)
{
    struct plan_memo_span span;
    int rc;

    move_memo_begin(move, run->curve, run->count - 1, &span);
    move_add(move, run);
    rc = move_memo_recall(move, &span) ? MOTION_OK
                                       : move_append_plain(move, run);
    return rc == MOTION_OK ? move_memo_keep(move, &span) : rc;
}

/* Does a span of it follow from its two keys, once these are filled in? */
static bool move_is_local(enum plan_curve curve)
{
    return curve != PLAN_CURVE_ROUNDED && curve != PLAN_CURVE_SMOOTHED &&
           curve != PLAN_CURVE_KOCHANEK && curve != PLAN_CURVE_BSPLINE &&
           curve != PLAN_CURVE_LAGRANGE;
}

static int move_append_spans(const struct move *move,
                             const struct move_run *run)
{
    struct move_run span = *run;
    int rc = MOTION_OK;

    span.count = 2;
    for (uint32_t i = 0; rc == MOTION_OK && i + 1 < run->count; i++) {
        span.from = run->from + i;
        rc = move_append_kept(move, &span);
    }
    return rc;
}

static int move_append_run(const struct move *move, const struct move_run *run)
{
    int rc;

    if (run->curve == PLAN_CURVE_BEZIER)
        return move_bezier_append(move, run->from, run->from + run->count - 1);
    if (run->curve == PLAN_CURVE_LAGRANGE &&
        run->count > MOTION_SPLINE_LAGRANGE_KEYS)
        return move_fail_key(
            move, MOTION_E_FULL, run->from + MOTION_SPLINE_LAGRANGE_KEYS,
            "lagrange takes at most %d keys", MOTION_SPLINE_LAGRANGE_KEYS);
    rc = move_fill(move, run);
    if (rc != MOTION_OK)
        return rc;
    return move->memo == NULL          ? move_append_plain(move, run)
           : move_is_local(run->curve) ? move_append_spans(move, run)
                                       : move_append_kept(move, run);
}

static bool move_has_bezier(const struct plan_axis *axis)
{
    for (uint32_t i = 0; i < axis->key_count; i++)
        if (move_curve_at(axis, i) == PLAN_CURVE_BEZIER)
            return true;
    return false;
}

static int move_append(struct move *move)
{
    const uint32_t last = move->axis->key_count - 1;
    const int64_t wait = move->key[0].t_ns_q12;
    const bool profile = move_has_profile(move->axis);
    struct move_run run = { .count = 1 };
    int rc = MOTION_OK;

    if (!profile && move_has_bezier(move->axis))
        rc = move_bezier_handles(move);
    if (rc == MOTION_OK && move->is_bezier)
        return move_bezier_append_all(move);
    for (uint32_t i = 1; rc == MOTION_OK && i < last && !profile; i++)
        if (!move_goes_on(move->axis, i))
            rc = move_pin(move, i);
    if (rc == MOTION_OK && wait > 0)
        rc = move_grow(move, 1);
    if (rc == MOTION_OK && wait > 0)
        rc = motion_track_append_dwell(move->track, wait);
    if (rc == MOTION_OK && profile)
        return move_profile_append(move);
    for (uint32_t i = 0; rc == MOTION_OK && i < last; i += run.count - 1) {
        run = move_run(move->axis, i);
        rc = move_append_run(move, &run);
    }
    return rc;
}

static int move_make(struct move *move)
{
    int rc = move_copy(move);

    if (rc == MOTION_OK) {
        motion_track_init(move->track, NULL, 0, move->key[0].pos_q32);
        rc = move_append(move);
    }
    free(move->key);
    free(move->work);
    free(move->handles.key);
    return rc;
}

/* With every lap of its cycles written out. */
static int move_make_cycles(const struct move *move)
{
    struct plan_axis laps = { .key = NULL };
    struct move written = *move;
    uint32_t *number = NULL;
    int rc = move_cycles_write(move, &laps, &number);

    written.axis = &laps;
    written.number = number;
    if (rc == MOTION_OK)
        rc = move_check(&written);
    if (rc == MOTION_OK)
        rc = move_make(&written);
    free(laps.key);
    free(number);
    return rc;
}

static int move_track(struct move *move)
{
    struct motion_track *track = move->track;
    int rc;

    motion_track_init(track, NULL, 0, 0);
    rc = move_check(move);
    if (rc == MOTION_OK)
        rc = move_has_cycles(move->axis) && !move->is_bezier
                 ? move_make_cycles(move)
                 : move_make(move);
    if (rc == MOTION_OK)
        rc = move_memo_close(move);
    if (rc == MOTION_OK)
        move_trim(track);
    else
        plan_track_free(track);
    return rc;
}

int plan_axis_track(const struct plan_axis *axis, struct motion_track *track,
                    struct plan_error *error)
{
    return plan_axis_track_again(axis, NULL, NULL, 0, track, error);
}

static const struct plan_memo_axis *move_former(const struct plan_memo *former,
                                                const char *name)
{
    for (uint32_t i = 0; former != NULL && i < former->axes; i++)
        if (former->axis[i].segment != NULL &&
            strncmp(former->axis[i].name, name, PLAN_NAME_MAX) == 0)
            return &former->axis[i];
    return NULL;
}

int plan_axis_track_again(const struct plan_axis *axis,
                          const struct plan_memo *former,
                          struct plan_memo *memo, uint32_t index,
                          struct motion_track *track, struct plan_error *error)
{
    struct move move = { .axis = axis,
                         .is_bezier =
                             move_is_bezier(axis) && !move_has_profile(axis),
                         .track = track,
                         .error = error };

    if (memo != NULL) {
        move.former = move_former(former, axis->name);
        move.memo = &memo->axis[index];
        move.planned = &memo->planned;
        move.reused = &memo->reused;
        memcpy(move.memo->name, axis->name, PLAN_NAME_MAX);
    }
    return move_track(&move);
}

void plan_track_free(struct motion_track *track)
{
    free(track->segment);
    motion_track_init(track, NULL, 0, 0);
}

void plan_axis_free(struct plan_axis *axis)
{
    free(axis->key);
    free(axis->bezier.key);
    *axis = (struct plan_axis){ .key = NULL };
}

/* How far `value` is outside low .. high. */
static double move_beyond(int64_t value, int64_t low, int64_t high)
{
    return value < low    ? move_units(low) - move_units(value)
           : value > high ? move_units(value) - move_units(high)
                          : 0;
}

bool plan_axis_remark(const struct plan_axis *axis,
                      const struct motion_track *track, char text[160])
{
    int64_t low = INT64_MAX, high = INT64_MIN;
    struct motion_extreme extreme;
    bool swings = false;
    double below, above;

    for (uint32_t i = 0; i < axis->key_count; i++) {
        const int64_t p = axis->key[i].key.pos_q32;
        low = p < low ? p : low;
        high = p > high ? p : high;
        swings = swings || move_curve_at(axis, i) == PLAN_CURVE_LAGRANGE;
    }
    if (!swings)
        return false;
    motion_track_extreme(track, MOTION_POS, &extreme);
    below = move_beyond(extreme.min, low, high);
    above = move_beyond(extreme.max, low, high);
    if ((above > below ? above : below) <=
        0.01 * (move_units(high) - move_units(low)))
        return false;
    snprintf(text, 160,
             "axis %.*s: lagrange goes %.4g beyond its keys; c2 or monotone "
             "would not",
             PLAN_NAME_MAX, axis->name, above > below ? above : below);
    return true;
}
