/* tests/firmware/control/test_homing.c - homing on the simulated machine:
 * switches that the axes press, from every place, with a fault in every
 * state. */
#include <string.h>

#include "firmware/host/job/job.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/machine/machine_sim.h"
#include "motion/core/fixed.h"
#include "sim/device/cia402/servo.h"
#include "tests/support/check.h"
#include "tests/support/kind/drives.h"

#define MS   INT64_C(1000000)
#define UNIT MOTION_FIXED_ONE_Q32

/* Of tests/data/homing, in the order of the file. */
enum { SLIDE, LIFT, PAN };
enum { STOP, HOME, LEFT, RIGHT, TOP, BOTTOM };

static struct rig rig;
static struct machine_sim sim;
static struct machine machine;

static int read_rig(void **state)
{
    (void)state;
    char message[YAML_MESSAGE_MAX];
    if (rig_load(&disk_files, "tests/data/homing/rig.yaml", &rig, message) == 0)
        return 0;
    print_message("%s\n", message);
    return -1;
}

static void tick(void)
{
    const int64_t now_ns = sim.world.now_ns + rig.period_ns;
    sim_world_run(&sim.world, now_ns);
    machine_tick(&machine, now_ns);
}

static void ticks(unsigned count)
{
    while (count-- > 0)
        tick();
}

/* Ready, with slide at a true position of so many mm. */
static void power_on(int start_mm)
{
    char message[YAML_MESSAGE_MAX];
    struct machine_ports ports;
    rig.axis[SLIDE].sim.start_q32 = start_mm * UNIT;
    assert_int_equal(machine_sim_init(&sim, &rig, false, &ports, message), 0);
    assert_int_equal(machine_init(&machine, &rig, &ports, message), 0);
    tick();
    assert_int_equal(controller_enable(&machine.controller), MOTION_OK);
    for (int i = 0; machine.controller.state != CONTROLLER_READY; i++) {
        assert_true(i < 10000);
        tick();
    }
}

static int64_t true_q32(unsigned axis)
{
    return machine_sim_pos_q32(&sim, axis) + sim.zero_q32[axis];
}

/* The axis says where it really is: but for a quarter of a millisecond at 5
 * mm/s until the simulated switch is looked at, another in which the drive
 * measures its position, and two counts: 3 um. */
static void expect_knows(unsigned axis)
{
    const int64_t says_q32 = machine.controller.axis[axis].feedback.pos_q32;
    assert_true(machine.controller.axis[axis].homed);
    assert_in_range(llabs(says_q32 - true_q32(axis)), 0, 3 * UNIT / 1000);
}

static void run_homing(uint32_t axes)
{
    assert_int_equal(homing_start(&machine.homing, axes), MOTION_OK);
    for (int i = 0; homing_is_running(&machine.homing); i++) {
        assert_true(i < 70000);
        tick();
    }
}

static void expect_homed(uint32_t axes)
{
    run_homing(axes);
    if (machine.homing.state != HOMING_DONE)
        fail_msg("axis %u: %s", machine.homing.axis,
                 homing_error_text(machine.homing.error));
    ticks(100);
    assert_int_equal(machine.controller.fault.fault, CONTROLLER_FAULT_NONE);
}

static void expect_failed(enum homing_error error, unsigned axis)
{
    assert_int_equal(machine.homing.state, HOMING_FAILED);
    if (machine.homing.error != error)
        fail_msg("got: %s", homing_error_text(machine.homing.error));
    assert_int_equal(machine.homing.axis, axis);
    assert_false(machine.controller.axis[axis].homed);
    assert_false(machine.controller.axis[axis].seeking);
    assert_false(machine.controller.axis[axis].by_profile);
    /* and stands */
    ticks(50);
    const int64_t at_q32 = true_q32(axis);
    ticks(300);
    assert_in_range(llabs(true_q32(axis) - at_q32), 0, UNIT / 1000);
}

