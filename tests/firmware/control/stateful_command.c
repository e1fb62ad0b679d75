/* tests/firmware/control/stateful_command.c - what the operator may do, put into the
 * mailbox where that has it, noted and told to the judge. */
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/firmware/control/stateful.h"

/* Until a hold begins that boards are told of. */
#define HOLD_NS INT64_C(11000000000)

/* Drives may be enabled from this command on until READY, off or a stop. */
static void may_enable(struct stateful *bench, bool may)
{
    for (unsigned i = 0; i < bench->axes; i++)
        bench->axis[i].may_enable = may;
}

/* One command, and its answer. */
static int tell(struct stateful *bench, const struct mailbox_entry *entry)
{
    struct mailbox_entry answer;
    assert_int_equal(mailbox_send(&bench->mailbox, entry), MOTION_OK);
    (void)mailbox_step(&bench->mailbox, &bench->playback);
    assert_true(mailbox_answer(&bench->mailbox, &answer));
    assert_int_equal(answer.command, entry->command);
    return answer.err;
}

static int tell_value(struct stateful *bench, enum mailbox_command command,
                      int64_t value)
{
    return tell(bench,
                &(struct mailbox_entry){ .command = command, .value = value });
}

int stateful_enable(struct stateful *bench)
{
    const bool was = bench->axis[0].may_enable;
    may_enable(bench, true);
    const int err = tell_value(bench, MAILBOX_ENABLE, 0);
    may_enable(bench, err == MOTION_OK || was);
    stateful_note(bench, "enable%s", err < 0 ? "!" : "");
    if (err == MOTION_OK)
        bench->judge.quiet_ticks = 0;
    return err;
}

int stateful_off(struct stateful *bench)
{
    const int err = tell_value(bench, MAILBOX_OFF, 0);
    if (err == MOTION_OK)
        may_enable(bench, false);
    stateful_note(bench, "off%s", err < 0 ? "!" : "");
    return err;
}

/* What a drive by goals is to reach, before the start. */
static void give_goals(struct stateful *bench, uint32_t axes)
{
    for (unsigned i = 0; i < bench->axes; i++) {
        struct controller_goal *goal = bench->goal[bench->spare][i];
        if ((axes >> i & 1) == 0 || !bench->axis_config[i].by_goals)
            continue;
        const unsigned count = controller_goals_of(
            &bench->track[bench->spare][i], goal, STATEFUL_GOALS);
        (void)controller_set_goals(&bench->controller, i, goal, count);
    }
}

int stateful_start(struct stateful *bench, uint32_t axes)
{
    const struct motion_track *track[CONTROLLER_AXES_MAX] = { NULL };
    for (unsigned i = 0; i < bench->axes; i++)
        if ((axes >> i & 1) != 0)
            track[i] = &bench->track[bench->spare][i];
    const enum controller_state was = bench->controller.state;
    if (bench->reader[bench->spare].is_on)
        stateful_read_begin(bench, track);
    give_goals(bench, axes);
    const int err = controller_start(&bench->controller, track, NULL);
    stateful_note(bench, "start%s %#" PRIx32, err < 0 ? "!" : "", axes);
    if (err < 0)
        return err;
    stateful_read_begun(bench);
    bench->spare = 1 - bench->spare;
    stateful_motion_begins(bench, STATEFUL_MOVE, was);
    stateful_shots_arm(bench);
    return err;
}

int stateful_hold(struct stateful *bench)
{
    const unsigned stops = bench->controller.stops;
    const int err = tell_value(bench, MAILBOX_HOLD, 0);
    stateful_note(bench, "hold%s", err < 0 ? "!" : "");
    if (err == MOTION_OK && bench->controller.stops != stops) {
        stateful_stop_requested(bench, STATEFUL_STOP);
        return err;
    }
    if (err == MOTION_OK && bench->controller.state == CONTROLLER_MOVING &&
        bench->judge.motion == STATEFUL_MOVE) {
        bench->judge.hold_by_ns = bench->clock_ns + HOLD_NS;
        bench->judge.is_resumed = false;
        return err; /* once boards have been told */
    }
    if (err == MOTION_OK)
        bench->judge.is_resumed = false;
    if (err == MOTION_OK)
        stateful_stop_requested(bench, STATEFUL_HOLD);
    return err;
}

int stateful_resume(struct stateful *bench)
{
    const enum controller_state was = bench->controller.state;
    const int err = tell_value(bench, MAILBOX_RESUME, 0);
    stateful_note(bench, "resume%s", err < 0 ? "!" : "");
    if (err < 0)
        return err;
    bench->judge.is_resumed = true;
    bench->judge.hold_by_ns = 0;
    if (bench->controller.state != CONTROLLER_HOLDING)
        stateful_motion_begins(bench, STATEFUL_REST, was);
    return err;
}

int stateful_reverse(struct stateful *bench, bool is_reversed)
{
    const int err = bench->playback.state == PLAYBACK_IDLE
                        ? controller_reverse(&bench->controller, is_reversed)
                        : tell_value(bench, MAILBOX_REVERSE, is_reversed);
    stateful_note(bench, "%s%s", is_reversed ? "reverse" : "forward",
                  err < 0 ? "!" : "");
    if (err == MOTION_OK)
        bench->judge.is_reversed = is_reversed;
    return err;
}

