/* firmware/linux/commands/cmd_fit.c - slew fit: the times of keys at which a
 * move is inside its limits, into the move file. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/move/job.h"
#include "firmware/host/move/job_fit.h"
#include "firmware/host/move/move_text.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/planning.h"
#include "motion/core/clock_warp.h"
#include "motion/core/err.h"

struct cmd_fit {
    struct job job;
    struct plan_limit *limit; /* of each axis */
    struct plan_fit fit;
    enum plan_fit_method method;
    struct move_text text;
    const char *to; /* file */
    bool dry_run;
};

static const char *const cmd_fit_method[] = { "stretch", "local" };

static int64_t cmd_fit_end(const struct cmd_fit *self, bool after)
{
    const struct plan_fit *fit = &self->fit;

    return (after ? fit->to_ns_q12 : fit->from_ns_q12)[fit->knots - 1];
}

/* --- what changed ------------------------------------------------------------ */

typedef void cmd_fit_key(const struct cmd_fit *self, unsigned axis,
                         uint32_t key, void *to);

static void cmd_fit_each(const struct cmd_fit *self, cmd_fit_key *tell,
                         void *to)
{
    for (unsigned a = 0; a < self->fit.axis_count; a++) {
        const struct plan_axis *was = &self->job.move.axis[a];
        for (uint32_t i = 0; i < was->key_count; i++)
            if (self->fit.axis[a].key[i].key.t_ns_q12 !=
                was->key[i].key.t_ns_q12)
                tell(self, a, i, to);
    }
}

static void cmd_fit_row(const struct cmd_fit *self, unsigned axis, uint32_t key,
                        void *to)
{
    const struct plan_axis *was = &self->job.move.axis[axis];
    char before[NUMBER_MAX], after[NUMBER_MAX];

    number_seconds(before, was->key[key].key.t_ns_q12);
    number_seconds(after, self->fit.axis[axis].key[key].key.t_ns_q12);
    table_cell(to, "%s", was->name);
    table_cell(to, "%u", key + 1);
    table_cell(to, "%u", was->key[key].place.line);
    table_cell(to, "%s s", before);
    table_cell(to, "%s s", after);
}

static void cmd_fit_text(const struct cmd_fit *self)
{
    static const char *const head[] = { "<axis", ">key", ">line", ">before",
                                        ">after" };
    char before[NUMBER_MAX], after[NUMBER_MAX];
    struct table table;

    number_seconds(before, cmd_fit_end(self, false));
    number_seconds(after, cmd_fit_end(self, true));
    if (self->text.changed == 0) {
        printf("within all limits, %s s; nothing is changed\n", before);
        return;
    }
    printf("fits in %s s, was %s s; %u %s of %s\n", after, before,
           self->text.changed,
           number_word(self->text.changed, "value", "values"),
           self->job.move_path);
    table_init(&table, 5, head);
    cmd_fit_each(self, cmd_fit_row, &table);
    table_print(&table, stdout);
    table_free(&table);
    if (self->job.move.events > 0)
        puts("Events at a time stay at theirs.");
    if (self->dry_run)
        puts("Nothing is written (--dry-run).");
    else
        printf("written to %s\n", self->to);
}

static void cmd_fit_item(const struct cmd_fit *self, unsigned axis,
                         uint32_t key, void *to)
{
    const struct plan_axis *was = &self->job.move.axis[axis];
    cJSON *const item = cJSON_CreateObject();

    cJSON_AddStringToObject(item, "axis", was->name);
    cJSON_AddNumberToObject(item, "key", key + 1);
    cJSON_AddNumberToObject(item, "line", was->key[key].place.line);
    cJSON_AddNumberToObject(
        item, "before_s", number_double(was->key[key].key.t_ns_q12, 12) / 1e9);
    cJSON_AddNumberToObject(
        item, "after_s",
        number_double(self->fit.axis[axis].key[key].key.t_ns_q12, 12) / 1e9);
    cJSON_AddItemToArray(to, item);
}

static void cmd_fit_json(const struct cmd_fit *self)
{
    cJSON *const report = cJSON_CreateObject();

    cJSON_AddBoolToObject(report, "ok", true);
    cJSON_AddStringToObject(report, "method", cmd_fit_method[self->method]);
    cJSON_AddNumberToObject(report, "duration_before_s",
                            number_double(cmd_fit_end(self, false), 12) / 1e9);
    cJSON_AddNumberToObject(report, "duration_s",
                            number_double(cmd_fit_end(self, true), 12) / 1e9);
    cJSON_AddNumberToObject(report, "values_changed", self->text.changed);
    if (!self->dry_run && self->text.changed > 0)
        cJSON_AddStringToObject(report, "written", self->to);
    cmd_fit_each(self, cmd_fit_item, cJSON_AddArrayToObject(report, "keys"));
    json_print(report, stdout);
}

/* --- solve, judge, write ------------------------------------------------------ */

static enum status cmd_fit_refuse(const struct cmd_fit *self,
                                  const struct plan_error *error)
{
    const char *const text =
        error->text[0] != 0 ? error->text : motion_err_text(error->code);

    if (error->place.line > 0)
        error_say("%s:%u:%u: %s", self->job.move_path, error->place.line,
                  error->place.column, text);
    else
        error_say("%s: %s", self->job.move_path, text);
    return error->code == MOTION_E_LIMIT ? STATUS_REFUSED : STATUS_INPUT;
}

static enum status cmd_fit_solve(struct cmd_fit *self)
{
    struct plan_fit_request request = { &self->job.move, NULL, self->method };
    struct plan_error error;

