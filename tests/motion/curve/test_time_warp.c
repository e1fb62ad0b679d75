/* tests/motion/curve/test_time_warp.c - p = f(w(t)), judged by the chain
 * rule. */
#include "motion/curve/time_warp.h"
#include "motion/plan/check.h"
#include "tests/support/spline_keys.h"

static struct motion_spline_work work[KEYS];
static struct motion_segment f_storage[KEYS], w_storage[KEYS];
static struct motion_track f, w;

static void append(struct motion_track *to, struct motion_segment *segment,
                   uint32_t n)
{
    motion_track_init(to, segment, KEYS, key[0].pos_q32);
    assert_int_equal(0, motion_spline_append_cubic(to, key, n, NULL));
}

static void draw_f(uint32_t n)
{
    draw_keys(n, 1);
    assert_int_equal(0, motion_spline_c2(key, n, MOTION_SPLINE_NATURAL,
                                         MOTION_SPLINE_NATURAL, work));
    append(&f, f_storage, n);
}

/* w through `n` keys within f; rising, or there and back. */
static void draw_w(uint32_t n, bool rising)
{
    draw_keys(n, 1);
    for (uint32_t i = 0; i < n; i++) {
        const double share = rising ? (double)i / (n - 1) : (double)draw_unit();
        key[i].pos_q32 =
            motion_time_warp_ms((int64_t)(share * (double)f.end_ns_q12));
    }
    assert_int_equal(0, motion_spline_monotone(key, n, MOTION_SPLINE_REST,
                                               MOTION_SPLINE_ONE_SIDED));
    append(&w, w_storage, n);
}

static int warp(struct motion_real *bound)
{
    struct motion_state start;

    motion_time_warp_state(&f, &w, 0, &start);
    motion_track_init(&track, storage, ARRAY_LEN(storage), start.pos_q32);
    return motion_time_warp_append(&track, &f, &w, bound);
}

static void the_track_is_the_chain_rule(void **state)
{
    (void)state;
    seed_from("warp");
    for (int round = 0; round < 150; round++) {
        long double residual[3] = { 0 }, largest[3] = { 0 };
        struct motion_real bound;

        draw_f(2 + (uint32_t)(draw() % 8));
        draw_w(2 + (uint32_t)(draw() % 8), round & 1);
        assert_int_equal(0, warp(&bound));
        assert_int_equal(track.end_ns_q12, w.end_ns_q12);
        for (int i = 0; i < 300; i++) {
            const int64_t t = (int64_t)(draw() % (uint64_t)track.end_ns_q12);
            struct motion_state got, want;
            motion_track_state(&track, t, &got);
            motion_time_warp_state(&f, &w, t, &want);
            const long double pair[3][2] = {
                { (long double)got.pos_q32, (long double)want.pos_q32 },
                { (long double)got.vel_q32, (long double)want.vel_q32 },
                { (long double)got.acc_q32, (long double)want.acc_q32 },
            };
            for (int n = 0; n < 3; n++) {
                residual[n] =
                    fmaxl(residual[n], fabsl(pair[n][0] - pair[n][1]));
                largest[n] = fmaxl(largest[n], fabsl(pair[n][1]));
            }
        }
        /* the chain rule itself is good to a tick of f: 2^-12 ns times v */
        const long double tick = 2 * largest[1] / SEC + 8;
        if (residual[0] > ldexpl(value(bound), 32) + tick ||
            residual[1] > 1e-7L * largest[1] + 4000 ||
            residual[2] > 1e-6L * largest[2] + 1000)
            fail_msg("round %d misses %Lg %Lg %Lg of %Lg %Lg %Lg, bound %Lg",
                     round, residual[0], residual[1], residual[2], largest[0],
                     largest[1], largest[2], ldexpl(value(bound), 32));
        assert_true(value(bound) <= 1e-9L * 700 + ldexpl(1, -31));
    }
}

static void time_as_it_is_gives_the_move_as_it_is(void **state)
{
    struct motion_real bound;

    (void)state;
    seed_from("identity");
    draw_f(6);
    memset(key, 0, sizeof key);
    key[1].t_ns_q12 = f.end_ns_q12;
    key[1].pos_q32 = motion_time_warp_ms(f.end_ns_q12);
    motion_track_init(&w, w_storage, KEYS, 0);
    assert_int_equal(0, motion_spline_append_linear(&w, key, 2, NULL));
    assert_int_equal(0, warp(&bound));
    assert_true(track.count <= 2 * f.count);
    for (int i = 0; i < 1000; i++) {
        const int64_t t = (int64_t)(draw() % (uint64_t)track.end_ns_q12);
        struct motion_state a, b;
        motion_track_state(&track, t, &a);
        motion_track_state(&f, t, &b);
        assert_true(llabs(a.pos_q32 - b.pos_q32) <= 4);
    }
}

