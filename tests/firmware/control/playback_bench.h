/* tests/firmware/control/playback_bench.h - a controller on two ideal drives,
 * a playback and a mailbox, for the tests of what an operator does. */
#ifndef TESTS_FIRMWARE_CONTROL_PLAYBACK_BENCH_H
#define TESTS_FIRMWARE_CONTROL_PLAYBACK_BENCH_H

#include <string.h>

#include "firmware/control/mailbox.h"
#include "firmware/control/playback.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/ease.h"
#include "tests/support/check.h"

#define MS    INT64_C(1000000)
#define MSQ12 (MS * MOTION_FIXED_NS_Q12)
#define UNIT  MOTION_FIXED_ONE_Q32
#define AXES  2

struct bench_drive {
    struct hal_drive drive;
    struct hal_drive_target given;
    bool enabled;
};

static int64_t now_ns;
static struct bench_drive drive[AXES];
static struct controller controller;
static struct controller_axis axes[AXES];
static struct controller_axis_config configs[AXES];
static struct controller_jog jog;
static struct playback playback;
static struct playback_axis playback_axes[AXES];
static struct mailbox mailbox;

static void bench_request(struct hal_drive *self,
                          enum hal_drive_request request)
{
    ((struct bench_drive *)self)->enabled = request == HAL_DRIVE_REQUEST_ENABLE;
}

static int bench_set_target(struct hal_drive *self,
                            const struct hal_drive_target *target)
{
    ((struct bench_drive *)self)->given = *target;
    return MOTION_OK;
}

static void bench_feedback(struct hal_drive *self,
                           struct hal_drive_feedback *feedback)
{
    const struct bench_drive *own = (struct bench_drive *)self;
    *feedback = (struct hal_drive_feedback){
        .state = own->enabled ? HAL_DRIVE_ENABLED : HAL_DRIVE_OFF,
        .pos_q32 = own->given.pos_q32,
        .t_ns = now_ns - MS,
        .demand_age_ns = MS,
        .following = true,
    };
}

static const struct hal_drive_ops bench_ops = {
    .request = bench_request,
    .set_target = bench_set_target,
    .feedback = bench_feedback,
};

static void tick(void)
{
    now_ns += MS;
    (void)mailbox_step(&mailbox, &playback);
    controller_step(&controller, now_ns,
                    (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 });
    controller_jog_step(&controller, &jog);
    playback_step(&playback);
}

static const struct controller_axis_config axis_config = {
    .pos_min_q32 = -100 * UNIT,
    .pos_max_q32 = 100 * UNIT,
    .limit = { 50 * UNIT, 400 * UNIT, 6000 * UNIT },
    .stop = { 50 * UNIT, 1000 * UNIT, 40000 * UNIT },
    .following_floor_q32 = UNIT,
    .following_k_ns = 10 * MS,
};

static int begin_off(void **state)
{
    struct hal_drive *drives[AXES];
    const struct controller_config config = { .period_ns = MS,
                                              .axis_count = AXES,
                                              .axis = configs };
    (void)state;
    memset(drive, 0, sizeof drive);
    memset(&jog, 0, sizeof jog);
    for (int i = 0; i < AXES; i++) {
        configs[i] = axis_config;
        drive[i].drive.ops = &bench_ops;
        drives[i] = &drive[i].drive;
    }
    now_ns = 1000 * MS;
    mailbox_init(&mailbox);
    if (controller_init(&controller, &config, axes, drives, NULL) < 0)
        return -1;
    playback_init(&playback, &controller, &jog, playback_axes);
    tick();
    return 0;
}

static int begin_ready(void **state)
{
    if (begin_off(state) < 0)
        return -1;
    controller_enable(&controller);
    tick();
    return controller.state == CONTROLLER_READY ? 0 : -1;
}

/* Sends, and waits for the answer. */
static int tell_entry(struct mailbox_entry *entry)
{
    assert_int_equal(mailbox_send(&mailbox, entry), MOTION_OK);
    tick();
    assert_true(mailbox_answer(&mailbox, entry));
    return entry->err;
}

static int tell(enum mailbox_command command, int64_t value)
{
    struct mailbox_entry entry = { .command = command, .value = value };
    return tell_entry(&entry);
}

static void until(enum controller_state state)
{
    for (int i = 0; controller.state != state; i++) {
        if (i > 60000 || controller.state == CONTROLLER_FAULT)
            fail_msg("%s, %s, waiting for %s",
                     controller_state_text(controller.state),
                     controller_fault_text(controller.fault.fault),
                     controller_state_text(state));
        tick();
    }
}

/* Holds and stands. */
static void until_held(void)
{
    until(CONTROLLER_HOLDING);
    for (int i = 0; i < 20000 && controller.rate.rate_q30 != 0; i++)
        tick();
    assert_int_equal(controller.rate.rate_q30, 0);
    assert_int_equal(controller.state, CONTROLLER_HOLDING);
}

/* A move of both axes: out and back, in one curve each. */
static struct motion_segment bench_storage[AXES][64];
static struct motion_track bench_track[AXES];
static const struct motion_track *bench_tracks[AXES];

static void make_move(double far_0, double far_1)
{
    const struct motion_ease_limit limit = { 30 * UNIT, 200 * UNIT,
                                             2000 * UNIT };
    const double far[AXES] = { far_0, far_1 };
    for (int i = 0; i < AXES; i++) {
        motion_track_init(&bench_track[i], bench_storage[i], 64, 0);
        assert_int_equal(
            motion_ease_append_limited(
                &bench_track[i], (int64_t)(far[i] * (double)UNIT), &limit),
            MOTION_OK);
        bench_tracks[i] = &bench_track[i];
    }
    assert_int_equal(playback_load(&playback, bench_tracks), MOTION_OK);
}

#endif
