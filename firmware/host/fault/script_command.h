/* firmware/host/fault/script_command.h - a fault as one types it:
 *
 *   drive_fault pan code 0x3210
 *   noise can1 rate 2 % for 5 s
 *   obstacle dolly position 800 mm for 200 ms
 *
 * the kind, what it happens to (an axis, a bus or a gpio line of the rig), and
 * what an entry of a fault script has beside them. */
#ifndef FIRMWARE_HOST_FAULT_SCRIPT_COMMAND_H
#define FIRMWARE_HOST_FAULT_SCRIPT_COMMAND_H

#include "firmware/host/fault/script.h"

#define FAULT_COMMAND_MAX 256

/* 0, or -1 with one sentence.  Without a time or a position it is `at` 0. */
int fault_script_command(const char *line, const struct rig *rig,
                         struct fault_entry *entry,
                         char message[YAML_MESSAGE_MAX]);

#endif
