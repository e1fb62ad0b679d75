/* firmware/host/device/eds.h - the data sheet of a CANopen device: EDS and DCF
 * files.
 *
 * An INI file whose sections are objects, [6040] or [1018sub1].  Only what a
 * master asks is kept: type, access, mapping, default.  In a DCF the parameter
 * value, where there is one, takes the default's place.  What an array or the
 * PDOs leave to CompactSubObj and CompactPDO is written out.
 *
 * Makers write much that CiA 306 does not say.  What cannot be read is no value
 * and a warning; only who needs it refuses the drive.  Source: CiA 306. */
#ifndef FIRMWARE_HOST_DEVICE_EDS_H
#define FIRMWARE_HOST_DEVICE_EDS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "firmware/host/base/files.h"
#include "firmware/host/device/eds_ini.h"

#define EDS_OBJECTS_MAX (1 << 17)
#define EDS_NAME_MAX    64 /* of a name that is copied */
#define EDS_MESSAGE_MAX 512

/* What of an object is there and cannot be read, or is missing. */
enum eds_unread { EDS_UNREAD_ACCESS = 1, EDS_UNREAD_MAPPING = 2 };

struct eds_object {
    uint16_t index;
    uint8_t sub;
    uint8_t type; /* CiA 301's: 5 u8, 6 u16 ...; 0: not known */
    bool is_sub;  /* of a section with a sub-index; [1018] only heads its own */
    bool readable, writable, mappable;
    uint8_t unread;            /* enum eds_unread */
    bool has_value, adds_node; /* $NODEID is to be added */
    bool has_low, has_high;    /* LowLimit, HighLimit */
    int64_t value, low, high;  /* as the type means them; of u64 its bits */
    unsigned line;             /* of its section */
    const char *name;
};

#define EDS_WARNINGS_MAX 1000 /* that are kept; all are counted */
struct eds_warning {
    unsigned line;
    char text[160];
};

struct eds {
    const char *vendor, *product;
    struct eds_object *object; /* by index, head and subs */
    unsigned count;
    struct eds_warning *warning;
    unsigned warnings;
    struct eds_ini ini; /* has the texts */
};

/* 0; -1 with one sentence, "path:line: what is wrong, expected ...".  eds_free in
 * either case. */
int eds_load(const struct files *files, const char *path, struct eds *eds,
             char message[EDS_MESSAGE_MAX]);
void eds_free(struct eds *eds);

/* NULL: the device has none. */
const struct eds_object *eds_find(const struct eds *eds, uint16_t index,
                                  uint8_t sub);

#endif
