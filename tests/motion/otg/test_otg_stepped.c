/* tests/motion/otg/test_otg_stepped.c - jerk not limited: the time is that of a
 * closed form.
 *
 * With acceleration in [-b, a] and velocity in [vn, vx] the fastest motion from
 * v0 to v1 over d goes by the limits of acceleration to one speed w and from
 * there to v1, with a cruise where w is a limit.  On the upper border
 *
 *     d = (w^2 - v0^2) / 2a + (w^2 - v1^2) / 2b,   t = (w - v0) / a + (w - v1) / b
 *
 * with w > 0, which is taken for a d above that of one ramp from v0 to v1; the
 * lower border is the same upside down.  At that d itself the motion is the
 * ramp.  (Biagiotti & Melchiorri, 3.2, for any velocities.) */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>

#include "motion/core/err.h"
#include "motion/otg/otg.h"
#include "tests/motion/otg/otg_oracle.h"
#include "tests/support/check.h"

#define TICKS_PER_S 4096e9L
#define MOVES       4000

static long double real(int64_t q32)
{
    return ldexpl((long double)q32, -32);
}

static int64_t fixed(long double value)
{
    return (int64_t)roundl(ldexpl(value, 32));
}

static long double between(long double low, long double high)
{
    return low * powl(high / low, draw_unit());
}

/* --- the closed form ------------------------------------------------------ */

/* Over d beyond the ramp's, upwards. */
static long double upwards(long double d, long double v0, long double v1,
                           long double vx, long double a, long double b)
{
    long double w =
        sqrtl((2 * d + v0 * v0 / a + v1 * v1 / b) / (1 / a + 1 / b));
    long double cruise = 0;
    if (w > vx) {
        w = vx;
        cruise = d - (w * w - v0 * v0) / 2 / a - (w * w - v1 * v1) / 2 / b;
    }
    return (w - v0) / a + (w - v1) / b + cruise / vx;
}

static long double ramp_rate(const struct motion_otg_move *m)
{
    return m->goal.vel_q32 < m->start.vel_q32 ? real(m->limit.acc_min_q32)
                                              : real(m->limit.acc_max_q32);
}

/* What one ramp covers. */
static long double ramp_length(const struct motion_otg_move *m)
{
    long double v0 = real(m->start.vel_q32), v1 = real(m->goal.vel_q32);
    return (v1 - v0) * (v1 + v0) / 2 / ramp_rate(m);
}

static long double closed_form(const struct motion_otg_move *m)
{
    const struct motion_otg_limit *l = &m->limit;
    long double v0 = real(m->start.vel_q32), v1 = real(m->goal.vel_q32);
    long double d = real(m->goal.pos_q32 - m->start.pos_q32);
    return d > ramp_length(m)
               ? upwards(d, v0, v1, real(l->vel_max_q32), real(l->acc_max_q32),
                         -real(l->acc_min_q32))
               : upwards(-d, -v0, -v1, -real(l->vel_min_q32),
                         -real(l->acc_min_q32), real(l->acc_max_q32));
}

/* --- moves ---------------------------------------------------------------- */

static int64_t draw_vel(const struct motion_otg_limit *l)
{
    switch (draw() % 6) {
    case 0:
        return l->vel_max_q32;
    case 1:
        return l->vel_min_q32;
    case 2: /* just below it */
        return l->vel_max_q32 - (int64_t)(draw() % 4);
    default:
        return (int64_t)((long double)l->vel_max_q32 * draw_unit()) -
               (int64_t)(-(long double)l->vel_min_q32 * draw_unit());
    }
}

/* In mm, m, rev; limits of both signs up to 8 : 1. */
static void draw_move(struct motion_otg_move *m)
{
    static const long double unit[] = { 1e3L, 1, 1 / 360.0L };
    long double k = unit[draw() % ARRAY_LEN(unit)];
    struct motion_otg_limit *l = &m->limit;
    *m = (struct motion_otg_move){ .mode = MOTION_OTG_POSITION };
    l->vel_max_q32 = fixed(between(0.05L, 10) * k);
    l->acc_max_q32 = fixed(between(0.1L, 100) * k);
    l->vel_min_q32 = -l->vel_max_q32 / (int64_t)(1 + draw() % 4);
    l->acc_min_q32 = -l->acc_max_q32 / (int64_t)(1 + draw() % 8);
    m->start.vel_q32 = draw_vel(l);
    m->goal.vel_q32 = draw_vel(l);
    m->start.pos_q32 = (int64_t)(draw() >> 24) - ((int64_t)1 << 39);
}

static void fail_move(const char *what, const struct motion_otg_move *m,
                      long double got, long double want)
{
    fail_msg("%s: %.12Lg s, expected %.12Lg: over %" PRId64 " from %" PRId64
             " to %" PRId64 " limits %" PRId64 " %" PRId64 " %" PRId64
             " %" PRId64,
             what, got, want, m->goal.pos_q32 - m->start.pos_q32,
             m->start.vel_q32, m->goal.vel_q32, m->limit.vel_max_q32,
             m->limit.vel_min_q32, m->limit.acc_max_q32, m->limit.acc_min_q32);
}

