/* firmware/control/ramp_step.c - see ramp_step.h. */
#include "firmware/control/ramp_step.h"

#include "firmware/control/ramp.h"
#include "firmware/control/ramp_limit.h"

/* Candidates of one begin. */
#define STEP_TRIES 6
/* The lead becomes a tick less where so many were done a tick sooner. */
#define STEP_EARLY 8
/* And where r' leads away from the target, which is urgent. */
#define STEP_LEAD_LEVEL 2
/* Of the largest r'' a rise has a part of 2^5: to come back from it by that takes
 * within two ticks for every 96. */
#define STEP_RISE_BITS 5
/* Instructions of a Cortex-M4, in hundreds. */
#define STEP_EFFORT_MAKE    10
#define STEP_EFFORT_TAKE    12
#define STEP_EFFORT_SPAN    6
#define STEP_EFFORT_AXIS    7
#define STEP_EFFORT_END     3
#define STEP_EFFORT_REQUEST 16
#define STEP_EFFORT_FALL    15
/* More of a rise. */
#define STEP_EFFORT_SPAN_RISE 4
#define STEP_EFFORT_AXIS_RISE 2

/* --- arithmetic of the tick ------------------------------------------------- */

/* a / n, to 31 bits of a, towards 0. */
static int64_t step_div(int64_t a, int32_t n)
{
    const int64_t size = ramp_size(a);
    const int shift = ramp_above(size, 31);
    const int64_t share = (int64_t)((uint32_t)(size >> shift) / (uint32_t)n)
                          << shift;
    return a < 0 ? -share : share;
}

/* a / n, n >= 1, to the last bit; a >= 0. */
static int64_t step_share(int64_t a, int32_t n)
{
    int64_t share = 0;
    while (a >= n) { /* ten bits of it a time, or all that is left */
        const int shift = ramp_above(a, 31);
        const int64_t part = (int64_t)((uint32_t)(a >> shift) / (uint32_t)n)
                             << shift;
        share += part;
        a -= part * n;
    }
    return share;
}

/* 15/16 of it by a factor of at least 1/16: of what would just fit, as the place that
 * comes next mostly leaves less, and to judge anew takes a tick. */
static inline int64_t step_fit(int64_t value, int32_t factor_q10)
{
    const int64_t factor = factor_q10 < 64 ? 64 : factor_q10;
    return (value >> 16) * (factor * 60);
}

/* The same; a factor that is as large as there may be says that more would fit, so what
 * was known before does not become less by it. */
static inline int64_t step_known(int64_t known, int64_t value,
                                 int32_t factor_q10)
{
    const int64_t fit = step_fit(value, factor_q10);
    return factor_q10 < CONTROLLER_FACTOR_MOST ? fit
                                               : motion_fixed_most(known, fit);
}

static inline int64_t step_clip(const struct controller_step *step,
                                int64_t value)
{
    return motion_fixed_most(step->least_q56,
                             motion_fixed_least(value, step->most_q56));
}

/* --- candidates ------------------------------------------------------------ */

static inline int64_t step_distance(const struct controller_step *step)
{
    return step->target_q30 * RAMP_Q30_Q56 - step->from.rate_q56;
}

static inline bool step_is_away(const struct controller_step *step)
{
    const int64_t a = step->from.accel_q56;
    return a != 0 && (a < 0) != (step_distance(step) < 0);
}

static inline int32_t step_wait(const struct controller_step *step)
{
    return step->lead > 1 ? step->lead : 1;
}

/* While it rises r' can be brought to 0 at any tick, by an r'' of which this is
 * judged along with it: at least what brings it back itself. */
