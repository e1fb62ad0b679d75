/* firmware/mcu/virtual_drive.h - a virtual axis: a drive without a motor that
 * is where its last set point was.
 *
 * For boards that only make set points (trial runs, step and direction
 * outputs), and to compare set points with other machines.  Keeps to
 * hal/drive.h. */
#ifndef FIRMWARE_MCU_VIRTUAL_DRIVE_H
#define FIRMWARE_MCU_VIRTUAL_DRIVE_H

#include "hal/drive.h"

struct mcu_virtual_drive {
    struct hal_drive drive;
    enum hal_drive_state state;
    int64_t pos_q32, vel_q32;
    int64_t now_ns;
};

/* Off, at pos_q32. */
void mcu_virtual_drive_init(struct mcu_virtual_drive *self, int64_t pos_q32);
/* Before each tick: what it says is measured then. */
void mcu_virtual_drive_begin(struct mcu_virtual_drive *self, int64_t now_ns);

#endif
