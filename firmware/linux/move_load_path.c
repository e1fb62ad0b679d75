/* firmware/linux/move_load_path.c - `path` of move.yaml: points, curve and speed
 * law.  See move_load.h.
 *
 * What a law takes and needs is a table, as it is with curves. */
#include <stdlib.h>
#include <string.h>

#include "firmware/linux/move_load.h"
#include "motion/fixed.h"
#include "motion/plan/plan_path.h"

#define ARRAY_LEN(a) (sizeof(a) / sizeof(a)[0])

/* ---- words ---- */

/* In this order: indices of move_path_curve. */
const char *const move_path_curves[MOVE_PATH_CURVES] = {
    "linear", "rounded", "smoothed", "catmull-rom",
    "akima",  "c2",      "quintic",  "b-spline",
};
static const enum plan_curve move_path_curve[MOVE_PATH_CURVES] = {
    PLAN_CURVE_LINEAR,      PLAN_CURVE_ROUNDED, PLAN_CURVE_SMOOTHED,
    PLAN_CURVE_CATMULL_ROM, PLAN_CURVE_AKIMA,   PLAN_CURVE_C2,
    PLAN_CURVE_QUINTIC,     PLAN_CURVE_BSPLINE,
};

const char *const move_spacings[MOVE_SPACINGS] = {
    [MOTION_SPLINE_UNIFORM] = "uniform",
    [MOTION_SPLINE_CENTRIPETAL] = "centripetal",
    [MOTION_SPLINE_CHORDAL] = "chordal",
};

const char *const move_laws[MOVE_LAWS] = {
#define MOVE_LAW_SPELLING(name, spelling, text) [name] = spelling,
    PLAN_LAW_LIST(MOVE_LAW_SPELLING)
#undef MOVE_LAW_SPELLING
};

const char *const move_ramps[MOVE_RAMPS] = {
#define MOVE_RAMP_SPELLING(name, spelling, kind) [name] = spelling,
    PLAN_RAMP_LIST(MOVE_RAMP_SPELLING)
#undef MOVE_RAMP_SPELLING
};

/* ---- values ---- */

static struct yaml_value move_item(const struct yaml_value *list, uint32_t node,
                                   const char *name, const char *expected)
{
    return (struct yaml_value){ list->tree, node, name, expected };
}

static int move_read_bool(const struct yaml_value *value, bool *out)
{
    static const char *const words[] = { "false", "true" };
    unsigned index;

    if (yaml_value_choice(value, words, 2, &index) < 0)
        return -1;
    *out = index == 1;
    return 0;
}

int move_read_distance(const struct move_reader *reader,
                       const struct yaml_value *value,
                       struct plan_distance *distance)
{
    const char *text = yaml_value_text(value);
    char quote[YAML_QUOTE_MAX];

    if (text == NULL)
        return -1;
    distance->is_ratio = strchr(text, '%') != NULL;
    if (yaml_units_read(value,
                        distance->is_ratio ? UNITS_RATIO : UNITS_POSITION,
                        &reader->units, &distance->q32) < 0)
        return -1;
    if (distance->q32 < 0 ||
        (distance->is_ratio && distance->q32 > MOTION_FIXED_ONE_Q32))
        return yaml_value_refuse(value, "%s is not on the path",
                                 yaml_value_quote(quote, value));
    return 0;
}

int move_read_positive(const struct move_reader *reader,
                       const struct yaml_value *value,
                       enum units_quantity quantity, int64_t *out)
{
    char quote[YAML_QUOTE_MAX];

    if (yaml_units_read(value, quantity, &reader->units, out) < 0)
        return -1;
    if (*out <= 0)
        return yaml_value_refuse(value, "%s is not above zero",
                                 yaml_value_quote(quote, value));
    return 0;
}

/* ---- points ---- */

