/* firmware/host/move/move_load.c - move.yaml to struct plan_move.  See rig.h.
 *
 * What a curve can use is a table; a value that its curve would ignore is
 * refused, since whoever wrote it expects it to matter. */
#include "firmware/host/move/move_load.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/yaml/yaml_shapes.h"
#include "motion/core/fixed.h"
#include "motion/plan/compose.h"

static const char *const move_curves[] = {
#define MOVE_CURVE_SPELLING(name, spelling, text) [name] = spelling,
    PLAN_CURVE_LIST(MOVE_CURVE_SPELLING)
#undef MOVE_CURVE_SPELLING
};

static const char *const move_ends[] = {
    [MOTION_SPLINE_REST] = "rest",
    [MOTION_SPLINE_ONE_SIDED] = "one-sided",
    [MOTION_SPLINE_NATURAL] = "natural",
    [MOTION_SPLINE_NOT_A_KNOT] = "not-a-knot",
    [MOTION_SPLINE_PERIODIC] = "periodic",
};

const struct yaml_words move_words[] = {
    { "axis.curve", move_curves, ARRAY_LEN(move_curves) },
    { "key.curve", move_curves, ARRAY_LEN(move_curves) },
    { "ends.first", move_ends, ARRAY_LEN(move_ends) },
    { "ends.last", move_ends, ARRAY_LEN(move_ends) },
    { "axis.interpolation", move_interpolation_word, MOVE_INTERPOLATIONS },
    { "axis.easing", move_easing_word, MOVE_EASINGS },
    { "axis.smoothing", move_smoothing_word, MOVE_SMOOTHINGS },
    { "axis.extrapolation", move_extrapolation_word, MOVE_EXTRAPOLATIONS },
    { "cycles.before", move_cycle_word, MOVE_CYCLES },
    { "cycles.after", move_cycle_word, MOVE_CYCLES },
    { "key.interpolation", move_interpolation_word, MOVE_INTERPOLATIONS },
    { "key.easing", move_easing_word, MOVE_EASINGS },
    { "path.curve", move_path_curves, MOVE_PATH_CURVES },
    { "path.spacing", move_spacings, MOVE_SPACINGS },
    { "part.law", move_laws, MOVE_LAWS },
    { "part.shape", move_ramps, MOVE_RAMPS },
    { "target.curve", move_path_curves, MOVE_PATH_CURVES },
    { "target.spacing", move_spacings, MOVE_SPACINGS },
    { "look.along", move_alongs, MOVE_ALONGS },
    { "look.end", move_ahead_ends, MOVE_AHEAD_ENDS },
    { "look.ease", move_dwell_eases, MOVE_DWELL_EASES },
    { "look.curve", move_orients, MOVE_ORIENTS },
    { "shoot.mode", move_shoot_modes, PLAN_SHOOT_MODES },
    { NULL, NULL, 0 },
};

/* Does the curve keep a velocity, or an acceleration, that a key gives?  Zero
 * is all that resting curves have, and nothing to write down. */
static bool move_keeps(enum plan_given given)
{
    return given == PLAN_MAY || given == PLAN_MUST;
}

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

/* ---- axis: curve and its parameters ---- */

