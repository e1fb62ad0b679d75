/* tests/motion/otg/test_otg_oracle.c - the judge of plans, judged: plans that
 * touch their limits to the last bit, and good plans spoilt in every field. */
#include <inttypes.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/motion/otg/otg_many.h"
#include "tests/motion/otg/otg_oracle.h"
#include "tests/support/big.h"
#include "tests/support/check.h"

#define ONE    MOTION_FIXED_ONE_Q32
#define ACC    MOTION_FIXED_ONE_Q32
#define SECOND MOTION_FIXED_S_Q12

/* --- by hand: whole seconds, so every number is exact --------------------- */

/* Up and down again with a jerk of 60: v peaks at 60 after two seconds, and
 * again at -60; 120 units in four seconds. */
static const struct motion_otg_move there = {
    .goal.pos_q32 = 120 * ONE,
    .limit = { 60 * ONE, -ONE, 60 * ACC, -60 * ACC, 60 * ACC, 0 },
};
static const struct motion_otg_plan there_plan = {
    .dur_ns_q12 = 4 * SECOND,
    .goal_pos_q32 = 120 * ONE,
    .acc_bits = 32,
    .count = 4,
    .turn = 4,
    .phase = { { SECOND, 60 * ACC },
               { SECOND, 0 },
               { SECOND, -60 * ACC },
               { SECOND, 0 } },
};

/* The peak of 60 a third into the second phase: no halving finds it. */
static const struct motion_otg_move third = {
    .goal = { -180 * ONE, -180 * ONE, 0, 0 },
    .limit = { 60 * ONE, -180 * ONE, 60 * ACC, -120 * ACC, 60 * ACC, 0 },
};
static const struct motion_otg_plan third_plan = {
    .dur_ns_q12 = 6 * SECOND,
    .goal_pos_q32 = -180 * ONE,
    .goal_vel_q32 = -180 * ONE,
    .acc_bits = 32,
    .count = 3,
    .turn = 3,
    .phase = { { SECOND, 60 * ACC },
               { 3 * SECOND, -120 * ACC },
               { 2 * SECOND, 0 } },
};

static void expect(const struct motion_otg_move *m,
                   const struct motion_otg_plan *plan, const char *want)
{
    const char *wrong = otg_oracle_judge(m, plan);
    if (want == NULL ? wrong != NULL
                     : wrong == NULL || strcmp(wrong, want) != 0)
        fail_msg("\"%s\", expected \"%s\"", wrong ? wrong : "good",
                 want ? want : "good");
}

static void a_plan_on_its_limits_is_good(void **state)
{
    const long before = big_poly_counted;
    (void)state;
    expect(&there, &there_plan, NULL);
    assert_int_equal(big_poly_counted, before);
    expect(&third, &third_plan, NULL);
    assert_true(big_poly_counted > before);
}

