/* motion/plan/plan_duration.c - see plan_duration.h.
 *
 * A duration that is rounded by 2^-12 ns at either end changes the velocity v
 * of a segment that takes T by v 2^-12 ns / T: 2.5e-10 of it at 1 ms.  What a
 * drive sees of that is far below what check.c allows for its digits. */
#include "motion/plan/plan_duration.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"

int plan_duration_apply(struct motion_track *track, int64_t from_ns_q12,
                        int64_t to_ns_q12)
{
    int64_t start = 0;

    if (from_ns_q12 == to_ns_q12)
        return MOTION_OK;
    for (uint32_t i = 0; i < track->count; i++) {
        struct motion_segment *segment = &track->segment[i];
        int64_t end;
        const int err =
            motion_fixed_muldiv(segment->start_ns_q12 + segment->dur_ns_q12,
                                to_ns_q12, from_ns_q12, &end);
        if (err < 0 || end <= start || end > MOTION_TRACK_MAX_NS_Q12)
            return MOTION_E_RANGE;
        segment->start_ns_q12 = start;
        segment->dur_ns_q12 = end - start;
        if (motion_segment_restore(segment) < 0)
            return MOTION_E_RANGE;
        motion_segment_state(segment, segment->dur_ns_q12, &track->end);
        start = end;
    }
    track->end_ns_q12 = start;
    return MOTION_OK;
}
