/* firmware/host/device/eds.c - see eds.h. */
#include "firmware/host/device/eds.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define EDS_LINE_MAX 1022

/* What is being read. */
struct eds_reader {
    const char *path;
    unsigned line;
    char *message;
    struct eds *eds;
    struct eds_object *object; /* of the section; NULL: another section */
    bool device;               /* in [DeviceInfo] */
};

static int eds_fail(struct eds_reader *reader, const char *what)
{
    snprintf(reader->message, EDS_MESSAGE_MAX, "%s:%u: %s", reader->path,
             reader->line, what);
    return -1;
}

/* Without the white space around it. */
static char *eds_trim(char *text)
{
    char *end;

    while (isspace((unsigned char)*text))
        text++;
    end = text + strlen(text);
    while (end > text && isspace((unsigned char)end[-1]))
        end--;
    *end = '\0';
    return text;
}

/* "6040" or "1018sub1", hexadecimal; false: another kind of section. */
static bool eds_is_object(const char *name, struct eds_object *object)
{
    char *end;
    const unsigned long index = strtoul(name, &end, 16);
    const bool is_sub =
        strncasecmp(end, "sub", 3) == 0 && isxdigit((unsigned char)end[3]);
    unsigned long sub = 0;

    if (end - name != 4 || !isxdigit((unsigned char)name[0]))
        return false;
    if (is_sub)
        sub = strtoul(end + 3, &end, 16);
    if (*end != '\0' || sub > 255)
        return false;
    *object = (struct eds_object){ .index = (uint16_t)index,
                                   .sub = (uint8_t)sub,
                                   .is_sub = is_sub };
    return true;
}

static const struct eds_object *eds_find_section(const struct eds *eds,
                                                 uint16_t index, uint8_t sub,
                                                 bool is_sub)
{
    for (unsigned i = 0; i < eds->count; i++)
        if (eds->object[i].index == index && eds->object[i].sub == sub &&
            eds->object[i].is_sub == is_sub)
            return &eds->object[i];
    return NULL;
}

static int eds_section(struct eds_reader *reader, char *name)
{
    struct eds *eds = reader->eds;
    char *end = strchr(name, ']');
    struct eds_object object;

    if (end == NULL)
        return eds_fail(reader, "a section without its end, expected ]");
    *end = '\0';
    name = eds_trim(name);
    reader->object = NULL;
    reader->device = strcasecmp(name, "DeviceInfo") == 0;
    if (!eds_is_object(name, &object))
        return 0;
    if (eds->count == EDS_OBJECTS_MAX)
        return eds_fail(reader, "too many objects, expected 4096 at most");
    if (eds_find_section(eds, object.index, object.sub, object.is_sub) != NULL)
        return eds_fail(reader, "the object is there already, expected each "
                                "one once");
    object.line = reader->line;
    reader->object = &eds->object[eds->count++];
    *reader->object = object;
    return 0;
}

static int eds_number(struct eds_reader *reader, const char *text,
                      uint32_t *value)
{
    char *end;
    long long number;

    errno = 0;
    number = strtoll(text, &end, 0);
    if (end == text || *end != '\0' || errno != 0 || number < INT32_MIN ||
        number > UINT32_MAX)
        return eds_fail(reader, "not a number, expected one such as 0x1F or "
                                "12 of at most 32 bits");
    *value = (uint32_t)number;
    return 0;
}

/* A limit of a signed type may be written as its bits: 0xFFFF for -1. */
static int eds_limit(struct eds_reader *reader, const char *text, bool *has,
                     int64_t *limit)
{
    static const uint32_t masks[] = {
        [2] = 0xFF, [3] = 0xFFFF, [4] = UINT32_MAX,
        [5] = 0xFF, [6] = 0xFFFF, [7] = UINT32_MAX
    };
    const uint8_t type = reader->object->type;
    uint32_t value = 0;

    if (*text == '\0' || type < 2 || type > 7 || *text == '$')
        return 0;
    const uint32_t mask = masks[type];
    if (eds_number(reader, text, &value) < 0)
        return -1;
    *has = true;
    *limit = value & mask;
    if (type <= 4 && (value & (mask ^ mask >> 1)) != 0)
        *limit -= (int64_t)mask + 1;
    return 0;
}

