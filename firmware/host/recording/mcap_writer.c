/* firmware/host/recording/mcap_writer.c - see mcap_writer.h. */
#include "firmware/host/recording/mcap_writer.h"

#include <string.h>

#include "hal/support/crc32.h"

/* Bytes of a message in the index of its chunk. */
#define MCAP_ENTRY_BYTES 16

/* After an error nothing follows: a record after a part of one would not be
 * found. */
static void mcap_writer_put(struct mcap_writer *writer,
                            const struct mcap_bytes *bytes)
{
    if (writer->failed || bytes->length == 0)
        return;
    writer->failed =
        fwrite(bytes->byte, 1, bytes->length, writer->file) != bytes->length;
    writer->offset += bytes->length;
}

static bool mcap_writer_flush(struct mcap_writer *writer)
{
    if (!writer->failed)
        writer->failed = fflush(writer->file) != 0;
    return !writer->failed;
}

/* What was made in `piece`, as a record of its own. */
static void mcap_writer_piece(struct mcap_writer *writer)
{
    mcap_writer_put(writer, &writer->piece);
    writer->piece.length = 0;
}

void mcap_writer_begin(struct mcap_writer *writer, FILE *file,
                       const char *library)
{
    struct mcap_bytes *piece = &writer->piece;
    *writer = (struct mcap_writer){ .file = file };
    mcap_bytes_reserve(&writer->chunk, MCAP_CHUNK_BYTES);
    mcap_bytes_reserve(&writer->index, MCAP_INDEX_BYTES);
    /* with the head of a chunk, and that of each channel's index */
    mcap_bytes_reserve(piece, MCAP_CHUNK_MESSAGES * MCAP_ENTRY_BYTES +
                                  (MCAP_WRITER_CHANNELS + 4) * 32);
    writer->entry = memory_pool_new(&writer->memory, MCAP_CHUNK_MESSAGES,
                                    sizeof *writer->entry);
    mcap_bytes_put(piece, MCAP_MAGIC, MCAP_MAGIC_BYTES);
    const size_t open = mcap_bytes_open(piece, MCAP_HEADER);
    mcap_bytes_text(piece, ""); /* profile: none of the well-known */
    mcap_bytes_text(piece, library);
    mcap_bytes_close(piece, open);
    mcap_writer_piece(writer);
}

void mcap_writer_free(struct mcap_writer *writer)
{
    memory_pool_free(&writer->memory);
    mcap_bytes_free(&writer->chunk);
    mcap_bytes_free(&writer->piece);
    mcap_bytes_free(&writer->schemas);
    mcap_bytes_free(&writer->channels);
    mcap_bytes_free(&writer->index);
    mcap_bytes_free(&writer->attachments);
    mcap_bytes_free(&writer->metadata);
}

/* --- records outside of chunks --- */

/* Now, and in the summary. */
static void mcap_writer_twice(struct mcap_writer *writer,
                              struct mcap_bytes *again)
{
    mcap_bytes_put(again, writer->piece.byte, writer->piece.length);
    mcap_writer_piece(writer);
}

uint16_t mcap_writer_schema(struct mcap_writer *writer, const char *name,
                            const char *text)
{
    struct mcap_bytes *piece = &writer->piece;
    const size_t open = mcap_bytes_open(piece, MCAP_SCHEMA);
    mcap_bytes_number(piece, ++writer->schema_count, 2);
    mcap_bytes_text(piece, name);
    mcap_bytes_text(piece, "jsonschema");
    mcap_bytes_text(piece, text);
    mcap_bytes_close(piece, open);
    mcap_writer_twice(writer, &writer->schemas);
    return writer->schema_count;
}

uint16_t mcap_writer_channel(struct mcap_writer *writer, uint16_t schema,
                             const char *topic)
{
    struct mcap_bytes *piece = &writer->piece;
    const size_t open = mcap_bytes_open(piece, MCAP_CHANNEL);
    mcap_bytes_number(piece, writer->channel_count, 2);
    mcap_bytes_number(piece, schema, 2);
    mcap_bytes_text(piece, topic);
    mcap_bytes_text(piece, "json");
    mcap_bytes_number(piece, 0, 4); /* no metadata */
    mcap_bytes_close(piece, open);
    mcap_writer_twice(writer, &writer->channels);
    return writer->channel_count++;
}

