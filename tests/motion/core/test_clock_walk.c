/* tests/motion/core/test_clock_walk.c - does a ramp of the clock fit?  Judged by
 * dense looks at what the chain rule says. */
#include <math.h>
#include <stdlib.h>

#include "motion/core/clock_walk.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define MS     INT64_C(1000000)
#define SECOND INT64_C(1000000000)
#define ONE    MOTION_CLOCK_WARP_ONE_Q30
#define UNIT   MOTION_FIXED_ONE_Q32
#define ACC    MOTION_FIXED_ONE_Q32

static struct motion_clock_bound bound_of(int64_t accel_q30, int64_t jerk_q30)
{
    return (struct motion_clock_bound){ accel_q30, jerk_q30 };
}

static struct motion_clock_bound any_bound(uint64_t *seed)
{
    const int64_t accel = check_random_in(seed, ONE / 50, 20 * ONE);
    return bound_of(accel, accel * check_random_in(seed, 1, 50));
}
static bool fits(const struct motion_clock_warp *warp,
                 const struct motion_track *track,
                 const struct motion_clock_limit *limit, int64_t step_ns)
{
    int64_t looks = 100000;
    return motion_clock_warp_fits(warp, track, limit, step_ns, &looks);
}

static void a_ramp_that_breaks_a_limit_does_not_fit(void **state)
{
    (void)state;
    struct motion_segment storage[4];
    struct motion_track track;
    motion_track_init(&track, storage, ARRAY_LEN(storage), 0);
    /* 100 unit/s for ten seconds */
    assert_int_equal(
        motion_track_append_line(&track, 10 * MOTION_FIXED_S_Q12, 1000 * UNIT),
        MOTION_OK);
    /* 1 -> 0 with A = 1, J = 4: acceleration 100, jerk 400 */
    static const struct {
        int64_t acc, jerk, vel;
        bool fits;
    } rows[] = {
        { 101, 401, 100, true },  { 99, 0, 100, false },
        { 101, 399, 100, false }, { 101, 0, 100, true },
        { 101, 401, 99, false },
    };
    const struct motion_clock_bound bound = bound_of(ONE, 4 * ONE);
    struct motion_clock_warp warp;
    motion_clock_warp_init(&warp, 0, MOTION_FIXED_S_Q12, ONE);
    motion_clock_warp_ramp(&warp, 0, 0, &bound, MS, &warp);
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct motion_clock_limit limit = { rows[i].vel * UNIT,
                                                  rows[i].acc * ACC,
                                                  rows[i].jerk * ACC };
        if (fits(&warp, &track, &limit, MS) != rows[i].fits)
            fail_msg("row %zu", i);
    }
}

/* A peak of acceleration in the middle of a slow ramp: no bound reaches over
 * it. */
static void no_bound_reaches_over_a_peak(void **state)
{
    (void)state;
    struct motion_segment storage[4];
    struct motion_track track;
    motion_track_init(&track, storage, ARRAY_LEN(storage), 0);
    struct motion_state slow = { 0, 10 * UNIT, 0, 0 };
    /* from 10 to 110 unit/s and back: acceleration 150 in the middle of 2 s */
    struct motion_state fast = { 120 * UNIT, 110 * UNIT, 0, 0 };
    motion_track_append_quintic(&track, 2 * MOTION_FIXED_S_Q12, &slow, &fast);
    const struct motion_clock_bound bound = bound_of(ONE / 100, ONE);
    struct motion_clock_warp warp;
    struct motion_extreme acc;
    motion_track_extreme(&track, MOTION_ACC, &acc);
    struct motion_clock_limit limit = { 1000 * UNIT, acc.max / 100 * 95, 0 };
    int64_t looks = 10000;
    motion_clock_warp_init(&warp, 0, 0, ONE);
    motion_clock_warp_ramp(&warp, 0, ONE - ONE / 100, &bound, MS, &warp);
    assert_true(warp.dur_ns >= SECOND);
    assert_false(fits(&warp, &track, &limit, MS));
    limit.acc_q32 = acc.max * 4;
    assert_true(motion_clock_warp_fits(&warp, &track, &limit, MS, &looks));
    /* and a limit that is far away takes few looks */
    print_message("%d looks for %d steps\n", (int)(10000 - looks),
                  (int)(warp.dur_ns / MS));
    assert_true(10000 - looks <= warp.dur_ns / MS / 16);
}

