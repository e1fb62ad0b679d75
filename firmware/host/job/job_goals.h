/* firmware/host/job/job_goals.h - the axes of a job whose drives go from
 * key to key by a profile of their own (mode: point-to-point). */
#ifndef FIRMWARE_HOST_JOB_JOB_GOALS_H
#define FIRMWARE_HOST_JOB_JOB_GOALS_H

#include "firmware/host/job/job.h"

/* Before planning, once the axes are found: their profiles are those that the
 * limits of the rig allow.  STATUS_INPUT with a message for a move that gives
 * such an axis anything but keys. */
enum status job_goals_request(struct job *job);

/* After it: the motions of their tracks. */
void job_goals_make(struct job *job);

/* The key (from 0) that a goal of an axis is; its own time is when the next
 * thing may happen there. */
uint32_t job_goals_key(const struct job *job, unsigned axis, unsigned goal);

#endif
