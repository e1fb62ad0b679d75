/* firmware/host/plot/plot.c - see plot.h. */
#include "firmware/host/plot/plot.h"

#include <math.h>
#include <string.h>

#include "firmware/host/base/number.h"
#include "firmware/host/move/compiled.h"
#include "firmware/host/move/path_report.h"
#include "firmware/host/plot/chart.h"
#include "firmware/host/plot/plot_style.h"
#include "motion/core/fixed.h"

/* What a panel shows: the four quantities, then the following error. */
enum plot_row {
    PLOT_POS,
    PLOT_VEL,
    PLOT_ACC,
    PLOT_JERK,
    PLOT_FOLLOWING,
    PLOT_ROWS_MAX
};

static const struct {
    const char *name, *along; /* of an axis; along a path */
    const char *per;
} plot_row[PLOT_ROWS_MAX] = {
    { "Position", "Distance", "" },
    { "Velocity", "Path speed", "/s" },
    { "Acceleration", "Acceleration along", "/s\u00b2" },
    { "Jerk", "Jerk along", "/s\u00b3" },
    { "Following error", "", "" },
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

/* --- columns: the axes, then what runs along the path --- */

static unsigned plot_columns(const struct job *job)
{
    return job->move.axis_count + (job->outcome.has_path ? 1 : 0);
}

static bool plot_is_path(const struct plot_panel *panel)
{
    return panel->axis == panel->plot->job->move.axis_count;
}

static const struct motion_track *plot_track_of(const struct plot_panel *panel)
{
    const struct job *job = panel->plot->job;
    return plot_is_path(panel) ? &job->outcome.distance
                               : &job->track[panel->axis];
}

static const char *plot_unit(const struct plot_panel *panel)
{
    const struct job *job = panel->plot->job;
    return units_axis_text(plot_is_path(panel)
                               ? path_report_unit(job)
                               : job_rig_axis(job, panel->axis)->unit);
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

/* No servo follows a path as such. */
static unsigned plot_rows(const struct plot *plot, unsigned axis)
{
    return axis < plot->job->move.axis_count ? plot->rows : PLOT_FOLLOWING;
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

/* --- what is drawn: planned curves --- */

typedef void plot_point(struct plot_panel *panel, double t, double value);

static double plot_quantity(const struct motion_state *state, enum plot_row row)
{
    const double value[] = {
        [PLOT_POS] = number_double(state->pos_q32, 32),
        [PLOT_VEL] = number_double(state->vel_q32, 32),
        [PLOT_ACC] = number_double(state->acc_q32, 32),
        [PLOT_JERK] = number_double(state->jerk_q32, 32),
    };
    return value[row];
}

/* Steps per segment: two pixels each, one where the curve is a line. */
static unsigned plot_steps(const struct plot_panel *panel,
                           const struct motion_segment *segment)
{
    double seconds = number_double(segment->dur_ns_q12, 12) / 1e9;
    double pixels = seconds / panel->plot->end_s * panel->plot->column_width;
    if (segment->degree <= (unsigned)panel->row + 1)
        return 1;
    return (unsigned)fmin(fmax(pixels / 2, 2), 4096);
}

/* Both ends of every segment are drawn from inside it, so a step at a border
 * comes out as a vertical line. */
static void plot_segment(struct plot_panel *panel,
                         const struct motion_segment *segment,
                         plot_point *point)
{
    unsigned steps = plot_steps(panel, segment);
    double start_s = number_double(segment->start_ns_q12, 12) / 1e9;
    double dur_s = number_double(segment->dur_ns_q12, 12) / 1e9;
    for (unsigned i = 0; i <= steps; i++) {
        struct motion_state state;
        int64_t t_ns_q12 = segment->dur_ns_q12;
        if (i < steps) /* dur / steps first: dur is below 2^60 */
            t_ns_q12 = segment->dur_ns_q12 / steps * i;
        motion_segment_state(segment, t_ns_q12, &state);
        point(panel, start_s + dur_s * i / steps,
              plot_quantity(&state, panel->row));
    }
}

/* Of a compiled move, whose track is a window, from the file. */
static void plot_segments(struct plot_panel *panel, plot_point *point)
{
    const struct motion_track *track = plot_track_of(panel);
    struct compiled_walk walk = { .compiled = panel->plot->job->compiled,
                                  .axis = panel->axis };
    const struct motion_segment *segment;
    if (walk.compiled != NULL) {
        while ((segment = compiled_walk_next(&walk)) != NULL)
            plot_segment(panel, segment, point);
        return;
    }
    for (uint32_t i = 0; i < track->count; i++)
        plot_segment(panel, &track->segment[i], point);
}

static void plot_track(struct plot_panel *panel, plot_point *point)
{
    const struct motion_track *track = plot_track_of(panel);
    double rest =
        panel->row == PLOT_POS ? number_double(track->end.pos_q32, 32) : 0;
    bool curve = panel->row == PLOT_POS;
    if (!curve || track->end_ns_q12 == 0)
        point(panel, 0, rest);
    plot_segments(panel, point);
    if (!curve)
        point(panel, number_double(track->end_ns_q12, 12) / 1e9, 0);
    point(panel, panel->plot->end_s, rest);
}

/* --- what is drawn: the run --- */

static unsigned plot_rig_axis(const struct plot_panel *panel)
{
    return panel->plot->job->rig_axis[panel->axis];
}

static void plot_demand(struct plot_panel *panel, plot_point *point)
{
    const struct trace *trace = panel->plot->trace;
    for (size_t i = 0; i < trace->count; i++)
        point(panel, trace->t_s[i],
              trace_at(trace, i, plot_rig_axis(panel))->demand[panel->row]);
}

static void plot_actual(struct plot_panel *panel, plot_point *point)
{
    const struct trace *trace = panel->plot->trace;
    bool velocity = panel->row == PLOT_VEL;
    for (size_t i = 0; i < trace->count; i++) {
        const struct trace_axis *at = trace_at(trace, i, plot_rig_axis(panel));
        point(panel, trace->t_s[i], velocity ? at->actual_vel : at->actual);
    }
}

static void plot_following(struct plot_panel *panel, plot_point *point)
{
    const struct trace *trace = panel->plot->trace;
    for (size_t i = 0; i < trace->count; i++) {
        const struct trace_axis *at = trace_at(trace, i, plot_rig_axis(panel));
        point(panel, trace->t_s[i], at->following_min);
        point(panel, trace->t_s[i], at->following_max);
    }
}

/* --- scales --- */

static void plot_grow(struct plot_panel *panel, double t, double value)
{
    (void)t;
    panel->min = fmin(panel->min, value);
    panel->max = fmax(panel->max, value);
}

static bool plot_has_servo(const struct plot_panel *panel)
{
    return panel->plot->trace != NULL && panel->row <= PLOT_VEL &&
           !plot_is_path(panel);
}

static bool plot_is_warped(const struct plot_panel *panel)
{
    return panel->plot->trace != NULL && panel->plot->trace->warped &&
           !plot_is_path(panel);
}

static void plot_keep_peak(struct plot_panel *panel)
{
    panel->peak = fmax(-panel->min, panel->max);
    if (panel->row == PLOT_FOLLOWING || plot_is_warped(panel))
        return;
    panel->peak = number_double(
        job_peak(plot_track_of(panel), (enum motion_quantity)panel->row, NULL),
        32);
}

/* Curves that are compared have common scales.  The peak is the panel's own. */
static void plot_measure_others(struct plot_panel *panel)
{
    unsigned axis = panel->axis;
    for (unsigned i = 0; i < panel->plot->job->move.axis_count; i++) {
        panel->axis = i;
        plot_track(panel, plot_grow);
    }
    panel->axis = axis;
}

static void plot_measure(struct plot_panel *panel)
{
    panel->min = INFINITY;
    panel->max = -INFINITY;
    if (panel->row == PLOT_FOLLOWING) {
        plot_following(panel, plot_grow);
        plot_keep_peak(panel);
        return;
    }
    if (plot_is_warped(panel)) {
        plot_demand(panel, plot_grow);
        plot_keep_peak(panel);
    }
    plot_track(panel, plot_grow);
    if (!plot_is_warped(panel))
        plot_keep_peak(panel);
    if (plot_has_servo(panel))
        plot_actual(panel, plot_grow);
    if (panel->plot->job->compared)
        plot_measure_others(panel);
}

static void plot_limits(struct plot_panel *panel)
{
    const struct rig_axis *axis;
    unsigned order = (unsigned)panel->row;
    if (plot_is_path(panel))
        return;
    axis = job_rig_axis(panel->plot->job, panel->axis);
    if (panel->row == PLOT_FOLLOWING) {
        panel->limit_high = number_double(axis->following_floor_q32, 32);
    } else if (order > 0) {
        panel->limit_high =
            number_double(job_limit_of(&axis->limit, order), 32);
    } else {
        panel->limit_low = number_double(axis->limit.pos_min_q32, 32);
        panel->limit_high = number_double(axis->limit.pos_max_q32, 32);
        panel->limited = panel->limit_low < panel->limit_high;
        return;
    }
    panel->limit_low = -panel->limit_high;
    panel->limited = panel->limit_high > 0;
}

/* A limit is worth showing when the curve fills at least this part of the way
 * to it; else the curve would be a flat line. */
#define PLOT_WORTH 0.4

static bool plot_is_near(const struct plot_panel *panel, double limit)
{
    double span = panel->max - panel->min;
    if (panel->row == PLOT_POS) {
        double gap =
            limit > panel->max ? limit - panel->max : panel->min - limit;
        return gap <= 0.3 * span;
    }
    double peak = limit > 0 ? panel->max : -panel->min;
    return peak >= PLOT_WORTH * fabs(limit);
}

static void plot_range(struct plot_panel *panel)
{
    struct chart *chart = &panel->chart;
    if (panel->row != PLOT_POS) {
        panel->min = fmin(panel->min, 0);
        panel->max = fmax(panel->max, 0);
    }
    chart->low = panel->min;
    chart->high = panel->max;
    bool near_low = panel->limited && plot_is_near(panel, panel->limit_low);
    bool near_high = panel->limited && plot_is_near(panel, panel->limit_high);
    if (near_low)
        chart->low = fmin(chart->low, panel->limit_low);
    if (near_high)
        chart->high = fmax(chart->high, panel->limit_high);
    panel->off_scale = panel->limited && !near_low && !near_high;
    double span = chart->high - chart->low;
    double least = 1e-6 * fmax(fabs(chart->low), fabs(chart->high));
    if (span <= least)
        span = fmax(2 * least, panel->row == PLOT_FOLLOWING ? 1e-6 : 1);
    chart->low -= 0.08 * span;
    chart->high += 0.08 * span;
    panel->scale =
        chart_scale(fmax(fabs(chart->low), fabs(chart->high)), &panel->prefix);
}

/* --- drawing a panel --- */

static void plot_line(struct plot_panel *panel, double t, double value)
{
    chart_line_to(&panel->chart, t, value);
}

static void plot_stroke(struct plot_panel *panel,
                        void (*curve)(struct plot_panel *, plot_point *),
                        const struct chart_color *color, double width)
{
    chart_line_begin(&panel->chart);
    curve(panel, plot_line);
    chart_line_end(&panel->chart, color, width);
}

static void plot_curves(struct plot_panel *panel)
{
    if (panel->row == PLOT_FOLLOWING) {
        plot_stroke(panel, plot_following, &plot_error, 0.9);
        return;
    }
    if (plot_has_servo(panel))
        plot_stroke(panel, plot_actual, &plot_servo, 4.5);
    if (plot_is_warped(panel)) {
        plot_stroke(panel, plot_track, &plot_nominal, 1.2);
        plot_stroke(panel, plot_demand, &plot_plan, 1.8);
    } else {
        plot_stroke(panel, plot_track, &plot_plan, 1.8);
    }
}

static double plot_key_s(const struct plan_key *key)
{
    return number_double(key->key.t_ns_q12, 12) / 1e9;
}

/* Keys closer than this many pixels, on average, are not drawn. */
#define PLOT_KEY_SPACE 6

static bool plot_shows_keys(const struct plot_panel *panel)
{
    if (plot_is_path(panel))
        return false;
    const struct plan_axis *axis = &panel->plot->job->move.axis[panel->axis];
    return !plot_is_warped(panel) && panel->row != PLOT_FOLLOWING &&
           !panel->plot->job->outcome.is_bent &&
           axis->key_count * PLOT_KEY_SPACE < panel->plot->column_width;
}

static void plot_key_lines(const struct plot_panel *panel)
{
    if (!plot_shows_keys(panel))
        return;
    const struct plan_axis *axis = &panel->plot->job->move.axis[panel->axis];
    for (uint32_t i = 0; i < axis->key_count; i++)
        chart_vertical(&panel->chart, plot_key_s(&axis->key[i]), &plot_key);
}

static void plot_key_markers(const struct plot_panel *panel)
{
    if (panel->row != PLOT_POS || !plot_shows_keys(panel))
        return;
    const struct plan_axis *axis = &panel->plot->job->move.axis[panel->axis];
    for (uint32_t i = 0; i < axis->key_count; i++)
        chart_marker(&panel->chart, plot_key_s(&axis->key[i]),
                     number_double(axis->key[i].key.pos_q32, 32), 4,
                     &plot_plan);
}

/* --- shots: notches at the upper edge of every panel --- */

#define PLOT_NOTCH 9

static bool plot_has_shots(const struct plot *plot)
{
    for (unsigned i = 0; i < plot->job->rig.line_count; i++)
        if (plot->job->shots[i].count > 0)
            return true;
    return false;
}

/* Two of them on one pixel look like one. */
static void plot_notch(const struct plot_panel *panel, double t, double *last_x)
{
    const double x = chart_x(&panel->chart, t);
    if (x - *last_x < 0.5 && x >= *last_x)
        return;
    *last_x = x;
    chart_notch(&panel->chart, t, PLOT_NOTCH, &plot_shot);
}

static void plot_shot_marks(const struct plot_panel *panel)
{
    const struct trace *trace = panel->plot->trace;
    const struct job *job = panel->plot->job;
    double last_x = -1;
    for (size_t i = 0; trace != NULL && i < trace->shots; i++)
        plot_notch(panel, trace->shot_s[i], &last_x);
    for (unsigned i = 0; trace == NULL && i < job->rig.line_count; i++)
        for (uint32_t k = 0; k < job->shots[i].count; k++)
            plot_notch(panel,
                       number_double(job->shots[i].t_ns_q12[k], 12) / 1e9,
                       &last_x);
}

/* Three significant digits, or all of a whole number; "45", not "45.0". */
static void plot_put_number(char text[CHART_LABEL_MAX], double value)
{
    double magnitude = fabs(value);
    double step = magnitude > 0 ? pow(10, floor(log10(magnitude)) - 2) : 1;
    while (step < 1 && fabs(remainder(value, 10 * step)) < step / 2)
        step *= 10;
    chart_label(text, value, fmin(step, 1));
}

/* Of two curves the one that steps looks calmer where its derivative is not
 * drawn: velocity steps are infinite acceleration.  What rounding can leave is
 * far below 2^-10. */
static bool plot_note_step(const struct plot_panel *panel, char *text,
                           size_t size)
{
    const struct plot *plot = panel->plot;
    struct motion_continuity step;
    motion_track_continuity(plot_track_of(panel), &step);
    bool vel = step.vel_step_q32 >> 22 != 0 && panel->row >= PLOT_ACC;
    bool acc = step.acc_step_q32 >> 22 != 0 && panel->row == PLOT_JERK;
    if (!plot->job->compared || panel->row == PLOT_FOLLOWING || !(vel || acc))
        return false;
    snprintf(text, size, "infinite: %s steps",
             vel ? "velocity" : "acceleration");
    return true;
}

/* "peak 351.6 of 400, 88 %": right of the heading, never over a curve. */
static void plot_note_of(const struct plot_panel *panel, char *text,
                         size_t size)
{
    double peak = panel->peak;
    char value[CHART_LABEL_MAX], limit[CHART_LABEL_MAX];
    plot_put_number(value, peak / panel->scale);
    plot_put_number(limit, panel->limit_high / panel->scale);
    const char *word = panel->row == PLOT_FOLLOWING ? "worst" : "peak";
    if (plot_note_step(panel, text, size))
        return;
    if (panel->row == PLOT_POS && plot_is_path(panel)) {
        snprintf(text, size, "%s in all", value);
    } else if (panel->row == PLOT_POS) {
        char low[CHART_LABEL_MAX], high[CHART_LABEL_MAX];
        plot_put_number(low, panel->limit_low / panel->scale);
        plot_put_number(high, panel->limit_high / panel->scale);
        snprintf(text, size, "limits %s \u2026 %s", low, high);
    } else if (!panel->limited) {
        snprintf(text, size, "%s %s, no limit", word, value);
    } else {
        snprintf(text, size, "%s %s of %s%s (%.0f %%)", word, value,
                 panel->off_scale ? "\u2191" : "", limit,
                 fmax(ceil(100 * peak / panel->limit_high - 1e-9), 0));
    }
}

static void plot_headings(const struct plot_panel *panel)
{
    const struct plot *plot = panel->plot;
    const struct chart_box *box = &panel->chart.box;
    const char *unit = plot_unit(panel);
    char text[96], note[128];
    double x = box->x, y = box->y - 9;
    x += chart_text(plot->cairo, &plot_heading, x, y, CHART_LEFT,
                    plot_is_path(panel) ? plot_row[panel->row].along
                                        : plot_row[panel->row].name);
    snprintf(text, sizeof text, "  %s%s%s", panel->prefix, unit,
             plot_row[panel->row].per);
    chart_text(plot->cairo, &plot_note, x, y, CHART_LEFT, text);
    plot_note_of(panel, note, sizeof note);
    chart_text(plot->cairo, &plot_note, box->x + box->width, y, CHART_RIGHT,
               note);
}

static void plot_draw_panel(struct plot *plot, unsigned axis, unsigned row)
{
    struct plot_panel panel = {
        .plot = plot,
        .axis = axis,
        .row = (enum plot_row)row,
        .chart = { .cairo = plot->cairo,
                   .box = plot_box(plot, axis, row),
                   .t1 = plot->end_s },
    };
    bool last = row + 1 == plot_rows(plot, axis);
    plot_measure(&panel);
    plot_limits(&panel);
    plot_range(&panel);
    chart_grid_times(&panel.chart, &plot_tick, last);
    chart_grid_values(&panel.chart, &plot_tick, panel.scale);
    if (panel.limited) {
        chart_shade(&panel.chart, panel.limit_high, true, &plot_beyond,
                    &plot_limit);
        chart_shade(&panel.chart, panel.limit_low, false, &plot_beyond,
                    &plot_limit);
    }
    plot_key_lines(&panel);
    plot_shot_marks(&panel);
    chart_frame(&panel.chart, &plot_frame);
    plot_curves(&panel);
    plot_key_markers(&panel);
    plot_headings(&panel);
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
        plot_draw_panel(plot, axis, row);
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
