/* tests/firmware/control/stateful_axis.c - a drive with an axis, as the
 * standard and bad luck have them.
 *
 * With torque it follows the set point of two periods ago, but for what the
 * load takes (droop); it gets there in some milliseconds.  Quick stop and the
 * loss of torque are decelerations, not jumps.  Enabling, switching off and a
 * reset take their time, and a set point that is given without torque is
 * forgotten.  Feedback is what the last SYNC latched. */
#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "tests/firmware/control/stateful.h"

#define SECOND_NS 1e9
#define STANDS    0.01 /* unit/s, of scale 1: the window of a drive */
/* How far from the axis its first set point may be. */
#define FIRST 0.25

static struct stateful_axis *axis_of(struct hal_drive *drive)
{
    return (struct stateful_axis *)drive;
}

bool stateful_axis_has_torque(const struct stateful_axis *axis)
{
    return axis->state == HAL_DRIVE_ENABLED ||
           axis->state == HAL_DRIVE_QUICK_STOP;
}

/* For the judge: it may not move then. */
static void axis_cut(struct stateful_axis *axis, enum hal_drive_request request)
{
    if (request != HAL_DRIVE_REQUEST_OFF || !stateful_axis_has_torque(axis))
        return;
    axis->is_cut = true;
    axis->cut_state = axis->state;
    axis->cut_mode = axis->mode;
    axis->cut_vel = axis->vel;
}

void stateful_axis_request(struct hal_drive *drive,
                           enum hal_drive_request request)
{
    struct stateful_axis *axis = axis_of(drive);
    if (request == HAL_DRIVE_REQUEST_ENABLE && !axis->may_enable)
        axis->enabled_unasked = true;
    if (request == axis->request ||
        (request == HAL_DRIVE_REQUEST_RESET && axis->state != HAL_DRIVE_FAULT &&
         axis->state != HAL_DRIVE_OFFLINE))
        return;
    axis_cut(axis, request);
    axis->request = request;
    if (request != HAL_DRIVE_REQUEST_ENABLE)
        axis->home_ticks = 0;
    if (request == HAL_DRIVE_REQUEST_ENABLE)
        axis->wait = axis->enable_ticks;
    else
        axis->wait = request == HAL_DRIVE_REQUEST_RESET ? axis->reset_ticks
                                                        : axis->off_ticks;
    if (request == HAL_DRIVE_REQUEST_QUICK_STOP &&
        axis->state == HAL_DRIVE_ENABLED)
        axis->state = HAL_DRIVE_QUICK_STOP;
}

bool stateful_axis_follows(const struct stateful_axis *axis)
{
    return axis->state == HAL_DRIVE_ENABLED &&
           axis->mode == HAL_DRIVE_STREAM_POSITION &&
           (axis->board == NULL || axis->is_known);
}

static int axis_set_target(struct hal_drive *drive,
                           const struct hal_drive_target *target)
{
    struct stateful_axis *axis = axis_of(drive);
    if (!stateful_axis_follows(axis))
        return MOTION_OK;
    if (axis->is_first && llabs(target->pos_q32 - axis->seen.pos_q32) >
                              stateful_q32(FIRST * axis->scale)) {
        axis->state = HAL_DRIVE_FAULT;
        return MOTION_E_AWAY;
    }
    axis->told = true;
    axis->told_q32 = target->pos_q32;
    return MOTION_OK;
}

static void axis_feedback(struct hal_drive *drive,
                          struct hal_drive_feedback *feedback)
{
    const struct stateful_axis *axis = axis_of(drive);
    const struct stateful_zone *zone = axis->zone;
    *feedback = (struct hal_drive_feedback){
        .state = axis->state,
        .pos_q32 = axis->seen.pos_q32,
        .vel_q32 = axis->seen.vel_q32,
        .t_ns = axis->seen.t_ns,
        .demand_age_ns = 2 * axis->period_ns,
        .following = axis->state == HAL_DRIVE_ENABLED,
        .fault_code = axis->state == HAL_DRIVE_FAULT ? 0x2310 : 0,
        .mode = axis->mode,
        .homing = axis->homing,
        .arrived = axis->profile.seen_arrived,
        .torque_known = axis->has_stops,
        .torque_permille = 1000 * axis->pressed,
        .limit_negative = zone[STATEFUL_NEGATIVE].by_drive &&
                          stateful_axis_switch(axis, STATEFUL_NEGATIVE),
        .limit_positive = zone[STATEFUL_POSITIVE].by_drive &&
                          stateful_axis_switch(axis, STATEFUL_POSITIVE),
        .home_switch = zone[STATEFUL_HOME].by_drive &&
                       stateful_axis_switch(axis, STATEFUL_HOME),
    };
}

