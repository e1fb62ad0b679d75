/* firmware/host/rig/rig_gpio.c - the digital lines of a rig. */
#include "firmware/host/rig/rig_parts.h"

#include <string.h>

#define RIG_RELEASE_MAX     (10000 * RIG_MS)
#define RIG_WIDTH_MAX       (10000 * RIG_MS)
#define RIG_REST_MAX        (60000 * RIG_MS)
#define RIG_LEAD_MAX        (2000 * RIG_MS)
#define RIG_DISCREPANCY     (500 * RIG_MS)
#define RIG_DISCREPANCY_MIN (10 * RIG_MS)
#define RIG_DISCREPANCY_MAX (10000 * RIG_MS)
#define RIG_FRAME_MIN       (5 * RIG_MS)
#define RIG_FRAME_MAX       (1000 * RIG_MS)
#define RIG_RELEASE         (50 * RIG_MS)
#define RIG_EVERY_MIN       (200 * RIG_MS) /* of simulated pulses */
#define RIG_EVERY_MAX       (600000 * RIG_MS)

const char *const rig_line_kinds[RIG_LINE_KINDS] = {
    [RIG_LINE_ESTOP] = "e-stop",
    [RIG_LINE_LIMIT_NEGATIVE] = "limit-negative",
    [RIG_LINE_LIMIT_POSITIVE] = "limit-positive",
    [RIG_LINE_LAMP] = "lamp",
    [RIG_LINE_HOME] = "home",
    [RIG_LINE_TRIGGER] = "trigger",
    [RIG_LINE_START] = "start",
    [RIG_LINE_FRAME] = "frame",
};
const char *const rig_line_levels[RIG_LINE_LEVELS] = { "high", "low" };
const char *const rig_line_biases[RIG_LINE_BIASES] = {
    [HAL_GPIO_AS_IS] = "as-is",
    [HAL_GPIO_PULL_UP] = "pull-up",
    [HAL_GPIO_PULL_DOWN] = "pull-down",
    [HAL_GPIO_NO_PULL] = "none",
};

bool rig_line_is_output(const struct rig_line *line)
{
    return line->kind == RIG_LINE_LAMP || line->kind == RIG_LINE_TRIGGER;
}

const char *rig_line_kind_text(enum rig_line_kind kind)
{
    return rig_line_kinds[kind];
}

static bool rig_line_has_axis(const struct rig_line *line)
{
    return line->kind == RIG_LINE_LIMIT_NEGATIVE ||
           line->kind == RIG_LINE_LIMIT_POSITIVE || line->kind == RIG_LINE_HOME;
}

static struct rig_line *rig_line_of(struct rig_reader *self)
{
    return &self->rig->line[self->rig->line_count - 1];
}

static int rig_read_line_kind(void *reader, const struct yaml_value *value,
                              void *out)
{
    const struct rig *rig = ((struct rig_reader *)reader)->rig;
    unsigned index;
    if (yaml_value_choice(value, rig_line_kinds, RIG_LINE_KINDS, &index) < 0)
        return -1;
    unsigned triggers = index == RIG_LINE_TRIGGER ? 1 : 0;
    unsigned estops = index == RIG_LINE_ESTOP ? 1 : 0;
    for (uint32_t i = 0; i + 1 < rig->line_count; i++) {
        triggers += rig->line[i].kind == RIG_LINE_TRIGGER;
        estops += rig->line[i].kind == RIG_LINE_ESTOP;
    }
    if (triggers > RIG_TRIGGERS_MAX)
        return yaml_value_refuse(value, "is the %uth trigger, %d are allowed",
                                 triggers, RIG_TRIGGERS_MAX);
    if (index == RIG_LINE_ESTOP && estops > 2)
        return yaml_value_refuse(value,
                                 "is a third e-stop, where one has at most "
                                 "two channels");
    if (index == RIG_LINE_FRAME)
        rig_line_of(reader)->release_ns = 0; /* pulses may follow at once */
    if (index == RIG_LINE_ESTOP && estops == 2)
        rig_line_of(reader)->discrepancy_ns = RIG_DISCREPANCY;
    *(enum rig_line_kind *)out = (enum rig_line_kind)index;
    return 0;
}

