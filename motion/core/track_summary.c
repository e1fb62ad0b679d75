/* motion/core/track_summary.c - what is asked of a whole track, from its summary or
 * from its segments: see track.h. */
#include "motion/core/track.h"

#include "motion/core/track_internal.h"

/* Take in one segment, or the outline of a window. */
static void reach_add(const struct motion_extreme *pos,
                      const struct motion_extreme *vel, int64_t *down_to_q32,
                      int64_t *up_to_q32)
{
    if (vel->min < -MOTION_TRACK_STANDS_Q32 && pos->min < *down_to_q32)
        *down_to_q32 = pos->min;
    if (vel->max > MOTION_TRACK_STANDS_Q32 && pos->max > *up_to_q32)
        *up_to_q32 = pos->max;
}

void motion_track_reach(const struct motion_track *track, int64_t *down_to_q32,
                        int64_t *up_to_q32)
{
    const struct motion_track_summary *summary = track_summary(track);
    struct motion_extreme extreme[MOTION_JERK + 1];

    *down_to_q32 = INT64_MAX;
    *up_to_q32 = INT64_MIN;
    if (summary != NULL) {
        *down_to_q32 = summary->down_to_q32;
        *up_to_q32 = summary->up_to_q32;
    } else if (track->outline != NULL) {
        const struct motion_extreme *of = track->outline->extreme;
        reach_add(&of[MOTION_POS], &of[MOTION_VEL], down_to_q32, up_to_q32);
    } else {
        for (uint32_t i = 0; i < track->count; i++) {
            motion_segment_extremes(&track->segment[i], extreme);
            reach_add(&extreme[MOTION_POS], &extreme[MOTION_VEL], down_to_q32,
                      up_to_q32);
        }
    }
}

int64_t motion_track_peak(const struct motion_track *track,
                          enum motion_quantity quantity)
{
    const struct motion_track_summary *summary = track_summary(track);
    int64_t peak = 0;

    if (summary != NULL)
        return quantity == MOTION_ACC ? summary->acc_peak_q32
                                      : summary->jerk_peak_q32;
    for (uint32_t i = 0; i < track->count; i++)
        peak = motion_fixed_most(
            peak, motion_segment_peak(&track->segment[i], quantity));
    return peak;
}

void motion_track_summarise(struct motion_track *track,
                            struct motion_track_summary *summary)
{
    const struct motion_extreme none = { .min = INT64_MAX, .max = INT64_MIN };

    *summary = (struct motion_track_summary){
        .extreme = { none, none, none, none },
        .down_to_q32 = INT64_MAX,
        .up_to_q32 = INT64_MIN,
        .segment = track->segment,
        .count = track->count,
    };
    for (uint32_t i = 0; i < track->count; i++) {
        struct motion_extreme one[MOTION_JERK + 1];
        int64_t peak[MOTION_JERK + 1];
        track_segment_extremes(&track->segment[i], one, peak);
        for (int q = MOTION_POS; q <= MOTION_JERK; q++)
            motion_extreme_extend(&summary->extreme[q], &one[q]);
        summary->acc_peak_q32 =
            motion_fixed_most(summary->acc_peak_q32, peak[MOTION_ACC]);
        summary->jerk_peak_q32 =
            motion_fixed_most(summary->jerk_peak_q32, peak[MOTION_JERK]);
        reach_add(&one[MOTION_POS], &one[MOTION_VEL], &summary->down_to_q32,
                  &summary->up_to_q32);
    }
    track->summary = summary;
}