static void step_may_fall(struct controller_step *step, int64_t a, int64_t peak,
                          bool is_down)
{
    const int64_t least = ramp_size(step->slope_q56[1]);
    const int64_t most = motion_fixed_most(a, peak);
    step->rise_accel_q56 = most;
    step->is_rise = !is_down && step->n[0] > 0;
    if (!step->is_rise)
        return;
    step->fall_q56[0] = motion_fixed_most(step->level_q56[0], least);
    step->fall_q56[1] = motion_fixed_least(
        motion_fixed_most(step->level_q56[1], step->fall_q56[0]),
        16 * step->fall_q56[0]);
    step->fall_ticks[0] = ramp_ratio(most, step->fall_q56[0]);
    step->fall_ticks[1] = ramp_ratio(most, step->fall_q56[1]);
    step->verdict.fall_q10[0] = CONTROLLER_FACTOR_MOST;
    step->verdict.fall_q10[1] = CONTROLLER_FACTOR_MOST;
}

/* From r' = a (towards the target where positive) to a peak in `wait` ticks, and to
 * 0 in n. */
static void step_lay(struct controller_step *step, int64_t a, int32_t wait,
                     int64_t peak, int32_t n)
{
    const bool is_down = step_distance(step) < 0;
    const int64_t first = wait > 0 ? peak - a : 0;
    const int64_t away = wait > 1 ? step_div(first, wait) : first;
    const int64_t back = step_div(peak, n);
    step->is_fall = false;
    step->n[0] = wait;
    step->n[1] = n;
    step->peak_q56 = is_down ? -peak : peak;
    step->slope_q56[0] = is_down ? -away : away;
    step->slope_q56[1] = is_down ? back : -back;
    step->at = step->from;
    step_may_fall(step, a, peak, is_down);
    step->piece = wait > 0 ? 0 : 1;
    step->tick = step->cut = 0;
    step->back_q10 = CONTROLLER_FACTOR_MOST;
    step->is_new = true;
    step->stage = STEP_SPAN;
}

/* Ends in the target: w ticks to a peak p, and n back, p (w + n) = 2 D - a0 w.  To the
 * last bit: what p lacks would be a step of the rate at its end, times (w + n) / 2. */
static void step_finish(struct controller_step *step, int64_t a, int32_t wait)
{
    int64_t area = 2 * ramp_size(step_distance(step)) - a * wait;
    if (area <= 0) { /* past it: no longer than on the half of the way */
        wait = ramp_ratio(ramp_size(step_distance(step)), a) - 1;
        area = 2 * ramp_size(step_distance(step)) - a * wait;
        if (wait == 0)
            return;
    }
    /* beyond 2^20 the wait does not show */
    const int32_t square = ramp_ratio(area, step->back_q56);
    const int32_t root =
        square < RAMP_TICKS_MAX
            ? (int32_t)ramp_root((uint32_t)(wait * wait + 4 * square))
            : 32 * (int32_t)ramp_root(
                       (uint32_t)ramp_ratio(area >> 8, step->back_q56));
    const int32_t n = (root - wait) / 2 + 1;
    step->is_finish = true;
    step_lay(step, a, wait, step_share(area, wait + n), n);
}

/* r'' to the target for some ticks, and back. */
static void step_further(struct controller_step *step)
{
    const int32_t wait = step_wait(step);
    const int64_t a = ramp_size(step->from.accel_q56);
    const int64_t room = step->room_q56 - a;
    /* a rise may have to be brought back by what spans hold */
    const int64_t reach_q56 =
        step_distance(step) < 0
            ? step->reach_q56
            : motion_fixed_least(step->reach_q56,
                                 step->most_q56 >> STEP_RISE_BITS);
    const int64_t away = motion_fixed_least(reach_q56, step_div(room, wait));
    const int64_t peak = motion_fixed_most(
        a + motion_fixed_most(away, -step->back_q56) * wait, 0);
    const int32_t n = ramp_ratio(peak, step->back_q56);
    /* >> 24: below 2^63 */
    if (((peak >> 24) + 1) * (wait + n) + ((a * wait) >> 24) >
        ramp_size(step_distance(step)) >> 23) {
        step_finish(step, a, wait);
        return;
    }
    step->is_finish = false;
    if (peak > 0 || a > 0)
        step_lay(step, a, wait, peak, n);
}

