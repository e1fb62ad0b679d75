/* tests/motion/curve/test_spline_c2.c - what makes a cubic spline C2, in long
 * double. */
#include "tests/support/spline_keys.h"

static struct motion_spline_work work[KEYS];

/* Acceleration of span i's cubic at its start and end, and its jerk. */
static long double acc_start(uint32_t i)
{
    return (6 * displacement(i) / span(i) - 4 * vel(i) - 2 * vel(i + 1)) /
           span(i);
}

static long double acc_end(uint32_t i)
{
    return (2 * vel(i) + 4 * vel(i + 1) - 6 * displacement(i) / span(i)) /
           span(i);
}

static long double jerk(uint32_t i)
{
    return 6 * (vel(i) + vel(i + 1) - 2 * displacement(i) / span(i)) /
           (span(i) * span(i));
}

/* What terms of an acceleration on span i amount to. */
static long double size(uint32_t i)
{
    return (6 * fabsl(displacement(i) / span(i)) + 4 * fabsl(vel(i)) +
            4 * fabsl(vel(i + 1)) + 1) /
           span(i);
}

static void assert_smooth(uint32_t i)
{
    assert_equal_to(acc_end(i - 1), acc_start(i), size(i - 1) + size(i),
                    "acceleration at a key");
}

static const enum motion_spline_end rules[] = { MOTION_SPLINE_REST,
                                                MOTION_SPLINE_NATURAL,
                                                MOTION_SPLINE_NOT_A_KNOT };

static void assert_end(enum motion_spline_end rule, uint32_t k,
                       long double acceleration, uint32_t outer, uint32_t next)
{
    if (rule == MOTION_SPLINE_REST)
        assert_true(vel(k) == 0);
    else if (rule == MOTION_SPLINE_NATURAL)
        assert_equal_to(acceleration, 0, size(outer), "natural");
    else
        assert_equal_to(jerk(outer), jerk(next),
                        size(outer) / span(outer) + size(next) / span(next),
                        "not a knot");
}

static void acceleration_is_continuous_and_ends_keep_their_rule(void **state)
{
    (void)state;
    seed_from("c2");
    for (int round = 0; round < 3000; round++) {
        const uint32_t n = 4 + (uint32_t)(draw() % (KEYS - 4));
        const enum motion_spline_end first = rules[draw() % 3];
        const enum motion_spline_end last = rules[draw() % 3];

        draw_keys(n, 1.5L);
        assert_int_equal(0, motion_spline_c2(key, n, first, last, work));
        for (uint32_t i = 1; i + 1 < n; i++)
            assert_smooth(i);
        assert_end(first, 0, acc_start(0), 0, 1);
        assert_end(last, n - 1, acc_end(n - 2), n - 2, n - 3);
        start_track();
        assert_int_equal(0, motion_spline_append_cubic(&track, key, n, NULL));
        assert_keys_hit(n);
    }
}

static void given_velocities_and_accelerations_are_met(void **state)
{
    (void)state;
    seed_from("c2 given");
    for (int round = 0; round < 1000; round++) {
        const uint32_t n = 2 + (uint32_t)(draw() % (KEYS - 2));
        const bool first_vel = draw() & 1, last_vel = draw() & 1;

        draw_keys(n, 1);
        key[0].has_vel = first_vel;
        key[0].has_acc = true;
        key[0].vel = motion_real_int(-7);
        key[0].acc = motion_real_int(90);
        key[n - 1].has_vel = last_vel;
        key[n - 1].has_acc = !last_vel;
        key[n - 1].vel = motion_real_int(11);
        key[n - 1].acc = motion_real_int(-50);
        assert_int_equal(0, motion_spline_c2(key, n, MOTION_SPLINE_NATURAL,
                                             MOTION_SPLINE_REST, work));
        for (uint32_t i = 1; i + 1 < n; i++)
            assert_smooth(i);
        if (first_vel)
            assert_equal_to(vel(0), -7, 1, "first velocity");
        else
            assert_equal_to(acc_start(0), 90, size(0), "first acceleration");
        if (last_vel)
            assert_equal_to(vel(n - 1), 11, 1, "last velocity");
        else
            assert_equal_to(acc_end(n - 2), -50, size(n - 2),
                            "last acceleration");
    }
}

static void a_given_velocity_inside_parts_the_curve(void **state)
{
    (void)state;
    seed_from("c2 inside");
    draw_keys(9, 1);
    key[4].has_vel = true;
    key[4].vel = motion_real_int(3);
    assert_int_equal(0, motion_spline_c2(key, 9, MOTION_SPLINE_NATURAL,
                                         MOTION_SPLINE_NATURAL, work));
    assert_true(vel(4) == 3);
    for (uint32_t i = 1; i < 8; i++)
        if (i != 4)
            assert_smooth(i);
}

