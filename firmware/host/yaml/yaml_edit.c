/* firmware/host/yaml/yaml_edit.c - see yaml_edit.h. */
#include "firmware/host/yaml/yaml_edit.h"

#include <stdio.h>
#include <string.h>

static struct yaml_value edit_at(const struct yaml_value *value, uint32_t node)
{
    return yaml_value_at(value, node);
}

static bool edit_is_flow_at(const struct yaml_text *self, size_t at)
{
    return at < self->length &&
           (self->data[at] == '[' || self->data[at] == '{');
}

/* --- where things end ------------------------------------------------------- */

static size_t edit_line_start(const struct yaml_text *self, size_t at)
{
    while (at > 0 && self->data[at - 1] != '\n')
        at--;
    return at;
}

/* At the line's end, before its LF or CR LF. */
static size_t edit_line_end(const struct yaml_text *self, size_t at)
{
    while (at < self->length && self->data[at] != '\n')
        at++;
    return at > 0 && at < self->length && self->data[at - 1] == '\r' ? at - 1
                                                                     : at;
}

static size_t edit_next_line(const struct yaml_text *self, size_t at)
{
    while (at < self->length && self->data[at] != '\n')
        at++;
    return at < self->length ? at + 1 : at;
}

/* Behind a text in quotes that begins here. */
static size_t edit_skip_quoted(const struct yaml_text *self, size_t at)
{
    const char quote = self->data[at++];

    while (at < self->length && self->data[at] != quote)
        at += self->data[at] == '\\' && quote == '"' ? 2 : 1;
    return at < self->length ? at + 1 : self->length;
}

static bool edit_is_comment(const struct yaml_text *self, size_t at)
{
    return self->data[at] == '#' && at > 0 &&
           strchr(" \t\r\n", self->data[at - 1]) != NULL;
}

/* Behind the bracket that belongs to the one here.  A quote is one where a value
 * may begin. */
static size_t edit_skip_brackets(const struct yaml_text *self, size_t at)
{
    unsigned depth = 0;
    bool begins = true;

    while (at < self->length) {
        const char c = self->data[at];
        if (begins && (c == '"' || c == '\'')) {
            at = edit_skip_quoted(self, at);
            begins = false;
            continue;
        }
        if (edit_is_comment(self, at)) {
            at = edit_next_line(self, at);
            continue;
        }
        depth += c == '[' || c == '{';
        depth -= (c == ']' || c == '}') && depth > 0;
        at++;
        if (depth == 0)
            return at;
        if (strchr(" \t\r\n", c) == NULL)
            begins = strchr("[{,:", c) != NULL;
    }
    return at;
}

/* The last item of a list; of a map the last value, as a key is followed by its
 * value. */
static uint32_t edit_last(const struct yaml_value *value)
{
    const struct yaml_tree *tree = value->tree;
    uint32_t last = yaml_value_node(value)->first, next = last;

    while (next != 0) {
        last = next;
        next = tree->node[next].next;
    }
    return last;
}

/* Behind a text, or what is in brackets, that begins at `from`; false for a list
 * or a map that is not: it ends where its last value ends. */
static bool edit_ends(const struct yaml_text *self,
                      const struct yaml_tree_node *node, size_t from,
                      size_t *to)
{
    if (from >= self->length)
        *to = from;
    else if (node->kind != YAML_TREE_TEXT && !edit_is_flow_at(self, from))
        return false;
    else if (node->kind != YAML_TREE_TEXT)
        *to = edit_skip_brackets(self, from);
    else if (self->data[from] == '"' || self->data[from] == '\'')
        *to = edit_skip_quoted(self, from);
    else
        *to = from + node->length;
    return true;
}

int yaml_edit_span(const struct yaml_text *self, const struct yaml_value *value,
                   size_t *from, size_t *to)
{
    struct yaml_value last = *value;
    size_t begin;

    *from = *to = 0;
    if (!yaml_text_place(self, yaml_tree_place(value->tree, value->node), from))
        return yaml_value_refuse(value, "has no place in the text");
    begin = *from;
    while (!edit_ends(self, yaml_value_node(&last), begin, to)) {
        last.node = edit_last(&last);
        if (last.node == 0 ||
            !yaml_text_place(self, yaml_tree_place(last.tree, last.node),
                             &begin))
            return yaml_value_refuse(value, "has no end in the text");
    }
    return 0;
}

