/* tests/firmware/control/stateful_home.c - homing, and switches wherever an
 * axis moves.
 *
 * Towards a switch that is active an axis goes no further than it needs to come
 * to rest by the stop limits, and what two ticks take; a leg of homing no
 * further than its distance and that; and an axis's turn takes no longer than
 * its time-out and a stop. */
#include <math.h>

#include "tests/firmware/control/stateful.h"

#define SPARE_NS INT64_C(150000000)

/* Acceleration goes to zero by jerk first; then rest by constant deceleration
 * with jerk at both ends, as long as that reaches the limit: v/2 (v/a + a/j),
 * else v sqrt(v/j). */
double stateful_brake_q32(const struct motion_clock_limit *limit, double vel,
                          double acc)
{
    const double a = (double)limit->acc_q32 / 0x1p32;
    const double j = (double)limit->jerk_q32 / 0x1p32;
    double displacement = 0;
    if (vel <= 0)
        return 0;
    if (j > 0 && acc > 0) {
        const double t = acc / j;
        displacement = vel * t + acc * t * t / 3;
        vel += acc * t / 2;
    }
    if (j == 0)
        displacement += vel * vel / (2 * a);
    else if (vel >= a * a / j)
        displacement += vel / 2 * (vel / a + a / j);
    else
        displacement += vel * sqrt(vel / j);
    return displacement * (double)MOTION_FIXED_ONE_Q32;
}

/* --- a switch ------------------------------------------------------------- */

/* Differences are means over the ticks before, and a look and its answer take a tick
 * each: in these three it may get as much faster as its limits let it, up to the speed
 * of the leg. */
static double brake_now_q32(const struct stateful *bench, unsigned i,
                            int direction)
{
    const struct motion_clock_limit *limit = &bench->axis_config[i].limit;
    const double t = (double)bench->period_ns / 1e9;
    if (bench->axis_config[i].by_goals)
        return stateful_goal_brake_q32(bench, i, direction);
    const double jerk = (double)limit->jerk_q32 / 0x1p32;
    const double most = (double)limit->acc_q32 / 0x1p32;
    const double now = direction * stateful_vel(bench, i);
    const double mean = fmax(direction * stateful_acc(bench, i), 0);
    const double acc = jerk > 0 ? fmin(mean + 3 * jerk * t, most) : most;
    const double vel = fmin(now + 3 * acc * t,
                            fmax(now, stateful_unit(bench->home[i].fast_q32)));
    return stateful_brake_q32(&bench->axis_config[i].stop, vel, acc) * 1.001 +
           (2 * t * vel + 1e-6 * bench->axis[i].scale) *
               (double)MOTION_FIXED_ONE_Q32;
}

static void judge_mark(struct stateful *bench, unsigned i,
                       enum stateful_switch which, int direction)
{
    struct stateful_mark *mark = &bench->judge.homing.mark[which];
    const int64_t pos_q32 = bench->judge.past[i].pos_q32[0];
    if (!stateful_axis_switch(&bench->axis[i], which) ||
        direction * stateful_vel(bench, i) <= 0) {
        mark->set = false;
        return;
    }
    if (!mark->set)
        *mark = (struct stateful_mark){
            true, pos_q32, (int64_t)brake_now_q32(bench, i, direction)
        };
    const int64_t displacement_q32 = direction * (pos_q32 - mark->pos_q32);
    if (displacement_q32 > mark->most_q32)
        stateful_violate(bench, STATEFUL_SWITCH, (int)i,
                         "%.6f past switch %d, allowed %.6f",
                         stateful_unit(displacement_q32), (int)which,
                         stateful_unit(mark->most_q32));
}

/* GO may cross the home switch. */
static void judge_homing_switches(struct stateful *bench)
{
    const unsigned i = bench->homing.axis;
    judge_mark(bench, i, STATEFUL_NEGATIVE, -1);
    judge_mark(bench, i, STATEFUL_POSITIVE, 1);
    if (bench->home[i].by == HOMING_SWITCH &&
        bench->home[i].input == HOMING_INPUT_HOME &&
        bench->judge.homing.leg != HOMING_GO)
        judge_mark(bench, i, STATEFUL_HOME, bench->home[i].direction);
}

/* Without homing a move towards an active limit switch is a fault at the next
 * look. */
static void judge_other_switches(struct stateful *bench, unsigned i)
{
    const double seen = stateful_vel(bench, i);
    const double least =
        8 * stateful_rounding(bench, i) * 1e9 / (double)bench->period_ns;
    const double vel = fabs(seen) > least ? seen : 0; /* rounding */
    bool *towards = &bench->judge.towards[i];
    const bool active =
        (vel < 0 && stateful_axis_switch(&bench->axis[i], STATEFUL_NEGATIVE)) ||
        (vel > 0 && stateful_axis_switch(&bench->axis[i], STATEFUL_POSITIVE));
    const bool is_seen = bench->axis[i].stale_ticks == 0 &&
                         (bench->axis[i].board == NULL ||
                          stateful_axis_follows(&bench->axis[i]));
    const bool now =
        active && is_seen && stateful_in_motion(bench->controller.state);
    if (now && *towards &&
        bench->controller.fault.fault == CONTROLLER_FAULT_NONE)
        stateful_violate(bench, STATEFUL_SWITCH, (int)i,
                         "%.6f unit/s and no fault", vel);
    *towards = now;
}

