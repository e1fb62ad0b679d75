/* tests/firmware/control/test_couple_judge.c - a follower's track is on its curve, or it
 * is said where it is not: random moves of a master, what curves make of them
 * (motion/curve/time_warp.h), and the same with a bump somewhere between two keys, beside
 * a look at many places of it in long double.
 *
 *   N=100000 build/tests/firmware/control/test_couple_judge    SEED=17 N=1 ... */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/control/couple.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/ease.h"
#include "motion/curve/time_warp.h"
#include "motion/plan/move.h"
#include "tests/support/check.h"

#define UNIT  MOTION_FIXED_ONE_Q32
#define S     MOTION_FIXED_S_Q12
#define KEYS  8
#define PARTS 40 /* of a segment, that are looked at */

static struct motion_track master, own, curve, bent;
static struct controller_cam cam;
static struct controller_couple_off off;
static unsigned round_of;

static int64_t q32(long double value)
{
    return llrintl(value * 0x1p32L);
}

static long double draw_in(long double low, long double high)
{
    return low + (high - low) * draw_unit();
}

static void reserve(struct motion_track *track, uint32_t count)
{
    plan_track_free(track);
    *track =
        (struct motion_track){ .segment = calloc(count, sizeof *track->segment),
                               .capacity = count };
}

/* --- a polynomial, by its definition (motion/core/track.h) ------------------------- */

static long double place_of(const struct motion_segment *segment, long double u)
{
    long double sum = 0;
    for (int k = MOTION_TRACK_DEGREE; k >= 0; k--)
        sum = sum * (u / 2) + (long double)segment->coef[k];
    sum = ldexpl(sum, -segment->frac);
    if (segment->frac < 0)
        sum += (long double)segment->remainder * u;
    return (long double)segment->pos_q32 + sum;
}

/* In 2^-32 units. */
static long double place_at(const struct motion_track *track, long double t)
{
    const struct motion_segment *segment = track->segment;
    if (t <= 0)
        return (long double)segment[0].pos_q32;
    if (t >= (long double)track->end_ns_q12)
        return (long double)track->end.pos_q32;
    while (t >= (long double)(segment->start_ns_q12 + segment->dur_ns_q12))
        segment++;
    return place_of(segment, (t - (long double)segment->start_ns_q12) /
                                 (long double)segment->dur_ns_q12);
}

static long double off_at(const struct motion_track *follower, long double t)
{
    const long double m = place_at(&master, t) - (long double)cam.low_q32;
    return place_at(follower, t) -
           place_at(&curve, m * (long double)S / (long double)UNIT);
}

/* The largest there is at many places. */
static long double most_off(const struct motion_track *follower)
{
    long double most = 0;
    for (uint32_t i = 0; i < follower->count; i++) {
        const struct motion_segment *segment = &follower->segment[i];
        for (int k = 0; k <= PARTS; k++)
            most = fmaxl(
                most,
                fabsl(off_at(follower, (long double)segment->start_ns_q12 +
                                           (long double)segment->dur_ns_q12 *
                                               k / PARTS)));
    }
    return most;
}

/* --- moves ------------------------------------------------------------------------ */

/* Through these places, `every` apart, of which 1 unit takes `long` of time. */
static int through(const int64_t place_q32[], unsigned count, int64_t every_q12,
                   enum plan_curve kind, struct motion_track *track)
{
    struct plan_key key[KEYS] = { { .place = { 0, 0 } } };
    struct plan_axis axis = { .curve = kind, .key = key, .key_count = count };
    struct plan_error error;
    for (unsigned i = 0; i < count; i++)
        key[i].key = (struct motion_key){ .t_ns_q12 = (int64_t)i * every_q12,
                                          .pos_q32 = place_q32[i] };
    plan_track_free(track);
    return plan_axis_track(&axis, track, &error);
}

/* To and fro within +-far. */
static void draw_master(long double far)
{
    static const enum plan_curve kinds[] = { PLAN_CURVE_C2, PLAN_CURVE_QUINTIC,
                                             PLAN_CURVE_SCURVE, PLAN_CURVE_C4 };
    int64_t place_q32[KEYS];
    const unsigned count = 2 + draw_below(KEYS - 1);
    for (unsigned i = 0; i < count; i++)
        place_q32[i] = q32(draw_in(-far, far));
    assert_true(through(place_q32, count,
                        llrintl(draw_in(0.3L, 5) * (long double)S),
                        kinds[draw_below(ARRAY_LEN(kinds))], &master) >= 0);
}

