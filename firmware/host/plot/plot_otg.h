/* firmware/host/plot/plot_otg.h - a planned motion as a picture.
 *
 * One column per axis: position, velocity, acceleration and jerk against time,
 * what lies beyond a limit shaded, a dotted line where a phase ends, and above
 * each column a strip whose colours say what the phase does. */
#ifndef FIRMWARE_HOST_PLOT_PLOT_OTG_H
#define FIRMWARE_HOST_PLOT_PLOT_OTG_H

#include <stdbool.h>

#include "firmware/host/exchange/otg_rows.h"

/* Phases of constant jerk: point i is the start of phase i, the last one the
 * end of the move. */
struct plot_otg_axis {
    char name[32];
    bool velocity; /* a velocity goal: no limits on the velocity */
    int count;     /* of phases */
    struct otg_point point[MOTION_OTG_PHASES + 1];
    const double *value; /* of the row, OTG_VALUES: the limits are in it */
};

struct plot_otg {
    const char *title, *subtitle;
    int axes;
    struct plot_otg_axis axis[MOTION_SYNC_AXES];
};

/* 0, or -1 with a line on stderr.  `path` ends in .svg or .png. */
int plot_otg_save(const struct plot_otg *move, const char *path);

#endif
