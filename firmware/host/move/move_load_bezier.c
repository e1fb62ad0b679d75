/* firmware/host/move/move_load_bezier.c - keys with handles.  See move_load.h.
 */
#include "firmware/host/move/move_load.h"

#include <stdlib.h>

#include "firmware/host/base/array.h"
#include "firmware/host/yaml/yaml_units.h"
#include "motion/core/fixed.h"

const char *const move_handle_word[MOVE_HANDLES] = {
    "free", "aligned", "vector", "auto", "auto-clamped",
};
const char *const move_interpolation_word[MOVE_INTERPOLATIONS] = {
    "constant", "linear", "bezier", "sine", "quad",   "cubic",   "quart",
    "quint",    "expo",   "circ",   "back", "bounce", "elastic",
};
const char *const move_easing_word[MOVE_EASINGS] = {
    "auto",
    "in",
    "out",
    "in-out",
};
const char *const move_smoothing_word[MOVE_SMOOTHINGS] = {
    "none",
    "acceleration",
};
const char *const move_extrapolation_word[MOVE_EXTRAPOLATIONS] = {
    "constant",
    "linear",
};
const char *const move_cycle_word[MOVE_CYCLES] = {
    "none",
    "repeat",
    "repeat-offset",
    "mirror",
};

/* [time, position] */
static int bezier_pair(const struct move_reader *self,
                       const struct yaml_value *value, int64_t *dt_ns_q12,
                       int64_t *dp_q32)
{
    struct yaml_value item[2];

    if (yaml_value_pair(value, item) < 0 ||
        yaml_units_read(&item[0], UNITS_TIME, &self->units, dt_ns_q12) < 0)
        return -1;
    return yaml_units_read(&item[1], self->quantity, &self->units, dp_q32);
}

/* One word for both handles, or [left, right]. */
static int bezier_kinds(const struct yaml_value *value,
                        struct plan_bezier_key *key)
{
    struct yaml_value side[2] = { *value, *value };

    if (yaml_value_node(value)->kind == YAML_TREE_LIST &&
        yaml_value_pair(value, side) < 0)
        return -1;
    if (yaml_value_word(&side[0], move_handle_word, MOVE_HANDLES,
                        &key->left.kind) < 0)
        return -1;
    return yaml_value_word(&side[1], move_handle_word, MOVE_HANDLES,
                           &key->right.kind);
}

/* --- of an axis ----------------------------------------------------------- */

static int bezier_check_axis(const struct move_reader *self,
                             const struct yaml_value *value)
{
    const struct plan_curve_rules *rules = plan_curve_rules(self->axis->curve);

    return rules->handles ? 0 : move_refuse_use(value, rules);
}

int move_read_handles(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;

    (void)out;
    if (bezier_check_axis(self, value) < 0)
        return -1;
    return bezier_kinds(value, &self->handles);
}

/* A word of those, where the axis's curve has handles. */
static int bezier_axis_word(const struct move_reader *self,
                            const struct yaml_value *value,
                            const char *const word[], unsigned count,
                            uint8_t *out)
{
    if (bezier_check_axis(self, value) < 0)
        return -1;
    return yaml_value_word(value, word, count, out);
}

int move_read_interpolation(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct move_reader *self = reader;

    (void)out;
    return bezier_axis_word(self, value, move_interpolation_word,
                            MOVE_INTERPOLATIONS, &self->handles.interpolation);
}

int move_read_easing(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;

    (void)out;
    return bezier_axis_word(self, value, move_easing_word, MOVE_EASINGS,
                            &self->handles.easing);
}

int move_read_smoothing(void *reader, const struct yaml_value *value, void *out)
{
    struct plan_axis *axis = out;

    return bezier_axis_word(reader, value, move_smoothing_word, MOVE_SMOOTHINGS,
                            &axis->bezier.smoothing);
}

int move_read_extrapolation(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct plan_axis *axis = out;

    return bezier_axis_word(reader, value, move_extrapolation_word,
                            MOVE_EXTRAPOLATIONS, &axis->bezier.extrapolation);
}

static int bezier_read_cycle(void *reader, const struct yaml_value *value,
                             void *out)
{
    (void)reader;
    return yaml_value_word(value, move_cycle_word, MOVE_CYCLES, out);
}

