/* firmware/host/plot/plot_otg.c - see plot_otg.h. */
#include "firmware/host/plot/plot_otg.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/plot/plot_page.h"
#include "firmware/host/plot/plot_style.h"

#define OTG_STRIP       7   /* height of the phase strip */
#define OTG_STRIP_GAP   32  /* from its lower edge to the first panel */
#define OTG_PIXELS      1.5 /* between the points of a curve */
#define OTG_PHASE_LEAST 2   /* pixels, for a line at its end */

/* What a phase does, and how the strip shows it. */
enum otg_phase_kind { OTG_RISES, OTG_FALLS, OTG_HOLDS, OTG_CRUISES, OTG_KINDS };

static const struct {
    const char *text;
    struct chart_color color;
} otg_phase_kind[OTG_KINDS] = {
    [OTG_RISES] = { "acceleration rises", { 0.000, 0.447, 0.698, 1 } },
    [OTG_FALLS] = { "falls", { 0.902, 0.624, 0.000, 1 } },
    [OTG_HOLDS] = { "is held", { 0.337, 0.706, 0.914, 1 } },
    [OTG_CRUISES] = { "is zero", { 0.80, 0.82, 0.84, 1 } },
};

static const char *const otg_row_name[] = { "Position", "Velocity",
                                            "Acceleration", "Jerk" };
static const char *const otg_row_per[] = { "", "per s", "per s\u00b2",
                                           "per s\u00b3" };
enum { OTG_ROWS = 4 };

struct otg_page {
    const struct otg_motion *motion;
    const char *title, *subtitle;
    cairo_t *cairo;
    unsigned columns, bands;
    double column_width, width, height;
    double end; /* of the time axis, in units of `second` */
    double second;
    char second_text[40];
};

struct otg_panel {
    const struct otg_page *page;
    int axis, row;
    struct chart chart;
    double min, max;  /* of the curve */
    double low, high; /* limits; 0: none */
    double scale;
    char prefix[40];
};

/* --- numbers of any size -------------------------------------------------- */

static void otg_superscript(char *text, size_t size, int power)
{
    static const char *const digit[] = { "\u2070", "\u00b9", "\u00b2", "\u00b3",
                                         "\u2074", "\u2075", "\u2076", "\u2077",
                                         "\u2078", "\u2079" };
    char decimal[16];
    snprintf(decimal, sizeof decimal, "%d", power < 0 ? -power : power);
    int length = snprintf(text, size, "%s", power < 0 ? "\u207b" : "");
    for (const char *c = decimal; *c != 0 && (size_t)length < size; c++)
        length += snprintf(text + length, size - (size_t)length, "%s",
                           digit[*c - '0']);
}

/* What to divide by so that labels stay short, and "10^n " for the heading:
 * chart_scale where its list reaches, else a power of a thousand. */
static double otg_scale(double largest, char prefix[40])
{
    const char *known;
    if (largest == 0 || (largest >= 2e-8 && largest < 1e15)) {
        double scale = chart_scale(largest == 0 ? 1 : largest, &known);
        snprintf(prefix, 40, "%s", known);
        return scale;
    }
    int power = 3 * (int)floor(log10(largest) / 3);
    char raised[32];
    otg_superscript(raised, sizeof raised, power);
    snprintf(prefix, 40, "10%s ", raised);
    return pow(10, power);
}

/* --- layout --------------------------------------------------------------- */

/* The axis's name, where there are several. */
static double otg_name_height(const struct otg_page *page)
{
    return page->motion->header->axes > 1 ? PLOT_NAME : 0;
}

static double otg_band_height(const struct otg_page *page)
{
    return otg_name_height(page) + PLOT_FOOT + OTG_STRIP_GAP +
           OTG_ROWS * (PLOT_ROW + PLOT_ROW_GAP);
}

static double otg_seconds(const struct otg_motion *motion)
{
    double end = otg_motion_seconds(motion);
    return end > 0 ? end : 1;
}

