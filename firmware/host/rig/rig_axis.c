/* firmware/host/rig/rig_axis.c - the axes of a rig. */
#include "firmware/host/rig/rig_parts.h"

#include <string.h>

#include "firmware/host/base/memory.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* No position in a file can be this: units are read as +-(2^63 - 1). */
#define RIG_NOT_GIVEN INT64_MIN

int rig_axis_index(const struct rig *rig, const char *name)
{
    for (uint32_t i = 0; i < rig->axis_count; i++)
        if (strcmp(rig->axis[i].name, name) == 0)
            return (int)i;
    return -1;
}

bool rig_axis_is_virtual(const struct rig_axis *axis)
{
    return axis->bus == RIG_NO_BUS;
}

const char *rig_axis_list(const struct rig *rig, char list[QUOTE_LIST_MAX])
{
    const char *name[RIG_AXES_MAX];
    for (uint32_t i = 0; i < rig->axis_count; i++)
        name[i] = rig->axis[i].name;
    return quote_list(list, name, rig->axis_count);
}

static int rig_read_unit(void *reader, const struct yaml_value *value,
                         void *out)
{
    struct rig_reader *self = reader;
    unsigned index;

    if (yaml_value_choice(value, units_axis_words, UNITS_AXIS_WORDS, &index) <
        0)
        return -1;
    *(enum units_axis *)out = (enum units_axis)index;
    self->units.unit = (enum units_axis)index;
    return 0;
}

const char *const rig_warning_word[] = {
#define RIG_WARNING_WORD(name, word) [name] = (word),
    RIG_WARNING_LIST(RIG_WARNING_WORD)
#undef RIG_WARNING_WORD
};

static int rig_read_acknowledged(void *reader, const struct yaml_value *value,
                                 void *out)
{
    uint32_t count, node;
    unsigned index;

    (void)reader;
    if (yaml_value_list(value, 1, RIG_WARNINGS, &count) < 0)
        return -1;
    node = yaml_value_node(value)->first;
    for (uint32_t i = 0; i < count; i++) {
        const struct yaml_value item = yaml_value_at(value, node);
        if (yaml_value_choice(&item, rig_warning_word, RIG_WARNINGS, &index) <
            0)
            return -1;
        *(uint32_t *)out |= 1U << index;
        node = yaml_value_node(&item)->next;
    }
    return 0;
}

static const struct yaml_field rig_axis_fields[] = {
    { "unit", YAML_REQUIRED, "mm, deg, rev, rad, count, kcount or Mcount",
      rig_read_unit, offsetof(struct rig_axis, unit) },
    { "limits", YAML_REQUIRED,
      "a map with position, velocity, acceleration and jerk", rig_read_limits,
      offsetof(struct rig_axis, limit) },
    { "stop", YAML_OPTIONAL, "a map with acceleration and jerk", rig_read_stop,
      0 },
    { "following_error", YAML_REQUIRED, "a map with floor and time",
      rig_read_following, 0 },
    { "drive", YAML_REQUIRED, "a map with kind, bus, node and counts",
      rig_read_drive, 0 },
    { "homing", YAML_OPTIONAL, "a map with by and what belongs to it",
      rig_read_homing, offsetof(struct rig_axis, homing) },
    { "shaper", YAML_OPTIONAL, "a map with kind, frequency and damping",
      rig_read_shaper, 0 },
    { "sim", YAML_OPTIONAL,
      "a map with bandwidth, damping, start, velocity and acceleration",
      rig_read_sim, offsetof(struct rig_axis, sim) },
    { "acknowledged", YAML_OPTIONAL, "a list of the words of warnings",
      rig_read_acknowledged, offsetof(struct rig_axis, acknowledged) },
};
const struct yaml_shape rig_axis_shape = { "axis", rig_axis_fields,
                                           ARRAY_LEN(rig_axis_fields) };

static int64_t rig_saturated_product(int64_t a, int64_t num, int64_t den)
{
    int64_t product;
    return motion_fixed_muldiv(a, num, den, &product) == MOTION_OK ? product
                                                                   : INT64_MAX;
}

int64_t rig_axis_following_q32(const struct rig_axis *axis, int64_t speed_q32)
{
    const int64_t by_speed_q32 = rig_saturated_product(
        speed_q32, axis->following_k_ns, INT64_C(1000000000));
    return by_speed_q32 > axis->following_floor_q32 ? by_speed_q32
                                                    : axis->following_floor_q32;
}

static int64_t rig_nearest_to_zero(const struct plan_limit *limit)
{
    if (limit->pos_min_q32 > 0)
        return limit->pos_min_q32;
    return limit->pos_max_q32 < 0 ? limit->pos_max_q32 : 0;
}

/* What was left out; members that are still 0 were. */
static void rig_complete_axis(struct rig_axis *axis)
{
    if (axis->stop_acc_q32 == 0)
        axis->stop_acc_q32 = axis->limit.acc_q32;
    if (axis->stop_jerk_q32 == 0)
        axis->stop_jerk_q32 = axis->limit.jerk_q32;
    if (axis->sim.vel_max_q32 == 0)
        axis->sim.vel_max_q32 =
            axis->sim.motor.no_load_q32 > 0
                ? rig_saturated_product(axis->sim.motor.no_load_q32, 5, 4)
                : rig_saturated_product(axis->limit.vel_q32, 3, 2);
    if (axis->sim.acc_max_q32 == 0)
        axis->sim.acc_max_q32 = rig_saturated_product(axis->stop_acc_q32, 2, 1);
    if (axis->sim.start_q32 == RIG_NOT_GIVEN)
        axis->sim.start_q32 = rig_nearest_to_zero(&axis->limit);
}

void rig_forget_eds(struct rig_reader *reader)
{
    if (reader->eds != NULL)
        eds_free(reader->eds);
    memory_free(reader->eds);
    reader->eds = NULL;
}

static int rig_read_axis(void *reader, uint32_t key,
                         const struct yaml_value *entry)
{
    struct rig_reader *self = reader;
    struct rig_axis *axis = &self->rig->axis[self->rig->axis_count];
    struct yaml_value value = *entry;

    *axis = (struct rig_axis){
        .following_k_ns = 20 * RIG_MS,
        .sim = { .omega_mrad_s = 157080,
                 .zeta_permille = 900,
                 .start_q32 = RIG_NOT_GIVEN },
        .place = yaml_tree_place(entry->tree, key),
    };
    memcpy(axis->name, entry->name, strlen(entry->name) + 1);
    self->axis = axis;
    rig_forget_eds(self);
    value.expected = "a map with unit, limits, following_error and drive";
    if (yaml_fields_read(&value, &rig_axis_shape, reader, axis) < 0)
        return -1;
    rig_complete_axis(axis);
    const struct rig_kind *kind = rig_kinds[axis->kind];
    if (kind->judge_axis != NULL && kind->judge_axis(self, &value) < 0)
        return -1;
    self->rig->axis_count++;
    return 0;
}

int rig_read_axes(void *reader, const struct yaml_value *value, void *out)
{
    struct rig *rig = ((struct rig_reader *)reader)->rig;
    (void)out;
    rig->axis =
        memory_pool_new(&rig->memory, yaml_fields_count(value, RIG_AXES_MAX),
                        sizeof *rig->axis);
    return yaml_fields_each(value, RIG_AXES_MAX, reader, rig_read_axis);
}
