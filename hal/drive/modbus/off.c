/* hal/drive/modbus/off.c - taking torque off a drive that has a fault or was
 * lost; see drive.h for the picture. */
#include <stddef.h>

#include "hal/drive/modbus/parts.h"

#define ROUND_NS   INT64_C(500000000)  /* at least, from one to the next */
#define CONFIRM_NS INT64_C(1000000000) /* at most, for fresh answers */

bool drive_modbus_has_torque(const struct drive_modbus *self, bool unknown)
{
    return drive_modbus_status(
        self, MODBUS_STATUS_torque,
        drive_modbus_status(self, MODBUS_STATUS_enabled, unknown));
}

bool drive_modbus_rests(const struct drive_modbus *self)
{
    return !drive_modbus_status(self, MODBUS_STATUS_moving, false) &&
           hal_standstill_is(&self->standstill, self->actual_ns);
}

static bool off_is_polled(const struct drive_modbus *self)
{
    return self->fresh == (1u << self->fast_count) - 1;
}

bool drive_modbus_needs_stop(const struct drive_modbus *self)
{
    return off_is_polled(self) &&
           drive_modbus_has_torque(self, !drive_modbus_rests(self));
}

static void off_enter(struct drive_modbus *self, enum drive_modbus_off off)
{
    self->off = off;
    self->off_heard = true;
    drive_modbus_run_begin(self, off == DRIVE_MODBUS_OFF_STOP
                                     ? MODBUS_SEQUENCE_stop
                                     : MODBUS_SEQUENCE_disable);
}

/* By its last polls. */
static bool off_is_idle(const struct drive_modbus *self)
{
    return self->failures == 0 && off_is_polled(self) &&
           !drive_modbus_has_torque(self, true);
}

/* Where both write the same item. */
static bool off_is_undone_by_stop(const struct modbus_map *map)
{
    const struct modbus_map_sequence *stop =
        &map->sequence[MODBUS_SEQUENCE_stop];
    const struct modbus_map_sequence *disable =
        &map->sequence[MODBUS_SEQUENCE_disable];

    for (unsigned i = 0; i < stop->count; i++)
        for (unsigned j = 0; j < disable->count; j++)
            if (stop->step[i].kind == MODBUS_STEP_WRITE &&
                disable->step[j].kind == MODBUS_STEP_WRITE &&
                stop->step[i].item == disable->step[j].item)
                return true;
    return false;
}

/* One that does not answer may have heard the `disable` of the last round: that
 * is not undone, and not before the drive has been heard is it stopped
 * again. */
static void off_round(struct drive_modbus *self)
{
    const bool idle = off_is_idle(self);
    const bool blind = self->off_failed && self->failures > 0 &&
                       off_is_undone_by_stop(self->config.map);

    self->off_since_ns = self->now_ns;
    self->off_waits = false;
    self->stop_heard = idle || !blind;
    off_enter(self,
              idle || blind ? DRIVE_MODBUS_OFF_DISABLE : DRIVE_MODBUS_OFF_STOP);
}

void drive_modbus_off_begin(struct drive_modbus *self)
{
    self->off_failed = false;
    self->retry_ns = self->now_ns;
    off_round(self);
}

void drive_modbus_off_disable(struct drive_modbus *self)
{
    off_enter(self, DRIVE_MODBUS_OFF_DISABLE);
}

/* ---- one sequence, whatever the drive says to it ---- */

/* A drive that does not answer has the time of a stop, no more. */
static int64_t off_patience_ns(const struct drive_modbus *self,
                               const struct modbus_map_step *step)
{
    return self->failures > 0 && self->stop_ns < step->dur_ns ? self->stop_ns
                                                              : step->dur_ns;
}

static bool off_is_over(struct drive_modbus *self,
                        const struct modbus_map_step *step)
{
    const int64_t waited_ns = self->now_ns - self->run.since_ns;

    switch (step->kind) {
    case MODBUS_STEP_WRITE:
    case MODBUS_STEP_CHECK:
        return false; /* moved on by its reply */
    case MODBUS_STEP_DELAY:
        return waited_ns >= step->dur_ns;
    case MODBUS_STEP_UNTIL:
        break;
    }
    if (self->cycles >= DRIVE_MODBUS_FRESH &&
        drive_modbus_status(self, step->status, false) == (step->value != 0))
        return true;
    return waited_ns > off_patience_ns(self, step);
}

void drive_modbus_off_reply(struct drive_modbus *self,
                            const struct hal_modbus_reply *reply)
{
    const bool refused = reply->err == MOTION_E_REFUSED;

    self->run.requested = false;
    if (reply->err == MOTION_E_IO)
        return; /* nobody has heard it: again, so that none is left out */
    if (refused && drive_modbus_is_passing(reply) &&
        ++self->run.tries < DRIVE_MODBUS_STEP_TRIES)
        return;
    if (reply->err != MOTION_OK || !drive_modbus_run_checks(self, reply))
        self->off_heard = false;
    if (reply->err != MOTION_OK && !refused &&
        self->off == DRIVE_MODBUS_OFF_STOP)
        self->stop_heard = false;
    drive_modbus_run_next(self);
}

/* It says how it is before it is sent anything. */
void drive_modbus_off_heard(struct drive_modbus *self)
{
    if (drive_modbus_is_down(self) && self->off != DRIVE_MODBUS_OFF_DONE &&
        !self->stop_heard) {
        self->off_waits = true;
        self->cycles = 0;
    }
}

static void off_wait(struct drive_modbus *self)
{
    if (self->failures > 0)
        self->off_waits = false;
    else if (self->cycles >= DRIVE_MODBUS_FRESH)
        off_round(self);
}

/* ---- one step per tick ---- */

/* Confirmed writes and no torque; or twice no torque, of a drive that refuses
 * them, as it has been off meanwhile. */
static bool off_is_confirmed(const struct drive_modbus *self)
{
    return self->off_heard
               ? !drive_modbus_has_torque(self, false)
               : self->off_failed && !drive_modbus_has_torque(self, true);
}

static void off_confirm(struct drive_modbus *self)
{
    const bool fresh = self->cycles >= DRIVE_MODBUS_FRESH;
    const int64_t waited_ns = self->now_ns - self->run.since_ns;

    if (fresh && off_is_confirmed(self)) {
        self->off = DRIVE_MODBUS_OFF_DONE;
    } else if ((fresh || waited_ns > CONFIRM_NS) &&
               self->now_ns - self->off_since_ns >= ROUND_NS) {
        self->off_failed = true;
        off_round(self);
    }
}

void drive_modbus_off_step(struct drive_modbus *self)
{
    const struct modbus_map_step *step = drive_modbus_run_at(self);

    if (self->off == DRIVE_MODBUS_OFF_DONE)
        return;
    if (self->off_waits) {
        off_wait(self);
    } else if (step != NULL) {
        if (off_is_over(self, step))
            drive_modbus_run_next(self);
    } else if (self->off == DRIVE_MODBUS_OFF_STOP) {
        if (self->failures > 0 || !drive_modbus_run_rolls(self))
            off_enter(self, DRIVE_MODBUS_OFF_DISABLE);
    } else if (self->off == DRIVE_MODBUS_OFF_DISABLE) {
        self->off = DRIVE_MODBUS_OFF_CONFIRM;
        self->run.since_ns = self->now_ns;
        self->cycles = 0;
    } else {
        off_confirm(self);
    }
}
