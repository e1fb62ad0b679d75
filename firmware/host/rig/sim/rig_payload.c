/* firmware/host/rig/sim/rig_payload.c - what simulated axes carry or pull: see
 * sim/physics/payload.h. */
#include "firmware/host/rig/kinematics/rig_kinematics.h"

#include <string.h>

#include "firmware/host/base/memory.h"
#include "motion/core/fixed.h"

#define PAYLOAD_PER_MM 1e-3
/* So much of what the axis moves itself: a payload that is more would be
 * computed a step too late to be believed. */
#define PAYLOAD_PART 0.5

const char *const rig_payload_kinds[RIG_PAYLOAD_KINDS] = { "pendulum", "cable",
                                                           "curtain", "ball" };

static struct rig_payload *payload_of(struct rig_reader *self)
{
    return &self->rig->payload[self->rig->payload_count];
}

static int payload_read(struct rig_reader *self, const struct yaml_value *value,
                        enum units_quantity quantity, double low, double high,
                        double *out)
{
    char quote[YAML_QUOTE_MAX];
    int64_t number_q32;

    self->units.unit = UNITS_AXIS_MM;
    if (rig_read_quantity(self, value, quantity, &number_q32) < 0)
        return -1;
    *out = (double)number_q32 / (double)MOTION_FIXED_ONE_Q32;
    if (quantity == UNITS_POSITION)
        *out *= PAYLOAD_PER_MM;
    if (*out < low * (1 - 1e-9) || *out > high * (1 + 1e-9))
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    return 0;
}

static int payload_read_kg(void *reader, const struct yaml_value *value,
                           void *out)
{
    return payload_read(reader, value, UNITS_RATIO, 0.001, 10000, out);
}

static int payload_read_inertia(void *reader, const struct yaml_value *value,
                                void *out)
{
    return payload_read(reader, value, UNITS_RATIO, 1e-5, 1000000, out);
}

static int payload_read_ratio(void *reader, const struct yaml_value *value,
                              void *out)
{
    return payload_read(reader, value, UNITS_RATIO, 0, 1, out);
}

static int payload_read_length(void *reader, const struct yaml_value *value,
                               void *out)
{
    return payload_read(reader, value, UNITS_POSITION, 0.001, 100, out);
}

static int payload_read_start(void *reader, const struct yaml_value *value,
                              void *out)
{
    return payload_read(reader, value, UNITS_POSITION, -100, 100, out);
}

static int payload_read_origin(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct rig_payload *const payload = payload_of(reader);
    int64_t q32[3];

    (void)out;
    ((struct rig_reader *)reader)->units.unit = UNITS_AXIS_MM;
    if (rig_read_place(reader, value, q32) < 0)
        return -1;
    for (int k = 0; k < 3; k++)
        payload->origin_m[k] =
            (double)q32[k] / (double)MOTION_FIXED_ONE_Q32 * PAYLOAD_PER_MM;
    payload->is_placed = true;
    return 0;
}

static int payload_read_direction(void *reader, const struct yaml_value *value,
                                  void *out)
{
    struct rig_payload *const payload = payload_of(reader);
    struct motion_dir direction;

    (void)out;
    if (rig_read_direction(reader, value, &direction) < 0)
        return -1;
    if (direction.q62[2] != 0)
        return yaml_value_refuse(value, "is not level");
    for (int k = 0; k < 2; k++)
        payload->along[k] = (double)direction.q62[k] * 0x1p-62;
    payload->is_placed = true;
    return 0;
}

static int payload_read_kind(void *reader, const struct yaml_value *value,
                             void *out)
{
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, rig_payload_kinds, RIG_PAYLOAD_KINDS, &index) <
        0)
        return -1;
    *(uint8_t *)out = (uint8_t)index;
    return 0;
}

static int payload_read_axis(void *reader, const struct yaml_value *value,
                             void *out)
{
    struct rig_reader *const self = reader;
    char name[PLAN_NAME_MAX], list[QUOTE_LIST_MAX];

    if (yaml_value_copy(value, name, sizeof name) < 0)
        return -1;
    const int index = rig_axis_index(self->rig, name);
    if (index < 0) {
        struct yaml_value named = *value;
        named.expected = rig_axis_list(self->rig, list);
        return yaml_value_refuse(&named, "'%s' is not of the rig", name);
    }
    if (rig_axis_is_virtual(&self->rig->axis[index]))
        return yaml_value_refuse(value,
                                 "%s is a virtual axis, which carries "
                                 "nothing",
                                 name);
    *(uint32_t *)out = (uint32_t)index;
    return 0;
}

