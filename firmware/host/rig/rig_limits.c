/* firmware/host/rig/rig_limits.c - an axis's limits, stop and following error.
 */
#include "firmware/host/rig/rig_parts.h"

int rig_read_ends(struct rig_reader *reader, const struct yaml_value *value,
                  int64_t *low_q32, int64_t *high_q32)
{
    struct yaml_value end[2];

    if (yaml_value_pair(value, end) < 0 ||
        rig_read_quantity(reader, &end[0], UNITS_POSITION, low_q32) < 0 ||
        rig_read_quantity(reader, &end[1], UNITS_POSITION, high_q32) < 0)
        return -1;
    if (*low_q32 >= *high_q32)
        return yaml_value_refuse(&end[1], "ends where it begins or before");
    return 0;
}

static int rig_read_range(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct plan_limit *limit = out;

    return rig_read_ends(reader, value, &limit->pos_min_q32,
                         &limit->pos_max_q32);
}

static const struct yaml_field rig_limit_fields[] = {
    { "position", YAML_REQUIRED, "the range as [lowest, highest]",
      rig_read_range, 0 },
    { "velocity", YAML_REQUIRED, "the highest speed, such as 300 mm/s",
      rig_read_velocity, offsetof(struct plan_limit, vel_q32) },
    { "acceleration", YAML_REQUIRED,
      "the highest acceleration, such as 400 mm/s2", rig_read_acceleration,
      offsetof(struct plan_limit, acc_q32) },
    { "jerk", YAML_OPTIONAL, "the highest jerk, such as 2000 mm/s3",
      rig_read_jerk, offsetof(struct plan_limit, jerk_q32) },
};
const struct yaml_shape rig_limit_shape = { "limits", rig_limit_fields,
                                            ARRAY_LEN(rig_limit_fields) };

int rig_read_limits(void *reader, const struct yaml_value *value, void *out)
{
    return yaml_fields_read(value, &rig_limit_shape, reader, out);
}

static int rig_read_stop_acceleration(void *reader,
                                      const struct yaml_value *value, void *out)
{
    const struct rig_reader *self = reader;

    if (rig_read_acceleration(reader, value, out) < 0)
        return -1;
    if (*(int64_t *)out < self->axis->limit.acc_q32)
        return yaml_value_refuse(value, "is below the axis's own limit");
    return rig_judge_stop(value, *(int64_t *)out, self->axis->limit.acc_q32,
                          false);
}

static int rig_read_stop_jerk(void *reader, const struct yaml_value *value,
                              void *out)
{
    const struct rig_reader *self = reader;

    if (rig_read_jerk(reader, value, out) < 0)
        return -1;
    if (self->axis->limit.jerk_q32 == 0)
        return yaml_value_refuse(value, "is given, but the axis has none among "
                                        "its limits");
    if (*(int64_t *)out < self->axis->limit.jerk_q32)
        return yaml_value_refuse(value, "is below the axis's own limit");
    return rig_judge_stop(value, *(int64_t *)out, self->axis->limit.jerk_q32,
                          true);
}

static const struct yaml_field rig_stop_fields[] = {
    { "acceleration", YAML_OPTIONAL,
      "an acceleration for stops after a fault, at least that of limits",
      rig_read_stop_acceleration, offsetof(struct rig_axis, stop_acc_q32) },
    { "jerk", YAML_OPTIONAL,
      "a jerk for stops after a fault, at least that of limits",
      rig_read_stop_jerk, offsetof(struct rig_axis, stop_jerk_q32) },
};
const struct yaml_shape rig_stop_shape = { "stop", rig_stop_fields,
                                           ARRAY_LEN(rig_stop_fields) };

int rig_read_stop(void *reader, const struct yaml_value *value, void *out)
{
    return yaml_fields_read(value, &rig_stop_shape, reader, out);
}

static int rig_read_floor(void *reader, const struct yaml_value *value,
                          void *out)
{
    return rig_read_positive(reader, value, UNITS_POSITION, out);
}

static int rig_read_following_time(void *reader, const struct yaml_value *value,
                                   void *out)
{
    return rig_read_time(reader, value, 0, 10000 * RIG_MS, RIG_US, out);
}

static const struct yaml_field rig_following_fields[] = {
    { "floor", YAML_REQUIRED,
      "the following error that is always allowed, such as 2 mm",
      rig_read_floor, offsetof(struct rig_axis, following_floor_q32) },
    { "time", YAML_OPTIONAL,
      "a time of 0 .. 10 s in whole us; the error may be this times the "
      "speed",
      rig_read_following_time, offsetof(struct rig_axis, following_k_ns) },
};
const struct yaml_shape rig_following_shape = {
    "following_error", rig_following_fields, ARRAY_LEN(rig_following_fields)
};

int rig_read_following(void *reader, const struct yaml_value *value, void *out)
{
    return yaml_fields_read(value, &rig_following_shape, reader, out);
}
