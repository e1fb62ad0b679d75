/* firmware/linux/xml/arcm.c - see arcm.h. */
#include "firmware/linux/xml/arcm.h"

#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/quote.h"
#include "firmware/linux/xml/xml.h"
#include "motion/core/fixed.h"

#define ARCM_SCENE 0 /* depths of elements */
#define ARCM_AXIS  1
#define ARCM_POINT 2

struct arcm_point {
    char x[XML_NUMBER_MAX], y[XML_NUMBER_MAX];
    struct plan_place place;
};

struct arcm_points {
    struct arcm_point *point;
    uint32_t count;
};

/* An axis as the file has it. */
struct arcm_axis {
    struct plan_place place;
    struct arcm_points points, controls;
};

struct arcm {
    struct xml_reader xml;
    const struct import_settings *settings;
    struct imported *out;
    struct import_text text; /* for sentences only */
    struct arcm_axis axis[IMPORT_COLUMNS_MAX];
    unsigned axes;
    bool is_scene, is_axis;
    int64_t first_ns_q12; /* the earliest point of all axes */
    struct xml_unread elements, attributes, types, bases, integrals;
    uint32_t longer, reversed;
};

/* ---- elements ------------------------------------------------------------ */

/* Of the scene and of the motors; they say nothing of the motion. */
static const char *const arcm_silent[] = { "endframe",
                                           "cameraOperator",
                                           "name",
                                           "units",
                                           "preset",
                                           "pulseRate",
                                           "stepsPerUnit",
                                           "connectionType",
                                           "connectionChannel",
                                           "runMaxVelocity",
                                           "runMaxAcceleration",
                                           "graphSolo",
                                           "graphColor",
                                           "viewPosition",
                                           NULL };

static void arcm_leave_attributes(struct arcm *self, const char **attribute)
{
    for (; *attribute != NULL; attribute += 2) {
        size_t i = 0;
        if (strncmp(*attribute, "xmlns", 5) == 0)
            continue;
        if (strcmp(*attribute, "base") == 0) {
            if (strspn(attribute[1], "+-0.") < strlen(attribute[1]))
                xml_leave(&self->xml, &self->bases, attribute[1]);
            continue;
        }
        if (strcmp(*attribute, "integral") == 0) {
            if (strcmp(attribute[1], "false") != 0)
                xml_leave(&self->xml, &self->integrals, attribute[1]);
            continue;
        }
        while (arcm_silent[i] != NULL &&
               strcmp(arcm_silent[i], *attribute) != 0)
            i++;
        if (arcm_silent[i] == NULL)
            xml_leave(&self->xml, &self->attributes, *attribute);
    }
}

/* "pan (deg)", as import_name_columns reads it. */
static void arcm_start_axis(struct arcm *self, const char **attribute)
{
    const char *name = xml_attribute(attribute, "name"),
               *units = xml_attribute(attribute, "units");
    const struct plan_place place = xml_place(&self->xml);
    char column[IMPORT_NAME_MAX];

    if (name == NULL || name[0] == 0) {
        xml_refuse(&self->xml, "the axis has no name");
        return;
    }
    const bool has_unit = units != NULL && units[0] != 0;
    const int length =
        snprintf(column, sizeof column, has_unit ? "%s (%s)" : "%s", name,
                 has_unit ? units : "");
    if (length >= (int)sizeof column) {
        xml_refuse(&self->xml, "the axis has a name of more than %d bytes",
                   IMPORT_NAME_MAX - 1);
        return;
    }
    if (import_add_column(&self->text, place, self->out, column, column) < 0) {
        self->xml.is_refused = true;
        return;
    }
    self->axis[self->axes++] = (struct arcm_axis){ .place = place };
    self->is_axis = true;
}

