/* tests/firmware/control/stateful_goal.c - drives that go by their own profile:
 * what they were sent, and what the axis then does.
 *
 * A goal is sent in MOVING alone, to an axis that has part in the motion,
 * inside its range and limits, and not after a stop.  After a stop the axis
 * gets no faster, once the halt has come through, and rests in time; it never
 * leaves its range, and is where its track ends when the move is over. */
#include <math.h>

#include "tests/firmware/control/stateful.h"

#define LATE_TICKS 4 /* of feedback, and of a halt on its way to the drive */
#define OUT_Q32    4
#define BRAKE_S    1 /* firmware/control/goal.h */

static double limit_q32(int64_t value_q32)
{
    return (double)value_q32 / 0x1p32;
}

static double period_s(const struct stateful *bench)
{
    return (double)bench->period_ns / 1e9;
}

static int late_ticks(const struct stateful *bench, unsigned i)
{
    return LATE_TICKS + bench->axis[i].profile.delay_ticks;
}

/* From its speed, after some ticks more of speeding up. */
double stateful_goal_rest_s(const struct stateful *bench, unsigned i)
{
    const struct stateful_axis *axis = &bench->axis[i];
    const struct motion_clock_limit *limit = &bench->axis_config[i].limit;
    const double acc = limit_q32(limit->acc_q32);
    const double late = late_ticks(bench, i) * period_s(bench);
    const double vel = fabs(axis->vel) + acc * late;
    const bool is_on = stateful_profile_is_on(&axis->profile);
    if (!bench->axis_config[i].by_goals || (!is_on && axis->vel == 0))
        return 0;
    return fmax(BRAKE_S, vel / acc) + 3 * late;
}

/* More, for an axis that is homed. */
int64_t stateful_goal_turn_ns(const struct stateful *bench, unsigned i)
{
    const struct motion_clock_limit *limit = &bench->axis_config[i].limit;
    const double late = late_ticks(bench, i) * period_s(bench);
    const double brake =
        fmax(BRAKE_S, limit_q32(limit->vel_q32) / limit_q32(limit->acc_q32));
    const int64_t bad_ns =
        bench->axis[i].profile.is_bad ? bench->config.stop_timeout_ns : 0;
    return bench->axis_config[i].by_goals
               ? bad_ns + (int64_t)((brake + 3 * late) * 1e9)
               : 0;
}

bool stateful_goal_runs_on(const struct stateful *bench, unsigned i)
{
    return bench->axis_config[i].by_goals && !bench->axis[i].profile.halts &&
           bench->judge.stop.kind == STATEFUL_HOLD;
}

double stateful_goal_rise(const struct stateful *bench, unsigned i)
{
    return limit_q32(bench->axis_config[i].limit.acc_q32) *
           late_ticks(bench, i) * period_s(bench);
}

double stateful_goal_brake_q32(const struct stateful *bench, unsigned i,
                               int direction)
{
    const double acc = limit_q32(bench->axis_config[i].limit.acc_q32);
    const double late = late_ticks(bench, i) * period_s(bench);
    const double vel = direction * bench->axis[i].vel + acc * late;
    return vel <= 0 ? 0
                    : (double)MOTION_FIXED_ONE_Q32 *
                          (vel * vel / (2 * acc) + 2 * vel * late);
}

static int64_t outside_q32(const struct stateful *bench, unsigned i,
                           int64_t pos_q32)
{
    const struct controller_axis_config *config = &bench->axis_config[i];
    if (pos_q32 < config->pos_min_q32)
        return config->pos_min_q32 - pos_q32;
    return pos_q32 > config->pos_max_q32 ? pos_q32 - config->pos_max_q32 : 0;
}

/* As the drive sees it: where its encoder has slipped nobody else knows. */
static int64_t place_q32(const struct stateful *bench, unsigned i)
{
    const struct stateful_axis *axis = &bench->axis[i];
    return axis->pos_q32 + axis->slip_q32 +
           bench->controller.axis[i].offset_q32;
}

static bool range_counts(const struct stateful *bench, unsigned i)
{
    const struct stateful_judge *judge = &bench->judge;
    const bool searches = judge->homed_before && bench->homing.axis == i &&
                          judge->homing.leg != HOMING_GO;
    return bench->controller.axis[i].homed && !searches;
}

/* --- what it was sent ------------------------------------------------------ */

static void judge_sent(struct stateful *bench, unsigned i)
{
    const struct stateful_axis *axis = &bench->axis[i];
    const struct controller_axis *own = &bench->controller.axis[i];
    const struct hal_drive_go *go = &axis->profile.next;
    const struct motion_clock_limit *limit = &bench->axis_config[i].limit;
    if (bench->judge.before != CONTROLLER_MOVING)
        stateful_violate(bench, STATEFUL_GOAL, (int)i, "in %s",
                         controller_state_text(bench->judge.before));
    if (bench->judge.stop.kind != STATEFUL_GOES)
        stateful_violate(bench, STATEFUL_GOAL, (int)i, "after a stop");
    if (own->track == NULL && bench->controller.state == CONTROLLER_MOVING)
        stateful_violate(bench, STATEFUL_GOAL, (int)i, "without a track");
    if (go->vel_q32 > limit->vel_q32)
        stateful_violate(bench, STATEFUL_SPEED, (int)i, "asked for %.6f",
                         stateful_unit(go->vel_q32));
    if (go->acc_q32 > limit->acc_q32 || go->dec_q32 > limit->acc_q32)
        stateful_violate(bench, STATEFUL_ACCELERATION, (int)i,
                         "asked for %.6f, %.6f", limit_q32(go->acc_q32),
                         limit_q32(go->dec_q32));
    if (range_counts(bench, i) &&
        outside_q32(bench, i, go->pos_q32 + own->offset_q32) > OUT_Q32 &&
        outside_q32(bench, i, go->pos_q32 + own->offset_q32) >
            outside_q32(bench, i, place_q32(bench, i)) + OUT_Q32)
        stateful_violate(bench, STATEFUL_RANGE, (int)i, "sent to %.6f",
                         stateful_unit(go->pos_q32 + own->offset_q32));
}

