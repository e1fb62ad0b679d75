/* tests/firmware/control/test_gantry.c - two rails that carry one bridge: homed by both
 * switches, jogged as one, stopped together, and never racked further than they may be.
 *
 *   N=500 build/tests/firmware/control/test_gantry   more episodes
 *   SEED=17 N=1 ...                                  the one that failed */
#include <inttypes.h>
#include <string.h>

#include "sim/device/servo.h"
#include "tests/firmware/control/homing_bench.h"

enum { LEFT, RIGHT, COLUMN, AXES };
#define RACKING (2 * UNIT)
/* The rails follow so far apart from each other in the world, with counts of their own
 * and a tick between their buses. */
#define APART (UNIT / 20)

static uint64_t seed;
static int64_t skewed_q32; /* right less left in the world, when it began */
static int64_t drives_apart_q32;
static int64_t most_q32;  /* that they may be apart there */
static int64_t apart_q32; /* the same of the set points, in the tick before */

static int64_t true_q32(unsigned axis)
{
    return machine_sim_pos_q32(&sim, axis) + sim.zero_q32[axis];
}

static int64_t between_q32(void)
{
    return machine.controller.axis[RIGHT].target.pos_q32 -
           machine.controller.axis[LEFT].target.pos_q32;
}

static bool squares(void)
{
    return machine.homing.state == HOMING_SQUARE ||
           (machine.homing.state == HOMING_BRAKE &&
            machine.homing.failed == HOMING_SQUARE);
}

/* Set points with torque stay as far apart as they are, but where homing has just learnt
 * where the rails are, or squares them. */
static void judge(bool learnt)
{
    const struct controller *controller = &machine.controller;
    const int64_t racked_q32 = true_q32(RIGHT) - true_q32(LEFT);
    if (llabs(racked_q32) > most_q32 + APART)
        fail_msg("seed %" PRIu64 ": racked by %g mm, %s", seed,
                 (double)racked_q32 / UNIT,
                 homing_state_text(machine.homing.state));
    if (!learnt && !squares() && controller->axis[LEFT].sent_count > 1 &&
        controller->axis[RIGHT].sent_count > 1 &&
        controller->state != CONTROLLER_FAULT && between_q32() != apart_q32)
        fail_msg("seed %" PRIu64 ": set points part by %g mm, %s", seed,
                 (double)(between_q32() - apart_q32) / UNIT,
                 homing_state_text(machine.homing.state));
    apart_q32 = between_q32();
}

static void tick(void)
{
    const bool was_homed = machine.controller.axis[LEFT].homed;
    const bool learns = machine.homing.state == HOMING_SETTLE || squares();
    const int64_t now_ns = sim.world.now_ns + rig.period_ns;
    sim_world_run(&sim.world, now_ns);
    machine_tick(&machine, now_ns);
    judge(learns || was_homed != machine.controller.axis[LEFT].homed);
}

static void ticks(unsigned count)
{
    while (count-- > 0)
        tick();
}

static int up(void **state)
{
    char message[YAML_MESSAGE_MAX];
    (void)state;
    if (rig_load(&disk_files, "tests/data/gantry/rig.yaml", &rig, message) == 0)
        return 0;
    print_message("%s\n", message);
    return -1;
}

/* Ready, the right rail so far beside the left one. */
static void power_on(int64_t start_q32, int64_t skew_q32)
{
    rig.axis[LEFT].sim.start_q32 = start_q32;
    rig.axis[RIGHT].sim.start_q32 = start_q32 + skew_q32;
    skewed_q32 = skew_q32;
    most_q32 = llabs(skew_q32) + RACKING;
    homing_build("");
    machine.controller.axis[RIGHT].offset_q32 = drives_apart_q32;
    homing_enable("");
    most_q32 = llabs(skew_q32);
}

