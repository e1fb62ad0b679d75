/* tests/motion/core/test_track.c - the trajectory form, judged by its own
 * definition in 113-bit floating point; see motion/core/track.h. */
#include <inttypes.h>
#include <stdbool.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/core/track.h"
#include "tests/support/check.h"

__extension__ typedef __float128 quad;

#define SEED   UINT64_C(20240608)
#define ONE    MOTION_FIXED_ONE_Q32
#define ACC    MOTION_FIXED_ONE_Q32
#define SECOND MOTION_FIXED_S_Q12
#define HOUR   (3600 * SECOND)
#define LONG   MOTION_TRACK_SEGMENT_MAX_NS_Q12

static struct motion_segment storage[64];

static struct motion_track start_at(int64_t pos_q32)
{
    struct motion_track track;
    motion_track_init(&track, storage, ARRAY_LEN(storage), pos_q32);
    return track;
}

static struct motion_sample sample_at(const struct motion_track *track,
                                      int64_t t_ns_q12)
{
    struct motion_cursor cursor = { 0 };
    struct motion_sample sample;
    motion_track_sample(track, &cursor, t_ns_q12, &sample);
    return sample;
}

static struct motion_state state_at(const struct motion_track *track,
                                    int64_t t_ns_q12)
{
    struct motion_state state;
    motion_track_state(track, t_ns_q12, &state);
    return state;
}

static void assert_near(int64_t got, int64_t want, int64_t within,
                        const char *what)
{
    if (got - want > within || want - got > within)
        fail_msg("%s: got %" PRId64 ", want %" PRId64 " +- %" PRId64, what, got,
                 want, within);
}

/* --- the definition, in quad ---------------------------------------------- */

static quad size_of(quad a)
{
    return a < 0 ? -a : a;
}

static quad larger(quad a, quad b)
{
    return a > b ? a : b;
}

/* 2^n */
static quad power(int n)
{
    quad p = 1;
    for (; n > 0; n--)
        p *= 2;
    for (; n < 0; n++)
        p /= 2;
    return p;
}

/* Derivative `order` with respect to u of the part in brackets, divided by
 * 2^frac: in units of 2^-32. */
static quad bracket(const struct motion_segment *segment, int order, quad u)
{
    quad sum = 0;
    for (int k = MOTION_TRACK_DEGREE; k >= order; k--) {
        quad c = (quad)segment->coef[k] * power(-k);
        for (int i = 0; i < order; i++)
            c *= k - i;
        sum = sum * u + c;
    }
    return sum * power(-segment->frac);
}

/* The same in the formats of a state, travel from the start for pos. */
static quad exact_u(const struct motion_segment *segment, int order, quad u)
{
    quad value = bracket(segment, order, u);
    if (order == 0 && segment->frac < 0)
        value += segment->remainder * u;
    for (int i = 0; i < order; i++)
        value *= (quad)SECOND / (quad)segment->dur_ns_q12;
    return value;
}

static quad exact(const struct motion_segment *segment, int order, int64_t dt)
{
    return exact_u(segment, order, (quad)dt / (quad)segment->dur_ns_q12);
}

/* --- random segments ------------------------------------------------------ */

/* Of any size up to 2^bits. */
static int64_t any_size(uint64_t *seed, int bits)
{
    int64_t b = check_random_in(seed, 0, bits);
    int64_t size = (int64_t)((UINT64_C(1) << b) - 1);
    return check_random_in(seed, -size, size);
}

static int64_t any_length(uint64_t *seed, int bits)
{
    return (int64_t)motion_fixed_abs(any_size(seed, bits));
}

struct any {
    int start_order, end_order;
    struct motion_state start, end;
    int64_t dur_ns_q12;
};

static int append_any(uint64_t *seed, struct motion_track *track,
                      struct any *any)
{
    any->start_order = (int)check_random_in(seed, 1, 3);
    any->end_order = (int)check_random_in(seed, 1, 3);
    any->dur_ns_q12 = 1 + any_length(seed, 59);
    any->start = (struct motion_state){ .vel_q32 = any_size(seed, 50),
                                        .acc_q32 = any_size(seed, 61) };
    any->end = (struct motion_state){
        .pos_q32 = track->end.pos_q32 + any_size(seed, 61),
        .vel_q32 = any_size(seed, 50),
        .acc_q32 = any_size(seed, 61),
    };
    return motion_track_append_constraints(track, any->dur_ns_q12,
                                           any->start_order, &any->start,
                                           any->end_order, &any->end);
}

/* Calls `judge` with every kind of segment, at least 4000 of them. */
static void for_any(void (*judge)(const struct motion_track *track,
                                  const struct any *any, uint64_t *seed))
{
    uint64_t seed = SEED;
    int made = 0, special = 0;
    for (int i = 0; i < 8000; i++) {
        struct motion_track track = start_at(any_size(&seed, 62));
        struct any any;
        if (append_any(&seed, &track, &any) < 0)
            continue;
        made++;
        special += track.segment[0].kind >= MOTION_SEGMENT_FAR;
        judge(&track, &any, &seed);
    }
    assert_true(made > 4000 && special > 400); /* the generator is no sham */
}

/* --- shapes known by hand ------------------------------------------------- */

static void a_line_goes_straight(void **state)
{
    (void)state;
    struct motion_track track = start_at(-3 * ONE);
    assert_int_equal(motion_track_append_line(&track, 4 * SECOND, 5 * ONE), 0);
    struct motion_sample s = sample_at(&track, SECOND);
    assert_int_equal(s.pos_q32, -ONE);
    assert_near(s.vel_q32, 2 * ONE, 1, "vel");
    assert_int_equal(s.acc_q32, 0);
    assert_int_equal(track.end.pos_q32, 5 * ONE);
    assert_int_equal(track.end.vel_q32, 2 * ONE);
}

static void a_dwell_stands_still(void **state)
{
    (void)state;
    struct motion_track track = start_at(-1);
    assert_int_equal(motion_track_append_dwell(&track, LONG), 0);
    for (int64_t t = 0; t <= LONG; t += LONG / 8) {
        struct motion_sample s = sample_at(&track, t);
        assert_true(s.pos_q32 == -1 && s.vel_q32 == 0 && s.acc_q32 == 0);
    }
}