static long double time_of(const struct motion_otg_move *m,
                           struct motion_otg_plan *plan)
{
    enum motion_otg_field field;
    int err = motion_otg_make(m, plan, &field);
    if (err < 0)
        fail_move(motion_otg_field_text(field), m, 0, 0);
    long double t = (long double)plan->dur_ns_q12 / TICKS_PER_S;
    const char *wrong = otg_oracle_judge(m, plan);
    if (wrong == NULL)
        wrong = otg_oracle_judge_track(m, plan);
    if (wrong != NULL)
        fail_move(wrong, m, t, 0);
    return t;
}

/* What a plan may take: each of three steps of the acceleration is a ramp of
 * 2^-22 of the move (docs/OTG.md, 3), and what these leave of the velocity may
 * be made good at the acceleration that is 8 times lower. */
static long double longest(const struct motion_otg_move *move)
{
    struct motion_otg_move m = *move;
    m.limit.acc_max_q32 -= m.limit.acc_max_q32 >> 17;
    m.limit.acc_min_q32 -= m.limit.acc_min_q32 >> 17;
    return closed_form(&m) * (1 + 0x1p-20L) + 2e-9L;
}

/* --- requests ------------------------------------------------------------- */

static void any_displacement_takes_the_time_of_the_closed_form(void **state)
{
    (void)state;
    seed_from("any");
    for (int i = 0; i < MOVES; i++) {
        struct motion_otg_move m;
        struct motion_otg_plan plan;
        draw_move(&m);
        long double k = real(m.limit.vel_max_q32) * between(1e-3L, 100);
        m.goal.pos_q32 = m.start.pos_q32 + fixed((2 * draw_unit() - 1) * k);
        long double want = closed_form(&m), got = time_of(&m, &plan);
        if (got < want * (1 - 1e-12L) || got > longest(&m))
            fail_move("any", &m, got, want);
    }
}

/* No other motion is as fast, and for velocities of one sign nothing of nearly
 * the same time ends there: the nearest tick, less than two of travel off, or
 * the goal itself where it is met less than 2^-10 later. */
static void both_ends_one_ramp_apart_take_that_ramp(void **state)
{
    int met = 0;
    (void)state;
    seed_from("one ramp");
    for (int i = 0; i < MOVES; i++) {
        struct motion_otg_move m;
        struct motion_otg_plan plan;
        draw_move(&m);
        if ((m.start.vel_q32 ^ m.goal.vel_q32) < 0)
            m.start.vel_q32 = m.goal.vel_q32 / 2;
        long double dv = real(m.goal.vel_q32 - m.start.vel_q32);
        long double want = dv / ramp_rate(&m);
        m.goal.pos_q32 = m.start.pos_q32 + fixed(ramp_length(&m));
        /* one step of the position in so short a time is as fast as that */
        if (want < 1e-9L || fabsl(want * (long double)m.start.vel_q32) < 8 ||
            fabsl(want * (long double)m.goal.vel_q32) < 8)
            continue;
        long double got = time_of(&m, &plan);
        long double over =
            real(m.goal.pos_q32 - m.start.pos_q32) - ramp_length(&m);
        if ((over > 0) == (m.goal.vel_q32 > 0) && plan.residual_pos_q32 == 0)
            want = closed_form(&m); /* rounded up: a cruise more */
        if (got < want - 1e-12L || got > want * (1 + 0x1p-10L) + 2e-9L)
            fail_move("one ramp", &m, got, want);
        assert_int_equal(plan.residual_vel_q32, 0);
        met++;
    }
    assert_true(met > MOVES / 2);
}

/* From 5 to 10 at 7.5 is 2/3 s. */
static void a_ramp_known_by_hand(void **state)
{
    const int64_t one = (int64_t)1 << 32;
    struct motion_otg_plan plan;
    (void)state;
    for (int sign = 1; sign >= -1; sign -= 2)
        for (int back = 0; back < 2; back++) {
            const struct motion_otg_move m = {
                .start.vel_q32 = sign * (back ? 10 : 5) * one,
                .goal = { sign * 5 * one, sign * (back ? 5 : 10) * one, 0, 0 },
                .limit = { 10 * one, -10 * one, 15 * one / 2, -15 * one / 2, 0,
                           0 },
            };
            long double t = time_of(&m, &plan);
            if (fabsl(t - 2 / 3.0L) > 1e-12L)
                fail_move("by hand", &m, t, 2 / 3.0L);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_displacement_takes_the_time_of_the_closed_form),
        cmocka_unit_test(both_ends_one_ramp_apart_take_that_ramp),
        cmocka_unit_test(a_ramp_known_by_hand),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
