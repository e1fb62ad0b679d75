/* firmware/linux/machine/machine.h - the parts of a rig put together:
 * fieldbuses, drives, controller.
 *
 * The machine is built on ports: one CAN port or Modbus line per bus, one GPIO
 * line per line, a clock.  They come from machine_sim.h or machine_real.h. */
#ifndef FIRMWARE_LINUX_MACHINE_MACHINE_H
#define FIRMWARE_LINUX_MACHINE_MACHINE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/controller.h"
#include "firmware/control/frame_step.h"
#include "firmware/control/homing.h"
#include "firmware/control/playback.h"
#include "firmware/control/trigger.h"
#include "firmware/host/job/job_approach.h"
#include "firmware/host/rig/rig.h"
#include "firmware/linux/machine/guardian.h"
#include "firmware/linux/machine/warnings.h"
#include "hal/can.h"
#include "hal/can/bus.h"
#include "hal/canopen/canopen.h"
#include "hal/clock.h"
#include "hal/drive/virtual/drive.h"
#include "hal/gpio/debounce.h"

/* The arrays belong to whoever made the ports. */
struct machine_ports {
    struct hal_clock *clock;
    struct hal_can **can; /* one or the other per bus of the rig */
    struct hal_modbus **modbus;
    struct hal_gpio **line;         /* one per line of the rig */
    struct guardian_page *guardian; /* counts the ticks; NULL: nobody does */
    bool is_real; /* of real drives, which may come back when they are lost */
};

/* Ports of a rig, none of which is there yet. */
void machine_ports_init(struct machine_ports *ports, const struct rig *rig,
                        struct memory_pool *memory);

/* A trigger line, and the shot that the last tick fired. */
struct machine_trigger {
    unsigned line; /* of the rig */
    struct trigger trigger;
    uint32_t shot;   /* its number, from 1; 0: none */
    int64_t shot_ns; /* when the line had been set, on the ports' clock */
    struct motion_clock_rate aim; /* the path `lead` after that tick */
};

struct machine {
    struct memory_pool memory; /* of the arrays: one per bus, axis or line */
    const struct rig *rig;
    struct machine_ports ports;
    struct canopen *bus;
    struct modbus_bus *modbus;
    struct can_bus *can;
    void **drive; /* of each axis the driver of its kind */
    struct drive_virtual_bus virtual_bus;
    struct hal_fieldbus **fieldbus; /* of the rig's buses, and virtual_bus */
    struct hal_drive **axis;
    struct controller_axis_config *axis_config;
    struct controller_axis *axis_state;
    struct controller_switches *switches;
    struct homing_config *homing_config;
    struct controller_gantry *gantry; /* of each of the rig */
    struct drive_monitor **monitor;   /* around a drive; NULL: not monitored */
    struct machine_warnings *warnings;
    uint32_t *found; /* times that its drive was found with torque, as seen */
    struct gpio_debounce *input; /* of lines that are inputs */
    bool lit;                    /* the lamps */
    uint64_t powered; /* a bit per axis that may have torque: it has had it, or
                         was on its way to it, and has not said since that it
                         is off */
    uint64_t ticks;   /* of every kind, for the guardian */
    struct guardian_sight sight; /* and what is seen of it */
    int64_t retry_ns; /* machine_tick_off: a lost drive is looked for anew */
    struct machine_trigger trigger[RIG_TRIGGERS_MAX];
    unsigned trigger_count;
    bool running_up; /* triggers are armed, the move starts later: */
    struct motion_clock_warp start;
    struct controller controller;
    struct controller_jog jog;
    struct homing homing;
    struct playback playback; /* nothing loaded */
    struct frame_step step;   /* of what is loaded; nothing waits */
    struct playback_axis *playback_axis;
};

/* Axis i of the rig is axis i of the controller.  The machine is all zero, or
 * was made before and is given back.  On an error returns its code and writes a
 * sentence.  machine_free in either case. */
int machine_init(struct machine *machine, const struct rig *rig,
                 const struct machine_ports *ports,
                 char message[YAML_MESSAGE_MAX]);
void machine_free(struct machine *machine);

/* As it is on the wire.  false, and 0: this kind of drive has none. */
bool machine_statusword(const struct machine *machine, unsigned axis,
                        uint16_t *word);

/* One tick at nominal time `now_ns`: take in what came and send SYNC; step the
 * controller; send the set points. */
void machine_tick(struct machine *machine, int64_t now_ns);

/* The same without the controller: every drive brakes by its own quick stop.
 * For an operator who cannot wait. */
void machine_tick_quick_stop(struct machine *machine, int64_t now_ns);
/* The same, but every drive is asked to be off, whatever the controller is
 * about; one that was lost is looked for, again and again.  What comes last on
 * every way out of the program (shutdown.h). */
void machine_tick_off(struct machine *machine, int64_t now_ns);
/* Every drive that had torque has said itself that it is off. */
bool machine_is_off(const struct machine *machine);
/* One of those that have not is lost: it may come back. */
bool machine_is_torque_lost(const struct machine *machine);
/* One of them is there, and brakes by itself. */
bool machine_brakes(const struct machine *machine);
/* What the search for the drive of an axis found; NULL: it cannot tell. */
const struct hal_drive_found *machine_found(const struct machine *machine,
                                            unsigned axis);
/* "torque is not confirmed off: DRIVE'S WORDS" of an axis that may have torque;
 * "" of any other. */
#define MACHINE_TORQUE_MAX 160
void machine_torque_text(const struct machine *machine, unsigned axis,
                         char text[MACHINE_TORQUE_MAX]);

/* "bus can0: interface down": the worst of the buses, when there is a fault as
 * it was when that came; "" when all are good. */
#define MACHINE_TROUBLE_MAX 96
void machine_trouble_text(const struct machine *machine,
                          char text[MACHINE_TROUBLE_MAX]);
/* Why what is loaded cannot be gone to or begun: playback's error, with its axis. */
void machine_refusal_text(const struct machine *machine, int err,
                          char text[JOB_APPROACH_TEXT_MAX]);
/* "slide: the axis does not follow its set points, DRIVE'S WORDS", or of all axes
 * the fault and what machine_trouble_text says; "" when there is no fault. */
#define MACHINE_FAULT_MAX 200
void machine_fault_text(const struct machine *machine,
                        char text[MACHINE_FAULT_MAX]);
/* No drive moves or follows set points any more. */
bool machine_is_at_rest(const struct machine *machine);

/* The wire's time in use so far, ns; 0: unknown.  Of a serial line what its
 * frames and silences need, whatever waiting came on top; of TCP, which has no
 * rate, how long answers were waited for. */
int64_t machine_busy_ns(const struct machine *machine, unsigned bus);
/* How often the CAN port of a bus came to error-warning, an error counter of 96 (ISO
 * 11898-1, 12.1.4.3), which stops nothing; 0 of what is no CAN bus. */
uint32_t machine_bus_warnings(const struct machine *machine, unsigned bus);

#endif
