/* tests/motion/curve/test_spline_shapes.c - corners, B-splines, Lagrange,
 * constraints, times for points in space. */
#include "motion/curve/bake_poly.h"
#include "tests/support/spline_keys.h"

static struct motion_spline_work work[KEYS];

static long double at(int64_t t, int order)
{
    struct motion_state s;

    if (t >= track.end_ns_q12)
        motion_segment_state(&track.segment[track.count - 1],
                             track.segment[track.count - 1].dur_ns_q12, &s);
    else
        motion_track_state(&track, t, &s);
    return order == 0   ? ldexpl((long double)s.pos_q32, -32)
           : order == 1 ? ldexpl((long double)s.vel_q32, -32)
                        : ldexpl((long double)s.acc_q32, -32);
}

/* --- corners ---------------------------------------------------------------- */

static const enum motion_spline_end corner_rules[] = {
    MOTION_SPLINE_REST, MOTION_SPLINE_ONE_SIDED
};

static void blends_make_speed_and_acceleration_continuous(void **state)
{
    (void)state;
    seed_from("blend");
    for (int round = 0; round < 1000; round++) {
        const uint32_t n = 2 + (uint32_t)(draw() % (KEYS - 2));
        const bool smooth = round & 1;
        const enum motion_spline_end end = corner_rules[draw() % 2];
        struct motion_continuity step;

        draw_keys(n, 1);
        start_track();
        assert_int_equal(0, motion_spline_append_blended(
                                &track, key, n,
                                1 + (int64_t)(draw() % (uint64_t)SEC), smooth,
                                end, end, NULL));
        assert_int_equal(track.end_ns_q12,
                         key[n - 1].t_ns_q12 - key[0].t_ns_q12);
        assert_int_equal(track.end.pos_q32, key[n - 1].pos_q32);
        assert_true(track.count <= 2 * n);
        if (end != MOTION_SPLINE_REST)
            continue;
        motion_track_continuity(&track, &step);
        int64_t shortest = SEC;
        for (uint32_t i = 0; i < track.count; i++)
            if (storage[i].dur_ns_q12 < shortest)
                shortest = storage[i].dur_ns_q12;
        const double rate = (double)SEC / (double)shortest;
        if ((double)step.vel_step_q32 > 8 + 8 * rate)
            fail_msg("velocity steps by %g", (double)step.vel_step_q32);
        if (smooth && (double)step.acc_step_q32 > 8 + 40 * rate * rate / 65536)
            fail_msg("acceleration steps by %g", (double)step.acc_step_q32);
    }
}

/* 0, 8, 8 at 0, 1, 2 s: speed changes by -8; blend 0.5 s. */
static void a_blend_cuts_the_corner_by_as_much_as_it_says(void **state)
{
    (void)state;
    memset(key, 0, sizeof key);
    key[1] = (struct motion_key){ .t_ns_q12 = SEC, .pos_q32 = 8 * ONE };
    key[2] = (struct motion_key){ .t_ns_q12 = 2 * SEC, .pos_q32 = 8 * ONE };
    for (int smooth = 0; smooth <= 1; smooth++) {
        start_track();
        assert_int_equal(
            0, motion_spline_append_blended(&track, key, 3, SEC / 2, smooth,
                                            MOTION_SPLINE_ONE_SIDED,
                                            MOTION_SPLINE_ONE_SIDED, NULL));
        assert_equal_to(8 - at(SEC, 0), smooth ? 8 * 0.5L * 3 / 32 : 0.5L, 1e4L,
                        "corner");
        assert_equal_to(at(SEC / 2, 0), 4, 1e4L, "line before");
        assert_equal_to(at(3 * SEC / 2, 0), 8, 1e4L, "line after");
    }
    assert_int_equal(MOTION_E_ARG,
                     motion_spline_append_blended(&track, key, 3, -1, false,
                                                  MOTION_SPLINE_REST,
                                                  MOTION_SPLINE_REST, NULL));
}

/* --- B-splines ----------------------------------------------------------------- */

