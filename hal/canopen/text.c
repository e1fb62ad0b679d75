/* hal/canopen/text.c - words for wire codes; see canopen.h. */
#include "hal/canopen/canopen.h"

#define ARRAY_LEN(array) (sizeof(array) / sizeof(array)[0])

/* CiA 301 table 22. */
static const struct {
    uint32_t code;
    const char *text;
} canopen_aborts[] = {
    { 0x05030000, "toggle bit not alternated" },
    { 0x05040000, "time-out" },
    { 0x05040001, "unknown command" },
    { 0x05040002, "invalid block size" },
    { 0x05040003, "invalid sequence number" },
    { 0x05040004, "CRC error" },
    { 0x05040005, "out of memory" },
    { 0x06010000, "access not supported" },
    { 0x06010001, "write-only object" },
    { 0x06010002, "read-only object" },
    { 0x06020000, "no such object" },
    { 0x06040041, "object cannot be mapped" },
    { 0x06040042, "PDO would be too long" },
    { 0x06040043, "parameter incompatibility" },
    { 0x06040047, "internal incompatibility" },
    { 0x06060000, "hardware error" },
    { 0x06070010, "length does not match" },
    { 0x06070012, "data too long" },
    { 0x06070013, "data too short" },
    { 0x06090011, "no such sub-index" },
    { 0x06090030, "value out of range" },
    { 0x06090031, "value too high" },
    { 0x06090032, "value too low" },
    { 0x06090036, "maximum below minimum" },
    { 0x060A0023, "resource not available" },
    { 0x08000000, "general error" },
    { 0x08000020, "cannot be stored" },
    { 0x08000021, "local control" },
    { 0x08000022, "wrong device state" },
    { 0x08000023, "no object dictionary" },
    { 0x08000024, "no data" },
};

const char *canopen_abort_text(uint32_t abort_code)
{
    for (size_t i = 0; i < ARRAY_LEN(canopen_aborts); i++)
        if (canopen_aborts[i].code == abort_code)
            return canopen_aborts[i].text;
    return "unknown abort code";
}

/* First match counts: from the single code to its class.  CiA 301 table 26,
 * CiA 402-2 table 5. */
static const struct {
    uint16_t code, mask;
    const char *text;
} canopen_emcies[] = {
    { 0x0000, 0xFF00, "no error" },
    { 0x1000, 0xF000, "generic" },
    { 0x2100, 0xFF00, "current, input side" },
    { 0x2200, 0xFF00, "current, inside the device" },
    { 0x2300, 0xFF00, "current, output side" },
    { 0x2000, 0xF000, "current" },
    { 0x3100, 0xFF00, "voltage, mains" },
    { 0x3200, 0xFF00, "voltage, inside the device" },
    { 0x3300, 0xFF00, "voltage, output side" },
    { 0x3000, 0xF000, "voltage" },
    { 0x4100, 0xFF00, "temperature, ambient" },
    { 0x4200, 0xFF00, "temperature, device" },
    { 0x4000, 0xF000, "temperature" },
    { 0x5000, 0xF000, "hardware" },
    { 0x6300, 0xFF00, "software, data set" },
    { 0x6000, 0xF000, "software" },
    { 0x7300, 0xFF00, "sensor or encoder" },
    { 0x7000, 0xF000, "additional module" },
    { 0x8110, 0xFFFF, "CAN overrun" },
    { 0x8120, 0xFFFF, "CAN error passive" },
    { 0x8130, 0xFFFF, "heartbeat or life guard" },
    { 0x8140, 0xFFFF, "recovered from bus-off" },
    { 0x8150, 0xFFFF, "COB-ID collision" },
    { 0x8210, 0xFFFF, "PDO too short" },
    { 0x8220, 0xFFFF, "PDO too long" },
    { 0x8240, 0xFFFF, "SYNC length" },
    { 0x8250, 0xFFFF, "RPDO time-out" },
    { 0x8611, 0xFFFF, "following error" },
    { 0x8000, 0xF000, "monitoring" },
    { 0x9000, 0xF000, "external error" },
    { 0xF000, 0xFF00, "additional function" },
    { 0xFF00, 0xFF00, "maker's own" },
};

const char *canopen_emcy_text(uint16_t code)
{
    for (size_t i = 0; i < ARRAY_LEN(canopen_emcies); i++)
        if ((code & canopen_emcies[i].mask) == canopen_emcies[i].code)
            return canopen_emcies[i].text;
    return "unknown code";
}
