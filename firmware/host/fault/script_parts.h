/* firmware/host/fault/script_parts.h - what each kind of fault has, for those
 * who read and write it. */
#ifndef FIRMWARE_HOST_FAULT_SCRIPT_PARTS_H
#define FIRMWARE_HOST_FAULT_SCRIPT_PARTS_H

#include "firmware/host/fault/script.h"

/* The values that an entry may have beside its time. */
enum fault_value {
    FAULT_NOTHING,
    FAULT_CODE,
    FAULT_BY,
    FAULT_LEVEL,
    FAULT_RATE,
    FAULT_DELAY,
    FAULT_COUNT,
    FAULT_VALUES
};
extern const char *const fault_value_words[FAULT_VALUES];
#define FAULT_DIRECTIONS 2
extern const char *const fault_direction_words[FAULT_DIRECTIONS];

#define FAULT_AXIS (1u << FAULT_OF_AXIS)
#define FAULT_BUS  (1u << FAULT_OF_BUS)
#define FAULT_LINE (1u << FAULT_OF_LINE)

struct fault_shape {
    unsigned targets; /* that it can be of */
    enum fault_value value;
    bool needs_value, lasts;
    bool directed;  /* of the frames in one direction */
    unsigned buses; /* that it can be of, or 0; bit: enum rig_bus_kind */
};
extern const struct fault_shape fault_shapes_of[FAULT_KINDS];

#endif
