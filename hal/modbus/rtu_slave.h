/* hal/modbus/rtu_slave.h - a slave on an RTU line, byte by byte.
 *
 * A frame ends with silence; one with the right CRC and our unit, or for all,
 * is done, and answered (not when it was for all) turnaround_ns later.
 * Everything else is somebody else's or broken, and ignored. */
#ifndef HAL_MODBUS_RTU_SLAVE_H
#define HAL_MODBUS_RTU_SLAVE_H

#include "hal/modbus/slave.h"
#include "hal/modbus/station.h"

struct modbus_rtu_slave {
    struct modbus_station station;
    struct modbus_slave *slave;
    struct modbus_rtu_time time;
    uint8_t unit;
    int64_t turnaround_ns;
    struct modbus_receiver receiver;
    uint8_t answer[MODBUS_FRAME_MAX];
    unsigned answer_length; /* waits for its time; 0: none */
    int64_t answer_ns;
    bool sending;
    uint64_t served, ignored; /* frames; broken or of somebody else */
};

/* unit 1..247, turnaround_ns >= 0, else MOTION_E_ARG. */
int modbus_rtu_slave_init(struct modbus_rtu_slave *self,
                          struct modbus_slave *slave, uint8_t unit,
                          const struct modbus_rtu_line *line,
                          int64_t turnaround_ns);

#endif
