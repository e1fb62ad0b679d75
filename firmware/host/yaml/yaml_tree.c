/* firmware/host/yaml/yaml_tree.c - see yaml_tree.h.
 *
 *   file -> bytes (bounded) -> yaml_scan -> libyaml's events -> nodes
 *
 * Nodes are appended in the order of the file; the maps and lists that are
 * still open are a stack of at most YAML_TREE_DEPTH_MAX. */
#include "firmware/host/yaml/yaml_tree.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/yaml/yaml_scan.h"

static const struct plan_place tree_start = { 1, 1 };

/* Double `*array` of `size` byte elements until `wanted` fit. */
static int tree_grow(void **array, size_t *capacity, size_t wanted, size_t size)
{
    size_t more = *capacity > 0 ? *capacity : 256;
    void *larger;

    if (wanted <= *capacity)
        return 0;
    while (more < wanted)
        more *= 2;
    larger = realloc(*array, more * size);
    if (larger == NULL)
        return -1;
    *array = larger;
    *capacity = more;
    return 0;
}

int64_t yaml_tree_read(const struct files *files,
                       const struct yaml_report *report, char **data)
{
    const int64_t length =
        files_load(files, report->path, YAML_TREE_BYTES_MAX, data);

    if (length == -EFBIG)
        return yaml_report_at(report, tree_start,
                              "the file is larger than 16 MiB, expected a rig "
                              "or a move of at most that");
    if (length < 0)
        return yaml_report_at(
            report, tree_start,
            "the file cannot be read (%s), expected a YAML file",
            files_error((int)length));
    return length;
}

