/* motion/clock_warp.c - see clock_warp.h.
 *
 * With x = (t - t0) / dur the rate is the cubic Hermite polynomial
 *     r = r0 + c1 x + c2 x^2 + c3 x^3,   c1 = r0' dur,
 *     c2 = 3 (r1 - r0) - 2 c1,           c3 = 2 (r0 - r1) + c1
 * and s its integral, k = (r0, c1/2, c2/3, c3/4).  Bounds: rates are at most 2;
 * |c1| is kept below 8, so |c2| <= 22, |c3| <= 12 and every |k|, and every
 * partial sum of derivatives below, stays under 2^7: Q56 leaves room. */
#include "motion/clock_warp.h"

#include <stddef.h>

#include "motion/err.h"
#include "motion/fixed.h"

#define C1_MAX_Q56 ((int64_t)8 << 56)

static int64_t clock_warp_saturate(int negative)
{
    return negative ? INT64_MIN : INT64_MAX;
}

/* (a * b) >> bits, saturated. */
static int64_t clock_warp_mul(int64_t a, int64_t b, unsigned bits)
{
    int64_t result;
    if (motion_fixed_mulshift(a, b, bits, &result) < 0)
        return clock_warp_saturate((a < 0) != (b < 0));
    return result;
}

static int64_t clock_warp_add(int64_t a, int64_t b)
{
    int64_t result;
    if (motion_fixed_add(a, b, &result) < 0)
        return clock_warp_saturate(a < 0);
    return result;
}

void motion_clock_warp_init(struct motion_clock_warp *warp, int64_t t_ns,
                            int64_t s0_ns_q12, int64_t rate_q30)
{
    *warp = (struct motion_clock_warp){
        .t0_ns = t_ns,
        .s0_ns_q12 = s0_ns_q12,
        .s1_ns_q12 = s0_ns_q12,
        .rate1_q30 = rate_q30,
    };
}

static void clock_warp_derive(struct motion_clock_warp *warp)
{
    uint64_t dur = (uint64_t)warp->dur_ns;
    warp->normalise = (uint8_t)motion_fixed_clz_u64(dur);
    dur <<= warp->normalise;
    /* dur is in [2^63, 2^64), so the quotient is in (2^62, 2^63]; at 2^63
     * exactly it is one less, which keeps x below 1. */
    motion_fixed_div_u128((struct motion_u128){ (uint64_t)1 << 62, 0 }, dur,
                          &warp->inverse, NULL);
    motion_fixed_muldiv(INT64_C(1000000000), (int64_t)1 << 30, warp->dur_ns,
                        &warp->per_s_q30);
}

int motion_clock_warp_ramp(const struct motion_clock_warp *from, int64_t t_ns,
                           int64_t rate_q30, int64_t dur_ns,
                           struct motion_clock_warp *to)
{
    if (rate_q30 < 0 || rate_q30 > MOTION_CLOCK_WARP_MAX_Q30 ||
        dur_ns < MOTION_CLOCK_WARP_RAMP_MIN_NS ||
        dur_ns > MOTION_CLOCK_WARP_RAMP_MAX_NS)
        return MOTION_E_ARG;
    struct motion_clock_rate now;
    motion_clock_warp_at(from, t_ns, &now);
    int64_t c1; /* accel [1/s] * dur [ns] / 1e9, Q30 to Q56 */
    int64_t per_ns = now.accel_q30;
    if (motion_fixed_muldiv(per_ns, dur_ns, INT64_C(1000000000), &c1) < 0 ||
        c1 > C1_MAX_Q56 >> 26 || c1 < -(C1_MAX_Q56 >> 26))
        return MOTION_E_RANGE;
    c1 *= (int64_t)1 << 26;
    const int64_t r0 = now.rate_q30 * ((int64_t)1 << 26);
    const int64_t r1 = rate_q30 * ((int64_t)1 << 26);
    struct motion_clock_warp ramp = {
        .t0_ns = t_ns,
        .dur_ns = dur_ns,
        .s0_ns_q12 = now.s_ns_q12,
        .rate1_q30 = rate_q30,
        .k_q56 = { r0, c1 / 2, (r1 - r0) - 2 * c1 / 3, (r0 - r1) / 2 + c1 / 4 },
    };
    clock_warp_derive(&ramp);
    const int64_t sum =
        ramp.k_q56[0] + ramp.k_q56[1] + ramp.k_q56[2] + ramp.k_q56[3];
    ramp.s1_ns_q12 = clock_warp_add(
        ramp.s0_ns_q12, clock_warp_mul(dur_ns * MOTION_FIXED_NS_Q12, sum, 56));
    *to = ramp;
    return MOTION_OK;
}

static void clock_warp_constant(const struct motion_clock_warp *warp,
                                int64_t past_ns, struct motion_clock_rate *now)
{
    *now = (struct motion_clock_rate){
        .s_ns_q12 = clock_warp_add(
            warp->s1_ns_q12, clock_warp_mul(past_ns, warp->rate1_q30, 18)),
        .rate_q30 = warp->rate1_q30,
    };
}

/* Horner in Q56; x is Q62 below 1. */
static int64_t clock_warp_horner(const int64_t *c, unsigned degree, int64_t x)
{
    int64_t sum = c[degree];
    while (degree-- > 0)
        sum = clock_warp_mul(sum, x, 62) + c[degree];
    return sum;
}

