/* tests/motion/path/test_speed_law.c - speed laws, joined, and driven along a
 * curve: judged at a million random times per law by closed forms in long
 * double.
 *
 * The curve is a parabola, 1000 (u, u^2/2) for u in -1 .. 2, in two pieces; its
 * length is known: 500 (u sqrt(1 + u^2) + asinh u).  Takes long. */
#include <inttypes.h>
#include <math.h>
#include <stdint.h>

#include "motion/core/err.h"
#include "motion/curve/bake.h"
#include "motion/path/arclen.h"
#include "motion/path/path.h"
#include "motion/path/speed_law.h"
#include "tests/support/check.h"
#include "tests/support/real_double.h"

#define SEC      MOTION_FIXED_S_Q12
#define ONE      MOTION_FIXED_ONE_Q32
#define CAPACITY 8000
#define SAMPLES  check_many(1000000, 100000)

static struct motion_segment law_storage[CAPACITY], storage[2][CAPACITY];
static int64_t knots[4], borders[CAPACITY];
static struct motion_arclen_row row[1000];
static struct motion_real coef[12], border[3];
static struct motion_arclen_poly poly = { coef, 2, 2 };
static struct motion_arclen_curve curve = { 2, 2, border, motion_arclen_poly_at,
                                            &poly };
static struct motion_arclen_table table;

/* --- the curve ------------------------------------------------------------ */

static long double length_to(long double u)
{
    return 500 * (u * sqrtl(1 + u * u) + asinhl(u));
}

static long double parameter_at(long double s)
{
    long double u = s / 1500 - 1;
    for (int i = 0; i < 8; i++) {
        const long double off = length_to(u) - length_to(-1) - s;
        u -= off / (1000 * sqrtl(1 + u * u));
        if (fabsl(off) < 1e-14L)
            break;
    }
    return u;
}

static void prepare(void)
{
    static const double at[3] = { -1, 0.25, 2 };

    for (int k = 0; k < 3; k++)
        border[k] = real_of((long double)at[k]);
    for (int k = 0; k < 2; k++) {
        const double u = at[k];
        const double c[6] = { 1000 * u,           1000,     0,
                              1000 * (u * u) / 2, 1000 * u, 500 };
        for (int i = 0; i < 6; i++)
            coef[6 * k + i] = real_of((long double)c[i]);
    }
    assert_int_equal(motion_arclen_build(&table, &curve, motion_real_zero(),
                                         row, ARRAY_LEN(row)),
                     MOTION_OK);
    assert_true(fabsl(real_value(table.length) - length_to(2) + length_to(-1)) <
                1e-10L);
}

static int64_t length_q32(void)
{
    int64_t length;
    assert_int_equal(motion_real_round(table.length, 32, &length), MOTION_OK);
    return length;
}

/* --- laws ----------------------------------------------------------------- */

/* A law is what its track says, here in long double. */
struct truth {
    long double p, v, a;
};

static struct truth law_at(const struct motion_track *law, int64_t t)
{
    uint32_t i = 0;
    struct truth x = { 0, 0, 0 };

    while (i + 1 < law->count && law->segment[i + 1].start_ns_q12 <= t)
        i++;
    const struct motion_segment *s = &law->segment[i];
    const long double T = (long double)s->dur_ns_q12 / SEC,
                      u = (long double)(t - s->start_ns_q12) / s->dur_ns_q12;
    for (int k = 5; k >= 0; k--) {
        const long double c = ldexpl(s->coef[k], -32 - s->frac - k);
        x.a = x.a * u + 2 * x.v;
        x.v = x.v * u + x.p;
        x.p = x.p * u + c;
    }
    x.p += ldexpl(s->pos_q32, -32);
    if (s->frac <= 0) {
        x.p += ldexpl(s->remainder, -32) * u;
        x.v += ldexpl(s->remainder, -32);
    }
    return (struct truth){ x.p, x.v / T, x.a / (T * T) };
}

