/* firmware/linux/machine/off.h - torque off every drive of a rig, and who says
 * so.
 *
 * Each bus is a machine of its own: one that cannot be opened, and a drive that
 * does not answer, keep no other waiting.  Only OFF is ever asked for.  Each
 * driver looks for its drive as ever, which stops one that is enabled, and
 * switches it off in its kind's own way.  Inputs are not looked at: nothing may be
 * in the way of this. */
#ifndef FIRMWARE_LINUX_MACHINE_OFF_H
#define FIRMWARE_LINUX_MACHINE_OFF_H

#include <signal.h>
#include <stdbool.h>
#include <stdint.h>

#include "firmware/linux/machine/machine.h"

struct off_config {
    bool real; /* else the rig's drives, simulated */
    int64_t
        open_ns; /* ports that cannot be opened are tried so long; those that
                        another program has for OFF_TAKEN_NS at least */
    bool kills;  /* that program is killed, or gone on beside, at once */
    int64_t timeout_ns; /* from there */
    bool takes_over; /* from a process that was killed just now, perhaps within
                           a transaction (hal/linux/libmodbus.h) */
};

/* A loop that hangs has been killed by its guardian by then (guardian.h), and
 * its ports are free. */
#define OFF_TAKEN_NS INT64_C(3000000000)

#define OFF_TEXT_MAX YAML_MESSAGE_MAX

struct off_axis {
    bool is_off; /* and the drive has said so */
    enum hal_drive_state state;
    char text[OFF_TEXT_MAX]; /* "torque is off", or why that is not known; and
                                how it was found, where it had torque */
    bool found;
};

/* Fill in `axis`, one per axis of the rig.  Until all are off, in vain for so
 * long, or *interrupts (NULL: none) end that, as on every way out (shutdown.h): the
 * first one is a stop, which is under way.  True: all are. */
bool off_all(const struct rig *rig, const struct off_config *config,
             struct off_axis axis[], const volatile sig_atomic_t *interrupts);

#endif
