/* tests/firmware/control/test_playback.c - what an operator does with a move
 * and its axes, by commands, on ideal drives. */
#include "tests/firmware/control/playback_bench.h"

static void commands_take_it_from_off_to_off(void **state)
{
    (void)state;
    make_move(20, 10);
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_E_STATE);
    assert_int_equal(tell(MAILBOX_ENABLE, 0), MOTION_OK);
    until(CONTROLLER_READY);
    assert_int_equal(tell(MAILBOX_RESET, 0), MOTION_E_STATE);
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_OK);
    assert_int_equal(controller.state, CONTROLLER_MOVING);
    assert_int_equal(tell(MAILBOX_OFF, 0), MOTION_E_STATE);
    until(CONTROLLER_READY);
    assert_int_equal(drive[0].given.pos_q32, 20 * UNIT);
    assert_int_equal(drive[1].given.pos_q32, 10 * UNIT);
    assert_int_equal(tell(MAILBOX_OFF, 0), MOTION_OK);
    assert_int_equal(controller.state, CONTROLLER_OFF);
    assert_false(drive[0].enabled);
}

static void nothing_loaded_does_not_start(void **state)
{
    (void)state;
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_E_EMPTY);
    make_move(5, 5);
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_OK);
    assert_int_equal(playback_load(&playback, bench_tracks), MOTION_E_STATE);
    until(CONTROLLER_READY);
    playback_unload(&playback);
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_E_EMPTY);
}

static struct mailbox_entry jog_to(unsigned axis, double pos, double vel,
                                   int64_t for_ns)
{
    return (struct mailbox_entry){ .command = MAILBOX_JOG,
                                   .axis = axis,
                                   .value = (int64_t)(pos * (double)UNIT),
                                   .vel_q32 = (int64_t)(vel * (double)UNIT),
                                   .for_ns = for_ns };
}

static void a_jog_stops_when_nobody_asks_again(void **state)
{
    struct mailbox_entry entry = jog_to(1, 90, 20, 100 * MS);
    (void)state;
    assert_int_equal(tell_entry(&entry), MOTION_OK);
    for (int i = 0; i < 10; i++) {
        for (int n = 0; n < 50; n++)
            tick();
        assert_int_equal(controller.state, CONTROLLER_MOVING);
        entry = jog_to(1, 90, 20, 100 * MS);
        assert_int_equal(tell_entry(&entry), MOTION_OK);
    }
    const int64_t there_q32 = drive[1].given.pos_q32;
    until(CONTROLLER_READY);
    /* 100 ms at 20 unit/s, and to brake within 400 unit/s2, 6000 unit/s3 */
    assert_true(drive[1].given.pos_q32 > there_q32 + UNIT);
    assert_true(drive[1].given.pos_q32 < there_q32 + 5 * UNIT);
    assert_int_equal(drive[0].given.pos_q32, 0);
}

static void a_jog_has_a_time_and_a_range(void **state)
{
    struct mailbox_entry entry = jog_to(0, 10, 20, 0);
    (void)state;
    assert_int_equal(tell_entry(&entry), MOTION_E_ARG);
    entry = jog_to(0, 10, 20, PLAYBACK_JOG_MAX_NS + 1);
    assert_int_equal(tell_entry(&entry), MOTION_E_ARG);
    entry = jog_to(0, 100.5, 20, MS);
    assert_int_equal(tell_entry(&entry), MOTION_E_LIMIT);
    entry = jog_to(AXES, 10, 20, MS);
    assert_int_equal(tell_entry(&entry), MOTION_E_ARG);
    entry = jog_to(0, 10, 20, PLAYBACK_JOG_MAX_NS);
    assert_int_equal(tell_entry(&entry), MOTION_OK);
    assert_int_equal(tell(MAILBOX_JOG_STOP, 0), MOTION_OK);
    until(CONTROLLER_READY);
    assert_true(drive[0].given.pos_q32 < UNIT);
}

