/* motion/core/clock_warp_plan.c - the shortest ramp between two rates, and what
 * one makes of a track at one time; see clock_warp.h.
 *
 * Ramps are planned per tick of T: a = r' T and j = r'' T^2 in Q56.  With
 * pieces of n[0], n[1], n[2] ticks and the peak a1,
 *     r1 - r0 = (a0 + a1) n[0] / 2 + a1 n[1] + a1 n[2] / 2
 * which gives a1 from whole n.  In a piece of n ticks from (r, a) to a', with x
 * in 0..1, r = r + a n x + (a' - a) n x^2 / 2, and s is its integral: k = (r,
 * a n / 2, (a' - a) n / 6).
 *
 * Bounds: a ramp whose rate stays in 0 .. 2 has (|a| + |a'|) n <= 16 (a piece
 * in which r' changes its sign goes a^2 n / 2 (|a| + |a'|) to one side and a'^2
 * n / 2 (|a| + |a'|) to the other, both at most 2).  So |k| <= 8, and every
 * partial sum of derivatives below stays under 2^6: Q56 leaves room. */
#include <stddef.h>

#include "motion/core/clock_warp_internal.h"

#define SECOND_NS INT64_C(1000000000)
#define UNIT_Q56  ((int64_t)1 << 56)

/* A ramp per tick: from (r0, a0), both Q56, by `change` to rest. */
struct clock_ramp {
    int64_t change, a0, accel, jerk;
};

static int64_t clock_ramp_clip(int64_t value)
{
    return value < 1 ? 1 : value > UNIT_Q56 ? UNIT_Q56 : value;
}

/* r'' in r' per tick and tick, Q56 */
static int64_t clock_ramp_jerk(int64_t jerk_q30, int64_t tick_ns)
{
    const int64_t half = tick_ns * ((int64_t)1 << 13);
    return clock_warp_muldiv(clock_warp_muldiv(jerk_q30, half, SECOND_NS), half,
                             SECOND_NS);
}

static int clock_ramp_init(struct clock_ramp *ramp,
                           const struct motion_clock_rate *now,
                           int64_t rate_q30,
                           const struct motion_clock_bound *bound,
                           int64_t tick_ns)
{
    if (rate_q30 < 0 || rate_q30 > MOTION_CLOCK_WARP_MAX_Q30 ||
        bound->accel_q30 <= 0 || bound->jerk_q30 <= 0 ||
        tick_ns < MOTION_CLOCK_WARP_TICK_MIN_NS ||
        tick_ns > MOTION_CLOCK_WARP_TICK_MAX_NS)
        return MOTION_E_ARG;
    const int64_t tick = tick_ns * ((int64_t)1 << 26);
    ramp->change = (rate_q30 - now->rate_q30) * ((int64_t)1 << 26);
    ramp->a0 = clock_warp_muldiv(now->accel_q30, tick, SECOND_NS);
    ramp->accel =
        clock_ramp_clip(clock_warp_muldiv(bound->accel_q30, tick, SECOND_NS));
    ramp->jerk = clock_ramp_clip(clock_ramp_jerk(bound->jerk_q30, tick_ns));
    return motion_fixed_abs(ramp->a0) <= 2 * (uint64_t)UNIT_Q56
               ? MOTION_OK
               : MOTION_E_RANGE;
}

/* |r1 - r0| J + a0^2 / 2, or the difference: the peak's square, Q112. */
static struct motion_u128 clock_ramp_square(const struct clock_ramp *ramp,
                                            bool same)
{
    const uint64_t a0 = motion_fixed_abs(ramp->a0);
    const struct motion_u128 displacement = motion_fixed_mul_u64(
        motion_fixed_abs(ramp->change), (uint64_t)ramp->jerk);
    const struct motion_u128 half =
        motion_fixed_shr_u128(motion_fixed_mul_u64(a0, a0), 1);
    return same ? motion_fixed_add_u128(half, displacement)
                : motion_fixed_sub_u128(half, displacement);
}

/* The root to 31 bits, for lengths that will be rounded to ticks. */
static uint64_t clock_ramp_root(struct motion_u128 square)
{
    unsigned shift = 64 - motion_fixed_clz_u64(square.hi);
    shift += shift % 2;
    const struct motion_u128 top = motion_fixed_shr_u128(square, shift);
    return (uint64_t)motion_fixed_isqrt_u64(top.lo) << (shift / 2);
}

/* The peak of r' where whole ticks do not matter, with its sign.  Where r0'
 * points to r1 and is too steep to end there (change < a0^2 / 2J), the peak is
 * on the other side. */
