/* firmware/host/job/job_plan.c - the tracks, events and waits of a move file:
 * see job_open.h. */
#include "firmware/host/job/job_open.h"

#include <stddef.h>

#include "firmware/host/job/job_goals.h"
#include "firmware/host/job/job_shape.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"
#include "motion/plan/shoot/plan_shoot.h"

/* "file:line:column: key 3 of axis pan: what is wrong"; a sentence of a planner
 * says itself what it is about. */
static enum status job_plan_fail(struct job *job,
                                 const struct plan_error *error)
{
    messages_add(&job->messages, MESSAGE_ERROR, "%s:%u:%u: %s", job->move_path,
                 error->place.line, error->place.column,
                 error->text[0] != 0 ? error->text
                                     : motion_err_text(error->code));
    return STATUS_INPUT;
}

/* What is right but hardly wanted. */
static void job_remark(struct job *job, const struct plan_axis *axis,
                       const struct motion_track *track)
{
    char text[160];

    if (plan_axis_remark(axis, track, text))
        messages_add(&job->messages, MESSAGE_WARNING, "%s:%u:%u: warning: %s",
                     job->move_path, axis->place.line, axis->place.column,
                     text);
}

static enum status job_find_axes(struct job *job)
{
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        int found = rig_axis_index(&job->rig, job->move.axis[i].name);
        if (found < 0)
            return job_fail(job, "names an axis the rig lacks");
        job->rig_axis[i] = (unsigned)found;
    }
    return STATUS_OK;
}

static enum status job_plan_events(struct job *job)
{
    struct plan_error error = { .code = MOTION_OK };
    for (uint32_t i = 0; i < job->rig.line_count; i++)
        if (plan_shots_make(&job->move, job->track, &job->outcome, i,
                            &job->shots[i], &error) < 0)
            return job_plan_fail(job, &error);
    return STATUS_OK;
}

/* Where the clock is to stand all axes do, also those that a shaper makes late. */
static enum status job_plan_steps(struct job *job)
{
    const struct plan_shoot *shoot = job->move.shoot;
    struct plan_shoot_times times;
    struct plan_error error = { .code = MOTION_OK };

    if (shoot == NULL || !shoot->steps)
        return STATUS_OK;
    const double settle_s =
        (double)shoot->settle_ns_q12 / (double)MOTION_FIXED_S_Q12;
    if (job->shaping.longer_s > settle_s) {
        (void)plan_error_set(&error, MOTION_E_ARG, shoot->place,
                             "shoot is to step, and the shapers need %.3f s of "
                             "rest before it waits, expected a settle of as "
                             "much",
                             job->shaping.longer_s);
        return job_plan_fail(job, &error);
    }
    plan_shoot_times(shoot, &times);
    job->steps = (struct frame_step_config){
        .first_ns_q12 = times.wait_ns_q12,
        .period_ns_q12 = times.period_ns_q12,
        .count = shoot->frames,
    };
    if (shoot->step_line != PLAN_SHOOT_NO_LINE)
        job->step_line = &job->rig.line[shoot->step_line];
    return STATUS_OK;
}

enum status job_plan(struct job *job)
{
    struct plan_error error = { .code = MOTION_OK };
    enum status status = job_find_axes(job);
    if (status == STATUS_OK)
        status = job_goals_request(job);
    if (status != STATUS_OK)
        return status;
    if (plan_compose_again(
            &job->move, job->former != NULL ? job->former->memo : NULL,
            job->memo, job->track, &job->outcome, job->progress, &error) < 0)
        return job_plan_fail(job, &error);
    job->planned = job->move.axis_count;
    for (unsigned i = 0; i < job->planned; i++)
        job_remark(job, &job->move.axis[i], &job->track[i]);
    status = job_shape(job);
    if (status != STATUS_OK)
        return status;
    for (unsigned i = 0; i < job->planned; i++) {
        if (job->track[i].end_ns_q12 > job->end_ns_q12)
            job->end_ns_q12 = job->track[i].end_ns_q12;
    }
    job_goals_make(job);
    status = job_gantries(job);
    if (status == STATUS_OK)
        status = job_plan_events(job);
    return status == STATUS_OK ? job_plan_steps(job) : status;
}
