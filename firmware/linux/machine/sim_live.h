/* firmware/linux/machine/sim_live.h - faults of drives that are served by slew
 * sim: from a script, whose times count from the start, and from commands on
 * standard input, a line each, while it runs.  On a terminal a view of all axes
 * stands below the commands, redrawn in place. */
#ifndef FIRMWARE_LINUX_MACHINE_SIM_LIVE_H
#define FIRMWARE_LINUX_MACHINE_SIM_LIVE_H

#include "firmware/host/fault/script_command.h"
#include "firmware/linux/machine/machine_fault.h"
#include "firmware/linux/machine/sim_server.h"

struct sim_live {
    struct sim_server *server;
    struct fault_script script; /* grows by the commands */
    struct machine_fault faults;
    int64_t start_ns;
    uint64_t told; /* which have been said to begin, a bit per entry */
    char line[FAULT_COMMAND_MAX];
    size_t length;
    bool too_long; /* the line that is being read */
    bool ended;    /* standard input is */
    bool quit;     /* a command was to end */
    /* the view: lines of the terminal that it has, 0: none; as it was drawn */
    unsigned view_lines, view_top, view_rows;
    int64_t view_ns;
};

/* `script` is copied; NULL: none.  Its events are those of a run, of which there
 * is none here: sim_live_judges says which entry has one, -1: none.  All zero
 * before, sim_live_free in the end. */
int sim_live_judges(const struct fault_script *script);
int sim_live_init(struct sim_live *live, struct sim_server *server,
                  const struct fault_script *script);
void sim_live_free(struct sim_live *live);
/* Commands that have come, then what is due. */
void sim_live_step(struct sim_live *live);

/* The commands, a line each. */
extern const char sim_live_help[];

#endif
