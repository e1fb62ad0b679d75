/* hal/drive/odrive/text.c - words for error bits, states and results; see
 * drive.h.
 * Source: ODrive 0.5.6 Firmware/odrive-interface.yaml; odrive.enums.ODriveError
 * and ProcedureResult of the Python package odrive 0.6.11. */
#include "hal/drive/odrive/drive.h"

#include <stddef.h>

static const char *const odrive_bits_05[32] = {
    [0] = "invalid state",
    [6] = "motor failed",
    [7] = "sensorless estimator failed",
    [8] = "encoder failed",
    [9] = "controller failed",
    [11] = "watchdog expired",
    [12] = "lower end stop",
    [13] = "upper end stop",
    [14] = "e-stop requested",
    [17] = "homing without end stop",
    [18] = "over-temperature",
    [19] = "unknown position",
};

static const char *const odrive_bits_06[32] = {
    [0] = "initialising",
    [1] = "system level",
    [2] = "timing",
    [3] = "missing estimate",
    [4] = "bad config",
    [5] = "gate driver",
    [6] = "missing input",
    [8] = "DC over-voltage",
    [9] = "DC under-voltage",
    [10] = "DC over-current",
    [11] = "DC regen over-current",
    [12] = "current limit",
    [13] = "motor over-temperature",
    [14] = "inverter over-temperature",
    [15] = "velocity limit",
    [16] = "position limit",
    [17] = "requested current too high",
    [24] = "watchdog expired",
    [25] = "e-stop requested",
    [26] = "spin-out detected",
    [27] = "brake resistor disarmed",
    [28] = "thermistor disconnected",
    [30] = "calibration error",
};

const char *drive_odrive_error_text(enum drive_odrive_family family,
                                    uint32_t error)
{
    const char *const *const bits =
        family == DRIVE_ODRIVE_06 ? odrive_bits_06 : odrive_bits_05;

    if (error == 0)
        return "no error";
    for (unsigned i = 0; i < 32; i++)
        if ((error >> i & 1) != 0 && bits[i] != NULL)
            return bits[i];
    return "unknown error";
}

const char *drive_odrive_state_text(unsigned state)
{
    static const char *const words[] = {
        [0] = "undefined",
        [1] = "idle",
        [2] = "start-up sequence",
        [3] = "full calibration",
        [4] = "motor calibration",
        [5] = "sensorless control",
        [6] = "encoder index search",
        [7] = "encoder offset calibration",
        [8] = "closed loop control",
        [9] = "lock-in spin",
        [10] = "encoder direction find",
        [11] = "homing",
        [12] = "Hall polarity calibration",
        [13] = "Hall phase calibration",
        [14] = "anti-cogging calibration",
    };

    return state < sizeof words / sizeof words[0] ? words[state]
                                                  : "unknown state";
}

const char *drive_odrive_result_text(unsigned result)
{
    static const char *const words[] = {
        [0] = "success",
        [1] = "busy",
        [2] = "cancelled",
        [3] = "disarmed",
        [4] = "no response",
        [5] = "pole pairs and encoder do not match",
        [6] = "phase resistance out of range",
        [7] = "phase inductance out of range",
        [8] = "unbalanced phases",
        [9] = "invalid motor type",
        [10] = "illegal Hall state",
        [11] = "took too long",
        [12] = "homing without end stop",
        [13] = "invalid state",
        [14] = "not calibrated",
        [15] = "does not converge",
    };

    return result < sizeof words / sizeof words[0] ? words[result]
                                                   : "unknown result";
}
