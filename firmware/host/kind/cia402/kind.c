/* firmware/host/kind/cia402/kind.c - a CiA 402 drive in a rig file; see
 * firmware/host/rig/kind.h. */
#include "firmware/host/kind/cia402/parts.h"

static bool cia402_is_for(const struct rig_bus *bus)
{
    return bus->kind == RIG_CANOPEN;
}

static const struct yaml_field rig_cia402_fields[] = {
    { "kind", YAML_REQUIRED, RIG_KIND_WORDS, rig_read_drive_kind,
      offsetof(struct rig_axis, kind) },
    { "bus", YAML_REQUIRED, "the name of a bus", rig_read_drive_bus,
      offsetof(struct rig_axis, bus) },
    { "axis", YAML_OPTIONAL, "1 .. 8, where several axes are behind one node",
      rig_read_cia402_axis, offsetof(struct rig_axis, node_axis) },
    { "node", YAML_REQUIRED, "a node number, 1 .. 127, of its own on the bus",
      rig_read_drive_node, offsetof(struct rig_axis, node_id) },
    { "counts", YAML_REQUIRED,
      "counts per unit of the axis, such as '4096 per mm' or "
      "{num: 1048576, den: 360}",
      rig_read_counts, 0 },
    { "pdo", YAML_OPTIONAL,
      "a map with rx, tx, rx2, tx2 and number, such as {rx: 0x401, tx: 0x381}",
      rig_read_cia402_pdo, offsetof(struct rig_axis, cia402.pdo) },
    { "eds", YAML_OPTIONAL,
      "the maker's EDS or DCF file, a path from the rig's directory",
      rig_read_eds, offsetof(struct rig_axis, eds) },
    { "parameters", YAML_OPTIONAL,
      "a map of objects and their values, such as {6065: 20000}",
      rig_read_parameters, 0 },
    { "mode", YAML_OPTIONAL, "csp, ip or csv", rig_read_cia402_mode,
      offsetof(struct rig_axis, cia402) },
    { "bandwidth", YAML_OPTIONAL, "0.1 Hz .. 50 Hz", rig_read_cia402_bandwidth,
      offsetof(struct rig_axis, cia402.gain_q16) },
    { "torque", YAML_OPTIONAL,
      "a share of the rated torque, 0 .. 3, that the highest acceleration "
      "takes",
      rig_read_cia402_torque, offsetof(struct rig_axis, torque_q32) },
    { "velocity_units", YAML_OPTIONAL,
      "the drive's units per count/s, such as {num: 10, den: 1}",
      rig_read_scale, offsetof(struct rig_axis, cia402.velocity) },
    { "acceleration_units", YAML_OPTIONAL,
      "the drive's units per count/s2, such as {num: 1, den: 1000}",
      rig_read_scale, offsetof(struct rig_axis, cia402.acceleration) },
    { "revolution", YAML_OPTIONAL,
      "the travel in one revolution of the drive's shaft, such as 10 mm",
      rig_read_cia402_revolution,
      offsetof(struct rig_axis, cia402.travel_q32) },
    { "options", YAML_OPTIONAL,
      "a map with quick_stop, shutdown, disable, halt and fault",
      rig_read_options, offsetof(struct rig_axis, cia402.option) },
    { "guarding", YAML_OPTIONAL,
      "a time of whole ms, at most half of the watchdog",
      rig_read_cia402_guarding,
      offsetof(struct rig_axis, cia402.guard_period_ns) },
    { "nmt_reset", YAML_OPTIONAL, "none, communication or node",
      rig_read_cia402_nmt_reset, offsetof(struct rig_axis, cia402.nmt_reset) },
    { "times", YAML_OPTIONAL,
      "a map with sdo, state, boot, brake and precharge", rig_read_times,
      offsetof(struct rig_axis, cia402.time) },
    { "quirks", YAML_OPTIONAL,
      "one of slew's quirks, such as maxon-epos4, or a path that ends in "
      ".yaml",
      rig_read_quirks, offsetof(struct rig_axis, cia402) },
    { "unsupervised", YAML_OPTIONAL,
      "yes: the drive may do without 0x1016, 0x6007 or 0x6066, and something "
      "else takes its torque off",
      yaml_read_bool, offsetof(struct rig_axis, unsupervised) },
    RIG_MONITOR_FIELD,
};
const struct yaml_shape rig_cia402_shape = { "drive", rig_cia402_fields,
                                             ARRAY_LEN(rig_cia402_fields) };

static int cia402_read(struct rig_reader *reader,
                       const struct yaml_value *value, struct rig_axis *axis)
{
    if (yaml_fields_read(value, &rig_cia402_shape, reader, axis) < 0 ||
        rig_know_quirks(reader, value) < 0 || rig_check_node(reader, value) < 0)
        return -1;
    return rig_check_cia402(value, axis);
}

static int cia402_judge_axis(const struct rig_reader *reader,
                             const struct yaml_value *value)
{
    struct yaml_value entry = *value;

    if (reader->axis->homing.by == HOMING_HARD_STOP)
        reader->axis->cia402.torque = true; /* its PDOs have 0x6077 then */
    if (rig_judge_eds(reader) < 0)
        return -1;
    entry.expected = "a lower stop acceleration or torque";
    return rig_check_cia402_torque(&entry, reader->axis);
}

static int cia402_judge_homing(const struct rig_reader *reader,
                               const struct yaml_value *value,
                               struct homing_config *homing)
{
    (void)reader;
    if (homing->method == 0)
        return yaml_value_refuse(value, "by drive has no 'method'");
    if (homing->slow_q32 == 0)
        homing->slow_q32 = homing->fast_q32 / 10 + 1;
    return 0;
}

static const char *cia402_unsupervised(const struct rig *rig,
                                       const struct rig_axis *axis)
{
    (void)rig;
    return axis->unsupervised
               ? "where its drive lacks 0x1016, 0x6007 or 0x6066, nothing but "
                 "its torque-off input stops it when slew is silent"
               : NULL;
}

static unsigned cia402_readings(const struct rig *rig,
                                const struct rig_axis *axis)
{
    const bool is_hot = axis->monitor.temperature_index != 0;

    (void)rig;
    return 1u << HAL_READING_VOLTAGE | 1u << HAL_READING_CURRENT |
           (unsigned)is_hot << HAL_READING_TEMPERATURE;
}

const struct rig_kind rig_kind_cia402 = {
    .readings = cia402_readings,
    .has_heartbeat = true,
    .code_max = UINT16_MAX,
    .is_for = cia402_is_for,
    .read = cia402_read,
    .judge_axis = cia402_judge_axis,
    .judge_homing = cia402_judge_homing,
    .unsupervised = cia402_unsupervised,
    .has_methods = true,
    .has_inputs = true,
    .reports_torque = true,
};
