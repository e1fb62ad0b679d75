/* tests/motion/otg/test_otg_exact.c - plans in exact integers; see
 * motion/otg/otg.h, docs/OTG.md section 5. */
#include <inttypes.h>
#include <math.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/otg.h"
#include "motion/otg/replan.h"
#include "tests/support/check.h"

#define ONE    MOTION_FIXED_ONE_Q32
#define ACC    MOTION_FIXED_ONE_Q32
#define SECOND MOTION_FIXED_S_Q12

static const struct motion_otg_move usual = {
    .goal.pos_q32 = 100 * ONE,
    .limit = { 10 * ONE, -10 * ONE, 20 * ACC, -20 * ACC, 200 * ACC, 0 },
};

static struct motion_otg_plan plan_of(const struct motion_otg_move *move)
{
    struct motion_otg_plan plan;
    enum motion_otg_field field;
    int err = motion_otg_make(move, &plan, &field);
    if (err < 0)
        fail_msg("%s: %s", motion_err_text(err), motion_otg_field_text(field));
    return plan;
}

/* --- constant jerk alone meets the goal ----------------------------------- */

struct end {
    long double p, v, a;
};

/* By constant jerk, phase after phase. */
static struct end run(const struct motion_otg_plan *plan)
{
    struct end e = { 0, ldexpl((long double)plan->start_vel_q32, -32),
                     ldexpl((long double)plan->start_acc, -plan->acc_bits) };
    for (int i = 0; i < plan->count; i++) {
        long double t = (long double)plan->phase[i].dur_ns_q12 / 4096e9L;
        long double a =
            ldexpl((long double)plan->phase[i].acc, -plan->acc_bits);
        e.p += t * (e.v + t * (2 * e.a + a) / 6);
        e.v += t * (e.a + a) / 2;
        e.a = a;
    }
    return e;
}

static void constant_jerk_alone_ends_at_the_goal(void **state)
{
    (void)state;
    /* a long move with short ramps: 2^24 s against 2^-3 s */
    for (int64_t d = 1; d <= (int64_t)1 << 20; d *= 4) {
        struct motion_otg_move move = usual;
        move.start.vel_q32 = ONE / 3;
        move.start.acc_q32 = -ACC / 7;
        move.goal.pos_q32 = d * ONE;
        move.goal.vel_q32 = ONE / 11;
        struct motion_otg_plan plan = plan_of(&move);
        struct end e = run(&plan);
        long double off = e.p / (long double)d - 1;
        if (fabsl(off) > 1e-16L || fabsl(e.v - 1 / 11.0L) > 1e-9L || e.a != 0)
            fail_msg("displacement %" PRId64 ": off by %Lg of it", d, off);
    }
}

/* --- ties ----------------------------------------------------------------- */

/* Highest velocity, at corners and where the acceleration passes zero. */
static long double peak(const struct motion_otg_plan *plan)
{
    long double v = ldexpl((long double)plan->start_vel_q32, -32), top = v;
    long double a = ldexpl((long double)plan->start_acc, -plan->acc_bits);
    for (int i = 0; i < plan->count; i++) {
        long double t = (long double)plan->phase[i].dur_ns_q12 / 4096e9L;
        long double to =
            ldexpl((long double)plan->phase[i].acc, -plan->acc_bits);
        if (a > 0 && to < 0 && v + a * a * t / (2 * (a - to)) > top)
            top = v + a * a * t / (2 * (a - to));
        v += t * (a + to) / 2;
        top = v > top ? v : top;
        a = to;
    }
    return top;
}

static void a_start_that_just_touches_the_limit_does_not_pass_it(void **state)
{
    (void)state;
    /* v0 + a0^2 / 2j = vx: 10 - 1/2, 3 - 2/3 of a second to it, and goals */
    static const struct {
        int64_t vel, acc, jerk; /* 12ths, whole, 2nds */
    } rows[] = {
        { 114, 10, 200 },
        { 102, 3, 9 },
        { 78, 15, 64 },
        { 118, 1, 6 },
    };
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct motion_otg_move move = usual;
        move.limit.jerk_q32 = rows[i].jerk * ACC / 2;
        int64_t ramp_q32 = rows[i].acc * rows[i].acc * ONE / rows[i].jerk;
        move.start.vel_q32 = 10 * ONE - ramp_q32;
        move.start.acc_q32 = rows[i].acc * ACC;
        struct motion_otg_plan plan = plan_of(&move);
        long double top = peak(&plan);
        /* the start itself is rounded to 2^-32 */
        if (top > 10 + ldexpl(1, -32))
            fail_msg("row %zu: start passes 10 by %Lg", i, top - 10);
        move.start = (struct motion_state){ 0 };
        move.goal.vel_q32 = 10 * ONE - ramp_q32;
        move.goal.acc_q32 = -rows[i].acc * ACC;
        plan = plan_of(&move);
        top = peak(&plan);
        if (top > 10 + ldexpl(1, -32))
            fail_msg("row %zu: goal passes 10 by %Lg", i, top - 10);
    }
}

