/* firmware/host/plot/plot_style.h - sizes, colours and letters of every
 * picture. */
#ifndef FIRMWARE_HOST_PLOT_PLOT_STYLE_H
#define FIRMWARE_HOST_PLOT_PLOT_STYLE_H

#include "firmware/host/plot/chart.h"

/* Sizes of the page in pixels. */
#define PLOT_MARGIN  44
#define PLOT_HEAD    104 /* title, subtitle, legend */
#define PLOT_NAME    40  /* the axis's name above its column */
#define PLOT_ROW     150 /* a panel */
#define PLOT_ROW_GAP 40  /* with the next panel's heading in it */
#define PLOT_FOOT    46  /* time labels */
#define PLOT_TICKS   62  /* value labels, left of a panel */
#define PLOT_GAP     34  /* between columns */
#define PLOT_COLUMNS 4

/* Okabe and Ito's colours: told apart by the colour-blind. */
static const struct chart_color plot_plan = { 0.000, 0.447, 0.698, 1 };
static const struct chart_color plot_servo = { 0.902, 0.624, 0.000, 1 };
static const struct chart_color plot_error = { 0.835, 0.369, 0.000, 1 };
static const struct chart_color plot_nominal = { 0.60, 0.63, 0.67, 1 };
static const struct chart_color plot_beyond = { 0.800, 0.475, 0.655, 0.16 };
static const struct chart_color plot_limit = { 0.800, 0.475, 0.655, 0.9 };
static const struct chart_color plot_key = { 0.000, 0.447, 0.698, 0.55 };
static const struct chart_color plot_shot = { 0.000, 0.620, 0.451, 0.9 };
static const struct chart_color plot_frame = { 0.45, 0.47, 0.50, 1 };

#define PLOT_INK                                                               \
    {                                                                          \
        0.13, 0.15, 0.18, 1                                                    \
    }
#define PLOT_SOFT                                                              \
    {                                                                          \
        0.42, 0.45, 0.49, 1                                                    \
    }
static const struct chart_font plot_title = { 23, true, PLOT_INK };
static const struct chart_font plot_subtitle = { 14, false, PLOT_SOFT };
static const struct chart_font plot_name = { 18, true, PLOT_INK };
static const struct chart_font plot_heading = { 13, true, PLOT_INK };
static const struct chart_font plot_note = { 12, false, PLOT_SOFT };
static const struct chart_font plot_tick = { 12, false, PLOT_SOFT };

#endif