/* --- it works ---------------------------------------------------------- */

static void slide_is_found_from_everywhere(void **state)
{
    /* in front of the switch, on it, between it and the limit switch, on
     * that */
    static const int start_mm[] = { 600, 250, 0,   -9,  -10, -12,
                                    -15, -16, -19, -20, -22 };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(start_mm); i++) {
        power_on(start_mm[i]);
        expect_homed(1u << SLIDE);
        expect_knows(SLIDE);
        assert_in_range(machine.controller.axis[SLIDE].target.pos_q32,
                        20 * UNIT, 20 * UNIT);
    }
}

/* No gpio line: home and limit inputs of 0x60FD, which comes when it changes.
 * They are met at 5 mm/s, a millisecond or two late. */
static void the_drives_own_inputs_are_found(void **state)
{
    char message[YAML_MESSAGE_MAX];

    (void)state;
    if (rig_load(&disk_files, "tests/data/homing/drive.yaml", &rig, message) <
        0)
        fail_msg("%s", message);
    power_on(250);
    for (unsigned i = 0; i < rig.axis_count; i++) {
        expect_homed(1u << i);
        assert_true(machine.controller.axis[i].homed);
        assert_in_range(
            llabs(machine.controller.axis[i].feedback.pos_q32 - true_q32(i)), 0,
            UNIT / 50);
    }
}

static void all_axes_one_after_the_other(void **state)
{
    (void)state;
    power_on(250);
    assert_int_equal(homing_wanted(&machine.homing), 7);
    assert_int_equal(homing_start(&machine.homing, 7), MOTION_OK);
    unsigned turn[3] = { 0 }, turns = 0, before = 99;
    while (homing_is_running(&machine.homing)) {
        const unsigned axis = machine.homing.axis;
        if (axis != before && turns < 3)
            turn[turns++] = axis;
        before = axis;
        for (unsigned i = 0; i < 3; i++) /* the others stand */
            if (i != axis)
                assert_int_equal(machine.controller.axis[i].target.vel_q32, 0);
        tick();
    }
    assert_int_equal(machine.homing.state, HOMING_DONE);
    assert_int_equal(turn[0], LIFT);
    assert_int_equal(turn[1], SLIDE);
    ticks(100);
    for (unsigned i = 0; i < 3; i++)
        expect_knows(i);
    assert_int_equal(homing_wanted(&machine.homing), 0);
    /* lift's switch is outside its range: it does not stay there */
    assert_int_equal(machine.controller.axis[LIFT].target.pos_q32, 300 * UNIT);
}

static void no_move_before_homing(void **state)
{
    struct motion_segment storage[4];
    struct motion_track track;
    const struct motion_track *tracks[CONTROLLER_AXES_MAX] = { [LIFT] =
                                                                   &track };
    int axis = -1;
    (void)state;
    power_on(250);
    motion_track_init(&track, storage, 4, 0);
    assert_int_equal(motion_track_append_dwell(&track, 1000 * MS * 4096), 0);
    assert_int_equal(controller_start(&machine.controller, tracks, &axis),
                     MOTION_E_UNHOMED);
    assert_int_equal(axis, LIFT);
    expect_homed(1u << LIFT);
    motion_track_init(&track, storage, 4,
                      machine.controller.axis[LIFT].target.pos_q32);
    assert_int_equal(motion_track_append_dwell(&track, 1000 * MS * 4096), 0);
    assert_int_equal(controller_start(&machine.controller, tracks, &axis),
                     MOTION_OK);
}

