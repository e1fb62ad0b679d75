/* tests/firmware/control/stateful_torque.c - who takes torque, and when.
 *
 * It is not there in OFF and FAULT; it is taken from what moves for what is worth it
 * alone: a bus that is gone, an axis that runs away.  Drives brake by themselves, by
 * their quick stop, where nothing else can be done: each reason for that is a rule, of
 * which the uses are counted.  Whether a stop along the path would have fitted is found
 * by brute force (tests/firmware/control/ramp_oracle.h). */
#include <math.h>

#include "tests/firmware/control/ramp_oracle.h"
#include "tests/firmware/control/stateful.h"

#define QUIET_TICKS 12
#define STILL       1e-3 /* unit/s, of scale 1 */

const char *stateful_excuse_text(enum stateful_excuse excuse)
{
    static const char *const text[] = {
#define EXCUSE_TEXT(name, text) text,
        STATEFUL_EXCUSE_LIST(EXCUSE_TEXT)
#undef EXCUSE_TEXT
    };
    return text[excuse];
}

/* Nothing keeps torque on: OFF, or a fault whose reaction takes it. */
static bool is_quiet(const struct controller *controller)
{
    if (controller->state == CONTROLLER_OFF)
        return !controller->enabling;
    return controller->state == CONTROLLER_FAULT &&
           (controller->reaction != CONTROLLER_REACT_HOLD ||
            controller->resetting);
}

/* Return how long its drive has had to take torque off. */
static int quiet_ticks(const struct stateful *bench, unsigned i)
{
    const struct stateful_board *board = bench->axis[i].board;
    const int ticks = bench->judge.quiet_ticks;
    return board != NULL && board->heard_ticks < ticks ? board->heard_ticks
                                                       : ticks;
}

static void judge_torque(struct stateful *bench)
{
    struct stateful_judge *judge = &bench->judge;
    judge->quiet_ticks =
        is_quiet(&bench->controller) ? judge->quiet_ticks + 1 : 0;
    for (unsigned i = 0; i < bench->axes && judge->quiet_ticks > 0; i++) {
        const enum hal_drive_request request = bench->axis[i].request;
        if (request == HAL_DRIVE_REQUEST_ENABLE ||
            request == HAL_DRIVE_REQUEST_QUICK_STOP)
            stateful_violate(bench, STATEFUL_TORQUE, (int)i, "asked for in %s",
                             controller_state_text(bench->controller.state));
        if (quiet_ticks(bench, i) >
                QUIET_TICKS + stateful_board_ticks(bench, i) &&
            stateful_axis_has_torque(&bench->axis[i]))
            stateful_violate(bench, STATEFUL_TORQUE, (int)i, "%s",
                             controller_state_text(bench->controller.state));
    }
}

/* --- taken from what moves ------------------------------------------------------ */

static bool any_runs_away(const struct stateful *bench)
{
    for (unsigned i = 0; i < bench->axes; i++)
        if (bench->axis[i].runaway != 0 || bench->judge.away[i].against ||
            bench->judge.away[i].beyond || bench->judge.away[i].faster)
            return true;
    return false;
}

/* By its set points, of which the last step to rest is no faster than a tick of
 * braking, or, where it has none, by itself.  A board stops before it takes torque off; a
 * quick stop has a time. */
static bool was_moving(const struct stateful *bench, unsigned i)
{
    const struct stateful_axis *axis = &bench->axis[i];
    const double brake = (double)bench->axis_config[i].stop.acc_q32 / 0x1p32;
    const int64_t since_ns = bench->now_ns - bench->controller.since_ns;
    if (axis->board != NULL)
        return false;
    if (axis->cut_state == HAL_DRIVE_ENABLED &&
        axis->cut_mode == HAL_DRIVE_STREAM_POSITION)
        return fabs(stateful_vel(bench, i)) >
               brake * (double)bench->period_ns / 1e9 * (1 + 1e-6);
    return fabs(axis->cut_vel) > STILL * axis->scale &&
           (axis->cut_state == HAL_DRIVE_ENABLED ||
            since_ns < bench->config.stop_timeout_ns);
}

static void judge_cut(struct stateful *bench)
{
    for (unsigned i = 0; i < bench->axes; i++)
        if (bench->axis[i].is_cut && was_moving(bench, i) &&
            bench->controller.reaction != CONTROLLER_REACT_OFF)
            stateful_violate(bench, STATEFUL_CUT, (int)i, "%.6f unit/s, %s",
                             bench->axis[i].cut_vel,
                             controller_state_text(bench->judge.before));
}

