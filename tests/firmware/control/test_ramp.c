/* tests/firmware/control/test_ramp.c - holds, stops and stops for a fault at
 * any time of random moves: they never speed up by more than r' makes
 * unavoidable, rest comes within the bound, what was accepted never trips the
 * gate, and the ramp is the shortest one or close to it
 * (tests/firmware/control/ramp_oracle.h).
 *
 * N slow-downs (1,200 when it is not set; make ramps: 50,000).
 * Takes long. */
#include <stdio.h>

#include "firmware/control/ramp.h"
#include "tests/firmware/control/ramp_oracle.h"

static struct ramp_bench bench;

enum request { HOLD, STOP, FAULT };

/* One slow-down in so many is compared with the oracle, and so many at most. */
#define COMPARE  16
#define COMPARED 8192

/* To the shortest, with what whole ticks cost short ramps: so close are nine of
 * ten, and of those that are not found at once all but one in so many compared. */
#define CLOSE      1.15
#define ONE_MISSED 500

/* What came of all slow-downs. */
static struct {
    unsigned requested, rose, waited, later, quick, late;
    double rise, rest_s, share;     /* the largest; share of the bound, */
    double path;                    /* of what is kept for a stop */
    unsigned compared, found_later; /* than at once, where there is one; */
    unsigned missed;                /* and far from the shortest */
    double ratio[COMPARED];         /* to the oracle's duration */
} tally;

static double rate_of(int64_t q30)
{
    return (double)q30 / (double)ONE;
}

static void query(enum request request)
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
    return controller_ramp_bound_ns(c, request == FAULT);
}

/* r' has to be brought to 0, by the largest J that keeps every axis inside its
 * limits, in L = a / J: the rate rises by a L / 2.  The controller counts in
 * whole ticks, takes one more where its looks and set points are rounded, and
 * the rate is seen at ticks: three ticks of L.  Where a length fails near its end
 * it tries every one up to 32 ticks, then such that are a thirty-second apart, then
 * those between one that does not fit and the next that does; where a shorter one
 * would, but not all up to there (a border of segments comes just after its end),
 * that is a thirty-second of L.  Where no J fits yet r' is
 * kept first, or rises by so many quarters of what it was going to, for as many
 * ticks as let one fit then; where none does the clock goes on as it was going
 * to: INFINITY.  On the way it looks for a level a quarter shorter: `longer` is
 * what it may take then. */
static double rises_to(const struct controller *c,
                       const struct motion_clock_rate *at,
                       struct oracle_piece first, bool stop, double longer)
{
    const double tick = (double)c->config.period_ns * 1e-9;
    const double r = rate_of(at->rate_q30), a = rate_of(at->accel_q30);
    const double s = (double)at->s_ns_q12 / (double)MOTION_FIXED_S_Q12;
    const double jerk = oracle_level(c, s, r, a, first, stop);
    const double a1 = a + first.t * first.jerk;
    return jerk == 0 ? INFINITY
                     : r + first.t * (a + a1) / 2 +
                           longer * (a1 * a1 / (2 * jerk) * (33.0 / 32) +
                                     1.5 * a1 * tick);
}

static double rises_later(const struct controller *c,
                          const struct motion_clock_rate *at, bool stop)
{
    const double tick = (double)c->config.period_ns * 1e-9;
    double most = INFINITY;
    for (int part = 0; part < 4 && isinf(most) && at->jerk_q30 >= 0; part++)
        for (int n = 1; n <= 64 && isinf(most); n += n / 2 + 1)
            most = rises_to(c, at,
                            (struct oracle_piece){
                                n * tick, rate_of(at->jerk_q30) / 4 * part },
                            stop, 1);
    tally.later += isinf(most) ? 0u : 1u;
    return most;
}

static double unavoidable(const struct controller *c, bool stop, double longer)
{
    struct motion_clock_rate at;
    motion_clock_warp_at(&c->warp, c->clock_ns, &at);
    if (at.accel_q30 <= 0)
        return rate_of(at.rate_q30);
    const double most =
        rises_to(c, &at, (struct oracle_piece){ 0, 0 }, stop, longer);
    return isinf(most) ? rises_later(c, &at, stop) : most;
}

