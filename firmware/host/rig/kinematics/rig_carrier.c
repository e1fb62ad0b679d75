/* firmware/host/rig/kinematics/rig_carrier.c - kinematics: linear axes, a circular rail, a
 * gantry, a jib. */
#include "firmware/host/rig/kinematics/rig_kinematics.h"

#include "motion/core/err.h"

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

int rig_read_linear(void *reader, const struct yaml_value *value, void *out)
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
      "yes or no: whether the head turns with the carriage", yaml_read_bool,
      offsetof(struct motion_arc, is_turning) },
    { "axis", YAML_REQUIRED, "a map with axis, offset and reversed",
      rig_read_arc_axis, offsetof(struct motion_arc, axis) },
};
const struct yaml_shape rig_arc_shape = { "arc", rig_arc_fields,
                                          ARRAY_LEN(rig_arc_fields) };

int rig_read_arc(void *reader, const struct yaml_value *value, void *out)
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

int rig_read_gantry(void *reader, const struct yaml_value *value, void *out)
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

int rig_read_jib(void *reader, const struct yaml_value *value, void *out)
{
    struct motion_carrier *carrier = out;

    carrier->kind = &motion_carrier_jib;
    carrier->as.jib = (struct motion_jib){ .foot = motion_vec_zero(),
                                           .drop = motion_vec_zero(),
                                           .mount = MOTION_JIB_LEVEL };
    return yaml_fields_read(value, &rig_jib_shape, reader, &carrier->as.jib);
}
