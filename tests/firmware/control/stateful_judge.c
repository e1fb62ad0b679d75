/* tests/firmware/control/stateful_judge.c - what every drive with torque was
 * told, tick by tick.
 *
 * With p0, p1, p2, p3 the set points of four ticks that follow each other,
 * newest first, and T the period, whatever was lost between them:
 *
 *     |p0 - p1| <= v T    |p0 - 2 p1 + p2| <= a T^2
 *     |p0 - 3 p1 + 3 p2 - p3| <= j T^3
 *
 * for every motion inside the limits: a difference is a mean of the derivative.
 * Whatever happens, every tick is judged by the limits that are in force in it: those
 * of stopping in a stop and after a fault.
 *
 * Each set point is rounded by up to 2 units of 2^-32, and by what 2 units of 2^-12 ns
 * of the path's time are at its speed; a follower's by its own 2, and by what those of
 * its master are on its curve.  So the differences are by 2, 4 and 8 of these; the
 * second and third have 16 units of 2^-32 at least, which the last gate lets through and
 * ramps may so use.  A rate has 30 bits, which is 2^-28 of an acceleration.  A motion
 * that goes on from another may start from an acceleration that was rounded (3 units of
 * 2^-16 or 2^-20 of the largest, track.h). */
#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "tests/firmware/control/stateful.h"

#define UNITS(n)   ((double)(n)*0x1p-32)
#define JERK_SHARE 1.01 /* p''' is looked at in the ticks, not between */
#define FIRST_Q32  ((int64_t)1 << 12)
#define OUT_Q32    2 /* MOTION_TRACK_POS_ROUNDING */

bool stateful_in_motion(enum controller_state state)
{
    return state == CONTROLLER_MOVING || state == CONTROLLER_HOLDING ||
           state == CONTROLLER_STOPPING;
}

/* --- differences -------------------------------------------------------- */

static double period_s(const struct stateful *bench)
{
    return (double)bench->period_ns / 1e9;
}

double stateful_vel(const struct stateful *bench, unsigned i)
{
    const struct stateful_past *past = &bench->judge.past[i];
    const struct stateful_axis *axis = &bench->axis[i];
    if (axis->mode == HAL_DRIVE_PROFILE_POSITION)
        return axis->state == HAL_DRIVE_ENABLED ? axis->vel : 0;
    return past->count < 2
               ? 0
               : stateful_unit(past->pos_q32[0] - past->pos_q32[1]) /
                     period_s(bench);
}

/* Its own, and that of each master in turn by what the curves make of it. */
double stateful_rounding(const struct stateful *bench, unsigned i)
{
    double sum = 0, slope = 1;
    for (unsigned n = 0; n < STATEFUL_AXES; n++) {
        const double vel = stateful_unit(bench->axis_config[i].limit.vel_q32);
        const struct stateful_coupling *coupling = &bench->coupling[i];
        sum += slope * (UNITS(2) + vel * 2 * 0x1p-12 * 1e-9);
        if (!coupling->is_on)
            break;
        slope *= stateful_unit(coupling->cam.slope_q32);
        i = coupling->cam.master;
    }
    return sum;
}

static double second(const struct stateful_past *past)
{
    return past->count < 3
               ? 0
               : stateful_unit(past->pos_q32[0] - past->pos_q32[1]) -
                     stateful_unit(past->pos_q32[1] - past->pos_q32[2]);
}

static double third(const struct stateful_past *past)
{
    struct stateful_past before = { .count = 3 };
    if (past->count < 4)
        return 0;
    memcpy(before.pos_q32, &past->pos_q32[1], sizeof past->pos_q32[0] * 3);
    return second(past) - second(&before);
}

double stateful_acc(const struct stateful *bench, unsigned i)
{
    return second(&bench->judge.past[i]) / (period_s(bench) * period_s(bench));
}

static void judge_push(struct stateful_past *past, int64_t pos_q32)
{
    memmove(&past->pos_q32[1], &past->pos_q32[0], sizeof past->pos_q32[0] * 3);
    past->pos_q32[0] = pos_q32;
    if (past->count < 4)
        past->count++;
}

/* --- limits ------------------------------------------------------------- */

static void judge_speed(struct stateful *bench, unsigned i)
{
    const double most =
        stateful_unit(bench->axis_config[i].limit.vel_q32) * period_s(bench);
    const double step = stateful_vel(bench, i) * period_s(bench);
    if (fabs(step) > most * (1 + 1e-9) + 2 * stateful_rounding(bench, i))
        stateful_violate(bench, STATEFUL_SPEED, (int)i, "%.6f over %.6f a tick",
                         step, most);
}

static double larger_q32(int64_t a, int64_t b)
{
    return (double)(a > b ? a : b) / 0x1p32;
}

/* What began within the stop limits may outlast the stop that asked for it. */
static bool outlasts(const struct stateful *bench,
                     const struct stateful_past *past)
{
    const struct motion_clock_warp *warp = &bench->controller.warp;
    return warp->t0_ns == past->hard_ns &&
           bench->controller.clock_ns <=
               warp->t0_ns + warp->dur_ns + bench->period_ns;
}