/* h01 = -2u^3 + 3u^2: with +3u^3 - 2u^2 or the like these are elsewhere. */
static void a_cubic_is_hermite_with_the_right_signs(void **state)
{
    static const struct {
        int64_t quarter, pos, vel;
    } rows[] = {
        { 1, 5 * ONE / 32, 9 * ONE / 32 }, /* 3/16 - 2/64; 6/4 - 6/16 over 4 */
        { 2, ONE / 2, 12 * ONE / 32 },
        { 3, 27 * ONE / 32, 9 * ONE / 32 },
    };
    (void)state;
    struct motion_track track = start_at(0);
    const struct motion_state end = { .pos_q32 = ONE };
    assert_int_equal(motion_track_append_cubic(&track, 4 * SECOND, 0, &end), 0);
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct motion_sample s = sample_at(&track, rows[i].quarter * SECOND);
        assert_near(s.pos_q32, rows[i].pos, 1, "pos");
        assert_near(s.vel_q32, rows[i].vel, 1, "vel");
    }
    /* acceleration 6/T^2 at the start, -6/T^2 at the end, jerk -12/T^3 */
    struct motion_state s = state_at(&track, 0);
    assert_int_equal(s.acc_q32, 6 * ACC / 16);
    assert_int_equal(s.jerk_q32, -12 * ACC / 64);
    assert_int_equal(track.end.acc_q32, -6 * ACC / 16);
}

static void a_quintic_meets_its_ends(void **state)
{
    (void)state;
    struct motion_track track = start_at(7 * ONE);
    const struct motion_state a = { .vel_q32 = 3 * ONE, .acc_q32 = -2 * ACC };
    const struct motion_state b = { 100 * ONE, -ONE, 5 * ACC, 0 };
    assert_int_equal(motion_track_append_quintic(&track, 3 * SECOND, &a, &b),
                     0);
    struct motion_state got = state_at(&track, 0);
    assert_int_equal(got.pos_q32, 7 * ONE);
    assert_int_equal(got.vel_q32, a.vel_q32);
    assert_int_equal(got.acc_q32, a.acc_q32);
    assert_int_equal(track.end.pos_q32, b.pos_q32);
    assert_int_equal(track.end.vel_q32, b.vel_q32);
    assert_int_equal(track.end.acc_q32, b.acc_q32);
}

/* Tangents scale with the span: p = t stays p = t on uneven keys. */
static void hermite_reproduces_p_equals_t_on_uneven_keys(void **state)
{
    static const int64_t key_ms[] = { 0, 70, 1000, 1001, 2500, 9000, 9100 };
    (void)state;
    struct motion_track track = start_at(0);
    for (size_t i = 1; i < ARRAY_LEN(key_ms); i++) {
        int64_t dur = (key_ms[i] - key_ms[i - 1]) * (SECOND / 1000);
        struct motion_state end = { .pos_q32 = key_ms[i] * ONE / 1000,
                                    .vel_q32 = ONE };
        assert_int_equal(motion_track_append_cubic(&track, dur, ONE, &end), 0);
    }
    for (int64_t ms = 0; ms < 9100; ms++) {
        struct motion_sample s = sample_at(&track, ms * (SECOND / 1000));
        assert_near(s.pos_q32, ms * ONE / 1000, 3, "pos");
        assert_near(s.vel_q32, ONE, 2000, "vel"); /* keys are rounded to q32 */
    }
    struct motion_continuity worst;
    motion_track_continuity(&track, &worst);
    assert_int_equal(worst.pos_step_q32, 0);
    assert_int_equal(worst.vel_step_q32, ONE); /* from rest at the very ends */
}

/* --- exactness ------------------------------------------------------------ */

static void judge_definition(const struct motion_track *track,
                             const struct any *any, uint64_t *seed)
{
    const struct motion_segment *segment = &track->segment[0];
    quad unit = segment->frac < 0 ? power(-segment->frac) : 1;
    (void)any;
    for (int i = 0; i < 8; i++) {
        int64_t dt = check_random_in(seed, 0, segment->dur_ns_q12 - 1);
        struct motion_sample s = sample_at(track, dt);
        quad travel = (quad)s.pos_q32 - (quad)segment->pos_q32;
        quad error = size_of(travel - exact(segment, 0, dt));
        quad allowed = larger(2 * unit, 8 * power(-segment->frac));
        if (error > allowed)
            fail_msg("pos off by %g at %" PRId64 " of %" PRId64
                     ", frac %d (seed %" PRIu64 ")",
                     (double)error, dt, segment->dur_ns_q12, segment->frac,
                     SEED);
    }
}

static void position_is_within_two_units_of_the_polynomial(void **state)
{
    (void)state;
    for_any(judge_definition);
}

/* Largest of a derivative, coarsely; enough for a relative tolerance. */
static quad peak(const struct motion_segment *segment, int order)
{
    quad most = 0;
    for (int i = 0; i <= 16; i++)
        most = larger(most, size_of(exact_u(segment, order, (quad)i / 16)));
    return most;
}

static void judge_derivatives(const struct motion_track *track,
                              const struct any *any, uint64_t *seed)
{
    const struct motion_segment *segment = &track->segment[0];
    quad per_second = (quad)SECOND / (quad)segment->dur_ns_q12;
    quad least_acc = per_second * per_second; /* 2^-32 / dur^2 */
    quad least_vel = power(-28) * per_second; /* 2^-60 / dur */
    quad least[4] = { 0, power(-60) * per_second };
    least[2] = least[1] * per_second;
    least[3] = least[2] * per_second; /* 2^-92 / dur^3 */
    least_vel += segment->vel_shift == 0 ? 3 : 24;
    quad peak_of[4];
    (void)any;
    for (int order = 0; order < 4; order++)
        peak_of[order] = peak(segment, order);
    /* control points of an acceleration are below 32 times its peak */
    const bool beyond = segment->acc_scale_high == 0 &&
                        segment->acc_scale_low == 0 && peak_of[2] > power(57);
    assert_true(beyond || peak_of[2] <= power(62));
    for (int i = 0; i < 8; i++) {
        int64_t dt = check_random_in(seed, 0, segment->dur_ns_q12 - 1);
        struct motion_sample s = sample_at(track, dt);
        struct motion_state e = state_at(track, dt);
        const struct {
            const char *name;
            int order, bits;
            quad units;
            int64_t got;
        } rows[] = {
            { "vel", 1, 46, least_vel, s.vel_q32 },
            { "acc", 2, 20, 3 + 4 * least_acc, s.acc_q32 },
            { "state vel", 1, 58, 1 + least[1], e.vel_q32 },
            { "state acc", 2, 58, 1 + least[2], e.acc_q32 },
            { "state jerk", 3, 58, 1 + least[3], e.jerk_q32 },
        };
        assert_int_equal(e.pos_q32, s.pos_q32);
        for (size_t r = 0; r < ARRAY_LEN(rows); r++) {
            quad want = exact(segment, rows[r].order, dt);
            quad allowed =
                rows[r].units + peak_of[rows[r].order] * power(-rows[r].bits);
            if (rows[r].bits == 20 && beyond)
                assert_int_equal(rows[r].got, 0);
            else if (size_of(want) >= power(63)) /* saturates */
                assert_int_equal(rows[r].got, want < 0 ? INT64_MIN : INT64_MAX);
            else if (size_of((quad)rows[r].got - want) > allowed)
                fail_msg("%s: got %" PRId64 ", want %.0f at %" PRId64
                         " of %" PRId64 " (seed %" PRIu64 ")",
                         rows[r].name, rows[r].got, (double)want, dt,
                         segment->dur_ns_q12, SEED);
        }
    }
}

