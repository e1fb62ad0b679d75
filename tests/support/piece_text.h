/* tests/support/piece_text.h - what is wrong with a piece of an upload, in words. */
#ifndef TESTS_SUPPORT_PIECE_TEXT_H
#define TESTS_SUPPORT_PIECE_TEXT_H

#include "hal/mcu/piece.h"

/* Never NULL. */
static inline const char *piece_text(enum mcu_piece_result result)
{
    static const char *const text[] = {
#define PIECE_TEXT(name, value, exception, text) [value] = (text),
        MCU_PIECE_LIST(PIECE_TEXT)
#undef PIECE_TEXT
    };

    return (unsigned)result < sizeof text / sizeof text[0] ? text[result]
                                                           : "unknown";
}

#endif
