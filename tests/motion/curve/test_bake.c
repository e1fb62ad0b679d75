/* tests/motion/curve/test_bake.c - whatever gives p, v, a becomes a track
 * within the bound that is stated; judged at a million random times per
 * motion. */
#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/bake.h"
#include "tests/support/check.h"
#include "tests/support/real_double.h"

#define SEC      MOTION_FIXED_S_Q12
#define CAPACITY 4000
#define SAMPLES  1000000

static struct motion_segment storage[2][CAPACITY];

struct truth {
    long double p, v, a;
};
typedef struct truth motion_fn(long double t);

static struct truth wave(long double t)
{
    const long double w = 7;
    return (struct truth){ 3 * sinl(w * t), 3 * w * cosl(w * t),
                           -3 * w * w * sinl(w * t) };
}

static struct truth bell(long double t)
{
    const long double s = 0.05L, x = (t - 0.9L) / s, e = 1000 * expl(-x * x);
    return (struct truth){ e - 1000 * expl(-(0.9L * 0.9L) / (s * s)),
                           -2 * x / s * e, (4 * x * x - 2) / (s * s) * e };
}

/* p, v, a are zero at all eighths of the time: an even grid sees nothing. */
static struct truth hidden(long double t)
{
    const long double w = 8 * acosl(-1.0L) / 2, s = sinl(w * t),
                      c = cosl(w * t);
    return (struct truth){ s * s * s, 3 * w * s * s * c,
                           3 * w * w * (2 * s * c * c - s * s * s) };
}

static struct truth cubic(long double t)
{
    return (struct truth){ t * t * (1.5L - t / 2), 3 * t - 1.5L * t * t,
                           3 - 3 * t };
}

/* acceleration steps at 1 s */
static struct truth kinked(long double t)
{
    const long double x = t - 1;
    return x < 0 ? (struct truth){ 0, 0, 0 }
                 : (struct truth){ x * x * expl(x), (x * x + 2 * x) * expl(x),
                                   (x * x + 4 * x + 2) * expl(x) };
}

static long double seconds_of(int64_t t_ns_q12)
{
    return (long double)t_ns_q12 / SEC;
}

static int look(void *context, int64_t t_ns_q12, enum motion_bake_side side,
                struct motion_bake_point point[])
{
    motion_fn *const *fn = context;

    for (int i = 0; fn[i]; i++) {
        struct truth x = fn[i](seconds_of(t_ns_q12));
        if (fn[i] == kinked && t_ns_q12 == SEC && side == MOTION_BAKE_LEFT)
            x.a = 0;
        point[i] = (struct motion_bake_point){ real_of(x.p), real_of(x.v),
                                               real_of(x.a) };
    }
    return MOTION_OK;
}

static int look_broken(void *context, int64_t t_ns_q12,
                       enum motion_bake_side side,
                       struct motion_bake_point point[])
{
    motion_fn *fn[] = { wave, NULL };
    (void)context;
    return t_ns_q12 > SEC / 2 ? MOTION_E_IO : look(fn, t_ns_q12, side, point);
}

static const int64_t two_seconds[] = { 0, 2 * SEC };
static const int64_t kink_at_one[] = { 0, SEC, 2 * SEC };

static const struct {
    const char *name;
    motion_fn *fn[3];
    const int64_t *border;
    uint32_t borders;
    long double pos, vel, acc;
} motions[] = {
    { "wave, 1e-4", { wave }, two_seconds, 2, 1e-4L, 0, 0 },
    { "wave, 1e-8", { wave }, two_seconds, 2, 1e-8L, 0, 0 },
    { "wave, v and a", { wave }, two_seconds, 2, 1e-6L, 1e-5L, 1e-2L },
    { "bell, 1e-6", { bell }, two_seconds, 2, 1e-6L, 0, 0 },
    { "hidden, 1e-5", { hidden }, two_seconds, 2, 1e-5L, 0, 0 },
    { "cubic", { cubic }, two_seconds, 2, 2e-9L, 0, 0 },
    { "kinked, 1e-7", { kinked }, kink_at_one, 3, 1e-7L, 0, 0 },
    { "kink not told", { kinked }, two_seconds, 2, 1e-6L, 0, 0 },
    { "two axes", { wave, bell }, two_seconds, 2, 1e-6L, 0, 0 },
};

/* The largest errors seen at random times. */
static struct truth seen(const struct motion_track *track, motion_fn *fn,
                         uint64_t *seed)
{
    struct truth worst = { 0, 0, 0 };
    struct motion_cursor cursor = { 0 };

    for (int i = 0; i < SAMPLES; i++) {
        const int64_t t = check_random_in(seed, 0, 2 * SEC - 1);
        const struct truth x = fn(seconds_of(t));
        struct motion_sample s;
        struct motion_state state;

        motion_track_sample(track, &cursor, t, &s);
        worst.p = fmaxl(worst.p, fabsl(ldexpl(s.pos_q32, -32) - x.p));
        if (i % 16)
            continue;
        motion_track_state(track, t, &state);
        worst.v = fmaxl(worst.v, fabsl(ldexpl(state.vel_q32, -32) - x.v));
        worst.a = fmaxl(worst.a, fabsl(ldexpl(state.acc_q32, -32) - x.a));
    }
    return worst;
}

