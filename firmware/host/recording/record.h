/* firmware/host/recording/record.h - a run as an MCAP file: what happened at
 * every tick, in a form that other programs plot (docs/RECORDINGS.md).
 *
 *   /run         phase, state, place on the path, lateness of the tick
 *   /axes/NAME   the numbers and the statusword of telemetry.h
 *   /shots/NAME  what a trigger line fired
 *   /log         phases, events of the drives, warnings, faults (foxglove.Log)
 *
 * All messages are JSON and have the time of their tick.  Rows of one second at
 * most are handed over together, whole or not at all; what cannot be written is
 * counted. */
#ifndef FIRMWARE_HOST_RECORDING_RECORD_H
#define FIRMWARE_HOST_RECORDING_RECORD_H

#include "firmware/host/recording/mcap_writer.h"
#include "firmware/host/recording/row_notes.h"
#include "firmware/host/recording/telemetry.h"

#define RECORD_TOPIC_RUN   "/run"
#define RECORD_TOPIC_LOG   "/log"
#define RECORD_TOPIC_AXIS  "/axes/"
#define RECORD_TOPIC_SHOTS "/shots/"

/* Metadata: how it was planned, how it ended. */
#define RECORD_PLAN "slew.plan"
#define RECORD_END  "slew.end"
/* Keys and values of either, at most, each with its 0. */
#define RECORD_PAIRS_MAX 16
#define RECORD_TEXT_MAX  512

/* Of foxglove.Log. */
enum record_level {
    RECORD_INFO = 2,
    RECORD_WARNING = 3,
    RECORD_ERROR = 4,
};

struct record {
    struct mcap_writer writer;
    const struct rig *rig;
    int64_t epoch_ns; /* the wall clock at t_ns = 0; 0: virtual time */
    uint16_t run, log, first_axis, first_shot; /* channels */
    uint64_t rows_waiting, rows_lost;
    int64_t handed_ns;
    bool begun;
    enum telemetry_phase phase; /* of the row before */
    struct row_notes notes;
};

/* Header, schemas and channels; all zero before, record_free in the end. */
void record_init(struct record *record, FILE *file, const struct rig *rig,
                 int64_t epoch_ns, const char *library);
void record_free(struct record *record);
/* Before the run: a file that it comes from, and what `pair` says of it. */
void record_attach(struct record *record, const char *name, const void *data,
                   size_t size);
void record_plan(struct record *record, const char *const pair[][2],
                 size_t count);

void record_write(struct record *record, const struct telemetry_row *row);
void record_note(struct record *record, int64_t t_ns, enum record_level level,
                 const char *text);
/* False: something could not be written; rows_lost says how much. */
bool record_end(struct record *record, const char *const pair[][2],
                size_t count);

#endif
