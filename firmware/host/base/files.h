/* firmware/host/base/files.h - files by name, as whoever runs host has them: a
 * disk, or what a browser keeps in memory.
 *
 * Host opens nothing itself and says nothing of where its own files are: the
 * program supplies a struct files. */
#ifndef FIRMWARE_HOST_BASE_FILES_H
#define FIRMWARE_HOST_BASE_FILES_H

#include <errno.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Kinds of files that come with slew. */
#define FILES_MAPS   "hal/maps"
#define FILES_QUIRKS "hal/quirks"

/* Bytes of a path and of a name, with the 0; names of one kind. */
#define FILES_PATH_MAX  512
#define FILES_NAME_MAX  40
#define FILES_NAMES_MAX 64

/* What fails returns a negative errno; files_error has the words. */
struct files {
    /* The same files for what a file names: regular ones alone, so that opening
     * one never waits and does nothing else.  NULL: there are no others. */
    const struct files *regular;
    /* A file to be read, 0 or more. */
    int (*open)(const struct files *files, const char *path);
    void (*close)(const struct files *files, int file);
    /* Its bytes from `offset` on, at least one and at most `size`; 0 at its end.
     * What cannot go back, such as a pipe, is read in order.  Safe to call from
     * several threads. */
    int64_t (*read)(const struct files *files, int file, void *to, size_t size,
                    uint64_t offset);
    /* How long it is. */
    int64_t (*size)(const struct files *files, int file);

    /* Where the file `name` of a kind is: a path when it ends in .yaml, counted
     * from the directory of the file `beside`, else NAME.yaml of slew's own.
     * false: there is none. */
    bool (*find)(const struct files *files, const char *kind, const char *name,
                 const char *beside, char path[FILES_PATH_MAX]);
    /* Those of a kind that come with slew, by name, sorted.  How many. */
    unsigned (*names)(const struct files *files, const char *kind,
                      char name[FILES_NAMES_MAX][FILES_NAME_MAX]);
};

/* For what a file names. */
static inline const struct files *files_regular(const struct files *files)
{
    return files->regular != NULL ? files->regular : files;
}

/* What is not a regular file, and what lies elsewhere than it may. */
#define FILES_E_KIND  (-ESPIPE)
#define FILES_E_PLACE (-EXDEV)
/* The words for a negative errno: strerror, and those of the two above. */
const char *files_error(int err);

/* All of a file of at most `max` bytes, with a 0 after them; *data is to be
 * freed.  Its length, or a negative errno: EFBIG when there is more. */
int64_t files_load(const struct files *files, const char *path, size_t max,
                   char **data);

/* The same of a text that another program wrote: without the byte order mark that
 * it may begin with, and what that says is UTF-16 as UTF-8. */
int64_t files_load_text(const struct files *files, const char *path, size_t max,
                        char **data);

/* A file of any length, line by line. */
#define FILES_PIECE    16384
#define FILES_LINE_MAX (1 << 20)
struct files_lines {
    const struct files *files;
    int file;
    int error; /* negative errno of what failed; 0 */
    uint64_t offset;
    size_t at, got; /* in the piece */
    char *line;     /* the present one, with a 0 in the place of its LF */
    size_t capacity;
    char piece[FILES_PIECE];
};

/* 0 or a negative errno. */
int files_lines_open(struct files_lines *lines, const struct files *files,
                     const char *path);
void files_lines_close(struct files_lines *lines);
/* The length of the next line; -1 after the last, and where reading fails or
 * there are more than FILES_LINE_MAX bytes (EFBIG). */
int64_t files_lines_next(struct files_lines *lines);

#endif
