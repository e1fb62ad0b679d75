/* tests/firmware/control/stateful_stop.c - a stop always stops: no faster than
 * before, at rest in time, at rest for good.
 *
 * The rate of a path may rise while r' is brought to zero as the limits of jerk
 * let it: how far is found by going that way along the tracks.  Without a limit
 * of jerk four ticks do it.  An axis that jogs may gain what its acceleration
 * makes unavoidable, a^2 / 2j. */
#include <math.h>

#include "tests/firmware/control/stateful.h"

#define SPARE_S           0.5
#define YARDSTICKS        3 /* of the longest cubic ramp that it needs alone */
#define YARDSTICKS_STATED 16
#define TICKS             4 /* until acceleration can be gone, without a limit */
#define FOUND_TICKS       3 /* until a change of rate has been found */
#define DRIVE_TICKS       10
#define RISE_TICKS        2000

static double limit_q32(int64_t value_q32)
{
    return (double)value_q32 / 0x1p32;
}

static int64_t least_q32(int64_t a, double b)
{
    return b < (double)a ? (int64_t)b + 1 : a;
}

static double track_vel(const struct motion_track *track)
{
    struct motion_extreme extreme;
    motion_track_extreme(track, MOTION_VEL, &extreme);
    return stateful_unit(extreme.max > -extreme.min ? extreme.max
                                                    : -extreme.min);
}

static const struct motion_clock_limit *stop_limit(const struct stateful *bench,
                                                   unsigned i,
                                                   enum stateful_stop_kind kind)
{
    const struct controller_axis_config *config = &bench->axis_config[i];
    return kind == STATEFUL_FAULT_STOP || kind == STATEFUL_HARD_STOP ||
                   kind == STATEFUL_HOME_STOP
               ? &config->stop
               : &config->limit;
}

/* Less where it takes others along in a jog, whose curves need a share of theirs: in
 * thirds, of what C', C'' and C''' leave. */
static struct motion_clock_limit shared_limit(const struct stateful *bench,
                                              unsigned i,
                                              enum stateful_stop_kind kind)
{
    struct motion_clock_limit limit = *stop_limit(bench, i, kind);
    const double vel = limit_q32(limit.vel_q32);
    for (unsigned k = 0; k < bench->axes; k++) {
        const struct stateful_coupling *coupling = &bench->coupling[k];
        const struct motion_clock_limit *own = stop_limit(bench, k, kind);
        const double slope = 3 * limit_q32(coupling->cam.slope_q32) + 1e-12;
        const double second = ldexp(limit_q32(coupling->cam.second_q32),
                                    -2 * coupling->cam.shift);
        const double bend = 9 * second * vel;
        if (!coupling->is_on || coupling->cam.master != i)
            continue;
        limit.acc_q32 = least_q32(limit.acc_q32, (double)own->acc_q32 / slope);
        if (own->jerk_q32 == 0)
            continue;
        if (bend > 0)
            limit.acc_q32 =
                least_q32(limit.acc_q32, (double)own->jerk_q32 / bend);
        limit.jerk_q32 =
            limit.jerk_q32 == 0
                ? (int64_t)((double)own->jerk_q32 / slope)
                : least_q32(limit.jerk_q32, (double)own->jerk_q32 / slope);
    }
    return limit;
}

/* Of the clock that reads the path. */
static double direction(const struct stateful *bench)
{
    return bench->controller.is_reversed ? -1 : 1;
}

/* The rate now, or what it may be on its way to. */
static double stop_rate(const struct stateful *bench)
{
    const double rate = fabs((double)bench->controller.rate.rate_q30 * 0x1p-30);
    const double requested = (double)bench->controller.override_q30 * 0x1p-30;
    return fmax(rate, fmax(requested, 1));
}

/* What the longest ramp of one axis would take alone, in seconds. */
static double stop_yardstick(const struct stateful *bench,
                             enum stateful_stop_kind kind)
{
    double longest = 0;
    for (unsigned i = 0; i < bench->axes; i++) {
        const struct motion_track *track = stateful_track(bench, i);
        const struct motion_clock_limit limit = shared_limit(bench, i, kind);
        if (track == NULL)
            continue;
        const double dv = track_vel(track) * stop_rate(bench);
        longest = fmax(longest, 1.5 * dv / limit_q32(limit.acc_q32));
        if (limit.jerk_q32 > 0)
            longest = fmax(longest, sqrt(6 * dv / limit_q32(limit.jerk_q32)));
    }
    return longest;
}

