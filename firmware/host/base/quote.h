/* firmware/host/base/quote.h - what stands in a file, inside a sentence.
 *
 * Bounded and printable whatever the bytes are. */
#ifndef FIRMWARE_HOST_BASE_QUOTE_H
#define FIRMWARE_HOST_BASE_QUOTE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Longest quotation with its quotes and 0. */
#define QUOTE_MAX 64

/* `text` in single quotes, cut after some 40 characters, what is not printable
 * as \x07.  Returns `quote`. */
const char *quote_text(char quote[QUOTE_MAX], const char *text, size_t length);

/* As much of `text` as fits, escaped likewise, terminated.  Returns the bytes
 * of text used. */
size_t quote_escape(char *out, size_t capacity, const char *text,
                    size_t length);

/* "a, b or c"; what does not fit is "...".  Returns `list`. */
#define QUOTE_LIST_MAX 360
const char *quote_list(char list[QUOTE_LIST_MAX], const char *const spelling[],
                       unsigned count);

/* Decode one character.  Returns its length, 1..4, or 0 when the bytes are not
 * UTF-8 (overlong forms, surrogates and beyond 0x10FFFF included). */
unsigned quote_utf8_decode(const unsigned char *text, size_t length,
                           uint32_t *character);

/* Neither a control, nor a line separator, nor one of the invisible characters
 * that reorder or hide text. */
bool quote_is_printable(uint32_t character);

#endif
