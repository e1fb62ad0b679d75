/* firmware/host/exchange/import_blender.c - curves of a Blender action, with
 * handles.
 *
 * Reads what examples/blender/slew_export.py writes, by the tables of
 * yaml_fields.h, as JSON is YAML: every error has its line and column.  Times
 * are frames, values are in the unit that a curve names. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/exchange/import.h"
#include "firmware/host/yaml/yaml_units.h"
#include "motion/core/fixed.h"

#define BLENDER_FORMAT     "slew-blender-1"
#define BLENDER_NUMBER_MAX 64
#define BLENDER_CURVE_NAME 128

/* One key as the file has it; handles are absolute. */
struct blender_key {
    int64_t t_ns_q12, pos_q32;
    int64_t left_ns_q12, left_q32, right_ns_q12, right_q32;
    struct plan_bezier_key rest; /* but for its offsets */
};

struct blender_read {
    const struct import_settings *settings;
    struct imported *out;
    struct import_text text; /* for sentences only */
    struct units_context units;
    double start, end; /* frames of the scene */
    unsigned curves, lost;
    char first_lost[128];
    /* of the curve that is being read */
    char name[BLENDER_CURVE_NAME];
    const char *unit; /* of its values, "" for the axis's own */
    struct plan_axis *axis;
};

/* --- numbers -------------------------------------------------------------- */

static int blender_text(const struct yaml_value *value,
                        char text[BLENDER_NUMBER_MAX])
{
    const char *from = yaml_value_text(value);
    char quote[YAML_QUOTE_MAX];

    if (from == NULL)
        return -1;
    if (from[strspn(from, "+-.0123456789eE")] != 0 ||
        strlen(from) >= BLENDER_NUMBER_MAX)
        return yaml_value_refuse(value, "%s is not a number",
                                 yaml_value_quote(quote, value));
    memcpy(text, from, strlen(from) + 1);
    return 0;
}

static int blender_number(const struct blender_read *self,
                          const struct yaml_value *value, const char *number,
                          enum units_quantity quantity, int64_t *out)
{
    const char *before = quantity == UNITS_TIME ? "f" : "";
    const char *after = quantity == UNITS_POSITION ? self->unit : "";
    char whole[BLENDER_NUMBER_MAX + 16], sentence[UNITS_SENTENCE_MAX];

    snprintf(whole, sizeof whole, "%s%s%s", before, number, after);
    if (units_parse(whole, quantity, &self->units, out, sentence) < 0)
        return yaml_report_at(&value->tree->report,
                              yaml_tree_place(value->tree, value->node),
                              "%s %s", value->name, sentence);
    return 0;
}

static int blender_double(const struct yaml_value *value, double *out)
{
    char text[BLENDER_NUMBER_MAX];

    if (blender_text(value, text) < 0)
        return -1;
    *out = strtod(text, NULL);
    return 0;
}

/* From the scene's first frame.  As it is written where that is 0, so that no
 * digit is lost; else a frame has at most the digits of a double. */
static int blender_time(void *reader, const struct yaml_value *value, void *out)
{
    const struct blender_read *self = reader;
    char text[BLENDER_NUMBER_MAX];

    if (blender_text(value, text) < 0)
        return -1;
    if (self->start != 0)
        snprintf(text, sizeof text, "%.17g", strtod(text, NULL) - self->start);
    return blender_number(self, value, text, UNITS_TIME, out);
}

static int blender_duration(void *reader, const struct yaml_value *value,
                            void *out)
{
    char text[BLENDER_NUMBER_MAX];

    if (blender_text(value, text) < 0)
        return -1;
    return blender_number(reader, value, text, UNITS_TIME, out);
}

static int blender_value(void *reader, const struct yaml_value *value,
                         void *out)
{
    char text[BLENDER_NUMBER_MAX];

    if (blender_text(value, text) < 0)
        return -1;
    return blender_number(reader, value, text, UNITS_POSITION, out);
}

static int blender_ratio(void *reader, const struct yaml_value *value,
                         void *out)
{
    char text[BLENDER_NUMBER_MAX];

    if (blender_text(value, text) < 0)
        return -1;
    return blender_number(reader, value, text, UNITS_RATIO, out);
}

