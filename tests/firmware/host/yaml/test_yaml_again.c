/* tests/firmware/host/yaml/test_yaml_again.c - a file that is read again after an
 * edit has the tree of one that is read afresh. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/yaml/yaml_again.h"
#include "firmware/studio/wasm/store.h"
#include "tests/support/check.h"

#define TEXT_MAX 2000

static const char start[] =
    "title: \"B\xC3\xBChne 3\"  # 4 axes\n"
    "fps: 24\n"
    "axes:\n"
    "  x:\n"
    "    curve: bezier\n"
    "    keys:\n"
    "      - [0 s, 1.5 mm]\n"
    "      - [1.25 s, -30 mm]   # the turn: 3\n"
    "      - {t: 2, p: .5, handles: auto, left: [-0.1 s, 5], right: [1, 2]}\n"
    "      - [3, 'seven', 0x10]\n"
    "  y: {curve: c2, keys: [[0, 0], [4, 20 deg], [9, 3]]}\n"
    "1: a\n"
    "2 : b\n";

static int load(struct yaml_again *again, const struct yaml_again *former,
                const char *text, char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { "a.yaml", message, YAML_MESSAGE_MAX };
    struct store store = { .count = 0 }, files;

    message[0] = 0;
    store_put(&store, "a.yaml", text, strlen(text));
    store_snapshot(&store, &files);
    const int err = yaml_again_load(&files.files, again, former, &report);
    store_free(&files);
    store_free(&store);
    return err;
}

static void same_trees(const struct yaml_tree *a, const struct yaml_tree *b,
                       const char *text)
{
    assert_int_equal(a->node_count, b->node_count);
    for (uint32_t i = 0; i < a->node_count; i++) {
        const struct yaml_tree_node *x = &a->node[i], *y = &b->node[i];
        if (x->line != y->line || x->column != y->column ||
            x->length != y->length || x->first != y->first ||
            x->next != y->next || x->kind != y->kind ||
            (x->kind == YAML_TREE_TEXT &&
             strcmp(yaml_tree_text(a, i), yaml_tree_text(b, i)) != 0))
            fail_msg("node %u, line %u, is another one of\n%s", i, y->line,
                     text);
    }
}

/* Read from the former and afresh: whether the former was of use. */
static bool is_same(struct yaml_again *next, const struct yaml_again *former,
                    const char *text)
{
    static char message[2][YAML_MESSAGE_MAX];
    struct yaml_again fresh;
    const int err = load(next, former, text, message[0]);

    assert_int_equal(load(&fresh, NULL, text, message[1]), err);
    assert_string_equal(message[0], message[1]);
    if (err < 0)
        return false;
    same_trees(&next->tree, &fresh.tree, text);
    yaml_again_free(&fresh);
    return next->was_taken;
}

/* A number in the text becomes another; where it is no longer one, so be it. */
static void change_number(char text[TEXT_MAX])
{
    static const char *const values[] = {
        "0",     "-1",    "+.5",   "12.125 s", "1e3",        "7 mm/s",
        "- 3",   "1: 2",  "1 #2",  "1,2",      "",           "'5'",
        "1-2",   "100 s", "5 : 6", "\"7\"",    "24000/1001", "1]",
        "1 - 2", "3 ",    "5\t",   "1\n2",     "1?",         "? 1",
    };
    const char *value = values[draw_below(ARRAY_LEN(values))];
    const size_t length = strlen(text);
    size_t from = draw_below((uint32_t)length), to;
    char rest[TEXT_MAX];

    while (from < length && (text[from] < '0' || text[from] > '9'))
        from++;
    for (to = from; to < length && text[to] >= '.' && text[to] <= '9'; to++) {
    }
    snprintf(rest, sizeof rest, "%s", text + to);
    if (from + strlen(value) + strlen(rest) < TEXT_MAX)
        snprintf(text + from, TEXT_MAX - from, "%s%s", value, rest);
}

static void change_byte(char text[TEXT_MAX])
{
    static const char bytes[] = "0123456789 .,-+:#[]{}'\"?\n\r\tsmx&*!|>%@";

    text[draw_below((uint32_t)strlen(text))] =
        bytes[draw_below(sizeof bytes - 1)];
}

