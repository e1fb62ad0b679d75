/* firmware/host/yaml/yaml_fields.c - see yaml_fields.h. */
#include "firmware/host/yaml/yaml_fields.h"

#include <errno.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Longest word compared. */
#define FIELDS_WORD_MAX 32
/* Most keys in one shape, so that a table fits in a list of spellings. */
#define FIELDS_SHAPE_MAX 32

static const char *const fields_kind_text[] = {
    [YAML_TREE_TEXT] = "a single value",
    [YAML_TREE_LIST] = "a list",
    [YAML_TREE_MAP] = "a map",
};

/* ---- refusing ---- */

int yaml_value_refuse(const struct yaml_value *value, const char *format, ...)
{
    char what[256];
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(what, sizeof(what), format, arguments);
    va_end(arguments);
    return yaml_report_at(
        &value->tree->report, yaml_tree_place(value->tree, value->node),
        "%s %s, expected %s", value->name, what, value->expected);
}

int yaml_value_need(const struct yaml_value *value, enum yaml_tree_kind kind)
{
    const struct yaml_tree_node *node = yaml_value_node(value);

    if (node->kind == kind)
        return 0;
    if (node->kind == YAML_TREE_TEXT && node->length == 0)
        return yaml_value_refuse(value, "has no value");
    return yaml_value_refuse(value, "is %s", fields_kind_text[node->kind]);
}

const char *yaml_value_quote(char quote[YAML_QUOTE_MAX],
                             const struct yaml_value *value)
{
    const struct yaml_tree_node *node = yaml_value_node(value);

    if (node->kind != YAML_TREE_TEXT)
        return quote_text(quote, "", 0);
    return quote_text(quote, yaml_tree_text(value->tree, value->node),
                      node->length);
}

/* ---- spellings ---- */

static unsigned fields_smaller(unsigned a, unsigned b)
{
    return a < b ? a : b;
}

/* Letters to insert, drop or change to get from a to b (Levenshtein); both at
 * most FIELDS_WORD_MAX long. */
static unsigned fields_distance(const char *a, const char *b)
{
    const size_t b_length = strlen(b);
    unsigned row[FIELDS_WORD_MAX + 1];

    for (unsigned j = 0; j <= b_length; j++)
        row[j] = j;
    for (unsigned i = 0; a[i] != 0; i++) {
        unsigned diagonal = row[0];
        row[0] = i + 1;
        for (size_t j = 0; j < b_length; j++) {
            const unsigned change = diagonal + (a[i] != b[j]);
            diagonal = row[j + 1];
            row[j + 1] =
                fields_smaller(change, fields_smaller(diagonal, row[j]) + 1);
        }
    }
    return row[b_length];
}

const char *yaml_nearest(const char *text, const char *const spelling[],
                         unsigned count)
{
    const size_t length = strlen(text);
    unsigned best = fields_smaller((unsigned)length / 3 + 1, 3);
    const char *nearest = NULL;

    if (length > FIELDS_WORD_MAX)
        return NULL;
    for (unsigned i = 0; i < count; i++) {
        const unsigned distance = strlen(spelling[i]) > FIELDS_WORD_MAX
                                      ? best
                                      : fields_distance(text, spelling[i]);
        if (distance < best) {
            best = distance;
            nearest = spelling[i];
        }
    }
    return nearest;
}

/* "unknown key 'foo', expected a, b or c (did you mean 'fo'?)" */
static int fields_unknown(const struct yaml_tree *tree, uint32_t node,
                          const char *what, const char *const spelling[],
                          unsigned count)
{
    char quote[QUOTE_MAX], list[QUOTE_LIST_MAX], mean[64] = "";
    const char *text = yaml_tree_text(tree, node);
    const char *nearest = yaml_nearest(text, spelling, count);

    if (nearest != NULL && count > 1)
        snprintf(mean, sizeof(mean), " (did you mean '%.32s'?)", nearest);
    return yaml_report_at(&tree->report, yaml_tree_place(tree, node),
                          "unknown %s %s, expected %s%s", what,
                          quote_text(quote, text, tree->node[node].length),
                          quote_list(list, spelling, count), mean);
}

/* ---- shapes ---- */

static unsigned fields_names(const struct yaml_shape *shape,
                             const char *names[FIELDS_SHAPE_MAX])
{
    unsigned count = 0;
    while (count < shape->count && count < FIELDS_SHAPE_MAX) {
        names[count] = shape->field[count].name;
        count++;
    }
    return count;
}