/* A gear or a cam over where it goes, in the follower's unit; the same by milliseconds,
 * for motion_time_warp_append. */
static void draw_curve(long double ratio, struct motion_track *by_ms)
{
    int64_t place_q32[KEYS];
    struct motion_extreme reach;
    const unsigned count = draw_below(2) == 0 ? 2 : 4 + draw_below(KEYS - 3);
    motion_track_extreme(&master, MOTION_POS, &reach);
    cam.low_q32 = reach.min - UNIT;
    const int64_t span_q32 = reach.max - reach.min + 2 * UNIT;
    const int64_t every_q32 = span_q32 / (count - 1);
    for (unsigned i = 0; i < count; i++)
        place_q32[i] = count == 2
                           ? q32((i == 0 ? -ratio : ratio) / 2 *
                                 (long double)span_q32 / (long double)UNIT)
                           : q32(draw_in(-1, 1) * ratio *
                                 (long double)every_q32 / (long double)UNIT);
    const enum plan_curve kind = count == 2 ? PLAN_CURVE_LINEAR : PLAN_CURVE_C2;
    int64_t every_q12, every_ms_q12;
    assert_int_equal(motion_fixed_muldiv(every_q32, S, UNIT, &every_q12), 0);
    assert_int_equal(
        motion_fixed_muldiv(every_q32, S / 1000, UNIT, &every_ms_q12), 0);
    assert_true(through(place_q32, count, every_q12, kind, &curve) >= 0);
    assert_true(through(place_q32, count, every_ms_q12, kind, by_ms) >= 0);
    cam.track = &curve;
    assert_int_equal(
        motion_fixed_muldiv(curve.end_ns_q12, UNIT, S, &cam.high_q32), 0);
    cam.high_q32 += cam.low_q32;
    assert_int_equal(controller_cam_init(&cam), MOTION_OK);
}

/* What the curve makes of the master's track. */
static bool draw_follower(void)
{
    struct motion_track by_ms = { .segment = NULL }, time = master;
    struct motion_state start;
    draw_master(draw_in(1, 1000));
    draw_curve(powl(10, draw_in(-2, 2)), &by_ms);
    time = master;
    time.segment = calloc(master.count, sizeof *time.segment);
    memcpy(time.segment, master.segment, master.count * sizeof *time.segment);
    for (uint32_t i = 0; i < master.count; i++)
        time.segment[i].pos_q32 -= cam.low_q32;
    time.end.pos_q32 -= cam.low_q32;
    reserve(&own, 4000);
    motion_time_warp_state(&by_ms, &time, 0, &start);
    motion_track_init(&own, own.segment, own.capacity, start.pos_q32);
    const int err = motion_time_warp_append(&own, &by_ms, &time, NULL);
    free(time.segment);
    plan_track_free(&by_ms);
    return err == MOTION_OK;
}

static unsigned rounds(void)
{
    const char *given = getenv("N");
    return given ? (unsigned)strtoul(given, NULL, 0) : 150;
}

/* --- claims ----------------------------------------------------------------------- */

static void what_the_curve_makes_of_a_move_is_on_it(void **state)
{
    long double most = 0;
    (void)state;
    seed_from("on it");
    for (round_of = 0; round_of < rounds();) {
        if (!draw_follower())
            continue;
        round_of++;
        const long double is = most_off(&own);
        most = fmaxl(most, is / (long double)cam.window_q32);
        if (is < (long double)cam.window_q32 / 3 &&
            !controller_couple_judge(&cam, &own, &master, &off))
            fail_msg("round %u: off by %.0Lf of %" PRId64 ", said %" PRId64
                     " at %.6f s",
                     round_of, is, cam.window_q32, off.off_q32,
                     (double)off.t_ns_q12 / (double)S);
    }
    print_message("%u rounds: %.4Lf of the window\n", round_of, most);
    assert_true(most < 1.0L / 3);
}

/* u^2 (1 - u)^2 times 16, a bump of height 1, and times 25 sqrt(5) (1 - 2u), one to
 * each side that is where it was in its middle; coefficients from u on. */
