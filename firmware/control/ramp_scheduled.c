/* firmware/control/ramp_scheduled.c - see ramp_scheduled.h. */
#include "firmware/control/ramp_scheduled.h"

#include "firmware/control/ramp.h"
#include "firmware/control/ramp_step.h"

/* Ticks of one ramp, in all. */
#define SCHEDULED_TICKS_MAX (1 << 20)
/* Of r' in one of them: what spans hold. */
#define SCHEDULED_PEAK_Q56 ((uint64_t)1 << 55)
/* Segments of tracks in spans that a call of a search looks at, at the most, and
 * others in a tick, at least. */
#define SCHEDULED_LOOKS      1024
#define SCHEDULED_LOOKS_TICK 4
/* The longest one that it tries. */
#define SCHEDULED_MOST_NS INT64_C(60000000000)

bool controller_is_steady(const struct controller *controller)
{
    const struct motion_clock_warp *warp = &controller->warp;
    return (controller->state == CONTROLLER_MOVING ||
            controller->state == CONTROLLER_HOLDING) &&
           controller->jog == NULL && !controller->is_reversed &&
           controller->step.scheduled.state != CONTROLLER_SCHEDULED_BEGUN &&
           controller->clock_ns >= warp->t0_ns + warp->dur_ns &&
           warp->rate1_q30 == controller->wanted_q30;
}

/* --- judging --------------------------------------------------------------- */

/* As a candidate of the search: to the peak and back, or from the peak on. */
static void scheduled_lay(struct controller_step *step,
                          enum controller_scheduled_state which,
                          const struct controller_step_state *at)
{
    struct controller_scheduled *scheduled = &step->scheduled;
    const bool is_first = which == CONTROLLER_SCHEDULED_FIRST;
    scheduled->state = which;
    step->n[0] = is_first ? scheduled->change : scheduled->flat;
    step->n[1] = scheduled->change;
    step->slope_q56[0] = is_first ? scheduled->slope_q56 : 0;
    step->slope_q56[1] = -scheduled->slope_q56;
    step->from = step->at = *at;
    step->stop = step->is_rise = false;
    step->piece = 0;
    step->tick = step->cut = 0;
    step->is_new = true;
    step->stage = STEP_SPAN;
}

/* A span has been judged on every axis. */
static void scheduled_judge(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    if (!step->verdict.acc || !step->verdict.jerk) {
        step->scheduled.state = CONTROLLER_SCHEDULED_NONE;
        return;
    }
    if (step->tick < step->n[step->piece])
        return;
    step->tick = step->cut = 0;
    if (step->piece++ == 0) {
        step->scheduled.peak = step->at;
    } else if (step->scheduled.state == CONTROLLER_SCHEDULED_FIRST &&
               step->scheduled.ramp.flat > 0) {
        scheduled_lay(step, CONTROLLER_SCHEDULED_SECOND, &step->scheduled.peak);
    } else {
        step->scheduled.state = CONTROLLER_SCHEDULED_FITS;
    }
}

bool controller_scheduled_judge(struct controller *controller)
{
    const enum controller_scheduled_state state =
        controller->step.scheduled.state;
    if (state != CONTROLLER_SCHEDULED_FIRST &&
        state != CONTROLLER_SCHEDULED_SECOND)
        return false;
    if (controller_span_step(controller))
        scheduled_judge(controller);
    return true;
}