/* The ramp that was found at once, beside the shortest.  Where none was: how long
 * the shortest takes that there is, or 0. */
static double compare(const struct controller *c,
                      const struct motion_clock_rate *from, bool stop)
{
    const bool is_found = c->warp.rate1_q30 == 0 &&
                          c->reaction < CONTROLLER_REACT_QUICK &&
                          c->warp.t0_ns + c->warp.dur_ns > c->clock_ns;
    const double took =
        is_found ? (double)(c->warp.t0_ns + c->warp.dur_ns - c->clock_ns) * 1e-9
                 : (double)(c->rest_by_ns - c->clock_ns) * 1e-9;
    /* rests: every axis stood, so the clock does at once */
    if (c->is_brake || from->rate_q30 == 0 || took <= 0 || rests(c) ||
        tally.compared >= COMPARED)
        return 0;
    const double least = oracle_shortest(c, from, stop, took);
    if (is_found)
        tally.ratio[tally.compared++] = took / least;
    return is_found || least >= took ? 0 : least;
}

/* What is not found at once is looked for in every tick: a ramp that begins later
 * may end sooner. */
static void compare_later(const struct controller *c, double rest_s,
                          double least)
{
    const double ratio =
        c->reaction < CONTROLLER_REACT_QUICK ? rest_s / least : INFINITY;
    tally.ratio[tally.compared++] = ratio;
    tally.found_later++;
    tally.missed += ratio > CLOSE ? 1u : 0u;
}

static void no_gate(const struct controller *c)
{
    if (c->fault.fault == CONTROLLER_FAULT_GATE)
        fail_msg("after %u requests the gate trips on axis %d: %.9g over %.9g",
                 tally.requested, c->fault.axis, (double)c->fault.value / UNIT,
                 (double)c->fault.limit / UNIT);
}

/* Asked for again on its way, the stop is judged anew: places that have been
 * passed no longer count. */
#define AGAIN       8 /* one of so many */
#define AGAIN_TICKS 48

static bool is_asked_again(const struct controller *c, unsigned ticks)
{
    return tally.requested % AGAIN == 0 && c->jog == NULL &&
           ticks == tally.requested / AGAIN % AGAIN_TICKS &&
           c->reaction == CONTROLLER_REACT_NONE;
}

/* What r' makes unavoidable from here, with or without another request. */
#define ON_THE_WAY 8 /* ticks apart */

static double watch_rise(const struct controller *c, bool stop, unsigned ticks,
                         double most)
{
    if (isinf(most))
        return unavoidable(c, stop, 1);
    if (is_asked_again(c, ticks)) {
        most = fmin(most, unavoidable(c, stop, 1));
        query(STOP);
    }
    return tally.requested % AGAIN == 1 && ticks % ON_THE_WAY == 0
               ? fmin(most, unavoidable(c, stop, 4.0 / 3))
               : most;
}

/* While r' > 0 it never rises faster than the ramp that was in force would. */
static void no_steeper(const struct controller *c,
                       const struct motion_clock_rate *from)
{
    const int64_t most = from->jerk_q30 > 0 ? from->jerk_q30 : 0;
    if (c->rate.accel_q30 > 0 && c->rate.jerk_q30 > most && !c->is_brake)
        fail_msg("request %u: r'' rises from %.6f to %.6f", tally.requested,
                 rate_of(from->jerk_q30), rate_of(c->rate.jerk_q30));
}

/* The path that a stop within the stop limits takes at most where the rate does not
 * rise; where it does, one that leaves the window does not fit. */
static int64_t reserve_of(const struct controller *c)
{
    const struct motion_track *track[RAMP_AXES];
    const int64_t rate =
        c->rate.rate_q30 > c->override_q30 ? c->rate.rate_q30 : c->override_q30;
    for (unsigned i = 0; i < c->config.axis_count; i++)
        track[i] = c->axis[i].track;
    return controller_reserve_ns_q12(c, track, rate);
}

static void keeps_reserve(const struct controller *c, double path)
{
    if (c->reaction >= CONTROLLER_REACT_QUICK)
        return;
    tally.path = fmax(tally.path, path);
    if (path > 1)
        fail_msg("request %u: a stop takes %.3f of what is kept for it",
                 tally.requested, path);
}