static int rig_read_line_axis(void *reader, const struct yaml_value *value,
                              void *out)
{
    const struct rig *rig = ((struct rig_reader *)reader)->rig;
    const struct rig_line *line = rig_line_of(reader);
    const char *name = yaml_value_text(value);
    int axis;
    if (name == NULL)
        return -1;
    if (!rig_line_has_axis(line))
        return yaml_value_refuse(value, "is not for a line of kind %s",
                                 rig_line_kinds[line->kind]);
    axis = rig_axis_index(rig, name);
    if (axis < 0)
        return yaml_value_refuse(value, "'%.40s' is not an axis of this rig",
                                 name);
    if (rig_axis_is_virtual(&rig->axis[axis]))
        return yaml_value_refuse(value,
                                 "%s is a virtual axis, which has no "
                                 "switches",
                                 name);
    for (uint32_t i = 0; i + 1 < rig->line_count; i++)
        if (rig->line[i].kind == line->kind && rig->line[i].axis == axis)
            return yaml_value_refuse(value, "%s has %s as its %s already", name,
                                     rig->line[i].name,
                                     rig_line_kinds[line->kind]);
    *(int *)out = axis;
    return 0;
}

static int rig_read_line_chip(void *reader, const struct yaml_value *value,
                              void *out)
{
    (void)reader;
    return yaml_value_copy(value, out, RIG_LINE_NAME_MAX);
}

static int rig_read_line_active(void *reader, const struct yaml_value *value,
                                void *out)
{
    unsigned index;
    (void)reader;
    if (yaml_value_choice(value, rig_line_levels, RIG_LINE_LEVELS, &index) < 0)
        return -1;
    *(bool *)out = index == 1;
    return 0;
}

static int rig_read_line_bias(void *reader, const struct yaml_value *value,
                              void *out)
{
    unsigned index;
    if (rig_line_is_output(rig_line_of(reader)))
        return yaml_value_refuse(value, "is not for an output");
    if (yaml_value_choice(value, rig_line_biases, RIG_LINE_BIASES, &index) < 0)
        return -1;
    *(enum hal_gpio_bias *)out = (enum hal_gpio_bias)index;
    return 0;
}

static int rig_read_line_release(void *reader, const struct yaml_value *value,
                                 void *out)
{
    if (rig_line_is_output(rig_line_of(reader)))
        return yaml_value_refuse(value, "is not for an output");
    return rig_read_time(reader, value, 0, RIG_RELEASE_MAX, RIG_MS, out);
}

/* Of the second channel; see rig_read_line_kind. */
static int rig_read_line_discrepancy(void *reader,
                                     const struct yaml_value *value, void *out)
{
    if (rig_line_of(reader)->discrepancy_ns == 0)
        return yaml_value_refuse(value,
                                 "is for the second line of kind e-stop");
    return rig_read_time(reader, value, RIG_DISCREPANCY_MIN,
                         RIG_DISCREPANCY_MAX, RIG_MS, out);
}

static int rig_read_line_pulse(struct rig_reader *reader,
                               const struct yaml_value *value, int64_t min_ns,
                               int64_t max_ns, int64_t *out)
{
    const struct rig_line *line = rig_line_of(reader);
    if (line->kind != RIG_LINE_TRIGGER)
        return yaml_value_refuse(value, "is not for a line of kind %s",
                                 rig_line_kinds[line->kind]);
    return rig_read_time(reader, value, min_ns, max_ns, RIG_MS, out);
}

static int rig_read_line_width(void *reader, const struct yaml_value *value,
                               void *out)
{
    return rig_read_line_pulse(reader, value, RIG_MS, RIG_WIDTH_MAX, out);
}

static int rig_read_line_rest(void *reader, const struct yaml_value *value,
                              void *out)
{
    return rig_read_line_pulse(reader, value, 0, RIG_REST_MAX, out);
}

static int rig_read_line_lead(void *reader, const struct yaml_value *value,
                              void *out)
{
    return rig_read_line_pulse(reader, value, 0, RIG_LEAD_MAX, out);
}

/* [low, high], positions of the axis; of a start the time between pulses. */
static int rig_read_line_sim(void *reader, const struct yaml_value *value,
                             void *out)
{
    struct rig_reader *self = reader;
    struct rig_line *line = rig_line_of(self);
    struct yaml_value end[2];

    (void)out;
    if (line->kind == RIG_LINE_START)
        return rig_read_time(reader, value, RIG_EVERY_MIN, RIG_EVERY_MAX,
                             RIG_MS, &line->sim_every_ns);
    if (line->kind == RIG_LINE_FRAME)
        return rig_read_time(reader, value, RIG_FRAME_MIN, RIG_FRAME_MAX, 1,
                             &line->sim_every_ns);
    if (!rig_line_has_axis(line) || line->axis < 0)
        return yaml_value_refuse(value, "is for a switch of an axis");
    self->units.unit = self->rig->axis[line->axis].unit;
    if (yaml_value_pair(value, end) < 0 ||
        rig_read_quantity(self, &end[0], UNITS_POSITION, &line->sim_low_q32) <
            0 ||
        rig_read_quantity(self, &end[1], UNITS_POSITION, &line->sim_high_q32) <
            0)
        return -1;
    if (line->sim_low_q32 > line->sim_high_q32)
        return yaml_value_refuse(value, "ends before it begins");
    line->has_sim = true;
    return 0;
}

