/* firmware/host/kind/turn/budget.h - what drives that count turns have on their
 * CAN bus per tick: what their kinds share, for struct rig_kind's frames and
 * expect. */
#ifndef FIRMWARE_HOST_KIND_TURN_BUDGET_H
#define FIRMWARE_HOST_KIND_TURN_BUDGET_H

#include "firmware/host/rig/rig.h"
#include "hal/can.h"
#include "hal/drive/turn/drive.h"

/* Of the longest frame with so many bytes. */
double turn_classic_bits(unsigned bytes);
double turn_fd_bits(const struct rig_bus *bus, unsigned bytes);
/* Of this one. */
double turn_frame_bits(const struct rig_bus *bus,
                       const struct hal_can_frame *frame);

struct drive_turn_point turn_point_of(const struct rig_axis *axis,
                                      const struct motion_state *state);
/* Position and velocity, as all of them say them. */
void turn_put_estimates(uint8_t at[8], const struct drive_turn_point *point);

/* From a tick until the drive of axis i has its set point: behind those of the
 * axes before it on the bus, and behind the questions of this tick. */
int64_t turn_budget_latency_ns(const struct rig *rig, unsigned i);
/* Of an answer with a position on the wire. */
int64_t turn_budget_answer_ns(const struct rig *rig, unsigned i);

#endif
