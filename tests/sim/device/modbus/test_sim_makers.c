/* tests/sim/device/modbus/test_sim_makers.c - the simulated servos of the makers
 * do not come from the maps: each of our maps drives its maker's, and none with
 * one mistake in it does. */
#include "firmware/host/rig/rig.h"
#include "tests/hal/linux/modbus_bench.h"

#include <inttypes.h>
#include <stdlib.h>

static const char *const maps[] = { "leadshine-el7", "leadshine-cs2rs",
                                    "oriental-az", "delta-asda", "lexium-32" };

static struct modbus_bench bench;
static char reason[160];

#define SAY(...) (snprintf(reason, sizeof reason, __VA_ARGS__), false)

static bool reaches(enum hal_drive_state state, unsigned ticks)
{
    while (bench.feedback.state != state && ticks-- > 0)
        modbus_bench_tick(&bench);
    return bench.feedback.state == state;
}

/* On the way back something holds the rotor, and the position says so. */
static bool sees_an_obstacle(void)
{
    const struct hal_drive_go back = { .pos_q32 = 4 * UNIT_Q32,
                                       .vel_q32 = UNIT_Q32 };

    sim_modbus_servo_inject(&bench.servo, SIM_MODBUS_SERVO_BLOCKED);
    if (hal_drive_go(&bench.drive.drive, &back) < 0)
        return false;
    modbus_bench_run(&bench, 300 * MS);
    return llabs(bench.feedback.pos_q32 - 5 * UNIT_Q32) < UNIT_Q32 / 100;
}

/* Found, enabled, at 1.2345 units; to 5 units at 4 units/s and 20 units/s2 in
 * the time that takes, which the drive says and an outside device sees; then
 * off.  What a user sees who tries a drive for the first time. */
static bool is_driven(unsigned least_ms, unsigned most_ms)
{
    const struct hal_drive_go go = { .pos_q32 = 5 * UNIT_Q32,
                                     .vel_q32 = 4 * UNIT_Q32,
                                     .acc_q32 = INT64_C(20) << 32,
                                     .dec_q32 = INT64_C(20) << 32 };
    struct hal_drive *drive = &bench.drive.drive;
    unsigned ticks = 0;

    if (!reaches(HAL_DRIVE_OFF, 4000))
        return SAY("not found: %s", bench.feedback.fault_text);
    hal_drive_request(drive, HAL_DRIVE_REQUEST_ENABLE);
    if (!reaches(HAL_DRIVE_ENABLED, 4000))
        return SAY("not enabled: %s", bench.feedback.fault_text);
    if (!bench.servo.enabled)
        return SAY("says that it is enabled and is not");
    if (llabs(bench.feedback.pos_q32 - UNIT_Q32 * 12345 / 10000) > 10000)
        return SAY("not at 1.2345: %.4f",
                   (double)bench.feedback.pos_q32 / 0x1p32);
    if (hal_drive_set_mode(drive, HAL_DRIVE_PROFILE_POSITION) < 0 ||
        hal_drive_go(drive, &go) < 0)
        return SAY("does not go");
    do
        modbus_bench_tick(&bench);
    while (!bench.feedback.arrived && ++ticks < 3000);
    if (!bench.feedback.arrived)
        return SAY("not there: %s", bench.feedback.fault_text);
    if (llabs(sim_modbus_servo_counts(&bench.servo) - 50000) > 8)
        return SAY("at %" PRId64, sim_modbus_servo_counts(&bench.servo));
    if (ticks < least_ms || ticks > most_ms)
        return SAY("after %u ms", ticks);
    if (!sees_an_obstacle())
        return SAY("the position is not that of the rotor");
    hal_drive_request(drive, HAL_DRIVE_REQUEST_OFF);
    if (!reaches(HAL_DRIVE_OFF, 4000) || bench.servo.enabled)
        return SAY("not switched off");
    return true;
}

static void load(unsigned map)
{
    modbus_bench_load(&bench, maps[map]);
    assert_non_null(bench.maker);
}

static bool map_says(enum modbus_map_quantity quantity)
{
    for (unsigned i = 0; i < bench.map.move.count; i++)
        if (bench.map.move.field[i].quantity == quantity)
            return true;
    return false;
}

/* 3.7655 units at 4 units/s: 0.941 s, and 0.2 s of ramps where the map has
 * them, from the request to the answer that it is there, some 80 ms more; without
 * a speed as the drive has been set up. */
