/* firmware/host/move/move_load_event.c - `events` of move.yaml: what is
 * triggered, and when.  See move_load.h. */
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/move/move_load.h"
#include "motion/plan/shoot/plan_event.h"

/* One event while it is read. */
struct move_event {
    struct plan_event event;
    bool once; /* `at` was given, so it is not where `every` starts */
};

int move_read_event_line(void *reader, const struct yaml_value *value,
                         void *out)
{
    const struct rig *rig = ((struct move_reader *)reader)->rig;
    const char *names[RIG_LINES_MAX];
    uint32_t line[RIG_LINES_MAX];
    unsigned count = 0, index;

    for (uint32_t i = 0; i < rig->line_count; i++)
        if (rig->line[i].kind == RIG_LINE_TRIGGER) {
            line[count] = i;
            names[count++] = rig->line[i].name;
        }
    if (count == 0)
        return yaml_value_refuse(value, "is given, and the rig has no gpio "
                                        "line of kind trigger");
    if (yaml_value_choice(value, names, count, &index) < 0)
        return -1;
    *(uint32_t *)out = line[index];
    return 0;
}

/* "time", "path" or an axis that the move drives. */
static int move_read_event_of(void *reader, const struct yaml_value *value,
                              void *out)
{
    const struct plan_move *move = ((struct move_reader *)reader)->move;
    struct plan_event *event = out;
    const char *names[RIG_AXES_MAX + 2] = { "time", "path" };
    unsigned index;

    for (uint32_t i = 0; i < move->axis_count; i++)
        names[i + 2] = move->axis[i].name;
    if (yaml_value_choice(value, names, move->axis_count + 2, &index) < 0)
        return -1;
    if (index == 1 && move->path == NULL)
        return yaml_value_refuse(value, "is path, and the move has none");
    event->of = index == 0   ? PLAN_EVENT_OF_TIME
                : index == 1 ? PLAN_EVENT_OF_PATH
                             : PLAN_EVENT_OF_AXIS;
    event->axis = index < 2 ? 0 : index - 2;
    return 0;
}

/* Beside fps a bare number could be frames as well as seconds. */
static int move_event_time(const struct move_reader *self,
                           const struct yaml_value *value, int64_t *out)
{
    char quote[YAML_QUOTE_MAX];
    const char *text = yaml_value_text(value);

    if (text != NULL && self->units.fps.den != 0 &&
        strpbrk(text, "123456789") != NULL &&
        text[strspn(text, "+-.0123456789")] == '\0') {
        return yaml_value_refuse(
            value,
            "%s may be seconds or frames, as the file has fps: say %s s "
            "or f%s",
            yaml_value_quote(quote, value), text, text);
    }
    return yaml_units_read(value, UNITS_TIME, &self->units, out);
}

/* In the unit of what the event counts. */
static int move_event_value(const struct move_reader *self,
                            const struct plan_event *event,
                            const struct yaml_value *value, int64_t *out)
{
    struct units_context units = self->units;
    const struct plan_move *move = self->move;
    uint32_t axis = event->axis;

    if (event->of == PLAN_EVENT_OF_TIME)
        return move_event_time(self, value, out);
    if (event->of == PLAN_EVENT_OF_PATH)
        axis = move->path->axis[0];
    const int found = rig_axis_index(self->rig, move->axis[axis].name);
    units.unit = self->rig->axis[found].unit;
    if (event->of == PLAN_EVENT_OF_PATH && move->path->carrier != NULL)
        units.unit = UNITS_AXIS_MM;
    return yaml_units_read(value, UNITS_POSITION, &units, out);
}

static int move_event_not_negative(const struct plan_event *event,
                                   const struct yaml_value *value,
                                   int64_t number)
{
    char quote[YAML_QUOTE_MAX];

    if (number >= 0 || event->of == PLAN_EVENT_OF_AXIS)
        return 0;
    return yaml_value_refuse(value, "%s is before the start of the %s",
                             yaml_value_quote(quote, value),
                             event->of == PLAN_EVENT_OF_TIME ? "move" : "path");
}

