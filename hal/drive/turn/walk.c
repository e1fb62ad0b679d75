/* hal/drive/turn/walk.c - phases; see drive.h for the picture.
 *
 * What is sent is not acknowledged: the proof of a command is what the drive
 * says of itself, and it is sent again every AGAIN_NS until then.  A latched
 * fault turns the request into a quick stop and forgets that it was to be
 * enabled. */
#include "hal/drive/turn/parts.h"

#define AGAIN_NS    INT64_C(150000000) /* longer than a heartbeat period */
#define FRESH_TICKS 4                  /* a position is where the axis is */

struct hal_text drive_turn_say(struct drive_turn *self, const char *words)
{
    struct hal_text text;

    hal_text_init(&text, self->fault_text, sizeof self->fault_text);
    hal_text_put(&text, words);
    return text;
}

bool drive_turn_is_watched(const struct drive_turn *self)
{
    return self->phase != DRIVE_TURN_START && self->phase != DRIVE_TURN_LOST;
}

static bool walk_moves_itself(const struct drive_turn *self)
{
    return self->motion == DRIVE_TURN_GO || self->motion == DRIVE_TURN_HOME;
}

/* ---- entering a phase ---- */

void drive_turn_pursue(struct drive_turn *self)
{
    self->since_ns = self->now_ns;
    self->retry_ns = self->now_ns;
    if (self->homing == HAL_DRIVE_HOMING_RUNNING)
        self->homing = HAL_DRIVE_HOMING_FAILED;
    if (self->request == HAL_DRIVE_REQUEST_TORQUE_OFF ||
        (self->request == HAL_DRIVE_REQUEST_ENABLE && !self->armed))
        drive_turn_stand(self);
    else if ((self->request != HAL_DRIVE_REQUEST_ENABLE ||
              walk_moves_itself(self)) &&
             (!drive_turn_ramps(self) || self->home.broken_off))
        drive_turn_brake(self); /* a ramp that goes on is not begun again */
}

void drive_turn_enter(struct drive_turn *self, enum drive_turn_phase phase)
{
    self->phase = phase;
    self->since_ns = self->now_ns;
    self->retry_ns = self->now_ns;
}

void drive_turn_start(struct drive_turn *self)
{
    drive_turn_enter(self, DRIVE_TURN_START);
    self->request = HAL_DRIVE_REQUEST_OFF;
    self->state = HAL_DRIVE_OFFLINE;
    self->mode = HAL_DRIVE_STREAM_POSITION;
    self->homing = HAL_DRIVE_HOMING_NONE;
    self->origin_q32 = 0;
    self->armed = false;
    self->reset = false;
    self->left = self->left && self->torque;
    self->torque = self->left;
    self->alarmed = false;
    self->positioned = false;
    self->fault_code = 0;
    self->fault_text[0] = '\0';
    drive_turn_stand(self);
    self->ops->start(self);
}

void drive_turn_latch(struct drive_turn *self)
{
    self->request = HAL_DRIVE_REQUEST_QUICK_STOP;
    self->state = HAL_DRIVE_FAULT;
    if (self->homing == HAL_DRIVE_HOMING_RUNNING)
        self->homing = HAL_DRIVE_HOMING_FAILED;
    if (self->motion != DRIVE_TURN_RAMP)
        drive_turn_brake(self);
    drive_turn_enter(self, DRIVE_TURN_LATCHED);
}

void drive_turn_lose(struct drive_turn *self)
{
    const bool by_itself = walk_moves_itself(self);
    const bool goes = self->armed && self->motion == DRIVE_TURN_GO;
    const bool has_place =
        self->now_ns - self->actual_ns <= FRESH_TICKS * self->config.period_ns;

    self->left = drive_turn_is_watched(self);
    self->reset = self->returned = false;
    drive_turn_latch(self);
    if (goes && !has_place)
        self->motion = DRIVE_TURN_SLOW;
    else if (by_itself ? !has_place : !self->armed)
        drive_turn_stand(self); /* no ramp */
    self->phase = DRIVE_TURN_LOST;
    self->state = HAL_DRIVE_OFFLINE;
    self->armed = false;
    self->torque = self->torque || self->left; /* until it says otherwise */
}

static void walk_note_found(struct drive_turn *self)
{
    self->found.count++;
    self->found.vel_q32 = hal_ratio_scale(&self->to_unit, self->actual_vel_q32);
    self->found.goes_on = false;
    self->stops_found = true;
}

