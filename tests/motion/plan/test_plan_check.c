/* tests/motion/plan/test_plan_check.c - limits and steps that plan_check_track
 * must find, and rounding that it must not. */
#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/ease.h"
#include "motion/plan/check.h"
#include "tests/support/check.h"

#define ONE MOTION_FIXED_ONE_Q32
#define SEC MOTION_FIXED_S_Q12
#define ACC MOTION_FIXED_ONE_Q32

static struct motion_segment storage[200];
static struct motion_track track;
static struct plan_violation found[64];

static void start_at(int64_t pos_q32)
{
    motion_track_init(&track, storage, ARRAY_LEN(storage), pos_q32);
}

static void line(double seconds, double to)
{
    assert_int_equal(0,
                     motion_track_append_line(&track, (int64_t)(seconds * SEC),
                                              (int64_t)(to * ONE)));
}

static void cubic(double seconds, double v0, double to, double v1)
{
    const struct motion_state end = { .pos_q32 = (int64_t)(to * ONE),
                                      .vel_q32 = (int64_t)(v1 * ONE) };
    assert_int_equal(0,
                     motion_track_append_cubic(&track, (int64_t)(seconds * SEC),
                                               (int64_t)(v0 * ONE), &end));
}

static struct plan_limit limits(double low, double high, double vel, double acc,
                                double jerk)
{
    return (struct plan_limit){ (int64_t)(low * ONE),  (int64_t)(high * ONE),
                                (int64_t)(vel * ONE),  (int64_t)(acc * ACC),
                                (int64_t)(jerk * ACC), 0 };
}

static void expect_entry(uint32_t i, enum plan_violation_kind kind,
                         double seconds, int64_t value, int64_t limit,
                         int64_t slack)
{
    const struct plan_violation *v = &found[i];
    const double t = (double)v->t_ns_q12 / SEC;

    if (v->kind != kind || fabs(t - seconds) > 1e-6 ||
        llabs(v->value - value) > slack || v->limit != limit)
        fail_msg("entry %u: kind %d at %.9g s: %" PRId64 " limit %" PRId64,
                 (unsigned)i, (int)v->kind, t, v->value, v->limit);
}

static uint32_t check(const struct plan_limit *limit)
{
    memset(found, 0xa5, sizeof found);
    return plan_check_track(&track, limit, found, ARRAY_LEN(found));
}

/* --- limits --------------------------------------------------------------- */

static void a_move_inside_its_limits_is_clean(void **state)
{
    /* rest to rest, 10 in 2 s: v 7.5, a 15, j 15 */
    const struct plan_limit limit = limits(0, 10, 7.5, 15, 0);

    (void)state;
    start_at(0);
    cubic(2, 0, 10, 0);
    assert_int_equal(check(&limit), 0);
}

static void each_limit_is_found_where_the_cubic_breaks_it(void **state)
{
    /* p = 10 (3 u^2 - 2 u^3), u = t/2: v = 7.5 at 1 s, a = 15 at 0 and -15 at
     * 2 s, j = -15 throughout */
    static const struct {
        const char *name;
        double low, high, vel, acc, jerk;
        enum plan_violation_kind kind;
        double at;
        double value, scale;
    } rows[] = {
        { "vel", 0, 10, 7.4999, 15, 0, PLAN_VEL, 1, 7.5, (double)ONE },
        { "acc", 0, 10, 7.5, 14.999, 0, PLAN_ACC, 0, 15, (double)ACC },
        { "low", 0.25, 10, 7.5, 15, 0, PLAN_POS_LOW, 0, 0, (double)ONE },
        { "high", 0, 9.75, 7.5, 15, 0, PLAN_POS_HIGH, 2, 10, (double)ONE },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct plan_limit limit = limits(
            rows[i].low, rows[i].high, rows[i].vel, rows[i].acc, rows[i].jerk);
        start_at(0);
        cubic(2, 0, 10, 0);
        assert_int_equal(check(&limit), 1);
        assert_int_equal(found[0].kind, rows[i].kind);
        const int64_t of = rows[i].kind == PLAN_POS_LOW    ? limit.pos_min_q32
                           : rows[i].kind == PLAN_POS_HIGH ? limit.pos_max_q32
                           : rows[i].kind == PLAN_VEL      ? limit.vel_q32
                                                           : limit.acc_q32;
        expect_entry(0, rows[i].kind, rows[i].at,
                     (int64_t)(rows[i].value * rows[i].scale), of, 2);
    }
}

