/* motion/core/track_state.c - see track.h: exact states, extremes, continuity.
 *
 * The polynomials are evaluated with 128 bits: coefficients (62 bits) times at
 * most 60, moved up by 40, make under 2^109. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/track_internal.h"

#define STATE_GUARD 40

/* --- evaluation ---------------------------------------------------------- */

/* a u / 2^64, towards zero. */
static struct motion_u128 state_mul(struct motion_u128 a, uint64_t u_q64)
{
    struct motion_u128 m = motion_fixed_abs_i128(a);
    struct motion_u128 high = motion_fixed_mul_u64(m.hi, u_q64);
    uint64_t low = motion_fixed_mulhi_u64(m.lo, u_q64);

    m = motion_fixed_add_u128(high, (struct motion_u128){ 0, low });
    return motion_fixed_is_neg_i128(a) ? motion_fixed_neg_i128(m) : m;
}

/* k (k-1) .. (k - order + 1) */
static int32_t state_falling(int k, int order)
{
    int32_t product = 1;

    for (int i = 0; i < order; i++)
        product *= k - i;
    return product;
}

/* c k: 62 and 6 bits. */
static struct motion_u128 state_times(int64_t c, int32_t k)
{
    uint64_t low = (uint64_t)(uint32_t)c * (uint32_t)k;
    int64_t high = (c >> 32) * k + (int64_t)(low >> 32);

    return (struct motion_u128){ (uint64_t)(high >> 32),
                                 (uint64_t)high << 32 | (uint32_t)low };
}

/* At the end: the sum of coef[k] 2^-k, doubled from term to term. */
static struct motion_u128 state_whole(const struct motion_segment *segment,
                                      int order)
{
    struct motion_u128 sum = { 0, 0 };

    for (int k = order; k <= segment->degree; k++) {
        sum = motion_fixed_add_u128(sum, sum);
        sum = motion_fixed_add_u128(
            sum, state_times(segment->coef[k], state_falling(k, order)));
    }
    return motion_fixed_shl_u128(sum, STATE_GUARD - segment->degree);
}

/* Derivative `order` with respect to u, times 2^(32 + frac + STATE_GUARD); u =
 * 1 where `whole`. */
static struct motion_u128 state_polynomial(const struct motion_segment *segment,
                                           int order, bool whole,
                                           uint64_t u_q64)
{
    struct motion_u128 sum = { 0, 0 };

    if (whole)
        return state_whole(segment, order);
    for (int k = segment->degree; k >= order; k--) {
        struct motion_u128 c = motion_fixed_shl_u128(
            state_times(segment->coef[k], state_falling(k, order)),
            STATE_GUARD - (unsigned)k);
        sum = motion_fixed_add_u128(state_mul(sum, u_q64), c);
    }
    return sum;
}

/* dt / dur as Q0.64, at most 3 units too small. */
static uint64_t state_fraction_q64(const struct motion_segment *segment,
                                   uint64_t dt)
{
    struct motion_u128 product =
        motion_fixed_mul_u64(dt << segment->normalise, segment->inverse);
    return motion_fixed_shr_u128(product, 63).lo;
}

static int64_t state_saturate(struct motion_u128 a, struct track_ratio ratio,
                              int shift)
{
    struct motion_u128 value;
    int64_t result;

    if ((a.hi | a.lo) == 0)
        return 0;
    if (track_ratio_apply(a, ratio, shift, 64, &value) < 0 ||
        motion_fixed_to_i64(value, &result) < 0)
        return motion_fixed_is_neg_i128(a) ? INT64_MIN : INT64_MAX;
    return result;
}

/* The value at the end: whole by construction, see track_append.c. */
static int64_t state_end_pos(const struct motion_segment *segment)
{
    struct motion_u128 sum = motion_fixed_shl_u128(
        state_polynomial(segment, 0, true, 0), 64 - STATE_GUARD);
    int64_t steps = (int64_t)sum.hi; /* of 2^-(32+frac), below 2^62 */
    uint64_t travel;

    if (segment->frac >= 0)
        travel = (uint64_t)(steps >> segment->frac);
    else
        travel = (sum.hi << -segment->frac) + (uint64_t)segment->remainder;
    return (int64_t)((uint64_t)segment->pos_q32 + travel);
}

