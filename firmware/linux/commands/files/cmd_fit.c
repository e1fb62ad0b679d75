/* firmware/linux/commands/files/cmd_fit.c - slew fit: a move that is inside its
 * limits, into the move file. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/job/compare.h"
#include "firmware/host/job/repair.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/picture.h"
#include "firmware/linux/commands/planning.h"

struct cmd_fit {
    struct job job;
    struct repair repair;
    const char *to; /* file */
    const char *plot;
    bool dry_run;
};

static int64_t cmd_fit_end(const struct cmd_fit *self, bool after)
{
    const struct job *job =
        after && self->repair.after != NULL ? self->repair.after : &self->job;

    return job->end_ns_q12;
}

/* --- what changed ------------------------------------------------------------ */

typedef void cmd_fit_key(const struct cmd_fit *self, unsigned axis,
                         uint32_t key, void *to);

static void cmd_fit_each(const struct cmd_fit *self, cmd_fit_key *tell,
                         void *to)
{
    const struct plan_fit *fit = &self->repair.fit;

    for (unsigned a = 0; self->repair.has_fit && a < fit->axis_count; a++) {
        const struct plan_axis *was = &self->job.move.axis[a];
        for (uint32_t i = 0; i < was->key_count; i++)
            if (fit->axis[a].key[i].key.t_ns_q12 != was->key[i].key.t_ns_q12 ||
                fit->axis[a].key[i].key.pos_q32 != was->key[i].key.pos_q32)
                tell(self, a, i, to);
    }
}

/* What the method changes of a key: its time, or its position. */
static void cmd_fit_cell(const struct cmd_fit *self, unsigned axis,
                         const struct plan_key *key, struct table *table)
{
    char number[NUMBER_MAX], unit[NUMBER_UNIT_MAX];

    if (self->repair.method != REPAIR_SMOOTH) {
        number_seconds(number, key->key.t_ns_q12);
        table_cell(table, "%s s", number);
        return;
    }
    number_fixed(number, key->key.pos_q32, 32, 6);
    table_cell(table, "%s %s", number,
               number_unit(unit, job_rig_axis(&self->job, axis)->unit, 0));
}

static void cmd_fit_row(const struct cmd_fit *self, unsigned axis, uint32_t key,
                        void *to)
{
    const struct plan_axis *was = &self->job.move.axis[axis];

    table_cell(to, "%s", was->name);
    table_cell(to, "%u", key + 1);
    table_cell(to, "%u", was->key[key].place.line);
    cmd_fit_cell(self, axis, &was->key[key], to);
    cmd_fit_cell(self, axis, &self->repair.fit.axis[axis].key[key], to);
}

/* A value as it was replaced, or what an entry that is new says. */
static const char *cmd_fit_value(char text[YAML_TEXT_VALUE_MAX],
                                 const char *edited)
{
    snprintf(text, YAML_TEXT_VALUE_MAX, "%s", edited[0] != 0 ? edited : "-");
    text[strcspn(text, ",\r\n")] = 0;
    return text;
}

/* Of keys what they are; of anything else the values that were replaced. */
static void cmd_fit_table(const struct cmd_fit *self)
{
    static const char *const keys[] = { "<axis", ">key", ">line", ">before",
                                        ">after" };
    static const char *const values[] = { ">line", "<what", ">before",
                                          ">after" };
    const struct move_text *text = &self->repair.text;
    char value[YAML_TEXT_VALUE_MAX];
    struct table table;

    table_init(&table, self->repair.has_fit ? 5 : 4,
               self->repair.has_fit ? keys : values);
    cmd_fit_each(self, cmd_fit_row, &table);
    for (uint32_t i = 0; !self->repair.has_fit && i < text->changed; i++) {
        const struct yaml_text_edit *edit = &text->edit[i];
        table_cell(&table, "%u", edit->line);
        table_cell(&table, "%s", edit->what);
        table_cell(&table, "%s", cmd_fit_value(value, edit->was));
        table_cell(&table, "%s", cmd_fit_value(value, edit->is));
    }
    table_print(&table, stdout);
    table_free(&table);
}

static void cmd_fit_text(const struct cmd_fit *self)
{
    const uint32_t changed = self->repair.text.changed;
    char before[NUMBER_MAX], after[NUMBER_MAX];

    number_seconds(before, cmd_fit_end(self, false));
    number_seconds(after, cmd_fit_end(self, true));
    if (changed == 0) {
        printf("within all limits, %s s; nothing is changed\n", before);
        return;
    }
    printf("fits in %s s, was %s s; %u %s of %s\n", after, before, changed,
           number_word(changed, "value", "values"), self->job.move_path);
    cmd_fit_table(self);
    if (self->job.move.events > 0 && self->repair.method != REPAIR_SMOOTH)
        puts("Events at a time stay at theirs.");
    if (self->dry_run)
        puts("Nothing is written (--dry-run).");
    else
        printf("written to %s\n", self->to);
}

