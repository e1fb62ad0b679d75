/* firmware/linux/service/recording.h - what happens at every tick of a service,
 * as a file: MCAP or CSV by the end of its name (docs/RECORDINGS.md).
 *
 *   OFF --start--> ON --stop asked for--> ENDING --written--> ENDED --> OFF
 *
 * The tick puts a row into a ring while it is ON, and never waits: a disk that
 * blocks, or is full, costs rows, which are counted.  A thread of its own takes
 * them out and writes them, a second of them at a time, so that after a kill the
 * file is whole up to its last second.  Files are new ones, in one directory that
 * whoever has begun the service has named. */
#ifndef FIRMWARE_LINUX_SERVICE_RECORDING_H
#define FIRMWARE_LINUX_SERVICE_RECORDING_H

#include <pthread.h>

#include "firmware/host/recording/record.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/machine/machine.h"
#include "firmware/linux/player/recorder.h"

#define SERVICE_RECORDING_NAME_MAX 100
#define SERVICE_RECORDING_TEXT_MAX 256

enum service_recording_turn {
    SERVICE_RECORDING_OFF,
    SERVICE_RECORDING_ON,
    SERVICE_RECORDING_ENDING,
    SERVICE_RECORDING_ENDED,
};

/* What it says of itself; the texts outlive it. */
struct service_recording_about {
    const char *rig_path, *rig_text;
    size_t rig_length;
    const char *move_title, *move_text; /* NULL: none is loaded */
};

struct service_recording {
    const char *directory; /* NULL: there is none, so nothing is recorded */
    const struct rig *rig;
    struct hal_clock *clock;
    _Atomic int turn;
    char name[SERVICE_RECORDING_NAME_MAX]; /* of the file; the last one's */

    /* the tick's, and through the ring to the thread */
    struct recorder recorder;
    struct memory_pool memory;
    struct telemetry_row row;
    int64_t start_ns;

    /* the thread's; notes of others under the lock */
    pthread_t thread;
    pthread_mutex_t lock;
    struct output output;
    bool is_mcap;
    struct record record;
    struct telemetry telemetry;
    uint32_t first;        /* number of its first row in the ring */
    _Atomic uint64_t rows; /* taken */
    uint64_t rows_lost;    /* once ENDED: in the ring and on the disk */
    bool failed;           /* the same: it is not complete */
};

/* Before the tick runs.  directory: outlives it; NULL: none. */
void service_recording_init(struct service_recording *self,
                            const char *directory, const struct rig *rig,
                            struct hal_clock *clock);
void service_recording_free(struct service_recording *self);

/* The tick's, after each. */
void service_recording_tick(struct service_recording *self,
                            const struct machine *machine, int64_t now_ns,
                            int64_t late_ns);

/* Not the tick's: */

/* MOTION_OK, or MOTION_E_STATE (one is on), MOTION_E_ARG (no name for one) or
 * MOTION_E_IO, with a sentence; nothing is left behind then. */
int service_recording_start(struct service_recording *self, const char *name,
                            const struct service_recording_about *about,
                            char text[SERVICE_RECORDING_TEXT_MAX]);
/* A name by the time that it is: "rig-20261126T034150Z.mcap". */
void service_recording_name(char name[SERVICE_RECORDING_NAME_MAX]);
/* MOTION_E_STATE: none is on. */
int service_recording_stop(struct service_recording *self);
/* True, once: it has ended. */
bool service_recording_ended(struct service_recording *self);
/* A line in the log of the recording, if one is on: of what was at now_ns. */
void service_recording_note(struct service_recording *self, int64_t now_ns,
                            enum record_level level, const char *words);

#endif