static const struct yaml_field rig_payload_fields[] = {
    { "kind", YAML_REQUIRED, "pendulum, cable, curtain or ball",
      payload_read_kind, offsetof(struct rig_payload, kind) },
    { "axis", YAML_REQUIRED, "the axis that carries it", payload_read_axis,
      offsetof(struct rig_payload, axis) },
    { "mass", YAML_REQUIRED, "0.001 .. 10000 (kg)", payload_read_kg,
      offsetof(struct rig_payload, mass_kg) },
    { "length", YAML_REQUIRED, "1 mm .. 100 m", payload_read_length,
      offsetof(struct rig_payload, length_m) },
    { "cable", YAML_OPTIONAL, "0.001 .. 10000 (kg)", payload_read_kg,
      offsetof(struct rig_payload, cable_kg) },
    { "width", YAML_OPTIONAL, "1 mm .. 100 m", payload_read_length,
      offsetof(struct rig_payload, width_m) },
    { "self_collision", YAML_OPTIONAL, "yes or no", yaml_read_bool,
      offsetof(struct rig_payload, collides) },
    { "damping", YAML_OPTIONAL, "0 .. 1", payload_read_ratio,
      offsetof(struct rig_payload, damping) },
    { "radius", YAML_OPTIONAL, "1 mm .. 100 m", payload_read_length,
      offsetof(struct rig_payload, radius_m) },
    { "friction", YAML_OPTIONAL, "0 .. 1", payload_read_ratio,
      offsetof(struct rig_payload, friction) },
    { "start", YAML_OPTIONAL, "where the ball lies, from the plate's middle",
      payload_read_start, offsetof(struct rig_payload, start_m) },
    { "wall", YAML_OPTIONAL, "1 mm .. 100 m, at both ends of a ball's plate",
      payload_read_length, offsetof(struct rig_payload, wall_m) },
    { "arm", YAML_OPTIONAL, "1 mm .. 100 m, of an axis that turns",
      payload_read_length, offsetof(struct rig_payload, arm_m) },
    { "origin", YAML_OPTIONAL,
      "where it is in the camera's space with its axis at 0, such as [0 mm, 2 "
      "m, 1.2 m]",
      payload_read_origin, 0 },
    { "direction", YAML_OPTIONAL,
      "which way its axis goes there, level, such as [1, 0, 0]",
      payload_read_direction, 0 },
    { "inertia", YAML_OPTIONAL,
      "of what the axis moves itself, 0.00001 .. 1000000 (kg, or kg m2 of an "
      "axis that turns)",
      payload_read_inertia, offsetof(struct rig_payload, inertia) },
};
const struct yaml_shape rig_payload_shape = { "payload", rig_payload_fields,
                                              ARRAY_LEN(rig_payload_fields) };

/* Keys of some kinds alone. */
static int payload_check_keys(const struct yaml_value *value,
                              const struct rig_payload *payload, bool turns)
{
    const unsigned kind = payload->kind;
    const bool ball = kind == RIG_PAYLOAD_BALL;
    const struct {
        const char *name;
        bool is_for, is_required;
    } key[] = {
        { "cable", kind == RIG_PAYLOAD_CABLE, kind == RIG_PAYLOAD_CABLE },
        { "width", kind == RIG_PAYLOAD_CURTAIN, kind == RIG_PAYLOAD_CURTAIN },
        { "self_collision", kind == RIG_PAYLOAD_CURTAIN, false },
        { "damping", kind <= RIG_PAYLOAD_CABLE, false },
        { "radius", ball, ball },
        { "friction", ball, false },
        { "start", ball, false },
        { "wall", ball, false },
        { "arm", !ball && turns, !ball && turns },
    };

    for (unsigned i = 0; i < ARRAY_LEN(key); i++) {
        const bool given = yaml_fields_find(value, key[i].name) != 0;
        if (given && !key[i].is_for)
            return yaml_value_refuse(
                value, "of kind %s%s has no %s", rig_payload_kinds[kind],
                strcmp(key[i].name, "arm") == 0 ? " on such an axis" : "",
                key[i].name);
        if (!given && key[i].is_required)
            return yaml_value_refuse(value,
                                     "of kind %s has no %s, which it "
                                     "needs",
                                     rig_payload_kinds[kind], key[i].name);
    }
    return 0;
}

