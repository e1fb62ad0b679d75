/* tests/motion/otg/test_otg_replan_small.c - planning again in every tick, of
 * axes whose numbers are small: rev, m, rad.
 *
 * What is judged is what is executed: of every plan the part up to the next
 * replan, exactly, and the samples that are sent, by their differences.
 * Takes long. */
#include <inttypes.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/otg/replan.h"
#include "tests/support/check.h"

#define MS         ((int64_t)4096 * 1000000)
#define US         ((int64_t)4096 * 1000)
#define PER_S      4096e9L
#define SPANS      10 /* differences over 1, 2, 4 .. ticks */
#define TICKS_MOST 80000

/* --- axes ----------------------------------------------------------------- */

static const struct axis {
    const char *name;
    double vel, acc, dec, jerk, jerk_down, d; /* unit, s */
    int64_t tick;                             /* the shortest */
} axes[] = {
    { "rev", 1 / 360.0, 1 / 360.0, 1 / 360.0, 1 / 360.0, 0, 4 / 360.0, MS },
    { "rev, slow", 1 / 3600.0, 1 / 3600.0, 1 / 3600.0, 1 / 3600.0, 0,
      4 / 3600.0, 4 * MS },
    { "rev, short", 1 / 3600.0, 1 / 360.0, 1 / 720.0, 1 / 180.0, 0, 1 / 7200.0,
      125 * US },
    { "rev, soft end", 1 / 360.0, 1 / 180.0, 1 / 360.0, 1 / 90.0, 1 / 360.0,
      4 / 360.0, 4 * MS },
    { "rev, no jerk", 1 / 360.0, 1 / 360.0, 1 / 720.0, 0, 0, 4 / 360.0,
      4 * MS },
    { "m", 0.01, 0.01, 0.01, 0.01, 0, 0.03, MS },
    { "m, brisk", 0.01, 0.05, 0.02, 0.5, 0, 0.005, 125 * US },
    { "m, no jerk", 0.01, 0.01, 0.01, 0, 0, 0.03, 4 * MS },
    { "rad", 0.02, 0.02, 0.02, 0.05, 0, 0.07, 4 * MS },
    { "mm", 10, 50, 50, 500, 0, 10, MS },
    { "deg", 1, 1, 1, 1, 0, 3, 4 * MS },
};

static int64_t q(double value, int bits)
{
    return (int64_t)llround(ldexp(value, bits));
}

static struct motion_otg_move move_of(const struct axis *axis, int64_t from)
{
    return (struct motion_otg_move){
        .start.pos_q32 = from,
        .goal.pos_q32 = from + q(axis->d, 32),
        .limit = { q(axis->vel, 32), -q(axis->vel, 32), q(axis->acc, 32),
                   -q(axis->dec, 32), q(axis->jerk, 32),
                   q(axis->jerk_down, 32) },
    };
}

/* --- what is executed ------------------------------------------------------- */

struct limits {
    long double vel[2], acc[2], jerk;
};

/* Public limits in unit and s. */
static struct limits limits_of(const struct motion_otg_limit *l)
{
    int64_t jerk =
        l->jerk_q32 > l->jerk_down_q32 ? l->jerk_q32 : l->jerk_down_q32;
    return (struct limits){
        { ldexpl((long double)l->vel_min_q32, -32),
          ldexpl((long double)l->vel_max_q32, -32) },
        { ldexpl((long double)l->acc_min_q32, -32),
          ldexpl((long double)l->acc_max_q32, -32) },
        jerk ? ldexpl((long double)jerk, -32) : HUGE_VALL,
    };
}

struct run {
    const char *name, *how;
    struct limits limits;
    struct motion_otg_trajectory now;
    struct motion_segment segment[MOTION_OTG_PHASES];
    struct motion_track track;
    struct motion_cursor cursor;
    int64_t tick, since; /* the trajectory's start, 2^-12 ns */
    int64_t first;       /* how long the first plan takes */
    int64_t rests_at;    /* from then on the goal does not change */
    int ticks, replanned, kept;
    int64_t *sent_q32;
    long double worst_vel, worst_acc, worst_jerk; /* of the limit */
    long double off_vel, off_acc; /* what rounding may have made so far */
};

