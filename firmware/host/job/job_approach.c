/* firmware/host/job/job_approach.c - see job_approach.h. */
#include "firmware/host/job/job_approach.h"

#include <stdio.h>

#include "firmware/host/base/number.h"
#include "firmware/host/base/units.h"
#include "motion/core/err.h"
#include "motion/core/track.h"
#include "motion/curve/ease.h"

#define JOB_APPROACH_SLOW 4 /* its share of the limits: 1/4 */

int job_approach(const struct plan_limit *limit, const struct motion_track *to,
                 int64_t t_ns_q12, struct motion_track *track)
{
    const struct motion_ease_limit slow = {
        .vel_q32 = limit->vel_q32 / JOB_APPROACH_SLOW,
        .acc_q32 = limit->acc_q32 / JOB_APPROACH_SLOW,
        .jerk_q32 = limit->jerk_q32 / JOB_APPROACH_SLOW,
    };
    struct motion_sample there;
    struct motion_cursor cursor = { 0 };

    motion_track_sample(to, &cursor, t_ns_q12, &there);
    if (there.pos_q32 == track->end.pos_q32)
        return 0;
    const int err = motion_ease_append_limited(track, there.pos_q32, &slow);
    return err < 0 ? err : 1;
}

void job_approach_text(const struct rig_axis *axis, int err, int64_t from_q32,
                       int64_t to_q32, char text[JOB_APPROACH_TEXT_MAX])
{
    static const double most_ns =
        (double)MOTION_TRACK_SEGMENT_MAX_NS_Q12 / MOTION_FIXED_NS_Q12;
    char from[NUMBER_MAX], to[NUMBER_MAX];
    const char *unit = units_axis_text(axis->unit);
    number_short(from, from_q32, 32);
    number_short(to, to_q32, 32);
    if (err == MOTION_E_RANGE)
        snprintf(text, JOB_APPROACH_TEXT_MAX,
                 "%s: from %s to %s %s at a quarter of its limits takes longer "
                 "than %.2f days",
                 axis->name, from, to, unit, most_ns / 86400e9);
    else
        snprintf(text, JOB_APPROACH_TEXT_MAX,
                 "%s, at %s and to be at %s %s: %s", axis->name, from, to, unit,
                 motion_err_text(err));
}