static void bsplines_have_smooth_joins_and_meet_their_ends(void **state)
{
    (void)state;
    seed_from("bspline");
    for (int round = 0; round < 1000; round++) {
        const uint32_t n = 2 + (uint32_t)(draw() % (KEYS - 2));
        const bool rest = round & 1;
        const enum motion_spline_end end =
            rest ? MOTION_SPLINE_REST : MOTION_SPLINE_NATURAL;

        draw_keys(n, 1);
        start_track();
        assert_int_equal(
            0, motion_spline_append_bspline(&track, key, n, end, end, NULL));
        assert_int_equal(track.count, n - 1);
        assert_int_equal(track.end.pos_q32, key[n - 1].pos_q32);
        for (uint32_t i = 0; i + 2 < n; i++) {
            struct motion_state a, b;
            motion_segment_state(&storage[i], storage[i].dur_ns_q12, &a);
            motion_segment_state(&storage[i + 1], 0, &b);
            assert_int_equal(a.pos_q32, b.pos_q32);
            assert_true(llabs(a.vel_q32 - b.vel_q32) < 4000);
            assert_true(llabs(a.acc_q32 - b.acc_q32) < 100);
        }
        struct motion_state s;
        motion_segment_state(&storage[0], 0, &s);
        if (llabs(rest ? s.vel_q32 / 100 : s.acc_q32) >= 100)
            fail_msg("%u keys start with %" PRId64 " %" PRId64, (unsigned)n,
                     s.vel_q32, s.acc_q32);
        motion_segment_state(&storage[n - 2], storage[n - 2].dur_ns_q12, &s);
        assert_true(llabs(rest ? s.vel_q32 / 100 : s.acc_q32) < 100);
    }
}

/* (p0 + 4 p1 + p2) / 6 at the inner keys of even ones. */
static void the_uniform_bspline_passes_by_a_sixth(void **state)
{
    static const int64_t pos[] = { 0, 6, -6, 12, 18, 0 };
    int64_t start;

    (void)state;
    memset(key, 0, sizeof key);
    for (int i = 0; i < 6; i++)
        key[i] =
            (struct motion_key){ .t_ns_q12 = i * SEC, .pos_q32 = pos[i] * ONE };
    start_track();
    assert_int_equal(
        0, motion_spline_append_bspline(&track, key, 6, MOTION_SPLINE_NATURAL,
                                        MOTION_SPLINE_NATURAL, NULL));
    for (int i = 1; i < 5; i++)
        assert_equal_to(at(i * SEC, 0),
                        (long double)(pos[i - 1] + 4 * pos[i] + pos[i + 1]) / 6,
                        1e3L, "inner key");
    assert_int_equal(0, motion_spline_bspline_start(key, 6, &start));
    assert_int_equal(start, 3 * ONE);
    motion_track_init(&track, storage, KEYS, start);
    assert_int_equal(0,
                     motion_spline_append_bspline_open(&track, key, 6, NULL));
    assert_int_equal(track.count, 3);
    assert_int_equal(MOTION_E_ARG, motion_spline_bspline_start(key, 3, &start));
    assert_int_equal(MOTION_E_ARG, motion_spline_append_bspline(
                                       &track, key, 6, MOTION_SPLINE_ONE_SIDED,
                                       MOTION_SPLINE_REST, NULL));
}

/* --- Lagrange -------------------------------------------------------------------- */

/* Neville's scheme. */
static long double neville(uint32_t n, long double x)
{
    long double p[KEYS] = { 0 }, t[KEYS];

    for (uint32_t i = 0; i < n; i++) {
        p[i] = ldexpl((long double)key[i].pos_q32, -32);
        t[i] = (long double)(key[i].t_ns_q12 - key[0].t_ns_q12) / SEC;
    }
    for (uint32_t m = 1; m < n; m++)
        for (uint32_t i = 0; i + m < n; i++)
            p[i] = ((x - t[i + m]) * p[i] - (x - t[i]) * p[i + 1]) /
                   (t[i] - t[i + m]);
    return p[0];
}