int move_read_curve(void *reader, const struct yaml_value *value, void *out)
{
    unsigned index;
    (void)reader;
    if (yaml_value_choice(value, move_curves, ARRAY_LEN(move_curves), &index) <
        0)
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

static int move_parse_blend(const struct move_reader *self,
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

/* [tension, continuity, bias] */
static int move_parse_tcb(const struct move_reader *self,
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

    if (yaml_value_choice(value, move_ends, ARRAY_LEN(move_ends), &index) < 0)
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
static const struct yaml_shape move_end_shape = { "ends", move_end_fields,
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

/* ---- axis: keys ---- */

/* The curves of the spans that start and end at the key being read. */
static const struct plan_curve_rules *
move_curve_of(const struct move_reader *self, const struct plan_key *key)
{
    return plan_curve_rules(key->has_curve ? key->curve : self->axis->curve);
}

const struct plan_curve_rules *move_after(const struct move_reader *self)
{
    return move_curve_of(self, self->key);
}

const struct plan_curve_rules *move_before(const struct move_reader *self)
{
    return move_curve_of(self, self->key == self->axis->key ? self->key
                                                            : self->key - 1);
}

static int move_read_key_curve(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct plan_key *key = out;

    key->has_curve = true;
    if (move_read_curve(reader, value, &key->curve) < 0)
        return -1;
    return key->curve == PLAN_CURVE_BEZIER ? move_bezier_capacity(reader, value)
                                           : 0;
}

static int move_read_key_time(void *reader, const struct yaml_value *value,
                              void *out)
{
    const struct move_reader *self = reader;
    const struct plan_axis *axis = self->axis;
    struct plan_key *key = out;
    char quote[YAML_QUOTE_MAX];

    if (yaml_units_read(value, UNITS_TIME, &self->units, &key->key.t_ns_q12) <
        0)
        return -1;
    if (key->key.t_ns_q12 < 0 && !move_after(self)->handles)
        return yaml_value_refuse(value, "%s is before the start of the move",
                                 yaml_value_quote(quote, value));
    if (key > axis->key && key->key.t_ns_q12 <= key[-1].key.t_ns_q12)
        return yaml_value_refuse(value,
                                 "%s is not later than the key before it "
                                 "(line %lu)",
                                 yaml_value_quote(quote, value),
                                 (unsigned long)key[-1].place.line);
    return 0;
}

static int move_read_key_position(void *reader, const struct yaml_value *value,
                                  void *out)
{
    const struct move_reader *self = reader;
    int64_t *pos = &((struct plan_key *)out)->key.pos_q32;
    char quote[YAML_QUOTE_MAX];

    if (yaml_units_read(value, self->quantity, &self->units, pos) < 0)
        return -1;
    if (self->quantity == UNITS_TIME && *pos < 0)
        return yaml_value_refuse(value, "%s is before the start of the move",
                                 yaml_value_quote(quote, value));
    return 0;
}

/* A derivative of what is keyed: of a position in the axis's unit, of a ratio
 * or a time as a ratio per second. */
static int move_read_derivative(const struct move_reader *self,
                                const struct yaml_value *value,
                                enum units_quantity quantity, int bits,
                                struct motion_real *out)
{
    const bool is_position = self->quantity == UNITS_POSITION;
    int64_t number = 0;

    if (yaml_units_read(value, is_position ? quantity : UNITS_RATIO,
                        &self->units, &number) < 0)
        return -1;
    *out = motion_real_from_q(number, is_position ? bits : 32);
    return 0;
}

static int move_read_key_velocity(void *reader, const struct yaml_value *value,
                                  void *out)
{
    const struct move_reader *self = reader;
    struct motion_key *key = &((struct plan_key *)out)->key;

    key->has_vel = true;
    if (!move_keeps(move_after(self)->vel) &&
        !move_keeps(move_before(self)->vel))
        return move_refuse_use(value, move_after(self));
    return move_read_derivative(self, value, UNITS_VELOCITY, 32, &key->vel);
}

static int move_read_key_acceleration(void *reader,
                                      const struct yaml_value *value, void *out)
{
    const struct move_reader *self = reader;
    struct motion_key *key = &((struct plan_key *)out)->key;

    key->has_acc = true;
    if (!move_keeps(move_after(self)->acc) &&
        !move_keeps(move_before(self)->acc))
        return move_refuse_use(value, move_after(self));
    return move_read_derivative(self, value, UNITS_ACCELERATION, 32, &key->acc);
}

/* A parameter of the span that starts at the key. */
static int move_check_shape(const struct move_reader *self,
                            const struct yaml_value *value, bool used,
                            struct plan_key *key)
{
    key->has_shape = true;
    return used ? 0 : move_refuse_use(value, move_after(self));
}

static int move_read_key_mu(void *reader, const struct yaml_value *value,
                            void *out)
{
    const struct move_reader *self = reader;
    struct plan_key *key = out;

    if (move_check_shape(self, value, move_after(self)->mu, key) < 0)
        return -1;
    return move_read_ratio(self, value, 2 * MOTION_FIXED_ONE_Q32,
                           &key->shape.mu_q32);
}

static int move_read_key_ease(void *reader, const struct yaml_value *value,
                              void *out)
{
    const struct move_reader *self = reader;
    struct plan_key *key = out;

    if (move_check_shape(self, value, move_after(self)->ease, key) < 0)
        return -1;
    return move_read_ease_list(self, value, &key->shape.ease.k1_q32,
                               &key->shape.ease.k2_q32);
}

static int move_read_key_blend(void *reader, const struct yaml_value *value,
                               void *out)
{
    const struct move_reader *self = reader;
    struct plan_key *key = out;

    if (move_check_shape(self, value, move_after(self)->blend, key) < 0)
        return -1;
    return move_parse_blend(self, value, &key->shape.blend_ns_q12);
}

static int move_read_key_tcb(void *reader, const struct yaml_value *value,
                             void *out)
{
    const struct move_reader *self = reader;
    struct plan_key *key = out;

    if (move_check_shape(self, value, move_after(self)->shape, key) < 0)
        return -1;
    return move_parse_tcb(self, value, &key->shape.tcb);
}

static int move_read_key_fixed(void *reader, const struct yaml_value *value,
                               void *out)
{
    static const char *const word[] = { "time", "value", "both" };
    struct plan_key *key = out;
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, word, ARRAY_LEN(word), &index) < 0)
        return -1;
    key->fixed = (uint8_t)(index + 1); /* enum plan_fixed, as bits */
    return 0;
}

/* The curve first, since others depend on it; then the order of the short form
 * [t, p, v, a]. */
static const struct yaml_field move_key_fields[] = {
    { "curve", YAML_OPTIONAL, "the kind of curve from this key to the next",
      move_read_key_curve, 0 },
    { "t", YAML_REQUIRED, "a time, each later than the one before",
      move_read_key_time, 0 },
    { "p", YAML_REQUIRED, "a position", move_read_key_position, 0 },
    { "v", YAML_OPTIONAL,
      "a velocity only with a curve that keeps one, such as hermite or quintic",
      move_read_key_velocity, 0 },
    { "a", YAML_OPTIONAL,
      "an acceleration only with c2, quintic, c4 or constraints",
      move_read_key_acceleration, 0 },
    { "mu", YAML_OPTIONAL, "0 .. 2, with curve cardinal", move_read_key_mu, 0 },
    { "ease", YAML_OPTIONAL,
      "[k1, k2], 0 <= k1 <= k2 <= 1, with parabolic, sine or s-curve",
      move_read_key_ease, 0 },
    { "blend", YAML_OPTIONAL, "a time, with rounded or smoothed",
      move_read_key_blend, 0 },
    { "tcb", YAML_OPTIONAL,
      "[tension, continuity, bias], -1 .. 1 each, with kochanek-bartels",
      move_read_key_tcb, 0 },
    { "handles", YAML_OPTIONAL,
      "free, aligned, vector, auto or auto-clamped, or a list of two such "
      "kinds, with curve bezier",
      move_read_key_handles, 0 },
    { "left", YAML_OPTIONAL,
      "[dt, dp] from the key, such as [-0.5 s, 20 mm], with handles free or "
      "aligned",
      move_read_key_left, 0 },
    { "right", YAML_OPTIONAL,
      "[dt, dp] from the key, such as [0.5 s, 20 mm], with handles free or "
      "aligned",
      move_read_key_right, 0 },
    { "interpolation", YAML_OPTIONAL,
      "constant, linear, bezier, sine, quad, cubic, quart, quint, expo, circ, "
      "back, bounce or elastic, with curve bezier",
      move_read_key_interpolation, 0 },
    { "easing", YAML_OPTIONAL,
      "auto, in, out or in-out, with an interpolation from sine to elastic",
      move_read_key_easing, 0 },
    { "back", YAML_OPTIONAL, "a number such as 1.7, with interpolation back",
      move_read_key_back, 0 },
    { "amplitude", YAML_OPTIONAL, "a distance, with interpolation elastic",
      move_read_key_amplitude, 0 },
    { "period", YAML_OPTIONAL, "a time, with interpolation elastic",
      move_read_key_period, 0 },
    { "fixed", YAML_OPTIONAL, "time, value or both, which slew fit then keeps",
      move_read_key_fixed, 0 },
};
#define MOVE_KEY_SHORT (&move_key_fields[1])
#define MOVE_KEY_LIST  4

static const struct yaml_shape move_key_shape = { "key", move_key_fields,
                                                  ARRAY_LEN(move_key_fields) };

static int move_read_key_list(struct move_reader *reader,
                              const struct yaml_value *value,
                              struct plan_key *key)
{
    uint32_t count, node = yaml_value_node(value)->first;

    if (yaml_value_list(value, 2, MOVE_KEY_LIST, &count) < 0)
        return -1;
    for (uint32_t i = 0; i < count; i++) {
        const struct yaml_field *field = &MOVE_KEY_SHORT[i];
        const struct yaml_value item = { value->tree, node, field->name,
                                         field->expected };
        if (field->read(reader, &item, key) < 0)
            return -1;
        node = value->tree->node[node].next;
    }
    return 0;
}

static int move_read_key(struct move_reader *reader,
                         const struct yaml_value *value, struct plan_key *key)
{
    const bool is_list = yaml_value_node(value)->kind == YAML_TREE_LIST;
    const struct plan_curve_rules *needs;

    if (reader->is_untimed)
        return move_read_untimed(reader, value, key);
    reader->key = key;
    move_bezier_open_key(reader);
    key->place = yaml_tree_place(value->tree, value->node);
    if ((is_list ? move_read_key_list(reader, value, key)
                 : yaml_fields_read(value, &move_key_shape, reader, key)) < 0)
        return -1;
    needs = move_after(reader)->vel == PLAN_MUST ? move_after(reader)
                                                 : move_before(reader);
    if (needs->vel == PLAN_MUST && !key->key.has_vel &&
        !move_before(reader)->own && !move_after(reader)->own)
        return yaml_value_refuse(value, "has no velocity, which curve %s needs",
                                 needs->name);
    return move_bezier_close_key(reader, value);
}

static int move_read_keys(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct plan_axis *axis = out;
    struct yaml_value item = *value;
    uint32_t count;

    if (yaml_value_list(value, 1, PLAN_KEYS_MAX, &count) < 0)
        return -1;
    axis->key = calloc(count, sizeof(axis->key[0]));
    if (axis->key == NULL)
        return yaml_value_refuse(value, "are too many for the memory");
    ((struct move_reader *)reader)->keys = count;
    if (axis->curve == PLAN_CURVE_BEZIER &&
        move_bezier_capacity(reader, value) < 0)
        return -1;
    item.name = "key";
    item.expected =
        "[t, p], [t, p, v], [t, p, v, a] or a map with t, p, v, a, curve";
    item.node = yaml_value_node(value)->first;
    for (; axis->key_count < count; axis->key_count++) {
        if (move_read_key(reader, &item, &axis->key[axis->key_count]) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

/* ---- axes ---- */

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
static const struct yaml_shape move_axis_shape = {
    "axis", move_axis_fields, ARRAY_LEN(move_axis_fields)
};

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

/* ---- the move ---- */

static int move_read_title(void *reader, const struct yaml_value *value,
                           void *out)
{
    (void)reader;
    return yaml_value_copy(value, out, sizeof(((struct plan_move *)0)->title));
}

static int move_read_fps(void *reader, const struct yaml_value *value,
                         void *out)
{
    struct units_fps *fps = &((struct move_reader *)reader)->units.fps;
    struct plan_move *move = out;
    if (yaml_units_read_fps(value, fps) < 0)
        return -1;
    move->fps_num = fps->num;
    move->fps_den = fps->den;
    return 0;
}

static int move_read_duration(void *reader, const struct yaml_value *value,
                              void *out)
{
    struct move_reader *self = reader;
    struct plan_move *move = out;

    if (move_refuse_guest(self, value) < 0 ||
        move_read_positive(self, value, UNITS_TIME, &move->duration_ns_q12) < 0)
        return -1;
    move->duration_place = yaml_tree_place(value->tree, value->node);
    return 0;
}

int move_refuse_guest(const struct move_reader *reader,
                      const struct yaml_value *value)
{
    struct yaml_value whole = *value;

    if (!reader->is_guest)
        return 0;
    whole.expected = "it in the file that is played";
    return yaml_value_refuse(
        &whole, "is not for a move that is a layer or fade of another one");
}

static const struct yaml_field move_fields[] = {
    { "title", YAML_OPTIONAL, "a text of at most 127 bytes", move_read_title,
      offsetof(struct plan_move, title) },
    { "fps", YAML_OPTIONAL, "frames per second, such as 24 or 24000/1001",
      move_read_fps, 0 },
    { "duration", YAML_OPTIONAL, "the time that all of it takes, above zero",
      move_read_duration, 0 },
    { "timing", YAML_OPTIONAL, "fastest, for axes whose keys are positions",
      move_read_timing, 0 },
    { "axes", YAML_OPTIONAL, "a map of axes by name", move_read_axes, 0 },
    { "path", YAML_OPTIONAL, "a map with axes, points and speed",
      move_read_path, 0 },
    { "camera", YAML_OPTIONAL,
      "a map with axes and look: beside a path, with keys, or on the rig's "
      "kinematics",
      move_read_camera, 0 },
    { "poses", YAML_OPTIONAL, "a map of poses by name, beside a blend",
      move_read_poses, 0 },
    { "blend", YAML_OPTIONAL, "a map with base and weights", move_read_blended,
      0 },
    { "layers", YAML_OPTIONAL, "a list of 1 .. 16 maps with axes or move",
      move_read_layers, 0 },
    { "fade", YAML_OPTIONAL, "a map with axes or move, and weight",
      move_read_fade, 0 },
    { "warp", YAML_OPTIONAL,
      "a map with curve and keys such as [2 s, 1.5 s], times of the move",
      move_read_warp, 0 },
    { "events", YAML_OPTIONAL,
      "a list of 1 .. 1000 events such as {line: camera, at: 2 s}",
      move_read_events, 0 },
    { "shoot", YAML_OPTIONAL,
      "a map with mode, line, frames, exposure and move", move_read_shoot, 0 },
};
static const struct yaml_shape move_shape = { "move", move_fields,
                                              ARRAY_LEN(move_fields) };

const struct yaml_shape *const move_shapes[] = {
    &move_shape,        &move_axis_shape,
    &move_end_shape,    &move_key_shape,
    &move_path_shape,   &move_part_shape,
    &move_cap_shape,    &move_camera_shape,
    &move_head_shape,   &move_look_shape,
    &move_target_shape, &move_dwell_shape,
    &move_orient_shape, &move_blend_shape,
    &move_layer_shape,  &move_fade_shape,
    &move_cycles_shape, &move_event_shape,
    &move_shoot_shape,  &move_subject_shape,
    &move_zoom_shape,   NULL,
};

static int move_read(const struct yaml_value *value, struct move_reader *reader)
{
    if (yaml_fields_read(value, &move_shape, reader, reader->move) < 0)
        return -1;
    if (reader->poses > 0 && reader->move->blend == NULL)
        return yaml_value_refuse(value, "has poses, but no blend of them");
    if (reader->move->axis_count == 0)
        return yaml_value_refuse(value, "moves nothing");
    return move_check_rig(reader, value);
}

int move_load_as(const struct files *files, const char *path, bool is_guest,
                 const struct rig *rig, struct plan_move *move,
                 char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct move_reader reader = { .files = files,
                                  .path = path,
                                  .is_guest = is_guest,
                                  .rig = rig,
                                  .move = move,
                                  .quantity = UNITS_POSITION };
    struct yaml_tree tree;
    int err;

    *move = (struct plan_move){ .axis_count = 0 };
    if (yaml_tree_load(files, &tree, &report) < 0)
        return -1;
    /* axes of the rig, each once */
    if (plan_move_reserve(move, rig->axis_count) < 0)
        memory_fail();
    err = move_read(
        &(struct yaml_value){ &tree, 0, "the move", "axes, a path or a blend" },
        &reader);
    yaml_tree_free(&tree);
    free(reader.pose);
    if (err < 0)
        move_free(move);
    return err;
}

int move_load(const struct files *files, const char *path,
              const struct rig *rig, struct plan_move *move,
              char message[YAML_MESSAGE_MAX])
{
    return move_load_as(files, path, false, rig, move, message);
}

void move_free(struct plan_move *move)
{
    plan_move_free(move);
}
