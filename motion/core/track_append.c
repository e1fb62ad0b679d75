/* motion/core/track_append.c - the planner's half of track.h: making segments.
 *
 * Coefficients are worked out as 128-bit fixed point with 72 bits below the
 * unit ("q72"), then rounded to the segment's own scale.  72 = 32 + 31 + 5 and
 * 4 to spare: the finest c[5] (frac = 31) is a whole number of q72.  Every
 * given number is below 2^106 q72 (2^34 units), so the small combinations
 * below stay under 2^120. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/track_internal.h"

#define APPEND_WIDE   72
#define APPEND_BITS   106 /* of any given coefficient or tangent */
#define APPEND_MIN    (-14)
#define APPEND_MAX    31
#define APPEND_DEGREE MOTION_TRACK_DEGREE

/* 2^105 / (seconds in ns_q12), rounded down: 64 bits. */
#define APPEND_PER_SECOND UINT64_C(0x89705F4136B4A597)

/* What a segment must meet: the start's coefficients as given, the end's value
 * and derivatives with respect to u. */
struct append_goal {
    int64_t dur_ns_q12;
    int degree, given; /* a[1] .. a[given - 1] are given */
    struct motion_u128 a[APPEND_DEGREE + 1];
    int64_t end_pos_q32;
    uint64_t end_frac;
    struct motion_u128 vel, half_acc; /* p'(1), p''(1)/2 */
};

/* --- ratios -------------------------------------------------------------- */

/* Of two factors with their upper bits set: the product lacks one at most. */
static struct track_ratio append_ratio(struct motion_u128 product, int exponent)
{
    if (product.hi >> 63)
        return (struct track_ratio){ product.hi, exponent - 64 };
    return (struct track_ratio){ product.hi << 1 | product.lo >> 63,
                                 exponent - 63 };
}

struct track_ratio track_ratio_mul(struct track_ratio a, struct track_ratio b)
{
    return append_ratio(motion_fixed_mul_u64(a.mantissa, b.mantissa),
                        a.exponent + b.exponent);
}

/* inverse = 2^127 / (dur 2^n), so s/dur = s inverse 2^(n - 127); the seconds'
 * 42 bits are moved up by 22. */
struct track_ratio track_ratio_per_second(const struct motion_segment *segment)
{
    uint64_t second = (uint64_t)MOTION_FIXED_S_Q12 << 22;
    return append_ratio(motion_fixed_mul_u64(second, segment->inverse),
                        22 + 127 - segment->normalise);
}

static struct track_ratio append_seconds(int64_t dur_ns_q12)
{
    unsigned n = motion_fixed_clz_u64((uint64_t)dur_ns_q12);
    return append_ratio(
        motion_fixed_mul_u64((uint64_t)dur_ns_q12 << n, APPEND_PER_SECOND),
        105 + (int)n);
}

static unsigned append_bits(struct motion_u128 a)
{
    if (a.hi != 0)
        return 128 - motion_fixed_clz_u64(a.hi);
    return 64 - motion_fixed_clz_u64(a.lo);
}

/* |a| is brought to 63 bits (what is cut is 2^-62 of it), times the mantissa. */
int track_ratio_apply(struct motion_u128 a, struct track_ratio ratio, int shift,
                      unsigned limit_bits, struct motion_u128 *result)
{
    bool negative = motion_fixed_is_neg_i128(a);
    struct motion_u128 m = motion_fixed_abs_i128(a);
    unsigned cut = append_bits(m) > 63 ? append_bits(m) - 63 : 0;

    m = motion_fixed_shr_u128(m, cut);
    m = motion_fixed_mul_u64(m.lo, ratio.mantissa); /* < 2^127 */
    shift += (int)cut - ratio.exponent;
    if ((int)append_bits(m) + shift > (int)limit_bits)
        return MOTION_E_RANGE;
    if (shift >= 0)
        m = motion_fixed_shl_u128(m, shift > 127 ? 0 : (unsigned)shift);
    else
        m = motion_fixed_round_i128(m, (unsigned)-shift);
    *result = negative ? motion_fixed_neg_i128(m) : m;
    return MOTION_OK;
}

