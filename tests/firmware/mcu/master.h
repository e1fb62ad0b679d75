/* tests/firmware/mcu/master.h - a board as its master sees it, over libmodbus.
 *
 * Every call repeats what got no answer; a refusal is final.  0, or -1 with a
 * line on stderr. */
#ifndef TESTS_FIRMWARE_MCU_MASTER_H
#define TESTS_FIRMWARE_MCU_MASTER_H

#include <modbus.h>
#include <stdbool.h>

#include "firmware/mcu/registers.h"
#include "hal/mcu/piece.h"

struct master {
    modbus_t *line;
    uint16_t sequence;
    unsigned repeated; /* requests without an answer */
};

/* Waits until the board says who it is, 10 s at most. */
int master_open(struct master *master, const char *device);
void master_close(struct master *master);
int master_read(struct master *master, unsigned address, unsigned count,
                uint16_t *value);
int master_command(struct master *master, enum mcu_command command,
                   uint32_t value);
/* In the tick `at`. */
int master_command_at(struct master *master, enum mcu_command command,
                      uint32_t value, uint32_t at);
/* What became of it; the upper ones are refusals. */
int master_piece(struct master *master, const uint16_t piece[], unsigned count,
                 enum mcu_piece_result *result);
/* Registers of the log from entry `index` on. */
int master_log(struct master *master, uint32_t index, unsigned count,
               uint16_t *value);

#endif
