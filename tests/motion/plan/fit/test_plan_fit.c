/* tests/motion/plan/fit/test_plan_fit.c - repair of moves that break limits, judged
 * by the checker.
 *
 * Takes long. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/check.h"
#include "motion/plan/fit/fit.h"
#include "tests/support/check.h"

#define UNIT     MOTION_FIXED_ONE_Q32
#define SEC      MOTION_FIXED_S_Q12
#define AXES_MAX 3
#define KEYS_MAX 9

static struct plan_axis axes[AXES_MAX];
static struct plan_key keys[AXES_MAX][KEYS_MAX];
static struct plan_limit limits[AXES_MAX];
static int64_t tolerances[AXES_MAX];
static struct plan_move move;
static struct plan_error error;

static int64_t pick(int64_t low, int64_t high)
{
    return check_random_in(check_stream(), low, high);
}

static double between(double low, double high)
{
    return low + (high - low) * (double)draw_unit();
}

static struct motion_real real_of(double value)
{
    return motion_real_from_q(llrint(value * (double)UNIT), 32);
}

/* --- random moves ---------------------------------------------------------- */

static void give(enum plan_curve curve, bool end, double speed,
                 struct plan_key *key)
{
    const struct plan_curve_rules *rules = plan_curve_rules(curve);
    const bool vel = rules->vel == PLAN_MUST ||
                     (rules->vel == PLAN_MAY && (end || draw() % 3 == 0));
    const bool acc =
        rules->acc == PLAN_MAY && end && vel && curve != PLAN_CURVE_C2;

    key->key.has_vel = vel;
    key->key.vel = end ? motion_real_zero() : real_of(between(-speed, speed));
    key->key.has_acc = acc;
    key->key.acc = motion_real_zero();
}

static void any_axis(unsigned a, enum plan_curve curve, const int64_t t[],
                     uint32_t count, double size)
{
    struct plan_axis *axis = &axes[a];

    *axis = (struct plan_axis){
        .curve = curve,
        .mu_q32 = UNIT,
        .k1_q32 = UNIT / 3,
        .k2_q32 = 2 * (UNIT / 3),
        .blend_ns_q12 = SEC / 5,
        .key = keys[a],
    };
    snprintf(axis->name, sizeof axis->name, "axis%u", a);
    for (uint32_t i = 0; i < count; i++) {
        const bool end = i == 0 || i + 1 == count;
        if (!end && draw() % 4 == 0) /* not every axis has every key */
            continue;
        struct plan_key *key = &keys[a][axis->key_count++];
        *key = (struct plan_key){
            .key = { .t_ns_q12 = t[i],
                     .pos_q32 = llrint(between(-size, size) * (double)UNIT) },
        };
        give(curve, end, size / 2, key);
    }
}

static void any_move(void)
{
    /* those that come to rest at their ends without a step in velocity */
    static const enum plan_curve curves[] = {
        PLAN_CURVE_QUINTIC,  PLAN_CURVE_QUINTIC,     PLAN_CURVE_C4,
        PLAN_CURVE_SCURVE,   PLAN_CURVE_PARABOLIC,   PLAN_CURVE_SINE,
        PLAN_CURVE_HERMITE,  PLAN_CURVE_CATMULL_ROM, PLAN_CURVE_CARDINAL,
        PLAN_CURVE_KOCHANEK, PLAN_CURVE_MONOTONE,    PLAN_CURVE_AKIMA,
        PLAN_CURVE_C2,       PLAN_CURVE_CONSTRAINTS, PLAN_CURVE_BEZIER,
    };
    const uint32_t count = (uint32_t)pick(2, KEYS_MAX);
    const double scale = pow(10, between(-1, 1));
    int64_t t[KEYS_MAX];

    t[0] = draw() % 3 == 0 ? SEC / 2 : 0;
    for (uint32_t i = 1; i < count; i++)
        t[i] =
            t[i - 1] + llrint(scale * between(0.05, 1) * 1e6) * (SEC / 1000000);
    move = (struct plan_move){ .axis = axes,
                               .axis_count = (uint32_t)pick(1, AXES_MAX) };
    for (unsigned a = 0; a < move.axis_count; a++)
        any_axis(a, curves[draw() % ARRAY_LEN(curves)], t, count,
                 pow(10, between(0, 2)));
}

