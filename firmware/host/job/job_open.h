/* firmware/host/job/job_open.h - the two ways to the tracks of a job, from a move
 * file and from a compiled move; for job.c alone.
 *
 * The rig has been read.  STATUS_OK, or STATUS_INPUT with a message. */
#ifndef FIRMWARE_HOST_JOB_JOB_OPEN_H
#define FIRMWARE_HOST_JOB_JOB_OPEN_H

#include "firmware/host/job/job.h"

/* Tracks, goals, events and waits of the move, which has been read. */
enum status job_plan(struct job *job);
/* The same of the compiled move at move_path, which stays open. */
enum status job_open_compiled(struct job *job, const struct files *files);

/* job_gantry.c: do its tracks keep the rails of each gantry together? */
enum status job_gantries(struct job *job);

/* What is wrong with the file of the move as a whole; STATUS_INPUT. */
enum status job_fail(struct job *job, const char *what);

#endif
