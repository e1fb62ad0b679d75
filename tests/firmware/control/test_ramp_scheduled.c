/* tests/firmware/control/test_ramp_scheduled.c - scheduled ramps, at any time of random
 * moves: two clocks of different ticks that take the same one are in the same state
 * to the bit, every axis keeps its limits between ticks too, what is found is about
 * as short as the shortest ramp of one A and J (tests/firmware/control/ramp_oracle.h),
 * a stop in its middle comes to rest, and what cannot be taken changes nothing.
 *
 * N ramps (300 when it is not set). */
#include "firmware/control/ramp_scheduled.h"

#include <stdio.h>

#include "tests/firmware/control/ramp_oracle.h"

/* Ticks from when one is found to its begin. */
#define LEAD 64
/* Of a tick, at which limits are judged. */
#define PARTS 4
/* To the oracle's shortest: one spans more of the path at once than it looks at, and
 * tries lengths that are an eighth apart. */
#define COMPARED 1000
#define MEDIAN   1.12
#define NINETY   1.25

static struct ramp_bench bench, other;
static unsigned per; /* ticks of the other in one */

static struct {
    unsigned asked, none, taken, compared;
    double ratio[COMPARED];
    unsigned calls; /* of one search, at the most */
} tally;

/* --- two clocks ------------------------------------------------------------ */

static void tick_both(void)
{
    ramp_tick(&bench);
    for (unsigned i = 0; i < per; i++)
        ramp_tick(&other);
}

/* The same axes and tracks, in shorter ticks. */
static bool start_both(void)
{
    const struct motion_track *tracks[RAMP_AXES];
    if (!ramp_start(&bench))
        return false;
    const struct controller *c = &bench.controller;
    per = 1 + (unsigned)(draw() % 4);
    while (c->config.period_ns / per < 62500 || c->config.period_ns % per != 0)
        per--;
    ramp_init(&other, c->config.period_ns / per, c->config.axis_count,
              bench.axis_config);
    for (unsigned i = 0; i < c->config.axis_count; i++)
        tracks[i] = c->axis[i].track;
    assert_int_equal(controller_override(&other.controller, c->override_q30),
                     MOTION_OK);
    assert_int_equal(controller_start(&other.controller, tracks, NULL),
                     MOTION_OK);
    return true;
}

static void are_in_one_state(void)
{
    const struct controller *a = &bench.controller, *b = &other.controller;
    assert_int_equal(a->state, b->state);
    assert_memory_equal(&a->rate, &b->rate, sizeof a->rate);
    for (unsigned i = 0; i < a->config.axis_count; i++)
        assert_memory_equal(&a->axis[i].target, &b->axis[i].target,
                            sizeof a->axis[i].target);
}

static double share(int64_t value, int64_t limit)
{
    return limit == 0 ? 0 : fabs((double)value) / (double)limit;
}

/* From the last tick to the next one. */
static void keeps_limits(const struct controller *c, bool stop)
{
    for (int part = 0; part < PARTS; part++) {
        struct motion_clock_rate now;
        motion_clock_warp_at(
            &c->warp, c->clock_ns + c->config.period_ns * part / PARTS + 1,
            &now);
        for (unsigned i = 0;
             i < c->config.axis_count && now.s_ns_q12 < c->move_end_ns_q12;
             i++) {
            const struct motion_clock_limit *limit =
                stop ? &c->config.axis[i].stop : &c->config.axis[i].limit;
            struct motion_state track, axis;
            controller_path_state(c, c->axis[i].track, now.s_ns_q12, &track);
            motion_clock_warp_chain(&now, &track, &axis);
            const double most =
                fmax(share(axis.vel_q32, limit->vel_q32),
                     fmax(share(axis.acc_q32, limit->acc_q32),
                          share(axis.jerk_q32, limit->jerk_q32)));
            if (most > 1 + 1e-6)
                fail_msg("ramp %u, axis %u: %.9f of a limit", tally.asked, i,
                         most);
        }
    }
}

static bool is_over(const struct controller *c)
{
    return !controller_in_motion(c) || c->rate.s_ns_q12 >= c->move_end_ns_q12;
}

