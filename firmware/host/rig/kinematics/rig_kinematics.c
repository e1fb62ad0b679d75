/* firmware/host/rig/kinematics/rig_kinematics.c - how the axes of a rig place its camera.
 *
 * An arm (rig_arm.c), or a carrier (rig_carrier.c, rig_rail.c), the head on it, a
 * turntable before it and the motors of its lens (rig_head.c); what they are is
 * motion/kinematics. */
#include "firmware/host/rig/kinematics/rig_kinematics.h"

#include "motion/core/err.h"

struct plan_rig *rig_kinematics_of(void *reader)
{
    return ((struct rig_reader *)reader)->rig->kinematics;
}

/* ---- values -------------------------------------------------------------- */

int rig_read_numbers(struct rig_reader *self, const struct yaml_value *value,
                     enum units_quantity quantity, uint32_t count,
                     int64_t q32[])
{
    return yaml_units_read_list(
        value, quantity, &self->units,
        quantity == UNITS_RATIO ? "a number" : "a length", count, q32);
}

int rig_read_place(void *reader, const struct yaml_value *value, void *out)
{
    return rig_read_numbers(reader, value, UNITS_POSITION, 3, out);
}

int rig_read_point(void *reader, const struct yaml_value *value, void *out)
{
    int64_t q32[3];

    if (rig_read_place(reader, value, q32) < 0)
        return -1;
    *(struct motion_vec *)out = motion_vec_from_q32(q32);
    return 0;
}

int rig_read_direction(void *reader, const struct yaml_value *value, void *out)
{
    int64_t q32[3];

    if (rig_read_numbers(reader, value, UNITS_RATIO, 3, q32) < 0)
        return -1;
    if (motion_vec_unit(motion_vec_from_q32(q32), out) < 0)
        return yaml_value_refuse(value, "has no direction");
    return 0;
}

int rig_read_length(void *reader, const struct yaml_value *value, void *out)
{
    return rig_read_positive(reader, value, UNITS_POSITION, out);
}

/* ---- axes ---------------------------------------------------------------- */

static bool rig_is_joint(const struct plan_rig *rig, uint32_t axis)
{
    const struct plan_rig_axis *const list[] = { rig->carrier, rig->head,
                                                 &rig->table, rig->lens,
                                                 rig->arm.axis };
    const int count[] = { MOTION_CARRIER_AXES_MAX, MOTION_HEAD_AXES, 1,
                          PLAN_LENSES, MOTION_ARM_JOINTS_MAX };

    for (unsigned k = 0; k < ARRAY_LEN(list); k++)
        for (int i = 0; i < count[k]; i++)
            if (list[k][i].is_given && list[k][i].axis == axis)
                return true;
    return false;
}

int rig_read_free_axis(const struct rig_reader *reader,
                       const struct yaml_value *value, unsigned *index)
{
    const struct rig *rig = reader->rig;
    const char *names[RIG_AXES_MAX];

    for (uint32_t i = 0; i < rig->axis_count; i++)
        names[i] = rig->axis[i].name;
    if (yaml_value_choice(value, names, rig->axis_count, index) < 0)
        return -1;
    return rig_is_joint(rig->kinematics, *index)
               ? yaml_value_refuse(value, "'%s' is in the kinematics already",
                                   names[*index])
               : 0;
}

int rig_read_joint_axis(void *reader, const struct yaml_value *value, void *out)
{
    struct rig_reader *self = reader;
    const struct rig *rig = self->rig;
    struct rig_joint *joint = out;
    unsigned index;

    if (rig_read_free_axis(self, value, &index) < 0)
        return -1;
    if (rig->axis[index].unit != joint->unit)
        return yaml_value_refuse(value, "'%s' is in %s, not in %s",
                                 rig->axis[index].name,
                                 units_axis_text(rig->axis[index].unit),
                                 units_axis_text(joint->unit));
    joint->axis = (struct plan_rig_axis){ true, index };
    self->units.unit = joint->unit;
    return 0;
}

static int rig_read_offset(void *reader, const struct yaml_value *value,
                           void *out)
{
    return rig_read_quantity(reader, value, UNITS_POSITION, out);
}

/* `direction` is the last: only slides have one. */
static const struct yaml_field rig_joint_fields[] = {
    { "axis", YAML_REQUIRED, "an axis of the rig", rig_read_joint_axis, 0 },
    { "offset", YAML_OPTIONAL, "where it is when the axis is at 0",
      rig_read_offset, offsetof(struct rig_joint, map.offset_q32) },
    { "reversed", YAML_OPTIONAL, "yes or no", yaml_read_bool,
      offsetof(struct rig_joint, map.is_reversed) },
    { "direction", YAML_REQUIRED, "a direction such as [1, 0, 0]",
      rig_read_direction, offsetof(struct rig_joint, direction) },
};
const struct yaml_shape rig_joint_shape = { "joint", rig_joint_fields,
                                            ARRAY_LEN(rig_joint_fields) - 1 };
