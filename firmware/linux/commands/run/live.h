/* firmware/linux/commands/run/live.h - a machine that an operator looks at or moves
 * by hand: a rig on simulated or real ports, and its tick.
 *
 * For commands without a move: home, jog, monitor.  Simulated in virtual time,
 * as fast as it goes or as fast as the clock; simulated on the clock; or
 * real. */
#ifndef FIRMWARE_LINUX_COMMANDS_RUN_LIVE_H
#define FIRMWARE_LINUX_COMMANDS_RUN_LIVE_H

#include <signal.h>
#include <stdio.h>

#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/run/live_warn.h"
#include "firmware/linux/machine/machine_real.h"
#include "firmware/linux/machine/machine_sim.h"
#include "firmware/linux/machine/shutdown.h"

/* For --help of what moves. */
#define LIVE_HELP_STOP                                                         \
    "Ctrl-C once stops within the limits, twice by the drives' own quick\n"    \
    "stop; SIGTERM and SIGHUP are Ctrl-C once.  The last thing is always\n"    \
    "torque off: a drive that has not confirmed it is named, status 1, and\n"  \
    "a real one is tried until it does, or Ctrl-C is pressed again.  With\n"   \
    "--real a guardian does the same when slew hangs, is killed, or leaves\n"  \
    "a drive to it.\n"

struct live {
    struct rig *rig;
    struct rig own; /* where live_read reads it to */
    struct machine machine;
    struct machine_sim sim;
    struct machine_real real;
    struct machine_modbus pty; /* with --pty */
    struct guardian guardian;  /* with --real, for what may have torque */
    struct shutdown shutdown;
    bool on_clock; /* time passes by itself */
    bool is_paced; /* virtual time, no faster than the clock */
    struct clock_linux pace;
    int64_t pace_ns;          /* clock minus virtual time */
    int64_t start_ns, now_ns; /* nominal time of the last tick */
    struct live_warn warn;    /* from live_begin on */
};

/* Read the rig, options->path[0], and --interface, into a live that is all
 * zero.  STATUS_OK, or STATUS_INPUT with a line on stderr.  Nothing is
 * opened. */
enum status live_read(struct live *live, const struct options *options);
/* The same for a rig that has been read: --interface, into it. */
enum status live_use(struct live *live, const struct options *options,
                     struct rig *rig);

/* Judge the buses before anything is opened that would have torque: STATUS_REFUSED,
 * with a line on stderr for each that cannot carry the rig. */
enum status live_fits(const struct live *live, const struct options *options);

/* Open the ports that the options ask for (real, pty, realtime).  Statuses as
 * above; live_close in either case. */
enum status live_ports(struct live *live, const struct options *options,
                       struct machine_ports *ports);
/* Build the machine on them. */
enum status live_build(struct live *live, const struct options *options,
                       const struct machine_ports *ports);
/* Both.  `paced`: for a person who looks on, virtual time is slowed down to the
 * clock's; a simulated machine loses no ticks when this one is busy. */
enum status live_open(struct live *live, const struct options *options,
                      bool paced);
/* Before anything is opened that will move.  With --real: says so and asks on a
 * terminal, elsewhere --yes is needed, and calls for a guardian.  STATUS_INPUT:
 * the operator does not want it. */
enum status live_confirm(struct live *live, const struct options *options,
                         const char *command);
/* That, and live_open. */
enum status live_begin(struct live *live, const struct options *options,
                       const char *command, bool paced);
/* What --dry-run says of a real machine: opens it and looks at the drives,
 * STATUS_REFUSED where the real run would end so; of a simulated one nothing. */
enum status live_dry_run(struct live *live, const struct options *options);
/* The same, and with --json an object that says so: for commands that have no
 * report of what they would do. */
enum status live_dry_run_alone(struct live *live,
                               const struct options *options);
/* Also of one that was never opened. */
void live_close(struct live *live);

/* Wait for the next tick and do it.  When time is past the one after it, whole
 * periods are left out. */
void live_tick(struct live *live);

/* Torque for all axes: ticks until the controller is READY or in FAULT, or
 * *interrupts is above 0.  True: READY. */
bool live_enable(struct live *live, const volatile sig_atomic_t *interrupts);
/* The way out (firmware/linux/machine/shutdown.h), from whatever is under way.
 * False, with a line on stderr for each: a drive has not said that it is off. */
bool live_off(struct live *live, const volatile sig_atomic_t *interrupts);

/* The same for who only looks on: does nothing but where a drive was found enabled,
 * which is being stopped. */
void live_leave(struct live *live, const volatile sig_atomic_t *interrupts);

/* Index of an axis by name; -1 with a line on stderr. */
int live_axis(const struct live *live, const char *command, const char *name);

#endif
