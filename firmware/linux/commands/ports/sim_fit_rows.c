/* firmware/linux/commands/ports/sim_fit_rows.c - what each axis was sent and did,
 * from a recording; see sim_fit.h.
 *
 * An axis counts from where it has stood for a while before it first moves, up
 * to SIM_FIT_ROWS rows, or the first row that is missing. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/recording/mcap_reader.h"
#include "firmware/host/recording/record_read.h"
#include "firmware/host/rig/modbus_budget.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/ports/sim_fit.h"

#define SIM_FIT_ROWS     12000
#define SIM_FIT_STAND_NS INT64_C(100000000)  /* before it moves */
#define SIM_FIT_REST_NS  INT64_C(1000000000) /* behind, for it to swing */

static void fit_rows_restart(struct sim_fit_axis *self)
{
    self->ended = self->moved;
    if (!self->moved)
        self->rows = self->stood = 0;
}

/* Standing, no more than the last of it is kept. */
static void fit_rows_forget(struct sim_fit_axis *self)
{
    const uint32_t keep = (uint32_t)(SIM_FIT_STAND_NS / self->period_ns);

    if (self->moved || self->rows < 2 * keep)
        return;
    self->rows -= keep;
    memmove(self->target, self->target + keep,
            self->rows * sizeof *self->target);
    memmove(self->actual, self->actual + keep,
            self->rows * sizeof *self->actual);
}

static void fit_rows_add(struct sim_fit_axis *self, double target,
                         double actual)
{
    const bool same = self->rows > 0 && target == self->target[self->rows - 1];

    if (self->rows == SIM_FIT_ROWS) {
        self->ended = true;
        return;
    }
    if (self->rows > 0 && !same && !self->moved &&
        self->stood * self->period_ns < SIM_FIT_STAND_NS)
        self->rows = self->stood = 0; /* it has not stood before */
    self->moved = self->moved || (self->rows > 0 && !same);
    self->stood = same ? self->stood + 1 : 0;
    self->target[self->rows] = target;
    self->actual[self->rows++] = actual;
    fit_rows_forget(self);
}

static void fit_rows_take_axis(struct sim_fit_axis *self,
                               const struct telemetry_row *row,
                               const struct telemetry_axis *axis)
{
    const bool follows = row->phase == TELEMETRY_APPROACH ||
                         row->phase == TELEMETRY_MOVE ||
                         row->phase == TELEMETRY_SETTLE;
    const int64_t since_ns = row->t_ns - self->last_ns;

    self->last_ns = row->t_ns;
    if (self->ended || self->other != NULL)
        return;
    if (!follows || (self->rows > 0 && since_ns != self->period_ns))
        fit_rows_restart(self);
    if (follows && !self->ended)
        fit_rows_add(self, round((double)axis->demand.pos_q32 * self->factor),
                     (double)axis->actual_q32 * self->factor);
}

static void fit_rows_take(void *context, const struct telemetry_row *row)
{
    struct sim_fit_all *const all = context;

    for (uint32_t i = 0; i < all->rig.axis_count; i++)
        fit_rows_take_axis(&all->axis[i], row, &row->axis[i]);
}

/* Behind its last motion an axis has a while to swing. */
static void fit_rows_end(struct sim_fit_axis *self)
{
    const uint32_t rest = (uint32_t)(SIM_FIT_REST_NS / self->period_ns);

    if (!self->moved)
        self->rows = 0;
    else if (self->stood > rest)
        self->rows -= self->stood - rest;
}

/* When a set point reaches a drive on Modbus is known to its line's cycle, in
 * which an axis goes so far; a position loop with its speed fed forward is off
 * by a / omega^2 where it accelerates. */
static const char *fit_rows_modbus(const struct rig *rig,
                                   struct sim_fit_axis *self)
{
    const struct rig_axis *const axis = self->axis;
    const double cycle_s =
        1e-9 * (double)modbus_budget_cycle_ns(rig, axis->bus);
    const double omega = 1e-3 * axis->sim.omega_mrad_s;
    const char *const unit = units_axis_text(axis->unit);

    snprintf(self->why, sizeof self->why,
             "its drive is on Modbus: in which moment of %.3g ms a set point "
             "reached it is not in the recording, and within that it goes up "
             "to %.2g %s; its servo's bandwidth shows as no more than %.2g %s",
             1e3 * cycle_s, cycle_s * number_double(axis->limit.vel_q32, 32),
             unit, number_double(axis->limit.acc_q32, 32) / (omega * omega),
             unit);
    return self->why;
}

/* Why the model is not one of this axis; NULL: it is. */
static const char *fit_rows_other(const struct rig *rig,
                                  struct sim_fit_axis *self)
{
    const struct rig_axis *const axis = self->axis;

    if (rig_axis_is_virtual(axis))
        return "it is virtual";
    if (axis->point_to_point)
        return "its drive goes by its own profile";
    if (rig_kinds[axis->kind]->samples)
        return "a board samples its move, and the recording has its place at "
               "the line's cycle alone";
    if (!rig_bus_is_can(&rig->bus[axis->bus]))
        return fit_rows_modbus(rig, self);
    if (axis->kind != RIG_CIA402)
        return NULL;
    if (rig_stream(&axis->cia402, NULL) == DRIVE_CIA402_CSV)
        return "its drive follows velocities";
    return axis->torque_q32 != 0 ? "its drive has torque feed-forward" : NULL;
}

static void fit_rows_begin(struct sim_fit_all *all)
{
    for (uint32_t i = 0; i < all->rig.axis_count; i++) {
        struct sim_fit_axis *const self = &all->axis[i];
        self->axis = &all->rig.axis[i];
        self->other = fit_rows_other(&all->rig, self);
        self->period_ns = all->rig.period_ns;
        self->factor = (double)self->axis->counts_num /
                       (double)self->axis->counts_den * 0x1p-32;
        self->target = memory_new(SIM_FIT_ROWS, sizeof *self->target);
        self->actual = memory_new(SIM_FIT_ROWS, sizeof *self->actual);
    }
}

enum status sim_fit_rows(struct sim_fit_all *all)
{
    const struct record_taker taker = { .row = fit_rows_take, .context = all };
    char message[YAML_MESSAGE_MAX];
    struct record_file file;
    int err;

    fit_rows_begin(all);
    if (mcap_reader_is_mcap(&disk_files, all->recording)) {
        err = record_read(&file, &disk_files, all->recording, &all->rig, &taker,
                          message);
        record_file_free(&file);
    } else {
        err = telemetry_read(&disk_files, all->recording, &all->rig,
                             fit_rows_take, all, message);
    }
    if (err < 0) {
        error_say("%s", message);
        return STATUS_INPUT;
    }
    for (uint32_t i = 0; i < all->rig.axis_count; i++)
        fit_rows_end(&all->axis[i]);
    return STATUS_OK;
}