static int64_t clock_ramp_peak(const struct clock_ramp *ramp)
{
    const bool towards = (ramp->change < 0) == (ramp->a0 < 0);
    const bool beyond =
        towards && motion_fixed_is_neg_i128(
                       motion_fixed_neg_i128(clock_ramp_square(ramp, false)));
    const uint64_t root = clock_ramp_root(clock_ramp_square(ramp, !beyond));
    const int64_t peak =
        root < (uint64_t)ramp->accel ? (int64_t)root : ramp->accel;
    return (ramp->change < 0) != beyond ? -peak : peak;
}

/* ceil(a / b) for a >= 0, b > 0 */
static int64_t clock_ramp_ceil(uint64_t a, int64_t b)
{
    return (int64_t)((a + (uint64_t)b - 1) / (uint64_t)b);
}

/* a n, or MOTION_E_RANGE where it goes over 16: no rate in 0 .. 2 does. */
static int clock_ramp_times(int64_t a, int64_t n, int64_t *product)
{
    return motion_fixed_mulshift(a, n, 0, product) == MOTION_OK &&
                   motion_fixed_abs(*product) <= 16 * (uint64_t)UNIT_Q56
               ? MOTION_OK
               : MOTION_E_RANGE;
}

/* The peak that follows from whole ticks; a0 n[0] is within 16. */
static int64_t clock_ramp_whole(const struct clock_ramp *ramp,
                                const int64_t n[MOTION_CLOCK_WARP_PIECES])
{
    const int64_t ticks = n[0] + 2 * n[1] + n[2];
    return clock_warp_muldiv(2 * ramp->change - ramp->a0 * n[0], 1, ticks);
}

/* Rounding moves the peak; where a piece would then need more than J, a tick
 * more takes that back, or, where the peak came out too far from a steeper r0',
 * a tick less at the peak. */
static void clock_ramp_settle(const struct clock_ramp *ramp,
                              int64_t n[MOTION_CLOCK_WARP_PIECES])
{
    for (int i = 0; i < 8 && n[0] + n[2] > 0; i++) {
        const int64_t peak = clock_ramp_whole(ramp, n);
        const uint64_t first = motion_fixed_abs(peak - ramp->a0);
        const uint64_t last = motion_fixed_abs(peak);
        const bool first_fits = first <= (uint64_t)ramp->jerk * (uint64_t)n[0];
        if (first_fits && last <= (uint64_t)ramp->jerk * (uint64_t)n[2])
            return;
        if (first_fits)
            n[2]++;
        else if (n[1] > 0)
            n[1]--;
        else
            n[0]++;
    }
}

static int clock_ramp_ticks(const struct clock_ramp *ramp, int64_t most,
                            int64_t n[MOTION_CLOCK_WARP_PIECES])
{
    const int64_t peak = clock_ramp_peak(ramp);
    n[0] = clock_ramp_ceil(motion_fixed_abs(peak - ramp->a0), ramp->jerk);
    n[1] = 0;
    n[2] = clock_ramp_ceil(motion_fixed_abs(peak), ramp->jerk);
    if (n[2] == 0 && n[0] > 0)
        n[2] = 1; /* the rounded peak is not 0 */
    if (n[0] > most || n[2] > most)
        return MOTION_E_RANGE;
    int64_t first, last;
    if (clock_ramp_times(ramp->a0, n[0], &first) < 0 ||
        clock_ramp_times(ramp->a0 + peak, n[0], &first) < 0 ||
        clock_ramp_times(peak, n[2], &last) < 0)
        return MOTION_E_RANGE;
    /* only a peak that is cut is kept: another follows from n[0] and n[2] */
    const int64_t left = ramp->change - (first + last) / 2;
    const int64_t size = (int64_t)motion_fixed_abs(peak);
    if (size == ramp->accel && (left < 0) == (peak < 0))
        n[1] = clock_ramp_ceil(motion_fixed_abs(left), size);
    if (n[1] > most || n[0] + n[1] + n[2] > most)
        return MOTION_E_RANGE;
    clock_ramp_settle(ramp, n);
    return MOTION_OK;
}

int motion_clock_warp_ticks(const struct motion_clock_rate *now,
                            int64_t rate_q30,
                            const struct motion_clock_bound *bound,
                            int64_t tick_ns,
                            int64_t ticks[MOTION_CLOCK_WARP_PIECES])
{
    struct clock_ramp ramp;
    const int err = clock_ramp_init(&ramp, now, rate_q30, bound, tick_ns);
    if (err < 0)
        return err;
    return clock_ramp_ticks(&ramp, MOTION_CLOCK_WARP_RAMP_MAX_NS / tick_ns,
                            ticks);
}

