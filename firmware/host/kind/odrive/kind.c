/* firmware/host/kind/odrive/kind.c - an ODrive in a rig file; see
 * firmware/host/rig/kind.h. */
#include <math.h>

#include "firmware/host/kind/odrive/parts.h"
#include "hal/drive/odrive/drive.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

static bool odrive_is_for(const struct rig_bus *bus)
{
    return bus->kind == RIG_CAN && bus->data_bit_rate == 0;
}

static int rig_read_odrive_node(void *reader, const struct yaml_value *value,
                                void *out)
{
    int64_t node = 0;

    if (yaml_value_integer(value, 0, DRIVE_ODRIVE_NODE_MAX, &node) < 0)
        return -1;
    *(uint8_t *)out = (uint8_t)node;
    return rig_claim_drive(reader, value);
}

static int rig_read_endpoints(void *reader, const struct yaml_value *value,
                              void *out)
{
    const struct rig_reader *self = reader;
    struct rig_axis *axis = out;
    const char *name = yaml_value_text(value);
    char quote[YAML_QUOTE_MAX];

    if (name == NULL)
        return -1;
    if (rig_endpoints_path(axis->endpoints, name, value->tree->report.path) <
            0 ||
        rig_endpoints_load(files_regular(self->files), axis->endpoints, axis) <
            0)
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

static int rig_read_torque_constant(void *reader,
                                    const struct yaml_value *value, void *out)
{
    double constant;

    if (rig_read_share(reader, value, 1e-5, 1000, &constant) < 0)
        return -1;
    *(int64_t *)out = llround(constant * (double)MOTION_FIXED_ONE_Q32);
    return 0;
}

static const struct yaml_field rig_odrive_fields[] = {
    { "kind", YAML_REQUIRED, RIG_KIND_WORDS, rig_read_drive_kind,
      offsetof(struct rig_axis, kind) },
    { "bus", YAML_REQUIRED, "the name of a bus", rig_read_drive_bus,
      offsetof(struct rig_axis, bus) },
    { "node", YAML_REQUIRED, "a node number, 0 .. 62, of its own on the bus",
      rig_read_odrive_node, offsetof(struct rig_axis, node_id) },
    { "turns", YAML_REQUIRED, RIG_TURN_EXPECTED, rig_read_turn, 0 },
    { "rated_torque", YAML_OPTIONAL, RIG_RATED_TORQUE_EXPECTED,
      rig_read_rated_torque, offsetof(struct rig_axis, rated_torque_mnm) },
    { "torque_constant", YAML_OPTIONAL,
      "0.00001 .. 1000 (Nm per A), of the motor on firmware 0.5",
      rig_read_torque_constant,
      offsetof(struct rig_axis, torque_constant_q32) },
    { "endpoints", YAML_OPTIONAL,
      "ODrive's flat_endpoints.json of the drive's firmware 0.6, from the "
      "rig's directory",
      rig_read_endpoints, 0 },
    { "unsupervised", YAML_OPTIONAL,
      "yes: the drive is not set up to stop by itself when the bus "
      "is dead, and something else takes its torque off",
      yaml_read_bool, offsetof(struct rig_axis, unsupervised) },
    RIG_MONITOR_FIELD,
};
const struct yaml_shape rig_odrive_shape = { "odrive_drive", rig_odrive_fields,
                                             ARRAY_LEN(rig_odrive_fields) };

/* Set_Input_Pos has 16 bits of 0.001 turns/s for the speed and of 0.001 Nm for
 * the torque, of which slew sends none. */
#define ODRIVE_VEL_MAX_Q32 (INT64_C(32767) * MOTION_FIXED_ONE_Q32 / 1000)

static int rig_judge_odrive_speed(const struct yaml_value *value,
                                  const struct rig_axis *axis)
{
    const struct yaml_value slower = {
        value->tree, value->node, value->name,
        "a velocity in the axis's limits or turns for at most 32.767 turns/s"
    };
    int64_t num, den, vel_q32;

    rig_axis_turn(axis, &num, &den);
    if (motion_fixed_muldiv(axis->limit.vel_q32, (int64_t)motion_fixed_abs(num),
                            den, &vel_q32) == MOTION_OK &&
        vel_q32 <= ODRIVE_VEL_MAX_Q32)
        return 0;
    return yaml_value_refuse(&slower,
                             "runs faster than the 16 bits of ODrive's "
                             "velocity feed-forward can say");
}

static int odrive_read(struct rig_reader *reader,
                       const struct yaml_value *value, struct rig_axis *axis)
{
    const struct yaml_value unwatched = {
        value->tree, value->node, value->name,
        "endpoints: flat_endpoints.json (firmware 0.6), or unsupervised: yes "
        "once you have set it and wired its torque-off input"
    };

    if (yaml_fields_read(value, &rig_odrive_shape, reader, axis) < 0)
        return -1;
    if (axis->watchdog_timeout == 0 && !axis->unsupervised)
        return yaml_value_refuse(&unwatched,
                                 "has a watchdog that slew does not set");
    return rig_judge_odrive_speed(value, axis);
}

/* It homes by its own end stops at its own speeds. */
static int odrive_judge_homing(const struct rig_reader *reader,
                               const struct yaml_value *value,
                               struct homing_config *homing)
{
    (void)reader;
    (void)value;
    (void)homing;
    return 0;
}

static const char *odrive_unsupervised(const struct rig *rig,
                                       const struct rig_axis *axis)
{
    (void)rig;
    return axis->watchdog_timeout == 0
               ? "without endpoints slew does not set its watchdog: unless you "
                 "have set axis0.config.enable_watchdog and watchdog_timeout, "
                 "nothing but its torque-off input stops it when slew is silent"
               : NULL;
}

/* One without a list of endpoints may be of firmware 0.5, which has no
 * temperature: that is said once it is known. */
static unsigned odrive_readings(const struct rig *rig,
                                const struct rig_axis *axis)
{
    (void)rig;
    (void)axis;
    return (1u << HAL_READINGS) - 1;
}

const struct rig_kind rig_kind_odrive = {
    .readings = odrive_readings,
    .has_heartbeat = true,
    .reports_torque = true,
    .torque_in_nm = true,
    .code_max = UINT32_MAX,
    .is_for = odrive_is_for,
    .read = odrive_read,
    .judge_homing = odrive_judge_homing,
    .unsupervised = odrive_unsupervised,
    .homes_as_set_up = "an odrive, which is set up for homing by odrivetool",
    .frames = odrive_frames,
    .expect = odrive_expect,
};