/* How fast r' may fall at one place: the largest J of
 *     p''' = f''' r^3 + 3 f'' r r' - f' J
 * that the limit of jerk of every axis leaves, and half of that, because ramps
 * are whole ticks and their J are rungs of a ladder. */
static double steepest(const struct stateful *bench,
                       enum stateful_stop_kind kind, double s_ns_q12, double r,
                       double accel)
{
    double jerk = accel / ((double)bench->period_ns / 1e9);
    for (unsigned i = 0; i < bench->axes; i++) {
        const struct motion_track *track = stateful_track(bench, i);
        const int64_t most = shared_limit(bench, i, kind).jerk_q32;
        struct motion_state f;
        if (track == NULL || most == 0)
            continue;
        motion_track_state(track, (int64_t)s_ns_q12, &f);
        const double vel = direction(bench) * stateful_unit(f.vel_q32);
        const double own =
            direction(bench) * limit_q32(f.jerk_q32) * r * r * r +
            3 * limit_q32(f.acc_q32) * r * accel;
        jerk = fmin(jerk, (limit_q32(most) + (vel < 0 ? -own : own)) /
                              (2 * fabs(vel) + 1e-9));
    }
    return jerk;
}

struct rise {
    double s_ns_q12, r, accel;
};

static void rise_tick(const struct stateful *bench, struct rise *at,
                      double jerk)
{
    const double t = (double)bench->period_ns / 1e9;
    at->r += at->accel * t;
    at->s_ns_q12 += direction(bench) * at->r * t * (double)MOTION_FIXED_S_Q12;
    at->accel -= jerk * t;
}

/* The J that every place leaves while it brings r' to 0 from `at` on; 0:
 * none. */
static double steepest_all_along(const struct stateful *bench,
                                 enum stateful_stop_kind kind,
                                 const struct rise *at)
{
    double jerk = steepest(bench, kind, at->s_ns_q12, at->r, at->accel);
    for (bool fits = false; !fits && jerk > 0;) {
        struct rise then = *at;
        fits = true;
        for (int n = 0; n < RISE_TICKS && then.accel > 0 && fits; n++) {
            const double here =
                steepest(bench, kind, then.s_ns_q12, then.r, then.accel);
            const double end = then.accel / ((double)bench->period_ns / 1e9);
            fits = here >= fmin(jerk, end) * (1 - 1e-9);
            if (!fits)
                jerk = fmin(here, jerk * 0.9);
            rise_tick(bench, &then, jerk);
        }
    }
    return fmax(jerk, 0);
}

/* The r'' that the limits of jerk force on a place which leaves no J > 0, as a J:
 * without the half of `steepest`. */
static double forced(const struct stateful *bench, enum stateful_stop_kind kind,
                     const struct rise *at)
{
    return fmin(0, 2 * steepest(bench, kind, at->s_ns_q12, at->r, at->accel));
}

/* How far the rate rises while r' > 0 is brought to zero by one J, as soon as
 * the limits of jerk leave one; until then r' rises where they force it to.  A J comes
 * into force some ticks after the request (firmware/control/ramp_step.h), which TICKS
 * allow for, so it is one that the path leaves there. */
static double unavoidable(const struct stateful *bench,
                          enum stateful_stop_kind kind,
                          const struct motion_clock_rate *from)
{
    struct rise at = { (double)from->s_ns_q12, (double)from->rate_q30 * 0x1p-30,
                       (double)from->accel_q30 * 0x1p-30 };
    double most = 0, waits = 0;
    for (int n = 0; n < RISE_TICKS && at.accel > 0; n++) {
        const double jerk = steepest_all_along(bench, kind, &at);
        const double before = at.r;
        if (jerk > 0)
            most = fmax(most, waits + at.accel * at.accel / (2 * jerk));
        if (jerk > 0 && n >= FOUND_TICKS)
            return most;
        rise_tick(bench, &at, jerk > 0 ? 0 : forced(bench, kind, &at));
        if (jerk <= 0)
            waits += at.r - before;
    }
    return fmax(most, waits);
}

static double rate_allowance(const struct stateful *bench,
                             enum stateful_stop_kind kind,
                             const struct motion_clock_rate *from)
{
    const double accel = fmax(0, (double)from->accel_q30 * 0x1p-30);
    return accel * TICKS * (double)bench->period_ns / 1e9 +
           unavoidable(bench, kind, from);
}

