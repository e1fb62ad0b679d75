/* firmware/mcu/piece.h - the registers of a piece (upload.h), written and read.
 *
 * A value of more than a register begins with its lowest one.  Used by the
 * board and by who sends. */
#ifndef FIRMWARE_MCU_PIECE_H
#define FIRMWARE_MCU_PIECE_H

#include "firmware/mcu/upload.h"

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