/* In ticks of the controller; false: its numbers are out of range. */
static bool scheduled_measure(struct controller *controller,
                              const struct controller_ramp *ramp)
{
    struct controller_scheduled *scheduled = &controller->step.scheduled;
    const uint32_t period_ns = (uint32_t)controller->config.period_ns;
    const uint32_t tick_ns = (uint32_t)ramp->tick_ns;
    const uint32_t per = tick_ns / period_ns;
    const uint32_t change = (uint32_t)ramp->change;
    const uint32_t flat = (uint32_t)ramp->flat;
    if (tick_ns > RAMP_SECOND_NS || per == 0 || tick_ns % period_ns != 0 ||
        change == 0 || change > SCHEDULED_TICKS_MAX ||
        flat > SCHEDULED_TICKS_MAX ||
        2 * change + flat > SCHEDULED_TICKS_MAX / per)
        return false;
    const int64_t by_q30 = ramp->rate_q30 - controller->warp.rate1_q30;
    const uint64_t peak_q56 =
        motion_fixed_abs(by_q30 * RAMP_Q30_Q56) / (change + flat);
    const int64_t slope_q56 =
        (int64_t)(peak_q56 / ((uint64_t)change * per * per));
    scheduled->ramp = *ramp;
    scheduled->change = (int32_t)(change * per);
    scheduled->flat = (int32_t)(flat * per);
    scheduled->peak_q56 = by_q30 < 0 ? -(int64_t)peak_q56 : (int64_t)peak_q56;
    scheduled->slope_q56 = by_q30 < 0 ? -slope_q56 : slope_q56;
    return true;
}

int controller_ramp_schedule(struct controller *controller,
                             const struct controller_ramp *ramp,
                             int64_t begin_ns)
{
    struct controller_scheduled *scheduled = &controller->step.scheduled;
    struct motion_clock_rate then;
    if (!controller_is_steady(controller))
        return MOTION_E_STATE;
    if (ramp->rate_q30 < 0 || ramp->rate_q30 > MOTION_CLOCK_WARP_MAX_Q30 ||
        !scheduled_measure(controller, ramp))
        return MOTION_E_ARG;
    if (ramp->rate_q30 > controller->override_max_q30 ||
        motion_fixed_abs(scheduled->peak_q56) >= SCHEDULED_PEAK_Q56)
        return MOTION_E_LIMIT;
    scheduled->begin_ns = begin_ns;
    scheduled->second_ns =
        begin_ns + scheduled->change * controller->config.period_ns;
    motion_clock_unit_init(&scheduled->unit, ramp->tick_ns);
    motion_clock_warp_at(&controller->warp, begin_ns, &then);
    const struct controller_step_state at = {
        then.rate_q30 * RAMP_Q30_Q56, 0,
        motion_fixed_least(then.s_ns_q12, controller->move_end_ns_q12)
    };
    scheduled_lay(&controller->step, CONTROLLER_SCHEDULED_FIRST, &at);
    return MOTION_OK;
}

/* Looks at it; 0: it does not fit, or what is left of them was too little. */
static int32_t scheduled_try(struct controller *controller,
                             const struct controller_ramp *ramp,
                             int64_t begin_ns, int32_t *left)
{
    const int32_t before = *left;
    if (controller_ramp_schedule(controller, ramp, begin_ns) < 0)
        return 0;
    while (*left > 0 && controller_scheduled_judge(controller))
        --*left;
    return controller->step.scheduled.state == CONTROLLER_SCHEDULED_FITS
               ? before - *left
               : 0;
}

int32_t controller_ramp_find(struct controller *controller, int64_t begin_ns,
                             struct controller_ramp *ramp, int32_t *tried)
{
    const int32_t period_ns = (int32_t)controller->config.period_ns;
    const int64_t most =
        motion_fixed_least(SCHEDULED_MOST_NS / period_ns, SCHEDULED_TICKS_MAX);
    int32_t left = SCHEDULED_LOOKS, n = 0;
    ramp->tick_ns = period_ns;
    for (int32_t ticks = 2; ticks <= most; ticks += ticks / 8 + 1)
        for (int32_t part = 2; part <= 8; part *= 2) {
            /* one that takes more than a call has is too long */
            const bool is_first = left == SCHEDULED_LOOKS;
            if (n++ < *tried)
                continue;
            ramp->change = ticks / part;
            ramp->flat = ticks - 2 * ramp->change;
            const int32_t looks =
                scheduled_try(controller, ramp, begin_ns, &left);
            if (looks > 0)
                return looks / SCHEDULED_LOOKS_TICK + 1;
            controller->step.scheduled.state = CONTROLLER_SCHEDULED_NONE;
            *tried = left > 0 || is_first ? n : n - 1;
            if (left == 0)
                return 0;
        }
    *tried = 0;
    return 0;
}

