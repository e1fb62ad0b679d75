/* firmware/linux/commands/files/cmd_compile.c - slew compile: planned tracks into a
 * file that can be played without being held in memory. */
#include <cjson/cJSON.h>
#include <stdio.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/job.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/planning.h"

static enum status cmd_compile_save(const struct job *job, const char *path)
{
    struct output output;
    if (output_open(&output, path) < 0)
        return STATUS_SYSTEM;
    job_compile(job, output.file);
    return output_commit(&output) < 0 ? STATUS_SYSTEM : STATUS_OK;
}

static void cmd_compile_report(const struct job *job,
                               const struct options *options)
{
    const double end_s = number_double(job->end_ns_q12, 12) / 1e9;
    uint32_t segments = 0;

    for (unsigned i = 0; i < job->move.axis_count; i++)
        segments += job->track[i].count;
    if (!options->json) {
        printf("compiled: %s, %u %s, %u %s, %.3f s\n", options->out,
               job->move.axis_count,
               number_word(job->move.axis_count, "axis", "axes"), segments,
               number_word(segments, "segment", "segments"), end_s);
        return;
    }
    cJSON *report = cJSON_CreateObject();
    cJSON_AddStringToObject(report, "written", options->out);
    cJSON_AddNumberToObject(report, "duration_s", end_s);
    cJSON_AddNumberToObject(report, "axes", job->move.axis_count);
    cJSON_AddNumberToObject(report, "segments", segments);
    job_json_hash(job, report);
    json_report(report, true);
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
    if (status == STATUS_OK && job->move.times != 0) {
        error_say("slew compile: a compiled move is played once, expected a "
                  "move without loop and ping_pong");
        status = STATUS_INPUT;
    }
    if (status == STATUS_OK)
        status = cmd_compile_save(job, options->out);
    if (status == STATUS_OK)
        cmd_compile_report(job, options);
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
        "Plans every axis and saves the result, integers to the bit, and what\n"
        "the move triggers and waits for.  run,\n"
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
