/* firmware/host/recording/trace.c - see trace.h. */
#include "firmware/host/recording/trace.h"

#include <math.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "motion/core/fixed.h"

void trace_init(struct trace *trace, const struct rig *rig)
{
    *trace = (struct trace){ .stride = 1, .rig = rig };
    trace->point = memory_new((size_t)TRACE_POINTS * rig->axis_count,
                              sizeof *trace->point);
}

void trace_free(struct trace *trace)
{
    memory_free(trace->point);
    trace->point = NULL;
    trace->count = 0;
}

static struct trace_axis *trace_row(struct trace *trace, size_t index)
{
    return trace->point + index * trace->rig->axis_count;
}

const struct trace_axis *trace_at(const struct trace *trace, size_t index,
                                  unsigned axis)
{
    return trace->point + index * trace->rig->axis_count + axis;
}

static bool trace_is_worse(const struct trace_axis *a,
                           const struct trace_axis *b)
{
    return a->worst * b->worst_allowed > b->worst * a->worst_allowed;
}

/* Later values win; the following error keeps its span and what was worst. */
static void trace_merge(struct trace_axis *into, const struct trace_axis *next)
{
    double low = fmin(into->following_min, next->following_min);
    double high = fmax(into->following_max, next->following_max);
    const double allowed = fmin(into->allowed, next->allowed);
    const struct trace_axis worst = trace_is_worse(into, next) ? *into : *next;
    *into = *next;
    into->following_min = low;
    into->following_max = high;
    into->allowed = allowed;
    into->worst = worst.worst;
    into->worst_allowed = worst.worst_allowed;
}

static void trace_halve(struct trace *trace)
{
    for (size_t i = 0; i < TRACE_POINTS / 2; i++) {
        struct trace_axis *to = trace_row(trace, i);
        for (unsigned a = 0; a < trace->rig->axis_count; a++) {
            struct trace_axis merged = *trace_at(trace, 2 * i, a);
            trace_merge(&merged, trace_at(trace, 2 * i + 1, a));
            to[a] = merged;
        }
        trace->t_s[i] = trace->t_s[2 * i + 1];
    }
    trace->count = TRACE_POINTS / 2;
    trace->stride *= 2;
}

static struct trace_axis trace_convert(const struct telemetry_axis *axis,
                                       const struct rig_axis *rig)
{
    const double following = number_double(axis->following_q32, 32);
    const uint64_t speed_q32 = motion_fixed_abs(axis->demand.vel_q32);
    const double allowed = number_double(
        rig_axis_following_q32(rig, speed_q32 > INT64_MAX ? INT64_MAX
                                                          : (int64_t)speed_q32),
        32);
    return (struct trace_axis){
        .demand = { number_double(axis->demand.pos_q32, 32),
                    number_double(axis->demand.vel_q32, 32),
                    number_double(axis->demand.acc_q32, 32),
                    number_double(axis->demand.jerk_q32, 32) },
        .actual = number_double(axis->actual_q32, 32),
        .actual_vel = number_double(axis->actual_vel_q32, 32),
        .following_min = following,
        .following_max = following,
        .worst = fabs(following),
        .worst_allowed = allowed,
        .allowed = allowed,
    };
}

static int64_t trace_path_ns(const struct telemetry_row *row)
{
    return row->rate.s_ns_q12 / MOTION_FIXED_NS_Q12;
}

/* More than a microsecond between clock and path: hold or override. */
static bool trace_is_warped(const struct trace *trace,
                            const struct telemetry_row *row)
{
    int64_t apart_ns = row->t_ns - trace->start_ns - trace_path_ns(row);
    return row->phase == TELEMETRY_MOVE &&
           (apart_ns > 1000 || apart_ns < -1000);
}

static void trace_shots(struct trace *trace, const struct telemetry_row *row)
{
    for (unsigned i = 0; i < row->shot_count; i++)
        if (row->shot[i].number > 0 && trace->shots < TRACE_SHOTS)
            trace->shot_s[trace->shots++] =
                (double)(row->shot[i].t_ns - trace->start_ns) / 1e9;
}

void trace_take(void *context, const struct telemetry_row *row)
{
    struct trace *trace = context;
    if (trace->count == 0 && row->phase != TELEMETRY_MOVE) {
        trace->start_ns = row->t_ns; /* it may start right after this tick */
        return;
    }
    trace_shots(trace, row);
    if (trace->pending == 0 && trace->count == TRACE_POINTS)
        trace_halve(trace);
    trace->count += trace->pending == 0;
    struct trace_axis *to = trace_row(trace, trace->count - 1);
    for (unsigned a = 0; a < trace->rig->axis_count; a++) {
        struct trace_axis next =
            trace_convert(&row->axis[a], &trace->rig->axis[a]);
        if (trace->pending == 0)
            to[a] = next;
        else
            trace_merge(&to[a], &next);
    }
    trace->t_s[trace->count - 1] = (double)(row->t_ns - trace->start_ns) / 1e9;
    trace->end_s = trace->t_s[trace->count - 1];
    trace->warped |= trace_is_warped(trace, row);
    trace->pending = (trace->pending + 1) % trace->stride;
}