static const struct motion_speed_point push[] = {
    { 0, { 0, MOTION_REAL_ZERO_E } },
    { SEC, { INT64_C(1) << 61, -61 } },
    { 2 * SEC, { 0, MOTION_REAL_ZERO_E } },
    { 3 * SEC, { 0, MOTION_REAL_ZERO_E } },
    { 4 * SEC, { -(INT64_C(1) << 61), -61 } },
    { 5 * SEC, { 0, MOTION_REAL_ZERO_E } },
};
static const struct motion_speed_point steps[] = {
    { 0, { INT64_C(1) << 61, -61 } },
    { SEC, { INT64_C(1) << 61, -61 } },
    { SEC, { 0, MOTION_REAL_ZERO_E } },
    { 3 * SEC, { 0, MOTION_REAL_ZERO_E } },
    { 3 * SEC, { -(INT64_C(1) << 61), -62 } },
    { 5 * SEC, { -(INT64_C(1) << 61), -62 } },
};

static struct motion_speed_part whole(enum motion_speed_kind kind)
{
    return (struct motion_speed_part){ .kind = kind,
                                       .dur_ns_q12 = 5 * SEC,
                                       .length_q32 = length_q32(),
                                       .k1_q32 = ONE / 4,
                                       .k2_q32 = ONE / 2 };
}

static struct motion_speed_part points(enum motion_speed_kind kind,
                                       const struct motion_speed_point *point,
                                       uint32_t count)
{
    return (struct motion_speed_part){ .kind = kind,
                                       .length_q32 = length_q32(),
                                       .from = motion_real_zero(),
                                       .point = point,
                                       .points = count };
}

static struct motion_speed_part ramp(enum motion_speed_kind kind, double dur,
                                     long double from, long double to)
{
    return (struct motion_speed_part){ .kind = kind,
                                       .dur_ns_q12 = (int64_t)(dur * SEC),
                                       .from = real_of(from),
                                       .to = real_of(to) };
}

/* Ramp up, hold, ramp down over the curve; a ramp covers speed * reach. */
static void plan_ramps(struct motion_track *law, enum motion_speed_kind kind,
                       long double reach)
{
    const long double v = real_value(table.length) / (2 * reach + 3);
    const struct motion_speed_part part[] = {
        ramp(kind, 1, 0, v),
        ramp(MOTION_SPEED_RAMP_LINE, 3, v, v),
        ramp(kind, 1, v, 0),
    };
    assert_int_equal(motion_speed_append(law, part, 3, NULL), MOTION_OK);
}

static void plan_drawn(struct motion_track *law)
{
    struct motion_segment drawn_storage[2];
    struct motion_track drawn;
    const struct motion_speed_part part = { .kind = MOTION_SPEED_DRAWN,
                                            .drawn = &drawn };
    const struct motion_state middle = { .pos_q32 = length_q32() / 3,
                                         .vel_q32 = length_q32() / 4 };
    const struct motion_state end = { .pos_q32 = length_q32() };

    motion_track_init(&drawn, drawn_storage, 2, 0);
    assert_int_equal(motion_track_append_cubic(&drawn, 2 * SEC, 0, &middle),
                     MOTION_OK);
    assert_int_equal(
        motion_track_append_cubic(&drawn, 4 * SEC, middle.vel_q32, &end),
        MOTION_OK);
    assert_int_equal(motion_speed_append(law, &part, 1, NULL), MOTION_OK);
}

/* Speeds: up, on, less, to rest. */
static const struct motion_speed_point speeds[] = {
    { 0, { 0, MOTION_REAL_ZERO_E } },
    { SEC, { INT64_C(1) << 61, -61 } },
    { 2 * SEC, { INT64_C(1) << 61, -61 } },
    { 3 * SEC, { INT64_C(1) << 61, -62 } },
    { 5 * SEC, { 0, MOTION_REAL_ZERO_E } },
};

static const char *const law_name[] = {
    "cubic",     "quintic",   "sine",       "parabolic", "s-curve",
    "ramp line", "ramp sine", "ramp cubic", "ramp jerk", "acc points",
    "acc steps", "drawn",     "vel points", "constant",
};
#define LAWS ARRAY_LEN(law_name)

