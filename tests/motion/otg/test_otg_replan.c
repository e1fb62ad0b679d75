/* tests/motion/otg/test_otg_replan.c - planning again while moving; see
 * motion/otg/replan.h.  Problems from tests/motion/otg/otg_many.h, plans judged
 * by tests/motion/otg/otg_oracle.h. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/replan.h"
#include "tests/motion/otg/otg_many.h"
#include "tests/motion/otg/otg_oracle.h"
#include "tests/support/check.h"

#define SEED    UINT64_C(20250707)
#define REPLANS 99

/* --- problems ------------------------------------------------------------- */

/* The n-th of a kind that takes at least 4096 ticks per replan. */
static bool problem(enum many_kind kind, uint64_t n, struct many_problem *p,
                    struct motion_otg_plan *plan)
{
    many_draw(SEED, n * MANY_KINDS + kind, p);
    return motion_otg_make(&p->move[0], plan, NULL) == MOTION_OK &&
           plan->dur_ns_q12 >= (int64_t)4096 * 4096;
}

static void judged(const struct motion_otg_move *m,
                   const struct motion_otg_plan *plan, uint64_t n)
{
    const char *wrong = otg_oracle_judge(m, plan);
    if (wrong != NULL)
        fail_msg("problem %" PRIu64 ": %s", n, wrong);
}

/* A track made from a plan, and its state as the controller gets it. */
struct run {
    struct motion_segment segment[MOTION_OTG_PHASES];
    struct motion_track track;
};

static bool run_make(struct run *run, const struct motion_otg_plan *plan)
{
    motion_track_init(&run->track, run->segment, MOTION_OTG_PHASES,
                      plan->start_pos_q32);
    return motion_otg_append(plan, &run->track) == MOTION_OK;
}

static int64_t clamped(int64_t value, int64_t low, int64_t high)
{
    return value < low ? low : value > high ? high : value;
}

/* A sample is right to three units of its formats; where the motion is on a
 * limit those must not put it outside. */
static struct motion_state
run_sample(const struct run *run, const struct motion_otg_limit *l, int64_t t)
{
    struct motion_cursor cursor = { 0 };
    struct motion_sample at;
    motion_track_sample(&run->track, &cursor, t, &at);
    return (struct motion_state){
        at.pos_q32, clamped(at.vel_q32, l->vel_min_q32, l->vel_max_q32),
        clamped(at.acc_q32, l->acc_min_q32, l->acc_max_q32), 0
    };
}

/* --- along its own optimum ------------------------------------------------ */

struct tally {
    int replanned, kept, late;
    double worst; /* lateness without the fallback, of the move */
};

/* The plan's own state, and the old plan where the new one is no better: never
 * late, not by a tick, at any of the replans. */
static void replan_by_the_planner(uint64_t n,
                                  const struct motion_otg_move *first,
                                  const struct motion_otg_plan *plan,
                                  struct tally *tally)
{
    int64_t arrival = plan->dur_ns_q12, since = 0;
    int64_t tick = arrival / (REPLANS + 1);
    struct motion_otg_trajectory old = { .move = *first, .plan = *plan }, next;
    for (int i = 1; i <= REPLANS && i * tick - since < old.plan.dur_ns_q12;
         i++) {
        int outcome =
            motion_otg_replan(&old, i * tick - since, first, &next, NULL);
        if (outcome != MOTION_OTG_NEW && outcome != MOTION_OTG_KEPT)
            fail_msg("problem %" PRIu64 ", replan %d: %d", n, i, outcome);
        tally->kept += outcome == MOTION_OTG_KEPT;
        if (outcome == MOTION_OTG_KEPT)
            continue;
        tally->replanned++;
        judged(&next.move, &next.plan, n);
        since = i * tick;
        old = next;
        if (since + old.plan.dur_ns_q12 > arrival)
            fail_msg("problem %" PRIu64 ", replan %d: late by %" PRId64
                     " of 2^-12 ns",
                     n, i, since + old.plan.dur_ns_q12 - arrival);
    }
}

/* As a controller might that has only what it sends: the state sampled from
 * the track, position, velocity and acceleration rounded to their formats. */
static void replan_by_samples(uint64_t n, const struct motion_otg_move *first,
                              struct motion_otg_plan plan, bool fallback,
                              struct tally *tally)
{
    static struct run run;
    int64_t arrival = plan.dur_ns_q12, since = 0, least = arrival;
    int64_t tick = arrival / (REPLANS + 1);
    if (!run_make(&run, &plan))
        return;
    for (int i = 1; i <= REPLANS && i * tick - since < plan.dur_ns_q12; i++) {
        struct motion_otg_move move = *first;
        struct motion_otg_plan next;
        move.start = run_sample(&run, &move.limit, i * tick - since);
        int err = motion_otg_make(&move, &next, NULL);
        bool better = err == MOTION_OK &&
                      i * tick + next.dur_ns_q12 < since + plan.dur_ns_q12;
        if (err == MOTION_OK)
            judged(&move, &next, n);
        if (err != MOTION_OK || (fallback && !better)) {
            tally->kept++;
            continue;
        }
        tally->replanned++;
        since = i * tick;
        plan = next;
        if (!run_make(&run, &plan))
            return; /* next to the border of a track's formats */
        if (since + plan.dur_ns_q12 < least)
            least = since + plan.dur_ns_q12;
        if (fallback && since + plan.dur_ns_q12 > arrival)
            fail_msg("problem %" PRIu64 ", replan %d: late", n, i);
    }
    double late = (double)(since + plan.dur_ns_q12 - arrival) / (double)arrival;
    tally->late += since + plan.dur_ns_q12 - arrival > REPLANS * tick / 100;
    tally->worst = fmax(tally->worst, late);
}

