/* firmware/linux/fmu/fmu_files.h - the files that a rig is read from, taken along
 * and found again.
 *
 * Who exports reads the rig through a record, which notes what was looked up and
 * opened, and packs those files.  Who simulates reads it through the list of what
 * was noted, from wherever the files have been unpacked.  The list is text, a
 * line each, tabs between its words:
 *
 *   token   TOKEN
 *   rig     PATH                  which is the rig's
 *   open    PATH  FILE            bytes of PATH, in FILE of the directory
 *   find    KIND  NAME  BESIDE  PATH
 *   name    KIND  NAME */
#ifndef FIRMWARE_LINUX_FMU_FMU_FILES_H
#define FIRMWARE_LINUX_FMU_FMU_FILES_H

#include <stdbool.h>

#include "firmware/host/base/files.h"
#include "firmware/host/base/memory.h"

#define FMU_LIST      "files.txt"
#define FMU_TOKEN_MAX 40
#define FMU_WORDS     5

struct fmu_line {
    const char *word[FMU_WORDS]; /* "" where the line has no more */
};

struct fmu_files {
    struct files files;
    struct memory_pool memory;
    struct fmu_line *line;
    unsigned count;
    char directory[FILES_PATH_MAX]; /* of those that are read back */
    unsigned opened;
};

/* For a rig that is read from the file `rig`.  All zero before. */
void fmu_files_record(struct fmu_files *self, const char *rig);
/* Read the list in a directory; -1 when it is not one. */
int fmu_files_open(struct fmu_files *self, const char *directory);
void fmu_files_free(struct fmu_files *self);

/* "" when there is none. */
const char *fmu_files_rig(const struct fmu_files *self);
const char *fmu_files_token(const struct fmu_files *self);
/* A line without a tab or a line end in its words: true. */
bool fmu_line_is_plain(const struct fmu_line *line);

#endif