static void looks_that_do_not_suffice_are_a_no(void **state)
{
    (void)state;
    struct motion_segment storage[1];
    struct motion_track track;
    struct motion_clock_warp warp;
    motion_track_init(&track, storage, 1, 0);
    motion_track_append_line(&track, 10 * MOTION_FIXED_S_Q12, 10 * UNIT);
    const struct motion_clock_limit limit = { 10 * UNIT, 1000 * ACC, 0 };
    const struct motion_clock_bound bound = bound_of(10 * ONE, 1000 * ONE);
    motion_clock_warp_init(&warp, 0, 0, ONE);
    motion_clock_warp_ramp(&warp, 0, 0, &bound, MS, &warp);
    int64_t looks = 1000;
    assert_true(motion_clock_warp_fits(&warp, &track, &limit, MS, &looks));
    looks = 1000 - looks - 1;
    assert_false(motion_clock_warp_fits(&warp, &track, &limit, MS, &looks));
}

static void a_step_between_two_looks_is_seen(void **state)
{
    (void)state;
    struct motion_segment storage[4];
    struct motion_track track;
    motion_track_init(&track, storage, ARRAY_LEN(storage), 0);
    struct motion_state slow = { 100 * UNIT, 100 * UNIT, 0, 0 };
    /* a blip of 0.2 ms at three times the speed, between two looks 1 ms
     * apart */
    motion_track_append_line(&track, MOTION_FIXED_S_Q12, slow.pos_q32);
    motion_track_append_line(&track, MOTION_FIXED_S_Q12 / 5000,
                             100 * UNIT + UNIT * 6 / 100);
    motion_track_append_line(&track, MOTION_FIXED_S_Q12, 200 * UNIT);
    const struct motion_clock_limit limit = { 150 * UNIT, 100000 * ACC, 0 };
    const struct motion_clock_bound bound = bound_of(ONE, 4 * ONE);
    struct motion_clock_warp warp;
    motion_clock_warp_init(&warp, 0, MOTION_FIXED_S_Q12 / 2, ONE);
    motion_clock_warp_ramp(&warp, 0, ONE / 2, &bound, MS, &warp);
    assert_false(fits(&warp, &track, &limit, MS));
}

/* The least percentage of `limit`, in 1/1024, that fits. */
static int64_t least_share(const struct motion_clock_warp *warp,
                           const struct motion_track *track,
                           const struct motion_clock_limit *limit)
{
    int64_t low = 0, high = 1 << 16;
    while (high - low > 1) {
        const int64_t share = (low + high) / 2;
        const struct motion_clock_limit part = { limit->vel_q32 / 1024 * share,
                                                 limit->acc_q32 / 1024 * share,
                                                 limit->jerk_q32 / 1024 *
                                                     share };
        if (fits(warp, track, &part, MS / 4))
            high = share;
        else
            low = share;
    }
    return high;
}

/* Where a border of segments lies between two looks, the clock there is the one
 * of that time, not of the looks. */
static void coarse_looks_refuse_nothing_that_fits(void **state)
{
    (void)state;
    seed_from("coarse");
    unsigned compared = 0;
    for (int n = 0; n < 400; n++) {
        struct motion_segment storage[6];
        struct motion_track track;
        struct motion_state to = { 0 };
        struct motion_clock_warp warp;
        motion_track_init(&track, storage, ARRAY_LEN(storage), 0);
        for (size_t i = 0; i < ARRAY_LEN(storage); i++) {
            const int64_t from_q32 = to.vel_q32;
            to.vel_q32 = check_random_in(check_stream(), -50, 50) * UNIT;
            to.pos_q32 += from_q32 / 4 + to.vel_q32 / 4;
            motion_track_append_cubic(&track, MOTION_FIXED_S_Q12 / 2, from_q32,
                                      &to);
        }
        const struct motion_clock_bound bound = any_bound(check_stream());
        const struct motion_clock_limit limit = { 16 * UNIT, 256 * ACC,
                                                  8192 * ACC };
        motion_clock_warp_init(
            &warp, 0, check_random_in(check_stream(), 0, MOTION_FIXED_S_Q12),
            ONE);
        if (motion_clock_warp_ramp(&warp, 0, 0, &bound, MS, &warp) < 0 ||
            warp.s1_ns_q12 >= track.end_ns_q12)
            continue;
        const int64_t share = least_share(&warp, &track, &limit) + 1;
        const struct motion_clock_limit least = { limit.vel_q32 / 1024 * share,
                                                  limit.acc_q32 / 1024 * share,
                                                  limit.jerk_q32 / 1024 *
                                                      share };
        compared++;
        if (!fits(&warp, &track, &least, warp.dur_ns / 24))
            fail_msg("case %d: %.4f s, refused at %.4f of the limit", n,
                     (double)warp.dur_ns * 1e-9, (double)share / 1024);
    }
    assert_true(compared > 200);
}

