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
#include "tests/firmware/control/ideal_drive.h"
#include "tests/support/check.h"

#define MSQ12 (MS * MOTION_FIXED_NS_Q12)
#define AXES  2

static struct ideal_drive drive[AXES];
static struct controller controller;
static struct controller_axis axes[AXES];
static struct controller_axis_config configs[AXES];
static struct controller_jog jog;
static struct playback playback;
static struct playback_axis playback_axes[AXES];
static struct mailbox mailbox;

static void tick(void)
{
    now_ns += MS;
    (void)mailbox_step(&mailbox, &playback);
    controller_step(&controller, now_ns,
                    (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 });
    controller_jog_step(&controller, &jog);
    playback_step(&playback);
}

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
        configs[i] = ideal_axis;
        drive[i].drive.ops = &ideal_drive_ops;
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
static inline void until_held(void)
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

static inline void make_move(double far_0, double far_1)
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
