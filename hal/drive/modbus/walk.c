/* hal/drive/modbus/walk.c - phases; see drive.h for the picture. */
#include <stddef.h>

#include "hal/drive/modbus/parts.h"

#define RESET_CYCLES 100 /* for a fault to be gone */

/* What START goes through, after the identification.  Only a drive that needs it
 * is stopped, and again after `init`, without which some do not obey. */
static const uint8_t walk_start[DRIVE_MODBUS_STARTS] = {
    MODBUS_SEQUENCE_stop,
    MODBUS_SEQUENCE_init,
    MODBUS_SEQUENCE_stop,
    MODBUS_SEQUENCE_disable,
};

/* ---- words ---- */

struct hal_text drive_modbus_say(struct drive_modbus *self, const char *words)
{
    struct hal_text text;

    hal_text_init(&text, self->fault_text, sizeof self->fault_text);
    hal_text_put(&text, words);
    return text;
}

bool drive_modbus_is_passing(const struct hal_modbus_reply *reply)
{
    return reply->err != MOTION_E_REFUSED || reply->exception == 5 ||
           reply->exception == 6;
}

/* Says nothing while no alarm is known. */
void drive_modbus_say_alarm(struct drive_modbus *self)
{
    const struct modbus_map *map = self->config.map;
    const uint32_t code = map->alarm == MODBUS_MAP_NO_ITEM
                              ? 0
                              : (uint32_t)self->value[map->alarm];
    const char *words = modbus_map_alarm_text(map, code);
    struct hal_text text;

    if (code == 0)
        return;
    self->fault_code = (uint16_t)code;
    text = drive_modbus_say(self, "alarm 0x");
    hal_text_hex(&text, code, code > UINT16_MAX ? 8 : 4);
    if (words != NULL) {
        hal_text_put(&text, ", ");
        hal_text_put(&text, words);
    }
}

bool drive_modbus_is_down(const struct drive_modbus *self)
{
    return self->phase == DRIVE_MODBUS_LATCHED ||
           self->phase == DRIVE_MODBUS_LOST;
}

/* It has no torque by us: we never had it moving, or it was off and has said so. */
static bool walk_is_idle(const struct drive_modbus *self)
{
    if (self->phase == DRIVE_MODBUS_RUN)
        return self->state == HAL_DRIVE_OFF &&
               !drive_modbus_has_torque(self, false);
    return self->phase == DRIVE_MODBUS_START &&
           self->off == DRIVE_MODBUS_OFF_DONE && !drive_modbus_needs_stop(self);
}

/* Send no `stop` to a drive that is idle, as that might give it torque. */
static void walk_down(struct drive_modbus *self, enum drive_modbus_phase phase,
                      enum hal_drive_state state)
{
    const bool idle = walk_is_idle(self);

    self->phase = phase;
    self->state = state;
    self->target_ns = 0;
    self->reset_requested = false;
    drive_modbus_go_drop(self);
    drive_modbus_off_begin(self);
    if (idle)
        drive_modbus_off_disable(self);
}

void drive_modbus_latch(struct drive_modbus *self)
{
    if (!drive_modbus_is_down(self))
        walk_down(self, DRIVE_MODBUS_LATCHED, HAL_DRIVE_FAULT);
}

void drive_modbus_lose(struct drive_modbus *self, enum hal_drive_state state)
{
    if (self->phase != DRIVE_MODBUS_LOST)
        walk_down(self, DRIVE_MODBUS_LOST, state);
}

bool drive_modbus_status(const struct drive_modbus *self,
                         enum modbus_map_status status, bool unknown)
{
    const struct modbus_map_condition *condition =
        &self->config.map->status[status];

    if (condition->item == MODBUS_MAP_NO_ITEM)
        return unknown;
    return modbus_map_meets(condition, self->value[condition->item]);
}

/* ---- phases ---- */

void drive_modbus_start(struct drive_modbus *self)
{
    self->phase = DRIVE_MODBUS_START;
    self->state = HAL_DRIVE_OFFLINE;
    self->run.sequence = NULL;
    self->mode = drive_modbus_first_mode(&self->config);
    self->homing = HAL_DRIVE_HOMING_NONE;
    self->zero_q32 = 0;
    self->start_at = 0;
    self->stops_found = false;
    self->cycles = 0;
    self->identified = self->config.map->identify.item == MODBUS_MAP_NO_ITEM;
    self->identify_requested = false;
    self->identify_tries = 0;
    self->parameter_at = 0;
    self->parameter_tries = 0;
    self->parameter_requested = false;
    self->fresh = 0;
    self->failures = 0;
    self->off_waits = false;
    self->actual_ns = 0;
    self->jumped = false;
    self->fault_code = 0;
    self->fault_text[0] = '\0';
}

