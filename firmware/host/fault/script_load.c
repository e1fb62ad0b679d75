/* firmware/host/fault/script_load.c - faults.yaml to struct fault_script.  See
 * script.h.
 *
 * What can only be judged when two values are known is judged when the entry is
 * whole: which of axis, bus and line its kind has, and which value. */
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/fault/script_parts.h"
#include "firmware/host/yaml/yaml_shapes.h"
#include "firmware/host/yaml/yaml_units.h"
#include "motion/core/fixed.h"

#define FAULT_MS           INT64_C(1000000)
#define FAULT_TIME_MAX_NS  (INT64_C(3600000) * FAULT_MS)
#define FAULT_DELAY_MAX_NS (1000 * FAULT_MS)
#define FAULT_BROWN_OUT_NS (200 * FAULT_MS)
#define FAULT_COUNT_MAX    1000000

/* An entry while it is read. */
struct fault_reader {
    const struct rig *rig;
    struct fault_script *script;
    struct fault_entry *entry;
    bool has[3];        /* axis, bus, line */
    bool has_of, timed; /* of: is given; at: or event: */
    enum fault_value value;
};

static bool fault_is(const struct fault_reader *self, enum fault_kind kind)
{
    return self->entry->kind == kind;
}

/* ---- what it is, and of what ---- */

static int fault_read_kind(void *reader, const struct yaml_value *value,
                           void *out)
{
    unsigned index;

    (void)out;
    if (yaml_value_choice(value, fault_kind_words, FAULT_KINDS, &index) < 0)
        return -1;
    ((struct fault_reader *)reader)->entry->kind = (enum fault_kind)index;
    return 0;
}

static int fault_take(struct fault_reader *self, const struct yaml_value *value,
                      enum fault_target target, const char *const name[],
                      uint32_t count)
{
    unsigned index;

    if ((fault_shapes_of[self->entry->kind].targets >> target & 1) == 0)
        return yaml_value_refuse(value, "is not for %s",
                                 fault_kind_words[self->entry->kind]);
    for (unsigned i = 0; i < 3; i++)
        if (self->has[i])
            return yaml_value_refuse(value, "is given beside another place");
    if (yaml_value_choice(value, name, count, &index) < 0)
        return -1;
    self->has[target] = true;
    self->entry->target = target;
    self->entry->index = index;
    return 0;
}

static uint32_t fault_axes(const struct rig *rig, const char *name[])
{
    for (uint32_t i = 0; i < rig->axis_count; i++)
        name[i] = rig->axis[i].name;
    return rig->axis_count;
}

static int fault_read_axis(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct fault_reader *self = reader;
    const struct rig *rig = self->rig;
    const char *name[RIG_AXES_MAX];

    (void)out;
    if (fault_take(self, value, FAULT_OF_AXIS, name, fault_axes(rig, name)) < 0)
        return -1;
    const struct rig_axis *axis = &rig->axis[self->entry->index];
    if (rig_axis_is_virtual(axis))
        return yaml_value_refuse(value, "is a virtual axis, which has no "
                                        "faults");
    if (fault_is(self, FAULT_HEARTBEAT_LOST) &&
        !rig_kinds[axis->kind]->has_heartbeat)
        return yaml_value_refuse(value, "is an axis whose drive has no "
                                        "heartbeat");
    if (rig_kinds[axis->kind]->samples)
        return yaml_value_refuse(value, "is an axis of a board, which has no "
                                        "faults of its own");
    self->entry->of_axis = self->entry->index;
    return 0;
}

static bool fault_is_of(const struct fault_reader *self,
                        const struct rig_bus *bus)
{
    return (fault_shapes_of[self->entry->kind].buses >> bus->kind & 1) != 0;
}

/* What it can be of. */
static const char *fault_buses(const struct fault_reader *self)
{
    const unsigned buses = fault_shapes_of[self->entry->kind].buses;
    const bool rtu = (buses >> RIG_MODBUS_RTU & 1) != 0;

    if ((buses >> RIG_CAN & 1) != 0)
        return rtu ? "CAN bus or Modbus RTU line" : "CAN bus";
    if ((buses >> RIG_CANOPEN & 1) != 0)
        return "CANopen bus";
    return rtu ? "Modbus RTU line" : "Modbus TCP connection";
}