static void cmd_fit_item(const struct cmd_fit *self, unsigned axis,
                         uint32_t key, void *to)
{
    const struct plan_key *was = &self->job.move.axis[axis].key[key];
    const struct plan_key *is = &self->repair.fit.axis[axis].key[key];
    cJSON *const item = cJSON_CreateObject();

    cJSON_AddStringToObject(item, "axis", self->job.move.axis[axis].name);
    cJSON_AddNumberToObject(item, "key", key + 1);
    cJSON_AddNumberToObject(item, "line", was->place.line);
    cJSON_AddNumberToObject(item, "before_s",
                            number_double(was->key.t_ns_q12, 12) / 1e9);
    cJSON_AddNumberToObject(item, "after_s",
                            number_double(is->key.t_ns_q12, 12) / 1e9);
    cJSON_AddNumberToObject(item, "before",
                            number_double(was->key.pos_q32, 32));
    cJSON_AddNumberToObject(item, "after", number_double(is->key.pos_q32, 32));
    cJSON_AddItemToArray(to, item);
}

static void cmd_fit_json_values(const struct cmd_fit *self, cJSON *list)
{
    const struct move_text *text = &self->repair.text;
    char value[YAML_TEXT_VALUE_MAX];

    for (uint32_t i = 0; i < text->changed; i++) {
        const struct yaml_text_edit *edit = &text->edit[i];
        cJSON *const item = cJSON_CreateObject();
        cJSON_AddNumberToObject(item, "line", edit->line);
        cJSON_AddStringToObject(item, "what", edit->what);
        cJSON_AddStringToObject(item, "before",
                                cmd_fit_value(value, edit->was));
        cJSON_AddStringToObject(item, "after", cmd_fit_value(value, edit->is));
        cJSON_AddItemToArray(list, item);
    }
}

static cJSON *cmd_fit_json(const struct cmd_fit *self)
{
    cJSON *const report = cJSON_CreateObject();

    cJSON_AddStringToObject(report, "method",
                            repair_words[self->repair.method]);
    cJSON_AddNumberToObject(report, "duration_before_s",
                            number_double(cmd_fit_end(self, false), 12) / 1e9);
    cJSON_AddNumberToObject(report, "duration_s",
                            number_double(cmd_fit_end(self, true), 12) / 1e9);
    cJSON_AddNumberToObject(report, "values_changed",
                            self->repair.text.changed);
    if (!self->dry_run && self->repair.text.changed > 0)
        cJSON_AddStringToObject(report, "written", self->to);
    cmd_fit_each(self, cmd_fit_item, cJSON_AddArrayToObject(report, "keys"));
    cmd_fit_json_values(self, cJSON_AddArrayToObject(report, "values"));
    return report;
}

/* --- solve and write ---------------------------------------------------------- */

/* Nothing has to change: the file as it is. */
static int cmd_fit_same(const struct cmd_fit *self, struct output *output)
{
    char *data = NULL;
    const int64_t length = files_load(&disk_files, self->job.move_path,
                                      YAML_TREE_BYTES_MAX, &data);

    if (length > 0)
        fwrite(data, 1, (size_t)length, output->file);
    free(data);
    return length < 0 ? -1 : 0;
}

static enum status cmd_fit_write(const struct cmd_fit *self)
{
    const struct move_text *text = &self->repair.text;
    const bool elsewhere = strcmp(self->to, self->job.move_path) != 0;
    struct output output;

    if (self->dry_run || (text->changed == 0 && !elsewhere))
        return STATUS_OK;
    if (output_open(&output, self->to) < 0)
        return STATUS_SYSTEM;
    if (text->data != NULL)
        fwrite(text->data, 1, text->length, output.file);
    else if (cmd_fit_same(self, &output) < 0)
        return error_file(self->job.move_path, "cannot be read again");
    return output_commit(&output) < 0 ? STATUS_SYSTEM : STATUS_OK;
}

/* Takes the tracks, so that all else has been said before. */
static enum status cmd_fit_draw(struct cmd_fit *self, cJSON *report)
{
    if (self->plot == NULL)
        return STATUS_OK;
    if (self->repair.after != NULL)
        compare_repaired(&self->job, self->repair.after);
    if (picture_of_job(&self->job, NULL, self->plot) < 0)
        return STATUS_SYSTEM;
    if (report != NULL)
        cJSON_AddStringToObject(report, "picture", self->plot);
    else
        printf("picture: %s\n", self->plot);
    return STATUS_OK;
}

static enum status cmd_fit_fail(const char *what)
{
    error_say("slew fit: %s", what);
    return STATUS_INPUT;
}

static enum status cmd_fit_method(struct cmd_fit *self,
                                  const struct options *options)
{
    const char *const name = options->method;
    enum repair_method *const method = &self->repair.method;

    *method = repair_default(&self->job);
    for (unsigned i = 0; name != NULL && i < REPAIR_METHODS; i++)
        if (strcmp(name, repair_words[i]) == 0)
            *method = (enum repair_method)i;
    if (*method != REPAIR_SMOOTH)
        return options->tolerance == NULL
                   ? STATUS_OK
                   : cmd_fit_fail("--tolerance: is for --method smooth");
    if (options->tolerance == NULL)
        return cmd_fit_fail("--method smooth: how far may a key be moved? "
                            "expected --tolerance, such as '1 mm' or '1 mm, "
                            "0.1 deg'");
    return repair_tolerance(&self->repair, options->tolerance);
}