    self->limit = memory_new(self->job.move.axis_count, sizeof *self->limit);
    self->job.rate_q30 = MOTION_CLOCK_WARP_ONE_Q30;
    for (unsigned a = 0; a < self->job.move.axis_count; a++)
        job_fit_limit(&self->job, a, &self->limit[a]);
    request.limit = self->limit;
    if (plan_fit_solve(&request, &self->fit, &error) < 0)
        return cmd_fit_refuse(self, &error);
    return STATUS_OK;
}

/* The new text is read, planned and judged as any move before it takes the
 * place of the old one. */
static enum status cmd_fit_prove(const struct cmd_fit *self)
{
    struct move_text_files over;
    struct job *job = memory_new(1, sizeof *job);
    enum status status;

    move_text_over(&over, &disk_files, self->job.move_path, &self->text);
    status = job_open(job, &over.files, self->job.rig_path, self->job.move_path,
                      false, NULL);
    if (status == STATUS_OK) {
        job_check(job, MOTION_CLOCK_WARP_ONE_Q30);
        if (job->violation_count > 0)
            status = STATUS_SYSTEM;
    }
    if (status != STATUS_OK) {
        error_tell(&job->messages);
        error_say("%s: the new times do not read as they were planned; nothing "
                  "is written",
                  self->job.move_path);
    }
    job_free(job);
    memory_free(job);
    return status == STATUS_OK ? STATUS_OK : STATUS_SYSTEM;
}

static enum status cmd_fit_write(const struct cmd_fit *self)
{
    struct output output;

    if (output_open(&output, self->to) < 0)
        return STATUS_SYSTEM;
    fwrite(self->text.data, 1, self->text.length, output.file);
    return output_commit(&output) < 0 ? STATUS_SYSTEM : STATUS_OK;
}

static enum status cmd_fit_change(struct cmd_fit *self)
{
    char message[YAML_MESSAGE_MAX];
    enum status status;

    if (move_text_retime(&disk_files, self->job.move_path, &self->job.rig,
                         &self->job.move, &self->fit, &self->text,
                         message) < 0) {
        error_say("%s", message);
        return STATUS_INPUT;
    }
    status = cmd_fit_prove(self);
    const bool elsewhere = strcmp(self->to, self->job.move_path) != 0;
    if (status == STATUS_OK && !self->dry_run &&
        (self->text.changed > 0 || elsewhere))
        status = cmd_fit_write(self);
    return status;
}

static enum status cmd_fit_job(struct cmd_fit *self,
                               const struct options *options)
{
    enum status status =
        planning_open(&self->job, options->path, options->path_count, false);

    if (status != STATUS_OK)
        return status;
    self->to = options->out != NULL ? options->out : self->job.move_path;
    status = cmd_fit_solve(self);
    if (status == STATUS_OK)
        status = cmd_fit_change(self);
    if (status != STATUS_OK)
        return status;
    if (options->json)
        cmd_fit_json(self);
    else
        cmd_fit_text(self);
    return STATUS_OK;
}

static int cmd_fit_find_method(const char *name, enum plan_fit_method *method)
{
    *method = PLAN_FIT_LOCAL;
    if (name == NULL)
        return 0;
    for (unsigned i = 0; i < ARRAY_LEN(cmd_fit_method); i++) {
        *method = (enum plan_fit_method)i;
        if (strcmp(name, cmd_fit_method[i]) == 0)
            return 0;
    }
    error_say(
        "slew fit: --method %s is not a method, expected stretch or local",
        name);
    return -1;
}

static enum status cmd_fit_run(const struct options *options)
{
    enum plan_fit_method method;
    struct cmd_fit *self;
    enum status status;

    if (cmd_fit_find_method(options->method, &method) < 0)
        return STATUS_INPUT;
    self = memory_new(1, sizeof *self);
    self->method = method;
    self->dry_run = options->dry_run;
    status = cmd_fit_job(self, options);
    move_text_free(&self->text);
    plan_fit_free(&self->fit);
    memory_free(self->limit);
    job_free(&self->job);
    memory_free(self);
    return status;
}

static const struct option_row cmd_fit_option[] = {
    { "method", "NAME", OPTION_TEXT, offsetof(struct options, method),
      "stretch: all spans by one factor; local (default): the spans that need "
      "it" },
    { "output", "FILE", OPTION_TEXT, offsetof(struct options, out),
      "write there, and leave the move file as it is" },
    OPTIONS_DRY_RUN("show what would change, and write nothing"),
    OPTIONS_COMMON,
};

const struct command cmd_fit = {
    .name = "fit",
    .arguments = "RIG MOVE | DIRECTORY",
    .summary = "give a move the time that its limits need",
    .text =
        "Finds times of the keys at which no limit of velocity, acceleration\n"
        "or jerk is broken, and writes them into the move file, where the old\n"
        "ones stand; comments and layout stay.  Velocities, accelerations and\n"
        "handles that keys give go with the time; positions never change.  A\n"
        "key with fixed: time, value or both keeps that.  A span is the time\n"
        "between two neighbouring keys of any axis, so that keys of several\n"
        "axes at one time stay together; local never takes longer than "
        "stretch.\n"
        "\n"
        "A step of velocity or acceleration, or a position out of its range,\n"
        "is not removed by time: such a move is refused, as is one with a\n"
        "path, a camera, a blend, layers, a fade, a warp or cycles.\n",
    .examples = "  slew fit --dry-run examples/dolly\n"
                "  slew fit rig.yaml move.yaml\n"
                "  slew fit --method stretch --output slow.yaml rig.yaml "
                "move.yaml\n",
    COMMAND_OPTIONS(cmd_fit_option),
    .run = cmd_fit_run,
};