static int move_read_event_at(void *reader, const struct yaml_value *value,
                              void *out)
{
    struct move_event *self = out;
    struct plan_event *event = &self->event;

    if (move_event_value(reader, event, value, &event->at) < 0)
        return -1;
    event->has_at = true;
    self->once = true;
    return move_event_not_negative(event, value, event->at);
}

static int move_read_event_every(void *reader, const struct yaml_value *value,
                                 void *out)
{
    struct move_event *self = out;
    struct plan_event *event = &self->event;
    char quote[YAML_QUOTE_MAX];

    if (self->once)
        return yaml_value_refuse(value, "is given beside at; where it starts "
                                        "is from");
    if (move_event_value(reader, event, value, &event->every) < 0)
        return -1;
    if (event->every <= 0)
        return yaml_value_refuse(value, "%s is not above zero",
                                 yaml_value_quote(quote, value));
    return 0;
}

static int move_read_event_from(void *reader, const struct yaml_value *value,
                                void *out)
{
    struct plan_event *event = &((struct move_event *)out)->event;

    if (event->every == 0)
        return yaml_value_refuse(value, "is for events with every");
    if (move_event_value(reader, event, value, &event->at) < 0)
        return -1;
    event->has_at = true;
    return move_event_not_negative(event, value, event->at);
}

static int move_read_event_to(void *reader, const struct yaml_value *value,
                              void *out)
{
    struct plan_event *event = &((struct move_event *)out)->event;
    char quote[YAML_QUOTE_MAX];

    if (event->every == 0 || event->of == PLAN_EVENT_OF_AXIS)
        return yaml_value_refuse(value,
                                 "is for events with every of time or path");
    if (move_event_value(reader, event, value, &event->to) < 0)
        return -1;
    if (event->to < event->at)
        return yaml_value_refuse(value, "%s is before from",
                                 yaml_value_quote(quote, value));
    event->has_to = true;
    return 0;
}

static const struct yaml_field move_event_fields[] = {
    { "line", YAML_REQUIRED, "a gpio line of kind trigger of the rig",
      move_read_event_line, offsetof(struct move_event, event.line) },
    { "of", YAML_OPTIONAL, "time, path or an axis of the move",
      move_read_event_of, offsetof(struct move_event, event) },
    { "at", YAML_OPTIONAL, "a time, or a position of the axis or path in `of`",
      move_read_event_at, 0 },
    { "every", YAML_OPTIONAL,
      "a time, or a distance of the axis or path in `of`",
      move_read_event_every, 0 },
    { "from", YAML_OPTIONAL, "the start of every, such as 2 s",
      move_read_event_from, 0 },
    { "to", YAML_OPTIONAL, "where every ends, not before from",
      move_read_event_to, 0 },
};
const struct yaml_shape move_event_shape = { "event", move_event_fields,
                                             ARRAY_LEN(move_event_fields) };

static int move_read_event(struct move_reader *self,
                           const struct yaml_value *value,
                           struct plan_event *out)
{
    struct move_event one = {
        .event.place = yaml_tree_place(value->tree, value->node),
    };

    if (yaml_fields_read(value, &move_event_shape, self, &one) < 0)
        return -1;
    if (!one.once && one.event.every == 0)
        return yaml_value_refuse(value, "has neither at nor every");
    *out = one.event;
    return 0;
}

int move_read_events(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;
    struct plan_move *move = self->move;
    uint32_t count;

    (void)out;
    if (move_refuse_guest(self, value) < 0 ||
        move_refuse_repeat(self, value) < 0 ||
        yaml_value_list(value, 1, PLAN_EVENTS_MAX, &count) < 0)
        return -1;
    move->event = calloc(count, sizeof *move->event);
    if (move->event == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    uint32_t node = yaml_value_node(value)->first;
    for (uint32_t i = 0; i < count; i++) {
        struct yaml_value item = yaml_value_at(value, node);
        item.name = "the event";
        item.expected = "a map such as {line: camera, at: 2 s}";
        if (move_read_event(self, &item, &move->event[i]) < 0)
            return -1;
        move->events++;
        node = yaml_value_node(&item)->next;
    }
    return 0;
}