/* What an earlier master left moving is ramped down first. */
static void walk_run(struct drive_turn *self)
{
    const bool homes = self->motion == DRIVE_TURN_HOME;
    const bool resets = self->phase == DRIVE_TURN_RESET;

    drive_turn_enter(self, DRIVE_TURN_RUN);
    self->left = false;
    self->state = HAL_DRIVE_OFF;
    self->mode = HAL_DRIVE_STREAM_POSITION;
    drive_turn_stand(self);
    if (self->alarmed) { /* since before it was found */
        drive_turn_latch(self);
        return;
    }
    if (self->armed || homes) {
        if (!resets)
            walk_note_found(self);
        self->motion = homes ? DRIVE_TURN_HOME : DRIVE_TURN_GO;
        drive_turn_brake(self);
    }
    self->fault_code = 0;
    self->fault_text[0] = '\0';
}

/* ---- waits ---- */

static bool walk_again(struct drive_turn *self)
{
    if (self->now_ns < self->retry_ns)
        return false;
    self->retry_ns = self->now_ns + AGAIN_NS;
    return true;
}

static bool walk_took_too_long(const struct drive_turn *self)
{
    return self->now_ns - self->since_ns > self->config.state_timeout_ns;
}

/* How long its positions have come without a gap; 0: they do not. */
static int64_t walk_heard_ns(const struct drive_turn *self)
{
    return self->now_ns - self->silent_ns;
}

static void walk_listen(struct drive_turn *self)
{
    if (!self->positioned ||
        self->now_ns - self->actual_ns > FRESH_TICKS * self->config.period_ns)
        self->silent_ns = self->now_ns;
}

/* Its own watchdog has it (moteus: mode 11), and it has not come to rest. */
static bool walk_stops_itself(const struct drive_turn *self)
{
    return self->alarmed && self->torque && !self->armed &&
           walk_heard_ns(self) > 0 &&
           self->now_ns - self->ramped_ns <= HAL_DRIVE_STOP_NS &&
           !(drive_turn_is_standing(self) &&
             hal_standstill_is(&self->standstill, self->actual_ns));
}

/* It has come home just now, and counts from there. */
static bool walk_counts_anew(const struct drive_turn *self)
{
    const int64_t off_q32 = self->actual_q32 - self->target_q32;

    return off_q32 > self->first_step_q32 || off_q32 < -self->first_step_q32;
}

/* Out of its homing once at first; again, from where it is then, while its
 * heartbeats say that it did not hear. */
static void walk_break_off(struct drive_turn *self)
{
    const bool unheard = self->home.told && !self->armed &&
                         drive_turn_is_watched(self) && walk_again(self);

    if (self->home.told && !unheard)
        return;
    if (unheard)
        drive_turn_brake(self);
    self->home.told = true;
    self->retry_ns = self->now_ns + AGAIN_NS;
    self->ops->break_off(self);
}

/* It is not disarmed yet: it is being ramped down, or rolls out. */
static bool walk_brakes(struct drive_turn *self)
{
    const bool lost = self->phase == DRIVE_TURN_LOST;
    const bool fails = self->alarmed || !self->torque;

    if (walk_stops_itself(self))
        return true;
    if (!self->home.broken_off)
        return !fails && ((drive_turn_ramps(self) && (self->armed || lost)) ||
                          drive_turn_rolls(self));
    self->home.broken_off =
        !fails &&
        (drive_turn_ramps(self) || drive_turn_rolls(self) ||
         (!self->armed && !lost && self->now_ns <= self->home.deadline_ns));
    if (self->home.broken_off && walk_counts_anew(self))
        drive_turn_brake(self);
    if (self->home.broken_off)
        walk_break_off(self);
    else
        self->retry_ns = self->now_ns; /* what comes next does so at once */
    return self->home.broken_off;
}

/* ---- one step per request ---- */

static void walk_off(struct drive_turn *self)
{
    if (!self->torque) {
        self->state = HAL_DRIVE_OFF;
        self->stops_found = false;
        return;
    }
    self->state = HAL_DRIVE_QUICK_STOP;
    if (self->request != HAL_DRIVE_REQUEST_TORQUE_OFF && walk_brakes(self)) {
        self->since_ns = self->now_ns;
        return;
    }
    if (self->stops_found && self->armed &&
        !hal_standstill_is(&self->standstill, self->actual_ns))
        self->found.goes_on = true;
    if (walk_took_too_long(self)) {
        drive_turn_say(self, "does not switch off");
        drive_turn_latch(self);
        return;
    }
    self->ops->disarm(self, walk_again(self));
}

/* The drive switches itself off and on on the way. */
static void walk_home(struct drive_turn *self)
{
    const int err = self->ops->seek(self);

    if (err == MOTION_E_AGAIN && self->now_ns <= self->home.deadline_ns)
        return;
    if (err == MOTION_OK || err == MOTION_E_REFUSED) {
        if (err == MOTION_E_REFUSED)
            self->homing = HAL_DRIVE_HOMING_FAILED;
        drive_turn_stand(self);
        self->first_target = true;
        return;
    }
    if (err == MOTION_E_AGAIN)
        drive_turn_say(self, "homing took too long");
    drive_turn_latch(self);
}

