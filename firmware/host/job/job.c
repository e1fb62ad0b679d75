/* firmware/host/job/job.c - see job.h. */
#include "firmware/host/job/job.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/job/job_fit.h"
#include "firmware/host/job/job_goals.h"
#include "firmware/host/job/job_shape.h"
#include "firmware/host/track/compiled.h"
#include "firmware/host/yaml/yaml_again.h"
#include "motion/core/clock_warp.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/camera/plan_camera.h"
#include "motion/plan/plan_bound.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"
#include "motion/plan/shoot/plan_shoot.h"

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

/* Line in the move's file of a key, or of what drives an axis without keys. */
static uint32_t job_line(const struct plan_axis *axis, uint32_t key)
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
    plan_track_extreme(track, quantity, &extreme);
    bool low = motion_fixed_abs(extreme.min) > motion_fixed_abs(extreme.max);
    if (t_ns_q12 != NULL)
        *t_ns_q12 = low ? extreme.min_ns_q12 : extreme.max_ns_q12;
    uint64_t peak = motion_fixed_abs(low ? extreme.min : extreme.max);
    return peak > INT64_MAX ? INT64_MAX : (int64_t)peak;
}

static enum status job_fail(struct job *job, const char *what)
{
    messages_add(&job->messages, MESSAGE_ERROR, "%s: %s", job->move_path, what);
    return STATUS_INPUT;
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
        if (what != NULL)
            messages_add(messages, MESSAGE_WARNING,
                         "%s: %s is unsupervised: %s", path, axis->name, what);
    }
}

/* A register map that is partly a guess is said, too. */
static void job_say_unverified(const char *path, const struct rig *rig,
                               struct messages *messages)
{
    for (uint32_t i = 0; i < rig->axis_count; i++)
        if (rig_kinds[rig->axis[i].kind]->has_map &&
            rig->map[rig->axis[i].map].is_unverified)
            messages_add(messages, MESSAGE_WARNING,
                         "%s: %s: the register map of \"%s\" is unverified: "
                         "not all of it was compared with the maker's manual; "
                         "read what its file says, and try it without a load "
                         "first",
                         path, rig->axis[i].name,
                         rig->map[rig->axis[i].map].title);
}

