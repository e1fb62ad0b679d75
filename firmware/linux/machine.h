/* firmware/linux/machine.h - the parts of a rig put together: fieldbuses,
 * drives, controller.
 *
 * The machine is built on ports: one CAN port per bus and a clock.  Simulated
 * ports come from machine_sim.h; real ones fill the same struct. */
#ifndef FIRMWARE_LINUX_MACHINE_H
#define FIRMWARE_LINUX_MACHINE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/controller.h"
#include "firmware/linux/rig.h"
#include "hal/can.h"
#include "hal/canopen.h"
#include "hal/clock.h"
#include "hal/drive_cia402.h"

struct machine_ports {
    struct hal_clock *clock;
    struct hal_can *can[RIG_BUSES_MAX]; /* one per bus of the rig */
};

struct machine {
    const struct rig *rig;
    struct machine_ports ports;
    struct canopen bus[RIG_BUSES_MAX];
    struct drive_cia402 drive[RIG_AXES_MAX];
    struct controller controller;
};

/* Axis i of the rig is axis i of the controller.  On an error returns its code
 * and writes a sentence. */
int machine_init(struct machine *machine, const struct rig *rig,
                 const struct machine_ports *ports,
                 char message[RIG_MESSAGE_MAX]);

/* One tick at nominal time `now_ns`: take in what came and send SYNC; step the
 * controller; send the set points. */
void machine_tick(struct machine *machine, int64_t now_ns);

/* The same without the controller: every drive brakes by its own quick stop.
 * For an operator who cannot wait. */
void machine_tick_quick_stop(struct machine *machine, int64_t now_ns);
/* No drive moves or follows set points any more. */
bool machine_is_at_rest(const struct machine *machine);

/* The wire's time in use so far, ns; 0: unknown. */
int64_t machine_busy_ns(struct machine *machine, unsigned bus);

#endif
