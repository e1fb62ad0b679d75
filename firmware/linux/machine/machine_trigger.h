/* firmware/linux/machine/machine_trigger.h - the trigger lines of a machine. */
#ifndef FIRMWARE_LINUX_MACHINE_MACHINE_TRIGGER_H
#define FIRMWARE_LINUX_MACHINE_MACHINE_TRIGGER_H

#include "firmware/linux/machine/machine.h"
#include "motion/plan/shoot/plan_event.h"

/* One per line of kind trigger, with nothing to do. */
int machine_trigger_init(struct machine *machine);
/* The most that a line is ahead of its events, ns. */
int64_t machine_trigger_lead_ns(const struct machine *machine);
/* Before a move: its shots, by line of the rig.  The run-up begins: the move is
 * to start at start_ns, at that rate, and what leads the way is fired
 * before. */
void machine_trigger_arm(struct machine *machine,
                         const struct plan_shots shots[], int64_t start_ns,
                         int64_t rate_q30);
/* The move has started, and its clock counts. */
void machine_trigger_go(struct machine *machine);
/* After the controller's step: what the path's time asks for. */
void machine_trigger_step(struct machine *machine, int64_t now_ns);
bool machine_trigger_is_idle(const struct machine *machine);
/* No more shots; a pulse goes on to its end. */
void machine_trigger_disarm(struct machine *machine);
/* No more shots, and no pulse goes on. */
void machine_trigger_end(struct machine *machine);

#endif
