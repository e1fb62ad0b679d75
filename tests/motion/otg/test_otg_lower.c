/* tests/motion/otg/test_otg_lower.c - a lower limit of velocity, given in
 * motion.
 *
 * A velocity above its limit comes down to it, and stays there: ramping
 * the deceleration does not take it below, nor turn the motion round. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>

#include "motion/core/err.h"
#include "motion/otg/replan.h"
#include "tests/motion/otg/otg_oracle.h"
#include "tests/support/check.h"

static long double between(long double low, long double high)
{
    return low * powl(high / low, draw_unit());
}

static int64_t fixed(long double value, int bits)
{
    return (int64_t)roundl(ldexpl(value, bits));
}

static void draw_limits(struct motion_otg_move *m)
{
    static const long double unit[] = { 1, 1e3L, 1e-3L };
    long double k = unit[draw() % ARRAY_LEN(unit)];
    long double apart = between(1 / 32.0L, 32);
    struct motion_otg_limit *l = &m->limit;
    *m = (struct motion_otg_move){ 0 };
    l->vel_max_q32 = fixed(between(0.1L, 10) * k, 32);
    l->acc_max_q32 = fixed(between(0.2L, 20) * k * apart, 32);
    l->jerk_q32 = fixed(between(0.2L, 100) * k * apart, 32);
    l->vel_min_q32 = -l->vel_max_q32 * (int64_t)(1 + draw() % 4);
    l->acc_min_q32 = -l->acc_max_q32 * (int64_t)(1 + draw() % 4);
}

/* The velocity at any of 500 times before the last ramp begins is 2^-9 of the
 * limit below it at most. */
static void stays_near(const struct motion_otg_move *m,
                       const struct motion_otg_plan *plan, int number)
{
    struct motion_state at;
    int64_t cruise = 0, t = 0, limit = m->limit.vel_max_q32;
    for (int i = 0; i < plan->count; i++) {
        if (plan->phase[i].dur_ns_q12 > plan->dur_ns_q12 / 4)
            cruise = t + plan->phase[i].dur_ns_q12;
        t += plan->phase[i].dur_ns_q12;
    }
    assert_true(cruise > 0);
    for (int k = 0; k < 500; k++) {
        motion_otg_state_at(plan, (int64_t)((long double)cruise * k / 500),
                            &at);
        if (at.vel_q32 < limit - (limit >> 9) - 4)
            fail_msg("move %d: %.9Lg of the limit", number,
                     (long double)at.vel_q32 / (long double)limit);
    }
}

static void a_lower_limit_is_come_to_without_turning_round(void **state)
{
    (void)state;
    seed_from("lower limits");
    for (int i = 0; i < 1000; i++) {
        struct motion_otg_move m;
        struct motion_otg_plan plan;
        draw_limits(&m);
        struct motion_otg_limit *l = &m.limit;
        long double v = ldexpl((long double)l->vel_max_q32, -32);
        long double a = ldexpl((long double)l->acc_max_q32, -32);
        long double j = ldexpl((long double)l->jerk_q32, -32);
        long double v0 = v * between(1.001L, 30);
        long double a0 = draw() & 1 ? 0 : a * draw_unit();
        long double top = v0 + a0 * a0 / (2 * j);
        long double t = top / a + a / j + sqrtl(top / j);
        m.start.vel_q32 = fixed(v0, 32);
        m.start.acc_q32 = fixed(a0, 32);
        if (20 * top * t > 1e9L)
            continue;
        m.goal.pos_q32 = fixed(20 * top * t + v, 32);
        int err = motion_otg_make(&m, &plan, NULL);
        if (err == MOTION_E_RANGE)
            continue; /* over three days */
        assert_int_equal(err, MOTION_OK);
        assert_null(otg_oracle_judge(&m, &plan));
        stays_near(&m, &plan, i);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_lower_limit_is_come_to_without_turning_round),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
