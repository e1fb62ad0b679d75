/* tests/firmware/host/base/test_decimal.c - numbers as they are written. */
#include "firmware/host/base/decimal.h"

#include <stddef.h>

#include "tests/support/check.h"

static const struct decimal_ratio one = { 1, 1, 0 };

static void read_is(const char *text, bool negative, uint64_t mantissa,
                    int exp10, const char *rest)
{
    struct decimal number;
    const char *at = text;
    assert_null(decimal_read(&number, &at));
    assert_int_equal(number.negative, negative);
    assert_int_equal(number.mantissa, mantissa);
    assert_int_equal(number.exp10, exp10);
    assert_string_equal(at, rest);
}

static void zeros_at_either_end_are_no_digits(void **state)
{
    (void)state;
    read_is("800 mm", false, 8, 2, " mm");
    read_is("-0.0250", true, 25, -3, "");
    read_is("+1.5e3x", false, 15, 2, "x");
    read_is("2e", false, 2, 0, "e"); /* no digits: the e is of the unit */
    read_is("00000000000000000000123456789012345678", false, 123456789012345678,
            0, "");
}

static void what_is_no_number_is_said(void **state)
{
    static const struct {
        const char *text, *wrong;
    } row[] = {
        { "", "is not a number" },
        { "-", "is not a number" },
        { ".", "is not a number" },
        { ".NaN", "is not a number" },
        { "-.inf", "is infinite" },
        { "1234567890123456789", "has more than 18 digits" },
        { "1,5", "has a comma in the number (a decimal point is expected)" },
    };
    (void)state;
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        struct decimal number;
        const char *at = row[i].text;
        assert_string_equal(decimal_read(&number, &at), row[i].wrong);
    }
}

static int64_t scaled(const char *text, const struct decimal_ratio *ratio,
                      unsigned frac)
{
    struct decimal number;
    int64_t result;
    assert_null(decimal_read(&number, &text));
    assert_int_equal(decimal_scale(&number, ratio, frac, &result), 0);
    return result;
}

static void scaling_is_exact_and_rounds_once(void **state)
{
    const struct decimal_ratio third = { 1, 3, 0 };
    (void)state;
    assert_int_equal(scaled("0.5", &one, 0), 1); /* ties away from zero */
    assert_int_equal(scaled("-0.5", &one, 0), -1);
    assert_int_equal(scaled("0.499999999999999999", &one, 0), 0);
    assert_int_equal(scaled("1", &third, 32), 1431655765);
    assert_int_equal(scaled("2", &third, 32), 2863311531);
    assert_int_equal(scaled("1e-99999", &one, 32), 0);
    assert_int_equal(scaled("922337203685477.580", &one, 0), 922337203685478);
}

static void beyond_63_bits_is_refused(void **state)
{
    const struct decimal edge = { .mantissa = 2147483648 };
    int64_t result;
    uint64_t a = UINT64_C(1) << 62;
    (void)state;
    assert_true(decimal_scale(&edge, &one, 32, &result) < 0);
    assert_false(decimal_mul_whole(&a, 2));
    assert_true(a == UINT64_C(1) << 62);
    a -= 1;
    assert_true(decimal_mul_whole(&a, 2));
    assert_true(a == INT64_MAX - 1);
}

static void the_greatest_common_divisor(void **state)
{
    (void)state;
    assert_int_equal(decimal_gcd(12, 18), 6);
    assert_int_equal(decimal_gcd(0, 7), 7);
    assert_int_equal(decimal_gcd(UINT64_MAX, 5), 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(zeros_at_either_end_are_no_digits),
        cmocka_unit_test(what_is_no_number_is_said),
        cmocka_unit_test(scaling_is_exact_and_rounds_once),
        cmocka_unit_test(beyond_63_bits_is_refused),
        cmocka_unit_test(the_greatest_common_divisor),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
