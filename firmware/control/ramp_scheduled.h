/* firmware/control/ramp_scheduled.h - one change of the rate on several clocks: a
 * controller's and those of boards that sample tracks of the same move.
 *
 *   r'   peak   .--------.           area: the change of the rate
 *              /          \
 *         ----'            '----
 *           change  flat  change     ticks
 *
 * A ramp is given by where it goes to and by its ticks, of which everything else
 * follows.  Two clocks that have had the same ramps at the same of their ticks,
 * counted from where they began together, are in the same state; from it, the
 * same numbers make the same ramp, to the bit, and so the same path times and the
 * same place of rest.
 *
 *   find     who knows all tracks looks for it, from a tick that is far enough
 *            ahead for the others to be told
 *   schedule each judges it by the axes of its own, in the ticks until then, for
 *            what the search for a change of rate may take of one (ramp_step.h)
 *   begin    in that tick; who cannot has not changed anything
 *
 * It is two ramps of the clock (motion/core/clock_warp.h): the first goes back from
 * the peak at once, the second follows where the peak is, and stays there for a
 * while.  Each ends at a constant rate, so that a stop or a fault in its middle
 * finds what it always does. */
#ifndef FIRMWARE_CONTROL_RAMP_SCHEDULED_H
#define FIRMWARE_CONTROL_RAMP_SCHEDULED_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/clock_warp.h"

struct controller;

struct controller_ramp {
    int64_t rate_q30; /* where it goes to, 0 .. 200 %; 0: and is held there */
    int64_t
        tick_ns; /* of which these are, a multiple of the controller's tick: */
    int32_t change; /* r' to its peak, and back in as many; 1 or more */
    int32_t flat;   /* at it, 0 or more */
};

/* Is a move played forwards or held at a constant rate, and nothing else looked
 * for? */
bool controller_is_steady(const struct controller *controller);
/* One to ramp->rate_q30 within the limits that begins at begin_ns on clock_ns, in
 * the future; it is scheduled then.  They are tried from the shortest on, each an
 * eighth longer, as many as a tick of a PC has time for (some 0.05 ms): the next
 * call goes on after *tried of them, 0 to begin with and once all were.  In how many
 * ticks others that schedule it have judged it, at the most; 0: none was found by
 * this call.  Steady alone.  Divides. */
int32_t controller_ramp_find(struct controller *controller, int64_t begin_ns,
                             struct controller_ramp *ramp, int32_t *tried);
/* It is to begin at begin_ns on clock_ns, at the end of a tick to come.
 * MOTION_E_STATE unless steady; MOTION_E_ARG: one of its numbers is out of range;
 * MOTION_E_LIMIT: the rate is above what the move allows.  Divides. */
int controller_ramp_schedule(struct controller *controller,
                             const struct controller_ramp *ramp,
                             int64_t begin_ns);
/* Between two ticks, where the last one was at begin_ns: from there on.  HOLDING
 * follows where it goes to 0, else MOVING, and its rate is the override from then
 * on.  MOTION_E_STATE: not steady any more; MOTION_E_LIMIT: an axis would leave its
 * limits, or it was scheduled too late to say that none does; MOTION_E_TIMEOUT: its tick
 * is another one. */
int controller_ramp_begin(struct controller *controller);

#endif
