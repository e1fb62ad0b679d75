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
#include "hal/mcu/piece.h"

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
