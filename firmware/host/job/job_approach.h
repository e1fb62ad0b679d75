/* firmware/host/job/job_approach.h - from where an axis stands to a place on its track,
 * before the move is played. */
#ifndef FIRMWARE_HOST_JOB_JOB_APPROACH_H
#define FIRMWARE_HOST_JOB_JOB_APPROACH_H

#include "firmware/host/job/job.h"

#define JOB_APPROACH_SEGMENTS 8

/* At rest to where the track of an axis is at `t_ns_q12`, at a quarter of its
 * limits, onto `track`, which is empty at where the axis stands and has room for
 * JOB_APPROACH_SEGMENTS.  1, or 0 where it stands there; as
 * motion_ease_append_limited. */
int job_approach(const struct plan_limit *limit, const struct motion_track *to,
                 int64_t t_ns_q12, struct motion_track *track);

/* Why an axis cannot go from one position to another, or start there: which, from
 * where, to where. */
#define JOB_APPROACH_TEXT_MAX 240
void job_approach_text(const struct rig_axis *axis, int err, int64_t from_q32,
                       int64_t to_q32, char text[JOB_APPROACH_TEXT_MAX]);

#endif
