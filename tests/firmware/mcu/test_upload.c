/* tests/firmware/mcu/test_upload.c - a move sent to a board over a line that
 * cuts, corrupts, repeats and reorders: either the board has it, to the bit, or
 * it does not start; what it has it says. */
#include <string.h>

#include "tests/firmware/mcu/board.h"

/* --- tests ---------------------------------------------------------------- */

static struct board board;
static struct board_move move, other;
static struct board_pieces pieces, others;

/* As a line may do it: bytes changed, cut at either end, doubled, and pieces of
 * another move among them. */
static unsigned damage(uint8_t frame[512], unsigned length)
{
    switch (board_below(check_stream(), 6)) {
    case 0:
        frame[board_below(check_stream(), length)] ^=
            (uint8_t)(1 + board_below(check_stream(), 255));
        return length;
    case 1:
        return board_below(check_stream(), length);
    case 2: {
        const unsigned cut = 1 + board_below(check_stream(), length - 1);
        memmove(frame, frame + cut, length - cut);
        return length - cut;
    }
    case 3: {
        const unsigned at = board_below(check_stream(), length);
        memmove(frame + at + 1, frame + at, length - at);
        return length + 1;
    }
    case 4:
        memcpy(frame + length, frame, length);
        return 2 * length;
    default:
        return length;
    }
}

static void a_line_that_does_everything_wrong(void **state)
{
    (void)state;
    for (unsigned run = 0; run < 300; run++) {
        unsigned tries = 0;
        board_make_move(&move, BOARD_WINDOW, check_stream());
        board_make_slow(&other, &move);
        board_make_pieces(&pieces, &move, check_stream());
        board_make_pieces(&others, &other, check_stream());
        board_init(&board);
        board_set_up(&board, &move);
        while (!mcu_upload_has(&board.upload, move.id)) {
            uint8_t frame[512], answer[256];
            const bool stray = board_below(check_stream(), 40) == 0 &&
                               board.upload.move_id != 0;
            const struct board_pieces *from = stray ? &others : &pieces;
            const unsigned which =
                stray ? BOARD_AXES + board_below(check_stream(),
                                                 others.count - BOARD_AXES)
                      : board_below(check_stream(), pieces.count);
            const unsigned length = board_put_write(
                frame, MCU_AT_PIECE, from->word[which], from->length[which]);
            board_hears(&board, frame, damage(frame, length), answer);
            assert_false(board_command(&board, MCU_COMMAND_START, move.id));
            board_has_nothing_wrong(&board, &move);
            if (++tries > 200000)
                fail_msg("run %u: never there", run);
        }
        for (unsigned i = 0; i < BOARD_AXES; i++)
            assert_int_equal(board.unit.window[i].filled, move.track[i].count);
    }
}

/* Every bit of a frame, and every length it may be cut to. */
static void no_single_error_passes(void **state)
{
    uint8_t frame[512], answer[256], bad[512];
    (void)state;

    board_make_move(&move, BOARD_WINDOW, check_stream());
    board_make_pieces(&pieces, &move, check_stream());
    board_init(&board);
    board_set_up(&board, &move);
    for (unsigned which = 0; which <= BOARD_AXES; which++) {
        const unsigned length = board_put_write(
            frame, MCU_AT_PIECE, pieces.word[which], pieces.length[which]);
        const uint32_t taken = board.upload.taken;
        for (unsigned bit = 0; bit < 8 * length; bit++) {
            memcpy(bad, frame, length);
            bad[bit / 8] ^= (uint8_t)(1 << bit % 8);
            assert_int_equal(board_hears(&board, bad, length, answer), 0);
        }
        for (unsigned cut = 1; cut < length; cut++)
            assert_int_equal(board_hears(&board, frame, cut, answer), 0);
        assert_int_equal(board.upload.taken, taken);
        assert_int_equal(board_hears(&board, frame, length, answer),
                         HAL_MODBUS_WRITE_MANY);
        assert_int_equal(board.upload.taken, taken + 1);
    }
}

/* Past the frame's checksum, as if a master had composed it wrong. */
static void a_piece_with_its_own_checksum_wrong(void **state)
{
    (void)state;
    board_make_move(&move, BOARD_WINDOW, check_stream());
    board_make_pieces(&pieces, &move, check_stream());
    board_init(&board);
    board_set_up(&board, &move);
    for (unsigned bit = 0; bit < 16 * pieces.length[0]; bit++) {
        pieces.word[0][bit / 16] ^= (uint16_t)(1 << bit % 16);
        assert_int_equal(
            mcu_upload_put(&board.upload, pieces.word[0], pieces.length[0]),
            MCU_PIECE_E_CHECKSUM);
        pieces.word[0][bit / 16] ^= (uint16_t)(1 << bit % 16);
    }
    assert_int_equal(board.upload.head_axes, 0);
}