/* --- homing of its own ---------------------------------------------------- */

static unsigned axis_modes(struct hal_drive *drive)
{
    const struct stateful_axis *axis = axis_of(drive);
    unsigned modes = 1u << HAL_DRIVE_STREAM_POSITION;
    if (axis->homes)
        modes |= 1u << HAL_DRIVE_HOMING;
    if (axis->profile.there)
        modes |= 1u << HAL_DRIVE_PROFILE_POSITION;
    return modes;
}

static int axis_set_mode(struct hal_drive *drive, enum hal_drive_mode mode)
{
    struct stateful_axis *axis = axis_of(drive);
    if ((axis_modes(drive) >> mode & 1) == 0)
        return MOTION_E_EMPTY;
    if ((axis->state != HAL_DRIVE_ENABLED && axis->state != HAL_DRIVE_OFF) ||
        fabs(axis->vel) > STANDS * axis->scale || axis->home_ticks > 0 ||
        stateful_profile_is_on(&axis->profile))
        return MOTION_E_STATE;
    if (axis->next_mode == mode)
        return MOTION_OK;
    axis->next_mode = mode;
    axis->mode_ticks = 3;
    return MOTION_OK;
}

static int axis_home(struct hal_drive *drive, const struct hal_drive_home *home)
{
    struct stateful_axis *axis = axis_of(drive);
    if (axis->state != HAL_DRIVE_ENABLED || axis->mode != HAL_DRIVE_HOMING ||
        axis->vel != 0)
        return MOTION_E_STATE;
    axis->homing = HAL_DRIVE_HOMING_RUNNING;
    axis->home_ticks = 400;
    axis->home_q32 = home->pos_q32;
    return MOTION_OK;
}

static int axis_go(struct hal_drive *drive, const struct hal_drive_go *go)
{
    return stateful_profile_go(axis_of(drive), go);
}

static int axis_halt(struct hal_drive *drive)
{
    struct stateful_axis *axis = axis_of(drive);
    if (axis->mode == HAL_DRIVE_PROFILE_POSITION)
        return stateful_profile_halt(axis);
    if (axis->homing != HAL_DRIVE_HOMING_RUNNING)
        return MOTION_E_STATE;
    axis->home_ticks = 0;
    axis->homing = HAL_DRIVE_HOMING_FAILED;
    return MOTION_OK;
}

static const struct hal_drive_ops axis_ops = {
    .request = stateful_axis_request,
    .set_target = axis_set_target,
    .feedback = axis_feedback,
    .modes = axis_modes,
    .set_mode = axis_set_mode,
    .go = axis_go,
    .home = axis_home,
    .halt = axis_halt,
};

void stateful_axis_init(struct stateful_axis *axis)
{
    axis->scale = axis->scale == 0 ? 1 : axis->scale;
    axis->drive.ops = &axis_ops;
    axis->state = HAL_DRIVE_OFF;
    axis->seen.pos_q32 = axis->pos_q32;
    axis->seen.t_ns = axis->now_ns;
}

/* --- switches ----------------------------------------------------------- */

bool stateful_axis_switch(const struct stateful_axis *axis,
                          enum stateful_switch which)
{
    const struct stateful_zone *zone = &axis->zone[which];
    return zone->there && axis->pos_q32 >= zone->low_q32 &&
           axis->pos_q32 <= zone->high_q32;
}

static int line_get(struct hal_gpio *gpio)
{
    const struct stateful_line *line = (const struct stateful_line *)gpio;
    return line->axis ? stateful_axis_switch(line->axis, line->which)
                      : line->active;
}

