/* firmware/linux/machine/machine_real.h - the interfaces and lines that a rig
 * names, as ports of a machine.
 *
 * Each is locked first (machine_lock.h): two programs that send set points to
 * the same drives are worse than one that does not start. */
#ifndef FIRMWARE_LINUX_MACHINE_MACHINE_REAL_H
#define FIRMWARE_LINUX_MACHINE_MACHINE_REAL_H

#include "firmware/linux/machine/machine.h"
#include "firmware/linux/machine/machine_gpio.h"
#include "firmware/linux/machine/machine_lock.h"
#include "firmware/linux/machine/machine_modbus.h"
#include "hal/linux/clock.h"
#include "hal/linux/socketcan.h"
#include "motion/core/err.h"

struct machine_real_config {
    struct machine_lock_config lock;
    bool reaches; /* every Modbus TCP server must be there now */
};

struct machine_real {
    struct memory_pool memory; /* of the arrays: one per bus */
    unsigned bus_count;        /* looked at so far */
    bool *is_open;
    struct can_socketcan *port;
    struct machine_lock lock;
    struct machine_gpio gpio;
    struct machine_modbus modbus;
    struct clock_linux clock;
};

/* Fills in *ports, for one that is all zero.  On an error returns its code and
 * writes a sentence; nothing is left open then.  Nothing has been sent yet. */
int machine_real_init(struct machine_real *real, const struct rig *rig,
                      const struct machine_real_config *config,
                      struct machine_ports *ports,
                      char message[YAML_MESSAGE_MAX]);
void machine_real_close(struct machine_real *real);

/* Is such an error not the rig file's: another program has what it names, or a
 * server is not there now? */
static inline bool machine_real_may_come(int err)
{
    return err == MOTION_E_STATE || err == MOTION_E_TIMEOUT;
}

#endif
