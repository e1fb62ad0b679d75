/* firmware/host/job/job_compile.c - a planned move into a file: see job.h. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/job/job.h"
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