static bool is_driven_by_the_map(void)
{
    const bool speed = map_says(MODBUS_VELOCITY);
    const bool ramps = map_says(MODBUS_ACCELERATION);

    modbus_bench_init(&bench);
    if (!speed)
        return is_driven(0, 3000);
    return ramps ? is_driven(1190, 1260) : is_driven(980, 1080);
}

static void every_map_drives_its_maker(void **state)
{
    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        load(i);
        if (!is_driven_by_the_map())
            fail_msg("%s: %s", maps[i], reason);
    }
}

/* A key that comes while the one before is gone to: the drive turns round. */
static void every_map_turns_round_half_way(void **state)
{
    const struct hal_drive_go there = { .pos_q32 = 9 * UNIT_Q32,
                                        .vel_q32 = 4 * UNIT_Q32 };
    const struct hal_drive_go back = { .pos_q32 = 2 * UNIT_Q32,
                                       .vel_q32 = 4 * UNIT_Q32 };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        unsigned ticks = 0;

        load(i);
        modbus_bench_init(&bench);
        struct hal_drive *drive = &bench.drive.drive;
        assert_true(reaches(HAL_DRIVE_OFF, 4000));
        hal_drive_request(drive, HAL_DRIVE_REQUEST_ENABLE);
        assert_true(reaches(HAL_DRIVE_ENABLED, 4000));
        assert_int_equal(hal_drive_set_mode(drive, HAL_DRIVE_PROFILE_POSITION),
                         MOTION_OK);
        assert_int_equal(hal_drive_go(drive, &there), MOTION_OK);
        modbus_bench_run(&bench, 200 * MS);
        assert_int_equal(hal_drive_go(drive, &back), MOTION_OK);
        do
            modbus_bench_tick(&bench);
        while (!bench.feedback.arrived && ++ticks < 5000);
        modbus_bench_run(&bench, 200 * MS);
        if (!bench.feedback.arrived ||
            llabs(sim_modbus_servo_counts(&bench.servo) - 20000) > 8)
            fail_msg("%s: at %" PRId64, maps[i],
                     sim_modbus_servo_counts(&bench.servo));
    }
}

/* Registers that only tell a person something, or are met only by homing or
 * after a fault, are not part of a move. */
static bool is_of_a_move(const struct modbus_map_item *item)
{
    return strcmp(item->name, "alarm") != 0 &&
           strcmp(item->name, "alarm_reset") != 0 &&
           strcmp(item->name, "control") != 0;
}

static void no_map_with_a_wrong_address_does(void **state)
{
    unsigned tried = 0;

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++)
        for (unsigned item = 0, count = 1; item < count; item++)
            for (int off = -2; off <= 2; off++) {
                load(i);
                count = bench.map.item_count;
                /* a stop is not part of it: Leadshine's trigger */
                if (off == 0 || !is_of_a_move(&bench.map.item[item]) ||
                    strcmp(bench.map.item[item].name, "trigger") == 0)
                    continue;
                /* half of a pair whose upper word is 0 is the pair */
                bench.map.item[item].at =
                    (uint16_t)(bench.map.item[item].at + off);
                if (is_driven_by_the_map())
                    fail_msg("%s: %s %+d", maps[i], bench.map.item[item].name,
                             off);
                tried++;
            }
    assert_true(tried > 60);
    print_message("%u wrong addresses\n", tried);
}

static void no_map_with_a_group_elsewhere_does(void **state)
{
    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++)
        for (int off = -2; off <= 2; off++) {
            load(i);
            bench.map.move.at = (uint16_t)(bench.map.move.at + off);
            if (off != 0 && is_driven_by_the_map())
                fail_msg("%s %+d", maps[i], off);
        }
}

static bool is_wide(enum modbus_map_type type)
{
    return type == MODBUS_I32 || type == MODBUS_U32;
}

static void swap(enum modbus_map_order *order)
{
    *order = *order == MODBUS_ABCD ? MODBUS_CDAB : MODBUS_ABCD;
}

