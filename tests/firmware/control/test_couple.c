/* tests/firmware/control/test_couple.c - gears and cams on ideal drives: where
 * the follower is, inside both limits in every tick, and to rest at the ends. */
#include "firmware/control/couple.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/control/gear.h"
#include "firmware/control/jog.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/ease.h"
#include "motion/plan/move.h"
#include "tests/firmware/control/ideal_drive.h"
#include "tests/support/check.h"

#define S (INT64_C(1000000000) * MOTION_FIXED_NS_Q12)

enum { MASTER, FOLLOWER, OTHER, AXES };

static struct ideal_drive drive[AXES];
static struct controller controller;
static struct controller_axis_config configs[AXES];
static struct controller_axis axes[AXES];
static struct controller_jog jog;
static struct motion_track track;
static struct controller_cam cam;
static double before[AXES][2]; /* the last two places */

static double q32(int64_t value)
{
    return (double)value / (double)UNIT;
}

static int begin(void **state)
{
    struct hal_drive *drives[AXES];
    const struct controller_config config = { .period_ns = MS,
                                              .axis_count = AXES,
                                              .axis = configs };
    (void)state;
    memset(drive, 0, sizeof drive);
    memset(&jog, 0, sizeof jog);
    for (int i = 0; i < AXES; i++) {
        configs[i] = ideal_axis;
        drive[i].drive.ops = &ideal_drive_ops;
        drives[i] = &drive[i].drive;
        before[i][0] = before[i][1] = 0;
    }
    now_ns = 1000 * MS;
    if (controller_init(&controller, &config, axes, drives, NULL) < 0)
        return -1;
    controller_step(&controller, now_ns,
                    (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 });
    controller_enable(&controller);
    now_ns += MS;
    controller_step(&controller, now_ns,
                    (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 });
    return controller.state == CONTROLLER_READY ? 0 : -1;
}

static int end(void **state)
{
    (void)state;
    plan_track_free(&track);
    return 0;
}

/* Where the curve is, and every step of every axis within its limits. */
static void judge(bool stops)
{
    struct motion_cursor cursor = { 0 };
    struct motion_sample sample;
    for (int i = 0; i < AXES; i++) {
        const double at = q32(axes[i].target.pos_q32);
        const double v = (at - before[i][0]) * 1000;
        const double a = (at - 2 * before[i][0] + before[i][1]) * 1e6;
        const double most = stops ? 1000 : 400;
        if (fabs(v) > 50.001 || fabs(a) > most * 1.001 || fabs(at) > 100.000001)
            fail_msg("axis %d at %.6f: %.3f /s, %.3f /s2", i, at, v, a);
        before[i][1] = before[i][0];
        before[i][0] = at;
    }
    if (axes[FOLLOWER].cam == NULL)
        return;
    motion_track_sample(
        &track, &cursor,
        controller_cam_ns_q12(&cam, axes[MASTER].target.pos_q32), &sample);
    if (fabs(q32(sample.pos_q32 - axes[FOLLOWER].target.pos_q32)) > 1e-8)
        fail_msg("it is at %.9f, the curve at %.9f",
                 q32(axes[FOLLOWER].target.pos_q32), q32(sample.pos_q32));
}

static void tick(bool stops)
{
    now_ns += MS;
    controller_step(&controller, now_ns,
                    (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 });
    controller_jog_step(&controller, &jog);
    judge(stops);
}

static int go(unsigned axis, double pos, double vel)
{
    const struct controller_jog_goal goal = {
        .axis = axis,
        .pos_q32 = llrint(pos * (double)UNIT),
        .vel_q32 = llrint(vel * (double)UNIT),
    };
    return controller_jog(&controller, &jog, &goal);
}

static void until_ready(void)
{
    for (int i = 0; controller.state != CONTROLLER_READY; i++) {
        if (i > 100000 || controller.state == CONTROLLER_FAULT)
            fail_msg("%s", controller_fault_text(controller.fault.fault));
        tick(false);
    }
}

