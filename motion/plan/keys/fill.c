/* motion/plan/keys/fill.c - the velocities and accelerations that keys do not
 * give, run by run of one curve. */
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/keys/move_internal.h"

int move_copy(struct move *move)
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

/* Rounded corners start and end at full speed beside whatever takes it. */
static enum motion_spline_end move_inner_end(enum plan_curve curve,
                                             enum plan_curve beside)
{
    return move_is_straight(curve) && !move_is_rest(beside)
               ? MOTION_SPLINE_ONE_SIDED
               : MOTION_SPLINE_REST;
}

struct move_run move_run(const struct plan_axis *axis, uint32_t from)
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
                             plan_curve_rules(own)->name, move_double(vel));
    if (move_keeps_slopes(other) && move_differs(vel, key->vel))
        return move_fail_key(move, MOTION_E_ARG, i,
                             "speed would step: %s has %.6g there and %s %.6g",
                             plan_curve_rules(own)->name, move_double(vel),
                             plan_curve_rules(other)->name,
                             move_double(key->vel));
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
            plan_curve_rules(move_curve_at(move->axis, left ? i - 1 : i))->name,
            move_double(vel),
            move->axis->key[i].key.has_vel
                ? "the key"
                : plan_curve_rules(move_curve_at(move->axis, left ? i : i - 1))
                      ->name,
            move_double(move->key[i].vel));
    }
    return MOTION_OK;
}

/* What both runs have at the key between them. */
int move_pin(struct move *move, uint32_t i)
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

int move_fill(const struct move *move, const struct move_run *run)
{
    const int rc = move_fill_run(move, run);

    if (rc == MOTION_E_ARG) /* c4: free ends of too few keys */
        return move_fail_key(move, rc, run->from,
                             "too few keys follow for curve %s and its ends",
                             plan_curve_rules(run->curve)->name);
    if (rc != MOTION_OK)
        return move_fail_axis(move, rc,
                              "a velocity or acceleration between the keys is "
                              "beyond its format");
    return MOTION_OK;
}