static void derivatives_keep_their_precision(void **state)
{
    (void)state;
    for_any(judge_derivatives);
}

/* A polynomial of degree n is settled by n + 1 conditions; so a segment of
 * that degree that meets them is the one. */
static void judge_constraints(const struct motion_track *track,
                              const struct any *any, uint64_t *seed)
{
    const struct motion_segment *segment = &track->segment[0];
    quad seconds = (quad)any->dur_ns_q12 / (quad)SECOND;
    quad least = power(-segment->frac); /* one step of a coefficient */
    quad relative = power(-60);
    const struct {
        const char *name;
        bool requested;
        int order;
        quad u, want, steps;
    } rows[] = {
        { "start vel", any->start_order >= 2, 1, 0,
          (quad)any->start.vel_q32 * seconds, 1 },
        { "start acc", any->start_order >= 3, 2, 0,
          (quad)any->start.acc_q32 * seconds * seconds, 1 },
        { "end vel", any->end_order >= 2, 1, 1,
          (quad)any->end.vel_q32 * seconds, 1 },
        { "end acc", any->end_order >= 3, 2, 1,
          (quad)any->end.acc_q32 * seconds * seconds, 4 },
    };
    (void)seed;
    assert_true(segment->degree < any->start_order + any->end_order);
    assert_int_equal(sample_at(track, 0).pos_q32, segment->pos_q32);
    assert_int_equal(track->end.pos_q32, any->end.pos_q32);
    if (segment->frac >= 0)
        assert_true(bracket(segment, 0, 1) ==
                    (quad)any->end.pos_q32 - (quad)segment->pos_q32);
    for (size_t r = 0; r < ARRAY_LEN(rows); r++) {
        quad got = bracket(segment, rows[r].order, rows[r].u);
        if (rows[r].requested &&
            size_of(got - rows[r].want) >
                rows[r].steps * least + relative * size_of(rows[r].want))
            fail_msg("%s: off by %g steps (seed %" PRIu64 ")", rows[r].name,
                     (double)((got - rows[r].want) / least), SEED);
    }
}

static void segments_meet_what_was_asked_at_both_ends(void **state)
{
    (void)state;
    for_any(judge_constraints);
}

static void keys_are_hit_to_the_bit(void **state)
{
    uint64_t seed = SEED;
    int64_t key[ARRAY_LEN(storage) + 1], at[ARRAY_LEN(storage) + 1];
    (void)state;
    for (int round = 0; round < 100; round++) {
        struct motion_track track = start_at(any_size(&seed, 44));
        key[0] = track.end.pos_q32;
        at[0] = 0;
        for (uint32_t i = 0; i < ARRAY_LEN(storage); i++) {
            struct motion_state end = { .pos_q32 = any_size(&seed, 44),
                                        .vel_q32 = any_size(&seed, 40),
                                        .acc_q32 = any_size(&seed, 40) };
            int64_t dur = check_random_in(&seed, SECOND / 1000, 9 * SECOND);
            int orders = (int)check_random_in(&seed, 1, 3);
            assert_int_equal(motion_track_append_constraints(
                                 &track, dur, orders, &track.end, orders, &end),
                             0);
            key[i + 1] = end.pos_q32;
            at[i + 1] = track.end_ns_q12;
        }
        for (size_t i = 0; i < ARRAY_LEN(key); i++) {
            assert_int_equal(sample_at(&track, at[i]).pos_q32, key[i]);
            assert_int_equal(state_at(&track, at[i]).pos_q32, key[i]);
        }
        struct motion_continuity worst;
        motion_track_continuity(&track, &worst);
        assert_int_equal(worst.pos_step_q32, 0);
    }
}

static void judge_continuity(const struct motion_track *track,
                             const struct any *any, uint64_t *seed)
{
    struct motion_track longer = *track;
    struct motion_continuity worst;
    (void)any;
    (void)seed;
    if (motion_track_append_dwell(&longer, SECOND) < 0)
        return;
    motion_track_continuity(&longer, &worst);
    assert_int_equal(worst.pos_step_q32, 0);
}

static void position_never_steps_whatever_the_travel(void **state)
{
    (void)state;
    for_any(judge_continuity);
}

/* --- long moves ----------------------------------------------------------- */

/* The 8 kHz tick of a slow move: positions advance by v dt, to the last bit
 * that rounding leaves, and velocity never goes back. */
static void a_tick_is_resolved_in_a_day_and_in_three(void **state)
{
    static const int64_t dur[] = { 24 * HOUR, 72 * HOUR, LONG };
    const int64_t tick = SECOND / 8000;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(dur); i++) {
        struct motion_track track = start_at(-100 * ONE);
        struct motion_state rest = { 0 }, end = { .pos_q32 = 900 * ONE };
        assert_int_equal(
            motion_track_append_quintic(&track, dur[i], &rest, &end), 0);
        for (int64_t part = 0; part < 40; part++) { /* speeding up */
            int64_t t = dur[i] / 80 * part + 12345;
            struct motion_sample before = sample_at(&track, t);
            for (int n = 0; n < 50; n++) {
                t += tick;
                struct motion_sample now = sample_at(&track, t);
                quad step =
                    exact(&storage[0], 0, t) - exact(&storage[0], 0, t - tick);
                quad got = (quad)(now.pos_q32 - before.pos_q32);
                assert_true(size_of(got - step) <= 1.5);
                assert_true(now.vel_q32 >= before.vel_q32 - 1);
                quad vel = exact(&storage[0], 1, t);
                assert_true(size_of((quad)now.vel_q32 - vel) <= 3);
                before = now;
            }
        }
    }
}

