/* firmware/linux/commands/files/cmd_import.c - slew import: a move of another
 * program. */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
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
#include "firmware/linux/xml/arcm.h"

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

static enum status cmd_import_settings(struct import_settings *settings,
                                       const struct options *options)
{
    char sentence[UNITS_SENTENCE_MAX], message[YAML_MESSAGE_MAX];
    enum plan_curve *curve = NULL;
    settings->curve = PLAN_CURVE_QUINTIC;
    settings->progress = &planning_progress;
    if (options->fps != NULL &&
        units_parse_fps(options->fps, &settings->fps, sentence) < 0)
        return cmd_import_fail("--fps: ", sentence);
    if (options->columns != NULL &&
        import_settings_columns(settings, options->columns, message) < 0)
        return cmd_import_fail(message, "");
    if (options->decimal != NULL && strcmp(options->decimal, "comma") != 0 &&
        strcmp(options->decimal, "point") != 0)
        return cmd_import_fail("--decimal: expected point or comma", "");
    settings->has_comma =
        options->decimal != NULL && strcmp(options->decimal, "comma") == 0;
    settings->unwrap = options->unwrap;
    settings->scale = options->scale;
    settings->offset = options->offset;
    for (unsigned i = 0; i < settings->rig->axis_count; i++) {
        struct import_adjust adjust;
        if (import_adjust_of(settings, i, &adjust, message) < 0)
            return cmd_import_fail(message, "");
    }
    if (options->curve == NULL)
        return STATUS_OK;
    struct messages messages = { .text = NULL };
    int count = compare_parse("slew import: --curve", options->curve, &curve,
                              &messages);
    error_tell(&messages);
    if (count < 0)
        return STATUS_INPUT;
    settings->curve = curve[0];
    settings->has_curve = true;
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
                                    const struct import_settings *settings,
                                    struct import_fit fit[], const char *path)
{
    const uint32_t axes = imported->move.axis_count;
    struct plan_error error;
    int err = 0;
    for (uint32_t i = 0; i < axes && err >= 0; i++) {
        struct plan_axis *axis = &imported->move.axis[i];
        plan_progress_tell(&planning_progress, "judging", axis->name, i, axes);
        err = import_fit(settings, format->sampled, axis, &fit[i], &error);
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

/* --- what became of it -------------------------------------------------------- */

static const char *cmd_import_part(const struct import_column *column)
{
    static const char *const part[] = {
        [IMPORT_LEFT_OUT] = "-",        [IMPORT_POSITION] = "position",
        [IMPORT_VELOCITY] = "velocity", [IMPORT_ACCELERATION] = "acceleration",
        [IMPORT_FRAMES] = "time",       [IMPORT_TIMES] = "time",
        [IMPORT_TIMECODES] = "time",    [IMPORT_NAMELESS] = "empty"
    };

    return part[column->part];
}

/* "frames from 1", "s from 0", "mm", "deg/s". */
static void cmd_import_unit(const struct imported *imported,
                            const struct import_column *column,
                            const struct rig *rig, char text[TABLE_CELL_MAX])
{
    static const char *const per[] = { "", "/s", "/s2" };

    text[0] = 0;
    if (column->part >= IMPORT_FRAMES && column->part <= IMPORT_TIMECODES)
        snprintf(text, TABLE_CELL_MAX, "%s from %.32s",
                 column->part == IMPORT_FRAMES      ? "frames"
                 : column->part == IMPORT_TIMECODES ? "timecode"
                                                    : column->unit,
                 imported->first);
    else if (column->axis >= 0 && column->unit[0] != 0)
        snprintf(text, TABLE_CELL_MAX, "%s", column->unit);
    else if (column->axis >= 0)
        snprintf(text, TABLE_CELL_MAX, "%s%s",
                 units_axis_text(rig->axis[column->axis].unit),
                 per[column->part - IMPORT_POSITION]);
}

static void cmd_import_factor(const struct import_adjust *adjust,
                              char text[TABLE_CELL_MAX])
{
    if (adjust->den == 1)
        snprintf(text, TABLE_CELL_MAX, "%" PRId64, adjust->num);
    else
        snprintf(text, TABLE_CELL_MAX, "%" PRId64 "/%" PRId64, adjust->num,
                 adjust->den);
}

static void cmd_import_row(const struct imported *imported, unsigned i,
                           const struct import_settings *settings,
                           struct table *table)
{
    const struct import_column *column = &imported->column[i];
    const bool is_axis = column->axis >= 0;
    const bool is_position = column->part == IMPORT_POSITION;
    char unit[TABLE_CELL_MAX], factor[TABLE_CELL_MAX] = "",
                               offset[NUMBER_MAX] = "",
                               message[YAML_MESSAGE_MAX];
    struct import_adjust adjust;

    cmd_import_unit(imported, column, settings->rig, unit);
    if (is_axis && import_adjust_of(settings, (unsigned)column->axis, &adjust,
                                    message) == 0) {
        cmd_import_factor(&adjust, factor);
        if (is_position)
            number_short(offset, adjust.offset_q32, 32);
    }
    table_cell(table, "%u", i + 1);
    table_cell(table, "%.40s", column->name);
    table_cell(table, "%s",
               is_axis ? settings->rig->axis[column->axis].name : "-");
    table_cell(table, "%s", cmd_import_part(column));
    table_cell(table, "%s", unit);
    table_cell(table, "%s", factor);
    table_cell(table, "%s", offset);
    if (!settings->unwrap)
        return;
    if (is_position)
        table_cell(table, "%u", column->wraps);
    else
        table_cell(table, "%s", "");
}

/* Which of the file's columns is what, so that nobody has to guess. */
static void cmd_import_table(const struct imported *imported,
                             const struct import_settings *settings)
{
    char number[16];
    const char *head[] = { number,  "<name",  "<axis",   "<is",
                           "<unit", ">scale", ">offset", ">wraps" };
    struct table table;

    snprintf(number, sizeof number, ">%s", imported->column_word);
    table_init(&table, settings->unwrap ? 8 : 7, head);
    for (unsigned i = 0; i < imported->columns; i++)
        cmd_import_row(imported, i, settings, &table);
    table_print(&table, stdout);
    table_free(&table);
}

static void cmd_import_columns(const struct imported *imported,
                               const struct import_settings *settings,
                               cJSON *report)
{
    cJSON *list = cJSON_AddArrayToObject(report, "columns");

    for (unsigned i = 0; i < imported->columns; i++) {
        const struct import_column *column = &imported->column[i];
        char unit[TABLE_CELL_MAX], message[YAML_MESSAGE_MAX];
        struct import_adjust adjust;
        cJSON *row = cJSON_CreateObject();
        cmd_import_unit(imported, column, settings->rig, unit);
        cJSON_AddStringToObject(row, "name", column->name);
        cJSON_AddStringToObject(row, "is", cmd_import_part(column));
        if (column->axis >= 0 &&
            import_adjust_of(settings, (unsigned)column->axis, &adjust,
                             message) == 0) {
            cJSON_AddStringToObject(row, "axis",
                                    settings->rig->axis[column->axis].name);
            cJSON_AddNumberToObject(row, "scale",
                                    (double)adjust.num / (double)adjust.den);
            cJSON_AddNumberToObject(row, "offset",
                                    number_double(adjust.offset_q32, 32));
            cJSON_AddNumberToObject(row, "wraps", column->wraps);
        }
        cJSON_AddStringToObject(row, "unit", unit);
        cJSON_AddItemToArray(list, row);
    }
}

static void cmd_import_odd(const struct import_fit *fit,
                           const struct plan_axis *axis,
                           const struct rig_axis *on, cJSON *row)
{
    char text[IMPORT_ODD_MAX];

    if (fit->odd.kind == IMPORT_ODD_NONE)
        return;
    import_odd_text(&fit->odd, on, axis, text);
    cJSON *odd = cJSON_AddObjectToObject(row, "odd");
    cJSON_AddNumberToObject(odd, "row", fit->odd.row + 1);
    cJSON_AddNumberToObject(odd, "line", axis->key[fit->odd.row].place.line);
    cJSON_AddNumberToObject(odd, "rows", fit->odd.more + 1);
    cJSON_AddStringToObject(odd, "what", text);
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
        cmd_import_odd(&fit[i], axis,
                       &rig->axis[rig_axis_index(rig, axis->name)], row);
        cJSON_AddItemToArray(list, row);
    }
}

static bool cmd_import_has_time(const struct imported *imported)
{
    for (unsigned i = 0; i < imported->columns; i++)
        if (imported->column[i].part >= IMPORT_FRAMES &&
            imported->column[i].part <= IMPORT_TIMECODES)
            return true;
    return false;
}

static void cmd_import_report(const struct imported *imported,
                              const struct import_settings *settings,
                              const struct import_fit fit[],
                              const struct options *options)
{
    const struct plan_move *move = &imported->move;
    uint64_t keys = 0;
    for (uint32_t i = 0; i < move->axis_count; i++)
        keys += move->axis[i].key_count;
    if (!options->json) {
        cmd_import_table(imported, settings);
        printf("move: %s, %u %s, %llu %s\n", options->out, move->axis_count,
               number_word(move->axis_count, "axis", "axes"),
               (unsigned long long)keys, number_word(keys, "key", "keys"));
        if (imported->first[0] != 0 && !cmd_import_has_time(imported))
            printf("time 0: frame %s of the file\n", imported->first);
        if (imported->note[0] != 0)
            printf("lost: %s\n", imported->note);
        cmd_import_curves(imported, settings->rig, fit, NULL);
        return;
    }
    cJSON *report = cJSON_CreateObject();
    cJSON_AddStringToObject(report, "move", options->out);
    cJSON_AddNumberToObject(report, "axes", move->axis_count);
    cJSON_AddNumberToObject(report, "keys", (double)keys);
    cJSON_AddStringToObject(report, "lost", imported->note);
    cmd_import_columns(imported, settings, report);
    cmd_import_curves(imported, settings->rig, fit, report);
    json_report(report, true);
}

static enum status cmd_import_file(const struct import_format *format,
                                   const struct import_settings *settings,
                                   const struct options *options)
{
    static struct imported imported;
    char message[YAML_MESSAGE_MAX];
    const int err = format->read(&disk_files, options->path[1], settings,
                                 &imported, message);
    plan_progress_end(&planning_progress);
    if (err < 0)
        return cmd_import_refuse(message);
    if (import_adjust(settings, &imported, message) < 0) {
        move_free(&imported.move);
        return cmd_import_fail(message, "");
    }
    struct import_fit *fit =
        memory_new((size_t)imported.move.axis_count + 1, sizeof *fit);
    enum status status =
        cmd_import_check(&imported, format, settings, fit, options->path[1]);
    if (status == STATUS_OK)
        status = cmd_import_write(&imported, format, options->out);
    if (status == STATUS_OK)
        cmd_import_report(&imported, settings, fit, options);
    memory_free(fit);
    move_free(&imported.move);
    return status;
}

/* A description of a robot is no move: its limits go into a rig. */
static enum status cmd_import_limits(const struct options *options)
{
    if (options->path_count < 2)
        return cmd_import_fail("which file? expected urdf FILE, with "
                               "joint_limits.yaml of MoveIt behind it where "
                               "there is one",
                               "");
    if (options->rig == NULL)
        return cmd_import_fail("into which rig? expected --rig RIG", "");
    if (options->out == NULL)
        return cmd_import_fail("where to? expected --out RIG.yaml", "");
    if (options->fps != NULL || options->columns != NULL ||
        options->curve != NULL || options->scale != NULL ||
        options->offset != NULL || options->decimal != NULL || options->unwrap)
        return cmd_import_fail(
            "--fps, --columns, --decimal, --scale, --offset, "
            "--unwrap and --curve are for moves, and urdf "
            "has limits",
            "");
    return import_urdf(options);
}

/* NULL, with the sentence said. */
static const struct import_format *cmd_import_format(const char *name)
{
    static const char *const also[] = { "arcm", "urdf", NULL };
    const struct import_format *format =
        strcmp(name, "arcm") == 0 ? &arcm_format : import_format_find(name);
    char message[YAML_MESSAGE_MAX];

    if (format != NULL && format->read != NULL)
        return format;
    import_format_unknown(name, also, message);
    (void)cmd_import_fail(message, "");
    return NULL;
}

static enum status cmd_import_run(const struct options *options)
{
    static struct rig rig;
    struct import_settings settings = { .rig = &rig };
    if (options->path_count > 0 && strcmp(options->path[0], "urdf") == 0)
        return cmd_import_limits(options);
    const struct import_format *format = cmd_import_format(options->path[0]);
    if (format == NULL)
        return STATUS_INPUT;
    if (options->path_count < 2)
        return cmd_import_fail("which file? expected FORMAT FILE", "");
    if (options->path_count > 2) {
        error_say("slew import: one argument too many: %s; see slew import "
                  "--help",
                  options->path[2]);
        return STATUS_INPUT;
    }
    if (options->rig == NULL)
        return cmd_import_fail("for which axes? expected --rig RIG", "");
    if (options->out == NULL)
        return cmd_import_fail("where to? expected --out MOVE.yaml", "");
    enum status status = planning_rig(options->rig, &rig);
    if (status == STATUS_OK)
        status = cmd_import_settings(&settings, options);
    return status == STATUS_OK ? cmd_import_file(format, &settings, options)
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
      "what each column is, - for no axis: frame,pan,-,tilt" },
    { "decimal", "MARK", OPTION_TEXT, offsetof(struct options, decimal),
      "point, or comma: 0,5 is a half" },
    { "unwrap", NULL, OPTION_FLAG, offsetof(struct options, unwrap),
      "a jump of nearly a turn is the turn that was cut off" },
    { "scale", "LIST", OPTION_TEXT, offsetof(struct options, scale),
      "positions times so much: 10, or pan=-1,slide=25.4" },
    { "offset", "LIST", OPTION_TEXT, offsetof(struct options, offset),
      "and so much added: '120 mm', or slide=120mm,pan=-90deg" },
    { "curve", "CURVE", OPTION_TEXT, offsetof(struct options, curve),
      "through positions: else quintic, or what keeps inside the limits" },
    OPTIONS_COMMON,
};

