/* firmware/host/plot/plot_panel.c - see plot_panel.h. */
#include "firmware/host/plot/plot_panel.h"

#include <math.h>

#include "firmware/host/base/number.h"
#include "firmware/host/job/path_report.h"
#include "firmware/host/plot/plot_style.h"
#include "motion/core/fixed.h"

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
static const char *plot_unit(const struct plot_panel *panel)
{
    const struct job *job = panel->plot->job;
    return units_axis_text(plot_is_path(panel)
                               ? path_report_unit(job)
                               : job_rig_axis(job, panel->axis)->unit);
}
unsigned plot_rows(const struct plot *plot, unsigned axis)
{
    return axis < plot->job->move.axis_count ? plot->rows : PLOT_FOLLOWING;
}

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

/* Where the axis comes to it. */
static double plot_key_s(const struct plot_panel *panel,
                         const struct plan_key *key)
{
    return number_double(
               key->key.t_ns_q12 + panel->plot->job->outcome.lag_ns_q12, 12) /
           1e9;
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
        chart_vertical(&panel->chart, plot_key_s(panel, &axis->key[i]),
                       &plot_key);
}

static void plot_key_markers(const struct plot_panel *panel)
{
    if (panel->row != PLOT_POS || !plot_shows_keys(panel))
        return;
    const struct plan_axis *axis = &panel->plot->job->move.axis[panel->axis];
    for (uint32_t i = 0; i < axis->key_count; i++)
        chart_marker(&panel->chart, plot_key_s(panel, &axis->key[i]),
                     number_double(axis->key[i].key.pos_q32, 32), 4,
                     &plot_plan);
}

/* --- shots: notches at the upper edge of every panel --- */

#define PLOT_NOTCH 9

bool plot_has_shots(const struct plot *plot)
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
                 fmax(ceil(100 * peak / panel->limit_high - 1e-6), 0));
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

static void plot_line_below(struct plot_panel *panel, double t, double value)
{
    chart_line_to(&panel->chart, t, -value);
}

/* What is allowed grows with the speed. */
static void plot_band(struct plot_panel *panel, int sign)
{
    chart_line_begin(&panel->chart);
    plot_allowed(panel, sign > 0 ? plot_line : plot_line_below);
    chart_shade_line(&panel->chart, sign > 0, &plot_beyond, &plot_limit);
}

void plot_draw_panel(struct plot *plot, unsigned axis, unsigned row,
                     const struct chart_box *box)
{
    struct plot_panel panel = {
        .plot = plot,
        .axis = axis,
        .row = (enum plot_row)row,
        .chart = { .cairo = plot->cairo, .box = *box, .t1 = plot->end_s },
    };
    bool last = row + 1 == plot_rows(plot, axis);
    plot_scale(&panel);
    chart_grid_times(&panel.chart, &plot_tick, last);
    chart_grid_values(&panel.chart, &plot_tick, panel.scale);
    if (panel.row == PLOT_FOLLOWING) {
        plot_band(&panel, 1);
        plot_band(&panel, -1);
    } else if (panel.limited) {
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