static void home(uint64_t axes)
{
    assert_int_equal(homing_start(&machine.homing, axes), MOTION_OK);
    for (int i = 0; homing_is_running(&machine.homing); i++) {
        assert_true(i < 70000);
        tick();
    }
}

static void expect_square(void)
{
    ticks(100);
    assert_int_equal(machine.controller.fault.fault, CONTROLLER_FAULT_NONE);
    for (unsigned i = LEFT; i <= RIGHT; i++) {
        const struct controller_axis *axis = &machine.controller.axis[i];
        assert_true(axis->homed);
        assert_false(axis->seeking);
        assert_in_range(llabs(axis->feedback.pos_q32 - true_q32(i)), 0, 4 * UM);
    }
    assert_in_range(llabs(true_q32(RIGHT) - true_q32(LEFT)), 0, 8 * UM);
}

/* --- homing --- */

static void homing_squares_the_bridge_by_both_switches(void **state)
{
    static const double skew_mm[] = { 0, 0.3, -0.3, 1.9, -1.9 };
    /* far away, before the switches, on both, between them */
    static const double start_mm[] = { 500, 2, -15, -11 };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(skew_mm); i++)
        for (size_t k = 0; k < ARRAY_LEN(start_mm); k++) {
            power_on((int64_t)(start_mm[k] * UNIT),
                     (int64_t)(skew_mm[i] * UNIT));
            home(UINT64_C(1) << (i + k) % 2);
            if (machine.homing.state != HOMING_DONE)
                fail_msg("%g mm from %g mm: %s", skew_mm[i], start_mm[k],
                         homing_error_text(machine.homing.error));
            expect_square();
            assert_int_equal(machine.controller.axis[LEFT].target.pos_q32,
                             20 * UNIT);
        }
}

/* Nothing is known of the rails then, and the bridge is as it was. */
static void a_rail_whose_switch_does_not_come_ends_it(void **state)
{
    static const double skew_mm[] = { 2.5, -2.5 };
    (void)state;
    for (int i = 0; i < 4; i++) {
        int64_t *const home_q32 = rig.axis[RIGHT].sim.home_q32;
        const int64_t low_q32 = home_q32[0], high_q32 = home_q32[1];
        if (i >= 2) { /* a wire is off */
            home_q32[0] = -2000 * UNIT;
            home_q32[1] = -1999 * UNIT;
        }
        power_on(100 * UNIT, i < 2 ? (int64_t)(skew_mm[i] * UNIT) : 0);
        home(UINT64_C(1) << LEFT);
        assert_int_equal(machine.homing.state, HOMING_FAILED);
        assert_int_equal(machine.homing.error, HOMING_RACKED);
        assert_false(machine.controller.axis[LEFT].homed);
        assert_false(machine.controller.axis[RIGHT].homed);
        assert_int_equal(machine.controller.state, CONTROLLER_READY);
        ticks(100);
        home_q32[0] = low_q32;
        home_q32[1] = high_q32;
    }
}

/* --- jogs --- */

static int jog(unsigned axis, double to_mm)
{
    const struct controller_jog_goal goal = {
        .axis = axis,
        .pos_q32 = (int64_t)(to_mm * UNIT),
        .vel_q32 = 500 * UNIT,
    };
    return controller_jog(&machine.controller, &machine.jog, &goal);
}

