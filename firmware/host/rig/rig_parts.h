/* firmware/host/rig/rig_parts.h - what the readers of rig.yaml's sections
 * share.
 *
 * One table per map of the file (docs/FILES.md shows them), one small function
 * per kind of value.  What can only be judged when two values are known is
 * judged where the second is read; the tables' order says which that is.
 *
 *   rig_load.c    the top of the file      rig_drive.c    axis: drive, any kind
 *   rig_bus.c     buses                    rig_monitor.c  drive: monitor
 *   rig_once.c    what may be there once   rig_plausible.c
 *   rig_modbus.c  buses of Modbus          rig_limits.c   axis: limits, stop,
 *   rig_axis.c    axes                                    following_error
 *   rig_gpio.c    gpio                     rig_homing.c   axis: homing
 *   rig_values.c  kinds of value           rig_shaper.c   axis: shaper
 *   kinematics/   kinematics, its parts    sim/           axis: sim; payload
 *   kind.h        what a kind of drive adds: firmware/host/kind
 *
 * A reader returns 0, or -1 with the sentence written. */
#ifndef FIRMWARE_HOST_RIG_RIG_PARTS_H
#define FIRMWARE_HOST_RIG_RIG_PARTS_H

#include "firmware/host/base/array.h"
#include "firmware/host/device/eds.h"
#include "firmware/host/rig/rig.h"
#include "firmware/host/yaml/yaml_shapes.h"
#include "firmware/host/yaml/yaml_units.h"

#define RIG_US INT64_C(1000)
#define RIG_MS INT64_C(1000000)

/* See rig_once.c. */
#define RIG_OWNER_MAX (PLAN_NAME_MAX + 8)
struct rig_claim {
    const char *name;          /* "node" */
    char thing[RIG_THING_MAX]; /* "1 on bus can0" */
    char owner[RIG_OWNER_MAX]; /* "axis pan" */
    uint32_t line;
};

struct rig_reader {
    const struct files *files;
    struct rig *rig;
    struct rig_axis *axis;       /* being read */
    struct eds *eds;             /* its drive's data sheet; NULL: none */
    struct yaml_value eds_value; /* which the rig has there */
    struct units_context units;
    struct rig_claim *claim; /* what may be in a rig once, so far */
    size_t claim_count;
    struct memory_pool memory; /* of the claims */
};

/* ---- rig_once.c ---- */

/* Refuse `value`, whose name says what it is, where the thing that the format
 * gives is another's: with that one and its line. */