static void limits_count_again_afterwards(void **state)
{
    const struct controller_jog_goal far = { .axis = SLIDE,
                                             .pos_q32 = -1 * UNIT,
                                             .vel_q32 = 20 * UNIT };
    (void)state;
    power_on(250);
    expect_homed(1u << SLIDE);
    assert_int_equal(controller_jog(&machine.controller, &machine.jog, &far),
                     MOTION_E_LIMIT);
    sim_gpio_drive(&sim.line[LEFT], SIM_GPIO_HIGH);
    const struct controller_jog_goal back = { .axis = SLIDE,
                                              .pos_q32 = 1 * UNIT,
                                              .vel_q32 = 20 * UNIT };
    assert_int_equal(controller_jog(&machine.controller, &machine.jog, &back),
                     MOTION_OK);
    ticks(10);
    assert_int_equal(machine.controller.fault.fault,
                     CONTROLLER_FAULT_LIMIT_SWITCH);
}

static void a_drive_that_was_lost_is_unhomed(void **state)
{
    (void)state;
    power_on(250);
    expect_homed(1u << SLIDE);
    sim_cia402_inject(SERVO_OF(sim_cia402, &sim, SLIDE), SIM_CIA402_REBOOT);
    for (int i = 0; machine.controller.state != CONTROLLER_FAULT; i++) {
        assert_true(i < 1000);
        tick();
    }
    ticks(1000);
    assert_false(machine.controller.axis[SLIDE].homed);
}

/* --- what can be wrong with switches ------------------------------------ */

static void a_switch_that_never_comes(void **state)
{
    (void)state;
    power_on(250);
    rig.line[HOME].has_sim = false;
    rig.line[LEFT].has_sim = false;
    run_homing(1u << SLIDE);
    expect_failed(HOMING_NOT_FOUND, SLIDE);
    assert_int_equal(machine.controller.state, CONTROLLER_READY);
    /* no further than it was told */
    assert_in_range(250 * UNIT - true_q32(SLIDE), 699 * UNIT, 701 * UNIT);
}

static void only_the_limit_switches_come(void **state)
{
    (void)state;
    power_on(250);
    rig.line[HOME].has_sim = false;
    run_homing(1u << SLIDE);
    expect_failed(HOMING_WRONG_LIMIT, SLIDE);
    assert_int_equal(machine.controller.state, CONTROLLER_READY);
}

static void a_switch_that_does_not_let_go(void **state)
{
    (void)state;
    power_on(250);
    rig.line[HOME].sim_high_q32 = 1000 * UNIT;
    rig.line[RIGHT].has_sim = false;
    run_homing(1u << SLIDE);
    expect_failed(HOMING_STUCK, SLIDE);
}

static void a_switch_that_cannot_be_read_is_active(void **state)
{
    (void)state;
    power_on(250);
    rig.line[HOME].has_sim = false;
    rig.line[RIGHT].has_sim = false;
    sim_gpio_drive(&sim.line[HOME], SIM_GPIO_DEAD);
    run_homing(1u << SLIDE);
    expect_failed(HOMING_STUCK, SLIDE);
}

static void both_limit_switches_at_once(void **state)
{
    (void)state;
    power_on(250);
    rig.line[LEFT].has_sim = rig.line[RIGHT].has_sim = false;
    assert_int_equal(homing_start(&machine.homing, 1u << SLIDE), MOTION_OK);
    ticks(300);
    sim_gpio_drive(&sim.line[LEFT], SIM_GPIO_HIGH);
    sim_gpio_drive(&sim.line[RIGHT], SIM_GPIO_HIGH);
    while (homing_is_running(&machine.homing))
        tick();
    for (int i = 0; machine.controller.state != CONTROLLER_FAULT; i++) {
        assert_true(i < 1000);
        tick();
    }
    expect_failed(HOMING_BOTH_LIMITS, SLIDE);
    assert_int_equal(machine.controller.fault.fault,
                     CONTROLLER_FAULT_LIMIT_SWITCH);
}

static void it_may_take_too_long(void **state)
{
    (void)state;
    rig.axis[SLIDE].homing.timeout_ns = 2000 * MS;
    power_on(250);
    run_homing(1u << SLIDE);
    expect_failed(HOMING_TIMEOUT, SLIDE);
    assert_int_equal(machine.controller.state, CONTROLLER_READY);
}