static void negative_values_break_limits_too(void **state)
{
    const struct plan_limit limit = limits(-10, 0, 7, 14, 0);

    (void)state;
    start_at(0);
    cubic(2, 0, -10, 0);
    assert_int_equal(check(&limit), 2);
    expect_entry(0, PLAN_ACC, 0, -15 * ACC, 14 * ACC, 1);
    expect_entry(1, PLAN_VEL, 1, (int64_t)(-7.5 * ONE), 7 * ONE, 2);
}

static void jerk_and_steps_of_acceleration_need_a_jerk_limit(void **state)
{
    const struct plan_limit without = limits(0, 10, 8, 16, 0);
    const struct plan_limit with = limits(0, 10, 8, 16, 14);

    (void)state;
    start_at(0);
    cubic(2, 0, 10, 0);
    assert_int_equal(check(&without), 0);
    assert_int_equal(check(&with), 3);
    expect_entry(0, PLAN_JERK, 0, -15 * ACC, 14 * ACC, 1);
    expect_entry(1, PLAN_ACC_STEP, 0, 15 * ACC, 0, 1);
    expect_entry(2, PLAN_ACC_STEP, 2, 15 * ACC, 0, 1);
}

static void a_limit_is_exact_to_the_last_unit(void **state)
{
    struct plan_limit limit = limits(-100, 100, 4, 100, 0);
    uint32_t all;

    (void)state;
    start_at(0);
    line(1, 4);
    limit.vel_q32 = 4 * ONE;
    assert_int_equal(check(&limit), 2); /* the steps from and to rest */
    limit.vel_q32 = 4 * ONE - 1;
    all = check(&limit);
    assert_int_equal(all, 3);
    limit.pos_max_q32 = 4 * ONE - 2; /* what sampling rounds */
    limit.vel_q32 = 4 * ONE;
    assert_int_equal(check(&limit), 2);
    limit.pos_max_q32 = 4 * ONE - 3;
    assert_int_equal(check(&limit), 3);
}

/* A cubic at 100 unit/s on average over T has a jerk of 1200 / T^2 and an
 * acceleration of 600 / T.  Both are over what 64 bits hold when T is short, and
 * so is what rounding of coefficients may add. */
static void a_peak_beyond_the_format_is_reported(void **state)
{
    const struct plan_limit limit = limits(-1, 1, 1e3, 2e9, 1e9);

    (void)state;
    for (double T = 1e-3; T > 5e-11; T *= 0.1) {
        bool acc = false, jerk = false;
        start_at(0);
        cubic(T, 0, 100 * T, 0);
        const uint32_t all = check(&limit);
        for (uint32_t k = 0; k < all; k++) {
            acc |= found[k].kind == PLAN_ACC;
            jerk |= found[k].kind == PLAN_JERK;
        }
        if (!jerk || acc != (600 / T > 2e9))
            fail_msg("%g s: acceleration %s, jerk %s", T, acc ? "over" : "fits",
                     jerk ? "over" : "fits");
    }
}

/* --- merging -------------------------------------------------------------- */

