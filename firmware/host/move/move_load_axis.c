/* firmware/host/move/move_load_axis.c - keyed axes: their curve and what it uses.
 *
 * What a curve can use is a table; a value that its curve would ignore is
 * refused, since whoever wrote it expects it to matter. */
#include "firmware/host/move/move_load.h"

#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/yaml/yaml_shapes.h"
#include "motion/core/fixed.h"

const char *const move_curves[MOVE_CURVES] = {
#define MOVE_CURVE_SPELLING(name, spelling, text) [name] = spelling,
    PLAN_CURVE_LIST(MOVE_CURVE_SPELLING)
#undef MOVE_CURVE_SPELLING
};

const char *const move_ends[MOVE_ENDS] = {
    [MOTION_SPLINE_REST] = "rest",
    [MOTION_SPLINE_ONE_SIDED] = "one-sided",
    [MOTION_SPLINE_NATURAL] = "natural",
    [MOTION_SPLINE_NOT_A_KNOT] = "not-a-knot",
    [MOTION_SPLINE_PERIODIC] = "periodic",
};

static const struct plan_curve_rules *move_rules(const struct move_reader *self)
{
    return plan_curve_rules(self->axis->curve);
}

int move_refuse_use(const struct yaml_value *value,
                    const struct plan_curve_rules *rules)
{
    return yaml_value_refuse(value, "is not used by curve %s", rules->name);
}

static int move_check_use(const struct move_reader *reader,
                          const struct yaml_value *value, bool used)
{
    return used ? 0 : move_refuse_use(value, move_rules(reader));
}

int move_read_curve(void *reader, const struct yaml_value *value, void *out)
{
    unsigned index;
    (void)reader;
    if (yaml_value_choice(value, move_curves, MOVE_CURVES, &index) < 0)
        return -1;
    *(enum plan_curve *)out = (enum plan_curve)index;
    return 0;
}

int move_read_ratio(const struct move_reader *reader,
                    const struct yaml_value *value, int64_t max_q32,
                    int64_t *out)
{
    char quote[YAML_QUOTE_MAX];

    if (yaml_units_read(value, UNITS_RATIO, &reader->units, out) < 0)
        return -1;
    if (*out < 0 || *out > max_q32)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    return 0;
}

int move_read_ease_list(const struct move_reader *reader,
                        const struct yaml_value *value, int64_t *k1_q32,
                        int64_t *k2_q32)
{
    struct yaml_value k[2];

    if (yaml_value_pair(value, k) < 0 ||
        move_read_ratio(reader, &k[0], MOTION_FIXED_ONE_Q32, k1_q32) < 0 ||
        move_read_ratio(reader, &k[1], MOTION_FIXED_ONE_Q32, k2_q32) < 0)
        return -1;
    if (*k2_q32 < *k1_q32)
        return yaml_value_refuse(&k[1],
                                 "has its second number below the first");
    return 0;
}

int move_parse_blend(const struct move_reader *self,
                     const struct yaml_value *value, int64_t *out)
{
    char quote[YAML_QUOTE_MAX];

    if (yaml_units_read(value, UNITS_TIME, &self->units, out) < 0)
        return -1;
    if (*out < 0)
        return yaml_value_refuse(value, "%s is negative",
                                 yaml_value_quote(quote, value));
    return 0;
}

int move_parse_tcb(const struct move_reader *self,
                   const struct yaml_value *value,
                   struct motion_spline_kochanek *shape)
{
    int64_t *const part[3] = { &shape->tension_q32, &shape->continuity_q32,
                               &shape->bias_q32 };
    struct yaml_value item = *value;
    char quote[YAML_QUOTE_MAX];
    uint32_t count;

