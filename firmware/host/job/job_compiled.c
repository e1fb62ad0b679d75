/* firmware/host/job/job_compiled.c - a planned move into a file, and a compiled
 * one as a job: see job.h, job_open.h. */
#include "firmware/host/job/job_open.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/track/compiled.h"
#include "firmware/host/track/track_file.h"

_Static_assert(RIG_TRIGGERS_MAX <= TRACK_FILE_LINES_MAX,
               "every line that a rig may have fits");

static void compile_describe(const struct job *job, struct track_file *file)
{
    memset(file, 0, sizeof *file);
    file->axis_count = job->move.axis_count;
    file->axis = memory_new(file->axis_count, sizeof *file->axis);
    memcpy(file->title, job->move.title, sizeof file->title);
    for (unsigned i = 0; i < file->axis_count; i++) {
        struct track_file_axis *axis = &file->axis[i];
        memcpy(axis->name, job->move.axis[i].name, sizeof axis->name);
        snprintf(axis->unit, sizeof axis->unit, "%s",
                 units_axis_text(job_rig_axis(job, i)->unit));
        axis->keys = job->move.axis[i].key_count;
    }
    for (unsigned i = 0; i < job->rig.line_count; i++) {
        if (job->shots[i].count == 0)
            continue;
        struct track_file_line *line = &file->line[file->line_count++];
        memcpy(line->name, job->rig.line[i].name, sizeof line->name);
        line->count = job->shots[i].count;
        line->t_ns_q12 = job->shots[i].t_ns_q12;
    }
    file->step.count = job->steps.count;
    file->step.first_ns_q12 = job->steps.first_ns_q12;
    file->step.period_ns_q12 = job->steps.period_ns_q12;
    if (job->step_line != NULL)
        memcpy(file->step.line, job->step_line->name, sizeof file->step.line);
}

void job_compile(const struct job *job, FILE *out)
{
    struct track_file *file = memory_new(1, sizeof *file);
    compile_describe(job, file);
    track_file_write(out, file, job->track);
    memory_free(file->axis);
    memory_free(file);
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

enum status job_open_compiled(struct job *job, const struct files *files)
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
    return status == STATUS_OK ? job_take_step(job) : status;
}
