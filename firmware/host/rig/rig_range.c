/* firmware/host/rig/rig_range.c - does the range of a Modbus axis fit
 * the registers that its drive has for positions? */
#include <inttypes.h>
#include <limits.h>

#include "firmware/host/rig/rig_parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* What a register can say, of so many counts each num / den. */
struct range_register {
    const char *name;
    int64_t num, den, min, max;
};

/* To the nearest whole one; beyond the format it is beyond any register. */
static int64_t range_value(const struct rig_axis *axis,
                           const struct range_register *reg, int64_t pos_q32)
{
    int64_t counts_q32, value_q32;

    if (motion_fixed_muldiv(pos_q32, axis->counts_num, axis->counts_den,
                            &counts_q32) < 0 ||
        motion_fixed_muldiv(counts_q32, reg->num, reg->den, &value_q32) < 0)
        return (pos_q32 < 0) == (axis->counts_num < 0) ? INT64_MAX : INT64_MIN;
    return (value_q32 >> 32) + (value_q32 >> 31 & 1);
}

/* Where slew homes, where the drive counts from is not known yet: then the
 * length of the range is all there is to judge.  After a homing by the drive it
 * counts from 0 at the home point. */
static bool range_fits(const struct rig_axis *axis,
                       const struct range_register *reg, int64_t value[2])
{
    const enum homing_by by = axis->homing.by;
    const int64_t zero_q32 = by == HOMING_DRIVE ? axis->homing.pos_q32 : 0;
    const int64_t low =
        range_value(axis, reg, axis->limit.pos_min_q32 - zero_q32);
    const int64_t high =
        range_value(axis, reg, axis->limit.pos_max_q32 - zero_q32);

    value[0] = low < high ? low : high;
    value[1] = low < high ? high : low;
    if (by == HOMING_SWITCH || by == HOMING_HERE)
        return (uint64_t)value[1] - (uint64_t)value[0] <=
               (uint64_t)reg->max - (uint64_t)reg->min;
    return value[0] >= reg->min && value[1] <= reg->max;
}

static int range_check(const struct yaml_value *value,
                       const struct rig_axis *axis,
                       const struct range_register *reg)
{
    int64_t need[2];

    if (range_fits(axis, reg, need))
        return 0;
    return yaml_value_refuse(value,
                             "needs %" PRId64 " .. %" PRId64
                             " for its range in the %s of its drive, which "
                             "takes %" PRId64 " .. %" PRId64,
                             need[0], need[1], reg->name, reg->min, reg->max);
}

static int range_check_group(const struct yaml_value *value,
                             const struct rig_axis *axis,
                             const struct modbus_map_group *group,
                             const char *name)
{
    for (unsigned i = 0; i < group->count; i++) {
        const struct modbus_map_field *field = &group->field[i];
        const struct range_register reg = { name, field->num, field->den,
                                            field->min, field->max };

        if (field->quantity == MODBUS_POSITION &&
            range_check(value, axis, &reg) < 0)
            return -1;
    }
    return 0;
}

int rig_check_modbus_range(const struct yaml_value *value,
                           const struct modbus_map *map,
                           const struct rig_axis *axis)
{
    struct range_register reg = { "position that is read", 1, 1, 0, 0 };

    modbus_map_range(map->item[map->position].type, &reg.min, &reg.max);
    if (range_check(value, axis, &reg) < 0)
        return -1;
    return axis->point_to_point
               ? range_check_group(value, axis, &map->move, "group move")
               : range_check_group(value, axis, &map->stream, "group stream");
}
