/* hal/drive_cia402.c - what the controller asks; see drive_cia402.h. */
#include "hal/drive_cia402_parts.h"

#include "hal/container_of.h"
#include "motion/fixed.h"

#define LIMIT_ACTIVE 0x0800
#define FOLLOWS      0x1000

static struct drive_cia402 *drive_cia402_of(struct hal_drive *drive)
{
    return CONTAINER_OF(drive, struct drive_cia402, drive);
}

static void drive_cia402_request_reset(struct drive_cia402 *self)
{
    if (self->phase == DRIVE_CIA402_LOST) {
        self->request = HAL_DRIVE_REQUEST_OFF;
        drive_cia402_start_anew(self, self->now_ns);
    } else if (self->phase == DRIVE_CIA402_LATCHED) {
        drive_cia402_drop_list(self);
        self->phase = DRIVE_CIA402_RESET;
        self->reset_cycles = 0;
        self->walk_since_ns = self->now_ns;
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
    if (request == self->request ||
        (latched && request != HAL_DRIVE_REQUEST_OFF))
        return;
    if (self->phase == DRIVE_CIA402_RUN)
        drive_cia402_drop_list(self);
    self->preloaded = false;
    self->request = request;
    self->walk_since_ns = self->now_ns;
    self->state = drive_cia402_reported(self);
}

/* The first set point after enabling must be where the axis is. */
static int drive_cia402_check_first(struct drive_cia402 *self, int64_t counts)
{
    int64_t step;

    if (!self->first_target)
        return MOTION_OK;
    step = counts - self->actual_counts;
    if (step > self->first_step_counts || step < -self->first_step_counts) {
        drive_cia402_say(self,
                         "first set point is too far from where the axis is");
        drive_cia402_latch(self);
        return MOTION_E_LIMIT;
    }
    self->first_target = false;
    return MOTION_OK;
}

static int drive_cia402_set_target(struct hal_drive *drive,
                                   const struct hal_drive_target *target)
{
    struct drive_cia402 *self = drive_cia402_of(drive);
    int64_t counts;
    int err;

    if (motion_fixed_mulshift(target->pos_q32, self->to_counts.mantissa,
                              self->to_counts.shift, &counts) != MOTION_OK ||
        counts < INT32_MIN || counts > INT32_MAX)
        return MOTION_E_RANGE;
    if (!drive_cia402_is_enabled(self))
        return MOTION_OK;
    err = drive_cia402_check_first(self, counts);
    if (err != MOTION_OK)
        return err;
    self->target_counts = (int32_t)counts;
    self->target_ns = self->now_ns;
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
}

static void drive_cia402_feedback(struct hal_drive *drive,
                                  struct hal_drive_feedback *feedback)
{
    const struct drive_cia402 *self = drive_cia402_of(drive);

    *feedback = (struct hal_drive_feedback){
        .state = self->state,
        .pos_q32 = hal_ratio_scale(&self->to_pos, self->actual_counts),
        .vel_q32 = self->actual_vel_q32,
        .t_ns = self->actual_ns,
        .demand_age_ns =
            self->demand_ns == 0 ? 0 : self->actual_ns - self->demand_ns,
        .following = drive_cia402_power(self) == CIA402_OPERATION_ENABLED &&
                     (self->statusword & FOLLOWS) != 0 &&
                     (self->statusword & LIMIT_ACTIVE) == 0,
        .fault_code = self->fault_code,
    };
    drive_cia402_put_limits(self, feedback);
    for (unsigned i = 0; i < sizeof feedback->fault_text; i++)
        feedback->fault_text[i] = self->fault_text[i];
}

const struct hal_drive_ops drive_cia402_ops = {
    .request = drive_cia402_request,
    .set_target = drive_cia402_set_target,
    .feedback = drive_cia402_feedback,
};
