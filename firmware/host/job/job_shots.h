/* firmware/host/job/job_shots.h - the events of a move: whether its lines can
 * keep up. */
#ifndef FIRMWARE_HOST_JOB_JOB_SHOTS_H
#define FIRMWARE_HOST_JOB_JOB_SHOTS_H

#include "firmware/host/job/job.h"

/* Of any line; they are fired in the order of the path, once, so that such a move
 * is played from its start to its end alone. */
bool job_has_shots(const struct job *job);

/* The closest two of a line, with the move played at `rate_q30`: index of the
 * first; *apart_ns on the clock. */
uint32_t job_shots_closest(const struct plan_shots *shots, int64_t rate_q30,
                           int64_t *apart_ns);

/* Can every line finish a pulse, and rest, before the next one, with the move
 * played at `rate_q30`?  When not, an error per line. */
bool job_shots_check(const struct job *job, int64_t rate_q30,
                     struct messages *messages);
/* The same of shots by line of a rig, of the file `path`; event NULL: their rules
 * are not known. */
bool job_shots_keep_up(const struct rig *rig, const struct plan_shots shots[],
                       const struct plan_event event[], const char *path,
                       int64_t rate_q30, struct messages *messages);

#endif