static void
a_jog_of_either_rail_moves_both_within_the_limits_of_both(void **state)
{
    const struct controller_axis *axis = machine.controller.axis;
    int64_t fastest_q32 = 0;
    (void)state;
    power_on(50 * UNIT, UNIT / 2);
    home(UINT64_C(1) << LEFT);
    expect_square();
    axis = machine.controller.axis;
    for (unsigned rail = LEFT; rail <= RIGHT; rail++) {
        const int64_t column_q32 = axis[COLUMN].target.pos_q32;
        assert_int_equal(jog(rail, rail == LEFT ? 400 : 100), MOTION_OK);
        while (machine.controller.state == CONTROLLER_MOVING) {
            tick();
            for (unsigned i = LEFT; i <= RIGHT; i++)
                if (llabs(axis[i].target.vel_q32) > fastest_q32)
                    fastest_q32 = llabs(axis[i].target.vel_q32);
            assert_int_equal(axis[LEFT].target.vel_q32,
                             axis[RIGHT].target.vel_q32);
            assert_int_equal(axis[LEFT].target.acc_q32,
                             axis[RIGHT].target.acc_q32);
        }
        assert_int_equal(axis[LEFT].target.pos_q32,
                         (rail == LEFT ? 400 : 100) * UNIT);
        assert_int_equal(axis[RIGHT].target.pos_q32, axis[LEFT].target.pos_q32);
        assert_int_equal(axis[COLUMN].target.pos_q32, column_q32);
    }
    assert_in_range(fastest_q32, 149 * UNIT, 150 * UNIT + 1000);
    /* 590 is in the range of the left rail alone, -3 in that of the right one */
    assert_int_equal(jog(LEFT, 590), MOTION_E_LIMIT);
    assert_int_equal(jog(RIGHT, -3), MOTION_E_LIMIT);
    assert_int_equal(machine.controller.fault.fault, CONTROLLER_FAULT_NONE);
}

/* --- faults --- */

static struct sim_servo *servo(unsigned axis)
{
    return machine_kinds[rig.axis[axis].kind]->sim_servo(&sim, axis);
}

/* It stays behind by more than the racking, and less than its following error. */
static void a_rail_that_stays_behind_stops_both(void **state)
{
    (void)state;
    for (unsigned rail = LEFT; rail <= RIGHT; rail++) {
        power_on(50 * UNIT, 0);
        home(UINT64_C(1) << LEFT);
        expect_square();
        assert_int_equal(jog(1 - rail, 400), MOTION_OK);
        ticks(1500);
        most_q32 = 14 * UNIT; /* and what the other needs to rest */
        servo(rail)->blocked = true;
        for (int i = 0; machine.controller.fault.fault == 0; i++) {
            assert_true(i < 1000);
            tick();
        }
        const struct controller_fault_record *fault = &machine.controller.fault;
        assert_int_equal(fault->fault, CONTROLLER_FAULT_RACKING);
        assert_int_equal(fault->axis, rail);
        assert_int_equal(fault->limit, RACKING);
        assert_true((fault->value > 0) == (rail == LEFT));
        assert_in_range(llabs(fault->value), RACKING, RACKING + UNIT / 2);
        while (machine.controller.state == CONTROLLER_STOPPING)
            tick(); /* both along the path: judge() */
        assert_int_equal(machine.controller.state, CONTROLLER_FAULT);
        ticks(500);
        for (unsigned i = 0; i < AXES; i++) {
            const enum hal_drive_state now =
                machine.controller.axis[i].feedback.state;
            assert_true(now == HAL_DRIVE_OFF || now == HAL_DRIVE_FAULT);
        }
    }
}

/* The rails are compared with how torque found them before any was homed. */
static void a_bridge_that_is_not_homed_is_watched_too(void **state)
{
    (void)state;
    drives_apart_q32 = 70 * UNIT; /* as their drives count */
    power_on(100 * UNIT, 3 * UNIT);
    drives_apart_q32 = 0;
    ticks(100);
    assert_int_equal(between_q32(), 70 * UNIT);
    assert_int_equal(machine.controller.fault.fault, CONTROLLER_FAULT_NONE);
    assert_int_equal(jog(RIGHT, 80), MOTION_OK);
    ticks(100);
    most_q32 = 10 * UNIT;
    servo(LEFT)->blocked = true;
    ticks(200);
    assert_int_equal(machine.controller.fault.fault, CONTROLLER_FAULT_RACKING);
}

/* --- what may begin --- */

