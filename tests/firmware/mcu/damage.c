/* tests/firmware/mcu/damage.c - see damage.h. */
#include "tests/firmware/mcu/damage.h"

#include <string.h>

static unsigned damage_swap(uint8_t *frame, unsigned length, unsigned at)
{
    const uint8_t byte = frame[at];

    if (at + 1 == length || frame[at + 1] == byte)
        return 0;
    frame[at] = frame[at + 1];
    frame[at + 1] = byte;
    return length;
}

unsigned damage_frame(uint8_t frame[DAMAGE_MAX], unsigned length, unsigned kind,
                      unsigned at)
{
    const unsigned rest = length - at;

    switch (kind) {
    case DAMAGE_INVERT:
        frame[at] ^= 0xFF;
        return length;
    case DAMAGE_BURST:
        for (unsigned i = at; i < length && i < at + 4; i++)
            frame[i] ^= 0xFF;
        return length;
    case DAMAGE_LOSE:
        memmove(frame + at, frame + at + 1, rest - 1);
        return length - 1;
    case DAMAGE_DOUBLE:
        memmove(frame + at + 1, frame + at, rest);
        return length + 1;
    case DAMAGE_SWAP:
        return damage_swap(frame, length, at);
    case DAMAGE_CUT_END:
        return at;
    case DAMAGE_CUT_BEGIN:
        memmove(frame, frame + at + 1, rest - 1);
        return rest - 1;
    case DAMAGE_TAIL_TWICE:
        memcpy(frame + length, frame + at, rest);
        return length + rest;
    case DAMAGE_OVERTAKEN:
        memmove(frame + at, frame, length);
        return at == 0 ? 0 : at + length;
    default:
        frame[at] ^= (uint8_t)(1u << kind % DAMAGE_BITS);
        return length;
    }
}
