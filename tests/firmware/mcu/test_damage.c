/* tests/firmware/mcu/test_damage.c - every byte of every frame of an upload,
 * damaged in every way, and every order of its pieces: the board is as before,
 * and its registers say what it has. */
#include <string.h>

#include "tests/firmware/mcu/board.h"
#include "tests/firmware/mcu/damage.h"
#include "tests/support/piece_text.h"

static struct board board, before;
static struct board_move move, other;
static struct board_pieces pieces, others;

/* --- what must not change ------------------------------------------------- */

static void keep(void)
{
    memcpy(&before, &board, sizeof board);
}

/* Byte by byte: both are copies of one board, padding too. */
static bool differ(const void *a, const void *b, size_t size)
{
    return memcmp(a, b, size) != 0;
}

/* All but what counts pieces and receives bytes. */
static void is_as_before(const char *what, unsigned kind, unsigned at)
{
    struct mcu_upload *then = &before.upload;

    then->last = board.upload.last;
    then->taken = board.upload.taken;
    then->refused = board.upload.refused;
    if (differ(then, &board.upload, sizeof *then) ||
        differ(&before.unit, &board.unit, sizeof board.unit) ||
        differ(&before.registers, &board.registers, sizeof board.registers))
        fail_msg("%s: kind %u at byte %u changes the board", what, kind, at);
    board_has_nothing_wrong(&board, &move);
}

static void reads(uint16_t address, uint16_t count, uint16_t *value)
{
    assert_int_equal(board.registers.slave.ops->get(&board.registers.slave,
                                                    MODBUS_HOLDING, address,
                                                    count, value),
                     0);
}

/* The registers are what the board has: `sent` segments of each axis. */
static void says_what_it_has(uint32_t id, uint16_t setups, uint16_t heads,
                             const unsigned sent[BOARD_AXES])
{
    uint16_t state[MCU_STATE_WORDS], axis[MCU_AXIS_WORDS];
    bool whole = id != 0 && heads == (1u << BOARD_AXES) - 1;

    reads(MCU_AT_STATE, MCU_STATE_WORDS, state);
    assert_int_equal(mcu_words_get(state + MCU_STATE_MOVE_ID, 2), id);
    assert_int_equal(state[MCU_STATE_SETUP_AXES], setups);
    assert_int_equal(state[MCU_STATE_HEADS], heads);
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        reads((uint16_t)(MCU_AT_AXIS + i * MCU_AXIS_STEP), MCU_AXIS_WORDS,
              axis);
        assert_int_equal(mcu_words_get(axis + MCU_AXIS_NEXT, 2), sent[i]);
        whole = whole && sent[i] == move.track[i].count;
    }
    assert_int_equal(state[MCU_STATE_READY], whole);
}

/* A frame damaged at every byte in every way, in silence and with the rest of
 * it after a pause. */
static void survives(const char *what, const uint8_t *frame, unsigned length)
{
    uint8_t bad[DAMAGE_MAX], answer[256];

    for (unsigned kind = 0; kind < DAMAGE_KINDS; kind++)
        for (unsigned at = 0; at < length; at++) {
            unsigned bytes;
            memcpy(bad, frame, length);
            bytes = damage_frame(bad, length, kind, at);
            if (bytes == 0)
                continue;
            keep();
            board_hears(&board, bad, bytes, answer);
            is_as_before(what, kind, at);
        }
    for (unsigned at = 1; at < length; at++) {
        keep();
        board_hears(&board, frame, at, answer);
        board_hears(&board, frame + at, length - at, answer);
        is_as_before(what, DAMAGE_KINDS, at);
    }
}

static void survives_then_takes(const char *what, uint16_t address,
                                const uint16_t *value, unsigned count)
{
    uint8_t frame[256], answer[256];
    const unsigned length = board_put_write(frame, address, value, count);

    survives(what, frame, length);
    assert_int_equal(board_hears(&board, frame, length, answer),
                     HAL_MODBUS_WRITE_MANY);
}

/* --- the line ------------------------------------------------------------- */

static void every_byte_of_every_frame(void **state)
{
    unsigned sent[BOARD_AXES] = { 0 };
    uint16_t setups = 0, heads = 0, word[MCU_COMMAND_WORDS] = { 1 };
    uint16_t piece[MCU_PIECE_MAX];
    (void)state;

    board_make_move(&move, BOARD_WINDOW, check_stream());
    board_make_pieces(&pieces, &move, check_stream());
    board_init(&board);
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        says_what_it_has(0, setups, 0, sent);
        survives_then_takes("set-up", MCU_AT_PIECE, piece,
                            board_put_setup(piece, &move, i));
        setups |= (uint16_t)(1u << i);
    }
    for (unsigned i = 0; i < pieces.count; i++) {
        const uint16_t axis = pieces.word[i][1];
        says_what_it_has(heads == 0 ? 0 : move.id, setups, heads, sent);
        survives_then_takes(i < BOARD_AXES ? "head" : "segments", MCU_AT_PIECE,
                            pieces.word[i], pieces.length[i]);
        heads |= (uint16_t)(1u << axis);
        if (i >= BOARD_AXES)
            sent[axis] +=
                (pieces.length[i] - MCU_PIECE_AROUND) / MCU_PIECE_TRACK_WORDS;
    }
    says_what_it_has(move.id, setups, heads, sent);
    word[1] = MCU_COMMAND_ENABLE;
    survives_then_takes("enable", MCU_AT_COMMAND, word, MCU_COMMAND_WORDS);
    board_ticks(&board, 3);
    word[0]++;
    word[1] = MCU_COMMAND_START;
    mcu_words_put(word + 2, move.id, 2);
    survives_then_takes("start", MCU_AT_COMMAND, word, MCU_COMMAND_WORDS);
    assert_true(mcu_unit_is_moving(&board.unit));
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

