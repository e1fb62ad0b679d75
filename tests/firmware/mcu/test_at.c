/* tests/firmware/mcu/test_at.c - a command that waits for its tick: done between
 * the tick before and that one, or not at all. */
#include <string.h>

#include "tests/firmware/mcu/board.h"

#define MS 1000000 /* ns, a tick of the board */

static struct board board;
static struct board_move move;
static struct board_pieces pieces;

static void get_ready(unsigned ticks_before)
{
    board_make_move(&move, BOARD_WINDOW, check_stream());
    board_make_pieces(&pieces, &move, check_stream());
    board_init(&board);
    board_ticks(&board, ticks_before);
    board_set_up(&board, &move);
    for (unsigned i = 0; i < pieces.count; i++)
        assert_true(
            board_send(&board, MCU_AT_PIECE, pieces.word[i], pieces.length[i]));
    assert_true(board_command(&board, MCU_COMMAND_ENABLE, 0));
    board_ticks(&board, 3);
    assert_int_equal(board.unit.controller.state, CONTROLLER_READY);
}

static bool command_at(enum mcu_command what, uint32_t value, uint32_t at)
{
    uint16_t word[MCU_COMMAND_AT] = { (uint16_t)(board.registers.sequence + 1),
                                      (uint16_t)what };

    mcu_words_put(word + 2, value, 2);
    mcu_words_put(word + 4, at, 2);
    return board_send(&board, MCU_AT_COMMAND, word, MCU_COMMAND_AT);
}

/* Until long after the tick nothing has moved. */
static void never_began(void)
{
    board_run(&board, MCU_COMMAND_AHEAD + 10);
    assert_int_equal(board.unit.log.next, 0);
    assert_int_equal(board_state(&board, MCU_STATE_WAITING), 0);
}

static void a_move_begins_in_its_tick(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 50; i++) {
        uint32_t at;
        get_ready(board_below(check_stream(), 100));
        if (i % 2 == 0) /* the count of ticks wraps meanwhile */
            board.unit.tick = UINT32_MAX - board_below(check_stream(), 200);
        at = board.unit.tick + 1 + board_below(check_stream(), 300);
        assert_true(command_at(MCU_COMMAND_START, move.id, at));
        assert_int_equal(board_state(&board, MCU_STATE_RESULT),
                         MCU_RESULT_WAITS);
        assert_int_equal(board_state(&board, MCU_STATE_WAITING),
                         board.registers.sequence);
        mcu_registers_poll(&board.registers);
        while (board.unit.tick + 1 != at) {
            board_run(&board, 1);
            assert_int_equal(board.unit.log.next, 0);
        }
        assert_int_equal(board_state(&board, MCU_STATE_RESULT),
                         MCU_RESULT_DONE);
        board_run(&board, 1);
        assert_int_equal(board.unit.log.next, 1);
        assert_int_equal(board.unit.began, at);
    }
}

static void what_comes_too_late_or_too_early_is_refused(void **state)
{
    static const uint32_t ahead[] = { 0, UINT32_MAX, UINT32_MAX / 2,
                                      MCU_COMMAND_AHEAD + 1 };
    (void)state;

    for (unsigned i = 0; i < 4; i++) {
        get_ready(10);
        assert_false(
            command_at(MCU_COMMAND_START, move.id, board.unit.tick + ahead[i]));
        assert_int_equal(board_state(&board, MCU_STATE_RESULT),
                         MCU_RESULT_LATE);
        never_began();
    }
    assert_true(command_at(MCU_COMMAND_START, move.id,
                           board.unit.tick + MCU_COMMAND_AHEAD));
}

/* The main loop was busy with something else when its tick came. */
static void what_missed_its_tick_is_not_done_later(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 5; i++) {
        get_ready(10);
        assert_true(
            command_at(MCU_COMMAND_START, move.id, board.unit.tick + 20));
        board_run(&board, 18);
        board_ticks(&board, 2 + i);
        mcu_registers_poll(&board.registers);
        assert_int_equal(board_state(&board, MCU_STATE_RESULT),
                         MCU_RESULT_LATE);
        never_began();
    }
}

static void nothing_waits_through_another_command_or_state(void **state)
{
    static const enum mcu_command other[] = { MCU_COMMAND_STOP, MCU_COMMAND_OFF,
                                              MCU_COMMAND_OVERRIDE };
    (void)state;

    for (unsigned i = 0; i < 3; i++) {
        get_ready(10);
        assert_true(
            command_at(MCU_COMMAND_START, move.id, board.unit.tick + 200));
        board_run(&board, 20);
        board_command(&board, other[i], 1u << 30);
        board_run(&board, 10);
        board_command(&board, MCU_COMMAND_ENABLE, 0);
        never_began();
    }
    get_ready(10);
    assert_true(command_at(MCU_COMMAND_START, move.id, board.unit.tick + 200));
    board.unit.drive[1].state = HAL_DRIVE_FAULT;
    board_run(&board, 5);
    assert_int_equal(board_state(&board, MCU_STATE_RESULT), MCU_RESULT_STATE);
    board.unit.drive[1].state = HAL_DRIVE_OFF;
    assert_true(board_command(&board, MCU_COMMAND_RESET, 0));
    board_run(&board, 5);
    assert_true(board_command(&board, MCU_COMMAND_ENABLE, 0));
    never_began();
}