static const long double bump_shape[2][MOTION_TRACK_DEGREE] = {
    { 0, 16, -32, 16, 0 },
    { 0, 55.9017L, -4 * 55.9017L, 5 * 55.9017L, -2 * 55.9017L },
};

/* The Taylor series of a segment at u0, times h^k. */
static void piece_of(const struct motion_segment *segment, long double u0,
                     long double h, long double a[MOTION_TRACK_DEGREE + 1])
{
    memset(a, 0, (MOTION_TRACK_DEGREE + 1) * sizeof *a);
    for (int n = 0; n <= MOTION_TRACK_DEGREE; n++) {
        long double choose = 1;
        for (int k = 0; k <= n; k++) {
            a[k] += ldexpl((long double)segment->coef[n], -segment->frac - n) *
                    choose * powl(u0, n - k) * powl(h, k);
            choose = choose * (n - k) / (k + 1);
        }
    }
}

static int64_t end_of(uint32_t index)
{
    return index + 1 < own.count ? own.segment[index + 1].pos_q32
                                 : own.end.pos_q32;
}

/* The part from t0 to t1 of a segment, with `shape` times `high` added to it. */
static bool bent_part(uint32_t index, int64_t t0, int64_t t1, long double high,
                      const long double *shape)
{
    const struct motion_segment *segment = &own.segment[index];
    const long double dur = (long double)segment->dur_ns_q12;
    const int frac = segment->frac > 2 ? 2 : 0;
    long double a[MOTION_TRACK_DEGREE + 1];
    int64_t coef[MOTION_TRACK_DEGREE];
    if (t1 <= t0)
        return true;
    piece_of(segment, (long double)t0 / dur, (long double)(t1 - t0) / dur, a);
    for (int k = 0; k < MOTION_TRACK_DEGREE; k++)
        coef[k] = llrintl(ldexpl(a[k + 1] + high * shape[k], frac));
    return motion_track_append_poly(
               &bent, t1 - t0, MOTION_TRACK_DEGREE, coef, (unsigned)frac,
               t1 == segment->dur_ns_q12
                   ? end_of(index)
                   : llrintl(place_of(segment, (long double)t1 / dur)),
               0) >= 0;
}

/* The same track but for a part of one segment, which goes aside by `high` (2^-32) and
 * comes back. */
static bool bump(uint32_t index, long double from, long double to,
                 long double high)
{
    const long double *shape = bump_shape[draw_below(2)];
    const int64_t dur = own.segment[index].dur_ns_q12;
    const int64_t t0 = llrintl((long double)dur * from);
    const int64_t t1 = llrintl((long double)dur * to);
    reserve(&bent, own.count + 2);
    motion_track_init(&bent, bent.segment, bent.capacity,
                      own.segment[0].pos_q32);
    for (uint32_t i = 0; i < own.count; i++) {
        if (i == index) {
            if (!bent_part(i, 0, t0, 0, shape) ||
                !bent_part(i, t0, t1, high, shape) ||
                !bent_part(i, t1, dur, 0, shape))
                return false;
            continue;
        }
        bent.segment[bent.count] = own.segment[i];
        bent.segment[bent.count].start_ns_q12 = bent.end_ns_q12;
        bent.end_ns_q12 += own.segment[i].dur_ns_q12;
        bent.end.pos_q32 = end_of(i);
        bent.count++;
    }
    return true;
}

/* At the ends of all segments it is where it was: only what lies between tells. */
static void a_bump_between_two_keys_is_seen(void **state)
{
    unsigned seen = 0, let = 0;
    (void)state;
    seed_from("bumps");
    for (round_of = 0; round_of < rounds();) {
        if (!draw_follower())
            continue;
        const uint32_t index = draw_below(own.count);
        const long double from = draw_below(3) == 0 ? 0 : draw_in(0, 0.9L);
        const long double to = draw_below(3) == 0 ? 1 : draw_in(from, 1);
        const long double high = (long double)cam.window_q32 *
                                 powl(10, draw_in(-1, 4)) *
                                 (draw_below(2) == 0 ? -1 : 1);
        if (own.segment[index].dur_ns_q12 < S / 1000 || to - from < 0.001L ||
            !bump(index, from, to, high))
            continue;
        round_of++;
        const long double is = most_off(&bent);
        const bool on = controller_couple_judge(&cam, &bent, &master, &off);
        if (on ? is > (long double)cam.window_q32
               : is < (long double)cam.window_q32 / 3)
            fail_msg("round %u: a bump of %.0Lf from %.4Lf to %.4Lf of segment "
                     "%u is off by %.0Lf, the window is %" PRId64 ": %s",
                     round_of, high, from, to, index, is, cam.window_q32,
                     on ? "let pass" : "refused");
        if (!on && fabsl(fabsl((long double)off.off_q32) - is) > is / 2)
            fail_msg("round %u: off by %.0Lf, said %" PRId64, round_of, is,
                     off.off_q32);
        seen += on ? 0 : 1;
        let += on ? 1 : 0;
    }
    print_message("%u seen, %u within the window\n", seen, let);
    assert_true(seen > rounds() / 3 && let > rounds() / 20);
}

