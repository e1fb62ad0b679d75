/* tests/motion/otg/test_otg_requests.c - requests that are refused, and which
 * field the answer names: one axis, several, through points, replanned. */
#include <stddef.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/replan.h"
#include "motion/otg/sync.h"
#include "tests/motion/otg/otg_oracle.h"
#include "tests/support/check.h"

#define ONE    MOTION_FIXED_ONE_Q32
#define ACC    MOTION_FIXED_ONE_Q32
#define SECOND MOTION_FIXED_S_Q12
#define AXES   3

static const struct motion_otg_move usual = {
    .goal.pos_q32 = 100 * ONE,
    .limit = { 10 * ONE, -10 * ONE, 20 * ACC, -20 * ACC, 200 * ACC, 100 * ACC },
};

/* --- one field at a time -------------------------------------------------- */

struct request {
    size_t offset;
    int64_t value;
    int err;
    enum motion_otg_field field;
};

#define OF(name, value, err, field)                                            \
    {                                                                          \
        offsetof(struct motion_otg_move, name), value, MOTION_##err,           \
            MOTION_OTG_FIELD_##field                                           \
    }

/* Limits and start. */
static const struct request at_start[] = {
    OF(limit.vel_max_q32, 0, E_ARG, VEL_MAX),
    OF(limit.vel_max_q32, -1, E_ARG, VEL_MAX),
    OF(limit.vel_max_q32, INT64_MIN, E_ARG, VEL_MAX),
    OF(limit.vel_min_q32, 0, E_ARG, VEL_MIN),
    OF(limit.vel_min_q32, 1, E_ARG, VEL_MIN),
    OF(limit.vel_min_q32, INT64_MAX, E_ARG, VEL_MIN),
    OF(limit.vel_min_q32, INT64_MIN, E_RANGE, VEL_MIN),
    OF(limit.acc_max_q32, 0, E_ARG, ACC_MAX),
    OF(limit.acc_max_q32, -5, E_ARG, ACC_MAX),
    OF(limit.acc_max_q32, INT64_MIN, E_ARG, ACC_MAX),
    OF(limit.acc_min_q32, 0, E_ARG, ACC_MIN),
    OF(limit.acc_min_q32, 5, E_ARG, ACC_MIN),
    OF(limit.acc_min_q32, INT64_MAX, E_ARG, ACC_MIN),
    OF(limit.acc_min_q32, INT64_MIN, E_RANGE, ACC_MIN),
    OF(limit.jerk_q32, -1, E_ARG, JERK),
    OF(limit.jerk_q32, INT64_MIN, E_ARG, JERK),
    OF(limit.jerk_q32, 0, E_ARG, JERK_DOWN),
    OF(limit.jerk_down_q32, -1, E_ARG, JERK_DOWN),
    OF(limit.jerk_down_q32, INT64_MIN, E_ARG, JERK_DOWN),
    OF(start.vel_q32, INT64_MIN, E_RANGE, START_VEL),
    OF(start.acc_q32, INT64_MIN, E_RANGE, START_ACC),
    OF(start.acc_q32, INT64_MAX, E_RANGE, START_ACC),
};

/* And the goal. */
static const struct request at_goal[] = {
    OF(dur_ns_q12, -1, E_ARG, DURATION),
    OF(dur_ns_q12, INT64_MIN, E_ARG, DURATION),
    OF(goal.vel_q32, 10 * ONE + 1, E_LIMIT, GOAL_VEL),
    OF(goal.vel_q32, -10 * ONE - 1, E_LIMIT, GOAL_VEL),
    OF(goal.vel_q32, INT64_MAX, E_LIMIT, GOAL_VEL),
    OF(goal.vel_q32, INT64_MIN, E_RANGE, GOAL_VEL),
    OF(goal.acc_q32, 20 * ACC + 1, E_LIMIT, GOAL_ACC),
    OF(goal.acc_q32, -20 * ACC - 1, E_LIMIT, GOAL_ACC),
    OF(goal.acc_q32, INT64_MAX, E_RANGE, GOAL_ACC),
    OF(goal.acc_q32, INT64_MIN, E_RANGE, GOAL_ACC),
    OF(limit.vel_max_q32, 1, E_RANGE, GOAL_POS),
};

static struct motion_otg_move spoilt(const struct request *row)
{
    struct motion_otg_move move = usual;
    memcpy((char *)&move + row->offset, &row->value, sizeof row->value);
    return move;
}

static void expect_field(const struct request *row, int err,
                         enum motion_otg_field field, const char *who)
{
    if (err != row->err || field != row->field)
        fail_msg("%s, %s = %lld: %d %s", who, motion_otg_field_text(row->field),
                 (long long)row->value, err, motion_otg_field_text(field));
}

static void one_axis(const struct request *row)
{
    const struct motion_otg_move move = spoilt(row);
    struct motion_otg_plan plan = { .count = 7 };
    enum motion_otg_field field;
    int err = motion_otg_make(&move, &plan, &field);
    expect_field(row, err, field, "one axis");
    assert_int_equal(plan.count, 0); /* never a wrong profile */
    assert_int_equal(motion_otg_make(&move, &plan, NULL), row->err);
}

