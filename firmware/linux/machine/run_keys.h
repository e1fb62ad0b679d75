/* firmware/linux/machine/run_keys.h - the keys of the terminal while a move
 * runs on the clock.
 *
 *   space     hold, and resume
 *   +  -      10 % faster or slower, 10 to 200 %; 0 is 100 %
 *   q         stop along the path, as Ctrl-C once
 *
 * They go into the tick through the mailbox; what the controller refuses is
 * said on the terminal.  Everything here is called by the thread that looks on,
 * never by the tick. */
#ifndef FIRMWARE_LINUX_MACHINE_RUN_KEYS_H
#define FIRMWARE_LINUX_MACHINE_RUN_KEYS_H

#include "firmware/control/mailbox.h"
#include "firmware/host/move/job.h"
#include "firmware/host/recording/telemetry.h"
#include "firmware/linux/base/terminal.h"

struct run_keys {
    struct terminal terminal;
    struct mailbox mailbox;
    const struct job *job;
    int64_t override_q30; /* in force, as far as has been answered */
    int64_t wanted_q30;   /* with what has been put since */
    enum telemetry_phase phase;
    bool is_holding; /* at the last row */
};

/* Takes the terminal and says which keys there are.  False: standard input or
 * standard error is none; nothing is taken then. */
bool run_keys_begin(struct run_keys *keys, const struct job *job,
                    int64_t override_q30);
/* The terminal as it was; also when it was not taken. */
void run_keys_end(struct run_keys *keys);

void run_keys_take(struct run_keys *keys, const struct telemetry_row *row);
/* Keys to commands, answers to sentences; never waits. */
void run_keys_poll(struct run_keys *keys);

#endif
