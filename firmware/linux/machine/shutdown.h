/* firmware/linux/machine/shutdown.h - the one way out of a machine whose drives may
 * have torque: stop category 1 (IEC 60204-1), to its end.
 *
 *          at rest             stood for settle_ns            each drive says so
 *   REST ----------> SETTLE ------------------------> OFF ------------------> DONE
 *     | second signal,                              ^  ^ |  SHUTDOWN_OFF_NS, and
 *     | or not at rest in time                      |  '-'  nobody is to try on
 *     '--> QUICK -----------------------------------'
 *                  at rest, or SHUTDOWN_QUICK_NS
 *
 *   REST    what moves stops along the path, or as its stop says
 *   QUICK   every drive brakes by its own quick stop
 *   OFF     torque off, in each drive's own way: what moves still is stopped first
 *           (hal/drive.h); no signal cuts it short
 *
 * A real drive that may have torque is tried until it says that it has none, lost or
 * not.  The first signal is a stop, whenever it comes, and never ends that.  What ends
 * it is a second one, or a later one, that comes while a drive is lost, or has been
 * tried for its time, and is meant: it stands alone
 * for SHUTDOWN_APART_NS before and after, which no key does that is held down or
 * bounces.  SIGTERM and SIGHUP are never a second signal (interrupt.h).  Torque that is
 * not confirmed off is the guardian's then, for its time.
 *
 * exit() and abort() in another thread than the tick's, whoever calls them, are a first
 * signal too: they wait until this way out is over.  In the tick's own thread nothing
 * is left to do it: that, as every other death of the process, is the guardian's. */
#ifndef FIRMWARE_LINUX_MACHINE_SHUTDOWN_H
#define FIRMWARE_LINUX_MACHINE_SHUTDOWN_H

#include <stdatomic.h>

#include "firmware/linux/machine/machine.h"

#define SHUTDOWN_QUICK_NS INT64_C(3000000000)
#define SHUTDOWN_LEAST_NS INT64_C(300000000) /* OFF: the last words get there */
#define SHUTDOWN_OFF_NS   INT64_C(5000000000) /* is long enough for an answer */
#define SHUTDOWN_APART_NS INT64_C(400000000)

enum shutdown_phase {
    SHUTDOWN_NONE, /* not begun */
    SHUTDOWN_REST,
    SHUTDOWN_SETTLE,
    SHUTDOWN_QUICK,
    SHUTDOWN_OFF,
    SHUTDOWN_DONE,
};

/* Visible so that it can be static; use the functions. */
struct shutdown {
    struct machine *machine;
    struct memory_pool memory;
    enum shutdown_phase phase;
    int64_t phase_ns; /* since when */
    int64_t rest_ns;  /* so long REST may take where nobody else says */
    int64_t settle_ns, least_ns, off_ns;
    /* signals so far, the last one, and whether it may be meant to give up */
    int stops;
    int64_t stops_ns;
    bool may_give_up, gives_up;
    bool is_live;  /* exit() waits for it */
    char *waiting; /* which drives it waits for, a line each */
    size_t waiting_size;
    _Atomic bool waits; /* for a drive that has had its time */
    bool said;          /* that it does */
};

/* All zero before.  From the first tick to DONE, or shutdown_free, exit() waits. */
void shutdown_init(struct shutdown *shutdown, struct machine *machine);
void shutdown_free(struct shutdown *shutdown);

/* Every tick, in its thread: take in the operator's `signals` so far (interrupt.h).
 * Returns them, at least a first one where exit() or abort() was called. */
int shutdown_stops(struct shutdown *shutdown, int64_t now_ns, int signals);
/* Begin, where it has not begun.  settle_ns: to stand with torque, after rest. */
void shutdown_begin(struct shutdown *shutdown, int64_t now_ns,
                    int64_t settle_ns);
/* Do the machine's tick at `now_ns`, in the place of machine_tick.  True: DONE. */
bool shutdown_tick(struct shutdown *shutdown, int64_t now_ns);

/* Say once which drives are waited for, on standard error; from any one thread. */
void shutdown_say_waiting(struct shutdown *shutdown);
/* Say in the end which drives have not confirmed that they are off, and who goes on
 * with them.  True: all have. */
bool shutdown_say_torque(const struct machine *machine);

#endif
