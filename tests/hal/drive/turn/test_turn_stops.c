/* tests/hal/drive/turn/test_turn_stops.c - drives that count turns and are stopped,
 * switched off, too slow or lost while they go by their own profile or home
 * themselves: they are ramped down, and have no torque in the end. */
#include "tests/hal/drive/turn/turn_world.h"

/* In a tick, counts/s: of the quick stop 200 units/s2, which is 1311; eight times
 * that, as the inner loop takes in where it was measured.  A set point that stood
 * at once would be 32000 and more. */
#define RAMP_COUNTS_S 10488
/* 1/20 turn/s */
#define REST_COUNTS_S 3277

static const char *const motion_text[] = { "standing", "streamed", "going",
                                           "homing" };

static bool has_homing(void)
{
    return (hal_drive_modes(b.drive) & 1u << HAL_DRIVE_HOMING) != 0;
}

/* False: it has no such motion. */
static bool moves(const struct kind_turn *turn, enum motion motion)
{
    get_moving(turn, motion == STREAMED ? STREAMED : GOING);
    if (motion == HOMING && !has_homing())
        return false;
    if (motion == HOMING)
        get_moving(turn, HOMING);
    b.worst_dvel_q24 = 0;
    assert_true(llabs(b.turn->servo->plant.vel_q24 >> 24) > 32768);
    return true;
}

/* For so long it is braked, and no longer. */
static void expect_ramp(const char *way, enum motion motion)
{
    const int64_t begin_ns = b.now_ns;

    while (b.turn->has_torque() && b.now_ns < begin_ns + 1500 * MS)
        tick();
    print_message("%s, %s, %s: %lld ms, %lld counts/s when torque went, at "
                  "most %lld in a tick\n",
                  b.turn->text, motion_text[motion], way,
                  (long long)((b.now_ns - begin_ns) / MS),
                  (long long)(b.cut_vel_q24 >> 24),
                  (long long)(b.worst_dvel_q24 >> 24));
    assert_false(b.turn->has_torque());
    assert_true(llabs(b.cut_vel_q24 >> 24) < REST_COUNTS_S);
    assert_true(b.worst_dvel_q24 >> 24 < RAMP_COUNTS_S);
    pass(1000 * MS);
    assert_false(b.turn->has_torque());
}

static void is_switched_off(const struct kind_turn *turn)
{
    for (int motion = STREAMED; motion <= HOMING; motion++) {
        if (!moves(turn, (enum motion)motion))
            continue;
        hal_drive_request(b.drive, HAL_DRIVE_REQUEST_OFF);
        expect_ramp("off", (enum motion)motion);
        assert_int_equal(b.seen.state, HAL_DRIVE_OFF);
    }
}

/* By a ramp, and then it stands with torque. */
static void is_halted(const struct kind_turn *turn)
{
    for (int motion = GOING; motion <= HOMING; motion++) {
        if (!moves(turn, (enum motion)motion))
            continue;
        assert_int_equal(hal_drive_halt(b.drive), 0);
        for (int i = 0;
             hal_drive_set_mode(b.drive, HAL_DRIVE_STREAM_POSITION) < 0; i++) {
            assert_true(i < 300);
            tick();
        }
        pass(300 * MS);
        assert_int_equal(b.seen.state, HAL_DRIVE_ENABLED);
        assert_true(b.turn->has_torque());
        assert_true(llabs(b.turn->servo->plant.vel_q24 >> 24) < 700);
        assert_true(b.worst_dvel_q24 >> 24 < RAMP_COUNTS_S);
        if (motion == HOMING)
            assert_int_equal(b.seen.homing, HAL_DRIVE_HOMING_FAILED);
    }
}

/* As long as nothing else is asked for, torque holds it. */
static void is_quick_stopped(const struct kind_turn *turn)
{
    for (int motion = GOING; motion <= HOMING; motion++) {
        if (!moves(turn, (enum motion)motion))
            continue;
        hal_drive_request(b.drive, HAL_DRIVE_REQUEST_QUICK_STOP);
        pass(400 * MS);
        assert_int_equal(b.seen.state, HAL_DRIVE_QUICK_STOP);
        assert_true(b.turn->has_torque());
        assert_true(llabs(b.turn->servo->plant.vel_q24 >> 24) < 700);
        hal_drive_request(b.drive, HAL_DRIVE_REQUEST_OFF);
        expect_ramp("quick stop", (enum motion)motion);
        assert_int_equal(b.seen.state, HAL_DRIVE_OFF);
    }
}

static void is_quick_stopped_then_off(const struct kind_turn *turn)
{
    for (int motion = GOING; motion <= HOMING; motion++) {
        if (!moves(turn, (enum motion)motion))
            continue;
        hal_drive_request(b.drive, HAL_DRIVE_REQUEST_QUICK_STOP);
        tick();
        hal_drive_request(b.drive, HAL_DRIVE_REQUEST_OFF);
        expect_ramp("quick stop and off", (enum motion)motion);
    }
}

