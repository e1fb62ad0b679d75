/* firmware/mcu/servos.h - servo drives on the board's own Modbus line: the
 * master of the line, and a drive of hal/drive/modbus for each axis that has
 * one, all by one register map.
 *
 * Two sides share the master's mailbox: the tick (begin, end) and the main
 * loop, which moves bytes and keeps the tick away while it calls
 * master.station. */
#ifndef FIRMWARE_MCU_SERVOS_H
#define FIRMWARE_MCU_SERVOS_H

#include "hal/drive/modbus/drive.h"
#include "hal/mcu/piece.h"
#include "hal/modbus/master.h"

struct mcu_servos {
    struct modbus_map map;
    struct mcu_servo servo[MCU_AXES_MAX];
    struct drive_modbus drive[MCU_AXES_MAX];
    struct modbus_master master;
    struct modbus_bus bus;
    bool is_on; /* start was good: the master may be served */
};

/* Nothing is known, and the line is silent. */
void mcu_servos_clear(struct mcu_servos *servos);
/* Can it be driven by the map that is there? */
bool mcu_servo_is_sound(const struct mcu_servos *servos,
                        const struct mcu_servo *servo);
/* The master and these axes' drives anew, off; bit per axis.  The errors of
 * modbus_master_init, modbus_bus_init and drive_modbus_init; the line is silent
 * then. */
int mcu_servos_start(struct mcu_servos *servos, uint16_t axes);

#endif
