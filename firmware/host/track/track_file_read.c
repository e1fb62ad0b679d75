/* firmware/host/track/track_file_read.c - reading and judging; see
 * track_file.h.
 *
 * Nothing of the file is believed: every count is bounded before it is used,
 * the length of the file must be the one that the counts give, and a segment
 * must be one that planning could have made. */
#include <inttypes.h>
#include <stdarg.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/track/track_file_bytes.h"
#include "hal/support/crc32.h"
#include "motion/core/err.h"

__attribute__((format(printf, 2, 3))) static int
track_file_fail(char message[TRACK_FILE_MESSAGE_MAX], const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(message, TRACK_FILE_MESSAGE_MAX, format, args);
    va_end(args);
    return -1;
}

static int track_file_read_at(const struct track_file *file, void *to,
                              size_t size, uint64_t offset,
                              char message[TRACK_FILE_MESSAGE_MAX])
{
    unsigned char *byte = to;
    while (size > 0) {
        const int64_t got =
            file->files->read(file->files, file->file, byte, size, offset);
        if (got < 0)
            return track_file_fail(message, "%s", strerror((int)-got));
        if (got == 0)
            return track_file_fail(message,
                                   "ends at byte %" PRIu64
                                   ", expected more of a compiled move",
                                   offset);
        byte += got;
        size -= (size_t)got;
        offset += (uint64_t)got;
    }
    return 0;
}

static bool track_file_is_whole(const struct track_file_bytes *at, size_t size)
{
    struct track_file_bytes end = { .used = 0 };
    memcpy(end.byte, at->byte + size - TRACK_FILE_CRC_BYTES,
           TRACK_FILE_CRC_BYTES);
    return track_file_get(&end, 4) ==
           crc32_of(0, at->byte, size - TRACK_FILE_CRC_BYTES);
}

bool track_file_is(const struct files *files, const char *path)
{
    char magic[TRACK_FILE_MAGIC_BYTES], ignored[TRACK_FILE_MESSAGE_MAX];
    /* A pipe is no compiled move, and what was read of it would be gone. */
    const struct files *regular = files_regular(files);
    const struct track_file file = { .files = regular,
                                     .file = regular->open(regular, path) };
    if (file.file < 0)
        return false;
    const bool is =
        track_file_read_at(&file, magic, sizeof magic, 0, ignored) == 0 &&
        memcmp(magic, TRACK_FILE_MAGIC, sizeof magic) == 0;
    regular->close(regular, file.file);
    return is;
}

/* --- the header ----------------------------------------------------------- */

/* Ends within its room, and holds nothing but printable characters. */
static bool track_file_get_text(struct track_file_bytes *at, char *text,
                                size_t size)
{
    memcpy(text, at->byte + at->used, size);
    at->used += size;
    if (memchr(text, 0, size) == NULL)
        return false;
    for (const char *c = text; *c != 0; c++)
        if ((unsigned char)*c < ' ' || *c == 0x7F)
            return false;
    return true;
}

static int64_t track_file_get_i64(struct track_file_bytes *at)
{
    return (int64_t)track_file_get(at, 8);
}

static bool track_file_get_axis(struct track_file_bytes *at,
                                struct track_file_axis *axis)
{
    const bool name = track_file_get_text(at, axis->name, sizeof axis->name);
    const bool unit = track_file_get_text(at, axis->unit, sizeof axis->unit);
    axis->keys = (uint32_t)track_file_get(at, 4);
    axis->segments = (uint32_t)track_file_get(at, 4);
    axis->first = track_file_get(at, 8);
    axis->end_ns_q12 = track_file_get_i64(at);
    axis->end.pos_q32 = track_file_get_i64(at);
    axis->end.vel_q32 = track_file_get_i64(at);
    axis->end.acc_q32 = track_file_get_i64(at);
    axis->end.jerk_q32 = track_file_get_i64(at);
    axis->end_frac = track_file_get(at, 8);
    return name && unit && axis->name[0] != 0;
}

