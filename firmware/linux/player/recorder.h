/* firmware/linux/player/recorder.h - from the tick to everyone who looks on.
 *
 * A ring of rows with one writer, the loop, and one reader, another thread or
 * (in virtual time) the loop between ticks.  Neither waits for the other: when
 * the ring is full the row is dropped and counted. */
#ifndef FIRMWARE_LINUX_PLAYER_RECORDER_H
#define FIRMWARE_LINUX_PLAYER_RECORDER_H

#include <stdatomic.h>
#include <stdint.h>

#include "firmware/host/recording/telemetry.h"
#include "firmware/linux/machine/machine.h"

#define RECORDER_ROWS 2048 /* two seconds at 1 kHz */

struct recorder {
    struct memory_pool memory; /* of the rows' axes and shots */
    unsigned axis_count, bus_count;
    _Atomic uint64_t put, taken; /* rows ever */
    uint64_t dropped;            /* the writer's */
    struct telemetry_row row[RECORDER_ROWS];
};

/* For rows of this rig; all zero, or one that was made before and is given
 * back. */
void recorder_init(struct recorder *recorder, const struct rig *rig);
void recorder_free(struct recorder *recorder);
/* What the axes were told and did at the last tick, into a row that has its
 * phase and its place for them; no shots. */
void recorder_look(struct telemetry_row *row, const struct machine *machine);
/* The shots of that tick, at times since start_ns. */
void recorder_look_shots(struct telemetry_row *row,
                         const struct machine *machine, int64_t start_ns);
/* The writer's.  The row gets its number, from 0, in which lost ones count.
 * False: full, the row is lost. */
bool recorder_put(struct recorder *recorder, const struct telemetry_row *row);
/* Rows that wait. */
uint64_t recorder_waiting(const struct recorder *recorder);
/* The reader's: hand all rows that are there to `take`, oldest first; it may
 * change them. */
void recorder_drain(struct recorder *recorder,
                    void (*take)(void *context, struct telemetry_row *row),
                    void *context);

#endif