/* --- a fault in every state ---------------------------------------------- */

enum { BY_ESTOP, BY_DRIVE, BY_SILENCE, BY_ROTOR, BY_OPERATOR, WAYS };

static void break_it(int displacement)
{
    switch (displacement) {
    case BY_ESTOP:
        sim_gpio_drive(&sim.line[STOP], SIM_GPIO_HIGH);
        break;
    case BY_DRIVE:
        sim_cia402_inject(SERVO_OF(sim_cia402, &sim, SLIDE),
                          SIM_CIA402_OVERCURRENT);
        break;
    case BY_SILENCE:
        sim_cia402_inject(SERVO_OF(sim_cia402, &sim, SLIDE), SIM_CIA402_SILENT);
        break;
    case BY_ROTOR:
        sim_cia402_inject(SERVO_OF(sim_cia402, &sim, SLIDE),
                          SIM_CIA402_BLOCKED);
        break;
    default:
        controller_stop(&machine.controller);
        break;
    }
}

/* Ticks from the injection until nothing is homing any more. */
static unsigned homing_after(enum homing_state in, int displacement,
                             int start_mm)
{
    unsigned count = 0;
    power_on(start_mm);
    assert_int_equal(homing_start(&machine.homing, 1u << SLIDE), MOTION_OK);
    for (int i = 0; machine.homing.state != in; i++) {
        if (i > 30000)
            fail_msg("never %s", homing_state_text(in));
        tick();
    }
    break_it(displacement);
    for (; homing_is_running(&machine.homing); count++) {
        assert_true(count < 20000);
        tick();
    }
    return count;
}

static void a_fault_in_every_state_ends_it(void **state)
{
    static const struct {
        enum homing_state in;
        int start_mm;
    } rows[] = {
        { HOMING_SEARCH, 100 },   { HOMING_SLOW_DOWN, 100 },
        { HOMING_REVERSE, -16 },  { HOMING_RETURN, -16 },
        { HOMING_LEAVE, 100 },    { HOMING_TURN, 100 },
        { HOMING_APPROACH, 100 }, { HOMING_SETTLE, 100 },
        { HOMING_GO, 100 },
    };
    /* the most ticks that each may take to be seen: the input, the statusword,
     * four lost TPDOs, the following error (2 mm and twice the 0.4 mm of a ramp
     * at 5 mm/s, 560 ms, and the ramps), and the stop of each; the operator's ramp */
    static const unsigned most[WAYS] = { 122, 126, 128, 770, 150 };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        for (int displacement = 0; displacement < WAYS; displacement++) {
            /* at rest a blocked rotor is no fault */
            const unsigned count =
                homing_after(rows[i].in, displacement, rows[i].start_mm);
            const bool done = machine.homing.state == HOMING_DONE;
            if (done || count > most[displacement])
                fail_msg("%s, way %d: %s after %u ticks",
                         homing_state_text(rows[i].in), displacement,
                         done ? "homed" : "failed", count);
            assert_int_equal(machine.homing.error, displacement == BY_OPERATOR
                                                       ? HOMING_STOPPED
                                                       : HOMING_FAULT);
            assert_false(machine.controller.axis[SLIDE].seeking);
            for (int k = 0; displacement != BY_OPERATOR && k < 3000 &&
                            machine.controller.state != CONTROLLER_FAULT;
                 k++)
                tick();
            assert_int_equal(machine.controller.state,
                             displacement == BY_OPERATOR ? CONTROLLER_READY
                                                         : CONTROLLER_FAULT);
            if (rows[i].in < HOMING_SETTLE) /* later the edge is known */
                assert_false(machine.controller.axis[SLIDE].homed);
            if (displacement == BY_OPERATOR)
                continue;
            ticks(500); /* nothing starts by itself */
            const int64_t at_q32 = true_q32(SLIDE);
            ticks(500);
            assert_in_range(llabs(true_q32(SLIDE) - at_q32), 0, UNIT / 1000);
            assert_int_equal(homing_start(&machine.homing, 1), MOTION_E_STATE);
        }
}

