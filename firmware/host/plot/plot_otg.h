/* firmware/host/plot/plot_otg.h - a planned motion as a picture.
 *
 * One column per axis: position, velocity, acceleration and jerk against time,
 * what lies beyond a limit shaded, a dotted line where a phase ends, and above
 * each column a strip whose colours say what the phase does. */
#ifndef FIRMWARE_HOST_PLOT_PLOT_OTG_H
#define FIRMWARE_HOST_PLOT_PLOT_OTG_H

#include "firmware/host/exchange/otg_motion.h"

/* 0, or -1 with a line on stderr.  `path` ends in .svg or .png. */
int plot_otg_save(const struct otg_motion *motion, const char *title,
                  const char *subtitle, const char *path);

#endif