/* By as many calls as it takes. */
static int32_t find(struct controller_ramp *ramp)
{
    struct controller *c = &bench.controller;
    const int64_t begin_ns = c->clock_ns + LEAD * c->config.period_ns;
    int32_t tried = 0, ticks;
    unsigned calls = 0;
    do {
        ticks = controller_ramp_find(c, begin_ns, ramp, &tried);
        calls++;
    } while (ticks == 0 && tried > 0);
    if (calls > tally.calls)
        tally.calls = calls;
    return ticks;
}

/* Found by one and told to the other; false: there is none, or the move is over
 * before it begins. */
static bool tell_both(int64_t rate_q30, struct controller_ramp *ramp)
{
    struct controller *c = &bench.controller;
    const int64_t lead_ns = LEAD * c->config.period_ns;
    const struct motion_clock_warp warp = c->warp;
    int32_t ticks;
    ramp->rate_q30 = rate_q30;
    tally.asked++;
    ticks = find(ramp);
    assert_memory_equal(&c->warp, &warp, sizeof warp);
    if (ticks == 0 || ticks > LEAD) {
        tally.none++;
        return false;
    }
    assert_int_equal(
        controller_ramp_schedule(&other.controller, ramp,
                                 other.controller.clock_ns + lead_ns),
        MOTION_OK);
    for (int i = 0; i < LEAD; i++)
        tick_both();
    return !is_over(c);
}

static bool take_both(int64_t rate_q30, struct controller_ramp *ramp)
{
    if (!tell_both(rate_q30, ramp))
        return false;
    are_in_one_state();
    assert_int_equal(controller_ramp_begin(&bench.controller), MOTION_OK);
    assert_int_equal(controller_ramp_begin(&other.controller), MOTION_OK);
    tally.taken++;
    return true;
}

static void compare(const struct controller_ramp *ramp)
{
    const struct controller *c = &bench.controller;
    const double tick = (double)c->config.period_ns * 1e-9;
    const double own = (2 * ramp->change + ramp->flat) * tick;
    struct motion_clock_rate from;
    motion_clock_warp_at(&c->warp, c->clock_ns, &from);
    if (tally.compared < COMPARED)
        tally.ratio[tally.compared++] =
            own / oracle_shortest(c, &from, false, 4 * own);
}

/* As far as it takes; then it is where it was to go, in the tick that it says. */
static void ramp_both(const struct controller_ramp *ramp)
{
    struct controller *c = &bench.controller;
    const int32_t ticks = 2 * ramp->change + ramp->flat;
    for (int32_t i = 0; i < ticks && !is_over(c); i++) {
        keeps_limits(c, false);
        tick_both();
        are_in_one_state();
    }
    if (is_over(c))
        return;
    assert_int_equal(c->rate.rate_q30, ramp->rate_q30);
    assert_int_equal(c->rate.accel_q30, 0);
    assert_int_equal(c->state, ramp->rate_q30 == 0 ? CONTROLLER_HOLDING
                                                   : CONTROLLER_MOVING);
}