static void plan(size_t i, struct motion_track *law)
{
    struct motion_speed_part part;

    motion_track_init(law, law_storage, CAPACITY, 0);
    if (i < 5) {
        part = whole((enum motion_speed_kind)i);
    } else if (i < 9) {
        plan_ramps(law, (enum motion_speed_kind)i,
                   i == 6 ? 2 / acosl(-1) : 0.5L);
        return;
    } else if (i == 9) {
        part = points(MOTION_SPEED_ACC_POINTS, push, ARRAY_LEN(push));
    } else if (i == 10) {
        part = points(MOTION_SPEED_ACC_POINTS, steps, ARRAY_LEN(steps));
    } else if (i == 11) {
        plan_drawn(law);
        return;
    } else if (i == 12) {
        part = points(MOTION_SPEED_VEL_POINTS, speeds, ARRAY_LEN(speeds));
    } else {
        const long double v = real_value(table.length) / 5;
        part = ramp(MOTION_SPEED_RAMP_LINE, 5, v, v);
    }
    assert_int_equal(motion_speed_append(law, &part, 1, NULL), MOTION_OK);
}

/* --- claims --------------------------------------------------------------- */

static int drive(const struct motion_track *law, struct motion_track track[2],
                 const struct motion_path_tolerance *tolerance,
                 struct motion_bake_report *report)
{
    struct motion_path path;
    struct motion_track *tracks[2] = { &track[0], &track[1] };
    int err = motion_path_init(&path, &table, law, knots, borders);

    motion_track_init(&track[0], storage[0], CAPACITY, -1000 * ONE);
    motion_track_init(&track[1], storage[1], CAPACITY, 500 * ONE);
    return err < 0 ? err : motion_path_bake(&path, tolerance, tracks, report);
}

static void stated_bounds_hold_at_random_times(void **state)
{
    const struct motion_path_tolerance tolerance = { real_of(1e-6L),
                                                     motion_real_zero(),
                                                     motion_real_zero() };
    uint64_t seed = 11;

    (void)state;
    for (size_t i = 0; i < LAWS; i++) {
        struct motion_track law, track[2];
        struct motion_cursor cursor[2] = { { 0 }, { 0 } };
        struct motion_bake_report report;
        long double worst[2] = { 0, 0 };

        plan(i, &law);
        const int err = drive(&law, track, &tolerance, &report);
        if (err < 0)
            fail_msg("%s: %s", law_name[i], motion_err_text(err));
        assert_int_equal(track[0].end_ns_q12, law.end_ns_q12);
        for (int k = 0; k < SAMPLES; k++) {
            const int64_t t = check_random_in(&seed, 0, law.end_ns_q12 - 1);
            const long double u = parameter_at(law_at(&law, t).p);
            const long double want[2] = { 1000 * u, 500 * u * u };
            for (int axis = 0; axis < 2; axis++) {
                struct motion_sample s;
                motion_track_sample(&track[axis], &cursor[axis], t, &s);
                worst[axis] = fmaxl(worst[axis],
                                    fabsl(ldexpl(s.pos_q32, -32) - want[axis]));
            }
        }
        for (int axis = 0; axis < 2; axis++) {
            const long double stated = real_value(report.bound[axis].pos);
            print_message("%-10s axis %d: %3u segments %5u looks, %.2Le seen, "
                          "%.2Le stated\n",
                          law_name[i], axis, report.segments,
                          report.evaluations, worst[axis], stated);
            if (worst[axis] > stated || stated > 10 * worst[axis] ||
                stated > 1e-6L + 1e-9L)
                fail_msg("%s: %Lg seen, %Lg stated", law_name[i], worst[axis],
                         stated);
        }
    }
}