bool yaml_edit_is_flow(const struct yaml_text *self,
                       const struct yaml_value *value)
{
    size_t at;

    return yaml_text_place(self, yaml_tree_place(value->tree, value->node),
                           &at) &&
           edit_is_flow_at(self, at);
}

/* --- putting ---------------------------------------------------------------- */

static int edit_put(struct yaml_text *self, const struct yaml_value *value,
                    size_t at, size_t length, const char *text)
{
    return yaml_text_put(self, at, length, value, text);
}

/* A new line behind the one that `at` is in, indented as what stands at `like`. */
static int edit_put_line(struct yaml_text *self, const struct yaml_value *value,
                         size_t at, size_t like, const char *text)
{
    const size_t start = edit_line_start(self, like);
    char line[YAML_TEXT_VALUE_MAX];
    const int length =
        snprintf(line, sizeof line, "%s%*s%s", yaml_text_newline(self),
                 (int)(like - start), "", text);

    if (length < 0 || length >= (int)sizeof line)
        return yaml_value_refuse(value, "would be a line that is too long");
    return edit_put(self, value, edit_line_end(self, at), 0, line);
}

int yaml_edit_add(struct yaml_text *self, const struct yaml_value *map,
                  const char *name, const char *by)
{
    char text[YAML_TEXT_VALUE_MAX];
    size_t from, to, first;
    const bool flow = yaml_edit_is_flow(self, map);
    const struct yaml_value last = edit_at(map, edit_last(map));
    const int length = snprintf(text, sizeof text, "%s%s: %s",
                                flow && last.node != 0 ? ", " : "", name, by);

    if (length < 0 || length >= (int)sizeof text)
        return yaml_value_refuse(map, "would have too long a value");
    if (last.node == 0) {
        if (yaml_edit_span(self, map, &from, &to) < 0)
            return -1;
        return edit_put(self, map, from + 1, 0, text);
    }
    if (yaml_edit_span(self, &last, &from, &to) < 0)
        return -1;
    if (flow)
        return edit_put(self, map, to, 0, text);
    if (!yaml_text_place(self, yaml_tree_place(map->tree, map->node), &first))
        return yaml_value_refuse(map, "has no place in the text");
    return edit_put_line(self, map, to, first, text);
}

/* The dash of an item of a list that is not in brackets: false where it stands
 * on another line. */
static bool edit_dash(const struct yaml_text *self, size_t at, size_t *dash)
{
    const size_t start = edit_line_start(self, at);

    *dash = start;
    while (*dash < at && self->data[*dash] == ' ')
        (*dash)++;
    return *dash < at && self->data[*dash] == '-';
}

/* The item before another; 0: there is none. */
static uint32_t edit_former(const struct yaml_value *list, uint32_t item)
{
    uint32_t former = 0;

    for (uint32_t i = yaml_value_node(list)->first; i != item && i != 0;
         i = list->tree->node[i].next)
        former = i;
    return former;
}

int yaml_edit_add_item(struct yaml_text *self, const struct yaml_value *list,
                       uint32_t before, const char *by)
{
    const bool flow = yaml_edit_is_flow(self, list);
    const uint32_t beside = before != 0 ? before : edit_last(list);
    const struct yaml_value value = edit_at(list, beside);
    char text[YAML_TEXT_VALUE_MAX];
    size_t from, to, dash;

    if (beside == 0)
        return yaml_value_refuse(list, "is empty");
    if (yaml_edit_span(self, &value, &from, &to) < 0)
        return -1;
    const int length =
        flow ? snprintf(text, sizeof text, before != 0 ? "%s, " : ", %s", by)
             : snprintf(text, sizeof text, "- %s", by);
    if (length < 0 || length >= (int)sizeof text)
        return yaml_value_refuse(list, "would have too long an item");
    if (flow)
        return edit_put(self, list, before != 0 ? from : to, 0, text);
    if (!edit_dash(self, from, &dash))
        return yaml_value_refuse(&value, "does not follow its dash");
    if (before == 0)
        return edit_put_line(self, list, to, dash, text);
    /* Behind the item before: what stands above `before` belongs to that. */
    const struct yaml_value former = edit_at(list, edit_former(list, before));
    size_t begin;
    if (former.node != 0)
        return yaml_edit_span(self, &former, &begin, &to) < 0
                   ? -1
                   : edit_put_line(self, list, to, dash, text);
    const size_t start = edit_line_start(self, dash);
    char line[YAML_TEXT_VALUE_MAX];
    const int size = snprintf(line, sizeof line, "%*s%s%s", (int)(dash - start),
                              "", text, yaml_text_newline(self));
    if (size < 0 || size >= (int)sizeof line)
        return yaml_value_refuse(list, "would have too long an item");
    return edit_put(self, list, start, 0, line);
}

