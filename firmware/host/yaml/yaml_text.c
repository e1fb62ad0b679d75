/* firmware/host/yaml/yaml_text.c - see yaml_text.h. */
#include "firmware/host/yaml/yaml_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"

static size_t text_mark(const struct yaml_text *self)
{
    return self->length >= 3 && memcmp(self->data, "\xEF\xBB\xBF", 3) == 0 ? 3
                                                                           : 0;
}

static void text_find_lines(struct yaml_text *self)
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

int yaml_text_open(struct yaml_text *self, const struct files *files,
                   const struct yaml_report *report)
{
    int64_t length;

    *self = (struct yaml_text){ .data = NULL };
    if (yaml_tree_load(files, &self->tree, report) < 0)
        return -1;
    length = files_load(files, report->path, YAML_TREE_BYTES_MAX, &self->data);
    if (length < 0)
        return yaml_report_at(report, (struct plan_place){ 1, 1 },
                              "the file cannot be read a second time (%s)",
                              strerror((int)-length));
    self->length = (size_t)length;
    text_find_lines(self);
    return 0;
}

void yaml_text_close(struct yaml_text *self)
{
    free(self->data);
    memory_free(self->line);
    memory_free(self->edit);
    yaml_tree_free(&self->tree);
    *self = (struct yaml_text){ .data = NULL };
}

/* Columns are characters of UTF-8. */
bool yaml_text_place(const struct yaml_text *self, struct plan_place place,
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

static struct yaml_text_edit *text_edit(struct yaml_text *self)
{
    if (self->edits == self->capacity) {
        self->capacity = self->capacity > 0 ? 2 * self->capacity : 64;
        self->edit =
            memory_resize(self->edit, self->capacity, sizeof *self->edit);
    }
    self->edit[self->edits].order = self->edits;
    return &self->edit[self->edits++];
}

int yaml_text_put(struct yaml_text *self, size_t at, size_t length,
                  const struct yaml_value *value, const char *by)
{
    struct yaml_text_edit *edit;

    if (strlen(by) >= sizeof edit->is)
        return yaml_value_refuse(value,
                                 "would have a value of more than %d "
                                 "characters",
                                 YAML_TEXT_VALUE_MAX - 1);
    edit = text_edit(self);
    const uint32_t order = edit->order;
    *edit = (struct yaml_text_edit){ .at = at,
                                     .length = length,
                                     .line = yaml_value_node(value)->line,
                                     .order = order,
                                     .what = value->name };
    snprintf(edit->was, sizeof edit->was, "%.*s",
             (int)(length < sizeof edit->was ? length : sizeof edit->was - 1),
             self->data + at);
    snprintf(edit->is, sizeof edit->is, "%s", by);
    return 0;
}

/* A plain value, or one in quotes without escapes. */
int yaml_text_replace(struct yaml_text *self, const struct yaml_value *value,
                      const char *by)
{
    const struct yaml_tree_node *node = yaml_value_node(value);
    const char *const was = yaml_tree_text(&self->tree, value->node);
    size_t at;

    if (node->kind != YAML_TREE_TEXT ||
        !yaml_text_place(self, yaml_tree_place(&self->tree, value->node), &at))
        return yaml_value_refuse(value, "is not a value that can be replaced");
    if (at < self->length && (self->data[at] == '"' || self->data[at] == '\''))
        at++;
    if (self->length - at < node->length ||
        memcmp(self->data + at, was, node->length) != 0)
        return yaml_value_refuse(value, "is written with an escape, which is "
                                        "not replaced");
    return yaml_text_put(self, at, node->length, value, by);
}

/* The end of the line before, with which others of the file end, too. */
const char *yaml_text_newline(const struct yaml_text *self)
{
    return self->lines > 1 && self->line[1] >= 2 &&
                   self->data[self->line[1] - 2] == '\r'
               ? "\r\n"
               : "\n";
}

int yaml_text_insert(struct yaml_text *self, const struct yaml_value *map,
                     const char *name, const char *value, uint32_t before)
{
    const uint32_t key = before != 0 ? before : yaml_value_node(map)->first;
    size_t open, at;

    if (yaml_value_need(map, YAML_TREE_MAP) < 0)
        return -1;
    if (key == 0 ||
        !yaml_text_place(self, yaml_tree_place(&self->tree, map->node),
                         &open) ||
        !yaml_text_place(self, yaml_tree_place(&self->tree, key), &at))
        return yaml_value_refuse(map, "has no place for %s", name);
    const bool flow = open < self->length && self->data[open] == '{';
    const uint32_t line = self->tree.node[key].line;
    struct yaml_text_edit *edit = text_edit(self);
    const uint32_t order = edit->order;
    *edit = (struct yaml_text_edit){
        .at = at, .line = line, .order = order, .what = name
    };
    const int indent = flow ? 0 : (int)(at - self->line[line - 1]);
    snprintf(edit->is, sizeof edit->is, "%s: %s%s%*s", name, value,
             flow ? ", " : yaml_text_newline(self), indent, "");
    return 0;
}

static int text_by_place(const void *a, const void *b)
{
    const struct yaml_text_edit *x = a, *y = b;

    if (x->at != y->at)
        return x->at < y->at ? -1 : 1;
    if ((x->length == 0) != (y->length == 0))
        return x->length == 0 ? -1 : 1;
    return (x->order > y->order) - (x->order < y->order);
}

char *yaml_text_make(struct yaml_text *self, size_t *length)
{
    size_t capacity = self->length + 1, from = 0;
    char *data;

    if (self->edits > 0)
        qsort(self->edit, self->edits, sizeof *self->edit, text_by_place);
    for (uint32_t i = 0; i < self->edits; i++)
        capacity += strlen(self->edit[i].is);
    data = memory_new(capacity, 1);
    *length = 0;
    for (uint32_t i = 0; i <= self->edits; i++) {
        const bool end = i == self->edits;
        const size_t to = end ? self->length : self->edit[i].at;
        const size_t more = end ? 0 : strlen(self->edit[i].is);
        memcpy(data + *length, self->data + from, to - from);
        *length += to - from;
        if (end)
            break;
        memcpy(data + *length, self->edit[i].is, more);
        *length += more;
        from = to + self->edit[i].length;
    }
    return data;
}