static struct motion_track six_hours(void)
{
    struct motion_track track = start_at(3 * ONE);
    struct motion_state end = { .pos_q32 = 2403 * ONE + 1 };
    for (int i = 0; i < 6; i++) {
        assert_int_equal(
            motion_track_append_quintic(&track, HOUR, &track.end, &end), 0);
        end.pos_q32 = -end.pos_q32;
        end.vel_q32 = (i - 2) * ONE / 16;
    }
    return track;
}

/* A cursor that has walked all the way sees what a fresh one sees. */
static void a_six_hour_move_does_not_drift(void **state)
{
    (void)state;
    struct motion_track track = six_hours();
    struct motion_cursor cursor = { 0 };
    struct motion_sample walked;
    for (int64_t ms = 0; ms < 6 * 3600 * 1000; ms += 13) {
        int64_t t = ms * (SECOND / 1000);
        motion_track_sample(&track, &cursor, t, &walked);
        if (ms % (13 * 64) == 0) {
            struct motion_sample fresh = sample_at(&track, t);
            assert_memory_equal(&walked, &fresh, sizeof(fresh));
            quad travel =
                (quad)walked.pos_q32 - (quad)storage[cursor.index].pos_q32;
            quad want = exact(&storage[cursor.index], 0,
                              t - storage[cursor.index].start_ns_q12);
            assert_true(size_of(travel - want) <= 1.5);
        }
    }
    motion_track_sample(&track, &cursor, 6 * HOUR, &walked);
    assert_int_equal(walked.pos_q32, track.end.pos_q32);
}

static void every_rate_sees_the_same_at_common_times(void **state)
{
    static const int64_t rate_hz[] = { 100, 1000, 8000 };
    (void)state;
    struct motion_track track = six_hours();
    struct motion_sample at_second[3][60];
    for (size_t r = 0; r < ARRAY_LEN(rate_hz); r++) {
        struct motion_cursor cursor = { 0 };
        struct motion_sample s;
        int64_t from = HOUR - 30 * SECOND; /* across a border */
        for (int64_t n = 0; n < 60 * rate_hz[r]; n++) {
            motion_track_sample(&track, &cursor,
                                from + n * (SECOND / rate_hz[r]), &s);
            if (n % rate_hz[r] == 0)
                at_second[r][n / rate_hz[r]] = s;
        }
    }
    assert_memory_equal(at_second[0], at_second[1], sizeof(at_second[0]));
    assert_memory_equal(at_second[0], at_second[2], sizeof(at_second[0]));
}

/* --- cursors and the outside ---------------------------------------------- */

static void a_cursor_may_jump_anywhere(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    struct motion_track track = start_at(0);
    while (track.count < ARRAY_LEN(storage)) { /* durations of any size */
        struct motion_state end = { .pos_q32 = any_size(&seed, 40) };
        int64_t dur = 1 + any_length(&seed, 44);
        (void)motion_track_append_cubic(&track, dur, 0, &end);
    }
    struct motion_cursor cursor = { 0 };
    for (int i = 0; i < 20000; i++) {
        int64_t t = check_random_in(&seed, -5, track.end_ns_q12 + 5);
        if (i % 5 == 0) /* at a border, or one step off it */
            t = track.segment[i / 5 % (int)track.count].start_ns_q12 - i % 2;
        if (i % 7 == 0)
            cursor.index = (uint32_t)check_random(&seed); /* of another track */
        struct motion_sample s, fresh = sample_at(&track, t);
        motion_track_sample(&track, &cursor, t, &s);
        assert_memory_equal(&s, &fresh, sizeof(s));
    }
}

static void outside_its_time_a_track_rests_at_its_ends(void **state)
{
    static const int64_t before[] = { -1, -SECOND, INT64_MIN };
    static const int64_t after[] = { 1, SECOND, INT64_MAX / 2 };
    (void)state;
    struct motion_track track = start_at(5 * ONE);
    struct motion_sample s = sample_at(&track, 0);
    assert_true(s.pos_q32 == 5 * ONE && s.vel_q32 == 0 && s.acc_q32 == 0);
    assert_int_equal(state_at(&track, 99).pos_q32, 5 * ONE);

    const struct motion_state end = { -ONE, 2 * ONE, 3 * ACC, 0 };
    assert_int_equal(motion_track_append_quintic(&track, SECOND, &end, &end),
                     0);
    for (size_t i = 0; i < 3; i++) {
        s = sample_at(&track, before[i]);
        assert_true(s.pos_q32 == 5 * ONE && s.vel_q32 == 0 && s.acc_q32 == 0);
        assert_int_equal(state_at(&track, before[i]).pos_q32, 5 * ONE);
        assert_int_equal(state_at(&track, before[i]).vel_q32, 0);
        s = sample_at(&track, SECOND + after[i]);
        assert_true(s.pos_q32 == -ONE && s.vel_q32 == 0 && s.acc_q32 == 0);
        assert_int_equal(state_at(&track, SECOND + after[i]).acc_q32, 0);
    }
    s = sample_at(&track, SECOND);
    assert_true(s.pos_q32 == -ONE && s.vel_q32 == 2 * ONE);
    assert_int_equal(s.acc_q32, 3 * ACC);
    assert_int_equal(state_at(&track, SECOND).vel_q32, 2 * ONE);
    assert_int_equal(state_at(&track, SECOND).acc_q32, 3 * ACC);
}

/* Late in a long track, t - start must not wrap into a segment. */
static void the_earliest_time_is_before_the_latest_segment(void **state)
{
    (void)state;
    struct motion_track track = start_at(0);
    int64_t pos = 0;
    while (motion_track_append_line(&track, LONG, pos += ONE) == MOTION_OK) {
    }
    assert_int_equal(track.end_ns_q12, MOTION_TRACK_MAX_NS_Q12);
    struct motion_cursor cursor = { track.count - 1 };
    struct motion_sample s;
    motion_track_sample(&track, &cursor, INT64_MIN, &s);
    assert_int_equal(s.pos_q32, 0);
    motion_track_sample(&track, &cursor, INT64_MAX, &s);
    assert_int_equal(s.pos_q32, track.end.pos_q32);
}

