/* firmware/host/plot/plot.c - see plot.h. */
#include "firmware/host/plot/plot.h"

#include "firmware/host/base/number.h"
#include "firmware/host/plot/plot_panel.h"
#include "firmware/host/plot/plot_style.h"

/* --- columns: the axes, then what runs along the path --- */

static unsigned plot_columns(const struct job *job)
{
    return job->move.axis_count + (job->outcome.has_path ? 1 : 0);
}
/* --- layout --- */

static void plot_layout(struct plot *plot)
{
    static const double widths[] = { 0, 900, 600, 470, 385 };
    unsigned axes = plot_columns(plot->job);
    plot->rows = plot->trace != NULL ? PLOT_ROWS_MAX : PLOT_FOLLOWING;
    plot->bands = (axes + PLOT_COLUMNS - 1) / PLOT_COLUMNS;
    if (plot->bands == 0)
        plot->bands = 1;
    plot->columns = (axes + plot->bands - 1) / plot->bands;
    if (plot->columns == 0)
        plot->columns = 1;
    plot->column_width = widths[plot->columns];
    plot->width = 2 * PLOT_MARGIN +
                  plot->columns * (PLOT_TICKS + plot->column_width) +
                  (plot->columns - 1) * PLOT_GAP;
    plot->height = PLOT_MARGIN + PLOT_HEAD +
                   plot->bands * (PLOT_NAME + PLOT_FOOT +
                                  plot->rows * (PLOT_ROW + PLOT_ROW_GAP));
    plot->end_s = number_double(plot->job->end_ns_q12, 12) / 1e9;
    if (plot->trace != NULL && plot->trace->end_s > plot->end_s)
        plot->end_s = plot->trace->end_s;
    if (plot->end_s <= 0)
        plot->end_s = 1;
}

static struct chart_box plot_box(const struct plot *plot, unsigned axis,
                                 unsigned row)
{
    unsigned column = axis % plot->columns, band = axis / plot->columns;
    double band_height =
        PLOT_NAME + PLOT_FOOT + plot->rows * (PLOT_ROW + PLOT_ROW_GAP);
    return (struct chart_box){
        .x = PLOT_MARGIN + PLOT_TICKS +
             column * (plot->column_width + PLOT_TICKS + PLOT_GAP),
        .y = PLOT_MARGIN + PLOT_HEAD + band * band_height + PLOT_NAME +
             row * (PLOT_ROW + PLOT_ROW_GAP),
        .width = plot->column_width,
        .height = PLOT_ROW,
    };
}
static void plot_draw_axis(struct plot *plot, unsigned axis)
{
    unsigned rows = plot_rows(plot, axis);
    struct chart_box top = plot_box(plot, axis, 0);
    struct chart_box bottom = plot_box(plot, axis, rows - 1);
    chart_text(plot->cairo, &plot_name, top.x, top.y - 36, CHART_LEFT,
               axis < plot->job->move.axis_count
                   ? plot->job->move.axis[axis].name
                   : "path");
    for (unsigned row = 0; row < rows; row++) {
        plan_progress_tell(plot->job->progress, "drawing", "panels",
                           (int64_t)axis * plot->rows + row,
                           (int64_t)plot_columns(plot->job) * plot->rows);
        const struct chart_box box = plot_box(plot, axis, row);
        plot_draw_panel(plot, axis, row, &box);
    }
    chart_text(plot->cairo, &plot_note, bottom.x + bottom.width,
               bottom.y + bottom.height + 36, CHART_RIGHT, "time  s");
}

/* --- head of the page --- */

static double plot_swatch_line(cairo_t *cairo, double x, double y,
                               const struct chart_color *color, double width)
{
    chart_set_color(cairo, color);
    cairo_set_line_width(cairo, width);
    cairo_move_to(cairo, x, y - 4);
    cairo_line_to(cairo, x + 26, y - 4);
    cairo_stroke(cairo);
    return x + 33;
}

