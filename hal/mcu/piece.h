/* hal/mcu/piece.h - axes and moves for a board in pieces of registers: written
 * by who sends, read by the board (firmware/mcu/upload.h).
 *
 * A piece is one write of registers (docs/MCU.md has every one): what it is, of
 * which axis, of which move, its number, its content and a CRC-32 over all of
 * that.  A value of more than a register begins with its lowest one. */
#ifndef HAL_MCU_PIECE_H
#define HAL_MCU_PIECE_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/drive/modbus/drive.h"
#include "hal/mcu/registers.h"
#include "motion/core/track.h"

#define MCU_PIECE_MAX      123 /* registers */
#define MCU_PIECE_HEAD     6   /* kind and axis, move, number, before content */
#define MCU_PIECE_AROUND   8   /* and the CRC-32 after it */
#define MCU_PIECE_SEGMENTS 3   /* most in a piece */

enum mcu_piece_kind {
    MCU_PIECE_SETUP = 1, /* an axis; number: how many axes there are */
    MCU_PIECE_HEAD_OF,   /* struct mcu_head of an axis; number 0 */
    MCU_PIECE_TRACK,     /* segments; number: of the first */
    MCU_PIECE_MAP,       /* values of the register map; number: of the first */
    MCU_PIECE_DRIVE,     /* the drive of an axis; number 0 */
};

/* Registers of the content. */
#define MCU_PIECE_SETUP_WORDS   48
#define MCU_PIECE_VALUES        28 /* of four registers; a map, a drive */
#define MCU_PIECE_TRACK_WORDS   35 /* of a segment */
#define MCU_PIECE_HEAD_OF_WORDS 92

/* X(name, value, Modbus exception, sentence): what became of a piece. */
#define MCU_PIECE_LIST(X)                                                      \
    X(MCU_PIECE_TAKEN, 0, 0, "taken")                                          \
    X(MCU_PIECE_REPEATED, 1, 0, "was there already")                           \
    X(MCU_PIECE_E_LENGTH, 2, 3, "no such piece has this length")               \
    X(MCU_PIECE_E_CHECKSUM, 3, 3, "its checksum is wrong")                     \
    X(MCU_PIECE_E_KIND, 4, 3, "there is no such kind")                         \
    X(MCU_PIECE_E_AXIS, 5, 3, "there is no such axis")                         \
    X(MCU_PIECE_E_MOVE, 6, 3, "belongs to another move")                       \
    X(MCU_PIECE_E_ORDER, 7, 3, "is not the next one")                          \
    X(MCU_PIECE_E_VALUE, 8, 3, "no plan has such numbers")                     \
    X(MCU_PIECE_E_GAP, 9, 3, "does not fit to the one before, or to the end")  \
    X(MCU_PIECE_E_LIMIT, 10, 3, "is beyond what the head of its axis says")    \
    X(MCU_PIECE_E_FULL, 11, 6, "there is no room for it yet")                  \
    X(MCU_PIECE_E_STATE, 12, 4, "not in this state")

enum mcu_piece_result {
#define MCU_PIECE_ENUM(name, value, exception, text) name = (value),
    MCU_PIECE_LIST(MCU_PIECE_ENUM)
#undef MCU_PIECE_ENUM
};
uint8_t mcu_piece_exception(enum mcu_piece_result result);

/* An axis, in its unit; limits of jerk: 0 none. */
struct mcu_setup {
    int64_t pos_min_q32, pos_max_q32;
    int64_t vel_q32, acc_q32, jerk_q32;
    int64_t stop_vel_q32, stop_acc_q32, stop_jerk_q32; /* after a fault */
    int64_t following_floor_q32, following_k_ns;
    int64_t pos_q32; /* where a virtual drive stands */
};

/* Of the track of an axis; 0 segments: it stands where it is. */
struct mcu_head {
    int64_t end_ns_q12;
    struct motion_state end;
    uint64_t end_frac;
    struct motion_track_outline outline; /* count: segments */
};

#define MCU_SERVO_PARAMETERS 8

/* A servo on the board's own line. */
struct mcu_servo {
    struct drive_modbus_config config; /* map and parameter: set by the board */
    struct drive_modbus_parameter parameter[MCU_SERVO_PARAMETERS];
    unsigned depth;              /* of struct modbus_bus */
    int64_t feedback_max_age_ns; /* struct controller_axis_config */
    uint32_t map_crc;            /* mcu_map_crc of the map it is meant for */
    uint32_t crc;                /* of the piece it came in */
};

/* The head of a track; looks at every segment, plan-time.  Of a window: of the
 * whole that its outline is about. */
void mcu_head_of(const struct motion_track *track, struct mcu_head *head);

/* Into registers: returns the one after. */
uint16_t *mcu_words_put(uint16_t *to, uint64_t value, unsigned words);
uint64_t mcu_words_get(const uint16_t *from, unsigned words);

/* CRC-32 of registers, each its upper byte first. */
uint32_t mcu_piece_crc(const uint16_t piece[], unsigned count);

/* Each returns the registers of the piece.  drive_crc: mcu_piece_own_crc of the
 * piece with the axis's drive; 0: a virtual one. */
unsigned mcu_piece_put_setup(uint16_t piece[MCU_PIECE_MAX], uint32_t setup_id,
                             unsigned axis, unsigned axis_count,
                             const struct mcu_setup *setup, uint32_t drive_crc);
/* Values `from` and the next ones of a register map (map.h), without those at
 * its end that are 0: a map that begins has nothing but 0.  *count: how many
 * are there, then; 0: nothing to send. */
unsigned mcu_piece_put_map(uint16_t piece[MCU_PIECE_MAX], uint32_t setup_id,
                           unsigned from, const struct modbus_map *map,
                           unsigned *count);
unsigned mcu_piece_put_drive(uint16_t piece[MCU_PIECE_MAX], uint32_t setup_id,
                             unsigned axis, const struct mcu_servo *servo);
/* The checksum at the end of a piece. */
uint32_t mcu_piece_own_crc(const uint16_t piece[], unsigned count);
unsigned mcu_piece_put_head(uint16_t piece[MCU_PIECE_MAX], uint32_t move_id,
                            unsigned axis, const struct mcu_head *head);
/* count 1 .. MCU_PIECE_SEGMENTS; the first one is segment `number`. */
unsigned mcu_piece_put_track(uint16_t piece[MCU_PIECE_MAX], uint32_t move_id,
                             unsigned axis, uint32_t number,
                             const struct motion_segment segment[],
                             unsigned count);

/* The content, from its first register.  Returns drive_crc. */
uint32_t mcu_piece_get_setup(const uint16_t *content, struct mcu_setup *setup);
/* Of a register map: value i of the content. */
int64_t mcu_piece_get_value(const uint16_t *content, unsigned i);
/* false: not so many, or beyond what they can be. */
bool mcu_piece_get_drive(const uint16_t *content, unsigned words,
                         struct mcu_servo *servo);
void mcu_piece_get_head(const uint16_t *content, struct mcu_head *head);
void mcu_piece_get_segment(const uint16_t *content,
                           struct motion_segment *segment);

#endif
