/* hal/drive/slew_mcu/drive.h - a board that runs slew's controller
 * (firmware/mcu), as one or more axes of a rig on a PC.
 *
 *   FIND   who is there (once a second); what it still does is stopped, and it
 *          is made off
 *   SETUP  the register map of its servos, their drives, its axes, how long
 *          it may hear nothing: piece by piece
 *   RUN    walks to what is requested; its state and its axes in turn, and
 *          between two of these a piece of the move, as long as there is room
 *   LOST   no answer three times in a row, another board, one that was reset:
 *          a request for RESET looks for it anew
 *
 * A board has one controller, so what is requested of one of its axes is
 * requested of all.
 *
 * Tracks.  load() takes the tracks of all its axes; they go over the line as
 * heads and segments, and are checked there.  start() says when: the board is
 * sent the tick of its own clock that is nearest to that time, and either begins
 * in it or not at all.  From there on it samples the tracks by itself; the line
 * only carries what its window has room for, and what it says.
 *
 * Clocks.  An answer with the board's time cannot have come before that time, so
 * the least of (our time of the answer - the board's time) over the last
 * DRIVE_SLEW_MCU_CLOCKS is how far they are apart, give or take what an answer
 * takes at the least.
 *
 * While a move is played its ticks are made faster or slower (MCU_COMMAND_CLOCK),
 * so that they stay as far apart as they were at the start: by 1 / 8 s of what has
 * been added since, on top of what was needed in the move before.  An oscillator
 * that is off by 50 ppm is 0.4 ms off then, and not more with time.
 *
 * Where its axes should be by our clock is what set_target says; from a start to a stop,
 * a fault or the end of the move feedback tells which of these set points was due when
 * the position was measured, so that the controller's following error is also how far
 * the board is off our clock.  Else it tells the board's own set point.
 *
 * A stop takes the place of a command that has not been answered: it is what is asked
 * next, whatever the board has said last, and it stops until the board has said after
 * that that it stands, and where.
 *
 * The board stops by itself when it hears nothing for watch_ms. */
#ifndef HAL_DRIVE_SLEW_MCU_DRIVE_H
#define HAL_DRIVE_SLEW_MCU_DRIVE_H

#include "hal/drive.h"
#include "hal/mcu/map.h"
#include "hal/mcu/piece.h"
#include "hal/modbus/bus.h"

MOTION_C_BEGIN

#define DRIVE_SLEW_MCU_CLOCKS  32
#define DRIVE_SLEW_MCU_HISTORY 512 /* set points kept; a power of 2 */

struct drive_slew_mcu_config {
    uint8_t unit;  /* of the board on its line */
    unsigned axis; /* of the board, 0 .. MCU_AXES_MAX - 1 */
    struct mcu_setup setup;
    const struct mcu_servo *servo; /* outlives the drive; NULL: virtual */
    const struct modbus_map *map;  /* of its servos: one for all; the same */
    uint32_t watch_ms;             /* 1 .. MCU_WATCH_MAX */
    int64_t lead_ns;               /* from a start until it is told, at most */
    /* "the axis does not follow ..." by the number of the board's fault */
    const char *const *fault_text;
    unsigned fault_count; /* of them; 0: numbers */
};

enum drive_slew_mcu_phase {
    DRIVE_SLEW_MCU_FIND,
    DRIVE_SLEW_MCU_SETUP,
    DRIVE_SLEW_MCU_RUN,
    DRIVE_SLEW_MCU_LOST,
};

/* A command that is sent until it is answered. */
struct drive_slew_mcu_command {
    uint16_t command, sequence; /* sequence 0: none */
    uint32_t value, at;
    bool has_at;
    const struct hal_drive_ramp *ramp; /* NULL: none */
};

