/* hal/drive/moteus/text.c - words for fault codes and modes; see drive.h. */
#include "hal/drive/moteus/drive.h"

#define FIRST 32u

static const char *const moteus_faults[] = {
    [32 - FIRST] = "no magnet while calibrating",
    [33 - FIRST] = "motor driver, perhaps under-voltage",
    [34 - FIRST] = "over-voltage",
    [35 - FIRST] = "encoder",
    [36 - FIRST] = "motor not calibrated",
    [37 - FIRST] = "PWM cycle overrun",
    [38 - FIRST] = "over-temperature",
    [39 - FIRST] = "started outside its position limits",
    [40 - FIRST] = "under-voltage",
    [41 - FIRST] = "configuration changed while on",
    [42 - FIRST] = "no valid commutation encoder",
    [43 - FIRST] = "no valid output encoder",
    [44 - FIRST] = "gate driver not enabled",
    [45 - FIRST] = "stop position with limits",
    [46 - FIRST] = "timing violation",
    [47 - FIRST] = "feed-forward without acceleration limit",
    [48 - FIRST] = "position limits out of range",
};

const char *drive_moteus_fault_text(unsigned fault)
{
    const unsigned known = sizeof moteus_faults / sizeof moteus_faults[0];

    return fault >= FIRST && fault - FIRST < known
               ? moteus_faults[fault - FIRST]
               : "unknown fault";
}

const char *drive_moteus_mode_text(unsigned mode)
{
    static const char *const words[] = {
        [0] = "stopped",
        [1] = "fault",
        [2] = "preparing",
        [3] = "preparing",
        [4] = "preparing",
        [5] = "PWM",
        [6] = "voltage",
        [7] = "voltage FOC",
        [8] = "voltage DQ",
        [9] = "current",
        [10] = "position",
        [11] = "watchdog time-out",
        [12] = "zero velocity",
        [13] = "stay within",
        [14] = "measuring inductance",
        [15] = "brake",
    };

    return mode < sizeof words / sizeof words[0] ? words[mode] : "unknown mode";
}
