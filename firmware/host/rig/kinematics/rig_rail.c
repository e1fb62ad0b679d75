/* firmware/host/rig/kinematics/rig_rail.c - kinematics: a rail through points.
 *
 * The rail is the C4 spline through them (motion/plan/path/plan_space.h), so that
 * a head that turns with the carriage has no step of acceleration, and its axis is
 * the length along it. */
#include "firmware/host/rig/kinematics/rig_kinematics.h"

#include <math.h>

#include "firmware/host/base/number.h"
#include "motion/core/err.h"
#include "motion/double/double_math.h"

#define RIG_RAIL_POINTS_MAX 1000
/* Horizontal part of a tangent, below which there is no heading. */
#define RIG_RAIL_LEVEL 0.01

struct rig_rail {
    struct plan_points points;
    bool is_turning;
    struct motion_axis_map axis;
};

static int rig_read_rail_points(void *reader, const struct yaml_value *value,
                                void *out)
{
    struct rig *rig = ((struct rig_reader *)reader)->rig;
    struct plan_points *points = out;
    struct yaml_value item = { value->tree, yaml_value_node(value)->first,
                               "point", "[x, y, z], not the point before it" };
    uint32_t count;

    if (yaml_value_list(value, 2, RIG_RAIL_POINTS_MAX, &count) < 0)
        return -1;
    points->point = memory_pool_new(&rig->memory, count, sizeof *points->point);
    for (; points->count < count; points->count++) {
        if (rig_read_place(reader, &item, points->point[points->count].q32) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

static int rig_read_rail_axis(void *reader, const struct yaml_value *value,
                              void *out)
{
    return rig_read_carrier_axis(reader, value, UNITS_AXIS_MM, 0, out);
}

static const struct yaml_field rig_rail_fields[] = {
    { "points", YAML_REQUIRED,
      "a list of 2 .. 1000 points such as [0 mm, 0 mm, 900 mm]",
      rig_read_rail_points, offsetof(struct rig_rail, points) },
    { "turning", YAML_OPTIONAL,
      "yes or no: whether the head turns with the carriage", yaml_read_bool,
      offsetof(struct rig_rail, is_turning) },
    { "axis", YAML_REQUIRED, "a map with axis, offset and reversed",
      rig_read_rail_axis, offsetof(struct rig_rail, axis) },
};
const struct yaml_shape rig_rail_shape = { "rail", rig_rail_fields,
                                           ARRAY_LEN(rig_rail_fields) };

/* A carriage on a rail that goes straight up has no heading. */
static bool rig_is_rail_level(const struct plan_space *space)
{
    for (uint32_t i = 0; i < space->table.count; i++) {
        struct motion_arclen_place place;
        struct motion_arclen_point point;
        motion_arclen_find(&space->table, space->table.row[i].s, &place);
        motion_arclen_by_length(&space->curve, place.piece, place.x, &point);
        if (double_hypot(plan_rig_real(point.d1[0]),
                         plan_rig_real(point.d1[1])) < RIG_RAIL_LEVEL)
            return false;
    }
    return true;
}

/* Wherever its limits let the axis be, there is rail. */
static int rig_check_rail(const struct rig *rig, const struct rig_rail *rail,
                          const struct yaml_value *value)
{
    const struct rig_axis *axis = &rig->axis[rig->kinematics->carrier[0].axis];
    const double length = number_double(rig->rail->length_q32, 32);
    int64_t low_q32, high_q32;

    if (motion_axis_coordinate(&rail->axis, axis->limit.pos_min_q32, &low_q32) <
            0 ||
        motion_axis_coordinate(&rail->axis, axis->limit.pos_max_q32,
                               &high_q32) < 0)
        return yaml_value_refuse(value,
                                 "has an axis beyond the range of lengths");
    if (rail->axis.is_reversed) {
        const int64_t swap_q32 = low_q32;
        low_q32 = high_q32;
        high_q32 = swap_q32;
    }
    if (low_q32 < 0 || high_q32 > rig->rail->length_q32)
        return yaml_value_refuse(
            value,
            "is %.3f mm long, and the limits of '%s' let it go from %.3f mm to "
            "%.3f mm along it",
            length, axis->name, number_double(low_q32, 32),
            number_double(high_q32, 32));
    return 0;
}

int rig_read_rail(void *reader, const struct yaml_value *value, void *out)
{
    struct rig *rig = ((struct rig_reader *)reader)->rig;
    struct motion_carrier *carrier = out;
    struct plan_error error = { .code = MOTION_OK };
    struct rig_rail rail = {
        .points = { .axes = PLAN_SPACE_AXES,
                    .curve = PLAN_CURVE_C4,
                    .spacing = MOTION_SPLINE_CHORDAL,
                    .place = yaml_tree_place(value->tree, value->node) },
        .is_turning = true,
    };

    if (yaml_fields_read(value, &rig_rail_shape, reader, &rail) < 0)
        return -1;
    rig->rail = memory_pool_new(&rig->memory, 1, sizeof *rig->rail);
    if (plan_space_init(rig->rail, &rail.points, &error) < 0) {
        rig->rail = NULL;
        return yaml_value_refuse(value, "has no curve through its points: %s",
                                 error.text);
    }
    if (rail.is_turning && !rig_is_rail_level(rig->rail))
        return yaml_value_refuse(value,
                                 "goes straight up, where a carriage that "
                                 "turns the head has no direction");
    carrier->kind = &motion_carrier_rail;
    carrier->as.rail = (struct motion_rail){ .table = &rig->rail->table,
                                             .is_turning = rail.is_turning,
                                             .axis = rail.axis };
    return rig_check_rail(rig, &rail, value);
}
