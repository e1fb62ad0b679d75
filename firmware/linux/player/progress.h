/* firmware/linux/player/progress.h - how far a run has come, for whoever
 * waits.
 *
 * On a terminal one line, redrawn in place ten times a second of real time;
 * elsewhere a few plain lines, one per phase and per quarter of the move.  What rows
 * warn of (firmware/host/recording/row_notes.h) is a line of its own. */
#ifndef FIRMWARE_LINUX_PLAYER_PROGRESS_H
#define FIRMWARE_LINUX_PLAYER_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "firmware/host/recording/row_notes.h"

struct progress {
    FILE *file;
    bool terminal, drawn;
    int64_t due_ns;    /* real time of the next redraw */
    int64_t total_ns;  /* of the move */
    int phase;         /* last one seen; -1: none */
    int quarter;       /* last one said */
    unsigned skipped;  /* rows since the clock was looked at */
    const char *typed; /* what the operator is typing, at its end; NULL */
    struct row_notes notes;
};

/* progress_end in the end. */
void progress_init(struct progress *progress, FILE *file, const struct rig *rig,
                   int64_t total_ns_q12);
void progress_take(struct progress *progress, const struct telemetry_row *row);
/* The line goes. */
void progress_end(struct progress *progress);

/* A rate of the clock, 0 .. 200 %, to the nearest percent. */
int progress_percent(int64_t rate_q30);

#endif
