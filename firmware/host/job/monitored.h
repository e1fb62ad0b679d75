/* firmware/host/job/monitored.h - which limits of temperature, voltage and current
 * the drives of a rig are watched by, in words. */
#ifndef FIRMWARE_HOST_JOB_MONITORED_H
#define FIRMWARE_HOST_JOB_MONITORED_H

#include <stdio.h>

#include "firmware/host/rig/rig.h"

struct cJSON;

/* "temperature to 80 degC, bus voltage 20 to 56 V"; "" of an axis without. */
#define MONITORED_TEXT_MAX 160
void monitored_text(const struct rig_axis *axis, char text[MONITORED_TEXT_MAX]);
/* One line: "monitored: pan (temperature to 80 degC); no limits are given for
 * tilt".  Nothing for a rig without drives. */
void monitored_print(const struct rig *rig, FILE *file);
/* An object with a list [lowest, highest] per reading, null where there is no
 * limit; empty for an axis without. */
struct cJSON *monitored_axis_json(const struct rig_axis *axis);
/* "monitored" of a report: that of each axis that is. */
void monitored_json(const struct rig *rig, struct cJSON *report);

#endif
