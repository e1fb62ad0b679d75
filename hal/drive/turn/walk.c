/* hal/drive/turn/walk.c - phases; see drive.h for the picture.
 *
 * What is sent is not acknowledged: the proof of a command is what the drive
 * says of itself, and it is sent again every AGAIN_NS until then.  A latched
 * fault turns the request into a quick stop and forgets that it was to be
 * enabled. */
#include "hal/drive/turn/parts.h"

#define AGAIN_NS INT64_C(150000000) /* longer than a heartbeat period */

struct hal_text drive_turns_say(struct drive_turns *self, const char *words)
{
    struct hal_text text;

    hal_text_init(&text, self->fault_text, sizeof self->fault_text);
    hal_text_put(&text, words);
    return text;
}

bool drive_turns_is_watched(const struct drive_turns *self)
{
    return self->phase != DRIVE_TURNS_START && self->phase != DRIVE_TURNS_LOST;
}

/* ---- entering a phase ---- */

void drive_turns_pursue(struct drive_turns *self)
{
    self->since_ns = self->now_ns;
    self->retry_ns = self->now_ns;
    if (self->homing == HAL_DRIVE_HOMING_RUNNING)
        self->homing = HAL_DRIVE_HOMING_FAILED;
    if (self->request == HAL_DRIVE_REQUEST_ENABLE && !self->armed)
        drive_turns_stand(self);
    else if (self->request == HAL_DRIVE_REQUEST_QUICK_STOP)
        drive_turns_brake(self);
    else if (self->motion == DRIVE_TURNS_HOME)
        drive_turns_stand(self);
}

void drive_turns_enter(struct drive_turns *self, enum drive_turns_phase phase)
{
    self->phase = phase;
    self->since_ns = self->now_ns;
    self->retry_ns = self->now_ns;
}

void drive_turns_start(struct drive_turns *self)
{
    drive_turns_enter(self, DRIVE_TURNS_START);
    self->request = HAL_DRIVE_REQUEST_OFF;
    self->state = HAL_DRIVE_OFFLINE;
    self->mode = HAL_DRIVE_STREAM_POSITION;
    self->homing = HAL_DRIVE_HOMING_NONE;
    self->origin_q32 = 0;
    self->armed = false;
    self->left = self->left && self->torque;
    self->torque = self->left;
    self->alarmed = false;
    self->positioned = false;
    self->fault_code = 0;
    self->fault_text[0] = '\0';
    drive_turns_stand(self);
    self->ops->start(self);
}

void drive_turns_latch(struct drive_turns *self)
{
    self->request = HAL_DRIVE_REQUEST_QUICK_STOP;
    self->state = HAL_DRIVE_FAULT;
    if (self->homing == HAL_DRIVE_HOMING_RUNNING)
        self->homing = HAL_DRIVE_HOMING_FAILED;
    if (self->motion != DRIVE_TURNS_RAMP)
        drive_turns_brake(self);
    drive_turns_enter(self, DRIVE_TURNS_LATCHED);
}

void drive_turns_lose(struct drive_turns *self)
{
    const bool follows = self->armed && self->motion != DRIVE_TURNS_GO &&
                         self->motion != DRIVE_TURNS_HOME;

    self->left = drive_turns_is_watched(self);
    drive_turns_latch(self);
    if (!follows)
        drive_turns_stand(self); /* no ramp */
    self->phase = DRIVE_TURNS_LOST;
    self->state = HAL_DRIVE_OFFLINE;
    self->armed = false;
    self->torque = self->torque || self->left; /* until it says otherwise */
}

static void walk_run(struct drive_turns *self)
{
    drive_turns_enter(self, DRIVE_TURNS_RUN);
    self->left = false;
    self->state = HAL_DRIVE_OFF;
    self->mode = HAL_DRIVE_STREAM_POSITION;
    drive_turns_stand(self);
    if (self->alarmed) { /* since before it was found */
        drive_turns_latch(self);
        return;
    }
    self->fault_code = 0;
    self->fault_text[0] = '\0';
}

/* ---- waits ---- */

static bool walk_again(struct drive_turns *self)
{
    if (self->now_ns < self->retry_ns)
        return false;
    self->retry_ns = self->now_ns + AGAIN_NS;
    return true;
}

static bool walk_took_too_long(const struct drive_turns *self)
{
    return self->now_ns - self->since_ns > self->config.state_timeout_ns;
}

/* ---- one step per request ---- */