/* Acceleration comes to 0 within a microsecond, as planners without a limit of
 * jerk may leave it: between two looks that lasts no longer than it does. */
static void a_short_and_steep_segment_is_no_reason_to_refuse(void **state)
{
    (void)state;
    struct motion_segment storage[4];
    struct motion_track track;
    const struct motion_state rest = { 0 };
    struct motion_state up = { 50 * UNIT, 100 * UNIT, 100 * ACC, 0 };
    struct motion_state on = { 50 * UNIT + UNIT / 10000, 100 * UNIT, 0, 0 };
    motion_track_init(&track, storage, ARRAY_LEN(storage), 0);
    motion_track_append_constraints(&track, MOTION_FIXED_S_Q12, 2, &rest, 3,
                                    &up);
    motion_track_append_quintic(&track, MOTION_FIXED_S_Q12 / 1000000, &up, &on);
    motion_track_append_line(&track, MOTION_FIXED_S_Q12,
                             on.pos_q32 + 100 * UNIT);
    struct motion_extreme acc;
    motion_track_extreme(&track, MOTION_ACC, &acc);
    const struct motion_clock_limit limit = { 200 * UNIT, acc.max / 10 * 11,
                                              0 };
    const struct motion_clock_bound bound = bound_of(ONE / 10, ONE);
    struct motion_clock_warp warp;
    motion_clock_warp_init(&warp, 0, MOTION_FIXED_S_Q12 / 10 * 9, ONE);
    motion_clock_warp_ramp(&warp, 0, ONE / 2, &bound, MS, &warp);
    assert_true(fits(&warp, &track, &limit, MS));
    assert_true(fits(&warp, &track, &limit, 2 * MS));
    const struct motion_clock_limit less = { 200 * UNIT, 50 * ACC, 0 };
    assert_false(fits(&warp, &track, &less, 2 * MS));
}

/* --- beside looks at every time ------------------------------------------ */

/* By how much what counts most is over its limit, at one time; negative: within.
 * In shares of the limit. */
static double over_at(const struct motion_clock_walk *walk, int64_t dt,
                      int64_t jerk_q30)
{
    struct motion_clock_rate now;
    struct motion_state track, axis;
    motion_clock_warp_at(walk->warp, walk->warp->t0_ns + dt, &now);
    now.jerk_q30 = jerk_q30;
    motion_track_state(walk->track, now.s_ns_q12, &track);
    motion_clock_warp_chain(&now, &track, &axis);
    const double vel =
        fabs((double)axis.vel_q32 / (double)walk->limit->vel_q32);
    const double acc =
        fabs((double)axis.acc_q32 / (double)walk->limit->acc_q32);
    const double jerk =
        walk->limit->jerk_q32 == 0
            ? 0
            : fabs((double)axis.jerk_q32 / (double)walk->limit->jerk_q32);
    return fmax(vel, fmax(acc, jerk)) - 1;
}

/* The most of it at 128 times of what the last step went over. */
static double most_over(const struct motion_clock_walk *walk)
{
    const int64_t from = walk->before_ns < 0 ? walk->at_ns : walk->before_ns;
    struct motion_clock_rate at, before;
    double most = -1;
    motion_clock_warp_at(walk->warp, walk->warp->t0_ns + from, &before);
    motion_clock_warp_at(walk->warp, walk->warp->t0_ns + walk->at_ns, &at);
    for (int64_t n = 0; n <= 128; n++)
        most = fmax(most, over_at(walk, from + (walk->at_ns - from) * n / 128,
                                  before.jerk_q30));
    return fmax(most, over_at(walk, walk->at_ns, at.jerk_q30));
}