static void lagrange_stays_within_its_bound(void **state)
{
    (void)state;
    seed_from("lagrange");
    for (int round = 0; round < 60; round++) {
        const uint32_t n = 1 + (uint32_t)round % MOTION_SPLINE_LAGRANGE_KEYS;
        struct motion_real bound;
        long double worst = 0, largest = 1;

        draw_keys(n, 0.3L);
        start_track();
        assert_int_equal(
            0, motion_spline_append_lagrange(&track, key, n, &bound, NULL));
        assert_keys_hit(n);
        for (int i = 0; n > 1 && i < 400; i++) {
            const int64_t t = (int64_t)(draw() % (uint64_t)track.end_ns_q12);
            const long double want = neville(n, (long double)t / SEC);
            const long double residual = fabsl(at(t, 0) - want);
            worst = residual > worst ? residual : worst;
            largest = fabsl(want) > largest ? fabsl(want) : largest;
        }
        /* Neville's own rounding, and two units of the position */
        if (worst > value(bound) + ldexpl(1, -31) + largest * 1e-15L)
            fail_msg("%u keys: misses %Lg, bound %Lg of %Lg", (unsigned)n,
                     worst, value(bound), largest);
        if (value(bound) > ldexpl(1, -31) + largest * 1e-9L)
            fail_msg("%u keys: bound %Lg of %Lg", (unsigned)n, value(bound),
                     largest);
    }
    draw_keys(MOTION_SPLINE_LAGRANGE_KEYS + 1, 0.3L);
    assert_int_equal(
        MOTION_E_FULL,
        motion_spline_append_lagrange(
            &track, key, MOTION_SPLINE_LAGRANGE_KEYS + 1, NULL, NULL));
    assert_int_equal(MOTION_E_EMPTY,
                     motion_spline_append_lagrange(&track, key, 0, NULL, NULL));
}

/* --- constraints ------------------------------------------------------------------- */

/* Every mixture of p, v, a at both ends meets them with the lowest degree. */
static void every_mixture_of_constraints_is_met(void **state)
{
    (void)state;
    seed_from("constraints");
    for (int mask = 0; mask < 16; mask++) {
        const bool has[4] = { mask & 1, mask & 2, mask & 4, mask & 8 };
        const int degree = 1 + has[0] + has[1] + has[2] + has[3];

        draw_keys(2, 1);
        for (int i = 0; i < 2; i++) {
            key[i].has_vel = has[2 * i];
            key[i].has_acc = has[2 * i + 1];
            key[i].vel = motion_real_int(3 + 4 * i);
            key[i].acc = motion_real_int(-9 + 5 * i);
        }
        start_track();
        assert_int_equal(
            0, motion_spline_append_constraints(&track, key, 2, NULL));
        assert_keys_hit(2);
        assert_true(storage[0].degree <= degree);
        for (int i = 0; i < 2; i++) {
            const int64_t t = i == 0 ? 0 : track.end_ns_q12;
            if (key[i].has_vel)
                assert_equal_to(at(t, 1), vel((uint32_t)i), 1e5L, "velocity");
            if (key[i].has_acc) /* to 2^-16 */
                assert_equal_to(at(t, 2), acc((uint32_t)i), 4e7L,
                                "acceleration");
        }
    }
}

/* --- ends of the ranges ---------------------------------------------------------------- */