static int track_file_judge_axis(const struct track_file *file, unsigned i,
                                 uint64_t first,
                                 char message[TRACK_FILE_MESSAGE_MAX])
{
    const struct track_file_axis *axis = &file->axis[i];
    if (axis->segments > TRACK_FILE_SEGMENTS_MAX)
        return track_file_fail(
            message, "axis %s has %" PRIu32 " segments, expected at most %d",
            axis->name, axis->segments, TRACK_FILE_SEGMENTS_MAX);
    if (axis->first != first)
        return track_file_fail(
            message, "axis %s begins at byte %" PRIu64 ", expected %" PRIu64,
            axis->name, axis->first, first);
    if (axis->end_ns_q12 < 0 || axis->end_ns_q12 > MOTION_TRACK_MAX_NS_Q12 ||
        (axis->end_ns_q12 == 0) != (axis->segments == 0))
        return track_file_fail(message,
                               "axis %s ends at %" PRId64
                               " / 4096 ns, which its segments cannot",
                               axis->name, axis->end_ns_q12);
    for (unsigned k = 0; k < i; k++)
        if (strcmp(file->axis[k].name, axis->name) == 0)
            return track_file_fail(message, "has two axes named %s",
                                   axis->name);
    return 0;
}

/* --- events --------------------------------------------------------------- */

static int track_file_judge_step(const struct track_file *file,
                                 char message[TRACK_FILE_MESSAGE_MAX])
{
    const struct track_file_step *step = &file->step;
    if (step->count > 0 &&
        (step->first_ns_q12 < 0 || step->period_ns_q12 <= 0 ||
         step->first_ns_q12 > MOTION_TRACK_MAX_NS_Q12 ||
         step->period_ns_q12 > MOTION_TRACK_MAX_NS_Q12 / step->count))
        return track_file_fail(message, "waits for frames at times that no "
                                        "move has");
    return 0;
}

/* A line, and where the next one's times begin. */
static int track_file_judge_line(const struct track_file *file, unsigned i,
                                 uint64_t *first,
                                 char message[TRACK_FILE_MESSAGE_MAX])
{
    const struct track_file_line *line = &file->line[i];
    if (line->count == 0 || line->count > TRACK_FILE_SHOTS_MAX)
        return track_file_fail(
            message, "line %s has %" PRIu32 " shots, expected 1 to %d",
            line->name, line->count, TRACK_FILE_SHOTS_MAX);
    if (line->first != *first)
        return track_file_fail(
            message, "line %s begins at byte %" PRIu64 ", expected %" PRIu64,
            line->name, line->first, *first);
    for (unsigned k = 0; k < i; k++)
        if (strcmp(file->line[k].name, line->name) == 0)
            return track_file_fail(message, "has two lines named %s",
                                   line->name);
    *first += track_file_times_bytes(line->count);
    return 0;
}

/* What comes after the axes, which end at *first; *first is then the end. */
static int track_file_read_events(struct track_file *file, uint64_t *first,
                                  char message[TRACK_FILE_MESSAGE_MAX])
{
    struct track_file_bytes at = { .used = 0 };
    if (track_file_read_at(file, at.byte, TRACK_FILE_EVENTS_BYTES, *first,
                           message) < 0)
        return -1;
    file->line_count = (uint32_t)track_file_get(&at, 4);
    if (file->line_count > TRACK_FILE_LINES_MAX)
        return track_file_fail(
            message, "triggers %" PRIu32 " lines, expected at most %d",
            file->line_count, TRACK_FILE_LINES_MAX);
    const uint32_t size = track_file_events_bytes(file->line_count);
    if (track_file_read_at(file, at.byte, size, *first, message) < 0)
        return -1;
    if (!track_file_is_whole(&at, size))
        return track_file_fail(message, "has damaged events: their checksum is "
                                        "not the one expected");
    *first += size;
    file->step.count = (uint32_t)track_file_get(&at, 4);
    file->step.first_ns_q12 = track_file_get_i64(&at);
    file->step.period_ns_q12 = track_file_get_i64(&at);
    bool texts = track_file_get_text(&at, file->step.line, PLAN_NAME_MAX);
    for (unsigned i = 0; i < file->line_count; i++) {
        struct track_file_line *line = &file->line[i];
        texts = track_file_get_text(&at, line->name, PLAN_NAME_MAX) && texts;
        line->count = (uint32_t)track_file_get(&at, 4);
        line->first = track_file_get(&at, 8);
    }
    if (!texts)
        return track_file_fail(message, "has a name of a line that is none");
    if (track_file_judge_step(file, message) < 0)
        return -1;
    for (unsigned i = 0; i < file->line_count; i++)
        if (track_file_judge_line(file, i, first, message) < 0)
            return -1;
    return 0;
}

