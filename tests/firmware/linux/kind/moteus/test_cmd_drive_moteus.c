/* tests/firmware/linux/kind/moteus/test_cmd_drive_moteus.c - slew drive and slew scan on a
 * moteus: what it says, what is written and what is not, how a fault is
 * cleared. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "sim/device/moteus/servo.h"
#include "tests/support/kind/drives.h"
#include "tests/support/run_slew.h"

#include "firmware/host/kind/moteus/quantity.h"
#include "firmware/linux/tools/reset.h"
#include "motion/core/err.h"

#define RIG "examples/odrive"

/* The pan head; simulated. */
static struct session *opened(void)
{
    static struct session session;
    char message[YAML_MESSAGE_MAX];
    const struct session_config config = { .target = RIG, .who = "pan" };

    if (session_open(&session, &config, message) < 0)
        fail_msg("%s", message);
    return &session;
}

static void no_name_stands_for_two(void **state)
{
    unsigned count;
    const struct quantity *list = quantity_of_moteus(&count);

    (void)state;
    for (unsigned k = 0; k < count; k++)
        assert_ptr_equal(quantity_find(list[k].name, list, count), &list[k]);
}

static void it_is_read_by_name_and_by_number(void **state)
{
    (void)state;
    run("drive", "info", RIG, "pan");
    run_expect(0);
    run_says("0.3.4");
    run_says("stopped");
    run_says("-20 deg");
    run("drive", "get", RIG, "pan", "Mode", "0x00D", "288");
    run_expect(0);
    run_says("0x000");
    run_says("voltage");
    run_says("305419896");
    run("drive", "get", RIG, "pan", "0x300");
    run_expect(1);
    run_says("the drive refuses it");
    run("drive", "get", RIG, "pan", "voltag");
    run_expect(2);
    run_complains("did you mean 'voltage'?");
}

static void it_is_found_on_its_bus(void **state)
{
    (void)state;
    run("scan", RIG);
    run_expect(0);
    run_says("kind: moteus");
    run_says("stopped");
}

static void what_moves_is_not_written(void **state)
{
    (void)state;
    run("drive", "set", RIG, "pan", "mode", "10");
    run_expect(2);
    run_complains("moves drives");
    run("drive", "set", RIG, "pan", "0", "10");
    run_expect(2);
}

static const struct quantity watchdog = { .kind = QUANTITY_REGISTER,
                                          .type = QUANTITY_F32,
                                          .at = 0x027,
                                          .readable = true,
                                          .writable = true,
                                          .unit = "" };

static void with_torque_nothing_is_written(void **state)
{
    static const struct quantity mode = { .kind = QUANTITY_REGISTER,
                                          .type = QUANTITY_I8,
                                          .at = 0x000 };
    struct session *session = opened();

    (void)state;
    assert_int_equal(session_is_enabled(session), 0);
    assert_int_equal(turn_client_write(&session->turn, &watchdog, 0x7F800000),
                     0);
    assert_int_equal(turn_client_write(&session->turn, &mode, 10), MOTION_OK);
    assert_int_equal(session_is_enabled(session), 1);
    session_close(session);
}

static void its_position_can_be_set(void **state)
{
    static const struct quantity exact = { .kind = QUANTITY_REGISTER,
                                           .type = QUANTITY_F32,
                                           .at = 0x131 };
    static const struct quantity position = { .kind = QUANTITY_REGISTER,
                                              .type = QUANTITY_F32,
                                              .at = 0x001 };
    struct session *session = opened();
    uint32_t raw = 0;

    (void)state;
    assert_int_equal(turn_client_write(&session->turn, &exact, 0x3F000000), 0);
    assert_int_equal(turn_client_read(&session->turn, &position, &raw), 0);
    assert_int_equal(raw, 0x3F000000); /* 0.5 */
    session_close(session);
}

static void faults_are_said_and_cleared(void **state)
{
    struct session *session = opened();
    struct reset reset;

    (void)state;
    sim_servo_inject(&SERVO_OF(sim_moteus, &session->bench.sim, 0)->base,
                     SIM_SERVO_TRIP);
    assert_int_equal(reset_drive(session, &reset), MOTION_OK);
    assert_true(reset.was_fault);
    assert_false(reset.is_fault);
    assert_string_equal(reset.reason,
                        "fault 33: motor driver, perhaps under-voltage");
    assert_string_equal(reset.state, "stopped");
    session_close(session);

    session = opened();
    sim_servo_inject(&SERVO_OF(sim_moteus, &session->bench.sim, 0)->base,
                     SIM_SERVO_ENCODER);
    assert_int_equal(reset_drive(session, &reset), MOTION_OK);
    assert_true(reset.was_fault && reset.is_fault);
    session_close(session);
}

static void one_that_is_silent_is_said_to_be(void **state)
{
    struct session *session = opened();
    struct reset reset;

    (void)state;
    sim_servo_inject(&SERVO_OF(sim_moteus, &session->bench.sim, 0)->base,
                     SIM_SERVO_DEAF);
    assert_int_equal(reset_drive(session, &reset), MOTION_E_TIMEOUT);
    session_close(session);
    run("drive", "info", RIG, "slider", "--kind", "moteus");
    run_expect(2);
    run_complains("for a CAN interface that no rig describes");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_name_stands_for_two),
        cmocka_unit_test(it_is_read_by_name_and_by_number),
        cmocka_unit_test(it_is_found_on_its_bus),
        cmocka_unit_test(what_moves_is_not_written),
        cmocka_unit_test(with_torque_nothing_is_written),
        cmocka_unit_test(its_position_can_be_set),
        cmocka_unit_test(faults_are_said_and_cleared),
        cmocka_unit_test(one_that_is_silent_is_said_to_be),
    };

    return cmocka_run_group_tests_name("drive_moteus", tests, run_open,
                                       run_close);
}