static int line_event(struct hal_gpio *gpio, struct hal_gpio_event *event)
{
    (void)gpio;
    (void)event;
    return 0;
}

const struct hal_gpio_ops stateful_line_ops = { .get = line_get,
                                                .event = line_event };

/* --- time passes -------------------------------------------------------- */

/* It holds where its encoder says that it is, and has no set point yet. */
static void axis_takes_over(struct stateful_axis *axis)
{
    axis->pos_q32 += axis->slip_q32;
    axis->slip_q32 = 0;
    axis->sag_q32 = 0;
    axis->vel = 0;
    axis->hold_q32 = axis->pos_q32;
    axis->given_count = 0;
    axis->is_first = true;
}

static void axis_coast(struct stateful_axis *axis, double dt)
{
    const double loss = axis->brake * dt;
    axis->pos_q32 += stateful_q32(axis->vel * dt);
    axis->vel = fabs(axis->vel) <= loss ? 0
                : axis->vel > 0         ? axis->vel - loss
                                        : axis->vel + loss;
}

/* Torque comes on. */
static void axis_up(struct stateful_axis *axis)
{
    axis->state = HAL_DRIVE_ENABLED;
    axis_takes_over(axis);
}

/* Every place is called otherwise from now on. */
static void axis_rename(struct stateful_axis *axis, int64_t shift_q32)
{
    axis->pos_q32 += shift_q32;
    for (int which = 0; which < STATEFUL_SWITCHES; which++) {
        axis->zone[which].low_q32 += shift_q32;
        axis->zone[which].high_q32 += shift_q32;
    }
    axis->stop_q32[0] += shift_q32;
    axis->stop_q32[1] += shift_q32;
}

static void axis_end_homing(struct stateful_axis *axis)
{
    axis->homing =
        axis->home_fails ? HAL_DRIVE_HOMING_FAILED : HAL_DRIVE_HOMING_DONE;
    axis->home_fails = false;
    axis->vel = 0;
    if (axis->homing == HAL_DRIVE_HOMING_DONE)
        axis_rename(axis, axis->home_q32 - axis->pos_q32);
}

/* In another mode than that of set points it moves by itself, or stands. */
static void axis_by_profile(struct stateful_axis *axis, double dt)
{
    if (axis->home_ticks > 0) {
        axis->vel = axis->home_vel;
        axis->pos_q32 += stateful_q32(axis->vel * dt);
        if (--axis->home_ticks == 0)
            axis_end_homing(axis);
        return;
    }
    if (axis->state == HAL_DRIVE_ENABLED &&
        axis->mode == HAL_DRIVE_PROFILE_POSITION) {
        stateful_profile_advance(axis, dt);
        return;
    }
    stateful_profile_end(&axis->profile);
    axis_coast(axis, dt);
}

static void axis_change_mode(struct stateful_axis *axis)
{
    if (axis->mode == axis->next_mode || --axis->mode_ticks > 0)
        return;
    axis->mode = axis->next_mode;
    axis->vel = 0;
    if (stateful_axis_follows(axis))
        axis_takes_over(axis);
}

void stateful_axis_walk(struct stateful_axis *axis)
{
    if (axis->board != NULL && axis->board->does != STATEFUL_BOARD_STANDS)
        return;
    if (axis->wait > 0 && axis->wait-- > 0)
        return;
    switch (axis->request) {
    case HAL_DRIVE_REQUEST_ENABLE:
        if ((axis->state == HAL_DRIVE_OFF ||
             axis->state == HAL_DRIVE_ENABLING) &&
            axis->vel == 0)
            axis_up(axis);
        break;
    case HAL_DRIVE_REQUEST_RESET:
        if ((axis->state == HAL_DRIVE_FAULT && !axis->ill) ||
            (axis->state == HAL_DRIVE_OFFLINE && !axis->away))
            axis->state = HAL_DRIVE_OFF;
        break;
    case HAL_DRIVE_REQUEST_OFF:
    case HAL_DRIVE_REQUEST_TORQUE_OFF:
        if (axis->state != HAL_DRIVE_FAULT && axis->state != HAL_DRIVE_OFFLINE)
            axis->state = HAL_DRIVE_OFF;
        break;
    case HAL_DRIVE_REQUEST_QUICK_STOP:
        if (axis->state == HAL_DRIVE_ENABLING)
            axis->state = HAL_DRIVE_OFF;
        break;
    }
}