static enum mcu_piece_result
put_track(uint32_t number, const struct motion_segment *segment, unsigned count)
{
    uint16_t piece[MCU_PIECE_MAX];

    return mcu_upload_put(
        &board.upload, piece,
        mcu_piece_put_track(piece, move.id, 0, number, segment, count));
}

/* Numbers that no plan has, and plans that do not fit their heads, are refused
 * although every checksum is right; the two good segments before are too. */
static void a_piece_is_taken_as_a_whole(void **state)
{
    struct motion_segment bad[3];
    (void)state;

    do
        board_make_move(&move, BOARD_WINDOW, check_stream());
    while (move.track[0].count < 4);
    board_make_pieces(&pieces, &move, check_stream());
    board_init(&board);
    board_set_up(&board, &move);
    for (unsigned i = 0; i < BOARD_AXES; i++)
        assert_int_equal(
            mcu_upload_put(&board.upload, pieces.word[i], pieces.length[i]),
            MCU_PIECE_TAKEN);
    memcpy(bad, move.segment[0], sizeof bad);
    bad[2].pos_q32++;
    assert_int_equal(put_track(0, bad, 3), MCU_PIECE_E_GAP);
    bad[2].pos_q32--;
    bad[2].dur_ns_q12 = 0;
    assert_int_equal(put_track(0, bad, 3), MCU_PIECE_E_VALUE);
    bad[2] = move.segment[0][2];
    bad[2].dur_ns_q12 /= 1000; /* the same path, far too fast */
    assert_int_equal(put_track(0, bad, 3), MCU_PIECE_E_LIMIT);
    assert_int_equal(board.unit.window[0].filled, 0);
    assert_int_equal(put_track(1, move.segment[0] + 1, 3), MCU_PIECE_E_ORDER);
    assert_int_equal(put_track(0, move.segment[0], 3), MCU_PIECE_TAKEN);
    assert_int_equal(put_track(0, move.segment[0], 3), MCU_PIECE_REPEATED);
    assert_int_equal(put_track(1, move.segment[0] + 1, 3), MCU_PIECE_E_ORDER);
    assert_int_equal(board.unit.window[0].filled, 3);
}

/* One segment of each axis that has any left and room. */
static void stream(unsigned next[BOARD_AXES])
{
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        uint16_t piece[MCU_PIECE_MAX];
        enum mcu_piece_result result;
        if (next[i] == move.track[i].count)
            continue;
        result =
            mcu_upload_put(&board.upload, piece,
                           mcu_piece_put_track(piece, move.id, i, next[i],
                                               &move.segment[i][next[i]], 1));
        if (result == MCU_PIECE_TAKEN)
            next[i]++;
        else
            assert_int_equal(result, MCU_PIECE_E_FULL);
    }
}

static void is_on_its_path(struct motion_cursor cursor[BOARD_AXES])
{
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        struct motion_sample want;
        motion_track_sample(&move.track[i], &cursor[i],
                            board.unit.controller.rate.s_ns_q12, &want);
        assert_int_equal(board.unit.drive[i].pos_q32, want.pos_q32);
    }
}

static void begin_move(uint32_t most)
{
    board_make_move(&move, most, check_stream());
    board_make_pieces(&pieces, &move, check_stream());
    board_init(&board);
    board_set_up(&board, &move);
    for (unsigned i = 0; i < BOARD_AXES; i++)
        assert_true(
            board_send(&board, MCU_AT_PIECE, pieces.word[i], pieces.length[i]));
    assert_true(board_command(&board, MCU_COMMAND_ENABLE, 0));
    board_ticks(&board, 3);
}

/* Longer than the window: what has been played makes room for what comes, and
 * the drives get the move to the bit. */
static void a_move_of_any_length_streams(void **state)
{
    (void)state;
    for (unsigned run = 0; run < 20; run++) {
        unsigned next[BOARD_AXES] = { 0 };
        struct motion_cursor cursor[BOARD_AXES] = { { 0 } };
        begin_move(BOARD_SEGMENTS);
        while (!board_command(&board, MCU_COMMAND_START, move.id))
            stream(next);
        do {
            board_ticks(&board, 1);
            is_on_its_path(cursor);
            stream(next);
        } while (mcu_unit_is_moving(&board.unit));
        assert_int_equal(board.unit.controller.state, CONTROLLER_READY);
        assert_int_equal(board.unit.controller.fault.fault,
                         CONTROLLER_FAULT_NONE);
    }
}

