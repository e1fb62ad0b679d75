/* firmware/linux/commands/ports/cmd_doctor.c - slew doctor: is this machine fit, and
 * what is to be done? */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/job/job.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/planning.h"
#include "firmware/linux/service/place.h"
#include "firmware/linux/tools/doctor.h"

#define CMD_DOCTOR_MEASURE_NS INT64_C(2000000000)
#define CMD_DOCTOR_PERIOD_NS  INT64_C(1000000)
#define CMD_DOCTOR_ANSWER_MS  2000 /* of a service */

static unsigned cmd_doctor_count(const struct doctor *doctor,
                                 enum doctor_verdict verdict)
{
    unsigned count = 0;

    for (unsigned i = 0; i < doctor->count; i++)
        count += doctor->line[i].verdict == verdict;
    return count;
}

static void cmd_doctor_json(const struct doctor *doctor)
{
    cJSON *report = cJSON_CreateObject();

    cJSON *lines = cJSON_AddArrayToObject(report, "lines");
    for (unsigned i = 0; i < doctor->count; i++) {
        const struct doctor_line *line = &doctor->line[i];
        cJSON *object = cJSON_CreateObject();

        cJSON_AddStringToObject(object, "verdict",
                                doctor_verdict_text(line->verdict));
        cJSON_AddStringToObject(object, "topic", line->topic);
        cJSON_AddStringToObject(object, "what", line->what);
        cJSON_AddStringToObject(object, "advice", line->advice);
        cJSON_AddItemToArray(lines, object);
    }
    json_report(report, doctor_worst(doctor) != DOCTOR_BAD);
}

static void cmd_doctor_text(const struct doctor *doctor)
{
    for (unsigned i = 0; i < doctor->count; i++) {
        const struct doctor_line *line = &doctor->line[i];

        printf("%-6s  %-9s  %s\n", doctor_verdict_text(line->verdict),
               line->topic, line->what);
        if (line->advice[0] != '\0')
            printf("%-6s  %-9s  -> %s\n", "", "", line->advice);
    }
    printf("\n%u bad, %u to improve\n", cmd_doctor_count(doctor, DOCTOR_BAD),
           cmd_doctor_count(doctor, DOCTOR_ADVICE));
}

/* The rig with the interfaces of the command line, NULL without one. */
static enum status cmd_doctor_rig(const struct options *options,
                                  struct rig *rig)
{
    char message[YAML_MESSAGE_MAX];
    const enum status status = planning_rig(options->path[0], rig);

    if (status != STATUS_OK)
        return status;
    if (options->interface != NULL &&
        rig_set_interfaces(rig, options->interface, message) < 0) {
        error_say("slew doctor: --interface: %s", message);
        return STATUS_INPUT;
    }
    return STATUS_OK;
}

static bool cmd_doctor_is_folder(const char *path)
{
    char inside[4096];
    return snprintf(inside, sizeof inside, "%s/.", path) < (int)sizeof inside &&
           access(inside, F_OK) == 0;
}

/* Ask the service that has the rig for its status; NULL: there is none. */
static cJSON *cmd_doctor_service(const char *path)
{
    struct service_link link = { .file = -1 };
    char rig[4096];
    cJSON *answer = NULL;

    if (snprintf(rig, sizeof rig, "%s%s", path,
                 cmd_doctor_is_folder(path) ? "/rig.yaml" : "") <
            (int)sizeof rig &&
        service_link_open(&link, NULL, rig, true) == 0) {
        cJSON *command = cJSON_CreateObject();

        cJSON_AddStringToObject(command, "command", "status");
        answer =
            service_link_ask(&link, command, CMD_DOCTOR_ANSWER_MS, NULL, NULL);
    }
    service_link_close(&link);
    return answer;
}

static enum status cmd_doctor_run(const struct options *options)
{
    static struct doctor doctor;
    static struct rig rig;
    struct doctor_config config = {
        .root = options->root == NULL ? "" : options->root,
        .link = options->root == NULL ? can_link_read : NULL,
        .measure_ns =
            options->to_ns < 0 ? CMD_DOCTOR_MEASURE_NS : options->to_ns,
        .period_ns = CMD_DOCTOR_PERIOD_NS,
    };

    if (options->root != NULL && !cmd_doctor_is_folder(options->root)) {
        error_say("slew doctor: --root %s: %s, expected a directory with sys, "
                  "proc and dev",
                  options->root, strerror(errno));
        return STATUS_INPUT;
    }
    if (options->interface != NULL && options->path_count == 0) {
        error_say(
            "slew doctor: --interface is for the buses of a rig, expected "
            "RIG with it");
        return STATUS_INPUT;
    }
    if (options->path_count > 0) {
        const enum status status = cmd_doctor_rig(options, &rig);

        if (status != STATUS_OK)
            return status;
        config.rig = &rig;
        config.period_ns = rig.period_ns;
    }
    cJSON *service = options->path_count > 0 && options->root == NULL
                         ? cmd_doctor_service(options->path[0])
                         : NULL;
    config.service = service;
    doctor_examine(&doctor, &config);
    cJSON_Delete(service);
    if (options->json)
        cmd_doctor_json(&doctor);
    else
        cmd_doctor_text(&doctor);
    return doctor_worst(&doctor) == DOCTOR_BAD ? STATUS_REFUSED : STATUS_OK;
}

static const struct option_row cmd_doctor_option[] = {
    { "for", "TIME", OPTION_TIME, offsetof(struct options, to_ns),
      "measure wake-ups for so long (2 s); 0: not at all" },
    OPTIONS_INTERFACE,
    { "root", "DIRECTORY", OPTION_TEXT, offsetof(struct options, root),
      "look at the /sys, /proc and /dev below it" },
    OPTIONS_COMMON,
};

const struct command cmd_doctor = {
    .name = "doctor",
    .arguments = "[RIG | DIRECTORY]",
    .summary = "is this machine fit to move servos, and what is to be done",
    .text =
        "Looks at rights, CAN interfaces, serial ports, GPIO chips, what "
        "makes\n"
        "a program wake up late, the kernel and the libraries, and measures\n"
        "how late a program wakes up that sleeps until its next tick.  Each\n"
        "line is ok, a note, advice or bad, with the command that helps.  "
        "With\n"
        "a rig, what it needs and would not get is bad, and the status is 1.\n"
        "Nothing is changed and no bus is touched; a service that has the rig\n"
        "says what it has met on its lines.\n",
    .examples = "  slew doctor\n"
                "  slew doctor examples/dolly\n"
                "  slew doctor --json --for 10s rig.yaml\n",
    .path_max = 1,
    .path_optional = true,
    COMMAND_OPTIONS(cmd_doctor_option),
    .run = cmd_doctor_run,
};
