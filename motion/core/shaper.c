/* motion/core/shaper.c - see shaper.h. */
#include "motion/core/shaper.h"

#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"

static bool shaper_is_delay(int64_t delay_ns_q12, int64_t least_ns_q12)
{
    return delay_ns_q12 >= least_ns_q12 &&
           delay_ns_q12 <= MOTION_SHAPER_DELAY_MAX_NS_Q12;
}

int motion_shaper_init(struct motion_shaper *shaper, uint32_t count,
                       const uint64_t amplitude_q62[],
                       const int64_t delay_ns_q12[])
{
    uint64_t left = MOTION_SHAPER_ONE_Q62;
    int64_t least_ns_q12 = 0;

    if (count < 1 || count > MOTION_SHAPER_IMPULSES_MAX)
        return MOTION_E_ARG;
    for (uint32_t i = 0; i < count; i++) {
        if (amplitude_q62[i] == 0 || amplitude_q62[i] > left ||
            !shaper_is_delay(delay_ns_q12[i], least_ns_q12))
            return MOTION_E_ARG;
        left -= amplitude_q62[i];
        least_ns_q12 = delay_ns_q12[i] + 1;
    }
    if (left != 0)
        return MOTION_E_ARG;
    shaper->count = count;
    for (uint32_t i = 0; i < count; i++) {
        shaper->amplitude_q62[i] = amplitude_q62[i];
        shaper->delay_ns_q12[i] = delay_ns_q12[i];
    }
    return MOTION_OK;
}

/* sum + amplitude value.  |value| <= 2^63 and the amplitudes add up to 2^62, so
 * every partial sum is within +-2^125. */
static struct motion_u128 shaper_add(struct motion_u128 sum, uint64_t amplitude,
                                     int64_t value)
{
    const uint64_t minus = value < 0 ? UINT64_MAX : 0;
    const struct motion_u128 part =
        motion_fixed_mul_u64(motion_fixed_abs(value), amplitude);

    return motion_fixed_add_u128(sum, motion_fixed_sign_i128(part, minus));
}

/* A mean of int64 is one: the low word has it all. */
static int64_t shaper_mean(struct motion_u128 sum)
{
    return (int64_t)motion_fixed_round_i128(sum, 62).lo;
}

void motion_shaper_sample(const struct motion_shaper *shaper,
                          const struct motion_track *track,
                          struct motion_shaper_cursor *cursor, int64_t t_ns_q12,
                          struct motion_sample *sample)
{
    /* Before 0 a track stands, so that -1 will do for all times before it, and
     * no difference wraps. */
    const int64_t now = t_ns_q12 < 0 ? -1 : t_ns_q12;
    struct motion_u128 pos = { 0, 0 }, vel = { 0, 0 }, acc = { 0, 0 };

    for (uint32_t i = 0; i < shaper->count; i++) {
        const uint64_t amplitude = shaper->amplitude_q62[i];
        struct motion_sample at;

        motion_track_sample(track, &cursor->impulse[i],
                            now - shaper->delay_ns_q12[i], &at);
        pos = shaper_add(pos, amplitude, at.pos_q32);
        vel = shaper_add(vel, amplitude, at.vel_q32);
        acc = shaper_add(acc, amplitude, at.acc_q32);
    }
    sample->pos_q32 = shaper_mean(pos);
    sample->vel_q32 = shaper_mean(vel);
    sample->acc_q32 = shaper_mean(acc);
}
