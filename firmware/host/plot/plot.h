/* firmware/host/plot/plot.h - a move as a picture: p, v, a, j of every axis.
 *
 * One column per axis, at most four side by side, then another band below.
 * Rows: position, velocity, acceleration, jerk; with a trace also what the
 * servo did and the following error.  What lies beyond a limit is shaded; a
 * limit far above the curve is left off the scale and the panel says so. */
#ifndef FIRMWARE_HOST_PLOT_PLOT_H
#define FIRMWARE_HOST_PLOT_PLOT_H

#include "firmware/host/job/job.h"
#include "firmware/host/plot/plot_page.h"
#include "firmware/host/recording/trace.h"

/* `trace` NULL: the plan alone.  As plot_page_write. */
int plot_write(const struct job *job, const struct trace *trace,
               enum plot_format format, FILE *file, struct messages *messages);

#endif
