/* tests/motion/otg/test_otg_edge.c - goals that the plain change of speed just
 * meets.
 *
 * Nothing changes the speed in less time than full jerk to a peak, a hold at
 * the limit and full jerk to the goal; so a displacement that just this covers
 * takes its time, and there is nothing faster: the right answer is known
 * without a solver.  Next to it the time grows with the square root of what is
 * missing. */
#include <inttypes.h>
#include <math.h>

#include "motion/core/err.h"
#include "motion/otg/otg.h"
#include "tests/motion/otg/otg_oracle.h"
#include "tests/support/check.h"

#define MOVES      20000
#define PER_SECOND INT64_C(4096000000000)

/* Ramp, hold, ramp in whole parts of a second, each jerk - 0 - jerk. */
struct change {
    struct motion_otg_move move;
    int64_t ticks;
    bool is_peaked;
};

struct state {
    long double p, v, a;
};

static void run(struct state *s, long double j, long double t)
{
    s->p += s->v * t + s->a * t * t / 2 + j * t * t * t / 6;
    s->v += s->a * t + j * t * t / 2;
    s->a += j * t;
}

static struct motion_state in_fixed(struct state s)
{
    return (struct motion_state){ (int64_t)ldexpl(s.p, 32),
                                  (int64_t)ldexpl(s.v, 32),
                                  (int64_t)ldexpl(s.a, 32), 0 };
}

/* With both ends below zero a peak there is no part of the fastest change, nor
 * one that is nearer to zero than they are. */
static bool is_fastest(long double a0, long double peak, long double af,
                       const int t[3])
{
    return (peak >= 0 && peak > -fmaxl(a0, af)) ||
           (t[1] == 0 && (t[0] == 0 || t[2] == 0));
}

static bool draw_change(struct change *c)
{
    int t[3] = { (int)draw_below(5), (int)draw_below(3), (int)draw_below(5) },
        sign = draw() & 1 ? 1 : -1;
    long double part = ldexpl(1, -(int)draw_below(7)),
                j = 6 * (1 + (int)draw_below(9));
    struct state s = { 0, (int)draw_below(9) - 4,
                       j * part * ((int)draw_below(9) - 4) };
    if (draw() & 1)
        s.v = 0;
    if (draw() & 1)
        s.a = 0;
    struct motion_state start = in_fixed(s);
    long double first = s.a;
    run(&s, sign * j, t[0] * part);
    struct state peak = s;
    run(&s, 0, t[1] * part);
    run(&s, -sign * j, t[2] * part);
    long double most = fmaxl(fmaxl(fabsl(first), fabsl(peak.a)), fabsl(s.a));
    bool is_free = t[1] == 0 && (draw() & 1);
    if (t[0] + t[1] + t[2] == 0 || most == 0 ||
        !is_fastest(sign * first, sign * peak.a, sign * s.a, t) ||
        (t[1] > 0 && fabsl(peak.a) < most))
        return false;
    int64_t acc = (int64_t)ldexpl(is_free ? 2 * most : most, 32);
    int64_t vel = (int64_t)1 << 50;
    c->is_peaked = t[0] > 0 && t[2] > 0;
    c->ticks = (int64_t)((t[0] + t[1] + t[2]) * part * PER_SECOND);
    c->move = (struct motion_otg_move){
        .start = start,
        .goal = in_fixed(s),
        .limit = { vel, -vel, acc, -acc, (int64_t)ldexpl(j, 32), 0 },
    };
    return true;
}

static void fail_change(const char *what, const struct change *c, int64_t got)
{
    const struct motion_otg_move *m = &c->move;
    fail_msg("%s: start %" PRId64 " %" PRId64 " %" PRId64 " goal %" PRId64
             " %" PRId64 " %" PRId64 " acc %" PRId64 " jerk %" PRId64
             ": %" PRId64 " ticks, expected %" PRId64,
             what, m->start.pos_q32, m->start.vel_q32, m->start.acc_q32,
             m->goal.pos_q32, m->goal.vel_q32, m->goal.acc_q32,
             m->limit.acc_max_q32, m->limit.jerk_q32, got, c->ticks);
}