/* --- the check refuses ---------------------------------------------------- */

static void the_check_sees_the_smallest_change(void **state)
{
    (void)state;
    struct motion_otg_move move = usual;
    struct motion_otg_plan good = plan_of(&move), bad;
    enum motion_otg_field field;
    assert_int_equal(motion_otg_check(&move, &good, &field), MOTION_OK);
    for (int i = 0; i < good.count; i++) {
        bad = good;
        bad.phase[i].acc += 64;
        assert_int_equal(motion_otg_check(&move, &bad, &field), MOTION_E_LIMIT);
        bad = good;
        bad.phase[i].dur_ns_q12 += 1;
        bad.dur_ns_q12 += 1;
        assert_int_equal(motion_otg_check(&move, &bad, &field), MOTION_E_LIMIT);
    }
    /* limits a hair below what the plan uses */
    struct motion_otg_move tight = move;
    tight.limit.vel_max_q32 -= tight.limit.vel_max_q32 >> 20;
    assert_int_equal(motion_otg_check(&tight, &good, &field), MOTION_E_LIMIT);
    assert_int_equal(field, MOTION_OTG_FIELD_VEL_MAX);
    tight = move;
    tight.limit.acc_max_q32 -= 2 << 16;
    assert_int_equal(motion_otg_check(&tight, &good, &field), MOTION_E_LIMIT);
    assert_int_equal(field, MOTION_OTG_FIELD_ACC_MAX);
    tight = move;
    tight.limit.jerk_q32 -= 2 << 16;
    assert_int_equal(motion_otg_check(&tight, &good, &field), MOTION_E_LIMIT);
    assert_int_equal(field, MOTION_OTG_FIELD_JERK);
    tight = move;
    tight.goal.pos_q32 += 1;
    assert_int_equal(motion_otg_check(&tight, &good, &field), MOTION_E_LIMIT);
    assert_int_equal(field, MOTION_OTG_FIELD_GOAL_POS);
}

static void a_cruise_outside_the_limits_is_refused(void **state)
{
    (void)state;
    struct motion_otg_move move = usual;
    enum motion_otg_field field;
    struct motion_otg_plan plan = plan_of(&move);
    /* the same plan for a lower limit and a start that is said to be outside */
    move.limit.vel_max_q32 = 9 * ONE;
    assert_int_equal(motion_otg_check(&move, &plan, &field), MOTION_E_LIMIT);
    assert_int_equal(field, MOTION_OTG_FIELD_VEL_MAX);
}

/* --- standing still for some time ----------------------------------------- */

static void an_axis_with_nowhere_to_go_waits(void **state)
{
    (void)state;
    struct motion_otg_move move = usual;
    move.goal.pos_q32 = 0;
    move.dur_ns_q12 = 3 * SECOND + 1;
    struct motion_otg_plan plan = plan_of(&move);
    assert_true(plan.dur_ns_q12 == 3 * SECOND + 1);
    struct motion_state at;
    motion_otg_state_at(&plan, SECOND, &at);
    assert_true(at.pos_q32 == 0 && at.vel_q32 == 0 && at.acc_q32 == 0);
}

/* Wherever that is. */
static void a_velocity_that_is_there_takes_no_time(void **state)
{
    (void)state;
    struct motion_otg_move move = { .mode = MOTION_OTG_VELOCITY };
    move.start = (struct motion_state){ 1785, 0, 4, 0 };
    move.goal = (struct motion_state){ -14898152897423, 0, 4, 0 };
    move.limit.acc_max_q32 = 16;
    move.limit.acc_min_q32 = -16;
    move.limit.jerk_q32 = 19;
    struct motion_otg_plan plan = plan_of(&move);
    assert_true(plan.count == 0 && plan.dur_ns_q12 == 0);
    assert_true(plan.goal_pos_q32 == move.start.pos_q32);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(constant_jerk_alone_ends_at_the_goal),
        cmocka_unit_test(a_start_that_just_touches_the_limit_does_not_pass_it),
        cmocka_unit_test(the_check_sees_the_smallest_change),
        cmocka_unit_test(a_cruise_outside_the_limits_is_refused),
        cmocka_unit_test(an_axis_with_nowhere_to_go_waits),
        cmocka_unit_test(a_velocity_that_is_there_takes_no_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
