/* firmware/host/recording/trace.h - the course of a run, small enough to draw.
 *
 * Keeps at most TRACE_POINTS points however long the run: when they are full,
 * neighbours are merged.  Each point holds the smallest and largest following
 * error since the one before, the one that was nearest to its limit and the least
 * limit, so no peak is lost. */
#ifndef FIRMWARE_HOST_RECORDING_TRACE_H
#define FIRMWARE_HOST_RECORDING_TRACE_H

#include <stdbool.h>
#include <stddef.h>

#include "firmware/host/recording/telemetry.h"

#define TRACE_POINTS 8192
#define TRACE_SHOTS  4096 /* triggers; later ones are not drawn */

struct trace_axis {
    double demand[4]; /* p, v, a, j */
    double actual, actual_vel;
    double following_min, following_max;
    double worst, worst_allowed; /* |following error| and the limit then */
    double allowed;
};

struct trace {
    size_t count;
    unsigned stride, pending; /* rows per point; rows in the last point */
    const struct rig *rig;
    int64_t start_ns; /* run time of the last row before the move */
    bool warped;      /* the move was not played at 100 % throughout */
    double end_s;
    double t_s[TRACE_POINTS];   /* from the start of the move */
    double shot_s[TRACE_SHOTS]; /* when triggers were fired */
    size_t shots;
    struct trace_axis *point; /* TRACE_POINTS rows of axis_count */
};

/* The rig stays the caller's. */
void trace_init(struct trace *trace, const struct rig *rig);
void trace_free(struct trace *trace);
/* Rows of the move and of settling after it; others are passed over.  `context`
 * is the trace: the form that telemetry_read takes. */
void trace_take(void *context, const struct telemetry_row *row);
const struct trace_axis *trace_at(const struct trace *trace, size_t index,
                                  unsigned axis);

#endif
