/* firmware/host/device/object.c - names, types and values; see object.h. */
#include "firmware/host/device/object.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/yaml/yaml_fields.h"

#define OBJECT_NAMES_MAX 4096

static int object_fail(char message[OBJECT_MESSAGE_MAX], const char *format,
                       ...) __attribute__((format(printf, 2, 3)));
static int object_fail(char message[OBJECT_MESSAGE_MAX], const char *format,
                       ...)
{
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(message, OBJECT_MESSAGE_MAX, format, arguments);
    va_end(arguments);
    return -1;
}

/* ---- types ---- */

static const struct {
    const char *word;
    uint8_t size;
    int64_t min, max;
} object_types[] = {
    [OBJECT_UNKNOWN] = { "", 0, 0, 0 },
    [OBJECT_BOOL] = { "bool", 1, 0, 1 },
    [OBJECT_I8] = { "i8", 1, INT8_MIN, INT8_MAX },
    [OBJECT_I16] = { "i16", 2, INT16_MIN, INT16_MAX },
    [OBJECT_I32] = { "i32", 4, INT32_MIN, INT32_MAX },
    [OBJECT_U8] = { "u8", 1, 0, UINT8_MAX },
    [OBJECT_U16] = { "u16", 2, 0, UINT16_MAX },
    [OBJECT_U32] = { "u32", 4, 0, UINT32_MAX },
    [8] = { "f32", 0, 0, 0 },
    [OBJECT_TEXT] = { "text", 0, 0, 0 },
};
#define OBJECT_TYPES ARRAY_LEN(object_types)

const char *object_type_text(uint8_t type)
{
    return type < OBJECT_TYPES ? object_types[type].word : "";
}

bool object_type_of(const char *word, uint8_t *type)
{
    for (size_t i = 1; i < OBJECT_TYPES; i++)
        if (object_types[i].size > 0 &&
            strcmp(word, object_types[i].word) == 0) {
            *type = (uint8_t)i;
            return true;
        }
    return false;
}

unsigned object_type_size(uint8_t type)
{
    return type < OBJECT_TYPES ? object_types[type].size : 0;
}

static void object_type_range(uint8_t type, int64_t *min, int64_t *max)
{
    const size_t at = type < OBJECT_TYPES ? type : 0;

    *min = object_types[at].min;
    *max = object_types[at].max;
}

/* ---- which one ---- */

static const struct object_row *object_row(uint16_t index, uint8_t sub)
{
    for (unsigned i = 0; i < object_list_count; i++)
        if (object_list[i].index == index && object_list[i].sub == sub)
            return &object_list[i];
    return NULL;
}

static void object_take_eds(struct object *object,
                            const struct eds_object *from)
{
    if (from == NULL)
        return;
    object->in_eds = true;
    if (from->type != OBJECT_UNKNOWN)
        object->type = from->type;
    object->readable = from->readable;
    object->writable = from->writable;
    object->has_low = from->has_low;
    object->has_high = from->has_high;
    object->low = from->low;
    object->high = from->high;
    if (from->name[0] != '\0')
        snprintf(object->name, sizeof object->name, "%s", from->name);
}

void object_of(uint16_t index, uint8_t sub, const struct eds *eds,
               struct object *object)
{
    const struct object_row *row = object_row(index, sub);

    *object = (struct object){ .index = index, .sub = sub, .unit = "" };
    if (row != NULL) {
        object->type = row->type;
        object->unit = row->unit;
        snprintf(object->name, sizeof object->name, "%s", row->name);
    }
    if (eds != NULL)
        object_take_eds(object, eds_find(eds, index, sub));
}

/* Hexadecimal, as in data sheets. */
static bool object_is_sub(const char *text, uint8_t *sub)
{
    unsigned long number;
    char *end;

    if (!isxdigit((unsigned char)text[0]) || tolower(text[1]) == 'x')
        return false;
    number = strtoul(text, &end, 16);
    *sub = (uint8_t)number;
    return *end == '\0' && number <= UINT8_MAX;
}

/* "6041", "0x6041:1", "607Dsub1"; false: a name. */
static bool object_is_number(const char *text, uint16_t *index, uint8_t *sub)
{
    char *end;
    unsigned long number;

    if (strncasecmp(text, "0x", 2) == 0)
        text += 2;
    if (!isxdigit((unsigned char)text[0]))
        return false;
    number = strtoul(text, &end, 16);
    if (end - text != 4 || number > UINT16_MAX)
        return false;
    *index = (uint16_t)number;
    *sub = 0;
    if (*end == '\0')
        return true;
    if (*end == ':')
        end++;
    else if (strncasecmp(end, "sub", 3) == 0)
        end += 3;
    else
        return false;
    return object_is_sub(end, sub);
}

/* Names as people write them: case, blanks, - and _ make no difference. */
static bool object_same_name(const char *a, const char *b)
{
    for (;;) {
        while (*a != '\0' && strchr(" _-", *a) != NULL)
            a++;
        while (*b != '\0' && strchr(" _-", *b) != NULL)
            b++;
        if (tolower((unsigned char)*a) != tolower((unsigned char)*b))
            return false;
        if (*a == '\0')
            return true;
        a++;
        b++;
    }
}

