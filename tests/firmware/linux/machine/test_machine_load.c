/* tests/firmware/linux/machine/test_machine_load.c - a load that the rig file
 * gives an axis is turned by its simulated drive, of whatever kind. */
#include <math.h>
#include <string.h>

#include "sim/device/cia402/servo.h"
#include "tests/firmware/linux/machine/machine_bench.h"
#include "tests/support/kind/drives.h"

#define RAD_Q32 (INT64_C(1) << 32)

static struct rig rig;

static void load(void)
{
    unsigned kinds = 0;

    bench_load("tests/data/rad/rig.yaml", &rig);
    for (unsigned i = 0; i < RIG_DRIVE_KINDS; i++)
        /* a board has no motor of its own, a virtual axis none at all */
        kinds += !rig_kinds[i]->samples && i != RIG_VIRTUAL;
    assert_int_equal(rig.axis_count, kinds);
    for (unsigned i = 0; i < rig.axis_count; i++)
        rig.axis[i].sim.load = (struct rig_sim_load){ .given = true,
                                                      .inertia_ratio = 3,
                                                      .frequency_hz = 8,
                                                      .damping = 0.05 };
    /* the first counts backwards */
    rig.axis[0].counts_num = -rig.axis[0].counts_num;
}

static double swing(unsigned i)
{
    return (double)machine_sim_swing_q32(&sim, i) / (double)RAD_Q32;
}

static double twist(unsigned i)
{
    return (double)machine_sim_twist_q32(&sim, i) / (double)RAD_Q32;
}

/* By 1 mrad of the axis, forwards: more than the motor can hold makes it a
 * following error. */
static void push(unsigned i)
{
    struct sim_drivetrain *drive = &sim.mechanics[i].drive;

    drive->y[1] +=
        0.001 * (double)rig.axis[i].counts_num / (double)rig.axis[i].counts_den;
    sim_drivetrain_reset(drive);
}

static void every_kind_of_drive_turns_its_load(void **state)
{
    (void)state;
    load();
    bench_build_ready(&rig);
    ticks(100);
    for (unsigned i = 0; i < rig.axis_count; i++) {
        assert_true(fabs(swing(i)) < 1e-5);
        push(i);
        if (fabs(twist(i) - 0.001) > 1e-5)
            fail_msg("%s: %.8f rad", rig.axis[i].name, twist(i));
    }
    /* its motor is held by its loop: half a period later it is on the other
     * side, and the drive has felt it */
    double least[RIG_DRIVE_KINDS] = { 0 }, felt[RIG_DRIVE_KINDS] = { 0 };
    for (unsigned n = 0; n < 40; n++) {
        tick();
        for (unsigned i = 0; i < rig.axis_count; i++) {
            least[i] = fmin(least[i], twist(i));
            felt[i] = fmax(felt[i], sim.mechanics[i].drive.y[2] == 0 ? 0 : 1);
        }
    }
    for (unsigned i = 0; i < rig.axis_count; i++)
        if (least[i] > -0.0004 || felt[i] == 0)
            fail_msg("%s: %.6f rad", rig.axis[i].name, least[i]);
    ticks(1000);
    assert_int_equal(machine.controller.state, CONTROLLER_READY);
    for (unsigned i = 0; i < rig.axis_count; i++)
        if (swing(i) > 0.0001)
            fail_msg("%s still swings by %.6f rad", rig.axis[i].name, swing(i));
}

static void an_axis_without_one_has_a_motor_alone(void **state)
{
    (void)state;
    load();
    for (unsigned i = 1; i < rig.axis_count; i++)
        rig.axis[i].sim.load.given = false;
    bench_build_ready(&rig);
    assert_non_null(SERVO_OF(sim_cia402, &sim, 0)->base.plant.mechanics);
    for (unsigned i = 1; i < rig.axis_count; i++)
        assert_int_equal(sim.mechanics[i].drive.config.inertias, 0);
}

/* Twice the rated torque: 0.5 s ln(4 / 3) after it began; the drive says it in its
 * own way, an ODrive of 0.5 as an error of its motor. */
static void a_motor_that_is_too_hot_stops_every_kind_of_drive(void **state)
{
    static const int16_t codes[RIG_DRIVE_KINDS] = {
        [RIG_CIA402] = 0x2350, [RIG_ODRIVE] = 0x1, [RIG_MOTEUS] = 38
    };

    (void)state;
    load();
    const unsigned axes = rig.axis_count;
    for (unsigned i = 0; i < axes; i++) {
        load();
        rig.axis[i].sim.load.given = false;
        rig.axis[i].sim.motor =
            (struct rig_sim_motor){ .given = true,
                                    .rated_q32 = RAD_Q32 / 2,
                                    .thermal_ns = 500000000,
                                    .warm_load = 0.9 };
        bench_build_ready(&rig);
        ticks(100);
        struct sim_plant *const plant = machine_sim_plant_of(&sim, i);
        const double counts =
            (double)rig.axis[i].counts_num / (double)rig.axis[i].counts_den;
        sim_plant_pull(plant, -counts);
        const int64_t begin_ns = now_ns;
        while (!plant->winding.hot && now_ns < begin_ns + 1000000000)
            tick();
        const double took_s = 1e-9 * (double)(now_ns - begin_ns);
        ticks(25); /* the heartbeat of an ODrive says it */
        assert_int_equal(machine.controller.state, CONTROLLER_FAULT);
        const struct controller_fault_record *const fault =
            &machine.controller.fault;
        assert_int_equal(fault->axis, i);
        if (codes[rig.axis[i].kind] != 0)
            assert_int_equal(fault->drive_code, codes[rig.axis[i].kind]);
        if (took_s < 0.5 * log(4.0 / 3) || took_s > 0.5 * log(4.0 / 3) + 0.02)
            fail_msg("%s: after %.3f s", rig.axis[i].name, took_s);
    }
}

/* Its stops are where the axis is at power-on, and it cannot be beyond them. */
static void a_load_that_cannot_be_there_is_refused(void **state)
{
    struct machine_ports ports;
    char message[YAML_MESSAGE_MAX];

    (void)state;
    load();
    rig.axis[1].sim.load.has_stops = true;
    rig.axis[1].sim.load.stop_q32[0] = RAD_Q32 / 2;
    rig.axis[1].sim.load.stop_q32[1] = RAD_Q32;
    assert_true(machine_sim_init(&sim, &rig, false, &ports, message) < 0);
    assert_non_null(strstr(message, "shoulder"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_of_drive_turns_its_load),
        cmocka_unit_test(an_axis_without_one_has_a_motor_alone),
        cmocka_unit_test(a_motor_that_is_too_hot_stops_every_kind_of_drive),
        cmocka_unit_test(a_load_that_cannot_be_there_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