/* The sender falls silent: the axes stop along the path before what there is
 * ends, and the fault says why. */
static void an_upload_that_ends_early_stops_the_axes(void **state)
{
    unsigned next[BOARD_AXES] = { 0 };
    struct motion_cursor cursor[BOARD_AXES] = { { 0 } };
    (void)state;

    do {
        memset(next, 0, sizeof next);
        begin_move(BOARD_SEGMENTS);
    } while (move.track[0].count < 3 * BOARD_WINDOW);
    while (!board_command(&board, MCU_COMMAND_START, move.id))
        stream(next);
    do {
        board_ticks(&board, 1);
        is_on_its_path(cursor);
    } while (mcu_unit_is_moving(&board.unit));
    assert_int_equal(board.unit.controller.state, CONTROLLER_FAULT);
    assert_int_equal(board.unit.controller.fault.fault, CONTROLLER_FAULT_TRACK);
    assert_true(board.unit.controller.rate.s_ns_q12 <
                board.unit.window[0].end_ns_q12);
}

/* A whole move is played again; one that has lost its beginning is not. */
static void a_move_that_fits_plays_again(void **state)
{
    unsigned next[BOARD_AXES] = { 0 };
    (void)state;

    begin_move(BOARD_WINDOW);
    while (!mcu_upload_has(&board.upload, move.id))
        stream(next);
    assert_true(board_command(&board, MCU_COMMAND_START, move.id));
    do
        board_ticks(&board, 1);
    while (mcu_unit_is_moving(&board.unit));
    assert_int_equal(board.unit.window[0].first, 0);
    assert_false(board_command(&board, MCU_COMMAND_START, move.id));
    assert_int_equal(board.registers.result, MCU_RESULT_AWAY);
    assert_true(board_command(&board, MCU_COMMAND_OFF, 0));
    for (unsigned i = 0; i < BOARD_AXES; i++)
        board.unit.drive[i].pos_q32 = move.segment[i][0].pos_q32;
    board_ticks(&board, 1);
    assert_true(board_command(&board, MCU_COMMAND_ENABLE, 0));
    board_ticks(&board, 3);
    assert_true(board_command(&board, MCU_COMMAND_START, move.id));
}

/* The same sequence number is the same command. */
static void a_command_that_is_repeated_is_done_once(void **state)
{
    uint16_t word[4] = { 7, MCU_COMMAND_STOP };
    (void)state;

    begin_move(BOARD_WINDOW);
    assert_true(board_send(&board, MCU_AT_COMMAND, word, 4));
    assert_true(board_send(&board, MCU_AT_COMMAND, word, 4));
    assert_int_equal(board.unit.controller.stops, 1);
    word[0] = 8;
    assert_true(board_send(&board, MCU_AT_COMMAND, word, 4));
    assert_int_equal(board.unit.controller.stops, 2);
    word[0] = 0;
    assert_false(board_send(&board, MCU_AT_COMMAND, word, 4));
    word[0] = 9;
    word[1] = 99;
    assert_false(board_send(&board, MCU_AT_COMMAND, word, 4));
    assert_int_equal(board.registers.result, MCU_RESULT_ARG);
}

/* Any register, any count: an answer or an exception, and no byte beyond. */
static void every_register_answers_or_refuses(void **state)
{
    uint16_t value[HAL_MODBUS_READ_MAX + 1];
    (void)state;

    begin_move(BOARD_WINDOW);
    for (unsigned address = 0; address <= UINT16_MAX; address += 1)
        for (uint16_t count = 1; count <= HAL_MODBUS_READ_MAX; count += 31) {
            value[count] = 0xBEEF;
            const uint8_t exception = board.registers.slave.ops->get(
                &board.registers.slave, MODBUS_HOLDING, (uint16_t)address,
                count, value);
            assert_true(exception == 0 || exception == 2 || exception == 3);
            assert_int_equal(value[count], 0xBEEF);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_line_that_does_everything_wrong),
        cmocka_unit_test(no_single_error_passes),
        cmocka_unit_test(a_piece_with_its_own_checksum_wrong),
        cmocka_unit_test(a_piece_is_taken_as_a_whole),
        cmocka_unit_test(a_move_of_any_length_streams),
        cmocka_unit_test(an_upload_that_ends_early_stops_the_axes),
        cmocka_unit_test(a_move_that_fits_plays_again),
        cmocka_unit_test(a_command_that_is_repeated_is_done_once),
        cmocka_unit_test(every_register_answers_or_refuses),
    };
    seed_from("uploads");
    return cmocka_run_group_tests(tests, NULL, NULL);
}
