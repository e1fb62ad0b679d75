/* firmware/host/exchange/import_text.c - see import_text.h. */
#include "firmware/host/exchange/import_text.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "firmware/host/base/decimal.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/quote.h"
#include "motion/core/err.h"

#define IMPORT_CTRL_Z 0x1A

/* About the file as a whole. */
static int import_text_fail(const struct import_text *text, const char *what)
{
    snprintf(text->report.message, text->report.capacity, "%s: %s",
             text->report.path, what);
    return -1;
}

/* --- loading --- */

static bool import_text_is_plain(unsigned char c)
{
    return c >= ' ' ? c != 0x7F : c == '\t' || c == '\n' || c == '\r';
}

/* Control characters and broken UTF-8 are refused where they are. */
static int import_text_check(struct import_text *text)
{
    const unsigned char *data = (const unsigned char *)text->data;
    struct plan_place place = { 1, 1 };
    uint32_t character;
    for (size_t i = 0; i < text->length;) {
        unsigned n = quote_utf8_decode(data + i, text->length - i, &character);
        if (data[i] == IMPORT_CTRL_Z) {
            text->length = i;
            text->data[i] = 0;
            return 0;
        }
        if (n == 0 || (n == 1 && !import_text_is_plain(data[i])))
            return yaml_report_at(&text->report, place,
                                  "byte 0x%02X is not text, expected a text "
                                  "file",
                                  data[i]);
        place.column++;
        if (data[i] == '\n' || (data[i] == '\r' && data[i + 1] != '\n'))
            place = (struct plan_place){ place.line + 1, 1 };
        i += n;
    }
    return 0;
}

int import_text_load(struct import_text *text, const struct files *files,
                     const char *path, char *message, size_t capacity)
{
    *text = (struct import_text){ .report = { path, message, capacity } };
    const int64_t length =
        files_load_text(files, path, IMPORT_BYTES_MAX, &text->data);
    if (length < 0)
        return import_text_fail(
            text, length == -ENOMEM  ? "is too large for the memory"
                  : length == -EFBIG ? "has more than 64 MiB"
                                     : strerror((int)-length));
    text->length = (size_t)length;
    const int err = import_text_check(text);
    if (err < 0)
        import_text_free(text);
    return err;
}

void import_text_free(struct import_text *text)
{
    free(text->data);
    text->data = NULL;
    text->length = text->next = text->line_end = text->at = 0;
}

/* --- lines and words --- */

#define IMPORT_TELL_EVERY 1024 /* lines: some 10 ms */

/* Go to the next line; false at the end. */
static bool import_text_line(struct import_text *text)
{
    if (text->next >= text->length)
        return false;
    if (text->line++ % IMPORT_TELL_EVERY == 0)
        plan_progress_tell(text->progress, "reading", text->report.path,
                           (int64_t)text->next, (int64_t)text->length);
    text->line_start = text->at = text->next;
    text->line_end =
        text->line_start + strcspn(text->data + text->next, "\r\n");
    text->next = text->line_end;
    if (text->data[text->next] == '\r')
        text->next++;
    if (text->data[text->next] == '\n')
        text->next++;
    return true;
}

bool import_text_filled(struct import_text *text, char comment)
{
    while (import_text_line(text)) {
        size_t at = text->at + strspn(text->data + text->at, " \t");
        if (at < text->line_end && (comment == 0 || text->data[at] != comment))
            return true;
    }
    return false;
}

static bool import_text_is_blank(const struct import_text *text, size_t at,
                                 const char *separators)
{
    char c = text->data[at];
    return c == ' ' || c == '\t' || (c != 0 && strchr(separators, c) != NULL);
}

struct plan_place import_text_place(const struct import_text *text)
{
    uint32_t column = 1;
    for (size_t i = text->line_start; i < text->at; i++)
        column += (text->data[i] & 0xC0) != 0x80;
    return (struct plan_place){ text->line > 0 ? text->line : 1, column };
}

static int import_text_copy(const struct import_text *text, size_t length,
                            struct import_word *word)
{
    word->place = import_text_place(text);
    if (length >= sizeof word->text) {
        char quote[QUOTE_MAX];
        return yaml_report_at(
            &text->report, word->place,
            "%s has more than %d characters, expected a name or a number",
            quote_text(quote, text->data + text->at, length),
            IMPORT_WORD_MAX - 1);
    }
    memcpy(word->text, text->data + text->at, length);
    word->text[length] = 0;
    return 1;
}

int import_text_word(struct import_text *text, const char *separators,
                     struct import_word *word)
{
    while (text->at < text->line_end &&
           import_text_is_blank(text, text->at, separators))
        text->at++;
    size_t end = text->at;
    while (end < text->line_end && !import_text_is_blank(text, end, separators))
        end++;
    if (end == text->at)
        return 0;
    int err = import_text_copy(text, end - text->at, word);
    text->at = end;
    return err;
}

/* To what is no blank, no comment and no end of a line. */
static bool import_text_to_token(struct import_text *text)
{
    for (;;) {
        const char *at = text->data + text->at;
        while (text->at < text->line_end &&
               import_text_is_blank(text, text->at, ""))
            at = text->data + ++text->at;
        if (text->at < text->line_end && *at != '#' &&
            strncmp(at, "//", 2) != 0)
            return true;
        if (!import_text_line(text))
            return false;
    }
}

