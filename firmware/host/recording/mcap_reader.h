/* firmware/host/recording/mcap_reader.h - the records of an MCAP file from its
 * beginning on, also of one that was cut anywhere or is still being written.
 *
 * Reads what is not compressed.  Those of a chunk come one by one, once its
 * checksum is right; of a chunk that is damaged nothing is taken.  The data end
 * where the summary begins, or where the file does. */
#ifndef FIRMWARE_HOST_RECORDING_MCAP_READER_H
#define FIRMWARE_HOST_RECORDING_MCAP_READER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/host/base/files.h"
#include "firmware/host/recording/mcap.h"

#define MCAP_RECORD_MAX (INT64_C(64) << 20)

/* What is still to be taken out of a record. */
struct mcap_part {
    const unsigned char *at, *end;
    bool bad; /* it ended too early; everything taken since is 0 */
};

struct mcap_record {
    uint8_t opcode;
    struct mcap_part content;
};

struct mcap_reader {
    const struct files *files;
    int file;
    uint64_t offset;
    unsigned char *content; /* of the record or chunk at hand */
    size_t capacity;
    struct mcap_part chunk; /* what is left of it */
    unsigned damaged;       /* chunks */
    bool ended;             /* the end of the data was there */
    const char *wrong;      /* why mcap_reader_next is -1 */
};

/* 0, or a negative errno.  mcap_reader_close in either case. */
int mcap_reader_open(struct mcap_reader *reader, const struct files *files,
                     const char *path);
void mcap_reader_close(struct mcap_reader *reader);
/* 1: the next one, whose content stays until the one after it; 0: there is none
 * any more; -1: the file is not MCAP, not readable here, or cannot be read. */
int mcap_reader_next(struct mcap_reader *reader, struct mcap_record *record);

/* `wrong` of what does not begin as MCAP. */
extern const char mcap_reader_other[];
/* Does the file begin as MCAP? */
bool mcap_reader_is_mcap(const struct files *files, const char *path);

uint64_t mcap_part_number(struct mcap_part *part, unsigned size);
/* The next `size` bytes. */
struct mcap_part mcap_part_bytes(struct mcap_part *part, uint64_t size);
/* A string, cut at `size` with its 0.  False: it is longer, or has a 0. */
bool mcap_part_text(struct mcap_part *part, char *text, size_t size);

#endif
