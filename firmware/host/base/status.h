/* firmware/host/base/status.h - how slew ends: the status of the process. */
#ifndef FIRMWARE_HOST_BASE_STATUS_H
#define FIRMWARE_HOST_BASE_STATUS_H

/* X(name, value, sentence for --help) */
#define STATUS_LIST(X)                                                         \
    X(STATUS_OK, 0, "done, nothing wrong")                                     \
    X(STATUS_REFUSED, 1, "a limit would be broken, or a fault during the run") \
    X(STATUS_INPUT, 2, "bad arguments or a bad file; one line says what")      \
    X(STATUS_SYSTEM, 3, "the system failed (disk, memory), or slew itself")    \
    X(STATUS_INTERRUPTED, 130, "interrupted by the user, stopped safely")

enum status {
#define STATUS_ENUM(name, value, text) name = value,
    STATUS_LIST(STATUS_ENUM)
#undef STATUS_ENUM
};

#endif
