/* motion/plan/fit/fit_peak.c - see fit_peak.h.
 *
 * The units: time so that the quintic takes 64 to 128 s, whose step of 2^-12 ns
 * is 4e-15 of it; position so that displacement, v T and a T^2 are at most 2^28.
 * Then v is at most 2^22 a unit/s or so, a 2^16 and jerk 2^16, in steps of 2^-32,
 * and the control points of the curve stay in the range of a segment. */
#include "motion/plan/fit/fit_peak.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/core/track.h"
#include "motion/double/double_math.h"

#define FIT_TIME_BITS 7  /* log2 of the longest duration, in s */
#define FIT_SIZE_BITS 28 /* of the largest displacement */

double plan_fit_stretch(const double ratio[PLAN_FIT_ORDERS],
                        unsigned *decided_by)
{
    const double need[] = { ratio[0], sqrt(ratio[1]), double_cbrt(ratio[2]) };
    double stretch = 1;

    *decided_by = 0;
    for (unsigned i = 0; i < PLAN_FIT_ORDERS; i++) {
        if (need[i] > stretch) {
            stretch = need[i];
            *decided_by = i + 1;
        }
    }
    return stretch;
}

/* value 2^bits as Q32.32 */
static int64_t fit_to_q32(double value, int bits)
{
    return (int64_t)llround(ldexp(value, bits + 32));
}

static double fit_size(const struct plan_fit_quintic *quintic)
{
    const double t = quintic->dur_s;
    double size = fabs(quintic->displacement);

    for (unsigned i = 0; i < 2; i++)
        size = fmax(size, fmax(fabs(quintic->vel[i]) * t,
                               fabs(quintic->acc[i]) * t * t));
    return size;
}

static bool fit_is_finite(const struct plan_fit_quintic *quintic)
{
    return isfinite(quintic->dur_s) && quintic->dur_s > 0 &&
           isfinite(quintic->displacement) && isfinite(quintic->vel[0]) &&
           isfinite(quintic->vel[1]) && isfinite(quintic->acc[0]) &&
           isfinite(quintic->acc[1]) && isfinite(fit_size(quintic));
}

int plan_fit_quintic_peaks(const struct plan_fit_quintic *quintic,
                           double peak[PLAN_FIT_ORDERS])
{
    struct motion_segment segment;
    struct motion_track track;
    struct motion_extreme extreme[MOTION_JERK + 1];
    int time = 0, size = 0;

    if (!fit_is_finite(quintic))
        return MOTION_E_RANGE;
    (void)frexp(quintic->dur_s, &time);
    (void)frexp(fit_size(quintic), &size);
    /* times are multiplied by 2^time, positions by 2^size */
    time = FIT_TIME_BITS - time;
    size = FIT_SIZE_BITS - size;
    const struct motion_state start = {
        .vel_q32 = fit_to_q32(quintic->vel[0], size - time),
        .acc_q32 = fit_to_q32(quintic->acc[0], size - 2 * time),
    };
    const struct motion_state end = {
        .pos_q32 = fit_to_q32(quintic->displacement, size),
        .vel_q32 = fit_to_q32(quintic->vel[1], size - time),
        .acc_q32 = fit_to_q32(quintic->acc[1], size - 2 * time),
    };
    const int64_t dur_ns_q12 =
        llround(ldexp(quintic->dur_s, time) * (double)MOTION_FIXED_S_Q12);

    motion_track_init(&track, &segment, 1, 0);
    const int err =
        motion_track_append_quintic(&track, dur_ns_q12, &start, &end);
    if (err < 0)
        return err;
    motion_segment_extremes(&segment, extreme);
    for (int i = 0; i < PLAN_FIT_ORDERS; i++) {
        const struct motion_extreme *const of = &extreme[MOTION_VEL + i];
        const double most = fmax(fabs((double)of->min), fabs((double)of->max));
        peak[i] = ldexp(most, -32 - size + (i + 1) * time);
    }
    return MOTION_OK;
}
