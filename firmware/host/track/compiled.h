/* firmware/host/track/compiled.h - a compiled move as a job has it.
 *
 * Opening reads and judges all of the file once, a block at a time.  After that
 * the job's tracks are windows that `play` moves along; telemetry and reports,
 * which run behind, look through windows of their own. */
#ifndef FIRMWARE_HOST_TRACK_COMPILED_H
#define FIRMWARE_HOST_TRACK_COMPILED_H

#include "firmware/host/base/memory.h"
#include "firmware/host/track/track_file.h"
#include "firmware/host/track/track_stream.h"
#include "motion/plan/check.h"

struct compiled {
    struct memory_pool memory; /* of the arrays: one per axis */
    struct track_file file;
    struct motion_track_outline *outline;
    int64_t least_ns_q12; /* that a window reaches ahead; INT64_MAX: all */
    struct track_stream *play, *look;
    struct motion_track *track, *look_track; /* the windows */
};

/* NULL, with a sentence, when the file is not whole.  The windows are at the
 * start of the move, those of `track` filled. */
struct compiled *compiled_open(const struct files *files, const char *path,
                               char message[TRACK_FILE_MESSAGE_MAX]);
void compiled_close(struct compiled *compiled); /* NULL: does nothing */

/* The two sides of all windows that are played; see track_stream.h. */
void compiled_fill(struct compiled *compiled);
void compiled_advance(struct compiled *compiled, int64_t t_ns_q12);

/* The axis at a time, for those who may wait; valid until the next call for
 * that axis.  NULL when the file cannot be read any more. */
const struct motion_track *compiled_look(struct compiled *compiled,
                                         unsigned axis, int64_t t_ns_q12);
/* What was wrong with the file after it was opened, NULL when nothing. */
const char *compiled_error(const struct compiled *compiled);

/* All segments of an axis, one after the other: starts zero but for `compiled`
 * and `axis`.  A segment is valid until the next one; NULL after the last, or
 * when the file cannot be read any more. */
struct compiled_walk {
    const struct compiled *compiled;
    unsigned axis;
    uint32_t next, count; /* segments; in the block */
    struct motion_segment segment[TRACK_FILE_BLOCK];
};
const struct motion_segment *compiled_walk_next(void *context);

#endif
