/* firmware/host/rig/rig_turns.c - CAN buses without CANopen, and the drives on
 * them, which count turns: ODrive, moteus. */
#include <string.h>

#include "firmware/host/rig/rig_parts.h"
#include "hal/drive/odrive/drive.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

void rig_axis_turns(const struct rig_axis *axis, int64_t *num, int64_t *den)
{
    *num = axis->counts_num;
    *den = axis->counts_den * RIG_TURN_COUNTS;
}

/* ---- bus ---- */

static int rig_read_data_bit_rate(void *reader, const struct yaml_value *value,
                                  void *out)
{
    static const unsigned factor[] = { 1, 2, 4, 5, 8 };
    const struct rig *rig = ((struct rig_reader *)reader)->rig;
    const struct rig_bus *bus = &rig->bus[rig->bus_count - 1];
    char quote[YAML_QUOTE_MAX];
    int64_t rate;

    if (rig_read_quantity(reader, value, UNITS_BIT_RATE, &rate) < 0)
        return -1;
    for (size_t i = 0; i < ARRAY_LEN(factor); i++) {
        if (rate != (int64_t)bus->bit_rate * factor[i])
            continue;
        *(uint32_t *)out = (uint32_t)rate;
        return 0;
    }
    return yaml_value_refuse(value, "%s does not fit a bit_rate of %u kbit/s",
                             yaml_value_quote(quote, value),
                             bus->bit_rate / 1000);
}

static const struct yaml_field rig_can_bus_fields[] = {
    { "kind", YAML_REQUIRED, "canopen, can, modbus-rtu or modbus-tcp",
      rig_read_bus_kind, offsetof(struct rig_bus, kind) },
    { "bit_rate", YAML_REQUIRED,
      "10, 20, 50, 125, 250, 500, 800 or 1000 kbit/s", rig_read_bit_rate,
      offsetof(struct rig_bus, bit_rate) },
    { "data_bit_rate", YAML_OPTIONAL, "1, 2, 4, 5 or 8 times bit_rate",
      rig_read_data_bit_rate, offsetof(struct rig_bus, data_bit_rate) },
    { "interface", YAML_OPTIONAL,
      "the name of a CAN interface of this machine, such as can0",
      rig_read_interface, offsetof(struct rig_bus, interface) },
};
const struct yaml_shape rig_can_bus_shape = { "can_bus", rig_can_bus_fields,
                                              ARRAY_LEN(rig_can_bus_fields) };

int rig_read_can_bus(struct rig_reader *reader, const struct yaml_value *value,
                     struct rig_bus *bus)
{
    bus->node_id = 0;
    return yaml_fields_read(value, &rig_can_bus_shape, reader, bus);
}

/* ---- turns ---- */

/* To counts, reduced so that nothing gets lost. */
static int rig_read_turns(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct rig_axis *axis = out;
    int64_t same;

    if (rig_read_ratio(reader, value, axis) < 0)
        return -1;
    same = (int64_t)units_gcd(RIG_TURN_COUNTS, (uint64_t)axis->counts_den);
    axis->counts_den /= same;
    if (axis->counts_den > INT64_MAX / RIG_TURN_COUNTS ||
        axis->counts_num > INT64_MAX / RIG_TURN_COUNTS ||
        axis->counts_num < -(INT64_MAX / RIG_TURN_COUNTS))
        return yaml_value_refuse(value, "has too many digits");
    axis->counts_num *= RIG_TURN_COUNTS / same;
    if (!rig_counts_fit(axis))
        return yaml_value_refuse(value,
                                 "gives more than %d turns at the end "
                                 "of the axis",
                                 DRIVE_TURNS_MAX - 1);
    return 0;
}

/* ---- ODrive ---- */

static int rig_read_odrive_node(void *reader, const struct yaml_value *value,
                                void *out)
{
    int64_t node = 0;

    if (yaml_value_integer(value, 0, DRIVE_ODRIVE_NODE_MAX, &node) < 0)
        return -1;
    *(uint8_t *)out = (uint8_t)node;
    return rig_refuse_taken(reader, value);
}

static int rig_read_endpoints(void *reader, const struct yaml_value *value,
                              void *out)
{
    struct rig_axis *axis = out;
    const char *name = yaml_value_text(value);
    char quote[YAML_QUOTE_MAX];

    (void)reader;
    if (name == NULL)
        return -1;
    if (rig_endpoints_path(axis->endpoints, name, value->tree->report.path) <
            0 ||
        rig_endpoints_load(axis->endpoints, axis) < 0)
        return yaml_value_refuse(value, "%s is no JSON file that can be read",
                                 yaml_value_quote(quote, value));
    if (axis->enable_watchdog == 0 || axis->watchdog_timeout == 0)
        return yaml_value_refuse(value,
                                 "%s does not have the endpoints "
                                 "axis0.config.enable_watchdog and "
                                 "axis0.config.watchdog_timeout",
                                 yaml_value_quote(quote, value));
    return 0;
}

