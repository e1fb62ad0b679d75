/* firmware/host/rig/rig_kinematics.c - how the axes of a rig place its camera.
 *
 * An arm (rig_arm.c), or a carrier (linear, arc, rail, gantry or jib), the head on it, a turntable before it
 * and the motors of its lens; what they are is motion/kinematics. */
#include "firmware/host/rig/rig_parts.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* An axis and its map to a joint. */
struct rig_joint {
    enum units_axis unit; /* that it must have */
    struct plan_rig_axis axis;
    struct motion_axis_map map;
    struct motion_dir direction;
};

static struct plan_rig *rig_kinematics_of(void *reader)
{
    return ((struct rig_reader *)reader)->rig->kinematics;
}

/* ---- values -------------------------------------------------------------- */

static int rig_read_numbers(struct rig_reader *self,
                            const struct yaml_value *value,
                            enum units_quantity quantity, uint32_t count,
                            int64_t q32[])
{
    struct yaml_value item = *value;
    uint32_t given;

    if (yaml_value_list(value, count, count, &given) < 0)
        return -1;
    item.node = yaml_value_node(value)->first;
    item.expected = quantity == UNITS_RATIO ? "a number" : "a length";
    for (uint32_t i = 0; i < count; i++) {
        if (rig_read_quantity(self, &item, quantity, &q32[i]) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
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

static int rig_read_length(void *reader, const struct yaml_value *value,
                           void *out)
{
    return rig_read_positive(reader, value, UNITS_POSITION, out);
}

int rig_read_yes(void *reader, const struct yaml_value *value, void *out)
{
    (void)reader;
    return yaml_value_bool(value, out);
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

static int rig_read_joint_axis(void *reader, const struct yaml_value *value,
                               void *out)
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
    { "reversed", YAML_OPTIONAL, "yes or no", rig_read_yes,
      offsetof(struct rig_joint, map.is_reversed) },
    { "direction", YAML_REQUIRED, "a direction such as [1, 0, 0]",
      rig_read_direction, offsetof(struct rig_joint, direction) },
};
const struct yaml_shape rig_joint_shape = { "joint", rig_joint_fields,
                                            ARRAY_LEN(rig_joint_fields) - 1 };
const struct yaml_shape rig_slide_shape = { "slide", rig_joint_fields,
                                            ARRAY_LEN(rig_joint_fields) };

static int rig_read_joint(struct rig_reader *self,
                          const struct yaml_value *value,
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

/* ---- linear axes --------------------------------------------------------- */

static int rig_read_slides(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct motion_linear *linear = out;
    struct yaml_value item = *value;
    uint32_t count;

    if (yaml_value_list(value, 1, MOTION_LINEAR_AXES_MAX, &count) < 0)
        return -1;
    item.name = "slide";
    item.expected = "a map with axis, direction, offset and reversed";
    item.node = yaml_value_node(value)->first;
    for (linear->count = 0; linear->count < count;) {
        struct rig_joint joint;
        if (rig_read_joint(reader, &item, &rig_slide_shape, UNITS_AXIS_MM,
                           &joint) < 0)
            return -1;
        rig_kinematics_of(reader)->carrier[linear->count] = joint.axis;
        linear->direction[linear->count] = joint.direction;
        linear->axis[linear->count++] = joint.map;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

static const struct yaml_field rig_linear_fields[] = {
    { "origin", YAML_OPTIONAL, "a point such as [0 mm, 0 mm, 1.2 m]",
      rig_read_point, offsetof(struct motion_linear, origin) },
    { "axes", YAML_REQUIRED,
      "a list of 1 .. 3 maps with axis, direction, offset and reversed",
      rig_read_slides, 0 },
};
const struct yaml_shape rig_linear_shape = { "linear", rig_linear_fields,
                                             ARRAY_LEN(rig_linear_fields) };

/* Linearly dependent directions: some positions are unreachable, others have any
 * number of solutions. */
static bool rig_is_dependent(const struct motion_linear *linear)
{
    struct motion_dir across, rest;

    if (linear->count < 2)
        return false;
    if (motion_dir_perpendicular(linear->direction[1], linear->direction[0],
                                 &across) < 0)
        return true;
    if (linear->count < 3)
        return false;
    if (motion_dir_perpendicular(linear->direction[2], linear->direction[0],
                                 &rest) < 0)
        return true;
    return motion_dir_perpendicular(rest, across, &rest) < 0;
}

static int rig_read_linear(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct motion_carrier *carrier = out;
    struct motion_linear *linear = &carrier->as.linear;

    carrier->kind = &motion_carrier_linear;
    linear->origin = motion_vec_zero();
    if (yaml_fields_read(value, &rig_linear_shape, reader, linear) < 0)
        return -1;
    return rig_is_dependent(linear)
               ? yaml_value_refuse(value, "has linearly dependent axes")
               : 0;
}

/* ---- a circular rail ------------------------------------------------------- */

static int rig_read_arc_axis(void *reader, const struct yaml_value *value,
                             void *out)
{
    return rig_read_carrier_axis(reader, value, UNITS_AXIS_MM, 0, out);
}

static const struct yaml_field rig_arc_fields[] = {
    { "centre", YAML_REQUIRED, "a point such as [0 mm, 0 mm, 1.2 m]",
      rig_read_point, offsetof(struct motion_arc, centre) },
    { "radius", YAML_REQUIRED, "a length above zero", rig_read_length,
      offsetof(struct motion_arc, radius_q32) },
    { "normal", YAML_OPTIONAL, "the axis of the circle, such as [0, 0, 1]",
      rig_read_direction, offsetof(struct motion_arc, normal) },
    { "start", YAML_OPTIONAL,
      "from the centre to where the axis is 0, such as [1, 0, 0]",
      rig_read_direction, offsetof(struct motion_arc, start) },
    { "turning", YAML_OPTIONAL,
      "yes or no: whether the head turns with the carriage", rig_read_yes,
      offsetof(struct motion_arc, is_turning) },
    { "axis", YAML_REQUIRED, "a map with axis, offset and reversed",
      rig_read_arc_axis, offsetof(struct motion_arc, axis) },
};
const struct yaml_shape rig_arc_shape = { "arc", rig_arc_fields,
                                          ARRAY_LEN(rig_arc_fields) };

static int rig_read_arc(void *reader, const struct yaml_value *value, void *out)
{
    const int64_t one = (int64_t)1 << 62;
    struct motion_carrier *carrier = out;
    struct motion_arc *arc = &carrier->as.arc;

    carrier->kind = &motion_carrier_arc;
    *arc = (struct motion_arc){ .normal = { { 0, 0, one } },
                                .start = { { one, 0, 0 } },
                                .is_turning = true };
    if (yaml_fields_read(value, &rig_arc_shape, reader, arc) < 0)
        return -1;
    if (motion_arc_plane(arc, motion_vec_from_dir(arc->normal),
                         motion_vec_from_dir(arc->start)) < 0)
        return yaml_value_refuse(value, "has parallel normal and start");
    return 0;
}

/* ---- a gantry on two rails ----------------------------------------------- */

static int rig_read_rails(void *reader, const struct yaml_value *value,
                          void *out)
{
    const int64_t *at_y_q32 = out;

    if (rig_read_numbers(reader, value, UNITS_POSITION, 2, out) < 0)
        return -1;
    return at_y_q32[0] == at_y_q32[1]
               ? yaml_value_refuse(value, "are at the same place")
               : 0;
}

static int rig_read_x1(void *reader, const struct yaml_value *value, void *out)
{
    return rig_read_carrier_axis(reader, value, UNITS_AXIS_MM, 0, out);
}

static int rig_read_x2(void *reader, const struct yaml_value *value, void *out)
{
    return rig_read_carrier_axis(reader, value, UNITS_AXIS_MM, 1, out);
}

static int rig_read_y(void *reader, const struct yaml_value *value, void *out)
{
    return rig_read_carrier_axis(reader, value, UNITS_AXIS_MM, 2, out);
}

static int rig_read_z(void *reader, const struct yaml_value *value, void *out)
{
    return rig_read_carrier_axis(reader, value, UNITS_AXIS_MM, 3, out);
}

static const struct yaml_field rig_gantry_fields[] = {
    { "rails", YAML_REQUIRED, "y of both rails, such as [-1 m, 1 m]",
      rig_read_rails, offsetof(struct motion_gantry, at_y_q32) },
    { "x1", YAML_REQUIRED, "a map with axis, offset and reversed", rig_read_x1,
      offsetof(struct motion_gantry, axis[0]) },
    { "x2", YAML_REQUIRED, "a map with axis, offset and reversed", rig_read_x2,
      offsetof(struct motion_gantry, axis[1]) },
    { "y", YAML_REQUIRED, "a map with axis, offset and reversed", rig_read_y,
      offsetof(struct motion_gantry, axis[2]) },
    { "z", YAML_REQUIRED, "a map with axis, offset and reversed", rig_read_z,
      offsetof(struct motion_gantry, axis[3]) },
};
const struct yaml_shape rig_gantry_shape = { "gantry", rig_gantry_fields,
                                             ARRAY_LEN(rig_gantry_fields) };

static int rig_read_gantry(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct motion_carrier *carrier = out;

    carrier->kind = &motion_carrier_gantry;
    return yaml_fields_read(value, &rig_gantry_shape, reader,
                            &carrier->as.gantry);
}

/* ---- a jib --------------------------------------------------------------- */

const char *const rig_jib_mounts[RIG_JIB_MOUNTS] = {
    [MOTION_JIB_BOOM] = "boom",
    [MOTION_JIB_LEVEL] = "level",
    [MOTION_JIB_SPACE] = "counter-rotating",
};

static int rig_read_jib_mount(void *reader, const struct yaml_value *value,
                              void *out)
{
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, rig_jib_mounts, RIG_JIB_MOUNTS, &index) < 0)
        return -1;
    *(enum motion_jib_mount *)out = (enum motion_jib_mount)index;
    return 0;
}

static int rig_read_boom_pan(void *reader, const struct yaml_value *value,
                             void *out)
{
    return rig_read_carrier_axis(reader, value, UNITS_AXIS_DEG, 0, out);
}

static int rig_read_boom_tilt(void *reader, const struct yaml_value *value,
                              void *out)
{
    return rig_read_carrier_axis(reader, value, UNITS_AXIS_DEG, 1, out);
}

/* The axis's limits are those of the boom. */
static int rig_read_extend(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct motion_jib *jib = out;
    const struct rig *rig = ((struct rig_reader *)reader)->rig;
    struct motion_axis_map *map = &jib->axis[2];

    if (rig_read_carrier_axis(reader, value, UNITS_AXIS_MM, 2, map) < 0)
        return -1;
    const struct plan_limit *limit =
        &rig->axis[rig->kinematics->carrier[2].axis].limit;
    if (motion_axis_coordinate(
            map, map->is_reversed ? limit->pos_max_q32 : limit->pos_min_q32,
            &jib->extend_min_q32) < 0 ||
        motion_axis_coordinate(
            map, map->is_reversed ? limit->pos_min_q32 : limit->pos_max_q32,
            &jib->extend_max_q32) < 0)
        return yaml_value_refuse(value, "exceeds the range of lengths");
    return 0;
}

static const struct yaml_field rig_jib_fields[] = {
    { "foot", YAML_REQUIRED,
      "where the boom's axes meet, such as [0 mm, 0 mm, 1.4 m]", rig_read_point,
      offsetof(struct motion_jib, foot) },
    { "length", YAML_REQUIRED, "of the boom, above zero", rig_read_length,
      offsetof(struct motion_jib, length_q32) },
    { "drop", YAML_OPTIONAL,
      "from the tip to the head, [forward, left, up], such as [0 mm, 0 mm, "
      "-300 mm]",
      rig_read_point, offsetof(struct motion_jib, drop) },
    { "mount", YAML_OPTIONAL, "boom, level or counter-rotating",
      rig_read_jib_mount, offsetof(struct motion_jib, mount) },
    { "pan", YAML_REQUIRED, "a map with axis, offset and reversed",
      rig_read_boom_pan, offsetof(struct motion_jib, axis[0]) },
    { "tilt", YAML_REQUIRED, "a map with axis, offset and reversed",
      rig_read_boom_tilt, offsetof(struct motion_jib, axis[1]) },
    { "extend", YAML_OPTIONAL, "a map with axis, offset and reversed",
      rig_read_extend, 0 },
};
const struct yaml_shape rig_jib_shape = { "jib", rig_jib_fields,
                                          ARRAY_LEN(rig_jib_fields) };

static int rig_read_jib(void *reader, const struct yaml_value *value, void *out)
{
    struct motion_carrier *carrier = out;

    carrier->kind = &motion_carrier_jib;
    carrier->as.jib = (struct motion_jib){ .foot = motion_vec_zero(),
                                           .drop = motion_vec_zero(),
                                           .mount = MOTION_JIB_LEVEL };
    return yaml_fields_read(value, &rig_jib_shape, reader, &carrier->as.jib);
}

/* ---- head, table, lens --------------------------------------------------- */

static int rig_read_head_axis(void *reader, const struct yaml_value *value,
                              enum motion_head_axis axis)
{
    struct plan_rig *rig = rig_kinematics_of(reader);
    struct rig_joint joint;

    if (rig_read_joint(reader, value, &rig_joint_shape, UNITS_AXIS_DEG,
                       &joint) < 0)
        return -1;
    rig->head[axis] = joint.axis;
    rig->rig.head.axis[axis] = joint.map;
    return 0;
}

static int rig_read_pan(void *reader, const struct yaml_value *value, void *out)
{
    (void)out;
    return rig_read_head_axis(reader, value, MOTION_HEAD_PAN);
}

static int rig_read_tilt(void *reader, const struct yaml_value *value,
                         void *out)
{
    (void)out;
    return rig_read_head_axis(reader, value, MOTION_HEAD_TILT);
}

static int rig_read_roll(void *reader, const struct yaml_value *value,
                         void *out)
{
    (void)out;
    return rig_read_head_axis(reader, value, MOTION_HEAD_ROLL);
}

static int rig_read_nodal(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct motion_nodal *nodal = out;
    int64_t q32[3];

    if (rig_read_place(reader, value, q32) < 0)
        return -1;
    *nodal = (struct motion_nodal){ q32[0], q32[1], q32[2] };
    return 0;
}

static int rig_read_forward(void *reader, const struct yaml_value *value,
                            void *out)
{
    return rig_read_direction(reader, value,
                              &((struct plan_rig *)out)->forward);
}

static int rig_read_up(void *reader, const struct yaml_value *value, void *out)
{
    return rig_read_direction(reader, value, &((struct plan_rig *)out)->up);
}

static const struct yaml_field rig_head_fields[] = {
    { "forward", YAML_OPTIONAL,
      "where it looks with pan and tilt at 0, such as [1, 0, 0]",
      rig_read_forward, 0 },
    { "up", YAML_OPTIONAL, "a direction across forward, such as [0, 0, 1]",
      rig_read_up, 0 },
    { "nodal", YAML_OPTIONAL,
      "from where the axes meet to the entrance pupil, [forward, right, up]",
      rig_read_nodal, offsetof(struct plan_rig, rig.head.nodal) },
    { "pan", YAML_REQUIRED, "a map with axis, offset and reversed",
      rig_read_pan, 0 },
    { "tilt", YAML_REQUIRED, "a map with axis, offset and reversed",
      rig_read_tilt, 0 },
    { "roll", YAML_OPTIONAL, "a map with axis, offset and reversed",
      rig_read_roll, 0 },
};
const struct yaml_shape rig_head_shape = { "head", rig_head_fields,
                                           ARRAY_LEN(rig_head_fields) };

static int rig_read_head(void *reader, const struct yaml_value *value,
                         void *out)
{
    struct plan_rig *rig = out;

    if (yaml_fields_read(value, &rig_head_shape, reader, rig) < 0)
        return -1;
    if (motion_mount_level(motion_vec_from_dir(rig->forward),
                           motion_vec_from_dir(rig->up),
                           &rig->rig.carrier.level) < 0)
        return yaml_value_refuse(value, "has parallel forward and up");
    return 0;
}

static int rig_read_table_axis(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct plan_rig *rig = out;
    struct rig_joint joint;

    if (rig_read_joint(reader, value, &rig_joint_shape, UNITS_AXIS_DEG,
                       &joint) < 0)
        return -1;
    rig->table = joint.axis;
    rig->table_map = joint.map;
    return 0;
}

static const struct yaml_field rig_table_fields[] = {
    { "centre", YAML_REQUIRED, "a point such as [2 m, 0 mm, 900 mm]",
      rig_read_place, offsetof(struct plan_rig, centre_q32) },
    { "axis", YAML_REQUIRED, "a map with axis, offset and reversed",
      rig_read_table_axis, 0 },
};
const struct yaml_shape rig_table_shape = { "table", rig_table_fields,
                                            ARRAY_LEN(rig_table_fields) };

static int rig_read_table(void *reader, const struct yaml_value *value,
                          void *out)
{
    return yaml_fields_read(value, &rig_table_shape, reader, out);
}

static int rig_read_lens_axis(void *reader, const struct yaml_value *value,
                              void *out)
{
    struct rig_joint joint = { .unit = UNITS_AXIS_MM };
    const int err = rig_read_joint_axis(reader, value, &joint);

    *(struct plan_rig_axis *)out = joint.axis;
    return err;
}

static const struct yaml_field rig_lens_fields[] = {
    { "focus", YAML_OPTIONAL, "an axis in mm: the distance in focus",
      rig_read_lens_axis, offsetof(struct plan_rig, lens[PLAN_LENS_FOCUS]) },
    { "zoom", YAML_OPTIONAL, "an axis in mm: the focal length",
      rig_read_lens_axis, offsetof(struct plan_rig, lens[PLAN_LENS_ZOOM]) },
};
const struct yaml_shape rig_lens_shape = { "lens", rig_lens_fields,
                                           ARRAY_LEN(rig_lens_fields) };

static int rig_read_lens(void *reader, const struct yaml_value *value,
                         void *out)
{
    return yaml_fields_read(value, &rig_lens_shape, reader, out);
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