const struct yaml_shape rig_slide_shape = { "slide", rig_joint_fields,
                                            ARRAY_LEN(rig_joint_fields) };

int rig_read_joint(struct rig_reader *self, const struct yaml_value *value,
                   const struct yaml_shape *shape, enum units_axis unit,
                   struct rig_joint *joint)
{
    const enum units_axis outer = self->units.unit;

    *joint = (struct rig_joint){ .unit = unit };
    const int err = yaml_fields_read(value, shape, self, joint);
    self->units.unit = outer;
    return err;
}

int rig_read_carrier_axis(void *reader, const struct yaml_value *value,
                          enum units_axis unit, int index,
                          struct motion_axis_map *map)
{
    struct rig_joint joint;

    if (rig_read_joint(reader, value, &rig_joint_shape, unit, &joint) < 0)
        return -1;
    rig_kinematics_of(reader)->carrier[index] = joint.axis;
    *map = joint.map;
    return 0;
}

/* ---- the whole ----------------------------------------------------------- */

/* The first RIG_CARRIERS are carriers, or the arm; one of them is given, and
 * without the arm the head. */
#define RIG_CARRIERS 6
static const struct yaml_field rig_kinematics_fields[] = {
    { "linear", YAML_OPTIONAL, "a map with origin and axes", rig_read_linear,
      offsetof(struct plan_rig, rig.carrier) },
    { "arc", YAML_OPTIONAL, "a map with centre, radius, normal, start and axis",
      rig_read_arc, offsetof(struct plan_rig, rig.carrier) },
    { "rail", YAML_OPTIONAL, "a map with points, turning and axis",
      rig_read_rail, offsetof(struct plan_rig, rig.carrier) },
    { "gantry", YAML_OPTIONAL, "a map with rails, x1, x2, y and z",
      rig_read_gantry, offsetof(struct plan_rig, rig.carrier) },
    { "jib", YAML_OPTIONAL,
      "a map with foot, length, drop, mount, pan, tilt and extend",
      rig_read_jib, offsetof(struct plan_rig, rig.carrier) },
    { "arm", YAML_OPTIONAL, "a map with joints and tool", rig_read_arm,
      offsetof(struct plan_rig, arm) },
    { "head", YAML_OPTIONAL,
      "a map with pan, tilt, roll, forward, up and nodal", rig_read_head, 0 },
    { "table", YAML_OPTIONAL, "a map with centre and axis", rig_read_table, 0 },
    { "lens", YAML_OPTIONAL, "a map with focus and zoom", rig_read_lens, 0 },
};
const struct yaml_shape rig_kinematics_shape = {
    "kinematics", rig_kinematics_fields, ARRAY_LEN(rig_kinematics_fields)
};

/* The whole camera is on the arm, or on a head. */
static int rig_check_kinematics(const struct yaml_value *value)
{
    static const char *const beside[] = { "head", "table", "lens" };
    const bool has_arm = yaml_fields_find(value, "arm") != 0;

    if (!has_arm && yaml_fields_find(value, "head") == 0)
        return yaml_value_refuse(value, "has no 'head', and no 'arm'");
    for (size_t i = 0; has_arm && i < ARRAY_LEN(beside); i++)
        if (yaml_fields_find(value, beside[i]) != 0)
            return yaml_value_refuse(value, "has a %s beside an arm",
                                     beside[i]);
    return 0;
}

int rig_read_kinematics(void *reader, const struct yaml_value *value, void *out)
{
    const int64_t one = (int64_t)1 << 62;
    struct rig_reader *self = reader;
    struct rig *rig = out;
    unsigned carriers = 0;

    if (yaml_value_need(value, YAML_TREE_MAP) < 0)
        return -1;
    for (unsigned i = 0; i < RIG_CARRIERS; i++)
        carriers += yaml_fields_find(value, rig_kinematics_fields[i].name) != 0;
    if (carriers > 1)
        return yaml_value_refuse(value, "has %u things that carry the head",
                                 carriers);
    if (rig_check_kinematics(value) < 0)
        return -1;
    rig->kinematics = memory_pool_new(&rig->memory, 1, sizeof *rig->kinematics);
    *rig->kinematics = (struct plan_rig){
        /* a tripod at the origin, where there is no carrier */
        .rig.carrier = { .kind = &motion_carrier_linear,
                         .as.linear.origin = motion_vec_zero() },
        .forward = { { one, 0, 0 } },
        .up = { { 0, 0, one } },
        .place = yaml_tree_place(value->tree, value->node),
    };
    self->units.unit = UNITS_AXIS_MM;
    return yaml_fields_read(value, &rig_kinematics_shape, self,
                            rig->kinematics);
}
