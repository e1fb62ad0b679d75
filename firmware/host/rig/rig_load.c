/* firmware/host/rig/rig_load.c - rig.yaml to struct rig.  See rig.h.
 *
 * Every section has a file of its own (rig_parts.h); this one has the top of
 * the file and what must agree with docs/schema. */
#include "firmware/host/rig/rig_parts.h"

#include "firmware/host/base/memory.h"
#include "firmware/host/yaml/yaml_shapes.h"

static int rig_read_title(void *reader, const struct yaml_value *value,
                          void *out)
{
    (void)reader;
    return yaml_value_copy(value, out, sizeof(((struct rig *)0)->title));
}

static int rig_read_tick(void *reader, const struct yaml_value *value,
                         void *out)
{
    return rig_read_time(reader, value, 125 * RIG_US, 20 * RIG_MS, RIG_US, out);
}

static int rig_read_heartbeat(void *reader, const struct yaml_value *value,
                              void *out)
{
    return rig_read_time(reader, value, 10 * RIG_MS, 10000 * RIG_MS, RIG_MS,
                         out);
}

static int rig_read_watchdog(void *reader, const struct yaml_value *value,
                             void *out)
{
    const struct rig *rig = ((struct rig_reader *)reader)->rig;
    return rig_read_time(reader, value, 2 * rig->period_ns, 100 * RIG_MS,
                         RIG_MS, out);
}

const char *const rig_guardians[RIG_GUARDIANS] = { "warn", "stop" };

static int rig_read_guardian(void *reader, const struct yaml_value *value,
                             void *out)
{
    unsigned index;
    (void)reader;
    if (yaml_value_choice(value, rig_guardians, RIG_GUARDIANS, &index) < 0)
        return -1;
    *(enum rig_guardian *)out = (enum rig_guardian)index;
    return 0;
}

static const struct yaml_field rig_fields[] = {
    { "title", YAML_OPTIONAL, "a text of at most 127 bytes", rig_read_title,
      offsetof(struct rig, title) },
    { "tick", YAML_OPTIONAL, "125 us .. 20 ms in whole us", rig_read_tick,
      offsetof(struct rig, period_ns) },
    { "heartbeat", YAML_OPTIONAL, "10 ms .. 10 s in whole ms",
      rig_read_heartbeat, offsetof(struct rig, heartbeat_ns) },
    { "watchdog", YAML_OPTIONAL, "2 ticks .. 100 ms in whole ms",
      rig_read_watchdog, offsetof(struct rig, watchdog_ns) },
    { "guardian", YAML_OPTIONAL, "warn or stop", rig_read_guardian,
      offsetof(struct rig, guardian) },
    { "buses", YAML_OPTIONAL, "a map of 1 .. 32 buses by name", rig_read_buses,
      0 },
    { "axes", YAML_REQUIRED, "a map of 1 .. 64 axes by name", rig_read_axes,
      0 },
    { "gpio", YAML_OPTIONAL, "a map of 1 .. 256 lines by name", rig_read_gpio,
      0 },
    { "kinematics", YAML_OPTIONAL,
      "a map with head, and linear, arc, rail, gantry or jib; or with arm",
      rig_read_kinematics, 0 },
    { "gantry", YAML_OPTIONAL,
      "a map of 1 .. 8 bridges by name, each on two rails", rig_read_gantries,
      0 },
    { "payload", YAML_OPTIONAL, "a map of 1 .. 16 things that axes carry",
      rig_read_payloads, 0 },
};
static const struct yaml_shape rig_shape = { "rig", rig_fields,
                                             ARRAY_LEN(rig_fields) };

const struct yaml_words rig_words[] = {
    { "axis.unit", units_axis_words, UNITS_AXIS_WORDS },
    { "bus.kind", rig_bus_kinds, RIG_BUS_KINDS },
    { "drive.kind", rig_drive_kinds, RIG_DRIVE_KINDS },
    { "drive.mode", rig_cia402_modes, RIG_CIA402_MODES },
    { "drive.nmt_reset", rig_nmt_resets, RIG_NMT_RESETS },
    { "homing.by", rig_homing_kinds, RIG_HOMING_KINDS },
    { "homing.input", rig_homing_inputs, RIG_HOMING_INPUTS },
    { "homing.direction", rig_homing_ways, RIG_HOMING_WAYS },
    { "shaper.kind", rig_shaper_kinds, PLAN_SHAPER_KINDS },
    { "line.kind", rig_line_kinds, RIG_LINE_KINDS },
    { "line.active", rig_line_levels, RIG_LINE_LEVELS },
    { "line.bias", rig_line_biases, RIG_LINE_BIASES },
    { "jib.mount", rig_jib_mounts, RIG_JIB_MOUNTS },
    { "rig.guardian", rig_guardians, RIG_GUARDIANS },
    { "payload.kind", rig_payload_kinds, RIG_PAYLOAD_KINDS },
    { NULL, NULL, 0 },
};