/* --- raw polynomials ------------------------------------------------------ */

/* 1/3 of a unit is no multiple of 2^-32: the fraction at a border carries on,
 * so that the velocity of the parts is that of the whole. */
static void fractions_below_the_format_carry_over_borders(void **state)
{
    const int64_t third = ONE / 3; /* and a third of 2^-32 */
    const int64_t coef = (int64_t)((UINT64_C(1) << 62) / 3);
    (void)state;
    struct motion_track track = start_at(0);
    for (int64_t i = 1; i <= 9; i++) {
        uint64_t frac = (uint64_t)(i % 3) * (UINT64_MAX / 3);
        assert_int_equal(motion_track_append_poly(&track, SECOND, 1, &coef, 30,
                                                  i * ONE / 3, frac),
                         0);
    }
    for (int64_t i = 0; i < 90; i++) {
        struct motion_sample s = sample_at(&track, i * SECOND / 10);
        assert_near(s.pos_q32, (int64_t)((quad)ONE * (quad)i / 30), 1, "pos");
        assert_int_equal(s.vel_q32, third);
    }
    struct motion_continuity worst;
    motion_track_continuity(&track, &worst);
    assert_int_equal(worst.pos_step_q32, 0);
}

/* A fraction of all ones, one step of rounding away from the next 2^-32. */
static void a_fraction_does_not_carry_into_the_position(void **state)
{
    const int64_t coef = 0;
    (void)state;
    for (int bits = 0; bits < 60; bits++) {
        struct motion_track track = start_at(0);
        const struct motion_state end = { .pos_q32 = INT64_C(1) << bits };
        assert_int_equal(motion_track_append_poly(&track, SECOND, 1, &coef, 0,
                                                  0, UINT64_MAX),
                         0);
        assert_int_equal(motion_track_append_cubic(&track, LONG / 2, 0, &end),
                         0);
        assert_int_equal(motion_track_append_line(&track, 9 * SECOND, 0), 0);
        assert_int_equal(sample_at(&track, SECOND).pos_q32, 0);
        struct motion_continuity worst;
        motion_track_continuity(&track, &worst);
        assert_int_equal(worst.pos_step_q32, 0);
        track = start_at(0);
        assert_int_equal(motion_track_append_poly(&track, SECOND, 1, &coef, 0,
                                                  0, UINT64_MAX),
                         0);
        assert_int_equal(
            motion_track_append_line(&track, 9 * SECOND, end.pos_q32), 0);
        assert_int_equal(sample_at(&track, SECOND).pos_q32, 0);
    }
}

static void raw_coefficients_are_those_of_u(void **state)
{
    /* 2u - 3u^2 + u^3 + u^5/2, in quarters of 2^-32 units */
    static const int64_t coef[] = { 8 * ONE, -12 * ONE, 4 * ONE, 0, 0 };
    (void)state;
    struct motion_track track = start_at(10 * ONE);
    assert_int_equal(motion_track_append_poly(&track, 2 * SECOND, 5, coef, 2,
                                              10 * ONE + ONE / 2, 0),
                     0);
    struct motion_state s = state_at(&track, SECOND); /* u = 1/2 */
    assert_near(s.pos_q32, 10 * ONE + 3 * ONE / 8 + ONE / 64, 1, "pos");
    assert_near(s.vel_q32, (2 * ONE - 3 * ONE + 3 * ONE / 4 + 5 * ONE / 32) / 2,
                1, "vel");
    assert_near(s.acc_q32, (-6 * ACC + 3 * ACC + 10 * ACC / 8) / 4, 1, "acc");
    assert_near(s.jerk_q32, (6 * ACC + 30 * ACC / 4) / 8, 1, "jerk");
    assert_int_equal(track.end.pos_q32, 10 * ONE + ONE / 2);
}

/* --- refusals ------------------------------------------------------------- */

struct refusal {
    const char *name;
    int err;
    int64_t from, dur;
    int start_order, end_order;
    struct motion_state start, end;
};

static const struct refusal refusals[] = {
    { "no time", MOTION_E_ARG, 0, 0, 1, 1, { 0 }, { 0 } },
    { "time backwards", MOTION_E_ARG, 0, -1, 1, 1, { 0 }, { 0 } },
    { "over 3.2 days", MOTION_E_ARG, 0, LONG + 1, 1, 1, { 0 }, { 0 } },
    { "order 0 at the start", MOTION_E_ARG, 0, 1, 0, 1, { 0 }, { 0 } },
    { "order 4 at the start", MOTION_E_ARG, 0, 1, 4, 1, { 0 }, { 0 } },
    { "order 0 at the end", MOTION_E_ARG, 0, 1, 1, 0, { 0 }, { 0 } },
    { "order 4 at the end", MOTION_E_ARG, 0, 1, 1, 4, { 0 }, { 0 } },
    { "end too far",
      MOTION_E_RANGE,
      0,
      HOUR,
      1,
      1,
      { 0 },
      { .pos_q32 = MOTION_TRACK_POS_MAX_Q32 + 1 } },
    { "end too far below",
      MOTION_E_RANGE,
      0,
      HOUR,
      1,
      1,
      { 0 },
      { .pos_q32 = -MOTION_TRACK_POS_MAX_Q32 - 1 } },
    { "start too far", MOTION_E_RANGE, INT64_MIN, HOUR, 1, 1, { 0 }, { 0 } },
    { "swings too far",
      MOTION_E_RANGE,
      MOTION_TRACK_POS_MAX_Q32,
      HOUR,
      2,
      2,
      { .vel_q32 = ONE },
      { .pos_q32 = MOTION_TRACK_POS_MAX_Q32 } },
    { "too fast",
      MOTION_E_RANGE,
      0,
      SECOND / 2,
      1,
      1,
      { 0 },
      { .pos_q32 = 1200000000 * ONE } },
    { "too fast in a nanosecond",
      MOTION_E_RANGE,
      0,
      4096,
      1,
      1,
      { 0 },
      { .pos_q32 = 3 * ONE } },
    { "tangent too large",
      MOTION_E_RANGE,
      0,
      LONG,
      3,
      3,
      { .acc_q32 = INT64_MAX },
      { 0 } },
};

