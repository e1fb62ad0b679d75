/* firmware/control/together.c - see together.h. */
#include "firmware/control/together.h"

#include "firmware/control/ramp.h"
#include "firmware/control/ramp_step.h"

#define TOLD_Q30_Q56 ((int64_t)1 << 26)
/* Ticks of one ramp, in all. */
#define TOLD_TICKS_MAX (1 << 20)
/* Segments of tracks in spans that a call of a search looks at, at the most, and
 * others in a tick, at least. */
#define TOLD_LOOKS      1024
#define TOLD_LOOKS_TICK 4
/* The longest one that it tries. */
#define TOLD_MOST_NS INT64_C(60000000000)

bool controller_is_steady(const struct controller *controller)
{
    const struct motion_clock_warp *warp = &controller->warp;
    return (controller->state == CONTROLLER_MOVING ||
            controller->state == CONTROLLER_HOLDING) &&
           controller->jog == NULL && !controller->is_reversed &&
           controller->step.told.state != CONTROLLER_TOLD_TAKEN &&
           controller->clock_ns >= warp->t0_ns + warp->dur_ns &&
           warp->rate1_q30 == controller->wanted_q30;
}

/* --- judging --------------------------------------------------------------- */

/* As a candidate of the search: to the peak and back, or from the peak on. */
static void told_lay(struct controller_step *step,
                     enum controller_told_state which,
                     const struct controller_step_state *at)
{
    struct controller_told *told = &step->told;
    const bool is_first = which == CONTROLLER_TOLD_FIRST;
    told->state = which;
    step->n[0] = is_first ? told->change : told->flat;
    step->n[1] = told->change;
    step->slope_q56[0] = is_first ? told->slope_q56 : 0;
    step->slope_q56[1] = -told->slope_q56;
    step->from = step->at = *at;
    step->stop = step->is_rise = false;
    step->piece = 0;
    step->tick = step->cut = 0;
    step->is_new = true;
    step->stage = STEP_SPAN;
}

/* A span has been judged on every axis. */
static void told_judge(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    step->stage = STEP_SPAN;
    controller_span_end(controller);
    if (!step->verdict.acc || !step->verdict.jerk) {
        step->told.state = CONTROLLER_TOLD_NONE;
        return;
    }
    if (step->tick < step->n[step->piece])
        return;
    step->tick = step->cut = 0;
    if (step->piece++ == 0) {
        step->told.peak = step->at;
    } else if (step->told.state == CONTROLLER_TOLD_FIRST &&
               step->told.ramp.flat > 0) {
        told_lay(step, CONTROLLER_TOLD_SECOND, &step->told.peak);
    } else {
        step->told.state = CONTROLLER_TOLD_FITS;
    }
}

bool controller_told_judge(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    if (step->told.state != CONTROLLER_TOLD_FIRST &&
        step->told.state != CONTROLLER_TOLD_SECOND)
        return false;
    if (step->stage == STEP_SPAN) {
        step->stage = STEP_AXIS;
        controller_span_begin(controller);
    } else if (step->axis < controller->config.axis_count) {
        controller_span_axis(controller);
    } else {
        told_judge(controller);
    }
    return true;
}

/* In ticks of the controller; false: its numbers are out of range. */
static bool told_measure(struct controller *controller,
                         const struct controller_ramp *ramp)
{
    struct controller_told *told = &controller->step.told;
    const uint32_t period_ns = (uint32_t)controller->config.period_ns;
    const uint32_t tick_ns = (uint32_t)ramp->tick_ns;
    const uint32_t per = tick_ns / period_ns;
    const uint32_t change = (uint32_t)ramp->change;
    const uint32_t flat = (uint32_t)ramp->flat;
    if (tick_ns > RAMP_SECOND_NS || per == 0 || tick_ns % period_ns != 0 ||
        change == 0 || change > TOLD_TICKS_MAX || flat > TOLD_TICKS_MAX ||
        2 * change + flat > TOLD_TICKS_MAX / per)
        return false;
    const int64_t by_q30 = ramp->rate_q30 - controller->warp.rate1_q30;
    const uint64_t peak_q56 =
        motion_fixed_abs(by_q30 * TOLD_Q30_Q56) / (change + flat);
    const int64_t slope_q56 =
        (int64_t)(peak_q56 / ((uint64_t)change * per * per));
    told->ramp = *ramp;
    told->change = (int32_t)(change * per);
    told->flat = (int32_t)(flat * per);
    told->peak_q56 = by_q30 < 0 ? -(int64_t)peak_q56 : (int64_t)peak_q56;
    told->slope_q56 = by_q30 < 0 ? -slope_q56 : slope_q56;
    return true;
}

int controller_ramp_expect(struct controller *controller,
                           const struct controller_ramp *ramp, int64_t begin_ns)
{
    struct controller_told *told = &controller->step.told;
    struct motion_clock_rate then;
    if (!controller_is_steady(controller))
        return MOTION_E_STATE;
    if (ramp->rate_q30 < 0 || ramp->rate_q30 > MOTION_CLOCK_WARP_MAX_Q30 ||
        !told_measure(controller, ramp))
        return MOTION_E_ARG;
    if (ramp->rate_q30 > controller->override_max_q30)
        return MOTION_E_LIMIT;
    told->begin_ns = begin_ns;
    told->second_ns = begin_ns + told->change * controller->config.period_ns;
    motion_clock_unit_init(&told->unit, ramp->tick_ns);
    motion_clock_warp_at(&controller->warp, begin_ns, &then);
    const struct controller_step_state at = {
        then.rate_q30 * TOLD_Q30_Q56, 0,
        ramp_least(then.s_ns_q12, controller->move_end_ns_q12)
    };
    told_lay(&controller->step, CONTROLLER_TOLD_FIRST, &at);
    return MOTION_OK;
}

