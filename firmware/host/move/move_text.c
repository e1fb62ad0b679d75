/* firmware/host/move/move_text.c - see move_text.h. */
#include "firmware/host/move/move_text.h"

#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "motion/core/fixed.h"
#include "motion/plan/path/plan_path.h"

#define TEXT_OVER_FILE INT_MAX /* as a file: the text itself */

struct text {
    struct yaml_text yaml;
    enum units_axis unit; /* of the axis at hand */
    struct units_fps fps; /* of the move; den 0: none */
    bool on_frames;       /* keys are on whole frames */
};

/* --- values ------------------------------------------------------------------ */

static void text_trim(char *text)
{
    size_t end = strlen(text);

    while (end > 0 && strchr(text, '.') != NULL && text[end - 1] == '0')
        text[--end] = 0;
    if (end > 0 && text[end - 1] == '.')
        text[--end] = 0;
}

/* Whole nanoseconds, as all that is computed for a file. */
static void text_of_time(char text[YAML_TEXT_VALUE_MAX], int64_t t_ns_q12)
{
    const int64_t ns = t_ns_q12 / MOTION_FIXED_NS_Q12;
    const uint64_t size = motion_fixed_abs(ns);
    char number[NUMBER_MAX];

    snprintf(number, sizeof number, "%s%llu.%09llu", ns < 0 ? "-" : "",
             (unsigned long long)(size / 1000000000),
             (unsigned long long)(size % 1000000000));
    text_trim(number);
    snprintf(text, YAML_TEXT_VALUE_MAX, "%s s", number);
}

/* A frame where a frame was written, or all keys are on frames. */
static int text_key_time(struct text *self, const struct yaml_value *value,
                         int64_t t_ns_q12)
{
    char text[YAML_TEXT_VALUE_MAX];
    const char *const was = yaml_tree_text(&self->yaml.tree, value->node);
    const bool was_frame = was[0] == 'f' && strchr(was, '@') == NULL;
    const int64_t frame = was_frame || self->on_frames
                              ? units_frame_of(&self->fps, t_ns_q12)
                              : -1;

    if (frame >= 0)
        snprintf(text, sizeof text, "frame %" PRId64, frame);
    else
        text_of_time(text, t_ns_q12);
    return yaml_text_replace(&self->yaml, value, text);
}

static int text_time(struct text *self, const struct yaml_value *value,
                     int64_t t_ns_q12)
{
    char text[YAML_TEXT_VALUE_MAX];

    text_of_time(text, t_ns_q12);
    return yaml_text_replace(&self->yaml, value, text);
}

/* Ten decimals: half a step of them is less than half a step of 2^-32. */
static int text_derivative(struct text *self, const struct yaml_value *value,
                           struct motion_real to, unsigned order)
{
    char number[NUMBER_MAX], unit[NUMBER_UNIT_MAX], text[YAML_TEXT_VALUE_MAX];
    int64_t q32;

    if (motion_real_round(to, 32, &q32) < 0)
        return yaml_value_refuse(value,
                                 "would not fit the range of its format");
    number_fixed(number, q32, 32, 10);
    text_trim(number);
    snprintf(text, sizeof text, "%s %s", number,
             number_unit(unit, self->unit, order));
    return yaml_text_replace(&self->yaml, value, text);
}

/* --- keys -------------------------------------------------------------------- */

/* A value of a key: by name, or by its place in the short form. */
static bool text_field(const struct yaml_value *key, const char *name,
                       unsigned place, struct yaml_value *field)
{
    const struct yaml_tree_node *node = yaml_value_node(key);
    uint32_t found = 0;

    if (node->kind == YAML_TREE_MAP) {
        found = yaml_fields_find(key, name);
    } else if (place < node->length) {
        found = node->first;
        for (unsigned i = 0; i < place; i++)
            found = key->tree->node[found].next;
    }
    *field = (struct yaml_value){ key->tree, found, name, "the value itself" };
    return found != 0;
}

