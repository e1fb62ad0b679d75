/* tests/firmware/mcu/board.h - a board on a line of a test, moves at random, and
 * their pieces. */
#ifndef TESTS_FIRMWARE_MCU_BOARD_H
#define TESTS_FIRMWARE_MCU_BOARD_H

#include "firmware/mcu/registers.h"
#include "hal/mcu/piece.h"
#include "hal/modbus/rtu_slave.h"
#include "tests/support/check.h"

#define BOARD_ONE      ((int64_t)1 << 32)
#define BOARD_AXES     3
#define BOARD_SEGMENTS 60
#define BOARD_WINDOW   16
#define BOARD_PIECES   128

struct board_move {
    struct motion_segment segment[BOARD_AXES][BOARD_SEGMENTS];
    struct motion_track track[BOARD_AXES];
    struct mcu_head head[BOARD_AXES];
    uint32_t id;
};

struct board {
    struct mcu_unit unit;
    struct mcu_upload upload;
    struct mcu_registers registers;
    struct modbus_rtu_slave slave;
    int64_t now_ns, tick_ns;
};

struct board_pieces {
    uint16_t word[BOARD_PIECES][MCU_PIECE_MAX];
    unsigned length[BOARD_PIECES], count;
};

extern const struct mcu_unit_config board_config;

/* 0 up to, not including, end. */
uint32_t board_below(uint64_t *seed, uint32_t end);

/* 1 .. most segments per axis. */
void board_make_move(struct board_move *move, uint32_t most, uint64_t *seed);
/* The same places at half the speed: nothing but its number tells its pieces
 * from those of the move. */
void board_make_slow(struct board_move *slow, const struct board_move *of);
/* Heads, then the segments of each axis. */
void board_make_pieces(struct board_pieces *pieces,
                       const struct board_move *move, uint64_t *seed);

void board_init(struct board *board);
/* Bytes as they come, then silence.  The answer's function, 0: none. */
unsigned board_hears(struct board *board, const uint8_t *bytes, unsigned length,
                     uint8_t answer[256]);
/* Bytes of the frame that writes these registers. */
unsigned board_put_write(uint8_t frame[256], uint16_t address,
                         const uint16_t *value, unsigned count);
/* true: taken, or there already. */
bool board_send(struct board *board, uint16_t address, const uint16_t *value,
                unsigned count);
bool board_command(struct board *board, enum mcu_command what, uint32_t value);
void board_ticks(struct board *board, unsigned ticks);
/* As the main loop: what waits is looked at after every tick. */
void board_run(struct board *board, unsigned ticks);
/* Register `offset` of its state, as it is read on the line. */
uint16_t board_state(struct board *board, unsigned offset);
/* The piece that sets up this axis of the move. */
unsigned board_put_setup(uint16_t piece[MCU_PIECE_MAX],
                         const struct board_move *move, unsigned axis);
void board_set_up(struct board *board, const struct board_move *move);
/* What the board has of the move is the move, as far as it goes. */
void board_has_nothing_wrong(const struct board *board,
                             const struct board_move *move);

#endif