/* Ticks until the level under way, if there is one, has brought r' to 0. */
static int32_t step_left(const struct controller *controller,
                         const struct motion_clock_rate *at)
{
    const struct motion_clock_warp *warp = &controller->warp;
    const int64_t left_ns = ramp_end_ns(controller) - controller->step.begin_ns;
    if (at->jerk_q30 == 0 || (at->jerk_q30 < 0) == (at->accel_q30 < 0) ||
        warp->count == 0 || left_ns <= 0 ||
        left_ns > RAMP_TICKS_MAX * controller->config.period_ns)
        return RAMP_TICKS_MAX;
    return ramp_ratio(left_ns, controller->config.period_ns) - 1;
}

/* r' points away from the target: back to 0, sooner than it will be anyway. */
static void step_level(struct controller_step *step, bool again)
{
    const int64_t a = ramp_size(step->from.accel_q56);
    int32_t n = ramp_ratio(a, step->reach_q56);
    if (n >= step->left && !again)
        n = step->left - step->left / 4 - 1;
    step->is_finish = false;
    /* the rate changes by a n / 2 */
    if (n > 0 && n < step->left && (a >> 20) * n < RAMP_ONE_Q56 >> 18)
        step_lay(step, -a, 0, -a, n);
    else if (n >= RAMP_TICKS_MAX)
        step->reach_q56 = step->most_q56;
}

/* A request has part of the tick that follows: one tick more where it takes any. */
static int32_t step_from_request(const struct controller_step *step,
                                 int32_t ticks)
{
    return step->is_asked && ticks > 0 ? ticks + 1 : ticks;
}

/* Of a span of one segment of every track. */
static int32_t step_span_effort(const struct controller *controller)
{
    return (int32_t)controller->config.axis_count * STEP_EFFORT_AXIS +
           STEP_EFFORT_SPAN + STEP_EFFORT_END;
}

/* Ticks until so many spans have been judged from now on, LEVEL at the most. */
static int32_t step_span_ticks(const struct controller *controller, int spans)
{
    const int effort = controller->config.effort;
    const int left = effort - controller->step.spent -
                     spans * step_span_effort(controller) - STEP_EFFORT_TAKE;
    const int32_t ticks = left >= 0                           ? 0
                          : left + effort >= STEP_EFFORT_AXIS ? 1
                                                              : STEP_LEAD_LEVEL;
    return step_from_request(&controller->step, ticks);
}

/* The least r'' that is steeper than what has been judged along with the rise. */
static int64_t step_steeper_least(const struct controller_step *step)
{
    const int64_t back_q56 = step->rise_q56[step->stop ? 1 : 0];
    return back_q56 + back_q56 / 64;
}

/* r' > 0 is brought to 0 as has been judged along with the rise: a few ticks of that
 * are steeper, by what the path leaves just there.  All that follows stays below what
 * has been judged. */
static void step_steeper(struct controller_step *step, int32_t wait)
{
    const int64_t a = step->from.accel_q56;
    const int64_t back_q56 = step->rise_q56[step->stop ? 1 : 0];
    const int64_t least = step_steeper_least(step);
    const int64_t slope =
        step_clip(step, motion_fixed_most(step->reach_q56, least));
    if (a <= least)
        return;
    step->wait = wait;
    if (wait == 0 || ramp_ratio(a, slope) <= wait)
        wait = 1;
    const int64_t peak = motion_fixed_most(a - slope * wait, 0);
    step_lay(step, -a, wait, -peak, ramp_ratio(peak, back_q56));
    step->is_finish = false;
    step->is_fall = true;
}