static void otg_layout(struct otg_page *page)
{
    static const double widths[] = { 0, 900, 600, 470, 385 };
    unsigned axes = (unsigned)page->motion->header->axes;
    page->bands = (axes + PLOT_COLUMNS - 1) / PLOT_COLUMNS;
    page->columns = (axes + page->bands - 1) / page->bands;
    page->column_width = widths[page->columns];
    page->width = 2 * PLOT_MARGIN +
                  page->columns * (PLOT_TICKS + page->column_width) +
                  (page->columns - 1) * PLOT_GAP;
    page->height =
        PLOT_MARGIN + PLOT_HEAD + page->bands * otg_band_height(page);
    page->second = otg_scale(otg_seconds(page->motion), page->second_text);
    page->end = otg_seconds(page->motion) / page->second;
}

static struct chart_box otg_box(const struct otg_page *page, int axis, int row)
{
    unsigned column = (unsigned)axis % page->columns;
    unsigned band = (unsigned)axis / page->columns;
    return (struct chart_box){
        .x = PLOT_MARGIN + PLOT_TICKS +
             column * (page->column_width + PLOT_TICKS + PLOT_GAP),
        .y = PLOT_MARGIN + PLOT_HEAD + band * otg_band_height(page) +
             otg_name_height(page) + OTG_STRIP_GAP +
             row * (PLOT_ROW + PLOT_ROW_GAP),
        .width = page->column_width,
        .height = PLOT_ROW,
    };
}

/* --- the curve ------------------------------------------------------------ */

static double otg_value(const struct otg_point *at, int row)
{
    const double value[] = { at->p, at->v, at->a, at->j };
    return value[row];
}

typedef void otg_take(struct otg_panel *panel, double t, double value);

/* The part of segment i before the next piece begins. */
static void otg_phase(struct otg_panel *panel, const struct otg_piece *piece,
                      uint32_t i, otg_take *take)
{
    const struct motion_segment *segment = &piece->track.segment[i];
    const double begin = otg_piece_at(piece, i, 0).t;
    const double end = otg_piece_at(piece, i, segment->dur_ns_q12).t;
    const double part =
        end > piece->until_s ? (piece->until_s - begin) / (end - begin) : 1;
    if (part <= 0)
        return;
    const double pixels = part * (end - begin) / panel->page->second /
                          panel->page->end * panel->page->column_width;
    const int steps = panel->row >= 2 ? 1 : (int)fmax(2, pixels / OTG_PIXELS);
    for (int k = 0; k <= steps; k++) {
        const double u = part * k / steps;
        const struct otg_point at =
            otg_piece_at(piece, i,
                         u < 1 ? (int64_t)((double)segment->dur_ns_q12 * u)
                               : segment->dur_ns_q12);
        take(panel, at.t, otg_value(&at, panel->row));
    }
}

static const struct otg_piece *otg_piece(const struct otg_page *page, int leg,
                                         int axis)
{
    return &page->motion->leg[leg].piece[axis];
}

static void otg_curve(struct otg_panel *panel, otg_take *take)
{
    const struct otg_page *page = panel->page;
    struct otg_point end;
    if (panel->row == OTG_ROWS - 1)
        take(panel, 0, 0);
    for (int leg = 0; leg < page->motion->legs; leg++) {
        const struct otg_piece *piece = otg_piece(page, leg, panel->axis);
        if (piece->outcome == MOTION_OTG_KEPT)
            continue;
        for (uint32_t i = 0; i < piece->track.count; i++)
            otg_phase(panel, piece, i, take);
        end = otg_piece_end(piece);
        if (piece->end_s >= piece->until_s)
            continue;
        take(panel, end.t, otg_value(&end, panel->row));
        if (isfinite(piece->until_s)) /* at rest */
            take(panel, piece->until_s, otg_value(&end, panel->row));
    }
}

static void otg_grow(struct otg_panel *panel, double t, double value)
{
    (void)t;
    panel->min = fmin(panel->min, value);
    panel->max = fmax(panel->max, value);
}

static void otg_line(struct otg_panel *panel, double t, double value)
{
    chart_line_to(&panel->chart, t / panel->page->second, value);
}

