/* firmware/linux/commands/files/cmd_report.c - slew report: how a run went, from
 * its recording. */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/recording/figures.h"
#include "firmware/host/recording/record_read.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "motion/core/fixed.h"

#define CMD_REPORT_NOTES 1024 /* later ones are only counted */

struct cmd_report_note {
    int64_t t_ns;
    enum record_level level;
    char text[RECORD_TEXT_MAX];
};

struct cmd_report {
    const char *path;
    struct record_file file;
    struct figures figures;
    struct cmd_report_note *note;
    unsigned notes;
};

static void cmd_report_row(void *context, const struct telemetry_row *row)
{
    struct cmd_report *self = context;
    if (self->figures.rows == 0) /* what was planned comes before the rows */
        self->figures.period_ns =
            record_integer(self->file.plan, self->file.plan_count, "period_ns");
    figures_take(&self->figures, row);
}

/* Keep notes in the order of time: a fault whose reason came later is written later. */
static void cmd_report_note(void *context, int64_t t_ns,
                            enum record_level level, const char *text)
{
    struct cmd_report *self = context;
    if (self->notes < CMD_REPORT_NOTES) {
        struct cmd_report_note *note = &self->note[self->notes];
        for (; note > self->note && note[-1].t_ns > t_ns; note--)
            note[0] = note[-1];
        *note = (struct cmd_report_note){ .t_ns = t_ns, .level = level };
        snprintf(note->text, sizeof note->text, "%s", text);
    }
    self->notes++;
}

static const char *cmd_report_plan(const struct cmd_report *self,
                                   const char *key)
{
    return record_value(self->file.plan, self->file.plan_count, key);
}

static const char *cmd_report_end(const struct cmd_report *self,
                                  const char *key)
{
    return record_value(self->file.end, self->file.end_count, key);
}

/* --- for people --- */

static void cmd_report_value(struct table *table, int64_t value)
{
    char text[NUMBER_MAX];
    number_short(text, value, 32);
    table_cell(table, "%s", text);
}

static void cmd_report_axis(struct table *table, const struct cmd_report *self,
                            unsigned i)
{
    const struct rig_axis *rig = &self->file.rig.axis[i];
    const struct figures_axis *axis = figures_of(&self->figures, i);
    char at[NUMBER_MAX];
    table_cell(table, "%s", rig->name);
    table_cell(table, "%s", units_axis_text(rig->unit));
    cmd_report_value(table, (int64_t)motion_fixed_abs(axis->following_q32));
    number_seconds(at, axis->following_at_ns * MOTION_FIXED_NS_Q12);
    table_cell(table, "%s s", at);
    table_cell(table, "%.4g", figures_rms(&self->figures, i));
    cmd_report_value(table, axis->end_following_q32);
    for (unsigned order = 1; order <= 3; order++)
        cmd_report_value(table, axis->peak[order]);
}

static void cmd_report_table(const struct cmd_report *self)
{
    static const char *const head[] = {
        "<axis", "<unit",        ">following error",  ">at",       ">rms",
        ">end",  ">velocity /s", ">acceleration /s2", ">jerk /s3",
    };
    struct table table;
    table_init(&table, 9, head);
    for (unsigned i = 0; i < self->file.rig.axis_count; i++)
        cmd_report_axis(&table, self, i);
    table_print(&table, stdout);
    table_free(&table);
}

static void cmd_report_clock(const struct cmd_report *self)
{
    const struct figures *figures = &self->figures;
    printf("rows: %" PRIu64 ", %" PRIu64 " missing\n", self->file.rows,
           self->file.rows_missing);
    if (self->file.damaged > 0)
        printf("damaged: %u %s passed over, whose rows are missing\n",
               self->file.damaged,
               number_word(self->file.damaged, "chunk was", "chunks were"));
    if (strcmp(cmd_report_end(self, "realtime"), "0") == 0)
        return;
    printf("clock: %" PRIu64 " %s lost; wake-ups at most %.3f ms late, "
           "99 %% at most %.3f ms\n",
           figures->ticks_lost,
           number_word(figures->ticks_lost, "tick", "ticks"),
           (double)figures->late_ns / 1e6,
           (double)figures_late_ns(figures, 990) / 1e6);
}