/* "12", "0x1F", "$NODEID+0x200"; a text is no value for us. */
static int eds_value(struct eds_reader *reader, char *text)
{
    struct eds_object *object = reader->object;

    object->has_value = false;
    if (*text == '\0' || object->type < 2 || object->type > 7)
        return 0;
    if (strncasecmp(text, "$NODEID", 7) == 0) {
        object->adds_node = true;
        text = eds_trim(text + 7);
        if (*text == '+')
            text = eds_trim(text + 1);
        else if (*text == '\0')
            text = (char *)"0";
    }
    object->has_value = true;
    return eds_number(reader, text, &object->value);
}

static int eds_key_of_object(struct eds_reader *reader, const char *key,
                             char *text)
{
    struct eds_object *object = reader->object;
    uint32_t number;

    if (strcasecmp(key, "ParameterName") == 0) {
        snprintf(object->name, sizeof object->name, "%s", text);
    } else if (strcasecmp(key, "AccessType") == 0) {
        object->readable = strncasecmp(text, "wo", 2) != 0;
        object->writable =
            strncasecmp(text, "rw", 2) == 0 || strncasecmp(text, "wo", 2) == 0;
    } else if (strcasecmp(key, "DataType") == 0) {
        if (eds_number(reader, text, &number) < 0)
            return -1;
        object->type = number > 255 ? 0 : (uint8_t)number;
    } else if (strcasecmp(key, "PDOMapping") == 0) {
        object->mappable = strcmp(text, "1") == 0;
    } else if (strcasecmp(key, "LowLimit") == 0) {
        return eds_limit(reader, text, &object->has_low, &object->low);
    } else if (strcasecmp(key, "HighLimit") == 0) {
        return eds_limit(reader, text, &object->has_high, &object->high);
    } else if (strcasecmp(key, "DefaultValue") == 0 ||
               (strcasecmp(key, "ParameterValue") == 0 && *text != '\0')) {
        return eds_value(reader, text);
    }
    return 0;
}

static int eds_key(struct eds_reader *reader, char *line)
{
    char *equals = strchr(line, '=');
    char *key, *text;

    if (equals == NULL)
        return eds_fail(reader, "neither a section nor a key, expected [NAME] "
                                "or KEY=VALUE");
    *equals = '\0';
    key = eds_trim(line);
    text = eds_trim(equals + 1);
    if (reader->object != NULL)
        return eds_key_of_object(reader, key, text);
    if (reader->device && strcasecmp(key, "VendorName") == 0)
        snprintf(reader->eds->vendor, EDS_NAME_MAX, "%s", text);
    else if (reader->device && strcasecmp(key, "ProductName") == 0)
        snprintf(reader->eds->product, EDS_NAME_MAX, "%s", text);
    return 0;
}

static int eds_line(struct eds_reader *reader, char *line)
{
    line = eds_trim(line);
    if (*line == '\0' || *line == ';' || *line == '#')
        return 0;
    return *line == '[' ? eds_section(reader, line + 1) : eds_key(reader, line);
}

static int eds_read(struct eds_reader *reader, struct files_lines *lines)
{
    for (int64_t length; (length = files_lines_next(lines)) >= 0;) {
        reader->line++;
        if (length > EDS_LINE_MAX)
            return eds_fail(reader, "the line is too long, expected at most "
                                    "1022 characters");
        if (strlen(lines->line) != (size_t)length)
            return eds_fail(reader, "a NUL byte, expected text");
        if (eds_line(reader, lines->line) < 0)
            return -1;
    }
    if (lines->error < 0)
        return eds_fail(reader, strerror(-lines->error));
    if (reader->eds->count == 0)
        return eds_fail(reader, "no objects, expected sections such as [1000]");
    return 0;
}

int eds_load(const struct files *files, const char *path, struct eds *eds,
             char message[EDS_MESSAGE_MAX])
{
    struct eds_reader reader = { .path = path, .message = message, .eds = eds };
    struct files_lines lines;
    int err = files_lines_open(&lines, files, path);

    memset(eds, 0, sizeof *eds);
    if (err < 0) {
        snprintf(message, EDS_MESSAGE_MAX, "%s: %s", path, files_error(err));
        return -1;
    }
    err = eds_read(&reader, &lines);
    files_lines_close(&lines);
    return err;
}

const struct eds_object *eds_find(const struct eds *eds, uint16_t index,
                                  uint8_t sub)
{
    const struct eds_object *object = eds_find_section(eds, index, sub, true);

    if (object == NULL && sub == 0)
        object = eds_find_section(eds, index, 0, false);
    return object;
}
