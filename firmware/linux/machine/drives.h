/* firmware/linux/machine/drives.h - storage for the driver of an axis and for its
 * simulated drive, whatever kind they are: the one place where all kinds stand
 * together. */
#ifndef FIRMWARE_LINUX_MACHINE_DRIVES_H
#define FIRMWARE_LINUX_MACHINE_DRIVES_H

#include "hal/drive/cia402/drive.h"
#include "hal/drive/modbus/drive.h"
#include "hal/drive/moteus/drive.h"
#include "hal/drive/odrive/drive.h"
#include "hal/drive/slew_mcu/drive.h"
#include "hal/drive/virtual/drive.h"
#include "sim/device/cia402/servo.h"
#include "sim/device/modbus/servo.h"
#include "sim/device/moteus/servo.h"
#include "sim/device/odrive/servo.h"

union machine_drive {
    struct drive_cia402 cia402;
    struct drive_modbus modbus;
    struct drive_odrive odrive;
    struct drive_moteus moteus;
    struct drive_slew_mcu slew_mcu;
    struct drive_virtual virtual_axis;
};

struct board_sim; /* its kind's */

union machine_sim_drive {
    struct sim_cia402 cia402;
    struct sim_modbus_servo modbus;
    struct sim_odrive odrive;
    struct sim_moteus moteus;
    struct board_sim *slew_mcu; /* of all axes of the board */
};

#endif