static void neighbours_over_one_limit_are_one_entry_with_the_worst(void **state)
{
    const struct plan_limit limit = limits(-1000, 1000, 1, 1e9, 0);
    double at = 0;

    (void)state;
    start_at(0);
    /* speeds 2 3 5 4 | 0.5 | -2 -6 : steps of velocity in between */
    static const double speed[] = { 2, 3, 5, 4, 0.5, -2, -6 };
    for (size_t i = 0; i < ARRAY_LEN(speed); i++)
        line(1, at += speed[i]);
    const uint32_t all = check(&limit);
    uint32_t over = 0, stepped = 0;
    for (uint32_t i = 0; i < all; i++) {
        over += found[i].kind == PLAN_VEL;
        stepped += found[i].kind == PLAN_VEL_STEP;
        if (i > 0)
            assert_true(found[i - 1].t_ns_q12 <= found[i].t_ns_q12);
    }
    assert_int_equal(over, 2);
    assert_int_equal(stepped, 8);
    assert_int_equal(all, 10);
    for (uint32_t i = 0; i < all; i++) {
        if (found[i].kind != PLAN_VEL)
            continue;
        if (found[i].t_ns_q12 < 4 * SEC)
            expect_entry(i, PLAN_VEL, 2, 5 * ONE, ONE, 1);
        else
            expect_entry(i, PLAN_VEL, 6, -6 * ONE, ONE, 1);
    }
}

static void a_small_room_is_filled_and_the_rest_counted(void **state)
{
    const struct plan_limit limit = limits(-1000, 1000, 100, 1e9, 0);
    double at = 0;

    (void)state;
    start_at(0);
    for (int i = 1; i <= 50; i++)
        line(1, at += i % 2 ? 3 : 1);
    for (uint32_t space = 0; space < 60; space += 7) {
        memset(found, 0xa5, sizeof found);
        assert_int_equal(plan_check_track(&track, &limit, found, space), 51);
        for (uint32_t i = 0; i < space && i < 51; i++)
            assert_int_equal(found[i].t_ns_q12, (int64_t)i * SEC);
        if (space < 51)
            assert_int_equal((unsigned)found[space].kind, 0xa5a5a5a5u);
    }
    assert_int_equal(plan_check_track(&track, &limit, NULL, 0), 51);
}

/* The worst of a stretch is remembered when its entry is beyond the room. */
static void a_stretch_beyond_the_room_is_counted_once(void **state)
{
    const struct plan_limit limit = limits(-1000, 1000, 1, 1e9, 0);

    (void)state;
    start_at(0);
    line(1, 2);
    line(1, 5);
    line(1, 7);
    /* 4 steps and one stretch */
    assert_int_equal(plan_check_track(&track, &limit, found, 1), 5);
    assert_int_equal(found[0].kind, PLAN_VEL_STEP);
}

/* --- steps ---------------------------------------------------------------- */

static void starting_and_stopping_at_speed_are_steps(void **state)
{
    const struct plan_limit limit = limits(-1, 10, 10, 100, 0);

    (void)state;
    start_at(0);
    line(2, 6);
    assert_int_equal(check(&limit), 2);
    expect_entry(0, PLAN_VEL_STEP, 0, 3 * ONE, 0, 1);
    expect_entry(1, PLAN_VEL_STEP, 2, 3 * ONE, 0, 1);
}

static void a_step_is_positive_whichever_way_it_goes(void **state)
{
    const struct plan_limit limit = limits(-10, 10, 10, 100, 1e6);

    (void)state;
    start_at(0);
    cubic(1, 0, 1, 0);  /* ends with a = -6 */
    cubic(1, 0, -1, 0); /* starts with a = -12 */
    assert_int_equal(check(&limit), 3);
    expect_entry(0, PLAN_ACC_STEP, 0, 6 * ACC, 0, 1);
    expect_entry(1, PLAN_ACC_STEP, 1, 6 * ACC, 0, 1);
    expect_entry(2, PLAN_ACC_STEP, 2, 12 * ACC, 0, 1);
}