/* --- a leg, a turn -------------------------------------------------------- */

static bool is_leg(enum homing_state state)
{
    return state == HOMING_SEARCH || state == HOMING_RETURN ||
           state == HOMING_BACK || state == HOMING_LEAVE ||
           state == HOMING_APPROACH || state == HOMING_PRESS ||
           state == HOMING_PRESS_AGAIN || state == HOMING_GO;
}

static void judge_distance(struct stateful *bench)
{
    const struct stateful_homing *homing = &bench->judge.homing;
    const unsigned i = homing->axis;
    const struct motion_clock_limit *limit = &bench->axis_config[i].stop;
    const int64_t displacement_q32 =
        llabs(bench->judge.past[i].pos_q32[0] - homing->leg_q32);
    const double vel = stateful_unit(bench->home[i].fast_q32);
    const double acc = (double)bench->axis_config[i].limit.acc_q32 / 0x1p32;
    const double most_q32 = (double)bench->home[i].distance_q32 +
                            (double)bench->home[i].clear_q32 +
                            stateful_brake_q32(limit, vel, acc);
    if (homing->leg != HOMING_GO && homing->leg != HOMING_IDLE &&
        bench->judge.past[i].count > 0 && (double)displacement_q32 > most_q32)
        stateful_violate(bench, STATEFUL_DISTANCE, (int)i,
                         "%.6f, allowed %.6f in %s",
                         stateful_unit(displacement_q32),
                         most_q32 / (double)MOTION_FIXED_ONE_Q32,
                         homing_state_text(homing->leg));
}

static int64_t turn_bound_ns(const struct stateful *bench, unsigned i)
{
    const struct motion_clock_limit *limit = &bench->axis_config[i].stop;
    const double vel = stateful_unit(bench->home[i].fast_q32);
    const double acc = (double)limit->acc_q32 / 0x1p32;
    const double jerk = (double)limit->jerk_q32 / 0x1p32;
    const double yardstick =
        fmax(1.5 * vel / acc, jerk > 0 ? sqrt(6 * vel / jerk) : 0);
    return bench->home[i].timeout_ns + SPARE_NS + (int64_t)(1.5e9 * yardstick) +
           stateful_goal_turn_ns(bench, i);
}

static void judge_turn(struct stateful *bench)
{
    const struct stateful_homing *homing = &bench->judge.homing;
    const int64_t took_ns = bench->now_ns - homing->turn_ns;
    if (took_ns > turn_bound_ns(bench, homing->axis) &&
        bench->controller.fault.fault == CONTROLLER_FAULT_NONE)
        stateful_violate(bench, STATEFUL_TIMEOUT, (int)homing->axis,
                         "%.3f s, allowed %.3f s, %s", (double)took_ns / 1e9,
                         (double)bench->home[homing->axis].timeout_ns / 1e9,
                         homing_state_text(bench->homing.state));
}

/* Whatever ends torque ends it. */
static void judge_over(struct stateful *bench)
{
    const enum controller_state state = bench->controller.state;
    if ((state == CONTROLLER_OFF || state == CONTROLLER_FAULT) &&
        state == bench->judge.before)
        stateful_violate(bench, STATEFUL_TIMEOUT, (int)bench->homing.axis,
                         "in %s, %s", controller_state_text(state),
                         homing_state_text(bench->homing.state));
}

static void follow_homing(struct stateful *bench)
{
    struct stateful_homing *homing = &bench->judge.homing;
    const struct homing *now = &bench->homing;
    const bool began = !bench->judge.homed_before || now->axis != homing->axis;
    if (began || homing->turn_ns == 0)
        *homing = (struct stateful_homing){ .turn_ns = bench->now_ns };
    if (is_leg(now->state) && now->state != homing->leg) {
        homing->leg = now->state;
        homing->leg_q32 = bench->judge.past[now->axis].pos_q32[0];
        bench->judge.began_ns = bench->clock_ns;
    }
    homing->axis = now->axis;
    homing->state = now->state;
}

void stateful_judge_homing(struct stateful *bench)
{
    for (unsigned i = 0; i < bench->axes; i++)
        if (!homing_is_running(&bench->homing) || bench->homing.axis != i)
            judge_other_switches(bench, i);
        else
            bench->judge.towards[i] = false;
    if (!homing_is_running(&bench->homing)) {
        bench->judge.homing = (struct stateful_homing){ 0 };
        return;
    }
    judge_over(bench);
    if (bench->judge.homing.turn_ns != 0) {
        judge_homing_switches(bench);
        judge_distance(bench);
        judge_turn(bench);
    }
    follow_homing(bench);
}
