/* hal/linux/libmodbus_rs485.c - see libmodbus_rs485.h. */
#define _GNU_SOURCE /* TIOCGRS485 */
#include "hal/linux/libmodbus_rs485.h"

#include <linux/serial.h>
#include <modbus.h>
#include <sys/ioctl.h>

#define NS_PER_MS 1000000
#define NS_PER_US 1000

int modbus_rs485_look(int fd, enum modbus_line_rs485 rs485)
{
    struct serial_rs485 kernel;
    int lines;

    switch (rs485) {
    case RS485_KERNEL:
        return ioctl(fd, TIOCGRS485, &kernel);
    case RS485_RTS_UP:
    case RS485_RTS_DOWN:
        return ioctl(fd, TIOCMGET, &lines);
    case RS485_AUTOMATIC:
        break;
    }
    return 0;
}

static int rs485_by_kernel(int fd, int64_t delay_ns)
{
    struct serial_rs485 kernel;

    if (ioctl(fd, TIOCGRS485, &kernel) < 0)
        return -1;
    kernel.flags |= SER_RS485_ENABLED;
    if (delay_ns > 0) {
        kernel.delay_rts_before_send = (uint32_t)(delay_ns / NS_PER_MS);
        kernel.delay_rts_after_send = (uint32_t)(delay_ns / NS_PER_MS);
    }
    return ioctl(fd, TIOCSRS485, &kernel);
}

static int rs485_by_rts(modbus_t *context, int mode, int64_t delay_ns)
{
    if (delay_ns > 0 &&
        modbus_rtu_set_rts_delay(context, (int)(delay_ns / NS_PER_US)) < 0)
        return -1;
    return modbus_rtu_set_rts(context, mode);
}

int modbus_rs485_apply(modbus_t *context,
                       const struct modbus_line_config *config)
{
    const int fd = modbus_get_socket(context);
    const int64_t delay_ns = config->rts_delay_ns;

    if (modbus_rs485_look(fd, config->rs485) < 0)
        return -1;
    switch (config->rs485) {
    case RS485_KERNEL:
        return rs485_by_kernel(fd, delay_ns);
    case RS485_RTS_UP:
        return rs485_by_rts(context, MODBUS_RTU_RTS_UP, delay_ns);
    case RS485_RTS_DOWN:
        return rs485_by_rts(context, MODBUS_RTU_RTS_DOWN, delay_ns);
    case RS485_AUTOMATIC:
        break;
    }
    return 0;
}
