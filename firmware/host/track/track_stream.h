/* firmware/host/track/track_stream.h - one axis of a compiled move, played
 * through a window (track.h) of its segments.
 *
 * Two sides, which may be two threads:
 *     fill      reads blocks from the file into the window while there is room
 *     advance   between ticks: lets go of blocks that have been played and takes
 *               in those that have been filled; never reads, never waits
 * Or one side alone, for those who may wait:
 *     seek      moves the window to where a time is, forwards or back
 *
 * The ring has every segment twice, one ring length apart, so that any run of
 * them lies in one piece and a track can point at it. */
#ifndef FIRMWARE_HOST_TRACK_TRACK_STREAM_H
#define FIRMWARE_HOST_TRACK_TRACK_STREAM_H

#include <stdatomic.h>
#include <stdint.h>

#include "firmware/host/track/track_file.h"

/* Segments in a window to be played; in one to look around with. */
#define TRACK_STREAM_PLAY 4096
#define TRACK_STREAM_LOOK 128

/* Blocks of a window that are ahead of the time played whatever happens: one
 * is kept behind, one is being played, one is being filled. */
#define TRACK_STREAM_AHEAD(segments) ((segments) / TRACK_FILE_BLOCK - 3)

struct track_stream {
    const struct track_file *file;
    unsigned axis;
    struct motion_track *track; /* the window */
    struct motion_segment *ring;
    uint32_t window;    /* segments */
    atomic_uint first;  /* number of the first segment kept */
    atomic_uint filled; /* one past the last that is in the ring */
    atomic_bool failed; /* filling is over; message says why */
    char message[TRACK_FILE_MESSAGE_MAX];
};

/* An empty window on an axis; `track` becomes it, with the outline that
 * track_file_verify gave, which must outlive it. */
void track_stream_init(struct track_stream *stream,
                       const struct track_file *file, unsigned axis,
                       uint32_t window, struct motion_track *track,
                       const struct motion_track_outline *outline);
void track_stream_free(struct track_stream *stream);

/* 0, or -1 when the file cannot be read; then and ever after, with `failed`
 * set and a message. */
int track_stream_fill(struct track_stream *stream);
void track_stream_advance(struct track_stream *stream, int64_t t_ns_q12);

/* 0: the window holds t and the segment before.  -1 as fill. */
int track_stream_seek(struct track_stream *stream, int64_t t_ns_q12);

#endif