static int64_t time_of(const struct change *c)
{
    struct motion_otg_plan plan;
    if (motion_otg_make(&c->move, &plan, NULL) < 0)
        fail_change("no plan", c, 0);
    const char *wrong = otg_oracle_judge(&c->move, &plan);
    if (wrong)
        fail_change(wrong, c, plan.dur_ns_q12);
    return plan.dur_ns_q12;
}

/* --- requests ------------------------------------------------------------- */

static void whole_ticks_take_what_they_take(void **state)
{
    (void)state;
    seed_from("whole ticks");
    for (int i = 0; i < MOVES;) {
        struct change c;
        if (!draw_change(&c))
            continue;
        c.move.mode = i++ & 1 ? MOTION_OTG_POSITION : MOTION_OTG_VELOCITY;
        int64_t got = time_of(&c);
        if (got != c.ticks)
            fail_change("not the fastest", &c, got);
    }
}

/* The fastest change of speed, in ticks. */
static long double fastest(const struct motion_otg_move *m)
{
    long double a0 = ldexpl((long double)m->start.acc_q32, -32);
    long double af = ldexpl((long double)m->goal.acc_q32, -32);
    long double j = ldexpl((long double)m->limit.jerk_q32, -32);
    long double limit = ldexpl((long double)m->limit.acc_max_q32, -32);
    long double dv =
        ldexpl((long double)(m->goal.vel_q32 - m->start.vel_q32), -32);
    long double ramp = (af * af - a0 * a0) / 2 * (af < a0 ? -1 : 1);
    if (j * dv == ramp)
        return fabsl(af - a0) / j * PER_SECOND;
    if (j * dv < ramp) {
        a0 = -a0;
        af = -af;
        dv = -dv;
    }
    long double square = j * dv + (a0 * a0 + af * af) / 2;
    long double peak = fminl(sqrtl(square), limit);
    long double hold = fmaxl(0, square - limit * limit) / limit;
    return (2 * peak - a0 - af + hold) / j * PER_SECOND;
}

/* Between two accelerations of one sign there is no time to spare: a part of a
 * tick may cost all that ramping to zero and back takes. */
static bool has_turn(const struct motion_otg_move *m)
{
    return m->start.acc_q32 == 0 || m->goal.acc_q32 == 0 ||
           (m->start.acc_q32 < 0) != (m->goal.acc_q32 < 0);
}

static void speeds_next_to_it_take_the_root(void **state)
{
    (void)state;
    seed_from("speeds");
    for (int i = 0; i < MOVES;) {
        struct change c;
        if (!draw_change(&c) || !has_turn(&c.move))
            continue;
        i++;
        c.move.mode = MOTION_OTG_VELOCITY;
        c.move.goal.vel_q32 += (int)draw_below(9) - 4;
        c.move.limit.jerk_q32 +=
            (INT64_C(1024) << 16) * ((int)draw_below(3) - 1);
        c.ticks = (int64_t)ceill(fastest(&c.move));
        int64_t got = time_of(&c);
        if (got < c.ticks - 2 || got > c.ticks + 16 + c.ticks / 500000)
            fail_change("beside the fastest", &c, got);
    }
}

/* From rest over a peak, where a little time gives a little displacement either
 * direction. */
static void ways_next_to_it_take_the_root(void **state)
{
    (void)state;
    seed_from("ways");
    for (int i = 0; i < MOVES;) {
        struct change c;
        if (!draw_change(&c) || !c.is_peaked ||
            (c.move.start.vel_q32 | c.move.start.acc_q32) != 0)
            continue;
        i++;
        int64_t off = (int)draw_below(9) - 4;
        c.move.goal.pos_q32 += off;
        long double part = ldexpl((long double)c.ticks / PER_SECOND, 0);
        long double size = (long double)c.move.limit.jerk_q32;
        long double root = sqrtl(8 / (size * part * part * part)) + 1e-6L;
        int64_t got = time_of(&c);
        if (got > c.ticks + (int64_t)(8 * root * (long double)c.ticks))
            fail_change("far from the fastest", &c, got);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whole_ticks_take_what_they_take),
        cmocka_unit_test(speeds_next_to_it_take_the_root),
        cmocka_unit_test(ways_next_to_it_take_the_root),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