static void one_rail_alone_moves_no_further_than_it_may_rack(void **state)
{
    static const struct {
        double to_mm;
        int err;
    } rows[] = { { 21.5, MOTION_OK }, { 22.5, MOTION_E_LIMIT } };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct motion_segment segment[4];
        struct motion_track own;
        const struct motion_track *track[AXES] = { NULL };
        int which = -2;
        power_on(50 * UNIT, 0);
        home(UINT64_C(1) << LEFT);
        const int64_t at_q32 = machine.controller.axis[RIGHT].target.pos_q32;
        motion_track_init(&own, segment, ARRAY_LEN(segment), at_q32);
        assert_int_equal(motion_track_append_quintic(
                             &own, MOTION_FIXED_S_Q12,
                             &(struct motion_state){ .pos_q32 = at_q32 },
                             &(struct motion_state){
                                 .pos_q32 = (int64_t)(rows[i].to_mm * UNIT) }),
                         MOTION_OK);
        track[RIGHT] = &own;
        assert_int_equal(controller_start(&machine.controller, track, &which),
                         rows[i].err);
        assert_int_equal(which, rows[i].err < 0 ? RIGHT : -2);
        most_q32 = RACKING;
        if (rows[i].err == MOTION_OK)
            apart_q32 = INT64_MIN; /* it is a move of its own */
        machine_free(&machine);
        machine_sim_free(&sim);
    }
}

static void rails_are_no_part_of_gears_and_cams(void **state)
{
    struct motion_segment segment[2];
    struct motion_track line;
    (void)state;
    power_on(50 * UNIT, 0);
    home(UINT64_C(1) << LEFT);
    motion_track_init(&line, segment, 2, -10 * UNIT);
    assert_int_equal(
        motion_track_append_line(&line, 40 * MOTION_FIXED_S_Q12, 30 * UNIT),
        MOTION_OK);
    for (unsigned axis = LEFT; axis <= COLUMN; axis++)
        for (unsigned master = LEFT; master <= COLUMN; master++) {
            struct controller_cam cam = { .master = master,
                                          .track = &line,
                                          .low_q32 = -10 * UNIT,
                                          .high_q32 = 30 * UNIT };
            if (axis == master)
                continue;
            assert_int_equal(controller_cam_init(&cam), MOTION_OK);
            assert_int_equal(controller_couple(&machine.controller, axis, &cam),
                             MOTION_E_ARG);
        }
}

static void gantries_are_of_rails_that_are_there_and_alone(void **state)
{
    static const struct controller_gantry rows[][2] = {
        { { .axis = { 0, 0 }, .racking_q32 = UNIT } },
        { { .axis = { 0, AXES }, .racking_q32 = UNIT } },
        { { .axis = { 0, 1 }, .racking_q32 = 0 } },
        { { .axis = { 0, 1 }, .racking_q32 = UNIT },
          { .axis = { 2, 1 }, .racking_q32 = UNIT } },
    };
    (void)state;
    power_on(50 * UNIT, 0);
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct controller_gantry gantry[2] = { rows[i][0], rows[i][1] };
        assert_int_equal(
            controller_set_gantries(&machine.controller, gantry,
                                    rows[i][1].racking_q32 != 0 ? 2 : 1),
            MOTION_E_ARG);
    }
}

/* --- whatever comes, whenever it comes --- */

static void trouble(uint64_t *from)
{
    switch (check_random_in(from, 0, 5)) {
    case 0:
        controller_stop(&machine.controller);
        break;
    case 1:
        (void)controller_hold(&machine.controller);
        ticks((unsigned)check_random_in(from, 1, 400));
        (void)controller_resume(&machine.controller);
        break;
    case 2:
        controller_trip(&machine.controller, CONTROLLER_FAULT_GUARDIAN);
        break;
    case 3:
        controller_jog_stop(&machine.controller, &machine.jog, false);
        break;
    case 4: /* a drive is off at once, and the other has to stop */
        most_q32 += 60 * UNIT;
        sim_servo_trip(servo((unsigned)check_random_in(from, LEFT, RIGHT)),
                       0x7305);
        break;
    default:
        machine.controller.now_ns -= 5 * rig.period_ns; /* ticks are lost */
        break;
    }
}

