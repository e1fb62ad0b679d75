/* firmware/host/plot/plot_fit.c - see plot_fit.h. */
#include "firmware/host/plot/plot_fit.h"

#include <math.h>
#include <stdio.h>

#include "firmware/host/plot/chart.h"
#include "firmware/host/plot/plot_style.h"

#define FIT_WIDTH  620.0
#define FIT_HEIGHT 210.0
#define FIT_GAP_X  90.0
#define FIT_GAP_Y  70.0
#define FIT_LEFT   60.0
#define FIT_HEAD   130.0
#define FIT_LINE   1.3

static const struct chart_font fit_tick = { 11, false, PLOT_SOFT };

struct fit_page {
    const struct plot_fit *fit;
    cairo_t *cairo;
};

/* One of the three, or what a model leaves: less != NULL. */
struct fit_curve {
    const double *value, *less;
    const struct chart_color *color;
    const char *name;
};

static double fit_at(const struct fit_curve *curve, uint32_t i)
{
    return curve->value[i] - (curve->less != NULL ? curve->less[i] : 0);
}

static void fit_range(const struct fit_curve curve[], unsigned curves,
                      uint32_t rows, struct chart *chart)
{
    chart->low = chart->high = fit_at(&curve[0], 0);
    for (unsigned c = 0; c < curves; c++)
        for (uint32_t i = 0; i < rows; i++) {
            chart->low = fmin(chart->low, fit_at(&curve[c], i));
            chart->high = fmax(chart->high, fit_at(&curve[c], i));
        }
    const double margin = fmax(0.05 * (chart->high - chart->low), 1e-12);
    chart->low -= margin;
    chart->high += margin;
}

static void fit_panel(const struct fit_page *page, unsigned column,
                      unsigned row, const struct fit_curve curve[],
                      unsigned curves)
{
    static const struct chart_color line = PLOT_SOFT;
    const struct plot_fit_axis *const axis = &page->fit->axis[column];
    struct chart chart = {
        .cairo = page->cairo,
        .box = { PLOT_MARGIN + FIT_LEFT + column * (FIT_WIDTH + FIT_GAP_X),
                 PLOT_MARGIN + FIT_HEAD + row * (FIT_HEIGHT + FIT_GAP_Y),
                 FIT_WIDTH, FIT_HEIGHT },
        .t1 = axis->period_s * (axis->rows - 1),
    };
    char heading[160];
    double x = chart.box.x;

    fit_range(curve, curves, axis->rows, &chart);
    const char *prefix;
    const double scale =
        chart_scale(fmax(fabs(chart.low), fabs(chart.high)), &prefix);
    chart_grid_values(&chart, &fit_tick, scale);
    chart_grid_times(&chart, &fit_tick, true);
    snprintf(heading, sizeof heading, "%s in %s%s, over s",
             row == 0 ? "following error" : "model less recording", prefix,
             axis->unit);
    chart_text(page->cairo, &plot_heading, x, chart.box.y - 10, CHART_LEFT,
               heading);
    x = chart.box.x + chart.box.width;
    for (unsigned c = 0; c < curves; c++) {
        const struct chart_font font = { 12, true, *curve[c].color };
        chart_line_begin(&chart);
        for (uint32_t i = 0; i < axis->rows; i++)
            chart_line_to(&chart, axis->period_s * i, fit_at(&curve[c], i));
        chart_line_end(&chart, curve[c].color, FIT_LINE);
        x -= chart_text(page->cairo, &font, x, chart.box.y - 10, CHART_RIGHT,
                        curve[c].name) +
             14;
    }
    chart_frame(&chart, &line);
}

static void fit_axis(const struct fit_page *page, unsigned column)
{
    const struct plot_fit_axis *const axis = &page->fit->axis[column];
    const struct fit_curve is[] = {
        { axis->before, NULL, &plot_servo, "before" },
        { axis->recorded, NULL, &plot_nominal, "recorded" },
        { axis->after, NULL, &plot_plan, "fitted" },
    };
    const struct fit_curve leaves[] = {
        { axis->before, axis->recorded, &plot_servo, "before" },
        { axis->after, axis->recorded, &plot_plan, "fitted" },
    };

    chart_text(page->cairo, &plot_name,
               PLOT_MARGIN + FIT_LEFT + column * (FIT_WIDTH + FIT_GAP_X),
               PLOT_MARGIN + FIT_HEAD - 34, CHART_LEFT, axis->name);
    fit_panel(page, column, 0, is, 3);
    fit_panel(page, column, 1, leaves, 2);
}

static void fit_draw(cairo_t *cairo, void *context)
{
    struct fit_page *const page = context;

    page->cairo = cairo;
    chart_text(cairo, &plot_title, PLOT_MARGIN, PLOT_MARGIN + 14, CHART_LEFT,
               page->fit->title);
    chart_text(cairo, &plot_subtitle, PLOT_MARGIN, PLOT_MARGIN + 38, CHART_LEFT,
               page->fit->subtitle);
    for (unsigned i = 0; i < page->fit->axes; i++)
        fit_axis(page, i);
}

int plot_fit_write(const struct plot_fit *fit, enum plot_format format,
                   FILE *file, struct messages *messages)
{
    struct fit_page page = { .fit = fit };
    const struct plot_page paper = {
        .width = 2 * PLOT_MARGIN + FIT_LEFT + fit->axes * FIT_WIDTH +
                 (fit->axes - 1) * FIT_GAP_X,
        .height = 2 * PLOT_MARGIN + FIT_HEAD + 2 * FIT_HEIGHT + FIT_GAP_Y + 24,
        .draw = fit_draw,
        .context = &page,
    };

    return plot_page_write(&paper, format, file, messages);
}