/* Does what is in force go where it would have to come back from? */
static bool step_leads_away(const struct controller *controller)
{
    const int64_t end_q30 = controller->warp.rate1_q30;
    const int64_t now_q30 = ramp_rate_q30(controller);
    const int64_t target_q30 = controller->step.target_q30;
    return end_q30 > now_q30 ? target_q30 < end_q30
                             : end_q30 < now_q30 && target_q30 > end_q30;
}

static void step_make(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    struct motion_clock_rate at;
    const bool leads_away = step_leads_away(controller);
    const bool falls = leads_away && step->rise_q56[0] > 0;
    const int32_t lead =
        falls
            ? step_span_ticks(controller, 2)
            : step_from_request(step, leads_away && step->lead > STEP_LEAD_LEVEL
                                          ? STEP_LEAD_LEVEL
                                          : step->lead);
    step->begin_ns = controller->clock_ns + lead * controller->config.period_ns;
    motion_clock_warp_at(&controller->warp, step->begin_ns, &at);
    step->s_ns_q12 = at.s_ns_q12;
    step->from.rate_q56 = at.rate_q30 * RAMP_Q30_Q56;
    (void)motion_fixed_mulshift(at.accel_q30, step->tick_q56, 30,
                                &step->from.accel_q56);
    step->from.path_ns_q12 =
        motion_fixed_least(at.s_ns_q12, controller->move_end_ns_q12);
    step->stage = STEP_NONE;
    if (step_distance(step) == 0 && step->from.accel_q56 == 0)
        return;
    /* what has failed just now would fail again */
    if (step->from.accel_q56 == 0 && step->tries == 0) {
        step->room_q56 = step->cap_q56 = RAMP_ONE_Q56;
        step->back_q56 = motion_fixed_most(
            step->back_q56, step->rest[step->stop ? 1 : 0].jerk_q56);
    }
    step->tries = 0;
    step->is_early = false;
    if (step_is_away(step)) {
        if (step->from.accel_q56 > 0 && falls) {
            step_steeper(step, lead);
            return;
        }
        step->left = step_left(controller, &at);
        step_level(step, false);
        return;
    }
    step_further(step);
}

/* --- what a verdict says ---------------------------------------------------- */

/* The first piece: of the r'' and r' that may be next. */
static void step_learn(struct controller_step *step,
                       const struct controller_verdict *verdict)
{
    const int64_t slope = step->slope_q56[0];
    const int64_t accel = ramp_size(step->at.accel_q56);
    if (slope != 0 && (slope < 0) == (step_distance(step) < 0))
        step->reach_q56 =
            step_clip(step, ramp_size(slope) >> 16 == 0
                                ? step->most_q56
                                : step_known(step->reach_q56, ramp_size(slope),
                                             verdict->jerk_q10));
    if (!step->is_fall)
        step->room_q56 = accel >> 16 == 0 ? RAMP_ONE_Q56
                                          : step_known(step->room_q56, accel,
                                                       verdict->acc_q10);
}

/* Another r'' back to 0, where this one fails: a larger one where that would help;
 * a level is found from the steepest on, by halves. */
static int64_t step_other(const struct controller_step *step,
                          const struct controller_verdict *verdict,
                          bool is_away)
{
    const int64_t slope = ramp_size(step->slope_q56[1]);
    const int32_t least = is_away ? 520 : 64;
    const int32_t factor = verdict->jerk_q10 > 1022    ? 1022
                           : verdict->jerk_q10 < least ? least
                                                       : verdict->jerk_q10;
    return verdict->more && step->n[1] > 1 && step->tries < STEP_TRIES / 2
               ? 2 * slope
               : step_fit(slope, factor);
}

/* The same with as much as just fits. */
static void step_again(struct controller_step *step,
                       const struct controller_verdict *verdict)
{
    step_learn(step, verdict);
    if (step->reach_q56 > step_steeper_least(step))
        step_steeper(step, step->wait);
}

