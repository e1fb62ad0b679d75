/* firmware/host/recording/mcap_bytes.c - see mcap_bytes.h. */
#include "firmware/host/recording/mcap_bytes.h"

#include <string.h>

#include "firmware/host/base/memory.h"

void mcap_bytes_reserve(struct mcap_bytes *bytes, size_t capacity)
{
    if (capacity <= bytes->capacity)
        return;
    bytes->byte = memory_resize(bytes->byte, capacity, 1);
    bytes->capacity = capacity;
}

void mcap_bytes_free(struct mcap_bytes *bytes)
{
    memory_free(bytes->byte);
    *bytes = (struct mcap_bytes){ .byte = NULL };
}

void mcap_bytes_put(struct mcap_bytes *bytes, const void *data, size_t size)
{
    if (bytes->capacity - bytes->length < size)
        mcap_bytes_reserve(bytes, 2 * (bytes->length + size));
    if (size > 0)
        memcpy(bytes->byte + bytes->length, data, size);
    bytes->length += size;
}

static void mcap_bytes_encode(unsigned char *to, uint64_t value, unsigned size)
{
    for (unsigned i = 0; i < size; i++)
        to[i] = (unsigned char)(value >> (8 * i));
}

void mcap_bytes_number(struct mcap_bytes *bytes, uint64_t value, unsigned size)
{
    unsigned char encoded[8];
    mcap_bytes_encode(encoded, value, size);
    mcap_bytes_put(bytes, encoded, size);
}

void mcap_bytes_text(struct mcap_bytes *bytes, const char *text)
{
    const size_t length = strlen(text);
    mcap_bytes_number(bytes, length, 4);
    mcap_bytes_put(bytes, text, length);
}

static void mcap_bytes_fill_in(struct mcap_bytes *bytes, size_t open,
                               unsigned size)
{
    mcap_bytes_encode(bytes->byte + open - size, bytes->length - open, size);
}

size_t mcap_bytes_open(struct mcap_bytes *bytes, enum mcap_opcode opcode)
{
    mcap_bytes_number(bytes, opcode, 1);
    mcap_bytes_number(bytes, 0, 8);
    return bytes->length;
}

void mcap_bytes_close(struct mcap_bytes *bytes, size_t open)
{
    mcap_bytes_fill_in(bytes, open, 8);
}

size_t mcap_bytes_open_array(struct mcap_bytes *bytes)
{
    mcap_bytes_number(bytes, 0, 4);
    return bytes->length;
}

void mcap_bytes_close_array(struct mcap_bytes *bytes, size_t open)
{
    mcap_bytes_fill_in(bytes, open, 4);
}