/* Ask, run until it rests, judge every tick. */
static void slow_down(enum request request)
{
    struct controller *c = &bench.controller;
    const bool stop = request == FAULT;
    const double before = rate_of(c->rate.rate_q30);
    const int64_t from_ns = c->clock_ns, bound_ns = bound_of(c, request);
    const int64_t reserve_ns_q12 = reserve_of(c);
    const bool is_jog = c->jog != NULL; /* in memory as a whole */
    double highest = 0, most = unavoidable(c, stop, 1), least = 0;
    struct motion_clock_rate from;
    motion_clock_warp_at(&c->warp, c->clock_ns, &from);
    tally.waited += isinf(most) ? 1u : 0u;
    query(request);
    /* within the stop limits there is a ramp at once, or the drives brake */
    assert_true(!stop || c->reaction >= CONTROLLER_REACT_QUICK || c->is_brake ||
                c->warp.rate1_q30 == 0 || rests(c));
    if (++tally.requested % COMPARE == 0)
        least = compare(c, &from, stop);
    for (unsigned n = 0; !rests(c) && c->reaction < CONTROLLER_REACT_QUICK;
         n++) {
        most = watch_rise(c, stop, n, most);
        ramp_tick(&bench);
        no_gate(c);
        no_steeper(c, &from);
        const double rate = rate_of(c->rate.rate_q30);
        highest = fmax(highest, rate);
        assert_true(c->rate.rate_q30 >= 0);
        /* a jog that is stopped brakes by a motion of its own */
        if (rate > most + 1e-7 && !c->is_brake)
            fail_msg("request %u (%d): the rate rises from %.6f to %.6f, over "
                     "%.6f",
                     tally.requested, request, before, rate, most);
        if (c->fault.fault == CONTROLLER_FAULT_REST)
            tally.late++;
        else if (c->clock_ns - from_ns > bound_ns)
            fail_msg("request %u: %.3f s, bound %.3f s", tally.requested,
                     (double)(c->clock_ns - from_ns) * 1e-9,
                     (double)bound_ns * 1e-9);
    }
    const double rest_s = (double)(c->clock_ns - from_ns) * 1e-9;
    if (stop && !is_jog && from.accel_q30 <= 0)
        keeps_reserve(c, (double)(c->rate.s_ns_q12 - from.s_ns_q12) /
                             (double)reserve_ns_q12);
    if (least > 0)
        compare_later(c, rest_s, least);
    tally.quick += c->reaction >= CONTROLLER_REACT_QUICK;
    if (!c->is_brake) {
        tally.rose += highest > before + 0.1;
        tally.rise = fmax(tally.rise, highest - before);
    }
    tally.rest_s = fmax(tally.rest_s, rest_s);
    tally.share = fmax(tally.share, rest_s * 1e9 / (double)bound_ns);
}

