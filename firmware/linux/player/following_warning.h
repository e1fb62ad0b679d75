/* firmware/linux/player/following_warning.h - a following error of more than half
 * of its limit is an event of the report: it stops nothing.
 *
 * One event lasts until the following error is below three eighths of its limit
 * again.  The limit grows with the speed that the axis is told (see
 * controller_axis_config). */
#ifndef FIRMWARE_LINUX_PLAYER_FOLLOWING_WARNING_H
#define FIRMWARE_LINUX_PLAYER_FOLLOWING_WARNING_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "firmware/host/recording/telemetry.h"
#include "firmware/host/rig/rig.h"

struct cJSON;

/* All zero: none yet. */
struct following_warning {
    bool is_on;
    uint32_t count;
    /* of the first one: when, from the start of the run, and by how much */
    int64_t t_ns, following_q32, limit_q32;
};

/* After every tick. */
void following_warning_take(struct following_warning *warning,
                            const struct rig_axis *axis,
                            const struct telemetry_axis *at, int64_t t_ns);
/* "events: pan: following error over half of its limit 2 (first 0.26 of 0.5 deg
 * after 3.400 s of the run)"; nothing where there was none. */
void following_warning_print(const struct following_warning *warning,
                             const struct rig_axis *axis, FILE *file);
/* Into the object of the axis. */
void following_warning_json(const struct following_warning *warning,
                            struct cJSON *item);

#endif