static bool fault_has_board(const struct rig *rig, unsigned bus)
{
    bool has = false;

    for (unsigned i = 0; i < rig->axis_count; i++)
        has |= rig->axis[i].bus == bus && rig_kinds[rig->axis[i].kind]->samples;
    return has;
}

static int fault_read_bus(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct fault_reader *self = reader;
    const struct rig *rig = self->rig;
    const char *name[RIG_BUSES_MAX];

    (void)out;
    for (uint32_t i = 0; i < rig->bus_count; i++)
        name[i] = rig->bus[i].name;
    if (fault_take(self, value, FAULT_OF_BUS, name, rig->bus_count) < 0)
        return -1;
    const struct rig_bus *bus = &rig->bus[self->entry->index];
    if (fault_is(self, FAULT_NOISE) && fault_has_board(rig, self->entry->index))
        return yaml_value_refuse(value, "has a board, whose frames cannot be "
                                        "spoiled");
    return fault_is_of(self, bus)
               ? 0
               : yaml_value_refuse(value, "is no %s", fault_buses(self));
}

static int fault_read_line(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct fault_reader *self = reader;
    const struct rig *rig = self->rig;
    const char *name[RIG_LINES_MAX];

    (void)out;
    for (uint32_t i = 0; i < rig->line_count; i++)
        name[i] = rig->line[i].name;
    if (rig->line_count == 0)
        return yaml_value_refuse(value, "is given, and the rig has no gpio "
                                        "line");
    if (fault_take(self, value, FAULT_OF_LINE, name, rig->line_count) < 0)
        return -1;
    return rig_line_is_output(&rig->line[self->entry->index])
               ? yaml_value_refuse(value, "is an output")
               : 0;
}

/* ---- when ---- */

static int fault_read_time(const struct yaml_value *value, int64_t least_ns,
                           int64_t most_ns, int64_t *out_ns)
{
    const struct units_context units = { .unit = UNITS_AXIS_MM };
    char quote[YAML_QUOTE_MAX];
    int64_t t_ns_q12;

    if (yaml_units_read(value, UNITS_TIME, &units, &t_ns_q12) < 0)
        return -1;
    *out_ns = t_ns_q12 / MOTION_FIXED_NS_Q12;
    return t_ns_q12 >= least_ns * MOTION_FIXED_NS_Q12 &&
                   t_ns_q12 <= most_ns * MOTION_FIXED_NS_Q12
               ? 0
               : yaml_value_refuse(value, "%s is out of range",
                                   yaml_value_quote(quote, value));
}

static int fault_read_event(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct fault_reader *self = reader;
    unsigned index;

    (void)out;
    if (yaml_value_choice(value, fault_event_words, FAULT_EVENTS, &index) < 0)
        return -1;
    self->timed = true;
    self->entry->event = (enum fault_event)index;
    return 0;
}

static int fault_read_at(void *reader, const struct yaml_value *value,
                         void *out)
{
    struct fault_reader *self = reader;

    (void)out;
    self->timed = true;
    return fault_read_time(value, 0, FAULT_TIME_MAX_NS, &self->entry->after_ns);
}

static int fault_read_of(void *reader, const struct yaml_value *value,
                         void *out)
{
    struct fault_reader *self = reader;
    const char *name[RIG_AXES_MAX];
    unsigned index;

    (void)out;
    if (yaml_value_choice(value, name, fault_axes(self->rig, name), &index) < 0)
        return -1;
    if (rig_axis_is_virtual(&self->rig->axis[index]))
        return yaml_value_refuse(value, "is a virtual axis, which is simulated "
                                        "nowhere");
    self->has_of = true;
    self->entry->of_axis = index;
    return 0;
}

static int fault_read_quantity(const struct fault_reader *self, uint32_t axis,
                               const struct yaml_value *value,
                               enum units_quantity quantity, int64_t *out)
{
    const struct units_context units = { .unit = self->rig->axis[axis].unit };