/* --- the polynomial ------------------------------------------------------ */

static struct motion_u128 append_sub(struct motion_u128 a, struct motion_u128 b)
{
    return motion_fixed_sub_u128(a, b);
}

static struct motion_u128 append_take(struct motion_u128 a,
                                      struct motion_u128 b, int32_t times)
{
    return append_sub(a, motion_fixed_mul_i128(b, times));
}

/* The coefficient of u^k when a[1] .. a[k-1] are settled and `open` conditions
 * (p; p, v; p, v, a/2) at u = 1 remain for as many coefficients.  With
 * p = (settled) + u^k q(u), q of degree open - 1, the conditions give
 *     q(1)    = P - sum a_i                              =: q0
 *     q'(1)   = V - sum i a_i - k q0                     =: q1
 *     q''(1)/2 = A/2 - sum i(i-1)/2 a_i - k q1 - k(k-1)/2 q0  =: q2
 * and a_k = q(0) = q0 - q1 + q2, Taylor's series at 1. */
static struct motion_u128 append_solve(const struct append_goal *goal,
                                       struct motion_u128 travel, int k,
                                       int open)
{
    struct motion_u128 q0 = travel, q1, q2;

    for (int i = 1; i < k; i++)
        q0 = append_sub(q0, goal->a[i]);
    if (open == 1) /* without tangents */
        return q0;
    q1 = goal->vel;
    q2 = goal->half_acc;
    for (int i = 1; i < k; i++) {
        q1 = append_take(q1, goal->a[i], i);
        q2 = append_take(q2, goal->a[i], i * (i - 1) / 2);
    }
    q1 = append_take(q1, q0, k);
    if (open == 2)
        return append_sub(q0, q1);
    q2 = append_take(append_take(q2, q1, k), q0, k * (k - 1) / 2);
    return motion_fixed_add_u128(append_sub(q0, q1), q2);
}

/* C(n, k) */
static const uint8_t append_choose[APPEND_DEGREE + 1][APPEND_DEGREE + 1] = {
    { 1 },          { 1, 1 },          { 1, 2, 1 },
    { 1, 3, 3, 1 }, { 1, 4, 6, 4, 1 }, { 1, 5, 10, 10, 5, 1 },
};

/* Bounds of |a[k]| in units of 2^down, at most 2^31. */
struct append_sizes {
    uint32_t a[APPEND_DEGREE + 1];
    int down;
};

static void append_sizes(const struct append_goal *goal,
                         struct append_sizes *sizes)
{
    struct motion_u128 m[APPEND_DEGREE + 1], all = { 0, 0 };

    *sizes = (struct append_sizes){ .down = 0 };
    for (int k = 1; k <= goal->degree; k++) {
        m[k] = motion_fixed_abs_i128(goal->a[k]);
        all.hi |= m[k].hi;
        all.lo |= m[k].lo;
    }
    sizes->down = (int)append_bits(all) - 31;
    if (sizes->down < 0)
        sizes->down = 0;
    for (int k = 1; k <= goal->degree; k++)
        sizes->a[k] =
            1 + (uint32_t)motion_fixed_shr_u128(m[k], (unsigned)sizes->down).lo;
}

/* sum over i >= k + order of C(i - k, order) |c_i| 2^-(i-k-order), c_i = 2^i
 * a_i: the bound of partial sum k of Horner scheme `order` at w = 1/2.  Below
 * 2^31 * 5 * 10 * 2^5. */
static uint64_t append_partial(const struct append_sizes *sizes, int degree,
                               int k, int order)
{
    uint64_t sum = 0;

    for (int i = k + order > 0 ? k + order : 1; i <= degree; i++)
        sum += (uint64_t)sizes->a[i] * append_choose[i - k][order];
    return sum << (k + order);
}

