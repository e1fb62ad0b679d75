/* firmware/mcu/board/bytes.c - the library functions that a freestanding
 * compiler calls by itself, by words where both ends stand on one.  Compiled
 * with -fno-tree-loop-distribute-patterns, or they would call themselves. */
#include <stddef.h>
#include <stdint.h>
#include <string.h>

typedef uint32_t __attribute__((may_alias)) bytes_word;

static int bytes_are_words(const void *a, const void *b)
{
    return (((uintptr_t)a | (uintptr_t)b) & 3) == 0;
}

void *memcpy(void *to, const void *from, size_t size)
{
    bytes_word *to_word = to;
    const bytes_word *from_word = from;

    for (; size >= 4 && bytes_are_words(to, from); size -= 4)
        *to_word++ = *from_word++;
    unsigned char *t = (unsigned char *)to_word;
    const unsigned char *f = (const unsigned char *)from_word;
    while (size-- > 0)
        *t++ = *f++;
    return to;
}

void *memset(void *to, int value, size_t size)
{
    bytes_word *to_word = to;

    for (; size >= 4 && bytes_are_words(to, to); size -= 4)
        *to_word++ = (unsigned char)value * UINT32_C(0x01010101);
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
