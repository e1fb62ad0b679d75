/* hal/drive/slew_mcu/setup.c - a board's axes, and the servos behind them.
 *
 * Steps: 0 the register map, as many pieces as it takes; then of each axis the
 * drive that it has; then each axis; then how long it may hear nothing.  All of
 * it has one number, made of its content, so that a board that has it already
 * says so and keeps what it has. */
#include "hal/drive/slew_mcu/parts.h"

#include "hal/support/crc32.h"

static const struct modbus_map *
setup_map(const struct drive_slew_mcu_board *board)
{
    for (unsigned i = 0; i < board->axis_count; i++)
        if (board->axis[i]->config.servo != NULL)
            return board->axis[i]->config.map;
    return NULL;
}

static unsigned setup_put_drive(struct drive_slew_mcu_board *board, uint32_t id,
                                unsigned i, uint16_t piece[MCU_PIECE_MAX])
{
    const unsigned count =
        mcu_piece_put_drive(piece, id, i, board->axis[i]->config.servo);

    board->drive_crc[i] = mcu_piece_own_crc(piece, count);
    return count;
}

/* By whatever number: their content alone makes it. */
void drive_slew_mcu_setup_begin(struct drive_slew_mcu_board *board)
{
    const struct modbus_map *map = setup_map(board);
    uint32_t crc = map != NULL ? mcu_map_crc(map) : 0;

    for (unsigned i = 0; i < board->axis_count; i++) {
        const struct drive_slew_mcu_config *config = &board->axis[i]->config;
        uint16_t piece[MCU_PIECE_MAX];
        unsigned count;

        board->drive_crc[i] = 0;
        if (config->servo != NULL) {
            count = setup_put_drive(board, 1, i, piece);
            crc = crc32_of(crc, piece, count * sizeof *piece);
        }
        count = mcu_piece_put_setup(piece, 1, i, board->axis_count,
                                    &config->setup, 0);
        crc = crc32_of(crc, piece, count * sizeof *piece);
    }
    board->setup_id = crc | 1;
    board->setup_at = map != NULL ? 0 : 1;
    board->map_from = 0;
}

/* What is not 0 of the map, from map_from on. */
static unsigned setup_put_map(struct drive_slew_mcu_board *board,
                              uint16_t piece[MCU_PIECE_MAX])
{
    const struct modbus_map *map = setup_map(board);

    for (; board->map_from < MCU_MAP_VALUES;
         board->map_from += MCU_PIECE_VALUES) {
        unsigned count;
        const unsigned length = mcu_piece_put_map(piece, board->setup_id,
                                                  board->map_from, map, &count);

        if (count > 0)
            return length;
    }
    return 0;
}

static unsigned setup_put(struct drive_slew_mcu_board *board,
                          uint16_t piece[MCU_PIECE_MAX])
{
    const unsigned axes = board->axis_count;
    unsigned i;

    if (board->setup_at == 0) {
        const unsigned length = setup_put_map(board, piece);
        if (length > 0)
            return length;
        board->setup_at = 1;
    }
    for (; board->setup_at <= axes; board->setup_at++) {
        i = board->setup_at - 1;
        if (board->axis[i]->config.servo != NULL)
            return setup_put_drive(board, board->setup_id, i, piece);
    }
    if (board->setup_at > 2 * axes)
        return 0;
    i = board->setup_at - axes - 1;
    return mcu_piece_put_setup(piece, board->setup_id, i, axes,
                               &board->axis[i]->config.setup,
                               board->drive_crc[i]);
}

bool drive_slew_mcu_setup_request(struct drive_slew_mcu_board *board,
                                  struct hal_modbus_request *request)
{
    uint16_t piece[MCU_PIECE_MAX];
    const unsigned length = setup_put(board, piece);

    if (length > 0)
        drive_slew_mcu_write(request, MCU_AT_PIECE, piece, length);
    return length > 0;
}

void drive_slew_mcu_setup_done(struct drive_slew_mcu_board *board)
{
    if (board->setup_at == 0)
        board->map_from += MCU_PIECE_VALUES;
    else
        board->setup_at++;
}