static int capture(int64_t pos_q32[AXES], int64_t *s_ns_q12)
{
    struct mailbox_entry entry = { .command = MAILBOX_CAPTURE,
                                   .pos_q32 = pos_q32 };
    const int err = tell_entry(&entry);
    *s_ns_q12 = entry.value;
    return err;
}

static void a_key_is_captured_where_the_axes_stand(void **state)
{
    int64_t pos_q32[AXES], s_ns_q12;
    (void)state;
    make_move(20, -10);
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_OK);
    for (int i = 0; i < 400; i++)
        tick();
    assert_int_equal(capture(pos_q32, &s_ns_q12), MOTION_E_STATE);
    assert_int_equal(tell(MAILBOX_HOLD, 0), MOTION_OK);
    until_held();
    assert_int_equal(capture(pos_q32, &s_ns_q12), MOTION_OK);
    assert_int_equal(s_ns_q12, controller.rate.s_ns_q12);
    assert_true(s_ns_q12 > 400 * MSQ12);
    for (int i = 0; i < AXES; i++)
        assert_int_equal(pos_q32[i], drive[i].given.pos_q32);
    assert_int_equal(tell(MAILBOX_RESUME, 0), MOTION_OK);
    until(CONTROLLER_READY);
    assert_int_equal(capture(pos_q32, &s_ns_q12), MOTION_OK);
    assert_int_equal(pos_q32[0], 20 * UNIT);
    assert_int_equal(pos_q32[1], -10 * UNIT);
    assert_int_equal(s_ns_q12, 0);
}

static void a_key_needs_axes_that_are_homed(void **state)
{
    int64_t pos_q32[AXES], s_ns_q12;
    (void)state;
    axes[1].homed = false;
    assert_int_equal(capture(pos_q32, &s_ns_q12), MOTION_E_UNHOMED);
    const struct mailbox_entry nowhere = { .command = MAILBOX_CAPTURE };
    assert_int_equal(mailbox_send(&mailbox, &nowhere), MOTION_E_ARG);
}

/* --- reverse ------------------------------------------------------------- */

static int64_t along_q32(unsigned axis, int64_t s_ns_q12)
{
    struct motion_cursor cursor = { 0 };
    struct motion_sample sample;
    motion_track_sample(&bench_track[axis], &cursor, s_ns_q12, &sample);
    return sample.pos_q32;
}

static void hold_after(int ticks)
{
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_OK);
    for (int i = 0; i < ticks; i++)
        tick();
    assert_int_equal(tell(MAILBOX_HOLD, 0), MOTION_OK);
    until_held();
}

static void reverse_is_the_same_path_to_the_bit(void **state)
{
    int64_t last_ns_q12;
    int at_full_rate = 0;
    (void)state;
    make_move(30, -20);
    hold_after(700);
    assert_int_equal(tell(MAILBOX_REVERSE, 1), MOTION_OK);
    assert_int_equal(tell(MAILBOX_RESUME, 0), MOTION_OK);
    last_ns_q12 = controller.rate.s_ns_q12;
    for (int i = 0; controller.state == CONTROLLER_MOVING; i++) {
        assert_in_range(i, 0, 5000);
        tick();
        assert_true(controller.rate.s_ns_q12 <= last_ns_q12);
        last_ns_q12 = controller.rate.s_ns_q12;
        at_full_rate += controller.rate.rate_q30 == -MOTION_CLOCK_WARP_ONE_Q30;
        for (unsigned k = 0; k < AXES; k++) {
            assert_int_equal(drive[k].given.pos_q32, along_q32(k, last_ns_q12));
            /* the axes of the move go back */
            assert_true(k == 0 ? drive[k].given.vel_q32 <= 0
                               : drive[k].given.vel_q32 >= 0);
        }
    }
    assert_true(at_full_rate > 100);
    assert_int_equal(controller.state, CONTROLLER_READY);
    assert_int_equal(drive[0].given.pos_q32, 0);
    assert_int_equal(drive[1].given.pos_q32, 0);
    /* it begins anew, forward */
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_OK);
    until(CONTROLLER_READY);
    assert_int_equal(drive[0].given.pos_q32, 30 * UNIT);
}

