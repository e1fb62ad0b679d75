/* firmware/host/recording/mcap_bytes.h - bytes being put together for an MCAP
 * file.
 *
 * Grows when it must; whoever may not use the heap reserves first and stays
 * below that. */
#ifndef FIRMWARE_HOST_RECORDING_MCAP_BYTES_H
#define FIRMWARE_HOST_RECORDING_MCAP_BYTES_H

#include <stddef.h>
#include <stdint.h>

#include "firmware/host/recording/mcap.h"

/* All zero: empty. */
struct mcap_bytes {
    unsigned char *byte;
    size_t length, capacity;
};

/* Memory for so many bytes in all. */
void mcap_bytes_reserve(struct mcap_bytes *bytes, size_t capacity);
void mcap_bytes_free(struct mcap_bytes *bytes);

void mcap_bytes_put(struct mcap_bytes *bytes, const void *data, size_t size);
/* The lowest `size` bytes of a number, 1..8. */
void mcap_bytes_number(struct mcap_bytes *bytes, uint64_t value, unsigned size);
void mcap_bytes_text(struct mcap_bytes *bytes, const char *text);

/* A record begins, its length still open: where mcap_bytes_close fills it
 * in. */
size_t mcap_bytes_open(struct mcap_bytes *bytes, enum mcap_opcode opcode);
void mcap_bytes_close(struct mcap_bytes *bytes, size_t open);
/* The same for what is preceded by its length in four bytes. */
size_t mcap_bytes_open_array(struct mcap_bytes *bytes);
void mcap_bytes_close_array(struct mcap_bytes *bytes, size_t open);

#endif