static bool text_differs(struct motion_real a, struct motion_real b)
{
    return motion_real_cmp(a, b) != 0;
}

static int text_handle(struct text *self, const struct yaml_value *key,
                       const char *name, int64_t was_ns_q12, int64_t is_ns_q12)
{
    struct yaml_value list, item;

    if (was_ns_q12 == is_ns_q12 || !text_field(key, name, UINT_MAX, &list) ||
        yaml_value_node(&list)->kind != YAML_TREE_LIST)
        return 0;
    item = yaml_value_at(&list, yaml_value_node(&list)->first);
    return text_time(self, &item, is_ns_q12);
}

/* A velocity behind the position, where the key has none (stand.h): in [t, p] or {t: ..., p:
 * ...}, on one line. */
static int text_stand(struct text *self, const struct yaml_value *key,
                      const struct plan_key *to, bool is_moved)
{
    const bool is_map = yaml_value_node(key)->kind == YAML_TREE_MAP;
    char text[YAML_TEXT_VALUE_MAX], pos[NUMBER_MAX], vel[NUMBER_MAX],
        unit[NUMBER_UNIT_MAX];
    struct yaml_value field;
    int64_t vel_q32 = 0;
    size_t at;

    if (!text_field(key, "p", 1, &field) ||
        !yaml_text_place(&self->yaml, yaml_tree_place(key->tree, key->node),
                         &at) ||
        (is_map && self->yaml.data[at] != '{'))
        return yaml_value_refuse(key, "needs a velocity to stay in its range, "
                                      "which is not put into a key of several "
                                      "lines");
    const char *acc = !to->key.has_acc ? "" : is_map ? ", a: 0" : ", 0";
    (void)motion_real_round(to->key.vel, 32, &vel_q32);
    number_fixed(pos, to->key.pos_q32, 32, 10);
    number_fixed(vel, vel_q32, 32, 10);
    text_trim(pos);
    text_trim(vel);
    snprintf(text, sizeof text, "%.80s%s%s, %s%s%s",
             is_moved ? pos : yaml_tree_text(key->tree, field.node),
             is_moved ? " " : "",
             is_moved ? number_unit(unit, self->unit, 0) : "",
             is_map ? "v: " : "", vel, acc);
    return yaml_text_replace(&self->yaml, &field, text);
}

static int text_key(struct text *self, const struct yaml_value *value,
                    const struct plan_axis *was, const struct plan_axis *is,
                    uint32_t i)
{
    const struct motion_key *from = &was->key[i].key, *to = &is->key[i].key;
    struct yaml_value field;
    int err = 0;

    if (from->t_ns_q12 != to->t_ns_q12)
        err = text_field(value, "t", 0, &field)
                  ? text_key_time(self, &field, to->t_ns_q12)
                  : yaml_value_refuse(value, "has no time");
    if (err == 0 && to->has_vel && !from->has_vel)
        err =
            text_stand(self, value, &is->key[i], from->pos_q32 != to->pos_q32);
    else if (err == 0 && from->pos_q32 != to->pos_q32)
        err = text_field(value, "p", 1, &field)
                  ? text_derivative(self, &field,
                                    motion_real_from_q(to->pos_q32, 32), 0)
                  : yaml_value_refuse(value, "has no position");
    if (err == 0 && from->has_vel && text_differs(from->vel, to->vel) &&
        text_field(value, "v", 2, &field))
        err = text_derivative(self, &field, to->vel, 1);
    if (err == 0 && from->has_acc && text_differs(from->acc, to->acc) &&
        text_field(value, "a", 3, &field))
        err = text_derivative(self, &field, to->acc, 2);
    if (err != 0 || was->bezier.key == NULL)
        return err;
    err = text_handle(self, value, "left", was->bezier.key[i].left.dt_ns_q12,
                      is->bezier.key[i].left.dt_ns_q12);
    return err != 0 ? err
                    : text_handle(self, value, "right",
                                  was->bezier.key[i].right.dt_ns_q12,
                                  is->bezier.key[i].right.dt_ns_q12);
}

