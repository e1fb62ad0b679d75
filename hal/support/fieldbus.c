/* hal/support/fieldbus.c - see hal/fieldbus.h. */
#include "hal/fieldbus.h"

const char *hal_fieldbus_health_text(enum hal_fieldbus_health health)
{
    static const char *const text[] = {
        [HAL_FIELDBUS_GOOD] = "good",
        [HAL_FIELDBUS_PASSIVE] = "error-passive",
        [HAL_FIELDBUS_FULL] = "frames were refused three cycles in a row",
        [HAL_FIELDBUS_FOREIGN] = "frames that only a master sends",
        [HAL_FIELDBUS_BUS_OFF] = "bus-off",
        [HAL_FIELDBUS_DOWN] = "interface down",
    };

    return (unsigned)health < sizeof text / sizeof text[0] ? text[health]
                                                           : "unknown health";
}
