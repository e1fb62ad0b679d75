/* firmware/linux/commands/planning.h - reading and planning a move, with a line
 * on a terminal while that takes long. */
#ifndef FIRMWARE_LINUX_COMMANDS_PLANNING_H
#define FIRMWARE_LINUX_COMMANDS_PLANNING_H

#include <stdbool.h>

#include "firmware/host/move/job.h"
#include "motion/plan/plan_progress.h"

/* As job_open, or job_open_any (`any`). */
enum status planning_open(struct job *job, const char *const path[], int count,
                          bool any);

/* What planning tells, of whoever plans: where stderr is a terminal there is a
 * line after a second, rewritten five times a second, and nothing is left of it
 * once planning is over.  One at a time. */
extern const struct plan_progress planning_progress;

#endif
