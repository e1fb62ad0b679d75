/* firmware/host/plot/chart.c - see chart.h. */
#include "firmware/host/plot/chart.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"

#define CHART_FONT "DejaVu Sans"

static const struct chart_color chart_grid = { 0.90, 0.91, 0.92, 1 };
static const struct chart_color chart_zero = { 0.62, 0.64, 0.67, 1 };
static const struct chart_color chart_white = { 1, 1, 1, 1 };

void chart_set_color(cairo_t *cairo, const struct chart_color *color)
{
    cairo_set_source_rgba(cairo, color->red, color->green, color->blue,
                          color->alpha);
}

static void chart_font(cairo_t *cairo, const struct chart_font *font)
{
    cairo_select_font_face(cairo, CHART_FONT, CAIRO_FONT_SLANT_NORMAL,
                           font->bold ? CAIRO_FONT_WEIGHT_BOLD
                                      : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cairo, font->size);
    chart_set_color(cairo, &font->color);
}

static double chart_text_width(cairo_t *cairo, const struct chart_font *font,
                               const char *text)
{
    cairo_text_extents_t extents;
    chart_font(cairo, font);
    cairo_text_extents(cairo, text, &extents);
    return extents.x_advance;
}

double chart_text(cairo_t *cairo, const struct chart_font *font, double x,
                  double y, enum chart_align align, const char *text)
{
    double width = chart_text_width(cairo, font, text);
    double share = align == CHART_LEFT ? 0 : align == CHART_RIGHT ? 1 : 0.5;
    cairo_move_to(cairo, x - share * width, y);
    cairo_show_text(cairo, text);
    return width;
}

double chart_step(double range, unsigned most)
{
    static const double nice[] = { 1, 2, 5, 10 };
    double least = range / most;
    if (!(least > 0) || !isfinite(least))
        return 1;
    double power = pow(10, floor(log10(least)));
    for (unsigned i = 0; i < 3; i++)
        if (nice[i] * power >= least * (1 - 1e-9))
            return nice[i] * power;
    return 10 * power;
}

/* "-12345.5" to "\u221212\u2009345.5" */
static void chart_typeset(char label[CHART_LABEL_MAX], const char *digits)
{
    size_t at = 0;
    if (*digits == '-') {
        at = (size_t)snprintf(label, CHART_LABEL_MAX, "\u2212");
        digits++;
    }
    size_t whole = strcspn(digits, ".");
    for (size_t i = 0; digits[i] != 0 && at + 4 < CHART_LABEL_MAX; i++) {
        if (whole > 4 && i > 0 && i < whole && (whole - i) % 3 == 0)
            at += (size_t)snprintf(label + at, CHART_LABEL_MAX - at, "\u2009");
        label[at++] = digits[i];
    }
    label[at] = 0;
}

void chart_label(char label[CHART_LABEL_MAX], double value, double step)
{
    char digits[32];
    int decimals = (int)fmax(0, ceil(-log10(step) - 1e-9));
    if (fabs(value) < step / 2)
        value = 0;
    snprintf(digits, sizeof digits, "%.*f", decimals > 12 ? 12 : decimals,
             value);
    chart_typeset(label, digits);
}

double chart_scale(double largest, const char **prefix)
{
    static const struct {
        double least, scale;
        const char *prefix;
    } scales[] = {
        { 1e12, 1e12, "10\u00b9\u00b2 " },
        { 1e9, 1e9, "10\u2079 " },
        { 1e6, 1e6, "10\u2076 " },
        { 2e4, 1e3, "10\u00b3 " },
        { 2e-2, 1, "" },
        { 2e-5, 1e-3, "10\u207b\u00b3 " },
        { 0, 1e-6, "10\u207b\u2076 " },
    };
    size_t i = 0;
    while (largest < scales[i].least)
        i++;
    *prefix = scales[i].prefix;
    return scales[i].scale;
}

double chart_x(const struct chart *chart, double t)
{
    double share = (t - chart->t0) / (chart->t1 - chart->t0);
    return chart->box.x + share * chart->box.width;
}

double chart_y(const struct chart *chart, double value)
{
    double share = (value - chart->low) / (chart->high - chart->low);
    return chart->box.y + (1 - share) * chart->box.height;
}

/* Half-pixel places make one-pixel lines sharp. */
static double chart_sharp(double at)
{
    return floor(at) + 0.5;
}

static void chart_rule(const struct chart *chart, double x0, double y0,
                       double x1, double y1, const struct chart_color *color)
{
    cairo_set_line_width(chart->cairo, 1);
    chart_set_color(chart->cairo, color);
    cairo_move_to(chart->cairo, x0, y0);
    cairo_line_to(chart->cairo, x1, y1);
    cairo_stroke(chart->cairo);
}

