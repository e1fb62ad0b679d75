/* firmware/linux/commands/planning.h - reading and planning a move, and what
 * else is long, with a line on a terminal meanwhile. */
#ifndef FIRMWARE_LINUX_COMMANDS_PLANNING_H
#define FIRMWARE_LINUX_COMMANDS_PLANNING_H

#include <stdbool.h>

#include "firmware/host/job/job.h"
#include "motion/plan/plan_progress.h"

/* As job_open, of RIG MOVE or one directory, with every message on stderr.
 * job_free in either case. */
enum status planning_open(struct job *job, const char *const path[], int count,
                          bool any);

/* The same of these two, wherever `files` has them. */
enum status planning_open_files(struct job *job, const struct files *files,
                                const char *rig, const char *move);

/* The file of a rig that is named by itself, or by a directory with rig.yaml. */
#define PLANNING_PATH_MAX ((int)sizeof((struct job *)0)->rig_path)
enum status planning_rig_path(const char *path, char name[PLANNING_PATH_MAX]);
/* As job_read_rig, of such a file. */
enum status planning_rig(const char *path, struct rig *rig);

/* A time of the move that an option has, in seconds, frames or timecode of it. */
enum status planning_time(const struct job *job, const char *command,
                          const char *option, const char *text,
                          int64_t *t_ns_q12);

/* Of whoever does long work: where stderr is a terminal there is a line after a
 * second, rewritten five times a second, and nothing is left of it once the
 * work is over.  One at a time. */
extern const struct plan_progress planning_progress;

#endif
