/* firmware/host/fault/script.h - a fault script: what goes wrong on a simulated
 * machine, when, and for how long, as read from faults.yaml
 * (docs/FAULTS.md describes it, docs/schema/faults.schema.json checks it in an
 * editor). */
#ifndef FIRMWARE_HOST_FAULT_SCRIPT_H
#define FIRMWARE_HOST_FAULT_SCRIPT_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/rig/rig.h"

/* So many at most, so that a row of telemetry says of each in one word whether
 * it is in force. */
#define FAULT_ENTRIES_MAX 32

/* X(NAME, spelling in the file) */
#define FAULT_KIND_LIST(X)                                                     \
    X(FAULT_HEARTBEAT_LOST, "heartbeat_lost")                                  \
    X(FAULT_DRIVE, "drive_fault")                                              \
    X(FAULT_REBOOT, "reboot")                                                  \
    X(FAULT_STUCK_ENCODER, "stuck_encoder")                                    \
    X(FAULT_ENCODER_JUMP, "encoder_jump")                                      \
    X(FAULT_STUCK_SWITCH, "stuck_switch")                                      \
    X(FAULT_BUS_OFF, "bus_off")                                                \
    X(FAULT_BUS_ERRORS, "bus_errors")                                          \
    X(FAULT_INTERFACE_DOWN, "interface_down")                                  \
    X(FAULT_OTHER_MASTER, "other_master")                                      \
    X(FAULT_BABBLE, "babble")                                                  \
    X(FAULT_CUT_CABLE, "cut_cable")                                            \
    X(FAULT_NOISE, "noise")                                                    \
    X(FAULT_BROWN_OUT, "brown_out")                                            \
    X(FAULT_SLOW_DRIVE, "slow_drive")                                          \
    X(FAULT_WRONG_ANSWER, "wrong_answer")                                      \
    X(FAULT_FRICTION_STEP, "friction_step")                                    \
    X(FAULT_OBSTACLE, "obstacle")                                              \
    X(FAULT_RUNAWAY, "runaway")                                                \
    X(FAULT_LOSS, "loss")                                                      \
    X(FAULT_DUPLICATION, "duplication")                                        \
    X(FAULT_JITTER, "jitter")                                                  \
    X(FAULT_ECHO, "echo")                                                      \
    X(FAULT_COLLISION, "collision")                                            \
    X(FAULT_TURN_AROUND, "turn_around")                                        \
    X(FAULT_HALF_OPEN, "half_open")                                            \
    X(FAULT_HANG_UP, "hang_up")                                                \
    X(FAULT_OVERHEAT, "overheat")                                              \
    X(FAULT_SUPPLY, "supply")                                                  \
    X(FAULT_READING_LOST, "reading_lost")

#define FAULT_KIND_ENUM(name, spelling) name,
enum fault_kind { FAULT_KIND_LIST(FAULT_KIND_ENUM) FAULT_KINDS };
extern const char *const fault_kind_words[FAULT_KINDS];

/* What a time in the script counts from: the first time that a phase of the run
 * (telemetry.h) or a state of the controller begins. */
enum fault_event {
    FAULT_ON_ENABLE,
    FAULT_ON_HOME,
    FAULT_ON_APPROACH,
    FAULT_ON_MOVE,
    FAULT_ON_SETTLE,
    FAULT_ON_OFF,  /* torque is taken at the end */
    FAULT_ON_HOLD, /* a hold begins */
    FAULT_ON_STOP, /* a stop along the path begins */
    FAULT_ON_FAULT,
    FAULT_EVENTS
};
extern const char *const fault_event_words[FAULT_EVENTS];

/* It does not last. */
bool fault_kind_is_over_at_once(enum fault_kind kind);

enum fault_target { FAULT_OF_AXIS, FAULT_OF_BUS, FAULT_OF_LINE };

enum fault_level {
    FAULT_LEVEL_ACTIVE,
    FAULT_LEVEL_INACTIVE,
    FAULT_LEVEL_OPEN, /* a broken wire */
    FAULT_LEVELS
};
extern const char *const fault_level_words[FAULT_LEVELS];

struct fault_entry {
    enum fault_kind kind;
    enum fault_target target;
    uint32_t index; /* axis, bus or line of the rig */
    /* at a time after an event, or where an axis passes a position */
    bool by_position;
    enum fault_event event;
    int64_t after_ns;
    uint32_t of_axis;
    int64_t pos_q32;
    int64_t for_ns; /* 0: to the end of the run, or at once over */
    /* By kind: a code (0: the drive's own choice), a count, a level, ns, a
     * share Q32; Q32 of the axis's unit or its acceleration, degC, V. */
    int64_t value;
    bool incoming; /* of what a drive is sent, not of what it sends */
    struct plan_place place;
};

struct fault_script {
    uint64_t seed; /* of noise and wrong answers */
    uint32_t count;
    struct fault_entry entry[FAULT_ENTRIES_MAX];
};

/* Read a file for a rig.  0, or -1 with one sentence, without a line end. */
int fault_script_load(const struct files *files, const char *path,
                      const struct rig *rig, struct fault_script *script,
                      char message[YAML_MESSAGE_MAX]);

/* "drive_fault of pan, code 0x2310"; returns `text`. */
#define FAULT_TEXT_MAX 160
const char *fault_entry_text(const struct fault_entry *entry,
                             const struct rig *rig, char text[FAULT_TEXT_MAX]);

#endif
