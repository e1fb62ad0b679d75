/* hal/drive/cia402/drive.c - what the controller asks; see drive.h. */
#include "hal/drive/cia402/parts.h"

#include "hal/support/first.h"
#include "motion/core/fixed.h"

#define HEARD_NS     INT64_C(500000000) /* by SDO */
#define LIMIT_ACTIVE 0x0800
#define FOLLOWS      0x1000

static void drive_cia402_request_reset(struct drive_cia402 *self)
{
    if (self->phase == DRIVE_CIA402_LOST) {
        self->request = HAL_DRIVE_REQUEST_OFF;
        self->reset_by_nmt = false;
        drive_cia402_search_begin(self);
        drive_cia402_start_node_anew(self, self->now_ns);
    } else if (self->phase == DRIVE_CIA402_LATCHED) {
        self->reset_by_nmt = false;
        drive_cia402_reset_begin(self);
    } else if (self->phase == DRIVE_CIA402_START_UP && self->was_latched) {
        self->reset_by_nmt = true; /* when it is set up again */
    }
}

static void drive_cia402_request(struct hal_drive *drive,
                                 enum hal_drive_request request)
{
    struct drive_cia402 *self = drive_cia402_of(drive);
    const bool latched = self->phase == DRIVE_CIA402_LATCHED ||
                         self->phase == DRIVE_CIA402_LOST ||
                         self->phase == DRIVE_CIA402_RESET;

    if (request == HAL_DRIVE_REQUEST_RESET) {
        drive_cia402_request_reset(self);
        return;
    }
    if (request == HAL_DRIVE_REQUEST_TORQUE_OFF && latched)
        request = HAL_DRIVE_REQUEST_OFF;
    if (request == self->request ||
        (request == HAL_DRIVE_REQUEST_OFF &&
         self->request == HAL_DRIVE_REQUEST_TORQUE_OFF) ||
        (latched && request != HAL_DRIVE_REQUEST_OFF))
        return;
    if (self->phase == DRIVE_CIA402_RUN &&
        self->job != DRIVE_CIA402_JOB_MODE) /* that one is brought to its end */
        drive_cia402_drop_list(self);
    drive_cia402_modes_reset(self);
    self->preloaded = false;
    self->request = request;
    self->walk_since_ns = self->now_ns;
    self->state = drive_cia402_reported(self);
}

/* Permille in the drive's sense, as far as 16 bits go. */
static int16_t drive_cia402_torque(const struct drive_cia402 *self,
                                   int32_t permille)
{
    if (permille > INT16_MAX)
        permille = INT16_MAX;
    if (permille < -INT16_MAX)
        permille = -INT16_MAX;
    return (int16_t)(self->config.counts_num < 0 ? -permille : permille);
}

static int drive_cia402_set_position(struct drive_cia402 *self, int32_t counts)
{
    if (!hal_first_fits(&self->first_target, counts - self->actual_counts,
                        self->first_step_counts)) {
        drive_cia402_say(self, HAL_FIRST_AWAY);
        drive_cia402_latch(self);
        return MOTION_E_AWAY;
    }
    self->target_counts = counts;
    self->target_ns = self->now_ns;
    return MOTION_OK;
}

static int drive_cia402_set_target(struct hal_drive *drive,
                                   const struct hal_drive_target *target)
{
    struct drive_cia402 *self = drive_cia402_of(drive);
    const int64_t speed_q16 = hal_ratio_scale(&self->to_speed, target->vel_q32);
    const bool position = self->mode == HAL_DRIVE_STREAM_POSITION;
    int32_t counts = 0, speed;
    int err = MOTION_OK;

    if (self->mode == HAL_DRIVE_STREAM_VELOCITY)
        err = drive_cia402_speed(self, speed_q16, &speed);
    else
        err = drive_cia402_counts(self, target->pos_q32, &counts);
    if (err != MOTION_OK || !drive_cia402_is_enabled(self) ||
        !drive_cia402_mode(self)->streams || drive_cia402_is_busy(self))
        return err;
    if (position)
        err = drive_cia402_set_position(self, counts);
    if (err != MOTION_OK)
        return err;
    self->target_speed_q16 = speed_q16;
    self->target_torque = drive_cia402_torque(self, target->torque_permille);
    return MOTION_OK;
}

