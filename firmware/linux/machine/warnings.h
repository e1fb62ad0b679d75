/* firmware/linux/machine/warnings.h - which warnings an axis begins at a tick;
 * see firmware/host/recording/warning.h.
 *
 * A following error of more than half of its limit is one until it is below
 * three eighths of it again.  The limit grows with the speed that the axis is
 * told (see controller_axis_config).  A reading that is monitored: see
 * hal/support/monitor.h.  A drive that was found with torque is one each time that it
 * is, once it has none. */
#ifndef FIRMWARE_LINUX_MACHINE_WARNINGS_H
#define FIRMWARE_LINUX_MACHINE_WARNINGS_H

#include <stdbool.h>

#include "firmware/control/controller.h"
#include "firmware/host/recording/warning.h"
#include "hal/support/monitor.h"

/* Of one axis; all zero: none yet. */
struct machine_warnings {
    struct warning newest;
    bool is_on[WARNING_KINDS];
    uint32_t found; /* times that were said */
};

/* After a tick of the controller; monitor, found NULL: there is none.  What begins
 * beside another waits for the next tick. */
void machine_warnings_step(struct machine_warnings *warnings,
                           const struct rig_axis *rig,
                           const struct controller_axis *axis,
                           const struct drive_monitor *monitor,
                           const struct hal_drive_found *found);
/* The warning of what was found, its number aside. */
struct warning machine_warning_found(const struct hal_drive_found *found);

#endif
