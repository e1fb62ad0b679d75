/* tests/conform/conform_modbus.h - what every implementation of hal/modbus.h
 * does.
 *
 * A test program brings a line with a modbus_bank as unit 17 and nobody else,
 * and calls each claim. */
#ifndef TESTS_CONFORM_CONFORM_MODBUS_H
#define TESTS_CONFORM_CONFORM_MODBUS_H

#include "hal/modbus.h"
#include "tests/hal/linux/modbus_bank.h"

#define CONFORM_UNIT 17

struct conform_modbus {
    struct hal_modbus *line;
    struct modbus_bank *bank;
    bool broadcasts; /* the line can */
    /* Let time pass: 1 ms, or some. */
    void (*pass)(struct conform_modbus *conform);
};

/* Submit, let time pass, collect; fails when there is no reply for long. */
struct hal_modbus_reply
conform_modbus_do(struct conform_modbus *conform,
                  const struct hal_modbus_request *request);

void conform_modbus_every_function(struct conform_modbus *conform);
void conform_modbus_longest(struct conform_modbus *conform);
void conform_modbus_order(struct conform_modbus *conform);
void conform_modbus_mailbox_full(struct conform_modbus *conform);
void conform_modbus_refuses_malformed(struct conform_modbus *conform);
void conform_modbus_exception(struct conform_modbus *conform);
void conform_modbus_missing_unit(struct conform_modbus *conform);
void conform_modbus_broadcast(struct conform_modbus *conform);
void conform_modbus_stats(struct conform_modbus *conform);

#define CONFORM_MODBUS_LIST(X)                                                 \
    X(conform_modbus_every_function)                                           \
    X(conform_modbus_longest)                                                  \
    X(conform_modbus_order)                                                    \
    X(conform_modbus_mailbox_full)                                             \
    X(conform_modbus_refuses_malformed)                                        \
    X(conform_modbus_exception)                                                \
    X(conform_modbus_missing_unit)                                             \
    X(conform_modbus_broadcast)                                                \
    X(conform_modbus_stats)

#endif