static void random_track(struct motion_track *track, bool is_cubic)
{
    struct motion_state from = { 0 };
    for (int i = 0; i < 6; i++) {
        const int64_t dur =
            MOTION_FIXED_S_Q12 / check_random_in(check_stream(), 2, 40);
        struct motion_state to = {
            0, check_random_in(check_stream(), -50, 50) * UNIT,
            check_random_in(check_stream(), -200, 200) * ACC, 0
        };
        const int64_t mean = (from.vel_q32 + to.vel_q32) / 2;
        int64_t way;
        (void)motion_fixed_muldiv(mean, dur, MOTION_FIXED_S_Q12, &way);
        to.pos_q32 = from.pos_q32 + way;
        if (is_cubic)
            motion_track_append_cubic(track, dur, from.vel_q32, &to);
        else
            motion_track_append_quintic(track, dur, &from, &to);
        from = to;
    }
}

/* What is said to be within bounds is, at every time; what is refused is over a
 * limit there; and what fits is within them at every step. */
static void bounds_hold_at_every_time(void **state)
{
    (void)state;
    seed_from("bounds");
    unsigned fit = 0, refused = 0, bounded = 0, steps = 0;
    double share = 0;
    for (int n = 0; n < 4000; n++) {
        struct motion_segment storage[6];
        struct motion_track track;
        struct motion_clock_warp warp;
        struct motion_clock_walk walk;
        struct motion_extreme vel, acc, jerk;
        motion_track_init(&track, storage, ARRAY_LEN(storage), 0);
        random_track(&track, n % 2 == 0);
        motion_clock_warp_init(
            &warp, 0, check_random_in(check_stream(), 0, track.end_ns_q12 / 2),
            ONE);
        const struct motion_clock_bound bound = any_bound(check_stream());
        const int64_t to = check_random_in(check_stream(), 0, 3) * ONE / 2;
        if (motion_clock_warp_ramp(&warp, 0, to, &bound, MS, &warp) < 0 ||
            warp.s1_ns_q12 >= track.end_ns_q12)
            continue;
        motion_track_extreme(&track, MOTION_VEL, &vel);
        motion_track_extreme(&track, MOTION_ACC, &acc);
        motion_track_extreme(&track, MOTION_JERK, &jerk);
        const int64_t part = check_random_in(check_stream(), 40, 250);
        const struct motion_clock_limit limit = {
            (vel.max > -vel.min ? vel.max : -vel.min) / 100 * part,
            (acc.max > -acc.min ? acc.max : -acc.min) / 100 * part,
            n % 3 == 0
                ? 0
                : (jerk.max > -jerk.min ? jerk.max : -jerk.min) / 100 * part,
        };
        int64_t looks = 100000;
        int more;
        motion_clock_walk_begin(&walk, &warp, &track, &limit, MS);
        while ((more = motion_clock_walk_next(&walk, &looks)) > 0) {
            steps += (unsigned)((walk.at_ns - walk.before_ns) / MS);
            if (!walk.is_bounded)
                continue;
            bounded += (unsigned)((walk.at_ns - walk.before_ns) / MS);
            share = fmax(share, most_over(&walk));
            if (most_over(&walk) > 1e-7)
                fail_msg("case %d: %.9f over between %.6f and %.6f s", n,
                         most_over(&walk), (double)walk.before_ns * 1e-9,
                         (double)walk.at_ns * 1e-9);
        }
        fit += more == 0;
        refused += more < 0;
        if (more < 0 && most_over(&walk) < -0.02)
            fail_msg("case %d: refused at %.6f s, %.4f of a limit", n,
                     (double)walk.at_ns * 1e-9, 1 + most_over(&walk));
        for (int64_t dt = 0; more == 0 && dt < warp.dur_ns; dt += MS) {
            struct motion_clock_rate at;
            motion_clock_warp_at(&warp, dt, &at);
            if (over_at(&walk, dt, at.jerk_q30) > 1e-7)
                fail_msg("case %d: fits, but %.9f over at %.6f s", n,
                         over_at(&walk, dt, at.jerk_q30), (double)dt * 1e-9);
        }
    }
    print_message(
        "%u fit, %u refused; %u of %u steps within bounds, which come "
        "to %.6f of a limit\n",
        fit, refused, bounded, steps, 1 + share);
    assert_true(fit > 200 && refused > 200 && bounded > steps / 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_ramp_that_breaks_a_limit_does_not_fit),
        cmocka_unit_test(no_bound_reaches_over_a_peak),
        cmocka_unit_test(looks_that_do_not_suffice_are_a_no),
        cmocka_unit_test(a_step_between_two_looks_is_seen),
        cmocka_unit_test(coarse_looks_refuse_nothing_that_fits),
        cmocka_unit_test(a_short_and_steep_segment_is_no_reason_to_refuse),
        cmocka_unit_test(bounds_hold_at_every_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
