/* firmware/host/recording/mcap_writer.h - an MCAP file, appended to and never
 * gone back in, so that a pipe will do.
 *
 * Messages are gathered in a chunk, which is handed over whole, with its CRC-32
 * and the index of its messages; whatever cuts the file, all chunks before the
 * cut are there.  Schemas, channels, attachments and metadata are records of
 * their own.  The summary comes at a clean end.
 *
 * Messages and chunks use no heap. */
#ifndef FIRMWARE_HOST_RECORDING_MCAP_WRITER_H
#define FIRMWARE_HOST_RECORDING_MCAP_WRITER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/recording/mcap_bytes.h"

#define MCAP_WRITER_CHANNELS 128
#define MCAP_CHUNK_BYTES     (1 << 20)
#define MCAP_CHUNK_MESSAGES  (1 << 14)
#define MCAP_MESSAGE_HEAD    (MCAP_HEAD_BYTES + 22) /* before its data */
/* Of all chunks; later ones are not in the index, and then no index is written:
 * a reader goes through the file instead. */
#define MCAP_INDEX_BYTES (1 << 24)

struct mcap_writer_entry {
    uint64_t t_ns, offset;
    uint32_t next; /* of the same channel, from 1; 0: none */
};

struct mcap_writer_channel {
    uint64_t count;       /* messages in all */
    uint32_t first, last; /* entries of this chunk, from 1; 0: none */
};

struct mcap_writer {
    FILE *file;
    bool failed; /* something could not be handed over */
    uint64_t offset;
    struct memory_pool memory;
    struct mcap_bytes chunk, piece;      /* messages; records being made */
    struct mcap_bytes schemas, channels; /* again in the summary, as the */
    struct mcap_bytes index, attachments, metadata; /* indexes are */
    bool index_full;
    uint16_t schema_count, channel_count;
    uint32_t attachment_count, metadata_count, chunk_count;
    uint64_t message_count;
    uint64_t first_ns, last_ns;             /* of all messages */
    uint64_t chunk_first_ns, chunk_last_ns; /* of this chunk's */
    struct mcap_writer_channel channel[MCAP_WRITER_CHANNELS];
    struct mcap_writer_entry *entry;
    uint32_t entries;
};

/* Writes the header.  All zero before; mcap_writer_free in the end. */
void mcap_writer_begin(struct mcap_writer *writer, FILE *file,
                       const char *library);
void mcap_writer_free(struct mcap_writer *writer);

/* A schema of encoding "jsonschema"; its number, from 1. */
uint16_t mcap_writer_schema(struct mcap_writer *writer, const char *name,
                            const char *text);
/* A channel of JSON messages; its number, from 0, at most
 * MCAP_WRITER_CHANNELS of them. */
uint16_t mcap_writer_channel(struct mcap_writer *writer, uint16_t schema,
                             const char *topic);
void mcap_writer_attach(struct mcap_writer *writer, uint64_t t_ns,
                        const char *name, const char *media_type,
                        const void *data, size_t size);
/* `count` pairs of a key and a value. */
void mcap_writer_metadata(struct mcap_writer *writer, const char *name,
                          const char *const pair[][2], size_t count);

/* Do so many messages, with so many bytes of data in all, still fit in the
 * chunk? */
bool mcap_writer_fits(const struct mcap_writer *writer, size_t messages,
                      size_t bytes);
/* Into the chunk, which it must fit. */
void mcap_writer_message(struct mcap_writer *writer, uint16_t channel,
                         uint32_t sequence, uint64_t t_ns, const char *data,
                         size_t length);
/* Hand the chunk over, if there is one.  False: this one or something before it
 * could not be. */
bool mcap_writer_chunk(struct mcap_writer *writer);
/* The last chunk, the summary and the footer. */
bool mcap_writer_end(struct mcap_writer *writer);

#endif
