/* firmware/studio/wasm/plan.c - see plan.h. */
#include "firmware/studio/wasm/plan.h"

#include <string.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/budget.h"
#include "motion/core/clock_warp.h"
#include "motion/plan/plan_track.h"

#define PLAN_EVENTS_SAID 10000 /* as many as a person can tell apart */

/* --- its rig ---------------------------------------------------------------- */

/* While one edits a move, none of the rig's files is another. */
static void plan_share_rig(struct studio_plan *plan,
                           const struct studio_plan *former, const char *rig,
                           const char *move)
{
    if (former == NULL || strcmp(rig, move) == 0 ||
        strcmp(rig, former->job.rig_path) != 0 ||
        strcmp(move, former->job.move_path) != 0 ||
        !store_is_same(&plan->files, &former->files, move))
        return;
    plan->rig = former->rig;
    plan->rig->users++;
}

/* The job's own, so that others can share it. */
static void plan_keep_rig(struct studio_plan *plan)
{
    if (plan->rig != NULL)
        return;
    plan->rig = memory_new(1, sizeof *plan->rig);
    *plan->rig = (struct studio_rig){ plan->job.rig, 1 };
    plan->job.is_rig_lent = true;
}

static void plan_leave_rig(struct studio_rig *rig)
{
    if (--rig->users > 0)
        return;
    rig_free(&rig->rig);
    memory_free(rig);
}

STUDIO_EXPORT struct studio_plan *
studio_plan_new(const struct store *store, const char *rig, const char *move,
                const struct studio_plan *former)
{
    struct studio_plan *plan = memory_new(1, sizeof *plan);

    if (former != NULL && former->status != STATUS_OK)
        former = NULL;
    store_snapshot(store, &plan->files);
    plan_share_rig(plan, former, rig, move);
    plan->status = job_open_again(&plan->job, &plan->files.files, rig, move,
                                  former != NULL ? &former->job : NULL,
                                  plan->rig != NULL ? &plan->rig->rig : NULL);
    plan_keep_rig(plan);
    if (plan->status == STATUS_OK) {
        job_check(&plan->job, MOTION_CLOCK_WARP_ONE_Q30);
        (void)budget_check(&plan->job.rig, plan->job.rig_path,
                           &plan->job.messages);
    }
    return plan;
}

STUDIO_EXPORT void studio_plan_delete(struct studio_plan *plan)
{
    if (plan == NULL)
        return;
    job_free(&plan->job);
    plan_leave_rig(plan->rig);
    yaml_text_close(&plan->text);
    store_free(&plan->files);
    cJSON_free(plan->report);
    cJSON_free(plan->answer);
    memory_free(plan);
}

/* --- the report ------------------------------------------------------------- */

static void plan_add_place(cJSON *object, struct plan_place place)
{
    cJSON_AddNumberToObject(object, "line", place.line);
    cJSON_AddNumberToObject(object, "column", place.column);
}

static void plan_add_messages(const struct studio_plan *plan, cJSON *report)
{
    cJSON *list = cJSON_AddArrayToObject(report, "messages");
    enum message_kind kind;
    const char *text;

    for (size_t at = 0;
         (text = messages_next(&plan->job.messages, &at, &kind)) != NULL;) {
        cJSON *item = cJSON_CreateObject();
        cJSON_AddStringToObject(item, "kind",
                                kind == MESSAGE_ERROR ? "error" : "warning");
        cJSON_AddStringToObject(item, "text", text);
        cJSON_AddItemToArray(list, item);
    }
}

static void plan_add_limits(cJSON *object, const struct rig_axis *axis)
{
    cJSON_AddStringToObject(object, "name", axis->name);
    cJSON_AddStringToObject(object, "unit", units_axis_text(axis->unit));
    json_add_fixed(object, "low", axis->limit.pos_min_q32, 32);
    json_add_fixed(object, "high", axis->limit.pos_max_q32, 32);
    json_add_fixed(object, "velocity", axis->limit.vel_q32, 32);
    json_add_fixed(object, "acceleration", axis->limit.acc_q32, 32);
    json_add_fixed(object, "jerk", axis->limit.jerk_q32, 32);
}

static double plan_seconds(int64_t t_ns_q12)
{
    return number_double(t_ns_q12, 12) / 1e9;
}