static double peak_of(const struct motion_track *track,
                      enum motion_quantity quantity)
{
    struct motion_extreme extreme;

    motion_track_extreme(track, quantity, &extreme);
    return fmax(fabs((double)extreme.min), fabs((double)extreme.max));
}

/* As every rig has one: a handle's end is rounded to 2^-32 unit, so that the
 * slopes on both sides of a key differ, which counts as a step where there is
 * no period. */
#define PERIOD_NS 1000000

/* Limits that an axis breaks by up to `ratio` in one of them; without one of
 * jerk where acceleration steps.  False where velocity steps. */
static bool limit_axis(unsigned a, double ratio)
{
    struct plan_limit *limit = &limits[a];
    struct plan_violation found[64];
    struct motion_track track;
    const unsigned broken = (unsigned)(draw() % 3);

    if (plan_axis_track(&axes[a], &track, &error) < 0)
        fail_msg("%s", error.text);
    const double vel = peak_of(&track, MOTION_VEL),
                 acc = peak_of(&track, MOTION_ACC),
                 jerk = peak_of(&track, MOTION_JERK);
    const double part[] = { broken == 0 ? ratio : between(0.1, ratio),
                            broken == 1 ? ratio : between(0.1, ratio),
                            broken == 2 ? ratio : between(0.1, ratio) };
    *limit = (struct plan_limit){
        -MOTION_TRACK_POS_MAX_Q32, MOTION_TRACK_POS_MAX_Q32,
        llrint(vel / part[0]),     llrint(acc / part[1]),
        llrint(jerk / part[2]),    PERIOD_NS
    };
    const uint32_t count =
        plan_check_track(&track, limit, found, ARRAY_LEN(found));
    bool steps = count > ARRAY_LEN(found);
    for (uint32_t i = 0; i < count && i < ARRAY_LEN(found); i++) {
        steps = steps || found[i].kind == PLAN_VEL_STEP;
        if (found[i].kind == PLAN_ACC_STEP)
            limit->jerk_q32 = 0;
    }
    if (broken == 2 && limit->jerk_q32 == 0)
        limit->acc_q32 = llrint(acc / ratio);
    plan_track_free(&track);
    return !steps && limit->vel_q32 > 1000 && limit->acc_q32 > 1000;
}

static bool any_violation(void)
{
    const double worst = pow(10, between(log10(1.01), log10(50)));
    const unsigned which = (unsigned)(draw() % 2);

    any_move();
    for (unsigned a = 0; a < move.axis_count; a++)
        if (!limit_axis(a, a == which % move.axis_count
                               ? worst
                               : between(0.5, fmax(worst, 1))))
            return false;
    return true;
}

/* --- what must be true of an answer ---------------------------------------- */

static bool is_inside(const struct plan_fit *fit)
{
    bool inside = true;

    for (uint32_t a = 0; a < fit->axis_count; a++) {
        struct motion_track track;
        assert_int_equal(plan_axis_track(&fit->axis[a], &track, &error),
                         MOTION_OK);
        inside = inside && plan_check_track(&track, &limits[a], NULL, 0) == 0;
        plan_track_free(&track);
    }
    return inside;
}

static int64_t end_of(const struct plan_fit *fit)
{
    return fit->to_ns_q12[fit->knots - 1];
}

static void judge(int n, const struct plan_fit *fit)
{
    if (!is_inside(fit))
        fail_msg("case %d is not inside its limits", n);
    for (uint32_t k = 0; k + 1 < fit->knots; k++)
        if (fit->to_ns_q12[k + 1] <= fit->to_ns_q12[k])
            fail_msg("case %d: times do not increase", n);
    for (uint32_t a = 0; a < fit->axis_count; a++) {
        for (uint32_t i = 0; i < axes[a].key_count; i++) {
            const struct plan_key *was = &keys[a][i],
                                  *is = &fit->axis[a].key[i];
            if (is->key.pos_q32 != was->key.pos_q32 ||
                ((was->fixed & PLAN_FIXED_TIME) != 0 &&
                 is->key.t_ns_q12 != was->key.t_ns_q12))
                fail_msg("case %d: axis %u key %u has moved", n, a, i);
        }
    }
}

static bool on_frames;

