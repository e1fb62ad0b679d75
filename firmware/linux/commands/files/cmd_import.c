/* firmware/linux/commands/files/cmd_import.c - slew import: a move of another
 * program. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/exchange/import.h"
#include "firmware/host/exchange/import_fit.h"
#include "firmware/host/job/compare.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/files/import_urdf.h"
#include "firmware/linux/commands/planning.h"

static enum status cmd_import_fail(const char *what, const char *which)
{
    error_say("slew import: %s%s", what, which);
    return STATUS_INPUT;
}

static enum status cmd_import_refuse(const char *message)
{
    error_say("%s", message);
    return STATUS_INPUT;
}

static enum status cmd_import_wish(struct import_wish *wish,
                                   const struct options *options)
{
    char sentence[UNITS_SENTENCE_MAX], message[YAML_MESSAGE_MAX];
    enum plan_curve *curve = NULL;
    wish->curve = PLAN_CURVE_QUINTIC;
    wish->progress = &planning_progress;
    if (options->fps != NULL &&
        units_parse_fps(options->fps, &wish->fps, sentence) < 0)
        return cmd_import_fail("--fps: ", sentence);
    if (options->columns != NULL &&
        import_wish_columns(wish, options->columns, message) < 0)
        return cmd_import_fail(message, "");
    if (options->curve == NULL)
        return STATUS_OK;
    struct messages messages = { .text = NULL };
    int count = compare_parse("slew import: --curve", options->curve, &curve,
                              &messages);
    error_tell(&messages);
    if (count < 0)
        return STATUS_INPUT;
    wish->curve = curve[0];
    wish->has_curve = true;
    memory_free(curve);
    return count == 1 ? STATUS_OK
                      : cmd_import_fail("--curve: expected one curve, such as "
                                        "quintic",
                                        "");
}

/* The move is planned before anything is written: what cannot be planned, such
 * as a curve that needs more than positions, is no move. */
static enum status cmd_import_check(struct imported *imported,
                                    const struct import_format *format,
                                    const struct import_wish *wish,
                                    struct import_fit fit[], const char *path)
{
    const uint32_t axes = imported->move.axis_count;
    struct plan_error error;
    int err = 0;
    for (uint32_t i = 0; i < axes && err >= 0; i++) {
        struct plan_axis *axis = &imported->move.axis[i];
        plan_progress_tell(&planning_progress, "judging", axis->name, i, axes);
        err = import_fit(wish, format->sampled, axis, &fit[i], &error);
    }
    plan_progress_end(&planning_progress);
    if (err < 0) {
        error_say("%s:%u:%u: %s", path, error.place.line, error.place.column,
                  error.text);
        return STATUS_INPUT;
    }
    return STATUS_OK;
}

static enum status cmd_import_write(const struct imported *imported,
                                    const struct import_format *format,
                                    const char *path)
{
    char message[YAML_MESSAGE_MAX];
    struct output output;
    char origin[64];
    if (output_open(&output, path) < 0)
        return STATUS_SYSTEM;
    snprintf(origin, sizeof origin, "Imported from %s by slew import.",
             format->name);
    if (export_move(imported, origin, output.file, message) < 0) {
        output_abandon(&output);
        return cmd_import_fail(message, "");
    }
    return output_commit(&output) < 0 ? STATUS_SYSTEM : STATUS_OK;
}

static void cmd_import_curves(const struct imported *imported,
                              const struct rig *rig,
                              const struct import_fit fit[], cJSON *report)
{
    const struct plan_move *move = &imported->move;
    cJSON *list =
        report != NULL ? cJSON_AddArrayToObject(report, "curves") : NULL;
    for (uint32_t i = 0; i < move->axis_count; i++) {
        const struct plan_axis *axis = &move->axis[i];
        char text[IMPORT_FIT_MAX];
        import_fit_text(&fit[i], rig, axis, text);
        if (list == NULL) {
            if (text[0] != 0)
                printf("%s\n", text);
            continue;
        }
        cJSON *row = cJSON_CreateObject();
        cJSON_AddStringToObject(row, "axis", axis->name);
        cJSON_AddStringToObject(row, "curve",
                                plan_curve_rules(axis->curve)->name);
        cJSON_AddBoolToObject(row, "within_limits",
                              fit[i].passes ||
                                  (fit[i].changed && !fit[i].needs_time));
        cJSON_AddStringToObject(row, "note", text);
        cJSON_AddItemToArray(list, row);
    }
}

static void cmd_import_report(const struct imported *imported,
                              const struct import_wish *wish,
                              const struct import_fit fit[],
                              const struct options *options)
{
    const struct plan_move *move = &imported->move;
    uint64_t keys = 0;
    for (uint32_t i = 0; i < move->axis_count; i++)
        keys += move->axis[i].key_count;
    if (!options->json) {
        printf("move: %s, %u %s, %llu keys\n", options->out, move->axis_count,
               number_word(move->axis_count, "axis", "axes"),
               (unsigned long long)keys);
        if (imported->note[0] != 0)
            printf("lost: %s\n", imported->note);
        cmd_import_curves(imported, wish->rig, fit, NULL);
        return;
    }
    cJSON *report = cJSON_CreateObject();
    cJSON_AddStringToObject(report, "move", options->out);
    cJSON_AddNumberToObject(report, "axes", move->axis_count);
    cJSON_AddNumberToObject(report, "keys", (double)keys);
    cJSON_AddStringToObject(report, "lost", imported->note);
    cmd_import_curves(imported, wish->rig, fit, report);
    json_print(report, stdout);
}

