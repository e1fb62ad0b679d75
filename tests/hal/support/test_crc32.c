/* tests/hal/support/test_crc32.c - the checksum of files. */
#include "hal/support/crc32.h"

#include "tests/support/check.h"

/* The check value of the CRC catalogue, and one bit at a time from the
 * polynomial. */
static uint32_t bit_by_bit(const unsigned char *bytes, size_t size)
{
    uint32_t crc = UINT32_MAX;
    for (size_t i = 0; i < 8 * size; i++) {
        const uint32_t bit = (uint32_t)(bytes[i / 8] >> i % 8 & 1);
        crc = (crc ^ bit) & 1 ? crc >> 1 ^ 0xEDB88320 : crc >> 1;
    }
    return ~crc;
}

static void the_checksum_is_that_of_ieee_802_3(void **state)
{
    unsigned char bytes[64];
    uint64_t seed = 1;
    (void)state;
    assert_int_equal(crc32_of(0, "123456789", 9), 0xCBF43926);
    assert_int_equal(crc32_of(crc32_of(0, "1234", 4), "56789", 5), 0xCBF43926);
    for (size_t size = 0; size <= sizeof bytes; size++) {
        for (size_t i = 0; i < size; i++)
            bytes[i] = (unsigned char)check_random(&seed);
        assert_int_equal(crc32_of(0, bytes, size), bit_by_bit(bytes, size));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_checksum_is_that_of_ieee_802_3),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