/* --- what it does ---------------------------------------------------------- */

static void judge_range(struct stateful *bench, unsigned i)
{
    const struct stateful_axis *axis = &bench->axis[i];
    struct stateful_goer *goer = &bench->judge.goer[i];
    const int64_t offset_q32 = bench->controller.axis[i].offset_q32;
    const int64_t now_q32 = outside_q32(bench, i, place_q32(bench, i));
    if (!range_counts(bench, i) || goer->slip_q32 != axis->slip_q32)
        goer->any_range = true;
    else if (axis->vel == 0)
        goer->any_range = false;
    if (!goer->any_range && goer->offset_q32 == offset_q32 && axis->vel != 0 &&
        axis->profile.short_q32 == 0 && /* else it turns back where it is */
        now_q32 > goer->outside_q32 + OUT_Q32)
        stateful_violate(bench, STATEFUL_RANGE, (int)i, "%.6f outside",
                         stateful_unit(now_q32));
    goer->outside_q32 = now_q32;
    goer->offset_q32 = offset_q32;
    goer->slip_q32 = axis->slip_q32;
}

/* Where it stands when torque comes on it stays. */
static void judge_standing(struct stateful *bench, unsigned i)
{
    const struct stateful_axis *axis = &bench->axis[i];
    const bool moves = axis->vel != 0 || stateful_profile_is_on(&axis->profile);
    if (moves && axis->home_ticks == 0 &&
        !stateful_in_motion(bench->judge.before) &&
        !stateful_in_motion(bench->controller.state))
        stateful_violate(bench, STATEFUL_STANDS, (int)i, "%.6f unit/s, %s",
                         axis->vel,
                         controller_state_text(bench->controller.state));
}

static void judge_stopping(struct stateful *bench, unsigned i)
{
    const struct stateful_axis *axis = &bench->axis[i];
    const struct stateful_stop *stop = &bench->judge.stop;
    struct stateful_goer *goer = &bench->judge.goer[i];
    const int64_t since_ns = bench->clock_ns - stop->requested_ns;
    if (stop->kind != STATEFUL_GOES && !stateful_goal_runs_on(bench, i) &&
        since_ns > late_ticks(bench, i) * bench->period_ns &&
        fabs(axis->vel) > fabs(goer->vel) * (1 + 1e-9) + 1e-9)
        stateful_violate(bench, STATEFUL_FASTER, (int)i,
                         "%.6f over %.6f unit/s", axis->vel, goer->vel);
    goer->vel = axis->vel;
}

/* The move is over: all goals have been reached. */
static void judge_end(struct stateful *bench, unsigned i)
{
    const struct stateful_judge *judge = &bench->judge;
    const struct controller_axis *own = &bench->controller.axis[i];
    struct stateful_goer *goer = &bench->judge.goer[i];
    const int64_t off_q32 =
        bench->axis[i].seen.pos_q32 + own->offset_q32 - goer->end_q32;
    if (own->track != NULL && judge->motion == STATEFUL_MOVE) {
        goer->has_end = true;
        goer->end_q32 = own->track->end.pos_q32;
        return;
    }
    if (goer->has_end && bench->controller.state == CONTROLLER_READY &&
        judge->before == CONTROLLER_MOVING &&
        judge->stop.kind == STATEFUL_GOES &&
        llabs(off_q32) > bench->axis_config[i].following_floor_q32)
        stateful_violate(bench, STATEFUL_PATH, (int)i, "%.6f off its goal",
                         stateful_unit(off_q32));
    goer->has_end = false;
}

static void judge_goer(struct stateful *bench, unsigned i)
{
    struct stateful_axis *axis = &bench->axis[i];
    if (axis->profile.taken) {
        judge_sent(bench, i);
        bench->tally.goals++;
    }
    axis->profile.taken = false;
    if (axis->state != HAL_DRIVE_ENABLED ||
        axis->request != HAL_DRIVE_REQUEST_ENABLE) {
        bench->judge.goer[i] = (struct stateful_goer){ .any_range = true };
        return;
    }
    judge_end(bench, i);
    if (axis->mode != HAL_DRIVE_PROFILE_POSITION)
        return;
    judge_range(bench, i);
    judge_standing(bench, i);
    judge_stopping(bench, i);
}

void stateful_judge_goals(struct stateful *bench)
{
    for (unsigned i = 0; i < bench->axes; i++)
        if (bench->axis_config[i].by_goals)
            judge_goer(bench, i);
}