static enum status cmd_import_file(const struct import_format *format,
                                   const struct import_wish *wish,
                                   const struct options *options)
{
    static struct imported imported;
    char message[YAML_MESSAGE_MAX];
    const int err =
        format->read(&disk_files, options->path[1], wish, &imported, message);
    plan_progress_end(&planning_progress);
    if (err < 0)
        return cmd_import_refuse(message);
    struct import_fit *fit =
        memory_new((size_t)imported.move.axis_count + 1, sizeof *fit);
    enum status status =
        cmd_import_check(&imported, format, wish, fit, options->path[1]);
    if (status == STATUS_OK)
        status = cmd_import_write(&imported, format, options->out);
    if (status == STATUS_OK)
        cmd_import_report(&imported, wish, fit, options);
    memory_free(fit);
    move_free(&imported.move);
    return status;
}

/* A description of a robot is no move: its limits go into a rig. */
static enum status cmd_import_limits(const struct options *options)
{
    if (options->path_count != 2)
        return cmd_import_fail("which file? expected urdf FILE", "");
    if (options->rig == NULL)
        return cmd_import_fail("into which rig? expected --rig RIG", "");
    if (options->out == NULL)
        return cmd_import_fail("where to? expected --out RIG.yaml", "");
    if (options->fps != NULL || options->columns != NULL ||
        options->curve != NULL)
        return cmd_import_fail("--fps, --columns and --curve are for moves, "
                               "and urdf has limits",
                               "");
    return import_urdf(options);
}

static enum status cmd_import_run(const struct options *options)
{
    static struct rig rig;
    struct import_wish wish = { .rig = &rig };
    char message[YAML_MESSAGE_MAX];
    if (options->path_count > 0 && strcmp(options->path[0], "urdf") == 0)
        return cmd_import_limits(options);
    const struct import_format *format = import_format_find(options->path[0]);
    if (format == NULL || format->read == NULL) {
        import_format_unknown(options->path[0], "urdf", message);
        return cmd_import_fail(message, "");
    }
    if (options->path_count != 2)
        return cmd_import_fail("which file? expected FORMAT FILE", "");
    if (options->rig == NULL)
        return cmd_import_fail("for which axes? expected --rig RIG", "");
    if (options->out == NULL)
        return cmd_import_fail("where to? expected --out MOVE.yaml", "");
    enum status status = planning_rig(options->rig, &rig);
    if (status == STATUS_OK)
        status = cmd_import_wish(&wish, options);
    return status == STATUS_OK ? cmd_import_file(format, &wish, options)
                               : status;
}

static const struct option_row cmd_import_option[] = {
    { "rig", "RIG", OPTION_TEXT, offsetof(struct options, rig),
      "whose axes they are" },
    { "out", "FILE", OPTION_TEXT, offsetof(struct options, out),
      "the move, or with urdf the rig, .yaml" },
    { "fps", "RATE", OPTION_TEXT, offsetof(struct options, fps),
      "frames per second: 24 or 24000/1001" },
    { "columns", "AXES", OPTION_TEXT, offsetof(struct options, columns),
      "axis of each column, - for none: pan,-,tilt" },
    { "curve", "CURVE", OPTION_TEXT, offsetof(struct options, curve),
      "through positions: else quintic, or what keeps inside the limits" },
    OPTIONS_COMMON,
};

const struct command cmd_import = {
    .name = "import",
    .arguments = "FORMAT FILE",
    .summary = "read a move of another program",
    .text =
        "Reads kuper, flair, raw (Dragonframe), csv, maya (.anim), blender\n"
        "(JSON of examples/blender), ros-yaml or ros-json (JointTrajectory)\n"
        "and writes a move file.  Values are taken to be in the axes' own\n"
        "units, those of ROS in rad and m; columns find their axes by name.\n"
        "An axis that breaks a limit of the rig is named, with the curve that\n"
        "was taken or would pass.  docs/FORMATS.md says what is read and what\n"
        "is lost.\n\n"
        "urdf reads limits of position and velocity from a robot description\n"
        "into the text of a rig file, whose axes have the joints' names;\n"
        "comments and all else stay.\n",
    .examples =
        "  slew import kuper shot.txt --rig rig.yaml --fps 24 --out move.yaml\n"
        "  slew import raw shot.txt --rig rig.yaml --fps 24 --columns pan,tilt "
        "--out move.yaml\n"
        "  slew import urdf arm.urdf --rig rig.yaml --out rig.yaml\n",
    COMMAND_OPTIONS(cmd_import_option),
    .run = cmd_import_run,
};