static void drive_cia402_put_limits(const struct drive_cia402 *self,
                                    struct hal_drive_feedback *feedback)
{
    const bool reversed = self->config.counts_num < 0;
    const bool low = (self->inputs & 1) != 0;
    const bool high = (self->inputs & 2) != 0;

    feedback->limit_negative = reversed ? high : low;
    feedback->limit_positive = reversed ? low : high;
    feedback->home_switch = (self->inputs & 4) != 0;
}

/* What it does by itself. */
static void drive_cia402_put_own(const struct drive_cia402 *self,
                                 struct hal_drive_feedback *feedback)
{
    feedback->mode = self->mode;
    feedback->arrived = drive_cia402_go_has_arrived(self);
    feedback->homing = self->homing;
    feedback->torque_known = self->torque_in;
    feedback->torque_permille = self->config.counts_num < 0
                                    ? -self->actual_torque
                                    : self->actual_torque;
    feedback->probe_latched = self->probe.latched;
    feedback->probe_pos_q32 =
        self->probe.latched
            ? hal_ratio_scale(&self->to_pos, drive_cia402_axis_counts(
                                                 self, self->probe.counts))
            : 0;
}

/* What it has said last is not old: by PDO, or when it is lost by SDO. */
static bool drive_cia402_is_heard(const struct drive_cia402 *self)
{
    if (self->phase == DRIVE_CIA402_LOST)
        return self->status_ns != 0 &&
               self->now_ns - self->status_ns <= HEARD_NS;
    return drive_cia402_is_watched(self) && self->is_live &&
           self->now_ns - self->actual_ns <= 4 * self->config.sync_period_ns;
}

/* By the standard's power states: torque in three of them. */
static bool drive_cia402_torque_off(const struct drive_cia402 *self)
{
    const enum cia402_state power = drive_cia402_power(self);

    return drive_cia402_is_heard(self) && power != CIA402_OPERATION_ENABLED &&
           power != CIA402_QUICK_STOP_ACTIVE &&
           power != CIA402_FAULT_REACTION && power != CIA402_UNKNOWN;
}

static void drive_cia402_feedback(struct hal_drive *drive,
                                  struct hal_drive_feedback *feedback)
{
    const struct drive_cia402 *self = drive_cia402_of(drive);

    *feedback = (struct hal_drive_feedback){
        .state = self->state,
        .torque_off = drive_cia402_torque_off(self),
        .pos_q32 = hal_ratio_scale(
            &self->to_pos, drive_cia402_axis_counts(self, self->actual_counts)),
        .vel_q32 = self->actual_vel_q32,
        .t_ns = self->actual_ns,
        .demand_age_ns =
            self->demand_ns == 0 ? 0 : self->actual_ns - self->demand_ns,
        .following = drive_cia402_mode(self)->streams &&
                     drive_cia402_power(self) == CIA402_OPERATION_ENABLED &&
                     (self->statusword & FOLLOWS) != 0 &&
                     (self->statusword & LIMIT_ACTIVE) == 0,
        .events = self->events,
        .steps = self->steps,
        .fault_code = self->fault_code,
        .fault_code_awaited = drive_cia402_awaits_code(self),
    };
    drive_cia402_put_limits(self, feedback);
    drive_cia402_put_own(self, feedback);
    for (unsigned i = 0;
         i < sizeof feedback->fault_text && self->fault_text[i] != '\0'; i++)
        feedback->fault_text[i] = self->fault_text[i];
}

static const struct hal_drive_found *drive_cia402_found(struct hal_drive *drive)
{
    return &drive_cia402_of(drive)->found;
}

const struct hal_drive_ops drive_cia402_ops = {
    .request = drive_cia402_request,
    .set_target = drive_cia402_set_target,
    .feedback = drive_cia402_feedback,
    .modes = drive_cia402_modes,
    .set_mode = drive_cia402_set_mode,
    .go = drive_cia402_go,
    .home = drive_cia402_home,
    .halt = drive_cia402_halt,
    .probe = drive_cia402_set_probe,
    .found = drive_cia402_found,
    .reach = drive_cia402_reach,
};