#define RIG_SHAPE(NAME, name, word) &rig_##name##_shape,
const struct yaml_shape *const rig_shapes[] = {
    &rig_shape,
    &rig_bus_shape,
    &rig_axis_shape,
    &rig_limit_shape,
    &rig_stop_shape,
    &rig_monitor_shape,
    &rig_following_shape,
    RIG_KIND_LIST(RIG_SHAPE) & rig_counts_shape,
    &rig_scale_shape,
    &rig_option_shape,
    &rig_times_shape,
    &rig_pdo_shape,
    &rig_homing_shape,
    &rig_shaper_shape,
    &rig_sim_shape,
    &rig_virtual_sim_shape,
    &rig_sim_load_shape,
    &rig_sim_second_shape,
    &rig_transmission_shape,
    &rig_sim_motor_shape,
    &rig_sim_loops_shape,
    &rig_encoder_shape,
    &rig_modbus_bus_shape,
    &rig_can_bus_shape,
    &rig_line_shape,
    &rig_kinematics_shape,
    &rig_linear_shape,
    &rig_slide_shape,
    &rig_joint_shape,
    &rig_arc_shape,
    &rig_rail_shape,
    &rig_arm_shape,
    &rig_base_shape,
    &rig_link_shape,
    &rig_tool_shape,
    &rig_gantry_shape,
    &rig_jib_shape,
    &rig_head_shape,
    &rig_table_shape,
    &rig_lens_shape,
    &rig_payload_shape,
    &rig_rails_shape,
    &rig_quirks_shape,
    NULL,
};

int rig_load(const struct files *files, const char *path, struct rig *rig,
             char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct rig_reader reader = { .files = files, .rig = rig };
    struct yaml_tree tree;
    int err;

    rig_free(rig);
    *rig = (struct rig){ .period_ns = RIG_MS,
                         .heartbeat_ns = 100 * RIG_MS,
                         .watchdog_ns = 100 * RIG_MS };
    if (yaml_tree_load(files, &tree, &report) < 0)
        return -1;
    const struct yaml_value whole = { &tree, 0, "the rig",
                                      "a map with buses and axes" };
    err = yaml_fields_read(&whole, &rig_shape, &reader, rig);
    if (err == 0)
        err = rig_check_homing(&whole, rig);
    if (err == 0)
        err = rig_check_gantries(&whole, rig);
    for (unsigned i = 0; i < rig->axis_count && err == 0; i++)
        if (rig_kinds[rig->axis[i].kind]->judge_rig != NULL)
            err = rig_kinds[rig->axis[i].kind]->judge_rig(&whole, rig, i);
    rig_forget_eds(&reader);
    memory_pool_free(&reader.memory);
    yaml_tree_free(&tree);
    return err;
}

void rig_free(struct rig *rig)
{
    if (rig->rail != NULL)
        plan_space_free(rig->rail);
    memory_pool_free(&rig->memory);
    *rig = (struct rig){ .bus_count = 0 };
}

void rig_part(struct rig *part, const struct rig *rig, uint32_t bus)
{
    rig_free(part);
    *part = *rig;
    part->memory = (struct memory_pool){ NULL };
    part->rail = NULL; /* of the whole one */
    part->bus = memory_pool_new(&part->memory, 1, sizeof *part->bus);
    part->bus[0] = rig->bus[bus];
    part->bus_count = 1;
    part->line_count = 0;
    part->payload_count = 0;
    part->gantry_count = 0;
    part->axis =
        memory_pool_new(&part->memory, rig->axis_count, sizeof *part->axis);
    part->axis_count = 0;
    for (uint32_t i = 0; i < rig->axis_count; i++) {
        if (rig->axis[i].bus != bus)
            continue;
        part->axis[part->axis_count] = rig->axis[i];
        part->axis[part->axis_count++].bus = 0;
    }
}
