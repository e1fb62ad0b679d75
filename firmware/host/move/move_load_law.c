/* firmware/host/move/move_load_law.c - `speed` of a path in move.yaml: the
 * parts of its law.  See move_load.h.
 *
 * What a law takes and needs is a table, as it is with curves. */
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/move/move_load.h"
#include "motion/core/fixed.h"

/* ---- words ---- */

const char *const move_laws[MOVE_LAWS] = {
#define MOVE_SPEED_LAW_SPELLING(name, spelling, text) [name] = spelling,
    PLAN_SPEED_LAW_LIST(MOVE_SPEED_LAW_SPELLING)
#undef MOVE_SPEED_LAW_SPELLING
};

const char *const move_ramps[MOVE_RAMPS] = {
#define MOVE_RAMP_SPELLING(name, spelling, kind) [name] = spelling,
    PLAN_RAMP_LIST(MOVE_RAMP_SPELLING)
#undef MOVE_RAMP_SPELLING
};

/* ---- parts of a speed law ---- */

enum {
    MOVE_SHAPE = 1,
    MOVE_TIME = 2,
    MOVE_LENGTH = 4,
    MOVE_FROM = 8,
    MOVE_TO = 16,
    MOVE_EASE = 32,
    MOVE_POINTS = 64,
    MOVE_DISTANCE = 128,
};

static const struct {
    unsigned needs, takes;
    enum plan_extent extent; /* when no length is given */
} move_speed_law[MOVE_LAWS] = {
    [PLAN_SPEED_LAW_CUBIC] = { MOVE_TIME, MOVE_LENGTH, PLAN_EXTENT_REST },
    [PLAN_SPEED_LAW_QUINTIC] = { MOVE_TIME, MOVE_LENGTH, PLAN_EXTENT_REST },
    [PLAN_SPEED_LAW_SINE] = { MOVE_TIME, MOVE_LENGTH | MOVE_EASE,
                              PLAN_EXTENT_REST },
    [PLAN_SPEED_LAW_PARABOLIC] = { MOVE_TIME, MOVE_LENGTH | MOVE_EASE,
                                   PLAN_EXTENT_REST },
    [PLAN_SPEED_LAW_SCURVE] = { MOVE_TIME, MOVE_LENGTH | MOVE_EASE,
                                PLAN_EXTENT_REST },
    [PLAN_SPEED_LAW_RAMP] = { MOVE_TIME | MOVE_TO, MOVE_SHAPE | MOVE_FROM,
                              PLAN_EXTENT_TIMED },
    [PLAN_SPEED_LAW_CONSTANT] = { 0, MOVE_TIME | MOVE_LENGTH | MOVE_FROM,
                                  PLAN_EXTENT_REST },
    [PLAN_SPEED_LAW_PAUSE] = { MOVE_TIME, 0, PLAN_EXTENT_TIMED },
    [PLAN_SPEED_LAW_ACCELERATION] = { MOVE_POINTS, MOVE_FROM | MOVE_LENGTH,
                                      PLAN_EXTENT_TIMED },
    [PLAN_SPEED_LAW_VELOCITY] = { MOVE_POINTS, MOVE_LENGTH, PLAN_EXTENT_TIMED },
    [PLAN_SPEED_LAW_DRAWN] = { MOVE_DISTANCE, MOVE_LENGTH, PLAN_EXTENT_REST },
};

static int move_check_law(const struct move_reader *self,
                          const struct yaml_value *value, unsigned what)
{
    const enum plan_speed_law law = self->part->law;

    if ((move_speed_law[law].needs | move_speed_law[law].takes) & what)
        return 0;
    return yaml_value_refuse(value, "is not used by speed law %s",
                             move_laws[law]);
}

static int move_read_law(void *reader, const struct yaml_value *value,
                         void *out)
{
    struct plan_part *part = out;
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, move_laws, MOVE_LAWS, &index) < 0)
        return -1;
    part->law = (enum plan_speed_law)index;
    part->extent = move_speed_law[index].extent;
    return 0;
}

static int move_read_shape(void *reader, const struct yaml_value *value,
                           void *out)
{
    unsigned index;

    if (move_check_law(reader, value, MOVE_SHAPE) < 0 ||
        yaml_value_choice(value, move_ramps, MOVE_RAMPS, &index) < 0)
        return -1;
    *(enum plan_ramp *)out = (enum plan_ramp)index;
    return 0;
}

