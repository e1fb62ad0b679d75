/* firmware/host/device/eds.h - the data sheet of a CANopen device: EDS and DCF
 * files.
 *
 * An INI file whose sections are objects, [6040] or [1018sub1].  Only what a
 * master asks is kept: type, access, mapping, default.  In a DCF the parameter
 * value, where there is one, takes the default's place.  Source: CiA 306. */
#ifndef FIRMWARE_HOST_DEVICE_EDS_H
#define FIRMWARE_HOST_DEVICE_EDS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "firmware/host/base/files.h"

#define EDS_OBJECTS_MAX 4096
#define EDS_NAME_MAX    64
#define EDS_MESSAGE_MAX 512

struct eds_object {
    uint16_t index;
    uint8_t sub;
    uint8_t type; /* CiA 301's: 5 u8, 6 u16 ... */
    bool is_sub;  /* of a section with a sub-index; [1018] only heads its own */
    bool readable, writable, mappable;
    bool has_value, adds_node; /* $NODEID is to be added */
    uint32_t value;
    bool has_low, has_high; /* LowLimit, HighLimit, as the type means them */
    int64_t low, high;
    unsigned line; /* of its section */
    char name[EDS_NAME_MAX];
};

struct eds {
    char vendor[EDS_NAME_MAX], product[EDS_NAME_MAX];
    struct eds_object object[EDS_OBJECTS_MAX]; /* in the file's order */
    unsigned count;
};

/* 0; -1 with one sentence, "path:line: what is wrong, expected ...". */
int eds_load(const struct files *files, const char *path, struct eds *eds,
             char message[EDS_MESSAGE_MAX]);
/* NULL: the device has none. */
const struct eds_object *eds_find(const struct eds *eds, uint16_t index,
                                  uint8_t sub);

#endif