static void no_map_with_another_word_order_does(void **state)
{
    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        load(i);
        const unsigned items = bench.map.item_count;
        for (unsigned item = 0; item < items; item++) {
            load(i);
            if (!is_wide(bench.map.item[item].type) ||
                !is_of_a_move(&bench.map.item[item]))
                continue;
            swap(&bench.map.item[item].order);
            if (is_driven_by_the_map())
                fail_msg("%s: %s", maps[i], bench.map.item[item].name);
        }
        load(i);
        const unsigned fields = bench.map.move.count;
        for (unsigned field = 0; field < fields; field++) {
            load(i);
            if (!is_wide(bench.map.move.field[field].type) ||
                bench.map.move.field[field].quantity == MODBUS_CONST)
                continue;
            swap(&bench.map.move.field[field].order);
            if (is_driven_by_the_map())
                fail_msg("%s: field %u", maps[i], field);
        }
    }
}

/* Off by a factor of 10: position, speed, ramps. */
static void no_map_with_another_scale_does(void **state)
{
    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        load(i);
        const unsigned fields = bench.map.move.count;
        for (unsigned field = 0; field < fields; field++)
            for (unsigned up = 0; up < 2; up++) {
                load(i);
                struct modbus_map_field *at = &bench.map.move.field[field];
                if (at->quantity == MODBUS_CONST)
                    continue;
                *(up ? &at->num : &at->den) *= 10;
                if (is_driven_by_the_map())
                    fail_msg("%s: field %u", maps[i], field);
            }
    }
}

/* Revolutions per minute are of its motor. */
static void no_map_with_another_resolution_does(void **state)
{
    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        load(i);
        bool in_rpm = false;
        for (unsigned field = 0; field < bench.map.move.count; field++)
            in_rpm |= bench.map.move.field[field].unit == MODBUS_RPM;
        bench.map.resolution *= 2;
        if (is_driven_by_the_map() == in_rpm)
            fail_msg("%s: %s", maps[i], reason);
    }
}

/* A register that a maker's list does not have, one that is only read, another
 * space, too many at once. */
static void what_a_drive_has_not_it_refuses(void **state)
{
    static const uint8_t too_many[] = { 0x03, 0x03, 0x03, 0x04, 0x03 };
    static const uint8_t read_only[] = { 0x02, 0x02, 0x02, 0x06, 0x02 };
    static const uint16_t said[] = { 0x0B05, 0x1003, 0x007E, 0x005C, 0x1B04 };
    uint16_t value[HAL_MODBUS_READ_MAX] = { 0 };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        load(i);
        modbus_bench_servo(&bench);
        struct modbus_slave *slave = &bench.servo.slave;
        assert_int_equal(
            slave->ops->get(slave, MODBUS_HOLDING, said[i], 1, value), 0);
        assert_int_equal(
            slave->ops->get(slave, MODBUS_INPUT, said[i], 1, value), 0x01);
        assert_int_equal(
            slave->ops->get(slave, MODBUS_HOLDING, 0x7777, 1, value), 0x02);
        assert_int_equal(
            slave->ops->get(slave, MODBUS_HOLDING, 0xFFFF, 2, value), 0x02);
        assert_int_equal(
            slave->ops->set(slave, MODBUS_HOLDING, said[i], 1, value),
            read_only[i]);
        assert_int_equal(slave->ops->get(slave, MODBUS_HOLDING, said[i],
                                         HAL_MODBUS_READ_MAX, value),
                         too_many[i]);
    }
}

/* What a rig file may say is what there is. */
static void every_device_of_a_rig_file_is_there(void **state)
{
    unsigned count = 0;

    (void)state;
    while (sim_modbus_maker_at(count) != NULL)
        count++;
    assert_int_equal(count + 1, RIG_SIM_DEVICES);
    for (unsigned i = 0; i < RIG_SIM_DEVICES; i++)
        assert_int_equal(sim_modbus_maker_find(rig_sim_device_words[i]) == NULL,
                         strcmp(rig_sim_device_words[i], "map") == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_map_drives_its_maker),
        cmocka_unit_test(every_map_turns_round_half_way),
        cmocka_unit_test(no_map_with_a_wrong_address_does),
        cmocka_unit_test(no_map_with_a_group_elsewhere_does),
        cmocka_unit_test(no_map_with_another_word_order_does),
        cmocka_unit_test(no_map_with_another_scale_does),
        cmocka_unit_test(no_map_with_another_resolution_does),
        cmocka_unit_test(what_a_drive_has_not_it_refuses),
        cmocka_unit_test(every_device_of_a_rig_file_is_there),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