/* Looks at it; 0: it does not fit, or what is left of them was too little. */
static int32_t told_try(struct controller *controller,
                        const struct controller_ramp *ramp, int64_t begin_ns,
                        int32_t *left)
{
    const int32_t before = *left;
    if (controller_ramp_expect(controller, ramp, begin_ns) < 0)
        return 0;
    while (*left > 0 && controller_told_judge(controller))
        --*left;
    return controller->step.told.state == CONTROLLER_TOLD_FITS ? before - *left
                                                               : 0;
}

int32_t controller_ramp_find(struct controller *controller, int64_t begin_ns,
                             struct controller_ramp *ramp, int32_t *tried)
{
    const int32_t period_ns = (int32_t)controller->config.period_ns;
    const int64_t most = ramp_least(TOLD_MOST_NS / period_ns, TOLD_TICKS_MAX);
    int32_t left = TOLD_LOOKS, n = 0, looks = 0;
    ramp->tick_ns = period_ns;
    for (int32_t ticks = 2; ticks <= most; ticks += ticks / 8 + 1)
        for (int32_t part = 2; part <= 8; part *= 2) {
            /* one that takes more than a call has is too long */
            const bool is_first = left == TOLD_LOOKS;
            if (n++ < *tried)
                continue;
            ramp->change = ticks / part;
            ramp->flat = ticks - 2 * ramp->change;
            looks = told_try(controller, ramp, begin_ns, &left);
            if (looks > 0)
                return looks / TOLD_LOOKS_TICK + 1;
            controller->step.told.state = CONTROLLER_TOLD_NONE;
            *tried = left > 0 || is_first ? n : n - 1;
            if (left == 0)
                return 0;
        }
    *tried = 0;
    return 0;
}

/* --- in force --------------------------------------------------------------- */

/* The first of its ramps, or the second, from now on. */
static int told_begin(struct controller *controller, bool is_first)
{
    const struct controller_told *told = &controller->step.told;
    struct motion_clock_rate now;
    motion_clock_warp_at(&controller->warp, controller->clock_ns, &now);
    const struct motion_clock_begin begin = { controller->clock_ns,
                                              now.s_ns_q12,
                                              now.rate_q30 * TOLD_Q30_Q56,
                                              is_first ? 0 : told->peak_q56 };
    const int err = motion_clock_warp_by(
        &begin, &told->unit, is_first ? told->ramp.change : told->ramp.flat,
        told->peak_q56, told->ramp.change, &controller->warp);
    if (err == MOTION_OK && (!is_first || told->ramp.flat == 0))
        controller->warp.rate1_q30 = told->ramp.rate_q30;
    return err;
}

static void told_enter(struct controller *controller)
{
    const struct controller_told *told = &controller->step.told;
    const int64_t period_ns = controller->config.period_ns;
    const int64_t dur_ns = (2 * told->change + told->flat) * period_ns;
    controller->wanted_q30 = told->ramp.rate_q30;
    controller->is_held = controller->wanted_q30 == 0;
    controller_enter(controller, controller->is_held ? CONTROLLER_HOLDING
                                                     : CONTROLLER_MOVING);
    if (controller->is_held) {
        /* also of a stop that comes before the second ramp */
        controller->rest_by_ns =
            controller->clock_ns + period_ns +
            ramp_most(dur_ns, controller_step_bound_ns(controller, false));
    } else {
        controller->override_q30 = controller->wanted_q30;
        controller->rest_by_ns = 0;
        controller_set_reserve(controller);
    }
}

int controller_ramp_take(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    const bool fits = step->told.state == CONTROLLER_TOLD_FITS;
    if (!controller_is_steady(controller))
        return MOTION_E_STATE;
    step->told.state = CONTROLLER_TOLD_NONE;
    if (controller->clock_ns != step->told.begin_ns)
        return MOTION_E_TIMEOUT;
    if (!fits)
        return MOTION_E_LIMIT;
    const int err = told_begin(controller, true);
    if (err < 0)
        return err;
    step->told.state = CONTROLLER_TOLD_TAKEN;
    step->rise_q56[0] = 0; /* judged along with what was in force before */
    told_enter(controller);
    return MOTION_OK;
}

/* To the end of what is told, unless something else is wanted. */
static bool told_is_in_force(struct controller *controller)
{
    const struct controller_told *told = &controller->step.told;
    const struct motion_clock_warp *warp = &controller->warp;
    if (controller->state == CONTROLLER_STOPPING ||
        controller->wanted_q30 != told->ramp.rate_q30)
        return false;
    if (warp->rate1_q30 == told->ramp.rate_q30)
        return controller->clock_ns < warp->t0_ns + warp->dur_ns;
    return controller->clock_ns < told->second_ns ||
           told_begin(controller, false) == MOTION_OK;
}

bool controller_told_goes_on(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    if (step->told.state == CONTROLLER_TOLD_TAKEN
            ? told_is_in_force(controller)
            : controller_is_steady(controller))
        return true;
    step->told.state = CONTROLLER_TOLD_NONE;
    step->stage = STEP_NONE;
    return false;
}
