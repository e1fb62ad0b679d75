/* firmware/linux/commands/files/cmd_compile.c - slew compile: planned tracks into a
 * file that can be played without being held in memory. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/job/job.h"
#include "firmware/host/track/track_file.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/planning.h"

static void cmd_compile_describe(const struct job *job, struct track_file *file)
{
    memset(file, 0, sizeof *file);
    file->axis_count = job->move.axis_count;
    memcpy(file->title, job->move.title, sizeof file->title);
    for (unsigned i = 0; i < file->axis_count; i++) {
        struct track_file_axis *axis = &file->axis[i];
        memcpy(axis->name, job->move.axis[i].name, sizeof axis->name);
        snprintf(axis->unit, sizeof axis->unit, "%s",
                 units_axis_text(job_rig_axis(job, i)->unit));
        axis->keys = job->move.axis[i].key_count;
    }
}

static enum status cmd_compile_save(const struct job *job, const char *path)
{
    static struct track_file file;
    struct output output;
    cmd_compile_describe(job, &file);
    if (output_open(&output, path) < 0)
        return STATUS_SYSTEM;
    track_file_write(output.file, &file, job->track);
    return output_commit(&output) < 0 ? STATUS_SYSTEM : STATUS_OK;
}

static enum status cmd_compile_run(const struct options *options)
{
    if (options->out == NULL) {
        error_say("slew compile: where to? expected --out FILE");
        return STATUS_INPUT;
    }
    struct job *job = memory_new(1, sizeof *job);
    enum status status =
        planning_open(job, options->path, options->path_count, false);
    if (status == STATUS_OK && job->move.events > 0)
        status =
            error_file(job->move_path, "has events, which a compiled move "
                                       "cannot hold, expected a move without");
    if (status == STATUS_OK)
        status = cmd_compile_save(job, options->out);
    job_free(job);
    memory_free(job);
    return status;
}

static const struct option_row cmd_compile_option[] = {
    { "out", "FILE", OPTION_TEXT, offsetof(struct options, out),
      "the compiled move; by custom it ends in .slt" },
    OPTIONS_COMMON,
};

const struct command cmd_compile = {
    .name = "compile",
    .arguments = "RIG MOVE | DIRECTORY",
    .summary = "save a planned move, to be played without holding it",
    .text =
        "Plans every axis and saves the result, integers to the bit.  run,\n"
        "sample, check and plot take the saved file in the place of MOVE; "
        "they read\n"
        "all of it once to see that it is whole, then play it through a "
        "window\n"
        "of some thousand segments per axis, however long it is.  Limits are\n"
        "judged when it is run, against the rig given then.\n",
    .examples = "  slew compile --out dolly.slt examples/dolly\n"
                "  slew run examples/dolly/rig.yaml dolly.slt\n"
                "  slew sample --rate 1000 examples/dolly/rig.yaml dolly.slt\n",
    COMMAND_OPTIONS(cmd_compile_option),
    .run = cmd_compile_run,
};
