/* hal/modbus/slave.h - registers behind a Modbus address: from the bytes of a
 * request to the bytes of its answer.
 *
 * The device gives two functions; who carries the bytes (station.h for
 * RTU, a socket for TCP) does not matter here. */
#ifndef HAL_MODBUS_SLAVE_H
#define HAL_MODBUS_SLAVE_H

#include "hal/modbus/pdu.h"

enum modbus_space {
    MODBUS_HOLDING,
    MODBUS_INPUT,
    MODBUS_COILS,    /* bit i is bit i % 16 of value[i / 16] */
    MODBUS_DISCRETE, /* the same; only read */
};

struct modbus_slave;

/* Both return 0 or a Modbus exception code; set then has changed nothing. */
struct modbus_slave_ops {
    uint8_t (*get)(struct modbus_slave *slave, enum modbus_space space,
                   uint16_t address, uint16_t count, uint16_t *value);
    uint8_t (*set)(struct modbus_slave *slave, enum modbus_space space,
                   uint16_t address, uint16_t count, const uint16_t *value);
};

struct modbus_slave {
    const struct modbus_slave_ops *ops;
    uint32_t functions; /* bit n: it has function n; 0: it has all */
};

/* Do what a request says.  Bytes of the answer. */
unsigned modbus_slave_serve(struct modbus_slave *slave, const uint8_t *pdu,
                            unsigned length, uint8_t answer[MODBUS_PDU_MAX]);

#endif