static void a_refusal_leaves_the_track_as_it_was(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(refusals); i++) {
        const struct refusal *row = &refusals[i];
        struct motion_track track = start_at(row->from), was = track;
        struct motion_segment was_capacity[2];
        memset(storage, 0x5a, sizeof(was_capacity));
        memcpy(was_capacity, storage, sizeof(was_capacity));
        int err = motion_track_append_constraints(&track, row->dur,
                                                  row->start_order, &row->start,
                                                  row->end_order, &row->end);
        if (err != row->err)
            fail_msg("%s: returned %d", row->name, err);
        assert_memory_equal(&track, &was, sizeof(track));
        assert_memory_equal(storage, was_capacity, sizeof(was_capacity));
    }
}

static void a_full_track_takes_no_more(void **state)
{
    const int64_t coef = ONE;
    const struct motion_state rest = { 0 };
    (void)state;
    struct motion_track track;
    motion_track_init(&track, storage, 1, 0);
    assert_int_equal(motion_track_append_dwell(&track, SECOND), 0);
    struct motion_track was = track;
    assert_int_equal(motion_track_append_dwell(&track, SECOND), MOTION_E_FULL);
    assert_int_equal(motion_track_append_line(&track, SECOND, ONE),
                     MOTION_E_FULL);
    assert_int_equal(motion_track_append_cubic(&track, SECOND, 0, &rest),
                     MOTION_E_FULL);
    assert_int_equal(motion_track_append_quintic(&track, SECOND, &rest, &rest),
                     MOTION_E_FULL);
    assert_int_equal(
        motion_track_append_poly(&track, SECOND, 1, &coef, 0, ONE, 0),
        MOTION_E_FULL);
    assert_memory_equal(&track, &was, sizeof(track));
}

static void raw_arguments_are_checked(void **state)
{
    const int64_t coef[6] = { ONE };
    (void)state;
    struct motion_track track = start_at(0);
    assert_int_equal(motion_track_append_poly(&track, SECOND, 0, coef, 0, 0, 0),
                     MOTION_E_ARG);
    assert_int_equal(motion_track_append_poly(&track, SECOND, 6, coef, 0, 0, 0),
                     MOTION_E_ARG);
    assert_int_equal(
        motion_track_append_poly(&track, SECOND, 1, coef, 32, 0, 0),
        MOTION_E_ARG);
    assert_int_equal(motion_track_append_poly(&track, 0, 1, coef, 0, 0, 0),
                     MOTION_E_ARG);
    assert_int_equal(track.count, 0);
}

static void the_far_ends_of_the_formats_are_reached(void **state)
{
    static const struct {
        int64_t from, to, dur;
        int order;
    } rows[] = {
        { MOTION_TRACK_POS_MAX_Q32, -MOTION_TRACK_POS_MAX_Q32, 4 * SECOND, 1 },
        { -MOTION_TRACK_POS_MAX_Q32, MOTION_TRACK_POS_MAX_Q32, 9 * SECOND, 2 },
        { MOTION_TRACK_POS_MAX_Q32, -MOTION_TRACK_POS_MAX_Q32, 20 * SECOND, 3 },
        { -MOTION_TRACK_POS_MAX_Q32, MOTION_TRACK_POS_MAX_Q32, LONG, 3 },
        { 0, 1, LONG, 3 },
        { 0, 1, 1, 1 },
        { 5, 5, 1, 3 },
        { 0, 2000, 1, 1 }, /* 1.9e6 unit/s for a quarter of a picosecond */
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct motion_track track = start_at(rows[i].from);
        const struct motion_state end = { .pos_q32 = rows[i].to }, rest = { 0 };
        assert_int_equal(motion_track_append_constraints(&track, rows[i].dur,
                                                         rows[i].order, &rest,
                                                         rows[i].order, &end),
                         0);
        assert_int_equal(sample_at(&track, 0).pos_q32, rows[i].from);
        assert_int_equal(sample_at(&track, rows[i].dur).pos_q32, rows[i].to);
        judge_definition(&track, NULL, &(uint64_t){ SEED });
        struct motion_sample s = sample_at(&track, rows[i].dur / 2);
        assert_true(
            size_of((quad)s.vel_q32 - exact(storage, 1, rows[i].dur / 2)) <=
            24 + size_of((quad)s.vel_q32) * power(-50));
    }
}

/* Travel so far that the sum has no bits for the last of it: those come in a
 * straight line, so that nothing jumps at the end. */
static void what_the_sum_cannot_hold_is_laid_over_it(void **state)
{
    const int64_t from = -MOTION_TRACK_POS_MAX_Q32;
    struct motion_track with = start_at(from), without = with;
    struct motion_segment other[1];
    (void)state;
    without.segment = other; /* the same sum, without the 7 */
    assert_int_equal(motion_track_append_line(&with, HOUR, -from - 1), 0);
    assert_int_equal(motion_track_append_line(&without, HOUR, -from - 8), 0);
    assert_int_equal(storage[0].frac, -3);
    assert_int_equal(storage[0].remainder, 7);
    assert_int_equal(other[0].remainder, 0);
    for (int64_t eighth = 0; eighth < 8; eighth++)
        assert_near(sample_at(&with, HOUR / 8 * eighth + 99).pos_q32 -
                        sample_at(&without, HOUR / 8 * eighth + 99).pos_q32,
                    7 * eighth / 8, 0, "laid over");
}

/* There the last bit of the sum is more acceleration than the format holds. */
static void the_shortest_segments_say_nothing_of_acceleration(void **state)
{
    const int64_t coef[3] = { 0, -1000, 0 };
    (void)state;
    for (int64_t dur = 1; dur <= 8; dur++) { /* to 2 picoseconds */
        struct motion_track track = start_at(0);
        assert_int_equal(
            motion_track_append_poly(&track, dur, 3, coef, 31, 0, 0), 0);
        for (int64_t t = 0; t < dur; t++)
            assert_int_equal(sample_at(&track, t).acc_q32, 0);
    }
}

/* 100 units in a microsecond: 5.8e14 unit/s2. */
static void beyond_its_format_an_acceleration_saturates(void **state)
{
    const struct motion_state rest = { 0 }, end = { .pos_q32 = 100 * ONE };
    struct motion_track track = start_at(0);
    (void)state;
    assert_int_equal(
        motion_track_append_quintic(&track, SECOND / 1000000, &rest, &end), 0);
    assert_int_equal(state_at(&track, SECOND / 5000000).acc_q32, INT64_MAX);
    assert_int_equal(state_at(&track, SECOND / 1250000).acc_q32, INT64_MIN);
    for (int64_t t = 0; t < SECOND / 1000000; t += 40960)
        assert_int_equal(sample_at(&track, t).acc_q32, 0);
}

