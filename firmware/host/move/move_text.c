/* firmware/host/move/move_text.c - see move_text.h.
 *
 * The tree says where a value stands by line and column; the text there is the
 * value itself, unless it has an escape, which is refused. */
#include "firmware/host/move/move_text.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/yaml/yaml_fields.h"
#include "motion/core/fixed.h"

#define TEXT_VALUE_MAX 96
#define TEXT_OVER_FILE INT_MAX /* as a file: the text itself */

struct text_edit {
    size_t at, length; /* of what is replaced */
    char value[TEXT_VALUE_MAX];
};

struct text {
    struct yaml_tree tree;
    char *data; /* of the file */
    size_t length;
    size_t *line; /* where each begins */
    uint32_t lines;
    struct text_edit *edit;
    uint32_t edits, capacity;
    enum units_axis unit; /* of the axis at hand */
};

/* --- where a value stands ---------------------------------------------------- */

static size_t text_mark(const struct text *self)
{
    return self->length >= 3 && memcmp(self->data, "\xEF\xBB\xBF", 3) == 0 ? 3
                                                                           : 0;
}

static void text_find_lines(struct text *self)
{
    size_t at = text_mark(self);

    self->lines = 1;
    for (size_t i = at; i < self->length; i++)
        self->lines += self->data[i] == '\n';
    self->line = memory_new(self->lines, sizeof *self->line);
    self->line[0] = at;
    for (uint32_t n = 1; at < self->length; at++)
        if (self->data[at] == '\n')
            self->line[n++] = at + 1;
}

/* Columns are characters of UTF-8. */
static bool text_place(const struct text *self, struct plan_place place,
                       size_t *at)
{
    if (place.line < 1 || place.line > self->lines)
        return false;
    *at = self->line[place.line - 1];
    for (uint32_t column = 1; column < place.column; column++) {
        if (*at >= self->length)
            return false;
        (*at)++;
        while (*at < self->length && ((unsigned char)self->data[*at] >> 6) == 2)
            (*at)++;
    }
    return true;
}

/* A plain value, or one in quotes without escapes. */
static int text_replace(struct text *self, const struct yaml_value *value,
                        const char *by)
{
    const struct yaml_tree_node *node = yaml_value_node(value);
    const char *const was = yaml_tree_text(&self->tree, value->node);
    size_t at;

    if (node->kind != YAML_TREE_TEXT ||
        !text_place(self, yaml_tree_place(&self->tree, value->node), &at))
        return yaml_value_refuse(value, "is not a value that can be replaced");
    if (at < self->length && (self->data[at] == '"' || self->data[at] == '\''))
        at++;
    if (self->length - at < node->length ||
        memcmp(self->data + at, was, node->length) != 0)
        return yaml_value_refuse(value, "is written with an escape, which is "
                                        "not replaced");
    if (self->edits == self->capacity) {
        self->capacity = self->capacity > 0 ? 2 * self->capacity : 64;
        self->edit =
            memory_resize(self->edit, self->capacity, sizeof *self->edit);
    }
    struct text_edit *edit = &self->edit[self->edits++];
    *edit = (struct text_edit){ .at = at, .length = node->length };
    snprintf(edit->value, sizeof edit->value, "%s", by);
    return 0;
}

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
static int text_time(struct text *self, const struct yaml_value *value,
                     int64_t t_ns_q12)
{
    const int64_t ns = t_ns_q12 / MOTION_FIXED_NS_Q12;
    const uint64_t size = motion_fixed_abs(ns);
    char number[NUMBER_MAX], text[TEXT_VALUE_MAX];

    snprintf(number, sizeof number, "%s%llu.%09llu", ns < 0 ? "-" : "",
             (unsigned long long)(size / 1000000000),
             (unsigned long long)(size % 1000000000));
    text_trim(number);
    snprintf(text, sizeof text, "%s s", number);
    return text_replace(self, value, text);
}

/* Ten decimals: half a step of them is less than half a step of 2^-32. */
static int text_derivative(struct text *self, const struct yaml_value *value,
                           struct motion_real to, unsigned order)
{
    char number[NUMBER_MAX], unit[NUMBER_UNIT_MAX], text[TEXT_VALUE_MAX];
    int64_t q32;