static void job_say_rig(const char *path, const struct rig *rig,
                        struct messages *messages)
{
    job_say_unsupervised(path, rig, messages);
    job_say_unverified(path, rig, messages);
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

const char *job_sampled(const struct job *job)
{
    for (unsigned i = 0; i < job->move.axis_count; i++)
        if (rig_kinds[job_rig_axis(job, i)->kind]->samples)
            return job->move.axis[i].name;
    return NULL;
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

static enum status job_plan_events(struct job *job)
{
    struct plan_error error = { .code = MOTION_OK };
    for (uint32_t i = 0; i < job->rig.line_count; i++)
        if (plan_shots_make(&job->move, job->track, &job->outcome, i,
                            &job->shots[i], &error) < 0)
            return job_plan_fail(job, &error);
    return job_check_sampled(job);
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

static enum status job_plan(struct job *job)
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
    status = job_plan_events(job);
    return status == STATUS_OK ? job_plan_steps(job) : status;
}

/* An axis of a compiled move must be one of the rig, in the same unit. */
static enum status job_take_axis(struct job *job, unsigned i)
{
    const struct track_file_axis *axis = &job->compiled->file.axis[i];
    const int found = rig_axis_index(&job->rig, axis->name);
    char what[160];
    if (found < 0) {
        snprintf(what, sizeof what, "moves axis %s, which the rig lacks",
                 axis->name);
        return job_fail(job, what);
    }
    if (job->rig.axis[found].point_to_point) {
        snprintf(what, sizeof what,
                 "moves axis %s, whose drive goes from key to key by its own "
                 "profile, "
                 "expected the move file, which has keys",
                 axis->name);
        return job_fail(job, what);
    }
    const char *unit = units_axis_text(job->rig.axis[found].unit);
    if (strcmp(unit, axis->unit) != 0) {
        snprintf(what, sizeof what,
                 "axis %s is in %s, expected %s as in the rig", axis->name,
                 axis->unit, unit);
        return job_fail(job, what);
    }
    job->rig_axis[i] = (unsigned)found;
    memcpy(job->move.axis[i].name, axis->name, sizeof axis->name);
    if (axis->end_ns_q12 > job->end_ns_q12)
        job->end_ns_q12 = axis->end_ns_q12;
    return STATUS_OK;
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

static int job_find_line(const struct job *job, const char *name,
                         enum rig_line_kind kind)
{
    for (uint32_t i = 0; i < job->rig.line_count; i++)
        if (job->rig.line[i].kind == kind &&
            strcmp(job->rig.line[i].name, name) == 0)
            return (int)i;
    return -1;
}

/* What a line is triggered at, by the line of the rig of the same name. */
static enum status job_take_line(struct job *job, unsigned i)
{
    const struct track_file *file = &job->compiled->file;
    const int found = job_find_line(job, file->line[i].name, RIG_LINE_TRIGGER);
    char message[TRACK_FILE_MESSAGE_MAX];
    if (found < 0) {
        snprintf(message, sizeof message,
                 "triggers %s, expected a gpio line of kind trigger of that "
                 "name in the rig",
                 file->line[i].name);
        return job_fail(job, message);
    }
    struct plan_shots *shots = &job->shots[found];
    shots->t_ns_q12 = malloc(file->line[i].count * sizeof *shots->t_ns_q12);
    if (shots->t_ns_q12 == NULL)
        memory_fail();
    shots->count = file->line[i].count;
    return track_file_shots(file, i, shots->t_ns_q12, message) < 0
               ? job_fail(job, message)
               : STATUS_OK;
}

static enum status job_take_step(struct job *job)
{
    const struct track_file_step *step = &job->compiled->file.step;
    char message[TRACK_FILE_MESSAGE_MAX];
    job->steps = (struct frame_step_config){ step->first_ns_q12,
                                             step->period_ns_q12, step->count };
    if (step->count == 0 || step->line[0] == 0)
        return STATUS_OK;
    const int found = job_find_line(job, step->line, RIG_LINE_START);
    if (found >= 0) {
        job->step_line = &job->rig.line[found];
        return STATUS_OK;
    }
    snprintf(message, sizeof message,
             "waits for %s, expected a gpio line of kind start of that name in "
             "the rig",
             step->line);
    return job_fail(job, message);
}

static enum status job_open_compiled(struct job *job, const struct files *files)
{
    char message[TRACK_FILE_MESSAGE_MAX];
    enum status status = STATUS_OK;
    job->compiled = compiled_open(files, job->move_path, message);
    if (job->compiled == NULL)
        return job_fail(job, message);
    memcpy(job->move.title, job->compiled->file.title, sizeof job->move.title);
    if (plan_move_reserve(&job->move, job->compiled->file.axis_count) < 0)
        memory_fail();
    job->move.axis_count = job->compiled->file.axis_count;
    job_capacity(job, job->move.axis_count);
    job->track = job->compiled->track;
    for (unsigned i = 0; status == STATUS_OK && i < job->move.axis_count; i++)
        status = job_take_axis(job, i);
    for (unsigned i = 0;
         status == STATUS_OK && i < job->compiled->file.line_count; i++)
        status = job_take_line(job, i);
    if (status == STATUS_OK)
        status = job_take_step(job);
    return status == STATUS_OK ? job_check_sampled(job) : status;
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
    if (!track_file_is(files, move_path))
        return job_open_move(job, files);
    status = job_open_compiled(job, files);
    if (status == STATUS_OK && !any)
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

/* What names the axes of a move, and no more. */
static void job_name_axes(struct job *job, const struct plan_move *move)
{
    if (plan_move_reserve(&job->move, move->axis_count) < 0)
        memory_fail();
    job->move.axis_count = move->axis_count;
    for (uint32_t i = 0; i < move->axis_count; i++)
        memcpy(job->move.axis[i].name, move->axis[i].name,
               sizeof move->axis[i].name);
}

void job_copy_track(const struct motion_track *track, struct motion_track *copy)
{
    *copy = *track;
    copy->capacity = track->count;
    copy->segment =
        memory_resize(NULL, (size_t)track->count + 1, sizeof *copy->segment);
    memcpy(copy->segment, track->segment, track->count * sizeof *copy->segment);
}

void job_part_with(struct job *job, struct job *former)
{
    memset(former, 0, sizeof *former);
    former->is_rig_lent = true;
    former->memo = job->memo;
    former->facts = job->facts;
    former->text = job->text;
    former->planned = job->planned;
    job_name_axes(former, &job->move);
    job_capacity(former, job->move.axis_count);
    for (unsigned i = 0; i < job->planned; i++)
        job_copy_track(&job->track[i], &former->track[i]);
    job->keeps = false;
    job->memo = NULL;
    job->facts = NULL;
    job->text = NULL;
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
    scaled->acc_q32 =
        job_over_rate(job_over_rate(limit->acc_q32, rate_q30), rate_q30);
    scaled->jerk_q32 = job_over_rate(
        job_over_rate(job_over_rate(limit->jerk_q32, rate_q30), rate_q30),
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

/* It goes on after its last key. */
static bool job_cycles(const struct plan_axis *axis)
{
    return axis->key_count > 0 && axis->bezier.after.mode != MOTION_FCURVE_ONCE;
}

/* A step of velocity at the first or last key has its own sentence; one where a
 * cycle goes over to the next is a step. */
static enum job_violation_kind job_kind_of(const struct job *job,
                                           const struct plan_axis *axis,
                                           const struct motion_track *track,
                                           const struct plan_violation *found)
{
    const bool keyed = axis->key_count > 0 && !job->outcome.is_bent;
    const int64_t lag = job->outcome.lag_ns_q12;
    const int64_t first = keyed ? axis->key[0].key.t_ns_q12 + lag : 0;
    const int64_t last = keyed && !job_cycles(axis)
                             ? axis->key[axis->key_count - 1].key.t_ns_q12 + lag
                             : track->end_ns_q12;
    if (found->kind != PLAN_VEL_STEP)
        return (enum job_violation_kind)found->kind;
    if (found->t_ns_q12 <= (first > 0 ? first : 0))
        return JOB_START_MOVING;
    return found->t_ns_q12 >= last ? JOB_END_MOVING : JOB_VEL_STEP;
}

#define JOB_TELL_EVERY 1024 /* segments: some 10 ms */

/* The segments of an axis, one after the other, and how many there were. */
struct job_walk {
    const struct job *job;
    const struct plan_progress *progress;
    unsigned axis;
    uint32_t next, count;
    struct compiled_walk compiled;
};

static const struct motion_segment *job_walk_next(void *context)
{
    struct job_walk *walk = context;
    const struct job *job = walk->job;
    const uint32_t i = walk->next++;
    if (i % JOB_TELL_EVERY == 0)
        plan_progress_tell(walk->progress, "judging",
                           job->move.axis[walk->axis].name, i, walk->count);
    if (job->compiled != NULL)
        return compiled_walk_next(&walk->compiled);
    return i < walk->count ? &job->track[walk->axis].segment[i] : NULL;
}

static struct plan_facts *job_walk_facts(void *context)
{
    const struct job_walk *walk = context;
    return walk->job->facts[walk->axis].segment[walk->next - 1].facts;
}

static bool *job_walk_is_inside(void *context)
{
    const struct job_walk *walk = context;
    return &walk->job->facts[walk->axis].segment[walk->next - 1].is_inside;
}

static uint32_t job_find(const struct job *job, unsigned i,
                         const struct plan_limit *limit,
                         struct plan_violation *found, uint32_t capacity,
                         const struct plan_progress *progress)
{
    struct job_walk walk = {
        .job = job,
        .progress = progress,
        .axis = i,
        .count = job->compiled != NULL ? job->compiled->file.axis[i].segments
                                       : job->track[i].count,
        .compiled = { .compiled = job->compiled, .axis = i },
    };
    const struct plan_check_source source = {
        .next = job_walk_next,
        .context = &walk,
        .facts = job->facts != NULL ? job_walk_facts : NULL,
        .is_inside = job->facts != NULL ? job_walk_is_inside : NULL,
    };
    return plan_check_source(&job->track[i], &source, limit, found, capacity);
}

/* What a value of the move is when it is played at that rate; saturating. */
static int64_t job_played(int64_t value, unsigned order, int64_t rate_q30)
{
    for (unsigned i = 0; i < order; i++)
        if (motion_fixed_muldiv(value, rate_q30, MOTION_CLOCK_WARP_ONE_Q30,
                                &value) < 0)
            return value < 0 ? -INT64_MAX : INT64_MAX;
    return value;
}

/* As the user meets it: the value as it is played, the limit of the rig. */
static struct job_violation job_violation_of(const struct job *job, unsigned i,
                                             int64_t rate_q30,
                                             const struct plan_violation *found)
{
    struct job_violation violation = {
        .axis = i,
        .kind = job_kind_of(job, &job->move.axis[i], &job->track[i], found),
        .t_ns_q12 = found->t_ns_q12,
        .limit = found->limit,
        .key =
            job_key_before(&job->move.axis[i],
                           plan_outcome_time(&job->outcome, found->t_ns_q12)),
    };
    const unsigned order = job_violation_order(violation.kind);
    violation.value = job_played(found->value, order, rate_q30);
    if (order > 0 && found->limit != 0)
        violation.limit = job_limit_of(&job_rig_axis(job, i)->limit, order);
    return violation;
}

static void job_keep_facts(struct job *job)
{
    const struct job *former = job->former;
    job->facts = memory_new((size_t)job->planned + 1, sizeof *job->facts);
    for (unsigned i = 0; i < job->planned; i++) {
        const int k = former == NULL || former->facts == NULL
                          ? -1
                          : job_axis_index(former, job->move.axis[i].name);
        if (k < 0)
            job_facts_make(&job->facts[i], &job->track[i], NULL, NULL);
        else
            job_facts_make(&job->facts[i], &job->track[i], &former->facts[k],
                           &former->track[k]);
    }
    job->former = NULL;
}

/* Room for so many at first; for more the axis is judged a second time. */
#define JOB_VIOLATIONS 256

static void job_check_axis(struct job *job, unsigned i, int64_t rate_q30)
{
    uint32_t room = JOB_VIOLATIONS;
    struct plan_violation *found = memory_new(room, sizeof *found);
    struct plan_limit limit;
    job_fit_limit(job, i, &limit);
    if (job->facts != NULL)
        job_facts_judge(&job->facts[i], &limit);
    uint32_t count = job_find(job, i, &limit, found, room, job->progress);
    if (count > room) {
        room = count;
        found = memory_resize(found, room, sizeof *found);
        count = job_find(job, i, &limit, found, room, NULL);
    }
    for (uint32_t k = 0; k < count; k++) {
        const struct job_violation violation =
            job_violation_of(job, i, rate_q30, &found[k]);
        job_add(job, &violation);
    }
    memory_free(found);
}

void job_check(struct job *job, int64_t rate_q30)
{
    if (rate_q30 < MOTION_CLOCK_WARP_ONE_Q30)
        rate_q30 = MOTION_CLOCK_WARP_ONE_Q30;
    job->violation_count = 0;
    job->rate_q30 = rate_q30;
    if (job->keeps && job->facts == NULL)
        job_keep_facts(job);
    for (unsigned i = 0; i < job->move.axis_count; i++)
        job_check_axis(job, i, rate_q30);
    plan_progress_end(job->progress);
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

void job_print_violations(const struct job *job, FILE *file)
{
    static const char *const head[] = {
        "<axis", ">move time", ">value", ">limit",
        "<unit", ">key",       ">line",  "<what",
    };
    struct table table;
    table_init(&table, 8, head);
    for (uint32_t i = 0; i < job->violation_count; i++)
        job_print_violation(job, &table, &job->violation[i]);
    table_print(&table, file);
    table_free(&table);
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
