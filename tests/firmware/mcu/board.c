/* tests/firmware/mcu/board.c - see board.h. */
#include "tests/firmware/mcu/board.h"
#include "tests/support/rtu_frame.h"

#include <string.h>

#define MS_Q12 (INT64_C(1000000) << 12)
#define GAP_NS 10000000

/* --- moves at random ------------------------------------------------------ */

uint32_t board_below(uint64_t *seed, uint32_t end)
{
    return (uint32_t)(((check_random(seed) >> 32) * end) >> 32);
}

static void board_make_axis(struct board_move *move, unsigned axis,
                            uint32_t count, uint64_t *seed)
{
    struct motion_track *track = &move->track[axis];
    struct mcu_head *head = &move->head[axis];
    struct motion_state from = { .pos_q32 = (int64_t)board_below(seed, 100) *
                                            BOARD_ONE };

    motion_track_init(track, move->segment[axis], BOARD_SEGMENTS, from.pos_q32);
    for (uint32_t i = 0; i < count; i++) {
        struct motion_state to = { .pos_q32 =
                                       track->end.pos_q32 +
                                       (int64_t)board_below(seed, UINT32_MAX) -
                                       BOARD_ONE / 2 };
        to.vel_q32 = i + 1 == count ? 0
                                    : (int64_t)board_below(seed, UINT32_MAX) -
                                          BOARD_ONE / 2;
        assert_int_equal(
            motion_track_append_quintic(
                track, (1 + board_below(seed, 200)) * MS_Q12, &from, &to),
            MOTION_OK);
        from = to;
    }
    mcu_head_of(track, head);
}

void board_make_move(struct board_move *move, uint32_t most, uint64_t *seed)
{
    for (unsigned i = 0; i < BOARD_AXES; i++)
        board_make_axis(move, i, 1 + board_below(seed, most), seed);
    move->id = board_below(seed, UINT32_MAX) | 1;
}

void board_make_slow(struct board_move *slow, const struct board_move *of)
{
    *slow = *of;
    slow->id ^= 2;
    for (unsigned i = 0; i < BOARD_AXES; i++)
        for (uint32_t k = 0; k < of->track[i].count; k++)
            slow->segment[i][k].dur_ns_q12 *= 2;
}

/* --- a board on a line ---------------------------------------------------- */

static struct motion_segment board_ring[MCU_AXES_MAX * 2 * BOARD_WINDOW];
static int64_t log_words[4096];
const struct mcu_unit_config board_config = {
    .period_ns = 1000000,
    .ring = board_ring,
    .window = BOARD_WINDOW,
    .log = log_words,
    .log_words = 4096,
};

void board_init(struct board *board)
{
    const struct modbus_rtu_line line = { .baud = 115200,
                                          .parity = MODBUS_PARITY_NONE,
                                          .stop_bits = 1 };

    memset(board, 0, sizeof *board);
    mcu_unit_init(&board->unit, &board_config);
    mcu_upload_init(&board->upload, &board->unit);
    mcu_registers_init(&board->registers, &board->unit, &board->upload);
    assert_int_equal(modbus_rtu_slave_init(
                         &board->slave, &board->registers.slave, 1, &line, 0),
                     MOTION_OK);
}

unsigned board_hears(struct board *board, const uint8_t *bytes, unsigned length,
                     uint8_t answer[256])
{
    struct modbus_station *station = &board->slave.station;
    unsigned answered;

    if (length > 0)
        station->ops->recv(station, bytes, length, board->now_ns);
    board->now_ns += GAP_NS;
    answered = station->ops->poll(station, board->now_ns, answer);
    if (answered > 0)
        station->ops->sent(station, board->now_ns);
    return answered > 0 ? answer[1] : 0;
}

unsigned board_put_write(uint8_t frame[256], uint16_t address,
                         const uint16_t *value, unsigned count)
{
    struct hal_modbus_request request = { .unit = 1,
                                          .function = HAL_MODBUS_WRITE_MANY,
                                          .address = address,
                                          .count = (uint16_t)count };

    memcpy(request.value, value, count * sizeof *value);
    return (unsigned)rtu_frame_put_request(&request, frame);
}