/* Through these places of the follower, `every` units of the master apart. */
static int couple(double low, double every, const double place[],
                  unsigned count, enum plan_curve kind)
{
    struct plan_key key[32] = { { .place = { 0, 0 } } };
    struct plan_axis curve = { .curve = kind, .key = key, .key_count = count };
    struct plan_error error;
    for (unsigned i = 0; i < count; i++)
        key[i].key =
            (struct motion_key){ .t_ns_q12 = llrint(i * every * (double)S),
                                 .pos_q32 = llrint(place[i] * (double)UNIT) };
    plan_track_free(&track);
    if (plan_axis_track(&curve, &track, &error) < 0)
        fail_msg("%s", error.text);
    cam = (struct controller_cam){
        .master = MASTER,
        .track = &track,
        .low_q32 = llrint(low * (double)UNIT),
        .high_q32 = llrint((low + every * (count - 1)) * (double)UNIT),
    };
    const int err = controller_cam_init(&cam);
    return err < 0 ? err : controller_couple(&controller, FOLLOWER, &cam);
}

static void a_gear_is_followed_in_the_same_tick(void **state)
{
    static const double ratio[] = { 1, -2, 0.25, 17, -0.001 };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(ratio); i++) {
        const double reach = fmin(80, 90 / fabs(ratio[i]));
        const double place[] = { -reach * ratio[i], reach * ratio[i] };
        assert_int_equal(begin(NULL), 0);
        assert_int_equal(couple(-reach, 2 * reach, place, 2, PLAN_CURVE_LINEAR),
                         MOTION_OK);
        assert_int_equal(go(MASTER, reach / 2, 50), MOTION_OK);
        until_ready();
        assert_true(fabs(q32(axes[FOLLOWER].target.pos_q32) -
                         (reach / 2 * ratio[i])) < 1e-7);
        assert_true(fabs(q32(axes[MASTER].target.pos_q32) - (reach / 2)) <
                    1e-9);
    }
}

/* Further than the curve goes: it comes to rest at its end. */
static void a_jog_ends_in_time_where_the_curve_does(void **state)
{
    const double place[] = { -90, 90 };
    (void)state;
    assert_int_equal(couple(-30, 60, place, 2, PLAN_CURVE_LINEAR), MOTION_OK);
    assert_int_equal(go(MASTER, 100, 50), MOTION_OK);
    until_ready();
    assert_true(fabs(q32(axes[MASTER].target.pos_q32) - (30)) < 1e-8);
    assert_int_equal(go(MASTER, -100, 50), MOTION_OK);
    until_ready();
    assert_true(fabs(q32(axes[MASTER].target.pos_q32) - (-30)) < 1e-8);
}

/* Random curves, jogs that turn round in mid-motion, and stops. */
static void any_cam_keeps_both_axes_inside_their_limits(void **state)
{
    unsigned moved = 0;
    (void)state;
    seed_from("cams");
    for (int round = 0; round < 100; round++) {
        const unsigned count = 4 + (unsigned)(draw() % 8);
        double place[12];
        assert_int_equal(begin(NULL), 0);
        for (unsigned i = 0; i < count; i++)
            place[i] = (double)(draw() % 400) / 10 - 20;
        place[count / 2] = 0;
        const double every = 2 + (double)(draw() % 100) / 10;
        assert_int_equal(
            couple(-every * (count / 2), every, place, count, PLAN_CURVE_C2),
            MOTION_OK);
        for (int leg = 0; leg < 6; leg++) {
            const int err = go(MASTER, (double)(draw() % 200) - 100,
                               1 + (double)(draw() % 50));
            assert_true(err == MOTION_OK);
            for (unsigned n = (unsigned)(draw() % 900); n > 0; n--) {
                tick(true);
                moved += controller.state == CONTROLLER_MOVING;
            }
            if (draw() % 4 == 0)
                controller_jog_stop(&controller, &jog, draw() % 2 == 0);
            for (int i = 0; draw() % 4 == 0 && i < 500; i++)
                tick(true);
            while (controller.state == CONTROLLER_STOPPING)
                tick(true);
        }
        if (controller.fault.fault != CONTROLLER_FAULT_NONE)
            fail_msg("round %d: %s", round,
                     controller_fault_text(controller.fault.fault));
    }
    assert_true(moved > 50000);
}

