/* tests/firmware/host/base/test_number.c - fixed point to text and back, judged
 * by __int128. */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/number.h"
#include "motion/core/err.h"
#include "tests/support/check.h"

#define SEED UINT64_C(0x2545F4914F6CDD1D)

static void exact_text_has_every_digit(void **state)
{
    static const struct {
        int64_t value;
        unsigned bits;
        const char *want;
    } rows[] = {
        { 0, 32, "0" },
        { 1, 32, "0.00000000023283064365386962890625" },
        { -1, 32, "-0.00000000023283064365386962890625" },
        { INT64_C(3) << 31, 32, "1.5" },
        { INT64_C(-2400) * 4294967296, 32, "-2400" },
        { INT64_MAX, 32, "2147483647.99999999976716935634613037109375" },
        { INT64_MIN, 32, "-2147483648" },
        { 1, 16, "0.0000152587890625" },
        { INT64_MIN, 16, "-140737488355328" },
        { 7, 0, "7" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        char text[NUMBER_MAX];
        unsigned length = number_exact(text, rows[i].value, rows[i].bits);
        assert_string_equal(text, rows[i].want);
        assert_int_equal(length, strlen(text));
    }
}

static void exact_text_reads_back_to_the_bit(void **state)
{
    (void)state;
    uint64_t seed = SEED;
    for (int i = 0; i < 20000; i++) {
        /* 18 decimals are what the reader keeps, so fractions of 18 bits */
        int64_t value = (int64_t)(check_random(&seed) << 14);
        int64_t back;
        const char *end;
        char text[NUMBER_MAX];
        number_exact(text, value, 32);
        if (number_parse(text, 32, &back, &end) != MOTION_OK || *end != 0 ||
            back != value)
            fail_msg("seed %#llx, step %d: %s", (unsigned long long)SEED, i,
                     text);
    }
}

static void fixed_text_is_the_nearest_decimal(void **state)
{
    (void)state;
    uint64_t seed = SEED;
    for (int i = 0; i < 20000; i++) {
        int64_t value = (int64_t)check_random(&seed) >> (i % 40);
        char text[NUMBER_MAX];
        number_fixed(text, value, 32, 7);
        /* |text - value| * 2^32 * 10^7 <= 2^31, in integers */
        char *dot = strchr(text, '.');
        assert_non_null(dot);
        assert_int_equal(strlen(dot), 8);
        __int128 part = strtoll(dot + 1, NULL, 10);
        __int128 whole = strtoll(text, NULL, 10);
        bool negative = text[0] == '-';
        __int128 units = (negative ? -whole : whole) * 10000000 + part;
        __int128 magnitude = value < 0 ? -(__int128)value : (__int128)value;
        __int128 apart = (units << 32) - magnitude * 10000000;
        if (negative != (value < 0 && units != 0) || apart > INT64_C(1) << 31 ||
            apart < -(INT64_C(1) << 31))
            fail_msg("seed %#llx, step %d: %lld gave %s",
                     (unsigned long long)SEED, i, (long long)value, text);
    }
}

static void fixed_text_carries_and_has_no_negative_zero(void **state)
{
    static const struct {
        int64_t value;
        unsigned bits, digits;
        const char *want;
    } rows[] = {
        { (INT64_C(1) << 32) - 1, 32, 3, "1.000" },
        { -((INT64_C(1) << 32) - 1), 32, 3, "-1.000" },
        { -1, 32, 3, "0.000" },
        { INT64_C(1) << 31, 32, 0, "1" },
        { -(INT64_C(1) << 31), 32, 0, "-1" },
        { (INT64_C(1) << 31) - 1, 32, 0, "0" },
        { INT64_MIN, 32, 9, "-2147483648.000000000" },
        { INT64_MAX, 0, 2, "9223372036854775807.00" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        char text[NUMBER_MAX];
        number_fixed(text, rows[i].value, rows[i].bits, rows[i].digits);
        assert_string_equal(text, rows[i].want);
    }
}

static void short_text_is_for_people(void **state)
{
    static const struct {
        int64_t value;
        unsigned bits;
        const char *want;
    } rows[] = {
        { 0, 32, "0" },
        { INT64_C(2400) << 32, 32, "2400" },
        { INT64_C(24000) << 32, 32, "24000" },
        { INT64_C(3) << 31, 32, "1.5" },
        { 43, 32, "0" },
        { -4294967, 32, "-0.001" },
        { 1510193, 32, "0.000352" },
        { 23042498, 16, "351.6" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        char text[NUMBER_MAX];
        number_short(text, rows[i].value, rows[i].bits);
        assert_string_equal(text, rows[i].want);
    }
}

static void seconds_round_to_the_millisecond(void **state)
{
    static const struct {
        int64_t t_ns;
        const char *want;
    } rows[] = {
        { 0, "0.000" },
        { 499999, "0.000" },
        { 500000, "0.001" },
        { 24000000000, "24.000" },
        { -1500000000, "-1.500" },
        { -1, "0.000" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        char text[NUMBER_MAX];
        number_seconds(text, rows[i].t_ns * 4096);
        assert_string_equal(text, rows[i].want);
    }
}

static void numbers_that_are_none_are_refused(void **state)
{
    static const struct {
        const char *text;
        int want;
    } rows[] = {
        { "", MOTION_E_ARG },
        { "-", MOTION_E_ARG },
        { ".", MOTION_E_ARG },
        { "nan", MOTION_E_ARG },
        { "inf", MOTION_E_ARG },
        { "2147483648", MOTION_E_RANGE },
        { "99999999999999999999999", MOTION_E_RANGE },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        int64_t value = 77;
        int err = number_parse(rows[i].text, 32, &value, NULL);
        if (err != rows[i].want)
            fail_msg("%s: got %d", rows[i].text, err);
    }
}

static void decimals_are_read_without_loss_or_refused(void **state)
{
    static const struct {
        const char *text;
        unsigned digits;
        int err;
        int64_t want;
    } rows[] = {
        { "2.5", 9, MOTION_OK, 2500000000 },
        { ".25", 6, MOTION_OK, 250000 },
        { "-1.000001", 6, MOTION_OK, -1000001 },
        { "1.0000010", 6, MOTION_OK, 1000001 },
        { "1.0000011", 6, MOTION_E_RANGE, 0 },
        { "23.976", 6, MOTION_OK, 23976000 },
        { "9223372036.9", 9, MOTION_E_RANGE, 0 },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        int64_t value = 0;
        int err =
            number_parse_decimal(rows[i].text, rows[i].digits, &value, NULL);
        if (err != rows[i].err || (err == MOTION_OK && value != rows[i].want))
            fail_msg("%s: got %d, %lld", rows[i].text, err, (long long)value);
    }
}

static void a_percentage_reaches_100_only_at_the_limit(void **state)
{
    (void)state;
    assert_int_equal(number_percent(0, 100), 0);
    assert_int_equal(number_percent(99, 100), 99);
    assert_int_equal(number_percent(9901, 10000), 100); /* rounded up */
    assert_int_equal(number_percent(100, 100), 100);
    assert_int_equal(number_percent(-101, 100), 101);
    assert_int_equal(number_percent(5, 0), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exact_text_has_every_digit),
        cmocka_unit_test(exact_text_reads_back_to_the_bit),
        cmocka_unit_test(fixed_text_is_the_nearest_decimal),
        cmocka_unit_test(fixed_text_carries_and_has_no_negative_zero),
        cmocka_unit_test(short_text_is_for_people),
        cmocka_unit_test(seconds_round_to_the_millisecond),
        cmocka_unit_test(numbers_that_are_none_are_refused),
        cmocka_unit_test(decimals_are_read_without_loss_or_refused),
        cmocka_unit_test(a_percentage_reaches_100_only_at_the_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
