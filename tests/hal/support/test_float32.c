/* tests/hal/support/test_float32.c - fixed point and IEEE single against the
 * compiler's own float. */
#include "tests/support/check.h"

#include <math.h>
#include <string.h>

#include "hal/support/float32.h"

static uint32_t bits_of(float number)
{
    uint32_t bits;

    memcpy(&bits, &number, sizeof bits);
    return bits;
}

static float number_of(uint32_t bits)
{
    float number;

    memcpy(&number, &bits, sizeof number);
    return number;
}

/* Scaling by a power of two is exact, so one rounding is left. */
static void from_fixed_is_the_compilers(int64_t value, unsigned fraction_bits)
{
    const float want = ldexpf((float)value, -(int)fraction_bits);
    const uint32_t got = hal_float32_from_fixed(value, fraction_bits);

    if (got != bits_of(want))
        fail_msg("%" PRId64 " / 2^%u: %08" PRIx32 ", not %08" PRIx32, value,
                 fraction_bits, got, bits_of(want));
}

/* 64 bits of mantissa hold every product that is not held at an end. */
static void to_fixed_is_the_compilers(uint32_t bits, unsigned fraction_bits)
{
    const int64_t got = hal_float32_to_fixed(bits, fraction_bits);
    const long double exact =
        ldexpl((long double)number_of(bits), (int)fraction_bits);
    int64_t want = 0;

    if (exact >= 0x1p63L)
        want = INT64_MAX;
    else if (exact < -0x1p63L)
        want = INT64_MIN;
    else if (!isnan(exact))
        want = (int64_t)roundl(exact);
    if (got != want)
        fail_msg("%08" PRIx32 " x 2^%u: %" PRId64 ", not %" PRId64, bits,
                 fraction_bits, got, want);
}

static void around_powers_of_two(void **state)
{
    (void)state;
    for (unsigned fraction_bits = 0; fraction_bits < 64; fraction_bits++)
        for (unsigned power = 0; power < 63; power++)
            for (int64_t off = -3; off <= 3; off++) {
                const int64_t value = (INT64_C(1) << power) + off;

                from_fixed_is_the_compilers(value, fraction_bits);
                from_fixed_is_the_compilers(-value, fraction_bits);
            }
    from_fixed_is_the_compilers(INT64_MIN, 0);
    from_fixed_is_the_compilers(INT64_MAX, 63);
}

/* A half goes to the even neighbour, and one above or below it does not. */
static void ties_go_to_even(void **state)
{
    (void)state;
    for (unsigned power = 24; power < 62; power++)
        for (int64_t kept = 0x800000; kept < 0x800004; kept++) {
            const int64_t half = INT64_C(1) << (power - 24);
            const int64_t value = kept * 2 * half + half;

            from_fixed_is_the_compilers(value, 32);
            from_fixed_is_the_compilers(value - 1, 32);
            from_fixed_is_the_compilers(value + 1, 32);
            from_fixed_is_the_compilers(-value, 32);
        }
    from_fixed_is_the_compilers(0xFFFFFF8, 0); /* carries into the exponent */
    from_fixed_is_the_compilers(0xFFFFFFF, 0);
}

static void every_exponent_and_its_edges(void **state)
{
    static const uint32_t fraction[] = {
        0, 1, 2, 0x3FFFFF, 0x400000, 0x400001, 0x7FFFFE, 0x7FFFFF
    };
    static const unsigned fraction_bits[] = { 0, 1, 16, 32, 48, 62, 63 };

    (void)state;
    for (uint32_t exponent = 0; exponent < 256; exponent++)
        for (size_t i = 0; i < ARRAY_LEN(fraction); i++)
            for (size_t k = 0; k < ARRAY_LEN(fraction_bits); k++) {
                const uint32_t bits = exponent << 23 | fraction[i];

                to_fixed_is_the_compilers(bits, fraction_bits[k]);
                to_fixed_is_the_compilers(bits | 0x80000000, fraction_bits[k]);
            }
}

static void random_numbers(void **state)
{
    (void)state;
    seed_from("floats");
    for (int i = 0; i < 1000000; i++) {
        const uint64_t bits = draw();
        const unsigned shift = (unsigned)(draw() % 64);
        const unsigned fraction_bits = (unsigned)(draw() % 64);

        from_fixed_is_the_compilers((int64_t)bits >> shift, fraction_bits);
        to_fixed_is_the_compilers((uint32_t)(bits >> 32), fraction_bits);
    }
}

/* What fits in 24 bits comes back as it was. */
static void there_and_back(void **state)
{
    (void)state;
    seed_from("there and back");
    for (int i = 0; i < 100000; i++) {
        const int64_t value =
            check_random_in(check_stream(), -0xFFFFFF, 0xFFFFFF) *
            (INT64_C(1) << draw() % 39);
        const uint32_t bits = hal_float32_from_fixed(value, 32);

        assert_int_equal(hal_float32_to_fixed(bits, 32), value);
    }
}

static void bytes_are_little_endian(void **state)
{
    uint8_t bytes[4];

    (void)state;
    hal_float32_put(bytes, bits_of(1.25f));
    assert_memory_equal(bytes, "\x00\x00\xA0\x3F", 4);
    assert_int_equal(hal_float32_get(bytes), bits_of(1.25f));
    assert_true(hal_float32_is_finite(bits_of(-3e38f)));
    assert_false(hal_float32_is_finite(bits_of(INFINITY)));
    assert_false(hal_float32_is_finite(HAL_FLOAT32_NAN));
    assert_int_equal(hal_float32_to_fixed(HAL_FLOAT32_NAN, 32), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(around_powers_of_two),
        cmocka_unit_test(ties_go_to_even),
        cmocka_unit_test(every_exponent_and_its_edges),
        cmocka_unit_test(random_numbers),
        cmocka_unit_test(there_and_back),
        cmocka_unit_test(bytes_are_little_endian),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