static int solve(enum plan_fit_method method, struct plan_fit *fit)
{
    const struct plan_fit_request request = { &move, limits, method, tolerances,
                                              on_frames };

    return plan_fit_solve(&request, fit, &error);
}

static void repaired_moves_break_no_limit(void **state)
{
    unsigned done = 0, shorter = 0, fell_back = 0, rounds = 0;

    (void)state;
    seed_from("repair");
    for (int n = 0; done < (unsigned)check_cases(1000); n++) {
        struct plan_fit all, local;
        assert_true(n < 4000);
        if (!any_violation())
            continue;
        if (solve(PLAN_FIT_STRETCH, &all) < 0 ||
            solve(PLAN_FIT_LOCAL, &local) < 0)
            fail_msg("case %d: %s", n, error.text);
        judge(n, &all);
        judge(n, &local);
        if (end_of(&local) > end_of(&all))
            fail_msg("case %d: local takes longer", n);
        for (uint32_t k = 0; k < all.knots; k++)
            if (local.to_ns_q12[k] > all.to_ns_q12[k])
                fail_msg("case %d: knot %u is later", n, k);
        shorter += end_of(&local) < end_of(&all);
        fell_back += local.knots > 2 && end_of(&local) == end_of(&all);
        rounds = local.rounds > rounds ? local.rounds : rounds;
        plan_fit_free(&all);
        plan_fit_free(&local);
        done++;
    }
    print_message("%u moves, local shorter in %u, the same in %u with inner "
                  "keys, at most %u rounds\n",
                  done, shorter, fell_back, rounds);
    assert_true(shorter > done / 2);
}

static void fixed_keys_are_kept_to_the_bit(void **state)
{
    unsigned done = 0, refused = 0;

    (void)state;
    seed_from("fixed");
    for (int n = 0; n < check_cases(700); n++) {
        struct plan_fit fit;
        if (!any_violation() || keys[0][0].key.t_ns_q12 < 0)
            continue;
        for (unsigned f = 0; f < 2; f++) {
            const unsigned a = (unsigned)pick(0, move.axis_count - 1);
            const int64_t i = pick(0, axes[a].key_count - 1);
            keys[a][i].fixed = (uint8_t)pick(1, 3);
        }
        const int err = solve(n % 2 ? PLAN_FIT_LOCAL : PLAN_FIT_STRETCH, &fit);
        if (err < 0) {
            assert_int_equal(err, MOTION_E_LIMIT);
            assert_true(strlen(error.text) > 20);
            refused++;
            continue;
        }
        judge(n, &fit);
        plan_fit_free(&fit);
        done++;
    }
    print_message("%u repaired, %u refused\n", done, refused);
    assert_true(done > (unsigned)check_cases(150) &&
                refused > (unsigned)check_cases(100));
}

/* --- keys that are moved ----------------------------------------------------- */

/* Moved by at most their tolerance, never in time; the ends and those of fixed
 * value to the bit. */
static void judge_smooth(int n, const struct plan_fit *fit)
{
    if (!is_inside(fit))
        fail_msg("case %d is not inside its limits", n);
    for (uint32_t a = 0; a < fit->axis_count; a++)
        for (uint32_t i = 0; i < axes[a].key_count; i++) {
            const struct plan_key *was = &keys[a][i],
                                  *is = &fit->axis[a].key[i];
            const bool stays = i == 0 || i + 1 == axes[a].key_count ||
                               (was->fixed & PLAN_FIXED_VALUE) != 0;
            const int64_t moved = is->key.pos_q32 - was->key.pos_q32;
            if (is->key.t_ns_q12 != was->key.t_ns_q12 ||
                motion_fixed_abs(moved) > (stays ? 0 : (uint64_t)tolerances[a]))
                fail_msg("case %d: axis %u key %u has moved by %g", n, a, i,
                         ldexp((double)moved, -32));
        }
}