static void what_cannot_be_coupled_is_refused(void **state)
{
    const double line[] = { -50, 50 }, away[] = { -40, 60 },
                 wide[] = { -150, 150 }, bent[] = { -50, 0, 10 };
    (void)state;
    assert_int_equal(couple(-50, 100, away, 2, PLAN_CURVE_LINEAR),
                     MOTION_E_AWAY);
    assert_int_equal(couple(-50, 100, wide, 2, PLAN_CURVE_LINEAR),
                     MOTION_E_LIMIT);
    assert_int_equal(couple(-50, 50, bent, 3, PLAN_CURVE_LINEAR),
                     MOTION_E_DISCONTINUITY);
    assert_int_equal(couple(10, 50, line, 2, PLAN_CURVE_LINEAR),
                     MOTION_E_LIMIT); /* the master stands outside */
    assert_int_equal(couple(-50, 100, line, 2, PLAN_CURVE_LINEAR), MOTION_OK);
    cam.master = FOLLOWER;
    assert_int_equal(controller_couple(&controller, OTHER, &cam),
                     MOTION_E_ARG); /* of what follows itself */
    cam.master = MASTER;
    assert_int_equal(controller_couple(&controller, FOLLOWER, &cam),
                     MOTION_E_STATE); /* twice */
    assert_int_equal(controller_couple(&controller, OTHER, &cam),
                     MOTION_E_ARG); /* by the cam of another */
    assert_int_equal(controller_couple(&controller, MASTER, &cam),
                     MOTION_E_ARG);
}

static void while_coupled_the_follower_is_not_jogged(void **state)
{
    const double line[] = { -50, 50 };
    (void)state;
    assert_int_equal(couple(-50, 100, line, 2, PLAN_CURVE_LINEAR), MOTION_OK);
    assert_int_equal(go(FOLLOWER, 10, 10), MOTION_E_STATE);
    assert_int_equal(go(OTHER, 10, 10), MOTION_OK);
    until_ready();
    assert_int_equal(controller_uncouple(&controller, FOLLOWER), MOTION_OK);
    assert_int_equal(go(FOLLOWER, 10, 10), MOTION_OK);
    until_ready();
}

/* --- onto a master that moves --------------------------------------------- */

/* The follower from where it stands, once the master has gone `ahead` further. */
static int engage_to(double ratio, double ahead, double over, bool is_backwards,
                     int64_t high_q32)
{
    const int64_t m_q32 = axes[MASTER].target.pos_q32;
    const int64_t ahead_q32 = llrint(ahead * (double)UNIT);
    const struct controller_gear gear = {
        .ratio_q32 = llrint(ratio * (double)UNIT),
        .place_q32 = axes[FOLLOWER].target.pos_q32,
        .begin_q32 = is_backwards ? m_q32 - ahead_q32 : m_q32 + ahead_q32,
        .over_q32 = llrint(over * (double)UNIT),
        .low_q32 = -95 * UNIT,
        .high_q32 = high_q32,
        .is_backwards = is_backwards,
    };
    plan_track_free(&track);
    track.segment = calloc(CONTROLLER_GEAR_SEGMENTS, sizeof *track.segment);
    track.capacity = CONTROLLER_GEAR_SEGMENTS;
    cam.master = MASTER;
    const int err = controller_gear_cam(&gear, &track, &cam);
    return err < 0 ? err : controller_couple(&controller, FOLLOWER, &cam);
}

