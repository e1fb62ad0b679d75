/* firmware/linux/machine/guardian.h - a process that looks on while real drives
 * have torque.
 *
 *   asleep --first tick--> watching --guardian_done--> done
 *                             |
 *                             | no tick for GUARDIAN_HUNG_NS, or the process is gone
 *                             v
 *                  SIGKILL, its ports are free; torque off every drive of the
 *                  rig (off.h), said on standard error; the end
 *
 * It is forked before ports are opened and threads are made, holds no port and
 * no lock, and shares one page with the loop, which counts its ticks there: one
 * atomic store a tick.  It is a session of its own and ignores what a terminal
 * sends; it sees the end of the process, however it came, by a pipe.  A pause
 * of the whole computer is no hang: what counts is time in which it ran
 * itself. */
#ifndef FIRMWARE_LINUX_MACHINE_GUARDIAN_H
#define FIRMWARE_LINUX_MACHINE_GUARDIAN_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "firmware/host/rig/rig.h"

/* Or GUARDIAN_HUNG_TICKS, whichever is longer: by then lost ticks have been a
 * fault, if there is still a loop to see them. */
#define GUARDIAN_HUNG_NS    INT64_C(250000000)
#define GUARDIAN_HUNG_TICKS 20
/* From one look to the next; so a hang is seen within two of them after that. */
#define GUARDIAN_LOOK_NS INT64_C(20000000)
/* So long it tries to switch drives off. */
#define GUARDIAN_OFF_NS INT64_C(30000000000)

struct guardian_page {
    _Atomic uint64_t ticks; /* the loop's; 0: there is nothing to guard yet */
    _Atomic bool done;
};

/* Visible so that it can be static; use the functions. */
struct guardian {
    struct guardian_page *page; /* NULL: there is none */
    int alive;                  /* our end of the pipe */
    pid_t pid;
};

/* `rig` as it is now.  0, or -1 with a line on standard error: nothing is to
 * move then. */
int guardian_start(struct guardian *guardian, const struct rig *rig);
/* Every drive has said that it is off, or it was said who has not: from now on
 * ticks may stay away.  Does nothing without a page. */
void guardian_done(struct guardian_page *page);
/* Ends it; without guardian_done it does what it does when we are gone, and is
 * waited for.  Does nothing when there is none. */
void guardian_end(struct guardian *guardian);

/* What it tells a hang by; time is an argument. */
struct guardian_watch {
    uint64_t ticks;
    int64_t hung_ns, look_ns, still_ns;
};

void guardian_watch_init(struct guardian_watch *watch, int64_t period_ns,
                         int64_t now_ns);
/* At each look: has there been no tick for longer than hung_ns of its own
 * time? */
bool guardian_watch_hangs(struct guardian_watch *watch,
                          const struct guardian_page *page, int64_t now_ns);

/* How it switches drives off; off.h. */
struct off_config;
extern const struct off_config guardian_off;

/* Once a tick. */
static inline void guardian_tick(struct guardian_page *page, uint64_t ticks)
{
    if (page != NULL)
        atomic_store_explicit(&page->ticks, ticks, memory_order_relaxed);
}

#endif