void stateful_stop(struct stateful *bench)
{
    may_enable(bench, false);
    mailbox_stop(&bench->mailbox);
    (void)mailbox_step(&bench->mailbox, &bench->playback);
    stateful_note(bench, "stop");
    stateful_stop_requested(bench, homing_is_running(&bench->homing)
                                       ? STATEFUL_HOME_STOP
                                       : STATEFUL_STOP);
}

int stateful_override(struct stateful *bench, int64_t rate_q30)
{
    const int err = tell_value(bench, MAILBOX_OVERRIDE, rate_q30);
    stateful_note(bench, "override%s %.0f%%", err < 0 ? "!" : "",
                  (double)rate_q30 / 0x1p30 * 100);
    return err;
}

int stateful_jog(struct stateful *bench, unsigned axis, int64_t pos_q32,
                 int64_t vel_q32, int64_t for_ns)
{
    const struct controller_jog_goal goal = {
        .axis = axis,
        .pos_q32 = pos_q32,
        .vel_q32 = vel_q32,
        .until_ns = for_ns > 0 ? bench->now_ns + for_ns : 0,
    };
    const double vel = stateful_unit(vel_q32) * (double)bench->period_ns / 1e9;
    struct stateful_judge *judge = &bench->judge;
    const enum controller_state was = bench->controller.state;
    const int err =
        for_ns > 0
            ? tell(bench, &(struct mailbox_entry){ .command = MAILBOX_JOG,
                                                   .axis = axis,
                                                   .value = pos_q32,
                                                   .vel_q32 = vel_q32,
                                                   .for_ns = for_ns })
            : controller_jog(&bench->controller, &bench->jog, &goal);
    stateful_note(bench, "jog%s %u to %.3f at %.3f for %.0f ms",
                  err < 0 ? "!" : "", axis, stateful_unit(pos_q32),
                  stateful_unit(vel_q32), (double)for_ns / 1e6);
    if (err < 0)
        return err;
    judge->jog_axis = axis;
    judge->jog_step_q32 = stateful_q32(vel);
    stateful_motion_begins(bench, STATEFUL_JOG, was);
    judge->dead_ns = goal.until_ns;
    return err;
}

void stateful_jog_stop(struct stateful *bench, bool hard)
{
    enum stateful_stop_kind kind = STATEFUL_STOP;
    if (homing_is_running(&bench->homing))
        kind = STATEFUL_HOME_STOP;
    else if (bench->judge.motion == STATEFUL_JOG)
        kind = hard ? STATEFUL_HARD_STOP : STATEFUL_JOG_STOP;
    may_enable(bench, false);
    (void)tell_value(bench, MAILBOX_JOG_STOP, hard);
    stateful_note(bench, hard ? "jog stop hard" : "jog stop");
    stateful_stop_requested(bench, kind);
}

int stateful_homing(struct stateful *bench, uint32_t axes)
{
    const enum controller_state was = bench->controller.state;
    const int err = homing_start(&bench->homing, axes);
    stateful_note(bench, "home%s %#" PRIx32, err < 0 ? "!" : "", axes);
    if (err == MOTION_OK)
        stateful_motion_begins(bench, STATEFUL_JOG, was);
    return err;
}

int stateful_reset(struct stateful *bench)
{
    const int err = tell_value(bench, MAILBOX_RESET, 0);
    stateful_note(bench, "reset%s", err < 0 ? "!" : "");
    if (err < 0)
        return err;
    bench->judge.reset_requested = true;
    if (bench->judge.pressed.is_active || bench->judge.pressed.is_unproved)
        stateful_violate(bench, STATEFUL_RESET, -1, "the e-stop's");
    return err;
}

int stateful_couple(struct stateful *bench, unsigned axis)
{
    const int err = tell(
        bench, &(struct mailbox_entry){ .command = MAILBOX_COUPLE,
                                        .axis = axis,
                                        .cam = &bench->coupling[axis].cam });
    stateful_note(bench, "couple%s %u to %u", err < 0 ? "!" : "", axis,
                  bench->coupling[axis].cam.master);
    if (err == MOTION_OK)
        stateful_engaged(bench, axis);
    return err;
}

int stateful_uncouple(struct stateful *bench, unsigned axis)
{
    const int err =
        tell(bench, &(struct mailbox_entry){ .command = MAILBOX_UNCOUPLE,
                                             .axis = axis });
    stateful_note(bench, "uncouple%s %u", err < 0 ? "!" : "", axis);
    if (err == MOTION_OK)
        bench->coupling[axis].is_on = false;
    return err;
}

/* The axis is there from now on. */
int stateful_set_position(struct stateful *bench, unsigned axis, int64_t to_q32)
{
    const int64_t from_q32 = bench->controller.axis[axis].target.pos_q32;
    struct hal_drive_reach reach;
    const int err = controller_set_position(&bench->controller, axis, from_q32,
                                            to_q32, &reach);
    stateful_note(bench, "set%s %u %.3f", err < 0 ? "!" : "", axis,
                  stateful_unit(to_q32));
    return err;
}
