/* firmware/linux/kind/cia402/value.c - objects, read; see verbs.h. */
#include <ctype.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "firmware/linux/kind/cia402/verbs.h"

#define VALUE_BYTES 128

static void value_take_text(struct drive_value *value, const uint8_t *bytes,
                            uint32_t length)
{
    uint32_t i = 0;

    for (; i < length && i < sizeof value->text - 1 && bytes[i] != 0; i++)
        value->text[i] = isprint(bytes[i]) ? (char)bytes[i] : '?';
    value->text[i] = '\0';
}

/* What is neither a quantity nor small is a code or bits. */
static void value_in_hex(const struct object *object, struct drive_value *value)
{
    const size_t used = strlen(value->text);

    if (object->unit[0] == '\0' && value->value > 9)
        snprintf(value->text + used, sizeof value->text - used, "%s0x%" PRIX64,
                 used > 0 ? ", " : "", value->value);
}

static void value_take(const struct rig_axis *axis, const struct object *object,
                       const uint8_t *bytes, uint32_t length,
                       struct drive_value *value)
{
    uint32_t raw = 0;

    if (object->type == OBJECT_TEXT || length > 4) {
        value_take_text(value, bytes, length);
        return;
    }
    for (uint32_t i = 0; i < length; i++)
        raw |= (uint32_t)bytes[i] << 8 * i;
    value->is_number = length > 0;
    value->value = object_value(object->type, length, raw);
    object_words(object, value->value, value->text);
    value_in_hex(object, value);
    drive_value_in_units(axis, value);
}

static void value_type(const struct object *object, uint32_t length,
                       struct drive_value *value)
{
    const char *type = object_type_text(object->type);

    if (type[0] != '\0')
        snprintf(value->type, sizeof value->type, "%s", type);
    else if (length > 0 && length <= 4)
        snprintf(value->type, sizeof value->type, "u%u", 8 * length);
}

void cia402_read_object_of(struct session *session, const struct rig_axis *axis,
                           const struct object *object, uint16_t index,
                           struct drive_value *value)
{
    struct object there = *object;
    uint8_t bytes[VALUE_BYTES] = { 0 };
    uint32_t length = 0;
    const int err = canopen_client_read(&session->can, index, object->sub,
                                        bytes, sizeof bytes, &length);

    there.index = index;
    *value = (struct drive_value){ .is_number = false };
    object_number(&there, value->number);
    snprintf(value->name, sizeof value->name, "%s", object->name);
    snprintf(value->unit, sizeof value->unit, "%s", object->unit);
    if (err < 0) {
        session_text(session, err, value->error);
        return;
    }
    value_type(object, length, value);
    value_take(axis, object, bytes, length, value);
}

void cia402_read_object(struct session *session, const struct object *object,
                        struct drive_value *value)
{
    cia402_read_object_of(session, session->axis, object, object->index, value);
}
