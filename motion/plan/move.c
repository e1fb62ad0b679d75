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

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/bake_poly.h"
#include "motion/plan/move_internal.h"

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

static const char *const move_end_name[] = { "rest", "one-sided", "natural",
                                             "not-a-knot", "periodic" };

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

/* --- judging -------------------------------------------------------------- */

static bool move_is_share(int64_t a_q32)
{
    return a_q32 >= -MOTION_FIXED_ONE_Q32 && a_q32 <= MOTION_FIXED_ONE_Q32;
}

static int move_check_shape(const struct move *move)
{
    const struct motion_spline_kochanek *shape = &move->axis->shape;

    if (move_is_share(shape->tension_q32) &&
        move_is_share(shape->continuity_q32) && move_is_share(shape->bias_q32))
        return MOTION_OK;
    return move_fail_axis(move, MOTION_E_ARG,
                          "tension, continuity and bias are %.9g, %.9g, %.9g, "
                          "not -1 to 1",
                          move_units(shape->tension_q32),
                          move_units(shape->continuity_q32),
                          move_units(shape->bias_q32));
}

static int move_check_axis(const struct move *move)
{
    const struct plan_axis *axis = move->axis;

    if ((size_t)axis->curve >= MOVE_CURVES)
        return move_fail_axis(move, MOTION_E_ARG,
                              "there is no curve with number %u",
                              (unsigned)axis->curve);
    if (axis->key_count == 0)
        return move_fail_axis(move, MOTION_E_EMPTY, "there are no keys");
    if (axis->key_count > PLAN_KEYS_MAX)
        return move_fail_axis(move, MOTION_E_FULL,
                              "%u keys are more than the %u allowed",
                              (unsigned)axis->key_count, PLAN_KEYS_MAX);
    if ((axis->mu_q32 < 0 || axis->mu_q32 > 2 * MOTION_FIXED_ONE_Q32))
        return move_fail_axis(move, MOTION_E_ARG, "mu is %.9g, not 0 to 2",
                              move_units(axis->mu_q32));
    if ((axis->k1_q32 < 0 || axis->k1_q32 > axis->k2_q32 ||
         axis->k2_q32 > MOTION_FIXED_ONE_Q32))
        return move_fail_axis(move, MOTION_E_ARG,
                              "k1 is %.9g and k2 is %.9g, expected 0 <= k1 "
                              "<= k2 <= 1",
                              move_units(axis->k1_q32),
                              move_units(axis->k2_q32));
    if (axis->blend_ns_q12 < 0)
        return move_fail_axis(move, MOTION_E_ARG, "blend is %.9g s",
                              move_seconds(axis->blend_ns_q12));
    return move_check_shape(move);
}

/* One sentence about a parameter out of range, NULL when it is inside. */
static const char *move_judge_shape(const struct plan_curve_rules *rules,
                                    const union plan_shape *shape)
{
    if (rules->mu &&
        (shape->mu_q32 < 0 || shape->mu_q32 > 2 * MOTION_FIXED_ONE_Q32))
        return "mu is not 0 to 2";
    if (rules->blend && shape->blend_ns_q12 < 0)
        return "blend is below 0 s";
    if (rules->shape && !(move_is_share(shape->tcb.tension_q32) &&
                          move_is_share(shape->tcb.continuity_q32) &&
                          move_is_share(shape->tcb.bias_q32)))
        return "tension, continuity or bias is not -1 to 1";
    if (rules->ease &&
        (shape->ease.k1_q32 < 0 || shape->ease.k1_q32 > shape->ease.k2_q32 ||
         shape->ease.k2_q32 > MOTION_FIXED_ONE_Q32))
        return "k1 and k2 are not 0 <= k1 <= k2 <= 1";
    return NULL;
}

enum plan_curve move_curve_at(const struct plan_axis *axis, uint32_t i)
{
    return axis->key[i].has_curve ? axis->key[i].curve : axis->curve;
}

static union plan_shape move_axis_shape(const struct plan_axis *axis,
                                        const struct plan_curve_rules *rules)
{
    if (rules->mu)
        return (union plan_shape){ .mu_q32 = axis->mu_q32 };
    if (rules->blend)
        return (union plan_shape){ .blend_ns_q12 = axis->blend_ns_q12 };
    if (rules->shape)
        return (union plan_shape){ .tcb = axis->shape };
    return (union plan_shape){ .ease = { axis->k1_q32, axis->k2_q32 } };
}

