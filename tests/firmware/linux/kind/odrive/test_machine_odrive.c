/* tests/firmware/linux/kind/odrive/test_machine_odrive.c - the rig of
 * examples/odrive: its ODrive, built, driven, and what happens when it fails. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/job/budget.h"
#include "firmware/host/kind/turn/budget.h"
#include "firmware/linux/base/disk.h"
#include "motion/core/fixed.h"
#include "sim/device/odrive/servo.h"
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
    assert_int_equal(rig.bus[0].kind, RIG_CAN);
    assert_int_equal(rig.bus[0].data_bit_rate, 0);
    assert_int_equal(rig.axis[SLIDER].kind, RIG_ODRIVE);
    assert_int_equal(rig.axis[SLIDER].node_id, 0);
    assert_int_equal(rig.axis[SLIDER].enable_watchdog, 190);
    assert_int_equal(rig.axis[SLIDER].watchdog_timeout, 191);
    rig_axis_turn(&rig.axis[SLIDER], &num, &den);
    assert_int_equal(num * 8, den); /* 0.125 per mm */
}

static void its_watchdogs_are_in_force(void **state)
{
    (void)state;
    build_ready();
    assert_true(SERVO_OF(sim_odrive, &sim, SLIDER)->watchdog_on);
    assert_true(SERVO_OF(sim_odrive, &sim, SLIDER)->watchdog_s > 0.0999f &&
                SERVO_OF(sim_odrive, &sim, SLIDER)->watchdog_s < 0.1001f);
}

/* slew hangs: nothing is sent any more, and both let go by themselves. */
static void they_stop_when_nobody_speaks(void **state)
{
    (void)state;
    build_ready();
    now_ns += 150 * MS;
    (void)hal_clock_wait_until(machine.ports.clock, now_ns);
    assert_int_equal(SERVO_OF(sim_odrive, &sim, SLIDER)->axis_state,
                     1); /* idle */
    assert_int_equal(SERVO_OF(sim_odrive, &sim, SLIDER)->error, 0x1000000);
}

static const struct failure failures[] = {
    { SLIDER, SIM_SERVO_ENCODER, CONTROLLER_FAULT_DRIVE, 25,
      "ODrive error 0x00000008: missing estimate" },
    { SLIDER, SIM_SERVO_TRIP, CONTROLLER_FAULT_DRIVE, 25,
      "ODrive error 0x00001000: current limit" },
    /* alone on its bus: nobody acknowledges what slew sends */
    { SLIDER, SIM_SERVO_SILENT, CONTROLLER_FAULT_BUS_PASSIVE, 10, "" },
    { SLIDER, SIM_SERVO_NOT_A_NUMBER, CONTROLLER_FAULT_STALE, 10, "" },
    { SLIDER, SIM_SERVO_DEAF, CONTROLLER_FAULT_STALE, 20, "" },
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
    failure_is_over(SLIDER);
}

/* ---- homing by the ODrive ---- */

/* Its end stop is at -20 mm; it wakes up at 100 mm, and says 0 there. */
static void build_homing(bool is_05)
{
    struct homing_config *homing;

    load();
    homing = &rig.axis[SLIDER].homing;
    *homing = (struct homing_config){
        .by = HOMING_DRIVE,
        .direction = -1,
        .order = 1,
        .fast_q32 = 50 * MOTION_FIXED_ONE_Q32,
        .pos_q32 = -20 * MOTION_FIXED_ONE_Q32,
        .go_q32 = 5 * MOTION_FIXED_ONE_Q32,
        .goes = true,
        .timeout_ns = 7000 * MS,
    };
    if (is_05)
        rig.axis[SLIDER].enable_watchdog = rig.axis[SLIDER].watchdog_timeout =
            0;
    bench_build_ready(&rig);
    assert_int_equal(homing_start(&machine.homing, 1u << SLIDER), MOTION_OK);
}

static void until_homed(enum homing_state end)
{
    for (int i = 0; i < 8000 && homing_is_running(&machine.homing); i++)
        tick();
    if (machine.homing.state != end)
        fail_msg("%s: %s", homing_state_text(machine.homing.state),
                 homing_error_text(machine.homing.error));
}

/* Where the motor is; 0.125 turns per mm. */
static double slider_mm(void)
{
    return (double)sim_servo_pos_q24(
               &SERVO_OF(sim_odrive, &sim, SLIDER)->base) /
               (16777216.0 * SIM_ODRIVE_COUNTS * 0.125) +
           100;
}

static void an_odrive_homes_by_itself(void **state)
{
    (void)state;
    for (int is_05 = 0; is_05 < 2; is_05++) {
        const struct controller_axis *axis;

        build_homing(is_05 != 0);
        axis = &machine.controller.axis[SLIDER];
        assert_false(axis->homed);
        until_homed(HOMING_DONE);
        assert_true(axis->homed);
        assert_int_equal(machine.controller.state, CONTROLLER_READY);
        for (int i = 0; i < 500; i++)
            tick();
        assert_true(slider_mm() > 4.99 && slider_mm() < 5.01);
        assert_in_range(axis->feedback.pos_q32, 4.99 * MOTION_FIXED_ONE_Q32,
                        5.01 * MOTION_FIXED_ONE_Q32);
    }
}

