/* tests/firmware/linux/player/test_player_gantry.c - the rails of a gantry go to the
 * start of a move, along it and to rest together, though their limits differ. */
#include <stdlib.h>

#include "motion/core/fixed.h"
#include "tests/firmware/linux/player/player_bench.h"

#define UNIT MOTION_FIXED_ONE_Q32

static int64_t apart_q32, began_q32; /* set points, at most; before it moved */
static unsigned moving;

static int64_t between_q32(void)
{
    const struct controller_axis *axis = bench.machine.controller.axis;
    return axis[1].target.pos_q32 - axis[0].target.pos_q32;
}

static int64_t before_wait(int64_t t_ns)
{
    const struct controller *controller = &bench.machine.controller;
    if (controller->state == CONTROLLER_READY && moving == 0)
        began_q32 = between_q32();
    if (controller->state != CONTROLLER_MOVING)
        return t_ns;
    moving++;
    if (llabs(between_q32()) > apart_q32)
        apart_q32 = llabs(between_q32());
    return t_ns;
}

static void open_at(double left_mm, double right_mm)
{
    static const char *const path[] = { "examples/orbit" };
    char message[YAML_MESSAGE_MAX] = "";
    struct machine_ports ports;
    bench_open(path, 1, true);
    machine_free(&bench.machine);
    machine_sim_free(&bench.sim);
    struct plan_limit *const slower = &bench.job.rig.axis[1].limit;
    slower->vel_q32 = 700 * UNIT;
    slower->acc_q32 = 800 * UNIT;
    slower->jerk_q32 = 4000 * UNIT;
    bench.job.rig.axis[0].sim.start_q32 = (int64_t)(left_mm * UNIT);
    bench.job.rig.axis[1].sim.start_q32 = (int64_t)(right_mm * UNIT);
    assert_int_equal(
        machine_sim_init(&bench.sim, &bench.job.rig, false, &ports, message),
        MOTION_OK);
    ports.clock = &bench.clock;
    assert_int_equal(
        machine_init(&bench.machine, &bench.job.rig, &ports, message),
        MOTION_OK);
}

/* Nothing racks a bridge further than it was, from anywhere, also out of square. */
static void the_way_to_a_move_and_the_move_keep_a_bridge_square(void **state)
{
    static const struct {
        double left_mm, right_mm;
    } rows[] = {
        { 3000, 3000 }, { 100, 101.5 }, { 1801, 1800 }, { 5900, 5899 }
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct player_config config = { .override_q30 =
                                                  MOTION_CLOCK_WARP_ONE_Q30,
                                              .hold_at_ns = -1 };
        apart_q32 = began_q32 = moving = 0;
        open_at(rows[i].left_mm, rows[i].right_mm);
        assert_string_equal(bench.job.rig.axis[1].name, "rail_right");
        assert_true(bench.job.rig.axis[0].limit.vel_q32 !=
                    bench.job.rig.axis[1].limit.vel_q32);
        bench_play(&config, (struct player_observer){ .report = NULL });
        assert_int_equal(bench.machine.controller.fault.fault,
                         CONTROLLER_FAULT_NONE);
        assert_true(moving > 20000);
        if (apart_q32 > llabs(began_q32) + 16)
            fail_msg("from %g and %g mm: apart by %g mm", rows[i].left_mm,
                     rows[i].right_mm, (double)apart_q32 / UNIT);
        bench_free();
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_way_to_a_move_and_the_move_keep_a_bridge_square),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
