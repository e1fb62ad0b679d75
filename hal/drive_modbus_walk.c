/* hal/drive_modbus_walk.c - phases and sequences; see drive_modbus.h for the
 * picture. */
#include <stddef.h>

#include "hal/drive_modbus_parts.h"

#define STEP_TRIES   3
#define RESET_CYCLES 100 /* for a fault to be gone */

/* What START goes through, after the identification. */
static const uint8_t walk_start[] = { MODBUS_SEQUENCE_init,
                                      MODBUS_SEQUENCE_disable };

/* ---- words ---- */

struct hal_text drive_modbus_say(struct drive_modbus *self, const char *words)
{
    struct hal_text text;

    hal_text_init(&text, self->fault_text, sizeof self->fault_text);
    hal_text_put(&text, words);
    return text;
}

const char *drive_modbus_reply_text(const struct hal_modbus_reply *reply)
{
    if (reply->err == MOTION_E_REFUSED)
        return hal_modbus_exception_text(reply->exception);
    return motion_err_text(reply->err);
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

void drive_modbus_latch(struct drive_modbus *self)
{
    const bool had_torque = self->state == HAL_DRIVE_ENABLED ||
                            self->state == HAL_DRIVE_ENABLING ||
                            self->state == HAL_DRIVE_QUICK_STOP;

    self->phase = DRIVE_MODBUS_LATCHED;
    self->state = HAL_DRIVE_FAULT;
    self->target_ns = 0;
    drive_modbus_go_drop(self);
    self->run.sequence = NULL;
    if (had_torque)
        drive_modbus_run_begin(self, MODBUS_SEQUENCE_stop);
}

void drive_modbus_lose(struct drive_modbus *self, enum hal_drive_state state)
{
    self->phase = DRIVE_MODBUS_LOST;
    self->state = state;
    self->target_ns = 0;
    drive_modbus_go_drop(self);
    self->run.sequence = NULL;
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

/* ---- sequences ---- */

void drive_modbus_run_begin(struct drive_modbus *self,
                            enum modbus_map_sequence_name name)
{
    self->run = (struct drive_modbus_run){
        .sequence = &self->config.map->sequence[name],
        .since_ns = self->now_ns,
    };
    self->cycles = 0;
}

static const struct modbus_map_step *
walk_step_of(const struct drive_modbus *self)
{
    const struct drive_modbus_run *run = &self->run;

    if (run->sequence == NULL || run->at >= run->sequence->count)
        return NULL;
    return &run->sequence->step[run->at];
}

bool drive_modbus_run_ask(struct drive_modbus *self,
                          struct hal_modbus_request *request)
{
    const struct modbus_map_step *step = walk_step_of(self);

    if (step == NULL || step->kind != MODBUS_STEP_WRITE || self->run.asked)
        return false;
    modbus_map_put_write(&self->config.map->item[step->item], step->value,
                         request);
    self->run.asked = true;
    return true;
}

static void walk_next_step(struct drive_modbus *self)
{
    self->run.at++;
    self->run.tries = 0;
    self->run.asked = false;
    self->run.since_ns = self->now_ns;
    self->cycles = 0;
}

/* "Busy" and what was lost on its way may be tried again: steps write values,
 * they start nothing that adds up. */
void drive_modbus_run_reply(struct drive_modbus *self,
                            const struct hal_modbus_reply *reply)
{
    struct hal_text text;

    if (!self->run.asked || self->run.sequence == NULL)
        return; /* of a sequence that was broken off */
    self->run.asked = false;
    if (reply->err == MOTION_OK) {
        walk_next_step(self);
    } else if (!drive_modbus_is_passing(reply) ||
               ++self->run.tries == STEP_TRIES) {
        text = drive_modbus_say(self, "a register was not written: ");
        hal_text_put(&text, drive_modbus_reply_text(reply));
        drive_modbus_latch(self);
        self->run.sequence = NULL;
    }
}

static const char *walk_status_text(enum modbus_map_status status)
{
    static const char *const text[] = {
#define WALK_STATUS_TEXT(name) #name,
        MODBUS_MAP_STATUS_LIST(WALK_STATUS_TEXT)
#undef WALK_STATUS_TEXT
    };

    return text[status];
}

static int walk_until(struct drive_modbus *self,
                      const struct modbus_map_step *step)
{
    struct hal_text text;

    if (self->cycles >= DRIVE_MODBUS_FRESH &&
        drive_modbus_status(self, step->status, false) == (step->value != 0)) {
        walk_next_step(self);
        return MOTION_E_AGAIN;
    }
    if (self->now_ns - self->run.since_ns <= step->dur_ns)
        return MOTION_E_AGAIN;
    text = drive_modbus_say(self, "not ");
    if (step->value == 0)
        hal_text_put(&text, "without ");
    hal_text_put(&text, walk_status_text(step->status));
    hal_text_put(&text, " in time");
    return MOTION_E_TIMEOUT;
}

/* MOTION_OK when the sequence is done, MOTION_E_AGAIN while it runs. */
static int walk_run(struct drive_modbus *self)
{
    const struct modbus_map_step *step = walk_step_of(self);

    if (step == NULL)
        return MOTION_OK;
    switch (step->kind) {
    case MODBUS_STEP_WRITE:
        break; /* moved on by its reply */
    case MODBUS_STEP_UNTIL:
        return walk_until(self, step);
    case MODBUS_STEP_DELAY:
        if (self->now_ns - self->run.since_ns >= step->dur_ns)
            walk_next_step(self);
        break;
    }
    return MOTION_E_AGAIN;
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
    self->identified = self->config.map->identify.item == MODBUS_MAP_NO_ITEM;
    self->identify_asked = false;
    self->parameter_at = 0;
    self->parameter_tries = 0;
    self->parameter_asked = false;
    self->fresh = 0;
    self->failures = 0;
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
    };

    self->is_reached = false;
    self->target_ns = 0;
    drive_modbus_go_drop(self);
    self->state = rows[self->request].state;
    drive_modbus_run_begin(self, rows[self->request].sequence);
}

/* Torque is off, and nothing is wrong. */
static void walk_off(struct drive_modbus *self)
{
    self->phase = DRIVE_MODBUS_RUN;
    self->state = HAL_DRIVE_OFF;
    self->is_reached = true;
    self->run.sequence = NULL;
    self->alarm_asked = false;
    self->fault_code = 0;
    self->fault_text[0] = '\0';
}

static void walk_start_step(struct drive_modbus *self)
{
    const unsigned all = (1u << self->fast_count) - 1;

    if (!self->identified)
        return; /* the reply goes on */
    if (self->run.sequence != NULL) {
        const int err = walk_run(self);

        if (err == MOTION_OK) {
            self->run.sequence = NULL;
            self->start_at++;
        } else if (err != MOTION_E_AGAIN) {
            drive_modbus_latch(self);
        }
    } else if (self->start_at < sizeof walk_start) {
        drive_modbus_run_begin(self, walk_start[self->start_at]);
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
    self->begun = self->begin_asked = false;
}

static void walk_reached(struct drive_modbus *self)
{
    self->is_reached = true;
    self->run.sequence = NULL;
    if (self->request == HAL_DRIVE_REQUEST_ENABLE)
        walk_enabled(self);
    else if (self->request == HAL_DRIVE_REQUEST_OFF)
        self->state = HAL_DRIVE_OFF;
}

static void walk_request_step(struct drive_modbus *self)
{
    const int err = walk_run(self);

    if (err == MOTION_OK)
        walk_reached(self);
    else if (err != MOTION_E_AGAIN)
        drive_modbus_latch(self);
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
    err = walk_run(self);
    if (err == MOTION_OK && self->move == DRIVE_MODBUS_MOVE_SENT) {
        self->move = DRIVE_MODBUS_MOVE_RUNNING;
        self->moved_ns = self->now_ns;
    }
    if (err == MOTION_OK) {
        self->run.sequence = NULL;
        self->begun = self->begun || self->begin_asked;
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
        self->run.sequence = NULL;
    } else if (!self->is_reached) {
        walk_request_step(self);
    } else if (self->state == HAL_DRIVE_ENABLED) {
        walk_enabled_step(self);
        drive_modbus_go_step(self);
    }
}

/* The stop that the latching began; what comes of it does not matter. */
static void walk_latched_step(struct drive_modbus *self)
{
    if (self->run.sequence != NULL && walk_run(self) != MOTION_E_AGAIN)
        self->run.sequence = NULL;
}

static void walk_reset_step(struct drive_modbus *self)
{
    const int err = walk_run(self);

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
        self->phase = DRIVE_MODBUS_LATCHED;
        self->run.sequence = NULL;
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
        break; /* waits for a reset */
    }
}