/* --- scales --------------------------------------------------------------- */

/* Where they change, the widest. */
static void otg_limits(struct otg_panel *panel)
{
    const struct otg_motion *motion = panel->page->motion;
    static const int high[OTG_ROWS] = { 0, OTG_VMAX, OTG_AMAX, OTG_JMAX };
    static const int low[OTG_ROWS] = { 0, OTG_VMIN, OTG_AMIN, OTG_JMAX };
    if (panel->row == 0 || (panel->row == 1 && motion->header->velocity))
        return;
    for (int leg = 0; leg < motion->legs; leg++) {
        const double *value = motion->leg[leg].row.value[panel->axis];
        panel->high = fmax(panel->high, value[high[panel->row]]);
        panel->low = fmin(panel->low, panel->row == OTG_ROWS - 1
                                          ? -value[low[panel->row]]
                                          : value[low[panel->row]]);
    }
}

/* A limit is on the scale when the curve goes this part of the way to it. */
#define OTG_WORTH 0.25

static void otg_range(struct otg_panel *panel)
{
    struct chart *chart = &panel->chart;
    panel->min = INFINITY;
    panel->max = -INFINITY;
    otg_curve(panel, otg_grow);
    chart->low = panel->row == 0 ? panel->min : fmin(panel->min, 0);
    chart->high = panel->row == 0 ? panel->max : fmax(panel->max, 0);
    if (panel->high != 0 && panel->max >= OTG_WORTH * panel->high)
        chart->high = fmax(chart->high, panel->high);
    if (panel->low != 0 && panel->min <= OTG_WORTH * panel->low)
        chart->low = fmin(chart->low, panel->low);
    double largest = fmax(fabs(chart->low), fabs(chart->high));
    double span = chart->high - chart->low;
    if (span <= 1e-12 * largest || span == 0)
        span = largest > 0 ? 2e-6 * largest : 1;
    chart->low -= 0.1 * span;
    chart->high += 0.1 * span;
    panel->scale =
        otg_scale(fmax(fabs(chart->low), fabs(chart->high)), panel->prefix);
}

/* --- a panel -------------------------------------------------------------- */

static void otg_short(const struct otg_panel *panel, double value,
                      char text[CHART_LABEL_MAX])
{
    double shown = value / panel->scale;
    if (fabs(shown) < 1e-6)
        shown = 0;
    double size = fabs(shown);
    double step = size > 0 ? pow(10, floor(log10(size)) - 2) : 1;
    while (step < 1 && fabs(remainder(shown, 10 * step)) < step / 2)
        step *= 10;
    chart_label(text, shown, fmax(fmin(step, 1), 1e-6));
}

/* "-4.2 ... 10 of -5 ... 10", right of the heading. */
static void otg_note(const struct otg_panel *panel, char *text, size_t size)
{
    char min[CHART_LABEL_MAX], max[CHART_LABEL_MAX];
    char low[CHART_LABEL_MAX], high[CHART_LABEL_MAX];
    otg_short(panel, panel->min, min);
    otg_short(panel, panel->max, max);
    otg_short(panel, panel->low, low);
    otg_short(panel, panel->high, high);
    int length = snprintf(text, size, "%s \u2026 %s", min, max);
    if (panel->low != 0 && panel->low == -panel->high)
        snprintf(text + length, size - (size_t)length, "  of \u00b1%s", high);
    else if (panel->low != 0)
        snprintf(text + length, size - (size_t)length, "  of %s \u2026 %s", low,
                 high);
    else if (panel->row > 0)
        snprintf(text + length, size - (size_t)length, "  no limit");
}

static void otg_headings(const struct otg_panel *panel)
{
    cairo_t *cairo = panel->page->cairo;
    const struct chart_box *box = &panel->chart.box;
    char text[96], note[256];
    double x = box->x, y = box->y - 9;
    x += chart_text(cairo, &plot_heading, x, y, CHART_LEFT,
                    otg_row_name[panel->row]);
    snprintf(text, sizeof text, "  %s%s", panel->prefix,
             otg_row_per[panel->row]);
    chart_text(cairo, &plot_note, x, y, CHART_LEFT, text);
    otg_note(panel, note, sizeof note);
    chart_text(cairo, &plot_note, box->x + box->width, y, CHART_RIGHT, note);
}

