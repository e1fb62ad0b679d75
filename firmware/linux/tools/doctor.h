/* firmware/linux/tools/doctor.h - is this machine fit to move servos, and if
 * not, what is to be done?
 *
 * Looks at rights, interfaces, latency settings, the kernel and the libraries,
 * and measures how late a sleeping program wakes up.  It changes nothing.
 *
 * What the kernel shows in files is read below a root directory of the
 * caller's choice, so that a test can show another machine.
 *
 *   doctor.c         files, lines, the order of things
 *   doctor_rights.c  groups, capabilities, limits, device files
 *   doctor_can.c     CAN interfaces
 *   doctor_line.c    serial ports and GPIO chips
 *   doctor_cpu.c     processor and scheduler
 *   doctor_kernel.c  what the kernel was built with; libraries
 *   doctor_jitter.c  wake-ups, measured */
#ifndef FIRMWARE_LINUX_TOOLS_DOCTOR_H
#define FIRMWARE_LINUX_TOOLS_DOCTOR_H

#include <stdbool.h>
#include <stdint.h>

#include <cjson/cJSON.h>

#include "firmware/host/rig/rig.h"
#include "hal/linux/socketcan_link.h"

#define DOCTOR_LINES_MAX  128
#define DOCTOR_TOPIC_MAX  24
#define DOCTOR_WHAT_MAX   160
#define DOCTOR_ADVICE_MAX 240
#define DOCTOR_GROUPS_MAX 64

/* X(name, word) */
#define DOCTOR_VERDICT_LIST(X)                                                 \
    X(DOCTOR_OK, "ok")                                                         \
    X(DOCTOR_NOTE, "note")     /* to know, not to do */                        \
    X(DOCTOR_ADVICE, "advice") /* it works, and could work better */           \
    X(DOCTOR_BAD, "bad")       /* what the rig needs will not work */

enum doctor_verdict {
#define DOCTOR_VERDICT_ENUM(name, word) name,
    DOCTOR_VERDICT_LIST(DOCTOR_VERDICT_ENUM)
#undef DOCTOR_VERDICT_ENUM
};
const char *doctor_verdict_text(enum doctor_verdict verdict);

struct doctor_line {
    enum doctor_verdict verdict;
    char topic[DOCTOR_TOPIC_MAX];
    char what[DOCTOR_WHAT_MAX];
    char advice[DOCTOR_ADVICE_MAX]; /* a command or a sentence; "": none */
};

struct doctor_config {
    const char *root;      /* "" is this machine; else a directory */
    const struct rig *rig; /* NULL: no rig, nothing is needed */
    /* What netlink says of an interface, as can_link_read; NULL: not asked */
    int (*link)(const char *name, struct can_link *link);
    const cJSON *service; /* `status` of a service that has the rig; NULL */
    int64_t measure_ns;   /* how long wake-ups are measured; 0: not */
    int64_t period_ns;    /* at this period */
};

/* Who we are, as /proc/self/status has it. */
struct doctor_self {
    bool known;
    unsigned uid;
    uint64_t capabilities; /* effective, a bit each */
    unsigned group[DOCTOR_GROUPS_MAX];
    unsigned group_count;
};

struct doctor {
    struct doctor_config config;
    struct doctor_self self;
    struct doctor_line line[DOCTOR_LINES_MAX];
    unsigned count;
};

/* Fills in the lines; what is beyond DOCTOR_LINES_MAX is left out, and the last
 * line says so. */
void doctor_examine(struct doctor *doctor, const struct doctor_config *config);
/* The worst verdict. */
enum doctor_verdict doctor_worst(const struct doctor *doctor);

#endif
