/* tests/hal/modbus/test_modbus_map.c - values in registers: types, orders of
 * bytes, and floats that are no number, of which the simulated servo takes none;
 * what is read together, and what never is. */
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

/* ---- what is never read together ---- */

#define HOLE_MAPS 4000

/* Items of registers that do not overlap, four of one function and four of the
 * other, most of them read. */
static void draw_items(struct modbus_map *map)
{
    uint16_t at = 0;

    *map = (struct modbus_map){ .registers_max = 16, .item_count = 8 };
    for (unsigned i = 0; i < map->item_count; i++) {
        struct modbus_map_item *item = &map->item[i];

        item->read = i < 4 ? HAL_MODBUS_READ : HAL_MODBUS_READ_INPUT;
        at = i == 4 ? 0 : at;
        item->at = (uint16_t)(at + draw() % 4);
        item->type = draw() % 2 == 0 ? MODBUS_U16 : MODBUS_I32;
        item->poll = draw() % 4 == 0 ? MODBUS_POLL_NEVER : MODBUS_POLL_FAST;
        at = (uint16_t)(item->at + modbus_map_registers(item->type));
    }
}

/* Look at registers one after the other. */
static bool reads(const struct modbus_map_block *block,
                  const struct modbus_map_item *item)
{
    for (unsigned i = 0; i < block->count; i++)
        for (unsigned k = 0; k < modbus_map_registers(item->type); k++)
            if (block->read == item->read && block->at + i == item->at + k)
                return true;
    return false;
}

static void expect_apart(const struct modbus_map *map,
                         const struct modbus_map_block *block)
{
    for (unsigned i = 0; i < map->apart_count; i++)
        if (reads(block, &map->item[map->apart[i].item[0]]) &&
            reads(block, &map->item[map->apart[i].item[1]]))
            fail_msg("items %u and %u are read together from %u on",
                     map->apart[i].item[0], map->apart[i].item[1], block->at);
}

/* Each item that is polled is read by one request, in whole. */
static void expect_all_read(const struct modbus_map *map,
                            const struct modbus_map_block *block,
                            unsigned count)
{
    for (unsigned i = 0; i < map->item_count; i++) {
        const struct modbus_map_item *item = &map->item[i];
        unsigned n = 0;

        for (unsigned k = 0; k < count; k++)
            n += reads(&block[k], item) &&
                 item->at + modbus_map_registers(item->type) <=
                     block[k].at + block[k].count;
        if (item->poll == MODBUS_POLL_FAST)
            assert_int_equal(n, 1);
    }
}

static void items_apart_are_never_read_together(void **state)
{
    unsigned more = 0, judged = 0;

    (void)state;
    seed_from("items_apart_are_never_read_together");
    for (unsigned i = 0; i < HOLE_MAPS; i++) {
        struct modbus_map_block block[MODBUS_MAP_BLOCKS_MAX];
        struct modbus_map map;
        unsigned count, before;

        draw_items(&map);
        before = modbus_map_blocks(&map, MODBUS_POLL_FAST, block);
        expect_all_read(&map, block, before);
        for (map.apart_count = 0; map.apart_count < 3; map.apart_count++) {
            uint8_t *pair = map.apart[map.apart_count].item;

            pair[0] = (uint8_t)(draw() % 8);
            pair[1] = (uint8_t)((pair[0] + 1 + draw() % 2) % 8);
        }
        count = modbus_map_blocks(&map, MODBUS_POLL_FAST, block);
        if (count == MODBUS_MAP_BLOCKS_MAX)
            continue; /* perhaps more than there may be: the loader refuses */
        expect_all_read(&map, block, count);
        for (unsigned k = 0; k < count; k++)
            expect_apart(&map, &block[k]);
        more += count > before;
        judged++;
    }
    assert_true(judged > HOLE_MAPS / 2 && more > HOLE_MAPS / 8);
}

/* It answers "illegal data address" to a read across a hole. */
static void a_drive_with_holes_is_enabled_and_streamed(void **state)
{
    static struct modbus_bench bench;
    uint16_t value[8];
    struct modbus_slave *slave = &bench.servo.slave;

    (void)state;
    modbus_bench_load(&bench, "maps/holes");
    modbus_bench_init(&bench);
    assert_int_equal(slave->ops->get(slave, MODBUS_HOLDING, 0, 3, value), 2);
    assert_int_equal(slave->ops->get(slave, MODBUS_HOLDING, 2, 4, value), 2);
    assert_int_equal(slave->ops->get(slave, MODBUS_HOLDING, 0, 2, value), 0);
    assert_int_equal(bench.drive.fast_count, 3);
    modbus_bench_enable(&bench);
    modbus_bench_run(&bench, 2000 * MS);
    assert_int_equal(bench.feedback.state, HAL_DRIVE_ENABLED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_float_is_in_the_order_of_the_map),
        cmocka_unit_test(a_float_is_its_nearest_whole_number),
        cmocka_unit_test(every_whole_number_of_its_range_comes_back),
        cmocka_unit_test(the_servo_takes_no_nan),
        cmocka_unit_test(items_apart_are_never_read_together),
        cmocka_unit_test(a_drive_with_holes_is_enabled_and_streamed),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