/* One that fails is made anew. */
static void step_mend(struct controller_step *step,
                      const struct controller_verdict *verdict)
{
    step->stage = STEP_NONE;
    if (++step->tries >= STEP_TRIES)
        return;
    if (step->is_fall) {
        step_again(step, verdict);
        return;
    }
    const bool is_away = step_is_away(step);
    int64_t *back = is_away ? &step->reach_q56 : &step->back_q56;
    if (step->piece == 1 && !verdict->jerk)
        *back = step_clip(step, step_other(step, verdict, is_away));
    if (is_away) {
        if (!verdict->jerk && step->reach_q56 > step->least_q56)
            step_level(step, true);
        return;
    }
    if (!verdict->fall) {
        for (unsigned i = 0; i < 2; i++)
            if (verdict->fall_q10[i] < 1040)
                step->level_q56[i] = step_clip(
                    step, step_fit(step->fall_q56[i], verdict->fall_q10[i]));
        step->back_q56 = motion_fixed_least(step->back_q56, step->level_q56[0]);
    }
    if (step->piece == 0) {
        step_learn(step, verdict);
    } else if (!verdict->acc) {
        step->room_q56 =
            step_fit(ramp_size(step->peak_q56),
                     verdict->acc_q10 < 1022 ? verdict->acc_q10 : 1022);
        step->cap_q56 = step->room_q56;
    }
    step_further(step);
}

/* Where r' leads away, and could be brought back much sooner by the first span of
 * that, by another r'' than is tried already: 0, or that.  What comes later need not
 * count then. */
static int64_t step_sooner(const struct controller_step *step,
                           const struct controller_verdict *verdict)
{
    const bool is_level = step->n[0] == 0;
    const int64_t back_q56 = is_level ? step->reach_q56 : step->back_q56;
    const int32_t tries = (int32_t)step->tries + (is_level ? 0 : step->lead);
    if (step->piece != 1 || step->n[1] == 1 || step->tick != step->h ||
        tries >= RAMP_LEAD_MAX)
        return 0;
    const int64_t slope_q56 = step_clip(
        step, step_fit(ramp_size(step->slope_q56[1]), verdict->jerk_q10));
    return slope_q56 >> 1 > back_q56 ? slope_q56 : 0;
}

/* The span has been judged on every axis. */
static void step_judge(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    const struct controller_verdict *verdict = &step->verdict;
    const unsigned piece = step->piece;
    if (!verdict->acc || !verdict->jerk || !verdict->fall) {
        step_mend(step, verdict);
        return;
    }
    if (piece == 0)
        step_learn(step, verdict);
    else if (verdict->jerk_q10 < step->back_q10)
        step->back_q10 = verdict->jerk_q10;
    if (step->is_fall && step->tries == 0 &&
        step->reach_q56 >> 1 > ramp_size(step->slope_q56[0]) &&
        step->begin_ns >=
            controller->clock_ns +
                step_span_ticks(controller, 1) * controller->config.period_ns) {
        step->tries++;
        step_steeper(step, step->wait);
        return;
    }
    const int64_t slope_q56 = step_sooner(step, verdict);
    if (slope_q56 > 0) {
        step->tries++;
        *(step->n[0] == 0 ? &step->reach_q56 : &step->back_q56) = slope_q56;
        if (step->n[0] == 0)
            step_level(step, true);
        else
            step_further(step);
        return;
    }
    if (step->tick < step->n[piece])
        return;
    step->tick = step->cut = 0;
    step->piece++;
    if (step->piece == 2 || step->is_fall)
        step->stage = STEP_READY;
}

/* --- when a move is loaded, or a stop is asked for ----------------------------- */

