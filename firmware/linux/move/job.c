/* firmware/linux/move/job.c - see job.h. */
#include "firmware/linux/move/job.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/linux/base/memory.h"
#include "firmware/linux/base/number.h"
#include "firmware/linux/base/table.h"
#include "firmware/linux/move/compiled.h"
#include "firmware/linux/move/job_goals.h"
#include "motion/clock_warp.h"
#include "motion/err.h"
#include "motion/fixed.h"

static const struct {
    unsigned order;
    const char *text;
} job_kind[] = {
#define JOB_VIOLATION_ROW(name, order, text) { order, text },
    JOB_VIOLATION_LIST(JOB_VIOLATION_ROW)
#undef JOB_VIOLATION_ROW
};

const char *job_violation_text(enum job_violation_kind kind)
{
    return job_kind[kind].text;
}

unsigned job_violation_order(enum job_violation_kind kind)
{
    return job_kind[kind].order;
}

unsigned job_bits_of(unsigned order)
{
    return order < 2 ? 32 : 16;
}

int64_t job_limit_of(const struct plan_limit *limit, unsigned order)
{
    return order == 1   ? limit->vel_q32
           : order == 2 ? limit->acc_q16
                        : limit->jerk_q16;
}

const struct rig_axis *job_rig_axis(const struct job *job, unsigned axis)
{
    return &job->rig.axis[job->rig_axis[axis]];
}

bool job_goes_by_itself(const struct job *job, unsigned axis)
{
    return job_rig_axis(job, axis)->point_to_point;
}

uint32_t job_line(const struct plan_axis *axis, uint32_t key)
{
    return axis->key_count > 0 ? axis->key[key].place.line : axis->place.line;
}

int job_axis_index(const struct job *job, const char *name)
{
    for (unsigned i = 0; i < job->move.axis_count; i++)
        if (strcmp(job->move.axis[i].name, name) == 0)
            return (int)i;
    return -1;
}

int64_t job_peak(const struct motion_track *track,
                 enum motion_quantity quantity, int64_t *t_ns_q12)
{
    struct motion_extreme extreme;
    motion_track_extreme(track, quantity, &extreme);
    bool low = motion_fixed_abs(extreme.min) > motion_fixed_abs(extreme.max);
    if (t_ns_q12 != NULL)
        *t_ns_q12 = low ? extreme.min_ns_q12 : extreme.max_ns_q12;
    uint64_t peak = motion_fixed_abs(low ? extreme.min : extreme.max);
    return peak > INT64_MAX ? INT64_MAX : (int64_t)peak;
}

