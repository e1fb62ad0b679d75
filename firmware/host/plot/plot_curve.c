/* firmware/host/plot/plot_curve.c - the points of a panel's curves, and its
 * scale. */
#include <math.h>

#include "firmware/host/base/number.h"
#include "firmware/host/plot/plot_panel.h"
#include "firmware/host/track/compiled.h"
#include "motion/core/fixed.h"

bool plot_is_path(const struct plot_panel *panel)
{
    return panel->axis == panel->plot->job->move.axis_count;
}

const struct motion_track *plot_track_of(const struct plot_panel *panel)
{
    const struct job *job = panel->plot->job;
    return plot_is_path(panel) ? &job->outcome.distance
                               : &job->track[panel->axis];
}

/* --- planned curves --- */

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

void plot_track(struct plot_panel *panel, plot_point *point)
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

/* --- the run --- */

static unsigned plot_rig_axis(const struct plot_panel *panel)
{
    return panel->plot->job->rig_axis[panel->axis];
}

void plot_demand(struct plot_panel *panel, plot_point *point)
{
    const struct trace *trace = panel->plot->trace;
    for (size_t i = 0; i < trace->count; i++)
        point(panel, trace->t_s[i],
              trace_at(trace, i, plot_rig_axis(panel))->demand[panel->row]);
}

void plot_actual(struct plot_panel *panel, plot_point *point)
{
    const struct trace *trace = panel->plot->trace;
    bool velocity = panel->row == PLOT_VEL;
    for (size_t i = 0; i < trace->count; i++) {
        const struct trace_axis *at = trace_at(trace, i, plot_rig_axis(panel));
        point(panel, trace->t_s[i], velocity ? at->actual_vel : at->actual);
    }
}

void plot_following(struct plot_panel *panel, plot_point *point)
{
    const struct trace *trace = panel->plot->trace;
    for (size_t i = 0; i < trace->count; i++) {
        const struct trace_axis *at = trace_at(trace, i, plot_rig_axis(panel));
        point(panel, trace->t_s[i], at->following_min);
        point(panel, trace->t_s[i], at->following_max);
    }
}

void plot_allowed(struct plot_panel *panel, plot_point *point)
{
    const struct trace *trace = panel->plot->trace;
    for (size_t i = 0; i < trace->count; i++)
        point(panel, trace->t_s[i],
              trace_at(trace, i, plot_rig_axis(panel))->allowed);
}

/* --- scales --- */

static void plot_grow(struct plot_panel *panel, double t, double value)
{
    (void)t;
    panel->min = fmin(panel->min, value);
    panel->max = fmax(panel->max, value);
}

bool plot_has_servo(const struct plot_panel *panel)
{
    return panel->plot->trace != NULL && panel->row <= PLOT_VEL &&
           !plot_is_path(panel);
}

bool plot_is_warped(const struct plot_panel *panel)
{
    return panel->plot->trace != NULL && panel->plot->trace->warped &&
           !plot_is_path(panel);
}

static void plot_keep_peak(struct plot_panel *panel)
{
    panel->peak = fmax(-panel->min, panel->max);
    if (plot_is_warped(panel))
        return;
    panel->peak = number_double(
        job_peak(plot_track_of(panel), (enum motion_quantity)panel->row, NULL),
        32);
}

/* The following error that was nearest to its limit, and that limit. */
static void plot_keep_worst(struct plot_panel *panel)
{
    const struct trace *trace = panel->plot->trace;
    for (size_t i = 0; i < trace->count; i++) {
        const struct trace_axis *at = trace_at(trace, i, plot_rig_axis(panel));
        if (i > 0 &&
            at->worst * panel->limit_high <= panel->peak * at->worst_allowed)
            continue;
        panel->peak = at->worst;
        panel->limit_high = at->worst_allowed;
    }
}

/* Curves of one axis that are compared have common scales.  The peak is the
 * panel's own. */
static void plot_measure_others(struct plot_panel *panel)
{
    const struct job *job = panel->plot->job;
    unsigned axis = panel->axis;
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        if (job->rig_axis[i] != job->rig_axis[axis])
            continue;
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
        plot_keep_worst(panel);
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
    if (panel->row == PLOT_POS) {
        panel->limit_low = number_double(axis->limit.pos_min_q32, 32);
        panel->limit_high = number_double(axis->limit.pos_max_q32, 32);
        panel->limited = panel->limit_low < panel->limit_high;
        return;
    }
    if (panel->row != PLOT_FOLLOWING)
        panel->limit_high =
            number_double(job_limit_of(&axis->limit, order), 32);
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
void plot_scale(struct plot_panel *panel)
{
    plot_measure(panel);
    plot_limits(panel);
    plot_range(panel);
}