/* --- extremes ------------------------------------------------------------- */

static void extremes_of_minimum_jerk_are_where_the_book_says(void **state)
{
    (void)state;
    struct motion_track track = start_at(ONE);
    struct motion_state rest = { 0 }, end = { .pos_q32 = 9 * ONE };
    struct motion_extreme e;
    assert_int_equal(
        motion_track_append_quintic(&track, 2 * SECOND, &rest, &end), 0);

    motion_track_extreme(&track, MOTION_POS, &e);
    assert_true(e.min == ONE && e.max == 9 * ONE);
    assert_true(e.min_ns_q12 == 0 && e.max_ns_q12 == 2 * SECOND);

    motion_track_extreme(&track, MOTION_VEL, &e); /* 15/8 D/T in the middle */
    assert_int_equal(e.min, 0);
    assert_near(e.max, 15 * ONE / 2, 1, "vel");
    assert_near(e.max_ns_q12, SECOND, SECOND / 1000000, "its time");

    motion_track_extreme(&track, MOTION_ACC, &e); /* 10/sqrt 3 D/T^2 */
    assert_near(e.max, 49594010490, 4, "acc");    /* 2 * 5.7735026919 * 2^32 */
    assert_near(e.min, -49594010490, 4, "acc");
    /* at (3 - sqrt 3)/6 and (3 + sqrt 3)/6 of T */
    assert_near(e.max_ns_q12, 1731173297399, 4096, "its time");
    assert_near(e.min_ns_q12, 6460826702601, 4096, "its time");

    motion_track_extreme(&track, MOTION_JERK, &e); /* 60 D/T^3, -30 D/T^3 */
    assert_near(e.max, 60 * ACC, 1, "jerk");
    assert_near(e.min, -30 * ACC, 1, "jerk");
    assert_near(e.min_ns_q12, SECOND, SECOND / 1000, "its time");
}

static int64_t quantity_of(const struct motion_state *s, int quantity)
{
    const int64_t of[] = { s->pos_q32, s->vel_q32, s->acc_q32, s->jerk_q32 };
    return of[quantity];
}

/* No sample is outside, and the extreme is taken where it is said to be. */
static void judge_extremes(const struct motion_track *track,
                           const struct any *any, uint64_t *seed)
{
    const struct motion_segment *segment = &track->segment[0];
    struct motion_extreme all[MOTION_JERK + 1];
    (void)any;
    (void)seed;
    motion_segment_extremes(segment, all);
    for (int q = 0; q < 4; q++) {
        struct motion_extreme e;
        struct motion_state s;
        motion_segment_extreme(segment, (enum motion_quantity)q, &e);
        assert_memory_equal(&e, &all[q], sizeof e);
        quad slack = q == 0 ? larger(4, 16 * power(-segment->frac))
                            : 2 + peak(segment, q) * power(-54);
        for (int i = 0; i <= 64; i++) {
            motion_segment_state(segment, segment->dur_ns_q12 / 64 * i, &s);
            quad value = (quad)quantity_of(&s, q);
            if (value > (quad)e.max + slack || value < (quad)e.min - slack)
                fail_msg("quantity %d: %" PRId64 " at %d/64 is outside %" PRId64
                         " .. %" PRId64 " (seed %" PRIu64 ")",
                         q, quantity_of(&s, q), i, e.min, e.max, SEED);
        }
        motion_segment_state(segment, e.min_ns_q12, &s);
        assert_int_equal(quantity_of(&s, q), e.min);
        motion_segment_state(segment, e.max_ns_q12, &s);
        assert_int_equal(quantity_of(&s, q), e.max);
    }
}

static void no_state_is_beyond_the_extremes(void **state)
{
    (void)state;
    for_any(judge_extremes);
}

/* The peak is the larger extreme without the rounding, as far as formats tell. */
static void judge_peak(const struct motion_track *track, const struct any *any,
                       uint64_t *seed)
{
    const struct motion_segment *segment = &track->segment[0];
    (void)any;
    (void)seed;
    for (int q = MOTION_ACC; q <= MOTION_JERK; q++) {
        const enum motion_quantity quantity = (enum motion_quantity)q;
        const int64_t rounding = motion_segment_rounding(segment, quantity);
        const int64_t got = motion_segment_peak(segment, quantity);
        struct motion_extreme e;
        motion_segment_extreme(segment, quantity, &e);
        const quad most = larger(-(quad)e.min, (quad)e.max);
        const quad want = larger(0, most - (quad)rounding);
        const quad slack = 2 + peak(segment, q) * power(-54);
        if (got < want - slack ||
            (most < (quad)INT64_MAX && got > want + 1)) /* rounded twice */
            fail_msg("quantity %d: %" PRId64 " of %" PRId64 " .. %" PRId64
                     ", rounding %" PRId64 " (seed %" PRIu64 ")",
                     q, got, e.min, e.max, rounding, SEED);
    }
}

static void a_peak_is_an_extreme_without_its_rounding(void **state)
{
    (void)state;
    for_any(judge_peak);
}

/* (u - 1/8)(u - 3/8)(u - 5/8)(u - 7/8) as the velocity: the position turns
 * four times, at known places. */
static void four_turns_in_one_segment_are_all_found(void **state)
{
    /* u^4 - 2u^3 + 43/32 u^2 - 11/32 u + 105/4096, integrated, times 15360 */
    const int64_t coef[5] = { 1575 * ONE / 4, -2640 * ONE, 6880 * ONE,
                              -7680 * ONE, 3072 * ONE };
    (void)state;
    struct motion_track track = start_at(0);
    struct motion_extreme e;
    int64_t sum = 0;
    for (int k = 0; k < 5; k++)
        sum += coef[k];
    assert_int_equal(
        motion_track_append_poly(&track, 8 * SECOND, 5, coef, 0, sum, 0), 0);
    motion_track_extreme(&track, MOTION_POS, &e);
    struct motion_state a = state_at(&track, SECOND);
    struct motion_state b = state_at(&track, 3 * SECOND);
    struct motion_state c = state_at(&track, 5 * SECOND);
    struct motion_state d = state_at(&track, 7 * SECOND);
    assert_near(a.vel_q32, 0, 2, "root 1/8");
    assert_near(b.vel_q32, 0, 2, "root 3/8");
    assert_near(c.vel_q32, 0, 2, "root 5/8");
    assert_near(d.vel_q32, 0, 2, "root 7/8");
    int64_t most = a.pos_q32 > c.pos_q32 ? a.pos_q32 : c.pos_q32;
    int64_t least = b.pos_q32 < d.pos_q32 ? b.pos_q32 : d.pos_q32;
    most = sum > most ? sum : most;
    least = least < 0 ? least : 0;
    assert_near(e.max, most, 2, "max");
    assert_near(e.min, least, 2, "min");
}