static void both_clocks_take_the_same(void **state)
{
    const char *n_given = getenv("N");
    const unsigned count =
        n_given != NULL ? (unsigned)strtoul(n_given, NULL, 10) : 300;
    (void)state;
    while (tally.taken < count) {
        struct controller_ramp ramp;
        if (!start_both())
            continue;
        for (int64_t n = check_random_in(check_stream(), 1, 800);
             n > 0 && ramp_is_moving(&bench); n--)
            tick_both();
        /* held, on again, and to another rate */
        for (int i = 0; i < 3 && ramp_is_moving(&bench); i++) {
            const bool holds = ramp_chance(60);
            const int64_t rate_q30 =
                holds ? 0 : ONE / 100 * check_random_in(check_stream(), 5, 100);
            if (!take_both(rate_q30, &ramp))
                continue;
            if (holds)
                compare(&ramp);
            ramp_both(&ramp);
            if (holds && !is_over(&bench.controller) &&
                take_both(bench.controller.override_q30, &ramp))
                ramp_both(&ramp);
        }
        assert_int_equal(bench.controller.fault.fault, CONTROLLER_FAULT_NONE);
        assert_int_equal(other.controller.fault.fault, CONTROLLER_FAULT_NONE);
    }
    assert_true(tally.none < tally.asked / 2);
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void they_are_about_as_short_as_can_be(void **state)
{
    (void)state;
    qsort(tally.ratio, tally.compared, sizeof tally.ratio[0], by_size);
    const double median = tally.ratio[tally.compared / 2];
    const double ninety = tally.ratio[tally.compared * 9 / 10];
    printf("%u taken, %u of %u not found; to the shortest: median %.3f, 90 %% "
           "%.3f of %u\n",
           tally.taken, tally.none, tally.asked, median, ninety,
           tally.compared);
    print_message("in %u calls at most\n", tally.calls);
    assert_true(tally.calls > 2); /* a search is over many ticks */
    assert_true(tally.compared > 20);
    assert_true(median < MEDIAN);
    assert_true(ninety < NINETY);
}

/* --- what comes in between -------------------------------------------------- */

/* The search knows a way back from the rise that it made last. */
static void rise(void)
{
    struct controller *c = &bench.controller;
    const int64_t most_q30 = c->override_q30;
    assert_int_equal(controller_override(c, most_q30 / 4), MOTION_OK);
    while (ramp_is_moving(&bench) && c->rate.rate_q30 > most_q30 / 2)
        ramp_tick(&bench);
    assert_int_equal(controller_override(c, most_q30), MOTION_OK);
    while (ramp_is_moving(&bench) && !controller_is_steady(c))
        ramp_tick(&bench);
}

/* Some of one that was found; false: none was, or the move is over. */
static bool take_some(int64_t rate_q30)
{
    struct controller *c = &bench.controller;
    struct controller_ramp ramp = { .rate_q30 = rate_q30 };
    if (!ramp_is_moving(&bench) || find(&ramp) == 0)
        return false;
    for (int i = 0; i < LEAD; i++)
        ramp_tick(&bench);
    if (is_over(c))
        return false;
    assert_int_equal(controller_ramp_begin(c), MOTION_OK);
    for (int64_t n =
             check_random_in(check_stream(), 0, 2 * ramp.change + ramp.flat);
         n > 0; n--)
        ramp_tick(&bench);
    return !is_over(c);
}

/* Anywhere in it: rest within the bound, by the clock. */
static void a_stop_in_its_middle_comes_to_rest(void **state)
{
    struct controller *c = &bench.controller;
    (void)state;
    for (unsigned done = 0; done < 200;) {
        if (!ramp_start(&bench))
            continue;
        for (int64_t n = check_random_in(check_stream(), 1, 800);
             n > 0 && ramp_is_moving(&bench); n--)
            ramp_tick(&bench);
        if (ramp_chance(50))
            rise();
        if (!take_some(ramp_chance(50) ? 0 : ONE / 8))
            continue;
        controller_stop(c);
        while (controller_in_motion(c)) {
            if (c->reaction == CONTROLLER_REACT_NONE)
                keeps_limits(c, true);
            ramp_tick(&bench);
        }
        assert_int_equal(c->state, CONTROLLER_READY);
        assert_int_equal(c->fault.fault, CONTROLLER_FAULT_NONE);
        done++;
    }
}

/* One axis, up to 10 units/s for 100 s. */
static void load_one(void)
{
    const struct controller_axis_config axis = {
        .pos_min_q32 = -10000 * UNIT,
        .pos_max_q32 = 10000 * UNIT,
        .limit = { 20 * UNIT, 100 * UNIT, 1000 * UNIT },
        .stop = { 20 * UNIT, 200 * UNIT, 4000 * UNIT },
        .following_floor_q32 = 10000 * UNIT,
    };
    const int64_t s = MOTION_FIXED_S_Q12;
    const struct motion_state end = { .pos_q32 = 10 * UNIT,
                                      .vel_q32 = 10 * UNIT };
    const struct motion_state rest = { .pos_q32 = 1020 * UNIT };
    ramp_init(&bench, MS, 1, &axis);
    motion_track_init(&bench.track[0], bench.storage[0], 4, 0);
    assert_int_equal(motion_track_append_quintic(&bench.track[0], 2 * s,
                                                 &(struct motion_state){ 0 },
                                                 &end),
                     MOTION_OK);
    assert_int_equal(
        motion_track_append_line(&bench.track[0], 100 * s, 1010 * UNIT),
        MOTION_OK);
    assert_int_equal(motion_track_append_quintic(
                         &bench.track[0], 2 * s,
                         &(struct motion_state){ .vel_q32 = 10 * UNIT }, &rest),
                     MOTION_OK);
}

static void start_one(void)
{
    const struct motion_track *tracks[] = { &bench.track[0] };
    load_one();
    assert_int_equal(controller_start(&bench.controller, tracks, NULL),
                     MOTION_OK);
    for (int i = 0; i < 3000; i++)
        ramp_tick(&bench);
}

static int expect_in(struct controller_ramp ramp, int ticks)
{
    return controller_ramp_schedule(&bench.controller, &ramp,
                                    bench.controller.clock_ns + ticks * MS);
}

static void goes_on_as_before(void)
{
    const struct controller *c = &bench.controller;
    for (int i = 0; i < 200; i++)
        ramp_tick(&bench);
    assert_int_equal(c->state, CONTROLLER_MOVING);
    assert_int_equal(c->rate.rate_q30, ONE);
    assert_int_equal(c->rate.accel_q30, 0);
    assert_int_equal(c->warp.dur_ns, 0);
}

static void what_is_no_ramp_is_refused(void **state)
{
    static const struct controller_ramp rows[] = {
        { -1, MS, 100, 0 },        { 2 * ONE + 1, MS, 100, 0 },
        { 0, 0, 100, 0 },          { 0, -MS, 100, 0 },
        { 0, MS + 1, 100, 0 },     { 0, 1001 * MS, 100, 0 },
        { 0, MS, 0, 100 },         { 0, MS, -1, 100 },
        { 0, MS, 100, -1 },        { 0, MS, 1 << 20, 0 },
        { 0, MS, 100, 1 << 20 },   { 0, 2 * MS, 1 << 18, 1 << 18 },
        { 0, MS, INT32_MAX, 100 }, { 0, MS, 100, INT32_MAX },
    };
    (void)state;
    start_one();
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        if (expect_in(rows[i], 50) != MOTION_E_ARG)
            fail_msg("row %zu", i);
    assert_int_equal(
        expect_in((struct controller_ramp){ 2 * ONE, MS, 999, 0 }, 50),
        MOTION_OK); /* the limit is at 200 % */
    goes_on_as_before();
}

/* 100 units/s2 leave 10 of 10 units/s per s: not in 90 ms, nor in 50 of 1000
 * units/s3. */
static void what_does_not_fit_is_not_taken(void **state)
{
    static const struct {
        struct controller_ramp ramp;
        int begin, take, err;
    } rows[] = {
        { { 0, MS, 2, 90 }, 50, 50, MOTION_E_LIMIT },
        { { 0, MS, 60, 0 }, 50, 50, MOTION_E_LIMIT },
        { { 0, MS, 110, 0 }, 50, 49, MOTION_E_TIMEOUT },
        { { 0, MS, 110, 0 }, 50, 51, MOTION_E_TIMEOUT },
        { { 0, MS, 110, 0 }, 1, 1, MOTION_E_LIMIT },
        { { 0, MS, 110, 0 }, 50, 50, MOTION_OK },
    };
    struct controller *c = &bench.controller;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        start_one();
        assert_int_equal(expect_in(rows[i].ramp, rows[i].begin), MOTION_OK);
        for (int n = 0; n < rows[i].take; n++)
            ramp_tick(&bench);
        if (controller_ramp_begin(c) != rows[i].err)
            fail_msg("row %zu", i);
        if (rows[i].err < 0) {
            goes_on_as_before();
            assert_int_equal(controller_ramp_begin(c), MOTION_E_TIMEOUT);
        }
    }
    for (int n = 0; n < 219; n++)
        ramp_tick(&bench);
    assert_true(c->rate.rate_q30 > 0);
    ramp_tick(&bench);
    assert_int_equal(c->rate.rate_q30, 0);
    assert_int_equal(c->state, CONTROLLER_HOLDING);
    assert_true(c->is_held);
}