static void smoothed_moves_break_no_limit(void **state)
{
    unsigned done = 0, smoothed = 0, refused = 0;

    (void)state;
    seed_from("smooth");
    for (int n = 0; done < (unsigned)check_cases(1000); n++) {
        struct plan_fit fit;
        assert_true(n < 4000);
        if (!any_violation())
            continue;
        done++;
        for (unsigned a = 0; a < move.axis_count; a++) {
            tolerances[a] = llrint(pow(10, between(-2, 2)) * (double)UNIT);
            keys[a][pick(0, axes[a].key_count - 1)].fixed = (uint8_t)pick(0, 3);
        }
        const int err = solve(PLAN_FIT_SMOOTH, &fit);
        if (err < 0) {
            assert_int_equal(err, MOTION_E_LIMIT);
            assert_true(strlen(error.text) > 20);
            refused++;
            continue;
        }
        judge_smooth(n, &fit);
        smoothed++;
        plan_fit_free(&fit);
    }
    print_message("%u moves: %u smoothed, %u refused\n", done, smoothed,
                  refused);
    assert_true(smoothed > done / 20);
}

/* --- keys that shake --------------------------------------------------------- */

#define SHAKEN 60

static struct plan_key shaken[SHAKEN];

/* A sweep from rest to rest through keys at even times; its limits are a little
 * above its peaks. */
static void sweep(double size, enum plan_curve curve, uint32_t count)
{
    struct motion_track track;

    axes[0] = (struct plan_axis){
        .name = "pan", .curve = curve, .key = shaken, .key_count = count
    };
    move = (struct plan_move){ .axis = axes, .axis_count = 1 };
    for (uint32_t i = 0; i < count; i++) {
        const double u = (double)i / (count - 1);
        const double p = size * u * u * u * (10 + u * (-15 + u * 6));
        shaken[i] = (struct plan_key){
            .key = { .t_ns_q12 = i * (SEC / 10),
                     .pos_q32 = llrint(p * (double)UNIT) },
        };
    }
    assert_int_equal(plan_axis_track(&axes[0], &track, &error), MOTION_OK);
    limits[0] = (struct plan_limit){
        -MOTION_TRACK_POS_MAX_Q32,
        MOTION_TRACK_POS_MAX_Q32,
        llrint(peak_of(&track, MOTION_VEL) * between(1.2, 2)),
        llrint(peak_of(&track, MOTION_ACC) * between(1.2, 2)),
        llrint(peak_of(&track, MOTION_JERK) * between(1.2, 2)),
        PERIOD_NS
    };
    plan_track_free(&track);
}

static double worst_need(void)
{
    struct motion_track track;

    assert_int_equal(plan_axis_track(&axes[0], &track, &error), MOTION_OK);
    const struct plan_fit_need need = plan_fit_track_need(&track, &limits[0]);
    plan_track_free(&track);
    return need.decided_by > 0 ? pow(need.stretch, need.decided_by) : 0;
}

/* Keys from..to, by at most `by`; the tolerance allows to undo it, so that there
 * is an answer. */
static void shake(uint32_t from, uint32_t to, double by)
{
    for (uint32_t i = from; i < to; i++)
        shaken[i].key.pos_q32 += llrint(between(-by, by) * (double)UNIT);
    tolerances[0] = llrint(1.2 * by * (double)UNIT);
}

static void shaken_moves_are_smoothed(void **state)
{
    unsigned done = 0, refused = 0, rounds = 0;

    (void)state;
    seed_from("shaken");
    for (int n = 0; done < (unsigned)check_cases(1000); n++) {
        const uint32_t count = (uint32_t)pick(12, SHAKEN);
        const double size = pow(10, between(0, 3));
        struct plan_fit fit;
        assert_true(n < 20000);
        sweep(size, PLAN_CURVE_QUINTIC, count);
        shake(2, count - 2, size * pow(10, between(-6, -1)));
        const double worst = worst_need();
        if (worst < 1.01 || worst > 50)
            continue;
        done++;
        const int err = solve(PLAN_FIT_SMOOTH, &fit);
        if (err < 0) {
            assert_int_equal(err, MOTION_E_LIMIT);
            refused++;
            continue;
        }
        rounds = fit.rounds > rounds ? fit.rounds : rounds;
        assert_true(is_inside(&fit));
        for (uint32_t i = 0; i < count; i++)
            assert_true(
                motion_fixed_abs(fit.axis[0].key[i].key.pos_q32 -
                                 shaken[i].key.pos_q32) <=
                (i == 0 || i + 1 == count ? 0 : (uint64_t)tolerances[0]));
        plan_fit_free(&fit);
    }
    print_message("%u moves, %u refused, at most %u rounds\n", done, refused,
                  rounds);
    assert_true(refused < done / 10);
}

