/* firmware/host/recording/record_read.h - a recording read back: rows, notes,
 * the files it comes from, and how it ended.
 *
 * One that was cut, or that is still being written, has all up to its last
 * whole chunk; a damaged chunk is passed over, and its rows are missing. */
#ifndef FIRMWARE_HOST_RECORDING_RECORD_READ_H
#define FIRMWARE_HOST_RECORDING_RECORD_READ_H

#include "firmware/host/recording/record.h"

struct record_pair {
    char key[32], value[RECORD_TEXT_MAX];
};

/* Whoever takes what is read; NULL: nobody. */
struct record_taker {
    void (*row)(void *context, const struct telemetry_row *row);
    void (*note)(void *context, int64_t t_ns, enum record_level level,
                 const char *text);
    void *context;
};

struct record_file {
    struct memory_pool memory;
    /* Its axes and trigger lines, with their names and units and no more. */
    struct rig rig;
    struct record_pair plan[RECORD_PAIRS_MAX], end[RECORD_PAIRS_MAX];
    unsigned plan_count, end_count;
    bool ended; /* the end was written */
    uint64_t rows, rows_missing;
    unsigned damaged; /* chunks */
};

/* `wanted`: rows are of this rig, whose axes are found by name, and zero where
 * the file has none of that name; NULL: of the file's own.  -1 with a sentence
 * when it is no recording of slew, or not of axes of that rig. */
int record_read(struct record_file *file, const struct files *files,
                const char *path, const struct rig *wanted,
                const struct record_taker *taker,
                char message[YAML_MESSAGE_MAX]);
void record_file_free(struct record_file *file);
/* "" when there is none. */
const char *record_value(const struct record_pair pair[], unsigned count,
                         const char *key);
/* 0 when there is none, or no number. */
int64_t record_integer(const struct record_pair pair[], unsigned count,
                       const char *key);

/* The attachment of that name, with a 0 after it, to be given back by
 * memory_free; NULL: there is none. */
char *record_attachment(const struct files *files, const char *path,
                        const char *name, size_t *length);

#endif
