/* tests/motion/curve/test_spline_local.c - monotone, Akima,
 * Kochanek-Bartels. */
#include "tests/support/spline_keys.h"

static void append_cubic(uint32_t n)
{
    start_track();
    assert_int_equal(0, motion_spline_append_cubic(&track, key, n, NULL));
}

/* Every span stays between its two keys, but for what its integers round. */
static void assert_no_overshoot(uint32_t n)
{
    for (uint32_t i = 0; i + 1 < n; i++) {
        const int64_t a = key[i].pos_q32, b = key[i + 1].pos_q32;
        struct motion_extreme e;
        motion_segment_extreme(&storage[i], MOTION_POS, &e);
        if (e.min < (a < b ? a : b) - 2 || e.max > (a < b ? b : a) + 2)
            fail_msg("span %u of %u: %" PRId64 " .. %" PRId64
                     " between %" PRId64 " and %" PRId64,
                     (unsigned)i, (unsigned)n, e.min, e.max, a, b);
    }
}

static const enum motion_spline_end rules[] = { MOTION_SPLINE_REST,
                                                MOTION_SPLINE_ONE_SIDED };

static void monotone_never_overshoots(void **state)
{
    (void)state;
    seed_from("monotone");
    for (int round = 0; round < 2000; round++) {
        const uint32_t n = 1 + (uint32_t)(draw() % (KEYS - 1));

        draw_keys(n, 2);
        if (round % 2)
            for (uint32_t i = 1; i < n; i++) /* rising, with plateaus */
                key[i].pos_q32 = key[i - 1].pos_q32 +
                                 (draw() % 3 ? (int64_t)(draw() >> 28) : 0);
        assert_int_equal(0, motion_spline_monotone(key, n, rules[draw() % 2],
                                                   rules[draw() % 2]));
        append_cubic(n);
        assert_no_overshoot(n);
        assert_keys_hit(n);
    }
}

static void akima_limited_never_overshoots(void **state)
{
    bool swung = false;

    (void)state;
    seed_from("akima");
    for (int round = 0; round < 2000; round++) {
        const uint32_t n = 1 + (uint32_t)(draw() % (KEYS - 1));
        struct motion_real before[KEYS];

        draw_keys(n, 1);
        assert_int_equal(0, motion_spline_akima(key, n, MOTION_SPLINE_ONE_SIDED,
                                                MOTION_SPLINE_ONE_SIDED));
        for (uint32_t i = 0; i < n; i++)
            before[i] = key[i].vel;
        assert_int_equal(0, motion_spline_limit_overshoot(key, n));
        for (uint32_t i = 0; i < n; i++)
            swung |= value(before[i]) != vel(i);
        append_cubic(n);
        assert_no_overshoot(n);
    }
    assert_true(swung); /* plain Akima does */
}

/* p = |t - 2|: where two lines meet the mean of the two; on them, they. */
static void akima_keeps_straight_parts_straight(void **state)
{
    (void)state;
    memset(key, 0, sizeof key);
    for (int i = 0; i < 7; i++)
        key[i] = (struct motion_key){ .t_ns_q12 = i * SEC,
                                      .pos_q32 = llabs(i - 3) * ONE };
    assert_int_equal(0, motion_spline_akima(key, 7, MOTION_SPLINE_ONE_SIDED,
                                            MOTION_SPLINE_ONE_SIDED));
    for (uint32_t i = 0; i < 7; i++)
        assert_equal_to(vel(i), i < 3 ? -1 : i > 3 ? 1 : 0, 1, "velocity");
    assert_int_equal(
        0, motion_spline_akima(key, 7, MOTION_SPLINE_REST, MOTION_SPLINE_REST));
    assert_true(vel(0) == 0 && vel(6) == 0);
}

static void given_velocities_are_kept(void **state)
{
    (void)state;
    seed_from("given");
    draw_keys(6, 1);
    key[2].has_vel = true;
    key[2].vel = motion_real_int(12345);
    assert_int_equal(0, motion_spline_monotone(key, 6, MOTION_SPLINE_REST,
                                               MOTION_SPLINE_REST));
    assert_true(vel(2) == 12345);
    assert_int_equal(
        0, motion_spline_akima(key, 6, MOTION_SPLINE_REST, MOTION_SPLINE_REST));
    assert_int_equal(0, motion_spline_limit_overshoot(key, 6));
    assert_true(vel(2) == 12345);
}

