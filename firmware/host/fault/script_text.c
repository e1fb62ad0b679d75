/* firmware/host/fault/script_text.c - the kinds of fault, and one of a script in words.  See
 * script.h. */
#include <inttypes.h>
#include <stdio.h>

#include "firmware/host/base/number.h"
#include "firmware/host/fault/script_parts.h"

#define FAULT_WORD(name, spelling) spelling,
const char *const fault_kind_words[FAULT_KINDS] = { FAULT_KIND_LIST(
    FAULT_WORD) };
const char *const fault_event_words[FAULT_EVENTS] = {
    "enable", "home", "approach", "move",  "settle",
    "off",    "hold", "stop",     "fault",
};
const char *const fault_level_words[FAULT_LEVELS] = { "active", "inactive",
                                                      "open" };

const char *const fault_value_words[FAULT_VALUES] = {
    "", "code", "by", "level", "rate", "delay", "count",
};

const char *const fault_direction_words[FAULT_DIRECTIONS] = { "from", "to" };

#define ON_CANOPEN (1u << RIG_CANOPEN)
#define ON_CAN     (ON_CANOPEN | 1u << RIG_CAN)
#define ON_RTU     (1u << RIG_MODBUS_RTU)
#define ON_TCP     (1u << RIG_MODBUS_TCP)
#define ON_ANY     (ON_CAN | ON_RTU | ON_TCP)

const struct fault_shape fault_shapes_of[FAULT_KINDS] = {
    [FAULT_HEARTBEAT_LOST] = { .targets = FAULT_AXIS, .lasts = true },
    [FAULT_DRIVE] = { .targets = FAULT_AXIS, .value = FAULT_CODE },
    [FAULT_REBOOT] = { .targets = FAULT_AXIS },
    [FAULT_STUCK_ENCODER] = { .targets = FAULT_AXIS, .lasts = true },
    [FAULT_ENCODER_JUMP] = { FAULT_AXIS, FAULT_BY, true, .lasts = true },
    [FAULT_STUCK_SWITCH] = { FAULT_LINE, FAULT_LEVEL, true, .lasts = true },
    [FAULT_BUS_OFF] = { FAULT_BUS, .lasts = true, .buses = ON_CAN },
    [FAULT_BUS_ERRORS] = { FAULT_BUS, FAULT_COUNT, true, .buses = ON_CAN },
    [FAULT_INTERFACE_DOWN] = { FAULT_BUS, .lasts = true, .buses = ON_CAN },
    [FAULT_OTHER_MASTER] = { FAULT_BUS, .buses = ON_CANOPEN },
    [FAULT_BABBLE] = { FAULT_BUS, .lasts = true, .buses = ON_CAN | ON_RTU },
    [FAULT_CUT_CABLE] = { FAULT_AXIS | FAULT_BUS, .lasts = true,
                          .buses = ON_ANY },
    [FAULT_NOISE] = { FAULT_BUS, FAULT_RATE, true, true, true, ON_ANY },
    [FAULT_BROWN_OUT] = { .targets = FAULT_AXIS, .lasts = true },
    [FAULT_SLOW_DRIVE] = { FAULT_AXIS, FAULT_DELAY, true, true,
                           .directed = true },
    [FAULT_WRONG_ANSWER] = { FAULT_AXIS, FAULT_COUNT, .directed = true },
    [FAULT_LOSS] = { FAULT_AXIS, FAULT_RATE, true, true, .directed = true },
    [FAULT_DUPLICATION] = { FAULT_AXIS, FAULT_RATE, true, true,
                            .directed = true },
    [FAULT_JITTER] = { FAULT_AXIS, FAULT_DELAY, true, true, .directed = true },
    [FAULT_FRICTION_STEP] = { FAULT_AXIS, FAULT_BY, true, .lasts = true },
    [FAULT_OBSTACLE] = { .targets = FAULT_AXIS, .lasts = true },
    [FAULT_RUNAWAY] = { .targets = FAULT_AXIS, .lasts = true },
    [FAULT_ECHO] = { FAULT_BUS, .lasts = true, .buses = ON_RTU },
    [FAULT_COLLISION] = { FAULT_BUS, .lasts = true, .buses = ON_RTU },
    [FAULT_TURN_AROUND] = { FAULT_BUS, FAULT_DELAY, true, true,
                            .buses = ON_RTU },
    [FAULT_HALF_OPEN] = { FAULT_BUS, .buses = ON_TCP },
    [FAULT_HANG_UP] = { FAULT_BUS, .lasts = true, .buses = ON_TCP },
    [FAULT_OVERHEAT] = { FAULT_AXIS, FAULT_BY, true, .lasts = true },
    [FAULT_SUPPLY] = { FAULT_AXIS, FAULT_BY, true, .lasts = true },
    [FAULT_READING_LOST] = { .targets = FAULT_AXIS, .lasts = true },
};