static void several_axes(const struct request *row)
{
    struct motion_otg_move move[AXES] = { usual, spoilt(row), usual };
    struct motion_otg_plan plan[AXES];
    for (int kind = MOTION_SYNC_NONE; kind <= MOTION_SYNC_STRAIGHT; kind++) {
        struct motion_sync_fault fault = { 9, MOTION_OTG_FIELD_NONE };
        if (kind == MOTION_SYNC_STRAIGHT && row->err == MOTION_E_RANGE)
            continue; /* not on a line */
        int err = motion_sync_make(move, AXES, (enum motion_sync_kind)kind,
                                   plan, &fault);
        expect_field(row, err, fault.field, "several axes");
        assert_int_equal(fault.axis, 1);
    }
}

static void bad_fields_are_named(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(at_start); i++) {
        one_axis(&at_start[i]);
        several_axes(&at_start[i]);
    }
    for (size_t i = 0; i < ARRAY_LEN(at_goal); i++) {
        one_axis(&at_goal[i]);
        several_axes(&at_goal[i]);
    }
}

/* Each gives a plan that the oracle accepts. */
static void largest_numbers_are_planned(void **state)
{
    static const struct request rows[] = {
        OF(limit.vel_max_q32, INT64_MAX, OK, NONE),
        OF(limit.vel_min_q32, -INT64_MAX, OK, NONE),
        OF(limit.acc_max_q32, INT64_MAX, OK, NONE),
        OF(limit.acc_min_q32, -INT64_MAX, OK, NONE),
        OF(limit.jerk_q32, INT64_MAX, OK, NONE),
        OF(limit.jerk_down_q32, INT64_MAX, OK, NONE),
        OF(start.vel_q32, 1000 * ONE, OK, NONE),
        OF(start.acc_q32, 500 * ACC, OK, NONE),
        OF(goal.pos_q32, 1, OK, NONE),
        OF(dur_ns_q12, 1000 * SECOND, OK, NONE),
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct motion_otg_move move = spoilt(&rows[i]);
        struct motion_otg_plan plan;
        enum motion_otg_field field;
        int err = motion_otg_make(&move, &plan, &field);
        expect_field(&rows[i], err, field, "largest");
        const char *wrong = otg_oracle_judge(&move, &plan);
        if (wrong)
            fail_msg("row %zu: %s", i, wrong);
    }
}

static void duration_that_is_too_short_says_the_next(void **state)
{
    struct motion_otg_move move = usual;
    struct motion_otg_plan plan;
    enum motion_otg_field field;
    (void)state;
    move.dur_ns_q12 = SECOND;
    assert_int_equal(motion_otg_make(&move, &plan, &field), MOTION_E_LIMIT);
    assert_int_equal(field, MOTION_OTG_FIELD_DURATION);
    assert_true(plan.dur_ns_q12 > 10 * SECOND);
    move.dur_ns_q12 = plan.dur_ns_q12;
    assert_int_equal(motion_otg_make(&move, &plan, &field), MOTION_OK);
}

/* Two jerks, and a gap whose end has no plan for a thousandth of the time. */
static void the_next_duration_may_be_far(void **state)
{
    struct motion_otg_move move = {
        .start = { 0, 0, INT64_C(14013500) << 16, 0 },
        .goal = { 1143, -163653940898, 0, 0 },
        .limit = { .vel_max_q32 = 228148629165,
                   .vel_min_q32 = -228148629165,
                   .acc_max_q32 = INT64_C(65632773) << 16,
                   .acc_min_q32 = -(INT64_C(65632773) << 16),
                   .jerk_q32 = INT64_C(60512069) << 16,
                   .jerk_down_q32 = INT64_C(13119699) << 16 },
        .mode = MOTION_OTG_POSITION,
        .dur_ns_q12 = 6282340532225,
    };
    struct motion_otg_plan plan;
    enum motion_otg_field field;
    (void)state;
    assert_int_equal(motion_otg_make(&move, &plan, &field), MOTION_E_LIMIT);
    assert_int_equal(field, MOTION_OTG_FIELD_DURATION);
    assert_true(plan.dur_ns_q12 > move.dur_ns_q12);
    assert_true(plan.dur_ns_q12 < move.dur_ns_q12 / 4 * 5);
    move.dur_ns_q12 = plan.dur_ns_q12;
    assert_int_equal(motion_otg_make(&move, &plan, &field), MOTION_OK);
    assert_null(otg_oracle_judge(&move, &plan));
}

static void velocity_goals_take_no_duration(void **state)
{
    struct motion_otg_move move = usual;
    struct motion_otg_plan plan;
    struct motion_sync_fault fault;
    (void)state;
    move.mode = MOTION_OTG_VELOCITY;
    assert_int_equal(
        motion_sync_make(&move, 1, MOTION_SYNC_TIME, &plan, &fault),
        MOTION_E_ARG);
    assert_int_equal(fault.field, MOTION_OTG_FIELD_DURATION);
    move.dur_ns_q12 = SECOND;
    assert_int_equal(motion_otg_make(&move, &plan, &fault.field), MOTION_E_ARG);
    assert_int_equal(fault.field, MOTION_OTG_FIELD_DURATION);
}