static const struct yaml_field bezier_cycles_fields[] = {
    { "before", YAML_OPTIONAL, "none, repeat, repeat-offset or mirror",
      bezier_read_cycle, offsetof(struct plan_bezier, before.mode) },
    { "before_count", YAML_OPTIONAL, "how many times, 0 for ever",
      yaml_read_u32, offsetof(struct plan_bezier, before.count) },
    { "after", YAML_OPTIONAL, "none, repeat, repeat-offset or mirror",
      bezier_read_cycle, offsetof(struct plan_bezier, after.mode) },
    { "after_count", YAML_OPTIONAL, "how many times, 0 for ever", yaml_read_u32,
      offsetof(struct plan_bezier, after.count) },
};
const struct yaml_shape move_cycles_shape = { "cycles", bezier_cycles_fields,
                                              ARRAY_LEN(bezier_cycles_fields) };

int move_read_cycles(void *reader, const struct yaml_value *value, void *out)
{
    struct plan_axis *axis = out;

    return yaml_fields_read(value, &move_cycles_shape, reader, &axis->bezier);
}

int move_read_until(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;
    struct plan_bezier *bezier = &((struct plan_axis *)out)->bezier;
    char quote[YAML_QUOTE_MAX];

    if (yaml_units_read(value, UNITS_TIME, &self->units, &bezier->end_ns_q12) <
        0)
        return -1;
    if (bezier->end_ns_q12 <= 0)
        return yaml_value_refuse(value, "%s is not after the start of the move",
                                 yaml_value_quote(quote, value));
    bezier->has_end = true;
    return 0;
}

int move_read_grid(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;
    struct plan_bezier *bezier = &((struct plan_axis *)out)->bezier;

    if (bezier_check_axis(self, value) < 0 ||
        bezier_pair(self, value, &bezier->frame_ns_q12, &bezier->value_q32) < 0)
        return -1;
    if (bezier->frame_ns_q12 <= 0 || bezier->value_q32 <= 0)
        return yaml_value_refuse(value, "has a number that is not positive");
    return 0;
}

/* --- of a key ------------------------------------------------------------- */

int move_bezier_capacity(struct move_reader *self,
                         const struct yaml_value *value)
{
    struct plan_bezier *bezier = &self->axis->bezier;

    if (bezier->key != NULL)
        return 0;
    bezier->key = calloc(self->keys, sizeof bezier->key[0]);
    if (bezier->key == NULL)
        return yaml_value_refuse(value, "do not fit in memory");
    for (uint32_t i = 0; i < self->keys; i++)
        bezier->key[i] = self->handles;
    return 0;
}

/* The handles of the key being read. */
static struct plan_bezier_key *bezier_key(const struct move_reader *self)
{
    return &self->axis->bezier.key[self->key - self->axis->key];
}

void move_bezier_open_key(struct move_reader *self)
{
    self->handles_given = false;
    self->side_given[0] = self->side_given[1] = false;
}

static int bezier_check_key(const struct move_reader *self,
                            const struct yaml_value *value)
{
    return move_before(self)->handles || move_after(self)->handles
               ? 0
               : move_refuse_use(value, move_after(self));
}

int move_read_key_handles(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct move_reader *self = reader;

    (void)out;
    if (bezier_check_key(self, value) < 0)
        return -1;
    self->handles_given = true;
    return bezier_kinds(value, bezier_key(self));
}

static bool bezier_is_given(uint8_t kind)
{
    return kind == MOTION_FCURVE_FREE || kind == MOTION_FCURVE_ALIGNED;
}

/* Without a kind of its own a handle that is given is free. */
static int bezier_read_side(struct move_reader *self,
                            const struct yaml_value *value,
                            struct plan_handle *handle)
{
    const int which = handle == &bezier_key(self)->right;

    if (!bezier_is_given(handle->kind) && self->handles_given)
        return yaml_value_refuse(
            value,
            "is given, but a handle of kind %s follows from its "
            "neighbours",
            move_handle_word[handle->kind]);
    if (!bezier_is_given(handle->kind))
        handle->kind = MOTION_FCURVE_FREE;
    self->side_given[which] = true;
    return bezier_pair(self, value, &handle->dt_ns_q12, &handle->dp_q32);
}