/* As in any move, and not as slow as it was told. */
static void a_stop_need_not_wait_for_its_end(void **state)
{
    struct controller *c = &bench.controller;
    int ticks = 0;
    (void)state;
    start_one();
    assert_int_equal(expect_in((struct controller_ramp){ 0, MS, 10000, 0 }, 50),
                     MOTION_OK);
    for (int n = 0; n < 50; n++)
        ramp_tick(&bench);
    assert_int_equal(controller_ramp_begin(c), MOTION_OK);
    for (int n = 0; n < 100; n++)
        ramp_tick(&bench);
    controller_stop(c);
    for (; c->state == CONTROLLER_STOPPING; ticks++)
        ramp_tick(&bench);
    assert_int_equal(c->state, CONTROLLER_READY);
    assert_true(ticks < 300);
}

/* A resume that begins at once leaves nothing of one that was to begin later. */
static void what_begins_elsewhere_is_forgotten(void **state)
{
    struct controller *c = &bench.controller;
    const struct motion_track *tracks[] = { &bench.track[0] };
    (void)state;
    load_one();
    assert_int_equal(controller_cue(c, tracks, 0, NULL), MOTION_OK);
    assert_int_equal(expect_in((struct controller_ramp){ ONE, MS, 100, 0 }, 50),
                     MOTION_OK);
    for (int n = 0; n < 50; n++)
        ramp_tick(&bench);
    assert_int_equal(c->step.scheduled.state, CONTROLLER_SCHEDULED_FITS);
    assert_int_equal(controller_resume(c), MOTION_OK);
    assert_int_equal(controller_ramp_begin(c), MOTION_E_LIMIT);
    ramp_tick(&bench);
    assert_int_equal(c->rate.rate_q30, ONE);
}

