/* firmware/host/rig/turns_budget.h - what a drive that counts turns (ODrive,
 * moteus) has on its CAN bus per tick.  Part of budget.h. */
#ifndef FIRMWARE_HOST_RIG_TURNS_BUDGET_H
#define FIRMWARE_HOST_RIG_TURNS_BUDGET_H

#include "firmware/host/rig/rig.h"

/* A frame that comes every period_ns.  Bits of an FD frame's data count as
 * those bits of bit_rate that take as long. */
struct turns_frame {
    const char *what;
    int64_t period_ns;
    double bits; /* at most */
};

#define TURNS_FRAMES_MAX 4

struct motion_state;

/* Of axis i; returns how many. */
unsigned turns_budget_frames(const struct rig *rig, unsigned i,
                             struct turns_frame frame[TURNS_FRAMES_MAX]);

/* What they have while the axis is in that state, in the mean: feedback is
 * taken to be the set point, and an ODrive to say its position by itself every
 * 10 ms, as it is delivered. */
void turns_budget_expect(const struct rig *rig, unsigned i,
                         const struct motion_state *state,
                         double bits[TURNS_FRAMES_MAX]);

/* From a tick until the drive has its set point: behind those of the axes
 * before it on the bus, and behind the questions of this tick. */
int64_t turns_budget_latency_ns(const struct rig *rig, unsigned i);
/* Of an answer with a position on the wire. */
int64_t turns_budget_answer_ns(const struct rig *rig, unsigned i);

#endif
