/* firmware/host/rig/kinematics/rig_arm.c - kinematics: a serial arm by its Denavit-Hartenberg
 * table, and the tool on its flange. */
#include <math.h>

#include "firmware/host/rig/kinematics/rig_kinematics.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/double/double_math.h"
#include "motion/plan/rig/plan_arm.h"

/* A joint and the row of the table that begins with it. */
struct rig_link {
    struct motion_arm_joint joint;
    struct plan_rig_axis axis;
    struct motion_axis_map map;
    double unit;
};

static int rig_read_in(struct rig_reader *self, const struct yaml_value *value,
                       enum units_axis unit, int64_t *out)
{
    const enum units_axis outer = self->units.unit;

    self->units.unit = unit;
    const int err = rig_read_quantity(self, value, UNITS_POSITION, out);
    self->units.unit = outer;
    return err;
}

static int rig_read_link_length(void *reader, const struct yaml_value *value,
                                void *out)
{
    return rig_read_in(reader, value, UNITS_AXIS_MM, out);
}

static int rig_read_link_angle(void *reader, const struct yaml_value *value,
                               void *out)
{
    return rig_read_in(reader, value, UNITS_AXIS_DEG, out);
}

static int rig_read_link_axis(void *reader, const struct yaml_value *value,
                              void *out)
{
    struct rig_reader *self = reader;
    struct rig_link *link = out;
    unsigned index;

    if (rig_read_free_axis(self, value, &index) < 0)
        return -1;
    const enum units_axis unit = self->rig->axis[index].unit;
    if (unit != UNITS_AXIS_DEG && unit != UNITS_AXIS_RAD &&
        unit != UNITS_AXIS_MM)
        return yaml_value_refuse(value, "'%s' is in %s, not in deg, rad or mm",
                                 self->rig->axis[index].name,
                                 units_axis_text(unit));
    link->axis = (struct plan_rig_axis){ true, index };
    link->joint.is_prismatic = unit == UNITS_AXIS_MM;
    link->unit = unit == UNITS_AXIS_DEG ? DOUBLE_RADIAN : 1;
    self->units.unit = unit;
    return 0;
}

static int rig_read_link_offset(void *reader, const struct yaml_value *value,
                                void *out)
{
    return rig_read_quantity(reader, value, UNITS_POSITION, out);
}

static const struct yaml_field rig_link_fields[] = {
    { "axis", YAML_REQUIRED, "an axis of the rig in deg, rad or mm",
      rig_read_link_axis, 0 },
    { "a", YAML_OPTIONAL, "a length along the new x", rig_read_link_length,
      offsetof(struct rig_link, joint.a_q32) },
    { "d", YAML_OPTIONAL, "a length along the joint's axis",
      rig_read_link_length, offsetof(struct rig_link, joint.d_q32) },
    { "alpha", YAML_OPTIONAL, "an angle about the new x", rig_read_link_angle,
      offsetof(struct rig_link, joint.alpha_deg_q32) },
    { "theta", YAML_OPTIONAL, "an angle about the joint's axis",
      rig_read_link_angle, offsetof(struct rig_link, joint.theta_deg_q32) },
    { "offset", YAML_OPTIONAL, "where the joint is when the axis is at 0",
      rig_read_link_offset, offsetof(struct rig_link, map.offset_q32) },
    { "reversed", YAML_OPTIONAL, "yes or no", yaml_read_bool,
      offsetof(struct rig_link, map.is_reversed) },
};
const struct yaml_shape rig_link_shape = { "link", rig_link_fields,
                                           ARRAY_LEN(rig_link_fields) };

/* The limits of the axis are those of the joint. */
static void rig_limit_joint(const struct rig *rig, struct plan_arm *arm,
                            uint32_t i)
{
    const struct plan_limit *limit = &rig->axis[arm->axis[i].axis].limit;
    const int64_t end_q32[2] = { limit->pos_min_q32, limit->pos_max_q32 };
    struct motion_arm_joint *joint = &arm->arm.joint[i];
    int64_t at_q32[2];

    for (int k = 0; k < 2; k++)
        at_q32[k] = plan_arm_joint_q32(
            arm, i,
            plan_arm_joint(arm, i, plan_jet_of(ldexp((double)end_q32[k], -32)))
                .p);
    joint->is_limited = true;
    joint->low_q32 = at_q32[arm->map[i].is_reversed ? 1 : 0];
    joint->high_q32 = at_q32[arm->map[i].is_reversed ? 0 : 1];
}