static bool clock_ramp_in_range(int64_t rate)
{
    return rate >= 0 && rate <= 2 * UNIT_Q56;
}

/* Where r' goes through 0 within the first piece, the rate turns at r0 + a0^2
 * n / 2 (a0 - a1); else its extremes are those of the borders. */
static bool clock_ramp_turns_in_range(int64_t r0, int64_t a0, int64_t a1,
                                      int64_t n)
{
    int64_t rise;
    if (n == 0 || a0 == 0 || (a0 < 0) == (a1 < 0))
        return true;
    return clock_ramp_times(a0, n, &rise) == MOTION_OK &&
           clock_ramp_in_range(
               r0 + clock_warp_muldiv(rise / 2, (int64_t)motion_fixed_abs(a0),
                                      (int64_t)motion_fixed_abs(a0 - a1)));
}

static void clock_piece_derive(struct motion_clock_piece *piece)
{
    uint64_t dur = (uint64_t)piece->dur_ns;
    piece->normalise = (uint8_t)motion_fixed_clz_u64(dur);
    dur <<= piece->normalise;
    /* dur is in [2^63, 2^64), so the quotient is in (2^62, 2^63]; at 2^63
     * exactly it is one less, which keeps x below 1. */
    motion_fixed_div_u128((struct motion_u128){ (uint64_t)1 << 62, 0 }, dur,
                          &piece->inverse, NULL);
    piece->per_s_q30 =
        clock_warp_muldiv(SECOND_NS, (int64_t)1 << 30, piece->dur_ns);
    piece->jerk_q30 = clock_warp_mul(
        clock_warp_mul(6 * piece->k_q56[2], piece->per_s_q30, 56),
        piece->per_s_q30, 30);
}

/* The next piece, from rate r and slope a to slope b (`an`, `bn`: times its
 * ticks). */
static void clock_warp_append(struct motion_clock_warp *warp, int64_t dur_ns,
                              int64_t r, int64_t an, int64_t bn)
{
    if (dur_ns == 0)
        return;
    struct motion_clock_piece *piece = &warp->piece[warp->count++];
    *piece = (struct motion_clock_piece){
        .dur_ns = dur_ns,
        .s0_ns_q12 = warp->s1_ns_q12,
        .k_q56 = { r, an / 2, (bn - an) / 6 },
    };
    clock_piece_derive(piece);
    const int64_t *k = piece->k_q56;
    warp->dur_ns += dur_ns;
    warp->s1_ns_q12 = clock_warp_add(
        warp->s1_ns_q12,
        clock_warp_mul(dur_ns * MOTION_FIXED_NS_Q12, k[0] + k[1] + k[2], 56));
}

/* Has the rounding to ticks left the bounds kept, but for 2^-10? */
static bool clock_ramp_keeps(const struct clock_ramp *ramp,
                             const int64_t n[MOTION_CLOCK_WARP_PIECES],
                             int64_t a1)
{
    const uint64_t jerk = (uint64_t)(ramp->jerk + (ramp->jerk >> 10) + 1);
    const uint64_t accel = (uint64_t)(ramp->accel + (ramp->accel >> 10) + 1);
    const uint64_t peak = motion_fixed_abs(a1);
    return motion_fixed_abs(a1 - ramp->a0) <= jerk * (uint64_t)n[0] &&
           peak <= jerk * (uint64_t)n[2] &&
           (peak <= accel || peak <= motion_fixed_abs(ramp->a0));
}

/* The peak from whole ticks, then piece by piece; the last is laid out from its
 * end, which is exact. */
static int clock_warp_pieces(struct motion_clock_warp *warp,
                             const struct clock_ramp *ramp, int64_t r0,
                             const int64_t n[MOTION_CLOCK_WARP_PIECES],
                             int64_t tick_ns)
{
    int64_t a0n, an[MOTION_CLOCK_WARP_PIECES];
    if (n[0] + n[1] + n[2] == 0)
        return MOTION_OK;
    if (clock_ramp_times(ramp->a0, n[0], &a0n) < 0)
        return MOTION_E_RANGE;
    const int64_t a1 = clock_ramp_whole(ramp, n);
    if (!clock_ramp_keeps(ramp, n, a1))
        return MOTION_E_RANGE;
    for (int i = 0; i < MOTION_CLOCK_WARP_PIECES; i++)
        if (clock_ramp_times(a1, n[i], &an[i]) < 0)
            return MOTION_E_RANGE;
    const int64_t first = r0 + (a0n + an[0]) / 2;
    const int64_t last = r0 + ramp->change - an[2] / 2;
    if (!clock_ramp_in_range(first) || !clock_ramp_in_range(last) ||
        !clock_ramp_turns_in_range(r0, ramp->a0, a1, n[0]))
        return MOTION_E_RANGE;
    clock_warp_append(warp, n[0] * tick_ns, r0, a0n, an[0]);
    clock_warp_append(warp, n[1] * tick_ns, first, an[1], an[1]);
    clock_warp_append(warp, n[2] * tick_ns, last, an[2], 0);
    return MOTION_OK;
}