/* A stop by set points is one too. */
static void is_off_while_it_brakes(const struct kind_turn *turn)
{
    get_moving(turn, STREAMED);
    b.worst_dvel_q24 = 0;
    hal_drive_request(b.drive, HAL_DRIVE_REQUEST_QUICK_STOP);
    tick();
    hal_drive_request(b.drive, HAL_DRIVE_REQUEST_OFF);
    expect_ramp("quick stop and off", STREAMED);
}

static void take_too_long(void)
{
    hal_drive_request(b.drive, HAL_DRIVE_REQUEST_OFF);
    pass(1000 * MS);
    hal_drive_request(b.drive, HAL_DRIVE_REQUEST_ENABLE);
    until(HAL_DRIVE_ENABLED);
    home(500 * MS);
    pass(300 * MS);
    b.worst_dvel_q24 = 0;
    until(HAL_DRIVE_FAULT);
    assert_string_equal(b.seen.fault_text, "homing took too long");
    assert_true(b.turn->has_torque());
}

/* The loop asks for off once it sees the fault. */
static void homing_is_too_slow(const struct kind_turn *turn)
{
    if (!moves(turn, HOMING))
        return;
    take_too_long();
    expect_ramp("too long", HOMING);
    assert_int_equal(b.seen.homing, HAL_DRIVE_HOMING_FAILED);
}

/* A reset in the middle of that does not end it. */
static void homing_is_too_slow_and_reset(const struct kind_turn *turn)
{
    if (!moves(turn, HOMING))
        return;
    take_too_long();
    hal_drive_request(b.drive, HAL_DRIVE_REQUEST_RESET);
    expect_ramp("reset", HOMING);
    assert_int_equal(b.seen.state, HAL_DRIVE_OFF);
}

/* Where it is is heard all the same. */
static void heartbeats_end(const struct kind_turn *turn)
{
    for (int motion = GOING; motion <= HOMING; motion++) {
        if (turn->servo->ops->heartbeat_id == NULL ||
            !moves(turn, (enum motion)motion))
            continue;
        b.leaky.lost_id = turn->servo->ops->heartbeat_id(turn->servo);
        until(HAL_DRIVE_OFFLINE);
        assert_true(b.turn->has_torque());
        expect_ramp("no heartbeat", (enum motion)motion);
    }
}

/* Nothing is heard; it hears. */
static void the_line_falls_silent(const struct kind_turn *turn)
{
    (void)moves(turn, GOING);
    b.leaky.mute = true;
    until(HAL_DRIVE_OFFLINE);
    assert_true(b.turn->has_torque());
    expect_ramp("silent", GOING);
}

/* Its speed is what it was 50 ms ago or more, while it speeds up. */
static void it_falls_silent_while_it_speeds_up(const struct kind_turn *turn)
{
    const struct hal_drive_go fast = { .pos_q32 = 2000 * ONE,
                                       .vel_q32 = 80 * ONE,
                                       .acc_q32 = INT64_C(100) << 32,
                                       .dec_q32 = INT64_C(100) << 32 };

    (void)moves(turn, GOING);
    assert_int_equal(hal_drive_go(b.drive, &fast), 0);
    pass(200 * MS);
    b.leaky.mute = true;
    until(HAL_DRIVE_OFFLINE);
    while (b.turn->has_torque())
        tick();
    assert_true(llabs(b.cut_vel_q24 >> 24) < REST_COUNTS_S);
}

/* Its position is 0 from there on, which it says a moment later. */
static void stops_as_it_arrives(const struct kind_turn *turn,
                                enum hal_drive_request request, int64_t wait_ns)
{
    (void)moves(turn, HOMING);
    pass(wait_ns);
    const int64_t at_q24 = turn->servo->plant.pos_q24;

    hal_drive_request(b.drive, request);
    for (int i = 0; i < 400; i++) {
        tick();
        if (llabs(turn->servo->plant.pos_q24 - at_q24) >> 24 >
            turn->counts / 32)
            fail_msg("%lld ms: it left by %lld counts",
                     (long long)(wait_ns / MS),
                     (long long)((turn->servo->plant.pos_q24 - at_q24) >> 24));
    }
}

static void does_not_leap(const struct kind_turn *turn)
{
    int64_t end_ns = 0;

    if (!moves(turn, HOMING))
        return;
    for (; b.seen.homing == HAL_DRIVE_HOMING_RUNNING; end_ns += MS)
        tick();
    for (int64_t wait_ns = end_ns - 130 * MS; wait_ns < end_ns + 5 * MS;
         wait_ns += MS) {
        stops_as_it_arrives(turn, HAL_DRIVE_REQUEST_OFF, wait_ns);
        stops_as_it_arrives(turn, HAL_DRIVE_REQUEST_QUICK_STOP, wait_ns);
    }
}

/* The set points rest in the tick in which it is to be off; the motor does not. */
static void rests_and_is_off(const struct kind_turn *turn)
{
    get_moving(turn, STREAMED);
    b.vel_q32 = 0;
    tick();
    hal_drive_request(b.drive, HAL_DRIVE_REQUEST_OFF);
    while (b.turn->has_torque())
        tick();
    print_message("%s: %lld counts/s when torque went\n", turn->text,
                  (long long)(b.cut_vel_q24 >> 24));
    assert_true(llabs(b.cut_vel_q24 >> 24) < REST_COUNTS_S);
}