/* The largest exponent that keeps every partial sum of the tick under 2^62.
 * One c is a * 2^(32 + frac - 72). */
static int append_exponent(const struct append_goal *goal,
                           const struct append_sizes *sizes)
{
    uint64_t most = 0;

    for (int order = 0; order <= 2; order++)
        for (int k = 0; k + order <= goal->degree; k++)
            most |= append_partial(sizes, goal->degree, k, order);
    int bits = 64 - (int)motion_fixed_clz_u64(most) + sizes->down;
    return 62 - 32 + APPEND_WIDE - bits;
}

static int append_frac(const struct append_goal *goal,
                       const struct append_sizes *sizes)
{
    int frac = append_exponent(goal, sizes);

    if (frac == 1) /* 2^(32 - frac) would not fit pos_scale */
        return 0;
    return frac < APPEND_MAX ? frac : APPEND_MAX;
}

/* b - a, from 32 bits below the unit to q72. */
static struct motion_u128 append_displacement(int64_t a_q32, int64_t b_q32)
{
    struct motion_u128 d =
        append_sub(motion_fixed_from_i64(b_q32), motion_fixed_from_i64(a_q32));
    return (struct motion_u128){ d.hi << 40 | d.lo >> 24, d.lo << 40 };
}

/* Travel from the segment's start to its end, in q72 and as the segment can
 * hold it: in steps of 2^-(32+frac). */
static struct motion_u128 append_travel(const struct append_goal *goal,
                                        const struct motion_segment *segment)
{
    struct motion_u128 d =
        append_displacement(segment->pos_q32, goal->end_pos_q32);

    if (segment->frac < 0) {
        d.lo &= ~((UINT64_C(1) << (40 - segment->frac)) - 1);
        return d;
    }
    unsigned unit = 40 - (unsigned)segment->frac;
    uint64_t below = (goal->end_frac >> 33) >> (31 - segment->frac);
    return motion_fixed_add_u128(
        d, track_shifted((int64_t)below - segment->coef[0], unit));
}

/* a / 2^bits to nearest, 2 <= bits <= 63, |result| < 2^62. */
static int64_t append_rounded(struct motion_u128 a, unsigned bits)
{
    const uint64_t minus = (uint64_t)((int64_t)a.hi >> 63);
    const struct motion_u128 m = motion_fixed_sign_i128(a, minus);
    const uint64_t twice = m.hi << (65 - bits) | m.lo >> (bits - 1);
    return (int64_t)((((twice + 1) >> 1) ^ minus) - minus);
}

/* All a[k]: exact (segment NULL: travel as given), or each rounded to what
 * c[k] can hold before the next is solved, so that the later ones make up for
 * it: the end's value is then exact and its derivatives are within the
 * rounding of the last coefficients. */
static void append_settle(struct append_goal *goal, struct motion_u128 travel,
                          struct motion_segment *segment)
{
    for (int k = 1; k <= goal->degree; k++) {
        if (k >= goal->given)
            goal->a[k] = append_solve(goal, travel, k, goal->degree + 1 - k);
        if (segment != NULL) {
            unsigned unit = (unsigned)(40 - segment->frac - k);
            segment->coef[k] = append_rounded(goal->a[k], unit);
            goal->a[k] = track_shifted(segment->coef[k], unit);
            if (segment->coef[k] != 0)
                segment->degree = (uint8_t)k;
        }
    }
}

/* --- what the tick needs ------------------------------------------------- */

/* mantissa / 2^exponent * 2^shift as a whole number below 2^62, and how far
 * the result must be shifted left where that does not suffice. */
static uint8_t append_scale(struct track_ratio ratio, int shift, int32_t *high,
                            int32_t *low)
{
    uint64_t scale = ratio.mantissa >> 2;
    int right = ratio.exponent - shift - 2;
    int left = right < 0 ? -right : 0;

    if (right > 63)
        scale = 0;
    else if (right > 0)
        scale = ((scale >> (right - 1)) + 1) >> 1;
    *low = (int32_t)(uint32_t)scale;
    *high = (int32_t)((scale + 0x80000000u) >> 32);
    return (uint8_t)left;
}