/* Dotted lines where phases end, but not where they would fill the panel. */
struct otg_lines {
    const struct otg_panel *panel;
    double last;
};

static void otg_phase_line(void *context, int leg, const struct otg_point *at)
{
    struct otg_lines *lines = context;
    const struct otg_panel *panel = lines->panel;
    const double t = at->t / panel->page->second;
    (void)leg;
    if (chart_x(&panel->chart, t) - lines->last < OTG_PHASE_LEAST)
        return;
    chart_vertical(&panel->chart, t, &plot_key);
    lines->last = chart_x(&panel->chart, t);
}

static void otg_phase_lines(const struct otg_panel *panel)
{
    struct otg_lines lines = { panel, panel->chart.box.x };
    otg_motion_walk(panel->page->motion, panel->axis, otg_phase_line, &lines);
}

static void otg_mark(const struct otg_panel *panel, const struct otg_point *at)
{
    chart_marker(&panel->chart, at->t / panel->page->second,
                 otg_value(at, panel->row), 4, &plot_plan);
}

/* Where each row takes over, and the end. */
static void otg_ends(const struct otg_panel *panel)
{
    const struct otg_motion *motion = panel->page->motion;
    if (panel->row == OTG_ROWS - 1)
        return;
    for (int leg = 0; leg < motion->legs; leg++) {
        const struct otg_piece *piece =
            otg_piece(panel->page, leg, panel->axis);
        if (piece->outcome == MOTION_OTG_KEPT)
            continue;
        const struct otg_point begin = otg_piece_at(piece, 0, 0);
        otg_mark(panel, &begin);
    }
    const struct otg_point end =
        otg_piece_end(otg_motion_last(motion, panel->axis));
    otg_mark(panel, &end);
}

static void otg_draw_panel(const struct otg_page *page, int axis, int row)
{
    struct otg_panel panel = {
        .page = page,
        .axis = axis,
        .row = row,
        .chart = { .cairo = page->cairo,
                   .box = otg_box(page, axis, row),
                   .t1 = page->end },
    };
    otg_limits(&panel);
    otg_range(&panel);
    chart_grid_times(&panel.chart, &plot_tick, row + 1 == OTG_ROWS);
    chart_grid_values(&panel.chart, &plot_tick, panel.scale);
    if (panel.high != 0) {
        chart_shade(&panel.chart, panel.high, true, &plot_beyond, &plot_limit);
        chart_shade(&panel.chart, panel.low, false, &plot_beyond, &plot_limit);
    }
    otg_phase_lines(&panel);
    chart_frame(&panel.chart, &plot_frame);
    chart_line_begin(&panel.chart);
    otg_curve(&panel, otg_line);
    chart_line_end(&panel.chart, &plot_plan, 1.8);
    otg_ends(&panel);
    otg_headings(&panel);
}

/* --- the strip ------------------------------------------------------------ */

struct otg_strip {
    const struct otg_page *page;
    struct chart chart;
    double y, most;        /* the largest acceleration */
    struct otg_point from; /* of the phase; t NAN: there is none yet */
};

static void otg_strip_most(void *context, int leg, const struct otg_point *at)
{
    struct otg_strip *strip = context;
    (void)leg;
    strip->most = fmax(strip->most, fabs(at->a));
}

/* A cruise may hold what rounding left of the acceleration. */
static enum otg_phase_kind otg_kind(const struct otg_strip *strip,
                                    const struct otg_point *to)
{
    const double step = strip->from.j * (to->t - strip->from.t);
    const double size = fmax(fabs(strip->from.a), fabs(strip->from.a + step));
    if (size <= 1e-6 * strip->most)
        return OTG_CRUISES;
    if (fabs(step) > 1e-6 * size)
        return step > 0 ? OTG_RISES : OTG_FALLS;
    return OTG_HOLDS;
}

