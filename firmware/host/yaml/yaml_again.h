/* firmware/host/yaml/yaml_again.h - a YAML file that is read again after an edit.
 *
 * While one drags a key only numbers change, in lines that stay: the tree of the
 * former text is taken over with those numbers in it.  Whatever else is different
 * is read afresh, and the tree is the same in either case. */
#ifndef FIRMWARE_HOST_YAML_YAML_AGAIN_H
#define FIRMWARE_HOST_YAML_YAML_AGAIN_H

#include "firmware/host/yaml/yaml_tree.h"

struct yaml_again {
    struct yaml_tree tree;
    char *data; /* the file */
    size_t length;
    bool is_plain;  /* its lines end with line feeds alone */
    bool was_taken; /* from the former one */
};

/* As yaml_tree_load; `former`: of the same path, NULL: none. */
int yaml_again_load(const struct files *files, struct yaml_again *again,
                    const struct yaml_again *former,
                    const struct yaml_report *report);
void yaml_again_free(struct yaml_again *again);

#endif