/* Against the sine itself, not the track that stands for it. */
static void the_bound_of_a_sine_holds_the_law_s_own_error(void **state)
{
    const struct motion_path_tolerance tolerance = { real_of(1e-8L),
                                                     motion_real_zero(),
                                                     motion_real_zero() };
    const long double pi = acosl(-1), length = real_value(table.length);
    const struct motion_speed_part part = {
        .kind = MOTION_SPEED_SINE,
        .dur_ns_q12 = 5 * SEC,
        .length_q32 = length_q32(),
        .k1_q32 = ONE / 2,
        .k2_q32 = ONE / 2,
    };
    struct motion_track law, track[2];
    struct motion_track *tracks[2] = { &track[0], &track[1] };
    struct motion_cursor cursor = { 0 };
    struct motion_speed_report said;
    struct motion_bake_report report;
    struct motion_path path;
    uint64_t seed = 13;
    long double worst = 0;

    (void)state;
    motion_track_init(&law, law_storage, CAPACITY, 0);
    assert_int_equal(motion_speed_append(&law, &part, 1, &said), MOTION_OK);
    motion_track_init(&track[0], storage[0], CAPACITY, -1000 * ONE);
    motion_track_init(&track[1], storage[1], CAPACITY, 500 * ONE);
    assert_int_equal(motion_path_init(&path, &table, &law, knots, borders),
                     MOTION_OK);
    path.law_error = said.error;
    assert_int_equal(motion_path_bake(&path, &tolerance, tracks, &report),
                     MOTION_OK);
    for (int k = 0; k < SAMPLES; k++) {
        const int64_t t = check_random_in(&seed, 0, law.end_ns_q12 - 1);
        const long double s = length * (1 - cosl(pi * t / law.end_ns_q12)) / 2;
        struct motion_sample x;
        motion_track_sample(&track[0], &cursor, t, &x);
        worst = fmaxl(worst,
                      fabsl(ldexpl(x.pos_q32, -32) - 1000 * parameter_at(s)));
    }
    const long double stated = real_value(report.bound[0].pos);
    print_message("true sine: %.2Le seen, %.2Le stated\n", worst, stated);
    assert_true(worst <= stated && stated <= 10 * worst);
}

static void constant_speed_is_constant(void **state)
{
    const long double v = real_value(table.length) / 5;
    const struct motion_path_tolerance tolerance = { real_of(1e-6L),
                                                     real_of(v * 3e-7L),
                                                     motion_real_zero() };
    struct motion_track law, track[2];
    uint64_t seed = 12;
    long double most = 0;

    (void)state;
    plan(LAWS - 1, &law);
    assert_int_equal(drive(&law, track, &tolerance, NULL), MOTION_OK);
    for (int k = 0; k < 200000; k++) {
        const int64_t t = check_random_in(&seed, 0, law.end_ns_q12 - 1);
        struct motion_state x, y;
        motion_track_state(&track[0], t, &x);
        motion_track_state(&track[1], t, &y);
        const long double speed =
            ldexpl(hypotl((long double)x.vel_q32, (long double)y.vel_q32), -32);
        most = fmaxl(most, fabsl(speed / v - 1));
    }
    print_message("constant speed: off by %.1Le\n", most);
    assert_true(most < 1e-6L);
}

/* What each law must be at its joints and end. */
static void laws_cover_their_length_and_end_at_rest(void **state)
{
    (void)state;
    for (size_t i = 0; i < LAWS; i++) {
        struct motion_track law;
        struct motion_continuity steps_of;

        plan(i, &law);
        const struct truth end = law_at(&law, law.end_ns_q12);
        if (fabsl(end.p - real_value(table.length)) > 1e-6L)
            fail_msg("%s: ends at %Lg", law_name[i], end.p);
        if (i != LAWS - 1 && fabsl(end.v) > 1e-6L)
            fail_msg("%s: ends with speed %Lg", law_name[i], end.v);
        motion_track_continuity(&law, &steps_of);
        assert_int_equal(steps_of.pos_step_q32, 0);
        assert_int_equal(motion_speed_check(&law), MOTION_OK);
    }
}

