/* firmware/host/move/move_load_blend.c - `poses` and `blend` of move.yaml.
 * See move_load.h. */
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/move/move_load.h"
#include "motion/plan/plan_blend.h"

/* ---- poses ---- */

/* One axis of the pose being read, the last one. */
static int move_read_pose_axis(void *reader, uint32_t key,
                               const struct yaml_value *entry)
{
    struct move_reader *self = reader;
    struct move_pose *pose = &self->pose[self->poses - 1];
    const struct yaml_value name = { entry->tree, key, "axis", "" };
    const struct yaml_value value = { entry->tree, entry->node, entry->name,
                                      "a position" };
    const int axis = move_find_axis(self, &name);

    if (axis < 0)
        return -1;
    pose->axis[axis].has = true;
    pose->axis[axis].node = key;
    self->units.unit = self->rig->axis[axis].unit;
    return yaml_units_read(&value, UNITS_POSITION, &self->units,
                           &pose->axis[axis].pos_q32);
}

static int move_read_pose(void *reader, uint32_t key,
                          const struct yaml_value *entry)
{
    struct move_reader *self = reader;
    struct yaml_value value = *entry;

    (void)key;
    struct move_pose *pose = &self->pose[self->poses++];
    memcpy(pose->name, entry->name, strlen(entry->name) + 1);
    pose->axis = memory_pool_new(&self->memory, self->rig->axis_count,
                                 sizeof *pose->axis);
    value.expected = "a map of positions by axis, such as {pan: 10 deg}";
    return yaml_fields_each(&value, RIG_AXES_MAX, self, move_read_pose_axis);
}

int move_read_poses(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;

    (void)out;
    self->pose =
        memory_pool_new(&self->memory, yaml_fields_count(value, MOVE_POSES_MAX),
                        sizeof *self->pose);
    return yaml_fields_each(value, MOVE_POSES_MAX, self, move_read_pose);
}

/* ---- blend ---- */

static const struct move_pose *move_find_pose(const struct move_reader *self,
                                              const struct yaml_value *value)
{
    const char *names[MOVE_POSES_MAX];
    unsigned index;

    for (uint32_t i = 0; i < self->poses; i++)
        names[i] = self->pose[i].name;
    if (yaml_value_choice(value, names, self->poses, &index) < 0)
        return NULL;
    return &self->pose[index];
}

/* The base drives all its axes. */
static int move_read_base(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct move_reader *self = reader;
    struct plan_blend *blend = self->move->blend;
    const struct move_pose *pose = move_find_pose(self, value);

    if (pose == NULL)
        return -1;
    *(const struct move_pose **)out = pose;
    blend->axis = calloc(self->rig->axis_count, sizeof *blend->axis);
    blend->base_q32 = calloc(self->rig->axis_count, sizeof *blend->base_q32);
    if (blend->axis == NULL || blend->base_q32 == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    for (uint32_t i = 0; i < self->rig->axis_count; i++) {
        const struct yaml_value name = { value->tree, pose->axis[i].node,
                                         "axis",
                                         "an axis that nothing else drives" };
        if (!pose->axis[i].has)
            continue;
        if (move_drive_axis(self, &name, PLAN_BY_BLEND,
                            &blend->axis[blend->axes]) < 0)
            return -1;
        blend->base_q32[blend->axes++] = pose->axis[i].pos_q32;
    }
    return 0;
}

struct move_blend {
    struct move_reader *reader;
    const struct move_pose *base;
};

/* What a pose is away from the base, on the blend's axes. */
static int move_read_offsets(const struct move_blend *self,
                             const struct yaml_value *value,
                             const struct move_pose *pose,
                             struct plan_weight *weight)
{
    const struct rig *rig = self->reader->rig;
    uint32_t axis = 0;

    for (uint32_t i = 0; i < rig->axis_count; i++) {
        const struct move_pose_axis *at = &pose->axis[i];
        const struct move_pose_axis *from = &self->base->axis[i];
        if (at->has && !from->has)
            return yaml_value_refuse(
                value, "has the axis '%s', which the base '%s' has not",
                rig->axis[i].name, self->base->name);
        if (at->has && motion_fixed_sub(at->pos_q32, from->pos_q32,
                                        &weight->offset_q32[axis]) < 0)
            return yaml_value_refuse(value, "is too far from the base");
        axis += from->has;
    }
    return 0;
}

static int move_read_weight(void *context, uint32_t key,
                            const struct yaml_value *entry)
{
    const struct move_blend *self = context;
    struct plan_blend *blend = self->reader->move->blend;
    struct plan_weight *weight = &blend->weight[blend->weights];
    const struct yaml_value name = {
        entry->tree, key, "pose", "a pose, all of whose axes the base has too"
    };
    const struct move_pose *pose = move_find_pose(self->reader, &name);
    struct yaml_value value = *entry;

    if (pose == NULL)
        return -1;
    if (pose == self->base)
        return yaml_value_refuse(&name, "'%s' is the base itself", pose->name);
    blend->weights++;
    weight->offset_q32 = calloc(blend->axes, sizeof *weight->offset_q32);
    if (weight->offset_q32 == NULL && blend->axes > 0)
        return yaml_value_refuse(&name, "does not fit in memory");
    value.expected = "a map with curve and keys such as [4 s, 100 %]";
    if (move_read_offsets(self, &name, pose, weight) < 0)
        return -1;
    return move_read_keyed(self->reader, &value, UNITS_RATIO,
                           self->reader->units.unit, &weight->curve);
}

static int move_read_weights(void *reader, const struct yaml_value *value,
                             void *out)
{
    struct move_reader *self = reader;
    struct move_blend blend = { self, *(const struct move_pose **)out };

    self->move->blend->weight =
        calloc((size_t)yaml_fields_count(value, PLAN_WEIGHTS_MAX) + 1,
               sizeof *self->move->blend->weight);
    if (self->move->blend->weight == NULL)
        return yaml_value_refuse(value, "do not fit in memory");
    return yaml_fields_each(value, PLAN_WEIGHTS_MAX, &blend, move_read_weight);
}

/* The struct that is filled is a pointer to the base. */
static const struct yaml_field move_blend_fields[] = {
    { "base", YAML_REQUIRED, "a pose", move_read_base, 0 },
    { "weights", YAML_REQUIRED,
      "a map of 1 .. 32 keyed curves by the names of poses", move_read_weights,
      0 },
};
const struct yaml_shape move_blend_shape = { "blend", move_blend_fields,
                                             ARRAY_LEN(move_blend_fields) };

int move_read_blended(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;
    const struct move_pose *base = NULL;

    (void)out;
    if (self->poses == 0)
        return yaml_value_refuse(value, "has no poses");
    self->move->blend = calloc(1, sizeof *self->move->blend);
    if (self->move->blend == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    self->move->blend->place = yaml_tree_place(value->tree, value->node);
    return yaml_fields_read(value, &move_blend_shape, self, &base);
}
