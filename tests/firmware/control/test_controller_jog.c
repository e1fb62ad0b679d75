/* tests/firmware/control/test_controller_jog.c - jogs on an ideal drive: new
 * goals in full motion, inside the limits at every tick, and stops. */
#include "firmware/control/jog.h"

#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/firmware/control/ideal_drive.h"
#include "tests/support/check.h"

static struct ideal_drive drive[2];
static struct controller controller;
static struct controller_axis axes[2];
static struct controller_jog jog;

static void tick(void)
{
    now_ns += MS;
    controller_step(&controller, now_ns,
                    (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 });
    controller_jog_step(&controller, &jog);
}

static int begin(void **state)
{
    struct hal_drive *drives[2] = { &drive[0].drive, &drive[1].drive };
    static struct controller_axis_config configs[2];
    const struct controller_config config = { .period_ns = MS,
                                              .axis_count = 2,
                                              .axis = configs };
    (void)state;
    configs[0] = configs[1] = ideal_axis;
    configs[1].needs_homing = true;
    memset(drive, 0, sizeof drive);
    memset(&jog, 0, sizeof jog);
    drive[0].drive.ops = drive[1].drive.ops = &ideal_drive_ops;
    now_ns = 1000 * MS;
    if (controller_init(&controller, &config, axes, drives, NULL) < 0)
        return -1;
    tick();
    controller_enable(&controller);
    tick();
    return controller.state == CONTROLLER_READY ? 0 : -1;
}

static int go(unsigned axis, double pos, double vel, int64_t for_ns)
{
    const struct controller_jog_goal goal = {
        .axis = axis,
        .pos_q32 = (int64_t)(pos * (double)UNIT),
        .vel_q32 = (int64_t)(vel * (double)UNIT),
        .until_ns = for_ns > 0 ? now_ns + for_ns : 0,
    };
    return controller_jog(&controller, &jog, &goal);
}

static void until_ready(void)
{
    for (int i = 0; controller.state != CONTROLLER_READY; i++) {
        if (i > 30000 || controller.state == CONTROLLER_FAULT)
            fail_msg("%s, %s", controller_state_text(controller.state),
                     controller_fault_text(controller.fault.fault));
        tick();
    }
}

static void a_jog_arrives_to_the_bit(void **state)
{
    (void)state;
    assert_int_equal(go(0, 33.25, 20, 0), MOTION_OK);
    until_ready();
    assert_int_equal(drive[0].given.pos_q32, 33 * UNIT + UNIT / 4);
    assert_int_equal(drive[1].given.pos_q32, 0);
    assert_int_equal(go(0, 33.25, 20, 0), MOTION_OK); /* it is there */
    tick();
    tick();
    until_ready();
    assert_int_equal(drive[0].given.pos_q32, 33 * UNIT + UNIT / 4);
}

/* Differences of what the drive got: speed, acceleration and jerk between two
 * ticks are means of those within, so inside the limits where these are. */
static void new_goals_in_motion_keep_all_limits(void **state)
{
    double p[4] = { 0 }, fastest = 0, hardest = 0, sharpest = 0;
    int goals = 0;
    (void)state;
    seed_from("jog");
    for (int i = 0; i < 60000; i++) {
        if (draw() % 40 == 0)
            goals += go(0, (double)(draw() % 200) - 100,
                        1 + (double)(draw() % 49), 0) == MOTION_OK;
        if (draw() % 300 == 0)
            controller_jog_stop(&controller, &jog, false);
        tick();
        assert_int_not_equal(controller.state, CONTROLLER_FAULT);
        memmove(&p[1], &p[0], 3 * sizeof p[0]);
        p[0] = (double)drive[0].given.pos_q32 / (double)UNIT;
        const double v = (p[0] - p[1]) * 1e3;
        const double a = (p[0] - 2 * p[1] + p[2]) * 1e6;
        const double j = (p[0] - 3 * p[1] + 3 * p[2] - p[3]) * 1e9;
        if (i < 4)
            continue;
        fastest = v > fastest ? v : -v > fastest ? -v : fastest;
        hardest = a > hardest ? a : -a > hardest ? -a : hardest;
        sharpest = j > sharpest ? j : -j > sharpest ? -j : sharpest;
    }
    print_message("%d goals: %.4f of 50, %.3f of 400, %.1f of 6000\n", goals,
                  fastest, hardest, sharpest);
    assert_true(goals > 1000);
    /* 2^-32 per position is 2e-3 of jerk's and 1e-3 of acceleration's unit */
    assert_true(fastest > 45 && fastest < 50.0001);
    assert_true(hardest > 390 && hardest < 400.002);
    assert_true(sharpest > 5900 && sharpest < 6002);
}

static void without_a_new_goal_it_stops(void **state)
{
    (void)state;
    assert_int_equal(go(0, 100, 40, 200 * MS), MOTION_OK);
    for (int i = 0; i < 20; i++) { /* a key that is held */
        for (int k = 0; k < 50; k++)
            tick();
        assert_int_equal(go(0, 100, 40, 200 * MS), MOTION_OK);
    }
    int held = 0;
    while (jog.until_ns != 0) {
        tick();
        held++;
    }
    assert_in_range(held, 200, 201);
    const double at = (double)drive[0].given.pos_q32 / (double)UNIT;
    until_ready();
    const double displacement =
        (double)drive[0].given.pos_q32 / (double)UNIT - at;
    /* v (v/a + a/j) / 2 */
    assert_true(displacement > 0 &&
                displacement < 40 * (40.0 / 400 + 400.0 / 6000) / 2 + 0.1);
}

