/* firmware/linux/commands/drive/info.c - slew drive info: who a drive is, what
 * it is set to, what went wrong with it. */
#include <stdio.h>

#include "firmware/host/job/monitored.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/drive/kind.h"

static void info_json(const struct session *session,
                      const struct drive_info *info)
{
    cJSON *report = cJSON_CreateObject();

    cJSON_AddStringToObject(report, "drive", session->label);
    if (info->is_unsupervised)
        cJSON_AddBoolToObject(report, "unsupervised", true);
    if (session->axis != NULL)
        cJSON_AddItemToObject(report, "monitored",
                              monitored_axis_json(session->axis));
    drive_quirks_json(&info->quirks, report);
    cJSON_AddItemToObject(
        report, "values",
        drive_values_json(info->value, info->count - info->errors));
    cJSON_AddItemToObject(
        report, "errors",
        drive_values_json(&info->value[info->count - info->errors],
                          info->errors));
    cJSON *missing = cJSON_AddArrayToObject(report, "missing");
    for (unsigned i = 0; i < info->missing_count; i++)
        cJSON_AddItemToArray(missing,
                             cJSON_CreateString(info->missing[i].number));
    if (info->fault[0] != '\0')
        cJSON_AddStringToObject(report, "fault", info->fault);
    json_report(report, info->ok);
}

/* Of one that a rig has. */
static void info_monitored(const struct rig_axis *axis)
{
    char text[MONITORED_TEXT_MAX];

    if (axis == NULL)
        return;
    monitored_text(axis, text);
    printf("\nmonitored: %s\n",
           text[0] != '\0' ? text
                           : "no, as the rig gives no limits of temperature, "
                             "voltage or current");
}

static void info_print(const struct session *session,
                       const struct drive_info *info)
{
    printf("%s\n\n", session->label);
    drive_values_print(info->value, info->count - info->errors);
    if (info->errors > 0) {
        puts("\nwhat went wrong, the latest first:");
        drive_values_print(&info->value[info->count - info->errors],
                           info->errors);
    }
    drive_quirks_print(&info->quirks);
    if (info->is_unsupervised)
        printf("\nthe rig says that it is unsupervised: it may do without "
               "0x1016, 0x6007 and 0x6066, and then nothing but its torque-off "
               "input stops it when slew is silent\n");
    info_monitored(session->axis);
    for (unsigned i = 0; i < info->missing_count; i++)
        printf("\nit lacks %s: %s", info->missing[i].number,
               info->missing[i].why);
    if (info->fault[0] != '\0')
        printf("\nit is in fault: %s\n", info->fault);
    if (info->is_judged)
        puts(info->ok ? "\nit has what slew needs"
                      : "\nit does not have what slew needs");
}

enum status drive_info(const struct options *options)
{
    static struct drive_info info;
    struct session *session;
    enum status status = drive_open(options, &session);

    if (status != STATUS_OK)
        return status;
    info = (struct drive_info){ .ok = true };
    status = verb_kind_of(session)->info(session, &info);
    if (status == STATUS_OK && options->json)
        info_json(session, &info);
    else if (status == STATUS_OK)
        info_print(session, &info);
    drive_close(session);
    return status != STATUS_OK || info.ok ? status : STATUS_REFUSED;
}
