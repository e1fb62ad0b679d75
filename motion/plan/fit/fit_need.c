/* motion/plan/fit/fit_need.c - see fit.h. */
#include <math.h>
#include <stdbool.h>

#include "motion/core/fixed.h"
#include "motion/double/double_math.h"
#include "motion/plan/fit/fit.h"
#include "motion/plan/keys/move_internal.h"

/* Largest |value| / limit; as the checker judges: velocity to the last bit,
 * acceleration and jerk without what rounding has added. */
static void need_ratios(const struct motion_segment *segment,
                        const struct plan_limit *limit,
                        double ratio[PLAN_FIT_ORDERS])
{
    struct motion_extreme vel;

    motion_segment_extreme(segment, MOTION_VEL, &vel);
    ratio[0] = fmax(fabs((double)vel.min), fabs((double)vel.max)) /
               (double)limit->vel_q32;
    ratio[1] = (double)motion_segment_peak(segment, MOTION_ACC) /
               (double)limit->acc_q32;
    ratio[2] = limit->jerk_q32 == 0
                   ? 0
                   : (double)motion_segment_peak(segment, MOTION_JERK) /
                         (double)limit->jerk_q32;
}

/* A corner of given length does not become longer: at a lower speed its
 * acceleration and jerk fall with the speed, no faster. */
static struct plan_fit_need need_of(const struct motion_segment *segment,
                                    const struct plan_limit *limit, bool corner)
{
    struct plan_fit_need need = { 0, 0 };
    double ratio[PLAN_FIT_ORDERS];

    need_ratios(segment, limit, ratio);
    if (!corner) {
        ratio[1] = sqrt(fmax(ratio[1], 0));
        ratio[2] = double_cbrt(ratio[2]);
    }
    for (unsigned i = 0; i < PLAN_FIT_ORDERS; i++)
        if (ratio[i] > need.stretch)
            need = (struct plan_fit_need){ ratio[i], i + 1 };
    return need;
}

static void need_take(struct plan_fit_need *worst, struct plan_fit_need need)
{
    if (need.stretch > worst->stretch)
        *worst = need;
}

struct plan_fit_need plan_fit_track_need(const struct motion_track *track,
                                         const struct plan_limit *limit)
{
    struct plan_fit_need worst = { 0, 0 };

    for (uint32_t i = 0; i < track->count; i++)
        need_take(&worst, need_of(&track->segment[i], limit, false));
    return worst;
}

static bool need_is_corner(const struct plan_axis *axis, uint32_t span)
{
    const enum plan_curve curve = move_curve_at(axis, span);

    return curve == PLAN_CURVE_ROUNDED || curve == PLAN_CURVE_SMOOTHED;
}

/* Both lists ascend: a segment counts for every span that it is part of, and
 * what comes before the first or after the last key for the span beside it. */
void plan_fit_span_needs(const struct plan_axis *axis,
                         const struct motion_track *track,
                         const struct plan_limit *limit,
                         struct plan_fit_need need[])
{
    const uint32_t spans = axis->key_count > 0 ? axis->key_count - 1 : 0;
    uint32_t first = 0;

    for (uint32_t i = 0; i < spans; i++)
        need[i] = (struct plan_fit_need){ 0, 0 };
    for (uint32_t i = 0; spans > 0 && i < track->count; i++) {
        const struct motion_segment *segment = &track->segment[i];
        const int64_t end = segment->start_ns_q12 + segment->dur_ns_q12;
        while (first + 1 < spans &&
               axis->key[first + 1].key.t_ns_q12 <= segment->start_ns_q12)
            first++;
        const struct plan_fit_need of =
            need_of(segment, limit, need_is_corner(axis, first));
        need_take(&need[first], of);
        for (uint32_t k = first + 1;
             k < spans && axis->key[k].key.t_ns_q12 < end; k++)
            need_take(&need[k], of);
    }
}