static void run_fail(const struct run *run, const char *what, long double is,
                     long double most)
{
    fail_msg("%s, %s, every %" PRId64 " us, tick %d: %s %.12Lg, at most %.12Lg",
             run->name, run->how, run->tick / US, run->ticks, what, is, most);
}

static void keeps(const struct run *run, const char *what, long double is,
                  const long double limit[2], long double off,
                  long double *worst)
{
    long double most = limit[is > 0];
    *worst = fmaxl(*worst, is / most);
    if (fabsl(is) > fabsl(most) * (1 + 1e-15L) + off)
        run_fail(run, what, is, most);
}

/* One phase of `t` s from v, a to a + j t. */
static void judge_piece(struct run *run, long double v, long double a,
                        long double j, long double t)
{
    const long double jerk[2] = { -run->limits.jerk, run->limits.jerk };
    long double turn = j != 0 ? -a / j : -1;
    keeps(run, "acceleration", a, run->limits.acc, run->off_acc,
          &run->worst_acc);
    keeps(run, "acceleration", a + j * t, run->limits.acc, run->off_acc,
          &run->worst_acc);
    keeps(run, "velocity", v, run->limits.vel, run->off_vel, &run->worst_vel);
    keeps(run, "velocity", v + a * t + j * t * t / 2, run->limits.vel,
          run->off_vel, &run->worst_vel);
    if (turn > 0 && turn < t)
        keeps(run, "velocity", v + a * turn / 2, run->limits.vel, run->off_vel,
              &run->worst_vel);
    if (run->limits.jerk < HUGE_VALL)
        keeps(run, "jerk", j, jerk, fabsl(run->limits.jerk) * 1e-12L,
              &run->worst_jerk);
}

/* The trajectory from `from` to `to`, its own time. */
static void judge_window(struct run *run, int64_t from, int64_t to)
{
    const struct motion_otg_plan *plan = &run->now.plan;
    const int fine = run->now.fine_bits;
    long double v = ldexpl((long double)plan->start_vel_q32, -32 - fine);
    long double a =
        ldexpl((long double)plan->start_acc, -plan->acc_bits - fine);
    int64_t t = 0;
    for (int i = 0; i < plan->count && t < to; i++) {
        int64_t n = plan->phase[i].dur_ns_q12;
        long double dt = (long double)n / PER_S, a1, j;
        a1 = ldexpl((long double)plan->phase[i].acc, -plan->acc_bits - fine);
        j = (a1 - a) / dt;
        int64_t lo = from > t ? from - t : 0, hi = to - t < n ? to - t : n;
        long double x = (long double)lo / PER_S;
        if (lo < hi)
            judge_piece(run, v + a * x + j * x * x / 2, a + j * x, j,
                        (long double)(hi - lo) / PER_S);
        v += (a + a1) / 2 * dt;
        a = a1;
        t += n;
    }
}

/* Position, velocity and acceleration go on where they were, to half a step of
 * the trajectory's formats. */
static void judge_step(struct run *run, int64_t t,
                       const struct motion_otg_trajectory *next)
{
    const int fine = next->fine_bits;
    struct motion_state was, is;
    motion_otg_trajectory_state(&run->now, t, &was);
    motion_otg_trajectory_state(next, 0, &is);
    if (fine < 18)
        run_fail(run, "bits below the formats", fine, 18);
    if (llabs(was.pos_q32 - is.pos_q32) > 1 ||
        llabs(was.vel_q32 - is.vel_q32) > 1 ||
        (run->limits.jerk < HUGE_VALL && llabs(was.acc_q32 - is.acc_q32) > 1))
        run_fail(run, "step of the state", 2, 1);
    /* Half a step of acceleration moves the velocity on by a e / j. */
    long double half_acc = ldexpl(1, -17 - fine);
    run->off_acc += half_acc;
    run->off_vel += ldexpl(1, -33 - fine);
    if (run->limits.jerk < HUGE_VALL)
        run->off_vel += half_acc / run->limits.jerk *
                        fmaxl(run->limits.acc[1], -run->limits.acc[0]);
}

