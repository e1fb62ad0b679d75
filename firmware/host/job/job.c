/* firmware/host/job/job.c - see job.h. */
#include "firmware/host/job/job.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/job_open.h"
#include "firmware/host/track/compiled.h"
#include "firmware/host/yaml/yaml_again.h"
#include "motion/core/fixed.h"
#include "motion/plan/plan_track.h"
#include "motion/plan/shoot/plan_shoot.h"

int64_t job_limit_of(const struct plan_limit *limit, unsigned order)
{
    return order == 1   ? limit->vel_q32
           : order == 2 ? limit->acc_q32
                        : limit->jerk_q32;
}

const struct rig_axis *job_rig_axis(const struct job *job, unsigned axis)
{
    return &job->rig.axis[job->rig_axis[axis]];
}

bool job_runs_by_drive_profile(const struct job *job, unsigned axis)
{
    return job_rig_axis(job, axis)->point_to_point;
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
    plan_track_extreme(track, quantity, &extreme);
    bool low = motion_fixed_abs(extreme.min) > motion_fixed_abs(extreme.max);
    if (t_ns_q12 != NULL)
        *t_ns_q12 = low ? extreme.min_ns_q12 : extreme.max_ns_q12;
    uint64_t peak = motion_fixed_abs(low ? extreme.min : extreme.max);
    return peak > INT64_MAX ? INT64_MAX : (int64_t)peak;
}

enum status job_fail(struct job *job, const char *what)
{
    messages_add(&job->messages, MESSAGE_ERROR, "%s: %s", job->move_path, what);
    return STATUS_INPUT;
}

static bool job_warns(const struct rig_axis *axis, enum rig_warning warning)
{
    return (axis->acknowledged >> warning & 1) == 0;
}

/* A drive that may go on when nobody is heard is said before anything moves. */
static void job_say_unsupervised(const char *path, const struct rig *rig,
                                 struct messages *messages)
{
    for (uint32_t i = 0; i < rig->axis_count; i++) {
        const struct rig_axis *axis = &rig->axis[i];
        const struct rig_kind *kind = rig_kinds[axis->kind];
        const char *what =
            kind->unsupervised ? kind->unsupervised(rig, axis) : NULL;
        if (what != NULL && job_warns(axis, RIG_WARNING_UNSUPERVISED))
            messages_add(messages, MESSAGE_WARNING,
                         "%s: %s is unsupervised: %s [unsupervised]", path,
                         axis->name, what);
    }
}

/* A register map that is partly a guess is said, too. */
static void job_say_unverified(const char *path, const struct rig *rig,
                               struct messages *messages)
{
    for (uint32_t i = 0; i < rig->axis_count; i++)
        if (rig_kinds[rig->axis[i].kind]->has_map &&
            rig->map[rig->axis[i].map].is_unverified &&
            job_warns(&rig->axis[i], RIG_WARNING_MAP))
            messages_add(messages, MESSAGE_WARNING,
                         "%s: %s: the register map of \"%s\" is unverified: "
                         "not all of it was compared with the maker's manual; "
                         "read what its file says, and try it without a load "
                         "first [map]",
                         path, rig->axis[i].name,
                         rig->map[rig->axis[i].map].title);
}

/* So is what of a data sheet could not be read and was not needed. */
static void job_say_odd(const char *path, const struct rig *rig,
                        struct messages *messages)
{
    for (uint32_t i = 0; i < rig->axis_count; i++) {
        const struct rig_axis *axis = &rig->axis[i];
        if (axis->eds_odd > 0 && job_warns(axis, RIG_WARNING_EDS))
            messages_add(
                messages, MESSAGE_WARNING,
                "%s: %s: %s:%u: %u %s of the data sheet cannot be read "
                "and %s not used; slew drive info %s lists %s [eds]",
                path, axis->name, axis->eds, axis->eds_odd_line, axis->eds_odd,
                number_word(axis->eds_odd, "line", "lines"),
                number_word(axis->eds_odd, "is", "are"), axis->eds,
                number_word(axis->eds_odd, "it", "them"));
    }
}