void drive_modbus_pursue(struct drive_modbus *self)
{
    static const struct {
        enum modbus_map_sequence_name sequence;
        enum hal_drive_state state; /* until it is done */
    } rows[] = {
        [HAL_DRIVE_REQUEST_OFF] = { MODBUS_SEQUENCE_disable,
                                    HAL_DRIVE_QUICK_STOP },
        [HAL_DRIVE_REQUEST_ENABLE] = { MODBUS_SEQUENCE_enable,
                                       HAL_DRIVE_ENABLING },
        [HAL_DRIVE_REQUEST_QUICK_STOP] = { MODBUS_SEQUENCE_stop,
                                           HAL_DRIVE_QUICK_STOP },
        [HAL_DRIVE_REQUEST_TORQUE_OFF] = { MODBUS_SEQUENCE_disable,
                                           HAL_DRIVE_QUICK_STOP },
    };

    const bool off = self->request == HAL_DRIVE_REQUEST_OFF;
    const bool brakes = off && drive_modbus_runs(self, MODBUS_SEQUENCE_stop);
    const bool goes =
        off && (drive_modbus_goes(self) || !drive_modbus_rests(self));

    self->is_reached = false;
    self->target_ns = 0;
    drive_modbus_go_drop(self);
    self->state = rows[self->request].state;
    if (!brakes) /* its stop goes on to its end */
        drive_modbus_run_begin(self, goes ? MODBUS_SEQUENCE_stop
                                          : rows[self->request].sequence);
}

/* Torque is off, and nothing is wrong. */
static void walk_off(struct drive_modbus *self)
{
    self->phase = DRIVE_MODBUS_RUN;
    self->state = HAL_DRIVE_OFF;
    self->is_reached = true;
    self->run.sequence = NULL;
    self->off = DRIVE_MODBUS_OFF_DONE;
    self->alarm_requested = self->alarm_heard = false;
    self->fault_code = 0;
    self->fault_text[0] = '\0';
}

static void walk_note_found(struct drive_modbus *self)
{
    if (self->stops_found)
        return;
    self->stops_found = true;
    self->found.count++;
    self->found.vel_q32 = self->actual_vel_q32;
    self->found.goes_on = false;
}

/* False: it needs none, or has obeyed the one before `init`. */
static bool walk_start_stops(struct drive_modbus *self)
{
    if (!drive_modbus_needs_stop(self) ||
        (self->stops_found && self->off_heard && drive_modbus_rests(self)))
        return false;
    walk_note_found(self);
    self->off_heard = true;
    return true;
}

/* How it is now, its polls say; of one that cannot say that it has torque, once
 * they say whether it stands. */
static bool walk_start_is_polled(const struct drive_modbus *self)
{
    return self->cycles >= DRIVE_MODBUS_FRESH &&
           (drive_modbus_has_torque(self, false) ||
            self->actual_ns - self->first_ns >= HAL_STANDSTILL_NS);
}

static void walk_start_begin(struct drive_modbus *self)
{
    const uint8_t name = walk_start[self->start_at];
    const bool stop = name == MODBUS_SEQUENCE_stop;

    if (stop && (self->start_at == 0 || self->stops_found) &&
        !walk_start_is_polled(self))
        return;
    if (stop && !walk_start_stops(self))
        self->start_at++;
    else
        drive_modbus_run_begin(self, name);
}

/* A stop that was refused is tried again after `init`. */
static void walk_start_run(struct drive_modbus *self)
{
    const bool stop = drive_modbus_runs(self, MODBUS_SEQUENCE_stop);
    const int err = stop && self->start_at == 0 && !self->off_heard
                        ? MOTION_OK
                        : drive_modbus_run_step(self);

    if (err == MOTION_E_AGAIN)
        return;
    if (stop)
        self->found.goes_on = !drive_modbus_rests(self);
    if (err == MOTION_OK || stop) {
        self->run.sequence = NULL;
        self->start_at++;
    } else {
        drive_modbus_latch(self);
    }
}

static void walk_start_step(struct drive_modbus *self)
{
    const unsigned all = (1u << self->fast_count) - 1;

    if (!self->identified)
        return; /* the reply goes on */
    if (self->run.sequence != NULL) {
        walk_start_run(self);
    } else if (self->start_at < DRIVE_MODBUS_STARTS) {
        walk_start_begin(self);
    } else if (drive_modbus_parameters_done(self) && self->fresh == all &&
               self->actual_ns != 0) {
        walk_off(self);
        if (self->request != HAL_DRIVE_REQUEST_OFF)
            drive_modbus_pursue(self);
    }
}

