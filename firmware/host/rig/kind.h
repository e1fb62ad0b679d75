/* firmware/host/rig/kind.h - the kinds of drive: one row here, and what is
 * theirs in folders of their own, firmware/host/kind/NAME among them.
 *
 * A row, with the word of a rig file, makes RIG_NAME, and needs a constant table of
 * what the kind does in every layer: rig_kind_name (here), machine_kind_name,
 * tool_kind_name, verb_kind_name.  docs/DESIGN.md, "To add a kind of drive". */
#ifndef FIRMWARE_HOST_RIG_KIND_H
#define FIRMWARE_HOST_RIG_KIND_H

#include <stdbool.h>
#include <stdint.h>

#define RIG_KIND_LIST(KIND)                                                    \
    KIND(CIA402, cia402, "cia402")                                             \
    KIND(MODBUS, modbus, "modbus")                                             \
    KIND(ODRIVE, odrive, "odrive")                                             \
    KIND(MOTEUS, moteus, "moteus")                                             \
    KIND(SLEW_MCU, slew_mcu, "slew-mcu")                                       \
    KIND(VIRTUAL, virtual, "virtual")
/* As a sentence has them. */
#define RIG_KIND_WORDS "cia402, modbus, odrive, moteus, slew-mcu or virtual"

#define RIG_KIND_ENUM(NAME, name, word)  RIG_##NAME,
#define RIG_KIND_COUNT(NAME, name, word) +1
enum rig_drive_kind { RIG_KIND_LIST(RIG_KIND_ENUM) };
#define RIG_DRIVE_KINDS (0 RIG_KIND_LIST(RIG_KIND_COUNT))

struct homing_config;
struct modbus_rtu_time;
struct motion_state;
struct rig;
struct rig_axis;
struct rig_bus;
struct rig_reader;
struct yaml_value;

/* A frame of an axis on a CAN bus, every period_ns.  Bits of an FD frame's data
 * count as those bits of bit_rate that take as long. */
struct rig_frame {
    const char *what;
    int64_t period_ns;
    double bits;    /* at most */
    bool is_before; /* the set points, in a tick: a question and its answer */
    bool is_answer; /* with a position */
};
#define RIG_FRAMES_MAX 12

/* A reader returns 0, or -1 with a sentence. */
struct rig_kind {
    /* Is this a bus for it? */
    bool (*is_for)(const struct rig_bus *bus);
    /* `drive:`. */
    int (*read)(struct rig_reader *reader, const struct yaml_value *value,
                struct rig_axis *axis);
    /* The axis being read is whole; NULL: there is no more to judge. */
    int (*judge_axis)(const struct rig_reader *reader,
                      const struct yaml_value *value);
    /* `homing:` is by drive and whole; NULL with cannot_home. */
    int (*judge_homing)(const struct rig_reader *reader,
                        const struct yaml_value *value,
                        struct homing_config *homing);
    /* All axes are whole: is it well with axis `index`?  NULL: there is no more
     * to judge. */
    int (*judge_rig)(const struct yaml_value *value, const struct rig *rig,
                     unsigned index);
    /* What slew leaves to its torque-off input, as the rig file lets it: a
     * sentence, or NULL where it stops by itself.  NULL: it always does. */
    const char *(*unsupervised)(const struct rig *rig,
                                const struct rig_axis *axis);
    const char *cannot_home;     /* "a drive, which ..."; NULL: it can */
    const char *homes_as_set_up; /* so that neither slow nor method is for it:
                                    "a drive, which ..."; NULL: it is told */
    bool has_methods;            /* of homing, numbers above or below 0 */
    bool has_heartbeat;          /* which it sends by itself */
    uint32_t code_max;           /* of its faults, from 1 */
    bool has_inputs;     /* says which of its own switches are pressed */
    bool reports_torque; /* in thousandths of the rated one, */
    bool torque_in_nm;   /* or in Nm: by rated_torque of the rig file */
    /* What its drive says of itself when it is asked: 1 << enum hal_reading;
     * NULL: nothing. */
    unsigned (*readings)(const struct rig *rig, const struct rig_axis *axis);
    bool has_map; /* its registers are described by a file */
    bool samples; /* it is a board, which is given whole tracks */
    /* On a Modbus line: how long its transactions of one cycle take, and how
     * many they are; `streamed`: as if it were. */
    int64_t (*turn_ns)(const struct rig *rig, unsigned i,
                       const struct modbus_rtu_time *time, bool streamed,
                       unsigned *transactions);
    /* So long it may take to answer there. */
    int64_t (*answer_ns)(const struct rig *rig, unsigned i);
    /* On a CAN bus without CANopen: what axis i has there; returns how many. */
    unsigned (*frames)(const struct rig *rig, unsigned i,
                       struct rig_frame frame[RIG_FRAMES_MAX]);
    /* The bits of the same in that state, in the mean: feedback is taken to be
     * the set point. */
    void (*expect)(const struct rig *rig, unsigned i,
                   const struct motion_state *state,
                   double bits[RIG_FRAMES_MAX]);
};
#define RIG_KIND_ROW(NAME, name, word)                                         \
    extern const struct rig_kind rig_kind_##name;
RIG_KIND_LIST(RIG_KIND_ROW)
/* By enum rig_drive_kind. */
extern const struct rig_kind *const rig_kinds[RIG_DRIVE_KINDS];

/* Which drives are on a bus: there is one kind only. */
enum rig_drive_kind rig_kind_on(const struct rig_bus *bus);

#endif