/* The ticks k * step from low to high: the first k, and how many.  Counting
 * from the first keeps 0.1 + 0.2 from adding up. */
static int chart_ticks(double low, double high, double step, double *first)
{
    *first = ceil(low / step - 1e-9);
    return (int)(floor(high / step + 1e-9) - *first) + 1;
}

void chart_grid_values(const struct chart *chart, const struct chart_font *font,
                       double scale)
{
    const struct chart_box *box = &chart->box;
    double step = chart_step((chart->high - chart->low) / scale, 5) * scale;
    double first;
    int count = chart_ticks(chart->low, chart->high, step, &first);
    for (int i = 0; i < count; i++) {
        double k = first + i;
        char label[CHART_LABEL_MAX];
        double y = chart_sharp(chart_y(chart, k * step));
        chart_rule(chart, box->x, y, box->x + box->width, y,
                   k == 0 ? &chart_zero : &chart_grid);
        chart_label(label, k * step / scale, step / scale);
        chart_text(chart->cairo, font, box->x - 7, y + 0.35 * font->size,
                   CHART_RIGHT, label);
    }
}

void chart_grid_times(const struct chart *chart, const struct chart_font *font,
                      bool labels)
{
    const struct chart_box *box = &chart->box;
    double step =
        chart_step(chart->t1 - chart->t0, (unsigned)fmax(2, box->width / 55));
    double first;
    int count = chart_ticks(chart->t0, chart->t1, step, &first);
    for (int i = 0; i < count; i++) {
        double k = first + i;
        char label[CHART_LABEL_MAX];
        double x = chart_sharp(chart_x(chart, k * step));
        chart_rule(chart, x, box->y, x, box->y + box->height, &chart_grid);
        chart_label(label, k * step, step);
        if (labels)
            chart_text(chart->cairo, font, x,
                       box->y + box->height + 6 + font->size, CHART_CENTRE,
                       label);
    }
}

static void chart_clip(const struct chart *chart)
{
    const struct chart_box *box = &chart->box;
    cairo_save(chart->cairo);
    cairo_rectangle(chart->cairo, box->x, box->y, box->width, box->height);
    cairo_clip(chart->cairo);
}

void chart_shade(const struct chart *chart, double from, bool above,
                 const struct chart_color *fill, const struct chart_color *line)
{
    const struct chart_box *box = &chart->box;
    double y = chart_y(chart, from);
    double top = above ? box->y : fmax(y, box->y);
    double bottom =
        above ? fmin(y, box->y + box->height) : box->y + box->height;
    if (bottom <= top)
        return;
    chart_set_color(chart->cairo, fill);
    cairo_rectangle(chart->cairo, box->x, top, box->width, bottom - top);
    cairo_fill(chart->cairo);
    chart_rule(chart, box->x, chart_sharp(y), box->x + box->width,
               chart_sharp(y), line);
}

void chart_line_begin(struct chart *chart)
{
    chart_clip(chart);
    chart->drawing = false;
    chart->holding = false;
    chart->column.count = 0;
}

/* Cairo's numbers are 24.8 fixed point: keep far-off values near the box. */
static double chart_bounded(double y, const struct chart_box *box)
{
    return fmin(fmax(y, box->y - 10 * box->height), box->y + 10 * box->height);
}

#define CHART_TOLERANCE 0.1 /* pixels */

/* Put down the point held back and start a new stretch from it. */
static void chart_line_put(struct chart *chart)
{
    if (!chart->holding)
        return;
    cairo_line_to(chart->cairo, chart->held_x, chart->held_y);
    chart->last_x = chart->held_x;
    chart->last_y = chart->held_y;
    chart->turn_low = -INFINITY;
    chart->turn_high = INFINITY;
    chart->holding = false;
}

/* May the point held back be left out when the line goes on to (x, y)?  Every
 * point since the last one put down allows directions that pass it within the
 * tolerance; their intersection is kept.  A line that turns back may not. */
static bool chart_line_passes(struct chart *chart, double x, double y)
{
    double held =
        hypot(chart->held_x - chart->last_x, chart->held_y - chart->last_y);
    double turn =
        atan2(chart->held_y - chart->last_y, chart->held_x - chart->last_x);
    if (held > CHART_TOLERANCE) {
        double play = asin(CHART_TOLERANCE / held);
        chart->turn_low = fmax(chart->turn_low, turn - play);
        chart->turn_high = fmin(chart->turn_high, turn + play);
    }
    double next = atan2(y - chart->last_y, x - chart->last_x);
    double reach = hypot(x - chart->last_x, y - chart->last_y);
    return reach >= held - CHART_TOLERANCE && next >= chart->turn_low &&
           next <= chart->turn_high;
}