int motion_clock_warp_ramp(const struct motion_clock_warp *from, int64_t t_ns,
                           int64_t rate_q30,
                           const struct motion_clock_bound *bound,
                           int64_t tick_ns, struct motion_clock_warp *to)
{
    struct motion_clock_rate now;
    struct clock_ramp ramp;
    int64_t n[MOTION_CLOCK_WARP_PIECES];
    motion_clock_warp_at(from, t_ns, &now);
    int err = clock_ramp_init(&ramp, &now, rate_q30, bound, tick_ns);
    if (err == MOTION_OK)
        err =
            clock_ramp_ticks(&ramp, MOTION_CLOCK_WARP_RAMP_MAX_NS / tick_ns, n);
    if (err < 0)
        return err;
    struct motion_clock_warp warp;
    motion_clock_warp_init(&warp, t_ns, now.s_ns_q12, rate_q30);
    err = clock_warp_pieces(&warp, &ramp, now.rate_q30 * ((int64_t)1 << 26), n,
                            tick_ns);
    if (err == MOTION_OK)
        *to = warp;
    return err;
}

int motion_clock_warp_level(const struct motion_clock_warp *from, int64_t t_ns,
                            int64_t wait, int64_t jerk_q30, int64_t ticks,
                            int64_t tick_ns, struct motion_clock_warp *to)
{
    const struct motion_clock_bound any = { INT64_MAX, INT64_MAX };
    struct motion_clock_rate now;
    struct clock_ramp ramp;
    int64_t rise, a0n, a1n, an;
    motion_clock_warp_at(from, t_ns, &now);
    const int err = clock_ramp_init(&ramp, &now, now.rate_q30, &any, tick_ns);
    if (err < 0 || ticks < 1 || wait < 0)
        return err < 0 ? err : MOTION_E_ARG;
    const int64_t most = MOTION_CLOCK_WARP_RAMP_MAX_NS / tick_ns;
    if (ticks > most || wait > most - ticks ||
        clock_ramp_times(clock_ramp_jerk(jerk_q30, tick_ns), wait, &rise) < 0)
        return MOTION_E_RANGE;
    const int64_t a1 = ramp.a0 + rise;
    if (clock_ramp_times(ramp.a0, wait, &a0n) < 0 ||
        clock_ramp_times(a1, wait, &a1n) < 0 ||
        clock_ramp_times(a1, ticks, &an) < 0)
        return MOTION_E_RANGE;
    const int64_t r0 = now.rate_q30 * ((int64_t)1 << 26);
    const int64_t r1 = r0 + (a0n + a1n) / 2;
    /* a rate that is on its way to just 0 comes to 0, by rounding */
    const int64_t end = r1 + an / 2 + (1 << 25);
    if (!clock_ramp_in_range(r0) || !clock_ramp_in_range(r1) ||
        !clock_ramp_in_range(end) ||
        !clock_ramp_turns_in_range(r0, ramp.a0, a1, wait))
        return MOTION_E_RANGE;
    struct motion_clock_warp warp;
    motion_clock_warp_init(&warp, t_ns, now.s_ns_q12, end >> 26);
    clock_warp_append(&warp, wait * tick_ns, r0, a0n, a1n);
    clock_warp_append(&warp, ticks * tick_ns, r1, an, 0);
    *to = warp;
    return MOTION_OK;
}

void motion_clock_warp_join(struct motion_clock_warp *first,
                            const struct motion_clock_warp *then)
{
    for (unsigned i = 0;
         i < then->count && first->count < MOTION_CLOCK_WARP_JOINED; i++)
        first->piece[first->count++] = then->piece[i];
    first->dur_ns += then->dur_ns;
    first->s1_ns_q12 = then->s1_ns_q12;
    first->rate1_q30 = then->rate1_q30;
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
        .acc_q32 =
            clock_warp_add(clock_warp_mul(track->acc_q32, r2, 30),
                           clock_warp_mul(track->vel_q32, now->accel_q30, 30)),
        .jerk_q32 = clock_warp_add(
            clock_warp_add(clock_warp_mul(track->jerk_q32, r3, 30),
                           clock_warp_mul(track->acc_q32, rr1, 30)),
            clock_warp_mul(track->vel_q32, now->jerk_q30, 30)),
    };
}
