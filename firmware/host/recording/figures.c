/* firmware/host/recording/figures.c - see figures.h. */
#include "firmware/host/recording/figures.h"

#include <math.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "motion/core/fixed.h"

void figures_init(struct figures *figures, const struct rig *rig,
                  int64_t period_ns)
{
    struct memory_pool *memory = &figures->memory;
    *figures = (struct figures){ .rig = rig, .period_ns = period_ns };
    figures->shots =
        memory_pool_new(memory, RIG_TRIGGERS_MAX, sizeof *figures->shots);
    figures->late_us =
        memory_pool_new(memory, FIGURES_LATE_US + 1, sizeof *figures->late_us);
}

void figures_free(struct figures *figures)
{
    memory_pool_free(&figures->memory);
}

static void figures_most(int64_t *most, int64_t value)
{
    const uint64_t magnitude = motion_fixed_abs(value);
    if (magnitude > (uint64_t)*most)
        *most = magnitude > INT64_MAX ? INT64_MAX : (int64_t)magnitude;
}

static void figures_axis(struct figures *figures, unsigned i,
                         const struct telemetry_row *row)
{
    struct figures_axis *axis = &figures->axis[i];
    const struct telemetry_axis *at = &row->axis[i];
    const double following = number_double(at->following_q32, 32);
    figures_most(&axis->peak[1], at->demand.vel_q32);
    figures_most(&axis->peak[2], at->demand.acc_q32);
    figures_most(&axis->peak[3], at->demand.jerk_q32);
    if (motion_fixed_abs(at->following_q32) >
        motion_fixed_abs(axis->following_q32)) {
        axis->following_q32 = at->following_q32;
        axis->following_at_ns = row->t_ns - figures->move_ns;
    }
    axis->end_following_q32 = at->following_q32;
    axis->squares += following * following;
}

static void figures_clock(struct figures *figures,
                          const struct telemetry_row *row)
{
    const int64_t gap_ns = row->t_ns - figures->last_ns;
    const int64_t late_us = row->late_ns / 1000;
    if (figures->rows > 0) {
        figures->phase_ns[row->phase] += gap_ns;
        if (figures->period_ns > 0 && row->number == figures->last_number + 1 &&
            gap_ns > figures->period_ns)
            figures->ticks_lost += (uint64_t)(gap_ns / figures->period_ns - 1);
    }
    figures_most(&figures->late_ns, row->late_ns);
    figures->late_us[late_us < 0                 ? 0
                     : late_us > FIGURES_LATE_US ? FIGURES_LATE_US
                                                 : late_us]++;
    figures->rows++;
    figures->last_ns = row->t_ns;
    figures->last_number = row->number;
}

void figures_take(struct figures *figures, const struct telemetry_row *row)
{
    figures_clock(figures, row);
    for (unsigned i = 0; i < row->shot_count; i++)
        figures->shots[i] += row->shot[i].number > 0;
    figures->moved |= row->phase == TELEMETRY_MOVE;
    if (!figures->moved)
        figures->move_ns = row->t_ns; /* it may start right after this tick */
    if (!figures->moved || row->phase == TELEMETRY_STOP)
        return;
    if (figures->axis == NULL)
        figures->axis = memory_pool_new(
            &figures->memory, figures->rig->axis_count, sizeof *figures->axis);
    figures->judged++;
    for (unsigned i = 0; i < figures->rig->axis_count; i++)
        figures_axis(figures, i, row);
}

const struct figures_axis *figures_of(const struct figures *figures,
                                      unsigned axis)
{
    static const struct figures_axis none = { .squares = 0 };
    return figures->axis != NULL ? &figures->axis[axis] : &none;
}

double figures_rms(const struct figures *figures, unsigned axis)
{
    return figures->judged == 0
               ? 0
               : sqrt(figures->axis[axis].squares / (double)figures->judged);
}

int64_t figures_late_ns(const struct figures *figures, unsigned permille)
{
    uint64_t below = 0;
    for (int64_t us = 0; us < FIGURES_LATE_US; us++) {
        below += figures->late_us[us];
        if (1000 * below >= figures->rows * permille)
            return figures->late_ns < 1000 * (us + 1) ? figures->late_ns
                                                      : 1000 * (us + 1);
    }
    return figures->late_ns;
}