static struct motion_bake job_of(size_t i)
{
    return (struct motion_bake){
        .source = { look, (void *)motions[i].fn },
        .axes = motions[i].fn[1] ? 2 : 1,
        .border_ns_q12 = motions[i].border,
        .borders = motions[i].borders,
        .pos = real_of(motions[i].pos),
        .vel = real_of(motions[i].vel),
        .acc = real_of(motions[i].acc),
    };
}

/* Above what is seen, not more than ten times, and not above what was asked. */
static void judge(const char *name, const char *what, struct motion_real bound,
                  long double got, long double floor, bool tight)
{
    const long double stated = real_value(bound);

    if (got > stated + floor)
        fail_msg("%s: %s %.3Le seen, %.3Le stated", name, what, got, stated);
    if (tight && stated > 10 * got)
        fail_msg("%s: %s %.3Le stated, only %.3Le seen", name, what, stated,
                 got);
}

static void stated_bounds_hold_and_are_near(void **state)
{
    uint64_t seed = 20260711;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(motions); i++) {
        const struct motion_bake job = job_of(i);
        struct motion_track track[2], *tracks[2] = { &track[0], &track[1] };
        struct motion_bake_report report;

        motion_track_init(&track[0], storage[0], CAPACITY, 0);
        motion_track_init(&track[1], storage[1], CAPACITY, 0);
        const int err = motion_bake(&job, tracks, &report);
        if (err < 0)
            fail_msg("%s: %s", motions[i].name, motion_err_text(err));
        for (uint32_t k = 0; k < job.axes; k++) {
            const struct truth worst = seen(&track[k], motions[i].fn[k], &seed);
            const struct motion_bake_bound *b = &report.bound[k];
            print_message("%-14s %4u segments %5u looks p %.2Le of %.2Le "
                          "v %.2Le of %.2Le a %.2Le of %.2Le\n",
                          motions[i].name, report.segments, report.evaluations,
                          worst.p, real_value(b->pos), worst.v,
                          real_value(b->vel), worst.a, real_value(b->acc));
            judge(motions[i].name, "p", b->pos, worst.p, 0, true);
            judge(motions[i].name, "v", b->vel, worst.v, 0x1p-31L, false);
            judge(motions[i].name, "a", b->acc, worst.a, 0x1p-15L, false);
            assert_true(motion_real_cmp(b->pos, job.pos) <= 0);
        }
    }
}

static void borders_are_met_to_the_bit(void **state)
{
    motion_fn *fn[] = { cubic, NULL };
    struct motion_bake job = job_of(5);
    struct motion_track track, *tracks[] = { &track };

    (void)state;
    job.source.context = fn;
    motion_track_init(&track, storage[0], CAPACITY, 0);
    assert_int_equal(motion_bake(&job, tracks, NULL), MOTION_OK);
    assert_int_equal(track.end.pos_q32, 2 * MOTION_FIXED_ONE_Q32);
    assert_int_equal(track.end_frac, 0);
    assert_int_equal(track.end_ns_q12, 2 * SEC);
}

/* --- refusals ------------------------------------------------------------- */

static struct motion_bake good;

static void refuses(int want, uint32_t capacity)
{
    struct motion_track track, *tracks[] = { &track };
    struct motion_bake_report report = { .segments = 77 };

    motion_track_init(&track, storage[0], capacity, 0);
    const struct motion_track before = track;
    assert_int_equal(motion_bake(&good, tracks, &report), want);
    assert_memory_equal(&track, &before, sizeof track);
    assert_int_equal(report.segments, 77);
    good = job_of(0);
}

static void bad_jobs_are_refused_and_change_nothing(void **state)
{
    static const int64_t backwards[] = { 0, SEC, SEC };
    static const int64_t later[] = { SEC / 10, SEC };

    (void)state;
    good = job_of(0);
    good.axes = 0;
    refuses(MOTION_E_ARG, CAPACITY);
    good.axes = MOTION_BAKE_AXES + 1;
    refuses(MOTION_E_ARG, CAPACITY);
    good.borders = 1;
    refuses(MOTION_E_ARG, CAPACITY);
    good.pos = motion_real_zero();
    refuses(MOTION_E_ARG, CAPACITY);
    good.border_ns_q12 = backwards;
    good.borders = 3;
    refuses(MOTION_E_ORDER, CAPACITY);
    good.border_ns_q12 = later; /* the motion is elsewhere then */
    refuses(MOTION_E_ARG, CAPACITY);
    good.source.at = look_broken;
    refuses(MOTION_E_IO, CAPACITY);
    good.pos = real_of(1e-11L); /* below what the track can show */
    refuses(MOTION_E_TOLERANCE, CAPACITY);
    refuses(MOTION_E_FULL, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(stated_bounds_hold_and_are_near),
        cmocka_unit_test(borders_are_met_to_the_bit),
        cmocka_unit_test(bad_jobs_are_refused_and_change_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