int move_read_key_left(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;
    struct plan_handle *handle;

    (void)out;
    if (bezier_check_key(self, value) < 0)
        return -1;
    handle = &bezier_key(self)->left;
    if (bezier_read_side(self, value, handle) < 0)
        return -1;
    return handle->dt_ns_q12 <= 0
               ? 0
               : yaml_value_refuse(value, "has a time after its key");
}

int move_read_key_right(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;
    struct plan_handle *handle;

    (void)out;
    if (bezier_check_key(self, value) < 0)
        return -1;
    handle = &bezier_key(self)->right;
    if (bezier_read_side(self, value, handle) < 0)
        return -1;
    return handle->dt_ns_q12 >= 0
               ? 0
               : yaml_value_refuse(value, "has a time before its key");
}

int move_read_key_interpolation(void *reader, const struct yaml_value *value,
                                void *out)
{
    struct move_reader *self = reader;

    (void)out;
    if (bezier_check_key(self, value) < 0)
        return -1;
    return yaml_value_word(value, move_interpolation_word, MOVE_INTERPOLATIONS,
                           &bezier_key(self)->interpolation);
}

/* Refuse what the key's interpolation does not use. */
static int bezier_check_interpolation(const struct move_reader *self,
                                      const struct yaml_value *value,
                                      uint8_t from, uint8_t to)
{
    uint8_t interpolation;

    if (bezier_check_key(self, value) < 0)
        return -1;
    interpolation = bezier_key(self)->interpolation;
    return interpolation >= from && interpolation <= to
               ? 0
               : yaml_value_refuse(value, "is not used by interpolation %s",
                                   move_interpolation_word[interpolation]);
}

int move_read_key_easing(void *reader, const struct yaml_value *value,
                         void *out)
{
    struct move_reader *self = reader;

    (void)out;
    if (bezier_check_interpolation(self, value, MOTION_FCURVE_SINE,
                                   MOTION_FCURVE_ELASTIC) < 0)
        return -1;
    return yaml_value_word(value, move_easing_word, MOVE_EASINGS,
                           &bezier_key(self)->easing);
}

int move_read_key_back(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;

    (void)out;
    if (bezier_check_interpolation(self, value, MOTION_FCURVE_BACK,
                                   MOTION_FCURVE_BACK) < 0)
        return -1;
    return yaml_units_read(value, UNITS_RATIO, &self->units,
                           &bezier_key(self)->back_q32);
}

int move_read_key_amplitude(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct move_reader *self = reader;

    (void)out;
    if (bezier_check_interpolation(self, value, MOTION_FCURVE_ELASTIC,
                                   MOTION_FCURVE_ELASTIC) < 0)
        return -1;
    return yaml_units_read(value, self->quantity, &self->units,
                           &bezier_key(self)->amplitude_q32);
}

int move_read_key_period(void *reader, const struct yaml_value *value,
                         void *out)
{
    struct move_reader *self = reader;

    (void)out;
    if (bezier_check_interpolation(self, value, MOTION_FCURVE_ELASTIC,
                                   MOTION_FCURVE_ELASTIC) < 0)
        return -1;
    return yaml_units_read(value, UNITS_TIME, &self->units,
                           &bezier_key(self)->period_ns_q12);
}

int move_bezier_close_key(const struct move_reader *self,
                          const struct yaml_value *value)
{
    static const struct {
        const char *name, *expected;
    } side[2] = { { "left", "left: [dt, dp]" },
                  { "right", "right: [dt, dp]" } };
    const struct plan_bezier_key *key;

    if (!move_before(self)->handles && !move_after(self)->handles)
        return 0;
    key = bezier_key(self);
    for (int i = 0; i < 2; i++) {
        const struct yaml_value needs = { value->tree, value->node, value->name,
                                          side[i].expected };
        const uint8_t kind = i == 0 ? key->left.kind : key->right.kind;

        if (bezier_is_given(kind) && !self->side_given[i])
            return yaml_value_refuse(&needs,
                                     "has no %s handle, which kind %s needs",
                                     side[i].name, move_handle_word[kind]);
    }
    return 0;
}
