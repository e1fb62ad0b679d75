/* motion/core/clock_warp.c - path time and rate on the tick; see
 * clock_warp.h. */
#include "motion/core/clock_warp_internal.h"

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

static void clock_warp_constant(const struct motion_clock_warp *warp,
                                int64_t past_ns, struct motion_clock_rate *now)
{
    *now = (struct motion_clock_rate){
        .s_ns_q12 = motion_fixed_add_sat(
            warp->s1_ns_q12, clock_warp_mul(past_ns, warp->rate1_q30, 18)),
        .rate_q30 = warp->rate1_q30,
    };
}

/* `dt` from 0 to below the piece's end. */
static void clock_piece_at(const struct motion_clock_piece *piece, int64_t dt,
                           struct motion_clock_rate *now)
{
    /* scaled < 2^64, inverse <= 2^63: the upper half is x in Q62. */
    const uint64_t scaled = (uint64_t)dt << piece->normalise;
    const int64_t x = (int64_t)motion_fixed_mulhi_u64(scaled, piece->inverse);
    const int64_t *k = piece->k_q56;
    const int64_t k2x = clock_warp_mul(k[2], x, 62);
    const int64_t k1x = clock_warp_mul(k[1] + k2x, x, 62);
    const int64_t share = clock_warp_mul(k[0] + k1x, x, 62);
    const int64_t rate = k[0] + clock_warp_mul(2 * k[1] + 3 * k2x, x, 62);
    now->s_ns_q12 = motion_fixed_add_sat(
        piece->s0_ns_q12,
        clock_warp_mul(piece->dur_ns * MOTION_FIXED_NS_Q12, share, 56));
    now->rate_q30 = (rate + (1 << 25)) >> 26;
    now->accel_q30 = clock_warp_mul(2 * k[1] + 6 * k2x, piece->per_s_q30, 56);
    now->jerk_q30 = piece->jerk_q30;
}

void motion_clock_warp_at(const struct motion_clock_warp *warp, int64_t t_ns,
                          struct motion_clock_rate *now)
{
    int64_t dt = t_ns > warp->t0_ns ? t_ns - warp->t0_ns : 0;
    for (unsigned i = 0; i < warp->count; i++) {
        const struct motion_clock_piece *piece = &warp->piece[i];
        if (dt < piece->dur_ns) {
            clock_piece_at(piece, dt, now);
            return;
        }
        dt -= piece->dur_ns;
    }
    clock_warp_constant(warp, dt, now);
}

int64_t motion_clock_warp_square(const struct motion_clock_rate *now)
{
    return clock_warp_mul(now->rate_q30, now->rate_q30, 30);
}

void motion_clock_warp_sample(const struct motion_clock_rate *now,
                              int64_t r2_q30, const struct motion_sample *track,
                              struct motion_sample *axis)
{
    *axis = (struct motion_sample){
        .pos_q32 = track->pos_q32,
        .vel_q32 = clock_warp_mul(track->vel_q32, now->rate_q30, 30),
        .acc_q32 = motion_fixed_add_sat(
            clock_warp_mul(track->acc_q32, r2_q30, 30),
            clock_warp_mul(track->vel_q32, now->accel_q30, 30)),
    };
}
