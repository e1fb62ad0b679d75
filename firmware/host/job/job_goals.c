/* firmware/host/job/job_goals.c - see job_goals.h. */
#include "firmware/host/job/job_goals.h"

#include "firmware/host/base/memory.h"
#include "firmware/host/rig/modbus_budget.h"
#include "motion/core/fixed.h"
#include "motion/plan/plan_blend.h"

static bool goals_is_of(const struct plan_other *other, uint32_t axis)
{
    for (uint32_t i = 0; i < other->move->axis_count; i++)
        if (other->of[i] == axis)
            return true;
    return false;
}

/* What moves the axis beside its keys, or in their place; NULL: nothing. */
static const char *goals_other(const struct plan_move *move, uint32_t axis)
{
    if (move->axis[axis].driver != PLAN_BY_KEYS)
        return plan_driver_name(move->axis[axis].driver);
    for (uint32_t i = 0; i < move->layers; i++)
        if (goals_is_of(&move->layer[i], axis))
            return "layers";
    if (move->fade != NULL && goals_is_of(move->fade, axis))
        return "fade";
    if (move->shoot != NULL)
        return "shoot";
    if (move->duration_ns_q12 != 0)
        return "duration";
    if (move->pre_roll_ns_q12 != 0 || move->post_roll_ns_q12 != 0)
        return "pre_roll or post_roll";
    return move->warp != NULL ? "warp" : NULL;
}

enum status job_goals_request(struct job *job)
{
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        struct plan_axis *axis = &job->move.axis[i];
        const struct rig_axis *rig = job_rig_axis(job, i);

        if (!job_runs_by_drive_profile(job, i))
            continue;
        const char *other = goals_other(&job->move, i);
        if (other != NULL) {
            messages_add(
                &job->messages, MESSAGE_ERROR,
                "%s:%u:%u: axis %s is moved by %s, expected keys alone: "
                "its drive goes from key to key by its own profile",
                job->move_path, axis->place.line, axis->place.column,
                axis->name, other);
            return STATUS_INPUT;
        }
        axis->profile = (struct plan_profile){
            .vel_q32 = rig->limit.vel_q32,
            .acc_q32 = rig->limit.acc_q32,
            .settle_ns_q12 =
                modbus_budget_settle_ns(&job->rig, job->rig_axis[i]) *
                MOTION_FIXED_NS_Q12,
        };
    }
    return STATUS_OK;
}

void job_goals_make(struct job *job)
{
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        const struct motion_track *track = &job->track[i];

        if (!job_runs_by_drive_profile(job, i))
            continue;
        job->goal_count[i] = controller_goals_of(track, NULL, 0);
        job->goal[i] = memory_pool_new(
            &job->memory, (size_t)job->goal_count[i] + 1, sizeof *job->goal[i]);
        controller_goals_of(track, job->goal[i], job->goal_count[i]);
    }
}

uint32_t job_goals_key(const struct job *job, unsigned axis, unsigned goal)
{
    const struct plan_axis *plan = &job->move.axis[axis];
    const int64_t end_ns_q12 = job->goal[axis][goal].end_ns_q12;
    uint32_t key = 0;

    while (key + 1 < plan->key_count &&
           plan->key[key].key.t_ns_q12 < end_ns_q12)
        key++;
    return key;
}