static void back_and_forth_within_a_move(void **state)
{
    (void)state;
    make_move(30, -20);
    hold_after(500);
    for (int n = 0; n < 6; n++) {
        const int64_t from_ns_q12 = controller.rate.s_ns_q12;
        assert_int_equal(tell(MAILBOX_REVERSE, n % 2 == 0), MOTION_OK);
        assert_int_equal(tell(MAILBOX_RESUME, 0), MOTION_OK);
        for (int i = 0; i < 100; i++)
            tick();
        assert_int_equal(tell(MAILBOX_REVERSE, n % 2), MOTION_E_STATE);
        assert_int_equal(tell(MAILBOX_HOLD, 0), MOTION_OK);
        until_held();
        assert_true((controller.rate.s_ns_q12 < from_ns_q12) == (n % 2 == 0));
    }
    assert_int_equal(tell(MAILBOX_RESUME, 0), MOTION_OK);
    until(CONTROLLER_READY);
    assert_int_equal(drive[0].given.pos_q32, 30 * UNIT);
    assert_int_equal(tell(MAILBOX_REVERSE, 1), MOTION_E_STATE);
}

static void what_came_in_from_outside_does_not_go_out_again(void **state)
{
    (void)state;
    make_move(20, 10);
    configs[1].pos_min_q32 = 2 * UNIT; /* it stands at 0 */
    hold_after(600);
    assert_int_equal(tell(MAILBOX_REVERSE, 1), MOTION_E_LIMIT);
    assert_int_equal(tell(MAILBOX_RESUME, 0), MOTION_OK);
    until(CONTROLLER_READY);
}

/* --- going to a time -------------------------------------------------------- */

static void it_goes_to_a_time_and_holds_there(void **state)
{
    static const int64_t at_ms[] = { 400, 0, 900, 900, 150 };
    (void)state;
    make_move(30, -7);
    for (size_t i = 0; i < ARRAY_LEN(at_ms); i++) {
        const int64_t at_ns_q12 = at_ms[i] * MSQ12;
        assert_int_equal(tell(MAILBOX_GO, at_ns_q12), MOTION_OK);
        until_held();
        for (int n = 0; n < 5000 && playback.state != PLAYBACK_PLAYING; n++)
            tick();
        assert_int_equal(controller.state, CONTROLLER_HOLDING);
        assert_int_equal(controller.rate.s_ns_q12, at_ns_q12);
        for (unsigned k = 0; k < AXES; k++)
            assert_int_equal(drive[k].given.pos_q32, along_q32(k, at_ns_q12));
    }
    assert_int_equal(tell(MAILBOX_RESUME, 0), MOTION_OK);
    assert_int_equal(tell(MAILBOX_GO, 0), MOTION_E_STATE); /* it moves */
    while (controller.state == CONTROLLER_MOVING) {
        tick();
        assert_int_equal(drive[0].given.pos_q32,
                         along_q32(0, controller.rate.s_ns_q12));
    }
    assert_int_equal(drive[0].given.pos_q32, 30 * UNIT);
}

static void all_axes_arrive_together(void **state)
{
    int64_t last[AXES] = { 0 };
    (void)state;
    make_move(30, -3);
    assert_int_equal(tell(MAILBOX_GO, playback.end_ns_q12), MOTION_OK);
    for (int64_t n = 0; controller.state == CONTROLLER_MOVING; n++) {
        tick();
        for (unsigned k = 0; k < AXES; k++)
            if (drive[k].given.vel_q32 != 0)
                last[k] = n;
    }
    assert_true(last[0] > 500);
    assert_in_range(last[0] - last[1] + 1, 0, 2);
    until_held();
    assert_int_equal(drive[1].given.pos_q32, -3 * UNIT);
}