/* Speed over a ramp from 0 to 1, x from its slower end. */
static long double ramp_shape(enum motion_speed_kind kind, long double x)
{
    switch (kind) {
    case MOTION_SPEED_RAMP_LINE:
        return x;
    case MOTION_SPEED_RAMP_SINE:
        return sinl(acosl(-1) / 2 * x);
    case MOTION_SPEED_RAMP_CUBIC:
        return x * x * (3 - 2 * x);
    default:
        return x < 0.5L ? 2 * x * x : 1 - 2 * (1 - x) * (1 - x);
    }
}

static void ramp_follows(enum motion_speed_kind kind, bool down)
{
    const struct motion_speed_part part =
        ramp(kind, 2, down ? 7 : 3, down ? 3 : 7);
    struct motion_track law;

    motion_track_init(&law, law_storage, CAPACITY, 0);
    assert_int_equal(motion_speed_append(&law, &part, 1, NULL), MOTION_OK);
    for (int k = 0; k < 64; k++) {
        const long double u = k / 64.0L;
        const long double want = 3 + 4 * ramp_shape(kind, down ? 1 - u : u);
        const long double got = law_at(&law, 2 * SEC / 64 * k).v;
        if (fabsl(got - want) > 1e-7L)
            fail_msg("ramp %d, u %Lg: %Lg", kind, u, got);
    }
}

static void ramps_follow_their_formulas(void **state)
{
    (void)state;
    for (int kind = MOTION_SPEED_RAMP_LINE; kind <= MOTION_SPEED_RAMP_JERK;
         kind++) {
        ramp_follows((enum motion_speed_kind)kind, false);
        ramp_follows((enum motion_speed_kind)kind, true);
    }
}

static void speeds_that_do_not_match_are_refused(void **state)
{
    const struct motion_speed_part parts[] = {
        ramp(MOTION_SPEED_RAMP_SINE, 1, 0, 5),
        ramp(MOTION_SPEED_RAMP_LINE, 1, 5, 5),
        ramp(MOTION_SPEED_RAMP_CUBIC, 1, 5.0001L, 0),
    };
    struct motion_track law;
    struct motion_speed_report report = { .bad = 99 };

    (void)state;
    motion_track_init(&law, law_storage, CAPACITY, 0);
    assert_int_equal(motion_speed_append(&law, parts, 2, &report), MOTION_OK);
    assert_int_equal(report.bad, 99);
    const struct motion_track before = law;
    assert_int_equal(motion_speed_append(&law, parts + 2, 1, &report),
                     MOTION_E_DISCONTINUITY);
    assert_int_equal(report.bad, 0);
    assert_memory_equal(&law, &before, sizeof law);
    motion_track_init(&law, law_storage, CAPACITY, 0);
    assert_int_equal(motion_speed_append(&law, parts, 3, &report),
                     MOTION_E_DISCONTINUITY);
    assert_int_equal(report.bad, 2);
    assert_int_equal(law.count, 0);
}

static int append_one(struct motion_speed_part part)
{
    struct motion_track law;
    motion_track_init(&law, law_storage, CAPACITY, 0);
    return motion_speed_append(&law, &part, 1, NULL);
}

static void bad_parts_are_refused(void **state)
{
    static const struct motion_speed_point back[] = {
        { 0, { INT64_C(1) << 61, -61 } }, { SEC, { -(INT64_C(1) << 61), -61 } }
    };
    struct motion_speed_part part = whole(MOTION_SPEED_CUBIC);

    (void)state;
    part.length_q32 = -1;
    assert_int_equal(append_one(part), MOTION_E_ARG);
    part = whole((enum motion_speed_kind)99);
    assert_int_equal(append_one(part), MOTION_E_ARG);
    part = whole(MOTION_SPEED_SINE);
    part.dur_ns_q12 = 0;
    assert_int_equal(append_one(part), MOTION_E_ARG);
    assert_int_equal(append_one(ramp(MOTION_SPEED_RAMP_LINE, 1, -1, 1)),
                     MOTION_E_ARG);
    assert_int_equal(append_one(ramp(MOTION_SPEED_RAMP_LINE, 0, 1, 1)),
                     MOTION_E_ARG);
    assert_int_equal(append_one(points(MOTION_SPEED_VEL_POINTS, back, 1)),
                     MOTION_E_EMPTY);
    part = points(MOTION_SPEED_VEL_POINTS, back, 2);
    part.length_q32 = 0;
    assert_int_equal(append_one(part), MOTION_E_ORDER); /* goes back */
    assert_int_equal(append_one(points(MOTION_SPEED_VEL_POINTS, steps, 6)),
                     MOTION_E_ORDER); /* two speeds at one time */
    part = (struct motion_speed_part){ .kind = MOTION_SPEED_DRAWN };
    assert_int_equal(append_one(part), MOTION_E_EMPTY);
}

