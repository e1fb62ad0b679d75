/* hal/linux/libmodbus_rs485.h - who switches the direction of an RS-485 line.
 *
 * By RTS, libmodbus does it around every frame: RTS to sending, `rts_delay_ns`,
 * the frame, its time on the wire and `rts_delay_ns` once more, RTS to
 * listening; it does not look at whether that worked, so this does before.  By
 * the kernel (TIOCSRS485), the serial driver does it, with the same delays. */
#ifndef HAL_LINUX_LIBMODBUS_RS485_H
#define HAL_LINUX_LIBMODBUS_RS485_H

#include "hal/linux/libmodbus.h"

/* Can the port `fd` do it?  0, or -1 with errno. */
int modbus_rs485_look(int fd, enum modbus_line_rs485 rs485);

/* Set a connected port up for it.  0, or -1 with errno. */
int modbus_rs485_apply(struct _modbus *context,
                       const struct modbus_line_config *config);

#endif