static void a_homing_that_does_not_arrive_is_a_failure(void **state)
{
    (void)state;
    build_homing(false);
    for (int i = 0; i < 100; i++)
        tick();
    failure_inject(SLIDER, SIM_SERVO_BLOCKED);
    until_homed(HOMING_FAILED);
    assert_int_equal(machine.homing.error, HOMING_TIMEOUT);
    assert_false(machine.controller.axis[SLIDER].homed);
}

static void a_homing_that_disarms_is_a_fault(void **state)
{
    (void)state;
    build_homing(false);
    for (int i = 0; i < 100; i++)
        tick();
    failure_inject(SLIDER, SIM_SERVO_ENCODER);
    until_homed(HOMING_FAILED);
    assert_false(machine.controller.axis[SLIDER].homed);
    until(CONTROLLER_FAULT);
    assert_string_equal(machine.controller.axis[SLIDER].feedback.fault_text,
                        "ODrive error 0x00000008: missing estimate");
}

/* By hand: 47 + 8 * 8 + (34 + 64 - 1) / 4 = 135, and 47 + 33 / 4 = 55. */
static void the_budget_of_an_odrive(void **state)
{
    struct rig_frame frame[RIG_FRAMES_MAX];
    struct budget budget;
    char advice[BUDGET_ADVICE_MAX];

    (void)state;
    load();
    assert_int_equal(rig_kinds[RIG_ODRIVE]->frames(&rig, SLIDER, frame), 4);
    assert_int_equal((int)frame[0].bits, 135);
    assert_int_equal((int)frame[1].bits, 55);
    /* behind its own question and answer, with the set point's own time */
    assert_int_equal(turn_budget_latency_ns(&rig, SLIDER), 325000);
    assert_int_equal(turn_budget_answer_ns(&rig, SLIDER), 135000);
    budget_of(&rig, 0, NULL, &budget);
    assert_true(budget_fits(&budget));
    assert_in_range((int)(budget.most * 10000), 3316, 3318);
    rig.bus[0].bit_rate = 250000;
    budget_free(&budget);
    budget_of(&rig, 0, NULL, &budget);
    assert_false(budget_fits(&budget));
    budget_advice(&budget, advice);
    assert_string_equal(advice, "a tick of 1.34 ms, or 500 kbit/s");
    budget_free(&budget);
}

/* ---- what the wire can say ---- */

static const struct {
    const char *kind, *bus, *turn, *want;
} speeds[] = {
    /* 250 mm/s: 32.75 and 32.775 turns/s */
    { "odrive", "bit_rate: 1 Mbit/s", "-0.131", NULL },
    { "odrive", "bit_rate: 1 Mbit/s", "-0.1311",
      "build/test_machine_odrive.yaml:9:12: drive runs faster than "
      "the 16 bits of ODrive's velocity feed-forward can say, expected a "
      "velocity in the axis's limits or turns for at most 32.767 turns/s" },
};

static void a_speed_that_does_not_fit_the_frame_is_refused(void **state)
{
    static const char path[] = "build/test_machine_odrive.yaml";
    static struct rig read;

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(speeds); i++) {
        char message[YAML_MESSAGE_MAX] = "";
        FILE *file = fopen(path, "w");

        assert_non_null(file);
        fprintf(file,
                "buses:\n  can0: {kind: can, %s}\n"
                "axes:\n  slider:\n    unit: mm\n"
                "    limits: {position: [0 mm, 900 mm], velocity: 250 mm/s,\n"
                "             acceleration: 400 mm/s2}\n"
                "    following_error: {floor: 2 mm}\n"
                "    drive: {kind: %s, bus: can0, node: 1, turns: %s per mm%s}"
                "\n",
                speeds[i].bus, speeds[i].kind, speeds[i].turn,
                i < 2 ? ", unsupervised: yes" : "");
        fclose(file);
        const int err = rig_load(&disk_files, path, &read, message);
        (void)remove(path);
        if ((err == 0) != (speeds[i].want == NULL) ||
            (err < 0 && strcmp(message, speeds[i].want) != 0))
            fail_msg("row %u: %s", i, message);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_example_is_read_as_written),
        cmocka_unit_test(its_watchdogs_are_in_force),
        cmocka_unit_test(they_stop_when_nobody_speaks),
        cmocka_unit_test(faults_stop_the_group),
        cmocka_unit_test(after_a_fault_it_starts_again),
        cmocka_unit_test(an_odrive_homes_by_itself),
        cmocka_unit_test(a_homing_that_does_not_arrive_is_a_failure),
        cmocka_unit_test(a_homing_that_disarms_is_a_fault),
        cmocka_unit_test(the_budget_of_an_odrive),
        cmocka_unit_test(a_speed_that_does_not_fit_the_frame_is_refused),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