/* --- the drive's own homing ----------------------------------------------- */

/* 27: to the home switch from the positive side. */
static void give_pan_to_its_drive(int method)
{
    struct homing_config *homing = &rig.axis[PAN].homing;
    homing->by = HOMING_DRIVE;
    homing->method = method;
    homing->pos_q32 = -20 * UNIT;
    homing->goes = true;
    homing->go_q32 = 5 * UNIT;
    homing->timeout_ns = 20000 * MS;
}

static void the_drive_homes_by_itself(void **state)
{
    (void)state;
    give_pan_to_its_drive(27);
    power_on(250);
    expect_homed(1u << PAN);
    expect_knows(PAN);
    assert_int_equal(machine.controller.axis[PAN].target.pos_q32, 5 * UNIT);
    assert_int_equal(machine.controller.axis[PAN].offset_q32, 0);
    assert_false(machine.controller.axis[PAN].by_profile);
    /* it follows set points again */
    const struct controller_jog_goal goal = { .axis = PAN,
                                              .pos_q32 = 45 * UNIT,
                                              .vel_q32 = 30 * UNIT };
    assert_int_equal(controller_jog(&machine.controller, &machine.jog, &goal),
                     MOTION_OK);
    ticks(4000);
    expect_knows(PAN);
    assert_in_range(true_q32(PAN), 44 * UNIT, 46 * UNIT);
}

static void a_drive_without_that_method_is_a_failure(void **state)
{
    (void)state;
    give_pan_to_its_drive(36); /* reserved */
    power_on(250);
    run_homing(1u << PAN);
    assert_int_equal(machine.homing.state, HOMING_FAILED);
    assert_false(machine.controller.axis[PAN].homed);
    ticks(3000);
    const int64_t at_q32 = true_q32(PAN);
    ticks(300);
    assert_in_range(llabs(true_q32(PAN) - at_q32), 0, UNIT / 1000);
}

static void a_fault_while_the_drive_homes(void **state)
{
    (void)state;
    for (int displacement = 0; displacement < 3; displacement++) {
        give_pan_to_its_drive(27);
        power_on(250);
        assert_int_equal(homing_start(&machine.homing, 1u << PAN), MOTION_OK);
        while (machine.homing.state != HOMING_RUN)
            tick();
        ticks(500);
        if (displacement == 0)
            sim_gpio_drive(&sim.line[STOP], SIM_GPIO_HIGH);
        else if (displacement == 1)
            sim_cia402_inject(SERVO_OF(sim_cia402, &sim, PAN),
                              SIM_CIA402_OVERCURRENT);
        else
            controller_stop(&machine.controller);
        for (int i = 0; homing_is_running(&machine.homing); i++) {
            assert_true(i < 6000);
            tick();
        }
        assert_int_equal(machine.homing.state, HOMING_FAILED);
        assert_int_equal(machine.homing.error,
                         displacement == 2 ? HOMING_STOPPED : HOMING_FAULT);
        ticks(2500); /* a ramp at 60 deg/s2 from 7.5 deg/s is over */
        assert_false(machine.controller.axis[PAN].homed);
        const int64_t at_q32 = true_q32(PAN);
        ticks(500);
        assert_in_range(llabs(true_q32(PAN) - at_q32), 0, UNIT / 1000);
        assert_int_equal(machine.controller.state, displacement == 2
                                                       ? CONTROLLER_READY
                                                       : CONTROLLER_FAULT);
    }
}