/* --- words ---------------------------------------------------------------- */

/* In the order of the enums of motion/curve/fcurve.h. */
static const char *const blender_handles[] = { "FREE", "ALIGNED", "VECTOR",
                                               "AUTO", "AUTO_CLAMPED" };
static const char *const blender_interpolations[] = {
    "CONSTANT", "LINEAR", "BEZIER", "SINE", "QUAD",   "CUBIC",  "QUART",
    "QUINT",    "EXPO",   "CIRC",   "BACK", "BOUNCE", "ELASTIC"
};
static const char *const blender_easings[] = { "AUTO", "EASE_IN", "EASE_OUT",
                                               "EASE_IN_OUT" };
static const char *const blender_smoothings[] = { "NONE", "CONT_ACCEL" };
static const char *const blender_extrapolations[] = { "CONSTANT", "LINEAR" };
static const char *const blender_cycles[] = { "NONE", "REPEAT", "REPEAT_OFFSET",
                                              "MIRROR" };

#define BLENDER_WORD(what)                                                     \
    static int blender_read_##what(void *reader,                               \
                                   const struct yaml_value *value, void *out)  \
    {                                                                          \
        (void)reader;                                                          \
        return yaml_value_word(value, blender_##what##s,                       \
                               ARRAY_LEN(blender_##what##s), out);             \
    }
BLENDER_WORD(handle)
BLENDER_WORD(interpolation)
BLENDER_WORD(easing)
BLENDER_WORD(smoothing)
BLENDER_WORD(extrapolation)
BLENDER_WORD(cycle)
#undef BLENDER_WORD

/* --- keys ----------------------------------------------------------------- */

#define BLENDER_KEY(member) offsetof(struct blender_key, member)

static const struct yaml_field blender_key_fields[] = {
    { "t", YAML_REQUIRED, "a frame", blender_time, BLENDER_KEY(t_ns_q12) },
    { "v", YAML_REQUIRED, "a value", blender_value, BLENDER_KEY(pos_q32) },
    { "lt", YAML_REQUIRED, "the frame of the left handle", blender_time,
      BLENDER_KEY(left_ns_q12) },
    { "lv", YAML_REQUIRED, "the value of the left handle", blender_value,
      BLENDER_KEY(left_q32) },
    { "rt", YAML_REQUIRED, "the frame of the right handle", blender_time,
      BLENDER_KEY(right_ns_q12) },
    { "rv", YAML_REQUIRED, "the value of the right handle", blender_value,
      BLENDER_KEY(right_q32) },
    { "hl", YAML_REQUIRED, "FREE, ALIGNED, VECTOR, AUTO or AUTO_CLAMPED",
      blender_read_handle, BLENDER_KEY(rest.left.kind) },
    { "hr", YAML_REQUIRED, "FREE, ALIGNED, VECTOR, AUTO or AUTO_CLAMPED",
      blender_read_handle, BLENDER_KEY(rest.right.kind) },
    { "interp", YAML_REQUIRED, "an interpolation such as BEZIER",
      blender_read_interpolation, BLENDER_KEY(rest.interpolation) },
    { "easing", YAML_REQUIRED, "AUTO, EASE_IN, EASE_OUT or EASE_IN_OUT",
      blender_read_easing, BLENDER_KEY(rest.easing) },
    { "amplitude", YAML_REQUIRED, "a value", blender_value,
      BLENDER_KEY(rest.amplitude_q32) },
    { "period", YAML_REQUIRED, "a number of frames", blender_duration,
      BLENDER_KEY(rest.period_ns_q12) },
    { "back", YAML_REQUIRED, "a number", blender_ratio,
      BLENDER_KEY(rest.back_q32) },
};
static const struct yaml_shape blender_key_shape = {
    "key", blender_key_fields, ARRAY_LEN(blender_key_fields)
};

/* Offsets from the key, for the kinds that have one of their own; on its side
 * of the key, as Blender shows it. */
static int blender_offset(const struct yaml_value *value,
                          const struct blender_key *key, bool left,
                          struct plan_handle *handle)
{
    int64_t dt, dp;

    if (handle->kind != MOTION_FCURVE_FREE &&
        handle->kind != MOTION_FCURVE_ALIGNED)
        return 0;
    if (motion_fixed_sub(left ? key->left_ns_q12 : key->right_ns_q12,
                         key->t_ns_q12, &dt) < 0 ||
        motion_fixed_sub(left ? key->left_q32 : key->right_q32, key->pos_q32,
                         &dp) < 0)
        return yaml_value_refuse(value, "has a handle that is out of range");
    handle->dt_ns_q12 = (left ? dt > 0 : dt < 0) ? 0 : dt;
    handle->dp_q32 = dp;
    return 0;
}

/* What an interpolation does not use is not kept. */
static void blender_tidy(struct plan_bezier_key *key)
{
    if (key->interpolation < MOTION_FCURVE_SINE)
        key->easing = MOTION_FCURVE_BY_KIND;
    if (key->interpolation != MOTION_FCURVE_BACK)
        key->back_q32 = 0;
    if (key->interpolation != MOTION_FCURVE_ELASTIC)
        key->amplitude_q32 = key->period_ns_q12 = 0;
}

static int blender_add_key(struct blender_read *self,
                           const struct yaml_value *value,
                           struct blender_key *key)
{
    const struct plan_place place = yaml_tree_place(value->tree, value->node);
    const uint32_t i = self->axis->key_count;
    struct plan_key *to;

    if (blender_offset(value, key, true, &key->rest.left) < 0 ||
        blender_offset(value, key, false, &key->rest.right) < 0)
        return -1;
    if (i > 0 && key->t_ns_q12 <= self->axis->key[i - 1].key.t_ns_q12)
        return yaml_value_refuse(value, "is not later than the one before it");
    to = import_add_key(&self->text, place, self->axis);
    if (to == NULL)
        return -1;
    to->key.t_ns_q12 = key->t_ns_q12;
    to->key.pos_q32 = key->pos_q32;
    blender_tidy(&key->rest);
    self->axis->bezier.key[i] = key->rest;
    return 0;
}

static int blender_read_keys(void *reader, const struct yaml_value *value,
                             void *out)
{
    struct blender_read *self = reader;
    struct yaml_value item = { value->tree, yaml_value_node(value)->first,
                               "key", "a map with t, v and handles" };
    struct blender_key key;
    uint32_t count;

    (void)out;
    if (yaml_value_list(value, 1, PLAN_KEYS_MAX, &count) < 0)
        return -1;
    self->axis->bezier.key = memory_new(count, sizeof(struct plan_bezier_key));
    for (uint32_t i = 0; i < count; i++) {
        memset(&key, 0, sizeof key);
        if (yaml_fields_read(&item, &blender_key_shape, self, &key) < 0 ||
            blender_add_key(self, &item, &key) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

/* --- curves --------------------------------------------------------------- */

static const struct yaml_field blender_cycles_fields[] = {
    { "mode_before", YAML_REQUIRED, "NONE, REPEAT, REPEAT_OFFSET or MIRROR",
      blender_read_cycle, offsetof(struct plan_bezier, before.mode) },
    { "mode_after", YAML_REQUIRED, "NONE, REPEAT, REPEAT_OFFSET or MIRROR",
      blender_read_cycle, offsetof(struct plan_bezier, after.mode) },
    { "count_before", YAML_REQUIRED, "how many times", yaml_read_u32,
      offsetof(struct plan_bezier, before.count) },
    { "count_after", YAML_REQUIRED, "how many times", yaml_read_u32,
      offsetof(struct plan_bezier, after.count) },
};
static const struct yaml_shape blender_cycles_shape = {
    "cycles", blender_cycles_fields, ARRAY_LEN(blender_cycles_fields)
};

static bool blender_is_null(const struct yaml_value *value)
{
    return yaml_value_node(value)->kind == YAML_TREE_TEXT &&
           strcmp(yaml_tree_text(value->tree, value->node), "null") == 0;
}

static int blender_read_cycles(void *reader, const struct yaml_value *value,
                               void *out)
{
    if (blender_is_null(value))
        return 0;
    return yaml_fields_read(value, &blender_cycles_shape, reader, out);
}

/* "location[0]" is x, "["pan"][0]" pan, "data.lens[0]" lens. */
static void blender_axis_name(const struct blender_read *self,
                              char name[BLENDER_CURVE_NAME])
{
    static const char *const of_three[] = { "x", "y", "z" };
    char path[BLENDER_CURVE_NAME], *end, *from;
    unsigned long index = 3; /* none: a name that slew wrote */

    snprintf(path, sizeof path, "%s", self->name);
    end = strrchr(path, '[');
    if (end != NULL && end[1] >= '0' && end[1] <= '9') {
        index = strtoul(end + 1, NULL, 10);
        *end = 0;
    }
    snprintf(name, BLENDER_CURVE_NAME, "%s",
             strcmp(path, "location") == 0 && index < 3 ? of_three[index]
                                                        : path);
    if (strcmp(path, "rotation_euler") == 0 && index < 3)
        snprintf(name, BLENDER_CURVE_NAME, "rotation_%s", of_three[index]);
    end = strrchr(path, '"');
    if (end != NULL) {
        *end = 0;
        from = strrchr(path, '"');
    } else
        from = strrchr(path, '.');
    if (from != NULL)
        snprintf(name, BLENDER_CURVE_NAME, "%s", from + 1);
}

static bool blender_unit_fits(const char *word, enum units_axis unit)
{
    const bool length = strcmp(word, "mm") == 0 || strcmp(word, "m") == 0;

    return word[0] == 0 || length == (unit == UNITS_AXIS_MM);
}

static int blender_read_unit(void *reader, const struct yaml_value *value,
                             void *out)
{
    static const char *const unit[] = { "own", "mm", "m", "deg", "rad", "rev" };
    struct blender_read *self = reader;
    unsigned index;

    (void)out;
    if (yaml_value_choice(value, unit, ARRAY_LEN(unit), &index) < 0)
        return -1;
    self->unit = index == 0 ? "" : unit[index];
    snprintf(self->out->column[self->curves - 1].unit, IMPORT_UNIT_MAX, "%s",
             self->unit);
    if (!blender_unit_fits(self->unit, self->units.unit))
        return yaml_value_refuse(
            value, "'%s' does not fit axis %s, whose unit is %s", self->unit,
            self->axis->name, units_axis_text(self->units.unit));
    return 0;
}

static int blender_read_name(void *reader, const struct yaml_value *value,
                             void *out)
{
    struct blender_read *self = reader;

    (void)out;
    return yaml_value_copy(value, self->name, sizeof self->name);
}

static const struct yaml_field blender_curve_fields[] = {
    { "name", YAML_REQUIRED, "such as location[0], at most 127 bytes",
      blender_read_name, 0 },
    { "unit", YAML_REQUIRED, "own, mm, m, deg, rad or rev", blender_read_unit,
      0 },
    { "extrapolation", YAML_REQUIRED, "CONSTANT or LINEAR",
      blender_read_extrapolation, offsetof(struct plan_bezier, extrapolation) },
    { "auto_smoothing", YAML_REQUIRED, "NONE or CONT_ACCEL",
      blender_read_smoothing, offsetof(struct plan_bezier, smoothing) },
    { "cycles", YAML_REQUIRED, "null or a map", blender_read_cycles, 0 },
    { "keys", YAML_REQUIRED, "a list of keys", blender_read_keys, 0 },
};
static const struct yaml_shape blender_curve_shape = {
    "curve", blender_curve_fields, ARRAY_LEN(blender_curve_fields)
};

/* The curve's name, before the others need its axis. */
static int blender_peek_name(struct blender_read *self,
                             const struct yaml_value *curve)
{
    const struct yaml_tree *tree = curve->tree;
    uint32_t key = yaml_value_node(curve)->first;

    if (yaml_value_need(curve, YAML_TREE_MAP) < 0)
        return -1;
    for (uint32_t i = 0; i < yaml_value_node(curve)->length; i++) {
        const uint32_t entry = tree->node[key].next;
        const struct yaml_value name = { tree, entry, "name",
                                         blender_curve_fields[0].expected };

        if (strcmp(yaml_tree_text(tree, key), "name") == 0)
            return blender_read_name(self, &name, NULL);
        key = tree->node[entry].next;
    }
    return yaml_value_refuse(curve, "has no 'name'");
}

/* All curves there are, before any is read. */
static int blender_name_curves(struct blender_read *self,
                               const struct yaml_value *first, uint32_t count)
{
    struct yaml_value curve = *first;
    char name[BLENDER_CURVE_NAME];

    for (uint32_t i = 0; i < count; i++) {
        if (blender_peek_name(self, &curve) < 0)
            return -1;
        blender_axis_name(self, name);
        if (import_add_column(&self->text,
                              yaml_tree_place(curve.tree, curve.node),
                              self->out, self->name, name) < 0)
            return -1;
        curve.node = yaml_value_node(&curve)->next;
    }
    return import_name_columns(&self->text, self->settings, self->out);
}

/* false: left out.  NULL axis: refused. */
static bool blender_open(struct blender_read *self)
{
    const struct import_settings *settings = self->settings;
    struct import_column *column = &self->out->column[self->curves++];

    self->axis = NULL;
    if (column->axis < 0)
        return false;
    self->axis = import_add_axis(&self->text, settings, self->out, column);
    if (self->axis == NULL)
        return true;
    self->axis->curve = PLAN_CURVE_BEZIER;
    self->units.unit = settings->rig->axis[column->axis].unit;
    return true;
}

static bool blender_has_aligned(const struct plan_axis *axis)
{
    for (uint32_t i = 0; i < axis->key_count; i++)
        if (axis->bezier.key[i].left.kind == MOTION_FCURVE_ALIGNED ||
            axis->bezier.key[i].right.kind == MOTION_FCURVE_ALIGNED)
            return true;
    return false;
}

/* The scene's last frame ends what would go on beyond it. */
static int blender_close(struct blender_read *self,
                         const struct yaml_value *value)
{
    struct plan_axis *axis = self->axis;
    struct plan_bezier *bezier = &axis->bezier;
    char text[BLENDER_NUMBER_MAX];
    int64_t end_ns_q12;

    snprintf(text, sizeof text, "%.17g", self->end - self->start);
    if (blender_number(self, value, text, UNITS_TIME, &end_ns_q12) < 0)
        return -1;
    if (bezier->after.mode != MOTION_FCURVE_ONCE ||
        bezier->extrapolation != MOTION_FCURVE_HOLD ||
        axis->key[axis->key_count - 1].key.t_ns_q12 > end_ns_q12) {
        bezier->has_end = true;
        bezier->end_ns_q12 = end_ns_q12;
    }
    if (!blender_has_aligned(axis))
        return 0;
    if (blender_number(self, value, "1", UNITS_TIME, &bezier->frame_ns_q12) < 0)
        return -1;
    return blender_number(self, value, "1", UNITS_POSITION, &bezier->value_q32);
}

static int blender_read_curves(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct blender_read *self = reader;
    struct yaml_value item = { value->tree, yaml_value_node(value)->first,
                               "curve", "a map with name, unit and keys" };
    uint32_t count;

    (void)out;
    if (yaml_value_list(value, 1, IMPORT_COLUMNS_MAX, &count) < 0 ||
        blender_name_curves(self, &item, count) < 0)
        return -1;
    for (uint32_t i = 0; i < count; i++) {
        if (blender_open(self) &&
            (self->axis == NULL ||
             yaml_fields_read(&item, &blender_curve_shape, self,
                              &self->axis->bezier) < 0 ||
             blender_close(self, &item) < 0))
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

/* --- the file ------------------------------------------------------------- */

static int blender_read_format(void *reader, const struct yaml_value *value,
                               void *out)
{
    static const char *const format[] = { BLENDER_FORMAT };
    unsigned index;

    (void)reader;
    (void)out;
    return yaml_value_choice(value, format, 1, &index);
}

static int blender_read_text(void *reader, const struct yaml_value *value,
                             void *out)
{
    (void)reader;
    (void)out;
    return yaml_value_text(value) != NULL ? 0 : -1;
}

static int blender_read_fps(void *reader, const struct yaml_value *value,
                            void *out)
{
    (void)reader;
    return yaml_units_read_fps(value, out);
}

/* fps / fps_base, both decimals. */
static int blender_read_base(void *reader, const struct yaml_value *value,
                             void *out)
{
    struct blender_read *self = reader;
    const struct units_fps *fps = &self->units.fps;
    char whole[BLENDER_NUMBER_MAX + 48], sentence[UNITS_SENTENCE_MAX];
    char base[BLENDER_NUMBER_MAX];

    (void)out;
    if (blender_text(value, base) < 0)
        return -1;
    if (fps->den != 1)
        return yaml_value_refuse(value, "goes with a rate that is not whole");
    snprintf(whole, sizeof whole, "%llu/%s", (unsigned long long)fps->num,
             base);
    if (units_parse_fps(whole, &self->out->fps, sentence) < 0)
        return yaml_report_at(&value->tree->report,
                              yaml_tree_place(value->tree, value->node),
                              "%s %s", value->name, sentence);
    if (self->settings->fps.den != 0)
        self->out->fps = self->settings->fps;
    self->units.fps = self->out->fps;
    return 0;
}

static int blender_read_frame(void *reader, const struct yaml_value *value,
                              void *out)
{
    (void)reader;
    return blender_double(value, out);
}

static int blender_read_lost(void *reader, const struct yaml_value *value,
                             void *out)
{
    struct blender_read *self = reader;
    const struct yaml_value first = { value->tree,
                                      yaml_value_node(value)->first, "lost",
                                      "a list of texts" };

    (void)out;
    if (yaml_value_list(value, 0, PLAN_KEYS_MAX, &self->lost) < 0)
        return -1;
    return self->lost == 0 ? 0
                           : yaml_value_copy(&first, self->first_lost,
                                             sizeof self->first_lost);
}

#define BLENDER_READ(member) offsetof(struct blender_read, member)

static const struct yaml_field blender_fields[] = {
    { "format", YAML_REQUIRED, BLENDER_FORMAT, blender_read_format, 0 },
    { "object", YAML_OPTIONAL, "a name", blender_read_text, 0 },
    { "fps", YAML_REQUIRED, "frames per second, whole", blender_read_fps,
      BLENDER_READ(units.fps) },
    { "fps_base", YAML_REQUIRED, "what fps is divided by", blender_read_base,
      0 },
    { "frame_start", YAML_REQUIRED, "the first frame of the scene",
      blender_read_frame, BLENDER_READ(start) },
    { "frame_end", YAML_REQUIRED, "the last frame of the scene",
      blender_read_frame, BLENDER_READ(end) },
    { "lost", YAML_OPTIONAL, "a list of texts of at most 127 bytes",
      blender_read_lost, 0 },
    { "curves", YAML_REQUIRED, "a list of curves", blender_read_curves, 0 },
};
static const struct yaml_shape blender_shape = { "action", blender_fields,
                                                 ARRAY_LEN(blender_fields) };

int import_blender(const struct files *files, const char *path,
                   const struct import_settings *settings,
                   struct imported *imported, char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct blender_read self = { .settings = settings,
                                 .out = imported,
                                 .text.report = report };
    struct yaml_tree tree;
    int err;

    *imported = (struct imported){ .column_word = "curve" };
    plan_progress_tell(settings->progress, "reading", path, 0, 0);
    if (yaml_tree_load(files, &tree, &report) < 0)
        return -1;
    err = yaml_fields_read(
        &(struct yaml_value){ &tree, 0, "the action", "a map with curves" },
        &blender_shape, &self, &self);
    yaml_tree_free(&tree);
    if (err == 0 && self.lost > 0)
        snprintf(imported->note, sizeof imported->note,
                 "%u in Blender, the first: %s", self.lost, self.first_lost);
    if (err < 0)
        move_free(&imported->move);
    return err;
}
