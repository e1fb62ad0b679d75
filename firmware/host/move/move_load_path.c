/* firmware/host/move/move_load_path.c - `path` of move.yaml, and curves in
 * space. See move_load.h. */
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/move/move_load.h"
#include "motion/core/fixed.h"
#include "motion/plan/path/plan_path.h"

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

/* ---- values ---- */

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
    return yaml_units_read_list(value, UNITS_POSITION, &reader->units,
                                "a position", axes, q32);
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

/* A list of points, each of `axes` positions, neighbours not the same, into
 * points->point and count; on the heap, also after a refusal. */
static int move_read_points(struct move_reader *reader,
                            const struct yaml_value *value,
                            struct plan_points *points)
{
    const uint32_t least = points->closed ? 3 : 2;
    struct yaml_value item = { value->tree, yaml_value_node(value)->first,
                               "point",
                               points->axes == 2
                                   ? "[x, y], not the point before it"
                                   : "[x, y, z], not the point before it" };
    uint32_t count;

    if (yaml_value_list(value, least, PLAN_SPACE_POINTS_MAX, &count) < 0)
        return -1;
    points->point = calloc(count, sizeof *points->point);
    if (points->point == NULL)
        return yaml_value_refuse(value, "do not fit in memory");
    for (; points->count < count; points->count++) {
        struct plan_point *point = &points->point[points->count];
        point->place = yaml_tree_place(value->tree, item.node);
        if (move_read_vector(reader, &item, points->axes, point->q32) < 0 ||
            move_check_point(&item, points) < 0)
            return -1;
        if (points->closed && points->count == count - 1 &&
            move_is_same(point, points->point))
            return yaml_value_refuse(&item, "repeats the first one, to which "
                                            "a closed path returns by itself");
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

/* ---- the path ---- */

/* The head of the rig, or the tool of its arm, goes along it. */
static int move_read_path_head(struct move_reader *self,
                               const struct yaml_value *value,
                               struct plan_path *path)
{
    static const char *const word[] = { "head", "tool" };
    unsigned index;

    if (yaml_value_choice(value, word, ARRAY_LEN(word), &index) < 0)
        return -1;
    if (self->rig->kinematics == NULL)
        return yaml_value_refuse(
            value, "is '%s', which a rig without kinematics lacks",
            word[index]);
    if ((self->rig->kinematics->arm.arm.count > 0) != (index == 1))
        return yaml_value_refuse(value, "is '%s', and the rig has %s",
                                 word[index],
                                 index == 1 ? "no arm" : "an arm with a tool");
    path->carrier = malloc(sizeof *path->carrier);
    if (path->carrier == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    *path->carrier = *self->rig->kinematics;
    path->points.axes = PLAN_SPACE_AXES;
    self->units.unit = UNITS_AXIS_MM;
    if (index == 1)
        return move_take_arm(self, value, path);
    uint32_t driven = 0;
    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++) {
        struct plan_rig_axis *axis = &path->carrier->carrier[i];
        if (!axis->is_given)
            continue;
        if (move_drive_rig_axis(self, value, axis->axis, PLAN_BY_PATH,
                                &axis->axis) < 0)
            return -1;
        driven++;
    }
    return driven > 0 ? 0
                      : yaml_value_refuse(value, "is 'head', and nothing in "
                                                 "the rig's kinematics carries "
                                                 "it");
}

static int move_read_path_axes(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct move_reader *self = reader;
    struct plan_path *path = out;
    struct yaml_value item = *value;
    uint32_t count;

    if (yaml_value_node(value)->kind == YAML_TREE_TEXT)
        return move_read_path_head(self, value, path);
    if (yaml_value_list(value, 2, PLAN_SPACE_AXES, &count) < 0)
        return -1;
    item.node = yaml_value_node(value)->first;
    for (uint32_t i = 0; i < count; i++) {
        const int found =
            move_drive_axis(self, &item, PLAN_BY_PATH, &path->axis[i]);
        if (found < 0)
            return -1;
        if (i > 0 && self->rig->axis[found].unit != self->units.unit)
            return yaml_value_refuse(
                &item, "has the axis '%s' in %s beside one in %s",
                self->rig->axis[found].name,
                units_axis_text(self->rig->axis[found].unit),
                units_axis_text(self->units.unit));
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
    if (yaml_value_bool(value, &points->closed) < 0)
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
    { "axes", YAML_REQUIRED,
      "a list of 2 or 3 axes that have the same unit, head or tool",
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
    { "tool", YAML_OPTIONAL,
      "a map with look and roll, or forward and up, and near, with axes tool",
      move_read_tool, 0 },
    { "tolerance", YAML_OPTIONAL, "a distance above zero", move_read_tolerance,
      offsetof(struct plan_path, tolerance_q32) },
    { "speed", YAML_REQUIRED,
      "fastest, a part of a speed law, or a list of 1 .. 64 of them",
      move_read_speed, 0 },
    { "start", YAML_OPTIONAL,
      "a speed above zero at the start, with speed fastest",
      move_read_start_speed, 0 },
    { "end", YAML_OPTIONAL, "a speed above zero at the end, with speed fastest",
      move_read_last_speed, 0 },
    { "caps", YAML_OPTIONAL,
      "a list of 1 .. 64 maps with from, to and speed, with speed fastest",
      move_read_caps, 0 },
    { "stops", YAML_OPTIONAL,
      "a list of 1 .. 64 places on the path, with speed fastest",
      move_read_stops, 0 },
};
const struct yaml_shape move_path_shape = { "path", move_path_fields,
                                            ARRAY_LEN(move_path_fields) };

/* What nobody sees and what costs few segments. */
static const int64_t move_tolerance_q32[] = {
    [UNITS_AXIS_MM] = MOTION_FIXED_ONE_Q32 / 1000000,
    [UNITS_AXIS_DEG] = MOTION_FIXED_ONE_Q32 / 1000000,
    [UNITS_AXIS_REV] = MOTION_FIXED_ONE_Q32 / 100000000,
    [UNITS_AXIS_RAD] = MOTION_FIXED_ONE_Q32 / 60000000,
    [UNITS_AXIS_COUNT] = MOTION_FIXED_ONE_Q32 / 1000,
    [UNITS_AXIS_KCOUNT] = MOTION_FIXED_ONE_Q32 / 1000000,
    [UNITS_AXIS_MCOUNT] = MOTION_FIXED_ONE_Q32 / 100000000,
};

int64_t move_default_tolerance_q32(enum units_axis unit)
{
    return move_tolerance_q32[unit];
}

int move_read_path(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;
    struct plan_path *path = calloc(1, sizeof *path);

    (void)out;
    if (path == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    self->move->path = path;
    path->points.curve = PLAN_CURVE_C2;
    path->points.spacing = MOTION_SPLINE_CENTRIPETAL;
    path->place = yaml_tree_place(value->tree, value->node);
    if (yaml_fields_read(value, &move_path_shape, self, path) < 0)
        return -1;
    if (move_check_tool(value, path) < 0)
        return -1;
    if (path->tolerance_q32 == 0)
        path->tolerance_q32 = move_tolerance_q32[self->units.unit];
    return 0;
}
