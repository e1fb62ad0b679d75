/* tests/firmware/control/ideal_drive.h - drives that are in every tick where the
 * last one sent them, for tests of the controller alone.
 *
 * Their clock is `now_ns`, which the test moves on. */
#ifndef TESTS_FIRMWARE_CONTROL_IDEAL_DRIVE_H
#define TESTS_FIRMWARE_CONTROL_IDEAL_DRIVE_H

#include "firmware/control/controller.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define MS   INT64_C(1000000)
#define UNIT MOTION_FIXED_ONE_Q32

struct ideal_drive {
    struct hal_drive drive;
    struct hal_drive_target given;
    bool enabled, faulty;
    unsigned quick_stops; /* asked for */
};

static int64_t now_ns;
static int64_t ideal_period_ns = MS;

static inline void ideal_drive_request(struct hal_drive *drive,
                                       enum hal_drive_request request)
{
    struct ideal_drive *self = (struct ideal_drive *)drive;
    self->enabled = request == HAL_DRIVE_REQUEST_ENABLE;
    self->quick_stops += request == HAL_DRIVE_REQUEST_QUICK_STOP;
}

static inline int ideal_drive_set_target(struct hal_drive *drive,
                                         const struct hal_drive_target *target)
{
    ((struct ideal_drive *)drive)->given = *target;
    return MOTION_OK;
}

static inline void ideal_drive_feedback(struct hal_drive *drive,
                                        struct hal_drive_feedback *feedback)
{
    const struct ideal_drive *self = (struct ideal_drive *)drive;
    *feedback = (struct hal_drive_feedback){
        .state = self->faulty    ? HAL_DRIVE_FAULT
                 : self->enabled ? HAL_DRIVE_ENABLED
                                 : HAL_DRIVE_OFF,
        .pos_q32 = self->given.pos_q32,
        .t_ns = now_ns - ideal_period_ns,
        .demand_age_ns = ideal_period_ns,
        .following = true,
    };
}

static const struct hal_drive_ops ideal_drive_ops = {
    .request = ideal_drive_request,
    .set_target = ideal_drive_set_target,
    .feedback = ideal_drive_feedback,
};

/* An axis of 200 units with stop limits above its own. */
static const struct controller_axis_config ideal_axis = {
    .pos_min_q32 = -100 * UNIT,
    .pos_max_q32 = 100 * UNIT,
    .limit = { 50 * UNIT, 400 * UNIT, 6000 * UNIT },
    .stop = { 50 * UNIT, 1000 * UNIT, 40000 * UNIT },
    .following_floor_q32 = UNIT,
    .following_k_ns = 10 * MS,
};

#endif