#define RIG_TURNS_EXPECTED                                                     \
    "turns of the motor per unit of the axis, such as '0.2 per mm' or "        \
    "{num: 50, den: 360}"

static const struct yaml_field rig_odrive_fields[] = {
    { "kind", YAML_REQUIRED, RIG_KIND_WORDS,
      rig_read_drive_kind, offsetof(struct rig_axis, kind) },
    { "bus", YAML_REQUIRED, "the name of a bus", rig_read_drive_bus,
      offsetof(struct rig_axis, bus) },
    { "node", YAML_REQUIRED, "a node number, 0 .. 62, of its own on the bus",
      rig_read_odrive_node, offsetof(struct rig_axis, node_id) },
    { "turns", YAML_REQUIRED, RIG_TURNS_EXPECTED, rig_read_turns, 0 },
    { "endpoints", YAML_OPTIONAL,
      "ODrive's flat_endpoints.json of the drive's firmware 0.6, from the "
      "rig's directory",
      rig_read_endpoints, 0 },
    { "unsupervised", YAML_OPTIONAL,
      "yes: nobody has seen to it that the drive stops by itself when the bus "
      "is dead, and something else takes its torque off",
      rig_read_unsupervised, offsetof(struct rig_axis, unsupervised) },
};
const struct yaml_shape rig_odrive_shape = { "odrive_drive", rig_odrive_fields,
                                             ARRAY_LEN(rig_odrive_fields) };

/* ---- moteus ---- */

static const struct yaml_field rig_moteus_fields[] = {
    { "kind", YAML_REQUIRED, RIG_KIND_WORDS,
      rig_read_drive_kind, offsetof(struct rig_axis, kind) },
    { "bus", YAML_REQUIRED, "the name of a bus", rig_read_drive_bus,
      offsetof(struct rig_axis, bus) },
    { "node", YAML_REQUIRED, "an id, 1 .. 127, of its own on the bus",
      rig_read_drive_node, offsetof(struct rig_axis, node_id) },
    { "turns", YAML_REQUIRED, RIG_TURNS_EXPECTED, rig_read_turns, 0 },
};
const struct yaml_shape rig_moteus_shape = { "moteus_drive", rig_moteus_fields,
                                             ARRAY_LEN(rig_moteus_fields) };

/* ---- what the wire can say ---- */

/* Set_Input_Pos has 16 bits of 0.001 turns/s for the speed and of 0.001 Nm for
 * the torque, of which slew sends none; moteus takes floats. */
#define ODRIVE_VEL_MAX_Q32 (INT64_C(32767) * MOTION_FIXED_ONE_Q32 / 1000)

static int rig_judge_odrive_speed(const struct yaml_value *value,
                                  const struct rig_axis *axis)
{
    const struct yaml_value slower = {
        value->tree, value->node, value->name,
        "a velocity in the axis's limits or turns for at most 32.767 turns/s"
    };
    int64_t num, den, vel_q32;

    rig_axis_turns(axis, &num, &den);
    if (motion_fixed_muldiv(axis->limit.vel_q32, (int64_t)motion_fixed_abs(num),
                            den, &vel_q32) == MOTION_OK &&
        vel_q32 <= ODRIVE_VEL_MAX_Q32)
        return 0;
    return yaml_value_refuse(&slower,
                             "runs faster than the 16 bits of ODrive's "
                             "velocity feed-forward can say");
}

/* ---- either ---- */

int rig_read_turns_drive(struct rig_reader *reader,
                         const struct yaml_value *value, struct rig_axis *axis)
{
    const bool is_odrive =
        strcmp(rig_kind_of(value), rig_drive_kinds[RIG_ODRIVE]) == 0;
    const struct yaml_value unwatched = {
        value->tree, value->node, value->name,
        "endpoints: flat_endpoints.json (firmware 0.6), or unsupervised: yes "
        "once you have set it and wired its torque-off input"
    };

    if (yaml_fields_read(value,
                         is_odrive ? &rig_odrive_shape : &rig_moteus_shape,
                         reader, axis) < 0)
        return -1;
    if (is_odrive && axis->watchdog_timeout == 0 && !axis->unsupervised)
        return yaml_value_refuse(&unwatched,
                                 "has a watchdog that slew does not set");
    return is_odrive ? rig_judge_odrive_speed(value, axis) : 0;
}