const struct command cmd_import = {
    .name = "import",
    .arguments = "FORMAT FILE [FILE]",
    .path_max = 3,
    .summary = "read a move of another program",
    .text =
        "Reads kuper, flair, raw or arcm (Dragonframe), csv, maya (.anim),\n"
        "blender (JSON of examples/blender), ros-yaml or ros-json\n"
        "(JointTrajectory) and writes a move file.  Columns find their axes by "
        "name, or by\n"
        "--columns, which says of every one of them what it is: an axis\n"
        "(pan, pan_rad, 'pan (rad)'), a velocity (pan_deg_s), the time\n"
        "(frame, t, 't (ms)', timecode), - for none.  What became of each is\n"
        "printed, with its unit, scale and offset.  An axis that breaks a\n"
        "limit of the rig is named, with the curve that was taken or would\n"
        "pass, or the row that cannot be meant.  docs/FORMATS.md says what is\n"
        "read and what is lost.\n\n"
        "urdf reads limits of position and velocity from a robot description,\n"
        "and those of MoveIt from a joint_limits.yaml behind it, into the "
        "text\n"
        "of a rig file, whose axes have the joints' names; and the geometry "
        "of\n"
        "the arm into kinematics, where the rig has none.  Comments and all\n"
        "else stay.\n",
    .examples =
        "  slew import kuper shot.txt --rig rig.yaml --fps 24 --out move.yaml\n"
        "  slew import raw shot.txt --rig rig.yaml --fps 24 --columns pan,tilt "
        "--out move.yaml\n"
        "  slew import csv shot.csv --rig rig.yaml --decimal comma --unwrap "
        "--scale slide=10 --out move.yaml\n"
        "  slew import urdf arm.urdf joint_limits.yaml --rig rig.yaml --out "
        "rig.yaml\n",
    COMMAND_OPTIONS(cmd_import_option),
    .run = cmd_import_run,
};
