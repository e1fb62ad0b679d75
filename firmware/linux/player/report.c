/* firmware/linux/player/report.c - see report.h. */
#include "firmware/linux/player/report.h"

#include <string.h>

#include "hal/support/crc32.h"
#include "motion/core/fixed.h"

void report_init(struct report *report, const struct job *job)
{
    report_free(report);
    memset(report, 0, sizeof *report);
    report->job = job;
    report->axis = memory_pool_new(&report->memory, job->move.axis_count,
                                   sizeof *report->axis);
    report->bus = memory_pool_new(&report->memory, job->rig.bus_count,
                                  sizeof *report->bus);
    report->torque = memory_pool_new(&report->memory, job->rig.axis_count,
                                     sizeof *report->torque);
}

void report_free(struct report *report)
{
    memory_pool_free(&report->memory);
}

static void report_most(int64_t *most, int64_t value)
{
    uint64_t magnitude = motion_fixed_abs(value);
    if (magnitude > (uint64_t)*most)
        *most = magnitude > INT64_MAX ? INT64_MAX : (int64_t)magnitude;
}

static void report_take_axis(struct report *report, unsigned i,
                             const struct telemetry_row *row)
{
    struct report_axis *axis = &report->axis[i];
    const struct telemetry_axis *at = &row->axis[report->job->rig_axis[i]];
    report_most(&axis->peak[1], at->demand.vel_q32);
    report_most(&axis->peak[2], at->demand.acc_q32);
    report_most(&axis->peak[3], at->demand.jerk_q32);
    report_most(&axis->following_q32, at->following_q32);
    axis->end_q32 = at->actual_q32;
    if (axis->arrived || row->phase != TELEMETRY_MOVE)
        return;
    axis->dur_ns = row->t_ns - report->start_ns;
    axis->arrived = row->rate.s_ns_q12 >= report->job->track[i].end_ns_q12;
}

/* An axis whose torque was taken runs out after its set point stands: it moves
 * where it would be over its floor within 100 ms. */
static void report_take_still(struct report_axis *axis,
                              const struct rig_axis *rig,
                              const struct telemetry_axis *at, int64_t t_ns)
{
    const uint64_t floor_q32 = (uint64_t)rig->following_floor_q32;
    const uint64_t pos_q32 = (uint64_t)at->actual_q32;
    const uint64_t still_q32 = (uint64_t)axis->still_q32;
    const uint64_t off_q32 = at->actual_q32 > axis->still_q32
                                 ? pos_q32 - still_q32
                                 : still_q32 - pos_q32;
    axis->moves = motion_fixed_abs(at->actual_vel_q32) / 10 > floor_q32;
    if (axis->still_ns != 0 && off_q32 <= floor_q32)
        return;
    axis->still_q32 = at->actual_q32;
    axis->still_ns = t_ns;
}

static void report_take_fault(struct report *report,
                              const struct telemetry_row *row)
{
    if (row->is_fault && report->fault_ns == 0)
        report->fault_ns = row->t_ns;
    if (row->state == (int)CONTROLLER_FAULT && report->fault_stop_ns == 0)
        report->fault_stop_ns = row->t_ns;
}

/* Byte by byte, the lowest first: the same number on every machine.  How long a
 * frame was waited for does not make another take of it. */
static void report_take_set_points(struct report *report,
                                   const struct telemetry_row *row)
{
    if (row->waits_for > 0 && row->rate.rate_q30 == 0)
        return;
    for (unsigned i = 0; i < report->job->move.axis_count; i++) {
        const uint64_t pos =
            (uint64_t)row->axis[report->job->rig_axis[i]].demand.pos_q32;
        uint8_t byte[8];
        if (job_runs_by_drive_profile(report->job, i))
            continue;
        for (unsigned k = 0; k < 8; k++)
            byte[k] = (uint8_t)(pos >> 8 * k);
        report->set_points_crc32 =
            crc32_of(report->set_points_crc32, byte, sizeof byte);
    }
}

void report_take(struct report *report, const struct telemetry_row *row)
{
    report->started |= row->phase == TELEMETRY_MOVE;
    report_take_fault(report, row);
    for (unsigned i = 0; i < report->job->move.axis_count; i++) {
        const struct telemetry_axis *at = &row->axis[report->job->rig_axis[i]];
        report_take_still(&report->axis[i],
                          &report->job->rig.axis[report->job->rig_axis[i]], at,
                          row->t_ns);
        report->axis[i].events = at->events;
        report_warning_take(&report->axis[i].warnings, &at->warning, row->t_ns);
    }
    for (unsigned i = 0; i < report->job->rig.bus_count; i++) {
        struct report_bus *bus = &report->bus[i];
        if (bus->warnings == 0)
            bus->warned_ns = row->t_ns;
        bus->warnings = row->bus_warnings[i];
    }
    if (!report->started)
        report->start_ns = row->t_ns; /* started right after this tick */
    if (!report->started || row->phase == TELEMETRY_STOP)
        return;
    if (row->phase == TELEMETRY_MOVE) {
        report->played_ns = row->t_ns - report->start_ns;
        report->path_ns_q12 = row->rate.s_ns_q12;
        report_take_set_points(report, row);
    }
    for (unsigned i = 0; i < report->job->move.axis_count; i++)
        report_take_axis(report, i, row);
}

int64_t report_stopped_ns(const struct report *report)
{
    int64_t stopped_ns = report->fault_stop_ns;
    for (unsigned i = 0; i < report->job->move.axis_count; i++) {
        const struct report_axis *axis = &report->axis[i];
        if (stopped_ns == 0 || axis->moves || report->torque_left)
            return 0;
        if (axis->still_ns > stopped_ns)
            stopped_ns = axis->still_ns;
    }
    return stopped_ns;
}

/* Where the axis should be at the end: its last key, or where the path was
 * left. */
static int64_t report_goal(const struct report *report, unsigned i)
{
    struct motion_state state;
    const struct motion_track *track = &report->job->track[i];
    if (report->path_ns_q12 >= track->end_ns_q12)
        return track->end.pos_q32;
    motion_track_state(track, report->path_ns_q12, &state);
    return state.pos_q32;
}

int64_t report_end_error(const struct report *report, unsigned i)
{
    return report_goal(report, i) - report->axis[i].end_q32;
}