static void a_stop_never_waits_and_a_move_must_be_there(void **state)
{
    static const enum mcu_command what[] = { MCU_COMMAND_ENABLE,
                                             MCU_COMMAND_STOP, MCU_COMMAND_OFF,
                                             MCU_COMMAND_RESET };
    (void)state;

    get_ready(10);
    for (unsigned i = 0; i < 4; i++) {
        assert_false(command_at(what[i], 0, board.unit.tick + 20));
        assert_int_equal(board_state(&board, MCU_STATE_RESULT), MCU_RESULT_ARG);
    }
    assert_false(
        command_at(MCU_COMMAND_START, move.id ^ 2, board.unit.tick + 20));
    assert_int_equal(board_state(&board, MCU_STATE_RESULT),
                     MCU_RESULT_NOT_THERE);
    never_began();
}

/* The answer was lost: the master sends the same frame again, before and after
 * its tick. */
static void a_repeated_command_is_done_once(void **state)
{
    uint16_t word[MCU_COMMAND_AT];
    (void)state;

    get_ready(10);
    word[0] = (uint16_t)(board.registers.sequence + 1);
    word[1] = MCU_COMMAND_START;
    mcu_words_put(word + 2, move.id, 2);
    mcu_words_put(word + 4, board.unit.tick + 20, 2);
    for (unsigned i = 0; i < 5; i++)
        assert_true(board_send(&board, MCU_AT_COMMAND, word, MCU_COMMAND_AT));
    board_run(&board, 20);
    assert_int_equal(board.unit.log.next, 1);
    assert_true(board_send(&board, MCU_AT_COMMAND, word, MCU_COMMAND_AT));
    board_run(&board, 1);
    assert_int_equal(board.unit.log.next, 2);
}

/* Hold and resume, each in its own tick. */
static void a_hold_is_in_its_tick_too(void **state)
{
    (void)state;
    get_ready(10);
    assert_true(command_at(MCU_COMMAND_START, move.id, board.unit.tick + 5));
    board_run(&board, 10);
    assert_true(command_at(MCU_COMMAND_HOLD, 0, board.unit.tick + 3));
    board_run(&board, 1);
    assert_int_equal(board.unit.controller.state, CONTROLLER_MOVING);
    board_run(&board, 1);
    assert_int_equal(board.unit.controller.state, CONTROLLER_HOLDING);
}

struct ramp {
    uint32_t rate_q30, tick_ns, change, flat;
};

static bool ramp_at(const struct ramp *ramp, uint32_t at)
{
    uint16_t word[MCU_COMMAND_RAMP_WORDS] = {
        (uint16_t)(board.registers.sequence + 1), MCU_COMMAND_RAMP
    };

    mcu_words_put(word + 2, ramp->rate_q30, 2);
    mcu_words_put(word + 4, at, 2);
    mcu_words_put(word + MCU_RAMP_TICK, ramp->tick_ns, 2);
    mcu_words_put(word + MCU_RAMP_CHANGE, ramp->change, 2);
    mcu_words_put(word + MCU_RAMP_FLAT, ramp->flat, 2);
    return board_send(&board, MCU_AT_COMMAND, word, MCU_COMMAND_RAMP_WORDS);
}

/* Ticks that the board has to judge one. */
#define AHEAD 40

/* To rest, as slow as told, and on again; not while another ramp is under way, nor
 * without a tick, nor by the numbers of another command. */
static void a_ramp_begins_in_its_tick(void **state)
{
    static const struct ramp rest = { 0, 5 * MS, 20, 40 };
    static const struct ramp on = { 1 << 30, 5 * MS, 20, 0 };
    const struct controller *controller = &board.unit.controller;
    (void)state;
    get_ready(10);
    assert_false(board_command(&board, MCU_COMMAND_RAMP, 0));
    assert_int_equal(board_state(&board, MCU_STATE_RESULT), MCU_RESULT_ARG);
    assert_true(command_at(MCU_COMMAND_START, move.id, board.unit.tick + 5));
    board_run(&board, 10);
    assert_false(command_at(MCU_COMMAND_RAMP, 0, board.unit.tick + AHEAD));
    assert_int_equal(board_state(&board, MCU_STATE_RESULT), MCU_RESULT_ARG);
    assert_true(ramp_at(&rest, board.unit.tick + 2)); /* not judged by then */
    board_run(&board, 1);
    assert_int_equal(board_state(&board, MCU_STATE_RESULT), MCU_RESULT_LIMIT);
    assert_int_equal(controller->state, CONTROLLER_MOVING);
    assert_true(ramp_at(&rest, board.unit.tick + AHEAD));
    board_run(&board, AHEAD - 2);
    assert_int_equal(controller->state, CONTROLLER_MOVING);
    board_run(&board, 1);
    assert_int_equal(board_state(&board, MCU_STATE_RESULT), MCU_RESULT_DONE);
    assert_int_equal(controller->state, CONTROLLER_HOLDING);
    const int64_t begin_ns = controller->clock_ns;
    assert_false(ramp_at(&on, board.unit.tick + AHEAD));
    assert_int_equal(board_state(&board, MCU_STATE_RESULT), MCU_RESULT_STATE);
    while (controller->rate.rate_q30 > 0)
        board_run(&board, 1);
    assert_int_equal(controller->clock_ns - begin_ns, 80 * rest.tick_ns);
    assert_true(ramp_at(&on, board.unit.tick + AHEAD));
    board_run(&board, AHEAD - 1);
    assert_int_equal(controller->state, CONTROLLER_MOVING);
    board_run(&board, 40 * on.tick_ns / MS);
    assert_int_equal(controller->rate.rate_q30, 1 << 30);
}

