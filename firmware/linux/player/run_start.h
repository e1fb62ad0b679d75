/* firmware/linux/player/run_start.h - when a move begins: as soon as its axes
 * are ready, at a time of the wall clock, or when a line becomes active.
 *
 * The wall clock is looked at until the start, so that a clock that is set
 * meanwhile counts, and that is said; one that is set past the start ends the
 * wait, and nothing is moved.  Ticks are laid so that one of them is at the start.  Of a
 * line it is the edge that counts, and the first one once the axes are ready:
 * whatever was before does not start anything. */
#ifndef FIRMWARE_LINUX_PLAYER_RUN_START_H
#define FIRMWARE_LINUX_PLAYER_RUN_START_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "hal/clock.h"
#include "hal/gpio.h"

struct run_start {
    int64_t wall_ns;        /* since 1970; 0: at once */
    int64_t due_ns;         /* on the clock, when it was looked at last */
    bool late;              /* it was due before the axes were ready */
    bool passed;            /* the wall clock was set past it */
    _Atomic int64_t set_ns; /* by so much it was set, in all, and */
    int64_t said_ns;        /* so much of that was said */
    struct hal_gpio *line;  /* NULL: none */
    bool listening, seen;   /* to the line; its edge */
    bool failed;            /* it cannot be read */
};

/* The wall clock minus `clock`, ns: of several readings the one that took the
 * least time. */
int64_t run_start_offset_ns(struct hal_clock *clock);

/* `now_ns`, or up to a period before it: the first of the ticks. */
int64_t run_start_align_ns(struct run_start *start, struct hal_clock *clock,
                           int64_t now_ns, int64_t period_ns);
#define RUN_START_NEVER INT64_MAX

/* Looks at the line at nominal time `now_ns`, once the axes are ready; the
 * start is on this tick when nothing is to be ahead of it, else `lead_ns`, in
 * whole ticks, later.  RUN_START_NEVER: not yet. */
int64_t run_start_edge_ns(struct run_start *start, int64_t now_ns,
                          int64_t lead_ns, int64_t period_ns);
/* When to start, on the clock: `ready_ns`, or a tick after it.  Called on every
 * tick before the start, at nominal time `now_ns`. */
int64_t run_start_due_ns(struct run_start *start, struct hal_clock *clock,
                         int64_t now_ns, int64_t ready_ns, int64_t period_ns);
/* For who looks on: a line on stderr when the wall clock was set by 100 ms or
 * more, and there is still a start. */
void run_start_say(struct run_start *start);

#endif
