/* firmware/host/track/track_stream.c - see track_stream.h. */
#include "firmware/host/track/track_stream.h"

#include "firmware/host/base/memory.h"

static uint32_t track_stream_count(const struct track_stream *stream)
{
    return stream->file->axis[stream->axis].segments;
}

/* The track sees segments first .. filled - 1. */
static void track_stream_show(struct track_stream *stream)
{
    const uint32_t first = atomic_load(&stream->first);
    stream->track->segment = stream->ring + first % stream->window;
    stream->track->count = atomic_load(&stream->filled) - first;
}

void track_stream_init(struct track_stream *stream,
                       const struct track_file *file, unsigned axis,
                       uint32_t window, struct motion_track *track,
                       const struct motion_track_outline *outline)
{
    const struct track_file_axis *of = &file->axis[axis];
    stream->file = file;
    stream->axis = axis;
    stream->track = track;
    stream->window = window;
    stream->message[0] = 0;
    stream->ring = memory_new(2 * (size_t)window, sizeof *stream->ring);
    atomic_init(&stream->first, 0);
    atomic_init(&stream->filled, 0);
    atomic_init(&stream->failed, false);
    *track = (struct motion_track){ .segment = stream->ring,
                                    .end_ns_q12 = of->end_ns_q12,
                                    .end = of->end,
                                    .end_frac = of->end_frac,
                                    .outline = outline };
}

void track_stream_free(struct track_stream *stream)
{
    memory_free(stream->ring);
    stream->ring = NULL;
}

static int track_stream_fail(struct track_stream *stream)
{
    atomic_store(&stream->failed, true);
    return -1;
}

/* Block `filled` into the ring.  Blocks are whole but for the last one, so one
 * never wraps. */
static int track_stream_read(struct track_stream *stream)
{
    struct motion_segment segment[TRACK_FILE_BLOCK];
    const uint32_t filled = atomic_load(&stream->filled);
    uint32_t count;
    if (atomic_load(&stream->failed))
        return -1;
    if (track_file_block(stream->file, stream->axis, filled / TRACK_FILE_BLOCK,
                         segment, &count, stream->message) < 0)
        return track_stream_fail(stream);
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t slot = (filled + i) % stream->window;
        stream->ring[slot] = segment[i];
        stream->ring[slot + stream->window] = segment[i];
    }
    atomic_store(&stream->filled, filled + count);
    return 0;
}

static bool track_stream_has_capacity(const struct track_stream *stream)
{
    const uint32_t filled = atomic_load(&stream->filled);
    return filled < track_stream_count(stream) &&
           filled - atomic_load(&stream->first) + TRACK_FILE_BLOCK <=
               stream->window;
}

int track_stream_fill(struct track_stream *stream)
{
    while (track_stream_has_capacity(stream))
        if (track_stream_read(stream) < 0)
            return -1;
    return 0;
}

/* A block is let go of when the one after it is over too; at most as many as
 * the window has. */
void track_stream_advance(struct track_stream *stream, int64_t t_ns_q12)
{
    const uint32_t filled = atomic_load(&stream->filled);
    uint32_t first = atomic_load(&stream->first);
    while (first + 2 * TRACK_FILE_BLOCK < filled &&
           stream->ring[(first + 2 * TRACK_FILE_BLOCK) % stream->window]
                   .start_ns_q12 <= t_ns_q12)
        first += TRACK_FILE_BLOCK;
    atomic_store(&stream->first, first);
    track_stream_show(stream);
}

/* --- anywhere ------------------------------------------------------------- */

static void track_stream_restart(struct track_stream *stream, uint32_t block)
{
    atomic_store(&stream->first, block * TRACK_FILE_BLOCK);
    atomic_store(&stream->filled, block * TRACK_FILE_BLOCK);
}

/* The last block that starts at or before t, by halving. */
static int track_stream_find(struct track_stream *stream, int64_t t_ns_q12,
                             uint32_t *block)
{
    struct motion_segment segment[TRACK_FILE_BLOCK];
    uint32_t count, low = 0,
                    high = (track_stream_count(stream) - 1) / TRACK_FILE_BLOCK;
    while (low < high) {
        const uint32_t middle = high - (high - low) / 2;
        if (track_file_block(stream->file, stream->axis, middle, segment,
                             &count, stream->message) < 0)
            return track_stream_fail(stream);
        if (segment[0].start_ns_q12 <= t_ns_q12)
            low = middle;
        else
            high = middle - 1;
    }
    *block = low;
    return 0;
}

static bool track_stream_holds(const struct track_stream *stream,
                               int64_t t_ns_q12)
{
    return stream->track->count > 0 &&
           motion_track_ahead(stream->track, t_ns_q12) > 0;
}

/* The next block, where playing on would look. */
static int track_stream_go_on(struct track_stream *stream, int64_t t_ns_q12)
{
    int err = 0;
    track_stream_advance(stream, t_ns_q12);
    if (track_stream_has_capacity(stream))
        err = track_stream_read(stream);
    track_stream_show(stream);
    return err;
}

int track_stream_seek(struct track_stream *stream, int64_t t_ns_q12)
{
    const int64_t last_ns_q12 = stream->track->end_ns_q12 - 1;
    const int64_t t = t_ns_q12 < 0             ? 0
                      : t_ns_q12 > last_ns_q12 ? last_ns_q12
                                               : t_ns_q12;
    uint32_t block = 0;
    if (track_stream_count(stream) == 0 || track_stream_holds(stream, t))
        return 0;
    if (stream->track->count > 0 &&
        t >= stream->track->segment[0].start_ns_q12 &&
        track_stream_go_on(stream, t) < 0)
        return -1;
    if (track_stream_holds(stream, t))
        return 0;
    if (track_stream_find(stream, t, &block) < 0)
        return -1;
    track_stream_restart(stream, block > 0 ? block - 1 : 0);
    do {
        if (track_stream_read(stream) < 0)
            return -1;
        track_stream_show(stream);
    } while (!track_stream_holds(stream, t));
    return 0;
}