void mcap_writer_attach(struct mcap_writer *writer, uint64_t t_ns,
                        const char *name, const char *media_type,
                        const void *data, size_t size)
{
    struct mcap_bytes *piece = &writer->piece, *index = &writer->attachments;
    const uint64_t offset = writer->offset;
    const size_t open = mcap_bytes_open(piece, MCAP_ATTACHMENT);
    mcap_bytes_number(piece, t_ns, 8);
    mcap_bytes_number(piece, t_ns, 8);
    mcap_bytes_text(piece, name);
    mcap_bytes_text(piece, media_type);
    mcap_bytes_number(piece, size, 8);
    mcap_bytes_put(piece, data, size);
    mcap_bytes_number(piece,
                      crc32_of(0, piece->byte + open, piece->length - open), 4);
    mcap_bytes_close(piece, open);
    mcap_writer_piece(writer);
    writer->attachment_count++;
    const size_t indexed = mcap_bytes_open(index, MCAP_ATTACHMENT_INDEX);
    mcap_bytes_number(index, offset, 8);
    mcap_bytes_number(index, writer->offset - offset, 8);
    mcap_bytes_number(index, t_ns, 8);
    mcap_bytes_number(index, t_ns, 8);
    mcap_bytes_number(index, size, 8);
    mcap_bytes_text(index, name);
    mcap_bytes_text(index, media_type);
    mcap_bytes_close(index, indexed);
}

void mcap_writer_metadata(struct mcap_writer *writer, const char *name,
                          const char *const pair[][2], size_t count)
{
    struct mcap_bytes *piece = &writer->piece, *index = &writer->metadata;
    const uint64_t offset = writer->offset;
    const size_t open = mcap_bytes_open(piece, MCAP_METADATA);
    mcap_bytes_text(piece, name);
    const size_t map = mcap_bytes_open_array(piece);
    for (size_t i = 0; i < count; i++) {
        mcap_bytes_text(piece, pair[i][0]);
        mcap_bytes_text(piece, pair[i][1]);
    }
    mcap_bytes_close_array(piece, map);
    mcap_bytes_close(piece, open);
    mcap_writer_piece(writer);
    writer->metadata_count++;
    const size_t indexed = mcap_bytes_open(index, MCAP_METADATA_INDEX);
    mcap_bytes_number(index, offset, 8);
    mcap_bytes_number(index, writer->offset - offset, 8);
    mcap_bytes_text(index, name);
    mcap_bytes_close(index, indexed);
}

/* --- messages --- */

bool mcap_writer_fits(const struct mcap_writer *writer, size_t messages,
                      size_t bytes)
{
    return writer->entries + messages <= MCAP_CHUNK_MESSAGES &&
           writer->chunk.length + messages * MCAP_MESSAGE_HEAD + bytes <=
               MCAP_CHUNK_BYTES;
}

static void mcap_writer_enter(struct mcap_writer *writer, uint16_t channel,
                              uint64_t t_ns)
{
    struct mcap_writer_channel *to = &writer->channel[channel];
    writer->entry[writer->entries] =
        (struct mcap_writer_entry){ t_ns, writer->chunk.length, 0 };
    const uint32_t number = ++writer->entries;
    if (to->last != 0)
        writer->entry[to->last - 1].next = number;
    else
        to->first = number;
    to->last = number;
    to->count++;
}

static void mcap_writer_span(uint64_t *first_ns, uint64_t *last_ns, bool begins,
                             uint64_t t_ns)
{
    if (begins || t_ns < *first_ns)
        *first_ns = t_ns;
    if (begins || t_ns > *last_ns)
        *last_ns = t_ns;
}

void mcap_writer_message(struct mcap_writer *writer, uint16_t channel,
                         uint32_t sequence, uint64_t t_ns, const char *data,
                         size_t length)
{
    struct mcap_bytes *chunk = &writer->chunk;
    mcap_writer_span(&writer->first_ns, &writer->last_ns,
                     writer->message_count++ == 0, t_ns);
    mcap_writer_span(&writer->chunk_first_ns, &writer->chunk_last_ns,
                     writer->entries == 0, t_ns);
    mcap_writer_enter(writer, channel, t_ns);
    const size_t open = mcap_bytes_open(chunk, MCAP_MESSAGE);
    mcap_bytes_number(chunk, channel, 2);
    mcap_bytes_number(chunk, sequence, 4);
    mcap_bytes_number(chunk, t_ns, 8);
    mcap_bytes_number(chunk, t_ns, 8);
    mcap_bytes_put(chunk, data, length);
    mcap_bytes_close(chunk, open);
}