static int text_axis(struct text *self, const struct yaml_value *axes,
                     const struct plan_axis *was, const struct plan_axis *is)
{
    struct yaml_value value = *axes;
    int err = 0;

    value.node = yaml_fields_find(axes, was->name);
    if (value.node != 0)
        value.node = yaml_fields_find(&value, "keys");
    if (value.node == 0 || yaml_value_node(&value)->kind != YAML_TREE_LIST ||
        yaml_value_node(&value)->length != was->key_count)
        return yaml_value_refuse(axes, "has changed since it was read");
    value.name = "key";
    value.node = yaml_value_node(&value)->first;
    for (uint32_t i = 0; i < was->key_count && err == 0; i++) {
        err = text_key(self, &value, was, is, i);
        value.node = yaml_value_node(&value)->next;
    }
    return err;
}

static const char text_map_expected[] = "those of the move";

static struct yaml_value text_root(const struct text *self)
{
    return (struct yaml_value){ &self->yaml.tree, 0, "the move", "axes" };
}

static int text_axes(struct text *self, const struct move_text_source *source,
                     const struct plan_fit *fit)
{
    const struct plan_move *was = source->was;
    const struct yaml_value root = text_root(self);
    struct yaml_value axes = { &self->yaml.tree,
                               yaml_fields_find(&root, "axes"), "axes",
                               text_map_expected };
    int err = axes.node == 0 ? yaml_value_refuse(&root, "has no axes") : 0;

    for (uint32_t a = 0; a < fit->axis_count && err == 0; a++) {
        const int index = rig_axis_index(source->rig, was->axis[a].name);
        if (was->axis[a].driver != PLAN_BY_KEYS)
            continue;
        self->unit = source->rig->axis[index < 0 ? 0 : index].unit;
        err = text_axis(self, &axes, &was->axis[a], &fit->axis[a]);
    }
    return err;
}

/* --- the duration ------------------------------------------------------------ */

/* The first entry that is more than a heading. */
static uint32_t text_first_part(const struct text *self)
{
    static const char *const heading[] = { "title", "fps", "timing" };
    const struct yaml_tree *tree = &self->yaml.tree;
    uint32_t key = tree->node[0].first;

    for (uint32_t next = key; next != 0;
         next = tree->node[tree->node[next].next].next) {
        bool is_heading = false;
        for (size_t i = 0; i < sizeof heading / sizeof *heading; i++)
            is_heading = is_heading ||
                         strcmp(yaml_tree_text(tree, next), heading[i]) == 0;
        if (!is_heading)
            return next;
    }
    return key;
}

static int text_duration(struct text *self, const char *name,
                         int64_t duration_ns_q12)
{
    const struct yaml_value root = text_root(self);
    const struct yaml_value value = { &self->yaml.tree,
                                      yaml_fields_find(&root, name), name,
                                      "a time" };
    char text[YAML_TEXT_VALUE_MAX];

    if (duration_ns_q12 == 0)
        return 0;
    text_of_time(text, duration_ns_q12);
    return value.node != 0 ? yaml_text_replace(&self->yaml, &value, text)
                           : yaml_text_insert(&self->yaml, &root, name, text,
                                              text_first_part(self));
}

/* --- the speed law of a path --------------------------------------------------- */

static int text_slower_time(struct text *self, const struct yaml_value *part,
                            const char *name, int64_t was_ns_q12, double by)
{
    struct yaml_value field;

    if (was_ns_q12 == 0 || !text_field(part, name, UINT_MAX, &field))
        return 0;
    return text_time(
        self, &field,
        llround((double)was_ns_q12 / (double)MOTION_FIXED_NS_Q12 * by) *
            MOTION_FIXED_NS_Q12);
}