static void otg_strip_phase(void *context, int leg, const struct otg_point *at)
{
    struct otg_strip *strip = context;
    (void)leg;
    if (!isnan(strip->from.t)) {
        const double second = strip->page->second;
        double x = chart_x(&strip->chart, strip->from.t / second);
        double to = chart_x(&strip->chart, at->t / second);
        double gap = to - x > 3 ? 1 : 0;
        chart_set_color(strip->page->cairo,
                        &otg_phase_kind[otg_kind(strip, at)].color);
        cairo_rectangle(strip->page->cairo, x, strip->y, to - x - gap,
                        OTG_STRIP);
        cairo_fill(strip->page->cairo);
    }
    strip->from = *at;
}

static void otg_draw_strip(const struct otg_page *page, int axis)
{
    const struct chart_box box = otg_box(page, axis, 0);
    struct otg_strip strip = {
        .page = page,
        .chart = { .box = box, .t1 = page->end },
        .y = box.y - OTG_STRIP_GAP - OTG_STRIP,
        .from = { .t = (double)NAN },
    };
    otg_motion_walk(page->motion, axis, otg_strip_most, &strip);
    otg_motion_walk(page->motion, axis, otg_strip_phase, &strip);
}

/* --- the page ------------------------------------------------------------- */

static double otg_swatch(const struct otg_page *page, double x, double y,
                         const struct chart_color *color, const char *text)
{
    chart_set_color(page->cairo, color);
    cairo_rectangle(page->cairo, x, y - 9, 20, OTG_STRIP + 2);
    cairo_fill(page->cairo);
    return x + 27 +
           chart_text(page->cairo, &plot_note, x + 27, y, CHART_LEFT, text) +
           20;
}

static void otg_draw_head(const struct otg_page *page)
{
    double x = PLOT_MARGIN, y = PLOT_MARGIN;
    chart_text(page->cairo, &plot_title, x, y + 14, CHART_LEFT, page->title);
    chart_text(page->cairo, &plot_subtitle, x, y + 38, CHART_LEFT,
               page->subtitle);
    for (int i = 0; i < OTG_KINDS; i++)
        x = otg_swatch(page, x, y + 68, &otg_phase_kind[i].color,
                       otg_phase_kind[i].text);
    otg_swatch(page, x, y + 68, &plot_beyond, "beyond the limit");
}

static void otg_draw_axis(const struct otg_page *page, int axis)
{
    struct chart_box top = otg_box(page, axis, 0);
    struct chart_box bottom = otg_box(page, axis, OTG_ROWS - 1);
    char text[64];
    if (page->motion->header->axes > 1) {
        snprintf(text, sizeof text, "axis %d", axis + 1);
        chart_text(page->cairo, &plot_name, top.x,
                   top.y - OTG_STRIP_GAP - OTG_STRIP - 10, CHART_LEFT, text);
    }
    otg_draw_strip(page, axis);
    for (int row = 0; row < OTG_ROWS; row++)
        otg_draw_panel(page, axis, row);
    snprintf(text, sizeof text, "time  %ss", page->second_text);
    chart_text(page->cairo, &plot_note, bottom.x + bottom.width,
               bottom.y + bottom.height + 36, CHART_RIGHT, text);
}

static void otg_draw(cairo_t *cairo, void *context)
{
    struct otg_page *page = context;
    page->cairo = cairo;
    otg_draw_head(page);
    for (int i = 0; i < page->motion->header->axes; i++)
        otg_draw_axis(page, i);
}

int plot_otg_write(const struct otg_motion *motion, const char *title,
                   const char *subtitle, enum plot_format format, FILE *file,
                   struct messages *messages)
{
    struct otg_page page = { .motion = motion,
                             .title = title,
                             .subtitle = subtitle };
    otg_layout(&page);
    const struct plot_page paper = { page.width, page.height, otg_draw, &page };
    return plot_page_write(&paper, format, file, messages);
}