/* The set point that was given two periods ago. */
int64_t stateful_axis_demand_q32(const struct stateful_axis *axis)
{
    for (unsigned i = 0; i < axis->given_count; i++)
        if (axis->given[i].t_ns <= axis->now_ns - 2 * axis->period_ns)
            return axis->given[i].pos_q32;
    return axis->given_count < STATEFUL_GIVEN
               ? axis->hold_q32
               : axis->given[STATEFUL_GIVEN - 1].pos_q32;
}

static void axis_run_away(struct stateful_axis *axis, double dt)
{
    axis->vel += axis->runaway * dt;
    axis->pos_q32 += stateful_q32(axis->vel * dt);
}

/* It gives way under its load with a time constant of five milliseconds. */
static void axis_follow(struct stateful_axis *axis, double dt)
{
    const int64_t before_q32 = axis->pos_q32;
    const double share = 1 - exp(-dt / 5e-3);
    axis->sag_q32 +=
        (int64_t)(share * (double)(axis->droop_q32 - axis->sag_q32));
    axis->pos_q32 = stateful_axis_demand_q32(axis) + axis->sag_q32;
    if (axis->lag_s > 0)
        axis->pos_q32 =
            before_q32 + (int64_t)((1 - exp(-dt / axis->lag_s)) *
                                   (double)(axis->pos_q32 - before_q32));
    axis->vel = stateful_unit(axis->pos_q32 - before_q32) / dt;
}

/* With torque it presses as long as its set points are beyond. */
static void axis_meets_stops(struct stateful_axis *axis)
{
    axis->pressed = 0;
    if (!axis->has_stops)
        return;
    for (int side = 0; side < 2; side++) {
        const int direction = side == 0 ? -1 : 1;
        if (direction * (axis->pos_q32 - axis->stop_q32[side]) <= 0)
            continue;
        axis->pos_q32 = axis->stop_q32[side];
        axis->vel = 0;
        axis->pressed = stateful_axis_follows(axis) ? direction : 0;
    }
}

void stateful_axis_advance(struct stateful_axis *axis)
{
    const double dt = (double)axis->period_ns / SECOND_NS;
    axis->now_ns += axis->period_ns;
    stateful_axis_walk(axis);
    axis_change_mode(axis);
    if (axis->state != HAL_DRIVE_ENABLED)
        axis->home_ticks = 0;
    if (stateful_axis_follows(axis) && axis->runaway != 0)
        axis_run_away(axis, dt);
    else if (stateful_axis_follows(axis))
        axis_follow(axis, dt);
    else
        axis_by_profile(axis, dt);
    axis_meets_stops(axis);
}

static void axis_take(struct stateful_axis *axis)
{
    memmove(&axis->given[1], &axis->given[0],
            sizeof axis->given - sizeof axis->given[0]);
    axis->given[0].pos_q32 = axis->told_q32;
    axis->given[0].t_ns = axis->now_ns;
    if (axis->given_count < STATEFUL_GIVEN)
        axis->given_count++;
    axis->is_first = false;
}

void stateful_axis_sync(struct stateful_axis *axis)
{
    if (axis->board != NULL) {
        axis->is_first = axis->is_first && !axis->told;
        return; /* it is asked for where it is */
    }
    if (axis->told && stateful_axis_follows(axis))
        axis_take(axis);
    if (axis->stale_ticks > 0 && axis->stale_ticks-- > 0)
        return;
    axis->profile.seen_arrived = axis->profile.arrived;
    axis->seen.pos_q32 = axis->pos_q32 + axis->slip_q32;
    axis->seen.vel_q32 = stateful_q32(axis->vel);
    axis->seen.demand_q32 = stateful_axis_demand_q32(axis);
    axis->seen.t_ns = axis->now_ns;
}