/* The derivatives at u, or at the end where `whole`. */
static void state_derive(const struct motion_segment *segment, bool whole,
                         uint64_t u, struct motion_state *state)
{
    const struct track_ratio rate = track_ratio_per_second(segment);
    const struct track_ratio rate2 = track_ratio_mul(rate, rate);
    const struct track_ratio rate3 = track_ratio_mul(rate2, rate);
    const int shift = -segment->frac - STATE_GUARD;

    state->vel_q32 =
        state_saturate(state_polynomial(segment, 1, whole, u), rate, shift);
    state->acc_q32 =
        state_saturate(state_polynomial(segment, 2, whole, u), rate2, shift);
    state->jerk_q32 =
        state_saturate(state_polynomial(segment, 3, whole, u), rate3, shift);
}

void track_segment_end(const struct motion_segment *segment,
                       struct motion_state *state)
{
    state_derive(segment, true, 0, state);
}

void motion_segment_state(const struct motion_segment *segment,
                          int64_t t_ns_q12, struct motion_state *state)
{
    bool whole = t_ns_q12 >= segment->dur_ns_q12;
    uint64_t dt = t_ns_q12 < 0 || whole ? 0 : (uint64_t)t_ns_q12;
    struct motion_sample sample;

    state_derive(segment, whole, state_fraction_q64(segment, dt), state);
    if (whole) {
        state->pos_q32 = state_end_pos(segment);
        return;
    }
    track_segment_sample(segment, &sample, dt);
    state->pos_q32 = sample.pos_q32;
}

void motion_track_state(const struct motion_track *track, int64_t t_ns_q12,
                        struct motion_state *state)
{
    *state = (struct motion_state){ .pos_q32 = track->end.pos_q32 };
    if (track->count == 0)
        return;
    if (t_ns_q12 < 0) {
        state->pos_q32 = track->segment[0].pos_q32;
    } else if (t_ns_q12 == track->end_ns_q12) {
        *state = track->end;
    } else if (t_ns_q12 < track->end_ns_q12) {
        const struct motion_segment *segment =
            &track->segment[track_find(track, t_ns_q12)];
        state->pos_q32 = segment->pos_q32;
        if (motion_track_ahead(track, t_ns_q12) > 0)
            motion_segment_state(segment, t_ns_q12 - segment->start_ns_q12,
                                 state);
    }
}

/* --- extremes ------------------------------------------------------------ */

/* Times where a polynomial changes sign, each the last step before it. */
struct state_roots {
    int64_t at[MOTION_TRACK_DEGREE];
    int count;
};

static int state_sign(const struct motion_segment *segment, int order,
                      bool whole, uint64_t u_q64)
{
    struct motion_u128 value = state_polynomial(segment, order, whole, u_q64);

    if (motion_fixed_is_neg_i128(value))
        return -1;
    return value.hi != 0 || value.lo != 0;
}

/* Derivative `order` in 64 bits, which is enough to see its sign almost
 * everywhere.  Coefficients, 62 bits, are cut by 11 and taken times their
 * factor, at most 120, and 2^(5 - k), together at most 120: each is below 2^58
 * and off by less than 120.  So values are below 2^61, and off by less than six
 * times 121. */
#define STATE_QUICK_SURE 1024
struct state_quick {
    const struct motion_segment *segment;
    int order;
    int64_t coef[MOTION_TRACK_DEGREE + 1];
};

static struct state_quick state_quick(const struct motion_segment *segment,
                                      int order)
{
    struct state_quick quick = { segment, order, { 0 } };

    for (int k = order; k <= segment->degree && k <= MOTION_TRACK_DEGREE; k++)
        quick.coef[k] = (segment->coef[k] >> 11) * state_falling(k, order) *
                        (1 << (MOTION_TRACK_DEGREE - k));
    return quick;
}

static int64_t state_quick_value(const struct state_quick *quick, bool whole,
                                 uint64_t u_q64)
{
    int64_t sum = 0;

    for (int k = quick->segment->degree; k >= quick->order; k--) {
        if (!whole) {
            const int64_t part =
                (int64_t)motion_fixed_mulhi_u64(motion_fixed_abs(sum), u_q64);
            sum = sum < 0 ? -part : part;
        }
        sum += quick->coef[k];
    }
    return sum;
}