static void one_unit_less_of_any_limit_is_broken(void **state)
{
    static const struct {
        size_t offset;
        int64_t less;
        const char *want;
    } rows[] = {
        { offsetof(struct motion_otg_limit, vel_max_q32), 1, "velocity" },
        { offsetof(struct motion_otg_limit, vel_min_q32), -1, "velocity" },
        { offsetof(struct motion_otg_limit, acc_max_q32), 1, "acceleration" },
        { offsetof(struct motion_otg_limit, acc_min_q32), -1, "acceleration" },
        { offsetof(struct motion_otg_limit, jerk_q32), 1, "jerk" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        for (int k = 0; k < 2; k++) {
            struct motion_otg_move m = k ? third : there;
            int64_t *limit = (void *)((char *)&m.limit + rows[i].offset);
            *limit -= rows[i].less;
            bool slack = k == 0 && i == 1; /* there never goes back */
            expect(&m, k ? &third_plan : &there_plan,
                   slack ? NULL : rows[i].want);
        }
}

static void the_jerk_of_slowing_down_is_that_of_its_phases(void **state)
{
    struct motion_otg_move m = there;
    struct motion_otg_plan plan = there_plan;
    (void)state;
    m.limit.jerk_down_q32 = 61 * ACC;
    plan.turn = 2;
    expect(&m, &plan, NULL);
    m.limit.jerk_down_q32 = 60 * ACC - 1;
    expect(&m, &plan, "jerk");
    m.limit.jerk_q32 = 59 * ACC; /* the first half is too steep, whoever says */
    m.limit.jerk_down_q32 = 60 * ACC;
    expect(&m, &plan, "jerk");
    plan.turn = 1;
    expect(&m, &plan, "turn");
    plan.turn = 5;
    expect(&m, &plan, "turn");
}

/* The velocity peaks in phase 1 and goes to the goal from there, beyond where
 * it has been; between brake and turn the lower jerk keeps both limits. */
static void a_turn_may_be_claimed_late(void **state)
{
    struct motion_otg_move m = third;
    struct motion_otg_plan plan = third_plan;
    (void)state;
    m.limit.jerk_down_q32 = 61 * ACC;
    for (plan.turn = 1; plan.turn <= 3; plan.turn++)
        expect(&m, &plan, NULL);
    plan.turn = 0;
    expect(&m, &plan, "turn");
    m.limit.jerk_down_q32 = 60 * ACC;
    m.limit.jerk_q32 = 61 * ACC;
    expect(&m, &plan, NULL);
}

/* v0 = 50 at a0 = 60 can only peak at 80; from then on 60 is the limit. */
static void only_the_start_may_be_outside(void **state)
{
    struct motion_otg_move m = there;
    struct motion_otg_plan plan = {
        .dur_ns_q12 = 4 * SECOND,
        .start_vel_q32 = 50 * ONE,
        .start_acc = 60 * ACC,
        .acc_bits = 32,
        .count = 3,
        .turn = 3,
        .phase = { { 2 * SECOND, -60 * ACC },
                   { SECOND, -30 * ACC },
                   { SECOND, 0 } },
    };
    (void)state;
    /* v 50, 50 (peak 80), 5, -10; p 70 + 50 + ..., what it comes to */
    m.start.vel_q32 = 50 * ONE;
    m.start.acc_q32 = 60 * ACC;
    m.goal.vel_q32 = plan.goal_vel_q32 = -10 * ONE;
    m.limit.vel_min_q32 = -10 * ONE;
    m.goal.pos_q32 = plan.goal_pos_q32 = 160 * ONE;
    expect(&m, &plan, NULL);
    m.limit.vel_min_q32++;
    expect(&m, &plan, "velocity");
    m.limit.vel_min_q32--;
    m.limit.vel_max_q32 = 49 * ONE; /* outside at the end of the phase, too */
    expect(&m, &plan, NULL);
    m.limit.acc_max_q32 = 59 * ACC; /* but nothing was braked */
    expect(&m, &plan, "acceleration");
    plan.brake = 1;
    expect(&m, &plan, NULL);
    m.limit.acc_min_q32 = -59 * ACC;
    expect(&m, &plan, "acceleration");
}

/* A plan cannot claim the higher jerk of slowing down from its start on: from
 * rest to rest, or to go on faster. */
static void the_highest_speed_is_before_the_turn(void **state)
{
    const int64_t start_vel[] = { 0, 10 * ONE };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(start_vel); i++) {
        struct motion_otg_move m = {
            .start.vel_q32 = start_vel[i],
            .goal.pos_q32 = 500 * ONE,
            .limit = { 90 * ONE, -90 * ONE, 50 * ACC, -50 * ACC, 80 * ACC, 0 },
        };
        struct motion_otg_plan plan;
        assert_int_equal(motion_otg_make(&m, &plan, NULL), MOTION_OK);
        m.limit.jerk_down_q32 = 80 * ACC;
        m.limit.jerk_q32 = 20 * ACC;
        expect(&m, &plan, "jerk");
        plan.brake = plan.turn = 0;
        expect(&m, &plan, "turn");
    }
}

/* --- what a track lays on one phase ---------------------------------------- */

static int64_t about(int bits)
{
    return (int64_t)((draw() | (uint64_t)1 << 63) >> (63 - bits));
}

/* An hour at the limit of velocity, after accelerations that cover its length
 * in microseconds: their last unit is a part of the limit that counts, and the
 * goal leaves no margin for it. */
static void a_track_keeps_its_limits_to_a_goal_on_them(void **state)
{
    (void)state;
    seed_from("goals on their limit");
    for (int i = 0; i < 1000; i++) {
        struct motion_otg_move m = { 0 };
        struct motion_otg_plan plan;
        m.limit.vel_max_q32 = about(38);
        m.limit.vel_min_q32 = -about(36);
        m.limit.acc_max_q32 = about(51);
        m.limit.acc_min_q32 = -about(51);
        m.limit.jerk_q32 = about(59);
        m.start.acc_q32 = m.limit.acc_min_q32 + about(49);
        m.goal.vel_q32 = m.limit.vel_max_q32;
        assert_int_equal(motion_otg_make(&m, &plan, NULL), MOTION_OK);
        const char *wrong = otg_oracle_judge_track(&m, &plan);
        if (wrong != NULL)
            fail_msg("move %d: %s", i, wrong);
    }
}

/* --- good plans, spoilt --------------------------------------------------- */

static void spoilt(const struct motion_otg_move *m,
                   const struct motion_otg_plan *plan, const char *how,
                   uint64_t n)
{
    if (otg_oracle_judge(m, plan) == NULL)
        fail_msg("problem %" PRIu64 ", %s: not seen", n, how);
}

#define SPOIL(field, by)                                                       \
    do {                                                                       \
        struct motion_otg_plan bad = *plan;                                    \
        bad.field += (by);                                                     \
        spoilt(m, &bad, #field, n);                                            \
    } while (0)

static void spoil_ends(const struct motion_otg_move *m,
                       const struct motion_otg_plan *plan, uint64_t n)
{
    for (int by = -1; by <= 1; by += 2) {
        SPOIL(start_pos_q32, by);
        SPOIL(start_vel_q32, by);
        SPOIL(goal_pos_q32, by);
        SPOIL(goal_vel_q32, by);
        SPOIL(start_acc, by);
        SPOIL(dur_ns_q12, by);
        SPOIL(acc_bits, by);
        SPOIL(phase[plan->count - 1].acc, by);
    }
    SPOIL(count, -1);
    SPOIL(count, MOTION_OTG_PHASES);
}

/* Every corner by what the goal's velocity shows: some units of 2^-32 unit/s,
 * and of what the trimmed corners may leave. */
static void spoil_corners(const struct motion_otg_move *m,
                          const struct motion_otg_plan *plan, uint64_t n)
{
    for (int i = 0; i + 1 < plan->count; i++)
        for (int by = -1; by <= 1; by += 2) {
            int64_t most = 1;
            for (int k = 0; k < plan->count; k++)
                if (most < plan->phase[k].dur_ns_q12)
                    most = plan->phase[k].dur_ns_q12;
            int64_t here = plan->phase[i].dur_ns_q12;
            int bits = 8; /* W is below 48 of the longest */
            while (bits < 60 && here < most >> bits)
                bits++;
            bits += 7;
            int unit = plan->acc_bits - 10 + 22; /* of V, times 5^9 < 2^22 */
            for (int64_t t = here; t > 0; t >>= 1)
                unit--;
            bits = unit > bits ? unit : bits;
            if (bits > 58)
                continue;
            SPOIL(phase[i].acc, by * ((int64_t)1 << bits));
        }
}

/* A tick taken from every phase, or moved to the next one with the end left
 * where it was said to be. */
static void spoil_times(const struct motion_otg_move *m,
                        const struct motion_otg_plan *plan, uint64_t n)
{
    for (int i = 0; i < plan->count; i++) {
        SPOIL(phase[i].dur_ns_q12, 1);
        SPOIL(phase[i].dur_ns_q12, -1);
        SPOIL(phase[i].dur_ns_q12, -plan->phase[i].dur_ns_q12);
        SPOIL(phase[i].dur_ns_q12, -2 * plan->phase[i].dur_ns_q12);
    }
}

static void one_unit_off_is_seen(void **state)
{
    int plans = 0;
    (void)state;
    for (uint64_t n = 0; n < 400; n++) {
        struct many_problem p;
        struct motion_otg_plan plan;
        many_draw(42, n * MANY_KINDS + MANY_FULL, &p);
        struct motion_otg_move *m = &p.move[0];
        if (motion_otg_make(m, &plan, NULL) != MOTION_OK || plan.count == 0 ||
            otg_oracle_judge(m, &plan) != NULL)
            continue;
        spoil_ends(m, &plan, n);
        spoil_times(m, &plan, n);
        spoil_corners(m, &plan, n);
        plans++;
    }
    assert_true(plans > 350);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_plan_on_its_limits_is_good),
        cmocka_unit_test(one_unit_less_of_any_limit_is_broken),
        cmocka_unit_test(the_jerk_of_slowing_down_is_that_of_its_phases),
        cmocka_unit_test(only_the_start_may_be_outside),
        cmocka_unit_test(a_turn_may_be_claimed_late),
        cmocka_unit_test(the_highest_speed_is_before_the_turn),
        cmocka_unit_test(a_track_keeps_its_limits_to_a_goal_on_them),
        cmocka_unit_test(one_unit_off_is_seen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
