/* hal/drive/virtual/drive.h - a virtual axis: a drive without a motor that is
 * where its last set point was, and is always there.
 *
 * As the master of axes that are coupled to it, to plan for a machine that is
 * not built yet, for boards that only make set points, and to compare set points
 * with other machines.  It takes set points alone.  Keeps to hal/drive.h. */
#ifndef HAL_DRIVE_VIRTUAL_DRIVE_H
#define HAL_DRIVE_VIRTUAL_DRIVE_H

#include "hal/drive.h"
#include "hal/fieldbus.h"

MOTION_C_BEGIN

/* What stands in a bus's place: the time of the tick.  Always good. */
struct drive_virtual_bus {
    struct hal_fieldbus fieldbus;
    int64_t now_ns;
};

struct drive_virtual {
    struct hal_drive drive;
    const struct drive_virtual_bus *bus;
    enum hal_drive_state state;
    int64_t pos_q32, vel_q32;
};

void drive_virtual_bus_init(struct drive_virtual_bus *bus);

/* Off, at pos_q32.  The bus outlives it. */
void drive_virtual_init(struct drive_virtual *self,
                        const struct drive_virtual_bus *bus, int64_t pos_q32);

MOTION_C_END

#endif
