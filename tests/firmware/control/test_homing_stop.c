/* tests/firmware/control/test_homing_stop.c - homing to a hard stop, on the
 * simulated machine: from the stop itself, from just before it, from far away;
 * without a stop; of a load that takes its torque to speed up; stopped within. */
#include "tests/firmware/control/homing_bench.h"
#include "tests/support/kind/kind.h"

static void tick(void)
{
    const int64_t now_ns = sim.world.now_ns + rig.period_ns;
    sim_world_run(&sim.world, now_ns);
    machine_tick(&machine, now_ns);
}

static void power_on(void)
{
    homing_build("");
    homing_enable("");
}

static void homes(void)
{
    assert_int_equal(homing_start(&machine.homing, 1), MOTION_OK);
    for (int i = 0; homing_is_running(&machine.homing); i++) {
        assert_true(i < 200000);
        tick();
    }
    for (int i = 0; i < 200; i++)
        tick();
}

/* Where it says that it is, less where it is. */
static int64_t off_q32(void)
{
    return machine.controller.axis[0].feedback.pos_q32 -
           (machine_sim_pos_q32(&sim, 0) + sim.zero_q32[0]);
}

static void expect_homed(int64_t from_q32)
{
    const struct rig_axis *axis = &rig.axis[0];
    const int64_t count_q32 = UNIT * axis->counts_den / llabs(axis->counts_num);
    /* set points are whole counts, of which the servo smooths the most */
    const double most = (double)axis->homing.fast_q32 / (double)UNIT +
                        200 * (double)count_q32 / (double)UNIT;
    homes();
    if (machine.homing.state != HOMING_DONE)
        fail_msg("from %.3f: %s, %s", (double)from_q32 / (double)UNIT,
                 homing_error_text(machine.homing.error),
                 controller_fault_text(machine.controller.fault.fault));
    assert_in_range(llabs(off_q32()), 0, count_q32);
    if (met() > most)
        fail_msg("the stop was met at %.3f/s", met());
}

/* So far before its stop. */
static void start_at(int64_t before_q32)
{
    struct rig_axis *axis = &rig.axis[0];
    const int direction = axis->homing.direction;
    axis->sim.start_q32 =
        axis->sim.stop_q32[direction > 0] - direction * before_q32;
}

/* Speeding up takes 1 mm, and the following error allows 2 mm: from the stop
 * itself the set point must not go on for all of that first. */
static void a_stop_that_it_stands_at_is_met_while_speeding_up(void **state)
{
    static const int before_um[] = { 0,   7,   50,  100,  200,  400,
                                     600, 800, 950, 1000, 1200, 30000 };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(before_um); i++) {
        read_axis("tests/data/homing/hard_stop.yaml", 0);
        rig.axis[0].counts_num = 159;
        start_at(before_um[i] * UM);
        power_on();
        expect_homed(rig.axis[0].sim.start_q32);
    }
}

/* By a torque in Nm, and by a current; two of them run the other way round than
 * their axis. */
static void drives_that_count_turns_home_by_their_torque(void **state)
{
    static const int before_um[] = { 0, 50, 700, 30000 };
    (void)state;
    for (unsigned axis = 0; axis < 3; axis++)
        for (size_t i = 0; i < ARRAY_LEN(before_um); i++) {
            read_axis("tests/data/homing/hard_stop_turns.yaml", axis);
            start_at(before_um[i] * UM);
            power_on();
            expect_homed(rig.axis[0].sim.start_q32);
            down(NULL);
        }
}

/* A 0.5 says its current alone. */
static void without_a_torque_constant_a_current_is_no_torque(void **state)
{
    (void)state;
    read_axis("tests/data/homing/hard_stop_turns.yaml", 1);
    rig.axis[0].torque_constant_q32 = 0;
    power_on();
    homes();
    assert_int_equal(machine.homing.error, HOMING_NO_TORQUE);
    assert_false(machine.controller.axis[0].homed);
}

static void without_a_stop_it_is_not_found(void **state)
{
    (void)state;
    read_axis("tests/data/homing/hard_stop.yaml", 0);
    rig.axis[0].sim.has_stops = false;
    rig.axis[0].homing.distance_q32 = 60 * UNIT;
    power_on();
    homes();
    assert_int_equal(machine.homing.state, HOMING_FAILED);
    assert_int_equal(machine.homing.error, HOMING_NO_STOP);
    assert_int_equal(machine.controller.fault.fault, CONTROLLER_FAULT_NONE);
    assert_false(machine.controller.axis[0].homed);
}

