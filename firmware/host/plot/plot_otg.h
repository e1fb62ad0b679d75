/* firmware/host/plot/plot_otg.h - a planned motion as a picture.
 *
 * One column per axis: position, velocity, acceleration and jerk against time,
 * what lies beyond a limit shaded, a dotted line where a phase ends, and above
 * each column a strip whose colours say what the phase does. */
#ifndef FIRMWARE_HOST_PLOT_PLOT_OTG_H
#define FIRMWARE_HOST_PLOT_PLOT_OTG_H

#include "firmware/host/exchange/otg_motion.h"
#include "firmware/host/plot/plot_page.h"

/* As plot_page_write. */
int plot_otg_write(const struct otg_motion *motion, const char *title,
                   const char *subtitle, enum plot_format format, FILE *file,
                   struct messages *messages);

#endif