static bool fields_has(const struct yaml_shape *shape, const char *name)
{
    for (unsigned i = 0; i < shape->count; i++)
        if (strcmp(shape->field[i].name, name) == 0)
            return true;
    return false;
}

static int fields_check_unknown(const struct yaml_value *map,
                                const struct yaml_shape *shape)
{
    const struct yaml_tree *tree = map->tree;
    const char *names[FIELDS_SHAPE_MAX];

    for (uint32_t key = yaml_value_node(map)->first; key != 0;
         key = tree->node[tree->node[key].next].next) {
        if (!fields_has(shape, yaml_tree_text(tree, key)))
            return fields_unknown(tree, key, "key", names,
                                  fields_names(shape, names));
    }
    return 0;
}

uint32_t yaml_fields_key(const struct yaml_value *map, const char *name)
{
    const struct yaml_tree *tree = map->tree;
    uint32_t key = yaml_value_node(map)->first;

    while (key != 0 && strcmp(yaml_tree_text(tree, key), name) != 0)
        key = tree->node[tree->node[key].next].next;
    return key;
}

uint32_t yaml_fields_find(const struct yaml_value *map, const char *name)
{
    const uint32_t key = yaml_fields_key(map, name);

    return key != 0 ? map->tree->node[key].next : 0;
}

static int fields_missing(const struct yaml_value *map,
                          const struct yaml_field *field)
{
    return yaml_report_at(&map->tree->report,
                          yaml_tree_place(map->tree, map->node),
                          "%s has no '%s', expected %s: %s", map->name,
                          field->name, field->name, field->expected);
}

int yaml_fields_read(const struct yaml_value *value,
                     const struct yaml_shape *shape, void *reader, void *out)
{
    if (yaml_value_need(value, YAML_TREE_MAP) < 0 ||
        fields_check_unknown(value, shape) < 0)
        return -1;
    for (unsigned i = 0; i < shape->count; i++) {
        const struct yaml_field *field = &shape->field[i];
        const struct yaml_value found = { value->tree,
                                          yaml_fields_find(value, field->name),
                                          field->name, field->expected };
        if (found.node == 0 && field->presence == YAML_REQUIRED)
            return fields_missing(value, field);
        if (found.node != 0 &&
            field->read(reader, &found, (char *)out + field->offset) < 0)
            return -1;
    }
    return 0;
}

/* ---- names ---- */

#define FIELDS_NAME_LETTERS                                                    \
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-"

static bool fields_is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

static bool fields_is_name(const char *text)
{
    const size_t length = strlen(text);

    return length < PLAN_NAME_MAX && fields_is_letter(text[0]) &&
           strspn(text, FIELDS_NAME_LETTERS) == length;
}

static int fields_bad_name(const struct yaml_value *map, uint32_t key)
{
    char quote[QUOTE_MAX];
    return yaml_report_at(&map->tree->report, yaml_tree_place(map->tree, key),
                          "%s is not a name, expected at most %d letters, "
                          "digits, - or _, beginning with a letter",
                          quote_text(quote, yaml_tree_text(map->tree, key),
                                     map->tree->node[key].length),
                          PLAN_NAME_MAX - 1);
}

uint32_t yaml_fields_count(const struct yaml_value *value, uint32_t max)
{
    const uint32_t length = yaml_value_node(value)->length;
    return length < max ? length : max;
}

int yaml_fields_each(const struct yaml_value *value, uint32_t max, void *reader,
                     int (*read)(void *reader, uint32_t key,
                                 const struct yaml_value *entry))
{
    const struct yaml_tree *tree = value->tree;

    if (yaml_value_need(value, YAML_TREE_MAP) < 0)
        return -1;
    if (yaml_value_node(value)->length == 0)
        return yaml_value_refuse(value, "is empty");
    if (yaml_value_node(value)->length > max)
        return yaml_value_refuse(value, "has more than %lu entries",
                                 (unsigned long)max);
    for (uint32_t key = yaml_value_node(value)->first; key != 0;
         key = tree->node[tree->node[key].next].next) {
        const struct yaml_value entry = { tree, tree->node[key].next,
                                          yaml_tree_text(tree, key),
                                          value->expected };
        if (!fields_is_name(entry.name))
            return fields_bad_name(value, key);
        if (read(reader, key, &entry) < 0)
            return -1;
    }
    return 0;
}

