/* firmware/linux/commands/cmd_export.c - slew export: a move for another
 * program. */
#include <stdio.h>

#include "firmware/linux/base/json.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/exchange/import.h"

static enum status cmd_export_fail(const char *what, const char *which)
{
    fprintf(stderr, "slew export: %s%s\n", what, which);
    return STATUS_INPUT;
}

static enum status cmd_export_write(const struct job *job,
                                    const struct import_format *format,
                                    const struct units_fps *fps,
                                    const char *path)
{
    char message[RIG_MESSAGE_MAX];
    struct output output;
    if (output_open(&output, path) < 0)
        return STATUS_SYSTEM;
    if (format->write(job, fps, output.file, message) < 0) {
        output_abandon(&output);
        return cmd_export_fail(message, "");
    }
    return output_commit(&output) < 0 ? STATUS_SYSTEM : STATUS_OK;
}

static void cmd_export_report(const char *path, bool json)
{
    if (!json) {
        printf("written: %s\n", path);
        return;
    }
    cJSON *report = cJSON_CreateObject();
    cJSON_AddStringToObject(report, "written", path);
    json_print(report, stdout);
}

static enum status cmd_export_job(const struct import_format *format,
                                  const struct options *options)
{
    static struct job job;
    char sentence[UNITS_SENTENCE_MAX];
    struct units_fps fps = { 0, 0 };
    if (options->fps != NULL &&
        units_parse_fps(options->fps, &fps, sentence) < 0)
        return cmd_export_fail("--fps: ", sentence);
    enum status status =
        job_open(&job, options->path + 1, options->path_count - 1);
    if (status == STATUS_OK)
        status = cmd_export_write(&job, format, &fps, options->out);
    if (status == STATUS_OK)
        cmd_export_report(options->out, options->json);
    job_free(&job);
    return status;
}

static enum status cmd_export_run(const struct options *options)
{
    const struct import_format *format = import_format_find(options->path[0]);
    if (format == NULL || format->write == NULL)
        return cmd_export_fail("no format ", options->path[0]);
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
        "Writes kuper, flair, raw (Dragonframe), csv, maya (.anim) or blender\n"
        "(JSON for examples/blender).  Values are in the axes' own units.  "
        "Tables\nhave a row per frame, with all digits a position has; maya "
        "and blender have\nkeys and tangents.  docs/FORMATS.md says more.\n",
    .examples = "  slew export kuper examples/dolly --fps 24 --out shot.txt\n"
                "  slew export maya rig.yaml move.yaml --fps 24 --out "
                "shot.anim\n",
    .path_max = 3,
    COMMAND_OPTIONS(cmd_export_option),
    .run = cmd_export_run,
};