static void chart_line_on(struct chart *chart, double x, double y)
{
    if (!chart->drawing) {
        chart->drawing = true;
        cairo_move_to(chart->cairo, x, y);
        chart->last_x = x;
        chart->last_y = y;
        chart->turn_low = -INFINITY;
        chart->turn_high = INFINITY;
        return;
    }
    if (chart->holding && !chart_line_passes(chart, x, y))
        chart_line_put(chart);
    chart->held_x = x;
    chart->held_y = y;
    chart->holding = true;
}

static void chart_column_put(struct chart *chart)
{
    const struct chart_column *column = &chart->column;
    const bool low_first = column->low.at < column->high.at;
    const struct chart_point *const point[] = {
        &column->first, low_first ? &column->low : &column->high,
        low_first ? &column->high : &column->low, &column->last
    };
    unsigned next = 0; /* a point may be two of them */
    for (unsigned i = 0; column->count > 0 && i < ARRAY_LEN(point); i++) {
        if (point[i]->at < next)
            continue;
        chart_line_on(chart, point[i]->x, point[i]->y);
        next = point[i]->at + 1;
    }
    chart->column.count = 0;
}

#define CHART_COLUMNS 4 /* per pixel: fewer and the fringe of noise shows it */

void chart_line_to(struct chart *chart, double t, double value)
{
    struct chart_column *column = &chart->column;
    const double x = chart_x(chart, t);
    const double y = chart_bounded(chart_y(chart, value), &chart->box);
    const double number = floor(x * CHART_COLUMNS);
    if (column->count > 0 && number != column->number)
        chart_column_put(chart);
    const struct chart_point point = { x, y, column->count };
    if (column->count++ == 0) {
        column->number = number;
        column->first = column->low = column->high = point;
    }
    if (y < column->low.y)
        column->low = point;
    if (y > column->high.y)
        column->high = point;
    column->last = point;
}

void chart_line_flush(struct chart *chart)
{
    chart_column_put(chart);
    chart_line_put(chart);
}

void chart_line_end(struct chart *chart, const struct chart_color *color,
                    double width)
{
    chart_line_flush(chart);
    cairo_set_line_width(chart->cairo, width);
    cairo_set_line_join(chart->cairo, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_cap(chart->cairo, CAIRO_LINE_CAP_ROUND);
    chart_set_color(chart->cairo, color);
    cairo_stroke(chart->cairo);
    cairo_restore(chart->cairo);
}

void chart_shade_line(struct chart *chart, bool above,
                      const struct chart_color *fill,
                      const struct chart_color *line)
{
    cairo_t *const cairo = chart->cairo;
    const struct chart_box *box = &chart->box;
    const double edge = above ? box->y : box->y + box->height;
    chart_line_flush(chart);
    cairo_path_t *const path = cairo_copy_path(cairo);
    cairo_line_to(cairo, chart->last_x, edge);
    cairo_line_to(cairo, box->x, edge);
    chart_set_color(cairo, fill);
    cairo_fill(cairo);
    cairo_append_path(cairo, path);
    cairo_path_destroy(path);
    chart_line_end(chart, line, 1);
}

void chart_marker(const struct chart *chart, double t, double value,
                  double radius, const struct chart_color *color)
{
    cairo_t *cairo = chart->cairo;
    cairo_new_path(cairo);
    cairo_arc(cairo, chart_x(chart, t), chart_y(chart, value), radius, 0,
              2 * 3.14159265358979);
    chart_set_color(cairo, &chart_white);
    cairo_fill_preserve(cairo);
    chart_set_color(cairo, color);
    cairo_set_line_width(cairo, 0.45 * radius);
    cairo_stroke(cairo);
}

void chart_vertical(const struct chart *chart, double t,
                    const struct chart_color *color)
{
    static const double dashes[] = { 1, 3 };
    double x = chart_sharp(chart_x(chart, t));
    cairo_save(chart->cairo);
    cairo_set_dash(chart->cairo, dashes, 2, 0);
    chart_rule(chart, x, chart->box.y, x, chart->box.y + chart->box.height,
               color);
    cairo_restore(chart->cairo);
}

void chart_notch(const struct chart *chart, double t, double length,
                 const struct chart_color *color)
{
    double x = chart_sharp(chart_x(chart, t));
    chart_rule(chart, x, chart->box.y, x, chart->box.y + length, color);
}

void chart_frame(const struct chart *chart, const struct chart_color *color)
{
    const struct chart_box *box = &chart->box;
    double bottom = chart_sharp(box->y + box->height);
    double left = chart_sharp(box->x);
    chart_rule(chart, left, box->y, left, bottom, color);
    chart_rule(chart, left, bottom, box->x + box->width, bottom, color);
}
