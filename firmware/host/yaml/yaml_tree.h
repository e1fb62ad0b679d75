/* firmware/host/yaml/yaml_tree.h - a YAML file as a tree whose nodes hold
 * their place.
 *
 * A plain subset, so that a file means the same to every reader: one document
 * of maps, lists and single-line values in UTF-8.  Refused with a sentence:
 * directives, anchors, aliases, merge keys, tags, a second document, keys that
 * are not plain text or that stand twice in a map, control characters, and
 * whatever is beyond the bounds below.
 *
 * The library is libyaml, read event by event: its document interface loses
 * anchors and tags, and only looks at bounds when everything is in memory. */
#ifndef FIRMWARE_HOST_YAML_YAML_TREE_H
#define FIRMWARE_HOST_YAML_YAML_TREE_H

#include "firmware/host/base/files.h"
#include "firmware/host/yaml/yaml_report.h"

#define YAML_TREE_BYTES_MAX ((size_t)16 * 1024 * 1024)
#define YAML_TREE_NODES_MAX (4 * 1024 * 1024)
#define YAML_TREE_DEPTH_MAX 16  /* of maps and lists within each other */
#define YAML_TREE_KEYS_MAX  256 /* in one map */

enum yaml_tree_kind { YAML_TREE_TEXT, YAML_TREE_LIST, YAML_TREE_MAP };

struct yaml_tree_node {
    uint32_t line, column;
    uint32_t text;   /* text: offset of the first character in tree->text */
    uint32_t length; /* text: in bytes; list: items; map: keys */
    uint32_t first;  /* list: first item; map: first key, its value is next */
    uint32_t next;   /* the next in the list or map; 0: none */
    uint8_t kind;    /* enum yaml_tree_kind */
};

/* Node 0 is the root. */
struct yaml_tree {
    struct yaml_report report;
    struct yaml_tree_node *node;
    uint32_t node_count, node_capacity;
    char *text; /* every text ends with a 0 and holds no other */
    size_t text_length, text_capacity;
};

/* Read a file.  0, or -1 with the sentence written and nothing left allocated.
 * `report` is copied; its path and message must outlive the tree. */
int yaml_tree_load(const struct files *files, struct yaml_tree *tree,
                   const struct yaml_report *report);
void yaml_tree_free(struct yaml_tree *tree);
/* Both halves of it: the file, to be freed, with a 0 after it, whose length is
 * returned; and what it says.  -1 with the sentence written. */
int64_t yaml_tree_read(const struct files *files,
                       const struct yaml_report *report, char **data);
int yaml_tree_parse(struct yaml_tree *tree, const struct yaml_report *report,
                    const char *data, size_t length);

static inline struct plan_place yaml_tree_place(const struct yaml_tree *tree,
                                                uint32_t node)
{
    return (struct plan_place){ tree->node[node].line,
                                tree->node[node].column };
}

static inline const char *yaml_tree_text(const struct yaml_tree *tree,
                                         uint32_t node)
{
    return tree->text + tree->node[node].text;
}

#endif
