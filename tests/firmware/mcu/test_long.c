/* tests/firmware/mcu/test_long.c - 5,000 s on a board, in warped time, while
 * every counter that can wrap does: ticks and milliseconds of 32 bits, entries
 * of the log, pieces, numbers of commands. */
#include <string.h>

#include "tests/firmware/mcu/board.h"

#define LONG_SEGMENTS 1000
#define LONG_S        5
#define S_Q12         (INT64_C(1000000000) << 12)
#define HALF_TICKS    (LONG_SEGMENTS * LONG_S * 1000u / 2)

static struct board board;
static struct board_move start; /* where the axes stand */
static struct motion_segment segment[BOARD_AXES][LONG_SEGMENTS];
static struct motion_track track[BOARD_AXES];

static void make_long(void)
{
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        struct motion_state from = { 0 };
        motion_track_init(&track[i], segment[i], LONG_SEGMENTS, 0);
        for (unsigned k = 0; k < LONG_SEGMENTS; k++) {
            struct motion_state to = {
                .pos_q32 = (int64_t)board_below(check_stream(), 100) * BOARD_ONE
            };
            if (k + 1 < LONG_SEGMENTS)
                to.vel_q32 = board_below(check_stream(), UINT32_MAX);
            assert_int_equal(motion_track_append_quintic(
                                 &track[i], LONG_S * S_Q12, &from, &to),
                             MOTION_OK);
            from = to;
        }
    }
}

static void send_heads(void)
{
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        struct mcu_head head;
        uint16_t piece[MCU_PIECE_MAX];
        mcu_head_of(&track[i], &head);
        assert_true(board_send(&board, MCU_AT_PIECE, piece,
                               mcu_piece_put_head(piece, start.id, i, &head)));
    }
}

static void stream(void)
{
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        struct mcu_window *window = &board.unit.window[i];
        while (window->filled < LONG_SEGMENTS && mcu_window_free(window) > 0) {
            uint16_t piece[MCU_PIECE_MAX];
            const uint32_t at = window->filled;
            assert_true(board_send(&board, MCU_AT_PIECE, piece,
                                   mcu_piece_put_track(piece, start.id, i, at,
                                                       &segment[i][at], 1)));
        }
    }
}

/* As a master numbers them: never 0. */
static void command(enum mcu_command what, uint32_t value)
{
    uint16_t word[MCU_COMMAND_WORDS] = { (uint16_t)(board.registers.sequence +
                                                    1) };

    if (word[0] == 0)
        word[0] = 1;
    word[1] = (uint16_t)what;
    mcu_words_put(word + 2, value, 2);
    assert_true(board_send(&board, MCU_AT_COMMAND, word, MCU_COMMAND_WORDS));
}

/* Each wraps half way. */
static void set_counters(void)
{
    board.unit.controller.ticks = UINT32_MAX - HALF_TICKS;
    board.unit.log.next = UINT32_MAX - HALF_TICKS;
    board.upload.taken = UINT32_MAX - LONG_SEGMENTS / 2;
    board.upload.refused = UINT32_MAX - LONG_SEGMENTS / 2;
    board.registers.sequence = (uint16_t)(UINT16_MAX - LONG_SEGMENTS / 2);
}

/* The newest entries of the log can be read, the ones before cannot. */
static void log_is_there(void)
{
    const struct mcu_log *log = &board.unit.log;
    const uint32_t first = mcu_log_first(log);

    assert_int_equal(log->next - first, log->held);
    assert_null(mcu_log_entry(log, log->next));
    assert_null(mcu_log_entry(log, first - 1));
    assert_non_null(mcu_log_entry(log, first));
    for (unsigned i = 0; i < BOARD_AXES; i++)
        assert_int_equal(mcu_log_entry(log, log->next - 1)[1 + i],
                         board.unit.drive[i].pos_q32);
}

static void one_tick(struct motion_cursor cursor[BOARD_AXES])
{
    board_ticks(&board, 1);
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        struct motion_sample want;
        motion_track_sample(&track[i], &cursor[i],
                            board.unit.controller.rate.s_ns_q12, &want);
        if (board.unit.drive[i].pos_q32 != want.pos_q32)
            fail_msg("axis %u is not where it should be at %" PRId64 " ns", i,
                     board.unit.controller.rate.s_ns_q12 >> 12);
    }
}

static void five_thousand_seconds_and_every_wrap(void **state)
{
    struct motion_cursor cursor[BOARD_AXES] = { { 0 } };
    uint16_t bad[MCU_PIECE_MAX] = { 0 };
    uint32_t ticks = 0;
    (void)state;

    make_long();
    start.id = 5000;
    board_init(&board);
    board.tick_ns = (((int64_t)1 << 32) - HALF_TICKS) * board_config.period_ns;
    board.now_ns = board.tick_ns;
    board_set_up(&board, &start);
    send_heads();
    stream();
    command(MCU_COMMAND_ENABLE, 0);
    board_ticks(&board, 3);
    command(MCU_COMMAND_START, start.id);
    set_counters();
    for (; mcu_unit_is_moving(&board.unit); ticks++) {
        one_tick(cursor);
        if (ticks % (LONG_S * 1000) != 0)
            continue;
        stream();
        command(MCU_COMMAND_OVERRIDE, 1u << 30);
        assert_false(board_send(&board, MCU_AT_PIECE, bad, 10));
        log_is_there();
    }
    assert_int_equal(board.unit.controller.state, CONTROLLER_READY);
    assert_int_equal(board.unit.controller.fault.fault, CONTROLLER_FAULT_NONE);
    assert_in_range(ticks, 2 * HALF_TICKS, 2 * HALF_TICKS + 10);
    assert_int_equal(board.unit.log.next,
                     (uint32_t)(UINT32_MAX - HALF_TICKS + ticks));
    /* All have wrapped. */
    assert_true(board.unit.controller.ticks > UINT32_MAX);
    assert_true(board.unit.log.next < UINT32_MAX / 2);
    assert_true(board.upload.taken < UINT32_MAX / 2);
    assert_true(board.upload.refused < UINT32_MAX / 2);
    assert_true(board.registers.sequence < UINT16_MAX / 2);
    assert_true(board.tick_ns > ((int64_t)1 << 32) * board_config.period_ns);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(five_thousand_seconds_and_every_wrap),
    };
    seed_from("long moves");
    return cmocka_run_group_tests(tests, NULL, NULL);
}