union plan_shape move_shape_at(const struct plan_axis *axis, uint32_t i)
{
    return axis->key[i].has_shape
               ? axis->key[i].shape
               : move_axis_shape(axis, &move_rules[move_curve_at(axis, i)]);
}

static bool move_is_same_shape(const struct plan_curve_rules *rules,
                               const union plan_shape *a,
                               const union plan_shape *b)
{
    if (rules->mu)
        return a->mu_q32 == b->mu_q32;
    if (rules->blend)
        return a->blend_ns_q12 == b->blend_ns_q12;
    if (rules->shape)
        return a->tcb.tension_q32 == b->tcb.tension_q32 &&
               a->tcb.continuity_q32 == b->tcb.continuity_q32 &&
               a->tcb.bias_q32 == b->tcb.bias_q32;
    return true; /* an ease is a span by itself */
}

/* Whether the spans before and after key i are planned together. */
static bool move_goes_on(const struct plan_axis *axis, uint32_t i)
{
    const enum plan_curve curve = move_curve_at(axis, i);
    const union plan_shape before = move_shape_at(axis, i - 1);
    const union plan_shape after = move_shape_at(axis, i);

    return curve == move_curve_at(axis, i - 1) &&
           move_is_same_shape(&move_rules[curve], &before, &after);
}

/* The curve that begins or ends the axis must have its end rule.  Curves
 * without rules ignore the default. */
static int move_check_end(const struct move *move, enum plan_curve curve,
                          enum motion_spline_end end)
{
    const struct plan_curve_rules *rules = plan_curve_rules(curve);

    if ((unsigned)end > MOTION_SPLINE_PERIODIC)
        return move_fail_axis(move, MOTION_E_ARG,
                              "there is no end rule with number %u",
                              (unsigned)end);
    if (end == MOTION_SPLINE_REST || rules->ends & 1u << end)
        return MOTION_OK;
    return move_fail_axis(move, MOTION_E_ARG, "curve %s has no end %s",
                          rules->name, move_end_name[end]);
}

static int move_check_ends(const struct move *move)
{
    const struct plan_axis *axis = move->axis;
    const uint32_t last = axis->key_count - 1;
    const bool periodic = axis->first == MOTION_SPLINE_PERIODIC;
    bool one = true;
    int rc = MOTION_OK;

    for (uint32_t i = 0; i < last && periodic; i++)
        one = one && move_curve_at(axis, i) == move_curve_at(axis, 0);
    if (periodic != (axis->last == MOTION_SPLINE_PERIODIC) || !one)
        return move_fail_axis(move, MOTION_E_ARG,
                              "periodic needs both ends and one curve");
    if (periodic && axis->key[0].key.pos_q32 != axis->key[last].key.pos_q32)
        return move_fail_key(move, MOTION_E_ARG, last,
                             "a periodic axis must end where it starts");
    rc = move_bezier_check(move);
    if (rc == MOTION_OK)
        rc = move_check_end(move, move_curve_at(axis, 0), axis->first);
    if (rc == MOTION_OK)
        rc = move_check_end(move, move_curve_at(axis, last ? last - 1 : 0),
                            axis->last);
    return rc;
}

