/* firmware/host/recording/warning.h - what an axis warns of: it stops nothing.
 *
 * Detected at each tick (firmware/linux/machine/warnings.h), one at most per
 * axis and tick; each begins once and lasts until its value is well away from
 * the limit again.  Rows of telemetry carry the newest, by its number; the report,
 * recordings and a service tell of it. */
#ifndef FIRMWARE_HOST_RECORDING_WARNING_H
#define FIRMWARE_HOST_RECORDING_WARNING_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/rig/rig.h"
#include "hal/readings.h"

/* X(name, words, word for programs) */
#define WARNING_LIST(X)                                                        \
    X(WARNING_FOLLOWING, "following error over half of its limit",             \
      "following_error")                                                       \
    X(WARNING_FOUND, "found enabled: stopped, then torque off",                \
      "found_enabled")                                                         \
    X(WARNING_FOUND_GOING,                                                     \
      "found enabled: torque off, as it did not come to "                      \
      "rest in its time (another master?)",                                    \
      "found_going")                                                           \
    X(WARNING_TEMPERATURE, "temperature over 90 % of its limit",               \
      "temperature")                                                           \
    X(WARNING_VOLTAGE, "bus voltage over 90 % of the way to its limit",        \
      "voltage")                                                               \
    X(WARNING_CURRENT, "current over 90 % of its limit", "current")

enum warning_kind {
#define WARNING_ENUM(name, words, word) name,
    WARNING_LIST(WARNING_ENUM)
#undef WARNING_ENUM
        WARNING_KINDS
};
/* "following error over half of its limit"; "following_error". */
const char *warning_words(enum warning_kind kind);
const char *warning_word(enum warning_kind kind);
/* Of a reading (hal/readings.h). */
#define WARNING_OF_READING(reading)                                            \
    ((enum warning_kind)(WARNING_TEMPERATURE + (unsigned)(reading)))
/* Its value is a speed, 0 where that is not known, and it has no limit. */
bool warning_is_of_speed(enum warning_kind kind);
/* Of its value and limit: "deg" of an axis, per second of a speed; "degC". */
const char *warning_unit(enum warning_kind kind, const struct rig_axis *axis);

struct warning {
    uint32_t number; /* of the axis, from 1; 0: there was none */
    enum warning_kind kind;
    int64_t value_q32, limit_q32; /* as it began */
};

#define WARNING_TEXT_MAX 160
/* "0.26 of 0.5 deg", "moving at 30 mm/s"; "" of a speed that is not known. */
void warning_amount(const struct warning *warning, const struct rig_axis *axis,
                    char text[WARNING_TEXT_MAX]);
/* "pan: following error over half of its limit, 0.26 of 0.5 deg". */
void warning_text(const struct warning *warning, const struct rig_axis *axis,
                  char text[WARNING_TEXT_MAX]);

#endif