/* The next piece of an axis; the last one again when all have gone. */
static unsigned next_piece(uint16_t piece[MCU_PIECE_MAX], unsigned axis,
                           unsigned *count)
{
    const uint32_t all = move.track[axis].count;
    const uint32_t filled = board.unit.window[axis].filled;
    const uint32_t at = filled < all ? filled : all - 1;

    *count = all - at < MCU_PIECE_SEGMENTS ? all - at : MCU_PIECE_SEGMENTS;
    return mcu_piece_put_track(piece, move.id, axis, at,
                               &move.segment[axis][at], *count);
}

static void stream(unsigned axis)
{
    uint16_t piece[MCU_PIECE_MAX];
    unsigned count;
    const unsigned length = next_piece(piece, axis, &count);

    if (mcu_window_free(&board.unit.window[axis]) >= count)
        assert_true(board_send(&board, MCU_AT_PIECE, piece, length));
}

/* Where the next damage goes: every byte, every way. */
struct walk {
    unsigned kind, at;
    bool done;
};

static void one_damage(struct walk *walk, const char *what, uint16_t address,
                       const uint16_t *value, unsigned count)
{
    uint8_t frame[DAMAGE_MAX], answer[256];
    unsigned length = board_put_write(frame, address, value, count);

    if (walk->at >= length) {
        walk->at = 0;
        walk->kind = (walk->kind + 1) % DAMAGE_KINDS;
        walk->done = walk->done || walk->kind == 0;
    }
    length = damage_frame(frame, length, walk->kind, walk->at);
    keep();
    if (length > 0)
        board_hears(&board, frame, length, answer);
    is_as_before(what, walk->kind, walk->at++);
}

/* One tick: damaged pieces of every axis, a damaged command, and one good piece
 * of one axis. */
static void one_tick(struct walk walk[BOARD_AXES + 1], unsigned tick)
{
    uint16_t piece[MCU_PIECE_MAX], word[MCU_COMMAND_WORDS] = { 0 };
    unsigned count;

    board_ticks(&board, 1);
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        const unsigned length = next_piece(piece, i, &count);
        one_damage(&walk[i], "segments", MCU_AT_PIECE, piece, length);
    }
    word[0] = (uint16_t)(board.registers.sequence + 1);
    word[1] = tick % 2 == 0 ? MCU_COMMAND_STOP : MCU_COMMAND_OFF;
    one_damage(&walk[BOARD_AXES], "command", MCU_AT_COMMAND, word,
               MCU_COMMAND_WORDS);
    stream(tick % BOARD_AXES);
}

static bool all_done(const struct walk walk[BOARD_AXES + 1])
{
    for (unsigned i = 0; i <= BOARD_AXES; i++)
        if (!walk[i].done)
            return false;
    return true;
}

static void every_byte_while_it_streams(void **state)
{
    struct walk walk[BOARD_AXES + 1] = { { 0 } };
    (void)state;

    for (unsigned run = 0; !all_done(walk); run++) {
        struct motion_cursor cursor[BOARD_AXES] = { { 0 } };
        assert_true(run < 100);
        board_make_move(&move, BOARD_SEGMENTS, check_stream());
        board_make_pieces(&pieces, &move, check_stream());
        board_init(&board);
        board_set_up(&board, &move);
        for (unsigned i = 0; i < BOARD_AXES; i++)
            assert_true(board_send(&board, MCU_AT_PIECE, pieces.word[i],
                                   pieces.length[i]));
        assert_true(board_command(&board, MCU_COMMAND_ENABLE, 0));
        board_ticks(&board, 3);
        while (!board_command(&board, MCU_COMMAND_START, move.id))
            for (unsigned i = 0; i < BOARD_AXES; i++) {
                uint16_t piece[MCU_PIECE_MAX];
                const uint32_t at = board.unit.window[i].filled;
                if (at < move.track[i].count)
                    board_send(&board, MCU_AT_PIECE, piece,
                               mcu_piece_put_track(piece, move.id, i, at,
                                                   &move.segment[i][at], 1));
            }
        for (unsigned tick = 0; mcu_unit_is_moving(&board.unit); tick++) {
            one_tick(walk, tick);
            is_on_its_path(cursor);
        }
        assert_int_equal(board.unit.controller.state, CONTROLLER_READY);
    }
}

