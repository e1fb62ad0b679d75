/* firmware/host/recording/drive_events.c - see drive_events.h. */
#include "firmware/host/recording/drive_events.h"

#include <inttypes.h>
#include <stdio.h>

bool drive_events_any(const struct hal_drive_events *events)
{
    uint32_t any = 0;
    for (unsigned e = 0; e < HAL_DRIVE_EVENTS; e++)
        any |= events->count[e];
    return any != 0;
}

struct hal_drive_events drive_events_since(const struct hal_drive_events *now,
                                           const struct hal_drive_events *then)
{
    struct hal_drive_events since = *now;
    for (unsigned e = 0; e < HAL_DRIVE_EVENTS; e++)
        since.count[e] -= then->count[e];
    return since;
}

void drive_events_text(const struct hal_drive_events *events,
                       char text[DRIVE_EVENTS_TEXT_MAX])
{
    const char *comma = "";
    size_t at = 0;
    text[0] = '\0';
    for (unsigned e = 0; e < HAL_DRIVE_EVENTS; e++) {
        if (events->count[e] == 0)
            continue;
        at += (size_t)snprintf(
            text + at, DRIVE_EVENTS_TEXT_MAX - at, "%s%s %" PRIu32, comma,
            hal_drive_event_text((enum hal_drive_event)e), events->count[e]);
        comma = ", ";
    }
    if (events->count[HAL_DRIVE_EVENT_EMERGENCY] > 0)
        (void)snprintf(text + at, DRIVE_EVENTS_TEXT_MAX - at, " (0x%04X)",
                       events->emergency_code);
}

void drive_events_json(const struct hal_drive_events *events, cJSON *object)
{
    cJSON *item = cJSON_AddObjectToObject(object, "events");
    for (unsigned e = 0; e < HAL_DRIVE_EVENTS; e++)
        cJSON_AddNumberToObject(item,
                                hal_drive_event_text((enum hal_drive_event)e),
                                events->count[e]);
    cJSON_AddNumberToObject(item, "emergency_code", events->emergency_code);
}