/* A place on the way to a root: when, and what the derivative is there. */
struct state_side {
    int64_t at;
    int sign;
    uint64_t size;
};

static struct state_side state_side(const struct state_quick *quick,
                                    int64_t t_ns_q12)
{
    const struct motion_segment *segment = quick->segment;
    const bool whole = t_ns_q12 == segment->dur_ns_q12;
    const uint64_t u =
        whole ? 0 : state_fraction_q64(segment, (uint64_t)t_ns_q12);
    const int64_t value = state_quick_value(quick, whole, u);
    struct state_side side = { t_ns_q12, value < 0 ? -1 : 1,
                               motion_fixed_abs(value) };

    if (side.size < STATE_QUICK_SURE)
        side.sign = state_sign(segment, quick->order, whole, u);
    return side;
}

/* Where the straight line between both sides is zero, at least one step inside.
 * Sizes are cut to 32 bits together: a < 2^32, a 2^31 / (a + b) <= 2^31. */
static int64_t state_between(const struct state_side *low,
                             const struct state_side *high)
{
    const unsigned bits = 64 - motion_fixed_clz_u64(low->size | high->size);
    const unsigned shift = bits > 32 ? bits - 32 : 0;
    const uint64_t a = low->size >> shift, b = high->size >> shift;
    const int64_t span = high->at - low->at;
    int64_t part = span / 2;

    if (a + b != 0)
        part = (int64_t)motion_fixed_mulhi_u64((uint64_t)span << 1,
                                               ((a << 31) / (a + b)) << 32);
    if (part < 1)
        part = 1;
    return low->at + (part < span - 1 ? part : span - 1);
}

/* From two sides of different sign down to one step; the lower one.  The
 * straight line between the two goes to the root in few steps when the size of
 * one that stays for a second time counts half (Illinois: Dowell and Jarratt,
 * BIT 11, 1971); where it does not halve the distance, the next step does, so
 * there are at most 120. */
static int64_t state_search(const struct state_quick *quick,
                            struct state_side low, struct state_side high)
{
    bool halve = false, low_stayed = false, high_stayed = false;

    while (high.at - low.at > 1) {
        const int64_t span = high.at - low.at;
        const struct state_side side = state_side(
            quick, halve ? low.at + span / 2 : state_between(&low, &high));
        if (side.sign == low.sign) {
            high.size >>= high_stayed;
            low = side;
        } else {
            low.size >>= low_stayed;
            high = side;
        }
        high_stayed = low.at == side.at;
        low_stayed = !high_stayed;
        halve = !halve && high.at - low.at > span / 2;
    }
    return low.at;
}

/* From the roots of derivative order + 1 to those of derivative `order`, which
 * between two of them is monotonic and has one root at most. */
static void state_roots_below(const struct motion_segment *segment, int order,
                              struct state_roots *roots)
{
    const struct state_quick quick = state_quick(segment, order);
    const struct state_roots above = *roots;
    struct state_side low = state_side(&quick, 0);

    roots->count = 0;
    for (int i = 0; i <= above.count; i++) {
        const struct state_side high = state_side(
            &quick, i < above.count ? above.at[i] : segment->dur_ns_q12);
        if (high.at > low.at && low.sign != high.sign)
            roots->at[roots->count++] = state_search(&quick, low, high);
        low = high;
    }
}

/* (1 s / duration)^order, order >= 1 */
static struct track_ratio state_rate(const struct motion_segment *segment,
                                     int order)
{
    const struct track_ratio rate = track_ratio_per_second(segment);
    struct track_ratio power = rate;

    for (int i = 1; i < order; i++)
        power = track_ratio_mul(power, rate);
    return power;
}

/* Derivative `order` with respect to u, as state_polynomial. */
static struct motion_u128 state_raw(const struct motion_segment *segment,
                                    int order, int64_t dt_ns_q12)
{
    const bool whole = dt_ns_q12 >= segment->dur_ns_q12;
    const uint64_t u =
        whole ? 0 : state_fraction_q64(segment, (uint64_t)dt_ns_q12);

    return state_polynomial(segment, order, whole, u);
}

