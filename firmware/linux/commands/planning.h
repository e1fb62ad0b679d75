/* firmware/linux/commands/planning.h - reading and planning a move, and what
 * else is long, with a line on a terminal meanwhile. */
#ifndef FIRMWARE_LINUX_COMMANDS_PLANNING_H
#define FIRMWARE_LINUX_COMMANDS_PLANNING_H

#include <stdbool.h>

#include "firmware/host/move/job.h"
#include "motion/plan/plan_progress.h"

/* As job_open, or job_open_any (`any`). */
enum status planning_open(struct job *job, const char *const path[], int count,
                          bool any);

/* Of whoever does long work: where stderr is a terminal there is a line after a
 * second, rewritten five times a second, and nothing is left of it once the
 * work is over.  One at a time. */
extern const struct plan_progress planning_progress;

#endif