static void replanning_along_the_optimum_is_never_late(void **state)
{
    struct tally own = { 0 }, sampled = { 0 }, bare = { 0 };
    int problems = 0;
    (void)state;
    for (uint64_t n = 0; n < 300; n++) {
        struct many_problem p;
        struct motion_otg_plan plan;
        if (!problem(n % 3 ? MANY_FULL : MANY_ASYMMETRIC, n, &p, &plan))
            continue;
        problems++;
        replan_by_the_planner(n, &p.move[0], &plan, &own);
        replan_by_samples(n, &p.move[0], plan, true, &sampled);
        replan_by_samples(n, &p.move[0], plan, false, &bare);
    }
    printf("%d moves: by the planner %d new, %d kept; from samples %d new, "
           "%d kept; always the new one: %d late by over 1 %%, worst %.1e of "
           "the move\n",
           problems, own.replanned, own.kept, sampled.replanned, sampled.kept,
           bare.late, bare.worst);
    assert_true(problems > 200);
}

/* --- another goal, other limits ------------------------------------------- */

/* From where the old plan is, to the last bit of the formats. */
static void starts_there(const struct motion_otg_trajectory *old, int64_t t,
                         const struct motion_otg_trajectory *next, uint64_t n)
{
    struct motion_state was, is;
    motion_otg_trajectory_state(old, t, &was);
    motion_otg_trajectory_state(next, 0, &is);
    if (llabs(was.pos_q32 - is.pos_q32) > 1)
        fail_msg("problem %" PRIu64 ": position steps", n);
    if (old->move.limit.acc_max_q32 && llabs(was.vel_q32 - is.vel_q32) > 1)
        fail_msg("problem %" PRIu64 ": velocity steps", n);
    if (old->move.limit.jerk_q32 && llabs(was.acc_q32 - is.acc_q32) > 1)
        fail_msg("problem %" PRIu64 ": acceleration steps", n);
}

static void every_wish_gets_an_answer_that_says_what_it_is(void **state)
{
    int count[3] = { 0 }, range = 0;
    (void)state;
    for (uint64_t n = 0; n < 1500; n++) {
        struct many_problem p;
        struct motion_otg_trajectory old, next = { .plan.count = -1 };
        enum motion_otg_field field;
        if (!problem(MANY_REPLAN, n, &p, &old.plan))
            continue;
        assert_int_equal(motion_otg_begin(&p.move[0], &old, NULL), MOTION_OK);
        struct motion_otg_move later = p.later;
        int64_t dur = old.plan.dur_ns_q12;
        int64_t t = (int64_t)(p.share_q32 >> 2) *
                    (dur / ((int64_t)1 << 29)); /* 0 .. 2 dur */
        if (n % 5 == 0)
            later.goal.vel_q32 = later.limit.vel_max_q32 + 1; /* impossible */
        int outcome = motion_otg_replan(&old, t, &later, &next, &field);
        if (outcome == MOTION_E_RANGE) {
            range++;
            continue;
        }
        if (outcome < 0 || outcome > MOTION_OTG_STOP) {
            fail_msg("problem %" PRIu64 ": %s, %s", n, motion_err_text(outcome),
                     motion_otg_field_text(field));
            return;
        }
        count[outcome]++;
        if (n % 5 == 0 &&
            outcome != (t < dur ? MOTION_OTG_KEPT : MOTION_OTG_STOP))
            fail_msg("problem %" PRIu64 ": %d for an impossible goal", n,
                     outcome);
        if (outcome == MOTION_OTG_KEPT) {
            assert_true(t < dur && next.plan.count == -1);
            continue;
        }
        judged(&next.move, &next.plan, n);
        starts_there(&old, t, &next, n);
    }
    printf("%d new, %d kept, %d stops, %d too far\n", count[MOTION_OTG_NEW],
           count[MOTION_OTG_KEPT], count[MOTION_OTG_STOP], range);
    for (int i = 0; i < 3; i++)
        assert_true(count[i] > 50);
}