/* Room grows at powers of two. */
static void arcm_add_point(struct arcm *self, struct arcm_points *points,
                           const char *name, const char **attribute)
{
    const char *x = xml_attribute(attribute, "x"),
               *y = xml_attribute(attribute, "y");
    const uint32_t count = points->count;

    if (x == NULL || y == NULL) {
        xml_refuse(&self->xml, "%s has no %s, expected x, a frame, and y", name,
                   x == NULL ? "x" : "y");
        return;
    }
    if (count == 2 * PLAN_KEYS_MAX) {
        xml_refuse(&self->xml, "there are more than %d keys", PLAN_KEYS_MAX);
        return;
    }
    if ((count & (count - 1)) == 0)
        points->point =
            memory_resize(points->point, count == 0 ? 1 : 2 * (size_t)count,
                          sizeof *points->point);
    struct arcm_point *point = &points->point[points->count++];
    point->place = xml_place(&self->xml);
    if (xml_numbers(&self->xml, x, 1, &point->x, NULL))
        (void)xml_numbers(&self->xml, y, 1, &point->y, NULL);
    for (; *attribute != NULL; attribute += 2)
        if (strcmp(*attribute, "type") == 0)
            xml_leave(&self->xml, &self->types, attribute[1]);
        else if (strcmp(*attribute, "x") != 0 && strcmp(*attribute, "y") != 0)
            xml_leave(&self->xml, &self->attributes, *attribute);
}

static void arcm_start(struct xml_reader *xml, const char *name,
                       const char **attribute)
{
    struct arcm *self = (struct arcm *)xml;
    struct arcm_axis *axis = self->is_axis ? &self->axis[self->axes - 1] : NULL;

    if (xml->depth == ARCM_SCENE && strcmp(name, "scene") != 0)
        xml_refuse(xml,
                   "is no arc move, expected <scen:scene> with <scen:axis> "
                   "in it");
    else if (xml->depth == ARCM_SCENE)
        arcm_leave_attributes(self, attribute);
    else if (xml->depth == ARCM_AXIS && strcmp(name, "axis") == 0) {
        arcm_leave_attributes(self, attribute);
        arcm_start_axis(self, attribute);
    } else if (xml->depth == ARCM_POINT && axis != NULL &&
               strcmp(name, "points") == 0)
        arcm_add_point(self, &axis->points, name, attribute);
    else if (xml->depth == ARCM_POINT && axis != NULL &&
             strcmp(name, "controlPoints") == 0)
        arcm_add_point(self, &axis->controls, name, attribute);
    else
        xml_leave(xml, &self->elements, name);
}

static void arcm_end(struct xml_reader *xml, const char *name)
{
    struct arcm *self = (struct arcm *)xml;

    (void)name;
    if (xml->depth == ARCM_AXIS)
        self->is_axis = false;
}

/* ---- curves -------------------------------------------------------------- */

/* From the earliest point. */
static int arcm_time(struct arcm *self, const struct arcm_point *point,
                     int64_t *t_ns_q12)
{
    const struct units_context context = { .fps = self->out->fps };
    struct import_word word = { .place = point->place };

    memcpy(word.text, point->x, sizeof point->x);
    if (import_text_number(&self->text, &word, "f", "", UNITS_TIME, &context,
                           t_ns_q12) < 0)
        return -1;
    return motion_fixed_sub(*t_ns_q12, self->first_ns_q12, t_ns_q12) ==
                   MOTION_OK
               ? 0
               : yaml_report_at(&self->text.report, point->place,
                                "the frame is out of range");
}

static int arcm_position(struct arcm *self, const struct import_column *column,
                         const struct arcm_point *point, int64_t *pos_q32)
{
    const struct units_context context = {
        .unit = self->settings->rig->axis[column->axis].unit
    };
    struct import_word word = { .place = point->place };
    char after[IMPORT_UNIT_MAX + 1];

    memcpy(word.text, point->y, sizeof point->y);
    snprintf(after, sizeof after, "%s%s", column->unit[0] != 0 ? " " : "",
             column->unit);
    return import_text_number(&self->text, &word, "", after, UNITS_POSITION,
                              &context, pos_q32);
}

static int arcm_keys(struct arcm *self, const struct import_column *column,
                     const struct arcm_axis *from, struct plan_axis *axis)
{
    for (uint32_t i = 0; i < from->points.count; i++) {
        const struct arcm_point *point = &from->points.point[i];
        struct plan_key *key = import_add_key(&self->text, point->place, axis);
        if (key == NULL || arcm_time(self, point, &key->key.t_ns_q12) < 0 ||
            arcm_position(self, column, point, &key->key.pos_q32) < 0)
            return -1;
        if (i > 0 && key->key.t_ns_q12 <= key[-1].key.t_ns_q12)
            return yaml_report_at(&self->text.report, point->place,
                                  "the point is not later than the one before "
                                  "it");
    }
    return 0;
}

