/* tests/firmware/control/test_ramp_fault.c - a fault while a hold slows down: what
 * the search has learned by the limits of the move is worth little within the stop
 * limits, which leave far more, in a far shorter time.  The drives brake by themselves
 * only where no stop of one A and J fits in that time
 * (tests/firmware/control/ramp_oracle.h).
 *
 * N faults (4,000 when it is not set). */
#include <stdio.h>

#include "firmware/control/ramp.h"
#include "tests/firmware/control/ramp_oracle.h"

static struct ramp_bench bench, asked; /* now; at the fault */

static struct {
    unsigned faults, quick,
        fitting; /* of them by the drives; though a stop fits */
} tally;

/* Ten to forty times the limits, some of them without a limit of jerk: a hold takes
 * many times as long as a stop. */
static void draw_stop_limits(struct controller *c)
{
    for (unsigned i = 0; i < c->config.axis_count; i++) {
        struct controller_axis_config *config = &bench.axis_config[i];
        const int64_t times = check_random_in(check_stream(), 10, 40);
        config->stop.acc_q32 = config->limit.acc_q32 * times;
        config->stop.jerk_q32 =
            ramp_chance(50) ? 0 : config->limit.jerk_q32 * times;
        controller_gate_init(c, i);
    }
    controller_step_load(c);
}

/* Some ticks on, or sooner where it rests. */
static void ticks(int64_t count)
{
    while (count-- > 0 && bench.controller.rate.rate_q30 != 0)
        ramp_tick(&bench);
}

/* A hold that is under way, of a search that looks as far ahead as it may be; false:
 * there is none. */
static bool is_slowing(struct controller *c)
{
    if (!ramp_start(&bench))
        return false;
    draw_stop_limits(c);
    ticks(check_random_in(check_stream(), 1, 600));
    if (!ramp_is_moving(&bench) || controller_hold(c) < 0)
        return false;
    c->step.lead = (int32_t)(draw() % (RAMP_LEAD_MAX + 1));
    ticks(check_random_in(check_stream(), 1, 400));
    return controller_slows(c) && c->rate.rate_q30 != 0 &&
           c->rate.s_ns_q12 < c->move_end_ns_q12;
}

static bool a_stop_fits(double bound_s)
{
    const struct controller *c = &asked.controller;
    struct motion_clock_rate from;
    motion_clock_warp_at(&c->warp, c->clock_ns, &from);
    return oracle_shortest(c, &from, true, bound_s) < bound_s;
}

static void fault(struct controller *c, uint64_t seed)
{
    asked = bench;
    asked.controller.axis = asked.axis;
    controller_trip(c, CONTROLLER_FAULT_ESTOP);
    const double bound_s = (double)(c->rest_by_ns - c->clock_ns) * 1e-9;
    while (c->state == CONTROLLER_STOPPING &&
           c->reaction < CONTROLLER_REACT_QUICK)
        ramp_tick(&bench);
    tally.faults++;
    if (c->reaction < CONTROLLER_REACT_QUICK)
        return;
    tally.quick++;
    if (!a_stop_fits(bound_s))
        return;
    tally.fitting++;
    printf("SEED=%#" PRIx64 ": %.0f ticks, from rate %.4f, r' %.4f/s\n", seed,
           bound_s * 1e9 / (double)c->config.period_ns,
           (double)asked.controller.rate.rate_q30 * 0x1p-30,
           (double)asked.controller.rate.accel_q30 * 0x1p-30);
}

static void a_fault_in_a_hold_rests_in_time(void **state)
{
    const char *const n = getenv("N"), *const seed = getenv("SEED");
    const uint64_t first = seed ? strtoull(seed, NULL, 0) : 1;
    const unsigned most = seed ? 1 : n ? (unsigned)atoi(n) : 4000;
    (void)state;
    for (uint64_t k = first; tally.faults < most; k++) {
        *check_stream() = k * UINT64_C(0x9E3779B97F4A7C15) | 1;
        if (is_slowing(&bench.controller))
            fault(&bench.controller, k);
        else if (seed)
            break;
    }
    printf("%u faults in holds, %u braked by the drives, %u of them though a "
           "stop fits\n",
           tally.faults, tally.quick, tally.fitting);
    assert_int_equal(tally.fitting, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_fault_in_a_hold_rests_in_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