static int text_slower_value(struct text *self, const struct yaml_value *value,
                             struct motion_real was, unsigned order, double by)
{
    const double size = ldexp((double)was.m, was.e + 32);

    if (was.m == 0)
        return 0;
    return text_derivative(
        self, value,
        motion_real_from_q(llround(size / (order == 2 ? by * by : by)), 32),
        order);
}

static int text_slower_speed(struct text *self, const struct yaml_value *part,
                             const char *name, int64_t was_q32, double by)
{
    struct yaml_value field;

    return text_field(part, name, UINT_MAX, &field)
               ? text_slower_value(self, &field,
                                   motion_real_from_q(was_q32, 32), 1, by)
               : 0;
}

static int text_slower_points(struct text *self, const struct yaml_value *part,
                              const struct plan_part *was, double by)
{
    const unsigned order = was->law == PLAN_SPEED_LAW_ACCELERATION ? 2 : 1;
    struct yaml_value list, item, pair[2];
    int err = 0;

    if (!text_field(part, "points", UINT_MAX, &list))
        return 0;
    item = yaml_value_at(&list, yaml_value_node(&list)->first);
    for (uint32_t i = 0; i < was->points && err == 0; i++) {
        const int64_t t_ns_q12 = was->point[i].t_ns_q12;
        err = yaml_value_pair(&item, pair);
        if (err == 0 && t_ns_q12 != 0)
            err = text_time(
                self, &pair[0],
                llround((double)t_ns_q12 / (double)MOTION_FIXED_NS_Q12 * by) *
                    MOTION_FIXED_NS_Q12);
        if (err == 0)
            err = text_slower_value(self, &pair[1], was->point[i].value, order,
                                    by);
        item.node = yaml_value_node(&item)->next;
    }
    return err;
}

static int text_slower_part(struct text *self, const struct yaml_value *part,
                            const struct plan_part *was, double by)
{
    int err;

    if (was->drawn != NULL)
        return yaml_value_refuse(part, "is drawn by keys");
    err = text_slower_time(self, part, "time", was->dur_ns_q12, by);
    if (err == 0)
        err = text_slower_speed(self, part, "from", was->from_q32, by);
    if (err == 0)
        err = text_slower_speed(self, part, "to", was->to_q32, by);
    return err == 0 ? text_slower_points(self, part, was, by) : err;
}

static int text_slower(struct text *self, const struct move_text_source *source,
                       double by)
{
    const struct plan_path *was = source->was->path;
    const struct yaml_value root = text_root(self);
    struct yaml_value value = { &self->yaml.tree,
                                yaml_fields_find(&root, "path"), "path",
                                text_map_expected };
    int err = 0;

    if (value.node != 0)
        value.node = yaml_fields_find(&value, "speed");
    value.name = "part";
    value.expected = "a speed law whose parts have times and speeds";
    if (value.node == 0 || was->parts == 0)
        return yaml_value_refuse(&root, "has no speed law");
    if (yaml_value_node(&value)->kind == YAML_TREE_LIST)
        value.node = yaml_value_node(&value)->first;
    self->unit = source->rig
                     ->axis[rig_axis_index(
                         source->rig, source->was->axis[was->axis[0]].name)]
                     .unit;
    for (uint32_t i = 0; i < was->parts && err == 0; i++) {
        err = text_slower_part(self, &value, &was->part[i], by);
        value.node = yaml_value_node(&value)->next;
    }
    return err;
}

/* --- the new text ------------------------------------------------------------- */

static int text_open(struct text *self, const struct move_text_source *source,
                     struct move_text *text)
{
    const struct yaml_report report = { source->path, source->message,
                                        YAML_MESSAGE_MAX };

    *text = (struct move_text){ .data = NULL };
    *self =
        (struct text){ .unit = UNITS_AXIS_MM,
                       .fps = { source->was->fps_num, source->was->fps_den },
                       .on_frames = source->on_frames };
    return yaml_text_open(&self->yaml, source->files, &report);
}

