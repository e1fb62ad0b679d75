/* firmware/host/plot/plot.h - a move as a picture: p, v, a, j of every axis.
 *
 * One column per axis, at most four side by side, then another band below.
 * Rows: position, velocity, acceleration, jerk; with a trace also what the
 * servo did and the following error.  What lies beyond a limit is shaded; a
 * limit far above the curve is left off the scale and the panel says so. */
#ifndef FIRMWARE_HOST_PLOT_PLOT_H
#define FIRMWARE_HOST_PLOT_PLOT_H

#include "firmware/host/move/job.h"
#include "firmware/host/plot/plot_page.h"
#include "firmware/host/recording/trace.h"

/* Into a file that is there whole or not at all; `trace` NULL: the plan alone.
 * 0, or -1 with a line on stderr. */
int plot_save(const struct job *job, const struct trace *trace,
              const char *path);

#endif
