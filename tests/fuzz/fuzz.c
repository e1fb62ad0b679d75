/* tests/fuzz/fuzz.c - see fuzz.h. */
#define _GNU_SOURCE /* memfd_create */
#include "tests/fuzz/fuzz.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

void fuzz_claim(bool holds, const char *claim)
{
    if (holds)
        return;
    fprintf(stderr, "does not hold: %s\n", claim);
    abort();
}

const char *fuzz_file(const uint8_t *data, size_t size)
{
    static int file = -1;
    static char path[64];

    if (file < 0) {
        file = memfd_create("fuzz", MFD_CLOEXEC);
        snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    }
    fuzz_claim(file >= 0 && ftruncate(file, 0) == 0 &&
                   pwrite(file, data, size, 0) == (ssize_t)size,
               "there is room for a file in memory");
    return path;
}

void fuzz_claim_sentence(const char *path, const char *message)
{
    const size_t length = strlen(message);

    fuzz_claim(length > 0, "an error has a sentence");
    fuzz_claim(strncmp(message, path, strlen(path)) == 0,
               "a sentence begins with the file");
    fuzz_claim(strchr(message, '\n') == NULL, "a sentence is one line");
    for (size_t i = 0; i < length; i++)
        fuzz_claim((unsigned char)message[i] >= ' ' && message[i] != 0x7F,
                   "a sentence has no control characters");
}

uint8_t fuzz_u8(struct fuzz_bytes *bytes)
{
    if (bytes->left == 0)
        return 0;
    bytes->left--;
    return *bytes->at++;
}

uint16_t fuzz_u16(struct fuzz_bytes *bytes)
{
    const uint8_t low = fuzz_u8(bytes);

    return (uint16_t)(low | fuzz_u8(bytes) << 8);
}

size_t fuzz_take(struct fuzz_bytes *bytes, uint8_t *to, size_t capacity)
{
    const size_t count = bytes->left < capacity ? bytes->left : capacity;

    if (count > 0)
        memcpy(to, bytes->at, count);
    bytes->at += count;
    bytes->left -= count;
    return count;
}

struct hal_can_frame fuzz_frame(struct fuzz_bytes *bytes)
{
    const uint16_t id = fuzz_u16(bytes);
    const uint8_t shape = fuzz_u8(bytes);
    struct hal_can_frame frame = { .id = id & 0x7FFu };

    frame.len = (uint8_t)((shape & 0x0F) % (HAL_CAN_DATA_MAX + 1));
    frame.remote = (shape & 0x10) != 0;
    frame.extended = (shape & 0x20) != 0;
    if (frame.extended)
        frame.id |= (uint32_t)(id >> 11) << 11;
    (void)fuzz_take(bytes, frame.data, frame.len);
    return frame;
}
