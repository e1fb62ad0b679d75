/* firmware/host/device/eds_need.h - what slew asks of a CiA 402 drive, and
 * whether a data sheet says that the drive has it. */
#ifndef FIRMWARE_HOST_DEVICE_EDS_NEED_H
#define FIRMWARE_HOST_DEVICE_EDS_NEED_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/device/eds.h"

enum eds_access { NEED_READ = 1, NEED_WRITE = 2, NEED_MAP = 4 };

/* What it is used for; X(name, bit, words), as the rig has it. */
#define EDS_USE_LIST(X)                                                        \
    X(EDS_ALWAYS, 0, "must")                                                   \
    X(EDS_CSP, 1, "for mode: csp")                                             \
    X(EDS_IP, 2, "for mode: ip")                                               \
    X(EDS_CSV, 3, "for mode: csv")                                             \
    X(EDS_HEARTBEAT, 4, "without guarding")                                    \
    X(EDS_GUARDING, 5, "for guarding")                                         \
    X(EDS_HOMING, 6, "for homing by: drive")                                   \
    X(EDS_QUICK_STOP, 7, "for options: quick_stop")                            \
    X(EDS_SHUTDOWN, 8, "for options: shutdown")                                \
    X(EDS_DISABLE, 9, "for options: disable")                                  \
    X(EDS_HALT, 10, "for options: halt")                                       \
    X(EDS_FAULT, 11, "for options: fault")                                     \
    X(EDS_COUNTER, 12, "for sync_counter")                                     \
    X(EDS_SUPERVISED, 13, "without unsupervised: yes")                         \
    X(EDS_CONSUMER, 14, "without guarding and unsupervised: yes")
enum eds_use {
#define EDS_USE_ENUM(name, bit, words) name = 1 << (bit),
    EDS_USE_LIST(EDS_USE_ENUM)
#undef EDS_USE_ENUM
};
/* Of a rig that says nothing else. */
#define EDS_PLAIN                                                              \
    (EDS_ALWAYS | EDS_CSP | EDS_HEARTBEAT | EDS_SUPERVISED | EDS_CONSUMER)

struct eds_need {
    uint16_t index;
    uint8_t sub, access; /* enum eds_access */
    uint16_t must;       /* enum eds_use: those that cannot do without; 0: it
                            is used where it is there */
    const char *why;
};

/* What hal/drive/cia402/start.c and hal/drive/cia402/home.c ask of a drive. */
extern const struct eds_need eds_needs[];
extern const unsigned eds_need_count;

/* "must", "for mode: ip", "may": of its first use. */
const char *eds_need_text(const struct eds_need *need);

/* NULL: all is well; else what is missing: "not there". */
const char *eds_lacks(const struct eds *eds, const struct eds_need *need,
                      uint16_t index);
/* Is it one that these uses cannot do without? */
static inline bool eds_is_needed(const struct eds_need *need, unsigned uses)
{
    return (need->must & uses) != 0;
}
/* How many objects are missing that these uses must have. */
unsigned eds_missing(const struct eds *eds, unsigned uses);

/* Of 0x6502. */
#define EDS_MODE_CSP (UINT32_C(1) << 7)

#endif
