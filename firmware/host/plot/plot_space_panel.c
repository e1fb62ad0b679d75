/* firmware/host/plot/plot_space_panel.c - see plot_space_panel.h. */
#include "firmware/host/plot/plot_space_panel.h"

#include <math.h>

#include "firmware/host/plot/plot_style.h"

#define CARRIED_ALPHA 0.25 /* of a moment before the last */
#define CARRIED_DISC  3.5  /* pixels, of a weight */

static double space_dot(const double a[3], const struct space_point *b)
{
    return a[0] * b->x[0] + a[1] * b->x[1] + a[2] * b->x[2];
}

void space_include(struct space_panel *panel, const struct space_point *point)
{
    struct chart *chart = &panel->chart;
    const double x = space_dot(panel->view->across, point),
                 y = space_dot(panel->view->over, point);

    if (panel->is_empty) {
        chart->t0 = chart->t1 = x;
        chart->low = chart->high = y;
    }
    panel->is_empty = false;
    chart->t0 = fmin(chart->t0, x);
    chart->t1 = fmax(chart->t1, x);
    chart->low = fmin(chart->low, y);
    chart->high = fmax(chart->high, y);
}

void space_to(const struct space_panel *panel, const struct space_point *point,
              bool is_first)
{
    const double x =
        chart_x(&panel->chart, space_dot(panel->view->across, point));
    const double y =
        chart_y(&panel->chart, space_dot(panel->view->over, point));

    if (is_first)
        cairo_move_to(panel->chart.cairo, x, y);
    else
        cairo_line_to(panel->chart.cairo, x, y);
}

void space_stroke(const struct space_panel *panel,
                  const struct chart_color *color, double alpha, double width)
{
    const struct chart_color shade = { color->red, color->green, color->blue,
                                       alpha };

    chart_set_color(panel->chart.cairo, &shade);
    cairo_set_line_width(panel->chart.cairo, width);
    cairo_stroke(panel->chart.cairo);
}

void space_mark(const struct space_panel *panel,
                const struct space_point *point,
                const struct chart_color *color)
{
    chart_marker(&panel->chart, space_dot(panel->view->across, point),
                 space_dot(panel->view->over, point), 4.5, color);
}

/* ---- what axes carry ---- */

static struct space_point carried_point(const struct plot_film_point *at)
{
    return (struct space_point){ { at->x, at->y, at->z } };
}

static const struct plot_film_point *
carried_at(const struct plot_film_thing *thing, unsigned moment)
{
    return thing->point + (size_t)moment * thing->points;
}

void space_include_carried(struct space_panel *panel,
                           const struct plot_film *film)
{
    for (unsigned t = 0; t < film->things; t++)
        for (unsigned i = 0; i < film->moments * film->thing[t].points; i++) {
            const struct space_point at =
                carried_point(&film->thing[t].point[i]);
            space_include(panel, &at);
        }
}

/* `count` points, `stride` apart. */
static void carried_line(const struct space_panel *panel,
                         const struct plot_film_point *from, unsigned count,
                         unsigned stride)
{
    for (unsigned i = 0; i < count; i++) {
        const struct space_point at = carried_point(&from[(size_t)i * stride]);
        space_to(panel, &at, i == 0);
    }
}

static void carried_disc(const struct space_panel *panel,
                         const struct plot_film_point *from, double radius_m,
                         double alpha)
{
    const struct chart *const chart = &panel->chart;
    const double per_m = chart->box.width / (chart->t1 - chart->t0);
    const struct space_point at = carried_point(from);
    const struct chart_color shade = { plot_shot.red, plot_shot.green,
                                       plot_shot.blue, alpha };

    space_to(panel, &at, true);
    double x, y;
    cairo_get_current_point(chart->cairo, &x, &y);
    cairo_new_path(chart->cairo);
    chart_set_color(chart->cairo, &shade);
    cairo_arc(chart->cairo, x, y, fmax(CARRIED_DISC, radius_m * per_m), 0,
              6.283185307179586);
    cairo_fill(chart->cairo);
}

static void carried_moment(const struct space_panel *panel,
                           const struct plot_film_thing *thing, unsigned moment,
                           double alpha)
{
    const struct plot_film_point *const at = carried_at(thing, moment);
    const bool ball = thing->radius_m > 0;

    if (thing->columns == 0) {
        carried_line(panel, at, thing->points - ball, 1);
        space_stroke(panel, &plot_shot, alpha, 1.6);
        carried_disc(panel, &at[thing->points - 1], thing->radius_m, alpha);
        return;
    }
    for (unsigned c = 0; c < thing->columns; c++)
        carried_line(panel, at + (size_t)c * thing->rows, thing->rows, 1);
    for (unsigned r = 0; r < thing->rows; r++)
        carried_line(panel, at + r, thing->columns, thing->rows);
    space_stroke(panel, &plot_shot, 0.6 * alpha, 0.7);
}

void space_draw_carried(const struct space_panel *panel,
                        const struct plot_film *film)
{
    for (unsigned t = 0; t < film->things; t++)
        for (unsigned m = 0; m < film->moments; m++)
            carried_moment(panel, &film->thing[t], m,
                           m + 1 == film->moments ? 1 : CARRIED_ALPHA);
}