/* Half the speed and acceleration in mid-move: braked inside, then on. */
static void lower_limits_are_obeyed_from_then_on(void **state)
{
    int braked = 0;
    (void)state;
    for (uint64_t n = 0; n < 300; n++) {
        struct many_problem p;
        struct motion_otg_trajectory old, next;
        if (!problem(MANY_REST, n, &p, &old.plan))
            continue;
        assert_int_equal(motion_otg_begin(&p.move[0], &old, NULL), MOTION_OK);
        struct motion_otg_move move = p.move[0];
        struct motion_otg_limit *l = &move.limit;
        l->vel_max_q32 /= 2;
        l->vel_min_q32 /= 2;
        l->acc_max_q32 /= 2;
        l->acc_min_q32 /= 2;
        int outcome = motion_otg_replan(&old, old.plan.dur_ns_q12 / 5 * 2,
                                        &move, &next, NULL);
        if (outcome == MOTION_E_RANGE || outcome == MOTION_OTG_KEPT)
            continue;
        if (outcome != MOTION_OTG_NEW)
            fail_msg("problem %" PRIu64 ": %d", n, outcome);
        judged(&next.move, &next.plan, n);
        l = &next.move.limit;
        braked += next.move.start.vel_q32 > l->vel_max_q32 ||
                  next.move.start.vel_q32 < l->vel_min_q32;
    }
    printf("braked %d times\n", braked);
    assert_true(braked > 30);
}

/* --- stop ----------------------------------------------------------------- */

/* Least time from (v, a) to rest by hand: full jerk to a peak, held at the
 * limit, full jerk back.  In the direction of the speed change the ramps cost
 * (2 peak^2 - a^2) / 2 j. */
static long double stop_s(const struct motion_state *at,
                          const struct motion_otg_limit *l)
{
    long double v = ldexpl((long double)at->vel_q32, -32);
    long double a = ldexpl((long double)at->acc_q32, -32);
    long double j = ldexpl((long double)l->jerk_q32, -32);
    int sign = v + a * fabsl(a) / (2 * j) > 0 ? -1 : 1;
    long double most = sign > 0 ? ldexpl((long double)l->acc_max_q32, -32)
                                : -ldexpl((long double)l->acc_min_q32, -32);
    long double dv = -sign * v;
    a *= sign;
    long double peak = sqrtl(j * dv + a * a / 2);
    if (peak <= most)
        return (2 * peak - a) / j;
    return (2 * most - a) / j +
           (dv - (2 * most * most - a * a) / (2 * j)) / most;
}

static void a_stop_takes_the_least_time(void **state)
{
    int compared = 0;
    (void)state;
    for (uint64_t n = 0; n < 3000; n++) {
        struct many_problem p;
        struct motion_otg_plan plan;
        many_draw(SEED, n * MANY_KINDS + MANY_STOP, &p);
        struct motion_otg_move *m = &p.move[0];
        m->limit.jerk_down_q32 = 0;
        if (motion_otg_stop(&m->start, &m->limit, &plan) != MOTION_OK)
            continue;
        long double want = stop_s(&m->start, &m->limit);
        long double got = (long double)plan.dur_ns_q12 / 4096e9L;
        if (got > want * (1 + 0x1p-20L) + 2e-9L ||
            got < want * (1 - 1e-9L) - 1e-12L)
            fail_msg("problem %" PRIu64 ": %.15Lg s, the least is %.15Lg", n,
                     got, want);
        compared++;
    }
    assert_true(compared > 2500); /* the others leave the format */
}

/* From steady speed the stop is symmetric about its middle: half the speed in
 * the mean, and no motion inside the limits is shorter, in time or
 * displacement. */
static void a_stop_takes_the_least_way(void **state)
{
    int compared = 0;
    (void)state;
    for (uint64_t n = 0; n < 500; n++) {
        struct many_problem p;
        struct motion_otg_plan plan;
        struct motion_state end;
        many_draw(SEED, n * MANY_KINDS + MANY_STOP, &p);
        struct motion_otg_move *m = &p.move[0];
        m->limit.jerk_down_q32 = 0;
        m->start.acc_q32 = 0;
        m->start.pos_q32 = 0;
        if (motion_otg_stop(&m->start, &m->limit, &plan) != MOTION_OK)
            continue;
        motion_otg_state_at(&plan, plan.dur_ns_q12, &end);
        long double want =
            stop_s(&m->start, &m->limit) * (long double)m->start.vel_q32 / 2;
        if (fabsl(want) > 0x1p62L)
            continue;
        long double off = (long double)end.pos_q32 - want;
        if (fabsl(off) > fabsl(want) * 0x1p-20L +
                             2e-9L * fabsl((long double)m->start.vel_q32) + 2)
            fail_msg("problem %" PRIu64 ": %" PRId64 ", the least is %.15Lg", n,
                     end.pos_q32, want);
        compared++;
    }
    assert_true(compared > 300);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(replanning_along_the_optimum_is_never_late),
        cmocka_unit_test(every_wish_gets_an_answer_that_says_what_it_is),
        cmocka_unit_test(lower_limits_are_obeyed_from_then_on),
        cmocka_unit_test(a_stop_takes_the_least_time),
        cmocka_unit_test(a_stop_takes_the_least_way),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
