/* firmware/linux/commands/cmd_plot.c - slew plot: a move, or a run of it, as a
 * picture. */
#include <stdio.h>

#include "firmware/linux/base/json.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/machine/telemetry.h"
#include "firmware/linux/machine/trace.h"
#include "firmware/linux/move/job.h"
#include "firmware/linux/plot/compare.h"
#include "firmware/linux/plot/plot.h"

static enum status cmd_plot_fail(const char *what)
{
    fprintf(stderr, "slew plot: %s\n", what);
    return STATUS_INPUT;
}

static enum status cmd_plot_trace(const struct job *job, const char *path,
                                  struct trace *trace)
{
    char message[RIG_MESSAGE_MAX];
    if (telemetry_read(path, &job->rig, trace_take, trace, message) < 0) {
        fprintf(stderr, "%s\n", message);
        return STATUS_INPUT;
    }
    if (trace->count == 0)
        return cmd_plot_fail("the telemetry holds no move");
    return STATUS_OK;
}

static void cmd_plot_report(const char *path, bool json)
{
    if (!json) {
        printf("picture: %s\n", path);
        return;
    }
    cJSON *report = cJSON_CreateObject();
    cJSON_AddStringToObject(report, "picture", path);
    json_print(report, stdout);
}

static enum status cmd_plot_job(struct job *job, struct trace *trace,
                                const struct options *options)
{
    enum status status =
        options->compare != NULL
            ? job_open(job, options->path, options->path_count)
            : job_open_any(job, options->path, options->path_count);
    if (status == STATUS_OK && options->compare != NULL)
        status = compare_job(job, options->compare, options->axis);
    if (status != STATUS_OK)
        return status;
    bool traced = options->telemetry != NULL;
    if (traced) {
        trace_init(trace, job->rig.axis_count);
        status = cmd_plot_trace(job, options->telemetry, trace);
    }
    if (status != STATUS_OK)
        return status;
    if (plot_save(job, traced ? trace : NULL, options->out) < 0)
        return STATUS_SYSTEM;
    cmd_plot_report(options->out, options->json);
    return STATUS_OK;
}

static enum status cmd_plot_run(const struct options *options)
{
    static struct job job;
    static struct trace trace;
    if (options->out == NULL || plot_format_of(options->out) < 0)
        return cmd_plot_fail("where to? expected --out FILE.svg or FILE.png");
    if (options->compare != NULL && options->telemetry != NULL)
        return cmd_plot_fail("--compare: a run has one curve, expected no "
                             "--telemetry");
    if (options->axis != NULL && options->compare == NULL)
        return cmd_plot_fail("--axis: expected with --compare");
    enum status status = cmd_plot_job(&job, &trace, options);
    trace_free(&trace);
    job_free(&job);
    return status;
}

static const struct option_row cmd_plot_option[] = {
    { "out", "FILE", OPTION_TEXT, offsetof(struct options, out),
      "the picture, .svg or .png by its name" },
    { "telemetry", "FILE", OPTION_TEXT, offsetof(struct options, telemetry),
      "CSV of slew run: draw what the servos did, too" },
    { "compare", "CURVES", OPTION_TEXT, offsetof(struct options, compare),
      "the same keys under these curves, or all: linear,quintic" },
    { "axis", "NAME", OPTION_TEXT, offsetof(struct options, axis),
      "with --compare: whose keys" },
    OPTIONS_COMMON,
};

const struct command cmd_plot = {
    .name = "plot",
    .arguments = "RIG MOVE | DIRECTORY",
    .summary = "draw position, velocity, acceleration and jerk",
    .text =
        "Draws one column per axis: position, velocity, acceleration and jerk\n"
        "against time, with the keys and with what lies beyond a limit "
        "shaded.\n"
        "With telemetry also what the servo did, and the following error.\n"
        "With --compare one column per kind of curve, on common scales; what\n"
        "a key gives and a curve does not take is left out.  docs/GALLERY.md\n"
        "shows every kind.  MOVE may be a compiled one, which has no keys\n"
        "(slew compile).\n",
    .examples = "  slew plot --out dolly.svg examples/dolly\n"
                "  slew plot --out run.png --telemetry run.csv rig.yaml "
                "move.yaml\n"
                "  slew plot --out pan.svg --compare linear,quintic --axis pan "
                "examples/dolly\n",
    COMMAND_OPTIONS(cmd_plot_option),
    .run = cmd_plot_run,
};
