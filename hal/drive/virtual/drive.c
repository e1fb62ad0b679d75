/* hal/drive/virtual/drive.c - see drive.h. */
#include "hal/drive/virtual/drive.h"

#include "hal/support/container_of.h"

/* ---- what stands in a bus's place ---- */

static enum hal_fieldbus_health
drive_virtual_bus_begin(struct hal_fieldbus *bus, int64_t now_ns)
{
    CONTAINER_OF(bus, struct drive_virtual_bus, fieldbus)->now_ns = now_ns;
    return HAL_FIELDBUS_GOOD;
}

static void drive_virtual_bus_end(struct hal_fieldbus *bus, int64_t now_ns)
{
    (void)bus;
    (void)now_ns;
}

static const struct hal_fieldbus_ops drive_virtual_bus_ops = {
    .begin = drive_virtual_bus_begin,
    .end = drive_virtual_bus_end,
};

void drive_virtual_bus_init(struct drive_virtual_bus *bus)
{
    *bus = (struct drive_virtual_bus){ .fieldbus.ops = &drive_virtual_bus_ops };
}

/* ---- the drive ---- */

static struct drive_virtual *drive_virtual_of(struct hal_drive *drive)
{
    return CONTAINER_OF(drive, struct drive_virtual, drive);
}

static void drive_virtual_request(struct hal_drive *drive,
                                  enum hal_drive_request request)
{
    struct drive_virtual *self = drive_virtual_of(drive);

    if (request == HAL_DRIVE_REQUEST_ENABLE)
        self->state = HAL_DRIVE_ENABLED;
    else if (request == HAL_DRIVE_REQUEST_OFF ||
             request == HAL_DRIVE_REQUEST_TORQUE_OFF)
        self->state = HAL_DRIVE_OFF;
    else if (request == HAL_DRIVE_REQUEST_QUICK_STOP &&
             self->state == HAL_DRIVE_ENABLED)
        self->state = HAL_DRIVE_QUICK_STOP;
    if (self->state != HAL_DRIVE_ENABLED)
        self->vel_q32 = 0;
}

static int drive_virtual_set_target(struct hal_drive *drive,
                                    const struct hal_drive_target *target)
{
    struct drive_virtual *self = drive_virtual_of(drive);

    if (self->state != HAL_DRIVE_ENABLED)
        return MOTION_OK;
    self->pos_q32 = target->pos_q32;
    self->vel_q32 = target->vel_q32;
    return MOTION_OK;
}

static void drive_virtual_feedback(struct hal_drive *drive,
                                   struct hal_drive_feedback *feedback)
{
    const struct drive_virtual *self = drive_virtual_of(drive);

    *feedback = (struct hal_drive_feedback){
        .state = self->state,
        .torque_off = self->state == HAL_DRIVE_OFF,
        .pos_q32 = self->pos_q32,
        .vel_q32 = self->vel_q32,
        .t_ns = self->bus->now_ns,
        .demand_known = true,
        .demand_q32 = self->pos_q32,
        .following = self->state == HAL_DRIVE_ENABLED,
        .mode = HAL_DRIVE_STREAM_POSITION,
    };
}

static const struct hal_drive_ops drive_virtual_ops = {
    .request = drive_virtual_request,
    .set_target = drive_virtual_set_target,
    .feedback = drive_virtual_feedback,
};

void drive_virtual_init(struct drive_virtual *self,
                        const struct drive_virtual_bus *bus, int64_t pos_q32)
{
    *self = (struct drive_virtual){ .drive.ops = &drive_virtual_ops,
                                    .bus = bus,
                                    .state = HAL_DRIVE_OFF,
                                    .pos_q32 = pos_q32 };
}
