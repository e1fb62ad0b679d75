/* firmware/linux/commands/files/cmd_export.c - slew export: a move for another
 * program. */
#include <inttypes.h>
#include <stdio.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/exchange/import.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/planning.h"

#define CMD_EXPORT_LOST_MAX    256
#define CMD_EXPORT_OPTIONS_MAX (64 + IMPORT_NAMES_MAX)

static enum status cmd_export_fail(const char *what, const char *which)
{
    error_say("slew export: %s%s", what, which);
    return STATUS_INPUT;
}

static enum status cmd_export_write(const struct job *job,
                                    const struct import_format *format,
                                    const struct units_fps *fps,
                                    const char *path)
{
    char message[YAML_MESSAGE_MAX];
    struct output output;
    if (output_open(&output, path) < 0)
        return STATUS_SYSTEM;
    const int err = format->write(job, fps, output.file, message);
    plan_progress_end(job->progress);
    if (err < 0) {
        output_abandon(&output);
        return cmd_export_fail(message, "");
    }
    return output_commit(&output) < 0 ? STATUS_SYSTEM : STATUS_OK;
}

/* What the file does not say and slew import needs. */
static void cmd_export_options(const struct job *job,
                               const struct import_format *format,
                               const struct units_fps *fps,
                               char text[CMD_EXPORT_OPTIONS_MAX])
{
    size_t used = 0;
    text[0] = 0;
    if (!format->timed && fps->den == 1)
        used = (size_t)snprintf(text, CMD_EXPORT_OPTIONS_MAX, "--fps %" PRIu64,
                                fps->num);
    else if (!format->timed)
        used =
            (size_t)snprintf(text, CMD_EXPORT_OPTIONS_MAX,
                             "--fps %" PRIu64 "/%" PRIu64, fps->num, fps->den);
    for (unsigned i = 0; i < job->move.axis_count && !format->named; i++)
        used += (size_t)snprintf(text + used, CMD_EXPORT_OPTIONS_MAX - used,
                                 "%s%s", i == 0 ? " --columns " : ",",
                                 job->move.axis[i].name);
}

/* What no format can hold, of an axis; false: all of it can. */
static bool cmd_export_lost(const struct job *job, unsigned i,
                            char text[CMD_EXPORT_LOST_MAX])
{
    if (!job_runs_by_drive_profile(job, i))
        return false;
    snprintf(text, CMD_EXPORT_LOST_MAX,
             "%s: its drive goes from key to key by its own profile, which no "
             "file can hold: what is written is the motion expected of it, and "
             "slew import keeps where it leaves a rest",
             job->move.axis[i].name);
    return true;
}

static void cmd_export_report(const struct job *job, const char *path,
                              const char *options, bool json)
{
    char lost[CMD_EXPORT_LOST_MAX];
    if (!json) {
        printf("written: %s\n", path);
        if (options[0] != 0)
            printf("to read it back: %s\n", options);
        for (unsigned i = 0; i < job->move.axis_count; i++)
            if (cmd_export_lost(job, i, lost))
                puts(lost);
        return;
    }
    cJSON *report = cJSON_CreateObject();
    cJSON_AddStringToObject(report, "written", path);
    cJSON_AddStringToObject(report, "import_options", options);
    cJSON *list = cJSON_AddArrayToObject(report, "lost");
    for (unsigned i = 0; i < job->move.axis_count; i++)
        if (cmd_export_lost(job, i, lost))
            cJSON_AddItemToArray(list, cJSON_CreateString(lost));
    json_report(report, true);
}

static enum status cmd_export_job(const struct import_format *format,
                                  const struct options *options)
{
    char sentence[UNITS_SENTENCE_MAX];
    struct units_fps fps = { 0, 0 };
    if (options->fps != NULL &&
        units_parse_fps(options->fps, &fps, sentence) < 0)
        return cmd_export_fail("--fps: ", sentence);
    struct job *job = memory_new(1, sizeof *job);
    enum status status =
        planning_open(job, options->path + 1, options->path_count - 1, false);
    if (status == STATUS_OK)
        status = cmd_export_write(job, format, &fps, options->out);
    if (status == STATUS_OK) {
        char needed[CMD_EXPORT_OPTIONS_MAX];
        cmd_export_options(job, format, &fps, needed);
        cmd_export_report(job, options->out, needed, options->json);
    }
    job_free(job);
    memory_free(job);
    return status;
}

static enum status cmd_export_run(const struct options *options)
{
    const struct import_format *format = import_format_find(options->path[0]);
    static const char *const none[] = { NULL };
    char message[YAML_MESSAGE_MAX];
    if (format == NULL || format->write == NULL) {
        import_format_unknown(options->path[0], none, message);
        return cmd_export_fail(message, "");
    }
    if (options->path_count < 2)
        return cmd_export_fail("which move? expected FORMAT RIG MOVE", "");
    if (options->out == NULL)
        return cmd_export_fail("where to? expected --out FILE", "");
    return cmd_export_job(format, options);
}

static const struct option_row cmd_export_option[] = {
    { "out", "FILE", OPTION_TEXT, offsetof(struct options, out),
      "the file to write" },
    { "fps", "RATE", OPTION_TEXT, offsetof(struct options, fps),
      "frames per second: 24 or 24000/1001" },
    OPTIONS_COMMON,
};

const struct command cmd_export = {
    .name = "export",
    .arguments = "FORMAT RIG MOVE | FORMAT DIRECTORY",
    .summary = "write a move for another program",
    .text =
        "Writes kuper, flair, raw (Dragonframe), csv, maya (.anim), blender\n"
        "(JSON for examples/blender), ros-yaml or ros-json (JointTrajectory).\n"
        "Values are in the axes' own units, for ROS in rad and m.  Tables\n"
        "have a row per frame, with all digits a position has; maya and\n"
        "blender have keys and tangents, ROS has points.  What a file does\n"
        "not say, such as the order of the axes in raw, is printed as the\n"
        "options of slew import.  docs/FORMATS.md says more.\n",
    .examples = "  slew export kuper examples/dolly --fps 24 --out shot.txt\n"
                "  slew export maya rig.yaml move.yaml --fps 24 --out "
                "shot.anim\n",
    .path_max = 3,
    COMMAND_OPTIONS(cmd_export_option),
    .run = cmd_export_run,
};
