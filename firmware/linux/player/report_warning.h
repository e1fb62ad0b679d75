/* firmware/linux/player/report_warning.h - the warnings of an axis in the report
 * of a run: how often each, and the first in full. */
#ifndef FIRMWARE_LINUX_PLAYER_REPORT_WARNING_H
#define FIRMWARE_LINUX_PLAYER_REPORT_WARNING_H

#include <stdio.h>

#include "firmware/host/recording/warning.h"

struct cJSON;

/* Of one axis; all zero: none yet. */
struct report_warnings {
    uint32_t number; /* of the newest */
    struct {
        uint32_t count;
        /* of the first one: when, from the start of the run, and by how much */
        int64_t t_ns, value_q32, limit_q32;
    } kind[WARNING_KINDS];
};

/* After every tick. */
void report_warning_take(struct report_warnings *warnings,
                         const struct warning *newest, int64_t t_ns);
/* "events: pan: following error over half of its limit 2 (first 0.26 of 0.5 deg
 * after 3.400 s of the run)", a line of each kind that there was. */
void report_warning_print(const struct report_warnings *warnings,
                          const struct rig_axis *axis, FILE *file);
/* Into the object of the axis. */
void report_warning_json(const struct report_warnings *warnings,
                         struct cJSON *item);

#endif
