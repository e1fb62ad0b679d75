/* firmware/host/exchange/export_keys.h - a track as keys with a velocity on
 * either side, for programs that have cubics.
 *
 * A track of cubics is keys at its borders, exactly; one that has higher
 * degrees gets a key per frame with its velocity there, an approximation. */
#ifndef FIRMWARE_HOST_EXCHANGE_EXPORT_KEYS_H
#define FIRMWARE_HOST_EXCHANGE_EXPORT_KEYS_H

#include "firmware/host/base/units.h"
#include "motion/core/track.h"

struct export_key {
    int64_t t_ns_q12, pos_q32;
    int64_t in_q32, out_q32; /* velocity, unit/s */
};

struct export_keys {
    struct export_key *key; /* on the heap: memory_free */
    uint32_t count;         /* at least 1 */
};

struct export_keys export_keys_of(const struct motion_track *track,
                                  const struct units_fps *fps);

#endif
