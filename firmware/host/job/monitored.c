/* firmware/host/job/monitored.c - see monitored.h. */
#include "firmware/host/job/monitored.h"

#include <string.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/number.h"

static int64_t monitored_q32(int32_t milli)
{
    return milli * (INT64_C(1) << 32) / 1000;
}

void monitored_text(const struct rig_axis *axis, char text[MONITORED_TEXT_MAX])
{
    int at = 0;
    text[0] = '\0';
    for (unsigned i = 0; i < HAL_READINGS; i++) {
        const struct drive_monitor_limit *limit = &axis->monitor.limit[i];
        char low[NUMBER_MAX] = "", high[NUMBER_MAX];
        if ((axis->monitor.wanted >> i & 1) == 0)
            continue;
        number_short(high, monitored_q32(limit->high_milli), 32);
        if (limit->low_milli != INT32_MIN)
            number_short(low, monitored_q32(limit->low_milli), 32);
        at += snprintf(text + at, MONITORED_TEXT_MAX - (size_t)at,
                       "%s%s %.12s%sto %.12s %s", at > 0 ? ", " : "",
                       hal_reading_text((enum hal_reading)i), low,
                       low[0] != '\0' ? " " : "", high,
                       hal_reading_unit((enum hal_reading)i));
    }
}

static bool monitored_has_drive(const struct rig_axis *axis)
{
    return !rig_axis_is_virtual(axis) && !rig_kinds[axis->kind]->samples;
}

static unsigned monitored_count(const struct rig *rig, bool is_monitored)
{
    unsigned count = 0;
    for (uint32_t i = 0; i < rig->axis_count; i++)
        count += monitored_has_drive(&rig->axis[i]) &&
                 (rig->axis[i].monitor.wanted != 0) == is_monitored;
    return count;
}

/* The axes that are, or are not. */
static void monitored_list(const struct rig *rig, bool is_monitored, FILE *file)
{
    const char *comma = "";
    for (uint32_t i = 0; i < rig->axis_count; i++) {
        const struct rig_axis *axis = &rig->axis[i];
        char text[MONITORED_TEXT_MAX];
        if (!monitored_has_drive(axis) ||
            (axis->monitor.wanted != 0) != is_monitored)
            continue;
        monitored_text(axis, text);
        fprintf(file, "%s%s", comma, axis->name);
        if (is_monitored)
            fprintf(file, " (%s)", text);
        comma = ", ";
    }
}

void monitored_print(const struct rig *rig, FILE *file)
{
    const unsigned with = monitored_count(rig, true);
    const unsigned without = monitored_count(rig, false);
    if (with == 0 && without == 0)
        return;
    fputs("monitored: ", file);
    if (with == 0)
        fputs("no drive, as no limits of temperature, voltage or current are "
              "given",
              file);
    monitored_list(rig, true, file);
    if (with > 0 && without > 0) {
        fputs("; no limits are given for ", file);
        monitored_list(rig, false, file);
    }
    fputc('\n', file);
}

cJSON *monitored_axis_json(const struct rig_axis *axis)
{
    static const char *const name[HAL_READINGS] = { "temperature", "voltage",
                                                    "current" };
    cJSON *object = cJSON_CreateObject();
    for (unsigned i = 0; i < HAL_READINGS; i++) {
        const struct drive_monitor_limit *limit = &axis->monitor.limit[i];
        if ((axis->monitor.wanted >> i & 1) == 0)
            continue;
        cJSON *range = cJSON_AddArrayToObject(object, name[i]);
        cJSON_AddItemToArray(range,
                             limit->low_milli == INT32_MIN
                                 ? cJSON_CreateNull()
                                 : cJSON_CreateNumber(limit->low_milli / 1e3));
        cJSON_AddItemToArray(range,
                             cJSON_CreateNumber(limit->high_milli / 1e3));
    }
    return object;
}

void monitored_json(const struct rig *rig, struct cJSON *report)
{
    cJSON *axes = cJSON_AddObjectToObject(report, "monitored");
    for (uint32_t i = 0; i < rig->axis_count; i++)
        if (rig->axis[i].monitor.wanted != 0)
            cJSON_AddItemToObject(axes, rig->axis[i].name,
                                  monitored_axis_json(&rig->axis[i]));
}