/* Steps of a track, whatever its accelerations are. */
static uint32_t steps_of(const struct motion_track *judged)
{
    struct plan_violation violation[64];
    struct plan_limit limit = { .pos_min_q32 = INT64_MIN,
                                .pos_max_q32 = INT64_MAX,
                                .vel_q32 = INT64_MAX,
                                .period_ns = 1000000 };
    struct motion_extreme acc;
    uint32_t count, steps = 0;

    motion_track_extreme(judged, MOTION_ACC, &acc);
    limit.acc_q32 = INT64_MAX; /* where it is beyond the format, too */
    if (acc.min >= -INT64_MAX)
        limit.acc_q32 = acc.max > -acc.min ? acc.max : -acc.min;
    count = plan_check_track(judged, &limit, violation, 64);
    assert_true(count <= 64);
    for (uint32_t i = 0; i < count; i++)
        steps += violation[i].kind != PLAN_ACC;
    return steps;
}

static void assert_rest(int64_t t_ns_q12)
{
    struct motion_state at;

    motion_track_state(&track, t_ns_q12, &at);
    assert_int_equal(at.vel_q32, 0);
    assert_int_equal(at.acc_q32, 0);
}

/* From 300 units with spans that are 10^3 apart to 2^21 counts. */
static void what_rests_at_its_ends_rests_at_the_warps(void **state)
{
    static const int scales[] = { 1, 3, 100, 7000 };

    int judged = 0;

    (void)state;
    seed_from("rest");
    for (int round = 0; round < 400; round++) {
        const uint32_t n = 2 + (uint32_t)(draw() % 8);
        const uint32_t m = 2 + (uint32_t)(draw() % 3);

        draw_keys(n, round % 3);
        for (uint32_t i = 0; i < n; i++)
            key[i].pos_q32 *= scales[round % 4];
        assert_int_equal(0, motion_spline_c4(key, n, MOTION_SPLINE_REST,
                                             MOTION_SPLINE_REST, work));
        motion_track_init(&f, f_storage, KEYS, key[0].pos_q32);
        assert_int_equal(0, motion_spline_append_quintic(&f, key, n, NULL));
        const int64_t first = key[0].pos_q32;
        draw_keys(m, 1);
        for (uint32_t i = 0; i < m; i++)
            key[i].pos_q32 = motion_time_warp_ms(
                i == m - 1 ? f.end_ns_q12 : f.end_ns_q12 / (m - 1) * i);
        assert_int_equal(0, motion_spline_monotone(key, m, MOTION_SPLINE_REST,
                                                   MOTION_SPLINE_REST));
        assert_int_equal(0,
                         motion_spline_accelerations(key, m, MOTION_SPLINE_REST,
                                                     MOTION_SPLINE_REST));
        motion_track_init(&w, w_storage, KEYS, 0);
        assert_int_equal(0, motion_spline_append_quintic(&w, key, m, NULL));
        if (warp(NULL) != 0) /* the quintic of monotone slopes may go back */
            continue;
        judged++;
        assert_int_equal(track.segment[0].pos_q32, first);
        assert_int_equal(track.end.pos_q32, f.end.pos_q32);
        assert_true(track.end_frac == 0);
        assert_rest(0);
        assert_rest(track.end_ns_q12);
        if (steps_of(&track) != 0)
            fail_msg("round %d: %u steps", round, steps_of(&track));
    }
    assert_true(judged > 200);
}

static void what_cannot_be_warped_is_refused(void **state)
{
    struct motion_real bound;

    (void)state;
    seed_from("refused");
    draw_f(4);
    draw_w(4, true);
    f.count = 0;
    assert_int_equal(MOTION_E_EMPTY, warp(&bound));
    draw_f(4);
    draw_w(4, true);
    f.end_ns_q12 -= SEC / 100; /* w now leaves it */
    f.count--;
    assert_int_equal(MOTION_E_RANGE, warp(&bound));
    assert_int_equal(track.count, 0);
    draw_f(4);
    draw_w(4, true);
    motion_track_init(&track, storage, 1, f_storage[0].pos_q32);
    assert_int_equal(MOTION_E_FULL,
                     motion_time_warp_append(&track, &f, &w, &bound));
    assert_int_equal(track.count, 0);
    motion_track_init(&track, storage, KEYS, f_storage[0].pos_q32 + 99);
    assert_int_equal(MOTION_E_ARG,
                     motion_time_warp_append(&track, &f, &w, &bound));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_track_is_the_chain_rule),
        cmocka_unit_test(time_as_it_is_gives_the_move_as_it_is),
        cmocka_unit_test(what_rests_at_its_ends_rests_at_the_warps),
        cmocka_unit_test(what_cannot_be_warped_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