/* A change of the rate: told, and taken by the board as what will be. */
enum drive_slew_mcu_ramp {
    DRIVE_SLEW_MCU_NO_RAMP,
    DRIVE_SLEW_MCU_RAMP_ASKED,
    DRIVE_SLEW_MCU_RAMP_TOLD,
    DRIVE_SLEW_MCU_RAMP_REFUSED, /* told too late */
    DRIVE_SLEW_MCU_RAMP_DONE,
};

struct drive_slew_mcu_past {
    int64_t t_ns, pos_q32;
};

struct drive_slew_mcu;

/* Of all drives of a board. */
struct drive_slew_mcu_board {
    struct modbus_node node;
    struct drive_slew_mcu *axis[MCU_AXES_MAX];
    unsigned axis_count;
    enum drive_slew_mcu_phase phase;
    int64_t now_ns, retry_ns;
    bool is_asked; /* one request at a time */
    unsigned failures;
    uint32_t steps;
    bool enables, resets;         /* asked for, and not told yet */
    bool is_enabling;             /* told, and not there yet */
    bool is_off;                  /* is to be off, and stay so */
    bool is_quick;                /* its stop is a quick one */
    char why[64];                 /* of LOST and of a fault */
    bool is_fault;                /* ours: refused, not begun in time */
    struct hal_drive_found found; /* how fast is not known: it stops itself */

    /* what it says */
    int64_t period_ns;
    bool is_known; /* who it is */
    uint16_t state[MCU_STATE_WORDS];
    int64_t state_ns; /* when; 0: not since FIND */
    bool is_new;      /* no command has been sent since */
    int64_t ready_ns; /* READY since then; 0: it is not */
    int64_t apart_ns[DRIVE_SLEW_MCU_CLOCKS];
    unsigned clocks;             /* ever */
    int64_t start_apart_ns;      /* at the start of the move */
    int32_t start_ppb, told_ppb; /* so much faster: then, and now */
    int64_t clock_due_ns;        /* it is not told before */

    /* set-up */
    uint32_t setup_id;
    unsigned setup_at; /* next step */
    unsigned map_from;
    uint32_t drive_crc[MCU_AXES_MAX];

    /* the line */
    unsigned turn; /* 0: state, 1 ..: axes */
    bool is_piece; /* one is due before the next turn */
    struct drive_slew_mcu_command command;
    uint16_t sequence;

    /* the move */
    uint32_t move_id;
    enum hal_drive_track track;
    bool is_fresh; /* loaded since the last tick: others are of the same move */
    unsigned heads; /* sent */
    int64_t rate_q30, told_q30, start_ns;
    uint32_t start_at; /* tick */
    enum drive_slew_mcu_ramp ramp_state;
    struct hal_drive_ramp ramp;
    uint32_t anchor_at, ramp_at; /* ticks: in step with us; it begins */
    bool is_told;
    bool stops;         /* is to stop, or on its way to rest */
    bool is_stop_asked; /* since then, the board */
};

struct drive_slew_mcu {
    struct hal_drive drive;
    struct drive_slew_mcu_config config;
    struct drive_slew_mcu_board *board;
    struct drive_slew_mcu_board own; /* of the board's first axis */
    const struct motion_track *track;
    struct mcu_head head;
    uint32_t sent; /* segments */
    uint32_t room; /* for so many more, by what it said last */
    /* what it says, and when */
    uint16_t word[MCU_AXIS_WORDS];
    int64_t word_ns, vel_q32;
    bool is_up; /* ENABLED, since it was enabled */
    struct drive_slew_mcu_past past[DRIVE_SLEW_MCU_HISTORY];
    unsigned past_count; /* ever */
};

/* `first`: a drive of the same board, NULL where this is its first.  The node
 * is added to the bus with the first.  MOTION_E_ARG: an axis that is taken or
 * out of range, another map, values out of range; modbus_bus_add's errors. */
int drive_slew_mcu_init(struct drive_slew_mcu *self, struct modbus_bus *bus,
                        struct drive_slew_mcu *first,
                        const struct drive_slew_mcu_config *config);

MOTION_C_END

#endif