static void run_play(struct run *run, const struct motion_otg_trajectory *next,
                     int64_t since)
{
    run->now = *next;
    run->since = since;
    run->cursor = (struct motion_cursor){ 0 };
    assert_int_equal(motion_otg_track(&run->now, run->segment,
                                      MOTION_OTG_PHASES, &run->track),
                     MOTION_OK);
}

static struct run *run_begin(const struct axis *axis, const char *how,
                             int64_t tick, const struct motion_otg_move *move)
{
    static int64_t sent_q32[TICKS_MOST];
    static struct run run;
    struct motion_otg_trajectory first;
    assert_int_equal(motion_otg_begin(move, &first, NULL), MOTION_OK);
    run = (struct run){ .name = axis->name,
                        .how = how,
                        .limits = limits_of(&move->limit),
                        .tick = tick,
                        .sent_q32 = sent_q32 };
    run_play(&run, &first, 0);
    run.first = first.plan.dur_ns_q12;
    sent_q32[0] = move->start.pos_q32;
    return &run;
}

/* One tick on, replanned there towards `wish`. */
static void run_tick(struct run *run, const struct motion_otg_move *wish)
{
    struct motion_otg_trajectory next;
    struct motion_sample sample;
    int64_t t = (run->ticks + 1) * run->tick - run->since;
    judge_window(run, t - run->tick, t);
    assert_true(++run->ticks < TICKS_MOST);
    motion_track_sample(&run->track, &run->cursor, t, &sample);
    run->sent_q32[run->ticks] = sample.pos_q32;
    int outcome = motion_otg_replan(&run->now, t, wish, &next, NULL);
    if (outcome == MOTION_OTG_KEPT) {
        run->kept++;
        return;
    }
    if (outcome != MOTION_OTG_NEW)
        run_fail(run, "outcome", outcome, 0);
    run->replanned++;
    judge_step(run, t, &next);
    run_play(run, &next, run->since + t);
}

static int64_t arrival_of(const struct run *run)
{
    return run->since + run->now.plan.dur_ns_q12;
}

/* On to the end, at the given time where there is one. */
static void run_end(struct run *run, const struct motion_otg_move *move,
                    int64_t arrives_at)
{
    struct motion_otg_move wish = *move;
    do {
        int64_t t = (run->ticks + 1) * run->tick;
        wish.dur_ns_q12 = arrives_at > t ? arrives_at - t : 0;
        run_tick(run, &wish);
    } while ((run->ticks + 1) * run->tick < arrival_of(run));
    judge_window(run, run->ticks * run->tick - run->since,
                 run->now.plan.dur_ns_q12);
    assert_true(++run->ticks < TICKS_MOST);
    run->sent_q32[run->ticks] = run->track.end.pos_q32;
    if (run->track.end.pos_q32 != move->goal.pos_q32)
        run_fail(run, "end", (long double)run->track.end.pos_q32,
                 (long double)move->goal.pos_q32);
}

/* Differences over m ticks.  A sample is MOTION_TRACK_POS_ROUNDING from its
 * polynomial; the k-th difference holds 2^k of these.  The last one, cut short
 * by the end, is left out. */
static void judge_sent(struct run *run)
{
    const int64_t *s = run->sent_q32;
    long double one = ldexpl(MOTION_TRACK_POS_ROUNDING, -32);
    for (int m = 1; m < 1 << SPANS; m *= 2) {
        long double t = (long double)(m * run->tick) / PER_S, unused = 0;
        for (int i = 2 * m; i < run->ticks; i++) {
            long double v = ldexpl((long double)(s[i] - s[i - m]), -32) / t;
            long double w =
                ldexpl((long double)(s[i - m] - s[i - 2 * m]), -32) / t;
            keeps(run, "sent velocity", v, run->limits.vel,
                  run->off_vel + 2 * one / t, &unused);
            keeps(run, "sent acceleration", (v - w) / t, run->limits.acc,
                  run->off_acc + 4 * one / t / t, &unused);
        }
    }
}

/* --- goals ---------------------------------------------------------------- */

