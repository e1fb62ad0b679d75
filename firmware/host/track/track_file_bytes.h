/* firmware/host/track/track_file_bytes.h - the layout that writing and reading
 * of track_file.h share. */
#ifndef FIRMWARE_HOST_TRACK_TRACK_FILE_BYTES_H
#define FIRMWARE_HOST_TRACK_TRACK_FILE_BYTES_H

#include "firmware/host/track/track_file.h"

#define TRACK_FILE_MAGIC       "slewtrk\n"
#define TRACK_FILE_MAGIC_BYTES 8
#define TRACK_FILE_VERSION     2 /* tracks alone */
#define TRACK_FILE_EVENTS      3 /* and what comes after them */

#define TRACK_FILE_CRC_BYTES     4
#define TRACK_FILE_START_BYTES   144 /* magic, version, axes, title */
#define TRACK_FILE_AXIS_BYTES    104
#define TRACK_FILE_SEGMENT_BYTES 80
#define TRACK_FILE_BLOCK_BYTES                                                 \
    (12 + TRACK_FILE_BLOCK * TRACK_FILE_SEGMENT_BYTES + TRACK_FILE_CRC_BYTES)
#define TRACK_FILE_HEADER_MAX                                                  \
    (TRACK_FILE_START_BYTES + PLAN_AXES_MAX * TRACK_FILE_AXIS_BYTES +          \
     TRACK_FILE_CRC_BYTES) /* 7 KB: one buffer for whatever is read or written */

#define TRACK_FILE_TIMES 320 /* in a block */
#define TRACK_FILE_EVENTS_BYTES                                                \
    (24 + PLAN_NAME_MAX) /* lines, and the steps, before the lines */
#define TRACK_FILE_LINE_BYTES (PLAN_NAME_MAX + 12)

static inline uint32_t track_file_events_bytes(uint32_t lines)
{
    return TRACK_FILE_EVENTS_BYTES + lines * TRACK_FILE_LINE_BYTES +
           TRACK_FILE_CRC_BYTES;
}

/* Of so many times. */
static inline uint64_t track_file_times_bytes(uint32_t count)
{
    return (uint64_t)count * 8 + (uint64_t)(count + TRACK_FILE_TIMES - 1) /
                                     TRACK_FILE_TIMES * TRACK_FILE_CRC_BYTES;
}

static inline uint32_t track_file_header_bytes(uint32_t axes)
{
    return TRACK_FILE_START_BYTES + axes * TRACK_FILE_AXIS_BYTES +
           TRACK_FILE_CRC_BYTES;
}

static inline uint32_t track_file_blocks(uint32_t segments)
{
    return (segments + TRACK_FILE_BLOCK - 1) / TRACK_FILE_BLOCK;
}

/* The larger of a header and a block, and how far it has been written or
 * read. */
struct track_file_bytes {
    size_t used;
    unsigned char byte[TRACK_FILE_HEADER_MAX];
};
_Static_assert(TRACK_FILE_HEADER_MAX >= TRACK_FILE_BLOCK_BYTES, "a block fits");

/* The next `size` bytes, the lowest first. */
void track_file_put(struct track_file_bytes *at, uint64_t value, unsigned size);
uint64_t track_file_get(struct track_file_bytes *at, unsigned size);

#endif
