/* motion/track_state.c - see track.h: exact states, extremes, continuity.
 *
 * The polynomials are evaluated with 128 bits: coefficients (62 bits) times at
 * most 60, moved up by 40, make under 2^109. */
#include <stddef.h>

#include "motion/err.h"
#include "motion/track_internal.h"

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
    state->acc_q16 = state_saturate(state_polynomial(segment, 2, whole, u),
                                    rate2, shift - 16);
    state->jerk_q16 = state_saturate(state_polynomial(segment, 3, whole, u),
                                     rate3, shift - 16);
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

/* Sign of derivative `order` at t, 0 <= t <= dur. */
static int state_sign(const struct motion_segment *segment, int order,
                      int64_t t_ns_q12)
{
    bool whole = t_ns_q12 == segment->dur_ns_q12;
    uint64_t u = whole ? 0 : state_fraction_q64(segment, (uint64_t)t_ns_q12);
    struct motion_u128 value = state_polynomial(segment, order, whole, u);

    if (motion_fixed_is_neg_i128(value))
        return -1;
    return value.hi != 0 || value.lo != 0;
}

/* Halve [low, high], whose ends differ in sign; at most 60 steps. */
static int64_t state_bisect(const struct motion_segment *segment, int order,
                            int64_t low, int64_t high)
{
    int sign = state_sign(segment, order, low);

    while (high - low > 1) {
        int64_t middle = low + (high - low) / 2;
        if (state_sign(segment, order, middle) == sign)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Between neighbouring roots of its derivative a polynomial is monotonic and
 * has one root at most; so from the top down, each from the one above. */
static void state_find_roots(const struct motion_segment *segment, int order,
                             struct state_roots *roots)
{
    roots->count = 0;
    for (int d = segment->degree - 1; d >= order; d--) {
        struct state_roots above = *roots;
        int64_t low = 0;

        above.at[above.count++] = segment->dur_ns_q12;
        roots->count = 0;
        for (int i = 0; i < above.count; i++) {
            int64_t high = above.at[i];
            if (high > low &&
                state_sign(segment, d, low) != state_sign(segment, d, high))
                roots->at[roots->count++] = state_bisect(segment, d, low, high);
            low = high;
        }
    }
}

static int64_t state_quantity(const struct motion_state *state,
                              enum motion_quantity quantity)
{
    switch (quantity) {
    case MOTION_POS:
        return state->pos_q32;
    case MOTION_VEL:
        return state->vel_q32;
    case MOTION_ACC:
        return state->acc_q16;
    case MOTION_JERK:
        return state->jerk_q16;
    }
    return 0;
}

static void state_extend(const struct motion_segment *segment,
                         enum motion_quantity quantity, int64_t t_ns_q12,
                         struct motion_extreme *extreme)
{
    struct motion_state state;

    motion_segment_state(segment, t_ns_q12, &state);
    int64_t value = state_quantity(&state, quantity);
    if (value < extreme->min) {
        extreme->min = value;
        extreme->min_ns_q12 = segment->start_ns_q12 + t_ns_q12;
    }
    if (value > extreme->max) {
        extreme->max = value;
        extreme->max_ns_q12 = segment->start_ns_q12 + t_ns_q12;
    }
}

static void state_extend_all(const struct motion_segment *segment,
                             enum motion_quantity quantity,
                             struct motion_extreme *extreme)
{
    struct state_roots roots;

    state_find_roots(segment, (int)quantity + 1, &roots);
    state_extend(segment, quantity, 0, extreme);
    for (int i = 0; i < roots.count; i++) {
        state_extend(segment, quantity, roots.at[i], extreme);
        state_extend(segment, quantity, roots.at[i] + 1, extreme);
    }
    state_extend(segment, quantity, segment->dur_ns_q12, extreme);
}

void motion_segment_extreme(const struct motion_segment *segment,
                            enum motion_quantity quantity,
                            struct motion_extreme *extreme)
{
    *extreme = (struct motion_extreme){
        .min = INT64_MAX,
        .max = INT64_MIN,
        .min_ns_q12 = segment->start_ns_q12,
        .max_ns_q12 = segment->start_ns_q12,
    };
    state_extend_all(segment, quantity, extreme);
}

void motion_track_extreme(const struct motion_track *track,
                          enum motion_quantity quantity,
                          struct motion_extreme *extreme)
{
    if (track->outline != NULL) {
        *extreme = track->outline->extreme[quantity];
        return;
    }
    *extreme = (struct motion_extreme){ .min = INT64_MAX, .max = INT64_MIN };
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
    uint64_t acc = state_distance(before->acc_q16, after->acc_q16);

    if (pos > worst->pos_step_q32)
        worst->pos_step_q32 = pos;
    if (vel > worst->vel_step_q32) {
        worst->vel_step_q32 = vel;
        worst->vel_step_ns_q12 = t_ns_q12;
    }
    if (acc > worst->acc_step_q16) {
        worst->acc_step_q16 = acc;
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