/* --- chunks --- */

/* Up to the messages. */
static void mcap_writer_chunk_head(struct mcap_writer *writer)
{
    struct mcap_bytes *piece = &writer->piece;
    const struct mcap_bytes *chunk = &writer->chunk;
    const size_t rest = 8 + 8 + 8 + 4 + 4 + 8 + chunk->length;
    mcap_bytes_number(piece, MCAP_CHUNK, 1);
    mcap_bytes_number(piece, rest, 8);
    mcap_bytes_number(piece, writer->chunk_first_ns, 8);
    mcap_bytes_number(piece, writer->chunk_last_ns, 8);
    mcap_bytes_number(piece, chunk->length, 8);
    mcap_bytes_number(piece, crc32_of(0, chunk->byte, chunk->length), 4);
    mcap_bytes_text(piece, ""); /* not compressed */
    mcap_bytes_number(piece, chunk->length, 8);
}

static void mcap_writer_message_index(struct mcap_writer *writer,
                                      uint16_t channel)
{
    struct mcap_bytes *piece = &writer->piece;
    const size_t open = mcap_bytes_open(piece, MCAP_MESSAGE_INDEX);
    mcap_bytes_number(piece, channel, 2);
    const size_t array = mcap_bytes_open_array(piece);
    for (uint32_t n = writer->channel[channel].first; n != 0;) {
        const struct mcap_writer_entry *entry = &writer->entry[n - 1];
        mcap_bytes_number(piece, entry->t_ns, 8);
        mcap_bytes_number(piece, entry->offset, 8);
        n = entry->next;
    }
    mcap_bytes_close_array(piece, array);
    mcap_bytes_close(piece, open);
}

/* Of the chunk at `start`, whose messages' indexes are in `piece` and will be
 * at `at`. */
static void mcap_writer_chunk_index(struct mcap_writer *writer, uint64_t start,
                                    const uint64_t index_at[])
{
    struct mcap_bytes *index = &writer->index;
    const size_t open = mcap_bytes_open(index, MCAP_CHUNK_INDEX);
    mcap_bytes_number(index, writer->chunk_first_ns, 8);
    mcap_bytes_number(index, writer->chunk_last_ns, 8);
    mcap_bytes_number(index, start, 8);
    mcap_bytes_number(index, writer->offset - start, 8);
    const size_t map = mcap_bytes_open_array(index);
    for (uint16_t c = 0; c < writer->channel_count; c++) {
        if (writer->channel[c].first == 0)
            continue;
        mcap_bytes_number(index, c, 2);
        mcap_bytes_number(index, index_at[c], 8);
    }
    mcap_bytes_close_array(index, map);
    mcap_bytes_number(index, writer->piece.length, 8);
    mcap_bytes_text(index, "");
    mcap_bytes_number(index, writer->chunk.length, 8);
    mcap_bytes_number(index, writer->chunk.length, 8);
    mcap_bytes_close(index, open);
}

/* Bytes of a chunk in the index, at most. */
static size_t mcap_writer_index_need(const struct mcap_writer *writer)
{
    return 96 + (size_t)10 * writer->channel_count;
}

static void mcap_writer_chunk_end(struct mcap_writer *writer)
{
    for (uint16_t c = 0; c < writer->channel_count; c++)
        writer->channel[c].first = writer->channel[c].last = 0;
    writer->entries = 0;
    writer->chunk.length = 0;
}

bool mcap_writer_chunk(struct mcap_writer *writer)
{
    const uint64_t start = writer->offset;
    uint64_t index_at[MCAP_WRITER_CHANNELS] = { 0 };
    if (writer->entries == 0)
        return mcap_writer_flush(writer);
    mcap_writer_chunk_head(writer);
    mcap_writer_piece(writer);
    mcap_writer_put(writer, &writer->chunk);
    for (uint16_t c = 0; c < writer->channel_count; c++) {
        if (writer->channel[c].first == 0)
            continue;
        index_at[c] = writer->offset + writer->piece.length;
        mcap_writer_message_index(writer, c);
    }
    writer->index_full |=
        writer->index.length + mcap_writer_index_need(writer) >
        MCAP_INDEX_BYTES;
    if (!writer->index_full)
        mcap_writer_chunk_index(writer, start, index_at);
    mcap_writer_piece(writer);
    writer->chunk_count++;
    mcap_writer_chunk_end(writer);
    return mcap_writer_flush(writer);
}