static int engage(double ratio, double ahead, double over, bool is_backwards)
{
    return engage_to(ratio, ahead, over, is_backwards, 95 * UNIT);
}

/* Engaged on the way: at no tick a step of place, speed or acceleration (judge),
 * then at the ratio, also where the master turns round. */
static void a_gear_is_engaged_onto_a_master_that_moves(void **state)
{
    static const double ratio[] = { 1, -0.5, 0.3 };
    (void)state;
    for (size_t i = 0; i < 2 * ARRAY_LEN(ratio); i++) {
        const bool back = i >= ARRAY_LEN(ratio);
        const double r = ratio[i % ARRAY_LEN(ratio)], way = back ? -1 : 1;
        assert_int_equal(begin(NULL), 0);
        assert_int_equal(go(MASTER, 80 * way, 20), MOTION_OK);
        for (int n = 0; n < 500; n++)
            tick(false);
        assert_int_equal(engage(r, 1, 12, back), MOTION_OK);
        const double m0 = q32(axes[MASTER].target.pos_q32) + way;
        until_ready();
        /* half of the distance was left on the way to the ratio */
        assert_true(fabs(q32(axes[MASTER].target.pos_q32) - 80 * way) < 1e-9);
        assert_true(fabs(q32(axes[FOLLOWER].target.pos_q32) -
                         r * (80 * way - m0 - 6 * way)) < 1e-7);
        assert_int_equal(go(MASTER, 60 * way, 20), MOTION_OK);
        until_ready();
        assert_true(fabs(q32(axes[FOLLOWER].target.pos_q32) -
                         r * (60 * way - m0 - 6 * way)) < 1e-7);
        /* back through the blend, to where it stood */
        assert_int_equal(go(MASTER, 0, 20), MOTION_OK);
        until_ready();
        assert_true(fabs(q32(axes[FOLLOWER].target.pos_q32)) < 1e-7);
    }
}

/* Stopped and turned round anywhere within the blend. */
static void what_the_master_does_meanwhile_is_followed(void **state)
{
    (void)state;
    for (int when = 0; when < 1000; when += 90) {
        assert_int_equal(begin(NULL), 0);
        assert_int_equal(go(MASTER, 80, 20), MOTION_OK);
        for (int n = 0; n < 500; n++)
            tick(false);
        assert_int_equal(engage(1, 0.5, 12, false), MOTION_OK);
        for (int n = 0; n < when; n++)
            tick(false);
        controller_jog_stop(&controller, &jog, when % 180 == 0);
        for (int n = 0; n < 2000; n++)
            tick(true);
        assert_int_equal(controller.state, CONTROLLER_READY);
        assert_int_equal(go(MASTER, 0, 20), MOTION_OK);
        until_ready();
        assert_true(fabs(q32(axes[FOLLOWER].target.pos_q32)) < 1e-7);
        assert_int_equal(controller.fault.fault, CONTROLLER_FAULT_NONE);
    }
}

static void what_cannot_be_engaged_is_refused(void **state)
{
    (void)state;
    assert_int_equal(go(MASTER, 80, 50), MOTION_OK);
    for (int n = 0; n < 500; n++)
        tick(false);
    /* 1.5 * 50^2 / 2 is far above its acceleration */
    assert_int_equal(engage(1, 1, 2, false), MOTION_E_LIMIT);
    /* it is past where that begins */
    assert_int_equal(engage(1, -2, 40, false), MOTION_E_AWAY);
    /* the curve is where the axis stands, and does not stand */
    const double m = q32(axes[MASTER].target.pos_q32);
    const double line[] = { -90 - m, 90 - m };
    assert_int_equal(couple(-90, 180, line, 2, PLAN_CURVE_LINEAR),
                     MOTION_E_LIMIT);
    const double half[] = { (-90 - m) / 2, (90 - m) / 2 };
    assert_int_equal(couple(-90, 180, half, 2, PLAN_CURVE_LINEAR),
                     MOTION_E_AWAY);
    assert_int_equal(engage(0, 1, 20, false), MOTION_E_ARG);
    assert_int_equal(engage(1, 1, 0, false), MOTION_E_ARG);
    assert_int_equal(engage(1, 1, 94, false), MOTION_E_ARG);
    /* the follower would leave its range */
    assert_int_equal(engage(9, 1, 40, false), MOTION_E_LIMIT);
    assert_null(axes[FOLLOWER].cam);
    until_ready();
    assert_true(fabs(q32(axes[MASTER].target.pos_q32) - 80) < 1e-9);
    /* another axis moves */
    assert_int_equal(go(OTHER, 10, 10), MOTION_OK);
    tick(false);
    assert_int_equal(engage(1, 1, 10, true), MOTION_E_STATE);
    until_ready();
}

