/* tests/motion/otg/test_otg_nearest.c - motions with no time to spare take the
 * nearest tick.
 *
 * Displacements at the velocity of both ends, changes between two speeds and
 * those that one ramp of full jerk makes: their least time is known, from a us to 10 s, in
 * several units, with limits 1:1000 apart.  No answer takes more than two ticks
 * and 2^-10 longer; the oracle judges every plan and its track, residual
 * included. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>

#include "motion/core/err.h"
#include "motion/otg/replan.h"
#include "motion/otg/sync.h"
#include "tests/motion/otg/otg_oracle.h"
#include "tests/support/check.h"

#define TICKS_PER_S 4096e9L

static long double between(long double low, long double high)
{
    return low * powl(high / low, draw_unit());
}

static int64_t fixed(long double value, int bits)
{
    return (int64_t)roundl(ldexpl(value, bits));
}

/* --- moves ---------------------------------------------------------------- */

static void draw_limits(struct motion_otg_move *m, enum motion_otg_mode mode)
{
    static const long double unit[] = { 1, 1e3L, 1e-3L };
    long double k = unit[draw() % ARRAY_LEN(unit)];
    long double apart = between(1 / 32.0L, 32);
    struct motion_otg_limit *l = &m->limit;
    *m = (struct motion_otg_move){ .mode = mode };
    l->vel_max_q32 = fixed(between(0.1L, 10) * k, 32);
    l->acc_max_q32 = fixed(between(0.2L, 20) * k * apart, 32);
    l->jerk_q32 = fixed(between(0.2L, 100) * k * apart, 32);
    l->vel_min_q32 = -l->vel_max_q32 * (int64_t)(1 + draw() % 4);
    l->acc_min_q32 = -l->acc_max_q32 * (int64_t)(1 + draw() % 4);
}

static void upside_down(struct motion_otg_move *m)
{
    const struct motion_otg_limit l = m->limit;
    m->start.vel_q32 = -m->start.vel_q32;
    m->start.acc_q32 = -m->start.acc_q32;
    m->goal.pos_q32 = -m->goal.pos_q32;
    m->goal.vel_q32 = -m->goal.vel_q32;
    m->goal.acc_q32 = -m->goal.acc_q32;
    m->limit.vel_max_q32 = -l.vel_min_q32;
    m->limit.vel_min_q32 = -l.vel_max_q32;
    m->limit.acc_max_q32 = -l.acc_min_q32;
    m->limit.acc_min_q32 = -l.acc_max_q32;
}

/* At the limit all the time, or below it where nothing shorter counts. */
static long double draw_cruise(struct motion_otg_move *m, long double t)
{
    draw_limits(m, MOTION_OTG_POSITION);
    int64_t v = m->limit.vel_max_q32;
    if (draw() & 1)
        v = (int64_t)((long double)v * draw_unit()) + 1;
    m->start.vel_q32 = m->goal.vel_q32 = v;
    m->goal.pos_q32 = (int64_t)((long double)v * t) + 1;
    return (long double)m->goal.pos_q32 / (long double)v;
}

/* From one acceleration to another of its sign; goals to the nearest public
 * step, or one beside it. */
static long double draw_ramp(struct motion_otg_move *m, long double t)
{
    draw_limits(m, draw() & 1 ? MOTION_OTG_VELOCITY : MOTION_OTG_POSITION);
    int64_t j = m->limit.jerk_q32, most = m->limit.acc_max_q32;
    int64_t step = (int64_t)((long double)j * t) + 1;
    if (step > most / 2)
        step = 1 + (int64_t)(draw() % (uint64_t)(most / 2));
    m->start.acc_q32 = (int64_t)(draw() % (uint64_t)(most - step));
    m->goal.acc_q32 = m->start.acc_q32 + step;
    t = (long double)step / (long double)j;
    if (draw() & 1) {
        int64_t a = m->start.acc_q32;
        m->start.acc_q32 = m->goal.acc_q32;
        m->goal.acc_q32 = a;
    }
    long double a0 = ldexpl((long double)m->start.acc_q32, -32);
    long double a1 = ldexpl((long double)m->goal.acc_q32, -32);
    long double v0 = ldexpl((long double)m->limit.vel_max_q32, -32);
    m->start.vel_q32 = m->limit.vel_max_q32;
    m->goal.vel_q32 = m->start.vel_q32 + fixed((a0 + a1) * t / 2, 32) +
                      (int64_t)(draw() % 3) - 1;
    m->goal.pos_q32 = fixed(v0 * t + (2 * a0 + a1) * t * t / 6, 32);
    m->limit.vel_max_q32 =
        2 * m->goal.vel_q32 + (int64_t)(most / (long double)j * most);
    m->limit.vel_min_q32 = -m->limit.vel_max_q32;
    /* one step of the position in so short a time is as fast as the limit */
    return (long double)m->limit.vel_max_q32 * t < 8 ? 0 : t;
}

