/* tests/firmware/host/base/test_messages.c - what is said is there in order. */
#include "firmware/host/base/messages.h"

#include <stdio.h>
#include <string.h>

#include "tests/support/check.h"

static void messages_come_back_in_their_order(void **state)
{
    struct messages messages = { .text = NULL };
    enum message_kind kind;
    char want[16];
    size_t at = 0;

    (void)state;
    assert_null(messages_next(&messages, &at, &kind));
    for (int i = 0; i < 1000; i++)
        messages_add(&messages, i % 3 == 0 ? MESSAGE_ERROR : MESSAGE_WARNING,
                     "%.*s%d", i % 3, "ab", i);
    for (int i = 0; i < 1000; i++) {
        snprintf(want, sizeof want, "%.*s%d", i % 3, "ab", i);
        assert_string_equal(messages_next(&messages, &at, &kind), want);
        assert_int_equal(kind, i % 3 == 0 ? MESSAGE_ERROR : MESSAGE_WARNING);
    }
    assert_null(messages_next(&messages, &at, &kind));
    messages_free(&messages);
    at = 0;
    assert_null(messages_next(&messages, &at, &kind));
}

static void a_long_sentence_is_cut(void **state)
{
    struct messages messages = { .text = NULL };
    enum message_kind kind;
    size_t at = 0;

    (void)state;
    messages_add(&messages, MESSAGE_ERROR, "%*s", 2 * MESSAGE_MAX, "x");
    messages_add(&messages, MESSAGE_WARNING, "next");
    assert_int_equal(strlen(messages_next(&messages, &at, &kind)),
                     MESSAGE_MAX - 1);
    assert_string_equal(messages_next(&messages, &at, &kind), "next");
    messages_free(&messages);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(messages_come_back_in_their_order),
        cmocka_unit_test(a_long_sentence_is_cut),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