    return yaml_units_read(value, quantity, &units, out);
}

static int fault_read_position(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct fault_reader *self = reader;

    (void)out;
    if (self->timed)
        return yaml_value_refuse(value, "is given beside a time");
    if (!self->has[FAULT_OF_AXIS] && !self->has_of)
        return yaml_value_refuse(value, "is of no axis: say of: AXIS");
    self->entry->by_position = true;
    return fault_read_quantity(self, self->entry->of_axis, value,
                               UNITS_POSITION, &self->entry->pos_q32);
}

static int fault_read_for(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct fault_reader *self = reader;

    (void)out;
    if (!fault_shapes_of[self->entry->kind].lasts)
        return yaml_value_refuse(value, "is not for %s, which is over at once",
                                 fault_kind_words[self->entry->kind]);
    return fault_read_time(value, 1, FAULT_TIME_MAX_NS, &self->entry->for_ns);
}

/* ---- how ---- */

/* Is this the value that its kind of fault has? */
static int fault_need(struct fault_reader *self, const struct yaml_value *value,
                      enum fault_value what)
{
    if (fault_shapes_of[self->entry->kind].value != what)
        return yaml_value_refuse(value, "is not for %s",
                                 fault_kind_words[self->entry->kind]);
    self->value = what;
    return 0;
}

static int fault_read_code(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct fault_reader *self = reader;

    (void)out;
    if (fault_need(self, value, FAULT_CODE) < 0)
        return -1;
    if (!self->has[FAULT_OF_AXIS])
        return 0; /* said when the entry is whole */
    const struct rig_axis *axis = &self->rig->axis[self->entry->index];
    return yaml_value_number(value, 1, rig_kinds[axis->kind]->code_max,
                             &self->entry->value);
}

static int fault_read_by(void *reader, const struct yaml_value *value,
                         void *out)
{
    static const enum units_quantity quantity[FAULT_KINDS] = {
        [FAULT_ENCODER_JUMP] = UNITS_POSITION,
        [FAULT_FRICTION_STEP] = UNITS_ACCELERATION,
        [FAULT_OVERHEAT] = UNITS_TEMPERATURE,
        [FAULT_SUPPLY] = UNITS_VOLTAGE,
    };
    struct fault_reader *self = reader;
    const bool friction = fault_is(self, FAULT_FRICTION_STEP);
    char quote[YAML_QUOTE_MAX];

    (void)out;
    if (fault_need(self, value, FAULT_BY) < 0)
        return -1;
    if (!self->has[FAULT_OF_AXIS])
        return 0;
    if (fault_read_quantity(self, self->entry->index, value,
                            quantity[self->entry->kind],
                            &self->entry->value) < 0)
        return -1;
    return friction && self->entry->value <= 0
               ? yaml_value_refuse(value, "%s is not above zero",
                                   yaml_value_quote(quote, value))
               : 0;
}

static int fault_read_level(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct fault_reader *self = reader;
    unsigned index;

    (void)out;
    if (fault_need(self, value, FAULT_LEVEL) < 0 ||
        yaml_value_choice(value, fault_level_words, FAULT_LEVELS, &index) < 0)
        return -1;
    self->entry->value = index;
    return 0;
}

static int fault_read_rate(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct fault_reader *self = reader;
    const struct units_context units = { .unit = UNITS_AXIS_MM };
    char quote[YAML_QUOTE_MAX];

    (void)out;
    if (fault_need(self, value, FAULT_RATE) < 0 ||
        yaml_units_read(value, UNITS_RATIO, &units, &self->entry->value) < 0)
        return -1;
    return self->entry->value > 0 && self->entry->value <= MOTION_FIXED_ONE_Q32
               ? 0
               : yaml_value_refuse(value, "%s is out of range",
                                   yaml_value_quote(quote, value));
}

static int fault_read_delay(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct fault_reader *self = reader;

    (void)out;
    return fault_need(self, value, FAULT_DELAY) < 0
               ? -1
               : fault_read_time(value, 1, FAULT_DELAY_MAX_NS,
                                 &self->entry->value);
}

