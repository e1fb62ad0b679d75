/* firmware/host/job/path_report.h - what there is to say about a move's
 * path.
 *
 * Length, the rule it was measured with, path speed, how far the axes are from
 * what was asked.  Nothing where the move has no path. */
#ifndef FIRMWARE_HOST_JOB_PATH_REPORT_H
#define FIRMWARE_HOST_JOB_PATH_REPORT_H

#include <stdio.h>

#include "firmware/host/job/job.h"

/* Two lines and a blank one before them. */
void path_report_text(const struct job *job, FILE *file);
/* The member "path" of a JSON object. */
void path_report_json(const struct job *job, struct cJSON *object);
/* The length by every rule of motion/path/arclen.h, as a table. */
void path_report_rules(const struct job *job, FILE *file);

/* The unit of the path's axes. */
enum units_axis path_report_unit(const struct job *job);

#endif