int move_read_vector(const struct move_reader *reader,
                     const struct yaml_value *value, uint32_t axes,
                     int64_t q32[PLAN_SPACE_AXES])
{
    struct yaml_value item = *value;
    uint32_t count;

    if (yaml_value_list(value, axes, axes, &count) < 0)
        return -1;
    item.node = yaml_value_node(value)->first;
    item.expected = "a position";
    for (uint32_t i = 0; i < axes; i++) {
        if (yaml_units_read(&item, UNITS_POSITION, &reader->units, &q32[i]) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

static bool move_is_same(const struct plan_point *a, const struct plan_point *b)
{
    return memcmp(a->q32, b->q32, sizeof a->q32) == 0;
}

static int move_check_point(const struct yaml_value *value,
                            const struct plan_points *points)
{
    const struct plan_point *now = &points->point[points->count];

    if (points->count > 0 && move_is_same(now - 1, now))
        return yaml_value_refuse(value,
                                 "is the same as the one before it (line %lu)",
                                 (unsigned long)now[-1].place.line);
    return 0;
}

int move_read_points(struct move_reader *reader, const struct yaml_value *value,
                     struct plan_points *points)
{
    const uint32_t least = points->closed ? 3 : 2;
    struct yaml_value item =
        move_item(value, yaml_value_node(value)->first, "point",
                  points->axes == 2 ? "[x, y], not the point before it"
                                    : "[x, y, z], not the point before it");
    uint32_t count;

    if (yaml_value_list(value, least, PLAN_SPACE_POINTS_MAX, &count) < 0)
        return -1;
    points->point = calloc(count, sizeof *points->point);
    if (points->point == NULL)
        return yaml_value_refuse(value, "are too many for the memory");
    for (; points->count < count; points->count++) {
        struct plan_point *point = &points->point[points->count];
        point->place = yaml_tree_place(value->tree, item.node);
        if (move_read_vector(reader, &item, points->axes, point->q32) < 0 ||
            move_check_point(&item, points) < 0)
            return -1;
        if (points->closed && points->count == count - 1 &&
            move_is_same(point, points->point))
            return yaml_value_refuse(&item, "is the first one again, which "
                                            "closed goes back to by itself");
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

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
} move_law[MOVE_LAWS] = {
    [PLAN_LAW_CUBIC] = { MOVE_TIME, MOVE_LENGTH, PLAN_EXTENT_REST },
    [PLAN_LAW_QUINTIC] = { MOVE_TIME, MOVE_LENGTH, PLAN_EXTENT_REST },
    [PLAN_LAW_SINE] = { MOVE_TIME, MOVE_LENGTH | MOVE_EASE, PLAN_EXTENT_REST },
    [PLAN_LAW_PARABOLIC] = { MOVE_TIME, MOVE_LENGTH | MOVE_EASE,
                             PLAN_EXTENT_REST },
    [PLAN_LAW_SCURVE] = { MOVE_TIME, MOVE_LENGTH | MOVE_EASE,
                          PLAN_EXTENT_REST },
    [PLAN_LAW_RAMP] = { MOVE_TIME | MOVE_TO, MOVE_SHAPE | MOVE_FROM,
                        PLAN_EXTENT_TIMED },
    [PLAN_LAW_CONSTANT] = { 0, MOVE_TIME | MOVE_LENGTH | MOVE_FROM,
                            PLAN_EXTENT_REST },
    [PLAN_LAW_PAUSE] = { MOVE_TIME, 0, PLAN_EXTENT_TIMED },
    [PLAN_LAW_ACCELERATION] = { MOVE_POINTS, MOVE_FROM | MOVE_LENGTH,
                                PLAN_EXTENT_TIMED },
    [PLAN_LAW_VELOCITY] = { MOVE_POINTS, MOVE_LENGTH, PLAN_EXTENT_TIMED },
    [PLAN_LAW_DRAWN] = { MOVE_DISTANCE, MOVE_LENGTH, PLAN_EXTENT_REST },
};

static int move_check_law(const struct move_reader *self,
                          const struct yaml_value *value, unsigned what)
{
    const enum plan_law law = self->part->law;

    if ((move_law[law].needs | move_law[law].takes) & what)
        return 0;
    return yaml_value_refuse(value, "is not used by law %s", move_laws[law]);
}

static int move_read_law(void *reader, const struct yaml_value *value,
                         void *out)
{
    struct plan_part *part = out;
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, move_laws, MOVE_LAWS, &index) < 0)
        return -1;
    part->law = (enum plan_law)index;
    part->extent = move_law[index].extent;
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
    if (part->law == PLAN_LAW_CONSTANT)
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
    if (part->law == PLAN_LAW_CONSTANT && part->dur_ns_q12 > 0)
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
    const bool is_acc = self->part->law == PLAN_LAW_ACCELERATION;
    struct motion_speed_point *point = &self->part->point[i];
    struct yaml_value item = *value;
    uint32_t count;
    int64_t number = 0;

    if (yaml_value_list(value, 2, 2, &count) < 0)
        return -1;
    item.node = yaml_value_node(value)->first;
    if (yaml_units_read(&item, UNITS_TIME, &self->units, &point->t_ns_q12) < 0)
        return -1;
    if (i == 0 ? point->t_ns_q12 != 0
               : point->t_ns_q12 < point[-1].t_ns_q12 ||
                     (!is_acc && point->t_ns_q12 == point[-1].t_ns_q12))
        return yaml_value_refuse(&item, i == 0 ? "does not begin at 0 s"
                                               : "is not later than the point "
                                                 "before it");
    item.node = yaml_value_node(&item)->next;
    if (yaml_units_read(&item, is_acc ? UNITS_ACCELERATION : UNITS_VELOCITY,
                        &self->units, &number) < 0)
        return -1;
    point->value = motion_real_from_q(number, is_acc ? 16 : 32);
    return 0;
}

static int move_read_law_points(void *reader, const struct yaml_value *value,
                                void *out)
{
    struct plan_part *part = out;
    struct yaml_value item = move_item(
        value, 0, "point", "[time from the start of the part, value]");
    uint32_t count;

    if (move_check_law(reader, value, MOVE_POINTS) < 0 ||
        yaml_value_list(value, 2, PLAN_LAW_POINTS_MAX, &count) < 0)
        return -1;
    part->point = calloc(count, sizeof *part->point);
    if (part->point == NULL)
        return yaml_value_refuse(value, "are too many for the memory");
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
        return yaml_value_refuse(value, "is too much for the memory");
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
    { "law", YAML_REQUIRED, "a law of speed", move_read_law, 0 },
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
    lacks = move_lacks(value, move_law[self->part->law].needs);
    if (lacks != NULL)
        return yaml_value_refuse(value, "has no '%s', which law %s needs",
                                 lacks, move_laws[self->part->law]);
    return 0;
}

/* One part, or a list of them. */
static int move_read_speed(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct move_reader *self = reader;
    struct plan_path *path = out;
    const bool one = yaml_value_node(value)->kind == YAML_TREE_MAP;
    struct yaml_value item =
        move_item(value, one ? value->node : yaml_value_node(value)->first,
                  "part", "a map with law and what that law takes");
    uint32_t count = 1;

    if (!one && yaml_value_list(value, 1, PLAN_LAW_PARTS_MAX, &count) < 0)
        return -1;
    path->part = calloc(count, sizeof *path->part);
    if (path->part == NULL)
        return yaml_value_refuse(value, "are too many for the memory");
    while (path->parts < count) {
        self->part = &path->part[path->parts++];
        if (move_read_part(self, &item) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

/* ---- the path ---- */

static int move_read_path_axes(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct move_reader *self = reader;
    struct plan_path *path = out;
    struct yaml_value item = *value;
    uint32_t count;

    if (yaml_value_list(value, 2, PLAN_SPACE_AXES, &count) < 0)
        return -1;
    item.node = yaml_value_node(value)->first;
    for (uint32_t i = 0; i < count; i++) {
        const int found =
            move_drive_axis(self, &item, PLAN_BY_PATH, &path->axis[i]);
        if (found < 0)
            return -1;
        if (i > 0 && self->rig->axis[found].unit != self->units.unit)
            return yaml_value_refuse(&item,
                                     "has the axis '%s' in %s beside one in %s",
                                     self->rig->axis[found].name,
                                     rig_unit_text(self->rig->axis[found].unit),
                                     rig_unit_text(self->units.unit));
        self->units.unit = self->rig->axis[found].unit;
        item.node = yaml_value_node(&item)->next;
    }
    path->points.axes = count;
    return 0;
}

int move_read_path_curve(void *reader, const struct yaml_value *value,
                         void *out)
{
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, move_path_curves, MOVE_PATH_CURVES, &index) <
        0)
        return -1;
    *(enum plan_curve *)out = move_path_curve[index];
    return 0;
}

int move_read_spacing(void *reader, const struct yaml_value *value, void *out)
{
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, move_spacings, MOVE_SPACINGS, &index) < 0)
        return -1;
    *(enum motion_spline_spacing *)out = (enum motion_spline_spacing)index;
    return 0;
}

int move_read_closed(void *reader, const struct yaml_value *value, void *out)
{
    struct plan_points *points = out;

    (void)reader;
    if (move_read_bool(value, &points->closed) < 0)
        return -1;
    if (points->closed && !plan_space_rules(points->curve).closed)
        return yaml_value_refuse(value, "is not possible with curve %s",
                                 plan_curve_rules(points->curve)->name);
    return 0;
}

int move_read_corner(void *reader, const struct yaml_value *value, void *out)
{
    struct plan_points *points = out;

    if (!plan_space_rules(points->curve).corner)
        return yaml_value_refuse(value, "is not used by curve %s",
                                 plan_curve_rules(points->curve)->name);
    return move_read_positive(reader, value, UNITS_POSITION,
                              &points->corner_q32);
}

int move_read_path_points(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct plan_points *points = out;

    if (plan_space_rules(points->curve).corner && points->corner_q32 == 0)
        return yaml_value_refuse(value,
                                 "come without a corner, which curve %s "
                                 "needs",
                                 plan_curve_rules(points->curve)->name);
    points->place = yaml_tree_place(value->tree, value->node);
    return move_read_points(reader, value, points);
}

static int move_read_tolerance(void *reader, const struct yaml_value *value,
                               void *out)
{
    return move_read_positive(reader, value, UNITS_POSITION, out);
}

static const struct yaml_field move_path_fields[] = {
    { "axes", YAML_REQUIRED, "a list of 2 or 3 axes that have the same unit",
      move_read_path_axes, 0 },
    { "curve", YAML_OPTIONAL, "a curve through space", move_read_path_curve,
      offsetof(struct plan_path, points.curve) },
    { "spacing", YAML_OPTIONAL, "uniform, centripetal or chordal",
      move_read_spacing, offsetof(struct plan_path, points.spacing) },
    { "closed", YAML_OPTIONAL,
      "true or false, true with c2, quintic, catmull-rom or akima",
      move_read_closed, offsetof(struct plan_path, points) },
    { "corner", YAML_OPTIONAL,
      "a length above zero, with curve rounded or smoothed", move_read_corner,
      offsetof(struct plan_path, points) },
    { "points", YAML_REQUIRED,
      "a list of 2 .. 10000 points (closed: 3 or more) such as [0 mm, 40 mm]",
      move_read_path_points, offsetof(struct plan_path, points) },
    { "tolerance", YAML_OPTIONAL, "a distance above zero", move_read_tolerance,
      offsetof(struct plan_path, tolerance_q32) },
    { "speed", YAML_REQUIRED, "a law, or a list of 1 .. 64 of them",
      move_read_speed, 0 },
};
const struct yaml_shape move_path_shape = { "path", move_path_fields,
                                            ARRAY_LEN(move_path_fields) };

/* What nobody sees and what costs few segments. */
static const int64_t move_tolerance_q32[] = {
    [RIG_UNIT_MM] = MOTION_FIXED_ONE_Q32 / 1000000,
    [RIG_UNIT_DEG] = MOTION_FIXED_ONE_Q32 / 1000000,
    [RIG_UNIT_REV] = MOTION_FIXED_ONE_Q32 / 100000000,
    [RIG_UNIT_COUNT] = MOTION_FIXED_ONE_Q32 / 1000,
};

int move_read_path(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;
    struct plan_path *path = calloc(1, sizeof *path);

    (void)out;
    if (path == NULL)
        return yaml_value_refuse(value, "is too much for the memory");
    self->move->path = path;
    path->points.curve = PLAN_CURVE_C2;
    path->points.spacing = MOTION_SPLINE_CENTRIPETAL;
    path->place = yaml_tree_place(value->tree, value->node);
    if (yaml_fields_read(value, &move_path_shape, self, path) < 0)
        return -1;
    if (path->tolerance_q32 == 0)
        path->tolerance_q32 = move_tolerance_q32[self->units.unit];
    return 0;
}
