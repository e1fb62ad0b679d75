/* tests/firmware/control/test_ramp.c - holds, stops and stops for a fault at
 * any time of random moves, forwards and in reverse (firmware/control/ramp_step.h):
 * they keep every axis inside its limits, between ticks too, they never speed up by
 * more than r' makes unavoidable, rest comes within the bound or by the drives, what
 * was accepted never trips the gate, and they take about as long as the shortest
 * ramp of one A and J (tests/firmware/control/ramp_oracle.h).
 *
 * N slow-downs (1,200 when it is not set; make ramps: 50,000).
 * Takes long. */
#include <stdio.h>

#include "firmware/control/ramp.h"
#include "tests/firmware/control/ramp_oracle.h"

static struct ramp_bench bench, asked; /* now; at the request */

enum request { HOLD, STOP, FAULT };

/* One slow-down in so many is compared with the oracle, and so many at most. */
#define COMPARE  6
#define COMPARED 8192

/* Of a tick, at which limits are judged. */
#define PARTS 4

/* To the shortest.  Half are as short, to whole ticks.  A search that sees no further
 * than to the next r' = 0 brakes for what is near: of short stops on tracks near their
 * limits one in ten takes over 1.4 times as long, the more the fewer ticks it has
 * (make ramps). */
#define MEDIAN 1.02
#define NINETY 1.7

/* Of those that rise when they are asked for one in so many may rise further than the
 * oracle's largest r'' lets them, and by so much of the rate.  No axis leaves its
 * limits by that (keeps_limits, every tick), nor does the rate pass what was judged
 * along with the rise (keeps_direction, every tick).  It is further by what the fall
 * is flatter until the steepest that a place leaves has been judged: two or three
 * ticks, of which the oracle allows for one and a half. */
#define RISEN      1e-7
#define ONE_RISEN  400
#define RISEN_MOST 0.005

/* What came of all slow-downs. */
static struct {
    unsigned requested, waited, later, quick, late;
    unsigned rising, risen; /* with r' > 0; further than is unavoidable */
    double rise, over, rest_s, share; /* the largest; share of the bound, */
    double path;                      /* of what is kept for a stop */
    double most[3];                   /* share of a limit of p', p'', p''' */
    unsigned compared;
    double ratio[COMPARED]; /* to the oracle's duration */
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
    return controller_step_bound_ns(c, request == FAULT);
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
    if (c->is_reversed)
        return INFINITY; /* the oracle goes forwards */
    motion_clock_warp_at(&c->warp, c->clock_ns, &at);
    if (at.accel_q30 <= 0)
        return rate_of(at.rate_q30);
    const double most =
        rises_to(c, &at, (struct oracle_piece){ 0, 0 }, stop, longer);
    return isinf(most) ? rises_later(c, &at, stop) : most;
}