/* Where it is, by its homing and what ends that, or by set points. */
static void walk_enabled(struct drive_turn *self)
{
    if (self->motion == DRIVE_TURN_HOME) {
        walk_home(self);
    } else if (self->home.broken_off && walk_brakes(self)) {
        self->first_target = true;
    } else if (!self->armed) {
        drive_turn_say(self, "switched itself off");
        drive_turn_latch(self);
    }
}

/* From a quick stop only at standstill, and with a new first set point. */
static void walk_enable(struct drive_turn *self)
{
    if (self->state == HAL_DRIVE_ENABLED) {
        walk_enabled(self);
        return;
    }
    if (self->armed) {
        if (self->motion == DRIVE_TURN_RAMP)
            return;
        self->state = HAL_DRIVE_ENABLED;
        self->first_target = true;
        return;
    }
    self->state = HAL_DRIVE_ENABLING;
    if (walk_took_too_long(self)) {
        drive_turn_say(self, "did not switch on");
        drive_turn_latch(self);
        return;
    }
    self->ops->arm(self, walk_again(self));
}

static void walk_quick_stop(struct drive_turn *self)
{
    self->state = self->torque ? HAL_DRIVE_QUICK_STOP : HAL_DRIVE_OFF;
    if (!walk_brakes(self) && self->torque && !self->armed)
        self->ops->disarm(self, walk_again(self));
}

/* ---- one step per phase ---- */

static void walk_starting(struct drive_turn *self)
{
    const int err = self->ops->start_step(self);
    const int64_t heard_ns = walk_heard_ns(self);

    if (self->left && self->torque &&
        (heard_ns == 0 || heard_ns > self->config.state_timeout_ns) &&
        walk_again(self))
        self->ops->disarm(self, true);
    if (err == MOTION_OK) {
        walk_run(self);
    } else if (err != MOTION_E_AGAIN) { /* only a new start helps */
        drive_turn_lose(self);
        self->state = HAL_DRIVE_FAULT;
    }
}

static void walk_running(struct drive_turn *self)
{
    if (self->alarmed) {
        drive_turn_latch(self);
        return;
    }
    if (self->request == HAL_DRIVE_REQUEST_ENABLE)
        walk_enable(self);
    else if (self->request == HAL_DRIVE_REQUEST_QUICK_STOP)
        walk_quick_stop(self);
    else
        walk_off(self);
}

/* Torque goes when it is asked to, and it stands. */
static void walk_latched(struct drive_turn *self)
{
    if (!walk_brakes(self) && self->torque &&
        (!self->armed || self->request == HAL_DRIVE_REQUEST_OFF))
        self->ops->disarm(self, walk_again(self));
}

/* What it says of its torque counts, be it late.  One that is heard again is
 * stopped from where it is, once it has said that it is armed. */
static void walk_lost(struct drive_turn *self)
{
    const int64_t heard_ns = walk_heard_ns(self);

    if (self->armed && heard_ns > 0 && !self->returned &&
        !drive_turn_ramps(self)) {
        self->returned = true;
        self->motion = DRIVE_TURN_GO;
        drive_turn_brake(self);
    }
    if (walk_brakes(self) && self->now_ns - self->since_ns <= HAL_DRIVE_STOP_NS)
        return;
    if (self->reset)
        drive_turn_start(self);
    else if (self->torque &&
             (heard_ns == 0 || heard_ns > AGAIN_NS || self->returned) &&
             walk_again(self))
        self->ops->disarm(self, true);
}

static void walk_reset(struct drive_turn *self)
{
    if (walk_brakes(self)) {
        self->since_ns = self->now_ns;
        return;
    }
    if (walk_took_too_long(self)) {
        struct hal_text text = drive_turn_say(self, "not reset, ");

        hal_text_put(&text, self->alarmed ? "the fault is still there"
                                          : "it does not switch off");
        drive_turn_enter(self, DRIVE_TURN_LATCHED);
        return;
    }
    if (self->torque) {
        self->ops->disarm(self, walk_again(self));
    } else if (self->alarmed) {
        self->ops->clear(self, walk_again(self));
    } else {
        self->request = HAL_DRIVE_REQUEST_OFF;
        walk_run(self);
    }
}

void drive_turn_step(struct drive_turn *self, int64_t now_ns)
{
    self->now_ns = now_ns;
    walk_listen(self);
    switch (self->phase) {
    case DRIVE_TURN_START:
        walk_starting(self);
        break;
    case DRIVE_TURN_RUN:
        walk_running(self);
        break;
    case DRIVE_TURN_LATCHED:
        walk_latched(self);
        break;
    case DRIVE_TURN_RESET:
        walk_reset(self);
        break;
    case DRIVE_TURN_LOST:
        walk_lost(self);
        break; /* and waits for a reset */
    }
}
