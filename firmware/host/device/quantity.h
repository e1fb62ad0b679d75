/* firmware/host/device/quantity.h - what a drive that counts turns says of itself
 * and lets be set, by name or number: a message, an endpoint or a register.  What
 * a kind of drive has stands in firmware/host/kind. */
#ifndef FIRMWARE_HOST_DEVICE_QUANTITY_H
#define FIRMWARE_HOST_DEVICE_QUANTITY_H

#include <stdbool.h>
#include <stdint.h>

#define QUANTITY_NAME_MAX    96
#define QUANTITY_MESSAGE_MAX 320

enum quantity_kind { QUANTITY_MESSAGE, QUANTITY_ENDPOINT, QUANTITY_REGISTER };

enum quantity_type {
    QUANTITY_BOOL,
    QUANTITY_U8,
    QUANTITY_I8,
    QUANTITY_U16,
    QUANTITY_I16,
    QUANTITY_U32,
    QUANTITY_I32,
    QUANTITY_F32,
};
const char *quantity_type_text(enum quantity_type type); /* "f32" ... */
/* false: no such word. */
bool quantity_type_of(const char *word, enum quantity_type *type);
unsigned quantity_type_size(enum quantity_type type); /* bytes */

struct quantity {
    enum quantity_kind kind;
    enum quantity_type type;
    uint16_t at;    /* command, endpoint or register */
    uint8_t offset; /* of a message: its first byte */
    bool readable, writable;
    char name[QUANTITY_NAME_MAX];         /* "": unknown */
    const char *unit;                     /* "turns", "" */
    const char *(*words)(unsigned value); /* NULL: needs none */
};

/* By name; case, blanks, '-' and '_' make no difference.  NULL: none. */
const struct quantity *
quantity_find(const char *name, const struct quantity *list, unsigned count);
/* "'x' is no <what>, expected ... (did you mean ...)", from the names. */
void quantity_unknown(const char *text, const char *what,
                      const struct quantity *list, unsigned count,
                      char message[QUANTITY_MESSAGE_MAX]);

/* "0x00D" of a register, "190" of an endpoint, "0x17:4" of a message. */
#define QUANTITY_NUMBER_MAX 12
void quantity_number(const struct quantity *quantity,
                     char text[QUANTITY_NUMBER_MAX]);

/* From the bytes on the wire, little endian; a float stays as its bits. */
int64_t quantity_value(enum quantity_type type, uint32_t raw);
/* "12", "-0x1F", "true", "0.25": its bytes.  0, or -1 with a sentence. */
int quantity_parse(const struct quantity *quantity, const char *text,
                   uint32_t *raw, char message[QUANTITY_MESSAGE_MAX]);

#endif
