/* tests/firmware/control/stateful_fault.c - faults: each has a cause, each cause
 * of those that must be seen has one, and they stay until a reset. */
#include <math.h>

#include "tests/firmware/control/stateful.h"

#define AWAY_TICKS 3

static bool switch_is_active(const struct stateful *bench)
{
    for (unsigned i = 0; i < bench->axes; i++)
        if (stateful_axis_switch(&bench->axis[i], STATEFUL_NEGATIVE) ||
            stateful_axis_switch(&bench->axis[i], STATEFUL_POSITIVE))
            return true;
    return false;
}

static bool all_are_up(const struct stateful *bench)
{
    for (unsigned i = 0; i < bench->axes; i++)
        if (bench->axis[i].state != HAL_DRIVE_ENABLED ||
            (bench->axis[i].board != NULL && !bench->axis[i].is_known) ||
            (bench->axis_config[i].by_goals &&
             bench->axis[i].mode != HAL_DRIVE_PROFILE_POSITION))
            return false;
    return true;
}

/* Homing that fails stops its axis as a stop does. */
static bool homing_stops_without_halt(const struct stateful *bench)
{
    const unsigned i = bench->homing.axis;
    return bench->judge.homed_before && bench->axis_config[i].by_goals &&
           !bench->axis[i].profile.halts;
}

/* A jog that was stopped is on its way to rest, also when it is then held and
 * resumed. */
static bool jog_stops_without_halt(const struct stateful *bench)
{
    for (unsigned i = 0; i < bench->axes; i++)
        if (bench->axis_config[i].by_goals && !bench->axis[i].profile.halts &&
            bench->controller.axis[i].leg.stops)
            return true;
    return false;
}

/* A drive is bad, or was disturbed. */
static bool goes_badly(const struct stateful *bench)
{
    const uint32_t disturbed = (uint32_t)1 << CONTROLLER_FAULT_FOLLOWING |
                               (uint32_t)1 << CONTROLLER_FAULT_STALE;
    for (unsigned i = 0; i < bench->axes; i++)
        if (bench->axis_config[i].by_goals && bench->axis[i].profile.is_bad)
            return true;
    return (bench->judge.causes & disturbed) != 0;
}

static bool has_cause(const struct stateful *bench, enum controller_fault fault)
{
    if (fault == CONTROLLER_FAULT_LIMIT_SWITCH)
        return switch_is_active(bench);
    if (fault == CONTROLLER_FAULT_ENABLE)
        return !all_are_up(bench);
    if (fault == CONTROLLER_FAULT_ARRIVAL)
        return goes_badly(bench);
    if (fault == CONTROLLER_FAULT_FOLLOWING &&
        bench->axis[bench->controller.fault.axis].pressed != 0)
        return true;
    if (fault == CONTROLLER_FAULT_ESTOP)
        return bench->judge.pressed.is_active;
    if (fault == CONTROLLER_FAULT_ESTOP_CHANNELS)
        return bench->judge.pressed.is_unproved;
    if (fault == CONTROLLER_FAULT_REST) /* that is what a bound is for */
        return bench->judge.stop.kind != STATEFUL_GOES ||
               homing_stops_without_halt(bench) ||
               jog_stops_without_halt(bench);
    return (bench->judge.causes >> fault & 1) != 0;
}

static bool is_healthy(const struct stateful *bench)
{
    for (unsigned i = 0; i < bench->axes; i++)
        if (bench->axis[i].ill || bench->axis[i].away ||
            bench->axis[i].slip_q32 != 0 || bench->axis[i].stale_ticks > 0 ||
            bench->axis[i].runaway != 0 || bench->axis[i].lag_s > 0)
            return false;
    return bench->bus.health == HAL_FIELDBUS_GOOD;
}

static void fault_comes(struct stateful *bench, enum controller_fault fault)
{
    bench->tally.fault[fault]++;
    bench->judge.reset_requested = false;
    stateful_stop_requested(bench, STATEFUL_FAULT_STOP);
}

/* That the channels disagree is why it stopped. */
static bool says_why(const struct stateful *bench)
{
    const struct controller_fault_record *now = &bench->controller.fault;
    const struct controller_fault_record *before = &bench->judge.fault;
    return before->fault == CONTROLLER_FAULT_ESTOP &&
           now->fault == CONTROLLER_FAULT_ESTOP_CHANNELS &&
           now->t_ns == before->t_ns && bench->judge.pressed.is_unproved;
}