/* Where to in this tick, before the goal comes to rest. */
typedef void wish_at(const struct run *run, const struct motion_otg_move *move,
                     struct motion_otg_move *wish);

static void same(const struct run *run, const struct motion_otg_move *move,
                 struct motion_otg_move *wish)
{
    (void)run;
    *wish = *move;
}

/* One step of the format to and fro: never the goal of the tick before. */
static void trembles(const struct run *run, const struct motion_otg_move *move,
                     struct motion_otg_move *wish)
{
    wish->goal.pos_q32 = move->goal.pos_q32 + run->ticks % 2;
}

/* From two thirds of the move on, to be there as it comes to rest. */
static void creeps(const struct run *run, const struct motion_otg_move *move,
                   struct motion_otg_move *wish)
{
    int64_t d = move->goal.pos_q32 - move->start.pos_q32;
    int64_t left = run->rests_at - (run->ticks + 1) * run->tick;
    wish->goal.pos_q32 =
        move->goal.pos_q32 - (int64_t)((long double)d * (long double)left /
                                       (long double)run->rests_at / 3);
}

/* The same, and the axis is to have its speed there. */
static void leads(const struct run *run, const struct motion_otg_move *move,
                  struct motion_otg_move *wish)
{
    int64_t d = move->goal.pos_q32 - move->start.pos_q32;
    creeps(run, move, wish);
    wish->goal.vel_q32 =
        (int64_t)((long double)d * PER_S / (long double)run->rests_at / 3);
}

static void anywhere(const struct run *run, const struct motion_otg_move *move,
                     struct motion_otg_move *wish)
{
    int64_t d = move->goal.pos_q32 - move->start.pos_q32;
    (void)run;
    wish->goal.pos_q32 =
        move->start.pos_q32 + (int64_t)((long double)d * draw_unit());
}

/* Another place now and then, on either side. */
static void to_and_fro(const struct run *run,
                       const struct motion_otg_move *move,
                       struct motion_otg_move *wish)
{
    if (run->ticks % 97 == 0)
        anywhere(run, move, wish);
}

static int64_t fifth_later(const struct run *run)
{
    return run->first + run->first / 5;
}

/* At a given time, a fifth later than need be. */
static void on_time(const struct run *run, const struct motion_otg_move *move,
                    struct motion_otg_move *wish)
{
    trembles(run, move, wish);
    wish->dur_ns_q12 = fifth_later(run) - (run->ticks + 1) * run->tick;
}

static const struct goals {
    const char *name;
    wish_at *wish;
    long double until; /* of the first plan the goal moves */
    bool is_slow;      /* to plan: long ticks only */
} goals[] = {
    { "the same", same, 0, false },
    { "trembling", trembles, 0.33L, false },
    { "to the end", trembles, 0.97L, false },
    { "creeping", creeps, 0.7L, false },
    { "leading", leads, 1.4L, false },
    { "anywhere", anywhere, 1, false },
    { "to and fro", to_and_fro, 1, false },
    { "on time", on_time, 0.5L, true },
};

static void run_tell(const struct run *run)
{
    if (getenv("REPLAN_TELL") != NULL)
        printf("%-14s %-10s %4" PRId64 " us: %5d new %5d kept, of the limits "
               "%.9Lf %.9Lf %.9Lf, %.9Lf s after the first plan's %.3Lf\n",
               run->name, run->how, run->tick / US, run->replanned, run->kept,
               run->worst_vel, run->worst_acc, run->worst_jerk,
               (long double)(arrival_of(run) - run->first) / PER_S,
               (long double)run->first / PER_S);
}

/* Each plan may be 2^-21 longer than the optimum, or 2 ns. */
static int64_t longer(const struct run *run)
{
    int64_t each = run->first >> 21 > 8192 ? run->first >> 21 : 8192;
    return each * run->replanned;
}

/* Behind the middle a step of the goal may cost what going one step costs, or
 * the root of a tick (otg.h).  The plans of two jerks are not compared: from
 * some states the planner ramps the acceleration to zero first (docs/OTG.md,
 * 6). */
