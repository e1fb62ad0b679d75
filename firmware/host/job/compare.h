/* firmware/host/job/compare.h - the same keys under several curves.
 *
 * A job whose axes are one axis of the move again and again, each with another
 * kind of curve: what draws a job then draws the comparison. */
#ifndef FIRMWARE_HOST_JOB_COMPARE_H
#define FIRMWARE_HOST_JOB_COMPARE_H

#include "firmware/host/job/job.h"

/* Spellings of enum plan_curve, in its order. */
extern const char *const compare_spelling[];
extern const unsigned compare_spellings;

/* "linear,catmull-rom" or "all" to curves, 1 .. PLAN_AXES_MAX of them, on the
 * heap.  Returns how many, or -1 with a message that begins with `option`, such as
 * "slew plot: --compare", and *curve NULL. */
int compare_parse(const char *option, const char *text, enum plan_curve **curve,
                  struct messages *messages);

/* Plan the keys of `axis` under a curve.  What a key gives and the curve does
 * not take is left out; what the curve needs and no key gives is 0.  As
 * plan_axis_track; on success *planned has what was planned, with keys on the
 * heap of its own. */
int compare_plan(const struct plan_axis *axis, enum plan_curve curve,
                 struct plan_axis *planned, struct motion_track *track,
                 struct plan_error *error);

/* Make `job` the comparison of one of its axes (NULL: its only one).  On an
 * error returns STATUS_INPUT with a message of the job; job_free in either case. */
enum status compare_job(struct job *job, const char *curves,
                        const char *axis_name);

/* Make `job` the comparison of its axes with those of `after`, another move of
 * the same axes: "dolly before" beside "dolly after", as many as there is room
 * for.  What is drawn of `after` is taken from it. */
void compare_repaired(struct job *job, struct job *after);

#endif