static void a_time_outside_the_move_is_refused(void **state)
{
    (void)state;
    assert_int_equal(tell(MAILBOX_GO, 0), MOTION_E_EMPTY);
    make_move(30, -3);
    assert_int_equal(tell(MAILBOX_GO, -1), MOTION_E_ARG);
    assert_int_equal(tell(MAILBOX_GO, playback.end_ns_q12 + 1), MOTION_E_ARG);
    assert_int_equal(tell(MAILBOX_GO, INT64_MAX), MOTION_E_ARG);
    assert_int_equal(controller.state, CONTROLLER_READY);
    axes[1].homed = false;
    assert_int_equal(tell(MAILBOX_GO, 0), MOTION_E_UNHOMED);
    assert_int_equal(controller.state, CONTROLLER_READY);
}

static void a_place_outside_the_range_is_refused(void **state)
{
    (void)state;
    make_move(30, -3);
    configs[0].pos_min_q32 = 2 * UNIT; /* it stands at 0 */
    assert_int_equal(tell(MAILBOX_GO, 100 * MSQ12), MOTION_E_LIMIT);
    assert_int_equal(controller.state, CONTROLLER_READY);
    assert_int_equal(tell(MAILBOX_GO, playback.end_ns_q12), MOTION_OK);
}

static void a_stop_on_the_way_ends_it(void **state)
{
    (void)state;
    make_move(30, -3);
    assert_int_equal(tell(MAILBOX_GO, 500 * MSQ12), MOTION_OK);
    for (int i = 0; i < 200; i++)
        tick();
    mailbox_stop(&mailbox);
    tick();
    until(CONTROLLER_READY);
    for (int i = 0; i < 3000; i++)
        tick();
    assert_int_equal(controller.state, CONTROLLER_READY);
    assert_int_equal(playback.state, PLAYBACK_IDLE);
    assert_true(drive[0].given.pos_q32 < along_q32(0, 500 * MSQ12));
}

static void held_on_the_way_it_goes_on_and_is_not_reversed(void **state)
{
    (void)state;
    make_move(30, -3);
    assert_int_equal(tell(MAILBOX_GO, 500 * MSQ12), MOTION_OK);
    for (int i = 0; i < 200; i++)
        tick();
    assert_int_equal(tell(MAILBOX_HOLD, 0), MOTION_OK);
    until_held();
    assert_int_equal(tell(MAILBOX_REVERSE, 1), MOTION_E_STATE);
    assert_int_equal(tell(MAILBOX_RESUME, 0), MOTION_OK);
    for (int i = 0; i < 9000 && playback.state != PLAYBACK_PLAYING; i++)
        tick();
    assert_int_equal(drive[0].given.pos_q32, along_q32(0, 500 * MSQ12));
}

/* --- again ------------------------------------------------------------------ */

/* Ticks that stand at an end in between. */
static int play_times(unsigned times, unsigned *turns)
{
    int standing = 0;
    int64_t last_q32 = drive[0].given.pos_q32, step = 1;
    *turns = 0;
    for (int i = 0; controller.state != CONTROLLER_READY; i++) {
        assert_in_range(i, 0, 100000);
        tick();
        const int64_t now_q32 = drive[0].given.pos_q32 - last_q32;
        standing += now_q32 == 0;
        if (now_q32 != 0 && (now_q32 < 0) != (step < 0)) {
            step = now_q32;
            ++*turns;
        }
        last_q32 = drive[0].given.pos_q32;
        assert_true(playback.played <= times);
    }
    assert_int_equal(playback.played, times);
    return standing;
}

static void ping_pong_turns_at_the_ends(void **state)
{
    unsigned turns;
    (void)state;
    make_move(10, -3);
    assert_int_equal(tell(MAILBOX_PING_PONG, 5), MOTION_OK);
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_OK);
    assert_in_range(play_times(5, &turns), 0, 5 * 4);
    assert_int_equal(turns, 4);
    assert_int_equal(drive[0].given.pos_q32, 10 * UNIT);
    assert_int_equal(tell(MAILBOX_PING_PONG, 2), MOTION_OK);
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_OK);
    play_times(2, &turns);
    assert_int_equal(drive[0].given.pos_q32, 0);
}