/* Of key i, from its control point; with none a third of the span beside it. */
static int arcm_handle(struct arcm *self, const struct import_column *column,
                       const struct arcm_point *control,
                       const struct plan_key *key, int64_t span,
                       struct plan_handle *handle)
{
    const bool is_left = span < 0;
    int64_t t_ns_q12, pos_q32;

    *handle = (struct plan_handle){ .kind = MOTION_FCURVE_FREE };
    if (arcm_time(self, control, &t_ns_q12) < 0 ||
        arcm_position(self, column, control, &pos_q32) < 0)
        return -1;
    if (motion_fixed_sub(t_ns_q12, key->key.t_ns_q12, &handle->dt_ns_q12) < 0 ||
        motion_fixed_sub(pos_q32, key->key.pos_q32, &handle->dp_q32) < 0)
        return yaml_report_at(&self->text.report, control->place,
                              "the control point is out of range");
    if (is_left ? handle->dt_ns_q12 > 0 : handle->dt_ns_q12 < 0) {
        handle->dt_ns_q12 = 0;
        self->reversed++;
    }
    self->longer +=
        motion_fixed_abs(handle->dt_ns_q12) > motion_fixed_abs(span);
    return 0;
}

/* Control points that both lie in their points: the straight line that they make,
 * as handles of a third of it. */
static void arcm_straighten(const struct plan_key *key,
                            struct plan_handle *right, struct plan_handle *left)
{
    const int64_t dt = key[1].key.t_ns_q12 - key[0].key.t_ns_q12,
                  dp = key[1].key.pos_q32 - key[0].key.pos_q32;

    if (right->dt_ns_q12 != 0 || right->dp_q32 != 0 || left->dt_ns_q12 != 0 ||
        left->dp_q32 != 0)
        return;
    right->dt_ns_q12 = dt / 3;
    right->dp_q32 = dp / 3;
    left->dt_ns_q12 = -(dt / 3);
    left->dp_q32 = -(dp / 3);
}

/* Of the spans in order: that behind its first point, that before its second. */
static int arcm_handles(struct arcm *self, const struct import_column *column,
                        const struct arcm_axis *from, struct plan_axis *axis)
{
    const struct arcm_point *control = from->controls.point;
    struct plan_bezier_key *bezier = axis->bezier.key;

    for (uint32_t i = 0; i < axis->key_count; i++) {
        bezier[i].interpolation = MOTION_FCURVE_BEZIER;
        bezier[i].left.kind = bezier[i].right.kind = MOTION_FCURVE_FREE;
    }
    for (uint32_t i = 0; i + 1 < axis->key_count; i++) {
        const struct plan_key *key = &axis->key[i];
        int64_t span, rise;
        if (motion_fixed_sub(key[1].key.t_ns_q12, key[0].key.t_ns_q12, &span) <
                0 ||
            motion_fixed_sub(key[1].key.pos_q32, key[0].key.pos_q32, &rise) < 0)
            return yaml_report_at(&self->text.report, key[1].place,
                                  "the point is out of range");
        if (arcm_handle(self, column, &control[2 * (size_t)i], key, span,
                        &bezier[i].right) < 0 ||
            arcm_handle(self, column, &control[2 * (size_t)i + 1], key + 1,
                        -span, &bezier[i + 1].left) < 0)
            return -1;
        arcm_straighten(key, &bezier[i].right, &bezier[i + 1].left);
    }
    return 0;
}

static int arcm_curve(struct arcm *self, unsigned i)
{
    const struct import_column *column = &self->out->column[i];
    const struct arcm_axis *from = &self->axis[i];
    const uint32_t points = from->points.count,
                   expected = points > 0 ? 2 * (points - 1) : 0;

    if (column->axis < 0)
        return 0;
    if (points == 0)
        return yaml_report_at(&self->text.report, from->place,
                              "the axis has no points");
    if (from->controls.count != expected)
        return yaml_report_at(
            &self->text.report, from->place,
            "the axis has %u %s and %u control %s, expected %u: two between "
            "points",
            points, number_word(points, "point", "points"),
            from->controls.count,
            number_word(from->controls.count, "point", "points"), expected);
    struct plan_axis *axis =
        import_add_axis(&self->text, self->settings, self->out, column);
    if (axis == NULL || arcm_keys(self, column, from, axis) < 0)
        return -1;
    axis->curve = PLAN_CURVE_BEZIER;
    axis->bezier.key = memory_new(axis->key_count, sizeof *axis->bezier.key);
    return arcm_handles(self, column, from, axis);
}