static void judge_acceleration(struct stateful *bench, unsigned i, bool hard)
{
    const struct controller_axis_config *config = &bench->axis_config[i];
    const double t2 = period_s(bench) * period_s(bench);
    const double most = (double)config->limit.acc_q32 / 0x1p32 * t2;
    const double most_hard =
        larger_q32(config->limit.acc_q32, config->stop.acc_q32) * t2;
    const double rounding = fmax(UNITS(16), 4 * stateful_rounding(bench, i));
    struct stateful_past *past = &bench->judge.past[i];
    const double step = fabs(second(past));
    const bool over = step > most * (1 + 0x1p-28) + rounding;
    if (hard)
        past->hard_ns = bench->controller.warp.t0_ns;
    past->is_hard = hard || (past->is_hard && (over || outlasts(bench, past)));
    if (past->is_hard ? step > most_hard * (1 + 0x1p-28) + rounding : over)
        stateful_violate(bench, STATEFUL_ACCELERATION, (int)i,
                         "%.3f over %.3f unit/s2%s", step / t2,
                         (past->is_hard ? most_hard : most) / t2,
                         past->is_hard ? " (stop)" : "");
}

static void judge_jerk(struct stateful *bench, unsigned i)
{
    const struct controller_axis_config *config = &bench->axis_config[i];
    struct stateful_past *past = &bench->judge.past[i];
    const double t = period_s(bench), t2 = t * t;
    past->hard_ticks = past->is_hard          ? 3
                       : past->hard_ticks > 0 ? past->hard_ticks - 1
                                              : 0;
    const bool hard = past->hard_ticks > 0;
    if (config->limit.jerk_q32 == 0 || (hard && config->stop.jerk_q32 == 0))
        return;
    const double most =
        hard ? larger_q32(config->limit.jerk_q32, config->stop.jerk_q32)
             : (double)config->limit.jerk_q32 / 0x1p32;
    const double acc =
        larger_q32(config->limit.acc_q32, hard ? config->stop.acc_q32 : 0);
    const double rounding = (3 * 0x1p-32 + acc * 0x1p-20) * t2 +
                            fmax(UNITS(16), 8 * stateful_rounding(bench, i));
    if (fabs(third(past)) > most * JERK_SHARE * t2 * t + rounding)
        stateful_violate(bench, STATEFUL_JERK, (int)i, "%.1f over %.1f%s",
                         third(past) / (t2 * t), most, hard ? " (stop)" : "");
}

/* Where a stop or homing is under way the stop limits may be in force. */
static bool may_be_hard(const struct stateful *bench)
{
    const struct stateful_judge *judge = &bench->judge;
    const enum controller_state state[] = { judge->before,
                                            bench->controller.state };
    for (int k = 0; k < 2; k++)
        if (state[k] == CONTROLLER_HOLDING || state[k] == CONTROLLER_STOPPING)
            return true;
    return bench->controller.reaction != CONTROLLER_REACT_NONE ||
           judge->homed_before || judge->stop.kind == STATEFUL_HARD_STOP ||
           judge->stop.kind == STATEFUL_HOME_STOP;
}

/* --- range -------------------------------------------------------------- */

static int64_t outside_q32(const struct controller_axis_config *config,
                           int64_t pos_q32)
{
    if (pos_q32 < config->pos_min_q32 - OUT_Q32)
        return config->pos_min_q32 - OUT_Q32 - pos_q32;
    if (pos_q32 > config->pos_max_q32 + OUT_Q32)
        return pos_q32 - config->pos_max_q32 - OUT_Q32;
    return 0;
}

/* Homing looks for a switch wherever it is; it goes to its place inside. */
static bool is_searching(const struct stateful *bench, unsigned i)
{
    const struct stateful_judge *judge = &bench->judge;
    return judge->homed_before && bench->homing.axis == i &&
           judge->homing.leg != HOMING_GO;
}

/* Inside, or, where it was outside, no further out. */
static void judge_range(struct stateful *bench, unsigned i)
{
    const struct controller_axis *axis = &bench->controller.axis[i];
    struct stateful_past *past = &bench->judge.past[i];
    if (is_searching(bench, i) || !axis->homed)
        past->any_range = true;
    else if (past->count < 2 || past->pos_q32[0] == past->pos_q32[1])
        past->any_range = false;
    if (past->any_range || past->count < 2)
        return;
    const int64_t now_q32 = outside_q32(&bench->axis_config[i],
                                        past->pos_q32[0] + axis->offset_q32);
    const int64_t then_q32 = outside_q32(&bench->axis_config[i],
                                         past->pos_q32[1] + axis->offset_q32);
    if (now_q32 > then_q32 + OUT_Q32)
        stateful_violate(bench, STATEFUL_RANGE, (int)i, "%.9f outside",
                         stateful_unit(now_q32));
}

/* --- where it stands, where it is on its track ---------------------------- */

static void judge_standing(struct stateful *bench, unsigned i)
{
    const struct stateful_past *past = &bench->judge.past[i];
    if (!stateful_in_motion(bench->judge.before) && past->count >= 2 &&
        past->pos_q32[0] != past->pos_q32[1])
        stateful_violate(bench, STATEFUL_STANDS, (int)i, "by %.9f, %s",
                         stateful_unit(past->pos_q32[0] - past->pos_q32[1]),
                         controller_state_text(bench->judge.before));
}