static bool job_is_directory(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

enum status job_fail(const char *path, const char *what)
{
    fprintf(stderr, "%s: %s\n", path, what);
    return STATUS_INPUT;
}

static enum status job_paths(struct job *job, const char *const path[],
                             int count)
{
    const char *first = path[0];
    bool directory = job_is_directory(first);
    if (count == 2 && directory)
        return job_fail(first, "is a directory, expected a rig file");
    if (access(first, F_OK) < 0)
        return job_fail(first, strerror(errno));
    if (count == 1 && !directory)
        return job_fail(first, "expected a rig and a move file, or one "
                               "directory with rig.yaml and move.yaml");
    const char *second = directory ? first : path[1];
    int rig = snprintf(job->rig_path, sizeof job->rig_path, "%s%s", first,
                       directory ? "/rig.yaml" : "");
    int move = snprintf(job->move_path, sizeof job->move_path, "%s%s", second,
                        directory ? "/move.yaml" : "");
    if (rig >= (int)sizeof job->rig_path || move >= (int)sizeof job->move_path)
        return job_fail(first, "the name is too long");
    return STATUS_OK;
}

enum status job_read_rig(const char *path, struct rig *rig)
{
    char whole[sizeof((struct job *)0)->rig_path], message[RIG_MESSAGE_MAX];
    const bool directory = job_is_directory(path);
    if (access(path, F_OK) < 0)
        return job_fail(path, strerror(errno));
    if (snprintf(whole, sizeof whole, "%s%s", path,
                 directory ? "/rig.yaml" : "") >= (int)sizeof whole)
        return job_fail(path, "the name is too long");
    if (rig_load(whole, rig, message) == 0)
        return STATUS_OK;
    fprintf(stderr, "%s\n", message);
    return STATUS_INPUT;
}

/* "file:line:column: key 3 of axis pan: what is wrong"; a sentence of a planner
 * says itself what it is about. */
static enum status job_plan_fail(const struct job *job,
                                 const struct plan_error *error)
{
    fprintf(stderr, "%s:%u:%u: %s\n", job->move_path, error->place.line,
            error->place.column,
            error->text[0] != 0 ? error->text : motion_err_text(error->code));
    return STATUS_INPUT;
}

/* What is right but hardly wanted. */
static void job_remark(const struct job *job, const struct plan_axis *axis,
                       const struct motion_track *track)
{
    char text[160];

    if (plan_axis_remark(axis, track, text))
        fprintf(stderr, "%s:%u:%u: warning: %s\n", job->move_path,
                axis->place.line, axis->place.column, text);
}

static enum status job_find_axes(struct job *job)
{
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        int found = rig_axis_index(&job->rig, job->move.axis[i].name);
        if (found < 0)
            return job_fail(job->move_path, "names an axis the rig lacks");
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

static enum status job_plan(struct job *job)
{
    struct plan_error error = { .code = MOTION_OK };
    enum status status = job_find_axes(job);
    if (status == STATUS_OK)
        status = job_goals_ask(job);
    if (status != STATUS_OK)
        return status;
    if (plan_compose(&job->move, job->track, &job->outcome, &error) < 0)
        return job_plan_fail(job, &error);
    job->planned = job->move.axis_count;
    for (unsigned i = 0; i < job->planned; i++) {
        job_remark(job, &job->move.axis[i], &job->track[i]);
        if (job->track[i].end_ns_q12 > job->end_ns_q12)
            job->end_ns_q12 = job->track[i].end_ns_q12;
    }
    job_goals_make(job);
    return job_plan_events(job);
}

/* An axis of a compiled move must be one of the rig, in the same unit. */
static enum status job_take_axis(struct job *job, unsigned i)
{
    const struct track_file_axis *axis = &job->compiled->file.axis[i];
    const int found = rig_axis_index(&job->rig, axis->name);
    char what[128];
    if (found < 0) {
        snprintf(what, sizeof what, "moves axis %s, which the rig lacks",
                 axis->name);
        return job_fail(job->move_path, what);
    }
    if (job->rig.axis[found].point_to_point) {
        snprintf(what, sizeof what,
                 "moves axis %s, whose drive goes from key to key by itself, "
                 "expected the move file, which has keys",
                 axis->name);
        return job_fail(job->move_path, what);
    }
    const char *unit = units_axis_text(job->rig.axis[found].unit);
    if (strcmp(unit, axis->unit) != 0) {
        snprintf(what, sizeof what,
                 "axis %s is in %s, expected %s as in the rig", axis->name,
                 axis->unit, unit);
        return job_fail(job->move_path, what);
    }
    job->rig_axis[i] = (unsigned)found;
    memcpy(job->move.axis[i].name, axis->name, sizeof axis->name);
    if (axis->end_ns_q12 > job->end_ns_q12)
        job->end_ns_q12 = axis->end_ns_q12;
    return STATUS_OK;
}

static enum status job_open_compiled(struct job *job)
{
    char message[TRACK_FILE_MESSAGE_MAX];
    enum status status = STATUS_OK;
    job->compiled = compiled_open(job->move_path, job->track, message);
    if (job->compiled == NULL)
        return job_fail(job->move_path, message);
    memcpy(job->move.title, job->compiled->file.title, sizeof job->move.title);
    job->move.axis_count = job->compiled->file.axis_count;
    for (unsigned i = 0; status == STATUS_OK && i < job->move.axis_count; i++)
        status = job_take_axis(job, i);
    return status;
}

static enum status job_open_move(struct job *job)
{
    char message[RIG_MESSAGE_MAX];
    if (move_load(job->move_path, &job->rig, &job->move, message) < 0) {
        fprintf(stderr, "%s\n", message);
        return STATUS_INPUT;
    }
    return job_plan(job);
}

enum status job_open_any(struct job *job, const char *const path[], int count)
{
    char message[RIG_MESSAGE_MAX];
    memset(job, 0, sizeof *job);
    enum status status = job_paths(job, path, count);
    if (status != STATUS_OK)
        return status;
    if (rig_load(job->rig_path, &job->rig, message) < 0) {
        fprintf(stderr, "%s\n", message);
        return STATUS_INPUT;
    }
    return track_file_is(job->move_path) ? job_open_compiled(job)
                                         : job_open_move(job);
}

enum status job_open(struct job *job, const char *const path[], int count)
{
    enum status status = job_open_any(job, path, count);
    if (status == STATUS_OK && job->compiled != NULL)
        return job_fail(job->move_path, "is a compiled move, expected the move "
                                        "file itself (compiled ones are for "
                                        "run, sample, check and plot)");
    return status;
}

void job_free(struct job *job)
{
    for (unsigned i = 0; i < job->planned; i++)
        plan_track_free(&job->track[i]);
    for (unsigned i = 0; i < PLAN_AXES_MAX; i++)
        memory_free(job->goal[i]);
    plan_outcome_free(&job->outcome);
    for (unsigned i = 0; i < RIG_LINES_MAX; i++)
        plan_shots_free(&job->shots[i]);
    compiled_close(job->compiled);
    move_free(&job->move);
    memory_free(job->violation);
    memset(job, 0, sizeof *job);
}

/* value / rate, saturating. */
static int64_t job_over_rate(int64_t value, int64_t rate_q30)
{
    int64_t result;
    if (motion_fixed_muldiv(value, MOTION_CLOCK_WARP_ONE_Q30, rate_q30,
                            &result) < 0)
        return INT64_MAX;
    return result;
}

void job_limit_at(const struct plan_limit *limit, int64_t rate_q30,
                  struct plan_limit *scaled)
{
    *scaled = *limit;
    if (rate_q30 == MOTION_CLOCK_WARP_ONE_Q30 || rate_q30 <= 0)
        return;
    scaled->vel_q32 = job_over_rate(limit->vel_q32, rate_q30);
    scaled->acc_q16 =
        job_over_rate(job_over_rate(limit->acc_q16, rate_q30), rate_q30);
    scaled->jerk_q16 = job_over_rate(
        job_over_rate(job_over_rate(limit->jerk_q16, rate_q30), rate_q30),
        rate_q30);
}

/* The key at or before a time. */
static uint32_t job_key_before(const struct plan_axis *axis, int64_t t_ns_q12)
{
    uint32_t low = 0, high = axis->key_count;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (axis->key[middle].key.t_ns_q12 <= t_ns_q12)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static void job_add(struct job *job, const struct job_violation *violation)
{
    /* Room grows at powers of two. */
    uint32_t count = job->violation_count;
    if ((count & (count - 1)) == 0)
        job->violation =
            memory_resize(job->violation, count == 0 ? 1 : 2 * (size_t)count,
                          sizeof *job->violation);
    job->violation[job->violation_count++] = *violation;
}

/* A step of velocity at the first or last key has its own sentence. */
static enum job_violation_kind job_kind_of(const struct job *job,
                                           const struct plan_axis *axis,
                                           const struct motion_track *track,
                                           const struct plan_violation *found)
{
    const bool keyed = axis->key_count > 0 && !job->outcome.is_bent;
    const int64_t first = keyed ? axis->key[0].key.t_ns_q12 : 0;
    const int64_t last =
        keyed ? axis->key[axis->key_count - 1].key.t_ns_q12 : track->end_ns_q12;
    if (found->kind != PLAN_VEL_STEP)
        return (enum job_violation_kind)found->kind;
    if (found->t_ns_q12 <= (first > 0 ? first : 0))
        return JOB_START_MOVING;
    return found->t_ns_q12 >= last ? JOB_END_MOVING : JOB_VEL_STEP;
}

static uint32_t job_find(const struct job *job, unsigned i,
                         const struct plan_limit *limit,
                         struct plan_violation *found, uint32_t room)
{
    if (job->compiled != NULL)
        return compiled_check(job->compiled, i, limit, found, room);
    return plan_check_track(&job->track[i], limit, found, room);
}

static void job_check_axis(struct job *job, unsigned i, int64_t rate_q30)
{
    const struct plan_axis *axis = &job->move.axis[i];
    struct plan_limit limit;
    job_limit_at(&job_rig_axis(job, i)->limit, rate_q30, &limit);
    uint32_t count = job_find(job, i, &limit, NULL, 0);
    if (count == 0)
        return;
    struct plan_violation *found = memory_new(count, sizeof *found);
    job_find(job, i, &limit, found, count);
    for (uint32_t k = 0; k < count; k++)
        job_add(job, &(struct job_violation){
                         .axis = i,
                         .kind = job_kind_of(job, &job->move.axis[i],
                                             &job->track[i], &found[k]),
                         .t_ns_q12 = found[k].t_ns_q12,
                         .value = found[k].value,
                         .limit = found[k].limit,
                         .key = job_key_before(
                             axis, plan_outcome_time(&job->outcome,
                                                     found[k].t_ns_q12)),
                     });
    memory_free(found);
}

void job_check(struct job *job, int64_t rate_q30)
{
    if (rate_q30 < MOTION_CLOCK_WARP_ONE_Q30)
        rate_q30 = MOTION_CLOCK_WARP_ONE_Q30;
    job->violation_count = 0;
    for (unsigned i = 0; i < job->move.axis_count; i++)
        job_check_axis(job, i, rate_q30);
}

static void job_print_violation(const struct job *job, struct table *table,
                                const struct job_violation *violation)
{
    const struct plan_axis *axis = &job->move.axis[violation->axis];
    unsigned order = job_violation_order(violation->kind);
    unsigned bits = job_bits_of(order);
    char value[NUMBER_MAX], limit[NUMBER_MAX], t[NUMBER_MAX];
    char unit[NUMBER_UNIT_MAX];
    number_seconds(t, violation->t_ns_q12);
    number_short(value, violation->value, bits);
    number_short(limit, violation->limit, bits);
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

void job_print_violations(const struct job *job, FILE *file)
{
    static const char *const head[] = {
        "<axis", ">time", ">value", ">limit", "<unit", ">key", ">line", "<what",
    };
    struct table table;
    table_init(&table, 8, head);
    for (uint32_t i = 0; i < job->violation_count; i++)
        job_print_violation(job, &table, &job->violation[i]);
    table_print(&table, file);
    table_free(&table);
}

static cJSON *job_json_violation(const struct job *job,
                                 const struct job_violation *violation)
{
    const struct plan_axis *axis = &job->move.axis[violation->axis];
    unsigned order = job_violation_order(violation->kind);
    unsigned bits = job_bits_of(order);
    char unit[NUMBER_UNIT_MAX];
    cJSON *item = cJSON_CreateObject();
    cJSON_AddStringToObject(item, "axis", axis->name);
    cJSON_AddStringToObject(item, "what", job_violation_text(violation->kind));
    cJSON_AddNumberToObject(item, "time_s",
                            number_double(violation->t_ns_q12, 12) / 1e9);
    cJSON_AddNumberToObject(item, "value",
                            number_double(violation->value, bits));
    cJSON_AddNumberToObject(item, "limit",
                            number_double(violation->limit, bits));
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
}
