/* tests/firmware/control/stateful_client.c - several senders: one that has control and
 * floods, a jog in every tick and several in some; others whose stop comes among the
 * commands of that, as many as the mailbox holds.
 *
 * A stop comes first.  What came with it, before or after, is not done, but for torque
 * off, which does not take it from what moves (stateful_torque.c). */
#include "motion/core/err.h"
#include "tests/firmware/control/stateful.h"

#define MS         INT64_C(1000000)
#define FLOOD_MOST 400 /* ticks */

static struct mailbox_entry draw_jog(struct stateful *bench, unsigned i)
{
    const struct controller_axis_config *config = &bench->axis_config[i];
    return (struct mailbox_entry){
        .command = MAILBOX_JOG,
        .axis = i,
        .value = stateful_in(bench, config->pos_min_q32, config->pos_max_q32),
        .vel_q32 = stateful_in(bench, 1, config->limit.vel_q32),
        .for_ns = stateful_in(bench, 1, 200) * MS,
    };
}

static unsigned draw_axis(struct stateful *bench)
{
    const unsigned any = (unsigned)stateful_in(bench, 0, bench->axes - 1);
    return bench->judge.motion == STATEFUL_JOG ? bench->judge.jog_axis : any;
}

/* Whatever it is; those that have a place of the sender's are left out. */
static struct mailbox_entry draw_entry(struct stateful *bench)
{
    const enum mailbox_command command =
        (enum mailbox_command)stateful_in(bench, 0, MAILBOX_COMMANDS - 1);
    if (command == MAILBOX_CAPTURE || command == MAILBOX_COUPLE ||
        stateful_one_in(bench, 2))
        return draw_jog(bench, draw_axis(bench));
    return (struct mailbox_entry){
        .command = command,
        .axis = draw_axis(bench),
        .value = stateful_in(bench, 0, 2),
        .vel_q32 = MOTION_FIXED_ONE_Q32,
        .for_ns = MS,
    };
}

static void put(struct stateful *bench, unsigned count)
{
    for (unsigned n = 0; n < count; n++) {
        const struct mailbox_entry entry = draw_entry(bench);
        const int err = mailbox_send(&bench->mailbox, &entry);
        assert_true(err == MOTION_OK || err == MOTION_E_FULL);
    }
}

/* Everything of it is answered in one step. */
static void answers(struct stateful *bench)
{
    struct mailbox_entry answer;
    while (mailbox_answer(&bench->mailbox, &answer)) {
        bench->tally.beside++;
        if (answer.err >= 0 && answer.command != MAILBOX_OFF)
            stateful_violate(bench, STATEFUL_BESIDE, (int)answer.axis,
                             "command %d", (int)answer.command);
    }
}

void stateful_stop_among(struct stateful *bench, unsigned before,
                         unsigned after)
{
    for (unsigned i = 0; i < bench->axes; i++)
        bench->axis[i].may_enable = false;
    put(bench, before);
    mailbox_stop(&bench->mailbox);
    put(bench, after);
    if (!mailbox_step(&bench->mailbox, &bench->playback))
        stateful_violate(bench, STATEFUL_BESIDE, -1, "the stop was not read");
    answers(bench);
    stateful_note(bench, "stop among %u and %u", before, after);
    stateful_stop_requested(bench, homing_is_running(&bench->homing)
                                       ? STATEFUL_HOME_STOP
                                       : STATEFUL_STOP);
}

static void draw_flood(struct stateful *bench)
{
    const enum controller_state state = bench->controller.state;
    const bool may_jog =
        !homing_is_running(&bench->homing) &&
        (state == CONTROLLER_READY || bench->judge.motion == STATEFUL_JOG);
    if (bench->flood == 0 && may_jog && stateful_one_in(bench, 500))
        bench->flood = (int)stateful_in(bench, 1, FLOOD_MOST);
    if (bench->flood == 0)
        return;
    bench->flood--;
    const int64_t jogs =
        stateful_one_in(bench, 4) ? stateful_in(bench, 2, 4) : 1;
    for (int64_t n = 0; n < jogs && may_jog; n++) {
        const struct mailbox_entry jog = draw_jog(bench, draw_axis(bench));
        (void)stateful_jog(bench, jog.axis, jog.value, jog.vel_q32, jog.for_ns);
    }
}

void stateful_draw_clients(struct stateful *bench)
{
    const bool floods = bench->flood > 0;
    draw_flood(bench);
    if (stateful_one_in(bench, floods ? 60 : 300))
        stateful_stop_among(bench,
                            (unsigned)stateful_in(bench, 0, MAILBOX_CAPACITY),
                            (unsigned)stateful_in(bench, 0, 4));
}