int track_file_shots(const struct track_file *file, unsigned line,
                     int64_t t_ns_q12[], char message[TRACK_FILE_MESSAGE_MAX])
{
    const struct track_file_line *from = &file->line[line];
    uint64_t offset = from->first;
    for (uint32_t k = 0; k < from->count;) {
        struct track_file_bytes at = { .used = 0 };
        const uint32_t left = from->count - k;
        const uint32_t count =
            left < TRACK_FILE_TIMES ? left : TRACK_FILE_TIMES;
        const size_t size = (size_t)count * 8 + TRACK_FILE_CRC_BYTES;
        if (track_file_read_at(file, at.byte, size, offset, message) < 0)
            return -1;
        if (!track_file_is_whole(&at, size))
            return track_file_fail(message,
                                   "has damaged shots of line %s: their "
                                   "checksum is not the one expected",
                                   from->name);
        offset += size;
        for (uint32_t i = 0; i < count; i++, k++) {
            t_ns_q12[k] = track_file_get_i64(&at);
            if (t_ns_q12[k] < (k > 0 ? t_ns_q12[k - 1] : 0) ||
                t_ns_q12[k] > MOTION_TRACK_MAX_NS_Q12)
                return track_file_fail(
                    message, "shot %" PRIu32 " of line %s is out of order",
                    k + 1, from->name);
        }
    }
    return 0;
}

/* The blocks must fill the file. */
static int track_file_judge(struct track_file *file, bool has_events,
                            char message[TRACK_FILE_MESSAGE_MAX])
{
    uint64_t first = track_file_header_bytes(file->axis_count);
    for (unsigned i = 0; i < file->axis_count; i++) {
        if (track_file_judge_axis(file, i, first, message) < 0)
            return -1;
        first += (uint64_t)track_file_blocks(file->axis[i].segments) *
                 TRACK_FILE_BLOCK_BYTES;
    }
    if (has_events && track_file_read_events(file, &first, message) < 0)
        return -1;
    const int64_t size = file->files->size(file->files, file->file);
    if (size < 0)
        return track_file_fail(message, "%s", strerror((int)-size));
    if ((uint64_t)size != first)
        return track_file_fail(message,
                               "has %" PRIu64 " bytes, expected %" PRIu64
                               ": the file was cut or is damaged",
                               (uint64_t)size, first);
    return 0;
}

static int track_file_read_header(struct track_file *file,
                                  char message[TRACK_FILE_MESSAGE_MAX])
{
    struct track_file_bytes at = { .used = 0 };
    if (track_file_read_at(file, at.byte, TRACK_FILE_START_BYTES, 0, message) <
        0)
        return -1;
    if (memcmp(at.byte, TRACK_FILE_MAGIC, TRACK_FILE_MAGIC_BYTES) != 0)
        return track_file_fail(message, "is not a compiled move");
    at.used = TRACK_FILE_MAGIC_BYTES;
    const uint32_t version = (uint32_t)track_file_get(&at, 4);
    file->axis_count = (uint32_t)track_file_get(&at, 4);
    if (version != TRACK_FILE_VERSION && version != TRACK_FILE_EVENTS)
        return track_file_fail(message,
                               "has version %" PRIu32
                               ", expected %d or %d: compile it again",
                               version, TRACK_FILE_VERSION, TRACK_FILE_EVENTS);
    if (file->axis_count == 0 || file->axis_count > PLAN_AXES_MAX)
        return track_file_fail(message,
                               "has %" PRIu32 " axes, expected 1 to %d",
                               file->axis_count, PLAN_AXES_MAX);
    const uint32_t size = track_file_header_bytes(file->axis_count);
    if (track_file_read_at(file, at.byte, size, 0, message) < 0)
        return -1;
    if (!track_file_is_whole(&at, size))
        return track_file_fail(message, "has a damaged header: its checksum "
                                        "is not the one expected");
    bool texts = track_file_get_text(&at, file->title, sizeof file->title);
    file->axis = memory_new(file->axis_count, sizeof *file->axis);
    for (unsigned i = 0; i < file->axis_count; i++)
        texts = track_file_get_axis(&at, &file->axis[i]) && texts;
    if (!texts)
        return track_file_fail(message, "has a name that is none, expected "
                                        "printable characters and a 0");
    return track_file_judge(file, version == TRACK_FILE_EVENTS, message);
}

