/* firmware/host/base/quote.c - see quote.h. */
#include "firmware/host/base/quote.h"

#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"

/* Characters that are shown before a text is cut. */
#define QUOTE_SHOWN_MAX 40

/* Invisible or line-breaking: C0, DEL and C1, soft hyphen, zero-width and
 * direction marks, separators, byte order mark, non-characters; ascending. */
static const struct {
    uint32_t first, last;
} quote_unprintable[] = {
    { 0x0, 0x1F },         { 0x7F, 0x9F },     { 0xAD, 0xAD },
    { 0x200B, 0x200F },    { 0x2028, 0x202E }, { 0x2060, 0x206F },
    { 0xD800, 0xF8FF },    { 0xFEFF, 0xFEFF }, { 0xFFF0, 0xFFFF },
    { 0xE0000, 0x10FFFF },
};

bool quote_is_printable(uint32_t character)
{
    for (size_t i = 0; i < ARRAY_LEN(quote_unprintable); i++)
        if (character <= quote_unprintable[i].last)
            return character < quote_unprintable[i].first;
    return true;
}

/* Bytes of the character that starts with `lead`, 0 when none does. */
static unsigned quote_utf8_length(unsigned char lead)
{
    if (lead < 0x80)
        return 1;
    if (lead >= 0xC2 && lead <= 0xDF)
        return 2;
    if (lead >= 0xE0 && lead <= 0xEF)
        return 3;
    return lead >= 0xF0 && lead <= 0xF4 ? 4 : 0;
}

unsigned quote_utf8_decode(const unsigned char *text, size_t length,
                           uint32_t *character)
{
    static const uint32_t smallest[] = { 0, 0, 0x80, 0x800, 0x10000 };
    static const uint8_t lead_bits[] = { 0, 0x7F, 0x1F, 0x0F, 0x07 };
    const unsigned bytes = length > 0 ? quote_utf8_length(text[0]) : 0;

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
static unsigned quote_put_character(char *out, size_t capacity, size_t *used,
                                    const char *text, size_t length)
{
    uint32_t character;
    const unsigned char *bytes = (const unsigned char *)text;
    const unsigned count = quote_utf8_decode(bytes, length, &character);

    if (count > 0 && quote_is_printable(character)) {
        if (*used + count >= capacity)
            return 0;
        memcpy(out + *used, text, count);
        *used += count;
        return count;
    }
    if (*used + 4 >= capacity)
        return 0;
    *used +=
        (size_t)snprintf(out + *used, capacity - *used, "\\x%02x", bytes[0]);
    return 1;
}

size_t quote_escape(char *out, size_t capacity, const char *text, size_t length)
{
    size_t used = 0, done = 0;
    while (done < length) {
        const unsigned count = quote_put_character(out, capacity, &used,
                                                   text + done, length - done);
        if (count == 0)
            break;
        done += count;
    }
    out[used] = 0;
    return done;
}

const char *quote_text(char quote[QUOTE_MAX], const char *text, size_t length)
{
    char inner[QUOTE_SHOWN_MAX + 1];
    const size_t shown = quote_escape(inner, sizeof(inner), text, length);

    snprintf(quote, QUOTE_MAX, "'%s%s'", inner, shown < length ? "..." : "");
    return quote;
}

const char *quote_list(char list[QUOTE_LIST_MAX], const char *const spelling[],
                       unsigned count)
{
    size_t used = 0;

    list[0] = 0;
    for (unsigned i = 0; i < count; i++) {
        const char *joint = i == 0 ? "" : i + 1 < count ? ", " : " or ";
        /* room for this one, its joint, and an ending if it is the last */
        if (used + strlen(spelling[i]) + sizeof(" or ...") >= QUOTE_LIST_MAX) {
            snprintf(list + used, QUOTE_LIST_MAX - used, " ...");
            break;
        }
        used += (size_t)snprintf(list + used, QUOTE_LIST_MAX - used, "%s%s",
                                 joint, spelling[i]);
    }
    return list;
}