/* Under 0.7 ns the last bits of a are more acceleration than the format
 * holds. */
#define APPEND_ACC_SHIFT_MAX 31

static uint8_t append_kind(const struct motion_segment *segment)
{
    if (segment->frac <= 0 && segment->acc_shift == 0 &&
        segment->vel_shift < 16)
        return MOTION_SEGMENT_FAR;
    if (segment->frac <= 0 || segment->acc_shift != 0 ||
        segment->vel_shift != 0)
        return MOTION_SEGMENT_SHORT;
    return segment->degree > 3 ? MOTION_SEGMENT_QUINTIC : MOTION_SEGMENT_CUBIC;
}

/* vel [2^-32/s]     = dp/dw / 2 / 2^frac s/dur, times 2^64 / 2^64
 * acc [2^-32/s2]    = a 2^32 2 / 4 / 2^frac (s/dur)^2, times 2^32 / 2^32
 */
static void append_derive(struct motion_segment *segment,
                          struct track_ratio rate)
{
    segment->vel_shift =
        append_scale(rate, 64 - 1 - segment->frac, &segment->vel_scale_high,
                     &segment->vel_scale_low);
    segment->acc_shift =
        append_scale(track_ratio_mul(rate, rate), 64 - 1 - segment->frac,
                     &segment->acc_scale_high, &segment->acc_scale_low);
    if (segment->acc_shift > APPEND_ACC_SHIFT_MAX)
        segment->acc_scale_high = segment->acc_scale_low = 0;
    segment->pos_scale = segment->frac > 0
                             ? (int32_t)(UINT32_C(1) << (32 - segment->frac))
                             : (int32_t)(UINT32_C(1) << -segment->frac);
    segment->kind = append_kind(segment);
    if (segment->kind == MOTION_SEGMENT_FAR)
        segment->vel_factor = (uint16_t)(1u << segment->vel_shift);
}

static void append_time(struct motion_segment *segment, int64_t start_ns_q12,
                        int64_t dur_ns_q12)
{
    unsigned n = motion_fixed_clz_u64((uint64_t)dur_ns_q12) & 63;
    uint64_t d = (uint64_t)dur_ns_q12 << n;
    struct motion_u128 one = { UINT64_C(1) << 63, 0 };

    segment->start_ns_q12 = start_ns_q12;
    segment->dur_ns_q12 = dur_ns_q12;
    segment->normalise = (uint8_t)n;
    if (motion_fixed_div_u128(one, d, &segment->inverse, NULL) < 0)
        segment->inverse = UINT64_MAX; /* d = 2^63: 2^64 does not fit */
}

/* --- formats ------------------------------------------------------------- */

/* Bezier control points of p (relative to the start), times 60 so that they
 * are whole: b_j = sum C(j,k) / C(n,k) a_k. */
static void append_polygon(const struct append_goal *goal,
                           struct motion_u128 *point)
{
    const int n = goal->degree;

    for (int j = 0; j <= n; j++) {
        point[j] = (struct motion_u128){ 0, 0 };
        for (int k = 1; k <= j; k++) {
            int32_t weight = append_choose[j][k] * (60 / append_choose[n][k]);
            point[j] = motion_fixed_add_u128(
                point[j], motion_fixed_mul_i128(goal->a[k], weight));
        }
    }
}

/* |a| <= 60 * limit? */
static bool append_within(struct motion_u128 a, int64_t limit)
{
    struct motion_u128 top =
        motion_fixed_mul_i128(motion_fixed_from_i64(limit), 60);
    return motion_fixed_cmp_u128(motion_fixed_abs_i128(a), top) <= 0;
}

/* points become n times their differences, the control points of the
 * derivative; all of them times ratio * 2^shift must be within the limit. */
