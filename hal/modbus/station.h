/* hal/modbus/station.h - who sits on an RTU line with bytes and time only.
 *
 * A station is a state machine without clock or port: its driver (the interrupt
 * and timer of a microcontroller, sim/bus/modbus.c) tells what came and when,
 * and asks what to send.  Masters (master.h) and slaves
 * (rtu_slave.h) are both stations. */
#ifndef HAL_MODBUS_STATION_H
#define HAL_MODBUS_STATION_H

#include "hal/modbus/rtu.h"

#define MODBUS_STATION_NEVER INT64_MAX

struct modbus_station;

struct modbus_station_ops {
    /* These bytes have come; the last one ended at now_ns. */
    void (*recv)(struct modbus_station *station, const uint8_t *bytes,
                 unsigned length, int64_t now_ns);
    /* When to call poll next, MODBUS_STATION_NEVER: only after something else
     * has been called.  May have passed. */
    int64_t (*due_ns)(const struct modbus_station *station);
    /* Bytes to send from now on, 0: none. */
    unsigned (*poll)(struct modbus_station *station, int64_t now_ns,
                     uint8_t frame[MODBUS_FRAME_MAX]);
    /* Their last bit has gone out. */
    void (*sent)(struct modbus_station *station, int64_t now_ns);
};

struct modbus_station {
    const struct modbus_station_ops *ops;
};

/* What came since the line was silent last. */
struct modbus_receiver {
    uint8_t byte[MODBUS_FRAME_MAX];
    unsigned length;  /* above MODBUS_FRAME_MAX: more than a frame */
    int64_t begin_ns; /* when the first piece was complete */
    int64_t last_ns;  /* end of the last character */
};

static inline void modbus_receiver_take(struct modbus_receiver *receiver,
                                        const uint8_t *bytes, unsigned length,
                                        int64_t now_ns)
{
    if (receiver->length == 0)
        receiver->begin_ns = now_ns;
    receiver->last_ns = now_ns;
    for (unsigned i = 0; i < length; i++) {
        if (receiver->length < MODBUS_FRAME_MAX)
            receiver->byte[receiver->length] = bytes[i];
        if (receiver->length <= MODBUS_FRAME_MAX)
            receiver->length++;
    }
}

#endif