/* Length of the byte order mark that some editors put first. */
static size_t tree_mark_length(const char *data)
{
    return strncmp(data, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
}

/* ---- nodes ---- */

struct tree_builder {
    struct yaml_tree *tree;
    struct {
        uint32_t node;
        uint32_t last; /* its newest child, 0: none yet */
        bool is_value; /* map: the next node is a value, not a key */
    } open[YAML_TREE_DEPTH_MAX];
    unsigned depth;
    const char *text;
    bool is_over; /* nothing but --- follows */
};

static struct plan_place tree_mark_place(const yaml_mark_t *mark)
{
    return (struct plan_place){ (uint32_t)mark->line + 1,
                                (uint32_t)mark->column + 1 };
}

static int tree_no_memory(const struct yaml_tree *tree, struct plan_place place)
{
    return yaml_report_at(&tree->report, place,
                          "no memory left for what is here, expected a "
                          "smaller file");
}

static int tree_grow_nodes(struct yaml_tree *tree)
{
    void *array = tree->node;
    size_t capacity = tree->node_capacity;

    if (tree_grow(&array, &capacity, (size_t)tree->node_count + 1,
                  sizeof(tree->node[0])) < 0)
        return -1;
    tree->node = array;
    tree->node_capacity = (uint32_t)capacity;
    return 0;
}

/* Copy a value's text; its offset, or -1. */
static int64_t tree_put_text(struct yaml_tree *tree, const char *text,
                             size_t length)
{
    const size_t start = tree->text_length;
    void *array = tree->text;

    if (tree_grow(&array, &tree->text_capacity, start + length + 1, 1) < 0)
        return -1;
    tree->text = array;
    memcpy(tree->text + start, text, length);
    tree->text[start + length] = 0;
    tree->text_length = start + length + 1;
    return (int64_t)start;
}

/* Hang a node under the innermost open one. */
static void tree_link(struct tree_builder *builder, uint32_t node)
{
    struct yaml_tree_node *nodes = builder->tree->node;
    uint32_t parent, last;

    if (builder->depth == 0)
        return;
    parent = builder->open[builder->depth - 1].node;
    last = builder->open[builder->depth - 1].last;
    if (last == 0)
        nodes[parent].first = node;
    else
        nodes[last].next = node;
    builder->open[builder->depth - 1].last = node;
}

static int tree_add_node(struct tree_builder *builder, struct plan_place place,
                         enum yaml_tree_kind kind)
{
    struct yaml_tree *tree = builder->tree;

    if (tree->node_count == YAML_TREE_NODES_MAX)
        return yaml_report_at(&tree->report, place,
                              "more than %d values up to here, expected a "
                              "smaller file",
                              YAML_TREE_NODES_MAX);
    if (tree_grow_nodes(tree) < 0)
        return tree_no_memory(tree, place);
    tree->node[tree->node_count] = (struct yaml_tree_node){
        .line = place.line, .column = place.column, .kind = (uint8_t)kind
    };
    tree_link(builder, tree->node_count);
    tree->node_count++;
    return 0;
}

/* ---- maps ---- */

static bool tree_same_text(const struct yaml_tree *tree, uint32_t a, uint32_t b)
{
    return tree->node[a].length == tree->node[b].length &&
           memcmp(yaml_tree_text(tree, a), yaml_tree_text(tree, b),
                  tree->node[a].length) == 0;
}

static int tree_check_twice(const struct yaml_tree *tree, uint32_t map,
                            uint32_t key)
{
    char quote[QUOTE_MAX];

    for (uint32_t other = tree->node[map].first; other != key;
         other = tree->node[tree->node[other].next].next)
        if (tree_same_text(tree, other, key))
            return yaml_report_at(
                &tree->report, yaml_tree_place(tree, key),
                "key %s is already there in line %lu, expected it once",
                quote_text(quote, yaml_tree_text(tree, key),
                           tree->node[key].length),
                (unsigned long)tree->node[other].line);
    return 0;
}

/* The newest node is a key of `map`: may it be there? */
static int tree_check_key(const struct yaml_tree *tree, uint32_t map)
{
    const uint32_t key = tree->node_count - 1;
    const struct plan_place place = yaml_tree_place(tree, key);

    if (tree->node[key].kind != YAML_TREE_TEXT)
        return yaml_report_at(&tree->report, place,
                              "a list or a map as a key, expected a name");
    if (strcmp(yaml_tree_text(tree, key), "<<") == 0)
        return yaml_report_at(&tree->report, place,
                              "merge keys (<<) are not read, expected the keys "
                              "themselves");
    if (tree->node[map].length > YAML_TREE_KEYS_MAX)
        return yaml_report_at(&tree->report, place,
                              "more than %d keys in one map, expected fewer",
                              YAML_TREE_KEYS_MAX);
    return tree_check_twice(tree, map, key);
}

/* Count the newest node in its parent. */
static int tree_count_child(struct tree_builder *builder)
{
    const unsigned top = builder->depth - 1;
    struct yaml_tree_node *parent;

    if (builder->depth == 0)
        return 0;
    parent = &builder->tree->node[builder->open[top].node];
    if (parent->kind == YAML_TREE_LIST || !builder->open[top].is_value)
        parent->length++;
    if (parent->kind == YAML_TREE_LIST)
        return 0;
    builder->open[top].is_value = !builder->open[top].is_value;
    return builder->open[top].is_value
               ? tree_check_key(builder->tree, builder->open[top].node)
               : 0;
}

/* ---- events ---- */

static int tree_refuse_anchor(const struct yaml_tree *tree,
                              struct plan_place place, const char *what,
                              const yaml_char_t *name)
{
    char quote[QUOTE_MAX];
    return yaml_report_at(
        &tree->report, place, "%s %s is not read, expected the value itself",
        what,
        quote_text(quote, (const char *)name, strlen((const char *)name)));
}

static int tree_check_decoration(const struct yaml_tree *tree,
                                 struct plan_place place,
                                 const yaml_char_t *anchor,
                                 const yaml_char_t *tag)
{
    if (anchor != NULL)
        return tree_refuse_anchor(tree, place, "anchor", anchor);
    if (tag != NULL)
        return yaml_report_at(&tree->report, place,
                              "tags (!) are not read, expected the value "
                              "itself");
    return 0;
}

static int tree_open(struct tree_builder *builder, struct plan_place place,
                     enum yaml_tree_kind kind, const yaml_char_t *anchor,
                     const yaml_char_t *tag)
{
    if (tree_check_decoration(builder->tree, place, anchor, tag) < 0)
        return -1;
    if (builder->depth == YAML_TREE_DEPTH_MAX)
        return yaml_report_at(&builder->tree->report, place,
                              "maps and lists are nested more than %d deep, "
                              "expected fewer",
                              YAML_TREE_DEPTH_MAX);
    if (tree_add_node(builder, place, kind) < 0 ||
        tree_count_child(builder) < 0)
        return -1;
    builder->open[builder->depth].node = builder->tree->node_count - 1;
    builder->open[builder->depth].last = 0;
    builder->open[builder->depth].is_value = false;
    builder->depth++;
    return 0;
}

/* Escapes in double quotes can make characters that the scan did not see. */
static int tree_check_text(const struct yaml_tree *tree,
                           struct plan_place place, const char *text,
                           size_t length)
{
    uint32_t character = 0;

    for (size_t i = 0; i < length;) {
        const unsigned count = quote_utf8_decode(
            (const unsigned char *)text + i, length - i, &character);
        if (count == 0 || !quote_is_printable(character))
            return yaml_report_at(&tree->report, place,
                                  "the value holds the character U+%04lX, "
                                  "expected printable text on one line",
                                  (unsigned long)character);
        i += count;
    }
    return 0;
}

static int tree_on_scalar(struct tree_builder *builder,
                          const yaml_event_t *event, struct plan_place place)
{
    struct yaml_tree *tree = builder->tree;
    const char *text = (const char *)event->data.scalar.value;
    const size_t length = event->data.scalar.length;
    int64_t offset;

    if (tree_check_decoration(tree, place, event->data.scalar.anchor,
                              event->data.scalar.tag) < 0 ||
        tree_check_text(tree, place, text, length) < 0 ||
        tree_add_node(builder, place, YAML_TREE_TEXT) < 0)
        return -1;
    offset = tree_put_text(tree, text, length);
    if (offset < 0)
        return tree_no_memory(tree, place);
    tree->node[tree->node_count - 1].text = (uint32_t)offset;
    tree->node[tree->node_count - 1].length = (uint32_t)length;
    return tree_count_child(builder);
}

static int tree_on_map(struct tree_builder *builder, const yaml_event_t *event,
                       struct plan_place place)
{
    return tree_open(builder, place, YAML_TREE_MAP,
                     event->data.mapping_start.anchor,
                     event->data.mapping_start.tag);
}

static int tree_on_list(struct tree_builder *builder, const yaml_event_t *event,
                        struct plan_place place)
{
    return tree_open(builder, place, YAML_TREE_LIST,
                     event->data.sequence_start.anchor,
                     event->data.sequence_start.tag);
}

static int tree_on_close(struct tree_builder *builder,
                         const yaml_event_t *event, struct plan_place place)
{
    (void)event;
    (void)place;
    builder->depth--;
    return 0;
}

static int tree_on_alias(struct tree_builder *builder,
                         const yaml_event_t *event, struct plan_place place)
{
    return tree_refuse_anchor(builder->tree, place, "alias",
                              event->data.alias.anchor);
}

/* From this line on there is nothing but comments and marks between documents,
 * as where each message of a stream ends with ---. */
static bool tree_is_over(const char *text, uint32_t line)
{
    while (--line > 0 && strchr(text, '\n') != NULL)
        text = strchr(text, '\n') + 1;
    while (*text != 0) {
        const size_t length = strcspn(text, "\r\n");
        const char *at = text + strspn(text, " \t");
        const bool is_mark =
            strncmp(text, "---", 3) == 0 || strncmp(text, "...", 3) == 0;
        if (is_mark)
            at = text + 3 + strspn(text + 3, " \t");
        if (at < text + length && *at != '#')
            return false;
        text += length + strspn(text + length, "\r\n");
    }
    return true;
}

static int tree_on_document(struct tree_builder *builder,
                            const yaml_event_t *event, struct plan_place place)
{
    (void)event;
    if (builder->tree->node_count == 0)
        return 0;
    builder->is_over = tree_is_over(builder->text, place.line);
    if (builder->is_over)
        return 0;
    return yaml_report_at(&builder->tree->report, place,
                          "a second document starts here, expected one");
}

/* Events that are not here need nothing done. */
static int (*const tree_on_event[])(struct tree_builder *builder,
                                    const yaml_event_t *event,
                                    struct plan_place place) = {
    [YAML_DOCUMENT_START_EVENT] = tree_on_document,
    [YAML_ALIAS_EVENT] = tree_on_alias,
    [YAML_SCALAR_EVENT] = tree_on_scalar,
    [YAML_SEQUENCE_START_EVENT] = tree_on_list,
    [YAML_SEQUENCE_END_EVENT] = tree_on_close,
    [YAML_MAPPING_START_EVENT] = tree_on_map,
    [YAML_MAPPING_END_EVENT] = tree_on_close,
};

/* ---- the library's own errors ---- */

/* What it says, what we say.  Where to look: at the place it gives, or where
 * the thing that is not right began; or the first, naming the second's line. */
static const struct tree_problem {
    const char *problem, *sentence;
    enum { TREE_HERE, TREE_BEGIN, TREE_HERE_AND_BEGIN } where;
} tree_problems[] = {
    { "could not find expected ':'",
      "no ':' after the key, expected 'key: value'", TREE_BEGIN },
    { "did not find expected key",
      "this does not line up with the keys above, expected another key or less "
      "indentation",
      TREE_HERE },
    { "did not find expected '-' indicator",
      "this does not line up with the list above, expected '- ' or less "
      "indentation",
      TREE_HERE },
    { "mapping values are not allowed in this context",
      "':' where no key can be, expected one 'key: value' per line, or quotes "
      "around the value",
      TREE_HERE },
    { "block sequence entries are not allowed in this context",
      "'- ' where no list can be, expected the list on lines of its own",
      TREE_HERE },
    { "did not find expected ',' or ']'",
      "the list is not closed before this, expected ',' or ']'",
      TREE_HERE_AND_BEGIN },
    { "did not find expected ',' or '}'",
      "the map is not closed before this, expected ',' or '}'",
      TREE_HERE_AND_BEGIN },
    { "found unexpected end of stream",
      "the quotation is not closed, expected the quotation mark that ends it",
      TREE_BEGIN },
    { "found unknown escape character",
      "unknown escape after '\\', expected \\\\ or single quotes", TREE_HERE },
    { "found character that cannot start any token",
      "no value can start with this character, expected quotes around it",
      TREE_HERE },
    { "found undefined tag handle",
      "tags are not read, expected the value itself", TREE_HERE },
    { "did not find expected <document start>",
      "this is outside of what the file began with, expected 'key: value' "
      "lines at the left edge",
      TREE_HERE },
    { "did not find expected node content", "nothing here, expected a value",
      TREE_HERE },
};

static int tree_say_problem(const struct yaml_tree *tree,
                            const yaml_parser_t *parser,
                            const struct tree_problem *problem)
{
    const bool has_begin = parser->context != NULL;
    const struct plan_place here = tree_mark_place(&parser->problem_mark);
    const struct plan_place begin = tree_mark_place(&parser->context_mark);

    if (problem->where == TREE_HERE_AND_BEGIN && has_begin)
        return yaml_report_at(&tree->report, here, "%s (it begins in line %lu)",
                              problem->sentence, (unsigned long)begin.line);
    return yaml_report_at(
        &tree->report, problem->where == TREE_BEGIN && has_begin ? begin : here,
        "%s", problem->sentence);
}

static int tree_library_error(const struct yaml_tree *tree,
                              const yaml_parser_t *parser)
{
    const char *problem = parser->problem != NULL ? parser->problem : "";

    if (parser->error == YAML_MEMORY_ERROR)
        return tree_no_memory(tree, tree_mark_place(&parser->mark));
    for (size_t i = 0; i < ARRAY_LEN(tree_problems); i++)
        if (strcmp(problem, tree_problems[i].problem) == 0)
            return tree_say_problem(tree, parser, &tree_problems[i]);
    return yaml_report_at(&tree->report, tree_mark_place(&parser->problem_mark),
                          "not YAML (%s), expected 'key: value' lines",
                          problem);
}

/* One event.  1: go on, 0: the end, -1: refused. */
static int tree_step(struct tree_builder *builder, yaml_parser_t *parser)
{
    yaml_event_t event;
    int result = 0;

    if (!yaml_parser_parse(parser, &event))
        return tree_library_error(builder->tree, parser);
    if ((size_t)event.type < ARRAY_LEN(tree_on_event) &&
        tree_on_event[event.type] != NULL)
        result = tree_on_event[event.type](builder, &event,
                                           tree_mark_place(&event.start_mark));
    if (result == 0)
        result = event.type != YAML_STREAM_END_EVENT;
    yaml_event_delete(&event);
    return result;
}

static int tree_build(struct yaml_tree *tree, const char *text, size_t length)
{
    struct tree_builder builder = { .tree = tree, .text = text };
    yaml_parser_t parser;
    int result;

    if (!yaml_parser_initialize(&parser))
        return tree_no_memory(tree, tree_start);
    yaml_parser_set_encoding(&parser, YAML_UTF8_ENCODING);
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, length);
    do
        result = tree_step(&builder, &parser);
    while (result == 1 && !builder.is_over);
    yaml_parser_delete(&parser);
    if (builder.is_over)
        return 0;
    if (result == 0 && tree->node_count == 0)
        return yaml_report_at(&tree->report, tree_start,
                              "the file is empty, expected 'key: value' lines");
    return result;
}

int yaml_tree_parse(struct yaml_tree *tree, const struct yaml_report *report,
                    const char *data, size_t length)
{
    const size_t mark = tree_mark_length(data);

    *tree = (struct yaml_tree){ .report = *report };
    if (yaml_scan(report, data + mark, length - mark) == 0 &&
        tree_build(tree, data + mark, length - mark) == 0)
        return 0;
    yaml_tree_free(tree);
    return -1;
}

int yaml_tree_load(const struct files *files, struct yaml_tree *tree,
                   const struct yaml_report *report)
{
    char *data;
    int err = -1;

    *tree = (struct yaml_tree){ .report = *report };
    const int64_t length = yaml_tree_read(files, report, &data);
    if (length >= 0)
        err = yaml_tree_parse(tree, report, data, (size_t)length);
    free(data);
    return err;
}

void yaml_tree_free(struct yaml_tree *tree)
{
    free(tree->node);
    free(tree->text);
    *tree = (struct yaml_tree){ 0 };
}
