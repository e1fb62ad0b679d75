/* firmware/host/yaml/yaml_fields.h - from a tree to structs, by tables.
 *
 * A map of the file is a shape: a const table with one row per key, which says
 * whether the key must be there, what is expected of its value, and who reads
 * the value into which member.  Unknown keys (with the nearest spelling),
 * missing keys and wrong kinds of value are found here, in one place, for every
 * shape.  Values are read in the order of the table, so a row may rely on those
 * above it whatever the order in the file.
 *
 * Functions return 0, or -1 with the sentence written. */
#ifndef FIRMWARE_HOST_YAML_YAML_FIELDS_H
#define FIRMWARE_HOST_YAML_YAML_FIELDS_H

#include <stdbool.h>

#include "firmware/host/base/quote.h"
#include "firmware/host/yaml/yaml_tree.h"

/* A node and what sentences about it say. */
struct yaml_value {
    const struct yaml_tree *tree;
    uint32_t node;
    const char *name;     /* "velocity" */
    const char *expected; /* "the largest speed, such as 300 mm/s" */
};

struct yaml_field {
    const char *name;
    enum { YAML_OPTIONAL, YAML_REQUIRED } presence;
    const char *expected;
    /* Read `value` into *out, the member at `offset`; `reader` is the file
     * reader's own. */
    int (*read)(void *reader, const struct yaml_value *value, void *out);
    size_t offset;
};

struct yaml_shape {
    const char *name; /* "axis" */
    const struct yaml_field *field;
    unsigned count;
};

/* Read the map `value` into the struct at `out`. */
int yaml_fields_read(const struct yaml_value *value,
                     const struct yaml_shape *shape, void *reader, void *out);

/* Node of the value under a key of a map, 0 when it is not there. */
uint32_t yaml_fields_find(const struct yaml_value *map, const char *name);
/* Node of the key itself. */
uint32_t yaml_fields_key(const struct yaml_value *map, const char *name);

/* Read a map whose keys are names the user gave: letters, digits, - and _,
 * beginning with a letter, shorter than PLAN_NAME_MAX; 1 .. max of them.
 * `read` is called for each, in the order of the file; entry->name is the name,
 * `key` its node. */
int yaml_fields_each(const struct yaml_value *value, uint32_t max, void *reader,
                     int (*read)(void *reader, uint32_t key,
                                 const struct yaml_value *entry));

/* How many there are of those, at most max, before they are read. */
uint32_t yaml_fields_count(const struct yaml_value *value, uint32_t max);

/* "path:line:column: <name> <format>, expected <expected>". */
int yaml_value_refuse(const struct yaml_value *value, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* Refuse unless the value is of this kind. */
int yaml_value_need(const struct yaml_value *value, enum yaml_tree_kind kind);

/* The value as a text that is not empty; NULL when it is none, with the
 * sentence written. */
const char *yaml_value_text(const struct yaml_value *value);

/* Copy a text into room bytes (with the 0). */
int yaml_value_copy(const struct yaml_value *value, char *out, size_t capacity);

/* One of `count` spellings; *index is which. */
int yaml_value_choice(const struct yaml_value *value,
                      const char *const spelling[], unsigned count,
                      unsigned *index);
/* The same into a byte. */
int yaml_value_word(const struct yaml_value *value,
                    const char *const spelling[], unsigned count,
                    uint8_t *index);
/* yes or no; true and false are the same. */
int yaml_value_bool(const struct yaml_value *value, bool *out);

/* Decimal. */
int yaml_value_integer(const struct yaml_value *value, int64_t min, int64_t max,
                       int64_t *out);

/* Decimal or 0x.... */
int yaml_value_number(const struct yaml_value *value, int64_t min, int64_t max,
                      int64_t *out);

/* Rows of a shape read by them: 0 .. 2^32 - 1 into a uint32_t, yes or no into a
 * bool. */
int yaml_read_u32(void *reader, const struct yaml_value *value, void *out);
int yaml_read_bool(void *reader, const struct yaml_value *value, void *out);

/* Refuse unless the value is a list of min .. max items; *count is how many. */
int yaml_value_list(const struct yaml_value *value, uint32_t min, uint32_t max,
                    uint32_t *count);
/* A list of just two. */
int yaml_value_pair(const struct yaml_value *value, struct yaml_value item[2]);

static inline const struct yaml_tree_node *
yaml_value_node(const struct yaml_value *value)
{
    return &value->tree->node[value->node];
}

/* The value as the file has it, for sentences; empty for a list or map. */
#define YAML_QUOTE_MAX QUOTE_MAX
const char *yaml_value_quote(char quote[YAML_QUOTE_MAX],
                             const struct yaml_value *value);

/* The same sentences about another node. */
static inline struct yaml_value yaml_value_at(const struct yaml_value *value,
                                              uint32_t node)
{
    return (struct yaml_value){ value->tree, node, value->name,
                                value->expected };
}

/* The spelling nearest to a text, for "did you mean"; NULL when none is near:
 * more than two letters, or a third of it, would have to change. */
const char *yaml_nearest(const char *text, const char *const spelling[],
                         unsigned count);

#endif