/* ---- the file ------------------------------------------------------------ */

/* Frames of an arc move count from wherever its first point is. */
static int arcm_first(struct arcm *self)
{
    int64_t first_ns_q12 = INT64_MAX;

    for (unsigned i = 0; i < self->axes; i++)
        for (uint32_t k = 0; k < self->axis[i].points.count; k++) {
            const struct arcm_point *point = &self->axis[i].points.point[k];
            int64_t t_ns_q12;
            if (arcm_time(self, point, &t_ns_q12) < 0)
                return -1;
            if (t_ns_q12 >= first_ns_q12)
                continue;
            first_ns_q12 = t_ns_q12;
            snprintf(self->out->first, sizeof self->out->first, "%.40s",
                     point->x);
        }
    self->first_ns_q12 = first_ns_q12 == INT64_MAX ? 0 : first_ns_q12;
    return 0;
}

static void arcm_note(const struct arcm *self)
{
    const struct {
        const struct xml_unread *unread;
        const char *one, *many;
    } lost[] = {
        { &self->bases, "axis has a base", "axes have a base" },
        { &self->integrals, "axis is an integral", "axes are integrals" },
        { &self->types, "point has a type", "points have a type" },
        { &self->elements, "unknown element", "unknown elements" },
        { &self->attributes, "unknown attribute", "unknown attributes" },
    };
    char *note = self->out->note, quote[QUOTE_MAX];
    size_t used = 0;

    if (self->reversed + self->longer > 0)
        used += (size_t)snprintf(
            note, IMPORT_NOTE_MAX, "%u %s beyond the points beside (shortened)",
            self->reversed + self->longer,
            number_word(self->reversed + self->longer, "control point",
                        "control points"));
    for (size_t i = 0; i < sizeof lost / sizeof *lost; i++) {
        const struct xml_unread *unread = lost[i].unread;
        if (unread->count > 0)
            used += (size_t)snprintf(
                note + used, IMPORT_NOTE_MAX - used,
                "%s%u %s, the first %s in line %u", used > 0 ? "; " : "",
                unread->count,
                number_word(unread->count, lost[i].one, lost[i].many),
                quote_text(quote, unread->word, strlen(unread->word)),
                unread->line);
    }
}

static int arcm_take(struct arcm *self)
{
    if (self->axes == 0)
        return yaml_report_at(&self->text.report, (struct plan_place){ 1, 1 },
                              "the scene has no axis");
    if (import_name_columns(&self->text, self->settings, self->out) < 0 ||
        arcm_first(self) < 0)
        return -1;
    for (unsigned i = 0; i < self->axes; i++)
        if (arcm_curve(self, i) < 0)
            return -1;
    arcm_note(self);
    return 0;
}

static int arcm_read(const struct files *files, const char *path,
                     const struct import_settings *settings,
                     struct imported *imported, char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct arcm *self = memory_new(1, sizeof *self);

    *self = (struct arcm){
        .xml = { .start = arcm_start, .end = arcm_end, .report = &report },
        .settings = settings,
        .out = imported,
        .text.report = report
    };
    *imported =
        (struct imported){ .fps = settings->fps, .column_word = "curve" };
    int err = settings->fps.den == 0
                  ? yaml_report_at(&report, (struct plan_place){ 1, 1 },
                                   "the file gives no frame rate, expected "
                                   "--fps")
                  : xml_read(files, path, &self->xml);
    if (err == 0)
        err = arcm_take(self);
    for (unsigned i = 0; i < self->axes; i++) {
        memory_free(self->axis[i].points.point);
        memory_free(self->axis[i].controls.point);
    }
    memory_free(self);
    if (err < 0)
        move_free(&imported->move);
    return err;
}

const struct import_format arcm_format = {
    .name = "arcm",
    .summary = "Dragonframe arc move: points and control points",
    .named = true,
    .read = arcm_read,
};