int import_text_token(struct import_text *text, const char *marks,
                      struct import_word *word)
{
    if (!import_text_to_token(text))
        return 0;
    size_t end = text->at + 1;
    if (strchr(marks, text->data[text->at]) == NULL)
        while (end < text->line_end && !import_text_is_blank(text, end, marks))
            end++;
    const int err = import_text_copy(text, end - text->at, word);
    text->at = end;
    return err;
}

bool import_text_skip(struct import_text *text, char mark)
{
    do {
        while (text->at < text->line_end)
            if (text->data[text->at++] == mark)
                return true;
    } while (import_text_line(text));
    return false;
}

/* Past the opening quote.  "" is a quote. */
static int import_text_quoted(struct import_text *text, char separator,
                              struct import_word *word)
{
    size_t length = 0;

    word->place = import_text_place(text);
    for (text->at++; text->at < text->line_end; text->at++) {
        const bool is_quote = text->data[text->at] == '"';
        if (is_quote && text->data[text->at + 1] != '"')
            break;
        text->at += is_quote;
        if (length + 1 == sizeof word->text)
            return yaml_report_at(&text->report, word->place,
                                  "the cell has more than %d characters, "
                                  "expected a name or a number",
                                  IMPORT_WORD_MAX - 1);
        word->text[length++] = text->data[text->at];
    }
    word->text[length] = 0;
    if (text->at >= text->line_end)
        return yaml_report_at(
            &text->report, word->place,
            "the quote is not closed in its line, expected \" "
            "at the end of the cell");
    for (text->at++; text->at < text->line_end &&
                     import_text_is_blank(text, text->at, "") &&
                     text->data[text->at] != separator;)
        text->at++;
    if (text->at < text->line_end && text->data[text->at] != separator)
        return yaml_report_at(&text->report, import_text_place(text),
                              "there is something behind the quotes of the "
                              "cell");
    text->at++;
    return 1;
}

int import_text_cell(struct import_text *text, char separator,
                     struct import_word *word)
{
    if (text->at > text->line_end)
        return 0;
    while (text->at < text->line_end && text->data[text->at] != separator &&
           import_text_is_blank(text, text->at, ""))
        text->at++;
    if (text->at < text->line_end && text->data[text->at] == '"')
        return import_text_quoted(text, separator, word);
    size_t end = text->at;
    while (end < text->line_end && text->data[end] != separator)
        end++;
    size_t last = end;
    while (last > text->at && import_text_is_blank(text, last - 1, ""))
        last--;
    int err = import_text_copy(text, last - text->at, word);
    text->at = end + 1; /* beyond the line's end: no cell is left */
    return err;
}

/* --- numbers --- */

/* Digits beyond the 18 that units_parse takes, which other programs write,
 * are cut: at most 10^-17 of the number. */
static void import_text_shorten(char out[IMPORT_WORD_MAX], const char *text)
{
    unsigned digits = 0, n = 0;
    bool point = false;
    for (; *text != 0 && *text != 'e' && *text != 'E'; text++) {
        bool digit = *text >= '0' && *text <= '9';
        point |= *text == '.';
        digits += digit && (digits > 0 || *text != '0');
        if (!digit || digits <= 18 || !point)
            out[n++] = *text;
    }
    snprintf(out + n, IMPORT_WORD_MAX - n, "%s", text);
}

/* "0,5": digits on both sides of the one comma there is. */
static bool import_text_is_comma(const char *text)
{
    const char *comma = strchr(text, ',');

    return comma != NULL && comma > text && strchr(comma + 1, ',') == NULL &&
           strchr(text, '.') == NULL && decimal_is_digit(comma[-1]) &&
           decimal_is_digit(comma[1]);
}

static bool import_text_is_number(const char *text)
{
    return text[0] != 0 && strspn(text, "+-.0123456789eE") == strlen(text) &&
           strpbrk(text, "0123456789") != NULL;
}

int import_text_number(const struct import_text *text,
                       const struct import_word *word, const char *before,
                       const char *after, enum units_quantity quantity,
                       const struct units_context *context, int64_t *value)
{
    char sentence[UNITS_SENTENCE_MAX], number[IMPORT_WORD_MAX];
    char shorter[IMPORT_WORD_MAX], whole[2 * IMPORT_WORD_MAX];
    const bool is_comma = import_text_is_comma(word->text);
    const char *end;
    memcpy(number, word->text, sizeof number);
    if (text->has_comma && is_comma)
        number[strcspn(number, ",")] = '.';
    if (!import_text_is_number(number) ||
        (text->has_comma && strchr(word->text, '.') != NULL)) {
        char quote[QUOTE_MAX];
        return yaml_report_at(
            &text->report, word->place, "%s is not a number, expected one%s",
            quote_text(quote, word->text, strlen(word->text)),
            text->has_comma ? " with a decimal comma"
            : is_comma      ? "; --decimal comma reads 0,5 as a half"
                            : "");
    }
    /* as it is, with all the digits it has */
    if (before[0] == 0 && after[0] == 0 &&
        number_parse(number, 32, value, &end) == MOTION_OK && *end == 0)
        return 0;
    import_text_shorten(shorter, number);
    snprintf(whole, sizeof whole, "%s%s%s", before, shorter, after);
    if (units_parse(whole, quantity, context, value, sentence) < 0)
        return yaml_report_at(&text->report, word->place, "%s", sentence);
    return 0;
}

bool import_text_same(const char *a, const char *b)
{
    return strcasecmp(a, b) == 0;
}
