/* hal/modbus/modbus.c - see modbus.h. */
#include "hal/modbus.h"

const char *hal_modbus_exception_text(uint8_t exception)
{
    static const char *const text[] = {
        [0x01] = "illegal function",
        [0x02] = "illegal data address",
        [0x03] = "illegal data value",
        [0x04] = "device failure",
        [0x05] = "acknowledged, takes longer",
        [0x06] = "device busy",
        [0x07] = "negative acknowledge",
        [0x08] = "memory parity error",
        [0x0A] = "gateway path unavailable",
        [0x0B] = "gateway target does not answer",
    };

    if (exception >= sizeof text / sizeof text[0] || !text[exception])
        return "exception of the maker's own";
    return text[exception];
}

bool hal_modbus_is_missing(const struct hal_modbus_reply *reply)
{
    return reply->err == MOTION_E_REFUSED &&
           (reply->exception == 0x0A || reply->exception == 0x0B);
}

const char *hal_modbus_reply_text(const struct hal_modbus_reply *reply)
{
    if (reply->exception != 0)
        return hal_modbus_exception_text(reply->exception);
    if (reply->err == MOTION_E_PROTOCOL)
        return "its answers are broken";
    return reply->err == MOTION_E_IO ? HAL_MODBUS_BROKE
                                     : motion_err_text(reply->err);
}

void hal_modbus_count(struct hal_modbus_stats *stats,
                      const struct hal_modbus_reply *reply)
{
    stats->transactions++;
    switch (reply->err) {
    case MOTION_OK:
        break;
    case MOTION_E_TIMEOUT:
        stats->timeouts++;
        break;
    case MOTION_E_PROTOCOL:
        stats->broken++;
        break;
    case MOTION_E_REFUSED:
        if (hal_modbus_is_missing(reply))
            stats->timeouts++;
        else
            stats->exceptions++;
        break;
    default:
        stats->failures++;
    }
}