int64_t track_segment_derivative(const struct motion_segment *segment,
                                 int order, int64_t dt_ns_q12)
{
    return state_saturate(state_raw(segment, order, dt_ns_q12),
                          state_rate(segment, order),
                          -segment->frac - STATE_GUARD);
}

/* One quantity of motion_segment_state. */
static int64_t state_quantity(const struct motion_segment *segment,
                              enum motion_quantity quantity, int64_t t_ns_q12)
{
    struct motion_sample sample;

    if (quantity != MOTION_POS)
        return track_segment_derivative(segment, (int)quantity, t_ns_q12);
    if (t_ns_q12 >= segment->dur_ns_q12)
        return state_end_pos(segment);
    track_segment_sample(segment, &sample, (uint64_t)t_ns_q12);
    return sample.pos_q32;
}

static void state_extend(const struct motion_segment *segment,
                         enum motion_quantity quantity, int64_t t_ns_q12,
                         struct motion_extreme *extreme)
{
    const int64_t value = state_quantity(segment, quantity, t_ns_q12);

    if (value < extreme->min) {
        extreme->min = value;
        extreme->min_ns_q12 = segment->start_ns_q12 + t_ns_q12;
    }
    if (value > extreme->max) {
        extreme->max = value;
        extreme->max_ns_q12 = segment->start_ns_q12 + t_ns_q12;
    }
}

static struct motion_extreme state_none(int64_t t_ns_q12)
{
    return (struct motion_extreme){ .min = INT64_MAX,
                                    .max = INT64_MIN,
                                    .min_ns_q12 = t_ns_q12,
                                    .max_ns_q12 = t_ns_q12 };
}

/* `roots` are those of the derivative of the quantity. */
static void state_extend_at(const struct motion_segment *segment,
                            enum motion_quantity quantity,
                            const struct state_roots *roots,
                            struct motion_extreme *extreme)
{
    state_extend(segment, quantity, 0, extreme);
    for (int i = 0; i < roots->count; i++) {
        state_extend(segment, quantity, roots->at[i], extreme);
        state_extend(segment, quantity, roots->at[i] + 1, extreme);
    }
    state_extend(segment, quantity, segment->dur_ns_q12, extreme);
}

/* Of the derivative of the quantity. */
static struct state_roots state_roots_of(const struct motion_segment *segment,
                                         enum motion_quantity quantity)
{
    struct state_roots roots = { .count = 0 };

    for (int d = segment->degree - 1; d > (int)quantity; d--)
        state_roots_below(segment, d, &roots);
    return roots;
}

static void state_extend_all(const struct motion_segment *segment,
                             enum motion_quantity quantity,
                             struct motion_extreme *extreme)
{
    const struct state_roots roots = state_roots_of(segment, quantity);

    state_extend_at(segment, quantity, &roots, extreme);
}

void motion_segment_extreme(const struct motion_segment *segment,
                            enum motion_quantity quantity,
                            struct motion_extreme *extreme)
{
    *extreme = state_none(segment->start_ns_q12);
    state_extend_all(segment, quantity, extreme);
}

/* In units of the last digit, 2^-(32 + frac). */
static const uint8_t state_quanta[] = { 0, 22, 80, 248 };

int64_t motion_segment_rounding(const struct motion_segment *segment,
                                enum motion_quantity quantity)
{
    const struct motion_u128 quantum = { 0, state_quanta[quantity] };
    const int64_t value = state_saturate(
        quantum, state_rate(segment, (int)quantity), -segment->frac);

    return value < INT64_MAX ? value + 1 : value;
}

/* The rounding is taken off in the segment's own digits: in the format of the
 * quantity both may be beyond what 64 bits hold. */
static int64_t state_surely(const struct motion_segment *segment,
                            enum motion_quantity quantity, int64_t t_ns_q12)
{
    const struct motion_u128 size = motion_fixed_sub_u128(
        motion_fixed_abs_i128(state_raw(segment, (int)quantity, t_ns_q12)),
        track_shifted(state_quanta[quantity], STATE_GUARD));

    if (motion_fixed_is_neg_i128(size))
        return 0;
    return state_saturate(size, state_rate(segment, (int)quantity),
                          -segment->frac - STATE_GUARD);
}

