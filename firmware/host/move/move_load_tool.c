/* firmware/host/move/move_load_tool.c - `tool` of a path: how the tool of the rig's
 * arm is turned on it, and from which joints.  See move_load.h. */
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/move/move_load.h"
#include "motion/core/fixed.h"
#include "motion/plan/camera/plan_camera.h"

#define TOOL_JOINTS_MAX 6 /* that a path determines */

/* The axis of the move with this name that has keys, or -1. */
static int tool_keyed(const struct move_reader *reader, const char *name)
{
    const struct plan_move *move = reader->move;

    for (uint32_t i = 0; i < move->axis_count; i++)
        if (strcmp(move->axis[i].name, name) == 0 &&
            move->axis[i].driver == PLAN_BY_KEYS)
            return (int)i;
    return -1;
}

/* A joint that has keys keeps them; the path drives the others. */
static int tool_take_joint(struct move_reader *reader,
                           const struct yaml_value *value,
                           struct plan_path *path, uint32_t i)
{
    struct plan_arm *arm = &path->carrier->arm;
    const struct rig_axis *axis = &reader->rig->axis[arm->axis[i].axis];
    const int64_t low = axis->limit.pos_min_q32, high = axis->limit.pos_max_q32;
    const int keyed = tool_keyed(reader, axis->name);

    path->tool.near_q32[i] = low > 0 ? low : high < 0 ? high : 0;
    arm->arm.joint[i].is_fixed = keyed >= 0;
    if (keyed < 0)
        return move_drive_rig_axis(reader, value, arm->axis[i].axis,
                                   PLAN_BY_PATH, &arm->axis[i].axis);
    arm->axis[i].axis = (uint32_t)keyed;
    return 0;
}

static uint32_t tool_driven(const struct plan_arm *arm)
{
    uint32_t driven = 0;

    for (uint32_t i = 0; i < arm->arm.count; i++)
        driven += !arm->arm.joint[i].is_fixed;
    return driven;
}

int move_take_arm(struct move_reader *reader, const struct yaml_value *value,
                  struct plan_path *path)
{
    const struct plan_arm *arm = &path->carrier->arm;

    for (uint32_t i = 0; i < arm->arm.count; i++)
        if (tool_take_joint(reader, value, path, i) < 0)
            return -1;
    const uint32_t driven = tool_driven(arm);
    if (driven > TOOL_JOINTS_MAX)
        return yaml_value_refuse(
            value,
            "is the tool of an arm with %u joints, of which a path determines "
            "%u: give %u of them keys under axes (one key holds a joint)",
            arm->arm.count, TOOL_JOINTS_MAX, driven - TOOL_JOINTS_MAX);
    return driven > 0 ? 0
                      : yaml_value_refuse(value, "is the tool of an arm whose "
                                                 "joints all have keys");
}

/* A point, for short, or a map as a camera's look. */
static int tool_read_look(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct plan_path *path = out;
    struct plan_camera *look = path->tool.look;

    look->look_place = yaml_tree_place(value->tree, value->node);
    if (yaml_value_node(value)->kind == YAML_TREE_MAP)
        return move_read_looks(reader, value, look);
    look->look = PLAN_LOOK_AT;
    return move_read_vector(reader, value, PLAN_SPACE_AXES, look->point_q32);
}

static int tool_read_roll(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct plan_path *path = out;

    return path->tool.look == NULL
               ? yaml_value_refuse(value, "is not used without look")
               : move_read_roll_of(reader, value, path->tool.look);
}

/* The joints near which it starts, in their order and units; those with keys are
 * left out. */
static int tool_read_near(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct move_reader *self = reader;
    struct plan_path *path = out;
    const struct plan_arm *arm = &path->carrier->arm;
    const enum units_axis outer = self->units.unit;
    struct yaml_value item = *value;
    uint32_t count = tool_driven(arm);
    int err = 0;

    if (yaml_value_list(value, count, count, &count) < 0)
        return -1;
    item.node = yaml_value_node(value)->first;
    item.expected = "the position of a joint";
    for (uint32_t i = 0; i < arm->arm.count && err == 0; i++) {
        if (arm->arm.joint[i].is_fixed)
            continue;
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
    { "look", YAML_OPTIONAL,
      "a point such as [1 m, 0 mm, 1.2 m], or a map with one of at, subject, "
      "keys, along, ahead, path and dwell",
      tool_read_look, 0 },
    { "roll", YAML_OPTIONAL, "a map with curve and keys, in deg",
      tool_read_roll, 0 },
    { "forward", YAML_OPTIONAL, "a direction such as [0, 0, -1]",
      move_read_direction, offsetof(struct plan_path, tool.forward) },
    { "up", YAML_OPTIONAL, "a direction across forward, such as [1, 0, 0]",
      move_read_direction, offsetof(struct plan_path, tool.up) },
    { "near", YAML_OPTIONAL,
      "as many positions as the arm has joints without keys, near which it "
      "starts",
      tool_read_near, 0 },
};
const struct yaml_shape move_tool_shape = { "tool", move_tool_fields,
                                            ARRAY_LEN(move_tool_fields) };

/* `up` at right angles to `forward`. */
static int tool_square(const struct yaml_value *value, struct plan_tool *tool)
{
    return motion_dir_perpendicular(tool->up, tool->forward, &tool->up) < 0
               ? yaml_value_refuse(value, "has parallel forward and up")
               : 0;
}

/* Turned as a camera whose mount looks along x. */
static int tool_open_look(const struct yaml_value *value,
                          struct plan_tool *tool)
{
    const int64_t one = (int64_t)1 << 62;
    struct plan_camera *look = calloc(1, sizeof *look);

    tool->look = look;
    if (look == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    look->place = yaml_tree_place(value->tree, value->node);
    look->has_roll = true;
    look->ease = MOTION_DWELL_QUINTIC;
    look->forward = (struct motion_dir){ { one, 0, 0 } };
    look->up = (struct motion_dir){ { 0, 0, one } };
    look->tolerance_q32 = MOTION_FIXED_ONE_Q32 / 100000;
    return 0;
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
    if ((!forward && tool_open_look(value, &path->tool) < 0) ||
        yaml_fields_read(value, &move_tool_shape, reader, path) < 0)
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