static double plot_swatch_area(cairo_t *cairo, double x, double y)
{
    chart_set_color(cairo, &plot_beyond);
    cairo_rectangle(cairo, x, y - 11, 26, 14);
    cairo_fill_preserve(cairo);
    chart_set_color(cairo, &plot_limit);
    cairo_set_line_width(cairo, 1);
    cairo_stroke(cairo);
    return x + 33;
}

static double plot_swatch_key(cairo_t *cairo, double x, double y)
{
    struct chart chart = {
        .cairo = cairo, .box = { x, y - 8, 10, 8 }, .t1 = 1, .high = 1
    };
    chart_marker(&chart, 0.5, 0.5, 4, &plot_plan);
    return x + 17;
}

static double plot_legend_text(cairo_t *cairo, double x, double y,
                               const char *text)
{
    return x + chart_text(cairo, &plot_note, x, y, CHART_LEFT, text) + 26;
}

static void plot_legend(const struct plot *plot, double x, double y)
{
    cairo_t *cairo = plot->cairo;
    bool warped = plot->trace != NULL && plot->trace->warped;
    x = plot_swatch_line(cairo, x, y, &plot_plan, 1.8);
    x = plot_legend_text(cairo, x, y, warped ? "demand as played" : "planned");
    if (warped) {
        x = plot_swatch_line(cairo, x, y, &plot_nominal, 1.2);
        x = plot_legend_text(cairo, x, y, "planned, at 100 %");
    } else if (!plot->job->outcome.is_bent) {
        x = plot_swatch_key(cairo, x, y);
        x = plot_legend_text(cairo, x, y, "key");
    }
    if (plot_has_shots(plot)) {
        x = plot_swatch_line(cairo, x, y, &plot_shot, 1.2);
        x = plot_legend_text(
            cairo, x, y, plot->trace != NULL ? "trigger, fired" : "trigger");
    }
    if (plot->trace != NULL) {
        x = plot_swatch_line(cairo, x, y, &plot_servo, 4.5);
        x = plot_legend_text(cairo, x, y, "servo, measured");
        x = plot_swatch_line(cairo, x, y, &plot_error, 1.3);
        x = plot_legend_text(cairo, x, y, "following error");
    }
    x = plot_swatch_area(cairo, x, y);
    x = plot_legend_text(cairo, x, y, "beyond the limit");
    plot_legend_text(cairo, x, y, "\u2191 limit off the scale");
}

static const char *plot_things(const struct job *job)
{
    bool one = job->move.axis_count == 1;
    if (job->compared)
        return one ? "curve" : "curves";
    return one ? "axis" : "axes";
}

static void plot_draw_head(const struct plot *plot)
{
    const struct job *job = plot->job;
    char subtitle[320];
    double x = PLOT_MARGIN, y = PLOT_MARGIN;
    const char *title = job->move.title[0] != 0 ? job->move.title : "Move";
    chart_text(plot->cairo, &plot_title, x, y + 14, CHART_LEFT, title);
    snprintf(subtitle, sizeof subtitle, "%s%s%u %s, %.3f s", job->rig.title,
             job->rig.title[0] != 0 ? "  \u00b7  " : "", job->move.axis_count,
             plot_things(job), number_double(job->end_ns_q12, 12) / 1e9);
    chart_text(plot->cairo, &plot_subtitle, x, y + 38, CHART_LEFT, subtitle);
    plot_legend(plot, x, y + 68);
}

static void plot_draw(struct plot *plot)
{
    plot_draw_head(plot);
    for (unsigned i = 0; i < plot_columns(plot->job); i++)
        plot_draw_axis(plot, i);
    plan_progress_end(plot->job->progress);
}

/* --- writing --- */

static void plot_draw_on(cairo_t *cairo, void *context)
{
    struct plot *plot = context;
    plot->cairo = cairo;
    plot_draw(plot);
}

int plot_write(const struct job *job, const struct trace *trace,
               enum plot_format format, FILE *file, struct messages *messages)
{
    struct plot plot = { .job = job, .trace = trace };
    plot_layout(&plot);
    const struct plot_page page = { plot.width, plot.height, plot_draw_on,
                                    &plot };
    return plot_page_write(&page, format, file, messages);
}
