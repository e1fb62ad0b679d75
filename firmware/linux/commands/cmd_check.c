/* firmware/linux/commands/cmd_check.c - slew check: every limit violation of a
 * move, and whether the buses carry it. */
#include <cjson/cJSON.h>
#include <stdio.h>

#include "firmware/linux/base/json.h"
#include "firmware/linux/base/number.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/machine/shots.h"
#include "firmware/linux/move/budget.h"
#include "firmware/linux/move/job.h"
#include "firmware/linux/move/path_report.h"

static void cmd_check_json(const struct job *job, bool fits)
{
    cJSON *report = cJSON_CreateObject();
    cJSON_AddBoolToObject(report, "ok", job->violation_count == 0 && fits);
    cJSON_AddStringToObject(report, "title", job->move.title);
    cJSON_AddNumberToObject(report, "axes", job->move.axis_count);
    cJSON_AddNumberToObject(report, "duration_s",
                            number_double(job->end_ns_q12, 12) / 1e9);
    path_report_json(job, report);
    job_json_violations(job, report);
    budget_json(&job->rig, job, report);
    shots_plan_json(job, report);
    json_print(report, stdout);
}

static void cmd_check_buses(const struct job *job)
{
    for (unsigned i = 0; i < job->rig.bus_count; i++) {
        struct budget budget;
        budget_of(&job->rig, i, job, &budget);
        budget_print(&budget, stdout);
    }
}

static void cmd_check_text(const struct job *job)
{
    char duration[NUMBER_MAX];
    cmd_check_buses(job);
    if (job->violation_count > 0) {
        job_print_violations(job, stdout);
        printf("%u violation%s\n", job->violation_count,
               job->violation_count == 1 ? "" : "s");
    } else {
        number_seconds(duration, job->end_ns_q12);
        printf("%u axes, %s s: within all limits\n", job->move.axis_count,
               duration);
    }
    path_report_text(job, stdout);
    shots_plan_print(job, stdout);
}

static enum status cmd_check_job(struct job *job, const struct options *options)
{
    enum status status = job_open_any(job, options->path, options->path_count);
    if (status != STATUS_OK)
        return status;
    const int64_t rate_q30 = options->override_q30;
    job_check(job, rate_q30);
    const bool carried = budget_check(job);
    const bool fits = shots_check(job, rate_q30) && carried;
    if (options->json)
        cmd_check_json(job, fits);
    else
        cmd_check_text(job);
    return job->violation_count == 0 && fits ? STATUS_OK : STATUS_REFUSED;
}

static enum status cmd_check_run(const struct options *options)
{
    static struct job job;
    enum status status = cmd_check_job(&job, options);
    job_free(&job);
    return status;
}

static const struct option_row cmd_check_option[] = {
    { "override", "PERCENT", OPTION_PERCENT,
      offsetof(struct options, override_q30),
      "judge the move as played at this speed (100), or at 100 when it is "
      "less" },
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
        "starts and ends at rest.  Each violation is one line: axis, time,\n"
        "value, limit, the key before it and that key's line in the file.\n"
        "\n"
        "Then, for each bus, what is sent on it how often, how long it is on\n"
        "the wire at most, and how much of the bus's time that takes: more "
        "than\n"
        "100 % is refused, with what would fit.\n",
    .examples = "  slew check examples/dolly\n"
                "  slew check --json rig.yaml move.yaml\n"
                "  slew check --override 150 examples/dolly\n",
    COMMAND_OPTIONS(cmd_check_option),
    .run = cmd_check_run,
};
