/* hal/drive/slew_mcu/parts.h - what the files of the drive share: drive.c (what
 * the controller asks), board.c (phases, and what goes over the line), setup.c
 * (set-up piece by piece) and tracks.c (the move). */
#ifndef HAL_DRIVE_SLEW_MCU_PARTS_H
#define HAL_DRIVE_SLEW_MCU_PARTS_H

#include "hal/drive/slew_mcu/drive.h"

/* Of firmware/control/controller.h, which a board tells by number. */
enum board_state {
    BOARD_OFF,
    BOARD_READY,
    BOARD_MOVING,
    BOARD_HOLDING,
    BOARD_STOPPING,
    BOARD_FAULT,
};

static inline enum board_state
drive_slew_mcu_state(const struct drive_slew_mcu_board *board)
{
    return (enum board_state)board->state[MCU_STATE_STATE];
}

static inline bool
drive_slew_mcu_moves(const struct drive_slew_mcu_board *board)
{
    const enum board_state state = drive_slew_mcu_state(board);
    return state == BOARD_MOVING || state == BOARD_HOLDING ||
           state == BOARD_STOPPING;
}

/* board.c.  Find: look for it anew.  Fail: this board is in fault by what we know of it; the words
 * follow each other. */
void drive_slew_mcu_board_init(struct drive_slew_mcu_board *board,
                               uint8_t unit);
void drive_slew_mcu_find(struct drive_slew_mcu_board *board);
void drive_slew_mcu_fail(struct drive_slew_mcu_board *board, const char *what,
                         const char *why);
/* What its clock shows at our t_ns; 0: not known. */
int64_t drive_slew_mcu_time_ns(const struct drive_slew_mcu_board *board,
                               int64_t t_ns);
/* The same as a difference: our time less its own. */
int64_t drive_slew_mcu_apart_ns(const struct drive_slew_mcu_board *board);
void drive_slew_mcu_write(struct hal_modbus_request *request, uint16_t address,
                          const uint16_t *value, unsigned count);

/* setup.c.  Begin: from the first step on.  Request: the next piece or command;
 * false: there is none any more.  Done: it was taken. */
void drive_slew_mcu_setup_begin(struct drive_slew_mcu_board *board);
bool drive_slew_mcu_setup_request(struct drive_slew_mcu_board *board,
                                  struct hal_modbus_request *request);
void drive_slew_mcu_setup_done(struct drive_slew_mcu_board *board);

/* tracks.c.  Stop: it is to come to rest, before anything else.  Is ours: what it plays,
 * or is to begin, is by our clock.  Request: the next piece; false: nothing to send.
 * Reply: what became of it. */
extern const struct hal_drive_tracks drive_slew_mcu_tracks;
void drive_slew_mcu_stop(struct drive_slew_mcu_board *board);
bool drive_slew_mcu_is_ours(const struct drive_slew_mcu_board *board);
bool drive_slew_mcu_piece_request(struct drive_slew_mcu_board *board,
                                  struct hal_modbus_request *request,
                                  uint16_t *cookie);
void drive_slew_mcu_piece_reply(struct drive_slew_mcu_board *board,
                                uint16_t cookie,
                                const struct hal_modbus_reply *reply);
/* The command that the move needs now: false, none. */
bool drive_slew_mcu_move_command(struct drive_slew_mcu_board *board,
                                 struct drive_slew_mcu_command *command);
/* After a new state of the board. */
void drive_slew_mcu_move_look(struct drive_slew_mcu_board *board);
void drive_slew_mcu_move_forget(struct drive_slew_mcu_board *board);

#endif
