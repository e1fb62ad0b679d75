/* hal/drive/drive.c - see drive.h. */
#include "hal/drive.h"

const char *hal_drive_state_text(enum hal_drive_state state)
{
    switch (state) {
    case HAL_DRIVE_OFFLINE:
        return "offline";
    case HAL_DRIVE_OFF:
        return "off";
    case HAL_DRIVE_ENABLING:
        return "enabling";
    case HAL_DRIVE_ENABLED:
        return "enabled";
    case HAL_DRIVE_QUICK_STOP:
        return "quick stop";
    case HAL_DRIVE_FAULT:
        return "fault";
    }
    return "unknown";
}

const char *hal_drive_mode_text(enum hal_drive_mode mode)
{
    static const char *const text[] = {
        [HAL_DRIVE_STREAM_POSITION] = "streamed position",
        [HAL_DRIVE_STREAM_VELOCITY] = "streamed velocity",
        [HAL_DRIVE_PROFILE_POSITION] = "profile position",
        [HAL_DRIVE_PROFILE_VELOCITY] = "profile velocity",
        [HAL_DRIVE_HOMING] = "homing",
    };

    return (unsigned)mode < HAL_DRIVE_MODES ? text[mode] : "unknown";
}

const char *hal_drive_event_text(enum hal_drive_event event)
{
    static const char *const text[] = {
        [HAL_DRIVE_EVENT_WARNING] = "warning",
        [HAL_DRIVE_EVENT_LIMIT] = "internal limit",
        [HAL_DRIVE_EVENT_NOT_FOLLOWING] = "set points left out",
        [HAL_DRIVE_EVENT_EMERGENCY] = "emergency message",
    };

    return (unsigned)event < HAL_DRIVE_EVENTS ? text[event] : "unknown";
}