static void judge_latch(struct stateful *bench)
{
    const struct controller *controller = &bench->controller;
    struct stateful_judge *judge = &bench->judge;
    const struct controller_fault_record *now = &controller->fault;
    if (judge->fault.fault == CONTROLLER_FAULT_NONE) {
        if (now->fault != CONTROLLER_FAULT_NONE &&
            !has_cause(bench, now->fault))
            stateful_violate(
                bench, STATEFUL_SPURIOUS, now->axis, "%s: %.9f over %.9f",
                controller_fault_text(now->fault), stateful_unit(now->value),
                stateful_unit(now->limit));
        if (now->fault != CONTROLLER_FAULT_NONE)
            fault_comes(bench, now->fault);
    } else if (now->fault == CONTROLLER_FAULT_NONE) {
        if (controller->state != CONTROLLER_OFF || !judge->reset_requested)
            stateful_violate(bench, STATEFUL_LATCH, -1, "%s",
                             controller_state_text(controller->state));
        judge->causes = is_healthy(bench) ? 0 : judge->causes;
    } else if (says_why(bench)) {
        bench->tally.fault[now->fault]++;
    } else if (now->fault != judge->fault.fault ||
               now->t_ns != judge->fault.t_ns) {
        stateful_violate(bench, STATEFUL_LATCH, now->axis, "another: %s",
                         controller_fault_text(now->fault));
    }
    if (judge->before == CONTROLLER_FAULT &&
        controller->state != CONTROLLER_FAULT &&
        controller->state != CONTROLLER_OFF)
        stateful_violate(bench, STATEFUL_LATCH, -1, "%s",
                         controller_state_text(controller->state));
    judge->fault = *now;
}

/* --- the e-stop ------------------------------------------------------------ */

/* As the lines were when the controller looked. */
static void follow_button(struct stateful *bench)
{
    const struct stateful_estop *estop = &bench->estop;
    struct stateful_pressed *pressed = &bench->judge.pressed;
    const bool first = estop->line[0].active;
    const bool second = estop->channels > 1 ? estop->line[1].active : first;
    if (!first && !second) {
        if (pressed->is_active)
            pressed->is_unproved = pressed->is_late || !pressed->both;
        *pressed =
            (struct stateful_pressed){ .is_unproved = pressed->is_unproved };
        return;
    }
    pressed->is_active = true;
    pressed->both = pressed->both || (first && second);
    if (first == second)
        pressed->differs = false;
    else if (!pressed->differs)
        pressed->differ_ns = bench->now_ns;
    pressed->differs = first != second;
    if (pressed->differs &&
        bench->now_ns - pressed->differ_ns > estop->discrepancy_ns)
        pressed->is_late = pressed->is_unproved = true;
}

static void judge_button(struct stateful *bench)
{
    const struct stateful_pressed *pressed = &bench->judge.pressed;
    const enum controller_fault fault = bench->controller.fault.fault;
    if ((pressed->is_active || pressed->is_unproved) &&
        fault == CONTROLLER_FAULT_NONE)
        stateful_violate(bench, STATEFUL_MISSED, -1, "the e-stop, in %s",
                         controller_state_text(bench->controller.state));
    if (pressed->is_unproved && fault == CONTROLLER_FAULT_ESTOP)
        stateful_violate(bench, STATEFUL_MISSED, -1, "its channels disagree");
}

/* --- an axis that runs away -------------------------------------------------- */

/* Over the largest following error that there may be, which grows: away from
 * where it should be, faster and faster, and faster than this. */
static bool moves_away(const struct stateful *bench, unsigned i,
                       const struct stateful_away *now,
                       const struct stateful_away *before, double most_q32)
{
    return stateful_axis_follows(&bench->axis[i]) && !now->follows &&
           llabs(now->error_q32) > llabs(before->error_q32) &&
           llabs(now->vel_q32) > llabs(before->vel_q32) &&
           fabs((double)now->vel_q32) > most_q32 &&
           (now->error_q32 < 0) != (now->vel_q32 < 0);
}

/* By a quarter, and an eighth of its limit, faster than that went on itself when it was
 * followed last: torque has to go.  By a thirty-second faster than what it is told: it
 * may. */
static bool runs_away(const struct stateful *bench, unsigned i,
                      const struct stateful_away *now,
                      const struct stateful_away *before)
{
    const double least_q32 = (double)bench->axis_config[i].limit.vel_q32 / 8;
    return moves_away(bench, i, now, before, now->told_q32 * 1.25 + least_q32);
}