/* And what is asked for then does not soften it. */
static void has_no_torque_at_once(const struct kind_turn *turn)
{
    for (int motion = STREAMED; motion <= HOMING; motion++) {
        int took = 0;

        if (!moves(turn, (enum motion)motion))
            continue;
        hal_drive_request(b.drive, HAL_DRIVE_REQUEST_TORQUE_OFF);
        hal_drive_request(b.drive, HAL_DRIVE_REQUEST_OFF);
        for (; b.turn->has_torque(); took++)
            tick();
        assert_in_range(took, 1, 4);
        print_message("%s, %s: %d ms, %lld counts/s\n", turn->text,
                      motion_text[motion], took,
                      (long long)(b.cut_vel_q24 >> 24));
        /* of 65536 streamed, less what a tick without torque takes */
        assert_true(llabs(b.cut_vel_q24 >> 24) > 5 * REST_COUNTS_S);
    }
}

/* Who moved it is gone, killed or hung; another looks for it. */
static void is_taken_over(const struct kind_turn *turn)
{
    for (int motion = STREAMED; motion <= HOMING; motion++) {
        const struct hal_drive_found *found;

        if (!moves(turn, (enum motion)motion))
            continue;
        b.streams = false;
        can_bus_init(&b.bus, &b.leaky.port.can);
        turn->restart(&b.bus);
        for (int i = 0; i < 500 && b.seen.state != HAL_DRIVE_QUICK_STOP; i++)
            tick();
        assert_int_equal(b.seen.state, HAL_DRIVE_QUICK_STOP);
        found = b.drive->ops->found(b.drive);
        assert_int_equal(found->count, 1);
        expect_ramp("taken over", (enum motion)motion);
        assert_int_equal(b.seen.state, HAL_DRIVE_OFF);
        assert_false(found->goes_on);
        if (motion == GOING) /* 10 units/s, or as fast as its ramp was */
            assert_in_range(llabs(found->vel_q32), 5 * ONE, 11 * ONE);
    }
}

/* What does not take set points is disarmed after its time. */
static void homing_goes_on_all_the_same(const struct kind_turn *turn)
{
    if (!moves(turn, HOMING))
        return;
    sim_servo_inject(turn->servo, SIM_SERVO_IGNORES_STATE);
    hal_drive_request(b.drive, HAL_DRIVE_REQUEST_OFF);
    pass(1010 * MS);
    assert_true(b.turn->has_torque());
    pass(700 * MS); /* by its e-stop */
    assert_false(b.turn->has_torque());
}

#define EACH(name, claim)                                                      \
    static void name(void **state)                                             \
    {                                                                          \
        (void)state;                                                           \
        each(claim);                                                           \
    }

EACH(off_is_a_ramp_first, is_switched_off)
EACH(a_halt_is_a_ramp_and_stands, is_halted)
EACH(a_quick_stop_is_a_ramp_and_holds, is_quick_stopped)
EACH(off_does_not_end_a_quick_stop, is_quick_stopped_then_off)
EACH(off_does_not_end_the_ramp_of_a_stream, is_off_while_it_brakes)
EACH(a_homing_that_takes_too_long_is_ramped_down, homing_is_too_slow)
EACH(a_reset_does_not_end_the_ramp, homing_is_too_slow_and_reset)
EACH(one_without_heartbeats_is_ramped_down, heartbeats_end)
EACH(one_that_is_not_heard_is_slowed_by_its_speed, the_line_falls_silent)
EACH(one_that_sped_up_meanwhile_too, it_falls_silent_while_it_speeds_up)
EACH(a_stop_as_it_arrives_home_is_no_leap, does_not_leap)
EACH(what_rolls_still_is_waited_for, rests_and_is_off)
EACH(torque_off_is_at_once, has_no_torque_at_once)
EACH(one_that_is_taken_over_is_ramped_down, is_taken_over)
EACH(one_that_goes_on_homing_is_disarmed, homing_goes_on_all_the_same)

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(off_is_a_ramp_first),
        cmocka_unit_test(a_halt_is_a_ramp_and_stands),
        cmocka_unit_test(a_quick_stop_is_a_ramp_and_holds),
        cmocka_unit_test(off_does_not_end_a_quick_stop),
        cmocka_unit_test(off_does_not_end_the_ramp_of_a_stream),
        cmocka_unit_test(a_homing_that_takes_too_long_is_ramped_down),
        cmocka_unit_test(a_reset_does_not_end_the_ramp),
        cmocka_unit_test(one_without_heartbeats_is_ramped_down),
        cmocka_unit_test(one_that_is_not_heard_is_slowed_by_its_speed),
        cmocka_unit_test(one_that_sped_up_meanwhile_too),
        cmocka_unit_test(a_stop_as_it_arrives_home_is_no_leap),
        cmocka_unit_test(what_rolls_still_is_waited_for),
        cmocka_unit_test(torque_off_is_at_once),
        cmocka_unit_test(one_that_is_taken_over_is_ramped_down),
        cmocka_unit_test(one_that_goes_on_homing_is_disarmed),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