static cJSON *plan_axis(const struct studio_plan *plan, unsigned i,
                        uint64_t *all)
{
    const struct plan_axis *axis = &plan->job.move.axis[i];
    const struct motion_track *track = &plan->job.track[i];
    const uint64_t hash = plan_track_hash(track);
    cJSON *object = cJSON_CreateObject();

    *all = plan_hash_add(*all, (int64_t)hash);
    plan_add_limits(object, job_rig_axis(&plan->job, i));
    cJSON_AddStringToObject(object, "driver", plan_driver_name(axis->driver));
    cJSON_AddStringToObject(object, "curve",
                            plan_curve_rules(axis->curve)->name);
    cJSON_AddNumberToObject(object, "keys", axis->key_count);
    cJSON_AddNumberToObject(object, "segments", track->count);
    cJSON_AddNumberToObject(object, "end_s", plan_seconds(track->end_ns_q12));
    json_add_hash(object, "hash", hash);
    plan_add_place(object, axis->place);
    return object;
}

static void plan_add_tracks(const struct studio_plan *plan, cJSON *report)
{
    const struct job *job = &plan->job;
    uint64_t hash = PLAN_HASH_START;
    cJSON *axes = cJSON_AddArrayToObject(report, "axes");

    for (unsigned i = 0; i < job->planned; i++)
        cJSON_AddItemToArray(axes, plan_axis(plan, i, &hash));
    cJSON_AddNumberToObject(report, "violations", job->violation_count);
    json_add_hash(report, "hash", hash);
}

static void plan_add_events(const struct studio_plan *plan, cJSON *report)
{
    const struct job *job = &plan->job;
    cJSON *events = cJSON_AddArrayToObject(report, "events");
    unsigned said = 0;

    if (plan->status != STATUS_OK)
        return;
    for (uint32_t i = 0; i < job->rig.line_count; i++)
        for (uint32_t k = 0; k < job->shots[i].count && said < PLAN_EVENTS_SAID;
             k++, said++) {
            cJSON *event = cJSON_CreateObject();
            cJSON_AddStringToObject(event, "line", job->rig.line[i].name);
            cJSON_AddNumberToObject(event, "time_s",
                                    plan_seconds(job->shots[i].t_ns_q12[k]));
            cJSON_AddItemToArray(events, event);
        }
}

static void plan_add_missing(const struct studio_plan *plan, cJSON *report)
{
    const struct store_missing *missing = plan->files.missing;
    cJSON *list = cJSON_AddArrayToObject(report, "missing");

    for (uint32_t i = 0; i < missing->count; i++)
        cJSON_AddItemToArray(list, cJSON_CreateString(missing->name[i]));
}

static void plan_add_rig(const struct studio_plan *plan, cJSON *report)
{
    cJSON *axes = cJSON_AddArrayToObject(report, "rig_axes");

    for (unsigned i = 0; i < plan->job.rig.axis_count; i++) {
        cJSON *axis = cJSON_CreateObject();
        plan_add_limits(axis, &plan->job.rig.axis[i]);
        cJSON_AddItemToArray(axes, axis);
    }
}

STUDIO_EXPORT const char *studio_plan_report(struct studio_plan *plan)
{
    const struct plan_move *move = &plan->job.move;
    cJSON *report = cJSON_CreateObject();

    cJSON_AddStringToObject(report, "status",
                            plan->status == STATUS_OK ? "ok" : "input");
    cJSON_AddStringToObject(report, "title", move->title);
    if (move->fps_den != 0)
        cJSON_AddNumberToObject(report, "fps",
                                (double)move->fps_num / (double)move->fps_den);
    else
        cJSON_AddNullToObject(report, "fps");
    cJSON_AddNumberToObject(report, "end_s",
                            plan_seconds(plan->job.end_ns_q12));
    cJSON_AddNumberToObject(report, "planned", plan->job.memo->planned);
    cJSON_AddNumberToObject(report, "reused", plan->job.memo->reused);
    plan_add_tracks(plan, report);
    plan_add_events(plan, report);
    studio_plan_others(plan, report);
    studio_plan_points(plan, report);
    plan_add_rig(plan, report);
    plan_add_messages(plan, report);
    plan_add_missing(plan, report);
    cJSON_free(plan->report);
    plan->report = cJSON_PrintUnformatted(report);
    cJSON_Delete(report);
    if (plan->report == NULL)
        memory_fail();
    return plan->report;
}
