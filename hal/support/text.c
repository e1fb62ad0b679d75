/* hal/support/text.c - see text.h. */
#include "hal/support/text.h"

void hal_text_init(struct hal_text *text, char *buffer, size_t size)
{
    *text = (struct hal_text){ .at = buffer, .capacity = size - 1 };
    *buffer = '\0';
}

static void hal_text_char(struct hal_text *text, char letter)
{
    if (text->capacity == 0)
        return;
    text->capacity--;
    *text->at++ = letter;
    *text->at = '\0';
}

void hal_text_put(struct hal_text *text, const char *words)
{
    while (*words != '\0' && text->capacity > 0)
        hal_text_char(text, *words++);
}

void hal_text_hex(struct hal_text *text, uint32_t value, unsigned digits)
{
    while (digits > 0) {
        digits--;
        hal_text_char(text, "0123456789ABCDEF"[value >> 4 * digits & 15]);
    }
}

/* One digit by counting: a Cortex-M0 cannot divide. */
static char hal_text_digit(uint32_t *value, uint32_t power)
{
    char digit = '0';

    while (*value >= power) {
        *value -= power;
        digit++;
    }
    return digit;
}

void hal_text_dec(struct hal_text *text, uint32_t value)
{
    static const uint32_t powers[] = {
        1000000000, 100000000, 10000000, 1000000, 100000, 10000, 1000, 100, 10,
    };
    const uint32_t whole = value;

    for (unsigned i = 0; i < sizeof powers / sizeof powers[0]; i++) {
        char digit = hal_text_digit(&value, powers[i]);

        if (whole >= powers[i])
            hal_text_char(text, digit);
    }
    hal_text_char(text, (char)('0' + value));
}
