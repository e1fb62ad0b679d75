/* tests/hal/modbus/test_modbus_map.c - values in registers: types, orders of
 * bytes, and floats that are no number; the simulated servo takes none of
 * those. */
#include "hal/modbus/map.h"

#include <inttypes.h>

#include "tests/hal/linux/modbus_bench.h"

static const enum modbus_map_order orders[] = { MODBUS_ABCD, MODBUS_CDAB,
                                                MODBUS_BADC, MODBUS_DCBA };

/* -123456 is 0xC7F12000. */
static void a_float_is_in_the_order_of_the_map(void **state)
{
    static const uint16_t want[][2] = { { 0xC7F1, 0x2000 },
                                        { 0x2000, 0xC7F1 },
                                        { 0xF1C7, 0x0020 },
                                        { 0x0020, 0xF1C7 } };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(orders); i++) {
        uint16_t reg[2];

        modbus_map_set(MODBUS_F32, orders[i], -123456, reg);
        assert_int_equal(reg[0], want[i][0]);
        assert_int_equal(reg[1], want[i][1]);
        assert_true(modbus_map_is_number(MODBUS_F32, orders[i], reg));
        assert_int_equal(modbus_map_get(MODBUS_F32, orders[i], reg), -123456);
    }
}

static int64_t number_of(float value, bool *is)
{
    uint32_t bits;
    uint16_t reg[2];

    memcpy(&bits, &value, sizeof bits);
    reg[0] = (uint16_t)(bits >> 16);
    reg[1] = (uint16_t)bits;
    *is = modbus_map_is_number(MODBUS_F32, MODBUS_ABCD, reg);
    return modbus_map_get(MODBUS_F32, MODBUS_ABCD, reg);
}

static void a_float_is_its_nearest_whole_number(void **state)
{
    static const struct {
        float value;
        int64_t want;
        bool is;
    } rows[] = {
        { 0.0f, 0, true },
        { -0.0f, 0, true },
        { 0.5f, 1, true },
        { -0.5f, -1, true },
        { 1.49f, 1, true },
        { -2.51f, -3, true },
        { 1e-40f, 0, true },
        { 16777215.0f, 16777215, true },
        { 2147483520.0f, 2147483520, true },
        { -2147483648.0f, INT32_MIN, true },
        { 2147483648.0f, INT64_C(2147483648), false },
    };
    bool is;

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(rows); i++) {
        assert_int_equal(number_of(rows[i].value, &is), rows[i].want);
        assert_int_equal(is, rows[i].is);
    }
    (void)number_of(3e38f, &is);
    assert_false(is);
}

static void every_whole_number_of_its_range_comes_back(void **state)
{
    int64_t min, max;
    uint16_t reg[2];

    (void)state;
    modbus_map_range(MODBUS_F32, &min, &max);
    for (int64_t value = min; value <= max;
         value += value % 1009 == 0 ? 1 : 7) {
        modbus_map_set(MODBUS_F32, MODBUS_CDAB, value, reg);
        if (modbus_map_get(MODBUS_F32, MODBUS_CDAB, reg) != value)
            fail_msg("%" PRId64, value);
    }
    modbus_map_set(MODBUS_F32, MODBUS_CDAB, max, reg);
    assert_int_equal(modbus_map_get(MODBUS_F32, MODBUS_CDAB, reg), max);
}

/* The servo answers that the value is illegal, and has what it had. */
static void the_servo_takes_no_nan(void **state)
{
    static struct modbus_bench bench;
    struct modbus_slave *slave = &bench.servo.slave;
    uint16_t good[11] = { 1 };
    uint16_t bad[2] = { 0, 0x7FC0 };

    (void)state;
    modbus_bench_load(&bench, "maps/floats");
    modbus_bench_init(&bench);
    modbus_map_set(MODBUS_F32, MODBUS_CDAB, 800, good + 1);
    modbus_map_set(MODBUS_F32, MODBUS_CDAB, -3, good + 9);
    assert_int_equal(slave->ops->set(slave, MODBUS_HOLDING, 0x22, 2, good + 1),
                     0);
    assert_int_equal(slave->ops->set(slave, MODBUS_HOLDING, 0x22, 2, bad), 3);
    assert_int_equal(bench.servo.reg[0x23], good[2]);
    assert_int_equal(slave->ops->set(slave, MODBUS_HOLDING, 0x100, 11, good),
                     0);
    good[6] = 0; /* acceleration, ABCD: a NaN */
    good[5] = 0x7FC0;
    assert_int_equal(slave->ops->set(slave, MODBUS_HOLDING, 0x100, 11, good),
                     3);
    assert_int_equal(bench.servo.reg[0x105], 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_float_is_in_the_order_of_the_map),
        cmocka_unit_test(a_float_is_its_nearest_whole_number),
        cmocka_unit_test(every_whole_number_of_its_range_comes_back),
        cmocka_unit_test(the_servo_takes_no_nan),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
