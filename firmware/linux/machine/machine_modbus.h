/* firmware/linux/machine/machine_modbus.h - Modbus buses of a rig by libmodbus,
 * as ports of a machine: the real devices, or simulated ones behind real
 * pseudo-terminals and sockets. */
#ifndef FIRMWARE_LINUX_MACHINE_MACHINE_MODBUS_H
#define FIRMWARE_LINUX_MACHINE_MACHINE_MODBUS_H

#include <stdio.h>

#include "firmware/linux/machine/machine.h"
#include "firmware/linux/machine/modbus_device.h"
#include "hal/linux/libmodbus.h"

struct machine_modbus {
    struct memory_pool memory; /* of the arrays: one per bus */
    unsigned bus_count;        /* looked at so far */
    bool *is_open, *has_device;
    struct modbus_libmodbus *line;
    struct modbus_device *device; /* NULL: real ones */
};

/* Is every TCP server of the rig there now?  What will never do is said before
 * anything is enabled; waits 2 s at most for each, then MOTION_E_TIMEOUT.  Not
 * for slew off, which goes on trying. */
int machine_modbus_reach(const struct rig *rig, char message[YAML_MESSAGE_MAX]);
/* Fills in ports->modbus of every Modbus bus.  On an error returns its code and
 * writes a sentence; nothing is left open then. */
int machine_modbus_open(struct machine_modbus *modbus, const struct rig *rig,
                        bool simulated, struct machine_ports *ports,
                        char message[YAML_MESSAGE_MAX]);
void machine_modbus_close(struct machine_modbus *modbus);

/* Of each bus that is open: transactions, failures; of a serial line the time
 * that they need on the wire, and how long they took. */
void machine_modbus_print(struct machine_modbus *modbus, const struct rig *rig,
                          FILE *file);

#endif
