/* firmware/host/exchange/import_ros.c - a JointTrajectory of ROS as YAML or
 * JSON; see import.h.
 *
 * Source: trajectory_msgs/JointTrajectory and JointTrajectoryPoint; REP 103:
 * angles are in rad, lengths in m.  JSON is read as the YAML that it is.  Of
 * the message only joint_names and points count; it may be the value of
 * trajectory or joint_trajectory (a goal, a RobotTrajectory).  What a
 * controller of ROS makes of points (joint_trajectory_controller, quintic with
 * accelerations, cubic with velocities) is what the move makes of them. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/number.h"
#include "firmware/host/exchange/import.h"
#include "firmware/host/yaml/yaml_fields.h"
#include "motion/core/fixed.h"

#define ROS_SECONDS_MAX 2147483647 /* int32 of builtin_interfaces/Duration */
#define ROS_NUMBER_MAX  64
#define ROS_PER_POINT   "as many as joint_names"

struct ros_joint {
    struct plan_axis *axis; /* NULL: left out */
    enum units_axis unit;
};

struct ros_read {
    const struct import_settings *settings;
    struct imported *out;
    struct import_text text; /* its report */
    struct ros_joint joint[IMPORT_COLUMNS_MAX];
    uint32_t joints;
    int64_t t_ns_q12; /* of the point before; -1: none yet */
    bool has_vel, has_acc;
};

/* --- joints --- */

static int ros_joint(struct ros_read *self, struct import_column *column)
{
    struct ros_joint *joint = &self->joint[self->joints++];

    if (column->axis < 0)
        return 0;
    joint->axis =
        import_add_axis(&self->text, self->settings, self->out, column);
    if (joint->axis == NULL)
        return -1;
    joint->unit = self->settings->rig->axis[column->axis].unit;
    snprintf(column->unit, sizeof column->unit, "%s",
             joint->unit == UNITS_AXIS_MM ? "m" : "rad");
    if (joint->unit < UNITS_AXIS_COUNT)
        return 0;
    return yaml_report_at(
        &self->text.report, column->place,
        "axis %s is in counts, expected one in mm, deg, rad or "
        "rev: ROS has metres and radians",
        joint->axis->name);
}

static int ros_joints(struct ros_read *self, const struct yaml_value *list)
{
    struct yaml_value item = yaml_value_at(list, 0);
    uint32_t count;
    if (yaml_value_list(list, 1, IMPORT_COLUMNS_MAX, &count) < 0)
        return -1;
    for (item.node = yaml_value_node(list)->first; item.node != 0;
         item.node = yaml_value_node(&item)->next) {
        const char *name = yaml_value_text(&item);
        if (name == NULL ||
            import_add_column(&self->text,
                              yaml_tree_place(item.tree, item.node), self->out,
                              name, name) < 0)
            return -1;
    }
    if (import_name_columns(&self->text, self->settings, self->out) < 0)
        return -1;
    for (uint32_t i = 0; i < count; i++)
        if (ros_joint(self, &self->out->column[i]) < 0)
            return -1;
    return 0;
}

/* --- points --- */

/* The value is in rad or m, by time to a power. */
static int ros_number(const struct ros_joint *joint,
                      const struct yaml_value *value,
                      enum units_quantity quantity, int64_t *to)
{
    static const char *const per[] = { "", "/s", "/s2" };
    const struct units_context context = { .unit = joint->unit };
    char text[ROS_NUMBER_MAX], sentence[UNITS_SENTENCE_MAX];
    const char *number = yaml_value_text(value);
    int length;
    if (number == NULL)
        return -1;
    length = snprintf(text, sizeof text, "%s %s%s", number,
                      joint->unit == UNITS_AXIS_MM ? "m" : "rad",
                      per[quantity - UNITS_POSITION]);
    if (length < 0 || (size_t)length >= sizeof text)
        return yaml_value_refuse(value, "is too long a number");
    if (units_parse(text, quantity, &context, to, sentence) == 0)
        return 0;
    return yaml_report_at(&value->tree->report,
                          yaml_tree_place(value->tree, value->node), "%s %s",
                          value->name, sentence);
}