static void cmd_report_notes(const struct cmd_report *self)
{
    static const char *const word[] = { [RECORD_INFO] = "",
                                        [RECORD_WARNING] = "warning: ",
                                        [RECORD_ERROR] = "fault: " };
    for (unsigned i = 0; i < self->notes && i < CMD_REPORT_NOTES; i++) {
        const struct cmd_report_note *note = &self->note[i];
        printf("  %10.3f s  %s%s\n", (double)note->t_ns / 1e9,
               word[note->level], note->text);
    }
    if (self->notes > CMD_REPORT_NOTES)
        printf("  and %u more\n", self->notes - CMD_REPORT_NOTES);
}

static void cmd_report_print(const struct cmd_report *self)
{
    const char *title = cmd_report_plan(self, "title");
    const double played_s =
        (double)self->figures.phase_ns[TELEMETRY_MOVE] / 1e9;
    printf("%s%s%s\n", title, title[0] != 0 ? " - " : "",
           cmd_report_plan(self, "rig_title"));
    printf("%s, the move %s%.3f s\n\n",
           self->file.ended
               ? cmd_report_end(self, "end")
               : "the recording has no end: it was cut, or is still written",
           self->file.ended ? "took " : "so far ", played_s);
    if (self->figures.moved)
        cmd_report_table(self);
    else
        puts("the move did not begin");
    putchar('\n');
    cmd_report_clock(self);
    if (cmd_report_end(self, "reason")[0] != 0)
        printf("reason: %s\n", cmd_report_end(self, "reason"));
    cmd_report_notes(self);
}

/* --- for scripts --- */

static cJSON *cmd_report_json_axis(const struct cmd_report *self, unsigned i)
{
    static const char *const peak[] = { NULL, "peak_velocity",
                                        "peak_acceleration", "peak_jerk" };
    const struct rig_axis *rig = &self->file.rig.axis[i];
    const struct figures_axis *axis = figures_of(&self->figures, i);
    cJSON *item = cJSON_CreateObject();
    cJSON_AddStringToObject(item, "name", rig->name);
    cJSON_AddStringToObject(item, "unit", units_axis_text(rig->unit));
    json_add_fixed(item, "following_error",
                   (int64_t)motion_fixed_abs(axis->following_q32), 32);
    cJSON_AddNumberToObject(item, "following_error_at_s",
                            (double)axis->following_at_ns / 1e9);
    cJSON_AddNumberToObject(item, "following_error_rms",
                            figures_rms(&self->figures, i));
    json_add_fixed(item, "following_error_at_end", axis->end_following_q32, 32);
    for (unsigned order = 1; order <= 3; order++)
        json_add_fixed(item, peak[order], axis->peak[order], 32);
    return item;
}

static void cmd_report_json_notes(const struct cmd_report *self, cJSON *object)
{
    static const char *const level[] = { [RECORD_INFO] = "info",
                                         [RECORD_WARNING] = "warning",
                                         [RECORD_ERROR] = "fault" };
    cJSON *list = cJSON_AddArrayToObject(object, "notes");
    for (unsigned i = 0; i < self->notes && i < CMD_REPORT_NOTES; i++) {
        cJSON *item = cJSON_CreateObject();
        cJSON_AddNumberToObject(item, "t_s", (double)self->note[i].t_ns / 1e9);
        cJSON_AddStringToObject(item, "level", level[self->note[i].level]);
        cJSON_AddStringToObject(item, "text", self->note[i].text);
        cJSON_AddItemToArray(list, item);
    }
}

static void cmd_report_json_phases(const struct cmd_report *self, cJSON *object)
{
    cJSON *phases = cJSON_AddObjectToObject(object, "phases_s");
    for (int p = 0; p < TELEMETRY_PHASES; p++)
        cJSON_AddNumberToObject(
            phases, telemetry_phase_spelling((enum telemetry_phase)p),
            (double)self->figures.phase_ns[p] / 1e9);
}

