/* firmware/linux/commands/files/cmd_check.c - slew check: every limit violation of a
 * move, and whether the buses carry it. */
#include <cjson/cJSON.h>
#include <stdio.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/budget.h"
#include "firmware/host/job/job.h"
#include "firmware/host/job/job_shots.h"
#include "firmware/host/job/monitored.h"
#include "firmware/host/job/path_report.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/planning.h"
#include "firmware/linux/player/shots.h"
#include "motion/core/clock_warp.h"

static void cmd_check_json(const struct job *job, bool fits)
{
    cJSON *report = cJSON_CreateObject();
    cJSON_AddStringToObject(report, "title", job->move.title);
    cJSON_AddNumberToObject(report, "axes", job->move.axis_count);
    cJSON_AddNumberToObject(report, "duration_s",
                            number_double(job->end_ns_q12, 12) / 1e9);
    job_json_hash(job, report);
    path_report_json(job, report);
    job_json_warnings(job, report);
    job_json_violations(job, report);
    budget_json(&job->rig, job, report);
    monitored_json(&job->rig, report);
    shots_plan_json(job, report);
    json_report(report, job->violation_count == 0 && fits);
}

static void cmd_check_buses(const struct job *job)
{
    for (unsigned i = 0; i < job->rig.bus_count; i++) {
        struct budget budget;
        budget_of(&job->rig, i, job, &budget);
        budget_print(&budget, stdout);
        budget_free(&budget);
    }
}

/* The verdict stands first. */
static void cmd_check_verdict(const struct job *job, int64_t rate_q30,
                              const char *refused)
{
    char duration[NUMBER_MAX], percent[NUMBER_MAX];
    number_seconds(duration, job->end_ns_q12);
    printf("%u %s, %s s", job->move.axis_count,
           number_word(job->move.axis_count, "axis", "axes"), duration);
    if (rate_q30 > MOTION_CLOCK_WARP_ONE_Q30) {
        number_short(percent, 100 * rate_q30, 30);
        printf(", at %s %% speed", percent);
    }
    fputs(": ", stdout);
    if (job->violation_count > 0)
        printf("%u limit %s\n", job->violation_count,
               number_word(job->violation_count, "violation", "violations"));
    else if (refused != NULL)
        printf("refused, %s\n", refused);
    else
        puts("within all limits");
}

static void cmd_check_text(const struct job *job, const struct options *options,
                           const char *refused)
{
    cmd_check_verdict(job, options->override_q30, refused);
    if (job->violation_count > 0)
        job_print_violations(job, options->all, stdout);
    cmd_check_buses(job);
    monitored_print(&job->rig, stdout);
    path_report_text(job, stdout);
    shots_plan_print(job, stdout);
}

static enum status cmd_check_job(struct job *job, const struct options *options)
{
    enum status status =
        planning_open(job, options->path, options->path_count, true);
    if (status != STATUS_OK)
        return status;
    const int64_t rate_q30 = options->override_q30;
    job_check(job, rate_q30);
    const bool carried = budget_check(&job->rig, job->rig_path, &job->messages);
    const bool shot = job_shots_check(job, rate_q30, &job->messages);
    error_tell(&job->messages);
    const bool fits = shot && carried;
    if (options->json)
        cmd_check_json(job, fits);
    else
        cmd_check_text(job, options,
                       !carried ? "a bus cannot carry it"
                       : !shot  ? "shots come too close to each other"
                                : NULL);
    return job->violation_count == 0 && fits ? STATUS_OK : STATUS_REFUSED;
}

static enum status cmd_check_run(const struct options *options)
{
    struct job *job = memory_new(1, sizeof *job);
    enum status status = cmd_check_job(job, options);
    job_free(job);
    memory_free(job);
    return status;
}

static const struct option_row cmd_check_option[] = {
    { "override", "PERCENT", OPTION_PERCENT,
      offsetof(struct options, override_q30),
      "judge the move as played at this speed (100), or at 100 when it is "
      "less" },
    { "all", NULL, OPTION_FLAG, offsetof(struct options, all),
      "list every violation, not the worst 20 of each kind on each axis" },
    OPTIONS_COMMON,
};

const struct command cmd_check = {
    .name = "check",
    .arguments = "RIG MOVE | DIRECTORY",
    .summary = "report every limit violation of a move",
    .text =
        "Plans every axis and judges the result by the extremes of position,\n"
        "velocity, acceleration and jerk, found in closed form, not by\n"
        "sampling; by the steps between segments; and by whether every axis\n"
        "starts and ends at rest.  Each violation is one line: axis, move "
        "time,\n"
        "value, limit, the key before it and that key's line in the file. "
        "Of more\n"
        "than 20 of one kind on one axis the worst are shown, unless --all is "
        "given.\n"
        "\n"
        "Then, for each bus, what is sent on it how often, how long it is on\n"
        "the wire at most, and how much of the bus's time that takes: more "
        "than\n"
        "100 % is refused, with what would fit; and which drives are "
        "monitored.\n",
    .examples = "  slew check examples/dolly\n"
                "  slew check --json rig.yaml move.yaml\n"
                "  slew check --override 150 examples/dolly\n",
    COMMAND_OPTIONS(cmd_check_option),
    .run = cmd_check_run,
};
