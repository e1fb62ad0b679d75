/* firmware/host/job/job_shape.h - the input shapers of a rig on a planned
 * move, and what they cost. */
#ifndef FIRMWARE_HOST_JOB_JOB_SHAPE_H
#define FIRMWARE_HOST_JOB_JOB_SHAPE_H

#include <stdio.h>

#include "firmware/host/job/job.h"

/* The tracks of the job, which is planned: each axis of the move that has a
 * shaper in the rig goes through it, the others wait.  On an error a message. */
enum status job_shape(struct job *job);

struct cJSON;
/* "shaper zvd 2.50 Hz on slide: ..." per axis, and what they cost the move;
 * nothing for a move without. */
void job_shape_print(const struct job *job, FILE *file);
/* "shapers" of a report; nothing for a move without. */
void job_shape_json(const struct job *job, struct cJSON *report);

#endif
