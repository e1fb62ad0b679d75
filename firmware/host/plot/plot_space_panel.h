/* firmware/host/plot/plot_space_panel.h - private to plot_space*.c: points in space
 * in one view, and what axes carry there. */
#ifndef FIRMWARE_HOST_PLOT_PLOT_SPACE_PANEL_H
#define FIRMWARE_HOST_PLOT_PLOT_SPACE_PANEL_H

#include "firmware/host/plot/chart.h"
#include "firmware/host/plot/plot_film.h"

struct space_point {
    double x[3]; /* m */
};

/* How a view projects: to the right and upwards. */
struct space_view {
    const char *name;
    const char *right, *up; /* of its axes; NULL: no scale */
    double across[3], over[3];
    struct chart_box box;
};

struct space_panel {
    const struct space_view *view;
    struct chart chart;
    bool is_empty;
};

/* So that it is within the scales. */
void space_include(struct space_panel *panel, const struct space_point *point);

/* A line from point to point, and what it is drawn with. */
void space_to(const struct space_panel *panel, const struct space_point *point,
              bool is_first);
void space_stroke(const struct space_panel *panel,
                  const struct chart_color *color, double alpha, double width);

void space_mark(const struct space_panel *panel,
                const struct space_point *point,
                const struct chart_color *color);

/* All moments of what axes carry; the last one as strong as the rest together. */
void space_include_carried(struct space_panel *panel,
                           const struct plot_film *film);
void space_draw_carried(const struct space_panel *panel,
                        const struct plot_film *film);

#endif
