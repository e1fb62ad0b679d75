/* firmware/host/job/job_shape.c - see job_shape.h. */
#include "firmware/host/job/job_shape.h"

#include <cjson/cJSON.h>

#include "firmware/host/base/memory.h"
#include "motion/core/err.h"
#include "motion/plan/plan_error.h"

static enum status shape_fail(struct job *job, const struct plan_error *error)
{
    messages_add(&job->messages, MESSAGE_ERROR, "%s: %s", job->move_path,
                 error->text);
    return STATUS_INPUT;
}

/* As the tracks are now. */
static void shape_keep_plain(struct job *job)
{
    job->plain =
        memory_pool_new(&job->memory, job->move.axis_count, sizeof *job->plain);
    for (uint32_t i = 0; i < job->move.axis_count; i++)
        job_copy_track(&job->track[i], &job->plain[i]);
}

enum status job_shape(struct job *job)
{
    const uint32_t axes = job->move.axis_count;
    const struct plan_shaper **shaper =
        memory_pool_new(&job->memory, axes, sizeof(const struct plan_shaper *));
    struct plan_error error = { .code = MOTION_OK };

    for (uint32_t i = 0; i < axes; i++) {
        const struct rig_axis *axis = job_rig_axis(job, i);
        if (!axis->has_shaper)
            continue;
        struct plan_shaper *made =
            memory_pool_new(&job->memory, 1, sizeof *made);
        if (plan_shaper_design(&axis->shaper, made, &error) < 0)
            return shape_fail(job, &error);
        shaper[i] = made;
        if (job->plain == NULL)
            shape_keep_plain(job);
    }
    if (plan_shape_move(shaper, axes, job->track, &job->outcome, &job->shaping,
                        &error) < 0)
        return shape_fail(job, &error);
    return STATUS_OK;
}

void job_shape_print(const struct job *job, FILE *file)
{
    if (job->shaping.lag_s == 0)
        return;
    for (uint32_t i = 0; i < job->move.axis_count; i++) {
        const struct rig_axis *axis = job_rig_axis(job, i);
        if (axis->has_shaper)
            fprintf(file, "%s: shaper %s, %.4g Hz, damping %.3g\n", axis->name,
                    plan_shaper_word(axis->shaper.kind),
                    axis->shaper.frequency_hz, axis->shaper.damping);
    }
    fprintf(file,
            "shapers: the move is %.3f s longer, and every axis is %.3f s "
            "later\n",
            job->shaping.longer_s, job->shaping.lag_s);
}

void job_shape_json(const struct job *job, cJSON *report)
{
    if (job->shaping.lag_s == 0)
        return;
    cJSON *object = cJSON_AddObjectToObject(report, "shaping");
    cJSON_AddNumberToObject(object, "lag_s", job->shaping.lag_s);
    cJSON_AddNumberToObject(object, "longer_s", job->shaping.longer_s);
    cJSON *list = cJSON_AddArrayToObject(object, "shapers");
    for (uint32_t i = 0; i < job->move.axis_count; i++) {
        const struct rig_axis *axis = job_rig_axis(job, i);
        if (!axis->has_shaper)
            continue;
        cJSON *item = cJSON_CreateObject();
        cJSON_AddItemToArray(list, item);
        cJSON_AddStringToObject(item, "axis", axis->name);
        cJSON_AddStringToObject(item, "kind",
                                plan_shaper_word(axis->shaper.kind));
        cJSON_AddNumberToObject(item, "frequency_hz",
                                axis->shaper.frequency_hz);
        cJSON_AddNumberToObject(item, "damping", axis->shaper.damping);
    }
}
