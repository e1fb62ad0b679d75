/* firmware/host/move/move_load_tool.c - `tool` of a path: how the tool of the rig's
 * arm is turned on it, and from which joints.  See move_load.h. */
#include <stdlib.h>

#include "firmware/host/base/array.h"
#include "firmware/host/move/move_load.h"
#include "motion/core/fixed.h"

#define TOOL_JOINTS_MAX 6 /* of an arm that a path determines */

int move_take_arm(struct move_reader *reader, const struct yaml_value *value,
                  struct plan_path *path)
{
    struct plan_arm *arm = &path->carrier->arm;

    if (arm->arm.count > TOOL_JOINTS_MAX)
        return yaml_value_refuse(value,
                                 "is the tool of an arm with %u joints, which "
                                 "a path does not determine: key the joints",
                                 arm->arm.count);
    for (uint32_t i = 0; i < arm->arm.count; i++) {
        const struct rig_axis *axis = &reader->rig->axis[arm->axis[i].axis];
        const int64_t low = axis->limit.pos_min_q32,
                      high = axis->limit.pos_max_q32;
        path->tool.near_q32[i] = low > 0 ? low : high < 0 ? high : 0;
        if (move_drive_rig_axis(reader, value, arm->axis[i].axis, PLAN_BY_PATH,
                                &arm->axis[i].axis) < 0)
            return -1;
    }
    return 0;
}

static int tool_read_look(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct plan_path *path = out;

    path->tool.looks = true;
    return move_read_vector(reader, value, PLAN_SPACE_AXES, path->tool.at_q32);
}

/* The joints near which it starts, in their order and units. */
static int tool_read_near(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct move_reader *self = reader;
    struct plan_path *path = out;
    const struct plan_arm *arm = &path->carrier->arm;
    const enum units_axis outer = self->units.unit;
    struct yaml_value item = *value;
    uint32_t count;
    int err = 0;

    if (yaml_value_list(value, arm->arm.count, arm->arm.count, &count) < 0)
        return -1;
    item.node = yaml_value_node(value)->first;
    item.expected = "the position of a joint";
    for (uint32_t i = 0; i < count && err == 0; i++) {
        self->units.unit =
            self->rig->axis[self->rig->kinematics->arm.axis[i].axis].unit;
        err = yaml_units_read(&item, UNITS_POSITION, &self->units,
                              &path->tool.near_q32[i]);
        item.node = yaml_value_node(&item)->next;
    }
    self->units.unit = outer;
    return err;
}

static const struct yaml_field move_tool_fields[] = {
    { "look", YAML_OPTIONAL, "a point such as [1 m, 0 mm, 1.2 m]",
      tool_read_look, 0 },
    { "forward", YAML_OPTIONAL, "a direction such as [0, 0, -1]",
      move_read_direction, offsetof(struct plan_path, tool.forward) },
    { "up", YAML_OPTIONAL, "a direction across forward, such as [1, 0, 0]",
      move_read_direction, offsetof(struct plan_path, tool.up) },
    { "near", YAML_OPTIONAL,
      "as many positions as the arm has joints, near which it starts",
      tool_read_near, 0 },
};
const struct yaml_shape move_tool_shape = { "tool", move_tool_fields,
                                            ARRAY_LEN(move_tool_fields) };

/* `up` at right angles to `forward`. */
static int tool_square(const struct yaml_value *value, struct plan_tool *tool)
{
    return motion_dir_perpendicular(tool->up, tool->forward, &tool->up) < 0
               ? yaml_value_refuse(value, "has forward and up in one line")
               : 0;
}

int move_read_tool(void *reader, const struct yaml_value *value, void *out)
{
    const int64_t one = (int64_t)1 << 62;
    struct plan_path *path = out;

    if (path->carrier == NULL || path->carrier->arm.arm.count == 0)
        return yaml_value_refuse(value, "is not used unless axes is tool");
    path->tool.up = (struct motion_dir){ { 0, 0, one } };
    if (yaml_value_need(value, YAML_TREE_MAP) < 0)
        return -1;
    const bool forward = yaml_fields_find(value, "forward") != 0,
               up = yaml_fields_find(value, "up") != 0;
    if (forward == (yaml_fields_find(value, "look") != 0))
        return yaml_value_refuse(value, "has %s",
                                 forward ? "look and forward"
                                         : "no look, and no forward");
    if (up && !forward)
        return yaml_value_refuse(value, "has up beside look: its horizon is "
                                        "level");
    if (yaml_fields_read(value, &move_tool_shape, reader, path) < 0)
        return -1;
    return forward ? tool_square(value, &path->tool) : 0;
}

int move_check_tool(const struct yaml_value *value,
                    const struct plan_path *path)
{
    const bool has_arm =
        path->carrier != NULL && path->carrier->arm.arm.count > 0;

    return has_arm && yaml_fields_find(value, "tool") == 0
               ? yaml_value_refuse(value, "has no 'tool', which axes tool "
                                          "needs")
               : 0;
}
