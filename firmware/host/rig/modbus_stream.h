/* firmware/host/rig/modbus_stream.h - can an axis be streamed over Modbus, and
 * how far may it be off?
 *
 * Added up from what is known when the rig is loaded: v the speed, a the axis's
 * acceleration, A the drive's ramps, t the tick, T the cycle of its line, l the
 * latency, r a count, q a step of the drive's speed, tau of
 * hal/drive/modbus/drive.h.
 *
 *   v (T / 2 + t)         between two set points the drive is on its own; T with
 *                         hard ramps and no speed, for it goes there at once
 *   a (t + T + l)^2 A / 2 (A - a)
 *                         an acceleration that begins is so much late, and the lag
 *                         that this leaves is taken back by A - a
 *   2 r                   a count in what is asked for and in what is read
 *   2 q tau               half the limit cycle of the speed's quantiser, or v (2 T +
 *                         l), by which it can run ahead; none where the position
 *                         does the work
 *
 * The sum must be an allowed following error at every speed: as both are
 * straight lines in v with one bend, at full speed and where the floor is
 * left. */
#ifndef FIRMWARE_HOST_RIG_MODBUS_STREAM_H
#define FIRMWARE_HOST_RIG_MODBUS_STREAM_H

#include <stdbool.h>
#include <stdio.h>

#include "firmware/host/base/messages.h"
#include "firmware/host/rig/rig.h"

/* The drive as machine.c makes it. */
void modbus_stream_config(const struct rig *rig, unsigned i,
                          struct drive_modbus_config *config);
/* Of a streamed axis; false, with a message, when it cannot be. */
bool modbus_stream_check(const struct rig *rig, unsigned i, const char *path,
                         struct messages *messages);
/* A line on ramps that are steeper than the axis has any use for, if they
 * are. */
void modbus_stream_print(const struct rig *rig, unsigned i, FILE *file);

#endif