static void periodic_closes_without_a_seam(void **state)
{
    (void)state;
    seed_from("periodic");
    for (int round = 0; round < 2000; round++) {
        const uint32_t n = 2 + (uint32_t)(draw() % (KEYS - 2));

        draw_keys(n, 1.5L);
        key[n - 1].pos_q32 = key[0].pos_q32;
        assert_int_equal(0, motion_spline_c2(key, n, MOTION_SPLINE_PERIODIC,
                                             MOTION_SPLINE_PERIODIC, work));
        for (uint32_t i = 1; i + 1 < n; i++)
            assert_smooth(i);
        assert_true(vel(0) == vel(n - 1));
        assert_equal_to(acc_start(0), acc_end(n - 2), size(0) + size(n - 2),
                        "seam");
    }
}

static void few_keys_give_the_curve_that_is_left(void **state)
{
    (void)state;
    memset(key, 0, sizeof key);
    key[1] = (struct motion_key){ .t_ns_q12 = SEC, .pos_q32 = 3 * ONE };
    key[2] = (struct motion_key){ .t_ns_q12 = 3 * SEC, .pos_q32 = 15 * ONE };
    /* p = 2 t + t^2 */
    assert_int_equal(0, motion_spline_c2(key, 3, MOTION_SPLINE_NOT_A_KNOT,
                                         MOTION_SPLINE_NOT_A_KNOT, work));
    for (uint32_t i = 0; i < 3; i++)
        assert_equal_to(vel(i), 2 + 2 * (i == 2 ? 3 : (long double)i), 8,
                        "parabola");
    /* two keys: the line */
    assert_int_equal(0, motion_spline_c2(key, 2, MOTION_SPLINE_NOT_A_KNOT,
                                         MOTION_SPLINE_NATURAL, work));
    assert_equal_to(vel(0), 3, 3, "line");
    assert_equal_to(vel(1), 3, 3, "line");
    assert_int_equal(0, motion_spline_c2(key, 1, MOTION_SPLINE_NATURAL,
                                         MOTION_SPLINE_NATURAL, work));
    assert_true(vel(0) == 0);
}

static void what_is_no_spline_is_refused(void **state)
{
    static const struct {
        const char *name;
        uint32_t count;
        int64_t t1, pos1;
        int first, last, want;
    } rows[] = {
        { "no keys", 0, SEC, 0, 0, 0, MOTION_E_EMPTY },
        { "equal times", 3, 0, 0, 0, 0, MOTION_E_ORDER },
        { "out of order", 3, 3 * SEC, 0, 0, 0, MOTION_E_ORDER },
        { "too steep", 3, 1, ONE, MOTION_SPLINE_NATURAL, 0, MOTION_E_RANGE },
        { "one-sided is none of its rules", 3, SEC, 0, MOTION_SPLINE_ONE_SIDED,
          0, MOTION_E_ARG },
        { "half periodic", 3, SEC, 0, MOTION_SPLINE_PERIODIC, 0, MOTION_E_ARG },
        { "periodic without a ring", 2, SEC, ONE, MOTION_SPLINE_PERIODIC,
          MOTION_SPLINE_PERIODIC, MOTION_E_ARG },
        { "no such rule", 3, SEC, 0, 9, 0, MOTION_E_ARG },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        memset(key, 0, sizeof key);
        key[1].t_ns_q12 = rows[i].t1;
        key[1].pos_q32 = rows[i].pos1;
        key[2].t_ns_q12 = 2 * SEC;
        const int rc = motion_spline_c2(
            key, rows[i].count, (enum motion_spline_end)rows[i].first,
            (enum motion_spline_end)rows[i].last, work);
        if (rc != rows[i].want)
            fail_msg("%s: %d", rows[i].name, rc);
    }
}

static void a_million_keys_are_planned(void **state)
{
    const uint32_t n = 1000000;
    struct motion_key *keys = calloc(n, sizeof *keys);
    struct motion_spline_work *space = calloc(n, sizeof *space);

    (void)state;
    assert_non_null(keys);
    assert_non_null(space);
    for (uint32_t i = 0; i < n; i++) {
        keys[i].t_ns_q12 = (int64_t)i * SEC / 10;
        keys[i].pos_q32 = (int64_t)(i * 2654435761u % 1000) * ONE;
    }
    assert_int_equal(0, motion_spline_c2(keys, n, MOTION_SPLINE_NATURAL,
                                         MOTION_SPLINE_NATURAL, space));
    /* the last ones are smooth too */
    memcpy(key, &keys[n - KEYS], sizeof key);
    for (uint32_t i = 1; i + 1 < KEYS; i++)
        assert_smooth(i);
    free(keys);
    free(space);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(acceleration_is_continuous_and_ends_keep_their_rule),
        cmocka_unit_test(given_velocities_and_accelerations_are_met),
        cmocka_unit_test(a_given_velocity_inside_parts_the_curve),
        cmocka_unit_test(periodic_closes_without_a_seam),
        cmocka_unit_test(few_keys_give_the_curve_that_is_left),
        cmocka_unit_test(what_is_no_spline_is_refused),
        cmocka_unit_test(a_million_keys_are_planned),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
