/* firmware/mcu/upload.h - axes and moves in pieces of registers.
 *
 * A piece is one write of registers (docs/MCU.md has every one): what it is, of
 * which axis, of which move, its number, its content and a CRC-32 over all of
 * that.  It is taken as a whole or not at all; one that is there already is
 * good and changes nothing; one that is not the next is refused.  So it does
 * not matter where an upload was cut, repeated or put out of order: the move
 * is what was sent, or it is not whole and does not start. */
#ifndef FIRMWARE_MCU_UPLOAD_H
#define FIRMWARE_MCU_UPLOAD_H

#include "firmware/mcu/unit.h"

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
/* Never NULL. */
const char *mcu_piece_text(enum mcu_piece_result result);

struct mcu_upload {
    struct mcu_unit *unit;
    uint32_t setup_id, move_id; /* of what is there, or comes; 0: none */
    uint32_t setup_crc[MCU_AXES_MAX], head_crc[MCU_AXES_MAX];
    uint16_t setup_axes, head_axes; /* bit per axis: it has come */
    unsigned setup_count;
    uint32_t drives_id;  /* set-up that map and drives belong to; 0: none */
    uint16_t drive_axes; /* bit per axis: its drive has come */
    uint16_t driven;     /* of setup: on the line */
    struct mcu_setup setup[MCU_AXES_MAX];
    enum mcu_piece_result last;
    uint32_t taken, refused;
};

void mcu_upload_init(struct mcu_upload *upload, struct mcu_unit *unit);

/* One piece, `count` registers of any content.  Divides; not on the tick. */
enum mcu_piece_result mcu_upload_put(struct mcu_upload *upload,
                                     const uint16_t piece[], unsigned count);

/* Is everything there that is needed to start this move? */
bool mcu_upload_has(const struct mcu_upload *upload, uint32_t move_id);

#endif