/* The half of the keys that does not shake stays to the bit. */
static void a_shake_is_smoothed_where_it_is(void **state)
{
    struct plan_fit fit;
    unsigned moved = 0;

    (void)state;
    seed_from("shake");
    sweep(100, PLAN_CURVE_QUINTIC, SHAKEN);
    shake(36, 50, 0.02);
    shaken[40].fixed = PLAN_FIXED_VALUE;
    tolerances[0] = UNIT / 10;
    assert_true(worst_need() > 2);
    if (solve(PLAN_FIT_SMOOTH, &fit) < 0)
        fail_msg("%s", error.text);
    assert_true(is_inside(&fit));
    for (uint32_t i = 0; i < SHAKEN; i++) {
        const uint64_t by = motion_fixed_abs(fit.axis[0].key[i].key.pos_q32 -
                                             shaken[i].key.pos_q32);
        assert_true(by <= (uint64_t)tolerances[0]);
        assert_true(by == 0 || (i > 25 && i != 40));
        moved += by > 0;
    }
    print_message("%u keys moved in %u rounds\n", moved, fit.rounds);
    assert_true(moved > 5);
    plan_fit_free(&fit);
}

/* --- by hand --------------------------------------------------------------- */

static void by_hand(uint32_t count, const double t[], const double p[],
                    double vel, double acc, double jerk)
{
    move = (struct plan_move){ .axis = axes, .axis_count = 1 };
    axes[0] = (struct plan_axis){ .name = "dolly",
                                  .curve = PLAN_CURVE_SCURVE,
                                  .k1_q32 = UNIT / 3,
                                  .k2_q32 = 2 * (UNIT / 3),
                                  .key = keys[0],
                                  .key_count = count };
    for (uint32_t i = 0; i < count; i++)
        keys[0][i] =
            (struct plan_key){ .key = { .t_ns_q12 = llrint(t[i] * (double)SEC),
                                        .pos_q32 =
                                            llrint(p[i] * (double)UNIT) } };
    limits[0] = (struct plan_limit){ -1000 * UNIT,
                                     1000 * UNIT,
                                     llrint(vel * (double)UNIT),
                                     llrint(acc * (double)UNIT),
                                     llrint(jerk * (double)UNIT),
                                     0 };
}

static void expect(enum plan_fit_method method, uint32_t count,
                   const double want[])
{
    struct plan_fit fit;

    if (solve(method, &fit) < 0)
        fail_msg("%s", error.text);
    assert_int_equal(fit.knots, count);
    for (uint32_t i = 1; i < count; i++)
        if (fabs((double)fit.to_ns_q12[i] / (double)SEC - want[i]) >
            1.1e-6 * i) /* up to whole microseconds */
            fail_msg("key %u at %.9g s, expected %.9g", i + 1,
                     (double)fit.to_ns_q12[i] / (double)SEC, want[i]);
    plan_fit_free(&fit);
}

/* Of rest-to-rest spans the time goes with the speed: 0 .. 10 in 1 s needs twice
 * the time, 10 .. 12 in 1 s has time left. */
static void a_span_gets_what_it_needs(void **state)
{
    static const double t[] = { 0, 1, 2, 3 }, p[] = { 0, 10, 12, 12 };

    (void)state;
    by_hand(4, t, p, 1e6, 1e6, 0);
    struct motion_track track;
    assert_int_equal(plan_axis_track(&axes[0], &track, &error), 0);
    const double vel = peak_of(&track, MOTION_VEL) / (double)UNIT;
    plan_track_free(&track);
    by_hand(4, t, p, vel / 2, 1e6, 0);
    expect(PLAN_FIT_STRETCH, 4, (const double[]){ 0, 2, 4, 6 });
    expect(PLAN_FIT_LOCAL, 4, (const double[]){ 0, 2, 3, 4 });
    keys[0][3].fixed = PLAN_FIXED_TIME;
    /* the second needs 0.4 s, the third nothing: 0.6 and 1 s are left */
    expect(PLAN_FIT_LOCAL, 4, (const double[]){ 0, 2, 2 + 1 - 0.6 / 1.6, 3 });
    struct plan_fit fit;
    assert_int_equal(solve(PLAN_FIT_STRETCH, &fit), MOTION_E_LIMIT);
    assert_non_null(strstr(error.text, "key 4 of axis dolly is fixed at 3 s"));
    keys[0][3].fixed = 0;
    keys[0][1].fixed = PLAN_FIXED_TIME;
    assert_int_equal(solve(PLAN_FIT_LOCAL, &fit), MOTION_E_LIMIT);
    assert_non_null(strstr(error.text, "up to it 2 s are needed"));
}