/* --- a master that composes frames wrong ---------------------------------- */

/* Every byte of a frame with every value, and the frame's checksum made right:
 * no other register, length or piece takes it. */
static void every_value_of_every_byte(void **state)
{
    (void)state;
    board_make_move(&move, BOARD_WINDOW, check_stream());
    board_make_pieces(&pieces, &move, check_stream());
    board_init(&board);
    board_set_up(&board, &move);
    for (unsigned i = 0; i <= BOARD_AXES; i++) {
        uint8_t frame[256], bad[256], answer[256];
        const unsigned length = board_put_write(
            frame, MCU_AT_PIECE, pieces.word[i], pieces.length[i]);
        for (unsigned at = 0; at < length - 2; at++)
            for (unsigned change = 1; change < 256; change++) {
                memcpy(bad, frame, length);
                bad[at] ^= (uint8_t)change;
                if (bad[0] == 0)
                    continue; /* for all units, so for this one too */
                modbus_rtu_seal(bad, bad[0], length - 3);
                keep();
                board_hears(&board, bad, length, answer);
                is_as_before("sealed", change, at);
            }
        assert_true(
            board_send(&board, MCU_AT_PIECE, pieces.word[i], pieces.length[i]));
    }
}

/* Another content under the name of what is there, both checksums right. */
static void another_content_is_no_repetition(void **state)
{
    uint16_t bad[MCU_PIECE_MAX];
    (void)state;

    board_make_move(&move, BOARD_WINDOW, check_stream());
    board_make_pieces(&pieces, &move, check_stream());
    board_init(&board);
    board_set_up(&board, &move);
    for (unsigned i = 0; i < pieces.count; i++)
        assert_int_equal(
            mcu_upload_put(&board.upload, pieces.word[i], pieces.length[i]),
            MCU_PIECE_TAKEN);
    for (unsigned i = 0; i < pieces.count; i++) {
        const unsigned length = pieces.length[i];
        for (unsigned at = MCU_PIECE_HEAD; at < length - 2; at++) {
            memcpy(bad, pieces.word[i], sizeof bad);
            bad[at] ^= 1;
            mcu_words_put(bad + length - 2, mcu_piece_crc(bad, length - 2), 2);
            keep();
            assert_int_equal(mcu_upload_put(&board.upload, bad, length),
                             MCU_PIECE_E_MOVE);
            is_as_before("content", i, at);
        }
        assert_int_equal(mcu_upload_put(&board.upload, pieces.word[i], length),
                         MCU_PIECE_REPEATED);
    }
}

/* --- order ---------------------------------------------------------------- */

/* Pieces 0 .. there - 1 have come: what becomes of piece `next`? */
static enum mcu_piece_result expected(unsigned there, unsigned next)
{
    const uint16_t *piece = pieces.word[next];

    if (next < there)
        return MCU_PIECE_REPEATED;
    if (next < BOARD_AXES)
        return MCU_PIECE_TAKEN;
    if (there <= piece[1])
        return MCU_PIECE_E_MOVE; /* its head is not there */
    for (unsigned i = BOARD_AXES; i < next; i++)
        if (i >= there && pieces.word[i][1] == piece[1])
            return MCU_PIECE_E_ORDER;
    return MCU_PIECE_TAKEN;
}

/* After any beginning of an upload, any piece, and any of another move. */
static void every_order_of_two(void **state)
{
    (void)state;
    board_make_move(&move, BOARD_WINDOW, check_stream());
    board_make_slow(&other, &move);
    board_make_pieces(&pieces, &move, check_stream());
    board_make_pieces(&others, &other, check_stream());
    board_init(&board);
    board_set_up(&board, &move);
    for (unsigned there = 0; there <= pieces.count; there++) {
        for (unsigned next = 0; next < pieces.count; next++) {
            enum mcu_piece_result result;
            keep();
            result = mcu_upload_put(&board.upload, pieces.word[next],
                                    pieces.length[next]);
            if (result != expected(there, next))
                fail_msg("%u there, then %u: %s", there, next,
                         piece_text(result));
            if (result != MCU_PIECE_TAKEN)
                is_as_before("order", there, next);
            board_has_nothing_wrong(&board, &move);
            memcpy(&board, &before, sizeof board);
        }
        for (unsigned next = BOARD_AXES; next < others.count; next++) {
            keep();
            assert_int_equal(mcu_upload_put(&board.upload, others.word[next],
                                            others.length[next]),
                             MCU_PIECE_E_MOVE);
            is_as_before("other", there, next);
        }
        assert_int_equal(mcu_upload_has(&board.upload, move.id),
                         there == pieces.count);
        if (there < pieces.count)
            mcu_upload_put(&board.upload, pieces.word[there],
                           pieces.length[there]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_byte_of_every_frame),
        cmocka_unit_test(every_byte_while_it_streams),
        cmocka_unit_test(every_value_of_every_byte),
        cmocka_unit_test(another_content_is_no_repetition),
        cmocka_unit_test(every_order_of_two),
    };
    seed_from("damaged uploads");
    return cmocka_run_group_tests(tests, NULL, NULL);
}
