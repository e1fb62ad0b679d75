/* tests/test_ramp.c - holds, stops and stops for a fault at any time of random
 * moves: they never speed up by more than r' makes unavoidable, rest comes
 * within the bound, and what was accepted never trips the gate. */
#include <stdio.h>

#include "tests/ramp_bench.h"

static struct ramp_bench bench;

enum request { HOLD, STOP, FAULT };

/* What came of all slow-downs. */
static struct {
    unsigned asked, rose, quick, late;
    double rise, rest_s, share; /* the largest; share of the bound */
} tally;

static double rate_of(int64_t q30)
{
    return (double)q30 / (double)ONE;
}

static void ask(enum request request)
{
    struct controller *c = &bench.controller;
    if (request == HOLD)
        assert_int_equal(controller_hold(c), MOTION_OK);
    else if (request == STOP)
        controller_stop(c);
    else
        controller_raise(c, CONTROLLER_FAULT_ESTOP, -1, 0, 0);
}

static bool rests(const struct controller *c)
{
    return c->rate.rate_q30 == 0 || !controller_in_motion(c) ||
           c->rate.s_ns_q12 >= c->move_end_ns_q12;
}

static int64_t bound_of(const struct controller *c, enum request request)
{
#ifdef BEFORE
    (void)c;
    (void)request;
    return INT64_MAX / 2;
#else
    return controller_ramp_bound_ns(c, request == FAULT);
#endif
}

/* r' has to be brought to 0: r'^2 / 2J above where the ramp began, of the J of
 * its first piece.  Until then the clock goes on as it was going to. */
static double unavoidable(const struct motion_clock_warp *warp)
{
#ifdef BEFORE
    (void)warp;
    return 1e9;
#else
    struct motion_clock_rate at;
    motion_clock_warp_at(warp, warp->t0_ns, &at);
    const double accel = rate_of(at.accel_q30), jerk = rate_of(at.jerk_q30);
    if (warp->count == 0 || accel <= 0)
        return rate_of(at.rate_q30);
    return rate_of(at.rate_q30) + accel * accel / (2 * fabs(jerk));
#endif
}

static void no_gate(const struct controller *c)
{
    if (c->fault.fault == CONTROLLER_FAULT_GATE)
        fail_msg("after %u requests the gate trips on axis %d: %.9g over %.9g",
                 tally.asked, c->fault.axis, (double)c->fault.value / UNIT,
                 (double)c->fault.limit / UNIT);
}

/* Ask, run until it rests, judge every tick. */
static void slow_down(enum request request)
{
    struct controller *c = &bench.controller;
    const double before = rate_of(c->rate.rate_q30);
    const int64_t from_ns = c->clock_ns, bound_ns = bound_of(c, request);
    double highest = 0;
    ask(request);
    tally.asked++;
    while (!rests(c) && c->reaction < CONTROLLER_REACT_QUICK) {
        ramp_tick(&bench);
        no_gate(c);
        const double rate = rate_of(c->rate.rate_q30);
        highest = fmax(highest, rate);
        assert_true(c->rate.rate_q30 >= 0);
        if (c->warp.rate1_q30 == 0 && rate > unavoidable(&c->warp) + 1e-7)
            fail_msg("request %u: the rate rises to %.6f, over %.6f",
                     tally.asked, rate, unavoidable(&c->warp));
        if (c->fault.fault == CONTROLLER_FAULT_REST)
            tally.late++;
        else if (c->clock_ns - from_ns > bound_ns)
            fail_msg("request %u: %.3f s, bound %.3f s", tally.asked,
                     (double)(c->clock_ns - from_ns) * 1e-9,
                     (double)bound_ns * 1e-9);
    }
    const double rest_s = (double)(c->clock_ns - from_ns) * 1e-9;
    tally.quick += c->reaction >= CONTROLLER_REACT_QUICK;
    tally.rose += highest > before + 0.1;
    tally.rise = fmax(tally.rise, highest - before);
    tally.rest_s = fmax(tally.rest_s, rest_s);
    tally.share = fmax(tally.share, rest_s * 1e9 / (double)bound_ns);
}

static void report(const char *what)
{
    print_message(
        "%s: %u, %u rose by over 10 points, the most %.1f; rest after "
        "%.2f s at most, %.2f of the bound; %u quick stops, %u at the "
        "bound\n",
        what, tally.asked, tally.rose, tally.rise * 100, tally.rest_s,
        tally.share, tally.quick, tally.late);
    memset(&tally, 0, sizeof tally);
}

/* Speeds change up and down; a slow-down is asked for at any tick of that. */
static void session(void)
{
    struct controller *c = &bench.controller;
    for (int n = 0; n < 6 && ramp_is_moving(&bench); n++) {
        for (int64_t k = check_random_in(check_stream(), 0, 200);
             k > 0 && ramp_is_moving(&bench); k--) {
            ramp_tick(&bench);
            no_gate(c);
        }
        (void)controller_override(
            c, ramp_chance(60)
                   ? c->override_max_q30
                   : ONE / 100 * check_random_in(check_stream(), 0, 200));
        for (int64_t k = check_random_in(check_stream(), 0, 60);
             k > 0 && ramp_is_moving(&bench); k--) {
            ramp_tick(&bench);
            no_gate(c);
        }
        if (!ramp_is_moving(&bench))
            return;
        const enum request request = (enum request)(draw() % 3);
        slow_down(request);
        if (request != HOLD || controller_resume(c) != MOTION_OK)
            return;
    }
}

#ifndef SLOW_DOWNS
#define SLOW_DOWNS 2000
#endif

static void random_slow_downs_in_moves(void **state)
{
    (void)state;
    seed_from("moves");
    while (tally.asked < SLOW_DOWNS) {
        if (ramp_start(&bench))
            session();
    }
    report("moves");
}

static void random_slow_downs_in_jogs_that_turn_round(void **state)
{
    (void)state;
    seed_from("jogs");
    while (tally.asked < SLOW_DOWNS / 5) {
        ramp_jog(&bench);
        session();
    }
    report("jogs");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_slow_downs_in_moves),
        cmocka_unit_test(random_slow_downs_in_jogs_that_turn_round),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
