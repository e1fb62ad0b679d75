/* firmware/host/plot/plot_spread.h - how far the results of many runs spread.
 *
 * One row per result: a histogram of it, then its values against those of what
 * was varied.  Runs that did not end well are drawn in another colour. */
#ifndef FIRMWARE_HOST_PLOT_PLOT_SPREAD_H
#define FIRMWARE_HOST_PLOT_PLOT_SPREAD_H

#include <stdbool.h>

#include "firmware/host/plot/plot_page.h"

struct plot_spread_column {
    const char *name;
    const double *value; /* of each run */
};

struct plot_spread {
    const char *title, *subtitle;
    const struct plot_spread_column *result, *cause;
    unsigned results, causes; /* results >= 1 */
    unsigned runs;            /* >= 1 */
    const bool *is_bad;       /* of each run */
};

/* As plot_page_write. */
int plot_spread_write(const struct plot_spread *spread, enum plot_format format,
                      FILE *file, struct messages *messages);

#endif
