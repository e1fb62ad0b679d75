/* firmware/host/device/quantity.c - see quantity.h. */
#include "firmware/host/device/quantity.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/yaml/yaml_fields.h"

/* ---- types ---- */

static const struct {
    const char *word;
    unsigned bytes;
    int64_t min, max;
} quantity_types[] = {
    [QUANTITY_BOOL] = { "bool", 1, 0, 1 },
    [QUANTITY_U8] = { "u8", 1, 0, UINT8_MAX },
    [QUANTITY_I8] = { "i8", 1, INT8_MIN, INT8_MAX },
    [QUANTITY_U16] = { "u16", 2, 0, UINT16_MAX },
    [QUANTITY_I16] = { "i16", 2, INT16_MIN, INT16_MAX },
    [QUANTITY_U32] = { "u32", 4, 0, UINT32_MAX },
    [QUANTITY_I32] = { "i32", 4, INT32_MIN, INT32_MAX },
    [QUANTITY_F32] = { "f32", 4, 0, 0 },
};
#define QUANTITY_TYPES ARRAY_LEN(quantity_types)

const char *quantity_type_text(enum quantity_type type)
{
    return quantity_types[type].word;
}

bool quantity_type_of(const char *word, enum quantity_type *type)
{
    for (unsigned i = 0; i < QUANTITY_TYPES; i++)
        if (strcmp(word, quantity_types[i].word) == 0) {
            *type = (enum quantity_type)i;
            return true;
        }
    return false;
}

unsigned quantity_type_size(enum quantity_type type)
{
    return quantity_types[type].bytes;
}

/* ---- names ---- */

static char next_letter(const char **at)
{
    while (**at == ' ' || **at == '_' || **at == '-')
        (*at)++;
    return **at == '\0' ? '\0' : (char)tolower((unsigned char)*(*at)++);
}

static bool is_same_name(const char *a, const char *b)
{
    char letter;

    do {
        letter = next_letter(&a);
        if (letter != next_letter(&b))
            return false;
    } while (letter != '\0');
    return true;
}

const struct quantity *
quantity_find(const char *name, const struct quantity *list, unsigned count)
{
    for (unsigned i = 0; i < count; i++)
        if (is_same_name(name, list[i].name))
            return &list[i];
    return NULL;
}

#define QUANTITY_LIST_MAX 64

void quantity_unknown(const char *text, const char *what,
                      const struct quantity *list, unsigned count,
                      char message[QUANTITY_MESSAGE_MAX])
{
    const char *name[QUANTITY_LIST_MAX];
    const char *near;

    if (count > QUANTITY_LIST_MAX)
        count = QUANTITY_LIST_MAX;
    for (unsigned i = 0; i < count; i++)
        name[i] = list[i].name;
    near = yaml_nearest(text, name, count);
    snprintf(message, QUANTITY_MESSAGE_MAX,
             "'%.60s' is no %s, expected a number or a name such as %s%s%s%s",
             text, what, list[0].name, near == NULL ? "" : " (did you mean '",
             near == NULL ? "" : near, near == NULL ? "" : "'?)");
}

void quantity_number(const struct quantity *quantity,
                     char text[QUANTITY_NUMBER_MAX])
{
    if (quantity->kind == QUANTITY_ENDPOINT)
        snprintf(text, QUANTITY_NUMBER_MAX, "%u", quantity->at);
    else if (quantity->kind == QUANTITY_REGISTER)
        snprintf(text, QUANTITY_NUMBER_MAX, "0x%03X", quantity->at);
    else
        snprintf(text, QUANTITY_NUMBER_MAX, "0x%02X:%u", quantity->at,
                 quantity->offset);
}

/* ---- values ---- */

int64_t quantity_value(enum quantity_type type, uint32_t raw)
{
    switch (type) {
    case QUANTITY_BOOL:
        return (raw & 0xFF) != 0;
    case QUANTITY_U8:
        return (uint8_t)raw;
    case QUANTITY_I8:
        return (int8_t)raw;
    case QUANTITY_U16:
        return (uint16_t)raw;
    case QUANTITY_I16:
        return (int16_t)raw;
    case QUANTITY_I32:
        return (int32_t)raw;
    case QUANTITY_U32:
    case QUANTITY_F32:
        break;
    }
    return raw;
}

static bool parse_float(const char *text, uint32_t *raw)
{
    char *end;
    float value;

    errno = 0;
    value = strtof(text, &end);
    if (end == text || *end != '\0' || errno != 0 || !isfinite(value))
        return false;
    memcpy(raw, &value, sizeof *raw);
    return true;
}

static bool parse_integer(const char *text, enum quantity_type type,
                          uint32_t *raw)
{
    char *end;
    long long value;

    errno = 0;
    value = strtoll(text, &end, 0);
    *raw = (uint32_t)value;
    return end != text && *end == '\0' && errno == 0 &&
           value >= quantity_types[type].min &&
           value <= quantity_types[type].max;
}

static int parse_refuse(const struct quantity *quantity, const char *text,
                        char message[QUANTITY_MESSAGE_MAX])
{
    if (quantity->type == QUANTITY_F32)
        snprintf(message, QUANTITY_MESSAGE_MAX,
                 "'%.40s' is not a value, expected a number", text);
    else if (quantity->type == QUANTITY_BOOL)
        snprintf(message, QUANTITY_MESSAGE_MAX,
                 "'%.40s' is not a value, expected true or false", text);
    else
        snprintf(message, QUANTITY_MESSAGE_MAX,
                 "'%.40s' is not a value, expected %" PRId64 " .. %" PRId64,
                 text, quantity_types[quantity->type].min,
                 quantity_types[quantity->type].max);
    return -1;
}

int quantity_parse(const struct quantity *quantity, const char *text,
                   uint32_t *raw, char message[QUANTITY_MESSAGE_MAX])
{
    bool fits;

    if (quantity->type == QUANTITY_BOOL &&
        (strcmp(text, "true") == 0 || strcmp(text, "false") == 0)) {
        *raw = text[0] == 't';
        return 0;
    }
    fits = quantity->type == QUANTITY_F32
               ? parse_float(text, raw)
               : parse_integer(text, quantity->type, raw);
    return fits ? 0 : parse_refuse(quantity, text, message);
}