/* --- in force --------------------------------------------------------------- */

/* The first of its ramps, or the second, from now on. */
static int scheduled_begin(struct controller *controller, bool is_first)
{
    const struct controller_scheduled *scheduled = &controller->step.scheduled;
    struct motion_clock_rate now;
    motion_clock_warp_at(&controller->warp, controller->clock_ns, &now);
    const struct motion_clock_begin begin = {
        controller->clock_ns, now.s_ns_q12, now.rate_q30 * RAMP_Q30_Q56,
        is_first ? 0 : scheduled->peak_q56
    };
    const int err = motion_clock_warp_by(
        &begin, &scheduled->unit,
        is_first ? scheduled->ramp.change : scheduled->ramp.flat,
        scheduled->peak_q56, scheduled->ramp.change, &controller->warp);
    if (err == MOTION_OK && (!is_first || scheduled->ramp.flat == 0))
        controller->warp.rate1_q30 = scheduled->ramp.rate_q30;
    return err;
}

static void scheduled_enter(struct controller *controller)
{
    const struct controller_scheduled *scheduled = &controller->step.scheduled;
    const int64_t period_ns = controller->config.period_ns;
    const int64_t dur_ns =
        (2 * scheduled->change + scheduled->flat) * period_ns;
    controller->wanted_q30 = scheduled->ramp.rate_q30;
    controller->is_held = controller->wanted_q30 == 0;
    controller_enter(controller, controller->is_held ? CONTROLLER_HOLDING
                                                     : CONTROLLER_MOVING);
    if (controller->is_held) {
        /* also of a stop that comes before the second ramp */
        controller->rest_by_ns =
            controller->clock_ns + period_ns +
            motion_fixed_most(dur_ns,
                              controller_step_bound_ns(controller, false));
    } else {
        controller->override_q30 = controller->wanted_q30;
        controller->rest_by_ns = 0;
        controller_set_reserve(controller);
    }
}

int controller_ramp_begin(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    const bool fits = step->scheduled.state == CONTROLLER_SCHEDULED_FITS;
    if (!controller_is_steady(controller))
        return MOTION_E_STATE;
    step->scheduled.state = CONTROLLER_SCHEDULED_NONE;
    if (controller->clock_ns != step->scheduled.begin_ns)
        return MOTION_E_TIMEOUT;
    if (!fits)
        return MOTION_E_LIMIT;
    const int err = scheduled_begin(controller, true);
    if (err < 0)
        return err;
    step->scheduled.state = CONTROLLER_SCHEDULED_BEGUN;
    step->rise_q56[0] = 0; /* judged along with what was in force before */
    scheduled_enter(controller);
    return MOTION_OK;
}

/* To the end of what was scheduled, unless something else is wanted. */
static bool scheduled_is_in_force(struct controller *controller)
{
    const struct controller_scheduled *scheduled = &controller->step.scheduled;
    const struct motion_clock_warp *warp = &controller->warp;
    if (controller->state == CONTROLLER_STOPPING ||
        controller->wanted_q30 != scheduled->ramp.rate_q30)
        return false;
    if (warp->rate1_q30 == scheduled->ramp.rate_q30)
        return controller->clock_ns < warp->t0_ns + warp->dur_ns;
    return controller->clock_ns < scheduled->second_ns ||
           scheduled_begin(controller, false) == MOTION_OK;
}

bool controller_scheduled_goes_on(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    if (step->scheduled.state == CONTROLLER_SCHEDULED_BEGUN
            ? scheduled_is_in_force(controller)
            : controller_is_steady(controller))
        return true;
    step->scheduled.state = CONTROLLER_SCHEDULED_NONE;
    step->stage = STEP_NONE;
    return false;
}
