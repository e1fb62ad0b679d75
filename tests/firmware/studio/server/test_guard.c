/* tests/firmware/studio/server/test_guard.c - whose requests are answered. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "firmware/host/base/array.h"
#include "firmware/studio/server/guard.h"

static const struct {
    const char *host, *address;
    unsigned port;
    bool want;
} hosts[] = {
    { "127.0.0.1:8787", "127.0.0.1", 8787, true },
    { "localhost:8787", "127.0.0.1", 8787, true },
    { "LOCALHOST:8787", "127.0.0.1", 8787, true },
    { "[::1]:8787", "127.0.0.1", 8787, true },
    { "127.0.0.1", "127.0.0.1", 80, true },
    { "127.0.0.1:8788", "127.0.0.1", 8787, false },
    { "127.0.0.1", "127.0.0.1", 8787, false },
    { "evil.example:8787", "127.0.0.1", 8787, false },
    { "127.0.0.1.evil.example:8787", "127.0.0.1", 8787, false },
    { "localhost.evil.example:8787", "127.0.0.1", 8787, false },
    { "127.0.0.1:8787x", "127.0.0.1", 8787, false },
    { "127.0.0.1:", "127.0.0.1", 8787, false },
    { "127.0.0.1:74323", "127.0.0.1", 8787, false },
    { "[::1:8787", "127.0.0.1", 8787, false },
    { "[::1]8787", "127.0.0.1", 8787, false },
    { ":8787", "127.0.0.1", 8787, false },
    { "", "127.0.0.1", 80, false },
    { "192.168.1.20:80", "192.168.1.20", 80, true },
    { "rig.example:80", "192.168.1.20", 80, false },
    { "rig.example:80", "0.0.0.0", 80, true },
};

static void a_host_is_that_of_the_server_or_refused(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(hosts); i++)
        if (guard_is_host(hosts[i].host, hosts[i].address, hosts[i].port) !=
            hosts[i].want)
            fail_msg("%s at %s", hosts[i].host, hosts[i].address);
}

static void an_origin_is_the_page_or_refused(void **state)
{
    (void)state;
    assert_true(guard_is_origin("", "localhost:1"));
    assert_true(guard_is_origin("http://localhost:1", "localhost:1"));
    assert_false(guard_is_origin("http://localhost:12", "localhost:1"));
    assert_false(guard_is_origin("https://localhost:1", "localhost:1"));
    assert_false(guard_is_origin("null", "localhost:1"));
    assert_false(guard_is_origin("http://evil.example", "localhost:1"));
}

static void a_token_is_all_of_it(void **state)
{
    const char *token = "abcdefghijklmnop";
    char own[GUARD_COOKIE_MAX], fresh[GUARD_TOKEN_NEW + 1];
    unsigned char random[GUARD_TOKEN_NEW];

    (void)state;
    guard_cookie_name(1, own);
    for (unsigned i = 0; i < GUARD_TOKEN_NEW; i++)
        random[i] = (unsigned char)(i * 37);
    guard_token_of(random, fresh);
    assert_int_equal(strlen(fresh), GUARD_TOKEN_NEW);
    assert_true(guard_is_good_token(fresh));
    assert_true(guard_has_cookie("slew-1=abcdefghijklmnop", own, token));
    assert_true(
        guard_has_cookie("a=b; slew-1=abcdefghijklmnop; c=d", own, token));
    assert_false(guard_has_cookie("xslew-1=abcdefghijklmnop", own, token));
    assert_false(guard_has_cookie("slew-12=abcdefghijklmnop", own, token));
    assert_false(guard_has_cookie("slew-1=abcdefghijklmno", own, token));
    assert_false(guard_has_cookie("slew-1=abcdefghijklmnopq", own, token));
    assert_false(guard_has_cookie("slew-1=", own, token));
    assert_false(guard_has_cookie("", own, token));
    assert_true(guard_is_good_token(token));
    assert_false(guard_is_good_token("abcdefghijklmno"));
    assert_false(guard_is_good_token("abcdefghijklm;op"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_host_is_that_of_the_server_or_refused),
        cmocka_unit_test(an_origin_is_the_page_or_refused),
        cmocka_unit_test(a_token_is_all_of_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
