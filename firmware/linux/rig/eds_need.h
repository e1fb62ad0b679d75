/* firmware/linux/rig/eds_need.h - what slew asks of a CiA 402 drive, and
 * whether a data sheet says that the drive has it. */
#ifndef FIRMWARE_LINUX_RIG_EDS_NEED_H
#define FIRMWARE_LINUX_RIG_EDS_NEED_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/linux/rig/eds.h"

enum eds_access { NEED_READ = 1, NEED_WRITE = 2, NEED_MAP = 4 };

struct eds_need {
    uint16_t index;
    uint8_t sub, access; /* enum eds_access */
    bool required;       /* the drive will not do without */
    const char *why;
};

/* What hal/drive_cia402_start.c asks of a drive; the first part it insists
 * on. */
extern const struct eds_need eds_needs[];
extern const unsigned eds_need_count;

/* NULL: all is well; else what is missing: "not there". */
const char *eds_lacks(const struct eds *eds, const struct eds_need *need);
/* How many objects are missing that must be there. */
unsigned eds_missing(const struct eds *eds);

#define EDS_MODE_CSP (UINT32_C(1) << 7) /* of 0x6502 */

#endif