/* The key behind a fixed one, made later by stretching, takes the curve above the
 * range; the reason is the fixed key all the same, and of two the first that is
 * in the way. */
static void a_fixed_key_is_the_reason_also_where_the_curve_swings(void **state)
{
    static const double t[] = { 0, 2, 4 }, p[] = { 0, 500, 900 };
    struct plan_fit fit;

    (void)state;
    by_hand(3, t, p, 200, 400, 2000);
    axes[0].curve = PLAN_CURVE_QUINTIC;
    axes[0].first = axes[0].last = MOTION_SPLINE_REST;
    limits[0].pos_max_q32 = 1000 * UNIT;
    keys[0][1].fixed = PLAN_FIXED_TIME;
    assert_int_equal(solve(PLAN_FIT_STRETCH, &fit), MOTION_E_LIMIT);
    assert_non_null(strstr(error.text, "key 2 of axis dolly is fixed at 2 s: "
                                       "from 0 s up to it 3.8"));
    keys[0][2].fixed = PLAN_FIXED_TIME;
    assert_int_equal(solve(PLAN_FIT_STRETCH, &fit), MOTION_E_LIMIT);
    assert_non_null(strstr(error.text, "key 2 of axis dolly is fixed at 2 s"));
}

static void what_fits_is_left_to_the_bit(void **state)
{
    static const double t[] = { 0.3, 1.123456789, 2 }, p[] = { 0, 10, 12 };

    (void)state;
    by_hand(3, t, p, 1e6, 1e6, 0);
    struct plan_fit fit;
    assert_int_equal(solve(PLAN_FIT_LOCAL, &fit), MOTION_OK);
    for (uint32_t i = 0; i < 3; i++)
        assert_int_equal(fit.axis[0].key[i].key.t_ns_q12,
                         keys[0][i].key.t_ns_q12);
    assert_int_equal(fit.by_axis[0], PLAN_AXES_MAX);
    plan_fit_free(&fit);
}

static void what_time_does_not_cure_is_refused(void **state)
{
    static const double t[] = { 0, 1, 2 }, p[] = { 0, 10, 12 };
    struct plan_fit fit;
    struct plan_path *const some_path = (struct plan_path *)&axes[1];

    (void)state;
    by_hand(3, t, p, 1, 1, 0);
    axes[0].curve = PLAN_CURVE_LINEAR;
    assert_int_equal(solve(PLAN_FIT_LOCAL, &fit), MOTION_E_LIMIT);
    assert_non_null(strstr(error.text, "steps in velocity"));
    by_hand(3, t, p, 1, 1, 0);
    limits[0].pos_max_q32 = 11 * UNIT;
    assert_int_equal(solve(PLAN_FIT_STRETCH, &fit), MOTION_E_LIMIT);
    assert_non_null(strstr(error.text, "above its highest"));
    by_hand(3, t, p, 1, 1, 0);
    move.path = some_path;
    assert_int_equal(solve(PLAN_FIT_STRETCH, &fit), MOTION_E_ARG);
    assert_non_null(strstr(error.text, "a path"));
    by_hand(3, t, p, 1e-9, 1, 0);
    assert_int_equal(solve(PLAN_FIT_LOCAL, &fit), MOTION_E_LIMIT);
}

/* Corners of a given length do not become longer: several rounds. */
static void rounded_corners_fit_too(void **state)
{
    static const double t[] = { 0, 1, 2, 3 }, p[] = { 0, 0, 12, 12 };
    struct plan_fit fit;

    (void)state;
    for (int method = PLAN_FIT_STRETCH; method <= PLAN_FIT_LOCAL; method++) {
        by_hand(4, t, p, 100, 20, 0);
        axes[0].curve = PLAN_CURVE_ROUNDED;
        axes[0].blend_ns_q12 = SEC / 5;
        assert_int_equal(solve((enum plan_fit_method)method, &fit), MOTION_OK);
        assert_true(is_inside(&fit));
        plan_fit_free(&fit);
    }
}

