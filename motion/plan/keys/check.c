/* motion/plan/keys/check.c - the keys of an axis judged one by one, so that an
 * error names the first that is wrong. */
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/keys/move_internal.h"

static const char *const move_end_name[] = { "rest", "one-sided", "natural",
                                             "not-a-knot", "periodic" };

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

    if (plan_curve_rules(axis->curve) == NULL)
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
               : move_axis_shape(axis,
                                 plan_curve_rules(move_curve_at(axis, i)));
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

bool move_goes_on(const struct plan_axis *axis, uint32_t i)
{
    const enum plan_curve curve = move_curve_at(axis, i);
    const union plan_shape before = move_shape_at(axis, i - 1);
    const union plan_shape after = move_shape_at(axis, i);

    return curve == move_curve_at(axis, i - 1) &&
           move_is_same_shape(plan_curve_rules(curve), &before, &after);
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
        plan_curve_rules(move_curve_at(move->axis, i));
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
    vel =
        move_stricter(plan_curve_rules(before), plan_curve_rules(after), false);
    acc =
        move_stricter(plan_curve_rules(before), plan_curve_rules(after), true);
    needs = vel->vel;
    if (needs == PLAN_MUST &&
        (plan_curve_rules(before)->own || plan_curve_rules(after)->own))
        needs = PLAN_MAY;
    rc = move_check_given(move, i, "velocity", vel->name, needs, key->has_vel,
                          key->vel.m == 0);
    if (rc == MOTION_OK)
        rc = move_check_given(move, i, "acceleration", acc->name, acc->acc,
                              key->has_acc, key->acc.m == 0);
    if (rc == MOTION_OK && key->has_acc &&
        acc == plan_curve_rules(PLAN_CURVE_C2) &&
        (key->has_vel || (i > 0 && i < last)))
        rc = move_fail_key(move, MOTION_E_ARG, i,
                           "acceleration is given, but c2 keeps one only at "
                           "its ends, instead of a velocity");
    return rc;
}

int move_check(const struct move *move)
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