static void judge_path(struct stateful *bench, unsigned i)
{
    const struct controller *controller = &bench->controller;
    const struct controller_axis *axis = &controller->axis[i];
    const struct motion_track *track = stateful_track(bench, i);
    struct motion_cursor cursor = { 0 };
    struct motion_sample sample;
    if (bench->judge.motion != STATEFUL_MOVE || track == NULL ||
        bench->coupling[i].is_on || !bench->axis[i].told ||
        !stateful_in_motion(bench->judge.before))
        return;
    motion_track_sample(track, &cursor, controller->rate.s_ns_q12, &sample);
    if (bench->axis[i].told_q32 + axis->offset_q32 != sample.pos_q32)
        stateful_violate(
            bench, STATEFUL_PATH, (int)i, "%.9f, track %.9f",
            stateful_unit(bench->axis[i].told_q32 + axis->offset_q32),
            stateful_unit(sample.pos_q32));
}

/* The path goes the way that was asked for, and no other. */
static void judge_direction(struct stateful *bench)
{
    struct stateful_judge *judge = &bench->judge;
    const int64_t s_ns_q12 = bench->controller.rate.s_ns_q12;
    const int64_t on_ns_q12 = judge->is_reversed ? judge->s_ns_q12 - s_ns_q12
                                                 : s_ns_q12 - judge->s_ns_q12;
    if (judge->motion == STATEFUL_MOVE && !judge->is_fresh &&
        stateful_in_motion(judge->before) && on_ns_q12 < 0)
        stateful_violate(bench, STATEFUL_DIRECTION, -1, "by %.9f s",
                         (double)on_ns_q12 / (double)MOTION_FIXED_S_Q12);
    judge->s_ns_q12 = s_ns_q12;
    bench->tally.reversed += on_ns_q12 > 0 && judge->is_reversed;
}

/* --- one drive ---------------------------------------------------------- */

/* What a board's drive is told is the path's while it plays, else the board's own. */
static bool is_sent(const struct stateful_axis *axis)
{
    return axis->board == NULL || stateful_board_plays(axis->board);
}

/* A drive that is told nothing stays where it is. */
static int64_t axis_told_q32(const struct stateful *bench, unsigned i)
{
    const struct stateful_axis *axis = &bench->axis[i];
    const struct stateful_past *past = &bench->judge.past[i];
    if (axis->told)
        return axis->told_q32;
    return past->count > 0 ? past->pos_q32[0] : axis->hold_q32;
}

/* Where the axis is; of a board's, where the board has it. */
static void judge_first(struct stateful *bench, unsigned i)
{
    const struct stateful_axis *axis = &bench->axis[i];
    const int64_t off_q32 =
        bench->judge.past[i].pos_q32[0] -
        (axis->board != NULL ? axis->own_q32 : axis->seen.pos_q32);
    if (llabs(off_q32) > FIRST_Q32)
        stateful_violate(bench, STATEFUL_FIRST, (int)i, "%.9f off",
                         stateful_unit(off_q32));
}

static void judge_axis(struct stateful *bench, unsigned i)
{
    const struct stateful_axis *axis = &bench->axis[i];
    struct stateful_past *past = &bench->judge.past[i];
    if (axis->enabled_unasked)
        stateful_violate(bench, STATEFUL_ENABLES, (int)i, "%s",
                         controller_state_text(bench->controller.state));
    if (bench->controller.state != CONTROLLER_OFF)
        bench->axis[i].may_enable = false;
    if (!stateful_axis_follows(axis)) {
        *past = (struct stateful_past){ .count = 0 };
        return;
    }
    if (axis->is_first || !is_sent(axis))
        past->count = 0;
    judge_push(past, axis_told_q32(bench, i));
    if (past->count == 1 && (axis->board == NULL || axis->is_first))
        judge_first(bench, i);
    judge_standing(bench, i);
    if (axis->request != HAL_DRIVE_REQUEST_ENABLE)
        return; /* torque goes off: it stands, however it moved */
    judge_speed(bench, i);
    judge_acceleration(bench, i, may_be_hard(bench));
    judge_jerk(bench, i);
    judge_range(bench, i);
    judge_path(bench, i);
}

void stateful_judge_before(struct stateful *bench)
{
    bench->judge.before = bench->controller.state;
    bench->judge.homed_before = homing_is_running(&bench->homing);
    for (unsigned i = 0; i < bench->axes; i++)
        bench->axis[i].told = bench->axis[i].is_cut = false;
}

void stateful_judge_after(struct stateful *bench)
{
    for (unsigned i = 0; i < bench->axes; i++)
        judge_axis(bench, i);
    judge_direction(bench);
    stateful_judge_coupled(bench);
    stateful_judge_goals(bench);
    stateful_judge_torque(bench);
    stateful_judge_faults(bench);
    stateful_judge_homing(bench);
    stateful_judge_stop(bench);
    bench->judge.is_fresh = false;
}