/* Leave out, in the first tick of a motion from rest, what the set points did before. */
static double mean_acc(const struct stateful *bench, unsigned i)
{
    const bool is_first =
        bench->clock_ns == bench->judge.began_ns + bench->period_ns;
    return is_first
               ? fabs(stateful_vel(bench, i)) * 1e9 / (double)bench->period_ns
               : fabs(stateful_acc(bench, i));
}

static double vel_allowance(const struct stateful *bench, unsigned i)
{
    const struct motion_clock_limit limit =
        shared_limit(bench, i, STATEFUL_STOP);
    const double t = (double)bench->period_ns / 1e9;
    const double rounding = 4 * stateful_rounding(bench, i) / t;
    const double acc = mean_acc(bench, i) + rounding / t;
    if (bench->axis_config[i].by_goals)
        return stateful_goal_rise(bench, i);
    double rise = acc * TICKS * t + 2 * limit_q32(limit.acc_q32) * t + rounding;
    if (limit.jerk_q32 > 0)
        rise += acc * acc / (2 * limit_q32(limit.jerk_q32));
    return rise;
}

static unsigned moving_axis(const struct stateful *bench)
{
    return homing_is_running(&bench->homing) ? bench->homing.axis
                                             : bench->judge.jog_axis;
}

/* Commands take effect at the next tick: until then the clock goes on as it
 * does.  A motion that began since the last one is read at its full rate. */
static struct motion_clock_rate rate_before(const struct stateful *bench)
{
    struct motion_clock_rate now = bench->controller.rate, then;
    controller_ahead(&bench->controller, bench->period_ns, &then);
    if (bench->controller.is_reversed) {
        now.rate_q30 = -now.rate_q30;
        now.accel_q30 = -now.accel_q30;
        then.rate_q30 = -then.rate_q30;
        then.accel_q30 = -then.accel_q30;
    }
    if (now.rate_q30 == 0 && now.s_ns_q12 == 0)
        now.rate_q30 = (int64_t)(stop_rate(bench) * 0x1p30);
    if (then.rate_q30 > now.rate_q30)
        now.rate_q30 = then.rate_q30;
    if (then.accel_q30 > now.accel_q30)
        now.accel_q30 = then.accel_q30;
    return now;
}

/* A jog, and a leg of homing, is braked by a motion of its own, whose clock
 * runs at full rate: then the speed counts. */
static bool is_by_clock(const struct stateful *bench,
                        enum stateful_stop_kind kind)
{
    return bench->judge.motion == STATEFUL_MOVE || kind == STATEFUL_HOLD ||
           kind == STATEFUL_FAULT_STOP;
}

/* So does what a fault has stopped already, whatever is stopped then. */
static bool stops_by_clock(const struct stateful *bench,
                           enum stateful_stop_kind kind)
{
    return is_by_clock(bench, kind) ||
           (bench->controller.reaction != CONTROLLER_REACT_NONE &&
            bench->judge.stop.by_rate);
}

/* What an earlier stop has to keep is not forgotten for a later one; but a
 * fault may begin another ramp.  Where no ramp fits its limits the one that is
 * under way stays, and what that one has to keep. */
static void keep_stricter(struct stateful_stop *stop,
                          const struct stateful_stop *before)
{
    if (before->by_ns < stop->by_ns && stop->kind != STATEFUL_FAULT_STOP)
        stop->by_ns = before->by_ns;
    if (before->by_rate && stop->by_rate) {
        stop->rate_kept = fmax(before->rate, before->rate_kept);
        stop->rate = fmin(stop->rate, before->rate);
    }
}

/* From full speed of the slowest axis to brake. */
static double full_yardstick(const struct stateful *bench)
{
    double longest = 0;
    for (unsigned i = 0; i < bench->axes; i++) {
        const struct motion_clock_limit *limit = &bench->axis_config[i].limit;
        const double vel = stateful_unit(limit->vel_q32);
        longest = fmax(longest, 1.5 * vel / limit_q32(limit->acc_q32));
        if (limit->jerk_q32 > 0)
            longest = fmax(longest, sqrt(6 * vel / limit_q32(limit->jerk_q32)));
    }
    return longest;
}

/* Along a path what the controller states, which is to be of use.  A jog is
 * braked by a motion of its own, which takes a few yardsticks at most. */