static int rig_read_links(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct rig_reader *self = reader;
    struct plan_arm *arm = out;
    const enum units_axis outer = self->units.unit;
    struct yaml_value item = { value->tree, yaml_value_node(value)->first,
                               "joint",
                               "a map with axis, a, d, alpha and theta" };
    uint32_t count;

    if (yaml_value_list(value, 1, MOTION_ARM_JOINTS_MAX, &count) < 0)
        return -1;
    for (uint32_t i = 0; i < count; i++) {
        struct rig_link link = { .unit = 1 };
        if (yaml_fields_read(&item, &rig_link_shape, self, &link) < 0)
            return -1;
        self->units.unit = outer;
        arm->arm.joint[i] = link.joint;
        arm->axis[i] = link.axis;
        arm->map[i] = link.map;
        arm->unit[i] = link.unit;
        rig_limit_joint(self->rig, arm, i);
        item.node = yaml_value_node(&item)->next;
    }
    arm->arm.count = count;
    return 0;
}

struct rig_tool {
    struct motion_vec position;
    struct motion_dir view, up;
};

static const struct yaml_field rig_tool_fields[] = {
    { "position", YAML_OPTIONAL,
      "the entrance pupil, or the tip, from the flange: [x, y, z]",
      rig_read_point, offsetof(struct rig_tool, position) },
    { "view", YAML_OPTIONAL, "where it looks, such as [0, 0, 1]",
      rig_read_direction, offsetof(struct rig_tool, view) },
    { "up", YAML_OPTIONAL, "a direction across view, such as [0, 1, 0]",
      rig_read_direction, offsetof(struct rig_tool, up) },
};
const struct yaml_shape rig_tool_shape = { "tool", rig_tool_fields,
                                           ARRAY_LEN(rig_tool_fields) };

static int rig_set_tool(const struct rig_tool *tool,
                        struct motion_arm_tool *out)
{
    out->pupil = tool->position;
    return motion_mount_level(motion_vec_from_dir(tool->view),
                              motion_vec_from_dir(tool->up), &out->q);
}

static int rig_read_tool(void *reader, const struct yaml_value *value,
                         void *out)
{
    const int64_t one = (int64_t)1 << 62;
    struct rig_tool tool = { motion_vec_zero(),
                             { { 0, 0, one } },
                             { { 0, one, 0 } } };

    if (yaml_fields_read(value, &rig_tool_shape, reader, &tool) < 0)
        return -1;
    return rig_set_tool(&tool, out) < 0
               ? yaml_value_refuse(value, "has parallel view and up")
               : 0;
}

struct rig_base {
    struct motion_vec position;
    struct motion_dir z, x;
};

static const struct yaml_field rig_base_fields[] = {
    { "position", YAML_OPTIONAL, "a place in space: [x, y, z]", rig_read_point,
      offsetof(struct rig_base, position) },
    { "z", YAML_OPTIONAL, "the axis of the first joint, such as [0, 1, 0]",
      rig_read_direction, offsetof(struct rig_base, z) },
    { "x", YAML_OPTIONAL, "a direction across z, such as [1, 0, 0]",
      rig_read_direction, offsetof(struct rig_base, x) },
};
const struct yaml_shape rig_base_shape = { "base", rig_base_fields,
                                           ARRAY_LEN(rig_base_fields) };

static int rig_read_base(void *reader, const struct yaml_value *value,
                         void *out)
{
    const int64_t one = (int64_t)1 << 62;
    struct rig_base base = { motion_vec_zero(),
                             { { 0, 0, one } },
                             { { one, 0, 0 } } };
    struct motion_pose *pose = out;
    struct motion_dir axis[3];

    if (yaml_fields_read(value, &rig_base_shape, reader, &base) < 0)
        return -1;
    pose->origin = base.position;
    axis[2] = base.z;
    if (motion_dir_perpendicular(base.x, base.z, &axis[0]) < 0)
        return yaml_value_refuse(value, "has parallel z and x");
    axis[1] = motion_dir_cross(axis[2], axis[0]);
    return motion_quat_from_axes(axis, &pose->q) < 0
               ? yaml_value_refuse(value, "is no rotation")
               : 0;
}

static const struct yaml_field rig_arm_fields[] = {
    { "base", YAML_OPTIONAL, "a map with position, z and x", rig_read_base,
      offsetof(struct plan_arm, base) },
    { "joints", YAML_REQUIRED,
      "a list of 1 .. 8 maps with axis, a, d, alpha and theta", rig_read_links,
      0 },
    { "tool", YAML_OPTIONAL, "a map with position, view and up", rig_read_tool,
      offsetof(struct plan_arm, tool) },
};
const struct yaml_shape rig_arm_shape = { "arm", rig_arm_fields,
                                          ARRAY_LEN(rig_arm_fields) };

int rig_read_arm(void *reader, const struct yaml_value *value, void *out)
{
    const int64_t one = (int64_t)1 << 62;
    const struct rig_tool tool = { motion_vec_zero(),
                                   { { 0, 0, one } },
                                   { { 0, one, 0 } } };
    struct plan_arm *arm = out;

    arm->base = (struct motion_pose){ motion_vec_zero(), MOTION_QUAT_ONE };
    (void)rig_set_tool(&tool, &arm->tool);
    return yaml_fields_read(value, &rig_arm_shape, reader, arm);
}
