/* tests/motion/otg/test_otg_scales.c - the same move in other units takes the
 * same time.
 *
 * Lengths times L, times divided by S: velocities grow by L S, accelerations by
 * L S^2, jerks by L S^3, all exactly.  What rounding decides differs, what the
 * answer is may not.  The moves are those where it decides most: starts and
 * goals on their limits or next to them, where a displacement is just within
 * reach. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>

#include "motion/core/err.h"
#include "motion/otg/internal.h"
#include "motion/otg/otg.h"
#include "tests/support/check.h"

#define MOVES 20000

/* --- moves ---------------------------------------------------------------- */

static long double between(long double low, long double high)
{
    return low * powl(high / low, draw_unit());
}

static int64_t inside(int64_t low, int64_t high)
{
    return low +
           (int64_t)(draw_unit() * ((long double)high - (long double)low));
}

/* On a limit, a hair inside, at rest, anywhere. */
static int64_t draw_vel(const struct motion_otg_limit *l)
{
    int64_t limit = draw() & 1 ? l->vel_max_q32 : l->vel_min_q32;
    switch (draw() >> 32 & 7) {
    case 0:
        return 0;
    case 1:
        return inside(l->vel_min_q32, l->vel_max_q32);
    case 2:
        return limit - (limit > 0 ? 1 : -1) * (int64_t)(draw() >> 62);
    case 3:
        return limit - (int64_t)((long double)limit * between(1e-9L, 1e-4L));
    default:
        return limit;
    }
}

static int64_t draw_acc(const struct motion_otg_limit *l)
{
    switch (draw() >> 32 & 7) {
    case 0:
        return l->acc_max_q32;
    case 1:
        return l->acc_min_q32;
    case 2:
    case 3:
        return inside(l->acc_min_q32, l->acc_max_q32);
    default:
        return 0;
    }
}

/* Ramping a to zero, in the direction of time, stays inside. */
static bool has_margin(const struct motion_otg_limit *l, int64_t vel,
                       int64_t acc)
{
    long double a = ldexpl((long double)acc, -32);
    long double ramp = a * fabsl(a) / 2 / ldexpl((long double)l->jerk_q32, -32);
    long double v = (long double)vel + ldexpl(ramp, 32);
    return acc == 0 || (v < (long double)l->vel_max_q32 * (1 - 1e-9L) &&
                        v > (long double)l->vel_min_q32 * (1 - 1e-9L));
}

static void draw_state(const struct motion_otg_limit *l, int sign,
                       struct motion_state *state)
{
    do {
        state->vel_q32 = draw_vel(l);
        state->acc_q32 = draw_acc(l);
    } while (!has_margin(l, state->vel_q32, sign * state->acc_q32));
}

static void draw_move(struct motion_otg_move *m)
{
    struct motion_otg_limit *l = &m->limit;
    *m = (struct motion_otg_move){ .mode = MOTION_OTG_POSITION };
    l->vel_max_q32 = (int64_t)ldexpl(between(0.1L, 10), 32);
    l->vel_min_q32 = -l->vel_max_q32;
    l->acc_max_q32 = (int64_t)ldexpl(between(0.2L, 20), 32);
    l->acc_min_q32 = -l->acc_max_q32;
    l->jerk_q32 = (int64_t)ldexpl(between(0.2L, 100), 32);
    if (draw() & 1)
        l->vel_min_q32 =
            (int64_t)((long double)l->vel_min_q32 * between(0.2L, 8));
    if (draw() & 1)
        l->acc_min_q32 =
            (int64_t)((long double)l->acc_min_q32 * between(0.2L, 5));
    draw_state(l, 1, &m->start);
    draw_state(l, -1, &m->goal);
    if (draw() & 7)
        m->goal.pos_q32 =
            (int64_t)ldexpl((draw_unit() - 0.5L) * between(0.01L, 40), 32);
}

/* --- the same in other units ---------------------------------------------- */

static const struct {
    int64_t length, time;
} SCALES[] = { { 1, 1 },  { 1000, 1 }, { 1, 10 },
               { 64, 8 }, { 7, 3 },    { 10000, 10 } };

static void scale_state(struct motion_state *state, int64_t length,
                        int64_t time)
{
    state->pos_q32 *= length;
    state->vel_q32 *= length * time;
    state->acc_q32 *= length * time * time;
}

