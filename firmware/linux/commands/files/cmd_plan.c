/* firmware/linux/commands/files/cmd_plan.c - slew plan: from keys to tracks. */
#include <cjson/cJSON.h>
#include <inttypes.h>
#include <stdio.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/job/job.h"
#include "firmware/host/job/job_camera.h"
#include "firmware/host/job/job_shape.h"
#include "firmware/host/job/path_report.h"
#include "firmware/host/job/pictures.h"
#include "firmware/host/rig/modbus_budget.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/planning.h"
#include "motion/plan/plan_bound.h"
#include "motion/plan/plan_track.h"

static const char *const cmd_plan_curve[] = {
#define CMD_PLAN_CURVE(name, spelling, text) spelling,
    PLAN_CURVE_LIST(CMD_PLAN_CURVE)
#undef CMD_PLAN_CURVE
};

static const char *cmd_plan_curve_of(const struct plan_axis *axis)
{
    if (axis->profile.vel_q32 > 0)
        return "the drive's own";
    return axis->driver == PLAN_BY_KEYS ? cmd_plan_curve[axis->curve]
                                        : plan_driver_name(axis->driver);
}

/* "351.6 / 400   88 %" */
static void cmd_plan_peak(struct table *table, const struct job *job,
                          unsigned axis, enum motion_quantity quantity)
{
    const struct rig_axis *rig = job_rig_axis(job, axis);
    int64_t limit = job_limit_of(&rig->limit, quantity);
    int64_t peak = job_peak(&job->track[axis], quantity, NULL);
    char peak_text[NUMBER_MAX], limit_text[NUMBER_MAX];
    number_short(peak_text, peak, 32);
    number_short(limit_text, limit, 32);
    if (limit == 0)
        table_cell(table, "%s", peak_text);
    else
        table_cell(table, "%s / %s %4" PRId64 " %%", peak_text, limit_text,
                   number_percent(peak, limit));
}

static void cmd_plan_row(struct table *table, const struct job *job,
                         unsigned axis)
{
    const struct plan_axis *plan = &job->move.axis[axis];
    const struct motion_track *track = &job->track[axis];
    struct motion_extreme range;
    char low[NUMBER_MAX], high[NUMBER_MAX], t[NUMBER_MAX];
    plan_track_extreme(track, MOTION_POS, &range);
    number_seconds(t, track->end_ns_q12);
    number_short(low, range.min, 32);
    number_short(high, range.max, 32);
    table_cell(table, "%s", plan->name);
    table_cell(table, "%s", cmd_plan_curve_of(plan));
    if (plan->driver == PLAN_BY_KEYS)
        table_cell(table, "%u", plan->key_count);
    else
        table_cell(table, "-");
    table_cell(table, "%u", track->count);
    table_cell(table, "%s s", t);
    table_cell(table, "%s .. %s", low, high);
    table_cell(table, "%s", units_axis_text(job_rig_axis(job, axis)->unit));
    cmd_plan_peak(table, job, axis, MOTION_VEL);
    cmd_plan_peak(table, job, axis, MOTION_ACC);
    cmd_plan_peak(table, job, axis, MOTION_JERK);
}

/* Does the move end elsewhere than it starts? */
static bool cmd_plan_ends_elsewhere(const struct job *job)
{
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        struct motion_cursor cursor = { 0 };
        struct motion_sample start;
        motion_track_sample(&job->track[i], &cursor, 0, &start);
        if (start.pos_q32 != job->track[i].end.pos_q32)
            return true;
    }
    return false;
}

/* How often it is played, where that is not once. */
static void cmd_plan_times(const struct job *job)
{
    const struct plan_move *move = &job->move;

    if (move->times == 0 && !move->is_ping_pong)
        return;
    if (move->times < 0)
        fputs("played until it is stopped", stdout);
    else
        printf("played %d %s", move->times,
               number_word((uint64_t)move->times, "time", "times"));
    puts(move->is_ping_pong ? ", every second time in reverse"
         : cmd_plan_ends_elsewhere(job)
             ? "; it ends elsewhere than it starts: "
               "the axes go back before each next time"
             : "");
}

static void cmd_plan_text(const struct job *job)
{
    static const char *const head[] = {
        "<axis",     ">curve", ">keys",        ">segments",         ">duration",
        ">position", "<unit",  ">velocity /s", ">acceleration /s2", ">jerk /s3",
    };
    struct table table;
    table_init(&table, 10, head);
    for (unsigned i = 0; i < job->move.axis_count; i++)
        cmd_plan_row(&table, job, i);
    if (job->move.title[0] != 0)
        printf("%s\n\n", job->move.title);
    table_print(&table, stdout);
    table_free(&table);
    for (unsigned i = 0; i < job->rig.bus_count; i++)
        if (!rig_bus_is_can(&job->rig.bus[i]))
            modbus_budget_print(&job->rig, i, stdout);
    cmd_plan_times(job);
    path_report_text(job, stdout);
    job_shape_print(job, stdout);
    job_camera_text(job, stdout);
    pictures_text(job, stdout);
}