bool fault_kind_is_over_at_once(enum fault_kind kind)
{
    return !fault_shapes_of[kind].lasts;
}

static const char *fault_place_name(const struct fault_entry *entry,
                                    const struct rig *rig)
{
    switch (entry->target) {
    case FAULT_OF_AXIS:
        return rig->axis[entry->index].name;
    case FAULT_OF_BUS:
        return rig->bus[entry->index].name;
    case FAULT_OF_LINE:
        break;
    }
    return rig->line[entry->index].name;
}

static void fault_value_text(const struct fault_entry *entry,
                             const struct rig *rig, char *text, size_t size)
{
    const char *unit = entry->target == FAULT_OF_AXIS
                           ? units_axis_text(rig->axis[entry->index].unit)
                           : "";
    char number[NUMBER_MAX];

    text[0] = 0;
    switch (entry->kind) {
    case FAULT_DRIVE:
        if (entry->value != 0)
            snprintf(text, size, ", code 0x%" PRIX64, (uint64_t)entry->value);
        break;
    case FAULT_ENCODER_JUMP:
    case FAULT_FRICTION_STEP:
        number_short(number, entry->value, 32);
        snprintf(text, size, ", by %s %s%s", number, unit,
                 entry->kind == FAULT_FRICTION_STEP ? "/s2" : "");
        break;
    case FAULT_OVERHEAT:
    case FAULT_SUPPLY:
        number_short(number, entry->value, 32);
        snprintf(text, size, ", by %s %s", number,
                 entry->kind == FAULT_SUPPLY ? "V" : "degC");
        break;
    case FAULT_STUCK_SWITCH:
        snprintf(text, size, ", %s", fault_level_words[entry->value]);
        break;
    case FAULT_NOISE:
    case FAULT_LOSS:
    case FAULT_DUPLICATION:
        number_short(number, 100 * entry->value, 32);
        snprintf(text, size, ", %s %% of the frames", number);
        break;
    case FAULT_SLOW_DRIVE:
    case FAULT_TURN_AROUND:
        number_short(number, entry->value * 4096 / 1000000, 12);
        snprintf(text, size, ", by %s ms", number);
        break;
    case FAULT_JITTER:
        number_short(number, entry->value * 4096 / 1000000, 12);
        snprintf(text, size, ", up to %s ms", number);
        break;
    case FAULT_BUS_ERRORS:
    case FAULT_WRONG_ANSWER:
        snprintf(text, size, ", %" PRId64, entry->value);
        break;
    default:
        break;
    }
}

const char *fault_entry_text(const struct fault_entry *entry,
                             const struct rig *rig, char text[FAULT_TEXT_MAX])
{
    char value[FAULT_TEXT_MAX / 2];

    fault_value_text(entry, rig, value, sizeof value);
    snprintf(text, FAULT_TEXT_MAX, "%s of %s%s%s",
             fault_kind_words[entry->kind], fault_place_name(entry, rig), value,
             entry->incoming ? ", to it" : "");
    return text;
}