static void the_smallest_real_step_is_seen(void **state)
{
    const struct plan_limit limit = limits(-10, 10, 10, 100, 0);

    (void)state;
    for (int units = -6; units <= 6; units += 12) {
        struct motion_state end = { .pos_q32 = 2 * ONE, .vel_q32 = 0 };
        start_at(0);
        cubic(1, 0, 1, 1);
        assert_int_equal(
            0, motion_track_append_cubic(&track, SEC, ONE + units, &end));
        assert_int_equal(check(&limit), 1);
        expect_entry(0, PLAN_VEL_STEP, 1, 6, 0, 1);
    }
}

/* With set points a period apart a hundredth of what the limits let happen in
 * one of them passes, and no more. */
static void a_hundredth_of_a_period_is_no_step(void **state)
{
    /* acc, jerk, period, the largest step of velocity that passes */
    static const struct {
        double acc, jerk, vel;
        int64_t period_ns;
    } rows[] = {
        { 100, 0, 1e-3, 1000000 },
        { 100, 0, 2e-2, 20000000 },
        { 1e6, 1e6, 1e-2, 1000000 }, /* by jerk and period squared */
        { 100, 1e9, 1.25e-4, 125000 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        for (int over = 0; over < 2; over++) {
            const double by = rows[i].vel * (over ? 1.01 : 0.98);
            struct motion_state end = { .pos_q32 = 2 * ONE };
            struct plan_limit limit =
                limits(-10, 10, 10, rows[i].acc, rows[i].jerk);
            limit.period_ns = rows[i].period_ns;
            limit.jerk_q32 = rows[i].jerk > 0 ? limit.jerk_q32 : 0;
            start_at(0);
            cubic(1, 0, 1, 1);
            assert_int_equal(
                0, motion_track_append_cubic(&track, SEC,
                                             (int64_t)((1 + by) * ONE), &end));
            uint32_t steps = 0;
            const uint32_t all = check(&limit);
            for (uint32_t k = 0; k < all; k++)
                steps += found[k].kind == PLAN_VEL_STEP;
            if (steps != (uint32_t)over)
                fail_msg("row %zu, %s: %u steps", i, over ? "over" : "inside",
                         steps);
        }
}

/* From rest with an acceleration of 1 % of jerk times period, and 1 % more. */
static void a_step_of_acceleration_is_measured_by_the_period(void **state)
{
    (void)state;
    for (int over = 0; over < 2; over++) {
        struct plan_limit limit = limits(-10, 10, 10, 100, 0);
        limit.jerk_q32 = (int64_t)((over ? 590e3 : 610e3) * ACC);
        limit.period_ns = 1000000;
        start_at(0);
        cubic(1, 0, 1, 0); /* 6 unit/s2 at either end: 6000 unit/s3 in 1 ms */
        assert_int_equal(check(&limit), over ? 2 : 0);
    }
}

/* Long, short, large and tiny segments that are meant to be smooth. */
static void rounding_is_not_taken_for_a_step(void **state)
{
    static const double seconds[] = { 1e-6, 1e-4, 1e-2, 1, 100, 1e5 };
    static const double units[] = { 1e-6, 1e-3, 1, 1e3, 1e6, 1e8 };
    struct plan_limit limit = { INT64_MIN, INT64_MAX, INT64_MAX,
                                INT64_MAX, INT64_MAX, 0 };
    uint32_t tried = 0;

    (void)state;
    for (size_t i = 0; i < 6 * 6 * 6; i++) {
        const double T0 = seconds[i % 6], T1 = seconds[i / 6 % 6];
        const double p = units[i / 36];
        const double v = p / (T0 > T1 ? T0 : T1) * 0.7;
        const double a = v / (T0 > T1 ? T0 : T1) * 0.3;
        if (v > 1e9 || a > 2e9) /* beyond the formats */
            continue;
        const struct motion_state rest = { 0, 0, 0, 0 };
        const struct motion_state middle = { (int64_t)(p * ONE),
                                             (int64_t)(v * ONE),
                                             (int64_t)(a * ACC), 0 };
        const struct motion_state end = { (int64_t)(2 * p * ONE), 0, 0, 0 };
        start_at(0);
        if (motion_track_append_quintic(&track, (int64_t)(T0 * SEC), &rest,
                                        &middle) ||
            motion_track_append_quintic(&track, (int64_t)(T1 * SEC), &middle,
                                        &end))
            continue;
        tried++;
        const uint32_t all = check(&limit);
        for (uint32_t k = 0; k < all && k < ARRAY_LEN(found); k++)
            if (found[k].kind >= PLAN_VEL_STEP)
                fail_msg("%g s, %g s, %g: kind %d at %" PRId64 ": %" PRId64, T0,
                         T1, p, (int)found[k].kind, found[k].t_ns_q12,
                         found[k].value);
    }
    assert_in_range(tried, 100, 216);
}

static void an_empty_track_is_judged_by_where_it_stands(void **state)
{
    const struct plan_limit limit = limits(-1, 1, 1, 1, 1);

    (void)state;
    start_at(0);
    assert_int_equal(check(&limit), 0);
    start_at(2 * ONE);
    assert_int_equal(check(&limit), 1);
    expect_entry(0, PLAN_POS_HIGH, 0, 2 * ONE, ONE, 0);
    start_at(-2 * ONE);
    assert_int_equal(check(&limit), 1);
    expect_entry(0, PLAN_POS_LOW, 0, -2 * ONE, -ONE, 0);
}

/* --- against sampling ----------------------------------------------------- */

/* Whatever dense sampling finds over a limit, the check finds; what the check
 * finds over is reached at the time it says. */
static void the_check_agrees_with_dense_sampling(void **state)
{
    const struct plan_limit limit = limits(-3, 3, 4, 20, 0);
    const char *given = getenv("SEED");
    uint64_t seed = given ? strtoull(given, NULL, 0) : 12345;

    (void)state;
    print_message("sampling: SEED=%" PRIu64 "\n", seed);
    for (int round = 0; round < 300; round++) {
        int64_t worst_vel = 0, worst_pos = 0;
        start_at(0);
        for (int i = 0; i < 6; i++)
            cubic((double)check_random_in(&seed, 25, 124) / 50,
                  (double)track.end.vel_q32 / ONE,
                  (double)check_random_in(&seed, -32, 31) / 10,
                  (double)check_random_in(&seed, -30, 29) / 10);
        for (int64_t t = 0; t <= track.end_ns_q12; t += SEC / 500) {
            struct motion_state s;
            motion_track_state(&track, t, &s);
            if (llabs(s.vel_q32) > worst_vel)
                worst_vel = llabs(s.vel_q32);
            if (llabs(s.pos_q32) > worst_pos)
                worst_pos = llabs(s.pos_q32);
        }
        const uint32_t all = check(&limit);
        int64_t said_vel = 0, said_pos = 0;
        for (uint32_t i = 0; i < all && i < ARRAY_LEN(found); i++) {
            struct motion_state s;
            motion_track_state(&track, found[i].t_ns_q12, &s);
            if (found[i].kind == PLAN_VEL) {
                assert_true(llabs(s.vel_q32 - found[i].value) < 100);
                if (llabs(found[i].value) > said_vel)
                    said_vel = llabs(found[i].value);
            }
            if (found[i].kind <= PLAN_POS_HIGH) {
                assert_true(llabs(s.pos_q32 - found[i].value) < 100);
                if (llabs(found[i].value) > said_pos)
                    said_pos = llabs(found[i].value);
            }
        }
        if (worst_vel > limit.vel_q32)
            assert_true(said_vel >= worst_vel);
        if (worst_pos > limit.pos_max_q32 + 2)
            assert_true(said_pos >= worst_pos);
    }
}

/* --- where extremes are looked for ---------------------------------------- */

struct exact_source {
    uint32_t next;
    struct plan_facts facts[200];
    bool is_inside[200];
    uint32_t known; /* how many of them were */
};

static const struct motion_segment *exact_next(void *context)
{
    struct exact_source *source = context;

    return source->next < track.count ? &track.segment[source->next++] : NULL;
}

/* All of them known beforehand. */
static struct plan_facts *exact_facts(void *context)
{
    struct exact_source *source = context;
    const struct motion_segment *segment = &track.segment[source->next - 1];

    struct plan_facts *facts = &source->facts[source->next - 1];

    plan_facts_of(segment, facts);
    plan_facts_exact(segment, facts);
    return facts;
}

static bool *exact_is_inside(void *context)
{
    struct exact_source *source = context;
    bool *is_inside = &source->is_inside[source->next - 1];

    source->known += *is_inside;
    return is_inside;
}

/* Limits about as large as what the track needs. */
static void bounds_change_no_violation(void **state)
{
    static struct plan_violation want[1000], is[1000];
    uint64_t seed = 8;
    uint32_t all = 0, known = 0;

    (void)state;
    for (int round = 0; round < 300; round++) {
        struct plan_limit limit =
            limits(-40, 40, (double)check_random_in(&seed, 5, 400),
                   (double)check_random_in(&seed, 5, 4000),
                   (double)check_random_in(&seed, 0, 40000));
        struct motion_state end = { 0 };
        start_at(0);
        for (int i = 0; i < 30; i++) {
            const struct motion_state start = end;
            end = (struct motion_state){
                check_random_in(&seed, -45 * ONE, 45 * ONE),
                check_random_in(&seed, -90 * ONE, 90 * ONE),
                check_random_in(&seed, -90 * ONE, 90 * ONE), 0
            };
            assert_int_equal(0, motion_track_append_quintic(
                                    &track,
                                    check_random_in(&seed, SEC / 5, 2 * SEC),
                                    &start, &end));
        }
        static struct exact_source exact;
        memset(&exact, 0, sizeof exact);
        const struct plan_check_source source = { exact_next, &exact,
                                                  exact_facts,
                                                  exact_is_inside };
        const uint32_t count =
            plan_check_track(&track, &limit, is, ARRAY_LEN(is));
        /* The second time what is inside is known. */
        for (unsigned time = 0; time < 2; time++) {
            exact.next = 0;
            assert_int_equal(count, plan_check_source(&track, &source, &limit,
                                                      want, ARRAY_LEN(want)));
            for (uint32_t i = 0; i < count; i++)
                if (is[i].kind != want[i].kind ||
                    is[i].value != want[i].value ||
                    is[i].t_ns_q12 != want[i].t_ns_q12)
                    fail_msg("violation %u of round %d", (unsigned)i, round);
        }
        all += count;
        known += exact.known;
    }
    assert_in_range(all, 2000, 100000);
    assert_in_range(known, 500, 300 * 30);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_move_inside_its_limits_is_clean),
        cmocka_unit_test(each_limit_is_found_where_the_cubic_breaks_it),
        cmocka_unit_test(negative_values_break_limits_too),
        cmocka_unit_test(jerk_and_steps_of_acceleration_need_a_jerk_limit),
        cmocka_unit_test(a_limit_is_exact_to_the_last_unit),
        cmocka_unit_test(a_peak_beyond_the_format_is_reported),
        cmocka_unit_test(
            neighbours_over_one_limit_are_one_entry_with_the_worst),
        cmocka_unit_test(a_small_room_is_filled_and_the_rest_counted),
        cmocka_unit_test(a_stretch_beyond_the_room_is_counted_once),
        cmocka_unit_test(starting_and_stopping_at_speed_are_steps),
        cmocka_unit_test(a_step_is_positive_whichever_way_it_goes),
        cmocka_unit_test(the_smallest_real_step_is_seen),
        cmocka_unit_test(a_hundredth_of_a_period_is_no_step),
        cmocka_unit_test(a_step_of_acceleration_is_measured_by_the_period),
        cmocka_unit_test(rounding_is_not_taken_for_a_step),
        cmocka_unit_test(an_empty_track_is_judged_by_where_it_stands),
        cmocka_unit_test(the_check_agrees_with_dense_sampling),
        cmocka_unit_test(bounds_change_no_violation),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
