/* firmware/host/yaml/yaml_again.c - see yaml_again.h.
 *
 * Both texts are walked line by line.  Of a line that differs, what stands between
 * its values must be the same, and so must every value that is not a number with or
 * without a unit.  A number is plain in YAML wherever another one was: it is made
 * of letters, digits, points, signs and blanks within, and begins with a digit or a
 * sign; one before a colon is a key, which could be there twice. */
#include "firmware/host/yaml/yaml_again.h"

#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"

#define AGAIN_LINE_MAX   1000
#define AGAIN_NUMBER_MAX 64

struct again_line {
    const char *text;
    size_t length; /* with its line feed */
};

static bool again_is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static bool again_is_inside(char c)
{
    return again_is_digit(c) || (c >= 'a' && c <= 'z') ||
           (c >= 'A' && c <= 'Z') || c == '.' || c == '+' || c == '-' ||
           c == '/' || c == ' ';
}

/* Length of the number that begins here; 0: none does. */
static size_t again_number(const char *text, size_t length)
{
    const bool is_signed = length > 1 && (text[0] == '-' || text[0] == '+');
    size_t end = 0;

    if (length == 0 || !again_is_digit(text[is_signed]))
        return 0;
    while (end < length && again_is_inside(text[end]))
        end++;
    if (end < length && text[end] == ':')
        return 0;
    while (text[end - 1] == ' ')
        end--;
    return end <= AGAIN_NUMBER_MAX ? end : 0;
}

static bool again_is_ascii(const struct again_line *line)
{
    for (size_t i = 0; i < line->length; i++)
        if ((unsigned char)line->text[i] >= 0x80)
            return false;
    return line->length <= AGAIN_LINE_MAX;
}

/* What ends a line beside a line feed, and a mark before the first; and a key that
 * is said to be one. */
static bool again_is_plain(const char *data, size_t length)
{
    static const char *const others[] = { "\r",           "\xC2\x85",
                                          "\xE2\x80\xA8", "\xE2\x80\xA9",
                                          "\xEF\xBB\xBF", "? ",
                                          "?\t",          "?\n" };

    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++)
        if (strstr(data, others[i]) != NULL)
            return false;
    return strlen(data) == length;
}

/* The first node in this line or after it. */
static uint32_t again_node(const struct yaml_tree *tree, uint32_t line)
{
    uint32_t low = 0, high = tree->node_count;

    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (tree->node[middle].line < line)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static void again_put(struct yaml_tree *tree, struct yaml_tree_node *node,
                      const char *text, size_t length)
{
    if (tree->text_length + length + 1 > tree->text_capacity) {
        tree->text_capacity = 2 * tree->text_capacity + length + 1;
        tree->text = memory_resize(tree->text, tree->text_capacity, 1);
    }
    memcpy(tree->text + tree->text_length, text, length);
    tree->text[tree->text_length + length] = 0;
    node->text = (uint32_t)tree->text_length;
    node->length = (uint32_t)length;
    tree->text_length += length + 1;
}

static bool again_same(const struct again_line *was, size_t was_at,
                       const struct again_line *is, size_t is_at, size_t length)
{
    return was->length - was_at >= length && is->length - is_at >= length &&
           memcmp(was->text + was_at, is->text + is_at, length) == 0;
}

/* The tree has the former line; it is given the new one. */
static bool again_line(struct yaml_tree *tree, uint32_t line,
                       const struct again_line *was,
                       const struct again_line *is)
{
    size_t was_at = 0, is_at = 0;

    if (!again_is_ascii(was) || !again_is_ascii(is))
        return false;
    for (uint32_t i = again_node(tree, line);
         i < tree->node_count && tree->node[i].line == line; i++) {
        struct yaml_tree_node *node = &tree->node[i];
        const size_t at = node->column - 1, gap = at - was_at;
        node->column = (uint32_t)(at + is_at - was_at) + 1;
        if (node->kind != YAML_TREE_TEXT)
            continue;
        if (at < was_at || !again_same(was, was_at, is, is_at, gap))
            return false;
        was_at += gap;
        is_at += gap;
        const struct again_line value = { yaml_tree_text(tree, i),
                                          node->length };
        if (value.length == 0 || /* what follows is not of it */
            !again_same(was, was_at, &value, 0, value.length))
            return false;
        const bool is_number =
            again_number(was->text + was_at, was->length - was_at) ==
            value.length;
        const size_t length =
            is_number ? again_number(is->text + is_at, is->length - is_at)
                      : value.length;
        if (length == 0 ||
            (!is_number && !again_same(was, was_at, is, is_at, length)))
            return false;
        was_at += value.length;
        if (is_number)
            again_put(tree, node, is->text + is_at, length);
        is_at += length;
    }
    return was->length - was_at == is->length - is_at &&
           again_same(was, was_at, is, is_at, was->length - was_at);
}

static struct again_line again_next(const char *data, size_t length, size_t at)
{
    const char *feed = memchr(data + at, '\n', length - at);

    return (struct again_line){ data + at,
                                feed == NULL ? length - at
                                             : (size_t)(feed - data) + 1 - at };
}

static bool again_lines(struct yaml_again *again,
                        const struct yaml_again *former)
{
    size_t was_at = 0, is_at = 0;

    for (uint32_t line = 1; was_at < former->length && is_at < again->length;
         line++) {
        const struct again_line was =
            again_next(former->data, former->length, was_at);
        const struct again_line is =
            again_next(again->data, again->length, is_at);
        if ((was.length != is.length ||
             memcmp(was.text, is.text, was.length) != 0) &&
            !again_line(&again->tree, line, &was, &is))
            return false;
        was_at += was.length;
        is_at += is.length;
    }
    return was_at == former->length && is_at == again->length;
}

static bool again_take(struct yaml_again *again,
                       const struct yaml_again *former,
                       const struct yaml_report *report)
{
    const struct yaml_tree *was = former != NULL ? &former->tree : NULL;
    struct yaml_tree *tree = &again->tree;

    /* Numbers that were replaced stay among the texts, until these are twice as
     * long as the file. */
    if (was == NULL || was->node_count == 0 || !former->is_plain ||
        was->text_length > 2 * again->length + 4096 ||
        strlen(again->data) != again->length)
        return false;
    *tree = *was;
    tree->report = *report;
    tree->node_capacity = was->node_count;
    tree->text_capacity = was->text_length + AGAIN_LINE_MAX;
    tree->node = memory_new(tree->node_capacity, sizeof *tree->node);
    tree->text = memory_new(tree->text_capacity, 1);
    memcpy(tree->node, was->node, was->node_count * sizeof *tree->node);
    memcpy(tree->text, was->text, was->text_length);
    again->is_plain = true;
    again->was_taken = again_lines(again, former);
    if (!again->was_taken)
        yaml_tree_free(tree);
    return again->was_taken;
}

int yaml_again_load(const struct files *files, struct yaml_again *again,
                    const struct yaml_again *former,
                    const struct yaml_report *report)
{
    *again = (struct yaml_again){ .data = NULL };
    const int64_t length = yaml_tree_read(files, report, &again->data);

    if (length < 0)
        return -1;
    again->length = (size_t)length;
    if (again_take(again, former, report))
        return 0;
    again->is_plain = again_is_plain(again->data, again->length);
    if (yaml_tree_parse(&again->tree, report, again->data, again->length) == 0)
        return 0;
    yaml_again_free(again);
    return -1;
}

void yaml_again_free(struct yaml_again *again)
{
    yaml_tree_free(&again->tree);
    free(again->data);
    *again = (struct yaml_again){ .data = NULL };
}
