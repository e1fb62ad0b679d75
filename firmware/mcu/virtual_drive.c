/* firmware/mcu/virtual_drive.c - see virtual_drive.h. */
#include "firmware/mcu/virtual_drive.h"

#include "hal/support/container_of.h"

static struct mcu_virtual_drive *mcu_virtual_drive_of(struct hal_drive *drive)
{
    return CONTAINER_OF(drive, struct mcu_virtual_drive, drive);
}

static void mcu_virtual_drive_request(struct hal_drive *drive,
                                      enum hal_drive_request request)
{
    struct mcu_virtual_drive *self = mcu_virtual_drive_of(drive);

    if (request == HAL_DRIVE_REQUEST_ENABLE)
        self->state = HAL_DRIVE_ENABLED;
    else if (request == HAL_DRIVE_REQUEST_OFF)
        self->state = HAL_DRIVE_OFF;
    else if (request == HAL_DRIVE_REQUEST_QUICK_STOP &&
             self->state == HAL_DRIVE_ENABLED)
        self->state = HAL_DRIVE_QUICK_STOP;
    if (self->state != HAL_DRIVE_ENABLED)
        self->vel_q32 = 0;
}

static int mcu_virtual_drive_set_target(struct hal_drive *drive,
                                        const struct hal_drive_target *target)
{
    struct mcu_virtual_drive *self = mcu_virtual_drive_of(drive);

    if (self->state != HAL_DRIVE_ENABLED)
        return MOTION_OK;
    self->pos_q32 = target->pos_q32;
    self->vel_q32 = target->vel_q32;
    return MOTION_OK;
}

static void mcu_virtual_drive_feedback(struct hal_drive *drive,
                                       struct hal_drive_feedback *feedback)
{
    const struct mcu_virtual_drive *self = mcu_virtual_drive_of(drive);

    *feedback = (struct hal_drive_feedback){
        .state = self->state,
        .torque_off = self->state == HAL_DRIVE_OFF,
        .pos_q32 = self->pos_q32,
        .vel_q32 = self->vel_q32,
        .t_ns = self->now_ns,
        .demand_known = true,
        .demand_q32 = self->pos_q32,
        .following = self->state == HAL_DRIVE_ENABLED,
        .mode = HAL_DRIVE_STREAM_POSITION,
    };
}

static const struct hal_drive_ops mcu_virtual_drive_ops = {
    .request = mcu_virtual_drive_request,
    .set_target = mcu_virtual_drive_set_target,
    .feedback = mcu_virtual_drive_feedback,
};

void mcu_virtual_drive_init(struct mcu_virtual_drive *self, int64_t pos_q32)
{
    *self = (struct mcu_virtual_drive){ .drive.ops = &mcu_virtual_drive_ops,
                                        .state = HAL_DRIVE_OFF,
                                        .pos_q32 = pos_q32 };
}

void mcu_virtual_drive_begin(struct mcu_virtual_drive *self, int64_t now_ns)
{
    self->now_ns = now_ns;
}
