/* firmware/host/job/job_fit.h - what would bring a move inside its limits. */
#ifndef FIRMWARE_HOST_JOB_JOB_FIT_H
#define FIRMWARE_HOST_JOB_JOB_FIT_H

#include "firmware/host/job/job.h"

/* Limits of the tracks of an axis as job_check judged them. */
void job_fit_limit(const struct job *job, unsigned axis,
                   struct plan_limit *limit);

/* By how many times pre-roll and post-roll would have to be longer; 1: they do. */
struct job_fit_rolls {
    double pre, post;
};

/* After job_check: by how much the move without its rolls would have to be
 * slower; 0 where that does not help, 1 where nothing of it is broken. */
double job_fit_stretch(const struct job *job, struct job_fit_rolls *rolls);

/* After job_check: the duration that fits, and the spans between keys that need
 * longer; nothing where no limit is broken. */
void job_fit_print(const struct job *job, FILE *file);
/* The same as the member "fit" of a JSON object. */
struct cJSON;
void job_fit_json(const struct job *job, struct cJSON *object);

#endif
