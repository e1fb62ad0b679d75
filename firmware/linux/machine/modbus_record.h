/* firmware/linux/machine/modbus_record.h - what went over the Modbus lines, as
 * a file for Wireshark.
 *
 * A recorder stands before a line and writes down every transaction when its
 * reply is collected: the request, and the answer when there was a sound one.
 * It only copies; the file is written afterwards.  pcap with ns: RTU frames as
 * user link type 0 (unit, PDU, CRC: dissector mbrtu), TCP ones as IPv4 between
 * 127.0.0.1 and itself, port 502. */
#ifndef FIRMWARE_LINUX_MACHINE_MODBUS_RECORD_H
#define FIRMWARE_LINUX_MACHINE_MODBUS_RECORD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "hal/modbus.h"

#define MODBUS_RECORD_BYTES ((size_t)4 * 1024 * 1024) /* some minutes */

struct modbus_record {
    struct hal_modbus modbus;
    struct hal_modbus *line;
    bool tcp;
    struct hal_modbus_request request[HAL_MODBUS_MAILBOX];
    uint32_t submitted, collected;
    uint16_t transaction;     /* TCP */
    uint32_t sequence[2];     /* TCP: bytes of client and server so far */
    uint64_t frames, dropped; /* dropped: no room left */
    size_t length;
    uint8_t bytes[MODBUS_RECORD_BYTES];
};

/* &record->modbus takes the place of the line. */
void modbus_record_init(struct modbus_record *record, struct hal_modbus *line,
                        bool tcp);
/* Errors stay in the file's error flag. */
void modbus_record_write(const struct modbus_record *record, FILE *file);

#endif