static void it_is_for_a_steady_clock_alone(void **state)
{
    static const struct controller_ramp hold = { 0, MS, 110, 0 };
    static const struct controller_ramp on = { ONE, MS, 110, 0 };
    struct controller *c = &bench.controller;
    (void)state;
    start_one();
    /* another command is done at once, and takes its place */
    assert_int_equal(expect_in(hold, 50), MOTION_OK);
    assert_int_equal(controller_override(c, ONE / 2), MOTION_OK);
    for (int n = 0; n < 50; n++)
        ramp_tick(&bench);
    assert_int_equal(controller_ramp_begin(c), MOTION_E_STATE);
    for (int n = 0; n < 1000; n++)
        ramp_tick(&bench);
    assert_int_equal(c->rate.rate_q30, ONE / 2);
    /* within another one */
    assert_int_equal(expect_in(on, 50), MOTION_OK);
    for (int n = 0; n < 50; n++)
        ramp_tick(&bench);
    assert_int_equal(controller_ramp_begin(c), MOTION_OK);
    assert_int_equal(c->override_q30, ONE);
    for (int n = 0; n < 219; n++) {
        ramp_tick(&bench);
        assert_false(controller_is_steady(c));
        assert_int_equal(expect_in(hold, 50), MOTION_E_STATE);
    }
    ramp_tick(&bench);
    ramp_tick(&bench);
    assert_true(controller_is_steady(c));
    /* in reverse, and where nothing moves */
    assert_int_equal(controller_hold(c), MOTION_OK);
    for (int n = 0; n < 1000; n++)
        ramp_tick(&bench);
    assert_int_equal(controller_reverse(c, true), MOTION_OK);
    assert_int_equal(expect_in(on, 50), MOTION_E_STATE);
    controller_stop(c);
    for (int n = 0; n < 10; n++)
        ramp_tick(&bench);
    assert_int_equal(c->state, CONTROLLER_READY);
    assert_int_equal(expect_in(on, 50), MOTION_E_STATE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(both_clocks_take_the_same),
        cmocka_unit_test(they_are_about_as_short_as_can_be),
        cmocka_unit_test(a_stop_in_its_middle_comes_to_rest),
        cmocka_unit_test(what_is_no_ramp_is_refused),
        cmocka_unit_test(what_does_not_fit_is_not_taken),
        cmocka_unit_test(a_stop_need_not_wait_for_its_end),
        cmocka_unit_test(what_begins_elsewhere_is_forgotten),
        cmocka_unit_test(it_is_for_a_steady_clock_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