static int move_check_time(const struct move *move, uint32_t i)
{
    const struct plan_key *key = &move->axis->key[i];
    const int64_t t = key->key.t_ns_q12;
    const int64_t before = i == 0 ? 0 : key[-1].key.t_ns_q12;

    if (t < (move->is_bezier ? -MOTION_TRACK_SEGMENT_MAX_NS_Q12 : 0))
        return move_fail_key(move, MOTION_E_ORDER, i,
                             "time %.9g s is before the start of the move",
                             move_seconds(t));
    if (i > 0 && t <= before)
        return move_fail_key(
            move, MOTION_E_ORDER, i,
            "time %.9g s is not after the key before it (%.9g s)",
            move_seconds(t), move_seconds(before));
    if (t > MOTION_TRACK_MAX_NS_Q12 ||
        t - before > MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return move_fail_key(
            move, MOTION_E_RANGE, i,
            "time %.9g s is too late: at most %.9g s after the key before it "
            "and %.9g s in all",
            move_seconds(t), move_seconds(MOTION_TRACK_SEGMENT_MAX_NS_Q12),
            move_seconds(MOTION_TRACK_MAX_NS_Q12));
    return MOTION_OK;
}

static int move_check_given(const struct move *move, uint32_t i,
                            const char *what, const char *curve,
                            enum plan_given rule, bool has, bool zero)
{
    if (rule == PLAN_MUST && !has)
        return move_fail_key(move, MOTION_E_ARG, i,
                             "no %s, which %s needs at every key", what, curve);
    if (rule == PLAN_NO && has)
        return move_fail_key(move, MOTION_E_ARG, i,
                             "%s is given, but %s cannot keep it", what, curve);
    if (rule == PLAN_ZERO && has && !zero)
        return move_fail_key(move, MOTION_E_ARG, i,
                             "%s is not zero, but %s rests at every key", what,
                             curve);
    return MOTION_OK;
}

/* Of the two curves that meet at a key, the one that is told what it says; a
 * rest and a need go before a licence, and that before a refusal. */
static const struct plan_curve_rules *
move_stricter(const struct plan_curve_rules *a,
              const struct plan_curve_rules *b, bool acc)
{
    static const int rank[] = {
        [PLAN_NO] = 0, [PLAN_MAY] = 1, [PLAN_ZERO] = 2, [PLAN_MUST] = 3
    };
    const int ra = rank[acc ? a->acc : a->vel];

    return rank[acc ? b->acc : b->vel] > ra ? b : a;
}

static int move_check_key_shape(const struct move *move, uint32_t i)
{
    const struct plan_key *key = &move->axis->key[i];
    const struct plan_curve_rules *rules =
        &move_rules[move_curve_at(move->axis, i)];
    const char *wrong = NULL;

    if (key->has_shape)
        wrong = rules->mu || rules->blend || rules->shape || rules->ease
                    ? move_judge_shape(rules, &key->shape)
                    : "its curve has no parameters";
    return wrong == NULL ? MOTION_OK
                         : move_fail_key(move, MOTION_E_ARG, i, "%s", wrong);
}

static int move_check_key(const struct move *move, uint32_t i)
{
    const struct plan_axis *axis = move->axis;
    const struct motion_key *key = &axis->key[i].key;
    const uint32_t last = axis->key_count - 1;
    const enum plan_curve after = move_curve_at(axis, i < last ? i : i - !!i);
    const enum plan_curve before = i > 0 ? move_curve_at(axis, i - 1) : after;
    const struct plan_curve_rules *vel, *acc;
    enum plan_given needs;
    int rc = move_check_time(move, i);

    if (rc == MOTION_OK &&
        (plan_curve_rules(after) == NULL || plan_curve_rules(before) == NULL))
        rc = move_fail_key(move, MOTION_E_ARG, i,
                           "there is no curve with number %u",
                           (unsigned)axis->key[i].curve);
    if (rc != MOTION_OK)
        return rc;
    rc = move_check_key_shape(move, i);
    if (rc != MOTION_OK)
        return rc;
    vel = move_stricter(&move_rules[before], &move_rules[after], false);
    acc = move_stricter(&move_rules[before], &move_rules[after], true);
    needs = vel->vel;
    if (needs == PLAN_MUST && (move_rules[before].own || move_rules[after].own))
        needs = PLAN_MAY;
    rc = move_check_given(move, i, "velocity", vel->name, needs, key->has_vel,
                          key->vel.m == 0);
    if (rc == MOTION_OK)
        rc = move_check_given(move, i, "acceleration", acc->name, acc->acc,
                              key->has_acc, key->acc.m == 0);
    if (rc == MOTION_OK && key->has_acc && acc == &move_rules[PLAN_CURVE_C2] &&
        (key->has_vel || (i > 0 && i < last)))
        rc = move_fail_key(move, MOTION_E_ARG, i,
                           "acceleration is given, but c2 keeps one only at "
                           "its ends, instead of a velocity");
    return rc;
}

static int move_check(const struct move *move)
{
    const bool profile = move_has_profile(move->axis);
    int rc = move_check_axis(move);

    for (uint32_t i = 0; rc == MOTION_OK && i < move->axis->key_count; i++)
        rc = profile ? move_check_time(move, i) : move_check_key(move, i);
    if (rc != MOTION_OK)
        return rc;
    if (!profile)
        return move_check_ends(move);
    rc = move_profile_check(move);
    return rc == MOTION_OK && move_has_cycles(move->axis)
               ? move_cycles_check(move)
               : rc;
}

/* --- filling in ----------------------------------------------------------- */

static int move_copy(struct move *move)
{
    const uint32_t count = move->axis->key_count;

    move->key = malloc(count * sizeof *move->key);
    move->work = malloc(count * sizeof *move->work);
    if (move->key == NULL || move->work == NULL)
        return move_fail_axis(move, MOTION_E_FULL, "no memory for %u keys",
                              (unsigned)count);
    for (uint32_t i = 0; i < count; i++)
        move->key[i] = move->axis->key[i].key;
    return MOTION_OK;
}

/* Spans of one curve in a row. */
struct move_run {
    uint32_t from, count; /* of keys */
    enum plan_curve curve;
    enum motion_spline_end first, last;
    union plan_shape shape;
};

/* Rounded corners start and end at full speed beside whatever takes it. */
static enum motion_spline_end move_inner_end(enum plan_curve curve,
                                             enum plan_curve beside)
{
    return move_is_straight(curve) && !move_is_rest(beside)
               ? MOTION_SPLINE_ONE_SIDED
               : MOTION_SPLINE_REST;
}

static struct move_run move_run(const struct plan_axis *axis, uint32_t from)
{
    struct move_run run = { .from = from,
                            .count = 2,
                            .curve = move_curve_at(axis, from),
                            .shape = move_shape_at(axis, from) };

    while (from + run.count < axis->key_count &&
           move_goes_on(axis, from + run.count - 1))
        run.count++;
    run.first = from == 0
                    ? axis->first
                    : move_inner_end(run.curve, move_curve_at(axis, from - 1));
    run.last = from + run.count == axis->key_count
                   ? axis->last
                   : move_inner_end(run.curve,
                                    move_curve_at(axis, from + run.count - 1));
    return run;
}

bool move_is_straight(enum plan_curve curve)
{
    return curve == PLAN_CURVE_LINEAR || curve == PLAN_CURVE_ROUNDED ||
           curve == PLAN_CURVE_SMOOTHED;
}

static bool move_is_fifth(enum plan_curve curve)
{
    return curve == PLAN_CURVE_QUINTIC || curve == PLAN_CURVE_C4;
}

/* Beyond rounding. */
static bool move_differs(struct motion_real a, struct motion_real b)
{
    const struct motion_real off = motion_real_abs(motion_real_sub(a, b));
    const struct motion_real size =
        motion_real_max(motion_real_abs(a), motion_real_abs(b));

    return motion_real_cmp(off, motion_real_max(motion_real_scale(size, -30),
                                                motion_real_make(1, -28))) > 0;
}

static double move_double(struct motion_real a)
{
    int64_t q32;

    return motion_real_round(a, 32, &q32) == MOTION_OK ? move_units(q32) : 0;
}

/* Curves that have a velocity of their own at their ends. */
static bool move_keeps_slopes(enum plan_curve curve)
{
    return move_is_rest(curve) || curve == PLAN_CURVE_ROUNDED ||
           curve == PLAN_CURVE_SMOOTHED || curve == PLAN_CURVE_LAGRANGE;
}

int move_tell(struct move *move, uint32_t i, bool left, struct motion_real vel)
{
    const enum plan_curve own = move_curve_at(move->axis, left ? i - 1 : i);
    const enum plan_curve other = move_curve_at(move->axis, left ? i : i - 1);
    struct motion_key *key = &move->key[i];

    if (move->axis->key[i].key.has_vel)
        return move_fail_key(move, MOTION_E_ARG, i,
                             "velocity is given, but %s has one of its own "
                             "there, %.6g",
                             move_rules[own].name, move_double(vel));
    if (move_keeps_slopes(other) && move_differs(vel, key->vel))
        return move_fail_key(move, MOTION_E_ARG, i,
                             "speed would step: %s has %.6g there and %s %.6g",
                             move_rules[own].name, move_double(vel),
                             move_rules[other].name, move_double(key->vel));
    key->vel = vel;
    return MOTION_OK;
}

/* One polynomial through all keys of a run has its own velocity at its ends. */
static int move_pin_lagrange(struct move *move, uint32_t i, bool left)
{
    struct motion_real first, last;
    struct move_run run;
    uint32_t from = i;
    int rc;

    while (left && from > 0 &&
           move_curve_at(move->axis, from - 1) == PLAN_CURVE_LAGRANGE)
        from--;
    run = move_run(move->axis, from);
    if (run.count > MOTION_SPLINE_LAGRANGE_KEYS)
        return MOTION_OK; /* refused when it is appended */
    rc = motion_spline_lagrange_velocities(&move->key[from], run.count, &first,
                                           &last);
    if (rc != MOTION_OK)
        return move_fail_key(move, rc, i, "its velocity is beyond the format");
    return move_tell(move, i, left, left ? last : first);
}

/* The velocity that a resting or rounding curve has at key i, where it begins
 * or ends (`left`); false for others. */
static bool move_own(const struct move *move, uint32_t i, bool left,
                     struct motion_real *vel)
{
    const enum plan_curve curve = move_curve_at(move->axis, left ? i - 1 : i);
    const enum plan_curve other = move_curve_at(move->axis, left ? i : i - 1);
    const struct motion_key *from = &move->key[left ? i - 1 : i];
    struct motion_key pair[2] = { from[0], from[1] };

    *vel = motion_real_zero();
    if (move_is_rest(curve))
        return true;
    if (curve != PLAN_CURVE_ROUNDED && curve != PLAN_CURVE_SMOOTHED)
        return false;
    if (move_is_rest(other))
        return true;
    pair[0].has_vel = pair[1].has_vel = false;
    (void)motion_spline_tangents_parabola(pair, 2, MOTION_SPLINE_ONE_SIDED,
                                          MOTION_SPLINE_ONE_SIDED);
    *vel = pair[0].vel;
    return true;
}

/* What is given, or what the other side has of its own, must be the same. */
static int move_check_own(struct move *move, uint32_t i)
{
    struct motion_real vel;

    for (int left = 0; left < 2; left++) {
        if (!move_own(move, i, left, &vel) ||
            !move_differs(vel, move->key[i].vel))
            continue;
        return move_fail_key(
            move, MOTION_E_ARG, i,
            "speed would step: %s has %.6g there and %s %.6g",
            move_rules[move_curve_at(move->axis, left ? i - 1 : i)].name,
            move_double(vel),
            move->axis->key[i].key.has_vel
                ? "the key"
                : move_rules[move_curve_at(move->axis, left ? i : i - 1)].name,
            move_double(move->key[i].vel));
    }
    return MOTION_OK;
}

/* What both runs have at the key between them. */
static int move_pin(struct move *move, uint32_t i)
{
    const enum plan_curve before = move_curve_at(move->axis, i - 1);
    const enum plan_curve after = move_curve_at(move->axis, i);
    const bool rests = move_is_rest(before) || move_is_rest(after);
    struct motion_key *key = &move->key[i];
    struct motion_key near[3] = { key[-1], key[0], key[1] };
    const uint32_t line = move_is_straight(after) ? 1 : 0;
    int rc;

    near[0].has_vel = near[2].has_vel = near[1].has_acc = false;
    rc = move_is_straight(before) || move_is_straight(after)
             ? motion_spline_tangents_parabola(&near[line], 2,
                                               MOTION_SPLINE_ONE_SIDED,
                                               MOTION_SPLINE_ONE_SIDED)
             : motion_spline_tangents_parabola(near, 3, MOTION_SPLINE_REST,
                                               MOTION_SPLINE_REST);
    if (rc == MOTION_OK)
        rc = motion_spline_accelerations(near, 3, MOTION_SPLINE_REST,
                                         MOTION_SPLINE_REST);
    if (rc != MOTION_OK)
        return move_fail_key(move, rc, i,
                             "its velocity or acceleration is beyond the "
                             "format");
    if (!key->has_vel)
        key->vel = rests ? motion_real_zero() : near[1].vel;
    if (!key->has_acc && (move_is_fifth(before) || move_is_fifth(after))) {
        key->has_acc = true;
        key->acc = move_is_fifth(before) && move_is_fifth(after)
                       ? near[1].acc
                       : motion_real_zero();
    }
    key->has_vel = true;
    if (before != PLAN_CURVE_LINEAR && after != PLAN_CURVE_LINEAR)
        rc = move_check_own(move, i);
    if (rc != MOTION_OK)
        return rc;
    if (before == PLAN_CURVE_LAGRANGE || after == PLAN_CURVE_LAGRANGE)
        rc = move_pin_lagrange(move, i, before == PLAN_CURVE_LAGRANGE);
    if (rc != MOTION_OK)
        return rc;
    if (before != PLAN_CURVE_BEZIER && after != PLAN_CURVE_BEZIER)
        return MOTION_OK;
    return move_bezier_pin(move, i,
                           move_is_fifth(before) || move_is_fifth(after));
}

/* Velocities and accelerations by the run's curve. */
static int move_fill_run(const struct move *move, const struct move_run *run)
{
    struct motion_key *key = &move->key[run->from];
    int rc;

    switch (run->curve) {
    case PLAN_CURVE_CARDINAL:
        return motion_spline_tangents_cardinal(
            key, run->count, run->shape.mu_q32, run->first, run->last);
    case PLAN_CURVE_CATMULL_ROM:
        return motion_spline_tangents_parabola(key, run->count, run->first,
                                               run->last);
    case PLAN_CURVE_QUINTIC:
        rc = motion_spline_tangents_parabola(key, run->count, run->first,
                                             run->last);
        return rc ? rc
                  : motion_spline_accelerations(key, run->count, run->first,
                                                run->last);
    case PLAN_CURVE_MONOTONE:
        return motion_spline_monotone(key, run->count, run->first, run->last);
    case PLAN_CURVE_AKIMA:
    case PLAN_CURVE_AKIMA_MONOTONE:
        rc = motion_spline_akima(key, run->count, run->first, run->last);
        return rc || run->curve == PLAN_CURVE_AKIMA
                   ? rc
                   : motion_spline_limit_overshoot(key, run->count);
    case PLAN_CURVE_C2:
        return motion_spline_c2(key, run->count, run->first, run->last,
                                move->work);
    case PLAN_CURVE_C4:
        return motion_spline_c4(key, run->count, run->first, run->last,
                                move->work);
    default:
        return MOTION_OK;
    }
}

static int move_fill(const struct move *move, const struct move_run *run)
{
    const int rc = move_fill_run(move, run);

    if (rc == MOTION_E_ARG) /* c4: free ends of too few keys */
        return move_fail_key(move, rc, run->from,
                             "too few keys follow for curve %s and its ends",
                             move_rules[run->curve].name);
    if (rc != MOTION_OK)
        return move_fail_axis(move, rc,
                              "a velocity or acceleration between the keys is "
                              "beyond its format");
    return MOTION_OK;
}

/* --- appending ------------------------------------------------------------ */

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

static int move_append_rest(const struct move *move, const struct move_run *run)
{
    const struct plan_axis *axis = move->axis;
    const enum motion_ease_law law =
        run->curve == PLAN_CURVE_SINE     ? MOTION_EASE_SINE
        : run->curve == PLAN_CURVE_SCURVE ? MOTION_EASE_SCURVE
                                          : MOTION_EASE_PARABOLIC;
    int rc = MOTION_OK;

    for (uint32_t i = run->from;
         rc == MOTION_OK && i + 1 < run->from + run->count; i++) {
        const union plan_shape shape = move_shape_at(axis, i);
        const struct motion_key *key = &move->key[i];
        rc = move_grow(move, MOTION_EASE_SEGMENTS);
        if (rc != MOTION_OK)
            return rc;
        rc = motion_ease_append(move->track, law, key[1].pos_q32,
                                key[1].t_ns_q12 - key[0].t_ns_q12,
                                shape.ease.k1_q32, shape.ease.k2_q32);
        if (rc != MOTION_OK)
            return move_fail_span(move, rc, i);
    }
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

static int move_append_run(const struct move *move, const struct move_run *run)
{
    uint32_t span = 0;
    int rc;

    if (move_is_rest(run->curve))
        return move_append_rest(move, run);
    if (run->curve == PLAN_CURVE_BEZIER)
        return move_bezier_append(move, run->from, run->from + run->count - 1);
    if (run->curve == PLAN_CURVE_LAGRANGE &&
        run->count > MOTION_SPLINE_LAGRANGE_KEYS)
        return move_fail_key(
            move, MOTION_E_FULL, run->from + MOTION_SPLINE_LAGRANGE_KEYS,
            "lagrange takes at most %d keys", MOTION_SPLINE_LAGRANGE_KEYS);
    rc = move_fill(move, run);
    if (rc == MOTION_OK)
        rc = move_grow(move, move_capacity(run));
    if (rc != MOTION_OK)
        return rc;
    rc = move_append_spline(move, run, &span);
    return rc == MOTION_OK ? MOTION_OK
                           : move_fail_span(move, rc, run->from + span);
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

int plan_axis_track(const struct plan_axis *axis, struct motion_track *track,
                    struct plan_error *error)
{
    struct move move = { .axis = axis,
                         .is_bezier =
                             move_is_bezier(axis) && !move_has_profile(axis),
                         .track = track,
                         .error = error };
    int rc;

    motion_track_init(track, NULL, 0, 0);
    rc = move_check(&move);
    if (rc == MOTION_OK)
        rc = move_has_cycles(axis) && !move.is_bezier ? move_make_cycles(&move)
                                                      : move_make(&move);
    if (rc == MOTION_OK)
        move_trim(track);
    else
        plan_track_free(track);
    return rc;
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
