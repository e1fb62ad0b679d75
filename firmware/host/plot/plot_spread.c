/* firmware/host/plot/plot_spread.c - see plot_spread.h. */
#include "firmware/host/plot/plot_spread.h"

#include <math.h>
#include <stdio.h>

#include "firmware/host/plot/chart.h"
#include "firmware/host/plot/plot_style.h"

#define SPREAD_PANEL_WIDTH  260.0
#define SPREAD_PANEL_HEIGHT 190.0
#define SPREAD_GAP_X        70.0
#define SPREAD_GAP_Y        70.0
#define SPREAD_HEAD         90.0
#define SPREAD_BINS         40

static const struct chart_color spread_good = { 0.15, 0.39, 0.70, 0.55 };
static const struct chart_color spread_bad = { 0.80, 0.22, 0.17, 0.85 };
static const struct chart_font spread_tick = { 11, false, PLOT_SOFT };

struct spread_page {
    const struct plot_spread *spread;
    cairo_t *cairo;
};

static void spread_range(const double value[], unsigned count, double *low,
                         double *high)
{
    *low = *high = value[0];
    for (unsigned i = 1; i < count; i++) {
        *low = fmin(*low, value[i]);
        *high = fmax(*high, value[i]);
    }
    const double margin =
        *high > *low ? 0.05 * (*high - *low) : 0.5 * fmax(fabs(*high), 1e-9);
    *low -= margin;
    *high += margin;
}

static struct chart_box spread_box(unsigned column, unsigned row)
{
    return (struct chart_box){
        .x = PLOT_MARGIN + 50 + column * (SPREAD_PANEL_WIDTH + SPREAD_GAP_X),
        .y = PLOT_MARGIN + SPREAD_HEAD +
             row * (SPREAD_PANEL_HEIGHT + SPREAD_GAP_Y),
        .width = SPREAD_PANEL_WIDTH,
        .height = SPREAD_PANEL_HEIGHT,
    };
}

static void spread_frame(const struct chart *chart, const char *across,
                         const char *upwards)
{
    static const struct chart_color line = PLOT_SOFT;
    const struct chart_box *const box = &chart->box;
    const double step = chart_step(chart->t1 - chart->t0, 4);
    char label[CHART_LABEL_MAX];

    chart_grid_values(chart, &spread_tick, 1);
    const double first = ceil(chart->t0 / step), last = floor(chart->t1 / step);
    for (int i = 0; i <= (int)(last - first); i++) {
        const double t = (first + i) * step;
        chart_label(label, t, step);
        chart_text(chart->cairo, &spread_tick, chart_x(chart, t),
                   box->y + box->height + 16, CHART_CENTRE, label);
    }
    chart_frame(chart, &line);
    chart_text(chart->cairo, &plot_note, box->x + box->width,
               box->y + box->height + 34, CHART_RIGHT, across);
    chart_text(chart->cairo, &plot_note, box->x, box->y - 8, CHART_LEFT,
               upwards);
}

/* --- a histogram --- */

struct spread_bins {
    unsigned good[SPREAD_BINS], bad[SPREAD_BINS], most;
};

static void spread_count(const struct plot_spread *spread, const double value[],
                         const struct chart *chart, struct spread_bins *bins)
{
    *bins = (struct spread_bins){ .most = 1 };
    for (unsigned i = 0; i < spread->runs; i++) {
        const double at =
            SPREAD_BINS * (value[i] - chart->t0) / (chart->t1 - chart->t0);
        const unsigned bin = at < 0              ? 0
                             : at >= SPREAD_BINS ? SPREAD_BINS - 1
                                                 : (unsigned)at;
        ++*(spread->is_bad[i] ? &bins->bad[bin] : &bins->good[bin]);
        if (bins->good[bin] + bins->bad[bin] > bins->most)
            bins->most = bins->good[bin] + bins->bad[bin];
    }
}

static void spread_bar(const struct chart *chart, unsigned bin, double from,
                       double to, const struct chart_color *color)
{
    const double width = chart->box.width / SPREAD_BINS;
    chart_set_color(chart->cairo, color);
    cairo_rectangle(chart->cairo, chart->box.x + bin * width,
                    chart_y(chart, to), width - 1,
                    chart_y(chart, from) - chart_y(chart, to));
    cairo_fill(chart->cairo);
}

static void spread_histogram(const struct spread_page *page, unsigned row)
{
    const struct plot_spread_column *const of = &page->spread->result[row];
    struct chart chart = { .cairo = page->cairo, .box = spread_box(0, row) };
    struct spread_bins bins;

    spread_range(of->value, page->spread->runs, &chart.t0, &chart.t1);
    spread_count(page->spread, of->value, &chart, &bins);
    chart.high = 1.08 * bins.most;
    spread_frame(&chart, of->name, "runs");
    for (unsigned i = 0; i < SPREAD_BINS; i++) {
        spread_bar(&chart, i, 0, bins.good[i], &spread_good);
        spread_bar(&chart, i, bins.good[i], bins.good[i] + bins.bad[i],
                   &spread_bad);
    }
}

/* --- against what was varied --- */

static void spread_scatter(const struct spread_page *page, unsigned row,
                           unsigned column)
{
    const struct plot_spread *const spread = page->spread;
    const struct plot_spread_column *const of = &spread->result[row];
    const struct plot_spread_column *const by = &spread->cause[column];
    struct chart chart = { .cairo = page->cairo,
                           .box = spread_box(column + 1, row) };

    spread_range(by->value, spread->runs, &chart.t0, &chart.t1);
    spread_range(of->value, spread->runs, &chart.low, &chart.high);
    spread_frame(&chart, by->name, of->name);
    for (unsigned i = 0; i < spread->runs; i++) {
        chart_set_color(page->cairo,
                        spread->is_bad[i] ? &spread_bad : &spread_good);
        cairo_arc(page->cairo, chart_x(&chart, by->value[i]),
                  chart_y(&chart, of->value[i]), 1.8, 0, 6.283185307179586);
        cairo_fill(page->cairo);
    }
}

static void spread_draw(cairo_t *cairo, void *context)
{
    struct spread_page *const page = context;
    page->cairo = cairo;
    chart_text(cairo, &plot_title, PLOT_MARGIN, PLOT_MARGIN + 14, CHART_LEFT,
               page->spread->title);
    chart_text(cairo, &plot_subtitle, PLOT_MARGIN, PLOT_MARGIN + 38, CHART_LEFT,
               page->spread->subtitle);
    for (unsigned row = 0; row < page->spread->results; row++) {
        spread_histogram(page, row);
        for (unsigned i = 0; i < page->spread->causes; i++)
            spread_scatter(page, row, i);
    }
}

int plot_spread_write(const struct plot_spread *spread, enum plot_format format,
                      FILE *file, struct messages *messages)
{
    struct spread_page page = { .spread = spread };
    const struct chart_box last =
        spread_box(spread->causes, spread->results - 1);
    const struct plot_page paper = {
        .width = last.x + last.width + PLOT_MARGIN,
        .height = last.y + last.height + 40 + PLOT_MARGIN,
        .draw = spread_draw,
        .context = &page,
    };
    return plot_page_write(&paper, format, file, messages);
}
