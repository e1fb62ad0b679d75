/* firmware/linux/commands/cmd_import.c - slew import: a move of another
 * program. */
#include <stdio.h>
#include <string.h>

#include "firmware/linux/base/json.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/exchange/import.h"
#include "firmware/linux/plot/compare.h"

static enum status cmd_import_fail(const char *what, const char *which)
{
    fprintf(stderr, "slew import: %s%s\n", what, which);
    return STATUS_INPUT;
}

static enum status cmd_import_refuse(const char *message)
{
    fprintf(stderr, "%s\n", message);
    return STATUS_INPUT;
}

static enum status cmd_import_wish(struct import_wish *wish,
                                   const struct options *options)
{
    char sentence[UNITS_SENTENCE_MAX], message[RIG_MESSAGE_MAX];
    enum plan_curve curve[PLAN_AXES_MAX];
    wish->curve = PLAN_CURVE_QUINTIC;
    if (options->fps != NULL &&
        units_parse_fps(options->fps, &wish->fps, sentence) < 0)
        return cmd_import_fail("--fps: ", sentence);
    if (options->columns != NULL &&
        import_wish_columns(wish, options->columns, message) < 0)
        return cmd_import_fail(message, "");
    if (options->curve == NULL)
        return STATUS_OK;
    int count = compare_parse(options->curve, curve);
    if (count < 0)
        return STATUS_INPUT;
    if (count != 1)
        return cmd_import_fail("--curve: expected one curve", "");
    wish->curve = curve[0];
    return STATUS_OK;
}

/* The move is planned before anything is written: what cannot be planned, such
 * as a curve that needs more than positions, is no move. */
static enum status cmd_import_check(const struct imported *imported,
                                    const char *path)
{
    for (uint32_t i = 0; i < imported->move.axis_count; i++) {
        struct motion_track track;
        struct plan_error error;
        if (plan_axis_track(&imported->move.axis[i], &track, &error) < 0) {
            fprintf(stderr, "%s:%u:%u: %s\n", path, error.place.line,
                    error.place.column, error.text);
            return STATUS_INPUT;
        }
        plan_track_free(&track);
    }
    return STATUS_OK;
}

static enum status cmd_import_write(const struct imported *imported,
                                    const struct import_format *format,
                                    const char *path)
{
    char message[RIG_MESSAGE_MAX];
    struct output output;
    if (output_open(&output, path) < 0)
        return STATUS_SYSTEM;
    if (export_move(imported, format->name, output.file, message) < 0) {
        output_abandon(&output);
        return cmd_import_fail(message, "");
    }
    return output_commit(&output) < 0 ? STATUS_SYSTEM : STATUS_OK;
}

static void cmd_import_report(const struct imported *imported,
                              const struct options *options)
{
    const struct plan_move *move = &imported->move;
    uint64_t keys = 0;
    for (uint32_t i = 0; i < move->axis_count; i++)
        keys += move->axis[i].key_count;
    if (!options->json) {
        printf("move: %s, %u %s, %llu keys\n", options->out, move->axis_count,
               move->axis_count == 1 ? "axis" : "axes",
               (unsigned long long)keys);
        if (imported->note[0] != 0)
            printf("lost: %s\n", imported->note);
        return;
    }
    cJSON *report = cJSON_CreateObject();
    cJSON_AddStringToObject(report, "move", options->out);
    cJSON_AddNumberToObject(report, "axes", move->axis_count);
    cJSON_AddNumberToObject(report, "keys", (double)keys);
    cJSON_AddStringToObject(report, "lost", imported->note);
    json_print(report, stdout);
}

static enum status cmd_import_file(const struct import_format *format,
                                   const struct import_wish *wish,
                                   const struct options *options)
{
    static struct imported imported;
    char message[RIG_MESSAGE_MAX];
    if (format->read(options->path[1], wish, &imported, message) < 0)
        return cmd_import_refuse(message);
    enum status status = cmd_import_check(&imported, options->path[1]);
    if (status == STATUS_OK)
        status = cmd_import_write(&imported, format, options->out);
    if (status == STATUS_OK)
        cmd_import_report(&imported, options);
    move_free(&imported.move);
    return status;
}

static enum status cmd_import_run(const struct options *options)
{
    static struct rig rig;
    struct import_wish wish = { .rig = &rig };
    char message[RIG_MESSAGE_MAX];
    const struct import_format *format = import_format_find(options->path[0]);
    if (format == NULL || format->read == NULL)
        return cmd_import_fail("no format ", options->path[0]);
    if (options->path_count != 2)
        return cmd_import_fail("which file? expected FORMAT FILE", "");
    if (options->rig == NULL)
        return cmd_import_fail("for which axes? expected --rig RIG", "");
    if (options->out == NULL)
        return cmd_import_fail("where to? expected --out MOVE.yaml", "");
    if (rig_load(options->rig, &rig, message) < 0)
        return cmd_import_refuse(message);
    enum status status = cmd_import_wish(&wish, options);
    return status == STATUS_OK ? cmd_import_file(format, &wish, options)
                               : status;
}

static const struct option_row cmd_import_option[] = {
    { "rig", "RIG", OPTION_TEXT, offsetof(struct options, rig),
      "whose axes they are" },
    { "out", "FILE", OPTION_TEXT, offsetof(struct options, out),
      "the move, .yaml" },
    { "fps", "RATE", OPTION_TEXT, offsetof(struct options, fps),
      "frames per second: 24 or 24000/1001" },
    { "columns", "AXES", OPTION_TEXT, offsetof(struct options, columns),
      "axis of each column, - for none: pan,-,tilt" },
    { "curve", "CURVE", OPTION_TEXT, offsetof(struct options, curve),
      "through positions that have no tangents (quintic)" },
    OPTIONS_COMMON,
};

const struct command cmd_import = {
    .name = "import",
    .arguments = "FORMAT FILE",
    .summary = "read a move of another program",
    .text =
        "Reads kuper, flair, raw (Dragonframe), csv, maya (.anim) or blender\n"
        "(JSON of examples/blender) and writes a move file.  Values are taken "
        "to be in\nthe axes' own units; columns find their axes by name.  "
        "docs/FORMATS.md says\nwhat is read and what is lost.\n",
    .examples =
        "  slew import kuper shot.txt --rig rig.yaml --fps 24 --out move.yaml\n"
        "  slew import raw shot.txt --rig rig.yaml --fps 24 --columns pan,tilt "
        "--out move.yaml\n",
    COMMAND_OPTIONS(cmd_import_option),
    .run = cmd_import_run,
};