    if (yaml_value_list(value, 3, 3, &count) < 0)
        return -1;
    item.node = yaml_value_node(value)->first;
    for (int i = 0; i < 3; i++) {
        if (yaml_units_read(&item, UNITS_RATIO, &self->units, part[i]) < 0)
            return -1;
        if (*part[i] < -MOTION_FIXED_ONE_Q32 || *part[i] > MOTION_FIXED_ONE_Q32)
            return yaml_value_refuse(&item, "%s is out of range",
                                     yaml_value_quote(quote, &item));
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

static int move_read_mu(void *reader, const struct yaml_value *value, void *out)
{
    const struct move_reader *self = reader;

    if (move_check_use(self, value, move_rules(self)->mu) < 0)
        return -1;
    return move_read_ratio(self, value, 2 * MOTION_FIXED_ONE_Q32, out);
}

static int move_read_ease(void *reader, const struct yaml_value *value,
                          void *out)
{
    const struct move_reader *self = reader;
    struct plan_axis *axis = out;

    if (move_check_use(self, value, move_rules(self)->ease) < 0)
        return -1;
    return move_read_ease_list(self, value, &axis->k1_q32, &axis->k2_q32);
}

static int move_read_blend(void *reader, const struct yaml_value *value,
                           void *out)
{
    const struct move_reader *self = reader;

    if (move_check_use(self, value, move_rules(self)->blend) < 0)
        return -1;
    return move_parse_blend(self, value, out);
}

static int move_read_tcb(void *reader, const struct yaml_value *value,
                         void *out)
{
    const struct move_reader *self = reader;

    if (move_check_use(self, value, move_rules(self)->shape) < 0)
        return -1;
    return move_parse_tcb(self, value, out);
}

static int move_read_end(void *reader, const struct yaml_value *value,
                         void *out)
{
    unsigned index;

    if (yaml_value_choice(value, move_ends, MOVE_ENDS, &index) < 0)
        return -1;
    if (!(move_rules(reader)->ends & 1u << index))
        return yaml_value_refuse(value, "'%s' is not among those of curve %s",
                                 move_ends[index], move_rules(reader)->name);
    *(enum motion_spline_end *)out = (enum motion_spline_end)index;
    return 0;
}

static const struct yaml_field move_end_fields[] = {
    { "first", YAML_OPTIONAL, "an end that the curve has", move_read_end,
      offsetof(struct plan_axis, first) },
    { "last", YAML_OPTIONAL, "an end that the curve has", move_read_end,
      offsetof(struct plan_axis, last) },
};
const struct yaml_shape move_end_shape = { "ends", move_end_fields,
                                           ARRAY_LEN(move_end_fields) };

/* One word for both ends, or a map. */
static int move_read_ends(void *reader, const struct yaml_value *value,
                          void *out)
{
    const struct move_reader *self = reader;
    struct plan_axis *axis = out;

    if (move_check_use(self, value, move_rules(self)->ends != 0) < 0)
        return -1;
    if (yaml_value_node(value)->kind == YAML_TREE_MAP)
        return yaml_fields_read(value, &move_end_shape, reader, axis);
    if (move_read_end(reader, value, &axis->first) < 0)
        return -1;
    axis->last = axis->first;
    return 0;
}

static const struct yaml_field move_axis_fields[] = {
    { "curve", YAML_OPTIONAL, "the kind of curve", move_read_curve,
      offsetof(struct plan_axis, curve) },
    { "mu", YAML_OPTIONAL, "0 .. 2, with curve cardinal", move_read_mu,
      offsetof(struct plan_axis, mu_q32) },
    { "ease", YAML_OPTIONAL,
      "[k1, k2], 0 <= k1 <= k2 <= 1, with parabolic, sine or s-curve",
      move_read_ease, 0 },
    { "blend", YAML_OPTIONAL, "a time, with rounded or smoothed",
      move_read_blend, offsetof(struct plan_axis, blend_ns_q12) },
    { "tcb", YAML_OPTIONAL,
      "[tension, continuity, bias], -1 .. 1 each, with kochanek-bartels",
      move_read_tcb, offsetof(struct plan_axis, shape) },
    { "ends", YAML_OPTIONAL,
      "rest, one-sided, natural, not-a-knot, periodic or a map with first and "
      "last, as far as the curve has them",
      move_read_ends, 0 },
    { "handles", YAML_OPTIONAL,
      "free, aligned, vector, auto or auto-clamped, or a list of two such "
      "kinds, with bezier",
      move_read_handles, 0 },
    { "interpolation", YAML_OPTIONAL,
      "constant, linear, bezier, sine, quad, cubic, quart, quint, expo, circ, "
      "back, bounce or elastic, with bezier",
      move_read_interpolation, 0 },
    { "easing", YAML_OPTIONAL, "auto, in, out or in-out, with bezier",
      move_read_easing, 0 },
    { "smoothing", YAML_OPTIONAL, "none or acceleration, with bezier",
      move_read_smoothing, 0 },
    { "extrapolation", YAML_OPTIONAL, "constant or linear, with bezier",
      move_read_extrapolation, 0 },
    { "cycles", YAML_OPTIONAL,
      "a map with before, after, before_count and after_count",
      move_read_cycles, 0 },
    { "until", YAML_OPTIONAL, "the time when the axis comes to its end",
      move_read_until, 0 },
    { "grid", YAML_OPTIONAL,
      "[time, position] that look equally long, such as [frame 1 @ 24, 1 mm], "
      "with "
      "bezier",
      move_read_grid, 0 },
    { "keys", YAML_REQUIRED, "a list of 1 .. 1000000 keys such as [2 s, 40 mm]",
      move_read_keys, 0 },
};
const struct yaml_shape move_axis_shape = { "axis", move_axis_fields,
                                            ARRAY_LEN(move_axis_fields) };

int move_find_axis(const struct move_reader *reader,
                   const struct yaml_value *name)
{
    const struct yaml_value axis = { name->tree, name->node, "axis", "" };
    const char *names[RIG_AXES_MAX];
    unsigned index;

    for (uint32_t i = 0; i < reader->rig->axis_count; i++)
        names[i] = reader->rig->axis[i].name;
    if (yaml_value_choice(&axis, names, reader->rig->axis_count, &index) < 0)
        return -1;
    return (int)index;
}

int move_read_keyed(struct move_reader *reader, const struct yaml_value *value,
                    enum units_quantity quantity, enum units_axis unit,
                    struct plan_axis *axis)
{
    const struct move_reader outer = *reader;
    int err;

    *axis = (struct plan_axis){
        .curve = PLAN_CURVE_QUINTIC,
        .mu_q32 = MOTION_FIXED_ONE_Q32,
        .k1_q32 = (MOTION_FIXED_ONE_Q32 + 1) / 3,
        .k2_q32 = (2 * MOTION_FIXED_ONE_Q32 + 1) / 3,
        .blend_ns_q12 = MOTION_FIXED_S_Q12 / 2,
        .place = yaml_tree_place(value->tree, value->node),
    };
    reader->axis = axis;
    reader->handles = (struct plan_bezier_key){
        .left.kind = MOTION_FCURVE_CLAMPED,
        .right.kind = MOTION_FCURVE_CLAMPED,
        .interpolation = MOTION_FCURVE_BEZIER,
    };
    reader->quantity = quantity;
    reader->units.unit = unit;
    snprintf(axis->name, sizeof axis->name, "%s", value->name);
    err = yaml_fields_read(value, &move_axis_shape, reader, axis);
    reader->axis = outer.axis;
    reader->key = outer.key;
    reader->keys = outer.keys;
    reader->handles = outer.handles;
    reader->quantity = outer.quantity;
    reader->units.unit = outer.units.unit;
    return err;
}

static int move_read_axis(void *reader, uint32_t key,
                          const struct yaml_value *entry)
{
    struct move_reader *self = reader;
    struct plan_axis *axis = &self->move->axis[self->move->axis_count];
    const struct yaml_value name = { entry->tree, key, entry->name, "" };
    const int index = move_find_axis(self, &name);
    struct yaml_value value = *entry;
    int err;

    if (index < 0)
        return -1;
    self->move->axis_count++;
    value.expected = "a map with curve and keys";
    self->is_untimed = self->move->joints != NULL;
    err = move_read_keyed(self, &value, UNITS_POSITION,
                          self->rig->axis[index].unit, axis);
    axis->place = yaml_tree_place(entry->tree, key);
    if (err == 0 && self->is_untimed)
        err = move_join_timing(self, &value, (uint32_t)index);
    self->is_untimed = false;
    return err;
}

int move_drive_rig_axis(struct move_reader *reader,
                        const struct yaml_value *value, uint32_t found,
                        enum plan_driver driver, uint32_t *index)
{
    struct plan_move *move = reader->move;
    struct plan_axis *axis = &move->axis[move->axis_count];

    for (uint32_t i = 0; i < move->axis_count; i++)
        if (strcmp(move->axis[i].name, reader->rig->axis[found].name) == 0)
            return yaml_value_refuse(
                value, "'%s' is driven by the %s in line %lu already",
                move->axis[i].name, plan_driver_name(move->axis[i].driver),
                (unsigned long)move->axis[i].place.line);
    *axis = (struct plan_axis){
        .driver = driver,
        .place = yaml_tree_place(value->tree, value->node),
    };
    memcpy(axis->name, reader->rig->axis[found].name, sizeof axis->name);
    *index = move->axis_count++;
    return 0;
}

int move_drive_axis(struct move_reader *reader, const struct yaml_value *name,
                    enum plan_driver driver, uint32_t *index)
{
    const int found = move_find_axis(reader, name);

    if (found < 0 ||
        move_drive_rig_axis(reader, name, (uint32_t)found, driver, index) < 0)
        return -1;
    return found;
}

int move_read_axes(void *reader, const struct yaml_value *value, void *out)
{
    (void)out;
    return yaml_fields_each(value, RIG_AXES_MAX, reader, move_read_axis);
}