static void a_hard_stop_uses_the_stop_limits(void **state)
{
    double displacement[2];
    (void)state;
    for (int hard = 0; hard < 2; hard++) {
        assert_int_equal(go(0, -90, 50, 0), MOTION_OK);
        until_ready();
        assert_int_equal(go(0, 90, 50, 0), MOTION_OK);
        for (int i = 0; i < 1500; i++)
            tick();
        const int64_t at_q32 = drive[0].given.pos_q32;
        controller_jog_stop(&controller, &jog, hard == 1);
        until_ready();
        displacement[hard] =
            (double)(drive[0].given.pos_q32 - at_q32) / (double)UNIT;
    }
    assert_true(displacement[0] > 4.7 &&
                displacement[0] < 4.9); /* 50 (0.125 + 0.067) / 2 */
    assert_true(displacement[1] > 1.8 &&
                displacement[1] < 1.95); /* 50 (0.05 + 0.025) / 2 */
}

static void the_range_counts_for_homed_axes_only(void **state)
{
    struct hal_drive_reach reach;
    (void)state;
    assert_int_equal(go(0, 100.001, 20, 0), MOTION_E_LIMIT);
    assert_int_equal(controller.state, CONTROLLER_READY);
    assert_int_equal(go(1, 150, 50, 0), MOTION_OK);
    until_ready();
    assert_int_equal(drive[1].given.pos_q32, 150 * UNIT);
    /* what is 150 is 20 from now on */
    assert_int_equal(
        controller_set_position(&controller, 1, 150 * UNIT, 20 * UNIT, &reach),
        MOTION_OK);
    tick();
    assert_int_equal(drive[1].given.pos_q32, 150 * UNIT); /* no step */
    assert_int_equal(controller.axis[1].feedback.pos_q32, 20 * UNIT);
    assert_int_equal(go(1, 101, 50, 0), MOTION_E_LIMIT);
    assert_int_equal(go(1, -100, 50, 0), MOTION_OK);
    until_ready();
    assert_int_equal(drive[1].given.pos_q32, 30 * UNIT); /* the border itself */
}

/* Ends of the range are no places of danger. */
static void jogs_to_the_borders_never_leave_the_range(void **state)
{
    (void)state;
    seed_from("border");
    for (int i = 0; i < 200; i++) {
        assert_int_equal(
            go(0, i % 2 ? 100 : -100, 10 + (double)(draw() % 4000) / 100, 0),
            MOTION_OK);
        for (uint64_t k = draw() % 3000; k > 0; k--)
            tick();
        if (draw() % 2)
            until_ready();
        else
            controller_jog_stop(&controller, &jog, false);
        until_ready();
    }
}

static void what_is_not_possible_is_refused(void **state)
{
    struct hal_drive_reach reach;
    (void)state;
    assert_int_equal(go(2, 0, 10, 0), MOTION_E_ARG);
    assert_int_equal(go(0, 0, 0, 0), MOTION_E_ARG);
    assert_int_equal(go(0, 10, 10, 0), MOTION_OK);
    tick();
    assert_int_equal(go(1, 10, 10, 0), MOTION_E_STATE); /* another axis */
    assert_int_equal(controller_set_position(&controller, 1, 0, 1, &reach),
                     MOTION_E_STATE);
    assert_int_equal(controller_hold(&controller), MOTION_OK);
    for (int i = 0; i < 500; i++)
        tick();
    assert_int_equal(go(0, 20, 10, 0), MOTION_E_STATE);
    controller_stop(&controller);
    until_ready();
    assert_int_equal(controller_off(&controller), MOTION_OK);
    assert_int_equal(go(0, 20, 10, 0), MOTION_E_STATE);
}

static void a_fault_in_a_jog_stops_it(void **state)
{
    (void)state;
    assert_int_equal(go(0, 90, 50, 0), MOTION_OK);
    for (int i = 0; i < 700; i++)
        tick();
    drive[1].enabled = false; /* the other one leaves operation */
    tick();
    assert_int_equal(controller.state, CONTROLLER_STOPPING);
    for (int i = 0; controller.state != CONTROLLER_FAULT; i++) {
        assert_true(i < 500);
        tick();
    }
    assert_true(drive[0].given.pos_q32 < 60 * UNIT);
    assert_int_equal(go(0, 0, 50, 0), MOTION_E_STATE);
}

#define RUN(test) cmocka_unit_test_setup(test, begin)

int main(void)
{
    const struct CMUnitTest tests[] = {
        RUN(a_jog_arrives_to_the_bit),
        RUN(new_goals_in_motion_keep_all_limits),
        RUN(without_a_new_goal_it_stops),
        RUN(a_hard_stop_uses_the_stop_limits),
        RUN(the_range_counts_for_homed_axes_only),
        RUN(jogs_to_the_borders_never_leave_the_range),
        RUN(what_is_not_possible_is_refused),
        RUN(a_fault_in_a_jog_stops_it),
    };
    return cmocka_run_group_tests_name("controller_jog", tests, NULL, NULL);
}