static void refusals(void **state)
{
    (void)state;
    seed_from("refusals");
    draw_keys(4, 1);
    assert_int_equal(MOTION_E_ARG,
                     motion_spline_monotone(key, 4, MOTION_SPLINE_NATURAL,
                                            MOTION_SPLINE_REST));
    assert_int_equal(MOTION_E_ARG,
                     motion_spline_akima(key, 4, MOTION_SPLINE_REST,
                                         MOTION_SPLINE_PERIODIC));
    assert_int_equal(
        MOTION_E_EMPTY,
        motion_spline_akima(key, 0, MOTION_SPLINE_REST, MOTION_SPLINE_REST));
    key[2].t_ns_q12 = key[1].t_ns_q12;
    assert_int_equal(
        MOTION_E_ORDER,
        motion_spline_monotone(key, 4, MOTION_SPLINE_REST, MOTION_SPLINE_REST));
    assert_int_equal(MOTION_E_ORDER, motion_spline_limit_overshoot(key, 4));
}

static int kochanek(uint32_t n, double t, double c, double b,
                    enum motion_spline_end end)
{
    const struct motion_spline_kochanek shape = { (int64_t)(t * ONE),
                                                  (int64_t)(c * ONE),
                                                  (int64_t)(b * ONE) };

    start_track();
    return motion_spline_append_kochanek(&track, key, n, &shape, end, end,
                                         NULL);
}

static void kochanek_of_zero_is_cardinal_of_one(void **state)
{
    static struct motion_segment kept[KEYS];

    (void)state;
    seed_from("kochanek");
    for (int round = 0; round < 300; round++) {
        const uint32_t n = 2 + (uint32_t)(draw() % (KEYS - 2));
        const double tension = round % 3 * 0.25;
        const enum motion_spline_end end = (enum motion_spline_end)(draw() % 3);

        if (n == 2 && end == MOTION_SPLINE_NATURAL)
            continue;
        draw_keys(n, 1);
        assert_int_equal(0, kochanek(n, tension, 0, 0, end));
        memcpy(kept, storage, sizeof kept);
        assert_int_equal(0,
                         motion_spline_tangents_cardinal(
                             key, n, (int64_t)((1 - tension) * ONE), end, end));
        append_cubic(n);
        for (uint32_t i = 0; i + 1 < n; i++)
            for (int k = 0; k <= 3; k++)
                assert_equal_to((long double)storage[i].coef[k],
                                (long double)kept[i].coef[k], ldexpl(1, 62),
                                "coefficient");
    }
}

/* Key 1 of 0, 6, 9 at 0, 1, 3 s: d0 = 6, d1 = 3, h0 + h1 = 3. */
static void kochanek_matches_hand_values(void **state)
{
    static const struct {
        double t, c, b, in, out;
    } rows[] = {
        { 0, 0, 0, 3, 3 },
        { 1, 0, 0, 0, 0 },
        { 0, 0, 1, 4, 4 },
        { 0, 0, -1, 2, 2 },
        { 0, 1, 0, 2, 4 },
        { 0, -1, 0, 4, 2 },
        { 0.5, 0.5, 0.5, 1.125, 2.375 },
    };

    (void)state;
    memset(key, 0, sizeof key);
    key[1] = (struct motion_key){ .t_ns_q12 = SEC, .pos_q32 = 6 * ONE };
    key[2] = (struct motion_key){ .t_ns_q12 = 3 * SEC, .pos_q32 = 9 * ONE };
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct motion_state in, out;
        assert_int_equal(0, kochanek(3, rows[i].t, rows[i].c, rows[i].b,
                                     MOTION_SPLINE_ONE_SIDED));
        motion_segment_state(&storage[0], SEC, &in);
        motion_segment_state(&storage[1], 0, &out);
        if (llabs(in.vel_q32 - (int64_t)(rows[i].in * ONE)) > 4 ||
            llabs(out.vel_q32 - (int64_t)(rows[i].out * ONE)) > 4)
            fail_msg("row %zu: in %.9g out %.9g", i, (double)in.vel_q32 / ONE,
                     (double)out.vel_q32 / ONE);
    }
    assert_int_equal(MOTION_E_ARG, kochanek(3, 1.01, 0, 0, MOTION_SPLINE_REST));
    assert_int_equal(MOTION_E_ARG,
                     kochanek(3, 0, -1.01, 0, MOTION_SPLINE_REST));
    assert_int_equal(MOTION_E_ARG,
                     kochanek(3, 0, 0, 0, MOTION_SPLINE_PERIODIC));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(monotone_never_overshoots),
        cmocka_unit_test(akima_limited_never_overshoots),
        cmocka_unit_test(akima_keeps_straight_parts_straight),
        cmocka_unit_test(given_velocities_are_kept),
        cmocka_unit_test(refusals),
        cmocka_unit_test(kochanek_of_zero_is_cardinal_of_one),
        cmocka_unit_test(kochanek_matches_hand_values),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
