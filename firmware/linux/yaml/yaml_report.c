/* firmware/linux/yaml/yaml_report.c - see yaml_report.h. */
#include "firmware/linux/yaml/yaml_report.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Characters of a path or a quotation that are shown before it is cut. */
#define REPORT_PATH_MAX     120
#define REPORT_QUOTED_MAX   40
#define REPORT_SENTENCE_MAX 512

#define ARRAY_LEN(a) (sizeof(a) / sizeof(a)[0])

/* Invisible or line-breaking: C0, DEL and C1, soft hyphen, zero-width and
 * direction marks, separators, byte order mark, non-characters. */
static const struct {
    uint32_t first, last;
} report_unprintable[] = {
    { 0x0, 0x1F },         { 0x7F, 0x9F },     { 0xAD, 0xAD },
    { 0x200B, 0x200F },    { 0x2028, 0x202E }, { 0x2060, 0x206F },
    { 0xD800, 0xF8FF },    { 0xFEFF, 0xFEFF }, { 0xFFF0, 0xFFFF },
    { 0xE0000, 0x10FFFF },
};

bool yaml_is_printable(uint32_t character)
{
    for (size_t i = 0; i < ARRAY_LEN(report_unprintable); i++)
        if (character >= report_unprintable[i].first &&
            character <= report_unprintable[i].last)
            return false;
    return true;
}

/* Bytes of the character that starts with `lead`, 0 when none does. */
static unsigned report_utf8_length(unsigned char lead)
{
    if (lead < 0x80)
        return 1;
    if (lead >= 0xC2 && lead <= 0xDF)
        return 2;
    if (lead >= 0xE0 && lead <= 0xEF)
        return 3;
    return lead >= 0xF0 && lead <= 0xF4 ? 4 : 0;
}

unsigned yaml_utf8_decode(const unsigned char *text, size_t length,
                          uint32_t *character)
{
    static const uint32_t smallest[] = { 0, 0, 0x80, 0x800, 0x10000 };
    static const uint8_t lead_bits[] = { 0, 0x7F, 0x1F, 0x0F, 0x07 };
    const unsigned bytes = length > 0 ? report_utf8_length(text[0]) : 0;

    if (bytes == 0 || bytes > length)
        return 0;
    *character = text[0] & lead_bits[bytes];
    for (unsigned i = 1; i < bytes; i++) {
        if ((text[i] & 0xC0) != 0x80)
            return 0;
        *character = *character << 6 | (text[i] & 0x3Fu);
    }
    if (*character < smallest[bytes] || *character > 0x10FFFF ||
        (*character >= 0xD800 && *character <= 0xDFFF))
        return 0;
    return bytes;
}

/* Copy one character, or its bytes as \xNN, if there is room for it and the 0.
 * Returns the bytes of `text` used, 0 when there was no room. */
static unsigned report_put_character(char *out, size_t room, size_t *used,
                                     const char *text, size_t length)
{
    uint32_t character;
    const unsigned char *bytes = (const unsigned char *)text;
    const unsigned count = yaml_utf8_decode(bytes, length, &character);

    if (count > 0 && yaml_is_printable(character)) {
        if (*used + count >= room)
            return 0;
        memcpy(out + *used, text, count);
        *used += count;
        return count;
    }
    if (*used + 4 >= room)
        return 0;
    *used += (size_t)snprintf(out + *used, room - *used, "\\x%02x", bytes[0]);
    return 1;
}

/* As much of `text` as fits, escaped, terminated.  Returns bytes of text used.
 */
static size_t report_put_escaped(char *out, size_t room, const char *text,
                                 size_t length)
{
    size_t used = 0, done = 0;
    while (done < length) {
        const unsigned count =
            report_put_character(out, room, &used, text + done, length - done);
        if (count == 0)
            break;
        done += count;
    }
    out[used] = 0;
    return done;
}

const char *yaml_quote(char quote[YAML_QUOTE_MAX], const char *text,
                       size_t length)
{
    char inner[REPORT_QUOTED_MAX + 1];
    const size_t shown = report_put_escaped(inner, sizeof(inner), text, length);

    snprintf(quote, YAML_QUOTE_MAX, "'%s%s'", inner,
             shown < length ? "..." : "");
    return quote;
}

const char *yaml_list(char list[YAML_LIST_MAX], const char *const spelling[],
                      unsigned count)
{
    size_t used = 0;

    list[0] = 0;
    for (unsigned i = 0; i < count; i++) {
        const char *joint = i == 0 ? "" : i + 1 < count ? ", " : " or ";
        /* room for this one, its joint, and an ending if it is the last */
        if (used + strlen(spelling[i]) + sizeof(" or ...") >= YAML_LIST_MAX) {
            snprintf(list + used, YAML_LIST_MAX - used, " ...");
            break;
        }
        used += (size_t)snprintf(list + used, YAML_LIST_MAX - used, "%s%s",
                                 joint, spelling[i]);
    }
    return list;
}

int yaml_report_at(const struct yaml_report *report, struct plan_place place,
                   const char *format, ...)
{
    /* the end of a long path says more than its start */
    const size_t length = strlen(report->path);
    const size_t skip = length > REPORT_PATH_MAX ? length - REPORT_PATH_MAX : 0;
    char path[REPORT_PATH_MAX + 1], sentence[REPORT_SENTENCE_MAX];
    va_list arguments;

    report_put_escaped(path, sizeof(path), report->path + skip, length - skip);
    va_start(arguments, format);
    vsnprintf(sentence, sizeof(sentence), format, arguments);
    va_end(arguments);
    snprintf(report->message, report->room, "%s%s:%lu:%lu: %s",
             skip > 0 ? "..." : "", path, (unsigned long)place.line,
             (unsigned long)place.column, sentence);
    return -1;
}
