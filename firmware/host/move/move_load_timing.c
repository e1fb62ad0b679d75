/* firmware/host/move/move_load_timing.c - `timing` of move.yaml: keyed axes whose
 * keys give positions only.  See move_load.h. */
#include <stdlib.h>

#include "firmware/host/base/array.h"
#include "firmware/host/move/move_load.h"
#include "firmware/host/yaml/yaml_units.h"
#include "motion/core/fixed.h"
#include "motion/plan/path/plan_joints.h"

int move_read_timing(void *reader, const struct yaml_value *value, void *out)
{
    static const char *const word[] = { "fastest" };
    struct move_reader *self = reader;
    struct plan_move *move = out;
    unsigned index;

    if (move_refuse_guest(self, value) < 0 ||
        yaml_value_choice(value, word, ARRAY_LEN(word), &index) < 0)
        return -1;
    move->joints = calloc(1, sizeof *move->joints);
    if (move->joints == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    move->joints->place = yaml_tree_place(value->tree, value->node);
    return 0;
}

/* Curves whose shape does not depend on times in seconds. */
static bool move_is_shape(enum plan_curve curve)
{
    return curve == PLAN_CURVE_LINEAR || curve == PLAN_CURVE_CATMULL_ROM ||
           curve == PLAN_CURVE_CARDINAL || curve == PLAN_CURVE_MONOTONE ||
           curve == PLAN_CURVE_AKIMA || curve == PLAN_CURVE_AKIMA_MONOTONE ||
           curve == PLAN_CURVE_C2 || curve == PLAN_CURVE_QUINTIC ||
           curve == PLAN_CURVE_C4;
}

int move_join_timing(struct move_reader *reader, const struct yaml_value *value,
                     uint32_t rig_axis)
{
    const struct rig_axis *rig = &reader->rig->axis[rig_axis];
    struct plan_joints *joints = reader->move->joints;
    struct plan_axis *axis = &reader->move->axis[reader->move->axis_count - 1];
    const struct plan_curve_rules *rules = plan_curve_rules(axis->curve);
    const int64_t tolerance_q32 = move_default_tolerance_q32(rig->unit);

    if (!move_is_shape(axis->curve))
        return yaml_value_refuse(value,
                                 "has curve %s, which is not for timing: "
                                 "fastest",
                                 rules->name);
    if (axis->bezier.before.mode != 0 || axis->bezier.after.mode != 0 ||
        axis->bezier.has_end)
        return yaml_value_refuse(value, "has cycles or until, which is not for "
                                        "timing: fastest");
    if (joints->axes == PLAN_JOINTS_MAX)
        return yaml_value_refuse(value, "is one axis too many for timing");
    if (yaml_fields_find(value, "ends") == 0 &&
        (rules->ends & 1u << MOTION_SPLINE_NATURAL) != 0)
        axis->first = axis->last = MOTION_SPLINE_NATURAL;
    axis->driver = PLAN_BY_TIMING;
    if (joints->axes == 0 || tolerance_q32 < joints->tolerance_q32)
        joints->tolerance_q32 = tolerance_q32;
    joints->limit[joints->axes] = rig->limit;
    joints->axis[joints->axes++] = reader->move->axis_count - 1;
    return 0;
}

int move_read_untimed(struct move_reader *reader,
                      const struct yaml_value *value, struct plan_key *key)
{
    struct yaml_value pos = *value;

    pos.expected = "a position, as timing: fastest finds the times";
    key->place = yaml_tree_place(value->tree, value->node);
    key->key.t_ns_q12 = (key - reader->axis->key) * MOTION_FIXED_S_Q12;
    return yaml_units_read(&pos, reader->quantity, &reader->units,
                           &key->key.pos_q32);
}