/* --- the end --- */

static void mcap_writer_statistics(struct mcap_writer *writer,
                                   struct mcap_bytes *to)
{
    const size_t open = mcap_bytes_open(to, MCAP_STATISTICS);
    mcap_bytes_number(to, writer->message_count, 8);
    mcap_bytes_number(to, writer->schema_count, 2);
    mcap_bytes_number(to, writer->channel_count, 4);
    mcap_bytes_number(to, writer->attachment_count, 4);
    mcap_bytes_number(to, writer->metadata_count, 4);
    mcap_bytes_number(to, writer->chunk_count, 4);
    mcap_bytes_number(to, writer->first_ns, 8);
    mcap_bytes_number(to, writer->last_ns, 8);
    const size_t map = mcap_bytes_open_array(to);
    for (uint16_t c = 0; c < writer->channel_count; c++) {
        mcap_bytes_number(to, c, 2);
        mcap_bytes_number(to, writer->channel[c].count, 8);
    }
    mcap_bytes_close_array(to, map);
    mcap_bytes_close(to, open);
}

/* A group of records of one kind, and where it will be. */
static void mcap_writer_group(struct mcap_writer *writer,
                              struct mcap_bytes *summary,
                              struct mcap_bytes *offsets,
                              const struct mcap_bytes *group)
{
    if (group->length == 0)
        return;
    const size_t open = mcap_bytes_open(offsets, MCAP_SUMMARY_OFFSET);
    mcap_bytes_number(offsets, group->byte[0], 1);
    mcap_bytes_number(offsets, writer->offset + summary->length, 8);
    mcap_bytes_number(offsets, group->length, 8);
    mcap_bytes_close(offsets, open);
    mcap_bytes_put(summary, group->byte, group->length);
}

static void mcap_writer_summary(struct mcap_writer *writer,
                                struct mcap_bytes *summary)
{
    struct mcap_bytes offsets = { .byte = NULL }, statistics = offsets;
    mcap_writer_statistics(writer, &statistics);
    if (writer->index_full)
        writer->index.length = 0;
    const struct mcap_bytes *const group[] = {
        &writer->schemas, &writer->channels,    &statistics,
        &writer->index,   &writer->attachments, &writer->metadata,
    };
    for (size_t i = 0; i < sizeof group / sizeof group[0]; i++)
        mcap_writer_group(writer, summary, &offsets, group[i]);
    const uint64_t start = writer->offset, at = start + summary->length;
    mcap_bytes_put(summary, offsets.byte, offsets.length);
    const size_t open = mcap_bytes_open(summary, MCAP_FOOTER);
    mcap_bytes_number(summary, start, 8);
    mcap_bytes_number(summary, at, 8);
    /* the checksum is of the footer too, so that its length comes first */
    mcap_bytes_number(summary, 0, 4);
    mcap_bytes_close(summary, open);
    summary->length -= 4;
    mcap_bytes_number(summary, crc32_of(0, summary->byte, summary->length), 4);
    mcap_bytes_put(summary, MCAP_MAGIC, MCAP_MAGIC_BYTES);
    mcap_bytes_free(&offsets);
    mcap_bytes_free(&statistics);
}

bool mcap_writer_end(struct mcap_writer *writer)
{
    struct mcap_bytes *piece = &writer->piece, summary = { .byte = NULL };
    mcap_writer_chunk(writer);
    const size_t open = mcap_bytes_open(piece, MCAP_DATA_END);
    mcap_bytes_number(piece, 0, 4); /* chunks have their own checksums */
    mcap_bytes_close(piece, open);
    mcap_writer_piece(writer);
    mcap_writer_summary(writer, &summary);
    mcap_writer_put(writer, &summary);
    mcap_bytes_free(&summary);
    return mcap_writer_flush(writer);
}