static void judge_off(struct stateful *bench)
{
    const uint32_t off = (uint32_t)1 << CONTROLLER_FAULT_BUS;
    const enum controller_fault fault = bench->controller.fault.fault;
    if (fault == CONTROLLER_FAULT_ENABLE || (bench->judge.causes & off) != 0)
        return;
    bench->tally.away++;
    if (!any_runs_away(bench))
        stateful_violate(bench, STATEFUL_SPURIOUS, -1, "no torque after %s",
                         controller_fault_text(fault));
}

/* --- the drives' quick stop -------------------------------------------------------- */

static bool any_by_profile(const struct stateful *bench)
{
    for (unsigned i = 0; i < bench->axes; i++)
        if (stateful_profile_is_open(&bench->axis[i].profile) ||
            (bench->axis_config[i].by_goals && bench->axis[i].slip_q32 != 0) ||
            bench->axis[i].mode == HAL_DRIVE_HOMING ||
            bench->axis[i].next_mode == HAL_DRIVE_HOMING)
            return true;
    return false;
}

/* As what is asked for at its most urgent: from where the clock was then, by the stop
 * limits, in the time that was stated. */
static bool a_stop_fits(const struct stateful *bench)
{
    const struct stateful_stop *stop = &bench->judge.stop;
    const double most = (double)(stop->by_ns - stop->requested_ns) / 1e9;
    struct controller_axis axis[STATEFUL_AXES];
    struct controller shadow = bench->controller;
    struct motion_clock_rate from = stop->from;
    shadow.axis = axis;
    for (unsigned i = 0; i < bench->axes; i++) {
        axis[i] = bench->controller.axis[i];
        axis[i].track = stateful_track(bench, i);
    }
    if (shadow.is_reversed)
        from.s_ns_q12 = shadow.move_end_ns_q12 - from.s_ns_q12;
    return oracle_shortest(&shadow, &from, true, most) < most;
}

static bool is_not_read(const struct stateful *bench)
{
    const uint32_t track = (uint32_t)1 << CONTROLLER_FAULT_TRACK;
    for (unsigned i = 0; i < bench->axes; i++)
        if (bench->controller.axis[i].track != NULL &&
            bench->controller.axis[i].track->outline != NULL)
            return (bench->judge.causes & track) != 0;
    return false;
}

static enum stateful_excuse excuse_of(const struct stateful *bench)
{
    const struct stateful_judge *judge = &bench->judge;
    if (judge->by_profile || any_by_profile(bench))
        return STATEFUL_BY_PROFILE;
    if (is_not_read(bench))
        return STATEFUL_NOT_READ;
    if (judge->deaf && judge->stop.kind != STATEFUL_GOES)
        return STATEFUL_DEAF_BOARD;
    if (judge->stop.kind != STATEFUL_GOES &&
        bench->clock_ns > judge->stop.by_ns && judge->stop.by_rate &&
        !a_stop_fits(bench))
        return STATEFUL_NO_STOP_FITS;
    return STATEFUL_EXCUSES;
}

static void judge_quick(struct stateful *bench)
{
    const enum stateful_excuse excuse = excuse_of(bench);
    if (excuse < STATEFUL_EXCUSES)
        bench->tally.excuse[excuse]++;
    else
        stateful_violate(
            bench, STATEFUL_ESCALATES, bench->controller.fault.axis,
            "%s, in %s, %.1f ms %s the time that was stated",
            controller_fault_text(bench->controller.fault.fault),
            controller_state_text(bench->judge.before),
            fabs((double)(bench->clock_ns - bench->judge.stop.by_ns)) / 1e6,
            bench->clock_ns > bench->judge.stop.by_ns ? "after" : "before");
}

void stateful_judge_torque(struct stateful *bench)
{
    struct stateful_judge *judge = &bench->judge;
    const enum controller_reaction reaction = bench->controller.reaction;
    judge_cut(bench);
    if (reaction != judge->reaction && reaction == CONTROLLER_REACT_OFF)
        judge_off(bench);
    if (reaction != judge->reaction && reaction == CONTROLLER_REACT_QUICK)
        judge_quick(bench);
    judge->reaction = reaction;
    judge->by_profile = any_by_profile(bench);
    judge->deaf = false;
    for (unsigned k = 0; k < STATEFUL_BOARDS; k++)
        judge->deaf = judge->deaf || bench->board[k].is_deaf;
    judge_torque(bench);
}