/* --- ranges and frames -------------------------------------------------------- */

/* Keys inside 0 .. 100, many of them at its ends, in times of frames at a rate whose
 * frames are no whole microseconds. */
static void any_move_in_a_range(enum plan_curve curve)
{
    const uint32_t count = (uint32_t)pick(4, KEYS_MAX);
    int64_t frame = 0;

    move = (struct plan_move){
        .axis = axes, .axis_count = 1, .fps_num = 24000, .fps_den = 1001
    };
    axes[0] = (struct plan_axis){
        .key = keys[0], .key_count = count, .curve = curve, .name = "a"
    };
    for (uint32_t i = 0; i < count; i++) {
        const int64_t at = pick(0, 5);
        keys[0][i] = (struct plan_key){
            .key = { .t_ns_q12 =
                         motion_fixed_muldiv_sat(frame * 1001, SEC, 24000),
                     .pos_q32 = (at <= 1   ? 0
                                 : at == 2 ? 100
                                           : pick(0, 100)) *
                                UNIT },
        };
        frame += pick(2, 40);
    }
    limits[0] =
        (struct plan_limit){ 0,          100 * UNIT,  pick(20, 200) * UNIT,
                             400 * UNIT, 4000 * UNIT, PERIOD_NS };
}

static void curves_stay_in_a_range_that_their_keys_keep(void **state)
{
    unsigned left = 0, stand = 0, refused = 0;

    (void)state;
    seed_from("range");
    for (int n = 0; n < check_cases(600); n++) {
        const int method = n % 2 == 0 ? PLAN_FIT_LOCAL : PLAN_FIT_STRETCH;
        struct motion_track track;
        struct plan_violation first;
        struct plan_fit fit;
        any_move_in_a_range(PLAN_CURVE_QUINTIC);
        on_frames = n % 3 == 0;
        assert_int_equal(plan_axis_track(&axes[0], &track, &error), MOTION_OK);
        left += plan_check_track(&track, &limits[0], &first, 1) > 0 &&
                first.kind <= PLAN_POS_HIGH;
        plan_track_free(&track);
        if (solve((enum plan_fit_method)method, &fit) < 0) {
            assert_non_null(strstr(error.text, "other keys would"));
            refused++;
            continue;
        }
        judge(n, &fit);
        for (uint32_t i = 0; i < axes[0].key_count; i++)
            stand += fit.axis[0].key[i].key.has_vel;
        for (uint32_t k = 0; k < fit.knots && on_frames; k++) {
            int64_t frame;
            assert_int_equal(motion_fixed_muldiv(fit.to_ns_q12[k], 24000,
                                                 1001 * SEC, &frame),
                             MOTION_OK);
            if (fit.to_ns_q12[k] !=
                motion_fixed_muldiv_sat(frame * 1001, SEC, 24000))
                fail_msg("case %d: knot %u is on no frame", n, k);
        }
        plan_fit_free(&fit);
    }
    on_frames = false;
    print_message("%u of %d left their range, %u keys got a velocity, %u "
                  "refused\n",
                  left, check_cases(600), stand, refused);
    assert_true(left > (unsigned)check_cases(200));
    assert_true(refused == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_span_gets_what_it_needs),
        cmocka_unit_test(a_fixed_key_is_the_reason_also_where_the_curve_swings),
        cmocka_unit_test(what_fits_is_left_to_the_bit),
        cmocka_unit_test(what_time_does_not_cure_is_refused),
        cmocka_unit_test(rounded_corners_fit_too),
        cmocka_unit_test(repaired_moves_break_no_limit),
        cmocka_unit_test(fixed_keys_are_kept_to_the_bit),
        cmocka_unit_test(smoothed_moves_break_no_limit),
        cmocka_unit_test(shaken_moves_are_smoothed),
        cmocka_unit_test(a_shake_is_smoothed_where_it_is),
        cmocka_unit_test(curves_stay_in_a_range_that_their_keys_keep),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
