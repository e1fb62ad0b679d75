/* firmware/linux/machine/guardian.h - a process that looks on while real drives
 * have torque.
 *
 *   asleep --first tick--> watching --guardian_done--> done
 *                           |    |
 *                           |    | guardian_leave, then the process is gone
 *                           v    v
 *   no tick for             torque off every drive of the rig (off.h), said on
 *   GUARDIAN_HUNG_NS:       standard error; the end
 *   SIGKILL; or the process
 *   is gone
 *
 * It is forked before ports are opened and threads are made, holds no port and
 * no lock, and shares one page with the loop, which counts its ticks there: one
 * atomic store a tick.  It is a session of its own and ignores what a terminal
 * sends; it sees the end of the process, however it came, by a pipe.  A pause
 * of the whole computer is no hang: what counts is time in which it ran
 * itself.
 *
 * Who looks after it.  There are two processes, each with one thread and the rig as it
 * was at the start, so that either may fork: a keeper, our child, which only waits, and
 * the guardian, its child.  A guardian that is killed, or stopped, is replaced by the
 * keeper at once; where the keeper is killed the guardian forks another and takes its
 * place.  The process itself, with its threads, locks and locked memory, never forks
 * for that.  Each replacement is counted in the page; and the guardian counts its
 * looks there, so that the tick sees within a second, by one load, that nobody looks
 * any more: both were killed.  GUARDIAN_GIVE_WAY ends a guardian for good: whoever
 * sends it takes torque off itself (`slew off --take-over`, machine_lock.h). */
#ifndef FIRMWARE_LINUX_MACHINE_GUARDIAN_H
#define FIRMWARE_LINUX_MACHINE_GUARDIAN_H

#include <signal.h>
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
/* Any other program than a guardian dies of it, too. */
#define GUARDIAN_GIVE_WAY SIGUSR1
/* So long it tries to switch drives off. */
#define GUARDIAN_OFF_NS INT64_C(30000000000)
/* After guardian_leave a process is gone by then, or is killed. */
#define GUARDIAN_LEFT_NS INT64_C(10000000000)
/* The tick: without a look for so long there is no guardian any more. */
#define GUARDIAN_GONE_NS INT64_C(700000000)

enum guardian_end {
    GUARDIAN_WATCHED, /* ticks are to come */
    GUARDIAN_DONE,    /* every drive is off */
    GUARDIAN_LEFT,    /* not every one, and the process is about to end */
};

struct guardian_page {
    _Atomic uint64_t ticks; /* the loop's; 0: there is nothing to guard yet */
    _Atomic int end;        /* enum guardian_end, the loop's */
    _Atomic uint64_t looks; /* the guardian's */
    _Atomic uint32_t lost;  /* guardians and keepers that were replaced */
};

/* Visible so that it can be static; use the functions. */
struct guardian {
    struct guardian_page *page; /* NULL: there is none */
    int alive, gone;            /* our ends of pipes: we live; they all ended */
    pid_t pid;                  /* the keeper */
};

/* `rig` as it is now.  0, or -1 with a line on standard error: nothing is to
 * move then. */
int guardian_start(struct guardian *guardian, const struct rig *rig);
/* Every drive has said that it is off: from now on ticks may stay away.  Does
 * nothing without a page. */
void guardian_done(struct guardian_page *page);
/* Some have not, and nobody here tries any more: ticks may stay away, and once the
 * process is gone, with its ports, the guardian goes on. */
void guardian_leave(struct guardian_page *page);
/* Ends it and waits for that; after guardian_leave, or without guardian_done, it goes
 * on alone.  Ports are closed before.  Does nothing when there is none. */
void guardian_end(struct guardian *guardian);

/* What tells that a counter stands still; time is an argument, and what passes from
 * one look to the next counts for two looks at most: whoever looks was not run. */
struct guardian_watch {
    uint64_t count;
    int64_t look_ns, still_ns;
};

void guardian_watch_init(struct guardian_watch *watch, int64_t now_ns);
/* At each look: how long it has stood. */
int64_t guardian_watch_still_ns(struct guardian_watch *watch, uint64_t count,
                                int64_t now_ns);

/* The guardian's look at the loop: has it been still for longer than it may? */
bool guardian_sees_hang(struct guardian_watch *watch,
                        const struct guardian_page *page, int64_t period_ns,
                        int64_t now_ns);

/* The tick's look at the guardian. */
struct guardian_sight {
    struct guardian_watch watch;
    bool is_begun, is_gone;
    uint32_t lost; /* replaced, or gone: how often that was seen */
    uint32_t replaced;
};
/* Once a tick; does nothing without a page.  True: it was lost just now. */
bool guardian_sight_step(struct guardian_sight *sight,
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
