/* tests/firmware/control/stateful_shot.c - pulses on an output at times of the path of
 * what is played, some nearer to each other than the line can go.
 *
 * Each comes once, in its order, whatever hold, override, reverse and lost ticks do to
 * the path's time: not before the path may have come there, as fast as it may go in the
 * time that the line is set ahead; and where the line has rested, none is left that is
 * due.  After the move there is none. */
#include "hal/support/container_of.h"
#include "tests/firmware/control/stateful.h"

#define MS INT64_C(1000000)
/* As fast as a clock goes, and its first tick. */
#define AHEAD(lead_ns, tick_ns) (2 * ((lead_ns) + (tick_ns)))

static struct stateful_shots *shots_of(struct hal_gpio *line)
{
    return CONTAINER_OF(line, struct stateful_shots, line);
}

static int shot_set(struct hal_gpio *line, bool active)
{
    shots_of(line)->is_active = active;
    return MOTION_OK;
}

static const struct hal_gpio_ops shot_ops = { .set = shot_set };

void stateful_shots_begin(struct stateful *bench)
{
    struct stateful_shots *shots = &bench->shots;
    *shots = (struct stateful_shots){ .line.ops = &shot_ops };
    if (!bench->kind.has_shots)
        return;
    shots->lead_ns =
        stateful_one_in(bench, 2) ? 0 : stateful_in(bench, 1, 20) * MS;
    assert_int_equal(
        trigger_init(&shots->trigger, &shots->line,
                     &(struct trigger_config){
                         .width_ns = stateful_in(bench, 0, 20) * MS,
                         .rest_ns = stateful_in(bench, 0, 20) * MS }),
        MOTION_OK);
}

void stateful_shots_arm(struct stateful *bench)
{
    struct stateful_shots *shots = &bench->shots;
    const int64_t end_ns_q12 = bench->controller.move_end_ns_q12;
    if (!bench->kind.has_shots)
        return;
    shots->count = (uint32_t)stateful_in(bench, 1, STATEFUL_SHOTS);
    shots->seen = 0;
    shots->is_armed = true;
    int64_t at = 0;
    for (uint32_t k = 0; k < shots->count; k++) {
        at += stateful_one_in(bench, 3)
                  ? stateful_in(bench, 0, 4 * MS) * MOTION_FIXED_NS_Q12
                  : stateful_in(bench, 0, 2 * end_ns_q12 / shots->count);
        if (at > end_ns_q12)
            at = end_ns_q12;
        shots->t_ns_q12[k] = at;
    }
    trigger_arm(&shots->trigger, shots->t_ns_q12, shots->count);
}

/* The line has gone up: for the next of them. */
static void judge_pulse(struct stateful *bench)
{
    struct stateful_shots *shots = &bench->shots;
    const int64_t most_ns_q12 =
        bench->controller.rate.s_ns_q12 +
        AHEAD(shots->lead_ns, bench->period_ns) * MOTION_FIXED_NS_Q12;
    bench->tally.shots++;
    if (!shots->is_armed || shots->seen == shots->count)
        stateful_violate(bench, STATEFUL_SHOT, -1, "one more than %u",
                         (unsigned)shots->count);
    else if (shots->t_ns_q12[shots->seen] > most_ns_q12)
        stateful_violate(bench, STATEFUL_SHOT, -1, "number %u, before its time",
                         (unsigned)shots->seen + 1);
    shots->seen++;
}

/* The line has rested: it is up where one is due.  In reverse the path goes away from
 * them. */
static void judge_due(struct stateful *bench)
{
    const struct stateful_shots *shots = &bench->shots;
    const int64_t rested_ns = bench->now_ns - shots->since_ns;
    if (shots->is_armed && !shots->is_active && !bench->judge.is_reversed &&
        shots->seen < shots->count &&
        shots->t_ns_q12[shots->seen] <= bench->controller.rate.s_ns_q12 &&
        rested_ns > 0 && rested_ns >= shots->trigger.config.rest_ns)
        stateful_violate(bench, STATEFUL_SHOT, -1, "number %u is left out",
                         (unsigned)shots->seen + 1);
}

static void judge_width(struct stateful *bench)
{
    const struct stateful_shots *shots = &bench->shots;
    const int64_t width_ns = bench->now_ns - shots->since_ns;
    if (width_ns < shots->trigger.config.width_ns)
        stateful_violate(bench, STATEFUL_SHOT, -1, "%.3f ms wide",
                         (double)width_ns / 1e6);
}

void stateful_shots_step(struct stateful *bench)
{
    struct stateful_shots *shots = &bench->shots;
    const bool was = shots->is_active;
    struct motion_clock_rate aim;
    if (!bench->kind.has_shots)
        return;
    controller_ahead(&bench->controller, shots->lead_ns, &aim);
    (void)trigger_step(&shots->trigger, aim.s_ns_q12, bench->now_ns);
    if (shots->is_active != was) {
        if (shots->is_active)
            judge_pulse(bench);
        else
            judge_width(bench);
        shots->since_ns = bench->now_ns;
    }
    judge_due(bench);
    if (!stateful_in_motion(bench->controller.state)) {
        trigger_disarm(&shots->trigger);
        shots->is_armed = false;
    }
}