bool controller_step_fall(const struct controller *controller, bool stop,
                          struct controller_step_fall *fall)
{
    const struct controller_step *step = &controller->step;
    const struct motion_clock_warp *warp = &controller->warp;
    const int64_t fall_q56 = step->rise_q56[stop ? 1 : 0];
    struct motion_clock_rate now;
    int64_t accel_q56;
    if (step->rise_q56[0] == 0 || warp->count != 2 ||
        controller->clock_ns >= ramp_end_ns(controller))
        return false;
    motion_clock_warp_at(warp, controller->clock_ns, &now);
    (void)motion_fixed_mulshift(now.accel_q30, step->tick_q56, 30, &accel_q56);
    fall->begin =
        (struct motion_clock_begin){ controller->clock_ns, now.s_ns_q12,
                                     now.rate_q30 * RAMP_Q30_Q56, accel_q56 };
    fall->ticks = ramp_ratio(accel_q56, fall_q56) - 1;
    fall->left_q56 = accel_q56 - fall->ticks * fall_q56;
    if (fall->left_q56 > fall_q56) {
        fall->left_q56 -= fall_q56;
        fall->ticks++;
    }
    return true;
}

/* To begin with: ticks that it takes to judge a candidate where either of its pieces is
 * one span of one segment of every track; 0: it fits into one. */
static int32_t step_lead(const struct controller *controller)
{
    const int32_t effort = controller->config.effort;
    const int32_t all =
        STEP_EFFORT_MAKE + 2 * step_span_effort(controller) + STEP_EFFORT_TAKE;
    const int32_t lead = all > effort ? (all - 1) / effort + 1 : 0;
    return lead < RAMP_LEAD_MAX ? lead : RAMP_LEAD_MAX;
}

void controller_step_load(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    controller_limit_load(controller);
    step->rest[0] = controller_step_rest(controller, false);
    step->rest[1] = controller_step_rest(controller, true);
    step->most_q56 = RAMP_ONE_Q56 / 4;
    if (step->scales.jerk.m > 0)
        step->most_q56 = motion_fixed_least(
            step->most_q56,
            motion_fixed_muldiv_sat(((int64_t)1 << 41) - (1 << 16),
                                    (int64_t)1 << step->scales.jerk.e,
                                    step->scales.jerk.m));
    step->tick_ns_q12 = controller->config.period_ns * MOTION_FIXED_NS_Q12;
    step->tick_q56 = motion_fixed_muldiv_sat(controller->config.period_ns,
                                             (int64_t)1 << 56, RAMP_SECOND_NS);
    motion_clock_unit_init(&step->unit, controller->config.period_ns);
    step->target_q30 = -1;
    step->stage = STEP_NONE;
    step->lead = step_lead(controller);
}

/* --- on the tick ----------------------------------------------------------- */

/* In good time before rest is due the stop limits count for a hold or stop. */
static bool step_may_stop(const struct controller *controller)
{
    if (controller->reaction != CONTROLLER_REACT_NONE)
        return true;
    if (!controller_slows(controller))
        return false;
    return controller_due_ns(controller) - controller->clock_ns <=
           controller_step_stop_ticks(controller, ramp_rate_q30(controller)) *
               controller->config.period_ns;
}

/* Where the rate rises: no further than it must. */
static void step_fall_back(struct controller *controller, bool stop)
{
    struct controller_step *step = &controller->step;
    struct controller_step_fall fall;
    if (!controller_step_fall(controller, stop, &fall))
        return;
    step->reach_q56 =
        motion_fixed_most(motion_fixed_most(step->reach_q56, step->back_q56),
                          step->rise_q56[stop ? 1 : 0]);
    step->spent += STEP_EFFORT_FALL;
    (void)motion_clock_warp_by(&fall.begin, &step->unit, fall.ticks,
                               fall.left_q56, 1, &controller->warp);
}