static int fault_read_count(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct fault_reader *self = reader;

    (void)out;
    return fault_need(self, value, FAULT_COUNT) < 0
               ? -1
               : yaml_value_integer(value, 1, FAULT_COUNT_MAX,
                                    &self->entry->value);
}

static int fault_read_direction(void *reader, const struct yaml_value *value,
                                void *out)
{
    struct fault_reader *self = reader;
    unsigned index;

    (void)out;
    if (!fault_shapes_of[self->entry->kind].directed)
        return yaml_value_refuse(value, "is not for %s",
                                 fault_kind_words[self->entry->kind]);
    if (yaml_value_choice(value, fault_direction_words, FAULT_DIRECTIONS,
                          &index) < 0)
        return -1;
    if (self->has[FAULT_OF_BUS] &&
        rig_bus_is_can(&self->rig->bus[self->entry->index]))
        return yaml_value_refuse(value, "is not for noise on CAN, which every "
                                        "node receives");
    self->entry->incoming = index == 1;
    return 0;
}

static const struct yaml_field fault_entry_fields[] = {
    { "fault", YAML_REQUIRED, "what happens, such as drive_fault",
      fault_read_kind, 0 },
    { "axis", YAML_OPTIONAL, "an axis of the rig that this can happen to",
      fault_read_axis, 0 },
    { "bus", YAML_OPTIONAL, "a bus of the rig that this can happen to",
      fault_read_bus, 0 },
    { "line", YAML_OPTIONAL, "a gpio input of the rig", fault_read_line, 0 },
    { "event", YAML_OPTIONAL,
      "enable, home, approach, move, settle, off, hold, stop or fault",
      fault_read_event, 0 },
    { "at", YAML_OPTIONAL,
      "a time from 0 s to 1 h after the event, or after the start of the move",
      fault_read_at, 0 },
    { "of", YAML_OPTIONAL, "the axis of the rig that position is one of",
      fault_read_of, 0 },
    { "position", YAML_OPTIONAL, "where the axis is when it happens",
      fault_read_position, 0 },
    { "for", YAML_OPTIONAL, "how long it lasts, to 1 h", fault_read_for, 0 },
    { "code", YAML_OPTIONAL,
      "a code that this kind of drive can have, such as 0x2310",
      fault_read_code, 0 },
    { "by", YAML_OPTIONAL,
      "a distance for encoder_jump, an acceleration for friction_step, degC "
      "for overheat, V for supply",
      fault_read_by, 0 },
    { "level", YAML_OPTIONAL, "active, inactive or open", fault_read_level, 0 },
    { "rate", YAML_OPTIONAL, "the share of frames, above 0 to 100 %",
      fault_read_rate, 0 },
    { "delay", YAML_OPTIONAL, "above 0 to 1 s", fault_read_delay, 0 },
    { "count", YAML_OPTIONAL, "how many, 1 .. 1000000", fault_read_count, 0 },
    { "direction", YAML_OPTIONAL, "from (the drive) or to",
      fault_read_direction, 0 },
};
static const struct yaml_shape fault_entry_shape = {
    "fault", fault_entry_fields, ARRAY_LEN(fault_entry_fields)
};

/* ---- the whole ---- */

/* "axis" or "axis or bus". */
static const char *fault_places(enum fault_kind kind)
{
    const unsigned targets = fault_shapes_of[kind].targets;

    return targets == (FAULT_AXIS | FAULT_BUS) ? "axis or bus"
           : targets == FAULT_AXIS             ? "axis"
           : targets == FAULT_BUS              ? "bus"
                                               : "line";
}