static void wherever_the_switches_stand_it_knows_its_place(void **state)
{
    (void)state;
    seed_from("switches");
    for (int round = 0; round < 20; round++) {
        const int home_mm = (int)(draw() % 300) - 320;
        power_on((int)(draw() % 400));
        rig.line[HOME].sim_low_q32 = home_mm * UNIT;
        rig.line[HOME].sim_high_q32 = (home_mm + 8) * UNIT;
        rig.line[LEFT].sim_low_q32 = (home_mm - 300) * UNIT;
        rig.line[LEFT].sim_high_q32 = (home_mm - 30) * UNIT;
        rig.axis[SLIDE].homing.pos_q32 = (home_mm + 8) * UNIT;
        machine.homing_config[SLIDE].pos_q32 = (home_mm + 8) * UNIT;
        expect_homed(1u << SLIDE);
        expect_knows(SLIDE);
    }
}

/* --- a switch narrower than the distance to rest ------------------------- */

#define UM (UNIT / 1000)

/* From the rig of before: its edge at 100 mm, a limit switch 70 mm behind. */
static void set_switch(int64_t wide_um, int mm_s, int64_t start_mm)
{
    power_on((int)start_mm);
    struct homing_config *config = &machine.homing_config[SLIDE];
    rig.line[HOME].sim_low_q32 = 100 * UNIT - wide_um * UM;
    rig.line[HOME].sim_high_q32 = 100 * UNIT;
    rig.line[LEFT].sim_low_q32 = -100 * UNIT;
    rig.line[LEFT].sim_high_q32 = 30 * UNIT;
    config->pos_q32 = 100 * UNIT;
    config->fast_q32 = mm_s * UNIT;
    config->goes = false;
}

static const int64_t wide_um[] = { 100, 300, 1000, 3000, 10000, 30000 };
static const int fast_mm_s[] = { 5, 20, 80, 140, 200 };

/* Also where the search begins behind the switch, and the limit switch turns
 * it. */
static void a_narrow_switch_is_come_back_to(void **state)
{
    unsigned overrun = 0;
    (void)state;
    for (size_t w = 0; w < ARRAY_LEN(wide_um); w++)
        for (size_t v = 0; v < ARRAY_LEN(fast_mm_s); v++)
            for (int behind = 0; behind < 2; behind++) {
                bool back = false;
                set_switch(wide_um[w], fast_mm_s[v], behind ? 50 : 200);
                assert_int_equal(homing_start(&machine.homing, 1u << SLIDE),
                                 MOTION_OK);
                for (int i = 0; homing_is_running(&machine.homing); i++) {
                    assert_true(i < 70000);
                    tick();
                    back |= machine.homing.state == HOMING_BACK;
                }
                if (machine.homing.state != HOMING_DONE)
                    fail_msg("%d um at %d mm/s: %s", (int)wide_um[w],
                             fast_mm_s[v],
                             homing_error_text(machine.homing.error));
                ticks(100);
                expect_knows(SLIDE);
                overrun += back;
            }
    assert_true(overrun >= 10);
}

/* A pulse while it searches, and no switch where that was. */
static void a_switch_that_is_not_met_again_is_said(void **state)
{
    (void)state;
    set_switch(1000, 200, 200);
    assert_int_equal(homing_start(&machine.homing, 1u << SLIDE), MOTION_OK);
    while (machine.homing.state != HOMING_SLOW_DOWN)
        tick();
    rig.line[HOME].has_sim = false;
    sim_gpio_drive(&sim.line[HOME], SIM_GPIO_LOW);
    const int64_t met_q32 = true_q32(SLIDE);
    int64_t most_q32 = 0;
    while (homing_is_running(&machine.homing)) {
        tick();
        if (true_q32(SLIDE) > most_q32)
            most_q32 = true_q32(SLIDE);
    }
    expect_failed(HOMING_OVERRUN, SLIDE);
    /* no further back than it overran, which is 35 mm and the latency */
    assert_in_range(most_q32, met_q32, met_q32 + 37 * UNIT);
}

