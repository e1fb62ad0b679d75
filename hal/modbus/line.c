/* hal/modbus/line.c - see line.h. */
#include "hal/modbus/line.h"

#include <stddef.h>

bool modbus_line_is_baud(uint32_t baud)
{
    static const uint32_t table[] = {
        1200,    1800,    2400,    4800,    9600,    19200,   38400,   57600,
        115200,  230400,  460800,  500000,  576000,  921600,  1000000, 1152000,
        1500000, 2000000, 2500000, 3000000, 3500000, 4000000,
    };

    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++)
        if (table[i] == baud)
            return true;
    return false;
}