static void cmd_report_json_shots(const struct cmd_report *self, cJSON *object)
{
    cJSON *shots = cJSON_AddObjectToObject(object, "shots");
    for (uint32_t i = 0; i < self->file.rig.line_count; i++)
        cJSON_AddNumberToObject(shots, self->file.rig.line[i].name,
                                self->figures.shots[i]);
}

static void cmd_report_json(const struct cmd_report *self)
{
    const struct figures *figures = &self->figures;
    cJSON *object = cJSON_CreateObject();
    cJSON_AddBoolToObject(object, "ended", self->file.ended);
    cJSON_AddStringToObject(object, "end", cmd_report_end(self, "end"));
    cJSON_AddStringToObject(object, "title", cmd_report_plan(self, "title"));
    cJSON_AddStringToObject(object, "fault", cmd_report_end(self, "fault"));
    cJSON_AddStringToObject(object, "reason", cmd_report_end(self, "reason"));
    json_add_integer(object, "rows", (int64_t)self->file.rows);
    json_add_integer(object, "rows_missing", (int64_t)self->file.rows_missing);
    json_add_integer(object, "chunks_damaged", self->file.damaged);
    json_add_integer(object, "ticks_lost", (int64_t)figures->ticks_lost);
    cJSON_AddNumberToObject(object, "latest_s", (double)figures->late_ns / 1e9);
    cJSON_AddNumberToObject(object, "late_p99_s",
                            (double)figures_late_ns(figures, 990) / 1e9);
    cJSON_AddNumberToObject(object, "late_p999_s",
                            (double)figures_late_ns(figures, 999) / 1e9);
    cmd_report_json_phases(self, object);
    cJSON *axes = cJSON_AddArrayToObject(object, "axes");
    for (unsigned i = 0; i < self->file.rig.axis_count; i++)
        cJSON_AddItemToArray(axes, cmd_report_json_axis(self, i));
    cmd_report_json_shots(self, object);
    cmd_report_json_notes(self, object);
    json_report(object, true);
}

/* --- the command --- */

static enum status cmd_report_read(struct cmd_report *self)
{
    const struct record_taker taker = { cmd_report_row, cmd_report_note, self };
    char message[YAML_MESSAGE_MAX];
    figures_init(&self->figures, &self->file.rig, 0);
    if (record_read(&self->file, &disk_files, self->path, NULL, &taker,
                    message) == 0)
        return STATUS_OK;
    error_say("%s", message);
    return STATUS_INPUT;
}

static enum status cmd_report_run(const struct options *options)
{
    struct cmd_report *self = memory_new(1, sizeof *self);
    self->path = options->path[0];
    self->note = memory_new(CMD_REPORT_NOTES, sizeof *self->note);
    const enum status status = cmd_report_read(self);
    if (status == STATUS_OK && options->json)
        cmd_report_json(self);
    else if (status == STATUS_OK)
        cmd_report_print(self);
    record_file_free(&self->file);
    figures_free(&self->figures);
    memory_free(self->note);
    memory_free(self);
    return status;
}

static const struct option_row cmd_report_option[] = {
    OPTIONS_COMMON,
};

const struct command cmd_report = {
    .name = "report",
    .arguments = "RECORDING",
    .summary = "how a run went, from its recording",
    .text =
        "Reads what slew run --record wrote and says per axis how large the\n"
        "following error was, when, and its root mean square; the peaks of\n"
        "what was commanded; how late the ticks were; and all faults, events\n"
        "of drives and phases with their times.  A recording that was cut, or\n"
        "that is still being written, is read as far as it goes, and rows "
        "that\n"
        "are missing in it are counted.\n",
    .examples = "  slew report run.mcap\n"
                "  slew report --json run.mcap\n",
    .path_max = 1,
    COMMAND_OPTIONS(cmd_report_option),
    .run = cmd_report_run,
};