/* --- under moves --------------------------------------------------------- */

/* 60 units of the master and back, and what it makes of the follower. */
static struct motion_segment storage[2][40];
static struct motion_track move[2];
static const struct motion_track *const both[AXES] = { &move[0], &move[1] };
static const struct motion_ease_limit gentle = { 40 * UNIT, 100 * UNIT,
                                                 1000 * UNIT };

static void plan_both(double ratio)
{
    const double line[] = { -90 * ratio, 90 * ratio };
    assert_int_equal(couple(-90, 180, line, 2, PLAN_CURVE_LINEAR), MOTION_OK);
    for (int i = 0; i < 2; i++) {
        const double by = i == 0 ? 1 : fabs(ratio);
        const struct motion_ease_limit limit = {
            llrint((double)gentle.vel_q32 * by),
            llrint((double)gentle.acc_q32 * by),
            llrint((double)gentle.jerk_q32 * by),
        };
        motion_track_init(&move[i], storage[i], 40, 0);
        assert_int_equal(motion_ease_append_limited(
                             &move[i],
                             llrint((i == 0 ? 60 : 60 * ratio) * (double)UNIT),
                             &limit),
                         0);
        assert_int_equal(motion_ease_append_limited(&move[i], 0, &limit), 0);
    }
}

/* In one tick of its own at most by what rounding of the two tracks makes. */
static void ticks_of_move(unsigned count, double ratio)
{
    while (count-- > 0) {
        now_ns += MS;
        controller_step(&controller, now_ns,
                        (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 });
        const double off = q32(axes[FOLLOWER].target.pos_q32) -
                           ratio * q32(axes[MASTER].target.pos_q32);
        if (fabs(off) > 1e-6)
            fail_msg("the follower is off by %.9f", off);
    }
}

static void a_move_takes_the_follower_with_it(void **state)
{
    static const double ratio[] = { 0.5, -1 };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(ratio); i++) {
        assert_int_equal(begin(NULL), 0);
        plan_both(ratio[i]);
        assert_int_equal(controller_start(&controller, both, NULL), MOTION_OK);
        ticks_of_move(700, ratio[i]);
        assert_int_equal(
            controller_override(&controller, MOTION_CLOCK_WARP_ONE_Q30 / 2),
            MOTION_OK);
        ticks_of_move(500, ratio[i]);
        assert_int_equal(controller_hold(&controller), MOTION_OK);
        ticks_of_move(2000, ratio[i]);
        assert_int_equal(controller.state, CONTROLLER_HOLDING);
        assert_true(q32(axes[MASTER].target.pos_q32) > 10);
        assert_int_equal(controller_reverse(&controller, true), MOTION_OK);
        assert_int_equal(controller_resume(&controller), MOTION_OK);
        ticks_of_move(300, ratio[i]);
        controller_stop(&controller);
        for (int n = 0; controller.state != CONTROLLER_READY; n++) {
            assert_true(n < 3000);
            ticks_of_move(1, ratio[i]);
        }
        /* and the curve goes on from there */
        assert_non_null(axes[FOLLOWER].cam);
        assert_int_equal(go(MASTER, -20, 20), MOTION_OK);
        for (int n = 0; controller.state != CONTROLLER_READY; n++) {
            assert_true(n < 20000);
            ticks_of_move(1, ratio[i]);
            controller_jog_step(&controller, &jog);
        }
        assert_int_equal(controller.fault.fault, CONTROLLER_FAULT_NONE);
    }
}