/* Out of range, too late, or more than the axes may: as if it had not been said. */
static void a_ramp_that_is_none_changes_nothing(void **state)
{
    static const struct {
        struct ramp ramp;
        unsigned ahead;
        uint16_t result;
    } rows[] = {
        { { (2u << 30) + 1, MS, 100, 0 }, AHEAD, MCU_RESULT_ARG },
        { { 0, 0, 100, 0 }, AHEAD, MCU_RESULT_ARG },
        { { 0, MS / 2, 100, 0 }, AHEAD, MCU_RESULT_ARG },
        { { 0, MS + 1, 100, 0 }, AHEAD, MCU_RESULT_ARG },
        { { 0, 1001 * MS, 100, 0 }, AHEAD, MCU_RESULT_ARG },
        { { 0, MS, 0, 100 }, AHEAD, MCU_RESULT_ARG },
        { { 0, MS, UINT32_MAX, 0 }, AHEAD, MCU_RESULT_ARG },
        { { 0, MS, 100, UINT32_MAX }, AHEAD, MCU_RESULT_ARG },
        { { 0, MS, 1 << 20, 0 }, AHEAD, MCU_RESULT_ARG },
        { { 2u << 30, MS, 100, 0 }, AHEAD, MCU_RESULT_LIMIT },
        { { 0, MS, 1, 0 }, AHEAD, MCU_RESULT_LIMIT },
        { { 0, MS, 100, 300 }, MCU_COMMAND_AHEAD + 1, MCU_RESULT_LATE },
    };
    const struct controller *controller = &board.unit.controller;
    (void)state;
    get_ready(10);
    for (unsigned i = 0; i < board.unit.axis_count; i++) {
        struct motion_extreme acc;
        motion_track_extreme(&move.track[i], MOTION_ACC, &acc);
        board.unit.axis_config[i].limit.acc_q32 =
            (acc.max > -acc.min ? acc.max : -acc.min) + 1;
    }
    assert_true(command_at(MCU_COMMAND_START, move.id, board.unit.tick + 5));
    board_run(&board, 300);
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        if (ramp_at(&rows[i].ramp, board.unit.tick + rows[i].ahead))
            board_run(&board, AHEAD);
        if (board_state(&board, MCU_STATE_RESULT) != rows[i].result)
            fail_msg("row %zu: %u", i, board_state(&board, MCU_STATE_RESULT));
        assert_int_equal(controller->state, CONTROLLER_MOVING);
        assert_int_equal(controller->rate.rate_q30, 1 << 30);
        assert_int_equal(controller->warp.dur_ns, 0);
    }
}

/* Beside whatever waits or moves; its set points are those of their ticks. */
static void its_clock_is_steered_within_500_ppm(void **state)
{
    (void)state;
    board_init(&board);
    assert_int_equal(board.unit.clock_ppb, 0);
    assert_true(board_command(&board, MCU_COMMAND_CLOCK, (uint32_t)-500000));
    assert_int_equal(board.unit.clock_ppb, -500000);
    assert_false(board_command(&board, MCU_COMMAND_CLOCK, (uint32_t)-500001));
    assert_false(board_command(&board, MCU_COMMAND_CLOCK, 500001));
    assert_int_equal(board.unit.clock_ppb, -500000);
    assert_true(board_command(&board, MCU_COMMAND_CLOCK, 500000));
    assert_int_equal(board.unit.clock_ppb, 500000);
    board_init(&board);
    assert_int_equal(board.unit.clock_ppb, 0); /* after a reset */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_move_begins_in_its_tick),
        cmocka_unit_test(what_comes_too_late_or_too_early_is_refused),
        cmocka_unit_test(what_missed_its_tick_is_not_done_later),
        cmocka_unit_test(nothing_waits_through_another_command_or_state),
        cmocka_unit_test(a_stop_never_waits_and_a_move_must_be_there),
        cmocka_unit_test(a_repeated_command_is_done_once),
        cmocka_unit_test(a_hold_is_in_its_tick_too),
        cmocka_unit_test(a_ramp_begins_in_its_tick),
        cmocka_unit_test(a_ramp_that_is_none_changes_nothing),
        cmocka_unit_test(its_clock_is_steered_within_500_ppm),
    };

    seed_from("commands in their tick");
    return cmocka_run_group_tests(tests, NULL, NULL);
}