static void ros_set(struct motion_key *key, enum units_quantity quantity,
                    int64_t value_q32)
{
    if (quantity == UNITS_POSITION) {
        key->pos_q32 = value_q32;
    } else if (quantity == UNITS_VELOCITY) {
        key->has_vel = true;
        key->vel = motion_real_from_q(value_q32, 32);
    } else {
        key->has_acc = true;
        key->acc = motion_real_from_q(value_q32, 32);
    }
}

/* A list of a point, into the keys that the point has begun. */
static int ros_values(struct ros_read *self, const struct yaml_value *list,
                      enum units_quantity quantity)
{
    struct yaml_value item = yaml_value_at(list, 0);
    uint32_t count, i = 0;
    if (yaml_value_list(list, 0, IMPORT_COLUMNS_MAX, &count) < 0)
        return -1;
    if (count != self->joints)
        return yaml_value_refuse(list, "has %u %s for %u %s", count,
                                 number_word(count, "number", "numbers"),
                                 self->joints,
                                 number_word(self->joints, "joint", "joints"));
    for (item.node = yaml_value_node(list)->first; item.node != 0;
         item.node = yaml_value_node(&item)->next, i++) {
        const struct ros_joint *joint = &self->joint[i];
        int64_t value_q32;
        if (joint->axis == NULL)
            continue;
        if (ros_number(joint, &item, quantity, &value_q32) < 0)
            return -1;
        ros_set(&joint->axis->key[joint->axis->key_count - 1].key, quantity,
                value_q32);
    }
    return 0;
}

/* An empty list is none. */
static bool ros_has(const struct yaml_value *point, const char *name,
                    struct yaml_value *list)
{
    *list = (struct yaml_value){ point->tree, yaml_fields_find(point, name),
                                 name, ROS_PER_POINT };
    return list->node != 0 && !(yaml_value_node(list)->kind == YAML_TREE_LIST &&
                                yaml_value_node(list)->length == 0);
}

/* A member that ROS 2 and ROS 1 name differently; 0 where it is not there. */
static int ros_part(const struct yaml_value *map, const char *name,
                    const char *name1, int64_t most, int64_t *to)
{
    struct yaml_value part = { map->tree, yaml_fields_find(map, name), name,
                               "a whole number" };
    if (part.node == 0)
        part.node = yaml_fields_find(map, name1);
    *to = 0;
    return part.node == 0 ? 0 : yaml_value_integer(&part, 0, most, to);
}

static int ros_time(struct ros_read *self, const struct yaml_value *point)
{
    const struct yaml_value time = {
        point->tree, yaml_fields_find(point, "time_from_start"),
        "time_from_start", "sec and nanosec, later than the point before"
    };
    int64_t s, ns, t_ns_q12;
    if (time.node == 0)
        return yaml_value_refuse(point, "has no time_from_start");
    if (yaml_value_need(&time, YAML_TREE_MAP) < 0 ||
        ros_part(&time, "sec", "secs", ROS_SECONDS_MAX, &s) < 0 ||
        ros_part(&time, "nanosec", "nsecs", 999999999, &ns) < 0)
        return -1;
    if (s > INT64_MAX / MOTION_FIXED_S_Q12 - 1)
        return yaml_value_refuse(&time, "is beyond 26 days");
    t_ns_q12 = s * MOTION_FIXED_S_Q12 + ns * MOTION_FIXED_NS_Q12;
    if (t_ns_q12 <= self->t_ns_q12)
        return yaml_value_refuse(&time, "does not increase");
    self->t_ns_q12 = t_ns_q12;
    return 0;
}

static int ros_begin_keys(struct ros_read *self, const struct yaml_value *point)
{
    const struct plan_place place = yaml_tree_place(point->tree, point->node);
    for (uint32_t i = 0; i < self->joints; i++) {
        struct plan_axis *axis = self->joint[i].axis;
        struct plan_key *key =
            axis == NULL ? NULL : import_add_key(&self->text, place, axis);
        if (axis != NULL && key == NULL)
            return -1;
        if (key != NULL)
            key->key.t_ns_q12 = self->t_ns_q12;
    }
    return 0;
}

