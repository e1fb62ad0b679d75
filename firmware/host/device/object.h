/* firmware/host/device/object.h - objects of a CANopen drive, by number or by
 * name, with type and unit, and their values in words.
 *
 * What is known comes from the drive's data sheet when there is one, else from
 * the list of CiA 301 and CiA 402 in object_list.c; the unit is the profile's,
 * in the drive's own counts. */
#ifndef FIRMWARE_HOST_DEVICE_OBJECT_H
#define FIRMWARE_HOST_DEVICE_OBJECT_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/device/eds.h"

#define OBJECT_MESSAGE_MAX 256
#define OBJECT_TEXT_MAX    160

/* CiA 301 table 44, what slew can show. */
enum object_type {
    OBJECT_UNKNOWN = 0,
    OBJECT_BOOL = 1,
    OBJECT_I8 = 2,
    OBJECT_I16 = 3,
    OBJECT_I32 = 4,
    OBJECT_U8 = 5,
    OBJECT_U16 = 6,
    OBJECT_U32 = 7,
    OBJECT_TEXT = 9,
};
/* "i32" ..., "" for one that is not known. */
const char *object_type_text(uint8_t type);
/* false: no word for a type of numbers. */
bool object_type_of(const char *word, uint8_t *type);
/* Bytes of a number; 0: not a number, or not known. */
unsigned object_type_size(uint8_t type);

struct object {
    uint16_t index;
    uint8_t sub;
    uint8_t type;
    char name[EDS_NAME_MAX]; /* "": unknown */
    const char *unit;        /* "counts", "" */
    bool in_eds;             /* what follows is known */
    bool readable, writable;
    bool has_low, has_high;
    int64_t low, high;
};

/* "6041", "0x607D:1", "607Dsub1", "Statusword".  `eds` may be NULL.  0, or -1
 * with "... is not an object of this drive, expected ...". */
int object_find(const char *text, const struct eds *eds, struct object *object,
                char message[OBJECT_MESSAGE_MAX]);
/* The one of that number; with neither a name nor a type when it is unknown. */
void object_of(uint16_t index, uint8_t sub, const struct eds *eds,
               struct object *object);

/* "6041:0" */
#define OBJECT_NUMBER_MAX 12
void object_number(const struct object *object, char text[OBJECT_NUMBER_MAX]);

/* From the bytes on the wire, sign extended. */
int64_t object_value(uint8_t type, unsigned size, uint32_t raw);
/* "12", "-0x1F", with the range of the type and the data sheet.  0, or -1 with
 * a sentence. */
int object_parse(const struct object *object, const char *text, int64_t *value,
                 char message[OBJECT_MESSAGE_MAX]);
/* "operation enabled"; "" for a value that needs no words. */
void object_words(const struct object *object, int64_t value,
                  char text[OBJECT_TEXT_MAX]);

/* Rows of object_list.c. */
struct object_row {
    uint16_t index;
    uint8_t sub, type;
    const char *name, *unit;
};
extern const struct object_row object_list[];
extern const unsigned object_list_count;

#endif
