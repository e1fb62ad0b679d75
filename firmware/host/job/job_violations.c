/* firmware/host/job/job_violations.c - what job_check found, for the user: see
 * job.h. */

#include <cjson/cJSON.h>
#include <stdio.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/job/job.h"
#include "firmware/host/job/job_fit.h"
#include "motion/plan/camera/plan_camera.h"
#include "motion/plan/plan_bound.h"
#include "motion/plan/plan_track.h"

#define JOB_WORST 20 /* rows for each axis and kind of violation */

/* Line in the move's file of a key, or of what drives an axis without keys. */
static uint32_t job_line(const struct plan_axis *axis, uint32_t key)
{
    return axis->key_count > 0 ? axis->key[key].place.line : axis->place.line;
}

static void job_print_violation(const struct job *job, struct table *table,
                                const struct job_violation *violation)
{
    const struct plan_axis *axis = &job->move.axis[violation->axis];
    unsigned order = job_violation_order(violation->kind);
    char value[NUMBER_MAX], limit[NUMBER_MAX], t[NUMBER_MAX];
    char unit[NUMBER_UNIT_MAX];
    number_seconds(t, violation->t_ns_q12);
    number_short(value, violation->value, 32);
    number_short(limit, violation->limit, 32);
    table_cell(table, "%s", axis->name);
    table_cell(table, "%s s", t);
    table_cell(table, "%s", value);
    table_cell(table, "%s", limit);
    table_cell(
        table, "%s",
        number_unit(unit, job_rig_axis(job, violation->axis)->unit, order));
    const uint32_t line = job_line(axis, violation->key);
    if (axis->key_count > 0)
        table_cell(table, "%u", violation->key + 1);
    else
        table_cell(table, "-");
    if (line > 0)
        table_cell(table, "%u", line);
    else
        table_cell(table, "-");
    table_cell(table, "%s", job_violation_text(violation->kind));
}

/* A head that looks along a path whose curvature steps: no duration helps. */
static bool job_turns_in_steps(const struct job *job)
{
    const struct plan_camera *camera = job->move.camera;

    if (camera == NULL ||
        (camera->look != PLAN_LOOK_LEVEL &&
         camera->look != PLAN_LOOK_MINIMISING) ||
        plan_space_rules(job->move.path->points.curve).smooth >= 2)
        return false;
    for (uint32_t i = 0; i < job->violation_count; i++)
        if (job->violation[i].kind == JOB_VEL_STEP &&
            job->move.axis[job->violation[i].axis].driver == PLAN_BY_CAMERA)
            return true;
    return false;
}

static void job_print_advice(const struct job *job, FILE *file)
{
    job_fit_print(job, file);
    if (job_turns_in_steps(job))
        fputs("A head that looks along the path turns as the path bends, and "
              "where its curvature\nsteps so does the head's speed, however "
              "slow the move is.  The curves c2,\nquintic, b-spline and "
              "smoothed, and "
              "look: {ahead: ...}, have no such step.\n",
              file);
}

/* The worst of one kind on one axis. */
struct job_worst {
    uint32_t count, kept;
    uint32_t index[JOB_WORST];
};

#define JOB_KIND_ONE(name, order, text) +1
enum { JOB_KINDS = 0 JOB_VIOLATION_LIST(JOB_KIND_ONE) };

static struct job_worst *job_worst_of(const struct job *job,
                                      struct job_worst *worst, uint32_t index)
{
    const struct job_violation *violation = &job->violation[index];
    return &worst[violation->axis * JOB_KINDS + violation->kind];
}

/* Return how far it is beyond its limit. */
static uint64_t job_excess(const struct job_violation *violation)
{
    const bool low = violation->kind == JOB_POS_LOW;
    const bool falls =
        !low && violation->kind != JOB_POS_HIGH && violation->value < 0;
    const int64_t value = falls ? -(violation->value + 1) : violation->value;
    return low ? (uint64_t)violation->limit - (uint64_t)value
               : (uint64_t)value - (uint64_t)violation->limit;
}