static void a_loop_goes_back_to_its_start(void **state)
{
    unsigned turns;
    (void)state;
    make_move(10, -3);
    assert_int_equal(tell(MAILBOX_LOOP, 3), MOTION_OK);
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_OK);
    play_times(3, &turns);
    assert_int_equal(turns, 4);
    assert_int_equal(drive[0].given.pos_q32, 10 * UNIT);
}

/* Out and back: it ends where it starts. */
static void make_closed_move(void)
{
    const struct motion_ease_limit limit = { 30 * UNIT, 200 * UNIT,
                                             2000 * UNIT };
    make_move(10, 5);
    for (int i = 0; i < AXES; i++)
        assert_int_equal(motion_ease_append_limited(&bench_track[i], 0, &limit),
                         MOTION_OK);
    assert_int_equal(playback_load(&playback, bench_tracks), MOTION_OK);
}

static void a_closed_loop_goes_on_without_a_tick_between(void **state)
{
    unsigned turns;
    (void)state;
    make_closed_move();
    assert_int_equal(tell(MAILBOX_LOOP, 4), MOTION_OK);
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_OK);
    const int64_t from_ns = now_ns - MS;
    play_times(4, &turns);
    /* every time takes its own whole ticks */
    const int64_t ticks = (playback.end_ns_q12 + MSQ12 - 1) / MSQ12;
    assert_int_equal((now_ns - from_ns) / MS, 4 * ticks);
}

static void without_end_it_is_played_until_a_stop(void **state)
{
    (void)state;
    make_closed_move();
    assert_int_equal(tell(MAILBOX_LOOP, -1), MOTION_E_ARG);
    assert_int_equal(tell(MAILBOX_LOOP, 0), MOTION_OK);
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_OK);
    for (int i = 0; i < 20000; i++) {
        tick();
        assert_int_equal(controller.state, CONTROLLER_MOVING);
    }
    assert_true(playback.played > 5);
    mailbox_stop(&mailbox);
    tick();
    until(CONTROLLER_READY);
    const int64_t played = playback.played;
    for (int i = 0; i < 2000; i++)
        tick();
    assert_int_equal(playback.played, played);
    assert_int_equal(controller.state, CONTROLLER_READY);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(commands_take_it_from_off_to_off, begin_off),
        cmocka_unit_test_setup(nothing_loaded_does_not_start, begin_ready),
        cmocka_unit_test_setup(a_jog_stops_when_nobody_asks_again, begin_ready),
        cmocka_unit_test_setup(a_jog_has_a_time_and_a_range, begin_ready),
        cmocka_unit_test_setup(a_key_is_captured_where_the_axes_stand,
                               begin_ready),
        cmocka_unit_test_setup(a_key_needs_axes_that_are_homed, begin_ready),
        cmocka_unit_test_setup(reverse_is_the_same_path_to_the_bit,
                               begin_ready),
        cmocka_unit_test_setup(back_and_forth_within_a_move, begin_ready),
        cmocka_unit_test_setup(what_came_in_from_outside_does_not_go_out_again,
                               begin_ready),
        cmocka_unit_test_setup(it_goes_to_a_time_and_holds_there, begin_ready),
        cmocka_unit_test_setup(all_axes_arrive_together, begin_ready),
        cmocka_unit_test_setup(a_time_outside_the_move_is_refused, begin_ready),
        cmocka_unit_test_setup(a_place_outside_the_range_is_refused,
                               begin_ready),
        cmocka_unit_test_setup(a_stop_on_the_way_ends_it, begin_ready),
        cmocka_unit_test_setup(held_on_the_way_it_goes_on_and_is_not_reversed,
                               begin_ready),
        cmocka_unit_test_setup(ping_pong_turns_at_the_ends, begin_ready),
        cmocka_unit_test_setup(a_loop_goes_back_to_its_start, begin_ready),
        cmocka_unit_test_setup(a_closed_loop_goes_on_without_a_tick_between,
                               begin_ready),
        cmocka_unit_test_setup(without_end_it_is_played_until_a_stop,
                               begin_ready),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