static int text_close(struct text *self, int err, struct move_text *text)
{
    if (err == 0) {
        text->data = yaml_text_make(&self->yaml, &text->length);
        text->edit = self->yaml.edit;
        text->changed = self->yaml.edits;
        self->yaml.edit = NULL;
    }
    yaml_text_close(&self->yaml);
    return err;
}

int move_text_keys(const struct move_text_source *source,
                   const struct plan_fit *fit, struct move_text *text)
{
    struct text self;
    int err = text_open(&self, source, text);

    if (err == 0)
        err = text_axes(&self, source, fit);
    return text_close(&self, err, text);
}

int move_text_duration(const struct move_text_source *source,
                       const struct move_text_times *times,
                       struct move_text *text)
{
    struct text self;
    int err = text_open(&self, source, text);

    if (err == 0)
        err = text_duration(&self, "pre_roll", times->pre_roll_ns_q12);
    if (err == 0)
        err = text_duration(&self, "post_roll", times->post_roll_ns_q12);
    if (err == 0)
        err = text_duration(&self, "duration", times->duration_ns_q12);
    return text_close(&self, err, text);
}

int move_text_slower(const struct move_text_source *source, double by,
                     struct move_text *text)
{
    struct text self;
    int err = text_open(&self, source, text);

    if (err == 0)
        err = text_slower(&self, source, by);
    return text_close(&self, err, text);
}

void move_text_free(struct move_text *text)
{
    memory_free(text->data);
    memory_free(text->edit);
    *text = (struct move_text){ .data = NULL };
}

/* --- as a file ---------------------------------------------------------------- */

static const struct move_text_files *text_over(const struct files *files)
{
    return (const struct move_text_files *)(const void *)files;
}

static int text_over_open(const struct files *files, const char *path)
{
    const struct move_text_files *self = text_over(files);

    return strcmp(path, self->path) == 0 ? TEXT_OVER_FILE
                                         : self->below->open(self->below, path);
}

static void text_over_close(const struct files *files, int file)
{
    const struct move_text_files *self = text_over(files);

    if (file != TEXT_OVER_FILE)
        self->below->close(self->below, file);
}

static int64_t text_over_read(const struct files *files, int file, void *to,
                              size_t size, uint64_t offset)
{
    const struct move_text_files *self = text_over(files);
    const size_t length = self->text->length;

    if (file != TEXT_OVER_FILE)
        return self->below->read(self->below, file, to, size, offset);
    if (offset >= length)
        return 0;
    if (size > length - offset)
        size = length - (size_t)offset;
    memcpy(to, self->text->data + offset, size);
    return (int64_t)size;
}

static int64_t text_over_size(const struct files *files, int file)
{
    const struct move_text_files *self = text_over(files);

    return file == TEXT_OVER_FILE ? (int64_t)self->text->length
                                  : self->below->size(self->below, file);
}

static bool text_over_find(const struct files *files, const char *kind,
                           const char *name, const char *beside,
                           char path[FILES_PATH_MAX])
{
    const struct files *below = text_over(files)->below;

    return below->find(below, kind, name, beside, path);
}

static unsigned text_over_names(const struct files *files, const char *kind,
                                char name[FILES_NAMES_MAX][FILES_NAME_MAX])
{
    const struct files *below = text_over(files)->below;

    return below->names(below, kind, name);
}

void move_text_over(struct move_text_files *over, const struct files *below,
                    const char *path, const struct move_text *text)
{
    *over = (struct move_text_files){
        .files = { .open = text_over_open,
                   .close = text_over_close,
                   .read = text_over_read,
                   .size = text_over_size,
                   .find = text_over_find,
                   .names = text_over_names,
                   .regular = below->regular },
        .below = below,
        .path = path,
        .text = text,
    };
}