static int ros_point(struct ros_read *self, const struct yaml_value *point,
                     bool first)
{
    struct yaml_value pos, vel, acc;
    if (yaml_value_need(point, YAML_TREE_MAP) < 0)
        return -1;
    const bool has_pos = ros_has(point, "positions", &pos);
    const bool has_vel = ros_has(point, "velocities", &vel);
    const bool has_acc = ros_has(point, "accelerations", &acc);
    if (!has_pos)
        return yaml_value_refuse(point, "has no positions");
    if (first)
        self->has_vel = has_vel, self->has_acc = has_acc;
    if (has_vel != self->has_vel || has_acc != self->has_acc)
        return yaml_value_refuse(point, "has other lists than the first");
    if (has_acc && !has_vel)
        return yaml_value_refuse(point, "has accelerations and no velocities");
    if (ros_time(self, point) < 0 || ros_begin_keys(self, point) < 0 ||
        ros_values(self, &pos, UNITS_POSITION) < 0 ||
        (has_vel && ros_values(self, &vel, UNITS_VELOCITY) < 0))
        return -1;
    return has_acc ? ros_values(self, &acc, UNITS_ACCELERATION) : 0;
}

static int ros_points(struct ros_read *self, const struct yaml_value *list)
{
    struct yaml_value item = yaml_value_at(list, 0);
    uint32_t count, i = 0;
    item.name = "the point";
    item.expected = "positions, perhaps velocities and accelerations, and "
                    "time_from_start";
    if (yaml_value_list(list, 1, PLAN_KEYS_MAX, &count) < 0)
        return -1;
    for (item.node = yaml_value_node(list)->first; item.node != 0;
         item.node = yaml_value_node(&item)->next, i++) {
        plan_progress_tell(self->settings->progress, "reading", "points", i,
                           count);
        if (ros_point(self, &item, i == 0) < 0)
            return -1;
    }
    return 0;
}

/* --- the message --- */

static void ros_choose_curve(struct ros_read *self)
{
    for (uint32_t i = 0; i < self->joints; i++)
        if (self->joint[i].axis != NULL && self->has_vel)
            self->joint[i].axis->curve =
                self->has_acc ? PLAN_CURVE_QUINTIC : PLAN_CURVE_HERMITE;
}

static int ros_message(struct ros_read *self, const struct yaml_tree *tree)
{
    static const char *const wrapper[] = { "trajectory", "joint_trajectory" };
    struct yaml_value map = { tree, 0, "the message",
                              "a map with joint_names and points" };
    struct yaml_value names = { tree, 0, "joint_names", "a list of names" };
    struct yaml_value points = { tree, 0, "points", "a list of points" };
    if (yaml_value_need(&map, YAML_TREE_MAP) < 0)
        return -1;
    for (size_t i = 0; i < ARRAY_LEN(wrapper); i++) {
        const uint32_t inner = yaml_fields_find(&map, wrapper[i]);
        if (inner != 0)
            map.node = inner;
    }
    if (yaml_value_need(&map, YAML_TREE_MAP) < 0)
        return -1;
    names.node = yaml_fields_find(&map, names.name);
    points.node = yaml_fields_find(&map, points.name);
    if (names.node == 0 || points.node == 0)
        return yaml_value_refuse(&map, "has no %s",
                                 names.node == 0 ? names.name : points.name);
    if (ros_joints(self, &names) < 0 || ros_points(self, &points) < 0)
        return -1;
    ros_choose_curve(self);
    return 0;
}

int import_ros(const struct files *files, const char *path,
               const struct import_settings *settings,
               struct imported *imported, char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct ros_read self = { .settings = settings,
                             .out = imported,
                             .text.report = report,
                             .t_ns_q12 = -1 };
    struct yaml_tree tree;
    int err;

    *imported =
        (struct imported){ .fps = settings->fps, .column_word = "joint" };
    if (yaml_tree_load(files, &tree, &report) < 0)
        return -1;
    err = ros_message(&self, &tree);
    yaml_tree_free(&tree);
    if (err < 0)
        move_free(&imported->move);
    return err;
}