/* From one speed to another that differs by no more than the jerk makes in that
 * time, in half of it: at the mean of both. */
static long double draw_change(struct motion_otg_move *m, long double t)
{
    draw_limits(m, MOTION_OTG_POSITION);
    const struct motion_otg_limit *l = &m->limit;
    int64_t v = l->vel_max_q32 - (int64_t)(draw() % 4);
    long double most = (long double)l->jerk_q32 * t * t / 4;
    most = fminl(most, (long double)l->acc_max_q32 * t / 2);
    most = fminl(most, (long double)v / 2);
    int64_t by = (int64_t)(most * draw_unit() * 0.9L);
    m->start.vel_q32 = v - (draw() & 1 ? by : 0);
    m->goal.vel_q32 = m->start.vel_q32 < v ? v : v - by;
    long double mean =
        ((long double)m->start.vel_q32 + (long double)m->goal.vel_q32) / 2;
    m->goal.pos_q32 = (int64_t)(mean * t) + 1;
    return (long double)m->goal.pos_q32 / mean;
}

/* --- no time to spare ------------------------------------------------------ */

struct tally {
    int made, met, residual;
};

static void nearest(struct tally *tally, const struct motion_otg_move *m,
                    long double t)
{
    struct motion_otg_plan plan;
    enum motion_otg_field field;
    int err = motion_otg_make(m, &plan, &field);
    long double most = t * TICKS_PER_S * (1 + 0x1p-10L) + 3;
    if (err < 0)
        fail_msg("%s, %s: %.9Lg s", motion_err_text(err),
                 motion_otg_field_text(field), t);
    const char *wrong = otg_oracle_judge(m, &plan);
    if (wrong == NULL)
        wrong = otg_oracle_judge_track(m, &plan);
    if (wrong != NULL)
        fail_msg("%s: %.9Lg s", wrong, t);
    if ((long double)plan.dur_ns_q12 > most)
        fail_msg("%.9Lg s became %.9Lg s: mode %d start %" PRId64 " %" PRId64
                 " goal %" PRId64 " %" PRId64 " %" PRId64 " limits %" PRId64
                 " %" PRId64 " %" PRId64,
                 t, (long double)plan.dur_ns_q12 / TICKS_PER_S, (int)m->mode,
                 m->start.vel_q32, m->start.acc_q32, m->goal.pos_q32,
                 m->goal.vel_q32, m->goal.acc_q32, m->limit.vel_max_q32,
                 m->limit.acc_max_q32, m->limit.jerk_q32);
    tally->made++;
    tally->residual += (plan.residual_pos_q32 | plan.residual_vel_q32) != 0;
    tally->met += (plan.trim[0] | plan.trim[1]) != 0;
}

static void all_decades(long double (*draw_one)(struct motion_otg_move *,
                                                long double))
{
    for (int decade = -6; decade < 1; decade++) {
        struct tally tally = { 0, 0, 0 };
        for (int i = 0; i < 400; i++) {
            struct motion_otg_move m;
            long double t = powl(10, (long double)decade + draw_unit());
            t = draw_one(&m, t);
            if (t < 1e-9L)
                continue;
            if (i & 1)
                upside_down(&m);
            nearest(&tally, &m, t);
        }
        print_message("1e%+d s: %d in the least time, %d stretched to meet the "
                      "goal, %d with a residual\n",
                      decade, tally.made, tally.met, tally.residual);
    }
}

static void a_cruise_takes_the_nearest_tick(void **state)
{
    (void)state;
    seed_from("cruises");
    all_decades(draw_cruise);
}

static void one_ramp_takes_the_nearest_tick(void **state)
{
    (void)state;
    seed_from("ramps");
    all_decades(draw_ramp);
}

static void a_change_between_two_cruises_takes_the_nearest_tick(void **state)
{
    (void)state;
    seed_from("changes");
    all_decades(draw_change);
}