static void extremes_cover_the_track_and_an_empty_one(void **state)
{
    (void)state;
    struct motion_track track = start_at(4 * ONE);
    struct motion_extreme e;
    motion_track_extreme(&track, MOTION_POS, &e);
    assert_true(e.min == 4 * ONE && e.max == 4 * ONE);
    motion_track_extreme(&track, MOTION_ACC, &e);
    assert_true(e.min == 0 && e.max == 0);

    assert_int_equal(motion_track_append_line(&track, SECOND, 6 * ONE), 0);
    assert_int_equal(motion_track_append_line(&track, SECOND, -ONE), 0);
    assert_int_equal(motion_track_append_line(&track, SECOND, 6 * ONE), 0);
    motion_track_extreme(&track, MOTION_POS, &e);
    assert_true(e.max == 6 * ONE && e.max_ns_q12 == SECOND); /* the first */
    assert_true(e.min == -ONE && e.min_ns_q12 == 2 * SECOND);
    motion_track_extreme(&track, MOTION_VEL, &e);
    assert_true(e.max == 7 * ONE && e.max_ns_q12 == 2 * SECOND);
    assert_true(e.min == -7 * ONE && e.min_ns_q12 == SECOND);
}

static void steps_at_borders_are_measured(void **state)
{
    (void)state;
    struct motion_track track = start_at(0);
    struct motion_continuity worst;
    struct motion_state rest = { 0 }, end = { .pos_q32 = ONE };
    motion_track_continuity(&track, &worst);
    assert_true(worst.vel_step_q32 == 0 && worst.acc_step_q32 == 0);

    assert_int_equal(motion_track_append_quintic(&track, SECOND, &rest, &end),
                     0);
    motion_track_continuity(&track, &worst);
    assert_true(worst.pos_step_q32 == 0 && worst.vel_step_q32 <= 1);
    assert_true(worst.acc_step_q32 <= 1);

    end = (struct motion_state){ 3 * ONE, -ONE, 0, 0 };
    assert_int_equal(motion_track_append_line(&track, SECOND, 3 * ONE), 0);
    end.pos_q32 = 2 * ONE;
    assert_int_equal(motion_track_append_line(&track, SECOND, 2 * ONE), 0);
    assert_int_equal(motion_track_append_cubic(&track, 2 * SECOND, -ONE, &end),
                     0);
    motion_track_continuity(&track, &worst);
    assert_int_equal(worst.pos_step_q32, 0);
    assert_int_equal(worst.vel_step_q32, 3 * ONE);
    assert_int_equal(worst.vel_step_ns_q12, 2 * SECOND);
    /* a(0) = (6 D - 4 T v0 - 2 T v1) / T^2 = (0 + 8 + 4) / 4 */
    assert_int_equal(worst.acc_step_q32, 3 * ACC);
    assert_int_equal(worst.acc_step_ns_q12, 3 * SECOND);

    track.segment[2].pos_q32 -= 5; /* as no appending would leave it */
    motion_track_continuity(&track, &worst);
    assert_int_equal(worst.pos_step_q32, 5);

    track = start_at(0); /* to a stop from full speed */
    end = (struct motion_state){ ONE, 4 * ONE, 9 * ACC, 0 };
    assert_int_equal(motion_track_append_quintic(&track, SECOND, &rest, &end),
                     0);
    motion_track_continuity(&track, &worst);
    assert_int_equal(worst.vel_step_q32, 4 * ONE);
    assert_int_equal(worst.acc_step_q32, 9 * ACC);
    assert_int_equal(worst.acc_step_ns_q12, SECOND);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_line_goes_straight),
        cmocka_unit_test(a_dwell_stands_still),
        cmocka_unit_test(a_cubic_is_hermite_with_the_right_signs),
        cmocka_unit_test(a_quintic_meets_its_ends),
        cmocka_unit_test(hermite_reproduces_p_equals_t_on_uneven_keys),
        cmocka_unit_test(position_is_within_two_units_of_the_polynomial),
        cmocka_unit_test(derivatives_keep_their_precision),
        cmocka_unit_test(segments_meet_what_was_asked_at_both_ends),
        cmocka_unit_test(keys_are_hit_to_the_bit),
        cmocka_unit_test(position_never_steps_whatever_the_travel),
        cmocka_unit_test(a_tick_is_resolved_in_a_day_and_in_three),
        cmocka_unit_test(a_six_hour_move_does_not_drift),
        cmocka_unit_test(every_rate_sees_the_same_at_common_times),
        cmocka_unit_test(a_cursor_may_jump_anywhere),
        cmocka_unit_test(outside_its_time_a_track_rests_at_its_ends),
        cmocka_unit_test(the_earliest_time_is_before_the_latest_segment),
        cmocka_unit_test(fractions_below_the_format_carry_over_borders),
        cmocka_unit_test(a_fraction_does_not_carry_into_the_position),
        cmocka_unit_test(raw_coefficients_are_those_of_u),
        cmocka_unit_test(a_refusal_leaves_the_track_as_it_was),
        cmocka_unit_test(a_full_track_takes_no_more),
        cmocka_unit_test(raw_arguments_are_checked),
        cmocka_unit_test(the_far_ends_of_the_formats_are_reached),
        cmocka_unit_test(what_the_sum_cannot_hold_is_laid_over_it),
        cmocka_unit_test(the_shortest_segments_say_nothing_of_acceleration),
        cmocka_unit_test(beyond_its_format_an_acceleration_saturates),
        cmocka_unit_test(extremes_of_minimum_jerk_are_where_the_book_says),
        cmocka_unit_test(no_state_is_beyond_the_extremes),
        cmocka_unit_test(a_peak_is_an_extreme_without_its_rounding),
        cmocka_unit_test(four_turns_in_one_segment_are_all_found),
        cmocka_unit_test(extremes_cover_the_track_and_an_empty_one),
        cmocka_unit_test(steps_at_borders_are_measured),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
