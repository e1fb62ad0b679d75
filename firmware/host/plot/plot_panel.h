/* firmware/host/plot/plot_panel.h - one panel of a picture: a quantity of an axis
 * over time, with its limits, keys and shots. */
#ifndef FIRMWARE_HOST_PLOT_PLOT_PANEL_H
#define FIRMWARE_HOST_PLOT_PLOT_PANEL_H

#include "firmware/host/job/job.h"
#include "firmware/host/plot/chart.h"
#include "firmware/host/recording/trace.h"

/* What a panel shows: the four quantities, then the following error. */
enum plot_row {
    PLOT_POS,
    PLOT_VEL,
    PLOT_ACC,
    PLOT_JERK,
    PLOT_FOLLOWING,
    PLOT_ROWS_MAX
};

struct plot {
    cairo_t *cairo;
    const struct job *job;
    const struct trace *trace; /* NULL: none */
    unsigned rows, columns, bands;
    double width, height; /* page */
    double column_width;  /* of a panel, without its labels */
    double end_s;
};

/* One panel while it is drawn. */
struct plot_panel {
    struct plot *plot;
    unsigned axis; /* of the move */
    enum plot_row row;
    struct chart chart;
    double min, max; /* of what is drawn */
    double peak;     /* of what was planned, or demanded */
    double limit_low, limit_high;
    bool limited, off_scale;
    double scale;
    const char *prefix;
};

/* Planned curves and what a run was, point by point, in the axis's unit and
 * seconds: plot_curve.c. */
typedef void plot_point(struct plot_panel *panel, double t, double value);

void plot_track(struct plot_panel *panel, plot_point *point);
void plot_demand(struct plot_panel *panel, plot_point *point);
void plot_actual(struct plot_panel *panel, plot_point *point);
void plot_following(struct plot_panel *panel, plot_point *point);
/* The following error that is allowed. */
void plot_allowed(struct plot_panel *panel, plot_point *point);

/* Extremes, limits and the range that is shown: plot_curve.c. */
void plot_scale(struct plot_panel *panel);

bool plot_is_path(const struct plot_panel *panel);
bool plot_is_warped(const struct plot_panel *panel);
bool plot_has_servo(const struct plot_panel *panel);
const struct motion_track *plot_track_of(const struct plot_panel *panel);

/* Rows of an axis, or of the path, which no servo follows as such. */
unsigned plot_rows(const struct plot *plot, unsigned axis);
bool plot_has_shots(const struct plot *plot);
void plot_draw_panel(struct plot *plot, unsigned axis, unsigned row,
                     const struct chart_box *box);

#endif
