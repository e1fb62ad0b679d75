/* firmware/host/plot/plot_fit.h - a recording beside a model of it, before and
 * after the model was fitted.
 *
 * A column per axis: the following error as it was recorded and as both models
 * have it, then what each leaves of it. */
#ifndef FIRMWARE_HOST_PLOT_PLOT_FIT_H
#define FIRMWARE_HOST_PLOT_PLOT_FIT_H

#include <stdint.h>

#include "firmware/host/plot/plot_page.h"

struct plot_fit_axis {
    const char *name, *unit;
    uint32_t rows; /* >= 2 */
    double period_s;
    const double *recorded, *before, *after; /* following errors */
};

struct plot_fit {
    const char *title, *subtitle;
    const struct plot_fit_axis *axis;
    unsigned axes; /* >= 1 */
};

/* As plot_page_write. */
int plot_fit_write(const struct plot_fit *fit, enum plot_format format,
                   FILE *file, struct messages *messages);

#endif
