/* firmware/host/track/compiled.c - see compiled.h. */
#include "firmware/host/track/compiled.h"

#include "firmware/host/base/memory.h"

_Static_assert(TRACK_STREAM_AHEAD(TRACK_STREAM_PLAY) <= TRACK_FILE_SPAN_MAX,
               "the least time ahead can be found");

static int compiled_open_axis(struct compiled *compiled, unsigned i,
                              char message[TRACK_FILE_MESSAGE_MAX])
{
    struct motion_track_outline *outline = &compiled->outline[i];
    int64_t least_ns_q12;
    if (track_file_verify(&compiled->file, i, outline,
                          TRACK_STREAM_AHEAD(TRACK_STREAM_PLAY), &least_ns_q12,
                          message) < 0)
        return -1;
    if (least_ns_q12 < compiled->least_ns_q12)
        compiled->least_ns_q12 = least_ns_q12;
    track_stream_init(&compiled->play[i], &compiled->file, i, TRACK_STREAM_PLAY,
                      &compiled->track[i], outline);
    track_stream_init(&compiled->look[i], &compiled->file, i, TRACK_STREAM_LOOK,
                      &compiled->look_track[i], outline);
    return 0;
}

static void compiled_storage(struct compiled *compiled, uint32_t axes)
{
#define CAPACITY(array)                                                        \
    compiled->array =                                                          \
        memory_pool_new(&compiled->memory, axes, sizeof *compiled->array)
    CAPACITY(outline);
    CAPACITY(play);
    CAPACITY(look);
    CAPACITY(track);
    CAPACITY(look_track);
#undef CAPACITY
}

struct compiled *compiled_open(const struct files *files, const char *path,
                               char message[TRACK_FILE_MESSAGE_MAX])
{
    struct compiled *compiled = memory_new(1, sizeof *compiled);
    int err = track_file_open(&compiled->file, files, path, message);
    compiled->least_ns_q12 = INT64_MAX;
    if (err == 0)
        compiled_storage(compiled, compiled->file.axis_count);
    for (unsigned i = 0; err == 0 && i < compiled->file.axis_count; i++)
        err = compiled_open_axis(compiled, i, message);
    if (err < 0) {
        compiled_close(compiled);
        return NULL;
    }
    compiled_fill(compiled);
    compiled_advance(compiled, 0);
    return compiled;
}

void compiled_close(struct compiled *compiled)
{
    if (compiled == NULL)
        return;
    for (unsigned i = 0;
         compiled->play != NULL && i < compiled->file.axis_count; i++) {
        track_stream_free(&compiled->play[i]);
        track_stream_free(&compiled->look[i]);
    }
    track_file_close(&compiled->file);
    memory_pool_free(&compiled->memory);
    memory_free(compiled);
}

/* A window that fails runs dry, which the controller sees. */
void compiled_fill(struct compiled *compiled)
{
    for (unsigned i = 0; i < compiled->file.axis_count; i++)
        (void)track_stream_fill(&compiled->play[i]);
}

void compiled_advance(struct compiled *compiled, int64_t t_ns_q12)
{
    for (unsigned i = 0; i < compiled->file.axis_count; i++)
        track_stream_advance(&compiled->play[i], t_ns_q12);
}

const struct motion_track *compiled_look(struct compiled *compiled,
                                         unsigned axis, int64_t t_ns_q12)
{
    if (track_stream_seek(&compiled->look[axis], t_ns_q12) < 0)
        return NULL;
    return &compiled->look_track[axis];
}

const char *compiled_error(const struct compiled *compiled)
{
    for (unsigned i = 0; i < compiled->file.axis_count; i++) {
        if (atomic_load(&compiled->play[i].failed))
            return compiled->play[i].message;
        if (atomic_load(&compiled->look[i].failed))
            return compiled->look[i].message;
    }
    return NULL;
}

/* --- all of it ------------------------------------------------------------ */

/* A block that was good when the file was opened and is not now ends the walk;
 * playing would fail on it too. */
const struct motion_segment *compiled_walk_next(void *context)
{
    struct compiled_walk *walk = context;
    const struct track_file *file = &walk->compiled->file;
    const uint32_t at = walk->next % TRACK_FILE_BLOCK;
    char message[TRACK_FILE_MESSAGE_MAX];
    if (walk->next == file->axis[walk->axis].segments ||
        (at == 0 &&
         track_file_block(file, walk->axis, walk->next / TRACK_FILE_BLOCK,
                          walk->segment, &walk->count, message) < 0))
        return NULL;
    walk->next++;
    return &walk->segment[at];
}