struct job_saying {
    const char *path;
    struct messages *messages;
};

static void job_say_doubt(void *context, struct plan_place place,
                          const char *text)
{
    const struct job_saying *saying = context;

    messages_add(saying->messages, MESSAGE_WARNING, "%s:%u:%u: warning: %s",
                 saying->path, place.line, place.column, text);
}

static void job_say_rig(const char *path, const struct rig *rig,
                        struct messages *messages)
{
    struct job_saying saying = { path, messages };

    job_say_unsupervised(path, rig, messages);
    job_say_unverified(path, rig, messages);
    job_say_odd(path, rig, messages);
    rig_plausible(rig, job_say_doubt, &saying);
}

void job_json_warnings(const struct job *job, struct cJSON *object)
{
    cJSON *list = cJSON_AddArrayToObject(object, "warnings");
    struct messages messages = { .text = NULL };
    enum message_kind kind;
    const char *text;

    job_say_rig(job->rig_path, &job->rig, &messages);
    for (size_t at = 0; (text = messages_next(&messages, &at, &kind)) != NULL;)
        cJSON_AddItemToArray(list, cJSON_CreateString(text));
    messages_free(&messages);
}

enum status job_read_rig(const struct files *files, const char *path,
                         struct rig *rig, struct messages *messages)
{
    char message[YAML_MESSAGE_MAX];
    if (rig_load(files, path, rig, message) < 0) {
        messages_add(messages, MESSAGE_ERROR, "%s", message);
        return STATUS_INPUT;
    }
    job_say_rig(path, rig, messages);
    return STATUS_OK;
}

const char *job_sampled(const struct job *job)
{
    for (unsigned i = 0; i < job->move.axis_count; i++)
        if (rig_kinds[job_rig_axis(job, i)->kind]->samples)
            return job->move.axis[i].name;
    return NULL;
}

void job_capacity(struct job *job, uint32_t axes)
{
#define CAPACITY(array, count)                                                 \
    job->array = memory_pool_new(&job->memory, count, sizeof *job->array)
    CAPACITY(rig_axis, axes);
    CAPACITY(track, axes);
    CAPACITY(goal_count, axes);
#undef CAPACITY
    job->goal =
        memory_pool_new(&job->memory, axes, sizeof(struct controller_goal *));
}

static enum status job_open_move(struct job *job, const struct files *files)
{
    char message[YAML_MESSAGE_MAX];
    const int err =
        job->keeps
            ? move_load_again(
                  files, job->move_path, &job->rig, &job->move, job->text,
                  job->former != NULL ? job->former->text : NULL, message)
            : move_load(files, job->move_path, &job->rig, &job->move, message);

    if (err < 0) {
        messages_add(&job->messages, MESSAGE_ERROR, "%s", message);
        return STATUS_INPUT;
    }
    job_capacity(job, job->move.axis_count);
    return job_plan(job);
}

static enum status job_open_rig(struct job *job, const struct files *files,
                                const struct rig *rig)
{
    if (rig == NULL)
        return job_read_rig(files, job->rig_path, &job->rig, &job->messages);
    job->rig = *rig;
    job->is_rig_lent = true;
    job_say_rig(job->rig_path, rig, &job->messages);
    return STATUS_OK;
}

/* A board is given whole tracks, and begins when it has what it needs. */
static enum status job_check_sampled(struct job *job)
{
    const char *name = job_sampled(job);
    char what[2 * PLAN_NAME_MAX + 160];
    bool has_events = job->move.shoot != NULL && job->move.shoot->steps;
    for (unsigned i = 0; i < job->rig.line_count; i++)
        has_events = has_events || job->shots[i].count > 0;
    if (name == NULL || (job->compiled == NULL && !has_events))
        return STATUS_OK;
    snprintf(what, sizeof what,
             job->compiled != NULL
                 ? "is a compiled move, and %s is sampled by a board, which is "
                   "given whole tracks, expected the move file itself"
                 : "has events or waits for frames, and %s is sampled by a "
                   "board, which begins when it has been loaded and is not "
                   "held, expected a move without them",
             name);
    return job_fail(job, what);
}

