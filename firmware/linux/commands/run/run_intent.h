/* firmware/linux/commands/run/run_intent.h - what slew run is about to do, said
 * before anything moves. */
#ifndef FIRMWARE_LINUX_COMMANDS_RUN_RUN_INTENT_H
#define FIRMWARE_LINUX_COMMANDS_RUN_RUN_INTENT_H

#include "firmware/linux/commands/run/run_when.h"

/* The axes with their margins, the buses with their load, how it starts. */
void run_intent_print(const struct run_when *self);

/* The same for programs: ok, title, duration_s, violations, buses. */
void run_intent_json(const struct run_when *self, enum status status);

#endif