static int64_t state_peak_at(const struct motion_segment *segment,
                             enum motion_quantity quantity,
                             const struct state_roots *roots)
{
    int64_t at[2 * MOTION_TRACK_DEGREE + 2] = { 0, segment->dur_ns_q12 };
    int count = 2;
    int64_t peak = 0;

    for (int i = 0; i < roots->count; i++) {
        at[count++] = roots->at[i];
        at[count++] = roots->at[i] + 1;
    }
    for (int i = 0; i < count; i++) {
        const int64_t size = state_surely(segment, quantity, at[i]);
        if (size > peak)
            peak = size;
    }
    return peak > 0 && peak < INT64_MAX ? peak - 1 : peak;
}

int64_t motion_segment_peak(const struct motion_segment *segment,
                            enum motion_quantity quantity)
{
    const struct state_roots roots = state_roots_of(segment, quantity);

    return state_peak_at(segment, quantity, &roots);
}

void track_segment_extremes(const struct motion_segment *segment,
                            struct motion_extreme extreme[MOTION_JERK + 1],
                            int64_t peak[MOTION_JERK + 1])
{
    struct state_roots roots = { .count = 0 };

    for (int q = MOTION_JERK; q >= MOTION_POS; q--) {
        if (q + 1 < segment->degree)
            state_roots_below(segment, q + 1, &roots);
        extreme[q] = state_none(segment->start_ns_q12);
        state_extend_at(segment, (enum motion_quantity)q, &roots, &extreme[q]);
        if (peak != NULL && q >= MOTION_ACC)
            peak[q] = state_peak_at(segment, (enum motion_quantity)q, &roots);
    }
}

void motion_segment_extremes(const struct motion_segment *segment,
                             struct motion_extreme extreme[MOTION_JERK + 1])
{
    track_segment_extremes(segment, extreme, NULL);
}

void motion_track_extreme(const struct motion_track *track,
                          enum motion_quantity quantity,
                          struct motion_extreme *extreme)
{
    if (track->outline != NULL) {
        *extreme = track->outline->extreme[quantity];
        return;
    }
    const struct motion_track_summary *summary = track_summary(track);
    if (summary != NULL) {
        *extreme = summary->extreme[quantity];
        return;
    }
    *extreme = state_none(0);
    for (uint32_t i = 0; i < track->count; i++)
        state_extend_all(&track->segment[i], quantity, extreme);
    if (track->count == 0) {
        extreme->min = quantity == MOTION_POS ? track->end.pos_q32 : 0;
        extreme->max = extreme->min;
    }
}

/* --- continuity ---------------------------------------------------------- */

static uint64_t state_distance(int64_t a, int64_t b)
{
    return a > b ? (uint64_t)a - (uint64_t)b : (uint64_t)b - (uint64_t)a;
}

static void state_border(const struct motion_state *before,
                         const struct motion_state *after, int64_t t_ns_q12,
                         struct motion_continuity *worst)
{
    uint64_t pos = state_distance(before->pos_q32, after->pos_q32);
    uint64_t vel = state_distance(before->vel_q32, after->vel_q32);
    uint64_t acc = state_distance(before->acc_q32, after->acc_q32);

    if (pos > worst->pos_step_q32)
        worst->pos_step_q32 = pos;
    if (vel > worst->vel_step_q32) {
        worst->vel_step_q32 = vel;
        worst->vel_step_ns_q12 = t_ns_q12;
    }
    if (acc > worst->acc_step_q32) {
        worst->acc_step_q32 = acc;
        worst->acc_step_ns_q12 = t_ns_q12;
    }
}

void motion_track_continuity(const struct motion_track *track,
                             struct motion_continuity *worst)
{
    struct motion_state before, after;

    *worst = (struct motion_continuity){ 0 };
    if (track->count == 0)
        return;
    before = (struct motion_state){ .pos_q32 = track->segment[0].pos_q32 };
    for (uint32_t i = 0; i < track->count; i++) {
        const struct motion_segment *segment = &track->segment[i];
        motion_segment_state(segment, 0, &after);
        state_border(&before, &after, segment->start_ns_q12, worst);
        motion_segment_state(segment, segment->dur_ns_q12, &before);
    }
    after = (struct motion_state){ .pos_q32 = track->end.pos_q32 };
    state_border(&before, &after, track->end_ns_q12, worst);
}