/* Expect that the bridge stands, and that both rails are homed or neither. */
static void finish(void)
{
    ticks(20); /* a drive says what it has */
    for (int i = 0; homing_is_running(&machine.homing) ||
                    machine.controller.state == CONTROLLER_MOVING ||
                    machine.controller.state == CONTROLLER_STOPPING;
         i++) {
        if (i > 70000)
            fail_msg("seed %" PRIu64 ": it does not end", seed);
        tick();
    }
    if (machine.controller.axis[LEFT].homed !=
        machine.controller.axis[RIGHT].homed)
        fail_msg("seed %" PRIu64 ": one rail is homed", seed);
    assert_false(machine.gantry[0].is_alone);
    assert_false(machine.controller.axis[LEFT].seeking);
    assert_false(machine.controller.axis[RIGHT].seeking);
}

static void an_episode(void)
{
    uint64_t from = seed * UINT64_C(0x9E3779B97F4A7C15) + 1;
    const int64_t skew_q32 = check_random_in(&from, -1950, 1950) * UM;
    power_on(check_random_in(&from, -14000, 60000) * UM, skew_q32);
    const unsigned rail = (unsigned)check_random_in(&from, LEFT, RIGHT);
    assert_int_equal(homing_start(&machine.homing, UINT64_C(1) << rail),
                     MOTION_OK);
    for (int64_t left = check_random_in(&from, 0, 12000);
         left > 0 && homing_is_running(&machine.homing); left--)
        tick();
    trouble(&from);
    finish();
    if (machine.controller.fault.fault != CONTROLLER_FAULT_NONE)
        return;
    assert_int_equal(machine.controller.state, CONTROLLER_READY);
    (void)jog(rail, (double)check_random_in(&from, 30, 60));
    ticks((unsigned)check_random_in(&from, 0, 1500));
    trouble(&from);
    finish();
    if (machine.controller.fault.fault != CONTROLLER_FAULT_NONE)
        return;
    home(UINT64_C(1) << rail);
    if (machine.homing.state != HOMING_DONE)
        fail_msg("seed %" PRIu64 ": %s in %s, %s", seed,
                 homing_error_text(machine.homing.error),
                 homing_state_text(machine.homing.failed),
                 controller_fault_text(machine.controller.fault.fault));
    expect_square();
}

static void no_trouble_at_any_time_racks_the_bridge(void **state)
{
    const char *const first = getenv("SEED");
    const char *const count = getenv("N");
    const uint64_t begin = first != NULL ? (uint64_t)atoll(first) : 1;
    const int n = count != NULL ? atoi(count) : check_many(200, 25);
    for (seed = begin; seed < begin + (uint64_t)n; seed++) {
        an_episode();
        machine_free(&machine);
        machine_sim_free(&sim);
    }
    seed = 0;
    (void)state;
}

#define GANTRY_TEST(claim) cmocka_unit_test_setup_teardown(claim, up, down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        GANTRY_TEST(homing_squares_the_bridge_by_both_switches),
        GANTRY_TEST(a_rail_whose_switch_does_not_come_ends_it),
        GANTRY_TEST(a_jog_of_either_rail_moves_both_within_the_limits_of_both),
        GANTRY_TEST(a_rail_that_stays_behind_stops_both),
        GANTRY_TEST(a_bridge_that_is_not_homed_is_watched_too),
        GANTRY_TEST(one_rail_alone_moves_no_further_than_it_may_rack),
        GANTRY_TEST(rails_are_no_part_of_gears_and_cams),
        GANTRY_TEST(gantries_are_of_rails_that_are_there_and_alone),
        GANTRY_TEST(no_trouble_at_any_time_racks_the_bridge),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