static struct motion_otg_move in_units(struct motion_otg_move m, int64_t length,
                                       int64_t time)
{
    struct motion_otg_limit *l = &m.limit;
    scale_state(&m.start, length, time);
    scale_state(&m.goal, length, time);
    l->vel_max_q32 *= length * time;
    l->vel_min_q32 *= length * time;
    l->acc_max_q32 *= length * time * time;
    l->acc_min_q32 *= length * time * time;
    l->jerk_q32 *= length * time * time * time;
    return m;
}

/* --- the tests ------------------------------------------------------------ */

struct spread {
    long double least, most; /* seconds at the first scale */
    int refused;
};

static void spread_over(const struct motion_otg_move *move,
                        struct spread *spread)
{
    *spread = (struct spread){ INFINITY, 0, 0 };
    for (size_t k = 0; k < ARRAY_LEN(SCALES); k++) {
        struct motion_otg_move m =
            in_units(*move, SCALES[k].length, SCALES[k].time);
        struct motion_otg_plan plan;
        if (motion_otg_make(&m, &plan, NULL) != MOTION_OK) {
            spread->refused++;
            continue;
        }
        long double t = (long double)plan.dur_ns_q12 / 4096e9L *
                        (long double)SCALES[k].time;
        spread->least = fminl(spread->least, t);
        spread->most = fmaxl(spread->most, t);
    }
}

/* In the shortest ones what tightened limits cost, or a tick, is over 1e-6: one
 * in 800. */
static void other_units_take_the_same_time(void **state)
{
    int hair = 0;
    (void)state;
    seed_from("other units");
    for (int i = 0; i < MOVES; i++) {
        struct motion_otg_move m;
        struct spread spread;
        draw_move(&m);
        spread_over(&m, &spread);
        if (spread.refused != 0 && spread.refused != (int)ARRAY_LEN(SCALES))
            fail_msg("move %d: refused %d times", i, spread.refused);
        if (spread.refused != 0)
            continue;
        hair += spread.most > spread.least * (1 + 1e-6L);
        if (spread.most > spread.least * 1.001L)
            fail_msg("move %d: %.12Lg s to %.12Lg s", i, spread.least,
                     spread.most);
    }
    printf("%d of %d moves differ by more than 1e-6\n", hair, MOVES);
    assert_true(hair <= MOVES / 500);
}

/* What settling makes of the search's answer takes no longer. */
static void a_plan_takes_what_the_search_says(void **state)
{
    int hair = 0;
    (void)state;
    seed_from("the search");
    for (int i = 0; i < MOVES; i++) {
        struct motion_otg_move m;
        struct motion_otg_plan plan;
        enum motion_otg_field field;
        int64_t least;
        draw_move(&m);
        m = in_units(m, SCALES[(size_t)i % ARRAY_LEN(SCALES)].length,
                     SCALES[(size_t)i % ARRAY_LEN(SCALES)].time);
        if (motion_otg_make(&m, &plan, &field) != MOTION_OK ||
            motion_otg_least(&m, &least, &field) != MOTION_OK)
            continue;
        int64_t more = plan.dur_ns_q12 - least;
        hair += more > least / 1000000 + 4096;
        if (more > least / 1000 + 4096)
            fail_msg("move %d: %" PRId64 " ticks, the least is %" PRId64, i,
                     plan.dur_ns_q12, least);
    }
    printf("%d of %d moves take over 1e-6 more than the least\n", hair, MOVES);
    assert_true(hair <= MOVES / 10000);
}

/* --- times that are known without a search -------------------------------- */

static void takes_about(const struct motion_otg_move *m, long double seconds,
                        long double more, int i)
{
    struct motion_otg_plan plan;
    long double least = seconds * 4096e9L;
    assert_int_equal(motion_otg_make(m, &plan, NULL), MOTION_OK);
    if ((long double)plan.dur_ns_q12 > least * (1 + more) + 8192)
        fail_msg("move %d: %" PRId64 " ticks, the least is %.0Lf", i,
                 plan.dur_ns_q12, least);
}

static void takes(const struct motion_otg_move *m, long double seconds, int i)
{
    takes_about(m, seconds, 0x1p-20L, i);
}