/* --- taking out ------------------------------------------------------------- */

/* In brackets: with the comma and the blanks up to its neighbour. */
static int edit_remove_flow(struct yaml_text *self,
                            const struct yaml_value *value, size_t from,
                            size_t to, const struct yaml_value *next,
                            const struct yaml_value *former)
{
    size_t other, end;

    if (next->node != 0) {
        if (yaml_edit_span(self, next, &other, &end) < 0)
            return -1;
        to = other;
    } else if (former->node != 0) {
        if (yaml_edit_span(self, former, &other, &end) < 0)
            return -1;
        from = end;
    }
    return edit_put(self, value, from, to - from, "");
}

static int edit_remove_lines(struct yaml_text *self,
                             const struct yaml_value *value, size_t from,
                             size_t to)
{
    const size_t start = edit_line_start(self, from);

    return edit_put(self, value, start, edit_next_line(self, to) - start, "");
}

int yaml_edit_remove_item(struct yaml_text *self, const struct yaml_value *list,
                          uint32_t item)
{
    const struct yaml_value value = edit_at(list, item);
    const struct yaml_value former = edit_at(list, edit_former(list, item));
    const struct yaml_value next = edit_at(list, list->tree->node[item].next);
    size_t from, to, dash;

    if (yaml_edit_span(self, &value, &from, &to) < 0)
        return -1;
    if (yaml_edit_is_flow(self, list))
        return edit_remove_flow(self, &value, from, to, &next, &former);
    if (!edit_dash(self, from, &dash))
        return yaml_value_refuse(&value, "does not follow its dash");
    return edit_remove_lines(self, &value, from, to);
}

int yaml_edit_remove(struct yaml_text *self, const struct yaml_value *map,
                     const char *name)
{
    const struct yaml_tree *tree = map->tree;
    uint32_t key = yaml_value_node(map)->first, before = 0;
    size_t from, to, begin;

    while (key != 0 && strcmp(yaml_tree_text(tree, key), name) != 0) {
        before = key;
        key = tree->node[tree->node[key].next].next;
    }
    if (key == 0)
        return yaml_value_refuse(map, "has no %s", name);
    const struct yaml_value entry = edit_at(map, key);
    const struct yaml_value value = edit_at(map, tree->node[key].next);
    const struct yaml_value next = edit_at(map, tree->node[value.node].next);
    const struct yaml_value former =
        edit_at(map, before == 0 ? 0 : tree->node[before].next);
    if (yaml_edit_span(self, &entry, &from, &to) < 0 ||
        yaml_edit_span(self, &value, &begin, &to) < 0)
        return -1;
    if (yaml_edit_is_flow(self, map))
        return edit_remove_flow(self, &value, from, to, &next, &former);
    /* The first entry of an item shares its line with the dash. */
    if (before == 0 && next.node != 0) {
        size_t end;
        if (yaml_edit_span(self, &next, &begin, &end) < 0)
            return -1;
        return edit_put(self, &value, from, begin - from, "");
    }
    return edit_remove_lines(self, &value, from, to);
}

int yaml_edit_name_items(struct yaml_text *self, const struct yaml_value *list,
                         const char *const name[], uint32_t names)
{
    struct yaml_value item = edit_at(list, yaml_value_node(list)->first);
    size_t from = 0, to = 0;
    int err = yaml_edit_span(self, list, &from, &to);

    if (err == 0 && !edit_is_flow_at(self, from))
        return yaml_value_refuse(list, "is not written in brackets");
    if (err == 0)
        err = edit_put(self, list, to - 1, 1, "}");
    if (err == 0)
        err = edit_put(self, list, from, 1, "{");
    for (uint32_t i = 0; err == 0 && item.node != 0; i++) {
        char text[YAML_TEXT_VALUE_MAX];
        if (i == names)
            return yaml_value_refuse(list, "has more than %u items", names);
        snprintf(text, sizeof text, "%s: ", name[i]);
        err = yaml_edit_span(self, &item, &from, &to);
        if (err == 0)
            err = edit_put(self, &item, from, 0, text);
        item.node = yaml_value_node(&item)->next;
    }
    return err;
}