/* How long it took, beside the shortest. */
static void compare(const struct ramp_bench *before, bool stop, double took)
{
    const struct controller *c = &before->controller;
    struct motion_clock_rate from;
    motion_clock_warp_at(&c->warp, c->clock_ns, &from);
    if (from.rate_q30 == 0 || took <= 0 || c->is_reversed ||
        tally.compared >= COMPARED)
        return;
    tally.ratio[tally.compared++] =
        took / oracle_shortest(c, &from, stop, took);
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

static double share(int64_t value, int64_t limit)
{
    /* 16 units are rounding */
    return limit == 0 ? 0 : (fabs((double)value) - 16) / (double)limit;
}

static void keeps_limits(unsigned i, const struct motion_clock_rate *now,
                         bool stop)
{
    const struct controller *c = &bench.controller;
    const struct motion_clock_limit *limit =
        stop ? &c->config.axis[i].stop : &c->config.axis[i].limit;
    struct motion_state track, axis;
    controller_path_state(c, c->axis[i].track, now->s_ns_q12, &track);
    motion_clock_warp_chain(now, &track, &axis);
    const double of[3] = { share(axis.vel_q32, limit->vel_q32),
                           share(axis.acc_q32, limit->acc_q32),
                           share(axis.jerk_q32, limit->jerk_q32) };
    for (unsigned k = 0; k < 3; k++) {
        tally.most[k] = fmax(tally.most[k], of[k]);
        if (of[k] > 1 + 1e-6)
            fail_msg("request %u, axis %u: %.9f of the limit of p%.*s",
                     tally.requested, i, of[k], (int)k + 1, "'''");
    }
}

/* From this tick to the next one, of what was found since then. */
static void keeps_limits_to_next(bool stop, int64_t from_ns)
{
    const struct controller *c = &bench.controller;
    if (!controller_in_motion(c) || c->reaction >= CONTROLLER_REACT_QUICK ||
        c->is_brake || c->warp.t0_ns < from_ns)
        return;
    for (int part = 0; part < PARTS; part++) {
        struct motion_clock_rate now;
        motion_clock_warp_at(
            &c->warp, c->clock_ns + c->config.period_ns * part / PARTS + 1,
            &now);
        for (unsigned i = 0; i < c->config.axis_count; i++)
            if (c->axis[i].track && now.s_ns_q12 < c->move_end_ns_q12)
                keeps_limits(i, &now, stop);
    }
}

/* The rate that is never passed: that to which what is in force goes, or where it
 * may be brought to r' = 0 sooner by an r'' = -b that was judged along with it,
 * r + r'^2 / 2 b, in whole ticks, from this tick or the next one on. */
static double goes_to(const struct controller *c, bool stop)
{
    const double tick = (double)c->config.period_ns * 1e-9;
    const int64_t end_ns = c->warp.t0_ns + c->warp.dur_ns;
    const double fall =
        (double)c->step.rise_q56[stop ? 1 : 0] * 0x1p-56 / (tick * tick);
    struct motion_clock_rate at;
    motion_clock_warp_at(&c->warp, c->clock_ns, &at);
    const double a = rate_of(at.accel_q30);
    double most = rate_of(at.rate_q30);
    if (c->step.rise_q56[0] != 0 && c->clock_ns < end_ns)
        return most + fmax(0, a * (a / fall + tick) / 2);
    for (int64_t t_ns = c->clock_ns; t_ns < end_ns; t_ns += MS) {
        motion_clock_warp_at(&c->warp, t_ns + MS, &at);
        most = fmax(most, rate_of(at.rate_q30));
    }
    return most;
}

static void keeps_direction(const struct controller *c, double most)
{
    const double rate = rate_of(c->rate.rate_q30) * (c->is_reversed ? -1 : 1);
    assert_true(rate >= 0);
    if (rate > most + 1e-7 && !c->is_brake)
        fail_msg("request %u: the rate rises to %.9f, what is in force goes "
                 "to %.9f",
                 tally.requested, rate, most);
}

/* While r' > 0 it never rises faster than by what was in force. */
static void no_steeper(const struct controller *c,
                       const struct motion_clock_rate *from)
{
    const int64_t most = from->jerk_q30 > 0 ? from->jerk_q30 : 0;
    if (c->rate.accel_q30 > 0 && c->rate.jerk_q30 > most && !c->is_brake &&
        !c->is_reversed)
        fail_msg("request %u: r'' rises from %.6f to %.6f", tally.requested,
                 rate_of(from->jerk_q30), rate_of(c->rate.jerk_q30));
}

/* A jog that is stopped brakes by a motion of its own.  How far over `most`. */
static double rises_over(double before, double most)
{
    const struct controller *c = &bench.controller;
    const double rate = fabs(rate_of(c->rate.rate_q30));
    if (c->is_brake || c->is_reversed)
        return 0;
    tally.rise = fmax(tally.rise, rate - before);
    return fmax(0, rate - most);
}

/* To the tick: it rests by then, or the drives brake from the next one on. */
static void keeps_bound(int64_t from_ns, int64_t due_ns)
{
    const struct controller *c = &bench.controller;
    const int64_t late_ns = c->clock_ns - due_ns;
    if (c->reaction >= CONTROLLER_REACT_QUICK) {
        assert_int_equal(late_ns, c->config.period_ns);
        tally.late++;
    } else if (late_ns > 0) {
        fail_msg("request %u: %.3f s, bound %.3f s", tally.requested,
                 (double)(c->clock_ns - from_ns) * 1e-9,
                 (double)(due_ns - from_ns) * 1e-9);
    }
}

/* Ask, run until it rests, judge every tick. */
static void slow_down(enum request request)
{
    struct controller *c = &bench.controller;
    const double before = fabs(rate_of(c->rate.rate_q30));
    const int64_t from_ns = c->clock_ns, bound_ns = bound_of(c, request);
    const int64_t reserve_ns_q12 = reserve_of(c);
    const bool is_jog = c->jog != NULL; /* in memory as a whole */
    double over = 0, most = unavoidable(c, request == FAULT, 1);
    bool stop = request == FAULT;
    const double highest = goes_to(c, stop);
    struct motion_clock_rate from;
    motion_clock_warp_at(&c->warp, c->clock_ns, &from);
    asked = bench;
    asked.controller.axis = asked.axis;
    tally.waited += isinf(most) ? 1u : 0u;
    tally.rising += from.accel_q30 > 0 && !c->is_reversed ? 1u : 0u;
    query(request);
    tally.requested++;
    const int64_t due_ns = c->rest_by_ns;
    if (due_ns != 0 && !is_jog && c->reaction < CONTROLLER_REACT_QUICK)
        assert_int_equal(due_ns, from_ns + bound_ns);
    for (unsigned n = 0; !rests(c) && c->reaction < CONTROLLER_REACT_QUICK;
         n++) {
        most = watch_rise(c, stop, n, most);
        ramp_tick(&bench);
        no_gate(c);
        no_steeper(c, &from);
        keeps_direction(c, highest);
        over = fmax(over, rises_over(before, most));
        /* what began within the stop limits may outlast them */
        stop = stop || c->step.stop;
        keeps_limits_to_next(stop, from_ns);
        keeps_bound(from_ns, due_ns);
    }
    tally.over = fmax(tally.over, over);
    tally.risen += over > RISEN ? 1u : 0u;
    const double rest_s = (double)(c->clock_ns - from_ns) * 1e-9;
    if (request == FAULT && !is_jog && !c->is_reversed && from.accel_q30 <= 0)
        keeps_reserve(c, (double)(c->rate.s_ns_q12 - from.s_ns_q12) /
                             (double)reserve_ns_q12);
    if (!is_jog && tally.requested % COMPARE == 0)
        compare(&asked, request == FAULT,
                c->reaction < CONTROLLER_REACT_QUICK ? rest_s : 2 * rest_s);
    tally.quick += c->reaction >= CONTROLLER_REACT_QUICK;
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

static void report(const char *what)
{
    qsort(tally.ratio, tally.compared, sizeof tally.ratio[0], compare_ratio);
    print_message("%s: %u, %u with r' > 0, of them %u rose further than they "
                  "must, by %.4f "
                  "at most; the most %.1f points; %u had to wait, %u levelled "
                  "later; rest "
                  "after %.2f s at most, %.2f of the bound, %.2f of the path "
                  "that is kept "
                  "for a stop; %u quick stops, %u at the bound\n",
                  what, tally.requested, tally.rising, tally.risen, tally.over,
                  tally.rise * 100, tally.waited, tally.later, tally.rest_s,
                  tally.share, tally.path, tally.quick, tally.late);
    print_message("  %u beside the shortest: median %.3f, 90 %% %.3f, 99 %% "
                  "%.3f, worst %.3f; %.8f, %.8f, %.8f of the limits\n",
                  tally.compared, ratio_at(0.5), ratio_at(0.9), ratio_at(0.99),
                  ratio_at(1), tally.most[0], tally.most[1], tally.most[2]);
    assert_true(ratio_at(0.5) <= MEDIAN && ratio_at(0.9) <= NINETY);
    assert_true(tally.risen <= tally.rising / ONE_RISEN + 1);
    assert_true(tally.over <= RISEN_MOST);
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
            keeps_limits_to_next(false, INT64_MIN);
        }
        (void)controller_override(
            c, ramp_chance(60)
                   ? c->override_max_q30
                   : ONE / 100 * check_random_in(check_stream(), 0, 200));
        for (int64_t k = check_random_in(check_stream(), 0, 60);
             k > 0 && ramp_is_moving(&bench); k--) {
            ramp_tick(&bench);
            no_gate(c);
            keeps_limits_to_next(false, INT64_MIN);
        }
        if (!ramp_is_moving(&bench))
            return;
        const enum request request = (enum request)(draw() % 3);
        slow_down(request);
        if (request == HOLD && ramp_chance(30))
            (void)controller_reverse(c, !c->is_reversed);
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
    assert_int_equal(controller_override(c, ONE), MOTION_OK);
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
    print_message("%u, %u with r' > 0, %u rose further than they must, by %.4f "
                  "at most\n",
                  tally.requested, tally.rising, tally.risen, tally.over);
    assert_true(tally.rising > 0);
    assert_int_equal(tally.risen, 0);
    memset(&tally, 0, sizeof tally);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_slow_downs_in_moves),
        cmocka_unit_test(random_slow_downs_in_jogs_that_turn_round),
        cmocka_unit_test(stops_while_the_track_is_at_its_limit_of_jerk),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
