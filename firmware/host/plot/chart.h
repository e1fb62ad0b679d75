/* firmware/host/plot/chart.h - one panel: a box, two scales, lines in it.
 *
 * Drawn with cairo; sizes are pixels.  A panel is `box` on the page, with
 * values low..high upwards and t0..t1 to the right. */
#ifndef FIRMWARE_HOST_PLOT_CHART_H
#define FIRMWARE_HOST_PLOT_CHART_H

#include <cairo.h>
#include <stdbool.h>

struct chart_color {
    double red, green, blue, alpha;
};

struct chart_box {
    double x, y, width, height;
};

/* What a line does within a narrow column of the panel: where it comes in and
 * goes out, its lowest and its highest point. */
struct chart_column {
    double number;
    unsigned count; /* points so far */
    struct chart_point {
        double x, y;
        unsigned at; /* its number in the column */
    } first, low, high, last;
};

struct chart {
    cairo_t *cairo;
    struct chart_box box;
    double t0, t1, low, high;
    /* the line being drawn: the last point put down, the one held back, and the
     * directions in which the line may go on without leaving a point out */
    double last_x, last_y, held_x, held_y;
    double turn_low, turn_high;
    bool drawing, holding;
    struct chart_column column;
};

struct chart_font {
    double size;
    bool bold;
    struct chart_color color;
};

enum chart_align { CHART_LEFT, CHART_CENTRE, CHART_RIGHT };

/* Text whose base line is at y.  Returns its width. */
double chart_text(cairo_t *cairo, const struct chart_font *font, double x,
                  double y, enum chart_align align, const char *text);
void chart_set_color(cairo_t *cairo, const struct chart_color *color);

/* The smallest of 1, 2, 5 times a power of ten that makes at most `most`
 * steps of `range`. */
double chart_step(double range, unsigned most);
/* A tick's label: no more decimals than the step needs, a real minus sign, thin
 * spaces between thousands. */
#define CHART_LABEL_MAX 48
void chart_label(char label[CHART_LABEL_MAX], double value, double step);
/* 1, 1e3, 1e6, ... or 1e-3, ...: what to divide by so that labels stay short;
 * *prefix is "" or "10\u00b3 " and so on. */
double chart_scale(double largest, const char **prefix);

double chart_x(const struct chart *chart, double t);
double chart_y(const struct chart *chart, double value);

/* Horizontal lines and their labels, in units of `scale`. */
void chart_grid_values(const struct chart *chart, const struct chart_font *font,
                       double scale);
/* Vertical lines, labelled below when asked to. */
void chart_grid_times(const struct chart *chart, const struct chart_font *font,
                      bool labels);
/* Fill what is above `from` (or below, when `above` is false), inside the box,
 * and draw the border line. */
void chart_shade(const struct chart *chart, double from, bool above,
                 const struct chart_color *fill,
                 const struct chart_color *line);

/* The same with a line that is not straight, begun below, over the width of the
 * box: instead of its end. */
void chart_shade_line(struct chart *chart, bool above,
                      const struct chart_color *fill,
                      const struct chart_color *line);

/* A line, clipped to the box: begin, points from left to right, end.  Points
 * within a tenth of a pixel of the line without them are left out; so are those
 * of a narrow column that are neither its ends nor its extremes, as a stroke
 * costs cairo the square of its points. */
void chart_line_begin(struct chart *chart);
void chart_line_to(struct chart *chart, double t, double value);
/* Put down what is held back; chart_line_end does. */
void chart_line_flush(struct chart *chart);
void chart_line_end(struct chart *chart, const struct chart_color *color,
                    double width);
/* A disc with a white heart at a key. */
void chart_marker(const struct chart *chart, double t, double value,
                  double radius, const struct chart_color *color);
void chart_vertical(const struct chart *chart, double t,
                    const struct chart_color *color);
/* A short stroke down from the upper edge. */
void chart_notch(const struct chart *chart, double t, double length,
                 const struct chart_color *color);
void chart_frame(const struct chart *chart, const struct chart_color *color);

#endif