static void a_time_out_says_what_was_waited_for(void **state)
{
    static const struct {
        enum homing_state in;
        const char *text;
    } rows[] = {
        { HOMING_SEARCH, "it took too long: the switch was not met yet" },
        { HOMING_BACK, "it took too long: the switch that it had overrun was "
                       "not met again yet" },
        { HOMING_LEAVE, "it took too long: the switch was not released yet" },
        { HOMING_APPROACH, "it took too long: the switch was not met again yet "
                           "at the slow speed" },
    };
    char text[HOMING_TEXT_MAX];
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        set_switch(1000, 80, 200);
        assert_int_equal(homing_start(&machine.homing, 1u << SLIDE), MOTION_OK);
        while (machine.homing.state != rows[i].in) {
            assert_true(homing_is_running(&machine.homing));
            tick();
        }
        machine.homing_config[SLIDE].timeout_ns = MS;
        while (homing_is_running(&machine.homing))
            tick();
        expect_failed(HOMING_TIMEOUT, SLIDE);
        assert_string_equal(homing_failure(&machine.homing, text),
                            rows[i].text);
    }
    set_switch(1000, 80, 200);
    assert_int_equal(homing_start(&machine.homing, 1u << SLIDE), MOTION_OK);
    while (machine.homing.state != HOMING_BACK)
        tick();
    assert_int_equal(controller_hold(&machine.controller), MOTION_OK);
    ticks(500);
    machine.homing_config[SLIDE].timeout_ns = MS;
    while (homing_is_running(&machine.homing))
        tick();
    assert_string_equal(homing_failure(&machine.homing, text),
                        "it took too long: it was held");
}

static void bad_configurations_are_refused(void **state)
{
    struct homing_config config[16] = { { .by = HOMING_NONE } };
    static struct homing homing;
    (void)state;
    power_on(100);
    const struct homing_config good = machine.homing_config[SLIDE];
    config[SLIDE] = good;
    assert_int_equal(
        homing_init(&homing, &machine.controller, &machine.jog, config),
        MOTION_OK);
    for (int i = 0; i < 6; i++) {
        config[SLIDE] = good;
        config[SLIDE].fast_q32 = i == 0 ? 0 : good.fast_q32;
        config[SLIDE].slow_q32 = i == 1 ? 0 : good.slow_q32;
        if (i == 2)
            config[SLIDE].slow_q32 = good.fast_q32 + 1;
        config[SLIDE].distance_q32 = i == 3 ? 0 : good.distance_q32;
        config[SLIDE].direction = i == 4 ? 0 : good.direction;
        config[SLIDE].timeout_ns = i == 5 ? 0 : good.timeout_ns;
        assert_int_equal(
            homing_init(&homing, &machine.controller, &machine.jog, config),
            MOTION_E_ARG);
    }
}

#define RUN(test) cmocka_unit_test_setup(test, read_rig)

int main(void)
{
    const struct CMUnitTest tests[] = {
        RUN(slide_is_found_from_everywhere),
        RUN(the_drives_own_inputs_are_found),
        RUN(all_axes_one_after_the_other),
        RUN(no_move_before_homing),
        RUN(limits_count_again_afterwards),
        RUN(a_drive_that_was_lost_is_unhomed),
        RUN(a_switch_that_never_comes),
        RUN(only_the_limit_switches_come),
        RUN(a_switch_that_does_not_let_go),
        RUN(a_switch_that_cannot_be_read_is_active),
        RUN(both_limit_switches_at_once),
        RUN(it_may_take_too_long),
        RUN(a_fault_in_every_state_ends_it),
        RUN(the_drive_homes_by_itself),
        RUN(a_drive_without_that_method_is_a_failure),
        RUN(a_fault_while_the_drive_homes),
        RUN(wherever_the_switches_stand_it_knows_its_place),
        RUN(a_narrow_switch_is_come_back_to),
        RUN(a_switch_that_is_not_met_again_is_said),
        RUN(a_time_out_says_what_was_waited_for),
        RUN(bad_configurations_are_refused),
    };
    return cmocka_run_group_tests_name("homing", tests, NULL, NULL);
}