static void walk_off(struct drive_turns *self)
{
    if (!self->torque) {
        self->state = HAL_DRIVE_OFF;
        return;
    }
    self->state = HAL_DRIVE_QUICK_STOP;
    if (walk_took_too_long(self)) {
        drive_turns_say(self, "does not switch off");
        drive_turns_latch(self);
        return;
    }
    self->ops->disarm(self, walk_again(self));
}

/* The drive switches itself off and on on the way. */
static void walk_home(struct drive_turns *self)
{
    const int err = self->ops->seek(self);

    if (err == MOTION_E_AGAIN && self->now_ns <= self->home.deadline_ns)
        return;
    if (err == MOTION_OK || err == MOTION_E_REFUSED) {
        if (err == MOTION_E_REFUSED)
            self->homing = HAL_DRIVE_HOMING_FAILED;
        drive_turns_stand(self);
        self->first_target = true;
        return;
    }
    if (err == MOTION_E_AGAIN)
        drive_turns_say(self, "homing took too long");
    drive_turns_latch(self);
}

/* From a quick stop only at standstill, and with a new first set point. */
static void walk_enable(struct drive_turns *self)
{
    if (self->state == HAL_DRIVE_ENABLED) {
        if (self->motion == DRIVE_TURNS_HOME) {
            walk_home(self);
        } else if (!self->armed) {
            drive_turns_say(self, "switched itself off");
            drive_turns_latch(self);
        }
        return;
    }
    if (self->armed) {
        if (self->motion == DRIVE_TURNS_RAMP)
            return;
        self->state = HAL_DRIVE_ENABLED;
        self->first_target = true;
        return;
    }
    self->state = HAL_DRIVE_ENABLING;
    if (walk_took_too_long(self)) {
        drive_turns_say(self, "did not switch on");
        drive_turns_latch(self);
        return;
    }
    self->ops->arm(self, walk_again(self));
}

/* What it does by itself can only be switched off. */
static void walk_quick_stop(struct drive_turns *self)
{
    self->state = self->torque ? HAL_DRIVE_QUICK_STOP : HAL_DRIVE_OFF;
    if (self->torque && !self->armed)
        self->ops->disarm(self, walk_again(self));
}

/* ---- one step per phase ---- */

static void walk_starting(struct drive_turns *self)
{
    const int err = self->ops->start_step(self);

    if (self->left && self->torque && walk_again(self))
        self->ops->disarm(self, true);
    if (err == MOTION_OK) {
        walk_run(self);
    } else if (err != MOTION_E_AGAIN) { /* only a new start helps */
        drive_turns_lose(self);
        self->state = HAL_DRIVE_FAULT;
    }
}

static void walk_running(struct drive_turns *self)
{
    if (self->alarmed) {
        drive_turns_latch(self);
        return;
    }
    if (self->request == HAL_DRIVE_REQUEST_ENABLE)
        walk_enable(self);
    else if (self->request == HAL_DRIVE_REQUEST_QUICK_STOP)
        walk_quick_stop(self);
    else
        walk_off(self);
}

/* Torque goes when it is asked to. */
static void walk_latched(struct drive_turns *self)
{
    if (self->torque &&
        (!self->armed || self->request == HAL_DRIVE_REQUEST_OFF))
        self->ops->disarm(self, walk_again(self));
}

/* What it says of its torque counts, be it late. */
static void walk_lost(struct drive_turns *self)
{
    if (self->torque && self->motion != DRIVE_TURNS_RAMP && walk_again(self))
        self->ops->disarm(self, true);
}

static void walk_reset(struct drive_turns *self)
{
    if (walk_took_too_long(self)) {
        struct hal_text text = drive_turns_say(self, "not reset, ");

        hal_text_put(&text, self->alarmed ? "the fault is still there"
                                          : "it does not switch off");
        drive_turns_enter(self, DRIVE_TURNS_LATCHED);
        return;
    }
    if (self->torque) {
        if (!self->armed || self->motion != DRIVE_TURNS_RAMP)
            self->ops->disarm(self, walk_again(self));
    } else if (self->alarmed) {
        self->ops->clear(self, walk_again(self));
    } else {
        self->request = HAL_DRIVE_REQUEST_OFF;
        walk_run(self);
    }
}

void drive_turns_step(struct drive_turns *self, int64_t now_ns)
{
    self->now_ns = now_ns;
    switch (self->phase) {
    case DRIVE_TURNS_START:
        walk_starting(self);
        break;
    case DRIVE_TURNS_RUN:
        walk_running(self);
        break;
    case DRIVE_TURNS_LATCHED:
        walk_latched(self);
        break;
    case DRIVE_TURNS_RESET:
        walk_reset(self);
        break;
    case DRIVE_TURNS_LOST:
        walk_lost(self);
        break; /* and waits for a reset */
    }
}
