/* tests/motion/otg/test_otg_early.c - motions whose acceleration keeps its
 * sign.
 *
 * Such a motion is made, full jerk all the time but where a limit is held: up,
 * down, up again, or upside down.  It obeys its limits, so no plan for its ends
 * may take longer.  docs/OTG.md, section 2, "The early set" and "The first
 * rise". */
#include <math.h>
#include <stdio.h>

#include "motion/core/err.h"
#include "motion/otg/otg.h"
#include "tests/support/check.h"

#define MOVES 3000

/* --- a motion ------------------------------------------------------------- */

struct shape {
    long double a0, peak, valley, af, jerk; /* all > 0, the valley from 0 on */
    long double hold;                       /* of the peak */
    bool is_peak_first;
};

struct run {
    long double a, v, p, t;
};

static void run_to(struct run *r, long double a, long double dt)
{
    r->p += (r->v + (2 * r->a + a) * dt / 6) * dt;
    r->v += (r->a + a) / 2 * dt;
    r->a = a;
    r->t += dt;
}

static void ramp_to(struct run *r, const struct shape *s, long double a)
{
    run_to(r, a, fabsl(a - r->a) / s->jerk);
}

static struct run run_shape(const struct shape *s, long double v0)
{
    struct run r = { s->a0, v0, 0, 0 };
    if (!s->is_peak_first)
        ramp_to(&r, s, s->valley);
    ramp_to(&r, s, s->peak);
    run_to(&r, s->peak, s->hold);
    if (s->is_peak_first)
        ramp_to(&r, s, s->valley);
    ramp_to(&r, s, s->af);
    return r;
}

/* --- its move ------------------------------------------------------------- */

static int64_t q(long double x, int bits)
{
    return (int64_t)roundl(ldexpl(x, bits));
}

static long double between(long double low, long double high)
{
    return low + (high - low) * draw_unit();
}

/* What both ends need of it when they ramp their accelerations to zero, and
 * more, or nothing more where `touches`. */
static void limit_velocity(struct motion_otg_move *m, const struct shape *s,
                           const struct run *end, long double v0, bool touches)
{
    long double up = fmaxl(v0 + s->a0 * s->a0 / 2 / s->jerk, end->v);
    long double down = fminl(end->v - s->af * s->af / 2 / s->jerk, v0);
    up = fmaxl(up, s->jerk / 1000);
    down = fminl(down, -s->jerk / 1000);
    m->limit.vel_max_q32 = (int64_t)ceill(ldexpl(touches ? up : up * 1.5L, 32));
    m->limit.vel_min_q32 =
        (int64_t)floorl(ldexpl(touches ? down : down * 1.5L, 32));
}

static void turn_over(struct motion_otg_move *m)
{
    struct motion_otg_limit was = m->limit;
    m->start.vel_q32 = -m->start.vel_q32;
    m->start.acc_q32 = -m->start.acc_q32;
    m->goal.pos_q32 = -m->goal.pos_q32;
    m->goal.vel_q32 = -m->goal.vel_q32;
    m->goal.acc_q32 = -m->goal.acc_q32;
    m->limit.vel_max_q32 = -was.vel_min_q32;
    m->limit.vel_min_q32 = -was.vel_max_q32;
    m->limit.acc_max_q32 = -was.acc_min_q32;
    m->limit.acc_min_q32 = -was.acc_max_q32;
}

/* Returns how long the motion takes. */
static long double make_move(const struct shape *s, bool touches,
                             struct motion_otg_move *m)
{
    long double change = run_shape(s, 0).v;
    long double v0 = -change * between(0.1L, 0.9L);
    struct run end = run_shape(s, v0);
    *m = (struct motion_otg_move){ .mode = MOTION_OTG_POSITION };
    m->start.vel_q32 = q(v0, 32);
    m->start.acc_q32 = q(s->a0, 32);
    m->goal.pos_q32 = q(end.p, 32);
    m->goal.vel_q32 = m->start.vel_q32 + q(change, 32);
    m->goal.acc_q32 = q(s->af, 32);
    m->limit.jerk_q32 = q(s->jerk, 32);
    m->limit.acc_max_q32 = q(touches ? s->peak : s->peak * 2, 32);
    m->limit.acc_min_q32 = -m->limit.acc_max_q32;
    limit_velocity(m, s, &end, v0, touches);
    if (draw() & 1)
        turn_over(m);
    return end.t;
}

/* Whole 2^-16, so that the formats hold it exactly. */
static long double draw_acc(long double low, long double high)
{
    return ldexpl(roundl(ldexpl(between(low, high), 16)), -16);
}

static struct shape draw_shape(void)
{
    struct shape s;
    s.jerk = ldexpl(1, 8 + (int)(draw() >> 61));
    s.a0 = draw_acc(100, 2000);
    s.af = draw_acc(100, 2000);
    s.peak = draw_acc(fmaxl(s.a0, s.af) * 1.05L, 5000);
    s.valley = draw_acc(0, fminl(s.a0, s.af) * 0.95L);
    s.hold = 0;
    s.is_peak_first = draw() & 1;
    return s;
}

/* --- the tests ------------------------------------------------------------ */

/* How much longer the plan takes, as a part of it. */
static long double longer(const struct shape *s, bool touches, int i)
{
    struct motion_otg_move m;
    struct motion_otg_plan plan;
    long double t = make_move(s, touches, &m);
    if (motion_otg_make(&m, &plan, NULL) != MOTION_OK)
        fail_msg("move %d: refused", i);
    long double more = (long double)plan.dur_ns_q12 / 4096e9L / t - 1;
    if (more > 1e-4L)
        fail_msg("move %d: %.3Lg longer than %.12Lg s", i, more, t);
    return more;
}

/* Next to the most that a border reaches the time grows with the root of what
 * tightened limits take: one in a thousand. */
static void expect_few(int hair)
{
    printf("%d of %d take over 1e-6 longer\n", hair, MOVES);
    assert_true(hair <= MOVES / 500);
}

static void no_plan_is_longer_than_a_known_motion(void **state)
{
    int hair = 0;
    (void)state;
    seed_from("known motions");
    for (int i = 0; i < MOVES; i++) {
        struct shape s = draw_shape();
        hair += longer(&s, false, i) > 1e-6L;
    }
    expect_few(hair);
}

/* Where the early set is about to close, its borders end in valleys near zero,
 * and are no longer concave there. */
static void a_lens_that_just_shuts_is_looked_into(void **state)
{
    int hair = 0;
    (void)state;
    seed_from("shut lenses");
    for (int i = 0; i < MOVES; i++) {
        struct shape s = draw_shape();
        long double a = s.is_peak_first ? s.a0 : s.af;
        long double part = i % 3 ? 1 - 0.1L * draw_unit() : 1;
        s.peak = sqrtl(part * a * a + s.valley * s.valley);
        if (s.peak > 1.01L * fmaxl(s.a0, s.af))
            hair += longer(&s, false, i) > 1e-6L;
    }
    expect_few(hair);
}

/* Limits are tightened for the search; what touches them as they are must be
 * found all the same. */
static void limits_may_be_touched(void **state)
{
    int hair = 0;
    (void)state;
    seed_from("limits touched");
    for (int i = 0; i < MOVES; i++) {
        struct shape s = draw_shape();
        s.hold = i & 1 ? between(0, 1) * s.peak / s.jerk : 0;
        hair += longer(&s, true, i) > 1e-6L;
    }
    expect_few(hair);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_plan_is_longer_than_a_known_motion),
        cmocka_unit_test(a_lens_that_just_shuts_is_looked_into),
        cmocka_unit_test(limits_may_be_touched),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