static bool is_faster(const struct stateful *bench, unsigned i,
                      const struct stateful_away *now,
                      const struct stateful_away *before, double told_q32)
{
    const double creep_q32 = (double)bench->axis_config[i].limit.vel_q32 / 32;
    return moves_away(bench, i, now, before, fabs(told_q32) + creep_q32);
}

static bool follows(const struct stateful *bench, unsigned i, int64_t error_q32)
{
    const struct controller_axis_config *config = &bench->axis_config[i];
    const double by_speed =
        (double)config->limit.vel_q32 * (double)config->following_k_ns / 1e9;
    const double most_q32 = fmax((double)config->following_floor_q32, by_speed);
    return llabs(error_q32) <= (int64_t)most_q32 + 1;
}

/* The set point in force is one that the controller has sent: two periods ago,
 * and it reads the answer a period later. */
static bool is_told(const struct stateful_away *away)
{
    return away->ticks > 3;
}

/* Against where it is told to go, neither of which is a creep. */
static bool is_against(const struct stateful *bench, unsigned i,
                       const struct stateful_away *away, double told_q32)
{
    const double creep_q32 = (double)bench->axis_config[i].limit.vel_q32 / 32;
    return !away->follows && fabs(told_q32) > creep_q32 &&
           fabs((double)away->vel_q32) > creep_q32 &&
           (told_q32 < 0) != (away->vel_q32 < 0);
}

/* Faster than it may be at all, by an eighth; whatever it was told. */
static bool is_beyond(const struct stateful *bench, unsigned i,
                      const struct stateful_away *away)
{
    const double most_q32 = (double)bench->axis_config[i].limit.vel_q32;
    return !away->follows && fabs((double)away->vel_q32) > most_q32 * 1.125;
}

/* In three ticks in a row, each with an answer, the controller has had. */
static void judge_away(struct stateful *bench, unsigned i)
{
    const struct stateful_axis *axis = &bench->axis[i];
    struct stateful_away *away = &bench->judge.away[i];
    const struct stateful_away before = *away;
    *away = (struct stateful_away){
        .error_q32 = axis->seen.demand_q32 - axis->seen.pos_q32,
        .vel_q32 = axis->seen.vel_q32,
        .demand_q32 = axis->seen.demand_q32,
        .t_ns = axis->seen.t_ns,
        .ticks = stateful_axis_follows(axis) ? before.ticks + 1 : 0,
        .count = before.count,
    };
    const double told_q32 = (double)(away->demand_q32 - before.demand_q32) *
                            1e9 / (double)bench->controller.config.period_ns;
    away->follows = follows(bench, i, away->error_q32);
    away->against = is_against(bench, i, away, told_q32);
    away->beyond = is_beyond(bench, i, away);
    away->faster = is_faster(bench, i, away, &before, told_q32);
    away->told_q32 =
        away->follows ? fabs(told_q32) : fmax(fabs(told_q32), before.told_q32);
    const bool is_new = away->t_ns != before.t_ns;
    away->count = is_new && is_told(away) && runs_away(bench, i, away, &before)
                      ? before.count + 1
                      : 0;
    if (away->count >= AWAY_TICKS && axis->request == HAL_DRIVE_REQUEST_ENABLE)
        stateful_violate(
            bench, STATEFUL_RUNS_AWAY, (int)i, "%.3f off, %.3f unit/s",
            stateful_unit(away->error_q32), stateful_unit(away->vel_q32));
}

/* What is read while it is played stops while there is enough to stop on; a tick
 * of the path has passed since that was looked at. */
static void judge_reading(struct stateful *bench)
{
    const struct controller *controller = &bench->controller;
    const int64_t tick_ns_q12 = 2 * bench->period_ns * MOTION_FIXED_NS_Q12;
    for (unsigned i = 0; i < bench->axes; i++) {
        const struct motion_track *track = controller->axis[i].track;
        if (track == NULL || track->outline == NULL ||
            controller->state != CONTROLLER_MOVING)
            continue;
        if (motion_track_ahead(track, controller->rate.s_ns_q12) <
            controller->reserve_ns_q12 - tick_ns_q12)
            stateful_violate(bench, STATEFUL_MISSED, (int)i,
                             "the move is not read in time");
    }
}

void stateful_judge_faults(struct stateful *bench)
{
    follow_button(bench);
    judge_latch(bench);
    judge_button(bench);
    judge_reading(bench);
    for (unsigned i = 0; i < bench->axes; i++)
        judge_away(bench, i);
}
