/* firmware/host/track/track_file.c - writing and the bytes; see track_file.h.
 */
#include "firmware/host/track/track_file.h"

#include <string.h>

#include "firmware/host/track/track_file_bytes.h"
#include "hal/support/crc32.h"

/* --- little-endian -------------------------------------------------------- */

void track_file_put(struct track_file_bytes *at, uint64_t value, unsigned size)
{
    for (unsigned i = 0; i < size; i++)
        at->byte[at->used++] = (unsigned char)(value >> 8 * i);
}

uint64_t track_file_get(struct track_file_bytes *at, unsigned size)
{
    uint64_t value = 0;
    for (unsigned i = 0; i < size; i++)
        value |= (uint64_t)at->byte[at->used++] << 8 * i;
    return value;
}

static void track_file_put_text(struct track_file_bytes *at, const char *text,
                                size_t size)
{
    size_t length = strlen(text);
    memset(at->byte + at->used, 0, size);
    memcpy(at->byte + at->used, text, length < size ? length : size - 1);
    at->used += size;
}

/* --- writing -------------------------------------------------------------- */

static void track_file_flush(FILE *out, struct track_file_bytes *at)
{
    track_file_put(at, crc32_of(0, at->byte, at->used), 4);
    fwrite(at->byte, 1, at->used, out);
    at->used = 0;
}

static void track_file_put_axis(struct track_file_bytes *at,
                                const struct track_file_axis *axis)
{
    track_file_put_text(at, axis->name, PLAN_NAME_MAX);
    track_file_put_text(at, axis->unit, TRACK_FILE_UNIT_MAX);
    track_file_put(at, axis->keys, 4);
    track_file_put(at, axis->segments, 4);
    track_file_put(at, axis->first, 8);
    track_file_put(at, (uint64_t)axis->end_ns_q12, 8);
    track_file_put(at, (uint64_t)axis->end.pos_q32, 8);
    track_file_put(at, (uint64_t)axis->end.vel_q32, 8);
    track_file_put(at, (uint64_t)axis->end.acc_q32, 8);
    track_file_put(at, (uint64_t)axis->end.jerk_q32, 8);
    track_file_put(at, axis->end_frac, 8);
}

static void track_file_put_segment(struct track_file_bytes *at,
                                   const struct motion_segment *segment)
{
    track_file_put(at, (uint64_t)segment->start_ns_q12, 8);
    track_file_put(at, (uint64_t)segment->dur_ns_q12, 8);
    track_file_put(at, (uint64_t)segment->pos_q32, 8);
    for (int k = 0; k <= MOTION_TRACK_DEGREE; k++)
        track_file_put(at, (uint64_t)segment->coef[k], 8);
    track_file_put(at, (uint64_t)segment->remainder, 4);
    track_file_put(at, (uint64_t)segment->frac, 4);
}

static void track_file_write_block(FILE *out, struct track_file_bytes *at,
                                   unsigned axis, uint32_t number,
                                   const struct motion_track *track)
{
    const uint32_t first = number * TRACK_FILE_BLOCK;
    const uint32_t left = track->count - first;
    const uint32_t count = left < TRACK_FILE_BLOCK ? left : TRACK_FILE_BLOCK;

    track_file_put(at, axis, 4);
    track_file_put(at, number, 4);
    track_file_put(at, count, 4);
    for (uint32_t i = 0; i < count; i++)
        track_file_put_segment(at, &track->segment[first + i]);
    memset(at->byte + at->used, 0,
           TRACK_FILE_BLOCK_BYTES - TRACK_FILE_CRC_BYTES - at->used);
    at->used = TRACK_FILE_BLOCK_BYTES - TRACK_FILE_CRC_BYTES;
    track_file_flush(out, at);
}

static void track_file_set_axis(struct track_file_axis *axis,
                                const struct motion_track *track,
                                uint64_t first)
{
    axis->segments = track->count;
    axis->first = first;
    axis->end_ns_q12 = track->end_ns_q12;
    axis->end = track->end;
    axis->end_frac = track->end_frac;
}

/* --- events ----------------------------------------------------------------- */

static bool track_file_has_events(const struct track_file *file)
{
    return file->line_count > 0 || file->step.count > 0;
}

static void track_file_write_events(FILE *out, struct track_file_bytes *at,
                                    struct track_file *file, uint64_t first)
{
    track_file_put(at, file->line_count, 4);
    track_file_put(at, file->step.count, 4);
    track_file_put(at, (uint64_t)file->step.first_ns_q12, 8);
    track_file_put(at, (uint64_t)file->step.period_ns_q12, 8);
    track_file_put_text(at, file->step.line, PLAN_NAME_MAX);
    first += track_file_events_bytes(file->line_count);
    for (unsigned i = 0; i < file->line_count; i++) {
        struct track_file_line *line = &file->line[i];
        line->first = first;
        first += track_file_times_bytes(line->count);
        track_file_put_text(at, line->name, PLAN_NAME_MAX);
        track_file_put(at, line->count, 4);
        track_file_put(at, line->first, 8);
    }
    track_file_flush(out, at);
    for (unsigned i = 0; i < file->line_count; i++)
        for (uint32_t k = 0; k < file->line[i].count; k++) {
            track_file_put(at, (uint64_t)file->line[i].t_ns_q12[k], 8);
            if (k + 1 == file->line[i].count || (k + 1) % TRACK_FILE_TIMES == 0)
                track_file_flush(out, at);
        }
}

void track_file_write(FILE *out, struct track_file *file,
                      const struct motion_track track[])
{
    static const char magic[] = TRACK_FILE_MAGIC;
    struct track_file_bytes at = { .used = 0 };
    uint64_t first = track_file_header_bytes(file->axis_count);

    for (unsigned i = 0; i < file->axis_count; i++) {
        track_file_set_axis(&file->axis[i], &track[i], first);
        first += (uint64_t)track_file_blocks(track[i].count) *
                 TRACK_FILE_BLOCK_BYTES;
    }
    for (size_t i = 0; i < TRACK_FILE_MAGIC_BYTES; i++)
        track_file_put(&at, (unsigned char)magic[i], 1);
    track_file_put(&at,
                   track_file_has_events(file) ? TRACK_FILE_EVENTS
                                               : TRACK_FILE_VERSION,
                   4);
    track_file_put(&at, file->axis_count, 4);
    track_file_put_text(&at, file->title, sizeof file->title);
    for (unsigned i = 0; i < file->axis_count; i++)
        track_file_put_axis(&at, &file->axis[i]);
    track_file_flush(out, &at);
    for (unsigned i = 0; i < file->axis_count; i++)
        for (uint32_t k = 0; k < track_file_blocks(track[i].count); k++)
            track_file_write_block(out, &at, i, k, &track[i]);
    if (track_file_has_events(file))
        track_file_write_events(out, &at, file, first);
}
