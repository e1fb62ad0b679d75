/* tests/firmware/mcu/play_file.h - a move as a processor without an operating
 * system finds it in its memory, little-endian: this head, then the pieces of
 * each axis (set-up, head, segments one by one), each as its number of registers
 * and these, 0 after the last.  Written by pack.c, played by
 * tests/qemu/mcu_play.c. */
#ifndef TESTS_FIRMWARE_MCU_PLAY_FILE_H
#define TESTS_FIRMWARE_MCU_PLAY_FILE_H

#include "firmware/mcu/unit.h"

#define PLAY_FILE_MAGIC 0x59414C50u

struct play_file {
    uint32_t magic, axes, period_ns, move_id;
    uint32_t ticks, crc;          /* of the run on a PC */
    uint32_t begin[MCU_AXES_MAX]; /* of the axis's pieces, bytes from here */
};

#endif
