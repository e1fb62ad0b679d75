/* firmware/host/exchange/joint_limits.c - see joint_limits.h. */
#include "firmware/host/exchange/joint_limits.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/yaml/yaml_fields.h"

static const struct {
    const char *name, *has;
} joint_limit_keys[JOINT_LIMIT_COUNT] = {
    [JOINT_LOWER] = { "min_position", "has_position_limits" },
    [JOINT_UPPER] = { "max_position", "has_position_limits" },
    [JOINT_VELOCITY] = { "max_velocity", "has_velocity_limits" },
    [JOINT_ACCELERATION] = { "max_acceleration", "has_acceleration_limits" },
    [JOINT_JERK] = { "max_jerk", "has_jerk_limits" },
};

static void joint_limits_leave(struct joint_limits_file *out, const char *word,
                               uint32_t line)
{
    uint32_t i = 0;

    while (i < out->lefts && strcmp(out->left[i].word, word) != 0)
        i++;
    if (i == JOINT_LIMITS_LEFT_MAX)
        return;
    if (i == out->lefts) {
        out->lefts++;
        out->left[i].line = line;
        out->left[i].count = 0;
        snprintf(out->left[i].word, sizeof out->left[i].word, "%s", word);
    }
    out->left[i].count++;
}

static int joint_limits_number(const struct yaml_value *value,
                               char out[JOINT_LIMITS_TEXT_MAX])
{
    const char *text = yaml_value_text(value);
    char quote[YAML_QUOTE_MAX], *end;

    if (text == NULL)
        return -1;
    errno = 0;
    const double number = strtod(text, &end);
    if (end == text || *end != 0 || !isfinite(number) ||
        strspn(text, "+-.0123456789eE") < strlen(text) ||
        strlen(text) >= JOINT_LIMITS_TEXT_MAX)
        return yaml_value_refuse(value, "is %s",
                                 yaml_value_quote(quote, value));
    snprintf(out, JOINT_LIMITS_TEXT_MAX, "%s", text);
    return 0;
}

static bool joint_limits_is_known(const char *key)
{
    for (size_t i = 0; i < ARRAY_LEN(joint_limit_keys); i++)
        if (strcmp(joint_limit_keys[i].name, key) == 0 ||
            strcmp(joint_limit_keys[i].has, key) == 0)
            return true;
    return false;
}

/* A limit that the joint does not say it has is none. */
static int joint_limits_take(const struct yaml_value *of, enum joint_limit i,
                             struct joint_limits_file *out,
                             char text[JOINT_LIMITS_TEXT_MAX])
{
    const char *name = joint_limit_keys[i].name, *has = joint_limit_keys[i].has;
    const struct yaml_value number = { of->tree, yaml_fields_find(of, name),
                                       name, "a number, in rad or m" },
                            flag = { of->tree, yaml_fields_find(of, has), has,
                                     "true or false" };
    bool is_there = false;

    if (flag.node != 0 && yaml_value_bool(&flag, &is_there) < 0)
        return -1;
    if (number.node != 0 && !is_there)
        joint_limits_leave(out, name, yaml_value_node(&number)->line);
    return number.node != 0 && is_there ? joint_limits_number(&number, text)
                                        : 0;
}

static int joint_limits_joint(const struct yaml_value *of, const char *name,
                              struct joint_limits_file *out)
{
    const struct yaml_tree *tree = of->tree;

    if (yaml_value_need(of, YAML_TREE_MAP) < 0)
        return -1;
    if (out->joints == JOINT_LIMITS_MAX ||
        strlen(name) >= JOINT_LIMITS_NAME_MAX)
        return yaml_value_refuse(of,
                                 "has joints of more than %d, or a name of "
                                 "more than %d bytes",
                                 JOINT_LIMITS_MAX, JOINT_LIMITS_NAME_MAX - 1);
    struct joint_limits *joint = &out->joint[out->joints++];
    *joint = (struct joint_limits){ .place = yaml_tree_place(tree, of->node) };
    snprintf(joint->name, sizeof joint->name, "%s", name);
    for (unsigned i = 0; i < JOINT_LIMIT_COUNT; i++)
        if (joint_limits_take(of, (enum joint_limit)i, out, joint->text[i]) < 0)
            return -1;
    for (uint32_t key = yaml_value_node(of)->first, n = 0;
         n < yaml_value_node(of)->length; n++) {
        if (!joint_limits_is_known(yaml_tree_text(tree, key)))
            joint_limits_leave(out, yaml_tree_text(tree, key),
                               tree->node[key].line);
        key = tree->node[tree->node[key].next].next;
    }
    return 0;
}

/* Parameters of a node are maps of one key around it. */
static int joint_limits_find(struct yaml_value *at,
                             struct joint_limits_file *out)
{
    const struct yaml_tree *tree = at->tree;

    while (yaml_value_node(at)->kind == YAML_TREE_MAP) {
        const struct yaml_tree_node *map = yaml_value_node(at);
        const uint32_t found = yaml_fields_find(at, "joint_limits");
        if (found == 0 && map->length != 1)
            break;
        for (uint32_t key = map->first, n = 0; found != 0 && n < map->length;
             n++) {
            if (tree->node[key].next != found)
                joint_limits_leave(out, yaml_tree_text(tree, key),
                                   tree->node[key].line);
            key = tree->node[tree->node[key].next].next;
        }
        at->node = found != 0 ? found : tree->node[map->first].next;
        if (found != 0)
            return yaml_value_need(at, YAML_TREE_MAP);
    }
    return yaml_report_at(&tree->report, yaml_tree_place(tree, at->node),
                          "the file has no limits of joints, expected "
                          "joint_limits with a map for each");
}

int joint_limits_read(const struct files *files, const char *path,
                      struct joint_limits_file *out,
                      char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct yaml_tree tree;

    out->joints = out->lefts = 0;
    if (yaml_tree_load(files, &tree, &report) < 0)
        return -1;
    struct yaml_value limits = { &tree, 0, "joint_limits",
                                 "a map with a map for each joint" };
    int err = joint_limits_find(&limits, out);
    for (uint32_t key = err == 0 ? yaml_value_node(&limits)->first : 0, n = 0;
         err == 0 && n < yaml_value_node(&limits)->length; n++) {
        const uint32_t entry = tree.node[key].next;
        const struct yaml_value joint = { &tree, entry,
                                          yaml_tree_text(&tree, key),
                                          "a map with max_velocity" };
        err = joint_limits_joint(&joint, joint.name, out);
        key = tree.node[entry].next;
    }
    yaml_tree_free(&tree);
    return err;
}