/* Against the axis, what the payload is at most: kg or kg m2. */
static double payload_weight(const struct rig_payload *payload, bool turns)
{
    const double kg = payload->mass_kg + payload->cable_kg;
    const double arm = payload->kind == RIG_PAYLOAD_BALL
                           ? 0.5 * payload->length_m
                           : payload->arm_m;

    return turns ? kg * arm * arm : kg;
}

static int payload_check(const struct rig_reader *self,
                         const struct yaml_value *value,
                         const struct rig_payload *payload)
{
    const enum units_axis unit = self->rig->axis[payload->axis].unit;
    const bool turns = unit == UNITS_AXIS_DEG || unit == UNITS_AXIS_REV ||
                       unit == UNITS_AXIS_RAD;

    if (!turns && unit != UNITS_AXIS_MM)
        return yaml_value_refuse(
            value, "is on an axis in counts, which tell no length");
    if (payload->kind == RIG_PAYLOAD_BALL && !turns)
        return yaml_value_refuse(
            value, "of kind ball is on an axis in mm, which tilts "
                   "no plate");
    if (payload_check_keys(value, payload, turns) < 0)
        return -1;
    if (payload->kind == RIG_PAYLOAD_BALL &&
        (payload->start_m > 0.5 * payload->length_m ||
         payload->start_m < -0.5 * payload->length_m))
        return yaml_value_refuse(value, "has start beyond the plate, which is "
                                        "as long as length");
    if (payload->inertia > 0 &&
        payload_weight(payload, turns) > PAYLOAD_PART * payload->inertia)
        return yaml_value_refuse(value, "is more than half of the axis's own "
                                        "inertia");
    return 0;
}

static int payload_read_one(void *reader, uint32_t key,
                            const struct yaml_value *entry)
{
    struct rig_reader *const self = reader;
    struct rig_payload *const payload = payload_of(self);
    struct yaml_value value = *entry;

    *payload =
        (struct rig_payload){ .friction = 0.3,
                              .along = { 1, 0 },
                              .place = yaml_tree_place(entry->tree, key) };
    memcpy(payload->name, entry->name, strlen(entry->name) + 1);
    value.expected = "a map with kind, axis, mass, length and what belongs to "
                     "the kind";
    if (yaml_fields_read(&value, &rig_payload_shape, reader, payload) < 0 ||
        payload_check(self, &value, payload) < 0)
        return -1;
    self->rig->payload_count++;
    return 0;
}

int rig_read_payloads(void *reader, const struct yaml_value *value, void *out)
{
    struct rig *const rig = ((struct rig_reader *)reader)->rig;

    (void)out;
    rig->payload = memory_pool_new(&rig->memory,
                                   yaml_fields_count(value, RIG_PAYLOADS_MAX),
                                   sizeof *rig->payload);
    return yaml_fields_each(value, RIG_PAYLOADS_MAX, reader, payload_read_one);
}

double rig_payload_scale(const struct rig *rig,
                         const struct rig_payload *payload)
{
    static const double pi = 3.14159265358979323846;
    const double arm = payload->arm_m > 0 ? payload->arm_m : 1;

    switch (rig->axis[payload->axis].unit) {
    case UNITS_AXIS_DEG:
        return arm * pi / 180;
    case UNITS_AXIS_REV:
        return arm * 2 * pi;
    case UNITS_AXIS_RAD:
        return arm;
    case UNITS_AXIS_MM:
    case UNITS_AXIS_COUNT:
    case UNITS_AXIS_KCOUNT:
    case UNITS_AXIS_MCOUNT:
        break;
    }
    return PAYLOAD_PER_MM;
}

double rig_payload_at(const struct rig *rig, const struct rig_payload *payload,
                      int64_t pos_q32)
{
    const double pos = (double)pos_q32 / (double)MOTION_FIXED_ONE_Q32;

    return pos * rig_payload_scale(rig, payload);
}