static int append_check_derivative(struct motion_u128 *point, int n,
                                   struct track_ratio ratio, int shift,
                                   int64_t limit)
{
    struct motion_u128 value;

    for (int j = 0; j < n; j++) {
        point[j] = motion_fixed_mul_i128(append_sub(point[j + 1], point[j]), n);
        if (track_ratio_apply(point[j], ratio, shift, 100, &value) < 0 ||
            !append_within(value, limit))
            return MOTION_E_RANGE;
    }
    return MOTION_OK;
}

/* Whether sums of sizes alone say that position, velocity and acceleration stay
 * below 2^62 in their formats, with a factor of two for the rounding of
 * coefficients: nearly always. */
static bool append_is_far_inside(const struct append_goal *goal,
                                 const struct append_sizes *sizes,
                                 const struct motion_segment *segment,
                                 struct track_ratio rate)
{
    uint64_t pos = 0, vel = 0, acc = 0;

    for (uint32_t k = 1; k <= (uint32_t)goal->degree; k++) {
        pos += sizes->a[k];
        vel += (uint64_t)sizes->a[k] * k;
        acc += (uint64_t)sizes->a[k] * k * (k - 1);
    }
    const int q72 = 64 - APPEND_WIDE + sizes->down;
    const int top = 64 - rate.exponent; /* 1 s / dur < 2^top */
    return motion_fixed_abs(segment->pos_q32) >> 61 == 0 &&
           q72 - (int)motion_fixed_clz_u64(pos) + 32 <= 60 &&
           q72 - (int)motion_fixed_clz_u64(vel) + 32 + top <= 60 &&
           q72 - (int)motion_fixed_clz_u64(acc) + 32 + 2 * top <= 60;
}

/* A polynomial stays between its control points.  After the choice of frac
 * they are below 2^116 q72, times 60 below 2^122.  Samples of an acceleration
 * that may leave its format are 0. */
static int append_check_range(const struct append_goal *goal,
                              const struct append_sizes *sizes,
                              struct track_ratio rate,
                              struct motion_segment *segment)
{
    struct motion_u128 point[APPEND_DEGREE + 1];
    struct motion_u128 start =
        motion_fixed_mul_i128(motion_fixed_from_i64(segment->pos_q32), 60);
    int n = goal->degree, err;

    if (append_is_far_inside(goal, sizes, segment, rate))
        return MOTION_OK;
    append_polygon(goal, point);
    for (int j = 0; j <= n; j++) {
        struct motion_u128 travel = motion_fixed_round_i128(point[j], 40);
        if (!append_within(motion_fixed_add_u128(start, travel),
                           MOTION_TRACK_POS_MAX_Q32))
            return MOTION_E_RANGE;
    }
    err = append_check_derivative(point, n, rate, 32 - APPEND_WIDE,
                                  MOTION_TRACK_VEL_MAX_Q32);
    if (err < 0 || n < 2)
        return err;
    if (append_check_derivative(point, n - 1, track_ratio_mul(rate, rate),
                                32 - APPEND_WIDE, MOTION_TRACK_ACC_MAX_Q32) < 0)
        segment->acc_scale_high = segment->acc_scale_low = 0;
    return MOTION_OK;
}

/* --- appending ----------------------------------------------------------- */

static bool append_is_pos(int64_t pos_q32)
{
    return pos_q32 >= -MOTION_TRACK_POS_MAX_Q32 &&
           pos_q32 <= MOTION_TRACK_POS_MAX_Q32;
}

