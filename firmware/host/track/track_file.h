/* firmware/host/track/track_file.h - planned tracks in a file, to be played
 * without being held in memory.  docs/FORMATS.md describes every byte.
 *
 * A header names axes, units and counts; then every axis has its segments in
 * blocks of one size, so that any block is found without reading others; then
 * come what the move triggers and waits for, where it does.  The header and every
 * block end in a CRC-32.  A segment is stored as the integers
 * that define it (track.h); what is derived is derived again and judged on
 * reading, so that no file makes the tick overflow. */
#ifndef FIRMWARE_HOST_TRACK_TRACK_FILE_H
#define FIRMWARE_HOST_TRACK_TRACK_FILE_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "firmware/host/base/files.h"
#include "motion/core/track.h"
#include "motion/plan/move.h"

#define TRACK_FILE_BLOCK        32 /* segments */
#define TRACK_FILE_SEGMENTS_MAX 100000000
#define TRACK_FILE_UNIT_MAX     8 /* bytes with the 0 */
#define TRACK_FILE_MESSAGE_MAX  512

struct track_file_axis {
    char name[PLAN_NAME_MAX];
    char unit[TRACK_FILE_UNIT_MAX];
    uint32_t keys, segments;
    uint64_t first; /* offset of the first block */
    int64_t end_ns_q12;
    struct motion_state end;
    uint64_t end_frac;
};

/* What a line of the rig is triggered at: times of the move, rising. */
#define TRACK_FILE_LINES_MAX 8
#define TRACK_FILE_SHOTS_MAX 1000000
struct track_file_line {
    char name[PLAN_NAME_MAX];
    uint32_t count;
    uint64_t first;          /* offset of the first block */
    const int64_t *t_ns_q12; /* for writing: the caller's */
};

/* A shoot step by step: where its clock stands.  count 0: nowhere. */
struct track_file_step {
    char line[PLAN_NAME_MAX]; /* "": the operator says when it goes on */
    uint32_t count;
    int64_t first_ns_q12, period_ns_q12;
};

struct track_file {
    const struct files *files;
    int file; /* negative: not open */
    char title[128];
    struct track_file_axis *axis; /* reading: on the heap */
    uint32_t axis_count;
    struct track_file_line line[TRACK_FILE_LINES_MAX];
    uint32_t line_count;
    struct track_file_step step;
};

/* --- writing --- */

/* Names, units, keys, title, lines and steps are the caller's; counts of
 * segments, ends and offsets are taken from the tracks.  Errors show in ferror. */
void track_file_write(FILE *out, struct track_file *file,
                      const struct motion_track track[]);

/* --- reading --- */

/* Does the file begin as one of these? */
bool track_file_is(const struct files *files, const char *path);

/* The functions below return 0, or -1 with one sentence without a line end:
 * what is wrong with the file, and where. */

/* Read and judge the header. */
int track_file_open(struct track_file *file, const struct files *files,
                    const char *path, char message[TRACK_FILE_MESSAGE_MAX]);
void track_file_close(struct track_file *file);

/* Block `number` of an axis, 0 .. (segments - 1) / TRACK_FILE_BLOCK: its
 * segments, and how many there are in *count.  Safe to call from several
 * threads. */
int track_file_block(const struct track_file *file, unsigned axis,
                     uint32_t number,
                     struct motion_segment segment[TRACK_FILE_BLOCK],
                     uint32_t *count, char message[TRACK_FILE_MESSAGE_MAX]);

/* All times of a line, as many as it has, at most TRACK_FILE_SHOTS_MAX. */
int track_file_shots(const struct track_file *file, unsigned line,
                     int64_t t_ns_q12[], char message[TRACK_FILE_MESSAGE_MAX]);

/* Read all of an axis: every block is good, segments follow each other without
 * a gap and end where the header says.  Fills the outline, and the shortest
 * time that `blocks` blocks in a row take, 1 .. TRACK_FILE_SPAN_MAX (INT64_MAX
 * when there are no more than that). */
#define TRACK_FILE_SPAN_MAX 256
int track_file_verify(const struct track_file *file, unsigned axis,
                      struct motion_track_outline *outline, uint32_t blocks,
                      int64_t *least_ns_q12,
                      char message[TRACK_FILE_MESSAGE_MAX]);

#endif
