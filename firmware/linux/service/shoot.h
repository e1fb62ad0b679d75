/* firmware/linux/service/shoot.h - the events of a move that a service plays.
 *
 *   arm --lead over--> begun --goes--> fires --over, or stopped--> nothing
 *
 * What leads its events most is fired before the start, so that a move with such
 * a line begins later by as much: until then the axes stand, and whatever else is
 * asked of them ends it.  The tick's alone. */
#ifndef FIRMWARE_LINUX_SERVICE_SHOOT_H
#define FIRMWARE_LINUX_SERVICE_SHOOT_H

#include "firmware/linux/machine/machine.h"
#include "motion/plan/shoot/plan_event.h"

struct service_shoot {
    bool is_armed;
    bool is_due;      /* to be begun, once the controller's time is start_ns */
    int64_t start_ns; /* path time 0 */
    unsigned stops;   /* the controller's, when it was armed */
};

/* In READY (MOTION_E_STATE), with the move loaded: its shots, by line of the rig,
 * and begin it or, where lines lead, let it begin later.  They must outlive their
 * use.  Errors of playback_begin. */
int service_shoot_arm(struct service_shoot *shoot, struct machine *machine,
                      const struct plan_shots shots[]);
/* No more shots. */
void service_shoot_drop(struct service_shoot *shoot, struct machine *machine);

/* Before a tick and after it. */
void service_shoot_begin(struct service_shoot *shoot, struct machine *machine);
void service_shoot_step(struct service_shoot *shoot, struct machine *machine);

#endif