static void extreme_keys_are_answered_or_refused(void **state)
{
    static const int64_t pos[] = { -MOTION_TRACK_POS_MAX_Q32, 0,
                                   MOTION_TRACK_POS_MAX_Q32, INT64_MAX };
    static const int64_t dur[] = { 1, SEC, (int64_t)1 << 59 };

    (void)state;
    for (int i = 0; i < 64 * 9; i++) {
        struct motion_real bound;
        memset(key, 0, sizeof key);
        key[0].pos_q32 = pos[i % 4];
        key[1].pos_q32 = pos[i / 4 % 4];
        key[2].pos_q32 = pos[i / 16 % 4];
        key[1].t_ns_q12 = dur[i / 64 % 3];
        key[2].t_ns_q12 = key[1].t_ns_q12 + dur[i / 192];
        for (int kind = 0; kind < 6; kind++) {
            int rc;
            start_track();
            rc = kind == 0   ? motion_spline_c2(key, 3, MOTION_SPLINE_NATURAL,
                                                MOTION_SPLINE_NATURAL, work)
                 : kind == 1 ? motion_spline_c4(key, 3, MOTION_SPLINE_REST,
                                                MOTION_SPLINE_REST, work)
                             : 0;
            if (rc == 0)
                rc =
                    kind == 0 ? motion_spline_append_cubic(&track, key, 3, NULL)
                    : kind == 1
                        ? motion_spline_append_quintic(&track, key, 3, NULL)
                    : kind == 2 ? motion_spline_append_lagrange(&track, key, 3,
                                                                &bound, NULL)
                    : kind == 3 ? motion_spline_append_bspline(
                                      &track, key, 3, MOTION_SPLINE_REST,
                                      MOTION_SPLINE_NATURAL, NULL)
                    : kind == 4
                        ? motion_spline_append_blended(&track, key, 3, SEC,
                                                       true, MOTION_SPLINE_REST,
                                                       MOTION_SPLINE_REST, NULL)
                        : motion_spline_append_constraints(&track, key, 3,
                                                           NULL);
            if (rc == 0) {
                assert_int_equal(track.end.pos_q32, key[2].pos_q32);
                assert_int_equal(track.end_ns_q12, key[2].t_ns_q12);
            } else {
                assert_int_equal(rc, MOTION_E_RANGE);
                assert_int_equal(track.count, 0);
            }
        }
    }
}

/* --- points in space --------------------------------------------------------------------- */

static void times_go_as_powers_of_distances(void **state)
{
    /* distances 5 and 20 */
    static const int64_t x[] = { 0, 3 * ONE, 15 * ONE };
    static const int64_t y[] = { 0, 4 * ONE, 20 * ONE };
    const int64_t *const pos[] = { x, y };
    static const double share[] = { 0.5, 1.0 / 3, 0.2 };
    int64_t t[3];

    (void)state;
    for (int i = 0; i < 3; i++) {
        assert_int_equal(0, motion_spline_space(pos, 2, 3,
                                                (enum motion_spline_spacing)i,
                                                10 * SEC, t));
        assert_int_equal(t[0], 0);
        assert_int_equal(t[2], 10 * SEC);
        assert_true(
            llabs(t[1] - (int64_t)llround(share[i] * 10 * (double)SEC)) <= 1);
    }
    assert_int_equal(
        MOTION_E_ARG,
        motion_spline_space(pos, 0, 3, MOTION_SPLINE_CHORDAL, SEC, t));
    const int64_t still[] = { 7, 7, 7 };
    assert_int_equal(MOTION_E_ORDER,
                     motion_spline_space((const int64_t *const[]){ still }, 1,
                                         3, MOTION_SPLINE_CHORDAL, SEC, t));
    assert_int_equal(0,
                     motion_spline_space((const int64_t *const[]){ still }, 1,
                                         3, MOTION_SPLINE_UNIFORM, SEC, t));
    assert_int_equal(
        MOTION_E_EMPTY,
        motion_spline_space(pos, 2, 1, MOTION_SPLINE_UNIFORM, SEC, t));
    assert_int_equal(MOTION_E_ARG, motion_spline_space(
                                       pos, 2, 3, MOTION_SPLINE_CHORDAL, 1, t));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blends_make_speed_and_acceleration_continuous),
        cmocka_unit_test(a_blend_cuts_the_corner_by_as_much_as_it_says),
        cmocka_unit_test(bsplines_have_smooth_joins_and_meet_their_ends),
        cmocka_unit_test(the_uniform_bspline_passes_by_a_sixth),
        cmocka_unit_test(lagrange_stays_within_its_bound),
        cmocka_unit_test(every_mixture_of_constraints_is_met),
        cmocka_unit_test(extreme_keys_are_answered_or_refused),
        cmocka_unit_test(times_go_as_powers_of_distances),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