static void any_edit_gives_the_tree_of_a_fresh_file(void **state)
{
    static char text[TEXT_MAX], before[TEXT_MAX], message[YAML_MESSAGE_MAX];
    unsigned taken = 0, read = 0;

    (void)state;
    seed_from("any edit");
    for (unsigned round = 0; round < 300; round++) {
        struct yaml_again former, next;
        snprintf(text, sizeof text, "%s", start);
        assert_int_equal(load(&former, NULL, text, message), 0);
        for (unsigned i = 0; i < 20; i++) {
            memcpy(before, text, sizeof before);
            for (uint32_t k = draw_below(2); k < 2; k++)
                (draw_below(8) != 0 ? change_number : change_byte)(text);
            taken += is_same(&next, &former, text);
            read++;
            if (next.data == NULL) { /* refused */
                memcpy(text, before, sizeof text);
                continue;
            }
            yaml_again_free(&former);
            former = next;
        }
        yaml_again_free(&former);
    }
    assert_in_range(taken, read / 40, read / 2);
}

static const struct {
    const char *name, *was, *is;
    bool taken;
} rows[] = {
    { "a number", "a: 1\nb: [2, 3]\n", "a: 1\nb: [25, 3]\n", true },
    { "two in a line", "b: [2 s, 3]\n", "b: [2.5 s, -31]\n", true },
    { "none", "a: 1\n", "a: 1\n", true },
    { "the last line has no end", "a: 1", "a: 22", true },
    { "a name", "a: one\n", "a: two\n", false },
    { "a key", "1: a\n2: b\n", "1: a\n1: b\n", false },
    { "a key with a blank", "1 : a\n2 : b\n", "1 : a\n1 : b\n", false },
    { "a comment begins", "a: [1, 2]\nb: 3\n", "a: [1, 2]\nb: 3 #4\n", false },
    { "a comment changes", "a: 1 # 2\n", "a: 1 # 3\n", false },
    { "a line more", "a: 1\n", "a: 1\nb: 2\n", false },
    { "a line less", "a: 1\nb: 2\n", "a: 1\n", false },
    { "a list more", "a: [1, 2]\n", "a: [1, 2, 3]\n", false },
    { "quoted", "a: '1'\n", "a: '2'\n", false },
    { "lines that end otherwise", "a: 1\r\nb: 2\r\n", "a: 1\r\nb: 3\r\n",
      false },
    { "behind a key without a value", "{a:#c1-2, b: 3}\n",
      "{a:#c1-2-2, b: 3}\n", false },
    { "said to be a key", "? 1\n: a\n", "? 2\n: a\n", false },
    { "beside letters that are none of ASCII", "\xC3\xA4: 1\n", "\xC3\xA4: 2\n",
      false },
};

static void only_numbers_are_taken_over(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        char message[YAML_MESSAGE_MAX];
        struct yaml_again former, next;
        assert_int_equal(load(&former, NULL, rows[i].was, message), 0);
        if (is_same(&next, &former, rows[i].is) != rows[i].taken)
            fail_msg("%s: %s", rows[i].name, rows[i].is);
        yaml_again_free(&former);
        yaml_again_free(&next);
    }
}

/* A long drag does not grow without end. */
static void texts_that_were_replaced_are_given_up(void **state)
{
    char text[64], message[YAML_MESSAGE_MAX];
    struct yaml_again former, next;
    unsigned afresh = 0;

    (void)state;
    assert_int_equal(load(&former, NULL, "a: [1, 2]\n", message), 0);
    for (unsigned i = 0; i < 2000; i++) {
        snprintf(text, sizeof text, "a: [%u, 2]\n", i);
        afresh += !is_same(&next, &former, text);
        assert_true(next.tree.text_length < 6000);
        yaml_again_free(&former);
        former = next;
    }
    assert_in_range(afresh, 1, 10);
    yaml_again_free(&former);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_edit_gives_the_tree_of_a_fresh_file),
        cmocka_unit_test(only_numbers_are_taken_over),
        cmocka_unit_test(texts_that_were_replaced_are_given_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