static int move_read_part_time(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct plan_part *part = out;

    if (move_check_law(reader, value, MOVE_TIME) < 0 ||
        move_read_positive(reader, value, UNITS_TIME, &part->dur_ns_q12) < 0)
        return -1;
    if (part->law == PLAN_SPEED_LAW_CONSTANT)
        part->extent = PLAN_EXTENT_TIMED;
    return 0;
}

static int move_read_part_length(void *reader, const struct yaml_value *value,
                                 void *out)
{
    struct plan_part *part = out;
    const char *text = yaml_value_text(value);

    if (text == NULL || move_check_law(reader, value, MOVE_LENGTH) < 0)
        return -1;
    if (part->law == PLAN_SPEED_LAW_CONSTANT && part->dur_ns_q12 > 0)
        return yaml_value_refuse(value, "is given beside a time");
    part->extent = PLAN_EXTENT_REST;
    if (strcmp(text, "rest") == 0)
        return 0;
    part->extent = PLAN_EXTENT_GIVEN;
    if (move_read_distance(reader, value, &part->length) < 0)
        return -1;
    if (part->length.q32 == 0)
        return yaml_value_refuse(value, "'%s' is not above zero", text);
    return 0;
}

static int move_read_part_speed(const struct move_reader *self,
                                const struct yaml_value *value, int64_t *out)
{
    char quote[YAML_QUOTE_MAX];

    if (yaml_units_read(value, UNITS_VELOCITY, &self->units, out) < 0)
        return -1;
    if (*out < 0)
        return yaml_value_refuse(value, "%s goes backwards",
                                 yaml_value_quote(quote, value));
    return 0;
}

static int move_read_part_from(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct plan_part *part = out;

    part->has_from = true;
    return move_check_law(reader, value, MOVE_FROM) < 0
               ? -1
               : move_read_part_speed(reader, value, &part->from_q32);
}

static int move_read_part_to(void *reader, const struct yaml_value *value,
                             void *out)
{
    return move_check_law(reader, value, MOVE_TO) < 0
               ? -1
               : move_read_part_speed(reader, value, out);
}

static int move_read_part_ease(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct plan_part *part = out;

    return move_check_law(reader, value, MOVE_EASE) < 0
               ? -1
               : move_read_ease_list(reader, value, &part->k1_q32,
                                     &part->k2_q32);
}

/* [t, value] */
static int move_read_law_point(const struct move_reader *self,
                               const struct yaml_value *value, uint32_t i)
{
    const bool is_acc = self->part->law == PLAN_SPEED_LAW_ACCELERATION;
    struct motion_speed_point *point = &self->part->point[i];
    struct yaml_value item[2];
    int64_t number = 0;

    if (yaml_value_pair(value, item) < 0 ||
        yaml_units_read(&item[0], UNITS_TIME, &self->units, &point->t_ns_q12) <
            0)
        return -1;
    if (i == 0 ? point->t_ns_q12 != 0
               : point->t_ns_q12 < point[-1].t_ns_q12 ||
                     (!is_acc && point->t_ns_q12 == point[-1].t_ns_q12))
        return yaml_value_refuse(&item[0], i == 0
                                               ? "does not begin at 0 s"
                                               : "is not later than the point "
                                                 "before it");
    if (yaml_units_read(&item[1], is_acc ? UNITS_ACCELERATION : UNITS_VELOCITY,
                        &self->units, &number) < 0)
        return -1;
    point->value = motion_real_from_q(number, 32);
    return 0;
}