/* ---- values ---- */

const char *yaml_value_text(const struct yaml_value *value)
{
    if (yaml_value_need(value, YAML_TREE_TEXT) < 0)
        return NULL;
    if (yaml_value_node(value)->length == 0) {
        yaml_value_refuse(value, "has no value");
        return NULL;
    }
    return yaml_tree_text(value->tree, value->node);
}

int yaml_value_copy(const struct yaml_value *value, char *out, size_t capacity)
{
    const char *text = yaml_value_text(value);

    if (text == NULL)
        return -1;
    if (strlen(text) >= capacity)
        return yaml_value_refuse(value, "is longer than %zu bytes",
                                 capacity - 1);
    memcpy(out, text, strlen(text) + 1);
    return 0;
}

int yaml_value_choice(const struct yaml_value *value,
                      const char *const spelling[], unsigned count,
                      unsigned *index)
{
    const char *text = yaml_value_text(value);

    if (text == NULL)
        return -1;
    for (*index = 0; *index < count; ++*index)
        if (strcmp(text, spelling[*index]) == 0)
            return 0;
    return fields_unknown(value->tree, value->node, value->name, spelling,
                          count);
}

int yaml_value_bool(const struct yaml_value *value, bool *out)
{
    static const char *const words[] = { "yes", "no", "true", "false" };
    unsigned index;

    if (yaml_value_choice(value, words, 4, &index) < 0)
        return -1;
    *out = index % 2 == 0;
    return 0;
}

int yaml_value_word(const struct yaml_value *value,
                    const char *const spelling[], unsigned count,
                    uint8_t *index)
{
    unsigned which;

    if (yaml_value_choice(value, spelling, count, &which) < 0)
        return -1;
    *index = (uint8_t)which;
    return 0;
}

/* A whole number in digits of `base`, 16 with or without 0x, min .. max. */
static int yaml_value_digits(const struct yaml_value *value, int base,
                             int64_t min, int64_t max, int64_t *out)
{
    char quote[YAML_QUOTE_MAX], *end;
    const char *text = yaml_value_text(value);
    long long number;

    if (text == NULL)
        return -1;
    yaml_value_quote(quote, value);
    errno = 0;
    number = strtoll(text, &end, base);
    if (end == text || *end != 0)
        return yaml_value_refuse(value, "%s is not a whole number", quote);
    if (errno == ERANGE || number < min || number > max)
        return yaml_value_refuse(value, "%s is not in %" PRId64 " .. %" PRId64,
                                 quote, min, max);
    *out = number;
    return 0;
}

int yaml_value_integer(const struct yaml_value *value, int64_t min, int64_t max,
                       int64_t *out)
{
    return yaml_value_digits(value, 10, min, max, out);
}

int yaml_value_number(const struct yaml_value *value, int64_t min, int64_t max,
                      int64_t *out)
{
    const char *text = yaml_value_text(value);
    const bool hex = text != NULL && strncasecmp(text, "0x", 2) == 0;

    return yaml_value_digits(value, hex ? 16 : 10, min, max, out);
}

int yaml_read_u32(void *reader, const struct yaml_value *value, void *out)
{
    int64_t number = 0;

    (void)reader;
    if (yaml_value_integer(value, 0, UINT32_MAX, &number) < 0)
        return -1;
    *(uint32_t *)out = (uint32_t)number;
    return 0;
}

int yaml_read_bool(void *reader, const struct yaml_value *value, void *out)
{
    (void)reader;
    return yaml_value_bool(value, out);
}

int yaml_value_list(const struct yaml_value *value, uint32_t min, uint32_t max,
                    uint32_t *count)
{
    if (yaml_value_need(value, YAML_TREE_LIST) < 0)
        return -1;
    *count = yaml_value_node(value)->length;
    if (*count >= min && *count <= max)
        return 0;
    return yaml_value_refuse(value, "has %lu item%s", (unsigned long)*count,
                             *count == 1 ? "" : "s");
}

int yaml_value_pair(const struct yaml_value *value, struct yaml_value item[2])
{
    uint32_t count;

    if (yaml_value_list(value, 2, 2, &count) < 0)
        return -1;
    item[0] = yaml_value_at(value, yaml_value_node(value)->first);
    item[1] = yaml_value_at(value, yaml_value_node(&item[0])->next);
    return 0;
}