/* True: another target, or other limits. */
static bool step_aim(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    const bool stop = step_may_stop(controller);
    const int64_t jerk_q56 = step->rest[stop ? 1 : 0].jerk_q56;
    if (step->target_q30 == controller->wanted_q30 && step->stop == stop)
        return false;
    const int64_t rate_q30 = ramp_rate_q30(controller);
    if (step->target_q30 < 0) {
        step->reach_q56 = step->back_q56 = step->most_q56;
        step->level_q56[0] = step->level_q56[1] = step->most_q56;
    } else if ((step->target_q30 < rate_q30) !=
               (controller->wanted_q30 < rate_q30)) {
        const int64_t reach_q56 = step->reach_q56; /* what led on leads back */
        step->reach_q56 = step->back_q56;
        step->back_q56 = reach_q56;
    }
    if (controller->wanted_q30 < controller->warp.rate1_q30)
        step_fall_back(controller, stop);
    else
        step->level_q56[0] = step->level_q56[1] = step->most_q56;
    step->stop = stop;
    step->target_q30 = controller->wanted_q30;
    /* what was learned by other limits, or elsewhere, may be far less than these leave */
    if (!step_leads_away(controller)) {
        step->reach_q56 = motion_fixed_most(step->reach_q56, jerk_q56);
        step->back_q56 = motion_fixed_most(step->back_q56, jerk_q56);
    }
    step->least_q56 = jerk_q56 / 64 + 1;
    step->room_q56 = step->cap_q56 = RAMP_ONE_Q56;
    step->stage = STEP_NONE;
    return true;
}

/* Than what is in force, which ends in the target? Where the candidate does not end
 * there: is it faster than that is at its begin, on the mean, or, where what is in force
 * is too late, at its peak? */
static bool step_is_sooner(const struct controller *controller)
{
    const struct controller_step *step = &controller->step;
    const int32_t w = step->n[0], n = step->n[1];
    const int64_t a = ramp_size(step->from.accel_q56) >> 24;
    const int64_t peak = ramp_size(step->peak_q56) >> 24;
    if (step->is_finish)
        return step->begin_ns + (w + n) * controller->config.period_ns <
               ramp_end_ns(controller);
    return ramp_end_ns(controller) > controller_due_ns(controller)
               ? peak > a
               : (peak - a) * w + (peak - 2 * a) * n > 0;
}

static void step_later(struct controller_step *step)
{
    if (step->lead < RAMP_LEAD_MAX)
        step->lead++;
    step->early = 0;
}

/* Judged without another try, and what is in force goes back to r' = 0 before it begins
 * all the same. */
static bool step_lags(const struct controller *controller)
{
    const struct controller_step *step = &controller->step;
    const struct motion_clock_warp *warp = &controller->warp;
    const int64_t since_ns = step->begin_ns - warp->t0_ns;
    return step->tries == 0 && !step->is_fall && warp->count == 2 &&
           since_ns > warp->piece[0].dur_ns && since_ns < warp->dur_ns &&
           warp->rate1_q30 != step->target_q30;
}

/* Into force. */
static void step_take(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    const struct motion_clock_begin begin = { step->begin_ns, step->s_ns_q12,
                                              step->from.rate_q56,
                                              step->from.accel_q56 };
    step->stage = STEP_NONE;
    if (controller->warp.rate1_q30 == step->target_q30 &&
        !step_is_sooner(controller))
        return;
    if (step_lags(controller))
        step_later(step);
    if (motion_clock_warp_by(&begin, &step->unit, step->n[0], step->peak_q56,
                             step->n[1], &controller->warp) < 0)
        return;
    if (step->is_finish)
        controller->warp.rate1_q30 = step->target_q30;
    if (!step->is_fall)
        step->rise_q56[0] = 0;
    for (unsigned i = 0; i < 2 && step->is_rise; i++) {
        step->rise_q56[i] = step->fall_q56[i];
        step->level_q56[i] = step_clip(
            step, step_fit(step->fall_q56[i], step->verdict.fall_q10[i]));
    }
    int64_t *back = step->n[0] == 0 ? &step->reach_q56 : &step->back_q56;
    if (!step->is_fall)
        *back = step_clip(step, step_known(*back, ramp_size(step->slope_q56[1]),
                                           step->back_q10));
    /* a sixteenth more per tick */
    step->cap_q56 = motion_fixed_least(
        step->cap_q56 + step->cap_q56 / 16 * step->n[0], RAMP_ONE_Q56);
    step->room_q56 = motion_fixed_least(step->room_q56, step->cap_q56);
    step->early = step->is_early ? step->early + 1 : 0;
    if (step->early >= STEP_EARLY && step->lead > 0) {
        step->lead--;
        step->early = 0;
    }
}

