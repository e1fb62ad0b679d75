/* firmware/linux/service/follow.h - a move of a service that keeps to another clock
 * (firmware/linux/player/run_follow.h).
 *
 *   FREE --start with "follow"--> WAITS --their clock is at its start--> PLAYS
 *    ^                              |                                     |
 *    '-- ended: figures are told <--'--- over, or something else asked ---'
 *
 * The tick begins the move, as it alone sees pulses and is exact, and says what has
 * become of it in `turn`.  Whoever answers the clients reads timecode, steers through
 * the mailbox as any other command, and holds the move when their clock is lost. */
#ifndef FIRMWARE_LINUX_SERVICE_FOLLOW_H
#define FIRMWARE_LINUX_SERVICE_FOLLOW_H

#include <stdatomic.h>
#include <stdbool.h>

#include "firmware/linux/machine/machine.h"
#include "firmware/linux/player/run_follow.h"

enum service_follow_turn {
    SERVICE_FOLLOW_FREE,
    SERVICE_FOLLOW_WAITS,
    SERVICE_FOLLOW_PLAYS,
    SERVICE_FOLLOW_MISSED, /* their clock was past its start: nothing moves */
    SERVICE_FOLLOW_OVER,
};

/* The tick's, but for `turn`. */
struct service_follow {
    struct run_follow *clock; /* NULL: none; the other side's when it is over */
    _Atomic int turn;         /* enum service_follow_turn */
    int64_t since_ns;         /* it waits */
    unsigned stops;           /* the controller's, when it began to */
};

/* In READY (MOTION_E_STATE), with the move loaded: it is begun when the clock is at
 * its start. */
int service_follow_arm(struct service_follow *follow, struct run_follow *clock,
                       struct machine *machine, int64_t now_ns);
/* After a tick of the machine. */
void service_follow_step(struct service_follow *follow, struct machine *machine,
                         int64_t now_ns);

static inline bool service_follow_waits(const struct service_follow *follow)
{
    return atomic_load(&follow->turn) == SERVICE_FOLLOW_WAITS;
}

#endif