static void cmd_plan_segments(const struct job *job, unsigned axis)
{
    static const char *const head[] = {
        ">segment", ">start ns", ">duration ns", ">from",
        ">to",      ">degree",   ">frac",
    };
    const struct motion_track *track = &job->track[axis];
    struct table table;
    table_init(&table, 7, head);
    for (uint32_t i = 0; i < track->count; i++) {
        const struct motion_segment *segment = &track->segment[i];
        int64_t to = i + 1 < track->count ? track->segment[i + 1].pos_q32
                                          : track->end.pos_q32;
        char text[NUMBER_MAX];
        table_cell(&table, "%u", i);
        number_fixed(text, segment->start_ns_q12, 12, 3);
        table_cell(&table, "%s", text);
        number_fixed(text, segment->dur_ns_q12, 12, 3);
        table_cell(&table, "%s", text);
        number_fixed(text, segment->pos_q32, 32, 9);
        table_cell(&table, "%s", text);
        number_fixed(text, to, 32, 9);
        table_cell(&table, "%s", text);
        table_cell(&table, "%u", segment->degree);
        table_cell(&table, "%d", segment->frac);
    }
    printf("\n%s, %s\n", job->move.axis[axis].name,
           units_axis_text(job_rig_axis(job, axis)->unit));
    table_print(&table, stdout);
    table_free(&table);
}

static void cmd_plan_json_peak(cJSON *item, const char *name,
                               const struct job *job, unsigned axis,
                               enum motion_quantity quantity)
{
    int64_t t_ns_q12;
    int64_t peak = job_peak(&job->track[axis], quantity, &t_ns_q12);
    int64_t limit = job_limit_of(&job_rig_axis(job, axis)->limit, quantity);
    cJSON *object = cJSON_AddObjectToObject(item, name);
    json_add_fixed(object, "peak", peak, 32);
    cJSON_AddNumberToObject(object, "time_s",
                            number_double(t_ns_q12, 12) / 1e9);
    if (limit != 0)
        json_add_fixed(object, "limit", limit, 32);
}

static void cmd_plan_json(const struct job *job)
{
    cJSON *report = cJSON_CreateObject();
    cJSON_AddStringToObject(report, "title", job->move.title);
    cJSON_AddNumberToObject(report, "duration_s",
                            number_double(job->end_ns_q12, 12) / 1e9);
    if (job->move.times < 0)
        cJSON_AddStringToObject(report, "loop", "forever");
    else
        cJSON_AddNumberToObject(report, "loop",
                                job->move.times == 0 ? 1 : job->move.times);
    cJSON_AddBoolToObject(report, "ping_pong", job->move.is_ping_pong);
    job_json_hash(job, report);
    cJSON *axes = cJSON_AddArrayToObject(report, "axes");
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        const struct plan_axis *axis = &job->move.axis[i];
        cJSON *item = cJSON_CreateObject();
        cJSON_AddItemToArray(axes, item);
        cJSON_AddStringToObject(item, "name", axis->name);
        cJSON_AddStringToObject(item, "unit",
                                units_axis_text(job_rig_axis(job, i)->unit));
        cJSON_AddStringToObject(item, "curve", cmd_plan_curve_of(axis));
        cJSON_AddNumberToObject(item, "keys", axis->key_count);
        cJSON_AddNumberToObject(item, "segments", job->track[i].count);
        json_add_hash(item, "hash", plan_track_hash(&job->track[i]));
        cmd_plan_json_peak(item, "velocity", job, i, MOTION_VEL);
        cmd_plan_json_peak(item, "acceleration", job, i, MOTION_ACC);
        cmd_plan_json_peak(item, "jerk", job, i, MOTION_JERK);
    }
    path_report_json(job, report);
    job_shape_json(job, report);
    job_camera_json(job, report);
    pictures_json(job, report);
    json_report(report, true);
}

static void cmd_plan_save_segment(const struct motion_segment *segment,
                                  FILE *file)
{
    cJSON *item = cJSON_CreateObject();
    json_add_integer(item, "start_ns_q12", segment->start_ns_q12);
    json_add_integer(item, "dur_ns_q12", segment->dur_ns_q12);
    json_add_integer(item, "pos_q32", segment->pos_q32);
    json_add_integer(item, "frac", segment->frac);
    json_add_integer(item, "remainder", segment->remainder);
    cJSON *coef = cJSON_AddArrayToObject(item, "coef");
    for (int k = 0; k <= MOTION_TRACK_DEGREE; k++)
        cJSON_AddItemToArray(coef, json_integer(segment->coef[k]));
    json_print_line(item, file);
}

/* {"name": "pan", "unit": "deg" - a text with its quotes and escapes. */
static void cmd_plan_save_text(FILE *file, const char *name, const char *text)
{
    fprintf(file, "\"%s\": ", name);
    json_print_line(cJSON_CreateString(text), file);
}