static enum status job_open_zeroed(struct job *job, const struct files *files,
                                   const char *rig_path, const char *move_path,
                                   bool any, const struct rig *rig)
{
    snprintf(job->rig_path, sizeof job->rig_path, "%s", rig_path);
    snprintf(job->move_path, sizeof job->move_path, "%s", move_path);
    enum status status = job_open_rig(job, files, rig);
    if (status != STATUS_OK)
        return status;
    job->shots =
        memory_pool_new(&job->memory, job->rig.line_count, sizeof *job->shots);
    status = track_file_is(files, move_path) ? job_open_compiled(job, files)
                                             : job_open_move(job, files);
    if (status == STATUS_OK)
        status = job_check_sampled(job);
    if (status == STATUS_OK && job->compiled != NULL && !any)
        return job_fail(job, "is a compiled move, expected the move "
                             "file itself (compiled ones are for "
                             "run, sample, check and plot)");
    return status;
}

enum status job_open(struct job *job, const struct files *files,
                     const char *rig_path, const char *move_path, bool any,
                     const struct plan_progress *progress)
{
    memset(job, 0, sizeof *job);
    job->progress = progress;
    return job_open_zeroed(job, files, rig_path, move_path, any, NULL);
}

enum status job_open_on(struct job *job, const struct files *files,
                        const struct rig *rig, const char *rig_path,
                        const char *move_path,
                        const struct plan_progress *progress)
{
    memset(job, 0, sizeof *job);
    job->progress = progress;
    return job_open_zeroed(job, files, rig_path, move_path, false, rig);
}

enum status job_open_again(struct job *job, const struct files *files,
                           const char *rig_path, const char *move_path,
                           const struct job *former, const struct rig *rig)
{
    memset(job, 0, sizeof *job);
    job->keeps = true;
    job->former = former;
    job->memo = memory_new(1, sizeof *job->memo);
    job->text = memory_new(1, sizeof *job->text);
    return job_open_zeroed(job, files, rig_path, move_path, false, rig);
}

void job_summarise(struct job *job)
{
    struct motion_track_summary *summary =
        memory_pool_new(&job->memory, job->planned, sizeof *summary);
    for (unsigned i = 0; i < job->planned; i++)
        motion_track_summarise(&job->track[i], &summary[i]);
}

void job_copy_track(const struct motion_track *track, struct motion_track *copy)
{
    *copy = *track;
    copy->capacity = track->count;
    copy->summary = NULL;
    copy->segment =
        memory_resize(NULL, (size_t)track->count + 1, sizeof *copy->segment);
    memcpy(copy->segment, track->segment, track->count * sizeof *copy->segment);
}

void job_free(struct job *job)
{
    for (unsigned i = 0; i < job->planned; i++)
        plan_track_free(&job->track[i]);
    for (unsigned i = 0; job->plain != NULL && i < job->planned; i++)
        plan_track_free(&job->plain[i]);
    for (unsigned i = 0; job->facts != NULL && i < job->planned; i++)
        job_facts_free(&job->facts[i]);
    memory_free(job->facts);
    if (job->text != NULL)
        yaml_again_free(job->text);
    memory_free(job->text);
    if (job->memo != NULL)
        plan_memo_free(job->memo);
    memory_free(job->memo);
    plan_outcome_free(&job->outcome);
    for (unsigned i = 0; job->shots != NULL && i < job->rig.line_count; i++)
        plan_shots_free(&job->shots[i]);
    compiled_close(job->compiled);
    move_free(&job->move);
    memory_free(job->violation);
    if (!job->is_rig_lent)
        rig_free(&job->rig);
    memory_pool_free(&job->memory);
    messages_free(&job->messages);
    memset(job, 0, sizeof *job);
}