static void job_worst_add(const struct job *job, struct job_worst *worst,
                          uint32_t index)
{
    struct job_worst *self = job_worst_of(job, worst, index);
    const uint64_t excess = job_excess(&job->violation[index]);
    uint32_t at = self->kept;
    self->count++;
    while (at > 0 && excess > job_excess(&job->violation[self->index[at - 1]]))
        at--;
    if (at == JOB_WORST)
        return;
    self->kept += self->kept < JOB_WORST ? 1 : 0;
    for (uint32_t i = self->kept - 1; i > at; i--)
        self->index[i] = self->index[i - 1];
    self->index[at] = index;
}

static bool job_worst_has(const struct job_worst *self, uint32_t index)
{
    for (uint32_t i = 0; i < self->kept; i++)
        if (self->index[i] == index)
            return true;
    return false;
}

static void job_print_rest(const struct job *job, const struct job_worst *worst,
                           FILE *file)
{
    for (unsigned i = 0; i < job->move.axis_count * JOB_KINDS; i++)
        if (worst[i].count > worst[i].kept)
            fprintf(file,
                    "%s: %s, the worst %u of %u; slew check --all lists "
                    "them all\n",
                    job->move.axis[i / JOB_KINDS].name,
                    job_violation_text(i % JOB_KINDS), worst[i].kept,
                    worst[i].count);
}

void job_print_violations(const struct job *job, bool all, FILE *file)
{
    static const char *const head[] = {
        "<axis", ">move time", ">value", ">limit",
        "<unit", ">key",       ">line",  "<what",
    };
    struct job_worst *worst =
        memory_new((size_t)job->move.axis_count * JOB_KINDS, sizeof *worst);
    struct table table;
    for (uint32_t i = 0; i < job->violation_count; i++)
        job_worst_add(job, worst, i);
    table_init(&table, 8, head);
    for (uint32_t i = 0; i < job->violation_count; i++)
        if (all || job_worst_has(job_worst_of(job, worst, i), i))
            job_print_violation(job, &table, &job->violation[i]);
    table_print(&table, file);
    table_free(&table);
    if (!all)
        job_print_rest(job, worst, file);
    memory_free(worst);
    job_print_advice(job, file);
}

static cJSON *job_json_violation(const struct job *job,
                                 const struct job_violation *violation)
{
    const struct plan_axis *axis = &job->move.axis[violation->axis];
    unsigned order = job_violation_order(violation->kind);
    char unit[NUMBER_UNIT_MAX];
    cJSON *item = cJSON_CreateObject();
    cJSON_AddStringToObject(item, "axis", axis->name);
    cJSON_AddStringToObject(item, "what", job_violation_text(violation->kind));
    cJSON_AddNumberToObject(item, "time_s",
                            number_double(violation->t_ns_q12, 12) / 1e9);
    cJSON_AddNumberToObject(item, "value", number_double(violation->value, 32));
    cJSON_AddNumberToObject(item, "limit", number_double(violation->limit, 32));
    cJSON_AddStringToObject(
        item, "unit",
        number_unit(unit, job_rig_axis(job, violation->axis)->unit, order));
    if (axis->key_count > 0)
        cJSON_AddNumberToObject(item, "key", violation->key + 1);
    if (job_line(axis, violation->key) > 0)
        cJSON_AddNumberToObject(item, "line", job_line(axis, violation->key));
    return item;
}

void job_json_violations(const struct job *job, struct cJSON *object)
{
    cJSON *list = cJSON_AddArrayToObject(object, "violations");
    for (uint32_t i = 0; i < job->violation_count; i++)
        cJSON_AddItemToArray(list, job_json_violation(job, &job->violation[i]));
    job_fit_json(job, object);
}

void job_json_hash(const struct job *job, struct cJSON *object)
{
    uint64_t hash = PLAN_HASH_START;

    for (unsigned i = 0; i < job->planned; i++)
        hash = plan_hash_add(hash, (int64_t)plan_track_hash(&job->track[i]));
    if (job->compiled == NULL)
        json_add_hash(object, "hash", hash);
}