static int fault_judge(const struct fault_reader *self,
                       const struct yaml_value *value)
{
    struct fault_entry *entry = self->entry;
    const struct fault_shape *shape = &fault_shapes_of[entry->kind];

    if (!self->has[FAULT_OF_AXIS] && !self->has[FAULT_OF_BUS] &&
        !self->has[FAULT_OF_LINE])
        return yaml_value_refuse(value, "does not say which %s",
                                 fault_places(entry->kind));
    if (shape->needs_value && self->value == FAULT_NOTHING) {
        const char *name = fault_value_words[shape->value];
        struct yaml_value missing = *value;
        for (unsigned i = 0; i < ARRAY_LEN(fault_entry_fields); i++)
            if (strcmp(fault_entry_fields[i].name, name) == 0)
                missing.expected = fault_entry_fields[i].expected;
        return yaml_value_refuse(&missing, "has no %s", name);
    }
    if (self->has_of && !entry->by_position)
        return yaml_value_refuse(value, "has of and no position");
    if (!self->timed && !entry->by_position)
        return yaml_value_refuse(value, "does not say when: at, event or "
                                        "position");
    if (fault_is(self, FAULT_BROWN_OUT) && entry->for_ns == 0)
        entry->for_ns = FAULT_BROWN_OUT_NS;
    if (fault_is(self, FAULT_WRONG_ANSWER) && entry->value == 0)
        entry->value = 1;
    return 0;
}

static int fault_read_entry(struct fault_reader *self,
                            const struct yaml_value *value)
{
    struct fault_script *script = self->script;
    struct fault_reader one = { .rig = self->rig,
                                .script = script,
                                .entry = &script->entry[script->count] };

    *one.entry = (struct fault_entry){
        .event = FAULT_ON_MOVE,
        .place = yaml_tree_place(value->tree, value->node),
    };
    if (yaml_fields_read(value, &fault_entry_shape, &one, one.entry) < 0 ||
        fault_judge(&one, value) < 0)
        return -1;
    script->count++;
    return 0;
}

static int fault_read_entries(void *reader, const struct yaml_value *value,
                              void *out)
{
    uint32_t count, node;

    (void)out;
    if (yaml_value_list(value, 1, FAULT_ENTRIES_MAX, &count) < 0)
        return -1;
    node = yaml_value_node(value)->first;
    for (; count > 0; count--) {
        struct yaml_value item = yaml_value_at(value, node);
        item.name = "the fault";
        item.expected = "a map such as {fault: reboot, axis: pan, at: 2 s}";
        if (fault_read_entry(reader, &item) < 0)
            return -1;
        node = yaml_value_node(&item)->next;
    }
    return 0;
}

static int fault_read_seed(void *reader, const struct yaml_value *value,
                           void *out)
{
    int64_t seed;

    (void)reader;
    if (yaml_value_number(value, 1, INT64_MAX, &seed) < 0)
        return -1;
    *(uint64_t *)out = (uint64_t)seed;
    return 0;
}

static const struct yaml_field fault_fields[] = {
    { "seed", YAML_OPTIONAL, "a whole number of 1 or more", fault_read_seed,
      offsetof(struct fault_script, seed) },
    { "faults", YAML_REQUIRED, "a list of 1 .. 32 faults", fault_read_entries,
      0 },
};
static const struct yaml_shape fault_shape = { "faults", fault_fields,
                                               ARRAY_LEN(fault_fields) };
const struct yaml_shape *const fault_shapes[] = { &fault_shape,
                                                  &fault_entry_shape, NULL };
const struct yaml_words fault_words[] = {
    { "fault.fault", fault_kind_words, FAULT_KINDS },
    { "fault.event", fault_event_words, FAULT_EVENTS },
    { "fault.level", fault_level_words, FAULT_LEVELS },
    { "fault.direction", fault_direction_words, FAULT_DIRECTIONS },
    { NULL, NULL, 0 },
};

int fault_script_load(const struct files *files, const char *path,
                      const struct rig *rig, struct fault_script *script,
                      char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct fault_reader reader = { .rig = rig, .script = script };
    struct yaml_tree tree;
    int err;

    *script = (struct fault_script){ .seed = 1 };
    if (yaml_tree_load(files, &tree, &report) < 0)
        return -1;
    const struct yaml_value whole = { &tree, 0, "the fault script",
                                      "a map with a list of faults" };
    err = yaml_fields_read(&whole, &fault_shape, &reader, script);
    yaml_tree_free(&tree);
    return err;
}