void motion_clock_warp_at(const struct motion_clock_warp *warp, int64_t t_ns,
                          struct motion_clock_rate *now)
{
    const int64_t dt = t_ns - warp->t0_ns;
    if (dt >= warp->dur_ns) {
        clock_warp_constant(warp, dt - warp->dur_ns, now);
        return;
    }
    const uint64_t scaled = (uint64_t)(dt > 0 ? dt : 0) << warp->normalise;
    /* scaled < 2^64, inverse <= 2^63: the upper half is x in Q62. */
    const int64_t x = (int64_t)motion_fixed_mulhi_u64(scaled, warp->inverse);
    const int64_t *k = warp->k_q56;
    const int64_t rate[] = { k[0], 2 * k[1], 3 * k[2], 4 * k[3] };
    const int64_t accel[] = { 2 * k[1], 6 * k[2], 12 * k[3] };
    const int64_t jerk[] = { 6 * k[2], 24 * k[3] };
    const int64_t share = clock_warp_mul(clock_warp_horner(k, 3, x), x, 62);
    const int64_t accel_q30 =
        clock_warp_mul(clock_warp_horner(accel, 2, x), warp->per_s_q30, 56);
    const int64_t jerk_q30 =
        clock_warp_mul(clock_warp_horner(jerk, 1, x), warp->per_s_q30, 56);
    now->s_ns_q12 = clock_warp_add(
        warp->s0_ns_q12,
        clock_warp_mul(warp->dur_ns * MOTION_FIXED_NS_Q12, share, 56));
    now->rate_q30 = (clock_warp_horner(rate, 3, x) + (1 << 25)) >> 26;
    now->accel_q30 = accel_q30;
    now->jerk_q30 = clock_warp_mul(jerk_q30, warp->per_s_q30, 30);
}

void motion_clock_warp_chain(const struct motion_clock_rate *now,
                             const struct motion_state *track,
                             struct motion_state *axis)
{
    const int64_t r = now->rate_q30;
    const int64_t r2 = clock_warp_mul(r, r, 30);
    const int64_t r3 = clock_warp_mul(r2, r, 30);
    const int64_t rr1 = clock_warp_mul(3 * r, now->accel_q30, 30);
    *axis = (struct motion_state){
        .pos_q32 = track->pos_q32,
        .vel_q32 = clock_warp_mul(track->vel_q32, r, 30),
        .acc_q16 =
            clock_warp_add(clock_warp_mul(track->acc_q16, r2, 30),
                           clock_warp_mul(track->vel_q32, now->accel_q30, 46)),
        .jerk_q16 = clock_warp_add(
            clock_warp_add(clock_warp_mul(track->jerk_q16, r3, 30),
                           clock_warp_mul(track->acc_q16, rr1, 30)),
            clock_warp_mul(track->vel_q32, now->jerk_q30, 46)),
    };
}

static bool clock_warp_within(int64_t value, int64_t limit)
{
    return motion_fixed_abs(value) <= (uint64_t)limit;
}

static bool clock_warp_keeps(const struct motion_clock_rate *now,
                             const struct motion_state *track,
                             const struct motion_clock_limit *limit)
{
    struct motion_state axis;
    motion_clock_warp_chain(now, track, &axis);
    return clock_warp_within(axis.vel_q32, limit->vel_q32) &&
           clock_warp_within(axis.acc_q16, limit->acc_q16) &&
           (limit->jerk_q16 == 0 ||
            clock_warp_within(axis.jerk_q16, limit->jerk_q16));
}

/* Index of the segment that holds path time s; count at and after the end. */
static uint32_t clock_warp_segment(const struct motion_track *track, int64_t s)
{
    uint32_t low = 0, high = track->count;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        const struct motion_segment *segment = &track->segment[middle];
        if (s < segment->start_ns_q12 + segment->dur_ns_q12)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

/* Both sides of every border that lies between two looks.  The rate there is
 * between the rates at the two looks: judged with both. */
static bool clock_warp_borders(const struct motion_track *track, uint32_t from,
                               uint32_t to,
                               const struct motion_clock_rate *before,
                               const struct motion_clock_rate *after,
                               const struct motion_clock_limit *limit)
{
    for (uint32_t i = from; i < to; i++) {
        const struct motion_segment *segment = &track->segment[i];
        struct motion_state left, right;
        motion_segment_state(segment, segment->dur_ns_q12, &left);
        motion_track_state(track, segment->start_ns_q12 + segment->dur_ns_q12,
                           &right);
        if (!clock_warp_keeps(before, &left, limit) ||
            !clock_warp_keeps(after, &right, limit))
            return false;
    }
    return true;
}

bool motion_clock_warp_fits(const struct motion_clock_warp *warp,
                            const struct motion_track *track,
                            const struct motion_clock_limit *limit,
                            int64_t from_ns, int64_t to_ns, int64_t step_ns)
{
    struct motion_clock_rate last = { 0 };
    uint32_t index = 0;
    for (int64_t dt = from_ns;; dt += step_ns) {
        if (dt > to_ns)
            dt = to_ns;
        struct motion_clock_rate now;
        motion_clock_warp_at(warp, warp->t0_ns + dt, &now);
        if (now.rate_q30 < 0 || now.rate_q30 > MOTION_CLOCK_WARP_MAX_Q30)
            return false;
        struct motion_state state;
        if (motion_track_ahead(track, now.s_ns_q12) <= 0)
            return false;
        motion_track_state(track, now.s_ns_q12, &state);
        if (!clock_warp_keeps(&now, &state, limit))
            return false;
        const uint32_t here = clock_warp_segment(track, now.s_ns_q12);
        if (dt > from_ns &&
            !clock_warp_borders(track, index, here, &last, &now, limit))
            return false;
        if (dt == to_ns)
            return true;
        index = here;
        last = now;
    }
}
