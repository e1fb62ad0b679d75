/* firmware/linux/machine/machine_real.h - the interfaces and lines that a rig
 * names, as ports of a machine.
 *
 * Each is taken for ourselves on this host: two programs that send set points
 * to the same drives are worse than one that does not start. */
#ifndef FIRMWARE_LINUX_MACHINE_MACHINE_REAL_H
#define FIRMWARE_LINUX_MACHINE_MACHINE_REAL_H

#include "firmware/linux/machine/machine.h"
#include "firmware/linux/machine/machine_gpio.h"
#include "firmware/linux/machine/machine_modbus.h"
#include "hal/linux/clock.h"
#include "hal/linux/socketcan.h"

struct machine_real {
    struct memory_pool memory; /* of the arrays: one per bus */
    unsigned bus_count;        /* looked at so far */
    bool *is_open;
    struct can_socketcan *port;
    int *lock;
    struct machine_gpio gpio;
    struct machine_modbus modbus;
    struct clock_linux clock;
};

/* Fills in *ports, for one that is all zero.  On an error returns its code and writes a sentence; nothing
 * is left open then.  Nothing has been sent yet. */
int machine_real_init(struct machine_real *real, const struct rig *rig,
                      struct machine_ports *ports,
                      char message[YAML_MESSAGE_MAX]);
void machine_real_close(struct machine_real *real);

#endif
