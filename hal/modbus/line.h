/* hal/modbus/line.h - where a Modbus line is and how it is driven, as a rig says
 * it and hal/linux/libmodbus.h opens it.
 *
 * RS-485: `RS485_KERNEL` lets the driver of the device switch direction
 * (TIOCSRS485), which is exact; RS485_RTS_UP and _DOWN switch RTS from here,
 * with the operating system's delays; adapters that switch by themselves need
 * neither. */
#ifndef HAL_MODBUS_LINE_H
#define HAL_MODBUS_LINE_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/modbus/rtu.h"

#define MODBUS_LINE_TEXT_MAX 128

enum modbus_line_rs485 {
    RS485_AUTOMATIC,
    RS485_KERNEL,
    RS485_RTS_UP,   /* RTS high while sending */
    RS485_RTS_DOWN, /* RTS low while sending */
};

struct modbus_line_config {
    char device[MODBUS_LINE_TEXT_MAX]; /* RTU; empty: TCP */
    struct modbus_rtu_line line;
    enum modbus_line_rs485 rs485;
    int64_t rts_delay_ns; /* from switching the direction to the first
                             character, and from the last one to switching back;
                             0: one character's time, for the kernel what the
                             driver has; whole us, for the kernel whole ms; at
                             most 100 ms */
    bool echo;            /* the adapter hears what it sends, always */
    char host[MODBUS_LINE_TEXT_MAX]; /* name or address */
    uint16_t port;
    bool
        takes_over; /* from a process that may have been killed in the middle of
                        a transaction; hal/linux/libmodbus.h */
    int64_t timeout_ns;   /* end of request to whole answer, beyond its time on
                           the wire; 1 ms .. 10 s; 0: 50 ms */
    int64_t drain_ns;     /* as hal/modbus/master.h; 0: twice timeout_ns */
    int64_t broadcast_ns; /* as hal/modbus/master.h; 0: 10 ms */
};

/* Table of the baud rates that Linux has; libmodbus takes 9600 for any
 * other. */
bool modbus_line_is_baud(uint32_t baud);

#endif
