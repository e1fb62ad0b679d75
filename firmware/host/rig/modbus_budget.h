/* firmware/host/rig/modbus_budget.h - how often a streamed Modbus axis really
 * gets a set point.
 *
 * A line has no tick: its drives take turns, each with its set point, what
 * makes that count, and its polls, and the sum of these times is the cycle.
 * Computed from bits, silences and turn-around times. */
#ifndef FIRMWARE_HOST_RIG_MODBUS_BUDGET_H
#define FIRMWARE_HOST_RIG_MODBUS_BUDGET_H

#include <stdio.h>

#include "firmware/host/base/messages.h"
#include "firmware/host/rig/rig.h"

/* The line as it is used: its silence is the longest that it, the standard or
 * a drive on it asks for. */
struct modbus_rtu_line modbus_budget_line(const struct rig *rig, unsigned bus);
/* Of one axis: its own share of the cycle. */
int64_t modbus_budget_share_ns(const struct rig *rig, unsigned axis,
                               unsigned *transactions);
/* From one set point to the next, for every axis on the bus. */
int64_t modbus_budget_cycle_ns(const struct rig *rig, unsigned bus);
/* From a set point's tick until the drive has it. */
int64_t modbus_budget_latency_ns(const struct rig *rig, unsigned bus);
/* The longest time-out that a drive on it asks for, or the rig's. */
int64_t modbus_budget_timeout_ns(const struct rig *rig, unsigned bus);
/* Point to point: from when the profile of the drive should be over until the
 * next key.  What the rig gives, or what the line takes for it and 100 ms. */
int64_t modbus_budget_settle_ns(const struct rig *rig, unsigned axis);
/* Feedback older than this is stale: two transactions may fail. */
int64_t modbus_budget_age_ns(const struct rig *rig, unsigned bus);

/* "pan: a set point every 36.3 ms (27.6 per s)"; point to point, that the path
 * between keys is the drive's own, and what it would get if it were
 * streamed. */
void modbus_budget_print(const struct rig *rig, unsigned bus, FILE *file);
/* false, with a message for each axis whose set points come too seldom
 * for its speed and its following error. */
bool modbus_budget_check(const struct rig *rig, const char *path,
                         struct messages *messages);

#endif