static void cmd_plan_save_axis(const struct job *job, unsigned axis, FILE *file)
{
    const struct motion_track *track = &job->track[axis];
    fputs("{", file);
    cmd_plan_save_text(file, "name", job->move.axis[axis].name);
    fputs(", ", file);
    cmd_plan_save_text(file, "unit",
                       units_axis_text(job_rig_axis(job, axis)->unit));
    fprintf(file,
            ",\n  \"end_ns_q12\": %" PRId64 ", \"end_pos_q32\": %" PRId64
            ",\n  \"segments\": [",
            track->end_ns_q12, track->end.pos_q32);
    for (uint32_t i = 0; i < track->count; i++) {
        fputs(i == 0 ? "\n    " : ",\n    ", file);
        cmd_plan_save_segment(&track->segment[i], file);
    }
    fputs("] }", file);
}

/* One segment at a time, so that a million of them need no tree. */
static enum status cmd_plan_save(const struct job *job, const char *path)
{
    struct output output;
    if (output_open(&output, path) < 0)
        return STATUS_SYSTEM;
    fputs("{ \"format\": \"slew-tracks\", \"version\": 1,\n", output.file);
    cmd_plan_save_text(output.file, "title", job->move.title);
    fputs(",\n\"axes\": [\n", output.file);
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        cmd_plan_save_axis(job, i, output.file);
        fputs(i + 1 < job->move.axis_count ? ",\n" : "\n", output.file);
    }
    fputs("] }\n", output.file);
    return output_commit(&output) < 0 ? STATUS_SYSTEM : STATUS_OK;
}

static enum status cmd_plan_pictures(const struct job *job, const char *path)
{
    struct output output;

    if (job->move.shoot == NULL) {
        error_say("slew plan: --pictures: the move has no shoot, expected one "
                  "with it");
        return STATUS_INPUT;
    }
    if (output_open(&output, path) < 0)
        return STATUS_SYSTEM;
    pictures_csv(job, output.file);
    return output_commit(&output) < 0 ? STATUS_SYSTEM : STATUS_OK;
}

static enum status cmd_plan_job(struct job *job, const struct options *options)
{
    enum status status =
        planning_open(job, options->path, options->path_count, false);
    if (status != STATUS_OK)
        return status;
    if (options->out != NULL)
        status = cmd_plan_save(job, options->out);
    if (status == STATUS_OK && options->pictures != NULL)
        status = cmd_plan_pictures(job, options->pictures);
    if (status != STATUS_OK)
        return status;
    if (options->json)
        cmd_plan_json(job);
    else
        cmd_plan_text(job);
    if (options->rules && !options->json)
        path_report_rules(job, stdout);
    for (unsigned i = 0; i < job->move.axis_count; i++)
        if (options->segments && !options->json)
            cmd_plan_segments(job, i);
    return STATUS_OK;
}

static enum status cmd_plan_run(const struct options *options)
{
    struct job *job = memory_new(1, sizeof *job);
    enum status status = cmd_plan_job(job, options);
    job_free(job);
    memory_free(job);
    return status;
}

static const struct option_row cmd_plan_option[] = {
    { "segments", NULL, OPTION_FLAG, offsetof(struct options, segments),
      "print the segments of every axis" },
    { "rules", NULL, OPTION_FLAG, offsetof(struct options, rules),
      "print the length of the path by every rule, and what each costs" },
    { "out", "FILE", OPTION_TEXT, offsetof(struct options, out),
      "save the tracks as JSON, coefficients as integers" },
    { "pictures", "FILE", OPTION_TEXT, offsetof(struct options, pictures),
      "of a shoot: save when each picture opens and closes, and where the axes "
      "are then, as CSV" },
    OPTIONS_COMMON,
};

const struct command cmd_plan = {
    .name = "plan",
    .arguments = "RIG MOVE | DIRECTORY",
    .summary = "plan a move and say what came out",
    .text = "Plans every axis and prints how long it takes, where it goes, and "
            "its\n"
            "peaks against the limits.  Does not refuse a move that breaks a\n"
            "limit: slew check does.  For a path also its length, the largest "
            "speed "
            "along\nit, and how far at most the axes are from it.\n\n"
            "The saved file holds, per segment, the integers of "
            "motion/core/track.h:\n"
            "p(t) = pos + (c0 + c1 w + ... + c5 w^5) / 2^(32 + frac), with\n"
            "w = (t - start) / (2 dur).  They need 64 bits: read them as "
            "integers.\n",
    .examples = "  slew plan examples/dolly\n"
                "  slew plan --segments rig.yaml move.yaml\n"
                "  slew plan --out tracks.json examples/dolly\n"
                "  slew plan --pictures frames.csv examples/stopmotion\n",
    COMMAND_OPTIONS(cmd_plan_option),
    .run = cmd_plan_run,
};
