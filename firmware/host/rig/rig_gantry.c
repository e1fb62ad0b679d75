/* firmware/host/rig/rig_gantry.c - gantry: two rails of one bridge, each with a motor of
 * its own, that move as one (firmware/control/gantry.h). */
#include "firmware/host/rig/rig_parts.h"

#include <string.h>

#include "firmware/host/base/memory.h"

static int gantry_read_rail(struct rig_reader *self,
                            const struct yaml_value *value, uint32_t *out)
{
    char name[PLAN_NAME_MAX], list[QUOTE_LIST_MAX];
    struct yaml_value named = *value;

    if (yaml_value_copy(value, name, sizeof name) < 0)
        return -1;
    const int index = rig_axis_index(self->rig, name);
    if (index < 0) {
        named.expected = rig_axis_list(self->rig, list);
        return yaml_value_refuse(&named, "'%s' is not of the rig", name);
    }
    for (uint32_t i = 0; i < self->rig->gantry_count; i++)
        if (rig_gantry_other(&self->rig->gantry[i], (uint32_t)index) >= 0)
            return yaml_value_refuse(value, "%s is a rail of %s already", name,
                                     self->rig->gantry[i].name);
    *out = (uint32_t)index;
    return 0;
}

static int gantry_read_rails(void *reader, const struct yaml_value *value,
                             void *out)
{
    struct rig_reader *const self = reader;
    uint32_t *const axis = out;
    struct yaml_value item = { value->tree, yaml_value_node(value)->first,
                               "rail", "an axis of the rig" };
    uint32_t count;

    if (yaml_value_list(value, 2, 2, &count) < 0)
        return -1;
    for (uint32_t i = 0; i < count; i++) {
        if (gantry_read_rail(self, &item, &axis[i]) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    self->units.unit = self->rig->axis[axis[0]].unit;
    return axis[0] == axis[1]
               ? yaml_value_refuse(value, "are the same axis twice")
               : 0;
}

static int gantry_read_racking(void *reader, const struct yaml_value *value,
                               void *out)
{
    return rig_read_positive(reader, value, UNITS_POSITION, out);
}

static const struct yaml_field rig_rails_fields[] = {
    { "rails", YAML_REQUIRED, "two axes, such as [rail_left, rail_right]",
      gantry_read_rails, offsetof(struct rig_gantry, axis) },
    { "racking", YAML_REQUIRED,
      "how far the rails may be out of square, such as 2 mm",
      gantry_read_racking, offsetof(struct rig_gantry, racking_q32) },
};
const struct yaml_shape rig_rails_shape = { "rails", rig_rails_fields,
                                            ARRAY_LEN(rig_rails_fields) };

/* Refuse an axis without set points in every tick: it cannot be taken along. */
static int gantry_check_axis(const struct yaml_value *value,
                             const struct rig_axis *axis)
{
    if (axis->point_to_point)
        return yaml_value_refuse(
            value, "has %s, which goes by its drive's profile", axis->name);
    if (rig_kinds[axis->kind]->samples)
        return yaml_value_refuse(
            value, "has %s, which is on a board that plays its track alone",
            axis->name);
    if (axis->homing.by == HOMING_DRIVE || axis->homing.by == HOMING_HARD_STOP)
        return yaml_value_refuse(
            value,
            "has %s, which is homed by %s and would rack the bridge: homing "
            "of rails is by switch or here",
            axis->name, rig_homing_kinds[axis->homing.by]);
    return 0;
}

static int gantry_check(const struct rig *rig, const struct yaml_value *value,
                        const struct rig_gantry *gantry)
{
    const struct rig_axis *const one = &rig->axis[gantry->axis[0]];
    const struct rig_axis *const two = &rig->axis[gantry->axis[1]];

    if (gantry_check_axis(value, one) < 0 || gantry_check_axis(value, two) < 0)
        return -1;
    if (one->unit != two->unit)
        return yaml_value_refuse(value, "has rails in %s and %s",
                                 units_axis_text(one->unit),
                                 units_axis_text(two->unit));
    if (one->homing.by != two->homing.by ||
        one->homing.input != two->homing.input ||
        one->homing.direction != two->homing.direction)
        return yaml_value_refuse(
            value, "has rails that are homed in different ways: both have the "
                   "same by, input and direction");
    return 0;
}

static int gantry_read_one(void *reader, uint32_t key,
                           const struct yaml_value *entry)
{
    struct rig *const rig = ((struct rig_reader *)reader)->rig;
    struct rig_gantry *const gantry = &rig->gantry[rig->gantry_count];
    struct yaml_value value = *entry;

    *gantry = (struct rig_gantry){ .place = yaml_tree_place(entry->tree, key) };
    memcpy(gantry->name, entry->name, strlen(entry->name) + 1);
    value.expected = "a map such as {rails: [rail_left, rail_right], racking: "
                     "2 mm}, of two axes that are alike";
    if (yaml_fields_read(&value, &rig_rails_shape, reader, gantry) < 0 ||
        gantry_check(rig, &value, gantry) < 0)
        return -1;
    rig->gantry_count++;
    return 0;
}

int rig_read_gantries(void *reader, const struct yaml_value *value, void *out)
{
    struct rig *const rig = ((struct rig_reader *)reader)->rig;

    (void)out;
    rig->gantry = memory_pool_new(&rig->memory,
                                  yaml_fields_count(value, RIG_GANTRIES_MAX),
                                  sizeof *rig->gantry);
    return yaml_fields_each(value, RIG_GANTRIES_MAX, reader, gantry_read_one);
}

int rig_gantry_other(const struct rig_gantry *gantry, uint32_t axis)
{
    if (gantry->axis[0] != axis && gantry->axis[1] != axis)
        return -1;
    return (int)gantry->axis[gantry->axis[0] == axis ? 1 : 0];
}

int rig_rail_beside(const struct rig *rig, uint32_t axis)
{
    int other = -1;

    for (uint32_t i = 0; i < rig->gantry_count && other < 0; i++)
        other = rig_gantry_other(&rig->gantry[i], axis);
    return other;
}

struct plan_limit rig_rails_limit(const struct rig *rig, uint32_t axis)
{
    struct plan_limit limit = rig->axis[axis].limit;
    const int other = rig_rail_beside(rig, axis);

    if (other < 0)
        return limit;
    const struct plan_limit *const most = &rig->axis[other].limit;
    if (most->vel_q32 < limit.vel_q32)
        limit.vel_q32 = most->vel_q32;
    if (most->acc_q32 < limit.acc_q32)
        limit.acc_q32 = most->acc_q32;
    if (limit.jerk_q32 == 0 ||
        (most->jerk_q32 != 0 && most->jerk_q32 < limit.jerk_q32))
        limit.jerk_q32 = most->jerk_q32;
    return limit;
}

/* The rails of the kinematics are at one x where both axes have one place, or the
 * bridge would not be square where slew takes it to be. */
int rig_check_gantries(const struct yaml_value *value, const struct rig *rig)
{
    const struct plan_rig *const camera = rig->kinematics;
    if (!rig_has_bridge(rig) || rig_rail_beside(rig, camera->carrier[0].axis) !=
                                    (int)camera->carrier[1].axis)
        return 0;
    const struct motion_axis_map *const map =
        camera->rig.carrier.as.gantry.axis;
    return map[0].offset_q32 == map[1].offset_q32 &&
                   map[0].is_reversed == map[1].is_reversed
               ? 0
               : yaml_report_at(
                     &value->tree->report, camera->place,
                     "the rails of kinematics have different offset or "
                     "reversed, expected the same: as a gantry they have one "
                     "place where the bridge is square");
}

bool rig_has_bridge(const struct rig *rig)
{
    const struct plan_rig *const camera = rig->kinematics;

    return camera != NULL &&
           camera->rig.carrier.kind == &motion_carrier_gantry &&
           camera->carrier[0].is_given && camera->carrier[1].is_given &&
           camera->carrier[0].axis != camera->carrier[1].axis;
}