static void laws_that_do_not_fit_the_curve_are_refused(void **state)
{
    const struct motion_path_tolerance tolerance = { real_of(1e-6L),
                                                     motion_real_zero(),
                                                     motion_real_zero() };
    struct motion_speed_part part = whole(MOTION_SPEED_CUBIC);
    struct motion_track law, track[2];

    (void)state;
    motion_track_init(&law, law_storage, CAPACITY, 0);
    assert_int_equal(drive(&law, track, &tolerance, NULL), MOTION_E_EMPTY);
    part.length_q32 += 100;
    assert_int_equal(motion_speed_append(&law, &part, 1, NULL), MOTION_OK);
    assert_int_equal(drive(&law, track, &tolerance, NULL), MOTION_E_ARG);
    motion_track_init(&law, law_storage, CAPACITY, 0);
    assert_int_equal(motion_track_append_line(&law, SEC, 2 * length_q32()),
                     MOTION_OK);
    assert_int_equal(motion_track_append_line(&law, SEC, length_q32()),
                     MOTION_OK);
    assert_int_equal(drive(&law, track, &tolerance, NULL), MOTION_E_ORDER);
}

static void tracks_are_curves_too(void **state)
{
    struct motion_track x, y;
    const struct motion_track *both[2] = { &x, &y };
    struct motion_real powers[2 * 2 * (MOTION_TRACK_DEGREE + 1)];
    struct motion_path_tracks tracks = { .track = both,
                                         .axes = 2,
                                         .coef = powers };
    const struct motion_state corner = { .pos_q32 = 3 * ONE },
                              end = { .pos_q32 = 4 * ONE };
    struct motion_arclen_curve drawn;
    struct motion_arclen_measure m;
    struct motion_real at[3];

    (void)state;
    motion_track_init(&x, storage[0], CAPACITY, 0);
    motion_track_init(&y, storage[1], CAPACITY, 0);
    assert_int_equal(motion_path_from_tracks(&drawn, &tracks, at),
                     MOTION_E_EMPTY);
    assert_int_equal(motion_track_append_cubic(&x, SEC, 0, &corner), MOTION_OK);
    assert_int_equal(motion_track_append_dwell(&y, SEC), MOTION_OK);
    assert_int_equal(motion_track_append_dwell(&x, SEC), MOTION_OK);
    assert_int_equal(motion_path_from_tracks(&drawn, &tracks, at),
                     MOTION_E_ARG);
    assert_int_equal(motion_track_append_cubic(&y, SEC, 0, &end), MOTION_OK);
    assert_int_equal(motion_path_from_tracks(&drawn, &tracks, at), MOTION_OK);
    assert_int_equal(
        motion_arclen_measure(&drawn, MOTION_ARCLEN_ADAPTIVE, 0, &m),
        MOTION_OK);
    assert_true(fabsl(real_value(m.length) - 7) < 1e-12L);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(stated_bounds_hold_at_random_times),
        cmocka_unit_test(the_bound_of_a_sine_holds_the_law_s_own_error),
        cmocka_unit_test(constant_speed_is_constant),
        cmocka_unit_test(laws_cover_their_length_and_end_at_rest),
        cmocka_unit_test(ramps_follow_their_formulas),
        cmocka_unit_test(speeds_that_do_not_match_are_refused),
        cmocka_unit_test(bad_parts_are_refused),
        cmocka_unit_test(laws_that_do_not_fit_the_curve_are_refused),
        cmocka_unit_test(tracks_are_curves_too),
    };
    prepare();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