static enum status cmd_fit_job(struct cmd_fit *self,
                               const struct options *options)
{
    enum status status =
        planning_open(&self->job, options->path, options->path_count, false);

    if (status != STATUS_OK)
        return status;
    self->to = options->out != NULL ? options->out : self->job.move_path;
    self->repair.on_frames = options->frames;
    if (options->frames && self->job.move.fps_den == 0)
        return cmd_fit_fail("--frames: the move has no frame rate, expected "
                            "such as fps: 24 in it");
    status = cmd_fit_method(self, options);
    if (status == STATUS_OK)
        status = repair_solve(&self->repair, &disk_files);
    error_tell(&self->job.messages);
    if (status == STATUS_OK)
        status = cmd_fit_write(self);
    if (status != STATUS_OK)
        return status;
    cJSON *const report = options->json ? cmd_fit_json(self) : NULL;
    if (report == NULL)
        cmd_fit_text(self);
    status = cmd_fit_draw(self, report);
    if (report != NULL)
        json_report(report, status == STATUS_OK);
    return status;
}

static enum status cmd_fit_check(const struct options *options)
{
    bool found = options->method == NULL;

    for (unsigned i = 0; !found && i < REPAIR_METHODS; i++)
        found = strcmp(options->method, repair_words[i]) == 0;
    if (!found) {
        error_say("slew fit: --method %s is not a method, expected stretch, "
                  "local, smooth or speed",
                  options->method);
        return STATUS_INPUT;
    }
    if (options->plot != NULL && plot_format_of(options->plot) < 0)
        return cmd_fit_fail("--plot: expected FILE.svg or FILE.png");
    return STATUS_OK;
}

static enum status cmd_fit_run(const struct options *options)
{
    enum status status = cmd_fit_check(options);
    struct cmd_fit *self;

    if (status != STATUS_OK)
        return status;
    self = memory_new(1, sizeof *self);
    self->repair.before = &self->job;
    self->plot = options->plot;
    self->dry_run = options->dry_run;
    status = cmd_fit_job(self, options);
    repair_free(&self->repair);
    job_free(&self->job);
    memory_free(self);
    return status;
}

static const struct option_row cmd_fit_option[] = {
    { "method", "NAME", OPTION_TEXT, offsetof(struct options, method),
      "local: the spans between keys that need it; stretch: all by one factor; "
      "smooth: positions of keys; speed: that of the path" },
    { "tolerance", "LIST", OPTION_TEXT, offsetof(struct options, tolerance),
      "with smooth, how far a key may be moved: '1 mm' or '1 mm, 0.1 deg'" },
    { "frames", NULL, OPTION_FLAG, offsetof(struct options, frames),
      "keep keys on whole frames of the move's fps" },
    { "output", "FILE", OPTION_TEXT, offsetof(struct options, out),
      "write there, and leave the move file as it is" },
    { "plot", "FILE", OPTION_TEXT, offsetof(struct options, plot),
      "draw every axis before and after, .svg or .png by its name" },
    OPTIONS_DRY_RUN("show what would change, and write nothing"),
    OPTIONS_COMMON,
};

const struct command cmd_fit = {
    .name = "fit",
    .arguments = "RIG MOVE | DIRECTORY",
    .summary = "bring a move inside its limits",
    .text =
        "Finds a move at which no limit of velocity, acceleration or jerk is\n"
        "broken, and writes it into the move file, where the old values "
        "stand;\n"
        "comments and layout stay.  What changed is listed.\n"
        "\n"
        "local and stretch change times of keys, and with them velocities,\n"
        "accelerations and handles, never a position; keys of several axes at\n"
        "one time stay together, and local never takes longer than stretch.\n"
        "Where a move has more than keys (a path, a camera, layers ...),\n"
        "stretch writes a duration, at which all of it is played.  smooth\n"
        "changes positions of keys around a violation, never a time; speed\n"
        "changes the speeds and times of a path's speed law.  A key with\n"
        "fixed: time, value or both keeps that.  Without --method: local, or\n"
        "stretch where a move has more than keys.\n"
        "\n"
        "Where the curve leaves its range between keys that keep it, the key\n"
        "at which it turns gets the velocity 0.  A step of velocity or\n"
        "acceleration, or a key out of its range, is not removed by time: "
        "such\n"
        "a move is refused.\n",
    .examples = "  slew fit --dry-run examples/dolly\n"
                "  slew fit rig.yaml move.yaml\n"
                "  slew fit --method stretch --output slow.yaml rig.yaml "
                "move.yaml\n"
                "  slew fit --method smooth --tolerance '1 mm' --plot both.svg "
                "rig.yaml move.yaml\n",
    COMMAND_OPTIONS(cmd_fit_option),
    .run = cmd_fit_run,
};