/* One stands while the other goes, one ends before the other, one goes further than the
 * curve. */
static void what_is_off_is_said_with_its_place(void **state)
{
    static const struct motion_ease_limit limit = { 100 * UNIT, 100 * UNIT,
                                                    1000 * UNIT };
    const int64_t line_q32[] = { -200 * UNIT, 200 * UNIT };
    (void)state;
    assert_true(through(line_q32, 2, 200 * S, PLAN_CURVE_LINEAR, &curve) >= 0);
    cam = (struct controller_cam){ .track = &curve,
                                   .low_q32 = -100 * UNIT,
                                   .high_q32 = 100 * UNIT };
    assert_int_equal(controller_cam_init(&cam), MOTION_OK);
    reserve(&master, 20);
    reserve(&own, 20);
    motion_track_init(&master, master.segment, 20, 0);
    motion_track_init(&own, own.segment, 20, 0);
    assert_int_equal(motion_ease_append_limited(&master, 50 * UNIT, &limit), 0);
    /* the master comes back, the follower stands */
    assert_int_equal(motion_ease_append_limited(&master, 0, &limit), 0);
    assert_int_equal(motion_track_append_dwell(&own, master.end_ns_q12), 0);
    assert_false(controller_couple_judge(&cam, &own, &master, &off));
    assert_true(llabs(off.off_q32 + 100 * UNIT) < UNIT / 10);
    assert_true(llabs(off.m_q32 - 50 * UNIT) < UNIT / 10);
    assert_true(llabs(off.t_ns_q12 - master.end_ns_q12 / 2) < S / 10);
    /* also after its own end */
    motion_track_init(&own, own.segment, 20, 0);
    assert_int_equal(motion_track_append_dwell(&own, S / 1000), 0);
    assert_false(controller_couple_judge(&cam, &own, &master, &off));
    assert_true(llabs(off.off_q32 + 100 * UNIT) < UNIT / 10);
    /* the follower goes on where the master has come to its end */
    motion_track_init(&master, master.segment, 20, 0);
    assert_int_equal(motion_track_append_dwell(&master, S / 1000), 0);
    assert_int_equal(motion_ease_append_limited(&own, UNIT, &limit), 0);
    assert_false(controller_couple_judge(&cam, &own, &master, &off));
    assert_true(llabs(off.off_q32 - UNIT) < UNIT / 10);
    /* at its start alone */
    motion_track_init(&own, own.segment, 20, UNIT);
    assert_int_equal(motion_track_append_dwell(&own, S / 1000), 0);
    assert_false(controller_couple_judge(&cam, &own, &master, &off));
    /* beyond the end of the curve */
    motion_track_init(&master, master.segment, 20, 0);
    assert_int_equal(motion_ease_append_limited(&master, 101 * UNIT, &limit),
                     0);
    assert_false(controller_couple_judge(&cam, &own, &master, &off));
    assert_int_equal(off.off_q32, 0);
    assert_int_equal(off.m_q32, 101 * UNIT);
}

static int end(void **state)
{
    (void)state;
    plan_track_free(&master);
    plan_track_free(&own);
    plan_track_free(&curve);
    plan_track_free(&bent);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_the_curve_makes_of_a_move_is_on_it),
        cmocka_unit_test(a_bump_between_two_keys_is_seen),
        cmocka_unit_test(what_is_off_is_said_with_its_place),
    };
    return cmocka_run_group_tests_name("couple_judge", tests, NULL, end);
}