static void judge_arrival(const struct run *run, wish_at *wish,
                          const struct motion_otg_limit *limit)
{
    int64_t least = 0, most = INT64_MAX;
    if (wish == same && run->replanned != 0)
        run_fail(run, "new plans", run->replanned, 0);
    if (wish == same)
        most = run->first;
    if (wish == trembles && run->rests_at < run->first / 2 &&
        !limit->jerk_down_q32)
        most = run->first + longer(run);
    if (wish == on_time && !limit->jerk_down_q32) {
        least = fifth_later(run) - longer(run);
        most = fifth_later(run) + longer(run);
    }
    if (arrival_of(run) > most || arrival_of(run) < least)
        run_fail(run, "arrival", (long double)arrival_of(run) / PER_S,
                 (long double)most / PER_S);
}

static void replan_towards(const struct goals *to, const struct axis *axis,
                           int64_t tick)
{
    const struct motion_otg_move move = move_of(axis, q(1.5, 32));
    struct run *run = run_begin(axis, to->name, tick, &move);
    struct motion_otg_move wish = move;
    run->rests_at = (int64_t)((long double)run->first * to->until);
    while ((run->ticks + 1) * tick < run->rests_at) {
        to->wish(run, &move, &wish);
        run_tick(run, &wish);
    }
    run_end(run, &move, to->wish == on_time ? fifth_later(run) : 0);
    judge_sent(run);
    run_tell(run);
    judge_arrival(run, to->wish, &move.limit);
}

static void the_executed_motion_keeps_its_limits_and_arrives(void **state)
{
    (void)state;
    seed_from("goals");
    for (size_t g = 0; g < ARRAY_LEN(goals); g++)
        for (size_t i = 0; i < ARRAY_LEN(axes); i++)
            for (int64_t tick = goals[g].is_slow ? 4 * MS : axes[i].tick;
                 tick <= 4 * MS; tick *= tick < MS ? 8 : 4)
                replan_towards(&goals[g], &axes[i], tick);
}

static void a_slow_axis_starts_although_a_tick_is_nothing(void **state)
{
    (void)state;
    for (size_t g = 0; g < ARRAY_LEN(goals); g++)
        if (goals[g].wish == creeps)
            replan_towards(&goals[g], &axes[0], 125 * US);
}

/* --- stop ----------------------------------------------------------------- */

/* Told to stop in every tick, from `share` of the move on. */
static void stop_again_and_again(const struct axis *axis, long double share)
{
    const struct motion_otg_move move = move_of(axis, q(1.5, 32));
    struct run *run = run_begin(axis, "stopped", axis->tick, &move);
    int64_t first = INT64_MAX;
    while ((long double)((run->ticks + 1) * run->tick) <
           (long double)run->first * share)
        run_tick(run, &move);
    while ((run->ticks + 1) * run->tick < arrival_of(run)) {
        struct motion_otg_trajectory next;
        int64_t t = (run->ticks + 1) * run->tick - run->since;
        judge_window(run, t - run->tick, t);
        run->ticks++;
        int outcome = motion_otg_stop_from(&run->now, t, &move.limit, &next);
        if (first == INT64_MAX)
            first = run->since + t + next.plan.dur_ns_q12;
        if (outcome == MOTION_OTG_STOP) {
            judge_step(run, t, &next);
            run_play(run, &next, run->since + t);
            run->replanned++;
        } else if (outcome != MOTION_OTG_KEPT)
            run_fail(run, "outcome", outcome, MOTION_OTG_STOP);
    }
    run_tell(run);
    assert_true(run->replanned > 0);
    if (arrival_of(run) > first)
        run_fail(run, "rest", (long double)arrival_of(run) / PER_S,
                 (long double)first / PER_S);
}

static void a_stop_told_in_every_tick_is_no_later(void **state)
{
    static const long double shares[] = { 0.03L, 0.1L, 0.3L, 0.7L, 0.95L };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(axes); i++)
        for (size_t k = 0; k < ARRAY_LEN(shares); k++)
            stop_again_and_again(&axes[i], shares[k]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_executed_motion_keeps_its_limits_and_arrives),
        cmocka_unit_test(a_slow_axis_starts_although_a_tick_is_nothing),
        cmocka_unit_test(a_stop_told_in_every_tick_is_no_later),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
