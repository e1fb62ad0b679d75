/* firmware/mcu/registers.h - the board as a Modbus slave: what is in which
 * register, for who moves it and watches it.  docs/MCU.md is the map.
 *
 * A value of more than a register begins with its lowest one, and is read whole
 * when it is read in one request: the tick does not come between. */
#ifndef FIRMWARE_MCU_REGISTERS_H
#define FIRMWARE_MCU_REGISTERS_H

#include "firmware/mcu/upload.h"
#include "hal/mcu/registers.h"
#include "hal/modbus/slave.h"

/* A command that is done between tick `at` - 1 and tick `at`, or not at all. */
struct mcu_waiting {
    uint16_t command; /* 0: none */
    uint32_t value, at;
    enum controller_state state; /* in which it was given: another ends it */
};

struct mcu_registers {
    struct modbus_slave slave;
    struct mcu_unit *unit;
    struct mcu_upload *upload;
    uint32_t log_index; /* of the entry read at MCU_AT_LOG */
    uint16_t sequence;  /* of the last command; 0: none yet */
    uint16_t result;
    struct mcu_waiting waiting;
    uint32_t watch; /* ticks without a request that end operation; 0: none do */
    uint32_t heard; /* tick of the last request */
    uint16_t watch_ms;
    bool is_silent; /* it has ended so, and was not enabled since */
};

/* After every tick: does what waited for the next one.  Where nobody has asked
 * anything for as long as was agreed, axes stop along their path, and at rest
 * torque goes off. */
void mcu_registers_poll(struct mcu_registers *self);
void mcu_registers_init(struct mcu_registers *self, struct mcu_unit *unit,
                        struct mcu_upload *upload);

#endif
