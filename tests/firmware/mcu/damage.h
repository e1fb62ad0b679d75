/* tests/firmware/mcu/damage.h - what a line may do to a frame, at any byte. */
#ifndef TESTS_FIRMWARE_MCU_DAMAGE_H
#define TESTS_FIRMWARE_MCU_DAMAGE_H

#include <stdint.h>

#define DAMAGE_MAX  512 /* bytes of a damaged frame, at most */
#define DAMAGE_BITS 8   /* kinds 0 .. 7 change this bit of the byte */

enum damage_kind {
    DAMAGE_INVERT = DAMAGE_BITS, /* all bits of the byte */
    DAMAGE_BURST,                /* of four bytes */
    DAMAGE_LOSE,                 /* the byte is not there */
    DAMAGE_DOUBLE,               /* is there twice */
    DAMAGE_SWAP,                 /* with the next one */
    DAMAGE_CUT_END,              /* nothing from the byte on */
    DAMAGE_CUT_BEGIN,            /* nothing before the byte, nor itself */
    DAMAGE_TAIL_TWICE,           /* all from the byte on comes twice */
    DAMAGE_OVERTAKEN,            /* the whole frame begins anew at the byte */
    DAMAGE_KINDS,
};

/* Damage a frame of `length` <= 256 bytes at byte `at` < length.  Returns its
 * new length; 0 where this kind changes nothing there. */
unsigned damage_frame(uint8_t frame[DAMAGE_MAX], unsigned length, unsigned kind,
                      unsigned at);

#endif