static void walk_enabled(struct drive_modbus *self)
{
    self->state = HAL_DRIVE_ENABLED;
    self->first_target = true;
    self->target_ns = 0;
    self->past_count = 0;
    self->begun = self->begin_requested = false;
}

static void walk_reached(struct drive_modbus *self)
{
    if (self->request == HAL_DRIVE_REQUEST_OFF &&
        drive_modbus_runs(self, MODBUS_SEQUENCE_stop)) {
        drive_modbus_run_begin(self, MODBUS_SEQUENCE_disable);
        return;
    }
    self->is_reached = true;
    self->run.sequence = NULL;
    if (self->request == HAL_DRIVE_REQUEST_ENABLE)
        walk_enabled(self);
    else if (self->request != HAL_DRIVE_REQUEST_QUICK_STOP)
        self->state = HAL_DRIVE_OFF;
}

static void walk_request_step(struct drive_modbus *self)
{
    const bool brakes = drive_modbus_runs(self, MODBUS_SEQUENCE_stop);
    const int err = drive_modbus_run_step(self);

    if (err == MOTION_OK) {
        walk_reached(self);
    } else if (err != MOTION_E_AGAIN) {
        drive_modbus_latch(self);
        if (brakes) /* it has had its time */
            drive_modbus_off_disable(self);
    }
}

/* What runs while enabled: stream_begin once, move_go. */
static void walk_enabled_step(struct drive_modbus *self)
{
    int err;

    if (!drive_modbus_status(self, MODBUS_STATUS_enabled, true)) {
        drive_modbus_say(self, "left operation by itself");
        drive_modbus_latch(self);
        return;
    }
    if (self->run.sequence == NULL)
        return;
    err = drive_modbus_run_step(self);
    if (err == MOTION_OK && self->move == DRIVE_MODBUS_MOVE_SENT) {
        self->move = DRIVE_MODBUS_MOVE_RUNNING;
        self->moved_ns = self->now_ns;
    }
    if (err == MOTION_OK) {
        self->run.sequence = NULL;
        self->begun = self->begun || self->begin_requested;
        self->cycles = 0;
    } else if (err != MOTION_E_AGAIN) {
        drive_modbus_latch(self);
    }
}

static void walk_run_step(struct drive_modbus *self)
{
    if (drive_modbus_status(self, MODBUS_STATUS_fault, false)) {
        drive_modbus_say(self, "the drive reports an alarm");
        drive_modbus_say_alarm(self);
        drive_modbus_latch(self);
    } else if (!self->is_reached) {
        walk_request_step(self);
    } else if (self->state == HAL_DRIVE_ENABLED) {
        walk_enabled_step(self);
        drive_modbus_go_step(self);
    }
}

/* A reset waits until torque is off, or one round has shown that it does not
 * go.  Torque that comes back is taken off again. */
static void walk_latched_step(struct drive_modbus *self)
{
    const bool done = self->off == DRIVE_MODBUS_OFF_DONE;

    if (self->reset_requested && (done || self->off_failed)) {
        self->phase = DRIVE_MODBUS_RESET;
        self->off_waits = false;
        drive_modbus_run_begin(self, MODBUS_SEQUENCE_reset);
    } else if (done && drive_modbus_has_torque(self, false)) {
        drive_modbus_off_begin(self);
    } else {
        drive_modbus_off_step(self);
    }
}

static void walk_reset_step(struct drive_modbus *self)
{
    const int err = drive_modbus_run_step(self);

    if (err == MOTION_E_AGAIN)
        return;
    if (err == MOTION_OK &&
        self->run.sequence ==
            &self->config.map->sequence[MODBUS_SEQUENCE_reset]) {
        drive_modbus_run_begin(self, MODBUS_SEQUENCE_disable);
    } else if (err == MOTION_OK && self->cycles >= DRIVE_MODBUS_FRESH &&
               !drive_modbus_status(self, MODBUS_STATUS_fault, false)) {
        self->request = HAL_DRIVE_REQUEST_OFF;
        walk_off(self);
    } else if (err != MOTION_OK || self->cycles >= RESET_CYCLES) {
        drive_modbus_latch(self);
    }
}

void drive_modbus_walk(struct drive_modbus *self)
{
    switch (self->phase) {
    case DRIVE_MODBUS_START:
        walk_start_step(self);
        break;
    case DRIVE_MODBUS_RUN:
        walk_run_step(self);
        break;
    case DRIVE_MODBUS_LATCHED:
        walk_latched_step(self);
        break;
    case DRIVE_MODBUS_RESET:
        walk_reset_step(self);
        break;
    case DRIVE_MODBUS_LOST:
        drive_modbus_off_step(self);
        break; /* and waits for a reset */
    }
}