/* Rest to rest with a cruise of 2^-20 to 2^-12 of the whole, next to ramps that
 * just hold: T = d/v + v/a + a/j. */
static void a_cruise_may_be_as_short_as_it_likes(void **state)
{
    (void)state;
    seed_from("short cruises");
    for (int i = 0; i < 2000; i++) {
        const int64_t one = MOTION_FIXED_ONE_Q32;
        struct motion_otg_move m = { 0 };
        long double v = ldexpl(1 + draw_unit(), (int)(draw() % 16));
        long double t = ldexpl(1 + draw_unit(), (int)(draw() % 8) - 4);
        long double hold = ldexpl(draw_unit(), -(int)(draw() % 8));
        long double a = v / (t * (1 + hold)), j = a / t;
        long double ramps = v * (v / a + a / j);
        long double d = ramps * (1 + ldexpl(draw_unit(), -12 - i % 8));
        m.goal.pos_q32 = (int64_t)ldexpl(i & 1 ? d : -d, 32);
        m.limit.vel_max_q32 = (int64_t)(v * (long double)one);
        m.limit.acc_max_q32 = (int64_t)ldexpl(a, 32);
        m.limit.jerk_q32 = (int64_t)ldexpl(j, 32);
        if (m.limit.jerk_q32 >> 40 == 0)
            continue; /* the format would round it too much */
        m.limit.vel_min_q32 = -m.limit.vel_max_q32;
        m.limit.acc_min_q32 = -m.limit.acc_max_q32;
        takes(&m, d / v + v / a + a / j, i);
    }
}

/* A velocity changed at a limit of acceleration from its start to its end. */
static void a_limit_of_acceleration_may_be_held(void **state)
{
    (void)state;
    seed_from("held limits");
    for (int i = 0; i < 2000; i++) {
        struct motion_otg_move m = { .mode = MOTION_OTG_VELOCITY };
        int64_t a =
            check_random_in(check_stream(), INT64_C(1) << 40, INT64_C(1) << 46);
        m.limit.acc_max_q32 = a;
        m.limit.acc_min_q32 = i & 1 ? -a : -a / 7;
        m.limit.jerk_q32 = a << check_random_in(check_stream(), 0, 10);
        if (i & 2) {
            m.limit.acc_max_q32 = -m.limit.acc_min_q32;
            m.limit.acc_min_q32 = -a;
            a = -a;
        }
        m.start.acc_q32 = m.goal.acc_q32 = a;
        m.start.vel_q32 = (int64_t)(draw() >> 20);
        long double t = ldexpl(1 + draw_unit(), (int)(draw() % 8) - 4);
        m.goal.vel_q32 =
            m.start.vel_q32 + (int64_t)(int64_t)(t * (long double)a);
        takes(&m, t, i);
    }
}

/* The displacement of the plain speed change, v = j t^2 from or to rest in d =
 * j t^3: limits that are tightened would cost the root of it. */
static void a_way_may_be_just_that_of_the_speed_change(void **state)
{
    (void)state;
    seed_from("plain speed changes");
    for (int i = 0; i < 1000; i++) {
        struct motion_otg_move m = { 0 };
        int64_t t = check_random_in(check_stream(), 1, 20);
        int64_t j = check_random_in(check_stream(), 1, 1 << 16) << 16;
        bool up = i & 2;
        struct motion_state *end = i & 1 ? &m.start : &m.goal;
        int64_t v = j * t * t;
        m.goal.pos_q32 = (up ? 1 : -1) * j * t * t * t;
        end->vel_q32 = up ? v : -v;
        m.limit.vel_max_q32 = v + (i & 4 ? 0 : v / 3);
        m.limit.acc_max_q32 = j * (2 * t + (int64_t)(draw() >> 62));
        m.limit.jerk_q32 = j;
        m.limit.vel_min_q32 = -m.limit.vel_max_q32;
        m.limit.acc_min_q32 = -m.limit.acc_max_q32;
        takes_about(&m, 2 * (long double)t, 0x1p-30L, i);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(other_units_take_the_same_time),
        cmocka_unit_test(a_plan_takes_what_the_search_says),
        cmocka_unit_test(a_cruise_may_be_as_short_as_it_likes),
        cmocka_unit_test(a_limit_of_acceleration_may_be_held),
        cmocka_unit_test(a_way_may_be_just_that_of_the_speed_change),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