int track_file_open(struct track_file *file, const struct files *files,
                    const char *path, char message[TRACK_FILE_MESSAGE_MAX])
{
    memset(file, 0, sizeof *file);
    file->files = files;
    file->file = files->open(files, path);
    if (file->file < 0)
        return track_file_fail(message, "%s", strerror(-file->file));
    if (track_file_read_header(file, message) == 0)
        return 0;
    track_file_close(file);
    return -1;
}

void track_file_close(struct track_file *file)
{
    if (file->file >= 0)
        file->files->close(file->files, file->file);
    memory_free(file->axis);
    file->axis = NULL;
    file->file = -1;
}

/* --- blocks --------------------------------------------------------------- */

static int track_file_get_segment(struct track_file_bytes *at,
                                  struct motion_segment *segment)
{
    *segment =
        (struct motion_segment){ .start_ns_q12 = track_file_get_i64(at) };
    segment->dur_ns_q12 = track_file_get_i64(at);
    segment->pos_q32 = track_file_get_i64(at);
    for (int k = 0; k <= MOTION_TRACK_DEGREE; k++)
        segment->coef[k] = track_file_get_i64(at);
    segment->remainder = (int32_t)track_file_get(at, 4);
    const int32_t frac = (int32_t)track_file_get(at, 4);
    if (frac < INT8_MIN || frac > INT8_MAX)
        return MOTION_E_ARG;
    segment->frac = (int8_t)frac;
    return motion_segment_restore(segment);
}

static int track_file_bad(char message[TRACK_FILE_MESSAGE_MAX],
                          const struct track_file_axis *axis, uint32_t segment,
                          const char *what)
{
    return track_file_fail(message, "axis %s, segment %" PRIu32 ": %s",
                           axis->name, segment + 1, what);
}

int track_file_block(const struct track_file *file, unsigned axis,
                     uint32_t number,
                     struct motion_segment segment[TRACK_FILE_BLOCK],
                     uint32_t *count, char message[TRACK_FILE_MESSAGE_MAX])
{
    const struct track_file_axis *of = &file->axis[axis];
    const uint32_t first = number * TRACK_FILE_BLOCK;
    const uint32_t left = of->segments - first;
    struct track_file_bytes at;
    *count = left < TRACK_FILE_BLOCK ? left : TRACK_FILE_BLOCK;
    at.used = 0;
    if (track_file_read_at(
            file, at.byte, TRACK_FILE_BLOCK_BYTES,
            of->first + (uint64_t)number * TRACK_FILE_BLOCK_BYTES, message) < 0)
        return -1;
    if (!track_file_is_whole(&at, TRACK_FILE_BLOCK_BYTES))
        return track_file_bad(message, of, first,
                              "the block that starts here is damaged, its "
                              "checksum is not the one expected");
    if (track_file_get(&at, 4) != axis || track_file_get(&at, 4) != number ||
        track_file_get(&at, 4) != *count)
        return track_file_bad(message, of, first,
                              "the block that starts here belongs elsewhere");
    for (uint32_t i = 0; i < *count; i++)
        if (track_file_get_segment(&at, &segment[i]) < 0)
            return track_file_bad(message, of, first + i,
                                  "no plan has such numbers");
    return 0;
}