bool board_send(struct board *board, uint16_t address, const uint16_t *value,
                unsigned count)
{
    uint8_t frame[256], answer[256];
    const unsigned length = board_put_write(frame, address, value, count);

    return board_hears(board, frame, length, answer) == HAL_MODBUS_WRITE_MANY;
}

bool board_command(struct board *board, enum mcu_command what, uint32_t value)
{
    uint16_t word[4] = { (uint16_t)(board->registers.sequence + 1),
                         (uint16_t)what };

    mcu_words_put(word + 2, value, 2);
    return board_send(board, MCU_AT_COMMAND, word, 4);
}

void board_ticks(struct board *board, unsigned ticks)
{
    while (ticks-- > 0) {
        board->tick_ns += board_config.period_ns;
        mcu_unit_tick(&board->unit, board->tick_ns);
    }
}

void board_run(struct board *board, unsigned ticks)
{
    while (ticks-- > 0) {
        board_ticks(board, 1);
        mcu_registers_poll(&board->registers);
    }
}

uint16_t board_state(struct board *board, unsigned offset)
{
    struct modbus_slave *slave = &board->registers.slave;
    uint16_t word[MCU_STATE_WORDS];

    assert_int_equal(slave->ops->get(slave, MODBUS_HOLDING, MCU_AT_STATE,
                                     MCU_STATE_WORDS, word),
                     0);
    return word[offset];
}

unsigned board_put_setup(uint16_t piece[MCU_PIECE_MAX],
                         const struct board_move *move, unsigned axis)
{
    const struct mcu_setup setup = {
        .pos_min_q32 = -1000 * BOARD_ONE,
        .pos_max_q32 = 1000 * BOARD_ONE,
        .vel_q32 = 100000 * BOARD_ONE,
        .acc_q32 = 100000000 * BOARD_ONE,
        .stop_vel_q32 = 100000 * BOARD_ONE,
        .stop_acc_q32 = 100000000 * BOARD_ONE,
        .following_floor_q32 = BOARD_ONE,
        .pos_q32 = move->segment[axis][0].pos_q32,
    };

    return mcu_piece_put_setup(piece, move->id, axis, BOARD_AXES, &setup, 0);
}

void board_set_up(struct board *board, const struct board_move *move)
{
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        uint16_t piece[MCU_PIECE_MAX];
        const unsigned count = board_put_setup(piece, move, i);
        assert_true(board_send(board, MCU_AT_PIECE, piece, count));
    }
}

/* --- its pieces ----------------------------------------------------------- */

void board_make_pieces(struct board_pieces *pieces,
                       const struct board_move *move, uint64_t *seed)
{
    pieces->count = 0;
    for (unsigned i = 0; i < BOARD_AXES; i++, pieces->count++)
        pieces->length[pieces->count] = mcu_piece_put_head(
            pieces->word[pieces->count], move->id, i, &move->head[i]);
    for (unsigned i = 0; i < BOARD_AXES; i++)
        for (uint32_t at = 0; at < move->track[i].count;) {
            const uint32_t left = move->track[i].count - at;
            unsigned count = 1 + board_below(seed, MCU_PIECE_SEGMENTS);
            count = count < left ? count : left;
            pieces->length[pieces->count] =
                mcu_piece_put_track(pieces->word[pieces->count], move->id, i,
                                    at, &move->segment[i][at], count);
            pieces->count++;
            at += count;
        }
}

void board_has_nothing_wrong(const struct board *board,
                             const struct board_move *move)
{
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        const struct mcu_window *window = &board->unit.window[i];
        if (board->upload.move_id != move->id)
            assert_int_equal(window->filled, 0);
        for (uint32_t k = window->first; k < window->filled; k++)
            for (unsigned copy = 0; copy < 2; copy++)
                assert_memory_equal(
                    &window->ring[k % BOARD_WINDOW + copy * BOARD_WINDOW],
                    &move->segment[i][k], sizeof move->segment[i][k]);
    }
}
