/* firmware/host/kind/moteus/quantity.c - see quantity.h. */
#include "firmware/host/kind/moteus/quantity.h"

#include "firmware/host/base/array.h"
#include "hal/drive/moteus/drive.h"

/* Without a fault it may say what limits it just now. */
static const char *moteus_fault(unsigned value)
{
    return value == 0 ? "no fault" : drive_moteus_fault_text(value);
}

static const char *moteus_home(unsigned value)
{
    static const char *const words[] = { "relative only", "rotor", "output" };

    return value < ARRAY_LEN(words) ? words[value] : "unknown";
}

#define REGISTER(at, type, name, unit, words)                                  \
    {                                                                          \
        QUANTITY_REGISTER, type, at, 0, true, false, name, unit, words         \
    }
/* One to be written, with what may be read of it. */
#define SETTING(at, type, readable, name, unit)                                \
    {                                                                          \
        QUANTITY_REGISTER, type, at, 0, readable, true, name, unit, NULL       \
    }

static const struct quantity moteus[] = {
    REGISTER(0x100, QUANTITY_I32, "model", "", NULL),
    REGISTER(0x101, QUANTITY_I32, "firmware", "", NULL),
    REGISTER(0x102, QUANTITY_I32, "register map", "", NULL),
    REGISTER(0x120, QUANTITY_I32, "serial number 1", "", NULL),
    REGISTER(0x121, QUANTITY_I32, "serial number 2", "", NULL),
    REGISTER(0x122, QUANTITY_I32, "serial number 3", "", NULL),
    REGISTER(0x000, QUANTITY_I8, "mode", "", drive_moteus_mode_text),
    REGISTER(0x00F, QUANTITY_I8, "fault", "", moteus_fault),
    REGISTER(0x001, QUANTITY_F32, "position", "turns", NULL),
    REGISTER(0x002, QUANTITY_F32, "velocity", "turns/s", NULL),
    REGISTER(0x003, QUANTITY_F32, "torque", "Nm", NULL),
    REGISTER(0x004, QUANTITY_F32, "q current", "A", NULL),
    REGISTER(0x005, QUANTITY_F32, "d current", "A", NULL),
    REGISTER(0x006, QUANTITY_F32, "absolute position", "turns", NULL),
    REGISTER(0x007, QUANTITY_F32, "power", "W", NULL),
    REGISTER(0x00A, QUANTITY_F32, "motor temperature", "degC", NULL),
    REGISTER(0x00B, QUANTITY_I8, "trajectory complete", "", NULL),
    REGISTER(0x00C, QUANTITY_I8, "home state", "", moteus_home),
    REGISTER(0x00D, QUANTITY_F32, "voltage", "V", NULL),
    REGISTER(0x00E, QUANTITY_F32, "temperature", "degC", NULL),
    SETTING(0x020, QUANTITY_F32, true, "command position", "turns"),
    SETTING(0x021, QUANTITY_F32, true, "command velocity", "turns/s"),
    SETTING(0x022, QUANTITY_F32, true, "feed-forward torque", "Nm"),
    SETTING(0x023, QUANTITY_F32, true, "kp scale", ""),
    SETTING(0x024, QUANTITY_F32, true, "kd scale", ""),
    SETTING(0x025, QUANTITY_F32, true, "maximum torque", "Nm"),
    SETTING(0x026, QUANTITY_F32, true, "stop position", "turns"),
    SETTING(0x027, QUANTITY_F32, true, "watchdog", "s"),
    SETTING(0x028, QUANTITY_F32, true, "velocity limit", "turns/s"),
    SETTING(0x029, QUANTITY_F32, true, "acceleration limit", "turns/s2"),
    SETTING(0x130, QUANTITY_F32, false, "set output nearest", "turns"),
    SETTING(0x131, QUANTITY_F32, false, "set output exact", "turns"),
    SETTING(0x132, QUANTITY_I8, false, "require reindex", ""),
};

const struct quantity *quantity_of_moteus(unsigned *count)
{
    *count = ARRAY_LEN(moteus);
    return moteus;
}
