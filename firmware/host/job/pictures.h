/* firmware/host/job/pictures.h - the pictures of a shoot: when each opens and closes,
 * in s of the move as played, and where the axes are when it opens. */
#ifndef FIRMWARE_HOST_JOB_PICTURES_H
#define FIRMWARE_HOST_JOB_PICTURES_H

#include <stdio.h>

#include "firmware/host/job/job.h"

struct cJSON;

/* Nothing for a move without a shoot. */
void pictures_text(const struct job *job, FILE *file);
/* The member "pictures". */
void pictures_json(const struct job *job, struct cJSON *object);
void pictures_csv(const struct job *job, FILE *file);

#endif
