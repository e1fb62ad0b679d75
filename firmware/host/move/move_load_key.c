/* firmware/host/move/move_load_key.c - the keys of an axis, and what the curves
 * beside each can use. */
#include "firmware/host/move/move_load.h"

#include <stdlib.h>

#include "firmware/host/base/array.h"
#include "firmware/host/yaml/yaml_shapes.h"
#include "motion/core/fixed.h"

/* Does the curve keep a velocity, or an acceleration, that a key gives?  Zero
 * is all that resting curves have, and nothing to write down. */
static bool move_keeps(enum plan_given given)
{
    return given == PLAN_MAY || given == PLAN_MUST;
}

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

const struct yaml_shape move_key_shape = { "key", move_key_fields,
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

int move_read_keys(void *reader, const struct yaml_value *value, void *out)
{
    struct plan_axis *axis = out;
    struct yaml_value item = *value;
    uint32_t count;

    if (yaml_value_list(value, 1, PLAN_KEYS_MAX, &count) < 0)
        return -1;
    axis->key = calloc(count, sizeof(axis->key[0]));
    if (axis->key == NULL)
        return yaml_value_refuse(value, "do not fit in memory");
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
