/* firmware/host/rig/kinematics/rig_head.c - kinematics: the head, the turntable, the motors of
 * the lens. */
#include "firmware/host/rig/kinematics/rig_kinematics.h"

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

int rig_read_head(void *reader, const struct yaml_value *value, void *out)
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

int rig_read_table(void *reader, const struct yaml_value *value, void *out)
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

int rig_read_lens(void *reader, const struct yaml_value *value, void *out)
{
    return yaml_fields_read(value, &rig_lens_shape, reader, out);
}