    if (motion_real_round(to, 32, &q32) < 0)
        return yaml_value_refuse(value,
                                 "would not fit the range of its format");
    number_fixed(number, q32, 32, 10);
    text_trim(number);
    snprintf(text, sizeof text, "%s %s", number,
             number_unit(unit, self->unit, order));
    return text_replace(self, value, text);
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

static int text_key(struct text *self, const struct yaml_value *value,
                    const struct plan_axis *was, const struct plan_axis *is,
                    uint32_t i)
{
    const struct motion_key *from = &was->key[i].key, *to = &is->key[i].key;
    struct yaml_value field;
    int err = 0;

    if (from->t_ns_q12 != to->t_ns_q12)
        err = text_field(value, "t", 0, &field)
                  ? text_time(self, &field, to->t_ns_q12)
                  : yaml_value_refuse(value, "has no time");
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

static int text_axes(struct text *self, const struct rig *rig,
                     const struct plan_move *was, const struct plan_fit *fit)
{
    const struct yaml_value root = { &self->tree, 0, "the move", "axes" };
    struct yaml_value axes = { &self->tree, yaml_fields_find(&root, "axes"),
                               "axes", "those of the move" };
    int err = axes.node == 0 ? yaml_value_refuse(&root, "has no axes") : 0;

    for (uint32_t a = 0; a < fit->axis_count && err == 0; a++) {
        const int index = rig_axis_index(rig, was->axis[a].name);
        self->unit = rig->axis[index < 0 ? 0 : index].unit;
        err = text_axis(self, &axes, &was->axis[a], &fit->axis[a]);
    }
    return err;
}

/* --- the new text ------------------------------------------------------------- */

static int text_by_place(const void *a, const void *b)
{
    const struct text_edit *x = a, *y = b;

    return (x->at > y->at) - (x->at < y->at);
}

static void text_write(struct text *self, struct move_text *text)
{
    size_t room = self->length + 1, from = 0;

    if (self->edits > 0)
        qsort(self->edit, self->edits, sizeof *self->edit, text_by_place);
    for (uint32_t i = 0; i < self->edits; i++)
        room += strlen(self->edit[i].value);
    *text = (struct move_text){ .data = memory_new(room, 1),
                                .changed = self->edits };
    for (uint32_t i = 0; i <= self->edits; i++) {
        const size_t to = i < self->edits ? self->edit[i].at : self->length;
        const size_t more = i < self->edits ? strlen(self->edit[i].value) : 0;
        memcpy(text->data + text->length, self->data + from, to - from);
        text->length += to - from;
        if (i == self->edits)
            break;
        memcpy(text->data + text->length, self->edit[i].value, more);
        text->length += more;
        from = to + self->edit[i].length;
    }
}

int move_text_retime(const struct files *files, const char *path,
                     const struct rig *rig, const struct plan_move *was,
                     const struct plan_fit *fit, struct move_text *text,
                     char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct text self = { .data = NULL };
    int64_t length;
    int err;

    *text = (struct move_text){ .data = NULL };
    if (yaml_tree_load(files, &self.tree, &report) < 0)
        return -1;
    length = files_load(files, path, YAML_TREE_BYTES_MAX, &self.data);
    if (length < 0) {
        yaml_tree_free(&self.tree);
        return yaml_report_at(&report, (struct plan_place){ 1, 1 },
                              "the file cannot be read a second time (%s)",
                              strerror((int)-length));
    }
    self.length = (size_t)length;
    text_find_lines(&self);
    err = text_axes(&self, rig, was, fit);
    if (err == 0)
        text_write(&self, text);
    free(self.data);
    memory_free(self.line);
    memory_free(self.edit);
    yaml_tree_free(&self.tree);
    return err;
}

void move_text_free(struct move_text *text)
{
    memory_free(text->data);
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
                   .names = text_over_names },
        .below = below,
        .path = path,
        .text = text,
    };
}
