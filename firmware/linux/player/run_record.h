/* firmware/linux/player/run_record.h - the recording of a run, as a file
 * (firmware/host/recording/record.h).
 *
 * It has its own name from the beginning and is only ever appended to, so that
 * other programs can follow it; a recording that is there already is not
 * replaced. */
#ifndef FIRMWARE_LINUX_PLAYER_RUN_RECORD_H
#define FIRMWARE_LINUX_PLAYER_RUN_RECORD_H

#include "firmware/host/recording/record.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/player/report.h"
#include "hal/clock.h"

/* Move files above this are not attached: compiled ones may be of any
 * length. */
#define RUN_RECORD_ATTACH_MAX (16 << 20)

struct run_record {
    struct record record;
    struct output output;
    const struct report *report;
    bool begun, fault_noted;
    uint64_t faults; /* of a fault script, in force at the row before */
};

/* 0, or -1 with a line on stderr.  run_record_free in either case. */
int run_record_open(struct run_record *self, const char *path);
void run_record_free(struct run_record *self);

/* The header and what was planned.  `start_ns` is t_ns = 0 on the clock; NULL:
 * virtual time, which begins with 0. */
void run_record_begin(struct run_record *self, const struct job *job,
                      const struct report *report, struct hal_clock *clock,
                      int64_t start_ns);
void run_record_take(struct run_record *self, const struct telemetry_row *row);
/* How it ended; 0, or -1 with a line on stderr.  rows_lost is known then. */
int run_record_end(struct run_record *self);

#endif
