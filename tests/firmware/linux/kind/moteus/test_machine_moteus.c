/* tests/firmware/linux/kind/moteus/test_machine_moteus.c - the rig of
 * examples/odrive: its moteus, built, driven, and what happens when it fails. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/job/budget.h"
#include "firmware/linux/base/disk.h"
#include "hal/can/bits.h"
#include "motion/core/fixed.h"
#include "sim/device/moteus/servo.h"
#include "tests/firmware/linux/kind/machine_failures.h"
#include "tests/support/kind/drives.h"

#define MS INT64_C(1000000)

enum { SLIDER, PAN };

static struct rig rig;

static void load(void)
{
    bench_load("examples/odrive/rig.yaml", &rig);
}

static void build_ready(void)
{
    load();
    bench_build_ready(&rig);
}

static void the_example_is_read_as_written(void **state)
{
    int64_t num, den;

    (void)state;
    load();
    assert_int_equal(rig.bus[1].data_bit_rate, 5000000);
    assert_int_equal(rig.axis[PAN].kind, RIG_MOTEUS);
    rig_axis_turn(&rig.axis[PAN], &num, &den);
    assert_int_equal(num * 360, den * 50);
}

static void its_watchdog_is_in_force(void **state)
{
    (void)state;
    build_ready();
    assert_true(SERVO_OF(sim_moteus, &sim, PAN)->command[0x7] > 0.0999f &&
                SERVO_OF(sim_moteus, &sim, PAN)->command[0x7] < 0.1001f);
}

/* slew hangs: nothing is sent any more, and it lets go by itself. */
static void it_stops_when_nobody_speaks(void **state)
{
    (void)state;
    build_ready();
    now_ns += 150 * MS;
    (void)hal_clock_wait_until(machine.ports.clock, now_ns);
    assert_int_equal(SERVO_OF(sim_moteus, &sim, PAN)->mode, 11);
}

static const struct failure failures[] = {
    { PAN, SIM_SERVO_ENCODER, CONTROLLER_FAULT_DRIVE, 3,
      "moteus fault 35: encoder" },
    { PAN, SIM_SERVO_TRIP, CONTROLLER_FAULT_DRIVE, 3,
      "moteus fault 33: motor driver, perhaps under-voltage" },
    { PAN, SIM_SERVO_SILENT, CONTROLLER_FAULT_BUS_PASSIVE, 10, "" },
    { PAN, SIM_SERVO_DEAF, CONTROLLER_FAULT_STALE, 10, "" },
    { PAN, SIM_SERVO_NOT_A_NUMBER, CONTROLLER_FAULT_STALE, 10, "" },
};

static void faults_stop_the_group(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(failures); i++) {
        build_ready();
        failure_stops_the_group(&failures[i]);
    }
}

static void after_a_fault_it_starts_again(void **state)
{
    (void)state;
    build_ready();
    failure_is_over(PAN);
}

/* What was counted is never less than what a frame really has. */
static void no_frame_is_longer_than_its_budget(void **state)
{
    struct rig_frame frame[RIG_FRAMES_MAX];

    (void)state;
    seed_from("frames");
    load();
    (void)rig_kinds[RIG_MOTEUS]->frames(&rig, PAN, frame);
    for (int i = 0; i < 20000; i++) {
        struct hal_can_frame order = { .id = 0x8001,
                                       .extended = true,
                                       .fd = true,
                                       .switched = true,
                                       .len = 32 };
        struct can_bits bits;

        for (unsigned k = 0; k < order.len; k++)
            order.data[k] = (i & 1) != 0 ? 0 : (uint8_t)draw();
        bits = can_bits_of(&order);
        assert_true(bits.slow + bits.fast / 5.0 <= frame[0].bits);
        order.id = 0x0100;
        order.extended = false;
        order.len = 24;
        bits = can_bits_of(&order);
        assert_true(bits.slow + bits.fast / 5.0 <= frame[1].bits);
    }
}

/* Its frames have floats: 250 mm/s are 32.775 turns/s, which an ODrive's have
 * no room for. */
static void a_speed_of_many_turns_is_taken(void **state)
{
    static const char path[] = "build/test_machine_moteus.yaml";
    static struct rig read;
    char message[YAML_MESSAGE_MAX] = "";
    FILE *file = fopen(path, "w");

    (void)state;
    assert_non_null(file);
    fputs("buses:\n  can0: {kind: can, bit_rate: 1 Mbit/s, data_bit_rate: 5 "
          "Mbit/s}\n"
          "axes:\n  slider:\n    unit: mm\n"
          "    limits: {position: [0 mm, 900 mm], velocity: 250 mm/s,\n"
          "             acceleration: 400 mm/s2}\n"
          "    following_error: {floor: 2 mm}\n"
          "    drive: {kind: moteus, bus: can0, node: 1, turns: 0.1311 per "
          "mm}\n",
          file);
    fclose(file);
    const int err = rig_load(&disk_files, path, &read, message);
    (void)remove(path);
    if (err != 0)
        fail_msg("%s", message);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_example_is_read_as_written),
        cmocka_unit_test(its_watchdog_is_in_force),
        cmocka_unit_test(it_stops_when_nobody_speaks),
        cmocka_unit_test(faults_stop_the_group),
        cmocka_unit_test(after_a_fault_it_starts_again),
        cmocka_unit_test(no_frame_is_longer_than_its_budget),
        cmocka_unit_test(a_speed_of_many_turns_is_taken),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