/* It has the torque of a stop and lags far behind, but it moves. */
static void a_load_that_takes_its_torque_to_speed_up_is_no_stop(void **state)
{
    (void)state;
    for (uint32_t omega_mrad_s = 5000; omega_mrad_s <= 30000;
         omega_mrad_s += 1000) {
        read_axis("tests/data/homing/hard_stop.yaml", 0);
        rig.axis[0].homing.push_permille = 1;
        rig.axis[0].following_floor_q32 = 20 * UNIT;
        rig.axis[0].sim.omega_mrad_s = omega_mrad_s;
        start_at(40 * UNIT);
        power_on();
        assert_int_equal(homing_start(&machine.homing, 1), MOTION_OK);
        while (machine.homing.state == HOMING_PRESS)
            tick();
        if (machine_sim_pos_q32(&sim, 0) + sim.zero_q32[0] >
            rig.axis[0].sim.stop_q32[0] + UNIT / 100)
            fail_msg("%u mrad/s: pressed %.3f before the stop", omega_mrad_s,
                     (double)(machine_sim_pos_q32(&sim, 0) + sim.zero_q32[0] -
                              rig.axis[0].sim.stop_q32[0]) /
                         (double)UNIT);
        down(NULL);
    }
}

/* ---- what ends it ---- */

static bool has_torque(void)
{
    return kind_tests[rig.axis[0].kind]->has_torque(sim.servo[0]);
}

/* Of the axis, unit/s. */
static double speed(void)
{
    return fabs((double)plant()->vel_q24 / (1 << 24) *
                (double)rig.axis[0].counts_den /
                (double)rig.axis[0].counts_num);
}

static void stop(void)
{
    controller_stop(&machine.controller);
}

static void drive_stops(void)
{
    hal_drive_request(machine.axis[0], HAL_DRIVE_REQUEST_QUICK_STOP);
}

static const struct {
    const char *text;
    void (*begin)(void);
    bool keeps; /* torque */
} ends[] = {
    { "stop", stop, true },
    { "the drive leaves", drive_stops, false },
};

/* So long after this part of it began, which is under way then. */
static void home_into(unsigned axis, enum homing_state part, int dur_ms)
{
    read_axis("tests/data/homing/hard_stop_turns.yaml", axis);
    start_at(10 * UNIT);
    power_on();
    assert_int_equal(homing_start(&machine.homing, 1), MOTION_OK);
    for (int i = 0; machine.homing.state != part; i++) {
        assert_true(i < 20000);
        tick();
    }
    for (int64_t t_ns = 0; t_ns < dur_ms * INT64_C(1000000);
         t_ns += rig.period_ns)
        tick();
    assert_int_equal(machine.homing.state, part);
}

static void expect_end(unsigned axis, enum homing_state part, unsigned end)
{
    double cut = 0;
    for (int i = 0; i < 2000; i++) {
        const bool torque = has_torque();
        const double was = speed();
        tick();
        if (torque && !has_torque())
            cut = was;
    }
    if (homing_is_running(&machine.homing) ||
        machine.homing.state != HOMING_FAILED ||
        machine.controller.axis[0].homed || speed() > 0.01 ||
        cut > 0.05 * (double)rig.axis[0].homing.fast_q32 / (double)UNIT ||
        has_torque() != ends[end].keeps)
        fail_msg("axis %u, %s, %s: %s, %.3f/s at the end, %.3f/s when torque "
                 "went, torque %s",
                 axis, homing_state_text(part), ends[end].text,
                 homing_state_text(machine.homing.state), speed(), cut,
                 has_torque() ? "on" : "off");
}

/* On its way to the stop, from it, to it again; and pressing. */
static void what_ends_it_brakes_it(void **state)
{
    static const struct {
        enum homing_state part;
        int dur_ms;
    } at[] = { { HOMING_PRESS, 200 },
               { HOMING_PRESSED, 0 },
               { HOMING_CLEAR, 60 },
               { HOMING_PRESS_AGAIN, 100 } };
    (void)state;
    for (unsigned axis = 0; axis < 3; axis++)
        for (unsigned i = 0; i < ARRAY_LEN(at) * ARRAY_LEN(ends); i++) {
            const unsigned end = i % ARRAY_LEN(ends);
            home_into(axis, at[i / ARRAY_LEN(ends)].part,
                      at[i / ARRAY_LEN(ends)].dur_ms);
            ends[end].begin();
            expect_end(axis, at[i / ARRAY_LEN(ends)].part, end);
            for (int k = 0; k < 1000; k++) { /* the process is told to go */
                machine_tick_off(&machine, sim.world.now_ns + rig.period_ns);
                sim_world_run(&sim.world, sim.world.now_ns + rig.period_ns);
            }
            assert_false(has_torque());
            down(NULL);
        }
}

int main(void)
{
#define RUN(test) cmocka_unit_test_teardown(test, down)
    const struct CMUnitTest tests[] = {
        RUN(a_stop_that_it_stands_at_is_met_while_speeding_up),
        RUN(drives_that_count_turns_home_by_their_torque),
        RUN(without_a_torque_constant_a_current_is_no_torque),
        RUN(without_a_stop_it_is_not_found),
        RUN(a_load_that_takes_its_torque_to_speed_up_is_no_stop),
        RUN(what_ends_it_brakes_it),
    };
    return cmocka_run_group_tests_name("homing_stop", tests, NULL, NULL);
}
