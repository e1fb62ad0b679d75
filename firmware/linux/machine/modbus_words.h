/* firmware/linux/machine/modbus_words.h - what the counts of a Modbus line say, in
 * words: a sentence for each kind of trouble that was met, with its number, what it
 * comes from and what helps. */
#ifndef FIRMWARE_LINUX_MACHINE_MODBUS_WORDS_H
#define FIRMWARE_LINUX_MACHINE_MODBUS_WORDS_H

#include "firmware/host/rig/rig.h"

#define MODBUS_WORDS     5
#define MODBUS_WORDS_MAX 160

/* How many; nothing of a line without trouble. */
unsigned modbus_words(const struct rig_bus *bus,
                      const struct hal_modbus_stats *stats,
                      char text[MODBUS_WORDS][MODBUS_WORDS_MAX]);

#endif
