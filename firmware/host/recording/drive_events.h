/* firmware/host/recording/drive_events.h - what a drive says without being in fault
 * (hal/drive.h), in words: for the report, recordings and a service. */
#ifndef FIRMWARE_HOST_RECORDING_DRIVE_EVENTS_H
#define FIRMWARE_HOST_RECORDING_DRIVE_EVENTS_H

#include <cjson/cJSON.h>
#include <stdbool.h>

#include "hal/drive.h"

bool drive_events_any(const struct hal_drive_events *events);
/* What was said since then. */
struct hal_drive_events drive_events_since(const struct hal_drive_events *now,
                                           const struct hal_drive_events *then);

/* "warning 2, emergency message 1 (0x8130)". */
#define DRIVE_EVENTS_TEXT_MAX 160
void drive_events_text(const struct hal_drive_events *events,
                       char text[DRIVE_EVENTS_TEXT_MAX]);
/* "events": each of them with its count, and "emergency_code". */
void drive_events_json(const struct hal_drive_events *events, cJSON *object);

#endif
