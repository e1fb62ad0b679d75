/* firmware/host/kind/odrive/quantity.c - see quantity.h. */
#include "firmware/host/kind/odrive/quantity.h"

#include "firmware/host/base/array.h"
#include "hal/drive/odrive/drive.h"

static const char *odrive_error_05(unsigned value)
{
    return drive_odrive_error_text(DRIVE_ODRIVE_05, value);
}

static const char *odrive_error_06(unsigned value)
{
    return drive_odrive_error_text(DRIVE_ODRIVE_06, value);
}

#define MESSAGE(at, offset, type, name, unit, words)                           \
    {                                                                          \
        QUANTITY_MESSAGE, type, at, offset, true, false, name, unit, words     \
    }

static const struct quantity odrive_06[] = {
    MESSAGE(0x01, 0, QUANTITY_U32, "error", "", odrive_error_06),
    MESSAGE(0x01, 4, QUANTITY_U8, "state", "", drive_odrive_state_text),
    MESSAGE(0x01, 5, QUANTITY_U8, "procedure result", "",
            drive_odrive_result_text),
    MESSAGE(0x01, 6, QUANTITY_BOOL, "trajectory done", "", NULL),
    MESSAGE(0x03, 4, QUANTITY_U32, "disarm reason", "", odrive_error_06),
    MESSAGE(0x09, 0, QUANTITY_F32, "position", "turns", NULL),
    MESSAGE(0x09, 4, QUANTITY_F32, "velocity", "turns/s", NULL),
    MESSAGE(0x14, 0, QUANTITY_F32, "current set point", "A", NULL),
    MESSAGE(0x14, 4, QUANTITY_F32, "current", "A", NULL),
    MESSAGE(0x15, 0, QUANTITY_F32, "FET temperature", "degC", NULL),
    MESSAGE(0x15, 4, QUANTITY_F32, "motor temperature", "degC", NULL),
    MESSAGE(0x17, 0, QUANTITY_F32, "bus voltage", "V", NULL),
    MESSAGE(0x17, 4, QUANTITY_F32, "bus current", "A", NULL),
    MESSAGE(0x1C, 0, QUANTITY_F32, "torque target", "Nm", NULL),
    MESSAGE(0x1C, 4, QUANTITY_F32, "torque", "Nm", NULL),
    MESSAGE(0x1D, 0, QUANTITY_F32, "electrical power", "W", NULL),
    MESSAGE(0x1D, 4, QUANTITY_F32, "mechanical power", "W", NULL),
};

static const struct quantity odrive_05[] = {
    MESSAGE(0x01, 0, QUANTITY_U32, "error", "", odrive_error_05),
    MESSAGE(0x01, 4, QUANTITY_U8, "state", "", drive_odrive_state_text),
    MESSAGE(0x03, 0, QUANTITY_U32, "motor error", "", NULL),
    MESSAGE(0x04, 0, QUANTITY_U32, "encoder error", "", NULL),
    MESSAGE(0x1D, 0, QUANTITY_U32, "controller error", "", NULL),
    MESSAGE(0x09, 0, QUANTITY_F32, "position", "turns", NULL),
    MESSAGE(0x09, 4, QUANTITY_F32, "velocity", "turns/s", NULL),
    MESSAGE(0x14, 0, QUANTITY_F32, "current set point", "A", NULL),
    MESSAGE(0x14, 4, QUANTITY_F32, "current", "A", NULL),
    MESSAGE(0x17, 0, QUANTITY_F32, "bus voltage", "V", NULL),
    MESSAGE(0x17, 4, QUANTITY_F32, "bus current", "A", NULL),
};

const struct quantity *quantity_of_odrive(bool is_05, unsigned *count)
{
    *count = is_05 ? ARRAY_LEN(odrive_05) : ARRAY_LEN(odrive_06);
    return is_05 ? odrive_05 : odrive_06;
}
