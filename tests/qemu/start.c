/* tests/qemu/start.c - the part of start-up that all processors share, and the
 * two library functions a freestanding compiler may call.
 * Source: Arm, Semihosting for AArch32 and AArch64, 5 (SYS_WRITE0,
 * SYS_EXIT_EXTENDED). */
#include "tests/qemu/start.h"

#include <stddef.h>

#define SYS_WRITE0                   0x04
#define SYS_EXIT_EXTENDED            0x20
#define ADP_STOPPED_APPLICATION_EXIT 0x20026

void *memcpy(void *to, const void *from, size_t size);
void *memset(void *to, int value, size_t size);
int memcmp(const void *left, const void *right, size_t size);

void start_print(const char *text)
{
    start_host_call(SYS_WRITE0, text);
}

void start_print_u32(uint32_t value)
{
    char text[11];
    char *digit = text + sizeof(text) - 1;

    *digit = '\0';
    do {
        *--digit = (char)('0' + value % 10);
        value /= 10;
    } while (value != 0);
    start_print(digit);
}

void start_print_hex(uint32_t value)
{
    char text[9];

    for (int i = 0; i < 8; i++)
        text[i] = "0123456789abcdef"[value >> (28 - 4 * i) & 15];
    text[8] = '\0';
    start_print(text);
}

_Noreturn void start_exit(uint32_t status)
{
    const unsigned long block[2] = { ADP_STOPPED_APPLICATION_EXIT, status };

    start_host_call(SYS_EXIT_EXTENDED, block);
    for (;;) {
    }
}

/* By words as far as both ends stand on one, as any C library does: planners
 * move structs, and their instructions are counted.  Compiled with
 * -fno-tree-loop-distribute-patterns, or these would be turned into calls of
 * themselves. */
typedef uint32_t __attribute__((may_alias)) start_word;

void *memcpy(void *to, const void *from, size_t size)
{
    start_word *to_word = to;
    const start_word *from_word = from;

    if ((((uintptr_t)to | (uintptr_t)from) & 3) == 0) {
        for (; size >= 16; size -= 16) {
            *to_word++ = *from_word++;
            *to_word++ = *from_word++;
            *to_word++ = *from_word++;
            *to_word++ = *from_word++;
        }
        for (; size >= 4; size -= 4)
            *to_word++ = *from_word++;
    }
    unsigned char *t = (unsigned char *)to_word;
    const unsigned char *f = (const unsigned char *)from_word;
    while (size-- > 0)
        *t++ = *f++;
    return to;
}

void *memset(void *to, int value, size_t size)
{
    const start_word four = (unsigned char)value * UINT32_C(0x01010101);
    start_word *to_word = to;

    if (((uintptr_t)to & 3) == 0) {
        for (; size >= 16; size -= 16) {
            *to_word++ = four;
            *to_word++ = four;
            *to_word++ = four;
            *to_word++ = four;
        }
        for (; size >= 4; size -= 4)
            *to_word++ = four;
    }
    unsigned char *t = (unsigned char *)to_word;
    while (size-- > 0)
        *t++ = (unsigned char)value;
    return to;
}

int memcmp(const void *left, const void *right, size_t size)
{
    const unsigned char *l = left, *r = right;

    for (; size > 0; size--, l++, r++)
        if (*l != *r)
            return *l - *r;
    return 0;
}