/* What the next piece of the search takes. */
static int step_effort(const struct controller *controller)
{
    const struct controller_step *step = &controller->step;
    const int rise = step->is_rise ? 1 : 0;
    if (step->stage == STEP_AXIS)
        return step->axis < controller->config.axis_count
                   ? STEP_EFFORT_AXIS + rise * STEP_EFFORT_AXIS_RISE
                   : STEP_EFFORT_END;
    return step->stage == STEP_NONE ? STEP_EFFORT_MAKE
           : step->stage == STEP_SPAN
               ? STEP_EFFORT_SPAN + rise * STEP_EFFORT_SPAN_RISE
               : STEP_EFFORT_TAKE;
}

static void step_on(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    if (step->stage == STEP_NONE) {
        step_make(controller);
    } else if (step->stage == STEP_READY) {
        step_take(controller);
    } else if (controller_span_step(controller)) {
        step_judge(controller);
    }
}

/* Would a tick less have done?  The next one is made in the tick in which it is taken. */
static bool step_is_early(const struct controller *controller)
{
    const struct controller_step *step = &controller->step;
    const int32_t ticks = step->lead > 1 ? 2 : 1;
    return step->n[0] > 0 && !step->is_fall &&
           step->begin_ns - controller->clock_ns >=
               ticks * controller->config.period_ns;
}

/* As far as what is left for this tick reaches. */
static void step_search(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    bool is_made = false;
    if (step->scheduled.state != CONTROLLER_SCHEDULED_NONE &&
        controller_scheduled_goes_on(controller)) {
        while (controller->config.effort - step->spent >= STEP_EFFORT_AXIS &&
               controller_scheduled_judge(controller))
            step->spent += STEP_EFFORT_AXIS;
        return;
    }
    if (!step_aim(controller) &&
        controller->warp.rate1_q30 == controller->wanted_q30 &&
        ramp_end_ns(controller) <=
            motion_fixed_least(controller->clock_ns +
                                   (int64_t)2 * RAMP_LEAD_MAX *
                                       controller->config.period_ns,
                               controller_due_ns(controller)))
        return;
    if (step->stage != STEP_NONE && step->begin_ns < controller->clock_ns) {
        step->stage = STEP_NONE;
        if (step->n[0] > 0 && !step->is_fall)
            step_later(step);
    }
    while (controller->config.effort - step->spent >= step_effort(controller)) {
        const enum controller_step_stage stage = step->stage;
        if (stage == STEP_NONE && is_made)
            return;
        if (stage == STEP_READY && step->begin_ns > controller->clock_ns) {
            step->is_early |= step_is_early(controller);
            return;
        }
        step->spent += step_effort(controller);
        step_on(controller);
        if (stage == STEP_READY &&
            (step->lead == 0 || (step->is_fall && is_made) ||
             controller->warp.rate1_q30 == controller->wanted_q30))
            return;
        is_made = stage == STEP_NONE || (is_made && stage != STEP_READY);
    }
}

void controller_step_request(struct controller *controller)
{
    controller->step.spent += STEP_EFFORT_REQUEST;
    controller->step.is_asked = true;
    step_search(controller);
    controller->step.is_asked = false;
}

void controller_step_seek(struct controller *controller)
{
    step_search(controller);
    controller->step.spent = 0;
}
