/* hal/support/text.h - put a short sentence together without libc.
 *
 * Writes into the caller's buffer, always ends it with a 0 and cuts what does
 * not fit.  Bounded, no division: may be used where a tick finds a fault. */
#ifndef HAL_SUPPORT_TEXT_H
#define HAL_SUPPORT_TEXT_H

#include <stddef.h>
#include <stdint.h>

struct hal_text {
    char *at;        /* where the ending 0 stands */
    size_t capacity; /* characters that still fit before it */
};

/* size >= 1; the text is empty. */
void hal_text_init(struct hal_text *text, char *buffer, size_t size);
void hal_text_put(struct hal_text *text, const char *words);
/* The lower `digits` (1..8) hexadecimal digits, capital letters, no prefix. */
void hal_text_hex(struct hal_text *text, uint32_t value, unsigned digits);
void hal_text_dec(struct hal_text *text, uint32_t value);

#endif