static int64_t stop_by_ns(struct stateful *bench, enum stateful_stop_kind kind)
{
    const struct controller *controller = &bench->controller;
    const int64_t stated_ns = controller->rest_by_ns - controller->clock_ns;
    const double most = SPARE_S + YARDSTICKS * stop_yardstick(bench, kind);
    if (controller->rest_by_ns == 0 || !stops_by_clock(bench, kind))
        return bench->clock_ns + (int64_t)(most * 1e9);
    if ((double)stated_ns / 1e9 >
        SPARE_S + YARDSTICKS_STATED * full_yardstick(bench))
        stateful_violate(bench, STATEFUL_LATE, -1, "states %.3f s",
                         (double)stated_ns / 1e9);
    return bench->clock_ns + stated_ns;
}

static int64_t later_ns(int64_t a_ns, int64_t b_ns)
{
    return a_ns > b_ns ? a_ns : b_ns;
}

void stateful_stop_requested(struct stateful *bench,
                             enum stateful_stop_kind kind)
{
    struct stateful_stop *stop = &bench->judge.stop;
    const struct stateful_stop before = *stop;
    const unsigned axis = moving_axis(bench);
    const struct motion_clock_rate from = rate_before(bench);
    *stop = (struct stateful_stop){
        .kind = kind,
        .requested_ns = bench->clock_ns,
        .by_ns = stop_by_ns(bench, kind),
        .by_rate = stops_by_clock(bench, kind),
        .from = from,
        .rate = (double)from.rate_q30 * 0x1p-30 +
                rate_allowance(bench, kind, &from),
        .vel = fabs(stateful_vel(bench, axis)) + vel_allowance(bench, axis),
    };
    for (unsigned i = 0; i < bench->axes; i++)
        stop->by_ns = later_ns(
            stop->by_ns,
            bench->clock_ns + (int64_t)(stateful_goal_rest_s(bench, i) * 1e9));
    bench->tally.stop[kind]++;
    if (before.kind != STATEFUL_GOES)
        keep_stricter(stop, &before);
    if (kind != STATEFUL_HOLD)
        stop->by_ns = later_ns(
            stop->by_ns,
            bench->clock_ns + (int64_t)(stateful_board_rest_s(bench) * 1e9));
    /* also from rest READY takes a tick */
    if (stop->by_ns < bench->clock_ns + 2 * bench->period_ns)
        stop->by_ns = bench->clock_ns + 2 * bench->period_ns;
    if (kind == STATEFUL_HOLD && before.kind == STATEFUL_DEAD)
        stop->kind = STATEFUL_DEAD;
    bench->judge.dead_ns = kind == STATEFUL_HOLD ? bench->judge.dead_ns : 0;
}

void stateful_motion_begins(struct stateful *bench, enum stateful_motion motion,
                            enum controller_state was)
{
    struct stateful_judge *judge = &bench->judge;
    const enum stateful_stop_kind kind = judge->stop.kind;
    const bool soft = kind == STATEFUL_GOES || kind == STATEFUL_HOLD ||
                      kind == STATEFUL_DEAD || kind == STATEFUL_JOG_STOP;
    if (was != CONTROLLER_READY && !soft)
        stateful_violate(bench, STATEFUL_ACCEPTED, -1, "in %s",
                         controller_state_text(was));
    if (motion != STATEFUL_REST || kind == STATEFUL_HOLD)
        judge->stop = (struct stateful_stop){ .kind = STATEFUL_GOES };
    if (motion == STATEFUL_REST)
        return;
    judge->motion = motion;
    if (was == CONTROLLER_READY)
        judge->began_ns = bench->clock_ns;
    for (unsigned i = 0; i < bench->axes && motion == STATEFUL_MOVE; i++) {
        const struct stateful_coupling *own = &bench->coupling[i];
        const bool leads =
            own->is_on && bench->controller.axis[own->cam.master].track != NULL;
        bench->tally.led += leads && bench->controller.axis[i].track != NULL;
        bench->tally.along += leads && bench->controller.axis[i].track == NULL;
    }
    judge->is_reversed = false;
    judge->dead_ns = 0;
    judge->is_fresh = true;
}

/* --- every tick ---------------------------------------------------------- */

/* A brake of its own takes the place of the path that was slowing down: its
 * clock runs at full rate from the first tick, so from there the speed
 * counts. */
static void judge_brake_takes_over(struct stateful *bench, unsigned axis)
{
    struct stateful_stop *stop = &bench->judge.stop;
    if (!stop->by_rate || !bench->controller.is_brake)
        return;
    stop->by_rate = false;
    stop->vel = fabs(stateful_vel(bench, axis)) + vel_allowance(bench, axis);
}