/* --- counts --------------------------------------------------------------- */

static void numbers_of_axes_and_points_are_bounded(void **state)
{
    static const int counts[] = { INT32_MIN, -1, 0, MOTION_SYNC_AXES + 1,
                                  INT32_MAX };
    struct motion_otg_plan plan;
    struct motion_otg_point point = { 0, 0, false };
    struct motion_sync_fault fault;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(counts); i++) {
        fault = (struct motion_sync_fault){ 9, MOTION_OTG_FIELD_JERK };
        assert_int_equal(motion_sync_make(&usual, counts[i], MOTION_SYNC_TIME,
                                          &plan, &fault),
                         MOTION_E_ARG);
        assert_int_equal(fault.field, MOTION_OTG_FIELD_NONE);
        assert_int_equal(motion_otg_through(&usual.start, &usual.limit,
                                            counts[i], &point, 1, &plan, NULL,
                                            &fault),
                         MOTION_E_ARG);
    }
    assert_int_equal(motion_otg_through(&usual.start, &usual.limit, 1, &point,
                                        0, &plan, NULL, &fault),
                     MOTION_E_ARG);
}

/* --- through points ------------------------------------------------------- */

#define POINTS 3

static int pass(const struct motion_otg_move move[AXES], int64_t vel_q32,
                struct motion_sync_fault *fault, int *failed)
{
    struct motion_state start[AXES];
    struct motion_otg_limit limit[AXES];
    struct motion_otg_point point[POINTS * AXES];
    struct motion_otg_plan plan[POINTS * AXES];
    for (int k = 0; k < AXES; k++) {
        start[k] = move[k].start;
        limit[k] = move[k].limit;
        for (int i = 0; i < POINTS; i++)
            point[i * AXES + k] =
                (struct motion_otg_point){ (i + 1) * ONE, 0, false };
    }
    point[AXES + 2].vel_q32 = vel_q32;
    point[AXES + 2].has_vel = vel_q32 != 0;
    return motion_otg_through(start, limit, AXES, point, POINTS, plan, failed,
                              fault);
}

static void points_name_axis_and_field(void **state)
{
    struct motion_sync_fault fault;
    int failed = -1;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(at_start); i++) {
        const struct motion_otg_move move[AXES] = { usual, spoilt(&at_start[i]),
                                                    usual };
        int err = pass(move, 0, &fault, &failed);
        expect_field(&at_start[i], err, fault.field, "through points");
        assert_int_equal(fault.axis, 1);
        assert_int_equal(failed, 0);
    }
    const struct motion_otg_move move[AXES] = { usual, usual, usual };
    assert_int_equal(pass(move, 0, &fault, &failed), MOTION_OK);
    assert_int_equal(pass(move, 11 * ONE, &fault, &failed), MOTION_E_LIMIT);
    assert_int_equal(fault.axis, 2);
    assert_int_equal(fault.field, MOTION_OTG_FIELD_GOAL_VEL);
    assert_int_equal(failed, 1);
    assert_int_equal(pass(move, INT64_MIN, &fault, &failed), MOTION_E_RANGE);
    assert_int_equal(fault.field, MOTION_OTG_FIELD_GOAL_VEL);
}

/* --- replanned ------------------------------------------------------------ */

/* The old plan runs on; when nothing is left of it the error comes back. */
static void bad_goals_on_the_way_keep_the_plan(void **state)
{
    struct motion_otg_trajectory old, next;
    enum motion_otg_field field;
    (void)state;
    assert_int_equal(motion_otg_begin(&usual, &old, NULL), MOTION_OK);
    for (size_t i = 0; i < ARRAY_LEN(at_goal) + ARRAY_LEN(at_start); i++) {
        const struct request *row = i < ARRAY_LEN(at_goal)
                                        ? &at_goal[i]
                                        : &at_start[i - ARRAY_LEN(at_goal)];
        struct motion_otg_move move = spoilt(row);
        if (row->field == MOTION_OTG_FIELD_START_VEL ||
            row->field == MOTION_OTG_FIELD_START_ACC)
            continue; /* the plan's state is the start */
        int outcome = motion_otg_replan(&old, old.plan.dur_ns_q12 / 2, &move,
                                        &next, &field);
        expect_field(row, row->err, field, "replanned");
        assert_int_equal(outcome, MOTION_OTG_KEPT);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_fields_are_named),
        cmocka_unit_test(largest_numbers_are_planned),
        cmocka_unit_test(duration_that_is_too_short_says_the_next),
        cmocka_unit_test(the_next_duration_may_be_far),
        cmocka_unit_test(velocity_goals_take_no_duration),
        cmocka_unit_test(numbers_of_axes_and_points_are_bounded),
        cmocka_unit_test(points_name_axis_and_field),
        cmocka_unit_test(bad_goals_on_the_way_keep_the_plan),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
