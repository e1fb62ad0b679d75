/* firmware/host/job/job_approach.c - see job_approach.h. */
#include "firmware/host/job/job_approach.h"

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
