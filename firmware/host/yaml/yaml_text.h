/* firmware/host/yaml/yaml_text.h - values replaced in the text of a YAML file.
 *
 * The text is the document: what changes is replaced where it stands; comments,
 * order and layout stay as they are.  The tree says where a value stands by line
 * and column; the text there is the value itself, unless it has an escape, which
 * is refused. */
#ifndef FIRMWARE_HOST_YAML_YAML_TEXT_H
#define FIRMWARE_HOST_YAML_YAML_TEXT_H

#include <stdbool.h>

#include "firmware/host/yaml/yaml_fields.h"

#define YAML_TEXT_VALUE_MAX 192

/* In the order in which they were asked for. */
struct yaml_text_edit {
    size_t at, length; /* of what is replaced, in the old text */
    uint32_t line;     /* of it */
    uint32_t order;    /* of those at one place */
    const char *what;  /* its name; not owned */
    char was[YAML_TEXT_VALUE_MAX], is[YAML_TEXT_VALUE_MAX];
};

struct yaml_text {
    struct yaml_tree tree;
    char *data; /* of the file */
    size_t length;
    size_t *line; /* where each begins */
    uint32_t lines;
    struct yaml_text_edit *edit; /* on the heap */
    uint32_t edits, capacity;
};

/* Read a file.  0, or -1 with the sentence written; yaml_text_close in either
 * case. */
int yaml_text_open(struct yaml_text *self, const struct files *files,
                   const struct yaml_report *report);
void yaml_text_close(struct yaml_text *self);

/* A value by another, on one line: 0, or -1 with the sentence written. */
int yaml_text_replace(struct yaml_text *self, const struct yaml_value *value,
                      const char *by);

/* The place of a line and a column as an offset; false where there is none. */
bool yaml_text_place(const struct yaml_text *self, struct plan_place place,
                     size_t *at);
/* What the lines of the file end with. */
const char *yaml_text_newline(const struct yaml_text *self);
/* `length` bytes at `at` by a text; the sentence is about `value`. */
int yaml_text_put(struct yaml_text *self, size_t at, size_t length,
                  const struct yaml_value *value, const char *by);

/* `name: value` as a new entry of a map, before the entry whose key is the node
 * `before` (0: the first). */
int yaml_text_insert(struct yaml_text *self, const struct yaml_value *map,
                     const char *name, const char *value, uint32_t before);

/* The new text, with a 0 after it, on the heap. */
char *yaml_text_make(struct yaml_text *self, size_t *length);

#endif
