/* motion/core/clock_warp_plan.c - ramps of the clock, and what one makes of a track at
 * one time; see clock_warp.h.
 *
 * Ramps are laid out per tick of T: a = r' T and j = r'' T^2 in Q56.  In a piece of
 * n ticks from (r, a) to a', with x in 0..1, r = r + a n x + (a' - a) n x^2 / 2, and s
 * is its integral: k = (r, a n / 2, (a' - a) n / 6).
 *
 * Bounds: a ramp whose rate stays in 0 .. 2 has (|a| + |a'|) n <= 16 (a piece
 * in which r' changes its sign goes a^2 n / 2 (|a| + |a'|) to one side and a'^2
 * n / 2 (|a| + |a'|) to the other, both at most 2).  So |k| <= 8, and every
 * partial sum of derivatives below stays under 2^6: Q56 leaves room. */
#include <stddef.h>

#include "motion/core/clock_warp_internal.h"

#define SECOND_NS INT64_C(1000000000)
#define UNIT_Q56  ((int64_t)1 << 56)
#define UNIT_Q30  ((int64_t)1 << 26) /* the last bit of a rate of 30 */
#define SIXTH_Q62 (((int64_t)1 << 62) / 6)

/* a n, or MOTION_E_RANGE where it goes over 16: no rate in 0 .. 2 does. */
static int clock_ramp_times(int64_t a, int64_t n, int64_t *product)
{
    return motion_fixed_mulshift(a, n, 0, product) == MOTION_OK &&
                   motion_fixed_abs(*product) <= 16 * (uint64_t)UNIT_Q56
               ? MOTION_OK
               : MOTION_E_RANGE;
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
           clock_ramp_in_range(r0 + motion_fixed_muldiv_sat(
                                        rise / 2, (int64_t)motion_fixed_abs(a0),
                                        (int64_t)motion_fixed_abs(a0 - a1)));
}

/* Not on the tick. */
__attribute__((cold)) void
motion_clock_unit_init(struct motion_clock_unit *unit, int64_t tick_ns)
{
    const unsigned normalise = motion_fixed_clz_u64((uint64_t)tick_ns) & 63;
    unit->tick_ns = tick_ns;
    unit->normalise = (uint8_t)normalise;
    motion_fixed_div_u128((struct motion_u128){ (uint64_t)1 << 62, 0 },
                          (uint64_t)tick_ns << normalise, &unit->inverse, NULL);
    unit->per_s_q30 =
        motion_fixed_muldiv_sat(SECOND_NS, (int64_t)1 << 30, tick_ns);
}

/* a / n, n below 2^16 in four steps of 16 bits. */
static uint64_t clock_unit_div(uint64_t a, uint32_t n)
{
    if (n == 1)
        return a;
    if (n >> 16 != 0)
        return a / n;
    uint64_t quotient = 0;
    uint32_t rest = 0;
    for (int i = 48; i >= 0; i -= 16) {
        const uint32_t part = rest << 16 | (uint32_t)(a >> i & 0xffff);
        quotient = quotient << 16 | part / n;
        rest = part % n;
    }
    return quotient;
}

/* The next piece, of n ticks, from rate r and slope a to slope b. */
static void clock_warp_append_ticks(struct motion_clock_warp *warp,
                                    const struct motion_clock_unit *unit,
                                    int32_t n, int64_t r, int64_t a, int64_t b)
{
    struct motion_clock_piece *piece = &warp->piece[warp->count++];
    const int64_t dur_ns = n * unit->tick_ns;
    const int64_t k1 = a * n / 2;
    const int64_t k2 = clock_warp_mul((b - a) * n, SIXTH_Q62, 62);
    const int64_t per_s =
        (int64_t)clock_unit_div((uint64_t)unit->per_s_q30, (uint32_t)n);
    piece->dur_ns = dur_ns;
    piece->s0_ns_q12 = warp->s1_ns_q12;
    piece->k_q56[0] = r;
    piece->k_q56[1] = k1;
    piece->k_q56[2] = k2;
    piece->normalise = (uint8_t)motion_fixed_clz_u64((uint64_t)dur_ns);
    piece->inverse = clock_unit_div(unit->inverse, (uint32_t)n)
                     << ((unit->normalise - piece->normalise) & 63);
    piece->per_s_q30 = per_s;
    piece->jerk_q30 =
        clock_warp_mul(clock_warp_mul(6 * k2, per_s, 56), per_s, 30);
    warp->dur_ns += dur_ns;
    warp->s1_ns_q12 +=
        clock_warp_mul(dur_ns * MOTION_FIXED_NS_Q12, r + k1 + k2, 56);
}

/* |a| n is within 16: no rate in 0 .. 2 goes over that. */
static bool clock_ramp_is_short(int64_t a, int32_t n)
{
    return (motion_fixed_abs(a) >> 21) * (uint32_t)n <= (uint64_t)UNIT_Q56 >>
           17;
}

/* A rate of 30 bits that is on its way to just 0, or 200 %, may be led a unit of these
 * beyond it: it comes there. */
static int64_t clock_ramp_end(int64_t rate)
{
    if (rate < 0 && rate >= -UNIT_Q30)
        return 0;
    if (rate > 2 * UNIT_Q56 && rate <= 2 * UNIT_Q56 + UNIT_Q30)
        return 2 * UNIT_Q56;
    return clock_ramp_in_range(rate) ? rate : -1;
}

int motion_clock_warp_by(const struct motion_clock_begin *begin,
                         const struct motion_clock_unit *unit, int32_t wait,
                         int64_t peak_q56, int32_t ticks,
                         struct motion_clock_warp *to)
{
    const int64_t a0 = begin->accel_q56, r0 = begin->rate_q56;
    if (ticks < 1 || wait < 0 || ticks > 1 << 20 || wait > 1 << 20 ||
        !clock_ramp_is_short(peak_q56, wait + ticks) ||
        !clock_ramp_is_short(a0, wait))
        return MOTION_E_RANGE;
    const int64_t r1 = r0 + (a0 + peak_q56) * wait / 2;
    const int64_t end = clock_ramp_end(r1 + peak_q56 * ticks / 2);
    if (!clock_ramp_in_range(r0) || !clock_ramp_in_range(r1) || end < 0 ||
        !clock_ramp_turns_in_range(r0, a0, peak_q56, wait))
        return MOTION_E_RANGE;
    to->t0_ns = begin->t_ns;
    to->dur_ns = 0;
    to->s0_ns_q12 = to->s1_ns_q12 = begin->s_ns_q12;
    to->rate1_q30 = (end + (1 << 25)) >> 26;
    to->count = 0;
    if (wait > 0)
        clock_warp_append_ticks(to, unit, wait, r0, a0, peak_q56);
    clock_warp_append_ticks(to, unit, ticks, r1, peak_q56, 0);
    return MOTION_OK;
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
        .acc_q32 = motion_fixed_add_sat(
            clock_warp_mul(track->acc_q32, r2, 30),
            clock_warp_mul(track->vel_q32, now->accel_q30, 30)),
        .jerk_q32 = motion_fixed_add_sat(
            motion_fixed_add_sat(clock_warp_mul(track->jerk_q32, r3, 30),
                                 clock_warp_mul(track->acc_q32, rr1, 30)),
            clock_warp_mul(track->vel_q32, now->jerk_q30, 30)),
    };
}
