/* firmware/host/recording/mcap_reader.c - see mcap_reader.h. */
#include "firmware/host/recording/mcap_reader.h"

#include <string.h>

#include "firmware/host/base/memory.h"
#include "hal/support/crc32.h"

/* --- parts of a record --- */

struct mcap_part mcap_part_bytes(struct mcap_part *part, uint64_t size)
{
    const struct mcap_part none = { part->end, part->end, true };
    if (part->bad || size > (uint64_t)(part->end - part->at)) {
        *part = none;
        return none;
    }
    const struct mcap_part taken = { part->at, part->at + size, false };
    part->at += size;
    return taken;
}

uint64_t mcap_part_number(struct mcap_part *part, unsigned size)
{
    const struct mcap_part bytes = mcap_part_bytes(part, size);
    uint64_t value = 0;
    for (unsigned i = 0; !bytes.bad && i < size; i++)
        value |= (uint64_t)bytes.at[i] << (8 * i);
    return value;
}

bool mcap_part_text(struct mcap_part *part, char *text, size_t size)
{
    const uint64_t length = mcap_part_number(part, 4);
    const struct mcap_part bytes = mcap_part_bytes(part, length);
    const size_t kept = length < size ? (size_t)length : size - 1;
    text[0] = 0;
    if (bytes.bad)
        return false;
    memcpy(text, bytes.at, kept);
    text[kept] = 0;
    return kept == length && strlen(text) == kept;
}

/* --- the file --- */

/* 1, 0: the file ends before; negative errno. */
static int mcap_reader_bytes(struct mcap_reader *reader, void *to, size_t size)
{
    unsigned char *at = to;
    while (size > 0) {
        const int64_t got = reader->files->read(reader->files, reader->file, at,
                                                size, reader->offset);
        if (got <= 0)
            return (int)got;
        reader->offset += (uint64_t)got;
        at += got;
        size -= (size_t)got;
    }
    return 1;
}

int mcap_reader_open(struct mcap_reader *reader, const struct files *files,
                     const char *path)
{
    *reader = (struct mcap_reader){ .files = files };
    reader->file = files->open(files, path);
    return reader->file < 0 ? reader->file : 0;
}

void mcap_reader_close(struct mcap_reader *reader)
{
    memory_free(reader->content);
    reader->content = NULL;
    if (reader->file >= 0)
        reader->files->close(reader->files, reader->file);
    reader->file = -1;
}

bool mcap_reader_is_mcap(const struct files *files, const char *path)
{
    char magic[MCAP_MAGIC_BYTES];
    struct mcap_reader reader;
    const bool is = mcap_reader_open(&reader, files, path) == 0 &&
                    mcap_reader_bytes(&reader, magic, sizeof magic) == 1 &&
                    memcmp(magic, MCAP_MAGIC, sizeof magic) == 0;
    mcap_reader_close(&reader);
    return is;
}

/* --- records --- */

const char mcap_reader_other[] = "not an MCAP file";

static int mcap_reader_fail(struct mcap_reader *reader, const char *what)
{
    reader->wrong = what;
    return -1;
}

/* 1, 0 at the end of the file, -1. */
static int mcap_reader_take(struct mcap_reader *reader, void *to, size_t size)
{
    const int got = mcap_reader_bytes(reader, to, size);
    return got < 0 ? mcap_reader_fail(reader, strerror(-got)) : got;
}

static int mcap_reader_magic(struct mcap_reader *reader)
{
    char magic[MCAP_MAGIC_BYTES];
    const int got = mcap_reader_take(reader, magic, sizeof magic);
    if (got < 0)
        return got;
    if (got == 0 || memcmp(magic, MCAP_MAGIC, sizeof magic) != 0)
        return mcap_reader_fail(reader, mcap_reader_other);
    return 1;
}

/* Of the file, chunks as they are. */
static int mcap_reader_record(struct mcap_reader *reader,
                              struct mcap_record *record)
{
    unsigned char head[MCAP_HEAD_BYTES];
    struct mcap_part part = { head, head + sizeof head, false };
    int got = mcap_reader_take(reader, head, sizeof head);
    if (got <= 0)
        return got;
    record->opcode = (uint8_t)mcap_part_number(&part, 1);
    const uint64_t length = mcap_part_number(&part, 8);
    if (record->opcode == 0) /* zeros, as a power cut leaves them */
        return 0;
    if (length > MCAP_RECORD_MAX)
        return mcap_reader_fail(
            reader, "has a record of more than 64 MiB, expected smaller ones");
    if (length > reader->capacity) {
        reader->content = memory_resize(reader->content, (size_t)length, 1);
        reader->capacity = (size_t)length;
    }
    got = mcap_reader_take(reader, reader->content, (size_t)length);
    record->content =
        (struct mcap_part){ reader->content, reader->content + length, false };
    return got;
}

/* -1: compressed; a damaged one is passed over. */
static int mcap_reader_chunk(struct mcap_reader *reader, struct mcap_part part)
{
    char compression[8];
    (void)mcap_part_bytes(&part, 8 + 8); /* times */
    const uint64_t size = mcap_part_number(&part, 8);
    const uint32_t crc = (uint32_t)mcap_part_number(&part, 4);
    if (!mcap_part_text(&part, compression, sizeof compression) ||
        compression[0] != 0)
        return mcap_reader_fail(
            reader, "compressed, expected a recording as slew run writes it");
    const struct mcap_part bytes =
        mcap_part_bytes(&part, mcap_part_number(&part, 8));
    if (bytes.bad || (uint64_t)(bytes.end - bytes.at) != size ||
        (crc != 0 && crc32_of(0, bytes.at, (size_t)size) != crc))
        reader->damaged++;
    else
        reader->chunk = bytes;
    return 1;
}

/* Of the chunk at hand: 1, or 0 when it is over. */
static int mcap_reader_within(struct mcap_reader *reader,
                              struct mcap_record *record)
{
    struct mcap_part *chunk = &reader->chunk;
    if (chunk->at == chunk->end)
        return 0;
    record->opcode = (uint8_t)mcap_part_number(chunk, 1);
    record->content = mcap_part_bytes(chunk, mcap_part_number(chunk, 8));
    reader->damaged += record->content.bad;
    return !record->content.bad;
}

int mcap_reader_next(struct mcap_reader *reader, struct mcap_record *record)
{
    if (reader->offset == 0) {
        const int got = mcap_reader_magic(reader);
        if (got <= 0)
            return got;
    }
    while (!reader->ended) {
        if (mcap_reader_within(reader, record) == 1)
            return 1;
        int got = mcap_reader_record(reader, record);
        if (got <= 0)
            return got;
        reader->ended = record->opcode == MCAP_DATA_END;
        if (record->opcode != MCAP_CHUNK)
            return !reader->ended;
        got = mcap_reader_chunk(reader, record->content);
        if (got < 0)
            return got;
    }
    return 0;
}