static const struct yaml_field rig_line_fields[] = {
    { "kind", YAML_REQUIRED,
      "e-stop, limit-negative, limit-positive, lamp, home, trigger, start or "
      "frame",
      rig_read_line_kind, offsetof(struct rig_line, kind) },
    { "axis", YAML_OPTIONAL, "the axis that a limit or home switch belongs to",
      rig_read_line_axis, offsetof(struct rig_line, axis) },
    { "chip", YAML_OPTIONAL, "a chip's name or label, such as gpiochip0",
      rig_read_line_chip, offsetof(struct rig_line, chip) },
    { "line", YAML_REQUIRED, "a line's name, or with a chip its number",
      rig_read_line_chip, offsetof(struct rig_line, line) },
    { "active", YAML_OPTIONAL, "high or low", rig_read_line_active,
      offsetof(struct rig_line, active_low) },
    { "bias", YAML_OPTIONAL, "as-is, pull-up, pull-down or none",
      rig_read_line_bias, offsetof(struct rig_line, bias) },
    { "release", YAML_OPTIONAL, "0 .. 10 s in whole ms", rig_read_line_release,
      offsetof(struct rig_line, release_ns) },
    { "discrepancy", YAML_OPTIONAL, "10 ms .. 10 s in whole ms",
      rig_read_line_discrepancy, offsetof(struct rig_line, discrepancy_ns) },
    { "width", YAML_OPTIONAL, "1 ms .. 10 s in whole ms", rig_read_line_width,
      offsetof(struct rig_line, width_ns) },
    { "rest", YAML_OPTIONAL, "0 .. 60 s in whole ms", rig_read_line_rest,
      offsetof(struct rig_line, rest_ns) },
    { "lead", YAML_OPTIONAL, "0 .. 2 s in whole ms", rig_read_line_lead,
      offsetof(struct rig_line, lead_ns) },
    { "sim", YAML_OPTIONAL,
      "[low, high], two positions of the axis; of a start, 0.2 s .. 600 s in "
      "whole ms; of a frame 5 ms .. 1 s",
      rig_read_line_sim, 0 },
};
const struct yaml_shape rig_line_shape = { "line", rig_line_fields,
                                           ARRAY_LEN(rig_line_fields) };

static int rig_read_line(void *reader, uint32_t key,
                         const struct yaml_value *entry)
{
    struct rig_reader *self = reader;
    struct rig_line *line = &self->rig->line[self->rig->line_count++];
    struct yaml_value value = *entry;

    *line = (struct rig_line){ .axis = -1,
                               .release_ns = RIG_RELEASE,
                               .width_ns = 50 * RIG_MS,
                               .place = yaml_tree_place(entry->tree, key) };
    memcpy(line->name, entry->name, strlen(entry->name) + 1);
    value.expected = "a map with kind, line and what belongs to the kind";
    if (yaml_fields_read(&value, &rig_line_shape, reader, line) < 0)
        return -1;
    if (rig_line_has_axis(line) && line->axis < 0)
        return yaml_value_refuse(&value, "of kind %s names no axis",
                                 rig_line_kinds[line->kind]);
    return rig_claim_line(self, &value, line);
}

unsigned rig_trigger_count(const struct rig *rig)
{
    unsigned count = 0;
    for (uint32_t i = 0; i < rig->line_count; i++)
        count += rig->line[i].kind == RIG_LINE_TRIGGER;
    return count;
}

int rig_read_gpio(void *reader, const struct yaml_value *value, void *out)
{
    struct rig *rig = ((struct rig_reader *)reader)->rig;
    (void)out;
    rig->line =
        memory_pool_new(&rig->memory, yaml_fields_count(value, RIG_LINES_MAX),
                        sizeof *rig->line);
    return yaml_fields_each(value, RIG_LINES_MAX, reader, rig_read_line);
}