/* Beside an axis that stands, and one that does the same. */
static void several_axes_take_the_nearest_tick(void **state)
{
    (void)state;
    seed_from("several axes");
    for (int i = 0; i < 2000; i++) {
        struct motion_otg_move m[3];
        struct motion_otg_plan plan[3];
        long double t = powl(10, -6 + 5 * draw_unit());
        t = i & 1 ? draw_cruise(&m[0], t) : draw_change(&m[0], t);
        m[1] = m[2] = m[0];
        m[2].start.vel_q32 = m[2].goal.vel_q32 = m[2].goal.pos_q32 = 0;
        assert_int_equal(motion_sync_make(m, 3, MOTION_SYNC_TIME, plan, NULL),
                         MOTION_OK);
        for (int k = 0; k < 3; k++) {
            const char *wrong = otg_oracle_judge(&m[k], &plan[k]);
            if (wrong != NULL)
                fail_msg("move %d, axis %d: %s", i, k, wrong);
            assert_int_equal(plan[k].dur_ns_q12, plan[0].dur_ns_q12);
        }
        if ((long double)plan[0].dur_ns_q12 >
            t * TICKS_PER_S * (1 + 0x1p-10L) + 3)
            fail_msg("move %d: %.9Lg s became %.9Lg s", i, t,
                     (long double)plan[0].dur_ns_q12 / TICKS_PER_S);
    }
}

/* It never slows down by more than what the last tick is too much: 1 / T of a
 * tick's travel, in dips of a smaller jerk than the limit. */
static void a_cruise_at_its_limit_has_no_notch(void **state)
{
    (void)state;
    seed_from("notches");
    for (int i = 0; i < 400; i++) {
        struct motion_otg_move m;
        struct motion_otg_plan plan;
        struct motion_state at;
        draw_limits(&m, MOTION_OTG_POSITION);
        m.start.vel_q32 = m.goal.vel_q32 = m.limit.vel_max_q32;
        m.goal.pos_q32 =
            (int64_t)((long double)m.limit.vel_max_q32 * between(0.1L, 100));
        assert_int_equal(motion_otg_make(&m, &plan, NULL), MOTION_OK);
        for (int k = 0; k <= 64; k++) {
            motion_otg_state_at(&plan, plan.dur_ns_q12 / 64 * k, &at);
            assert_true(m.limit.vel_max_q32 - at.vel_q32 <=
                        (m.limit.vel_max_q32 >> 36) + 2);
        }
    }
}

/* A residual is what a plan names: one that does not is refused. */
static void a_residual_is_named(void **state)
{
    struct motion_otg_move m = { 0 };
    struct motion_otg_plan plan;
    (void)state;
    m.limit = (struct motion_otg_limit){ (int64_t)1 << 52, -((int64_t)1 << 52),
                                         (int64_t)1 << 36, -((int64_t)1 << 36),
                                         (int64_t)1 << 32, 0 };
    m.start.vel_q32 = m.goal.vel_q32 = m.limit.vel_max_q32;
    m.goal.pos_q32 = ((int64_t)1 << 33) + 12345;
    assert_int_equal(motion_otg_make(&m, &plan, NULL), MOTION_OK);
    assert_int_not_equal(plan.residual_pos_q32, 0);
    assert_int_equal(plan.goal_pos_q32 + plan.residual_pos_q32, m.goal.pos_q32);
    /* ten ticks more, named: 10995.1 steps */
    struct motion_otg_plan late = plan;
    late.phase[0].dur_ns_q12 += 10;
    late.dur_ns_q12 += 10;
    for (int i = 10995; i <= 10996; i++) {
        late.goal_pos_q32 = plan.goal_pos_q32 + i;
        late.residual_pos_q32 = plan.residual_pos_q32 - i;
        assert_int_equal(motion_otg_check(&m, &late, NULL), MOTION_E_LIMIT);
    }
    plan.residual_pos_q32--;
    assert_int_equal(motion_otg_check(&m, &plan, NULL), MOTION_E_LIMIT);
    plan.goal_pos_q32++;
    assert_int_equal(motion_otg_check(&m, &plan, NULL), MOTION_E_LIMIT);
    plan.goal_pos_q32 -= 100000;
    plan.residual_pos_q32 += 100000;
    assert_int_equal(motion_otg_check(&m, &plan, NULL), MOTION_E_LIMIT);
    /* one step back is no residual of standing where one is */
    m.goal.pos_q32 = -1;
    plan = (struct motion_otg_plan){ .start_vel_q32 = m.start.vel_q32,
                                     .goal_vel_q32 = m.goal.vel_q32,
                                     .goal_pos_q32 = -1,
                                     .acc_bits = 32 };
    assert_int_equal(motion_otg_check(&m, &plan, NULL), MOTION_E_LIMIT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cruise_takes_the_nearest_tick),
        cmocka_unit_test(one_ramp_takes_the_nearest_tick),
        cmocka_unit_test(a_change_between_two_cruises_takes_the_nearest_tick),
        cmocka_unit_test(several_axes_take_the_nearest_tick),
        cmocka_unit_test(a_cruise_at_its_limit_has_no_notch),
        cmocka_unit_test(a_residual_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