/* Of the path; more where the ramp in force is older than the request. */
static double rate_most(const struct stateful *bench)
{
    const struct stateful_stop *stop = &bench->judge.stop;
    const struct motion_clock_warp *warp = &bench->controller.warp;
    const bool is_kept =
        warp->rate1_q30 == 0 && warp->t0_ns < stop->requested_ns;
    return is_kept ? fmax(stop->rate, stop->rate_kept) : stop->rate;
}

static void judge_faster(struct stateful *bench)
{
    struct stateful_stop *stop = &bench->judge.stop;
    const double rate = fabs((double)bench->controller.rate.rate_q30 * 0x1p-30);
    const unsigned axis = moving_axis(bench);
    if (bench->axis[axis].state != HAL_DRIVE_ENABLED ||
        !stateful_in_motion(bench->judge.before))
        return;
    judge_brake_takes_over(bench, axis);
    if (bench->axis_config[axis].by_goals && bench->skipped > 0)
        stop->vel =
            fabs(stateful_vel(bench, axis)) + stateful_goal_rise(bench, axis);
    if (stop->by_rate && bench->axis_config[axis].by_goals &&
        bench->judge.motion == STATEFUL_JOG)
        return; /* the clock is that of a prediction; see stateful_goal.c */
    if (stop->by_rate && rate > rate_most(bench) + 0x1p-20)
        stateful_violate(bench, STATEFUL_FASTER, -1, "rate %.4f over %.4f",
                         rate, rate_most(bench));
    else if (!stop->by_rate &&
             fabs(stateful_vel(bench, axis)) > stop->vel * (1 + 1e-9))
        stateful_violate(bench, STATEFUL_FASTER, (int)axis,
                         "%.4f over %.4f unit/s", stateful_vel(bench, axis),
                         stop->vel);
}

static void judge_late(struct stateful *bench)
{
    const struct stateful_stop *stop = &bench->judge.stop;
    const enum stateful_violation violation =
        stop->kind == STATEFUL_DEAD ? STATEFUL_DEAD_MAN : STATEFUL_LATE;
    const enum controller_state state = bench->controller.state;
    for (unsigned i = 0; i < bench->axes; i++)
        if (stateful_vel(bench, i) != 0 && !stateful_goal_runs_on(bench, i))
            stateful_violate(bench, violation, (int)i, "%.6f unit/s, %s",
                             stateful_vel(bench, i),
                             controller_state_text(state));
    for (unsigned i = 0; i < bench->axes; i++)
        if (bench->axis[i].home_ticks > 0)
            stateful_violate(bench, violation, (int)i, "its drive homes");
    if (stop->kind != STATEFUL_HOLD && stateful_in_motion(state) &&
        !(stop->kind == STATEFUL_DEAD && state == CONTROLLER_HOLDING))
        stateful_violate(bench, violation, -1, "still %s",
                         controller_state_text(state));
}

/* The drives' own quick stop has a time-out of its own. */
static void judge_by_drives(struct stateful *bench)
{
    struct stateful_stop *stop = &bench->judge.stop;
    if (stop->by_drives || bench->controller.reaction != CONTROLLER_REACT_QUICK)
        return;
    stop->by_drives = true;
    bench->tally.by_drives++;
    stop->by_ns = bench->clock_ns + bench->config.stop_timeout_ns +
                  DRIVE_TICKS * bench->period_ns;
}

static void judge_dead_man(struct stateful *bench)
{
    struct stateful_judge *judge = &bench->judge;
    if (judge->dead_ns == 0 || bench->now_ns < judge->dead_ns)
        return;
    judge->dead_ns = 0;
    stateful_stop_requested(bench, STATEFUL_DEAD);
}

void stateful_judge_stop(struct stateful *bench)
{
    struct stateful_judge *judge = &bench->judge;
    const enum controller_state state = bench->controller.state;
    judge_dead_man(bench);
    if (judge->stop.kind != STATEFUL_GOES) {
        judge_by_drives(bench);
        judge_faster(bench);
        if (bench->clock_ns > judge->stop.by_ns)
            judge_late(bench);
    }
    if (state == CONTROLLER_OFF)
        judge->stop = (struct stateful_stop){ .kind = STATEFUL_GOES };
    if (!stateful_in_motion(state) && !homing_is_running(&bench->homing)) {
        judge->motion = STATEFUL_REST;
        judge->dead_ns = 0;
    }
}