static int append_open(const struct motion_track *track, int64_t dur_ns_q12)
{
    if (dur_ns_q12 < 1 || dur_ns_q12 > MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return MOTION_E_ARG;
    if (track->count >= track->capacity)
        return MOTION_E_FULL;
    if (track->end_ns_q12 > MOTION_TRACK_MAX_NS_Q12 - dur_ns_q12)
        return MOTION_E_RANGE;
    return MOTION_OK;
}

static int append_fit(const struct motion_track *track,
                      struct append_goal *goal, struct motion_segment *segment)
{
    struct motion_u128 exact =
        append_displacement(track->end.pos_q32, goal->end_pos_q32);

    *segment = (struct motion_segment){ .pos_q32 = track->end.pos_q32 };
    append_time(segment, track->end_ns_q12, goal->dur_ns_q12);
    append_settle(goal, exact, NULL);

    struct append_sizes sizes;
    append_sizes(goal, &sizes);
    int frac = append_frac(goal, &sizes);
    if (frac < APPEND_MIN)
        return MOTION_E_RANGE;
    segment->frac = (int8_t)frac;
    if (frac < 0) {
        uint64_t travel =
            (uint64_t)goal->end_pos_q32 - (uint64_t)segment->pos_q32;
        segment->remainder = (int32_t)(travel & ((UINT64_C(1) << -frac) - 1));
    } else {
        segment->coef[0] = (int64_t)((track->end_frac >> 33) >> (31 - frac));
    }
    append_settle(goal, append_travel(goal, segment), segment);
    goal->degree = segment->degree;
    const struct track_ratio rate = track_ratio_per_second(segment);
    append_derive(segment, rate);
    return append_check_range(goal, &sizes, rate, segment);
}

static int append_commit(struct motion_track *track, struct append_goal *goal)
{
    struct motion_segment segment;
    int err;

    if (!append_is_pos(goal->end_pos_q32))
        return MOTION_E_RANGE;
    err = append_fit(track, goal, &segment);
    if (err < 0)
        return err;
    track->segment[track->count++] = segment;
    track->summary = NULL;
    track->end_ns_q12 += segment.dur_ns_q12;
    track->end.pos_q32 = goal->end_pos_q32;
    track_segment_end(&segment, &track->end);
    track->end_frac = goal->end_frac;
    return MOTION_OK;
}

/* The derivatives with respect to u that a state has: v T, a T^2 / 2. */
static int append_tangents(const struct motion_state *state, int order,
                           struct track_ratio seconds, struct motion_u128 *vel,
                           struct motion_u128 *half_acc)
{
    int err = MOTION_OK;

    if (order >= 2)
        err = track_ratio_apply(motion_fixed_from_i64(state->vel_q32), seconds,
                                APPEND_WIDE - 32, APPEND_BITS, vel);
    if (err == MOTION_OK && order >= 3)
        err = track_ratio_apply(motion_fixed_from_i64(state->acc_q32),
                                track_ratio_mul(seconds, seconds),
                                APPEND_WIDE - 32 - 1, APPEND_BITS, half_acc);
    return err;
}

int motion_track_append_constraints(struct motion_track *track,
                                    int64_t dur_ns_q12, int start_order,
                                    const struct motion_state *start,
                                    int end_order,
                                    const struct motion_state *end)
{
    struct append_goal goal = {
        .dur_ns_q12 = dur_ns_q12,
        .degree = start_order + end_order - 1,
        .given = start_order,
        .end_pos_q32 = end->pos_q32,
    };
    int err = append_open(track, dur_ns_q12);

    if (start_order < 1 || start_order > 3 || end_order < 1 || end_order > 3)
        return MOTION_E_ARG;
    if (err < 0)
        return err;

    struct track_ratio seconds = append_seconds(dur_ns_q12);
    err = append_tangents(start, start_order, seconds, &goal.a[1], &goal.a[2]);
    if (err < 0)
        return err;
    err = append_tangents(end, end_order, seconds, &goal.vel, &goal.half_acc);
    if (err < 0)
        return err;
    return append_commit(track, &goal);
}

int motion_track_append_poly(struct motion_track *track, int64_t dur_ns_q12,
                             int degree, const int64_t coef[], unsigned frac,
                             int64_t end_pos_q32, uint64_t end_frac)
{
    struct append_goal goal; /* without tangents, and a[] by itself */
    int err = append_open(track, dur_ns_q12);

    if (degree < 1 || degree > APPEND_DEGREE || frac > APPEND_MAX)
        return MOTION_E_ARG;
    if (err < 0)
        return err;
    goal.dur_ns_q12 = dur_ns_q12;
    goal.degree = goal.given = degree;
    goal.end_pos_q32 = end_pos_q32;
    goal.end_frac = end_frac;
    for (int k = 1; k < degree; k++) /* < 2^63 * 2^40 */
        goal.a[k] = track_shifted(coef[k - 1], 40 - frac);
    return append_commit(track, &goal);
}

int motion_track_append_dwell(struct motion_track *track, int64_t dur_ns_q12)
{
    return motion_track_append_line(track, dur_ns_q12, track->end.pos_q32);
}

int motion_track_append_line(struct motion_track *track, int64_t dur_ns_q12,
                             int64_t pos_q32)
{
    const struct motion_state end = { .pos_q32 = pos_q32 };
    return motion_track_append_constraints(track, dur_ns_q12, 1, &end, 1, &end);
}

int motion_track_append_cubic(struct motion_track *track, int64_t dur_ns_q12,
                              int64_t start_vel_q32,
                              const struct motion_state *end)
{
    const struct motion_state start = { .vel_q32 = start_vel_q32 };
    return motion_track_append_constraints(track, dur_ns_q12, 2, &start, 2,
                                           end);
}

int motion_track_append_quintic(struct motion_track *track, int64_t dur_ns_q12,
                                const struct motion_state *start,
                                const struct motion_state *end)
{
    return motion_track_append_constraints(track, dur_ns_q12, 3, start, 3, end);
}

/* --- restoring ------------------------------------------------------------ */

static bool restore_is_time(const struct motion_segment *segment)
{
    return segment->dur_ns_q12 >= 1 &&
           segment->dur_ns_q12 <= MOTION_TRACK_SEGMENT_MAX_NS_Q12 &&
           segment->start_ns_q12 >= 0 &&
           segment->start_ns_q12 <=
               MOTION_TRACK_MAX_NS_Q12 - segment->dur_ns_q12;
}

/* What appending makes of the parts below the steps: c[0] where there are steps
 * below 2^-32, a remainder where there are none that small. */
static bool restore_is_form(const struct motion_segment *segment)
{
    const int below = segment->frac > 0 ? segment->frac : 0;
    const int above = segment->frac < 0 ? -segment->frac : 0;

    if (segment->frac < APPEND_MIN || segment->frac > APPEND_MAX ||
        segment->frac == 1 || !append_is_pos(segment->pos_q32))
        return false;
    if (segment->coef[0] < 0 || segment->coef[0] >= (int64_t)1 << below ||
        segment->remainder < 0 || segment->remainder >= (int32_t)1 << above)
        return false;
    for (int k = 1; k <= APPEND_DEGREE; k++)
        if (motion_fixed_abs(segment->coef[k]) >= UINT64_C(1) << 62)
            return false;
    return true;
}

/* Rounding may have carried a sum over the power of two that frac was chosen
 * by; there is a factor of two above it. */
int motion_segment_restore(struct motion_segment *segment)
{
    struct append_goal goal = { .degree = APPEND_DEGREE };

    if (!restore_is_time(segment) || !restore_is_form(segment))
        return MOTION_E_ARG;
    segment->degree = 0;
    for (int k = 1; k <= APPEND_DEGREE; k++) {
        goal.a[k] =
            track_shifted(segment->coef[k], (unsigned)(40 - segment->frac - k));
        if (segment->coef[k] != 0)
            segment->degree = (uint8_t)k;
    }
    goal.degree = segment->degree;
    struct append_sizes sizes;
    append_sizes(&goal, &sizes);
    if (segment->frac > append_exponent(&goal, &sizes) + 1)
        return MOTION_E_RANGE;
    segment->vel_factor = 0;
    append_time(segment, segment->start_ns_q12, segment->dur_ns_q12);
    const struct track_ratio rate = track_ratio_per_second(segment);
    append_derive(segment, rate);
    return append_check_range(&goal, &sizes, rate, segment);
}