int rig_claim(struct rig_reader *reader, const struct yaml_value *value,
              const char *owner, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
/* The interface, serial port or server of a whole bus, whose map is `value`. */
int rig_claim_bus(struct rig_reader *reader, const struct yaml_value *value,
                  const struct rig_bus *bus);
/* The drive of the axis that is being read, whose bus, node and axis of that
 * are known by now. */
int rig_claim_drive(struct rig_reader *reader, const struct yaml_value *value);
/* The digital line of a whole line, whose map is `value`. */
int rig_claim_line(struct rig_reader *reader, const struct yaml_value *value,
                   const struct rig_line *line);

/* ---- rig_values.c ---- */

int rig_read_quantity(struct rig_reader *reader, const struct yaml_value *value,
                      enum units_quantity quantity, int64_t *out);
int rig_read_positive(struct rig_reader *reader, const struct yaml_value *value,
                      enum units_quantity quantity, int64_t *out);
/* A number, such as 3 or 30 %, and a frequency, from `low` to `high`. */
int rig_read_share(struct rig_reader *reader, const struct yaml_value *value,
                   double low, double high, double *out);
int rig_read_frequency(struct rig_reader *reader,
                       const struct yaml_value *value, double low_hz,
                       double high_hz, double *out_hz);
/* A time of whole `step`s (1 us or 1 ms) from min to max. */
int rig_read_time(struct rig_reader *reader, const struct yaml_value *value,
                  int64_t min_ns, int64_t max_ns, int64_t step_ns,
                  int64_t *out_ns);

/* As rows of a table want them: `reader` is a struct rig_reader, `out` the
 * member.  Velocity, acceleration and jerk are above zero. */
int rig_read_velocity(void *reader, const struct yaml_value *value, void *out);
int rig_read_acceleration(void *reader, const struct yaml_value *value,
                          void *out);
int rig_read_jerk(void *reader, const struct yaml_value *value, void *out);
int rig_read_node_id(void *reader, const struct yaml_value *value, void *out);

/* Of the axis before. */
void rig_forget_eds(struct rig_reader *reader);

/* ---- sections ---- */

/* [lowest, highest], a range of positions that is not empty. */
int rig_read_ends(struct rig_reader *reader, const struct yaml_value *value,
                  int64_t *low_q32, int64_t *high_q32);
int rig_read_limits(void *reader, const struct yaml_value *value, void *out);
int rig_read_stop(void *reader, const struct yaml_value *value, void *out);
/* monitor: of a drive, the last of its fields. */
#define RIG_MONITOR_FIELD                                                      \
    {                                                                          \
        "monitor", YAML_OPTIONAL,                                              \
            "limits of temperature, voltage and current, such as "             \
            "{temperature: 80 degC}",                                          \
            rig_read_monitor, 0                                                \
    }
int rig_read_monitor(void *reader, const struct yaml_value *value, void *out);
int rig_read_following(void *reader, const struct yaml_value *value, void *out);
int rig_read_drive(void *reader, const struct yaml_value *value, void *out);
int rig_read_homing(void *reader, const struct yaml_value *value, void *out);
/* After everything: does each axis have the line that its homing needs? */
int rig_check_homing(const struct yaml_value *value, const struct rig *rig);
int rig_read_shaper(void *reader, const struct yaml_value *value, void *out);
int rig_read_sim(void *reader, const struct yaml_value *value, void *out);
int rig_read_sim_quirks(void *reader, const struct yaml_value *value,
                        void *out);
int rig_read_sim_load(void *reader, const struct yaml_value *value, void *out);
int rig_read_sim_motor(void *reader, const struct yaml_value *value, void *out);
int rig_read_sim_loops(void *reader, const struct yaml_value *value, void *out);
int rig_read_axes(void *reader, const struct yaml_value *value, void *out);
int rig_read_buses(void *reader, const struct yaml_value *value, void *out);
int rig_read_gpio(void *reader, const struct yaml_value *value, void *out);
int rig_read_gantries(void *reader, const struct yaml_value *value, void *out);
/* Check, once all is read, that the rails of the kinematics agree with it. */
int rig_check_gantries(const struct yaml_value *value, const struct rig *rig);
int rig_read_payloads(void *reader, const struct yaml_value *value, void *out);
int rig_read_kinematics(void *reader, const struct yaml_value *value,
                        void *out);
int rig_read_drive_bus(void *reader, const struct yaml_value *value, void *out);
int rig_read_drive_node(void *reader, const struct yaml_value *value,
                        void *out);
int rig_read_drive_kind(void *reader, const struct yaml_value *value,
                        void *out);
int rig_read_bus_kind(void *reader, const struct yaml_value *value, void *out);
int rig_read_counts(void *reader, const struct yaml_value *value, void *out);

/* ---- rig_modbus.c ---- */

int rig_read_modbus_bus(struct rig_reader *reader,
                        const struct yaml_value *value, struct rig_bus *bus);

/* ---- rig_plausible.c: refuse what cannot be meant ---- */

/* An acceleration or jerk of `stop`, against that of the limits. */
int rig_judge_stop(const struct yaml_value *value, int64_t stop_q32,
                   int64_t limit_q32, bool is_jerk);

/* ---- rig_map.c ---- */

/* A unit of its own on the bus; a register map, which is read once however many
 * have it: its index. */
int rig_read_unit_number(void *reader, const struct yaml_value *value,
                         void *out);
int rig_read_map(void *reader, const struct yaml_value *value, void *out);

/* ---- rig_range.c ---- */

/* Of a whole axis: has its drive room for its positions? */
int rig_check_modbus_range(const struct yaml_value *value,
                           const struct modbus_map *map,
                           const struct rig_axis *axis);

/* ---- rig_drive.c ---- */

/* What the map `value` says after kind:, "" when nothing; its shape depends on
 * it. */
const char *rig_kind_of(const struct yaml_value *value);
/* A map of at most `most` names and values. */
int rig_read_pairs(const struct yaml_value *value, const unsigned *count,
                   unsigned most, void *of,
                   int (*read)(void *of, const struct yaml_value *key,
                               const struct yaml_value *value));
/* Set points go to the drive as 32-bit counts: both ends of the axis must
 * fit. */
bool rig_counts_fit(const struct rig_axis *axis);
/* As {num: ..., den: ...} or `4096 per mm`. */
int rig_read_ratio(struct rig_reader *reader, const struct yaml_value *value,
                   struct rig_axis *axis);

extern const struct yaml_shape rig_limit_shape, rig_stop_shape,
    rig_following_shape, rig_counts_shape, rig_sim_shape, rig_virtual_sim_shape,
    rig_sim_load_shape, rig_sim_second_shape, rig_transmission_shape,
    rig_sim_motor_shape, rig_sim_loops_shape, rig_encoder_shape,
    rig_homing_shape, rig_shaper_shape, rig_axis_shape, rig_bus_shape,
    rig_line_shape, rig_modbus_bus_shape, rig_can_bus_shape, rig_scale_shape,
    rig_option_shape, rig_times_shape, rig_pdo_shape, rig_kinematics_shape,
    rig_linear_shape, rig_slide_shape, rig_joint_shape, rig_arc_shape,
    rig_rail_shape, rig_arm_shape, rig_link_shape, rig_tool_shape,
    rig_base_shape, rig_gantry_shape, rig_jib_shape, rig_head_shape,
    rig_monitor_shape, rig_table_shape, rig_lens_shape, rig_payload_shape,
    rig_rails_shape, rig_quirks_shape;
#define RIG_KIND_SHAPE(NAME, name, word)                                       \
    extern const struct yaml_shape rig_##name##_shape;
RIG_KIND_LIST(RIG_KIND_SHAPE)

/* ---- words a value may be, in the order of their enums ---- */

#define RIG_BUS_KINDS     4
#define RIG_CIA402_MODES  3
#define RIG_NMT_RESETS    3
#define RIG_HOMING_KINDS  5
#define RIG_HOMING_INPUTS 3
#define RIG_HOMING_WAYS   2
#define RIG_LINE_KINDS    8
#define RIG_LINE_LEVELS   2
#define RIG_LINE_BIASES   4
#define RIG_JIB_MOUNTS    3
#define RIG_GUARDIANS     2
extern const char *const rig_bus_kinds[RIG_BUS_KINDS];
extern const char *const rig_drive_kinds[RIG_DRIVE_KINDS];
extern const char *const rig_cia402_modes[RIG_CIA402_MODES];
extern const char *const rig_nmt_resets[RIG_NMT_RESETS];
extern const char *const rig_homing_kinds[RIG_HOMING_KINDS];
extern const char *const rig_homing_inputs[RIG_HOMING_INPUTS];
extern const char *const rig_homing_ways[RIG_HOMING_WAYS];
extern const char *const rig_line_kinds[RIG_LINE_KINDS];
extern const char *const rig_line_levels[RIG_LINE_LEVELS];
extern const char *const rig_line_biases[RIG_LINE_BIASES];
extern const char *const rig_shaper_kinds[PLAN_SHAPER_KINDS];
extern const char *const rig_jib_mounts[RIG_JIB_MOUNTS];
extern const char *const rig_guardians[RIG_GUARDIANS];
extern const char *const rig_payload_kinds[RIG_PAYLOAD_KINDS];

#endif
