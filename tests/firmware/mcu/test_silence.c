/* tests/firmware/mcu/test_silence.c - a board that hears nothing any more: its
 * axes stop along their path, and torque goes off. */
#include "tests/firmware/mcu/board.h"

#define WATCH_MS 100

static struct board board;
static struct board_move move;
static struct board_pieces pieces;

static bool has_torque(void)
{
    return board.unit.drive[0].state == HAL_DRIVE_ENABLED;
}

/* A long move, enabled; with a watch of so many ms. */
static void get_ready(uint32_t watch_ms)
{
    board_make_move(&move, BOARD_WINDOW, check_stream());
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        motion_track_init(&move.track[i], move.segment[i], BOARD_SEGMENTS, 0);
        assert_int_equal(
            motion_track_append_quintic(
                &move.track[i], INT64_C(10000000000) << 12,
                &(struct motion_state){ 0 },
                &(struct motion_state){ .pos_q32 = 50 * BOARD_ONE }),
            MOTION_OK);
        mcu_head_of(&move.track[i], &move.head[i]);
    }
    board_make_pieces(&pieces, &move, check_stream());
    board_init(&board);
    board_run(&board, 10);
    board_set_up(&board, &move);
    assert_true(board_command(&board, MCU_COMMAND_WATCH, watch_ms));
    for (unsigned i = 0; i < pieces.count; i++)
        assert_true(
            board_send(&board, MCU_AT_PIECE, pieces.word[i], pieces.length[i]));
    assert_true(board_command(&board, MCU_COMMAND_ENABLE, 0));
    board_run(&board, 3);
    assert_int_equal(board.unit.controller.state, CONTROLLER_READY);
}

static void axes_that_move_stop_along_their_path(void **state)
{
    int64_t before_q32;

    (void)state;
    get_ready(WATCH_MS);
    assert_true(board_command(&board, MCU_COMMAND_START, move.id));
    for (unsigned i = 0; i < 30; i++) { /* as long as somebody asks */
        board_run(&board, WATCH_MS - 1);
        assert_int_equal(board_state(&board, MCU_STATE_STATE),
                         CONTROLLER_MOVING);
    }
    board_run(&board, WATCH_MS - 1);
    assert_int_equal(board.unit.controller.state, CONTROLLER_MOVING);
    board_run(&board, 1);
    assert_int_equal(board.unit.controller.state, CONTROLLER_STOPPING);
    before_q32 = board.unit.axis[0].target.pos_q32;
    board_run(&board, 1);
    assert_true(board.unit.axis[0].target.pos_q32 > before_q32); /* no jump */
    board_run(&board, 5000);
    assert_int_equal(board.unit.controller.state, CONTROLLER_OFF);
    assert_false(has_torque());
    assert_int_equal(board_state(&board, MCU_STATE_SILENT), 1);
}

static void what_ended_by_silence_does_not_begin_again(void **state)
{
    (void)state;
    get_ready(WATCH_MS);
    board_run(&board, 10 * WATCH_MS);
    assert_false(has_torque());
    board_run(&board, 1000);
    assert_int_equal(board_state(&board, MCU_STATE_STATE), CONTROLLER_OFF);
    board_run(&board, 10);
    assert_false(has_torque());
    assert_int_equal(board_state(&board, MCU_STATE_SILENT), 1);
    assert_true(board_command(&board, MCU_COMMAND_ENABLE, 0));
    board_run(&board, 3);
    assert_true(has_torque());
    assert_int_equal(board_state(&board, MCU_STATE_SILENT), 0);
}

static void without_a_watch_silence_means_nothing(void **state)
{
    (void)state;
    get_ready(0);
    assert_int_equal(board_state(&board, MCU_STATE_WATCH), 0);
    board_run(&board, 200000);
    assert_true(has_torque());
    assert_true(board_command(&board, MCU_COMMAND_WATCH, MCU_WATCH_MAX));
    assert_false(board_command(&board, MCU_COMMAND_WATCH, MCU_WATCH_MAX + 1));
    assert_int_equal(board_state(&board, MCU_STATE_WATCH), MCU_WATCH_MAX);
    board_run(&board, MCU_WATCH_MAX - 1);
    assert_true(has_torque());
    board_run(&board, 2);
    assert_false(has_torque());
}

/* The count of ticks wraps while it is silent, and after. */
static void ticks_wrap_in_silence(void **state)
{
    (void)state;
    get_ready(WATCH_MS);
    board.unit.tick = UINT32_MAX - WATCH_MS / 2;
    (void)board_state(&board, MCU_STATE_STATE);
    board_run(&board, WATCH_MS - 1);
    assert_true(has_torque());
    board_run(&board, 2);
    assert_false(has_torque());
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(axes_that_move_stop_along_their_path),
        cmocka_unit_test(what_ended_by_silence_does_not_begin_again),
        cmocka_unit_test(without_a_watch_silence_means_nothing),
        cmocka_unit_test(ticks_wrap_in_silence),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