/* The master's alone moves both: held, resumed, reversed and stopped. */
static void a_move_of_the_master_takes_the_follower_along(void **state)
{
    static const double ratio[] = { 0.5, -1, 1.25 };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(ratio); i++) {
        const double r = ratio[i];
        const struct motion_track *alone[AXES] = { &move[0] };
        assert_int_equal(begin(NULL), 0);
        plan_both(fabs(r) > 1 ? 1 : r);
        if (fabs(r) > 1) { /* as fast as its limits let it */
            const double line[] = { -70 * r, 70 * r };
            assert_int_equal(controller_uncouple(&controller, FOLLOWER),
                             MOTION_OK);
            assert_int_equal(couple(-70, 140, line, 2, PLAN_CURVE_LINEAR),
                             MOTION_OK);
        }
        assert_int_equal(controller_start(&controller, alone, NULL), MOTION_OK);
        assert_true(controller.override_max_q30 <=
                    llrint(fmin(2, 50 / 40.0 / fmax(1, fabs(r))) * 0x1p30) + 1);
        ticks_of_move(900, r);
        assert_int_equal(controller_hold(&controller), MOTION_OK);
        ticks_of_move(2000, r);
        assert_int_equal(controller.state, CONTROLLER_HOLDING);
        assert_int_equal(controller_reverse(&controller, true), MOTION_OK);
        assert_int_equal(controller_resume(&controller), MOTION_OK);
        ticks_of_move(300, r);
        controller_stop(&controller);
        for (int n = 0; controller.state != CONTROLLER_READY; n++) {
            assert_true(n < 3000);
            ticks_of_move(1, r);
        }
        assert_int_equal(controller.fault.fault, CONTROLLER_FAULT_NONE);
        assert_true(fabs(q32(axes[FOLLOWER].target.pos_q32)) > 1);
    }
}

/* Faster, further or with more of a step than the follower can be taken along. */
static void what_the_follower_cannot_keep_does_not_begin(void **state)
{
    const struct motion_track *alone[AXES] = { &move[0] };
    int axis = 0;
    (void)state;
    plan_both(0.5);
    assert_int_equal(controller_uncouple(&controller, FOLLOWER), MOTION_OK);
    const double steep[] = { -95, 95 }, near[] = { -20, 20 };
    assert_int_equal(couple(-62, 124, steep, 2, PLAN_CURVE_LINEAR), MOTION_OK);
    assert_int_equal(controller_start(&controller, alone, NULL),
                     MOTION_E_LIMIT); /* 61 of 50 units/s */
    assert_int_equal(controller_uncouple(&controller, FOLLOWER), MOTION_OK);
    assert_int_equal(couple(-40, 80, near, 2, PLAN_CURVE_LINEAR), MOTION_OK);
    assert_int_equal(controller_start(&controller, alone, &axis),
                     MOTION_E_LIMIT); /* beyond the end of the curve */
    assert_int_equal(axis, FOLLOWER);
    assert_int_equal(controller.state, CONTROLLER_READY);
    assert_null(axes[MASTER].track);
}

/* As any jog: it stands where it is and goes on from there. */
static void a_coupled_jog_is_held_and_resumed(void **state)
{
    const double line[] = { -90, 90 };
    (void)state;
    assert_int_equal(couple(-90, 180, line, 2, PLAN_CURVE_LINEAR), MOTION_OK);
    assert_int_equal(go(MASTER, 80, 40), MOTION_OK);
    for (int n = 0; n < 700; n++)
        tick(false);
    assert_int_equal(controller_hold(&controller), MOTION_OK);
    for (int n = 0; n < 1500; n++)
        tick(true);
    assert_int_equal(controller.state, CONTROLLER_HOLDING);
    assert_int_equal(controller.rate.rate_q30, 0);
    assert_true(q32(axes[FOLLOWER].target.pos_q32) < 60);
    assert_int_equal(controller_resume(&controller), MOTION_OK);
    until_ready();
    assert_true(fabs(q32(axes[FOLLOWER].target.pos_q32) - 80) < 1e-8);
}