/* How many of the data sheet's have that name; *found is the last. */
static unsigned object_in_eds(const char *text, const struct eds *eds,
                              const struct eds_object **found)
{
    unsigned count = 0;

    for (unsigned i = 0; eds != NULL && i < eds->count; i++)
        if (object_same_name(eds->object[i].name, text)) {
            *found = &eds->object[i];
            count++;
        }
    return count;
}

static const struct object_row *object_in_list(const char *text)
{
    for (unsigned i = 0; i < object_list_count; i++)
        if (object_same_name(object_list[i].name, text))
            return &object_list[i];
    return NULL;
}

static int object_unknown(const char *text, const struct eds *eds,
                          char message[OBJECT_MESSAGE_MAX])
{
    static const char *name[OBJECT_NAMES_MAX];
    char quote[QUOTE_MAX];
    const char *near;
    unsigned count = 0;

    for (unsigned i = 0; i < object_list_count; i++)
        name[count++] = object_list[i].name;
    for (unsigned i = 0;
         eds != NULL && i < eds->count && count < OBJECT_NAMES_MAX; i++)
        name[count++] = eds->object[i].name;
    near = yaml_nearest(text, name, count);
    return object_fail(
        message,
        "%s is not an object of this drive, expected a number such "
        "as 6041 or 607D:1, or a name%s%s%s",
        quote_text(quote, text, strlen(text)),
        near == NULL ? "" : " (did you mean '", near == NULL ? "" : near,
        near == NULL ? "" : "'?)");
}

int object_find(const char *text, const struct eds *eds, struct object *object,
                char message[OBJECT_MESSAGE_MAX])
{
    const struct eds_object *named = NULL;
    const struct object_row *row;
    char quote[QUOTE_MAX];
    uint16_t index;
    uint8_t sub;

    if (object_is_number(text, &index, &sub)) {
        object_of(index, sub, eds, object);
        return 0;
    }
    const unsigned count = object_in_eds(text, eds, &named);
    if (count > 1)
        return object_fail(message,
                           "%s is the name of %u objects, expected a number "
                           "such as %04X:%X",
                           quote_text(quote, text, strlen(text)), count,
                           named->index, named->sub);
    if (count == 1) {
        object_of(named->index, named->sub, eds, object);
        return 0;
    }
    row = object_in_list(text);
    if (row == NULL)
        return object_unknown(text, eds, message);
    object_of(row->index, row->sub, eds, object);
    return 0;
}

void object_number(const struct object *object, char text[OBJECT_NUMBER_MAX])
{
    snprintf(text, OBJECT_NUMBER_MAX, "%04X:%X", object->index, object->sub);
}

/* ---- values ---- */

int64_t object_value(uint8_t type, unsigned size, uint32_t raw)
{
    const unsigned known = object_type_size(type);
    const unsigned bytes = known > 0 && known < size ? known : size;
    const uint32_t cut =
        bytes >= 4 ? raw : raw & ((UINT32_C(1) << 8 * bytes) - 1);

    if (type != OBJECT_I8 && type != OBJECT_I16 && type != OBJECT_I32)
        return cut;
    if (bytes == 1)
        return (int8_t)(uint8_t)cut;
    return bytes == 2 ? (int16_t)(uint16_t)cut : (int32_t)cut;
}

/* Is the value one that the data sheet lets in?  0, or -1 with a sentence. */
static int object_judge(const struct object *object, int64_t value,
                        char message[OBJECT_MESSAGE_MAX])
{
    char number[OBJECT_NUMBER_MAX];
    int64_t min, max;

    object_number(object, number);
    if (object_type_size(object->type) == 0)
        return object_fail(message, "%s is not a number of 32 bits or fewer",
                           number);
    if (object->in_eds && !object->writable)
        return object_fail(message,
                           "%s cannot be written: it is read-only in the "
                           "data sheet",
                           number);
    object_type_range(object->type, &min, &max);
    if (object->has_low && object->low > min)
        min = object->low;
    if (object->has_high && object->high < max)
        max = object->high;
    if (value < min || value > max)
        return object_fail(message,
                           "%" PRId64 " is outside of %s, expected %" PRId64
                           " .. %" PRId64,
                           value, number, min, max);
    return 0;
}

int object_parse(const struct object *object, const char *text, int64_t *value,
                 char message[OBJECT_MESSAGE_MAX])
{
    char quote[QUOTE_MAX], *end;

    errno = 0;
    *value = strtoll(text, &end, 0);
    if (end == text || *end != '\0' || errno != 0 ||
        isspace((unsigned char)text[0]))
        return object_fail(message,
                           "%s is not a value, expected a whole number such as "
                           "1200 or 0x1F",
                           quote_text(quote, text, strlen(text)));
    return object_judge(object, *value, message);
}