/* --- the whole of an axis ------------------------------------------------- */

struct track_file_walk {
    const struct track_file *file;
    unsigned axis;
    struct motion_track_outline *outline;
    struct motion_state end; /* of the segment before */
    int64_t end_ns_q12;
    char *message;
};

static int track_file_take(struct track_file_walk *walk,
                           const struct motion_segment *segment, uint32_t index)
{
    const struct track_file_axis *axis = &walk->file->axis[walk->axis];
    struct motion_extreme extreme[MOTION_JERK + 1];
    if (segment->start_ns_q12 != walk->end_ns_q12)
        return track_file_bad(walk->message, axis, index,
                              "does not begin when the one before ends");
    if (index > 0 && segment->pos_q32 != walk->end.pos_q32)
        return track_file_bad(walk->message, axis, index,
                              "does not begin where the one before ends");
    motion_segment_extremes(segment, extreme);
    for (int i = MOTION_POS; i <= MOTION_JERK; i++)
        motion_extreme_extend(&walk->outline->extreme[i], &extreme[i]);
    motion_segment_state(segment, segment->dur_ns_q12, &walk->end);
    walk->end_ns_q12 += segment->dur_ns_q12;
    return 0;
}

static int track_file_take_block(struct track_file_walk *walk, uint32_t number,
                                 int64_t *start_ns_q12)
{
    struct motion_segment segment[TRACK_FILE_BLOCK] = { 0 };
    uint32_t count;
    if (track_file_block(walk->file, walk->axis, number, segment, &count,
                         walk->message) < 0)
        return -1;
    *start_ns_q12 = segment[0].start_ns_q12;
    for (uint32_t i = 0; i < count; i++)
        if (track_file_take(walk, &segment[i], number * TRACK_FILE_BLOCK + i) <
            0)
            return -1;
    return 0;
}

static int track_file_take_end(const struct track_file_walk *walk)
{
    const struct track_file_axis *axis = &walk->file->axis[walk->axis];
    if (axis->segments == 0 ||
        (walk->end_ns_q12 == axis->end_ns_q12 &&
         memcmp(&walk->end, &axis->end, sizeof axis->end) == 0))
        return 0;
    return track_file_fail(
        walk->message, "axis %s does not end as its header says", axis->name);
}

/* An axis that never moves is where it ends. */
static void track_file_begin(const struct track_file_axis *axis,
                             struct motion_track_outline *outline)
{
    const struct motion_extreme none = { .min = INT64_MAX, .max = INT64_MIN };
    *outline = (struct motion_track_outline){ .count = axis->segments };
    for (int i = MOTION_POS; axis->segments > 0 && i <= MOTION_JERK; i++)
        outline->extreme[i] = none;
    if (axis->segments == 0)
        outline->extreme[MOTION_POS] =
            (struct motion_extreme){ .min = axis->end.pos_q32,
                                     .max = axis->end.pos_q32 };
}

int track_file_verify(const struct track_file *file, unsigned axis,
                      struct motion_track_outline *outline, uint32_t blocks,
                      int64_t *least_ns_q12,
                      char message[TRACK_FILE_MESSAGE_MAX])
{
    struct track_file_walk walk = {
        .file = file, .axis = axis, .outline = outline, .message = message
    };
    const uint32_t count = track_file_blocks(file->axis[axis].segments);
    int64_t start_ns_q12[TRACK_FILE_SPAN_MAX] = { 0 };

    track_file_begin(&file->axis[axis], outline);
    *least_ns_q12 = INT64_MAX;
    for (uint32_t i = 0; i < count; i++) {
        int64_t *const slot = &start_ns_q12[i % blocks];
        const int64_t before_ns_q12 = *slot;
        if (track_file_take_block(&walk, i, slot) < 0)
            return -1;
        if (i >= blocks && *slot - before_ns_q12 < *least_ns_q12)
            *least_ns_q12 = *slot - before_ns_q12;
    }
    return track_file_take_end(&walk);
}