/* The master cannot come to rest before the curve ends: nothing changes. */
static void a_gear_that_ends_too_soon_is_not_engaged(void **state)
{
    (void)state;
    assert_int_equal(go(MASTER, 80, 20), MOTION_OK);
    for (int n = 0; n < 500; n++)
        tick(false);
    const int64_t high_q32 =
        axes[MASTER].target.pos_q32 + llrint(0.3 * (double)UNIT);
    assert_int_equal(engage_to(0.001, 0.05, 0.2, false, high_q32),
                     MOTION_E_LIMIT);
    assert_null(axes[FOLLOWER].cam);
    until_ready();
    assert_true(fabs(q32(axes[MASTER].target.pos_q32) - 80) < 1e-9);
    assert_true(axes[FOLLOWER].target.pos_q32 == 0);
}

/* Wherever within the window it stands it goes on from there, and nowhere else. */
static void it_begins_where_it_stands(void **state)
{
    (void)state;
    seed_from("stands");
    for (int n = 0; n < 200; n++) {
        const double beside = (2 * (double)draw_unit() - 1) * 3 *
                              (double)ideal_axis.pos_max_q32 / 0x1p62;
        const double line[] = { -50 + beside, 50 + beside };
        assert_int_equal(begin(NULL), 0);
        const int err = couple(-50, 100, line, 2, PLAN_CURVE_LINEAR);
        assert_int_equal(err,
                         llabs(llrint(beside * (double)UNIT)) <= cam.window_q32
                             ? MOTION_OK
                             : MOTION_E_AWAY);
        if (err < 0)
            continue;
        assert_int_equal(go(MASTER, 10, 50), MOTION_OK);
        for (int k = 0; k < 20; k++) {
            now_ns += MS;
            controller_step(
                &controller, now_ns,
                (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 });
            assert_in_range(axes[FOLLOWER].target.pos_q32 -
                                axes[MASTER].target.pos_q32 + 3,
                            0, 6);
        }
    }
}

/* A curve whose slope steps by more than a hundredth of what an acceleration lets
 * happen in a tick, or its curvature. */
static void a_curve_with_corners_is_refused(void **state)
{
    const double bent[] = { -50, 0, 49.9 }, kinked[] = { 0, 1, 4, 9, 16, 25 };
    (void)state;
    assert_int_equal(couple(-50, 50, bent, 3, PLAN_CURVE_LINEAR),
                     MOTION_E_DISCONTINUITY);
    /* catmull-rom: steps of curvature */
    assert_int_equal(couple(0, 5, kinked, 6, PLAN_CURVE_CATMULL_ROM),
                     MOTION_E_DISCONTINUITY);
    configs[FOLLOWER].limit.jerk_q32 = 0;
    assert_int_equal(couple(0, 5, kinked, 6, PLAN_CURVE_CATMULL_ROM),
                     MOTION_OK);
}

/* By a track of each there is a way to rest along both. */
static void a_fault_stops_both_along_the_move(void **state)
{
    (void)state;
    plan_both(0.5);
    assert_int_equal(controller_start(&controller, both, NULL), MOTION_OK);
    ticks_of_move(900, 0.5);
    drive[OTHER].faulty = true;
    ticks_of_move(1, 0.5);
    assert_int_equal(controller.reaction, CONTROLLER_REACT_STOP);
    for (int i = 0; controller.state != CONTROLLER_FAULT; i++) {
        assert_true(i < 3000);
        ticks_of_move(1, 0.5);
    }
    assert_null(axes[FOLLOWER].cam);
}