static int move_read_law_points(void *reader, const struct yaml_value *value,
                                void *out)
{
    struct plan_part *part = out;
    struct yaml_value item = { value->tree, 0, "point",
                               "[time from the start of the part, value]" };
    uint32_t count;

    if (move_check_law(reader, value, MOVE_POINTS) < 0 ||
        yaml_value_list(value, 2, PLAN_SPEED_LAW_POINTS_MAX, &count) < 0)
        return -1;
    part->point = calloc(count, sizeof *part->point);
    if (part->point == NULL)
        return yaml_value_refuse(value, "do not fit in memory");
    item.node = yaml_value_node(value)->first;
    for (; part->points < count; part->points++) {
        if (move_read_law_point(reader, &item, part->points) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

/* Keys of distance as parts of the part's length, from [0 s, 0 %] to 100 %. */
static int move_read_drawn(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct move_reader *self = reader;
    struct plan_part *part = out;
    const struct plan_axis *drawn;

    if (move_check_law(self, value, MOVE_DISTANCE) < 0)
        return -1;
    part->drawn = calloc(1, sizeof *part->drawn);
    if (part->drawn == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    if (move_read_keyed(self, value, UNITS_RATIO, self->units.unit,
                        part->drawn) < 0)
        return -1;
    drawn = part->drawn;
    if (drawn->key_count < 2 || drawn->key[0].key.t_ns_q12 != 0 ||
        drawn->key[0].key.pos_q32 != 0 ||
        drawn->key[drawn->key_count - 1].key.pos_q32 != MOTION_FIXED_ONE_Q32)
        return yaml_value_refuse(value,
                                 "does not go from [0 s, 0 %%] to 100 %%");
    return 0;
}

static const struct yaml_field move_part_fields[] = {
    { "law", YAML_REQUIRED, "a kind of speed law", move_read_law, 0 },
    { "shape", YAML_OPTIONAL, "linear, sine, cubic or s-curve, with ramp",
      move_read_shape, offsetof(struct plan_part, shape) },
    { "time", YAML_OPTIONAL, "how long the part takes, above zero",
      move_read_part_time, 0 },
    { "length", YAML_OPTIONAL,
      "a length of the path, a part of it in %, or rest", move_read_part_length,
      0 },
    { "from", YAML_OPTIONAL,
      "a speed, zero or above, with ramp, constant or acceleration",
      move_read_part_from, 0 },
    { "to", YAML_OPTIONAL, "a speed, zero or above, with ramp",
      move_read_part_to, offsetof(struct plan_part, to_q32) },
    { "ease", YAML_OPTIONAL,
      "[k1, k2], 0 <= k1 <= k2 <= 1, with sine, parabolic or s-curve",
      move_read_part_ease, 0 },
    { "points", YAML_OPTIONAL,
      "a list of [time, value], the first at 0 s, with acceleration or "
      "velocity",
      move_read_law_points, 0 },
    { "distance", YAML_OPTIONAL,
      "a map with curve and keys from [0 s, 0 %] to 100 %, with drawn",
      move_read_drawn, 0 },
};
const struct yaml_shape move_part_shape = { "part", move_part_fields,
                                            ARRAY_LEN(move_part_fields) };

/* What a part's law needs and the part does not have. */
static const char *move_lacks(const struct yaml_value *value, unsigned needs)
{
    for (unsigned i = 1; i < ARRAY_LEN(move_part_fields); i++)
        if (needs & 1u << (i - 1) &&
            yaml_fields_find(value, move_part_fields[i].name) == 0)
            return move_part_fields[i].name;
    return NULL;
}

static int move_read_part(struct move_reader *self,
                          const struct yaml_value *value)
{
    const char *lacks;

    self->part->place = yaml_tree_place(value->tree, value->node);
    self->part->k1_q32 = (MOTION_FIXED_ONE_Q32 + 1) / 3;
    self->part->k2_q32 = (2 * MOTION_FIXED_ONE_Q32 + 1) / 3;
    self->part->shape = PLAN_RAMP_SCURVE;
    if (yaml_fields_read(value, &move_part_shape, self, self->part) < 0)
        return -1;
    lacks = move_lacks(value, move_speed_law[self->part->law].needs);
    if (lacks != NULL)
        return yaml_value_refuse(value, "has no '%s', which speed law %s needs",
                                 lacks, move_laws[self->part->law]);
    return 0;
}

/* ---- as fast as the limits allow ---- */

static int move_read_fastest(struct move_reader *self,
                             const struct yaml_value *value,
                             struct plan_path *path)
{
    static const char *const word[] = { "fastest" };
    unsigned index;

    if (yaml_value_choice(value, word, ARRAY_LEN(word), &index) < 0)
        return -1;
    if (path->carrier != NULL) {
        struct yaml_value law = *value;
        law.expected = "a part of a speed law, or a list of 1 .. 64 of them; "
                       "slew fit then finds how fast its axes can be";
        return yaml_value_refuse(&law,
                                 "is 'fastest', which is for a path of axes, "
                                 "and this is one of the %s",
                                 path->carrier->arm.arm.count > 0 ? "tool"
                                                                  : "head");
    }
    path->fastest = calloc(1, sizeof *path->fastest);
    if (path->fastest == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    for (uint32_t i = 0; i < path->points.axes; i++) {
        const char *name = self->move->axis[path->axis[i]].name;
        path->fastest->limit[i] =
            self->rig->axis[rig_axis_index(self->rig, name)].limit;
    }
    return 0;
}

static int move_read_cap_place(void *reader, const struct yaml_value *value,
                               void *out)
{
    return move_read_distance(reader, value, out);
}

static int move_read_cap_speed(void *reader, const struct yaml_value *value,
                               void *out)
{
    return move_read_positive(reader, value, UNITS_VELOCITY, out);
}

static const struct yaml_field move_cap_fields[] = {
    { "from", YAML_REQUIRED, "a length of the path, or a part of it in %",
      move_read_cap_place, offsetof(struct plan_fastest_cap, from) },
    { "to", YAML_REQUIRED, "a length of the path, or a part of it in %",
      move_read_cap_place, offsetof(struct plan_fastest_cap, to) },
    { "speed", YAML_REQUIRED, "a speed above zero", move_read_cap_speed,
      offsetof(struct plan_fastest_cap, speed_q32) },
};
const struct yaml_shape move_cap_shape = { "cap", move_cap_fields,
                                           ARRAY_LEN(move_cap_fields) };

/* Capacity for `count` more; they are zero. */
static int move_more_caps(const struct yaml_value *value,
                          struct plan_fastest *fastest, uint32_t count)
{
    struct plan_fastest_cap *cap;

    if (fastest == NULL)
        return yaml_value_refuse(value, "is not used without speed: fastest");
    cap = realloc(fastest->cap, (fastest->caps + count) * sizeof *cap);
    if (cap == NULL)
        return yaml_value_refuse(value, "do not fit in memory");
    memset(cap + fastest->caps, 0, count * sizeof *cap);
    fastest->cap = cap;
    return 0;
}

static int move_read_cap_list(struct move_reader *self,
                              const struct yaml_value *value,
                              struct plan_fastest *fastest, bool stops)
{
    struct yaml_value item = {
        value->tree, yaml_value_node(value)->first, stops ? "stop" : "cap",
        stops ? "a length of the path, or a part of it in %"
              : "a map with from, to and speed"
    };
    uint32_t count;

    if (yaml_value_list(value, 1, PLAN_SPEED_LAW_PARTS_MAX, &count) < 0 ||
        move_more_caps(value, fastest, count) < 0)
        return -1;
    for (uint32_t i = 0; i < count; i++) {
        struct plan_fastest_cap *cap = &fastest->cap[fastest->caps++];
        cap->place = yaml_tree_place(item.tree, item.node);
        if ((stops ? move_read_distance(self, &item, &cap->from)
                   : yaml_fields_read(&item, &move_cap_shape, self, cap)) < 0)
            return -1;
        if (stops)
            cap->to = cap->from;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

int move_read_caps(void *reader, const struct yaml_value *value, void *out)
{
    return move_read_cap_list(reader, value, ((struct plan_path *)out)->fastest,
                              false);
}

int move_read_stops(void *reader, const struct yaml_value *value, void *out)
{
    return move_read_cap_list(reader, value, ((struct plan_path *)out)->fastest,
                              true);
}

static int move_read_end_speed(struct move_reader *self,
                               const struct yaml_value *value,
                               struct plan_path *path, int end)
{
    if (path->fastest == NULL)
        return yaml_value_refuse(value, "is not used without speed: fastest");
    return move_read_positive(self, value, UNITS_VELOCITY,
                              &path->fastest->end_q32[end]);
}

int move_read_start_speed(void *reader, const struct yaml_value *value,
                          void *out)
{
    return move_read_end_speed(reader, value, out, 0);
}

int move_read_last_speed(void *reader, const struct yaml_value *value,
                         void *out)
{
    return move_read_end_speed(reader, value, out, 1);
}

/* A word, one part, or a list of them. */
int move_read_speed(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;
    struct plan_path *path = out;
    const bool one = yaml_value_node(value)->kind == YAML_TREE_MAP;
    struct yaml_value item = {
        value->tree, one ? value->node : yaml_value_node(value)->first, "part",
        "a map with law and what that law takes"
    };
    uint32_t count = 1;

    if (yaml_value_node(value)->kind == YAML_TREE_TEXT)
        return move_read_fastest(self, value, path);
    if (!one && yaml_value_list(value, 1, PLAN_SPEED_LAW_PARTS_MAX, &count) < 0)
        return -1;
    path->part = calloc(count, sizeof *path->part);
    if (path->part == NULL)
        return yaml_value_refuse(value, "do not fit in memory");
    while (path->parts < count) {
        self->part = &path->part[path->parts++];
        if (move_read_part(self, &item) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}
