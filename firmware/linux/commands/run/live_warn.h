/* firmware/linux/commands/run/live_warn.h - what axes, drives and buses warn of
 * (firmware/host/recording/row_notes.h), as lines on stderr, for commands that do a
 * machine's ticks themselves. */
#ifndef FIRMWARE_LINUX_COMMANDS_RUN_LIVE_WARN_H
#define FIRMWARE_LINUX_COMMANDS_RUN_LIVE_WARN_H

#include "firmware/host/recording/row_notes.h"
#include "firmware/linux/machine/machine.h"

struct live_warn {
    struct memory_pool memory; /* of the row */
    const char *command;       /* "home": in front of a line; NULL: says none */
    bool draws; /* a line in place, which nothing else may break: says none */
    struct telemetry_row row;
    struct row_notes notes;
};

/* All zero before; live_warn_free in the end. */
void live_warn_init(struct live_warn *warn, const struct rig *rig,
                    const char *command);
/* After a tick of the machine. */
void live_warn_step(struct live_warn *warn, const struct machine *machine,
                    int64_t now_ns);
void live_warn_free(struct live_warn *warn);

#endif
