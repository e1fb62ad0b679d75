/* hal/mcu/registers.h - what a board that runs slew's controller has in which
 * Modbus register: for the board (firmware/mcu/registers.h) and for a PC that
 * moves it (hal/drive/slew_mcu).  docs/MCU.md is the map.
 *
 * A value of more than a register begins with its lowest one. */
#ifndef HAL_MCU_REGISTERS_H
#define HAL_MCU_REGISTERS_H

#include <stdint.h>

#define MCU_AXES_MAX 6 /* of a board */

#define MCU_MAP_MAGIC   0x534C /* "SL" */
#define MCU_MAP_VERSION 5

/* Where they begin. */
#define MCU_AT_IDENTITY  0x0000
#define MCU_AT_STATE     0x0010
#define MCU_AT_AXIS      0x0100 /* of axis 0; each MCU_AXIS_STEP on */
#define MCU_AXIS_STEP    0x0020
#define MCU_AT_COMMAND   0x0200
#define MCU_AT_LOG_INDEX 0x0300
#define MCU_AT_LOG       0x0310
#define MCU_AT_WHY       0x0400 /* of axis 0; each MCU_AXIS_STEP on */
#define MCU_AT_PIECE     0x1000

#define MCU_IDENTITY_WORDS     9
#define MCU_STATE_WORDS        52
#define MCU_AXIS_WORDS         18
#define MCU_WHY_WORDS          32 /* two characters each, the first one upper */
#define MCU_COMMAND_WORDS      4
#define MCU_COMMAND_AT         6  /* with the tick in which it is to be done */
#define MCU_COMMAND_RAMP_WORDS 12 /* and with the ramp */
#define MCU_COMMAND_AHEAD      60000  /* ticks, at most */
#define MCU_WATCH_MAX          60000  /* ms */
#define MCU_CLOCK_MAX          500000 /* 1e-9 */

/* Offsets into the state and into an axis. */
enum mcu_state_word {
    MCU_STATE_STATE = 0,  /* enum controller_state */
    MCU_STATE_FAULT,      /* enum controller_fault */
    MCU_STATE_FAULT_AXIS, /* 0xFFFF: none in particular */
    MCU_STATE_DRIVE_CODE,
    MCU_STATE_TICKS,           /* 2 */
    MCU_STATE_LOST = 6,        /* 2 */
    MCU_STATE_PATH_NS = 8,     /* 4 */
    MCU_STATE_RATE_Q30 = 12,   /* 2 */
    MCU_STATE_SEQUENCE = 14,   /* of the last command */
    MCU_STATE_RESULT,          /* what it said: enum mcu_command_result */
    MCU_STATE_MOVE_ID,         /* 2 */
    MCU_STATE_AXES = 18,       /* how many */
    MCU_STATE_HEADS,           /* bit per axis: its head is there */
    MCU_STATE_PIECE,           /* enum mcu_piece_result of the last one */
    MCU_STATE_TAKEN,           /* 2 */
    MCU_STATE_REFUSED = 23,    /* 2 */
    MCU_STATE_VALUE = 25,      /* 4: of the fault */
    MCU_STATE_LIMIT = 29,      /* 4 */
    MCU_STATE_LOG_FIRST = 33,  /* 2: entries there are */
    MCU_STATE_LOG_NEXT = 35,   /* 2 */
    MCU_STATE_STACK = 37,      /* words never used */
    MCU_STATE_READY,           /* 1: the move may be started */
    MCU_STATE_SETUP_AXES,      /* bit per axis: its set-up has come */
    MCU_STATE_LOG_CRC,         /* 2: of all entries since the start */
    MCU_STATE_DRIVE_AXES = 42, /* bit per axis: its drive has come */
    MCU_STATE_TIME,         /* 4: ns since power came; tick n is at n periods */
    MCU_STATE_WAITING = 47, /* number of the command that waits; 0: none */
    MCU_STATE_BEGAN,        /* 2: tick in which the last move began */
    MCU_STATE_WATCH = 50,   /* ms of silence that end operation; 0: none do */
    MCU_STATE_SILENT,       /* 1: they did */
};
enum mcu_axis_word {
    MCU_AXIS_ACTUAL = 0,   /* 4 */
    MCU_AXIS_TARGET = 4,   /* 4 */
    MCU_AXIS_DRIVE = 8,    /* enum hal_drive_state */
    MCU_AXIS_SEGMENTS = 9, /* 2: of the move */
    MCU_AXIS_FIRST = 11,   /* 2: kept */
    MCU_AXIS_NEXT = 13,    /* 2: to be sent next */
    MCU_AXIS_FREE = 15,    /* 2: room for so many */
    MCU_AXIS_DRIVEN = 17,  /* 1: a servo on the board's line; 0: virtual */
};

/* X(name, value): commands. */
#define MCU_COMMAND_LIST(X)                                                    \
    X(MCU_COMMAND_ENABLE, 1)                                                   \
    X(MCU_COMMAND_START, 2) /* value: move_id */                               \
    X(MCU_COMMAND_HOLD, 3)                                                     \
    X(MCU_COMMAND_RESUME, 4)                                                   \
    X(MCU_COMMAND_STOP, 5)                                                     \
    X(MCU_COMMAND_OFF, 6)                                                      \
    X(MCU_COMMAND_RESET, 7)                                                    \
    X(MCU_COMMAND_OVERRIDE, 8) /* value: rate_q30 */                           \
    X(MCU_COMMAND_WATCH, 9)    /* value: ms, 0 .. MCU_WATCH_MAX */             \
    X(MCU_COMMAND_CLOCK, 10)   /* value: faster by so many 1e-9, signed */     \
    X(MCU_COMMAND_RAMP, 11)    /* value: rate_q30; enum mcu_ramp_word */
enum mcu_command {
#define MCU_COMMAND_ENUM(name, value) name = (value),
    MCU_COMMAND_LIST(MCU_COMMAND_ENUM)
#undef MCU_COMMAND_ENUM
};

/* Of a ramp, in the command. */
enum mcu_ramp_word {
    MCU_RAMP_TICK = 6,   /* 2: ns, of which these are */
    MCU_RAMP_CHANGE = 8, /* 2: r' to its peak, and as many back */
    MCU_RAMP_FLAT = 10,  /* 2: at it */
};

/* X(name, value, error of motion/core/err.h): what a command said. */
#define MCU_RESULT_LIST(X)                                                     \
    X(MCU_RESULT_DONE, 0, MOTION_OK)                                           \
    X(MCU_RESULT_STATE, 1, MOTION_E_STATE)                                     \
    X(MCU_RESULT_ARG, 2, MOTION_E_ARG)                                         \
    X(MCU_RESULT_NOT_THERE, 3, MOTION_E_AGAIN)                                 \
    X(MCU_RESULT_AWAY, 4, MOTION_E_AWAY)                                       \
    X(MCU_RESULT_LIMIT, 5, MOTION_E_LIMIT)                                     \
    X(MCU_RESULT_UNHOMED, 6, MOTION_E_UNHOMED)                                 \
    X(MCU_RESULT_LATE, 7, MOTION_E_TIMEOUT)                                    \
    X(MCU_RESULT_WAITS, 8, 1)
enum mcu_result {
#define MCU_RESULT_ENUM(name, value, err) name = (value),
    MCU_RESULT_LIST(MCU_RESULT_ENUM)
#undef MCU_RESULT_ENUM
};

#endif