static void a_move_that_leaves_the_curve_does_not_begin(void **state)
{
    const struct motion_track *own[AXES] = { [FOLLOWER] = &move[1] };
    const struct motion_track *other[AXES] = { [OTHER] = &move[0] };
    (void)state;
    int axis = 0;
    plan_both(0.5);
    assert_int_equal(controller_start(&controller, own, &axis), MOTION_E_STATE);
    assert_int_equal(axis, FOLLOWER);
    assert_int_equal(controller_cue(&controller, own, 0, NULL), MOTION_E_STATE);
    /* there at both ends, and not between them */
    motion_track_init(&move[1], storage[1], 40, 0);
    assert_int_equal(motion_ease_append_limited(&move[1], 30 * UNIT, &gentle),
                     0);
    assert_int_equal(motion_ease_append_limited(&move[1], 0, &gentle), 0);
    assert_int_equal(motion_track_append_dwell(
                         &move[1], move[0].end_ns_q12 - move[1].end_ns_q12),
                     0);
    assert_int_equal(controller_start(&controller, both, NULL), MOTION_E_STATE);
    /* of axes that are not coupled */
    assert_int_equal(controller_start(&controller, other, NULL), MOTION_OK);
    ticks_of_move(500, 0.5);
    assert_int_equal(controller.state, CONTROLLER_MOVING);
}

static void torque_off_and_faults_end_it(void **state)
{
    const double line[] = { -50, 50 };
    (void)state;
    assert_int_equal(couple(-50, 100, line, 2, PLAN_CURVE_LINEAR), MOTION_OK);
    assert_int_equal(controller_off(&controller), MOTION_OK);
    assert_null(axes[FOLLOWER].cam);
    assert_int_equal(begin(NULL), 0);
    assert_int_equal(couple(-50, 100, line, 2, PLAN_CURVE_LINEAR), MOTION_OK);
    assert_int_equal(go(MASTER, 40, 50), MOTION_OK);
    for (int i = 0; i < 500; i++)
        tick(false);
    drive[OTHER].faulty = true;
    tick(true);
    assert_int_equal(controller.state, CONTROLLER_STOPPING);
    assert_ptr_equal(axes[FOLLOWER].cam, &cam);
    for (int i = 0; controller.state != CONTROLLER_FAULT; i++) {
        assert_true(i < 200); /* 50 / 1000 + 1000 / 40000 s */
        tick(true);
    }
    assert_int_equal(drive[FOLLOWER].quick_stops, 0);
    assert_null(axes[FOLLOWER].cam);
}

#define RUN(test) cmocka_unit_test_setup_teardown(test, begin, end)

int main(void)
{
    const struct CMUnitTest tests[] = {
        RUN(a_gear_is_followed_in_the_same_tick),
        RUN(a_jog_ends_in_time_where_the_curve_does),
        RUN(any_cam_keeps_both_axes_inside_their_limits),
        RUN(what_cannot_be_coupled_is_refused),
        RUN(a_gear_is_engaged_onto_a_master_that_moves),
        RUN(what_the_master_does_meanwhile_is_followed),
        RUN(what_cannot_be_engaged_is_refused),
        RUN(while_coupled_the_follower_is_not_jogged),
        RUN(a_move_takes_the_follower_with_it),
        RUN(a_move_of_the_master_takes_the_follower_along),
        RUN(what_the_follower_cannot_keep_does_not_begin),
        RUN(a_coupled_jog_is_held_and_resumed),
        RUN(a_gear_that_ends_too_soon_is_not_engaged),
        RUN(it_begins_where_it_stands),
        RUN(a_curve_with_corners_is_refused),
        RUN(a_fault_stops_both_along_the_move),
        RUN(a_move_that_leaves_the_curve_does_not_begin),
        RUN(torque_off_and_faults_end_it),
    };
    return cmocka_run_group_tests_name("couple", tests, NULL, NULL);
}
