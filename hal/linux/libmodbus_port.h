/* hal/linux/libmodbus_port.h - private to modbus_*libmodbus.c: the port, for
 * the line's thread only. */
#ifndef HAL_LINUX_LIBMODBUS_PORT_H
#define HAL_LINUX_LIBMODBUS_PORT_H

#include "hal/linux/libmodbus.h"

#define MODBUS_LIBMODBUS_RETRY_NS INT64_C(200000000)
#define MODBUS_LIBMODBUS_HURRIED  3 /* requests of a line that is taken over */

bool modbus_libmodbus_is_rtu(const struct modbus_libmodbus *self);
/* Open and connect, unless done or tried a moment ago. */
void modbus_libmodbus_up(struct modbus_libmodbus *self);
void modbus_libmodbus_down(struct modbus_libmodbus *self);
/* One transaction, its silence before it waited for. */
void modbus_libmodbus_transact(struct modbus_libmodbus *self,
                               struct modbus_libmodbus_box *box);
/* After one that ended with `err`: no answer of old may be left. */
void modbus_libmodbus_recover(struct modbus_libmodbus *self, int err);

#endif