static int compare_ratio(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double ratio_at(double share)
{
    const double at = share * (double)(tally.compared - 1);
    return tally.compared > 0 ? tally.ratio[(unsigned)at] : 1;
}

/* Of so many draws with one in ONE_MISSED: three deviations more than the mean, of
 * a binomial distribution, and one at least. */
static unsigned most_missed(unsigned draws)
{
    const double mean = (double)draws / ONE_MISSED;
    return (unsigned)fmax(1, mean + 3 * sqrt(mean));
}

static void report(const char *what)
{
    qsort(tally.ratio, tally.compared, sizeof tally.ratio[0], compare_ratio);
    print_message(
        "%s: %u, %u rose by over 10 points, the most %.1f, %u had to wait, "
        "%u levelled later; rest after %.2f s at most, %.2f of the bound, %.2f "
        "of the path that is kept for a stop; %u quick stops, %u at the "
        "bound\n",
        what, tally.requested, tally.rose, tally.rise * 100, tally.waited,
        tally.later, tally.rest_s, tally.share, tally.path, tally.quick,
        tally.late);
    print_message("  %u beside the shortest: median %.3f, 90 %% %.3f, 99 %% "
                  "%.3f, worst %.3f; %u not found at once, %u of them far from "
                  "it\n",
                  tally.compared, ratio_at(0.5), ratio_at(0.9), ratio_at(0.99),
                  ratio_at(1), tally.found_later, tally.missed);
    assert_true(ratio_at(0.5) <= 1.02 && ratio_at(0.9) <= CLOSE);
    assert_true(tally.missed <= most_missed(tally.compared));
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

static unsigned slow_downs(void)
{
    const char *n = getenv("N");
    return n ? (unsigned)strtoul(n, NULL, 0) : 1200;
}

static void random_slow_downs_in_moves(void **state)
{
    (void)state;
    seed_from("moves");
    while (tally.requested < slow_downs() / 6 * 5) {
        if (ramp_start(&bench))
            session();
    }
    report("moves");
}

static void random_slow_downs_in_jogs_that_turn_round(void **state)
{
    (void)state;
    seed_from("jogs");
    while (tally.requested < slow_downs() / 6) {
        ramp_jog(&bench);
        session();
    }
    assert_true(tally.quick > 0);
    report("jogs");
}

/* An axis that brakes at its limit of jerk while the rate rises leaves no r'' < 0,
 * and before long none of 0: r' may only rise by what is left of it then.  Plays
 * to `brakes` ticks into the braking at 93 %, and for `rises` on the way up. */
static bool brake_while_it_rises(unsigned brakes, unsigned rises)
{
    static const struct controller_axis_config axis = {
        .pos_min_q32 = -1000 * UNIT,
        .pos_max_q32 = 1000 * UNIT,
        .limit = { 60 * UNIT, 680 * UNIT, 6240 * UNIT },
        .stop = { 60 * UNIT, 924 * UNIT, 8456 * UNIT },
        .following_floor_q32 = 1000 * UNIT,
    };
    static const struct motion_clock_bound bound = { 2 * ONE, 35 * ONE };
    const struct motion_otg_move move = {
        .goal.pos_q32 = -30 * UNIT,
        .limit = { 60 * UNIT, -60 * UNIT, 680 * UNIT, -680 * UNIT, 6238 * UNIT,
                   0 },
    };
    struct controller *c = &bench.controller;
    const struct motion_track *const track[] = { &bench.track[0] };
    struct motion_otg_plan plan;
    struct motion_state state;
    ramp_init(&bench, MS, 1, &axis);
    motion_track_init(&bench.track[0], bench.storage[0], MOTION_OTG_PHASES, 0);
    assert_int_equal(motion_otg_make(&move, &plan, NULL), MOTION_OK);
    assert_int_equal(motion_otg_append(&plan, &bench.track[0]), MOTION_OK);
    assert_int_equal(controller_override(c, ONE / 100 * 93), MOTION_OK);
    assert_int_equal(controller_start(c, track, NULL), MOTION_OK);
    do {
        ramp_tick(&bench);
        motion_track_state(track[0], c->rate.s_ns_q12, &state);
        brakes -= state.acc_q32 > 0 && brakes > 0 ? 1 : 0;
    } while (ramp_is_moving(&bench) && (state.acc_q32 <= 0 || brakes > 0));
    if (!ramp_is_moving(&bench))
        return false;
    c->wanted_q30 = ONE;
    assert_int_equal(motion_clock_warp_ramp(&c->warp, c->clock_ns, ONE, &bound,
                                            MS, &c->warp),
                     MOTION_OK);
    while (rises-- > 0)
        ramp_tick(&bench);
    return ramp_is_moving(&bench);
}

static void stops_while_the_track_is_at_its_limit_of_jerk(void **state)
{
    /* each of them looks at some hundred ramps */
    const unsigned step = (unsigned)check_many(3, 12);

    (void)state;
    memset(&tally, 0, sizeof tally);
    for (unsigned brakes = 0; brakes < 100; brakes += step)
        for (unsigned rises = 4; rises < 24; rises += 2)
            if (brake_while_it_rises(brakes, rises))
                slow_down(STOP);
    print_message("%u, %u levelled later, %u had to wait\n", tally.requested,
                  tally.later, tally.waited);
    assert_true(tally.later > 0);
    memset(&tally, 0, sizeof tally);
}

/* --- what follows a ramp -------------------------------------------------- */

/* From 0 to 30 at the limit of jerk, played from its end. */
static void play_in_reverse(void)
{
    static const struct controller_axis_config axis = {
        .pos_min_q32 = -1000 * UNIT,
        .pos_max_q32 = 1000 * UNIT,
        .limit = { 120 * UNIT, 2000 * UNIT, 6240 * UNIT },
        .stop = { 120 * UNIT, 2000 * UNIT, 6240 * UNIT },
        .following_floor_q32 = 1000 * UNIT,
    };
    const struct motion_otg_move move = {
        .goal.pos_q32 = 30 * UNIT,
        .limit = { 60 * UNIT, -60 * UNIT, 680 * UNIT, -680 * UNIT, 6238 * UNIT,
                   0 },
    };
    const struct motion_track *const track[] = { &bench.track[0] };
    struct motion_otg_plan plan;
    ramp_init(&bench, MS, 1, &axis);
    motion_track_init(&bench.track[0], bench.storage[0], MOTION_OTG_PHASES, 0);
    assert_int_equal(motion_otg_make(&move, &plan, NULL), MOTION_OK);
    assert_int_equal(motion_otg_append(&plan, &bench.track[0]), MOTION_OK);
    assert_int_equal(controller_start(&bench.controller, track, NULL),
                     MOTION_OK);
    bench.controller.is_reversed = true;
    bench.controller.axis[0].sent_count =
        0; /* what is judged begins anywhere */
}

/* The largest |p'''| from one time of a ramp to another, every tick and at both. */
static double jerk_between(const struct motion_clock_warp *warp,
                           int64_t from_ns, int64_t to_ns)
{
    const struct controller *c = &bench.controller;
    double most = 0;
    for (int64_t dt = from_ns; dt <= to_ns; dt += MS) {
        struct motion_clock_rate now;
        struct motion_state state, axis;
        motion_clock_warp_at(warp, warp->t0_ns + dt, &now);
        controller_path_state(c, c->axis[0].track, now.s_ns_q12, &state);
        motion_clock_warp_chain(&now, &state, &axis);
        most = fmax(most, fabs((double)axis.jerk_q32));
    }
    return most;
}

/* At its end r'' is 0, and what it had made up for is over the limit: a rate over
 * 100 % on a track at its limit of jerk.  The ramp itself keeps it. */
static void a_ramp_in_reverse_keeps_what_follows_it(void **state)
{
    const double limit = 6240.0 * UNIT;
    struct controller *c = &bench.controller;
    unsigned followed = 0, fit = 0;
    (void)state;
    seed_from("reverse");
    play_in_reverse();
    for (int n = 0; n < 20000; n++) {
        const struct motion_clock_bound bound = { ramp_draw(0.2, 4, ONE),
                                                  ramp_draw(2, 80, ONE) };
        struct ramp_effort effort = { INT64_MAX, INT64_MAX, 0, INT64_MAX };
        struct motion_clock_warp warp;
        motion_clock_warp_init(
            &c->warp, c->clock_ns - MS,
            check_random_in(check_stream(), 0, c->move_end_ns_q12),
            ONE / 100 * check_random_in(check_stream(), 80, 120));
        if (motion_clock_warp_ramp(&c->warp, c->clock_ns,
                                   ONE / 100 *
                                       check_random_in(check_stream(), 80, 120),
                                   &bound, MS, &warp) < 0 ||
            warp.dur_ns < 2 * MS || warp.s1_ns_q12 >= c->move_end_ns_q12)
            continue;
        const bool fits = controller_ramp_judge(c, &warp, false, &effort);
        const bool is_over =
            jerk_between(&warp, warp.dur_ns, warp.dur_ns) > limit * 1.01;
        if (fits && is_over)
            fail_msg("ramp %d: its rate is over the limit when it ends", n);
        fit += fits;
        followed +=
            is_over && jerk_between(&warp, 0, warp.dur_ns - MS) < limit * 0.99;
    }
    print_message("%u ramps fit; %u did but for what follows\n", fit, followed);
    assert_true(fit > 0 && followed > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_slow_downs_in_moves),
        cmocka_unit_test(random_slow_downs_in_jogs_that_turn_round),
        cmocka_unit_test(stops_while_the_track_is_at_its_limit_of_jerk),
        cmocka_unit_test(a_ramp_in_reverse_keeps_what_follows_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
